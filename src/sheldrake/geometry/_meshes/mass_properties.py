"""Volume, centroid and second moments of closed surfaces, for unit density."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .polygon_mesh import PolygonSurfaceMesh, fans


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


def of_polygons(mesh: PolygonSurfaceMesh) -> MassProperties:
    """Mass properties of the inside of a closed polygon mesh."""
    return of_triangles(mesh._vertices, fans(mesh._faces))


def of_triangles(vertices: np.ndarray, triangles: np.ndarray) -> MassProperties:
    """Mass properties of the inside of a closed triangle mesh, as a sum over tetrahedra from one point.

    Of an open mesh they depend on that point, which then is the origin of its frame, as in Drake: what is open towards
    the origin counts as if it were closed there. Badly wound meshes give meaningless numbers; the caller judges the
    volume.
    """
    if not len(triangles):
        return MassProperties(0.0, np.zeros(3), np.zeros((3, 3)))
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    origin = np.zeros(3)
    if _is_closed(np.cross(b - a, c - a)):
        origin = vertices.mean(axis=0)  # near the body: less cancellation
        a, b, c = a - origin, b - origin, c - origin
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


def _is_closed(normals: np.ndarray) -> bool:
    """Whether normals as long as their triangles are large cancel, so that the volume is the same from any point."""
    return float(np.abs(normals.sum(axis=0)).max()) <= 1e-9 * float(np.abs(normals).sum())
