"""Drake's own elements that URDF and SDFormat write alike: bushings, springs, constraints."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np

from .._files.xml import Element
from .._model.description import (
    BallConstraintDescription,
    BushingDescription,
    FrameReference,
    ModelDescription,
    SpringDamperDescription,
    TendonDescription,
)
from .joints import check_spring_damper
from .reading import Reading


class ExtensionReader(ABC):
    """Adds them to a model; each format says how it writes names and numbers.

    Args:
        model: The model.
        reading: Its surroundings.
    """

    def __init__(self, model: ModelDescription, reading: Reading):
        self.model, self.reading = model, reading

    @abstractmethod
    def number_in(self, child: Element) -> float:
        """The number that a child has."""

    @abstractmethod
    def vector_in(self, child: Element) -> np.ndarray:
        """The vector that a child has, shape (3,)."""

    @abstractmethod
    def frame_in(self, child: Element) -> FrameReference:
        """The frame that a child names."""

    def body_in(self, child: Element) -> FrameReference:
        """The body that a child names."""
        return self.frame_in(child)

    def child(self, element: Element, tag: str) -> Element:
        """A child that must be there."""
        child = element.find(tag)
        if child is None:
            self.reading.fail(element, f"<{element.tag}> needs a <{tag}> element.")
        return child

    def bushing(self, element: Element) -> None:
        """Reads a `<drake:linear_bushing_rpy>`."""
        constants = ("torque_stiffness", "torque_damping", "force_stiffness", "force_damping")
        kinds = {"frameA": self.frame_in, "frameC": self.frame_in, **dict.fromkeys(constants, self.vector_in)}
        values = self._values(element, "drake:bushing_", kinds)
        self.model.elements.append(BushingDescription(element.where, *values))

    def spring_damper(self, element: Element) -> None:
        """Reads a `<drake:linear_spring_damper>`."""
        kinds = {**self._two_points(), **dict.fromkeys(("free_length", "stiffness", "damping"), self.number_in)}
        spring = SpringDamperDescription(element.where, *self._values(element, f"{element.tag}_", kinds))
        check_spring_damper(spring, self.reading)
        self.model.elements.append(spring)

    def ball_constraint(self, element: Element) -> None:
        """Reads a `<drake:ball_constraint>`."""
        values = self._values(element, f"{element.tag}_", self._two_points())
        self.model.elements.append(BallConstraintDescription(element.where, *values))

    def tendon(self, element: Element) -> None:
        """Reads a `<drake:tendon_constraint>`."""
        prefix, reading = f"{element.tag}_", self.reading
        numbers = ("offset", "lower_limit", "upper_limit", "stiffness", "damping")
        reading.warn_unknown(element, [prefix + name for name in ("joint", *numbers)])
        known = {joint.name for joint in self.model.joints()}
        joints, coefficients = [], []
        for child in element.find_all(prefix + "joint"):
            reading.warn_unknown(child, attributes=("name", "a"))
            name, a = reading.name(child, f"<{child.tag}>"), reading.number(child, "a")
            if name not in known:
                names = ", ".join(known)
                reading.fail(child, f"<{child.tag}> names joint '{name}', which does not exist; known: {names}.")
            if a is None:
                reading.fail(child, f"<{child.tag}> needs the attribute 'a'.")
            joints.append(name)
            coefficients.append(a)
        if not joints:
            reading.fail(element, f"<{element.tag}> needs at least one <{prefix}joint>.")
        found = [element.find(prefix + name) for name in numbers]
        values = [None if child is None else self.number_in(child) for child in found]
        self.model.elements.append(TendonDescription(element.where, joints, np.array(coefficients), *values))

    def _two_points(self) -> dict[str, Any]:
        return {"body_A": self.body_in, "p_AP": self.vector_in, "body_B": self.body_in, "p_BQ": self.vector_in}

    def _values(self, element: Element, prefix: str, kinds: dict[str, Any]) -> list[Any]:
        """What the children of these names have, and no others are known."""
        self.reading.warn_unknown(element, [prefix + name for name in kinds])
        return [read(self.child(element, prefix + name)) for name, read in kinds.items()]


EXTENSIONS = {
    "drake:linear_bushing_rpy": ExtensionReader.bushing,
    "drake:linear_spring_damper": ExtensionReader.spring_damper,
    "drake:ball_constraint": ExtensionReader.ball_constraint,
    "drake:tendon_constraint": ExtensionReader.tendon,
}
"""In the order in which a URDF's are added to the plant."""
