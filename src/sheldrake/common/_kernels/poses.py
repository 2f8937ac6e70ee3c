"""Rotations and poses by themselves, in the order of operations of the methods that they are short ways for.

Matrices are vectors of 9, row by row; products of matrices are summed as BLAS sums them, with one rounding a term.
"""

from __future__ import annotations

from sheldrake.common._kernels.generic import atan2, cos, mul_add, sin, sqrt
from sheldrake.common._kernels.vec import (
    magnitude,
    quaternion_of_rotation,
    read3,
    read4,
    read9,
    transpose,
    write3,
    write4,
    write9,
)
from sheldrake.common.kernel import Vector, kernel

NOT_UNIT = 1
"""Status: the length of what must be one is not."""
_TOLERANCE = 1e-5  # as in `common/_turning.py`
_MISTAKE = 0.1  # as in `math/_rotation_matrix.py`
_EPSILON = 2.220446049250313e-16
_SURE = 100.0 * _EPSILON  # of the 128 that a rotation may be off, rounding in another order left out
_PI = 3.141592653589793


@kernel(strict=True)
def row_times(a, b, c, x, y, z):
    """The product of a row and a column, as BLAS sums it in a product of matrices."""
    return mul_add(c, z, mul_add(b, y, a * x))


@kernel(strict=True)
def product(A, B):
    return (
        row_times(A[0], A[1], A[2], B[0], B[3], B[6]),
        row_times(A[0], A[1], A[2], B[1], B[4], B[7]),
        row_times(A[0], A[1], A[2], B[2], B[5], B[8]),
        row_times(A[3], A[4], A[5], B[0], B[3], B[6]),
        row_times(A[3], A[4], A[5], B[1], B[4], B[7]),
        row_times(A[3], A[4], A[5], B[2], B[5], B[8]),
        row_times(A[6], A[7], A[8], B[0], B[3], B[6]),
        row_times(A[6], A[7], A[8], B[1], B[4], B[7]),
        row_times(A[6], A[7], A[8], B[2], B[5], B[8]),
    )


@kernel(strict=True)
def turned(R, p):
    """R p, as BLAS sums it in a product with a vector."""
    return (
        row_times(R[1], R[0], R[2], p[1], p[0], p[2]),
        row_times(R[4], R[3], R[5], p[1], p[0], p[2]),
        row_times(R[7], R[6], R[8], p[1], p[0], p[2]),
    )


@kernel(top=True, strict=True)
def compose_poses(R_AB: Vector, p_AB: Vector, R_BC: Vector, p_BC: Vector, R_AC: Vector, p_AC: Vector) -> None:
    """X_AC of X_AB and X_BC."""
    R, p = read9(R_AB, 0), turned(read9(R_AB, 0), read3(p_BC, 0))
    write9(R_AC, 0, product(R, read9(R_BC, 0)))
    write3(p_AC, 0, (p[0] + p_AB[0], p[1] + p_AB[1], p[2] + p_AB[2]))


@kernel(top=True, strict=True)
def turn_vector(R_AB: Vector, v_B: Vector, v_A: Vector) -> None:
    """v_A of R_AB and v_B."""
    write3(v_A, 0, turned(read9(R_AB, 0), read3(v_B, 0)))


@kernel(top=True, strict=True)
def move_point(R_AB: Vector, p_AB: Vector, p_BQ: Vector, p_AQ: Vector) -> None:
    """p_AQ of X_AB and p_BQ."""
    p = turned(read9(R_AB, 0), read3(p_BQ, 0))
    write3(p_AQ, 0, (p[0] + p_AB[0], p[1] + p_AB[1], p[2] + p_AB[2]))


@kernel(top=True, strict=True)
def invert_pose(R_AB: Vector, p_AB: Vector, R_BA: Vector, p_BA: Vector) -> None:
    """X_BA of X_AB."""
    R = transpose(read9(R_AB, 0))
    p = turned(R, read3(p_AB, 0))
    write9(R_BA, 0, R)
    write3(p_BA, 0, (-p[0], -p[1], -p[2]))


