"""The file of a report: what is in it, and that it is right."""

import base64
import html.parser
import json
import threading

import numpy as np
import pytest

import sheldrake
from sheldrake.geometry import Box, HalfSpace
from sheldrake.math import RigidTransform, RollPitchYaw
from sheldrake.multibody.parsing import Parser
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
from sheldrake.multibody.tree import SpatialInertia
from sheldrake.report import SaveLogReport, SaveReport
from sheldrake.report._plots import thinned
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder
from sheldrake.systems.primitives import Integrator, LogAll, LogSet, LogVectorOutput, Sine, VectorLog

HEIGHT = 0.1  # [m] of fall


def falling_block(log=True, until=1.0, recorder=None):
    """The project's block falls flat on its side."""
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 1e-3)
    Parser(plant).AddModels(sheldrake.model_path("two_hole_block/two_hole_block.urdf"))
    ground, X_WG = HalfSpace(), RigidTransform()
    plant.RegisterCollisionGeometry(plant.world_body(), X_WG, ground, "ground", CoulombFriction(0.7, 0.5))
    plant.RegisterVisualGeometry(plant.world_body(), X_WG, ground, "ground", [0.5, 0.5, 0.5, 1.0])
    plant.Finalize()
    if log:
        LogVectorOutput(plant.get_state_output_port(), builder)
    if recorder is not None:
        from sheldrake.geometry import MeshcatVisualizer

        MeshcatVisualizer.AddToBuilder(builder, scene_graph, recorder)
    diagram = builder.Build()
    diagram.set_name("drop")
    context = diagram.CreateDefaultContext()
    (body,) = (plant.get_body(i) for i in plant.GetFloatingBaseBodies())
    X_WB = RigidTransform(RollPitchYaw(0.0, 0.0, 0.3), [0.0, 0.0, HEIGHT])
    plant.SetFreeBodyPose(plant.GetMyContextFromRoot(context), body, X_WB)
    simulator = Simulator(diagram, context)
    if recorder is not None:
        recorder.StartRecording()
    simulator.AdvanceTo(until)
    return simulator, plant, body


class Reader(html.parser.HTMLParser):
    """Texts of elements by their id, and everything that would be fetched."""

    def __init__(self):
        super().__init__()
        self.by_id, self.fetched, self.text, self._id, self.ids = {}, [], [], None, []

    def handle_starttag(self, tag, attributes):
        found = dict(attributes)
        self._id = found.get("id")
        if self._id:
            self.ids.append(self._id)
        if tag in ("script", "img", "link", "iframe") and ("src" in found or "href" in found):
            self.fetched.append(found)

    def handle_data(self, data):
        if self._id:
            self.by_id[self._id] = self.by_id.get(self._id, "") + data
        self.text.append(data)

    def handle_endtag(self, tag):
        self._id = None


def read(path):
    reader = Reader()
    reader.feed(path.read_text(encoding="utf-8"))
    return reader, json.loads(reader.by_id["data"])


def unpack(text):
    return np.frombuffer(base64.b64decode(text), dtype="<f4")


@pytest.fixture(scope="module")
def block(tmp_path_factory):
    path = tmp_path_factory.mktemp("report") / "block.html"
    simulator, plant, body = falling_block()
    threads = set(threading.enumerate())
    SaveReport(simulator, path, title="A </script> & block")
    assert not set(threading.enumerate()) - threads
    return path, simulator, plant, body


def test_one_small_file_that_needs_nothing_else(block):
    path, *_ = block
    reader, data = read(path)
    assert path.stat().st_size < 3e6
    assert reader.fetched == []
    assert len(reader.ids) == len(set(reader.ids))
    text = path.read_text(encoding="utf-8")
    assert '<html lang="en">' in text and "<title>A &lt;/script&gt; &amp; block</title>" in text
    scene = json.loads(reader.by_id["scene-page"])
    assert "__VISER_EMBED_DATA__" in scene
    assert data["times"] == [0.0, pytest.approx(1.0)]


