"""B-spline trajectories."""

from __future__ import annotations

import bisect
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._overloads import Mismatch
from sheldrake.common._scalars import any_array, is_symbolic
from sheldrake.math import BsplineBasis_
from sheldrake.trajectories._base import Trajectory, query, query_of_many
from sheldrake.trajectories._kernels.values import spline, spline_at_times

if TYPE_CHECKING:
    from sheldrake.common._types import Scalar, Scalars
    from sheldrake.common.calls import Query
    from sheldrake.math import BsplineBasis


def spline_query(knots: list, points: np.ndarray, shape: tuple[int, ...]) -> Query | None:
    """A query of a spline of plain numbers; `points` a row for each."""
    work = np.empty((len(knots) - len(points), points.shape[1]))
    return query(spline, np.array(knots), points, 0.0, work, out=np.empty(shape))


def spline_query_of_many(knots: list, points: np.ndarray, shape: tuple[int, int]) -> Query | None:
    """The same at many times, of values that are columns or rows."""
    work = np.empty((len(knots) - len(points), points.shape[1]))
    return query_of_many(spline_at_times, np.array(knots), points, work, shape=shape)


@checked
class BsplineTrajectory(Trajectory):
    """A matrix that follows a B-spline.

    Args:
        basis: The basis; its parameter is time [s].
        control_points: A matrix for each basis function; or one row of numbers, for scalar points.

    Raises:
        RuntimeError: another number of points than of basis functions, or points of different shapes.
    """

    _MAKES_ARRAYS = _HAS_QUERIES = True
    _derivative: tuple[int, list, BsplineTrajectory] | None = None
    """The derivative asked for last: its order, the points it is made of, and it."""

    def __init__(self, basis: Any = None, control_points: Any = None):
        self._basis, self._points = basis, []
        if basis is None:
            return
        if not isinstance(basis, BsplineBasis_[self._T]):
            raise self._mismatch("", "a BsplineBasis", basis)
        self._points = self._matrices(control_points)
        if len(self._points) != basis.num_basis_functions():
            raise RuntimeError(
                f"{self._name('')}: {len(self._points)} control points for {basis.num_basis_functions()} basis "
                "functions."
            )
        if len({p.shape for p in self._points}) > 1:
            raise RuntimeError(f"{self._name('')}: control points of shapes {sorted({p.shape for p in self._points})}.")

    def _matrices(self, given: Any) -> list[np.ndarray]:
        """Points as matrices; a matrix given is points as columns."""
        try:
            all_points = any_array(self._T, given)
        except Mismatch:
            return [self._matrix("", p) for p in given]
        if all_points.ndim == 2:
            return list(all_points.T[:, :, None])
        return list(all_points) if all_points.ndim == 3 else [self._matrix("", p) for p in given]

    def _require(self) -> BsplineBasis:
        if self._basis is None:
            raise RuntimeError(f"{self._name('')}: there are no control points.")
        return self._basis

    def basis(self) -> BsplineBasis:
        """Returns the basis."""
        return self._require()

    def control_points(self) -> list[np.ndarray]:
        """Returns the control points."""
        return [p.copy() for p in self._points]

    def num_control_points(self) -> int:
        """Returns how many control points there are."""
        return len(self._points)

    def InitialValue(self) -> np.ndarray:
        """Returns the matrix at the start."""
        return self.value(self.start_time())

    def FinalValue(self) -> np.ndarray:
        """Returns the matrix at the end."""
        return self.value(self.end_time())

    def _make_query(self, order: int) -> Query | None:
        if self._T is not float or self._basis is None:
            return None
        curve = self.DoMakeDerivative(order)
        points = np.array([p.ravel() for p in curve._points])
        return spline_query(curve._basis._knots, points, curve._points[0].shape)

    def _make_query_of_many(self, key: str) -> Query | None:
        if self._T is not float or self._basis is None:
            return None
        points = np.array([p.ravel() for p in self._points])
        return spline_query_of_many(self._basis._knots, points, self._points[0].shape)

    def do_value(self, t: Scalar) -> np.ndarray:
        """The matrix at time t, by de Boor's rule."""
        basis = self._require()
        t = self._inside(t)
        order, knots = basis._order, basis._knots
        i = self._interval(knots, order, t)
        if self._T is float:
            return self._plain_value(knots, order, i, t)
        d = [self._points[j] for j in range(i - order + 1, i + 1)]
        for r in range(1, order):
            for j in range(order - 1, r - 1, -1):
                left = knots[i - order + 1 + j]
                alpha = (t - left) / (knots[i + 1 + j - r] - left)
                d[j] = d[j - 1] * (1.0 - alpha) + d[j] * alpha
        return d[order - 1]

    def _plain_value(self, knots: list, order: int, i: int, t: Any) -> np.ndarray:
        """The same of plain numbers, element by element: there are few, and an array of them takes longer."""
        d = [self._points[j].ravel().tolist() for j in range(i - order + 1, i + 1)]
        for r in range(1, order):
            for j in range(order - 1, r - 1, -1):
                left = knots[i - order + 1 + j]
                alpha = (t - left) / (knots[i + 1 + j - r] - left)
                beta = 1.0 - alpha
                d[j] = [a * beta + b * alpha for a, b in zip(d[j - 1], d[j])]
        return np.array(d[order - 1]).reshape(self._points[0].shape)

    def _inside(self, t: Any) -> Scalar:
        start: Any = self.start_time()
        end: Any = self.end_time()
        if is_symbolic(self._T):
            return self._scalar("value", min(max(t.Evaluate(), start.Evaluate()), end.Evaluate()))
        return start if t < start else end if t > end else t

    @staticmethod
    def _interval(knots: list, order: int, t: Scalar) -> int:
        """The interval of knots that holds t: the last for the end of all."""
        if hasattr(t, "Evaluate"):
            t, knots = t.Evaluate(), [k.Evaluate() for k in knots]
        last = len(knots) - order - 1
        if type(t) is float:
            return bisect.bisect_right(knots, t, order, last + 1) - 1
        i = order - 1
        while i < last and t >= knots[i + 1]:
            i += 1
        return i

    def EvaluateLinearInControlPoints(self, parameter_value: Scalar, derivative_order: int = 0) -> np.ndarray:
        """Returns weights w such that the value, or a derivative, is the sum of w[i] times control point i."""
        n = self.num_control_points()
        if derivative_order == 0:
            return self._require()._weights(
                self._inside(self._scalar("EvaluateLinearInControlPoints", parameter_value))
            )
        units = [self._zeros(n, 1) for _ in range(n)]
        for i, unit in enumerate(units):
            unit[i, 0] = unit[i, 0] + 1.0
        return type(self)(self._require(), units).EvalDerivative(parameter_value, derivative_order)[:, 0]

    def AsLinearInControlPoints(self, derivative_order: int = 1) -> Any:
        """Returns M such that the derivative's control points are those here times M, as `scipy.sparse.csc_matrix`."""
        import scipy.sparse

        return scipy.sparse.csc_matrix(self._linear_in_control_points(derivative_order))

    def _linear_in_control_points(self, derivative_order: int) -> np.ndarray:
        n = self.num_control_points()
        probe = type(self)(self._require(), [row.reshape(-1, 1) for row in np.eye(n)])
        points = probe.DoMakeDerivative(derivative_order).control_points() if derivative_order else probe._points
        return np.hstack(points)

    def InsertKnots(self, additional_knots: Scalars) -> None:
        """Adds knots without changing the trajectory, by Boehm's rule (1980).

        Raises:
            RuntimeError: a knot is outside the trajectory's time.
        """
        for t in self._scalars("InsertKnots", additional_knots):
            self._insert_knot(t)

    def _insert_knot(self, t: Scalar) -> None:
        self._changed()
        order, knots = self._require().order(), list(self._basis.knots())
        if not is_symbolic(self._T) and not self.start_time() <= t <= self.end_time():
            raise RuntimeError(
                f"{self._name('InsertKnots')}: {t} s is outside {self.start_time()} .. {self.end_time()} s."
            )
        i = self._interval(knots, order, t)
        points = []
        for j in range(len(self._points) + 1):
            if j <= i - order + 1:
                points.append(self._points[j])
            elif j > i:
                points.append(self._points[j - 1])
            else:
                alpha = (t - knots[j]) / (knots[j + order - 1] - knots[j])
                points.append(self._points[j - 1] * (1.0 - alpha) + self._points[j] * alpha)
        self._points = points
        self._basis = BsplineBasis_[self._T](order, [*knots[: i + 1], t, *knots[i + 1 :]])

    def CopyBlock(self, start_row: int, start_col: int, block_rows: int, block_cols: int) -> BsplineTrajectory:
        """Returns the trajectory of a block of the matrix.

        Raises:
            RuntimeError: the block is not inside the matrix.
        """
        starts, sizes, shape = (start_row, start_col), (block_rows, block_cols), (self.rows(), self.cols())
        if any(not 0 <= start <= start + size <= n for start, size, n in zip(starts, sizes, shape)):
            raise RuntimeError(
                f"{self._name('CopyBlock')}: a block of {block_rows} x {block_cols} at {starts} is not inside "
                f"{shape[0]} x {shape[1]}."
            )
        rows, cols = slice(start_row, start_row + block_rows), slice(start_col, start_col + block_cols)
        return type(self)(self._require(), [p[rows, cols].copy() for p in self._points])

    def CopyHead(self, n: int) -> BsplineTrajectory:
        """Returns the trajectory of the first n elements of a column."""
        if self.cols() != 1 or not 0 < n <= self.rows():
            raise RuntimeError(f"{self._name('CopyHead')}: {n} elements of a {self.rows()} x {self.cols()} matrix.")
        return self.CopyBlock(0, 0, n, 1)

    def do_rows(self) -> int:
        self._require()
        return self._points[0].shape[0]

    def do_cols(self) -> int:
        self._require()
        return self._points[0].shape[1]

    def do_start_time(self) -> float:
        return self._require().initial_parameter_value()

    def do_end_time(self) -> float:
        return self._require().final_parameter_value()

    def do_has_derivative(self) -> bool:
        """True."""
        return True

    def DoEvalDerivative(self, t: Scalar, derivative_order: int) -> np.ndarray:
        known = self._derivative
        if known is None or known[0] != derivative_order or known[1] is not self._points:
            known = self._derivative = derivative_order, self._points, self.DoMakeDerivative(derivative_order)
        return known[2].value(t)

    def DoMakeDerivative(self, derivative_order: int) -> BsplineTrajectory:
        """The derivative, a B-spline of lower order."""
        order, knots, points = self._require().order(), self._basis.knots(), np.array(self._points)
        symbolic = is_symbolic(self._T)
        for _ in range(derivative_order):
            if order == 1:
                knots, points = [knots[0], knots[-1]], self._zeros(1, *points[0].shape)
                break
            spans = [b - a for a, b in zip(knots[1:], knots[order:-1])]
            # Of a basis function that repeated knots leave nothing any point will do.
            factors = [0.0 if not symbolic and span == 0.0 else (order - 1.0) / span for span in spans]
            points = (points[1:] - points[:-1]) * np.array(factors, points.dtype)[:, None, None]
            order, knots = order - 1, knots[1:-1]
        out = object.__new__(self._template[self._T])
        out._basis, out._points = BsplineBasis_[self._T]._of(order, knots), list(points)
        return out
