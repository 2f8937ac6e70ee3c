"""MeshcatVisualizer: what of a SceneGraph is drawn, where, and when."""

import copy

import numpy as np
import pytest

from sheldrake.autodiffutils import AutoDiffXd
from sheldrake.common.value import AbstractValue
from sheldrake.geometry import (
    AddCompliantHydroelasticProperties,
    AddRigidHydroelasticProperties,
    Box,
    FrameId,
    FramePoseVector,
    GeometryFrame,
    GeometryInstance,
    HalfSpace,
    IllustrationProperties,
    MakePhongIllustrationProperties,
    Meshcat,
    MeshcatPointCloudVisualizer,
    MeshcatVisualizer,
    MeshcatVisualizerParams,
    ProximityProperties,
    Rgba,
    Role,
    SceneGraph,
    Sphere,
)
from sheldrake.math import RigidTransform, RigidTransform_, RollPitchYaw
from sheldrake.multibody.math import SpatialInertia
from sheldrake.multibody.meshcat import ContactVisualizer
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph
from sheldrake.perception import PointCloud
from sheldrake.symbolic import Expression
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder, LeafSystem


class Faller(LeafSystem):
    """One frame that moves along z with its time."""

    def __init__(self, frame):
        super().__init__()
        self._frame = frame
        self.DeclareAbstractOutputPort("poses", lambda: AbstractValue.Make(FramePoseVector()), self._calc)

    def _calc(self, context, output):
        poses = FramePoseVector()
        poses.set_value(self._frame, RigidTransform([0.0, 0.0, 1.0 - context.get_time()]))
        output.set_value(poses)


class Scene:
    def __init__(self, params=None, connect=True):
        builder = DiagramBuilder()
        self.scene_graph = builder.AddSystem(SceneGraph())
        self.source = self.scene_graph.RegisterSource("plant")
        self.frame = self.scene_graph.RegisterFrame(self.source, GeometryFrame("robot::arm::hand"))
        self.hand = self._add(self.frame, Box(0.1, 0.2, 0.3), [0.5, 0, 0], Rgba(1, 0, 0))
        self.bare = self._add(self.frame, Sphere(0.1), [0, 0, 0], None)
        self.ground = self._add(self.scene_graph.world_frame_id(), HalfSpace(), [0, 0, 0], Rgba(0, 1, 0))
        faller = builder.AddSystem(Faller(self.frame))
        builder.Connect(faller.get_output_port(0), self.scene_graph.get_source_pose_port(self.source))
        self.meshcat = Meshcat(port=0)
        if connect:
            self.visualizer = MeshcatVisualizer.AddToBuilder(builder, self.scene_graph, self.meshcat, params)
        self.diagram = builder.Build()
        self.simulator = Simulator(self.diagram)

    def _add(self, frame, shape, p, rgba):
        instance = GeometryInstance(RigidTransform(p), shape, f"{type(shape).__name__}")
        geometry = self.scene_graph.RegisterGeometry(self.source, frame, instance)
        properties = IllustrationProperties() if rgba is None else MakePhongIllustrationProperties(rgba.rgba)
        self.scene_graph.AssignRole(self.source, geometry, properties)
        return geometry

    def element(self, path):
        return self.meshcat._hub.tree.get(path)


def test_paths_shapes_colors_and_poses():
    scene = Scene()
    assert scene.visualizer.get_name() == "meshcat_visualizer(visualizer)"
    assert not scene.meshcat.HasPath("visualizer")
    scene.simulator.Initialize()
    hand = "/drake/visualizer/robot/arm/hand/Box"
    assert isinstance(scene.element(hand).object.shape, Box)
    assert scene.element(hand).object.rgba == Rgba(1, 0, 0)
    assert scene.element(hand).pose[:, 3] == pytest.approx([0.5, 0, 0])
    bare = "/drake/visualizer/robot/arm/hand/Sphere"
    assert scene.element(bare).object.rgba == Rgba(0.9, 0.9, 0.9)
    assert isinstance(scene.element("/drake/visualizer/HalfSpace").object.shape, HalfSpace)
    assert scene.element("/drake/visualizer/robot/arm/hand").pose[:, 3] == pytest.approx([0, 0, 1])
    scene.simulator.AdvanceTo(0.5)
    assert scene.element("/drake/visualizer/robot/arm/hand").pose[:, 3] == pytest.approx([0, 0, 0.5])


