"""Methods, ways to call them and names of arguments that Drake retired since 2021."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from .calls import CameraPoses
from .hints import hint

if TYPE_CHECKING:
    from sheldrake.geometry._shapes import Mesh
    from sheldrake.geometry.optimization import AffineSubspace
    from sheldrake.multibody.inverse_kinematics._inverse_kinematics import InverseKinematics
    from sheldrake.multibody.plant._multibody_plant import MultibodyPlant
    from sheldrake.planning._robot_diagram import RobotDiagramBuilder
    from sheldrake.solvers import SolverOptions
    from sheldrake.systems.framework._context.context import Context
    from sheldrake.systems.framework._leaf_system import LeafSystem


def _declare_periodic_publish(self: LeafSystem, period_sec: float, offset_sec: float = 0.0) -> None:
    """Retired: use `DeclarePeriodicPublishEvent`. Calls the override `DoPublish(context, events)`."""
    hint("DeclarePeriodicPublish() is retired: use DeclarePeriodicPublishEvent(period, offset, publish).")
    self.DeclarePeriodicPublishEvent(period_sec, offset_sec, lambda context: None)  # DoPublish() is called anyway


def _declare_periodic_discrete_update(self: LeafSystem, period_sec: float, offset_sec: float = 0.0) -> None:
    """Retired: use `DeclarePeriodicDiscreteUpdateEvent`. Calls the override `DoCalcDiscreteVariableUpdates`."""
    hint("DeclarePeriodicDiscreteUpdate() is retired: use DeclarePeriodicDiscreteUpdateEvent(period, offset, update).")
    self.DeclarePeriodicDiscreteUpdateEvent(period_sec, offset_sec, lambda context, discrete_state: None)


def _set_discrete_contact_solver(self: MultibodyPlant, contact_solver: Any) -> None:
    """Retired: use `set_discrete_contact_approximation`. TAMSI or SAP, by the solver's name."""
    from sheldrake.multibody.plant import DiscreteContactApproximation

    hint("MultibodyPlant.set_discrete_contact_solver() is retired: use set_discrete_contact_approximation().")
    self.set_discrete_contact_approximation(DiscreteContactApproximation[contact_solver.name])


def _camera_info(kind: str) -> Callable:
    """A method of RgbdSensor that gives the lens of its camera of a kind."""

    def info(self: Any) -> Any:
        hint(f"RgbdSensor.{kind}_camera_info() is retired: use default_{kind}_render_camera().core().intrinsics().")
        return getattr(self, f"default_{kind}_render_camera")().core().intrinsics()

    info.__doc__ = f"Retired: use `default_{kind}_render_camera().core().intrinsics()`."
    return info


def _mutable_state(what: str) -> Callable:
    """A method of MultibodyPlant that gives a part of the state as an array that may be written."""

    def get(self: MultibodyPlant, context: Context) -> Any:
        hint(f"MultibodyPlant.GetMutable{what}() is retired: use Set{what}().")
        if self.is_discrete():
            state: Any = context.get_mutable_discrete_state_vector()
        else:
            state = context.get_mutable_continuous_state_vector()
        nq = self.num_positions()
        chosen = {"Positions": slice(nq), "Velocities": slice(nq, None), "PositionsAndVelocities": slice(None)}
        return state.get_mutable_value()[chosen[what]]

    get.__doc__ = f"Retired: use `Set{what}`. A view of the context's memory."
    return get


def _options_of_solver(self: Any, solver_id: Any) -> dict[str, Any]:
    """Retired: use `SolverOptions.options`. What is set for one solver, by name."""
    from sheldrake.solvers import SolverType
    from sheldrake.solvers._ids import id_of_type

    hint("GetSolverOptions() and GetOptions() are retired: use SolverOptions.options.")
    options = self.solver_options() if hasattr(self, "solver_options") else self
    solver_id = id_of_type(solver_id) if isinstance(solver_id, SolverType) else solver_id
    return dict(options.options.get(solver_id.name(), {}))


def _common_solver_options(self: SolverOptions) -> dict[Any, Any]:
    """Retired: use `options["Drake"]`. What is set for all solvers, by option."""
    from sheldrake.solvers import CommonSolverOption

    hint('SolverOptions.common_solver_options() is retired: use options["Drake"].')
    return {CommonSolverOption[name]: value for name, value in self.options.get("Drake", {}).items()}


def _common_option(call: str, option: str, kind: type | None) -> Callable:
    """A method of SolverOptions that gives one of them, of a type; None where it is not set if there is no type."""

    def get(self: SolverOptions) -> Any:
        hint(f'SolverOptions.{call}() is retired: use options["Drake"].')
        value = self.options.get("Drake", {}).get(option)
        return value if kind is None else kind() if value is None else kind(value)

    get.__doc__ = f'Retired: use `options["Drake"]`. What `{option}` is.'
    return get


