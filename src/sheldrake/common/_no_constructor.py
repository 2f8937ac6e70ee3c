"""Classes whose objects come from a call, not from their own names."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any


def no_constructor(instead: str = "") -> Callable[..., None]:
    """An `__init__` that says that there is none, as pydrake does.

    Args:
        instead: A sentence on where objects of the class come from.
    """

    def __init__(self: Any, *args: object, **kwargs: object) -> None:
        raise TypeError(f"{_name_of(type(self))}: No constructor defined!{instead and ' '}{instead}")

    return __init__


def _name_of(cls: type) -> str:
    """A class of this library as pydrake calls it, where it is public; one of its user by its name."""
    library, *modules = cls.__module__.split(".")
    if library != "sheldrake":
        return cls.__name__
    public = itertools.takewhile(lambda module: not module.startswith("_"), modules)
    return ".".join(["pydrake", *public, cls.__qualname__])
