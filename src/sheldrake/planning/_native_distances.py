"""Distances of a plant's geometry and their derivatives as machine code."""

from __future__ import annotations

import operator
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common.chain import Chain
from sheldrake.geometry._kernels.model import HALF_SPACE, BodyPoses, ContactPoint, Found, Geometry, contact_table
from sheldrake.geometry._kernels.pair_distance import find_distances
from sheldrake.geometry._query.query_object import explain_contact_status
from sheldrake.geometry._query.scene import world_poses
from sheldrake.multibody.plant import MultibodyPlant
from sheldrake.multibody.plant._parts import parts_of
from sheldrake.multibody.tree._kernels.kinematics import position_kinematics
from sheldrake.multibody.tree._kernels.model import make_work
from sheldrake.planning._kernels.distances import Bound, distance_slopes, place_bodies, smooth_bound
from sheldrake.planning._native_checks import NativeChecks

if TYPE_CHECKING:
    from sheldrake.geometry import GeometryId, QueryObject
    from sheldrake.multibody.plant._context.view import View

_DEPTH = operator.index(ContactPoint.depth)


class Search:
    """Memory and kernels that find the distances of all pairs of geometries that may touch, or of any one pair.

    Args:
        plant: The plant, of floats.
        view: What it keeps for a context, of which nothing is kept here.
        query: What the context is asked about geometry.
        of_one: Whether distances are those of one pair, `pair`.
    """

    def __init__(self, plant: MultibodyPlant, view: View, query: QueryObject, of_one: bool):
        scene = self.scene = query._scene()
        model = scene.model._replace(pair=np.zeros((1, 2), np.int64)) if of_one else scene.model
        self.pair = model.pair
        rows, inspector = parts_of(plant).kernel_models.rows_of_frames(), query.inspector()
        body = np.array([rows.get(inspector.GetFrameId(g), 0) for g in scene.ids], np.int64)
        places = np.array([(b, rows[f]) for b, f in zip(scene.bodies, scene.moving)], np.int64).reshape(-1, 2)
        tree, pairs = view.model, max(1, len(model.pair))
        placed, work = world_poses(scene.num_bodies, float), make_work(tree, float)
        self.q, self.p, self.slopes = np.zeros(view.nq), view.p.copy(), np.zeros((pairs, view.nv))
        self.table, self.least = contact_table(model, pairs), np.zeros(Bound.SIZE)
        self.value = np.zeros(1 + view.nv)
        values = {
            "model": tree, "p": self.p, "work": work, "q": self.q, "poses": work.X_WB, "places": places,
            "placed": placed, "table": self.table, "body": body, "slopes": self.slopes,
        }  # fmt: skip
        self.place = Chain([position_kinematics, place_bodies]).bind(**values)
        self.find = find_distances.bind(model, BodyPoses(placed), 0.0, self.table)
        self.differentiate = Chain([distance_slopes]).bind(**values)
        self.bound = smooth_bound.bind(self.table, self.slopes, self.least, np.zeros((pairs, 2)), self.value, 0)


class NativeDistances:
    """Distances of all pairs of geometries that may touch, or of one pair, as the queries of a context find them.

    Args:
        plant: The plant, of floats.
        context: Its context, whose parameters count.
        view: What the plant keeps for it.
        query: What the context is asked about geometry.
        rows: Of the only two geometries that matter, in the scene; None for all that may touch.
    """

    @staticmethod
    def of(plant: MultibodyPlant, context: Any, pair: Sequence[GeometryId] | None = None) -> NativeDistances | None:
        """Those of a context as it is now, or of a pair; None where others than kernels would have to be asked."""
        port, view = plant.get_geometry_query_input_port(), parts_of(plant).contexts.view(context)
        query = port.Eval(context)
        scene = query._scene()
        slot = context._store.layout.input_slot(context._node, int(port.get_index()))
        known = slot.free < 0 and NativeChecks.can(scene, query._state, plant, view)
        rows = None if pair is None else [scene.row_of.get(geometry, -1) for geometry in pair]
        if rows is not None and (min(rows) < 0 or all(scene.model.geometry[rows, Geometry.kind] == HALF_SPACE)):
            return None  # queries say what is wrong
        return NativeDistances(plant, context, view, query, rows) if known else None

    def __init__(
        self, plant: MultibodyPlant, context: Any, view: View, query: QueryObject, rows: list[int] | None = None
    ):
        self._contexts, self._context, self._layout = parts_of(plant).contexts, context, context._store.layout
        self._dynamics = parts_of(plant).dynamics
        self._query, self._view, self._rows, of_one = query, view, rows, rows is not None
        kept = view.distances.get(of_one)
        if kept is None or kept.scene is not query._scene():
            kept = view.distances[of_one] = Search(plant, view, query, of_one)
        kept.table.remembered[...] = 0
        self._search: Search = kept

    def is_current(self) -> bool:
        """Whether geometry and memory of the context are still those."""
        context = self._context
        is_same = context._store.layout is self._layout and self._contexts.view(context) is self._view
        return is_same and self._query._scene() is self._search.scene

    def _find(self, reach: float, q: np.ndarray) -> None:
        search = self._search
        search.q[:], search.p[:] = q, self._view.p
        if self._rows is not None:
            search.pair[0] = self._rows
        search.place()
        search.find.set("reach", float(reach))
        if search.find():
            raise explain_contact_status(search.scene.model, search.table)

    def distances(self, reach: float, q: np.ndarray) -> np.ndarray:
        """Signed distances at positions q of the pairs no farther apart than `reach` [m], shape (pairs,).

        Raises:
            RuntimeError: the search did not end well.
        """
        self._find(reach, q)
        table = self._search.table
        return -table.point[: table.count[Found.num_contacts], _DEPTH]

    def pairs(self) -> tuple[np.ndarray, np.ndarray]:
        """Numbers in the scene of the geometries whose distances were found last, shape (pairs, 2); their order."""
        table = self._search.table
        pair = table.pair[: table.count[Found.num_contacts], :2]
        return pair, np.lexsort((pair[:, 1], pair[:, 0]))

    def ids(self) -> list[GeometryId]:
        """Which geometry a number of `pairs` is; the same list as long as the geometry is."""
        return self._search.scene.ids

    def slopes(self) -> np.ndarray:
        """Derivatives by q of the distances found last, shape (pairs, nq); the context is at these positions."""
        search = self._search
        search.differentiate()
        return self._by_q(search.slopes[: search.table.count[Found.num_contacts]])

    def _by_q(self, by_v: np.ndarray) -> np.ndarray:
        return by_v.copy() if self._view.frozen.v_is_qdot else by_v @ self._dynamics.qdot_to_velocity(self._context)

    def bound(self, reach: float, q: np.ndarray, least: np.ndarray, with_slope: bool) -> tuple[float, np.ndarray]:
        """Penalties of all distances as one number, and its derivatives by q, shape (nq,), if they are wanted.

        Args:
            reach: Pairs farther from each other do not count [m].
            q: Positions, which the context is at.
            least: What is bounded, a `Bound`.
            with_slope: Whether derivatives are wanted.

        Raises:
            RuntimeError: the search did not end well.
        """
        self._find(reach, q)
        search = self._search
        if with_slope:
            search.differentiate()
        search.least[:] = least
        search.bound.set("with_slope", with_slope)
        search.bound()
        return search.value.item(0), self._by_q(search.value[1:]) if with_slope else search.value[:0]
