"""Surfaces made of triangles.

Contact surfaces, faces of rigid hydroelastic bodies, and what users build by hand.
"""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._overloads import expect
from sheldrake.geometry._numbers import as_numbers, lengths, plain

from .mesh_files import read_mesh
from .mesh_source import InMemoryMesh, MeshSource

if TYPE_CHECKING:
    from collections.abc import Sequence
    from os import PathLike

    from numpy.typing import ArrayLike

    from sheldrake.common._types import Scalars


class SurfaceTriangle:
    """The vertex numbers of a triangle, counter-clockwise seen from outside."""

    __slots__ = ("_v",)

    def __init__(self, v0: int, v1: int, v2: int) -> None:
        if min(v0, v1, v2) < 0:
            raise ValueError(f"SurfaceTriangle(): vertex numbers must not be negative, got ({v0}, {v1}, {v2}).")
        self._v = (int(v0), int(v1), int(v2))

    def num_vertices(self) -> int:
        """Three."""
        return 3

    def vertex(self, i: int) -> int:
        """The number of corner `i` in the mesh."""
        if not 0 <= i < 3:
            raise IndexError(f"SurfaceTriangle.vertex({i}): a triangle has corners 0, 1, 2.")
        return self._v[i]

    def __copy__(self) -> SurfaceTriangle:
        return SurfaceTriangle(*self._v)

    def __deepcopy__(self, memo: dict) -> SurfaceTriangle:
        return copy.copy(self)

    def __repr__(self) -> str:
        return f"SurfaceTriangle(v0={self._v[0]}, v1={self._v[1]}, v2={self._v[2]})"


@checked
class TriangleSurfaceMesh:
    """A surface of triangles in a frame M.

    Args:
        triangles: list of SurfaceTriangle.
        vertices: positions in M [m], shape (n, 3) or a list of n positions.

    Raises:
        RuntimeError: there is no triangle.
    """

    def __init__(self, triangles: Sequence[SurfaceTriangle] | Sequence[Sequence[int]], vertices: Scalars) -> None:
        rows = [t._v if isinstance(t, SurfaceTriangle) else tuple(t) for t in triangles]
        if not rows:
            raise RuntimeError("A mesh must contain at least one triangle")
        self._triangles = np.array(rows, dtype=np.int64).reshape(-1, 3)
        self._vertices = as_numbers(vertices).reshape(-1, 3)
        if self._triangles.max() >= len(self._vertices) or self._triangles.min() < 0:
            raise ValueError(
                f"TriangleSurfaceMesh(): a triangle names vertex {self._triangles.max()}, "
                f"but there are {len(self._vertices)} vertices."
            )
        corner = self._vertices[self._triangles]
        cross = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        norm = lengths(cross)
        self._areas = 0.5 * norm
        self._normals = np.divide(cross, norm[:, None], out=np.zeros_like(cross), where=norm[:, None] > 0.0)

    def num_triangles(self) -> int:
        """Number of triangles."""
        return len(self._triangles)

    num_elements = num_triangles

    def num_vertices(self) -> int:
        """Number of vertices."""
        return len(self._vertices)

    def triangles(self) -> list[SurfaceTriangle]:
        """All triangles."""
        return [SurfaceTriangle(*row) for row in self._triangles.tolist()]

    def vertices(self) -> list[np.ndarray]:
        """Positions of all vertices in M [m]."""
        return list(self._vertices.copy())

    def element(self, e: int) -> SurfaceTriangle:
        """Triangle `e`."""
        return SurfaceTriangle(*self._triangles[e].tolist())

    def vertex(self, v: int) -> np.ndarray:
        """Position of vertex `v` in M [m], shape (3,)."""
        return self._vertices[v].copy()

    def area(self, t: int) -> float:
        """Area of a triangle [m^2]."""
        return plain(self._areas[t])

    def total_area(self) -> float:
        """Area of all triangles [m^2]."""
        return plain(self._areas.sum())

    def face_normal(self, t: int) -> np.ndarray:
        """Unit normal of a triangle in M, shape (3,)."""
        return self._normals[t].copy()

    def element_centroid(self, t: int) -> np.ndarray:
        """Centroid of a triangle in M [m], shape (3,)."""
        return self._vertices[self._triangles[t]].mean(axis=0)

    def centroid(self) -> np.ndarray:
        """Centroid of the surface in M [m], shape (3,)."""
        middle = self._vertices[self._triangles].mean(axis=1)
        return self._areas @ middle / self._areas.sum()

    def CalcBoundingBox(self) -> tuple[np.ndarray, np.ndarray]:
        """Centre and size of the axis-aligned bounding box in M [m]."""
        low, high = self._vertices.min(axis=0), self._vertices.max(axis=0)
        return (low + high) / 2.0, high - low

    def CalcBarycentric(self, p_MQ: Scalars, t: int) -> np.ndarray:
        """Barycentric coordinates of Q's projection into the plane of triangle `t`, shape (3,)."""
        a, b, c = self._vertices[self._triangles[t]]
        u, v, q = b - a, c - a, as_numbers(p_MQ).reshape(3) - a
        uu, uv, vv, uq, vq = u @ u, u @ v, v @ v, u @ q, v @ q
        scale = uu * vv - uv * uv  # the square of twice the area
        beta, gamma = (vv * uq - uv * vq) / scale, (uu * vq - uv * uq) / scale
        return np.array([1.0 - beta - gamma, beta, gamma])

    def CalcCartesianFromBarycentric(self, element_index: int, b_Q: Scalars) -> np.ndarray:
        """Position in M [m] of barycentric coordinates in a triangle, shape (3,)."""
        return np.asarray(b_Q, dtype=float).reshape(3) @ self._vertices[self._triangles[element_index]]

    def Equal(self, mesh: TriangleSurfaceMesh) -> bool:
        """True if triangles and vertices are the same, bit for bit."""
        expect("Equal", mesh, TriangleSurfaceMesh)
        same = np.array_equal(self._triangles, mesh._triangles)
        return same and np.array_equal(self._vertices, mesh._vertices)

    def __copy__(self) -> TriangleSurfaceMesh:
        return TriangleSurfaceMesh(self._triangles.tolist(), self._vertices)

    def __deepcopy__(self, memo: dict) -> TriangleSurfaceMesh:
        return copy.copy(self)


@checked
def ReadObjToTriangleSurfaceMesh(
    filename: str | PathLike[str], scale: float | ArrayLike = 1.0, scale3: ArrayLike | None = None
) -> TriangleSurfaceMesh:
    """The triangles of an OBJ file; `scale` is a number or one number per axis.

    Raises:
        RuntimeError: the file can not be read.
    """
    source = filename if isinstance(filename, (MeshSource, InMemoryMesh)) else str(filename)
    data = read_mesh(MeshSource(source), "ReadObjToTriangleSurfaceMesh()")
    factor = np.asarray(scale if scale3 is None else scale3, dtype=float)
    triangles = data.triangles[:, ::-1] if np.prod(np.broadcast_to(factor, (3,))) < 0.0 else data.triangles
    return TriangleSurfaceMesh(triangles.tolist(), data.vertices * factor)
