"""The proximity geometry that queries ask about, compiled, and the search for contacts that is kept between them."""

from __future__ import annotations

import itertools
import operator
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.autodiffutils._complex_step import PATIENCE, Source, Sweep, sweep_sources
from sheldrake.autodiffutils._matrices import filled
from sheldrake.common._native import store as kernel_store
from sheldrake.common._native.binding import imaginary_parts
from sheldrake.common.chain import Chain
from sheldrake.common.kernel import Kernel, jit_enabled
from sheldrake.geometry._compiled.hydroelastic import HydroPairs, SurfaceSearch
from sheldrake.geometry._compiled.search import family_kernels
from sheldrake.geometry._ids import FrameId, GeometryId
from sheldrake.geometry._kernels.contacts import bounds_that_meet, place_geometries
from sheldrake.geometry._kernels.model import (
    SPHERE,
    BodyPose,
    BodyPoses,
    ContactPoint,
    ContactTable,
    Found,
    Geometry,
    GeometryModel,
    Material,
    Size,
    contact_table,
)
from sheldrake.geometry._kernels.pair_distance import find_distances, see_from_geometries, see_from_point
from sheldrake.geometry._kernels.spatial_hash import make_cells
from sheldrake.geometry._numbers import all_duals
from sheldrake.geometry._query.contact_surface import ContactSurface, surfaces_of
from sheldrake.geometry._roles import HydroelasticContactRepresentation
from sheldrake.geometry._shapes import Mesh
from sheldrake.geometry._state.records import WORLD_FRAME_ID
from sheldrake.geometry._state.state import GeometryState

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import DTypeLike

    from sheldrake.geometry._ids import SourceId


_next_number = itertools.count(1).__next__
_NUM_CONTACTS, _STATUS = operator.index(Found.num_contacts), operator.index(Found.status)
_NO_POINTS = np.empty((0, ContactPoint.SIZE))


FoundPoints = tuple[list[list[int]], np.ndarray]
"""Pairs of rows of the model, and of each the row of a contact table that says where they touch."""


def points_in(table: ContactTable) -> FoundPoints:
    """A copy of what a table has; constants beside duals are duals too: they may be asked for derivatives."""
    n = table.count.item(_NUM_CONTACTS)
    if n == 0:
        return [], _NO_POINTS
    point = table.point[:n].copy()
    return table.pair[:n, :2].tolist(), point if point.dtype == float else all_duals(point)


class GivenPoses:
    """Poses of the bodies of a scene that stay as they are, shape (num_bodies, 12); of duals where they are."""

    def __init__(self, X_WB: np.ndarray) -> None:
        self._X_WB, self._number = X_WB, _next_number()
        self.are_duals = X_WB.dtype == object

    def X_WB(self) -> np.ndarray:
        """The poses, read-only."""
        return self._X_WB

    def stamp(self) -> tuple[int, int]:
        """What is equal for equal poses."""
        return self._number, 0

    def write(self, X_WB: np.ndarray) -> None:
        """Fills an array with them."""
        X_WB[:] = self._X_WB


class ShownPoses:
    """The same of bodies of a plant, which move: read where the plant has them."""

    are_duals = False

    def __init__(self, view: Any, rows: np.ndarray, counters: Any) -> None:
        """
        Args:
            view: What has them, `view.X_WB()`, and says which counter of writes moves with them, `view.level`.
            rows: Where they are there.
            counters: The counters of a context.
        """
        self._rows, self._number = rows, _next_number()
        self._ask, self._level, self._counters = view.X_WB, view.level, counters

    def X_WB(self) -> np.ndarray:
        return self._ask().take(self._rows, 0)

    def stamp(self) -> tuple[int, int]:
        return self._number, self._counters[self._level]

    def write(self, X_WB: np.ndarray) -> None:
        self._ask().take(self._rows, 0, X_WB, "clip")  # (the other modes fill a buffer first)


Poses = GivenPoses | ShownPoses


