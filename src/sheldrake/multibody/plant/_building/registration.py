"""Building a plant: model instances, bodies, frames and joints, and looking them up."""

from __future__ import annotations

from typing import Any

from sheldrake.math import RigidTransform
from sheldrake.multibody.math import SpatialInertia
from sheldrake.multibody.plant._building.registry import ModelInstances, Registry
from sheldrake.multibody.tree import (
    BodyIndex,
    FixedOffsetFrame,
    ForceElement,
    ForceElementIndex,
    Frame,
    FrameIndex,
    Joint,
    JointActuator,
    JointActuatorIndex,
    JointIndex,
    ModelInstanceIndex,
    RigidBody,
    UniformGravityFieldElement,
    WeldJoint,
    default_model_instance,
    world_model_instance,
)
from sheldrake.multibody.tree._rigid_body import body_arguments


class Registration:
    """The elements of a plant."""

    def _start_registration(self) -> None:
        self._finalized = False
        self._instances = ModelInstances()
        self._instances.add_named("WorldModelInstance")
        self._instances.add_named("DefaultModelInstance")
        self._bodies: Registry[RigidBody] = Registry("RigidBody", "body", BodyIndex, self._instances)
        self._frames: Registry[Frame] = Registry("Frame", "frame", FrameIndex, self._instances)
        self._joints: Registry[Joint] = Registry("Joint", "joint", JointIndex, self._instances)
        self._joint_between: dict[frozenset[RigidBody], Joint] = {}
        self._actuators: Registry[JointActuator] = Registry(
            "JointActuator", "joint actuator", JointActuatorIndex, self._instances
        )
        self._force_elements: Registry[ForceElement] = Registry(
            "ForceElement", "force element", ForceElementIndex, self._instances
        )
        self._add_body(RigidBody("world", world_model_instance(), SpatialInertia.NaN()))
        self._gravity = UniformGravityFieldElement()
        self._gravity._adopt(self, self._force_elements.add(self._gravity, None))

    # --- when

    def is_finalized(self) -> bool:
        """Whether Finalize() was called."""
        return self._finalized

    def _require_finalized(self, call: str) -> None:
        if not self._finalized:
            raise RuntimeError(f"{call}(): this plant is pre-finalize; it answers once Finalize() is called.")

    def _require_not_finalized(self, call: str) -> None:
        if self._finalized:
            raise RuntimeError(
                f"{call}(): this plant is post-finalize; its bodies and joints stay as they were at Finalize()."
            )

    # --- model instances

    def AddModelInstance(self, name: str) -> ModelInstanceIndex:
        """A new model instance.

        Raises:
            RuntimeError: the name is taken, or the plant is finalized.
        """
        self._require_not_finalized("AddModelInstance")
        return self._instances.add_named(name)

    def RenameModelInstance(self, model_instance: ModelInstanceIndex, name: str) -> None:
        """Gives a model instance another name."""
        self._require_not_finalized("RenameModelInstance")
        instance = self._instances.get(model_instance, "RenameModelInstance")
        if name == instance.name():
            return
        if any(m.name() == name for m in self._instances):
            raise RuntimeError(
                f"RenameModelInstance(): cannot rename model instance '{instance.name()}': there is already a model "
                f"instance named '{name}'."
            )
        instance._name = name

    def num_model_instances(self) -> int:
        """Number of model instances, those of the world and the default one included."""
        return len(self._instances.slots)

    def HasModelInstanceNamed(self, name: str) -> bool:
        """Whether there is a model instance of this name."""
        return any(m.name() == name for m in self._instances)

    def GetModelInstanceByName(self, name: str) -> ModelInstanceIndex:
        """The model instance of a name.

        Raises:
            RuntimeError: there is none.
        """
        return self._instances.index_of("GetModelInstanceByName", name)

    def GetModelInstanceName(self, model_instance: ModelInstanceIndex) -> str:
        """Name of a model instance."""
        return self._instances.get(model_instance, "GetModelInstanceName").name()

    def _checked_instance(self, model_instance: Any) -> ModelInstanceIndex:
        if not self._instances.has(model_instance):
            raise RuntimeError("Invalid model instance specified.")
        return model_instance

    # --- bodies

    def AddRigidBody(self, name: str, *args: Any, **kwargs: Any) -> RigidBody:
        """Adds a body.

        Args:
            name: Unique in its model instance.
            args: `[model_instance], [M_BBo_B]`: where it belongs (the default instance when left out) and its spatial
                inertia about its origin (zero when left out).
            kwargs: The same by name.

        Raises:
            RuntimeError: the name is taken, the inertia not valid, the model instance unknown or left out though there
                are others than the default one, or the plant is finalized.
        """
        self._require_not_finalized("AddRigidBody")
        model_instance, inertia = body_arguments("AddRigidBody", args, kwargs)
        if model_instance is None and self.num_model_instances() > 2:
            raise RuntimeError(
                "This model has more model instances than the default. Please call AddRigidBody with an explicit model "
                "instance."
            )
        instance = default_model_instance() if model_instance is None else self._checked_instance(model_instance)
        return self._add_body(RigidBody(name, instance, inertia))

    def _add_body(self, body: RigidBody) -> RigidBody:
        self._bodies.check_free(body.name(), body.model_instance())
        body._adopt(self, self._bodies.add(body, body.name()))
        frame = body.body_frame()
        frame._adopt(self, self._frames.add(frame, frame.name()))
        self._register_frame(body)
        return body

    def num_bodies(self) -> int:
        """Number of bodies, the world included."""
        return len(self._bodies)

    def world_body(self) -> RigidBody:
        """The world."""
        return self._bodies.slots[0]  # type: ignore[return-value]

    def get_body(self, body_index: BodyIndex) -> RigidBody:
        """The body of a number."""
        return self._bodies.get(body_index, "get_body")

    def has_body(self, body_index: BodyIndex) -> bool:
        """Whether there is a body of this number."""
        return self._bodies.has(body_index)

    def HasBodyNamed(self, name: str, model_instance: ModelInstanceIndex | None = None) -> bool:
        """Whether there is a body of this name.

        Raises:
            RuntimeError: no model instance is given and more than one has a body of this name.
        """
        return self._has_named(self._bodies, "HasBodyNamed", name, model_instance)

    def _has_named(self, registry: Registry, call: str, name: str, instance: Any) -> bool:
        found = registry.find(name, instance)
        if instance is not None:
            self._instances.get(instance, call)
        elif len(found) > 1:
            registry.by_name(call, name)
        return bool(found)

    def NumBodiesWithName(self, name: str) -> int:
        """How many model instances have a body of this name."""
        return len(self._bodies.find(name))

    def GetBodyByName(self, name: str, model_instance: ModelInstanceIndex | None = None) -> RigidBody:
        """The body of a name.

        Raises:
            RuntimeError: there is none, or more than one; the message lists the valid names.
        """
        return self._bodies.by_name("GetBodyByName", name, model_instance)

    def GetRigidBodyByName(self, name: str, model_instance: ModelInstanceIndex | None = None) -> RigidBody:
        """The body of a name."""
        return self._bodies.by_name("GetRigidBodyByName", name, model_instance)

    def GetBodyIndices(self, model_instance: ModelInstanceIndex) -> list[BodyIndex]:
        """Bodies of a model instance."""
        self._instances.get(model_instance, "GetBodyIndices")
        return [b.index() for b in self._bodies.of_instance(model_instance)]

    # --- frames

    def AddFrame(self, frame: Frame) -> Frame:
        """Adds a frame that was made on its own.

        Raises:
            RuntimeError: its name is taken, its body is not of this plant, or the plant is finalized.
        """
        self._require_not_finalized("AddFrame")
        if not isinstance(frame, FixedOffsetFrame):
            raise TypeError(f"AddFrame(): incompatible function arguments. Expected a FixedOffsetFrame, not {frame!r}.")
        self._require_mine("AddFrame", frame.body(), frame._parent)
        self._checked_instance(frame.model_instance())
        self._frames.check_free(frame.name(), frame.model_instance())
        frame._adopt(self, len(self._frames.slots))
        self._frames.add(frame, frame.name())
        return frame

    def _require_mine(self, call: str, *elements: Any) -> None:
        for element in elements:
            if not hasattr(element, "_owner"):
                raise TypeError(f"{call}(): incompatible function arguments. {element!r} is no element of a plant.")
            if getattr(element._owner, "_family", None) is not self._family:
                raise RuntimeError(f"{call}(): {element!r} is not part of this MultibodyPlant.")

    def num_frames(self) -> int:
        """Number of frames, body frames included."""
        return len(self._frames)

    def world_frame(self) -> Frame:
        """The world's frame."""
        return self.world_body().body_frame()

    def get_frame(self, frame_index: FrameIndex) -> Frame:
        """The frame of a number."""
        return self._frames.get(frame_index, "get_frame")

    def HasFrameNamed(self, name: str, model_instance: ModelInstanceIndex | None = None) -> bool:
        """Whether there is a frame of this name."""
        return self._has_named(self._frames, "HasFrameNamed", name, model_instance)

    def GetFrameByName(self, name: str, model_instance: ModelInstanceIndex | None = None) -> Frame:
        """The frame of a name.

        Raises:
            RuntimeError: there is none, or more than one; the message lists the valid names.
        """
        return self._frames.by_name("GetFrameByName", name, model_instance)

    def GetFrameIndices(self, model_instance: ModelInstanceIndex) -> list[FrameIndex]:
        """Frames of a model instance."""
        self._instances.get(model_instance, "GetFrameIndices")
        return [f.index() for f in self._frames.of_instance(model_instance)]

    # --- joints

    def AddJoint(self, joint: Joint) -> Joint:
        """Adds a joint that was made on its own.

        Raises:
            RuntimeError: its name is taken, it joins a body to itself, a frame is not of this plant, or the plant is
                finalized.
        """
        self._require_not_finalized("AddJoint")
        if not isinstance(joint, Joint):
            raise TypeError(f"AddJoint(): incompatible function arguments. Expected a Joint, not {joint!r}.")
        self._require_mine("AddJoint", joint.frame_on_parent(), joint.frame_on_child())
        if joint.parent_body() is joint.child_body():
            raise RuntimeError(
                f"AddJoint(): joint {joint.name()} would connect body {joint.child_body().name()} to itself."
            )
        other = self._joint_between.get(frozenset((joint.parent_body(), joint.child_body())))
        if other is not None:
            raise RuntimeError(
                f"AddJoint(): This MultibodyPlant already has a joint '{other.name()}' connecting "
                f"'{other.parent_body().name()}' to '{other.child_body().name()}'. Therefore adding joint "
                f"'{joint.name()}' connecting '{joint.parent_body().name()}' to '{joint.child_body().name()}' is "
                "not allowed."
            )
        return self._add_joint(joint)

    def _add_joint(self, joint: Joint) -> Joint:
        self._joints.check_free(joint.name(), joint.model_instance())
        joint._adopt(self, len(self._joints.slots))
        self._joints.add(joint, joint.name())
        self._joint_between[frozenset((joint.parent_body(), joint.child_body()))] = joint
        return joint

    def WeldFrames(
        self, frame_on_parent_F: Frame, frame_on_child_M: Frame, X_FM: RigidTransform | None = None
    ) -> WeldJoint:
        """Welds frame M of a child body to frame F of a parent body at pose X_FM (the identity when left out)."""
        self._require_not_finalized("WeldFrames")
        name = f"{frame_on_parent_F.name()}_welds_to_{frame_on_child_M.name()}"
        X_FM = RigidTransform() if X_FM is None else X_FM
        return self.AddJoint(WeldJoint(name, frame_on_parent_F, frame_on_child_M, X_FM))  # type: ignore[return-value]

    def RemoveJoint(self, joint: Joint) -> None:
        """Takes a joint out again.

        Raises:
            RuntimeError: an actuator acts on it, or the plant is finalized.
        """
        self._require_not_finalized("RemoveJoint")
        self._require_mine("RemoveJoint", joint)
        for user in (*self._actuators, *self._force_elements):
            if hasattr(user, "joint") and user.joint() is joint:
                raise RuntimeError(f"RemoveJoint(): joint {joint.name()!r} is used by {user!r}; remove that first.")
        self._joints.remove(joint, joint.name())
        del self._joint_between[frozenset((joint.parent_body(), joint.child_body()))]
        joint._owner = joint._index = None

    def num_joints(self) -> int:
        """Number of joints."""
        return len(self._joints)

    def has_joint(self, joint_index: JointIndex) -> bool:
        """Whether there is a joint of this number."""
        return self._joints.has(joint_index)

    def get_joint(self, joint_index: JointIndex) -> Joint:
        """The joint of a number."""
        return self._joints.get(joint_index, "get_joint")

    def get_mutable_joint(self, joint_index: JointIndex) -> Joint:
        """The joint of a number."""
        return self._joints.get(joint_index, "get_mutable_joint")

    def HasJointNamed(self, name: str, model_instance: ModelInstanceIndex | None = None) -> bool:
        """Whether there is a joint of this name."""
        return self._has_named(self._joints, "HasJointNamed", name, model_instance)

    def GetJointByName(self, name: str, model_instance: ModelInstanceIndex | None = None) -> Joint:
        """The joint of a name.

        Raises:
            RuntimeError: there is none, or more than one; the message lists the valid names.
        """
        return self._joints.by_name("GetJointByName", name, model_instance)

    def GetMutableJointByName(self, name: str, model_instance: ModelInstanceIndex | None = None) -> Joint:
        """The joint of a name."""
        return self._joints.by_name("GetMutableJointByName", name, model_instance)

    def GetJointIndices(self, model_instance: ModelInstanceIndex | None = None) -> list[JointIndex]:
        """All joints, or those of a model instance."""
        if model_instance is None:
            return [j.index() for j in self._joints]
        self._instances.get(model_instance, "GetJointIndices")
        return [j.index() for j in self._joints.of_instance(model_instance)]
