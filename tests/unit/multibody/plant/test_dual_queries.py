"""Derivatives of queries by machine code on complex numbers: what Python on duals gives, and finite differences."""

from __future__ import annotations

import numpy as np
import pytest

from sheldrake.autodiffutils import AutoDiffXd, ExtractGradient, ExtractValue, InitializeAutoDiff
from sheldrake.common._kernels import generic
from sheldrake.common.kernel import Vector, jit_enabled, kernel
from sheldrake.math import RigidTransform, RollPitchYaw
from sheldrake.multibody.math import SpatialInertia, UnitInertia
from sheldrake.multibody.plant import MultibodyPlant
from sheldrake.multibody.plant._context import dual_calls
from sheldrake.multibody.tree import (
    BallRpyJoint,
    FixedOffsetFrame,
    JacobianWrtVariable,
    MultibodyForces_,
    PlanarJoint,
    PrismaticJoint,
    RevoluteJoint,
    ScrewJoint,
    UniversalJoint,
)

V = JacobianWrtVariable.kV
pytestmark = pytest.mark.skipif(not jit_enabled(), reason="asks about machine code; SHELDRAKE_JIT=0 switches it off")


@pytest.fixture(scope="module")
def plant():
    """A chain with joints of every kind that hangs from a floating body."""
    plant, rng = MultibodyPlant(0.0), np.random.default_rng(4)
    M = SpatialInertia(1.3, [0.02, 0.03, -0.01], UnitInertia(0.02, 0.03, 0.025, 0.001, 0.002, -0.001))
    parent = plant.AddRigidBody("base", M)
    kinds = [
        lambda n, F, B: RevoluteJoint(n, F, B, [0, 0, 1], damping=0.1),
        lambda n, F, B: RevoluteJoint(n, F, B, np.ones(3) / np.sqrt(3)),
        lambda n, F, B: PrismaticJoint(n, F, B, [0, 1, 0]),
        lambda n, F, B: ScrewJoint(n, F, B, axis=[1, 0, 0], screw_pitch=0.2, damping=0.0),
        UniversalJoint,
        BallRpyJoint,
        PlanarJoint,
    ]
    for k, make in enumerate(kinds):
        body = plant.AddRigidBody(f"b{k}", M)
        X_PF = RigidTransform(RollPitchYaw(rng.uniform(-1, 1, 3)), rng.uniform(-0.3, 0.3, 3))
        F = plant.AddFrame(FixedOffsetFrame(f"f{k}", parent.body_frame(), X_PF))
        plant.AddJoint(make(f"j{k}", F, body.body_frame()))
        parent = body
    plant.Finalize()
    return plant


@pytest.fixture(scope="module")
def state(plant):
    x = np.random.default_rng(7).uniform(-0.9, 0.9, plant.num_positions() + plant.num_velocities())
    x[:4] /= np.linalg.norm(x[:4])
    return x


def answers(plant, x, mass=None):
    """All queries that have answers, as one vector."""
    scalar = AutoDiffXd if np.asarray(x).dtype == object else float
    plant = plant.ToAutoDiffXd() if scalar is AutoDiffXd else plant
    context = plant.CreateDefaultContext()
    plant.SetPositionsAndVelocities(context, x)
    tip, world = plant.GetBodyByName("b6"), plant.world_frame()
    if mass is not None:
        tip.SetMass(context, mass)
    forces = MultibodyForces_[scalar](plant)
    forces._tau[:] = x[-plant.num_velocities() :]
    forces._F_Bo_W[3] = np.arange(6.0)
    vdot = np.linspace(0.1, 1.0, plant.num_velocities()) * x[-1]
    acting = MultibodyForces_[scalar](plant)
    plant.CalcForceElementsContribution(context, acting)
    X = plant.EvalBodyPoseInWorld(context, tip)
    J = plant.CalcJacobianSpatialVelocity(context, V, tip.body_frame(), np.array([0.1, 0.2, 0.3]), world, world)
    parts = [
        plant.CalcMassMatrix(context), plant.CalcBiasTerm(context), plant.CalcGravityGeneralizedForces(context),
        plant.CalcInverseDynamics(context, vdot, forces), X.translation(), X.rotation().matrix(), J,
        plant.CalcCenterOfMassPositionInWorld(context), acting._tau, acting._F_Bo_W,
        plant.CalcRelativeTransform(context, tip.body_frame(), plant.GetFrameByName("f2")).GetAsMatrix34(),
    ]  # fmt: skip
    return np.concatenate([np.ravel(part) for part in parts])


