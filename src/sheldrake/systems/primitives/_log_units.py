"""Kinds and units of logged quantities, from their names."""

from __future__ import annotations

import re
from typing import NamedTuple


class Quantity(NamedTuple):
    """What a name says.

    Attributes:
        kind: Such as "angular velocity"; "" when the name says a unit only.
        unit: "" when it is not known.
        label: The name without what kind and unit say already.
    """

    kind: str
    unit: str
    label: str


# Endings of state names, their kind and unit, and the label after what stands before the ending.
_ENDINGS = [
    (r"_(q[wxyz])$", "orientation (quaternion)", "1", r"\1"),
    (r"_(roll|pitch|yaw)$", "orientation (roll, pitch, yaw)", "rad", r"\1"),
    (r"_w([xyz])$", "angular velocity", "rad/s", r"w\1"),
    (r"_v([xyz])$", "velocity", "m/s", r"v\1"),
    (r"_([xyz])$", "position", "m", r"\1"),
    (r"_q$", "joint position", "rad or m", ""),
    (r"_w$", "joint angular velocity", "rad/s", ""),
    (r"_v$", "joint velocity", "m/s", ""),
]


def quantity(name: str) -> Quantity:
    """The kind, unit and label of a named quantity; `name [unit]` and `name (unit)` state their unit."""
    stated = re.fullmatch(r"(.*?)\s*[\[(]([^\])]*)[\])]", name)
    plain, unit = (stated[1], stated[2]) if stated else (name, "")
    for ending, kind, usual, label in _ENDINGS:
        found = re.search(ending, plain)
        if found:
            stem = plain[: found.start()]
            part = found.expand(label)
            return Quantity(kind, unit or usual, f"{stem} {part}".strip() if part else stem)
    return Quantity("", unit, plain) if unit else Quantity("value", "", plain)
