"""What hangs on a free body: rows of a packed matrix that all begin with the same six columns.

Most of what a factor of a legged robot costs is in these columns. Written out, the six rows of the free body stay in
the processor while all other rows are taken from them, one after the other, in the order and with the bits of loops.
"""

from __future__ import annotations

from sheldrake.common._kernels.vec import load_six, store_six
from sheldrake.common.kernel import kernel


@kernel
def subtract_dot_six(s, x, y):
    """s - x . y, one product after the other."""
    s -= x[0] * y[0]
    s -= x[1] * y[1]
    s -= x[2] * y[2]
    s -= x[3] * y[3]
    s -= x[4] * y[4]
    s -= x[5] * y[5]
    return s


@kernel
def subtract_dot_six_backwards(s, x, y):
    """The same, the last product first."""
    s -= x[5] * y[5]
    s -= x[4] * y[4]
    s -= x[3] * y[3]
    s -= x[2] * y[2]
    s -= x[1] * y[1]
    s -= x[0] * y[0]
    return s


@kernel
def add_dot_six_backwards(s, x, y):
    """s + x . y, one product after the other, the last first."""
    s += x[5] * y[5]
    s += x[4] * y[4]
    s += x[3] * y[3]
    s += x[2] * y[2]
    s += x[1] * y[1]
    s += x[0] * y[0]
    return s


@kernel
def read_triangle(L, at):
    """A packed lower triangle of six rows."""
    return load_six(L, at), load_six(L, at + 6), load_six(L, at + 12), (L[at + 18], L[at + 19], L[at + 20])


@kernel
def write_triangle(L, at, S):
    """A packed lower triangle of six rows."""
    first, second, third, (x, y, z) = S
    store_six(L, at, first)
    store_six(L, at + 6, second)
    store_six(L, at + 12, third)
    L[at + 18], L[at + 19], L[at + 20] = x, y, z


@kernel
def subtract_dyad(S, a, b):
    """S - a bᵀ of a packed lower triangle."""
    (p0, p1, p2, p3, p4, p5), (q0, q1, q2, q3, q4, q5), (r0, r1, r2, r3, r4, r5), (s0, s1, s2) = S
    p0 -= a[0] * b[0]
    p1 -= a[1] * b[0]
    p2 -= a[1] * b[1]
    p3 -= a[2] * b[0]
    p4 -= a[2] * b[1]
    p5 -= a[2] * b[2]
    q0 -= a[3] * b[0]
    q1 -= a[3] * b[1]
    q2 -= a[3] * b[2]
    q3 -= a[3] * b[3]
    q4 -= a[4] * b[0]
    q5 -= a[4] * b[1]
    r0 -= a[4] * b[2]
    r1 -= a[4] * b[3]
    r2 -= a[4] * b[4]
    r3 -= a[5] * b[0]
    r4 -= a[5] * b[1]
    r5 -= a[5] * b[2]
    s0 -= a[5] * b[3]
    s1 -= a[5] * b[4]
    s2 -= a[5] * b[5]
    return (p0, p1, p2, p3, p4, p5), (q0, q1, q2, q3, q4, q5), (r0, r1, r2, r3, r4, r5), (s0, s1, s2)


@kernel
def take_row(L, row, r, S):
    """Takes the row that begins at `row` from the triangle S, r being 1/D of it; the six columns become those of L."""
    b = load_six(L, row)
    a = (b[0] * r, b[1] * r, b[2] * r, b[3] * r, b[4] * r, b[5] * r)
    store_six(L, row, a)
    return subtract_dyad(S, a, b)
