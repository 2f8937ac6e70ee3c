"""Values of trajectories at a time, with the bits of the same rules in Python."""

from __future__ import annotations

from sheldrake.common.kernel import Matrix, Vector, kernel


@kernel
def clamped(t, first, last):
    return first if t < first else (last if t > last else t)


@kernel
def interval(knots, t, low, high):
    """The last index i, low - 1 <= i < high, with knots[i] <= t; none before is asked for."""
    while low < high:
        middle = (low + high) // 2
        if t < knots[middle]:
            high = middle
        else:
            low = middle + 1
    return low - 1


@kernel(strict=True)
def horner(coefficients, at, degree, since):
    """The polynomial of row `at`."""
    value = coefficients[at, degree]
    for power in range(degree - 1, -1, -1):
        value = value * since + coefficients[at, power]
    return value


@kernel(top=True, strict=True)
def polynomials(breaks: Vector, coefficients: Matrix, t: float, out: Matrix) -> None:
    """Values of piecewise polynomials by Horner's rule; outside the breaks those at the nearest one.

    Args:
        breaks: Shape (n + 1,).
        coefficients: A row for each element of each segment, lowest power first.
        t: Time.
        out: Shape (rows, cols).
    """
    rows, cols = out.shape
    last, degree = breaks.shape[0] - 1, coefficients.shape[1] - 1
    time = clamped(t, breaks[0], breaks[last])
    i = interval(breaks, time, 1, last)
    at = i * rows * cols
    for row in range(rows):
        for col in range(cols):
            out[row, col] = horner(coefficients, at, degree, time - breaks[i])
            at += 1


@kernel(top=True, strict=True)
def polynomials_at_times(breaks: Vector, coefficients: Matrix, times: Vector, out: Matrix) -> None:
    """`polynomials` at many times, a column of `out` for each."""
    last, degree = breaks.shape[0] - 1, coefficients.shape[1] - 1
    for k in range(times.shape[0]):
        time = clamped(times[k], breaks[0], breaks[last])
        i = interval(breaks, time, 1, last)
        for j in range(out.shape[0]):
            out[j, k] = horner(coefficients, i * out.shape[0] + j, degree, time - breaks[i])


@kernel(strict=True)
def de_boor(knots, points, t, work):
    """Leaves the value of a B-spline in the last row of `work`; see `spline`."""
    order, size = work.shape
    last = points.shape[0] - 1
    time = clamped(t, knots[order - 1], knots[last + 1])
    first = interval(knots, time, order, last + 1) - order + 1
    for j in range(order):
        for k in range(size):
            work[j, k] = points[first + j, k]
    for r in range(1, order):
        for j in range(order - 1, r - 1, -1):
            left = knots[first + j]
            alpha = (time - left) / (knots[first + order + j - r] - left)
            beta = 1.0 - alpha
            for k in range(size):
                work[j, k] = work[j - 1, k] * beta + work[j, k] * alpha


@kernel(top=True, strict=True)
def spline(knots: Vector, points: Matrix, t: float, work: Matrix, out: Matrix) -> None:
    """The value of a B-spline by de Boor's rule; outside its time those at the ends.

    Args:
        knots: Shape (num_points + order,).
        points: A row for each control point.
        t: Time.
        work: Shape (order, rows * cols).
        out: Shape (rows, cols).
    """
    rows, cols = out.shape
    order = work.shape[0]
    de_boor(knots, points, t, work)
    for row in range(rows):
        for col in range(cols):
            out[row, col] = work[order - 1, row * cols + col]


@kernel(top=True, strict=True)
def spline_at_times(knots: Vector, points: Matrix, times: Vector, work: Matrix, out: Matrix) -> None:
    """`spline` at many times, a column of `out` for each."""
    order = work.shape[0]
    for k in range(times.shape[0]):
        de_boor(knots, points, times[k], work)
        for j in range(out.shape[0]):
            out[j, k] = work[order - 1, j]
