"""Calls of a system that return one of its ports, a line each.

class Propeller(LeafSystem):
    get_command_input_port = input_port("propeller_command", "Input: one command a propeller.")
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from sheldrake.common._made_methods import MadeMethod

if TYPE_CHECKING:
    from typing import Generic, TypeVar

    from sheldrake.systems.framework._port import InputPort, OutputPort

    _Port = TypeVar("_Port", InputPort, OutputPort)

    class _Getter(Generic[_Port]):
        """What a type checker sees: a method without arguments."""

        def __get__(self, system: object, owner: type) -> Callable[[], _Port]: ...


def input_port(port: int | str, doc: str = "") -> _Getter[InputPort]:
    """A call that returns an input port.

    Args:
        port: Its index, or its name.
        doc: What the call's docstring says.
    """

    def by_index(self: Any) -> InputPort:
        return self.get_input_port(port)

    def by_name(self: Any) -> InputPort:
        return self.GetInputPort(port)

    get = by_name if isinstance(port, str) else by_index
    return MadeMethod(get, doc or f"The input port {port}.")  # type: ignore[return-value]


def output_port(port: int | str, doc: str = "") -> _Getter[OutputPort]:
    """A call that returns an output port; see `input_port`."""

    def by_index(self: Any) -> OutputPort:
        return self.get_output_port(port)

    def by_name(self: Any) -> OutputPort:
        return self.GetOutputPort(port)

    get = by_name if isinstance(port, str) else by_index
    return MadeMethod(get, doc or f"The output port {port}.")  # type: ignore[return-value]
