"""Methods, ways to call them and names of arguments that Drake retired since 2021."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from .calls import CameraPoses
from .hints import hint

if TYPE_CHECKING:
    from sheldrake.geometry._shapes import Mesh
    from sheldrake.multibody.inverse_kinematics._inverse_kinematics import InverseKinematics
    from sheldrake.multibody.plant._multibody_plant import MultibodyPlant
    from sheldrake.planning._robot_diagram import RobotDiagramBuilder
    from sheldrake.systems.framework._context.context import Context
    from sheldrake.systems.framework._leaf_system import LeafSystem


def renamed(new: str, call: str, static: bool = False) -> Any:
    """A function for a class: warns that `call` is retired and calls the method `new` with the same arguments."""

    def method(self: Any, *args: Any, **kwargs: Any) -> Any:
        hint(f"{call}() is retired: use {new}().")
        return getattr(self, new)(*args, **kwargs)

    method.__doc__ = f"Retired: use `{new}`."
    return classmethod(method) if static else method


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


def _field(today: str, call: str) -> property:
    """A retired name of a field."""

    def get(self: Any) -> Any:
        hint(f"{call} is retired: use {today}.")
        return getattr(self, today)

    def set_(self: Any, value: Any) -> None:
        hint(f"{call} is retired: use {today}.")
        setattr(self, today, value)

    return property(get, set_, doc=f"Retired: use `{today}`.")


_DAMPED = ("RevoluteJoint", "PrismaticJoint", "ScrewJoint", "BallRpyJoint", "UniversalJoint")

METHODS: dict[str, dict[str, dict[str, Any]]] = {
    "sheldrake.systems.controllers": {
        "InverseDynamics": {
            "get_output_port_force": renamed(
                "get_output_port_generalized_force", "InverseDynamics.get_output_port_force"
            ),
        },
    },
    "sheldrake.systems.framework": {
        "Context": {"FixInputPort": _fix_input_port},
        "System": {
            "Publish": renamed("ForcedPublish", "System.Publish"),
            "CalcDiscreteVariableUpdates": renamed(
                "CalcForcedDiscreteVariableUpdate", "System.CalcDiscreteVariableUpdates"
            ),
            "CalcUnrestrictedUpdate": renamed("CalcForcedUnrestrictedUpdate", "System.CalcUnrestrictedUpdate"),
        },
        "LeafSystem": {
            "DeclarePeriodicPublish": _declare_periodic_publish,
            "DeclarePeriodicDiscreteUpdate": _declare_periodic_discrete_update,
        },
    },
    "sheldrake.systems.analysis": {
        "Simulator": {"StepTo": renamed("AdvanceTo", "Simulator.StepTo")},
    },
    "sheldrake.trajectories": {
        "PiecewisePolynomial": {
            "Cubic": renamed("CubicWithContinuousSecondDerivatives", "PiecewisePolynomial.Cubic", static=True),
            "Pchip": renamed("CubicShapePreserving", "PiecewisePolynomial.Pchip", static=True),
        },
        "PiecewisePose": {
            "get_pose": renamed("GetPose", "PiecewisePose.get_pose"),
            "get_velocity": renamed("GetVelocity", "PiecewisePose.get_velocity"),
            "get_acceleration": renamed("GetAcceleration", "PiecewisePose.get_acceleration"),
        },
    },
    "sheldrake.multibody.plant": {
        "MultibodyPlant": {
            "CalcCenterOfMassPosition": renamed(
                "CalcCenterOfMassPositionInWorld", "MultibodyPlant.CalcCenterOfMassPosition"
            ),
            "CalcBiasForJacobianSpatialVelocity": _bias("SpatialVelocity", "CalcBiasSpatialAcceleration"),
            "CalcBiasForJacobianTranslationalVelocity": _bias(
                "TranslationalVelocity", "CalcBiasTranslationalAcceleration"
            ),
            "set_discrete_contact_solver": _set_discrete_contact_solver,
            "get_continuous_state_output_port": renamed(
                "get_state_output_port", "MultibodyPlant.get_continuous_state_output_port"
            ),
            "get_geometry_poses_output_port": renamed(
                "get_geometry_pose_output_port", "MultibodyPlant.get_geometry_poses_output_port"
            ),
            "SetFreeBodyPoseInWorldFrame": renamed(
                "SetFloatingBaseBodyPoseInWorldFrame", "MultibodyPlant.SetFreeBodyPoseInWorldFrame"
            ),
            "SetFreeBodyPoseInAnchoredFrame": renamed(
                "SetFloatingBaseBodyPoseInAnchoredFrame", "MultibodyPlant.SetFreeBodyPoseInAnchoredFrame"
            ),
        },
    },
    "sheldrake.multibody.tree": {
        "RigidBody": {
            "get_default_mass": renamed("default_mass", "RigidBody.get_default_mass"),
            "floating_velocities_start": _floating_velocities_start,
        },
        **{name: {"damping": renamed("default_damping", f"{name}.damping")} for name in _DAMPED},
    },
    "sheldrake.geometry": {
        "SceneGraph": {
            "get_pose_bundle_output_port": renamed("get_query_output_port", "SceneGraph.get_pose_bundle_output_port"),
            "ExcludeCollisionsBetween": _exclude_collisions("Between"),
            "ExcludeCollisionsWithin": _exclude_collisions("Within"),
        },
        "QueryObject": {"X_WG": renamed("GetPoseInWorld", "QueryObject.X_WG")},
        **{name: {"filename": _filename} for name in ("Mesh", "Convex")},
        "SceneGraphInspector": {
            "all_frame_ids": renamed("GetAllFrameIds", "SceneGraphInspector.all_frame_ids"),
            "GetPoseInParent": renamed("GetPoseInFrame", "SceneGraphInspector.GetPoseInParent"),
        },
        "MeshcatVisualizerParams": {
            name: _field("delete_on_initialization_event", f"MeshcatVisualizerParams.{name}")
            for name in ("delete_prefix_on_initialization_event", "delete_prefix_initialization_event")
        },
    },
    "sheldrake.multibody.inverse_kinematics": {
        "InverseKinematics": {"AddMinimumDistanceConstraint": _add_minimum_distance},
        "DifferentialInverseKinematicsParameters": {
            "get_timestep": renamed("get_time_step", "DifferentialInverseKinematicsParameters.get_timestep"),
            "set_timestep": renamed("set_time_step", "DifferentialInverseKinematicsParameters.set_timestep"),
            "set_end_effector_velocity_gain": _set_end_effector_velocity_gain,
        },
    },
    "sheldrake.planning": {
        "MultipleShooting": {
            "timestep": renamed("time_step", "MultipleShooting.timestep"),
            "__getattr__": _of_its_program,
        },
        "RobotDiagramBuilder": {
            **{
                f"mutable_{part}": renamed(part, f"RobotDiagramBuilder.mutable_{part}")
                for part in ("builder", "parser", "plant", "scene_graph")
            },
            "IsPlantFinalized": _is_plant_finalized,
            "FinalizePlant": _finalize_plant,
            "BuildDiagram": renamed("Build", "RobotDiagramBuilder.BuildDiagram"),
        },
    },
    "sheldrake.systems.sensors": {
        "RgbdSensor": {
            "CameraPoses": CameraPoses,
            "color_camera_info": _camera_info("color"),
            "depth_camera_info": _camera_info("depth"),
            "color_render_camera": renamed("default_color_render_camera", "RgbdSensor.color_render_camera"),
            "depth_render_camera": renamed("default_depth_render_camera", "RgbdSensor.depth_render_camera"),
            "parent_frame_id": renamed("default_parent_frame_id", "RgbdSensor.parent_frame_id"),
            "X_PB": renamed("default_X_PB", "RgbdSensor.X_PB"),
            "X_WB_output_port": renamed("body_pose_in_world_output_port", "RgbdSensor.X_WB_output_port"),
        },
    },
}
"""Retired methods: module, class, name, function. A class gets those whose name it does not define itself."""
