"""Members that Drake retired since 2021: a table of each with what took its place."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from .calls import CameraPoses
from .hints import hint


class Now(NamedTuple):
    """What took the place of a method, where that is more than another name.

    Attributes:
        way: Today's way, for people.
        call: What the retired method does, of the object and its arguments.
    """

    way: str
    call: Callable[..., Any]


def _declare_periodic_publish(self: Any, period_sec: float, offset_sec: float = 0.0) -> None:
    self.DeclarePeriodicPublishEvent(period_sec, offset_sec, lambda context: None)  # DoPublish() is called anyway


def _declare_periodic_discrete_update(self: Any, period_sec: float, offset_sec: float = 0.0) -> None:
    self.DeclarePeriodicDiscreteUpdateEvent(period_sec, offset_sec, lambda context, discrete_state: None)


_PUBLISH = Now("DeclarePeriodicPublishEvent(period, offset, publish)", _declare_periodic_publish)
_UPDATE = Now("DeclarePeriodicDiscreteUpdateEvent(period, offset, update)", _declare_periodic_discrete_update)


def _set_discrete_contact_solver(self: Any, contact_solver: Any) -> None:
    from sheldrake.multibody.plant import DiscreteContactApproximation

    self.set_discrete_contact_approximation(DiscreteContactApproximation[contact_solver.name])


def _mutable_state(what: str) -> Now:
    """A part of a plant's state as a view of the context's memory."""

    def get(self: Any, context: Any) -> Any:
        nq = self.num_positions()
        chosen = {"Positions": slice(nq), "Velocities": slice(nq, None), "PositionsAndVelocities": slice(None)}
        of = "discrete" if self.is_discrete() else "continuous"
        return getattr(context, f"get_mutable_{of}_state_vector")().get_mutable_value()[chosen[what]]

    return Now(f"Set{what}()", get)


def _options_of_solver(self: Any, solver_id: Any) -> dict[str, Any]:
    from sheldrake.solvers import SolverType
    from sheldrake.solvers._ids import id_of_type

    options = self.solver_options() if hasattr(self, "solver_options") else self
    solver_id = id_of_type(solver_id) if isinstance(solver_id, SolverType) else solver_id
    return dict(options.options.get(solver_id.name(), {}))


def _common_solver_options(self: Any) -> dict[Any, Any]:
    from sheldrake.solvers import CommonSolverOption

    return {CommonSolverOption[name]: value for name, value in self.options.get("Drake", {}).items()}


def _common_option(option: str, kind: type | None) -> Now:
    """One of the common options, of a type; None where it is not set if there is no type."""

    def get(self: Any) -> Any:
        value = self.options.get("Drake", {}).get(option)
        return value if kind is None else kind() if value is None else kind(value)

    return Now('options["Drake"]', get)


def _projected(self: Any, x: Any) -> np.ndarray:
    found = self.Projection(x)
    assert found is not None
    return found[1].reshape(np.shape(x))


def _of_camera(kind: str, what: str) -> Now:
    """What the core of a sensor's default camera of a kind says."""

    def get(self: Any) -> Any:
        return getattr(getattr(self, f"default_{kind}_render_camera")().core(), what)()

    return Now(f"default_{kind}_render_camera().core().{what}()", get)


def _exclude_collisions(kind: str) -> Now:
    """Filters collisions within a set of geometries, or between two; maybe in a context."""

    def exclude(self: Any, *sets: Any) -> None:
        from sheldrake.geometry import CollisionFilterDeclaration

        count = 1 if kind == "Within" else 2
        manager = self.collision_filter_manager(*sets[:-count])
        manager.Apply(getattr(CollisionFilterDeclaration(), f"Exclude{kind}")(*sets[-count:]))

    return Now("collision_filter_manager().Apply()", exclude)


def _add_minimum_distance(self: Any, minimum_distance: float, threshold_distance: float = 1.0) -> Any:
    return self.AddMinimumDistanceLowerBoundConstraint(minimum_distance, threshold_distance)


