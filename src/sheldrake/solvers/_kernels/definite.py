"""Whether symmetric matrices have no negative eigenvalue, where elimination tells."""

from __future__ import annotations

from sheldrake.common.kernel import IntVector, Vector, kernel


@kernel
def has_factor(A, first, n):
    """Whether L D L' = A with D >= 0, found in place: pivots are positive, or zero with nothing beside them."""
    for k in range(n):
        pivot = A[first + k * n + k]
        if not pivot >= 0.0:
            return False
        for i in range(k + 1, n):
            below = A[first + i * n + k]
            if pivot == 0.0:
                if below != 0.0:
                    return False
            else:
                factor = below / pivot
                for j in range(k + 1, i + 1):
                    A[first + i * n + j] -= factor * A[first + j * n + k]
    return True


@kernel(top=True)
def have_factors(count: int, sizes: IntVector, numbers: Vector, found: IntVector) -> int:
    """Which of several symmetric matrices have factors L D L' with D >= 0; gives how many do.

    A matrix that has them has no eigenvalue below zero by more than rounding, some 1e-16 of its norm for each row; one
    that has none may have no such eigenvalue either.

    Args:
        count: How many there are.
        sizes: Their rows.
        numbers: Their entries, row by row, one matrix after the other; of no use afterwards.
        found: Filled with 1 and 0.
    """
    at, total = 0, 0
    for k in range(count):
        n = sizes[k]
        found[k] = 1 if has_factor(numbers, at, n) else 0
        total += found[k]
        at += n * n
    return total
