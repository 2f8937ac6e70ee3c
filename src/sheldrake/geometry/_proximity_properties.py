"""Contact material and hydroelastic representation as proximity properties."""

from __future__ import annotations

from typing import Any
from typing import overload as typing_overload

from sheldrake.common._checked import checked
from sheldrake.common._text import number
from sheldrake.geometry._properties import ProximityProperties
from sheldrake.geometry._roles import HydroelasticType
from sheldrake.multibody.math._coulomb_friction import CoulombFriction

MATERIAL = "material"
FRICTION = "coulomb_friction"
DISSIPATION = "hunt_crossley_dissipation"
RELAXATION_TIME = "relaxation_time"
POINT_STIFFNESS = "point_contact_stiffness"
HYDRO = "hydroelastic"
COMPLIANCE_TYPE = "compliance_type"
MODULUS = "hydroelastic_modulus"
RESOLUTION_HINT = "resolution_hint"
SLAB_THICKNESS = "slab_thickness"
MARGIN = "margin"

#: How many contact points a pair of touching geometries reports: up to four well-spread points of a touching face or
#: edge ("multi_point"), or the deepest one ("single_point").
POINT_CONTACT_ALGORITHM = "point_contact_algorithm"
POINT_CONTACT_ALGORITHMS = ("multi_point", "single_point")


@typing_overload
def AddContactMaterial(
    properties: ProximityProperties,
    dissipation: float | None = None,
    point_stiffness: float | None = None,
    friction: CoulombFriction | None = None,
) -> None: ...
@typing_overload
def AddContactMaterial(
    dissipation: float | None,
    point_stiffness: float | None,
    friction: CoulombFriction | None,
    properties: ProximityProperties,
) -> None: ...
def AddContactMaterial(*args: Any, **kwargs: Any) -> None:
    """Adds point contact material to proximity properties.

    Called as `AddContactMaterial(properties, dissipation=None, point_stiffness=None, friction=None)`; the older order
    `(dissipation, point_stiffness, friction, properties)` works too.

    Args:
        dissipation: Hunt-Crossley dissipation [s/m], not negative.
        point_stiffness: stiffness of one contact point [N/m], positive.
        friction: CoulombFriction.
        properties: the ProximityProperties to add to; what is None is not added.

    Raises:
        RuntimeError: a value out of range, or one of the properties exists already.
    """
    new_order = not args or isinstance(args[0], ProximityProperties)
    (_add_contact_material if new_order else _add_contact_material_old_order)(*args, **kwargs)


def _add_contact_material_old_order(
    dissipation: float | None,
    point_stiffness: float | None,
    friction: CoulombFriction | None,
    properties: ProximityProperties,
) -> None:
    _add_contact_material(properties, dissipation, point_stiffness, friction)


def _add_contact_material(
    properties: ProximityProperties,
    dissipation: float | None = None,
    point_stiffness: float | None = None,
    friction: CoulombFriction | None = None,
) -> None:
    _require_proximity("AddContactMaterial", properties)
    if dissipation is not None:
        if not dissipation >= 0.0:
            raise RuntimeError(f"The dissipation can't be negative; given {number(dissipation)}")
        properties.AddProperty(MATERIAL, DISSIPATION, float(dissipation))
    if point_stiffness is not None:
        if not point_stiffness > 0.0:
            raise RuntimeError(
                f"The point_contact_stiffness must be strictly positive; given {number(point_stiffness)}"
            )
        properties.AddProperty(MATERIAL, POINT_STIFFNESS, float(point_stiffness))
    if friction is not None:
        if not isinstance(friction, CoulombFriction):
            raise TypeError(f"AddContactMaterial(): friction must be a CoulombFriction, got {friction!r}.")
        properties.AddProperty(MATERIAL, FRICTION, friction)


@typing_overload
@checked
def AddRigidHydroelasticProperties(properties: ProximityProperties) -> None: ...
@typing_overload
@checked
def AddRigidHydroelasticProperties(resolution_hint: float, properties: ProximityProperties) -> None: ...
def AddRigidHydroelasticProperties(*args: Any, **kwargs: Any) -> None:
    """Makes a geometry rigid for hydroelastic contact.

    Called as `(properties)` or `(resolution_hint, properties)`; resolution hint [m], positive.
    """
    if args and not isinstance(args[0], ProximityProperties):
        kwargs["resolution_hint"], args = args[0], args[1:]
    _add_rigid(*args, **kwargs)


def _add_rigid(properties: ProximityProperties, resolution_hint: float | None = None) -> None:
    _require_proximity("AddRigidHydroelasticProperties", properties)
    properties.AddProperty(HYDRO, COMPLIANCE_TYPE, HydroelasticType.kRigid)
    if resolution_hint is not None:
        properties.AddProperty(HYDRO, RESOLUTION_HINT, _number("resolution_hint", resolution_hint))


@checked
def AddCompliantHydroelasticProperties(
    resolution_hint: float, hydroelastic_modulus: float, properties: ProximityProperties
) -> None:
    """Makes a geometry compliant for hydroelastic contact.

    Args:
        resolution_hint: wanted edge length of its mesh [m].
        hydroelastic_modulus: pressure at full penetration [Pa], positive.
        properties: the ProximityProperties to add to.
    """
    _add_compliant("AddCompliantHydroelasticProperties", hydroelastic_modulus, properties)
    properties.AddProperty(HYDRO, RESOLUTION_HINT, _number("resolution_hint", resolution_hint))


@checked
def AddCompliantHydroelasticPropertiesForHalfSpace(
    slab_thickness: float, hydroelastic_modulus: float, properties: ProximityProperties
) -> None:
    """Makes a half space compliant for hydroelastic contact, as a slab of the given thickness [m] on a rigid core."""
    _add_compliant("AddCompliantHydroelasticPropertiesForHalfSpace", hydroelastic_modulus, properties)
    properties.AddProperty(HYDRO, SLAB_THICKNESS, _number("slab_thickness", slab_thickness))


def _add_compliant(call: str, hydroelastic_modulus: float, properties: ProximityProperties) -> None:
    _require_proximity(call, properties)
    if not hydroelastic_modulus > 0.0:
        raise RuntimeError(f"The hydroelastic modulus must be positive; given {number(hydroelastic_modulus)}")
    properties.AddProperty(HYDRO, COMPLIANCE_TYPE, HydroelasticType.kCompliant)
    properties.AddProperty(HYDRO, MODULUS, float(hydroelastic_modulus))


def _number(name: str, value: float) -> float:
    """A length [m], which must be a number; whether it serves, the shape tells that is made with it."""
    if not float(value) == value:
        raise RuntimeError(f"The {name} must be a number; given {number(value)}")
    return float(value)


def _require_proximity(call: str, properties: object) -> None:
    if not isinstance(properties, ProximityProperties):
        raise TypeError(f"{call}(): properties must be ProximityProperties, got {type(properties).__name__}.")
