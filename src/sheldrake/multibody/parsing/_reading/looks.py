"""How a visual looks: materials, texture scale and roles, the same for URDF and SDFormat."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from .._files.diagnostics import Location
from .._files.xml import Element
from .reading import Reading

if TYPE_CHECKING:
    from .._model.description import GeometryDescription


@dataclass
class Material:
    """A named appearance.

    Attributes:
        where: Its declaration.
        rgba: Diffuse colour (red, green, blue, opacity), shape (4,), or None.
        texture: The file of the diffuse texture, or None.
        shades: Further colours by property name (ambient, specular, emissive).
    """

    where: Location
    rgba: np.ndarray | None
    texture: str | None
    shades: dict[str, np.ndarray] = field(default_factory=dict)

    def looks_like(self, other: Material) -> bool:
        """True when colour and texture are the same."""
        if self.rgba is None or other.rgba is None:
            return self.rgba is other.rgba and self.texture == other.texture
        return np.array_equal(self.rgba, other.rgba) and self.texture == other.texture


def read_scale(text: str | None, reading: Reading, where: Location) -> np.ndarray:
    """A mesh scale, shape (3,), from one or three numbers."""
    if text is None:
        return np.ones(3)
    scale = reading.parse_vector(text, None, where, "the mesh scale")
    if scale.size == 1:
        scale = np.repeat(scale, 3)
    if scale.size != 3:
        reading.fail(where, f"The mesh scale needs one or three numbers, found '{text}'.")
    if np.any(np.abs(scale) < 1e-8):
        reading.fail(where, f"The mesh scale must not be zero, found '{text}'.")
    return scale


def add_visual_roles(
    description: GeometryDescription, element: Element, body_name: str, reading: Reading, material: Material | None
) -> None:
    """Sets illustration and perception properties, unless the element switches a role off."""
    from sheldrake.geometry import IllustrationProperties, PerceptionProperties, Rgba

    illustration, perception = IllustrationProperties(), PerceptionProperties()
    if material is not None:
        colours = {"diffuse": material.rgba, **material.shades}
        for name, rgba in colours.items():
            if rgba is not None:
                illustration.AddProperty("phong", name, Rgba(*rgba))
                perception.AddProperty("phong", name, Rgba(*rgba))
    if material is not None and material.texture is not None:
        for properties in (illustration, perception):
            properties.AddProperty("phong", "diffuse_map", material.texture)
    renderers = set()
    for child in element.find_all("drake:accepting_renderer"):
        reading.warn_unknown(child, attributes=("name",))
        # URDF has an attribute; in SDFormat the name is the text.
        renderers.add(child.text.strip() or reading.name(child, "A <drake:accepting_renderer>"))
    if renderers:
        perception.AddProperty("renderer", "accepting", renderers)
    if _is_enabled(element, "drake:illustration_properties", reading):
        description.illustration = illustration
    if _is_enabled(element, "drake:perception_properties", reading):
        description.perception = perception
    elif renderers:
        reading.warn(element, "<drake:accepting_renderer> has no effect: the perception role is switched off.")
    if description.illustration is None and description.perception is None:
        reading.warn(
            element,
            f"A visual of link '{body_name}' has both the illustration and the perception role switched off and is "
            "ignored.",
        )


def _is_enabled(element: Element, tag: str, reading: Reading) -> bool:
    child = element.find(tag)
    if child is None:
        return True
    reading.warn_unknown(child, attributes=("enabled",))
    text = child.get("enabled", "true")
    return reading.parse_bool(text, child.where_attribute("enabled"), f"<{tag}> enabled")
