"""Typed numbers of the elements of a plant."""

from __future__ import annotations

import itertools

from sheldrake.common._enums import IndexEnum
from sheldrake.common._no_constructor import no_constructor
from sheldrake.systems.framework._index import _TypedIndex


class BodyIndex(_TypedIndex):
    """Number of a body; 0 is the world."""

    __slots__ = ()


class FrameIndex(_TypedIndex):
    """Number of a frame; 0 is the world's."""

    __slots__ = ()


class JointIndex(_TypedIndex):
    """Number of a joint."""

    __slots__ = ()


class JointActuatorIndex(_TypedIndex):
    """Number of an actuator."""

    __slots__ = ()


class ForceElementIndex(_TypedIndex):
    """Number of a force element; 0 is uniform gravity."""

    __slots__ = ()


class ModelInstanceIndex(_TypedIndex):
    """Number of a model instance; 0 is the world's, 1 the default one."""

    __slots__ = ()


@no_constructor("Use MultibodyConstraintId.get_new_id().")
class MultibodyConstraintId:
    """Names a constraint; unique in the process."""

    __slots__ = ("_value",)
    _value: int
    _next = itertools.count(1).__next__

    @classmethod
    def get_new_id(cls) -> MultibodyConstraintId:
        """A new id, larger than every earlier one."""
        new = object.__new__(cls)
        new._value = cls._next()
        return new

    def get_value(self) -> int:
        """The number behind the id."""
        return self._value

    def is_valid(self) -> bool:
        """True: there is no id without a value."""
        return True

    def __eq__(self, other: object) -> bool:
        return isinstance(other, MultibodyConstraintId) and self._value == other._value

    def __lt__(self, other: MultibodyConstraintId) -> bool:
        return self._value < other._value

    def __hash__(self) -> int:
        return hash(("MultibodyConstraintId", self._value))

    def __repr__(self) -> str:
        return f"<MultibodyConstraintId value={self._value}>"


class JacobianWrtVariable(IndexEnum):
    """What a Jacobian is taken with respect to: time derivatives of positions, or velocities."""

    kQDot = 0
    kV = 1


def world_index() -> BodyIndex:
    """The world body."""
    return BodyIndex(0)


def world_frame_index() -> FrameIndex:
    """The world's frame."""
    return FrameIndex(0)


def world_model_instance() -> ModelInstanceIndex:
    """The model instance of the world body."""
    return ModelInstanceIndex(0)


def default_model_instance() -> ModelInstanceIndex:
    """The model instance of elements added without naming one."""
    return ModelInstanceIndex(1)