class QueryScene:
    """The proximity geometry of a state as arrays; every frame is a body of its own, the first is the world.

    Attributes:
        model: The geometry; two bodies touch at one point.
        in_order: The same, its pairs sorted by their rows, whatever family they are of.
        ids: Which geometry a row of the model is.
        moving: The frames but the world that have geometry.
        bodies: Their bodies.
        row_of: The row of each geometry.
        meshes: The shapes of the rows that are meshes, not hulls of such.
        at_home: Poses of bodies that are where the world is.
        memo: For `QueryObject._world_matrices()` of `moving`.
    """

    def __init__(self, state: GeometryState, model: GeometryModel, ids: list[GeometryId], frames: list[FrameId]):
        geometry = model.geometry.copy()
        geometry[:, Geometry.multi_point] = 0
        self.model, self.ids, self.num_bodies = model._replace(geometry=geometry), ids, len(frames)
        present = {state.geometries[i].frame for i in ids} - {WORLD_FRAME_ID}
        self.bodies = [body for body, frame in enumerate(frames) if frame in present]
        self.moving = [frames[body] for body in self.bodies]
        by_rows = np.lexsort((model.pair[:, 1], model.pair[:, 0]))
        self.in_order = self.model._replace(pair=np.ascontiguousarray(model.pair[by_rows]))
        self._rows_of_bodies = _slice_or_array(self.bodies)
        self.row_of = {geometry_id: row for row, geometry_id in enumerate(ids)}
        shapes = {row: state.geometries[geometry_id].shape for row, geometry_id in enumerate(ids)}
        self.meshes = {row: shape for row, shape in shapes.items() if isinstance(shape, Mesh)}
        self.at_home = world_poses(len(frames), float)
        self.memo: dict = {}
        self._idle: list[_Search] = []
        self._idle_candidates: list[_Candidates] = []
        self._idle_surfaces: dict[HydroelasticContactRepresentation, list[_Surfaces]] = {}
        self._idle_distances: dict[str, list[_Distances]] = {"pairs": [], "pair": [], "point": []}
        self._idle_dual_distances: list[_DualDistances] = []
        self._dual_distances = 0

    def place_bodies(self, X_WF: np.ndarray) -> np.ndarray:
        """Poses of all bodies, read-only, of those of `moving`, shape (n, 12)."""
        X_WB = self.at_home.copy()
        X_WB[self._rows_of_bodies] = X_WF
        X_WB.flags.writeable = False
        return X_WB

    def places_of_all(self, published: Mapping[SourceId, Any] | None) -> np.ndarray | None:
        """Rows of the bodies among the frames that the only source gives; None until `_world_matrices` found out."""
        (source_id,) = self.memo["sources"]
        frames, places = self.memo.get(source_id, (None, None))
        return places if frames is published else None

    def find_points(self, poses: Poses) -> FoundPoints:
        """All pairs that overlap at poses that are numbers."""
        search = self._take_search()
        try:
            search.run(poses)
            return search.found()
        finally:
            self._idle.append(search)

    def some_overlap(self, poses: Poses) -> bool:
        """Whether any pair overlaps at these poses."""
        search = self._take_search()
        try:
            return search.run(poses) > 0
        finally:
            self._idle.append(search)

    def _take_search(self) -> _Search:
        """A search, which is of one thread at a time."""
        try:
            return self._idle.pop()
        except IndexError:
            return _Search(self.model, self.num_bodies)

    def find_candidates(self, poses: Poses) -> list[list[int]]:
        """The pairs of rows whose bounding spheres overlap at these poses, sorted."""
        try:
            search = self._idle_candidates.pop()
        except IndexError:
            search = _Candidates(self.in_order, self.num_bodies)
        try:
            return search.find(poses)
        finally:
            self._idle_candidates.append(search)

    def find_surfaces(
        self, pairs: HydroPairs, representation: HydroelasticContactRepresentation, poses: Poses
    ) -> tuple[list[ContactSurface], FoundPoints]:
        """Contact surfaces at these poses, and points of the pairs that can have none; `pairs` are of this scene."""
        idle = self._idle_surfaces.setdefault(representation, [])
        search = idle.pop() if idle else _Surfaces(pairs, self.num_bodies)
        try:
            return search.find(poses, self.ids)
        finally:
            idle.append(search)

    def find_distances(self, poses: Poses, reach: float) -> FoundPoints:
        """All pairs no farther apart than `reach` [m] at poses that are numbers.

        Here and below points are seen in the frames of their geometries.
        """
        return self._distances("pairs", lambda: self.in_order, poses, reach)

    def find_distance(self, a: int, b: int, poses: Poses) -> FoundPoints:
        """One pair of rows of the model, whether or not they may touch."""
        make = lambda: self.model._replace(pair=np.zeros((1, 2), np.int64))  # noqa: E731
        return self._distances("pair", make, poses, np.inf, (a, b))

    def find_distance_of_duals(self, rows: list[int], X_WB: np.ndarray) -> FoundPoints | None:
        """The same for bodies whose poses are AutoDiffXd or numbers, by machine code; None where there is none yet."""
        self._dual_distances += 1
        try:
            search = self._idle_dual_distances.pop()
        except IndexError:
            if not _DualDistances.can(self._dual_distances):
                return None
            search = _DualDistances(self.model, self.num_bodies)
        try:
            return search.find(rows, X_WB)
        finally:
            self._idle_dual_distances.append(search)

    def find_distances_to(self, p_WQ: np.ndarray, poses: Poses, reach: float) -> FoundPoints:
        """All geometry no farther away from a point than `reach` [m]."""
        return self._distances("point", lambda: with_point(self.model, self.num_bodies), poses, reach, p_WQ=p_WQ)

    def _distances(
        self, kind: str, make: Any, poses: Poses, reach: float, pair: Any = None, p_WQ: np.ndarray | None = None
    ) -> FoundPoints:
        idle = self._idle_distances[kind]
        try:
            search = idle.pop()
        except IndexError:
            see = see_from_geometries if p_WQ is None else see_from_point
            search = _Distances(make(), self.num_bodies, see)
        try:
            return search.find(poses, reach, pair, p_WQ)
        finally:
            idle.append(search)


