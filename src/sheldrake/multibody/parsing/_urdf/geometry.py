"""URDF shapes, materials, visuals and collisions into the geometries of a `BodyDescription`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sheldrake.common._text import untaken
from sheldrake.geometry import Shape
from sheldrake.geometry._shape_types import SHAPE_TYPES, ShapeType

from .._files.xml import Element
from .._model.description import BodyDescription, GeometryDescription
from .._reading.looks import Material, add_visual_roles, read_scale
from .._reading.proximity import read_proximity_properties
from .._reading.reading import Reading, make_pose

if TYPE_CHECKING:
    from sheldrake.geometry import Convex, Mesh
    from sheldrake.math import RigidTransform

_ORIGIN = ("xyz", "rpy")
_VISUAL_TAGS = (
    "origin",
    "geometry",
    "material",
    "drake:illustration_properties",
    "drake:perception_properties",
    "drake:accepting_renderer",
)
_COLLISION_TAGS = ("origin", "geometry", "drake:proximity_properties", "drake_compliance")


def read_origin(element: Element, reading: Reading, tag: str = "origin") -> RigidTransform:
    """The pose in an `<origin xyz rpy>` child; identity when there is none."""
    origin = element.find(tag)
    if origin is None:
        return make_pose(np.zeros(3), np.zeros(3))
    reading.warn_unknown(origin, attributes=_ORIGIN)
    xyz = reading.vector(origin, "xyz", 3, np.zeros(3))
    rpy = reading.vector(origin, "rpy", 3, np.zeros(3))
    return make_pose(xyz, rpy)


def read_material(element: Element, reading: Reading, materials: dict[str, Material]) -> Material | None:
    """The appearance a `<material>` element declares or refers to; a named declaration is added to `materials`.

    None, with a warning, when it refers to a material that no one declared.
    """
    reading.warn_unknown(element, tags=("color", "texture"), attributes=("name",))
    name = element.get("name")
    color, texture = element.find("color"), element.find("texture")
    if color is None and texture is None:
        if name in materials:
            return materials[name]
        known = ", ".join(materials) or "(none)"
        reading.warn(element, f"Material '{name}' has no colour or texture and is not declared before; known: {known}.")
        return None
    found = Material(element.where, _read_color(color, reading), _read_texture(texture, reading))
    earlier = materials.get(name) if name else None
    if earlier is not None and not earlier.looks_like(found):
        reading.warn(
            element,
            f"Material '{name}' was declared differently on line {earlier.where.line}; this declaration is used here.",
        )
    elif name:
        materials[name] = found
    return found


def _read_color(color: Element | None, reading: Reading) -> np.ndarray | None:
    if color is None:
        return None
    reading.warn_unknown(color, attributes=("rgba",))
    rgba = reading.vector(color, "rgba", 4)
    if rgba is None:
        reading.fail(color, "A <color> needs the attribute 'rgba' with four numbers.")
    if np.any(rgba < 0.0) or np.any(rgba > 1.0):
        reading.fail(color, f"The attribute 'rgba' must be between 0 and 1, found '{color.get('rgba')}'.")
    return rgba


def _read_texture(texture: Element | None, reading: Reading) -> str | None:
    """The path of the texture file; without a scene graph nobody looks for it."""
    if texture is None:
        return None
    reading.warn_unknown(texture, attributes=("filename",))
    if not reading.wants_geometry:
        return None
    if not (texture.get("filename") or "").strip():
        reading.warn(texture, "A <texture> without 'filename' is ignored.")
        return None
    return reading.resolve(reading.name(texture, "A <texture>", "filename"), texture.where_attribute("filename"))


def read_shape(geometry: Element, reading: Reading) -> Shape:
    """The shape inside a `<geometry>` element."""
    for child in geometry:
        if child.tag == "mesh" or child.tag in _MEASURED:
            extra = [other for other in geometry if other is not child]
            if extra:
                reading.pass_over(*extra)
                reading.warn(extra[0], f"A <geometry> has one shape; <{extra[0].tag}> is ignored.")
            if child.tag == "mesh":
                return _read_mesh(child, reading)
            return _read_measured(child, _MEASURED[child.tag], reading)
    found = ", ".join(f"<{child.tag}>" for child in geometry) or "nothing"
    known = ", ".join(f"<{tag}>" for tag in (*_MEASURED, "mesh"))
    reading.fail(geometry, f"A <geometry> needs a shape; found {found}, known are {known}.")


def _read_measured(element: Element, row: ShapeType, reading: Reading) -> Shape:
    """A shape whose numbers are in attributes of their own, or all in one."""
    names = next(tag.numbers for tag in row.urdf if tag.name == element.tag)
    reading.warn_unknown(element, attributes=names)
    if len(names) < len(row.shape._names):
        return row.shape(*_vector(element, names[0], len(row.shape._names), reading))
    values = []
    for name in names:
        value = reading.number(element, name)
        if value is None:
            reading.fail(element, f"A <{element.tag}> needs the attribute '{name}'.")
        if value < 0.0 or (value == 0.0 and not row.may_be_empty):
            reading.fail(element.where_attribute(name), f"The {name} of a <{element.tag}> must be positive: {value:g}.")
        values.append(value)
    return row.shape(*values)


def _vector(element: Element, name: str, size: int, reading: Reading) -> np.ndarray:
    values = reading.vector(element, name, size)
    if values is None:
        reading.fail(element, f"A <{element.tag}> needs the attribute '{name}'.")
    if np.any(values <= 0.0):
        where = element.where_attribute(name)
        reading.fail(where, f"The {name} of a <{element.tag}> must be positive: {element.get(name)}.")
    return values


def _read_mesh(element: Element, reading: Reading) -> Mesh | Convex:
    from sheldrake.geometry import Convex, Mesh

    reading.warn_unknown(element, tags=("drake:declare_convex",), attributes=("filename", "scale"))
    path = reading.resolve(reading.name(element, "A <mesh>", "filename"), element.where_attribute("filename"))
    scale = read_scale(element.get("scale"), reading, element.where_attribute("scale"))
    return (Mesh if element.find("drake:declare_convex") is None else Convex)(path, scale)


_MEASURED = {tag.name: row for row in SHAPE_TYPES.values() for tag in row.urdf}


def read_visual(element: Element, body: BodyDescription, reading: Reading, materials: dict[str, Material]) -> None:
    """Adds a `<visual>` to a body."""
    reading.warn_unknown(element, tags=_VISUAL_TAGS, attributes=("name",))
    material_element = element.find("material")
    material = None if material_element is None else read_material(material_element, reading, materials)
    if not reading.wants_geometry:
        reading.pass_over(element)
        return
    description = _read_placed_shape(element, body, reading, body.visuals, "visual")
    add_visual_roles(description, element, body.name, reading, material)
    if description.illustration is not None or description.perception is not None:
        body.visuals.append(description)


def read_collision(element: Element, body: BodyDescription, reading: Reading) -> None:
    """Adds a `<collision>` to a body."""
    reading.warn_unknown(element, tags=_COLLISION_TAGS, attributes=("name",))
    if not reading.wants_geometry:
        reading.pass_over(element)
        return
    description = _read_placed_shape(element, body, reading, body.collisions, "collision")

    def number_of(child: Element) -> float:
        reading.warn_unknown(child, attributes=("value",))
        value = reading.number(child, "value")
        if value is None:
            reading.fail(child, f"<{child.tag}> needs the attribute 'value'.")
        return value

    def text_of(child: Element) -> str:
        reading.warn_unknown(child, attributes=("value",))
        return reading.name(child, child.tag, "value")

    description.proximity = read_proximity_properties(
        element,
        reading,
        number_of,
        text_of,
        _old_friction(element, reading),
    )
    body.collisions.append(description)


def _old_friction(element: Element, reading: Reading) -> tuple[float, float] | None:
    """Coefficients in the retired `<drake_compliance>` tag; static and dynamic are child elements."""
    old = element.find("drake_compliance")
    if old is None:
        return None
    if element.find("drake:proximity_properties") is not None:
        reading.pass_over(old)
        reading.warn(old, "<drake_compliance> is ignored beside <drake:proximity_properties>; remove it.")
        return None
    reading.warn_unknown(old, tags=("static_friction", "dynamic_friction"))
    static, dynamic = (old.find(tag) for tag in ("static_friction", "dynamic_friction"))
    if static is None and dynamic is None:
        return None
    if static is None or dynamic is None:
        reading.fail(old, "<drake_compliance> needs both <static_friction> and <dynamic_friction>.")
    mu_s, mu_d = (reading.parse_number(child.text, child.where, f"<{child.tag}>") for child in (static, dynamic))
    if not 0.0 <= mu_d <= mu_s:
        reading.fail(old, f"Friction must satisfy 0 <= dynamic <= static, found {mu_d:g} and {mu_s:g}.")
    return mu_s, mu_d


def _read_placed_shape(
    element: Element, body: BodyDescription, reading: Reading, siblings: list[GeometryDescription], kind: str
) -> GeometryDescription:
    """Name, pose and shape of a visual or collision."""
    geometry = element.find("geometry")
    if geometry is None:
        reading.fail(element, f"Link '{body.name}' has a {kind} element without geometry.")
    reading.warn_unknown(geometry, tags=[child.tag for child in geometry])
    shape = read_shape(geometry, reading)
    taken = {sibling.name for sibling in siblings}
    wanted = element.get("name")
    if wanted is None or not wanted.strip():
        name = untaken(type(shape).__name__, taken, first=1)
    else:
        name = untaken(wanted, taken, first=1)
        if name != wanted:
            reading.warn(element, f"The {kind} name '{wanted}' of link '{body.name}' is taken; it becomes '{name}'.")
    return GeometryDescription(element.where, name, read_origin(element, reading), shape)
