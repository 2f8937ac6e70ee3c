"""What URDF and SDFormat have in common: inertias, axes, force elements, contact properties, filter groups, looks."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.geometry import Shape
from sheldrake.geometry._shape_types import Tag
from sheldrake.multibody.parsing._model.description import GeometryDescription

from ._model_parts import STANDARD_GRAVITY, JointPart, ModelParts
from ._xml_tree import Node

if TYPE_CHECKING:
    from sheldrake.multibody.tree import Frame, RigidBody

_NUMBERS = (
    ("hydroelastic", "resolution_hint", "drake:mesh_resolution_hint"),
    ("hydroelastic", "hydroelastic_modulus", "drake:hydroelastic_modulus"),
    ("hydroelastic", "margin", "drake:hydroelastic_margin"),
    ("material", "hunt_crossley_dissipation", "drake:hunt_crossley_dissipation"),
    ("material", "relaxation_time", "drake:relaxation_time"),
    ("material", "point_contact_stiffness", "drake:point_contact_stiffness"),
    ("material", "point_contact_algorithm", "drake:point_contact_algorithm"),
)


def central_inertia(body: RigidBody) -> tuple[float, np.ndarray, np.ndarray]:
    """Mass [kg], centre of mass in B [m], inertia about it in B [kg m^2]."""
    M_BBo_B = body.default_spatial_inertia()
    mass = float(M_BBo_B.get_mass())
    if not np.isfinite(mass):
        raise ValueError(f"Body '{body.name()}' has no finite mass; it can not be written.")
    p_BoBcm_B = np.asarray(M_BBo_B.get_com(), dtype=float)
    if mass == 0.0:
        return 0.0, np.zeros(3), np.zeros((3, 3))
    I_BBcm_B = M_BBo_B.Shift(p_BoBcm_B).CalcRotationalInertia().CopyToFullMatrix3()
    return mass, p_BoBcm_B, np.asarray(I_BBcm_B, dtype=float)


def axis_of(part: JointPart) -> np.ndarray | None:
    """Axis of a joint in frame F, shape (3,), or None."""
    return part.joint._axis


def measures(shape: Shape, tag: Tag) -> dict[str, Any]:
    """The numbers of a shape by the names that a format has for them."""
    values = shape._values()
    return {tag.numbers[0]: list(values)} if len(tag.numbers) < len(values) else dict(zip(tag.numbers, values))


def add_forces(
    root: Node, parts: ModelParts, put: Callable[..., None], name_it: Callable[[Node, str, str], None]
) -> None:
    """Adds bushings, spring-dampers and ball constraints; `put` writes a value, `name_it` a name."""
    for force in parts.forces:
        if type(force).__name__ == "LinearSpringDamper":
            prefix = "drake:linear_spring_damper"
            node = root.add(prefix)
            name_it(node, f"{prefix}_body_A", parts.names[force.bodyA().index()])
            put(node, f"{prefix}_p_AP", force.p_AP())
            name_it(node, f"{prefix}_body_B", parts.names[force.bodyB().index()])
            put(node, f"{prefix}_p_BQ", force.p_BQ())
            for key in ("free_length", "stiffness", "damping"):
                put(node, f"{prefix}_{key}", getattr(force, key)())
            continue
        node = root.add("drake:linear_bushing_rpy")
        for letter in "AC":
            name_it(node, f"drake:bushing_frame{letter}", _frame_name(getattr(force, f"frame{letter}")(), parts))
        for key in ("torque_stiffness", "torque_damping", "force_stiffness", "force_damping"):
            put(node, f"drake:bushing_{key}", getattr(force, f"{key}_constants")())
    for one, p_AP, other, p_BQ in parts.balls:
        prefix = "drake:ball_constraint"
        node = root.add(prefix)
        name_it(node, f"{prefix}_body_A", one)
        put(node, f"{prefix}_p_AP", p_AP)
        name_it(node, f"{prefix}_body_B", other)
        put(node, f"{prefix}_p_BQ", p_BQ)


def _frame_name(frame: Frame, parts: ModelParts) -> str:
    if frame.is_body_frame():
        return parts.names[frame.body().index()]
    return frame.name()


def add_proximity(parent: Node, geometry: GeometryDescription, put: Callable[[Node, str, Any], None]) -> None:
    """Adds `<drake:proximity_properties>`; `put` adds a value in the manner of the format."""
    properties = geometry.proximity
    block = Node("drake:proximity_properties")
    compliance = str(properties.GetPropertyOrDefault("hydroelastic", "compliance_type", "")).lower()
    for word in ("rigid", "compliant"):
        if word in compliance or (word == "compliant" and "soft" in compliance):
            block.add(f"drake:{word}_hydroelastic")
    for group, name, tag in _NUMBERS:
        if properties.HasProperty(group, name) and not (name == "hydroelastic_modulus" and "rigid" in compliance):
            put(block, tag, properties.GetProperty(group, name))
    if properties.HasProperty("material", "coulomb_friction"):
        friction = properties.GetProperty("material", "coulomb_friction")
        put(block, "drake:mu_static", friction.static_friction())
        put(block, "drake:mu_dynamic", friction.dynamic_friction())
    if block.children:
        parent.children.append(block)


def add_filters(parent: Node, parts: ModelParts, extra: list[tuple[str, str]], name_it: Callable[..., None]) -> None:
    """One collision filter group a body, each naming the groups of the bodies that it passes through."""
    partners: dict[str, list[str]] = {}
    for one, other in [*parts.filtered, *extra]:
        partners.setdefault(one, []).append(other)
        partners.setdefault(other, [])
    for one, others in partners.items():
        group = parent.add("drake:collision_filter_group", name=f"only_{one}")
        name_it(group, "drake:member", one, "link")
        for other in others:
            name_it(group, "drake:ignored_collision_filter_group", f"only_{other}", "name")


def colours(geometry: GeometryDescription) -> dict[str, np.ndarray]:
    """Red, green, blue and opacity by kind of light (`diffuse`, ...), shape (4,)."""
    properties = geometry.illustration or geometry.perception
    if properties is None or not properties.HasGroup("phong"):
        return {}
    kinds = ("diffuse", "ambient", "specular", "emissive")
    return {k: _rgba(properties.GetProperty("phong", k)) for k in kinds if properties.HasProperty("phong", k)}


def _rgba(value: Any) -> np.ndarray:
    return np.array([value.r(), value.g(), value.b(), value.a()] if hasattr(value, "r") else value, dtype=float)


def texture(geometry: GeometryDescription) -> str | None:
    """Path of the image on the surface, or None."""
    properties = geometry.illustration or geometry.perception
    if properties is None or not properties.HasProperty("phong", "diffuse_map"):
        return None
    return str(properties.GetProperty("phong", "diffuse_map"))


def image_name(geometry: GeometryDescription, folder: Path) -> str | None:
    """The image on the surface as a file in `folder` names it, or None."""
    image = texture(geometry)
    if image is None:
        return None
    return (os.path.relpath(image, folder) if os.path.isabs(image) else image).replace(os.sep, "/")


def add_viewers(node: Node, geometry: GeometryDescription) -> None:
    """Adds who does not see a visual geometry: roles that it lacks, and renderers other than those named."""
    for role in ("illustration", "perception"):
        if getattr(geometry, role) is None:
            node.add(f"drake:{role}_properties", enabled="false")
    for renderer in accepting(geometry):
        node.add("drake:accepting_renderer", name=renderer)


def check_looks(parts: ModelParts) -> None:
    """Notes properties of looks that the formats do not have."""
    known = {("phong", name) for name in ("diffuse", "ambient", "specular", "emissive", "diffuse_map")}
    known |= {("renderer", "accepting"), ("label", "id")}
    for body in [parts.world, *parts.bodies]:
        for geometry in body.visuals:
            for properties in (geometry.illustration, geometry.perception):
                for group in sorted(properties.GetGroupNames() if properties is not None else ()):
                    for key in properties.GetPropertiesInGroup(group):
                        text = f"property ({group}, {key}) of visual geometries"
                        if (group, key) not in known and text not in parts.losses:
                            parts.losses.append(text)


def check_gravity(parts: ModelParts) -> None:
    """Notes gravity of its own, which is the world's business in URDF and SDFormat."""
    if not has_standard_gravity(parts):
        parts.losses.append(f"gravity {parts.gravity.tolist()} m/s^2: models do not say it")


def has_standard_gravity(parts: ModelParts) -> bool:
    """Whether gravity is what every reader takes for granted."""
    return np.allclose(parts.gravity, STANDARD_GRAVITY, rtol=0.0, atol=1e-12)


def accepting(geometry: GeometryDescription) -> list[str]:
    """Names of the renderers that show the shape; empty for all."""
    properties = geometry.perception
    if properties is None or not properties.HasProperty("renderer", "accepting"):
        return []
    return sorted(properties.GetProperty("renderer", "accepting"))