def compiled(monkeypatch):
    monkeypatch.setattr(dual_calls, "_NUMBERS", 0)


def as_python(monkeypatch):
    monkeypatch.setattr(dual_calls, "_NUMBERS", 10**9)
    monkeypatch.setattr(dual_calls.kernel_store, "is_ready", lambda kernel: False)


def test_machine_code_and_python_agree(plant, state, monkeypatch):
    x = InitializeAutoDiff(state)[:, 0]
    with monkeypatch.context() as patch:
        compiled(patch)
        quick = answers(plant, x)
    with monkeypatch.context() as patch:
        as_python(patch)
        slow = answers(plant, x)
    scale = np.abs(ExtractGradient(slow)).max()
    np.testing.assert_allclose(ExtractValue(quick), ExtractValue(slow), atol=1e-12)
    np.testing.assert_allclose(ExtractGradient(quick), ExtractGradient(slow), atol=1e-12 * scale)


def test_against_finite_differences(plant, state, monkeypatch):
    compiled(monkeypatch)
    gradient, h = ExtractGradient(answers(plant, InitializeAutoDiff(state)[:, 0])), 1e-5
    for k, unit in enumerate(np.eye(len(state))):
        near = [answers(plant, state + s * h * unit) for s in (-2, -1, 1, 2)]
        slope = (near[0] - 8 * near[1] + 8 * near[2] - near[3]) / (12 * h)
        np.testing.assert_allclose(gradient[:, k], slope, atol=2e-9 * (1 + np.abs(slope).max()))


def test_rows_of_what_stages_leave_are_its_arrays(plant, state):
    plant = plant.ToAutoDiffXd()
    context = plant.CreateDefaultContext()
    plant.SetPositionsAndVelocities(context, InitializeAutoDiff(state)[:, 0])
    work = plant._parts.contexts.view(context).velocities()
    np.testing.assert_array_equal(work[3].p_WB, work.X_WB[3, 9:])
    np.testing.assert_array_equal(np.concatenate(work.dofs[7].S), work.S[7])
    with pytest.raises(AttributeError, match="x_WB"):
        _ = work.x_WB


def test_derivatives_by_parameters_and_along_one_direction(plant, state, monkeypatch):
    compiled(monkeypatch)
    direction = np.random.default_rng(9).normal(size=(len(state), 1))
    along = ExtractGradient(answers(plant, InitializeAutoDiff(state, direction)[:, 0]))
    full = ExtractGradient(answers(plant, InitializeAutoDiff(state)[:, 0]))
    np.testing.assert_allclose(along, full @ direction, atol=1e-11 * np.abs(full).max())
    duals = np.array([AutoDiffXd(s) for s in state], object)
    by_mass = ExtractGradient(answers(plant, duals, AutoDiffXd(1.3, [1.0])))[:, 0]
    h = 1e-4
    slope = (answers(plant, state, 1.3 + h) - answers(plant, state, 1.3 - h)) / (2 * h)
    np.testing.assert_allclose(by_mass, slope, atol=1e-8 * np.abs(slope).max())


def test_constants_have_no_derivatives_and_sizes_must_agree(plant, state, monkeypatch):
    compiled(monkeypatch)
    constant = answers(plant, np.array([AutoDiffXd(s) for s in state], object))
    assert all(a.derivatives().size == 0 for a in constant)
    np.testing.assert_allclose([a.value() for a in constant], answers(plant, state), atol=1e-12)
    mixed = InitializeAutoDiff(state)[:, 0]
    mixed[5] = AutoDiffXd(0.1, [1.0, 2.0])
    with pytest.raises(RuntimeError, match="derivatives"):
        answers(plant, mixed)


def test_later_writes_are_seen(plant, state, monkeypatch):
    compiled(monkeypatch)
    dual = plant.ToAutoDiffXd()
    context = dual.CreateDefaultContext()
    for scale in (1.0, 0.5):
        dual.SetPositionsAndVelocities(context, InitializeAutoDiff(scale * state)[:, 0])
        C = ExtractValue(dual.CalcBiasTerm(context))[:, 0]
        other = plant.CreateDefaultContext()
        plant.SetPositionsAndVelocities(other, scale * state)
        np.testing.assert_allclose(C, plant.CalcBiasTerm(other), atol=1e-12)