def test_publishes_every_period():
    scene = Scene(MeshcatVisualizerParams(publish_period=0.25))
    scene.simulator.Initialize()
    scene.visualizer.StartRecording(set_transforms_while_recording=False)
    scene.simulator.AdvanceTo(1.0)
    scene.visualizer.StopRecording()
    recording = scene.visualizer.get_mutable_recording()
    assert recording.frames_per_second() == 4.0
    track = recording._poses["/drake/visualizer/robot/arm/hand"]
    heights = {frame: pose[2, 3] for frame, pose in track.items() if frame}
    assert heights == pytest.approx({1: 0.75, 2: 0.5, 3: 0.25, 4: 0})
    assert scene.element("/drake/visualizer/robot/arm/hand").pose[2, 3] == 1.0, "the page was left alone"
    scene.visualizer.DeleteRecording()
    assert scene.visualizer.get_mutable_recording()._num_frames() == 0


def test_role_prefix_and_default_color():
    params = MeshcatVisualizerParams(
        role=Role.kProximity, prefix="/collisions", default_color=Rgba(0.8, 0, 0), visible_by_default=False
    )
    scene = Scene(params)
    scene.scene_graph.AssignRole(scene.source, scene.hand, ProximityProperties())
    simulator = Simulator(scene.diagram)
    simulator.Initialize()
    hand = "/collisions/robot/arm/hand/Box"
    assert scene.element(hand).object.rgba == Rgba(0.8, 0, 0)
    assert scene.element("/collisions").properties["visible"] is False
    assert not scene.meshcat.HasPath("/collisions/HalfSpace")


@pytest.mark.parametrize("wanted", [True, False])
def test_hydroelastic_meshes(wanted):
    """Where they are wanted, compliant and rigid shapes are drawn as what touches; half spaces are as they are."""
    scene = Scene(MeshcatVisualizerParams(role=Role.kProximity, prefix="/collisions", show_hydroelastic=wanted))
    for geometry in (scene.hand, scene.bare, scene.ground):
        properties = ProximityProperties()
        if geometry == scene.hand:
            AddCompliantHydroelasticProperties(0.1, 1e6, properties)
        else:
            AddRigidHydroelasticProperties(0.1, properties)
        scene.scene_graph.AssignRole(scene.source, geometry, properties)
    Simulator(scene.diagram).Initialize()
    drawn = {name: scene.element(f"/collisions/{name}").object
             for name in ("robot/arm/hand/Box", "robot/arm/hand/Sphere", "HalfSpace")}  # fmt: skip
    numbers = {name: len(thing.faces) if hasattr(thing, "faces") else 0 for name, thing in drawn.items()}
    box, sphere = (24, 32) if wanted else (0, 0)
    assert numbers == {"robot/arm/hand/Box": box, "robot/arm/hand/Sphere": sphere, "HalfSpace": 0}


@pytest.mark.parametrize("accepting, drawn", [("visualizer", True), ("other", False)])
def test_accepting(accepting, drawn):
    scene = Scene()
    properties = IllustrationProperties()
    properties.AddProperty("meshcat", "accepting", accepting)
    geometry = scene.scene_graph.RegisterGeometry(
        scene.source, scene.frame, GeometryInstance(RigidTransform(), Sphere(1), "picky")
    )
    scene.scene_graph.AssignRole(scene.source, geometry, properties)
    Simulator(scene.diagram).Initialize()
    assert scene.meshcat.HasPath("visualizer/robot/arm/hand/picky") == drawn


def test_include_unspecified_accepting():
    scene = Scene(MeshcatVisualizerParams(include_unspecified_accepting=False))
    scene.simulator.Initialize()
    assert not scene.meshcat.HasPath("visualizer/robot")


def test_geometry_removed_in_the_context_goes_from_the_page():
    scene = Scene()
    scene.simulator.Initialize()
    hand = "visualizer/robot/arm/hand/Box"
    assert scene.meshcat.HasPath(hand)
    context = scene.simulator.get_mutable_context()
    graph_context = scene.scene_graph.GetMyMutableContextFromRoot(context)
    scene.scene_graph.RemoveRole(graph_context, scene.source, scene.hand, Role.kIllustration)
    scene.diagram.ForcedPublish(context)
    assert not scene.meshcat.HasPath(hand)


def test_delete_on_initialization():
    for wanted in (True, False):
        scene = Scene(MeshcatVisualizerParams(delete_on_initialization_event=wanted))
        scene.meshcat.SetObject("visualizer/old", Sphere(1))
        scene.simulator.Initialize()
        assert scene.meshcat.HasPath("visualizer/old") != wanted


