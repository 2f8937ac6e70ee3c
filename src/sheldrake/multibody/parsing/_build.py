"""A model description to a MultibodyPlant, in the order in which Drake adds things."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.multibody.plant._parts import parts_of

from ._collision_filter_groups import FilterGroupCollector
from ._files.diagnostics import DiagnosticPolicy, ParseError
from ._model.description import (
    ActuatorDescription,
    BallConstraintDescription,
    BodyDescription,
    BushingDescription,
    CouplerDescription,
    DistanceConstraintDescription,
    FrameDescription,
    FrameReference,
    GeometryDescription,
    JointDescription,
    ModelDescription,
    SpringDamperDescription,
    TendonDescription,
    WeldConstraintDescription,
)

if TYPE_CHECKING:
    from sheldrake.multibody.plant import MultibodyPlant
    from sheldrake.multibody.tree import RigidBody


def unused_name(plant: MultibodyPlant, wanted: str) -> str:
    """The name for a model instance, with a number behind it where a plant has one of that name."""
    name, number = wanted, 0
    while plant.HasModelInstanceNamed(name):
        number += 1
        name = f"{wanted}_{number}"
    return name


class ModelBuilder:
    """Adds described models to a plant."""

    def __init__(
        self, plant: MultibodyPlant, policy: DiagnosticPolicy, filters: FilterGroupCollector, auto_rename: bool
    ):
        self._plant = plant
        self._policy = policy
        self._filters = filters
        self._auto_rename = auto_rename
        self._frames: dict[tuple, Any] = {}  # (scope of model names, local name) -> frame
        self._scope: tuple[str, ...] = ()
        self._instance: Any = None
        self._joints: dict[str, Any] = {}
        self._geometry = parts_of(plant).geometry
        self._has_geometry = plant.geometry_source_is_registered()

    def add(self, model: ModelDescription, prefix: str = "") -> list:
        """Adds a model and the models nested in it; returns their instances, the model's own first.

        As in Drake, URDF files that SDFormat includes become models whose instances are not returned.

        Raises:
            ParseError: When the plant refuses something; the message says where it stands in the file.
            NotImplementedError: For an element this version cannot simulate.
        """
        self._frames = {}
        self._scope = ()
        if model.is_world:
            names = {id(nested): self._model_name(nested, prefix) for nested in model.nested}
        else:
            names = {id(model): self._model_name(model, prefix)}
        self._add_included(model, (), "", names)  # not returned, as Drake has it
        if not model.is_world:
            return self._add(model, names[id(model)])
        instances = []
        for nested in model.nested:
            if not nested.comes_first:
                self._scope = (nested.name,)
                instances += self._add(nested, names[id(nested)])
        self._add_world_elements(model, prefix)
        return instances

    def _add_included(self, model: ModelDescription, scope: tuple, full_name: str, names: dict) -> None:
        """Adds the models that come before all others, wherever they are nested."""
        full_name = names.get(id(model), full_name)
        if model.comes_first:
            self._scope = scope
            self._add(model, full_name)
            return
        for nested in model.nested:
            self._add_included(nested, (*scope, nested.name), f"{full_name}::{nested.name}", names)
        self._scope = ()

    def _add_world_elements(self, world: ModelDescription, prefix: str) -> None:
        """Adds the frames and joints that connect the models of a world."""
        self._scope, self._instance, self._joints = (), None, {}
        for element in world.elements:
            self._call(element, _ADDERS[type(element)], self, element)
        for group in world.filter_groups:
            self._filters.add(group, prefix, self._policy)

    def _model_name(self, model: ModelDescription, prefix: str) -> str:
        wanted = f"{prefix}::{model.name}" if prefix else model.name
        if not self._auto_rename and self._plant.HasModelInstanceNamed(wanted):
            self._policy.Error(
                model,
                f"The plant already has a model instance named '{wanted}'. Call parser.SetAutoRenaming(True), or give "
                "another name or model_name_prefix.",
            )
        return unused_name(self._plant, wanted)

    def _add(self, model: ModelDescription, full_name: str) -> list:
        instance = self._call(model, self._plant.AddModelInstance, full_name)
        instances = [instance]
        outer_scope = self._scope
        for nested in model.nested:
            if nested.comes_first:
                continue
            self._scope = (*outer_scope, nested.name)
            instances += self._add(nested, f"{full_name}::{nested.name}")
        self._scope, self._instance, self._joints = outer_scope, instance, {}
        among_elements = {id(element) for element in model.elements}
        for body in model.bodies:
            if id(body) not in among_elements:
                self._call(body, self._add_body, body)
        for element in model.elements:
            self._call(element, _ADDERS[type(element)], self, element)
        if model.gravity is not None:
            self._plant.mutable_gravity_field().set_gravity_vector(model.gravity)
        for body in model.bodies:
            self._set_default_pose(body)
        for group in model.filter_groups:
            self._filters.add(group, full_name, self._policy)
        for one, other in model.exclusions:
            self._filters.exclude_bodies(self._body(one), self._body(other))
        return instances

    def _call(self, description, function: Callable, *args):
        """Calls the plant; what it refuses is reported at the description's place."""
        try:
            return function(*args)
        except (ParseError, NotImplementedError):
            raise
        except (RuntimeError, ValueError, ArithmeticError) as error:
            self._policy.Error(description, str(error))

    def _add_body(self, description: BodyDescription) -> None:
        if description.is_world:
            body = self._plant.world_body()
        else:
            inertia = description.M_BBo_B
            if inertia is None:
                from sheldrake.multibody.tree import SpatialInertia

                inertia = SpatialInertia.Zero()
            body = self._plant.AddRigidBody(description.name, self._instance, copy.copy(inertia))
            self._frames[self._scope, description.name] = body.body_frame()
            if description.surface_velocity_axis is not None:
                self._call(description, self._plant.SetSurfaceVelocityAxis, body, description.surface_velocity_axis)
        if self._has_geometry:
            self._add_geometry(description, body)

    def _add_geometry(self, description: BodyDescription, body: RigidBody) -> None:
        if description.shapes is not None:
            self._geometry.register_again(body, description.shapes)
            return
        self._add_new_geometry(description, body)
        if not description.is_world and all(_own(v.perception) is v.perception for v in description.visuals):
            description.shapes = tuple(_shapes(description))

    def _add_new_geometry(self, description: BodyDescription, body: RigidBody) -> None:
        from sheldrake.geometry import GeometryInstance

        for geometry in description.geometries():
            if geometry.proximity is not None:
                self._check_mesh(geometry)
                self._call(
                    geometry,
                    self._plant.RegisterCollisionGeometry,
                    body,
                    geometry.X_BG,
                    geometry.shape,
                    geometry.name,
                    geometry.proximity,
                )
                continue
            instance = GeometryInstance(geometry.X_BG, geometry.shape, geometry.name)
            if geometry.illustration is not None:
                instance.set_illustration_properties(geometry.illustration)
            if geometry.perception is not None:
                instance.set_perception_properties(_own(geometry.perception))
            self._call(geometry, self._plant.RegisterVisualGeometry, body, instance)

    def _check_mesh(self, collision: GeometryDescription) -> None:
        """Refuses a mesh that could not be read when contacts are sought, where the message has no line."""
        from sheldrake.geometry import Convex, Mesh
        from sheldrake.geometry._meshes.mesh_files import SUPPORTED

        if isinstance(collision.shape, (Mesh, Convex)) and collision.shape.extension() not in SUPPORTED:
            file = collision.shape.source().description()
            known = ", ".join(SUPPORTED)
            self._policy.Error(
                collision, f"The collision mesh '{file}' has an unknown file type; those that can be read are {known}."
            )

    def _frame(self, reference: FrameReference) -> Any:
        if reference.is_world:
            return self._plant.world_frame()
        return self._frames[(*self._scope, *reference.scope), reference.name]

    def _body(self, reference: FrameReference):
        return self._frame(reference).body()

    def _add_frame(self, description: FrameDescription) -> None:
        from sheldrake.multibody.tree import FixedOffsetFrame

        base = self._frame(description.base)
        owner = self._instance if description.is_of_model else base.model_instance()
        frame = FixedOffsetFrame(description.name, base, copy.copy(description.X_PF), owner)
        self._frames[self._scope, description.name] = self._plant.AddFrame(frame)

    def _joint_frame(self, joint: JointDescription, reference: FrameReference, X, suffix: str):
        """The frame a joint attaches to: the body's own, or a new one at pose X in it."""
        from sheldrake.multibody.tree import FixedOffsetFrame

        frame = self._frame(reference)
        if X is None:
            return frame
        instance = self._frame(joint.child).model_instance()
        return self._plant.AddFrame(FixedOffsetFrame(f"{joint.name}_{suffix}", frame, X.__copy__(), instance))

    def _add_joint(self, description: JointDescription) -> None:
        frame_F = self._joint_frame(description, description.parent, description.X_PF, "parent")
        frame_M = self._joint_frame(description, description.child, description.X_CM, "child")
        model = description.model
        if model is None:
            model = description.model = _make_joint(description, frame_F, frame_M)._model()
        joint = self._plant.AddJoint(model._between(frame_F, frame_M))
        self._joints[description.name] = joint
        if description.spring is not None:
            stiffness, rest = description.spring
            self._plant.AddForceElement(_make_spring(joint, rest, stiffness))

    def _add_actuator(self, description: ActuatorDescription) -> None:
        joint = self._joints[description.joint]
        actuator = self._plant.AddJointActuator(description.name, joint, description.effort_limit)
        if description.rotor_inertia is not None:
            actuator.set_default_rotor_inertia(description.rotor_inertia)
        if description.gear_ratio is not None:
            actuator.set_default_gear_ratio(description.gear_ratio)
        if description.gains is not None:
            from sheldrake.multibody.tree import PdControllerGains

            p, d = description.gains
            actuator.set_controller_gains(PdControllerGains(p=p, d=d))

    def _add_coupler(self, description: CouplerDescription) -> None:
        if not _solver_takes_constraints(self._plant):
            self._policy.Warning(
                description,
                f"Joint '{description.joint}' mimics '{description.source}', but TAMSI takes no constraints; "
                "the tag is ignored. Use set_discrete_contact_approximation() with another one.",
            )
            return
        joint, source = self._joints[description.joint], self._joints[description.source]
        try:
            self._plant.AddCouplerConstraint(joint, source, description.ratio, description.offset)
        except RuntimeError as error:
            if self._plant.time_step() > 0.0:
                raise
            self._policy.Warning(
                description, f"Joint '{description.joint}' mimics '{description.source}'; the tag is ignored: {error}"
            )

    def _add_bushing(self, description: BushingDescription) -> None:
        from sheldrake.multibody.tree import LinearBushingRollPitchYaw  # type: ignore[attr-defined]

        self._plant.AddForceElement(
            LinearBushingRollPitchYaw(
                self._frame(description.frame_a),
                self._frame(description.frame_c),
                description.torque_stiffness,
                description.torque_damping,
                description.force_stiffness,
                description.force_damping,
            )
        )

    def _add_spring_damper(self, description: SpringDamperDescription) -> None:
        from sheldrake.multibody.tree import LinearSpringDamper

        self._plant.AddForceElement(
            LinearSpringDamper(
                self._body(description.body_a),
                description.p_AP,
                self._body(description.body_b),
                description.p_BQ,
                description.free_length,
                description.stiffness,
                description.damping,
            )
        )

    def _add_ball_constraint(self, description: BallConstraintDescription) -> None:
        body_a, body_b = self._body(description.body_a), self._body(description.body_b)
        self._plant.AddBallConstraint(body_a, description.p_AP, body_b, description.p_BQ)

    def _add_weld_constraint(self, description: WeldConstraintDescription) -> None:
        body_a, body_b = self._body(description.body_a), self._body(description.body_b)
        self._plant.AddWeldConstraint(body_a, description.X_AP, body_b, description.X_BQ)

    def _add_distance_constraint(self, description: DistanceConstraintDescription) -> None:
        self._plant.AddDistanceConstraint(
            self._body(description.body_a),
            description.p_AP,
            self._body(description.body_b),
            description.p_BQ,
            description.distance,
            description.stiffness,
            description.damping,
        )

    def _add_tendon(self, description: TendonDescription) -> None:
        self._plant.AddTendonConstraint(
            [self._joints[name] for name in description.joints],
            description.a,
            description.offset,
            description.lower,
            description.upper,
            description.stiffness,
            description.damping,
        )

    def _set_default_pose(self, body: BodyDescription) -> None:
        if body.default_pose is not None and not body.is_world:
            self._plant.SetDefaultFloatingBaseBodyPose(self._frames[self._scope, body.name].body(), body.default_pose)


