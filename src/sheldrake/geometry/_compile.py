"""From geometry state to the arrays of the contact kernels.

The plant asks for them once per layout; kernels then see only numbers: shapes, poses in bodies, candidate pairs by
family, materials after defaults.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from . import _defaults
from . import _proximity_properties as proximity
from ._ids import FrameId, GeometryId
from ._kernels import model as columns
from ._kernels.cells import cell_width
from ._kernels.model import GeometryModel
from ._meshes.polygon_mesh import PolygonSurfaceMesh
from ._records import GeometryRecord
from ._roles import Role
from ._shapes import Box, Capsule, Convex, Cylinder, Ellipsoid, HalfSpace, Mesh, Shape, Sphere
from ._state import GeometryState
from ._text import choices

CELLS_FROM = 100
"""Number of geometries from which on close pairs are sought in cells rather than among all pairs."""


def compile_proximity(
    state: GeometryState, body_of_frame: dict[FrameId, int], cells: bool = False
) -> tuple[GeometryModel, list[GeometryId]]:
    """The proximity geometry of a state as arrays, and the ids of its rows.

    Args:
        state: with default proximity properties filled in.
        body_of_frame: body index of every frame that has proximity geometry.
        cells: whether pairs may be left to be found in cells, see `GeometryModel.cell`.

    Raises:
        RuntimeError: a frame without body, a geometry without friction, a property with a bad value.
        NotImplementedError: a shape that can not touch others.
    """
    ids = state.ids_with_role(Role.kProximity)
    rows = {geometry_id: row for row, geometry_id in enumerate(ids)}
    records = [state.geometries[geometry_id] for geometry_id in ids]
    hulls = _Hulls()
    geometry = np.zeros((len(ids), columns.GEOMETRY_COLUMNS), np.int64)
    size = np.zeros((len(ids), columns.SIZE_COLUMNS))
    material = np.zeros((len(ids), columns.MATERIAL_COLUMNS))
    X_BG = np.zeros((len(ids), 12))
    for row, record in enumerate(records):
        if record.frame not in body_of_frame:
            frame = state.frames[record.frame].name
            raise RuntimeError(
                f"Geometry '{record.name}' belongs to frame '{frame}', which is none of the bodies of the plant."
            )
        geometry[row, columns.BODY] = body_of_frame[record.frame]
        geometry[row, columns.MULTI_POINT] = _algorithm(record) == "multi_point"
        _fill_shape(geometry[row], size[row], record, hulls)
        material[row] = _material(record)
        X_BG[row, :9] = record.X_FG.rotation().matrix().ravel()
        X_BG[row, 9:] = record.X_FG.translation()
    kind, body = geometry[:, columns.KIND], geometry[:, columns.BODY]
    excluded = np.array([(rows[a], rows[b]) for a, b in state.filter.excluded() if a in rows and b in rows], np.int64)
    excluded = excluded.reshape(-1, 2)
    cells = cells and len(ids) >= CELLS_FROM
    if cells:
        pairs, partner = _pairs_with_half_spaces(kind), _partners(excluded, body)
        cell = np.array([cell_width(size[:, columns.BOUND])])
    else:
        pairs, partner = np.stack(np.triu_indices(len(ids), 1), axis=1), np.zeros(0, np.int64)
        cell = np.zeros(0)
    pair, family = _by_family(_that_may_touch(pairs, excluded, kind, body), kind)
    vertex, face, loop, topology = hulls.arrays(geometry)
    model = GeometryModel(
        geometry, size, material, X_BG, pair, np.zeros(1), family, vertex, face, loop, topology, cell, partner
    )
    return model, ids


def _pairs_with_half_spaces(kind: np.ndarray) -> np.ndarray:
    """All pairs of a half space and something else, lower row first."""
    half_spaces, others = np.flatnonzero(kind == columns.HALF_SPACE), np.flatnonzero(kind != columns.HALF_SPACE)
    pairs = np.stack(np.meshgrid(half_spaces, others, indexing="ij"), axis=-1).reshape(-1, 2)
    return np.sort(pairs, axis=1)


def _that_may_touch(pairs: np.ndarray, excluded: np.ndarray, kind: np.ndarray, body: np.ndarray) -> np.ndarray:
    """Those pairs that are not of one body, not two half spaces, and not excluded by a filter."""
    a, b = pairs.T
    keys, out = a * len(kind) + b, excluded[:, 0] * len(kind) + excluded[:, 1]
    both = (kind[a] == columns.HALF_SPACE) & (kind[b] == columns.HALF_SPACE)
    return pairs[(body[a] != body[b]) & ~both & ~np.isin(keys, out)]


def _partners(excluded: np.ndarray, body: np.ndarray) -> np.ndarray:
    """`GeometryModel.partner`: where the excluded partners of each geometry begin, then the partners."""
    n, excluded = len(body), excluded[body[excluded[:, 0]] != body[excluded[:, 1]]]
    excluded = excluded[np.lexsort((excluded[:, 1], excluded[:, 0]))]
    return np.concatenate([n + 1 + np.searchsorted(excluded[:, 0], np.arange(n + 1)), excluded[:, 1]])


def _by_family(pair: np.ndarray, kind: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pairs sorted by family, A and B, and where each family begins."""
    first, second = np.sort(kind[pair], axis=1).T
    family = np.full(len(pair), columns.CONVEX)
    family[(first == columns.BOX) & (second == columns.BOX)] = columns.BOXES
    family[(first == columns.SPHERE) & (second <= columns.ELLIPSOID)] = columns.SPHERES
    family[second == columns.HALF_SPACE] = columns.HALF_SPACES
    order = np.lexsort((pair[:, 1], pair[:, 0], family))
    return np.ascontiguousarray(pair[order]), np.searchsorted(family[order], np.arange(columns.NUM_FAMILIES + 1))


