"""Joints along or about one axis, and the weld.

Revolute, prismatic and screw joints; see `_joint` for what a joint is.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._overloads import Mismatch
from sheldrake.common.eigen_geometry import AngleAxis_
from sheldrake.math import RigidTransform, RigidTransform_
from sheldrake.multibody.tree._element import distributions, finite, scalar_of, vector
from sheldrake.multibody.tree._frame import Frame, pose_numbers
from sheldrake.multibody.tree._joint import Joint

if TYPE_CHECKING:
    from sheldrake.common._types import Scalar, Scalars, Symbolic
    from sheldrake.systems.framework import Context


_SHORTEST_AXIS = math.sqrt(np.finfo(float).eps)


class OneDampingJoint(Joint):
    """One velocity, whose damping is a number."""

    def default_damping(self) -> float:
        """Viscous damping [N m s or N s/m]."""
        return float(self._damping[0])

    def GetDamping(self, context: Context) -> float:
        """Viscous damping as the context has it [N m s or N s/m]."""
        return self.GetDampingVector(context).item(0)

    @checked
    def SetDamping(self, context: Context, damping: float) -> None:
        """Changes the damping in a context [N m s or N s/m]."""
        self.SetDampingVector(context, [damping])


class OneVelocityJoint(OneDampingJoint):
    """One position and its rate: limits and damping are numbers."""

    def _one(self, kind: str, side: int) -> float:
        return float(self._limits[kind][side][0])

    def position_lower_limit(self) -> float:
        """Lower limit of the position [rad or m]."""
        return self._one("position", 0)

    def position_upper_limit(self) -> float:
        """Upper limit of the position [rad or m]."""
        return self._one("position", 1)

    def velocity_lower_limit(self) -> float:
        """Lower limit of the velocity [rad/s or m/s]; not enforced."""
        return self._one("velocity", 0)

    def velocity_upper_limit(self) -> float:
        """Upper limit of the velocity [rad/s or m/s]; not enforced."""
        return self._one("velocity", 1)

    def acceleration_lower_limit(self) -> float:
        """Lower limit of the acceleration [rad/s² or m/s²]; not enforced."""
        return self._one("acceleration", 0)

    def acceleration_upper_limit(self) -> float:
        """Upper limit of the acceleration [rad/s² or m/s²]; not enforced."""
        return self._one("acceleration", 1)

    @checked
    def set_default_damping(self, damping: float) -> None:
        """Sets the damping, before Finalize()."""
        self.set_default_damping_vector([damping])


def _unit_axis(joint: Joint, axis: Scalars) -> np.ndarray:
    """`axis` with length one, shape (3,).

    Raises:
        RuntimeError: it is not finite, or too short to have a direction.
    """
    direction = finite(type(joint).__name__, "axis", vector(type(joint).__name__, "axis", axis, 3).astype(float))
    length = math.sqrt(direction.dot(direction))
    if not length >= _SHORTEST_AXIS:
        kind = joint.kTypeName.capitalize()
        raise RuntimeError(
            f"{kind} joint axis vector must have nonzero length; "
            f"that of joint {joint.name()!r} is {direction.tolist()}."
        )
    return direction / length


class _AxisJoint(OneVelocityJoint):
    """One position, one velocity, one axis fixed in F and in M."""

    _axis: np.ndarray

    @checked
    def __init__(
        self,
        name: str,
        frame_on_parent: Frame,
        frame_on_child: Frame,
        axis: Scalars,
        pos_lower_limit: float = -np.inf,
        pos_upper_limit: float = np.inf,
        damping: float = 0.0,
    ):
        super().__init__(name, frame_on_parent, frame_on_child, [damping])
        self._axis = _unit_axis(self, axis)
        if not (pos_lower_limit == -math.inf and pos_upper_limit == math.inf):
            self._set_limits("position", [pos_lower_limit], [pos_upper_limit])

    def _reversed_constants(self) -> tuple[float, ...]:
        """Constants for the kernels when the child is the inboard body: the same motion about the opposite axis."""
        x, y, z, lead = self._constants()
        return (-x, -y, -z, lead)


class RevoluteJoint(_AxisJoint):
    """Turns about one axis."""

    kTypeName = "revolute"

    def __init__(
        self,
        name: str,
        frame_on_parent: Frame,
        frame_on_child: Frame,
        axis: Scalars,
        *limits: float,
        damping: float | None = None,
        pos_lower_limit: float | None = None,
        pos_upper_limit: float | None = None,
    ):
        """
        Args:
            name: Its name.
            frame_on_parent: F.
            frame_on_child: M.
            axis: In F and in M; its length does not matter. Shape (3,).
            limits: `damping`, or `pos_lower_limit, pos_upper_limit[, damping]`.
            damping: Viscous damping [N m s].
            pos_lower_limit: Lower limit of the angle [rad].
            pos_upper_limit: Upper limit of the angle [rad].
        """
        if len(limits) == 1 and pos_upper_limit is None:
            (damping,), limits = limits, ()
        given = dict(zip(("lower", "upper", "damping"), limits))
        super().__init__(
            name,
            frame_on_parent,
            frame_on_child,
            axis,
            given.get("lower", -np.inf if pos_lower_limit is None else pos_lower_limit),
            given.get("upper", np.inf if pos_upper_limit is None else pos_upper_limit),
            given.get("damping", damping or 0.0),
        )

    def revolute_axis(self) -> np.ndarray:
        """The axis, a unit vector in F and in M, shape (3,)."""
        return self._axis.copy()

    def _constants(self) -> tuple[float, ...]:
        return (*self._axis, 0.0)

    def _pose_at(self, q: np.ndarray) -> RigidTransform:
        T = scalar_of(q)
        return RigidTransform_[T](AngleAxis_[T](q[0], self._axis), np.zeros(3))

    def get_angle(self, context: Context) -> float:
        """The angle [rad]."""
        return self._one_q(context, "get_angle")

    def set_angle(self, context: Context, angle: float) -> RevoluteJoint:
        """Sets the angle [rad]."""
        return self._write_one_q(context, "set_angle", angle)

    def get_angular_rate(self, context: Context) -> float:
        """The rate of the angle [rad/s]."""
        return self._one_v(context, "get_angular_rate")

    def set_angular_rate(self, context: Context, angle: float) -> RevoluteJoint:
        """Sets the rate of the angle [rad/s]."""
        return self._write_one_v(context, "set_angular_rate", angle)

    def get_default_angle(self) -> float:
        """The angle in a default context [rad]."""
        return float(self._default_q[0])

    @checked
    def set_default_angle(self, angle: float) -> None:
        """Sets the angle in a default context [rad]."""
        self.set_default_positions([angle])

    @checked
    def set_random_angle_distribution(self, angle: Symbolic) -> None:
        """Sets the expression from which SetRandomState() draws the angle."""
        self._random_q = distributions("set_random_angle_distribution", "angle", np.array([angle]), 1)


class PrismaticJoint(_AxisJoint):
    """Slides along one axis."""

    kTypeName = "prismatic"

    def translation_axis(self) -> np.ndarray:
        """The axis, a unit vector in F and in M, shape (3,)."""
        return self._axis.copy()

    def _constants(self) -> tuple[float, ...]:
        return (*self._axis, 1.0)

    def _pose_at(self, q: np.ndarray) -> RigidTransform:
        return RigidTransform_[scalar_of(q)](q[0] * self._axis)

    def get_translation(self, context: Context) -> float:
        """The translation [m]."""
        return self._one_q(context, "get_translation")

    def set_translation(self, context: Context, translation: float) -> PrismaticJoint:
        """Sets the translation [m]."""
        return self._write_one_q(context, "set_translation", translation)

    def get_translation_rate(self, context: Context) -> float:
        """The rate of the translation [m/s]."""
        return self._one_v(context, "get_translation_rate")

    def set_translation_rate(self, context: Context, translation_dot: float) -> PrismaticJoint:
        """Sets the rate of the translation [m/s]."""
        return self._write_one_v(context, "set_translation_rate", translation_dot)

    def get_default_translation(self) -> float:
        """The translation in a default context [m]."""
        return float(self._default_q[0])

    @checked
    def set_default_translation(self, translation: float) -> None:
        """Sets the translation in a default context [m]."""
        self.set_default_positions([translation])

    @checked
    def set_random_translation_distribution(self, translation: Symbolic) -> None:
        """Sets the expression from which SetRandomState() draws the translation."""
        self._random_q = distributions("set_random_translation_distribution", "translation", np.array([translation]), 1)


class ScrewJoint(OneDampingJoint):
    """Turns about an axis and slides along it in proportion."""

    kTypeName = "screw"
    _axis: np.ndarray

    def __init__(
        self,
        name: str,
        frame_on_parent: Frame,
        frame_on_child: Frame,
        *args: Any,
        axis: Scalars = (0.0, 0.0, 1.0),
        screw_pitch: float | None = None,
        damping: float | None = None,
    ):
        """
        Args:
            name: Its name.
            frame_on_parent: F.
            frame_on_child: M.
            args: `screw_pitch, damping`, or `axis, screw_pitch, damping`.
            axis: In F and in M; z when left out. Shape (3,).
            screw_pitch: Translation for one turn [m].
            damping: Viscous damping of the rotation [N m s].
        """
        rest = list(args)
        if rest and np.ndim(rest[0]) > 0:
            axis = rest.pop(0)
        screw_pitch = rest.pop(0) if rest else screw_pitch
        damping = rest.pop(0) if rest else damping
        if rest or screw_pitch is None or damping is None:
            raise Mismatch(
                "ScrewJoint(): incompatible constructor arguments. Takes (name, frame_on_parent, frame_on_child, "
                "screw_pitch: float, damping: float) or (name, frame_on_parent, frame_on_child, axis, screw_pitch: "
                "float, damping: float)."
            )
        super().__init__(name, frame_on_parent, frame_on_child, [damping])
        self._axis = _unit_axis(self, axis)
        self._pitch = float(finite("ScrewJoint", "screw_pitch", screw_pitch))

    def _lead(self) -> float:
        return self._pitch / (2 * np.pi)

    def _constants(self) -> tuple[float, ...]:
        return (*self._axis, self._lead())

    def _pose_at(self, q: np.ndarray) -> RigidTransform:
        T = scalar_of(q)
        return RigidTransform_[T](AngleAxis_[T](q[0], self._axis), q[0] * self._lead() * self._axis)

    def _angle_of(self, call: str, translation: float) -> float:
        if self._pitch == 0.0:
            raise RuntimeError(f"ScrewJoint.{call}(): joint {self._name!r} has no pitch, so it does not translate.")
        return translation / self._lead()

    def screw_axis(self) -> np.ndarray:
        """The axis, a unit vector in F and in M, shape (3,)."""
        return self._axis.copy()

    def screw_pitch(self) -> float:
        """Translation for one turn [m]."""
        return self._pitch

    def get_rotation(self, context: Context) -> float:
        """The angle [rad]."""
        return self._one_q(context, "get_rotation")

    def set_rotation(self, context: Context, theta: float) -> ScrewJoint:
        """Sets the angle [rad]."""
        return self._write_one_q(context, "set_rotation", theta)

    def get_translation(self, context: Context) -> float:
        """The translation along the axis [m]."""
        return self._one_q(context, "get_translation") * self._lead()

    @checked
    def set_translation(self, context: Context, translation: float) -> ScrewJoint:
        """Sets the translation along the axis [m]."""
        return self._write_one_q(context, "set_translation", self._angle_of("set_translation", translation))

    def get_angular_velocity(self, context: Context) -> float:
        """The rate of the angle [rad/s]."""
        return self._one_v(context, "get_angular_velocity")

    def set_angular_velocity(self, context: Context, theta_dot: float) -> ScrewJoint:
        """Sets the rate of the angle [rad/s]."""
        return self._write_one_v(context, "set_angular_velocity", theta_dot)

    def get_translational_velocity(self, context: Context) -> float:
        """The speed along the axis [m/s]."""
        return self._one_v(context, "get_translational_velocity") * self._lead()

    @checked
    def set_translational_velocity(self, context: Context, translation_dot: float) -> ScrewJoint:
        """Sets the speed along the axis [m/s]."""
        rate = self._angle_of("set_translational_velocity", translation_dot)
        return self._write_one_v(context, "set_translational_velocity", rate)

    def get_default_rotation(self) -> float:
        """The angle in a default context [rad]."""
        return float(self._default_q[0])

    @checked
    def set_default_rotation(self, theta: float) -> None:
        """Sets the angle in a default context [rad]."""
        self.set_default_positions([theta])

    def get_default_translation(self) -> float:
        """The translation in a default context [m]."""
        return float(self._default_q[0]) * self._lead()

    @checked
    def set_default_translation(self, z: float) -> None:
        """Sets the translation in a default context [m]."""
        self.set_default_positions([self._angle_of("set_default_translation", z)])

    def set_random_pose_distribution(self, theta: Scalar | Scalars) -> None:
        """Sets the expression from which SetRandomState() draws the angle."""
        self._random_q = distributions("set_random_pose_distribution", "theta", np.atleast_1d(np.asarray(theta)), 1)


class WeldJoint(Joint):
    """Fixes M in F."""

    kTypeName = "weld"

    def __init__(self, name: str, frame_on_parent_F: Frame, frame_on_child_M: Frame, X_FM: RigidTransform):
        super().__init__(name, frame_on_parent_F, frame_on_child_M)
        finite("WeldJoint", "X_FM", X_FM.GetAsMatrix34())
        self._X_FM = X_FM

    def X_FM(self) -> RigidTransform:
        """Where M is in F."""
        return self._X_FM

    def _constants(self) -> tuple[float, ...]:
        return tuple(pose_numbers(self._X_FM))

    def _reversed_constants(self) -> tuple[float, ...]:
        return tuple(pose_numbers(self._X_FM.inverse()))

    def _pose_at(self, q: np.ndarray) -> RigidTransform:
        return self._X_FM
