"""Diagram: systems wired together, seen as one system.

`DiagramBuilder` fills it. It computes nothing itself: a layout flattens the whole tree of systems to rows, and wires
become places in memory, once, when the first context of a root is made.
"""

from __future__ import annotations

import operator
import weakref
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, ClassVar, SupportsIndex

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.systems.framework._declarations import InputDeclaration, OutputDeclaration
from sheldrake.systems.framework._index import InputPortIndex, OutputPortIndex, SubsystemIndex, Ticket
from sheldrake.systems.framework._system import System

if TYPE_CHECKING:
    from sheldrake.common.value import AbstractValue
    from sheldrake.systems.framework._context.context import Context
    from sheldrake.systems.framework._port import OutputPort
    from sheldrake.systems.framework._state import State
    from sheldrake.systems.framework._system import SystemVisitor


class Diagram(System):
    """Systems wired together. Made by `DiagramBuilder.Build`; a derived class calls `builder.BuildInto(self)`."""

    _picture: ClassVar[Callable[[Any], str] | None] = None
    """Draws a diagram as SVG; set by sheldrake.visualization, which stands on this floor."""

    def __init__(self) -> None:
        super().__init__()
        self._systems: list[System] = []
        self._wires: dict[tuple[int, int], tuple[int, int]] = {}  # (child, input) -> (child, output)
        self._exported_inputs: dict[tuple[int, int], int] = {}  # (child, input) -> own input
        self._exported_outputs: list[tuple[int, int]] = []  # own output -> (child, output)

    def _subsystems(self) -> list[System]:
        return self._systems

    def _fill(self, systems: list, wires: dict, inputs: list, outputs: list) -> None:
        """Becomes what a builder describes.

        Args:
            systems: The subsystems.
            wires: (child, input) -> (child, output).
            inputs: (name, [(child, input), ...]) of each own input port.
            outputs: (name, (child, output)) of each own output port.
        """
        for system in systems:
            system._parent_ref = weakref.ref(self)
        self._systems, self._wires = list(systems), dict(wires)
        for k, (name, ports) in enumerate(inputs):
            first = systems[ports[0][0]]._inputs[ports[0][1]]
            declaration = InputDeclaration(name, first.data_type, first.size, first.model, first.random_type)
            declaration.ticket = self._new_ticket("in", k)
            self._inputs.append(declaration)
            self._exported_inputs.update({port: k for port in ports})
        for name, (child, j) in outputs:
            shown = systems[child]._outputs[j]
            self._outputs.append(
                OutputDeclaration(name, shown.data_type, shown.size, shown.model, None, frozenset({Ticket.NOTHING}))
            )
            self._exported_outputs.append((child, j))
        self._changed()

    def _allocate_output(self, j: int) -> AbstractValue:
        child, k = self._exported_outputs[j]
        return self._systems[child]._allocate_output(k)

    def _repr_svg_(self) -> str | None:
        """A picture for notebooks, once sheldrake.visualization is imported."""
        draw = Diagram._picture
        return None if draw is None else draw(self)

    # Subsystems.

    def GetSystems(self) -> list[System]:
        """The subsystems."""
        return list(self._systems)

    def get_system(self, index: SubsystemIndex) -> System:
        """The subsystem of a number.

        Raises:
            RuntimeError: there is none.
        """
        count = len(self._systems)
        if not 0 <= int(index) < count:
            raise RuntimeError(f"Diagram.get_system(): there is no subsystem {int(index)}; this diagram has {count}.")
        return self._systems[int(index)]

    @checked
    def HasSubsystemNamed(self, name: str) -> bool:
        """Whether there is a subsystem of this name."""
        return any(s.get_name() == name for s in self._systems)

    @checked
    def GetSubsystemByName(self, name: str) -> Any:
        """The subsystem of this name.

        Raises:
            RuntimeError: there is none.
        """
        for system in self._systems:
            if system.get_name() == name:
                return system
        valid = ", ".join(s.get_name() for s in self._systems)
        raise RuntimeError(
            f"System {self.GetSystemName()} does not have a subsystem named {name}. The existing subsystems are named "
            f"{{{valid}}}."
        )

    def GetMutableSubsystemState(self, subsystem: System, context: Context) -> State:
        """State of a subsystem, to be changed."""
        return self.GetSubsystemContext(subsystem, context).get_mutable_state()

    # Connections.

    def _child(self, system: System) -> int:
        return next((k for k, s in enumerate(self._systems) if s is system), -1)

    def connection_map(self) -> dict:
        """What feeds what: {(system, input port index): (system, output port index)}."""
        return {
            (self._systems[a], InputPortIndex(i)): (self._systems[b], OutputPortIndex(j))
            for (a, i), (b, j) in self._wires.items()
        }

    @checked
    def AreConnected(self, output: OutputPort, input: Any) -> bool:
        """Whether an output port of a subsystem feeds an input port of one."""
        source = self._wires.get((self._child(input.get_system()), int(input.get_index())))
        return source is not None and source == (self._child(output.get_system()), int(output.get_index()))

    def GetInputPortLocators(self, port_index: SupportsIndex) -> list:
        """Input ports (system, index) of subsystems that take the value of an own input port."""
        k = operator.index(port_index)
        return [(self._systems[a], InputPortIndex(i)) for (a, i), own in self._exported_inputs.items() if own == k]

    def get_output_port_locator(self, port_index: SupportsIndex) -> tuple:
        """Output port (system, index) of a subsystem that an own output port shows."""
        child, j = self._exported_outputs[operator.index(port_index)]
        return self._systems[child], OutputPortIndex(j)

    @checked
    def Accept(self, v: SystemVisitor) -> None:
        """Shows itself to a visitor, who goes on to `GetSystems()` if it likes."""
        v.VisitDiagram(self)

    def _implicit_residual(self, context: Context, proposed: np.ndarray) -> np.ndarray:
        parts, at = [proposed[:0]], 0
        for system in self._systems:
            n = system.num_continuous_states()
            parts.append(system._implicit_residual(self.GetSubsystemContext(system, context), proposed[at : at + n]))
            at += n
        return np.concatenate(parts)

    def _is_generic(self) -> bool:
        return all(s._is_generic() or s._scalar_converter is not None for s in self._systems)

    def _converted(self, scalar: type) -> Any:
        systems = [s._convert(scalar) for s in self._systems]
        if any(s is None for s in systems):
            return None
        for system, converted in zip(self._systems, systems):
            converted._name = system._name
        new = Diagram._template[scalar]()  # type: ignore[attr-defined]
        inputs = [
            (d.name, [p for p, own in self._exported_inputs.items() if own == k]) for k, d in enumerate(self._inputs)
        ]
        outputs = [(d.name, port) for d, port in zip(self._outputs, self._exported_outputs)]
        new._fill(systems, self._wires, inputs, outputs)
        new._name, new._scalar = self._name, scalar
        return new


def all_systems(system: System) -> list[Any]:
    """A system and, level by level, all that are in it."""
    found: list[Any] = [system]
    for each in found:
        if isinstance(each, Diagram):
            found += each.GetSystems()
    return found