def _projected(self: AffineSubspace, x: Any) -> np.ndarray:
    """Retired: use `Projection`. The nearest points of the subspace, in the shape of `x`."""
    hint("AffineSubspace.Project() is retired: use Projection(), which gives distances too.")
    found = self.Projection(x)
    assert found is not None
    return found[1].reshape(np.shape(x))


_UNCONSTRAINED = (
    "DifferentialInverseKinematicsParameters.{}_unconstrained_degrees_of_freedom_velocity_limit() is retired and of no "
    "effect: use set_joint_centering_gain()."
)


def _set_limit_of_unconstrained(self: Any, limit: float) -> None:
    """Retired: of no effect, as in Drake since 2022."""
    self._limit_of_unconstrained = float(limit)
    hint(_UNCONSTRAINED.format("set"))


def _get_limit_of_unconstrained(self: Any) -> float | None:
    """Retired: what was set last, which is of no effect; None if nothing was."""
    hint(_UNCONSTRAINED.format("get"))
    return getattr(self, "_limit_of_unconstrained", None)


def _sensor_pose(kind: str) -> Callable:
    """A method of RgbdSensor that gives where a camera is in the sensor's body."""

    def pose(self: Any) -> Any:
        hint(f"RgbdSensor: use default_{kind}_render_camera().core().sensor_pose_in_camera_body().")
        return getattr(self, f"default_{kind}_render_camera")().core().sensor_pose_in_camera_body()

    pose.__doc__ = f"Retired: use `default_{kind}_render_camera().core().sensor_pose_in_camera_body()`."
    return pose


def _get_end_effector_velocity_gain(self: Any) -> np.ndarray:
    """Retired: use `get_end_effector_velocity_flag`. One for each direction that is controlled, shape (6,)."""
    hint("DifferentialInverseKinematicsParameters: gains are retired: use get_end_effector_velocity_flag().")
    return np.array(self.get_end_effector_velocity_flag(), dtype=float)


def _fix_input_port(self: Context, index: int, data: Any) -> Any:
    """Retired: use `InputPort.FixValue`."""
    hint("Context.FixInputPort() is retired: use system.get_input_port(index).FixValue(context, value).")
    return self._system.get_input_port(index).FixValue(self, data)


def _exclude_collisions(kind: str) -> Callable:
    """A method of SceneGraph that filters collisions within a set of geometries, or between two."""

    def exclude(self: Any, *sets: Any) -> None:
        from sheldrake.geometry import CollisionFilterDeclaration

        hint(f"SceneGraph.ExcludeCollisions{kind}() is retired: use collision_filter_manager().Apply().")
        context = sets[0] if len(sets) > (1 if kind == "Within" else 2) else None
        manager = self.collision_filter_manager(*(() if context is None else (context,)))
        chosen = sets if context is None else sets[1:]
        manager.Apply(getattr(CollisionFilterDeclaration(), f"Exclude{kind}")(*chosen))

    exclude.__doc__ = "Retired: use `collision_filter_manager().Apply()`."
    return exclude


def _add_minimum_distance(self: InverseKinematics, minimum_distance: float, threshold_distance: float = 1.0) -> Any:
    """Retired: use `AddMinimumDistanceLowerBoundConstraint`."""
    hint("InverseKinematics.AddMinimumDistanceConstraint() is retired: use AddMinimumDistanceLowerBoundConstraint().")
    return self.AddMinimumDistanceLowerBoundConstraint(minimum_distance, threshold_distance)


def _floating_velocities_start(self: Any) -> int:
    """Retired: use `floating_velocities_start_in_v`. The index among positions and velocities."""
    hint("RigidBody.floating_velocities_start() is retired: use floating_velocities_start_in_v().")
    return self.GetParentPlant().num_positions() + self.floating_velocities_start_in_v()


def _filename(self: Mesh) -> str:
    """Retired: use `source().path()`. The file of a mesh; empty for one in memory."""
    hint(f"{type(self).__name__}.filename() is retired: use source().path().")
    return str(self.source().path()) if self.source().is_path() else ""


def _is_plant_finalized(self: RobotDiagramBuilder) -> bool:
    """Retired: use `plant().is_finalized()`."""
    hint("RobotDiagramBuilder.IsPlantFinalized() is retired: use plant().is_finalized().")
    return self.plant().is_finalized()


def _finalize_plant(self: RobotDiagramBuilder) -> None:
    """Retired: use `plant().Finalize()`."""
    hint("RobotDiagramBuilder.FinalizePlant() is retired: use plant().Finalize().")
    self.plant().Finalize()


