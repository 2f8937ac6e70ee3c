"""Values by identifier: what flows from a source to a SceneGraph."""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common.value import _register_value_type
from sheldrake.geometry._ids import FrameId, GeometryId
from sheldrake.geometry._numbers import as_numbers

if TYPE_CHECKING:
    from typing_extensions import Self

    from sheldrake.math import RigidTransform


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

    def has_id(self, id: FrameId | GeometryId) -> bool:
        """True if the identifier has a value."""
        return id in self._values

    def ids(self) -> list:
        """The identifiers that have a value."""
        return list(self._values)

    def value(self, id: FrameId | GeometryId) -> Any:
        """The value of an identifier.

        Raises:
            RuntimeError: it has none.
        """
        try:
            return copy.copy(self._values[id])
        except KeyError:
            raise RuntimeError(f"No such {self._kind.__name__}: {id.get_value()}.") from None

    def _check(self, id: FrameId | GeometryId) -> None:
        if not isinstance(id, self._kind):
            raise TypeError(f"{self._name}.set_value(): expected a {self._kind.__name__}, got {id!r}.")

    def __copy__(self) -> Self:
        new = type(self)()
        new._values.update(self._values)
        return new

    def __deepcopy__(self, memo: dict) -> Self:
        new = type(self)()
        new._values.update({id: copy.copy(value) for id, value in self._values.items()})
        return new

    def Clone(self) -> Self:
        """A copy."""
        return self.__deepcopy__({})


class FramePoseVector(_KinematicsVector):
    """Poses X_PF of frames in their parent frames, by FrameId.

    A plant gives numbers, and only who asks for a pose makes a RigidTransform of them: `_rows` is then the frames and
    their numbers, shape (n, 12), R row by row and p [m].
    """

    _kind = FrameId
    _name = "FramePoseVector"
    _rows: tuple[tuple[FrameId, ...], np.ndarray] | None = None
    _is_made = True  # whether `_known` has what `_rows` says

    @property
    def _values(self) -> dict[Any, Any]:
        if not self._is_made:
            from sheldrake.math import RigidTransform

            assert self._rows is not None
            make = RigidTransform._make
            self._known = {id: make(X[:9].reshape(3, 3).copy(), X[9:].copy()) for id, X in zip(*self._rows)}
            self._is_made = True
        return self._known

    @_values.setter
    def _values(self, values: dict[Any, Any]) -> None:
        self._known = values

    def _set_rows(self, ids: tuple[FrameId, ...], X_PF: np.ndarray) -> None:
        """Sets all poses, shape (n, 12), in place of those there are; the array is kept and must not change."""
        self._known, self._rows, self._is_made = {}, (ids, X_PF), False

    def clear(self) -> None:
        self._known, self._rows, self._is_made = {}, None, True

    def size(self) -> int:
        return len(self._known) if self._is_made or self._rows is None else len(self._rows[0])

    def set_value(self, id: FrameId, value: RigidTransform) -> None:
        """Sets the pose X_PF (RigidTransform) of a frame."""
        self._check(id)
        self._values[id] = copy.copy(value)
        self._rows = None

    def __copy__(self) -> FramePoseVector:
        new = type(self)()
        new._known, new._rows, new._is_made = dict(self._known), self._rows, self._is_made
        return new

    def __deepcopy__(self, memo: dict) -> FramePoseVector:
        new = type(self)()
        new._known = {id: copy.copy(value) for id, value in self._known.items()}
        new._rows, new._is_made = self._rows, self._is_made
        return new


class GeometryConfigurationVector(_KinematicsVector):
    """Vertex positions of deformable geometries in the world [m], by GeometryId."""

    _kind = GeometryId
    _name = "GeometryConfigurationVector"

    def set_value(self, id: GeometryId, value: Any) -> None:
        """Sets the vertex positions [m], flattened, shape (3 n,)."""
        self._check(id)
        self._values[id] = as_numbers(value).reshape(-1)


_register_value_type(FramePoseVector)
_register_value_type(GeometryConfigurationVector)
