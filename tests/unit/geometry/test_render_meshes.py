"""Pictures of meshes: their materials, textures and normals."""

import logging

import numpy as np
import pytest
from render_scenes import DOWN, Studio, looking_from, seen

from sheldrake import geometry as g
from sheldrake.math import RigidTransform

PIL_Image = pytest.importorskip("PIL.Image")

X_WC = RigidTransform(DOWN, [0, 0, 2])
STRAIGHT = (22, 30)  # the pixel that looks straight ahead
SQUARE = """
v -0.5 -0.5 0
v 0.5 -0.5 0
v 0.5 0.5 0
v -0.5 0.5 0
vt 0 0
vt 1 0
vt 1 1
vt 0 1
"""


def write_square(folder, name="square", faces="f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n", head="", normals=""):
    path = folder / f"{name}.obj"
    path.write_text(head + SQUARE + normals + faces)
    return path


def write_texture(path):
    """Red and green above, blue and yellow below, each a quarter."""
    pixels = np.zeros((64, 64, 3), np.uint8)
    pixels[:32, :32], pixels[:32, 32:] = (255, 0, 0), (0, 255, 0)
    pixels[32:, :32], pixels[32:, 32:] = (0, 0, 255), (255, 255, 0)
    PIL_Image.fromarray(pixels).save(path)
    return path


def quarters(pixels):
    """Colours right and left, above and below of the middle: [[upper left, upper right], [lower left, lower right]]."""
    rows, columns = (STRAIGHT[0] - 6, STRAIGHT[0] + 6), (STRAIGHT[1] - 5, STRAIGHT[1] + 5)
    return [[pixels[v, u, :3].tolist() for u in columns] for v in rows]


FOUR = [[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [255, 255, 0]]]


def test_material_of_the_file_goes_before_properties(tmp_path, caplog):
    (tmp_path / "square.mtl").write_text("newmtl teal\nKd 0.2 0.8 0.6\n")
    path = write_square(tmp_path, head="mtllib square.mtl\nusemtl teal\n")
    assert Studio(seen(g.Mesh(str(path)), color=None)).colors(X_WC)[STRAIGHT].tolist() == [51, 204, 153, 255]
    with caplog.at_level(logging.WARNING, logger="drake"):
        pixels = Studio(seen(g.Mesh(str(path)), color=(1, 0, 0, 1))).colors(X_WC)
    assert pixels[STRAIGHT].tolist() == [51, 204, 153, 255] and "materials of its own" in caplog.text


def test_without_material_properties_then_picture_then_default(tmp_path):
    path = write_square(tmp_path)
    mesh = g.Mesh(str(path))
    assert Studio(seen(mesh, color=(1, 0, 0, 1))).colors(X_WC)[STRAIGHT].tolist() == [255, 0, 0, 255]
    assert Studio(seen(mesh, color=None)).colors(X_WC)[STRAIGHT].tolist() == [230, 115, 26, 255]
    write_texture(tmp_path / "square.png")
    assert quarters(Studio(seen(mesh, color=None)).colors(X_WC)) == FOUR
    assert Studio(seen(mesh, color=(1, 0, 0, 1))).colors(X_WC)[STRAIGHT].tolist() == [255, 0, 0, 255]


def test_textures_of_materials_and_properties(tmp_path):
    texture = write_texture(tmp_path / "four.png")
    (tmp_path / "square.mtl").write_text("newmtl four\nKd 1 1 1\nmap_Kd four.png\n")
    path = write_square(tmp_path, head="mtllib square.mtl\nusemtl four\n")
    assert quarters(Studio(seen(g.Mesh(str(path)), color=None)).colors(X_WC)) == FOUR
    plain = write_square(tmp_path, "plain")
    assert quarters(Studio(seen(g.Mesh(str(plain)), color=None, texture=texture)).colors(X_WC)) == FOUR
    tinted = Studio(seen(g.Mesh(str(plain)), color=(1, 0.2, 1, 1), texture=texture)).colors(X_WC)
    assert quarters(tinted) == [[[255, 0, 0], [0, 51, 0]], [[0, 0, 255], [255, 51, 0]]]
    box = Studio(seen(g.Box(1, 1, 1), RigidTransform([0, 0, -0.5]), color=None, texture=texture))
    assert quarters(box.colors(X_WC)) == FOUR


def test_textures_repeat_where_coordinates_leave_the_unit_square(tmp_path):
    texture = write_texture(tmp_path / "four.png")
    path = write_square(tmp_path)
    path.write_text(path.read_text().replace("vt 1 0\nvt 1 1", "vt 3 0\nvt 3 1"))
    pixels = Studio(seen(g.Mesh(str(path)), color=None, texture=texture)).colors(X_WC)
    row = [tuple(p) for p in pixels[16, 19:42, :3].tolist()]
    reds = [a == (255, 0, 0) and b != a for a, b in zip(row, row[1:])]  # noqa: RUF007
    assert sum(reds) == 3


