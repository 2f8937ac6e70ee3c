"""Names that Drake retired since 2021, each with the one that took its place.

They work, with one warning (`DrakeDeprecationWarning`) that names today's way. `sheldrake.all` and the pydrake alias
add them to the modules and classes they were found in; nothing here is imported by the library itself.
"""

from __future__ import annotations

import importlib
import warnings
from collections.abc import Callable
from types import ModuleType
from typing import Any, NamedTuple


def _hint(text: str) -> None:
    from sheldrake.common.deprecation import DrakeDeprecationWarning

    warnings.warn(text, DrakeDeprecationWarning, stacklevel=3)


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
        _hint(f"{fullname} is retired: import from {self.replacement.replace('sheldrake', 'pydrake', 1)}.")
        return module


def _existing(replacement: str, names: dict[str, tuple[str, str]]) -> list[str]:
    if names:
        return list(names)
    module = importlib.import_module(replacement)
    return list(getattr(module, "__all__", [n for n in vars(module) if not n.startswith("_")]))


def _folded(replacement: str, *names: str) -> Module:
    return Module(replacement, {name: (replacement, name) for name in names})


_SOLVER_MODULES = (
    "branch_and_bound clp csdp gurobi ipopt mathematicalprogram mixed_integer_optimization_util "
    "mixed_integer_rotation_constraint mosek nlopt osqp scs sdpa_free_format snopt"
).split()
_EXAMPLE_MODULES = "acrobot compass_gait pendulum quadrotor rimless_wheel van_der_pol".split()

MODULES: dict[str, Module] = {
    **{f"pydrake.solvers.{name}": _folded("sheldrake.solvers") for name in _SOLVER_MODULES},
    **{f"pydrake.examples.{name}": _folded("sheldrake.examples") for name in _EXAMPLE_MODULES},
    "pydrake.geometry.render": _folded("sheldrake.geometry"),
}
"""Retired modules by their pydrake names."""


def renamed(new: str, call: str) -> Callable:
    """A function for a class: warns that `call` is retired and calls the method `new` with the same arguments."""

    def method(self: Any, *args: Any, **kwargs: Any) -> Any:
        _hint(f"{call}() is retired: use {new}().")
        return getattr(self, new)(*args, **kwargs)

    method.__doc__ = f"Retired: use `{new}`."
    return method


def forwarded(new: Callable, old: str, today: str) -> Callable:
    """A function that warns that `old` is retired in favour of `today` and calls `new`."""

    def function(*args: Any, **kwargs: Any) -> Any:
        _hint(f"{old}() is retired: use {today}.")
        return new(*args, **kwargs)

    function.__name__ = function.__qualname__ = old
    function.__doc__ = f"Retired: use {today}."
    return function


def _declare_periodic_publish(self: Any, period_sec: float, offset_sec: float = 0.0) -> None:
    """Retired: use `DeclarePeriodicPublishEvent`. Calls the override `DoPublish(context, events)`."""
    _hint("DeclarePeriodicPublish() is retired: use DeclarePeriodicPublishEvent(period, offset, publish).")
    self.DeclarePeriodicPublishEvent(period_sec, offset_sec, lambda context: self.DoPublish(context, []))


def _declare_periodic_discrete_update(self: Any, period_sec: float, offset_sec: float = 0.0) -> None:
    """Retired: use `DeclarePeriodicDiscreteUpdateEvent`. Calls the override `DoCalcDiscreteVariableUpdates`."""
    _hint("DeclarePeriodicDiscreteUpdate() is retired: use DeclarePeriodicDiscreteUpdateEvent(period, offset, update).")

    def update(context: Any, discrete_state: Any) -> None:
        self.DoCalcDiscreteVariableUpdates(context, [], discrete_state)

    self.DeclarePeriodicDiscreteUpdateEvent(period_sec, offset_sec, update)


METHODS: dict[str, dict[str, dict[str, Callable]]] = {
    "sheldrake.systems.framework": {
        "System": {"Publish": renamed("ForcedPublish", "System.Publish")},
        "LeafSystem": {
            "DeclarePeriodicPublish": _declare_periodic_publish,
            "DeclarePeriodicDiscreteUpdate": _declare_periodic_discrete_update,
        },
    },
    "sheldrake.systems.analysis": {
        "Simulator": {"StepTo": renamed("AdvanceTo", "Simulator.StepTo")},
    },
    "sheldrake.multibody.plant": {
        "MultibodyPlant": {
            "get_continuous_state_output_port": renamed(
                "get_state_output_port", "MultibodyPlant.get_continuous_state_output_port"
            ),
            "get_geometry_poses_output_port": renamed(
                "get_geometry_pose_output_port", "MultibodyPlant.get_geometry_poses_output_port"
            ),
        },
    },
    "sheldrake.geometry": {
        "SceneGraph": {
            "get_pose_bundle_output_port": renamed("get_query_output_port", "SceneGraph.get_pose_bundle_output_port"),
        },
    },
}
"""Retired methods: module, class, name, function. A class gets those whose name it does not define itself."""


def _autodiffutils() -> dict[str, Any]:
    import numpy as np

    from sheldrake import autodiffutils as m

    def with_gradient(value: Any, gradient: Any) -> Any:
        return m.InitializeAutoDiff(np.asarray(value, dtype=float), gradient=gradient)

    return {
        "initializeAutoDiff": forwarded(m.InitializeAutoDiff, "initializeAutoDiff", "InitializeAutoDiff()"),
        "initializeAutoDiffTuple": forwarded(
            m.InitializeAutoDiffTuple, "initializeAutoDiffTuple", "InitializeAutoDiffTuple()"
        ),
        "initializeAutoDiffGivenGradientMatrix": forwarded(
            with_gradient, "initializeAutoDiffGivenGradientMatrix", "InitializeAutoDiff(value, gradient=gradient)"
        ),
        "autoDiffToValueMatrix": forwarded(m.ExtractValue, "autoDiffToValueMatrix", "ExtractValue()"),
        "autoDiffToGradientMatrix": forwarded(m.ExtractGradient, "autoDiffToGradientMatrix", "ExtractGradient()"),
    }


FUNCTIONS: dict[str, Callable[[], dict[str, Any]]] = {
    "sheldrake.autodiffutils": _autodiffutils,
}
"""Retired functions and classes of a module, made when the module is there."""


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
    made = FUNCTIONS.get(module.__name__, dict)()
    added = {name: vars(module).setdefault(name, value) for name, value in made.items()}
    return added
