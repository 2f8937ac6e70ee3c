import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sheldrake.examples import PendulumPlant
from sheldrake.symbolic import Variable, sin
from sheldrake.systems.analysis import Simulator, SimulatorConfig
from sheldrake.systems.controllers import (
    FiniteHorizonLinearQuadraticRegulator,
    FiniteHorizonLinearQuadraticRegulatorOptions,
    LinearQuadraticRegulator,
    MakeFiniteHorizonLinearQuadraticRegulator,
    _finite_horizon,
)
from sheldrake.systems.framework import DiagramBuilder
from sheldrake.systems.primitives import Adder, LinearSystem, SymbolicVectorSystem, TrajectorySource
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


def swing(kind):
    """A pendulum with v' = u / inertia - damping v - stiffness(t) sin(q); and these."""
    if kind == "kernels":
        return PendulumPlant(), 0.25, 0.4, lambda t: 9.81 / 0.5
    t, q, v, u = (Variable(name) for name in "tqvu")
    stiffness = 1.0 + (0.3 * sin(3.0 * t) if kind == "changes" else 0.0)
    system = SymbolicVectorSystem(t, [q, v], [u], dynamics=[v, u - 0.1 * v - stiffness * sin(q)])
    return system, 1.0, 0.1, lambda time: 1.0 + (0.3 * np.sin(3.0 * time) if kind == "changes" else 0.0)


@pytest.mark.parametrize("accuracy", [1e-6, 1e-8])
@pytest.mark.parametrize("kind", ["kernels", "stays", "changes"])
def test_it_solves_the_equation_along_a_trajectory(kind, accuracy):
    """Against an ordinary solver, piece by piece: states turn, inputs jump, control is cheap, so that S rises fast."""
    times = np.array([0.0, 0.4, 1.0, 1.5])
    options = FiniteHorizonLinearQuadraticRegulatorOptions()
    options.x0 = PiecewisePolynomial.CubicWithContinuousSecondDerivatives(
        times, [[0.0, 0.7, 1.9, 2.0], [0.1, 1.2, 1.0, -0.7]]
    )
    options.u0 = PiecewisePolynomial.ZeroOrderHold(times, [[0.3, -0.6, 0.9, 0.0]])
    options.ud = PiecewisePolynomial.FirstOrderHold([0.0, 0.8, 1.5], [[0.1, 0.4, -0.2]])
    options.Qf, options.N = np.diag([30.0, 40.0]), np.array([[0.1], [0.02]])
    options.simulator_config = SimulatorConfig(accuracy=accuracy)
    atol = 40.0 * accuracy  # relative to the largest S, which is the last
    cheap = np.array([[0.01]])
    system, inertia, damping, stiffness = swing(kind)
    B = np.array([[0.0], [1.0 / inertia]])
    context = system.CreateDefaultContext()
    result = FiniteHorizonLinearQuadraticRegulator(system, context, 0.0, 1.5, Q, cheap, options)

    def rates(t, y):
        S, sx = y[:4].reshape(2, 2), y[4:6]
        x0, u0 = options.x0.value(t)[:, 0], options.u0.value(t)[:, 0]
        A_t = np.array([[0.0, 1.0], [-stiffness(t) * np.cos(x0[0]), -damping]])
        motion = np.array([x0[1], u0[0] / inertia - damping * x0[1] - stiffness(t) * np.sin(x0[0])])
        c, d = motion - options.x0.EvalDerivative(t)[:, 0], options.ud.value(t)[:, 0] - u0
        gain, r = options.N + S @ B, B.T @ sx - cheap @ d
        S_dot = -(Q - gain @ gain.T / cheap + S @ A_t + A_t.T @ S)
        sx_dot = -(-options.N @ d - gain @ r / cheap[0, 0] + A_t.T @ sx + S @ c)
        return np.concatenate((S_dot.ravel(), sx_dot, [-(d @ cheap @ d - r @ r / cheap[0, 0] + 2.0 * sx @ c)]))

    y = np.append(options.Qf.ravel(), np.zeros(3))
    for a, b in ((1.0, 1.5), (0.8, 1.0), (0.4, 0.8), (0.0, 0.4)):
        piece = solve_ivp(rates, (np.nextafter(b, a), a), y, method="DOP853", rtol=1e-12, atol=1e-12, dense_output=True)
        for t in np.linspace(a, np.nextafter(b, a), 57):
            expected = piece.sol(t)
            S, sx, s0 = (trajectory.value(t) for trajectory in (result.S, result.sx, result.s0))
            found = np.concatenate((S.ravel(), sx[:, 0], s0[0]))
            np.testing.assert_allclose(found, expected, atol=atol)
            gain = (options.N + expected[:4].reshape(2, 2) @ B).T / cheap
            np.testing.assert_allclose(result.K.value(t), gain, atol=2.0 * atol / inertia / cheap[0, 0])
            k0 = (options.u0.value(t) - options.ud.value(t)) + B.T @ expected[4:6, None] / cheap
            np.testing.assert_allclose(result.k0.value(t), k0, atol=2.0 * atol / inertia / cheap[0, 0])
        y = piece.y[:, -1]


