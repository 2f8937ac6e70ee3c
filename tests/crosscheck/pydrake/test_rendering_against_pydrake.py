"""Pictures against Drake's VTK engine: depth, labels, and colours but for the smoothed edges of Drake's."""

import importlib

import numpy as np
import pytest

pytestmark = pytest.mark.peer
pydrake_geometry = pytest.importorskip("pydrake.geometry")

GROUND = ("HalfSpace", (), (0, 0, 0), (0, 0, -0.5), (0.7, 0.7, 0.7, 1.0))
ROUND = ("Sphere", "Cylinder", "Capsule", "Ellipsoid")
EYE = np.array([1.5, 1.1, 1.7])


def looking_from(eye, target=(0.0, 0.0, 0.0)):
    """Pose of a camera, shape (4, 4)."""
    z = (target - eye) / np.linalg.norm(target - eye)
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    X_WC = np.eye(4)
    X_WC[:3] = np.column_stack([x, np.cross(z, x), z, eye])
    return X_WC


def pictures(library, shapes, X_WC, width=160, height=120, texture=None, **params):
    """Colours, depths and labels by one of the libraries; `params` make options from its geometry module."""
    g = importlib.import_module(f"{library}.geometry")
    math = importlib.import_module(f"{library}.math")
    sensors = importlib.import_module(f"{library}.systems.sensors")
    scene_graph = g.SceneGraph()
    options = g.RenderEngineVtkParams(**{name: make(g) for name, make in params.items()})
    scene_graph.AddRenderer("r", g.MakeRenderEngineVtk(options))
    source = scene_graph.RegisterSource("source")
    for label, (kind, size, angles, p_WG, rgba) in enumerate(shapes, start=1):
        X_WG = math.RigidTransform(math.RollPitchYaw(*angles), p_WG)
        geometry = g.GeometryInstance(X_WG, getattr(g, kind)(*size), f"g{label}")
        properties = g.PerceptionProperties()
        properties.AddProperty("label", "id", g.RenderLabel(label))
        if rgba is not None:
            properties.AddProperty("phong", "diffuse", g.Rgba(*rgba))
        elif texture is not None:
            properties.AddProperty("phong", "diffuse_map", str(texture))
        geometry.set_perception_properties(properties)
        scene_graph.RegisterAnchoredGeometry(source, geometry)
    lens = sensors.CameraInfo(width, height, np.pi / 4)
    core = g.RenderCameraCore("r", lens, g.ClippingRange(0.05, 100), math.RigidTransform())
    color, depth = g.ColorRenderCamera(core), g.DepthRenderCamera(core, g.DepthRange(0.1, 50))
    query = scene_graph.get_query_output_port().Eval(scene_graph.CreateDefaultContext())
    where = scene_graph.world_frame_id(), math.RigidTransform(X_WC)
    return (
        query.RenderColorImage(color, *where).data[..., :3].astype(int),
        query.RenderDepthImage(depth, *where).data[..., 0].copy(),
        query.RenderLabelImage(color, *where).data[..., 0].copy(),
    )


def inner(labels):
    """Pixels whose neighbours have the same label: away from silhouettes."""
    same = np.ones(labels.shape, bool)
    for shift in ((0, 1), (0, -1), (1, 0), (-1, 0)):
        same &= labels == np.roll(labels, shift, axis=(0, 1))
    return same


def compare(shapes, X_WC, tolerance=1e-4, **kwargs):
    """Labels may differ on silhouettes only; depth and colour are compared elsewhere.

    Returns:
        Fractions of the pixels away from silhouettes where depth and colour differ.
    """
    color, depth, labels = pictures("pydrake", shapes, X_WC, **kwargs)
    our_color, our_depth, our_labels = pictures("sheldrake", shapes, X_WC, **kwargs)
    away = inner(labels)
    assert np.array_equal(labels[away], our_labels[away])
    assert (labels != our_labels).mean() < 1e-3
    assert np.array_equal(np.isfinite(depth[away]), np.isfinite(our_depth[away]))
    away &= np.isfinite(depth)
    apart = np.abs(depth[away] - our_depth[away]) > tolerance * depth[away]
    return apart.mean(), (np.abs(color[away] - our_color[away]).max(axis=-1) > 3).mean()


