"""Settings with defaults, as pydrake's structs of options have them."""

from __future__ import annotations

import copy
import dataclasses
import typing
from types import SimpleNamespace
from typing import Any, ClassVar


class Options:
    """Named settings. Derived classes list `_fields`: name, type, default.

    Raises:
        AttributeError: a setting is given or set that it does not have.
    """

    _fields: ClassVar[tuple[tuple[str, Any, Any], ...]] = ()
    __fields__: ClassVar[tuple] = ()

    def __init_subclass__(cls) -> None:
        cls.__fields__ = tuple(SimpleNamespace(name=name, type=kind) for name, kind, _ in cls._fields)

    def __init__(self, **kwargs: Any):
        for name, _, default in self._fields:
            object.__setattr__(self, name, copy.deepcopy(default))
        for name, value in kwargs.items():
            setattr(self, name, value)

    def __setattr__(self, name: str, value: Any) -> None:
        kinds = {field: kind for field, kind, _ in self._fields}
        if name not in kinds:
            raise AttributeError(f"{type(self).__name__} has no field {name!r}; it has {', '.join(kinds)}.")
        object.__setattr__(self, name, _converted(type(self).__name__, name, kinds[name], value))

    def __repr__(self) -> str:
        fields = ", ".join(f"{name}={getattr(self, name)!r}" for name, _, _ in self._fields)
        return f"{type(self).__name__}({fields})"

    def __copy__(self) -> Any:
        return type(self)(**{name: getattr(self, name) for name, _, _ in self._fields})

    def __deepcopy__(self, memo: dict) -> Any:
        return type(self)(**{name: copy.deepcopy(getattr(self, name), memo) for name, _, _ in self._fields})


def _converted(owner: str, name: str, kind: Any, value: Any) -> Any:
    """The value as the field's type: numbers are converted, all else is taken as it is.

    Raises:
        TypeError: a number was expected.
    """
    if kind not in (int, float, bool):
        return value
    try:
        if kind is int and int(value) != value:
            raise ValueError
        return kind(value)
    except (TypeError, ValueError):
        raise TypeError(
            f"{owner}.{name}: incompatible function arguments; expected {kind.__name__}, got {value!r}."
        ) from None


def typed_fields(cls: Any) -> Any:
    """Adds `__fields__`, the (name, type) pairs which typed YAML loading reads; every field is found on the class."""
    types = typing.get_type_hints(cls)
    cls.__fields__ = tuple(SimpleNamespace(name=f.name, type=types[f.name]) for f in dataclasses.fields(cls))
    for field in dataclasses.fields(cls):
        if not hasattr(cls, field.name):
            setattr(cls, field.name, field.default_factory())  # type: ignore[operator]
    return cls