@kernel(top=True, strict=True)
def invert_and_compose_poses(
    R_AB: Vector, p_AB: Vector, R_AC: Vector, p_AC: Vector, R_BC: Vector, p_BC: Vector
) -> None:
    """X_BC of X_AB and X_AC."""
    R, p, q = transpose(read9(R_AB, 0)), read3(p_AB, 0), read3(p_AC, 0)
    x, y, z = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    write9(R_BC, 0, product(R, read9(R_AC, 0)))
    write3(
        p_BC,
        0,
        (
            row_times(R[0], R[1], R[2], x, y, z),
            row_times(R[3], R[4], R[5], x, y, z),
            row_times(R[6], R[7], R[8], x, y, z),
        ),
    )


@kernel(top=True, strict=True)
def are_poses_near(R_AB: Vector, p_AB: Vector, R_AC: Vector, p_AC: Vector, tolerance: float, answer: Vector) -> None:
    """Whether no number of two poses differs by more than the tolerance."""
    near = 1.0
    for i in range(9):
        near = near if magnitude(R_AB[i] - R_AC[i]) <= tolerance else 0.0
    for i in range(3):
        near = near if magnitude(p_AB[i] - p_AC[i]) <= tolerance else 0.0
    answer[0] = near


@kernel(top=True, strict=True)
def are_poses_equal(R_AB: Vector, p_AB: Vector, R_AC: Vector, p_AC: Vector, answer: Vector) -> None:
    """Whether all numbers of two poses are equal."""
    same = 1.0
    for i in range(9):
        same = same if R_AB[i] == R_AC[i] else 0.0
    for i in range(3):
        same = same if p_AB[i] == p_AC[i] else 0.0
    answer[0] = same


@kernel(top=True, strict=True)
def difference_of_poses(R_AB: Vector, p_AB: Vector, R_AC: Vector, p_AC: Vector, answer: Vector) -> int:
    """The largest difference between numbers of two poses; none where a difference is none."""
    largest = 0.0
    for i in range(9):
        difference = magnitude(R_AB[i] - R_AC[i])
        if not difference >= 0.0:
            return NOT_UNIT
        largest = max(largest, difference)
    for i in range(3):
        difference = magnitude(p_AB[i] - p_AC[i])
        if not difference >= 0.0:
            return NOT_UNIT
        largest = max(largest, difference)
    answer[0] = largest
    return 0


@kernel(top=True, strict=True)
def are_rotations_near(R_AB: Vector, R_AC: Vector, tolerance: float, answer: Vector) -> None:
    """Whether no number of two rotations differs by more than the tolerance."""
    near = 1.0
    for i in range(9):
        near = near if magnitude(R_AB[i] - R_AC[i]) <= tolerance else 0.0
    answer[0] = near


@kernel(top=True, strict=True)
def are_rotations_equal(R_AB: Vector, R_AC: Vector, answer: Vector) -> None:
    """Whether all numbers of two rotations are equal."""
    same = 1.0
    for i in range(9):
        same = same if R_AB[i] == R_AC[i] else 0.0
    answer[0] = same


@kernel(top=True, strict=True)
def invert_and_compose_rotations(R_AB: Vector, R_AC: Vector, R_BC: Vector) -> None:
    """R_BC of R_AB and R_AC."""
    write9(R_BC, 0, product(transpose(read9(R_AB, 0)), read9(R_AC, 0)))


@kernel(top=True, strict=True)
def is_rotation_valid(R: Vector, answer: Vector) -> int:
    """One where nine numbers are clearly a rotation matrix; of others nothing is said."""
    a, b, c, d, e, f, g, h, i = read9(R, 0)
    worst = max(magnitude(a * a + b * b + c * c - 1.0), magnitude(d * d + e * e + f * f - 1.0))
    worst = max(worst, max(magnitude(g * g + h * h + i * i - 1.0), magnitude(a * d + b * e + c * f)))
    worst = max(worst, max(magnitude(a * g + b * h + c * i), magnitude(d * g + e * h + f * i)))
    if not (worst < _SURE and a * (e * i - f * h) + b * (f * g - d * i) + c * (d * h - e * g) > 0.5):
        return NOT_UNIT
    answer[0] = 1.0
    return 0


