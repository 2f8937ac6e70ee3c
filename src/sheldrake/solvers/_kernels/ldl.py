"""Sparse factors L D L' of symmetric matrices, row by row (T. A. Davis, "Algorithm 849: a concise sparse Cholesky
factorization package", ACM Transactions on Mathematical Software 31, 2005).

Matrices are given by the columns of their upper triangle: `starts` and `rows` as in SciPy's CSC, the diagonal last in
each column. Rows and columns are in the order in which they are eliminated.
"""

from __future__ import annotations

from sheldrake.common.kernel import IntVector, Vector, kernel


@kernel(top=True)
def analyze_ldl(starts: IntVector, rows: IntVector, parent: IntVector, flag: IntVector, counts: IntVector) -> int:
    """The elimination tree, and how many numbers each column of L has below its diagonal.

    Args:
        starts: Where each column begins, shape (n + 1,).
        rows: Rows of the entries.
        parent: Filled with the tree, shape (n,); -1 at roots.
        flag: Scratch, shape (n,).
        counts: Filled, shape (n,).
    """
    n = starts.shape[0] - 1
    for k in range(n):
        parent[k] = -1
        flag[k] = k
        counts[k] = 0
        for p in range(starts[k], starts[k + 1]):
            i = rows[p]
            while i < k and flag[i] != k:
                if parent[i] == -1:
                    parent[i] = k
                counts[i] += 1
                flag[i] = k
                i = parent[i]
    return 0


@kernel(top=True)
def factor_ldl(
    starts: IntVector,
    rows: IntVector,
    entries: Vector,
    shift: Vector,
    parent: IntVector,
    L_starts: IntVector,
    L_rows: IntVector,
    L: Vector,
    D: Vector,
    filled: IntVector,
    flag: IntVector,
    pattern: IntVector,
    y: Vector,
) -> int:
    """Factors A + diag(shift); gives how many pivots are negative, or -1 if one of them is no number.

    Args:
        starts: Where each column of A begins, shape (n + 1,).
        rows: Rows of the entries of A.
        entries: The entries of A.
        shift: What is added to the diagonal, shape (n,); a pivot of zero becomes this.
        parent: The elimination tree.
        L_starts: Where each column of L begins, shape (n + 1,).
        L_rows: Filled with the rows of L.
        L: Filled with its entries.
        D: Filled with the pivots, shape (n,).
        filled: Scratch, shape (n,).
        flag: Scratch, shape (n,).
        pattern: Scratch, shape (n,).
        y: Scratch, shape (n,).
    """
    n = starts.shape[0] - 1
    negative = 0
    for k in range(n):
        flag[k] = -1
        y[k] = 0.0
    for k in range(n):
        top = n
        flag[k] = k
        filled[k] = 0
        for p in range(starts[k], starts[k + 1]):
            i = rows[p]
            y[i] += entries[p]
            length = 0
            while flag[i] != k:
                pattern[length] = i
                length += 1
                flag[i] = k
                i = parent[i]
            while length > 0:
                length -= 1
                top -= 1
                pattern[top] = pattern[length]
        d = y[k] + shift[k]
        y[k] = 0.0
        for s in range(top, n):
            i = pattern[s]
            yi = y[i]
            y[i] = 0.0
            begin = L_starts[i]
            end = begin + filled[i]
            for p in range(begin, end):
                y[L_rows[p]] -= L[p] * yi
            l = yi / D[i]
            d -= l * yi
            L_rows[end] = k
            L[end] = l
            filled[i] += 1
        if d == 0.0:
            d = shift[k]
        if not (-1e300 < d and d < 1e300):
            return -1
        if d < 0.0:
            negative += 1
        D[k] = d
    return negative


@kernel(top=True)
def solve_ldl(
    starts: IntVector,
    rows: IntVector,
    entries: Vector,
    L_starts: IntVector,
    L_rows: IntVector,
    L: Vector,
    D: Vector,
    b: Vector,
    x: Vector,
    r: Vector,
    info: Vector,
) -> int:
    """x of A x = b, by factors of a matrix near A; improved until it is as exact as it becomes.

    Args:
        starts: Where each column of A begins, shape (n + 1,).
        rows: Rows of the entries of A.
        entries: The entries of A.
        L_starts: Where each column of L begins, shape (n + 1,).
        L_rows: Rows of L.
        L: Its entries.
        D: The pivots, shape (n,).
        b: The right side, shape (n,).
        x: Filled, shape (n,).
        r: Scratch, shape (n,).
        info: Filled with the largest residual, relative to the largest number in b, shape (1,).
    """
    n = b.shape[0]
    size = 1e-300
    for i in range(n):
        x[i] = 0.0
        r[i] = b[i]
        size = max(size, abs(b[i]))
    left = size
    for _ in range(12):
        for j in range(n):
            for p in range(L_starts[j], L_starts[j + 1]):
                r[L_rows[p]] -= L[p] * r[j]
        for j in range(n):
            r[j] /= D[j]
        for back in range(n):
            j = n - 1 - back
            for p in range(L_starts[j], L_starts[j + 1]):
                r[j] -= L[p] * r[L_rows[p]]
        for i in range(n):
            x[i] += r[i]
        for i in range(n):
            r[i] = b[i]
        for j in range(n):
            for p in range(starts[j], starts[j + 1]):
                i = rows[p]
                r[i] -= entries[p] * x[j]
                if i != j:
                    r[j] -= entries[p] * x[i]
        now = 0.0
        for i in range(n):
            now = max(now, abs(r[i]))
        if not (now < 1e300):
            info[0] = 1e300
            return 0
        if now <= 1e-13 * size or now > 0.5 * left:
            left = min(left, now)
            break
        left = now
    info[0] = left / size
    return 0
