"""Coefficients of piecewise polynomials through samples, as `_interpolation` has them in words of NumPy.

Durations are in h. Samples are rows of numbers, one behind the other, one row more than durations; coefficients are
those of each number of each segment, lowest power first.
"""

from __future__ import annotations

from sheldrake.common.kernel import Vector, kernel

NOT_FINITE = 1
"""Status: a sample is infinite or none."""


@kernel
def are_finite(numbers):
    for i in range(numbers.shape[0]):
        if not abs(numbers[i]) < 1e300:
            return False
    return True


@kernel(top=True, strict=True)
def lines(h: Vector, samples: Vector, out: Vector, done: Vector) -> None:
    """Straight lines from sample to sample, two coefficients each."""
    n = h.shape[0] + 1
    size = samples.shape[0] // n
    for i in range(n - 1):
        for e in range(size):
            at = i * size + e
            out[2 * at] = samples[at]
            out[2 * at + 1] = (samples[at + size] - samples[at]) / h[i]
    done[0] = 1.0


@kernel(top=True, strict=True)
def cubics(h: Vector, samples: Vector, slopes: Vector, out: Vector, done: Vector) -> None:
    """Cubics through samples with given slopes, four coefficients each."""
    n = h.shape[0] + 1
    size = samples.shape[0] // n
    for i in range(n - 1):
        for e in range(size):
            at = i * size + e
            m0, m1 = slopes[at], slopes[at + size]
            d = (samples[at + size] - samples[at]) / h[i]
            out[4 * at] = samples[at]
            out[4 * at + 1] = m0
            out[4 * at + 2] = (3.0 * d - 2.0 * m0 - m1) / h[i]
            out[4 * at + 3] = (m0 + m1 - 2.0 * d) / (h[i] * h[i])
    done[0] = 1.0


@kernel(strict=True)
def end_slope(h0, h1, d0, d1):
    """The slope at an end, of the lengths and slopes of the segment there and of the next one."""
    m = ((2.0 * h0 + h1) * d0 - h0 * d1) / (h0 + h1)
    if m * d0 <= 0.0:
        m = d0 * 0.0
    elif d0 * d1 <= 0.0 and abs(m) > abs(3.0 * d0):
        m = 3.0 * d0
    return m


@kernel(top=True, strict=True)
def shape_preserving_slopes(h: Vector, samples: Vector, zero_ends: float, slopes: Vector, done: Vector) -> int:
    """Slopes with which cubics are monotonic where the samples are (Fritsch and Butland 1984).

    With `zero_ends` other than 0 those at the ends are zero.
    """
    n = h.shape[0] + 1
    size = samples.shape[0] // n
    if not are_finite(samples) or n < 2 or (n < 3 and zero_ends == 0.0):
        return NOT_FINITE
    last = (n - 1) * size
    for e in range(size):
        for i in range(1, n - 1):
            at = i * size + e
            h0, h1 = h[i - 1], h[i]
            d0, d1 = (samples[at] - samples[at - size]) / h0, (samples[at + size] - samples[at]) / h1
            w0, w1 = h0 + 2.0 * h1, 2.0 * h0 + h1
            slopes[at] = 0.0 if d0 * d1 <= 0.0 else (w0 + w1) / (w0 / d0 + w1 / d1)
        slopes[e], slopes[last + e] = 0.0, 0.0
        if zero_ends == 0.0:
            h0, h1 = h[0], h[1]
            d0, d1 = (samples[size + e] - samples[e]) / h0, (samples[2 * size + e] - samples[size + e]) / h1
            slopes[e] = end_slope(h0, h1, d0, d1)
            h0, h1 = h[n - 2], h[n - 3]
            d0 = (samples[last + e] - samples[last - size + e]) / h0
            d1 = (samples[last - size + e] - samples[last - 2 * size + e]) / h1
            slopes[last + e] = end_slope(h0, h1, d0, d1)
    done[0] = 1.0
    return 0
