"""Sparse block Cholesky L L^T = H: a block for each pair of trees that elimination couples (see `elimination`).

Column after column, each one's update goes to the columns behind it at once (right-looking). Blocks are stored column
after column. Those of two free bodies, 6 by 6, are unrolled so that a column is a vector of the processor; the others
are loops. The diagonal of a diagonal block holds 1 / L_ii.
"""

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common.kernel import kernel
from sheldrake.multibody.contact_solvers._kernels.problem import (
    ADDRESS,
    BELOW_BEGIN,
    BELOW_END,
    BELOW_PLACE,
    DIAGONAL,
    FIRST_SLOT,
    SIZE,
)
from sheldrake.multibody.contact_solvers._kernels.six import SIX, dot_six, load_six, minus_scaled, store_six


@kernel(outline=True)
def subtract_product_of_six(L, C, A, B):
    """C -= A B^T of blocks 6 by 6."""
    a0 = load_six(L, A)
    a1 = load_six(L, A + 6)
    a2 = load_six(L, A + 12)
    a3 = load_six(L, A + 18)
    a4 = load_six(L, A + 24)
    a5 = load_six(L, A + 30)
    for b in range(SIX):
        x = load_six(L, C + SIX * b)
        x = minus_scaled(x, L[B + b], a0)
        x = minus_scaled(x, L[B + b + 6], a1)
        x = minus_scaled(x, L[B + b + 12], a2)
        x = minus_scaled(x, L[B + b + 18], a3)
        x = minus_scaled(x, L[B + b + 24], a4)
        x = minus_scaled(x, L[B + b + 30], a5)
        store_six(L, C + SIX * b, x)


@kernel
def subtract_product(L, C, A, B, rows, columns, inner):
    """C -= A B^T of blocks at these addresses: A is rows by inner, B columns by inner."""
    if rows == SIX and columns == SIX and inner == SIX:
        subtract_product_of_six(L, C, A, B)
    else:
        for b in range(columns):
            for c in range(inner):
                s = L[B + columns * c + b]
                for a in range(rows):
                    L[C + rows * b + a] -= L[A + rows * c + a] * s


@kernel
def factorise_diagonal(L, D, n):
    """Cholesky of the lower triangle of the block at D in place; 1 when a pivot is not positive, else 0."""
    for c in range(n):
        column = D + n * c
        for e in range(c):
            s = L[D + n * e + c]
            for a in range(c, n):
                L[column + a] -= L[D + n * e + a] * s
        if not L[column + c] > 0.0:
            return 1
        s = 1.0 / sqrt(L[column + c])
        L[column + c] = s
        for a in range(c + 1, n):
            L[column + a] *= s
    return 0


@kernel(outline=True)
def divide_six(L, B, D):
    """B <- B L_D^-T of blocks 6 by 6."""
    for c in range(SIX):
        x = load_six(L, B + SIX * c)
        for e in range(c):
            x = minus_scaled(x, L[D + SIX * e + c], load_six(L, B + SIX * e))
        s = L[D + SIX * c + c]
        store_six(L, B + SIX * c, (s * x[0], s * x[1], s * x[2], s * x[3], s * x[4], s * x[5]))


@kernel
def divide_by_diagonal(L, B, rows, D, n):
    """B <- B L_D^-T of the block at B, rows by n."""
    if rows == SIX and n == SIX:
        divide_six(L, B, D)
    else:
        for c in range(n):
            for e in range(c):
                s = L[D + n * e + c]
                for a in range(rows):
                    L[B + rows * c + a] -= L[B + rows * e + a] * s
            s = L[D + n * c + c]
            for a in range(rows):
                L[B + rows * c + a] *= s


@kernel(outline=True)
def factorise(factor, n):
    """Factorises the n block columns in place. Returns 1 when a pivot is not positive, else 0."""
    L = factor.L
    block = factor.block
    below = factor.below
    for k in range(n):
        inner = block[k, SIZE]
        if factorise_diagonal(L, block[k, DIAGONAL], inner) != 0:
            return 1
        begin = block[k, BELOW_BEGIN]
        end = block[k, BELOW_END]
        for e in range(begin, end):
            divide_by_diagonal(L, below[e, ADDRESS], block[below[e, BELOW_PLACE], SIZE], block[k, DIAGONAL], inner)
        for e in range(begin, end):
            B = below[e, ADDRESS]
            j = below[e, BELOW_PLACE]
            columns = block[j, SIZE]
            subtract_product(L, block[j, DIAGONAL], B, B, columns, columns, inner)
            g = block[j, BELOW_BEGIN]
            for f in range(e + 1, end):
                i = below[f, BELOW_PLACE]
                while below[g, BELOW_PLACE] != i:
                    g += 1
                subtract_product(L, below[g, ADDRESS], below[f, ADDRESS], B, block[i, SIZE], columns, inner)
    return 0


@kernel
def subtract_block_times(L, B, rows, n, x, at, to):
    """x[to..] -= B x[at..] of the block at B, rows by n."""
    if rows == SIX and n == SIX:
        y = load_six(x, to)
        for c in range(SIX):
            y = minus_scaled(y, x[at + c], load_six(L, B + SIX * c))
        store_six(x, to, y)
    else:
        for c in range(n):
            for a in range(rows):
                x[to + a] -= L[B + rows * c + a] * x[at + c]


@kernel
def subtract_transpose_times(L, B, rows, n, x, at, of):
    """x[at..] -= B^T x[of..] of the block at B, rows by n."""
    if rows == SIX and n == SIX:
        y = load_six(x, of)
        for c in range(SIX):
            x[at + c] -= dot_six(load_six(L, B + SIX * c), y)
    else:
        for c in range(n):
            s = x[at + c]
            for a in range(rows):
                s -= L[B + rows * c + a] * x[of + a]
            x[at + c] = s


@kernel(outline=True)
def substitute(factor, n):
    """rhs <- H^-1 rhs, forwards and backwards through the n block columns."""
    L = factor.L
    block = factor.block
    below = factor.below
    x = factor.rhs
    for k in range(n):
        size = block[k, SIZE]
        D = block[k, DIAGONAL]
        at = block[k, FIRST_SLOT]
        for c in range(size):
            s = x[at + c] * L[D + size * c + c]
            x[at + c] = s
            for a in range(c + 1, size):
                x[at + a] -= L[D + size * c + a] * s
        for e in range(block[k, BELOW_BEGIN], block[k, BELOW_END]):
            place = below[e, BELOW_PLACE]
            subtract_block_times(L, below[e, ADDRESS], block[place, SIZE], size, x, at, block[place, FIRST_SLOT])
    for k in range(n - 1, -1, -1):
        size = block[k, SIZE]
        D = block[k, DIAGONAL]
        at = block[k, FIRST_SLOT]
        for e in range(block[k, BELOW_BEGIN], block[k, BELOW_END]):
            place = below[e, BELOW_PLACE]
            subtract_transpose_times(L, below[e, ADDRESS], block[place, SIZE], size, x, at, block[place, FIRST_SLOT])
        for c in range(size - 1, -1, -1):
            s = x[at + c]
            for a in range(c + 1, size):
                s -= L[D + size * c + a] * x[at + a]
            x[at + c] = s * L[D + size * c + c]
