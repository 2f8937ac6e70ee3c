"""Runs as files for Rerun and Foxglove, read back by readers that are not ours."""

import builtins
import json
import subprocess
import sys

import numpy as np
import pytest

from sheldrake.geometry import Box, Capsule, Cylinder, Ellipsoid, HalfSpace, Meshcat, MeshcatVisualizer, Sphere
from sheldrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
from sheldrake.multibody.tree import RevoluteJoint, SpatialInertia
from sheldrake.report import SaveRun
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder
from sheldrake.systems.primitives import LogVectorOutput

CLOSE = 1e-6  # [m] and of quaternions; Rerun keeps single precision
SHAPES = {
    "box": Box(0.1, 0.2, 0.3),
    "ball": Sphere(0.05),
    "can": Cylinder(0.04, 0.1),
    "egg": Ellipsoid(0.05, 0.06, 0.07),
    "pill": Capsule(0.03, 0.1),
}
X_BG = RigidTransform(RollPitchYaw(0.1, 0.2, 0.3), [0.01, 0.02, 0.03])
RED = [0.8, 0.2, 0.1, 0.5]


def tumbling(log=True, recorder=None):
    """Two bodies with a joint between them tumble and fall; a third, on a shelf, has every shape."""
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 1e-3)
    inertia = SpatialInertia.SolidBoxWithMass(1.0, 0.1, 0.2, 0.3)
    bodies = [plant.AddRigidBody(name, inertia) for name in ("trunk", "arm", "shelf")]
    plant.AddJoint(RevoluteJoint("elbow", bodies[0].body_frame(), bodies[1].body_frame(), [0.0, 1.0, 0.0]))
    plant.WeldFrames(plant.world_frame(), bodies[2].body_frame(), RigidTransform([0.0, 0.0, 3.0]))
    for body in bodies[:2]:
        plant.RegisterVisualGeometry(body, X_BG, SHAPES["box"], "look", RED)
    for name, shape in SHAPES.items():
        plant.RegisterVisualGeometry(bodies[2], X_BG, shape, name, RED)
    ground = plant.world_body(), RigidTransform(), HalfSpace()
    plant.RegisterVisualGeometry(*ground, "ground", [0.5, 0.5, 0.5, 1.0])
    plant.RegisterCollisionGeometry(*ground, "floor", CoulombFriction(0.7, 0.5))
    plant.Finalize()
    if log:
        LogVectorOutput(plant.get_state_output_port(), builder)
    if recorder is not None:
        MeshcatVisualizer.AddToBuilder(builder, scene_graph, recorder)
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = plant.GetMyContextFromRoot(simulator.get_context())
    plant.SetVelocities(context, np.linspace(-3.0, 4.0, plant.num_velocities()))
    if recorder is not None:
        recorder.StartRecording()
    simulator.AdvanceTo(0.4)
    return simulator, plant


@pytest.fixture(scope="module")
def run():
    return tumbling()


def poses_at(run, time):
    """Quaternion x, y, z, w and position of the moving bodies, by name, from the log itself."""
    simulator, plant = run
    (sink,) = (s for s in simulator.get_system().GetSystems() if hasattr(s, "FindLog"))
    log = sink.FindLog(simulator.get_context())
    k = int(np.argmin(np.abs(log.sample_times() - time)))
    assert log.sample_times()[k] == pytest.approx(time, abs=1e-9)
    context = plant.CreateDefaultContext()
    plant.SetPositionsAndVelocities(context, log.data()[:, k])
    found = {}
    for name in ("trunk", "arm", "shelf"):
        X_WB = plant.EvalBodyPoseInWorld(context, plant.GetBodyByName(name))
        q = X_WB.rotation().ToQuaternion()
        found[name] = np.array([q.x(), q.y(), q.z(), q.w()]), X_WB.translation()
    return found


def assert_at(run, time, name, quaternion, position):
    q, p = poses_at(run, time)[name]
    sign = np.sign(q @ quaternion)
    np.testing.assert_allclose(sign * np.array(quaternion), q, atol=CLOSE)
    np.testing.assert_allclose(position, p, atol=CLOSE)


