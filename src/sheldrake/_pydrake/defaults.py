"""Drake's defaults where sheldrake's differ, given to what a program builds by a name that it imported from pydrake.

A class of pydrake's is then one whose instances are sheldrake's own, with the default set; whoever imports the name
from sheldrake, in the same process, gets sheldrake's default.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sheldrake.geometry._scene_graph import SceneGraph
    from sheldrake.planning._robot_diagram import RobotDiagramBuilder

_Finish = Callable[..., None]


def _points_of_scene_graph(scene_graph: SceneGraph, *_: object, **__: object) -> None:
    """One point for each pair of geometries: where Drake has it, whatever touches."""
    scene_graph.set_default_point_contact_algorithm("single_point")


def _points_of_plant(made: Any, *args: Any, **kwargs: Any) -> None:
    from sheldrake.geometry import SceneGraph

    if not any(isinstance(value, SceneGraph) for value in (*args, *kwargs.values())):  # a given one is as it was made
        _points_of_scene_graph(made.scene_graph)


def _points_of_robot(builder: RobotDiagramBuilder, *_: object, **__: object) -> None:
    _points_of_scene_graph(builder.scene_graph())


FUNCTIONS: dict[str, _Finish] = {
    "AddMultibodyPlantSceneGraph": _points_of_plant,
    "AddMultibodyPlant": _points_of_plant,
}
CLASSES: dict[str, _Finish] = {"SceneGraph": _points_of_scene_graph, "RobotDiagramBuilder": _points_of_robot}
"""What sets Drake's defaults: it gets what the call made, then the arguments of the call."""


def with_drakes_defaults(module: ModuleType) -> dict[str, Any]:
    """The functions, classes and families of a module of sheldrake that set Drake's defaults, by name."""
    public = set(getattr(module, "__all__", ()))
    found: dict[str, Any] = {n: _finished(getattr(module, n), finish) for n, finish in FUNCTIONS.items() if n in public}
    for name, finish in CLASSES.items():
        if name in public:
            found[name] = _class(getattr(module, name), finish)
        if f"{name}_" in public:
            found[f"{name}_"] = Family(getattr(module, f"{name}_"), finish)
    return found


@functools.cache
def _finished(function: Callable[..., Any], finish: _Finish) -> Callable[..., Any]:
    @functools.wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        made = function(*args, **kwargs)
        finish(made, *args, **kwargs)
        return made

    return call


@functools.cache
def _class(native: type, finish: _Finish) -> Any:
    """A class like `native`, whose call makes an object of that very class and finishes it."""

    class Builds(type(native)):  # type: ignore[misc]
        def __call__(cls, *args: Any, **kwargs: Any) -> Any:
            made = native(*args, **kwargs) if cls is own else super().__call__(*args, **kwargs)
            finish(made, *args, **kwargs)
            return made

        def __instancecheck__(cls, instance: object) -> bool:
            return isinstance(instance, native) if cls is own else super().__instancecheck__(instance)

        def __subclasscheck__(cls, subclass: type) -> bool:
            return issubclass(subclass, native) if cls is own else super().__subclasscheck__(subclass)

    members = {"__doc__": native.__doc__, "__module__": native.__module__, "__qualname__": native.__qualname__}
    own = Builds(native.__name__, (native,), members)
    return own


class Family:
    """A family `Foo_` whose classes set Drake's defaults; all else is as in sheldrake's."""

    def __init__(self, native: Any, finish: _Finish):
        self._native, self._finish = native, finish

    def __getitem__(self, param: Any) -> Any:
        """The class for a scalar type."""
        return _class(self._native[param], self._finish)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._native, name)