_ADDERS: dict[type, Callable] = {
    BodyDescription: ModelBuilder._add_body,
    FrameDescription: ModelBuilder._add_frame,
    JointDescription: ModelBuilder._add_joint,
    ActuatorDescription: ModelBuilder._add_actuator,
    CouplerDescription: ModelBuilder._add_coupler,
    BushingDescription: ModelBuilder._add_bushing,
    SpringDamperDescription: ModelBuilder._add_spring_damper,
    BallConstraintDescription: ModelBuilder._add_ball_constraint,
    WeldConstraintDescription: ModelBuilder._add_weld_constraint,
    DistanceConstraintDescription: ModelBuilder._add_distance_constraint,
    TendonDescription: ModelBuilder._add_tendon,
}


def _shapes(description: BodyDescription):
    """The shapes of a body, with the roles that registering them gives them."""
    from sheldrake.geometry import Role
    from sheldrake.multibody.plant._building.geometry import BodyShape, default_visual_roles

    for geometry in description.geometries():
        roles = {
            Role.kProximity: geometry.proximity,
            Role.kIllustration: geometry.illustration,
            Role.kPerception: geometry.perception,
        }
        roles = {role: properties for role, properties in roles.items() if properties is not None}
        if not roles:
            roles = dict(zip((Role.kIllustration, Role.kPerception), default_visual_roles()))
        yield BodyShape(geometry.name, copy.copy(geometry.X_BG), geometry.shape, roles)


