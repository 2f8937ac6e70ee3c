"""Questions about geometry at the poses of a context."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common.value import _register_value_type

from ._ids import FrameId, GeometryId
from ._inspector import SceneGraphInspector
from ._kernels import model as columns
from ._kernels.contacts import find_all_contacts
from ._kernels.model import ContactTable, GeometryModel, contact_table
from ._query_results import PenetrationAsPointPair
from ._roles import Role
from ._state import WORLD_FRAME_ID, GeometryState

if TYPE_CHECKING:
    from sheldrake.math import RigidTransform

    from ._scene_graph import SceneGraph


class QueryObject:
    """Answers where geometry is and what touches what, at the present poses of the context it came from."""

    def __init__(self) -> None:
        self._scene_graph: SceneGraph | None = None
        self._context: Any = None

    def _bind(self, scene_graph: SceneGraph | None, context: Any) -> None:
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

    def _poses(self, frames: Any) -> dict[FrameId, RigidTransform]:
        """X_PF of frames from their sources' ports."""
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
        return poses

    def _world_poses(self, frames: Any) -> dict[FrameId, RigidTransform]:
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

    def GetPoseInParent(self, frame_id: FrameId) -> RigidTransform:
        """Pose X_PF of a frame in its parent frame."""
        from sheldrake.math import RigidTransform

        self._state.frame(frame_id)
        if frame_id == WORLD_FRAME_ID:
            return RigidTransform()
        return self._poses([frame_id])[frame_id]

    def GetPoseInWorld(self, *args: Any, **kwargs: Any) -> RigidTransform:
        """Pose of a frame or a geometry in W: `(frame_id)` or `(geometry_id)`.

        Raises:
            RuntimeError: the id is not registered, or its source has not published the pose.
        """
        (target,) = (*args, *kwargs.values())
        if isinstance(target, FrameId):
            self._state.frame(target)
            return self._world_poses([target])[target]
        record = self._state.geometry(target)
        return self._world_poses([record.frame])[record.frame] @ record.X_FG

    # ---- proximity

    def _placed(self, single: bool = True) -> tuple[GeometryModel, list[GeometryId], np.ndarray]:
        """The proximity geometry as arrays, its ids, and X_WB of the frames that have some."""
        scene_graph, _ = self._required()
        state = self._state
        model, ids, frames = scene_graph._compile_for_queries(state)
        if single:
            geometry = model.geometry.copy()
            geometry[:, columns.MULTI_POINT] = 0
            model = model._replace(geometry=geometry)
        X_WB = np.zeros((len(frames), 12))
        X_WB[:, [0, 4, 8]] = 1.0
        used = {state.geometries[i].frame for i in ids}
        for frame, X_WF in self._world_poses(used).items():
            body = frames.index(frame)
            X_WB[body, :9] = X_WF.rotation().matrix().ravel()
            X_WB[body, 9:] = X_WF.translation()
        return model, ids, X_WB

    def _contacts(self) -> tuple[ContactTable, list[GeometryId]]:
        model, ids, X_WB = self._placed()
        table = contact_table(model, capacity=max(1, model.pair.shape[0]))
        if find_all_contacts.native(model, X_WB, table):
            raise explain_contact_status(model, table)
        return table, ids

    def ComputePointPairPenetration(self) -> list[PenetrationAsPointPair]:
        """One pair of points for every pair of geometries that overlap, sorted by ids."""
        table, ids = self._contacts()
        found = []
        for (a, b, _, _), row in zip(table.pair[: table.count[0]], table.point):
            found.append(
                PenetrationAsPointPair(
                    id_A=ids[a],
                    id_B=ids[b],
                    p_WCa=row[0:3].copy(),
                    p_WCb=row[3:6].copy(),
                    nhat_BA_W=row[6:9].copy(),
                    depth=float(row[9]),
                )
            )
        return found

    def HasCollisions(self) -> bool:
        """True if any two geometries that may touch overlap."""
        table, _ = self._contacts()
        return bool(table.count[0])

    def FindCollisionCandidates(self) -> list[tuple[GeometryId, GeometryId]]:
        """Pairs that may touch and whose bounding spheres overlap, sorted."""
        model, ids, X_WB = self._placed()
        R, p = X_WB[:, :9].reshape(-1, 3, 3), X_WB[:, 9:]
        body = model.geometry[:, columns.BODY]
        R_BG, p_BG = model.X_BG[:, :9].reshape(-1, 3, 3), model.X_BG[:, 9:]
        centre_G = model.size[:, columns.CENTRE : columns.CENTRE + 3]
        R_WG = R[body] @ R_BG
        p_WG = p[body] + np.einsum("nij,nj->ni", R[body], p_BG)
        centre = p_WG + np.einsum("nij,nj->ni", R_WG, centre_G)
        bound = model.size[:, columns.BOUND]
        found = []
        for a, b in model.pair:
            if math.isinf(bound[a]) or math.isinf(bound[b]):
                shape, plane = (b, a) if math.isinf(bound[a]) else (a, b)
                near = R_WG[plane][:, 2] @ (centre[shape] - p_WG[plane]) <= bound[shape]
            else:
                near = np.linalg.norm(centre[a] - centre[b]) <= bound[a] + bound[b]
            if near:
                found.append((ids[a], ids[b]))
        return found

    # ---- what is not there

    def ComputeContactSurfaces(self, representation: Any) -> list:
        """Not available: hydroelastic contact."""
        raise NotImplementedError("QueryObject.ComputeContactSurfaces(): hydroelastic contact is not supported.")

    def ComputeContactSurfacesWithFallback(self, representation: Any) -> tuple[list, list]:
        """Contact surfaces and point pairs; raises if a geometry has a hydroelastic representation."""
        for geometry_id in self._state.ids_with_role(Role.kProximity):
            properties = self.inspector().GetProximityProperties(geometry_id)
            kind = properties.GetPropertyOrDefault("hydroelastic", "compliance_type", None)  # type: ignore[union-attr]
            if getattr(kind, "value", 0) != 0:
                raise NotImplementedError(
                    "QueryObject.ComputeContactSurfacesWithFallback(): the hydroelastic representation of geometry "
                    f"'{self.inspector().GetName(geometry_id)}' is not supported."
                )
        return [], self.ComputePointPairPenetration()

    def GetConfigurationsInWorld(self, deformable_geometry_id: GeometryId) -> np.ndarray:
        """Not available: deformable geometry."""
        raise NotImplementedError("QueryObject.GetConfigurationsInWorld(): deformable geometry is not supported.")

    def RenderColorImage(self, *args: Any, **kwargs: Any) -> Any:
        """Not available: rendering."""
        raise NotImplementedError("QueryObject.RenderColorImage(): rendering is not supported.")

    RenderDepthImage = RenderLabelImage = RenderColorImage

    def __copy__(self) -> QueryObject:
        """A copy looks at the same context."""
        new = QueryObject()
        new._bind(self._scene_graph, self._context)
        return new

    def __deepcopy__(self, memo: dict) -> QueryObject:
        return self.__copy__()


_register_value_type(QueryObject)


def explain_contact_status(model: GeometryModel, table: ContactTable) -> Exception:
    """The error for a search of contacts that did not end well."""
    return RuntimeError(
        f"More than {table.pair.shape[0]} contact points among {model.pair.shape[0]} pairs of geometries: the contact "
        "table is full."
    )
