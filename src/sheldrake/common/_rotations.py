"""Formulas between quaternions, angle and axis, and rotation matrices, on any scalar.

Operation order is part of the contract: the same order as Drake and Eigen gives the same bits, so that a quarter turn
about x maps z on y exactly.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._kernels.vec import quaternion_of_rotation
from sheldrake.common._scalar_math import all_of, atan2, cos, select, sin, sqrt
from sheldrake.common._scalars import new_array

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sheldrake.common._types import Number

_of_floats = quaternion_of_rotation.py_func


def norm2(x: Number, y: Number, z: Number, w: Number) -> Number:
    """Squared length of a quaternion, summed as Eigen's four-wide packet does."""
    return (x * x + z * z) + (y * y + w * w)


def quaternion_to_matrix(T: type, wxyz: np.ndarray) -> np.ndarray:
    """Rotation matrix of a quaternion of any length but zero, shape (3, 3)."""
    w, x, y, z = wxyz.tolist()
    return _products_to_matrix(T, 2.0 / norm2(x, y, z, w), w, x, y, z)


def numbers_to_matrix(w: float, x: float, y: float, z: float) -> np.ndarray:
    """The same of four plain numbers."""
    return _products_to_matrix(float, 2.0 / norm2(x, y, z, w), w, x, y, z)


def _products_to_matrix(T: type, s: Any, w: Any, x: Any, y: Any, z: Any) -> np.ndarray:
    sx, sy, sz = s * x, s * y, s * z
    swx, swy, swz = sx * w, sy * w, sz * w
    sxx, sxy, sxz = sx * x, sy * x, sz * x
    syy, syz, szz = sy * y, sz * y, sz * z
    return new_array(
        T,
        [
            [1.0 - syy - szz, sxy - swz, sxz + swy],
            [sxy + swz, 1.0 - sxx - szz, syz - swx],
            [sxz - swy, syz + swx, 1.0 - sxx - syy],
        ],
    )


def unit_quaternion_to_matrix(T: type, wxyz: np.ndarray) -> np.ndarray:
    """Rotation matrix of a quaternion of length one, shape (3, 3)."""
    w, x, y, z = wxyz.tolist()
    tx, ty, tz = 2.0 * x, 2.0 * y, 2.0 * z
    twx, twy, twz = tx * w, ty * w, tz * w
    txx, txy, txz = tx * x, ty * x, tz * x
    tyy, tyz, tzz = ty * y, tz * y, tz * z
    return new_array(
        T,
        [
            [1.0 - (tyy + tzz), txy - twz, txz + twy],
            [txy + twz, 1.0 - (txx + tzz), tyz - twx],
            [txz - twy, tyz + twx, 1.0 - (txx + tyy)],
        ],
    )


def matrix_to_quaternion(M: np.ndarray) -> tuple:
    """(w, x, y, z) of a rotation matrix, as long as the matrix is orthonormal; w may be negative."""
    (a, b, c), (d, e, f), (g, h, i) = M.tolist()
    trace = a + e + i

    def from_diagonal(mii: Any, mjj: Any, mkk: Any, mkj: Any, mjk: Any, mji: Any, mij: Any, mki: Any, mik: Any) -> Any:
        root = sqrt(mii - mjj - mkk + 1.0)
        half = 0.5 / root
        return ((mkj - mjk) * half, 0.5 * root, (mji + mij) * half, (mki + mik) * half)

    def from_trace() -> tuple:
        root = sqrt(trace + 1.0)
        half = 0.5 / root
        return (0.5 * root, (h - f) * half, (c - g) * half, (d - b) * half)

    def from_x() -> tuple:
        return from_diagonal(a, e, i, h, f, d, b, g, c)

    def from_y() -> tuple:
        w, y, z, x = from_diagonal(e, i, a, c, g, h, f, b, d)
        return (w, x, y, z)

    def from_z() -> tuple:
        w, z, x, y = from_diagonal(i, a, e, d, b, c, g, f, h)
        return (w, x, y, z)

    def from_largest() -> tuple:
        return select(e > a, lambda: select(i > e, from_z, from_y), lambda: select(i > a, from_z, from_x))

    return select(trace > 0.0, from_trace, from_largest)


