"""What a model or a mesh names by a relative path stays in its package, and what is no model is never quoted."""

import json
import logging
import struct

import numpy as np
import pytest
from PIL import Image

from sheldrake.geometry import Meshcat, MeshcatVisualizer
from sheldrake.multibody.parsing import Parser
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph
from sheldrake.systems.framework import DiagramBuilder

SECRET = "SECRET=hunter2 &\nv hunter2\n"
TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nf 1/1 3/1 2/1\nf 1/1 2/1 4/1\nf 1/1 4/1 3/1\nf 2/1 3/1 4/1\n"
URDF = "<robot name='r'><link name='l'><visual><geometry>{}</geometry>{}</visual></link></robot>"
SDF = """<sdf version='1.7'><model name='r'><link name='l'>
<visual name='v'><geometry>{}</geometry></visual></link></model></sdf>"""
INCLUDE = "<sdf version='1.7'><world name='w'><include><uri>{}</uri></include></world></sdf>"
MJCF = "<mujoco model='r'>{}</mujoco>"
BOX = "<box size='1 1 1'/>"


@pytest.fixture
def package(tmp_path):
    """A package, two folders below what is none of its business."""
    folder = tmp_path / "source" / "robot"
    (folder / "urdf").mkdir(parents=True)
    (folder / "package.xml").write_text("<package><name>robot</name></package>")
    for ending in ("", ".obj", ".stl", ".dae", ".gltf", ".sdf", ".xml", ".mtl"):
        (tmp_path / f"secret{ending}").write_text(SECRET)
    Image.fromarray(np.full((4, 4, 3), 77, np.uint8)).save(tmp_path / "secret.png")
    return folder


def show(path):
    """Reads a model and draws it; returns what the page was given."""
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 1e-3)
    Parser(plant).AddModels(str(path))
    plant.Finalize()
    meshcat = Meshcat(port=0)
    MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat)
    diagram = builder.Build()
    diagram.ForcedPublish(diagram.CreateDefaultContext())
    return meshcat


LEAVES = {
    "mesh.urdf": URDF.format("<mesh filename='../../../secret.obj'/>", ""),
    "texture.urdf": URDF.format(
        BOX, "<material name='m'><texture filename='../../../secret.png'/></material>"
    ),
    "address.urdf": URDF.format("<mesh filename='package://robot/../../secret.stl'/>", ""),
    "mesh.sdf": SDF.format("<mesh><uri>../../../secret.dae</uri></mesh>"),
    "included.sdf": INCLUDE.format("../../../secret.sdf"),
    "included.xml": MJCF.format("<include file='../../../secret.xml'/>"),
    "mesh.xml": MJCF.format("<asset><mesh name='m' file='../../../secret.stl'/></asset>"),
    "folder.xml": MJCF.format("<compiler meshdir='../../..'/><asset><mesh name='m' file='secret.obj'/></asset>"),
}  # fmt: skip


@pytest.mark.parametrize("name", LEAVES)
def test_relative_paths_of_models_stay_in_the_package(package, name):
    file = package / "urdf" / name
    file.write_text(LEAVES[name])
    with pytest.raises(RuntimeError, match=rf"{name}:\d+:\d+: error: URI .* leaves .*package.*refused") as caught:
        show(file)
    assert "hunter2" not in str(caught.value)


@pytest.mark.parametrize("ending", ["urdf", "sdf"])
def test_an_address_of_a_file_is_absolute(package, ending):
    file = package / "urdf" / f"a.{ending}"
    uri = "file://../../../secret.obj"
    text = URDF.format(f"<mesh filename='{uri}'/>", "")
    file.write_text(text if ending == "urdf" else SDF.format(f"<mesh><uri>{uri}</uri></mesh>"))
    with pytest.raises(RuntimeError, match="is not absolute: write file:///") as caught:
        show(file)
    assert "hunter2" not in str(caught.value)


def test_absolute_paths_and_paths_within_the_package_are_followed(package, tmp_path):
    (package / "meshes").mkdir()
    (package / "meshes" / "a.obj").write_text(TETRAHEDRON)
    (tmp_path / "b.obj").write_text(TETRAHEDRON)
    for name in ("../meshes/a.obj", "package://robot/meshes/a.obj", f"{tmp_path}/b.obj", f"file://{tmp_path}/b.obj"):
        (package / "urdf" / "r.urdf").write_text(URDF.format(f"<mesh filename='{name}'/>", ""))
        assert show(package / "urdf" / "r.urdf").HasPath("visualizer/r/l")


def test_without_a_package_there_is_nothing_to_leave(package, tmp_path):
    (package / "package.xml").unlink()
    (tmp_path / "a.obj").write_text(TETRAHEDRON)
    (package / "urdf" / "r.urdf").write_text(URDF.format("<mesh filename='../../../a.obj'/>", ""))
    assert show(package / "urdf" / "r.urdf").HasPath("visualizer/r/l")


