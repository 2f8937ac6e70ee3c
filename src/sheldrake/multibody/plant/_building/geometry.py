"""A plant's geometry: frames and shapes in a SceneGraph, and which of them may touch."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._overloads import Mismatch
from sheldrake.geometry import (
    FrameId,
    GeometryFrame,
    GeometryId,
    GeometryInstance,
    GeometryProperties,
    GeometrySet,
    IllustrationProperties,
    MakePhongIllustrationProperties,
    PerceptionProperties,
    ProximityProperties,
    RenderLabel,
    Role,
    SceneGraph,
    Shape,
    SourceId,
)
from sheldrake.geometry._shapes import _MeshShape
from sheldrake.geometry._state.collision_filter import Pair, ordered_pair
from sheldrake.geometry._state.instance import canonical_name
from sheldrake.geometry._state.records import WORLD_FRAME_ID, GeometryRecord
from sheldrake.math import RigidTransform
from sheldrake.multibody.math._coulomb_friction import CoulombFriction
from sheldrake.multibody.plant._building.elements import Elements
from sheldrake.multibody.tree import BodyIndex, ModelInstanceIndex, RigidBody
from sheldrake.multibody.tree._element import finite_pose


class BodyShape(NamedTuple):
    """A shape of a body B, to be touched (with the proximity role) or to be seen; never changed."""

    name: str
    X_BG: RigidTransform
    shape: Shape
    roles: Mapping[Role, GeometryProperties]


def default_visual_roles() -> tuple[IllustrationProperties, PerceptionProperties]:
    """The roles of a visual that is given none: a page shows it, and cameras see it."""
    return IllustrationProperties(), PerceptionProperties()


def _label(perception: GeometryProperties | None, body: RigidBody) -> None:
    """Has cameras that see a shape tell its body, unless its properties name another label."""
    if perception is not None and not perception.HasProperty("label", "id"):
        perception.AddProperty("label", "id", RenderLabel(int(body.index())))


class PlantGeometry:
    """Frames and shapes of the bodies in a SceneGraph, registered before Finalize().

    Args:
        elements: The bodies.
    """

    def __init__(self, elements: Elements) -> None:
        self._elements = elements
        self.scene_graph: SceneGraph | None = None
        self.source_id: SourceId | None = None
        self.frame_of_body: dict[int, FrameId] = {}
        self.body_of_frame: dict[FrameId, RigidBody] = {}
        self.collision_ids: dict[int, list[GeometryId]] = {}
        self.visual_ids: dict[int, list[GeometryId]] = {}
        self.adjacent_filters = True

    # --- registration

    def register_as_source(self, scene_graph: SceneGraph, name: str) -> SourceId:
        """Makes the plant a source of a SceneGraph; its bodies become frames there.

        Args:
            scene_graph: The SceneGraph.
            name: Of the plant.

        Raises:
            RuntimeError: it is one already, or the plant is finalized.
        """
        self._elements.require_not_finalized("RegisterAsSourceForSceneGraph")
        if self.scene_graph is not None:
            raise RuntimeError("RegisterAsSourceForSceneGraph(): this MultibodyPlant is a source already.")
        self.scene_graph = scene_graph
        self.source_id = scene_graph.RegisterSource(name)
        self.frame_of_body[0] = scene_graph.world_frame_id()
        self.body_of_frame[self.frame_of_body[0]] = self._elements.world
        for body in self._elements.bodies:
            self.register_frame(body)
        return self.source_id

    def register_frame(self, body: RigidBody) -> None:
        """Makes a body a frame of the SceneGraph, if there is one."""
        index = int(body.index())
        if self.scene_graph is None or index in self.frame_of_body:
            return
        assert self.source_id is not None
        frame = GeometryFrame(self._full_name(body, body._name), int(body._instance))
        frame_id = self.scene_graph._model.register_frame(self.source_id, WORLD_FRAME_ID, frame)
        self.frame_of_body[index], self.body_of_frame[frame_id] = frame_id, body

    def _full_name(self, body: RigidBody, name: str) -> str:
        instance = int(body._instance)
        return name if instance < 2 else f"{self._elements.GetModelInstanceName(body._instance)}::{name}"

    @checked
    def RenameModelInstance(self, model_instance: ModelInstanceIndex, name: str) -> None:
        """Gives a model instance another name; frames and geometries that have its name in theirs follow.

        Raises:
            RuntimeError: the plant is finalized, there is no such instance, or another has the name.
        """
        call = "RenameModelInstance"
        self._elements.require_not_finalized(call)
        prefix = f"{self._elements.instances.get(model_instance, call).name()}::"
        self._elements.instances.rename(call, model_instance, name)
        if self.scene_graph is None or int(model_instance) < 2:
            return
        for index in self._elements.GetBodyIndices(model_instance):
            self._rename(self._elements.get_body(index), prefix)

    def _rename(self, body: RigidBody, old_prefix: str) -> None:
        """Has names of a body's frame and geometries begin with that of its model instance, not with the old one."""
        scene_graph, frame_id = self.required_scene_graph(), self.frame_of_body[int(body.index())]
        inspector = scene_graph.model_inspector()
        scene_graph.RenameFrame(frame_id, self._full_name(body, body._name))
        for geometry_id in inspector.GetGeometries(frame_id):
            name = inspector.GetName(geometry_id)
            if name.startswith(old_prefix):
                scene_graph.RenameGeometry(geometry_id, self._full_name(body, name.removeprefix(old_prefix)))

    def geometry_source_is_registered(self) -> bool:
        """Whether it is a source of a SceneGraph."""
        return self.scene_graph is not None

    def get_source_id(self) -> SourceId | None:
        """Its id as a source."""
        return self.source_id

    def required_scene_graph(self) -> SceneGraph:
        """The SceneGraph of a plant that has one."""
        assert self.scene_graph is not None
        return self.scene_graph

    def _registrable(self, call: str, body: RigidBody) -> SceneGraph:
        """The SceneGraph, to register a geometry of a body in.

        Raises:
            RuntimeError: there is none, the plant is finalized, or the body is of another plant.
        """
        self._elements.require_not_finalized(call)
        self._elements.require_mine(call, body)
        if self.scene_graph is None:
            raise RuntimeError(
                f"Failure in {call}(): condition 'geometry_source_is_registered()' failed. Call "
                "RegisterAsSourceForSceneGraph() first, or make the plant with AddMultibodyPlantSceneGraph()."
            )
        return self.scene_graph

    @checked
    def RegisterCollisionGeometry(
        self,
        body: RigidBody,
        X_BG: Any,
        shape: Shape,
        name: str,
        properties: Any = None,
        *,
        coulomb_friction: Any = None,
    ) -> GeometryId:
        """Gives a body a shape to touch others with.

        Args:
            body: The body B.
            X_BG: Where the shape is on it.
            shape: The shape.
            name: Unique among the body's collision geometries.
            properties: ProximityProperties with at least friction, or a CoulombFriction.
            coulomb_friction: A CoulombFriction, by name.

        Raises:
            RuntimeError: no SceneGraph, the plant is finalized, or a name or pose that is not valid.
        """
        scene_graph = self._registrable("RegisterCollisionGeometry", body)
        properties = properties if coulomb_friction is None else coulomb_friction
        if isinstance(properties, CoulombFriction):
            friction, properties = properties, ProximityProperties()
            properties.AddProperty("material", "coulomb_friction", friction)
        if not isinstance(properties, ProximityProperties):
            raise Mismatch(
                "RegisterCollisionGeometry(): incompatible function arguments. properties must be ProximityProperties "
                f"or a CoulombFriction, not {properties!r}."
            )
        instance = self._instance(body, X_BG, shape, name, "RegisterCollisionGeometry")
        instance.set_proximity_properties(properties)
        geometry_id = scene_graph.RegisterGeometry(self.source_id, self.frame_of_body[int(body.index())], instance)
        self.collision_ids.setdefault(int(body.index()), []).append(geometry_id)
        return geometry_id

    def _instance(self, body: RigidBody, X_BG: RigidTransform, shape: Shape, name: str, call: str) -> GeometryInstance:
        X_BG = X_BG if isinstance(X_BG, RigidTransform) else RigidTransform(X_BG)
        finite_pose(call, "X_BG", X_BG)
        return GeometryInstance(X_BG, shape, self._full_name(body, name))

    @checked
    def RegisterVisualGeometry(
        self,
        body: RigidBody,
        X_BG: Any = None,
        shape: Shape | None = None,
        name: str | None = None,
        diffuse_color: Any = None,
        *,
        geometry_instance: GeometryInstance | None = None,
        properties: Any = None,
    ) -> GeometryId:
        """Gives a body a shape to be seen: `(body, X_BG, shape, name[, diffuse_color])` with a colour (r, g, b, a) or
        IllustrationProperties, or `(body, geometry_instance)`.

        Raises:
            RuntimeError: no SceneGraph, the plant is finalized, or a name or pose that is not valid.
        """  # fmt: skip
        scene_graph = self._registrable("RegisterVisualGeometry", body)
        instance = X_BG if isinstance(X_BG, GeometryInstance) else geometry_instance
        if instance is None:
            if shape is None or name is None:
                raise Mismatch(
                    "RegisterVisualGeometry(): incompatible function arguments. Takes (body, X_BG, shape, name, "
                    "diffuse_color) or (body, geometry_instance)."
                )
            instance = self._instance(body, X_BG, shape, name, "RegisterVisualGeometry")
            illustration = diffuse_color if properties is None else properties
            if illustration is None:
                illustration = IllustrationProperties()
            elif not isinstance(illustration, IllustrationProperties):
                illustration = MakePhongIllustrationProperties(np.ravel(np.asarray(illustration, float)))
            instance.set_illustration_properties(illustration)
            instance.set_perception_properties(PerceptionProperties(illustration))
        else:
            instance.set_name(self._full_name(body, instance.name()))
            if instance.illustration_properties() is None and instance.perception_properties() is None:
                illustration, perception = default_visual_roles()
                instance.set_illustration_properties(illustration)
                instance.set_perception_properties(perception)
        _label(instance.mutable_perception_properties(), body)
        geometry_id = scene_graph.RegisterGeometry(self.source_id, self.frame_of_body[int(body.index())], instance)
        self.visual_ids.setdefault(int(body.index()), []).append(geometry_id)
        return geometry_id

    def register_again(self, body: RigidBody, shapes: Sequence[BodyShape]) -> None:
        """Gives a new body shapes that another one was given, by the calls above and without complaint.

        Args:
            body: The body, which has none yet.
            shapes: In the order of their registration.
        """
        if self.scene_graph is None or self.source_id is None or not shapes:
            return
        index, prefix = int(body.index()), self._full_name(body, "")
        frame = self.frame_of_body[index]
        records, kept = [], []
        for shape in shapes:
            roles = {role: properties.__copy__() for role, properties in shape.roles.items()}
            _label(roles.get(Role.kPerception), body)
            name = canonical_name(prefix + shape.name)
            own = shape.shape.Clone() if isinstance(shape.shape, _MeshShape) else shape.shape  # a file may change
            records.append(GeometryRecord(name, self.source_id, frame, shape.X_BG.__copy__(), own, roles))
            kept.append(self.collision_ids if Role.kProximity in roles else self.visual_ids)
        for ids, geometry_id in zip(kept, self.scene_graph._model.register_again(records)):
            ids.setdefault(index, []).append(geometry_id)

    # --- looking up

    def num_collision_geometries(self) -> int:
        """Number of collision geometries of all bodies."""
        return sum(map(len, self.collision_ids.values()))

    @checked
    def GetCollisionGeometriesForBody(self, body: RigidBody) -> list[GeometryId]:
        """Collision geometries of a body."""
        self._elements.require_mine("GetCollisionGeometriesForBody", body)
        return list(self.collision_ids.get(int(body.index()), []))

    @checked
    def GetVisualGeometriesForBody(self, body: RigidBody) -> list[GeometryId]:
        """Visual geometries of a body."""
        self._elements.require_mine("GetVisualGeometriesForBody", body)
        return list(self.visual_ids.get(int(body.index()), []))

    @checked
    def CollectRegisteredGeometries(self, bodies: list[RigidBody]) -> GeometrySet:
        """The geometries of some bodies, as a set for collision filters."""
        if self.scene_graph is None:
            raise RuntimeError("CollectRegisteredGeometries(): the plant is not a source of a SceneGraph.")
        frames = [self.frame_of_body[int(b.index())] for b in bodies if b.index() != 0]
        anchored = [g for b in bodies if b.index() == 0 for g in self.collision_ids.get(0, [])]
        return GeometrySet(anchored, frames)

    @checked
    def GetBodyFromFrameId(self, frame_id: FrameId) -> RigidBody | None:
        """The body of a SceneGraph frame, None if it is not of this plant."""
        return self.body_of_frame.get(frame_id)

    @checked
    def GetBodyFrameIdIfExists(self, body_index: BodyIndex) -> FrameId | None:
        """The SceneGraph frame of a body, None if there is none."""
        return self.frame_of_body.get(int(body_index))

    @checked
    def GetBodyFrameIdOrThrow(self, body_index: BodyIndex) -> FrameId:
        """The SceneGraph frame of a body.

        Raises:
            RuntimeError: it has none.
        """
        frame_id = self.frame_of_body.get(int(body_index))
        if frame_id is None:
            name = self._elements.get_body(body_index).name()
            raise RuntimeError(f"Body '{name}' does not have geometry registered with a SceneGraph.")
        return frame_id

    # --- who may touch whom

    def set_adjacent_bodies_collision_filters(self, value: bool) -> None:
        """Whether two bodies with a joint between them, neither being the world, may not touch. Before Finalize()."""
        self._elements.require_not_finalized("set_adjacent_bodies_collision_filters")
        self.adjacent_filters = bool(value)

    def get_adjacent_bodies_collision_filters(self) -> bool:
        """Whether two bodies with a joint between them may not touch."""
        return self.adjacent_filters

    def filter_collisions(
        self, welded: Callable[[], list[list[RigidBody]]], whole_of: dict[RigidBody, RigidBody]
    ) -> None:
        """Default filters: within a body, within what is welded together, and between neighbours.

        Args:
            welded: Gives groups of bodies that are welded together.
            whole_of: The bodies that parts of divided ones belong to; these have the geometry.
        """
        if self.scene_graph is None:
            return

        of_body = {number: ids for number, ids in self.collision_ids.items() if ids}
        pairs: set[Pair] = set()
        for group in welded() if of_body else ():
            within = [g for body in group for g in of_body.get(int(body._index), ())]
            pairs.update(itertools.starmap(ordered_pair, itertools.combinations(within, 2)))
        for joint in self._elements.joints if self.adjacent_filters else ():
            parent, child = (whole_of.get(body, body) for body in (joint.parent_body(), joint.child_body()))
            a, b = int(parent._index), int(child._index)
            if a in of_body and b in of_body and a and b and joint.type_name() != "quaternion_floating":
                pairs.update(itertools.starmap(ordered_pair, itertools.product(of_body[a], of_body[b])))
        self.scene_graph._model.exclude(pairs)
