"""Building a plant: actuators and force elements."""

from __future__ import annotations

import numpy as np

from sheldrake.multibody.plant._building.registration import Registration
from sheldrake.multibody.tree import (
    ForceElement,
    ForceElementIndex,
    Joint,
    JointActuator,
    JointActuatorIndex,
    JointIndex,
    ModelInstanceIndex,
    UniformGravityFieldElement,
)


class ForceRegistration(Registration):
    """What pushes in a plant."""

    # --- actuators

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
        self._require_not_finalized("AddJointActuator")
        self._require_mine("AddJointActuator", joint)
        if joint.num_velocities() != 1:
            raise RuntimeError(
                f"Calling AddJointActuator with joint {joint.name()} failed -- this joint has {joint.num_velocities()} "
                "degrees of freedom, and MultibodyPlant currently only supports actuators for single "
                "degree-of-freedom joints."
            )
        actuator = JointActuator(name, joint, effort_limit)
        self._actuators.check_free(name, actuator.model_instance())
        actuator._adopt(self, len(self._actuators.slots))
        self._actuators.add(actuator, name)
        return actuator

    def RemoveJointActuator(self, actuator: JointActuator) -> None:
        """Takes an actuator out again."""
        self._require_not_finalized("RemoveJointActuator")
        self._require_mine("RemoveJointActuator", actuator)
        self._actuators.remove(actuator, actuator.name())
        actuator._owner = actuator._index = None

    def RemoveAllJointActuatorEffortLimits(self) -> None:
        """Makes the effort limits of all actuators infinite."""
        for actuator in self._actuators:
            actuator.set_effort_limit(np.inf)

    def has_joint_actuator(self, actuator_index: JointActuatorIndex) -> bool:
        """Whether there is an actuator of this number."""
        return self._actuators.has(actuator_index)

    def get_joint_actuator(self, actuator_index: JointActuatorIndex) -> JointActuator:
        """The actuator of a number."""
        return self._actuators.get(actuator_index, "get_joint_actuator")

    def get_mutable_joint_actuator(self, actuator_index: JointActuatorIndex) -> JointActuator:
        """The actuator of a number."""
        return self._actuators.get(actuator_index, "get_mutable_joint_actuator")

    def HasJointActuatorNamed(self, name: str, model_instance: ModelInstanceIndex | None = None) -> bool:
        """Whether there is an actuator of this name."""
        return self._has_named(self._actuators, "HasJointActuatorNamed", name, model_instance)

    def GetJointActuatorByName(self, name: str, model_instance: ModelInstanceIndex | None = None) -> JointActuator:
        """The actuator of a name.

        Raises:
            RuntimeError: there is none, or more than one; the message lists the valid names.
        """
        return self._actuators.by_name("GetJointActuatorByName", name, model_instance)

    def GetJointActuatorIndices(self, model_instance: ModelInstanceIndex | None = None) -> list[JointActuatorIndex]:
        """All actuators, or those of a model instance."""
        if model_instance is None:
            return [a.index() for a in self._actuators]
        self._instances.get(model_instance, "GetJointActuatorIndices")
        return [a.index() for a in self._actuators.of_instance(model_instance)]

    def GetActuatedJointIndices(self, model_instance: ModelInstanceIndex) -> list[JointIndex]:
        """Joints of a model instance with actuators, in the order of the actuators."""
        self._instances.get(model_instance, "GetActuatedJointIndices")
        return [a.joint().index() for a in self._actuators.of_instance(model_instance)]

    # --- force elements

    def AddForceElement(self, force_element: ForceElement) -> ForceElement:
        """Adds a force element that was made on its own.

        Raises:
            RuntimeError: it is gravity, which every plant has already, or the plant is finalized.
        """
        self._require_not_finalized("AddForceElement")
        if not isinstance(force_element, ForceElement):
            raise TypeError(
                f"AddForceElement(): incompatible function arguments. Expected a ForceElement, not {force_element!r}."
            )
        if isinstance(force_element, UniformGravityFieldElement):
            raise RuntimeError(
                "AddForceElement(): a UniformGravityFieldElement is already there; change it through "
                "mutable_gravity_field()."
            )
        self._require_mine("AddForceElement", *force_element._parts())
        force_element._adopt(self, self._force_elements.add(force_element, None))
        return force_element

    def num_force_elements(self) -> int:
        """Number of force elements, gravity included."""
        return len(self._force_elements)

    def get_force_element(self, force_element_index: ForceElementIndex) -> ForceElement:
        """The force element of a number."""
        return self._force_elements.get(force_element_index, "get_force_element")

    def gravity_field(self) -> UniformGravityFieldElement:
        """Gravity."""
        return self._gravity

    def mutable_gravity_field(self) -> UniformGravityFieldElement:
        """Gravity, to be changed."""
        return self._gravity

    def set_gravity_enabled(self, model_instance: ModelInstanceIndex, is_enabled: bool) -> None:
        """Switches gravity on or off for the bodies of a model instance."""
        self._require_not_finalized("set_gravity_enabled")
        self._instances.get(model_instance, "set_gravity_enabled")
        self._gravity.set_enabled(model_instance, is_enabled)

    def is_gravity_enabled(self, model_instance: ModelInstanceIndex) -> bool:
        """Whether gravity acts on the bodies of a model instance."""
        self._instances.get(model_instance, "is_gravity_enabled")
        return self._gravity.is_enabled(model_instance)
