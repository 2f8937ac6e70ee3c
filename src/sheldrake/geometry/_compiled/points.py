"""From geometry state to the arrays of the contact kernels.

The plant asks for them once per layout; kernels then see only numbers: shapes, poses in bodies, candidate pairs by
family, materials after defaults.
"""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np

from sheldrake.common._text import choices
from sheldrake.geometry import _proximity_properties as proximity
from sheldrake.geometry._compiled.hulls import Hulls
from sheldrake.geometry._ids import FrameId, GeometryId
from sheldrake.geometry._kernels import model as kernel_model
from sheldrake.geometry._kernels.model import Geometry, GeometryModel, Margins, Material, PoseInBody, Size
from sheldrake.geometry._kernels.spatial_hash import median, width_of_cells
from sheldrake.geometry._roles import Role
from sheldrake.geometry._shape_types import type_of
from sheldrake.geometry._state.records import GeometryRecord
from sheldrake.geometry._state.state import GeometryState

CELLS_FROM = 200
"""Number of geometries from which on close pairs are sought in cells rather than among all pairs."""

SKIN = 0.25
"""Skin of near pairs, relative to the median bounding sphere."""


def compile_proximity(
    state: GeometryState, body_of_frame: dict[FrameId, int], cells: bool = False
) -> tuple[GeometryModel, list[GeometryId]]:
    """The proximity geometry of a state as arrays, and the ids of its rows.

    Args:
        state: with default proximity properties filled in.
        body_of_frame: body index of every frame whose geometry is wanted; that of others is left out.
        cells: whether pairs may be left to be found in cells, see `GeometryModel.cell`.

    Raises:
        RuntimeError: a geometry without friction, a property with a bad value.
        NotImplementedError: a shape that can not touch others.
    """
    ids = [i for i in state.ids_with_role(Role.kProximity) if state.geometries[i].frame in body_of_frame]
    rows = {geometry_id: row for row, geometry_id in enumerate(ids)}
    records = [state.geometries[geometry_id] for geometry_id in ids]
    hulls = Hulls()
    geometry = np.zeros((len(ids), Geometry.SIZE), np.int64)
    size = np.zeros((len(ids), Size.SIZE))
    geometry[:, Geometry.body] = [body_of_frame[record.frame] for record in records]
    algorithms = [_algorithm(record, state.point_contact_algorithm) for record in records]
    geometry[:, Geometry.multi_point] = [algorithm == "multi_point" for algorithm in algorithms]
    _fill_shapes(geometry, size, records, hulls)
    material = np.array([_material(record) for record in records], float).reshape(-1, Material.SIZE)
    poses = [part for record in records for part in (record.X_FG._R._M.ravel(), record.X_FG._p)]
    X_BG = np.concatenate([*poses, np.zeros(0)]).reshape(-1, PoseInBody.SIZE)
    kind, body = geometry[:, Geometry.kind], geometry[:, Geometry.body]
    pairs_of_ids = state.filter.excluded(ids)
    excluded = np.array([(rows[a], rows[b]) for a, b in pairs_of_ids if a in rows and b in rows], np.int64)
    excluded = excluded.reshape(-1, 2)
    cells = cells and len(ids) >= CELLS_FROM
    if cells:
        pairs, partner = _pairs_with_half_spaces(kind), _partners(excluded, body)
        cell = np.array([width_of_cells(size[:, Size.bound])])
        pair, family = _by_family(_that_may_touch(pairs, excluded, kind, body), kind)
    else:
        partner, cell = np.zeros(0, np.int64), np.zeros(0)
        pair, family = _pairs_of(kind.tobytes(), body.tobytes(), excluded.tobytes())
    vertex, face, loop, topology = hulls.arrays(geometry)
    margin = np.zeros(Margins.SIZE)
    margin[Margins.skin] = _skin(size[:, Size.bound])
    model = GeometryModel(
        geometry, size, material, X_BG, pair, margin, family, vertex, face, loop, topology, cell, partner
    )
    return model, ids


