"""Volume, centroid and second moments of shapes, for unit density."""

from __future__ import annotations

import math

from sheldrake.common._checked import checked
from sheldrake.geometry._meshes.mass_properties import MassProperties, of_triangles
from sheldrake.geometry._meshes.triangle_mesh import TriangleSurfaceMesh
from sheldrake.geometry._shape_types import type_of
from sheldrake.geometry._shapes import HalfSpace, MeshcatCone, Shape


def mass_properties(shape: Shape | TriangleSurfaceMesh) -> MassProperties:
    """Mass properties of a shape or a TriangleSurfaceMesh.

    Raises:
        ValueError: a HalfSpace or a MeshcatCone.
        RuntimeError: a mesh file that can not be read.
    """
    if isinstance(shape, TriangleSurfaceMesh):
        return of_triangles(shape._vertices, shape._triangles)
    mass = type_of(shape).mass
    if mass is not None:
        return mass(shape)
    if isinstance(shape, HalfSpace):
        raise ValueError("CalcSpatialInertia: Cannot compute mass of a HalfSpace")
    raise ValueError(f"CalcSpatialInertia: {shape.type_name()} is not yet supported")


@checked
def CalcVolume(shape: Shape) -> float:
    """Volume of a shape [m^3]; infinite for a half space."""
    if isinstance(shape, HalfSpace):
        return math.inf
    if isinstance(shape, MeshcatCone):
        return math.pi * shape.a() * shape.b() * shape.height() / 3.0
    return mass_properties(shape).volume
