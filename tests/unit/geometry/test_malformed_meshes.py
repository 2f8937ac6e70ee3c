"""What is wrong with a mesh file is said with place, what was found and what was expected: to collide and to look."""

import base64
import copy
import functools
import io
import json
import operator
import re
import struct

import numpy as np
import pytest

from sheldrake.geometry import Mesh
from sheldrake.geometry._meshes.mesh_looks import load_mesh
from sheldrake.geometry._meshes.read_obj import first_fault, read_obj

VERTICES = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], "<f4").tobytes()
FACES = np.array([0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3], "<u2").tobytes()
GLTF = {
    "asset": {"version": "2.0"},
    "scene": 0,
    "scenes": [{"nodes": [0]}],
    "nodes": [{"mesh": 0}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
    "accessors": [
        {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
        {"bufferView": 1, "componentType": 5123, "count": 12, "type": "SCALAR"},
    ],
    "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 24}],
    "buffers": [{"uri": "numbers.bin", "byteLength": 72}],
}
VIEW, ACCESSOR, PRIMITIVE = ("bufferViews", 0), ("accessors", 0), ("meshes", 0, "primitives", 0)
END = "the end of accessors[0] ({}) is {}; expected at most 48, the length of its bufferView"
ZEROS = {"componentType": 5126, "count": 3_000_000, "type": "VEC3"}
WRONG_GLTF = [
    (*VIEW, "byteStride", 3, "bufferViews[0].byteStride is 3; expected a whole number from 12"),
    (*VIEW, "byteStride", 0, "bufferViews[0].byteStride is 0; expected a whole number from 12"),
    (*VIEW, "byteStride", -12, "bufferViews[0].byteStride is -12; expected"),
    (*VIEW, "byteStride", "12", 'bufferViews[0].byteStride is "12"; expected a whole number'),
    (*VIEW, "byteStride", 16, END.format("4 elements of 12 bytes, 16 apart", 60)),
    (*VIEW, "byteLength", 480, "bufferViews[0] is bytes 0 to 480; expected at most 72, the length of its buffer"),
    (*VIEW, "byteOffset", -4, "bufferViews[0].byteOffset is -4; expected a whole number from 0"),
    (*VIEW, "buffer", 9, "bufferViews[0].buffer is 9; expected the number of one of the 1 buffers"),
    (*ACCESSOR, "count", 5, END.format("5 elements of 12 bytes, 12 apart", 60)),
    (*ACCESSOR, "count", "4", 'accessors[0].count is "4"; expected a whole number from 1'),
    (*ACCESSOR, "count", None, "accessors[0].count is null; expected a whole number from 1"),
    (*ACCESSOR, "count", 10**9, END.format("1000000000 elements of 12 bytes, 12 apart", 12 * 10**9)),
    (*ACCESSOR, ZEROS | {"count": 10**7}, "accessors[0].count is 10000000; expected at most 100000000 bytes of all"),
    ("accessors", [ZEROS, ZEROS, ZEROS], "accessors[2].count is 3000000; expected at most 100000000 bytes of all"),
    (*ACCESSOR, "componentType", 9, "accessors[0].componentType is 9; expected one of 5120, 5121"),
    (*ACCESSOR, "componentType", [], "accessors[0].componentType is []; expected one of 5120, 5121"),
    (*ACCESSOR, "type", "VEC9", 'accessors[0].type is "VEC9"; expected one of SCALAR, VEC2'),
    (*ACCESSOR, "type", "VEC2", 'the type of meshes[0].primitives[0].attributes.POSITION is "VEC2"; expected VEC3'),
    (*ACCESSOR, "bufferView", 7, "accessors[0].bufferView is 7; expected the number of one of the 2 bufferViews"),
    (*ACCESSOR, "byteOffset", 40, END.format("4 elements of 12 bytes, 12 apart", 88)),
    (*PRIMITIVE, "attributes", {}, "meshes[0].primitives[0].attributes is []; expected POSITION among them"),
    (*PRIMITIVE, "attributes", {"POSITION": 9}, "attributes.POSITION is 9; expected the number of one of the 2 acc"),
    (*PRIMITIVE, "indices", 9, "meshes[0].primitives[0].indices is 9; expected the number of one of the 2 accessors"),
    (*PRIMITIVE, "indices", 0, 'the type of meshes[0].primitives[0].indices is "VEC3"; expected SCALAR'),
    (*PRIMITIVE, "material", 3, "meshes[0].primitives[0].material is 3; expected the number of one of the 0 materials"),
    (*PRIMITIVE, "mode", 9, "meshes[0].primitives[0].mode is 9; expected a number from 0 to 6"),
    ("meshes", 0, "primitives", {}, "meshes[0].primitives is {}; expected a list"),
    ("meshes", 0, [], "meshes[0] is []; expected an object"),
    ("nodes", 0, "mesh", 4, "nodes[0].mesh is 4; expected the number of one of the 1 meshes"),
    ("nodes", 0, "matrix", [1, 2, 3], "nodes[0].matrix is [1, 2, 3]; expected 16 numbers"),
    ("nodes", 0, "scale", [1, 2, "x"], 'nodes[0].scale is [1, 2, "x"]; expected 3 numbers'),
    ("nodes", 0, "children", [0], "nodes[0] is below itself; expected a tree"),
    ("scenes", 0, "nodes", [5], "scenes[0].nodes[0] is 5; expected the number of one of the 1 nodes"),
    ("scene", 3, "scene is 3; expected the number of one of the 1 scenes"),
    ("asset", {"version": "1.0"}, 'asset.version is "1.0"; expected 2.0'),
    ("images", [{"bufferView": 9}], "images[0].bufferView is 9; expected the number of one of the 2 bufferViews"),
    ("textures", [{"source": 3}], "textures[0].source is 3; expected the number of one of the 0 images"),
    ("materials", [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 4}}}],
     "materials[0].pbrMetallicRoughness.baseColorTexture.index is 4; expected the number of one of the 0 textures"),
    ("materials", [{"pbrMetallicRoughness": {"baseColorFactor": [1, "x"]}}],
     'materials[0].pbrMetallicRoughness.baseColorFactor is [1, "x"]; expected 4 numbers'),
    ("buffers", [], "bufferViews[0].buffer is 0; expected the number of one of the 0 buffers"),
    ("buffers", 0, "uri", "data:;base64,!!!", "buffers[0].uri is data that is no base64; expected data:...;base64"),
    ("buffers", 0, "uri", 7, "buffers[0].uri is 7; expected text"),
    ("buffers", 0, "uri", "none.bin", "none.bin' that it names: No such file"),
    ("buffers", 0, "byteLength", 720, "buffers[0].byteLength is 720; expected at most the 72 bytes that are there"),
    ("extensionsRequired", ["KHR_draco_mesh_compression"], "KHR_draco_mesh_compression"),
]  # fmt: skip


