"""RotationMatrix: the orientation of one frame in another.

On floats, AutoDiffXd and Expression alike; with Drake's numbers, bit by bit where the order of operations fixes them.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import TYPE_CHECKING, Any
from typing import overload as typing_overload

import numpy as np

from sheldrake.common import _rotations as rotations
from sheldrake.common._angle_axis import ANGLE_AXIS
from sheldrake.common._checked import checked
from sheldrake.common._kernels import poses
from sheldrake.common._kinds import instance_of
from sheldrake.common._names import pretty_class_name
from sheldrake.common._overloads import Mismatch, Overload, incompatible, overload
from sheldrake.common._quaternion import QUATERNION
from sheldrake.common._scalar_math import all_equal, all_of, at_most, cos, largest_magnitude, sin, sqrt
from sheldrake.common._scalars import (
    ScalarBase,
    ScalarTemplate,
    any_array,
    as_array,
    autodiff_class,
    home_of,
    identity,
    is_symbolic,
    matrix,
    scalar,
    vector,
)
from sheldrake.common.eigen_geometry import AngleAxis, AngleAxis_, Quaternion, Quaternion_
from sheldrake.common.quick import Slots, short_way

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.common import eigen_geometry
    from sheldrake.common._types import Scalar, Scalars
    from sheldrake.math._roll_pitch_yaw import RollPitchYaw

_new = object.__new__
RollPitchYaw_: Any = None  # A family that stands on the one below; the package binds it.
_ndarray = np.ndarray
_FLOAT64 = np.dtype(np.float64)

# Drake's own bound for "is a rotation matrix" and "is nearly".
TOLERANCE = 128 * np.finfo(float).eps
# A matrix this far from orthonormal is a mistake, not rounding. Between the two it is taken as it is, as Drake does.
_MISTAKE = 0.1


def numeric(array: np.ndarray) -> np.ndarray:
    """The values of an array of numbers of any scalar type.

    Raises:
        RuntimeError: an expression is none without its variables.
    """
    if array.dtype is _FLOAT64:
        return array
    return np.array([x.value() if hasattr(x, "value") else x.Evaluate() for x in array.flat]).reshape(array.shape)


def _checked(T: type, M: np.ndarray) -> np.ndarray:
    """`M`, which has to be a rotation matrix but for rounding."""
    if not is_symbolic(T):
        values = numeric(M)
        if _is_rotation(values):
            return M
        error = np.abs(values.dot(values.T) - identity(float, 3)).max()
        if not error < _MISTAKE:
            raise RuntimeError(
                f"RotationMatrix(): {values.tolist()} is not a rotation matrix: |R R^T - 1| is {error:.3g}, not 0."
            )
        (a, b, c), (d, e, f), (g, h, i) = values.tolist()
        if a * (e * i - f * h) + b * (f * g - d * i) + c * (d * h - e * g) < 0.0:
            raise RuntimeError(
                f"RotationMatrix(): {values.tolist()} is not a rotation matrix but a reflection: its determinant is "
                "negative."
            )
    return M


def _is_rotation(M: np.ndarray) -> bool:
    """Whether the sum of what may be wrong is small: then it is no mistake; written out, as it is done often."""
    (a, b, c), (d, e, f), (g, h, i) = M.tolist()
    lengths = abs(a * a + b * b + c * c - 1.0) + abs(d * d + e * e + f * f - 1.0) + abs(g * g + h * h + i * i - 1.0)
    angles = abs(a * d + b * e + c * f) + abs(a * g + b * h + c * i) + abs(d * g + e * h + f * i)
    return bool(lengths + angles < _MISTAKE and a * (e * i - f * h) + b * (f * g - d * i) + c * (d * h - e * g) > 0.0)


def _of_quaternion(quaternion: Quaternion) -> np.ndarray:
    if (M := _of_any(quaternion)) is not None:
        return M
    return _checked(quaternion._T, rotations.quaternion_to_matrix(quaternion._T, quaternion._wxyz))


def _of_angle_axis(theta_lambda: AngleAxis) -> np.ndarray:
    if (M := _about(theta_lambda)) is not None:
        return M
    x, y, z = theta_lambda._axis.tolist()
    length = sqrt(x * x + y * y + z * z)
    unit = [x / length, y / length, z / length]
    return _checked(theta_lambda._T, rotations.angle_axis_to_matrix(theta_lambda._T, theta_lambda._angle, unit))


def product(T: type, A: np.ndarray, B: np.ndarray) -> np.ndarray:
    """A @ B of matrices of numbers of a type; of duals by products of floats."""
    if T is float or T is not autodiff_class():
        return A.dot(B)
    return home_of("AutoDiffXd")._matrices.product(A, B)


class RotationMatrix(ScalarBase):
    """The rotation matrix R_AB: the orientation of frame B in frame A; its columns are B's axes expressed in A.

    `R_AC = R_AB @ R_BC` and `v_A = R_AB @ v_B`.
    """

    __slots__ = ("_M",)
    _FIELDS = ("_M",)  # the array is read-only and may be shared

    @typing_overload
    def __init__(self) -> None: ...
    @typing_overload
    def __init__(self, other: RotationMatrix) -> None: ...
    @typing_overload
    def __init__(self, R: Scalars) -> None: ...
    @typing_overload
    def __init__(self, quaternion: Quaternion) -> None: ...
    @typing_overload
    def __init__(self, theta_lambda: AngleAxis) -> None: ...
    @typing_overload
    def __init__(self, rpy: RollPitchYaw) -> None: ...
    def __init__(self, *args: Any, **kwargs: Any):
        """
        `RotationMatrix()`, `RotationMatrix(R)` with an array of shape (3, 3), `RotationMatrix(quaternion)`,
        `RotationMatrix(theta_lambda)` with an AngleAxis, `RotationMatrix(rpy)`, `RotationMatrix(other)`.

        Raises:
            RuntimeError: `R` is no rotation matrix, the quaternion or the axis is zero or not finite.
        """
        matrix_of = PLAIN_MATRICES.get(type(args[0])) if len(args) == 1 and not kwargs and self._T is float else None
        if matrix_of is not None:
            self._M = matrix_of(args[0])
        elif len(args) == 1 and self._T is float and (M := _checked_matrix(args[0])) is not None:
            self._M = M
        elif args or kwargs:
            self._choose("init", args, kwargs)
        else:
            self._M = identity(self._T, 3)

    @staticmethod
    def _ways_init(cls: type[RotationMatrix]) -> list[Overload]:
        T = cls._T

        def copy_of(self: RotationMatrix, other: RotationMatrix) -> None:
            self._M = other._M

        def from_quaternion(self: RotationMatrix, quaternion: Quaternion) -> None:
            self._M = _of_quaternion(quaternion)

        def from_angle_axis(self: RotationMatrix, theta_lambda: AngleAxis) -> None:
            self._M = _of_angle_axis(theta_lambda)

        def from_rpy(self: RotationMatrix, rpy: RollPitchYaw) -> None:
            self._M = rpy._to_matrix()

        return [
            overload(copy_of, other=instance_of(cls)),
            overload(cls.set, R=matrix(T, 3, 3)),
            overload(from_quaternion, quaternion=instance_of(Quaternion_[T])),
            overload(from_angle_axis, theta_lambda=instance_of(AngleAxis_[T])),
            overload(from_rpy, rpy=instance_of(RollPitchYaw_[T])),
        ]

    @classmethod
    def _make(cls, M: np.ndarray) -> RotationMatrix:
        """Unchecked, from an array that nobody else will write."""
        new = _new(cls._template[cls._T] if cls._T is not float else RotationMatrix)
        M.setflags(write=False)
        new._M = M
        return new

    @classmethod
    def Identity(cls) -> RotationMatrix:
        """The rotation matrix of two aligned frames."""
        return cls._make(identity(cls._T, 3))

    @classmethod
    def MakeUnchecked(cls, R: ArrayLike) -> RotationMatrix:
        """A rotation matrix from any array of shape (3, 3), unchecked."""
        return cls._make(cls._argument("MakeUnchecked", matrix(cls._T, 3, 3), R=R))

    @classmethod
    def MakeXRotation(cls, theta: Scalar) -> RotationMatrix:
        """Rotation by `theta` [rad] about the x axis."""
        if cls._T is float and (made := _about_axis(theta, 0.0)) is not None:
            return made
        return cls._make_axis("MakeXRotation", theta, 0)

    @classmethod
    def MakeYRotation(cls, theta: Scalar) -> RotationMatrix:
        """Rotation by `theta` [rad] about the y axis."""
        if cls._T is float and (made := _about_axis(theta, 1.0)) is not None:
            return made
        return cls._make_axis("MakeYRotation", theta, 1)

    @classmethod
    def MakeZRotation(cls, theta: Scalar) -> RotationMatrix:
        """Rotation by `theta` [rad] about the z axis."""
        if cls._T is float and (made := _about_axis(theta, 2.0)) is not None:
            return made
        return cls._make_axis("MakeZRotation", theta, 2)

    @classmethod
    def _make_axis(cls, call: str, theta: Scalar, axis: int) -> RotationMatrix:
        theta = cls._argument(call, scalar(cls._T), theta=theta)
        M, s = identity(cls._T, 3).copy(), sin(theta)
        i, j = (axis + 1) % 3, (axis + 2) % 3
        M[i, i] = M[j, j] = cos(theta)
        M[i, j], M[j, i] = -s, s
        return cls._make(M)

    @classmethod
    @checked
    def MakeFromOneVector(cls, b_A: Scalars, axis_index: int) -> RotationMatrix:
        """A right-handed frame B whose axis `axis_index` (0, 1, 2) points along `b_A`.

        The next axis has a zero where the smallest component of `b_A` is (the first of equals).

        Args:
            b_A: Direction of any length above 1e-10, expressed in A, shape (3,).
            axis_index: Which of B's axes it becomes.

        Raises:
            RuntimeError: `b_A` is too short or not finite, or `axis_index` is not 0, 1 or 2.
        """
        array, axis_index = cls._argument("MakeFromOneVector", vector(cls._T, 3), b_A=b_A), operator.index(axis_index)
        if axis_index not in (0, 1, 2):
            raise RuntimeError(f"RotationMatrix.MakeFromOneVector(): axis_index is {axis_index}, not 0, 1 or 2.")
        b = array.tolist()
        length = sqrt(b[0] * b[0] + b[1] * b[1] + b[2] * b[2])
        if not is_symbolic(cls._T) and not (length >= 1e-10 and length < float("inf")):
            raise RuntimeError(
                f"RotationMatrix.MakeFromOneVector() cannot normalize the given vector {b} of length {length}: "
                "it must be finite and at least 1e-10 long."
            )
        return cls._from_unit_vector([x / length for x in b], axis_index)

    @classmethod
    def _from_unit_vector(cls, u: list, axis_index: int) -> RotationMatrix:
        i = int(np.argmin(np.abs(numeric(np.array(u)))))
        j, k = (i + 1) % 3, (i + 2) % 3
        length = sqrt(1.0 - u[i] * u[i])
        r = 1.0 / length
        s = -r * u[i]
        M = np.empty((3, 3), dtype=np.float64 if cls._T is float else object)
        v, w = (axis_index + 1) % 3, (axis_index + 2) % 3
        M[:, axis_index] = u
        M[i, v], M[j, v], M[k, v] = cls._T(0.0), -r * u[k], r * u[j]
        M[i, w], M[j, w], M[k, w] = length, s * u[j], s * u[k]
        return cls._make(M)

    @classmethod
    def ProjectToRotationMatrix(cls, M: Scalars) -> RotationMatrix:
        """The rotation matrix nearest to `M` in the Frobenius norm.

        Args:
            M: Any matrix with a positive determinant, shape (3, 3).

        Raises:
            RuntimeError: the nearest orthonormal matrix is a reflection.
        """
        values = numeric(cls._argument("ProjectToRotationMatrix", matrix(cls._T, 3, 3), M=M))
        if not np.isfinite(values).all():
            raise RuntimeError(f"RotationMatrix.ProjectToRotationMatrix(): {values.tolist()} is not finite.")
        U, _, Vt = np.linalg.svd(values)
        R = U.dot(Vt)
        if np.linalg.det(R) < 0.0:
            raise RuntimeError(
                f"RotationMatrix.ProjectToRotationMatrix(): {values.tolist()} is nearest to a reflection; "
                "its determinant must be positive."
            )
        return cls._make(as_array(cls._T, R, (3, 3)))

    def set(self, R: ArrayLike) -> None:
        """Replace by an array of shape (3, 3).

        Raises:
            RuntimeError: it is no rotation matrix.
        """
        self._M = _checked(self._T, self._argument("set", matrix(self._T, 3, 3), R=R))

    def matrix(self) -> np.ndarray:
        """The numbers, shape (3, 3)."""
        return self._M.copy()

    def row(self, index: int) -> np.ndarray:
        """Row 0, 1 or 2: an axis of A expressed in B, shape (3,), read-only."""
        return self._M[self._in_range("row", index)]

    def col(self, index: int) -> np.ndarray:
        """Column 0, 1 or 2: an axis of B expressed in A, shape (3,), read-only."""
        return self._M[:, self._in_range("col", index)]

    def _in_range(self, call: str, index: int) -> int:
        if operator.index(index) not in (0, 1, 2):
            raise IndexError(f"RotationMatrix.{call}(): index is {index}, not 0, 1 or 2.")
        return int(index)

    def inverse(self) -> RotationMatrix:
        """R_BA of this R_AB."""
        if (made := _inverse(self)) is not None:
            return made
        return self._make(self._M.T.copy())

    def transpose(self) -> RotationMatrix:
        """R_BA of this R_AB, the same as `inverse`."""
        if (made := _inverse(self)) is not None:
            return made
        return self._make(self._M.T.copy())

    def InvertAndCompose(self, other: RotationMatrix) -> RotationMatrix:
        """R_BC of this R_AB and another R_AC."""
        if (made := _between(self, other)) is not None:
            return made
        other = self._argument("InvertAndCompose", instance_of(self._plain_class()), other=other)
        return self._make(product(self._T, self._M.T, other._M))

    @typing_overload
    def multiply(self, other: RotationMatrix) -> RotationMatrix: ...
    @typing_overload
    def multiply(self, v_B: ArrayLike) -> np.ndarray: ...
    def multiply(self, *args: Any, **kwargs: Any) -> RotationMatrix | np.ndarray:
        """R_AC from R_BC (`other`), or v_A from v_B: one vector (3,) or several (3, n)."""
        if len(args) != 1 or kwargs:
            if len(args) + len(kwargs) != 1 or not kwargs.keys() <= {"other", "v_B"}:
                raise incompatible("RotationMatrix.multiply", ["(other)", "(v_B)"], args, kwargs)
            args = tuple(kwargs.values())
        return self.__matmul__(args[0])

    @typing_overload
    def __matmul__(self, other: RotationMatrix) -> RotationMatrix: ...
    @typing_overload
    def __matmul__(self, other: ArrayLike) -> np.ndarray: ...
    def __matmul__(self, other: Any) -> Any:
        if (made := _compose(self, other)) is not None:
            return made
        T = self._T
        if isinstance(other, ScalarBase) and hasattr(other, "_M") and other._T is T:
            return self._make(product(T, self._M, other._M))
        if (made := _turn(self, other)) is not None:
            return made
        if not (T is float and type(other) is _ndarray and other.dtype is _FLOAT64):
            other = self._vectors(other)
        if other.shape[0:1] != (3,) or other.ndim > 2:
            raise self._no_product(other)
        return product(T, self._M, other) if other.ndim == 2 else self._M.dot(other)

    def _vectors(self, value: Scalars) -> np.ndarray:
        try:
            return any_array(self._T, value)
        except Mismatch:
            raise self._no_product(value) from None

    def _no_product(self, value: object) -> TypeError:
        name = pretty_class_name(self._plain_class())
        vectors = f"(v_B: {self._T.__name__} array of shape (3,) or (3, n))"
        return incompatible(f"{name}.multiply", [f"(other: {name})", vectors], (value,), {})

    def IsValid(self) -> bool:
        """Whether the matrix is orthonormal to Drake's tolerance (128 eps) and right-handed."""
        if _is_valid(self):
            return True
        T, M = self._T, self._M
        orthonormal = at_most(largest_magnitude(M.dot(M.T) - identity(T, 3), T), TOLERANCE, T)
        (a, b, c), (d, e, f), (g, h, i) = M.tolist()
        determinant = a * (e * i - f * h) + b * (f * g - d * i) + c * (d * h - e * g)
        return all_of((orthonormal, determinant > 0.0))

    def IsExactlyIdentity(self) -> bool:
        """Whether all numbers are those of the unit matrix."""
        if (same := _are_equal(self, _UNTURNED)) is not None:
            return same
        return all_equal(self._M, identity(self._T, 3), self._T)

    def IsNearlyIdentity(self, tolerance: float = TOLERANCE) -> bool:
        """Whether no number is further than `tolerance` from the unit matrix."""
        if (near := _are_near(self, _UNTURNED, tolerance)) is not None:
            return near
        return at_most(largest_magnitude(self._M - identity(self._T, 3), self._T), tolerance, self._T)

    def IsExactlyEqualTo(self, other: RotationMatrix) -> bool:
        """Whether all numbers are equal to those of `other`."""
        if (same := _are_equal(self, other)) is not None:
            return same
        other = self._argument("IsExactlyEqualTo", instance_of(self._plain_class()), other=other)
        return all_equal(self._M, other._M, self._T)

    def IsNearlyEqualTo(self, other: RotationMatrix, tolerance: float) -> bool:
        """Whether no number is further than `tolerance` from that of `other`."""
        if (near := _are_near(self, other, tolerance)) is not None:
            return near
        other = self._argument("IsNearlyEqualTo", instance_of(self._plain_class()), other=other)
        return at_most(largest_magnitude(self._M - other._M, self._T), tolerance, self._T)

    def ToQuaternion(self) -> Quaternion:
        """The quaternion with a non-negative scalar part."""
        if (made := _quaternion(self)) is not None:
            return made
        return Quaternion_[self._T]._make(rotations.matrix_to_canonical_quaternion(self._M))

    def ToAngleAxis(self) -> eigen_geometry.AngleAxis:
        """Angle in [0, pi] [rad] and axis."""
        if (made := _angle_axis(self)) is not None:
            return made
        new = _new(AngleAxis_[self._T])
        new._set_quaternion(self.ToQuaternion())
        return new

    def ToRollPitchYaw(self) -> RollPitchYaw:
        """Roll, pitch and yaw; pitch in [-pi/2, pi/2] [rad]."""
        return RollPitchYaw_[self._T]._of_rotation_matrix(self)

    def __getstate__(self) -> tuple[Any, ...]:
        return self._M.copy()

    def __setstate__(self, state: np.ndarray) -> None:
        self._M = as_array(self._T, state, (3, 3))

    def __repr__(self) -> str:
        rows = "".join(f"  {_indented(row)},\n" for row in self._M.tolist())
        return f"{pretty_class_name(type(self))}([\n{rows}])"


