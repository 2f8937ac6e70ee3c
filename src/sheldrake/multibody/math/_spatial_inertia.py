"""SpatialInertia: mass, centre of mass and rotational inertia of a body about a point."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any
from typing import overload as typing_overload

import numpy as np

from sheldrake.common._kinds import instance_of
from sheldrake.common._names import pretty_class_name
from sheldrake.common._overloads import Mismatch, incompatible
from sheldrake.common._scalar_math import all_equal, any_nan, as_condition
from sheldrake.common._scalars import (
    ScalarBase,
    ScalarTemplate,
    as_array,
    as_scalar,
    identity,
    is_symbolic,
    plain_vector,
    scalar,
    vector,
)
from sheldrake.common.quick import Slots, short_way
from sheldrake.math import RigidTransform, RotationMatrix, RotationMatrix_
from sheldrake.math._rotation_matrix import ROTATION
from sheldrake.multibody.math._kernels import spatial
from sheldrake.multibody.math._rotational_inertia import ROTATIONAL_INERTIA, RotationalInertia_, floats, point_mass
from sheldrake.multibody.math._spatial_vectors import (
    SpatialAcceleration_,
    SpatialForce_,
    SpatialMomentum_,
    SpatialVelocity_,
    cross,
)
from sheldrake.multibody.math._unit_inertia import (
    UNIT_INERTIA,
    UnitInertia_,
    check_unit_vector,
    number,
    plain_direction,
)

if TYPE_CHECKING:
    from typing_extensions import Self

    from sheldrake.common._types import Scalar, Scalars
    from sheldrake.multibody.math._rotational_inertia import RotationalInertia
    from sheldrake.multibody.math._spatial_vectors import (
        SpatialAcceleration,
        SpatialForce,
        SpatialMomentum,
        SpatialVelocity,
    )
    from sheldrake.multibody.math._unit_inertia import UnitInertia

_new = object.__new__
_ZEROS, _NANS = ((np.full(3, x), np.full((3, 3), x)) for x in (0.0, math.nan))
"""Centre of mass and unit inertia; arrays in slots are read-only, and may be shared."""
for _array in (*_ZEROS, *_NANS):
    _array.setflags(write=False)


class SpatialInertia(ScalarBase):
    """M_SP_E: mass [kg], position p_PScm_E [m] of the centre of mass, and unit inertia G_SP_E [m^2] of a body S.

    About point P, expressed in frame E.
    """

    __slots__ = ("_G", "_mass", "_p")
    _FIELDS = ("_mass", "_p", "_G")  # arrays are read-only and may be shared

    def __init__(self, mass: Scalar, p_PScm_E: Scalars, G_SP_E: UnitInertia, skip_validity_check: bool = False):
        """
        Args:
            mass: Mass of S [kg].
            p_PScm_E: Position of its centre of mass from P [m], shape (3,).
            G_SP_E: Its unit inertia about P (not about the centre of mass), see `MakeFromCentralInertia`.
            skip_validity_check: Take any numbers.

        Raises:
            RuntimeError: no body can have this inertia.
        """
        T = self._T
        p = plain_vector(p_PScm_E) if type(p_PScm_E) is list else p_PScm_E
        if T is float and (made := _plausible(mass, p, G_SP_E)) is not None:
            self._mass, self._p, self._G = made._mass, made._p, made._G
            return
        try:
            self._mass = as_scalar(T, mass)
            self._p = as_array(T, p_PScm_E, (3,))
            self._G = instance_of(UnitInertia_[T])(G_SP_E).__copy__()
        except Mismatch:
            name = pretty_class_name(self._plain_class())
            accepted = [
                f"(mass: {T.__name__}, p_PScm_E: array of shape (3,), G_SP_E: UnitInertia, skip_validity_check)"
            ]
            raise incompatible(name, accepted, (mass, p_PScm_E, G_SP_E), {}, constructor=True) from None
        if not skip_validity_check and not is_symbolic(T):
            self._check()

    def _check(self) -> None:
        fault = self._fault()
        if fault:
            raise RuntimeError(f"Spatial inertia fails SpatialInertia::IsPhysicallyValid(). {fault}")

    def _fault(self) -> str:
        """Why no body can have this inertia, or an empty string."""
        mass = self._mass
        if self._T is not float:
            mass = float(floats(np.array([mass]), "IsPhysicallyValid()")[0])
        if not (mass >= 0.0 and math.isfinite(mass)):
            return f"mass = {mass} is negative or not finite."
        com = floats(self._p, "IsPhysicallyValid()")
        if not all(map(math.isfinite, com.tolist())):
            return f"Center of mass = {com.tolist()} is not finite."
        central = UnitInertia_[self._T]._make(self._G._I - point_mass(self._T, self._p))
        if central._is_plausible():
            return ""
        about_P = floats(self._G._I, "IsPhysicallyValid()") * mass
        about_com = floats(central._I, "IsPhysicallyValid()") * mass
        fault = (
            f"mass = {mass}, center of mass = {com.tolist()}, inertia about point P = {about_P.tolist()}, "
            f"inertia about center of mass = {about_com.tolist()}"
        )
        if not np.isfinite(about_com).all():
            return f"{fault}: not finite."
        moments = np.linalg.eigvalsh(about_com).tolist()
        return (
            f"{fault}, principal moments of inertia about the center of mass = {moments}: they must not be negative "
            "and no two may sum to less than the third."
        )

    @classmethod
    def _make(cls, mass: Scalar, p: np.ndarray, G: np.ndarray) -> Self:
        """Unchecked, from numbers and arrays that nobody else will write."""
        new = _new(cls._plain_class())
        p.setflags(write=False)
        new._mass, new._p, new._G = mass, p, UnitInertia_[cls._T]._make(G)
        return new

    @classmethod
    def MakeFromCentralInertia(cls, mass: Scalar, p_PScm_E: Scalars, I_SScm_E: RotationalInertia) -> SpatialInertia:
        """From the rotational inertia about the centre of mass.

        Args:
            mass: Mass of S [kg], positive.
            p_PScm_E: Position of its centre of mass from P [m], shape (3,).
            I_SScm_E: Its RotationalInertia about its centre of mass [kg m^2].

        Raises:
            RuntimeError: no body can have this inertia.
        """
        if cls._T is float and (made := _about_centre(mass, p_PScm_E, I_SScm_E)) is not None:
            return made
        call, T = "MakeFromCentralInertia", cls._T
        mass = cls._argument(call, scalar(T), mass=mass)
        p = cls._argument(call, vector(T, 3), p_PScm_E=p_PScm_E)
        inertia = cls._argument(call, instance_of(RotationalInertia_[T]), I_SScm_E=I_SScm_E)
        G = UnitInertia_[T]().SetFromRotationalInertia(inertia, mass)
        return cls._plain_class()(mass, p, G.ShiftFromCenterOfMass(p))

    @classmethod
    def Zero(cls) -> SpatialInertia:
        """No mass at all."""
        T = cls._T
        if T is float:
            made = _nothing()
            return cls._make(0.0, *_ZEROS) if made is None else made
        return cls._make(T(0.0), as_array(T, np.zeros(3), (3,)), as_array(T, np.zeros((3, 3)), (3, 3)))

    @classmethod
    def NaN(cls) -> SpatialInertia:
        """All numbers NaN."""
        T = cls._T
        nan = math.nan
        if T is float:
            return cls._make(nan, *_NANS)
        return cls._make(T(nan), as_array(T, [nan] * 3, (3,)), as_array(T, np.full((3, 3), nan), (3, 3)))

    # --- named shapes ---

    @classmethod
    def _positive(cls, call: str, **named: Scalar) -> list:
        if all([type(value) is float and 0.0 < value < math.inf for value in named.values()]) and cls._T is float:
            return list(named.values())
        values = []
        for name, value in named.items():
            converted = cls._argument(call, scalar(cls._T), **{name: value})
            plain = number(converted, cls._T)
            if plain is not None and not (plain > 0.0 and math.isfinite(plain)):
                what = {"lx": "x-length", "ly": "y-length", "lz": "z-length"}.get(name, name)
                raise RuntimeError(f"{call}(): {what} is not positive and finite: {plain}.")
            values.append(converted)
        return values

    @classmethod
    def _about_center(cls, mass: Scalar, G: UnitInertia) -> Self:
        return cls._make(mass, _ZEROS[0] if cls._T is float else as_array(cls._T, np.zeros(3), (3,)), G._I)

    @classmethod
    def _direction(cls, call: str, unit_vector: Scalars) -> np.ndarray:
        if cls._T is float and (plain := plain_direction(unit_vector)) is not None:
            return plain
        u = cls._argument(call, vector(cls._T, 3), unit_vector=unit_vector)
        check_unit_vector(cls._T, call, u)
        return u

    @classmethod
    def SolidBoxWithDensity(cls, density: Scalar, lx: Scalar, ly: Scalar, lz: Scalar) -> SpatialInertia:
        """A box [kg/m^3, m] about its centre."""
        density, lx, ly, lz = cls._positive("SolidBoxWithDensity", density=density, lx=lx, ly=ly, lz=lz)
        return cls.SolidBoxWithMass(density * (lx * ly * lz), lx, ly, lz)

    @classmethod
    def SolidBoxWithMass(cls, mass: Scalar, lx: Scalar, ly: Scalar, lz: Scalar) -> SpatialInertia:
        """A box [kg, m] about its centre."""
        if cls._T is float and (made := _box(mass, lx, ly, lz)) is not None:
            return made
        mass, lx, ly, lz = cls._positive("SolidBoxWithMass", mass=mass, lx=lx, ly=ly, lz=lz)
        return cls._about_center(mass, UnitInertia_[cls._T].SolidBox(lx, ly, lz))

    @classmethod
    def SolidCubeWithDensity(cls, density: Scalar, length: Scalar) -> SpatialInertia:
        """A cube [kg/m^3, m] about its centre."""
        density, length = cls._positive("SolidCubeWithDensity", density=density, length=length)
        return cls.SolidBoxWithMass(density * (length * length * length), length, length, length)

    @classmethod
    def SolidCapsuleWithDensity(
        cls, density: Scalar, radius: Scalar, length: Scalar, unit_vector: Scalars
    ) -> SpatialInertia:
        """A capsule [kg/m^3, m] about its centre, its axis along `unit_vector`."""
        call = "SolidCapsuleWithDensity"
        density, radius, length = cls._positive(call, density=density, radius=radius, length=length)
        cls._direction(call, unit_vector)
        volume = math.pi * radius * radius * length + 4.0 / 3.0 * math.pi * radius * radius * radius
        return cls.SolidCapsuleWithMass(density * volume, radius, length, unit_vector)

    @classmethod
    def SolidCapsuleWithMass(cls, mass: Scalar, radius: Scalar, length: Scalar, unit_vector: Scalars) -> SpatialInertia:
        """A capsule [kg, m] about its centre, its axis along `unit_vector`; `length` without the half balls."""
        call = "SolidCapsuleWithMass"
        mass, radius, length = cls._positive(call, mass=mass, radius=radius, length=length)
        u = cls._direction(call, unit_vector)
        return cls._about_center(mass, UnitInertia_[cls._T].SolidCapsule(radius, length, u))

    @classmethod
    def SolidCylinderWithDensity(
        cls, density: Scalar, radius: Scalar, length: Scalar, unit_vector: Scalars
    ) -> SpatialInertia:
        """A cylinder [kg/m^3, m] about its centre, its axis along `unit_vector`."""
        mass = cls._cylinder_mass("SolidCylinderWithDensity", density, radius, length, unit_vector)
        return cls.SolidCylinderWithMass(mass, radius, length, unit_vector)

    @classmethod
    def SolidCylinderWithDensityAboutEnd(
        cls, density: Scalar, radius: Scalar, length: Scalar, unit_vector: Scalars
    ) -> SpatialInertia:
        """A cylinder [kg/m^3, m] about the centre of one end, from there along `unit_vector`."""
        mass = cls._cylinder_mass("SolidCylinderWithDensityAboutEnd", density, radius, length, unit_vector)
        return cls.SolidCylinderWithMassAboutEnd(mass, radius, length, unit_vector)

    @classmethod
    def _cylinder_mass(cls, call: str, density: Scalar, radius: Scalar, length: Scalar, unit_vector: Scalars) -> Scalar:
        density, radius, length = cls._positive(call, density=density, radius=radius, length=length)
        cls._direction(call, unit_vector)
        return density * (math.pi * radius * radius * length)

    @classmethod
    def SolidCylinderWithMass(
        cls, mass: Scalar, radius: Scalar, length: Scalar, unit_vector: Scalars
    ) -> SpatialInertia:
        """A cylinder [kg, m] about its centre, its axis along `unit_vector`."""
        call = "SolidCylinderWithMass"
        mass, radius, length = cls._positive(call, mass=mass, radius=radius, length=length)
        u = cls._direction(call, unit_vector)
        return cls._about_center(mass, UnitInertia_[cls._T].SolidCylinder(radius, length, u))

    @classmethod
    def SolidCylinderWithMassAboutEnd(
        cls, mass: Scalar, radius: Scalar, length: Scalar, unit_vector: Scalars
    ) -> SpatialInertia:
        """A cylinder [kg, m] about the centre of one end, from there along `unit_vector`."""
        call = "SolidCylinderWithMassAboutEnd"
        mass, radius, length = cls._positive(call, mass=mass, radius=radius, length=length)
        u = cls._direction(call, unit_vector)
        centered = cls._about_center(mass, UnitInertia_[cls._T].SolidCylinder(radius, length, u))
        return centered.Shift(u * (-0.5 * length))

    @classmethod
    def ThinRodWithMass(cls, mass: Scalar, length: Scalar, unit_vector: Scalars) -> SpatialInertia:
        """A thin rod [kg, m] about its centre, along `unit_vector`."""
        mass, length = cls._positive("ThinRodWithMass", mass=mass, length=length)
        u = cls._direction("ThinRodWithMass", unit_vector)
        return cls._about_center(mass, UnitInertia_[cls._T].ThinRod(length, u))

    @classmethod
    def ThinRodWithMassAboutEnd(cls, mass: Scalar, length: Scalar, unit_vector: Scalars) -> SpatialInertia:
        """A thin rod [kg, m] about one end, from there along `unit_vector`."""
        mass, length = cls._positive("ThinRodWithMassAboutEnd", mass=mass, length=length)
        u = cls._direction("ThinRodWithMassAboutEnd", unit_vector)
        return cls._about_center(mass, UnitInertia_[cls._T].ThinRod(length, u)).Shift(u * (-0.5 * length))

    @classmethod
    def SolidEllipsoidWithDensity(cls, density: Scalar, a: Scalar, b: Scalar, c: Scalar) -> SpatialInertia:
        """An ellipsoid with half axes `a, b, c` [kg/m^3, m] about its centre."""
        density, a, b, c = cls._positive("SolidEllipsoidWithDensity", density=density, a=a, b=b, c=c)
        return cls.SolidEllipsoidWithMass(density * (4.0 / 3.0 * math.pi * a * b * c), a, b, c)

    @classmethod
    def SolidEllipsoidWithMass(cls, mass: Scalar, a: Scalar, b: Scalar, c: Scalar) -> SpatialInertia:
        """An ellipsoid with half axes `a, b, c` [kg, m] about its centre."""
        mass, a, b, c = cls._positive("SolidEllipsoidWithMass", mass=mass, a=a, b=b, c=c)
        return cls._about_center(mass, UnitInertia_[cls._T].SolidEllipsoid(a, b, c))

    @classmethod
    def SolidSphereWithDensity(cls, density: Scalar, radius: Scalar) -> SpatialInertia:
        """A ball [kg/m^3, m] about its centre."""
        density, radius = cls._positive("SolidSphereWithDensity", density=density, radius=radius)
        return cls.SolidSphereWithMass(density * (4.0 / 3.0 * math.pi * radius * radius * radius), radius)

    @classmethod
    def SolidSphereWithMass(cls, mass: Scalar, radius: Scalar) -> SpatialInertia:
        """A ball [kg, m] about its centre."""
        if cls._T is float and (made := _sphere(mass, radius)) is not None:
            return made
        mass, radius = cls._positive("SolidSphereWithMass", mass=mass, radius=radius)
        return cls._about_center(mass, UnitInertia_[cls._T].SolidSphere(radius))

    @classmethod
    def HollowSphereWithDensity(cls, area_density: Scalar, radius: Scalar) -> SpatialInertia:
        """A thin spherical shell [kg/m^2, m] about its centre."""
        area_density, radius = cls._positive("HollowSphereWithDensity", area_density=area_density, radius=radius)
        return cls.HollowSphereWithMass(area_density * (4.0 * math.pi * radius * radius), radius)

    @classmethod
    def HollowSphereWithMass(cls, mass: Scalar, radius: Scalar) -> SpatialInertia:
        """A thin spherical shell [kg, m] about its centre."""
        mass, radius = cls._positive("HollowSphereWithMass", mass=mass, radius=radius)
        return cls._about_center(mass, UnitInertia_[cls._T].HollowSphere(radius))

    # --- queries ---

    def get_mass(self) -> float:
        """Mass [kg]."""
        return self._mass

    def get_com(self) -> np.ndarray:
        """p_PScm_E [m], shape (3,)."""
        return self._p.copy()

    def get_unit_inertia(self) -> UnitInertia:
        """G_SP_E, about P."""
        return self._G.__copy__()

    def CalcComMoment(self) -> np.ndarray:
        """Mass times p_PScm_E [kg m], shape (3,)."""
        return self._p * self._mass

    def CalcRotationalInertia(self) -> RotationalInertia:
        """I_SP_E, about P."""
        return RotationalInertia_[self._T]._make(self._G._I * self._mass)

    def CopyToFullMatrix6(self) -> np.ndarray:
        """The matrix that maps a spatial acceleration to a spatial force, angular part first, shape (6, 6)."""
        if (made := _matrix(self)) is not None:
            return made
        T, mass = self._T, self._mass
        x, y, z = (self._p * mass).tolist()
        zero = T(0.0) * mass
        C = np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]], dtype=self._p.dtype)
        return np.block([[self._G._I * mass, C], [-C, identity(T, 3) * mass]])

    def IsPhysicallyValid(self) -> bool:
        """Whether a body can have this inertia."""
        if self._T is float and _plausible(self._mass, self._p, self._G) is not None:
            return True
        return as_condition(not self._fault(), self._T)

    def IsNaN(self) -> bool:
        """Whether any number is NaN."""
        if (none := _is_none(self)) is not None:
            return none
        return any_nan(np.array([self._mass, *self._p, *self._G._I.flat]), self._T)

    def IsZero(self) -> bool:
        """Whether there is no mass and no inertia."""
        if (zero := _is_zero(self)) is not None:
            return zero
        return all_equal(np.array([self._mass, *self._G._I.flat]), np.zeros(10), self._T)

    def SetNaN(self) -> None:
        """Make all numbers NaN."""
        self._assign_from(self.NaN())

    def CalcPrincipalSemiDiametersAndPoseForSolidEllipsoid(self) -> tuple[np.ndarray, RigidTransform]:
        """Half axes [m], descending, and pose in E (from P) of the solid ellipsoid with this inertia."""
        p = floats(self._p, "CalcPrincipalSemiDiametersAndPoseForSolidEllipsoid()")
        if number(self._mass, self._T) == 0.0:
            return np.zeros(3), RigidTransform(RotationMatrix(), p)
        moments, axes = self._G.ShiftToCenterOfMass(self._p).CalcPrincipalMomentsAndAxesOfInertia()
        half_axes = np.sqrt(np.maximum(2.5 * (moments.sum() - 2.0 * moments), 0.0))
        return half_axes, RigidTransform(axes, p)

    # --- changes ---

    def ReExpress(self, R_AE: RotationMatrix) -> SpatialInertia:
        """M_SP_A, expressed in frame A instead of E."""
        if (made := _turn(self, R_AE)) is not None:
            return made
        R = self._argument("ReExpress", instance_of(RotationMatrix_[self._T]), R_AE=R_AE)
        return self._make(self._mass, R._M.dot(self._p), self._G._turned(R))

    def Shift(self, p_PQ_E: Scalars) -> SpatialInertia:
        """M_SQ_E, about a point Q instead of P; `p_PQ_E` [m], shape (3,)."""
        if (made := _shift(self, p_PQ_E)) is not None:
            return made
        p_PQ = self._argument("Shift", vector(self._T, 3), p_PQ_E=p_PQ_E)
        T, p_QScm = self._T, self._p - p_PQ
        G = self._G._I + (point_mass(T, p_QScm) - point_mass(T, self._p))
        return self._make(self._mass, p_QScm, G)

    def __iadd__(self, other: Self) -> Self:
        """Join another body to this one, its inertia about the same point and in the same frame."""
        if not isinstance(other, self._plain_class()):
            return NotImplemented
        total = self._mass + other._mass
        if not is_symbolic(self._T) and number(total, self._T) == 0.0:
            p, G = (self._p + other._p) * 0.5, (self._G._I + other._G._I) * 0.5
        else:
            p = (self._p * self._mass + other._p * other._mass) / total
            G = (self._G._I * self._mass + other._G._I * other._mass) / total
        self._assign_from(self._make(total, p, G))
        return self

    @typing_overload
    def __mul__(self, other: SpatialVelocity) -> SpatialMomentum: ...
    @typing_overload
    def __mul__(self, other: SpatialAcceleration) -> SpatialForce: ...
    def __mul__(self, other: SpatialVelocity | SpatialAcceleration) -> SpatialMomentum | SpatialForce:
        """Momentum of S with a SpatialVelocity, or force for a SpatialAcceleration (of P, a point of S), about P."""
        T = self._T
        if isinstance(other, SpatialVelocity_[T]):
            result = SpatialMomentum_[T]
        elif isinstance(other, SpatialAcceleration_[T]):
            result = SpatialForce_[T]
        else:
            return NotImplemented
        top, bottom = other._c[:3], other._c[3:]
        mc = (self._p * self._mass).tolist()
        angular = (self._G._I.dot(top) * self._mass).tolist()
        h = [a + b for a, b in zip(angular, cross(mc, bottom.tolist()))]
        l = [a - b for a, b in zip((bottom * self._mass).tolist(), cross(mc, top.tolist()))]
        return result._make(h + l)

    def __getstate__(self) -> tuple[Scalar, np.ndarray, UnitInertia]:
        return (self._mass, self._p.copy(), self._G)

    def __setstate__(self, state: dict[str, Any]) -> None:
        mass, p, G = state
        self._mass, self._p, self._G = mass, as_array(self._T, p, (3,)), G

    def __repr__(self) -> str:
        if self._T is float and self.IsZero():
            return "SpatialInertia.Zero()"
        p = self._p.tolist()
        return f"{pretty_class_name(type(self))}(mass={self._mass!r}, p_PScm_E={p}, G_SP_E={self._G!r})"


SPATIAL_INERTIA = Slots(SpatialInertia, {"_mass": float, "_p": (3,), "_G": UNIT_INERTIA})
_plausible = short_way(
    globals(), "_plausible", spatial.plausible_inertia, float, (3,), UNIT_INERTIA, gives=SPATIAL_INERTIA
)
_about_centre = short_way(
    globals(), "_about_centre", spatial.inertia_of_central, float, (3,), ROTATIONAL_INERTIA, gives=SPATIAL_INERTIA
)
_box = short_way(globals(), "_box", spatial.inertia_of_box, float, float, float, float, gives=SPATIAL_INERTIA)
_sphere = short_way(globals(), "_sphere", spatial.inertia_of_sphere, float, float, gives=SPATIAL_INERTIA)
_turn = short_way(globals(), "_turn", spatial.turn_inertia, SPATIAL_INERTIA, ROTATION, gives=SPATIAL_INERTIA)
_nothing = short_way(globals(), "_nothing", spatial.no_inertia, gives=SPATIAL_INERTIA)
_matrix = short_way(globals(), "_matrix", spatial.matrix_of_inertia, SPATIAL_INERTIA, gives=(6, 6), frozen=False)
_is_none = short_way(globals(), "_is_none", spatial.is_inertia_none, SPATIAL_INERTIA, gives=bool)
_is_zero = short_way(globals(), "_is_zero", spatial.is_inertia_zero, SPATIAL_INERTIA, gives=bool)
_shift = short_way(globals(), "_shift", spatial.shift_inertia, SPATIAL_INERTIA, (3,), gives=SPATIAL_INERTIA)

SpatialInertia_ = ScalarTemplate("SpatialInertia_", SpatialInertia, scope="sheldrake.multibody.math", value_type=True)
