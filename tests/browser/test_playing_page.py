"""A model that plays in the page: it falls, is pulled by the mouse, pauses and goes back."""

import threading
import time

import pytest
from chromium import until
from test_meshcat_page import READY
from test_model_visualizer_page import button

from sheldrake.visualization import ModelVisualizer

BRICK = """<robot name='brick'><link name='body'><inertial><mass value='2'/>
<inertia ixx='.01' iyy='.01' izz='.01' ixy='0' ixz='0' iyz='0'/></inertial>
<visual><geometry><box size='.2 .2 .2'/></geometry><material name='m'><color rgba='.2 .5 .8 1'/></material></visual>
<collision><geometry><box size='.2 .2 .2'/></geometry></collision></link></robot>"""
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


@pytest.fixture
def playing(chromium, tmp_path):
    file = tmp_path / "brick.urdf"
    file.write_text(BRICK)
    visualizer = ModelVisualizer(publish_contacts=False, simulate=True)
    visualizer.AddModels(file)
    visualizer.Finalize()
    visualizer.meshcat().SetCameraPose([1.5, -1.5, 0.8], [0.0, 0.0, 0.2])
    thread = threading.Thread(target=visualizer.Run, daemon=True)
    thread.start()
    page = chromium.open(visualizer.meshcat().web_url())
    page.wait_for(READY)
    page.wait_until_at(BODY, [0, 0, 0.1])
    yield visualizer, page
    page.press("Escape", "Escape")
    thread.join(60)
    assert not thread.is_alive() and page.console() == []


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
    page.screenshot(pictures / "pulled-by-the-mouse.png")
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
