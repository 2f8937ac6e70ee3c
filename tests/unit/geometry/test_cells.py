"""Cells find what looking at all pairs finds, and a plant's steps have the same bits with either."""

import numpy as np
import pytest

from sheldrake.geometry import (
    Box,
    Capsule,
    CollisionFilterDeclaration,
    GeometrySet,
    HalfSpace,
    Sphere,
)
from sheldrake.geometry._compiled import points
from sheldrake.geometry._compiled.search import find_contacts
from sheldrake.geometry._kernels.contacts import place_geometries
from sheldrake.geometry._kernels.model import (
    CAPACITY_EXCEEDED,
    BodyPose,
    BodyPoses,
    PlacedGeometry,
    Size,
    contact_table,
)
from sheldrake.geometry._kernels.spatial_hash import close_pairs, make_cells
from sheldrake.math import RigidTransform, RollPitchYaw
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
from sheldrake.multibody.plant._parts import parts_of
from sheldrake.multibody.tree import SpatialInertia
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder

BODIES = 70
FRICTION = CoulombFriction(0.5, 0.5)


@pytest.fixture(autouse=True)
def cells_early(monkeypatch):
    monkeypatch.setattr(points, "CELLS_FROM", BODIES)


def scene(filtered=()):
    """Spheres, boxes and capsules over a floor; every third body has two geometries."""
    rng = np.random.default_rng(7)
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 1e-3)
    plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform(), HalfSpace(), "floor", FRICTION)
    solids = [Sphere(0.05), Box(0.1, 0.08, 0.06), Capsule(0.03, 0.08)]
    geometry = []
    for k in range(BODIES):
        body = plant.AddRigidBody(f"body{k}", SpatialInertia.SolidSphereWithMass(0.3, 0.05))
        geometry.append(plant.RegisterCollisionGeometry(body, RigidTransform(), solids[k % 3], "solid", FRICTION))
        if k % 3 == 0:
            X_BG = RigidTransform([0.04, 0.0, 0.0])
            plant.RegisterCollisionGeometry(body, X_BG, solids[(k + 1) % 3], "more", FRICTION)
        p = [0.09 * (k % 4), 0.09 * (k // 4 % 4), 0.06 + 0.09 * (k // 16)]
        X_WB = RigidTransform(RollPitchYaw(*rng.uniform(-1.0, 1.0, 3)), p)
        plant.SetDefaultFloatingBaseBodyPose(body, X_WB)
    for a, b in filtered:
        declaration = CollisionFilterDeclaration()
        declaration.ExcludeBetween(GeometrySet(geometry[a]), GeometrySet(geometry[b]))
        scene_graph.collision_filter_manager().Apply(declaration)
    plant.Finalize()
    return plant, builder.Build()


def models_of(plant):
    """The same geometry with all pairs listed, and with cells."""
    parts = parts_of(plant)
    scene_graph, rows = parts.geometry.required_scene_graph(), parts.kernel_models.rows_of_frames()
    state = scene_graph._default_state()
    return [scene_graph._compile_proximity(rows, state, cells)[0] for cells in (False, True)]


def poses_of(plant, diagram):
    context = plant.GetMyContextFromRoot(diagram.CreateDefaultContext())
    poses = [plant.EvalBodyPoseInWorld(context, body) for body in parts_of(plant).elements.model("test").row_bodies]
    return np.array([[*X.rotation().matrix().ravel(), *X.translation()] for X in poses])


def contacts(model, X_WB, native=True):
    table = contact_table(model)
    assert find_contacts(model, X_WB, table, native) == 0
    n = table.num_contacts
    return table.pair[:n].copy(), table.point[:n].copy()


@pytest.mark.parametrize("native", [True, False], ids=["native", "twin"])
def test_the_same_contacts(native):
    plant, diagram = scene(filtered=[(0, 1), (0, 4), (5, 6), (20, 21)])
    listed, celled = models_of(plant)
    assert len(listed.cell) == 0 and len(celled.cell) == 1 and len(celled.pair) < len(listed.pair)
    X_WB = poses_of(plant, diagram)
    pairs, points = contacts(listed, X_WB, native)
    celled_pairs, celled_points = contacts(celled, X_WB, native)
    np.testing.assert_array_equal(celled_pairs, pairs)
    np.testing.assert_array_equal(celled_points, points)
    assert len(pairs) > BODIES and (pairs[:, 2] != pairs[:, 3]).all()


def test_filters_count():
    found = []
    for filtered in ((), [(0, 1), (0, 4), (16, 17)]):
        plant, diagram = scene(filtered)
        _, celled = models_of(plant)
        found.append(len(contacts(celled, poses_of(plant, diagram))[0]))
    assert found[1] < found[0]


@pytest.mark.parametrize("larger", [0.0, 0.3], ids=["alike", "one is large"])
def test_candidates_are_the_spheres_that_meet(larger):
    plant, diagram = scene()
    _, model = models_of(plant)
    bound = model.size[:, Size.bound]
    bound[10] += larger  # too large for the cells
    X_WB, table, cells = poses_of(plant, diagram), contact_table(model), make_cells(model)
    rng = np.random.default_rng(1)
    for _ in range(5):
        place_geometries.bind(model, BodyPoses(X_WB), table)()
        close_pairs.bind(model, table, cells)()
        found = [tuple(row) for row in cells.candidate[: cells.num_pairs, :2].tolist()]
        centre, solid = table.X_WG[:, PlacedGeometry.centre_W.columns], np.flatnonzero(np.isfinite(bound))
        expected = {
            (int(a), int(b))
            for a in solid
            for b in solid
            if a < b
            and model.geometry[a, 1] != model.geometry[b, 1]
            and np.linalg.norm(centre[a] - centre[b]) <= bound[a] + bound[b] + model.margin[0]
        }
        assert len(found) == len(set(found)) and set(found) == expected and len(found) > 20
        X_WB[1:, BodyPose.p_WB.columns] += rng.normal(scale=0.1, size=(len(X_WB) - 1, 3))  # to and fro across zero


def test_steps_have_the_same_bits(monkeypatch):
    states = []
    for start in (BODIES, 10**9):
        monkeypatch.setattr(points, "CELLS_FROM", start)
        plant, diagram = scene()
        assert (len(parts_of(plant).kernel_models.compiled_geometry().model.cell) > 0) == (start < 10**9)
        simulator = Simulator(diagram)
        simulator.AdvanceTo(0.2)
        states.append(plant.GetPositionsAndVelocities(plant.GetMyContextFromRoot(simulator.get_context())))
    np.testing.assert_array_equal(states[0], states[1])
    assert np.abs(states[0]).max() < 100.0


def test_too_many_candidates_are_told():
    plant, diagram = scene()
    _, model = models_of(plant)
    table, cells = contact_table(model), make_cells(model)
    cells = cells._replace(candidate=np.zeros((3, 3), np.int64))
    place_geometries.bind(model, BodyPoses(poses_of(plant, diagram)), table)()
    close_pairs.bind(model, table, cells)()
    assert table.status == CAPACITY_EXCEEDED and cells.num_pairs == 3
