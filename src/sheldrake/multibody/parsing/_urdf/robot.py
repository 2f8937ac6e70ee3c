"""URDF: a `<robot>` element to a model description.

Links, frames and filters here; `joints` and `geometry` read the rest.
"""

from __future__ import annotations

import os
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from .._files.xml import Element
from .._model.check import check_model
from .._model.description import (
    BodyDescription,
    FrameDescription,
    FrameReference,
    ModelDescription,
)
from .._reading.extensions import EXTENSIONS, ExtensionReader
from .._reading.filter_groups import MEMBER, read_filter_group
from .._reading.inertia import make_spatial_inertia
from .._reading.reading import Reading, make_pose
from .geometry import Material, read_collision, read_material, read_origin, read_visual
from .joints import link_reference, read_joint, read_mimic, read_transmission

if TYPE_CHECKING:
    from sheldrake.multibody.tree import SpatialInertia

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
    for element in root.find_all("transmission"):
        read_transmission(element, model, reading)
    for element in root.find_all("frame"):
        _read_frame(element, model, reading)
    extensions = _UrdfExtensions(model, reading)
    for tag, read_extension in EXTENSIONS.items():
        for element in root.find_all(tag):
            read_extension(extensions, element)
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


def _read_link(element: Element, model: ModelDescription, reading: Reading, materials: dict[str, Material]) -> None:
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


def _read_inertial(element: Element, link: str, reading: Reading) -> SpatialInertia:
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


class _UrdfExtensions(ExtensionReader):
    """Names and numbers are attributes."""

    def number_in(self, child: Element) -> float:
        self.reading.warn_unknown(child, attributes=("value",))
        return self._there(child, self.reading.number(child, "value"))

    def vector_in(self, child: Element) -> np.ndarray:
        self.reading.warn_unknown(child, attributes=("value",))
        return self._there(child, self.reading.vector(child, "value", 3))

    def _there(self, child: Element, value: Any) -> Any:
        if value is None:
            self.reading.fail(child, f"<{child.tag}> needs the attribute 'value'.")
        return value

    def frame_in(self, child: Element) -> FrameReference:
        self.reading.warn_unknown(child, attributes=("name",))
        name = self.reading.name(child, f"<{child.tag}>")
        known = {body.name for body in self.model.bodies} | {"world"}
        known.update(item.name for item in self.model.elements if isinstance(item, FrameDescription))
        if name not in known:
            names = ", ".join(sorted(known))
            self.reading.fail(child, f"<{child.tag}> names '{name}', which is not in the model; known: {names}.")
        return link_reference(name)
