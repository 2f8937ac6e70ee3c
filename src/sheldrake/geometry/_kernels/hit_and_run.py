"""Random walks in polyhedra (R. L. Smith, Operations Research 32, 1984)."""

from __future__ import annotations

from sheldrake.common._kernels.twister import next_gaussians, next_uniform
from sheldrake.common.kernel import IntVector, Matrix, Vector, kernel

OUTSIDE, UNBOUNDED = 1, 2


@kernel(top=True)
def walk(
    A: Matrix,
    b: Vector,
    span: Matrix,
    steps: int,
    tol: float,
    key: IntVector,
    place: IntVector,
    work: Vector,
    x: Vector,
) -> int:
    """Goes along random directions to random points of the chord of A x <= b; 0, or why it cannot.

    Args:
        A: Shape (m, n).
        b: Shape (m,).
        span: Directions are normal numbers times its columns, shape (n, d).
        steps: How many.
        tol: By how much x may violate a row.
        key, place: The generator (`common._kernels.twister`).
        work: For a direction and the numbers that make it, shape (n + d + 1,).
        x: Where it begins; filled with where it ends, shape (n,).
    """
    m, n = A.shape
    d = span.shape[1]
    is_left = False
    for _ in range(steps):
        for j in range(d):
            if is_left:
                work[n + j] = work[n + d]
            else:
                work[n + j], work[n + d] = next_gaussians(key, place)
            is_left = not is_left
        for i in range(n):
            along = 0.0
            for j in range(d):
                along += span[i, j] * work[n + j]
            work[i] = along
        low, high = -1e300, 1e300
        for i in range(m):
            room, slope = b[i], 0.0
            for k in range(n):
                room -= A[i, k] * x[k]
                slope += A[i, k] * work[k]
            if not room >= -tol:
                return OUTSIDE
            room = max(room, 0.0)
            if slope < 0.0:
                low = max(low, room / slope)
            elif slope > 0.0:
                high = min(high, room / slope)
        if low <= -1e300 or high >= 1e300:
            return UNBOUNDED
        reach = next_uniform(key, place) * (high - low) + low
        for k in range(n):
            x[k] += reach * work[k]
    return 0
