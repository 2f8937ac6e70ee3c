"""What a person sees: the page of a Meshcat in a real browser."""

import time
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest
from chromium import until

import sheldrake
from sheldrake.geometry import (
    Box,
    Capsule,
    Cylinder,
    Ellipsoid,
    HalfSpace,
    Mesh,
    Meshcat,
    MeshcatCone,
    Rgba,
    Sphere,
)

BLOCK = Path(sheldrake.__file__).parent / "models" / "two_hole_block" / "two_hole_block.obj"
READY = "!!(window.__viserMutable && window.__viserMutable.scene && window.__viserMutable.nodeRefFromName['/Grid'])"


def at(x, y, z):
    X = np.eye(4)
    X[:3, 3] = x, y, z
    return X


def fall(meshcat, height, times, record=False, gravity=9.81):
    """Drops "block" by hand: free fall, then rest at z = 0.03."""

    class Pose:
        def __init__(self, z):
            self.z = z

        def GetAsMatrix34(self):
            return at(0, 0, self.z)[:3]

    for t in times:
        meshcat.SetTransform("block", Pose(max(0.03, height - gravity * t**2 / 2)), float(t) if record else None)
        yield t


def scene():
    meshcat = Meshcat(port=0)
    meshcat.SetObject("ground", HalfSpace(), Rgba(0.75, 0.75, 0.72))
    meshcat.SetObject("block", Mesh(str(BLOCK), 1e-3), Rgba(0.2, 0.45, 0.8))
    meshcat.SetTransform("block", at(0, 0, 0.2))
    return meshcat


def test_block_moves_and_rests(chromium, pictures):
    meshcat = scene()
    page = chromium.open(meshcat.web_url())
    page.wait_for(READY)
    assert page.evaluate("document.title") == "sheldrake"
    page.wait_until_at("/drake/block", [0, 0, 0.2])
    page.screenshot(pictures, "block-start.png")
    page.watch("/drake/block")
    for z in (0.15, 0.1, 0.06, 0.03):  # a page drawn without a graphics card shows a few pictures a second: wait for it
        meshcat.SetTransform("block", at(0, 0, z))
        meshcat.Flush()
        page.wait_until_at("/drake/block", [0, 0, z])
    heights = [z for _, _, z in page.watched()]
    assert len(set(heights)) >= 3 and heights == sorted(heights, reverse=True)
    page.screenshot(pictures, "block-rest.png")
    assert page.console() == []
    assert all(url.startswith(meshcat.web_url()) for url in page.requests())


def test_late_and_reloaded_pages_see_the_scene_as_it_is(chromium):
    meshcat = scene()
    meshcat.SetTransform("block", at(0, 0, 0.5))
    pages = [chromium.open(meshcat.web_url()) for _ in range(2)]
    for page in pages:
        page.call("Page.bringToFront")  # a hidden page draws nothing
        page.wait_for(READY)
        page.wait_until_at("/drake/block", [0, 0, 0.5])
    until(lambda: meshcat.GetNumActiveConnections() == 2)
    meshcat.SetTransform("block", at(0, 0, 0.6))
    pages[0].call("Page.reload")
    time.sleep(0.5)
    for page in pages:
        page.call("Page.bringToFront")
        page.wait_for(READY)
        page.wait_until_at("/drake/block", [0, 0, 0.6])


