"""A model that plays in the page: it falls, is pulled by the mouse, pauses and goes back."""

import contextlib
import threading
import time

import numpy as np
import pytest
from chromium import until
from test_meshcat_calls_page import slide
from test_meshcat_page import READY
from test_model_visualizer_page import button

from sheldrake.visualization import ModelVisualizer

BRICK = """<robot name='brick'><link name='body'><inertial><mass value='2'/>
<inertia ixx='.01' iyy='.01' izz='.01' ixy='0' ixz='0' iyz='0'/></inertial>
<visual><geometry><box size='.2 .2 .2'/></geometry><material name='m'><color rgba='.2 .5 .8 1'/></material></visual>
<collision><geometry><box size='.2 .2 .2'/></geometry></collision></link>{more}</robot>"""
ROD = """<link name='rod'><inertial><origin xyz='0 0 .2'/><mass value='1'/>
<inertia ixx='.01' iyy='.01' izz='.01' ixy='0' ixz='0' iyz='0'/></inertial>
<visual><origin xyz='0 0 .2'/><geometry><cylinder radius='.02' length='.4'/></geometry></visual></link>
<joint name='hinge' type='revolute'><axis xyz='0 1 0'/><origin xyz='0 0 .1'/><parent link='body'/><child link='rod'/>
<limit lower='-1' upper='1' effort='1' velocity='1'/></joint>"""
BODY = "/drake/illustration/brick/body"
AT = f"""(() => {{
  const viewer = window.__viserMutable, node = viewer.nodeRefFromName["{BODY}"];
  node.updateWorldMatrix(true, false);
  const p = viewer.camera.position.clone().setFromMatrixPosition(node.matrixWorld).project(viewer.camera);
  const box = viewer.canvas.getBoundingClientRect();
  return [box.left + (p.x + 1) / 2 * box.width, box.top + (1 - p.y) / 2 * box.height];
}})()"""
CTRL = 2


def mouse(page, kind, x, y, **more):
    page.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", modifiers=CTRL, **more)


@contextlib.contextmanager
def shown(chromium, folder, more="", **options):
    """A visualizer of the brick that runs, and its page."""
    file = folder / "brick.urdf"
    file.write_text(BRICK.format(more=more))
    visualizer = ModelVisualizer(publish_contacts=False, simulate=True, **options)
    visualizer.AddModels(file)
    visualizer.Finalize()
    visualizer.meshcat().SetCameraPose([1.5, -1.5, 0.8], [0.0, 0.0, 0.2])
    thread = threading.Thread(target=visualizer.Run, daemon=True)
    thread.start()
    page = chromium.open(visualizer.meshcat().web_url())
    page.wait_for(READY)
    yield visualizer, page
    page.press("Escape", "Escape")
    thread.join(60)
    assert not thread.is_alive() and page.console() == []


@pytest.fixture
def playing(chromium, tmp_path):
    with shown(chromium, tmp_path) as (visualizer, page):
        page.wait_until_at(BODY, [0, 0, 0.1])
        yield visualizer, page


def test_a_model_falls_is_pulled_pauses_and_goes_back(playing, pictures):
    visualizer, page = playing
    meshcat, context = visualizer.meshcat(), visualizer._context
    assert context.get_time() == 0.0 and page.evaluate("window.__sheldrake.bodies") == []
    meshcat.SetSliderValue("body_z", 0.5)
    page.wait_until_at(BODY, [0, 0, 0.5])
    page.click_on(button("Play / Pause"))
    page.wait_until_at(BODY, [0, 0, 0.1], tolerance=1e-3)
    page.wait_for("window.__sheldrake.bodies.length === 1")

    x, y = page.evaluate(AT)
    mouse(page, "mouseMoved", x, y)
    mouse(page, "mousePressed", x, y, clickCount=1)
    page.wait_for("!!document.querySelector('svg.sheldrake-spring')")
    camera = page.evaluate("window.__viserMutable.camera.matrixWorld.elements.join()")
    for k in range(8):
        mouse(page, "mouseMoved", x, y - 15 * k, buttons=1)
    until(lambda: page.position(BODY)[2] > 0.25)
    page.screenshot(pictures, "pulled-by-the-mouse.png")
    assert page.evaluate("window.__viserMutable.camera.matrixWorld.elements.join()") == camera, "the camera stays"
    mouse(page, "mouseReleased", x, y - 120, clickCount=1)
    page.wait_for("!document.querySelector('svg.sheldrake-spring')")
    until(lambda: meshcat._grabs.held() is None)
    until(lambda: page.position(BODY)[2] < 0.2)

    page.click_on(button("Play / Pause"))
    until(lambda: not visualizer._playback.is_playing)
    page.wait_for("window.__sheldrake.bodies.length === 0")
    stopped = context.get_time()
    time.sleep(0.3)
    assert context.get_time() == stopped > 0.0
    page.click_on(button("Reset"))
    page.wait_until_at(BODY, [0, 0, 0.5])
    assert context.get_time() == 0.0 and meshcat.GetSliderValue("body_z") == 0.5


