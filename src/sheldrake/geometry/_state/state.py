"""What a SceneGraph knows: sources, frames, geometries, roles and filters. A context holds its own copy."""

from __future__ import annotations

import copy
import itertools
import operator
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from sheldrake.common._overloads import expect
from sheldrake.common._text import choices
from sheldrake.geometry import _proximity_properties as proximity
from sheldrake.geometry._hydroelastic.representation import check_representation
from sheldrake.geometry._ids import FrameId, GeometryId, SourceId, number_of
from sheldrake.geometry._meshes.mesh_files import check_mesh
from sheldrake.geometry._properties import (
    GeometryProperties,
    IllustrationProperties,
    PerceptionProperties,
    ProximityProperties,
)
from sheldrake.geometry._render.renderers import Renderers
from sheldrake.geometry._roles import CollisionFilterScope, HydroelasticType, Role, RoleAssign
from sheldrake.geometry._shapes import Convex, Mesh, Shape
from sheldrake.geometry._state.collision_filter import CollisionFilter, Pair, ordered_pair
from sheldrake.geometry._state.config import DefaultProximityProperties
from sheldrake.geometry._state.geometry_set import GeometrySet
from sheldrake.geometry._state.instance import GeometryFrame, GeometryInstance, canonical_name
from sheldrake.geometry._state.records import (
    WORLD_FRAME_ID,
    FrameRecord,
    GeometryRecord,
    GeometryVersion,
    SourceRecord,
    next_version,
)
from sheldrake.multibody.math._coulomb_friction import CoulombFriction

if TYPE_CHECKING:
    from sheldrake.geometry._render.engine import RenderEngine
    from sheldrake.math import RigidTransform

SELF_SOURCE_ID = SourceId.get_new_id()
_WORLD_FRAME_GROUP = -1234567
_ROLE_NAMES = {
    Role.kUnassigned: "unassigned",
    Role.kProximity: "proximity",
    Role.kIllustration: "illustration",
    Role.kPerception: "perception",
}
_ROLE_OF: dict[type, Role] = {
    ProximityProperties: Role.kProximity,
    IllustrationProperties: Role.kIllustration,
    PerceptionProperties: Role.kPerception,
}