def test_boxes_and_the_ground():
    shapes = [GROUND]
    rng = np.random.default_rng(1)
    for _ in range(12):
        size, rgba = rng.uniform(0.1, 0.6, 3), (*rng.uniform(0, 1, 3), 1.0)
        shapes.append(("Box", tuple(size), tuple(rng.uniform(-3, 3, 3)), tuple(rng.uniform(-0.8, 0.8, 3)), rgba))
    depth, color = compare(shapes, looking_from(EYE))
    assert depth == 0.0 and color < 0.03  # edges within a box, which Drake smooths


def test_a_camera_that_looks_elsewhere_would_be_noticed():
    box = ("Box", (0.5, 0.5, 0.5), (0.3, 0.2, 0.1), (0, 0, 0), (1, 0, 0, 1))
    theirs = pictures("pydrake", [GROUND, box], looking_from(EYE, np.array([0.0, 0.0, 0.01])))[2]
    ours = pictures("sheldrake", [GROUND, box], looking_from(EYE))[2]
    assert (theirs != ours).mean() > 1e-3


@pytest.mark.parametrize("kind", ROUND)
def test_round_shapes(kind):
    """Drake draws them with about 50 flat facets around; ours are round: up to 0.2 % of the radius lies between."""
    size = {"Sphere": (0.5,), "Cylinder": (0.4, 0.8), "Capsule": (0.3, 0.6), "Ellipsoid": (0.3, 0.4, 0.6)}[kind]
    thing = (kind, size, (0.4, 0.5, 0.6), (0.0, 0.0, 0.2), (0.2, 0.8, 0.5, 1.0))
    depth, color = compare([GROUND, thing], looking_from(EYE), tolerance=1e-3)
    assert depth < 0.02 and color < 0.01  # glancing rays


def test_clutter_with_default_colours():
    rng = np.random.default_rng(2)
    sizes = {"Sphere": (0.2,), "Cylinder": (0.2, 0.3), "Capsule": (0.1, 0.3), "Ellipsoid": (0.1, 0.2, 0.3)}
    shapes = [GROUND]
    for k in range(20):
        kind = ROUND[k % 4]
        shapes.append((kind, sizes[kind], tuple(rng.uniform(-3, 3, 3)), tuple(rng.uniform(-0.8, 0.8, 3)), None))
    depth, color = compare(shapes, looking_from(EYE), tolerance=1e-3)
    assert depth < 0.02 and color < 0.03


@pytest.mark.parametrize("kind", ["directional", "point", "spot"])
def test_lights(kind):
    numbers = {
        "directional": {"direction": [0.3, 0.2, -1]},
        "point": {"position": [0, 0.3, 1.5], "attenuation_values": [0.5, 0.2, 0.1]},
        "spot": {"position": [0.3, 0.0, 1.5], "direction": [0, 0, -1], "cone_angle": 30.0},
    }[kind]
    box = ("Box", (0.4, 0.4, 0.4), (0, 0, 0), (0, 0, -0.3), (1, 0.5, 0.2, 1))

    def lights(g):
        return [g.LightParameter(type=kind, frame="world", intensity=0.8, **numbers)]

    depth, color = compare([GROUND, box], looking_from(EYE), lights=lights)
    assert depth == 0.0 and color < 0.03


