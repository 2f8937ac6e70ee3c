"""One line that tells how far a long simulation is, when somebody is looking."""

from __future__ import annotations

import os
import sys
import time
from typing import Any

from sheldrake.common._notebook import in_notebook


class Progress:
    """A line on the terminal (or in the notebook) after the first seconds of an advance.

    Args:
        begin: Time at which the advance begins [s].
        end: Time at which it will end [s].
        shown: Whether to show it at all.
    """

    PATIENCE = 2.0
    """Silent for as long [s]."""
    EVERY = 0.2
    """Time between updates [s]."""

    def __init__(self, begin: float, end: float, shown: bool):
        self._begin, self._end = begin, end
        self._start = time.monotonic()
        self._next = self._start + self.PATIENCE
        self._shown = shown
        self._line: _OnTerminal | _InNotebook | None = None

    def update(self, t: float) -> None:
        """Says that simulation time is now `t` [s]."""
        now = time.monotonic()
        if not self._shown or now < self._next:
            return
        if self._line is None:
            self._line = _line() if self._end < float("inf") else None
            self._shown = self._line is not None
            if self._line is None:
                return
        self._next = now + self.EVERY
        rate = (t - self._begin) / (now - self._start)
        left = (self._end - t) / rate if rate > 0 else float("inf")
        self._line.write(f"simulating: {t:.3f} of {self._end:g} s, {rate:.3g}x real time, {_duration(left)} left")

    def close(self) -> None:
        """Wipes the line."""
        if self._line is not None:
            self._line.wipe()
            self._line = None


class _OnTerminal:
    """A line of standard error that is written over."""

    def __init__(self) -> None:
        self._length = 0

    def write(self, text: str) -> None:
        """Writes the text over what stood there."""
        sys.stderr.write("\r" + text.ljust(self._length))
        sys.stderr.flush()
        self._length = len(text)

    def wipe(self) -> None:
        """Leaves the line empty."""
        sys.stderr.write("\r" + " " * self._length + "\r")
        sys.stderr.flush()


class _InNotebook:
    """An output of the cell of its own: text on standard error would stay as a coloured band, and be saved."""

    def __init__(self) -> None:
        self._handle: Any = None

    def write(self, text: str) -> None:
        """Shows the text in place of what stood there."""
        from IPython.display import display

        data = {"text/plain": text}
        if self._handle is None:
            self._handle = display(data, raw=True, display_id=True)
        else:
            self._handle.update(data, raw=True)

    def wipe(self) -> None:
        """Leaves the output empty."""
        self._handle.update({"text/plain": ""}, raw=True)


def _line() -> _OnTerminal | _InNotebook | None:
    """Where to say it: below the cell, on the terminal, or nowhere when nobody looks."""
    if os.environ.get("SHELDRAKE_PROGRESS", "1") == "0":
        return None
    if in_notebook():
        return _InNotebook()
    return _OnTerminal() if getattr(sys.stderr, "isatty", lambda: False)() else None


def _duration(seconds: float) -> str:
    if not seconds < 1e6:
        return "long"
    minutes, s = divmod(int(seconds), 60)
    return f"{minutes} min {s:02d} s" if minutes else f"{seconds:.0f} s"
