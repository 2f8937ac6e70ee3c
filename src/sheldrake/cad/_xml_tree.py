"""A small XML tree that is written, one element a line."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import escape, quoteattr

import numpy as np

if TYPE_CHECKING:
    from sheldrake.math import RigidTransform

MOMENTS = (("ixx", 0, 0), ("ixy", 0, 1), ("ixz", 0, 2), ("iyy", 1, 1), ("iyz", 1, 2), ("izz", 2, 2))


class Node:
    """An element with attributes, and either children or text."""

    def __init__(self, tag: str, text: Any = None, /, **attributes: Any):
        self.tag, self.text = tag, text
        self.attributes = {name.rstrip("_"): value for name, value in attributes.items() if value is not None}
        self.children: list[Node] = []

    def add(self, tag: str, text: Any = None, /, **attributes: Any) -> Node:
        """Adds a child and returns it."""
        child = Node(tag, text, **attributes)
        self.children.append(child)
        return child

    def lines(self, depth: int = 0) -> list[str]:
        """The element as lines of text."""
        indent = "  " * depth
        attributes = "".join(f" {name}={quoteattr(words(value))}" for name, value in self.attributes.items())
        if self.children:
            inside = [line for child in self.children for line in child.lines(depth + 1)]
            return [f"{indent}<{self.tag}{attributes}>", *inside, f"{indent}</{self.tag}>"]
        if self.text is not None:
            return [f"{indent}<{self.tag}{attributes}>{escape(words(self.text))}</{self.tag}>"]
        return [f"{indent}<{self.tag}{attributes}/>"]

    def document(self) -> str:
        """The element as a file."""
        return "\n".join(['<?xml version="1.0"?>', *self.lines(), ""])


def words(value: Any) -> str:
    """Text of a value; numbers in full precision, without the sign of zero."""
    if isinstance(value, str):
        return value
    if isinstance(value, bool):
        return "true" if value else "false"
    return " ".join(repr(float(x) + 0.0) for x in np.asarray(value, dtype=float).reshape(-1))


def xyz_rpy(X: RigidTransform) -> tuple[np.ndarray, np.ndarray]:
    """Translation [m], and the roll, pitch and yaw [rad] that give the rotation back best."""
    from sheldrake.math import RollPitchYaw

    R = X.rotation().matrix()
    rpy = RollPitchYaw(X.rotation()).vector()
    yaw_alone = np.array([0.0, np.copysign(np.pi / 2.0, -R[2, 0]), np.arctan2(-R[0, 1], R[1, 1])])
    candidates = [rpy, yaw_alone, np.round(rpy / (np.pi / 4.0)) * (np.pi / 4.0)]
    errors = [np.abs(RollPitchYaw(c).ToRotationMatrix().matrix() - R).max() for c in candidates]
    return np.asarray(X.translation()), candidates[int(np.argmin(errors))]
