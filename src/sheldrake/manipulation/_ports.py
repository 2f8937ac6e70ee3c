"""Getters of ports by pydrake's names: the systems that speak with arms have many ports, and each has a getter."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from sheldrake.systems.framework import InputPort, OutputPort


def input_port(name: str, what: str = "") -> Callable[[Any], InputPort]:
    """A method that returns the input port of this name."""

    def get(self: Any) -> InputPort:
        return self.GetInputPort(name)

    return _described(get, "input", name, what)


def output_port(name: str, what: str = "") -> Callable[[Any], OutputPort]:
    """A method that returns the output port of this name."""

    def get(self: Any) -> OutputPort:
        return self.GetOutputPort(name)

    return _described(get, "output", name, what)


def _described(get: Any, kind: str, name: str, what: str) -> Any:
    get.__doc__ = f"The {kind} port {name}{': ' if what else ''}{what}."
    get.__name__ = f"get_{name}_{kind}_port"
    return get