def _bias(of: str, today: str) -> Callable:
    """A method of MultibodyPlant that gives the bias term of a Jacobian of velocities, Jdot v."""

    def calc(
        self: Any, context: Any, with_respect_to: Any, frame_F: Any, p_FoBi_F: Any, frame_A: Any, frame_E: Any
    ) -> Any:
        hint(f"MultibodyPlant.CalcBiasForJacobian{of}() is retired: use {today}().")
        return getattr(self, today)(context, with_respect_to, frame_F, p_FoBi_F, frame_A, frame_E)

    calc.__doc__ = f"Retired: use `{today}`."
    return calc


def _set_end_effector_velocity_gain(self: Any, gain_E: Any) -> None:
    """Retired: use `set_end_effector_velocity_flag`. Directions whose gain is not zero are controlled."""
    hint("DifferentialInverseKinematicsParameters: gains are retired: use set_end_effector_velocity_flag().")
    self.set_end_effector_velocity_flag([bool(gain) for gain in gain_E])


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
        "AffineSubspace": {"Project": _projected},
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
            "GetSolverOptions": _options_of_solver,
            "AddMaximizeLogDeterminantSymmetricMatrixCost": "AddMaximizeLogDeterminantCost",
            "NewNonnegativePolynomial": "NewSosPolynomial",
        },
        "SolverOptions": {
            "GetOptions": _options_of_solver,
            "common_solver_options": _common_solver_options,
            "get_max_threads": _common_option("get_max_threads", "kMaxThreads", None),
            "get_print_file_name": _common_option("get_print_file_name", "kPrintFileName", str),
            "get_print_to_console": _common_option("get_print_to_console", "kPrintToConsole", bool),
            "get_standalone_reproduction_file_name": _common_option(
                "get_standalone_reproduction_file_name", "kStandaloneReproductionFileName", str
            ),
        },
    },
    "sheldrake.systems.controllers": {
        "JointStiffnessController": {"get_output_port_generalized_force": "get_output_port_actuation"},
        "InverseDynamics": {
            "get_output_port_force": "get_output_port_generalized_force",
        },
    },
    "sheldrake.systems.framework": {
        "Context": {"FixInputPort": _fix_input_port},
        "System": {
            "Publish": "ForcedPublish",
            "CalcDiscreteVariableUpdates": "CalcForcedDiscreteVariableUpdate",
            "CalcUnrestrictedUpdate": "CalcForcedUnrestrictedUpdate",
        },
        "LeafSystem": {
            "DeclarePeriodicPublish": _declare_periodic_publish,
            "DeclarePeriodicDiscreteUpdate": _declare_periodic_discrete_update,
            "DeclarePeriodicPublishNoHandler": _declare_periodic_publish,
            "DeclarePeriodicDiscreteUpdateNoHandler": _declare_periodic_discrete_update,
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
            "CalcBiasForJacobianSpatialVelocity": _bias("SpatialVelocity", "CalcBiasSpatialAcceleration"),
            "CalcBiasForJacobianTranslationalVelocity": _bias(
                "TranslationalVelocity", "CalcBiasTranslationalAcceleration"
            ),
            **{
                f"GetMutable{what}": _mutable_state(what)
                for what in ("Positions", "Velocities", "PositionsAndVelocities")
            },
            "set_discrete_contact_solver": _set_discrete_contact_solver,
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
            "floating_velocities_start": _floating_velocities_start,
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
        **{name: {"filename": _filename} for name in ("Mesh", "Convex")},
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
        "InverseKinematics": {"AddMinimumDistanceConstraint": _add_minimum_distance},
        "DifferentialInverseKinematicsParameters": {
            "get_timestep": "get_time_step",
            "get_unconstrained_degrees_of_freedom_velocity_limit": _get_limit_of_unconstrained,
            "set_unconstrained_degrees_of_freedom_velocity_limit": _set_limit_of_unconstrained,
            "set_timestep": "set_time_step",
            "get_end_effector_velocity_gain": _get_end_effector_velocity_gain,
            "set_end_effector_velocity_gain": _set_end_effector_velocity_gain,
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
            "IsPlantFinalized": _is_plant_finalized,
            "FinalizePlant": _finalize_plant,
            "BuildDiagram": "Build",
        },
    },
    "sheldrake.systems.sensors": {
        "RgbdSensor": {
            "CameraPoses": CameraPoses,
            "X_BC": _sensor_pose("color"),
            "X_BD": _sensor_pose("depth"),
            "color_camera_info": _camera_info("color"),
            "depth_camera_info": _camera_info("depth"),
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
"""Retired members: module, class, name, and what took its place, today's name or a function.

A class gets those whose name it does not define itself.
"""