def test_the_replay_is_where_the_body_was(block):
    path, simulator, plant, body = block
    _, data = read(path)
    replay = data["replay"]
    times, poses = unpack(replay["times"]), unpack(replay["poses"]).reshape(-1, 7)
    assert len(replay["paths"]) == 1 and replay["paths"][0].endswith("/two_hole_block/body")
    assert len(times) == 61 and len(poses) == 61
    start = poses[0]
    expected = RollPitchYaw(0.0, 0.0, 0.3).ToQuaternion()
    np.testing.assert_allclose(start, [expected.w(), 0, 0, expected.z(), 0, 0, HEIGHT], atol=1e-6)
    k = 6  # 0.1 s: still falling
    steps = round(float(times[k]) / 1e-3)
    fallen = 9.81 * 1e-6 * steps * (steps + 1) / 2  # of the semi-implicit step
    assert poses[k, 6] == pytest.approx(HEIGHT - fallen, abs=2e-6)
    context = plant.GetMyContextFromRoot(simulator.get_context())
    np.testing.assert_allclose(poses[-1, 4:], plant.EvalBodyPoseInWorld(context, body).translation(), atol=1e-6)
    target, position = np.array(replay["camera"])
    assert 0.0 < target[2] < HEIGHT and position[2] > 0.0


def test_the_plots_are_the_log(block):
    path, *_ = block
    _, data = read(path)
    titles = [(plot["title"], plot["unit"]) for plot in data["plots"]]
    assert titles == [
        ("plant/state: orientation (roll, pitch, yaw) of two_hole_block_body", "deg"),
        ("plant/state: position of two_hole_block_body", "m"),
        ("plant/state: angular velocity of two_hole_block_body", "rad/s"),
        ("plant/state: velocity of two_hole_block_body", "m/s"),
    ]
    yaw = data["plots"][0]["lines"][2]
    assert yaw["label"] == "yaw" and unpack(yaw["y"])[0] == pytest.approx(np.degrees(0.3), rel=1e-6)
    z = data["plots"][1]["lines"][2]
    assert unpack(z["y"])[0] == pytest.approx(HEIGHT) and unpack(z["t"])[-1] == pytest.approx(1.0)


def test_contact_events_have_the_time_of_the_fall_and_the_weight(block):
    path, simulator, _, body = block
    from sheldrake.report._contact_events import find_contact_events
    from sheldrake.report._replay import find_state_logs
    from sheldrake.systems.primitives._log_files import find_sinks

    context = simulator.get_context()
    before = context.get_discrete_state_vector().CopyToVector().copy()
    logs = find_state_logs(context, find_sinks(simulator.get_system(), context))
    (event,), step = find_contact_events(context, logs)
    assert event.bodies == ("body", "world") and event.end is None and step == pytest.approx(1e-3)
    assert event.begin == pytest.approx(np.sqrt(2.0 * HEIGHT / 9.81), abs=3e-3)
    assert event.last == pytest.approx(9.81 * body.default_mass(), rel=1e-3)
    assert event.peak > 5.0 * event.last
    np.testing.assert_array_equal(context.get_discrete_state_vector().CopyToVector(), before)
    reader, _ = read(path)
    assert "body and world" in "".join(reader.text)


def test_tables_tell_of_model_run_and_versions(block):
    path, *_ = block
    text = "".join(read(path)[0].text)
    for word in ("quaternion_floating", "0.0827209 kg", "simulated time", sheldrake.__version__, "numpy"):
        assert word in text


def test_it_tells_what_each_stage_and_log_cost(block):
    path, *_ = block
    text = " ".join(read(path)[0].text)
    section = text[text.index("Where the time went") : text.index("Block diagram")]
    for word in ("smooth motion", "solve", "next state", "log", "event loop", "1\u202f000"):
        assert word in section, section
    assert "plant" in section and "::" not in section


def test_pictures_show_systems_without_logs_and_bodies_with_joints(block):
    path, *_ = block
    text = path.read_text(encoding="utf-8")
    assert 'aria-label="Block diagram of drop"' in text and "scene_graph" in text
    assert "VectorLogSink" not in "".join(read(path)[0].text)
    assert "Bodies and joints of plant" in text and "body (quaternion_floating)" in text


