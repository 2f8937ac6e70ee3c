"""Trajectories that are a function of time, or values at discrete times."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._scalars import is_symbolic
from sheldrake.trajectories._base import Trajectory, no_derivatives
from sheldrake.trajectories._derivative_trajectory import DerivativeTrajectory
from sheldrake.trajectories._piecewise_polynomial import PiecewisePolynomial

if TYPE_CHECKING:
    from collections.abc import Callable

    from sheldrake.common._types import Scalar, Scalars


class FunctionHandleTrajectory(Trajectory):
    """The values of a function of time.

    Args:
        func: Gives the matrix (or vector) at a time [s].
        rows: Number of rows.
        cols: Number of columns.
        start_time: First time [s].
        end_time: Last time [s].
    """

    def __init__(
        self,
        func: Callable[..., Any],
        rows: int,
        cols: int = 1,
        start_time: Scalar = -np.inf,
        end_time: Scalar = np.inf,
    ):
        if not callable(func):
            raise self._mismatch("", "a function of time", func)
        self._func, self._derivative, self._shape = func, None, (int(rows), int(cols))
        self._times = (self._scalar("", start_time), self._scalar("", end_time))
        if not is_symbolic(self._T) and self._times[0] > self._times[1]:
            raise RuntimeError(f"{self._name('')}: the end, {end_time} s, is before the start, {start_time} s.")
        with np.errstate(invalid="ignore"):  # a sine at minus infinity
            self.do_value(self._times[0])  # Fails now rather than in the middle of a simulation if the size is wrong.

    def set_derivative(self, func: Any) -> None:
        """Sets the function that gives the derivative at (time [s], order)."""
        if not (func is None or callable(func)):
            raise self._mismatch("set_derivative", "a function of time and order", func)
        self._derivative = func

    def do_value(self, t: Scalar) -> np.ndarray:
        """The function's value."""
        return self._checked("callback", self._func(t))

    def _checked(self, what: str, value: Scalars) -> np.ndarray:
        matrix = self._matrix("value", value)
        if matrix.shape != self._shape:
            raise RuntimeError(
                f"The FunctionHandleTrajectory {what} returned a matrix of size {matrix.shape[0]}x{matrix.shape[1]}, "
                f"but the constructor specified that the output should be of size {self._shape[0]}x{self._shape[1]}."
            )
        return matrix

    def do_rows(self) -> int:
        return self._shape[0]

    def do_cols(self) -> int:
        return self._shape[1]

    def do_start_time(self) -> float:
        return self._times[0]

    def do_end_time(self) -> float:
        return self._times[1]

    def do_has_derivative(self) -> bool:
        """Whether a derivative has been set."""
        return self._derivative is not None

    def DoEvalDerivative(self, t: Scalar, derivative_order: int) -> np.ndarray:
        """The derivative function's value."""
        if self._derivative is None:
            raise RuntimeError(f"{self._name('EvalDerivative')}: set_derivative() has not been called.")
        return self._checked("derivative callback", self._derivative(t, derivative_order))

    def DoMakeDerivative(self, derivative_order: int) -> Trajectory:
        return self._sibling(DerivativeTrajectory._template)(self, derivative_order)


class DiscreteTimeTrajectory(Trajectory):
    """Values at some times, and nowhere between.

    Args:
        times: When [s], increasing.
        values: A matrix for each time.
        time_comparison_tolerance: How exactly a time [s] must be hit.

    Raises:
        RuntimeError: numbers of times and values differ, times do not increase, or shapes differ.
    """

    @checked
    def __init__(self, times: Scalars, values: Any, time_comparison_tolerance: float = 2.220446049250313e-16):
        self._times = self._scalars("", times)
        self._values = [self._matrix("", v) for v in values]
        self._tolerance = float(time_comparison_tolerance)
        if len(self._times) != len(self._values):
            raise RuntimeError(f"{self._name('')}: {len(self._times)} times but {len(self._values)} values.")
        if self._tolerance < 0.0:
            raise RuntimeError(f"{self._name('')}: the tolerance must not be negative, got {self._tolerance} s.")
        if not is_symbolic(self._T):
            for a, b in zip(self._times, self._times[1:]):
                if b - a < self._tolerance or b <= a:
                    raise RuntimeError(f"{self._name('')}: times must increase; {b} s follows {a} s.")
        if len({v.shape for v in self._values}) > 1:
            raise RuntimeError(f"{self._name('')}: values differ in shape: { {v.shape for v in self._values} }.")

    def ToZeroOrderHold(self) -> PiecewisePolynomial:
        """Returns the trajectory that keeps each value until the next time."""
        return PiecewisePolynomial._template[self._T].ZeroOrderHold(self._times, self._values)

    def time_comparison_tolerance(self) -> float:
        """Returns how exactly a time must be hit [s]."""
        return self._tolerance

    def num_times(self) -> int:
        """Returns how many times there are."""
        return len(self._times)

    def get_times(self) -> list:
        """Returns the times [s]."""
        return list(self._times)

    def do_value(self, t: Scalar) -> np.ndarray:
        """The value at one of the times."""
        for time, value in zip(self._times, self._values):
            difference = time - t
            if is_symbolic(self._T):
                difference = difference.Evaluate()
            if abs(difference) <= self._tolerance:
                return value
        raise RuntimeError(
            f"Value requested at time {t} does not match any of the trajectory times within tolerance "
            f"{self._tolerance!r}."
        )

    def do_rows(self) -> int:
        return self._values[0].shape[0] if self._values else 0

    def do_cols(self) -> int:
        return self._values[0].shape[1] if self._values else 0

    def do_start_time(self) -> float:
        return self._times[0]

    def do_end_time(self) -> float:
        return self._times[-1]

    def do_has_derivative(self) -> bool:
        """False."""
        return False

    def DoEvalDerivative(self, t: Scalar, derivative_order: int) -> np.ndarray:
        """There is none."""
        raise no_derivatives()

    def DoMakeDerivative(self, derivative_order: int) -> Trajectory:
        """There is none."""
        raise no_derivatives()
