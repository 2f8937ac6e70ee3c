"""Trajectories made of other trajectories."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from sheldrake.common._names import pretty_class_name
from sheldrake.common._scalars import is_symbolic
from sheldrake.trajectories._base import Trajectory, _order, kept, no_derivatives
from sheldrake.trajectories._piecewise import PiecewiseTrajectory


def _expect_trajectories(owner: Any, given: Any) -> list:
    """The trajectories given.

    Raises:
        TypeError: one is none, or of another scalar type.
    """
    out = list(given)
    base = _template_of(owner)
    for t in out:
        if not isinstance(t, base):
            raise owner._mismatch("", pretty_class_name(base), t)
    return out


def _template_of(owner: Any) -> Any:
    return Trajectory._template[owner._T]


class DerivativeTrajectory(Trajectory):
    """The derivative of another trajectory, computed by that one when asked.

    Args:
        nominal: The trajectory to differentiate.
        derivative_order: How often.

    Raises:
        RuntimeError: the trajectory has no derivatives, or the order is negative.
    """

    def __init__(self, nominal: Trajectory, derivative_order: int = 1):
        (nominal,) = _expect_trajectories(self, [nominal])
        self._order = _order("DerivativeTrajectory", derivative_order)
        if not nominal.has_derivative():
            raise RuntimeError(f"{self._name('')}: {type(nominal).__name__} has no derivatives.")
        self._nominal = kept(nominal)

    def do_value(self, t: Any) -> Any:
        """The derivative at time t."""
        return self._nominal.EvalDerivative(t, self._order)

    def do_rows(self) -> int:
        """The number of rows."""
        return self._nominal.rows()

    def do_cols(self) -> int:
        """The number of columns."""
        return self._nominal.cols()

    def do_start_time(self) -> Any:
        """The first time."""
        return self._nominal.start_time()

    def do_end_time(self) -> Any:
        """The last time."""
        return self._nominal.end_time()

    def do_has_derivative(self) -> bool:
        """True."""
        return True

    def DoEvalDerivative(self, t: Any, derivative_order: int) -> Any:
        """The derivative at time t."""
        return self._nominal.EvalDerivative(t, self._order + derivative_order)

    def DoMakeDerivative(self, derivative_order: int) -> Any:
        """The derivative as a trajectory."""
        return type(self)(self._nominal, self._order + derivative_order)


class FunctionHandleTrajectory(Trajectory):
    """The values of a function of time.

    Args:
        func: Gives the matrix (or vector) at a time [s].
        rows: Number of rows.
        cols: Number of columns.
        start_time: First time [s].
        end_time: Last time [s].
    """

    def __init__(self, func: Any, rows: int, cols: int = 1, start_time: Any = -np.inf, end_time: Any = np.inf):
        if not callable(func):
            raise self._mismatch("", "a function of time", func)
        self._func, self._derivative, self._shape = func, None, (int(rows), int(cols))
        self._times = (self._scalar("", start_time), self._scalar("", end_time))
        if not is_symbolic(self._T) and self._times[0] > self._times[1]:
            raise RuntimeError(f"{self._name('')}: the end, {end_time} s, is before the start, {start_time} s.")

    def set_derivative(self, func: Any) -> None:
        """Sets the function that gives the derivative at (time [s], order)."""
        self._derivative = func

    def do_value(self, t: Any) -> Any:
        """The function's value."""
        return self._checked("callback", self._func(t))

    def _checked(self, what: str, value: Any) -> np.ndarray:
        matrix = self._matrix("value", value)
        if matrix.shape != self._shape:
            raise RuntimeError(
                f"The FunctionHandleTrajectory {what} returned a matrix of size {matrix.shape[0]}x{matrix.shape[1]}, "
                f"but the constructor specified that the output should be of size {self._shape[0]}x{self._shape[1]}."
            )
        return matrix

    def do_rows(self) -> int:
        """The number of rows."""
        return self._shape[0]

    def do_cols(self) -> int:
        """The number of columns."""
        return self._shape[1]

    def do_start_time(self) -> Any:
        """The first time."""
        return self._times[0]

    def do_end_time(self) -> Any:
        """The last time."""
        return self._times[1]

    def do_has_derivative(self) -> bool:
        """Whether a derivative has been set."""
        return self._derivative is not None

    def DoEvalDerivative(self, t: Any, derivative_order: int) -> Any:
        """The derivative function's value."""
        if self._derivative is None:
            raise RuntimeError(f"{self._name('EvalDerivative')}: set_derivative() has not been called.")
        return self._checked("derivative callback", self._derivative(t, derivative_order))

    def DoMakeDerivative(self, derivative_order: int) -> Any:
        """The derivative as a trajectory."""
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

    def __init__(self, times: Any, values: Any, time_comparison_tolerance: float = 2.220446049250313e-16):
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

    def ToZeroOrderHold(self) -> Any:
        """Returns the trajectory that keeps each value until the next time."""
        from sheldrake.trajectories import PiecewisePolynomial_

        return PiecewisePolynomial_[self._T].ZeroOrderHold(self._times, self._values)

    def time_comparison_tolerance(self) -> float:
        """Returns how exactly a time must be hit [s]."""
        return self._tolerance

    def num_times(self) -> int:
        """Returns how many times there are."""
        return len(self._times)

    def get_times(self) -> list:
        """Returns the times [s]."""
        return list(self._times)

    def do_value(self, t: Any) -> np.ndarray:
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
        """The number of rows."""
        return self._values[0].shape[0] if self._values else 0

    def do_cols(self) -> int:
        """The number of columns."""
        return self._values[0].shape[1] if self._values else 0

    def do_start_time(self) -> Any:
        """The first time."""
        return self._times[0]

    def do_end_time(self) -> Any:
        """The last time."""
        return self._times[-1]

    def do_has_derivative(self) -> bool:
        """False."""
        return False

    def DoEvalDerivative(self, t: Any, derivative_order: int) -> Any:
        """There is none."""
        raise no_derivatives()

    def DoMakeDerivative(self, derivative_order: int) -> Any:
        """There is none."""
        raise no_derivatives()


