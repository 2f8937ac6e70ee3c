"""Second derivatives of functions of which first ones are known, by differences, at many points at once."""

from __future__ import annotations

from typing import NamedTuple

from sheldrake.common.kernel import Matrix, kernel

STEP = 1e-6  # Of differences of exact derivatives, relative to numbers above one.


class Differences(NamedTuple):
    """Memory for points and their neighbours.

    Attributes:
        z: The points, shape (points, n).
        moved: The points, then all of them with their first number moved, and so on, shape ((n + 1) * points, n).
        J: Derivatives of m functions there, row after row, shape ((n + 1) * points, m * n).
        weights: Of the functions, shape (points, m).
        H: Second derivatives of weights' functions, row after row, shape (points, n * n).
    """

    z: Matrix
    moved: Matrix
    J: Matrix
    weights: Matrix
    H: Matrix


@kernel
def step_at(z):
    return STEP * max(1.0, abs(z))


@kernel
def move(work):
    """Fills `moved`."""
    count, n = work.z.shape
    for d in range(n + 1):
        for p in range(count):
            for k in range(n):
                work.moved[d * count + p, k] = work.z[p, k]
            if d > 0:
                work.moved[d * count + p, d - 1] += step_at(work.z[p, d - 1])


@kernel
def difference(work):
    """Fills `H`."""
    count, n = work.z.shape
    for p in range(count):
        for k in range(n * n):
            work.H[p, k] = 0.0
        for d in range(n):
            half = 0.5 / step_at(work.z[p, d])
            there = (d + 1) * count + p
            for k in range(n):
                change = 0.0
                for i in range(work.weights.shape[1]):
                    change += work.weights[p, i] * (work.J[there, i * n + k] - work.J[p, i * n + k])
                work.H[p, d * n + k] += half * change
                work.H[p, k * n + d] += half * change


MOVE, DIFFERENCE = 0, 1


@kernel(top=True)
def take_differences(work: Differences, what: int) -> None:
    """One of the above.

    Args:
        work: The points.
        what: MOVE, or DIFFERENCE, which needs J at the points of `moved`, and weights.
    """
    if what == MOVE:
        move(work)
    else:
        difference(work)
