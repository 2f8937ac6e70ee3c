"""From geometry state to the arrays of the hydroelastic kernels; which kernels a scene needs, and for which pairs."""

from __future__ import annotations

from functools import partial
from typing import Any, NamedTuple

import numpy as np

from sheldrake.common.chain import Chain
from sheldrake.common.kernel import Kernel
from sheldrake.geometry._hydroelastic.representation import Representation, compliance, representation_of
from sheldrake.geometry._ids import GeometryId
from sheldrake.geometry._kernels import hydro
from sheldrake.geometry._kernels.hydro_model import (
    COMPLIANT_AND_COMPLIANT,
    COMPLIANT_AND_RIGID,
    MESH_ON_RIGID_HALF_SPACE,
    NUM_PARTS,
    RIGID_MESH_ON_HALF_SPACE,
    Choices,
    Compliance,
    Families,
    Field,
    Found,
    HydroModel,
    HydroTable,
    Mesh,
    Part,
    empty_hydro_model,
    hydro_table,
)
from sheldrake.geometry._kernels.model import ContactTable, GeometryModel, Size
from sheldrake.geometry._numbers import like
from sheldrake.geometry._roles import HydroelasticContactRepresentation, HydroelasticType, Role
from sheldrake.geometry._shapes import HalfSpace
from sheldrake.geometry._state.state import GeometryState

# Kinds of representation
_NONE, _RIGID, _COMPLIANT, _RIGID_HALF_SPACE, _COMPLIANT_HALF_SPACE = range(5)
# (kind of the first, kind of the second): family, in the order in which its kernel takes the two
_FAMILY = {
    (_COMPLIANT, _RIGID_HALF_SPACE): MESH_ON_RIGID_HALF_SPACE,
    (_RIGID, _COMPLIANT_HALF_SPACE): RIGID_MESH_ON_HALF_SPACE,
    (_COMPLIANT, _RIGID): COMPLIANT_AND_RIGID,
    (_COMPLIANT, _COMPLIANT): COMPLIANT_AND_COMPLIANT,
}
_KERNELS = (
    hydro.mesh_on_rigid_half_space,
    hydro.rigid_mesh_on_half_space,
    hydro.compliant_and_rigid,
    hydro.compliant_and_compliant,
)

SHARES = 1.0, 1 / 4, 1 / 16, 1 / 64
"""How much of a compliant mesh is in each of its parts, as a share of the range of its pressure."""
assert len(SHARES) == NUM_PARTS
_ROUNDING = 1e-12
"""By how much boxes are larger than they need be: rounding must not separate what touches."""
MOST_FACES = 1 << 16
"""Polygons that a table has room for; a plant needs about 1 kB for each."""
MOST_OF_A_PAIR = 1 << 15
"""Polygons that one pair of geometries gets room for."""


class HydroPairs(NamedTuple):
    """Which pairs of a scene make contact surfaces.

    Attributes:
        model: what the kernels read.
        points: the geometry model with the other pairs only.
    """

    model: HydroModel
    points: GeometryModel


def _kind(record: Any) -> int:
    found = compliance(record.roles[Role.kProximity])
    half_space = isinstance(record.shape, HalfSpace)
    if found is HydroelasticType.kRigid:
        return _RIGID_HALF_SPACE if half_space else _RIGID
    if found is HydroelasticType.kCompliant:
        return _COMPLIANT_HALF_SPACE if half_space else _COMPLIANT
    return _NONE


def has_surfaces(state: GeometryState) -> bool:
    """Whether any geometry can make contact surfaces."""
    return any(_kind(state.geometries[i]) != _NONE for i in state.ids_with_role(Role.kProximity))


