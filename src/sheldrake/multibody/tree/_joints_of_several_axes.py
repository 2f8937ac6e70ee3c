"""Joints of two and three degrees of freedom.

Planar, universal and ball joints; see `_joint` for what a joint is.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.math import RigidTransform, RigidTransform_, RollPitchYaw_, RotationMatrix_
from sheldrake.multibody.tree._element import default_values, distributions, scalar_of, vector
from sheldrake.multibody.tree._frame import Frame
from sheldrake.multibody.tree._joint import Joint

if TYPE_CHECKING:
    from sheldrake.common._types import Scalar, Scalars, Vector
    from sheldrake.multibody.math import SpatialVelocity
    from sheldrake.systems.framework import Context


class PlanarJoint(Joint):
    """M slides in the x-y plane of F and turns about its z axis: positions x, y, theta."""

    kTypeName = "planar"
    _axis = np.array([0.0, 0.0, 1.0])

    @checked
    def __init__(self, name: str, frame_on_parent: Frame, frame_on_child: Frame, damping: Scalars = (0.0, 0.0, 0.0)):
        """
        Args:
            name: Its name.
            frame_on_parent: F.
            frame_on_child: M.
            damping: Along x and y [N s/m] and about z [N m s], shape (3,).
        """
        super().__init__(name, frame_on_parent, frame_on_child, vector("PlanarJoint.__init__", "damping", damping, 3))

    def _pose_at(self, q: np.ndarray) -> RigidTransform:
        T = scalar_of(q)
        return RigidTransform_[T](RotationMatrix_[T].MakeZRotation(q[2]), [q[0], q[1], 0.0])

    def default_damping(self) -> np.ndarray:
        """Damping of each velocity, shape (3,)."""
        return self._damping.copy()

    def get_translation(self, context: Context) -> np.ndarray:
        """x and y of M's origin in F [m], shape (2,)."""
        return self._q(context, "get_translation")[:2]

    def set_translation(self, context: Context, p_FoMo_F: Scalars) -> PlanarJoint:
        """Sets x and y of M's origin in F [m]."""
        return self._write_q(context, "set_translation", vector("set_translation", "p_FoMo_F", p_FoMo_F, 2))

    def get_rotation(self, context: Context) -> float:
        """The angle about z [rad]."""
        return self._q(context, "get_rotation").item(2)

    def set_rotation(self, context: Context, theta: float) -> PlanarJoint:
        """Sets the angle about z [rad]."""
        return self._write_one_q(context, "set_rotation", theta, 2)

    @checked
    def set_pose(self, context: Context, p_FoMo_F: Scalars, theta: float) -> PlanarJoint:
        """Sets x and y [m] and the angle [rad]."""
        return self._write_q(context, "set_pose", [*vector("set_pose", "p_FoMo_F", p_FoMo_F, 2), theta])

    def get_translational_velocity(self, context: Context) -> np.ndarray:
        """Rates of x and y [m/s], shape (2,)."""
        return self._velocities(context, "get_translational_velocity")[:2]

    def set_translational_velocity(self, context: Context, v_FoMo_F: Scalars) -> PlanarJoint:
        """Sets the rates of x and y [m/s]."""
        call = "set_translational_velocity"
        return self._write_v(context, call, vector(call, "v_FoMo_F", v_FoMo_F, 2))

    def get_angular_velocity(self, context: Context) -> float:
        """The rate of the angle [rad/s]."""
        return self._velocities(context, "get_angular_velocity").item(2)

    def set_angular_velocity(self, context: Context, theta_dot: float) -> PlanarJoint:
        """Sets the rate of the angle [rad/s]."""
        return self._write_one_v(context, "set_angular_velocity", theta_dot, 2)

    def get_default_translation(self) -> np.ndarray:
        """x and y in a default context [m], shape (2,)."""
        return self._default_q[:2].copy()

    def set_default_translation(self, p_FoMo_F: Scalars) -> None:
        """Sets x and y in a default context [m]."""
        call = "set_default_translation"
        self._default_q[:2] = default_values(call, "p_FoMo_F", p_FoMo_F, 2)

    def get_default_rotation(self) -> float:
        """The angle in a default context [rad]."""
        return float(self._default_q[2])

    @checked
    def set_default_rotation(self, theta: float) -> None:
        """Sets the angle in a default context [rad]."""
        (self._default_q[2],) = default_values("set_default_rotation", "theta", [theta], 1)

    @checked
    def set_default_pose(self, p_FoMo_F: Scalars, theta: float) -> None:
        """Sets x and y [m] and the angle [rad] in a default context."""
        call = "set_default_pose"
        p, angle = default_values(call, "p_FoMo_F", p_FoMo_F, 2), default_values(call, "theta", [theta], 1)
        self._default_q = np.append(p, angle)

    def set_random_pose_distribution(self, p_FoMo_F: Scalars, theta: Scalar) -> None:
        """Sets the expressions from which SetRandomState() draws x, y and the angle."""
        call = "set_random_pose_distribution"
        self._random_q = [*distributions(call, "p_FoMo_F", p_FoMo_F, 2), *distributions(call, "theta", [theta], 1)]


