"""Rotations and poses under Eigen's names: Quaternion, AngleAxis, Isometry3. Drake's own are in `sheldrake.math`."""

from __future__ import annotations

from typing import Any

import numpy as np

from sheldrake.common import _rotations as rotations
from sheldrake.common._kinds import instance_of
from sheldrake.common._names import _MangledName, pretty_class_name
from sheldrake.common._overloads import Overload, incompatible, overload
from sheldrake.common._scalars import (
    Mismatch,
    ScalarBase,
    ScalarTemplate,
    acos,
    any_array,
    as_array,
    as_scalar,
    frozen,
    identity,
    is_symbolic,
    matrix,
    new_array,
    scalar,
    select,
    sin,
    sqrt,
    vector,
    zeros,
)

__all__ = ["AngleAxis", "AngleAxis_", "Isometry3", "Isometry3_", "Quaternion", "Quaternion_"]

_TOLERANCE = 1e-5  # how far from a unit quaternion, unit axis or rotation an argument may be, as in pydrake


def _check_unit(T: type, numbers: np.ndarray, what: str) -> None:
    if is_symbolic(T):
        return
    length = sqrt(sum(x * x for x in numbers.tolist()))
    if abs(length - 1.0) > _TOLERANCE:
        raise RuntimeError(f"{what} is not normalized: {numbers.tolist()} has length {length}.")


def _check_rotation(T: type, R: np.ndarray) -> None:
    if is_symbolic(T):
        return
    R = R if T is float else as_array(float, [[x.value() for x in row] for row in R.tolist()], (3, 3))
    if np.abs(R.dot(R.T) - np.eye(3)).max() > _TOLERANCE:
        raise RuntimeError(f"Rotation matrix is not orthonormal: {R.tolist()}.")
    if np.linalg.det(R) < 0:
        raise RuntimeError(f"Rotation matrix violates right-hand rule: {R.tolist()} is a reflection.")


def _turn(obj: Any, call: str, name: str, value: Any, one: Any) -> np.ndarray:
    """Apply `one` to a vector (3,) or to each column of (3, n), keeping the shape of the input."""
    T = obj._T
    try:
        array = any_array(T, value)
        if array.ndim not in (1, 2) or array.shape[0] != 3:
            raise Mismatch
    except Mismatch:
        where = f"{pretty_class_name(type(obj))}.{call}"
        raise incompatible(
            where,
            [f"(other: {pretty_class_name(type(obj))})", f"({name}: {T.__name__} array of shape (3,) or (3, n))"],
            (value,),
            {},
        ) from None
    if array.ndim == 1:
        return np.array(one(array.tolist()), dtype=array.dtype)
    columns = [one(column) for column in array.T.tolist()]
    return np.array(columns, dtype=array.dtype).reshape(-1, 3).T.copy()


def _only_argument(obj: Any, call: str, names: tuple[str, ...], args: tuple, kwargs: dict) -> Any:
    values = [*args, *kwargs.values()]
    if len(values) != 1 or any(name not in names for name in kwargs):
        accepted = [f"({name})" for name in names]
        raise incompatible(f"{pretty_class_name(type(obj))}.{call}", accepted, args, kwargs)
    return values[0]


