"""Labels of objects in label images."""

from __future__ import annotations

from typing import ClassVar

from sheldrake.common._checked import checked
from sheldrake.common.value import _register_value_type

_MAX_UNRESERVED = 2**15 - 1 - 4
_RESERVED = {32764: "kDontCare", 32765: "kDoNotRender", 32766: "kEmpty", 32767: "kUnspecified"}


class RenderLabel:
    """A small non-negative number that identifies an object (or a class of objects) in a label image."""

    __slots__ = ("_value",)
    kEmpty: ClassVar[RenderLabel]
    kDoNotRender: ClassVar[RenderLabel]
    kDontCare: ClassVar[RenderLabel]
    kUnspecified: ClassVar[RenderLabel]
    kMaxUnreserved: ClassVar[int] = _MAX_UNRESERVED

    @checked
    def __init__(self, value: int) -> None:
        value = int(value)
        if not 0 <= value <= _MAX_UNRESERVED:
            raise RuntimeError(f"Invalid construction of RenderLabel with invalid value: {value}")
        self._value = value

    def is_reserved(self) -> bool:
        """True for the four labels with a name of their own."""
        return self._value > _MAX_UNRESERVED

    def __int__(self) -> int:
        return self._value

    def __eq__(self, other: object) -> bool:
        if isinstance(other, (RenderLabel, int)):
            return self._value == int(other)
        return NotImplemented

    def __hash__(self) -> int:
        return hash(self._value)

    def __repr__(self) -> str:
        if self._value == _MAX_UNRESERVED:
            return "RenderLabel.kMaxUnreserved"
        name = _RESERVED.get(self._value)
        return f"RenderLabel.{name}" if name else f"RenderLabel({self._value})"


def _reserved(value: int) -> RenderLabel:
    label = object.__new__(RenderLabel)
    label._value = value
    return label


for _value, _name in _RESERVED.items():
    setattr(RenderLabel, _name, _reserved(_value))
_register_value_type(RenderLabel)