class UniversalJoint(Joint):
    """Turns about F's x axis, then about the y axis that turned with it: two angles."""

    kTypeName = "universal"

    @checked
    def __init__(self, name: str, frame_on_parent: Frame, frame_on_child: Frame, damping: float = 0.0):
        super().__init__(name, frame_on_parent, frame_on_child, [damping, damping])

    def _pose_at(self, q: np.ndarray) -> RigidTransform:
        R = RotationMatrix_[scalar_of(q)]
        return RigidTransform_[scalar_of(q)](R.MakeXRotation(q[0]) @ R.MakeYRotation(q[1]), np.zeros(3))

    def default_damping(self) -> float:
        """Viscous damping of both angles [N m s]."""
        return float(self._damping[0])

    def get_angles(self, context: Context) -> np.ndarray:
        """Both angles [rad], shape (2,)."""
        return self._q(context, "get_angles")

    def set_angles(self, context: Context, angles: Scalars) -> UniversalJoint:
        """Sets both angles [rad]."""
        return self._write_q(context, "set_angles", vector("set_angles", "angles", angles, 2))

    def get_angular_rates(self, context: Context) -> np.ndarray:
        """Rates of both angles [rad/s], shape (2,)."""
        return self._velocities(context, "get_angular_rates")

    def set_angular_rates(self, context: Context, theta_dot: Scalars) -> UniversalJoint:
        """Sets the rates of both angles [rad/s]."""
        return self._write_v(context, "set_angular_rates", vector("set_angular_rates", "theta_dot", theta_dot, 2))

    def get_default_angles(self) -> np.ndarray:
        """Both angles in a default context [rad], shape (2,)."""
        return self._default_q.copy()

    def set_default_angles(self, angles: Scalars) -> None:
        """Sets both angles in a default context [rad]."""
        self._default_q = default_values("set_default_angles", "angles", angles, 2)

    def set_random_angles_distribution(self, angles: Scalars) -> None:
        """Sets the expressions from which SetRandomState() draws the angles."""
        self._random_q = distributions("set_random_angles_distribution", "angles", angles, 2)


class BallRpyJoint(Joint):
    """Turns any way: positions roll, pitch, yaw of R_FM (space-fixed x-y-z), velocities w_FM in F."""

    kTypeName = "ball_rpy"

    @checked
    def __init__(self, name: str, frame_on_parent: Frame, frame_on_child: Frame, damping: float = 0.0):
        super().__init__(name, frame_on_parent, frame_on_child, [damping] * 3)

    def _pose_at(self, q: np.ndarray) -> RigidTransform:
        T = scalar_of(q)
        return RigidTransform_[T](RollPitchYaw_[T](q), np.zeros(3))

    def _positions_of_pose(self, call: str, X_FM: RigidTransform) -> Vector:
        return RollPitchYaw_[X_FM._T](X_FM.rotation()).vector()

    def _velocities_of(self, V_FM: SpatialVelocity) -> np.ndarray:
        return V_FM.rotational()

    def default_damping(self) -> float:
        """Viscous damping of the angular velocity [N m s]."""
        return float(self._damping[0])

    def get_angles(self, context: Context) -> np.ndarray:
        """Roll, pitch, yaw [rad], shape (3,)."""
        return self._q(context, "get_angles")

    def set_angles(self, context: Context, angles: Scalars) -> BallRpyJoint:
        """Sets roll, pitch, yaw [rad]."""
        return self._write_q(context, "set_angles", vector("set_angles", "angles", angles, 3))

    def get_angular_velocity(self, context: Context) -> np.ndarray:
        """w_FM expressed in F [rad/s], shape (3,)."""
        return self._velocities(context, "get_angular_velocity")

    def set_angular_velocity(self, context: Context, w_FM: Scalars) -> BallRpyJoint:
        """Sets w_FM expressed in F [rad/s]."""
        return self._write_v(context, "set_angular_velocity", vector("set_angular_velocity", "w_FM", w_FM, 3))

    def get_default_angles(self) -> np.ndarray:
        """Roll, pitch, yaw in a default context [rad], shape (3,)."""
        return self._default_q.copy()

    def set_default_angles(self, angles: Scalars) -> None:
        """Sets roll, pitch, yaw in a default context [rad]."""
        self._default_q = default_values("set_default_angles", "angles", angles, 3)

    def set_random_angles_distribution(self, angles: Scalars) -> None:
        """Sets the expressions from which SetRandomState() draws the angles."""
        self._random_q = distributions("set_random_angles_distribution", "angles", angles, 3)
