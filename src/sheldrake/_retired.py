"""Names that Drake retired since 2021, each with the one that took its place.

They work, with one warning (`DrakeDeprecationWarning`) that names today's way. `sheldrake.all` and the pydrake alias
add them to the modules and classes they were found in; nothing here is imported by the library itself.
"""

from __future__ import annotations

import functools
import importlib
from collections.abc import Callable
from types import ModuleType
from typing import Any, NamedTuple

from sheldrake._retired_functions import FUNCTIONS, hint


class Module(NamedTuple):
    """A module that Drake folded into others: `names` maps each of its names to `(module, name)` of today's."""

    replacement: str
    names: dict[str, tuple[str, str]]

    def make(self, fullname: str) -> ModuleType:
        """Makes the retired module. Names it had that sheldrake lacks are found missing when they are asked for."""
        module = ModuleType(fullname, f"Retired: use {self.replacement}.")
        vars(module)["__path__"] = []

        def __getattr__(name: str) -> Any:
            where, today = self.names.get(name, (self.replacement, name))
            if name.startswith("__"):
                raise AttributeError(f"module {fullname!r} has no attribute {name!r}")
            return getattr(importlib.import_module(where), today)

        vars(module)["__getattr__"] = __getattr__
        vars(module)["__all__"] = _existing(self.replacement, self.names)
        today = self.replacement.partition("._")[0].replace("sheldrake", "pydrake", 1)
        hint(f"{fullname} is retired: import from {today}.")
        return module


def _existing(replacement: str, names: dict[str, tuple[str, str]]) -> list[str]:
    if names:
        return list(names)
    module = importlib.import_module(replacement)
    return list(getattr(module, "__all__", [n for n in vars(module) if not n.startswith("_")]))


def _folded(replacement: str, *names: str) -> Module:
    return Module(replacement, {name: (replacement, name) for name in names})


_SOLVER_MODULES = (
    "augmented_lagrangian branch_and_bound clarabel clp csdp gurobi ipopt mathematicalprogram "
    "mixed_integer_optimization_util mixed_integer_rotation_constraint mosek nlopt osqp scs sdpa_free_format snopt"
).split()
_PLANNING_MODULES = "common_robotics_utilities robot_diagram trajectory_optimization".split()
_EXAMPLE_MODULES = "acrobot compass_gait pendulum quadrotor rimless_wheel van_der_pol".split()

MODULES: dict[str, Module] = {
    **{f"pydrake.solvers.{name}": _folded("sheldrake.solvers") for name in _SOLVER_MODULES},
    **{f"pydrake.examples.{name}": _folded("sheldrake.examples") for name in _EXAMPLE_MODULES},
    **{f"pydrake.planning.{name}": _folded("sheldrake.planning") for name in _PLANNING_MODULES},
    **{
        f"pydrake.manipulation.{name}": _folded("sheldrake.manipulation")
        for name in ("kuka_iiwa", "schunk_wsg", "util")
    },
    "pydrake.manipulation.planner": _folded("sheldrake.multibody.inverse_kinematics"),
    "pydrake.systems.trajectory_optimization": _folded("sheldrake.planning"),
    "pydrake.geometry.render": _folded("sheldrake.geometry"),
    "pydrake.systems.meshcat_visualizer": _folded("sheldrake.visualization._legacy_meshcat"),
}
"""Retired modules by their pydrake names."""

GONE = {
    "pydrake.attic": "RigidBodyTree and what stood on it; use pydrake.multibody.plant",
    "pydrake.multibody.rigid_body_tree": "RigidBodyTree; use pydrake.multibody.plant",
    "pydrake.examples.manipulation_station": "ManipulationStation; use "
    "pydrake.multibody.parsing.ProcessModelDirectives and the drivers of pydrake.manipulation",
    "pydrake.manipulation.simple_ui": "windows of Tk; use pydrake.multibody.meshcat.JointSliders",
}
"""Modules that Drake removed for good: what they held, and what to use."""


def renamed(new: str, call: str, static: bool = False) -> Any:
    """A function for a class: warns that `call` is retired and calls the method `new` with the same arguments."""

    def method(self: Any, *args: Any, **kwargs: Any) -> Any:
        hint(f"{call}() is retired: use {new}().")
        return getattr(self, new)(*args, **kwargs)

    method.__doc__ = f"Retired: use `{new}`."
    return classmethod(method) if static else method


def _declare_periodic_publish(self: Any, period_sec: float, offset_sec: float = 0.0) -> None:
    """Retired: use `DeclarePeriodicPublishEvent`. Calls the override `DoPublish(context, events)`."""
    hint("DeclarePeriodicPublish() is retired: use DeclarePeriodicPublishEvent(period, offset, publish).")
    self.DeclarePeriodicPublishEvent(period_sec, offset_sec, lambda context: self.DoPublish(context, []))


def _declare_periodic_discrete_update(self: Any, period_sec: float, offset_sec: float = 0.0) -> None:
    """Retired: use `DeclarePeriodicDiscreteUpdateEvent`. Calls the override `DoCalcDiscreteVariableUpdates`."""
    hint("DeclarePeriodicDiscreteUpdate() is retired: use DeclarePeriodicDiscreteUpdateEvent(period, offset, update).")

    def update(context: Any, discrete_state: Any) -> None:
        self.DoCalcDiscreteVariableUpdates(context, [], discrete_state)

    self.DeclarePeriodicDiscreteUpdateEvent(period_sec, offset_sec, update)


