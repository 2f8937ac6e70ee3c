import base64
import json
import struct

import numpy as np
import pytest

from sheldrake import geometry as g
from sheldrake.autodiffutils import AutoDiffXd
from sheldrake.geometry._mass_properties import mass_properties
from sheldrake.geometry._meshes import read_obj
from sheldrake.geometry._meshes.convex_hull import make_convex_hull
from sheldrake.geometry._meshes.mesh_files import read_mesh

# A box 1 x 2 x 3 with its corner at the origin.
CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 2) for z in (0, 3)], dtype=float)
QUADS = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]


def obj_text():
    vertices = "".join(f"v {x} {y} {z}\n" for x, y, z in CORNERS)
    return vertices + "".join("f " + " ".join(f"{v + 1}//1" for v in q) + "\n" for q in QUADS)


def triangles():
    return [(q[0], q[i], q[i + 1]) for q in QUADS for i in (1, 2)]


def write_box(folder, extension):
    path = folder / f"box{extension}"
    if extension == ".obj":
        path.write_text(obj_text())
    elif extension == ".vtk":
        tetrahedra = [(0, 4, 6, 7), (0, 6, 2, 7), (0, 5, 4, 7), (0, 1, 5, 7), (0, 2, 3, 7), (0, 3, 1, 7)]
        points = "\n".join(" ".join(map(str, p)) for p in CORNERS)
        cells = "\n".join("4 " + " ".join(map(str, t)) for t in tetrahedra)
        path.write_text(
            f"# vtk DataFile Version 3.0\nbox\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 8 double\n{points}\n"
            f"CELLS 6 30\n{cells}\nCELL_TYPES 6\n" + "10\n" * 6
        )
    elif extension == ".stl":
        body = b"".join(
            struct.pack("<12fH", 0, 0, 0, *CORNERS[a], *CORNERS[b], *CORNERS[c], 0) for a, b, c in triangles()
        )
        path.write_bytes(bytes(80) + struct.pack("<I", 12) + body)
    elif extension == ".ply":
        header = (
            "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n"
            "element face 12\nproperty list uchar int vertex_indices\nend_header\n"
        )
        points = "".join(" ".join(map(str, p)) + "\n" for p in CORNERS)
        path.write_text(header + points + "".join(f"3 {a} {b} {c}\n" for a, b, c in triangles()))
    elif extension == ".gltf":
        y_up = CORNERS[:, [0, 2, 1]] * [1, 1, -1]  # what z-up looks like in a y-up file
        indices = np.array(triangles(), dtype=np.uint16).tobytes()
        data = y_up.astype(np.float32).tobytes() + indices
        document = {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
            "buffers": [
                {
                    "byteLength": len(data),
                    "uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode(),
                }
            ],
            "bufferViews": [
                {"buffer": 0, "byteOffset": 0, "byteLength": 96},
                {"buffer": 0, "byteOffset": 96, "byteLength": len(indices)},
            ],
            "accessors": [
                {
                    "bufferView": 0,
                    "componentType": 5126,
                    "count": 8,
                    "type": "VEC3",
                    "min": y_up.min(0).tolist(),
                    "max": y_up.max(0).tolist(),
                },
                {"bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR"},
            ],
        }
        path.write_text(json.dumps(document))
    elif extension == ".dae":
        y_up = CORNERS[:, [0, 2, 1]] * [1, 1, -1] * 100.0
        values = " ".join(str(v) for v in y_up.ravel())
        corners = " ".join(f"{v} 0" for q in QUADS for v in q)
        path.write_text(
            f"""<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
 <asset><unit name="centimeter" meter="0.01"/><up_axis>Y_UP</up_axis></asset>
 <library_geometries><geometry id="box"><mesh>
  <source id="p"><float_array id="pa" count="24">{values}</float_array>
   <technique_common><accessor source="#pa" count="8" stride="3"/></technique_common></source>
  <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
  <polylist count="6"><input semantic="VERTEX" source="#v" offset="0"/>
   <input semantic="NORMAL" source="#n" offset="1"/><vcount>4 4 4 4 4 4</vcount><p>{corners}</p></polylist>
 </mesh></geometry></library_geometries>
 <library_visual_scenes><visual_scene id="s"><node><translate>0 50 0</translate><rotate>0 1 0 0</rotate>
  <translate>0 -50 0</translate><instance_geometry url="#box"/></node></visual_scene></library_visual_scenes>
</COLLADA>"""
        )
    return path


