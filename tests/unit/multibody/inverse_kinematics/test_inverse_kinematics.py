"""Postures of an arm, by what they must satisfy; gradients by differences."""

import copy

import numpy as np
import pytest

from sheldrake.autodiffutils import ExtractGradient, InitializeAutoDiff
from sheldrake.common.kernel import jit_enabled
from sheldrake.common.value import AbstractValue
from sheldrake.geometry import Ellipsoid, Sphere
from sheldrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from sheldrake.multibody.inverse_kinematics import (
    AngleBetweenVectorsConstraint,
    ComPositionConstraint,
    DifferentialInverseKinematicsParameters,
    DifferentialInverseKinematicsStatus,
    DoDifferentialInverseKinematics,
    GazeTargetConstraint,
    InverseKinematics,
    MinimumDistanceLowerBoundConstraint,
    MinimumDistanceUpperBoundConstraint,
    OrientationConstraint,
    PointToLineDistanceConstraint,
    PositionConstraint,
    UnitQuaternionConstraint,
)
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction, MultibodyPlant
from sheldrake.multibody.tree import FixedOffsetFrame, RevoluteJoint, SpatialInertia
from sheldrake.solvers import ClarabelSolver, MathematicalProgram, Solve
from sheldrake.solvers._functions.minimum_value import quadratically_smoothed_hinge
from sheldrake.systems.framework import DiagramBuilder


@pytest.fixture
def arm():
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.01)
    parent = plant.world_body()
    for i, axis in enumerate(([0, 0, 1], [0, 1, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 1, 0])):
        body = plant.AddRigidBody(f"link{i}", SpatialInertia.SolidCubeWithDensity(1000, 0.1))
        F = plant.AddFrame(FixedOffsetFrame(f"F{i}", parent.body_frame(), RigidTransform([0, 0, 0.3])))
        plant.AddJoint(RevoluteJoint(f"joint{i}", F, body.body_frame(), axis, -2, 2))
        plant.RegisterCollisionGeometry(body, RigidTransform([0, 0, 0.15]), Sphere(0.1), f"s{i}", CoulombFriction(1, 1))
        parent = body
    ball = RigidTransform([0.5, 0.0, 1.0])
    plant.RegisterCollisionGeometry(plant.world_body(), ball, Sphere(0.15), "ball", CoulombFriction(1, 1))
    plant.Finalize()
    diagram = builder.Build()
    root = diagram.CreateDefaultContext()
    return plant, plant.GetMyMutableContextFromRoot(root)


def test_the_tip_is_where_it_should_be_and_nothing_touches(arm):
    plant, context = arm
    W, tip = plant.world_frame(), plant.GetFrameByName("link5")
    ik = InverseKinematics(plant, context)
    target = np.array([0.8, 0.2, 0.8])
    ik.AddPositionConstraint(tip, [0, 0, 0.2], W, target, target)
    ik.AddOrientationConstraint(W, RotationMatrix.MakeYRotation(1.5), tip, RotationMatrix(), 0.3)
    ik.AddMinimumDistanceLowerBoundConstraint(0.02, 0.2)
    ik.prog().AddQuadraticErrorCost(np.eye(6), np.full(6, 0.3), ik.q())
    ik.prog().SetInitialGuess(ik.q(), np.full(6, 0.3))
    result = Solve(ik.prog())
    assert result.is_success()
    plant.SetPositions(context, result.GetSolution(ik.q()))
    X = plant.CalcRelativeTransform(context, W, tip)
    np.testing.assert_allclose(X @ np.array([0, 0, 0.2]), target, atol=1e-5)
    angle = (RotationMatrix.MakeYRotation(1.5).inverse() @ X.rotation()).ToAngleAxis().angle()
    assert angle <= 0.3 + 1e-5
    query = plant.get_geometry_query_input_port().Eval(context)
    assert min(p.distance for p in query.ComputeSignedDistancePairwiseClosestPoints(1.0)) >= 0.02 - 1e-5