def gltf(buffer, image):
    views = [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 24}]
    accessors = [
        {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
        {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC2"},
    ]
    primitive = {"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "material": 0}
    return json.dumps(
        {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [primitive]}],
            "accessors": accessors,
            "bufferViews": views,
            "buffers": [{"uri": buffer, "byteLength": 60}],
            "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
            "textures": [{"source": 0}],
            "images": [{"uri": image}],
        }
    )


DAE = """<COLLADA xmlns='http://www.collada.org/2005/11/COLLADASchema' version='1.4.1'><asset><up_axis>Z_UP</up_axis>
</asset><library_images><image id='i'><init_from>{}</init_from></image></library_images><library_effects>
<effect id='e'><profile_COMMON><newparam sid='s'><surface type='2D'><init_from>i</init_from></surface></newparam>
<newparam sid='t'><sampler2D><source>s</source></sampler2D></newparam><technique sid='c'><lambert><diffuse>
<texture texture='t' texcoord='u'/></diffuse></lambert></technique></profile_COMMON></effect></library_effects>
<library_materials><material id='m'><instance_effect url='#e'/></material></library_materials>
<library_geometries><geometry id='g'><mesh>
<source id='p'><float_array count='9'>0 0 0 1 0 0 0 1 0</float_array><technique_common>
<accessor count='3' stride='3'/></technique_common></source>
<source id='w'><float_array count='6'>0 0 1 0 0 1</float_array><technique_common>
<accessor count='3' stride='2'/></technique_common></source>
<vertices id='v'><input semantic='POSITION' source='#p'/></vertices>
<triangles count='1' material='n'><input semantic='VERTEX' source='#v' offset='0'/>
<input semantic='TEXCOORD' source='#w' offset='1'/><p>0 0 1 1 2 2</p></triangles></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id='d'><node><instance_geometry url='#g'><bind_material><technique_common>
<instance_material symbol='n' target='#m'/></technique_common></bind_material></instance_geometry></node></visual_scene>
</library_visual_scenes><scene><instance_visual_scene url='#d'/></scene></COLLADA>"""


@pytest.mark.parametrize("path", ["../../../secret", "{outside}/secret"])
@pytest.mark.parametrize("kind", ["obj", "mtl", "gltf", "dae"])
def test_meshes_are_drawn_without_what_is_not_in_their_package(package, tmp_path, caplog, kind, path):
    caplog.set_level(logging.WARNING, logger="drake")
    name, folder = path.format(outside=tmp_path), package / "urdf"
    (folder / "m.bin").write_bytes(struct.pack("<15f", 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 1))
    library = "m.mtl" if kind == "obj" else f"{name}.mtl"
    (folder / "m.mtl").write_text(f"newmtl a\nmap_Kd {name}.png\n")
    (folder / "m.obj").write_text(f"mtllib {library}\nusemtl a\n{TETRAHEDRON}")
    (folder / "m.gltf").write_text(gltf("m.bin", f"{name}.png"))
    (folder / "m.dae").write_text(DAE.format(f"{name}.png"))
    mesh = "m.obj" if kind == "mtl" else f"m.{kind}"
    (folder / "r.urdf").write_text(URDF.format(f"<mesh filename='{mesh}'/>", ""))
    page = show(folder / "r.urdf").StaticHtml()
    assert "not in its package" in caplog.text and "drawn without" in caplog.text
    assert "hunter2" not in caplog.text + page


@pytest.mark.parametrize("kind", ["gltf", "dae"])
def test_textures_within_the_package_are_drawn(package, caplog, kind):
    """The oracle of the test above: the same files, with a picture that may be used."""
    folder = package / "urdf"
    (folder / "m.bin").write_bytes(struct.pack("<15f", 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 1))
    Image.fromarray(np.full((4, 4, 3), 77, np.uint8)).save(package / "a picture.png")
    (folder / "m.gltf").write_text(gltf("m.bin", "../a%20picture.png"))
    (folder / "m.dae").write_text(DAE.format("../a%20picture.png"))
    (folder / "r.urdf").write_text(URDF.format(f"<mesh filename='m.{kind}'/>", ""))
    show(folder / "r.urdf")
    assert "drawn without" not in caplog.text


def test_a_buffer_outside_is_an_error(package):
    (package / "urdf" / "m.gltf").write_text(gltf("../../../secret", "none.png"))
    (package / "urdf" / "r.urdf").write_text(URDF.format("<mesh filename='m.gltf'/>", ""))
    with pytest.raises(RuntimeError, match=r"m\.gltf.*'../../../secret', which is not in its package"):
        show(package / "urdf" / "r.urdf")


@pytest.mark.parametrize("ending", ["obj", "stl", "dae", "gltf", "xml", "sdf"])
def test_a_file_that_is_no_model_is_not_quoted(tmp_path, ending):
    (tmp_path / f"secret.{ending}").write_text(SECRET.replace("v hunter2", ""))
    name = f"file://{tmp_path}/secret.{ending}"
    mesh = URDF.format(f"<mesh filename='{name}'/>", "")
    file = tmp_path / ("r.sdf" if ending in ("xml", "sdf") else "r.urdf")
    file.write_text(INCLUDE.format(name) if file.suffix == ".sdf" else mesh)
    with pytest.raises(RuntimeError, match="secret") as caught:
        show(file)
    assert "hunter2" not in str(caught.value) and "SECRET" not in str(caught.value)