def _property(record: GeometryRecord, group: str, name: str, default: Any = None) -> Any:
    return record.roles[Role.kProximity].GetPropertyOrDefault(group, name, default)


def _algorithm(record: GeometryRecord) -> str:
    value = _property(record, *_defaults.POINT_CONTACT_ALGORITHM, default=_defaults.point_contact_algorithm)
    if value not in _defaults.POINT_CONTACT_ALGORITHMS:
        raise RuntimeError(
            f"Geometry '{record.name}': property {_defaults.POINT_CONTACT_ALGORITHM} is {value!r}; "
            f"expected {choices(_defaults.POINT_CONTACT_ALGORITHMS)}."
        )
    return value


def _material(record: GeometryRecord) -> tuple[float, ...]:
    """The row of GeometryModel.material."""
    friction = _property(record, proximity.MATERIAL, proximity.FRICTION)
    if friction is None:
        raise RuntimeError(
            f"Geometry '{record.name}' has no friction: its proximity properties lack "
            f"('{proximity.MATERIAL}', '{proximity.FRICTION}') and SceneGraphConfig gives no default."
        )
    numbers = []
    for name in (proximity.POINT_STIFFNESS, proximity.DISSIPATION, proximity.RELAXATION_TIME):
        value = float(_property(record, proximity.MATERIAL, name, math.nan))
        if value < 0.0:
            raise RuntimeError(f"Geometry '{record.name}': property ('material', '{name}') must not be negative.")
        numbers.append(value)
    return (*numbers, friction.static_friction(), friction.dynamic_friction())


def _fill_shape(geometry: np.ndarray, size: np.ndarray, record: GeometryRecord, hulls: _Hulls) -> None:
    """Kind, measures and bounding sphere of one geometry."""
    shape: Shape = record.shape
    if isinstance(shape, Sphere):
        kind, measures, bound = columns.SPHERE, (shape.radius(), 0.0, 0.0), shape.radius()
    elif isinstance(shape, Box):
        half = shape.size() / 2.0
        kind, measures, bound = columns.BOX, tuple(half), float(np.linalg.norm(half))
    elif isinstance(shape, (Cylinder, Capsule)):
        r, h = shape.radius(), shape.length() / 2.0
        kind = columns.CYLINDER if isinstance(shape, Cylinder) else columns.CAPSULE
        measures, bound = (r, 0.0, h), (math.hypot(r, h) if kind == columns.CYLINDER else r + h)
    elif isinstance(shape, Ellipsoid):
        kind, measures = columns.ELLIPSOID, (shape.a(), shape.b(), shape.c())
        bound = max(measures)
    elif isinstance(shape, (Convex, Mesh)):
        mesh = shape.GetConvexHull()
        kind, measures = columns.HULL, (0.0, 0.0, 0.0)
        centre, _ = mesh.CalcBoundingBox()
        size[columns.CENTRE : columns.CENTRE + 3] = centre
        bound = float(np.linalg.norm(mesh._vertices - centre, axis=1).max())
        hulls.add(geometry, mesh)
    elif isinstance(shape, HalfSpace):
        kind, measures, bound = columns.HALF_SPACE, (0.0, 0.0, 0.0), math.inf
    else:
        raise NotImplementedError(f"Geometry '{record.name}': a {type(shape).__name__} can not touch other geometry.")
    geometry[columns.KIND] = kind
    size[:3] = measures
    size[columns.BOUND] = bound


