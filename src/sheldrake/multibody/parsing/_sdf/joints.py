"""SDFormat joints.

Into the joints, actuators and couplers of a `ModelDescription`; axes may be given in any frame of the model.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sheldrake.multibody.tree._joint_types import JOINT_TYPES

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
from .._reading.reading import Reading
from .children import child_number, child_text, child_vector
from .frames import MODEL_FRAME, SdfScope

if TYPE_CHECKING:
    from sheldrake.math import RigidTransform

_TYPES = {name: row for row in JOINT_TYPES.values() for name in row.sdf}
_CUSTOM_TYPES = {row.sdf_custom: row for row in JOINT_TYPES.values() if row.sdf_custom}
_UNSUPPORTED = ("revolute2",)
_JOINT_TAGS = (
    "parent",
    "child",
    "pose",
    "axis",
    "axis2",
    "screw_thread_pitch",
    "thread_pitch",
    "drake:rotor_inertia",
    "drake:gear_ratio",
    "drake:controller_gains",
    "drake:mimic",
)


@dataclass
class _Axis:
    """What an `<axis>` says; the direction is a unit vector in the joint frame."""

    direction: np.ndarray
    limits: JointLimits
    damping: float
    spring: tuple[float, float] | None


def reference(scope: SdfScope, name: str, element: Element) -> FrameReference:
    """The link behind a possibly scoped name of a link, frame, joint or model."""
    path, link = scope.body(name, element.where)
    return FrameReference(link, path, is_world=link == "world" and not path)


def read_joint(
    element: Element,
    model: ModelDescription,
    scope: SdfScope,
    X_WM: RigidTransform,
    is_static: bool,
    version: tuple[int, int],
    reading: Reading,
) -> None:
    """Adds a `<joint>` and its actuator, spring and mimic coupler to a model."""
    name = reading.name(element, "<joint>")
    written = reading.name(element, f"Joint '{name}'", "type")
    if written not in _TYPES:
        problem = "is not supported" if written in _UNSUPPORTED else "is unknown"
        known = ", ".join([*_TYPES, "gearbox"])
        reading.fail(element, f"The type '{written}' of joint '{name}' {problem}; supported are {known}.")
    joint_type = _TYPES[written]
    kind = joint_type.name
    if is_static and kind != "weld":
        reading.fail(element, f"Joint '{name}' of type {written}: a static model has fixed joints only.")
    reading.warn_unknown(element, _JOINT_TAGS, ("name", "type"))
    parent, child = read_ends(element, name, scope, reading)
    joint = JointDescription(element.where, name, kind, parent, child)
    _place(joint, element, scope, X_WM)
    axes = _read_axes(element, name, kind, scope, version, reading)
    _apply_axes(joint, axes, written, element, reading)
    if "screw_pitch" in joint_type.takes:
        joint.screw_pitch = _read_pitch(element, reading)
    model.elements.append(joint)
    _add_actuator(element, joint, axes, model, reading)
    _add_mimic(element, joint, model, scope, reading)


def read_ends(element: Element, name: str, scope: SdfScope, reading: Reading) -> tuple[FrameReference, FrameReference]:
    """The parent and the child link of a joint."""
    ends = []
    for role in ("parent", "child"):
        end = element.find(role) or element.find(f"drake:{role}")
        if end is None or not end.text.strip():
            reading.fail(element, f"Joint '{name}' has no <{role}>.")
        ends.append(reference(scope, end.text.strip(), end))
    if ends[1].is_world:
        reading.fail(element, f"Joint '{name}': the world cannot be a child.")
    return ends[0], ends[1]


def _place(joint: JointDescription, element: Element, scope: SdfScope, X_WM: RigidTransform) -> None:
    """The joint's pose in its parent and child link, in the configuration the file shows."""
    X_MJ = scope.pose(joint.name, element.where)
    X_MC = scope.pose_of_body(joint.child.scope, joint.child.name, element.where)
    joint.X_CM = X_MC.inverse() @ X_MJ
    if joint.parent.is_world:
        X_PJ = X_WM @ X_MJ
    else:
        X_PJ = scope.pose_of_body(joint.parent.scope, joint.parent.name, element.where).inverse() @ X_MJ
    joint.X_PF = None if X_PJ.IsExactlyIdentity() else X_PJ