# ---- MCAP


def read_mcap(path):
    """Messages by topic: name of the schema, time [s] and content."""
    readers = pytest.importorskip("mcap.reader")
    found = {}
    with open(path, "rb") as file:
        for schema, channel, message in readers.make_reader(file).iter_messages():
            entry = schema.name, message.log_time * 1e-9, json.loads(message.data)
            found.setdefault(channel.topic, []).append(entry)
    return found


@pytest.fixture(scope="module")
def mcap(run, tmp_path_factory):
    pytest.importorskip("mcap")
    path = tmp_path_factory.mktemp("run") / "run.mcap"
    SaveRun(run[0], path)
    return read_mcap(path)


def test_transforms_of_an_mcap_are_where_the_bodies_were(run, mcap):
    messages = mcap["/tf"]
    assert 20 < len(messages) <= 26  # at most 60 a second
    for schema, time, content in messages:
        assert schema == "foxglove.FrameTransforms"
        assert len(content["transforms"]) == 3
        for transform in content["transforms"]:
            assert transform["parent_frame_id"] == "world"
            stamp = transform["timestamp"]
            assert stamp["sec"] + 1e-9 * stamp["nsec"] == pytest.approx(time, abs=1e-9)
            quaternion = [transform["rotation"][c] for c in "xyzw"]
            position = [transform["translation"][c] for c in "xyz"]
            name = transform["child_frame_id"].rpartition("/")[2]
            assert_at(run, time, name, quaternion, position)
    assert messages[0][1] == 0.0 and messages[-1][1] == pytest.approx(0.4)


def test_an_mcap_has_every_shape_on_its_frame(mcap):
    ((schema, _, content),) = mcap["/scene"]
    assert schema == "foxglove.SceneUpdate"
    entities = {entity["id"].rpartition("/")[2]: entity for entity in content["entities"]}
    assert len({entity["id"] for entity in content["entities"]}) == 8
    frames = {transform["child_frame_id"] for transform in mcap["/tf"][0][2]["transforms"]}
    assert {entity["frame_id"] for entity in content["entities"]} == frames | {"world"}
    sizes = {"box": [0.1, 0.2, 0.3], "ball": [0.1, 0.1, 0.1], "can": [0.08, 0.08, 0.1], "egg": [0.1, 0.12, 0.14]}
    kinds = {"box": "cubes", "ball": "spheres", "can": "cylinders", "egg": "spheres", "pill": "triangles"}
    q = X_BG.rotation().ToQuaternion()
    for name, kind in kinds.items():
        assert entities[name]["frame_locked"] is True
        (primitive,) = entities[name][kind]
        assert [primitive["color"][c] for c in "rgba"] == RED
        pose = primitive["pose"]
        assert [pose["position"][c] for c in "xyz"] == pytest.approx(X_BG.translation())
        assert [pose["orientation"][c] for c in "wxyz"] == pytest.approx([q.w(), q.x(), q.y(), q.z()])
        if name in sizes:
            assert [primitive["size"][c] for c in "xyz"] == pytest.approx(sizes[name])
    pill = entities["pill"]["triangles"][0]
    corners = np.array([[p[c] for c in "xyz"] for p in pill["points"]])
    np.testing.assert_allclose(np.ptp(corners, axis=0), [0.06, 0.06, 0.16], rtol=0.01)
    assert 0 <= min(pill["indices"]) and max(pill["indices"]) < len(corners)


def test_the_messages_are_those_that_foxglove_published(mcap):
    """Every field has a name and a type of Foxglove's own definitions."""
    pytest.importorskip("foxglove_schemas_protobuf")
    from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
    from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
    from google.protobuf.json_format import ParseDict

    def plain(value, key=""):
        """Times as protobuf's JSON has them: text instead of seconds and nanoseconds."""
        if isinstance(value, dict) and set(value) == {"sec", "nsec"}:
            text = f"{value['sec']}.{value['nsec']:09d}s"
            return text if key == "lifetime" else f"1970-01-01T00:00:{value['sec']:02d}.{value['nsec']:09d}Z"
        if isinstance(value, dict):
            return {k: plain(v, k) for k, v in value.items()}
        return [plain(v) for v in value] if isinstance(value, list) else value

    scene = ParseDict(plain(mcap["/scene"][0][2]), SceneUpdate())
    assert len(scene.entities) == 8 and scene.entities[0].frame_locked
    transforms = ParseDict(plain(mcap["/tf"][3][2]), FrameTransforms()).transforms
    assert len(transforms) == 3 and abs(transforms[0].rotation.w) <= 1.0


