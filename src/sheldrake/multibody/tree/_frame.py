"""Frames: fixed to bodies, where joints attach and poses are measured."""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._overloads import Mismatch, expect
from sheldrake.math import RigidTransform, RigidTransform_, RotationMatrix
from sheldrake.multibody.tree._element import NamedElement, finite_pose, of_scalar
from sheldrake.multibody.tree._index import FrameIndex

if TYPE_CHECKING:
    from sheldrake.multibody.math import SpatialAcceleration, SpatialVelocity
    from sheldrake.multibody.tree._index import ModelInstanceIndex
    from sheldrake.multibody.tree._rigid_body import RigidBody
    from sheldrake.systems.framework import Context


class Frame(NamedElement):
    """A frame F fixed to a body B."""

    _index_type = FrameIndex
    _fixed: RigidTransform | None = None
    """X_BF by default on the plant's scalar, once it was asked for: a frame is fixed when it is made."""

    def __init__(self, name: str, body: RigidBody, model_instance: ModelInstanceIndex | None = None):
        super().__init__(name, body.model_instance() if model_instance is None else model_instance)
        self._body = body

    def body(self) -> RigidBody:
        """The RigidBody it is fixed to."""
        return self._body

    def is_world_frame(self) -> bool:
        """Whether it is the frame of the world body."""
        return self.is_body_frame() and int(self._body.index()) == 0

    def is_body_frame(self) -> bool:
        """Whether it is the frame of a body itself."""
        return False

    # --- where it is on its body

    def _X_BF(self, context: Context) -> RigidTransform:
        raise NotImplementedError

    def CalcPoseInBodyFrame(self, context: Context) -> RigidTransform:
        """X_BF."""
        T = self._finalized("CalcPoseInBodyFrame").contexts.view(context).T
        return of_scalar(self._X_BF(context), T)

    def CalcRotationMatrixInBodyFrame(self, context: Context) -> RotationMatrix:
        """R_BF."""
        return self.CalcPoseInBodyFrame(context).rotation()

    def _fixed_X_BF(self) -> RigidTransform:
        """X_BF by default, in floats."""
        raise NotImplementedError

    def GetFixedPoseInBodyFrame(self) -> RigidTransform:
        """X_BF by default; a context may hold another one."""
        X_BF = self._fixed
        if X_BF is None or X_BF._T is not self._scalar:
            X_BF = self._fixed = of_scalar(self._fixed_X_BF(), self._scalar)
        return copy.copy(X_BF)

    def GetFixedRotationMatrixInBodyFrame(self) -> RotationMatrix:
        """R_BF by default."""
        return self.GetFixedPoseInBodyFrame().rotation()

    @checked
    def GetFixedOffsetPoseInBody(self, X_FQ: RigidTransform) -> RigidTransform:
        """X_BQ of a frame Q given in F, by default."""
        return self.GetFixedPoseInBodyFrame() @ X_FQ

    @checked
    def GetFixedRotationMatrixInBody(self, R_FQ: RotationMatrix) -> RotationMatrix:
        """R_BQ of a frame Q given in F, by default."""
        return self.GetFixedRotationMatrixInBodyFrame() @ R_FQ

    @checked
    def CalcOffsetPoseInBody(self, context: Context, X_FQ: RigidTransform) -> RigidTransform:
        """X_BQ of a frame Q given in F."""
        return self.CalcPoseInBodyFrame(context) @ X_FQ

    @checked
    def CalcOffsetRotationMatrixInBody(self, context: Context, R_FQ: RotationMatrix) -> RotationMatrix:
        """R_BQ of a frame Q given in F."""
        return self.CalcRotationMatrixInBodyFrame(context) @ R_FQ

    # --- where it is

    def CalcPoseInWorld(self, context: Context) -> RigidTransform:
        """X_WF."""
        return self._finalized("CalcPoseInWorld").kinematics.pose_of_frame(context, self)

    def CalcPose(self, context: Context, frame_M: Frame) -> RigidTransform:
        """X_MF: this frame F in another frame M."""
        kinematics = self._finalized("CalcPose").kinematics
        return kinematics.CalcRelativeTransform(context, expect("CalcPose", frame_M, Frame), self)

    def CalcRotationMatrixInWorld(self, context: Context) -> RotationMatrix:
        """R_WF."""
        return self.CalcPoseInWorld(context).rotation()

    def CalcRotationMatrix(self, context: Context, frame_M: Frame) -> RotationMatrix:
        """R_MF."""
        return self.CalcPose(context, frame_M).rotation()

    # --- how it moves

    def EvalAngularVelocityInWorld(self, context: Context) -> np.ndarray:
        """w_WF expressed in W [rad/s], shape (3,)."""
        return self.CalcSpatialVelocityInWorld(context).rotational().copy()

    @checked
    def CalcAngularVelocity(self, context: Context, measured_in_frame: Frame, expressed_in_frame: Frame) -> np.ndarray:
        """w_MF expressed in E [rad/s], shape (3,)."""
        return self.CalcSpatialVelocity(context, measured_in_frame, expressed_in_frame).rotational().copy()

    def CalcSpatialVelocityInWorld(self, context: Context) -> SpatialVelocity:
        """V_WF expressed in W, a SpatialVelocity."""
        return self._finalized("CalcSpatialVelocityInWorld").kinematics.velocity_of_frame(context, self)

    @checked
    def CalcSpatialVelocity(self, context: Context, frame_M: Frame, frame_E: Frame) -> SpatialVelocity:
        """V_MF expressed in E, a SpatialVelocity."""
        kinematics = self._finalized("CalcSpatialVelocity").kinematics
        M, E = expect("CalcSpatialVelocity", frame_M, Frame), expect("CalcSpatialVelocity", frame_E, Frame)
        return kinematics.relative_velocity(context, self, M, E)

    @checked
    def CalcRelativeSpatialVelocityInWorld(self, context: Context, other_frame: Frame) -> SpatialVelocity:
        """V_WF - V_WB of another frame B, expressed in W."""
        kinematics = self._finalized("CalcRelativeSpatialVelocityInWorld").kinematics
        other = expect("CalcRelativeSpatialVelocityInWorld", other_frame, Frame)
        return kinematics.velocity_of_frame(context, self) - kinematics.velocity_of_frame(context, other)

    @checked
    def CalcRelativeSpatialVelocity(
        self, context: Context, other_frame: Frame, measured_in_frame: Frame, expressed_in_frame: Frame
    ) -> SpatialVelocity:
        """V_MF - V_MB of another frame B, expressed in E."""
        return self.CalcSpatialVelocity(
            context, measured_in_frame, expressed_in_frame
        ) - other_frame.CalcSpatialVelocity(context, measured_in_frame, expressed_in_frame)

    def CalcSpatialAccelerationInWorld(self, context: Context) -> SpatialAcceleration:
        """A_WF expressed in W, a SpatialAcceleration."""
        return self._finalized("CalcSpatialAccelerationInWorld").accelerations.of_point(context, ORIGIN, self)

    @checked
    def CalcSpatialAcceleration(
        self, context: Context, measured_in_frame: Frame, expressed_in_frame: Frame
    ) -> SpatialAcceleration:
        """A_MF expressed in E, a SpatialAcceleration."""
        call, owner = "CalcSpatialAcceleration", self._finalized("CalcSpatialAcceleration")
        M, E = expect(call, measured_in_frame, Frame), expect(call, expressed_in_frame, Frame)
        return owner.accelerations.of_point(context, ORIGIN, self, M, E)

    @checked
    def CalcRelativeSpatialAccelerationInWorld(self, context: Context, other_frame: Frame) -> SpatialAcceleration:
        """A_WF - A_WB of another frame B, expressed in W."""
        self._finalized("CalcRelativeSpatialAccelerationInWorld")
        other = expect("CalcRelativeSpatialAccelerationInWorld", other_frame, Frame)
        return self.CalcSpatialAccelerationInWorld(context) - other.CalcSpatialAccelerationInWorld(context)

    @checked
    def CalcRelativeSpatialAcceleration(
        self, context: Context, other_frame: Frame, measured_in_frame: Frame, expressed_in_frame: Frame
    ) -> SpatialAcceleration:
        """A_MF - A_MB of another frame B, expressed in E."""
        return self.CalcSpatialAcceleration(
            context, measured_in_frame, expressed_in_frame
        ) - other_frame.CalcSpatialAcceleration(context, measured_in_frame, expressed_in_frame)


