"""Spatial vectors: an angular part on top of a translational part, about a point, expressed in a frame."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from sheldrake.common._kinds import instance_of
from sheldrake.common._names import pretty_class_name
from sheldrake.common._overloads import Mismatch, Overload, incompatible, overload
from sheldrake.common._scalars import ScalarBase, ScalarTemplate, as_array, as_scalar, plain_vector, vector
from sheldrake.common.quick import Slots, short_way
from sheldrake.math import RotationMatrix_
from sheldrake.math._rotation_matrix import ROTATION
from sheldrake.multibody.math._kernels import spatial

if TYPE_CHECKING:
    from types import NotImplementedType

    from typing_extensions import Self

    from sheldrake.common._types import Scalar, Scalars
    from sheldrake.common.kernel import Kernel
    from sheldrake.math import RotationMatrix

_new = object.__new__
_FLOAT64 = np.dtype(np.float64)
_ZERO = np.zeros(6)
_ZERO.setflags(write=False)


def cross(a: Sequence[Scalar] | np.ndarray, b: Sequence[Scalar] | np.ndarray) -> list:
    """Cross product of two vectors of any scalar."""
    ax, ay, az = a
    bx, by, bz = b
    return [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx]


_SHORT: dict[tuple[Any, Any], Any] = {}
"""Short ways of methods by their names, products by the other vector's family, and families of vectors; added below."""


def _never(*args: object) -> None:
    """The short way of other scalars and of users' classes."""


