"""Read-only look at what a SceneGraph knows.

Needs no poses: for questions at the poses of a context there is `QueryObject`, which has an inspector too.
"""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING, Any

from sheldrake.common._checked import checked
from sheldrake.common._kinds import instance_of
from sheldrake.common._no_constructor import no_constructor
from sheldrake.common._overloads import overload, overloaded
from sheldrake.geometry._hydroelastic.representation import representation_of
from sheldrake.geometry._ids import FrameId, GeometryId, SourceId, number_of
from sheldrake.geometry._properties import (
    GeometryProperties,
    IllustrationProperties,
    PerceptionProperties,
    ProximityProperties,
)
from sheldrake.geometry._roles import Role
from sheldrake.geometry._shapes import Convex, Mesh, Shape
from sheldrake.geometry._state.collision_filter import Pair
from sheldrake.geometry._state.geometry_set import GeometrySet
from sheldrake.geometry._state.instance import GeometryInstance
from sheldrake.geometry._state.records import WORLD_FRAME_ID, GeometryVersion
from sheldrake.geometry._state.state import _ROLE_NAMES, GeometryState

if TYPE_CHECKING:
    from collections.abc import Callable

    from sheldrake.geometry._bounding import Obb
    from sheldrake.geometry._meshes.polygon_mesh import PolygonSurfaceMesh
    from sheldrake.geometry._meshes.triangle_mesh import TriangleSurfaceMesh
    from sheldrake.geometry._meshes.volume_mesh import VolumeMesh
    from sheldrake.math import RigidTransform

_SOURCE, _FRAME, _GEOMETRY = (instance_of(cls) for cls in (SourceId, FrameId, GeometryId))