@functools.lru_cache(64)
def _pairs_of(kinds: bytes, bodies: bytes, filtered: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of all geometries that may touch, by family, and where each family begins; of scenes alike the same."""
    kind, body, excluded = (np.frombuffer(numbers, np.int64) for numbers in (kinds, bodies, filtered))
    found = _by_family(_that_may_touch(_all_pairs(len(kind)), excluded.reshape(-1, 2), kind, body), kind)
    for array in found:
        array.flags.writeable = False
    return found


def _skin(bounds: np.ndarray) -> float:
    """Skin of near pairs for bounding spheres of these radii [m]."""
    finite = bounds[np.isfinite(bounds)]
    return SKIN * median(finite) if len(finite) else 0.0


def _all_pairs(n: int) -> np.ndarray:
    """All pairs of n rows, lower row first (`numpy.triu_indices` takes four times longer)."""
    row = np.arange(n)
    return np.stack(np.nonzero(row[:, None] < row), axis=1)


def _pairs_with_half_spaces(kind: np.ndarray) -> np.ndarray:
    """All pairs of a half space and something else, lower row first."""
    half_spaces, others = (
        np.flatnonzero(kind == kernel_model.HALF_SPACE),
        np.flatnonzero(kind != kernel_model.HALF_SPACE),
    )
    pairs = np.stack(np.meshgrid(half_spaces, others, indexing="ij"), axis=-1).reshape(-1, 2)
    return np.sort(pairs, axis=1)


def _that_may_touch(pairs: np.ndarray, excluded: np.ndarray, kind: np.ndarray, body: np.ndarray) -> np.ndarray:
    """Those pairs that are not of one body, not two half spaces, and not excluded by a filter."""
    a, b = pairs.T
    keys, out = a * len(kind) + b, excluded[:, 0] * len(kind) + excluded[:, 1]
    both = (kind[a] == kernel_model.HALF_SPACE) & (kind[b] == kernel_model.HALF_SPACE)
    return pairs[(body[a] != body[b]) & ~both & ~np.isin(keys, out)]


def _partners(excluded: np.ndarray, body: np.ndarray) -> np.ndarray:
    """`GeometryModel.partner`: where the excluded partners of each geometry begin, then the partners."""
    n, excluded = len(body), excluded[body[excluded[:, 0]] != body[excluded[:, 1]]]
    excluded = excluded[np.lexsort((excluded[:, 1], excluded[:, 0]))]
    return np.concatenate([n + 1 + np.searchsorted(excluded[:, 0], np.arange(n + 1)), excluded[:, 1]])


def _by_family(pair: np.ndarray, kind: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pairs sorted by family, A and B, and where each family begins."""
    first, second = np.sort(kind[pair], axis=1).T
    family = np.full(len(pair), kernel_model.CONVEX)
    family[(first == kernel_model.BOX) & (second == kernel_model.BOX)] = kernel_model.BOXES
    family[(first == kernel_model.SPHERE) & (second <= kernel_model.ELLIPSOID)] = kernel_model.SPHERES
    family[second == kernel_model.HALF_SPACE] = kernel_model.HALF_SPACES
    order = np.lexsort((pair[:, 1], pair[:, 0], family))
    return np.ascontiguousarray(pair[order]), np.searchsorted(family[order], np.arange(kernel_model.Families.SIZE))


def _property(record: GeometryRecord, group: str, name: str, default: object = None) -> Any:
    return record.roles[Role.kProximity]._get(group, name, default)


def _algorithm(record: GeometryRecord, default: str) -> str:
    value = _property(record, proximity.MATERIAL, proximity.POINT_CONTACT_ALGORITHM, default)
    if value not in proximity.POINT_CONTACT_ALGORITHMS:
        raise RuntimeError(
            f"Geometry '{record.name}': property ('{proximity.MATERIAL}', '{proximity.POINT_CONTACT_ALGORITHM}') is "
            f"{value!r}; expected {choices(proximity.POINT_CONTACT_ALGORITHMS)}."
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
    names = proximity.POINT_STIFFNESS, proximity.DISSIPATION, proximity.RELAXATION_TIME
    numbers = [float(_property(record, proximity.MATERIAL, name, math.nan)) for name in names]
    for name, value in zip(names, numbers):
        if value < 0.0:
            raise RuntimeError(f"Geometry '{record.name}': property ('material', '{name}') must not be negative.")
    return (*numbers, friction.static_friction(), friction.dynamic_friction())


def _fill_shapes(geometry: np.ndarray, size: np.ndarray, records: list[GeometryRecord], hulls: Hulls) -> None:
    """Kind, measures and bounding sphere of each geometry."""
    kinds, half_sizes, bounds = [], [], []
    for row, record in enumerate(records):
        shape = record.shape
        shape_type = type_of(shape)
        if shape_type.kind is None:
            raise NotImplementedError(f"Geometry '{record.name}': a {shape.type_name()} can not touch other geometry.")
        kinds.append(shape_type.kind)
        if shape_type.hull is None:
            half_sizes.append(shape_type.half_sizes(shape))
            bounds.append(shape_type.bound(shape))
        else:
            mesh = shape_type.hull(shape)
            centre, extents = mesh.CalcBoundingBox()
            size[row, Size.centre_G.columns] = centre
            half_sizes.append(tuple(np.asarray(extents) / 2.0))
            bounds.append(float(np.linalg.norm(mesh._vertices - centre, axis=1).max()))
            hulls.add(geometry[row], mesh)
    if records:
        geometry[:, Geometry.kind], size[:, Size.half_sizes.columns], size[:, Size.bound] = kinds, half_sizes, bounds
