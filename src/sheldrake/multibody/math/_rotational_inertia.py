"""RotationalInertia: second moments of a body's mass about a point."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING
from typing import overload as typing_overload

import numpy as np

from sheldrake.common._kinds import instance_of
from sheldrake.common._names import pretty_class_name
from sheldrake.common._overloads import Mismatch, Overload, overload
from sheldrake.common._scalar_math import all_equal, any_nan, as_condition, at_most, largest_magnitude, smaller
from sheldrake.common._scalars import (
    ScalarBase,
    ScalarTemplate,
    any_array,
    as_array,
    as_scalar,
    new_array,
    scalar,
    vector,
)
from sheldrake.common.quick import Slots, short_way
from sheldrake.math import RotationMatrix, RotationMatrix_
from sheldrake.math._rotation_matrix import ROTATION
from sheldrake.multibody.math._kernels import spatial
from sheldrake.multibody.math._spatial_vectors import cross

if TYPE_CHECKING:
    from typing_extensions import Self

    from sheldrake.common._types import Scalar, Scalars

_new = object.__new__
# Slack of the validity test, times the largest moment [kg m^2] a body of this trace can have, but at least times one:
# measured on Drake, which lets the rounding of a unit-sized inertia pass.
_TOLERANCE = 16 * np.finfo(float).eps


def floats(array: np.ndarray, call: str) -> np.ndarray:
    """The values of an array of float or AutoDiffXd numbers.

    Raises:
        RuntimeError: the numbers are symbolic.
    """
    if array.dtype == np.float64:
        return array
    try:
        return np.array([float(x.value() if hasattr(x, "value") else x.Evaluate()) for x in array.ravel()]).reshape(
            array.shape
        )
    except RuntimeError as error:
        raise RuntimeError(f"{call}: the numbers of a symbolic inertia are not known: {error}") from None


def point_mass(T: type, p: np.ndarray) -> np.ndarray:
    """Inertia of a unit mass at `p` [m] about the origin [m^2], shape (3, 3)."""
    x, y, z = p.tolist()
    xx, yy, zz, xy, xz, yz = x * x, y * y, z * z, -x * y, -x * z, -y * z
    return new_array(T, [[yy + zz, xy, xz], [xy, xx + zz, yz], [xz, yz, xx + yy]])


class RotationalInertia(ScalarBase):
    """I_BP_E: inertia [kg m^2] of a body B about a point P, expressed in E."""

    __slots__ = ("_I",)
    _FIELDS = ("_I",)  # symmetric, read-only, may be shared

    def __init__(self, *args: object, **kwargs: object):
        """
        `RotationalInertia(Ixx, Iyy, Izz)`, with `Ixy, Ixz, Iyz` behind, or `RotationalInertia(mass, p_PQ_E)` of a
        particle at Q; without arguments all NaN.
        """
        self._construct(args, kwargs)

    def _construct(self, args: tuple, kwargs: dict) -> None:
        numbers = None if kwargs or self._T is not float else _diagonal(*args) if len(args) == 3 else _full(*args)
        if numbers is not None:
            self._I = numbers
        else:
            self._choose("init", args, kwargs)

    @staticmethod
    def _ways_init(cls: type[RotationalInertia]) -> list[Overload]:
        T = cls._T
        moments = {"Ixx": scalar(T), "Iyy": scalar(T), "Izz": scalar(T)}
        products = {"Ixy": scalar(T), "Ixz": scalar(T), "Iyz": scalar(T)}

        def from_particle(self: RotationalInertia, mass: Scalar, p: np.ndarray) -> None:
            self._set(point_mass(T, p) * mass)

        return [
            overload(cls.SetToNaN),
            overload(cls._set_numbers, **moments),
            overload(cls._set_numbers, **moments, **products),
            overload(from_particle, mass=scalar(T), p_PQ_E=vector(T, 3)),
        ]

    def _set_numbers(
        self, xx: Scalar, yy: Scalar, zz: Scalar, xy: Scalar = 0.0, xz: Scalar = 0.0, yz: Scalar = 0.0
    ) -> None:
        self._I = as_array(self._T, [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], (3, 3))

    def _set(self, numbers: np.ndarray) -> None:
        numbers.setflags(write=False)
        self._I = numbers

    @classmethod
    def _make(cls, numbers: np.ndarray) -> Self:
        """Unchecked, from a symmetric array that nobody else will write."""
        new = _new(cls._plain_class())
        new._set(numbers)
        return new

    @classmethod
    def TriaxiallySymmetric(cls, I_triaxial: Scalar) -> Self:
        """Three equal moments and no products [kg m^2]."""
        moment = cls._argument("TriaxiallySymmetric", scalar(cls._T), I_triaxial=I_triaxial)
        return cls._plain_class()(moment, moment, moment)

    def rows(self) -> int:
        """Three."""
        return 3

    def cols(self) -> int:
        """Three."""
        return 3

    def get_moments(self) -> np.ndarray:
        """[Ixx, Iyy, Izz] [kg m^2], shape (3,)."""
        return self._I.diagonal().copy()

    def get_products(self) -> np.ndarray:
        """[Ixy, Ixz, Iyz] [kg m^2], shape (3,)."""
        return self._I[[0, 0, 1], [1, 2, 2]]

    def CopyToFullMatrix3(self) -> np.ndarray:
        """All numbers [kg m^2], shape (3, 3)."""
        return self._I.copy()

    def __getitem__(self, index: tuple[int, int]) -> float:
        if not isinstance(index, tuple):
            raise Mismatch(f"{type(self).__name__}[i, j]: incompatible function arguments: needs two indices")
        i, j = index
        if i not in (0, 1, 2) or j not in (0, 1, 2):
            raise IndexError(f"{pretty_class_name(type(self))}[{i}, {j}]: indices run from 0 to 2")
        return self._I.item(i, j)

    def Trace(self) -> float:
        """Ixx + Iyy + Izz [kg m^2], the same in every frame."""
        xx, yy, zz = self._I.diagonal().tolist()
        return xx + yy + zz

    def CalcMaximumPossibleMomentOfInertia(self) -> float:
        """Half the trace [kg m^2]: no axis through P can have more."""
        return 0.5 * self.Trace()

    def CalcPrincipalMomentsOfInertia(self) -> np.ndarray:
        """The principal moments [kg m^2], ascending, shape (3,)."""
        return self._principal("CalcPrincipalMomentsOfInertia")[0]

    def CalcPrincipalMomentsAndAxesOfInertia(self) -> tuple[np.ndarray, RotationMatrix]:
        """The principal moments [kg m^2], ascending, and the rotation matrix whose columns are their axes in E.

        The direction of an axis is arbitrary, the frame is right-handed.
        """
        moments, axes = self._principal("CalcPrincipalMomentsAndAxesOfInertia")
        x, y = axes[:, 0], axes[:, 1]
        return moments, RotationMatrix._make(np.column_stack([x, y, cross(x.tolist(), y.tolist())]))

    def _principal(self, call: str) -> tuple[np.ndarray, np.ndarray]:
        call = f"{pretty_class_name(type(self))}.{call}()"
        numbers = floats(self._I, call)
        if not np.isfinite(numbers).all():
            raise RuntimeError(f"{call}: the inertia {numbers.tolist()} is not finite.")
        diagonal = numbers.diagonal()
        if np.abs(numbers - np.diag(diagonal)).max() <= np.finfo(float).eps * abs(diagonal.sum()) / 2:
            order = np.argsort(diagonal, kind="stable")
            return diagonal[order], np.eye(3)[:, order]
        return np.linalg.eigh(numbers)

    def CouldBePhysicallyValid(self) -> bool:
        """Whether the moments are no NaN, not negative, and no two sum to less than the third.

        For a body's inertia about its centre of mass this is sufficient, about other points only necessary.

        Raises:
            RuntimeError: it depends on the value of a variable.
        """
        return as_condition(self._is_plausible(), self._T)

    def _is_plausible(self) -> bool:
        numbers = floats(self._I, "CouldBePhysicallyValid()")
        (xx, xy, xz), (_, yy, yz), (_, _, zz) = numbers.tolist()
        trace, products = xx + yy + zz, abs(xy) + abs(xz) + abs(yz)
        if not math.isfinite(trace + products):
            return False
        slack = _TOLERANCE * max(1.0, abs(trace) / 2)

        def plausible(moments: list[float], spare: float = 0.0) -> bool:
            a, b, c = sorted(moments)
            return a + slack >= spare and a + b + slack >= c + 3.0 * spare

        moments = [xx, yy, zz]
        if plausible(moments, products):
            return True  # principal moments are no further from these than the products' sum (Weyl 1912)
        return plausible(moments) and plausible(np.linalg.eigvalsh(numbers).tolist())

    def IsNearlyEqualTo(self, other: RotationalInertia, precision: float) -> bool:
        """Whether all numbers agree to `precision` times the larger of both largest possible moments."""
        other = self._argument("IsNearlyEqualTo", instance_of(RotationalInertia_[self._T]), other=other)
        scale = smaller(self.CalcMaximumPossibleMomentOfInertia(), other.CalcMaximumPossibleMomentOfInertia(), self._T)
        return at_most(largest_magnitude(self._I - other._I, self._T), precision * scale, self._T)

    def IsNaN(self) -> bool:
        """Whether any number is NaN."""
        return any_nan(self._I, self._T)

    def IsZero(self) -> bool:
        """Whether all numbers are zero."""
        return all_equal(self._I, np.zeros((3, 3)), self._T)

    def SetToNaN(self) -> None:
        """Make all numbers NaN."""
        self._I = as_array(self._T, np.full((3, 3), math.nan), (3, 3))

    def SetZero(self) -> None:
        """Make all numbers zero."""
        self._I = as_array(self._T, np.zeros((3, 3)), (3, 3))

    def ReExpress(self, R_AE: RotationMatrix) -> RotationalInertia:
        """I_BP_A, expressed in frame A instead of E.

        Args:
            R_AE: RotationMatrix of E in A.
        """
        if (made := _turn(self, R_AE)) is not None:
            return made
        return self._make(self._turned(self._rotation(R_AE)))

    def _rotation(self, R_AE: RotationMatrix) -> RotationMatrix:
        return self._argument("ReExpress", instance_of(RotationMatrix_[self._T]), R_AE=R_AE)

    def _turned(self, R_AE: RotationMatrix) -> np.ndarray:
        R = R_AE._M
        turned = R.dot(self._I).dot(R.T)
        for i, j in ((0, 1), (0, 2), (1, 2)):
            turned[i, j] = turned[j, i]  # one rounding of each product, so that the result is exactly symmetric
        return turned

    def _steiner(self, call: str, mass: Scalar, **offset: Scalars) -> np.ndarray:
        mass = self._argument(call, scalar(self._T), mass=mass)
        return point_mass(self._T, self._argument(call, vector(self._T, 3), **offset)) * mass

    def ShiftFromCenterOfMass(self, mass: Scalar, p_BcmQ_E: Scalars) -> RotationalInertia:
        """I_BQ of this I_BBcm.

        Args:
            mass: Mass of B [kg].
            p_BcmQ_E: Position of Q from B's centre of mass [m], shape (3,).
        """
        return self._make(self._I + self._steiner("ShiftFromCenterOfMass", mass, p_BcmQ_E=p_BcmQ_E))

    def ShiftToCenterOfMass(self, mass: Scalar, p_QBcm_E: Scalars) -> RotationalInertia:
        """I_BBcm of this I_BQ.

        Args:
            mass: Mass of B [kg].
            p_QBcm_E: Position of B's centre of mass from Q [m], shape (3,).
        """
        return self._make(self._I - self._steiner("ShiftToCenterOfMass", mass, p_QBcm_E=p_QBcm_E))

    def ShiftToThenAwayFromCenterOfMass(self, mass: Scalar, p_PBcm_E: Scalars, p_QBcm_E: Scalars) -> RotationalInertia:
        """I_BQ of this I_BP.

        Args:
            mass: Mass of B [kg].
            p_PBcm_E: Position of B's centre of mass from P [m], shape (3,).
            p_QBcm_E: Position of B's centre of mass from Q [m], shape (3,).
        """
        call = "ShiftToThenAwayFromCenterOfMass"
        towards, away = self._steiner(call, mass, p_PBcm_E=p_PBcm_E), self._steiner(call, mass, p_QBcm_E=p_QBcm_E)
        return RotationalInertia_[self._T]._make(self._I + (away - towards))

    def _other(self, other: object) -> np.ndarray | None:
        return other._I if isinstance(other, RotationalInertia_[self._T]) else None

    def __add__(self, other: RotationalInertia) -> RotationalInertia:
        numbers = self._other(other)
        return NotImplemented if numbers is None else RotationalInertia_[self._T]._make(self._I + numbers)

    def __sub__(self, other: RotationalInertia) -> RotationalInertia:
        numbers = self._other(other)
        return NotImplemented if numbers is None else RotationalInertia_[self._T]._make(self._I - numbers)

    def __iadd__(self, other: RotationalInertia) -> Self:
        numbers = self._other(other)
        if numbers is None:
            return NotImplemented
        self._set(self._I + numbers)
        return self

    def __isub__(self, other: RotationalInertia) -> Self:
        numbers = self._other(other)
        if numbers is None:
            return NotImplemented
        self._set(self._I - numbers)
        return self

    def _factor(self, value: object) -> Scalar | None:
        try:
            return as_scalar(self._T, value)
        except Mismatch:
            return None

    @typing_overload
    def __mul__(self, other: Scalar) -> RotationalInertia: ...
    @typing_overload
    def __mul__(self, other: np.ndarray) -> np.ndarray: ...
    def __mul__(self, other: object) -> RotationalInertia | np.ndarray:
        """Scaled by a number, or applied to a vector w_E: I w, shape (3,)."""
        factor = self._factor(other)
        if factor is not None:
            return RotationalInertia_[self._T]._make(self._I * factor)
        try:
            w = any_array(self._T, other)
        except Mismatch:
            return NotImplemented
        return self._I.dot(w.reshape(3)) if w.shape in ((3,), (3, 1)) else NotImplemented

    def __rmul__(self, other: Scalar) -> RotationalInertia:
        factor = self._factor(other)
        return NotImplemented if factor is None else RotationalInertia_[self._T]._make(self._I * factor)

    def __imul__(self, other: Scalar) -> Self:  # type: ignore[misc]  # a vector cannot take its place
        factor = self._factor(other)
        if factor is None:
            return NotImplemented
        self._set(self._I * factor)
        return self

    def _divided(self, other: object) -> np.ndarray | None:
        factor = self._factor(other)
        if factor is None:
            return None
        with np.errstate(divide="ignore", invalid="ignore"):
            return self._I / factor

    def __truediv__(self, other: Scalar) -> RotationalInertia:
        numbers = self._divided(other)
        return NotImplemented if numbers is None else RotationalInertia_[self._T]._make(numbers)

    def __itruediv__(self, other: Scalar) -> Self:
        numbers = self._divided(other)
        if numbers is None:
            return NotImplemented
        self._set(numbers)
        return self

    def __getstate__(self) -> np.ndarray:
        return self._I.copy()

    def __setstate__(self, state: np.ndarray) -> None:
        self._I = as_array(self._T, state, (3, 3))

    def __repr__(self) -> str:
        numbers = [*self.get_moments().tolist(), *self.get_products().tolist()]
        names = ("Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")
        text = ", ".join(f"{name}={number!r}" for name, number in zip(names, numbers))
        return f"{pretty_class_name(type(self))}({text})"


_diagonal = short_way(globals(), "_diagonal", spatial.inertia_of_moments, *[float] * 3, gives=(3, 3))
_full = short_way(globals(), "_full", spatial.inertia_of_numbers, *[float] * 6, gives=(3, 3))

ROTATIONAL_INERTIA = Slots(RotationalInertia, {"_I": (3, 3)})
_turn = short_way(
    globals(), "_turn", spatial.turn_rotational_inertia, ROTATIONAL_INERTIA, ROTATION, gives=ROTATIONAL_INERTIA
)
RotationalInertia_ = ScalarTemplate("RotationalInertia_", RotationalInertia, scope="sheldrake.multibody.math")