def compile_hydro(
    state: GeometryState,
    model: GeometryModel,
    ids: list[GeometryId],
    representation: HydroelasticContactRepresentation,
) -> HydroPairs:
    """Splits the pairs of a geometry model into those that make contact surfaces and those that touch in points.

    Args:
        state: with default proximity properties filled in.
        model: of all proximity geometry.
        ids: of its rows.
        representation: of contact surfaces.
    """
    records = [state.geometries[i] for i in ids]
    kinds = np.array([_kind(record) for record in records], np.int64)
    if not kinds.any():
        return HydroPairs(empty_hydro_model(), model)
    families = np.full((5, 5), -1, np.int64)
    for (first, second), family in _FAMILY.items():
        families[first, second] = families[second, first] = family
    family = families[kinds[model.pair[:, 0]], kinds[model.pair[:, 1]]]
    chosen = family >= 0
    pair, family = model.pair[chosen], family[chosen]
    order = np.lexsort((pair[:, 1], pair[:, 0], family))
    pair, family = pair[order], family[order]
    first_kind = np.array([first for first, _ in _FAMILY], np.int64)
    swapped = kinds[pair[:, 0]] != first_kind[family]
    pair[swapped] = pair[swapped][:, ::-1]
    starts = np.searchsorted(family, np.arange(Families.SIZE))
    representations = {row: representation_of(records[row]) for row in np.unique(pair).tolist()}
    setting = np.zeros(Choices.SIZE, np.int64)
    setting[Choices.triangles] = representation is HydroelasticContactRepresentation.kTriangle
    centres = model.size[:, Size.centre_G.columns]
    compiled = _Meshes(centres, representations).model(np.ascontiguousarray(pair), starts, setting)
    kept = np.concatenate([[0], np.cumsum(~chosen)])
    points = model._replace(pair=np.ascontiguousarray(model.pair[~chosen]), family=kept[model.family])
    return HydroPairs(compiled, points)


class _Meshes:
    """Collects the meshes of a scene; equal meshes share their rows."""

    def __init__(self, centres: np.ndarray, representations: dict[int, Representation | None]) -> None:
        count = len(centres)
        self._geometry = np.zeros((count, Mesh.SIZE), np.int64)
        self._number = np.zeros((count, Compliance.SIZE))
        self._part = np.zeros((count, NUM_PARTS, Part.SIZE))
        self._parts: list[tuple[np.ndarray, ...]] = []  # vertex, element, field, node, leaf of each mesh
        self._sizes = np.zeros(5, np.int64)
        known: dict[tuple[bytes, bytes, bytes], tuple[np.ndarray, list[np.ndarray]]] = {}
        for row, found in representations.items():
            assert found is not None
            bound = np.linalg.norm(found.vertices - centres[row], axis=1).max(initial=0.0) * (1.0 + 1e-12)
            bound = np.inf if found.half_space else bound
            self._number[row] = found.modulus, found.slope, found.margin, bound
            if found.half_space:
                continue
            key = (found.vertices.tobytes(), found.elements.tobytes(), found.pressure.tobytes())
            if key not in known:
                known[key] = self._add(found)
            self._geometry[row], cores = known[key]
            if not found.rigid:
                self._part[row] = _parts(found, cores, centres[row])

    def _add(self, found: Representation) -> tuple[np.ndarray, list[np.ndarray]]:
        """Row of `Mesh`, and the points of the cores of its thin parts."""
        vertices, elements, field = (_triangle_arrays if found.rigid else _tetrahedron_arrays)(found)
        corners = found.vertices[found.elements.T]
        leaf = order_of_leaves(corners)
        nodes, cores = [boxes_of_tree(corners, leaf)], []
        for most in [] if found.rigid else _bounds(found)[1:]:
            crossings = _crossings(found, corners, most)
            below = np.where(found.pressure[:, None] <= most, found.vertices, np.nan)[found.elements.T]
            nodes.append(boxes_of_tree(np.concatenate((below, crossings)), leaf))
            core = np.concatenate((found.vertices[found.pressure >= most], crossings.reshape(-1, 3)))
            cores.append(core[np.isfinite(core[:, 0])])
        node = np.concatenate(nodes)
        first_vertex, first_element, _, first_node, first_leaf = self._sizes
        numbered = np.where(elements < 0, -1, elements + first_vertex)
        part = (vertices, numbered, field, node, np.where(leaf < 0, -1, leaf + first_element))
        self._parts.append(part)
        self._sizes += [len(p) for p in part]
        return np.array([first_element, first_vertex, first_node, first_leaf, len(leaf)]), cores

    def model(self, pair: np.ndarray, family: np.ndarray, setting: np.ndarray) -> HydroModel:
        """The meshes with the pairs that use them."""
        model = empty_hydro_model()._replace(
            geometry=self._geometry,
            number=self._number,
            part=self._part.reshape(-1, Part.SIZE),
            pair=pair,
            family=family,
            setting=setting,
        )
        if not self._parts:
            return model
        vertex, element, field, node, leaf = (np.ascontiguousarray(np.concatenate(part)) for part in zip(*self._parts))
        return model._replace(vertex=vertex, element=element, field=field, node=node, leaf=leaf)


