"""Linear systems whose matrices are trajectories: machine code for polynomials between breaks."""

from __future__ import annotations

import numpy as np
import pytest

from sheldrake.all import (
    BsplineBasis,
    BsplineTrajectory,
    PiecewisePolynomial,
    Simulator,
    TrajectoryAffineSystem,
    TrajectoryLinearSystem,
)
from sheldrake.common.kernel import Kernel
from sheldrake.systems.framework._declarations import Callback
from sheldrake.trajectories import FunctionHandleTrajectory

BREAKS = [0.0, 0.7, 1.5, 2.0]


def path(rows: int, cols: int, seed: int) -> PiecewisePolynomial:
    rng = np.random.default_rng(seed)
    samples = [rng.uniform(-1.0, 1.0, (rows, cols)) for _ in BREAKS]
    return PiecewisePolynomial.CubicShapePreserving(BREAKS, samples, True)


def coefficients(n: int = 3, m: int = 2, k: int = 2) -> list[PiecewisePolynomial]:
    shapes = (n, n), (n, m), (n, 1), (k, n), (k, m), (k, 1)
    return [path(*shape, seed) for seed, shape in enumerate(shapes)]


def kinds(context: object) -> set[type]:
    return {type(row.calc) for row in context._store.layout.rows}


def motion_and_output(system: object, t: float, x: np.ndarray, u: np.ndarray, period: float) -> tuple:
    context = system.CreateDefaultContext()
    context.SetTime(t)
    (context.SetDiscreteState if period else context.SetContinuousState)(x)
    system.get_input_port().FixValue(context, u)
    if period:
        motion = system.EvalUniquePeriodicDiscreteUpdate(context).get_vector(0).CopyToVector()
    else:
        motion = system.EvalTimeDerivatives(context).CopyToVector()
    return context, motion, system.get_output_port().Eval(context)


@pytest.mark.parametrize("t", [-1.0, 0.0, 0.3, 0.7, 1.9, 2.0, 5.0])
@pytest.mark.parametrize("period", [0.0, 0.1])
def test_motion_and_output(period, t):
    A, B, f0, C, D, y0 = parts = coefficients()
    x, u = np.array([0.3, -0.2, 1.0]), np.array([2.0, -1.0])
    system = TrajectoryAffineSystem(*parts, period)
    context, motion, output = motion_and_output(system, t, x, u, period)
    assert kinds(context) == {Kernel}
    np.testing.assert_allclose(motion, A.value(t) @ x + B.value(t) @ u + f0.value(t).ravel(), rtol=1e-14, atol=1e-15)
    np.testing.assert_allclose(output, C.value(t) @ x + D.value(t) @ u + y0.value(t).ravel(), rtol=1e-14, atol=1e-15)


@pytest.mark.parametrize("period", [0.0, 0.1])
def test_without_offsets(period):
    A, B, _, C, D, _ = coefficients()
    x, u = np.array([0.3, -0.2, 1.0]), np.array([2.0, -1.0])
    context, motion, output = motion_and_output(TrajectoryLinearSystem(A, B, C, D, period), 0.4, x, u, period)
    assert kinds(context) == {Kernel}
    np.testing.assert_allclose(motion, A.value(0.4) @ x + B.value(0.4) @ u, rtol=1e-14, atol=1e-15)
    np.testing.assert_allclose(output, C.value(0.4) @ x + D.value(0.4) @ u, rtol=1e-14, atol=1e-15)


def test_without_a_state_or_an_input():
    zero = PiecewisePolynomial(np.zeros((0, 0)))
    D, y0 = path(2, 1, 1), path(2, 1, 2)
    static = TrajectoryAffineSystem(
        zero, PiecewisePolynomial(np.zeros((0, 1))), PiecewisePolynomial(np.zeros((0, 1))),
        PiecewisePolynomial(np.zeros((2, 0))), D, y0,
    )  # fmt: skip
    context = static.CreateDefaultContext()
    context.SetTime(0.4)
    static.get_input_port().FixValue(context, [3.0])
    expected = (3.0 * D.value(0.4) + y0.value(0.4)).ravel()
    np.testing.assert_allclose(static.get_output_port().Eval(context), expected, rtol=1e-14)


def test_a_bspline_is_polynomial_between_its_knots():
    _, B, f0, C, D, y0 = coefficients(1, 1, 1)
    spline = BsplineTrajectory(BsplineBasis(4, 6, initial_parameter_value=0.0, final_parameter_value=2.0), [
        np.array([[v]]) for v in (0.1, -0.4, 0.8, 0.2, -1.0, 0.5)
    ])  # fmt: skip
    system = TrajectoryAffineSystem(spline, B, f0, C, D, y0)
    x, u = np.array([0.3]), np.array([2.0])
    context, motion, _ = motion_and_output(system, 1.1, x, u, 0.0)
    assert kinds(context) == {Kernel}
    expected = spline.value(1.1) @ x + B.value(1.1) @ u + f0.value(1.1).ravel()
    np.testing.assert_allclose(motion, expected, rtol=1e-13)


def test_functions_and_other_scalars_run_in_python():
    _, B, f0, C, D, y0 = parts = coefficients(1, 1, 1)
    function = FunctionHandleTrajectory(lambda t: np.array([[np.sin(t)]]), 1, 1)
    system = TrajectoryAffineSystem(function, B, f0, C, D, y0)
    x, u = np.array([0.3]), np.array([2.0])
    context, motion, _ = motion_and_output(system, 1.1, x, u, 0.0)
    assert kinds(context) == {Callback}
    np.testing.assert_allclose(motion, np.sin(1.1) * x + B.value(1.1) @ u + f0.value(1.1).ravel(), rtol=1e-14)
    assert kinds(TrajectoryAffineSystem(*parts).ToAutoDiffXd().CreateDefaultContext()) == {Callback}


def test_a_class_of_a_user_computes_its_own_coefficients():
    class Doubled(TrajectoryAffineSystem):
        def _at(self, name, t):
            return 2.0 * super()._at(name, t)

    parts = coefficients(1, 1, 1)
    x, u = np.array([0.3]), np.array([2.0])
    _, motion, _ = motion_and_output(Doubled(*parts), 1.1, x, u, 0.0)
    _, plain, _ = motion_and_output(TrajectoryAffineSystem(*parts), 1.1, x, u, 0.0)
    np.testing.assert_allclose(motion, 2.0 * plain, rtol=1e-14)


def test_a_simulation_follows_the_matrices():
    """x' = -t x: x = exp(-t² / 2)."""
    line = PiecewisePolynomial.FirstOrderHold([0.0, 2.0], [[0.0, -2.0]])
    zero, one = PiecewisePolynomial(np.zeros((1, 1))), PiecewisePolynomial(np.ones((1, 1)))
    system = TrajectoryAffineSystem(line, zero, zero, one, zero, zero)
    context = system.CreateDefaultContext()
    context.SetContinuousState([1.0])
    system.get_input_port().FixValue(context, [0.0])
    simulator = Simulator(system, context)
    simulator.get_mutable_integrator().set_target_accuracy(1e-8)
    simulator.AdvanceTo(2.0)
    np.testing.assert_allclose(context.get_continuous_state_vector()[0], np.exp(-2.0), rtol=1e-6)
