"""Clearances of collision checkers: by machine code what the queries of the context say, and of the context asked."""

import copy

import numpy as np
import pytest

from sheldrake.common.kernel import jit_enabled
from sheldrake.geometry import Box, Cylinder, Sphere
from sheldrake.math import RigidTransform, RollPitchYaw
from sheldrake.multibody.plant import CoulombFriction
from sheldrake.multibody.tree import BodyIndex, FixedOffsetFrame, RevoluteJoint, SpatialInertia
from sheldrake.planning import RobotClearance, RobotCollisionType, RobotDiagramBuilder, SceneGraphCollisionChecker


def checker(is_floating: bool) -> SceneGraphCollisionChecker:
    """Links registered from the tip on, so that rows of the tree are not in the order of bodies."""
    builder = RobotDiagramBuilder(0.0)
    plant = builder.plant()
    robot, shapes = plant.AddModelInstance("robot"), [Box(0.2, 0.1, 0.4), Cylinder(0.07, 0.3), Sphere(0.12)]
    links = [plant.AddRigidBody(f"link{i}", robot, SpatialInertia.SolidCubeWithDensity(1, 0.1)) for i in range(3)]
    at = plant.world_frame()
    for i, (link, shape) in enumerate(zip(reversed(links), shapes)):
        plant.RegisterCollisionGeometry(link, RigidTransform([0.2, 0, 0]), shape, f"g{i}", CoulombFriction(1, 1))
        if i or not is_floating:
            plant.AddJoint(RevoluteJoint(f"joint{i}", at, link.body_frame(), [0, 1, 0.2 * i], -3, 3))
        at = plant.AddFrame(FixedOffsetFrame(f"end{i}", link.body_frame(), RigidTransform([0.45, 0, 0])))
    X_WG = RigidTransform(RollPitchYaw(0.3, 0.2, 0.1), [0.6, 0.1, 0.3])
    for name, shape in (("box", Box(0.2, 0.3, 0.4)), ("ball", Sphere(0.2))):
        plant.RegisterCollisionGeometry(plant.world_body(), X_WG, shape, name, CoulombFriction(1, 1))
        X_WG = RigidTransform([-0.5, 0, 0.1])
    return SceneGraphCollisionChecker(model=builder.Build(), robot_model_instances=[robot], edge_step_size=0.1)


def configurations(nq: int, count: int = 12) -> np.ndarray:
    return np.random.default_rng(8).uniform(-1.0, 1.0, (count, nq))


@pytest.mark.skipif(not jit_enabled(), reason="kernels are Python here, and nothing asks them instead of queries")
@pytest.mark.parametrize("is_floating", [False, True])
def test_clearances_and_kinds_of_collisions_are_those_of_queries(is_floating, monkeypatch):
    c = checker(is_floating)
    c.SetPaddingAllRobotEnvironmentPairs(0.03)
    qs = configurations(c.plant().num_positions())
    assert c._distances_of(c.model_context()) is not None
    quick = [(c.CalcRobotClearance(q, 1.2), c.ClassifyBodyCollisions(q)) for q in qs]
    monkeypatch.setattr(type(c), "_distances_of", lambda self, context: None)
    assert sum(clearance.size() for clearance, _ in quick) > 3 * len(qs)
    for q, (mine, kinds) in zip(qs, quick, strict=True):
        other = c.CalcRobotClearance(q, 1.2)
        assert mine.robot_indices() == other.robot_indices() and mine.other_indices() == other.other_indices()
        assert mine.collision_types() == other.collision_types() and kinds == c.ClassifyBodyCollisions(q)
        # GJK ends at 1e-9 of the size of shapes; where faces or edges are nearly parallel, points may wander along them
        np.testing.assert_allclose(mine.distances(), other.distances(), atol=1e-8)
        np.testing.assert_allclose(mine.jacobians(), other.jacobians(), atol=1e-5)


def test_each_context_has_its_own_geometry():
    c = checker(False)
    q = np.array([0.4, -0.3, 0.2])
    own = c.MakeStandaloneModelContext()
    before = c.CalcContextRobotClearance(own, q, 0.5)
    apart = own.Clone()  # knows nothing of what is added to the checker from now on
    assert c.AddCollisionShapeToBody("more", c.get_body(BodyIndex(2)), Sphere(0.3), RigidTransform())
    after = c.CalcContextRobotClearance(own, q, 0.5)
    assert after.size() > before.size()
    np.testing.assert_array_equal(after.distances(), c.CalcRobotClearance(q, 0.5).distances())
    for context in (apart, copy.copy(apart), copy.deepcopy(apart)):
        found = c.CalcContextRobotClearance(context, q, 0.5)
        np.testing.assert_allclose(found.distances(), before.distances(), atol=1e-12)
    c.RemoveAllAddedCollisionShapes()
    np.testing.assert_allclose(c.CalcRobotClearance(q, 0.5).distances(), before.distances(), atol=1e-12)


def test_a_copy_of_a_context_does_not_move_with_it():
    c = checker(False)
    context, q = c.model_context(), np.array([0.4, -0.3, 0.2])
    c.UpdateContextPositions(context, q)
    for copied in (copy.copy(context), copy.deepcopy(context)):
        c.UpdateContextPositions(copied, -q)
        np.testing.assert_array_equal(c.plant().GetPositions(context.plant_context()), q)


def test_a_table_that_grew_says_what_was_added():
    table = RobotClearance(2)
    for k, kind in enumerate((RobotCollisionType.kSelfCollision, RobotCollisionType.kEnvironmentCollision)):
        table.Append(BodyIndex(k), BodyIndex(k + 3), kind, 0.1 * k, [[k, 2.0]])
    other = RobotClearance(table)
    table.Append(BodyIndex(7), BodyIndex(8), RobotCollisionType.kSelfCollision, 0.5, [[1.0, 1.0]])
    assert (table.size(), other.size()) == (3, 2)
    assert other.robot_indices() == [BodyIndex(0), BodyIndex(1)] and other.other_indices()[1] == BodyIndex(4)
    assert other.collision_types()[1] == RobotCollisionType.kEnvironmentCollision
    np.testing.assert_array_equal(other.distances(), [0.0, 0.1])
    np.testing.assert_array_equal(other.jacobians(), [[0.0, 2.0], [1.0, 2.0]])
