"""Bézier curves."""

from __future__ import annotations

import functools
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._scalars import is_symbolic
from sheldrake.common.quick import ANY, short_way
from sheldrake.trajectories._base import Trajectory
from sheldrake.trajectories._bspline import spline_query, spline_query_of_many
from sheldrake.trajectories._kernels.values import bezier

if TYPE_CHECKING:
    from sheldrake.common._types import Scalar, Scalars
    from sheldrake.common.calls import Query
    from sheldrake.symbolic import Variable

_NO_POINTS = np.zeros((0, 0))


class BezierCurve(Trajectory):
    """A vector that runs along a Bézier curve.

    Args:
        start_time: First time [s].
        end_time: Last time [s].
        control_points: Points as columns, shape `(rows, order + 1)`.

    Raises:
        RuntimeError: the end is before the start.
    """

    def __init__(self, start_time: Scalar = 0.0, end_time: Scalar = 1.0, control_points: Scalars = _NO_POINTS):
        self._times = (self._scalar("", start_time), self._scalar("", end_time))
        self._points = self._zeros(0, 0) if control_points is _NO_POINTS else self._matrix("", control_points)
        if not is_symbolic(self._T) and not self._times[1] >= self._times[0]:
            raise RuntimeError(f"{self._name('')}: the end, {end_time} s, is before the start, {start_time} s.")

    def order(self) -> int:
        """Returns the degree of the polynomials, -1 if there are no points."""
        return self._points.shape[1] - 1

    def control_points(self) -> np.ndarray:
        """Returns the points as columns, shape `(rows, order + 1)`."""
        return self._points.copy()

    @checked
    def BernsteinBasis(self, i: int, time: Scalar, order: int | None = None) -> Scalar:
        """Returns the weight of point i at a time [s], for this order or another; the polynomial goes on outside."""
        n = self.order() if order is None else int(order)
        start, end = self._times
        s = (self._scalar("BernsteinBasis", time) - start) / (end - start)
        return self._weight(i, n, s)

    @staticmethod
    def _weight(i: int, n: int, s: Scalar) -> Scalar:
        return math.comb(n, i) * _power(s, i) * _power(1.0 - s, n - i)

    def _unit(self, t: Scalar) -> Scalar:
        """Time from 0 at the start to 1 at the end."""
        start, end = self._times
        if is_symbolic(self._T):
            return (end.min(start.max(t)) - start) / (end - start)
        t = start if t < start else end if t > end else t
        return (t - start) / (end - start)

    def ElevateOrder(self) -> None:
        """Raises the order by one without changing the curve."""
        n, p = self.order(), self._points
        if n < 0:
            raise RuntimeError(f"{self._name('ElevateOrder')}: there are no control points.")
        self._changed()
        new = self._zeros(p.shape[0], n + 2)
        new[:, 0], new[:, n + 1] = p[:, 0], p[:, n]
        a = np.arange(1, n + 1) / (n + 1.0)
        new[:, 1:-1] = p[:, :-1] * a + p[:, 1:] * (1.0 - a)
        self._points = new

    @checked
    def AsLinearInControlPoints(self, derivative_order: int = 1) -> Any:
        """Returns M such that the points of the derivative are `control_points @ M`, as `scipy.sparse.csc_matrix`."""
        import scipy.sparse

        m = np.eye(self.order() + 1)
        duration = self._times[1] - self._times[0]
        for k in range(derivative_order):
            n = self.order() - k
            if n <= 0:
                m = np.zeros((self.order() + 1, 1))
                break
            step = np.zeros((n + 1, n))
            for j in range(n):
                step[j, j], step[j + 1, j] = -n / duration, n / duration
            m = m @ step
        return scipy.sparse.csc_matrix(m)

    @checked
    def GetExpression(self, time: Any = None) -> np.ndarray:
        """Returns the curve as expressions in a variable, shape `(rows,)`; if none is given, in one that all share."""
        from sheldrake.symbolic import Expression

        t = _shared_time() if time is None else time
        out = np.empty(self.do_rows(), dtype=object)
        n = self.order()
        start, end = (_plain(x) for x in self._times)
        s = (t - start) / (end - start) if (start, end) != (0.0, 1.0) else Expression(t)
        for row in range(len(out)):
            total = Expression(0.0)
            for power, c in enumerate(self._power_coefficients(row)):
                total = total + _plain(c) * s**power
            out[row] = total.Expand() if n >= 0 else total
        return out

    def _power_coefficients(self, row: int) -> list:
        """Coefficients of the powers of s, lowest first."""
        n, p = self.order(), self._points[row]
        out = []
        for k in range(n + 1):
            difference = sum((-1) ** (k - i) * math.comb(k, i) * p[i] for i in range(k + 1))
            out.append(math.comb(n, k) * difference)
        return out

    _MAKES_ARRAYS = _HAS_QUERIES = True

    def _make_query(self, order: int) -> Query | None:
        start, end = self._times
        if self._T is not float or self.order() < 0 or not start < end:
            return None
        points = self.DoMakeDerivative(order)._points.T.copy()
        return spline_query([start] * len(points) + [end] * len(points), points, (self.rows(), 1))

    def _make_query_of_many(self, key: str) -> Query | None:
        start, end = self._times
        if self._T is not float or self.order() < 0 or not start < end:
            return None
        points = self._points.T.copy()
        return spline_query_of_many([start] * len(points) + [end] * len(points), points, (self.rows(), 1))

    def do_value(self, t: Scalar) -> np.ndarray:
        """The point at time t."""
        n = self.order()
        if n < 0:
            return self._zeros(self._points.shape[0], 1)
        s = self._unit(t)
        if self._T is float:
            points, out = self._points, np.empty((self._points.shape[0], 1))
            if _value(np.ascontiguousarray(points).reshape(-1), s, out.reshape(-1)) is not None:
                return out
        terms = [self._points[:, i : i + 1] * self._weight(i, n, s) for i in range(n + 1)]
        return sum(terms[1:], terms[0])

    def do_rows(self) -> int:
        return self._points.shape[0]

    def do_cols(self) -> int:
        """One."""
        return 1

    def do_start_time(self) -> float:
        return self._times[0]

    def do_end_time(self) -> float:
        return self._times[1]

    def do_has_derivative(self) -> bool:
        """True."""
        return True

    def DoEvalDerivative(self, t: Scalar, derivative_order: int) -> np.ndarray:
        return self.DoMakeDerivative(derivative_order).value(t)

    def DoMakeDerivative(self, derivative_order: int) -> BezierCurve:
        """The derivative, a Bézier curve of lower order."""
        points, duration = self._points, self._times[1] - self._times[0]
        for k in range(derivative_order):
            n = self.order() - k
            if n < 1:
                points = self._zeros(points.shape[0], 1)
                break
            points = (points[:, 1:] - points[:, :-1]) * (n / duration)
        out = object.__new__(self._template[self._T])
        out._times, out._points = self._times, points
        return out


_value = short_way(globals(), "_value", bezier, ANY, float, ANY, gives=bool)


@functools.cache
def _shared_time() -> Variable:
    """Expressions of several curves go together in it, as in Drake."""
    from sheldrake.symbolic import Variable

    return Variable("t")


def _power(x: Scalar, n: int) -> Scalar:
    """x to a whole power; 1 to the power 0, whatever x is."""
    return x**n if n else x * 0.0 + 1.0


def _plain(x: Any) -> Any:
    """A number without its derivatives, a constant expression as a number; another expression as it is."""
    if hasattr(x, "derivatives"):
        return x.value()
    return x.Evaluate() if hasattr(x, "Evaluate") and x.GetVariables().empty() else x
