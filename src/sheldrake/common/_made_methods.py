"""Methods that are made rather than written out, where a class has many that differ by a word."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


class MadeMethod:
    """Becomes a method of the class whose attribute it is, with the name that it has there.

    Args:
        function: What the method does.
        doc: Its docstring.
        static: Whether it is one that takes no `self`.
    """

    def __init__(self, function: Callable[..., Any], doc: str, static: bool = False) -> None:
        self._function, self._static, function.__doc__ = function, static, doc

    def __set_name__(self, owner: type, name: str) -> None:
        made = self._function
        made.__name__, made.__qualname__, made.__module__ = name, f"{owner.__qualname__}.{name}", owner.__module__
        setattr(owner, name, staticmethod(made) if self._static else made)
