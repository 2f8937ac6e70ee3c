"""Convex hulls of points: vertices in the order of the input, flat faces merged into polygons."""

from __future__ import annotations

import functools
import itertools
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common.cached_arrays import cached_arrays

from . import mesh_files, polytope_hull, read_dae, read_obj, read_stl, read_vtk
from .mesh_files import read_mesh
from .mesh_source import MeshSource
from .polygon_mesh import PolygonSurfaceMesh
from .polytope_hull import wrap

if TYPE_CHECKING:
    from pathlib import Path

    import scipy.sparse

_COINCIDENT = 1e-12  # [m] points within a sphere of this radius are one point
_FLAT = 1e-9  # relative to the size: points closer to a plane (line) are in it
_THICKNESS = 1e-6  # relative to the size: height of the apex that makes a flat hull solid
_SAME_PLANE = 1e-9  # normals of two facets of one face differ by less
_MADE_BY = (__file__, *(str(m.__file__) for m in (mesh_files, polytope_hull, read_dae, read_obj, read_stl, read_vtk)))


def make_convex_hull_of_source(source: MeshSource, scale3: np.ndarray) -> PolygonSurfaceMesh:
    """The hull of the vertices of a mesh, scaled along each axis; cached per file, time of change and scale.

    Of meshes in one file it is also kept on disk, by the bytes of the file.
    """
    scale = tuple(float(s) for s in np.broadcast_to(np.asarray(scale3, dtype=float).reshape(-1), (3,)))
    if source.is_path() and (stamp := _time_of_change(source.path())) is not None:
        return _cached_hull(source.path(), stamp, scale)
    return make_convex_hull(_vertices(source) * scale, source.description())


def _time_of_change(path: Path) -> int | None:
    try:
        return path.stat().st_mtime_ns
    except OSError:
        return None


def _vertices(source: MeshSource) -> np.ndarray:
    return read_mesh(source, "MakeConvexHull()").vertices


@functools.lru_cache(maxsize=512)  # robots and the clutter around them: hulls are small
def _cached_hull(path: Path, stamp: int, scale: tuple[float, float, float]) -> PolygonSurfaceMesh:
    source = MeshSource(path)
    if source.extension() not in mesh_files.IN_ONE_FILE:
        return make_convex_hull(_vertices(source) * scale, str(path))
    data = mesh_files.bytes_of(path)

    def make() -> tuple[np.ndarray, np.ndarray]:
        vertices = mesh_files.parse(data, source.extension(), str(path)).vertices
        hull = make_convex_hull(vertices * scale, str(path))
        return np.array(hull.face_data()), hull._vertices

    made_of = source.extension().encode(), data, np.array(scale).tobytes()
    return PolygonSurfaceMesh(*cached_arrays("hull", _MADE_BY, made_of, make))


def make_convex_hull(points: Any, name: str = "the given points") -> PolygonSurfaceMesh:
    """The convex hull of points [m], shape (n, 3).

    Its vertices are the extreme points in the order given (the first of equal ones); its faces are polygons, their
    corners counter-clockwise seen from outside. Points in one plane give a hull with a very flat apex.

    Raises:
        RuntimeError: fewer than three points, or all of them in one point or on one line.
    """
    points = np.asarray(points, dtype=float).reshape(-1, 3)
    points = points[_first_of_equals(points)]
    points = _make_solid(points, name)
    loops = wrap(points, _SAME_PLANE * np.ptp(points, axis=0).max()) or _qhull(points, name)
    corners, first, sizes = _corners(loops)
    vertices, renumbered = np.unique(corners, return_inverse=True)
    return PolygonSurfaceMesh(np.insert(renumbered, first, sizes), points[vertices])


