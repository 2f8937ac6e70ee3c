"""URDF: a `<robot>` element to a model description.

Links, frames and filters here; `joints` and `geometry` read the rest.
"""

import os
from dataclasses import replace

import numpy as np

from .._files.xml import Element
from .._model.check import check_model
from .._model.description import (
    BallConstraintDescription,
    BodyDescription,
    BushingDescription,
    FrameDescription,
    FrameReference,
    ModelDescription,
    SpringDamperDescription,
    TendonDescription,
)
from .._reading.filter_groups import MEMBER, read_filter_group
from .._reading.inertia import make_spatial_inertia
from .._reading.joints import check_spring_damper
from .._reading.reading import Reading, make_pose
from .geometry import Material, read_collision, read_material, read_origin, read_visual
from .joints import link_reference, read_joint, read_mimic, read_transmission

_ROBOT_TAGS = (
    "material",
    "link",
    "joint",
    "drake:joint",
    "transmission",
    "frame",
    "drake:collision_filter_group",
    "drake:linear_bushing_rpy",
    "drake:linear_spring_damper",
    "drake:ball_constraint",
    "drake:tendon_constraint",
)
_STRICTLY_REFUSED = ("safety_controller", "calibration", "verbose", "type", "coulomb_window")
SURFACE_VELOCITY_AXIS = "drake:surface_velocity_axis"
_MOMENTS = ("ixx", "iyy", "izz")
_PRODUCTS = ("ixy", "ixz", "iyz")


def read_urdf(root: Element, reading: Reading, model_name: str = "") -> ModelDescription:
    """The model that a URDF document describes.

    Args:
        root: The document's root, which must be `<robot>`.
        reading: Its surroundings.
        model_name: Used instead of the robot's own name when not empty.

    Raises:
        ParseError: When the document is not a usable URDF.
    """
    if root.tag != "robot":
        reading.fail(root, f"A URDF document has a <robot> element, found <{root.tag}>.")
    reading = replace(reading, strictly_refused=_STRICTLY_REFUSED)
    reading.warn_unknown(root, _ROBOT_TAGS, ("name",), silent=("gazebo", "loop_joint"))
    loop = root.find("loop_joint")
    if loop is not None:
        reading.fail(loop, "<loop_joint> is not supported; close the loop with <drake:ball_constraint> or a bushing.")
    model = ModelDescription(root.where, model_name or _robot_name(root, reading))
    materials: dict[str, Material] = {}
    for element in root.find_all("material"):
        read_material(element, reading, materials)
    for element in root.find_all("link"):
        _read_link(element, model, reading, materials)
    joints = [e for e in root.find_all("joint", "drake:joint") if not _is_ignored(e, reading)]
    for element in joints:
        read_joint(element, model, reading)
    for element in joints:
        read_mimic(element, model, reading)
    for element in root.find_all("drake:collision_filter_group"):
        _read_filter_group(element, model, reading)
    for tag, read in _EXTENSIONS:
        for element in root.find_all(tag):
            read(element, model, reading)
    check_model(model, reading.policy)
    return model


def _robot_name(root: Element, reading: Reading) -> str:
    name = root.get("name")
    if name is not None and name.strip():
        return name
    if reading.folder is None:
        reading.fail(root, "The <robot> needs a name: give it the attribute 'name'.")
    stem = os.path.splitext(os.path.basename(reading.source))[0]
    reading.warn(root, f"The <robot> has no name; it is called '{stem}' after its file.")
    return stem


def _is_ignored(element: Element, reading: Reading) -> bool:
    """True for elements that a file marks as not meant for this library."""
    text = element.get("drake_ignore")
    if text is None or not reading.parse_bool(text, element.where_attribute("drake_ignore"), "'drake_ignore'"):
        return False
    reading.pass_over(element)
    return True


