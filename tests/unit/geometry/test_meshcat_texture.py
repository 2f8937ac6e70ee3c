"""Pictures on shapes in a Meshcat."""

import numpy as np
import pytest
from PIL import Image

from sheldrake.geometry import Box, Capsule, Convex, Cylinder, Ellipsoid, Meshcat, Rgba, Sphere
from sheldrake.geometry._meshcat.nodes import _textured


@pytest.fixture
def picture(tmp_path):
    """Left half red, right half blue."""
    pixels = np.zeros((8, 16, 3), np.uint8)
    pixels[:, :8, 0] = pixels[:, 8:, 2] = 255
    Image.fromarray(pixels).save(tmp_path / "picture.png")
    return tmp_path / "picture.png"


def drawn(shape, picture, **options):
    meshcat = Meshcat(port=0)
    meshcat.SetObject("a", shape, diffuse_map=picture, **options)
    return meshcat._hub.tree.get("/drake/a").object


@pytest.mark.parametrize(
    "shape", [Box(1, 2, 3), Sphere(0.5), Cylinder(0.5, 2), Capsule(0.5, 1), Ellipsoid(1, 2, 3)], ids=lambda s: str(s)
)
def test_a_picture_lies_on_the_whole_of_a_shape(shape, picture):
    mesh = drawn(shape, picture)
    uv = mesh.texture.uv
    assert uv.shape == (len(mesh.vertices), 2)
    assert uv.min() > -1e-9 and uv[:, 1].max() < 1 + 1e-9 and np.ptp(uv, axis=0) == pytest.approx([1, 1], abs=0.6)
    corners = uv[mesh.faces]
    assert np.ptp(corners, axis=1)[:, 0].max() <= 1 + 1e-9, "no triangle holds the picture twice"
    areas = np.linalg.norm(np.cross(*np.diff(mesh.vertices[mesh.faces], axis=1).transpose(1, 0, 2)), axis=1)
    assert (areas > 0).mean() > 0.9


def test_each_side_of_a_box_has_the_whole_picture(picture):
    mesh = drawn(Box(1, 2, 3), picture)
    for axis in range(3):
        for side in (-1, 1):
            on = np.flatnonzero(mesh.vertices[:, axis] == side * (axis + 1) / 2)
            faces = [f for f in mesh.faces if set(f) <= set(on)]
            assert {tuple(uv) for uv in mesh.texture.uv[np.ravel(faces)]} == {(0, 0), (0, 1), (1, 0), (1, 1)}


def test_the_seam_of_a_sphere_is_not_the_whole_picture_backwards(picture):
    mesh = drawn(Sphere(1), picture)
    width = np.ptp(mesh.texture.uv[mesh.faces][..., 0], axis=1)
    away = np.abs(mesh.vertices[mesh.faces][..., 2]).max(axis=1) < 0.9
    assert width[away].max() < 0.1


def test_the_page_gets_picture_and_tint(picture):
    import io

    import trimesh

    mesh = drawn(Sphere(1), picture, rgba=Rgba(0.5, 1, 1, 0.5))
    loaded = trimesh.load(io.BytesIO(_textured(mesh, (128, 255, 255), 0.5)), file_type="glb", force="mesh")
    material = loaded.visual.material
    assert material.baseColorTexture.size == (16, 8)
    assert np.asarray(material.baseColorFactor).tolist() == [128, 255, 255, 128]


def test_what_cannot_take_a_picture_is_drawn_without(picture, tmp_path):
    hull = tmp_path / "hull.obj"
    hull.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n")
    assert getattr(drawn(Convex(str(hull)), picture), "texture", None) is None


def test_a_file_that_is_no_picture_is_named(tmp_path):
    meshcat = Meshcat(port=0)
    (tmp_path / "text.png").write_text("no picture")
    for name in ("missing.png", "text.png"):
        with pytest.raises(RuntimeError, match=name):
            meshcat.SetObject("a", Box(1, 1, 1), diffuse_map=str(tmp_path / name))
    assert not meshcat.HasPath("a")


def test_what_is_round_looks_round_and_edges_sharp(picture):
    import io

    import trimesh

    def normals_of(shape):
        glb = _textured(drawn(shape, picture), (255, 255, 255), 1.0)
        scene = trimesh.load(io.BytesIO(glb), file_type="glb", process=False)
        mesh = next(iter(scene.geometry.values()))
        return mesh.vertices, mesh.vertex_normals

    points, normals = normals_of(Sphere(2))
    np.testing.assert_allclose(normals, points / 2, atol=0.05)  # of facets half as wide
    points, normals = normals_of(Cylinder(1, 2))
    assert np.minimum(np.abs(normals[:, 2]), 1 - np.abs(normals[:, 2])).max() < 1e-6, "along the axis, or across"