def said_of(path):
    """What collisions and looks say of a mesh that cannot be read."""
    texts = []
    for use in (lambda mesh: mesh.GetConvexHull(), load_mesh):
        with pytest.raises(RuntimeError) as caught:
            use(Mesh(str(path)))
        texts.append(str(caught.value))
        assert path.name in texts[-1]
    return texts


def says(path, expected):
    for text in said_of(path):
        assert expected in text
        assert not re.search(r"Error\b|\bdtype|out of range|reshape|unsupported operand|NoneType|Errno", text), text


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "numbers.bin").write_bytes(VERTICES + FACES)
    return tmp_path


def test_what_is_changed_below_can_be_read(folder):
    for name, data in (
        ("a.gltf", json.dumps(GLTF).encode()),
        ("a.glb", binary()),
        ("a.obj", OBJ.encode()),
        ("a.stl", STL),
        ("b.stl", ASCII.encode()),
        ("a.dae", DAE.encode()),
    ):
        (folder / name).write_bytes(data)
        mesh = Mesh(str(folder / name))
        assert mesh.GetConvexHull().num_vertices() == 4 and len(load_mesh(mesh).faces) == 4, name


@pytest.mark.parametrize("wrong", WRONG_GLTF, ids=lambda wrong: wrong[-1][:50])
def test_gltf(folder, wrong):
    *place, last, value, expected = wrong
    document = copy.deepcopy(GLTF)
    functools.reduce(operator.getitem, place, document)[last] = value
    (folder / "a.gltf").write_text(json.dumps(document))
    says(folder / "a.gltf", expected)


@pytest.mark.parametrize("corner", [4, 77, 2**16 - 1])
def test_corners_of_vertices_that_are_not_there(folder, corner):
    faces = np.array([0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, corner], "<u2").tobytes()
    (folder / "numbers.bin").write_bytes(VERTICES + faces)
    (folder / "a.gltf").write_text(json.dumps(GLTF))
    says(folder / "a.gltf", "a corner names a vertex that is not among the 4")


