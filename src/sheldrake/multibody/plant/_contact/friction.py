"""Friction between two surfaces, as contact has it."""

from __future__ import annotations

from sheldrake.common._checked import checked
from sheldrake.multibody.contact_solvers._kernels.laws import harmonic_mean
from sheldrake.multibody.math._coulomb_friction import CoulombFriction


@checked
def CalcContactFrictionFromSurfaceProperties(
    surface_properties1: CoulombFriction, surface_properties2: CoulombFriction
) -> CoulombFriction:
    """Friction between two surfaces: each coefficient is the harmonic mean 2 μ1 μ2 / (μ1 + μ2), zero if both are."""
    return CoulombFriction(
        harmonic_mean(surface_properties1.static_friction(), surface_properties2.static_friction()),
        harmonic_mean(surface_properties1.dynamic_friction(), surface_properties2.dynamic_friction()),
    )