def test_schemas_of_an_mcap_name_what_the_messages_have(run, tmp_path):
    readers = pytest.importorskip("mcap.reader")

    def check(value, schema):
        if schema["type"] == "object":
            for key, inner in value.items():
                if "properties" in schema:
                    check(inner, schema["properties"][key])
        elif schema["type"] == "array":
            for inner in value:
                check(inner, schema["items"])
        else:
            known = {"string": str, "number": (int, float), "boolean": bool, "integer": int}[schema["type"]]
            assert isinstance(value, known)

    SaveRun(run[0], tmp_path / "run.mcap")
    with open(tmp_path / "run.mcap", "rb") as file:
        for schema, _, message in readers.make_reader(file).iter_messages():
            check(json.loads(message.data), json.loads(schema.data))


def test_an_mcap_has_the_logs(run, mcap):
    (topic,) = set(mcap) - {"/tf", "/scene"}
    assert len(mcap[topic]) == 401
    _, _, last = mcap[topic][-1]
    _, plant = run
    state = plant.GetPositionsAndVelocities(plant.GetMyContextFromRoot(run[0].get_context()))
    np.testing.assert_array_equal(list(last.values()), state)
    assert list(last) == plant.GetStateNames()


def test_colours_of_a_texture_are_taken_where_vertices_lie():
    Image = pytest.importorskip("PIL.Image")
    from sheldrake.geometry._meshes.mesh_looks import MeshPart
    from sheldrake.report._foxglove import vertex_colors

    image = Image.fromarray(np.array([[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [0, 0, 0]]], np.uint8))
    uv = np.array([[0.0, 1.0], [1.0 - 1e-9, 1.0], [0.0, 0.0], [1.0 - 1e-9, 0.0]])  # v upwards
    uv[:2, 1] -= 1e-9
    part = MeshPart(np.zeros((4, 3)), np.zeros((0, 3), int), None, uv, None, None, image)
    colors = vertex_colors(part, (1.0, 1.0, 1.0, 0.5))
    np.testing.assert_array_equal(colors, [[1, 0, 0, 0.5], [0, 1, 0, 0.5], [0, 0, 1, 0.5], [0, 0, 0, 0.5]])


def test_without_logs_the_poses_are_those_that_were_recorded(run, tmp_path):
    pytest.importorskip("mcap")
    recorder = Meshcat(port=0)
    simulator, _ = tumbling(log=False, recorder=recorder)
    SaveRun(simulator, tmp_path / "run.mcap")
    messages = read_mcap(tmp_path / "run.mcap")["/tf"]
    assert len(messages) == 26 and messages[-1][1] == pytest.approx(25 / 64)
    for _, time, content in messages:
        for transform in content["transforms"]:
            quaternion = [transform["rotation"][c] for c in "xyzw"]
            position = [transform["translation"][c] for c in "xyz"]
            step = np.ceil(1e3 * time - 1e-9) * 1e-3  # between two steps the state is the next one's
            assert_at(run, step, transform["child_frame_id"].rpartition("/")[2], quaternion, position)


def test_without_logs_and_recording_bodies_stand_where_they_are(tmp_path):
    pytest.importorskip("mcap")
    simulator, plant = tumbling(log=False)
    SaveRun(simulator, tmp_path / "run.mcap")
    ((_, time, content),) = read_mcap(tmp_path / "run.mcap")["/tf"]
    assert time == pytest.approx(0.4)
    context = plant.GetMyContextFromRoot(simulator.get_context())
    (arm,) = (t for t in content["transforms"] if t["child_frame_id"].endswith("arm"))
    X_WB = plant.EvalBodyPoseInWorld(context, plant.GetBodyByName("arm"))
    assert [arm["translation"][c] for c in "xyz"] == pytest.approx(list(X_WB.translation()))