@kernel(top=True)
def pose_matrix(R_AB: Vector, p_AB: Vector, X_AB: Vector) -> None:
    """The first three rows of the homogeneous matrix, or all four, as long as the answer is."""
    for i in range(3):
        for j in range(3):
            X_AB[4 * i + j] = R_AB[3 * i + j]
        X_AB[4 * i + 3] = p_AB[i]
    if X_AB.shape[0] == 16:
        X_AB[12], X_AB[13], X_AB[14], X_AB[15] = 0.0, 0.0, 0.0, 1.0


@kernel(top=True, strict=True)
def compose_rotations(R_AB: Vector, R_BC: Vector, R_AC: Vector) -> None:
    """R_AC of R_AB and R_BC."""
    write9(R_AC, 0, product(read9(R_AB, 0), read9(R_BC, 0)))


@kernel(top=True)
def invert_rotation(R_AB: Vector, R_BA: Vector) -> None:
    """R_BA of R_AB."""
    write9(R_BA, 0, transpose(read9(R_AB, 0)))


@kernel(top=True, strict=True)
def rotation_about_axis(theta: float, axis: float, R: Vector) -> None:
    """Rotation about the x (0.0), y (1.0) or z axis (2.0)."""
    s, c = sin(theta), cos(theta)
    if axis == 0.0:
        write9(R, 0, (1.0, 0.0, 0.0, 0.0, c, -s, 0.0, s, c))
    elif axis == 1.0:
        write9(R, 0, (c, 0.0, s, 0.0, 1.0, 0.0, -s, 0.0, c))
    else:
        write9(R, 0, (c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0))


@kernel(strict=True)
def is_rotation(M):
    """Whether nine numbers are a rotation matrix, but for rounding."""
    a, b, c, d, e, f, g, h, i = M
    lengths = (
        magnitude(a * a + b * b + c * c - 1.0)
        + magnitude(d * d + e * e + f * f - 1.0)
        + magnitude(g * g + h * h + i * i - 1.0)
    )
    angles = magnitude(a * d + b * e + c * f) + magnitude(a * g + b * h + c * i) + magnitude(d * g + e * h + f * i)
    return lengths + angles < _MISTAKE and a * (e * i - f * h) + b * (f * g - d * i) + c * (d * h - e * g) > 0.0


@kernel(top=True, strict=True)
def rotation_of_matrix(M: Vector, R: Vector) -> int:
    """The same numbers, if they are a rotation matrix."""
    numbers = read9(M, 0)
    if not is_rotation(numbers):
        return NOT_UNIT
    write9(R, 0, numbers)
    return 0


@kernel(strict=True)
def of_products(s, w, x, y, z):
    """Rotation of a quaternion whose products are scaled by s."""
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
def squared(w, x, y, z):
    """Squared length of a quaternion, summed as Eigen's four-wide packet does."""
    return (x * x + z * z) + (y * y + w * w)


@kernel(top=True, strict=True)
def rotation_of_any_quaternion(wxyz: Vector, R: Vector) -> int:
    """Rotation of a quaternion of any length but zero."""
    w, x, y, z = read4(wxyz, 0)
    length = squared(w, x, y, z)
    if not length > 0.0:
        return NOT_UNIT
    M = of_products(2.0 / length, w, x, y, z)
    if not is_rotation(M):
        return NOT_UNIT
    write9(R, 0, M)
    return 0


@kernel(top=True, strict=True)
def rotation_of_unit_quaternion(wxyz: Vector, R: Vector) -> None:
    """Rotation of a quaternion of length one."""
    w, x, y, z = read4(wxyz, 0)
    tx, ty, tz = 2.0 * x, 2.0 * y, 2.0 * z
    twx, twy, twz = tx * w, ty * w, tz * w
    txx, txy, txz = tx * x, ty * x, tz * x
    tyy, tyz, tzz = ty * y, tz * y, tz * z
    write9(R, 0, (
        1.0 - (tyy + tzz), txy - twz, txz + twy,
        txy + twz, 1.0 - (txx + tzz), tyz - twx,
        txz - twy, tyz + twx, 1.0 - (txx + tyy),
    ))  # fmt: skip


