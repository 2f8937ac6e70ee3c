"""Forces that joints transmit in a plant whose bodies constraints push: Drake's, and those of statics."""

import importlib

import numpy as np
import pytest

KINDS = ("distance", "ball", "weld", "coupler")
"""Without one to the world: the wheel of Drake 1.51 crashes on it."""


def reactions(package: str, kind: str, span: float) -> tuple[np.ndarray, np.ndarray]:
    """Angles, and the reactions on two pendulums side by side that a constraint spreads, after some time."""
    lib = importlib.import_module(f"{package}.all")
    plant = lib.MultibodyPlant(1e-3)
    M = lib.SpatialInertia.SolidBoxWithMass(1.0, 0.1, 0.1, 0.3)
    bodies, joints = [], []
    for i in range(2):
        body = plant.AddRigidBody(f"b{i}", M)
        above = lib.FixedOffsetFrame(f"f{i}", plant.world_frame(), lib.RigidTransform([0.5 * i, 0, 1]))
        pivot = lib.FixedOffsetFrame(f"g{i}", body.body_frame(), lib.RigidTransform([0, 0, 0.15]))
        joint = lib.RevoluteJoint(f"j{i}", plant.AddFrame(above), plant.AddFrame(pivot), [0, 1, 0], damping=1.0)
        joints.append(plant.AddJoint(joint))
        bodies.append(body)
    left, right = [0.25, 0, -0.15], [-0.27, 0, -0.15]
    if kind == "distance":
        plant.AddDistanceConstraint(bodies[0], [0, 0, -0.15], bodies[1], [0, 0, -0.15], 0.6)
    elif kind == "distance to the world":
        plant.AddDistanceConstraint(plant.world_body(), [-0.3, 0, 0.6], bodies[1], left, 1.0)
    elif kind == "ball":
        plant.AddBallConstraint(bodies[0], left, bodies[1], right)
    elif kind == "weld":
        plant.AddWeldConstraint(bodies[0], lib.RigidTransform(left), bodies[1], lib.RigidTransform(right))
    else:
        plant.AddCouplerConstraint(joints[0], joints[1], -1.0, 0.2)
    plant.Finalize()
    simulator = lib.Simulator(plant)
    simulator.AdvanceTo(span)
    context = simulator.get_context()
    found = plant.get_reaction_forces_output_port().Eval(context)
    numbers = [np.concatenate([f.rotational(), f.translational()]) for f in found]
    return plant.GetPositions(context), np.array(numbers)


@pytest.mark.peer
@pytest.mark.parametrize("kind", KINDS)
def test_reactions(kind):
    pytest.importorskip("pydrake")
    (q, ours), (q_theirs, theirs) = (reactions(package, kind, 0.05) for package in ("sheldrake", "pydrake"))
    np.testing.assert_allclose(q, q_theirs, atol=1e-9)
    scale = 1e4 if kind == "weld" else 1.0  # The weld fights 3e6 N of its own: stiffness times rounding.
    np.testing.assert_allclose(ours, theirs, rtol=1e-6, atol=1e-6 * scale)
    assert np.abs(ours[:, [3, 5]]).max() > 0.1


def test_a_rod_between_two_pendulums_pushes_with_half_the_weight_times_the_slope():
    """Moments about the pivot: m g l sin(q) = F 2 l cos(q); the pivot bears F and the weight, and no moment."""
    q, F = reactions("sheldrake", "distance", 20.0)
    assert q[0] == pytest.approx(-q[1], abs=1e-9) and q[0] > 0.1
    for sign, angle, force in zip((1.0, -1.0), q, F):
        thrust, weight = 0.5 * 9.81 * np.tan(abs(angle)), 9.81
        c, s = np.cos(angle), np.sin(angle)
        in_world = np.array([c * force[3] + s * force[5], -s * force[3] + c * force[5]])
        np.testing.assert_allclose(in_world, [sign * thrust, weight], atol=1e-5)
        assert np.abs(force[[0, 1, 2, 4]]).max() < 1e-5


def test_a_pivot_bears_no_moment_when_the_world_pushes():
    q, F = reactions("sheldrake", "distance to the world", 20.0)
    assert abs(q[1]) > 0.01 and abs(q[0]) < 1e-9
    assert np.abs(F[1][3:]).max() > 9.0 and np.abs(F[1][:3]).max() < 1e-5
