"""Motions with known answers: what is conserved, and how fast errors fall with the step."""

from __future__ import annotations

import numpy as np
import pytest
from benchmarks import motion_answers as answers
from benchmarks.motion_answers import DISCRETE, RK3, ROWS, Library

from sheldrake.math import RigidTransform, RotationMatrix
from sheldrake.multibody.math import SpatialInertia, SpatialVelocity, UnitInertia
from sheldrake.multibody.plant import MultibodyPlant
from sheldrake.multibody.tree import PrismaticJoint, PrismaticSpring, RevoluteJoint, RevoluteSpring, ScrewJoint
from sheldrake.systems.analysis import Simulator

LIMITS = {
    "pendulum 0.2, Runge-Kutta 3": 1e-9,
    "pendulum 1.5, Runge-Kutta 3": 4e-8,
    "pendulum 2.9, Runge-Kutta 3": 2e-6,
    "top, explicit Euler": 0.01,
    "top, Runge-Kutta 2": 2e-5,
    "top, Runge-Kutta 3": 1e-7,
    "top, discrete plant": 2e-3,
    "double, Runge-Kutta 3": 1e-6,
    "double, discrete plant": 0.1,
    "chain, angular, Runge-Kutta 3": 2e-7,
    "chain, angular, discrete plant": 0.015,
    "chain, linear, Runge-Kutta 3": 5e-8,
    "chain, linear, discrete plant": 0.01,
    "screw, Runge-Kutta 3": 1e-12,
    "screw, discrete plant": 1e-12,
    "coupler, discrete plant": 4e-9,
    "spring, Runge-Kutta 3": 2e-10,
    "spring, discrete plant": 1e-5,
}
"""The largest deviations allowed with the smallest step; the numbers are those of docs/motions.md."""


@pytest.mark.parametrize("name", ROWS)
def test_deviations_stay_within_limits_and_fall_with_the_order_of_the_scheme(name):
    deviation, order = answers.measure(ROWS[name], "sheldrake")
    assert deviation < LIMITS[name]
    if ROWS[name].order is None:
        assert order is None
    else:
        assert order > ROWS[name].order - 0.1


@pytest.mark.peer
@pytest.mark.parametrize("name", ROWS)
def test_deviations_are_those_of_drake(name):
    """Equal schemes make equal errors; what differs is round-off, relative to quantities of about 1."""
    pytest.importorskip("pydrake")
    row = ROWS[name]
    ours, theirs = (row.deviation(Library(library), row.scheme, row.steps[0]) for library in ("sheldrake", "pydrake"))
    assert ours == pytest.approx(theirs, rel=1e-6, abs=1e-12)


class Wrong(Library):
    """Inertias, springs and gravity are off by a ten thousandth."""

    def __getattr__(self, name):
        make = super().__getattr__(name)
        if name not in ("UnitInertia", "PrismaticSpring"):
            return make
        return lambda *arguments: make(*arguments[:-1], 1.0001 * arguments[-1])

    def plant(self, *arguments, **options):
        plant = super().plant(*arguments, **options)
        gravity = plant.mutable_gravity_field()
        gravity.set_gravity_vector(1.0001 * gravity.gravity_vector())
        return plant


@pytest.mark.parametrize("name", ["pendulum 1.5, Runge-Kutta 3", "spring, discrete plant", "screw, discrete plant"])
def test_planted_faults_are_found(name):
    row = ROWS[name]
    assert row.deviation(Wrong("sheldrake"), row.scheme, row.steps[-1]) > LIMITS[name]


# --- a torque-free asymmetric top


def test_the_top_turns_over_and_linear_momentum_stays_to_the_last_bits():
    plant = MultibodyPlant(0.0)
    body = plant.AddRigidBody("top", SpatialInertia(2.0, [0, 0, 0], UnitInertia(1.0, 2.0, 2.5)))
    plant.mutable_gravity_field().set_gravity_vector(np.zeros(3))
    plant.Finalize()
    context = plant.CreateDefaultContext()
    plant.SetFreeBodySpatialVelocity(context, body, SpatialVelocity([0.05, 1.5, 0.1], [0.1, 0.2, 0.3]))
    before = answers.momentum(plant, context)
    advance(plant, context, 12.0)
    w_B = plant.EvalBodyPoseInWorld(context, body).rotation().inverse() @ plant.GetVelocities(context)[:3]
    assert w_B[1] < 0.0 or np.abs(w_B[0]) + np.abs(w_B[2]) > 1.0  # Dzhanibekov: it does not keep to its middle axis
    np.testing.assert_allclose(answers.momentum(plant, context)[3:], before[3:], rtol=1e-12)
    np.testing.assert_allclose(answers.momentum(plant, context)[:3], before[:3], rtol=0, atol=2e-7)


def advance(plant, context, T):
    """Runs a plant: a continuous one with fixed steps of 1 ms."""
    Library("sheldrake").advance(plant, context, T, DISCRETE if plant.is_discrete() else RK3, 1e-3)


# --- screws, couplers, springs


def test_a_nut_turns_and_moves_together():
    plant = MultibodyPlant(0.0)
    nut = plant.AddRigidBody("nut", SpatialInertia(0.5, [0, 0, 0], UnitInertia(0.003, 0.003, 0.004)))
    screw = plant.AddJoint(
        ScrewJoint("thread", plant.world_frame(), nut.body_frame(), axis=[0, 0, 1], screw_pitch=0.3, damping=0.0)
    )
    plant.Finalize()
    context = plant.CreateDefaultContext()
    advance(plant, context, 0.5)
    X_WB = plant.EvalBodyPoseInWorld(context, nut)
    angle = screw.get_rotation(context)
    expected = RigidTransform(RotationMatrix.MakeZRotation(angle), [0, 0, 0.3 / (2 * np.pi) * angle])
    assert angle < -1.0 and X_WB.IsNearlyEqualTo(expected, 1e-12)


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
    advance(plant, context, T)
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
