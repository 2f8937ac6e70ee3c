"""Inertia of solids of uniform density."""

from __future__ import annotations

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._overloads import Mismatch
from sheldrake.geometry import Shape, TriangleSurfaceMesh
from sheldrake.geometry._mass_properties import mass_properties
from sheldrake.multibody.math import RotationalInertia, SpatialInertia


@checked
def CalcSpatialInertia(
    shape: Shape | TriangleSurfaceMesh | None = None,
    density: float | None = None,
    *,
    mesh: TriangleSurfaceMesh | None = None,
) -> SpatialInertia:
    """M_BBo_B of a body of uniform density that fills a shape whose frame is the body frame.

    Args:
        shape: A Shape, or a closed TriangleSurfaceMesh whose triangles wind outwards.
        density: [kg/m³].
        mesh: A TriangleSurfaceMesh, by name.

    Raises:
        ValueError: the shape is a HalfSpace or a MeshcatCone, or a mesh that encloses no volume (it is open, or its
            triangles wind inwards).
        RuntimeError: the density is not positive, or the mesh gives no physical inertia.
    """
    solid = shape if mesh is None else mesh
    if density is None or not isinstance(solid, (Shape, TriangleSurfaceMesh)):
        raise Mismatch(
            "CalcSpatialInertia(): incompatible function arguments. Takes (shape: Shape, density: float) or (mesh: "
            "TriangleSurfaceMesh, density: float)."
        )
    volume, c, I = mass_properties(solid)
    if not volume > 0.0:
        raise ValueError(
            f"CalcSpatialInertia(): the calculated volume of a triangle surface mesh is {volume:g} m³. The mesh may be "
            "open, or its triangles may not wind outwards."
        )
    if not 0.0 < density < np.inf:
        raise RuntimeError(f"CalcSpatialInertia(): the density is not positive and finite: {density:g} kg/m³.")
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = (density * I).tolist()
    central = RotationalInertia(xx, yy, zz, xy, xz, yz)
    return SpatialInertia.MakeFromCentralInertia(density * volume, c, central)
