"""How a retired name says so."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Callable
from typing import Any

_HOUSE = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__)))) + os.sep
_MADE_HERE = "<checked>"  # what `common/_checked.py` calls the functions that it writes
_IMPORT = "<frozen importlib"


def hint(text: str) -> None:
    """Warns that something is retired, at the line outside the library that asked for it."""
    from sheldrake.common.deprecation import DrakeDeprecationWarning

    warnings.warn(text, DrakeDeprecationWarning, stacklevel=_frames_of_the_house())


def _frames_of_the_house() -> int:
    """How many frames are above the first one that is not the library's; `warnings` counts none of an import."""
    frame, level = sys._getframe(1), 1
    while frame.f_back is not None and frame.f_code.co_filename.startswith((_HOUSE, _MADE_HERE, _IMPORT)):
        frame = frame.f_back
        level += not frame.f_code.co_filename.startswith(_IMPORT)
    return level


def forwarded(new: Callable, old: str, today: str = "") -> Callable:
    """A function that warns that `old` is retired in favour of `today`, by default `new`, and calls `new`."""
    today = today or f"{new.__name__}()"

    def function(*args: Any, **kwargs: Any) -> Any:
        hint(f"{old}() is retired: use {today}.")
        return new(*args, **kwargs)

    function.__name__ = function.__qualname__ = old
    function.__doc__ = f"Retired: use {today}."
    return function
