"""What kernels compute of kinematic constraints, against a plant of AutoDiffXd, whose values carry derivatives."""

import numpy as np
import pytest

from sheldrake.autodiffutils import ExtractGradient, InitializeAutoDiff
from sheldrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from sheldrake.multibody.inverse_kinematics import (
    AngleBetweenVectorsConstraint,
    AngleBetweenVectorsCost,
    GazeTargetConstraint,
    OrientationConstraint,
    OrientationCost,
    PointToLineDistanceConstraint,
    PointToPointDistanceConstraint,
    PositionConstraint,
    PositionCost,
)
from sheldrake.multibody.plant import MultibodyPlant
from sheldrake.multibody.tree import FixedOffsetFrame, RevoluteJoint, SpatialInertia

TURN = RotationMatrix(RollPitchYaw(0.4, -0.7, 1.9))
POINT, OTHER, WAY = [0.1, -0.2, 0.3], [-0.4, 0.5, 0.2], [1.0, 2.0, -0.5]
WEIGHTS = [[1.0, 0.5, 0.0], [0.1, 2.0, 0.3], [0.0, -0.2, 3.0]]


@pytest.fixture(scope="module")
def plants():
    """A body that floats with an arm of two links, frames off their bodies; the same for AutoDiffXd."""
    plant = MultibodyPlant(0.0)
    parent = plant.AddRigidBody("base", SpatialInertia.SolidCubeWithDensity(1000, 0.1))
    for k, axis in enumerate(([0, 0, 1], [0, 1, 0])):
        body = plant.AddRigidBody(f"link{k}", SpatialInertia.SolidCubeWithDensity(1000, 0.1))
        F = plant.AddFrame(FixedOffsetFrame(f"F{k}", parent.body_frame(), RigidTransform(TURN, [0.1, 0.0, 0.3])))
        plant.AddJoint(RevoluteJoint(f"joint{k}", F, body.body_frame(), axis))
        parent = body
    plant.AddFrame(FixedOffsetFrame("tool", parent.body_frame(), RigidTransform(TURN, [0.0, 0.2, 0.1])))
    plant.Finalize()
    return plant, plant.ToAutoDiffXd()


MAKERS = [
    lambda p, c, A, B: PositionConstraint(p, A, [-1] * 3, [1] * 3, B, POINT, c),
    lambda p, c, A, B: PositionConstraint(p, A, RigidTransform(TURN, OTHER), [-1] * 3, [1] * 3, B, POINT, c),
    lambda p, c, A, B: PositionCost(p, A, OTHER, B, POINT, WEIGHTS, c),
    lambda p, c, A, B: OrientationConstraint(p, A, TURN, B, TURN.inverse(), 1.0, c),
    lambda p, c, A, B: OrientationCost(p, A, TURN, B, RotationMatrix(), 2.5, c),
    lambda p, c, A, B: AngleBetweenVectorsConstraint(p, A, POINT, B, WAY, 0.1, 1.0, c),
    lambda p, c, A, B: AngleBetweenVectorsCost(p, A, POINT, B, WAY, 2.5, c),
    lambda p, c, A, B: GazeTargetConstraint(p, A, POINT, WAY, B, OTHER, 0.5, c),
    lambda p, c, A, B: PointToPointDistanceConstraint(p, A, POINT, B, OTHER, 0.1, 1.0, c),
    lambda p, c, A, B: PointToLineDistanceConstraint(p, A, POINT, B, OTHER, WAY, 0.1, 1.0, c),
]


@pytest.mark.parametrize("make", MAKERS)
@pytest.mark.parametrize("frames", [("world", "tool"), ("F1", "base"), ("tool", "F0")])
def test_values_and_derivatives_are_those_of_a_plant_of_duals(plants, make, frames):
    def made(plant):
        return make(plant, plant.CreateDefaultContext(), *map(plant.GetFrameByName, frames))

    ours, other = map(made, plants)
    q = np.array([0.9, 0.1, -0.3, 0.3, 0.2, -0.4, 0.6, 0.5, -1.1])
    q[:4] /= np.linalg.norm(q[:4])
    expected = other.Eval(InitializeAutoDiff(q)[:, 0])
    found = ours.Eval(InitializeAutoDiff(q)[:, 0])
    np.testing.assert_allclose(ours.Eval(q), [y.value() for y in expected], rtol=1e-13, atol=1e-13)
    np.testing.assert_allclose([y.value() for y in found], ours.Eval(q), rtol=1e-15, atol=1e-15)
    # By a quaternion the derivatives of the plants differ along it, where it would not stay of unit length.
    along = np.zeros(9)
    along[:4] = q[:4]
    P = np.eye(9) - np.outer(along, along)
    np.testing.assert_allclose(ExtractGradient(found) @ P, ExtractGradient(expected) @ P, rtol=1e-11, atol=1e-12)


def test_constraints_of_one_context_take_turns(plants):
    plant, _ = plants
    context = plant.CreateDefaultContext()
    A, B = plant.world_frame(), plant.GetFrameByName("tool")
    one, two = (PositionConstraint(plant, A, [-1] * 3, [1] * 3, B, p, context) for p in (POINT, OTHER))
    q = plant.GetPositions(context)
    first, second = one.Eval(q), two.Eval(q)
    assert not np.allclose(first, second)
    np.testing.assert_array_equal(one.Eval(q), first)
    np.testing.assert_array_equal(two.Eval(q), second)
