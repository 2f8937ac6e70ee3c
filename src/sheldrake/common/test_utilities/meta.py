"""One test method for each of several sets of arguments."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable
from typing import Any

__all__ = ["ValueParameterizedTest", "run_with_multiple_values"]

_VALUES = "_sheldrake_values"


def run_with_multiple_values(values: Iterable[dict[str, Any]]) -> Callable:
    """Decorator of a test method: it is run once for each dict of keyword arguments in `values`.

    The class needs `metaclass=ValueParameterizedTest`.
    """

    def decorate(function: Callable) -> Callable:
        setattr(function, _VALUES, [dict(v) for v in values])
        return function

    return decorate


class ValueParameterizedTest(type):
    """Metaclass of test cases: replaces a decorated `test_x(self, a)` by `test_x_a_1(self)` and so on."""

    def __new__(mcs, name: str, bases: tuple, namespace: dict[str, Any]) -> ValueParameterizedTest:
        """The class with one method for each set of arguments."""
        methods: dict[str, Any] = {}
        for key, member in namespace.items():
            values = getattr(member, _VALUES, None)
            if values is None:
                methods[key] = member
                continue
            for number, kwargs in enumerate(values):
                words = "_".join(f"{k}_{_word(v)}" for k, v in kwargs.items())
                own = f"{key}_{words}" if f"{key}_{words}" not in methods else f"{key}_{words}_{number}"
                methods[own] = functools.partialmethod(member, **kwargs)
        return super().__new__(mcs, name, bases, methods)


def _word(value: Any) -> str:
    text = value.__name__ if isinstance(value, type) else str(value)
    return "".join(c if c.isalnum() else "_" for c in text)
