"""Meldis shows what a DrakeVisualizer publishes."""

import subprocess
import sys

import numpy as np
import pytest

from sheldrake import model_path
from sheldrake.geometry import HalfSpace, MeshcatParams
from sheldrake.lcm._messages import (
    lcmt_contact_results_for_viz,
    lcmt_hydroelastic_contact_surface_for_viz,
    lcmt_point,
    lcmt_point_cloud,
    lcmt_viewer_draw,
    lcmt_viewer_geometry_data,
    lcmt_viewer_link_data,
    lcmt_viewer_load_robot,
)
from sheldrake.math import RigidTransform, RollPitchYaw
from sheldrake.multibody.parsing import Parser
from sheldrake.multibody.plant import (
    AddMultibodyPlantSceneGraph,
    ConnectContactResultsToDrakeVisualizer,
    CoulombFriction,
)
from sheldrake.perception import BaseField, Fields, PointCloud, PointCloudToLcm
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder
from sheldrake.visualization import ApplyVisualizationConfig, Meldis, VisualizationConfig
from sheldrake.visualization._meldis import cloud_of


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
    nodes = dict(meldis.meshcat._hub.tree.items())
    drawn = [k for k in range(9) if getattr(nodes.get(f"/DRAKE_VIEWER/2/a/b/{k}"), "object", None) is not None]
    assert drawn == list(range(7))
    assert "none.obj" in caplog.text and "no kind 77" in caplog.text and "not understood" in caplog.text
    meldis.meshcat.SetSliderValue("DRAKE_VIEWER α", 0.5)
    show(meldis)
    assert meldis._viewers[0]._alpha == 0.5
    before = meldis.meshcat._hub.tree.get("/DRAKE_VIEWER/2/a/b/0").object
    meldis._lcm.Publish("DRAKE_VIEWER_LOAD_ROBOT", message)
    show(meldis)
    assert meldis.meshcat._hub.tree.get("/DRAKE_VIEWER/2/a/b/0").object is before, "what is there stays"


def test_contacts_are_arrows_and_go_away(meldis):
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step=1e-3)
    Parser(plant).AddModels(model_path("two_hole_block/two_hole_block.urdf"))
    friction = CoulombFriction(0.5, 0.5)
    plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform(), HalfSpace(), "ground", friction)
    plant.Finalize()
    ConnectContactResultsToDrakeVisualizer(builder, plant, scene_graph, meldis._lcm)
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(0.5)
    show(meldis)
    tree = meldis.meshcat._hub.tree
    arrows = {p.rpartition("/")[0] for p, _ in tree.items() if p.startswith("/CONTACT_RESULTS/point/")}
    arrows = {p for p in arrows if meldis.meshcat.HasPath(f"{p}/head")}
    results = plant.get_contact_results_output_port().Eval(plant.GetMyContextFromRoot(simulator.get_context()))
    assert len(arrows) == results.num_point_pair_contacts() > 0
    heights = {tree.get(p).pose[2, 3] for p in arrows}
    assert max(map(abs, heights)) < 1e-3
    meldis._lcm.Publish("CONTACT_RESULTS", lcmt_contact_results_for_viz(timestamp=10**6).encode())
    show(meldis)
    assert all(tree.get(p).properties["visible"] is False for p in arrows)


def surface(polygons):
    vertices = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    one = lcmt_hydroelastic_contact_surface_for_viz(
        body1_name="ball", body1_unique=True, collision_count1=1, body2_name="box", model2_name="crate",
        body2_unique=False, collision_count2=2, geometry2_name="crate::lid", force_C_W=[0.0, 0.0, 5.0],
        num_vertices=4, p_WV=[lcmt_point(x=x, y=y, z=z) for x, y, z in vertices], pressure=[0.0, 1.0, 2.0, 1.0],
        poly_data_int_count=len(polygons), poly_data=polygons,
    )  # fmt: skip
    return lcmt_contact_results_for_viz(num_hydroelastic_contacts=1, hydroelastic_contacts=[one]).encode()


def test_contact_surfaces_are_cut_into_triangles(meldis, caplog):
    meldis._lcm.Publish("CONTACT_RESULTS", surface([4, 0, 1, 2, 3]))
    show(meldis)
    path = "/CONTACT_RESULTS/hydroelastic/ball+crate.box.lid"
    assert meldis.meshcat.HasPath(f"{path}/contact_surface") and meldis.meshcat.HasPath(f"{path}/force_C_W/head")
    for nonsense in ([4, 0, 1, 2, 9], [4, 0, 1], [2, 0, 1], [-3, 0, 1, 2]):
        caplog.clear()
        meldis._lcm.Publish("CONTACT_RESULTS", surface(nonsense))
        show(meldis)
        assert "has the polygon" in caplog.text


def cloud_message(n=3):
    cloud = PointCloud(n, Fields(BaseField.kXYZs | BaseField.kRGBs | BaseField.kNormals))
    random = np.random.default_rng(2)
    cloud.mutable_xyzs()[:], cloud.mutable_normals()[:] = random.normal(size=(2, 3, n))
    cloud.mutable_rgbs()[:] = random.integers(0, 256, (3, n))
    system = PointCloudToLcm("camera")
    context = system.CreateDefaultContext()
    system.get_input_port().FixValue(context, cloud)
    return cloud, system.get_output_port().Eval(context)


def test_clouds_come_back_as_they_were_sent():
    cloud, message = cloud_message()
    again = cloud_of(lcmt_point_cloud.decode(message.encode()))
    for name in ("xyzs", "rgbs", "normals"):
        np.testing.assert_array_equal(getattr(again, name)(), getattr(cloud, name)())
    points = np.frombuffer(message.data, "<u4")
    message.data, message.flags = points.astype(">u4").tobytes(), message.flags | lcmt_point_cloud.IS_BIGENDIAN
    np.testing.assert_array_equal(cloud_of(message).xyzs(), cloud.xyzs())


def test_clouds_are_drawn_below_the_names_of_their_channels(meldis, caplog):
    _, message = cloud_message()
    for channel in ("DRAKE_POINT_CLOUD", "DRAKE_POINT_CLOUD_left"):
        meldis._lcm.Publish(channel, message.encode())
    show(meldis)
    assert meldis.meshcat.HasPath("/POINT_CLOUD/default") and meldis.meshcat.HasPath("/POINT_CLOUD/left")
    message.width = 100
    meldis._lcm.Publish("DRAKE_POINT_CLOUD", message.encode())
    message.width, message.fields = 3, message.fields[1:]
    message.num_fields = len(message.fields)
    meldis._lcm.Publish("DRAKE_POINT_CLOUD_left", message.encode())
    show(meldis)
    assert "a cloud of 1 x 100 points" in caplog.text and "no x, y, z" in caplog.text


def frames(*names):
    pose = {"position": [[0.0, 0.0, 0.5]] * len(names), "quaternion": [[1.0, 0.0, 0.0, 0.0]] * len(names)}
    return lcmt_viewer_draw(num_links=len(names), link_name=names, robot_num=[0] * len(names), **pose).encode()


def test_frames_come_and_go(meldis):
    for names in (("tool", "base"), ("tool",)):
        meldis._lcm.Publish("DRAKE_DRAW_FRAMES", frames(*names))
        show(meldis)
        assert meldis.meshcat.HasPath("/DRAKE_DRAW_FRAMES/0/tool/x-axis")
        assert meldis.meshcat.HasPath("/DRAKE_DRAW_FRAMES/0/base") == ("base" in names)
    assert meldis.meshcat._hub.tree.get("/DRAKE_DRAW_FRAMES/0/tool").pose[2, 3] == 0.5


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
