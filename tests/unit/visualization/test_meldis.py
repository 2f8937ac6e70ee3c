"""Meldis shows what a DrakeVisualizer publishes."""

import subprocess
import sys

import pytest

from sheldrake import model_path
from sheldrake.geometry import MeshcatParams
from sheldrake.lcm._viewer_messages import lcmt_viewer_geometry_data, lcmt_viewer_link_data, lcmt_viewer_load_robot
from sheldrake.math import RigidTransform, RollPitchYaw
from sheldrake.multibody.parsing import Parser
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder
from sheldrake.visualization import ApplyVisualizationConfig, Meldis, VisualizationConfig


@pytest.fixture
def meldis(monkeypatch):
    monkeypatch.setenv("LCM_DEFAULT_URL", "memq://")
    return Meldis(meshcat_params=MeshcatParams(port=0))


def show(meldis):
    while meldis._lcm.HandleSubscriptions(0):
        pass
    meldis._invoke_subscriptions()


def test_a_published_block_is_seen_where_it_is(meldis):
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, time_step=1e-3)
    Parser(plant).AddModels(model_path("two_hole_block/two_hole_block.urdf"))
    plant.Finalize()
    X_WB = RigidTransform(RollPitchYaw(0.1, 0.2, 0.3), [0.1, 0.2, 0.3])
    plant.SetDefaultFloatingBaseBodyPose(plant.GetBodyByName("body"), X_WB)
    config = VisualizationConfig(enable_meshcat_creation=False)
    ApplyVisualizationConfig(config, builder, lcm=meldis._lcm)
    simulator = Simulator(builder.Build())
    simulator.Initialize()
    plant_context = plant.GetMyContextFromRoot(simulator.get_context())
    show(meldis)
    tree = meldis.meshcat._hub.tree
    for path in ("/Visual Geometry", "/Collision Geometry"):
        assert meldis.meshcat.HasPath(path)
        (body,) = [p for p, _ in tree.items() if p.startswith(path) and p.endswith("/two_hole_block/body")]
        assert tree.get(body).pose[:3] == pytest.approx(X_WB.GetAsMatrix34(), abs=1e-6)
    simulator.AdvanceTo(6 / 64.0)
    show(meldis)
    now = plant.EvalBodyPoseInWorld(plant_context, plant.GetBodyByName("body"))
    assert tree.get(body).pose[:3] == pytest.approx(now.GetAsMatrix34(), abs=1e-6)
    assert tree.get(body).pose[2, 3] < 0.29
    assert meldis.meshcat.GetSliderNames() == ["Collision Geometry α", "Visual Geometry α"]


def geometry(kind, numbers, file=""):
    return lcmt_viewer_geometry_data(
        type=kind,
        quaternion=[1, 0, 0, 0],
        color=[1, 0, 0, 1],
        string_data=file,
        num_float_data=len(numbers),
        float_data=numbers,
    )


def test_every_shape_and_what_cannot_be_drawn(meldis, caplog):
    kinds = lcmt_viewer_geometry_data
    looks = [
        geometry(kinds.BOX, [1, 2, 3]),
        geometry(kinds.SPHERE, [0.5]),
        geometry(kinds.CYLINDER, [0.1, 0.2]),
        geometry(kinds.CAPSULE, [0.1, 0.2]),
        geometry(kinds.ELLIPSOID, [1, 2, 3]),
        geometry(kinds.MESH, [3, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 1, 2]),
        geometry(kinds.MESH, [1, 1, 1], model_path("two_hole_block/two_hole_block.obj")),
        geometry(kinds.MESH, [1, 1, 1], "/nowhere/none.obj"),
        geometry(77, []),
    ]
    link = lcmt_viewer_link_data(name="a::b", robot_num=2, num_geom=len(looks), geom=looks)
    message = lcmt_viewer_load_robot(num_links=1, link=[link]).encode()
    meldis._lcm.Publish("DRAKE_VIEWER_LOAD_ROBOT", message)
    meldis._lcm.Publish("DRAKE_VIEWER_DRAW", b"nonsense")
    show(meldis)
    drawn = [k for k in range(9) if meldis.meshcat.HasPath(f"/DRAKE_VIEWER/2/a/b/{k}")]
    assert drawn == list(range(7))
    assert "none.obj" in caplog.text and "no kind 77" in caplog.text and "not understood" in caplog.text
    meldis.meshcat.SetSliderValue("DRAKE_VIEWER α", 0.5)
    show(meldis)
    assert meldis._viewers[0]._alpha == 0.5
    before = meldis.meshcat._hub.tree.get("/DRAKE_VIEWER/2/a/b/0").object
    meldis._lcm.Publish("DRAKE_VIEWER_LOAD_ROBOT", message)
    show(meldis)
    assert meldis.meshcat._hub.tree.get("/DRAKE_VIEWER/2/a/b/0").object is before, "what is there stays"


def test_it_ends_when_nobody_looks(meldis):
    with pytest.raises(SystemExit):
        meldis.serve_forever(idle_timeout=0.05)


def test_the_program(tmp_path):
    (tmp_path / "params.yaml").write_text("port: 0\n")
    command = [sys.executable, "-m", "sheldrake.visualization.meldis", "--idle-timeout", "0.1"]
    done = subprocess.run(
        [*command, "--meshcat-params", str(tmp_path / "params.yaml")], capture_output=True, text=True, timeout=240
    )
    assert done.returncode == 0 and "Traceback" not in done.stderr
    assert "http://localhost:" in done.stderr