@pytest.mark.parametrize(
    "make",
    [
        lambda p, c, A, B: PositionConstraint(p, A, [-1] * 3, [1] * 3, B, [0.1, 0.2, 0.3], c),
        lambda p, c, A, B: PositionConstraint(p, A, [-1] * 3, [1] * 3, B, None, c),
        lambda p, c, A, B: OrientationConstraint(
            p, A, RotationMatrix(RollPitchYaw(1, 2, 3)), B, RotationMatrix(), 1, c
        ),
        lambda p, c, A, B: AngleBetweenVectorsConstraint(p, A, [1, 2, 3], B, [3, 2, 1], 0.1, 1.0, c),
        lambda p, c, A, B: GazeTargetConstraint(p, A, [0.1, 0.2, 0.3], [1, 0, 0], B, [1, 1, 1], 0.5, c),
        lambda p, c, A, B: PointToLineDistanceConstraint(p, A, [0.1, 0.2, 0.3], B, [1, 0, 0], [0, 1, 1], 0.1, 1, c),
        lambda p, c, A, B: ComPositionConstraint(p, None, A, c),
        lambda p, c, A, B: MinimumDistanceLowerBoundConstraint(p, 0.01, c, None, 0.5),
    ],
)
def test_gradients_are_those_of_differences(arm, make):
    plant, context = arm
    constraint = make(plant, context, plant.GetFrameByName("link1"), plant.GetFrameByName("link4"))
    x = np.random.default_rng(2).uniform(-0.8, 0.8, constraint.num_vars())
    J = ExtractGradient(constraint.Eval(InitializeAutoDiff(x)[:, 0]))
    h = 1e-6
    columns = [(constraint.Eval(x + h * e) - constraint.Eval(x - h * e)) / (2 * h) for e in np.eye(x.size)]
    np.testing.assert_allclose(J, np.stack(columns, axis=1), atol=1e-7)


@pytest.mark.skipif(not jit_enabled(), reason="kernels are Python here, and nothing asks them instead of queries")
def test_distances_by_kernels_are_those_of_queries(arm):
    plant, context = arm
    constraint = MinimumDistanceLowerBoundConstraint(plant, 0.01, context, None, 0.5)
    for q in np.random.default_rng(5).uniform(-1.5, 1.5, (20, 6)):
        native = constraint._native(q)
        distances, J = native.distances(0.51, q), native.slopes()
        query, pairs = constraint._pairs(q)
        assert len(pairs) == len(distances)
        order = np.argsort([pair.distance for pair in pairs])
        np.testing.assert_allclose(np.sort(distances), [pairs[k].distance for k in order], rtol=0, atol=1e-12)
        slopes = [constraint._pair_slope(query, pairs[k]) for k in order]
        np.testing.assert_allclose(J[np.argsort(distances)], slopes, rtol=0, atol=1e-12)
        np.testing.assert_array_equal(plant.GetPositions(context), q)


def test_distances_follow_what_changes_in_the_context(arm):
    plant, context = arm
    constraint = MinimumDistanceLowerBoundConstraint(plant, 0.01, context, None, 0.5)
    q = np.full(6, 0.2)
    assert constraint._native(q) is constraint._native(q + 0.1)
    query = plant.get_geometry_query_input_port().Eval(context)
    moment = copy.copy(query)  # the poses of this moment, for ever
    before = constraint.Eval(q)
    plant.get_geometry_query_input_port().FixValue(context, AbstractValue.Make(moment))
    assert constraint._native(q) is None
    assert constraint.Eval(np.zeros(6)) != before and constraint.Eval(np.zeros(6)) == constraint.Eval(np.ones(6))


def test_free_bodies_get_unit_quaternions():
    plant = MultibodyPlant(0.0)
    plant.AddRigidBody("body", SpatialInertia.SolidCubeWithDensity(1, 1))
    plant.Finalize()
    ik = InverseKinematics(plant)
    np.testing.assert_array_equal(ik.prog().GetInitialGuess(ik.q())[:4], [1, 0, 0, 0])
    ik.AddOrientationConstraint(
        plant.world_frame(), RotationMatrix.MakeXRotation(2.0), plant.GetFrameByName("body"), RotationMatrix(), 1e-3
    )
    result = Solve(ik.prog())
    q = result.GetSolution(ik.q())[:4]
    assert result.is_success() and np.linalg.norm(q) == pytest.approx(1, abs=1e-6)
    assert abs(q @ [np.cos(1), np.sin(1), 0, 0]) > 1 - 1e-5
    assert UnitQuaternionConstraint().CheckSatisfied(q)