# ---- Rerun


def read_rrd(path):
    """Columns of all chunks, by entity: those with time and those without."""
    chunk = pytest.importorskip("rerun.chunk")
    moving, static = {}, {}
    for part in chunk.RrdReader(path).stream().to_chunks():
        table = part.to_record_batch()
        into = static if part.is_static else moving
        into.setdefault(part.entity_path.replace("\\", ""), {}).update(
            {name: table.column(name).to_pylist() for name in table.schema.names}
        )
    return moving, static


@pytest.fixture(scope="module")
def rrd(run, tmp_path_factory):
    pytest.importorskip("rerun")
    path = tmp_path_factory.mktemp("run") / "run.rrd"
    SaveRun(run[0], path, title="tumbling")
    return read_rrd(path)


def seconds(column):
    return [t.total_seconds() for t in column]


def test_poses_of_a_recording_are_where_the_bodies_were(run, rrd):
    moving, _ = rrd
    for name in ("trunk", "arm"):
        (entity,) = (e for e in moving if e.endswith(f"/{name}"))
        columns = moving[entity]
        times = seconds(columns["simulation_time"])
        assert 20 < len(times) <= 26 and times[0] == 0.0 and times[-1] == pytest.approx(0.4)
        poses = zip(times, columns["Transform3D:quaternion"], columns["Transform3D:translation"])
        for time, (quaternion,), (position,) in poses:
            assert_at(run, time, name, quaternion, position)


def test_a_recording_has_the_surfaces_in_their_colours(rrd):
    _, static = rrd
    meshes = {e: columns for e, columns in static.items() if "Mesh3D:vertex_positions" in columns}
    assert len(meshes) == 8
    (box,) = (columns for e, columns in meshes.items() if "/box (" in e)
    np.testing.assert_allclose(np.ptp(box["Mesh3D:vertex_positions"][0], axis=0), [0.1, 0.2, 0.3], rtol=1e-6)
    normals = np.array(box["Mesh3D:vertex_normals"][0])
    assert {tuple(n) for n in np.abs(normals).round(6)} == {(1, 0, 0), (0, 1, 0), (0, 0, 1)}
    assert box["Mesh3D:albedo_factor"] == [[int.from_bytes(bytes([204, 51, 26, 128]), "big")]]
    (entity,) = (e for e in static if "/box (" in e and not e.endswith("mesh 0"))
    np.testing.assert_allclose(static[entity]["Transform3D:translation"], [[X_BG.translation()]], rtol=1e-6)
    q = static[entity]["Transform3D:quaternion"][0][0]
    R = RotationMatrix(X_BG.rotation()).ToQuaternion()
    np.testing.assert_allclose(q, [R.x(), R.y(), R.z(), R.w()], atol=CLOSE)


def test_a_recording_has_plots_of_the_logs(run, rrd):
    moving, static = rrd
    plots = {e: columns for e, columns in moving.items() if e.startswith("/plots/")}
    (positions,) = (e for e in plots if "position of" in e and e.endswith("/m"))
    assert static[positions]["SeriesLines:names"] == [["x", "y", "z"]]
    values = np.array(plots[positions]["Scalars:scalars"])
    assert values.shape == (401, 3)
    np.testing.assert_allclose(values[-1], poses_at(run, 0.4)["trunk"][1], atol=1e-12)