def _triangle_arrays(found: Representation) -> tuple[np.ndarray, ...]:
    """Vertices, elements and field of a rigid surface."""
    a, b, c = (found.vertices[found.elements[:, k]] for k in range(3))
    cross = np.cross(b - a, c - a)
    norm = np.linalg.norm(cross, axis=1)[:, None]
    field = np.zeros((len(a), Field.SIZE))
    field[:, Field.normal.columns] = np.divide(cross, norm, out=np.zeros_like(cross), where=norm > 0.0)
    elements = np.column_stack([found.elements, np.full(len(a), -1)])
    return np.column_stack([found.vertices, np.zeros(len(found.vertices))]), elements, field


def _tetrahedron_arrays(found: Representation) -> tuple[np.ndarray, ...]:
    """Vertices, elements and field of a compliant volume."""
    corner, pressure = found.vertices[found.elements], found.pressure[found.elements]
    field = np.zeros((len(corner), Field.SIZE))
    gradient, planes = field[:, Field.gradient.columns], field[:, Field.planes.columns].reshape(-1, 4, 4)
    edges = corner[:, 1:] - corner[:, :1]
    volume = np.einsum("ij,ij->i", np.cross(edges[:, 0], edges[:, 1]), edges[:, 2])
    rises = pressure[:, 1:] - pressure[:, :1]
    for k in range(3):  # Cramer's rule: the gradient has the component rise_k along edge k
        dual = np.cross(edges[:, (k + 1) % 3], edges[:, (k + 2) % 3])
        gradient += rises[:, k, None] * dual
    flat = ~(volume > 0.0)
    gradient /= np.where(flat, 1.0, volume)[:, None]
    gradient[flat] = 0.0
    field[:, Field.at_origin] = pressure[:, 0] - np.einsum("ij,ij->i", gradient, corner[:, 0])
    for k, face in enumerate(((1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1))):  # opposite corner k, seen from outside
        p, q, r = (corner[:, i] for i in face)
        normal = np.cross(q - p, r - p)
        norm = np.linalg.norm(normal, axis=1)[:, None]
        normal = np.divide(normal, norm, out=np.zeros_like(normal), where=norm > 0.0)
        planes[:, k, :3] = normal
        planes[:, k, 3] = np.einsum("ij,ij->i", normal, p)
    return np.column_stack([found.vertices, found.pressure]), found.elements, field


def _bounds(found: Representation) -> np.ndarray:
    """The most pressure that there is in each part [Pa]: in all, and in thin ones along the surface."""
    least, most = found.pressure.min(), found.pressure.max()
    return least + (most - least) * np.array(SHARES)


def _crossings(found: Representation, corners: np.ndarray, pressure: float) -> np.ndarray:
    """Where edges of tetrahedra cross a pressure, else NaN, shape (6, n, 3)."""
    value = found.pressure[found.elements.T]
    is_below = value < pressure
    points = np.full((6, len(found.elements), 3), np.nan)
    for k, (a, b) in enumerate(((0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3))):
        at = np.flatnonzero(is_below[a] != is_below[b])
        share = (pressure - value[a, at]) / (value[b, at] - value[a, at])
        points[k, at] = corners[a, at] + share[:, None] * (corners[b, at] - corners[a, at])
    return points


