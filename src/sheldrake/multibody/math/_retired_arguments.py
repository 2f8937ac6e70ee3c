"""Argument names that Drake retired in 2023, still taken, with a hint."""

from __future__ import annotations

import functools
import warnings
from collections.abc import Callable
from typing import Any

from sheldrake.common.deprecation import DrakeDeprecationWarning

_Z = (0.0, 0.0, 1.0)


def retired_arguments(before: int | None = None, **today: str) -> Callable[[Callable], Callable]:
    """Decorator: takes retired keywords for today's, and the z axis for a missing `unit_vector`.

    Args:
        before: How many arguments come before `unit_vector`, if that used to be optional.
        today: Today's name of each retired keyword.
    """

    def decorate(function: Callable) -> Callable:
        @functools.wraps(function)
        def wrapper(cls: type, *args: Any, **kwargs: Any) -> Any:
            retired = [name for name in kwargs if name in today]
            if retired:
                hints = ", ".join(f"{name} is now {today[name]}" for name in retired)
                _hint(f"UnitInertia.{function.__name__}(): {hints}.")
                kwargs = {today.get(name, name): value for name, value in kwargs.items()}
            if before is not None and len(args) + len(kwargs) == before and "unit_vector" not in kwargs:
                _hint(f"UnitInertia.{function.__name__}() needs unit_vector now; taking the z axis.")
                kwargs["unit_vector"] = _Z
            return function(cls, *args, **kwargs)

        return wrapper

    return decorate


def _hint(text: str) -> None:
    warnings.warn(text, DrakeDeprecationWarning, stacklevel=3)
