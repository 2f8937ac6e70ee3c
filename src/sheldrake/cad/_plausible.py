"""Whether a mass and an inertia can belong to a body of a given extent: bounds that hold whatever the material."""

from __future__ import annotations

import numpy as np

NOTHING = 1e-15  # [kg m^2] a grain of sand has more
LIGHTEST, HEAVIEST = 1.0, 23_000.0  # [kg/m^3] of aerogels and foams; of osmium


def principal_moments(I_BBcm: np.ndarray) -> np.ndarray:
    """Ascending principal moments of a rotational inertia [kg m^2], shape (3,)."""
    return np.linalg.eigvalsh(np.asarray(I_BBcm, dtype=float))


def why_impossible(mass: float, I_BBcm: np.ndarray) -> str | None:
    """Why no body of any shape has this mass [kg] and inertia about its centre of mass [kg m^2], or None."""
    if mass < 0.0:
        return f"the mass, {mass:g} kg, is negative"
    moments = principal_moments(I_BBcm)
    slack = max(1e-9 * abs(moments).max(), NOTHING)  # numbers in files are rounded, and noise stands for nothing
    text = ", ".join(f"{m:.4g}" for m in moments)
    if moments[0] < -slack:
        return f"a principal moment of inertia is negative ({text} kg m^2)"
    if moments[0] + moments[1] < moments[2] - slack:
        return f"one principal moment of inertia exceeds the sum of the two others ({text} kg m^2)"
    if mass == 0.0 and moments[2] > 0.0:
        return f"there is inertia ({text} kg m^2) without mass"
    return None


def why_too_large(mass: float, I_BBcm: np.ndarray, farthest: float) -> str | None:
    """Why an inertia is more than a mass can have within a distance of its centre of mass, or None.

    A principal moment is at most m r^2 when all mass is within r of the centre: a thin ring of that radius.

    Args:
        mass: [kg].
        I_BBcm: about the centre of mass [kg m^2], shape (3, 3).
        farthest: distance from the centre of mass to the farthest point of the geometry [m].
    """
    largest = float(principal_moments(I_BBcm)[2])
    bound = mass * farthest * farthest
    if largest <= bound * (1.0 + 1e-6):
        return None
    times = f"{largest / bound:.3g} times that" if bound > 0.0 else "more"
    return (
        f"{mass:g} kg within {farthest:.4g} m of the centre of mass have a moment of inertia of at most {bound:.3g} "
        f"kg m^2, and this one has {largest:.4g}, {times}"
    )


def why_odd_density(mass: float, volume: float) -> str | None:
    """Why a density is that of no solid material, or None; volume in [m^3]."""
    if volume <= 0.0 or mass <= 0.0:
        return None
    density = mass / volume
    if density > HEAVIEST:
        return f"{mass:g} kg in {volume:.4g} m^3 is a density of {density:.4g} kg/m^3; no material is that dense"
    if density < LIGHTEST:
        return f"{mass:g} kg in {volume:.4g} m^3 is a density of {density:.4g} kg/m^3, about that of air"
    return None