def _set_discrete_contact_solver(self: Any, contact_solver: Any) -> None:
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


def _fix_input_port(self: Any, index: int, data: Any) -> Any:
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


def _add_minimum_distance(self: Any, minimum_distance: float, threshold_distance: float = 1.0) -> Any:
    """Retired: use `AddMinimumDistanceLowerBoundConstraint`."""
    hint("InverseKinematics.AddMinimumDistanceConstraint() is retired: use AddMinimumDistanceLowerBoundConstraint().")
    return self.AddMinimumDistanceLowerBoundConstraint(minimum_distance, threshold_distance)


_DAMPED = ("RevoluteJoint", "PrismaticJoint", "ScrewJoint", "BallRpyJoint", "UniversalJoint")

METHODS: dict[str, dict[str, dict[str, Any]]] = {
    "sheldrake.systems.framework": {
        "Context": {"FixInputPort": _fix_input_port},
        "System": {"Publish": renamed("ForcedPublish", "System.Publish")},
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
    },
    "sheldrake.multibody.plant": {
        "MultibodyPlant": {
            "CalcCenterOfMassPosition": renamed(
                "CalcCenterOfMassPositionInWorld", "MultibodyPlant.CalcCenterOfMassPosition"
            ),
            "set_discrete_contact_solver": _set_discrete_contact_solver,
            "get_continuous_state_output_port": renamed(
                "get_state_output_port", "MultibodyPlant.get_continuous_state_output_port"
            ),
            "get_geometry_poses_output_port": renamed(
                "get_geometry_pose_output_port", "MultibodyPlant.get_geometry_poses_output_port"
            ),
        },
    },
    "sheldrake.multibody.tree": {
        "RigidBody": {
            "get_default_mass": renamed("default_mass", "RigidBody.get_default_mass"),
            "floating_velocities_start": renamed(
                "floating_velocities_start_in_v", "RigidBody.floating_velocities_start"
            ),
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
    },
    "sheldrake.multibody.inverse_kinematics": {
        "InverseKinematics": {"AddMinimumDistanceConstraint": _add_minimum_distance},
    },
    "sheldrake.planning": {
        "MultipleShooting": {"timestep": renamed("time_step", "MultipleShooting.timestep")},
    },
    "sheldrake.systems.sensors": {
        "RgbdSensor": {
            "color_camera_info": _camera_info("color"),
            "depth_camera_info": _camera_info("depth"),
            "color_render_camera": renamed("default_color_render_camera", "RgbdSensor.color_render_camera"),
            "depth_render_camera": renamed("default_depth_render_camera", "RgbdSensor.depth_render_camera"),
            "parent_frame_id": renamed("default_parent_frame_id", "RgbdSensor.parent_frame_id"),
            "X_PB": renamed("default_X_PB", "RgbdSensor.X_PB"),
        },
    },
}
"""Retired methods: module, class, name, function. A class gets those whose name it does not define itself."""

_WELD = {
    **dict.fromkeys(("A", "frame_on_parent_P", "parent_frame_P"), "frame_on_parent_F"),
    **dict.fromkeys(("B", "frame_on_child_C", "child_frame_C"), "frame_on_child_M"),
    **dict.fromkeys(("X_AB", "X_PC"), "X_FM"),
}
KEYWORDS: dict[str, dict[str, dict[str, dict[str, str]]]] = {
    "sheldrake.multibody.plant": {"MultibodyPlant": {"WeldFrames": _WELD}},
    "sheldrake.multibody.tree": {"WeldJoint": {"__init__": _WELD}},
}
"""Retired names of arguments: module, class, method, today's name of each."""


def takes_retired_keywords(function: Callable, call: str, today: dict[str, str]) -> Callable:
    """The same function; it warns of arguments with retired names and takes them for today's."""

    @functools.wraps(function)
    def wrapper(*args: Any, **kwargs: Any) -> Any:
        retired = [name for name in kwargs if name in today]
        if retired:
            hint(f"{call}(): " + ", ".join(f"{name} is now {today[name]}" for name in retired) + ".")
            kwargs = {today.get(name, name): value for name, value in kwargs.items()}
        return function(*args, **kwargs)

    return wrapper


def install(module: ModuleType) -> dict[str, Any]:
    """Adds to one of sheldrake's modules the retired names it had.

    Returns:
        The functions and classes added to the module itself, by name; a roll-up module wants them too.
    """
    for class_name, methods in METHODS.get(module.__name__, {}).items():
        cls = getattr(module, class_name, None)
        for name, function in methods.items():
            if cls is not None and not hasattr(cls, name):
                setattr(cls, name, function)
    for class_name, tables in KEYWORDS.get(module.__name__, {}).items():
        cls = getattr(module, class_name)
        for name, today in tables.items():
            function = getattr(cls, name)
            if not hasattr(function, "__wrapped__"):
                setattr(cls, name, takes_retired_keywords(function, f"{class_name}.{name}", today))
    made = FUNCTIONS.get(module.__name__, dict)()
    added = {name: vars(module).setdefault(name, value) for name, value in made.items()}
    return added
