"""ContactVisualizer: which arrows are drawn, where, how long, and what a recording keeps of them."""

import numpy as np
import pytest

from sheldrake.geometry import HalfSpace, Meshcat, Rgba, Sphere
from sheldrake.math import RigidTransform
from sheldrake.multibody.math import SpatialInertia
from sheldrake.multibody.meshcat import (
    ContactVisualizer,
    ContactVisualizerParams,
    _HydroelasticContactVisualizer,
    _HydroelasticContactVisualizerItem,
    _PointContactVisualizer,
    _PointContactVisualizerItem,
)
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder

WEIGHT = 2.0 * 9.81


class Scene:
    """A ball of 2 kg on the ground."""

    def __init__(self, params=None, connect="plant"):
        builder = DiagramBuilder()
        plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 1e-3)
        friction = CoulombFriction(0.5, 0.5)
        self.ball = plant.AddRigidBody("ball", SpatialInertia.SolidSphereWithMass(2.0, 0.1))
        plant.RegisterCollisionGeometry(self.ball, RigidTransform(), Sphere(0.1), "shell", friction)
        plant.RegisterCollisionGeometry(self.ball, RigidTransform([0, 0, 0.5]), Sphere(0.05), "nose", friction)
        plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform(), HalfSpace(), "ground", friction)
        plant.Finalize()
        self.meshcat = Meshcat(port=0)
        sources = {
            "plant": [plant],
            "ports": [plant.get_contact_results_output_port(), scene_graph.get_query_output_port()],
            "results": [plant.get_contact_results_output_port()],
        }[connect]
        self.visualizer = ContactVisualizer.AddToBuilder(builder, *sources, self.meshcat, params)
        self.plant, self.diagram = plant, builder.Build()
        self.simulator = Simulator(self.diagram)
        self.context = plant.GetMyMutableContextFromRoot(self.simulator.get_mutable_context())
        plant.SetFreeBodyPose(self.context, self.ball, RigidTransform([0.3, 0, 0.1]))

    def element(self, path):
        return self.meshcat._hub.tree.get(f"/drake/contact_forces/point/{path}")


def test_the_weight_is_an_arrow_of_its_length():
    scene = Scene()
    assert scene.visualizer.get_name() == "meshcat_contact_visualizer"
    scene.simulator.AdvanceTo(2.0)
    (path,) = ["ball.shell+world"]
    assert scene.element(path).properties["visible"] is True
    assert scene.element(path).pose[:, 3] == pytest.approx([0.3, 0, 0], abs=1e-3)
    assert abs(scene.element(path).pose[2, 2]) == pytest.approx(1.0, abs=1e-9), "along the vertical"
    length = WEIGHT / 10.0
    assert scene.element(f"{path}/cylinder").properties["scale"] == pytest.approx([1, 1, length], rel=1e-6)
    assert scene.element(f"{path}/cylinder").object.shape.length() == 2.0
    assert scene.element(f"{path}/head").pose[2, 3] == pytest.approx(-length - 0.004, rel=1e-6)
    assert scene.element(f"{path}/tail").pose[2, 3] == pytest.approx(length + 0.004, rel=1e-6)
    assert scene.element(f"{path}/head").object.rgba == Rgba(0, 1, 0)


def test_without_the_scene_graph_geometries_have_numbers():
    scene = Scene(connect="results")
    scene.simulator.AdvanceTo(0.5)
    shell = scene.plant.GetCollisionGeometriesForBody(scene.ball)[0]
    assert scene.element(f"ball.Id({shell.get_value()})+world") is not None
    scene = Scene(connect="ports")
    scene.simulator.AdvanceTo(0.5)
    assert scene.element("ball.shell+world") is not None


def test_a_contact_that_ends_is_hidden_and_the_recording_knows():
    scene = Scene(ContactVisualizerParams(publish_period=0.125))
    scene.meshcat.StartRecording(8.0)
    scene.simulator.AdvanceTo(0.25)
    scene.plant.SetFreeBodyPose(scene.context, scene.ball, RigidTransform([0, 0, 5.0]))
    scene.simulator.AdvanceTo(0.5)
    assert scene.element("ball.shell+world").properties["visible"] is False
    _, frames = scene.meshcat.get_mutable_recording()._tracks["/drake/contact_forces/point/ball.shell+world"]["visible"]
    assert [frames[frame] for frame in sorted(frames)] == [False, True, False] and min(frames) == 0
    cylinder = "/drake/contact_forces/point/ball.shell+world/cylinder"
    assert set(scene.meshcat.get_mutable_recording()._tracks[cylinder]) == {"scale"}