class Quaternion(ScalarBase):
    """A unit quaternion, scalar part first."""

    __slots__ = ("_wxyz",)
    _FIELDS = ("_wxyz",)

    def __init__(self, *args: Any, **kwargs: Any):
        """
        `Quaternion()`, `Quaternion(wxyz)`, `Quaternion(w, x, y, z)`, `Quaternion(rotation)`, `Quaternion(other)`.

        Raises:
            RuntimeError: its length is not one (to 1e-5).
        """
        self._choose("init", args, kwargs)

    @staticmethod
    def _ways_init(cls: Any) -> list[Overload]:
        T = cls._T

        def from_rotation(self: Any, R: np.ndarray) -> None:
            self._set(new_array(T, rotations.matrix_to_quaternion(R)))

        def copy_of(self: Any, other: Any) -> None:
            self._wxyz = other._wxyz

        return [
            overload(lambda self: self._set(as_array(T, [1.0, 0.0, 0.0, 0.0], (4,)))),
            overload(cls._set, wxyz=vector(T, 4)),
            overload(cls._set_four, w=scalar(T), x=scalar(T), y=scalar(T), z=scalar(T)),
            overload(from_rotation, rotation=matrix(T, 3, 3)),
            overload(copy_of, other=instance_of(cls)),
        ]

    def _set(self, wxyz: np.ndarray) -> None:
        _check_unit(self._T, wxyz, "Quaternion")
        self._wxyz = wxyz

    def _set_four(self, *wxyz: Any) -> None:
        self._set(new_array(self._T, wxyz))

    @classmethod
    def _make(cls, wxyz: Any) -> Any:
        """Unchecked, from four numbers of the right type."""
        new: Any = object.__new__(cls._plain_class())
        new._wxyz = wxyz if isinstance(wxyz, np.ndarray) else new_array(cls._T, wxyz)
        return new

    @classmethod
    def Identity(cls) -> Any:
        """The quaternion that does not turn."""
        return cls._plain_class()()

    def w(self) -> Any:
        """The scalar part."""
        return self._wxyz.item(0)

    def x(self) -> Any:
        """The first component of the vector part."""
        return self._wxyz.item(1)

    def y(self) -> Any:
        """The second component of the vector part."""
        return self._wxyz.item(2)

    def z(self) -> Any:
        """The third component of the vector part."""
        return self._wxyz.item(3)

    def wxyz(self) -> np.ndarray:
        """All components, scalar part first, shape (4,)."""
        return self._wxyz.copy()

    def xyz(self) -> np.ndarray:
        """The vector part, shape (3,)."""
        return self._wxyz[1:].copy()

    def set_wxyz(self, *args: Any, **kwargs: Any) -> None:
        """Replace all components: `set_wxyz(wxyz)` or `set_wxyz(w, x, y, z)`.

        Raises:
            RuntimeError: the new length is not one (to 1e-5).
        """
        self._choose("set_wxyz", args, kwargs)

    @staticmethod
    def _ways_set_wxyz(cls: Any) -> list[Overload]:
        T = cls._T
        return [
            overload(cls._set, wxyz=vector(T, 4)),
            overload(cls._set_four, w=scalar(T), x=scalar(T), y=scalar(T), z=scalar(T)),
        ]

    def rotation(self) -> np.ndarray:
        """The rotation matrix, shape (3, 3)."""
        return rotations.unit_quaternion_to_matrix(self._T, self._wxyz).copy()

    def set_rotation(self, rotation: Any, /) -> None:
        """Replace by the quaternion of a rotation matrix, shape (3, 3)."""
        R = self._argument("set_rotation", matrix(self._T, 3, 3), rotation=rotation)
        self._set(new_array(self._T, rotations.matrix_to_quaternion(R)))

    def multiply(self, *args: Any, **kwargs: Any) -> Any:
        """The product with another quaternion, or a vector (3,) or several (3, n) turned by this one."""
        value = _only_argument(self, "multiply", ("other", "vector"), args, kwargs)
        if isinstance(value, self._plain_class()):
            return self._make(rotations.quaternion_product(self._wxyz.tolist(), value._wxyz.tolist()))
        q = self._wxyz.tolist()
        return _turn(self, "multiply", "vector", value, lambda v: rotations.rotate_by_unit_quaternion(q, v))

    def __matmul__(self, other: Any) -> Any:
        return self.multiply(other)

    def inverse(self) -> Any:
        """The quaternion of the opposite rotation."""
        w, x, y, z = self._wxyz.tolist()
        n = rotations.norm2(x, y, z, w)
        return self._make((w / n, -x / n, -y / n, -z / n))

    def conjugate(self) -> Any:
        """The quaternion with the opposite vector part."""
        w, x, y, z = self._wxyz.tolist()
        return self._make((w, -x, -y, -z))

    def slerp(self, t: Any, other: Any) -> Any:
        """Spherical interpolation, from this one at t = 0 to `other` at t = 1, the short way round."""
        cls, T = self._plain_class(), self._T
        t = self._argument("slerp", scalar(T), t=t)
        other = self._argument("slerp", instance_of(cls), other=other)
        a, b = self._wxyz.tolist(), other._wxyz.tolist()
        d = (a[1] * b[1] + a[3] * b[3]) + (a[2] * b[2] + a[0] * b[0])
        cosine = abs(d)

        def along_arc() -> tuple:
            theta = acos(cosine)
            return (sin((1.0 - t) * theta) / sin(theta), sin(t * theta) / sin(theta))

        one = 1.0 - np.finfo(float).eps
        k0, k1 = select(cosine >= one, lambda: (1.0 - t, t), along_arc)
        k1 = select(d < 0.0, lambda: -k1, lambda: k1)
        return self._make([k0 * x + k1 * y for x, y in zip(a, b)])

    def __getstate__(self) -> Any:
        return self._wxyz.copy()

    def __setstate__(self, state: Any) -> None:
        self._wxyz = as_array(self._T, state, (4,))

    def __str__(self) -> str:
        return f"{pretty_class_name(type(self))}(w={self.w()}, x={self.x()}, y={self.y()}, z={self.z()})"

    __repr__ = __str__


