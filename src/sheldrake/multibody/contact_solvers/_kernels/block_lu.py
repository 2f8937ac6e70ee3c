"""Sparse block elimination of an unsymmetric matrix, on the pattern and in the order of `elimination`.

Two blocks for each pair of trees that elimination couples: the one below the diagonal, rows of the later tree, and
behind it the transpose of the one above: both have the same shape, and a product of two is always A B^T, as in
`block_cholesky`. Rows are exchanged within a block row: what one tree's dofs do to each other is the stiffest.
"""

import numpy as np

from sheldrake.common.kernel import kernel
from sheldrake.multibody.contact_solvers._kernels.block_cholesky import (
    SIX,
    load_six,
    minus_scaled,
    store_six,
    subtract_block_times,
    subtract_product,
    subtract_transpose_times,
)
from sheldrake.multibody.contact_solvers._kernels.line_search import magnitude
from sheldrake.multibody.contact_solvers._kernels.problem import (
    ADDRESS,
    BELOW_BEGIN,
    BELOW_END,
    BELOW_PLACE,
    DIAGONAL,
    FIRST_SLOT,
    SIZE,
)

ONE = np.int64(1)


@kernel
def blocks_of(factor, e, columns):
    """(address of the block below the diagonal, of the transpose of the one above, rows of both) of entry e."""
    B = factor.below[e, ADDRESS]
    rows = factor.block[factor.below[e, BELOW_PLACE], SIZE]
    return B, B + rows * columns, rows


@kernel
def swap(x, i, j):
    y = x[i]
    x[i] = x[j]
    x[j] = y


@kernel
def swap_rows(factor, k, a, b):
    """Exchanges two rows of block row k, from its diagonal block to the right, and of the right-hand side."""
    n = factor.block[k, SIZE]
    D = factor.block[k, DIAGONAL]
    for c in range(n):
        swap(factor.L, D + n * c + a, D + n * c + b)
    for e in range(factor.block[k, BELOW_BEGIN], factor.block[k, BELOW_END]):
        _, above, rows = blocks_of(factor, e, n)
        for i in range(rows):
            swap(factor.L, above + rows * a + i, above + rows * b + i)
    swap(factor.rhs, factor.block[k, FIRST_SLOT] + a, factor.block[k, FIRST_SLOT] + b)


@kernel
def split_diagonal(factor, k):
    """Diagonal block k becomes L U: L below a diagonal of ones, 1 / U_ii on it; 1 when singular, else 0."""
    L = factor.L
    n = factor.block[k, SIZE]
    D = factor.block[k, DIAGONAL]
    for c in range(n):
        column = D + n * c
        pivot = c
        largest = magnitude(L[column + c])
        for a in range(c + 1, n):
            if magnitude(L[column + a]) > largest:
                largest = magnitude(L[column + a])
                pivot = a
        if not largest > 0.0:
            return 1
        if pivot != c:
            swap_rows(factor, k, c, pivot)
        s = 1.0 / L[column + c]
        L[column + c] = s
        for a in range(c + 1, n):
            L[column + a] *= s
        for b in range(c + 1, n):
            u = L[D + n * b + c]
            for a in range(c + 1, n):
                L[D + n * b + a] -= L[column + a] * u
    return 0


@kernel(outline=True)
def divide_six(L, B, D, across, along, ones):
    """`divide` of a block 6 by 6."""
    for c in range(SIX):
        x = load_six(L, B + SIX * c)
        for e in range(c):
            x = minus_scaled(x, L[D + across * e + along * c], load_six(L, B + SIX * e))
        if ones == 0:
            s = L[D + SIX * c + c]
            x = (s * x[0], s * x[1], s * x[2], s * x[3], s * x[4], s * x[5])
        store_six(L, B + SIX * c, x)


@kernel
def divide(L, B, rows, D, n, across, along, ones):
    """B <- B T^-1, T upper triangular with T_ec at D + across e + along c and 1 / T_cc on the diagonal, or ones."""
    if rows == SIX and n == SIX:
        divide_six(L, B, D, across, along, ones)
    else:
        for c in range(n):
            for e in range(c):
                s = L[D + across * e + along * c]
                for a in range(rows):
                    L[B + rows * c + a] -= L[B + rows * e + a] * s
            if ones == 0:
                for a in range(rows):
                    L[B + rows * c + a] *= L[D + n * c + c]


@kernel
def split_column(factor, k):
    """Block column k, block row k and their part of the right-hand side, its diagonal block being split."""
    L = factor.L
    x = factor.rhs
    n = factor.block[k, SIZE]
    D = factor.block[k, DIAGONAL]
    at = factor.block[k, FIRST_SLOT]
    for c in range(n):
        for a in range(c + 1, n):
            x[at + a] -= L[D + n * c + a] * x[at + c]
    for e in range(factor.block[k, BELOW_BEGIN], factor.block[k, BELOW_END]):
        below, above, rows = blocks_of(factor, e, n)
        divide(L, below, rows, D, n, ONE, n, 0)  # by U
        divide(L, above, rows, D, n, n, ONE, 1)  # by the transpose of L
        subtract_block_times(L, below, rows, n, x, at, factor.block[factor.below[e, BELOW_PLACE], FIRST_SLOT])


@kernel
def update_behind(factor, k):
    """Takes the product of block column k and block row k off what is behind them."""
    L = factor.L
    n = factor.block[k, SIZE]
    end = factor.block[k, BELOW_END]
    for e in range(factor.block[k, BELOW_BEGIN], end):
        j = factor.below[e, BELOW_PLACE]
        below_j, above_j, columns = blocks_of(factor, e, n)
        subtract_product(L, factor.block[j, DIAGONAL], below_j, above_j, columns, columns, n)
        g = factor.block[j, BELOW_BEGIN]
        for f in range(e + 1, end):
            while factor.below[g, BELOW_PLACE] != factor.below[f, BELOW_PLACE]:
                g += 1
            below_i, above_i, rows = blocks_of(factor, f, n)
            below, above, _ = blocks_of(factor, g, columns)
            subtract_product(L, below, below_i, above_j, rows, columns, n)
            subtract_product(L, above, above_i, below_j, rows, columns, n)


@kernel
def substitute_back(factor, k):
    """The unknowns of block row k, those behind being known."""
    L = factor.L
    x = factor.rhs
    n = factor.block[k, SIZE]
    D = factor.block[k, DIAGONAL]
    at = factor.block[k, FIRST_SLOT]
    for e in range(factor.block[k, BELOW_BEGIN], factor.block[k, BELOW_END]):
        _, above, rows = blocks_of(factor, e, n)
        subtract_transpose_times(L, above, rows, n, x, at, factor.block[factor.below[e, BELOW_PLACE], FIRST_SLOT])
    for c in range(n - 1, -1, -1):
        s = x[at + c]
        for a in range(c + 1, n):
            s -= L[D + n * a + c] * x[at + a]
        x[at + c] = s * L[D + n * c + c]


@kernel(outline=True)
def eliminate(factor, n):
    """rhs <- H^-1 rhs for the n block columns of H, which is lost; 1 when a diagonal block is singular, else 0."""
    for k in range(n):
        if split_diagonal(factor, k) != 0:
            return 1
        split_column(factor, k)
        update_behind(factor, k)
    for k in range(n - 1, -1, -1):
        substitute_back(factor, k)
    return 0
