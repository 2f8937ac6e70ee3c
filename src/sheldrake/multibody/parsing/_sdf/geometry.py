"""SDFormat shapes, visuals and collisions into the geometries of a `BodyDescription`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sheldrake.geometry import Shape
from sheldrake.geometry._shape_types import SHAPE_TYPES, ShapeType, Tag

from .._files.xml import Element
from .._model.description import BodyDescription, GeometryDescription
from .._reading.looks import Material, add_visual_roles, read_scale
from .._reading.proximity import read_proximity_properties
from .._reading.reading import Reading
from .children import child_number, child_vector, text_number
from .frames import SdfScope, read_pose, reference_of_pose
from .specification import refuse_undefined

if TYPE_CHECKING:
    from sheldrake.geometry import Convex, HalfSpace, Mesh
    from sheldrake.math import RigidTransform

_VISUAL_TAGS = (
    "pose",
    "geometry",
    "material",
    "drake:illustration_properties",
    "drake:perception_properties",
    "drake:accepting_renderer",
)


def read_link_pose(element: Element, link: str, scope: SdfScope, reading: Reading) -> RigidTransform:
    """The pose of a visual, collision or inertial in its link."""
    pose = element.find("pose")
    X_RP = read_pose(pose, reading)
    relative_to = reference_of_pose(pose)
    if pose is None or not relative_to:
        return X_RP
    X_ML = scope.pose(link, pose.where)
    return X_ML.inverse() @ scope.pose(relative_to, pose.where) @ X_RP


def read_shape(geometry: Element, reading: Reading) -> tuple[Shape | None, RigidTransform | None]:
    """(shape, its pose in the geometry frame or None), or (None, None) for an empty or unsupported geometry."""
    reading.warn_unknown(geometry, [child.tag for child in geometry])
    for child in geometry:
        extra = [other for other in geometry if other is not child]
        if extra:
            reading.pass_over(*extra)
            reading.policy.Note(extra[0], f"A <geometry> has one shape; <{extra[0].tag}> is ignored.")
        if child.tag in _MEASURED:
            return _read_measured(child, _MEASURED[child.tag], reading), None
        if child.tag in _READERS:
            return _READERS[child.tag](child, reading)
        if child.tag == "empty":
            return None, None
        refuse_undefined(geometry, child, reading)
        reading.pass_over(child)
        reading.warn(child, f"The shape <{child.tag}> is not supported; this geometry is ignored.")
        return None, None
    reading.warn(geometry, "A <geometry> without a shape is ignored.")
    return None, None


def _read_measured(element: Element, row: ShapeType, reading: Reading) -> Shape:
    """A shape whose numbers are in children of their own, or all in one."""
    tag = next(tag for tag in row.sdf if tag.name == element.tag)
    reading.warn_unknown(element, tag.numbers)
    if len(tag.numbers) < len(row.shape._names):
        return row.shape(*_vector(element, tag, reading))
    values = []
    for index, name in enumerate(tag.numbers):
        value = child_number(element, name, reading)
        if value is None:
            value = _absent(element, tag, name, reading)[index]
        if value < 0.0 or (value == 0.0 and not row.may_be_empty):
            reading.fail(element.find(name) or element, f"The {name} of a <{element.tag}> must be positive: {value:g}.")
        values.append(value)
    return row.shape(*values)


def _vector(element: Element, tag: Tag, reading: Reading) -> np.ndarray:
    values = child_vector(element, tag.numbers[0], 3, reading)
    if values is None:
        return np.array(_absent(element, tag, tag.numbers[0], reading))
    if np.any(values <= 0.0):
        reading.fail(element, f"The <{tag.numbers[0]}> of a <{element.tag}> needs three positive numbers.")
    return values


def _absent(element: Element, tag: Tag, name: str, reading: Reading) -> tuple[float, ...]:
    """What the specification has for the numbers of a shape, of which a file leaves out some."""
    if not tag.absent:
        reading.fail(element, f"A <{element.tag}> needs a <{name}>.")
    index = tag.numbers.index(name)
    known = tag.absent if len(tag.numbers) == 1 else tag.absent[index : index + 1]
    lengths = " ".join(f"{length:g}" for length in known)
    reading.warn(element, f"A <{element.tag}> has no <{name}>; by the specification it is {lengths} m.")
    return tag.absent


def _read_plane(element: Element, reading: Reading) -> tuple[HalfSpace, RigidTransform]:
    """A plane is the boundary of a half space; its size is for drawing only."""
    from sheldrake.geometry import HalfSpace

    reading.warn_unknown(element, ("normal", "size"))
    normal = child_vector(element, "normal", 3, reading, np.array([0.0, 0.0, 1.0]))
    if np.linalg.norm(normal) < 1e-8:
        reading.fail(element, "The <normal> of a <plane> is zero.")
    return HalfSpace(), HalfSpace.MakePose(normal / np.linalg.norm(normal), np.zeros(3))


def _read_mesh(element: Element, reading: Reading) -> tuple[Mesh | Convex, None]:
    from sheldrake.geometry import Convex, Mesh

    reading.warn_unknown(element, ("uri", "scale", "drake:declare_convex"))
    uri = element.find("uri")
    if uri is None or not uri.text.strip():
        reading.fail(element, "A <mesh> needs a <uri>.")
    path = reading.resolve(uri.text, uri.where)
    scale = element.find("scale")
    factors = read_scale(
        None if scale is None else scale.text, reading, element.where if scale is None else scale.where
    )
    return (Mesh if element.find("drake:declare_convex") is None else Convex)(path, factors), None


_MEASURED = {tag.name: row for row in SHAPE_TYPES.values() for tag in row.sdf}
_READERS = {"plane": _read_plane, "mesh": _read_mesh}


def without_drake_prefix(element: Element) -> Element:
    """A copy of `<drake:visual>` whose standard tags have lost their `drake:` prefix."""
    keep = {*_VISUAL_TAGS, *_MEASURED, "drake:declare_convex", "drake:diffuse_map"}
    tag = element.tag if element.tag in keep else element.tag.removeprefix("drake:")
    copy = element.renamed(tag)
    copy.children = [without_drake_prefix(child) for child in element.children]
    return copy


def read_visual(element: Element, body: BodyDescription, scope: SdfScope, reading: Reading) -> None:
    """Adds a `<visual>` to a body."""
    reading.warn_unknown(element, _VISUAL_TAGS, ("name",))
    description = _read_placed_shape(element, body, scope, reading, body.visuals)
    if description is None:
        return
    add_visual_roles(description, element, body.name, reading, _read_material(element, reading))
    if description.illustration is not None or description.perception is not None:
        body.visuals.append(description)


def read_collision(element: Element, body: BodyDescription, scope: SdfScope, reading: Reading) -> None:
    """Adds a `<collision>` to a body."""
    tags = ("pose", "geometry", "surface", "density", "drake:proximity_properties")
    reading.warn_unknown(element, tags, ("name",), silent=("auto_inertia_params",))
    description = _read_placed_shape(element, body, scope, reading, body.collisions)
    if description is None:
        return
    description.proximity = read_proximity_properties(
        element,
        reading,
        lambda child: text_number(child, reading),
        lambda child: child.text.strip(),
        _read_ode_friction(element, reading),
    )
    body.collisions.append(description)


def _read_placed_shape(
    element: Element, body: BodyDescription, scope: SdfScope, reading: Reading, siblings: list[GeometryDescription]
) -> GeometryDescription | None:
    kind = element.tag
    name = reading.name(element, f"<{kind}>")
    geometry = element.find("geometry")
    if geometry is None:
        reading.warn(element, f"The {kind} '{name}' of link '{body.name}' has no <geometry> and is ignored.")
        return None
    if any(sibling.name == name for sibling in siblings):
        reading.fail(element, f"Link '{body.name}' already has a {kind} named '{name}'.")
    shape, X_GS = read_shape(geometry, reading)
    if shape is None:
        return None
    X_LG = read_link_pose(element, body.name, scope, reading)
    return GeometryDescription(element.where, name, X_LG if X_GS is None else X_LG @ X_GS, shape)


def _read_material(visual: Element, reading: Reading) -> Material | None:
    """Colours and texture of a `<material>`."""
    material = visual.find("material")
    if material is None:
        return None
    shades = ("ambient", "specular", "emissive")
    reading.warn_unknown(material, ("diffuse", *shades, "drake:diffuse_map"))
    texture = material.find("drake:diffuse_map")
    path = None if texture is None else reading.resolve(texture.text, texture.where)
    colours = {tag: _read_colour(material.find(tag), reading) for tag in ("diffuse", *shades)}
    diffuse = colours.pop("diffuse")
    return Material(material.where, diffuse, path, {name: rgba for name, rgba in colours.items() if rgba is not None})


def _read_colour(element: Element | None, reading: Reading) -> np.ndarray | None:
    """Red, green, blue and opacity, shape (4,), in single precision as SDFormat has them."""
    if element is None:
        return None
    values = reading.parse_vector(element.text, None, element.where, f"<{element.tag}>")
    if values.size not in (3, 4) or np.any(values < 0.0) or np.any(values > 1.0):
        found = element.text.strip()
        reading.fail(element, f"<{element.tag}> needs three or four numbers from 0 to 1, found '{found}'.")
    return np.append(values, 1.0)[:4].astype(np.float32).astype(float)


def _read_ode_friction(collision: Element, reading: Reading) -> tuple[float, float] | None:
    """Static and dynamic friction from `<surface><friction><ode><mu> <mu2>`."""
    ode = collision
    for tag, *known in (("surface", "friction"), ("friction", "ode"), ("ode", "mu", "mu2")):
        child = ode.find(tag)
        if child is None:
            return None
        reading.note_unknown(child, known)
        ode = child
    mu, mu2 = (child_number(ode, tag, reading) for tag in ("mu", "mu2"))
    if mu is None and mu2 is None:
        return None
    block = collision.find("drake:proximity_properties")
    if block is not None and (block.find("drake:mu_static") or block.find("drake:mu_dynamic")):
        reading.warn(ode, "<mu> and <mu2> are ignored beside <drake:mu_static> and <drake:mu_dynamic>.")
        return None
    static = 1.0 if mu is None else mu
    dynamic = 1.0 if mu2 is None else mu2
    if not 0.0 <= dynamic <= static:
        reading.fail(ode, f"Friction must satisfy 0 <= <mu2> <= <mu>, found {dynamic:g} and {static:g}.")
    return static, dynamic
