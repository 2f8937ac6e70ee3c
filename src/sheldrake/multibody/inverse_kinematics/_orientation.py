"""How frames are turned: constraints and costs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.multibody.inverse_kinematics._kinematic import KinematicFunction, form, unit3
from sheldrake.solvers import Constraint, Cost

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.math import RotationMatrix
    from sheldrake.multibody.plant import MultibodyPlant
    from sheldrake.multibody.tree import Frame
    from sheldrake.systems.framework import Context


class _Turn(KinematicFunction):
    """R_AB, where A is fixed to frame Abar and B to frame Bbar."""

    def _set_turn(
        self,
        plant: MultibodyPlant | None,
        Abar: Frame,
        R_AbarA: RotationMatrix,
        Bbar: Frame,
        R_BbarB: RotationMatrix,
        context: Context | None,
    ) -> None:
        self._A, self._B = Abar, Bbar
        self._R_AAbar, self._R_BbarB = R_AbarA.matrix().T, R_BbarB.matrix()
        self._set_plant(plant, context, 1)

    def _R(self) -> np.ndarray:
        return self._R_AAbar @ self._rotation(self._A, self._B) @ self._R_BbarB

    def _trace(self) -> Any:
        R = self._R()
        return R[0, 0] + R[1, 1] + R[2, 2]

    def _trace_form(self, factor: float, constant: float) -> list[np.ndarray]:
        """factor * trace + constant."""
        return [form(turn=factor * (self._R_BbarB @ self._R_AAbar).T, constant=constant)]


@checked
class OrientationConstraint(_Turn, Constraint):
    """The angle between frames A and B is bounded; its value is the trace of R_AB, 2 cos(angle) + 1.

    Args:
        plant: The plant.
        frameAbar: The frame that A is fixed to.
        R_AbarA: How A is turned in it.
        frameBbar: The frame that B is fixed to.
        R_BbarB: How B is turned in it.
        theta_bound: Greatest angle [rad].
        plant_context: Where the positions are put.

    Raises:
        ValueError: the bound is negative.
    """

    def __init__(
        self,
        plant: MultibodyPlant | None,
        frameAbar: Frame,
        R_AbarA: RotationMatrix,
        frameBbar: Frame,
        R_BbarB: RotationMatrix,
        theta_bound: float,
        plant_context: Context | None,
    ):
        self._set_turn(plant, frameAbar, R_AbarA, frameBbar, R_BbarB, plant_context)
        if theta_bound < 0.0:
            raise ValueError("OrientationConstraint: theta_bound should be non-negative.\n")
        self._set_bounds(np.array([2.0 * np.cos(theta_bound) + 1.0]), np.array([3.0]))

    def _value(self, more: np.ndarray) -> np.ndarray:
        return np.array([self._trace()])

    def _forms(self) -> list[np.ndarray]:
        return self._trace_form(1.0, 0.0)


@checked
class OrientationCost(_Turn, Cost):
    """c (1 - cos(angle)) of the angle between frames A and B.

    Args:
        plant: The plant.
        frameAbar: The frame that A is fixed to.
        R_AbarA: How A is turned in it.
        frameBbar: The frame that B is fixed to.
        R_BbarB: How B is turned in it.
        c: Weight.
        plant_context: Where the positions are put.
    """

    def __init__(
        self,
        plant: MultibodyPlant | None,
        frameAbar: Frame,
        R_AbarA: RotationMatrix,
        frameBbar: Frame,
        R_BbarB: RotationMatrix,
        c: float,
        plant_context: Context | None,
    ):
        self._set_turn(plant, frameAbar, R_AbarA, frameBbar, R_BbarB, plant_context)
        self._c = float(c)

    def _value(self, more: np.ndarray) -> np.ndarray:
        return np.array([self._c * (3.0 - self._trace()) * 0.5])

    def _forms(self) -> list[np.ndarray]:
        return self._trace_form(-0.5 * self._c, 1.5 * self._c)


class _Angle(KinematicFunction):
    """cos of the angle between direction a of frame A and b of frame B."""

    def _set_angle(
        self, plant: MultibodyPlant | None, A: Frame, a_A: ArrayLike, B: Frame, b_B: ArrayLike, context: Context | None
    ) -> None:
        call = type(self).__name__
        self._A, self._B = A, B
        self._a, self._b = unit3(call, "a_A", a_A), unit3(call, "b_B", b_B)
        self._set_plant(plant, context, 1)

    def _cos(self) -> Any:
        return self._a @ (self._rotation(self._A, self._B) @ self._b)

    def _cos_form(self, factor: float, constant: float) -> list[np.ndarray]:
        """factor * cos + constant."""
        return [form(turn=factor * np.outer(self._a, self._b), constant=constant)]


@checked
class AngleBetweenVectorsConstraint(_Angle, Constraint):
    """The angle between two directions is bounded; its value is the cosine.

    Args:
        plant: The plant.
        frameA: Frame A.
        a_A: A direction in A, shape (3,).
        frameB: Frame B.
        b_B: A direction in B, shape (3,).
        angle_lower: Least angle [rad].
        angle_upper: Greatest angle [rad].
        plant_context: Where the positions are put.

    Raises:
        ValueError: the angles are not 0 <= lower <= upper <= pi, or a direction is zero.
    """

    def __init__(
        self,
        plant: MultibodyPlant | None,
        frameA: Frame,
        a_A: ArrayLike,
        frameB: Frame,
        b_B: ArrayLike,
        angle_lower: float,
        angle_upper: float,
        plant_context: Context | None,
    ):
        self._set_angle(plant, frameA, a_A, frameB, b_B, plant_context)
        if not 0.0 <= angle_lower <= angle_upper <= np.pi:
            raise ValueError("AngleBetweenVectorsConstraint: should satisfy 0 <= angle_lower <= angle_upper <= pi")
        self._set_bounds(np.array([np.cos(angle_upper)]), np.array([np.cos(angle_lower)]))

    def _value(self, more: np.ndarray) -> np.ndarray:
        return np.array([self._cos()])

    def _forms(self) -> list[np.ndarray]:
        return self._cos_form(1.0, 0.0)


@checked
class AngleBetweenVectorsCost(_Angle, Cost):
    """c (1 - cos(angle)) of the angle between two directions.

    Args:
        plant: The plant.
        frameA: Frame A.
        a_A: A direction in A, shape (3,).
        frameB: Frame B.
        b_B: A direction in B, shape (3,).
        c: Weight.
        plant_context: Where the positions are put.
    """

    def __init__(
        self,
        plant: MultibodyPlant | None,
        frameA: Frame,
        a_A: ArrayLike,
        frameB: Frame,
        b_B: ArrayLike,
        c: float,
        plant_context: Context | None,
    ):
        self._set_angle(plant, frameA, a_A, frameB, b_B, plant_context)
        self._c = float(c)

    def _value(self, more: np.ndarray) -> np.ndarray:
        return np.array([self._c * (1.0 - self._cos())])

    def _forms(self) -> list[np.ndarray]:
        return self._cos_form(-self._c, self._c)
