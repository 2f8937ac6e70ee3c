"""A page that simulates: from a file, without a network, by real mouse events."""

import json
import pathlib
import shutil
import struct
import subprocess

import numpy as np
import pytest
from test_accessible_pages import keeps_the_rules
from tests.unit.export import exported_pages
from tests.unit.export.exported_pages import SCENES, falling_block, simulator_of

from conftest import start
from sheldrake.common.eigen_geometry import Quaternion
from sheldrake.export import Freeze, FrozenSimulation, PageSlider, SavePage, ShowPage

pytest.importorskip("ziglang")
RUN = pathlib.Path(exported_pages.__file__).with_name("run_page.mjs")
PLAYS = "document.getElementById('play')"
STATE = "Array.from(simulation.machine.vector(simulation.machine.about.states.find((s) => s.elements.length)))"


def opened(browser, path):
    page = browser.open(path.as_uri())
    page.wait_for("window.simulation && simulation.ready")
    return page


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pages")
    push = PageSlider("plant/applied_generalized_force", -5.0, 5.0, element=3, label="push along x", unit="N")
    SavePage(falling_block(), folder / "block.html", title="A block falls", sliders=[push])
    return folder


@pytest.fixture(scope="module")
def browser():
    with start(offline=True, width=860, height=420) as browser:  # without a graphics card, each pixel costs
        yield browser


@pytest.fixture
def block(browser, files):
    page = opened(browser, files / "block.html")
    page.wait_for("simulation.shown")
    yield page
    browser.close_page(page)


def state_of(page):
    return np.array(page.evaluate(STATE))


def middle(page, path="/drake/visualizer/two_hole_block/body"):
    """Where the origin of a body's drawing is in the window [px], a little inside the body."""
    return page.evaluate(
        f"""(() => {{
          const frame = document.getElementById("scene"), view = frame.contentWindow.__viserMutable;
          const node = view.nodeRefFromName[{json.dumps(path)}], box = frame.getBoundingClientRect();
          let mesh; node.traverse((o) => {{ if (o.isMesh && !mesh) mesh = o; }});
          mesh.geometry.computeBoundingBox();
          mesh.updateWorldMatrix(true, false);
          const Vector = view.camera.position.constructor, p = mesh.geometry.boundingBox.getCenter(new Vector());
          p.z = mesh.geometry.boundingBox.max.z; // in the middle of the face on top
          p.applyMatrix4(mesh.matrixWorld).project(view.camera);
          const c = view.canvas.getBoundingClientRect();
          return [box.x + c.x + (p.x + 1) / 2 * c.width, box.y + c.y + (1 - p.y) / 2 * c.height];
        }})()"""
    )


def mouse(page, kind, x, y, modifiers=0):
    pressed = 0 if kind == "mouseReleased" else 1
    more = {"button": "left", "buttons": pressed, "clickCount": 1, "modifiers": modifiers}
    page.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, **more)


@pytest.mark.parametrize("name", SCENES)
def test_it_opens_from_a_file_and_gives_the_native_numbers(browser, tmp_path, pictures, name):
    """Of every scene; Node, where there is one, has the same bits."""
    simulator, scene, path = simulator_of(name), SCENES[name], tmp_path / "page.html"
    SavePage(simulator, path, title=name.capitalize())
    assert path.stat().st_size < 2e6
    frozen = FrozenSimulation(Freeze(simulator))
    page = opened(browser, path)
    page.wait_for("simulation.shown")
    seen = []
    for time, tolerance in ((scene.before, 1e-9), (scene.after, 1e-6)):
        page.evaluate(f"simulation.machine.advanceTo({time})")
        frozen.AdvanceTo(time)
        native = np.concatenate([frozen.GetState(s) for s in frozen.frozen.state_names()])
        seen.append(page.evaluate("simulation.machine.words()"))
        found = np.array([int(word, 16) for word in seen[-1].split()], np.uint64).view(float)
        np.testing.assert_allclose(found, native, rtol=0, atol=tolerance)
    assert [url for url in page.requests() if not url.startswith("file:")] == []
    assert page.console() == []
    hint = page.evaluate("document.querySelector('.hint').textContent")
    has_free_body = name not in ("arm", "inverse", "cart-pole")
    assert ("Drag a free body" in hint) == has_free_body and "pull on a body" in hint.lower()
    page.evaluate("++simulation.moves")  # draws what is now
    page.screenshot(pictures, f"page-{name}.png", 1280, 800)
    browser.close_page(page)
    if shutil.which("node") is None:
        pytest.skip("there is no node to compare bits with")
    command = ["node", str(RUN), str(path), str(scene.before), str(scene.after)]
    assert subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines() == seen


