"""The two passes of TOPPRA: which speeds along a path can still be slowed down, and the fastest of them.

H. Pham and Q.-C. Pham, "A new approach to time-optimal path parameterization based on reachability analysis", IEEE
Transactions on Robotics, 2018. Symbols are theirs: x is the square of the path's speed, u its acceleration; between
two gridpoints u is constant, so that x_next = x + 2 delta u.

Rows (p, r, c), of length one, say p u + r x <= c. Each gridpoint has equally many, of which the last `OWN` are room for
the set of x at the next one and for its bounds of x.
"""

from __future__ import annotations

from sheldrake.common.kernel import Matrix, Vector, kernel

OWN = 4
PARALLEL = 1e-12  # Below this part of a row of length one, a coefficient is rounding.
SLACK = 1e-9  # By how much, relative to the row, rounding may make an interval empty.


@kernel
def write_row(rows, k, p, r, c):
    length = (p * p + r * r) ** 0.5
    rows[k, 0], rows[k, 1], rows[k, 2] = p / length, r / length, c / length


@kernel
def write_own(rows, end, delta, least, most, next_least, next_most):
    """The rows before `end`: x is between `least` and `most`, and at the next gridpoint within its set."""
    write_row(rows, end - 4, 2.0 * delta, 1.0, next_most)
    write_row(rows, end - 3, -2.0 * delta, -1.0, -next_least)
    write_row(rows, end - 2, 0.0, 1.0, most)
    write_row(rows, end - 1, 0.0, -1.0, -least)


@kernel
def narrowed(low, high, r, c):
    """What r z <= c leaves of an interval; an empty one if it never holds."""
    if r > PARALLEL:
        high = min(high, c / r)
    elif r < -PARALLEL:
        low = max(low, c / r)
    elif c < -SLACK * (1.0 + abs(c)):
        low, high = 1e300, -1e300
    return low, high


@kernel
def not_empty(low, high):
    """Whether there is something in an interval, but for rounding; and its ends in order."""
    found = 1
    if low > high:
        if low - high > SLACK * (1.0 + min(abs(low), abs(high))):
            found = 0
        low = 0.5 * (low + high)
        high = low
    return found, low, high


@kernel
def range_of_x(rows, begin, end):
    """Least and greatest x for which there is a u with p u + r x <= c: u is eliminated (Fourier and Motzkin)."""
    low, high = -1e300, 1e300
    for i in range(begin, end):
        p = rows[i, 0]
        if p > PARALLEL:
            r_above, c_above = rows[i, 1] / p, rows[i, 2] / p  # u + r x <= c
            for j in range(begin, end):
                q = rows[j, 0]
                if q < -PARALLEL:
                    r_below, c_below = rows[j, 1] / q, rows[j, 2] / q  # u + r x >= c
                    size = max(max(abs(r_above), abs(r_below)), 1.0)
                    low, high = narrowed(low, high, (r_above - r_below) / size, (c_above - c_below) / size)
        elif p >= -PARALLEL:
            low, high = narrowed(low, high, rows[i, 1], rows[i, 2])
    return not_empty(low, high)


@kernel
def range_of_u(rows, begin, end, x):
    """Least and greatest u with p u + r x <= c at a given x."""
    low, high = -1e300, 1e300
    for i in range(begin, end):
        low, high = narrowed(low, high, rows[i, 0], rows[i, 2] - rows[i, 1] * x)
    return not_empty(low, high)


@kernel(top=True)
def controllable_sets(rows: Matrix, s: Vector, least: Vector, most: Vector, sets: Matrix) -> int:
    """From which x the end can be reached, from the last gridpoint to the first.

    Gives -1, or the gridpoint at which there is none.

    Args:
        rows: Of one gridpoint after the other, shape (gridpoints * rows, 3).
        s: The gridpoints.
        least: Bounds of x at each.
        most: Bounds of x at each.
        sets: Least and greatest x of each, that of the last one given, shape (gridpoints, 2).
    """
    count = rows.shape[0] // len(s)
    for back in range(1, len(s)):
        i = len(s) - 1 - back
        end = (i + 1) * count
        write_own(rows, end, s[i + 1] - s[i], least[i], most[i], sets[i + 1, 0], sets[i + 1, 1])
        found, low, high = range_of_x(rows, i * count, end)
        if found == 0 or high < 0.0:
            return i
        sets[i, 0], sets[i, 1] = max(low, 0.0), high
    return -1


@kernel(top=True)
def fastest(rows: Matrix, s: Vector, least: Vector, most: Vector, sets: Matrix, x: Vector) -> int:
    """The largest x at each gridpoint, from the first on, whose is given.

    Gives -1, or the gridpoint at which there is no acceleration.

    Args:
        rows: Of one gridpoint after the other, shape (gridpoints * rows, 3).
        s: The gridpoints.
        least: Bounds of x at each.
        most: Bounds of x at each.
        sets: Controllable sets, shape (gridpoints, 2).
        x: Filled, but for the first.
    """
    count = rows.shape[0] // len(s)
    for i in range(len(s) - 1):
        end = (i + 1) * count
        delta = s[i + 1] - s[i]
        write_own(rows, end, delta, least[i], most[i], sets[i + 1, 0], sets[i + 1, 1])
        found, _, high = range_of_u(rows, i * count, end, x[i])
        if found == 0:
            return i
        x[i + 1] = min(max(x[i] + 2.0 * delta * high, sets[i + 1, 0]), sets[i + 1, 1])
    return -1