class StackedTrajectory(Trajectory):
    """Several trajectories one below the other, or side by side.

    Args:
        rowwise: One below the other.
    """

    def __init__(self, rowwise: bool = True):
        self._rowwise = bool(rowwise)
        self._children: list[Trajectory] = []

    def Append(self, traj: Trajectory) -> None:
        """Adds a trajectory below, or to the right.

        Raises:
            RuntimeError: it spans another time than those before, or its other dimension differs.
        """
        (traj,) = _expect_trajectories(self, [traj])
        if self._children:
            first = self._children[0]
            mine, its = (first.start_time(), first.end_time()), (traj.start_time(), traj.end_time())
            if not is_symbolic(self._T) and mine != its:
                raise RuntimeError(f"{self._name('Append')}: it spans {its} s; those before span {mine} s.")
            a, b = (self.cols(), traj.cols()) if self._rowwise else (self.rows(), traj.rows())
            if a != b:
                raise RuntimeError(
                    f"{self._name('Append')}: it has {b} {'columns' if self._rowwise else 'rows'}; "
                    f"those before have {a}."
                )
        self._children = [*self._children, kept(traj)]

    def _join(self, parts: list) -> np.ndarray:
        if not parts:
            return self._zeros(0, 0)
        return np.concatenate(parts, axis=0 if self._rowwise else 1)

    def do_value(self, t: Any) -> np.ndarray:
        """All values, stacked."""
        return self._join([c.value(t) for c in self._children])

    def do_rows(self) -> int:
        """The number of rows."""
        rows = [c.rows() for c in self._children]
        return (sum(rows) if self._rowwise else rows[0]) if rows else 0

    def do_cols(self) -> int:
        """The number of columns."""
        cols = [c.cols() for c in self._children]
        return (cols[0] if self._rowwise else sum(cols)) if cols else 0

    def do_start_time(self) -> Any:
        """The first time."""
        return self._children[0].start_time() if self._children else self._scalar("", 0.0)

    def do_end_time(self) -> Any:
        """The last time."""
        return self._children[0].end_time() if self._children else self._scalar("", 0.0)

    def do_has_derivative(self) -> bool:
        """Whether all have derivatives."""
        return all(c.has_derivative() for c in self._children)

    def DoEvalDerivative(self, t: Any, derivative_order: int) -> np.ndarray:
        """All derivatives, stacked."""
        return self._join([c.EvalDerivative(t, derivative_order) for c in self._children])

    def DoMakeDerivative(self, derivative_order: int) -> Any:
        """The derivatives, stacked."""
        out = type(self)(self._rowwise)
        for c in self._children:
            out.Append(c.MakeDerivative(derivative_order))
        return out


