"""Motions with known answers: what is conserved, and how fast errors fall with the step."""

from __future__ import annotations

import numpy as np
import pytest

from sheldrake.math import RigidTransform, RotationMatrix
from sheldrake.multibody.math import SpatialInertia, SpatialVelocity, UnitInertia
from sheldrake.multibody.plant import MultibodyPlant
from sheldrake.multibody.tree import (
    FixedOffsetFrame,
    PrismaticJoint,
    PrismaticSpring,
    RevoluteJoint,
    RevoluteSpring,
    ScrewJoint,
)
from sheldrake.systems.analysis import ExplicitEulerIntegrator, RungeKutta2Integrator, RungeKutta3Integrator, Simulator

G = 9.81


def order(steps, errors):
    """Slope of the error over the step in a doubly logarithmic plot."""
    return np.polyfit(np.log(steps), np.log(errors), 1)[0]


def advance(plant, context, T, step=None, integrator=RungeKutta3Integrator):
    """Runs a plant: a continuous one with fixed steps."""
    simulator = Simulator(plant, context)
    if step is not None:
        if integrator is RungeKutta3Integrator:
            steps = RungeKutta3Integrator(plant, context)
            steps.set_fixed_step_mode(True)
            steps.set_maximum_step_size(step)
        else:
            steps = integrator(plant, step, context)
        simulator.reset_integrator(steps)
    simulator.AdvanceTo(T)
    return context


def momentum(plant, context):
    """Spatial momentum about the world's origin."""
    return plant.CalcSpatialMomentumInWorldAboutPoint(context, np.zeros(3)).get_coeffs()


def energy(plant, context):
    return plant.CalcKineticEnergy(context) + plant.CalcPotentialEnergy(context)


# --- a torque-free asymmetric top


def top(dt):
    plant = MultibodyPlant(dt)
    inertia = SpatialInertia(2.0, [0, 0, 0], UnitInertia(1.0, 2.0, 2.5))
    body = plant.AddRigidBody("top", inertia)
    plant.mutable_gravity_field().set_gravity_vector(np.zeros(3))
    plant.Finalize()
    context = plant.CreateDefaultContext()
    V_WB = SpatialVelocity([0.05, 1.5, 0.1], [0.1, 0.2, 0.3])  # near the axis about which it does not stay
    plant.SetFreeBodySpatialVelocity(context, body, V_WB)
    return plant, context, body


@pytest.mark.parametrize(
    ("integrator", "expected"),
    [(ExplicitEulerIntegrator, 1), (RungeKutta2Integrator, 2), (RungeKutta3Integrator, 3)],
)
def test_drift_of_a_tumbling_top_falls_with_the_order_of_the_integrator(integrator, expected):
    steps, drifts = np.array([0.02, 0.01, 0.005]), []
    for step in steps:
        plant, context, _ = top(0.0)
        before = np.r_[momentum(plant, context), energy(plant, context)]
        advance(plant, context, 8.0, step, integrator)
        drifts.append(np.abs(np.r_[momentum(plant, context), energy(plant, context)] - before).max())
    assert order(steps, drifts) == pytest.approx(expected, abs=0.35)
    assert drifts[-1] < [0.2, 1e-3, 1e-5][expected - 1]


def test_the_top_turns_over_and_linear_momentum_stays_to_the_last_bits():
    plant, context, body = top(0.0)
    before = momentum(plant, context)
    advance(plant, context, 12.0, 1e-3)
    w_B = plant.EvalBodyPoseInWorld(context, body).rotation().inverse() @ plant.GetVelocities(context)[:3]
    assert w_B[1] < 0.0 or np.abs(w_B[0]) + np.abs(w_B[2]) > 1.0  # Dzhanibekov: it does not keep to its middle axis
    np.testing.assert_allclose(momentum(plant, context)[3:], before[3:], rtol=1e-12)
    np.testing.assert_allclose(momentum(plant, context)[:3], before[:3], rtol=0, atol=2e-7)


def test_discrete_steps_of_the_top_are_of_first_order():
    steps, drifts = np.array([4e-3, 2e-3, 1e-3]), []
    for step in steps:
        plant, context, _ = top(step)
        before = momentum(plant, context)[:3]
        advance(plant, context, 8.0)
        drifts.append(np.abs(momentum(plant, context)[:3] - before).max())
    assert order(steps, drifts) == pytest.approx(1.0, abs=0.2)