def test_without_a_logged_state_a_recording_serves(tmp_path):
    from sheldrake.geometry import Meshcat

    meshcat = Meshcat()
    simulator, *_ = falling_block(log=False, until=0.5, recorder=meshcat)
    SaveReport(simulator, tmp_path / "r.html")
    _, data = read(tmp_path / "r.html")
    poses = unpack(data["replay"]["poses"]).reshape(-1, 7)
    assert poses[0, 6] == pytest.approx(HEIGHT) and poses[-1, 6] < 0.02
    assert unpack(data["replay"]["times"])[-1] == pytest.approx(0.5, abs=1.0 / 64)
    assert data["plots"] == []


def test_the_users_own_scene_is_moved_and_left_as_it_is(tmp_path):
    from sheldrake.geometry import Meshcat, MeshcatVisualizer, MeshcatVisualizerParams, Role

    meshcat = Meshcat()
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 1e-3)
    Parser(plant).AddModels(sheldrake.model_path("two_hole_block/two_hole_block.urdf"))
    plant.Finalize()
    for prefix, role in (("looks", Role.kIllustration), ("contact", Role.kProximity)):
        MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat, MeshcatVisualizerParams(prefix=prefix, role=role))
    LogVectorOutput(plant.get_state_output_port(), builder)
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(0.1)
    before = list(meshcat._hub.tree.items())
    SaveReport(simulator, tmp_path / "r.html")
    _, data = read(tmp_path / "r.html")
    assert data["replay"]["paths"] == [f"/drake/{p}/two_hole_block/body" for p in ("looks", "contact")]
    poses = unpack(data["replay"]["poses"]).reshape(-1, 2, 7)
    np.testing.assert_array_equal(poses[:, 0], poses[:, 1])
    assert poses[-1, 0, 6] == pytest.approx(-0.5 * 9.81 * 0.01, rel=0.02)
    assert [path for path, _ in before] == [path for path, _ in meshcat._hub.tree.items()]


def test_without_either_the_report_says_what_to_do(tmp_path):
    simulator, *_ = falling_block(log=False, until=0.01)
    SaveReport(simulator, tmp_path / "r.html")
    reader, data = read(tmp_path / "r.html")
    assert data["replay"] is None and "LogAll(builder)" in "".join(reader.text)


def test_a_diagram_without_bodies(tmp_path):
    builder = DiagramBuilder()
    source = builder.AddNamedSystem("source", Sine(1.0, 1.0, 0.0, 1))
    integrator = builder.AddNamedSystem("integrator", Integrator(1))
    builder.Connect(source.get_output_port(0), integrator.get_input_port())
    LogAll(builder, publish_period=1e-4)
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(2.0)
    SaveReport(simulator, tmp_path / "r.html")
    reader, data = read(tmp_path / "r.html")
    assert data["replay"] is None and [p["unit"] for p in data["plots"]] == [""] * 4
    assert len(unpack(data["plots"][0]["lines"][0]["y"])) < 2100  # of 20 001
    assert "RungeKutta3Integrator" in "".join(reader.text)


def test_reports_of_logs_alone(tmp_path):
    log = VectorLog(1)
    for t in np.linspace(0, 1, 11):
        log.AddData(t, [t])
    SaveLogReport(LogSet({"a</script>": log}), tmp_path / "r.html")
    _, data = read(tmp_path / "r.html")
    assert data["plots"][0]["title"] == "a</script>" and data["times"] == [0.0, 1.0]
    SaveLogReport(LogSet({}), tmp_path / "empty.html")
    assert read(tmp_path / "empty.html")[1]["plots"] == []


def test_thinned_lines_keep_their_extremes():
    times = np.linspace(0.0, 1.0, 100_000)
    values = np.sin(40.0 * times)
    values[33_333], values[77_777], values[:50] = 9.0, -9.0, np.nan
    t, y = thinned(times, values, 2000)
    assert len(t) <= 2000 and np.nanmax(y) == 9.0 and np.nanmin(y) == -9.0
    assert t[0] == 0.0 and t[-1] == 1.0 and (np.diff(t) > 0).all()


