"""Random walks in polyhedra (R. L. Smith, Operations Research 32, 1984)."""

from __future__ import annotations

from sheldrake.common.kernel import Matrix, Vector, kernel

OUTSIDE, UNBOUNDED = 1, 2


@kernel(top=True)
def walk(A: Matrix, b: Vector, directions: Matrix, fractions: Vector, tol: float, x: Vector) -> int:
    """Goes along each direction to a fraction of the chord of A x <= b; 0, or why it cannot.

    Args:
        A: Shape (m, n).
        b: Shape (m,).
        directions: Shape (steps, n).
        fractions: In [0, 1), shape (steps,).
        tol: By how much x may violate a row.
        x: Where it begins; filled with where it ends, shape (n,).
    """
    m, n = A.shape
    for step in range(fractions.shape[0]):
        low, high = -1e300, 1e300
        for i in range(m):
            room, slope = b[i], 0.0
            for k in range(n):
                room -= A[i, k] * x[k]
                slope += A[i, k] * directions[step, k]
            if not room >= -tol:
                return OUTSIDE
            room = max(room, 0.0)
            if slope < 0.0:
                low = max(low, room / slope)
            elif slope > 0.0:
                high = min(high, room / slope)
        if low <= -1e300 or high >= 1e300:
            return UNBOUNDED
        reach = fractions[step] * (high - low) + low
        for k in range(n):
            x[k] += reach * directions[step, k]
    return 0