def test_initialization_clears_and_delete_clears():
    scene = Scene()
    scene.simulator.AdvanceTo(0.5)
    scene.visualizer.Delete()
    assert not scene.meshcat.HasPath("contact_forces")
    scene.simulator.AdvanceTo(1.0)
    assert scene.element("ball.shell+world").properties["visible"] is True
    scene.meshcat.SetObject("contact_forces/old", Sphere(1))
    scene.simulator.Initialize()
    assert not scene.meshcat.HasPath("contact_forces/old")


def test_every_contact_of_a_pair_has_an_arrow():
    """A box on the ground touches it at four points."""
    meshcat = Meshcat(port=0)
    arrows = _PointContactVisualizer(meshcat, ContactVisualizerParams())
    corners = [[x, y, 0.0] for x in (-1, 1) for y in (-1, 1)]
    arrows.Update(0.0, [_PointContactVisualizerItem("a", "b", [0, 0, 5.0], corner) for corner in corners])
    drawn = [meshcat._hub.tree.get(f"/drake/contact_forces/a+b{end}").pose[:, 3] for end in ("", ".2", ".3", ".4")]
    assert np.array_equal(drawn, corners)


def test_forces_below_the_threshold_are_not_shown():
    meshcat = Meshcat(port=0)
    arrows = _PointContactVisualizer(meshcat, ContactVisualizerParams(force_threshold=1.0, prefix="/f"))
    arrows.Update(0.0, [_PointContactVisualizerItem("a", "b", [0, 0, 0.999], [0, 0, 0])])
    assert meshcat._hub.tree.get("/f/a+b").properties["visible"] is False
    arrows.Update(0.1, [_PointContactVisualizerItem("a", "b", [0, 1.0, 0], [0, 0, 0])])
    element = meshcat._hub.tree.get("/f/a+b")
    assert element.properties["visible"] is True
    assert np.array_equal(element.pose[:, 2], [0, 1, 0])


def test_a_contact_surface_has_its_pressure_and_two_arrows():
    meshcat = Meshcat(port=0)
    surfaces = _HydroelasticContactVisualizer(meshcat, ContactVisualizerParams())
    vertices = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=float).T
    item = _HydroelasticContactVisualizerItem(
        "a", "b", [1, 2, 3], [0, 0, -5.0], [0, 0.001, 0], vertices, np.array([[0, 1, 2], [0, 2, 3]]).T, [0, 1, 2, 4]
    )
    surfaces.Update(0.5, [item])
    tree, root = meshcat._hub.tree, "/drake/contact_forces/a+b"
    assert np.array_equal(tree.get(root).pose[:, 3], [1, 2, 3])
    surface = tree.get(f"{root}/contact_surface").object
    assert np.array_equal(surface.colors, [[0, 0, 0], [0, 0, 1], [1, 0, 0], [1, 1, 1]])
    assert np.array_equal(tree.pose_in_world(f"{root}/contact_surface"), np.eye(4))
    assert np.allclose(tree.get(f"{root}/force_C_W").pose[:, 2], [0, 0, -1])
    assert tree.get(f"{root}/force_C_W/cylinder").properties["scale"] == [1, 1, 0.5]
    assert tree.get(f"{root}/moment_C_W").properties["visible"] is False
    surfaces.Update(0.6, [])
    assert tree.get(root).properties["visible"] is False
    surfaces.Delete()
    assert not meshcat.HasPath(root)


def test_no_moment_has_no_arrow_even_where_all_moments_have_one():
    meshcat = Meshcat(port=0)
    surfaces = _HydroelasticContactVisualizer(meshcat, ContactVisualizerParams(moment_threshold=0.0))
    triangle = np.eye(3), np.array([[0], [1], [2]]), [0, 0, 0]
    for moment in (0.0, 1e-9):
        item = _HydroelasticContactVisualizerItem("a", "b", [0] * 3, [0, 0, 1], [0, 0, moment], *triangle)
        surfaces.Update(0.5, [item])
        shown = meshcat._hub.tree.get("/drake/contact_forces/a+b/moment_C_W").properties["visible"]
        assert shown is (moment > 0.0)