class AngleAxis(ScalarBase):
    """A rotation by an angle [rad] about a unit vector."""

    __slots__ = ("_angle", "_axis")
    _FIELDS = ("_angle", "_axis")

    def __init__(self, *args: Any, **kwargs: Any):
        """
        `AngleAxis()`, `AngleAxis(angle, axis)`, `AngleAxis(quaternion)`, `AngleAxis(rotation)`, `AngleAxis(other)`.

        Raises:
            RuntimeError: the length of the axis is not one (to 1e-5).
        """
        self._choose("init", args, kwargs)

    @staticmethod
    def _ways_init(cls: Any) -> list[Overload]:
        T = cls._T

        def set_both(self: Any, angle: Any, axis: np.ndarray) -> None:
            _check_unit(T, axis, "Axis")
            self._angle, self._axis = angle, axis

        def copy_of(self: Any, other: Any) -> None:
            self._angle, self._axis = other._angle, other._axis

        return [
            overload(lambda self: set_both(self, as_scalar(T, 0.0), as_array(T, [1.0, 0.0, 0.0], (3,)))),
            overload(set_both, angle=scalar(T), axis=vector(T, 3)),
            overload(cls._set_quaternion, quaternion=instance_of(Quaternion_[T])),
            overload(cls._set_rotation, rotation=matrix(T, 3, 3)),
            overload(copy_of, other=instance_of(cls)),
        ]

    def _set_quaternion(self, quaternion: Any) -> None:
        angle, *axis = rotations.quaternion_to_angle_axis(quaternion._wxyz.tolist())
        self._angle, self._axis = angle, new_array(self._T, axis)

    def _set_rotation(self, R: np.ndarray) -> None:
        wxyz = rotations.matrix_to_quaternion(R)
        _check_unit(self._T, new_array(self._T, wxyz), "Quaternion of the rotation matrix")
        self._set_quaternion(Quaternion_[self._T]._make(wxyz))

    @classmethod
    def Identity(cls) -> Any:
        """The rotation by zero."""
        return cls._plain_class()()

    def angle(self) -> Any:
        """The angle [rad]."""
        return self._angle

    def axis(self) -> np.ndarray:
        """The unit vector turned about, shape (3,)."""
        return self._axis.copy()

    def quaternion(self) -> Any:
        """The same rotation as a quaternion."""
        return Quaternion_[self._T]._make(rotations.angle_axis_to_quaternion(self._angle, self._axis.tolist()))

    def rotation(self) -> np.ndarray:
        """The rotation matrix, shape (3, 3)."""
        return rotations.angle_axis_to_matrix(self._T, self._angle, self._axis.tolist()).copy()

    def set_angle(self, angle: Any) -> None:
        """Replace the angle [rad]."""
        self._angle = self._argument("set_angle", scalar(self._T), angle=angle)

    def set_axis(self, axis: Any) -> None:
        """Replace the axis, a unit vector (to 1e-5), shape (3,)."""
        axis = self._argument("set_axis", vector(self._T, 3), axis=axis)
        _check_unit(self._T, axis, "Axis")
        self._axis = axis

    def set_quaternion(self, q: Any) -> None:
        """Replace by the rotation of a quaternion."""
        self._set_quaternion(self._argument("set_quaternion", instance_of(Quaternion_[self._T]), q=q))

    def set_rotation(self, rotation: Any) -> None:
        """Replace by the rotation of a matrix, shape (3, 3)."""
        self._set_rotation(self._argument("set_rotation", matrix(self._T, 3, 3), rotation=rotation))

    def multiply(self, other: Any) -> Any:
        """The product with another rotation, as a quaternion."""
        other = self._argument("multiply", instance_of(self._plain_class()), other=other)
        return self.quaternion().multiply(other.quaternion())

    def __matmul__(self, other: Any) -> Any:
        return self.multiply(other)

    def inverse(self) -> Any:
        """The rotation by the opposite angle."""
        new: Any = object.__new__(self._plain_class())
        new._angle, new._axis = -self._angle, self._axis
        return new

    def __getstate__(self) -> Any:
        return (self._angle, self._axis.copy())

    def __setstate__(self, state: Any) -> None:
        self._angle, self._axis = state[0], as_array(self._T, state[1], (3,))

    def __str__(self) -> str:
        return f"{pretty_class_name(type(self))}(angle={self._angle}, axis={self._axis})"

    __repr__ = __str__


