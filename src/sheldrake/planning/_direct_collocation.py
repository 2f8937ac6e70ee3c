"""Direct collocation (Hargraves and Paris, 1987): cubic states, linear inputs, dynamics in the middle of each step."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, SupportsIndex

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.planning._dynamics import Dynamics
from sheldrake.planning._multiple_shooting import MultipleShooting
from sheldrake.solvers import Constraint, MathematicalProgram, _arrays
from sheldrake.solvers._functions.bindings import bind
from sheldrake.solvers._functions.evaluators import EvaluatorBase
from sheldrake.solvers._program.parts import parts_of
from sheldrake.symbolic import Expression
from sheldrake.systems.framework import InputPortSelection
from sheldrake.trajectories import PiecewisePolynomial

if TYPE_CHECKING:
    from sheldrake.solvers import MathematicalProgramResult
    from sheldrake.solvers._functions.bindings import BindingBase
    from sheldrake.systems.framework import Context, System

_FIRST = InputPortSelection.kUseFirstInputIfItExists


def _check_context(context: Context, fixed_rest: bool) -> None:
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


class Defects:
    """By how much cubics between two samples have other slopes in their middle than the dynamics.

    Of many segments at once; each is a row (h, x0, x1, u0, u1).

    Args:
        dynamics: The dynamics.
    """

    def __init__(self, dynamics: Dynamics):
        self._dynamics = dynamics
        nx, nu = dynamics.num_states, dynamics.num_inputs
        self._nx = nx
        inputs = 1 + 2 * nx + np.arange(nu)
        self._first = np.concatenate((1 + np.arange(nx), inputs))
        self._second = np.concatenate((1 + nx + np.arange(nx), inputs + nu))
        self._known: tuple[np.ndarray, ...] = (np.zeros((0, 0)),)  # What slopes were made of, and where

    def _ends(self, z: np.ndarray, with_slopes: bool) -> tuple[np.ndarray, ...]:
        """f at the first and at the second samples, and the derivatives; samples that segments share are taken once."""
        first, second = z[:, self._first], z[:, self._second]
        if len(z) > 1 and np.array_equal(first[1:], second[:-1]):
            f, J = self._dynamics.at_points(np.vstack((first, second[-1:])), with_slopes)
            return f[:-1], J[:-1], f[1:], J[1:]
        f, J = self._dynamics.at_points(np.vstack((first, second)), with_slopes)
        return f[: len(z)], J[: len(z)], f[len(z) :], J[len(z) :]

    def _middle(self, z: np.ndarray, f0: np.ndarray, f1: np.ndarray) -> np.ndarray:
        middle = 0.5 * (z[:, self._first] + z[:, self._second])
        middle[:, : self._nx] += z[:, :1] / 8.0 * (f0 - f1)
        return middle

    def _slope(self, z: np.ndarray, f0: np.ndarray, f1: np.ndarray) -> np.ndarray:
        nx = self._nx
        return 1.5 * (z[:, 1 + nx : 1 + 2 * nx] - z[:, 1 : 1 + nx]) / z[:, :1] - 0.25 * (f0 + f1)

    def values(self, z: np.ndarray) -> np.ndarray:
        """Defects, shape (segments, nx)."""
        f0, _, f1, _ = self._ends(z, False)
        return self._slope(z, f0, f1) - self._dynamics.at_points(self._middle(z, f0, f1), False)[0]

    def slopes(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Defects, shape (segments, nx), and their derivatives, shape (segments, nx, 1 + 2 nx + 2 nu)."""
        f0, J0, f1, J1, fm, Jm, _, T = self._parts(z)
        D = -Jm @ T
        D[:, :, self._first] -= 0.25 * J0
        D[:, :, self._second] -= 0.25 * J1
        h, i = z[:, :1], np.arange(self._nx)
        D[:, :, 0] += 1.5 * (z[:, self._first[i]] - z[:, self._second[i]]) / (h * h)
        D[:, i, 1 + i] -= 1.5 / h
        D[:, i, 1 + self._nx + i] += 1.5 / h
        return self._slope(z, f0, f1) - fm, D

    def _parts(self, z: np.ndarray) -> tuple[np.ndarray, ...]:
        """The dynamics and their derivatives at both ends and in the middle, the middle, and its derivatives."""
        if not np.array_equal(self._known[0], z):
            f0, J0, f1, J1 = self._ends(z, True)
            middle = self._middle(z, f0, f1)
            fm, Jm = self._dynamics.at_points(middle, True)
            self._known = (z, f0, J0, f1, J1, fm, Jm, middle, self._by_middle(z, f0, f1, J0, J1))
        return self._known[1:]

    def _by_middle(self, z: np.ndarray, f0: np.ndarray, f1: np.ndarray, J0: np.ndarray, J1: np.ndarray) -> np.ndarray:
        """Derivatives of state and input in the middle, shape (segments, nx + nu, 1 + 2 nx + 2 nu)."""
        nx, n = self._nx, len(self._first)
        T = np.zeros((len(z), n, z.shape[1]))
        part = z[:, 0, None, None] / 8.0
        T[:, :nx, 0] = (f0 - f1) / 8.0
        T[:, :nx, self._first] = part * J0
        T[:, :nx, self._second] = -part * J1
        i = np.arange(n)
        T[:, i, self._first] += 0.5
        T[:, i, self._second] += 0.5
        return T

    def hessian(self, z: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """Second derivatives of weights' defects, shape (segments, 1 + 2 nx + 2 nu, 1 + 2 nx + 2 nu)."""
        nx, count = self._nx, len(z)
        _, J0, _, J1, _, Jm, middle, T = self._parts(z)
        by_middle = -(weights[:, None, :] @ Jm[:, :, :nx])[:, 0]
        h, i = z[:, :1], np.arange(nx)
        points = np.vstack((z[:, self._first], z[:, self._second], middle))
        bent = h / 8.0 * by_middle
        H0, H1, Hm = np.split(
            self._dynamics.hessian_at_points(
                points, np.vstack((bent - 0.25 * weights, -bent - 0.25 * weights, -weights))
            ),
            3,
        )
        H = T.transpose(0, 2, 1) @ Hm @ T
        H[np.ix_(np.arange(count), self._first, self._first)] += H0
        H[np.ix_(np.arange(count), self._second, self._second)] += H1
        # The step times the slopes of the samples, in the middle; and differences of the samples by the step.
        mixed = np.zeros((count, z.shape[1]))
        mixed[:, self._first] = (by_middle[:, None, :] @ J0)[:, 0] / 8.0
        mixed[:, self._second] = -(by_middle[:, None, :] @ J1)[:, 0] / 8.0
        mixed[:, 1 + i] += 1.5 / h**2 * weights
        mixed[:, 1 + nx + i] -= 1.5 / h**2 * weights
        H[:, 0, :] += mixed
        H[:, :, 0] += mixed
        H[:, 0, 0] += 3.0 * (weights * (z[:, 1 + nx : 1 + 2 * nx] - z[:, 1 : 1 + nx])).sum(axis=1) / h[:, 0] ** 3
        return H


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
        system: System,
        context: Context,
        input_port_index: InputPortSelection | SupportsIndex = _FIRST,
        assume_non_continuous_states_are_fixed: bool = False,
    ):
        _check_context(context, assume_non_continuous_states_are_fixed)
        self._dynamics = Dynamics(system, context, input_port_index, discrete=False)
        self._nx, self._nu = self._dynamics.num_states, self._dynamics.num_inputs
        self._set_sizes(self._nx, 1 + 2 * self._nx + 2 * self._nu)
        self._set_bounds(np.zeros(self._nx), np.zeros(self._nx))

    def _alike(self) -> Any:
        return "collocation", id(self._dynamics)

    def _many(self) -> Defects:
        return Defects(self._dynamics)

    def _eval(self, z: np.ndarray) -> np.ndarray:
        return self._many().values(z[None])[0]

    def _eval_with_jacobian(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        values, J = self._many().slopes(z[None])
        return values[0], J[0]

    def _jacobian(self, x: np.ndarray) -> np.ndarray:
        return self._eval_with_jacobian(x)[1]

    _eval_symbols = EvaluatorBase._eval_symbols
    _display = EvaluatorBase._display
    _latex = EvaluatorBase._latex


def AddDirectCollocationConstraint(
    constraint: DirectCollocationConstraint,
    time_step: np.ndarray,
    state: np.ndarray,
    next_state: np.ndarray,
    input: np.ndarray,
    next_input: np.ndarray,
    prog: MathematicalProgram,
) -> BindingBase[Constraint]:
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
        RuntimeError: the system has no continuous states, or others too; or the time steps are not 0 < least <=
            greatest < inf.
    """

    def __init__(
        self,
        system: System,
        context: Context,
        num_time_samples: int,
        minimum_time_step: float,
        maximum_time_step: float,
        input_port_index: InputPortSelection | SupportsIndex = _FIRST,
        assume_non_continuous_states_are_fixed: bool = False,
        prog: MathematicalProgram | None = None,
    ):
        if not 0.0 < minimum_time_step <= maximum_time_step < np.inf:
            raise RuntimeError(
                "DirectCollocation(): expected 0 < minimum_time_step <= maximum_time_step, which is finite; found "
                f"{minimum_time_step} and {maximum_time_step}."
            )
        constraint = DirectCollocationConstraint(
            system, context, input_port_index, assume_non_continuous_states_are_fixed
        )
        self._dynamics = constraint._dynamics
        self._set_up(self._dynamics.num_inputs, self._dynamics.num_states, num_time_samples, None, None, prog)
        self.AddTimeIntervalBounds(minimum_time_step, maximum_time_step)
        bindings = parts_of(self._prog).bindings
        for i in range(num_time_samples - 1):
            samples = (self.state(i), self.state(i + 1), self.input(i), self.input(i + 1))
            # One constraint each, so that each has its name; they share the dynamics.
            one = constraint.__class__.__new__(constraint.__class__)
            one.__dict__.update(constraint.__dict__)
            one._description = f"collocation constraint for segment {i}"
            bindings.add(bind(Constraint, one, np.concatenate((self._h_vars[i : i + 1], *samples))))

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

    @checked
    def ReconstructInputTrajectory(self, result: MathematicalProgramResult) -> PiecewisePolynomial:
        """Returns the inputs, linear between samples; empty if there are none."""
        if not self._nu:
            return PiecewisePolynomial()
        return PiecewisePolynomial.FirstOrderHold(self.GetSampleTimes(result), self.GetInputSamples(result))

    @checked
    def ReconstructStateTrajectory(self, result: MathematicalProgramResult) -> PiecewisePolynomial:
        """Returns the states, cubic between samples, with the slopes of the dynamics."""
        x, u = self.GetStateSamples(result), self.GetInputSamples(result)
        xdot = np.stack([self._dynamics.value(x[:, i], u[:, i]) for i in range(self._N)], axis=1)
        return PiecewisePolynomial.CubicHermite(self.GetSampleTimes(result), x, xdot)
