"""Six numbers at once: what belongs to a tree of six dofs, mostly a free body.

Loops over six cost more than what is in them; written out, the numbers are vectors of the processor.
"""

from sheldrake.common._kernels.generic import mul_add
from sheldrake.common.kernel import kernel

SIX = 6


@kernel
def load_six(L, i):
    return (L[i], L[i + 1], L[i + 2], L[i + 3], L[i + 4], L[i + 5])


@kernel
def store_six(L, i, x):
    L[i], L[i + 1], L[i + 2], L[i + 3], L[i + 4], L[i + 5] = x


@kernel
def load_six_of(A, row, k):
    """Columns k .. k + 5 of a row of a matrix."""
    return (A[row, k], A[row, k + 1], A[row, k + 2], A[row, k + 3], A[row, k + 4], A[row, k + 5])


@kernel
def load_three_sixes(J, k):
    """Columns k .. k + 5 of the three rows of a contact's J."""
    return (load_six_of(J, 0, k), load_six_of(J, 1, k), load_six_of(J, 2, k))


@kernel
def plus_scaled(x, s, y):
    """x + s y of six numbers."""
    return (x[0] + s * y[0], x[1] + s * y[1], x[2] + s * y[2], x[3] + s * y[3], x[4] + s * y[4], x[5] + s * y[5])


@kernel
def minus_scaled(x, s, y):
    """x - s y of six numbers."""
    return (x[0] - s * y[0], x[1] - s * y[1], x[2] - s * y[2], x[3] - s * y[3], x[4] - s * y[4], x[5] - s * y[5])


@kernel
def times_six(x, y):
    """Products of six pairs of numbers."""
    return (x[0] * y[0], x[1] * y[1], x[2] * y[2], x[3] * y[3], x[4] * y[4], x[5] * y[5])


@kernel
def norm2(x, y, z):
    return mul_add(z, z, mul_add(y, y, x * x))


@kernel
def norms2_six(x, y, z):
    """Squares of the lengths of six vectors of these components."""
    return (
        norm2(x[0], y[0], z[0]),
        norm2(x[1], y[1], z[1]),
        norm2(x[2], y[2], z[2]),
        norm2(x[3], y[3], z[3]),
        norm2(x[4], y[4], z[4]),
        norm2(x[5], y[5], z[5]),
    )


@kernel
def dot_six(x, y):
    """Scalar product, one product after the other: in pairs they would be put into vectors, only to be taken apart."""
    s = mul_add(x[2], y[2], mul_add(x[1], y[1], x[0] * y[0]))
    return mul_add(x[5], y[5], mul_add(x[4], y[4], mul_add(x[3], y[3], s)))


@kernel
def mul_packed_six(A, at, x):
    """A x of the symmetric matrix whose lower triangle is at A[at], row after row, 21 numbers."""
    a, b, c, d, e, f = at, at + 1, at + 3, at + 6, at + 10, at + 15  # where rows begin
    return (
        dot_six((A[a], A[b], A[c], A[d], A[e], A[f]), x),
        dot_six((A[b], A[b + 1], A[c + 1], A[d + 1], A[e + 1], A[f + 1]), x),
        dot_six((A[c], A[c + 1], A[c + 2], A[d + 2], A[e + 2], A[f + 2]), x),
        dot_six((A[d], A[d + 1], A[d + 2], A[d + 3], A[e + 3], A[f + 3]), x),
        dot_six((A[e], A[e + 1], A[e + 2], A[e + 3], A[e + 4], A[f + 4]), x),
        dot_six((A[f], A[f + 1], A[f + 2], A[f + 3], A[f + 4], A[f + 5]), x),
    )


@kernel
def inverse_packed_diagonal_six(A, at):
    """1 / the diagonal of the matrix whose lower triangle is at A[at]."""
    return (1.0 / A[at], 1.0 / A[at + 2], 1.0 / A[at + 5], 1.0 / A[at + 9], 1.0 / A[at + 14], 1.0 / A[at + 20])


@kernel
def put_packed_six(L, D, A, at):
    """The lower triangle of the block at D, column after column, from the one at A[at], row after row."""
    a, b, c, d, e, f = at, at + 1, at + 3, at + 6, at + 10, at + 15
    store_six(L, D, (A[a], A[b], A[c], A[d], A[e], A[f]))
    L[D + 7], L[D + 8], L[D + 9], L[D + 10], L[D + 11] = A[b + 1], A[c + 1], A[d + 1], A[e + 1], A[f + 1]
    L[D + 14], L[D + 15], L[D + 16], L[D + 17] = A[c + 2], A[d + 2], A[e + 2], A[f + 2]
    L[D + 21], L[D + 22], L[D + 23] = A[d + 3], A[e + 3], A[f + 3]
    L[D + 28], L[D + 29] = A[e + 4], A[f + 4]
    L[D + 35] = A[f + 5]