def test_corners_of_a_vertex_of_another_part(folder):
    document = copy.deepcopy(GLTF)
    faces = np.array([0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 5], "<u2").tobytes()  # the two parts have eight together
    (folder / "numbers.bin").write_bytes(VERTICES + FACES + faces)
    document["buffers"][0]["byteLength"] = 96
    document["bufferViews"].append({"buffer": 0, "byteOffset": 72, "byteLength": 24})
    document["accessors"].append({**GLTF["accessors"][1], "bufferView": 2})
    document["meshes"][0]["primitives"].insert(0, {"attributes": {"POSITION": 0}, "indices": 2})
    (folder / "a.gltf").write_text(json.dumps(document))
    says(folder / "a.gltf", "a corner names a vertex that is not among the 4")


def test_texture_coordinates_of_other_vertices(folder):
    document = copy.deepcopy(GLTF)
    document["accessors"].append({"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC2"})
    document["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = 2
    document["meshes"][0]["primitives"][0]["material"] = 0
    document["materials"] = [{"pbrMetallicRoughness": {}}]
    (folder / "a.gltf").write_text(json.dumps(document))
    with pytest.raises(RuntimeError, match=r"a\.gltf.*have shape \(3, 2\); expected two for each of 4 vertices"):
        load_mesh(Mesh(str(folder / "a.gltf")))


def test_normals_of_a_part_without_volume(folder):
    document = copy.deepcopy(GLTF)
    document["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = 0
    document["nodes"][0]["scale"] = [1, 1, 0]
    (folder / "a.gltf").write_text(json.dumps(document))
    (part,) = load_mesh(Mesh(str(folder / "a.gltf"))).parts
    assert part.normals is None and len(part.faces) == 4


@pytest.mark.parametrize(
    ("picture", "said"),
    [
        (b"", "it is no picture that can be read"),
        (b"hello", "it is no picture that can be read"),
        (
            b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR" + struct.pack(">IIBBBBB", 2**30, 2**30, 8, 2, 0, 0, 0),
            "exceeds limit|no picture",
        ),
    ],
    ids=["empty", "text", "2^60 pixels"],
)
def test_a_texture_that_is_no_picture_is_said(folder, caplog, picture, said):
    (folder / "a.png").write_bytes(picture)
    (folder / "a.mtl").write_text("newmtl a\nKd 1 1 1\nmap_Kd a.png\n")
    (folder / "a.obj").write_text("mtllib a.mtl\nusemtl a\n" + OBJ)
    with caplog.at_level("WARNING", logger="drake"):
        assert load_mesh(Mesh(str(folder / "a.obj"))).parts[0].image is None
    assert "'a.png'" in caplog.text and re.search(said, caplog.text) and "drawn without" in caplog.text


def test_gltf_whose_accessors_have_no_numbers(folder):
    document = {key: value for key, value in GLTF.items() if key not in ("buffers", "bufferViews")}
    document["accessors"] = [{k: v for k, v in row.items() if k != "bufferView"} for row in GLTF["accessors"]]
    (folder / "a.gltf").write_text(json.dumps(document))
    says(folder / "a.gltf", "bufferViews is null; expected a list: without it accessors have no numbers")


@pytest.mark.parametrize("mode", [0, 1])
def test_points_and_lines_beside_triangles_are_not_drawn(folder, mode):
    others, triangles = {"attributes": {"POSITION": 0}, "mode": mode}, GLTF["meshes"][0]["primitives"]
    (folder / "a.gltf").write_text(json.dumps(GLTF | {"meshes": [{"primitives": [others, *triangles]}]}))
    mesh = load_mesh(Mesh(str(folder / "a.gltf")))
    assert len(mesh.faces) == 4 and len(mesh.parts) == 1 and mesh.glb()
    (folder / "b.gltf").write_text(json.dumps(GLTF | {"meshes": [{"primitives": [others]}]}))
    with pytest.raises(RuntimeError, match=r"b.gltf': it has no triangles\."):
        load_mesh(Mesh(str(folder / "b.gltf")))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (json.dumps(GLTF)[:100], "no JSON at line 1, column 95"),
        ("", "no JSON at line 1, column 1"),
        ("[]", "has list at its top; expected an object"),
        ("\udcff".encode("utf-8", "surrogateescape"), "no JSON text"),
    ],
)
def test_gltf_that_is_no_json(folder, text, expected):
    (folder / "a.gltf").write_bytes(text if isinstance(text, bytes) else text.encode())
    says(folder / "a.gltf", expected)


