"""Quaternions under Eigen's names."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any
from typing import overload as typing_overload

import numpy as np

from sheldrake.common import _rotations as rotations
from sheldrake.common._kernels import poses
from sheldrake.common._kinds import instance_of
from sheldrake.common._names import pretty_class_name
from sheldrake.common._overloads import Overload, overload
from sheldrake.common._scalar_math import acos, select, sin
from sheldrake.common._scalars import ScalarBase, ScalarTemplate, as_array, matrix, new_array, scalar, vector
from sheldrake.common._turning import check_unit, only_argument, turn
from sheldrake.common.quick import Slots, short_way

if TYPE_CHECKING:
    from collections.abc import Sequence

    from typing_extensions import Self

    from sheldrake.common._types import Scalar, Scalars


class Quaternion(ScalarBase):
    """A unit quaternion, scalar part first."""

    __slots__ = ("_wxyz",)
    _FIELDS = ("_wxyz",)

    @typing_overload
    def __init__(self) -> None: ...
    @typing_overload
    def __init__(self, wxyz: Scalars) -> None: ...
    @typing_overload
    def __init__(self, w: Scalar, x: Scalar, y: Scalar, z: Scalar) -> None: ...
    @typing_overload
    def __init__(self, *, rotation: Scalars) -> None: ...
    @typing_overload
    def __init__(self, other: Quaternion) -> None: ...
    def __init__(self, *args: Any, **kwargs: Any):
        """
        `Quaternion()`, `Quaternion(wxyz)`, `Quaternion(w, x, y, z)`, `Quaternion(rotation)`, `Quaternion(other)`.

        Raises:
            RuntimeError: its length is not one (to 1e-5).
        """
        if self._T is float and len(args) == 4 and not kwargs and (wxyz := _four(*args)) is not None:
            self._wxyz = wxyz
        elif self._T is float and len(args) == 1 and not kwargs and (wxyz := _short_four(args[0])) is not None:
            self._wxyz = wxyz
        else:
            self._choose("init", args, kwargs)

    @staticmethod
    def _ways_init(cls: type[Quaternion]) -> list[Overload]:
        T = cls._T

        def from_rotation(self: Quaternion, R: np.ndarray) -> None:
            self._set(new_array(T, rotations.matrix_to_quaternion(R)))

        def copy_of(self: Quaternion, other: Quaternion) -> None:
            self._wxyz = other._wxyz

        return [
            overload(lambda self: self._set(as_array(T, [1.0, 0.0, 0.0, 0.0], (4,)))),
            overload(cls._set, wxyz=vector(T, 4)),
            overload(cls._set_four, w=scalar(T), x=scalar(T), y=scalar(T), z=scalar(T)),
            overload(from_rotation, rotation=matrix(T, 3, 3)),
            overload(copy_of, other=instance_of(cls)),
        ]

    def _set(self, wxyz: np.ndarray) -> None:
        check_unit(self._T, wxyz, "Quaternion")
        self._wxyz = wxyz

    def _set_four(self, *wxyz: Scalar) -> None:
        self._set(new_array(self._T, wxyz))

    @classmethod
    def _make(cls, wxyz: Sequence[Scalar] | np.ndarray) -> Self:
        """Unchecked, from four numbers of the right type."""
        new: Any = object.__new__(cls._plain_class())
        new._wxyz = wxyz if isinstance(wxyz, np.ndarray) else new_array(cls._T, wxyz)
        return new

    @classmethod
    def Identity(cls) -> Self:
        """The quaternion that does not turn."""
        return cls._plain_class()()

    def w(self) -> float:
        """The scalar part."""
        return self._wxyz.item(0)

    def x(self) -> float:
        """The first component of the vector part."""
        return self._wxyz.item(1)

    def y(self) -> float:
        """The second component of the vector part."""
        return self._wxyz.item(2)

    def z(self) -> float:
        """The third component of the vector part."""
        return self._wxyz.item(3)

    def wxyz(self) -> np.ndarray:
        """All components, scalar part first, shape (4,)."""
        return self._wxyz.copy()

    def xyz(self) -> np.ndarray:
        """The vector part, shape (3,)."""
        return self._wxyz[1:].copy()

    @typing_overload
    def set_wxyz(self, wxyz: Scalars) -> None: ...
    @typing_overload
    def set_wxyz(self, w: Scalar, x: Scalar, y: Scalar, z: Scalar) -> None: ...
    def set_wxyz(self, *args: Any, **kwargs: Any) -> None:
        """Replace all components: `set_wxyz(wxyz)` or `set_wxyz(w, x, y, z)`.

        Raises:
            RuntimeError: the new length is not one (to 1e-5).
        """
        self._choose("set_wxyz", args, kwargs)

    @staticmethod
    def _ways_set_wxyz(cls: type[Quaternion]) -> list[Overload]:
        T = cls._T
        return [
            overload(cls._set, wxyz=vector(T, 4)),
            overload(cls._set_four, w=scalar(T), x=scalar(T), y=scalar(T), z=scalar(T)),
        ]

    def rotation(self) -> np.ndarray:
        """The rotation matrix, shape (3, 3)."""
        if (R := _rotation(self)) is not None:
            return R
        return rotations.unit_quaternion_to_matrix(self._T, self._wxyz).copy()

    def set_rotation(self, rotation: Scalars, /) -> None:
        """Replace by the quaternion of a rotation matrix, shape (3, 3)."""
        R = self._argument("set_rotation", matrix(self._T, 3, 3), rotation=rotation)
        self._set(new_array(self._T, rotations.matrix_to_quaternion(R)))

    @typing_overload
    def multiply(self, other: Quaternion) -> Quaternion: ...
    @typing_overload
    def multiply(self, vector: Scalars) -> np.ndarray: ...
    def multiply(self, *args: Any, **kwargs: Any) -> Quaternion | np.ndarray:
        """The product with another quaternion, or a vector (3,) or several (3, n) turned by this one."""
        if len(args) == 1 and not kwargs and (made := _short_product(self, args[0])) is not None:
            return made
        value = only_argument(self, "multiply", ("other", "vector"), args, kwargs)
        if isinstance(value, self._plain_class()):
            return self._make(rotations.quaternion_product(self._wxyz.tolist(), value._wxyz.tolist()))
        q = self._wxyz.tolist()
        return turn(self, "multiply", "vector", value, lambda v: rotations.rotate_by_unit_quaternion(q, v))

    @typing_overload
    def __matmul__(self, other: Quaternion) -> Quaternion: ...
    @typing_overload
    def __matmul__(self, other: Scalars) -> np.ndarray: ...
    def __matmul__(self, other: Any) -> Quaternion | np.ndarray:
        if (made := _short_product(self, other)) is not None:
            return made
        return self.multiply(other)

    def inverse(self) -> Self:
        """The quaternion of the opposite rotation."""
        if (made := _inverse(self)) is not None:
            return made
        w, x, y, z = self._wxyz.tolist()
        n = rotations.norm2(x, y, z, w)
        return self._make((w / n, -x / n, -y / n, -z / n))

    def conjugate(self) -> Self:
        """The quaternion with the opposite vector part."""
        w, x, y, z = self._wxyz.tolist()
        return self._make((w, -x, -y, -z))

    def slerp(self, t: Scalar, other: Quaternion) -> Self:
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

    def __getstate__(self) -> np.ndarray:
        return self._wxyz.copy()

    def __setstate__(self, state: np.ndarray) -> None:
        self._wxyz = as_array(self._T, state, (4,))

    def __str__(self) -> str:
        return f"{pretty_class_name(type(self))}(w={self.w()}, x={self.x()}, y={self.y()}, z={self.z()})"

    __repr__ = __str__


QUATERNION = Slots(Quaternion, {"_wxyz": (4,)})
_four = short_way(globals(), "_four", poses.unit_quaternion, float, float, float, float, gives=(4,))
_rotation = short_way(globals(), "_rotation", poses.rotation_of_unit_quaternion, QUATERNION, gives=(3, 3), frozen=False)
_product = short_way(globals(), "_product", poses.multiply_quaternions, QUATERNION, QUATERNION, gives=QUATERNION)
_turn = short_way(globals(), "_turn", poses.turn_by_quaternion, QUATERNION, (3,), gives=(3,), frozen=False)
_inverse = short_way(globals(), "_inverse", poses.invert_quaternion, QUATERNION, gives=QUATERNION)


_unit = short_way(globals(), "_unit", poses.unit_vector, (4,), gives=(4,))


def _short_four(wxyz: Any) -> Any:
    return _four(*wxyz) if type(wxyz) is list and len(wxyz) == 4 else _unit(wxyz)


def _short_product(q: Any, other: Any) -> Any:
    return _turn(q, other) if type(other) is np.ndarray else _product(q, other)


Quaternion_ = ScalarTemplate("Quaternion_", Quaternion, scope="sheldrake.common.eigen_geometry")
