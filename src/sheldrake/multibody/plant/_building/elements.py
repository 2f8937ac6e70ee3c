"""The elements of a plant: model instances, bodies, frames, joints, actuators, force elements."""

from __future__ import annotations

import dataclasses
from typing import Any, TypeVar

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._overloads import Mismatch
from sheldrake.math import RigidTransform
from sheldrake.multibody.math import SpatialInertia
from sheldrake.multibody.plant._building.frozen_model import FrozenModel
from sheldrake.multibody.plant._building.registry import ModelInstances, Numbered, Registry
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
    MultibodyConstraintId,
    RigidBody,
    UniformGravityFieldElement,
    WeldJoint,
    default_model_instance,
    world_model_instance,
)
from sheldrake.multibody.tree._force_element import JointElement
from sheldrake.multibody.tree._kernels.forces import ForceModel
from sheldrake.multibody.tree._owner import Owner
from sheldrake.multibody.tree._rigid_body import body_arguments

AnyJoint = TypeVar("AnyJoint", bound=Joint)


@dataclasses.dataclass
class ConstraintRecord:
    """A registered constraint: its kind, what it joins, its numbers in p after the flag."""

    kind: str
    A: Any
    B: Any
    numbers: list[float]
    group: int = -1
    joints: tuple[Joint, ...] = ()
    """The joints of a tendon."""
    open_point: bool = False
    """p_BQ of a ball is to be found at Finalize()."""


