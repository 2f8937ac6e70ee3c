"""Constraints on velocities, momentum and the integration of rotations."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.autodiffutils import AutoDiffXd
from sheldrake.common._checked import checked
from sheldrake.common._kernels.generic import cos, sin, sqrt
from sheldrake.common._overloads import incompatible
from sheldrake.multibody.inverse_kinematics._kinematic import KinematicFunction
from sheldrake.solvers import Constraint
from sheldrake.solvers._functions.evaluators import Opaque

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike

    from sheldrake.multibody.plant import MultibodyPlant
    from sheldrake.multibody.tree import Frame, ModelInstanceIndex
    from sheldrake.systems.framework import Context


def require_duals(call: str, plant: MultibodyPlant, context: Context) -> None:
    """Checks that a plant is one of AutoDiffXd.

    Raises:
        TypeError: it is not.
    """
    if plant is not None and plant._scalar is not AutoDiffXd:
        raise incompatible(call, ["(plant: MultibodyPlant_[AutoDiffXd], ...)"], (plant, context), {}, constructor=True)


def as_duals(x: np.ndarray) -> np.ndarray:
    """A vector of AutoDiffXd, from numbers too."""
    return np.array([v if isinstance(v, AutoDiffXd) else AutoDiffXd(float(v)) for v in x], dtype=object)


class CentroidalMomentumConstraint(KinematicFunction, Constraint):
    """The momentum about the center of mass is what the last variables say; variables (q, v, h).

    Args:
        plant: A plant of AutoDiffXd.
        model_instances: Whose bodies; None for all.
        plant_context: Where positions and velocities are put.
        angular_only: h is the angular momentum [kg m^2/s], shape (3,), instead of the spatial one, shape (6,).
    """

    def __init__(
        self,
        plant: MultibodyPlant,
        model_instances: Sequence[ModelInstanceIndex] | None,
        plant_context: Context,
        angular_only: bool,
    ):
        require_duals(type(self).__name__, plant, plant_context)
        self._instances = [] if model_instances is None else [list(model_instances)]
        self._size = 3 if angular_only else 6
        self._set_plant(plant, plant_context, self._size, plant.num_velocities() + self._size)
        self._description = "Centroidal momentum constraint"
        self._set_bounds(np.zeros(self._size), np.zeros(self._size))

    def _value(self, more: np.ndarray) -> np.ndarray:
        plant, context, nv = self._plant, self._context, self._plant.num_velocities()
        plant.SetVelocities(context, as_duals(more[:nv]))
        p_WC = plant.CalcCenterOfMassPositionInWorld(context, *self._instances)
        h = plant.CalcSpatialMomentumInWorldAboutPoint(*[context, *self._instances, p_WC])
        return h.get_coeffs()[: self._size] - more[nv:]


@checked
class SpatialVelocityConstraint(KinematicFunction, Constraint):
    """Bounds the velocity of a frame C fixed to frame B, measured and expressed in frame A; variables (q, v).

    Args:
        plant: A plant of AutoDiffXd.
        frameA: Frame A.
        v_AC_lower: Least translational velocity [m/s], shape (3,).
        v_AC_upper: Greatest translational velocity [m/s], shape (3,).
        frameB: Frame B.
        p_BCo: Origin of C in B [m], shape (3,).
        plant_context: Where positions and velocities are put.
        w_AC_bounds: Bounds of the angular velocity, two more values: the square of its magnitude, and the cosine of
            its angle to a direction.

    Raises:
        ValueError: there is no context, or the bounds of the angular velocity are none.
    """

    class AngularVelocityBounds:
        """Bounds of an angular velocity: its magnitude [rad/s] and its angle to a direction [rad]."""

        def __init__(self) -> None:
            self.magnitude_lower, self.magnitude_upper = 0.0, np.inf
            self.reference_direction = np.array([0.0, 0.0, 1.0])
            self.theta_bound = np.pi

    def __init__(
        self,
        plant: MultibodyPlant,
        frameA: Frame,
        v_AC_lower: ArrayLike,
        v_AC_upper: ArrayLike,
        frameB: Frame,
        p_BCo: ArrayLike,
        plant_context: Context,
        w_AC_bounds: AngularVelocityBounds | None = None,
    ):
        if plant_context is None:
            raise ValueError("plant_context is nullptr.")
        require_duals(type(self).__name__, plant, plant_context)
        lower, upper = ([float(v) for v in np.ravel(b)] for b in (v_AC_lower, v_AC_upper))
        self._A, self._B, self._p_BCo = frameA, frameB, np.array(p_BCo, dtype=float).reshape(3)
        self._direction = None
        if w_AC_bounds is not None:
            w = w_AC_bounds
            if not 0.0 <= w.magnitude_lower <= w.magnitude_upper:
                raise ValueError(
                    f"SpatialVelocityConstraint(): magnitudes from {w.magnitude_lower} to {w.magnitude_upper} must not "
                    "be negative, nor in reverse order."
                )
            direction = np.array(w.reference_direction, dtype=float).reshape(3)
            self._direction = direction / np.linalg.norm(direction) if direction.any() else direction
            lower += [w.magnitude_lower**2, float(np.cos(w.theta_bound))]
            upper += [w.magnitude_upper**2, 1.0]
        self._set_plant(plant, plant_context, len(lower), plant.num_velocities())
        self._set_bounds(np.array(lower), np.array(upper))

    def _value(self, more: np.ndarray) -> np.ndarray:
        self._plant.SetVelocities(self._context, as_duals(more))
        V_AB = self._B.CalcSpatialVelocity(self._context, self._A, self._A)
        R_AB = self._plant.CalcRelativeTransform(self._context, self._A, self._B).rotation().matrix()
        w, v = V_AB.rotational(), V_AB.translational()
        v_AC = v + np.cross(w, R_AB @ self._p_BCo)
        if self._direction is None:
            return v_AC
        square = w @ w
        cosine = (w @ self._direction) / sqrt(square)
        return np.concatenate((v_AC, [square, cosine]))


class QuaternionEulerIntegrationConstraint(Opaque, Constraint):
    """A constant angular velocity turns one unit quaternion into another; variables (quat1, quat2, w, h).

    Its value, which is one, is the product of quat2 with quat1 turned by w h; its square, if they may change sign.

    Args:
        allow_quaternion_negation: Whether the second quaternion may be the negative one of the same rotation.
    """

    def __init__(self, allow_quaternion_negation: bool):
        self._negation = bool(allow_quaternion_negation)
        self._set_sizes(1, 12, "quaternion Euler integration constraint")
        self._set_bounds(np.ones(1), np.ones(1))

    def allow_quaternion_negation(self) -> bool:
        """Tells whether the second quaternion may be negated."""
        return self._negation

    def ComposeVariable(self, quat1: ArrayLike, quat2: ArrayLike, angular_vel: ArrayLike, h: Any) -> np.ndarray:
        """Returns its variables in order, shape (12,).

        Args:
            quat1: Quaternion (w, x, y, z) at the start.
            quat2: Quaternion at the end.
            angular_vel: Angular velocity in the world [rad/s], shape (3,).
            h: Duration [s].
        """
        return np.concatenate((np.ravel(quat1), np.ravel(quat2), np.ravel(angular_vel), [h]))

    def _product(self, x: np.ndarray) -> np.ndarray:
        z1, z2, w, h = x[:4], x[4:8], x[8:11], x[11]
        square = w[0] ** 2 + w[1] ** 2 + w[2] ** 2
        turn = [1.0, *(0.5 * h * w)]  # To first order, which is all where nothing turns.
        if not _is_zero(square):
            speed = sqrt(square)
            half = 0.5 * h * speed
            turn = [cos(half), *(sin(half) / speed * w)]
        (a, b, c, d), (e, f, g, k) = turn, z1
        turned = [
            a * e - b * f - c * g - d * k,
            a * f + b * e + c * k - d * g,
            a * g - b * k + c * e + d * f,
            a * k + b * g - c * f + d * e,
        ]
        total = z2[0] * turned[0] + z2[1] * turned[1] + z2[2] * turned[2] + z2[3] * turned[3]
        return np.array([total**2 if self._negation else total])

    _eval = _eval_symbols = _eval_duals = _product


def _is_zero(square: Any) -> bool:
    """Whether the square of an angular velocity is zero; a symbol is not."""
    value = square._v if isinstance(square, AutoDiffXd) else square
    return isinstance(value, (float, int, np.floating)) and float(value) == 0.0