# --- pendulums


def pendulum_chain(dt, n, length=0.7, free=False):
    """n rods hinged one to the next, the first to the world or floating."""
    plant = MultibodyPlant(dt)
    inertia = SpatialInertia.ThinRodWithMassAboutEnd(0.4, length, [0, 0, -1])
    if free:
        inertia = SpatialInertia.SolidCylinderWithMassAboutEnd(0.4, 0.1, length, [0, 0, -1])
    parent, X_PF = plant.world_body(), RigidTransform()
    for k in range(n):
        body = plant.AddRigidBody(f"rod{k}", inertia)
        if k or not free:
            axis = [0, 1, 0] if not free else [[0, 1, 0], [1, 0, 0]][k % 2]
            frame = plant.AddFrame(FixedOffsetFrame(f"end{k}", parent.body_frame(), X_PF))
            plant.AddJoint(RevoluteJoint(f"hinge{k}", frame, body.body_frame(), axis))
        parent, X_PF = body, RigidTransform([0, 0, -length])
    if free:
        plant.mutable_gravity_field().set_gravity_vector(np.zeros(3))
    plant.Finalize()
    return plant, plant.CreateDefaultContext()


@pytest.mark.parametrize("amplitude", [0.2, 1.5, 2.9])
def test_the_period_of_a_pendulum_is_the_elliptic_integral(amplitude):
    from scipy.special import ellipk

    length = 0.7
    plant, context = pendulum_chain(0.0, 1, length)
    expected = 4.0 * np.sqrt(2 * length / (3 * G)) * ellipk(np.sin(amplitude / 2) ** 2)
    plant.SetPositions(context, [amplitude])
    advance(plant, context, expected, 1e-3)
    angle, rate = plant.GetPositionsAndVelocities(context)
    acceleration = plant.EvalTimeDerivatives(context).CopyToVector()[1]
    assert angle == pytest.approx(amplitude, abs=1e-6)
    assert rate / acceleration == pytest.approx(0.0, abs=1e-6 * expected)  # how late it comes to rest [s]


def test_a_double_pendulum_keeps_its_energy():
    steps, drifts = np.array([4e-3, 2e-3, 1e-3]), []
    for step in steps:
        plant, context = pendulum_chain(0.0, 2)
        plant.SetPositionsAndVelocities(context, [2.0, -1.0, 0.5, 1.0])
        before = energy(plant, context)
        advance(plant, context, 2.0, step)
        drifts.append(abs(energy(plant, context) - before))
    assert drifts[-1] < 1e-6
    assert order(steps, drifts) > 2.5


def test_a_floating_chain_keeps_its_momentum():
    """Internal motion of five rods about crossed axes: linear momentum to round-off, angular with the integrator."""
    rng = np.random.default_rng(5)
    start, steps, drifts = None, np.array([8e-3, 4e-3, 2e-3]), []
    for step in steps:
        plant, context = pendulum_chain(0.0, 5, free=True)
        start = rng.normal(size=plant.num_velocities()) if start is None else start
        plant.SetVelocities(context, start)
        before = momentum(plant, context)
        advance(plant, context, 1.0, step)
        drift = np.abs(momentum(plant, context) - before)
        drifts.append(drift.max())
    assert drifts[-1] < 1e-5
    assert order(steps, drifts) > 2.5


# --- screws, couplers, springs


def test_a_nut_on_a_screw_falls_as_its_thread_lets_it():
    mass, about_axis, pitch = 0.5, 0.5 * 0.004, 0.3
    plant = MultibodyPlant(0.0)
    nut = plant.AddRigidBody("nut", SpatialInertia(mass, [0, 0, 0], UnitInertia(0.003, 0.003, 0.004)))
    screw = plant.AddJoint(
        ScrewJoint("thread", plant.world_frame(), nut.body_frame(), axis=[0, 0, 1], screw_pitch=pitch, damping=0.0)
    )
    plant.Finalize()
    context = plant.CreateDefaultContext()
    lead = pitch / (2 * np.pi)
    acceleration = -mass * G * lead / (about_axis + mass * lead**2)
    advance(plant, context, 0.5, 1e-3)
    assert screw.get_rotation(context) == pytest.approx(0.5 * acceleration * 0.25, rel=1e-12)
    X_WB = plant.EvalBodyPoseInWorld(context, nut)
    assert X_WB.translation()[2] == pytest.approx(lead * screw.get_rotation(context), rel=1e-12)
    assert X_WB.IsNearlyEqualTo(
        RigidTransform(RotationMatrix.MakeZRotation(screw.get_rotation(context)), X_WB.translation()), 1e-12
    )


