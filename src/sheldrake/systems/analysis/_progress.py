"""One line that tells how far a long simulation is, when somebody is looking."""

from __future__ import annotations

import os
import sys
import time


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
        self._written = 0

    def update(self, t: float) -> None:
        """Says that simulation time is now `t` [s]."""
        now = time.monotonic()
        if not self._shown or now < self._next:
            return
        if not self._written and not (self._end < float("inf") and _watched()):
            self._shown = False
            return
        self._next = now + self.EVERY
        rate = (t - self._begin) / (now - self._start)
        left = (self._end - t) / rate if rate > 0 else float("inf")
        line = f"simulating: {t:.3f} of {self._end:g} s, {rate:.3g}x real time, {_duration(left)} left"
        sys.stderr.write("\r" + line.ljust(self._written))
        sys.stderr.flush()
        self._written = len(line)

    def close(self) -> None:
        """Wipes the line."""
        if self._written:
            sys.stderr.write("\r" + " " * self._written + "\r")
            sys.stderr.flush()
            self._written = 0


def _watched() -> bool:
    if os.environ.get("SHELDRAKE_PROGRESS", "1") == "0":
        return False
    return bool(getattr(sys.stderr, "isatty", lambda: False)()) or "ipykernel" in sys.modules


def _duration(seconds: float) -> str:
    if not seconds < 1e6:
        return "long"
    minutes, s = divmod(int(seconds), 60)
    return f"{minutes} min {s:02d} s" if minutes else f"{seconds:.0f} s"
