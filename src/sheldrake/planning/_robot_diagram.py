"""A plant, its SceneGraph and what else there is, as one diagram."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

from sheldrake.common._checked import checked
from sheldrake.common._no_constructor import no_constructor
from sheldrake.geometry import SceneGraph
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant_
from sheldrake.systems.framework import Diagram, DiagramBuilder_

if TYPE_CHECKING:
    from sheldrake.multibody.plant import MultibodyPlant
    from sheldrake.systems.framework import Context, DiagramBuilder


@no_constructor()
@checked
class RobotDiagram(Diagram):
    """A diagram with one plant and one SceneGraph. Made by `RobotDiagramBuilder.Build`."""

    @classmethod
    def _make(cls) -> RobotDiagram:
        out = cls.__new__(cls)
        Diagram.__init__(out)
        return out

    def _converted(self, scalar: type) -> Any:
        new = super()._converted(scalar)
        if new is not None:
            new.__class__ = type(self)._template[scalar]  # type: ignore[attr-defined]
        return new

    def _one(self, kind: type) -> Any:
        return next(s for s in self._systems if isinstance(s, kind))

    @cached_property
    def _plant(self) -> MultibodyPlant:
        return self._one(MultibodyPlant_[float])

    @cached_property
    def _scene_graph(self) -> SceneGraph:
        return self._one(SceneGraph)

    def plant(self) -> MultibodyPlant:
        """Returns the plant."""
        return self._plant

    def scene_graph(self) -> SceneGraph:
        """Returns the SceneGraph."""
        return self._scene_graph

    mutable_scene_graph = scene_graph

    def plant_context(self, root_context: Context) -> Context:
        """Returns the plant's part of a context of this diagram or of one around it."""
        return self.plant().GetMyMutableContextFromRoot(root_context)

    mutable_plant_context = plant_context

    def scene_graph_context(self, root_context: Context) -> Context:
        """Returns the SceneGraph's part of a context of this diagram or of one around it."""
        return self.scene_graph().GetMyMutableContextFromRoot(root_context)

    mutable_scene_graph_context = scene_graph_context


@checked
class RobotDiagramBuilder:
    """Builds a RobotDiagram: add models to the plant, systems to the builder, then call `Build`.

    Args:
        time_step: Of the plant [s]; zero for a continuous one.
    """

    _scalar: type = float

    def __init__(self, time_step: float = 0.001):
        self._builder: Any = DiagramBuilder_[self._scalar]()
        self._plant, self._scene_graph = AddMultibodyPlantSceneGraph(self._builder, time_step)
        self._parser: Any = None

    def _usable(self) -> None:
        if self.IsDiagramBuilt():
            raise RuntimeError(
                "RobotDiagramBuilder: Build() has already been called to create a RobotDiagram; this "
                "RobotDiagramBuilder may no longer be used."
            )

    def IsDiagramBuilt(self) -> bool:
        """Tells whether `Build` was called."""
        return self._builder is None

    def builder(self) -> DiagramBuilder:
        """Returns the builder of the diagram."""
        self._usable()
        return self._builder

    def parser(self) -> Any:
        """Returns a parser that adds models to the plant."""
        from sheldrake.multibody.parsing import Parser

        self._usable()
        if self._parser is None:
            self._parser = Parser(self._plant)
        return self._parser

    def plant(self) -> MultibodyPlant:
        """Returns the plant."""
        self._usable()
        return self._plant

    def scene_graph(self) -> SceneGraph:
        """Returns the SceneGraph."""
        self._usable()
        return self._scene_graph

    def Build(self) -> RobotDiagram:
        """Finalizes the plant, if it is not yet, and returns the diagram.

        Ports of plant and SceneGraph that are not connected become its own, unless the builder has other systems.

        Raises:
            RuntimeError: it was called before.
        """
        self._usable()
        if not self._plant.is_finalized():
            self._plant.Finalize()
        if self._is_plain():
            self._export()
        diagram = RobotDiagram._template[self._scalar]._make()  # type: ignore[attr-defined]
        self._builder.BuildInto(diagram)
        self._builder = None
        return diagram

    def _is_plain(self) -> bool:
        """Whether nothing was added or renamed."""
        names = [s.get_name() for s in self._builder.GetSystems()]
        return (
            sorted(names) == ["plant", "scene_graph"]
            and len(self._builder.connection_map()) == 3
            and not (self._builder.num_input_ports() or self._builder.num_output_ports())
        )

    def _export(self) -> None:
        fed = {(a.get_name(), int(i)) for a, i in self._builder.connection_map()}
        for system in (self._plant, self._scene_graph):
            name = system.get_name()
            for i in range(system.num_input_ports()):
                if (name, i) not in fed:
                    port = system.get_input_port(i)
                    self._builder.ExportInput(port, f"{name}_{port.get_name()}")
        for system in (self._plant, self._scene_graph):
            for i in range(system.num_output_ports()):
                output = system.get_output_port(i)
                self._builder.ExportOutput(output, f"{system.get_name()}_{output.get_name()}")


@checked
def GetContinuousRevoluteJointIndices(plant: MultibodyPlant) -> list[int]:
    """Places in q of angles without limits: of revolute, ball, universal, planar and rpy floating joints."""
    out: list[int] = []
    lower, upper = plant.GetPositionLowerLimits(), plant.GetPositionUpperLimits()
    import numpy as np

    for index in plant.GetJointIndices():
        joint = plant.get_joint(index)
        for k in joint._type.angles:
            place = joint.position_start() + k
            if np.isneginf(lower[place]) and np.isposinf(upper[place]):
                out.append(place)
    return out