def test_every_shape_is_drawn(chromium, pictures):
    meshcat = scene()
    shapes = [
        Box(0.05, 0.05, 0.1),
        Sphere(0.03),
        Cylinder(0.03, 0.1),
        Capsule(0.02, 0.05),
        Ellipsoid(0.02, 0.03, 0.05),
        MeshcatCone(0.1, 0.02, 0.03),
    ]
    for i, shape in enumerate(shapes):
        meshcat.SetObject(f"shape{i}", shape, Rgba(0.9, 0.2 + 0.1 * i, 0.1, 0.5 if i == 1 else 1))
        meshcat.SetTransform(f"shape{i}", at(0.15 * (i - 2.5), 0.3, 0.1))
    x, y = np.meshgrid(np.linspace(-0.3, 0.3, 25), np.linspace(-0.5, -0.2, 15))
    meshcat.PlotSurface("surface", x, y, 0.05 + 0.03 * np.sin(20 * x) * np.cos(20 * y), Rgba(0.3, 0.7, 0.4))
    meshcat.SetLine("line", np.array([[-0.4, 0, 0.4], [0.4, 0.4, 0.4], [0.1, 0.2, 0.1]]), 3.0, Rgba(0.8, 0, 0))
    page = chromium.open(meshcat.web_url())
    page.wait_for(READY)
    for name in [f"shape{i}" for i in range(6)] + ["surface", "line", "block", "ground"]:
        box = page.wait_for(
            f"""(() => {{
              const node = window.__viserMutable.nodeRefFromName["/drake/{name}/<object>"];
              if (!node) return null;
              let vertices = 0;
              node.traverse((o) => {{ if (o.geometry) vertices += o.geometry.attributes.position.count; }});
              return vertices;
            }})()"""
        )
        assert box > 1, name
    time.sleep(1)
    page.screenshot(pictures, "shapes.png")
    assert page.console() == []


def test_visible_color_and_delete(chromium):
    meshcat = scene()
    page = chromium.open(meshcat.web_url())
    page.wait_for(READY)
    shown = "window.__viserMutable.nodeRefFromName['/drake/block'].visible"
    meshcat.SetProperty("block", "visible", False)
    page.wait_for(f"!{shown}")
    meshcat.SetProperty("block", "visible", True)
    page.wait_for(shown)
    color = """(() => { let c = null;
      window.__viserMutable.nodeRefFromName['/drake/block/<object>'].traverse((o) => {
        if (o.isMesh && o.material && o.material.color) c = c || o.material.color.getHexString(); });
      return c; })()"""
    meshcat.SetProperty("block", "color", [1.0, 0.0, 0.0, 1.0])
    page.wait_for(f"{color} === 'ff0000'")
    meshcat.Delete("block")
    page.wait_for("!window.__viserMutable.nodeRefFromName['/drake/block']")


def test_buttons_sliders_and_keys_both_ways(chromium, pictures):
    meshcat = scene()
    meshcat.AddButton("Kick it", "KeyK")
    meshcat.AddSlider("speed", 0.0, 10.0, 0.5, 2.0, "ArrowLeft", "ArrowRight")
    page = chromium.open(meshcat.web_url())
    page.wait_for(READY)
    find = "[...document.querySelectorAll('button')].find((b) => b.textContent.includes('Kick it'))"
    page.click_on(find)
    until(lambda: meshcat.GetButtonClicks("Kick it") == 1)
    page.press("k", "KeyK")
    until(lambda: meshcat.GetButtonClicks("Kick it") == 2)
    page.press("ArrowRight", "ArrowRight")
    until(lambda: meshcat.GetSliderValue("speed") == 2.5)
    shown = "[...document.querySelectorAll('input')].map((i) => i.value)"
    page.wait_for(f"{shown}.includes('2.5')")
    meshcat.SetSliderValue("speed", 7.5)
    page.wait_for(f"{shown}.includes('7.5')")
    meshcat.SetRealtimeRate(0.97)
    page.wait_for("document.body.innerText.includes('97 % of real time')")
    page.screenshot(pictures, "controls.png")
    meshcat.DeleteAddedControls()
    page.wait_for(f"!({find})")


def test_camera(chromium):
    meshcat = scene()
    page = chromium.open(meshcat.web_url() + "?tracked_camera=on")
    page.wait_for(READY)
    meshcat.SetCameraPose([1.0, 2.0, 3.0], [0.0, 0.0, 0.0])
    camera = """(() => { const v = window.__viserMutable;
      const root = v.nodeRefFromName[""]; root.updateWorldMatrix(true, false);
      const p = v.camera.position.clone().applyMatrix4(root.matrixWorld.clone().invert());
      return [p.x, p.y, p.z]; })()"""
    until(lambda: np.allclose(page.evaluate(camera), [1, 2, 3], atol=1e-3))