def _parts(found: Representation, cores: list[np.ndarray], centre: np.ndarray) -> np.ndarray:
    """Rows of `Part` of a compliant mesh; nothing is the core of all of it."""
    parts = np.zeros((NUM_PARTS, Part.SIZE))
    parts[:, Part.pressure] = _bounds(found)
    parts[0, Part.half_sizes.columns] = -1.0
    for part, core in zip(parts[1:], cores):
        low, high = core.min(axis=0), core.max(axis=0)
        part[Part.centre.columns] = (low + high) / 2.0
        part[Part.half_sizes.columns] = (high - low) / 2.0 * (1.0 + _ROUNDING)
        part[Part.reach] = np.linalg.norm(core - centre, axis=1).max() * (1.0 + _ROUNDING)
    return parts


def order_of_leaves(corners: np.ndarray) -> np.ndarray:
    """Leaves of a complete binary tree over elements, halved at the median of their middles along the longest side.

    Args:
        corners: of the elements [m], shape (corners, n, 3).

    Returns:
        The element of each leaf, -1 for none, shape (m,), m a power of two.
    """
    n = corners.shape[1]
    levels = max(0, int(n - 1).bit_length())
    m = 1 << levels
    order = np.full(m, -1, np.int64)
    order[:n] = np.arange(n)
    middle = np.full((m + 1, 3), np.nan)  # the last row stands for element -1
    middle[:n] = (corners.min(axis=0) + corners.max(axis=0)) / 2.0
    for level in range(levels):
        groups = order.reshape(1 << level, -1)
        points = middle[groups]
        gone = groups < 0
        least = np.where(gone[:, :, None], np.inf, points).min(axis=1)
        most = np.where(gone[:, :, None], -np.inf, points).max(axis=1)
        axis = np.argmax(most - least, axis=1)
        key = np.where(gone, np.inf, np.take_along_axis(points, axis[:, None, None], axis=2)[:, :, 0])
        order = np.take_along_axis(groups, np.argsort(key, axis=1, kind="stable"), axis=1).ravel()
    return order


def boxes_of_tree(corners: np.ndarray, leaf: np.ndarray) -> np.ndarray:
    """Boxes about elements and about all in the leaves below a node.

    Args:
        corners: of the elements [m], NaN for none, shape (corners, n, 3).
        leaf: what `order_of_leaves` gave, shape (m,).

    Returns:
        Centre and half sizes of each node's box, shape (2 m - 1, 6), root first, children of node k at 2 k + 1 and
        2 k + 2.
    """
    m = len(leaf)
    low, high = np.fmin.reduce(corners), np.fmax.reduce(corners)
    boxes_low, boxes_high = np.full((2 * m - 1, 3), np.inf), np.full((2 * m - 1, 3), -np.inf)
    used = leaf >= 0
    used[used] = np.isfinite(low[leaf[used], 0])
    boxes_low[m - 1 :][used], boxes_high[m - 1 :][used] = low[leaf[used]], high[leaf[used]]
    for level in reversed(range(m.bit_length() - 1)):
        first, n = (1 << level) - 1, 1 << level
        below = slice(2 * first + 1, 2 * first + 1 + 2 * n)
        boxes_low[first : first + n] = boxes_low[below].reshape(n, 2, 3).min(axis=1)
        boxes_high[first : first + n] = boxes_high[below].reshape(n, 2, 3).max(axis=1)
    empty = ~np.isfinite(boxes_low[:, 0])
    boxes_low[empty], boxes_high[empty] = 1.0, -1.0
    half = (boxes_high - boxes_low) / 2.0
    half[~empty] *= 1.0 + _ROUNDING
    return np.column_stack([(boxes_low + boxes_high) / 2.0, half])


def hydro_kernels(model: HydroModel) -> list[Kernel]:
    """The kernels that find a scene's contact surfaces, in their order; none when there are no pairs."""
    if not len(model.pair):
        return []
    return [hydro.begin_surfaces, *(k for k, n in zip(_KERNELS, np.diff(model.family)) if n > 0)]


