"""PlanarSceneGraphVisualizer: outlines, colors, order and view of what is drawn."""

import matplotlib
import numpy as np
import pytest

import sheldrake
from sheldrake.geometry import Box, Capsule, Convex, Ellipsoid, HalfSpace, Mesh, Sphere
from sheldrake.math import RigidTransform, RollPitchYaw
from sheldrake.multibody.math import SpatialInertia
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder
from sheldrake.systems.planar_scenegraph_visualizer import ConnectPlanarSceneGraphVisualizer, convex_hull

BLOCK = sheldrake.model_path("two_hole_block/two_hole_block.obj")
TOP_VIEW = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]]


@pytest.fixture(autouse=True)
def no_window():
    matplotlib.use("Agg")


def draw(shapes, X_WB=None, **options):
    """Draws shapes of one body, each (shape, x of its middle), and returns visualizer and patches."""
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
    body = plant.AddRigidBody("body", SpatialInertia.SolidSphereWithMass(1.0, 0.1))
    for i, (shape, p) in enumerate(shapes):
        plant.RegisterVisualGeometry(body, RigidTransform(p), shape, f"shape{i}", [0.1 * i, 0.5, 0.2, 0.75])
    plant.Finalize()
    visualizer = ConnectPlanarSceneGraphVisualizer(builder, scene_graph, **options)
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    plant.SetFreeBodyPose(plant.GetMyMutableContextFromRoot(context), body, X_WB or RigidTransform())
    diagram.ForcedPublish(context)
    return visualizer, visualizer.ax.patches


def extents(patch):
    xy = patch.get_xy()
    return [*xy.min(axis=0), *xy.max(axis=0)]


@pytest.mark.parametrize(
    ("shape", "expected", "tolerance"),
    [
        (Box(1, 2, 3), [-0.5, -1.5, 0.5, 1.5], 1e-12),
        (Sphere(0.5), [-0.5, -0.5, 0.5, 0.5], 1e-12),
        (Capsule(0.2, 1.0), [-0.2, -0.7, 0.2, 0.7], 1e-12),
        (Ellipsoid(0.1, 0.2, 0.3), [-0.1, -0.3, 0.1, 0.3], 1e-12),
        (HalfSpace(), [-50, -1, 50, 0], 1e-12),
        (Mesh(BLOCK, 1e-3), [0, 0, 0.08, 0.03], 1e-9),
        (Convex(BLOCK, 1e-3), [0, 0, 0.08, 0.03], 1e-9),
    ],
)
def test_outlines(shape, expected, tolerance):
    _, (patch,) = draw([(shape, [0, 0, 0])])
    assert extents(patch) == pytest.approx(expected, abs=tolerance)
    assert patch.get_facecolor() == pytest.approx((0, 0.5, 0.2, 0.75))


def test_view_and_pose():
    X_WB = RigidTransform(RollPitchYaw(0, 0, np.pi / 2), [1, 2, 3])
    visualizer, (patch,) = draw([(Box(1, 2, 3), [0, 0, 0])], X_WB, T_VW=TOP_VIEW, xlim=[-2, 2], ylim=[0, 8])
    assert extents(patch) == pytest.approx([0, 1.5, 2, 2.5])
    assert visualizer.ax.get_xlim() == (-2, 2) and visualizer.ax.get_ylim() == (0, 8)
    assert visualizer.get_name() == "planar_scenegraph_visualizer"


def test_perspective_divides():
    half_as_large_at_two_metres = [[1, 0, 0, 0], [0, 0, 1, 0], [0, 1, 0, 0]]
    _, patches = draw([(Box(1, 1e-9, 1), [0, 1, 0]), (Box(1, 1e-9, 1), [0, 2, 0])], T_VW=half_as_large_at_two_metres)
    assert extents(patches[0])[2] == pytest.approx(2 * extents(patches[1])[2])


def test_the_nearer_covers_the_farther():
    _, (near, far) = draw([(Sphere(1), [0, -1, 0]), (Sphere(1), [0, 1, 0])])
    assert near.get_zorder() > far.get_zorder(), "looking along +y"
    _, (high, low) = draw([(Sphere(1), [0, 0, 1]), (Sphere(1), [0, 0, -1])], T_VW=TOP_VIEW)
    assert high.get_zorder() > low.get_zorder(), "looking down"


def test_own_axes_and_random_colors():
    ax = matplotlib.figure.Figure().add_subplot()
    visualizer, patches = draw([(Sphere(1), [0, 0, 0]), (Sphere(1), [1, 0, 0])], ax=ax, use_random_colors=True)
    assert visualizer.ax is ax and patches[0].get_facecolor() == patches[1].get_facecolor()


def test_a_file_beside_stands_in_for_one_that_cannot_be_read(tmp_path):
    (tmp_path / "part.xyz").write_text("nonsense")
    (tmp_path / "part.obj").write_bytes(open(BLOCK, "rb").read())
    mesh = Mesh(str(tmp_path / "part.xyz"), 1e-3)
    _, (patch,) = draw([(mesh, [0, 0, 0])])
    assert extents(patch) == pytest.approx([0, 0, 0.08, 0.03], abs=1e-9)
    with pytest.raises(RuntimeError):
        draw([(mesh, [0, 0, 0])], substitute_collocated_mesh_files=False)


def test_a_recording_plays():
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
    body = plant.AddRigidBody("body", SpatialInertia.SolidSphereWithMass(1.0, 0.1))
    plant.RegisterVisualGeometry(body, RigidTransform(), Sphere(0.1), "ball", [1, 0, 0, 1])
    plant.Finalize()
    visualizer = ConnectPlanarSceneGraphVisualizer(builder, scene_graph, show=False)
    simulator = Simulator(builder.Build())
    simulator.Initialize()
    visualizer.start_recording()
    simulator.AdvanceTo(0.5)
    visualizer.stop_recording()
    animation = visualizer.get_recording_as_animation()
    heights = []
    for k in (0, 14):
        animation._func(k)
        heights.append(np.mean(extents(visualizer.ax.patches[0])[1::2]))
    assert heights == pytest.approx([0.0, -0.5 * 9.81 * (14 / 30) ** 2], abs=0.02 * 9.81)
    assert len(animation.to_jshtml()) > 1000


def test_hull_of_a_square_with_points_inside():
    points = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0.5, 0.5], [0.5, 0], [0, 0]])
    assert convex_hull(points).tolist() == [[0, 0], [1, 0], [1, 1], [0, 1]]
    with pytest.raises(ValueError, match=r"T_VW must have shape \(3, 4\)"):
        draw([], T_VW=np.eye(4))
