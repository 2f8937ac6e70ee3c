"""DiagramBuilder: puts systems together into a Diagram.

It checks each wire as it is drawn (types, sizes, one source for an input), and the whole for algebraic loops in
`Build()`.
"""

from __future__ import annotations

import operator
from typing import Any, TypeVar

from sheldrake.common._checked import checked
from sheldrake.common._overloads import Mismatch, expect
from sheldrake.systems.framework._diagram import Diagram
from sheldrake.systems.framework._engine.topology import Topology
from sheldrake.systems.framework._index import (
    InputPortIndex,
    OutputPortIndex,
    PortDataType,
    UseDefaultName,
    kUseDefaultName,
)
from sheldrake.systems.framework._port import InputPort, OutputPort
from sheldrake.systems.framework._system import System

_System = TypeVar("_System", bound=System)


@checked
class DiagramBuilder:
    """Collects systems and connections; `Build` makes a Diagram of them, once."""

    _scalar: type = float

    def __init__(self) -> None:
        self._systems: list[System] = []
        self._place: dict[int, int] = {}
        self._wires: dict[tuple[System, int], tuple[System, int]] = {}
        self._inputs: list[tuple[str, list[InputPort]]] = []
        self._outputs: list[tuple[str, OutputPort]] = []
        self._built = False

    # Systems.

    def AddSystem(self, system: _System) -> _System:
        """Adds a system and gives it back. A system without a name gets one.

        Raises:
            RuntimeError: it is in a diagram already, or the builder has built.
        """
        self._not_built("AddSystem")
        if not isinstance(system, System):
            raise Mismatch(f"AddSystem(): incompatible function arguments: {system!r} is no System")
        if system._scalar is not self._scalar:
            raise Mismatch(
                f"AddSystem(): incompatible function arguments: {system._describe()} is on {system._scalar.__name__}, "
                f"this DiagramBuilder on {self._scalar.__name__}."
            )
        if system._system_id in self._place or system._parent() is not None:
            raise RuntimeError(
                f"DiagramBuilder.AddSystem(): {system._describe()} has been added to a builder already; a System "
                "belongs to one Diagram."
            )
        if not system.get_name():
            system.set_name(f"{system.GetSystemType()}@{system._system_id:016x}")
        self._place[system._system_id] = len(self._systems)
        self._systems.append(system)
        return system

    def AddNamedSystem(self, name: str, system: _System) -> _System:
        """Names a system, adds it and gives it back."""
        if not isinstance(name, str):
            raise Mismatch(f"AddNamedSystem(): incompatible function arguments: {name!r} is no str")
        expect("AddNamedSystem", system, System).set_name(name)
        return self.AddSystem(system)

    def RemoveSystem(self, system: System) -> None:
        """Removes a system and its connections; what is left keeps its order.

        Raises:
            RuntimeError: the builder has no such system.
        """
        self._not_built("RemoveSystem")
        self._has(system, "RemoveSystem")
        self._systems = [s for s in self._systems if s is not system]
        self._place = {s._system_id: k for k, s in enumerate(self._systems)}
        self._wires = {a: b for a, b in self._wires.items() if a[0] is not system and b[0] is not system}
        left = [(name, [p for p in ports if p.get_system() is not system]) for name, ports in self._inputs]
        self._inputs = [(name, ports) for name, ports in left if ports]
        self._outputs = [(name, port) for name, port in self._outputs if port.get_system() is not system]

    def empty(self) -> bool:
        """Whether there are no systems yet."""
        self._not_built("empty")
        return not self._systems

    def already_built(self) -> bool:
        """Whether `Build` or `BuildInto` was called."""
        return self._built

    def GetSystems(self) -> list[System]:
        """The systems added so far."""
        self._not_built("GetSystems")
        return list(self._systems)

    def GetMutableSystems(self) -> list[System]:
        """The systems added so far."""
        return self.GetSystems()

    def HasSubsystemNamed(self, name: str) -> bool:
        """Whether there is a system of this name."""
        return any(s.get_name() == name for s in self._systems)

    def GetSubsystemByName(self, name: str) -> Any:
        """The system of this name.

        Raises:
            RuntimeError: there is none, or more than one.
        """
        self._not_built("GetSubsystemByName")
        found = [s for s in self._systems if s.get_name() == name]
        if len(found) > 1:
            raise RuntimeError(
                f"DiagramBuilder contains multiple subsystems named {name} so cannot provide a unique answer."
            )
        if not found:
            valid = ", ".join(s.get_name() for s in self._systems)
            raise RuntimeError(
                f"DiagramBuilder does not contain a subsystem named {name}. The existing subsystems are named "
                f"{{{valid}}}."
            )
        return found[0]

    GetMutableSubsystemByName = GetSubsystemByName

    def num_input_ports(self) -> int:
        """How many input ports the diagram has so far."""
        self._not_built("num_input_ports")
        return len(self._inputs)

    def num_output_ports(self) -> int:
        """How many output ports the diagram has so far."""
        self._not_built("num_output_ports")
        return len(self._outputs)

    # Connections.

    def _not_built(self, call: str) -> None:
        if self._built:
            raise RuntimeError(
                f"DiagramBuilder.{call}(): Build() or BuildInto() has already been called to create a Diagram; this "
                "DiagramBuilder may no longer be used."
            )

    def _has(self, system: System, call: str) -> None:
        if expect(f"DiagramBuilder.{call}", system, System)._system_id not in self._place:
            valid = ", ".join(s.get_name() for s in self._systems)
            raise RuntimeError(
                f"DiagramBuilder: Cannot operate on ports of System {system.GetSystemName()} until it has been "
                f"registered using AddSystem (called: {call}(); registered systems: {valid})"
            )

    def _free(self, port: InputPort, call: str) -> None:
        self._has(port.get_system(), call)
        if self.IsConnectedOrExported(port):
            raise RuntimeError(
                f"DiagramBuilder.{call}(): {port.GetFullDescription()} is already wired; an input port takes one"
                " output. (AddMultibodyPlantSceneGraph() has connected plant and scene graph.)"
            )

    def Connect(self, output: OutputPort, input: InputPort) -> None:
        """Lets an output port feed an input port.

        Raises:
            RuntimeError: sizes or types differ, a system is not in the builder, or the input is taken.
        """
        self._not_built("Connect")
        if not isinstance(output, OutputPort) or not isinstance(input, InputPort):
            raise Mismatch(
                "DiagramBuilder.Connect(): incompatible function arguments: expected (OutputPort, InputPort), got "
                f"({type(output).__name__}, {type(input).__name__}). Systems give their ports by get_output_port() and "
                "get_input_port(), or by name with GetOutputPort() and GetInputPort()."
            )
        self._free(input, "Connect")
        self._has(output.get_system(), "Connect")
        self._same_kind(output, input)
        self._wires[input.get_system(), input._index] = output.get_system(), output._index

    def _same_kind(self, output: OutputPort, input: InputPort) -> None:
        if output.get_data_type() is not input.get_data_type():
            kinds = [
                f"is {'vector-valued' if p.get_data_type() is PortDataType.kVectorValued else 'abstract'}"
                for p in (output, input)
            ]
            raise _mismatch("Cannot mix vector-valued and abstract-valued ports", output, input, *kinds)
        if output.get_data_type() is PortDataType.kVectorValued:
            if output.size() != input.size():
                sizes = [f"has size {p.size()}" for p in (output, input)]
                raise _mismatch("Mismatched vector sizes", output, input, *sizes)
            return
        given, taken = output.Allocate(), input._model()
        if type(given) is not type(taken) and object not in (taken._type, given._type):
            types = f"gives Value[{given._type}]", f"takes Value[{taken._type}]"
            raise _mismatch("Mismatched value types", output, input, *types)

    def Cascade(self, src: System, dest: System) -> None:
        """Connects the only output port of `src` to the only input port of `dest`."""
        expect("Cascade", src, System), expect("Cascade", dest, System)
        self.Connect(src.get_output_port(), dest.get_input_port())

    def Disconnect(self, source: OutputPort, dest: InputPort) -> None:
        """Undoes `Connect`.

        Raises:
            RuntimeError: they are not connected.
        """
        self._not_built("Disconnect")
        expect("Disconnect", source, OutputPort)
        key = expect("Disconnect", dest, InputPort).get_system(), dest._index
        if self._wires.get(key) != (source.get_system(), source._index):
            raise RuntimeError(
                f"DiagramBuilder.Disconnect(): {source.GetFullDescription()} is not connected to "
                f"{dest.GetFullDescription()}."
            )
        del self._wires[key]

    def ConnectInput(
        self,
        diagram_port: Any = None,
        input: Any = None,
        **kwargs: Any,
    ) -> None:
        """Lets an exported input port, by name or index, feed one more input port."""
        self._not_built("ConnectInput")
        for name in ("diagram_port_name", "diagram_port_index"):
            diagram_port = kwargs.pop(name, diagram_port)
        if isinstance(diagram_port, str):
            names = [name for name, _ in self._inputs]
            if diagram_port not in names:
                raise RuntimeError(
                    f"DiagramBuilder.ConnectInput(): there is no exported input port named {diagram_port} (valid: "
                    f"{', '.join(names)})."
                )
            k = names.index(diagram_port)
        else:
            k = operator.index(diagram_port)
            if not 0 <= k < len(self._inputs):
                raise RuntimeError(
                    f"DiagramBuilder.ConnectInput(): there is no input port {k}; there are {len(self._inputs)}."
                )
        self._free(input, "ConnectInput")
        first = self._inputs[k][1][0]
        if (first.size(), first.get_data_type()) != (input.size(), input.get_data_type()):
            raise RuntimeError(
                f"DiagramBuilder.ConnectInput(): exported input port '{self._inputs[k][0]}' has size {first.size()}, "
                "but "
                f"{input.GetFullDescription()} has size {input.size()}."
            )
        self._inputs[k][1].append(input)

    def ConnectToSame(self, exemplar: InputPort, dest: InputPort) -> bool:
        """Lets `dest` take its value from where `exemplar` does; False if that is nowhere."""
        self._not_built("ConnectToSame")
        self._has(expect("ConnectToSame", exemplar, InputPort).get_system(), "ConnectToSame")
        self._free(dest, "ConnectToSame")
        source = self._wires.get((exemplar.get_system(), exemplar._index))
        if source is not None:
            self.Connect(source[0].get_output_port(source[1]), dest)
            return True
        for k, (_, ports) in enumerate(self._inputs):
            if any(p.get_system() is exemplar.get_system() and p._index == exemplar._index for p in ports):
                self.ConnectInput(k, dest)
                return True
        return False

    def ExportInput(self, input: InputPort, name: str | UseDefaultName = kUseDefaultName) -> InputPortIndex:
        """Makes an input port one of the diagram's; gives its number there."""
        self._not_built("ExportInput")
        if not isinstance(input, InputPort):
            raise Mismatch(f"ExportInput(): incompatible function arguments: {input!r} is no InputPort")
        self._free(input, "ExportInput")
        self._inputs.append((self._export_name(input, name, [n for n, _ in self._inputs], "input"), [input]))
        return InputPortIndex(len(self._inputs) - 1)

    def ExportOutput(self, output: OutputPort, name: str | UseDefaultName = kUseDefaultName) -> OutputPortIndex:
        """Makes an output port one of the diagram's; gives its number there."""
        self._not_built("ExportOutput")
        if not isinstance(output, OutputPort):
            raise Mismatch(f"ExportOutput(): incompatible function arguments: {output!r} is no OutputPort")
        self._has(output.get_system(), "ExportOutput")
        self._outputs.append((self._export_name(output, name, [n for n, _ in self._outputs], "output"), output))
        return OutputPortIndex(len(self._outputs) - 1)

    def _export_name(
        self, port: InputPort | OutputPort, name: str | UseDefaultName, taken: list[str], kind: str
    ) -> str:
        if isinstance(name, UseDefaultName):
            name = f"{port.get_system().get_name()}_{port.get_name()}"
        if not isinstance(name, str):
            raise Mismatch(f"Export{kind.title()}(): incompatible function arguments: {name!r} is no str")
        if not name:
            raise RuntimeError(f"DiagramBuilder.Export{kind.title()}(): the name of a port must not be empty.")
        if name in taken:
            raise RuntimeError(f"DiagramBuilder.Export{kind.title()}(): there is an {kind} port named {name} already.")
        return name

    def IsConnectedOrExported(self, port: InputPort) -> bool:
        """Whether an input port takes its value from somewhere."""
        system, i = expect("IsConnectedOrExported", port, InputPort).get_system(), port._index
        if (system, i) in self._wires:
            return True
        return any(p.get_system() is system and p._index == i for _, ports in self._inputs for p in ports)

    def connection_map(self) -> dict:
        """What feeds what: {(system, input port index): (system, output port index)}."""
        return {(a, InputPortIndex(i)): (b, OutputPortIndex(j)) for (a, i), (b, j) in self._wires.items()}

    # Building.

    def Build(self) -> Diagram:
        """The diagram.

        Raises:
            RuntimeError: it is empty, names are not unique, or there is an algebraic loop.
        """
        diagram = Diagram._template[self._scalar]()  # type: ignore[attr-defined]
        self.BuildInto(diagram)
        return diagram

    def BuildInto(self, target: Diagram) -> None:
        """Makes `target`, which must be an empty Diagram, what this builder describes."""
        self._not_built("Build")
        if not self._systems:
            raise RuntimeError("Cannot Compile an empty DiagramBuilder.")
        if target._systems:
            raise RuntimeError(f"DiagramBuilder.BuildInto(): {target._describe()} is built already.")
        self._check_names()
        place = self._place
        wires = {(place[a._system_id], i): (place[b._system_id], j) for (a, i), (b, j) in self._wires.items()}
        inputs = [(name, [(place[p.get_system()._system_id], p._index) for p in ports]) for name, ports in self._inputs]
        outputs = [(name, (place[p.get_system()._system_id], p._index)) for name, p in self._outputs]
        trial = Diagram()
        trial._name = target._name
        parents = [s._parent_ref for s in self._systems]
        trial._fill(self._systems, wires, inputs, outputs)
        try:
            if _has_circle(wires, len(self._systems)):  # without one there is no loop that subsystems do not have
                Topology(trial)  # raises on an algebraic loop, before anything is changed
        except RuntimeError:
            for system, parent in zip(self._systems, parents):
                system._parent_ref = parent
            raise
        target._fill(self._systems, wires, inputs, outputs)
        target._scalar = self._scalar
        self._built = True
        self._systems, self._wires, self._inputs, self._outputs = [], {}, [], []

    def _check_names(self) -> None:
        seen: set[str] = set()
        for system in self._systems:
            name = system.get_name()
            if name in seen:
                raise RuntimeError(
                    f'System of type {system.GetSystemType()} has non-unique name "{name}" in this DiagramBuilder; '
                    "names of sibling systems must differ."
                )
            seen.add(name)


def _has_circle(wires: dict[tuple[int, int], tuple[int, int]], count: int) -> bool:
    """Whether wires lead from one of `count` systems back to it, through whatever it does with its inputs."""
    waits = [0] * count
    readers: list[list[int]] = [[] for _ in waits]
    for (reader, _), (source, _) in wires.items():
        waits[reader] += 1
        readers[source].append(reader)
    order = [k for k in range(count) if not waits[k]]
    for k in order:  # grows while it is walked
        for reader in readers[k]:
            waits[reader] -= 1
            if not waits[reader]:
                order.append(reader)
    return len(order) < count


def _mismatch(what: str, output: OutputPort, input: InputPort, output_is: str, input_is: str) -> RuntimeError:
    """The error for ports that do not fit each other."""
    return RuntimeError(
        f"DiagramBuilder::Connect: {what} while connecting output port '{output.get_name()}' of "
        f"{output.get_system()._describe()}, which {output_is}, to input port '{input.get_name()}' of "
        f"{input.get_system()._describe()}, which {input_is}."
    )
