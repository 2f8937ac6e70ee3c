"""Integrators: the numbers that steer how the event loop integrates continuous state."""

from __future__ import annotations

import math
import operator
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._no_constructor import no_constructor
from sheldrake.systems.framework._kernels.integrate import RK3, Integrator, IntegratorNumbers
from sheldrake.systems.framework._kernels.program import Run, RunWords
from sheldrake.systems.framework._vector import plain

if TYPE_CHECKING:
    from sheldrake.systems.analysis._span import Span
    from sheldrake.systems.framework import Context
    from sheldrake.systems.framework._system import System
    from sheldrake.trajectories import PiecewisePolynomial

nan = float("nan")
H_MAX, H_MIN, H_IDEAL, H_INITIAL, ACCURACY, T_BREAK = map(
    operator.index,
    (
        IntegratorNumbers.h_max,
        IntegratorNumbers.h_min,
        IntegratorNumbers.h_ideal,
        IntegratorNumbers.h_initial,
        IntegratorNumbers.accuracy,
        IntegratorNumbers.t_break,
    ),
)
"""Where these are among the numbers."""
TAKEN = slice(operator.index(IntegratorNumbers.h_first), operator.index(IntegratorNumbers.h_largest) + 1)
"""Lengths of the steps that were taken."""
COUNTS = slice(operator.index(RunWords.evals), operator.index(RunWords.xc_steps) + 1)
"""What an integrator counts."""
_NOT_YET = np.full(3, nan).data


def _positive(call: str, number: Any) -> float:
    """A number that is greater than 0, or nan, which stands for the default."""
    value = float(plain(number))
    if value <= 0.0:
        raise RuntimeError(f"{call}(): it must be positive, not {value}.")
    return value


