"""Contenders that take turns, so that a slow moment of the machine hits all of them; ratios are formed turn by turn."""

from __future__ import annotations

import platform
import statistics
import time
from collections.abc import Callable, Sequence
from typing import Any


def machine() -> str:
    """One line that says where numbers come from."""
    return f"{platform.processor() or platform.machine()}, Python {platform.python_version()}"


def cpu_time(call: Callable[[Any], Any], arguments: Sequence[Any]) -> float:
    """CPU time [us] of one call, over calls with each of the arguments."""
    start = time.process_time()
    for argument in arguments:
        call(argument)
    return (time.process_time() - start) / len(arguments) * 1e6


def repeated_time(call: Callable[[], Any], count: int) -> float:
    """CPU time [us] of one of so many calls."""
    start = time.process_time()
    for _ in range(count):
        call()
    return (time.process_time() - start) / count * 1e6


def take_turns(contenders: dict[str, Callable[[], float]], rounds: int) -> dict[str, list[float]]:
    """What each contender's turns took; the first, which loads and compiles, does not count."""
    for turn in contenders.values():
        turn()
    times: dict[str, list[float]] = {name: [] for name in contenders}
    for _ in range(rounds):
        for name, turn in contenders.items():
            times[name].append(turn())
    return times


def ratio(times: dict[str, list[float]], rival: str, name: str) -> str:
    """How many times longer a rival takes: median, and smallest to largest of the rounds."""
    if rival not in times:
        return "-"
    ratios = [b / a for a, b in zip(times[name], times[rival])]
    return f"{statistics.median(ratios):.2f} ({min(ratios):.2f}-{max(ratios):.2f})"
