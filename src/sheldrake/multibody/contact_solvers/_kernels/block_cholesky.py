"""Sparse block Cholesky L L^T = H: a block for each pair of trees that elimination couples (see `elimination`).

Column after column, each one's update goes to the columns behind it at once (right-looking). Blocks are stored column
after column. Those of two free bodies, 6 by 6, are unrolled so that a column is a vector of the processor; the others
are loops. The diagonal of a diagonal block holds 1 / L_ii.
"""

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common.kernel import kernel
from sheldrake.multibody.contact_solvers._kernels.six import SIX, dot_six, load_six, minus_scaled, store_six
from sheldrake.multibody.contact_solvers._kernels.status import HESSIAN_NOT_POSITIVE, SOLVED


@kernel
def subtract_scaled(L, to, s, of, n):
    """L[to ..] -= s L[of ..] of n numbers, the last ones four at a time."""
    a = 0
    while (n - a) % 4 != 0:
        L[to + a] -= s * L[of + a]
        a += 1
    while a < n:
        t = to + a
        o = of + a
        four = L[t] - s * L[o], L[t + 1] - s * L[o + 1], L[t + 2] - s * L[o + 2], L[t + 3] - s * L[o + 3]
        L[t], L[t + 1], L[t + 2], L[t + 3] = four
        a += 4


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
    """Cholesky of the lower triangle of the block at D in place; a status."""
    for c in range(n):
        column = D + n * c
        for e in range(c):
            subtract_scaled(L, column + c, L[D + n * e + c], D + n * e + c, n - c)
        if not L[column + c] > 0.0:
            return HESSIAN_NOT_POSITIVE
        s = 1.0 / sqrt(L[column + c])
        L[column + c] = s
        for a in range(c + 1, n):
            L[column + a] *= s
    return SOLVED


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
                s = L[D + n * c + c]
                for a in range(rows):
                    L[B + rows * c + a] *= s


@kernel(outline=True)
def factorise(factor, n):
    """Factorises the n block columns in place; a status."""
    L = factor.L
    for k in range(n):
        column = factor.blocks[k]
        inner = column.size
        if factorise_diagonal(L, column.diagonal, inner) != SOLVED:
            return HESSIAN_NOT_POSITIVE
        for e in range(column.below_begin, column.below_end):
            entry = factor.entries[e]
            divide(L, entry.address, factor.blocks[entry.place].size, column.diagonal, inner, inner, 1, 0)  # by L^T
        for e in range(column.below_begin, column.below_end):
            B = factor.entries[e].address
            behind = factor.blocks[factor.entries[e].place]
            subtract_product(L, behind.diagonal, B, B, behind.size, behind.size, inner)
            g = behind.below_begin
            for f in range(e + 1, column.below_end):
                entry = factor.entries[f]
                while factor.entries[g].place != entry.place:
                    g += 1
                rows = factor.blocks[entry.place].size
                subtract_product(L, factor.entries[g].address, entry.address, B, rows, behind.size, inner)
    return SOLVED


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


@kernel
def forwards(L, D, n, x, at):
    """x[at..] <- L_D^-1 x[at..], L_D being the diagonal block at D."""
    if n == SIX:
        a, b, c, d, e, f = load_six(x, at)
        a *= L[D]
        b = (b - L[D + 1] * a) * L[D + 7]
        c = (c - L[D + 2] * a - L[D + 8] * b) * L[D + 14]
        d = (d - L[D + 3] * a - L[D + 9] * b - L[D + 15] * c) * L[D + 21]
        e = (e - L[D + 4] * a - L[D + 10] * b - L[D + 16] * c - L[D + 22] * d) * L[D + 28]
        f = (f - L[D + 5] * a - L[D + 11] * b - L[D + 17] * c - L[D + 23] * d - L[D + 29] * e) * L[D + 35]
        store_six(x, at, (a, b, c, d, e, f))
    else:
        for k in range(n):
            s = x[at + k] * L[D + n * k + k]
            x[at + k] = s
            for i in range(k + 1, n):
                x[at + i] -= L[D + n * k + i] * s


@kernel
def backwards(L, D, n, x, at):
    """x[at..] <- L_D^-T x[at..]."""
    if n == SIX:
        a, b, c, d, e, f = load_six(x, at)
        f *= L[D + 35]
        e = (e - L[D + 29] * f) * L[D + 28]
        d = (d - L[D + 23] * f - L[D + 22] * e) * L[D + 21]
        c = (c - L[D + 17] * f - L[D + 16] * e - L[D + 15] * d) * L[D + 14]
        b = (b - L[D + 11] * f - L[D + 10] * e - L[D + 9] * d - L[D + 8] * c) * L[D + 7]
        a = (a - L[D + 5] * f - L[D + 4] * e - L[D + 3] * d - L[D + 2] * c - L[D + 1] * b) * L[D]
        store_six(x, at, (a, b, c, d, e, f))
    else:
        for k in range(n - 1, -1, -1):
            s = x[at + k] * L[D + n * k + k]
            x[at + k] = s
            for i in range(k):
                x[at + i] -= L[D + n * i + k] * s


@kernel(outline=True)
def substitute(factor, n):
    """rhs <- H^-1 rhs, forwards and backwards through the n block columns."""
    L, x = factor.L, factor.rhs
    for k in range(n):
        column = factor.blocks[k]
        size, at = column.size, column.first_slot
        forwards(L, column.diagonal, size, x, at)
        for e in range(column.below_begin, column.below_end):
            entry = factor.entries[e]
            row = factor.blocks[entry.place]
            subtract_block_times(L, entry.address, row.size, size, x, at, row.first_slot)
    for k in range(n - 1, -1, -1):
        column = factor.blocks[k]
        size, at = column.size, column.first_slot
        for e in range(column.below_begin, column.below_end):
            entry = factor.entries[e]
            row = factor.blocks[entry.place]
            subtract_transpose_times(L, entry.address, row.size, size, x, at, row.first_slot)
        backwards(L, column.diagonal, size, x, at)