def explain_contact_status(model: GeometryModel, table: ContactTable) -> Exception:
    """The error for a search of contacts that did not end well."""
    return RuntimeError(
        f"More than {table.pair.shape[0]} contact points among {model.pair.shape[0]} pairs of geometries: the contact "
        "table is full."
    )


class _Placing:
    """Where a search has the poses of the bodies, and of which moment they are: what is there is not written again."""

    def __init__(self, X_WB: np.ndarray):
        self.X_WB, self._stamp = X_WB, (0, 0)

    def moves(self, poses: Poses) -> bool:
        """Writes poses; whether they are other ones than before."""
        stamp = poses.stamp()
        if stamp == self._stamp:
            return False
        self._stamp = 0, 0  # of none, should this not end well
        poses.write(self.X_WB)
        self._stamp = stamp
        return True


class _Search:
    """Bound kernels and their arrays: binding takes far longer than the search of a robot's surroundings."""

    def __init__(self, model: GeometryModel, num_bodies: int):
        self._model, self._placing = model, _Placing(np.empty((num_bodies, BodyPose.SIZE)))
        self.table = contact_table(model, capacity=max(1, model.pair.shape[0]))  # room for one point a pair
        bodies, cells = BodyPoses(self._placing.X_WB), make_cells(model)
        self._run = Chain([place_geometries, *family_kernels(model)]).bind(
            geometry_model=model, bodies=bodies, table=self.table, cells=cells
        )
        self._status = self._num_contacts = 0

    def run(self, poses: Poses) -> int:
        """Looks at all pairs, if that has not just been done; how many contacts there are."""
        if self._placing.moves(poses):
            self._run()
            count = self.table.count
            self._status, self._num_contacts = count.item(_STATUS), count.item(_NUM_CONTACTS)
        if self._status:
            raise explain_contact_status(self._model, self.table)
        return self._num_contacts

    def found(self) -> FoundPoints:
        """What `run` has found."""
        return points_in(self.table)


class _Candidates:
    """The same for pairs that are near."""

    def __init__(self, model: GeometryModel, num_bodies: int):
        self._placing, self._count = _Placing(np.empty((num_bodies, BodyPose.SIZE))), 0
        self._pair = np.zeros((max(1, model.pair.shape[0]), 2), np.int64)
        table = contact_table(model, capacity=1)
        self._place = place_geometries.bind(model, BodyPoses(self._placing.X_WB), table)
        self._run = bounds_that_meet.bind(model, table, self._pair)

    def find(self, poses: Poses) -> list[list[int]]:
        if self._placing.moves(poses):
            self._place()
            self._count = self._run()
        return self._pair[: self._count].tolist()


class _Surfaces:
    """The same for contact surfaces."""

    def __init__(self, pairs: HydroPairs, num_bodies: int):
        self._pairs, self._points = pairs, _Search(pairs.points, num_bodies)
        self._surfaces = SurfaceSearch(pairs.model, self._points.table) if len(pairs.model.pair) else None

    def find(self, poses: Poses, ids: list[GeometryId]) -> tuple[list[ContactSurface], FoundPoints]:
        self._points.run(poses)
        if self._surfaces is None:
            return [], self._points.found()
        surfaces = surfaces_of(self._surfaces.find(), self._pairs.model, ids)
        return [surface for _, surface in surfaces], self._points.found()