class _Hulls:
    """Collects the hulls of a model; equal hulls share their rows."""

    def __init__(self) -> None:
        self._rows: dict[int, np.ndarray] = {}
        self._meshes: list[PolygonSurfaceMesh] = []
        self._num_vertices = self._num_faces = 0

    def add(self, geometry: np.ndarray, mesh: PolygonSurfaceMesh) -> None:
        """Reserves rows for a hull and writes where they are; FIRST_EXTREME is the number of the hull for now."""
        if id(mesh) not in self._rows:
            row = np.zeros(columns.GEOMETRY_COLUMNS, np.int64)
            row[columns.FIRST_VERTEX], row[columns.NUM_VERTICES] = self._num_vertices, mesh.num_vertices()
            row[columns.FIRST_FACE], row[columns.NUM_FACES] = self._num_faces, mesh.num_faces()
            row[columns.FIRST_EXTREME] = len(self._meshes)
            self._rows[id(mesh)] = row
            self._meshes.append(mesh)
            self._num_vertices += mesh.num_vertices()
            self._num_faces += mesh.num_faces()
        geometry[columns.FIRST_VERTEX :] = self._rows[id(mesh)][columns.FIRST_VERTEX :]

    def arrays(self, geometry: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """vertex, face, loop, topology; FIRST_EXTREME becomes what it says."""
        vertex = np.zeros((self._num_vertices, 3))
        face = np.zeros((self._num_faces, 4))
        loop = np.zeros((self._num_faces, 3), np.int64)
        topology: list[int] = [0] * (self._num_vertices + 1)
        v0 = f0 = 0
        for mesh in self._meshes:
            vertex[v0 : v0 + mesh.num_vertices()] = mesh._vertices
            for v, neighbours in enumerate(_neighbours(mesh)):
                topology[v0 + v] = len(topology)
                topology.extend(v0 + n for n in neighbours)
                topology[v0 + v + 1] = len(topology)
            v0 += mesh.num_vertices()
        extremes = []
        v0 = 0
        for mesh in self._meshes:
            for f, corners in enumerate(mesh._faces):
                face[f0, :3] = mesh._normals[f]
                face[f0, 3] = float((mesh._vertices[list(corners)] @ mesh._normals[f]).mean())
                loop[f0, columns.FIRST_CORNER], loop[f0, columns.NUM_CORNERS] = len(topology), len(corners)
                topology.extend(v0 + v for v in corners)
                loop[f0, columns.FIRST_FOOT] = len(topology) if len(corners) > 3 else -1
                topology.extend(v0 + v for v in _feet(mesh._vertices, corners))
                f0 += 1
            extremes.append(len(topology))
            for k in range(3):
                topology.extend((v0 + int(mesh._vertices[:, k].argmin()), v0 + int(mesh._vertices[:, k].argmax())))
            v0 += mesh.num_vertices()
        for row in geometry:
            if row[columns.KIND] == columns.HULL:
                row[columns.FIRST_EXTREME] = extremes[row[columns.FIRST_EXTREME]]
        return vertex, face, loop, np.array(topology, np.int64)


def _neighbours(mesh: PolygonSurfaceMesh) -> list[list[int]]:
    """The vertices joined to each vertex by an edge, sorted."""
    joined: list[set[int]] = [set() for _ in range(mesh.num_vertices())]
    for corners in mesh._faces:
        for a, b in zip(corners, (*corners[1:], corners[0])):
            joined[a].add(b)
            joined[b].add(a)
    return [sorted(found) for found in joined]


def _feet(vertices: np.ndarray, corners: tuple[int, ...]) -> list[int]:
    """Four corners that span a face: the two farthest apart, and the farthest on either side of their line."""
    if len(corners) <= 4:
        return list(corners) if len(corners) == 4 else []
    p = vertices[list(corners)]
    apart = np.linalg.norm(p[:, None] - p[None], axis=2)
    a, b = divmod(int(apart.argmax()), len(corners))
    line = p[b] - p[a]
    normal = np.cross(p[1] - p[0], p[2] - p[0])
    side = (p - p[a]) @ np.cross(normal, line)
    chosen = sorted({a, b, int(side.argmax()), int(side.argmin())})
    while len(chosen) < 4:
        chosen.append(next(k for k in range(len(corners)) if k not in chosen))
    return [corners[k] for k in sorted(chosen)]