@pytest.mark.parametrize("extension", [".obj", ".vtk", ".stl", ".ply", ".gltf", ".dae"])
def test_every_format_gives_the_same_solid(tmp_path, extension):
    path = write_box(tmp_path, extension)
    shape = g.Mesh(path, [2, 1, 1])
    volume, centre, inertia = mass_properties(shape)
    assert volume == pytest.approx(12, rel=1e-6)
    assert centre == pytest.approx([1, 1, 1.5], rel=1e-6)
    assert np.diag(inertia) == pytest.approx(np.array([4 + 9, 4 + 9, 4 + 4]), rel=1e-6)
    hull = shape.GetConvexHull()
    assert (hull.num_vertices(), hull.num_faces()) == (8, 6)
    assert hull.total_area() == pytest.approx(2 * (4 + 6 + 6), rel=1e-6)


@pytest.mark.parametrize("package_file", [None, "package.xml"])
def test_gltf_names_files_of_its_package_only(tmp_path, package_file):
    """Numbers may lie in a folder beside the mesh's, in its package, and nowhere else."""
    folder = tmp_path / "robot" / "meshes" / "visual"
    beside = tmp_path / "robot" / ("buffers" if package_file else "meshes/buffers")
    for each in (folder, beside):
        each.mkdir(parents=True)
    if package_file:
        (tmp_path / "robot" / package_file).touch()
    path = write_box(folder, ".gltf")
    content = json.loads(path.read_text())
    uri = content["buffers"][0]["uri"]
    for place in (beside, tmp_path):
        (place / "numbers.bin").write_bytes(base64.b64decode(uri.partition(",")[2]))
    content["buffers"][0]["uri"] = "../../buffers/numbers.bin" if package_file else "../buffers/numbers.bin"
    path.write_text(json.dumps(content))
    assert len(read_mesh(g.MeshSource(path)).triangles) == 12
    for name in ("../../../numbers.bin", str(tmp_path / "numbers.bin")):
        content["buffers"][0]["uri"] = name
        path.write_text(json.dumps(content))
        read_mesh.__globals__["_read_file"].cache_clear()
        with pytest.raises(RuntimeError, match=r"numbers\.bin.*not in its package"):
            read_mesh(g.MeshSource(path))


def test_gltf_with_its_numbers_in_another_file(tmp_path):
    path = write_box(tmp_path, ".gltf")
    document = json.loads(path.read_text())
    (tmp_path / "numbers.bin").write_bytes(base64.b64decode(document["buffers"][0]["uri"].split(",")[1]))
    document["buffers"][0]["uri"] = "numbers.bin"
    path.write_text(json.dumps(document))
    assert g.Mesh(path).GetConvexHull().num_vertices() == 8
    (tmp_path / "numbers.bin").unlink()
    path.write_text(json.dumps(document, indent=1))
    with pytest.raises(RuntimeError, match=r"box\.gltf: cannot read the \.gltf mesh: .*numbers\.bin"):
        g.Mesh(path, 2.0).GetConvexHull()


def test_mirrored_mesh_keeps_positive_volume(tmp_path):
    path = write_box(tmp_path, ".obj")
    volume, centre, _ = mass_properties(g.Mesh(path, [-1, 1, 1]))
    assert volume == pytest.approx(6) and centre == pytest.approx([-0.5, 1, 1.5])
    surface = g.ReadObjToTriangleSurfaceMesh(path, scale3=[-1, 1, 1])
    assert mass_properties(surface).volume == pytest.approx(6)


