"""Coefficients of piecewise polynomials through samples.

Everywhere: breaks h[i] = t[i+1] - t[i] apart, shape (n - 1, 1, 1); samples y of shape (n, rows, cols), slopes m of the
same shape; results are lists of coefficient arrays, shape (rows, cols, degree + 1), lowest power first, in the time
since the segment's start. All work on floats and on arrays of objects.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common import quick
from sheldrake.trajectories._base import holds
from sheldrake.trajectories._kernels import interpolation as kernels

if TYPE_CHECKING:
    from sheldrake.common._types import Scalar


def durations(t: list, y: np.ndarray) -> np.ndarray:
    """The h of breaks t, for samples y."""
    times = np.array(t, y.dtype).reshape(-1, 1, 1)
    return times[1:] - times[:-1]


def constant(y: np.ndarray) -> list[np.ndarray]:
    """Each sample holds until the next."""
    return list(y[:-1, ..., None])


def linear(h: np.ndarray, y: np.ndarray) -> list[np.ndarray]:
    """Straight lines from sample to sample."""
    if y.dtype == float:
        out = np.empty((*y[1:].shape, 2))
        if _lines(h.reshape(-1), y.reshape(-1), out.reshape(-1)):
            return list(out)
    return _segments(y[:-1], (y[1:] - y[:-1]) / h)


def cubic(h: np.ndarray, y: np.ndarray, m: np.ndarray) -> list[np.ndarray]:
    """Cubics through samples with given slopes."""
    if y.dtype == m.dtype == float:
        out = np.empty((*y[1:].shape, 4))
        if _cubics(h.reshape(-1), y.reshape(-1), m.reshape(-1), out.reshape(-1)):
            return list(out)
    d, m0, m1 = (y[1:] - y[:-1]) / h, m[:-1], m[1:]
    return _segments(y[:-1], m0, (3.0 * d - 2.0 * m0 - m1) / h, (m0 + m1 - 2.0 * d) / (h * h))


def _segments(*coefficients: np.ndarray) -> list[np.ndarray]:
    """Coefficient arrays of the segments, from those of each power for all segments."""
    first = coefficients[0]
    out = np.empty((*first.shape, len(coefficients)), first.dtype)
    for power, c in enumerate(coefficients):
        out[..., power] = c
    return list(out)


def shape_preserving_slopes(h: np.ndarray, y: np.ndarray, zero_ends: bool) -> np.ndarray:
    """Slopes with which cubics are monotonic where the samples are (Fritsch and Butland 1984)."""
    if y.dtype == float:
        slopes = np.empty(y.shape)
        if _slopes(h.reshape(-1), y.reshape(-1), float(zero_ends), slopes.reshape(-1)):
            return slopes
    d = (y[1:] - y[:-1]) / h
    m: Any = y * 0.0
    d0, d1, h0, h1 = d[:-1], d[1:], h[:-1], h[1:]
    w0, w1 = h0 + 2.0 * h1, 2.0 * h0 + h1
    turns = _not_positive(d0 * d1)  # there slopes are zero, and the harmonic mean may divide by it
    mean = (w0 + w1) / (w0 / np.where(turns, 1.0, d0) + w1 / np.where(turns, 1.0, d1))
    m[1:-1] = np.where(turns, m[:1], mean)
    if not zero_ends:
        for end, inner in (0, 1), (-1, -2):
            pairs = zip(d[end].ravel().tolist(), d[inner].ravel().tolist())
            m[end].flat = [_end_slope(h.item(end), h.item(inner), a, b) for a, b in pairs]
    return m


def _not_positive(x: np.ndarray) -> np.ndarray:
    return x <= 0.0 if x.dtype != object else np.array([holds(a <= 0.0) for a in x.flat]).reshape(x.shape)


def _end_slope(h0: Scalar, h1: Scalar, d0: Scalar, d1: Scalar) -> Scalar:
    m = ((2.0 * h0 + h1) * d0 - h0 * d1) / (h0 + h1)
    if holds(m * d0 <= 0.0):
        return d0 * 0.0
    if holds(d0 * d1 <= 0.0) and holds(abs(m) > abs(3.0 * d0)):
        return 3.0 * d0
    return m


def smooth_slopes(h: np.ndarray, y: np.ndarray, ends: Any, zero: Scalar) -> np.ndarray:
    """Slopes with which the cubics' second derivatives are continuous.

    Args:
        h: Durations.
        y: Samples.
        ends: "not-a-knot", "periodic", or the two slopes at start and end.
        zero: A zero of the scalar type.
    """
    n, d, h0, h1 = len(y), (y[1:] - y[:-1]) / h, h[:-1], h[1:]
    if n == 2 and isinstance(ends, str):
        return np.stack([d[0], d[0]])
    a = np.full((n, n), zero, y.dtype)
    b = y * 0.0
    inner = a[1:-1].reshape(-1)  # each band of the matrix is every (n + 1)-th number
    inner[:: n + 1], inner[1 :: n + 1], inner[2 :: n + 1] = h1.flat, (2.0 * (h0 + h1)).flat, h0.flat
    b[1:-1] = 3.0 * (h1 * d[:-1] + h0 * d[1:])
    if not isinstance(ends, str):
        a[0, 0], a[n - 1, n - 1] = zero + 1.0, zero + 1.0
        b[0], b[n - 1] = ends
    elif ends == "periodic":
        _periodic_rows(a, b, h.ravel().tolist(), d)
    else:
        _not_a_knot_rows(a, b, h.ravel().tolist(), d)
    return solve(a, b.reshape(n, -1)).reshape(y.shape)


def _periodic_rows(a: np.ndarray, b: np.ndarray, h: list, d: np.ndarray) -> None:
    last = len(h)
    a[0, 0], a[0, last] = a[0, 0] + 1.0, a[0, last] - 1.0
    a[last, 0], a[last, last] = a[last, 0] + 2.0 * h[-1], a[last, last] + 2.0 * h[0]
    a[last, 1] = a[last, 1] + h[-1]
    a[last, last - 1] = a[last, last - 1] + h[0]
    b[last] = 3.0 * (h[-1] * d[0] + h[0] * d[-1])


def _not_a_knot_rows(a: np.ndarray, b: np.ndarray, h: list, d: np.ndarray) -> None:
    """The third derivative is continuous at the second and the last but one sample; three samples: a parabola."""
    n = len(h) + 1
    if n == 3:
        a[0, 0], a[0, 1], b[0] = a[0, 0] + 1.0, a[0, 1] + 1.0, 2.0 * d[0]
        a[2, 2], a[2, 1], b[2] = a[2, 2] + 1.0, a[2, 1] + 1.0, 2.0 * d[1]
        return
    h0, h1 = h[0], h[1]
    a[0, 0], a[0, 1] = h1, h0 + h1
    b[0] = ((h0 + 2.0 * (h0 + h1)) * h1 * d[0] + h0 * h0 * d[1]) / (h0 + h1)
    h0, h1 = h[-1], h[-2]
    a[n - 1, n - 1], a[n - 1, n - 2] = h1, h0 + h1
    b[n - 1] = ((h0 + 2.0 * (h0 + h1)) * h1 * d[-1] + h0 * h0 * d[-2]) / (h0 + h1)


def solve(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """x of a x = b, shapes (n, n) and (n, k); by elimination for objects."""
    if a.dtype != object:
        return np.linalg.solve(a, b)
    a, b = a.copy(), b.copy()
    n = len(a)
    for i in range(n):
        pivot = max(range(i, n), key=lambda r: _magnitude(a[r, i]))
        a[[i, pivot]], b[[i, pivot]] = a[[pivot, i]], b[[pivot, i]]
        for r in range(i + 1, n):
            factor = a[r, i] / a[i, i]
            a[r] = a[r] - factor * a[i]
            b[r] = b[r] - factor * b[i]
    x = b.copy()
    for i in reversed(range(n)):
        for j in range(i + 1, n):
            x[i] = x[i] - a[i, j] * x[j]
        x[i] = x[i] / a[i, i]
    return x


def _magnitude(x: Any) -> float:
    if hasattr(x, "value"):
        return abs(x.value())
    return abs(x.Unapply()[1][0]) if str(x.get_kind()) == "ExpressionKind.Constant" else 0.5


def lagrange(t: list, y: np.ndarray) -> np.ndarray:
    """The one polynomial through all samples, by Newton's divided differences; shape (rows, cols, n)."""
    n = len(t)
    d, times = y.reshape(n, -1).copy(), np.array(t, y.dtype).reshape(-1, 1)
    out = d * 0.0  # a row for each power of the time since t[0]
    for order in range(1, n):
        d[order:] = (d[order:] - d[order - 1 : -1]) / (times[order:] - times[:-order])
    out[0] = d[-1]
    for difference, ti in zip(d[-2::-1], t[-2::-1]):
        shifted = out * (ti - t[0])
        out[1:] = out[:-1] - shifted[1:]
        out[0] = difference - shifted[0]
    return out.T.reshape(*y.shape[1:], n)


def reversed_in_time(c: np.ndarray, h: Scalar) -> np.ndarray:
    """Coefficients of p(h - x) from those of p(x), by Horner's rule on polynomials."""
    n = c.shape[-1]
    out: np.ndarray = c * 0.0
    out[..., 0] = c[..., n - 1]
    for i in range(n - 2, -1, -1):
        for power in range(n - 1, 0, -1):
            out[..., power] = out[..., power] * h - out[..., power - 1]
        out[..., 0] = out[..., 0] * h + c[..., i]
    return out


_ANY = quick.ANY
_lines = quick.short_way(globals(), "_lines", kernels.lines, _ANY, _ANY, _ANY, gives=bool)
_cubics = quick.short_way(globals(), "_cubics", kernels.cubics, _ANY, _ANY, _ANY, _ANY, gives=bool)
_slopes = quick.short_way(globals(), "_slopes", kernels.shape_preserving_slopes, _ANY, _ANY, float, _ANY, gives=bool)
