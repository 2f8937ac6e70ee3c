"""The nullspace of a small matrix by elimination."""

from __future__ import annotations

from sheldrake.common.kernel import IntVector, Matrix, kernel


@kernel(top=True, short_loops=True)
def nullspace(U: Matrix, order: IntVector, P: Matrix) -> int:
    """Fills the first rows of P with what spans the nullspace of U; gives how many columns elimination pivots on.

    Gauss elimination with complete pivoting: in each row, one of the numbers that are left free is one.

    Args:
        U: Shape (m, n); eliminated afterwards.
        order: Filled with which column is where, shape (n,).
        P: Shape (n, n).
    """
    m, n = U.shape
    largest = 0.0
    for i in range(m):
        for k in range(n):
            largest = max(largest, abs(U[i, k]))
    tolerance = max(m, n) * 2.220446049250313e-16 * largest
    for k in range(n):
        order[k] = k
    rank = 0
    for step in range(min(m, n)):
        size, row, col = 0.0, step, step
        for i in range(step, m):
            for k in range(step, n):
                if abs(U[i, k]) > size:
                    size, row, col = abs(U[i, k]), i, k
        if size <= tolerance:
            break
        for k in range(n):
            kept = U[step, k]
            U[step, k] = U[row, k]
            U[row, k] = kept
        for i in range(m):
            kept = U[i, step]
            U[i, step] = U[i, col]
            U[i, col] = kept
        column = order[step]
        order[step] = order[col]
        order[col] = column
        for i in range(step + 1, m):
            factor = U[i, step] / U[step, step]
            for k in range(step, n):
                U[i, k] -= factor * U[step, k]
        rank += 1
    for free in range(n - rank):
        for k in range(n):
            P[free, k] = 0.0
        P[free, order[rank + free]] = 1.0
        for back in range(rank):
            i = rank - 1 - back
            x = -U[i, rank + free]
            for k in range(i + 1, rank):
                x -= U[i, k] * P[free, order[k]]
            P[free, order[i]] = x / U[i, i]
    return rank
