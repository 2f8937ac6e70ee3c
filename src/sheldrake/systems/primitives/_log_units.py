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


def short_labels(labels: list[str]) -> tuple[str, list[str]]:
    """What all labels of a plot begin with, in whole words, and the labels without it.

    The model instance for what belongs to no model is never worth a word. Numbers keep the word before them.
    """
    words = [re.split(r"(?<=[_ /])(?=.)", label.removeprefix("DefaultModelInstance_")) for label in labels]
    same = 0
    if len(words) > 1:
        most = min(map(len, words)) - 1
        while same < most and len({word[same] for word in words}) == 1:
            same += 1
        while same and any(word[same][0].isdigit() for word in words):
            same -= 1
    start = "".join(words[0][:same]).rstrip("_ /") if words else ""
    return start, ["".join(word[same:]) for word in words]
