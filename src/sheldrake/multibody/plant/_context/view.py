"""One context of a plant as arrays, with the queries on them."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from types import MethodType
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.autodiffutils import AutoDiffXd
from sheldrake.common import quick
from sheldrake.common.calls import Memory, Query
from sheldrake.common.kernel import Kernel
from sheldrake.math import RigidTransform
from sheldrake.multibody.math._kernels.spatial import inertia_of_ten
from sheldrake.multibody.math._spatial_inertia import SPATIAL_INERTIA
from sheldrake.multibody.plant._building.frozen_model import FrozenModel
from sheldrake.multibody.plant._context.queries import (
    INERTIAS,
    MOST_PLACES,
    POSES,
    VELOCITIES,
    Queries,
    can_be_of_all,
    queries_of_all,
    queries_of_one,
    state_of,
    work_in,
)
from sheldrake.multibody.tree._kernels import queries
from sheldrake.systems.framework import Context
from sheldrake.systems.framework._engine.store import state_source

if TYPE_CHECKING:
    from sheldrake.common._types import KernelArgument
    from sheldrake.multibody.math import SpatialInertia

_KEPT = frozenset(
    "places transforms poses writers twists velocities_of distances forms _buffers _types _inertias".split()
)
"""Tables of what is kept by a key, which a view has when something is kept."""


class View:
    """One context of a plant as arrays: views of its memory, and all `Queries` on it, by their names.

    Stages (poses, inertias, velocities, velocities of the body origins) are computed when a query needs them and kept
    until a source of the plant's state or parameters is written.

    Attributes:
        queries: What is asked; maybe of all contexts alike.
        results: The stamp of a state, the scratch of a step from it or of its derivatives, and the status they ended
            with.
        accelerations: Results of a state, and the accelerations of the body origins that follow from them.
        rehearsal: Scratch and bound kernels that results of the present state come from, once they were asked for.
        contact_room: What point contacts are put together in, once they were asked for.
        reactions: What reaction forces are computed in, once they were asked for.
        applied_force: What applied spatial forces amount to, in the scratch of the step, once they were asked for.
    """

    POSES = POSES
    results: tuple[int, Any, int] | None = None
    accelerations: tuple[Any, np.ndarray] | None = None
    rehearsal: Any = None
    contact_room: Any = None
    reactions: Any = None
    applied_force: tuple[np.ndarray, ...] | None = None
    _in_step: tuple[Any, Query] | None = None
    """The tree of a step, and the query of accelerations there, once they were asked for."""
    _applied: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, Query] | None = None

    def __init__(self, frozen: FrozenModel, family: object, context: Context):
        """
        Args:
            frozen: The model of the plant.
            family: Which plants may use the view.
            context: What is viewed.
        """
        store, n = context._store, context._node
        layout, S, nq, nv = store.layout, store.S, frozen.nq, frozen.nv
        place, (state, self.level) = layout.places[n], state_of(store, n)
        self.frozen, self.family, self.S, self.T = frozen, family, S, context._system._scalar
        self.nq, self.nv, self.nb = nq, nv, len(frozen.row_bodies)
        self.x = x = S[state]
        self.q, self.v, self.p = x[:nq], x[nq : nq + nv], S[place.p[0] : place.p[1]]
        self.source, self.model, self.native = state_source(place, n), frozen.tree, store.native
        self._memory: Memory | None = None
        if can_be_of_all(store):
            known: Queries | None = layout.queried.get(n)
            if known is None:
                known = layout.queried[n] = queries_of_all(store, n, frozen)
            room = store.rooms.get(n)
            if room is None:
                room = store.rooms[n] = np.zeros(known.calls.like.room.shape, np.int64)
            self.queries, self._memory = known, Memory(S, store.I, room, frozen.addresses)
        else:
            self.queries = queries_of_one(store, n, frozen, self.T)
        self._bound: dict[Any, Any] = {}

    def __getattr__(self, name: str) -> Any:
        """A query of this name, of this context, or room for what queries are kept by."""
        made = self.__dict__[name] = {} if name in _KEPT else self.bind(getattr(self.queries, name))
        return made

    def bind(self, ask: Query) -> Query:
        """One of `queries`, or a query that was made by `queries.calls`, for this context."""
        return ask if self._memory is None else MethodType(ask, self._memory)

    def keep(self, kept: dict[Any, Any], key: object, ask: Query) -> Query:
        """The same, kept by a key; `places`, `transforms`, `poses` and so on are for that."""
        if len(kept) >= MOST_PLACES:
            kept.clear()
        bound = kept[key] = self.bind(ask)
        return bound

    # --- arrays

    def zeros(self, *shape: int) -> np.ndarray:
        """An array of zeros of the context's scalar type."""
        return self.queries.zeros(*shape)

    def buffer(self, name: str, *shape: int) -> np.ndarray:
        """An array that is always the same for this view, for kernels to read or fill."""
        array = self._buffers.get(name)
        if array is None:
            array = self._buffers[name] = self.zeros(*shape)
        return array

    def copy_of(self, work: Any) -> Any:
        """A workspace like `work`, of the context's scalar type."""
        if isinstance(work, np.ndarray):
            return work.copy() if work.dtype == np.int64 else work.astype(self.S.dtype)
        return type(work)(*(self.copy_of(part) for part in work))

    def integers(self, name: str, size: int) -> np.ndarray:
        """The same for integers."""
        array = self._buffers.get(name)
        if array is None:
            array = self._buffers[name] = np.zeros(size, np.int64)
        return array

    def of(self, family: Any) -> Any:
        """The class of a family for the context's scalar type."""
        cls = self._types.get(family)
        if cls is None:
            cls = self._types[family] = family[self.T]
        return cls

    @cached_property
    def work(self) -> Any:
        """What stages leave."""
        return self.queries.work if self._memory is None else work_in(self._memory.room, self.frozen)[0]

    # --- kernels

    def call(self, kernel: Kernel, *args: KernelArgument) -> int:
        """Runs a kernel on arrays that are new at each call."""
        return (kernel.native if self.native else kernel)(*args) or 0

    def query(
        self, kernel: Kernel, *args: KernelArgument, given: tuple[str, ...] = (), needs: int = 0, answer: np.ndarray
    ) -> Query:
        """As `Calls.query`, on arrays that are always the same for this view, or those of `queries`; made once."""
        ask = self._bound.get(kernel)
        if ask is None:
            made = self.queries.calls.query(kernel, *args, given=given, needs=needs, answer=answer)
            ask = self._bound[kernel] = self.bind(made)
        return ask

    # --- stages

    def X_WB(self) -> np.ndarray:
        """Poses of the bodies by row, to be read only."""
        if self.T is AutoDiffXd:
            return self.queries.calls.results(POSES, self.work).X_WB
        self.ask_poses()
        return self.work.X_WB

    def positions(self) -> Any:
        """The workspace with `X_WB`, `S` and `inertia`; for duals what it would hold, to be read only."""
        if self.T is AutoDiffXd:
            return self.queries.calls.results(POSES | INERTIAS, self.work)
        self.ask_positions()
        return self.work

    def velocities(self) -> Any:
        """The workspace with `V` and `A` too; for duals what it would hold, to be read only."""
        if self.T is AutoDiffXd:
            return self.queries.calls.results(POSES | INERTIAS | VELOCITIES, self.work)
        self.ask_velocities()
        return self.work

    # --- queries that are of this context alone

    def accelerations_in(self, work: Any, vdot: np.ndarray) -> np.ndarray:
        """`ask_accelerations` where `work`, the tree of a step, holds the kinematics; a view remembers one such."""
        if self._in_step is None or self._in_step[0] is not work:
            A = self.zeros(self.nb, 6)
            arguments = self.model, work, self.zeros(self.nv), A
            ask = self.queries.calls.query(queries.calc_accelerations, *arguments, given=("vdot",), answer=A)
            self._in_step = work, self.bind(ask)
        return self._in_step[1](vdot)

    def applied_forces(self, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, Query]:
        """Room for `count` applied forces, and a query for the generalized forces of those in it.

        Returns:
            Rows of the bodies, the last item the number of forces; points p_BoBq_B; forces F_Bq_W; what the query
            fills with forces by body about `root`; the query.
        """
        found = self._applied
        if found is None or len(found[1]) < count:
            room = max(4, 2 * count)
            rows, points, forces = np.zeros(room + 1, np.int64), np.zeros((room, 3)), np.zeros((room, 6))
            F, tau, asked = self.zeros(self.nb, 6), self.zeros(self.nv), self.queries
            arguments = asked.model, asked.work, rows, points, forces, F, tau
            ask = asked.calls.query(queries.calc_applied_forces, *arguments, needs=POSES, answer=tau)
            found = self._applied = rows, points, forces, F, self.bind(ask)
        return found

    def inertia_of_body(self, group: int) -> Callable[[], SpatialInertia] | None:
        """A query for the spatial inertia that a group of parameters says, of floats; None where there is none."""
        if group not in self._inertias:
            ten = self.p[self.frozen.parameters.of(group)]
            can = self.T is float and self.native
            query = quick.query(inertia_of_ten, ten, takes=(), gives=SPATIAL_INERTIA) if can else None
            self._inertias[group] = query
        return self._inertias[group]

    def pose_of_row(self, row: int, X_BG: RigidTransform | None = None) -> Callable[[], RigidTransform]:
        """A query for the pose of the body of a row, or of what is fixed to it."""
        return self.bind(self.queries.body_pose(row) if X_BG is None else self.queries.pose_of(row, X_BG))