@kernel(top=True, strict=True)
def rotation_of_angle_axis(angle: float, axis: Vector, R: Vector) -> int:
    """Rotation by an angle about an axis, which is made a unit vector first."""
    x, y, z = read3(axis, 0)
    length = sqrt(x * x + y * y + z * z)
    if not length > 0.0:
        return NOT_UNIT
    x, y, z = x / length, y / length, z / length
    s, c = sin(angle), cos(angle)
    k = 1.0 - c
    sx, sy, sz = s * x, s * y, s * z
    kx, ky, kz = k * x, k * y, k * z
    xy, xz, yz = kx * y, kx * z, ky * z
    M = (kx * x + c, xy - sz, xz + sy, xy + sz, ky * y + c, yz - sx, xz - sy, yz + sx, kz * z + c)
    if not is_rotation(M):
        return NOT_UNIT
    write9(R, 0, M)
    return 0


@kernel(top=True, strict=True)
def rotation_of_rpy(rpy: Vector, R: Vector) -> None:
    """Rotation of roll, pitch and yaw."""
    s0, c0, s1, c1, s2, c2 = sin(rpy[0]), cos(rpy[0]), sin(rpy[1]), cos(rpy[1]), sin(rpy[2]), cos(rpy[2])
    c2_s1, s2_s1 = c2 * s1, s2 * s1
    write9(R, 0, (
        c2 * c1, c2_s1 * s0 - c0 * s2, c2_s1 * c0 + s2 * s0,
        s2 * c1, s2_s1 * s0 + c2 * c0, s2_s1 * c0 - c2 * s0,
        -s1, c1 * s0, c1 * c0,
    ))  # fmt: skip


@kernel(top=True, strict=True)
def quaternion_of_matrix(R: Vector, wxyz: Vector) -> None:
    """The quaternion with a non-negative scalar part."""
    write4(wxyz, 0, quaternion_of_rotation(read9(R, 0)))


@kernel(top=True, strict=True)
def quaternion_of_rpy(rpy: Vector, wxyz: Vector) -> None:
    """The quaternion of roll, pitch and yaw."""
    sr, cr, sp, cp = sin(rpy[0] / 2.0), cos(rpy[0] / 2.0), sin(rpy[1] / 2.0), cos(rpy[1] / 2.0)
    sy, cy = sin(rpy[2] / 2.0), cos(rpy[2] / 2.0)
    cpcy, spcy, spsy, cpsy = cp * cy, sp * cy, sp * sy, cp * sy
    write4(wxyz, 0, (cr * cpcy + sr * spsy, sr * cpcy - cr * spsy, cr * spcy + sr * cpsy, cr * cpsy - sr * spcy))


@kernel(top=True, strict=True)
def unit_quaternion(w: float, x: float, y: float, z: float, wxyz: Vector) -> int:
    """Four numbers, if their length is one."""
    if not magnitude(sqrt(w * w + x * x + y * y + z * z) - 1.0) <= _TOLERANCE:
        return NOT_UNIT
    write4(wxyz, 0, (w, x, y, z))
    return 0


@kernel(top=True)
def three_numbers(x: float, y: float, z: float, out: Vector) -> None:
    """The three as a vector."""
    write3(out, 0, (x, y, z))


@kernel(top=True, strict=True)
def unit_vector(v: Vector, out: Vector) -> int:
    """The same numbers, of any count, if their length is one."""
    squares = 0.0
    for i in range(v.shape[0]):
        squares += v[i] * v[i]
        out[i] = v[i]
    return 0 if magnitude(sqrt(squares) - 1.0) <= _TOLERANCE else NOT_UNIT


@kernel(top=True, strict=True)
def multiply_quaternions(a: Vector, b: Vector, wxyz: Vector) -> None:
    """Hamilton's product."""
    aw, ax, ay, az = read4(a, 0)
    bw, bx, by, bz = read4(b, 0)
    write4(wxyz, 0, (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by + ay * bw + az * bx - ax * bz,
        aw * bz + az * bw + ax * by - ay * bx,
    ))  # fmt: skip