def binary():
    text = json.dumps({**GLTF, "buffers": [{"byteLength": 72}]}).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", 72, b"BIN\0") + VERTICES + FACES
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (lambda data: data[:200], "the .glb file ends at byte 200, within a chunk that ends at"),
        (lambda data: data[:-30], "was it copied as a whole?"),
        (lambda data: data[:4] + b"\1" + data[5:], "the version of the .glb file is 1; expected 2"),
        (lambda data: b"XXXX" + data[4:], "begins with 'glTF'; this one does not"),
        (lambda data: data[:12], "has no JSON chunk at its beginning"),
        (lambda _: b"", "begins with 'glTF'; this one does not"),
    ],
)
def test_glb(folder, change, expected):
    (folder / "a.glb").write_bytes(change(binary()))
    says(folder / "a.glb", expected)


OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
ASCII = "solid a\n" + "".join(
    "facet normal 0 0 0\nouter loop\n" + "".join(f"vertex {c}\n" for c in corners) + "endloop\nendfacet\n"
    for corners in (
        ("0 0 0", "0 1 0", "1 0 0"),
        ("0 0 0", "1 0 0", "0 0 1"),
        ("0 0 0", "0 0 1", "0 1 0"),
        ("1 0 0", "0 1 0", "0 0 1"),
    )
)
ASCII += "endsolid a\n"
STL = b"\0" * 80 + struct.pack("<I", 4)
STL += b"".join(
    struct.pack("<12fH", 0, 0, 0, *np.frombuffer(VERTICES, "<f4").reshape(4, 3)[row].ravel(), 0)
    for row in np.frombuffer(FACES, "<u2").reshape(4, 3)
)
DAE = """<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset><up_axis>Z_UP</up_axis>
</asset><library_geometries><geometry id="g"><mesh><source id="p">
<float_array count="12">0 0 0 1 0 0 0 1 0 0 0 1</float_array><technique_common><accessor count="4" stride="3"/>
</technique_common></source><vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="4"><input semantic="VERTEX" source="#v" offset="0"/><p>0 2 1 0 1 3 0 3 2 1 2 3</p></triangles></mesh>
</geometry></library_geometries><library_visual_scenes><visual_scene id="s"><node><translate>0 0 1</translate>
<instance_geometry url="#g"/></node></visual_scene></library_visual_scenes></COLLADA>"""


@pytest.mark.parametrize(
    ("name", "text", "old", "new", "expected"),
    [
        ("a.obj", OBJ, "v 1 0 0", "v 1 0", "a.obj:2: cannot read the OBJ line 'v 1 0'"),
        ("a.obj", OBJ, "v 1 0 0", "v one 0 0", "a.obj:2: cannot read the OBJ line 'v one 0 0'"),
        ("a.obj", OBJ, "f 2 3 4", "f 2 3 9", "a face names vertex 9, but the file has 4"),
        ("a.obj", OBJ, "f 2 3 4", "f -9 3 4", "a face names vertex 5 before the first, but the file has 4"),
        ("a.obj", OBJ, "f 2 3 4", "f a b c", "a.obj:8: cannot read the OBJ line 'f a b c'"),
        ("a.stl", ASCII, "vertex 1 0 0", "vertex one 0 0", "a.stl:6: a vertex of the STL file is not three numbers"),
        ("a.stl", ASCII, "vertex 1 0 0", "vertex 1 0", "a.stl:6: a vertex of the STL file is not three numbers"),
        ("a.dae", DAE, "</COLLADA>", "", "cannot read the COLLADA file: no element found: line 7"),
        ("a.dae", DAE, "COLLADA", "a", "the file begins with <a>; expected <COLLADA>"),
        ("a.dae", DAE, ">0 0 0 1", ">0 0 0 one", "the <float_array> of <source id='p'> holds 'one'; expected numbers"),
        ("a.dae", DAE, ">0 0 0 1", ">0 0 0 1 1", "of <source id='p'> holds 13 numbers; expected a multiple of 3"),
        ("a.dae", DAE, "1 2 3<", "1 2 9<", "a corner names a vertex that is not among the 4"),
        ("a.dae", DAE, "1 2 3<", "1 x 3<", "a <p> of <triangles> holds 'x'; expected numbers"),
        ("a.dae", DAE, 'source="#p"', 'source="#q"', "it names '#q', but nothing in the file has this id"),
        ("a.dae", DAE, 'url="#g"', 'url="#h"', "it names '#h', but nothing in the file has this id"),
        ("a.dae", DAE, 'stride="3"', 'stride="x"', "the stride of <source id='p'> holds 'x'; expected numbers"),
        ("a.dae", DAE, 'stride="3"', 'stride="0"', "of <source id='p'> has rows of 0 numbers"),
        ("a.dae", DAE, "float_array", "floats", "<source id='p'> has no <float_array> with an <accessor>"),
        ("a.dae", DAE, "Z_UP", "W_UP", "<up_axis> is 'W_UP'; expected one of X_UP, Y_UP, Z_UP"),
        ("a.dae", DAE, "<translate>0 0 1", "<translate>0 0", "<translate> holds 2 numbers; expected a multiple of 3"),
    ],
)  # fmt: skip
def test_text(folder, name, text, old, new, expected):
    assert old in text
    (folder / name).write_text(text.replace(old, new))
    says(folder / name, expected)


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        (STL[:-60], "the STL file says it has 4 triangles, but holds 2"),
        (STL[:80] + struct.pack("<I", 10**9) + STL[84:], "says it has 1000000000 triangles, but holds 4"),
        (b"", "no STL file: it has 0 bytes, and a header alone has 84"),
        (ASCII[:60].encode(), "the last facet of the STL file is not complete"),
    ],
)
def test_stl(folder, data, expected):
    (folder / "a.stl").write_bytes(data)
    says(folder / "a.stl", expected)