def test_recording_plays_in_the_page(chromium):
    meshcat = scene()
    meshcat.StartRecording()
    list(fall(meshcat, 0.2, np.arange(0, 10.0, 1 / 64), record=True, gravity=0.03))
    meshcat.StopRecording()
    page = chromium.open(meshcat.web_url())
    page.wait_for(READY)
    page.wait_until_at("/drake/block", [0, 0, 0.03])
    page.watch("/drake/block")
    meshcat.PublishRecording()
    until(lambda: max((z for _, _, z in page.watched()), default=0) > 0.1, 120)
    page.wait_until_at("/drake/block", [0, 0, 0.03], seconds=120)
    page.wait_for("document.body.innerText.includes('Recording')")


def test_exported_page_replays_without_network(offline_chromium, tmp_path, pictures):
    meshcat = scene()
    meshcat.StartRecording()
    list(fall(meshcat, 0.2, np.arange(0, 10.0, 1 / 64), record=True, gravity=0.03))
    meshcat.StopRecording()
    meshcat.PublishRecording()
    file = tmp_path / "block.html"
    file.write_text(meshcat.StaticHtml(), encoding="utf-8")
    del meshcat
    page = offline_chromium.open(file.as_uri())
    page.wait_for(READY)
    page.watch("/drake/block")
    until(lambda: max((z for _, _, z in page.watched()), default=0) > 0.1, 120)
    page.wait_until_at("/drake/block", [0, 0, 0.03], seconds=120)
    page.screenshot(pictures, "replay.png")
    assert [url for url in page.requests() if not url.startswith("file:")] == []
    assert page.console() == []


@pytest.mark.parametrize(("ground", "contrast"), [(HalfSpace(), 0.2), (Box(4, 4, 1), 0.02)])
def test_the_grid_gives_way_to_the_ground(chromium, tmp_path, ground, contrast):
    """In one plane with the ground it flickered through, and hid it."""
    meshcat = Meshcat(port=0)
    meshcat.SetObject("ground", ground, Rgba(0.75, 0.75, 0.72))
    meshcat.SetTransform("ground", at(0, 0, 0 if isinstance(ground, HalfSpace) else -0.5))
    meshcat.SetObject("block", Box(0.2, 0.1, 0.1), Rgba(0.2, 0.4, 0.8))
    meshcat.SetTransform("block", at(0, 0, 0.05))
    page = chromium.open(meshcat.web_url())
    page.wait_for(READY)
    meshcat.SetCameraPose([3, -3, 0.6], [0, 0, 0])
    page.wait_for("(() => { let done = 0; window.__viserMutable.nodeRefFromName['/Grid'].traverse("
                  "(o) => { done += !!(o.material && !o.material.depthWrite); }); return done; })()")  # fmt: skip
    file = tmp_path / "grid.png"

    def only_ground():
        """The grid's lines on nothing are far brighter than the ground; a half space has lines of its own, little
        darker. A page that is being loaded is bright all over: it fades in."""
        page.screenshot(file.parent, file.name)
        brightness = plt.imread(file)[460:620, 420:780, :3].mean(axis=2)
        return brightness.max() < 0.9 and np.ptp(brightness) < contrast

    until(only_ground, 120)


def test_without_a_graphics_card_little_light_is_filtered(chromium):
    """What lights the scene is small there: filtering it at full size kept the page empty for a quarter of a minute."""
    meshcat = scene()
    page = chromium.open(meshcat.web_url())
    page.wait_for(READY)
    light = "window.__viserMutable.scene.environment"
    page.wait_for(f"{light} && {light}.image.width === 256 && {light}.image.height === 128")