class Elements:
    """Registries of the elements, and the model that `Finalize()` makes of them.

    Args:
        owner: What the elements know of their plant.
    """

    def __init__(self, owner: Owner) -> None:
        self._owner = owner
        self._frozen: FrozenModel | None = None
        self.instances = ModelInstances()
        self.instances.add_named("WorldModelInstance")
        self.instances.add_named("DefaultModelInstance")
        self.bodies: Registry[RigidBody] = Registry("RigidBody", "body", BodyIndex, self.instances)
        self.frames: Registry[Frame] = Registry("Frame", "frame", FrameIndex, self.instances)
        self.joints: Registry[Joint] = Registry("Joint", "joint", JointIndex, self.instances)
        self.joint_between: dict[frozenset[RigidBody], Joint] = {}
        self.actuators: Registry[JointActuator] = Registry(
            "JointActuator", "joint actuator", JointActuatorIndex, self.instances
        )
        self.force_elements: Numbered[ForceElement] = Numbered("force element", ForceElementIndex)
        self.constraints: dict[MultibodyConstraintId, ConstraintRecord] = {}
        self.world = self._add_body(RigidBody("world", world_model_instance(), SpatialInertia.NaN()))
        self.gravity = UniformGravityFieldElement()
        self.gravity._adopt(owner, self.force_elements.append(self.gravity))

    # --- when

    def is_finalized(self) -> bool:
        """Whether Finalize() was called."""
        return self._frozen is not None

    def finalize(self, model: FrozenModel) -> None:
        """From now on the elements stay as they are in a model."""
        self._frozen = model

    def model(self, call: str) -> FrozenModel:
        """What Finalize() made.

        Raises:
            RuntimeError: before Finalize().
        """
        if self._frozen is None:
            raise RuntimeError(f"{call}(): this plant is pre-finalize; it answers once Finalize() is called.")
        return self._frozen

    def require_finalized(self, call: str) -> None:
        """Raises RuntimeError before Finalize()."""
        if self._frozen is None:
            self.model(call)

    def require_not_finalized(self, call: str) -> None:
        """Raises RuntimeError after Finalize()."""
        if self._frozen is not None:
            raise RuntimeError(
                f"{call}(): this plant is post-finalize; its bodies and joints stay as they were at Finalize()."
            )

    # --- whose

    def has(self, element: object) -> bool:
        """Whether an element is one of these, not of a copy on another scalar."""
        return getattr(element, "_owner", None) is self._owner

    def require_mine(self, call: str, *elements: object) -> None:
        """Makes sure that elements are of this plant, or of a copy of it on another scalar.

        Raises:
            TypeError: one is no element.
            RuntimeError: one is of another plant, or of none.
        """
        for element in elements:
            if not hasattr(element, "_owner"):
                raise Mismatch(f"{call}(): incompatible function arguments. {element!r} is no element of a plant.")
            if getattr(element._owner, "family", None) is not self._owner.family:
                raise RuntimeError(f"{call}(): {element!r} is not part of this MultibodyPlant.")

    def require_instance(self, call: str, model_instance: ModelInstanceIndex) -> None:
        """Makes sure that there is a model instance; RuntimeError otherwise."""
        self.instances.get(model_instance, call)

    def _checked_instance(self, model_instance: Any) -> ModelInstanceIndex:
        if not self.instances.has(model_instance):
            raise RuntimeError("Invalid model instance specified.")
        return model_instance

    # --- in the forest

    def is_floating_base(self, body: RigidBody) -> bool:
        """Whether Finalize() gave the body its floating joint; a floating joint of the user's does not count."""
        step = self.model("is_floating_base_body").inboard_of(body)
        return step is not None and step.joint.is_ephemeral() and step.joint.num_velocities() == 6

    def has_quaternion(self, body: RigidBody) -> bool:
        """Whether the body hangs on a joint with a quaternion."""
        step = self.model("has_quaternion_dofs").inboard_of(body)
        return step is not None and step.joint.type_name() == "quaternion_floating"

    def inboard_joint(self, body: RigidBody) -> Joint:
        """The joint by which a body hangs in the forest.

        Raises:
            RuntimeError: the body is the world.
        """
        step = self.model("inboard_joint").inboard_of(body)
        if step is None:
            raise RuntimeError(f"The world body {body.name()!r} has no inboard joint.")
        return step.joint

    def row_of(self, body: RigidBody) -> int:
        """The row of a body in the kernels' arrays."""
        return self.model("row_of").row_of(body)

    def forces_of(self, element: ForceElement) -> ForceModel:
        """One force element as arrays."""
        return self.model("forces_of").forces_of([element])

    # --- model instances

    @checked
    def AddModelInstance(self, name: str) -> ModelInstanceIndex:
        """A new model instance.

        Raises:
            RuntimeError: the name is taken, or the plant is finalized.
        """
        self.require_not_finalized("AddModelInstance")
        return self.instances.add_named(name)

    def num_model_instances(self) -> int:
        """Number of model instances, those of the world and the default one included."""
        return len(self.instances.slots)

    @checked
    def HasModelInstanceNamed(self, name: str) -> bool:
        """Whether there is a model instance of this name."""
        return self.instances.has_name(name)

    @checked
    def GetModelInstanceByName(self, name: str) -> ModelInstanceIndex:
        """The model instance of a name.

        Raises:
            RuntimeError: there is none.
        """
        return self.instances.index_of("GetModelInstanceByName", name)

    def GetModelInstanceName(self, model_instance: ModelInstanceIndex) -> str:
        """Name of a model instance."""
        return self.instances.get(model_instance, "GetModelInstanceName").name()

    # --- bodies

    def add_body(self, name: str, args: tuple, kwargs: dict[str, Any]) -> RigidBody:
        """Adds a body: `MultibodyPlant.AddRigidBody` says how.

        Args:
            name: Unique in its model instance.
            args: `[model_instance], [M_BBo_B]`.
            kwargs: The same by name.
        """
        self.require_not_finalized("AddRigidBody")
        model_instance, inertia = body_arguments("AddRigidBody", args, kwargs)
        if model_instance is None and self.num_model_instances() > 2:
            raise RuntimeError(
                "This model has more model instances than the default. Please call AddRigidBody with an explicit model "
                "instance."
            )
        instance = default_model_instance() if model_instance is None else self._checked_instance(model_instance)
        if int(instance) == int(world_model_instance()):
            raise RuntimeError(
                f"AddRigidBody(): body {name!r}: model instance 0 is the world's and has no other body; give another "
                "one, such as default_model_instance()."
            )
        return self._add_body(RigidBody(name, instance, inertia))

    def _add_body(self, body: RigidBody) -> RigidBody:
        frame = body.body_frame()
        for registry in (self.bodies, self.frames):
            registry.check_free(body._name, body._instance)
        body._adopt(self._owner, self.bodies.add(body))
        frame._adopt(self._owner, self.frames.add(frame))
        return body

    def add_part(self, body: RigidBody, name: str, inertia: SpatialInertia) -> RigidBody:
        """Adds a body that Finalize() makes of another one, in its model instance."""
        part = self._add_body(RigidBody(name, body.model_instance(), inertia))
        part._ephemeral = True
        return part

    def num_bodies(self) -> int:
        """Number of bodies, the world included."""
        return len(self.bodies)

    def world_body(self) -> RigidBody:
        """The world."""
        return self.world

    def get_body(self, body_index: BodyIndex) -> RigidBody:
        """The body of a number."""
        return self.bodies.get(body_index, "get_body")

    def has_body(self, body_index: BodyIndex) -> bool:
        """Whether there is a body of this number."""
        return self.bodies.has(body_index)

    @checked
    def HasBodyNamed(self, name: str, model_instance: ModelInstanceIndex | None = None) -> bool:
        """Whether there is a body of this name.

        Raises:
            RuntimeError: no model instance is given and more than one has a body of this name.
        """
        return self.bodies.has_named("HasBodyNamed", name, model_instance)

    @checked
    def NumBodiesWithName(self, name: str) -> int:
        """How many model instances have a body of this name."""
        return len(self.bodies.find(name))

    def GetBodyByName(self, name: str, model_instance: ModelInstanceIndex | None = None) -> RigidBody:
        """The body of a name.

        Raises:
            RuntimeError: there is none, or more than one; the message lists the valid names.
        """
        return self.bodies.by_name("GetBodyByName", name, model_instance)

    def GetRigidBodyByName(self, name: str, model_instance: ModelInstanceIndex | None = None) -> RigidBody:
        """The body of a name."""
        return self.bodies.by_name("GetRigidBodyByName", name, model_instance)

    @checked
    def GetBodyIndices(self, model_instance: ModelInstanceIndex) -> list[BodyIndex]:
        """Bodies of a model instance."""
        self.require_instance("GetBodyIndices", model_instance)
        return self.bodies.indices("GetBodyIndices", model_instance)

    # --- frames

    @checked
    def AddFrame(self, frame: Frame) -> Frame:
        """Adds a frame that was made on its own.

        Raises:
            RuntimeError: its name is taken, its body is not of this plant, or the plant is finalized.
        """
        self.require_not_finalized("AddFrame")
        if not isinstance(frame, FixedOffsetFrame):
            raise Mismatch(f"AddFrame(): incompatible function arguments. Expected a FixedOffsetFrame, not {frame!r}.")
        self.require_mine("AddFrame", frame.body(), frame._parent)
        self._checked_instance(frame.model_instance())
        self.frames.check_free(frame.name(), frame.model_instance())
        frame._adopt(self._owner, len(self.frames.slots))
        self.frames.add(frame)
        return frame

    def num_frames(self) -> int:
        """Number of frames, body frames included."""
        return len(self.frames)

    def world_frame(self) -> Frame:
        """The world's frame."""
        return self.world.body_frame()

    def get_frame(self, frame_index: FrameIndex) -> Frame:
        """The frame of a number."""
        return self.frames.get(frame_index, "get_frame")

    @checked
    def HasFrameNamed(self, name: str, model_instance: ModelInstanceIndex | None = None) -> bool:
        """Whether there is a frame of this name."""
        return self.frames.has_named("HasFrameNamed", name, model_instance)

    def GetFrameByName(self, name: str, model_instance: ModelInstanceIndex | None = None) -> Frame:
        """The frame of a name.

        Raises:
            RuntimeError: there is none, or more than one; the message lists the valid names.
        """
        return self.frames.by_name("GetFrameByName", name, model_instance)

    @checked
    def GetFrameIndices(self, model_instance: ModelInstanceIndex) -> list[FrameIndex]:
        """Frames of a model instance."""
        self.require_instance("GetFrameIndices", model_instance)
        return self.frames.indices("GetFrameIndices", model_instance)

    # --- joints

    @checked
    def AddJoint(self, joint: AnyJoint) -> AnyJoint:
        """Adds a joint that was made on its own.

        Raises:
            RuntimeError: its name is taken, it joins a body to itself, a frame is not of this plant, or the plant is
                finalized.
        """
        self.require_not_finalized("AddJoint")
        if not isinstance(joint, Joint):
            raise Mismatch(f"AddJoint(): incompatible function arguments. Expected a Joint, not {joint!r}.")
        self.require_mine("AddJoint", joint.frame_on_parent(), joint.frame_on_child())
        if joint.parent_body() is joint.child_body():
            raise RuntimeError(
                f"AddJoint(): joint {joint.name()} would connect body {joint.child_body().name()} to itself."
            )
        other = self.joint_between.get(frozenset((joint.parent_body(), joint.child_body())))
        if other is not None:
            raise RuntimeError(
                f"AddJoint(): This MultibodyPlant already has a joint '{other.name()}' connecting "
                f"'{other.parent_body().name()}' to '{other.child_body().name()}'. Therefore adding joint "
                f"'{joint.name()}' connecting '{joint.parent_body().name()}' to '{joint.child_body().name()}' is "
                "not allowed."
            )
        self.add_joint(joint)
        return joint

    def add_joint(self, joint: Joint) -> Joint:
        """Adds a joint that is known to fit.

        Raises:
            RuntimeError: its name is taken.
        """
        self.joints.check_free(joint._name, joint._instance)
        joint._adopt(self._owner, len(self.joints.slots))
        self.joints.add(joint)
        self.joint_between[frozenset((joint.parent_body(), joint.child_body()))] = joint
        return joint

    def move_joint(self, joint: Joint, F: Frame, M: Frame) -> None:
        """Lets a joint join other frames."""
        del self.joint_between[frozenset((joint.parent_body(), joint.child_body()))]
        joint._F, joint._M = F, M
        self.joint_between[frozenset((joint.parent_body(), joint.child_body()))] = joint

    @checked
    def WeldFrames(
        self, frame_on_parent_F: Frame, frame_on_child_M: Frame, X_FM: RigidTransform | None = None
    ) -> WeldJoint:
        """Welds frame M of a child body to frame F of a parent body at pose X_FM (the identity when left out)."""
        self.require_not_finalized("WeldFrames")
        name = f"{frame_on_parent_F.name()}_welds_to_{frame_on_child_M.name()}"
        X_FM = RigidTransform() if X_FM is None else X_FM
        return self.AddJoint(WeldJoint(name, frame_on_parent_F, frame_on_child_M, X_FM))  # type: ignore[return-value]

    @checked
    def RemoveJoint(self, joint: Joint) -> None:
        """Takes a joint out again.

        Raises:
            RuntimeError: an actuator acts on it, or the plant is finalized.
        """
        self.require_not_finalized("RemoveJoint")
        self.require_mine("RemoveJoint", joint)
        for user in (*self.actuators, *self.force_elements):
            if isinstance(user, (JointActuator, JointElement)) and user.joint() is joint:
                raise RuntimeError(f"RemoveJoint(): joint {joint.name()!r} is used by {user!r}; remove that first.")
        self.joints.remove(joint)
        del self.joint_between[frozenset((joint.parent_body(), joint.child_body()))]
        joint._abandon()

    def num_joints(self) -> int:
        """Number of joints."""
        return len(self.joints)

    def has_joint(self, joint_index: JointIndex) -> bool:
        """Whether there is a joint of this number."""
        return self.joints.has(joint_index)

    def get_joint(self, joint_index: JointIndex) -> Any:
        """The joint of a number."""
        return self.joints.get(joint_index, "get_joint")

    def get_mutable_joint(self, joint_index: JointIndex) -> Any:
        """The joint of a number."""
        return self.joints.get(joint_index, "get_mutable_joint")

    @checked
    def HasJointNamed(self, name: str, model_instance: ModelInstanceIndex | None = None) -> bool:
        """Whether there is a joint of this name."""
        return self.joints.has_named("HasJointNamed", name, model_instance)

    def GetJointByName(self, name: str, model_instance: ModelInstanceIndex | None = None) -> Any:
        """The joint of a name.

        Raises:
            RuntimeError: there is none, or more than one; the message lists the valid names.
        """
        return self.joints.by_name("GetJointByName", name, model_instance)

    def GetMutableJointByName(self, name: str, model_instance: ModelInstanceIndex | None = None) -> Joint:
        """The joint of a name."""
        return self.joints.by_name("GetMutableJointByName", name, model_instance)

    @checked
    def GetJointIndices(self, model_instance: ModelInstanceIndex | None = None) -> list[JointIndex]:
        """All joints, or those of a model instance."""
        return self.joints.indices("GetJointIndices", model_instance)

    # --- actuators

    @checked
    def AddJointActuator(self, name: str, joint: Joint, effort_limit: float = np.inf) -> JointActuator:
        """Adds an actuator to a joint of one degree of freedom.

        Args:
            name: Unique in the joint's model instance.
            joint: What it acts on.
            effort_limit: Largest effort [N m or N].

        Raises:
            RuntimeError: the joint has not exactly one velocity, the name is taken, the limit is not positive, or the
                plant is finalized.
        """
        self.require_not_finalized("AddJointActuator")
        self.require_mine("AddJointActuator", joint)
        if joint.num_velocities() != 1:
            raise RuntimeError(
                f"Calling AddJointActuator with joint {joint.name()} failed -- this joint has {joint.num_velocities()} "
                "degrees of freedom, and MultibodyPlant currently only supports actuators for single "
                "degree-of-freedom joints."
            )
        actuator = JointActuator(name, joint, effort_limit)
        self.actuators.check_free(name, actuator.model_instance())
        actuator._adopt(self._owner, len(self.actuators.slots))
        self.actuators.add(actuator)
        return actuator

    @checked
    def RemoveJointActuator(self, actuator: JointActuator) -> None:
        """Takes an actuator out again."""
        self.require_not_finalized("RemoveJointActuator")
        self.require_mine("RemoveJointActuator", actuator)
        self.actuators.remove(actuator)
        actuator._abandon()

    def RemoveAllJointActuatorEffortLimits(self) -> None:
        """Makes the effort limits of all actuators infinite."""
        for actuator in self.actuators:
            actuator.set_effort_limit(np.inf)

    def has_joint_actuator(self, actuator_index: JointActuatorIndex) -> bool:
        """Whether there is an actuator of this number."""
        return self.actuators.has(actuator_index)

    def get_joint_actuator(self, actuator_index: JointActuatorIndex) -> JointActuator:
        """The actuator of a number."""
        return self.actuators.get(actuator_index, "get_joint_actuator")

    def get_mutable_joint_actuator(self, actuator_index: JointActuatorIndex) -> JointActuator:
        """The actuator of a number."""
        return self.actuators.get(actuator_index, "get_mutable_joint_actuator")

    @checked
    def HasJointActuatorNamed(self, name: str, model_instance: ModelInstanceIndex | None = None) -> bool:
        """Whether there is an actuator of this name."""
        return self.actuators.has_named("HasJointActuatorNamed", name, model_instance)

    def GetJointActuatorByName(self, name: str, model_instance: ModelInstanceIndex | None = None) -> JointActuator:
        """The actuator of a name.

        Raises:
            RuntimeError: there is none, or more than one; the message lists the valid names.
        """
        return self.actuators.by_name("GetJointActuatorByName", name, model_instance)

    @checked
    def GetJointActuatorIndices(self, model_instance: ModelInstanceIndex | None = None) -> list[JointActuatorIndex]:
        """All actuators, or those of a model instance."""
        return self.actuators.indices("GetJointActuatorIndices", model_instance)

    @checked
    def GetActuatedJointIndices(self, model_instance: ModelInstanceIndex) -> list[JointIndex]:
        """Joints of a model instance with actuators, in the order of the actuators."""
        self.instances.get(model_instance, "GetActuatedJointIndices")
        return [a.joint().index() for a in self.actuators.of_instance(model_instance)]

    # --- force elements

    @checked
    def AddForceElement(self, force_element: ForceElement) -> ForceElement:
        """Adds a force element that was made on its own.

        Raises:
            RuntimeError: it is gravity, which every plant has already, or the plant is finalized.
        """
        self.require_not_finalized("AddForceElement")
        if not isinstance(force_element, ForceElement):
            raise Mismatch(
                f"AddForceElement(): incompatible function arguments. Expected a ForceElement, not {force_element!r}."
            )
        if isinstance(force_element, UniformGravityFieldElement):
            raise RuntimeError(
                "AddForceElement(): a UniformGravityFieldElement is already there; change it through "
                "mutable_gravity_field()."
            )
        self.require_mine("AddForceElement", *force_element._parts())
        force_element._adopt(self._owner, self.force_elements.append(force_element))
        return force_element

    def num_force_elements(self) -> int:
        """Number of force elements, gravity included."""
        return len(self.force_elements)

    def get_force_element(self, force_element_index: ForceElementIndex) -> ForceElement:
        """The force element of a number."""
        return self.force_elements.get(force_element_index, "get_force_element")

    def gravity_field(self) -> UniformGravityFieldElement:
        """Gravity."""
        return self.gravity

    def mutable_gravity_field(self) -> UniformGravityFieldElement:
        """Gravity, to be changed."""
        return self.gravity

    @checked
    def set_gravity_enabled(self, model_instance: ModelInstanceIndex, is_enabled: bool) -> None:
        """Switches gravity on or off for the bodies of a model instance."""
        self.require_not_finalized("set_gravity_enabled")
        self.require_instance("set_gravity_enabled", model_instance)
        self.gravity.set_enabled(model_instance, is_enabled)

    def is_gravity_enabled(self, model_instance: ModelInstanceIndex) -> bool:
        """Whether gravity acts on the bodies of a model instance."""
        self.instances.get(model_instance, "is_gravity_enabled")
        return self.gravity.is_enabled(model_instance)

    def gravity_on(self, body: RigidBody) -> np.ndarray:
        """Acceleration of gravity on a body, in W [m/s²], shape (3,)."""
        on = self.gravity.is_enabled(body.model_instance())
        return self.gravity.gravity_vector() if on else np.zeros(3)

    def gravity_strength(self) -> float:
        """Acceleration of gravity [m/s²], where there is none that of Earth: a scale for contact."""
        g = float((self.gravity.gravity_vector() ** 2).sum() ** 0.5)
        return g if g > 0.0 else 9.81
