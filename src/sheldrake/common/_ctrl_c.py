"""Ctrl-C in loops that wait for people."""

from __future__ import annotations

import contextlib
import importlib
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from types import FrameType


@contextlib.contextmanager
def deferred_ctrl_c() -> Iterator[Callable[[], None]]:
    """Gives a function that raises KeyboardInterrupt once Ctrl-C was pressed; a second Ctrl-C raises at once.

    Python raises at whatever line it happens to be: in the middle of a change that should be whole, or in a callback of
    the garbage collector, where the exception is lost and the program goes on. A loop that calls the function every
    round ends at a sound place, and ends for certain. In threads, and where somebody else handles Ctrl-C, nothing
    changes.
    """
    pressed: list[bool] = []

    def check() -> None:
        if pressed:
            pressed.clear()  # it is told
            raise KeyboardInterrupt

    def note(_number: int, _frame: FrameType | None) -> None:
        check()
        pressed.append(True)

    in_main_thread = threading.current_thread() is threading.main_thread()
    if not in_main_thread or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield check
        return
    signal.signal(signal.SIGINT, note)
    try:
        yield check
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    check()


def imported(name: str) -> Any:
    """Imports a module that takes Ctrl-C for one more library that is not there; Ctrl-C then counts when it is done.

    trimesh tries each library that it may use, catches every exception of that, and does without the library.
    """
    if name not in sys.modules:
        with deferred_ctrl_c():
            importlib.import_module(name)
    return sys.modules[name]