def _filename(self: Any) -> str:
    return str(self.source().path()) if self.source().is_path() else ""


def _bias(today: str) -> Now:
    """The bias term of a Jacobian of velocities, Jdot v."""

    def calc(
        self: Any, context: Any, with_respect_to: Any, frame_F: Any, p_FoBi_F: Any, frame_A: Any, frame_E: Any
    ) -> Any:
        return getattr(self, today)(context, with_respect_to, frame_F, p_FoBi_F, frame_A, frame_E)

    return Now(f"{today}()", calc)


def _set_limit_of_unconstrained(self: Any, limit: float) -> None:
    self._limit_of_unconstrained = float(limit)  # of no effect, as in Drake since 2022


def _of_its_program(self: Any, name: str) -> Any:
    """What was a method of this when it was itself a MathematicalProgram."""
    from sheldrake.solvers import MathematicalProgram

    if name.startswith("_") or not hasattr(MathematicalProgram, name):
        raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
    hint(f"{type(self).__name__}.{name}() is retired: use prog().{name}().")
    return getattr(self.prog(), name)


def _no_default_label(params: str) -> property:
    """The label of geometry without one, which parameters of renderers had: geometry says its own now."""

    def get(self: Any) -> Any:
        from sheldrake.geometry import RenderLabel

        hint(f"{params}.default_label is retired: geometry without a label is kDontCare.")
        return RenderLabel.kDontCare

    def set_(self: Any, value: Any) -> None:
        hint(f"{params}.default_label is retired and of no effect: give geometry its ('label', 'id').")

    return property(get, set_, doc="Retired: give geometry its label.")


_CENTERING = "set_joint_centering_gain(); this is of no effect"
_DAMPED = ("RevoluteJoint", "PrismaticJoint", "ScrewJoint", "BallRpyJoint", "UniversalJoint", "PlanarJoint")
_FLOATING = {
    "SetFromRotationMatrix": "SetOrientation",
    "angular_damping": "default_angular_damping",
    "get_default_pose": "GetDefaultPose",
    "get_default_position": "get_default_translation",
    "get_pose": "GetPose",
    "get_position": "get_translation",
    "set_default_position": "set_default_translation",
    "set_pose": "SetPose",
    "set_position": "SetTranslation",
    "set_quaternion": "SetQuaternion",
    "set_random_position_distribution": "set_random_translation_distribution",
    "translational_damping": "default_translational_damping",
}
"""Methods of QuaternionFloatingJoint until 2025, and today's."""