def _read_link(element: Element, model: ModelDescription, reading: Reading, materials) -> None:
    if _is_ignored(element, reading):
        return
    name = reading.name(element, "<link>")
    tags = "inertial", "visual", "collision", SURFACE_VELOCITY_AXIS
    reading.warn_unknown(element, tags, ("name", "drake_ignore"), silent=("gazebo",))
    body = BodyDescription(element.where, name, is_world=name == "world")
    inertials = element.find_all("inertial")
    reading.pass_over(*(inertials if body.is_world else inertials[1:]))
    if body.is_world and inertials:
        reading.warn(inertials[0], "The link 'world' is the plant's world body; its <inertial> is ignored.")
    elif inertials:
        body.M_BBo_B = _read_inertial(inertials[0], name, reading)
        if len(inertials) > 1:
            reading.warn(inertials[1], f"Link '{name}' has several <inertial> elements; only the first is used.")
    axis = element.find(SURFACE_VELOCITY_AXIS)
    if axis is not None and body.is_world:
        reading.warn(
            axis, f"The link 'world' is the plant's world body, which has no surface; its <{axis.tag}> is ignored."
        )
    elif axis is not None:
        reading.warn_unknown(axis, attributes=("axis",))
        text = reading.name(axis, f"Link '{name}': <{axis.tag}>", "axis")
        body.surface_velocity_axis = reading.parse_vector(text, 3, axis.where_attribute("axis"), "attribute 'axis'")
    for child in element.find_all("visual"):
        read_visual(child, body, reading, materials)
    for child in element.find_all("collision"):
        read_collision(child, body, reading)
    model.bodies.append(body)


def _read_inertial(element: Element, link: str, reading: Reading):
    """M_BBo_B from mass, inertia and origin; what is absent is zero."""
    reading.warn_unknown(element, ("origin", "mass", "inertia"))
    mass_element, inertia = element.find("mass"), element.find("inertia")
    mass = 0.0
    if mass_element is not None:
        reading.warn_unknown(mass_element, attributes=("value",))
        mass = reading.number(mass_element, "value", 0.0)
    moments, products = [0.0] * 3, [0.0] * 3
    if inertia is not None:
        reading.warn_unknown(inertia, attributes=(*_MOMENTS, *_PRODUCTS))
        moments = [reading.number(inertia, name, 0.0) for name in _MOMENTS]
        products = [reading.number(inertia, name, 0.0) for name in _PRODUCTS]
    X_BI = read_origin(element, reading)
    return make_spatial_inertia(
        mass, X_BI, moments, products, lambda text: reading.warn(element, f"Link '{link}': {text}")
    )


def _read_frame(element: Element, model: ModelDescription, reading: Reading) -> None:
    name = reading.name(element, "<frame>")
    reading.warn_unknown(element, attributes=("name", "link", "xyz", "rpy"))
    link = reading.name(element, f"Frame '{name}'", "link")
    X_PF = make_pose(reading.vector(element, "xyz", 3, np.zeros(3)), reading.vector(element, "rpy", 3, np.zeros(3)))
    model.elements.append(FrameDescription(element.where, name, link_reference(link), X_PF))


def _read_filter_group(element: Element, model: ModelDescription, reading: Reading) -> None:
    def name_of(child: Element) -> str:
        attribute = "link" if child.tag == MEMBER else "name"
        reading.warn_unknown(child, attributes=(attribute,))
        return reading.name(child, f"<{child.tag}>", attribute)

    read_filter_group(element, model, reading, name_of)


def _child(element: Element, tag: str, reading: Reading) -> Element:
    child = element.find(tag)
    if child is None:
        reading.fail(element, f"<{element.tag}> needs a <{tag}> element.")
    return child


def _value(element: Element, tag: str, reading: Reading, size: "int | None" = None):
    """The number, or the vector of `size` numbers, in attribute `value` of a child."""
    child = _child(element, tag, reading)
    reading.warn_unknown(child, attributes=("value",))
    value = reading.number(child, "value") if size is None else reading.vector(child, "value", size)
    if value is None:
        reading.fail(child, f"<{tag}> needs the attribute 'value'.")
    return value


