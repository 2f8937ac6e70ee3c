"""Hulls as arrays of the contact kernels: vertices, faces, and what is next to what."""

from __future__ import annotations

import functools
from typing import NamedTuple

import numpy as np

from sheldrake.common.cached_arrays import cached_arrays
from sheldrake.geometry._kernels.model import CELLS, DIVIDED, HULL, FaceLoop, Geometry, HullFace, HullVertex
from sheldrake.geometry._meshes.polygon_mesh import PolygonSurfaceMesh

_MOST_CORNERS = 1000  # of a face among which its feet are sought
_MANY = 1000  # vertices from which on it pays to leave most of them out first
_LEVEL = 1e-9  # of the extent of a hull: vertices that are lower by no more are as low


class Hulls:
    """Collects the hulls of a model; equal hulls share their rows."""

    def __init__(self) -> None:
        self._rows: dict[int, np.ndarray] = {}
        self._meshes: list[PolygonSurfaceMesh] = []
        self._num_vertices = self._num_faces = 0

    def add(self, geometry: np.ndarray, mesh: PolygonSurfaceMesh) -> None:
        """Reserves rows for a hull and writes where they are; first_cell is the number of the hull for now."""
        if id(mesh) not in self._rows:
            row = np.zeros(Geometry.SIZE, np.int64)
            row[Geometry.first_vertex], row[Geometry.num_vertices] = self._num_vertices, mesh.num_vertices()
            row[Geometry.first_face], row[Geometry.num_faces] = self._num_faces, mesh.num_faces()
            row[Geometry.first_cell] = len(self._meshes)
            self._rows[id(mesh)] = row
            self._meshes.append(mesh)
            self._num_vertices += mesh.num_vertices()
            self._num_faces += mesh.num_faces()
        geometry[Geometry.first_vertex.at :] = self._rows[id(mesh)][Geometry.first_vertex.at :]

    def arrays(self, geometry: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """vertex, face, loop, topology; first_cell becomes what it says."""
        vertex = np.zeros((self._num_vertices, HullVertex.SIZE))
        face = np.zeros((self._num_faces, HullFace.SIZE))
        loop = np.zeros((self._num_faces, FaceLoop.SIZE), np.int64)
        if not self._meshes:  # as in many models: two lists of nothing
            return vertex, face, loop, np.full(2, 2)
        corners = [np.zeros(0, np.int64)]
        v0 = f0 = 0
        for mesh in self._meshes:
            vertex[v0 : v0 + mesh.num_vertices()], face[f0 : f0 + mesh.num_faces()] = mesh._vertices, _planes(mesh)
            loop[f0 : f0 + mesh.num_faces(), FaceLoop.num_corners] = mesh._sizes
            corners.append(v0 + mesh._flat)
            v0, f0 = v0 + mesh.num_vertices(), f0 + mesh.num_faces()
        flat = np.concatenate(corners)
        sizes = loop[:, FaceLoop.num_corners]
        topology = _lists(_neighbours(flat, sizes, v0), _faces_around(flat, sizes, v0))
        topology += [_loops(flat, loop, vertex, len(topology[0]))]
        starts, at, v0 = [], sum(map(len, topology)), 0
        for mesh in self._meshes:
            starts.append(at)
            topology.append(_cells(mesh._vertices).from_index(v0, at))
            at, v0 = at + len(topology[-1]), v0 + mesh.num_vertices()
        for row in geometry:
            if row[Geometry.kind] == HULL:
                row[Geometry.first_cell] = starts[row[Geometry.first_cell]]
        return vertex, face, loop, np.concatenate(topology)


def cell_corners() -> np.ndarray:
    """Corners of the cells on the sides of a cube around the origin, shape (6, CELLS + 1, CELLS + 1, 3)."""
    n = CELLS
    edge = 2.0 * np.arange(n + 1) / n - 1.0
    corners = np.zeros((3, 2, n + 1, n + 1, 3))
    for axis in range(3):
        corners[axis, 0, :, :, axis], corners[axis, 1, :, :, axis] = -1.0, 1.0
        corners[axis, ..., (axis + 1) % 3] = edge[:, None]
        corners[axis, ..., (axis + 2) % 3] = edge
    return corners.reshape(6, n + 1, n + 1, 3)


_CORNERS = cell_corners()


def part_corners(side: int, row: int, column: int) -> np.ndarray:
    """Corners of the parts of a cell, as many along each edge as there are cells, shape (CELLS + 1, CELLS + 1, 3)."""
    corners = _CORNERS[side]
    a, b, c = corners[row, column], corners[row + 1, column], corners[row, column + 1]
    part = np.arange(CELLS + 1)[:, None] / CELLS
    return a + part[:, None] * (b - a) + part * (c - a)


def _lowest_in_grid(corners: np.ndarray, vertices: np.ndarray, slack: float) -> np.ndarray:
    """Which vertices may be lowest along some direction through each cell of a grid, shape (cells, vertices).

    A vertex is none of them if another is lower along all four corners of the cell, and so along all between them. The
    others tried are those that are lowest along the corners and the middle.
    """
    height = corners @ vertices.T
    height = np.stack([height[:-1, :-1], height[1:, :-1], height[:-1, 1:], height[1:, 1:]])
    height = height.reshape(4, -1, len(vertices))
    may = np.ones(height.shape[1:], bool)
    for rivals in (*height, height.sum(axis=0)):
        lowest = rivals.argmin(axis=1)
        may &= np.any(height <= height[:, np.arange(len(lowest)), lowest][..., None] + slack, axis=0)
    return may


def _lowest_by_quarters(corners: np.ndarray, vertices: np.ndarray, slack: float) -> np.ndarray:
    """As `_lowest_in_grid`: of many vertices, only those are tried that may be lowest in a quarter of the grid."""
    n = len(corners) - 1
    if n == 1 or len(vertices) < _MANY:
        return _lowest_in_grid(corners, vertices, slack)
    half = n // 2
    may, cells = np.zeros((n * n, len(vertices)), bool), np.arange(n * n).reshape(n, n)
    in_quarters = _lowest_in_grid(corners[::half, ::half], vertices, slack)
    for quarter, (row, column) in zip(in_quarters, ((0, 0), (0, half), (half, 0), (half, half))):
        few = np.flatnonzero(quarter)
        around = corners[row : row + half + 1, column : column + half + 1]
        inside = cells[row : row + half, column : column + half].ravel()
        may[np.ix_(inside, few)] = _lowest_by_quarters(around, vertices[few], slack)
    return may


def _slack(vertices: np.ndarray) -> float:
    return _LEVEL * float(np.ptp(vertices, axis=0).sum())


def lowest_in_cells(vertices: np.ndarray) -> np.ndarray:
    """Which vertices may be lowest along some direction through each cell, in the order of `cell_of`."""
    slack = _slack(vertices)
    return np.concatenate([_lowest_by_quarters(corners, vertices, slack) for corners in _CORNERS])


def lowest_in_parts(vertices: np.ndarray, cell: int, slack: float) -> np.ndarray:
    """Which of the vertices that may be lowest in a cell may be in each of its parts."""
    side, place = divmod(cell, CELLS * CELLS)
    return _lowest_in_grid(part_corners(side, *divmod(place, CELLS)), vertices, slack)


class _Cells(NamedTuple):
    """Where in `topology` the vertices of each cell start, and they; as if both vertices and cells began at 0.

    Of a cell in which `DIVIDED` or more may be lowest there is one number instead: less than zero, where the same
    begins for its parts.
    """

    numbers: np.ndarray
    is_vertex: np.ndarray
    """Which numbers are vertices; the others are places in `topology`."""

    def from_index(self, v0: int, at: int) -> np.ndarray:
        """The same where the first vertex is v0, and the first number has the place `at`."""
        return self.numbers + np.where(self.is_vertex, v0, np.where(self.numbers < 0, -at, at))


def _cells(vertices: np.ndarray) -> _Cells:
    """The cells of a hull: made once for each, and kept on disk."""
    return _cells_of_bytes(np.ascontiguousarray(vertices, float).tobytes())


@functools.lru_cache(maxsize=512)
def _cells_of_bytes(data: bytes) -> _Cells:
    def make() -> tuple[np.ndarray, np.ndarray]:
        return _make_cells(np.frombuffer(data).reshape(-1, 3))

    return _Cells(*cached_arrays("cells", (__file__,), (repr((CELLS, DIVIDED)).encode(), data), make))


def _make_cells(vertices: np.ndarray) -> _Cells:
    may = lowest_in_cells(vertices)
    divided = np.flatnonzero(may.sum(axis=1) >= DIVIDED)
    those = [np.flatnonzero(may[cell]) for cell in divided]
    may[divided, 1:], may[divided, 0] = False, True
    tables = [_table(0, may, np.arange(len(vertices)))]
    end = len(tables[0].numbers)
    slack = _slack(vertices)
    for cell, few in zip(divided, those):
        tables[0].numbers[tables[0].numbers[cell]] = -end
        tables[0].is_vertex[tables[0].numbers[cell]] = False
        tables.append(_table(end, lowest_in_parts(vertices[few], int(cell), slack), few))
        end += len(tables[-1].numbers)
    return _Cells(*(np.concatenate(parts) for parts in zip(*tables)))


def _table(at: int, may: np.ndarray, which: np.ndarray) -> _Cells:
    """Where the lists of rows start, and where the last one ends, then which may be; for index `at` on."""
    starts = at + len(may) + 1 + np.concatenate([[0], np.cumsum(may.sum(axis=1))])
    vertices = which[np.nonzero(may)[1]]
    is_vertex = np.arange(len(starts) + len(vertices)) >= len(starts)
    return _Cells(np.concatenate([starts, vertices]), is_vertex)


def _planes(mesh: PolygonSurfaceMesh) -> np.ndarray:
    """Normal of each face, and how far along it the farthest of its corners is, shape (faces, 4)."""
    corners = mesh._sizes
    heights = (mesh._vertices[mesh._flat] * np.repeat(mesh._normals, corners, axis=0)).sum(axis=1)
    offsets = np.maximum.reduceat(heights, np.cumsum(corners) - corners)
    return np.column_stack([mesh._normals, offsets])


_Lists = tuple[np.ndarray, np.ndarray]
"""The lengths of lists, and what is in them, one after the other."""


def _lists(*tables: _Lists) -> list[np.ndarray]:
    """Of each table where its lists start and the last ends; then all lists; as one array in a list."""
    at = sum(len(lengths) + 1 for lengths, _ in tables)
    starts = []
    for lengths, _ in tables:
        starts.append(at + np.append(0, np.cumsum(lengths)))
        at = starts[-1][-1]
    return [np.concatenate([*starts, *(numbers for _, numbers in tables)])]


def _faces_around(flat: np.ndarray, sizes: np.ndarray, n: int) -> _Lists:
    """The faces that have each of n vertices as a corner, in order."""
    faces = np.repeat(np.arange(len(sizes)), sizes)
    return np.bincount(flat, minlength=n), faces[np.argsort(flat, kind="stable")]


def _neighbours(flat: np.ndarray, sizes: np.ndarray, n: int) -> _Lists:
    """The vertices joined to each of n vertices by an edge, sorted."""
    following, ends = np.roll(flat, -1), np.cumsum(sizes)
    following[ends - 1] = flat[ends - sizes]
    edges = np.sort(np.concatenate([flat * n + following, following * n + flat]))
    edges = edges[np.append(True, edges[1:] != edges[:-1])[: len(edges)]]  # `numpy.unique` takes five times longer
    return np.bincount(edges // max(n, 1), minlength=n), edges % max(n, 1)


def _loops(flat: np.ndarray, loop: np.ndarray, vertices: np.ndarray, at: int) -> np.ndarray:
    """The corners of each face and, where there are more than three, its feet, from index `at` on, as `loop` says."""
    sizes = loop[:, FaceLoop.num_corners]
    has_feet = sizes > 3
    lengths = sizes + 4 * has_feet
    begin, first = np.cumsum(lengths) - lengths, np.cumsum(sizes) - sizes
    loop[:, FaceLoop.first_corner] = at + begin
    loop[:, FaceLoop.first_foot] = np.where(has_feet, at + begin + sizes, -1)
    out = np.empty(lengths.sum(), np.int64)
    out[np.arange(len(flat)) + np.repeat(begin - first, sizes)] = flat
    for f in np.flatnonzero(has_feet).tolist():
        foot = begin[f] + sizes[f]
        out[foot : foot + 4] = _feet(vertices, flat[first[f] : first[f] + sizes[f]].tolist())
    return out


def _feet(vertices: np.ndarray, corners: list[int]) -> list[int]:
    """Four corners that span a face: the two farthest apart, and the farthest on either side of their line.

    Of very many corners only every second, third ... is looked at: all pairs of 20,000 would take 10 GB.
    """
    corners = corners[:: -(-len(corners) // _MOST_CORNERS)]
    if len(corners) == 4:
        return corners
    p = vertices[corners]
    apart = np.linalg.norm(p[:, None] - p[None], axis=2)
    a, b = divmod(int(apart.argmax()), len(corners))
    line = p[b] - p[a]
    normal = np.cross(p[1] - p[0], p[2] - p[0])
    side = (p - p[a]) @ np.cross(normal, line)
    chosen = sorted({a, b, int(side.argmax()), int(side.argmin())})
    while len(chosen) < 4:
        chosen.append(next(k for k in range(len(corners)) if k not in chosen))
    return [corners[k] for k in sorted(chosen)]
