"""MJCF actuators: motors and position servos of one joint."""

import numpy as np

from .._files.xml import Element
from .._model.description import ActuatorDescription, JointDescription, ModelDescription
from .._reading.reading import Reading
from .defaults import Compiler, is_limited

_ATTRIBUTES = (
    "name",
    "class",
    "joint",
    "gear",
    "ctrlrange",
    "ctrllimited",
    "forcerange",
    "forcelimited",
)


def read_actuator(
    element: Element, model: ModelDescription, armature: "dict[str, float]", compiler: Compiler, reading: Reading
) -> None:
    """Adds the actuator of a `<motor>` or `<position>` element to a model.

    Args:
        element: The element, its defaults filled in.
        model: The model, with all its joints.
        armature: Reflected inertia of each joint by name [kg⋅m² or kg].
        compiler: Settings of the document.
        reading: Its surroundings.
    """
    reading.warn_unknown(element, attributes=(*_ATTRIBUTES, *(("kp", "kv") if element.tag == "position" else ())))
    count = sum(isinstance(item, ActuatorDescription) for item in model.elements)
    name = element.get("name") or f"motor{reading.num_actuators + count}"
    joint = _driven_joint(element, name, model, reading)
    if joint is None:
        return
    actuator = ActuatorDescription(element.where, name, joint.name, _effort_limit(element, name, compiler, reading))
    gear = reading.parse_vector(element.get("gear", "1"), None, element.where_attribute("gear"), "attribute 'gear'")
    if gear.size == 0 or gear[0] == 0.0:
        reading.fail(element, f"Actuator '{name}': the gear ratio must not be zero.")
    actuator.gear_ratio = float(gear[0])
    actuator.rotor_inertia = armature[joint.name] / actuator.gear_ratio**2
    if element.tag == "position":
        actuator.gains = reading.number(element, "kp", 1.0), 0.0
        if reading.number(element, "kv", 0.0) != 0.0:
            reading.warn(element, f"Actuator '{name}': 'kv' is not used, as in Drake.")
    model.elements.append(actuator)


def _driven_joint(element: Element, name: str, model: ModelDescription, reading: Reading) -> "JointDescription | None":
    """The joint an actuator drives; None, with a warning, when it drives something else."""
    joint_name = element.get("joint")
    if joint_name is None:
        reading.warn(element, f"Actuator '{name}' does not drive a joint and is ignored; only 'joint' is supported.")
        return None
    joints = {joint.name: joint for joint in model.joints()}
    if joint_name not in joints:
        known = ", ".join(joints) or "(none)"
        reading.fail(element, f"Actuator '{name}' names joint '{joint_name}', which does not exist; known: {known}.")
    joint = joints[joint_name]
    if not joint.type.has_one_dof:
        reading.fail(element, f"Actuator '{name}': joint '{joint_name}' has several degrees of freedom.")
    return joint


def _effort_limit(element: Element, name: str, compiler: Compiler, reading: Reading) -> float:
    """The smaller of force and control range; the larger end of a lopsided one."""
    limit = np.inf
    for prefix in ("ctrl", "force"):
        if not is_limited(element, f"{prefix}limited", f"{prefix}range", compiler, reading):
            continue
        bounds = reading.vector(element, f"{prefix}range", 2)
        if bounds is None:
            reading.fail(element, f"Actuator '{name}': {prefix}limited needs a {prefix}range.")
        if bounds[0] > bounds[1]:
            reading.fail(element, f"Actuator '{name}': the {prefix}range is upside down.")
        if bounds[0] != -bounds[1]:
            reading.warn(element, f"Actuator '{name}': the {prefix}range is lopsided; its larger end is used.")
        limit = min(limit, float(np.max(np.abs(bounds))))
    return limit