def test_bad_arguments_are_named(arm):
    plant, context = arm
    ik = InverseKinematics(plant, context)
    W = plant.world_frame()
    with pytest.raises(ValueError, match="theta_bound should be non-negative"):
        ik.AddOrientationConstraint(W, RotationMatrix(), W, RotationMatrix(), -1.0)
    with pytest.raises(ValueError, match="must be larger than bound"):
        ik.AddMinimumDistanceLowerBoundConstraint(0.1, -0.2)
    with pytest.raises(ValueError, match="QueryObject"):
        InverseKinematics(plant).AddMinimumDistanceLowerBoundConstraint(0.1)
    with pytest.raises(TypeError, match="shape \\(3,\\)"):
        ik.AddPositionConstraint(W, [1, 2], W, [0] * 3, [1] * 3)


def test_differential_inverse_kinematics_moves_along_the_velocity_within_limits(arm):
    plant, context = arm
    plant.SetPositions(context, [0.2, 0.5, 0.1, 0.6, -0.2, 0.4])
    tip, V = plant.GetFrameByName("link5"), np.array([0.2, -0.1, 0.1, 0.3, 0.1, -0.2])
    parameters = DifferentialInverseKinematicsParameters(6)
    parameters.set_time_step(0.01)
    for limit, status in ((10.0, "kSolutionFound"), (0.2, "kSolutionFound"), (1e-3, "kStuck")):
        parameters.set_joint_velocity_limits((-limit * np.ones(6), limit * np.ones(6)))
        result = DoDifferentialInverseKinematics(plant, context, V, tip, parameters)
        assert result.status is DifferentialInverseKinematicsStatus[status]
        v = result.joint_velocities
        assert np.abs(v).max() <= limit * (1 + 1e-14)
        plant.SetVelocities(context, v)
        moved = plant.EvalBodySpatialVelocityInWorld(context, plant.GetBodyByName("link5")).get_coeffs()
        alpha = moved @ V / (V @ V)
        np.testing.assert_allclose(moved, alpha * V, atol=1e-13)
        assert (alpha if limit > 1 else np.abs(v).max() / limit) == pytest.approx(1, abs=1e-13)
    parameters.set_joint_acceleration_limits((np.ones(6), 2.0 * np.ones(6)))  # faster than the velocities' limits
    plant.SetVelocities(context, np.zeros(6))
    result = DoDifferentialInverseKinematics(plant, context, V, tip, parameters)
    assert result.status is DifferentialInverseKinematicsStatus.kNoSolutionFound and result.joint_velocities is None


def test_constraints_take_their_place_in_any_program(arm):
    plant, context = arm
    prog = MathematicalProgram()
    q = prog.NewContinuousVariables(6, "q")
    tip = plant.GetFrameByName("link5")
    c = PositionConstraint(plant, plant.world_frame(), [0.1, 0, 1.5], [0.1, 0, 1.5], tip, [0, 0, 0], context)
    prog.AddConstraint(c, q)
    prog.AddQuadraticCost(q.dot(q))
    result = Solve(prog, np.full(6, 0.1))
    assert result.is_success() and prog.CheckSatisfied(prog.generic_constraints(), result.get_x_val(), 1e-5)


