"""Ports of any system: declaring, finding and reading them."""

from __future__ import annotations

import operator
from typing import TYPE_CHECKING, Any, SupportsIndex

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._overloads import Mismatch, expect
from sheldrake.common.value import AbstractValue, Value
from sheldrake.systems.framework._declarations import InputDeclaration
from sheldrake.systems.framework._index import PortDataType, UseDefaultName
from sheldrake.systems.framework._port import FLOAT64, InputPort, OutputPort
from sheldrake.systems.framework._system_base import SystemBase
from sheldrake.systems.framework._vector import BasicVector

if TYPE_CHECKING:
    from sheldrake.common._random import RandomDistribution
    from sheldrake.systems.framework._context.context import Context


class SystemPorts(SystemBase):
    """The part of System that is about ports."""

    def DeclareInputPort(
        self, name: str | UseDefaultName, type: PortDataType, size: int, random_type: RandomDistribution | None = None
    ) -> InputPort:
        """Declares an input port; an abstract one takes any object."""
        model: Any = BasicVector(np.zeros(size)) if type is PortDataType.kVectorValued else Value[object](None)
        return self._declare_input(name, type, size, model, random_type)

    def _declare_input(
        self,
        name: str | UseDefaultName,
        data_type: PortDataType,
        size: int,
        model: BasicVector | AbstractValue,
        random_type: RandomDistribution | None = None,
    ) -> InputPort:
        i = len(self._inputs)
        name = f"u{i}" if isinstance(name, UseDefaultName) else name
        self._check_name(name, self._inputs, "input")
        self._inputs.append(InputDeclaration(name, data_type, int(size), model, random_type, self._new_ticket("in", i)))
        self._changed()
        return self._input_port(i)

    def _check_name(self, name: object, ports: list, kind: str) -> None:
        if not isinstance(name, str):
            raise Mismatch(f"incompatible function arguments: the name of a port must be a str, not {name!r}")
        if not name:
            raise RuntimeError(f"System.Declare{kind.title()}Port(): the name of a port must not be empty.")
        taken = self._port_names[kind]
        taken.update((port.name, None) for port in ports[len(taken) :])  # those declared since the last look
        if name in taken:
            raise RuntimeError(f"{self._describe()} already has an {kind} port named {name}")

    def get_input_port(self, port_index: SupportsIndex | None = None, warn_deprecated: bool = True) -> InputPort:
        """Input port `port_index`, or the only one."""
        return self._input_port(self._port_number(port_index, len(self._inputs), "input"))

    def get_output_port(self, port_index: SupportsIndex | None = None, warn_deprecated: bool = True) -> OutputPort:
        """Output port `port_index`, or the only one."""
        return self._output_port(self._port_number(port_index, len(self._outputs), "output"))

    def _port_number(self, index: SupportsIndex | None, count: int, kind: str) -> int:
        if type(index) is int and 0 <= index < count:
            return index
        if index is None:
            if count != 1:
                raise RuntimeError(
                    f"System::get_{kind}_port(): {self.GetSystemType()} system '{self.GetSystemPathname()}' has "
                    f"{count} {kind}s, so this convenience function cannot be used; instead, use another overload "
                    f"e.g. get_{kind}_port({kind.title()}PortIndex) or Get{kind.title()}Port(string)"
                )
            return 0
        if not hasattr(index, "__index__"):
            raise Mismatch(f"get_{kind}_port(): incompatible function arguments: expected an index, got {index!r}")
        i = operator.index(index)
        if i < 0:
            raise IndexError(
                f"System::get_{kind}_port(): negative port index {i} is illegal. (System {self.GetSystemPathname()})"
            )
        if i >= count:
            raise IndexError(
                f"System::get_{kind}_port(): there is no {kind} port with index {i} because there are only {count} "
                f"{kind} ports in system {self.GetSystemPathname()}."
            )
        return i

    def _named(self, ports: list, name: str, kind: str) -> int:
        expect(f"Get{kind.title()}Port", name, str)
        for i, port in enumerate(ports):
            if port.name == name:
                return i
        valid = ", ".join(port.name for port in ports) or f"it has no {kind} ports"
        raise RuntimeError(
            f"System {self.GetSystemName()} does not have an {kind} port named {name} (valid port names: {valid})"
        )

    @checked
    def GetInputPort(self, port_name: str) -> InputPort:
        """The input port of this name."""
        return self._input_port(self._named(self._inputs, port_name, "input"))

    @checked
    def GetOutputPort(self, port_name: str) -> OutputPort:
        """The output port of this name."""
        return self._output_port(self._named(self._outputs, port_name, "output"))

    @checked
    def HasInputPort(self, port_name: str) -> bool:
        """Whether there is an input port of this name."""
        return any(port.name == port_name for port in self._inputs)

    @checked
    def HasOutputPort(self, port_name: str) -> bool:
        """Whether there is an output port of this name."""
        return any(port.name == port_name for port in self._outputs)

    def EvalVectorInput(self, context: Context, port_index: int) -> BasicVector | Any:
        """Value of a vector input port; None without one, which whom it concerns knows: type checkers need not ask.

        Raises:
            RuntimeError: the port is abstract.
        """
        try:  # the one that has to be quick
            if context._system is self and self._inputs[port_index].data_type is PortDataType.kVectorValued:
                read = context._reads.get(port_index)
                if read is not None and (value := read()).dtype is FLOAT64:
                    return BasicVector._view(value)
        except (AttributeError, IndexError, TypeError):
            pass
        port = self._numbered_input("EvalVectorInput", port_index)
        if port.get_data_type() is PortDataType.kAbstractValued:
            raise RuntimeError(
                f"System::EvalVectorInput(): vector port required, but input port {port.get_name()!r} (index "
                f"{int(port.get_index())}) was declared abstract: use EvalAbstractInput()."
            )
        return port._as_vector(port.Eval(context)) if port.HasValue(context) else None

    def EvalAbstractInput(self, context: Context, port_index: int) -> AbstractValue | Any:
        """Value of an input port as an AbstractValue; None without one, for type checkers as in `EvalVectorInput`."""
        return self._numbered_input("EvalAbstractInput", port_index)._abstract_if_any(context)

    def _numbered_input(self, call: str, port_index: int) -> InputPort:
        if port_index is None:
            raise Mismatch(f"{call}(): incompatible function arguments: expected the index of a port, got None.")
        return self.get_input_port(port_index)

    @checked
    def AllocateInputVector(self, input_port: InputPort) -> BasicVector:
        """A vector that fits an input port.

        Raises:
            RuntimeError: the port is abstract.
        """
        if input_port.get_data_type() is PortDataType.kAbstractValued:
            raise RuntimeError(f"AllocateInputVector(): {input_port.GetFullDescription()} is abstract.")
        return input_port.Allocate().get_value()

    @checked
    def AllocateInputAbstract(self, input_port: InputPort) -> AbstractValue:
        """A value that fits an input port."""
        return input_port.Allocate()

    @checked
    def FixInputPortsFrom(self, other_system: SystemPorts, other_context: Any, target_context: Any) -> None:
        """Fixes all input ports to the values that a system built alike has on its own."""
        for i in range(self.num_input_ports()):
            source = other_system.get_input_port(i)
            if source.HasValue(other_context):
                value = source.EvalAbstract(other_context)
                target = self.get_input_port(i)
                if source.get_data_type() is PortDataType.kVectorValued:
                    target.FixValue(target_context, list(value.get_value()))
                else:
                    target.FixValue(target_context, value)