def _read_axes(
    element: Element, name: str, kind: str, scope: SdfScope, version: tuple[int, int], reading: Reading
) -> list[_Axis]:
    found = [element.find(tag) for tag in ("axis", "axis2")]
    if kind == "weld":
        reading.pass_over(*element.find_all("axis", "axis2"))
        return []
    if "axis" in JOINT_TYPES[kind].takes and found[0] is None:
        reading.fail(element, f"Joint '{name}' needs an <axis>.")
    if kind == "universal" and (found[0] is None or found[1] is None):
        reading.fail(element, f"Universal joint '{name}' needs <axis> and <axis2>.")
    return [read_axis(axis, name, scope, version, reading) for axis in found if axis is not None]


def read_axis(axis: Element, name: str, scope: SdfScope, version: tuple[int, int], reading: Reading) -> _Axis:
    """What an `<axis>` of a joint says."""
    reading.warn_unknown(axis, ("xyz", "limit", "dynamics", "use_parent_model_frame", "initial_position"))
    xyz = axis.find("xyz")
    if xyz is not None:
        reading.warn_unknown(xyz, attributes=("expressed_in",))
    direction = child_vector(axis, "xyz", 3, reading, np.array([0.0, 0.0, 1.0]))
    length = float(np.linalg.norm(direction))
    if length < 1e-8:
        reading.fail(axis, f"The axis of joint '{name}' is zero.")
    expressed_in = "" if xyz is None else xyz.get("expressed_in", "")
    old_flag = axis.find("use_parent_model_frame")
    if version < (1, 5) or (old_flag is not None and reading.parse_bool(old_flag.text, old_flag.where, old_flag.tag)):
        expressed_in = MODEL_FRAME
    direction = direction / length
    if expressed_in:
        R_MJ = scope.pose(name, axis.where).rotation()
        R_ME = scope.pose(expressed_in, axis.where).rotation()
        direction = R_MJ.inverse() @ (R_ME @ direction)
    return _Axis(direction, _read_limits(axis, name, reading), *_read_dynamics(axis, name, reading))


def _read_limits(axis: Element, name: str, reading: Reading) -> JointLimits:
    limit = axis.find("limit")
    if limit is None:
        return JointLimits()
    known = ("lower", "upper", "effort", "velocity", "drake:acceleration")
    reading.warn_unknown(limit, known, silent=("stiffness",))

    def get(tag: str, default: float) -> float:
        return child_number(limit, tag, reading, default, infinite=True)

    limits = JointLimits(get("lower", -np.inf), get("upper", np.inf), get("velocity", np.inf))
    limits.acceleration, limits.effort = get("drake:acceleration", np.inf), get("effort", np.inf)
    if limits.velocity < 0.0:  # by the specification: no limit
        limits.velocity = np.inf
    if limits.effort < 0.0:
        limits.effort = np.inf
    if limits.acceleration < 0.0:
        reading.fail(limit, f"Joint '{name}': the acceleration limit must not be negative.")
    if limits.lower > limits.upper:
        reading.fail(limit, f"Joint '{name}': lower limit {limits.lower:g} is above upper limit {limits.upper:g}.")
    return limits


def _read_dynamics(axis: Element, name: str, reading: Reading) -> tuple[float, tuple[float, float] | None]:
    dynamics = axis.find("dynamics")
    if dynamics is None:
        return 0.0, None
    reading.warn_unknown(dynamics, ("damping", "friction", "spring_stiffness", "spring_reference"))
    damping = child_number(dynamics, "damping", reading, 0.0)
    if damping < 0.0:
        reading.fail(dynamics, f"Joint '{name}': damping must not be negative, found {damping:g}.")
    friction = child_number(dynamics, "friction", reading, 0.0)
    if friction != 0.0:
        reading.warn(dynamics, f"Joint '{name}' has friction {friction:g}; it is ignored.")
    stiffness = child_number(dynamics, "spring_stiffness", reading, 0.0)
    if stiffness < 0.0:
        reading.fail(dynamics, f"Joint '{name}': spring stiffness must not be negative, found {stiffness:g}.")
    rest = child_number(dynamics, "spring_reference", reading, 0.0)
    return damping, (stiffness, rest) if stiffness > 0.0 else None