def test_what_is_asked_again_is_remembered_until_something_is_written(plant, state, monkeypatch):
    compiled(monkeypatch)
    copy = plant.ToAutoDiffXd()
    context, tip, frame = copy.CreateDefaultContext(), copy.GetBodyByName("b6"), copy.GetFrameByName("f6")
    copy.SetPositionsAndVelocities(context, InitializeAutoDiff(state)[:, 0])
    queries = [
        lambda: copy.CalcMassMatrix(context),
        lambda: copy.EvalBodyPoseInWorld(context, tip).GetAsMatrix34(),
        lambda: copy.CalcRelativeRotationMatrix(context, copy.world_frame(), frame).matrix(),
        lambda: copy.CalcCenterOfMassPositionInWorld(context),
    ]
    first = [query() for query in queries]
    runs = []
    run = dual_calls.sweep_sources
    monkeypatch.setattr(dual_calls, "sweep_sources", lambda *args: runs.append(args) or run(*args))
    again = [query() for query in queries[:3]]
    assert not runs
    for a, b in zip(first, again):
        assert a is not b
        np.testing.assert_array_equal(ExtractGradient(a), ExtractGradient(b))
        b[:] = 0.0  # is the caller's
    writes = [
        lambda: copy.SetPositions(
            context, InitializeAutoDiff(state[: copy.num_positions()] * 0.9, len(state), 0)[:, 0]
        ),
        lambda: tip.SetMass(context, 2.0),
        lambda: frame.SetPoseInParentFrame(context, RigidTransform([0.1, 0.2, 0.3])),
    ]
    for write in writes:
        write()
        fresh = copy.CreateDefaultContext()
        fresh.SetTimeStateAndParametersFrom(context)
        found, context_before = [query() for query in queries], context
        context = fresh
        expected = [query() for query in queries]
        context = context_before
        for a, b in zip(found, expected):
            np.testing.assert_array_equal(ExtractValue(a), ExtractValue(b))
            np.testing.assert_array_equal(ExtractGradient(a), ExtractGradient(b))


@kernel(top=True)
def all_functions(x: Vector, y: Vector) -> None:
    """Every generic function at one number between 0 and 1."""
    y[0] = generic.sin(x[0])
    y[1] = generic.cos(x[0])
    y[2] = generic.tan(x[0])
    y[3] = generic.asin(x[0])
    y[4] = generic.acos(x[0])
    y[5] = generic.atan(x[0])
    y[6] = generic.sinh(x[0])
    y[7] = generic.cosh(x[0])
    y[8] = generic.tanh(x[0])
    y[9] = generic.exp(x[0])
    y[10] = generic.log(x[0])
    y[11] = generic.sqrt(x[0])
    y[12] = generic.atan2(x[0], 0.3 * x[0] + 0.1)
    y[13] = 1.0 / x[0] if generic.is_positive(x[0]) else x[0]


def test_functions_of_complex_numbers_are_those_of_duals():
    h = 2.0**-200
    x, y = np.array([0.4 + 1j * h]), np.zeros(14, complex)
    assert all_functions.on_complex.native(x, y) == 0
    duals = np.full(14, None, object)
    all_functions(np.array([AutoDiffXd(0.4, [1.0])], object), duals)
    np.testing.assert_allclose(y.real, [d.value() for d in duals], rtol=1e-15)
    np.testing.assert_allclose(y.imag / h, [d.derivatives()[0] for d in duals], rtol=1e-14)


def test_a_mass_matrix_by_inverse_dynamics_of_a_moving_plant_is_the_mass_matrix(plant, state):
    dual = plant.ToAutoDiffXd()
    context = dual.CreateDefaultContext()
    dual.SetPositionsAndVelocities(context, InitializeAutoDiff(state).ravel())
    M, slow = dual.CalcMassMatrix(context), dual.CalcMassMatrixViaInverseDynamics(context)
    np.testing.assert_allclose(ExtractValue(slow), ExtractValue(M), atol=1e-12)
    np.testing.assert_allclose(ExtractGradient(slow), ExtractGradient(M), atol=1e-10)
