"""Piecewise polynomials in time."""

from __future__ import annotations

import itertools
from bisect import bisect_right
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._assert import ToleranceType
from sheldrake.common._checked import checked
from sheldrake.common._names import pretty_class_name
from sheldrake.common._overloads import Mismatch, expect
from sheldrake.common._scalars import any_array, as_scalar, is_symbolic
from sheldrake.polynomial import Polynomial, Polynomial_
from sheldrake.polynomial._polynomial import differentiate, evaluate, integrate
from sheldrake.trajectories import _interpolation as interpolation
from sheldrake.trajectories._base import _order, holds, query, query_of_many
from sheldrake.trajectories._kernels.values import polynomials, polynomials_at_times
from sheldrake.trajectories._piecewise import PiecewiseTrajectory

if TYPE_CHECKING:
    from sheldrake.common._types import Scalar, Scalars
    from sheldrake.common.calls import Query
    from sheldrake.trajectories._base import Trajectory

_NOT_GIVEN = object()


_MANY = 64
"""For so many times NumPy takes less time than a call for each."""
EPSILON_OF_A_JOINT = 1e-10
"""Ends and beginnings closer than this [s] are the same time."""


_FLAGS = (bool, np.bool_, int, np.integer, type(None))
"""What is taken for a bool where slopes may stand as well."""