@no_constructor()
@checked
class IntegratorBase:
    """Integrates the continuous state of a system's context.

    Args:
        system: The system.
        context: Its context; may be given later by `reset_context`.
    """

    _scheme = RK3
    _order = 3.0
    _supports_error_estimation = True
    _name = "runge_kutta3"
    # Accuracy unless set, accuracy that no setting exceeds, and the first step as a fraction of the largest.
    _default_accuracy, _loosest_accuracy, _first_step = 1e-3, 0.1, 0.1

    def _set_up(self, system: System, context: Context | None) -> None:
        self._system, self._context = system, context
        self._numbers: Integrator = Integrator(np.zeros(IntegratorNumbers.SIZE))
        self._run: Any = Run(np.zeros(RunWords.SIZE, np.int64))
        self._number: Any = self._numbers.number.data  # which is faster than the array
        numbers = self._numbers
        numbers.scheme, numbers.order, numbers.throw_on_min = self._scheme, self._order, 1.0
        numbers.fixed = 0.0 if self._supports_error_estimation else 1.0
        numbers.t_break = np.inf
        self._maximum, self._accuracy, self._initial, self._minimum = nan, nan, nan, 0.0
        self._dense: list | None = None
        self._trajectory: tuple[int, Any] | None = None  # of so many steps
        self.ResetStatistics()

    # Settings.

    def set_maximum_step_size(self, max_step_size: float) -> None:
        """No step is longer than this [s], or only 1 % to reach an event.

        Raises:
            RuntimeError: it is not positive.
        """
        seconds = float(plain(max_step_size))
        if not seconds >= 0:
            raise RuntimeError(f"set_maximum_step_size(): must not be negative, got {max_step_size}.")
        self._maximum = self._numbers.h_max = seconds

    def get_maximum_step_size(self) -> float:
        """No step is longer than this [s]."""
        return self._maximum

    def set_target_accuracy(self, accuracy: float) -> None:
        """What error control aims at; with nan its default.

        Raises:
            RuntimeError: the integrator estimates no error, or it is not positive.
        """
        if not self._supports_error_estimation:
            raise RuntimeError("Integrator does not support accuracy estimation and user has requested error control")
        self._accuracy = _positive("set_target_accuracy", accuracy)
        self._use_accuracy()

    def get_target_accuracy(self) -> float:
        """What error control aims at; not a number until set."""
        return self._accuracy

    def get_accuracy_in_use(self) -> float:
        """What error control works with."""
        return float(self._numbers.accuracy)

    def _use_accuracy(self) -> None:
        wanted = self._default_accuracy if self._accuracy != self._accuracy else self._accuracy
        self._number[ACCURACY] = min(wanted, self._loosest_accuracy)

    def set_fixed_step_mode(self, flag: bool) -> None:
        """Whether to take steps of the maximum size, without error control.

        Raises:
            RuntimeError: asked to control errors that the integrator does not estimate.
        """
        if not flag and not self._supports_error_estimation:
            raise RuntimeError("Integrator does not support accuracy estimation")
        self._numbers.fixed = float(bool(flag))

    def get_fixed_step_mode(self) -> bool:
        """Whether steps have the maximum size, without error control."""
        return bool(self._numbers.fixed)

    def request_initial_step_size_target(self, step_size: float) -> None:
        """Length of the first step with error control [s]; with nan what the integrator thinks best.

        Raises:
            RuntimeError: the integrator estimates no error, or it is not positive.
        """
        if not self._supports_error_estimation:
            raise RuntimeError("Integrator does not support error estimation and user has initial step size target")
        self._initial = _positive("request_initial_step_size_target", step_size)

    def get_initial_step_size_target(self) -> float:
        """Length of the first step [s]."""
        return self._initial

    def set_requested_minimum_step_size(self, min_step_size: float) -> None:
        """Error control does not go below this [s].

        Raises:
            RuntimeError: it is negative or not finite.
        """
        seconds = float(plain(min_step_size))
        if not 0.0 <= seconds < math.inf:
            raise RuntimeError(
                f"set_requested_minimum_step_size(): min_step_size must be finite and not negative, not {seconds}."
            )
        self._minimum = self._numbers.h_min = seconds

    def get_requested_minimum_step_size(self) -> float:
        """Error control does not go below this [s]."""
        return self._minimum

    def get_working_minimum_step_size(self) -> float:
        """The shortest step that error control takes [s]."""
        t = 0.0 if self._context is None else float(plain(self._context.get_time()))
        return max(self._minimum, 1e-14 * max(1.0, abs(t)))

    def set_throw_on_minimum_step_size_violation(self, throws: bool) -> None:
        """Whether it is an error when the accuracy asks for a shorter step than the minimum."""
        self._numbers.throw_on_min = float(bool(throws))

    def get_throw_on_minimum_step_size_violation(self) -> bool:
        """Whether it is an error when the accuracy asks for a shorter step than the minimum."""
        return bool(self._numbers.throw_on_min)

    def get_context(self) -> Context | None:
        """The context it integrates."""
        return self._context

    get_mutable_context = get_context

    def reset_context(self, context: Context | None = None) -> None:
        """Changes the context, or forgets it; `Initialize` must be called before the next step."""
        self._context = context

    def Initialize(self) -> None:
        """Gets ready to step. How long the next step would best be stays known, as in Drake.

        Raises:
            RuntimeError: there is no context, or no maximum step size where it is needed.
        """
        if self._context is None:
            raise RuntimeError("Context has not been set.")
        if self._maximum != self._maximum:
            raise RuntimeError(
                "Neither initial step size target nor maximum step size has been set!"
                if self._supports_error_estimation
                else "Maximum step size has not been set!"
            )
        if self._supports_error_estimation and self._initial != self._initial:
            self._initial = self._first_step * self._maximum
        number = self._number
        number[H_MAX], number[H_MIN] = self._maximum, self._minimum
        number[H_INITIAL] = 0.0 if self._initial != self._initial else self._initial
        self._use_accuracy()
        self.ResetStatistics()

    def Reset(self) -> None:
        """Back to how it was made, but for accuracy, first step and what happens at the smallest step, as in Drake."""
        self._maximum, self._minimum = nan, 0.0
        self._numbers.fixed = 0.0 if self._supports_error_estimation else 1.0
        self._forget_step_size()
        self.ResetStatistics()

    def _forget_step_size(self) -> None:
        """The next step is as long as a first one."""
        self._numbers.h_ideal = 0.0

    def _memory(self) -> list[Any]:
        """What later steps depend on beside the context: numbers, arrays and None."""
        return [self._number[H_IDEAL]]  # the size it would like its next step to have [s]; 0 before the first

    def _remember(self, memory: list[Any]) -> None:
        """Takes up what an integrator of the same class knew; arrays may have become lists."""
        if type(memory[0]) is not float or not 0.0 <= memory[0] < np.inf:
            raise ValueError(f"{memory[0]!r} is no step size")
        self._numbers.h_ideal = memory[0]

    def _join(self, span: Span) -> None:
        """Gives a new event loop what this integrator has of its own."""

    def _make_step(self, span: Span) -> None:
        """Makes a step in Python, for schemes that are not in the event loop."""
        raise NotImplementedError

    # Dense output.

    def StartDenseIntegration(self) -> None:
        """Keeps the trajectory of the continuous state from now on.

        Raises:
            RuntimeError: it is kept already, or there is no continuous state.
        """
        if self._dense is not None:
            raise RuntimeError("StartDenseIntegration(): dense integration has been started already.")
        if self._context is None or not self._context.num_continuous_states():
            raise RuntimeError("StartDenseIntegration(): there is no continuous state to integrate.")
        self._dense = []

    def get_dense_output(self) -> PiecewisePolynomial | None:
        """The trajectory kept so far (a PiecewisePolynomial), or None if none is kept."""
        if self._dense is None:
            return None
        if self._trajectory is None or self._trajectory[0] != len(self._dense):
            self._trajectory = len(self._dense), _piecewise(self._dense)
        return self._trajectory[1]

    def StopDenseIntegration(self) -> PiecewisePolynomial | None:
        """The trajectory kept, which ends here.

        Raises:
            RuntimeError: none was kept.
        """
        if self._dense is None:
            raise RuntimeError("StopDenseIntegration(): dense integration has not been started.")
        trajectory, self._dense, self._trajectory = self.get_dense_output(), None, None
        return trajectory

    def _keep_step(self, begin: float) -> None:
        """Adds the step that began at `begin` [s] to the trajectory."""
        assert self._context is not None
        store = self._context._store
        n, (x0, _), end = self._context.num_continuous_states(), store.layout.rk, float(store.S[0])
        if end <= begin:
            return
        first, slope = store.S[x0 : x0 + n].copy(), store.S[x0 + n : x0 + 2 * n].copy()
        last = self._context.get_continuous_state_vector().CopyToVector()
        end_slope = self._system.EvalTimeDerivatives(self._context).CopyToVector()
        assert self._dense is not None
        self._dense.append((begin, end, first, last, slope, end_slope))

    # Statistics.

    def ResetStatistics(self) -> None:
        """Begins counting anew."""
        self._number[TAKEN] = _NOT_YET
        self._run.word[COUNTS] = 0

    def get_actual_initial_step_size_taken(self) -> float:
        """Length of the first step [s]."""
        return float(self._numbers.h_first)

    def get_smallest_adapted_step_size_taken(self) -> float:
        """Length of the shortest step that error control chose [s]."""
        return float(self._numbers.h_smallest)

    def get_largest_step_size_taken(self) -> float:
        """Length of the longest step [s]."""
        return float(self._numbers.h_largest)

    def get_num_derivative_evaluations(self) -> int:
        """How often derivatives were computed."""
        return int(self._run.evals)

    def get_num_step_shrinkages_from_error_control(self) -> int:
        """How many steps were repeated shorter for their error."""
        return int(self._run.shrinks_error)

    def get_num_step_shrinkages_from_substep_failures(self) -> int:
        """How many steps were repeated shorter because they failed."""
        return int(self._run.shrinks_failure)

    def get_num_substep_failures(self) -> int:
        """How many steps failed."""
        return int(self._run.failures)

    def get_num_steps_taken(self) -> int:
        """How many steps were taken."""
        return int(self._run.xc_steps)

    def GetStatisticsSummary(self) -> list[tuple[str, int | float]]:
        """All statistics by name."""
        found: list[tuple[str, int | float]] = [("integrator_num_steps_taken", self.get_num_steps_taken())]
        if not self.get_fixed_step_mode():
            found += [
                ("integrator_actual_initial_step_size_taken", self.get_actual_initial_step_size_taken()),
                ("integrator_largest_step_size_taken", self.get_largest_step_size_taken()),
                ("integrator_smallest_adapted_step_size_taken", self.get_smallest_adapted_step_size_taken()),
                (
                    "integrator_num_step_shrinkages_from_error_control",
                    self.get_num_step_shrinkages_from_error_control(),
                ),
            ]
        return [*found, ("integrator_num_derivative_evaluations", self.get_num_derivative_evaluations())]

    def _print_more_statistics(self) -> None:
        """Prints what only some integrators count."""


def _piecewise(steps: list) -> PiecewisePolynomial:
    """Cubic pieces with the values and slopes at the ends of each step."""
    from sheldrake.trajectories import PiecewisePolynomial

    found = None
    for begin, end, *values in steps:
        x0, x1, v0, v1 = (np.asarray(v, float).reshape(-1, 1) for v in values)
        piece = PiecewisePolynomial.CubicHermite([begin, end], np.hstack([x0, x1]), np.hstack([v0, v1]))
        if found is None:
            found = piece
        else:
            found.ConcatenateInTime(piece)
    return PiecewisePolynomial() if found is None else found
