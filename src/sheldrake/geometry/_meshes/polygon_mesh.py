"""Surfaces made of polygons.

The form in which Drake gives contact surfaces by default, and the one of convex hulls.
"""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._no_constructor import no_constructor
from sheldrake.geometry._numbers import as_numbers, lengths, plain

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike


@no_constructor("Use PolygonSurfaceMesh.element().")
class SurfacePolygon:
    """The vertex numbers of one polygon."""

    _vertices: tuple[int, ...]

    @classmethod
    def _make(cls, vertices: Sequence[int] | np.ndarray) -> SurfacePolygon:
        new = object.__new__(cls)
        new._vertices = tuple(int(v) for v in vertices)
        return new

    def num_vertices(self) -> int:
        """Number of corners."""
        return len(self._vertices)

    def vertex(self, i: int) -> int:
        """The number of corner `i` in the mesh."""
        if not 0 <= i < len(self._vertices):
            raise IndexError(f"SurfacePolygon.vertex({i}): the polygon has {len(self._vertices)} corners.")
        return self._vertices[i]


@checked
class PolygonSurfaceMesh:
    """A surface of flat convex polygons in a frame M.

    Args:
        face_data: for each face its number of corners, then its vertex numbers, counter-clockwise seen from outside.
        vertices: positions in M [m], shape (n, 3) or a list of n positions.
    """

    def __init__(self, face_data: Sequence[int] | np.ndarray = (), vertices: ArrayLike = ()) -> None:
        data = np.array(face_data, dtype=np.int64).reshape(-1)
        self._vertices = as_numbers(vertices).reshape(-1, 3)
        begins = _begins(data)
        self._face_data = data.tolist()
        self._flat, self._sizes = np.delete(data, begins), data[begins]
        """The corners of all faces, one after the other, and how many each has."""
        self._faces = _split(self._flat, self._sizes)
        n, flat = len(self._vertices), self._flat
        if len(begins) and (self._sizes.min() < 3 or flat.min() < 0 or flat.max() >= n):
            face = next(f for f in self._faces if len(f) < 3 or not 0 <= min(f) <= max(f) < n)
            raise ValueError(f"PolygonSurfaceMesh(): face {face} with {n} vertices.")
        self._normals, self._areas, self._centroids = self._measure()

    def _measure(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Normals, areas and centroids of the faces, each a fan of triangles around its first corner."""
        if not self._faces:
            return np.zeros((0, 3)), np.zeros(0), np.zeros((0, 3))
        corners, flat = self._sizes, self._flat
        first = np.cumsum(corners) - corners  # of each face in flat
        fan = np.cumsum(corners - 2) - (corners - 2)  # where its triangles begin
        face = np.repeat(np.arange(len(corners)), corners - 2)
        second = np.arange(len(face)) - fan[face] + first[face] + 1
        p, q, r = (self._vertices[flat[k]] for k in (first[face], second, second + 1))
        cross = 0.5 * np.cross(q - p, r - p)
        area_vectors = np.add.reduceat(cross, fan)
        areas = lengths(area_vectors)
        flawed = np.array([not area > 0.0 for area in areas]) if areas.dtype == object else ~(areas > 0.0)
        divisors = np.where(flawed, 1.0, areas)[:, None]
        normals = np.where(flawed[:, None], 0.0, area_vectors / divisors)
        weights = (cross * normals[face]).sum(axis=1)[:, None]
        centroids = np.add.reduceat(weights * ((p + q + r) / 3.0), fan) / divisors
        means = np.add.reduceat(self._vertices[flat], first) / corners[:, None]
        return normals, areas, np.where(flawed[:, None], means, centroids)

    def num_faces(self) -> int:
        """Number of polygons."""
        return len(self._faces)

    num_elements = num_faces

    def num_vertices(self) -> int:
        """Number of vertices."""
        return len(self._vertices)

    def element(self, e: int) -> SurfacePolygon:
        """Polygon `e`."""
        return SurfacePolygon._make(self._faces[_index("element", e, self._faces)])

    def vertex(self, v: int) -> np.ndarray:
        """Position of vertex `v` in M [m], shape (3,)."""
        return self._vertices[_index("vertex", v, self._vertices)].copy()

    def face_data(self) -> list[int]:
        """What the constructor took."""
        return list(self._face_data)

    def area(self, f: int) -> float:
        """Area of a face [m^2]."""
        return plain(self._areas[_index("area", f, self._faces)])

    def total_area(self) -> float:
        """Area of all faces [m^2]."""
        return plain(self._areas.sum())

    def face_normal(self, f: int) -> np.ndarray:
        """Outward unit normal of a face in M, shape (3,)."""
        return self._normals[_index("face_normal", f, self._faces)].copy()

    def element_centroid(self, e: int) -> np.ndarray:
        """Centroid of a face in M [m], shape (3,)."""
        return self._centroids[_index("element_centroid", e, self._faces)].copy()

    def centroid(self) -> np.ndarray:
        """Centroid of the surface in M [m], shape (3,)."""
        return self._areas @ self._centroids / self._areas.sum()

    def CalcBoundingBox(self) -> tuple[np.ndarray, np.ndarray]:
        """Centre and size of the axis-aligned bounding box in M [m]."""
        low, high = self._vertices.min(axis=0), self._vertices.max(axis=0)
        return (low + high) / 2.0, high - low

    def Equal(self, mesh: PolygonSurfaceMesh) -> bool:
        """True if faces and vertices are the same, bit for bit."""
        return self._face_data == mesh._face_data and np.array_equal(self._vertices, mesh._vertices)

    def __copy__(self) -> PolygonSurfaceMesh:
        return PolygonSurfaceMesh(self._face_data, self._vertices)

    def __deepcopy__(self, memo: dict) -> PolygonSurfaceMesh:
        return copy.copy(self)


def _split(flat: np.ndarray, sizes: np.ndarray) -> list[tuple[int, ...]]:
    """Faces of these sizes, of their corners one after the other."""
    if len(sizes) and (sizes == sizes[0]).all():
        return list(zip(*flat.reshape(-1, sizes[0]).T.tolist()))  # triangles, mostly
    return [tuple(face.tolist()) for face in np.split(flat, np.cumsum(sizes)[:-1])] if len(sizes) else []


def fans(polygons: Sequence[Sequence[int]] | np.ndarray) -> np.ndarray:
    """Triangles of polygons, each fanned about its first vertex, shape (m, 3); an array has triangles already."""
    if isinstance(polygons, np.ndarray):
        return polygons
    triangles = [(p[0], p[i], p[i + 1]) for p in polygons for i in range(1, len(p) - 1)]
    return np.array(triangles, dtype=np.int64).reshape(-1, 3)


def _begins(data: np.ndarray) -> list[int]:
    """Where the faces begin.

    Raises:
        ValueError: a face has no corners, or more than there are numbers.
    """
    stride = 1 + int(data[0]) if len(data) else 1
    if stride > 1 and len(data) % stride == 0 and (data[::stride] == stride - 1).all():
        return list(range(0, len(data), stride))
    begins, i, words = [], 0, data.tolist()
    while i < len(words):
        begins.append(i)
        if words[i] < 1 or words[i] > len(words) - i - 1:
            raise ValueError(
                f"PolygonSurfaceMesh(): a face of {words[i]} corners, {len(words) - i - 1} numbers follow."
            )
        i += 1 + words[i]
    return begins


def _index(call: str, i: int, items: Sequence[object] | np.ndarray) -> int:
    if not 0 <= i < len(items):
        raise IndexError(f"{call}({i}): out of range, there are {len(items)}.")
    return i
