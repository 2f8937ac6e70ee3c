"""Calls of a system that return one of its ports, a line each.

class Propeller(LeafSystem):
    get_command_input_port = input_port("propeller_command", "Input: one command a propeller.")
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from typing import Generic, TypeVar

    from sheldrake.systems.framework._port import InputPort, OutputPort

    _Port = TypeVar("_Port", InputPort, OutputPort)

    class _Getter(Generic[_Port]):
        """What a type checker sees: a method without arguments."""

        def __get__(self, system: object, owner: type) -> Callable[[], _Port]: ...


class _Method:
    """Becomes a method of the class that it is put into, by the name it has there."""

    def __init__(self, get: Callable[[Any], Any], doc: str) -> None:
        self._get, get.__doc__ = get, doc

    def __set_name__(self, owner: type, name: str) -> None:
        get = self._get
        get.__name__, get.__qualname__, get.__module__ = name, f"{owner.__qualname__}.{name}", owner.__module__
        setattr(owner, name, get)


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
    return _Method(get, doc or f"The input port {port}.")  # type: ignore[return-value]


def output_port(port: int | str, doc: str = "") -> _Getter[OutputPort]:
    """A call that returns an output port; see `input_port`."""

    def by_index(self: Any) -> OutputPort:
        return self.get_output_port(port)

    def by_name(self: Any) -> OutputPort:
        return self.GetOutputPort(port)

    get = by_name if isinstance(port, str) else by_index
    return _Method(get, doc or f"The output port {port}.")  # type: ignore[return-value]
