"""What SetProperty, the drawing calls and the cameras do, by their effect in the page."""

import base64
import io
import json

import numpy as np
import pytest
from chromium import until
from PIL import Image
from test_meshcat_page import READY, at

from sheldrake.geometry import Box, Meshcat, Rgba
from sheldrake.math import RigidTransform
from sheldrake.perception import BaseField, Fields, PointCloud


@pytest.fixture
def meshcat():
    meshcat = Meshcat(port=0)
    meshcat.SetObject("box", Box(0.2, 0.2, 0.2), Rgba(0.2, 0.4, 0.8))
    return meshcat


@pytest.fixture
def page(chromium, meshcat):
    page = chromium.open(meshcat.web_url())
    page.wait_for(READY)
    page.wait_until_at("/drake/box", [0, 0, 0])
    return page


def node(path, expression):
    """A JavaScript expression of the node `n` of a path; null while there is none."""
    return f"((n) => n ? {expression} : null)(window.__viserMutable.nodeRefFromName[{json.dumps(path)}])"


def pixel(page, x, y):
    picture = Image.open(io.BytesIO(base64.b64decode(page.call("Page.captureScreenshot", format="png")["data"])))
    return picture.convert("RGB").getpixel((x, y))


def materials(path, what):
    collect = f"n.traverse((o) => {{ if (o.isMesh) all.push(o.material.{what}); }})"
    return node(path, f"(() => {{ const all = []; {collect}; return all; }})()")


SIZE = """(() => {
  let size = null;
  n.updateWorldMatrix(true, true);
  n.traverse((o) => {
    if (!o.isMesh || size) return;
    o.geometry.computeBoundingBox();
    const e = o.matrixWorld.elements, { min, max } = o.geometry.boundingBox;
    const scale = [0, 4, 8].map((k) => Math.hypot(e[k], e[k + 1], e[k + 2]));
    size = [scale[0] * (max.x - min.x), scale[1] * (max.y - min.y), scale[2] * (max.z - min.z)];
  });
  return size;
})()"""


def test_place_size_and_opacity(page, meshcat):
    meshcat.SetProperty("box", "position", [1.0, 2.0, 3.0])
    page.wait_until_at("/drake/box", [1, 2, 3])
    meshcat.SetProperty("box", "scale", [1.0, 2.0, 3.0])
    size = node("/drake/box/<object>", SIZE)
    until(lambda: np.allclose(page.evaluate(size) or 0, [0.2, 0.4, 0.6], atol=1e-6))
    meshcat.SetProperty("box", "opacity", 0.25)
    page.wait_for(f"({materials('/drake/box/<object>', 'opacity')} || []).includes(0.25)")
    meshcat.SetProperty("box", "modulated_opacity", 0.5)
    until(lambda: any(0.1 < o < 0.6 for o in page.evaluate(materials("/drake/box/<object>", "opacity"))))


def test_grid_axes_and_background(page, meshcat):
    for path in ("/Grid", "/Axes"):
        for shown in (False, True):
            meshcat.SetProperty(path, "visible", shown)
            page.wait_for(node(path, f"n.visible === {json.dumps(shown)}"))
    meshcat.SetProperty("/Grid", "visible", False)
    for name in ("top_color", "bottom_color"):
        meshcat.SetProperty("/Background", name, [0.0, 1.0, 0.0])
    until(lambda: pixel(page, 20, 400) == (0, 255, 0))
    meshcat.SetProperty("/Background", "visible", False)
    until(lambda: pixel(page, 20, 400) == (255, 255, 255))


def test_lines_points_and_meshes(page, meshcat):
    meshcat.SetLineSegments("segments", np.zeros((3, 2)), np.eye(3)[:, :2], 2.0, Rgba(1, 0, 0))
    cloud = PointCloud(4, Fields(BaseField.kXYZs | BaseField.kRGBs))
    cloud.mutable_xyzs()[:] = np.arange(12).reshape(3, 4)
    cloud.mutable_rgbs()[:] = 200
    meshcat.SetObject("cloud", cloud, 0.05)
    corners, faces = np.array([[0.0, 1, 0, 1], [0, 0, 1, 1], [0, 0, 0, 0]]), np.array([[0, 1], [1, 3], [2, 2]])
    meshcat.SetTriangleMesh("triangles", corners, faces, Rgba(0, 1, 0), wireframe=True)
    meshcat.SetTriangleColorMesh("colors", corners, faces, np.eye(3, 4))
    page.wait_for(materials("/drake/triangles/<object>", "wireframe") + "?.includes(true)")
    page.wait_for(materials("/drake/colors/<object>", "vertexColors") + "?.includes(true)")
    for name, count in (("cloud", 4), ("segments", 1)):
        points = (
            "(() => { let c = 0; n.traverse((o) => { if (o.geometry) c += o.geometry.attributes.position.count; });"
        )
        page.wait_for(node(f"/drake/{name}/<object>", f"{points} return c >= {count}; }})()"))


def test_cameras(page, meshcat):
    camera = "window.__viserMutable.camera"
    meshcat.SetCamera(Meshcat.PerspectiveCamera(fov=40.0))
    page.wait_for(f"Math.abs({camera}.fov - 40) < 1e-3")
    meshcat.Set2dRenderMode(RigidTransform([0, 0, 1]), -1, 1, -1, 1)
    page.wait_for(f"{camera}.fov < 5 && !window.__viserMutable.nodeRefFromName['/Grid'].visible")
    meshcat.ResetRenderMode()
    page.wait_for(f"{camera}.fov > 30 && window.__viserMutable.nodeRefFromName['/Grid'].visible")
    meshcat.SetTransform("box", at(0, 0, 1))
    page.wait_until_at("/drake/box", [0, 0, 1])


def test_the_saved_page_keeps_what_was_set(offline_chromium, meshcat, tmp_path):
    meshcat.SetProperty("box", "position", [1.0, 2.0, 3.0])
    meshcat.SetProperty("/Grid", "visible", False)
    meshcat.SetObject("hidden", Box(1, 1, 1))
    meshcat.SetProperty("hidden", "visible", False)
    (tmp_path / "scene.html").write_text(meshcat.StaticHtml(), encoding="utf-8")
    page = offline_chromium.open((tmp_path / "scene.html").as_uri())
    page.wait_until_at("/drake/box", [1, 2, 3])
    page.wait_for(node("/Grid", "!n.visible"))
    page.wait_for(node("/drake/hidden", "!n.visible"))
    assert page.console() == []
