"""Volume, centroid and second moments of shapes and closed surfaces, for unit density."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from sheldrake.geometry._shapes import (
    Box,
    Capsule,
    Convex,
    Cylinder,
    Ellipsoid,
    HalfSpace,
    Mesh,
    MeshcatCone,
    Shape,
    Sphere,
)

from .mesh_files import read_mesh
from .polygon_mesh import PolygonSurfaceMesh
from .triangle_mesh import TriangleSurfaceMesh


class MassProperties(NamedTuple):
    """Of a body of density 1 kg/m^3 that fills a shape.

    Attributes:
        volume: [m^3].
        p_GoGcm: centroid in G [m], shape (3,).
        I_GGcm: rotational inertia about the centroid, in G [m^5], shape (3, 3).
    """

    volume: float
    p_GoGcm: np.ndarray
    I_GGcm: np.ndarray


def mass_properties(shape: Any) -> MassProperties:
    """Mass properties of a shape or a TriangleSurfaceMesh.

    Raises:
        ValueError: a HalfSpace or a MeshcatCone.
        RuntimeError: a mesh file that can not be read.
    """
    if isinstance(shape, TriangleSurfaceMesh):
        return of_triangles(shape._vertices, shape._triangles)
    if isinstance(shape, Convex):
        return of_polygons(shape.GetConvexHull())
    if isinstance(shape, Mesh):
        data = read_mesh(shape.source(), "CalcSpatialInertia()")
        scale = shape.scale3()
        triangles = data.triangles[:, ::-1] if np.prod(scale) < 0.0 else data.triangles
        return of_triangles(data.vertices * scale, triangles)
    if isinstance(shape, HalfSpace):
        raise ValueError("CalcSpatialInertia: Cannot compute mass of a HalfSpace")
    if isinstance(shape, MeshcatCone):
        raise ValueError("CalcSpatialInertia: MeshcatCone is not yet supported")
    volume, squares = _primitive(shape)
    x, y, z = squares
    return MassProperties(volume, np.zeros(3), volume * np.diag([y + z, x + z, x + y]))


def _primitive(shape: Shape) -> tuple[float, tuple[float, float, float]]:
    """Volume [m^3] and mean squares of x, y, z [m^2]."""
    if isinstance(shape, Sphere):
        r = shape.radius()
        return 4.0 / 3.0 * math.pi * r**3, (r * r / 5.0,) * 3
    if isinstance(shape, Box):
        return float(np.prod(shape.size())), tuple(shape.size() ** 2 / 12.0)
    if isinstance(shape, Ellipsoid):
        axes = np.array([shape.a(), shape.b(), shape.c()])
        return 4.0 / 3.0 * math.pi * float(np.prod(axes)), tuple(axes**2 / 5.0)
    if isinstance(shape, Cylinder):
        r, l = shape.radius(), shape.length()
        return math.pi * r * r * l, (r * r / 4.0, r * r / 4.0, l * l / 12.0)
    if isinstance(shape, Capsule):
        r, l = shape.radius(), shape.length()
        tube, caps = math.pi * r * r * l, 4.0 / 3.0 * math.pi * r**3
        volume = tube + caps
        across = (tube * r * r / 4.0 + caps * r * r / 5.0) / volume
        # A half ball's mean distance from its flat side is 3 r / 8, its mean square r^2 / 5.
        along = (tube * l * l / 12.0 + caps * (r * r / 5.0 + 0.375 * r * l + l * l / 4.0)) / volume
        return volume, (across, across, along)
    raise ValueError(f"mass_properties(): no formula for {shape!r}.")


def of_polygons(mesh: PolygonSurfaceMesh) -> MassProperties:
    """Mass properties of the inside of a closed polygon mesh."""
    triangles = [(f[0], f[i], f[i + 1]) for f in mesh._faces for i in range(1, len(f) - 1)]
    return of_triangles(mesh._vertices, np.array(triangles))


def of_triangles(vertices: np.ndarray, triangles: np.ndarray) -> MassProperties:
    """Mass properties of the inside of a closed triangle mesh, as a sum over tetrahedra from one point.

    Open or badly wound meshes give meaningless numbers; the caller judges the volume.
    """
    if not len(triangles):
        return MassProperties(0.0, np.zeros(3), np.zeros((3, 3)))
    origin = vertices.mean(axis=0)  # near the body: less cancellation
    a, b, c = (vertices[triangles[:, k]] - origin for k in range(3))
    volumes = np.einsum("ij,ij->i", np.cross(a, b), c) / 6.0
    volume = float(volumes.sum())
    if volume == 0.0:
        return MassProperties(0.0, np.zeros(3), np.zeros((3, 3)))
    total = a + b + c
    first = volumes @ total / 4.0
    # Second moment of a tetrahedron with one corner at the origin: V/20 (aa' + bb' + cc' + ss'), s = a + b + c.
    second = sum(np.einsum("i,ij,ik->jk", volumes, x, x) for x in (a, b, c, total)) / 20.0
    centre = first / volume
    central = second - volume * np.outer(centre, centre)
    return MassProperties(volume, centre + origin, np.trace(central) * np.eye(3) - central)


def CalcVolume(shape: Shape) -> float:
    """Volume of a shape [m^3]; infinite for a half space."""
    if isinstance(shape, HalfSpace):
        return math.inf
    if isinstance(shape, MeshcatCone):
        return math.pi * shape.a() * shape.b() * shape.height() / 3.0
    return mass_properties(shape).volume
