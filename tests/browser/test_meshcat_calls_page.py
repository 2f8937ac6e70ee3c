"""Calls of Meshcat by their effect on the page: light, cameras, controls by the mouse, recordings, saved scenes."""

import functools
import http.server
import io
import json
import threading
import time
import zipfile

import numpy as np
import pytest
from chromium import PATIENCE, until
from PIL import Image
from test_meshcat_page import READY, at, fall, scene
from test_meshcat_properties_page import pixel

from sheldrake.geometry import Box, Meshcat, MeshcatAnimation
from sheldrake.math import RigidTransform

BUTTON = "[...document.querySelectorAll('button')].find((b) => b.textContent.trim() === {!r})"
CAMERA = """(() => { const v = window.__viserMutable, root = v.nodeRefFromName[""];
  root.updateWorldMatrix(true, false);
  const inverse = root.matrixWorld.clone().invert();
  const p = v.camera.position.clone().applyMatrix4(inverse);
  const ahead = v.camera.getWorldDirection(v.camera.position.clone()).transformDirection(inverse);
  return [p.x, p.y, p.z, ahead.x, ahead.y, ahead.z]; })()"""


@pytest.fixture
def meshcat():
    return scene()


@pytest.fixture
def page(chromium, meshcat):
    page = chromium.open(meshcat.web_url() + "?tracked_camera=on")
    page.wait_for(READY)
    page.wait_until_at("/drake/block", [0, 0, 0.2])
    return page


def test_a_picture_all_around(page, meshcat, tmp_path, pictures):
    meshcat.Delete("ground")
    meshcat.SetProperty("/Grid", "visible", False)
    sky = np.zeros((64, 128, 3), np.uint8)
    sky[:32], sky[32:] = (0, 0, 255), (0, 255, 0)  # above, and below the horizon
    Image.fromarray(sky).save(tmp_path / "sky.png")
    nodes = "window.__viserMutable.nodeRefFromName"
    page.wait_for(f"!{nodes}['/drake/ground'] && !{nodes}['/Grid'].visible")
    until(lambda: min(pixel(page, 20, 400)) > 240)  # nothing but the page's own white, as it will be in the end
    meshcat.SetEnvironmentMap(tmp_path / "sky.png")
    scene = "window.__viserMutable.scene"
    page.wait_for(f"{scene}.background && {scene}.background.image.width === 128")
    page.wait_for(f"{scene}.environment === {scene}.background")

    def is_sky():
        red, green, blue = pixel(page, 20, 400)
        return red < 200 and abs(green - blue) > 100

    until(is_sky)
    page.screenshot(pictures, "environment.png")
    meshcat.SetEnvironmentMap("")
    until(lambda: min(pixel(page, 20, 400)) > 240)
    assert page.evaluate(f"{scene}.background") is None
    assert page.console() == []


def test_the_camera_and_its_target(page, meshcat):
    meshcat.SetCameraPose([2.0, 0.0, 0.5], [0.0, 0.0, 0.5])
    until(lambda: np.allclose(page.evaluate(CAMERA), [2, 0, 0.5, -1, 0, 0], atol=1e-3))
    meshcat.SetCameraTarget([2.0, 3.0, 0.5])
    until(lambda: np.allclose(page.evaluate(CAMERA), [2, 0, 0.5, 0, 1, 0], atol=1e-3))


