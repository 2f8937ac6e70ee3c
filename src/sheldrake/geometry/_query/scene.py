"""The proximity geometry that queries ask about, compiled, and the search for contacts that is kept between them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sheldrake.common.chain import Chain
from sheldrake.geometry._compiled.search import family_kernels
from sheldrake.geometry._ids import FrameId, GeometryId
from sheldrake.geometry._kernels import model as columns
from sheldrake.geometry._kernels.cells import make_cells
from sheldrake.geometry._kernels.contacts import place_geometries
from sheldrake.geometry._kernels.model import ContactTable, GeometryModel, contact_table
from sheldrake.geometry._state.records import WORLD_FRAME_ID
from sheldrake.geometry._state.state import GeometryState


class FoundPoints(NamedTuple):
    """Contacts as a table has them, no row more than there are."""

    pair: np.ndarray
    point: np.ndarray

    @classmethod
    def of(cls, table: ContactTable) -> FoundPoints:
        """A copy of the rows of a table."""
        n = int(table.count[0])
        return cls(table.pair[:n].copy(), table.point[:n].copy())


class QueryScene:
    """The proximity geometry of a state as arrays; every frame is a body of its own, the first is the world.

    Attributes:
        model: The geometry; two bodies touch at one point.
        ids: Which geometry a row of the model is.
        moving: The frames but the world that have geometry.
        bodies: Their bodies.
        memo: For `QueryObject._world_matrices()` of `moving`.
    """

    def __init__(self, state: GeometryState, model: GeometryModel, ids: list[GeometryId], frames: list[FrameId]):
        geometry = model.geometry.copy()
        geometry[:, columns.MULTI_POINT] = 0
        self.model, self.ids, self.num_bodies = model._replace(geometry=geometry), ids, len(frames)
        present = {state.geometries[i].frame for i in ids} - {WORLD_FRAME_ID}
        self.bodies = [body for body, frame in enumerate(frames) if frame in present]
        self.moving = [frames[body] for body in self.bodies]
        self.memo: dict = {}
        self._idle: list[_Search] = []

    def find_points(self, X_WB: np.ndarray) -> FoundPoints:
        """All pairs that overlap at poses that are numbers, shape (num_bodies, 12)."""
        try:
            search = self._idle.pop()  # a search is of one thread at a time
        except IndexError:
            search = _Search(self.model, self.num_bodies)
        try:
            return search.find(X_WB)
        finally:
            self._idle.append(search)


class _Search:
    """Bound kernels and their arrays: binding takes far longer than the search of a robot's surroundings."""

    def __init__(self, model: GeometryModel, num_bodies: int):
        self._X_WB = np.empty((num_bodies, 12))
        self._table = contact_table(model, capacity=max(1, model.pair.shape[0]))  # room for one point a pair
        self._run = Chain([place_geometries, *family_kernels(model)]).bind(
            geometry_model=model, X_WB=self._X_WB, table=self._table, cells=make_cells(model)
        )

    def find(self, X_WB: np.ndarray) -> FoundPoints:
        self._X_WB[:] = X_WB
        self._run()
        return FoundPoints.of(self._table)