class Isometry3(ScalarBase):
    """A pose: rotation and translation [m]."""

    __slots__ = ("_p", "_rotation")
    _FIELDS = ("_rotation", "_p")

    def __init__(self, *args: Any, **kwargs: Any):
        """
        `Isometry3()`, `Isometry3(matrix)` with shape (4, 4), `Isometry3(rotation, translation)`,
        `Isometry3(quaternion, translation)`, `Isometry3(other)`.

        Raises:
            RuntimeError: the matrix is not a pose (to 1e-5).
        """
        self._choose("init", args, kwargs)

    @staticmethod
    def _ways_init(cls: Any) -> list[Overload]:
        T = cls._T

        def set_parts(self: Any, R: np.ndarray, p: np.ndarray) -> None:
            _check_rotation(T, R)
            self._rotation, self._p = R, p

        def set_turned(self: Any, quaternion: Any, p: np.ndarray) -> None:
            self._rotation, self._p = rotations.unit_quaternion_to_matrix(T, quaternion._wxyz), p

        def copy_of(self: Any, other: Any) -> None:
            self._rotation, self._p = other._rotation, other._p

        return [
            overload(lambda self: set_parts(self, identity(T, 3), zeros(T, 3))),
            overload(cls._set_matrix, matrix=matrix(T, 4, 4)),
            overload(set_parts, rotation=matrix(T, 3, 3), translation=vector(T, 3)),
            overload(set_turned, quaternion=instance_of(Quaternion_[T]), translation=vector(T, 3)),
            overload(copy_of, other=instance_of(cls)),
        ]

    def _set_matrix(self, X: np.ndarray) -> None:
        R = frozen(X[:3, :3].copy())
        _check_rotation(self._T, R)
        if not is_symbolic(self._T):
            row = [float(x if self._T is float else x.value()) for x in X[3].tolist()]
            if max(abs(x - y) for x, y in zip(row, (0.0, 0.0, 0.0, 1.0))) > _TOLERANCE:
                raise RuntimeError(f"Homogeneous matrix is improperly scaled. Its last row is {row}, not [0, 0, 0, 1].")
        self._rotation, self._p = R, frozen(X[:3, 3].copy())

    @classmethod
    def _make(cls, R: np.ndarray, p: np.ndarray) -> Any:
        new: Any = object.__new__(cls._plain_class())
        new._rotation, new._p = frozen(R), frozen(p)
        return new

    @classmethod
    def Identity(cls) -> Any:
        """The pose that changes nothing."""
        return cls._plain_class()()

    def matrix(self) -> np.ndarray:
        """The homogeneous matrix, shape (4, 4)."""
        X = as_array(self._T, np.eye(4), (4, 4)).copy()
        X[:3, :3], X[:3, 3] = self._rotation, self._p
        return X

    def set_matrix(self, matrix: Any, /) -> None:
        """Replace by a homogeneous matrix, shape (4, 4)."""
        self._set_matrix(self._argument("set_matrix", _matrix4(self._T), matrix=matrix))

    def translation(self) -> np.ndarray:
        """The translation [m], shape (3,)."""
        return self._p.copy()

    def set_translation(self, translation: Any, /) -> None:
        """Replace the translation [m], shape (3,)."""
        self._p = self._argument("set_translation", vector(self._T, 3), translation=translation)

    def rotation(self) -> np.ndarray:
        """The rotation matrix, shape (3, 3)."""
        return self._rotation.copy()

    def set_rotation(self, rotation: Any, /) -> None:
        """Replace the rotation matrix, shape (3, 3)."""
        R = self._argument("set_rotation", _matrix3(self._T), rotation=rotation)
        _check_rotation(self._T, R)
        self._rotation = R

    def quaternion(self) -> Any:
        """The rotation as a quaternion."""
        return Quaternion_[self._T]._make(rotations.matrix_to_quaternion(self._rotation))

    def set_quaternion(self, quaternion: Any, /) -> None:
        """Replace the rotation by that of a quaternion."""
        q = self._argument("set_quaternion", instance_of(Quaternion_[self._T]), quaternion=quaternion)
        self._rotation = rotations.unit_quaternion_to_matrix(self._T, q._wxyz)

    def multiply(self, *args: Any, **kwargs: Any) -> Any:
        """The product with another pose, or a position [m] (3,) or several (3, n) moved by this one."""
        value = _only_argument(self, "multiply", ("other", "position"), args, kwargs)
        if isinstance(value, self._plain_class()):
            return self._make(self._rotation.dot(value._rotation), self._rotation.dot(value._p) + self._p)
        R, p = self._rotation, self._p
        return _turn(self, "multiply", "position", value, lambda v: R.dot(np.array(v, dtype=R.dtype)) + p)

    def __matmul__(self, other: Any) -> Any:
        return self.multiply(other)

    def inverse(self) -> Any:
        """The pose that undoes this one."""
        R = self._rotation.T.copy()
        return self._make(R, -R.dot(self._p))

    def __getstate__(self) -> Any:
        return self.matrix()

    def __setstate__(self, state: Any) -> None:
        X = as_array(self._T, state, (4, 4))
        self._rotation, self._p = frozen(X[:3, :3].copy()), frozen(X[:3, 3].copy())

    def __str__(self) -> str:
        return str(self.matrix())


def _matrix3(T: type) -> Any:
    return matrix(T, 3, 3)


def _matrix4(T: type) -> Any:
    return matrix(T, 4, 4)


Quaternion_ = ScalarTemplate("Quaternion_", Quaternion, scope=__name__)
AngleAxis_ = ScalarTemplate("AngleAxis_", AngleAxis, scope=__name__)
Isometry3_ = ScalarTemplate("Isometry3_", Isometry3, scope=__name__, value_type=True)


def __getattr__(name: str) -> Any:
    return _MangledName.module_getattr(module_name=__name__, module_globals=globals(), name=name)
