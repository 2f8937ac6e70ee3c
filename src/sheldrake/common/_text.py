"""How numbers and choices appear in messages."""

from __future__ import annotations

import itertools
from collections.abc import Iterable


def number(x: float) -> str:
    """The shortest text that reads back as `x`, without a trailing `.0`."""
    return repr(float(x)).removesuffix(".0")


def arguments(**values: float) -> str:
    """`a=1, b=2.5` from keyword arguments that are numbers."""
    return ", ".join(f"{name}={number(value)}" for name, value in values.items())


def untaken(name: str, taken: set[str], numbered: str = "{}_{}", first: int = 2) -> str:
    """The name, or the first numbered one that is not taken; it is then."""
    others = (numbered.format(name, number) for number in itertools.count(first))
    found = next(new for new in itertools.chain([name], others) if new not in taken)
    taken.add(found)
    return found


def choices(names: Iterable[str], limit: int = 12) -> str:
    """A readable list of valid names for an error message."""
    known = sorted(names)
    if not known:
        return "none"
    shown = ", ".join(repr(name) for name in known[:limit])
    return shown if len(known) <= limit else f"{shown}, ... ({len(known)} in all)"
