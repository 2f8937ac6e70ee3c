"""SDFormat: the `<inertial>` of a link to M_BBo_B."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sheldrake.geometry import HalfSpace

from .._files.xml import Element
from .._reading.inertia import make_spatial_inertia
from .._reading.reading import Reading
from .children import child_number
from .frames import SdfScope
from .geometry import read_link_pose, read_shape

if TYPE_CHECKING:
    from sheldrake.multibody.tree import SpatialInertia

DEFAULT_DENSITY = 1000.0  # [kg/m³], by the specification


def read_inertial(link: Element, name: str, scope: SdfScope, reading: Reading) -> SpatialInertia:
    """M_BBo_B; what the file does not say is 1 kg and 1 kg m^2."""
    from sheldrake.math import RigidTransform

    element = link.find("inertial")
    if element is None:
        return make_spatial_inertia(1.0, RigidTransform(), [1.0] * 3, [0.0] * 3, lambda text: None)
    auto = element.get("auto")
    if auto is not None and reading.parse_bool(auto, element.where_attribute("auto"), "attribute 'auto'"):
        return _of_collisions(element, link, name, scope, reading)
    reading.warn_unknown(element, ("pose", "mass", "inertia"), ("auto",))
    mass = child_number(element, "mass", reading, 1.0)
    inertia = element.find("inertia")
    moments, products = [1.0] * 3, [0.0] * 3
    if inertia is not None:
        tags = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
        reading.warn_unknown(inertia, tags)
        moments = [child_number(inertia, tag, reading, 1.0) for tag in tags[:3]]
        products = [child_number(inertia, tag, reading, 0.0) for tag in tags[3:]]
    X_BI = read_link_pose(element, name, scope, reading)
    return make_spatial_inertia(
        mass, X_BI, moments, products, lambda text: reading.warn(element, f"Link '{name}': {text}")
    )


def _of_collisions(element: Element, link: Element, name: str, scope: SdfScope, reading: Reading) -> SpatialInertia:
    """That of the solids that the collisions are, each of its density; a given mass scales it."""
    from sheldrake.multibody.tree import SpatialInertia

    reading.warn_unknown(element, ("mass", "density"), ("auto",))
    density = child_number(element, "density", reading, DEFAULT_DENSITY)
    collisions = link.find_all("collision")
    if not collisions:
        reading.fail(element, f"Link '{name}' has <inertial auto='true'> and no <collision> to take it from.")
    M = SpatialInertia.Zero()
    for collision in collisions:
        solid = _of_collision(collision, density, name, scope, reading)
        if solid is not None:
            M += solid
    if not M.get_mass() > 0.0:
        reading.fail(element, f"Link '{name}' has <inertial auto='true'> and collisions without mass.")
    mass = child_number(element, "mass", reading)
    if mass is None:
        return M
    if not mass > 0.0:
        reading.fail(element, f"Link '{name}': a mass of {mass:g} kg with <inertial auto='true'>.")
    return SpatialInertia(mass, M.get_com(), M.get_unit_inertia())


def _of_collision(
    collision: Element, density: float, link: str, scope: SdfScope, reading: Reading
) -> SpatialInertia | None:
    """M_LLo_L of the solid that a collision of link L is, or None."""
    from sheldrake.multibody.tree import CalcSpatialInertia

    geometry = collision.find("geometry")
    density = child_number(collision, "density", reading, density)
    shape, _ = (None, None) if geometry is None else read_shape(geometry, reading)
    cone = None if geometry is None else geometry.find("cone")
    if shape is None and cone is None:
        return None
    if isinstance(shape, HalfSpace):
        reading.fail(collision, f"Link '{link}': a <plane> has no mass for <inertial auto='true'>.")
    try:
        M_SSo_S = CalcSpatialInertia(shape, density) if cone is None else _of_cone(cone, density, reading)
    except (RuntimeError, ValueError) as error:
        reading.fail(collision, f"Link '{link}': {error}")
    X_LS = read_link_pose(collision, link, scope, reading)
    return M_SSo_S.ReExpress(X_LS.rotation()).Shift(-X_LS.translation())


def _of_cone(cone: Element, density: float, reading: Reading) -> SpatialInertia:
    """M_SSo_S of a cone, which touches nothing but weighs something: its apex is up, So half way up its axis."""
    from sheldrake.multibody.tree import SpatialInertia, UnitInertia

    r = child_number(cone, "radius", reading, 0.5)
    h = child_number(cone, "length", reading, 1.0)
    if not (r > 0.0 and h > 0.0 and density > 0.0):
        reading.fail(cone, f"A cone of radius {r:g} m and length {h:g} m with {density:g} kg/m³ has no mass.")
    across = 3.0 / 80.0 * (4.0 * r * r + h * h)
    G_SScm = UnitInertia(Ixx=across, Iyy=across, Izz=0.3 * r * r)
    mass = density * np.pi * r * r * h / 3.0
    return SpatialInertia.MakeFromCentralInertia(mass, np.array([0.0, 0.0, -0.25 * h]), mass * G_SScm)
