"""Lemke's complementary pivots, with a covering vector of ones.

R. W. Cottle, J.-S. Pang and R. E. Stone, "The Linear Complementarity Problem", 1992, algorithms 4.4.5 and 4.9.3.
"""

from __future__ import annotations

from sheldrake.common.kernel import IntVector, Matrix, Vector, kernel

FOUND, RAY = 0, 1
_INFINITY = float("inf")
_TIED = 1e-12  # Ratios that differ by less are one, relative to those above one.


@kernel
def _set_up(T, basis, n, M, q):
    """The tableau [I, -M, -1, q] of w - M z - z_0 = q; the row with the least q."""
    row = 0
    for i in range(n):
        for k in range(n):
            T[i, k] = 1.0 if i == k else 0.0
            T[i, n + k] = -M[i, k]
        T[i, 2 * n] = -1.0
        T[i, 2 * n + 1] = q[i]
        basis[i] = i
        if q[i] < q[row]:
            row = i
    return row


@kernel
def _pivot(T, n, row, col):
    """Makes a column one of the identity."""
    width = 2 * n + 2
    pivot = T[row, col]
    for k in range(width):
        T[row, k] = T[row, k] / pivot
    for i in range(n):
        factor = T[i, col]
        if i != row and factor != 0.0:
            for k in range(width):
                T[i, k] -= factor * T[row, k]
    return 0


@kernel
def _comes_first(T, col, n, i, j):
    """Whether row i is before row j by the order of words, each divided by its entry in a column."""
    for k in range(n):
        a, b = T[i, k] / T[i, col], T[j, k] / T[j, col]
        if a != b:
            return a < b
    return False


@kernel
def _leaving(T, basis, col, n, tolerance):
    """The row that leaves: the artificial variable's among ties, else the first by the order of words; -1: a ray."""
    largest, last = 1.0, 2 * n + 1
    for i in range(n):
        largest = max(largest, abs(T[i, col]))
    least, found = _INFINITY, False
    for i in range(n):
        if T[i, col] > tolerance * largest:
            least = min(least, T[i, last] / T[i, col])
            found = True
    if not found:
        return -1
    row = -1
    for i in range(n):
        if T[i, col] > tolerance * largest and T[i, last] / T[i, col] <= least + _TIED * max(1.0, abs(least)):
            if basis[i] == 2 * n:
                return i
            if row < 0 or _comes_first(T, col, n, i, row):
                row = i
    return row


@kernel(top=True)
def lemke(n: int, M: Matrix, q: Vector, tolerance: float, T: Matrix, basis: IntVector, z: Vector) -> int:
    """Finds z >= 0 with w = M z + q >= 0 and z' w = 0, where some q is below zero; gives FOUND or RAY.

    Ties are broken by the order of words, so that it does not cycle.

    Args:
        n: How many variables there are.
        M: The matrix.
        q: The constant.
        tolerance: Entries of columns that are no more than this, relative to those above one, are none.
        T: Scratch, shape (n, 2 n + 2).
        basis: Scratch, shape (n,).
        z: Filled with what is found.
    """
    row = _set_up(T, basis, n, M, q)
    entering = 2 * n
    for _ in range(50 * n + 100):
        leaving = basis[row]
        _pivot(T, n, row, entering)
        basis[row] = entering
        if leaving == 2 * n:
            for i in range(n):
                z[i] = 0.0
            for i in range(n):
                if n <= basis[i] and basis[i] < 2 * n:
                    z[basis[i] - n] = max(T[i, 2 * n + 1], 0.0)
            return FOUND
        entering = leaving + n if leaving < n else leaving - n
        row = _leaving(T, basis, entering, n, tolerance)
        if row < 0:
            return RAY
    return RAY