class PathParameterizedTrajectory(Trajectory):
    """A path run through at a pace: the value at t is path(s(t)).

    Args:
        path: The path, a trajectory in s.
        time_scaling: s(t), a scalar trajectory.

    Raises:
        RuntimeError: the time scaling is not scalar.
    """

    def __init__(self, path: Trajectory, time_scaling: Trajectory):
        path, time_scaling = _expect_trajectories(self, [path, time_scaling])
        if (time_scaling.rows(), time_scaling.cols()) != (1, 1):
            raise RuntimeError(
                f"{self._name('')}: the time scaling must be scalar, it is {time_scaling.rows()} x "
                f"{time_scaling.cols()}."
            )
        self._path, self._scaling = kept(path), kept(time_scaling)

    def path(self) -> Trajectory:
        """Returns the path."""
        return self._path

    def time_scaling(self) -> Trajectory:
        """Returns s(t)."""
        return self._scaling

    def _clamped(self, t: Any) -> Any:
        start, end = self.start_time(), self.end_time()
        if is_symbolic(self._T):
            return end.min(start.max(t))
        if t < start:
            return start
        return end if t > end else t

    def do_value(self, t: Any) -> np.ndarray:
        """The path where s(t) is."""
        return self._path.value(self._scaling.value(self._clamped(t))[0, 0])

    def do_rows(self) -> int:
        """The number of rows."""
        return self._path.rows()

    def do_cols(self) -> int:
        """The number of columns."""
        return self._path.cols()

    def do_start_time(self) -> Any:
        """The first time of s(t)."""
        return self._scaling.start_time()

    def do_end_time(self) -> Any:
        """The last time of s(t)."""
        return self._scaling.end_time()

    def do_has_derivative(self) -> bool:
        """Whether both have derivatives."""
        return self._path.has_derivative() and self._scaling.has_derivative()

    def DoEvalDerivative(self, t: Any, derivative_order: int) -> np.ndarray:
        """The derivative by Faà di Bruno's formula, with partial Bell polynomials of the derivatives of s."""
        t = self._clamped(t)
        n = derivative_order
        s = self._scaling.value(t)[0, 0]
        ds = [self._scaling.EvalDerivative(t, k)[0, 0] for k in range(1, n + 1)]
        bell = _partial_bell(n, ds)
        out = self._path.EvalDerivative(s, 1) * bell[1]
        for k in range(2, n + 1):
            out = out + self._path.EvalDerivative(s, k) * bell[k]
        return out

    def DoMakeDerivative(self, derivative_order: int) -> Any:
        """The derivative as a trajectory."""
        return self._sibling(DerivativeTrajectory._template)(self, derivative_order)


def _partial_bell(n: int, x: list) -> list:
    """B[n, k] for k = 0 .. n, by B[n, k] = sum over i of binomial(n-1, i-1) x[i] B[n-i, k-1]."""
    table: list[list[Any]] = [[1.0] + [0.0] * n]
    for row in range(1, n + 1):
        values: list[Any] = [0.0]
        for k in range(1, n + 1):
            total: Any = 0.0
            weight = 1.0
            for i in range(1, row - k + 2):
                total = total + x[i - 1] * table[row - i][k - 1] * weight
                weight = weight * (row - i) / i
            values.append(total)
        table.append(values)
    return table[n]


