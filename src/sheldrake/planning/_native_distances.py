"""Distances of a plant's geometry and their derivatives as machine code."""

from __future__ import annotations

import operator
from typing import Any

import numpy as np

from sheldrake.common.chain import Chain
from sheldrake.geometry._kernels.model import BodyPoses, ContactPoint, Found, contact_table
from sheldrake.geometry._kernels.pair_distance import find_distances
from sheldrake.geometry._query.query_object import explain_contact_status
from sheldrake.geometry._query.scene import world_poses
from sheldrake.multibody.plant import MultibodyPlant
from sheldrake.multibody.plant._parts import parts_of
from sheldrake.multibody.tree._kernels.kinematics import position_kinematics
from sheldrake.multibody.tree._kernels.model import make_work
from sheldrake.planning._kernels.distances import distance_slopes, place_bodies
from sheldrake.planning._native_checks import NativeChecks

_DEPTH = operator.index(ContactPoint.depth)


class NativeDistances:
    """Distances of all pairs of geometries that may touch, as the queries of a context would find them.

    Args:
        plant: The plant, of floats.
        context: Its context, whose parameters count.
        view: What the plant keeps for it.
        query: What the context is asked about geometry.
        reach: Pairs farther from each other do not count [m].
    """

    @staticmethod
    def of(plant: MultibodyPlant, context: Any, reach: float) -> NativeDistances | None:
        """Those of a context as it is now; None where others than kernels would have to be asked."""
        port, view = plant.get_geometry_query_input_port(), parts_of(plant).contexts.view(context)
        query = port.Eval(context)
        scene = query._scene()
        slot = context._store.layout.input_slot(context._node, int(port.get_index()))
        known = slot.free < 0 and NativeChecks.can(scene, query._state, plant, view)
        return NativeDistances(plant, context, view, query, reach) if known else None

    def __init__(self, plant: MultibodyPlant, context: Any, view: Any, query: Any, reach: float):
        self._contexts, self._context, self._layout = parts_of(plant).contexts, context, context._store.layout
        self._dynamics = parts_of(plant).dynamics
        self._query, self._scene, self._view = query, query._scene(), view
        scene = self._scene
        rows, inspector = parts_of(plant).kernel_models.rows_of_frames(), query.inspector()
        body = np.array([rows.get(inspector.GetFrameId(g), 0) for g in scene.ids], np.int64)
        places = np.array([(b, rows[f]) for b, f in zip(scene.bodies, scene.moving)], np.int64).reshape(-1, 2)
        tree, pairs = view.model, max(1, len(scene.model.pair))
        placed, work = world_poses(scene.num_bodies, float), make_work(tree, float)
        self._q, self._p, self._slopes = np.zeros(view.nq), view.p.copy(), np.zeros((pairs, view.nv))
        self._table = contact_table(scene.model, pairs)
        values = {
            "model": tree, "p": self._p, "work": work, "q": self._q, "poses": work.X_WB, "places": places,
            "placed": placed, "geometry_model": scene.model, "bodies": BodyPoses(placed), "reach": float(reach),
            "table": self._table, "body": body, "slopes": self._slopes,
        }  # fmt: skip
        self._search = Chain([position_kinematics, place_bodies, find_distances]).bind(**values)
        self._differentiate = Chain([distance_slopes]).bind(**values)

    def is_current(self) -> bool:
        """Whether geometry and memory of the context are still those."""
        context = self._context
        is_same = context._store.layout is self._layout and self._contexts.view(context) is self._view
        return is_same and self._query._scene() is self._scene

    def distances(self, q: np.ndarray) -> np.ndarray:
        """Signed distances at positions q of the pairs within reach [m], shape (pairs,).

        Raises:
            RuntimeError: the search did not end well.
        """
        self._q[:], self._p[:] = q, self._view.p
        if self._search():
            raise explain_contact_status(self._scene.model, self._table)
        return -self._table.point[: self._table.count[Found.num_contacts], _DEPTH]

    def slopes(self) -> np.ndarray:
        """Derivatives by q of the distances found last, shape (pairs, nq); the context is at these positions."""
        self._differentiate()
        slopes = self._slopes[: self._table.count[Found.num_contacts]]
        return slopes.copy() if self._view.frozen.v_is_qdot else slopes @ self._dynamics.qdot_to_velocity(self._context)
