"""Names that Drake retired since 2021, each with the one that took its place.

They work, with one warning (`DrakeDeprecationWarning`) that names today's way. `sheldrake.all` and the pydrake alias
add them to the modules and classes they were found in; nothing here is imported by the library itself.
"""

from __future__ import annotations

import functools
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
        today = self.replacement.partition("._")[0].replace("sheldrake", "pydrake", 1)
        _hint(f"{fullname} is retired: import from {today}.")
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
    "pydrake.systems.meshcat_visualizer": _folded("sheldrake.visualization._legacy_meshcat"),
}
"""Retired modules by their pydrake names."""


def renamed(new: str, call: str, static: bool = False) -> Any:
    """A function for a class: warns that `call` is retired and calls the method `new` with the same arguments."""

    def method(self: Any, *args: Any, **kwargs: Any) -> Any:
        _hint(f"{call}() is retired: use {new}().")
        return getattr(self, new)(*args, **kwargs)

    method.__doc__ = f"Retired: use `{new}`."
    return classmethod(method) if static else method


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


def _set_discrete_contact_solver(self: Any, contact_solver: Any) -> None:
    """Retired: use `set_discrete_contact_approximation`. TAMSI or SAP, by the solver's name."""
    from sheldrake.multibody.plant import DiscreteContactApproximation

    _hint("MultibodyPlant.set_discrete_contact_solver() is retired: use set_discrete_contact_approximation().")
    self.set_discrete_contact_approximation(DiscreteContactApproximation[contact_solver.name])


def _camera_info(kind: str) -> Callable:
    """A method of RgbdSensor that gives the lens of its camera of a kind."""

    def info(self: Any) -> Any:
        _hint(f"RgbdSensor.{kind}_camera_info() is retired: use default_{kind}_render_camera().core().intrinsics().")
        return getattr(self, f"default_{kind}_render_camera")().core().intrinsics()

    info.__doc__ = f"Retired: use `default_{kind}_render_camera().core().intrinsics()`."
    return info


_DAMPED = ("RevoluteJoint", "PrismaticJoint", "ScrewJoint", "BallRpyJoint", "UniversalJoint")