def test_unreadable_files_are_named(tmp_path):
    with pytest.raises(RuntimeError, match=r"cannot read the file '.*nofile\.obj'"):
        g.Mesh(tmp_path / "nofile.obj").GetConvexHull()
    with pytest.raises(RuntimeError, match=r"unsupported extension '\.xyz'.*a\.xyz"):
        g.Mesh(tmp_path / "a.xyz").GetConvexHull()
    for extension, text in ((".obj", "v 1 2\n"), (".stl", "solid\nnonsense"), (".dae", "<a>"), (".vtk", "x\n\n\n")):
        path = tmp_path / f"bad{extension}"
        path.write_text(text)
        with pytest.raises(RuntimeError, match=rf"bad\{extension}"):
            g.Mesh(path).GetConvexHull()
    path = tmp_path / "range.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nf 1 2 5\n")
    with pytest.raises(RuntimeError, match="names vertex 5"):
        g.ReadObjToTriangleSurfaceMesh(path)


def test_obj_continuation_negative_numbers_and_comments(tmp_path):
    path = tmp_path / "t.obj"
    path.write_text("v 0 0 0 # origin\nv 1 0 0\nv 0 1 \\\n 0\nf -3 -2 -1\n")
    assert read_mesh(g.MeshSource(path)).triangles.tolist() == [[0, 1, 2]]


PLAIN_OBJ = (
    "# made by hand\n\nmtllib a.mtl\nv 0 0 0\n  v\t1 0 0\nv 1 1. 1e-1\r\nv  -0 1 .5  \nvn 0 0 1\nvt 0 0\n"
    "g first\nusemtl m\nf 1 2 3\nf 1/1 3/2/1 4//1 \ns off\n"
)


@pytest.mark.parametrize(
    ("text", "is_plain"),
    [
        (PLAIN_OBJ, True),
        (PLAIN_OBJ + "f 1 2 3 4\n", True),
        ("v 0 0 0 1 1 1\nv 1 0 0 0 0 0\nv 0 1 0 1 0 1\nf 1 2 3\n", True),  # with colours
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\n", True),
        (PLAIN_OBJ + "f -4 -3 -2\n", False),
        (PLAIN_OBJ + "f 1 2 3 # last\n", False),
        (PLAIN_OBJ + "v 0 0 0 1\n", False),  # rows of different lengths
        (PLAIN_OBJ.replace("f 1 2 3", "f 1 2 \\\n 3"), False),
        ("", False),
    ],
)
def test_obj_is_read_alike_at_once_and_line_by_line(text, is_plain):
    vertices, faces = read_obj._read_line_by_line(text, "text")
    assert (read_obj._read_plain(text) is not None) == is_plain
    found_vertices, found_faces = read_obj.read_obj(text, "text")
    assert np.array_equal(found_vertices, vertices) and found_vertices.dtype == float
    assert [list(face) for face in found_faces] == faces


@pytest.mark.parametrize("line", ["f 0 1 2", "f 1 2 9", "f a b c", "f 1.5 2 3", "v 1 2", "v 1 2 x"])
def test_wrong_lines_of_obj_are_not_passed_over(line):
    with pytest.raises(RuntimeError, match="text"):
        read_obj.read_obj(f"{PLAIN_OBJ}{line}\n", "text")


def test_hull_keeps_order_merges_faces_and_drops_inner_points():
    rng = np.random.default_rng(1)
    inside = rng.uniform(0.1, 0.9, (20, 3)) * [1, 2, 3]
    on_face = [[0.5, 1.0, 3.0]]
    hull = make_convex_hull(np.vstack([inside, CORNERS, on_face, CORNERS]))
    assert np.array_equal(hull._vertices, CORNERS)
    assert sorted(len(f) for f in hull._faces) == [4] * 6
    for f in range(6):
        outward = hull.element_centroid(f) - [0.5, 1, 1.5]
        assert outward @ hull.face_normal(f) > 0