@pytest.mark.parametrize(("name", "value"), [("publish_period", -1), ("force_threshold", 0)])
def test_parameters_that_are_out_of_range(name, value):
    with pytest.raises(RuntimeError, match=f"{name} {value}"):
        ContactVisualizer(Meshcat(port=0), ContactVisualizerParams(**{name: value}))


def test_wrong_arguments_say_what_is_expected():
    builder, meshcat = DiagramBuilder(), Meshcat(port=0)
    with pytest.raises(TypeError, match=r"Meshcat\); accepted: \(builder: DiagramBuilder, plant: Mu"):
        ContactVisualizer.AddToBuilder(builder, meshcat)
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 1e-3)
    plant.Finalize()
    builder.Disconnect(scene_graph.get_query_output_port(), plant.get_geometry_query_input_port())
    with pytest.raises(RuntimeError, match="geometry query port of plant 'plant' is not connected"):
        ContactVisualizer.AddToBuilder(builder, plant, meshcat)
    visualizer = builder.AddSystem(ContactVisualizer(meshcat))
    with pytest.raises(RuntimeError, match="'contact_results' is not connected"):
        diagram = builder.Build()
        diagram.ForcedPublish(diagram.CreateDefaultContext())
    assert visualizer.query_object_input_port().get_name() == "query_object"


def test_no_arrow_is_longer_than_the_scene(meshcat):
    """Bodies that overlap at rest press with a million times their weight."""
    meshcat.SetObject("body", Sphere(0.5))
    meshcat.SetObject("hidden", Sphere(1e3))
    meshcat.SetProperty("hidden", "visible", False)
    diagonal = np.sqrt(3.0)
    arrows = _PointContactVisualizer(meshcat, ContactVisualizerParams(prefix="f"))
    forces = {"a": 5.0, "b": 1e7}
    arrows.Update(0, [_PointContactVisualizerItem(k, k, [0, 0, f], [0, 0, 0]) for k, f in forces.items()])
    scales = [meshcat._hub.tree.get(f"/drake/f/{k}+{k}/cylinder").properties["scale"][2] for k in forces]
    assert scales == pytest.approx([0.5, diagonal])


def test_a_scene_of_arrows_alone_is_measured_ever_more_seldom():
    """Measuring walks over the whole scene: at each publish it took ten times as long as drawing."""
    from sheldrake.multibody.meshcat._arrow import Longest

    class Scene:
        measured, extent = 0, None

        def _extent(self):
            self.measured += 1
            return self.extent

    scene = Scene()
    longest = Longest(scene)
    assert [longest.of(5.0) for _ in range(100)] == [5.0] * 100 and scene.measured == 7  # 1, 2, 4, ... 64
    scene.extent = 2.0
    lengths = [float(longest.of(5.0)) for _ in range(100)]
    assert lengths[-1] == 2.0 and scene.measured == 8
    longest.forget()
    assert float(longest.of(5.0)) == 2.0 and scene.measured == 9


def test_a_publish_of_many_recorded_arrows_takes_as_many_calls_as_of_few():
    """Arrows that are there already are shown, placed and stretched all at once, with and without a recording."""
    import sys

    def calls(count):
        meshcat = Meshcat(port=0)
        arrows = _PointContactVisualizer(meshcat, ContactVisualizerParams())
        paths = arrows.paths([("a", "b")] * count)
        forces, points = np.tile([0.0, 0.0, 5.0], (count, 1)), np.zeros((count, 3))
        meshcat.StartRecording(8.0)
        for time, size in ((0.0, 1.0), (0.125, 0.0), (0.25, 2.0), (0.375, 3.0)):
            made = []
            sys.setprofile(lambda _frame, event, _of, made=made: made.append(1) if event == "call" else None)
            arrows.show(time, paths, size * forces, points)
            sys.setprofile(None)
        tracks = meshcat.get_mutable_recording()._tracks
        assert [len(tracks[f"{path}/cylinder"]["scale"][1]) for path in paths] == [3] * count
        return len(made)

    assert abs(calls(100) - calls(10)) < 30  # of Python functions; one for each arrow would be 90 more