@pytest.mark.parametrize("place", ["in a data URI", "in a buffer", "no base64"])
def test_a_picture_within_a_gltf_file_that_is_none_is_said(folder, caplog, place):
    document = copy.deepcopy(GLTF)
    image = {"uri": "data:image/png;base64," + base64.b64encode(b"hello").decode()}
    if place == "in a buffer":
        image = {"bufferView": 0, "mimeType": "image/png"}
    if place == "no base64":
        image = {"uri": "data:image/png;base64,@@@"}
    document |= {"images": [image], "textures": [{"source": 0}]}
    document["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]
    document["meshes"][0]["primitives"][0]["material"] = 0
    (folder / "a.gltf").write_text(json.dumps(document))
    with caplog.at_level("WARNING", logger="drake"):
        assert load_mesh(Mesh(str(folder / "a.gltf"))).parts[0].image is None
    assert "images[0]" in caplog.text and "drawn without" in caplog.text


def test_a_picture_within_a_gltf_file_is_drawn_and_nothing_said(folder, caplog):
    from PIL import Image

    document, png = copy.deepcopy(GLTF), io.BytesIO()
    Image.new("RGB", (2, 2)).save(png, "PNG")
    document["images"] = [{"uri": "data:image/png;base64," + base64.b64encode(png.getvalue()).decode()}]
    document["textures"] = [{"source": 0}]
    document["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]
    document["meshes"][0]["primitives"][0]["material"] = 0
    (folder / "a.gltf").write_text(json.dumps(document))
    with caplog.at_level("WARNING", logger="drake"):
        load_mesh(Mesh(str(folder / "a.gltf")))
    assert not caplog.text


def test_a_chain_of_nodes_that_takes_minutes_to_follow_is_refused(folder):
    document, count = copy.deepcopy(GLTF), 20_000
    chain = [{"children": [i + 1]} for i in range(count)]
    document["nodes"], document["scenes"] = [*chain, {"mesh": 0}], [{"nodes": [0]}]
    (folder / "a.gltf").write_text(json.dumps(document))
    with pytest.raises(RuntimeError, match=r"nodes\[10000\] is below 10000 others; expected a flatter tree"):
        load_mesh(Mesh(str(folder / "a.gltf")))


def test_a_line_of_an_obj_file_may_go_on_for_ever():
    """Each of its pieces is looked at once: a file of a megabyte is read in a moment."""
    text = "\\\n\nv 0 \\\n 0 0\nv 1 0 0\nv 0 1 0\nf 1 \\\n" + "\\\n" * 500_000 + "2 3\n"
    vertices, faces = read_obj(text, "long.obj")
    assert vertices.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    assert faces == [[0, 1, 2]]
    assert first_fault(text) == ""
