import numpy as np
import pytest

from sheldrake.examples import PendulumPlant
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.estimators import (
    DiscreteTimeSteadyStateKalmanFilter,
    LuenbergerObserver,
    SteadyStateKalmanFilter,
)
from sheldrake.systems.framework import DiagramBuilder
from sheldrake.systems.primitives import LinearSystem, Sine

A, B, C = np.array([[0.0, 1.0], [-1.0, -0.1]]), np.array([[0.0], [1.0]]), np.array([[1.0, 0.0]])
W, V = np.diag([1.0, 2.0]), np.array([[0.5]])


def plant(period=0.0):
    if period:
        return LinearSystem(np.eye(2) + period * A, period * B, C, np.zeros((1, 1)), period)
    return LinearSystem(A, B, C, np.zeros((1, 1)))


def test_kalman_gains_solve_their_riccati_equations():
    L = SteadyStateKalmanFilter(A, C, W, V)
    P = _covariance(L)
    np.testing.assert_allclose(A @ P + P @ A.T - P @ C.T @ np.linalg.inv(V) @ C @ P + W, 0.0, atol=1e-9)
    assert np.linalg.eigvals(A - L @ C).real.max() < 0.0
    Ad = np.eye(2) + 0.1 * A
    L = DiscreteTimeSteadyStateKalmanFilter(Ad, C, W, V)
    assert np.abs(np.linalg.eigvals(Ad - L @ C)).max() < 1.0


def _covariance(L):
    """The stationary covariance of the error under gain L, from Lyapunov's equation."""
    F = A - L @ C
    M = W + L @ V @ L.T
    n = 2
    K = np.kron(np.eye(n), F) + np.kron(F, np.eye(n))
    return np.linalg.solve(K, -M.ravel()).reshape(n, n)


def test_the_kalman_gain_has_the_least_error():
    best = _covariance(SteadyStateKalmanFilter(A, C, W, V))
    for seed in range(5):
        other = SteadyStateKalmanFilter(A, C, W, V) + 0.1 * np.random.default_rng(seed).normal(size=(2, 1))
        assert np.trace(_covariance(other)) > np.trace(best)


@pytest.mark.parametrize("period", [0.0, 0.1])
@pytest.mark.parametrize("how", ["linear", "context", "gain"])
def test_the_estimate_converges(period, how):
    system = plant(period)
    context = system.CreateDefaultContext()
    system.get_input_port().FixValue(context, [0.0])
    if how == "linear":
        observer = SteadyStateKalmanFilter(system, W, V)
    elif how == "context":
        observer = SteadyStateKalmanFilter(system, context, W, V)
    else:
        observer = LuenbergerObserver(system, context, [[1.0], [0.5]])
    builder = DiagramBuilder()
    builder.AddSystem(system)
    builder.AddSystem(observer)
    drive = builder.AddSystem(Sine(1.0, 2.0, 0.0, 1))
    builder.Connect(drive.get_output_port(0), system.get_input_port())
    builder.Connect(drive.get_output_port(0), observer.get_observed_system_input_input_port())
    builder.Connect(system.get_output_port(), observer.get_observed_system_output_input_port())
    simulator = Simulator(builder.Build())
    root = simulator.get_mutable_context()
    own = system.GetMyMutableContextFromRoot(root)
    (own.SetDiscreteState if period else own.SetContinuousState)([1.0, -1.0])
    simulator.AdvanceTo(25.0)
    kind = "get_discrete_state_vector" if period else "get_continuous_state_vector"
    true = getattr(own, kind)().CopyToVector()
    found = observer.get_estimated_state_output_port().Eval(observer.GetMyContextFromRoot(root))
    np.testing.assert_allclose(found, true, atol=1e-3)
    assert np.abs(true).max() > 0.05


def test_errors():
    system = plant()
    context, sine = system.CreateDefaultContext(), Sine(1.0, 1.0, 0.0, 1)
    for wrong, words in (
        (lambda: LuenbergerObserver(system, context, [[1.0, 2.0]]), "2 x 1"),
        (lambda: SteadyStateKalmanFilter(A, C, np.eye(3), V), "W must be 2 x 2"),
        (lambda: SteadyStateKalmanFilter(A, C, W, -V), "V must be positive definite"),
        (lambda: LuenbergerObserver(sine, sine.CreateDefaultContext(), [[1.0]]), "one output"),
    ):
        with pytest.raises(RuntimeError, match=words):
            wrong()


@pytest.mark.parametrize("period", [0.0, 0.1])
def test_the_first_estimate_is_zero_wherever_it_was_made(period):
    system = plant(period)
    context = system.CreateDefaultContext()
    (context.SetDiscreteState if period else context.SetContinuousState)([0.3, -0.2])
    observer = LuenbergerObserver(system, context, [[1.0], [0.5]])
    found = observer.get_estimated_state_output_port().Eval(observer.CreateDefaultContext())
    np.testing.assert_array_equal(found, [0.0, 0.0])


def test_an_observer_of_a_pendulum_moves_as_the_model_corrected():
    pendulum = PendulumPlant()
    context, gain = pendulum.CreateDefaultContext(), np.array([[3.0, 0.5], [0.2, 4.0]])
    observer = LuenbergerObserver(pendulum, context, gain)
    own, estimate = observer.CreateDefaultContext(), np.array([0.4, -0.3])
    own.SetContinuousState(estimate)
    observer.get_observed_system_output_input_port().FixValue(own, [0.5, 0.1])
    observer.get_observed_system_input_input_port().FixValue(own, [0.7])
    pendulum.get_input_port().FixValue(context, [0.7])
    context.SetContinuousState(estimate)
    expected = pendulum.EvalTimeDerivatives(context).CopyToVector() + gain @ ([0.5, 0.1] - estimate)
    np.testing.assert_allclose(observer.EvalTimeDerivatives(own).CopyToVector(), expected, rtol=1e-15)
