"""Sparse block elimination of an unsymmetric matrix, on the pattern and in the order of `elimination`.

Two blocks for each pair of trees that elimination couples: the one below the diagonal, rows of the later tree, and
behind it the transpose of the one above: both have the same shape, and a product of two is always A B^T, as in
`block_cholesky`. Rows are exchanged within a block row: what one tree's dofs do to each other is the stiffest.
"""

from sheldrake.common.kernel import kernel
from sheldrake.multibody.contact_solvers._kernels.block_cholesky import (
    divide,
    subtract_block_times,
    subtract_product,
    subtract_transpose_times,
)
from sheldrake.multibody.contact_solvers._kernels.gradient import magnitude
from sheldrake.multibody.contact_solvers._kernels.status import SOLVED, TAMSI_FAILED


@kernel
def blocks_of(factor, e, columns):
    """(address of the block below the diagonal, of the transpose of the one above, rows of both) of entry e."""
    entry = factor.entries[e]
    rows = factor.blocks[entry.place].size
    return entry.address, entry.address + rows * columns, rows


@kernel
def swap(x, i, j):
    x[i], x[j] = x[j], x[i]


@kernel
def swap_rows(factor, k, a, b):
    """Exchanges two rows of block row k, from its diagonal block to the right, and of the right-hand side."""
    block = factor.blocks[k]
    n = block.size
    for c in range(n):
        swap(factor.L, block.diagonal + n * c + a, block.diagonal + n * c + b)
    for e in range(block.below_begin, block.below_end):
        _, above, rows = blocks_of(factor, e, n)
        for i in range(rows):
            swap(factor.L, above + rows * a + i, above + rows * b + i)
    swap(factor.rhs, block.first_slot + a, block.first_slot + b)


@kernel
def split_diagonal(factor, k):
    """Diagonal block k becomes L U: L below a diagonal of ones, 1 / U_ii on it; a status."""
    L = factor.L
    n, D = factor.blocks[k].size, factor.blocks[k].diagonal
    for c in range(n):
        column = D + n * c
        pivot = c
        largest = magnitude(L[column + c])
        for a in range(c + 1, n):
            if magnitude(L[column + a]) > largest:
                largest = magnitude(L[column + a])
                pivot = a
        if not largest > 0.0:
            return TAMSI_FAILED
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
    return SOLVED


@kernel
def split_column(factor, k):
    """Block column k, block row k and their part of the right-hand side, its diagonal block being split."""
    L, x = factor.L, factor.rhs
    block = factor.blocks[k]
    n, D, at = block.size, block.diagonal, block.first_slot
    for c in range(n):
        for a in range(c + 1, n):
            x[at + a] -= L[D + n * c + a] * x[at + c]
    for e in range(block.below_begin, block.below_end):
        below, above, rows = blocks_of(factor, e, n)
        divide(L, below, rows, D, n, 1, n, 0)  # by U
        divide(L, above, rows, D, n, n, 1, 1)  # by the transpose of L
        subtract_block_times(L, below, rows, n, x, at, factor.blocks[factor.entries[e].place].first_slot)


@kernel
def update_behind(factor, k):
    """Takes the product of block column k and block row k off what is behind them."""
    L = factor.L
    n = factor.blocks[k].size
    end = factor.blocks[k].below_end
    for e in range(factor.blocks[k].below_begin, end):
        behind = factor.blocks[factor.entries[e].place]
        below_j, above_j, columns = blocks_of(factor, e, n)
        subtract_product(L, behind.diagonal, below_j, above_j, columns, columns, n)
        g = behind.below_begin
        for f in range(e + 1, end):
            while factor.entries[g].place != factor.entries[f].place:
                g += 1
            below_i, above_i, rows = blocks_of(factor, f, n)
            below, above, _ = blocks_of(factor, g, columns)
            subtract_product(L, below, below_i, above_j, rows, columns, n)
            subtract_product(L, above, above_i, below_j, rows, columns, n)


@kernel
def substitute_back(factor, k):
    """The unknowns of block row k, those behind being known."""
    L, x = factor.L, factor.rhs
    block = factor.blocks[k]
    n, D, at = block.size, block.diagonal, block.first_slot
    for e in range(block.below_begin, block.below_end):
        _, above, rows = blocks_of(factor, e, n)
        subtract_transpose_times(L, above, rows, n, x, at, factor.blocks[factor.entries[e].place].first_slot)
    for c in range(n - 1, -1, -1):
        s = x[at + c]
        for a in range(c + 1, n):
            s -= L[D + n * a + c] * x[at + a]
        x[at + c] = s * L[D + n * c + c]


@kernel(outline=True)
def eliminate(factor, n):
    """rhs <- H^-1 rhs for the n block columns of H, which is lost; TAMSI_FAILED when a diagonal block is singular."""
    for k in range(n):
        if split_diagonal(factor, k) != SOLVED:
            return TAMSI_FAILED
        split_column(factor, k)
        update_behind(factor, k)
    for k in range(n - 1, -1, -1):
        substitute_back(factor, k)
    return SOLVED
