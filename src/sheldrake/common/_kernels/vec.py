"""Value types of the kernels: plain tuples, and the loads and stores between them and arrays.

Vec3 = 3 numbers. Quat = 4 (w, x, y, z). Mat3 = 9, row-major. Sym3 = 6 (xx, yy, zz, xy, xz, yz).
Vec6 = (angular Vec3, linear Vec3). Inertia = (mass, mass times centre of mass as Vec3, Sym3 about the origin).
"""

from __future__ import annotations

from sheldrake.common._kernels.generic import cos, is_positive, mul_add, sin, sqrt
from sheldrake.common.kernel import kernel

# ---- Vec3


@kernel
def add3(a, b):
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


@kernel
def sub3(a, b):
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


@kernel
def neg3(a):
    return (-a[0], -a[1], -a[2])


@kernel
def scale3(a, s):
    return (a[0] * s, a[1] * s, a[2] * s)


@kernel
def dot3(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@kernel
def cross3(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


# ---- rotations


@kernel
def rotate(R, p):
    """R p."""
    return (
        R[0] * p[0] + R[1] * p[1] + R[2] * p[2],
        R[3] * p[0] + R[4] * p[1] + R[5] * p[2],
        R[6] * p[0] + R[7] * p[1] + R[8] * p[2],
    )


@kernel
def rotate_back(R, p):
    """Rᵀ p."""
    return (
        R[0] * p[0] + R[3] * p[1] + R[6] * p[2],
        R[1] * p[0] + R[4] * p[1] + R[7] * p[2],
        R[2] * p[0] + R[5] * p[1] + R[8] * p[2],
    )


@kernel
def transpose(R):
    return (R[0], R[3], R[6], R[1], R[4], R[7], R[2], R[5], R[8])


@kernel
def axes(R):
    """The columns of a Mat3: of R_AB the axes of B in A."""
    return (R[0], R[3], R[6]), (R[1], R[4], R[7]), (R[2], R[5], R[8])


@kernel
def of_axes(x, y, z):
    """The Mat3 that has these columns."""
    return (x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2])


@kernel
def compose(A, B):
    """A B, of two Mat3."""
    return (
        A[0] * B[0] + A[1] * B[3] + A[2] * B[6],
        A[0] * B[1] + A[1] * B[4] + A[2] * B[7],
        A[0] * B[2] + A[1] * B[5] + A[2] * B[8],
        A[3] * B[0] + A[4] * B[3] + A[5] * B[6],
        A[3] * B[1] + A[4] * B[4] + A[5] * B[7],
        A[3] * B[2] + A[4] * B[5] + A[5] * B[8],
        A[6] * B[0] + A[7] * B[3] + A[8] * B[6],
        A[6] * B[1] + A[7] * B[4] + A[8] * B[7],
        A[6] * B[2] + A[7] * B[5] + A[8] * B[8],
    )


@kernel
def rotation_about(axis, angle):
    """Rotation about a unit axis by an angle [rad] (Rodrigues)."""
    return rotation_by(axis, sin(angle), cos(angle))


@kernel
def rotation_by(axis, s, c):
    """`rotation_about` by an angle of sine s and cosine c."""
    x, y, z = axis
    t = 1.0 - c
    return (
        c + t * x * x, t * x * y - s * z, t * x * z + s * y,
        t * x * y + s * z, c + t * y * y, t * y * z - s * x,
        t * x * z - s * y, t * y * z + s * x, c + t * z * z,
    )  # fmt: skip


@kernel
def rotation_of_quaternion(quat):
    """Rotation of a quaternion of any length, in Drake's order of operations."""
    w, x, y, z = quat
    s = 2.0 / (w * w + x * x + y * y + z * z)
    sx, sy, sz = s * x, s * y, s * z
    swx, swy, swz = sx * w, sy * w, sz * w
    sxx, sxy, sxz = sx * x, sy * x, sz * x
    syy, syz, szz = sy * y, sz * y, sz * z
    return (
        1.0 - syy - szz, sxy - swz, sxz + swy,
        sxy + swz, 1.0 - sxx - szz, syz - swx,
        sxz - swy, syz + swx, 1.0 - sxx - syy,
    )  # fmt: skip


@kernel(strict=True)
def quaternion_of_rotation(R):
    """The quaternion of unit length with w >= 0 of a rotation, in Drake's order of operations."""
    a, b, c, d, e, f, g, h, i = R
    trace = a + (e + i)
    if trace >= a and trace >= e and trace >= i:
        w, x, y, z = 1.0 + trace, h - f, c - g, d - b
    elif a >= e and a >= i:
        w, x, y, z = h - f, (a - (e + i)) + 1.0, b + d, c + g
    elif e >= i:
        w, x, y, z = c - g, b + d, (e - (i + a)) + 1.0, f + h
    else:
        w, x, y, z = d - b, c + g, f + h, (i - (a + e)) + 1.0
    k = 1.0 / sqrt((x * x + z * z) + (y * y + w * w))
    if w < 0.0:
        k = -k
    return (w * k, x * k, y * k, z * k)


@kernel
def quaternion_rate(quat, w_WB):
    """Time derivative of a quaternion for an angular velocity in W [rad/s]: 1/2 (0, w) times it, of any length."""
    w, x, y, z = quat
    a, b, c = scale3(w_WB, 0.5)
    return (
        -x * a - y * b - z * c,
        w * a + z * b - y * c,
        -z * a + w * b + x * c,
        y * a - x * b + w * c,
    )


@kernel
def rotate_symmetric(R, I):
    """R I Rᵀ of a Sym3."""
    xx, yy, zz, xy, xz, yz = I
    r0, r1, r2 = axes(transpose(R))
    t0, t1, t2 = axes(transpose(compose(R, (xx, xy, xz, xy, yy, yz, xz, yz, zz))))
    return (dot3(t0, r0), dot3(t1, r1), dot3(t2, r2), dot3(t0, r1), dot3(t0, r2), dot3(t1, r2))


# ---- spatial vectors


@kernel
def add6(A, B):
    return (add3(A[0], B[0]), add3(A[1], B[1]))


@kernel
def sub6(A, B):
    return (sub3(A[0], B[0]), sub3(A[1], B[1]))


@kernel
def scale6(A, s):
    return (scale3(A[0], s), scale3(A[1], s))


@kernel
def dot6(A, B):
    return dot3(A[0], B[0]) + dot3(A[1], B[1])


@kernel
def cross_motion(V, S):
    """V × S of two motion vectors (Featherstone 2008, eq. 2.31)."""
    w, v = V
    s, u = S
    return (cross3(w, s), add3(cross3(w, u), cross3(v, s)))


@kernel
def cross_force(V, F):
    """V ×* F of a motion and a force vector (Featherstone 2008, eq. 2.32)."""
    w, v = V
    t, f = F
    return (add3(cross3(w, t), cross3(v, f)), cross3(w, f))


# ---- spatial inertia


@kernel
def mul_symmetric(I, w):
    xx, yy, zz, xy, xz, yz = I
    return (
        xx * w[0] + xy * w[1] + xz * w[2],
        xy * w[0] + yy * w[1] + yz * w[2],
        xz * w[0] + yz * w[1] + zz * w[2],
    )


@kernel
def add_inertia(I, J):
    """Of two bodies that move as one, about the same point."""
    A, B = I[2], J[2]
    second = (A[0] + B[0], A[1] + B[1], A[2] + B[2], A[3] + B[3], A[4] + B[4], A[5] + B[5])
    return (I[0] + J[0], add3(I[1], J[1]), second)


@kernel
def mul_inertia(I, V):
    """Momentum (angular, linear) of an Inertia moving with V, about the same point."""
    mass, h, J = I
    w, v = V
    return (add3(mul_symmetric(J, w), cross3(h, v)), add3(scale3(v, mass), cross3(w, h)))


# ---- memory: row i of a 2-D array


@kernel
def load3(A, i):
    return (A[i, 0], A[i, 1], A[i, 2])


@kernel
def load6(A, i):
    return ((A[i, 0], A[i, 1], A[i, 2]), (A[i, 3], A[i, 4], A[i, 5]))


@kernel
def store3(A, i, a):
    A[i, 0], A[i, 1], A[i, 2] = a


@kernel
def store6(A, i, a):
    (A[i, 0], A[i, 1], A[i, 2]), (A[i, 3], A[i, 4], A[i, 5]) = a


@kernel
def column3(A, r, k):
    """Column k of the three rows r, r + 1, r + 2."""
    return (A[r, k], A[r + 1, k], A[r + 2, k])


@kernel
def store_column3(A, r, k, a):
    A[r, k], A[r + 1, k], A[r + 2, k] = a


# ---- memory: segment of a 1-D array


@kernel
def read3(q, k):
    return (q[k], q[k + 1], q[k + 2])


@kernel
def read4(q, k):
    return (q[k], q[k + 1], q[k + 2], q[k + 3])


@kernel
def read6(v, k):
    return ((v[k], v[k + 1], v[k + 2]), (v[k + 3], v[k + 4], v[k + 5]))


@kernel
def read9(p, k):
    return (p[k], p[k + 1], p[k + 2], p[k + 3], p[k + 4], p[k + 5], p[k + 6], p[k + 7], p[k + 8])


@kernel
def read_symmetric(p, k):
    """A Sym3."""
    return (p[k], p[k + 1], p[k + 2], p[k + 3], p[k + 4], p[k + 5])


@kernel
def write3(q, k, a):
    q[k], q[k + 1], q[k + 2] = a


@kernel
def write4(q, k, a):
    q[k], q[k + 1], q[k + 2], q[k + 3] = a


@kernel
def write6(v, k, a):
    (v[k], v[k + 1], v[k + 2]), (v[k + 3], v[k + 4], v[k + 5]) = a


@kernel
def write9(p, k, a):
    p[k], p[k + 1], p[k + 2], p[k + 3], p[k + 4], p[k + 5], p[k + 6], p[k + 7], p[k + 8] = a


# ---- numbers


@kernel
def root(x):
    """sqrt with a defined (zero) derivative at zero."""
    if x > 0.0:
        return sqrt(x)
    return 0.0 * x


@kernel
def magnitude(x):
    """|x| of a number or a dual."""
    return -x if x < 0.0 else x


# ---- six numbers at once
#
# What belongs to a tree of six dofs, mostly a free body. Loops over six cost more than what is in them; written out,
# the numbers are vectors of the processor.

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
def store_six_of(A, row, k, x):
    A[row, k], A[row, k + 1], A[row, k + 2], A[row, k + 3], A[row, k + 4], A[row, k + 5] = x


@kernel
def load_three_sixes(A, row, k):
    """Columns k .. k + 5 of three rows of a matrix, such as those of a contact's J."""
    return (load_six_of(A, row, k), load_six_of(A, row + 1, k), load_six_of(A, row + 2, k))


@kernel
def add_scaled_six(x, s, y):
    """x + s y of six numbers."""
    return (x[0] + s * y[0], x[1] + s * y[1], x[2] + s * y[2], x[3] + s * y[3], x[4] + s * y[4], x[5] + s * y[5])


@kernel
def add_three_sixes(to, s, x, y, z):
    """to + s[0] x + s[1] y + s[2] z of six numbers."""
    return add_scaled_six(add_scaled_six(add_scaled_six(to, s[0], x), s[1], y), s[2], z)


@kernel
def sum_of_sixes(s, x, y, z):
    """s[0] x + s[1] y + s[2] z of six numbers."""
    first = (s[0] * x[0], s[0] * x[1], s[0] * x[2], s[0] * x[3], s[0] * x[4], s[0] * x[5])
    return add_scaled_six(add_scaled_six(first, s[1], y), s[2], z)


@kernel(strict=True)  # as the event loop, which calls it, is
def copy_numbers(to, at, source, begin, n):
    """Copies n numbers, four at a time."""
    a = 0
    while a + 4 <= n:
        t, s = at + a, begin + a
        to[t], to[t + 1], to[t + 2], to[t + 3] = source[s], source[s + 1], source[s + 2], source[s + 3]
        a += 4
    while a < n:
        to[at + a] = source[begin + a]
        a += 1


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


@kernel
def subtract_two_scaled(L, to, s, of, r, at, n):
    """L[to ..] -= s L[of ..], then r L[at ..], of n numbers, the last ones four at a time."""
    a = 0
    while (n - a) % 4 != 0:
        L[to + a] = L[to + a] - s * L[of + a] - r * L[at + a]
        a += 1
    while a < n:
        t, o, i = to + a, of + a, at + a
        four = (
            L[t] - s * L[o] - r * L[i],
            L[t + 1] - s * L[o + 1] - r * L[i + 1],
            L[t + 2] - s * L[o + 2] - r * L[i + 2],
            L[t + 3] - s * L[o + 3] - r * L[i + 3],
        )
        L[t], L[t + 1], L[t + 2], L[t + 3] = four
        a += 4


@kernel
def pivots_of_two(L, row, above, n):
    """Two rows of a packed symmetric matrix, the upper one of n numbers and its diagonal, the lower one of one more.

    Takes the lower one from the upper one, and puts 1/D on both diagonals, so that no quotient waits for the other.

    Returns:
        (D of the lower row, and times that of the upper one): both are positive if the pivots are.
    """
    D, beside, D_above = L[row + n + 1], L[row + n], L[above + n]
    both = D * D_above - beside * beside
    r = 1.0 / D
    a = beside * r
    subtract_scaled(L, above, a, row, n)
    L[row + n + 1], L[row + n], L[above + n] = r, a, D / both
    return D, both


@kernel
def subtract_scaled_six(x, s, y):
    """x - s y of six numbers."""
    return (x[0] - s * y[0], x[1] - s * y[1], x[2] - s * y[2], x[3] - s * y[3], x[4] - s * y[4], x[5] - s * y[5])


@kernel
def add_six(x, y):
    return (x[0] + y[0], x[1] + y[1], x[2] + y[2], x[3] + y[3], x[4] + y[4], x[5] + y[5])


@kernel
def sub_six(x, y):
    return (x[0] - y[0], x[1] - y[1], x[2] - y[2], x[3] - y[3], x[4] - y[4], x[5] - y[5])


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
def packed_diagonal_six(A, at):
    """The diagonal of the matrix whose lower triangle is at A[at]."""
    return (A[at], A[at + 2], A[at + 5], A[at + 9], A[at + 14], A[at + 20])


@kernel
def inverse_packed_diagonal_six(A, at):
    """1 / the diagonal of the matrix whose lower triangle is at A[at]."""
    a, b, c, d, e, f = packed_diagonal_six(A, at)
    return (1.0 / a, 1.0 / b, 1.0 / c, 1.0 / d, 1.0 / e, 1.0 / f)


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


# ---- six columns at once
#
# What hangs on a free body: rows of a packed matrix that all begin with the same six columns. Most of what a factor of
# a legged robot costs is in these. Written out, the six rows of the free body stay in the processor while all other
# rows are taken from them, one after the other, in the order and with the bits of loops.


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


@kernel
def factorise_triangle(L, start):
    """Replaces a packed lower triangle of six rows by 1/D on the diagonal and the ones' triangle L below it.

    Without loops: they would cost more than what is in them.

    Returns:
        -1, or the row whose pivot is not positive.
    """
    bad = eliminate_two(L, start, 4, -1)
    bad = eliminate_two(L, start, 2, bad)
    return eliminate_two(L, start, 0, bad)


@kernel
def eliminate_two(L, start, k, bad):
    """Takes rows k + 1 and k from those above them, and puts 1/D there, so that no quotient waits for the other.

    Returns:
        The row whose pivot is not positive, else `bad`.
    """
    upper = start + k * (k + 1) // 2
    lower = upper + k + 1
    D, beside, D_upper = L[lower + k + 1], L[lower + k], L[upper + k]
    both = D * D_upper - beside * beside
    if not is_positive(both):
        bad = k
    if not is_positive(D):
        bad = k + 1
    r, s = 1.0 / D, D / both
    a = beside * r
    L[lower + k + 1], L[lower + k], L[upper + k] = r, a, s
    if k > 2:
        subtract(L, upper, a, lower, 4)
        subtract_both(L, start + 6, 3, lower, r, upper, s)
        subtract_both(L, start + 3, 2, lower, r, upper, s)
    elif k > 0:
        subtract(L, upper, a, lower, 2)
    if k > 0:
        subtract_both(L, start + 1, 1, lower, r, upper, s)
        subtract_both(L, start, 0, lower, r, upper, s)
    return bad


@kernel
def subtract(L, at, a, row, n):
    """Takes a times the first n numbers of a row, two or four, from another."""
    L[at] -= a * L[row]
    L[at + 1] -= a * L[row + 1]
    if n > 2:
        L[at + 2] -= a * L[row + 2]
        L[at + 3] -= a * L[row + 3]


@kernel
def subtract_both(L, at, i, lower, r, upper, s):
    """Takes two rows from row i, at `at`, in proportion to their own elements i, which become those of the triangle."""
    a, b = L[lower + i] * r, L[upper + i] * s
    L[at] -= a * L[lower] + b * L[upper]
    if i > 0:
        L[at + 1] -= a * L[lower + 1] + b * L[upper + 1]
    if i > 1:
        L[at + 2] -= a * L[lower + 2] + b * L[upper + 2]
    if i > 2:
        L[at + 3] -= a * L[lower + 3] + b * L[upper + 3]
    L[lower + i], L[upper + i] = a, b


@kernel
def eliminate_six(L, at, x):
    """x L^-1 of the triangle of ones and the numbers below them at L[at], row after row."""
    a, b, c, d, e, f = x
    a, b, c, d, e = a - L[at + 15] * f, b - L[at + 16] * f, c - L[at + 17] * f, d - L[at + 18] * f, e - L[at + 19] * f
    a, b, c, d = a - L[at + 10] * e, b - L[at + 11] * e, c - L[at + 12] * e, d - L[at + 13] * e
    a, b, c = a - L[at + 6] * d, b - L[at + 7] * d, c - L[at + 8] * d
    a, b = a - L[at + 3] * c, b - L[at + 4] * c
    return (a - L[at + 1] * b, b, c, d, e, f)


@kernel
def substitute_six(L, at, x):
    """L^-1 D^-1 x of the factor that `factorise_triangle` has left; what is known last is taken last."""
    a, b, c, d, e, f = x
    a = a * L[at]
    b = b * L[at + 2] - L[at + 1] * a
    c = c * L[at + 5] - L[at + 3] * a - L[at + 4] * b
    d = d * L[at + 9] - L[at + 6] * a - L[at + 7] * b - L[at + 8] * c
    e = e * L[at + 14] - L[at + 10] * a - L[at + 11] * b - L[at + 12] * c - L[at + 13] * d
    f = f * L[at + 20] - L[at + 15] * a - L[at + 16] * b - L[at + 17] * c - L[at + 18] * d - L[at + 19] * e
    return (a, b, c, d, e, f)