@no_constructor("Use SceneGraph.model_inspector().")
class SceneGraphInspector:
    """Answers questions about sources, frames, geometries and roles; poses that change with time are QueryObject's."""

    _get_state: Callable[[], GeometryState]

    @classmethod
    def _make(cls, get_state: Callable[[], GeometryState]) -> SceneGraphInspector:
        new = object.__new__(cls)
        new._get_state = get_state
        return new

    @property
    def _state(self) -> GeometryState:
        return self._get_state()

    # ---- the scene

    def num_sources(self) -> int:
        """Number of sources, the SceneGraph's own included."""
        return len(self._state.sources)

    def num_frames(self) -> int:
        """Number of frames, the world frame included."""
        return len(self._state.frames)

    def num_geometries(self) -> int:
        """Number of geometries."""
        return len(self._state.geometries)

    def GetAllSourceIds(self) -> list[SourceId]:
        """All sources."""
        return sorted(self._state.sources)

    def GetAllFrameIds(self) -> list[FrameId]:
        """All frames, the world frame included."""
        return sorted(self._state.frames)

    def world_frame_id(self) -> FrameId:
        """The world frame."""
        return WORLD_FRAME_ID

    @checked
    def GetAllGeometryIds(self, role: Role | None = None) -> list[GeometryId]:
        """All geometries, or those with a role, sorted."""
        state = self._state
        return sorted(state.geometries) if role is None else state.ids_with_role(role)

    @checked
    def GetGeometryIds(self, geometry_set: GeometrySet, role: Role | None = None) -> set[GeometryId]:
        """The geometries a set stands for, or those of them with a role."""
        return self._state.resolve(geometry_set, role)

    @checked
    def NumGeometriesWithRole(self, role: Role) -> int:
        """Number of geometries with a role."""
        return len(self._state.ids_with_role(role))

    def NumDynamicGeometries(self) -> int:
        """Number of geometries that are not fixed to the world."""
        return self.num_geometries() - self.NumAnchoredGeometries()

    def NumAnchoredGeometries(self) -> int:
        """Number of geometries fixed to the world."""
        return sum(g.frame == WORLD_FRAME_ID for g in self._state.geometries.values())

    def GetCollisionCandidates(self) -> set[Pair]:
        """Pairs of geometries that may touch."""
        return set(self._state.collision_candidates())

    def geometry_version(self) -> GeometryVersion:
        """The version of the geometry, per role."""
        return copy.copy(self._state.version)

    # ---- sources

    @checked
    def SourceIsRegistered(self, source_id: SourceId) -> bool:
        """True if the source is registered."""
        return source_id in self._state.sources

    def NumFramesForSource(self, source_id: SourceId) -> int:
        """Number of frames a source registered."""
        return len(self._state.source(source_id).frames)

    def FramesForSource(self, source_id: SourceId) -> set[FrameId]:
        """The frames a source registered."""
        return set(self._state.source(source_id).frames)

    @overloaded(overload(frame_id=_FRAME, source_id=_SOURCE), overload(geometry_id=_GEOMETRY, source_id=_SOURCE))
    def BelongsToSource(self, target: FrameId | GeometryId, source_id: SourceId) -> bool:
        """True if a frame or geometry (first argument) was registered by a source (second argument)."""
        state = self._state
        if isinstance(target, FrameId):
            owner = state.frame(target).source
        else:
            owner = state.geometry(target).source
        state.source(source_id)
        return owner == source_id

    @overloaded(overload(frame_id=_FRAME), overload(geometry_id=_GEOMETRY))
    def GetOwningSourceName(self, target: FrameId | GeometryId) -> str:
        """The name of the source that registered a frame or geometry."""
        state = self._state
        if isinstance(target, FrameId):
            return state.sources[state.frame(target).source].name
        if target not in state.geometries:
            raise RuntimeError(f"Geometry id {number_of(target, GeometryId)} does not map to a registered geometry")
        return state.sources[state.geometries[target].source].name

    @overloaded(overload(source_id=_SOURCE), overload(frame_id=_FRAME), overload(geometry_id=_GEOMETRY))
    def GetName(self, target: SourceId | FrameId | GeometryId) -> str:
        """The name of a source, frame or geometry.

        Raises:
            RuntimeError: the id is not registered.
        """
        state, value = self._state, target.get_value()
        if isinstance(target, SourceId):
            if target not in state.sources:
                raise RuntimeError(f"Querying source name for an invalid source id: {value}.")
            return state.sources[target].name
        if isinstance(target, FrameId):
            if target not in state.frames:
                raise RuntimeError(f"No frame name available for invalid frame id: {value}")
            return state.frames[target].name
        return self._geometry(target).name

    # ---- frames

    def GetParentFrame(self, frame_id: FrameId) -> FrameId:
        """Returns the frame that a frame was registered in; of the world frame, itself.

        Raises:
            RuntimeError: no frame has the id.
        """
        return self._state.frame(frame_id).parent

    def GetFrameGroup(self, frame_id: FrameId) -> int:
        """The group number given when the frame was registered."""
        if frame_id not in self._state.frames:
            raise RuntimeError(f"No frame group available for invalid frame id: {number_of(frame_id, FrameId)}")
        return self._state.frames[frame_id].group

    def NumGeometriesForFrame(self, frame_id: FrameId) -> int:
        """Number of geometries of a frame."""
        self._state.frame(frame_id)
        return sum(g.frame == frame_id for g in self._state.geometries.values())

    def NumGeometriesForFrameWithRole(self, frame_id: FrameId, role: Role) -> int:
        """Number of geometries of a frame that have a role."""
        self._state.frame(frame_id)
        return sum(g.frame == frame_id and g.has(role) for g in self._state.geometries.values())

    def GetGeometries(self, frame_id: FrameId, role: Role | None = None) -> list[GeometryId]:
        """The geometries of a frame, or those with a role, sorted."""
        state = self._state
        if frame_id not in state.frames:
            raise RuntimeError(
                f"Cannot report geometries associated with invalid frame id: {number_of(frame_id, FrameId)}"
            )
        return sorted(i for i, g in state.geometries.items() if g.frame == frame_id and (role is None or g.has(role)))

    def GetGeometryIdByName(self, frame_id: FrameId, role: Role, name: str) -> GeometryId:
        """The geometry of a frame that has a role and a name.

        Raises:
            RuntimeError: there is none, or (without a role) several.
        """
        state = self._state
        frame = state.frame(frame_id)
        name = name.strip(" \t")
        names = {i: state.geometries[i].name for i in self.GetGeometries(frame_id, role)}
        found = [i for i, known in names.items() if known == name]
        about = f"The frame '{frame.name}' ({frame_id.get_value()}) has"
        where = f"geometry with the role '{_ROLE_NAMES[role]}' and the canonical name '{name}'"
        if len(found) > 1:
            raise RuntimeError(f"{about} multiple {where.replace('geometry', 'geometries', 1)}")
        if not found:
            known = ", ".join(names.values())
            hint = f" The names associated with this frame/role are {{{known}}}." if names else ""
            raise RuntimeError(f"{about} no {where}.{hint}")
        return found[0]

    # ---- geometries

    def _geometry(self, geometry_id: GeometryId) -> Any:
        if geometry_id not in self._state.geometries:
            raise RuntimeError(f"No geometry available for invalid geometry id: {number_of(geometry_id, GeometryId)}")
        return self._state.geometries[geometry_id]

    def GetShape(self, geometry_id: GeometryId) -> Shape:
        """The shape."""
        return self._geometry(geometry_id).shape

    def GetFrameId(self, geometry_id: GeometryId) -> FrameId:
        """The frame a geometry is fixed to."""
        return self._state.geometry(geometry_id).frame

    def GetPoseInFrame(self, geometry_id: GeometryId) -> RigidTransform:
        """The pose X_FG of a geometry in its frame."""
        return copy.copy(self._state.geometry(geometry_id).X_FG)

    def GetProperties(self, geometry_id: GeometryId, role: Role) -> GeometryProperties | None:
        """The properties of a role, or None."""
        if geometry_id not in self._state.geometries:
            raise RuntimeError(f"Referenced geometry {number_of(geometry_id, GeometryId)} has not been registered")
        return self._state.geometries[geometry_id].roles.get(role)

    def GetProximityProperties(self, geometry_id: GeometryId) -> ProximityProperties | None:
        """The proximity properties, or None."""
        return self.GetProperties(geometry_id, Role.kProximity)  # type: ignore[return-value]

    def GetIllustrationProperties(self, geometry_id: GeometryId) -> IllustrationProperties | None:
        """The illustration properties, or None."""
        return self.GetProperties(geometry_id, Role.kIllustration)  # type: ignore[return-value]

    def GetPerceptionProperties(self, geometry_id: GeometryId) -> PerceptionProperties | None:
        """The perception properties, or None."""
        return self.GetProperties(geometry_id, Role.kPerception)  # type: ignore[return-value]

    def CollisionFiltered(self, geometry_id1: GeometryId, geometry_id2: GeometryId) -> bool:
        """True if the pair can not touch.

        Raises:
            RuntimeError: one of them is unknown or has no proximity role.
        """
        return self._state.collision_filtered(geometry_id1, geometry_id2)

    def CloneGeometryInstance(self, geometry_id: GeometryId) -> GeometryInstance:
        """A GeometryInstance, with an id of its own, that would register the same geometry again."""
        record = self._geometry(geometry_id)
        instance = GeometryInstance(record.X_FG, record.shape, record.name)
        for role, setter in (
            (Role.kProximity, instance.set_proximity_properties),
            (Role.kIllustration, instance.set_illustration_properties),
            (Role.kPerception, instance.set_perception_properties),
        ):
            if role in record.roles:
                setter(record.roles[role])
        return instance

    def GetConvexHull(self, geometry_id: GeometryId) -> PolygonSurfaceMesh | None:
        """The convex hull of a Mesh or Convex; None for other shapes."""
        shape = self.GetShape(geometry_id)
        return shape.GetConvexHull() if isinstance(shape, (Mesh, Convex)) else None

    def GetObbInGeometryFrame(self, geometry_id: GeometryId) -> Obb | None:
        """The oriented bounding box in the geometry's frame; None for a half space."""
        from sheldrake.geometry._bounding import bounding_box

        box = bounding_box(self.GetShape(geometry_id))
        return None if box is None else box.__copy__()

    def maybe_get_hydroelastic_mesh(self, geometry_id: GeometryId) -> TriangleSurfaceMesh | VolumeMesh | None:
        """The mesh that stands for a geometry in hydroelastic contact: triangles if rigid, tetrahedra if compliant.

        None for a half space, and for geometry whose proximity properties ask for no such representation.
        """
        representation = representation_of(self._geometry(geometry_id))
        return None if representation is None else representation.mesh()

    # ---- what does not exist here: deformable geometry

    def IsDeformableGeometry(self, geometry_id: GeometryId) -> bool:
        """False: all geometry is rigid."""
        self._geometry(geometry_id)
        return False

    def GetAllDeformableGeometryIds(self) -> list[GeometryId]:
        """Empty: all geometry is rigid."""
        return []

    @checked
    def NumDeformableGeometriesWithRole(self, role: Role) -> int:
        """Zero: all geometry is rigid."""
        return 0

    def GetReferenceMesh(self, geometry_id: GeometryId) -> None:
        """None: only deformable geometry has a reference mesh."""
        self._geometry(geometry_id)
