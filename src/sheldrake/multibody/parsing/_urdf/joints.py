"""URDF joints, mimic tags and transmissions.

Into the joints, couplers and actuators of a `ModelDescription`.
"""

import dataclasses

import numpy as np

from sheldrake.multibody.tree._joint_types import JOINT_TYPES, JointType

from .._files.xml import Element
from .._model.description import (
    ActuatorDescription,
    CouplerDescription,
    FrameReference,
    JointDescription,
    JointLimits,
    ModelDescription,
)
from .._reading.joints import read_gains, read_path
from .._reading.reading import Reading, rotation_from_z
from .geometry import read_origin

_TYPES = {name: row for row in JOINT_TYPES.values() for name in row.urdf}
_JOINT_TAGS = (
    "parent",
    "child",
    "origin",
    "axis",
    "limit",
    "dynamics",
    "mimic",
    "drake:screw_thread_pitch",
    "drake:plane_normal",
    "drake:initial_tangent",
    "drake:curves",
    "drake:is_periodic",
)
_ACTUATOR_TAGS = ("drake:rotor_inertia", "drake:gear_ratio", "drake:controller_gains", "mechanicalReduction")
_LIMIT_ATTRIBUTES = ("lower", "upper", "effort", "velocity", "drake:acceleration")


def link_reference(name: str) -> FrameReference:
    """A link by name; `world` is the plant's world body."""
    return FrameReference(name, is_world=name == "world")


def read_joint(element: Element, model: ModelDescription, reading: Reading) -> None:
    """Adds a `<joint>` or `<drake:joint>` to the model."""
    name = reading.name(element, f"<{element.tag}>")
    joint_type = _read_type(element, name, reading)
    kind = joint_type.name
    reading.warn_unknown(element, tags=_JOINT_TAGS, attributes=("name", "type", "drake_ignore"))
    parent, child = (_read_end(element, name, role, reading) for role in ("parent", "child"))
    if kind == "quaternion_floating":
        reading.warn(
            element,
            f"Joint '{name}' of type floating makes no joint of that name; link '{child}' is left as a free body."
            + (" Its <origin> is ignored." if element.find("origin") is not None else ""),
        )
        return
    joint = JointDescription(element.where, name, kind, parent, child, X_PF=read_origin(element, reading))
    if "axis" in joint_type.takes or kind == "planar":  # fixed joints in the wild often have a zero axis
        joint.axis = _read_axis(element, name, reading)
    elif kind == "weld":
        reading.pass_over(*element.find_all("axis"))
    if "curvilinear_path" in joint_type.takes:
        _pass_over_limits(element, name, reading)
    elif kind in ("weld", "planar"):  # have none: whatever it says, also where the joint was once of another type
        reading.pass_over(*element.find_all("limit"))
    else:
        joint.limits = _read_limits(element, name, reading)
        if kind == "screw" and np.isfinite(joint.limits.effort):  # as in Drake
            reading.warn(element.find("limit") or element, f"Joint '{name}' is a screw: its effort limit is ignored.")
            joint.limits = dataclasses.replace(joint.limits, effort=np.inf)
    joint.damping = _read_dynamics(element, joint, joint_type, reading)
    if kind == "planar":
        _align_plane(joint)
    elif "screw_pitch" in joint_type.takes:
        joint.screw_pitch = _read_pitch(element, name, reading)
    elif "curvilinear_path" in joint_type.takes:
        _read_path(element, joint, reading)
    model.elements.append(joint)


def _read_type(element: Element, name: str, reading: Reading) -> JointType:
    written = reading.name(element, f"Joint '{name}'", "type")
    if written not in _TYPES:
        known = ", ".join(_TYPES)
        reading.fail(element, f"Joint '{name}' has the unknown type '{written}'; known are {known}.")
    custom = _TYPES[written].urdf_custom
    is_custom = element.tag == "drake:joint"
    if custom is not None and custom != is_custom:
        right = "<drake:joint>" if custom else "<joint>"
        reading.fail(element, f"Joint '{name}' of type {written} must be written as {right}, not <{element.tag}>.")
    return _TYPES[written]


def _read_end(element: Element, name: str, role: str, reading: Reading) -> FrameReference:
    end = element.find(role)
    if end is None:
        reading.fail(element, f"Joint '{name}' has no <{role}> element.")
    reading.warn_unknown(end, attributes=("link",))
    return link_reference(reading.name(end, f"<{role}> of joint '{name}'", "link"))


def _read_axis(element: Element, name: str, reading: Reading) -> np.ndarray:
    """The unit axis in the joint frame, x when the file says nothing."""
    axis = element.find("axis")
    if axis is None:
        return np.array([1.0, 0.0, 0.0])
    reading.warn_unknown(axis, attributes=("xyz",))
    vector = reading.vector(axis, "xyz", 3, np.array([1.0, 0.0, 0.0]))
    length = float(np.linalg.norm(vector))
    if length < 1e-8:
        reading.fail(axis, f"The axis of joint '{name}' is zero.")
    return vector / length


