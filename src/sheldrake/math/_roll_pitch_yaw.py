"""RollPitchYaw: an orientation by three angles, and their rates."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any
from typing import overload as typing_overload

import numpy as np

from sheldrake.common import _rotations as rotations
from sheldrake.common._kernels import poses
from sheldrake.common._kinds import instance_of
from sheldrake.common._names import pretty_class_name
from sheldrake.common._overloads import Overload, overload
from sheldrake.common._quaternion import QUATERNION
from sheldrake.common._scalar_math import all_of, at_most, atan2, cos, largest_magnitude, select, sin, sqrt
from sheldrake.common._scalars import (
    ScalarBase,
    ScalarTemplate,
    as_array,
    is_symbolic,
    matrix,
    new_array,
    plain_vector,
    scalar,
    vector,
)
from sheldrake.common.eigen_geometry import Quaternion, Quaternion_
from sheldrake.common.quick import Slots, short_way
from sheldrake.math._rotation_matrix import PLAIN_MATRICES, ROTATION, RotationMatrix_

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sheldrake.common._types import Scalar, Scalars
    from sheldrake.math._rotation_matrix import RotationMatrix

_PLAIN = (float, int)
_EPSILON = float(np.finfo(float).eps)
_GIMBAL_LOCK = 0.008  # smallest |cos(pitch)| at which rates of the angles are computed, as in Drake


class RollPitchYaw(ScalarBase):
    """The orientation of frame D in A: turn about A's x by roll, then A's y by pitch, then A's z by yaw [rad].

    `R_AD = Rz(yaw) Ry(pitch) Rx(roll)`.
    """

    __slots__ = ("_rpy",)
    _FIELDS = ("_rpy",)

    @typing_overload
    def __init__(self, other: RollPitchYaw) -> None: ...
    @typing_overload
    def __init__(self, rpy: Scalars) -> None: ...
    @typing_overload
    def __init__(self, roll: Scalar, pitch: Scalar, yaw: Scalar) -> None: ...
    @typing_overload
    def __init__(self, R: RotationMatrix) -> None: ...
    @typing_overload
    def __init__(self, quaternion: Quaternion) -> None: ...
    @typing_overload
    def __init__(self, *, matrix: Scalars) -> None: ...
    def __init__(self, *args: Any, **kwargs: Any):
        """
        `RollPitchYaw(rpy)` with shape (3,), `RollPitchYaw(roll, pitch, yaw)`, `RollPitchYaw(R)`,
        `RollPitchYaw(quaternion)`, `RollPitchYaw(matrix)` with shape (3, 3), taken for a rotation unchecked,
        `RollPitchYaw(other)`.
        """
        if len(args) == 1 and self._T is float and (rpy := _angles_of(args[0])) is not None and not kwargs:
            self._rpy = rpy
        elif len(args) == 1 and not kwargs and isinstance(args[0], RotationMatrix_[self._T]):  # the usual one
            if (rpy := _of_rotation(args[0])) is not None:
                self._rpy = rpy
            else:
                self._set(args[0]._M, rotations.matrix_to_canonical_quaternion(args[0]._M))
        elif (
            self._T is float
            and len(args) == 3
            and not kwargs
            and ((rpy := _three(*args)) is not None or all([isinstance(x, _PLAIN) for x in args]))
        ):
            self._rpy = rpy if rpy is not None else new_array(float, args)
        elif self._T is float and len(args) == 1 and not kwargs and (rpy := plain_vector(args[0])) is not None:
            self._rpy = rpy
        else:
            self._choose("init", args, kwargs)

    @staticmethod
    def _ways_init(cls: Any) -> list[Overload]:
        T = cls._T

        def copy_of(self: Any, other: Any) -> None:
            self._rpy = other._rpy

        def from_vector(self: Any, rpy: np.ndarray) -> None:
            self._rpy = rpy

        def from_angles(self: Any, roll: Scalar, pitch: Scalar, yaw: Scalar) -> None:
            self._rpy = new_array(T, [roll, pitch, yaw])

        def from_rotation(self: Any, R: Any) -> None:
            self._set(R._M, rotations.matrix_to_canonical_quaternion(R._M))

        def from_quaternion(self: Any, quaternion: Quaternion) -> None:
            M = rotations.quaternion_to_matrix(T, quaternion._wxyz)
            self._set(M, quaternion._wxyz.tolist())

        def from_matrix(self: Any, M: np.ndarray) -> None:
            from_rotation(self, RotationMatrix_[T]._make(M))

        return [
            overload(copy_of, other=instance_of(cls)),
            overload(from_vector, rpy=vector(T, 3)),
            overload(from_angles, roll=scalar(T), pitch=scalar(T), yaw=scalar(T)),
            overload(from_rotation, R=instance_of(RotationMatrix_[T])),
            overload(from_quaternion, quaternion=instance_of(Quaternion_[T])),
            overload(from_matrix, matrix=matrix(T, 3, 3)),
        ]

    def _set(self, M: np.ndarray, wxyz: Sequence[Any] | np.ndarray) -> None:
        """Angles accurate everywhere, gimbal lock included.

        Pitch comes from the matrix. Half the sum and half the difference of yaw and roll come from the quaternion
        (P. Mitiguy, as documented with Drake's RollPitchYaw); a pair that vanishes leaves its angle at zero.
        """
        (a, _, _), (b, _, _), (c, d, e) = M.tolist()
        w, x, y, z = wxyz
        plus: Scalar
        minus: Scalar
        if self._T is float:
            pitch: Scalar = math.atan2(-c, math.sqrt((e * e + d * d + b * b + a * a) / 2.0))
            plus, minus = _half(x + z, w - y), _half(z - x, w + y)
            self._rpy = new_array(float, [_turned(plus - minus), pitch, _turned(plus + minus)])
            return
        cos_pitch = sqrt((e * e + d * d + b * b + a * a) / 2.0)
        pitch = atan2(-c, cos_pitch)

        def half(sine: Scalar, cosine: Scalar) -> Scalar:
            vanishes = all_of((abs(sine) <= _EPSILON, abs(cosine) <= _EPSILON))
            return select(vanishes, lambda: 0.0 * sine, lambda: atan2(sine, cosine))

        plus, minus = half(x + z, w - y), half(z - x, w + y)
        self._rpy = new_array(self._T, [_wrapped(plus - minus), pitch, _wrapped(plus + minus)])

    @classmethod
    def _of_rotation_matrix(cls, R: RotationMatrix) -> RollPitchYaw:
        """The angles of a matrix of the same scalar."""
        made: RollPitchYaw | None = _made_of_rotation(R)
        return cls(R) if made is None else made

    def vector(self) -> np.ndarray:
        """Roll, pitch and yaw [rad], shape (3,)."""
        return self._rpy.copy()

    def roll_angle(self) -> float:
        """Roll [rad]."""
        return self._rpy.item(0)

    def pitch_angle(self) -> float:
        """Pitch [rad]."""
        return self._rpy.item(1)

    def yaw_angle(self) -> float:
        """Yaw [rad]."""
        return self._rpy.item(2)

    def ToQuaternion(self) -> Quaternion:
        """The same orientation as a quaternion; its scalar part may be negative."""
        if (made := _quaternion(self)) is not None:
            return made
        (sr, cr), (sp, cp), (sy, cy) = ((sin(q / 2.0), cos(q / 2.0)) for q in self._rpy.tolist())
        cpcy, spcy, spsy, cpsy = cp * cy, sp * cy, sp * sy, cp * sy
        return Quaternion_[self._T]._make(
            (cr * cpcy + sr * spsy, sr * cpcy - cr * spsy, cr * spcy + sr * cpsy, cr * cpsy - sr * spcy)
        )

    def ToRotationMatrix(self) -> RotationMatrix:
        """R_AD."""
        if (made := _rotation(self)) is not None:
            return made
        return RotationMatrix_[self._T]._make(self._to_matrix())

    def IsNearlyEqualTo(self, other: Any, tolerance: float) -> bool:
        """Whether no angle is further than `tolerance` [rad] from that of `other`; angles a turn apart are not near."""
        other = self._argument("IsNearlyEqualTo", instance_of(self._plain_class()), other=other)
        return at_most(largest_magnitude(self.vector() - other.vector(), self._T), tolerance, self._T)

    def _to_matrix(self) -> np.ndarray:
        if (M := _matrix(self)) is not None:
            return M
        (s0, c0), (s1, c1), (s2, c2) = self._sines()
        c2_s1, s2_s1 = c2 * s1, s2 * s1
        return new_array(
            self._T,
            [
                [c2 * c1, c2_s1 * s0 - c0 * s2, c2_s1 * c0 + s2 * s0],
                [s2 * c1, s2_s1 * s0 + c2 * c0, s2_s1 * c0 - c2 * s0],
                [-s1, c1 * s0, c1 * c0],
            ],
        )

    def _sines(self) -> list[tuple]:
        if self._T is float:
            return [(math.sin(q), math.cos(q)) for q in self._rpy.tolist()]
        return [(sin(q), cos(q)) for q in self._rpy.tolist()]

    def _rates(self, call: str, **rates: Any) -> list:
        return self._argument(call, vector(self._T, 3), **rates).tolist()

    def _safe_cos_pitch(self, call: str) -> Scalar:
        pitch = self._rpy.item(1)
        c1 = cos(pitch)
        if not is_symbolic(self._T) and abs(c1) < _GIMBAL_LOCK:
            degrees = math.degrees(float(pitch if self._T is float else pitch.value()))
            raise RuntimeError(
                f"RollPitchYaw.{call}(): pitch angle {degrees:g} degrees is within "
                f"{math.degrees(math.asin(_GIMBAL_LOCK)):.6g} degrees of gimbal-lock, where the rates of roll and "
                "yaw are singular. Use a quaternion to avoid this."
            )
        return c1

    def CalcRotationMatrixDt(self, rpyDt: Scalars) -> np.ndarray:
        """Time derivative of R_AD [1/s], shape (3, 3).

        Args:
            rpyDt: Rates of roll, pitch and yaw [rad/s], shape (3,).
        """
        r, p, y = self._rates("CalcRotationMatrixDt", rpyDt=rpyDt)
        (s0, c0), (s1, c1), (s2, c2) = self._sines()
        by_roll = [
            [0.0 * s0, c2 * s1 * c0 + s0 * s2, -c2 * s1 * s0 + s2 * c0],
            [0.0 * s0, s2 * s1 * c0 - c2 * s0, -s2 * s1 * s0 - c2 * c0],
            [0.0 * s0, c1 * c0, -c1 * s0],
        ]
        by_pitch = [
            [-c2 * s1, c2 * c1 * s0, c2 * c1 * c0],
            [-s2 * s1, s2 * c1 * s0, s2 * c1 * c0],
            [-c1, -s1 * s0, -s1 * c0],
        ]
        by_yaw = [
            [-s2 * c1, -s2 * s1 * s0 - c2 * c0, -s2 * s1 * c0 + c2 * s0],
            [c2 * c1, c2 * s1 * s0 - s2 * c0, c2 * s1 * c0 + s2 * s0],
            [0.0 * s0, 0.0 * s0, 0.0 * s0],
        ]
        rows = [[a * r + b * p + c * y for a, b, c in zip(*three)] for three in zip(by_roll, by_pitch, by_yaw)]
        return new_array(self._T, rows).copy()

    def _in_parent(self) -> np.ndarray:
        """N with w_AD_A = N rpyDt."""
        (_, _), (s1, c1), (s2, c2) = self._sines()
        return as_array(self._T, [[c1 * c2, -s2, 0.0], [c1 * s2, c2, 0.0], [-s1, 0.0, 1.0]], (3, 3))

    def _in_child(self) -> np.ndarray:
        """N with w_AD_D = N rpyDt."""
        (s0, c0), (s1, c1), _ = self._sines()
        return as_array(self._T, [[1.0, 0.0, -s1], [0.0, c0, c1 * s0], [0.0, -s0, c0 * c1]], (3, 3))

    def CalcAngularVelocityInParentFromRpyDt(self, rpyDt: Scalars) -> np.ndarray:
        """w_AD_A [rad/s], shape (3,), from the rates of roll, pitch and yaw [rad/s]."""
        return self._in_parent().dot(self._vector("CalcAngularVelocityInParentFromRpyDt", rpyDt=rpyDt))

    def CalcAngularVelocityInChildFromRpyDt(self, rpyDt: Scalars) -> np.ndarray:
        """w_AD_D [rad/s], shape (3,), from the rates of roll, pitch and yaw [rad/s]."""
        return self._in_child().dot(self._vector("CalcAngularVelocityInChildFromRpyDt", rpyDt=rpyDt))

    def _vector(self, call: str, **named: Any) -> np.ndarray:
        return self._argument(call, vector(self._T, 3), **named)

    def CalcRpyDtFromAngularVelocityInParent(self, w_AD_A: Scalars) -> np.ndarray:
        """Rates of roll, pitch and yaw [rad/s], shape (3,), from w_AD_A [rad/s].

        Raises:
            RuntimeError: pitch is within half a degree of gimbal lock.
        """
        call = "CalcRpyDtFromAngularVelocityInParent"
        w = self._vector(call, w_AD_A=w_AD_A)
        return self._parent_inverse(call).dot(w)

    def _parent_inverse(self, call: str) -> np.ndarray:
        c1 = self._safe_cos_pitch(call)
        _, (s1, _), (s2, c2) = self._sines()
        c2_c1, s2_c1 = c2 / c1, s2 / c1
        rows = [[c2_c1, s2_c1, 0.0], [-s2, c2, 0.0], [c2_c1 * s1, s2_c1 * s1, 1.0]]
        return as_array(self._T, rows, (3, 3))

    def CalcRpyDtFromAngularVelocityInChild(self, w_AD_D: Scalars) -> np.ndarray:
        """Rates of roll, pitch and yaw [rad/s], shape (3,), from w_AD_D [rad/s].

        Raises:
            RuntimeError: pitch is within half a degree of gimbal lock.
        """
        call = "CalcRpyDtFromAngularVelocityInChild"
        w = self._vector(call, w_AD_D=w_AD_D)
        return self._child_inverse(call).dot(w)

    def _child_inverse(self, call: str) -> np.ndarray:
        c1 = self._safe_cos_pitch(call)
        (s0, c0), (s1, _), _ = self._sines()
        s0_c1, c0_c1 = s0 / c1, c0 / c1
        rows = [[1.0, s0_c1 * s1, c0_c1 * s1], [0.0, c0, -s0], [0.0, s0_c1, c0_c1]]
        return as_array(self._T, rows, (3, 3))

    def CalcRpyDDtFromRpyDtAndAngularAccelInParent(self, rpyDt: Scalars, alpha_AD_A: Scalars) -> np.ndarray:
        """Second derivatives of roll, pitch and yaw [rad/s^2], shape (3,).

        Args:
            rpyDt: Rates of roll, pitch and yaw [rad/s], shape (3,).
            alpha_AD_A: Angular acceleration of D in A, expressed in A [rad/s^2], shape (3,).

        Raises:
            RuntimeError: pitch is within half a degree of gimbal lock.
        """
        call = "CalcRpyDDtFromRpyDtAndAngularAccelInParent"
        rates = self._vector(call, rpyDt=rpyDt)
        alpha = self._vector(call, alpha_AD_A=alpha_AD_A)
        inverse = self._parent_inverse(call)
        _, (s1, c1), (s2, c2) = self._sines()
        _, p, y = rates.tolist()
        dN = [
            [-s1 * c2 * p - c1 * s2 * y, -c2 * y, 0.0],
            [-s1 * s2 * p + c1 * c2 * y, -s2 * y, 0.0],
            [-c1 * p, 0.0, 0.0],
        ]
        return inverse.dot(alpha - as_array(self._T, dN, (3, 3)).dot(rates))

    def CalcRpyDDtFromAngularAccelInChild(self, rpyDt: Scalars, alpha_AD_D: Scalars) -> np.ndarray:
        """Second derivatives of roll, pitch and yaw [rad/s^2], shape (3,).

        Args:
            rpyDt: Rates of roll, pitch and yaw [rad/s], shape (3,).
            alpha_AD_D: Angular acceleration of D in A, expressed in D [rad/s^2], shape (3,).

        Raises:
            RuntimeError: pitch is within half a degree of gimbal lock.
        """
        call = "CalcRpyDDtFromAngularAccelInChild"
        rates = self._vector(call, rpyDt=rpyDt)
        alpha = self._vector(call, alpha_AD_D=alpha_AD_D)
        inverse = self._child_inverse(call)
        (s0, c0), (s1, c1), _ = self._sines()
        r, p, _ = rates.tolist()
        dN = [
            [0.0, 0.0, -c1 * p],
            [0.0, -s0 * r, -s1 * s0 * p + c1 * c0 * r],
            [0.0, -c0 * r, -s0 * c1 * r - c0 * s1 * p],
        ]
        return inverse.dot(alpha - as_array(self._T, dN, (3, 3)).dot(rates))

    def __getstate__(self) -> tuple[Any, ...]:
        return self._rpy.copy()

    def __setstate__(self, state: Any) -> None:
        self._rpy = as_array(self._T, state, (3,))

    def __repr__(self) -> str:
        roll, pitch, yaw = self._rpy.tolist()
        return f"{pretty_class_name(type(self))}(roll={roll!r}, pitch={pitch!r}, yaw={yaw!r})"


def _half(sine: float, cosine: float) -> float:
    """The angle of a pair of plain numbers; zero where both vanish."""
    return 0.0 * sine if abs(sine) <= _EPSILON and abs(cosine) <= _EPSILON else math.atan2(sine, cosine)


def _turned(angle: float) -> float:
    """`_wrapped` of a plain number."""
    lower = angle - 2.0 * math.pi if angle > math.pi else angle
    return lower + 2.0 * math.pi if lower < -math.pi else lower


def _wrapped(angle: Scalar) -> Scalar:
    """An angle within (-2 pi, 2 pi) brought to [-pi, pi]."""
    lower = select(angle > math.pi, lambda: angle - 2.0 * math.pi, lambda: angle)
    return select(lower < -math.pi, lambda: lower + 2.0 * math.pi, lambda: lower)


def _angles_of(turned: object) -> Any:
    return _of_quaternion(turned) if type(turned) is Quaternion else _of_rotation(turned)


_three = short_way(globals(), "_three", poses.three_numbers, float, float, float, gives=(3,))
_RPY = Slots(RollPitchYaw, {"_rpy": (3,)})
_of_rotation = short_way(globals(), "_of_rotation", poses.rpy_of_rotation, ROTATION, gives=(3,))
_of_quaternion = short_way(globals(), "_of_quaternion", poses.rpy_of_quaternion, QUATERNION, gives=(3,))
_rotation = short_way(globals(), "_rotation", poses.rotation_of_rpy, _RPY, gives=ROTATION)
_matrix = short_way(globals(), "_matrix", poses.rotation_of_rpy, _RPY, gives=(3, 3))
_quaternion = short_way(globals(), "_quaternion", poses.quaternion_of_rpy, _RPY, gives=QUATERNION)
_made_of_rotation = short_way(globals(), "_made_of_rotation", poses.rpy_of_rotation, ROTATION, gives=_RPY)
PLAIN_MATRICES[RollPitchYaw] = RollPitchYaw._to_matrix
RollPitchYaw_ = ScalarTemplate("RollPitchYaw_", RollPitchYaw, scope="sheldrake.math")