def test_a_page_that_is_closed_lets_go(playing, chromium):
    visualizer, page = playing
    page.click_on(button("Play / Pause"))
    page.wait_for("window.__sheldrake.bodies.length === 1")
    other = chromium.open(visualizer.meshcat().web_url())
    other.wait_for(READY)
    other.wait_until_at(BODY, [0, 0, 0.1], tolerance=1e-2)
    other.wait_for("window.__sheldrake.bodies.length === 1")
    x, y = other.evaluate(AT)
    mouse(other, "mouseMoved", x, y)
    mouse(other, "mousePressed", x, y, clickCount=1)
    until(lambda: visualizer.meshcat()._grabs.held() is not None)
    chromium.close_page(other)
    until(lambda: visualizer.meshcat()._grabs.held() is None)


def test_base_and_joints_are_moved_by_the_mouse_at_random_and_home(chromium, tmp_path, pictures):
    with shown(chromium, tmp_path, ROD) as (visualizer, page):
        meshcat = visualizer.meshcat()
        page.wait_until_at(BODY, [0, 0, 0.1])
        for name, share, wanted in (("body_x", 0.7, 0.8), ("body_yaw", 0.25, -np.pi / 2), ("hinge", 0.75, 0.5)):
            there = lambda name=name, wanted=wanted: abs(meshcat.GetSliderValue(name) - wanted) < 0.3  # noqa: E731
            slide(page, share, there, name=name)
        x, yaw, angle = map(meshcat.GetSliderValue, ("body_x", "body_yaw", "hinge"))
        page.wait_until_at(BODY, [x, 0, 0.1], tolerance=1e-5)
        plant, context = visualizer._plant, visualizer._plant_context
        X_WB = plant.EvalBodyPoseInWorld(context, plant.GetBodyByName("body"))
        np.testing.assert_allclose(X_WB.rotation().matrix()[:2, 0], [np.cos(yaw), np.sin(yaw)], rtol=0, atol=1e-12)
        page.screenshot(pictures, "moved-by-sliders.png")
        page.click_on(button("Random Posture"))
        until(lambda: meshcat.GetSliderValue("hinge") != angle)
        assert [meshcat.GetSliderValue(name) for name in ("body_x", "body_yaw")] == [x, yaw]
        page.click_on(button("Home"))
        until(lambda: not any(map(meshcat.GetSliderValue, ("body_x", "body_yaw", "hinge"))))
        page.wait_until_at(BODY, [0, 0, 0.1])


def test_a_welded_base_stays_where_it_is_while_the_rest_falls(chromium, tmp_path):
    with shown(chromium, tmp_path, ROD, weld_base=True) as (visualizer, page):
        meshcat = visualizer.meshcat()
        assert [name for name in meshcat.GetSliderNames() if name.startswith("body")] == []
        meshcat.SetSliderValue("hinge", 0.3)
        page.wait_until_at(BODY, [0, 0, 0])
        page.click_on(button("Play / Pause"))
        until(lambda: visualizer._plant.GetPositions(visualizer._plant_context)[0] > 0.6)
        page.wait_until_at(BODY, [0, 0, 0])


def test_a_click_welds_the_base_where_it_is_and_another_frees_it(chromium, tmp_path):
    with shown(chromium, tmp_path, ROD) as (visualizer, page):
        meshcat, hinge = visualizer.meshcat(), lambda: visualizer._plant.GetPositions(visualizer._plant_context)[-1]
        meshcat.SetSliderValue("body_z", 0.5)
        meshcat.SetSliderValue("hinge", 0.3)
        page.wait_until_at(BODY, [0, 0, 0.5])
        page.click_on(button("Weld / Free Base"))
        page.wait_for("document.body.innerText.includes('The base is welded')")
        page.click_on(button("Play / Pause"))
        until(lambda: hinge() > 0.6)
        page.wait_until_at(BODY, [0, 0, 0.5])
        page.click_on(button("Weld / Free Base"))
        page.wait_until_at(BODY, [None, None, 0.1], tolerance=1e-2)