def _apply_axes(joint: JointDescription, axes: list[_Axis], written: str, element: Element, reading: Reading) -> None:
    if not axes:
        return
    first = axes[0]
    joint.damping = first.damping
    joint_type = joint.type
    if joint_type.has_one_axis:
        joint.axis = first.direction
        joint.limits = first.limits
        if written == "continuous":
            joint.limits.lower, joint.limits.upper = -np.inf, np.inf
        joint.spring = first.spring if joint_type.spring else None
        return
    if joint.kind == "ball_rpy":
        reading.warn(element, f"The axis of ball joint '{joint.name}' is ignored, except for its damping.")
    if joint.kind == "universal":
        if axes[0].damping != axes[1].damping:
            reading.warn(element, f"Universal joint '{joint.name}' has one damping: that of <axis> is used for both.")
        _align_universal(joint, axes[0].direction, axes[1].direction, element, reading)
    if any(axis.limits.effort != 0.0 for axis in axes):
        reading.warn(element, f"Joint '{joint.name}' ({written}) has an effort limit, but no actuator is made for it.")


def _align_universal(
    joint: JointDescription, first: np.ndarray, second: np.ndarray, element: Element, reading: Reading
) -> None:
    """A universal joint turns about the x- and y-axis of its frames: turns both to the axes of the file."""
    from sheldrake.math import RigidTransform, RotationMatrix

    if abs(first @ second) > 1e-9:
        reading.fail(element, f"The axes of universal joint '{joint.name}' must be at a right angle.")
    R_JI = RotationMatrix(np.column_stack([first, second, np.cross(first, second)]))
    X_JI = RigidTransform(R_JI, np.zeros(3))
    joint.X_PF = X_JI if joint.X_PF is None else joint.X_PF @ X_JI
    joint.X_CM = joint.X_CM @ X_JI


def _read_pitch(element: Element, reading: Reading) -> float:
    """Metres per turn; the older `<thread_pitch>` counts -radians per metre."""
    pitch = child_number(element, "screw_thread_pitch", reading)
    if pitch is not None:
        return pitch
    old = child_number(element, "thread_pitch", reading)
    if old is None:
        return 1.0
    if old == 0.0:
        reading.fail(element, "<thread_pitch> must not be zero.")
    reading.warn(
        element.find("thread_pitch") or element,
        "<thread_pitch> is outdated; write <screw_thread_pitch> in metres a turn.",
    )
    return -2.0 * np.pi / old


def _add_actuator(
    element: Element, joint: JointDescription, axes: list[_Axis], model: ModelDescription, reading: Reading
) -> None:
    """Every axis with an effort limit other than zero has an actuator named like its joint."""
    tags = ("drake:rotor_inertia", "drake:gear_ratio", "drake:controller_gains")
    if not joint.type.has_one_axis or axes[0].limits.effort == 0.0:
        for child in element.find_all(*tags):
            reading.warn(child, f"<{child.tag}> has no effect: joint '{joint.name}' has no actuator.")
            reading.pass_over(child)
        return
    actuator = ActuatorDescription(element.where, joint.name, joint.name, axes[0].limits.effort)
    actuator.rotor_inertia = child_number(element, tags[0], reading)
    actuator.gear_ratio = child_number(element, tags[1], reading)
    for tag, value in zip(tags, (actuator.rotor_inertia, actuator.gear_ratio)):
        if value is not None and value < 0.0:
            reading.fail(element, f"<{tag}> of joint '{joint.name}' must not be negative, found {value:g}.")
    actuator.gains = read_gains(element, f"joint '{joint.name}'", reading)
    model.elements.append(actuator)


def _add_mimic(
    element: Element, joint: JointDescription, model: ModelDescription, scope: SdfScope, reading: Reading
) -> None:
    """The coupler comes after all joints, so it is kept for the end of the model."""
    mimic = element.find("drake:mimic")
    if mimic is None:
        return
    reading.warn_unknown(mimic, attributes=("joint", "multiplier", "offset"))
    source = reading.name(mimic, f"<drake:mimic> of joint '{joint.name}'", "joint")
    ratio, offset = reading.number(mimic, "multiplier"), reading.number(mimic, "offset")
    if ratio is None or offset is None:
        reading.fail(mimic, f"<drake:mimic> of joint '{joint.name}' needs the attributes 'multiplier' and 'offset'.")
    if source == joint.name:
        reading.fail(mimic, f"Joint '{joint.name}' cannot mimic itself.")
    if source not in scope.places or scope.places[source].kind != "joint":
        reading.fail(mimic, f"Joint '{joint.name}' mimics joint '{source}', which does not exist.")
    model.couplers.append(CouplerDescription(mimic.where, joint.name, source, ratio, offset))


