"""Joints of six degrees of freedom.

A plant gives the one with a quaternion to each body that no joint holds; the one with angles is for those who add it.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._rotations import matrix_to_canonical_quaternion, numbers_to_matrix
from sheldrake.common.eigen_geometry import Quaternion, Quaternion_
from sheldrake.math import RigidTransform, RigidTransform_, RollPitchYaw_, RotationMatrix
from sheldrake.multibody.tree._element import default_values, distributions, scalar_of, vector
from sheldrake.multibody.tree._frame import Frame
from sheldrake.multibody.tree._joint import Joint
from sheldrake.symbolic import Expression

if TYPE_CHECKING:
    from typing_extensions import Self

    from sheldrake.common._types import Scalars, Vector
    from sheldrake.multibody.math import SpatialVelocity
    from sheldrake.systems.framework import Context


def _unit_quaternion(q: np.ndarray) -> Quaternion:
    return Quaternion_[scalar_of(q)](wxyz=q / np.sqrt(q @ q))


class _FloatingJoint(Joint):
    """M moves freely in F; velocities are w_FM and v_FM, expressed in F."""

    _p_start = 0

    def __init__(
        self,
        name: str,
        frame_on_parent: Frame,
        frame_on_child: Frame,
        angular_damping: float = 0.0,
        translational_damping: float = 0.0,
    ):
        """
        Args:
            name: Its name.
            frame_on_parent: F.
            frame_on_child: M.
            angular_damping: Viscous damping of w_FM [N m s].
            translational_damping: Viscous damping of v_FM [N s/m].
        """
        super().__init__(name, frame_on_parent, frame_on_child, [angular_damping] * 3 + [translational_damping] * 3)

    def _rotation_positions(self, R: RotationMatrix) -> Vector:
        raise NotImplementedError

    def _positions_of_pose(self, call: str, X_FM: RigidTransform) -> Vector:
        return [*self._rotation_positions(X_FM.rotation()), *X_FM.translation().tolist()]

    def _velocities_of(self, V_FM: SpatialVelocity) -> Vector:
        return V_FM.get_coeffs()

    def default_angular_damping(self) -> float:
        """Viscous damping of w_FM [N m s]."""
        return float(self._damping[0])

    def default_translational_damping(self) -> float:
        """Viscous damping of v_FM [N s/m]."""
        return float(self._damping[3])

    def get_translation(self, context: Context) -> np.ndarray:
        """p_FM [m], shape (3,)."""
        return self._q(context, "get_translation")[self._p_start :]

    def SetTranslation(self, context: Context, p_FM: Scalars) -> Self:
        """Moves M's origin to p_FM [m]."""
        return self._write_q(context, "SetTranslation", vector("SetTranslation", "p_FM", p_FM, 3), self._p_start)

    def get_angular_velocity(self, context: Context) -> np.ndarray:
        """w_FM expressed in F [rad/s], shape (3,)."""
        return self._velocities(context, "get_angular_velocity")[:3]

    def set_angular_velocity(self, context: Context, w_FM: Scalars) -> Self:
        """Sets w_FM expressed in F [rad/s]."""
        return self._write_v(context, "set_angular_velocity", vector("set_angular_velocity", "w_FM", w_FM, 3))

    def get_translational_velocity(self, context: Context) -> np.ndarray:
        """v_FM expressed in F [m/s], shape (3,)."""
        return self._velocities(context, "get_translational_velocity")[3:]

    def set_translational_velocity(self, context: Context, v_FM: Scalars) -> Self:
        """Sets v_FM expressed in F [m/s]."""
        call = "set_translational_velocity"
        return self._write_v(context, call, vector(call, "v_FM", v_FM, 3), 3)

    def get_default_translation(self) -> np.ndarray:
        """p_FM in a default context [m], shape (3,)."""
        return self._default_q[self._p_start :].copy()

    def _set_default_translation(self, p_FM: Scalars) -> None:
        call = "set_default_translation"
        self._default_q[self._p_start :] = default_values(call, "p_FM", p_FM, 3)


