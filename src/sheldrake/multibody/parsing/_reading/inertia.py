"""Spatial inertias of links from the numbers in a file, with a stand-in for impossible ones."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from sheldrake.geometry import Shape
    from sheldrake.math import RigidTransform
    from sheldrake.multibody.tree import SpatialInertia

    from .._files.diagnostics import Location
    from .._files.xml import Element
    from .._reading.reading import Reading

FALLBACK_DENSITY = 1000.0  # [kg/m^3] of the solid sphere that stands in for an impossible inertia (water)
FALLBACK_MASS = 1.0  # [kg] of that sphere when the mass itself is impossible


def make_spatial_inertia(
    mass: float,
    X_BI: RigidTransform,
    moments: Sequence[float] | np.ndarray,
    products: Sequence[float] | np.ndarray,
    warn: Callable[[str], None],
) -> SpatialInertia:
    """The spatial inertia of a body about its origin, M_BBo_B.

    Args:
        mass: Mass [kg].
        X_BI: Pose of the inertia frame (at the centre of mass) in the body frame.
        moments: Ixx, Iyy, Izz about the centre of mass in frame I [kg m^2].
        products: Ixy, Ixz, Iyz likewise.
        warn: Called with a text when the numbers cannot belong to a body. The body then is a solid sphere of
            1000 kg/m^3 at the centre of mass, with the given mass (1 kg when the mass is not positive), as in Drake.
    """
    from sheldrake.multibody.tree import RotationalInertia, SpatialInertia

    p_BoBcm_B = np.asarray(X_BI.translation(), dtype=float)
    inertia_is_zero = not (np.any(moments) or np.any(products))
    if mass == 0.0 and inertia_is_zero:
        return SpatialInertia.Zero()
    problem = find_problem(mass, moments, products)
    if problem is not None:
        return _stand_in(mass, p_BoBcm_B, problem, warn)
    Ixx, Iyy, Izz = moments
    Ixy, Ixz, Iyz = products
    R_BI = X_BI.rotation().matrix()
    I_B = R_BI @ np.array([[Ixx, Ixy, Ixz], [Ixy, Iyy, Iyz], [Ixz, Iyz, Izz]]) @ R_BI.T
    I_BBcm_B = RotationalInertia(
        Ixx=I_B[0, 0],
        Iyy=I_B[1, 1],
        Izz=I_B[2, 2],
        Ixy=0.5 * (I_B[0, 1] + I_B[1, 0]),
        Ixz=0.5 * (I_B[0, 2] + I_B[2, 0]),
        Iyz=0.5 * (I_B[1, 2] + I_B[2, 1]),
    )
    return SpatialInertia.MakeFromCentralInertia(mass, p_BoBcm_B, I_BBcm_B)


def find_problem(
    mass: float, moments: Sequence[float] | np.ndarray, products: Sequence[float] | np.ndarray
) -> str | None:
    """Why a mass [kg] and moments and products of inertia [kg m^2] cannot belong to a rigid body, or None."""
    inertia_is_zero = not (np.any(moments) or np.any(products))
    if mass < 0.0 or (mass == 0.0 and not inertia_is_zero):
        return f"a mass of {mass:g} kg with a rotational inertia" if mass == 0.0 else f"a negative mass of {mass:g} kg"
    Ixx, Iyy, Izz = moments
    Ixy, Ixz, Iyz = products
    principal = np.linalg.eigvalsh(np.array([[Ixx, Ixy, Ixz], [Ixy, Iyy, Iyz], [Ixz, Iyz, Izz]]))
    # Drake's allowance for round-off: 16 units in the last place of the largest possible moment, or of 1 kg m^2.
    slack = 16.0 * np.finfo(float).eps * max(1.0, 0.5 * abs(Ixx + Iyy + Izz))
    text = "{:g}, {:g}, {:g} kg m^2".format(*principal)
    if principal[0] < -slack:
        return f"a negative principal moment of inertia ({text})"
    if principal[0] + principal[1] < principal[2] - slack:
        return f"principal moments of inertia ({text}) of which one exceeds the sum of the others"
    return None


def _stand_in(mass: float, p_BoBcm_B: np.ndarray, problem: str, warn: Callable[[str], None]) -> SpatialInertia:
    from sheldrake.multibody.tree import SpatialInertia

    used = mass if mass > 0.0 else FALLBACK_MASS
    radius = (used / (FALLBACK_DENSITY * 4.0 / 3.0 * np.pi)) ** (1.0 / 3.0)
    warn(
        f"The inertia is impossible: {problem}. It is replaced by a solid sphere of {used:g} kg and radius "
        f"{radius:.4g} m ({FALLBACK_DENSITY:g} kg/m^3) at the centre of mass."
    )
    M_SScm = SpatialInertia.SolidSphereWithMass(used, radius)
    return M_SScm.Shift(-p_BoBcm_B)


def solid_properties(shape: Shape, where: Element | Location, what: str, reading: Reading):
    """Volume [m^3], centroid [m] and rotational inertia about it for unit density [m^5] of a solid shape.

    A mesh that is not closed, or turned inside out, counts as its convex hull, with a warning, as in Drake.

    Args:
        shape: The shape.
        where: Its place in the file.
        what: What messages call it.
        reading: Receives warnings and errors.
    """
    from sheldrake.geometry import Convex, Mesh
    from sheldrake.geometry._mass_properties import mass_properties

    if isinstance(shape, (Mesh, Convex)):
        reading.questions.repeatable = False
    try:
        volume, centroid, inertia = mass_properties(shape)
        problem = find_problem(volume, np.diag(inertia), (inertia[0, 1], inertia[0, 2], inertia[1, 2]))
        if volume > 0.0 and problem is None:
            return volume, centroid, inertia
        reason = problem or f"its volume is {volume:g} m^3"
    except RuntimeError as error:
        reason = str(error)
    if not isinstance(shape, Mesh):
        reading.fail(where, f"The mass of {what} cannot be computed: {reason}")
    reading.warn(where, f"The mesh of {what} is not a closed surface ({reason}); its mass is that of its convex hull.")
    try:
        return mass_properties(Convex(shape.source().path(), shape.scale3()))
    except RuntimeError as error:
        reading.fail(where, f"The mass of {what} cannot be computed: {error}")