def test_a_far_target_takes_no_accuracy_from_feedback():
    options = FiniteHorizonLinearQuadraticRegulatorOptions()
    options.xd = PiecewisePolynomial.FirstOrderHold([0.0, 2.0], [[1e4, 2e4], [0.0, 0.0]])
    far = FiniteHorizonLinearQuadraticRegulator(*plant(), 0.0, 2.0, Q, R, options)
    near = FiniteHorizonLinearQuadraticRegulator(*plant(), 0.0, 2.0, Q, R)
    for t in np.linspace(0.0, 2.0, 301):
        np.testing.assert_allclose(far.S.value(t), near.S.value(t), atol=5e-6)
        np.testing.assert_allclose(far.K.value(t), near.K.value(t), atol=1e-5)


def test_a_plant_is_linearized_for_many_times_at_once(monkeypatch):
    """Linearizing time by time took 0.98 of the time."""
    calls = []
    original = _finite_horizon.motion_and_slopes
    monkeypatch.setattr(_finite_horizon, "motion_and_slopes", lambda *a: calls.append(a) or original(*a))
    system = PendulumPlant()
    options = FiniteHorizonLinearQuadraticRegulatorOptions()
    options.x0 = PiecewisePolynomial.CubicShapePreserving([0.0, 1.0, 2.0], [[0.0, 2.0, 3.0], [1.0, 2.0, 0.0]])
    options.u0 = PiecewisePolynomial([[0.1]])
    context = system.CreateDefaultContext()
    result = FiniteHorizonLinearQuadraticRegulator(system, context, 0.0, 2.0, Q, R, options)
    assert result.S.get_number_of_segments() > 90
    assert len(calls) < 10


def test_a_push_that_does_not_last_is_seen():
    """A system that is the same at nearly all times is not taken for one that is at all."""
    builder = DiagramBuilder()
    push = PiecewisePolynomial.FirstOrderHold([0.0, 0.7, 0.725, 0.75, 1.0], [[0.0, 0.0, 5.0, 0.0, 0.0]])
    source, torque = builder.AddSystem(TrajectorySource(push)), builder.AddSystem(Adder(2, 1))
    pendulum = builder.AddSystem(PendulumPlant())
    builder.Connect(source.get_output_port(), torque.get_input_port(0))
    builder.Connect(torque.get_output_port(), pendulum.get_input_port())
    builder.ExportInput(torque.get_input_port(1))
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    diagram.get_input_port().FixValue(context, [0.0])
    result = FiniteHorizonLinearQuadraticRegulator(diagram, context, 0.0, 1.0, Q, R)
    np.testing.assert_allclose(result.sx.value(0.8), 0.0, atol=1e-9)
    assert np.abs(result.sx.value(0.7)).max() > 0.05


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
