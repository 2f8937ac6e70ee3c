"""Trajectories made of several other trajectories."""

from __future__ import annotations

import bisect
import functools
import itertools
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._scalars import is_symbolic
from sheldrake.common.kernel import MISFIT
from sheldrake.trajectories._base import Trajectory, kept
from sheldrake.trajectories._derivative_trajectory import DerivativeTrajectory, _expect_trajectories
from sheldrake.trajectories._piecewise import PiecewiseTrajectory
from sheldrake.trajectories._piecewise_polynomial import PiecewisePolynomial

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sheldrake.common._types import Scalar
    from sheldrake.common.calls import Query


_MANY = 16
"""Times that are worth being put in groups, one for each segment."""


class StackedTrajectory(Trajectory):
    """Several trajectories one below the other, or side by side.

    Args:
        rowwise: One below the other.
    """

    _MAKES_ARRAYS = _HAS_QUERIES = True

    def __init__(self, rowwise: bool = True):
        self._rowwise = bool(rowwise)
        self._children: list[Trajectory] = []

    def rowwise(self) -> bool:
        """Whether they stand one below the other."""
        return self._rowwise

    def children(self) -> list[Trajectory]:
        """The trajectories, in their order."""
        return list(self._children)

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
        self._changed()

    def _make_query(self, order: int) -> Query | None:
        if self._T is not float or not self._children:
            return None
        children, axis, join = self._children, 0 if self._rowwise else 1, np.concatenate
        asks = [functools.partial(c.EvalDerivative, derivative_order=order) if order else c.value for c in children]

        def ask(t: float) -> np.ndarray | int:
            return join([one(t) for one in asks], axis) if isinstance(t, float) else MISFIT

        return ask

    def _make_query_of_many(self, key: str) -> Query | None:
        if self._T is not float or not self._children or (self.cols() if self._rowwise else self.rows()) != 1:
            return None
        children, axis = self._children, 0 if self._rowwise else 1

        def ask(times: np.ndarray) -> np.ndarray | None:
            if type(times) is not np.ndarray or times.ndim != 1 or times.dtype != float:
                return None
            return np.concatenate([child.vector_values(times) for child in children], axis)

        return ask

    def _join(self, parts: list) -> np.ndarray:
        if not parts:
            return self._zeros(0, 0)
        return np.concatenate(parts, axis=0 if self._rowwise else 1)

    def do_value(self, t: Scalar) -> np.ndarray:
        """All values, stacked."""
        return self._join([c.value(t) for c in self._children])

    def do_rows(self) -> int:
        rows = [c.rows() for c in self._children]
        return (sum(rows) if self._rowwise else rows[0]) if rows else 0

    def do_cols(self) -> int:
        cols = [c.cols() for c in self._children]
        return (cols[0] if self._rowwise else sum(cols)) if cols else 0

    def do_start_time(self) -> float:
        return self._children[0].start_time() if self._children else self._scalar("", 0.0)

    def do_end_time(self) -> float:
        return self._children[0].end_time() if self._children else self._scalar("", 0.0)

    def do_has_derivative(self) -> bool:
        """Whether all have derivatives."""
        return all(c.has_derivative() for c in self._children)

    def DoEvalDerivative(self, t: Scalar, derivative_order: int) -> np.ndarray:
        """All derivatives, stacked."""
        return self._join([c.EvalDerivative(t, derivative_order) for c in self._children])

    def DoMakeDerivative(self, derivative_order: int) -> Trajectory:
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

    _MAKES_ARRAYS = _HAS_QUERIES = True

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

    def _clamped(self, t: Scalar) -> Scalar:
        start: Any = self.start_time()
        end: Any = self.end_time()
        if is_symbolic(self._T):
            return end.min(start.max(t))
        if t < start:
            return start
        return end if t > end else t

    def _make_query(self, order: int) -> Query | None:
        if self._T is not float or order > 1:
            return None
        path, scaling, first, last = self._path, self._scaling, self.start_time(), self.end_time()

        def ask(t: float) -> np.ndarray | int:
            if not isinstance(t, float):
                return MISFIT
            t = first if t < first else last if t > last else t
            s = scaling.value(t).item()
            return path.EvalDerivative(s) * scaling.EvalDerivative(t).item() if order else path.value(s)

        return ask

    def _make_query_of_many(self, key: str) -> Query | None:
        if self._T is not float:
            return None
        path, scaling, first, last = self._path, self._scaling, self.start_time(), self.end_time()

        def ask(times: np.ndarray) -> np.ndarray | None:
            if type(times) is not np.ndarray or times.ndim != 1 or times.dtype != float:
                return None
            return path.vector_values(scaling.vector_values(np.minimum(np.maximum(times, first), last))[0])

        return ask

    def do_value(self, t: Scalar) -> np.ndarray:
        """The path where s(t) is."""
        return self._path.value(self._scaling.value(self._clamped(t))[0, 0])

    def do_rows(self) -> int:
        return self._path.rows()

    def do_cols(self) -> int:
        return self._path.cols()

    def do_start_time(self) -> float:
        """The first time of s(t)."""
        return self._scaling.start_time()

    def do_end_time(self) -> float:
        """The last time of s(t)."""
        return self._scaling.end_time()

    def do_has_derivative(self) -> bool:
        """Whether both have derivatives."""
        return self._path.has_derivative() and self._scaling.has_derivative()

    def DoEvalDerivative(self, t: Scalar, derivative_order: int) -> np.ndarray:
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

    def DoMakeDerivative(self, derivative_order: int) -> Trajectory:
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

    _MAKES_ARRAYS = _HAS_QUERIES = True

    def __init__(self, segments: Sequence[Trajectory]):
        self._join([kept(p) for p in _expect_trajectories(self, segments)])

    def _join(self, parts: list) -> None:
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
        self._parts: list[Trajectory] = parts
        self._breaks = [p.start_time() for p in parts] + [p.end_time() for p in parts[-1:]]
        self._check_increasing(self._breaks)

    @classmethod
    @checked
    def AlignAndConcatenate(cls, segments: Sequence[Trajectory]) -> CompositeTrajectory:
        """Returns the trajectories one after the other, each moved in time to begin when the one before ends.

        Raises:
            RuntimeError: there is none, or shapes differ.
        """
        parts = _expect_trajectories(cls, segments)
        if not parts:
            raise RuntimeError(f"{cls._name('AlignAndConcatenate')}: there are no segments.")
        aligned = [kept(parts[0])]
        for p in parts[1:]:
            start = aligned[-1].end_time()
            if not is_symbolic(cls._T) and p.start_time() == start:
                aligned.append(kept(p))
                continue
            end = start + (p.end_time() - p.start_time())
            shift = PiecewisePolynomial._template[cls._T].FirstOrderHold([start, end], [[p.start_time(), p.end_time()]])
            aligned.append(PathParameterizedTrajectory._template[cls._T](p, shift))
        out = object.__new__(cls._template[cls._T])
        out._join(aligned)
        return out

    @checked
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

    def _make_query(self, order: int) -> Query | None:
        if self._T is not float or not self._parts:
            return None
        first, last, breaks, n = self._breaks[0], self._breaks[-1], self._breaks, len(self._parts)
        asks = [functools.partial(p.EvalDerivative, derivative_order=order) if order else p.value for p in self._parts]

        def ask(t: float) -> np.ndarray | int:
            if not isinstance(t, float):
                return MISFIT
            t = first if t < first else last if t > last else t
            return asks[bisect.bisect_right(breaks, t, 1, n) - 1](t)

        return ask

    def _make_query_of_many(self, key: str) -> Query | None:
        if self._T is not float or not self._parts:
            return None
        parts, breaks, along = self._parts, np.array(self._breaks), 1 if self.cols() == 1 else 0

        def ask(times: np.ndarray) -> np.ndarray | None:
            if type(times) is not np.ndarray or times.ndim != 1 or times.dtype != float or times.size < _MANY:
                return None
            if not (times[1:] >= times[:-1]).all():
                return None
            inside = np.minimum(np.maximum(times, breaks[0]), breaks[-1])
            cuts = [0, *np.searchsorted(inside, breaks[1:-1]).tolist(), times.size]
            spans = [(part, a, b) for part, a, b in zip(parts, cuts, cuts[1:]) if a < b]
            return np.concatenate([part.vector_values(inside[a:b]) for part, a, b in spans], axis=along)

        return ask

    def do_value(self, t: Scalar) -> np.ndarray:
        """The value of the segment at time t."""
        return self._part(t).value(self._clamped(t))

    def do_rows(self) -> int:
        return self._first("rows").rows()

    def do_cols(self) -> int:
        return self._first("columns").cols()

    def _first(self, what: str) -> Trajectory:
        if not self._parts:
            raise RuntimeError(f"CompositeTrajectory has no segments. Number of {what} is undefined.")
        return self._parts[0]

    def do_has_derivative(self) -> bool:
        """Whether all segments have derivatives."""
        return all(p.has_derivative() for p in self._parts)

    def DoEvalDerivative(self, t: Scalar, derivative_order: int) -> np.ndarray:
        """The derivative of the segment at time t."""
        return self._part(t).EvalDerivative(self._clamped(t), derivative_order)

    def DoMakeDerivative(self, derivative_order: int) -> Trajectory:
        """The derivatives one after the other."""
        out = object.__new__(self._template[self._T])
        out._parts, out._breaks = [p.MakeDerivative(derivative_order) for p in self._parts], list(self._breaks)
        return out
