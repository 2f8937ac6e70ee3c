"""Unit quaternions and their time derivatives."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._overloads import Mismatch, incompatible
from sheldrake.common._rotations import quaternion_product
from sheldrake.common._scalar_math import all_of, at_most, select, sqrt
from sheldrake.common._scalars import as_array, is_symbolic
from sheldrake.common.eigen_geometry import Quaternion_

if TYPE_CHECKING:
    from sheldrake.common._quaternion import Quaternion
    from sheldrake.common._types import Scalars

__all__ = [
    "AreQuaternionsEqualForOrientation",
    "CalculateAngularVelocityExpressedInBFromQuaternionDt",
    "CalculateQuaternionDtConstraintViolation",
    "CalculateQuaternionDtFromAngularVelocityExpressedInB",
    "ClosestQuaternion",
    "IsBothQuaternionAndQuaternionDtOK",
    "IsQuaternionValid",
    "QuaternionToCanonicalForm",
    "is_quaternion_in_canonical_form",
]


def _scalar_of(call: str, quat: Any) -> type:
    template = getattr(type(quat), "_template", None)
    if template is not Quaternion_:
        raise incompatible(call, ["(Quaternion, ...)"], (quat,), {})
    return quat._T


def _vector(call: str, T: type, value: object, n: int) -> list:
    try:
        return as_array(T, value, (n,)).tolist()
    except Mismatch:
        raise incompatible(call, [f"({T.__name__} array of shape ({n},))"], (value,), {}) from None


def is_quaternion_in_canonical_form(quat: Quaternion) -> bool:
    """Whether the scalar part is not negative."""
    T = _scalar_of("is_quaternion_in_canonical_form", quat)
    result = quat.w() >= 0.0
    return result if is_symbolic(T) else bool(result)


def QuaternionToCanonicalForm(quat: Quaternion) -> Quaternion:
    """The one of q and -q (the same orientation) whose scalar part is not negative."""
    _scalar_of("QuaternionToCanonicalForm", quat)
    q = tuple(quat._wxyz.tolist())
    return quat._make(select(q[0] >= 0.0, lambda: q, lambda: tuple(-x for x in q)))


def ClosestQuaternion(quat1: Quaternion, quat2: Quaternion) -> Quaternion:
    """The one of quat2 and -quat2 that is closer to quat1."""
    T = _scalar_of("ClosestQuaternion", quat1)
    if _scalar_of("ClosestQuaternion", quat2) is not T:
        raise incompatible("ClosestQuaternion", ["(two of one scalar type)"], (quat1, quat2), {})
    q = tuple(quat2._wxyz.tolist())
    closer = quat1._wxyz.dot(quat2._wxyz) >= 0.0
    return quat1._make(select(closer, lambda: q, lambda: tuple(-x for x in q)))


def AreQuaternionsEqualForOrientation(quat1: Quaternion, quat2: Quaternion, tolerance: float) -> bool:
    """Whether two quaternions, each in canonical form, differ by at most `tolerance` in every component."""
    T = _scalar_of("AreQuaternionsEqualForOrientation", quat1)
    a, b = QuaternionToCanonicalForm(quat1)._wxyz.tolist(), QuaternionToCanonicalForm(quat2)._wxyz.tolist()
    result = all_of(abs(x - y) <= tolerance for x, y in zip(a, b))
    return result if is_symbolic(T) else bool(result)


@checked
def IsQuaternionValid(quat: Quaternion, tolerance: float) -> bool:
    """Whether the length is one to `tolerance`."""
    T = _scalar_of("IsQuaternionValid", quat)
    w, x, y, z = quat._wxyz.tolist()
    return at_most(abs(1.0 - sqrt(w * w + x * x + y * y + z * z)), tolerance, T)


def CalculateQuaternionDtFromAngularVelocityExpressedInB(quat_AB: Quaternion, w_AB_B: Scalars) -> np.ndarray:
    """Time derivative of a quaternion [1/s], scalar part first, shape (4,).

    Args:
        quat_AB: Orientation of B in A.
        w_AB_B: Angular velocity of B in A, expressed in B [rad/s], shape (3,).
    """
    call = "CalculateQuaternionDtFromAngularVelocityExpressedInB"
    T = _scalar_of(call, quat_AB)
    half_w = [0.5 * x for x in _vector(call, T, w_AB_B, 3)]
    product = quaternion_product(quat_AB._wxyz.tolist(), [T(0.0), *half_w])
    return np.array(product, dtype=quat_AB._wxyz.dtype)


def CalculateAngularVelocityExpressedInBFromQuaternionDt(quat_AB: Quaternion, quatDt: Scalars) -> np.ndarray:
    """Angular velocity of B in A, expressed in B [rad/s], shape (3,).

    Args:
        quat_AB: Orientation of B in A.
        quatDt: Its time derivative [1/s], scalar part first, shape (4,).
    """
    call = "CalculateAngularVelocityExpressedInBFromQuaternionDt"
    rates = _vector(call, _scalar_of(call, quat_AB), quatDt, 4)
    w, x, y, z = quat_AB._wxyz.tolist()
    product = quaternion_product((w, -x, -y, -z), rates)
    return np.array([2.0 * part for part in product[1:]], dtype=quat_AB._wxyz.dtype)


def CalculateQuaternionDtConstraintViolation(quat: Quaternion, quatDt: Scalars) -> float:
    """Rate at which the squared length of the quaternion changes [1/s]; zero for a rotation."""
    call = "CalculateQuaternionDtConstraintViolation"
    rates = _vector(call, _scalar_of(call, quat), quatDt, 4)
    w, x, y, z = quat._wxyz.tolist()
    return 2.0 * (w * rates[0] + x * rates[1] + y * rates[2] + z * rates[3])


@checked
def IsBothQuaternionAndQuaternionDtOK(quat: Quaternion, quatDt: Scalars, tolerance: float) -> bool:
    """Whether the length is one and constant, both to `tolerance`."""
    T = _scalar_of("IsBothQuaternionAndQuaternionDtOK", quat)
    violation = CalculateQuaternionDtConstraintViolation(quat, quatDt)
    return all_of((IsQuaternionValid(quat, tolerance), at_most(abs(violation), tolerance, T)))