class SpatialVector(ScalarBase):
    """What the four kinds of spatial vectors share. Only vectors of one kind add up."""

    __slots__ = ("_c",)
    _c: np.ndarray
    _FIELDS = ("_c",)  # read-only, may be shared
    _NAMES: ClassVar[tuple[str, str, str]]  # of both parts and of the whole

    def __init__(self, *args: object, **kwargs: object):
        """Both parts, shape (3,) each, or the whole, shape (6,), angular first; without arguments all NaN."""
        if len(args) == 2 and self._T is float and not kwargs and (whole := _join(*args)) is not None:
            self._c = whole
        elif self._T is float and (whole := self._plain(args, kwargs)) is not None:
            self._c = whole
        elif args or kwargs:
            self._choose("init", args, kwargs)
        else:
            self._c = as_array(self._T, [math.nan] * 6, (6,))

    def _plain(self, args: tuple[Any, ...], kwargs: dict[str, Any]) -> np.ndarray | None:
        """The six numbers, of lists and arrays of floats as most calls give them; None: then all ways are tried."""
        if kwargs:
            angular, translational, _ = self._NAMES
            if args or len(kwargs) != 2 or angular not in kwargs or translational not in kwargs:
                return None
            args = kwargs[angular], kwargs[translational]
        if len(args) == 1:
            return plain_vector(args[0], 6)
        if len(args) != 2:
            return None
        top, bottom = args
        if type(top) is list and type(bottom) is list:
            return plain_vector(top + bottom, 6) if len(top) == 3 else None
        top, bottom = plain_vector(top), plain_vector(bottom)
        if top is None or bottom is None:
            return None
        whole = np.concatenate((top, bottom))
        whole.setflags(False)  # type: ignore[call-arg]
        return whole

    @staticmethod
    def _ways_init(cls: type[SpatialVector]) -> list[Overload]:
        T = cls._T
        angular, translational, whole = cls._NAMES

        def from_parts(self: SpatialVector, top: np.ndarray, bottom: np.ndarray) -> None:
            self._c = np.concatenate([top, bottom])
            self._c.setflags(write=False)

        def from_whole(self: SpatialVector, coefficients: np.ndarray) -> None:
            self._c = coefficients

        return [
            overload(from_parts, **{angular: vector(T, 3), translational: vector(T, 3)}),
            overload(from_whole, **{whole: vector(T, 6)}),
        ]

    @classmethod
    def _make(cls, coefficients: Sequence[Scalar] | np.ndarray) -> Self:
        """Unchecked, from six numbers, or an array that nobody else will write."""
        if type(coefficients) is not np.ndarray:
            coefficients = np.array(coefficients, dtype=np.float64 if cls._T is float else object)
        new = _new(cls if "_template" in cls.__dict__ else cls._template[cls._T])
        coefficients.setflags(False)  # type: ignore[call-arg]
        new._c = coefficients
        return new

    @classmethod
    def _make_each(cls, coefficients: np.ndarray) -> list[Self]:
        """`_make` of the rows of an array that nobody else will write, in less time."""
        coefficients.setflags(False)  # type: ignore[call-arg]  # and so are the rows
        kind, vectors = cls if "_template" in cls.__dict__ else cls._template[cls._T], []
        for row in coefficients:
            new = _new(kind)
            new._c = row
            vectors.append(new)
        return vectors

    @classmethod
    def Zero(cls) -> Self:
        """The zero vector."""
        new = _new(cls._plain_class())
        new._c = _ZERO if cls._T is float else as_array(cls._T, np.zeros(6), (6,))
        return new

    def SetZero(self) -> Self:
        """Make this the zero vector; gives this object."""
        self._c = as_array(self._T, np.zeros(6), (6,))
        return self

    def rotational(self) -> np.ndarray:
        """The angular part, shape (3,), read-only."""
        return self._c[:3]

    def translational(self) -> np.ndarray:
        """The translational part, shape (3,), read-only."""
        return self._c[3:]

    def get_coeffs(self) -> np.ndarray:
        """Both parts, angular first, shape (6,)."""
        return self._c.copy()

    def Rotate(self, R_FE: RotationMatrix) -> Self:
        """The same vector expressed in frame F instead of E.

        Args:
            R_FE: RotationMatrix of E in F.
        """
        if (made := _SHORT.get(("Rotate", self._template), _never)(self, R_FE)) is not None:
            return made
        R = self._argument("Rotate", instance_of(RotationMatrix_[self._T]), R_FE=R_FE)
        return self._make(self._c.reshape(2, 3).dot(R._M.T).reshape(6))

    def _kin(self, other: object) -> bool:
        return isinstance(other, self._plain_class())

    def __add__(self, other: Self) -> Self:
        if (made := _SHORT.get(("+", self._template), _never)(self, other)) is not None:
            return made
        return self._make(self._c + other._c) if self._kin(other) else NotImplemented

    def __sub__(self, other: Self) -> Self:
        if (made := _SHORT.get(("-", self._template), _never)(self, other)) is not None:
            return made
        return self._make(self._c - other._c) if self._kin(other) else NotImplemented

    def __iadd__(self, other: Self) -> Self:
        if not self._kin(other):
            return NotImplemented
        self._c = self._c + other._c
        self._c.setflags(write=False)
        return self

    def __isub__(self, other: Self) -> Self:
        if not self._kin(other):
            return NotImplemented
        self._c = self._c - other._c
        self._c.setflags(write=False)
        return self

    def __neg__(self) -> Self:
        return self._make(-self._c)

    def _scaled(self, factor: Scalar) -> np.ndarray | NotImplementedType:
        try:
            return self._c * as_scalar(self._T, factor)
        except Mismatch:
            return NotImplemented

    def __mul__(self, factor: Scalar) -> Self:
        scaled = self._scaled(factor)
        return scaled if scaled is NotImplemented else self._make(scaled)

    __rmul__ = __mul__

    def __imul__(self, factor: Scalar) -> Self:
        scaled = self._scaled(factor)
        if scaled is NotImplemented:
            return scaled
        scaled.setflags(write=False)
        self._c = scaled
        return self

    def _moved(self, call: str, offset: Scalars) -> list:
        return self._argument(call, vector(self._T, 3), offset=offset).tolist()

    def _dot(self, other: SpatialVector, *kinds: ScalarTemplate) -> float:
        if (found := _SHORT.get((getattr(other, "_template", None), self._template), _never)(self, other)) is not None:
            return found
        if not any(isinstance(other, kind[self._T]) for kind in kinds):
            accepted = [f"({pretty_class_name(kind[self._T])})" for kind in kinds]
            raise incompatible(f"{pretty_class_name(self._plain_class())}.dot", accepted, (other,), {})
        product: float = self._c.dot(other._c)
        return float(product) if self._T is float else product

    def __getstate__(self) -> np.ndarray:
        return self._c.copy()

    def __setstate__(self, state: np.ndarray) -> None:
        self._c = as_array(self._T, state, (6,))

    def __repr__(self) -> str:
        top, bottom, _ = self._NAMES
        numbers = self._c.tolist()
        return f"{pretty_class_name(type(self))}(\n  {top}={numbers[:3]},\n  {bottom}={numbers[3:]},\n)"