def face_capacity(model: HydroModel) -> int:
    """Faces that a table should have room for.

    A half space meets every element once; two meshes meet along a surface, where an element meets a few others: 2.7
    at most in random poses, three times that is what one pair gets. A body may touch many others, but each with a part
    of its surface only. Very fine meshes get less: they meet others with a part of their elements.
    """
    if len(model.pair) == 0:
        return 0
    leaves = model.geometry[:, Mesh.num_leaves]
    a, b = leaves[model.pair[:, 0]], leaves[model.pair[:, 1]]
    needed = np.minimum(a * b, 8 * (a + b))
    flat = int(model.family[Families.with_rigid])
    needed[:flat] = a[:flat]
    needed = np.minimum(needed, MOST_OF_A_PAIR)
    shared = min(4 * int(leaves[np.unique(model.pair)].sum()), MOST_FACES)
    polygons = min(int(needed.sum()), max(shared, int(needed.max())))
    return min(5 * polygons, 2 * MOST_FACES) if model.setting[Choices.triangles] else polygons


def find_surfaces(model: HydroModel, table: ContactTable, native: bool = True) -> HydroTable:
    """All contact surfaces of placed geometry, with as much room as they need.

    Args:
        model: the hydroelastic geometry.
        table: where all geometry is; see `place_geometries`.
        native: False runs the kernels' Python sources.
    """
    return SurfaceSearch(model, table, native and table.X_WG.dtype != object).find()  # duals run the Python sources


class SurfaceSearch:
    """The same again and again on one table of placed geometry; kernels are bound anew when faces need more room.

    Args:
        model: the hydroelastic geometry.
        table: where all geometry is.
        native: False runs the kernels' Python sources.
    """

    def __init__(self, model: HydroModel, table: ContactTable, native: bool = True) -> None:
        self._model, self._table, self._native = model, table, native
        self._make_room(max(1, face_capacity(model)))

    def _make_room(self, capacity: int) -> None:
        surfaces = HydroTable(*(like(a, self._table.X_WG.dtype) for a in hydro_table(self._model, capacity)))
        chain = Chain(hydro_kernels(self._model))
        values: Any = dict(hydro_model=self._model, table=self._table, surfaces=surfaces)
        self._capacity, self._surfaces = capacity, surfaces
        self._run = chain.bind(**values) if self._native else partial(chain, **values)

    def find(self) -> HydroTable:
        """All contact surfaces, in the same arrays each time."""
        while True:
            self._run()
            if self._surfaces.count[Found.status] == 0:
                return self._surfaces
            self._make_room(4 * self._capacity)


def explain_unsupported(state: GeometryState, id_A: GeometryId, id_B: GeometryId) -> Exception:
    """What is wrong with hydroelastic contact of two geometries that can have none."""
    records = [state.geometries[i] for i in (id_A, id_B)]
    words = {_NONE: "undefined", _RIGID: "rigid", _COMPLIANT: "compliant"}
    words |= {_RIGID_HALF_SPACE: "rigid", _COMPLIANT_HALF_SPACE: "compliant"}
    kinds = [_kind(record) for record in records]
    names = [f"{r.shape.type_name()} '{r.name}' with id {i.get_value()}" for r, i in zip(records, (id_A, id_B))]
    hint = (
        "QueryObject.ComputeContactSurfacesWithFallback() and ContactModel.kHydroelasticWithFallback use point contact "
        "for such pairs."
    )
    if _NONE in kinds:
        named = " and ".join(f"a {words[kind]} {name}" for kind, name in zip(kinds, names))
        return RuntimeError(
            "Requested a contact surface between a pair of geometries without hydroelastic representation for at "
            f"least one shape: {named}. {hint}"
        )
    if all(words[kind] == "rigid" for kind in kinds):
        return RuntimeError(
            f"Requested contact between two rigid objects ({names[0]}, {names[1]}); that is not allowed in "
            f"hydroelastic-only contact. {hint}"
        )
    return RuntimeError(
        "Requested hydroelastic contact between two compliant geometries, one of which is a half space "
        f"({names[0]}, {names[1]}); that is not allowed. {hint}"
    )