@pytest.mark.parametrize("seed", range(5))
def test_random_hull_is_closed_and_contains_its_points(seed):
    points = np.random.default_rng(seed).normal(size=(60, 3))
    hull = make_convex_hull(points)
    corners = sum(hull.element(f).num_vertices() for f in range(hull.num_faces()))
    assert hull.num_vertices() - corners // 2 + hull.num_faces() == 2
    for f in range(hull.num_faces()):
        height = (points - hull.element_centroid(f)) @ hull.face_normal(f)
        assert height.max() < 1e-12


def test_degenerate_hulls():
    flat = make_convex_hull([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    assert flat.num_vertices() == 5 and np.ptp(flat._vertices[:, 2]) < 1e-5
    with pytest.raises(RuntimeError, match="co-linear"):
        make_convex_hull([[0, 0, 0], [1, 1, 1], [2, 2, 2]])
    with pytest.raises(RuntimeError, match="sphere with radius"):
        make_convex_hull([[0, 0, 0]] * 4)
    with pytest.raises(RuntimeError, match="fewer than three vertices; found 2"):
        make_convex_hull([[0, 0, 0], [1, 1, 1]])


def test_round_hull_with_flat_parts_has_each_of_them_as_one_face():
    turns = np.linspace(0.0, 2.0 * np.pi, 200, endpoint=False)
    rim = np.column_stack([np.cos(turns), np.sin(turns), np.zeros(200)])
    rng = np.random.default_rng(2)
    points = rng.permutation(np.vstack([rim, rim - [0, 0, 1], 0.5 * rim, rim]))  # a can of 202 faces: for Qhull
    hull = make_convex_hull(points)
    assert sorted(len(f) for f in hull._faces) == [4] * 200 + [200] * 2
    assert hull.num_vertices() == 400 and len(np.unique(hull._vertices, axis=0)) == 400
    order = [int(np.flatnonzero((points == v).all(axis=1))[0]) for v in hull._vertices]
    assert order == sorted(order)


def test_faces_of_a_polygon_mesh_are_measured_as_one_by_one():
    corners = np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0], [1, 3, 0], [0, 0, 2]], dtype=float)
    mesh = g.PolygonSurfaceMesh([4, 0, 1, 2, 3, 3, 0, 5, 1, 3, 0, 1, 1, 5, 0, 1, 2, 4, 3], corners)
    assert [mesh.area(f) for f in range(4)] == [2.0, 2.0, 0.0, 4.0]
    np.testing.assert_allclose(mesh.face_normal(0), [0, 0, 1])
    np.testing.assert_allclose(mesh.face_normal(1), [0, 1, 0])
    np.testing.assert_allclose(mesh.face_normal(2), [0, 0, 0])  # no area: no normal, and the mean of its corners
    np.testing.assert_allclose(mesh.element_centroid(2), [4 / 3, 0, 0])
    np.testing.assert_allclose(mesh.element_centroid(0), [1, 0.5, 0])
    np.testing.assert_allclose(mesh.element_centroid(3), [1, (2 * 0.5 + 2 * 5 / 3) / 4, 0])
    assert g.PolygonSurfaceMesh().num_faces() == 0


def test_triangle_mesh_measures():
    mesh = g.TriangleSurfaceMesh(
        [g.SurfaceTriangle(0, 1, 2), g.SurfaceTriangle(v0=2, v1=1, v2=3)],
        [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 1.0]],
    )
    assert mesh.area(0) == 0.5 and mesh.total_area() == pytest.approx(0.5 + np.sqrt(3) / 2)
    assert mesh.face_normal(0).tolist() == [0, 0, 1]
    assert mesh.CalcBarycentric([0.2, 0.2, 0.7], 0) == pytest.approx([0.6, 0.2, 0.2])
    assert mesh.CalcCartesianFromBarycentric(0, [0.2, 0.3, 0.5]) == pytest.approx([0.3, 0.5, 0])
    assert mesh.Equal(g.TriangleSurfaceMesh(mesh.triangles(), mesh.vertices()))
    with pytest.raises(RuntimeError, match="at least one triangle"):
        g.TriangleSurfaceMesh([], [])
    with pytest.raises(ValueError, match="vertex 7"):
        g.TriangleSurfaceMesh([g.SurfaceTriangle(0, 1, 7)], [[0, 0, 0]])


