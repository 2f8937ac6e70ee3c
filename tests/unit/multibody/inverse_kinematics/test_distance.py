"""Distances of single pairs of geometries, and their derivatives."""

import numpy as np
import pytest

from sheldrake.geometry import Box, GeometryId, HalfSpace, Sphere
from sheldrake.math import RigidTransform
from sheldrake.multibody.inverse_kinematics import DistanceConstraint
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
from sheldrake.multibody.tree import SpatialInertia
from sheldrake.systems.framework import DiagramBuilder

FRICTION = CoulombFriction(0.5, 0.5)


@pytest.fixture
def scene():
    """A ball and a box that float, a block and two half spaces of the world: plant, diagram, context, geometries."""
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.0)
    geometries = []
    for name, shape in (("ball", Sphere(0.1)), ("box", Box(0.2, 0.3, 0.1))):
        body = plant.AddRigidBody(name, SpatialInertia.SolidSphereWithMass(1.0, 0.1))
        geometries.append(
            plant.RegisterCollisionGeometry(body, RigidTransform([0.02, 0.0, 0.01]), shape, name, FRICTION)
        )
    for name, shape in (("block", Box(0.5, 0.5, 0.5)), ("floor", HalfSpace()), ("ground", HalfSpace())):
        X = RigidTransform([0.0, 0.0, -0.4])
        geometries.append(plant.RegisterCollisionGeometry(plant.world_body(), X, shape, name, FRICTION))
    plant.Finalize()
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    return plant, diagram, context, geometries


def positions(rng):
    q = rng.uniform(-0.3, 0.3, 14)
    for at in (0, 7):
        q[at : at + 4] = rng.normal(size=4)
        q[at : at + 4] /= np.linalg.norm(q[at : at + 4])
    q[4:7] += [0.0, 0.3, 0.3]
    q[11:14] += [0.3, -0.3, 0.3]
    return q


def test_pairs_in_turns_are_those_of_queries(scene):
    plant, _, root, (ball, box, block, floor, _) = scene
    context = plant.GetMyMutableContextFromRoot(root)
    pairs = [(ball, box), (box, block), (floor, ball)]
    constraints = [DistanceConstraint(plant, pair, context, 0.0, 1.0) for pair in pairs]
    rng = np.random.default_rng(1)
    for _ in range(5):
        q = positions(rng)
        for constraint, pair in zip(constraints, pairs):
            (value,), J = constraint._eval_with_jacobian(q)
            assert constraint.Eval(q)[0] == value
            query = plant.get_geometry_query_input_port().Eval(context)  # the constraint has put q there
            assert value == pytest.approx(query.ComputeSignedDistancePairClosestPoints(*pair).distance, abs=1e-14)
            for k in (4, 5, 6, 11, 12, 13):
                step = 1e-6 * np.eye(14)[k]
                slope = (constraint.Eval(q + step)[0] - constraint.Eval(q - step)[0]) / 2e-6
                assert J[0, k] == pytest.approx(slope, abs=1e-7)


def test_geometry_that_comes_later_counts(scene):
    plant, diagram, root, (ball, _, block, *_) = scene
    context = plant.GetMyMutableContextFromRoot(root)
    constraint, q = DistanceConstraint(plant, (ball, block), context, 0.0, 1.0), positions(np.random.default_rng(2))
    before = constraint.Eval(q)[0]
    scene_graph = diagram.GetSubsystemByName("scene_graph")
    scene_graph_context = scene_graph.GetMyMutableContextFromRoot(root)
    scene_graph.ChangeShape(scene_graph_context, plant.get_source_id(), ball, Sphere(0.15))
    assert constraint.Eval(q)[0] == pytest.approx(before - 0.05, abs=1e-12)


def test_what_has_no_distance_is_said(scene):
    plant, _, root, (ball, _, _, floor, ground) = scene
    context, q = plant.GetMyMutableContextFromRoot(root), positions(np.random.default_rng(3))
    for pair, message in (
        ((floor, ground), "two half spaces"),
        ((ball, GeometryId.get_new_id()), "does not reference"),
    ):
        constraint = DistanceConstraint(plant, pair, context, 0.0, 1.0)
        for ask in (constraint.Eval, constraint._eval_with_jacobian):
            with pytest.raises(RuntimeError, match=message):
                ask(q)