class SpatialVelocity(SpatialVector):
    """V_MB_E: angular velocity w [rad/s] and velocity v [m/s] of a frame B, measured in M, expressed in E."""

    __slots__ = ()
    _NAMES = ("w", "v", "V")

    def Shift(self, offset: Scalars) -> Self:
        """V_MC of a frame C fixed to B.

        Args:
            offset: p_BoCo_E [m], shape (3,).
        """
        if (made := _SHORT.get(("Shift", self._template), _never)(self, offset)) is not None:
            return made
        p = self._moved("Shift", offset)
        c = self._c.tolist()
        return self._make(c[:3] + [v + x for v, x in zip(c[3:], cross(c[:3], p))])

    def ComposeWithMovingFrameVelocity(
        self, position_of_moving_frame: Scalars, velocity_of_moving_frame: SpatialVelocity
    ) -> Self:
        """V_MC of a frame C that moves on B.

        Args:
            position_of_moving_frame: p_BoCo_E [m], shape (3,).
            velocity_of_moving_frame: V_BC_E.
        """
        compose = _SHORT.get(("ComposeWithMovingFrameVelocity", self._template), _never)
        if (made := compose(self, position_of_moving_frame, velocity_of_moving_frame)) is not None:
            return made
        call = "ComposeWithMovingFrameVelocity"
        p = self._argument(call, vector(self._T, 3), position_of_moving_frame=position_of_moving_frame)
        V = self._argument(call, instance_of(self._plain_class()), velocity_of_moving_frame=velocity_of_moving_frame)
        return self.Shift(p) + V

    def dot(self, *args: SpatialForce | SpatialMomentum, **kwargs: SpatialForce | SpatialMomentum) -> float:
        """Power [W] of a SpatialForce (`force`), or twice the kinetic energy [J] of a SpatialMomentum (`momentum`)."""
        values = [*args, *kwargs.values()]
        if len(values) != 1 or not kwargs.keys() <= {"force", "momentum"}:
            raise incompatible("SpatialVelocity.dot", ["(force)", "(momentum)"], args, kwargs)
        return self._dot(values[0], SpatialForce_, SpatialMomentum_)

    def __matmul__(self, other: SpatialForce | SpatialMomentum) -> float:
        return self.dot(other)


class SpatialAcceleration(SpatialVector):
    """A_MB_E: angular acceleration alpha [rad/s^2] and acceleration a [m/s^2] of a frame B, measured in M."""

    __slots__ = ()
    _NAMES = ("alpha", "a", "A")

    def Shift(self, offset: Scalars, angular_velocity_of_this_frame: Scalars) -> Self:
        """A_MC of a frame C fixed to B.

        Args:
            offset: p_BoCo_E [m], shape (3,).
            angular_velocity_of_this_frame: w_MB_E [rad/s], shape (3,).
        """
        w = self._argument(
            "Shift", vector(self._T, 3), angular_velocity_of_this_frame=angular_velocity_of_this_frame
        ).tolist()
        p = self._moved("Shift", offset)
        c = self._c.tolist()
        turned, centripetal = cross(c[:3], p), cross(w, cross(w, p))
        return self._make(c[:3] + [a + x + y for a, x, y in zip(c[3:], turned, centripetal)])

    def ShiftWithZeroAngularVelocity(self, offset: Scalars) -> Self:
        """A_MC of a frame C fixed to B while B does not turn.

        Args:
            offset: p_BoCo_E [m], shape (3,).
        """
        p = self._moved("ShiftWithZeroAngularVelocity", offset)
        c = self._c.tolist()
        return self._make(c[:3] + [a + x for a, x in zip(c[3:], cross(c[:3], p))])

    def ComposeWithMovingFrameAcceleration(
        self,
        position_of_moving_frame: Scalars,
        angular_velocity_of_this_frame: Scalars,
        velocity_of_moving_frame: SpatialVelocity,
        acceleration_of_moving_frame: SpatialAcceleration,
    ) -> Self:
        """A_MC of a frame C that moves on B.

        Args:
            position_of_moving_frame: p_BoCo_E [m], shape (3,).
            angular_velocity_of_this_frame: w_MB_E [rad/s], shape (3,).
            velocity_of_moving_frame: V_BC_E.
            acceleration_of_moving_frame: A_BC_E.
        """
        call, T = "ComposeWithMovingFrameAcceleration", self._T
        w = self._argument(call, vector(T, 3), angular_velocity_of_this_frame=angular_velocity_of_this_frame)
        V = self._argument(call, instance_of(SpatialVelocity_[T]), velocity_of_moving_frame=velocity_of_moving_frame)
        A = self._argument(
            call, instance_of(self._plain_class()), acceleration_of_moving_frame=acceleration_of_moving_frame
        )
        fixed = self.Shift(position_of_moving_frame, w)._c.tolist()
        v, a, w = V._c.tolist(), A._c.tolist(), w.tolist()
        gyroscopic, coriolis = cross(w, v[:3]), cross(w, v[3:])
        return self._make([x + y + z for x, y, z in zip(fixed, a, gyroscopic + [2.0 * x for x in coriolis])])