@pytest.mark.parametrize("locked", [False, True])
def test_differential_ik_is_that_of_its_program(locked):
    rng = np.random.default_rng(2)
    J, V = rng.normal(size=(3, 7)), rng.normal(size=3)
    parameters = DifferentialInverseKinematicsParameters(7, 7)
    parameters.set_nominal_joint_position(np.full(7, 0.3))
    parameters.set_joint_centering_gain(np.eye(7))
    highest = np.array([0.4, np.inf, 1.0, 1.0, 1.0, 0.0 if locked else 1.0, 1.0])
    parameters.set_joint_velocity_limits((-highest, highest))
    parameters.set_joint_position_limits((np.full(7, -np.inf), np.full(7, 0.01)))
    arguments = np.zeros(7), np.zeros(7), V, J, parameters
    at_once = DoDifferentialInverseKinematics(*arguments)
    parameters.get_mutable_solver_options().SetOption(ClarabelSolver.id(), "max_iter", 99)  # so a program is made
    by_program = DoDifferentialInverseKinematics(*arguments)
    assert at_once.status == by_program.status == DifferentialInverseKinematicsStatus.kSolutionFound
    # Both stop at a relative error of 1e-8, at velocities of about one.
    np.testing.assert_allclose(at_once.joint_velocities, by_program.joint_velocities, rtol=0, atol=1e-6)


def test_distances_of_bodies_that_float_are_native_and_have_the_right_slopes():
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.0)
    friction = CoulombFriction(0.5, 0.5)
    for name in ("a", "b"):
        body = plant.AddRigidBody(name, SpatialInertia.SolidBoxWithMass(1.0, 0.1, 0.2, 0.3))
        plant.RegisterCollisionGeometry(body, RigidTransform([0.1, 0.2, 0.3]), Ellipsoid(0.1, 0.2, 0.3), name, friction)
    plant.Finalize()
    diagram = builder.Build()
    context = plant.GetMyMutableContextFromRoot(diagram.CreateDefaultContext())
    constraint = MinimumDistanceLowerBoundConstraint(plant, 0.3, context, None, 1.0)
    q = np.array([0.9, 0.1, 0.2, 0.3, 0.0, 0.0, 0.0, 0.7, -0.3, 0.4, 0.1, 0.7, 0.2, 0.1])  # of other lengths than one
    slopes = ExtractGradient(constraint.Eval(InitializeAutoDiff(q))).ravel()
    steps = 1e-6 * np.eye(len(q))
    differences = [(constraint.Eval(q + step) - constraint.Eval(q - step)).item() / 2e-6 for step in steps]
    np.testing.assert_allclose(slopes, differences, atol=1e-7)  # cancellation: 1e-16 / 1e-6, and curvature 1e-12
    assert np.abs(slopes[[0, 1, 4, 7, 8, 11]]).min() > 1e-3
    if jit_enabled():
        assert constraint._kept is not None


def test_penalties_of_ours_are_those_of_a_function_that_is_the_same(arm):
    plant, context = arm
    hinge = quadratically_smoothed_hinge
    for ours, given in (
        (
            MinimumDistanceLowerBoundConstraint(plant, 0.02, context, None, 0.2),
            MinimumDistanceLowerBoundConstraint(plant, 0.02, context, lambda x, slope: hinge(x, slope), 0.2),
        ),
        (
            MinimumDistanceUpperBoundConstraint(plant, 0.02, context, 0.3),
            MinimumDistanceUpperBoundConstraint(plant, 0.02, context, 0.3, lambda x, slope: hinge(x, slope)),
        ),
    ):
        for q in np.random.default_rng(8).uniform(-1.5, 1.5, (10, 6)):
            np.testing.assert_allclose(ours.Eval(q), given.Eval(q), rtol=1e-12, atol=1e-13)
            slopes = [ExtractGradient(c.Eval(InitializeAutoDiff(q))) for c in (ours, given)]
            np.testing.assert_allclose(*slopes, rtol=1e-10, atol=1e-10)


def test_constraints_of_one_context_do_not_disturb_each_other(arm):
    plant, context = arm
    near, far = (MinimumDistanceLowerBoundConstraint(plant, 0.01, context, None, d) for d in (0.1, 0.4))
    asked = np.random.default_rng(9).uniform(-1.5, 1.5, (6, 6))
    alone = [[c.Eval(q)[0] for q in asked] for c in (near, far)]
    for k, q in enumerate(asked):
        assert [near.Eval(q)[0], far.Eval(q)[0]] == [alone[0][k], alone[1][k]]
    again = MinimumDistanceLowerBoundConstraint(plant, 0.01, context, None, 0.1)
    assert [again.Eval(q)[0] for q in asked] == alone[0]
