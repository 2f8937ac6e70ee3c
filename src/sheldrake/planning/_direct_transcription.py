"""Direct transcription: each state follows from the last by one step."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.planning._dynamics import Dynamics
from sheldrake.planning._multiple_shooting import MultipleShooting
from sheldrake.solvers import Constraint
from sheldrake.solvers._functions.evaluators import EvaluatorBase
from sheldrake.symbolic import Expression
from sheldrake.systems.framework import InputPortSelection
from sheldrake.systems.primitives import AffineSystem, LinearSystem
from sheldrake.trajectories import PiecewisePolynomial

if TYPE_CHECKING:
    from sheldrake.solvers import MathematicalProgramResult
    from sheldrake.systems.framework import Context, System

_FIRST = InputPortSelection.kUseFirstInputIfItExists


class DirectTranscriptionConstraint(Constraint):
    """x1 = f(x0, u), or x1 = x0 + h f(x0, u); of (u, x0, x1)."""

    _thread_safe = False

    def __init__(self, dynamics: Dynamics, time: float, step: float | None):
        self._dynamics, self._time, self._step = dynamics, time, step
        nx, nu = dynamics.num_states, dynamics.num_inputs
        self._set_sizes(nx, nu + 2 * nx)
        self._set_bounds(np.zeros(nx), np.zeros(nx))

    def _eval(self, z: np.ndarray) -> np.ndarray:
        u, x0, x1 = np.split(z, np.cumsum([self._dynamics.num_inputs, self._dynamics.num_states]))
        f = self._dynamics.value(x0, u, self._time)
        return x1 - (f if self._step is None else x0 + self._step * f)

    def _eval_with_jacobian(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        nx, nu = self._dynamics.num_states, self._dynamics.num_inputs
        u, x0, x1 = np.split(z, np.cumsum([nu, nx]))
        f, J = self._dynamics.value_and_slope(x0, u, self._time)
        h = 1.0 if self._step is None else self._step
        by_x0 = -h * J[:, :nx] - (0.0 if self._step is None else 1.0) * np.eye(nx)
        y = x1 - (f if self._step is None else x0 + h * f)
        return y, np.hstack((-h * J[:, nx:], by_x0, np.eye(nx)))

    def _jacobian(self, x: np.ndarray) -> np.ndarray:
        return self._eval_with_jacobian(x)[1]

    _eval_symbols = EvaluatorBase._eval_symbols
    _display = EvaluatorBase._display
    _latex = EvaluatorBase._latex


class TimeStep:
    """A time step [s]; says which constructor of DirectTranscription is meant.

    Args:
        value: The step.
    """

    def __init__(self, value: float):
        self.value = float(value)


TimeStep.__qualname__ = "DirectTranscription.TimeStep"


class DirectTranscription(MultipleShooting):
    """Trajectory optimization with states and inputs at samples; each state follows from the last.

    Called as `(system, context, num_time_samples, input_port_index)` for a system with one periodic discrete update, or
    `(system, context, num_time_samples, fixed_time_step, input_port_index)` for a continuous one, which takes steps of
    explicit Euler.

    Raises:
        RuntimeError: the system is of another kind.
    """

    TimeStep = TimeStep

    def __init__(
        self,
        system: System,
        context: Context,
        num_time_samples: int,
        fixed_time_step: Any = None,
        input_port_index: Any = _FIRST,
    ):
        if fixed_time_step is not None and not isinstance(fixed_time_step, TimeStep):
            fixed_time_step, input_port_index = None, fixed_time_step
        if fixed_time_step is None:
            period = _only_period(system, context)
        else:
            period = fixed_time_step.value
            if not context.has_only_continuous_state() or period <= 0.0:
                raise RuntimeError(
                    "This constructor is for continuous-time systems and a positive time step; discrete-time systems "
                    "bring their own."
                )
        self._discrete = fixed_time_step is None
        dynamics = Dynamics(system, context, input_port_index, self._discrete)
        self._set_up(dynamics.num_inputs, dynamics.num_states, num_time_samples, period, None, None)
        step = None if self._discrete else period
        for i in range(num_time_samples - 1):
            self._add_dynamics(system, dynamics, i, step)
        if dynamics.num_inputs:  # The last input has no effect.
            last = self.input(num_time_samples - 1)
            self._prog.AddLinearConstraint(np.array([a == b for a, b in zip(self.input(num_time_samples - 2), last)]))

    def _add_dynamics(self, system: System, dynamics: Dynamics, i: int, step: float | None) -> None:
        vars = np.concatenate((self.input(i), self.state(i), self.state(i + 1)))
        constraint = DirectTranscriptionConstraint(dynamics, i * self.fixed_time_step(), step)
        if not isinstance(system, (LinearSystem, AffineSystem)):
            self._prog.AddConstraint(constraint, vars)
            return
        y, J = constraint._eval_with_jacobian(np.zeros(len(vars)))
        nu = dynamics.num_inputs
        order = np.concatenate((vars[nu:], vars[:nu]))
        self._prog.AddLinearEqualityConstraint(np.hstack((J[:, nu:], J[:, :nu])), -y, order)

    def _add_running_cost(self, g: Expression) -> None:
        """Steps of explicit Euler."""
        self._add_costs(g * self.fixed_time_step(), range(self._N - 1), {})

    def ReconstructInputTrajectory(self, result: MathematicalProgramResult) -> PiecewisePolynomial:
        """Returns the inputs, constant between samples."""
        if not self._nu:
            return PiecewisePolynomial()
        return PiecewisePolynomial.ZeroOrderHold(self.GetSampleTimes(result), self.GetInputSamples(result))

    def ReconstructStateTrajectory(self, result: MathematicalProgramResult) -> PiecewisePolynomial:
        """Returns the states, constant between samples."""
        return PiecewisePolynomial.ZeroOrderHold(self.GetSampleTimes(result), self.GetStateSamples(result))


def _only_period(system: System, context: Context) -> float:
    timing = system.GetUniquePeriodicDiscreteUpdateAttribute() if context.has_only_discrete_state() else None
    if timing is None:
        raise RuntimeError(
            "This constructor is for discrete-time systems with a single unique update period. For continuous-time "
            "systems, you must use a different constructor that specifies the time steps."
        )
    return float(timing.period_sec())
