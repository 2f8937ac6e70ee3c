"""Collision checks of many configurations as machine code, which threads share."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._thread_team import ThreadTeam
from sheldrake.common.chain import Chain, bound_to_all_memory
from sheldrake.geometry import FrameId
from sheldrake.geometry._compiled.search import family_kernels
from sheldrake.geometry._kernels.contacts import place_geometries
from sheldrake.geometry._kernels.model import BodyPoses, contact_table
from sheldrake.geometry._kernels.pair_distance import find_distances
from sheldrake.geometry._kernels.spatial_hash import make_cells
from sheldrake.geometry._query.scene import explain_contact_status, world_poses
from sheldrake.geometry._state.records import WORLD_FRAME_ID
from sheldrake.multibody.plant._parts import parts_of
from sheldrake.multibody.tree._kernels.kinematics import position_kinematics
from sheldrake.multibody.tree._kernels.model import make_work
from sheldrake.planning._kernels.checks import first_collisions

if TYPE_CHECKING:
    from sheldrake.geometry._query.scene import QueryScene
    from sheldrake.geometry._state.state import GeometryState
    from sheldrake.multibody.plant import MultibodyPlant
    from sheldrake.multibody.plant._context.view import View

_PARTS = 8
"""That each thread takes, so that the last one does not let the others wait."""


class NativeChecks:
    """Finds the first collision on ways of configurations, as the queries of a context would, without Python.

    Args:
        scene: The geometry, compiled for queries.
        plant: The plant.
        view: What it keeps for the context, whose parameters count.
        bodies: Of each geometry of the scene: its body of the plant.
    """

    def __init__(self, scene: QueryScene, plant: MultibodyPlant, view: View, bodies: list[int]):
        self.scene, self.view = scene, view
        self._bodies = np.array(bodies, np.int64)
        rows = parts_of(plant).kernel_models.rows_of_frames()
        self._places = np.array([(b, rows[f]) for b, f in zip(scene.bodies, scene.moving)], np.int64).reshape(-1, 2)
        self._idle: list[_OneWay] = []

    @staticmethod
    def can(scene: QueryScene, state: GeometryState, plant: MultibodyPlant, view: View) -> bool:
        """Whether kernels know all there is: the plant places all frames in the world, and pairs are listed."""
        rows: dict[FrameId, int] = parts_of(plant).kernel_models.rows_of_frames()
        of_plant = all(f in rows and state.frames[f].parent == WORLD_FRAME_ID for f in scene.moving)
        return view.native and of_plant and not len(scene.model.cell)

    def first_collisions(
        self, ways: list[np.ndarray], filtered: np.ndarray, padding: np.ndarray, threads: int
    ) -> np.ndarray:
        """Of each way, the number of its first configuration that collides; how many it has, if none does.

        Args:
            ways: Configurations, rows.
            filtered: Of each pair of bodies, 0 where it counts.
            padding: Likewise, the distance to be kept [m].
            threads: How many may work.

        Raises:
            RuntimeError: a search did not end well.
        """
        begin, found = np.cumsum([0, *map(len, ways)], dtype=np.int64), np.zeros(len(ways), np.int64)
        reach = max(0.0, float(padding.max())) if padding.any() else None
        configurations = np.ascontiguousarray(np.concatenate(ways), float)
        kept = padding if padding.any() else np.full(padding.shape, np.inf)
        given = np.ascontiguousarray(filtered, np.int64), np.ascontiguousarray(kept), begin, found
        team = ThreadTeam(min(threads, len(ways)))
        size = -(-len(ways) // (_PARTS * team.num_threads))
        calls: dict[int, Any] = {}

        def work(thread: int, part: int) -> None:
            if thread not in calls:
                calls[thread] = self._bind(reach, configurations, *given)
            call, values = calls[thread]
            call.set("first", part * size)
            call.set("last", min((part + 1) * size, len(ways)))
            if call():
                raise explain_contact_status(self.scene.model, values["table"])

        team.run(work, -(-len(ways) // size))
        return found

    def first_collision(self, way: np.ndarray, filtered: np.ndarray, padding: np.ndarray) -> int:
        """The same of one way: quick, as memory and call are kept for the next one."""
        reach = max(0.0, float(padding.max())) if padding.any() else None
        try:
            one = self._idle.pop()  # a way is of one thread at a time
        except IndexError:
            one = None
        if one is None or one.reach != reach or one.room < len(way):
            one = _OneWay(reach, max(64, 2 * len(way)), self, filtered.shape)
        try:
            return one.first_collision(way, filtered, padding)
        finally:
            self._idle.append(one)

    def _bind(self, reach: float | None, configurations: np.ndarray, *given: np.ndarray) -> tuple[Any, Any]:
        """A call with memory of its own, and what it does not keep of that."""
        tree, scene, model = self.view.model, self.scene, self.scene.model
        q, work = np.zeros(self.view.nq), make_work(tree, float)
        placed, table = world_poses(scene.num_bodies, float), contact_table(model, max(1, len(model.pair)))
        search = [place_geometries, *family_kernels(model)] if reach is None else [find_distances]
        values = {
            "model": tree, "p": self.view.p.copy(), "work": work, "q": q, "geometry_model": model, "table": table,
            "bodies": BodyPoses(placed), "cells": make_cells(model), "reach": reach,
        }  # fmt: skip
        rows = Chain([position_kinematics, *search]).table(**values)
        poses = work.X_WB, self._places, placed, table, self._bodies
        return bound_to_all_memory(first_collisions, *rows, configurations, q, *poses, *given, 0, 0), values


class _OneWay:
    """Memory for the configurations of a way, and a call bound to it."""

    def __init__(self, reach: float | None, room: int, checks: NativeChecks, bodies: tuple[int, ...]):
        self.reach, self.room, self._checks = reach, room, checks
        self._configurations = np.zeros((room, checks.view.nq))
        self._filtered, self._padding = np.zeros(bodies, np.int64), np.full(bodies, np.inf)
        self._begin, self._found = np.zeros(2, np.int64), np.zeros(1, np.int64)
        given = self._filtered, self._padding, self._begin, self._found
        self._call, self._values = checks._bind(reach, self._configurations, *given)
        self._call.set("last", 1)

    def first_collision(self, way: np.ndarray, filtered: np.ndarray, padding: np.ndarray) -> int:
        self._configurations[: len(way)] = way
        self._filtered[:], self._begin[1] = filtered, len(way)
        if self.reach is not None:
            self._padding[:] = padding
        self._values["p"][:] = self._checks.view.p
        if self._call():
            raise explain_contact_status(self._checks.scene.model, self._values["table"])
        return int(self._found[0])
