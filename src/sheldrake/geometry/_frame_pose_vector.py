"""Values by identifier: what flows from a source to a SceneGraph."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np

from sheldrake.common.value import _register_value_type

from ._ids import FrameId, GeometryId


class _KinematicsVector:
    """A map from identifiers of one kind to values."""

    _kind: type
    _name: str

    def __init__(self) -> None:
        self._values: dict[Any, Any] = {}

    def clear(self) -> None:
        """Forgets everything."""
        self._values.clear()

    def size(self) -> int:
        """Number of identifiers with a value."""
        return len(self._values)

    def has_id(self, id: Any) -> bool:
        """True if the identifier has a value."""
        return id in self._values

    def ids(self) -> list:
        """The identifiers that have a value."""
        return list(self._values)

    def value(self, id: Any) -> Any:
        """The value of an identifier.

        Raises:
            RuntimeError: it has none.
        """
        try:
            return copy.copy(self._values[id])
        except KeyError:
            raise RuntimeError(f"No such {self._kind.__name__}: {id.get_value()}.") from None

    def _check(self, id: Any) -> None:
        if not isinstance(id, self._kind):
            raise TypeError(f"{self._name}.set_value(): expected a {self._kind.__name__}, got {id!r}.")

    def __copy__(self) -> Any:
        new = type(self)()
        new._values.update(self._values)
        return new

    def __deepcopy__(self, memo: dict) -> Any:
        new = type(self)()
        new._values.update({id: copy.copy(value) for id, value in self._values.items()})
        return new

    def Clone(self) -> Any:
        """A copy."""
        return copy.deepcopy(self)


class FramePoseVector(_KinematicsVector):
    """Poses X_PF of frames in their parent frames, by FrameId."""

    _kind = FrameId
    _name = "FramePoseVector"

    def set_value(self, id: FrameId, value: Any) -> None:
        """Sets the pose X_PF (RigidTransform) of a frame."""
        self._check(id)
        self._values[id] = copy.copy(value)


class GeometryConfigurationVector(_KinematicsVector):
    """Vertex positions of deformable geometries in the world [m], by GeometryId."""

    _kind = GeometryId
    _name = "GeometryConfigurationVector"

    def set_value(self, id: GeometryId, value: Any) -> None:
        """Sets the vertex positions [m], flattened, shape (3 n,)."""
        self._check(id)
        self._values[id] = np.array(value, dtype=float).reshape(-1)


_register_value_type(FramePoseVector)
_register_value_type(GeometryConfigurationVector)
