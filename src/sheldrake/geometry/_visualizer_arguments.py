"""How `AddToBuilder()` of a visualizer of geometry is called, and what it does."""

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


def add_visualizer(builder: DiagramBuilder, source: SceneGraph | OutputPort, visualizer: Any, name: str) -> Any:
    """Adds a visualizer to a diagram, under this name if it is free, and connects it to the scene.

    Args:
        builder: The diagram in the making.
        source: The SceneGraph, or its query port.
        visualizer: A system with a query_object input port.
        name: What it is called.
    """
    builder.AddSystem(visualizer)
    if not builder.HasSubsystemNamed(name):
        visualizer.set_name(name)
    port = source.get_query_output_port() if isinstance(source, SceneGraph) else source
    builder.Connect(port, visualizer.query_object_input_port())
    return visualizer