def drop_impossible_couplers(model: ModelDescription, reading: Reading) -> None:
    """Moves couplers behind the joints, without those that involve joints of several degrees of freedom."""
    joints = {joint.name: joint for joint in model.joints()}
    for coupler in model.couplers:
        joint, source = joints[coupler.joint], joints[coupler.source]
        if joint.type.has_one_dof and source.type.has_one_dof:
            model.elements.append(coupler)
        else:
            reading.warn(
                coupler,
                f"Joint '{joint.name}' ({joint.kind}) mimics '{source.name}' ({source.kind}): only joints with one "
                "degree of freedom can; the tag is ignored.",
            )
    model.couplers = []


def read_drake_joint(
    element: Element, model: ModelDescription, scope: SdfScope, X_WM: RigidTransform, reading: Reading
) -> None:
    """Adds a `<drake:joint>`; its frames are the named frames themselves."""
    name = reading.name(element, "<drake:joint>")
    written = reading.name(element, f"Joint '{name}'", "type")
    if written not in _CUSTOM_TYPES:
        known = ", ".join(_CUSTOM_TYPES)
        reading.fail(element, f"The type '{written}' of <drake:joint> '{name}' is unknown; known: {known}.")
    joint_type = _CUSTOM_TYPES[written]
    if element.find("pose") is not None:
        reading.fail(element, "<drake:joint> does not support <pose>; attach frames instead.")
    path: tuple[str, ...] = ("drake:curves", "drake:initial_tangent", "drake:plane_normal", "drake:is_periodic")
    path = path if "curvilinear_path" in joint_type.takes else ()
    reading.warn_unknown(element, ("drake:parent", "drake:child", "drake:damping", *path), ("name", "type"))
    ends = []
    for role in ("drake:parent", "drake:child"):
        end = element.find(role)
        if end is None or not end.text.strip():
            reading.fail(element, f"Joint '{name}' has no <{role}>.")
        ends.append(frame_reference(scope, end.text.strip(), end))
    joint = JointDescription(element.where, name, joint_type.name, ends[0], ends[1])
    if joint_type.damping_each:
        size = len(joint_type.velocities)
        joint.damping = child_vector(element, "drake:damping", size, reading, np.zeros(size))
    else:
        joint.damping = child_number(element, "drake:damping", reading, 0.0)
    if path:
        _read_path(element, joint, reading)
    if np.any(np.asarray(joint.damping) < 0.0):
        reading.fail(element, f"Joint '{name}': damping must not be negative.")
    model.elements.append(joint)


def frame_reference(scope: SdfScope, name: str, element: Element) -> FrameReference:
    """A link or explicit frame by possibly scoped name."""
    if name == "world":
        return FrameReference("world", is_world=True)
    if name != MODEL_FRAME and not name.endswith("::" + MODEL_FRAME):
        scope.find(name, element.where)
    *path, local = name.split("::")
    return FrameReference(local, tuple(path))


def _read_path(element: Element, joint: JointDescription, reading: Reading) -> None:
    def numbers(piece: Element, *names: str) -> list[float | None]:
        tags = [f"drake:{name}" for name in names]
        reading.warn_unknown(piece, tags)
        return [child_number(piece, tag, reading) for tag in tags]

    def vector(tag: str, default: list[float]) -> np.ndarray:
        """The vector in a child's own child <xyz>, as Drake writes it, or in the child's text."""
        child = element.find(tag)
        if child is None:
            return np.array(default)
        reading.warn_unknown(child, ["xyz"])
        return child_vector(*((element, tag) if child.find("xyz") is None else (child, "xyz")), 3, reading)

    periodic = child_text(element, "drake:is_periodic", "false")
    is_periodic = reading.parse_bool(periodic, element.where, "<drake:is_periodic>")
    read_path(element, joint, reading, numbers, vector, is_periodic)