class CompositeTrajectory(PiecewiseTrajectory):
    """Trajectories one after the other.

    Args:
        segments: Each begins when the one before ends.

    Raises:
        RuntimeError: times or shapes do not fit.
    """

    def __init__(self, segments: Any):
        parts = _expect_trajectories(self, segments)
        for a, b in itertools.pairwise(parts):
            if not is_symbolic(self._T) and b.start_time() != a.end_time():
                raise RuntimeError(
                    f"{self._name('')}: a segment begins at {b.start_time()} s, the one before ends at "
                    f"{a.end_time()} s."
                )
            if (a.rows(), a.cols()) != (b.rows(), b.cols()):
                raise RuntimeError(
                    f"{self._name('')}: segments of {a.rows()} x {a.cols()} and {b.rows()} x {b.cols()}."
                )
        self._parts = [kept(p) for p in parts]
        PiecewiseTrajectory.__init__(self, [p.start_time() for p in parts] + [p.end_time() for p in parts[-1:]])

    @classmethod
    def AlignAndConcatenate(cls, segments: Any) -> Any:
        """Returns the trajectories one after the other, each moved in time to begin when the one before ends.

        Raises:
            RuntimeError: there is none, or shapes differ.
        """
        from sheldrake.trajectories import PiecewisePolynomial_

        parts = list(segments)
        if not parts:
            raise RuntimeError(f"{cls._name('AlignAndConcatenate')}: there are no segments.")
        aligned = parts[:1]
        for p in parts[1:]:
            start = aligned[-1].end_time()
            if not is_symbolic(cls._T) and p.start_time() == start:
                aligned.append(p)
                continue
            end = start + (p.end_time() - p.start_time())
            shift = PiecewisePolynomial_[cls._T].FirstOrderHold([start, end], [[p.start_time(), p.end_time()]])
            aligned.append(PathParameterizedTrajectory._template[cls._T](p, shift))
        return cls._template[cls._T](aligned)

    def segment(self, segment_index: int) -> Trajectory:
        """Returns one of the trajectories."""
        return self._parts[self._segment(segment_index)]

    def _part(self, t: Any) -> Trajectory:
        if not self._parts:
            self._segment(0)
        if is_symbolic(self._T) and len(self._parts) > 1:
            t = self._scalar("value", t.Evaluate())
            return self._parts[self._index(t.Evaluate())]
        return self._parts[self._index(t)]

    def do_value(self, t: Any) -> np.ndarray:
        """The value of the segment at time t."""
        return self._part(t).value(self._clamped(t))

    def do_rows(self) -> int:
        """The number of rows."""
        return self._first("rows").rows()

    def do_cols(self) -> int:
        """The number of columns."""
        return self._first("columns").cols()

    def _first(self, what: str) -> Trajectory:
        if not self._parts:
            raise RuntimeError(f"CompositeTrajectory has no segments. Number of {what} is undefined.")
        return self._parts[0]

    def do_has_derivative(self) -> bool:
        """Whether all segments have derivatives."""
        return all(p.has_derivative() for p in self._parts)

    def DoEvalDerivative(self, t: Any, derivative_order: int) -> np.ndarray:
        """The derivative of the segment at time t."""
        return self._part(t).EvalDerivative(self._clamped(t), derivative_order)

    def DoMakeDerivative(self, derivative_order: int) -> Any:
        """The derivatives one after the other."""
        return type(self)([p.MakeDerivative(derivative_order) for p in self._parts])


class _WrappedTrajectory(Trajectory):
    """Another trajectory, passed through."""

    def __init__(self, trajectory: Trajectory):
        (self._nominal,) = _expect_trajectories(self, [trajectory])

    def unwrap(self) -> Trajectory:
        """Returns the other trajectory."""
        return self._nominal

    def do_value(self, t: Any) -> Any:
        """The other's value."""
        return self._nominal.value(t)

    def do_rows(self) -> int:
        """The other's rows."""
        return self._nominal.rows()

    def do_cols(self) -> int:
        """The other's columns."""
        return self._nominal.cols()

    def do_start_time(self) -> Any:
        """The other's first time."""
        return self._nominal.start_time()

    def do_end_time(self) -> Any:
        """The other's last time."""
        return self._nominal.end_time()

    def do_has_derivative(self) -> bool:
        """Whether the other has derivatives."""
        return self._nominal.has_derivative()

    def DoEvalDerivative(self, t: Any, derivative_order: int) -> Any:
        """The other's derivative."""
        return self._nominal.EvalDerivative(t, derivative_order)

    def DoMakeDerivative(self, derivative_order: int) -> Any:
        """The other's derivative."""
        return self._nominal.MakeDerivative(derivative_order)

    def __repr__(self) -> str:
        return f"{pretty_class_name(type(self))}({self._nominal!r})"
