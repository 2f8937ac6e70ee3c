"""UnitInertia: rotational inertia per unit of mass, of common shapes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sheldrake.common._kinds import instance_of
from sheldrake.common._overloads import Overload, overload
from sheldrake.common._scalar_math import sqrt
from sheldrake.common._scalars import ScalarTemplate, identity, is_symbolic, plain_vector, scalar, vector
from sheldrake.common.quick import Slots, short_way
from sheldrake.math._rotation_matrix import ROTATION
from sheldrake.multibody.math._kernels import spatial
from sheldrake.multibody.math._rotational_inertia import RotationalInertia, RotationalInertia_, point_mass

if TYPE_CHECKING:
    from typing_extensions import Self

    from sheldrake.common._types import Scalar, Scalars
    from sheldrake.math import RotationMatrix

_UNIT_TOLERANCE = 1e-14  # how far from one the length of a direction may be, as in Drake


def number(x: Scalar, T: type) -> float | None:
    """Its value, or None for a symbol."""
    if is_symbolic(T):
        return None
    return x if T is float else x.value()  # type: ignore[union-attr, return-value]


def check_unit_vector(T: type, call: str, unit_vector: np.ndarray) -> None:
    """Raise RuntimeError unless the length of a direction is one to 1e-14."""
    if is_symbolic(T):
        return
    u = [number(x, T) for x in unit_vector.tolist()]
    length = sqrt(float(sum(x * x for x in u)))  # type: ignore[operator, misc]
    if not abs(length - 1.0) <= _UNIT_TOLERANCE:
        raise RuntimeError(
            f"{call}(): The unit_vector argument {u} is not a unit vector: its length is {length!r}, "
            f"{abs(length - 1.0):.3g} from 1, more than {_UNIT_TOLERANCE}."
        )


def plain_direction(unit_vector: object) -> np.ndarray | None:
    """Three plain numbers of length one, read-only; None for all else, of which `check_unit_vector` says why."""
    u = plain_vector(unit_vector)
    if u is None:
        return None
    x, y, z = u.tolist()
    return u if abs(sqrt(x * x + y * y + z * z) - 1.0) <= _UNIT_TOLERANCE else None


class UnitInertia(RotationalInertia):
    """G_BP_E: inertia [m^2] of a body B of unit mass about a point P, expressed in E."""

    __slots__ = ()

    def __init__(self, *args: object, **kwargs: object):
        """
        `UnitInertia(Ixx, Iyy, Izz)`, with `Ixy, Ixz, Iyz` behind, or `UnitInertia(I)` from the inertia of a body of
        mass one; without arguments all NaN.
        """
        self._construct(args, kwargs)

    @staticmethod
    def _ways_init(cls: type[RotationalInertia]) -> list[Overload]:
        T = cls._T

        def from_inertia(self: UnitInertia, inertia: RotationalInertia) -> None:
            self._I = inertia._I

        plain = RotationalInertia._ways_init(cls)[:3]
        return [*plain, overload(from_inertia, I=instance_of(RotationalInertia_[T]))]

    @classmethod
    def _lengths(cls, call: str, **named: Scalar) -> list:
        """Lengths [m], not negative."""
        if all([type(length) is float and length >= 0.0 for length in named.values()]) and cls._T is float:
            return list(named.values())
        values = []
        for name, value in named.items():
            length = cls._argument(call, scalar(cls._T), **{name: value})
            plain = number(length, cls._T)
            if plain is not None and not plain >= 0.0:
                raise RuntimeError(f"UnitInertia.{call}(): {name} is {plain}; it must not be negative.")
            values.append(length)
        return values

    def SetFromRotationalInertia(self, I: RotationalInertia, mass: Scalar) -> Self:
        """Replace by the inertia of a body divided by its mass [kg]; gives this object.

        Raises:
            RuntimeError: the mass is not positive.
        """
        call, T = "SetFromRotationalInertia", self._T
        inertia = self._argument(call, instance_of(RotationalInertia_[T]), I=I)
        mass = self._argument(call, scalar(T), mass=mass)
        plain = number(mass, T)
        if plain is not None and not plain > 0.0:
            raise RuntimeError(f"UnitInertia.{call}(): mass is {plain}; it must be positive.")
        self._set(inertia._I / mass)
        return self

    @classmethod
    def PointMass(cls, p_FQ: Scalars) -> UnitInertia:
        """A particle at `p_FQ` [m], shape (3,), about the origin."""
        return cls._make(point_mass(cls._T, cls._argument("PointMass", vector(cls._T, 3), p_FQ=p_FQ)))

    @classmethod
    def SolidSphere(cls, r: Scalar) -> UnitInertia:
        """A ball of radius `r` [m] about its centre."""
        r = cls._argument("SolidSphere", scalar(cls._T), r=r)
        return cls.TriaxiallySymmetric(0.4 * r * r)

    @classmethod
    def HollowSphere(cls, r: Scalar) -> UnitInertia:
        """A thin spherical shell of radius `r` [m] about its centre."""
        r = cls._argument("HollowSphere", scalar(cls._T), r=r)
        return cls.TriaxiallySymmetric(2.0 / 3.0 * r * r)

    @classmethod
    def SolidEllipsoid(cls, a: Scalar, b: Scalar, c: Scalar) -> UnitInertia:
        """An ellipsoid with half axes `a, b, c` [m] about its centre."""
        a, b, c = cls._lengths("SolidEllipsoid", a=a, b=b, c=c)
        aa, bb, cc = a * a, b * b, c * c
        return cls._plain_class()((bb + cc) / 5.0, (aa + cc) / 5.0, (aa + bb) / 5.0)

    @classmethod
    def SolidBox(cls, Lx: Scalar, Ly: Scalar, Lz: Scalar) -> UnitInertia:
        """A box with edges `Lx, Ly, Lz` [m] about its centre."""
        if cls._T is float and (made := _box(Lx, Ly, Lz)) is not None:
            return made
        x, y, z = cls._lengths("SolidBox", Lx=Lx, Ly=Ly, Lz=Lz)
        xx, yy, zz = x * x, y * y, z * z
        return cls._plain_class()((yy + zz) / 12.0, (xx + zz) / 12.0, (xx + yy) / 12.0)

    @classmethod
    def SolidCube(cls, L: Scalar) -> UnitInertia:
        """A cube with edge `L` [m] about its centre."""
        return cls.SolidBox(L, L, L)

    @classmethod
    def SolidCylinder(cls, radius: Scalar, length: Scalar, unit_vector: Scalars) -> UnitInertia:
        """A cylinder [m] about its centre, its axis along `unit_vector`, shape (3,)."""
        radius, length = cls._lengths("SolidCylinder", radius=radius, length=length)
        along = 0.5 * radius * radius
        across = (3.0 * radius * radius + length * length) / 12.0
        return cls._axial("SolidCylinder", along, across, unit_vector)

    @classmethod
    def SolidCylinderAboutEnd(cls, radius: Scalar, length: Scalar, unit_vector: Scalars) -> UnitInertia:
        """A cylinder [m] about the centre of one end, its axis along `unit_vector`, shape (3,)."""
        radius, length = cls._lengths("SolidCylinderAboutEnd", radius=radius, length=length)
        along = 0.5 * radius * radius
        across = (3.0 * radius * radius + length * length) / 12.0 + length * length / 4.0
        return cls._axial("SolidCylinderAboutEnd", along, across, unit_vector)

    @classmethod
    def SolidCapsule(cls, radius: Scalar, length: Scalar, unit_vector: Scalars) -> UnitInertia:
        """A cylinder of `length` [m] with half balls of `radius` [m] on its ends, about its centre."""
        radius, length = cls._lengths("SolidCapsule", radius=radius, length=length)
        if not is_symbolic(cls._T) and number(radius, cls._T) == 0.0:
            return cls.ThinRod(length, unit_vector)
        # A half ball has its centre of mass 3/8 r from its flat face; parts are weighted by volume over pi r^2.
        rr, ll = radius * radius, length * length
        cylinder, half_ball = length, 2.0 / 3.0 * radius
        whole = cylinder + 2.0 * half_ball
        m_c, m_b = cylinder / whole, half_ball / whole
        along = m_c * 0.5 * rr + 0.8 * m_b * rr
        across = m_c * (ll / 12.0 + rr / 4.0) + m_b * (0.8 * rr + 0.5 * ll + 0.75 * length * radius)
        return cls._axial("SolidCapsule", along, across, unit_vector)

    @classmethod
    def ThinRod(cls, length: Scalar, unit_vector: Scalars) -> UnitInertia:
        """A thin rod of `length` [m] about its centre, along `unit_vector`, shape (3,)."""
        (length,) = cls._lengths("ThinRod", length=length)
        plain = number(length, cls._T)
        if plain is not None and not plain > 0.0:
            raise RuntimeError(f"UnitInertia.ThinRod(): length is {plain}; it must be positive.")
        return cls._axial("ThinRod", 0.0 * length, length * length / 12.0, unit_vector)

    @classmethod
    def AxiallySymmetric(
        cls, moment_parallel: Scalar, moment_perpendicular: Scalar, unit_vector: Scalars
    ) -> UnitInertia:
        """A body of revolution with the given moments [m^2], its axis along `unit_vector`, shape (3,).

        Raises:
            RuntimeError: a moment is negative, `moment_parallel` is more than twice `moment_perpendicular`, or the
                direction is not of length one.
        """
        call = "AxiallySymmetric"
        along, across = cls._lengths(call, moment_parallel=moment_parallel, moment_perpendicular=moment_perpendicular)
        if not is_symbolic(cls._T) and not along <= (2.0 + 1e-14) * across:
            raise RuntimeError(
                f"UnitInertia.{call}(): moment_parallel {number(along, cls._T)} is more than twice "
                f"moment_perpendicular {number(across, cls._T)}; no body has that."
            )
        return cls._axial(call, along, across, unit_vector)

    @classmethod
    def StraightLine(cls, moment_perpendicular: Scalar, unit_vector: Scalars) -> UnitInertia:
        """Mass along a line: `moment_perpendicular` [m^2] across `unit_vector`, nothing along it."""
        (across,) = cls._lengths("StraightLine", moment_perpendicular=moment_perpendicular)
        plain = number(across, cls._T)
        if plain is not None and not plain > 0.0:
            raise RuntimeError(f"UnitInertia.StraightLine(): moment_perpendicular is {plain}; it must be positive.")
        return cls._axial("StraightLine", 0.0 * across, across, unit_vector)

    @classmethod
    def _axial(cls, call: str, along: Scalar, across: Scalar, unit_vector: Scalars) -> UnitInertia:
        T = cls._T
        if T is float and (plain := plain_direction(unit_vector)) is not None:
            (x, y, z), over = plain.tolist(), along - across
            xy, xz, yz = x * y * over, x * z * over, y * z * over
            xx, yy, zz = across + x * x * over, across + y * y * over, across + z * z * over
            return cls._make(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
        u = cls._argument(call, vector(T, 3), unit_vector=unit_vector)
        check_unit_vector(T, call, u)
        return cls._make(identity(T, 3) * across + np.outer(u, u) * (along - across))

    def ReExpress(self, R_AE: RotationMatrix) -> UnitInertia:
        """G_BP_A, expressed in frame A instead of E."""
        if (made := _turn(self, R_AE)) is not None:
            return made
        return self._make(self._turned(self._rotation(R_AE)))

    def ShiftFromCenterOfMass(self, p_BcmQ_E: Scalars) -> UnitInertia:  # type: ignore[override]
        """G_BQ of this G_BBcm; `p_BcmQ_E` [m] is the position of Q from the centre of mass, shape (3,)."""
        p = self._argument("ShiftFromCenterOfMass", vector(self._T, 3), p_BcmQ_E=p_BcmQ_E)
        return self._make(self._I + point_mass(self._T, p))

    def ShiftToCenterOfMass(self, p_QBcm_E: Scalars) -> UnitInertia:  # type: ignore[override]
        """G_BBcm of this G_BQ; `p_QBcm_E` [m] is the position of the centre of mass from Q, shape (3,)."""
        p = self._argument("ShiftToCenterOfMass", vector(self._T, 3), p_QBcm_E=p_QBcm_E)
        return self._make(self._I - point_mass(self._T, p))


UNIT_INERTIA = Slots(UnitInertia, {"_I": (3, 3)})
_turn = short_way(globals(), "_turn", spatial.turn_rotational_inertia, UNIT_INERTIA, ROTATION, gives=UNIT_INERTIA)
_box = short_way(globals(), "_box", spatial.unit_inertia_of_box, float, float, float, gives=UNIT_INERTIA)

UnitInertia_ = ScalarTemplate("UnitInertia_", UnitInertia, scope="sheldrake.multibody.math")
