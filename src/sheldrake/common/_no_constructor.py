"""Classes whose objects come from a call, not from their own names."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any, TypeVar

_Class = TypeVar("_Class", bound=Any)


def no_constructor(instead: str = "") -> Callable[[_Class], _Class]:
    """Decorates a class that says, as pydrake does, that it has no constructor; derived ones may have one.

    Args:
        instead: A sentence on where objects of the class come from.
    """

    def __init__(self: Any, *args: object, **kwargs: object) -> None:
        raise TypeError(f"{_name_of(type(self))}: No constructor defined!{instead and ' '}{instead}")

    def decorate(cls: _Class) -> _Class:
        cls.__init__ = __init__
        return cls

    return decorate


def _name_of(cls: type) -> str:
    """A class of this library as pydrake calls it, where it is public; one of its user by its name."""
    library, *modules = cls.__module__.split(".")
    if library != "sheldrake":
        return cls.__name__
    public = itertools.takewhile(lambda module: not module.startswith("_"), modules)
    return ".".join(["pydrake", *public, cls.__qualname__])