def test_thinned_lines_are_exact_where_little_happens_and_much():
    """A bounce of 50 ms in a minute: looked at closely, it has no corners."""
    times = np.arange(60_001) * 1e-3
    values = 0.1 * np.exp(-200.0 * (times - 30.0) ** 2) * np.sin(300.0 * times)
    t, y = thinned(times, values, 2000)
    np.testing.assert_allclose(np.interp(times, t, y), values, atol=2e-6)
    assert len(t) < 1000


def test_legends_do_not_repeat_what_all_lines_share():
    from sheldrake.systems.primitives._vector_log import short_labels

    assert short_labels(["DefaultModelInstance_hip", "DefaultModelInstance_knee"]) == ("", ["hip", "knee"])
    assert short_labels(["iiwa_joint_1", "iiwa_joint_2"]) == ("iiwa", ["joint_1", "joint_2"])
    assert short_labels(["block_body x", "block_body y"]) == ("block_body", ["x", "y"])
    assert short_labels(["left_hip"]) == ("", ["left_hip"])
    assert short_labels(["y0", "y1"]) == ("", ["y0", "y1"])
    assert short_labels(["arm_elbow", "arm"]) == ("", ["arm_elbow", "arm"])


def test_bodies_that_nearly_touch_are_no_contact(tmp_path):
    """A box 10 micrometres above the ground, without gravity: seen by the search for contacts, but no touch."""
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 1e-3)
    plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, 0.0])
    material = CoulombFriction(0.5, 0.5)
    plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform(), HalfSpace(), "ground", material)
    body = plant.AddRigidBody("box", SpatialInertia.SolidBoxWithMass(1.0, 0.1, 0.1, 0.1))
    plant.RegisterCollisionGeometry(body, RigidTransform(), Box(0.1, 0.1, 0.1), "box", material)
    plant.SetDefaultFloatingBaseBodyPose(body, RigidTransform([0.0, 0.0, 0.05001]))
    plant.Finalize()
    LogVectorOutput(plant.get_state_output_port(), builder)
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(0.1)
    SaveReport(simulator, tmp_path / "box.html")
    assert "No bodies touched." in (tmp_path / "box.html").read_text(encoding="utf-8")


# The command.

SCRIPT = """
import sys
from pydrake.all import *
builder = DiagramBuilder()
plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 1e-3)
Parser(plant).AddModels(sys.argv[1])
plant.Finalize()
simulator = Simulator(builder.Build())
simulator.AdvanceTo(0.1)
raise SystemExit(int(sys.argv[2]))
"""


@pytest.mark.parametrize("status", [0, 3])
def test_reports_of_scripts(tmp_path, status):
    import os
    import pathlib
    import subprocess
    import sys

    (tmp_path / "simulate.py").write_text(SCRIPT)
    root = pathlib.Path(__file__).resolve().parents[3]
    output = ["-o", "out.html"]
    before, behind = (output, []) if status else ([], output)
    words = [sys.executable, "-m", "sheldrake", "report", *before, "simulate.py", *behind]
    words += [sheldrake.model_path("two_hole_block/two_hole_block.urdf"), str(status)]
    environment = {**os.environ, "PYTHONPATH": str(root / "src"), "SHELDRAKE_PROGRESS": "0"}
    result = subprocess.run(words, env=environment, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert result.returncode == status, result.stderr
    _, data = read(tmp_path / "out.html")
    assert len(data["plots"]) == 4 and data["times"][1] == pytest.approx(0.1)


def test_reports_of_log_files(tmp_path, capsys, monkeypatch):
    from sheldrake.cli import main

    monkeypatch.chdir(tmp_path)
    log = VectorLog(1)
    log.AddData(0.0, [1.0])
    log.ToNpz(tmp_path / "log.npz")
    assert main(["report", "log.npz"]) == 0
    assert "wrote log.html" in capsys.readouterr().out and (tmp_path / "log.html").exists()
    assert main(["report", "absent.npz"]) == 1
