"""Bodies that float: their poses, velocities and defaults.

Thin calls on the floating joints of such bodies, by body instead of by joint.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from sheldrake.common._checked import checked
from sheldrake.common._kinds import anything, instance_of
from sheldrake.common._overloads import expect, incompatible, overload, overloaded
from sheldrake.common.deprecation import _warn_of_retired
from sheldrake.math import RigidTransform
from sheldrake.multibody.math._spatial_vectors import SpatialVector
from sheldrake.multibody.plant._building.elements import Elements
from sheldrake.multibody.plant._building.topology import Topology
from sheldrake.multibody.plant._context.kinematics import Kinematics
from sheldrake.multibody.plant._enums import BaseBodyJointType
from sheldrake.multibody.tree import (
    BodyIndex,
    Frame,
    Joint,
    ModelInstanceIndex,
    QuaternionFloatingJoint,
    RigidBody,
    RpyFloatingJoint,
    WeldJoint,
)
from sheldrake.multibody.tree._element import finite
from sheldrake.systems.framework import Context

if TYPE_CHECKING:
    from sheldrake.multibody.math._spatial_vectors import SpatialVelocity


class FreeBodies:
    """Asking and placing free bodies.

    Args:
        elements: The bodies and the joints by which they float.
        topology: Tells which frames are anchored.
        kinematics: Tells where they are.
    """

    def __init__(self, elements: Elements, topology: Topology, kinematics: Kinematics) -> None:
        self._elements, self._topology, self._kinematics = elements, topology, kinematics
        self.default_poses: dict[int, RigidTransform] = {}
        """Of free bodies, by number."""
        self._joint_types: dict[ModelInstanceIndex | None, BaseBodyJointType] = {
            None: BaseBodyJointType.kQuaternionFloatingJoint
        }
        self._joints: dict[RigidBody, Joint] = {}  # by which free bodies float, once they were asked for

    @checked
    def SetBaseBodyJointType(
        self, joint_type: BaseBodyJointType, model_instance: ModelInstanceIndex | None = None
    ) -> None:
        """Chooses how Finalize() holds bodies to the world that no joint holds; a weld leaves default poses aside.

        Args:
            joint_type: Which joint they get.
            model_instance: Whose bodies; None: of all model instances for which nothing else is chosen.

        Raises:
            RuntimeError: the plant is finalized, or there is no such model instance.
        """
        call = "SetBaseBodyJointType"
        self._elements.require_not_finalized(call)
        if model_instance is not None:
            self._elements.require_instance(call, model_instance)
        self._joint_types[model_instance] = joint_type

    @checked
    def GetBaseBodyJointType(self, model_instance: ModelInstanceIndex | None = None) -> BaseBodyJointType:
        """How Finalize() holds bodies of a model instance to the world that no joint holds; None: in general."""
        return self._joint_types.get(model_instance, self._joint_types[None])

    def base_joint(self, name: str, body: RigidBody) -> Joint:
        """The joint that holds a body to the world because no other does."""
        kind = self.GetBaseBodyJointType(body.model_instance())
        frames = self._elements.world.body_frame(), body.body_frame()
        if kind is BaseBodyJointType.kWeldJoint:
            return WeldJoint(name, *frames, RigidTransform())
        is_rpy = kind is BaseBodyJointType.kRpyFloatingJoint
        joint = RpyFloatingJoint(name, *frames) if is_rpy else QuaternionFloatingJoint(name, *frames)
        if int(body.index()) in self.default_poses:
            joint.SetDefaultPose(self.default_poses[int(body.index())])
        return joint

    def _free_joint(self, call: str, body: RigidBody) -> Joint:
        found = self._joints.get(body)
        if found is not None:
            return found
        expect(call, body, RigidBody)
        model = self._elements.model(call)
        self._elements.require_mine(call, body)
        step = model.inboard_of(body)
        if step is None or step.joint.num_velocities() != 6:
            raise RuntimeError(f"Body '{body.name()}' is not a free body.")
        self._joints[body] = step.joint
        return step.joint

    def GetFloatingBaseBodies(self) -> set[BodyIndex]:
        """Numbers of the bodies that float from the world."""
        self._elements.require_finalized("GetFloatingBaseBodies")
        return {b.index() for b in self._elements.bodies if self._elements.is_floating_base(b)}

    def _bases_of(self, call: str, model_instance: ModelInstanceIndex) -> list[RigidBody]:
        """Bodies of a model instance that hang on the world, floating or not."""
        model = self._elements.model(call)
        self._elements.require_instance(call, model_instance)
        steps = ((b, model.inboard_of(b)) for b in self._elements.bodies.of_instance(model_instance))
        return [body for body, step in steps if step is not None and step.parent is self._elements.world]

    @checked
    def HasUniqueFloatingBaseBody(self, model_instance: ModelInstanceIndex) -> bool:
        """Whether a model instance has exactly one body that hangs on the world, and that one floats."""
        found = self._bases_of("HasUniqueFloatingBaseBody", model_instance)
        return len(found) == 1 and self._elements.is_floating_base(found[0])

    @checked
    def GetUniqueFloatingBaseBodyOrThrow(self, model_instance: ModelInstanceIndex) -> RigidBody:
        """The one body of a model instance that hangs on the world; it floats.

        Raises:
            RuntimeError: there is none, or more than one, or it does not float.
        """
        call = "GetUniqueFloatingBaseBodyOrThrow"
        found = self._bases_of(call, model_instance)
        if len(found) != 1 or not self._elements.is_floating_base(found[0]):
            raise RuntimeError(
                f"{call}(): model instance '{self._elements.instances.get(model_instance, call).name()}' "
                f"has the base bodies {', '.join(b.name() for b in found) or '(none)'}, not one that floats."
            )
        return found[0]

    @checked
    def HasUniqueFreeBaseBody(self, model_instance: ModelInstanceIndex) -> bool:
        """The retired name of `HasUniqueFloatingBaseBody`."""
        _warn_of_retired("HasUniqueFreeBaseBody()", "HasUniqueFloatingBaseBody()")
        return self.HasUniqueFloatingBaseBody(model_instance)

    @checked
    def GetUniqueFreeBaseBodyOrThrow(self, model_instance: ModelInstanceIndex) -> RigidBody:
        """The retired name of `GetUniqueFloatingBaseBodyOrThrow`."""
        _warn_of_retired("GetUniqueFreeBaseBodyOrThrow()", "GetUniqueFloatingBaseBodyOrThrow()")
        return self.GetUniqueFloatingBaseBodyOrThrow(model_instance)

    def GetFreeBodyPose(self, context: Context, body: RigidBody) -> RigidTransform:
        """Pose of a free body: X_PB in its inboard frame, the world's unless a joint says otherwise."""
        joint = self._joints.get(body) or self._free_joint("GetFreeBodyPose", body)
        X_FM = self._kinematics.CalcRelativeTransform(context, joint._F, joint._M)
        first = X_FM._R._M.item(0)
        return joint.GetPose(context) if type(first) is float and first != first else X_FM  # which says what is wrong

    def SetFreeBodyPose(
        self,
        context: Context,
        body: RigidBody,
        X_JpJc: RigidTransform | None = None,
        *,
        X_PB: RigidTransform | None = None,
    ) -> None:
        """Puts a free body at a pose in its inboard frame, the world's unless a joint says otherwise.

        Args:
            context: Where it is set.
            body: The body.
            X_JpJc: Its pose.
            X_PB: The retired name of `X_JpJc`.

        Raises:
            TypeError: the pose is none.
            RuntimeError: the body is not free, or the pose is not finite.
        """
        X = X_PB if X_JpJc is None else X_JpJc
        if X is None or not hasattr(X, "GetAsMatrix34") or (X_PB is not None and X_JpJc is not None):
            raise incompatible("SetFreeBodyPose", ["(context, body, X_JpJc: RigidTransform)"], (context, body, X), {})
        if X_PB is not None:
            _warn_of_retired("X_PB of SetFreeBodyPose()", "X_JpJc")
        self._free_joint("SetFreeBodyPose", body).SetPose(context, X)

    def _set_velocity_in_old_order(self, body: RigidBody, V_PB: SpatialVelocity, context: Context) -> None:
        _warn_of_retired("SetFreeBodySpatialVelocity(body, V_PB, context)", "(context, body, V_JpJc)")
        self._free_joint("SetFreeBodySpatialVelocity", body).SetSpatialVelocity(context, V_PB)

    @overloaded(
        overload(context=instance_of(Context), body=instance_of(RigidBody), V_JpJc=instance_of(SpatialVector)),
        overload(_set_velocity_in_old_order, body=instance_of(RigidBody), V_PB=anything, context=anything),
        overload(_set_velocity_in_old_order, body=instance_of(RigidBody), V_WB=anything, context=anything),
    )
    def SetFreeBodySpatialVelocity(self, context: Context, body: RigidBody, V_JpJc: SpatialVelocity) -> None:
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

    @checked
    def SetFloatingBaseBodyPoseInWorldFrame(self, context: Context, body: RigidBody, X_WB: Any) -> None:
        """Puts a floating base body at X_WB."""
        joint = self._base_joint("SetFloatingBaseBodyPoseInWorldFrame", body)
        X_WF, X_BM = joint.frame_on_parent().CalcPoseInWorld(context), joint.frame_on_child()._X_BF(context)
        joint.SetPose(context, X_WF.InvertAndCompose(X_WB @ X_BM))

    @checked
    def SetFloatingBaseBodyPoseInAnchoredFrame(
        self, context: Context, frame_F: Frame, body: RigidBody, X_FB: Any
    ) -> None:
        """Puts a floating base body at X_FB of a frame that is fixed to the world."""
        if not self._topology.IsAnchored(frame_F.body()):
            raise RuntimeError(
                f"SetFloatingBaseBodyPoseInAnchoredFrame(): frame {frame_F.name()!r} must be anchored to the world."
            )
        self.SetFloatingBaseBodyPoseInWorldFrame(context, body, frame_F.CalcPoseInWorld(context) @ X_FB)

    def _base_joint(self, call: str, body: RigidBody) -> Joint:
        joint = self._free_joint(call, body)
        if not self._elements.is_floating_base(body):
            raise RuntimeError(f"{call}(): Body '{body.name()}' is not a floating base body.")
        return joint

    @checked
    def SetDefaultFloatingBaseBodyPose(self, body: RigidBody, X_WB: RigidTransform) -> None:
        """Sets the pose that a floating base body has in default contexts; before or after Finalize()."""
        self._set_default_free_pose("SetDefaultFloatingBaseBodyPose", body, X_WB)

    def SetDefaultFreeBodyPose(self, body: RigidBody, X_PB: RigidTransform) -> None:
        """The retired name of `SetDefaultFloatingBaseBodyPose`."""
        _warn_of_retired("SetDefaultFreeBodyPose()", "SetDefaultFloatingBaseBodyPose()")
        self._set_default_free_pose("SetDefaultFreeBodyPose", body, X_PB)

    def _set_default_free_pose(self, call: str, body: RigidBody, X: RigidTransform) -> None:
        self._elements.require_mine(call, body)
        finite(call, "the pose", expect(call, X, RigidTransform).GetAsMatrix34())
        self.default_poses[int(body.index())] = X
        if (joint := self._made_joint(call, body)) is not None:
            joint.SetDefaultPose(X)

    def _made_joint(self, call: str, body: RigidBody) -> Joint | None:
        """The joint by which a free body floats, after Finalize()."""
        step = self._elements.model(call).inboard_of(body) if self._elements.is_finalized() else None
        return step.joint if step is not None and step.joint.num_velocities() == 6 else None

    @checked
    def GetDefaultFloatingBaseBodyPose(self, body: RigidBody) -> RigidTransform:
        """The pose that a floating base body has in default contexts."""
        return self._default_free_pose("GetDefaultFloatingBaseBodyPose", body)

    @checked
    def GetDefaultFreeBodyPose(self, body: RigidBody) -> RigidTransform:
        """The retired name of `GetDefaultFloatingBaseBodyPose`."""
        _warn_of_retired("GetDefaultFreeBodyPose()", "GetDefaultFloatingBaseBodyPose()")
        return self._default_free_pose("GetDefaultFreeBodyPose", body)

    def _default_free_pose(self, call: str, body: RigidBody) -> RigidTransform:
        self._elements.require_mine(call, body)
        if (joint := self._made_joint(call, body)) is not None:
            return joint.GetDefaultPose()
        return self.default_poses.get(int(body.index()), RigidTransform())