METHODS: dict[str, dict[str, dict[str, Any]]] = {
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
        "RigidBody": {"get_default_mass": renamed("default_mass", "RigidBody.get_default_mass")},
        **{name: {"damping": renamed("default_damping", f"{name}.damping")} for name in _DAMPED},
    },
    "sheldrake.geometry": {
        "SceneGraph": {
            "get_pose_bundle_output_port": renamed("get_query_output_port", "SceneGraph.get_pose_bundle_output_port"),
        },
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
            _hint(f"{call}(): " + ", ".join(f"{name} is now {today[name]}" for name in retired) + ".")
            kwargs = {today.get(name, name): value for name, value in kwargs.items()}
        return function(*args, **kwargs)

    return wrapper


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


def _visualization() -> dict[str, Any]:
    from sheldrake.visualization import _legacy_meshcat

    return {"ConnectMeshcatVisualizer": _legacy_meshcat.ConnectMeshcatVisualizer}


def _geometry() -> dict[str, Any]:
    from sheldrake.geometry import MeshcatVisualizer

    class MeshcatVisualizerCpp(MeshcatVisualizer):
        """Retired: use `MeshcatVisualizer`."""

        @staticmethod
        def AddToBuilder(*args: Any, **kwargs: Any) -> Any:
            """Retired: use `MeshcatVisualizer.AddToBuilder`."""
            _hint("MeshcatVisualizerCpp is retired: use MeshcatVisualizer.")
            return MeshcatVisualizer.AddToBuilder(*args, **kwargs)

    return {"MeshcatVisualizerCpp": MeshcatVisualizerCpp}


def _primitives() -> dict[str, Any]:
    import numpy as np

    from sheldrake.systems.framework import LeafSystem

    class SignalLogger(LeafSystem):
        """Retired: use `VectorLogSink`. Keeps what it logs itself, whatever the context.

        Args:
            input_size: Size of the signal.
            batch_allocation_size: Of no effect.
        """

        def __init__(self, input_size: int, batch_allocation_size: int = 1000):
            LeafSystem.__init__(self)
            _hint("SignalLogger is retired: use VectorLogSink, and FindLog(context) to read its log.")
            self._size, self._when, self._period = input_size, "step", None
            self.reset()
            self.DeclareVectorInputPort("data", input_size)
            self.DeclarePerStepPublishEvent(lambda context: self._log(context, "step"))
            self.DeclareForcedPublishEvent(lambda context: self._log(context, "forced", "step", "period"))

        def _log(self, context: Any, *modes: str) -> None:
            if self._when in modes:
                self._times.append(context.get_time())
                self._columns.append(np.array(self.get_input_port(0).Eval(context)))

        def set_publish_period(self, period: float) -> None:
            """Logs at every multiple of `period` [s] instead of at every step."""
            self._when = "period"
            self.DeclarePeriodicPublishEvent(period, 0.0, lambda context: self._log(context, "period"))

        def set_forced_publish_only(self) -> None:
            """Logs only when a publish is forced."""
            self._when = "forced"

        def sample_times(self) -> Any:
            """Returns the times [s], shape `(n,)`."""
            return np.array(self._times)

        def data(self) -> Any:
            """Returns the samples as columns, shape `(input_size, n)`."""
            return np.array(self._columns).reshape(-1, self._size).T

        def reset(self) -> None:
            """Forgets all samples."""
            self._times: list[float] = []
            self._columns: list[Any] = []

    def LogOutput(src: Any, builder: Any) -> Any:
        """Retired: use `LogVectorOutput`, and `FindLog(context)` to read the log."""
        _hint("LogOutput() is retired: use LogVectorOutput(src, builder), and FindLog(context) to read the log.")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            logger = builder.AddSystem(SignalLogger(src.size()))
        builder.Connect(src, logger.get_input_port(0))
        return logger

    return {"SignalLogger": SignalLogger, "LogOutput": LogOutput}


def _framework() -> dict[str, Any]:
    def GenerateHtml(system: Any, initial_depth: int = 1) -> str:
        """Retired: use `GetGraphvizString`. Returns a system and its subsystems as HTML that unfolds.

        Args:
            system: The system.
            initial_depth: How many levels are unfolded at first.
        """
        _hint("GenerateHtml() is retired: use System.GetGraphvizString().")
        return _html_of(system, initial_depth)

    return {"GenerateHtml": GenerateHtml}


def _html_of(system: Any, depth: int) -> str:
    from html import escape

    ports = [
        f"<li>{kind} <code>{escape(port.get_name())}</code></li>"
        for kind, number, get in (
            ("input", system.num_input_ports(), system.get_input_port),
            ("output", system.num_output_ports(), system.get_output_port),
        )
        for port in (get(i) for i in range(number))
    ]
    inside = ""
    if hasattr(system, "GetSystems"):
        inside = "".join(_html_of(child, depth - 1) for child in system.GetSystems())
        for (to, i), (source, j) in system.connection_map().items():
            a = f"{source.get_name()}.{source.get_output_port(j).get_name()}"
            b = f"{to.get_name()}.{to.get_input_port(i).get_name()}"
            ports.append(f"<li><code>{escape(a)}</code> → <code>{escape(b)}</code></li>")
    name = escape(system.get_name() or type(system).__name__)
    unfolded = " open" if depth > 0 else ""
    style = "margin-left:1em;border-left:1px solid #ccc;padding-left:.5em"
    return f'<details{unfolded} style="{style}"><summary>{name}</summary><ul>{"".join(ports)}</ul>{inside}</details>'


FUNCTIONS: dict[str, Callable[[], dict[str, Any]]] = {
    "sheldrake.autodiffutils": _autodiffutils,
    "sheldrake.geometry": _geometry,
    "sheldrake.systems.framework": _framework,
    "sheldrake.systems.primitives": _primitives,
    "sheldrake.visualization": _visualization,
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
    for class_name, tables in KEYWORDS.get(module.__name__, {}).items():
        cls = getattr(module, class_name)
        for name, today in tables.items():
            function = getattr(cls, name)
            if not hasattr(function, "__wrapped__"):
                setattr(cls, name, takes_retired_keywords(function, f"{class_name}.{name}", today))
    made = FUNCTIONS.get(module.__name__, dict)()
    added = {name: vars(module).setdefault(name, value) for name, value in made.items()}
    return added