def _read_limits(element: Element, name: str, reading: Reading) -> JointLimits:
    limit = element.find("limit")
    if limit is None:
        return JointLimits()
    reading.warn_unknown(limit, attributes=_LIMIT_ATTRIBUTES)

    def get(attribute, default):
        return reading.number(limit, attribute, default, infinite=True)

    limits = JointLimits(
        get("lower", -np.inf),
        get("upper", np.inf),
        get("velocity", np.inf),
        get("drake:acceleration", np.inf),
        get("effort", np.inf),
    )
    if limits.lower > limits.upper:
        reading.fail(limit, f"Joint '{name}': lower limit {limits.lower:g} is above upper limit {limits.upper:g}.")
    for attribute, value in (("velocity", limits.velocity), ("drake:acceleration", limits.acceleration)):
        if value < 0.0:
            reading.fail(limit, f"Joint '{name}': the {attribute} limit must not be negative, found {value:g}.")
    return limits


def _pass_over_limits(element: Element, name: str, reading: Reading) -> None:
    limit = element.find("limit")
    if limit is not None:
        reading.pass_over(limit)
        reading.warn(limit, f"Joint '{name}' is curvilinear: its limits are the ends of its path, <limit> is ignored.")


def _read_dynamics(
    element: Element, joint: JointDescription, joint_type: JointType, reading: Reading
) -> "float | np.ndarray":
    """Damping, one number or one for each velocity; notes friction."""
    size = len(joint_type.velocities) if joint_type.damping_each else 0
    dynamics = element.find("dynamics")
    if dynamics is None:
        return np.zeros(size) if size else 0.0
    reading.warn_unknown(dynamics, attributes=("damping", "friction"))
    joint.friction = reading.number(dynamics, "friction", 0.0)
    if joint.friction < 0.0:
        reading.fail(dynamics, f"Joint '{joint.name}': friction must not be negative, found {joint.friction:g}.")
    if joint.friction != 0.0 and not reading.joint_friction:
        joint.friction = 0.0
        reading.warn(
            dynamics.where_attribute("friction"),
            f"Joint '{joint.name}' has friction, which is ignored; Parser.SetUseJointFriction(True) takes it.",
        )
    if size:
        damping = reading.vector(dynamics, "damping", size, np.zeros(size))
    else:
        damping = reading.number(dynamics, "damping", 0.0)
    if np.any(np.asarray(damping) < 0.0):
        found = dynamics.get("damping")
        reading.fail(dynamics, f"Joint '{joint.name}': damping must not be negative, found {found}.")
    return damping


def _align_plane(joint: JointDescription) -> None:
    """A planar joint moves in the x-y plane of its frames: turns both so that z is the axis of the file."""
    from sheldrake.math import RigidTransform

    assert joint.axis is not None
    X_FPlane = RigidTransform(rotation_from_z(joint.axis), np.zeros(3))
    joint.X_PF = joint.X_PF @ X_FPlane
    joint.X_CM = X_FPlane


def _read_pitch(element: Element, name: str, reading: Reading) -> float:
    pitch = element.find("drake:screw_thread_pitch")
    value = None if pitch is None else _number(pitch, reading)
    if value is None:
        reading.fail(pitch or element, f"Screw joint '{name}' needs <drake:screw_thread_pitch value='...'>.")
    return value


def _number(element: Element, reading: Reading, attribute: str = "value") -> "float | None":
    """The number in the only attribute an element has."""
    reading.warn_unknown(element, attributes=(attribute,))
    return reading.number(element, attribute)


def _read_path(element: Element, joint: JointDescription, reading: Reading) -> None:
    def numbers(piece: Element, *names: str) -> "list[float | None]":
        reading.warn_unknown(piece, attributes=names)
        return [reading.number(piece, name) for name in names]

    def vector(tag: str, default: list[float]) -> np.ndarray:
        child = element.find(tag)
        if child is None:
            return np.array(default)
        reading.warn_unknown(child, attributes=("xyz",))
        return reading.vector(child, "xyz", 3, np.array(default))

    periodic = element.find("drake:is_periodic")
    if periodic is not None:
        reading.warn_unknown(periodic, attributes=("value",))
    is_periodic = periodic is not None and reading.parse_bool(
        reading.name(periodic, periodic.tag, "value"), periodic.where_attribute("value"), "<drake:is_periodic>"
    )
    read_path(element, joint, reading, numbers, vector, is_periodic)