@kernel(top=True, strict=True)
def turn_by_quaternion(q: Vector, v: Vector, out: Vector) -> None:
    """A vector turned by a unit quaternion."""
    w, x, y, z = read4(q, 0)
    vx, vy, vz = read3(v, 0)
    ux, uy, uz = y * vz - z * vy, z * vx - x * vz, x * vy - y * vx
    ux, uy, uz = ux + ux, uy + uy, uz + uz
    write3(out, 0, (
        vx + w * ux + (y * uz - z * uy),
        vy + w * uy + (z * ux - x * uz),
        vz + w * uz + (x * uy - y * ux),
    ))  # fmt: skip


@kernel(top=True, strict=True)
def invert_quaternion(q: Vector, wxyz: Vector) -> int:
    """The quaternion of the opposite rotation."""
    w, x, y, z = read4(q, 0)
    n = squared(w, x, y, z)
    if not n > 0.0:
        return NOT_UNIT
    write4(wxyz, 0, (w / n, -x / n, -y / n, -z / n))
    return 0


@kernel(strict=True)
def half(sine, cosine):
    """The angle of a pair of numbers; zero where both vanish."""
    return 0.0 * sine if magnitude(sine) <= _EPSILON and magnitude(cosine) <= _EPSILON else atan2(sine, cosine)


@kernel(strict=True)
def within_a_turn(angle):
    lower = angle - 2.0 * _PI if angle > _PI else angle
    return lower + 2.0 * _PI if lower < -_PI else lower


@kernel(strict=True)
def angles_of(M, w, x, y, z):
    """Roll, pitch and yaw, see `RollPitchYaw._set`."""
    a, b, c, d, e = M[0], M[3], M[6], M[7], M[8]
    pitch = atan2(-c, sqrt((e * e + d * d + b * b + a * a) / 2.0))
    plus, minus = half(x + z, w - y), half(z - x, w + y)
    return (within_a_turn(plus - minus), pitch, within_a_turn(plus + minus))


@kernel(top=True, strict=True)
def rpy_of_rotation(R: Vector, rpy: Vector) -> None:
    """Roll, pitch and yaw of a rotation matrix."""
    M = read9(R, 0)
    w, x, y, z = quaternion_of_rotation(M)
    write3(rpy, 0, angles_of(M, w, x, y, z))


@kernel(top=True, strict=True)
def rpy_of_quaternion(wxyz: Vector, rpy: Vector) -> int:
    """Roll, pitch and yaw of a quaternion."""
    w, x, y, z = read4(wxyz, 0)
    length = squared(w, x, y, z)
    if not length > 0.0:
        return NOT_UNIT
    write3(rpy, 0, angles_of(of_products(2.0 / length, w, x, y, z), w, x, y, z))
    return 0


@kernel(top=True, strict=True)
def angle_axis_of_rotation(R: Vector, angle: Vector, axis: Vector) -> None:
    """Angle in [0, pi] and axis; the x axis where nothing turns."""
    w, x, y, z = quaternion_of_rotation(read9(R, 0))
    n = sqrt(x * x + y * y + z * z)
    if n == 0.0:
        angle[0] = 0.0
        write3(axis, 0, (1.0, 0.0, 0.0))
    else:
        angle[0] = 2.0 * atan2(n, magnitude(w))
        m = -n if w < 0.0 else n
        write3(axis, 0, (x / m, y / m, z / m))


@kernel(top=True, strict=True)
def pose_of_matrix(X_AB: Vector, R_AB: Vector, p_AB: Vector) -> int:
    """The pose of a homogeneous matrix; its last row does not count."""
    X = X_AB
    R = (X[0], X[1], X[2], X[4], X[5], X[6], X[8], X[9], X[10])
    if not is_rotation(R):
        return NOT_UNIT
    write9(R_AB, 0, R)
    write3(p_AB, 0, (X[3], X[7], X[11]))
    return 0