def test_a_mesh_with_a_picture():
    """A textured mesh keeps picture and coordinates, v counted downwards as Rerun does."""
    rerun = pytest.importorskip("rerun")
    Image = pytest.importorskip("PIL.Image")
    from sheldrake.geometry._meshes.mesh_looks import MeshPart
    from sheldrake.report._rerun import _mesh

    image = Image.new("RGB", (4, 2), "red")
    vertices, faces = np.eye(3), np.array([[0, 1, 2]])
    uv = np.array([[0.0, 0.25], [1.0, 0.0], [0.0, 1.0]])
    mesh = _mesh(rerun, MeshPart(vertices, faces, None, uv, None, None, image), (1.0, 1.0, 1.0, 1.0))
    np.testing.assert_allclose(mesh.vertex_texcoords.as_arrow_array().to_pylist(), [[0, 0.75], [1, 1], [0, 0]])
    assert len(mesh.albedo_texture_buffer.as_arrow_array().to_pylist()[0]) == 4 * 2 * 3


def test_the_first_look_is_at_what_moves():
    from sheldrake.report._run import outline, run_of

    points = outline(run_of(tumbling()[0], "", None))
    assert -1.0 < points[:, 2].min() and points[:, 2].max() < 3.3  # from the falling bodies to the shelf
    assert np.abs(points[:, :2]).max() < 2.0  # the ground, 20 m wide, does not count


# ---- what goes wrong


def test_another_ending_is_refused(run, tmp_path):
    with pytest.raises(ValueError, match=r"SaveRun\(\): '.*run.bag' must end in \.rrd \(for Rerun\) or \.mcap"):
        SaveRun(run[0], tmp_path / "run.bag")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "ending, module, package", [("rrd", "rerun", "sheldrake\\[rerun\\]"), ("mcap", "mcap", "sheldrake\\[mcap\\]")]
)
def test_a_missing_package_is_named(run, tmp_path, monkeypatch, ending, module, package):
    real = builtins.__import__

    def without(name, *args, **kwargs):
        if name.split(".")[0] == module:
            raise ImportError(f"No module named '{module}'")
        return real(name, *args, **kwargs)

    import importlib

    monkeypatch.setattr(importlib, "import_module", lambda name: without(name))
    with pytest.raises(ImportError, match=rf"SaveRun\(\) needs {module}, .* pip install '{package}'"):
        SaveRun(run[0], tmp_path / f"run.{ending}")
    assert list(tmp_path.iterdir()) == []


FALL = """
import sheldrake
from sheldrake.all import *
builder = DiagramBuilder()
plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 1e-3)
Parser(plant).AddModels(sheldrake.model_path("two_hole_block/two_hole_block.urdf"))
plant.Finalize()
Simulator(builder.Build()).AdvanceTo(0.2)
"""
FALLEN = -0.5 * 9.81 * 0.2 * (0.2 + 1e-3)  # height after 0.2 s of semi-implicit steps of 1 ms [m]


@pytest.mark.parametrize(("ending", "package"), [("rrd", "rerun"), ("mcap", "mcap")])
def test_the_command_writes_what_a_script_ran(tmp_path, ending, package):
    pytest.importorskip(package)
    (tmp_path / "fall.py").write_text(FALL)
    words = [sys.executable, "-m", "sheldrake", "report", "-o", f"run.{ending}", "fall.py"]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, f"wrote run.{ending}\n"), done.stderr
    if ending == "mcap":
        _, time, content = read_mcap(tmp_path / "run.mcap")["/tf"][-1]
        (height,) = (t["translation"]["z"] for t in content["transforms"] if t["child_frame_id"].endswith("/body"))
    else:
        moving, _ = read_rrd(tmp_path / "run.rrd")
        (columns,) = (columns for entity, columns in moving.items() if entity.endswith("/body"))
        time, height = seconds(columns["simulation_time"])[-1], columns["Transform3D:translation"][-1][0][2]
    assert time == pytest.approx(0.2) and height == pytest.approx(FALLEN, abs=1e-6)


def test_a_run_without_a_scene_has_its_logs(tmp_path):
    pytest.importorskip("mcap")
    from sheldrake.systems.primitives import Sine

    builder = DiagramBuilder()
    LogVectorOutput(builder.AddSystem(Sine(1.0, 1.0, 0.0, 2)).get_output_port(0), builder, 0.1)
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(1.0)
    SaveRun(simulator, tmp_path / "run.mcap")
    ((_, messages),) = read_mcap(tmp_path / "run.mcap").items()
    assert len(messages) == 11