def test_its_memory_does_not_grow(block):
    """Plots are full, and then a minute goes by."""

    def used():
        block.call("HeapProfiler.collectGarbage")
        heap = block.call("Runtime.getHeapUsage")["usedSize"]
        return heap, block.evaluate("simulation.machine.floats.buffer.byteLength")

    def simulate(seconds):
        for _ in range(seconds):
            block.evaluate("simulation.machine.advanceTo(simulation.machine.time + 1)")
        block.evaluate(
            """new Promise((drawn) => {
              let pictures = 0;
              const count = () => (++pictures < 20 ? requestAnimationFrame(count) : drawn());
              count();
            })"""
        )

    block.evaluate("document.getElementById('speed').value = '5'")
    block.click_on(PLAYS)
    simulate(10)
    before = used()
    simulate(60)
    after = used()
    assert after[1] == before[1]
    assert after[0] < before[0] + 2e5  # samples alone, were they kept, would be 6.7e6


def test_pictures_are_not_blocked_by_steps_that_take_long(block):
    """On a clock on which each step takes a millisecond, as the block's would on a computer a thousand times slower."""
    block.evaluate(
        """(() => {
          const { machine } = simulation, advance = machine.advance.bind(machine), { steps } = machine.about.words;
          let clock = 0, picture = 0;
          window.taken = []; // of each picture: by calls
          const count = () => { taken.push([]); requestAnimationFrame(count); };
          count();
          Object.defineProperty(performance, "now", { value: () => clock });
          machine.advance = (...words) => {
            const before = machine.ints[steps], code = advance(...words), done = Number(machine.ints[steps] - before);
            clock += done;
            taken.at(-1).push(done);
            return code;
          };
          document.getElementById("speed").value = "5";
        })()"""
    )
    block.click_on(PLAYS)
    block.wait_for("document.getElementById('note').textContent.includes('Slower than asked for')")
    block.wait_for("taken.filter((calls) => calls.length).length > 40")
    block.click_on(PLAYS)
    late = [calls for calls in block.evaluate("taken") if calls][30:]
    assert max(map(max, late)) <= 6  # 4 ms are asked for, once it is known what a step costs
    assert max(map(sum, late)) <= 16  # 11 ms of the 16.7 between pictures


def test_play_pause_step_and_reset(block, pictures):
    first = state_of(block)
    block.click_on(PLAYS)
    block.wait_for("simulation.machine.time > 0.3")
    block.screenshot(pictures, "page-runs.png", 1280, 800)
    block.click_on(PLAYS)
    assert block.evaluate("simulation.playing") is False
    assert block.evaluate("simulation.records[0].count > 100")
    time = block.evaluate("simulation.machine.time")
    block.click_on("document.getElementById('step')")
    assert block.evaluate("simulation.machine.time") == pytest.approx(time + 1e-3, abs=1e-9)
    rested = state_of(block)
    assert rested[6] < first[6] - 0.05  # it has fallen
    block.click_on("document.getElementById('reset')")
    assert block.evaluate("simulation.machine.time") == 0.0
    np.testing.assert_array_equal(state_of(block), first)
    block.evaluate("document.activeElement.blur()")
    block.press(" ", "Space")
    block.wait_for("simulation.playing && simulation.machine.time > 0.01")
    block.press(" ", "Space")
    block.wait_for("!simulation.playing")


def test_a_body_is_dragged_to_where_it_begins(block):
    first = state_of(block)
    x, y = middle(block)
    mouse(block, "mousePressed", x, y)
    for k in range(1, 6):
        mouse(block, "mouseMoved", x, y - 8 * k)
    mouse(block, "mouseReleased", x, y - 40)
    moved = state_of(block)
    np.testing.assert_array_equal(moved[:4], first[:4])
    assert moved[6] > first[6] + 0.005  # up, as on the screen
    block.click_on("document.getElementById('step')")
    block.click_on("document.getElementById('reset')")
    np.testing.assert_array_equal(state_of(block), moved)  # that is where it begins now


def test_a_body_is_turned_to_how_it_begins(block, pictures):
    shift, first = 8, state_of(block)
    x, y = middle(block)
    mouse(block, "mousePressed", x, y, shift)
    mouse(block, "mouseMoved", x + 75, y, shift)  # an eighth of a turn
    mouse(block, "mouseReleased", x + 75, y, shift)
    turned = state_of(block)
    np.testing.assert_array_equal(turned[4:], first[4:])
    q, half = Quaternion(first[:4] / np.linalg.norm(first[:4])), np.pi / 8
    expected = Quaternion(np.cos(half), 0.0, 0.0, np.sin(half)).multiply(q).wxyz()
    np.testing.assert_allclose(turned[:4], expected, atol=1e-12)
    block.screenshot(pictures, "page-turned.png", 1280, 800)


