"""What a MultibodyPlant says about a model, in the order and with the names in which a file can say it again."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._text import untaken
from sheldrake.multibody.parsing._files.diagnostics import Location
from sheldrake.multibody.parsing._model.description import GeometryDescription
from sheldrake.multibody.plant._parts import parts_of
from sheldrake.multibody.tree._index import BodyIndex, ForceElementIndex, FrameIndex, ModelInstanceIndex
from sheldrake.multibody.tree._joint_types import JOINT_TYPES, JointType

if TYPE_CHECKING:
    from collections.abc import Callable

    from sheldrake.geometry import GeometryId
    from sheldrake.geometry._state.inspector import SceneGraphInspector
    from sheldrake.math import RigidTransform
    from sheldrake.multibody.plant import MultibodyPlant
    from sheldrake.multibody.tree import Joint, RigidBody

_MATERIAL = ("coulomb_friction", "hunt_crossley_dissipation", "relaxation_time", "point_contact_stiffness",
             "point_contact_algorithm")  # fmt: skip
_HYDROELASTIC = ("compliance_type", "resolution_hint", "hydroelastic_modulus", "margin")


@dataclass
class BodyPart:
    """A body and its shapes."""

    body: RigidBody
    name: str
    visuals: list[GeometryDescription] = field(default_factory=list)
    collisions: list[GeometryDescription] = field(default_factory=list)


@dataclass
class JointPart:
    """A joint from frame F on its parent to frame M on its child; X_PF and X_CM are their poses in the bodies."""

    joint: Any
    name: str
    kind: str
    parent: str
    child: str
    X_PF: RigidTransform
    X_CM: RigidTransform
    actuators: list[Any] = field(default_factory=list)
    mimics: tuple[str, float, float] | None = None  # name of the other joint, ratio, offset
    spring: tuple[float, float] | None = None  # stiffness, rest position
    is_reversed: bool = False  # parent and child have changed places: what the joint says is about its inverse

    @property
    def type(self) -> JointType:
        """What is told apart by its kind."""
        return JOINT_TYPES[self.kind]


STANDARD_GRAVITY = np.array([0.0, 0.0, -9.81])  # what a model has that does not say it, in every format


@dataclass
class ModelParts:
    """A model taken apart.

    Attributes:
        name: Of the model.
        bodies: Without the world; the world's geometry is in `world`.
        frames: Name, name of the body, pose in it.
        filtered: Pairs of names of bodies that do not collide, beyond what every plant filters.
        gravity: In the world [m/s²].
        losses: What no format says, for people.
    """

    name: str
    world: BodyPart
    bodies: list[BodyPart] = field(default_factory=list)
    joints: list[JointPart] = field(default_factory=list)
    frames: list[tuple[str, str, Any]] = field(default_factory=list)
    actuators: list[Any] = field(default_factory=list)
    forces: list[Any] = field(default_factory=list)
    balls: list[tuple[str, np.ndarray, str, np.ndarray]] = field(default_factory=list)
    filtered: list[tuple[str, str]] = field(default_factory=list)
    free_poses: dict[str, Any] = field(default_factory=dict)
    gravity: np.ndarray = field(default_factory=lambda: STANDARD_GRAVITY)
    losses: list[str] = field(default_factory=list)
    names: dict[Any, str] = field(default_factory=dict)


def take_apart(plant: MultibodyPlant, inspector: Any, name: str) -> ModelParts:
    """The parts of everything in a plant.

    Args:
        plant: The plant; joints that Finalize() added for free bodies are left out.
        inspector: Of its scene graph, or None when the plant has no geometry.
        name: Of the model, when the plant has several.

    Raises:
        NotImplementedError: A joint that no description format has.
    """
    return _Taker(plant, inspector, name).take()


class _Taker:
    def __init__(self, plant: MultibodyPlant, inspector: SceneGraphInspector, name: str):
        self._plant, self._inspector = plant, inspector
        self._bodies = [plant.get_body(BodyIndex(i)) for i in range(1, plant.num_bodies())]
        self._joints = [plant.get_joint(i) for i in plant.GetJointIndices() if not plant.get_joint(i).is_ephemeral()]
        instances = {int(e.model_instance()) for e in [*self._bodies, *self._joints]} - {0}
        if len(instances) == 1:
            name = plant.GetModelInstanceName(ModelInstanceIndex(instances.pop()))
        self._parts = ModelParts(name.rpartition("::")[2], BodyPart(plant.world_body(), "world"))
        if len(instances) > 1:
            self._lose(f"{len(instances)} model instances become one model")

    def _lose(self, text: str) -> None:
        if text not in self._parts.losses:
            self._parts.losses.append(text)

    def take(self) -> ModelParts:
        parts = self._parts
        names = _Names(self._plant, self._lose)
        for body in self._bodies:
            parts.names[body.index()] = names.of(body, "link")
        parts.names[self._plant.world_body().index()] = "world"
        parts.bodies = [self._body(BodyPart(body, parts.names[body.index()])) for body in self._bodies]
        self._body(parts.world)
        joint_names = _Names(self._plant, self._lose)
        self._joint_names = {joint.index(): joint_names.of(joint, "joint") for joint in self._joints}
        parts.joints = [part for part in map(self._joint, self._joints) if part is not None]
        self._take_frames()
        self._take_actuators()
        self._take_forces()
        self._take_constraints()
        self._take_filters()
        self._take_free_poses()
        return parts

    # Geometry.

    def _body(self, part: BodyPart) -> BodyPart:
        if self._inspector is None:
            return part
        for ids, found in (
            (self._plant.GetVisualGeometriesForBody(part.body), part.visuals),
            (self._plant.GetCollisionGeometriesForBody(part.body), part.collisions),
        ):
            taken: set[str] = set()
            for geometry_id in ids:
                found.append(self._geometry(geometry_id, taken, found is part.collisions))
        return part

    def _geometry(self, geometry_id: GeometryId, taken: set[str], is_collision: bool) -> GeometryDescription:
        inspector = self._inspector
        wanted = inspector.GetName(geometry_id).rpartition("::")[2]
        name = untaken(wanted, taken, first=1)
        X_BG, shape = inspector.GetPoseInFrame(geometry_id), inspector.GetShape(geometry_id)
        part = GeometryDescription(Location(self._parts.name), name, X_BG, shape)
        if is_collision:
            part.proximity = inspector.GetProximityProperties(geometry_id)
            self._check_proximity(part)
        else:
            part.illustration = inspector.GetIllustrationProperties(geometry_id)
            part.perception = inspector.GetPerceptionProperties(geometry_id)
        return part

    def _check_proximity(self, part: GeometryDescription) -> None:
        known = {"material": _MATERIAL, "hydroelastic": _HYDROELASTIC}
        for group in sorted(part.proximity.GetGroupNames()):
            for key in part.proximity.GetPropertiesInGroup(group):
                if key not in known.get(group, ()):
                    self._lose(f"property ({group}, {key}) of collision geometries")

    # Joints.

    def _joint(self, joint: Joint) -> JointPart | None:
        kind, name = joint.type_name(), self._joint_names[joint.index()]
        parent, child = (self._parts.names[b.index()] for b in (joint.parent_body(), joint.child_body()))
        X_PF = joint.frame_on_parent().GetFixedPoseInBodyFrame()
        X_CM = joint.frame_on_child().GetFixedPoseInBodyFrame()
        if kind == "quaternion_floating" and parent == "world":
            if not (X_PF.IsExactlyIdentity() and X_CM.IsExactlyIdentity()):
                self._lose(f"frames of the floating joint '{name}': its link is free in the world")
            return None
        if not JOINT_TYPES[kind].written:
            raise NotImplementedError(f"Joint '{name}' is of type {kind}, which no file of this format has.")
        part = JointPart(joint, name, kind, parent, child, X_PF, X_CM)
        if kind != "weld" and np.any(joint.default_positions() != 0.0):
            self._lose(f"default position of joint '{name}': {joint.default_positions().tolist()}")
        if JOINT_TYPES[kind].has_one_dof:
            for what in ("velocity", "acceleration"):
                lower = getattr(joint, f"{what}_lower_limits")()
                if np.any(lower != -getattr(joint, f"{what}_upper_limits")()):
                    self._lose(f"lower {what} limit of joint '{name}', {lower.tolist()}: only the upper one is written")
        elif kind != "weld":
            limits = [getattr(joint, f"{w}_{e}_limits")() for w in ("position", "velocity", "acceleration")
                      for e in ("lower", "upper")]  # fmt: skip
            if np.isfinite(np.concatenate(limits)).any():
                self._lose(f"limits of joint '{name}', which is {kind}")
        return part

    def _take_frames(self) -> None:
        plant = self._plant
        made = {f"{joint.name()}_{end}" for joint in self._joints for end in ("parent", "child")}
        taken = {*self._parts.names.values()}
        for index in range(plant.num_frames()):
            frame = plant.get_frame(FrameIndex(index))
            if frame.is_body_frame() or frame.is_ephemeral() or (frame.name() in made):
                continue
            if frame.name() == "__model__":
                continue  # every SDFormat model has one
            name = frame.name()
            if not name or name in taken:
                self._lose(f"frame '{name}': the name is taken")
                continue
            taken.add(name)
            body = self._parts.names[frame.body().index()]
            self._parts.frames.append((name, body, frame.GetFixedPoseInBodyFrame()))

    def _take_actuators(self) -> None:
        parts = {part.joint.index(): part for part in self._parts.joints}
        for index in self._plant.GetJointActuatorIndices():
            actuator = self._plant.get_joint_actuator(index)
            part = parts.get(actuator.joint().index())
            if part is None or not part.type.has_one_dof:
                self._lose(f"actuator '{actuator.name()}'")
                continue
            if part.actuators and part.actuators[0].effort_limit() != actuator.effort_limit():
                self._lose(f"effort limit of actuator '{actuator.name()}': its joint has one for all")
            part.actuators.append(actuator)
            self._parts.actuators.append(actuator)

    # Forces, constraints, filters.

    def _take_forces(self) -> None:
        plant = self._plant
        joints = {part.joint.index(): part for part in self._parts.joints}
        for index in range(plant.num_force_elements()):
            force: Any = plant.get_force_element(ForceElementIndex(index))
            kind = type(force).__name__
            if kind == "UniformGravityFieldElement":
                self._take_gravity(force)
            elif kind in ("RevoluteSpring", "PrismaticSpring"):
                is_revolute = kind == "RevoluteSpring"
                rest = force.default_nominal_angle() if is_revolute else force.nominal_position()
                stiffness = force.default_stiffness() if is_revolute else force.stiffness()
                joints[force.joint().index()].spring = (stiffness, rest)
            elif kind in ("LinearSpringDamper", "LinearBushingRollPitchYaw"):
                self._parts.forces.append(force)
            else:
                self._lose(f"force element {kind}")

    def _take_gravity(self, gravity: Any) -> None:
        self._parts.gravity = gravity.gravity_vector()
        for body in self._bodies:
            if not gravity.is_enabled(body.model_instance()):
                self._lose(f"gravity is off for '{self._plant.GetModelInstanceName(body.model_instance())}'")

    def _take_constraints(self) -> None:
        joints = {part.joint.index(): part for part in self._parts.joints}
        for constraint_id in self._plant.GetConstraintIds():
            record = parts_of(self._plant).elements.constraints[constraint_id]
            if record.kind == "coupler" and joints[record.A.index()].mimics is None:
                ratio, offset = record.numbers[:2]
                joints[record.A.index()].mimics = (joints[record.B.index()].name, ratio, offset)
            elif record.kind == "ball":
                p = np.array(record.numbers)
                names = [self._parts.names[body.index()] for body in (record.A, record.B)]
                self._parts.balls.append((names[0], p[:3], names[1], p[3:6]))
            else:
                self._lose(f"a {record.kind} constraint")

    def _take_filters(self) -> None:
        if self._inspector is None:
            return
        ids = {part.name: self._plant.GetCollisionGeometriesForBody(part.body) for part in self._parts.bodies}
        group = _welded(self._parts)
        neighbours = {frozenset((j.parent, j.child)) for j in self._parts.joints if j.kind != "weld"}
        names = [name for name, geometries in ids.items() if geometries]
        for i, one in enumerate(names):
            for other in names[:i]:
                if group[one] == group[other] or "world" == group[one] == group[other]:
                    continue
                found = [self._inspector.CollisionFiltered(a, b) for a in ids[one] for b in ids[other]]
                by_itself = frozenset((one, other)) in neighbours
                if all(found) and not by_itself:
                    self._parts.filtered.append((other, one))
                elif any(found) and not all(found):
                    self._lose(f"that some geometries of '{other}' and '{one}' do not collide, and others do")
                elif by_itself and not any(found):
                    self._lose(f"that '{other}' and '{one}', which are neighbours, collide")

    def _take_free_poses(self) -> None:
        children = {part.child for part in self._parts.joints}
        roots = [part for part in self._parts.bodies if part.name not in children]
        if not self._plant.is_finalized():
            return
        for part in roots:
            if part.body.is_floating_base_body():
                self._parts.free_poses[part.name] = self._plant.GetDefaultFloatingBaseBodyPose(part.body)


class _Names:
    """Names for elements that are unique in one model: those of several instances may be the same."""

    def __init__(self, plant: MultibodyPlant, lose: Callable[[str], None]):
        self._plant, self._lose, self._taken = plant, lose, {"world"}

    def of(self, element: Any, what: str) -> str:
        name = element.name()
        if name in self._taken:
            instance = self._plant.GetModelInstanceName(element.model_instance()).replace("::", "_")
            new = untaken(f"{instance}_{name}", self._taken)
            self._lose(f"{what} '{name}' of model '{instance}' is called '{new}'")
            name = new
        self._taken.add(name)
        return name


def _welded(parts: ModelParts) -> dict[str, str]:
    """For each body the name of one that stands for all that are welded to it; the world if that is among them."""
    leader = {name: name for name in parts.names.values()}

    def find(name: str) -> str:
        while leader[name] != name:
            name = leader[name]
        return name

    for joint in parts.joints:
        if joint.kind == "weld":
            one, other = find(joint.parent), find(joint.child)
            leader[other if one == "world" else one] = one if one == "world" else other
    return {name: find(name) for name in leader}
