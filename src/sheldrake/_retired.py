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
from sheldrake._retired_methods import CALLS, KEYWORDS, METHODS


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
    for class_name, calls in CALLS.get(module.__name__, {}).items():
        cls = getattr(module, class_name)
        for name, wrap in calls.items():
            function = getattr(cls, name)
            if not hasattr(function, "__wrapped__"):
                setattr(cls, name, functools.wraps(function)(wrap(function)))
    made = FUNCTIONS.get(module.__name__, dict)()
    added = {name: vars(module).setdefault(name, value) for name, value in made.items()}
    return added