def test_volume_mesh_and_its_surface():
    mesh = g.VolumeMesh([g.VolumeElement(0, 1, 2, 3)], [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    assert mesh.CalcVolume() == pytest.approx(1 / 6)
    assert mesh.CalcBarycentric([0.1, 0.2, 0.3], 0) == pytest.approx([0.4, 0.1, 0.2, 0.3])
    assert mesh.inward_normal(0, 3).tolist() == [0, 0, 1]
    surface = g.ConvertVolumeToSurfaceMesh(mesh)
    assert surface.num_triangles() == 4
    assert mass_properties(surface).volume == pytest.approx(1 / 6)


@pytest.mark.parametrize(
    "shape",
    [g.Sphere(0.7), g.Box(1, 2, 3), g.Cylinder(0.5, 2), g.Capsule(0.5, 2), g.Ellipsoid(1, 2, 3)],
    ids=repr,
)
def test_mass_properties_of_primitives_by_sampling(shape):
    """Against Monte-Carlo integration (statistical error about 1 %)."""
    half = {"Sphere": 0.7, "Box": [0.5, 1, 1.5], "Cylinder": [0.5, 0.5, 1], "Capsule": [0.5, 0.5, 1.5]}
    half = np.broadcast_to(half.get(type(shape).__name__, [1, 2, 3]), (3,))
    p = np.random.default_rng(0).uniform(-1, 1, (200000, 3)) * half
    inside = {
        "Sphere": lambda: (p**2).sum(1) < 0.49,
        "Box": lambda: np.ones(len(p), bool),
        "Cylinder": lambda: (p[:, :2] ** 2).sum(1) < 0.25,
        "Capsule": lambda: (p[:, :2] ** 2).sum(1) + np.maximum(np.abs(p[:, 2]) - 1, 0) ** 2 < 0.25,
        "Ellipsoid": lambda: ((p / [1, 2, 3]) ** 2).sum(1) < 1,
    }[type(shape).__name__]()
    cell = 8 * np.prod(half) / len(p)
    q = p[inside]
    volume, centre, inertia = mass_properties(shape)
    assert volume == pytest.approx(len(q) * cell, rel=0.01)
    assert centre == pytest.approx([0, 0, 0])
    sampled = cell * (np.eye(3) * (q**2).sum() - q.T @ q)
    assert np.diag(inertia) == pytest.approx(np.diag(sampled), rel=0.02)
    assert g.CalcVolume(shape) == volume


def test_meshes_and_planes_of_duals():
    corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 2.0]]
    z = AutoDiffXd(2.0, [1.0])
    moving = np.array([[AutoDiffXd(x) for x in corner] for corner in corners])
    moving[3, 2] = z
    volume = g.VolumeMesh_[AutoDiffXd]([g.VolumeElement(0, 1, 2, 3)], moving)
    assert isinstance(volume.CalcVolume(), AutoDiffXd)
    assert volume.CalcVolume().derivatives() == pytest.approx([1.0 / 6.0])
    fourth = volume.CalcBarycentric([0.1, 0.2, 0.5], 0)[3]  # 0.5 / z
    assert (fourth.value(), *fourth.derivatives()) == pytest.approx((0.25, -0.125))
    polygon = g.PolygonSurfaceMesh_[AutoDiffXd]([3, 0, 1, 3], moving)
    assert isinstance(polygon.area(0), AutoDiffXd) and polygon.total_area().derivatives() == pytest.approx([0.5])
    plane = g.Plane_[AutoDiffXd](normal=[0.0, 0.0, 3.0], point_on_plane=moving[3])
    assert plane.CalcHeight([5.0, 6.0, 7.0]).derivatives() == pytest.approx([-1.0])
    assert [x.value() for x in plane.reference_point()] == [0.0, 0.0, 2.0]


def test_reference_point_is_nearest_to_the_origin():
    np.testing.assert_allclose(g.Plane([0.0, 2.0, 0.0], [5.0, 6.0, 7.0]).reference_point(), [0.0, 6.0, 0.0])
