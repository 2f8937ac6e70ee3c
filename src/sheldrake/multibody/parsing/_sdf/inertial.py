"""SDFormat: the `<inertial>` of a link to M_BBo_B."""

from sheldrake.geometry import HalfSpace

from .._files.xml import Element
from .._reading.inertia import make_spatial_inertia
from .._reading.reading import Reading
from .children import child_number
from .frames import SdfScope
from .geometry import read_link_pose, read_shape

DEFAULT_DENSITY = 1000.0  # [kg/m³], by the specification


def read_inertial(link: Element, name: str, scope: SdfScope, reading: Reading):
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


def _of_collisions(element: Element, link: Element, name: str, scope: SdfScope, reading: Reading):
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


def _of_collision(collision: Element, density: float, link: str, scope: SdfScope, reading: Reading):
    """M_LLo_L of the solid that a collision of link L is, or None."""
    from sheldrake.multibody.tree import CalcSpatialInertia

    geometry = collision.find("geometry")
    shape, _ = (None, None) if geometry is None else read_shape(geometry, reading)
    if shape is None:
        return None
    if isinstance(shape, HalfSpace):
        reading.fail(collision, f"Link '{link}': a <plane> has no mass for <inertial auto='true'>.")
    try:
        M_SSo_S = CalcSpatialInertia(shape, child_number(collision, "density", reading, density))
    except (RuntimeError, ValueError) as error:
        reading.fail(collision, f"Link '{link}': {error}")
    X_LS = read_link_pose(collision, link, scope, reading)
    return M_SSo_S.ReExpress(X_LS.rotation()).Shift(-X_LS.translation())