@pytest.mark.parametrize("kind", ["Box", "Sphere", "Ellipsoid", "Capsule"])
def test_textures(kind, tmp_path):
    PIL_Image = pytest.importorskip("PIL.Image")
    y, x = np.mgrid[0:64, 0:64]
    PIL_Image.fromarray(np.stack([4 * x, 4 * y, 0 * x + 255], axis=-1).astype(np.uint8)).save(tmp_path / "ramp.png")
    size = {"Box": (0.6, 0.5, 0.7), "Sphere": (0.5,), "Ellipsoid": (0.3, 0.4, 0.6), "Capsule": (0.3, 0.6)}[kind]
    for eye in (EYE, -EYE):
        thing = (kind, size, (0.2, -0.3, 0.1), (0, 0, 0), None)
        color, depth, labels = pictures("pydrake", [thing], looking_from(eye), texture=tmp_path / "ramp.png")
        ours = pictures("sheldrake", [thing], looking_from(eye), texture=tmp_path / "ramp.png")[0]
        away = inner(labels) & np.isfinite(depth)
        assert (
            np.abs(color[away] - ours[away]).max(axis=-1) > 12
        ).mean() < 0.06  # 50 facets, and edges that are smoothed


def test_meshes_with_materials(tmp_path):
    (tmp_path / "roof.mtl").write_text("newmtl red\nKd 1 0.2 0.1\nnewmtl blue\nKd 0.1 0.3 1\n")
    (tmp_path / "roof.obj").write_text(
        "mtllib roof.mtl\nv -0.5 -0.5 0\nv 0.5 -0.5 0\nv 0.5 0.5 0\nv -0.5 0.5 0\nv 0 -0.5 0.5\nv 0 0.5 0.5\n"
        "vn 0.7071067811865476 0 0.7071067811865476\nvn -0.7071067811865476 0 0.7071067811865476\n"
        "usemtl red\nf 2//1 3//1 6//1 5//1\nusemtl blue\nf 4//2 1//2 5//2 6//2\n"
    )
    roof = ("Mesh", (str(tmp_path / "roof.obj"), 0.8), (0, 0, 0.4), (0, 0, 0), None)
    for eye in (EYE, np.array([-1.0, 1.3, 1.2])):
        depth, color = compare([GROUND, roof], looking_from(eye))
        assert depth == 0.0 and color < 0.02


OBJ = """mtllib m.mtl
usemtl a
v -1 -1 0
v 1 -1 0
v 1 1 0
v -1 1 0
vt 0 0
vt 1 0
vt 1 1
vt 0 1
vn 0 0 1
f 1/1/1 2/2/1 3/3/1
f 1/1/1 3/3/1 4/4/1
"""
MTL = "newmtl a\nKd 1 1 1\nmap_Kd t.png\n"


@pytest.mark.parametrize("where", ["on disk", "in memory", "in memory, with files on disk"])
def test_textures_that_meshes_name_wherever_they_are(where, tmp_path):
    from PIL import Image

    Image.new("RGB", (4, 4), (200, 30, 40)).save(tmp_path / "t.png")
    (tmp_path / "q.obj").write_text(OBJ)
    (tmp_path / "m.mtl").write_text(MTL)
    found = []
    for library in ("pydrake", "sheldrake"):
        g = importlib.import_module(f"{library}.geometry")
        MemoryFile = importlib.import_module(f"{library}.common").MemoryFile
        supporting = {name: tmp_path / name for name in ("m.mtl", "t.png")}
        if where == "in memory":
            supporting = {n: MemoryFile(p.read_bytes(), p.suffix, n) for n, p in supporting.items()}
        mesh = tmp_path / "q.obj"
        if where != "on disk":
            mesh = g.InMemoryMesh(mesh_file=MemoryFile(OBJ, ".obj", "q.obj"), supporting_files=supporting)
        shape = "Mesh", (mesh,), (0, 0, 0), (0, 0, 0), (0.0, 1.0, 0.0, 1.0)  # green is overruled
        color, _, _ = pictures(library, [shape], looking_from(np.array([0.01, 0.0, 3.0])))
        found.append(color[60, 80])
    np.testing.assert_allclose(*found, atol=8)  # of 255: lights differ by as much
    assert found[1][0] > 2 * found[1][1]
