"""A report in a browser: plots, slider and scene are in step."""

import json

import pytest
from chromium import until
from tests.unit.report.test_report import HEIGHT, falling_block

from conftest import start
from sheldrake.report import SaveReport

BODY = "/drake/visualizer/two_hole_block/body"
POSITION = (
    "(() => { const v = document.getElementById('scene').contentWindow.__viserMutable; "
    f"const n = v.nodeRefFromName[{json.dumps(BODY)}], r = v.nodeRefFromName['']; "
    "n.updateWorldMatrix(true, false); r.updateWorldMatrix(true, false); "
    "return r.matrixWorld.clone().invert().multiply(n.matrixWorld).elements[14]; })()"
)


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    path = tmp_path_factory.mktemp("report") / "block.html"
    simulator, *_ = falling_block()
    SaveReport(simulator, path, title="A block falls")
    with start(offline=True, width=1400, height=1000) as browser:
        page = browser.open(path.as_uri())
        page.wait_for("window.report && !window.report.changed")
        yield page


def height(page):
    return page.evaluate(POSITION)


def near(value, wanted, tolerance=2e-3):
    return abs(value - wanted) < tolerance


def test_it_opens_without_a_network_and_without_errors(page, pictures):
    until(lambda: near(height(page), HEIGHT))
    assert [url for url in page.requests() if not url.startswith("file:")] == []
    assert page.console() == []
    page.screenshot(pictures, "report.png", 1400, 1400)


def test_the_slider_moves_scene_and_cursors(page):
    page.evaluate(
        "(() => { const s = document.getElementById('time'); s.value = 0.1; s.dispatchEvent(new Event('input')); })()"
    )
    assert page.evaluate("report.time") == pytest.approx(0.1)
    until(lambda: near(height(page), HEIGHT - 0.5 * 9.81 * 0.01))
    cursors = page.evaluate("report.plots.map((p) => (p.cursorX - 52) / (p.box.clientWidth - 60))")
    assert cursors == pytest.approx([0.1] * 4, abs=2e-3)
    assert page.evaluate("document.getElementById('now').textContent") == "0.100 s"


def test_pointing_into_a_plot_moves_the_scene(page):
    page.evaluate("scrollTo(0, 0)")
    left, width, y = page.evaluate(
        "(() => { const b = report.plots[1].box.getBoundingClientRect();"
        " return [b.x, b.width, b.y + b.height / 2]; })()"
    )
    for t, z in ((0.05, HEIGHT - 0.5 * 9.81 * 0.0025), (0.9, None)):
        x = left + 52 + t * (width - 60)
        page.call("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y)
        page.wait_for(f"Math.abs(report.time - {t}) < 0.01")
        if z is not None:
            until(lambda wanted=z: near(height(page), wanted))
        else:
            until(lambda: height(page) < 0.02)
    assert float(page.evaluate("document.getElementById('time').value")) == pytest.approx(0.9, abs=0.01)


def test_play_and_contacts(page):
    page.evaluate("document.querySelector('.seek').click()")
    assert page.evaluate("report.time") == pytest.approx(0.142, abs=3e-3)
    page.evaluate("document.getElementById('play').click()")
    assert page.evaluate("report.playing") is True
    page.wait_for("report.playing === false && report.time === 1")
    assert page.evaluate("document.getElementById('play').textContent") == "Play"
    until(lambda: height(page) < 0.02)


def test_zoom_is_in_step_and_can_be_undone(page):
    page.evaluate(
        "(() => { const b = report.plots[0].box, r = b.getBoundingClientRect(); b.dispatchEvent(new "
        "WheelEvent('wheel', {deltaY: -400, ctrlKey: true, clientX: r.x + r.width / 2, cancelable: true})); })()"
    )
    assert page.evaluate("report.to - report.from") < 0.8
    page.evaluate("report.plots[2].box.dispatchEvent(new MouseEvent('dblclick'))")
    assert page.evaluate("[report.from, report.to]") == pytest.approx([0.0, 1.0])


def test_the_buttons_of_the_stretch_of_time(page):
    page.evaluate("document.querySelector('.seek').click()")
    for _ in range(3):
        page.evaluate("document.getElementById('closer').click()")
    moment, begin, end = page.evaluate("[report.time, report.from, report.to]")
    assert end - begin == pytest.approx(1 / 8, abs=1e-6) and begin < moment < end
    limits = page.evaluate("['min', 'max'].map((end) => Number(document.getElementById('time')[end]))")
    assert limits == pytest.approx([begin, end])
    page.evaluate("document.getElementById('play').click()")
    page.wait_for(f"report.time > {end} + 0.05")  # what is shown goes along
    page.evaluate("report.playing && document.getElementById('play').click()")
    assert page.evaluate("report.from <= report.time && report.time <= report.to")
    page.evaluate("document.getElementById('farther').click()")
    assert page.evaluate("report.to - report.from") > 0.15
    page.click_on("document.getElementById('all')")
    assert page.evaluate("[report.from, report.to]") == pytest.approx([0.0, 1.0])


def test_lines_can_be_hidden(page):
    page.evaluate("document.querySelector('.plots').scrollTo(0, 0)")
    scale = "report.plots[1].Y(0) - report.plots[1].Y(0.01)"  # the rest moves less: it is drawn larger
    before = page.evaluate(scale)
    button = "[...document.querySelectorAll('.legend')[1].querySelectorAll('button')][2]"
    page.click_on(button)
    assert page.evaluate(f"{button}.getAttribute('aria-pressed')") == "false"
    assert page.evaluate(scale) > 2 * before
    page.click_on(button)
    assert page.evaluate(scale) == pytest.approx(before)


@pytest.mark.parametrize(("width", "height", "dark"), [(1280, 800, False), (1280, 800, True), (390, 844, False)])
def test_it_fits_a_laptop_a_phone_and_the_dark(page, pictures, width, height, dark):
    scheme = "dark" if dark else "light"
    page.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
    page.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=width < 500)
    page.wait_for(f"document.documentElement.scrollWidth <= {width}")
    background = page.evaluate("getComputedStyle(document.body).backgroundColor")
    assert (background == "rgb(255, 255, 255)") is not dark
    page.screenshot(pictures, f"report-{width}-{scheme}.png", width, height)
    page.call("Emulation.setEmulatedMedia", features=[])


def test_everything_has_a_name_for_those_who_do_not_see_it(page):
    nameless = page.evaluate(
        "[...document.querySelectorAll('input, select, button, iframe, [role=img], [role=region], table')].filter((e) "
        "=> !(e.labels && e.labels.length) && !e.getAttribute('aria-label')"
        " && !e.title && !e.textContent.trim()).length"
    )
    assert nameless == 0
    levels = page.evaluate("[...document.querySelectorAll('h1,h2,h3')].map((h) => Number(h.tagName[1]))")
    assert levels[0] == 1 and set(levels[1:]) == {2}
