"""Modules and names that Drake folded into others, or removed for good."""

from __future__ import annotations

import importlib
from types import ModuleType
from typing import Any, NamedTuple

from .hints import hint


class Module(NamedTuple):
    """A module that Drake folded into others: `names` maps each of its names to `(module, name)` of today's."""

    replacement: str
    names: dict[str, tuple[str, str]]
    today: str = ""  # where to import from, when that is not the replacement

    def make(self, fullname: str) -> ModuleType:
        """Makes the retired module. Names it had that sheldrake lacks are found missing when they are asked for."""
        module = ModuleType(fullname, f"Retired: use {self.replacement}.")
        vars(module)["__path__"] = []

        def __getattr__(name: str) -> Any:
            where, today = self.names.get(name, (self.replacement, name))
            if name.startswith("__"):
                raise AttributeError(f"module {fullname!r} has no attribute {name!r}")
            return getattr(importlib.import_module(_by_pydrakes_name(where)), today)

        vars(module)["__getattr__"] = __getattr__
        vars(module)["__all__"] = _existing(self.replacement, self.names)
        today = self.today or _by_pydrakes_name(self.replacement)
        hint(f"{fullname} is retired: import from {today}.")
        return module


def _by_pydrakes_name(module: str) -> str:
    """What a module is called under the alias, which may adapt its names; a private one stays."""
    return module if "._" in module else module.replace("sheldrake", "pydrake", 1)


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
    "pydrake.visualization.plotting": _folded("sheldrake.visualization"),
    "pydrake.systems.meshcat_visualizer": Module(
        "sheldrake._pydrake.retired.meshcat_visualizer", {}, "pydrake.visualization"
    ),
}
"""Retired modules by their pydrake names."""

GONE = {
    "pydrake.attic": "RigidBodyTree and what stood on it; use pydrake.multibody.plant",
    "pydrake.automotive": "cars on roads; nothing took their place",
    "pydrake.maliput": "roads; see the project of that name",
    "pydrake.multibody.multibody_tree": "MultibodyTree; use pydrake.multibody.tree, .plant and .parsing",
    "pydrake.multibody.rigid_body": "RigidBody of RigidBodyTree; use pydrake.multibody.tree",
    "pydrake.multibody.shapes": "shapes of RigidBodyTree; use pydrake.geometry",
    "pydrake.systems.trees": "RigidBodyTree; use pydrake.multibody.plant",
    "pydrake.util": "what pydrake.common has",
    "pydrake.multibody.rigid_body_tree": "RigidBodyTree; use pydrake.multibody.plant",
    "pydrake.examples.manipulation_station": "ManipulationStation; use "
    "pydrake.multibody.parsing.ProcessModelDirectives and the drivers of pydrake.manipulation",
    "pydrake.manipulation.simple_ui": "windows of Tk; use pydrake.multibody.meshcat.JointSliders",
    "pydrake.solvers.dreal": "DrealSolver; use another solver of pydrake.solvers",
    "pydrake.solvers.ibex": "IbexSolver; use another solver of pydrake.solvers",
    "pydrake.systems.system_sliders": "windows of Tk; use Meshcat.AddSlider()",
    "pydrake.third_party": "what it bundled; import those packages by their own names",
}
"""Modules that Drake removed for good: what they held, and what to use."""

_STATION = "use pydrake.multibody.parsing.ProcessModelDirectives and pydrake.manipulation.ApplyDriverConfigs"
GONE_NAMES = {
    **dict.fromkeys(("ManipulationStation", "ManipulationStationHardwareInterface"), _STATION),
    **dict.fromkeys(("IiwaCollisionModel", "SchunkCollisionModel"), _STATION),
    **dict.fromkeys(("CreateClutterClearingYcbObjectList", "CreateManipulationClassYcbObjectList"), _STATION),
    "RigidBodyTree": "use pydrake.multibody.plant.MultibodyPlant",
    "RigidBodyPlant": "use pydrake.multibody.plant.MultibodyPlant",
    "FloatingBaseType": "use pydrake.multibody.tree.BaseBodyJointType",
    "SchunkWsgButtons": "use Meshcat.AddButton() and Meshcat.GetButtonClicks()",
    **dict.fromkeys(("DrealSolver", "IbexSolver"), "use another solver of pydrake.solvers"),
    "ConnectLcmScope": "use pydrake.systems.lcm.LcmScopeSystem.AddToBuilder()",
}
"""Names that Drake removed for good: what to use."""