class GeometryState:
    """Sources, frames, geometries, roles and collision filters. Errors are RuntimeErrors and change nothing."""

    #: Of geometries whose properties do not say; one of `POINT_CONTACT_ALGORITHMS`.
    point_contact_algorithm = "multi_point"

    def __init__(self) -> None:
        self.sources: dict[SourceId, SourceRecord] = {SELF_SOURCE_ID: SourceRecord("SceneGraphInternal")}
        self.frames: dict[FrameId, FrameRecord] = {
            WORLD_FRAME_ID: FrameRecord("world", _WORLD_FRAME_GROUP, SELF_SOURCE_ID, WORLD_FRAME_ID)
        }
        self.geometries: dict[GeometryId, GeometryRecord] = {}
        self._frame_names: set[tuple[SourceId, str]] = set()
        self._of_frame: dict[FrameId, tuple[GeometryId, ...]] = {}
        self.filter = CollisionFilter()
        self.renderers = Renderers()
        self.version = GeometryVersion()
        self.serial = next_version()  # changes with every change
        self._candidates: tuple[tuple[object, ...], list[Pair]] = (), []  # and what they were found for

    def copy(self) -> GeometryState:
        """An independent copy; records are shared."""
        new = object.__new__(GeometryState)
        new.sources, new.frames, new.geometries = dict(self.sources), dict(self.frames), dict(self.geometries)
        new._frame_names, new._of_frame = set(self._frame_names), dict(self._of_frame)
        new.filter, new.renderers = self.filter.copy(), self.renderers.copy()
        new.version, new.serial, new._candidates = self.version, self.serial, self._candidates
        new.point_contact_algorithm = self.point_contact_algorithm
        return new

    def __deepcopy__(self, memo: dict) -> GeometryState:
        return self.copy()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, GeometryState) and self.serial == other.serial

    __hash__ = None  # type: ignore[assignment]

    __copy__ = Clone = copy

    def _touch(self, roles: Iterable[Role] = ()) -> None:
        self.serial = next_version()
        if roles:
            self.version = self.version._changed(roles)

    def set_point_contact_algorithm(self, name: str) -> None:
        if name not in proximity.POINT_CONTACT_ALGORITHMS:
            raise RuntimeError(
                f"Unknown point contact algorithm {name!r}; expected {choices(proximity.POINT_CONTACT_ALGORITHMS)}."
            )
        self.point_contact_algorithm = name
        self._touch([Role.kProximity])

    # ---- look-ups that explain themselves

    def source(self, source_id: SourceId) -> SourceRecord:
        if source_id not in self.sources:
            raise RuntimeError(f"Referenced geometry source {number_of(source_id, SourceId)} is not registered.")
        return self.sources[source_id]

    def frame(self, frame_id: FrameId) -> FrameRecord:
        if frame_id not in self.frames:
            raise RuntimeError(f"Referenced frame {number_of(frame_id, FrameId)} has not been registered.")
        return self.frames[frame_id]

    def geometry(self, geometry_id: GeometryId) -> GeometryRecord:
        if geometry_id not in self.geometries:
            raise RuntimeError(f"Referenced geometry {number_of(geometry_id, GeometryId)} has not been registered.")
        return self.geometries[geometry_id]

    def _owned_frame(self, source_id: SourceId, frame_id: FrameId) -> FrameRecord | None:
        self.source(source_id)
        frame = self.frames.get(frame_id)
        if frame is None or frame.source != source_id:
            raise RuntimeError(
                f"Referenced frame {frame_id.get_value()} for source {source_id.get_value()}, "
                "but the frame doesn't belong to the source."
            )
        return frame

    def _owned_geometry(self, source_id: SourceId, geometry_id: GeometryId) -> GeometryRecord:
        self.source(source_id)
        record = self.geometry(geometry_id)
        if record.source != source_id:
            raise RuntimeError(
                f"Given geometry id {geometry_id.get_value()} does not belong to the given "
                f"source id {source_id.get_value()}"
            )
        return record

    # ---- sources and frames

    def register_source(self, name: str = "") -> SourceId:
        source_id = SourceId.get_new_id()
        name = name or f"Source_{source_id.get_value()}"
        if any(source.name == name for source in self.sources.values()):
            raise RuntimeError(f"Registering new source with duplicate name: {name}.")
        self.sources[source_id] = SourceRecord(name)
        self._touch()
        return source_id

    def register_frame(self, source_id: SourceId, parent_id: FrameId, frame: GeometryFrame) -> FrameId:
        source = self.source(source_id)
        frame_id = frame.id()
        if parent_id != WORLD_FRAME_ID and parent_id not in source.frames:
            raise RuntimeError(
                f"Indicated parent id {parent_id.get_value()} does not belong to the indicated "
                f"source id {source_id.get_value()}."
            )
        if frame_id in self.frames:
            raise RuntimeError(f"Registering frame with an id that has already been registered: {frame_id.get_value()}")
        if (source_id, frame.name()) in self._frame_names:
            raise RuntimeError(f"Registering frame for source '{source.name}' with a duplicate name '{frame.name()}'")
        self.frames[frame_id] = FrameRecord(frame.name(), frame.frame_group(), source_id, parent_id)
        self._frame_names.add((source_id, frame.name()))
        self.sources[source_id] = source._replace(frames=(*source.frames, frame_id))
        self._touch()
        return frame_id

    def rename_frame(self, frame_id: FrameId, name: str) -> None:
        if frame_id not in self.frames:
            raise RuntimeError(f"Cannot rename frame with invalid frame id: {frame_id.get_value()}")
        frame = self.frames[frame_id]
        if frame.name == name:
            return
        if (frame.source, name) in self._frame_names:
            raise RuntimeError(f"Renaming frame from '{frame.name}' to an already existing name '{name}'")
        self._frame_names.discard((frame.source, frame.name))  # (the world's is nobody's)
        self._frame_names.add((frame.source, name))
        self.frames[frame_id] = frame._replace(name=name)
        self._touch()

    # ---- geometries

    def register_geometry(self, source_id: SourceId, frame_id: FrameId, instance: GeometryInstance) -> GeometryId:
        self.source(source_id)
        if frame_id != WORLD_FRAME_ID:
            self._owned_frame(source_id, frame_id)
        geometry_id = instance.id()
        if geometry_id in self.geometries:
            raise RuntimeError(
                f"Registering geometry with an id that has already been registered: {geometry_id.get_value()}"
            )
        given = (instance._proximity, instance._illustration, instance._perception)
        roles: dict[Role, GeometryProperties] = {_ROLE_OF[type(p)]: copy.copy(p) for p in given if p is not None}
        for role in roles:
            self._check_unique_name(frame_id, role, instance.name())
        _check_proximity(instance.shape(), roles.get(Role.kProximity))
        record = GeometryRecord(instance.name(), source_id, frame_id, instance.pose(), instance.shape(), roles)
        self._add(geometry_id, record)
        self._touch(roles)
        return geometry_id

    def _add(self, geometry_id: GeometryId, record: GeometryRecord) -> None:
        self.renderers.register(geometry_id, record)
        self.geometries[geometry_id] = record
        self._of_frame[record.frame] = (*self._of_frame.get(record.frame, ()), geometry_id)

    def register_again(self, records: Iterable[GeometryRecord]) -> list[GeometryId]:
        """Registers geometries that are known to fit, as they were registered with another frame; nothing is checked.

        Args:
            records: Their properties are not copied.
        """
        ids: list[GeometryId] = []
        roles: set[Role] = set()
        for record in records:
            ids.append(GeometryId.get_new_id())
            self._add(ids[-1], record)
            roles.update(record.roles)
        self._touch(roles)
        return ids

    def _check_unique_name(self, frame_id: FrameId, role: Role, name: str, but: GeometryId | None = None) -> None:
        for known_id in self._of_frame.get(frame_id, ()):
            known = self.geometries[known_id]
            if known.name == name and role in known.roles and known_id != but:
                raise RuntimeError(
                    f"The name '{name}' has already been used by a geometry with the '{_ROLE_NAMES[role]}' role."
                )

    def remove_geometry(self, source_id: SourceId, geometry_id: GeometryId) -> None:
        self.source(source_id)
        record = self.geometry(geometry_id)
        if record.source != source_id:
            raise RuntimeError(
                f"Trying to remove geometry {geometry_id.get_value()} from source {source_id.get_value()}, "
                "but the geometry doesn't belong to that source."
            )
        del self.geometries[geometry_id]
        self._of_frame[record.frame] = tuple(i for i in self._of_frame[record.frame] if i != geometry_id)
        self.filter.remove_geometry(geometry_id)
        self.renderers.forget(geometry_id)
        self._touch(record.roles)

    def rename_geometry(self, geometry_id: GeometryId, name: str) -> None:
        record = self.geometry(geometry_id)
        name = canonical_name(name)
        for role in record.roles:
            self._check_unique_name(record.frame, role, name, but=geometry_id)
        self.geometries[geometry_id] = record._replace(name=name)
        self._touch()

    def change_shape(
        self, source_id: SourceId, geometry_id: GeometryId, shape: Shape, X_FG: RigidTransform | None
    ) -> None:
        record = self._owned_geometry(source_id, geometry_id)
        _check_proximity(shape, record.roles.get(Role.kProximity))
        pose = record.X_FG if X_FG is None else copy.copy(X_FG)
        changed = record._replace(shape=shape.Clone(), X_FG=pose)
        self.renderers.register(geometry_id, changed)
        self.geometries[geometry_id] = changed
        self._touch(record.roles)

    # ---- renderers

    def add_renderer(self, name: str, engine: RenderEngine) -> None:
        self.renderers.add(name, engine, self.geometries)
        self._touch()

    def remove_renderer(self, name: str) -> None:
        self.renderers.remove(name)
        self._touch()

    # ---- roles

    def assign_role(
        self, source_id: SourceId, geometry_id: GeometryId, properties: GeometryProperties, assign: RoleAssign
    ) -> None:
        record = self._owned_geometry(source_id, geometry_id)
        role = _ROLE_OF[type(properties)]
        if assign is RoleAssign.kNew and role in record.roles:
            raise RuntimeError(
                f"Trying to assign the '{_ROLE_NAMES[role]}' role to geometry id {geometry_id.get_value()} for the "
                "first time; it already has the role assigned"
            )
        if assign is RoleAssign.kReplace and role not in record.roles:
            raise RuntimeError(
                f"Trying to replace the properties on geometry id {geometry_id.get_value()} for the "
                f"'{_ROLE_NAMES[role]}' role; it has not had the role initially assigned"
            )
        if assign is RoleAssign.kNew:
            self._check_unique_name(record.frame, role, record.name, but=geometry_id)
        if role is Role.kProximity:
            _check_proximity(record.shape, properties)
        changed = record._replace(roles={**record.roles, role: copy.copy(properties)})
        if role is Role.kPerception:
            self.renderers.register(geometry_id, changed)
        self.geometries[geometry_id] = changed
        self._touch([role])

    def remove_role(self, source_id: SourceId, target: FrameId | GeometryId, role: Role) -> int:
        """Takes a role from one geometry or all geometries of a frame; returns how many had it."""
        if isinstance(target, GeometryId):
            self._owned_geometry(source_id, target)
            ids = [target]
        else:
            self.source(source_id)
            if target != WORLD_FRAME_ID:
                self._owned_frame(source_id, target)
            ids = [i for i, g in self.geometries.items() if g.frame == target and g.source == source_id]
        ids = [i for i in ids if role in self.geometries[i].roles]
        for geometry_id in ids:
            record = self.geometries[geometry_id]
            kept = {known: p for known, p in record.roles.items() if known is not role}
            self.geometries[geometry_id] = record._replace(roles=kept)
            if role is Role.kProximity:
                self.filter.remove_geometry(geometry_id)
            if role is Role.kPerception:
                self.renderers.forget(geometry_id)
        if ids:
            self._touch([role])
        return len(ids)

    # ---- which pairs may touch

    def resolve(self, geometry_set: GeometrySet, role: Role | None = None) -> set[GeometryId]:
        """The ids a GeometrySet stands for."""
        for geometry_id in expect("GetGeometryIds", geometry_set, GeometrySet).geometries():
            if geometry_id not in self.geometries:
                raise RuntimeError(
                    "Geometry set includes a geometry id that doesn't belong to the SceneGraph: "
                    f"{geometry_id.get_value()}"
                )
        frames = geometry_set.frames()
        for frame_id in frames:
            self.frame(frame_id)
        ids = set(geometry_set.geometries())
        if frames:
            ids |= {i for i, g in self.geometries.items() if g.frame in frames}
        return {i for i in ids if role is None or self.geometries[i].has(role)}

    def resolve_proximity(self, geometry_set: GeometrySet, scope: CollisionFilterScope) -> set[GeometryId]:
        """The ids with the proximity role; there is no deformable geometry, so every scope is the same."""
        return self.resolve(geometry_set, Role.kProximity)

    def edit_filter(self) -> tuple[CollisionFilter, Any]:
        """The filter, about to be changed, and how to resolve its sets."""
        self._touch([Role.kProximity])
        return self.filter, self.resolve_proximity

    def exclude(self, pairs: set[Pair]) -> None:
        """Lets pairs of geometries with the proximity role never touch, smaller id first."""
        self._touch([Role.kProximity])
        self.filter.exclude(pairs)

    def ids_with_role(self, role: Role) -> list[GeometryId]:
        return sorted(i for i, g in self.geometries.items() if g.has(role))

    def never_touch(self, a: GeometryRecord, b: GeometryRecord) -> bool:
        """Geometries of one frame, which includes all that are fixed to the world."""
        return a.frame == b.frame

    def collision_candidates(self) -> list[Pair]:
        """The pairs of proximity geometry that may touch, smaller id first, sorted; not to be changed."""
        now = self.serial, *self.filter.parts()
        known = self._candidates
        if len(known[0]) != len(now) or not all(map(operator.is_, known[0], now)):
            ids = self.ids_with_role(Role.kProximity)
            excluded, frames = self.filter.excluded(ids), [self.geometries[i].frame for i in ids]
            pairs = zip(itertools.combinations(ids, 2), itertools.combinations(frames, 2))
            found = [pair for pair, (one, other) in pairs if pair not in excluded and one != other]
            self._candidates = known = now, found
        return known[1]

    def collision_filtered(self, a: GeometryId, b: GeometryId) -> bool:
        """True if the pair can not touch."""
        one, other = self.geometries.get(a), self.geometries.get(b)
        if one is None or other is None or not (one.has(Role.kProximity) and other.has(Role.kProximity)):
            raise self._no_filter_status(a, b)
        if self.never_touch(one, other):
            return True
        return ordered_pair(a, b) in self.filter.excluded((a, b))

    def _no_filter_status(self, a: GeometryId, b: GeometryId) -> RuntimeError:
        numbers = number_of(a, GeometryId), number_of(b, GeometryId)
        about = f"Can't report collision filter status between geometries {numbers[0]} and {numbers[1]}; "
        for geometry_id in (a, b):
            if geometry_id not in self.geometries:
                return RuntimeError(f"{about}{geometry_id.get_value()} is not a valid geometry")
        without = [i for i in (a, b) if Role.kProximity not in self.geometries[i].roles]
        if len(without) == 2:
            return RuntimeError(f"{about}neither id has a proximity role")
        return RuntimeError(f"{about}{without[0].get_value()} does not have a proximity role")

    # ---- defaults

    def apply_proximity_defaults(self, defaults: DefaultProximityProperties, only: GeometryId | None = None) -> None:
        """Adds the default proximity properties that geometries lack.

        Raises:
            RuntimeError: a hydroelastic representation that is asked for lacks a property.
        """
        fill = _default_values(defaults)
        for geometry_id in self.ids_with_role(Role.kProximity) if only is None else [only]:
            record = self.geometries[geometry_id]
            old = record.roles.get(Role.kProximity)
            if not isinstance(old, ProximityProperties):  # there are none
                continue
            new = old._with_defaults(fill)
            check_representation(record.shape, new)
            self.geometries[geometry_id] = record._replace(roles={**record.roles, Role.kProximity: new})
        self.serial = next_version()