def test_coupled_wheels_turn_at_their_ratio_with_the_inertia_of_both():
    ratio, offset, dt, tau, I = -2.5, 0.3, 1e-3, 0.02, 0.01
    plant = MultibodyPlant(dt)
    M = SpatialInertia(1.0, [0, 0, 0], UnitInertia(I, I, I))
    wheels = [plant.AddRigidBody(name, M) for name in ("driven", "driving")]
    driven, driving = (
        plant.AddJoint(RevoluteJoint(b.name(), plant.world_frame(), b.body_frame(), [0, 0, 1])) for b in wheels
    )
    plant.AddCouplerConstraint(driven, driving, ratio, offset)
    plant.AddJointActuator("motor", driving)
    plant.Finalize()
    context = plant.CreateDefaultContext()
    plant.get_actuation_input_port().FixValue(context, [tau])
    driven.set_angle(context, offset)
    steps = 400
    advance(plant, context, steps * dt)
    expected = tau / (I + ratio**2 * I) * dt**2 * steps * (steps + 1) / 2  # symplectic Euler at constant acceleration
    assert driving.get_angle(context) == pytest.approx(expected, rel=1e-6)
    assert driven.get_angle(context) == pytest.approx(ratio * driving.get_angle(context) + offset, abs=1e-6)


def spring_plant(dt, kind):
    """Mass 2 kg (or 2 kg m²) on a spring of 50 N/m (or N m/rad) with its rest at 0.1."""
    plant = MultibodyPlant(dt)
    body = plant.AddRigidBody("body", SpatialInertia(2.0, [0, 0, 0], UnitInertia(1.0, 1.0, 1.0)))
    ends = plant.world_frame(), body.body_frame()
    if kind == "prismatic":
        joint = plant.AddJoint(PrismaticJoint("slide", *ends, [1, 0, 0]))
        plant.AddForceElement(PrismaticSpring(joint, 0.1, 50.0))
    else:
        joint = plant.AddJoint(RevoluteJoint("hinge", *ends, [1, 0, 0]))
        plant.AddForceElement(RevoluteSpring(joint, 0.1, 50.0))
    plant.Finalize()
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, [0.4])
    return plant, context


@pytest.mark.parametrize("kind", ["prismatic", "revolute"])
def test_a_mass_on_a_spring_has_its_frequency(kind):
    plant, context = spring_plant(0.0, kind)
    omega, T = np.sqrt(50.0 / 2.0), 3.7
    advance(plant, context, T, 1e-3)
    x, v = plant.GetPositionsAndVelocities(context)
    assert x == pytest.approx(0.1 + 0.3 * np.cos(omega * T), abs=1e-7)
    assert v == pytest.approx(-0.3 * omega * np.sin(omega * T), abs=1e-6)


@pytest.mark.parametrize("kind", ["prismatic", "revolute"])
def test_discrete_steps_on_a_spring_turn_at_the_angle_of_symplectic_euler(kind):
    """x(k+1) - 2 x(k) + x(k-1) = -(w dt)² x(k): a turn of phi a step with cos(phi) = 1 - (w dt)²/2, for ever."""
    dt, n = 5e-3, 2000
    plant, context = spring_plant(dt, kind)
    simulator = Simulator(plant, context)
    simulator.AdvanceTo(dt)
    x = [plant.GetPositions(context)[0] - 0.1]
    phi = np.arccos(1.0 - 25.0 * dt**2 / 2.0)
    for k in range(2, n):
        simulator.AdvanceTo(k * dt)
        x.append(plant.GetPositions(context)[0] - 0.1)
    k = np.arange(1, n)
    basis = np.column_stack([np.cos(phi * k), np.sin(phi * k)])
    amplitudes, *_ = np.linalg.lstsq(basis, x, rcond=None)
    np.testing.assert_allclose(basis @ amplitudes, x, atol=1e-10)
    assert np.hypot(*amplitudes) == pytest.approx(0.3, rel=1e-3)
