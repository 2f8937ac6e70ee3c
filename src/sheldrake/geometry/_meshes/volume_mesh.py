"""Volumes made of tetrahedra.

What compliant hydroelastic bodies are made of; their pressure is a field on it.
"""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._scalars import frozen
from sheldrake.geometry._numbers import as_numbers, lengths, plain

from .mesh_files import boundary_triangles
from .triangle_mesh import TriangleSurfaceMesh

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sheldrake.common._types import Scalars


class VolumeElement:
    """The vertex numbers of a tetrahedron; the normal of the first three points at the fourth."""

    __slots__ = ("_v",)

    def __init__(self, v0: int, v1: int, v2: int, v3: int) -> None:
        if min(v0, v1, v2, v3) < 0:
            raise ValueError(f"VolumeElement(): vertex numbers must not be negative, got {(v0, v1, v2, v3)}.")
        self._v = (int(v0), int(v1), int(v2), int(v3))

    def num_vertices(self) -> int:
        """Four."""
        return 4

    def vertex(self, i: int) -> int:
        """The number of corner `i` in the mesh."""
        if not 0 <= i < 4:
            raise IndexError(f"VolumeElement.vertex({i}): a tetrahedron has corners 0, 1, 2, 3.")
        return self._v[i]

    def __copy__(self) -> VolumeElement:
        return VolumeElement(*self._v)

    def __deepcopy__(self, memo: dict) -> VolumeElement:
        return copy.copy(self)


@checked
class VolumeMesh:
    """A volume of tetrahedra in a frame M.

    Args:
        elements: list of VolumeElement.
        vertices: positions in M [m], shape (n, 3) or a list of n positions.
    """

    def __init__(self, elements: Sequence[VolumeElement] | Sequence[Sequence[int]], vertices: Scalars) -> None:
        rows = [e._v if isinstance(e, VolumeElement) else tuple(e) for e in elements]
        if not rows:
            raise RuntimeError("A mesh must contain at least one tetrahedral element")
        self._elements = np.array(rows, dtype=np.int64).reshape(-1, 4)
        self._vertices = as_numbers(vertices).reshape(-1, 3)

    def num_elements(self) -> int:
        """Number of tetrahedra."""
        return len(self._elements)

    def num_vertices(self) -> int:
        """Number of vertices."""
        return len(self._vertices)

    def element(self, e: int) -> VolumeElement:
        """Tetrahedron `e`."""
        return VolumeElement(*self._elements[e].tolist())

    def vertex(self, v: int) -> np.ndarray:
        """Position of vertex `v` in M [m], shape (3,)."""
        return self._vertices[v].copy()

    def tetrahedra(self) -> list[VolumeElement]:
        """All tetrahedra."""
        return [VolumeElement(*row) for row in self._elements.tolist()]

    def vertices(self) -> list[np.ndarray]:
        """Positions of all vertices in M [m], read-only."""
        return list(frozen(self._vertices.copy()))

    def CalcTetrahedronVolume(self, e: int) -> float:
        """Volume of a tetrahedron [m^3], positive when its corners are in order."""
        return plain(self._volumes()[e])

    def CalcVolume(self) -> float:
        """Volume of all tetrahedra [m^3]."""
        return plain(self._volumes().sum())

    def _volumes(self) -> np.ndarray:
        a, b, c, d = (self._vertices[self._elements[:, k]] for k in range(4))
        return (np.cross(b - a, c - a) * (d - a)).sum(axis=1) / 6.0

    def CalcBarycentric(self, p_MQ: Scalars, e: int) -> np.ndarray:
        """Barycentric coordinates of Q in a tetrahedron, shape (4,)."""
        a, b, c, d = self._vertices[self._elements[e]]
        u, v, w, q = b - a, c - a, d - a, as_numbers(p_MQ).reshape(3) - a
        volume = np.cross(u, v) @ w
        b1, b2, b3 = np.cross(v, w) @ q / volume, np.cross(w, u) @ q / volume, np.cross(u, v) @ q / volume
        return np.array([1.0 - b1 - b2 - b3, b1, b2, b3])

    def edge_vector(self, e: int, a: int, b: int) -> np.ndarray:
        """Vector from corner `a` to corner `b` of a tetrahedron, in M [m], shape (3,)."""
        corners = self._vertices[self._elements[e]]
        return corners[b] - corners[a]

    def inward_normal(self, e: int, f: int) -> np.ndarray:
        """Unit normal, pointing in, of the face opposite corner `f` of a tetrahedron, shape (3,)."""
        corners = self._vertices[self._elements[e]]
        a, b, c = (corners[k] for k in range(4) if k != f)
        normal = np.cross(b - a, c - a)
        normal = normal / lengths(normal)
        return normal if normal.dot(corners[f] - a) > 0.0 else -normal

    def Equal(self, mesh: VolumeMesh, vertex_tolerance: float = 0) -> bool:
        """True if tetrahedra are the same, and no vertex is farther from its counterpart than the tolerance [m]."""
        if not np.array_equal(self._elements, mesh._elements) or self._vertices.shape != mesh._vertices.shape:
            return False
        return bool(np.all(lengths(self._vertices - mesh._vertices) <= vertex_tolerance))

    def __copy__(self) -> VolumeMesh:
        return VolumeMesh(self._elements.tolist(), self._vertices)

    def __deepcopy__(self, memo: dict) -> VolumeMesh:
        return copy.copy(self)


@checked
def ConvertVolumeToSurfaceMesh(volume: VolumeMesh) -> TriangleSurfaceMesh:
    """The surface of a volume mesh: faces that belong to one tetrahedron only; unused vertices are dropped."""
    triangles = boundary_triangles(volume._elements)
    used, renumbered = np.unique(triangles, return_inverse=True)
    return TriangleSurfaceMesh(renumbered.reshape(-1, 3).tolist(), volume._vertices[used])