def matrix_to_canonical_quaternion(M: np.ndarray) -> tuple:
    """(w, x, y, z) of unit length with w >= 0, from a matrix that is orthonormal to round-off."""
    (a, b, c), (d, e, f), (g, h, i) = M.tolist()
    if type(a) is float:
        return _of_floats((a, b, c, d, e, f, g, h, i))
    trace = a + (e + i)

    def largest_of_diagonal() -> tuple:
        return select(
            all_of((a >= e, a >= i)),
            lambda: (h - f, (a - (e + i)) + 1.0, b + d, c + g),
            lambda: select(
                e >= i,
                lambda: (c - g, b + d, (e - (i + a)) + 1.0, f + h),
                lambda: (d - b, c + g, f + h, (i - (a + e)) + 1.0),
            ),
        )

    w, x, y, z = select(
        all_of((trace >= a, trace >= e, trace >= i)),
        lambda: (1.0 + trace, h - f, c - g, d - b),
        largest_of_diagonal,
    )
    k = select(w < 0.0, lambda: -1.0, lambda: 1.0) / sqrt(norm2(x, y, z, w))
    return (w * k, x * k, y * k, z * k)


def angle_axis_to_matrix(T: type, angle: Number, axis: Sequence[Number]) -> np.ndarray:
    """Rotation by `angle` [rad] about a unit vector, shape (3, 3)."""
    x, y, z = axis
    s, c = sin(angle), cos(angle)
    k = 1.0 - c
    sx, sy, sz = s * x, s * y, s * z
    kx, ky, kz = k * x, k * y, k * z
    xy, xz, yz = kx * y, kx * z, ky * z
    return new_array(
        T,
        [
            [kx * x + c, xy - sz, xz + sy],
            [xy + sz, ky * y + c, yz - sx],
            [xz - sy, yz + sx, kz * z + c],
        ],
    )


def quaternion_to_angle_axis(wxyz: Sequence[Number]) -> tuple:
    """(angle in [0, pi] [rad], x, y, z) of a quaternion; the x axis where it does not turn at all."""
    w, x, y, z = wxyz
    n = sqrt(x * x + y * y + z * z)
    if isinstance(n, float) and isinstance(w, float):
        m = -n if w < 0.0 else n
        return (2.0 * math.atan2(n, abs(w)), x / m, y / m, z / m) if n else (0.0 * w, 1.0 + 0.0 * w, 0.0 * w, 0.0 * w)

    def turned() -> tuple:
        magnitude = abs(w)
        m = select(w < 0.0, lambda: -n, lambda: n)
        return (2.0 * atan2(n, magnitude), x / m, y / m, z / m)

    def not_turned() -> tuple:
        return (0.0 * w, 1.0 + 0.0 * w, 0.0 * w, 0.0 * w)

    return select(n != 0.0, turned, not_turned)


def angle_axis_to_quaternion(angle: Number, axis: Sequence[Number]) -> tuple:
    """(w, x, y, z) of a rotation by `angle` [rad] about a unit vector."""
    half = 0.5 * angle
    s = sin(half)
    x, y, z = axis
    return (cos(half), s * x, s * y, s * z)


def quaternion_product(a: Sequence[Number], b: Sequence[Number]) -> tuple:
    """Hamilton product of two quaternions (w, x, y, z)."""
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    return (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by + ay * bw + az * bx - ax * bz,
        aw * bz + az * bw + ax * by - ay * bx,
    )


def rotate_by_unit_quaternion(q: Sequence[Number], v: Sequence[Number]) -> tuple:
    """Vector `v` turned by the unit quaternion (w, x, y, z)."""
    w, x, y, z = q
    vx, vy, vz = v
    ux, uy, uz = y * vz - z * vy, z * vx - x * vz, x * vy - y * vx
    ux, uy, uz = ux + ux, uy + uy, uz + uz
    return (
        vx + w * ux + (y * uz - z * uy),
        vy + w * uy + (z * ux - x * uz),
        vz + w * uz + (x * uy - y * ux),
    )