ORIGIN = np.zeros(3)
"""The point of a frame that most motions are of."""
ORIGIN.flags.writeable = False


class RigidBodyFrame(Frame):
    """The frame of a body."""

    def __init__(self, body: RigidBody):
        super().__init__(body.name(), body)

    def is_body_frame(self) -> bool:
        """True."""
        return True

    def CalcPoseInBodyFrame(self, context: Context) -> RigidTransform:
        """That of two aligned frames."""
        return RigidTransform_[self._finalized("CalcPoseInBodyFrame").contexts.view(context).T]()

    def _X_BF(self, context: Context) -> RigidTransform:
        return RigidTransform()

    def _fixed_X_BF(self) -> RigidTransform:
        return RigidTransform()


class FixedOffsetFrame(Frame):
    """A frame F at a fixed pose in another frame P of the same body; the pose is a parameter of the context."""

    def __init__(
        self,
        name: str,
        P: Frame | RigidBody | None = None,
        X_PF: RigidTransform | None = None,
        model_instance: ModelInstanceIndex | None = None,
        **retired: Any,
    ):
        """
        Args:
            name: Name of the frame.
            P: The frame it is fixed to, or a RigidBody (then also named `bodyB`).
            X_PF: Its pose in P (also named `X_BF`).
            model_instance: Where it belongs; by default that of P.
        """
        P = retired.pop("bodyB", P)
        X_PF = retired.pop("X_BF", X_PF)
        if retired or P is None or not isinstance(X_PF, RigidTransform):
            raise Mismatch(
                "FixedOffsetFrame(): incompatible constructor arguments. Takes (name: str, P: Frame, X_PF: "
                "RigidTransform, model_instance: ModelInstanceIndex = None) or (name: str, bodyB: RigidBody, X_BF: "
                "RigidTransform)."
            )
        parent = P if isinstance(P, Frame) else P.body_frame()
        super().__init__(name, parent.body(), parent.model_instance() if model_instance is None else model_instance)
        self._parent, self._X_PF = parent, finite_pose("FixedOffsetFrame", "X_PF", X_PF)

    def _fixed_X_BF(self) -> RigidTransform:
        return self._parent._fixed_X_BF() @ self._X_PF

    def _X_BF(self, context: Context) -> RigidTransform:
        X_PF = self.GetPoseInParentFrame(context)
        return X_PF if self._parent.is_body_frame() else self._parent._X_BF(context) @ X_PF

    def GetPoseInParentFrame(self, context: Context) -> RigidTransform:
        """X_PF as the context has it."""
        owner = self._finalized("GetPoseInParentFrame")
        return owner.contexts.transform(context, owner.contexts.numbers(context, self._group))

    @checked
    def SetPoseInParentFrame(self, context: Context, X_PF: RigidTransform) -> None:
        """Changes X_PF in a context."""
        owner = self._finalized("SetPoseInParentFrame")
        owner.contexts.write_numbers(context, self._group, pose_numbers(X_PF))


def pose_numbers(X: RigidTransform) -> np.ndarray:
    """The twelve parameters of a pose: R row by row, then p."""
    return np.concatenate([X._R._M.ravel(), X._p])