def test_a_notebook_shows_it(browser, tmp_path, pictures):
    """In a frame that has no address."""
    shown = ShowPage(falling_block().get_system(), title="A block <falls>", height=600)
    path = tmp_path / "notebook.html"
    path.write_text(f"<!DOCTYPE html><meta charset='utf-8'><p>Out[1]:</p>{shown._repr_html_()}", encoding="utf-8")
    page = browser.open(path.as_uri())
    frame = "document.querySelector('iframe').contentWindow"
    page.wait_for(f"{frame}.simulation && {frame}.simulation.shown")
    assert page.evaluate(f"{frame}.document.title") == "A block <falls>"
    page.evaluate(f"{frame}.document.getElementById('play').click()")
    page.wait_for(f"{frame}.simulation.machine.time > 0.1")
    assert page.evaluate(f"{frame}.document.getElementById('link').hidden") is True
    page.screenshot(pictures, "page-notebook.png", 1000, 700)
    assert page.console() == []
    browser.close_page(page)


def test_a_body_is_pulled_while_it_runs(block):
    block.click_on(PLAYS)
    block.wait_for("simulation.machine.time > 0.5")  # it lies
    rested = state_of(block)
    x, y = middle(block)
    mouse(block, "mousePressed", x, y)
    mouse(block, "mouseMoved", x, y - 90)
    block.wait_for(f"{STATE}[6] > {rested[6] + 0.02}")  # it hangs on the spring
    assert block.evaluate("simulation.pulled.length") == 3
    mouse(block, "mouseReleased", x, y - 90)
    port = "simulation.machine.about.inputs.find((i) => i.name.endsWith('generalized_force'))"
    force = f"Array.from(simulation.machine.vector({port}))"
    assert block.evaluate(force) == [0.0] * 6
    block.wait_for(f"{STATE}[6] < {rested[6] + 0.02}")  # and falls


def test_a_slider_pushes(block):
    slider = "document.getElementById('slider0')"
    left, top, width, height = block.evaluate(
        f"(() => {{ const r = {slider}.getBoundingClientRect(); return [r.x, r.y, r.width, r.height]; }})()"
    )
    block.click(left + 0.95 * width, top + height / 2)
    assert block.evaluate(f"Number({slider}.value)") > 3.0
    block.click_on(PLAYS)
    block.wait_for("simulation.machine.time > 0.3")
    assert state_of(block)[10] > 0.1  # m/s along x, before or after it lands
    assert state_of(block)[4] > 0.01


def test_a_state_goes_on_with_the_same_bits_from_a_link_and_is_refused_elsewhere(block):
    block.evaluate("simulation.machine.advanceTo(0.2)")
    block.click_on("document.getElementById('link')")
    link = block.wait_for("location.hash.startsWith('#state=') && location.hash")
    block.evaluate("simulation.machine.advanceTo(0.5)")
    expected = [struct.pack("<d", v) for v in state_of(block)]
    block.evaluate("location.hash = ''")
    block.evaluate(f"location.hash = {json.dumps(link)}")
    block.wait_for("simulation.machine.time === 0.2")
    block.evaluate("simulation.machine.advanceTo(0.5)")
    assert [struct.pack("<d", v) for v in state_of(block)] == expected
    block.evaluate("location.hash = '#state=0123456789abcdef.AAAA'")
    block.wait_for("document.getElementById('note').textContent.includes('belongs to another page')")
    broken = link[:30] + "AAAAAAAA" + link[38:]
    block.evaluate(f"location.hash = {json.dumps(broken)}")
    block.wait_for("document.getElementById('note').textContent.includes('cannot be loaded')")
    assert block.evaluate("simulation.machine.time") == 0.5


@pytest.mark.parametrize(("width", "height", "dark"), [(1280, 800, True), (390, 844, False)])
def test_it_fits_a_phone_and_the_dark(block, pictures, width, height, dark):
    scheme = "dark" if dark else "light"
    block.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
    block.call(
        "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=width < 500
    )
    block.wait_for(f"document.documentElement.scrollWidth <= {width}")
    assert (block.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)") is not dark
    block.screenshot(pictures, f"page-{width}-{scheme}.png", width, height)


def test_it_keeps_the_rules_of_accessibility(block):
    keeps_the_rules(block)


def test_names_with_markup_stay_names(browser, tmp_path):
    path = tmp_path / "bad.html"
    bad = "</script><img src=x onerror=window.bad=1>"
    SavePage(falling_block(name=bad), path, title=bad)
    page = opened(browser, path)
    page.wait_for("simulation.shown")
    assert page.evaluate("document.querySelector('h1').textContent") == bad
    assert page.evaluate("document.title") == bad
    captions = page.evaluate("[...document.querySelectorAll('figcaption')].map((f) => f.textContent)")
    assert any(bad in text for text in captions)
    assert page.evaluate("document.querySelectorAll('img').length") == 0
    frame = "document.getElementById('scene').contentWindow"
    seen = page.evaluate(f"[window.bad, {frame}.bad, {frame}.document.querySelectorAll('img[src=x]').length]")
    assert seen == [None, None, 0]