def _check_proximity(shape: Shape, properties: GeometryProperties | None) -> None:
    """Refuses a mesh that cannot be touched, and a representation whose properties are missing or out of range."""
    if isinstance(properties, ProximityProperties):
        if isinstance(shape, (Convex, Mesh)):
            check_mesh(shape.source(), "The proximity role of a mesh")
        check_representation(shape, properties)


def _default_values(d: DefaultProximityProperties) -> dict[str, dict[str, Any]]:
    """Every default that has a value, by group and name."""
    types = {"undefined": "kUndefined", "rigid": "kRigid", "compliant": "kCompliant"}
    if d.compliance_type not in types:
        raise RuntimeError(f"Unknown hydroelastic_type: '{d.compliance_type}'; expected {choices(types)}.")
    friction = None
    if d.static_friction is not None and d.dynamic_friction is not None:
        friction = CoulombFriction(d.static_friction, d.dynamic_friction)
    values: list[tuple[str, str, Any]] = [
        (proximity.HYDRO, proximity.COMPLIANCE_TYPE, HydroelasticType[types[d.compliance_type]]),
        (proximity.HYDRO, proximity.MODULUS, d.hydroelastic_modulus),
        (proximity.HYDRO, proximity.RESOLUTION_HINT, d.resolution_hint),
        (proximity.HYDRO, proximity.SLAB_THICKNESS, d.slab_thickness),
        (proximity.HYDRO, proximity.MARGIN, d.margin),
        (proximity.MATERIAL, proximity.FRICTION, friction),
        (proximity.MATERIAL, proximity.DISSIPATION, d.hunt_crossley_dissipation),
        (proximity.MATERIAL, proximity.RELAXATION_TIME, d.relaxation_time),
        (proximity.MATERIAL, proximity.POINT_STIFFNESS, d.point_stiffness),
    ]
    found: dict[str, dict[str, Any]] = {}
    for group, name, value in values:
        if value is not None:
            found.setdefault(group, {})[name] = value
    return found
