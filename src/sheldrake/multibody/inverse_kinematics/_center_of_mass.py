"""Constraints on the center of mass."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.multibody.inverse_kinematics._kinematic import QDOT, KinematicFunction
from sheldrake.solvers import Constraint

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike

    from sheldrake.multibody.plant import MultibodyPlant
    from sheldrake.multibody.tree import Frame, ModelInstanceIndex
    from sheldrake.systems.framework import Context


class _CenterOfMass(KinematicFunction):
    _instances: Any
    _E: Any

    def _com(self) -> np.ndarray:
        """p_EC, shape (3,)."""
        p_WC = self._plant.CalcCenterOfMassPositionInWorld(self._context, *self._which())
        X_WE = self._plant.CalcRelativeTransform(self._context, self._plant.world_frame(), self._E)
        return X_WE.rotation().matrix().T @ (p_WC - X_WE.translation())

    def _which(self) -> list:
        return [] if self._instances is None else [self._instances]

    def _com_slope(self) -> np.ndarray:
        """Derivative of p_EC by q, shape (3, nq)."""
        arguments = [self._context, *self._which(), QDOT, self._E, self._E]
        return self._plant.CalcJacobianCenterOfMassTranslationalVelocity(*arguments)


@checked
class ComPositionConstraint(_CenterOfMass, Constraint):
    """The center of mass is where the last three variables say: p_EC(q) = x[-3:].

    Args:
        plant: The plant.
        model_instances: Whose bodies; None for all.
        expressed_frame: Frame E.
        plant_context: Where the positions are put.
    """

    def __init__(
        self,
        plant: MultibodyPlant | None,
        model_instances: Sequence[ModelInstanceIndex] | None,
        expressed_frame: Frame,
        plant_context: Context | None,
    ):
        self._instances, self._E = model_instances, expressed_frame
        self._set_plant(plant, plant_context, 3, 3)
        self._description = f"{self._plant.get_name()} CoM position constraint"
        self._set_bounds(np.zeros(3), np.zeros(3))

    def _value(self, more: np.ndarray) -> np.ndarray:
        return self._com() - more

    def _slope(self, more: np.ndarray) -> np.ndarray:
        return np.hstack((self._com_slope(), -np.eye(3)))


@checked
class ComInPolyhedronConstraint(_CenterOfMass, Constraint):
    """lb <= A p_EC <= ub for the center of mass C.

    Args:
        plant: The plant.
        model_instances: Whose bodies; None for all.
        expressed_frame: Frame E.
        A: Shape (m, 3).
        lb: Shape (m,).
        ub: Shape (m,).
        plant_context: Where the positions are put.
    """

    def __init__(
        self,
        plant: MultibodyPlant | None,
        model_instances: Sequence[ModelInstanceIndex] | None,
        expressed_frame: Frame,
        A: ArrayLike,
        lb: ArrayLike,
        ub: ArrayLike,
        plant_context: Context | None,
    ):
        self._instances, self._E = model_instances, expressed_frame
        self._A = np.array(A, dtype=float).reshape(-1, 3)
        self._set_plant(plant, plant_context, len(self._A))
        self._description = "com in polyhedron constraint"
        self._set_bounds(np.atleast_1d(np.array(lb, dtype=float)), np.atleast_1d(np.array(ub, dtype=float)))

    def _value(self, more: np.ndarray) -> np.ndarray:
        return self._A @ self._com()

    def _slope(self, more: np.ndarray) -> np.ndarray:
        return self._A @ self._com_slope()
