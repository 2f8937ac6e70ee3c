"""Bodies that float: their poses, velocities and defaults.

Thin calls on the floating joints of such bodies, by body instead of by joint.
"""

from __future__ import annotations

from typing import Any

from sheldrake.common._kinds import anything, instance_of
from sheldrake.common._overloads import incompatible, overload, overloaded
from sheldrake.common.deprecation import _warn_deprecated
from sheldrake.math import RigidTransform
from sheldrake.multibody.tree import ModelInstanceIndex, RigidBody
from sheldrake.multibody.tree._element import finite
from sheldrake.systems.framework import Context


class FreeBodies:
    """Asking and placing free bodies."""

    def _is_floating_base(self, body: RigidBody) -> bool:
        """Whether Finalize() gave the body its floating joint; a floating joint of the user's does not count."""
        step = self._inboard.get(int(body.index()))
        return step is not None and step.joint.is_ephemeral()

    def _has_quaternion(self, body: RigidBody) -> bool:
        step = self._inboard.get(int(body.index()))
        return step is not None and step.joint.type_name() == "quaternion_floating"

    def _free_joint(self, call: str, body: RigidBody) -> Any:
        self._require_finalized(call)
        self._require_mine(call, body)
        step = self._inboard.get(int(body.index()))
        if step is None or step.joint.num_velocities() != 6:
            raise RuntimeError(f"Body '{body.name()}' is not a free body.")
        return step.joint

    def GetFloatingBaseBodies(self) -> set[Any]:
        """Numbers of the bodies that float from the world."""
        self._require_finalized("GetFloatingBaseBodies")
        return {b.index() for b in self._bodies if self._is_floating_base(b)}

    def _bases_of(self, call: str, model_instance: Any) -> list[RigidBody]:
        """Bodies of a model instance that hang on the world, floating or not."""
        self._require_finalized(call)
        self._instances.get(model_instance, call)
        steps = ((b, self._inboard.get(int(b.index()))) for b in self._bodies.of_instance(model_instance))
        return [body for body, step in steps if step is not None and step.parent is self.world_body()]

    def HasUniqueFloatingBaseBody(self, model_instance: ModelInstanceIndex) -> bool:
        """Whether a model instance has exactly one body that hangs on the world, and that one floats."""
        found = self._bases_of("HasUniqueFloatingBaseBody", model_instance)
        return len(found) == 1 and self._is_floating_base(found[0])

    def GetUniqueFloatingBaseBodyOrThrow(self, model_instance: ModelInstanceIndex) -> RigidBody:
        """The one body of a model instance that hangs on the world; it floats.

        Raises:
            RuntimeError: there is none, or more than one, or it does not float.
        """
        found = self._bases_of("GetUniqueFloatingBaseBodyOrThrow", model_instance)
        if len(found) != 1 or not self._is_floating_base(found[0]):
            raise RuntimeError(
                f"GetUniqueFloatingBaseBodyOrThrow(): model instance '{self.GetModelInstanceName(model_instance)}' has "
                f"the base bodies {', '.join(b.name() for b in found) or '(none)'}, not one that floats."
            )
        return found[0]

    HasUniqueFreeBaseBody = HasUniqueFloatingBaseBody
    GetUniqueFreeBaseBodyOrThrow = GetUniqueFloatingBaseBodyOrThrow

    def GetFreeBodyPose(self, context: Any, body: RigidBody) -> Any:
        """Pose of a free body: X_PB in its inboard frame, the world's unless a joint says otherwise."""
        joint = self._free_joint("GetFreeBodyPose", body)
        return joint._pose_at(self._view(context).q[joint._q_start : joint._q_start + joint.num_positions()])

    def SetFreeBodyPose(self, context: Any, body: RigidBody, X_PB: Any = None, *, X_JpJc: Any = None) -> None:
        """Puts a free body at a pose in its inboard frame, the world's unless a joint says otherwise.

        Raises:
            TypeError: the pose is none.
            RuntimeError: the body is not free, or the pose is not finite.
        """
        X = X_PB if X_JpJc is None else X_JpJc
        if not hasattr(X, "GetAsMatrix34"):
            raise incompatible("SetFreeBodyPose", ["(context, body, X_PB: RigidTransform)"], (context, body, X), {})
        self._free_joint("SetFreeBodyPose", body).SetPose(context, X)

    def _set_velocity_in_old_order(self, body: RigidBody, V_PB: Any, context: Any) -> None:
        _warn_deprecated(
            "SetFreeBodySpatialVelocity(): the context comes first today: (context, body, V_JpJc).",
            date="2026-06-01",
            stacklevel=6,
        )
        self._free_joint("SetFreeBodySpatialVelocity", body).SetSpatialVelocity(context, V_PB)

    @overloaded(
        overload(context=instance_of(Context), body=instance_of(RigidBody), V_JpJc=anything),
        overload(_set_velocity_in_old_order, body=instance_of(RigidBody), V_PB=anything, context=anything),
        overload(_set_velocity_in_old_order, body=instance_of(RigidBody), V_WB=anything, context=anything),
    )
    def SetFreeBodySpatialVelocity(self, context: Any, body: RigidBody, V_JpJc: Any) -> None:
        """Gives a free body a spatial velocity in its inboard frame.

        The older order `(body, V_PB, context)` still works, with a warning.

        Args:
            context: Where it is set.
            body: The body.
            V_JpJc: Its velocity.

        Raises:
            RuntimeError: the body is not free, or the velocity is not finite.
        """
        self._free_joint("SetFreeBodySpatialVelocity", body).SetSpatialVelocity(context, V_JpJc)

    def SetFloatingBaseBodyPoseInWorldFrame(self, context: Any, body: RigidBody, X_WB: Any) -> None:
        """Puts a floating base body at X_WB."""
        joint = self._base_joint("SetFloatingBaseBodyPoseInWorldFrame", body)
        X_WF, X_BM = joint.frame_on_parent().CalcPoseInWorld(context), joint.frame_on_child()._X_BF(context)
        joint.SetPose(context, X_WF.InvertAndCompose(X_WB @ X_BM))

    def SetFloatingBaseBodyPoseInAnchoredFrame(self, context: Any, frame_F: Any, body: RigidBody, X_FB: Any) -> None:
        """Puts a floating base body at X_FB of a frame that is fixed to the world."""
        if not self.IsAnchored(frame_F.body()):
            raise RuntimeError(
                f"SetFloatingBaseBodyPoseInAnchoredFrame(): frame {frame_F.name()!r} must be anchored to the world."
            )
        self.SetFloatingBaseBodyPoseInWorldFrame(context, body, frame_F.CalcPoseInWorld(context) @ X_FB)

    def _base_joint(self, call: str, body: RigidBody) -> Any:
        joint = self._free_joint(call, body)
        if not self._is_floating_base(body):
            raise RuntimeError(f"{call}(): Body '{body.name()}' is not a floating base body.")
        return joint

    def SetDefaultFloatingBaseBodyPose(self, body: RigidBody, X_WB: Any) -> None:
        """Sets the pose that a floating base body has in default contexts; before or after Finalize()."""
        self._set_default_free_pose("SetDefaultFloatingBaseBodyPose", body, X_WB)

    def SetDefaultFreeBodyPose(self, body: RigidBody, X_PB: Any) -> None:
        """Sets the pose that a free body has in default contexts; before or after Finalize()."""
        self._set_default_free_pose("SetDefaultFreeBodyPose", body, X_PB)

    def _set_default_free_pose(self, call: str, body: RigidBody, X: Any) -> None:
        self._require_mine(call, body)
        finite(call, "the pose", X.GetAsMatrix34())
        self._default_free_poses[int(body.index())] = X
        step = self._inboard.get(int(body.index())) if self._finalized else None
        if step is not None and step.joint.num_velocities() == 6:
            step.joint.SetDefaultPose(X)

    def GetDefaultFreeBodyPose(self, body: RigidBody) -> Any:
        """The pose that a free body has in default contexts."""
        self._require_mine("GetDefaultFreeBodyPose", body)
        step = self._inboard.get(int(body.index())) if self._finalized else None
        if step is not None and step.joint.num_velocities() == 6:
            return step.joint.GetDefaultPose()
        return self._default_free_poses.get(int(body.index()), RigidTransform())

    def GetDefaultFloatingBaseBodyPose(self, body: RigidBody) -> Any:
        """The pose that a floating base body has in default contexts."""
        return self.GetDefaultFreeBodyPose(body)