class _ForceVector(SpatialVector):
    """What moves to another point as forces do, and has a product with velocities."""

    __slots__ = ()

    def Shift(self, offset: Scalars) -> Self:
        """The same about another point of the body.

        Args:
            offset: p_BpBq_E [m], shape (3,).
        """
        if (made := _SHORT.get(("Shift", self._template), _never)(self, offset)) is not None:
            return made
        p = self._moved("Shift", offset)
        c = self._c.tolist()
        return self._make([t - x for t, x in zip(c[:3], cross(p, c[3:]))] + c[3:])

    def dot(self, velocity: SpatialVelocity) -> float:
        """The product with a SpatialVelocity of the body: a force's power [W], twice a momentum's energy [J]."""
        return self._dot(velocity, SpatialVelocity_)

    def __matmul__(self, other: SpatialVelocity) -> float:
        return self.dot(other)


class SpatialForce(_ForceVector):
    """F_Bp_E: torque tau [N m] about a point Bp and force f [N], expressed in E."""

    __slots__ = ()
    _NAMES = ("tau", "f", "F")


class SpatialMomentum(_ForceVector):
    """L_MBp_E: angular momentum h [N m s] about a point Bp and momentum l [N s], measured in M, expressed in E."""

    __slots__ = ()
    _NAMES = ("h", "l", "L")


_HOME = "sheldrake.multibody.math"
SpatialVelocity_ = ScalarTemplate("SpatialVelocity_", SpatialVelocity, scope=_HOME, value_type=True)
SpatialAcceleration_ = ScalarTemplate("SpatialAcceleration_", SpatialAcceleration, scope=_HOME, value_type=True)
SpatialForce_ = ScalarTemplate("SpatialForce_", SpatialForce, scope=_HOME, value_type=True)
SpatialMomentum_ = ScalarTemplate("SpatialMomentum_", SpatialMomentum, scope=_HOME, value_type=True)


def _add_short_way(name: Any, family: ScalarTemplate, kernel: Kernel, *takes: Any, gives: Any) -> None:
    _SHORT[name, family] = short_way(_SHORT, (name, family), kernel, *takes, gives=gives)


_join = short_way(globals(), "_join", spatial.join_spatial, (3,), (3,), gives=(6,))
VELOCITY, ACCELERATION, FORCE, MOMENTUM = (
    Slots(kind, {"_c": (6,)}) for kind in (SpatialVelocity, SpatialAcceleration, SpatialForce, SpatialMomentum)
)
_FORCES = {SpatialForce_: FORCE, SpatialMomentum_: MOMENTUM}
for _family, _kind in {SpatialVelocity_: VELOCITY, SpatialAcceleration_: ACCELERATION, **_FORCES}.items():
    _add_short_way("+", _family, spatial.add_spatial, _kind, _kind, gives=_kind)
    _add_short_way("-", _family, spatial.subtract_spatial, _kind, _kind, gives=_kind)
    _add_short_way("Rotate", _family, spatial.rotate_spatial, _kind, ROTATION, gives=_kind)
_add_short_way("Shift", SpatialVelocity_, spatial.shift_motion, VELOCITY, (3,), gives=VELOCITY)
_add_short_way(
    "ComposeWithMovingFrameVelocity",
    SpatialVelocity_,
    spatial.compose_velocities,
    VELOCITY,
    (3,),
    VELOCITY,
    gives=VELOCITY,
)
for _family, _kind in _FORCES.items():
    _add_short_way("Shift", _family, spatial.shift_force, _kind, (3,), gives=_kind)
    _add_short_way(SpatialVelocity_, _family, spatial.dot_spatial, _kind, VELOCITY, gives=float)
    _add_short_way(_family, SpatialVelocity_, spatial.dot_spatial, VELOCITY, _kind, gives=float)
