"""Coefficients of piecewise polynomials through samples.

Everywhere: breaks h[i] = t[i+1] - t[i] apart, samples y of shape (n, rows, cols), slopes m of the same shape; results
are lists of coefficient arrays, shape (rows, cols, degree + 1), lowest power first, in the time since the segment's
start. All work on floats and on arrays of objects.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.trajectories._base import holds

if TYPE_CHECKING:
    from sheldrake.common._types import Scalar


def constant(y: np.ndarray) -> list[np.ndarray]:
    """Each sample holds until the next."""
    return [y[i][..., None] for i in range(len(y) - 1)]


def linear(h: list, y: np.ndarray) -> list[np.ndarray]:
    """Straight lines from sample to sample."""
    return [np.stack([y[i], (y[i + 1] - y[i]) / h[i]], axis=-1) for i in range(len(h))]


def cubic(h: list, y: np.ndarray, m: np.ndarray) -> list[np.ndarray]:
    """Cubics through samples with given slopes."""
    out = []
    for i, hi in enumerate(h):
        d = (y[i + 1] - y[i]) / hi
        c2 = (3.0 * d - 2.0 * m[i] - m[i + 1]) / hi
        c3 = (m[i] + m[i + 1] - 2.0 * d) / (hi * hi)
        out.append(np.stack([y[i], m[i], c2, c3], axis=-1))
    return out


def _slopes(h: list, y: np.ndarray) -> np.ndarray:
    return np.stack([(y[i + 1] - y[i]) / h[i] for i in range(len(h))])


def shape_preserving_slopes(h: list, y: np.ndarray, zero_ends: bool) -> np.ndarray:
    """Slopes with which cubics are monotonic where the samples are (Fritsch and Butland 1984)."""
    d = _slopes(h, y)
    m: Any = y * 0.0
    for row, col in np.ndindex(*y.shape[1:]):
        column, zero = d[:, row, col], y[0, row, col] * 0.0
        for i in range(1, len(h)):
            m[i, row, col] = _harmonic(h[i - 1], h[i], column[i - 1], column[i], zero)
        if not zero_ends:
            m[0, row, col] = _end_slope(h[0], h[1], column[0], column[1])
            m[len(h), row, col] = _end_slope(h[-1], h[-2], column[-1], column[-2])
    return m


def _harmonic(h0: Scalar, h1: Scalar, d0: Scalar, d1: Scalar, zero: Scalar) -> Scalar:
    if holds(d0 * d1 <= 0.0):
        return zero
    w0, w1 = h0 + 2.0 * h1, 2.0 * h0 + h1
    return (w0 + w1) / (w0 / d0 + w1 / d1)


def _end_slope(h0: Scalar, h1: Scalar, d0: Scalar, d1: Scalar) -> Scalar:
    m = ((2.0 * h0 + h1) * d0 - h0 * d1) / (h0 + h1)
    if holds(m * d0 <= 0.0):
        return d0 * 0.0
    if holds(d0 * d1 <= 0.0) and holds(abs(m) > abs(3.0 * d0)):
        return 3.0 * d0
    return m


def smooth_slopes(h: list, y: np.ndarray, ends: Any, zero: Scalar) -> np.ndarray:
    """Slopes with which the cubics' second derivatives are continuous.

    Args:
        h: Durations.
        y: Samples.
        ends: "not-a-knot", "periodic", or the two slopes at start and end.
        zero: A zero of the scalar type.
    """
    n, d = len(y), _slopes(h, y)
    if n == 2 and isinstance(ends, str):
        return np.stack([d[0], d[0]])
    a = np.empty((n, n), dtype=object if y.dtype == object else float)
    a[:] = zero
    b = y * 0.0
    for i in range(1, n - 1):
        a[i, i - 1], a[i, i], a[i, i + 1] = h[i], 2.0 * (h[i - 1] + h[i]), h[i - 1]
        b[i] = 3.0 * (h[i] * d[i - 1] + h[i - 1] * d[i])
    if not isinstance(ends, str):
        a[0, 0], a[n - 1, n - 1] = zero + 1.0, zero + 1.0
        b[0], b[n - 1] = ends
    elif ends == "periodic":
        _periodic_rows(a, b, h, d)
    else:
        _not_a_knot_rows(a, b, h, d)
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
    differences = [y[i] for i in range(n)]
    for order in range(1, n):
        for i in range(n - 1, order - 1, -1):
            differences[i] = (differences[i] - differences[i - 1]) / (t[i] - t[i - order])
    out = np.stack([y[0] * 0.0] * n, axis=-1)
    out[..., 0] = differences[n - 1]
    for i in range(n - 2, -1, -1):
        shift = t[i] - t[0]
        for power in range(n - 1, 0, -1):
            out[..., power] = out[..., power - 1] - out[..., power] * shift
        out[..., 0] = differences[i] - out[..., 0] * shift
    return out


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
