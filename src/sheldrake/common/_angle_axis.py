"""Rotations by an angle about an axis, under Eigen's names."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any
from typing import overload as typing_overload

import numpy as np

from sheldrake.common import _rotations as rotations
from sheldrake.common._kernels import poses
from sheldrake.common._kinds import instance_of
from sheldrake.common._names import pretty_class_name
from sheldrake.common._overloads import Overload, overload
from sheldrake.common._quaternion import Quaternion_
from sheldrake.common._scalars import (
    ScalarBase,
    ScalarTemplate,
    as_array,
    as_scalar,
    matrix,
    new_array,
    plain_vector,
    scalar,
    vector,
)
from sheldrake.common._turning import check_unit
from sheldrake.common.quick import Slots, short_way

if TYPE_CHECKING:
    from typing_extensions import Self

    from sheldrake.common._quaternion import Quaternion
    from sheldrake.common._types import Scalar, Scalars


class AngleAxis(ScalarBase):
    """A rotation by an angle [rad] about a unit vector."""

    __slots__ = ("_angle", "_axis")
    _angle: Any
    _axis: np.ndarray
    _FIELDS = ("_angle", "_axis")

    @typing_overload
    def __init__(self) -> None: ...
    @typing_overload
    def __init__(self, angle: Scalar, axis: Scalars) -> None: ...
    @typing_overload
    def __init__(self, quaternion: Quaternion) -> None: ...
    @typing_overload
    def __init__(self, rotation: Scalars) -> None: ...
    @typing_overload
    def __init__(self, other: AngleAxis) -> None: ...
    def __init__(self, *args: Any, **kwargs: Any):
        """
        `AngleAxis()`, `AngleAxis(angle, axis)`, `AngleAxis(quaternion)`, `AngleAxis(rotation)`, `AngleAxis(other)`.

        Raises:
            RuntimeError: the length of the axis is not one (to 1e-5).
        """
        if len(args) == 2 and type(args[0]) is float is self._T and not kwargs:
            axis = _unit(plain_vector(args[1]) if type(args[1]) is list else args[1])
            if axis is not None:
                self._angle, self._axis = args[0], axis
                return
        self._choose("init", args, kwargs)

    @staticmethod
    def _ways_init(cls: type[AngleAxis]) -> list[Overload]:
        T = cls._T

        def set_both(self: AngleAxis, angle: Scalar, axis: np.ndarray) -> None:
            check_unit(T, axis, "Axis")
            self._angle, self._axis = angle, axis

        def copy_of(self: AngleAxis, other: AngleAxis) -> None:
            self._angle, self._axis = other._angle, other._axis

        return [
            overload(lambda self: set_both(self, as_scalar(T, 0.0), as_array(T, [1.0, 0.0, 0.0], (3,)))),
            overload(set_both, angle=scalar(T), axis=vector(T, 3)),
            overload(cls._set_quaternion, quaternion=instance_of(Quaternion_[T])),
            overload(cls._set_rotation, rotation=matrix(T, 3, 3)),
            overload(copy_of, other=instance_of(cls)),
        ]

    def _set_quaternion(self, quaternion: Quaternion) -> None:
        angle, *axis = rotations.quaternion_to_angle_axis(quaternion._wxyz.tolist())
        self._angle, self._axis = angle, new_array(self._T, axis)

    def _set_rotation(self, R: np.ndarray) -> None:
        wxyz = rotations.matrix_to_quaternion(R)
        check_unit(self._T, new_array(self._T, wxyz), "Quaternion of the rotation matrix")
        self._set_quaternion(Quaternion_[self._T]._make(wxyz))

    @classmethod
    def Identity(cls) -> Self:
        """The rotation by zero."""
        return cls._plain_class()()

    def angle(self) -> float:
        """The angle [rad]."""
        return self._angle

    def axis(self) -> np.ndarray:
        """The unit vector turned about, shape (3,)."""
        return self._axis.copy()

    def quaternion(self) -> Quaternion:
        """The same rotation as a quaternion."""
        return Quaternion_[self._T]._make(rotations.angle_axis_to_quaternion(self._angle, self._axis.tolist()))

    def rotation(self) -> np.ndarray:
        """The rotation matrix, shape (3, 3)."""
        return rotations.angle_axis_to_matrix(self._T, self._angle, self._axis.tolist()).copy()

    def set_angle(self, angle: Scalar) -> None:
        """Replace the angle [rad]."""
        self._angle = self._argument("set_angle", scalar(self._T), angle=angle)

    def set_axis(self, axis: Scalars) -> None:
        """Replace the axis, a unit vector (to 1e-5), shape (3,)."""
        unit = self._argument("set_axis", vector(self._T, 3), axis=axis)
        check_unit(self._T, unit, "Axis")
        self._axis = unit

    def set_quaternion(self, q: Quaternion) -> None:
        """Replace by the rotation of a quaternion."""
        self._set_quaternion(self._argument("set_quaternion", instance_of(Quaternion_[self._T]), q=q))

    def set_rotation(self, rotation: Scalars) -> None:
        """Replace by the rotation of a matrix, shape (3, 3)."""
        self._set_rotation(self._argument("set_rotation", matrix(self._T, 3, 3), rotation=rotation))

    def multiply(self, other: AngleAxis) -> Quaternion:
        """The product with another rotation, as a quaternion."""
        other = self._argument("multiply", instance_of(self._plain_class()), other=other)
        return self.quaternion().multiply(other.quaternion())

    def __matmul__(self, other: AngleAxis) -> Quaternion:
        return self.multiply(other)

    def inverse(self) -> Self:
        """The rotation by the opposite angle."""
        new: Any = object.__new__(self._plain_class())
        new._angle, new._axis = -self._angle, self._axis
        return new

    def __getstate__(self) -> tuple[Scalar, np.ndarray]:
        return (self._angle, self._axis.copy())

    def __setstate__(self, state: tuple[Scalar, np.ndarray]) -> None:
        self._angle, self._axis = state[0], as_array(self._T, state[1], (3,))

    def __str__(self) -> str:
        return f"{pretty_class_name(type(self))}(angle={self._angle}, axis={self._axis})"

    __repr__ = __str__


ANGLE_AXIS = Slots(AngleAxis, {"_angle": float, "_axis": (3,)})
_unit = short_way(globals(), "_unit", poses.unit_vector, (3,), gives=(3,))

AngleAxis_ = ScalarTemplate("AngleAxis_", AngleAxis, scope="sheldrake.common.eigen_geometry")
