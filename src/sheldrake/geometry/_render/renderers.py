"""The render engines of a GeometryState, and which geometry they draw."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sheldrake.common._text import choices
from sheldrake.geometry._ids import FrameId, GeometryId
from sheldrake.geometry._roles import Role
from sheldrake.geometry._state.records import WORLD_FRAME_ID

from .engine import RenderEngine

if TYPE_CHECKING:
    from sheldrake.geometry._state.records import GeometryRecord
    from sheldrake.geometry._state.state import GeometryState


class Moving(NamedTuple):
    """Geometries whose poses change.

    Attributes:
        serial: Of the state.
        ids: The geometries.
        frames: Their frames, each once.
        frame_of: Which of the frames each geometry has.
        X_FG: Poses of the geometries in their frames, shape (n, 3, 4).
        memo: For `QueryObject._world_matrices()` of the frames.
    """

    serial: int
    ids: list[GeometryId]
    frames: list[FrameId]
    frame_of: np.ndarray
    X_FG: np.ndarray
    memo: dict


class Renderers:
    """Render engines by name.

    An engine knows poses and viewpoint, so that states cannot share one; but copies of states are many and pictures
    are few. A copy borrows the engines, and each of the two clones one when it first changes or uses it.
    """

    def __init__(self) -> None:
        self._engines: dict[str, RenderEngine] = {}
        self._borrowed: set[str] = set()
        self._moving: dict[str, Moving] = {}

    def copy(self) -> Renderers:
        """An independent copy."""
        new = Renderers()
        new._engines = dict(self._engines)
        new._borrowed = set(self._engines)
        self._borrowed = set(self._engines)
        return new

    def names(self) -> list[str]:
        """Names of the engines, sorted."""
        return sorted(self._engines)

    def find(self, name: str) -> RenderEngine | None:
        """The engine of a name, to look at only."""
        return self._engines.get(name)

    def use(self, name: str) -> RenderEngine:
        """The engine of a name, to change.

        Raises:
            RuntimeError: there is none.
        """
        if name not in self._engines:
            raise RuntimeError(f"No renderer exists with name: '{name}'; there are: {choices(self._engines)}.")
        if name in self._borrowed:
            self._engines[name] = self._engines[name].Clone()
            self._borrowed.discard(name)
        return self._engines[name]

    def moving(self, name: str, state: GeometryState) -> Moving:
        """What moves of the geometry that an engine draws, in a state; kept until the state changes."""
        if name not in self._moving or self._moving[name].serial != state.serial:
            ids = self._engines[name]._moving()
            records = [state.geometries[i] for i in ids]
            frames = sorted({record.frame for record in records})
            self._moving[name] = Moving(
                serial=state.serial,
                ids=ids,
                frames=frames,
                frame_of=np.array([frames.index(record.frame) for record in records], np.int64),
                X_FG=np.array([record.X_FG.GetAsMatrix34() for record in records]),
                memo={},
            )
        return self._moving[name]

    def add(self, name: str, engine: RenderEngine, geometries: Mapping[GeometryId, GeometryRecord]) -> None:
        """Adds a clone of an engine, which is told of the geometries with the perception role.

        Raises:
            RuntimeError: the name is taken, or the engine refuses a geometry.
        """
        if name in self._engines:
            raise RuntimeError(f"AddRenderer(): A renderer with the name '{name}' already exists")
        mine = engine.Clone()
        for geometry_id, record in sorted(geometries.items()):
            _register(name, mine, geometry_id, record)
        self._engines[name] = mine

    def remove(self, name: str) -> None:
        """Removes an engine.

        Raises:
            RuntimeError: there is none of the name.
        """
        if name not in self._engines:
            raise RuntimeError(f"RemoveRenderer(): A renderer with the name '{name}' does not exist")
        del self._engines[name]
        self._borrowed.discard(name)

    def register(self, geometry_id: GeometryId, record: GeometryRecord) -> None:
        """Tells all engines of a geometry that is new, or has changed."""
        self.forget(geometry_id)
        if Role.kPerception in record.roles:
            for name in self._engines:
                _register(name, self.use(name), geometry_id, record)

    def forget(self, geometry_id: GeometryId) -> None:
        """Tells all engines of a geometry that has gone."""
        for name, engine in list(self._engines.items()):
            if engine.has_geometry(geometry_id):
                self.use(name).RemoveGeometry(geometry_id)


def _register(name: str, engine: RenderEngine, geometry_id: GeometryId, record: GeometryRecord) -> None:
    properties: Any = record.roles.get(Role.kPerception)
    if properties is None:
        return
    accepting = properties.GetPropertyOrDefault("renderer", "accepting", None)
    if accepting and name not in accepting:
        return
    moves = record.frame != WORLD_FRAME_ID
    engine.RegisterVisual(geometry_id, record.shape.Clone(), properties, record.X_FG, needs_updates=moves)