def test_the_camera_that_a_person_moves_is_told(page, meshcat):
    meshcat.SetCameraPose([2.0, 0.0, 0.5], [0.0, 0.0, 0.5])

    def is_told():
        X_WC = meshcat.GetTrackedCameraPose()
        seen = page.evaluate(CAMERA)
        return X_WC is not None and np.allclose(
            np.hstack([X_WC.translation(), X_WC.rotation().matrix()[:, 2]]), seen, atol=1e-2
        )

    until(is_told)
    before = page.evaluate(CAMERA)
    page.call("Input.dispatchMouseEvent", type="mousePressed", x=250, y=300, button="left", clickCount=1)
    for x in (280, 310, 340):
        page.call("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=300, button="left", buttons=1)
    page.call("Input.dispatchMouseEvent", type="mouseReleased", x=340, y=300, button="left", clickCount=1)
    until(lambda: not np.allclose(page.evaluate(CAMERA), before, atol=0.1))
    until(is_told)


def slide(page, share, is_there, seconds=PATIENCE, name=""):
    """Clicks on the track of the first slider whose label begins so, as often as a person does, until it is there."""
    deadline = time.monotonic() + seconds
    while not is_there():
        assert time.monotonic() < deadline, f"the slider did not move in {seconds} s"
        x, y, width, height = page.wait_for(
            f"""(() => {{ const label = (e) => /[a-z]/i.test(e.innerText) ? e.innerText.trim() : label(e.parentElement);
              const t = [...document.querySelectorAll('.mantine-Slider-trackContainer')]
                .find((track) => label(track).startsWith({json.dumps(name)}));
              if (!t) return null; t.scrollIntoView({{block: "center", behavior: "instant"}});
              const r = t.getBoundingClientRect(); return [r.x, r.y, r.width, r.height]; }})()"""
        )
        page.click(x + share * width, y + height / 2)
        settled = time.monotonic() + 5.0
        while not is_there() and time.monotonic() < settled:
            time.sleep(0.05)


def test_a_slider_by_the_mouse_and_what_is_deleted(page, meshcat):
    meshcat.AddSlider("gain", 0.0, 10.0, 0.5, 2.0)
    meshcat.AddSlider("offset", 0.0, 1.0, 0.1, 0.5)
    meshcat.AddButton("Kick")
    meshcat.AddButton("Push")
    page.wait_for(f"!!({BUTTON.format('Push')})")  # the panel no longer moves
    for share, wanted in ((0.9, 9.0), (0.1, 1.0)):
        slide(page, share, lambda wanted=wanted: abs(meshcat.GetSliderValue("gain") - wanted) <= 0.5)
    assert meshcat.GetSliderValue("offset") == 0.5
    page.wait_for(f"!!({BUTTON.format('Push')})")
    meshcat.DeleteButton("Kick")
    page.wait_for(f"!({BUTTON.format('Kick')})")
    meshcat.DeleteSlider("gain")
    page.wait_for("!document.body.innerText.includes('gain') && document.body.innerText.includes('offset')")
    page.click_on(BUTTON.format("Push"))
    until(lambda: meshcat.GetButtonClicks("Push") == 1)
    meshcat.SetSimulationTime(12.5)
    page.wait_for("document.body.innerText.includes('12.5')")


def test_a_recording_is_played_by_clicks_and_deleted(page, meshcat):
    meshcat.StartRecording(set_visualizations_while_recording=False)
    list(fall(meshcat, 0.2, np.arange(0, 300.0, 0.5), record=True, gravity=3e-6))  # longer than any page takes to draw
    meshcat.StopRecording()
    recording = meshcat.get_mutable_recording()
    assert isinstance(recording, MeshcatAnimation)
    recording.set_autoplay(False)
    meshcat.PublishRecording()
    page.wait_for(f"!!({BUTTON.format('Play')})")
    page.watch("/drake/block")
    page.click_on(BUTTON.format("Play"))
    until(lambda: len({round(z, 4) for _, _, z in page.watched()}) > 3)
    page.click_on(BUTTON.format("Pause"))
    page.wait_for(f"!!({BUTTON.format('Play')})")
    meshcat.DeleteRecording()
    meshcat.PublishRecording()
    page.wait_for(f"!({BUTTON.format('Play')})")


def test_an_animation_made_by_hand(page, meshcat):
    animation = MeshcatAnimation(frames_per_second=32.0)
    animation.SetTransform(0, "block", RigidTransform([0.0, 0.0, 0.2]))
    animation.SetTransform(32, "block", RigidTransform([0.0, 0.5, 0.2]))
    animation.set_loop_mode(MeshcatAnimation.LoopMode.kLoopOnce)
    animation.set_clamp_when_finished(True)
    meshcat.SetAnimation(animation)
    page.wait_until_at("/drake/block", [0, 0.5, 0.2])


def test_a_saved_folder_is_served_and_played(chromium, meshcat, tmp_path):
    meshcat.StartRecording()
    list(fall(meshcat, 0.2, np.arange(0, 10.0, 1 / 64), record=True, gravity=0.03))
    meshcat.StopRecording()
    meshcat.PublishRecording()
    zipfile.ZipFile(io.BytesIO(meshcat.StaticZip())).extractall(tmp_path)

    class Quiet(http.server.SimpleHTTPRequestHandler):
        def log_message(self, *_):
            pass

    handler = functools.partial(Quiet, directory=str(tmp_path))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        address = f"http://127.0.0.1:{server.server_address[1]}"
        page = chromium.open(f"{address}/meshcat.html")
        page.wait_for(READY)
        page.watch("/drake/block")
        until(lambda: max((z for _, _, z in page.watched()), default=0) > 0.1)
        page.wait_until_at("/drake/block", [0, 0, 0.03])
        assert all(url.startswith(address) for url in page.requests())
        chromium.close_page(page)
        server.shutdown()


def test_the_address_of_the_socket_answers(chromium):
    meshcat = Meshcat(port=0)
    meshcat.SetObject("box", Box(0.2, 0.2, 0.2))
    meshcat.SetTransform("box", at(0, 0, 1))
    page = chromium.open(f"{meshcat.web_url()}/?websocket={meshcat.ws_url()}")
    page.wait_until_at("/drake/box", [0, 0, 1])