def _indented(value: object) -> str:
    return repr(value).replace("\n", "\n  ")


PLAIN_MATRICES: dict[type, Callable[[Any], np.ndarray]] = {
    RotationMatrix: operator.attrgetter("_M"),
    Quaternion: _of_quaternion,
    AngleAxis: _of_angle_axis,
}
"""The matrix of what turns, on floats, by its class: nearly all that is built is of these. RollPitchYaw adds itself."""

ROTATION = Slots(RotationMatrix, {"_M": (3, 3)})
_compose = short_way(globals(), "_compose", poses.compose_rotations, ROTATION, ROTATION, gives=ROTATION)
_turn = short_way(globals(), "_turn", poses.turn_vector, ROTATION, (3,), gives=(3,), frozen=False)
_inverse = short_way(globals(), "_inverse", poses.invert_rotation, ROTATION, gives=ROTATION, duals=False)
_between = short_way(globals(), "_between", poses.invert_and_compose_rotations, ROTATION, ROTATION, gives=ROTATION)
_are_near = short_way(globals(), "_are_near", poses.are_rotations_near, ROTATION, ROTATION, float, gives=bool)
_are_equal = short_way(globals(), "_are_equal", poses.are_rotations_equal, ROTATION, ROTATION, gives=bool)
_is_valid = short_way(globals(), "_is_valid", poses.is_rotation_valid, ROTATION, gives=bool)
_about_axis = short_way(globals(), "_about_axis", poses.rotation_about_axis, float, float, gives=ROTATION)
_quaternion = short_way(globals(), "_quaternion", poses.quaternion_of_matrix, ROTATION, gives=QUATERNION)
_angle_axis = short_way(globals(), "_angle_axis", poses.angle_axis_of_rotation, ROTATION, gives=ANGLE_AXIS, duals=False)
_checked_matrix = short_way(globals(), "_checked_matrix", poses.rotation_of_matrix, (3, 3), gives=(3, 3))
_of_any = short_way(globals(), "_of_any", poses.rotation_of_any_quaternion, QUATERNION, gives=(3, 3))
_about = short_way(globals(), "_about", poses.rotation_of_angle_axis, ANGLE_AXIS, gives=(3, 3))

RotationMatrix_ = ScalarTemplate("RotationMatrix_", RotationMatrix, scope="sheldrake.math", value_type=True)
_UNTURNED = RotationMatrix()
