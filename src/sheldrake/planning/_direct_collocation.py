"""Direct collocation (Hargraves and Paris, 1987): cubic states, linear inputs, dynamics in the middle of each step."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, SupportsIndex

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.planning._dynamics import Dynamics
from sheldrake.planning._kernels.collocation import (
    CURVATURE,
    DEFECTS,
    MIDDLES,
    SAMPLES,
    SLOPES,
    WEIGHTS,
    Segments,
    collocate,
)
from sheldrake.planning._multiple_shooting import MultipleShooting
from sheldrake.solvers import Constraint, MathematicalProgram, _arrays
from sheldrake.solvers._functions.bindings import bind
from sheldrake.solvers._functions.evaluators import Opaque, WithSlopes
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


class _Memory:
    """Memory for so many segments, and the kernels bound to it.

    Args:
        nx: How many states there are.
        nu: How many inputs.
        count: How many segments.
        samples: How many samples at their ends.
    """

    def __init__(self, nx: int, nu: int, count: int, samples: int):
        n, width = nx + nu, 1 + 2 * nx + 2 * nu
        self.points = np.zeros((samples + count, n))  # samples, then middles
        self.samples, self.middles = self.points[:samples], self.points[samples:]
        self.work = Segments(
            z=np.full((count, width), np.nan), samples=self.samples, middles=self.middles,
            f=np.zeros((samples, nx)), J=np.zeros((samples, nx * n)),
            fm=np.zeros((count, nx)), Jm=np.zeros((count, nx * n)),
            defects=np.zeros((count, nx)), slopes=np.zeros((count, nx * width)),
            weights=np.zeros((count, nx)), point_weights=np.zeros((samples + count, nx)),
            point_curvature=np.zeros((samples + count, n * n)), curvature=np.zeros((count, width * width)),
            T=np.zeros((n, width)), HT=np.zeros((n, width)),
        )  # fmt: skip
        self._collocate = collocate.bind(self.work, nx, nu, SAMPLES)
        self.has_slopes = False

    def do(self, what: int) -> None:
        """Runs one of the kernels."""
        self._collocate.set("what", what)
        self._collocate()


class Defects:
    """By how much cubics between two samples have other slopes in their middle than the dynamics.

    Of many segments at once; each is a row (h, x0, x1, u0, u1).

    Args:
        dynamics: The dynamics.
    """

    def __init__(self, dynamics: Dynamics):
        self._dynamics = dynamics
        nx, nu = dynamics.num_states, dynamics.num_inputs
        self._ends = [np.concatenate((1 + e * nx + np.arange(nx), 1 + 2 * nx + e * nu + np.arange(nu))) for e in (0, 1)]
        self._memory: dict[tuple[int, int], _Memory] = {}

    def _at(self, z: np.ndarray, with_slopes: bool) -> _Memory:
        """Memory in which defects, and their slopes if they are wanted, are those of segments."""
        count, (first, second) = len(z), self._ends
        follow = count > 1 and np.array_equal(z[1:, first], z[:-1, second])  # then samples they share are taken once
        sizes = count, count + 1 if follow else 2 * count
        memory = self._memory.get(sizes)
        if memory is None:
            memory = self._memory[sizes] = _Memory(self._dynamics.num_states, self._dynamics.num_inputs, *sizes)
        work = memory.work
        is_known = np.array_equal(work.z, z)
        if not is_known or memory.has_slopes < with_slopes:
            work.z[:] = z
            memory.has_slopes = with_slopes
            memory.do(SAMPLES)
            self._evaluate(memory.samples, work.f, work.J, with_slopes)
            memory.do(MIDDLES)
            self._evaluate(memory.middles, work.fm, work.Jm, with_slopes)
            memory.do(DEFECTS)
            if with_slopes:
                memory.do(SLOPES)
        return memory

    def _evaluate(self, points: np.ndarray, f: np.ndarray, J: np.ndarray, with_slopes: bool) -> None:
        values, slopes = self._dynamics.at_points(points, with_slopes)
        f[:] = values
        if with_slopes:
            J[:] = slopes.reshape(J.shape)

    def values(self, z: np.ndarray) -> np.ndarray:
        """Defects, shape (segments, nx)."""
        return self._at(z, False).work.defects.copy()

    def slopes(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Defects, shape (segments, nx), and their derivatives, shape (segments, nx, 1 + 2 nx + 2 nu)."""
        work = self._at(z, True).work
        return work.defects.copy(), work.slopes.reshape(*work.defects.shape, z.shape[1]).copy()

    def hessian(self, z: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """Second derivatives of weights' defects, shape (segments, 1 + 2 nx + 2 nu, 1 + 2 nx + 2 nu).

        Those by a sample that segments share are in the later one.
        """
        memory = self._at(z, True)
        work = memory.work
        work.weights[:] = weights
        memory.do(WEIGHTS)
        found = self._dynamics.hessian_at_points(memory.points, work.point_weights)
        work.point_curvature[:] = found.reshape(work.point_curvature.shape)
        memory.do(CURVATURE)
        return work.curvature.reshape(len(z), z.shape[1], z.shape[1]).copy()


@checked
class DirectCollocationConstraint(Opaque, WithSlopes, Constraint):
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
        self._defects = Defects(self._dynamics)
        nx, nu = self._dynamics.num_states, self._dynamics.num_inputs
        self._set_sizes(nx, 1 + 2 * nx + 2 * nu)
        self._set_bounds(np.zeros(nx), np.zeros(nx))

    def _alike(self) -> Any:
        return "collocation", id(self._dynamics)

    def _many(self) -> Defects:
        return self._defects

    def _eval(self, z: np.ndarray) -> np.ndarray:
        return self._defects.values(z[None])[0]

    def _eval_with_jacobian(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        values, J = self._defects.slopes(z[None])
        return values[0], J[0]


@checked
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


@checked
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
        self._set_up(self._dynamics.num_inputs, self._dynamics.num_states, num_time_samples, None, prog)
        self.AddTimeIntervalBounds(minimum_time_step, maximum_time_step)
        bindings = parts_of(self._prog).bindings
        x, u = self._x_vars.reshape(num_time_samples, -1), self._u_vars.reshape(num_time_samples, self._nu)
        for i, vars in enumerate(np.hstack((self._h_vars[:, None], x[:-1], x[1:], u[:-1], u[1:]))):
            one = constraint._of_others(vars)  # so that each has its name; they share the dynamics
            one._description = f"collocation constraint for segment {i}"
            bindings.add(bind(Constraint, one, vars))

    def _add_running_cost(self, g: Expression) -> None:
        """The trapezoidal rule."""
        h, (before, after), last = self._h_vars, self._steps_around, self._N - 1
        self._add_costs(g * (0.5 * after), [0], {after: h[:1]})
        self._add_costs(g * (0.5 * (before + after)), range(1, last), {before: h[:-1], after: h[1:]})
        self._add_costs(g * (0.5 * before), [last], {before: h[-1:]})

    def ReconstructInputTrajectory(self, result: MathematicalProgramResult) -> PiecewisePolynomial:
        """Returns the inputs, linear between samples; empty if there are none."""
        if not self._nu:
            return PiecewisePolynomial()
        return PiecewisePolynomial.FirstOrderHold(self.GetSampleTimes(result), self.GetInputSamples(result))

    def ReconstructStateTrajectory(self, result: MathematicalProgramResult) -> PiecewisePolynomial:
        """Returns the states, cubic between samples, with the slopes of the dynamics."""
        x, u = self.GetStateSamples(result), self.GetInputSamples(result)
        xdot = np.stack([self._dynamics.value(x[:, i], u[:, i]) for i in range(self._N)], axis=1)
        return PiecewisePolynomial.CubicHermite(self.GetSampleTimes(result), x, xdot)
