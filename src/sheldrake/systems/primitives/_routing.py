"""Buses, selections, and a holder of objects."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._options import Options
from sheldrake.common.value import AbstractValue, Value
from sheldrake.systems.framework import BusValue, LeafSystem, PortDataType, UseDefaultName, kUseDefaultName
from sheldrake.systems.framework._templates import on_scalar_of
from sheldrake.systems.framework._vector import BasicVector
from sheldrake.systems.primitives._kernels import blocks

if TYPE_CHECKING:
    from collections.abc import Callable

    from sheldrake.systems.framework import Context, DiagramBuilder
    from sheldrake.systems.framework._port import InputPort
    from sheldrake.systems.framework._system import System


class BusCreator(LeafSystem):
    """Packs all its inputs into one bus, each under its port's name; inputs without a value are left out.

    Args:
        output_port_name: Name of the output.
    """

    _generic = True

    def __init__(self, output_port_name: str | UseDefaultName = kUseDefaultName):
        super().__init__()
        self.DeclareAbstractOutputPort(output_port_name, Value[BusValue]().Clone, self._pack)

    def _pack(self, context: Context, output: AbstractValue) -> None:
        values = output.get_mutable_value()._values  # those of the last time, which numbers are written into
        for i, declaration in enumerate(self._inputs):
            name, read = declaration.name, context._reads.get(i)  # what a connected port that was asked before leaves
            known = values.get(name) if declaration.data_type is PortDataType.kVectorValued else None
            if read is not None and known is not None:
                known.get_mutable_value().SetFromVector(read())
                continue
            port = self.get_input_port(i)
            if not port.HasValue(context):
                values.pop(name, None)
            elif known is not None:
                known.get_mutable_value().SetFromVector(port.Eval(context))
            else:
                values[name] = port.EvalAbstract(context).Clone()

    def DeclareVectorInputPort(self, name: str | UseDefaultName, size: int, *args: Any) -> InputPort:  # type: ignore[override]
        """Declares one more vector input."""
        return super().DeclareVectorInputPort(name, size, *args)


class BusSelector(LeafSystem):
    """Unpacks a bus: each output shows the value under its port's name.

    Args:
        input_port_name: Name of the input.
    """

    _generic = True

    def __init__(self, input_port_name: str | UseDefaultName = kUseDefaultName):
        super().__init__()
        self.DeclareAbstractInputPort(input_port_name, Value[BusValue]())

    def _find(self, context: Context, name: str) -> Any:
        read = context._reads.get(0)  # what the port leaves when it has been asked before
        bus = self.get_input_port(0).Eval(context) if read is None else read()
        found = bus.Find(name)
        if found is None:
            valid = ", ".join(bus) or "nothing"
            raise RuntimeError(
                f"Missing value for input signal {name} on {self.GetSystemPathname()}; the bus carries {valid}."
            )
        return found

    def DeclareVectorOutputPort(self, name: str | UseDefaultName, size: int, *args: Any) -> Any:  # type: ignore[override]
        """Declares an output for the vector under its name."""
        j = len(self._outputs)
        name = f"y{j}" if isinstance(name, UseDefaultName) else name

        def calc(system: BusSelector, context: Context, output: BasicVector) -> None:
            found = system._find(context, name)
            if not isinstance(found, BasicVector):
                raise RuntimeError(f"BusSelector: the input signal {name} is {found!r}, not a vector.")
            output.SetFromVector(found._v)

        return super().DeclareVectorOutputPort(name, size, _method_of(self, calc))

    def DeclareAbstractOutputPort(  # type: ignore[override]
        self, name: str | UseDefaultName, model_value: AbstractValue, *args: Any
    ) -> Any:
        """Declares an output for the value under its name."""
        j = len(self._outputs)
        name = f"y{j}" if isinstance(name, UseDefaultName) else name
        return super().DeclareAbstractOutputPort(
            name,
            model_value.Clone().Clone,
            _method_of(self, lambda system, context, output: output.set_value(system._find(context, name))),
        )


def _method_of(system: System, function: Callable[..., Any]) -> Any:
    from types import MethodType

    return MethodType(function, system)


class SelectorParams(Options):
    """What a Selector does: its inputs and outputs."""

    class InputPortParams(Options):
        """Name (or None) and size of an input."""

        name: str | None = None
        size: int = 0

    class OutputSelection(Options):
        """One element of an input."""

        input_port_index: int = 0
        input_offset: int = 0

    class OutputPortParams(Options):
        """Name (or None) and elements of an output."""

        name: str | None = None
        selections: list = []

    inputs: list[InputPortParams] = []
    outputs: list[OutputPortParams] = []


class Selector(LeafSystem):
    """Outputs made of chosen elements of the inputs.

    Args:
        params: Which ones.
    """

    _generic = True

    def __init__(self, params: SelectorParams):
        super().__init__()
        for i, given in enumerate(params.inputs):
            self.DeclareVectorInputPort(f"u{i}" if given.name is None else given.name, given.size)
        for port in params.outputs:
            picks = [(s.input_port_index, s.input_offset) for s in port.selections]
            for i, k in picks:
                if not 0 <= i < len(params.inputs) or not 0 <= k < params.inputs[i].size:
                    sizes = [p.size for p in params.inputs]
                    raise RuntimeError(
                        f"Selector: there is no element {k} of input {i}; the inputs have sizes {sizes}."
                    )
            j = len(self._outputs)
            self.DeclareVectorOutputPort(f"y{j}" if port.name is None else port.name, len(picks), blocks.pick)
            self._output_models[j] = {"model": blocks.Picks(np.array(picks, np.int64).reshape(-1, blocks.Pick.SIZE))}


class SharedPointerSystem(LeafSystem):
    """Holds an object, so that it lives as long as the diagram.

    Args:
        value_to_hold: The object.
    """

    _generic = True

    def __init__(self, value_to_hold: Any):
        super().__init__()
        self._value = value_to_hold

    @staticmethod
    def AddToBuilder(builder: DiagramBuilder, value_to_hold: Any) -> Any:
        """Adds a holder of an object to a builder; gives the object."""
        builder.AddSystem(on_scalar_of(builder, SharedPointerSystem)(value_to_hold))
        return value_to_hold

    def get(self) -> Any:
        """The object."""
        return self._value
