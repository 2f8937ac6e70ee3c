"""What the drawings of the examples have in common."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._kinds import instance_of
from sheldrake.common._overloads import Overload, overload
from sheldrake.common.value import AbstractValue
from sheldrake.geometry import (
    FramePoseVector,
    GeometryFrame,
    GeometryInstance,
    MakePhongIllustrationProperties,
    SceneGraph,
)
from sheldrake.math import RigidTransform
from sheldrake.systems.framework import DiagramBuilder, LeafSystem, OutputPort

if TYPE_CHECKING:
    from typing_extensions import Self

    from sheldrake.geometry._ids import FrameId
    from sheldrake.geometry._shapes import Shape
    from sheldrake.systems.framework import Context


class ExampleGeometry(LeafSystem):
    """Registers shapes with a SceneGraph and turns a state into the poses of their frames.

    Args:
        scene_graph: Where the shapes are registered; not kept.
        source: Name of the source.
        state: Name and size of the input port.
    """

    def __init__(self, scene_graph: SceneGraph, source: str | None, state: tuple[str, int]):
        super().__init__()
        self._scene_graph = scene_graph
        self._source = scene_graph.RegisterSource(source) if source else scene_graph.RegisterSource()
        self._frames: list[Any] = []
        self.DeclareVectorInputPort(*state)
        self.DeclareAbstractOutputPort("geometry_pose", lambda: AbstractValue.Make(FramePoseVector()), self._calc)

    def add_frame(self, name: str, parent: FrameId | None = None) -> FrameId:
        """Registers a frame, whose pose in its parent (default: the world) `poses` will tell."""
        where = (self._source,) if parent is None else (self._source, parent)
        self._frames.append(self._scene_graph.RegisterFrame(*where, GeometryFrame(name)))
        return self._frames[-1]

    def draw(self, frame: Any, X_PG: RigidTransform, shape: Shape, name: str, diffuse: Sequence[float]) -> None:
        """Registers a shape in a frame, or in the world."""
        scene_graph, instance = self._scene_graph, GeometryInstance(X_PG, shape, name)
        if frame is None:
            geometry = scene_graph.RegisterAnchoredGeometry(self._source, instance)
        else:
            geometry = scene_graph.RegisterGeometry(self._source, frame, instance)
        scene_graph.AssignRole(self._source, geometry, MakePhongIllustrationProperties(diffuse))

    def poses(self, state: np.ndarray) -> list[RigidTransform]:
        """Poses of the frames, in the order they were added."""
        raise NotImplementedError

    def _calc(self, context: Context, output: AbstractValue) -> None:
        vector = FramePoseVector()
        for frame, X_PF in zip(self._frames, self.poses(self.get_input_port(0).Eval(context))):
            vector.set_value(frame, X_PF)
        output.set_value(vector)

    def _add(self, builder: DiagramBuilder, state_port: OutputPort, scene_graph: SceneGraph) -> Self:
        builder.AddSystem(self)
        builder.Connect(state_port, self.get_input_port(0))
        builder.Connect(self.get_output_port(0), scene_graph.get_source_pose_port(self._source))
        del self._scene_graph
        return self


def drawn_in_scene(port: str, params_name: str, params: type) -> tuple[Overload, Overload]:
    """How `AddToBuilder` of a drawing is called: `(builder, port, [params,] scene_graph)`, with default parameters."""
    source = {"builder": instance_of(DiagramBuilder), port: instance_of(OutputPort)}
    scene = {"scene_graph": instance_of(SceneGraph)}
    return (
        overload(**source, **{params_name: instance_of(params)}, **scene),
        overload(lambda cls, *where: cls.AddToBuilder(*where[:2], params(), where[2]), **source, **scene),
    )
