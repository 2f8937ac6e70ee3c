import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sheldrake.systems.analysis import Simulator
from sheldrake.systems.controllers import (
    FiniteHorizonLinearQuadraticRegulator,
    FiniteHorizonLinearQuadraticRegulatorOptions,
    LinearQuadraticRegulator,
    MakeFiniteHorizonLinearQuadraticRegulator,
)
from sheldrake.systems.framework import DiagramBuilder
from sheldrake.systems.primitives import LinearSystem
from sheldrake.trajectories import PiecewisePolynomial

A, B = np.array([[0.0, 1.0], [-1.0, -0.2]]), np.array([[0.0], [1.0]])
Q, R = np.diag([2.0, 1.0]), np.array([[0.5]])


def plant():
    system = LinearSystem(A, B, np.eye(2), np.zeros((2, 1)))
    context = system.CreateDefaultContext()
    system.get_input_port().FixValue(context, [0.0])
    return system, context


def test_far_from_the_end_it_is_the_stationary_regulator():
    result = FiniteHorizonLinearQuadraticRegulator(*plant(), 0.0, 30.0, Q, R)
    K, S = LinearQuadraticRegulator(A, B, Q, R)
    np.testing.assert_allclose(result.K.value(0.0), K, rtol=1e-7)
    np.testing.assert_allclose(result.S.value(0.0), S, rtol=1e-7)
    np.testing.assert_allclose(result.S.value(30.0), 0.0, atol=1e-12)
    np.testing.assert_array_equal(result.k0.value(3.0), 0.0)


def test_its_cost_is_what_the_closed_loop_costs():
    """With a moving target, a cross term and a final cost: every term of the solution counts."""
    system, context = plant()
    options = FiniteHorizonLinearQuadraticRegulatorOptions()
    options.Qf, options.N = np.diag([3.0, 4.0]), np.array([[0.1], [0.2]])
    options.xd = PiecewisePolynomial.FirstOrderHold([0.0, 2.0], [[0.5, 1.5], [0.0, -0.5]])
    options.ud = PiecewisePolynomial([[0.3]])
    result = FiniteHorizonLinearQuadraticRegulator(system, context, 0.0, 2.0, Q, R, options)
    start = np.array([0.7, -0.4])

    def rates(t, y):
        x = y[:2]
        u = result.u0.value(t)[:, 0] - result.K.value(t) @ (x - result.x0.value(t)[:, 0]) - result.k0.value(t)[:, 0]
        e, d = x - options.xd.value(t)[:, 0], u - options.ud.value(t)[:, 0]
        cost = e @ Q @ e + d @ R @ d + 2 * e @ options.N @ d
        return np.concatenate([A @ x + B @ u, [cost]])

    y = solve_ivp(rates, (0.0, 2.0), [*start, 0.0], rtol=1e-9, atol=1e-12).y[:, -1]
    e = y[:2] - options.xd.value(2.0)[:, 0]
    S, sx, s0 = (trajectory.value(0.0) for trajectory in (result.S, result.sx, result.s0))
    promised = start @ S @ start + 2 * start @ sx[:, 0] + s0[0, 0]
    assert y[2] + e @ options.Qf @ e == pytest.approx(promised, rel=1e-6)


def test_as_a_system_it_brings_the_state_to_the_target():
    system, context = plant()
    options = FiniteHorizonLinearQuadraticRegulatorOptions()
    options.Qf = 1000.0 * np.eye(2)
    regulator = MakeFiniteHorizonLinearQuadraticRegulator(system, context, 0.0, 5.0, Q, R, options)
    builder = DiagramBuilder()
    builder.AddSystem(system)
    builder.AddSystem(regulator)
    builder.Connect(system.get_output_port(), regulator.GetInputPort("plant_state"))
    builder.Connect(regulator.GetOutputPort("command"), system.get_input_port())
    simulator = Simulator(builder.Build())
    simulator.get_mutable_context().SetContinuousState([1.0, 0.0])
    simulator.AdvanceTo(5.0)
    x = simulator.get_context().get_continuous_state_vector().CopyToVector()
    assert np.abs(x).max() < 0.01


def test_errors():
    system, context = plant()
    discrete = LinearSystem(A, B, np.eye(2), np.zeros((2, 1)), 0.1)
    for wrong, words in (
        (lambda: FiniteHorizonLinearQuadraticRegulator(system, context, 1.0, 1.0, Q, R), "after"),
        (lambda: FiniteHorizonLinearQuadraticRegulator(system, context, 0.0, 1.0, np.eye(3), R), "2 x 2"),
        (lambda: FiniteHorizonLinearQuadraticRegulator(system, context, 0.0, 1.0, Q, -R), "positive definite"),
        (
            lambda: FiniteHorizonLinearQuadraticRegulator(system, system.CreateDefaultContext(), 0.0, 1.0, Q, R),
            "options.u0",
        ),
        (
            lambda: FiniteHorizonLinearQuadraticRegulator(discrete, discrete.CreateDefaultContext(), 0.0, 1.0, Q, R),
            "continuous state",
        ),
    ):
        with pytest.raises(RuntimeError, match=words):
            wrong()
