"""Vectors whose elements have names."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

from sheldrake.systems.framework import BasicVector


class NamedVector(BasicVector):
    """A BasicVector with `name()`, `set_name(value)` and `with_name(value)` for each of the class's elements."""

    elements: ClassVar[dict[str, float]] = {}
    """Names and default values, in order."""

    if TYPE_CHECKING:  # the accessors are made below

        def __getattr__(self, name: str) -> Any: ...

    def __init__(self) -> None:
        super().__init__(list(self.elements.values()))

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        for index, name in enumerate(cls.elements):
            _add_accessors(cls, index, name)


def _add_accessors(cls: type, index: int, name: str) -> None:
    def get(self: Any) -> Any:
        return self[index]

    def set_(self: Any, value: Any) -> None:
        self[index] = value

    def with_(self: Any, value: Any) -> Any:
        changed = self.Clone()
        changed[index] = value
        return changed

    for function, called, text in (
        (get, name, f"The element {name}."),
        (set_, f"set_{name}", f"Sets the element {name}."),
        (with_, f"with_{name}", f"A copy with another {name}."),
    ):
        function.__name__, function.__qualname__, function.__doc__ = called, f"{cls.__qualname__}.{called}", text
        setattr(cls, called, function)
