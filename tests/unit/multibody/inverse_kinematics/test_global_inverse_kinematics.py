"""Postures found by mixed-integer programs."""

import numpy as np
import pytest

from sheldrake.common.eigen_geometry import Quaternion
from sheldrake.math import RigidTransform
from sheldrake.multibody.inverse_kinematics import GlobalInverseKinematics
from sheldrake.multibody.plant import MultibodyPlant
from sheldrake.multibody.tree import BodyIndex, FixedOffsetFrame, PrismaticJoint, RevoluteJoint, SpatialInertia
from sheldrake.solvers import MixedIntegerRotationConstraintGenerator, Solve

CUBE = SpatialInertia.SolidCubeWithDensity(1000, 0.1)
Approach = MixedIntegerRotationConstraintGenerator.Approach


def arm():
    """Turns about z at 0.5 m, then about y another 0.5 m farther; the last body's z axis is its arm."""
    plant, frame = MultibodyPlant(0.0), None
    frame = plant.world_frame()
    for i, axis in enumerate(([0, 0, 1], [0, 1, 0])):
        body = plant.AddRigidBody(f"link{i}", CUBE)
        base = plant.AddFrame(FixedOffsetFrame(f"F{i}", frame, RigidTransform([0.0, 0.0, 0.5])))
        plant.AddJoint(RevoluteJoint(f"joint{i}", base, body.body_frame(), axis, -1.5, 1.5))
        frame = body.body_frame()
    plant.Finalize()
    return plant


def make(plant, intervals=1, approach=Approach.kBoth):
    options = GlobalInverseKinematics.Options()
    options.linear_constraint_only, options.num_intervals_per_half_axis = True, intervals
    options.approach = approach
    return GlobalInverseKinematics(plant, options)


TIP = BodyIndex(2)
END = [0.0, 0.0, 1.0]  # A point 1 m along the arm.


def end_of(plant, q):
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, q)
    return plant.EvalBodyPoseInWorld(context, plant.get_body(TIP)) @ np.array(END)


def test_a_posture_is_found_and_reconstructed():
    plant = arm()
    ik, target = make(plant, intervals=2, approach=Approach.kBoxSphereIntersection), end_of(plant, [0.7, 0.9])
    ik.AddWorldPositionConstraint(TIP, END, target - 1e-3, target + 1e-3)
    result = Solve(ik.prog())
    assert result.is_success()
    p = result.GetSolution(ik.body_position(TIP)) + result.GetSolution(ik.body_rotation_matrix(TIP)) @ END
    assert p == pytest.approx(target, abs=2e-3)
    q = ik.ReconstructGeneralizedPositionSolution(result)
    assert np.all(np.abs(q) <= 1.5)
    assert np.linalg.norm(end_of(plant, q) - target) < 0.4  # Rotations are relaxed.


def test_out_of_reach_is_infeasible():
    ik = make(arm())
    ik.AddWorldPositionConstraint(TIP, END, [2.0, 0.0, 1.0], [2.1, 0.1, 1.1])
    assert not Solve(ik.prog()).is_success()


def test_limits_are_kept():
    plant = arm()
    ik, target = make(plant), end_of(plant, [0.7, 0.9])
    ik.AddJointLimitConstraint(BodyIndex(1), -1.5, -1.3, True)
    ik.AddWorldPositionConstraint(TIP, END, target - 1e-3, target + 1e-3)
    assert not Solve(ik.prog()).is_success()


def test_the_guess_of_a_posture_satisfies_all():
    plant, q = arm(), [0.7, -0.9]
    ik = GlobalInverseKinematics(plant)
    p = end_of(plant, q)
    z = ik.BodyPointInOneOfRegions(TIP, END, [np.eye(3) + 5.0, np.hstack((-2 * np.eye(3), 4 * np.eye(3)))])
    cube = np.vstack((np.eye(3), -np.eye(3)))
    polytopes = [GlobalInverseKinematics.Polytope3D(cube, np.concatenate((p + w, w - p))) for w in (0.19, 0.21)]
    y = ik.BodySphereInOneOfPolytopes(TIP, END, 0.2, polytopes)
    ik.AddPostureCost([0.0, 0.0], [1.0, 1.0, 1.0], [1.0, 1.0, 1.0])
    ik.SetInitialGuess(q)
    prog = ik.prog()
    guess = prog.initial_guess()
    for binding in prog.GetAllConstraints():
        assert binding.evaluator().CheckSatisfied(prog.GetBindingVariableValues(binding, guess), 1e-6)
    assert prog.GetInitialGuess(z) == pytest.approx([0, 1]) and prog.GetInitialGuess(y) == pytest.approx([0, 1])
    # Origins do not move; the first body has turned by 0.7, the second one by the angle of both turns.
    both = np.arccos(0.5 * (np.cos(0.7) * np.cos(0.9) + np.cos(0.7) + np.cos(0.9) - 1.0))
    cost = sum(b.evaluator().Eval(prog.GetBindingVariableValues(b, guess))[0] for b in prog.linear_costs())
    assert cost == pytest.approx(2.0 - np.cos(0.7) - np.cos(both), abs=1e-9)
    with pytest.raises(RuntimeError, match="violates"):
        ik.SetInitialGuess([0.7, 1.7])


def test_a_free_body_is_put_where_it_is():
    plant = MultibodyPlant(0.0)
    plant.AddRigidBody("free", CUBE)
    plant.Finalize()
    ik = make(plant)
    wanted = Quaternion([0.5, 0.5, 0.5, 0.5])
    ik.AddWorldOrientationConstraint(BodyIndex(1), wanted, 0.0)
    ik.AddWorldPositionConstraint(BodyIndex(1), [0, 0, 0], [1, 2, 3], [1, 2, 3])
    q = ik.ReconstructGeneralizedPositionSolution(Solve(ik.prog()))
    assert q == pytest.approx([0.5, 0.5, 0.5, 0.5, 1, 2, 3], abs=1e-5)


def test_what_is_refused():
    ik = make(arm())
    for call, message in (
        (lambda: ik.body_position(BodyIndex(0)), "out of range"),
        (lambda: ik.AddJointLimitConstraint(TIP, 1.0, 0.5), "above"),
        (lambda: ik.AddPostureCost([0, 0], [1, 1], [1, 1, 1]), "3 rows"),
        (lambda: ik.AddPostureCost([0, 0], [1, 1, -1], [1, 1, 1]), "negative"),
        (lambda: ik.BodyPointInOneOfRegions(TIP, END, [np.zeros((3, 2))]), "3 vertices"),
        (lambda: ik.BodySphereInOneOfPolytopes(TIP, END, -1.0, []), "negative"),
        (lambda: MixedIntegerRotationConstraintGenerator(Approach.kBoth, 0, None), "at least 1"),
    ):
        with pytest.raises(RuntimeError, match=message):
            call()
    plant = MultibodyPlant(0.0)
    body = plant.AddRigidBody("b", CUBE)
    plant.AddJoint(PrismaticJoint("slide", plant.world_frame(), body.body_frame(), [1, 0, 0]))
    plant.Finalize()
    with pytest.raises(RuntimeError, match="'slide' is of unsupported type 'prismatic'"):
        GlobalInverseKinematics(plant)
