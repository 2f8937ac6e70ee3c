"""COLLADA files as they look: textures behind samplers, materials, normals, units and axes."""

import io

import numpy as np
import pytest
from PIL import Image

from sheldrake.common import MemoryFile
from sheldrake.geometry import InMemoryMesh, Mesh
from sheldrake.geometry._meshes.mesh_looks import load_mesh

TILE = """<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit meter="0.01"/><up_axis>Y_UP</up_axis></asset>
<library_images><image id="paint-image"><init_from>my%20paint.png</init_from></image></library_images>
<library_effects><effect id="painted"><profile_COMMON>
<newparam sid="surface"><surface type="2D"><init_from>paint-image</init_from></surface></newparam>
<newparam sid="sampler"><sampler2D><source>surface</source></sampler2D></newparam>
<technique sid="t"><phong><diffuse><texture texture="sampler" texcoord="UV"/></diffuse></phong></technique>
</profile_COMMON></effect></library_effects>
<library_materials><material id="m"><instance_effect url="#painted"/></material></library_materials>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array>0 0 0  100 0 0  100 50 0  0 50 0</float_array><technique_common><accessor stride="3"/>
</technique_common></source>
<source id="n"><float_array>0 0 1</float_array><technique_common><accessor stride="3"/></technique_common></source>
<source id="t"><float_array>0 0  1 0  1 1  0 1</float_array><technique_common><accessor stride="2"/></technique_common>
</source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<polylist material="symbol" count="1"><input semantic="VERTEX" source="#v" offset="0"/>
<input semantic="NORMAL" source="#n" offset="1"/><input semantic="TEXCOORD" source="#t" offset="2"/>
<vcount>4</vcount><p>0 0 0 1 0 1 2 0 2 3 0 3</p></polylist></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene><node><translate>0 0 200</translate><instance_geometry url="#g">
<bind_material><technique_common><instance_material symbol="symbol" target="#m"/></technique_common></bind_material>
</instance_geometry></node></visual_scene></library_visual_scenes></COLLADA>"""


def image():
    out = io.BytesIO()
    Image.new("RGB", (4, 4), (200, 10, 10)).save(out, format="PNG")
    return out.getvalue()


def from_files(tmp_path):
    (tmp_path / "tile.dae").write_text(TILE)
    (tmp_path / "my paint.png").write_bytes(image())
    return Mesh(str(tmp_path / "tile.dae"), 2.0)


def from_memory(_):
    files = {"my paint.png": MemoryFile(image(), ".png", "paint")}
    return Mesh(InMemoryMesh(mesh_file=MemoryFile(TILE.encode(), ".dae", "tile"), supporting_files=files), scale=2.0)


@pytest.mark.parametrize("source", [from_files, from_memory])
def test_a_textured_tile(tmp_path, source):
    loaded = load_mesh(source(tmp_path))
    (part,) = loaded.parts
    assert loaded.has_materials and part.image.getpixel((0, 0)) == (200, 10, 10)
    # y of the file is up, its z towards the viewer (-y); 1 cm is its unit, and the scale doubles it.
    corners = {tuple(np.round(v, 12)): tuple(uv) for v, uv in zip(part.vertices, part.uv)}
    assert corners == {(0, -4, 0): (0, 0), (2, -4, 0): (1, 0), (2, -4, 1): (1, 1), (0, -4, 1): (0, 1)}
    a, b, c = part.vertices[part.faces[0]]
    assert np.cross(b - a, c - a) @ [0, -1, 0] > 0
    assert part.normals / np.linalg.norm(part.normals, axis=1, keepdims=True) == pytest.approx(
        np.tile([0, -1, 0], (6, 1))
    )


def test_what_is_missing_is_said_and_left_out(tmp_path, caplog):
    mesh = from_files(tmp_path)
    (tmp_path / "my paint.png").unlink()
    (part,) = load_mesh(mesh).parts
    assert part.image is None and len(part.faces) == 2
    assert "tile.dae: the mesh names the file 'my paint.png': No such file or directory. It is drawn without." in (
        caplog.text
    )


def test_a_texture_that_is_no_picture_is_said(tmp_path, caplog):
    mesh = from_files(tmp_path)
    (tmp_path / "my paint.png").write_text("hello")
    assert load_mesh(mesh).parts[0].image is None
    assert "tile.dae: the mesh names the file 'my paint.png': it is no picture that can be read." in caplog.text


def test_the_up_axis_that_meshlab_writes_is_not_believed(tmp_path):
    tool = "<contributor><authoring_tool>VCGLib | MeshLab</authoring_tool></contributor>"
    turned = load_mesh(from_files(tmp_path)).vertices
    (tmp_path / "tile.dae").write_text(TILE.replace("<asset>", f"<asset>{tool}"))
    kept = load_mesh(Mesh(str(tmp_path / "tile.dae"), 2.0)).vertices
    np.testing.assert_allclose(turned, kept[:, [0, 2, 1]] * [1, -1, 1], rtol=0, atol=1e-12)
    assert np.ptp(kept[:, 2]) == 0 and np.ptp(turned[:, 2]) > 0, "a tile that stood lies"