def test_delete_draws_anew():
    scene = Scene()
    scene.simulator.Initialize()
    scene.visualizer.Delete()
    assert not scene.meshcat.HasPath("visualizer")
    scene.diagram.ForcedPublish(scene.simulator.get_context())
    assert scene.meshcat.HasPath("visualizer/robot/arm/hand")


def test_alpha_slider():
    scene = Scene(MeshcatVisualizerParams(enable_alpha_slider=True, initial_alpha_slider_value=0.501))
    assert scene.meshcat.GetSliderNames() == ["visualizer α"]
    scene.simulator.Initialize()
    assert scene.element("/drake/visualizer").properties["modulated_opacity"] == pytest.approx(0.5)
    scene.meshcat.SetSliderValue("visualizer α", 0.2)
    scene.diagram.ForcedPublish(scene.simulator.get_context())
    assert scene.element("/drake/visualizer").properties["modulated_opacity"] == pytest.approx(0.2)


def test_add_to_builder_takes_the_query_port():
    builder = DiagramBuilder()
    scene_graph = builder.AddSystem(SceneGraph())
    meshcat = Meshcat(port=0)
    by_port = MeshcatVisualizer.AddToBuilder(
        builder=builder, query_object_port=scene_graph.get_query_output_port(), meshcat=meshcat
    )
    twice = MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat)
    assert by_port.get_name() != twice.get_name()
    assert by_port.query_object_input_port().get_name() == "query_object"
    builder.Build()


def test_the_port_of_the_scene_needs_no_number():
    """Scripts from before the second port ask so."""
    visualizer = MeshcatVisualizer(Meshcat())
    assert visualizer.get_input_port() is visualizer.query_object_input_port()
    assert visualizer.get_input_port(1) is visualizer.surface_displacements_input_port()


def test_wrong_arguments():
    meshcat, builder = Meshcat(port=0), DiagramBuilder()
    with pytest.raises(RuntimeError, match="publish_period is negative, -1"):
        MeshcatVisualizer(meshcat, MeshcatVisualizerParams(publish_period=-1))
    with pytest.raises(RuntimeError, match="role must not be kUnassigned"):
        MeshcatVisualizer(meshcat, MeshcatVisualizerParams(role=Role.kUnassigned))
    with pytest.raises(
        TypeError, match=r"Got \(DiagramBuilder, str, Meshcat\); accepted: \(builder: DiagramBuilder, scene_graph"
    ):
        MeshcatVisualizer.AddToBuilder(builder, "graph", meshcat)
    visualizer = MeshcatVisualizer(meshcat)
    with pytest.raises(RuntimeError, match="input port 'query_object' is not connected"):
        visualizer.ForcedPublish(visualizer.CreateDefaultContext())


def test_cloned_context_publishes_the_same():
    scene = Scene()
    scene.simulator.Initialize()
    scene.simulator.AdvanceTo(0.25)
    clone = scene.simulator.get_context().Clone()
    clone.SetTime(0.75)
    scene.diagram.ForcedPublish(clone)
    np.testing.assert_allclose(scene.element("/drake/visualizer/robot/arm/hand").pose[2, 3], 0.25)


def test_a_copied_query_object_keeps_its_moment():
    """As Drake's: what is recorded is drawn later."""
    scene = Scene()
    context = scene.simulator.get_mutable_context()
    scene_graph_context = scene.scene_graph.GetMyContextFromRoot(context)
    query = scene.scene_graph.get_query_output_port().Eval(scene_graph_context)
    kept = copy.copy(query)
    scene.simulator.AdvanceTo(0.5)
    now = scene.scene_graph.get_query_output_port().Eval(scene_graph_context)
    assert now.GetPoseInWorld(scene.frame).translation() == pytest.approx([0, 0, 0.5])
    for one in (kept, copy.deepcopy(kept), AbstractValue.Make(kept).Clone().get_value()):
        assert one.GetPoseInWorld(scene.frame).translation() == pytest.approx([0, 0, 1])
        assert one.inspector().num_geometries() == query.inspector().num_geometries()


