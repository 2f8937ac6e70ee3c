"""Poses under Eigen's names."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any
from typing import overload as typing_overload

import numpy as np

from sheldrake.common import _rotations as rotations
from sheldrake.common._kinds import instance_of
from sheldrake.common._overloads import Overload, overload
from sheldrake.common._quaternion import Quaternion_
from sheldrake.common._scalars import (
    ScalarBase,
    ScalarTemplate,
    as_array,
    frozen,
    identity,
    is_symbolic,
    matrix,
    vector,
    zeros,
)
from sheldrake.common._turning import TOLERANCE, check_rotation, only_argument, turn

if TYPE_CHECKING:
    from typing_extensions import Self

    from sheldrake.common._quaternion import Quaternion
    from sheldrake.common._types import Scalars

_matrix = matrix  # which is a method inside the class


class Isometry3(ScalarBase):
    """A pose: rotation and translation [m]."""

    __slots__ = ("_p", "_rotation")
    _FIELDS = ("_rotation", "_p")

    @typing_overload
    def __init__(self) -> None: ...
    @typing_overload
    def __init__(self, matrix: Scalars) -> None: ...
    @typing_overload
    def __init__(self, rotation: Scalars, translation: Scalars) -> None: ...
    @typing_overload
    def __init__(self, quaternion: Quaternion, translation: Scalars) -> None: ...
    @typing_overload
    def __init__(self, other: Isometry3) -> None: ...
    def __init__(self, *args: Any, **kwargs: Any):
        """
        `Isometry3()`, `Isometry3(matrix)` with shape (4, 4), `Isometry3(rotation, translation)`,
        `Isometry3(quaternion, translation)`, `Isometry3(other)`.

        Raises:
            RuntimeError: the matrix is not a pose (to 1e-5).
        """
        self._choose("init", args, kwargs)

    @staticmethod
    def _ways_init(cls: type[Isometry3]) -> list[Overload]:
        T = cls._T

        def set_parts(self: Isometry3, R: np.ndarray, p: np.ndarray) -> None:
            check_rotation(T, R)
            self._rotation, self._p = R, p

        def setturned(self: Isometry3, quaternion: Quaternion, p: np.ndarray) -> None:
            self._rotation, self._p = rotations.unit_quaternion_to_matrix(T, quaternion._wxyz), p

        def copy_of(self: Isometry3, other: Isometry3) -> None:
            self._rotation, self._p = other._rotation, other._p

        return [
            overload(lambda self: set_parts(self, identity(T, 3), zeros(T, 3))),
            overload(cls._set_matrix, matrix=matrix(T, 4, 4)),
            overload(set_parts, rotation=matrix(T, 3, 3), translation=vector(T, 3)),
            overload(setturned, quaternion=instance_of(Quaternion_[T]), translation=vector(T, 3)),
            overload(copy_of, other=instance_of(cls)),
        ]

    def _set_matrix(self, X: np.ndarray) -> None:
        R = frozen(X[:3, :3].copy())
        check_rotation(self._T, R)
        if not is_symbolic(self._T):
            row = [float(x if self._T is float else x.value()) for x in X[3].tolist()]
            if max(abs(x - y) for x, y in zip(row, (0.0, 0.0, 0.0, 1.0))) > TOLERANCE:
                raise RuntimeError(f"Homogeneous matrix is improperly scaled. Its last row is {row}, not [0, 0, 0, 1].")
        self._rotation, self._p = R, frozen(X[:3, 3].copy())

    @classmethod
    def _make(cls, R: np.ndarray, p: np.ndarray) -> Self:
        new: Any = object.__new__(cls._plain_class())
        new._rotation, new._p = frozen(R), frozen(p)
        return new

    @classmethod
    def Identity(cls) -> Self:
        """The pose that changes nothing."""
        return cls._plain_class()()

    def matrix(self) -> np.ndarray:
        """The homogeneous matrix, shape (4, 4)."""
        X = as_array(self._T, np.eye(4), (4, 4)).copy()
        X[:3, :3], X[:3, 3] = self._rotation, self._p
        return X

    def set_matrix(self, matrix: Scalars, /) -> None:
        """Replace by a homogeneous matrix, shape (4, 4)."""
        self._set_matrix(self._argument("set_matrix", _matrix(self._T, 4, 4), matrix=matrix))

    def translation(self) -> np.ndarray:
        """The translation [m], shape (3,)."""
        return self._p.copy()

    def set_translation(self, translation: Scalars, /) -> None:
        """Replace the translation [m], shape (3,)."""
        self._p = self._argument("set_translation", vector(self._T, 3), translation=translation)

    def rotation(self) -> np.ndarray:
        """The rotation matrix, shape (3, 3)."""
        return self._rotation.copy()

    def set_rotation(self, rotation: Scalars, /) -> None:
        """Replace the rotation matrix, shape (3, 3)."""
        R = self._argument("set_rotation", _matrix(self._T, 3, 3), rotation=rotation)
        check_rotation(self._T, R)
        self._rotation = R

    def quaternion(self) -> Quaternion:
        """The rotation as a quaternion."""
        return Quaternion_[self._T]._make(rotations.matrix_to_quaternion(self._rotation))

    def set_quaternion(self, quaternion: Quaternion, /) -> None:
        """Replace the rotation by that of a quaternion."""
        q = self._argument("set_quaternion", instance_of(Quaternion_[self._T]), quaternion=quaternion)
        self._rotation = rotations.unit_quaternion_to_matrix(self._T, q._wxyz)

    @typing_overload
    def multiply(self, other: Isometry3) -> Isometry3: ...
    @typing_overload
    def multiply(self, position: Scalars) -> np.ndarray: ...
    def multiply(self, *args: Any, **kwargs: Any) -> Isometry3 | np.ndarray:
        """The product with another pose, or a position [m] (3,) or several (3, n) moved by this one."""
        value = only_argument(self, "multiply", ("other", "position"), args, kwargs)
        if isinstance(value, self._plain_class()):
            return self._make(self._rotation.dot(value._rotation), self._rotation.dot(value._p) + self._p)
        R, p = self._rotation, self._p
        return turn(self, "multiply", "position", value, lambda v: R.dot(np.array(v, dtype=R.dtype)) + p)

    @typing_overload
    def __matmul__(self, other: Isometry3) -> Isometry3: ...
    @typing_overload
    def __matmul__(self, other: Scalars) -> np.ndarray: ...
    def __matmul__(self, other: Any) -> Isometry3 | np.ndarray:
        return self.multiply(other)

    def inverse(self) -> Self:
        """The pose that undoes this one."""
        R = self._rotation.T.copy()
        return self._make(R, -R.dot(self._p))

    def __getstate__(self) -> np.ndarray:
        return self.matrix()

    def __setstate__(self, state: np.ndarray) -> None:
        X = as_array(self._T, state, (4, 4))
        self._rotation, self._p = frozen(X[:3, :3].copy()), frozen(X[:3, 3].copy())

    def __str__(self) -> str:
        return str(self.matrix())


Isometry3_ = ScalarTemplate("Isometry3_", Isometry3, scope="sheldrake.common.eigen_geometry", value_type=True)