METHODS: dict[str, dict[str, dict[str, Any]]] = {
    "sheldrake.examples": {
        "AcrobotPlant": {"SetMITAcrobotParameters": "SetMitAcrobotParameters"},
    },
    "sheldrake.geometry.optimization": {
        "AffineSubspace": {"Project": Now("Projection(), which gives distances too", _projected)},
        "GraphOfConvexSetsOptions": {
            "rounding_solver_options": "restriction_solver_options",
        },
        "Hyperellipsoid": {"Volume": "CalcVolume"},
    },
    "sheldrake.math": {
        "RigidTransform": {"IsIdentityToEpsilon": "IsNearlyIdentity"},
        "RotationMatrix": {"IsIdentityToInternalTolerance": "IsNearlyIdentity"},
    },
    "sheldrake.solvers": {
        "LinearConstraint": {"A": "GetDenseA"},
        "L2NormCost": {"A": "GetDenseA"},
        "MathematicalProgram": {
            "GetSolverOptions": Now("SolverOptions.options", _options_of_solver),
            "AddMaximizeLogDeterminantSymmetricMatrixCost": "AddMaximizeLogDeterminantCost",
            "NewNonnegativePolynomial": "NewSosPolynomial",
        },
        "SolverOptions": {
            "GetOptions": Now("options", _options_of_solver),
            "common_solver_options": Now('options["Drake"]', _common_solver_options),
            "get_max_threads": _common_option("kMaxThreads", None),
            "get_print_file_name": _common_option("kPrintFileName", str),
            "get_print_to_console": _common_option("kPrintToConsole", bool),
            "get_standalone_reproduction_file_name": _common_option("kStandaloneReproductionFileName", str),
        },
    },
    "sheldrake.systems.controllers": {
        "JointStiffnessController": {"get_output_port_generalized_force": "get_output_port_actuation"},
        "InverseDynamics": {
            "get_output_port_force": "get_output_port_generalized_force",
        },
    },
    "sheldrake.systems.framework": {
        "Context": {
            "FixInputPort": Now(
                "system.get_input_port(index).FixValue(context, value)",
                lambda self, index, data: self._system.get_input_port(index).FixValue(self, data),
            )
        },
        "System": {
            "Publish": "ForcedPublish",
            "CalcDiscreteVariableUpdates": "CalcForcedDiscreteVariableUpdate",
            "CalcUnrestrictedUpdate": "CalcForcedUnrestrictedUpdate",
        },
        "LeafSystem": {
            "DeclarePeriodicPublish": _PUBLISH,
            "DeclarePeriodicDiscreteUpdate": _UPDATE,
            "DeclarePeriodicPublishNoHandler": _PUBLISH,
            "DeclarePeriodicDiscreteUpdateNoHandler": _UPDATE,
        },
    },
    "sheldrake.systems.analysis": {
        "Simulator": {"StepTo": "AdvanceTo"},
    },
    "sheldrake.trajectories": {
        "PiecewisePolynomial": {
            "Cubic": "CubicWithContinuousSecondDerivatives",
            "Pchip": "CubicShapePreserving",
        },
        "PiecewisePose": {
            "get_pose": "GetPose",
            "get_velocity": "GetVelocity",
            "get_acceleration": "GetAcceleration",
        },
    },
    "sheldrake.multibody.plant": {
        "MultibodyPlant": {
            "CalcCenterOfMassPosition": "CalcCenterOfMassPositionInWorld",
            "CalcBiasForJacobianSpatialVelocity": _bias("CalcBiasSpatialAcceleration"),
            "CalcBiasForJacobianTranslationalVelocity": _bias("CalcBiasTranslationalAcceleration"),
            **{
                f"GetMutable{what}": _mutable_state(what)
                for what in ("Positions", "Velocities", "PositionsAndVelocities")
            },
            "set_discrete_contact_solver": Now("set_discrete_contact_approximation()", _set_discrete_contact_solver),
            "get_continuous_state_output_port": "get_state_output_port",
            "get_geometry_poses_output_port": "get_geometry_pose_output_port",
            "SetFreeBodyPoseInWorldFrame": "SetFloatingBaseBodyPoseInWorldFrame",
            "SetFreeBodyPoseInAnchoredFrame": "SetFloatingBaseBodyPoseInAnchoredFrame",
        },
        "MultibodyPlantConfig": {
            "discrete_contact_solver": "discrete_contact_approximation",
        },
    },
    "sheldrake.multibody.tree": {
        "RigidBody": {
            "get_default_mass": "default_mass",
            "floating_velocities_start": Now(
                "floating_velocities_start_in_v()",  # which does not count positions
                lambda self: self.GetParentPlant().num_positions() + self.floating_velocities_start_in_v(),
            ),
        },
        **{name: {"damping": "default_damping"} for name in _DAMPED},
        "FixedOffsetFrame": {"SetPoseInBodyFrame": "SetPoseInParentFrame"},
        "QuaternionFloatingJoint": _FLOATING,
        "RevoluteSpring": {"stiffness": "default_stiffness", "nominal_angle": "default_nominal_angle"},
        "WeldJoint": {"X_PC": "X_FM"},
    },
    "sheldrake.geometry": {
        "SceneGraph": {
            "get_pose_bundle_output_port": "get_query_output_port",
            "ExcludeCollisionsBetween": _exclude_collisions("Between"),
            "ExcludeCollisionsWithin": _exclude_collisions("Within"),
        },
        "QueryObject": {"X_WG": "GetPoseInWorld"},
        **{name: {"filename": Now("source().path()", _filename)} for name in ("Mesh", "Convex")},
        **{
            name: {"default_label": _no_default_label(name)}
            for name in ("RenderEngineGlParams", "RenderEngineGltfClientParams", "RenderEngineVtkParams")
        },
        "SceneGraphInspector": {
            "all_frame_ids": "GetAllFrameIds",
            "GetPoseInParent": "GetPoseInFrame",
        },
        "MeshcatVisualizerParams": {
            name: "delete_on_initialization_event"
            for name in ("delete_prefix_on_initialization_event", "delete_prefix_initialization_event")
        },
    },
    "sheldrake.multibody.inverse_kinematics": {
        "InverseKinematics": {
            "AddMinimumDistanceConstraint": Now("AddMinimumDistanceLowerBoundConstraint()", _add_minimum_distance)
        },
        "DifferentialInverseKinematicsParameters": {
            "get_timestep": "get_time_step",
            "get_unconstrained_degrees_of_freedom_velocity_limit": Now(
                _CENTERING, lambda self: getattr(self, "_limit_of_unconstrained", None)
            ),
            "set_unconstrained_degrees_of_freedom_velocity_limit": Now(_CENTERING, _set_limit_of_unconstrained),
            "set_timestep": "set_time_step",
            "get_end_effector_velocity_gain": Now(
                "get_end_effector_velocity_flag()",
                lambda self: np.array(self.get_end_effector_velocity_flag(), dtype=float),
            ),
            "set_end_effector_velocity_gain": Now(
                "set_end_effector_velocity_flag()",
                lambda self, gain_E: self.set_end_effector_velocity_flag([bool(gain) for gain in gain_E]),
            ),
        },
    },
    "sheldrake.planning": {
        "GcsTrajectoryOptimization": {
            "UnwrapToContinousTrajectory": "UnwrapToContinuousTrajectory",
        },
        "MultipleShooting": {
            "fixed_timestep": "fixed_time_step",
            "timestep": "time_step",
            "__getattr__": _of_its_program,
        },
        "RobotDiagramBuilder": {
            **{f"mutable_{part}": part for part in ("builder", "parser", "plant", "scene_graph")},
            "IsPlantFinalized": Now("plant().is_finalized()", lambda self: self.plant().is_finalized()),
            "FinalizePlant": Now("plant().Finalize()", lambda self: self.plant().Finalize()),
            "BuildDiagram": "Build",
        },
    },
    "sheldrake.systems.sensors": {
        "RgbdSensor": {
            "CameraPoses": CameraPoses,
            "X_BC": _of_camera("color", "sensor_pose_in_camera_body"),
            "X_BD": _of_camera("depth", "sensor_pose_in_camera_body"),
            "color_camera_info": _of_camera("color", "intrinsics"),
            "depth_camera_info": _of_camera("depth", "intrinsics"),
            "color_render_camera": "default_color_render_camera",
            "depth_render_camera": "default_depth_render_camera",
            "parent_frame_id": "default_parent_frame_id",
            "X_PB": "default_X_PB",
            "X_WB_output_port": "body_pose_in_world_output_port",
        },
        "RgbdSensorAsync": {
            "X_PB": "default_X_PB",
            "color_camera": "default_color_render_camera",
            "depth_camera": "default_depth_render_camera",
            "parent_id": "default_parent_frame_id",
        },
    },
}
"""Retired members: module, class, name, and what took its place: today's name, a `Now`, or what is put there as it is.

A class gets those whose name it does not define itself.
"""
