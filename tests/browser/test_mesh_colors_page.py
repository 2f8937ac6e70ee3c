"""Meshes in the page look as their files say: textures, materials, colors of vertices."""

import json

import numpy as np
import trimesh
from chromium import until
from PIL import Image
from test_meshcat_page import READY, at

from sheldrake.geometry import Mesh, Meshcat, Rgba

LOOKS = """(() => {
  const node = window.__viserMutable.nodeRefFromName[%s]; if (!node) return [];
  const looks = [];
  node.traverse((o) => { if (o.isMesh && o.material) looks.push({
    color: o.material.color.getRGB({}, "srgb"), map: !!(o.material.map && o.material.map.image),
    vertices: !!(o.material.vertexColors && o.geometry.attributes.color) }); });
  return looks;
})()"""


def write_textured_obj(folder):
    Image.fromarray(np.array([[[220, 30, 30], [30, 30, 220]]] * 2, dtype=np.uint8)).resize((64, 64), 0).save(
        folder / "paint.png"
    )
    (folder / "tile.mtl").write_text("newmtl painted\nKd 1 1 1\nmap_Kd paint.png\n")
    (folder / "tile.obj").write_text(
        "mtllib tile.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl painted\n"
        "f 1/1 2/2 3/3 4/4\n"
    )
    return folder / "tile.obj"


def write_green_glb(folder):
    box = trimesh.creation.box([1, 1, 0.2])
    material = trimesh.visual.material.PBRMaterial(baseColorFactor=[0, 255, 0, 255], metallicFactor=0.0)
    box.visual = trimesh.visual.TextureVisuals(material=material)
    box.export(folder / "green.glb")
    return folder / "green.glb"


def write_blue_dae(folder):
    (folder / "blue.dae").write_text("""<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit meter="1" name="meter"/><up_axis>Z_UP</up_axis></asset>
<library_effects><effect id="e"><profile_COMMON><technique sid="t"><lambert><diffuse><color>0 0 1 1</color></diffuse>
</lambert></technique></profile_COMMON></effect></library_effects>
<library_materials><material id="m"><instance_effect url="#e"/></material></library_materials>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="a" count="12">0 0 0 1 0 0 1 1 0 0 1 0</float_array><technique_common>
<accessor source="#a" count="4" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="2" material="s"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2 0 2 3</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="w"><node><instance_geometry url="#g"><bind_material><technique_common>
<instance_material symbol="s" target="#m"/></technique_common></bind_material></instance_geometry></node></visual_scene>
</library_visual_scenes><scene><instance_visual_scene url="#w"/></scene></COLLADA>""")
    return folder / "blue.dae"


def write_two_materials(folder):
    (folder / "two.mtl").write_text("newmtl red\nKd 1 0 0\nnewmtl green\nKd 0 1 0\n")
    (folder / "two.obj").write_text(
        "mtllib two.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nv 2 1 0\nusemtl red\nf 1 2 3 4\nusemtl green\n"
        "f 2 5 6 3\n"
    )
    return folder / "two.obj"


def near(color, wanted):
    return np.allclose([color["r"], color["g"], color["b"]], wanted, atol=0.02)


def test_meshes_look_as_their_files_say(chromium, tmp_path, pictures):
    box = trimesh.creation.box([1, 1, 0.2])
    box.export(tmp_path / "plain.stl")
    files = {
        "textured": write_textured_obj(tmp_path),
        "gltf": write_green_glb(tmp_path),
        "dae": write_blue_dae(tmp_path),
        "materials": write_two_materials(tmp_path),
        "stl": tmp_path / "plain.stl",
    }
    meshcat = Meshcat(port=0)
    for k, (name, file) in enumerate(files.items()):
        meshcat.SetObject(name, Mesh(str(file), 1.0), Rgba(0.9, 0.6, 0.1))
        meshcat.SetTransform(name, at(0, 1.5 * (k - 2), 0.2))
    page = chromium.open(meshcat.web_url())
    page.wait_for(READY)

    def looks(name):
        return page.evaluate(LOOKS % json.dumps(f"/drake/{name}/<object>"))

    until(lambda: all(looks(name) for name in files))
    until(lambda: any(look["map"] for look in looks("textured")))
    assert near(looks("gltf")[0]["color"], [0, 1, 0])
    assert near(looks("dae")[0]["color"], [0, 0, 1])
    assert len(looks("materials")) == 2 or looks("materials")[0]["vertices"]
    assert near(looks("stl")[0]["color"], [0.9, 0.6, 0.1]), "a file without colors takes the given one"
    page.screenshot(pictures, "mesh-colors.png")
    assert page.console() == []