def read_mimic(element: Element, model: ModelDescription, reading: Reading) -> None:
    """Adds the coupler of a joint's `<mimic>` child, when it has one."""
    mimic = element.find("mimic")
    if mimic is None:
        return
    joints = {joint.name: joint for joint in model.joints()}
    joint = joints.get(element.get("name", ""))
    if joint is None:
        return
    reading.warn_unknown(mimic, attributes=("joint", "multiplier", "offset"))
    source_name = reading.name(mimic, f"<mimic> of joint '{joint.name}'", "joint")
    source = joints.get(source_name)
    if source is None:
        known = ", ".join(joints)
        reading.fail(mimic, f"Joint '{joint.name}' mimics joint '{source_name}', which does not exist; known: {known}.")
    if source is joint:
        reading.fail(mimic, f"Joint '{joint.name}' cannot mimic itself.")
    if joint.kind == "weld" or source.kind == "weld":
        fixed = joint if joint.kind == "weld" else source
        reading.warn(
            mimic, f"Joint '{joint.name}' mimics '{source_name}', but '{fixed.name}' is fixed; the tag is ignored."
        )
        return
    for one in (joint, source):
        if not one.type.has_one_dof:
            reading.fail(mimic, f"Joint '{joint.name}' cannot mimic '{source_name}': '{one.name}' is {one.kind}.")
    model.elements.append(
        CouplerDescription(
            mimic.where,
            joint.name,
            source_name,
            reading.number(mimic, "multiplier", 1.0),
            reading.number(mimic, "offset", 0.0),
        )
    )


def read_transmission(element: Element, model: ModelDescription, reading: Reading) -> None:
    """Adds the actuator of a simple `<transmission>`."""
    type_element = element.find("type")
    kind = element.get("type") if type_element is None else type_element.text.strip()
    if kind is None:
        reading.fail(element, "A <transmission> has no type.")
    if "SimpleTransmission" not in kind:
        reading.warn(element, f"A <transmission> of type '{kind}' is ignored; only SimpleTransmission is supported.")
        reading.pass_over(element)
        return
    reading.warn_unknown(element, ("type", "joint", "actuator", "mechanicalReduction"), ("name", "type"))
    joint_element, actuator = element.find("joint"), element.find("actuator")
    if joint_element is None or actuator is None:
        missing = "joint" if joint_element is None else "actuator"
        reading.fail(element, f"A <transmission> has no <{missing}> element.")
    for extra in element.find_all("joint", "actuator"):
        if extra is not joint_element and extra is not actuator:
            reading.warn(extra, f"A simple transmission has one joint and one actuator; this <{extra.tag}> is ignored.")
            reading.pass_over(extra)
    reading.warn_unknown(joint_element, attributes=("name",), silent=("hardwareInterface",))
    reading.warn_unknown(actuator, _ACTUATOR_TAGS, ("name",), silent=("hardwareInterface",))
    name = reading.name(actuator, "The <actuator> of a <transmission>")
    joint_name = reading.name(joint_element, "The <joint> of a <transmission>")
    joints = {joint.name: joint for joint in model.joints()}
    joint = joints.get(joint_name)
    if joint is None:
        known = ", ".join(joints) or "(none)"
        reading.fail(
            joint_element, f"A <transmission> names joint '{joint_name}', which does not exist; known: {known}."
        )
    _warn_reduction(element, reading)
    _warn_reduction(actuator, reading)
    if not _can_be_actuated(joint, element, reading):
        return
    model.elements.append(_read_actuator(actuator, name, joint, reading))


def _warn_reduction(element: Element, reading: Reading) -> None:
    reduction = element.find("mechanicalReduction")
    if reduction is None or not reduction.text.strip():
        return
    value = reading.parse_number(reduction.text, reduction.where, "<mechanicalReduction>")
    if value != 1.0:
        reading.warn(reduction, f"<mechanicalReduction> {value:g} is ignored; use <drake:gear_ratio value='...'>.")


def _can_be_actuated(joint: JointDescription, element: Element, reading: Reading) -> bool:
    if joint.kind == "weld":
        reading.warn(element, f"The transmission is ignored: joint '{joint.name}' is fixed.")
        return False
    if not joint.type.has_one_dof:
        reading.fail(
            element, f"Joint '{joint.name}' ({joint.kind}) has several degrees of freedom; it has no actuator."
        )
    if joint.limits.effort < 0.0:
        reading.fail(element, f"Joint '{joint.name}' has the negative effort limit {joint.limits.effort:g}.")
    if joint.limits.effort == 0.0:
        reading.warn(element, f"The transmission is ignored: joint '{joint.name}' has an effort limit of zero.")
        return False
    return True


def _read_actuator(element: Element, name: str, joint: JointDescription, reading: Reading) -> ActuatorDescription:
    result = ActuatorDescription(element.where, name, joint.name, joint.limits.effort)

    def value(tag: str) -> "float | None":
        child = element.find(tag)
        if child is None:
            return None
        number = _number(child, reading)
        if number is None:
            reading.fail(child, f"<{tag}> of actuator '{name}' needs the attribute 'value'.")
        if number < 0.0:
            reading.fail(child, f"<{tag}> of actuator '{name}' must not be negative, found {number:g}.")
        return number

    result.rotor_inertia = value("drake:rotor_inertia")
    result.gear_ratio = value("drake:gear_ratio")
    result.gains = read_gains(element, f"actuator '{name}'", reading)
    return result
