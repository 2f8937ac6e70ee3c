"""RigidTransform: the pose of one frame in another.

On floats, AutoDiffXd and Expression alike; built on `_rotation_matrix`, and what X_WB is everywhere in the library.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any
from typing import overload as typing_overload

import numpy as np

from sheldrake.common._kernels import poses
from sheldrake.common._kinds import instance_of
from sheldrake.common._names import pretty_class_name
from sheldrake.common._overloads import Mismatch, Overload, incompatible, kind, overload
from sheldrake.common._scalar_math import all_equal, all_of, at_most, largest_magnitude
from sheldrake.common._scalars import (
    ScalarBase,
    ScalarTemplate,
    any_array,
    as_array,
    frozen,
    home_of,
    identity,
    is_symbolic,
    matrix,
    plain_vector,
    scalar,
    vector,
    zeros,
)
from sheldrake.common.eigen_geometry import AngleAxis_, Isometry3_, Quaternion_
from sheldrake.common.quick import Slots, short_way
from sheldrake.math._roll_pitch_yaw import RollPitchYaw_
from sheldrake.math._rotation_matrix import PLAIN_MATRICES, ROTATION, RotationMatrix, RotationMatrix_, product

if TYPE_CHECKING:
    from numpy.typing import ArrayLike
    from typing_extensions import Self

    from sheldrake.common import eigen_geometry
    from sheldrake.common._types import Scalars
    from sheldrake.common.eigen_geometry import AngleAxis, Isometry3, Quaternion
    from sheldrake.math._roll_pitch_yaw import RollPitchYaw

_new = object.__new__
_ndarray = np.ndarray
_FLOAT64 = np.dtype(np.float64)


class RigidTransform(ScalarBase):
    """The pose X_AB of frame B in frame A: the rotation matrix R_AB and the position p_AoBo_A [m] of B's origin.

    `X_AC = X_AB @ X_BC` and `p_AQ_A = X_AB @ p_BQ_B`.
    """

    __slots__ = ("_R", "_p")
    _FIELDS = ("_R", "_p")  # the arrays are read-only and may be shared; the RotationMatrix is this pose's own

    @typing_overload
    def __init__(self) -> None: ...
    @typing_overload
    def __init__(self, other: RigidTransform) -> None: ...
    @typing_overload
    def __init__(self, R: RotationMatrix, p: Scalars = ...) -> None: ...
    @typing_overload
    def __init__(self, rpy: RollPitchYaw, p: Scalars) -> None: ...
    @typing_overload
    def __init__(self, quaternion: Quaternion, p: Scalars) -> None: ...
    @typing_overload
    def __init__(self, theta_lambda: AngleAxis, p: Scalars) -> None: ...
    @typing_overload
    def __init__(self, p: Scalars) -> None: ...
    @typing_overload
    def __init__(self, pose: Isometry3 | Scalars) -> None: ...
    def __init__(self, *args: Any, **kwargs: Any):
        """
        `RigidTransform()`, `RigidTransform(R, p)`, `RigidTransform(rpy, p)`, `RigidTransform(quaternion, p)`,
        `RigidTransform(theta_lambda, p)`, `RigidTransform(R)`, `RigidTransform(p)`, `RigidTransform(pose)` with an
        Isometry3 or an array of shape (3, 4) or (4, 4), `RigidTransform(other)`.

        Raises:
            RuntimeError: an array of another shape, or its rotation part is no rotation matrix.
        """
        if len(args) == 2 and not kwargs and self._T is float:  # nearly all
            orientation, p = args
            if type(orientation) is RotationMatrix and type(p) is _ndarray and p.dtype is _FLOAT64 and p.shape == (3,):
                self._R = R = _new(RotationMatrix)
                R._M = orientation._M
                self._p = p = p.copy()
                p.setflags(write=False)
                return
            matrix_of, p = PLAIN_MATRICES.get(type(orientation)), plain_vector(p)
            if matrix_of is not None and p is not None:
                self._R = R = _new(RotationMatrix)
                R._M, self._p = matrix_of(orientation), p
                return
        elif len(args) == 1 and not kwargs and self._T is float:
            if (p := plain_vector(args[0])) is not None:
                self._R = R = _new(RotationMatrix)
                R._M, self._p = _UNIT, p
                return
            if (made := _of_matrix(args[0])) is not None:
                self._R, self._p = made._R, made._p
                return
        if args or kwargs:
            self._choose("init", args, kwargs)
        elif self._T is float:
            self._R = R = _new(RotationMatrix)
            R._M, self._p = _UNIT, _ORIGIN
        else:
            self._R, self._p = RotationMatrix_[self._T](), zeros(self._T, 3)

    @staticmethod
    def _ways_init(cls: Any) -> list[Overload]:
        T = cls._T
        R_ = RotationMatrix_[T]

        def copy_of(self: Any, other: Any) -> None:
            self._R, self._p = other._R.__copy__(), other._p

        def set_both(self: Any, orientation: Any, p: np.ndarray) -> None:
            self._R, self._p = R_(orientation), p

        def from_rpy(self: Any, rpy: Any, p: np.ndarray) -> None:
            self._R, self._p = rpy.ToRotationMatrix(), p

        def from_rotation(self: Any, R: ArrayLike) -> None:
            self._R, self._p = R_(R), zeros(T, 3)

        def from_position(self: Any, p: np.ndarray) -> None:
            self._R, self._p = R_(), p

        array_kind = kind("array (3, 4) or (4, 4)")(lambda value: _array_of_numbers(T, value))
        return [
            overload(copy_of, other=instance_of(cls)),
            overload(set_both, R=instance_of(R_), p=vector(T, 3)),
            overload(from_rpy, rpy=instance_of(RollPitchYaw_[T]), p=vector(T, 3)),
            overload(set_both, quaternion=instance_of(Quaternion_[T]), p=vector(T, 3)),
            overload(set_both, theta_lambda=instance_of(AngleAxis_[T]), p=vector(T, 3)),
            overload(from_rotation, R=instance_of(R_)),
            overload(from_position, p=vector(T, 3)),
            overload(cls.SetFromIsometry3, pose=instance_of(Isometry3_[T])),
            overload(cls._set_from_array, pose=array_kind),
        ]

    def _set_from_array(self, pose: np.ndarray) -> None:
        if pose.shape not in ((3, 4), (4, 4)):
            raise RuntimeError(
                f"RigidTransform(): an array of shape {pose.shape} is neither a position (3,) nor a pose (3, 4) "
                "or (4, 4)."
            )
        self._R = RotationMatrix_[self._T](pose[:3, :3])
        self._p = frozen(pose[:3, 3].copy())

    @classmethod
    def _make(cls, M: np.ndarray, p: np.ndarray) -> RigidTransform:
        """Unchecked, from arrays that nobody else will write."""
        T = cls._T
        if T is float:
            new = _new(RigidTransform)
            R = _new(RotationMatrix)
        else:
            new, R = _new(cls._plain_class()), _new(RotationMatrix_[T])
        M.setflags(False)  # type: ignore[call-arg]
        p.setflags(False)  # type: ignore[call-arg]
        R._M = M
        new._R = R
        new._p = p
        return new

    @classmethod
    def _make_each(cls, Ms: np.ndarray, ps: np.ndarray) -> list[Any]:
        """`_make` of the rows of two arrays that nobody else will write, in less time."""
        if cls._T is not float:
            return list(map(cls._make, Ms, ps))
        Ms.setflags(False)  # type: ignore[call-arg]  # and so are the rows
        ps.setflags(False)  # type: ignore[call-arg]
        poses = []
        for M, p in zip(Ms, ps):
            new, R = _new(RigidTransform), _new(RotationMatrix)
            R._M, new._R, new._p = M, R, p
            poses.append(new)
        return poses

    @classmethod
    def _maker(cls, rotation: Callable[[], np.ndarray], position: Callable[[], np.ndarray]) -> Callable[[], Any]:
        """A function that makes a pose, unchecked, of the read-only arrays that two others give."""
        from sheldrake.common.calls import object_query

        return object_query(cls._plain_class(), _R=object_query(RotationMatrix_[cls._T], _M=rotation), _p=position)

    def __copy__(self) -> Self:
        new, R = _new(type(self)), _new(type(self._R))
        R._M, new._R, new._p = self._R._M, R, self._p
        return new

    @classmethod
    def Identity(cls) -> RigidTransform:
        """The pose of a frame in itself."""
        return cls._plain_class()()

    @classmethod
    def MakeUnchecked(cls, pose: Any) -> RigidTransform:
        """A pose from any array of shape (3, 4), unchecked."""
        pose = cls._argument("MakeUnchecked", matrix(cls._T, 3, 4), pose=pose)
        return cls._make(pose[:, :3].copy(), pose[:, 3].copy())

    def set(self, R: RotationMatrix, p: Scalars) -> None:
        """Replace rotation and position [m]."""
        R = self._argument("set", instance_of(RotationMatrix_[self._T]), R=R)
        p = self._argument("set", vector(self._T, 3), p=p)
        self._R._M, self._p = R._M, p

    def SetIdentity(self) -> RigidTransform:
        """Make this the pose of a frame in itself; gives this object."""
        self._R._M, self._p = RotationMatrix_[self._T]()._M, zeros(self._T, 3)
        return self

    def SetFromIsometry3(self, pose: Any) -> None:
        """Replace by an Isometry3."""
        pose = self._argument("SetFromIsometry3", instance_of(Isometry3_[self._T]), pose=pose)
        self._R, self._p = RotationMatrix_[self._T](pose._rotation), pose._p

    def rotation(self) -> RotationMatrix:
        """R_AB."""
        return self._R

    def translation(self) -> np.ndarray:
        """p_AoBo_A [m], shape (3,), read-only."""
        return self._p

    @typing_overload
    def set_rotation(self, R: RotationMatrix) -> None: ...
    @typing_overload
    def set_rotation(self, rpy: RollPitchYaw) -> None: ...
    @typing_overload
    def set_rotation(self, quaternion: Quaternion) -> None: ...
    @typing_overload
    def set_rotation(self, theta_lambda: eigen_geometry.AngleAxis) -> None: ...
    def set_rotation(self, *args: Any, **kwargs: Any) -> None:
        """Replace the rotation by a RotationMatrix `R`, `rpy`, `quaternion` or AngleAxis `theta_lambda`."""
        self._choose("set_rotation", args, kwargs)

    @staticmethod
    def _ways_set_rotation(cls: Any) -> list[Overload]:
        T = cls._T

        def assign(self: Any, orientation: Any) -> None:
            self._R._M = RotationMatrix_[T](orientation)._M

        return [
            overload(assign, R=instance_of(RotationMatrix_[T])),
            overload(assign, rpy=instance_of(RollPitchYaw_[T])),
            overload(assign, quaternion=instance_of(Quaternion_[T])),
            overload(assign, theta_lambda=instance_of(AngleAxis_[T])),
        ]

    def set_translation(self, p: Scalars) -> None:
        """Replace the position p_AoBo_A [m], shape (3,)."""
        if self._T is float and (plain := plain_vector(p)) is not None:
            self._p = plain
            return
        self._p = self._argument("set_translation", vector(self._T, 3), p=p)

    def GetAsMatrix4(self) -> np.ndarray:
        """The homogeneous matrix, shape (4, 4)."""
        if (made := _matrix4(self)) is not None:
            return made
        X = identity(self._T, 4).copy()
        X[:3, :3], X[:3, 3] = self._R._M, self._p
        return X

    def GetAsMatrix34(self) -> np.ndarray:
        """Its first three rows, shape (3, 4)."""
        if (made := _matrix34(self)) is not None:
            return made
        return np.concatenate((self._R._M, self._p.reshape(3, 1)), axis=1)

    def GetAsIsometry3(self) -> Isometry3:
        """The same pose as an Isometry3."""
        return Isometry3_[self._T]._make(self._R._M, self._p)

    def inverse(self) -> RigidTransform:
        """X_BA of this X_AB."""
        if (made := _inverse(self)) is not None:
            return made
        M = self._R._M.T.copy()
        return self._make(M, -M.dot(self._p))

    def InvertAndCompose(self, other: RigidTransform) -> RigidTransform:
        """X_BC of this X_AB and another X_AC."""
        if (made := _between(self, other)) is not None:
            return made
        other = self._argument("InvertAndCompose", instance_of(self._plain_class()), other=other)
        return self._make(*self._turned(self._R._M.T, other._R._M, other._p - self._p))

    @typing_overload
    def multiply(self, other: RigidTransform) -> RigidTransform: ...
    @typing_overload
    def multiply(self, p_BoQ_B: ArrayLike) -> np.ndarray: ...
    @typing_overload
    def multiply(self, *, vec_B: ArrayLike) -> np.ndarray: ...
    def multiply(self, *args: Any, **kwargs: Any) -> RigidTransform | np.ndarray:
        """X_AC from X_BC (`other`), p_AQ_A from p_BQ_B: one (3,) or several (3, n); or a 4-vector (v, 0) or (p, 1)."""
        if len(args) != 1 or kwargs:
            if len(args) + len(kwargs) != 1 or not kwargs.keys() <= {"other", "p_BoQ_B", "vec_B"}:
                raise incompatible("RigidTransform.multiply", ["(other)", "(p_BoQ_B)", "(vec_B)"], args, kwargs)
            args = tuple(kwargs.values())
        return self.__matmul__(args[0])

    @typing_overload
    def __matmul__(self, other: RigidTransform) -> RigidTransform: ...
    @typing_overload
    def __matmul__(self, other: ArrayLike) -> np.ndarray: ...
    def __matmul__(self, other: Any) -> Any:
        if (made := _compose(self, other)) is not None:
            return made
        M = self._R._M
        T = self._T
        if hasattr(other, "_R") and isinstance(other, ScalarBase) and other._T is T:
            R, p = self._turned(M, other._R._M, other._p)  # type: ignore[attr-defined]
            return self._make(R, p + self._p)
        if (made := _move(self, other)) is not None:
            return made
        if not (T is float and type(other) is _ndarray and other.dtype is _FLOAT64):
            other = self._vectors(other)
        if other.shape == (3,):
            return M.dot(other) + self._p
        if other.ndim == 2 and other.shape[0] == 3:
            return self._of_points(other)
        if other.shape in ((4,), (4, 1)):
            return self._times_four(other)
        raise self._no_product(other)

    def _of_points(self, p_BQ: np.ndarray) -> np.ndarray:
        """p_AQ of points in columns."""
        if self._T is float or is_symbolic(self._T):
            return self._R._M.dot(p_BQ) + self._p[:, None]
        return home_of("AutoDiffXd")._matrices.product(self._R._M, p_BQ, self._p)

    def _turned(self, M: np.ndarray, R: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """M R and M p."""
        if self._T is float:
            return M.dot(R), M.dot(p)
        both = product(self._T, M, np.column_stack((R, p)))
        return both[:, :3], both[:, 3]

    def _vectors(self, value: Any) -> np.ndarray:
        try:
            return any_array(self._T, value)
        except Mismatch:
            raise self._no_product(value) from None

    def _no_product(self, value: Any) -> TypeError:
        name, number = pretty_class_name(self._plain_class()), self._T.__name__
        accepted = [
            f"(other: {name})",
            f"(p_BoQ_B: {number} array of shape (3,) or (3, n))",
            f"(vec_B: {number} array of shape (4,))",
        ]
        return incompatible(f"{name}.multiply", accepted, (value,), {})

    def _times_four(self, vec_B: np.ndarray) -> np.ndarray:
        last = vec_B[3:].item()
        if not is_symbolic(self._T) and not (last == 0 or last == 1):
            raise RuntimeError(
                f"RigidTransform.multiply(): the 4th element of vector {vec_B.ravel().tolist()} is neither 0 (a "
                "direction) nor 1 (a position)."
            )
        return np.concatenate((self.GetAsMatrix34().dot(vec_B), vec_B[3:]))

    def IsExactlyIdentity(self) -> bool:
        """Whether rotation and position are exactly those of the identity."""
        if (same := _are_equal(self, _NOWHERE_ELSE)) is not None:
            return same
        return self.IsExactlyEqualTo(self.Identity())

    def IsNearlyIdentity(self, translation_tolerance: float) -> bool:
        """Whether the rotation is the identity to 128 eps and the position zero to `translation_tolerance` [m]."""
        T = self._T
        if T is float and type(translation_tolerance) is float:
            x, y, z = self._p.tolist()
            moved = max(abs(x), abs(y), abs(z)) if x == x and y == y and z == z else math.nan
            return moved <= translation_tolerance and self._R.IsNearlyIdentity()
        tolerance = self._argument("IsNearlyIdentity", scalar(float), translation_tolerance=translation_tolerance)
        return all_of((at_most(largest_magnitude(self._p, T), tolerance, T), self._R.IsNearlyIdentity()))

    def IsExactlyEqualTo(self, other: Any) -> bool:
        """Whether all numbers are equal to those of `other`."""
        if (same := _are_equal(self, other)) is not None:
            return same
        other = self._argument("IsExactlyEqualTo", instance_of(self._plain_class()), other=other)
        return all_equal(self.GetAsMatrix34(), other.GetAsMatrix34(), self._T)

    def IsNearlyEqualTo(self, other: Any, tolerance: float) -> bool:
        """Whether no number is further than `tolerance` from that of `other`."""
        if (near := _are_near(self, other, tolerance)) is not None:
            return near
        return at_most(self.GetMaximumAbsoluteDifference(other), tolerance, self._T)

    def GetMaximumAbsoluteDifference(self, other: Any) -> float:
        """Largest difference between the numbers of two poses [1 or m]."""
        if (found := _difference(self, other)) is not None:
            return found
        other = self._argument("GetMaximumAbsoluteDifference", instance_of(self._plain_class()), other=other)
        if self._T is float:
            turned, moved = (self._R._M - other._R._M).ravel().tolist(), (self._p - other._p).tolist()
            largest = max(map(abs, turned + moved))
            return math.nan if largest != largest or any(x != x for x in turned + moved) else largest
        return largest_magnitude(self.GetAsMatrix34() - other.GetAsMatrix34(), self._T)

    def GetMaximumAbsoluteTranslationDifference(self, other: Any) -> float:
        """Largest difference between the coordinates of two positions [m]."""
        call = "GetMaximumAbsoluteTranslationDifference"
        other = self._argument(call, instance_of(self._plain_class()), other=other)
        return largest_magnitude(self._p - other._p, self._T)

    def __getstate__(self) -> np.ndarray:
        return self.GetAsMatrix34()

    def __setstate__(self, state: np.ndarray) -> None:
        state = as_array(self._T, state, (3, 4))
        self._R = RotationMatrix_[self._T]._make(state[:, :3].copy())
        self._p = frozen(state[:, 3].copy())

    def __repr__(self) -> str:
        R = repr(self._R).replace("\n", "\n  ")
        p = repr(self._p.tolist()).replace("\n", "\n  ")
        return f"{pretty_class_name(type(self))}(\n  R={R},\n  p={p},\n)"


def _array_of_numbers(T: type, value: object) -> np.ndarray:
    array = any_array(T, value)
    if array.ndim == 0:
        raise Mismatch
    return array


POSE = Slots(RigidTransform, {"_R": ROTATION, "_p": (3,)})
_UNIT, _ORIGIN = identity(float, 3), zeros(float, 3)
_compose = short_way(globals(), "_compose", poses.compose_poses, POSE, POSE, gives=POSE)
_move = short_way(globals(), "_move", poses.move_point, POSE, (3,), gives=(3,), frozen=False)
_inverse = short_way(globals(), "_inverse", poses.invert_pose, POSE, gives=POSE)
_between = short_way(globals(), "_between", poses.invert_and_compose_poses, POSE, POSE, gives=POSE)
_are_near = short_way(globals(), "_are_near", poses.are_poses_near, POSE, POSE, float, gives=bool)
_are_equal = short_way(globals(), "_are_equal", poses.are_poses_equal, POSE, POSE, gives=bool)
_difference = short_way(globals(), "_difference", poses.difference_of_poses, POSE, POSE, gives=float, duals=False)
_matrix4 = short_way(globals(), "_matrix4", poses.pose_matrix, POSE, gives=(4, 4), frozen=False)
_matrix34 = short_way(globals(), "_matrix34", poses.pose_matrix, POSE, gives=(3, 4), frozen=False)
_of_matrix = short_way(globals(), "_of_matrix", poses.pose_of_matrix, (4, 4), gives=POSE)

RigidTransform_ = ScalarTemplate("RigidTransform_", RigidTransform, scope="sheldrake.math", value_type=True)
_NOWHERE_ELSE = RigidTransform()