def test_a_missing_texture_is_said(tmp_path, caplog):
    with caplog.at_level(logging.WARNING, logger="drake"):
        studio = Studio(seen(g.Box(1, 1, 1), color=None, texture=tmp_path / "none.png"))
    assert "none.png" in caplog.text and studio.colors(X_WC)[STRAIGHT].tolist() == [230, 115, 26, 255]


def test_perspective_of_textures_is_right(tmp_path):
    """A texture that says its own coordinates, seen from the side."""
    ramp = np.zeros((256, 256, 3), np.uint8)
    ramp[..., 0], ramp[..., 1], ramp[..., 2] = np.arange(256), np.arange(256)[::-1, None], 255
    PIL_Image.fromarray(ramp).save(tmp_path / "ramp.png")
    thing = seen(g.Mesh(str(write_square(tmp_path))), color=None, texture=tmp_path / "ramp.png")
    X = looking_from([0.9, -0.8, 0.5])
    studio = Studio(thing)
    depth, pixels = studio.depths(X), studio.colors(X)[..., :3].astype(float)
    v, u = np.indices(depth.shape)
    ray = np.stack([(u + 0.5 - 30.5) / 50, (v + 0.5 - 22.5) / 60, np.ones(depth.shape)], axis=-1)
    hit = np.isfinite(depth)
    p_W = (ray * np.where(hit, depth, 0.0)[..., None]) @ X.rotation().matrix().T + X.translation()
    inner = hit & (np.abs(p_W[..., :2]) < 0.49).all(axis=-1)
    found = pixels[inner][:, :2] / pixels[inner][:, 2:]
    assert inner.sum() > 200 and np.abs(found - (p_W[inner][:, :2] + 0.5)).max() < 0.02  # 8 bits of a dark picture


def test_normals_of_the_file_make_it_smooth(tmp_path):
    normals = "vn -0.6 0 0.8\nvn 0.6 0 0.8\n"
    faces = "f 1/1/1 2/2/2 3/3/2\nf 1/1/1 3/3/2 4/4/1\n"
    smooth = write_square(tmp_path, "smooth", faces, normals=normals)
    pixels = Studio(seen(g.Mesh(str(smooth)), color=(1, 1, 1, 1))).colors(X_WC)[22, :, 0].astype(int)
    x = 2 * (np.arange(20, 41) - 30) / 50  # the normal is along (1.2 x, 0, 0.8)
    assert np.abs(pixels[20:41] - 255 * 0.8 / np.hypot(1.2 * x, 0.8)).max() <= 0.51
    flat = Studio(seen(g.Mesh(str(write_square(tmp_path))), color=(1, 1, 1, 1))).colors(X_WC)[22, 20:41, 0]
    assert (flat == 255).all()


def test_scale_and_convex_hull(tmp_path):
    path = tmp_path / "tetra.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")
    for shape in (g.Mesh(str(path), 0.5), g.Convex(str(path), 0.5)):
        X = RigidTransform(DOWN, [0.1, 0.1, 2])
        assert Studio(seen(shape)).depths(X)[STRAIGHT] == pytest.approx(2 - 0.3, abs=1e-6)
    mirrored = g.Mesh(str(path), [-0.5, 0.5, 0.5])
    X = RigidTransform(DOWN, [-0.1, 0.1, 2])
    assert Studio(seen(mirrored)).depths(X)[STRAIGHT] == pytest.approx(2 - 0.3, abs=1e-6)


def test_vertex_colours_and_gltf(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    mesh = trimesh.creation.box((1, 1, 1))
    mesh.visual.vertex_colors = np.tile([0, 255, 128, 255], (8, 1))
    mesh.export(tmp_path / "box.ply")
    studio = Studio(seen(g.Mesh(str(tmp_path / "box.ply")), color=None))
    assert studio.colors(X_WC)[STRAIGHT].tolist() == [0, 255, 128, 255]
    painted = Studio(seen(g.Mesh(str(tmp_path / "box.ply")), color=(1, 0, 0, 1)))
    assert painted.colors(X_WC)[STRAIGHT].tolist() == [255, 0, 0, 255]
    slab = trimesh.creation.box((1, 0.2, 1))  # y of glTF is up
    material = trimesh.visual.material.PBRMaterial(baseColorFactor=[255, 0, 51, 255])
    slab.visual = trimesh.visual.TextureVisuals(material=material)
    slab.export(tmp_path / "slab.glb")
    studio = Studio(seen(g.Mesh(str(tmp_path / "slab.glb")), color=None))
    assert studio.depths(X_WC)[STRAIGHT] == pytest.approx(1.9, abs=1e-6)
    assert studio.colors(X_WC)[STRAIGHT].tolist() == [255, 0, 51, 255]


def test_a_missing_mesh_is_the_callers_error(tmp_path):
    with pytest.raises(RuntimeError, match=r"Render engine: mesh file .*none\.obj' does not exist"):
        Studio(seen(g.Mesh(str(tmp_path / "none.obj"))))