def _reference(element: Element, tag: str, model: ModelDescription, reading: Reading) -> FrameReference:
    """The link or frame named by a child; it must be in the model."""
    child = _child(element, tag, reading)
    reading.warn_unknown(child, attributes=("name",))
    name = reading.name(child, f"<{tag}>")
    known = {body.name for body in model.bodies}
    known.update(item.name for item in model.elements if isinstance(item, FrameDescription))
    known.add("world")
    if name not in known:
        reading.fail(child, f"<{tag}> names '{name}', which is not in the model; known: {', '.join(sorted(known))}.")
    return link_reference(name)


def _read_bushing(element: Element, model: ModelDescription, reading: Reading) -> None:
    prefix = "drake:bushing_"
    names = ("torque_stiffness", "torque_damping", "force_stiffness", "force_damping")
    reading.warn_unknown(element, [prefix + name for name in ("frameA", "frameC", *names)])
    frame_a, frame_c = (_reference(element, prefix + name, model, reading) for name in ("frameA", "frameC"))
    constants = [_value(element, prefix + name, reading, 3) for name in names]
    model.elements.append(BushingDescription(element.where, frame_a, frame_c, *constants))


def _read_spring_damper(element: Element, model: ModelDescription, reading: Reading) -> None:
    prefix = "drake:linear_spring_damper_"
    names = ("body_A", "p_AP", "body_B", "p_BQ", "free_length", "stiffness", "damping")
    reading.warn_unknown(element, [prefix + name for name in names])
    spring = SpringDamperDescription(
        element.where,
        _reference(element, prefix + "body_A", model, reading),
        _value(element, prefix + "p_AP", reading, 3),
        _reference(element, prefix + "body_B", model, reading),
        _value(element, prefix + "p_BQ", reading, 3),
        _value(element, prefix + "free_length", reading),
        _value(element, prefix + "stiffness", reading),
        _value(element, prefix + "damping", reading),
    )
    check_spring_damper(spring, reading)
    model.elements.append(spring)


def _read_ball_constraint(element: Element, model: ModelDescription, reading: Reading) -> None:
    prefix = "drake:ball_constraint_"
    reading.warn_unknown(element, [prefix + name for name in ("body_A", "p_AP", "body_B", "p_BQ")])
    model.elements.append(
        BallConstraintDescription(
            element.where,
            _reference(element, prefix + "body_A", model, reading),
            _value(element, prefix + "p_AP", reading, 3),
            _reference(element, prefix + "body_B", model, reading),
            _value(element, prefix + "p_BQ", reading, 3),
        )
    )


def _read_tendon(element: Element, model: ModelDescription, reading: Reading) -> None:
    prefix = "drake:tendon_constraint_"
    numbers = ("offset", "lower_limit", "upper_limit", "stiffness", "damping")
    reading.warn_unknown(element, [prefix + name for name in ("joint", *numbers)])
    known = {joint.name for joint in model.joints()}
    joints, coefficients = [], []
    for child in element.find_all(prefix + "joint"):
        reading.warn_unknown(child, attributes=("name", "a"))
        name, a = reading.name(child, f"<{child.tag}>"), reading.number(child, "a")
        if name not in known:
            reading.fail(child, f"<{child.tag}> names joint '{name}', which does not exist; known: {', '.join(known)}.")
        if a is None:
            reading.fail(child, f"<{child.tag}> needs the attribute 'a'.")
        joints.append(name)
        coefficients.append(a)
    if not joints:
        reading.fail(element, f"<{element.tag}> needs at least one <{prefix}joint>.")
    values = [_value(element, prefix + n, reading) if element.find(prefix + n) is not None else None for n in numbers]
    model.elements.append(TendonDescription(element.where, joints, np.array(coefficients), *values))


# In the order in which they are added to the plant.
_EXTENSIONS = (
    ("transmission", read_transmission),
    ("frame", _read_frame),
    ("drake:linear_bushing_rpy", _read_bushing),
    ("drake:linear_spring_damper", _read_spring_damper),
    ("drake:ball_constraint", _read_ball_constraint),
    ("drake:tendon_constraint", _read_tendon),
)
