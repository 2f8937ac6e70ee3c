"""How `AddToBuilder()` of a visualizer of geometry is called."""

from __future__ import annotations

from typing import Any

from sheldrake.common._kinds import instance_of
from sheldrake.common._overloads import Overload, overload
from sheldrake.geometry._scene_graph import SceneGraph
from sheldrake.systems.framework import DiagramBuilder, OutputPort


def of_scene(**more: Any) -> tuple[Overload, Overload]:
    """With a SceneGraph or its query port, and more parameters."""
    builder = instance_of(DiagramBuilder)
    return (
        overload(builder=builder, scene_graph=instance_of(SceneGraph), **more),
        overload(builder=builder, query_object_port=instance_of(OutputPort), **more),
    )


def query_port_of(source: SceneGraph | OutputPort) -> OutputPort:
    """The port that tells of the scene."""
    return source.get_query_output_port() if isinstance(source, SceneGraph) else source