class _Distances:
    """The same for distances."""

    def __init__(self, model: GeometryModel, num_bodies: int, see: Kernel):
        self._model, X_WB = model, world_poses(num_bodies + 1, float)  # the last is that of a point
        self._placing, self._p_WQ = _Placing(X_WB[:-1]), X_WB[-1, BodyPose.p_WB.columns]
        self._table = contact_table(model, capacity=max(1, model.pair.shape[0]))
        self._run = find_distances.bind(model, BodyPoses(X_WB), np.inf, self._table)
        self._see = see.bind(self._model, self._table)
        self._asked: Any = None

    def find(self, poses: Poses, reach: float, pair: Any, p_WQ: np.ndarray | None) -> FoundPoints:
        asked = reach, pair, None if p_WQ is None else p_WQ.tobytes()
        if self._placing.moves(poses) or asked != self._asked:
            self._asked = None
            self._search(float(reach), pair, p_WQ)
            self._asked = asked
        return points_in(self._table)

    def _search(self, reach: float, pair: Any, p_WQ: np.ndarray | None) -> None:
        if p_WQ is not None:
            self._p_WQ[:] = p_WQ
        if pair is not None:
            self._model.pair[0] = pair
        self._run.set("reach", reach)
        if self._run():
            raise explain_contact_status(self._model, self._table)
        self._see()


class _DualDistances:
    """The same for the distance of two geometries at poses of AutoDiffXd: on complex numbers, by each derivative."""

    def __init__(self, model: GeometryModel, num_bodies: int):
        self._model = model._replace(pair=np.zeros((1, 2), np.int64))
        self._changes = np.zeros(1, np.int64)
        self._X_WB = Source(world_poses(num_bodies, float), self._changes)
        table = contact_table(self._model, capacity=1)
        self._table = ContactTable(*(a.astype(complex) if a.dtype == float else a for a in table))
        find = find_distances, (self._model, BodyPoses(self._X_WB.numbers), np.inf, self._table)
        self._sweep = Sweep(
            [find, (see_from_geometries, (self._model, self._table))], imaginary_parts(self._table.point)
        )

    @staticmethod
    def can(calls: int) -> bool:
        """Whether the machine code is there, or may be made by now."""
        if not jit_enabled():
            return False
        is_ready = all(kernel_store.is_ready(k.on_complex) for k in (find_distances, see_from_geometries))
        return is_ready or (calls > PATIENCE and kernel_store.can_compile())

    def find(self, rows: list[int], X_WB: np.ndarray) -> FoundPoints | None:
        """The distance of rows of the model; None where not all poses have as many derivatives."""
        self._model.pair[0] = rows
        if X_WB is not self._X_WB.duals:  # which stay as they are
            self._X_WB.duals = X_WB
            self._changes += 1
        slopes = sweep_sources(self._sweep, [self._X_WB])
        if slopes is None:
            return None
        if isinstance(slopes, int):
            raise explain_contact_status(self._model, self._table)
        return self._table.pair[:1, :2].tolist(), filled(self._table.point.real, slopes)


def with_point(model: GeometryModel, num_bodies: int) -> GeometryModel:
    """The model with a point as last geometry, paired with all others, on a body of its own after `num_bodies`."""
    count = len(model.geometry)
    geometry = np.vstack([model.geometry, np.zeros((1, Geometry.SIZE), np.int64)])
    geometry[count, Geometry.kind], geometry[count, Geometry.body] = SPHERE, num_bodies
    return model._replace(
        geometry=geometry,
        size=np.vstack([model.size, np.zeros((1, Size.SIZE))]),
        material=np.vstack([model.material, np.zeros((1, Material.SIZE))]),
        X_BG=np.vstack([model.X_BG, pose_of_point(np.zeros(3))]),
        pair=np.array([(k, count) for k in range(count)], np.int64).reshape(-1, 2),
    )


def world_poses(num_bodies: int, dtype: DTypeLike) -> np.ndarray:
    """Poses of bodies that are where the world is, shape (num_bodies, 12)."""
    X_WB = np.full((num_bodies, BodyPose.SIZE), 0.0, dtype=dtype)
    X_WB[:, [0, 4, 8]] = 1.0
    return X_WB


def _slice_or_array(rows: list[int]) -> slice | np.ndarray:
    """Rows as an index of an array; those that follow one another as a slice, which costs a fifth."""
    if rows and rows == list(range(rows[0], rows[-1] + 1)):
        return slice(rows[0], rows[-1] + 1)
    return np.array(rows, np.int64)


def pose_of_point(p_WQ: np.ndarray) -> np.ndarray:
    """The pose of a body that is a point, shape (1, 12)."""
    return np.array([[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, *p_WQ]], p_WQ.dtype)