def test_poses_that_are_numbers_until_somebody_asks():
    """What a plant gives: the same as poses set one by one, also in copies and after a change."""
    frames = tuple(FrameId.get_new_id() for _ in range(3))
    rows = np.zeros((3, 12))
    rows[:, [0, 4, 8]], rows[:, 9] = 1.0, [1, 2, 3]
    lazy, plain = FramePoseVector(), FramePoseVector()
    lazy._set_rows(frames, rows)
    for frame, x in zip(frames, (1, 2, 3)):
        plain.set_value(frame, RigidTransform([x, 0, 0]))
    for one in (lazy, copy.copy(lazy), copy.deepcopy(lazy)):
        assert one.size() == 3 and one.has_id(frames[2]) and list(one.ids()) == list(frames)
        for frame in frames:
            assert one.value(frame).IsExactlyEqualTo(plain.value(frame))
    changed = copy.copy(lazy)
    changed.set_value(frames[0], RigidTransform([9, 0, 0]))
    assert changed.value(frames[0]).translation()[0] == 9 and changed.value(frames[1]).translation()[0] == 2
    assert lazy.value(frames[0]).translation()[0] == 1
    changed.clear()
    assert changed.size() == 0 and not changed.has_id(frames[1])


def test_many_poses_at_once_are_those_asked_for_one_by_one():
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
    bodies = [plant.AddRigidBody(f"b{k}", SpatialInertia.SolidSphereWithMass(1.0, 0.1)) for k in range(5)]
    for body in bodies:
        plant.RegisterVisualGeometry(body, RigidTransform(), Sphere(0.1), "look", [1, 0, 0, 1])
    plant.Finalize()
    source = scene_graph.RegisterSource("other")
    above = scene_graph.RegisterFrame(source, GeometryFrame("above"))
    nested = scene_graph.RegisterFrame(source, above, GeometryFrame("nested"))
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    poses = FramePoseVector()
    poses.set_value(above, RigidTransform([0, 0, 5.0]))
    poses.set_value(nested, RigidTransform([1.0, 0, 0]))
    scene_graph_context = scene_graph.GetMyMutableContextFromRoot(context)
    scene_graph.get_source_pose_port(source).FixValue(scene_graph_context, poses)
    query = scene_graph.get_query_output_port().Eval(scene_graph_context)
    frames = [nested, *(plant.GetBodyFrameIdOrThrow(body.index()) for body in bodies), above]
    memo = {}
    plant_context = plant.GetMyMutableContextFromRoot(context)
    rng = np.random.default_rng(2)
    for _ in range(3):
        for body in bodies:
            X_WB = RigidTransform(RollPitchYaw(rng.normal(size=3)), rng.normal(size=3))
            plant.SetFreeBodyPose(plant_context, body, X_WB)
        expected = [query.GetPoseInWorld(frame).GetAsMatrix34() for frame in frames]
        assert np.array_equal(query._world_matrices(frames, memo), expected)


def test_visualizers_of_duals_draw_values():
    meshcat = Meshcat()
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.01)
    body = plant.AddRigidBody("body", SpatialInertia.SolidSphereWithMass(1.0, 0.1))
    plant.RegisterVisualGeometry(body, RigidTransform(), Sphere(0.1), "ball", [1.0, 0.0, 0.0, 1.0])
    plant.Finalize()
    visualizer = MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat)
    ContactVisualizer.AddToBuilder(builder, plant, meshcat)
    diagram = builder.Build()
    duals = diagram.ToAutoDiffXd()
    duals.ForcedPublish(duals.CreateDefaultContext())
    assert meshcat.HasPath("/drake/visualizer/DefaultModelInstance/body") or meshcat.HasPath("/drake/visualizer/body")
    assert isinstance(diagram.Clone().GetSubsystemByName(visualizer.get_name()), MeshcatVisualizer)
    assert diagram.ToSymbolicMaybe() is None
    converts = visualizer.get_system_scalar_converter().IsConvertible
    assert converts[AutoDiffXd, float]() and not converts[Expression, float]()


def test_point_cloud_visualizer_of_duals():
    meshcat, T = Meshcat(), AutoDiffXd
    visualizer = MeshcatPointCloudVisualizer(meshcat, "cloud").ToAutoDiffXd()
    context = visualizer.CreateDefaultContext()
    visualizer.cloud_input_port().FixValue(context, AbstractValue.Make(PointCloud(2)))
    visualizer.pose_input_port().FixValue(context, RigidTransform_[T](np.array([T(1.0, [1.0]), T(2.0), T(3.0)])))
    visualizer.ForcedPublish(context)
    assert meshcat.HasPath("cloud")
