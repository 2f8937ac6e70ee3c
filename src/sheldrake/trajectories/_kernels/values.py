"""Values of trajectories at a time, with the bits of the same rules in Python."""

from __future__ import annotations

from sheldrake.common._kernels.generic import acos, sin, sqrt
from sheldrake.common._kernels.poses import of_products, squared
from sheldrake.common._kernels.vec import write3, write4, write9
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
def horner(coefficients, row, since):
    value = coefficients[row, coefficients.shape[1] - 1]
    for power in range(coefficients.shape[1] - 2, -1, -1):
        value = value * since + coefficients[row, power]
    return value


@kernel(strict=True)
def segment_at(breaks, t):
    """The segment at a time, and how long it has lasted; outside the breaks at the nearest one."""
    last = breaks.shape[0] - 1
    time = clamped(t, breaks[0], breaks[last])
    i = interval(breaks, time, 1, last)
    return i, time - breaks[i]


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
    i, since = segment_at(breaks, t)
    at = i * rows * cols
    for row in range(rows):
        for col in range(cols):
            out[row, col] = horner(coefficients, at, since)
            at += 1


@kernel(top=True, strict=True)
def polynomials_at_times(breaks: Vector, coefficients: Matrix, times: Vector, out: Vector, done: Vector) -> None:
    """The same at many times; `out` has a row of times for each element."""
    n, size = times.shape[0], coefficients.shape[0] // (breaks.shape[0] - 1)
    for k in range(n):
        i, since = segment_at(breaks, times[k])
        for element in range(size):
            out[element * n + k] = horner(coefficients, i * size + element, since)
    done[0] = 1.0


@kernel(strict=True)
def position_at(breaks, coefficients, t):
    """A polynomial of three elements."""
    i, since = segment_at(breaks, t)
    return (
        horner(coefficients, 3 * i, since),
        horner(coefficients, 3 * i + 1, since),
        horner(coefficients, 3 * i + 2, since),
    )


@kernel
def row_of_four(A, i):
    return (A[i, 0], A[i, 1], A[i, 2], A[i, 3])


@kernel(strict=True)
def slerp_at(breaks, quaternions, t):
    """Spherical linear interpolation (Shoemake 1985)."""
    last = breaks.shape[0] - 1
    time = clamped(t, breaks[0], breaks[last])
    i = interval(breaks, time, 1, last)
    fraction = (time - breaks[i]) / (breaks[i + 1] - breaks[i])
    a, b = row_of_four(quaternions, i), row_of_four(quaternions, i + 1)
    cosine = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
    if cosine >= 1.0 - 2.220446049250313e-16:
        u, v = 1.0 - fraction, fraction
    else:
        angle = acos(cosine)
        scale = sin(angle)
        u, v = sin((1.0 - fraction) * angle) / scale, sin(fraction * angle) / scale
    return (a[0] * u + b[0] * v, a[1] * u + b[1] * v, a[2] * u + b[2] * v, a[3] * u + b[3] * v)


@kernel(strict=True)
def orientation_at(breaks, quaternions, t):
    """The same, of length one."""
    w, x, y, z = slerp_at(breaks, quaternions, t)
    length = sqrt(w * w + x * x + y * y + z * z)
    return (w / length, x / length, y / length, z / length)


@kernel(top=True, strict=True)
def slerp(breaks: Vector, quaternions: Matrix, t: float, out: Vector) -> None:
    """The quaternion between samples, rows of w, x, y, z."""
    write4(out, 0, slerp_at(breaks, quaternions, t))


@kernel(top=True, strict=True)
def orientation(breaks: Vector, quaternions: Matrix, t: float, out: Vector) -> None:
    """The unit quaternion between samples, rows of w, x, y, z."""
    write4(out, 0, orientation_at(breaks, quaternions, t))


@kernel(top=True, strict=True)
def pose_between(
    breaks: Vector, quaternions: Matrix, p_breaks: Vector, coefficients: Matrix, t: float, R: Vector, p: Vector
) -> None:
    """Rotation and position of a polynomial of three elements."""
    w, x, y, z = orientation_at(breaks, quaternions, t)
    write9(R, 0, of_products(2.0 / squared(w, x, y, z), w, x, y, z))
    write3(p, 0, position_at(p_breaks, coefficients, t))


@kernel(top=True, strict=True)
def twist_between(
    breaks: Vector, velocities: Matrix, p_breaks: Vector, coefficients: Matrix, t: float, out: Vector
) -> None:
    """Angular velocity of the segment, by rows, and the value of a polynomial; zero outside."""
    last = breaks.shape[0] - 1
    if breaks[0] <= t and t <= breaks[last]:
        i = interval(breaks, t, 1, last)
        write3(out, 0, (velocities[i, 0], velocities[i, 1], velocities[i, 2]))
        write3(out, 3, position_at(p_breaks, coefficients, t))
    else:
        write3(out, 0, (0.0, 0.0, 0.0))
        write3(out, 3, (0.0, 0.0, 0.0))


@kernel(strict=True)
def de_boor(knots, points, t, work):
    """The value of a B-spline, in the last row of `work`, by de Boor's rule; outside its time those at the ends."""
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
    """The value of a B-spline.

    Args:
        knots: Shape (num_points + order,).
        points: A row for each control point.
        t: Time.
        work: Shape (order, rows * cols).
        out: Shape (rows, cols).
    """
    rows, cols = out.shape
    de_boor(knots, points, t, work)
    for row in range(rows):
        for col in range(cols):
            out[row, col] = work[work.shape[0] - 1, row * cols + col]


@kernel(top=True, strict=True)
def spline_at_times(knots: Vector, points: Matrix, work: Matrix, times: Vector, out: Vector, done: Vector) -> None:
    """The same at many times; `out` has a row of times for each element."""
    n = times.shape[0]
    for k in range(n):
        de_boor(knots, points, times[k], work)
        for element in range(work.shape[1]):
            out[element * n + k] = work[work.shape[0] - 1, element]
    done[0] = 1.0


@kernel(top=True, strict=True)
def bezier(points: Vector, s: float, out: Vector, done: Vector) -> None:
    """The value of a Bézier curve at s, from 0 to 1; `points` has the coordinates of each element one after the other.

    The sum of points times Bernstein's polynomials, in their order.
    """
    rows = out.shape[0]
    n = points.shape[0] // rows
    for row in range(rows):
        out[row] = 0.0
    weight = 1.0
    for i in range(n):
        share = weight * power_of(s, i) * power_of(1.0 - s, n - 1 - i)
        for row in range(rows):
            out[row] += points[row * n + i] * share
        weight = weight * (n - 1 - i) / (i + 1)
    done[0] = 1.0


@kernel(strict=True)
def power_of(x, n):
    value = 1.0
    for _ in range(n):
        value = value * x
    return value