class PiecewisePolynomial(PiecewiseTrajectory):
    """A matrix of polynomials in time for each segment between two breaks.

    Outside the breaks the value is that at the nearest break.

    Args:
        constant: A matrix, for one constant segment from minus to plus infinity; or ...
        polynomials: ... a list of polynomials, or of matrices of polynomials (arrays of objects), one a segment, each
            in the time since the segment's start;
        breaks: and times [s], one more than segments.
    """

    __fields__ = (
        SimpleNamespace(name="breaks", type=np.ndarray),
        SimpleNamespace(name="polynomials", type=np.ndarray),
    )

    def __init__(self, *args: Any):
        self._c: list[np.ndarray] = []
        if not args:
            PiecewiseTrajectory.__init__(self)
        elif len(args) == 1:
            if np.ndim(args[0]) == 0:
                raise self._mismatch("", "a matrix, or (polynomials, breaks)", args[0])
            self._c = [self._matrix("", args[0])[..., None]]
            self._breaks = [as_scalar(self._T, -np.inf), as_scalar(self._T, np.inf)]
        elif len(args) == 2:
            PiecewiseTrajectory.__init__(self, args[1])
            self._c = [self._from_polynomials(p) for p in args[0]]
            if len(self._c) != len(self._breaks) - 1:
                raise RuntimeError(
                    f"{self._name('')}: {len(self._c)} segments need {len(self._c) + 1} breaks, "
                    f"got {len(self._breaks)}."
                )
        else:
            raise self._mismatch("", "nothing, a matrix, or (polynomials, breaks)", args)

    @classmethod
    def _from_polynomials(cls, given: Scalars) -> np.ndarray:
        """The coefficients of a polynomial or a matrix of them, shape (rows, cols, n)."""
        family = Polynomial_[cls._T]
        matrix = np.asarray(given, dtype=object)
        if matrix.ndim < 2:
            matrix = matrix.reshape(-1, 1)
        for p in matrix.flat:
            if not isinstance(p, family):
                raise cls._mismatch("", f"matrices of {pretty_class_name(family)}", p)
        coefficients = [p.GetCoefficients() for p in matrix.flat]
        n = max(map(len, coefficients), default=1)
        out = cls._zeros(matrix.size, n)
        for row, c in zip(out, coefficients):
            row[: c.size] = c
        return out.reshape(*matrix.shape, n)

    @classmethod
    def _of(cls, coefficients: list[np.ndarray], breaks: list) -> PiecewisePolynomial:
        out = object.__new__(cls._template[cls._T])
        out._c, out._breaks = coefficients, list(breaks)
        return out

    # Values

    _MAKES_ARRAYS = _HAS_QUERIES = True

    def _make_query(self, order: int) -> Query | None:
        if self._T is not float or not self._c:
            return None
        breaks, c = np.array(self._breaks), differentiate(self.polynomials, order)
        rows, cols, n = c.shape[1:]
        if n > 1 and not np.isfinite(breaks).all():
            return None  # in Python a constant segment does not look at its time
        return query(polynomials, breaks, c.reshape(-1, n), 0.0, out=np.empty((rows, cols)))

    def _make_query_of_many(self, key: str) -> Query | None:
        if self._T is not float or not self._c or not np.isfinite(self._breaks).all():
            return None
        c = self.polynomials
        arrays = np.array(self._breaks), c.reshape(-1, c.shape[-1])
        return query_of_many(polynomials_at_times, *arrays, shape=c.shape[1:3])

    def do_value(self, t: Scalar) -> np.ndarray:
        if self._T is not float or not self._c:
            return self._at(t, 0)
        breaks = self._breaks
        last = len(breaks) - 1
        t = breaks[0] if t < breaks[0] else breaks[last] if t > breaks[last] else t
        i = bisect_right(breaks, t, 1, last) - 1
        c = self._c[i]
        return c[..., 0].copy() if c.shape[-1] == 1 else evaluate(c, t - breaks[i])

    def _at(self, t: Scalar, order: int) -> np.ndarray:
        if not self._c:
            self._segment(-1)
        t = self._clamped(t)
        if self._T is not float and is_symbolic(self._T) and len(self._c) > 1:
            return self._symbolic_at(t, order)
        i = self._index(t)
        c = self._c[i]
        if c.shape[-1] == 1:  # A constant may begin at minus infinity.
            return c[..., 0].copy() if order == 0 else c[..., 0] * 0.0
        return evaluate(c, t - self._breaks[i], order)

    def _symbolic_at(self, t: Scalar, order: int) -> np.ndarray:
        from sheldrake.symbolic import if_then_else

        out = evaluate(self._c[-1], t - self._breaks[-2], order)
        for i in reversed(range(len(self._c) - 1)):
            here = evaluate(self._c[i], t - self._breaks[i], order)
            condition = t < self._breaks[i + 1]
            for index in np.ndindex(out.shape):
                out[index] = if_then_else(condition, here[index], out[index])
        return out

    def _vector_values(self, times: list) -> np.ndarray:
        if self._T is not float or not self._c or len(times) < _MANY:
            return PiecewiseTrajectory._vector_values(self, times)
        t = np.clip(times, self._breaks[0], self._breaks[-1])
        segment = np.clip(np.searchsorted(self._breaks, t, side="right") - 1, 0, len(self._c) - 1)
        lengths = {c.shape[-1] for c in self._c}
        if len(lengths) == 1 and 1 not in lengths:  # all of one degree, and none constant: all times at once
            c = np.concatenate(self._c).reshape(len(self._c), -1, *lengths)[segment]
            return evaluate(c, (t - np.array(self._breaks)[segment])[:, None]).T.copy()
        out = np.empty((self.rows() * self.cols(), t.size))
        for i in np.unique(segment):
            here = segment == i
            c = self._c[i].reshape(-1, 1, self._c[i].shape[-1])
            out[:, here] = c[..., 0] if c.shape[-1] == 1 else evaluate(c, t[here] - self._breaks[i])
        return out

    def do_rows(self) -> int:
        return self._shape("rows")[0]

    def do_cols(self) -> int:
        return self._shape("columns")[1]

    def _shape(self, what: str) -> tuple[int, ...]:
        if not self._c:
            raise RuntimeError(f"PiecewisePolynomial has no segments. Number of {what} is undefined.")
        return self._c[0].shape[:2]

    def do_has_derivative(self) -> bool:
        """True."""
        return True

    def DoEvalDerivative(self, t: Scalar, derivative_order: int) -> np.ndarray:
        return self._at(t, derivative_order)

    def DoMakeDerivative(self, derivative_order: int) -> Trajectory:
        """The derivative, again piecewise polynomial."""
        return self.derivative(derivative_order)

    @checked
    def derivative(self, derivative_order: int = 1) -> PiecewisePolynomial:
        """Returns the derivative of the given order, again piecewise polynomial.

        Raises:
            RuntimeError: the order is negative.
        """
        order = _order("derivative", derivative_order)
        return self._of([differentiate(c, order) for c in self._c], self._breaks)

    def integral(self, value_at_start_time: Scalars = 0.0) -> PiecewisePolynomial:
        """Returns the integral from the start, again piecewise polynomial.

        Args:
            value_at_start_time: Its value at the start: a number, or a matrix of the shape of a value.
        """
        start = any_array(self._T, value_at_start_time)
        coefficients = []
        for i, c in enumerate(self._c):
            new = integrate(c, start)
            coefficients.append(new)
            start = evaluate(new, self._breaks[i + 1] - self._breaks[i])
        return self._of(coefficients, self._breaks)

    # Segments and their polynomials

    @checked
    def getPolynomialMatrix(self, segment_index: int) -> np.ndarray:
        """Returns the polynomials of a segment, in the time since its start, shape `(rows, cols)`."""
        c = self._c[self._segment(segment_index)]
        out = np.empty(c.shape[:2], dtype=object)
        for index in np.ndindex(out.shape):
            out[index] = Polynomial_[self._T]._of(c[index].copy())
        return out

    def getPolynomial(self, segment_index: int, row: int = 0, col: int = 0) -> Polynomial:
        """Returns one polynomial of a segment.

        Raises:
            RuntimeError: the matrix has no such element.
        """
        self._check_block("getPolynomial", row, col, 1, 1)
        return Polynomial_[self._T](self._c[self._segment(segment_index)][row, col])

    @checked
    def getSegmentPolynomialDegree(self, segment_index: int, row: int = 0, col: int = 0) -> int:
        """Returns the degree of one polynomial of a segment.

        Raises:
            RuntimeError: the matrix has no such element.
        """
        self._check_block("getSegmentPolynomialDegree", row, col, 1, 1)
        return self._c[self._segment(segment_index)][row, col].size - 1

    @checked
    def setPolynomialMatrixBlock(
        self, replacement: Any, segment_index: int, row_start: int = 0, col_start: int = 0
    ) -> None:
        """Replaces a block of the polynomials of a segment by a matrix of others."""
        self._changed()
        i = self._segment(segment_index)
        new, old = self._from_polynomials(replacement), self._c[i]
        rows, cols, n = new.shape
        self._check_block("setPolynomialMatrixBlock", row_start, col_start, rows, cols)
        both = self._zeros(*old.shape[:2], max(n, old.shape[-1]))
        both[..., : old.shape[-1]] = old
        both[row_start : row_start + rows, col_start : col_start + cols] = 0.0 * both[:1, :1, :1]
        both[row_start : row_start + rows, col_start : col_start + cols, :n] = new
        self._c[i] = both

    def _check_block(self, call: str, row: int, col: int, rows: int, cols: int) -> None:
        r, c = self._shape("rows")
        if min(row, col, rows, cols) < 0 or row + rows > r or col + cols > c:
            raise RuntimeError(
                f"{self._name(call)}: a block of {rows} x {cols} at ({row}, {col}) is not inside {r} x {c}."
            )

    @checked
    def Block(self, start_row: int, start_col: int, block_rows: int, block_cols: int) -> PiecewisePolynomial:
        """Returns the trajectory of a block of the matrix.

        Raises:
            RuntimeError: the block is not inside the matrix.
        """
        self._check_block("Block", start_row, start_col, block_rows, block_cols)
        rows, cols = slice(start_row, start_row + block_rows), slice(start_col, start_col + block_cols)
        return self._of([c[rows, cols].copy() for c in self._c], self._breaks)

    def Transpose(self) -> PiecewisePolynomial:
        """Returns the trajectory of the transposed matrix."""
        return self._of([c.transpose(1, 0, 2).copy() for c in self._c], self._breaks)

    def Reshape(self, rows: int, cols: int) -> None:
        """Gives the matrix another shape, elements in the order of columns.

        Raises:
            RuntimeError: the shape has another number of elements.
        """
        r, c = self._shape("rows")
        if rows * cols != r * c:
            raise RuntimeError(f"{self._name('Reshape')}: {r} x {c} elements do not make {rows} x {cols}.")
        self._changed()
        self._c = [
            np.stack([k.reshape(rows, cols, order="F") for k in np.moveaxis(c, -1, 0)], axis=-1) for c in self._c
        ]

    # Changes

    def AppendFirstOrderSegment(self, time: Scalar, sample: Scalars) -> None:
        """Adds a straight line from the end to a sample at a later time [s]."""
        end, h, y = self._next("AppendFirstOrderSegment", time, sample)
        self._changed()
        self._c += interpolation.linear(h, y)
        self._breaks.append(end)

    @checked
    def AppendCubicHermiteSegment(self, time: Scalar, sample: Scalars, sample_dot: Scalars) -> None:
        """Adds a cubic from the end, with its slope there, to a sample with a slope at a later time [s]."""
        end, h, y = self._next("AppendCubicHermiteSegment", time, sample)
        m = np.array([self._at_end(1), self._sample("AppendCubicHermiteSegment", sample_dot)])
        self._changed()
        self._c += interpolation.cubic(h, y, m)
        self._breaks.append(end)

    def _next(self, call: str, time: Scalar, sample: Scalars) -> tuple[Any, np.ndarray, np.ndarray]:
        """The end of a new segment, how long it lasts, and the values at both its ends."""
        y = self._sample(call, sample)
        end, start = self._scalar(call, time), self._breaks[-1]
        if not is_symbolic(self._T) and not end - start > 0.0:
            raise RuntimeError(f"{self._name(call)}: time {time} s is not after the end, {start} s.")
        return end, interpolation.durations([start, end], y), np.array([self._at_end(0), y])

    def _sample(self, call: str, sample: Scalars) -> np.ndarray:
        y, shape = self._matrix(call, sample), self._shape("rows")
        if y.shape != shape:
            raise RuntimeError(f"{self._name(call)}: the sample is {y.shape}, the trajectory {shape}.")
        return y

    def _at_end(self, order: int) -> np.ndarray:
        return evaluate(self._c[-1], self._breaks[-1] - self._breaks[-2], order)

    def RemoveFinalSegment(self) -> None:
        """Takes the last segment away."""
        self._shape("rows")
        self._changed()
        self._c.pop()
        self._breaks.pop()

    @checked
    def ConcatenateInTime(self, other: PiecewisePolynomial) -> None:
        """Adds the segments of another trajectory, which begins when this one ends.

        Raises:
            RuntimeError: it begins at another time, or has another shape.
        """
        self._changed()
        if not self._c:
            self._c, self._breaks = [c.copy() for c in other._c], list(other._breaks)
            return
        if other._shape("rows") != self._shape("rows"):
            raise RuntimeError(
                f"{self._name('ConcatenateInTime')}: the shapes are {self._shape('rows')} and {other._shape('rows')}."
            )
        offset = other.start_time() - self.end_time()
        if not is_symbolic(self._T) and abs(offset) > EPSILON_OF_A_JOINT * max(1.0, abs(self._plain_end())):
            raise RuntimeError(
                f"{self._name('ConcatenateInTime')}: the other begins at {other.start_time()} s, this one ends at "
                f"{self.end_time()} s."
            )
        self._c += [c.copy() for c in other._c]
        self._breaks += [b - offset for b in other._breaks[1:]]

    def _plain_end(self) -> float:
        end = self.end_time()
        return end.value() if hasattr(end, "value") else end

    def ReverseTime(self) -> None:
        """Runs backward: the value at -t is what it was at t."""
        self._changed()
        h = [b - a for a, b in itertools.pairwise(self._breaks)]
        self._c = [interpolation.reversed_in_time(c, d) for c, d in zip(self._c, h)][::-1]
        self._breaks = [-b for b in self._breaks][::-1]

    def ScaleTime(self, scale: Scalar) -> None:
        """Stretches time: the value at scale * t is what it was at t. The scale is positive."""
        scale = self._scalar("ScaleTime", scale)
        if not is_symbolic(self._T) and not scale > 0.0:
            raise RuntimeError(f"{self._name('ScaleTime')}: the scale must be positive, got {scale}.")
        self._changed()
        self._breaks = [b * scale for b in self._breaks]
        for i, c in enumerate(self._c):
            factor = as_scalar(self._T, 1.0)
            new = c.copy()
            for power in range(1, c.shape[-1]):
                factor = factor / scale
                new[..., power] = c[..., power] * factor
            self._c[i] = new

    def shiftRight(self, offset: Scalar) -> None:
        """Moves all breaks later by an offset [s]."""
        offset = self._scalar("shiftRight", offset)
        self._changed()
        self._breaks = [b + offset for b in self._breaks]

    @checked
    def slice(self, start_segment_index: int, num_segments: int) -> PiecewisePolynomial:
        """Returns the trajectory of some consecutive segments."""
        first = self._segment(start_segment_index)
        last = self._segment(first + num_segments - 1)
        return self._of([c.copy() for c in self._c[first : last + 1]], self._breaks[first : last + 2])

    @checked
    def isApprox(
        self, other: PiecewisePolynomial, tol: float, tol_type: ToleranceType = ToleranceType.kRelative
    ) -> bool:
        """Tells whether all breaks and coefficients agree; see `Polynomial.CoefficientsAlmostEqual`."""
        expect("isApprox", other, self._template[self._T])
        if len(self._c) != len(other._c) or (self._c and self._shape("rows") != other._shape("rows")):
            return False
        if any(holds(abs(a - b) > tol) for a, b in zip(self._breaks, other._breaks)):
            return False
        if self._T is float:
            relative = tol_type is ToleranceType.kRelative
            return all(_almost_equal(a, b, tol, relative) for a, b in zip(self._c, other._c))
        for i in range(len(self._c)):
            pairs = zip(self.getPolynomialMatrix(i).flat, other.getPolynomialMatrix(i).flat)
            if not all(holds(p.CoefficientsAlmostEqual(q, tol, tol_type)) for p, q in pairs):
                return False
        return True

    def __add__(self, other: PiecewisePolynomial) -> PiecewisePolynomial:
        if not isinstance(other, self._template[self._T]):
            return NotImplemented
        times_differ = any(holds(abs(a - b) > EPSILON_OF_A_JOINT) for a, b in zip(self._breaks, other._breaks))
        if len(self._c) != len(other._c) or times_differ:
            raise RuntimeError(f"{self._name('')}: adding needs the same breaks in both.")
        if self._c and self._shape("rows") != other._shape("rows"):
            shapes = self._shape("rows"), other._shape("rows")
            raise RuntimeError(
                f"{self._name('')}: adding needs matrices of one shape, got {shapes[0]} and {shapes[1]}."
            )
        out = []
        for a, b in zip(self._c, other._c):
            longer, shorter = (a, b) if a.shape[-1] >= b.shape[-1] else (b, a)
            total = longer.copy()
            total[..., : shorter.shape[-1]] = total[..., : shorter.shape[-1]] + shorter
            out.append(total)
        return self._of(out, self._breaks)

    # As data

    @property
    def breaks(self) -> np.ndarray:
        """The times [s] between the segments, shape `(n + 1,)`."""
        return np.array(self._breaks, dtype=float if self._T is float else object)

    @breaks.setter
    def breaks(self, value: Any) -> None:
        self._changed()
        self._breaks = self._scalars("breaks", value)

    @property
    def polynomials(self) -> np.ndarray:
        """All coefficients, shape `(n, rows, cols, degree + 1)`."""
        if not self._c:
            return self._zeros(0, 0, 0, 0)
        degree = max(c.shape[-1] for c in self._c)
        out = self._zeros(len(self._c), *self._shape("rows"), degree)
        for i, c in enumerate(self._c):
            out[i, ..., : c.shape[-1]] = c
        return out

    @polynomials.setter
    def polynomials(self, value: Any) -> None:
        self._changed()
        self._c = list(any_array(self._T, value))

    # ---- through samples; `_interpolation` solves for them

    @classmethod
    def _samples(cls, call: str, breaks: Scalars, samples: Scalars, least: int) -> tuple[list, np.ndarray]:
        """Breaks and samples, checked; samples of shape (n, rows, cols)."""
        times = cls._scalars(call, breaks)
        y = cls._sample_array(call, samples)
        if len(times) != len(y):
            raise RuntimeError(
                f"{cls._name(call)}: Number of break points {len(times)} does not match number of samples {len(y)}."
            )
        if len(y) < least:
            raise RuntimeError(
                f"{cls._name(call)}: {len(y)} samples is not enough samples (this method requires at least {least})."
            )
        if y.size == 0:
            raise RuntimeError(f"{cls._name(call)}: Knots need to be non-empty.")
        cls._check_increasing(times)
        return times, y

    @classmethod
    def _sample_array(cls, call: str, samples: Any) -> np.ndarray:
        try:
            y = any_array(cls._T, samples)
        except Mismatch:
            shapes = {np.shape(s) for s in samples} if hasattr(samples, "__iter__") else set()
            if len(shapes) > 1:
                raise RuntimeError(f"{cls._name(call)}: Knots have inconsistent dimensions: {shapes}.") from None
            raise cls._mismatch(call, f"samples of {cls._T.__name__}", samples) from None
        if y.ndim == 2:
            return np.ascontiguousarray(y.T)[:, :, None]
        if y.shape == (0,):
            return y.reshape(0, 0, 0)
        if y.ndim != 3:
            raise cls._mismatch(
                call, "samples as the columns of a matrix, or as a list of matrices", f"an array of shape {y.shape}"
            )
        return y

    @classmethod
    @checked
    def ZeroOrderHold(cls, breaks: Scalars, samples: Scalars) -> PiecewisePolynomial:
        """Returns the trajectory that keeps each sample until the next break.

        Args:
            breaks: Times [s], shape `(n,)`, increasing.
            samples: Vectors as the columns of a matrix, shape `(rows, n)`, or a list of n matrices.

        Raises:
            RuntimeError: numbers of breaks and samples differ, too few samples, or breaks do not increase.
        """
        times, y = cls._samples("ZeroOrderHold", breaks, samples, 2)
        return cls._of(interpolation.constant(y), times)

    @classmethod
    @checked
    def FirstOrderHold(cls, breaks: Scalars, samples: Scalars) -> PiecewisePolynomial:
        """Returns straight lines from sample to sample; arguments as those of `ZeroOrderHold`."""
        times, y = cls._samples("FirstOrderHold", breaks, samples, 2)
        return cls._of(interpolation.linear(interpolation.durations(times, y), y), times)

    @classmethod
    @checked
    def CubicShapePreserving(
        cls, breaks: Scalars, samples: Scalars, zero_end_point_derivatives: bool = False
    ) -> PiecewisePolynomial:
        """Returns cubics with continuous slopes that rise and fall where the samples do.

        Args:
            breaks: Times [s], shape `(n,)`, increasing; at least three, or two with zero end slopes.
            samples: Vectors as the columns of a matrix, shape `(rows, n)`, or a list of n matrices.
            zero_end_point_derivatives: The slopes at both ends are zero.

        Raises:
            RuntimeError: as `ZeroOrderHold`.
        """
        least = 2 if zero_end_point_derivatives else 3
        times, y = cls._samples("CubicShapePreserving", breaks, samples, least)
        h = interpolation.durations(times, y)
        slopes = interpolation.shape_preserving_slopes(h, y, bool(zero_end_point_derivatives))
        return cls._of(interpolation.cubic(h, y, slopes), times)

    @classmethod
    @checked
    def CubicWithContinuousSecondDerivatives(
        cls,
        breaks: Scalars,
        samples: Scalars,
        sample_dot_at_start: Any = _NOT_GIVEN,
        sample_dot_at_end: Any = _NOT_GIVEN,
        *,
        periodic_end_condition: bool = False,
        periodic_end: bool = False,
    ) -> PiecewisePolynomial:
        """Returns cubics whose first and second derivatives are continuous.

        Args:
            breaks: Times [s], shape `(n,)`, increasing.
            samples: Vectors as the columns of a matrix, shape `(rows, n)`, or a list of n matrices.
            sample_dot_at_start: Slope at the start, of the shape of a sample; without it and with two segments or
                more, the first two cubics are one, as are the last two.
            sample_dot_at_end: Slope at the end.
            periodic_end_condition: First and second derivatives at the end equal those at the start. May also be the
                third argument.
            periodic_end: The same.

        Raises:
            RuntimeError: as `ZeroOrderHold`.
        """
        call = "CubicWithContinuousSecondDerivatives"
        if sample_dot_at_end is _NOT_GIVEN and isinstance(sample_dot_at_start, _FLAGS):
            periodic_end, sample_dot_at_start = bool(sample_dot_at_start), _NOT_GIVEN
        clamped = sample_dot_at_start is not _NOT_GIVEN
        times, y = cls._samples(call, breaks, samples, 2 if clamped else 3)
        ends: Any = "periodic" if periodic_end_condition or periodic_end else "not-a-knot"
        if clamped:
            ends = tuple(cls._matrix(call, m) for m in (sample_dot_at_start, sample_dot_at_end))
            if any(m.shape != y.shape[1:] for m in ends):
                raise RuntimeError(
                    f"{cls._name(call)}: the slopes at the ends must have the shape of a sample, {y.shape[1:]}; got "
                    f"{ends[0].shape} and {ends[1].shape}."
                )
        h = interpolation.durations(times, y)
        slopes = interpolation.smooth_slopes(h, y, ends, as_scalar(cls._T, 0.0))
        return cls._of(interpolation.cubic(h, y, slopes), times)

    @classmethod
    @checked
    def CubicHermite(cls, breaks: Scalars, samples: Scalars, samples_dot: Scalars) -> PiecewisePolynomial:
        """Returns cubics through the samples with the given slopes.

        Args:
            breaks: Times [s], shape `(n,)`, increasing.
            samples: Vectors as the columns of a matrix, shape `(rows, n)`, or a list of n matrices.
            samples_dot: Slopes [1/s], like the samples.

        Raises:
            RuntimeError: as `ZeroOrderHold`, or samples and slopes differ in shape.
        """
        times, y = cls._samples("CubicHermite", breaks, samples, 2)
        m = cls._sample_array("CubicHermite", samples_dot)
        if m.shape != y.shape:
            raise RuntimeError(
                f"{cls._name('CubicHermite')}: Y and Ydot have different length or shape: {y.shape}, {m.shape}."
            )
        return cls._of(interpolation.cubic(interpolation.durations(times, y), y, m), times)

    @classmethod
    @checked
    def LagrangeInterpolatingPolynomial(cls, times: Scalars, samples: Scalars) -> PiecewisePolynomial:
        """Returns the one segment whose polynomials, of degree n - 1, go through all n samples."""
        t, y = cls._samples("LagrangeInterpolatingPolynomial", times, samples, 1)
        if len(t) == 1:
            raise RuntimeError(f"{cls._name('LagrangeInterpolatingPolynomial')}: one sample makes no segment.")
        return cls._of([interpolation.lagrange(t, y)], [t[0], t[-1]])


def _almost_equal(a: np.ndarray, b: np.ndarray, tol: float, relative: bool) -> bool:
    """`Polynomial.CoefficientsAlmostEqual` of all polynomials of a segment, of plain numbers."""
    n = min(a.shape[-1], b.shape[-1])
    rest = a[..., n:] if a.shape[-1] > n else b[..., n:]
    if rest.size and (relative or not (np.abs(rest) <= tol).all()):
        return False
    a, b = a[..., :n], b[..., :n]
    bound = tol * np.minimum(np.abs(a), np.abs(b)) if relative else tol
    return bool((np.abs(a - b) <= bound).all())