class QuaternionFloatingJoint(_FloatingJoint):
    """Positions are a quaternion (w, x, y, z), of any length, and p_FM."""

    kTypeName = "quaternion_floating"
    _p_start = 4

    def _zero_positions(self) -> np.ndarray:
        return np.array([1.0, 0, 0, 0, 0, 0, 0])

    def _rotation_positions(self, R: RotationMatrix) -> Vector:
        return matrix_to_canonical_quaternion(R._M)

    def _pose_at(self, q: np.ndarray) -> RigidTransform:
        wxyz = q[:4]
        squared = wxyz @ wxyz
        if q.dtype == object or not 0.0 < squared < math.inf:
            if scalar_of(q) is not Expression and all(x == 0.0 for x in wxyz):
                raise RuntimeError(
                    "GetPose(): all elements of a quaternion are zero, which is no rotation, at the joint "
                    f"{self.name()!r}; without rotation it is (1, 0, 0, 0)."
                )
            return RigidTransform_[scalar_of(q)](_unit_quaternion(wxyz), q[4:])
        length = math.sqrt(squared)  # of unit length: nothing is left to check
        w, x, y, z = wxyz.tolist()
        return RigidTransform._make(numbers_to_matrix(w / length, x / length, y / length, z / length), q[4:].copy())

    @checked
    def SetPose(self, context: Context, X_FM: RigidTransform) -> Self:
        """Sets the positions that put M at X_FM."""
        contexts = self._finalized("SetPose").contexts
        if type(X_FM) is RigidTransform and contexts.write(context, "pose", self._q_start, X_FM._R._M, X_FM._p):
            return self
        return super().SetPose(context, X_FM)

    @checked
    def SetOrientation(self, context: Context, R: RotationMatrix) -> Self:
        """Turns M to R, which is R_FM."""
        return self._write_q(context, "SetOrientation", self._rotation_positions(R))

    def get_quaternion(self, context: Context) -> Quaternion:
        """The quaternion as the positions have it, which may be of any length."""
        q = self._q(context, "get_quaternion")
        return Quaternion_[scalar_of(q)]._make(q[:4].copy())

    @checked
    def SetQuaternion(self, context: Context, q_FM: Quaternion) -> QuaternionFloatingJoint:
        """Sets the quaternion."""
        return self._write_q(context, "SetQuaternion", q_FM.wxyz())

    def get_default_quaternion(self) -> Quaternion:
        """The quaternion in a default context."""
        return Quaternion._make(self._default_q[:4].copy())

    @checked
    def set_default_quaternion(self, q_FM: Quaternion) -> None:
        """Sets the quaternion in a default context."""
        self._default_q[:4] = q_FM.wxyz()

    def set_default_translation(self, translation: Scalars) -> None:
        """Sets p_FM in a default context [m]."""
        self._set_default_translation(translation)

    @checked
    def set_random_quaternion_distribution(self, q_FM: Quaternion) -> None:
        """Sets the quaternion of expressions from which SetRandomState() draws."""
        self._random_q = [*q_FM.wxyz(), *(self._random_q or list(self._default_q))[4:]]

    def set_random_quaternion_distribution_to_uniform(self) -> None:
        """Makes SetRandomState() draw uniformly distributed rotations."""
        self._random_q = ["uniform", None, None, None, *(self._random_q or list(self._default_q))[4:]]

    def set_random_translation_distribution(self, translation: Scalars) -> None:
        """Sets the expressions from which SetRandomState() draws p_FM."""
        call = "set_random_translation_distribution"
        self._random_q = [
            *(self._random_q or list(self._default_q))[:4],
            *distributions(call, "translation", translation, 3),
        ]


class RpyFloatingJoint(_FloatingJoint):
    """Positions are roll, pitch, yaw of R_FM (space-fixed x-y-z) and p_FM."""

    kTypeName = "rpy_floating"
    _p_start = 3

    def _rotation_positions(self, R: RotationMatrix) -> Vector:
        return RollPitchYaw_[R._T](R).vector().tolist()

    def _pose_at(self, q: np.ndarray) -> RigidTransform:
        T = scalar_of(q)
        return RigidTransform_[T](RollPitchYaw_[T](q[:3]), q[3:])

    @checked
    def SetOrientation(self, context: Context, R_FM: RotationMatrix) -> Self:
        """Turns M to R_FM."""
        return self._write_q(context, "SetOrientation", self._rotation_positions(R_FM))

    def get_angles(self, context: Context) -> np.ndarray:
        """Roll, pitch, yaw [rad], shape (3,)."""
        return self._q(context, "get_angles")[:3]

    def set_angles(self, context: Context, angles: Scalars) -> RpyFloatingJoint:
        """Sets roll, pitch, yaw [rad]."""
        return self._write_q(context, "set_angles", vector("set_angles", "angles", angles, 3))

    def get_default_angles(self) -> np.ndarray:
        """Roll, pitch, yaw in a default context [rad], shape (3,)."""
        return self._default_q[:3].copy()

    def set_default_angles(self, angles: Scalars) -> None:
        """Sets roll, pitch, yaw in a default context [rad]."""
        call = "set_default_angles"
        self._default_q[:3] = default_values(call, "angles", angles, 3)

    def set_default_translation(self, p_FM: Scalars) -> None:
        """Sets p_FM in a default context [m]."""
        self._set_default_translation(p_FM)

    def set_random_angles_distribution(self, angles: Scalars) -> None:
        """Sets the expressions from which SetRandomState() draws the angles."""
        call = "set_random_angles_distribution"
        self._random_q = [*distributions(call, "angles", angles, 3), *(self._random_q or list(self._default_q))[3:]]

    def set_random_translation_distribution(self, p_FM: Scalars) -> None:
        """Sets the expressions from which SetRandomState() draws p_FM."""
        call = "set_random_translation_distribution"
        self._random_q = [*(self._random_q or list(self._default_q))[:3], *distributions(call, "p_FM", p_FM, 3)]
