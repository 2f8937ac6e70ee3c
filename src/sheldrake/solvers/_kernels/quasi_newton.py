"""Hessians learned from how gradients change from one point to the next."""

from __future__ import annotations

from sheldrake.common.kernel import Matrix, Vector, kernel

MOST = 1e8  # Larger changes of a gradient over a step are those of a kink.


@kernel(top=True, short_loops=True)
def symmetric_rank_one(before: Matrix, points: Matrix, J_before: Matrix, J: Matrix, H: Matrix, r: Vector) -> None:
    """Symmetric rank one updates of the Hessians of functions of several points; then `before` is the last point.

    Args:
        before: The points at which J was J_before, shape (points, n).
        points: Those at which it is J.
        J_before: Gradients, as many of each point, shape (functions, n).
        J: The same at `points`.
        H: Hessians, one row each, shape (functions, n * n).
        r: Scratch, shape (n,).
    """
    count, n = points.shape
    m = J.shape[0] // max(count, 1)
    for e in range(count):
        size2 = 0.0
        for k in range(n):
            size2 += (points[e, k] - before[e, k]) ** 2
        size = size2**0.5
        for i in range(e * m, e * m + m):
            rs, r2 = 0.0, 0.0
            for a in range(n):
                change = J[i, a] - J_before[i, a]
                for b in range(n):
                    change -= H[i, a * n + b] * (points[e, b] - before[e, b])
                r[a] = change
                r2 += change * change
                rs += change * (points[e, a] - before[e, a])
            if abs(rs) > 1e-8 * size * r2**0.5 and abs(rs) > 1e-14 * size:
                most = 0.0
                for a in range(n):
                    for b in range(n):
                        most = max(most, abs(H[i, a * n + b] + r[a] * r[b] / rs))
                if most < MOST:
                    for a in range(n):
                        for b in range(n):
                            H[i, a * n + b] += r[a] * r[b] / rs
    for e in range(count):
        for k in range(n):
            before[e, k] = points[e, k]
    for i in range(J.shape[0]):
        for k in range(n):
            J_before[i, k] = J[i, k]


@kernel(top=True, short_loops=True)
def weighted_sums(H: Matrix, weights: Vector, total: Matrix) -> None:
    """The sums of the Hessians of each point times their weights, one row each, shape (points, n * n)."""
    m = H.shape[0] // max(total.shape[0], 1)
    for e in range(total.shape[0]):
        for k in range(total.shape[1]):
            total[e, k] = 0.0
        for i in range(e * m, e * m + m):
            for k in range(total.shape[1]):
                total[e, k] += weights[i] * H[i, k]