def _corners(loops: list[list[int]]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The corners of all loops one after the other, where each loop begins, and how many it has."""
    sizes = np.fromiter(map(len, loops), np.int64, len(loops))
    corners = np.fromiter(itertools.chain.from_iterable(loops), np.int64, sizes.sum())
    return corners, np.cumsum(sizes) - sizes, sizes


def _first_of_equals(points: np.ndarray) -> np.ndarray:
    """Numbers of the points that differ from all before them, in order (`numpy.unique` of rows is ten times slower)."""
    order = np.lexsort(points.T)
    ordered = points[order]
    is_first = np.ones(len(points), dtype=bool)
    is_first[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    return np.sort(order[is_first])


def _qhull(points: np.ndarray, name: str) -> list[list[int]]:
    """Faces of the hull as loops of corners, from Qhull's triangles."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        hull = ConvexHull(points)
    except QhullError as error:
        raise RuntimeError(f"MakeConvexHull failed for: {name}: {error}") from error
    return _merged_faces(_outward(points, hull), hull.equations, hull.neighbors)


def _make_solid(points: np.ndarray, name: str) -> np.ndarray:
    """Checks that the points span at least a plane; if only a plane, adds an apex just above their mean."""
    if len(points) < 3:
        extent = np.ptp(points, axis=0).max() if len(points) else 0.0
        if len(points) and extent < _COINCIDENT:
            raise RuntimeError(
                f"MakeConvexHull failed because all vertices in the mesh were within a sphere with radius "
                f"{_COINCIDENT:g} for geometry: {name}."
            )
        raise RuntimeError(
            "MakeConvexHull() cannot be used on a mesh with fewer than three vertices; "
            f"found {len(points)} vertices in geometry data: {name}."
        )
    centred = points - points.mean(axis=0)
    _, _, axes = np.linalg.svd(centred, full_matrices=False)
    extents = np.ptp(centred @ axes.T, axis=0)
    if extents[0] < _COINCIDENT:
        raise RuntimeError(
            f"MakeConvexHull failed because all vertices in the mesh were within a sphere with radius "
            f"{_COINCIDENT:g} for geometry: {name}."
        )
    if extents[1] < _FLAT * extents[0]:
        raise RuntimeError(
            f"MakeConvexHull failed because all vertices in the mesh appear to be co-linear for file: {name}."
        )
    if extents[2] < _FLAT * extents[0]:
        points = np.vstack([points, points.mean(axis=0) + _THICKNESS * extents[0] * axes[2]])
    return points


def _outward(points: np.ndarray, hull: scipy.spatial.ConvexHull) -> np.ndarray:
    """The facets of a qhull result with their corners counter-clockwise seen from outside."""
    a, b, c = (points[hull.simplices[:, k]] for k in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), hull.equations[:, :3]) < 0.0
    triangles = hull.simplices.copy()
    triangles[inward] = triangles[inward][:, [0, 2, 1]]
    return triangles


def _merged_faces(triangles: np.ndarray, equations: np.ndarray, neighbors: np.ndarray) -> list[list[int]]:
    """Boundary loops of the groups of triangles in one plane; the triangles themselves if a group is no polygon."""
    size = max(1e-300, np.abs(equations[:, 3]).max())
    planes = equations / (1.0, 1.0, 1.0, size)
    # Most triangles of a round shape have no neighbour in their plane; only the others are looked at one by one.
    lonely = np.ones(len(planes), dtype=bool)
    for k in range(3):
        apart = np.abs(planes[neighbors[:, k]] - planes)
        lonely &= np.maximum.reduce(apart.T) >= 2.0 * _SAME_PLANE
    groups: list[list[int]] = []
    taken = lonely.copy()
    for seed in np.flatnonzero(~lonely).tolist():
        if taken[seed]:
            continue
        members, queue = [], [seed]
        taken[seed] = True
        while queue:
            t = queue.pop()
            members.append(t)
            for n in neighbors[t].tolist():
                if not taken[n] and np.abs(planes[n] - planes[seed]).max() < _SAME_PLANE:
                    taken[n] = True
                    queue.append(n)
        groups.append(members)
    alone = triangles.tolist()
    loops = [alone[group[0]] if len(group) == 1 else _boundary(triangles[group]) for group in groups]
    whole = triangles[lonely].tolist() + [loop for loop in loops if loop]
    return whole if None not in loops and _is_closed(whole, _how_many(triangles)) else alone


def _boundary(triangles: np.ndarray) -> list[int] | None:
    """The single loop of edges that have a triangle on one side only, or None."""
    edges = {(int(t[k]), int(t[(k + 1) % 3])) for t in triangles for k in range(3)}
    following = {a: b for a, b in edges if (b, a) not in edges}
    if len(following) != sum((b, a) not in edges for a, b in edges):
        return None
    start = min(following)
    loop = [start]
    while following[loop[-1]] != start:
        loop.append(following[loop[-1]])
        if len(loop) > len(following):
            return None
    return loop if len(loop) == len(following) else None


def _is_closed(loops: list[list[int]], num_vertices: int) -> bool:
    """True if every edge has its opposite, Euler's formula holds, and there are so many vertices."""
    ends, first, sizes = _corners(loops)
    starts = np.roll(ends, 1)
    starts[first] = ends[first + sizes - 1]
    count = ends.max() + 1
    edges, opposite = np.sort(starts * count + ends), np.sort(ends * count + starts)
    euler = num_vertices - len(edges) // 2 + len(loops)
    return np.array_equal(edges, opposite) and _how_many(ends) == num_vertices and euler == 2


def _how_many(vertices: np.ndarray) -> int:
    """Different numbers among those of vertices (`numpy.unique` takes ten times longer)."""
    return int(np.count_nonzero(np.bincount(vertices.ravel())))
