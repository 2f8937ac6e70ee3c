"""Direct collocation (Hargraves and Paris, 1987): cubic states, linear inputs, dynamics in the middle of each step."""

from __future__ import annotations

from typing import Any

import numpy as np

from sheldrake.planning._dynamics import Dynamics
from sheldrake.planning._multiple_shooting import MultipleShooting
from sheldrake.solvers import Constraint, MathematicalProgram, _arrays
from sheldrake.solvers._functions.evaluators import EvaluatorBase
from sheldrake.symbolic import Expression
from sheldrake.systems.framework import InputPortSelection
from sheldrake.trajectories import PiecewisePolynomial

_FIRST = InputPortSelection.kUseFirstInputIfItExists


def _check_context(context: Any, fixed_rest: bool) -> None:
    if context.num_continuous_states() <= 0:
        raise RuntimeError(
            "This system doesn't have any continuous states. DirectCollocation only makes sense for systems with "
            "continuous-time dynamics."
        )
    if not fixed_rest and not context.has_only_continuous_state():
        raise RuntimeError(
            "The system has states that are not continuous; set assume_non_continuous_states_are_fixed to keep them as "
            "they are in the context."
        )


class DirectCollocationConstraint(Constraint):
    """The slope of the cubic between two samples is the dynamics in their middle; of (h, x0, x1, u0, u1).

    Args:
        system: The system; it must convert to AutoDiffXd.
        context: Its parameters and other inputs.
        input_port_index: The input u.
        assume_non_continuous_states_are_fixed: Allow states that are not continuous.

    Raises:
        RuntimeError: the system has no continuous states, or others too.
    """

    _thread_safe = False

    def __init__(
        self,
        system: Any,
        context: Any,
        input_port_index: Any = _FIRST,
        assume_non_continuous_states_are_fixed: bool = False,
    ):
        _check_context(context, assume_non_continuous_states_are_fixed)
        self._dynamics = Dynamics(system, context, input_port_index, discrete=False)
        self._nx, self._nu = self._dynamics.num_states, self._dynamics.num_inputs
        self._set_sizes(self._nx, 1 + 2 * self._nx + 2 * self._nu)
        self._set_bounds(np.zeros(self._nx), np.zeros(self._nx))

    def _split(self, z: np.ndarray) -> tuple[Any, ...]:
        nx, nu = self._nx, self._nu
        X1, U0, U1 = 1 + nx, 1 + 2 * nx, 1 + 2 * nx + nu
        return z[0], z[1:X1], z[X1:U0], z[U0:U1], z[U1:]

    def _eval(self, z: np.ndarray) -> np.ndarray:
        h, x0, x1, u0, u1 = self._split(z)
        f0, f1 = self._dynamics.value(x0, u0), self._dynamics.value(x1, u1)
        middle = 0.5 * (x0 + x1) + h / 8.0 * (f0 - f1)
        slope = -1.5 * (x0 - x1) / h - 0.25 * (f0 + f1)
        return slope - self._dynamics.value(middle, 0.5 * (u0 + u1))

    def _eval_with_jacobian(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        h, x0, x1, u0, u1 = self._split(z)
        nx = self._nx
        f0, J0 = self._dynamics.value_and_slope(x0, u0)
        f1, J1 = self._dynamics.value_and_slope(x1, u1)
        difference, step = f0 - f1, x0 - x1
        fm, Jm = self._dynamics.value_and_slope(0.5 * (x0 + x1) + h / 8.0 * difference, 0.5 * (u0 + u1))
        A, half_B = Jm[:, :nx], 0.5 * Jm[:, nx:]
        # By x0 and x1: what the samples' slopes do to the defect, then what the samples themselves do.
        by_f0 = (-h / 8.0) * A
        by_f1 = -by_f0
        diagonal = np.arange(nx)
        by_f0[diagonal, diagonal] -= 0.25
        by_f1[diagonal, diagonal] -= 0.25
        by_0, by_1 = by_f0 @ J0, by_f1 @ J1
        D = np.empty((nx, z.size))
        X0, X1, U0, U1 = self._split(D.T)[1:]
        D[:, 0] = 1.5 / (h * h) * step - A @ difference / 8.0
        X0[:], X1[:] = (by_0[:, :nx] - 0.5 * A).T, (by_1[:, :nx] - 0.5 * A).T
        X0[diagonal, diagonal] -= 1.5 / h
        X1[diagonal, diagonal] += 1.5 / h
        U0[:], U1[:] = (by_0[:, nx:] - half_B).T, (by_1[:, nx:] - half_B).T
        return -1.5 / h * step - 0.25 * (f0 + f1) - fm, D

    def _jacobian(self, x: np.ndarray) -> np.ndarray:
        return self._eval_with_jacobian(x)[1]

    _eval_symbols = EvaluatorBase._eval_symbols
    _display = EvaluatorBase._display
    _latex = EvaluatorBase._latex


def AddDirectCollocationConstraint(
    constraint: DirectCollocationConstraint,
    time_step: Any,
    state: Any,
    next_state: Any,
    input: Any,
    next_input: Any,
    prog: MathematicalProgram,
) -> Any:
    """Adds a collocation constraint to a program, its variables in the right order."""
    parts = (time_step, state, next_state, input, next_input)
    return prog.AddConstraint(constraint, np.concatenate([_arrays.variable_vector(p) for p in parts]))


class DirectCollocation(MultipleShooting):
    """Trajectory optimization with cubic states and linear inputs between samples, exact to third order in the step.

    Args:
        system: The system; it must convert to AutoDiffXd.
        context: Its parameters and other inputs.
        num_time_samples: Number of samples.
        minimum_time_step: Least time between samples [s].
        maximum_time_step: Greatest time between samples [s].
        input_port_index: The input that is optimized.
        assume_non_continuous_states_are_fixed: Allow states that are not continuous.
        prog: The program to add to; a new one if absent.

    Raises:
        RuntimeError: the system has no continuous states, or others too.
    """

    def __init__(
        self,
        system: Any,
        context: Any,
        num_time_samples: int,
        minimum_time_step: float,
        maximum_time_step: float,
        input_port_index: Any = _FIRST,
        assume_non_continuous_states_are_fixed: bool = False,
        prog: MathematicalProgram | None = None,
    ):
        constraint = DirectCollocationConstraint(
            system, context, input_port_index, assume_non_continuous_states_are_fixed
        )
        self._dynamics = constraint._dynamics
        self._set_up(self._dynamics.num_inputs, self._dynamics.num_states, num_time_samples, None, None, prog)
        self.AddTimeIntervalBounds(minimum_time_step, maximum_time_step)
        for i in range(num_time_samples - 1):
            samples = (self.state(i), self.state(i + 1), self.input(i), self.input(i + 1))
            # One constraint each, so that each has its name; they share the dynamics.
            one = constraint.__class__.__new__(constraint.__class__)
            one.__dict__.update(constraint.__dict__)
            one.set_description(f"collocation constraint for segment {i}")
            AddDirectCollocationConstraint(one, self.time_step(i), *samples, self._prog)

    def _add_running_cost(self, g: Expression) -> None:
        """The trapezoidal rule."""
        last = self._N - 1
        for i in range(self._N):
            if i == 0:
                weight = 0.5 * self._h_vars[0]
            elif i == last:
                weight = 0.5 * self._h_vars[last - 1]
            else:
                weight = 0.5 * (self._h_vars[i - 1] + self._h_vars[i])
            self._prog.AddCost(self._substituted(g, i) * weight)

    def ReconstructInputTrajectory(self, result: Any) -> PiecewisePolynomial:
        """Returns the inputs, linear between samples; empty if there are none."""
        if not self._nu:
            return PiecewisePolynomial()
        return PiecewisePolynomial.FirstOrderHold(self.GetSampleTimes(result), self.GetInputSamples(result))

    def ReconstructStateTrajectory(self, result: Any) -> PiecewisePolynomial:
        """Returns the states, cubic between samples, with the slopes of the dynamics."""
        x, u = self.GetStateSamples(result), self.GetInputSamples(result)
        xdot = np.stack([self._dynamics.value(x[:, i], u[:, i]) for i in range(self._N)], axis=1)
        return PiecewisePolynomial.CubicHermite(self.GetSampleTimes(result), x, xdot)