def _own(properties):
    """Properties for one plant alone: others may be built of the same description."""
    if properties is None or not properties.HasProperty("renderer", "accepting"):
        return properties  # copied by who is given them
    own = copy.copy(properties)
    own.UpdateProperty("renderer", "accepting", set(properties.GetProperty("renderer", "accepting")))
    return own


def _make_spring(joint, rest: float, stiffness: float):
    from sheldrake.multibody import tree

    return getattr(tree, joint._type.spring)(joint, rest, stiffness)


def _solver_takes_constraints(plant: MultibodyPlant) -> bool:
    from sheldrake.multibody.plant import DiscreteContactSolver

    return plant.time_step() == 0.0 or plant.get_discrete_contact_solver() != DiscreteContactSolver.kTamsi


def _make_joint(description: JointDescription, frame_F, frame_M):
    """The joint object of a description, of no plant yet."""
    from sheldrake.math import RigidTransform
    from sheldrake.multibody.tree import Joint

    given = {name: copy.copy(getattr(description, name)) for name in description.type.takes}
    if "X_FM" in given and given["X_FM"] is None:
        given["X_FM"] = RigidTransform()
    joint = Joint._classes[description.kind](description.name, frame_F, frame_M, **given)
    limits, one = description.limits, np.ones(joint.num_velocities())
    if joint._type.limited:
        joint.set_position_limits(limits.lower * one, limits.upper * one)
        joint.set_velocity_limits(-limits.velocity * one, limits.velocity * one)
        joint.set_acceleration_limits(-limits.acceleration * one, limits.acceleration * one)
    if description.friction > 0.0:
        joint.set_dry_friction(description.friction)
    if description.default_position is not None:
        joint.set_default_positions(np.atleast_1d(description.default_position))
    return joint
