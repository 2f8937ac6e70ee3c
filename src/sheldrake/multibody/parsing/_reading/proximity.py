"""Contact properties of a collision shape from drake: tags, the same for URDF and SDFormat."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from .._files.xml import Element
from .reading import Reading

if TYPE_CHECKING:
    from sheldrake.geometry import ProximityProperties

DEFAULT_FRICTION = 1.0  # of a shape whose file says nothing about friction

_TAG = "drake:proximity_properties"
# tag, property group, property name, may be zero
_NUMBERS = (
    ("drake:mesh_resolution_hint", "hydroelastic", "resolution_hint", False),
    ("drake:hydroelastic_modulus", "hydroelastic", "hydroelastic_modulus", False),
    ("drake:hydroelastic_margin", "hydroelastic", "margin", True),
    ("drake:hunt_crossley_dissipation", "material", "hunt_crossley_dissipation", True),
    ("drake:relaxation_time", "material", "relaxation_time", True),
    ("drake:point_contact_stiffness", "material", "point_contact_stiffness", False),
)
_SURFACE = ("drake:mesh_resolution_hint", "drake:hydroelastic_modulus")  # for shapes with a hydroelastic surface alone
_FLAGS = ("drake:rigid_hydroelastic", "drake:compliant_hydroelastic")
_FRICTION = ("drake:mu_static", "drake:mu_dynamic")
_KNOWN = (*(row[0] for row in _NUMBERS), *_FLAGS, *_FRICTION, "drake:point_contact_algorithm")


def read_proximity_properties(
    collision: Element,
    reading: Reading,
    number_of: Callable[[Element], float],
    text_of: Callable[[Element], str],
    fallback_friction: tuple[float, float] | None,
) -> ProximityProperties:
    """The ProximityProperties that a collision element declares.

    Args:
        collision: The `<collision>` element.
        reading: Receives warnings and errors.
        number_of: Reads the number of a child element: an attribute in URDF, text in SDFormat.
        text_of: Reads the word of a child element likewise.
        fallback_friction: Static and dynamic coefficient given by other tags, used when the drake: tags give none.
    """
    from sheldrake.geometry import ProximityProperties

    properties = ProximityProperties()
    block = collision.find(_TAG)
    if block is None:
        _add_friction(properties, fallback_friction or (DEFAULT_FRICTION, DEFAULT_FRICTION))
        return properties
    _refuse_retired_tag(block, reading)
    reading.warn_unknown(block, tags=_KNOWN)
    rigid, compliant = _read_compliance(block, properties, reading)
    for tag, group, name, may_be_zero in _NUMBERS:
        element = block.find(tag)
        if element is None:
            continue
        value = number_of(element)
        if rigid and tag == "drake:hydroelastic_modulus":
            reading.warn(element, f"A rigid geometry has no <{tag}>; its value {value:g} is ignored.")
            continue
        is_unused = tag in _SURFACE and not (rigid or compliant)
        if not is_unused and (value < 0.0 or (value == 0.0 and not may_be_zero)):
            kind = "non-negative" if may_be_zero else "positive"
            reading.fail(element, f"<{tag}> must be {kind}, found {value:g}.")
        properties.AddProperty(group, name, value)
    algorithm = block.find("drake:point_contact_algorithm")
    if algorithm is not None:
        properties.AddProperty("material", "point_contact_algorithm", text_of(algorithm))
    _add_friction(properties, _read_friction(block, reading, number_of, fallback_friction))
    return properties


def _refuse_retired_tag(block: Element, reading: Reading) -> None:
    retired = block.find("drake:soft_hydroelastic")
    if retired is not None:
        reading.fail(retired, "<drake:soft_hydroelastic> is retired; write <drake:compliant_hydroelastic>.")


def _read_compliance(block: Element, properties: ProximityProperties, reading: Reading) -> tuple[bool, bool]:
    """Adds the compliance type; whether the shape is rigid, and whether it is compliant."""
    from sheldrake.geometry import AddCompliantHydroelasticPropertiesForHalfSpace, AddRigidHydroelasticProperties

    rigid, compliant = (block.find(tag) for tag in _FLAGS)
    if rigid is not None and compliant is not None:
        reading.fail(
            compliant,
            f"A collision is either <{_FLAGS[0]}> (line {rigid.line}) or <{_FLAGS[1]}> (line {compliant.line}), "
            "not both.",
        )
    if rigid is not None:
        AddRigidHydroelasticProperties(properties=properties)
    elif compliant is not None:
        # The compliance type has no public setter of its own; numbers the file does not give are left to the
        # scene graph's defaults.
        AddCompliantHydroelasticPropertiesForHalfSpace(1.0, 1.0, properties)
        properties.RemoveProperty("hydroelastic", "slab_thickness")
        properties.RemoveProperty("hydroelastic", "hydroelastic_modulus")
    return rigid is not None, compliant is not None


def _read_friction(
    block: Element, reading: Reading, number_of: Callable[[Element], float], fallback: tuple[float, float] | None
) -> tuple[float, float]:
    """Static and dynamic coefficients; when only one is given it is used for both."""
    found = []
    for tag in _FRICTION:
        element = block.find(tag)
        value = None if element is None else number_of(element)
        if element is not None and value is not None and value < 0.0:
            reading.fail(element, f"<{tag}> must not be negative, found {value:g}.")
        found.append(value)
    static, dynamic = found
    if static is None or dynamic is None:
        one = dynamic if static is None else static
        return (one, one) if one is not None else fallback or (DEFAULT_FRICTION, DEFAULT_FRICTION)
    if dynamic > static:
        reading.fail(block, f"Dynamic friction ({dynamic:g}) must not exceed static friction ({static:g}).")
    return static, dynamic


def _add_friction(properties: ProximityProperties, friction: tuple[float, float]) -> None:
    from sheldrake.multibody.plant import CoulombFriction

    properties.AddProperty("material", "coulomb_friction", CoulombFriction(*friction))
