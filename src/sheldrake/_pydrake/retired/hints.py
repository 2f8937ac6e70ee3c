"""How a retired name says so."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any


def hint(text: str) -> None:
    """Warns the caller of what calls this that something is retired."""
    from sheldrake.common.deprecation import DrakeDeprecationWarning

    warnings.warn(text, DrakeDeprecationWarning, stacklevel=3)


def forwarded(new: Callable, old: str, today: str) -> Callable:
    """A function that warns that `old` is retired in favour of `today` and calls `new`."""

    def function(*args: Any, **kwargs: Any) -> Any:
        hint(f"{old}() is retired: use {today}.")
        return new(*args, **kwargs)

    function.__name__ = function.__qualname__ = old
    function.__doc__ = f"Retired: use {today}."
    return function
