"""The questions to a QueryObject about where frames and geometry are."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._kinds import instance_of
from sheldrake.common._overloads import overload, overloaded
from sheldrake.geometry._ids import FrameId, GeometryId, SourceId
from sheldrake.geometry._numbers import values_of
from sheldrake.geometry._query.scene import QueryScene, ShownPoses
from sheldrake.geometry._state.inspector import SceneGraphInspector
from sheldrake.geometry._state.records import WORLD_FRAME_ID, SourceRecord
from sheldrake.geometry._state.state import GeometryState

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from typing_extensions import Self

    from sheldrake.geometry._frame_pose_vector import FramePoseVector
    from sheldrake.geometry._scene_graph import SceneGraph
    from sheldrake.math import RigidTransform
    from sheldrake.systems.framework import Context
    from sheldrake.systems.framework._port import InputPort


_NOWHERE: tuple[Any, dict[FrameId, int]] = (None, {})


class Poses:
    """A part of QueryObject: the context it came from, and the poses that the sources publish there."""

    def __init__(self) -> None:
        self._scene_graph: SceneGraph | None = None
        self._context: Context | None = None
        self._ports: dict[Any, Any] = {}
        self._places: dict[SourceId, tuple[Any, Any, dict[FrameId, int]]] = {}
        """Of each source whose poses were all there: its frames, those that it gave numbers for, and their rows."""
        self._last_poses: Any = None
        """Of the last query: its scene, what it made them of, and poses of all bodies."""

    def _bind(self, scene_graph: SceneGraph | None, context: Context | None) -> None:
        self._scene_graph, self._context = scene_graph, context

    def _required(self) -> tuple[SceneGraph, Any]:
        if self._scene_graph is None:
            raise RuntimeError(
                "Attempting to perform query on invalid QueryObject. A QueryObject comes from evaluating "
                "SceneGraph.get_query_output_port()."
            )
        return self._scene_graph, self._context

    @property
    def _state(self) -> GeometryState:
        scene_graph, context = self._required()
        return scene_graph._geometry_state(context)

    def inspector(self) -> SceneGraphInspector:
        """An inspector of the geometry in the context."""
        return SceneGraphInspector._make(lambda: self._state)

    # ---- poses

    def _poses(self, frames: Iterable[FrameId]) -> dict[FrameId, RigidTransform]:
        """X_PF of frames, and maybe of others, from their sources' ports."""
        scene_graph, context = self._required()
        state = self._state
        poses: dict[FrameId, RigidTransform] = {}
        for source_id in {state.frame(frame).source for frame in frames}:
            source = state.sources[source_id]
            port = scene_graph.get_source_pose_port(source_id)
            if not port.HasValue(context):
                raise RuntimeError(
                    f"Source '{source.name}' (id: {source_id.get_value()}) has registered dynamic frames but is not "
                    "connected to the appropriate input port."
                )
            values = port.Eval(context)
            if self._are_complete(source_id, source, values):
                places, X = self._places[source_id][2], values._rows[1]
                for frame in frames:
                    k = places.get(frame)
                    if k is not None:
                        poses[frame] = _pose_of(X[k])
                continue
            if values.size() != len(source.frames):
                raise RuntimeError(
                    f"Disagreement in expected number of frames ({len(source.frames)}) and the given number of frames "
                    f"({values.size()})."
                )
            for frame in source.frames:
                if not values.has_id(frame):
                    raise RuntimeError(
                        f"Registered frame id ({frame.get_value()}) belonging to source {source_id.get_value()} was "
                        "not found in the provided kinematics data."
                    )
                poses[frame] = values._values[frame]
            if values._rows is not None:
                ids = values._rows[0]
                self._places[source_id] = source.frames, ids, {frame: k for k, frame in enumerate(ids)}
        return poses

    def _are_complete(self, source_id: SourceId, source: SourceRecord, values: FramePoseVector) -> bool:
        """Whether a source gives numbers for the very frames for which it was found to give all."""
        known = self._places.get(source_id)
        rows = values._rows
        return known is not None and rows is not None and known[0] is source.frames and known[1] is rows[0]

    def _world_poses(self, frames: Iterable[FrameId]) -> dict[FrameId, RigidTransform]:
        """X_WF of frames."""
        from sheldrake.math import RigidTransform

        state = self._state
        local = self._poses([frame for frame in frames if frame != WORLD_FRAME_ID])
        world: dict[FrameId, RigidTransform] = {WORLD_FRAME_ID: RigidTransform()}

        def pose(frame: FrameId) -> RigidTransform:
            if frame not in world:
                parent = state.frames[frame].parent
                if parent not in local and parent != WORLD_FRAME_ID:
                    local.update(self._poses([parent]))
                world[frame] = local[frame] if parent == WORLD_FRAME_ID else pose(parent) @ local[frame]
            return world[frame]

        return {frame: pose(frame) for frame in frames}

    def _pose_in_world(self, frame: FrameId, target: FrameId | GeometryId) -> RigidTransform:
        """X_WF of one frame, for the question where `target` is."""
        record = self._state.frames[frame]
        if frame != WORLD_FRAME_ID and record.parent == WORLD_FRAME_ID:
            view, row_of = self._shown_by(record.source)
            if frame in row_of:
                self._required()[1]._reads[target] = self._state.serial, None
                return _pose_of(view.X_WB()[row_of[frame]])
        return self._world_poses([frame])[frame]

    def _asked_pose(self, target: FrameId | GeometryId) -> RigidTransform | None:
        """X_WF or X_WG of what was asked for before, straight from the plant that shows it; None where none does."""
        scene_graph, context = self._scene_graph, self._context
        if scene_graph is None or context is None:
            self._required()  # raises
            return None
        known = context._reads.get(target)
        if known is None or context._store.frozen:
            return None
        serial = scene_graph._geometry_state(context).serial
        if known[0] != serial:
            return None
        if known[1] is None:  # to make the call takes as long as some twenty ways round
            known = context._reads[target] = serial, self._call_for_pose(target)
        return known[1]()

    def _call_for_pose(self, target: FrameId | GeometryId) -> Callable[[], RigidTransform]:
        """The call that gives X_WF or X_WG of what a plant shows."""
        state, X_FG = self._state, None
        if isinstance(target, GeometryId):
            record = state.geometries[target]
            target, X_FG = record.frame, record.X_FG
        view, row_of = self._shown_by(state.frames[target].source)
        return view.pose_of_row(row_of[target], X_FG)

    def _world_matrices(self, frames: list[FrameId], memo: dict) -> np.ndarray:
        """X_WF of many frames, shape (n, 3, 4); for who asks often.

        Args:
            frames: The frames.
            memo: What this keeps between calls for the same list, {} at first.
        """
        X_WF = np.empty((len(frames), 3, 4))
        scene_graph, context = self._required()
        if "sources" not in memo:
            memo["sources"] = self._numbers_of_sources(frames)
        others = memo["sources"].get(None, [])
        for source_id, mine in memo["sources"].items():
            if source_id is None:
                continue
            port = scene_graph.get_source_pose_port(source_id)
            rows = port.Eval(context)._rows if port.HasValue(context) else None
            if rows is None:
                others = [*others, *mine]
                continue
            ids, X = rows
            known, places = memo.get(source_id, (None, None))
            if known is not ids:
                at = {frame: k for k, frame in enumerate(ids)}
                if any(frames[k] not in at for k in mine):
                    others = [*others, *mine]  # the slower way says what is missing
                    continue
                places = np.array([at[frames[k]] for k in mine], dtype=np.int64)
                memo[source_id] = ids, places
            X_WF[mine, :, :3] = X[places, :9].reshape(-1, 3, 3)
            X_WF[mine, :, 3] = X[places, 9:12]
        if others:
            world = self._world_poses([frames[k] for k in others])
            for k in others:
                X_WF[k] = values_of(world[frames[k]].GetAsMatrix34())
        return X_WF

    def _published(self, memo: dict) -> tuple[Any, np.ndarray] | None:
        """Frames of the only source and the array of their poses, the same as long as they are; None without one."""
        sources = memo.get("sources")
        if sources is None or len(sources) != 1 or None in sources:
            return None
        _, context = self._required()
        port = self._port_of(next(iter(sources)))
        read = context._reads.get(port._index)
        if read is None and not port.HasValue(context):
            return None
        return port.Eval(context)._rows

    def _numbers_of_source(self, scene: QueryScene) -> ShownPoses | None:
        """Poses of a scene's bodies, straight from what the only source publishes poses of.

        None if there are several, or the source shows no such thing: then its port is asked.
        """
        source_id, rows = self._find_numbers(scene)
        view, _ = _NOWHERE if source_id is None else self._shown_by(source_id)
        if view is None or rows is None:
            return None
        return ShownPoses(view, rows, self._required()[1]._store.i)

    def _find_numbers(self, scene: QueryScene) -> tuple[SourceId | None, np.ndarray | None]:
        """The source whose numbers have the poses of a scene's bodies, and their rows; (None, None) if none has."""
        sources = self._numbers_of_sources(scene.moving)
        if len(sources) != 1 or None in sources:
            return None, None
        (source_id,) = sources
        _, row_of = self._shown_by(source_id)
        if not set(scene.moving) <= set(row_of):
            return None, None
        places = np.zeros(scene.num_bodies, np.int64)  # the world's, and nothing is on other bodies
        places[scene.bodies] = [row_of[frame] for frame in scene.moving]
        return source_id, places

    def _shown_by(self, source_id: SourceId) -> tuple[Any, dict[FrameId, int]]:
        """Whose `X_WB()` has the poses that a source publishes, and the rows of its frames there; or `_NOWHERE`."""
        _, context = self._required()
        store, reads = context._store, context._reads
        if store.uncached or store.frozen or store.unsettled:
            return _NOWHERE
        known = reads.get(source_id)
        if known is None:
            known = reads[source_id] = self._find_view(source_id)
        return known if known[0] is None or known[0].S is store.S else _NOWHERE

    def _find_view(self, source_id: SourceId) -> tuple[Any, dict[FrameId, int]]:
        _, context = self._required()
        port, store = self._port_of(source_id), context._store
        slot = port._slot(context) if port.HasValue(context) else None
        row = store.layout.rows[slot.row] if slot is not None and slot.row >= 0 else None
        numbers = getattr(getattr(getattr(row, "calc", None), "function", None), "numbers", None)
        found = numbers(store.systems[row.node], store.context(row.node)) if row and numbers else None
        if found is None:
            return _NOWHERE
        view, frames, rows = found
        return view, dict(zip(frames, rows.tolist()))

    def _port_of(self, source_id: SourceId) -> InputPort:
        """The port on which a source publishes its poses."""
        port = self._ports.get(source_id)
        if port is None:
            port = self._ports[source_id] = self._required()[0].get_source_pose_port(source_id)
        return port

    def _numbers_of_sources(self, frames: list[FrameId]) -> dict[Any, list[int]]:
        """Which of the frames belong to each source; under None those whose parent is not the world."""
        state = self._state
        found: dict[Any, list[int]] = {}
        for k, frame in enumerate(frames):
            in_world = frame != WORLD_FRAME_ID and state.frames[frame].parent == WORLD_FRAME_ID
            found.setdefault(state.frame(frame).source if in_world else None, []).append(k)
        return found

    def GetPoseInParent(self, frame_id: FrameId) -> RigidTransform:
        """Pose X_PF of a frame in its parent frame."""
        record = self._state.frame(frame_id)
        if frame_id == WORLD_FRAME_ID:
            from sheldrake.math import RigidTransform

            return RigidTransform()
        if record.parent == WORLD_FRAME_ID:
            return self.GetPoseInWorld(frame_id)
        return self._poses([frame_id])[frame_id]

    @overloaded(overload(frame_id=instance_of(FrameId)), overload(geometry_id=instance_of(GeometryId)))
    def GetPoseInWorld(self, target: FrameId | GeometryId) -> RigidTransform:
        """Pose of a frame or a geometry in W: `(frame_id)` or `(geometry_id)`.

        Raises:
            RuntimeError: the id is not registered, or its source has not published the pose.
        """
        if (X := self._asked_pose(target)) is not None:
            return X
        from sheldrake.math import RigidTransform  # later: it takes a third of the time of what was asked before

        if isinstance(target, FrameId):
            self._state.frame(target)
            return self._pose_in_world(target, target)
        record = self._state.geometry(target)
        if record.frame == WORLD_FRAME_ID:
            return RigidTransform(record.X_FG)
        X_WF = self._pose_in_world(record.frame, target)
        X_FG = record.X_FG if type(record.X_FG) is type(X_WF) else type(X_WF)(record.X_FG.GetAsMatrix34())
        return X_WF @ X_FG

    def __copy__(self) -> Self:
        """A copy keeps the geometry and the poses of this moment, whatever becomes of the context."""
        new = type(self)()
        if self._scene_graph is not None:
            scene_graph, context = self._required()
            kept = scene_graph.CreateDefaultContext()
            kept.SetTimeStateAndParametersFrom(context)
            scene_graph.FixInputPortsFrom(scene_graph, context, kept)
            new._bind(scene_graph, kept)
        return new

    def __deepcopy__(self, memo: dict) -> Self:
        return self.__copy__()


def _pose_of(X: np.ndarray) -> RigidTransform:
    """The pose of R row by row and p, shape (12,)."""
    from sheldrake.math import RigidTransform

    return RigidTransform._make(X[:9].reshape(3, 3).copy(), X[9:].copy())
