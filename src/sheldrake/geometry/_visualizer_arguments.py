"""What `AddToBuilder()` of a visualizer of geometry is given, by place or by name."""

from __future__ import annotations

from typing import Any

from ._scene_graph import SceneGraph


def visualizer_arguments(call: str, target: str, args: tuple, kwargs: dict) -> tuple[Any, Any, dict[str, Any]]:
    """The arguments behind `builder`: a SceneGraph (or its query port), where to draw, options.

    Args:
        call: Name of the call, for the error.
        target: Name of the argument that says where to draw.
        args: Positional arguments.
        kwargs: Named arguments.

    Returns:
        The query port as far as one was given, what was given for it, and everything given by name.

    Raises:
        TypeError: there are too many arguments, or one has an unknown name.
    """
    names = ["query_object_port" if "query_object_port" in kwargs else "scene_graph", target, "params"]
    free = [name for name in names if name not in kwargs]
    if len(args) > len(free) or set(kwargs) - set(names):
        raise TypeError(f"{call}(): expected (builder, {', '.join(names)}).")
    given = {**dict(zip(free, args)), **kwargs}
    source = given.get(names[0])
    return source.get_query_output_port() if isinstance(source, SceneGraph) else source, source, given
