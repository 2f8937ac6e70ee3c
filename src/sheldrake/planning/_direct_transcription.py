"""Direct transcription: each state follows from the last by one step."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.planning._dynamics import Dynamics
from sheldrake.planning._multiple_shooting import MultipleShooting
from sheldrake.solvers import Constraint, LinearEqualityConstraint
from sheldrake.solvers._functions.bindings import bind
from sheldrake.solvers._functions.evaluators import Opaque, WithSlopes
from sheldrake.symbolic import Expression
from sheldrake.systems.framework import InputPortSelection
from sheldrake.systems.primitives import AffineSystem, LinearSystem
from sheldrake.trajectories import PiecewisePolynomial

if TYPE_CHECKING:
    from sheldrake.solvers import MathematicalProgramResult
    from sheldrake.systems.framework import Context, System

_FIRST = InputPortSelection.kUseFirstInputIfItExists


class Steps:
    """By how much states behind steps are not what the dynamics make of those before, of many steps at once.

    Each is a row (u, x0, x1); the dynamics do not depend on time.

    Args:
        dynamics: The dynamics.
        step: Time step of explicit Euler [s]; None where x+ = f(x, u).
    """

    def __init__(self, dynamics: Dynamics, step: float | None):
        self._dynamics, self._step = dynamics, step
        nx, nu = dynamics.num_states, dynamics.num_inputs
        self._start, self._end = nu, nu + nx  # where x0 and x1 begin
        self._places = np.concatenate((nu + np.arange(nx), np.arange(nu)))  # of the points (x0, u) of the dynamics
        self._constant = np.zeros((nx, nu + 2 * nx))  # the derivatives that are always the same
        self._constant[:, self._end :] = np.eye(nx)
        if step is not None:
            self._constant[:, nu : self._end] = -np.eye(nx)
        self._factor = 1.0 if step is None else step

    def defects(self, z: np.ndarray, f: np.ndarray) -> np.ndarray:
        """Of values f of the dynamics."""
        x0, x1 = z[:, self._start : self._end], z[:, self._end :]
        return x1 - (f if self._step is None else x0 + self._step * f)

    def by_variables(self, J: np.ndarray) -> np.ndarray:
        """Derivatives of the defects from those of the dynamics by (x0, u), shape (steps, nx, nu + 2 nx)."""
        out = np.repeat(self._constant[None], len(J), axis=0)
        out[:, :, self._places] -= self._factor * J
        return out

    def values(self, z: np.ndarray) -> np.ndarray:
        """Defects, shape (steps, nx)."""
        return self.defects(z, self._dynamics.at_points(z[:, self._places], False)[0])

    def slopes(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Defects, shape (steps, nx), and their derivatives, shape (steps, nx, nu + 2 nx)."""
        f, J = self._dynamics.at_points(z[:, self._places], True)
        return self.defects(z, f), self.by_variables(J)

    def hessian(self, z: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """Second derivatives of weights' defects, shape (steps, nu + 2 nx, nu + 2 nx)."""
        out = np.zeros((len(z), z.shape[1], z.shape[1]))
        found = self._dynamics.hessian_at_points(z[:, self._places], -self._factor * weights)
        out[np.ix_(np.arange(len(z)), self._places, self._places)] = found
        return out


class DirectTranscriptionConstraint(Opaque, WithSlopes, Constraint):
    """x1 = f(x0, u), or x1 = x0 + h f(x0, u); of (u, x0, x1)."""

    _thread_safe = False

    def __init__(self, dynamics: Dynamics, time: float, step: float | None):
        self._dynamics, self._time, self._step = dynamics, time, step
        nx, nu = dynamics.num_states, dynamics.num_inputs
        self._set_sizes(nx, nu + 2 * nx)
        self._set_bounds(np.zeros(nx), np.zeros(nx))
        self._steps = Steps(dynamics, step)

    def _alike(self) -> Any:
        return None if self._dynamics.may_depend_on_time else ("transcription", id(self._dynamics), self._step)

    def _many(self) -> Steps:
        return self._steps

    def _eval(self, z: np.ndarray) -> np.ndarray:
        nx, nu = self._dynamics.num_states, self._dynamics.num_inputs
        return self._steps.defects(z[None], self._dynamics.value(z[nu : nu + nx], z[:nu], self._time))[0]

    def _eval_with_jacobian(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        nx, nu = self._dynamics.num_states, self._dynamics.num_inputs
        f, J = self._dynamics.value_and_slope(z[nu : nu + nx], z[:nu], self._time)
        return self._steps.defects(z[None], f)[0], self._steps.by_variables(J[None])[0]


class TimeStep:
    """A time step [s]; says which constructor of DirectTranscription is meant.

    Args:
        value: The step.
    """

    def __init__(self, value: float):
        self.value = float(value)


TimeStep.__qualname__ = "DirectTranscription.TimeStep"


@checked
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
        self._set_up(dynamics.num_inputs, dynamics.num_states, num_time_samples, period, None)
        step = None if self._discrete else period
        if isinstance(system, (LinearSystem, AffineSystem)):  # no others are known not to depend on time
            self._add_affine_dynamics(DirectTranscriptionConstraint(dynamics, 0.0, step))
        else:
            for i in range(num_time_samples - 1):
                constraint = DirectTranscriptionConstraint(dynamics, i * self.fixed_time_step(), step)
                self._prog.AddConstraint(constraint, np.concatenate((self.input(i), self.state(i), self.state(i + 1))))
        if dynamics.num_inputs:  # The last input has no effect.
            last = self.input(num_time_samples - 1)
            self._prog.AddLinearConstraint(np.array([a == b for a, b in zip(self.input(num_time_samples - 2), last)]))

    def _add_affine_dynamics(self, constraint: DirectTranscriptionConstraint) -> None:
        """The same equations for each step; of (x0, x1, u)."""
        y, J = constraint._eval_with_jacobian(np.zeros(constraint.num_vars()))
        nu, steps = self._nu, range(self._N - 1)
        equal = LinearEqualityConstraint(np.hstack((J[:, nu:], J[:, :nu])), -y)
        vars = np.array([np.concatenate((self.state(i), self.state(i + 1), self.input(i))) for i in steps])
        self._copies(bind(LinearEqualityConstraint, equal, vars[0]), dict(zip(vars[0], vars.T)))

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
