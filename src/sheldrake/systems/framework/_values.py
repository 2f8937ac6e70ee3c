"""Groups of values: discrete and continuous state, abstract values, parameters."""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any, SupportsIndex
from typing import overload as typing_overload

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._copies import Cloned
from sheldrake.common._overloads import Mismatch
from sheldrake.common.value import AbstractValue
from sheldrake.systems.framework._vector import BasicVector, Subvector, Supervector, VectorBase, as_vector

if TYPE_CHECKING:
    from sheldrake.common._types import Scalar, Scalars

Touch = Callable[[], None]


def _index(what: str, index: SupportsIndex, count: int) -> int:
    i = operator.index(index)
    if not 0 <= i < count:
        raise IndexError(f"{what}: there is no group {i}; there are {count}.")
    return i


@checked
class AbstractValues(Cloned):
    """A list of abstract values.

    Args:
        data: The values; copied.
    """

    def __init__(self, data: Sequence[AbstractValue] = ()):
        for value in data:
            if not isinstance(value, AbstractValue):
                raise Mismatch(f"AbstractValues(): incompatible constructor arguments: {value!r} is no AbstractValue.")
        self._data = [value.Clone() for value in data]
        self._on_write: Touch | None = None

    @classmethod
    def _view(cls, data: list[AbstractValue], on_write: Touch | None) -> AbstractValues:
        values = object.__new__(cls)
        values._data, values._on_write = data, on_write
        return values

    def size(self) -> int:
        """How many values there are."""
        return len(self._data)

    def get_value(self, index: int) -> AbstractValue:
        """Value `index`."""
        return self._data[_index("AbstractValues.get_value()", index, len(self._data))]

    def get_mutable_value(self, index: int) -> AbstractValue:
        """Value `index`, to be changed."""
        if self._on_write is not None:
            self._on_write()
        return self._data[_index("AbstractValues.get_mutable_value()", index, len(self._data))]

    def SetFrom(self, other: AbstractValues, /) -> None:
        """Copies all values of `other`, which must hold as many of the same types."""
        if other.size() != self.size():
            raise RuntimeError(f"AbstractValues.SetFrom(): sizes differ: {self.size()} and {other.size()}.")
        for mine, its in zip(self._data, other._data):
            mine.SetFrom(its)
        if self._on_write is not None:
            self._on_write()

    def Clone(self) -> AbstractValues:
        """Independent copies of all values."""
        return AbstractValues(self._data)


class DiscreteValues(Cloned):
    """Groups of numbers, each a BasicVector.

    Args:
        data: The groups, or the only one; copied.
    """

    def __init__(self, data: BasicVector | Sequence[BasicVector] | None = None, *, datum: BasicVector | None = None):
        data = datum if data is None else data
        groups: list[Any] = [] if data is None else [data] if isinstance(data, VectorBase) else list(data)
        for group in groups:
            if not isinstance(group, BasicVector):
                raise Mismatch(f"DiscreteValues(): incompatible constructor arguments: {group!r} is no BasicVector.")
        self._groups: list[BasicVector] = [group.Clone() for group in groups]

    @classmethod
    def _view(cls, groups: list[BasicVector]) -> DiscreteValues:
        values = object.__new__(cls)
        values._groups = groups
        return values

    def size(self) -> int:
        """Number of elements of the only group."""
        return self._only("size").size()

    def _only(self, call: str) -> BasicVector:
        if len(self._groups) != 1:
            raise RuntimeError(
                f"Cannot use DiscreteValues convenience method {call}(): there are {len(self._groups)} groups, not one."
            )
        return self._groups[0]

    def num_groups(self) -> int:
        """How many groups there are."""
        return len(self._groups)

    def get_data(self) -> list[BasicVector]:
        """All groups."""
        return list(self._groups)

    def get_vector(self, index: int = 0) -> BasicVector:
        """Group `index`."""
        return self._groups[_index("DiscreteValues.get_vector()", index, len(self._groups))]

    def get_mutable_vector(self, index: int = 0) -> BasicVector:
        """Group `index`, to be changed."""
        group = self._groups[_index("DiscreteValues.get_mutable_vector()", index, len(self._groups))]
        group._wrote()
        return group

    def value(self, index: int = 0) -> np.ndarray:
        """Elements of group `index`, as a read-only view."""
        return self.get_vector(index).value()

    get_value = value

    def get_mutable_value(self, index: int = 0) -> np.ndarray:
        """Elements of group `index`, as a view to write through."""
        return self.get_vector(index).get_mutable_value()

    @typing_overload
    def set_value(self, value: Scalars) -> None: ...
    @typing_overload
    def set_value(self, index: int, value: Scalars) -> None: ...
    def set_value(self, *args: Any, index: int | None = None, value: Scalars | None = None) -> None:
        """Sets a group: `set_value(value)` the only one, `set_value(index, value)` any."""
        if len(args) == 1 == len(self._groups) and index is None and value is None:
            self._groups[0].SetFromVector(args[0])
            return
        args = (*args, value) if value is not None else args
        if index is not None:
            args = (index, *args)
        if len(args) == 1:
            self._only("set_value").SetFromVector(args[0])
        elif len(args) == 2:
            self.get_vector(args[0]).SetFromVector(args[1])
        else:
            raise Mismatch("set_value(): incompatible function arguments: give (value) or (index, value).")

    @checked
    def SetFrom(self, other: DiscreteValues, /) -> None:
        """Copies all groups of `other`, which must have as many of the same sizes."""
        if other.num_groups() != self.num_groups():
            raise RuntimeError(
                f"DiscreteValues.SetFrom(): {self.num_groups()} groups cannot be set from {other.num_groups()}."
            )
        for mine, its in zip(self._groups, other._groups):
            mine.SetFromVector(its._v)

    def Clone(self) -> DiscreteValues:
        """A copy with its own memory."""
        return DiscreteValues._view([group.Clone() for group in self._groups])

    def __getitem__(self, index: SupportsIndex) -> Any:
        return self._only("operator[]")[index]

    def __setitem__(self, index: SupportsIndex | slice, value: Scalar | Scalars) -> None:
        self._only("operator[]")[index] = value

    def __iter__(self) -> Iterator[Any]:
        return iter(self._only("iter"))


class ContinuousState(Cloned):
    """Generalized positions q, velocities v and other variables z, as one vector and as three.

    Args:
        state: All of them, q first; copied. Without counts, everything is z.
        num_q: Number of q.
        num_v: Number of v, at most `num_q`.
        num_z: Number of z.
    """

    def __init__(self, state: VectorBase | None = None, num_q: int = 0, num_v: int = 0, num_z: int | None = None):
        vector: VectorBase = BasicVector([]) if state is None else state
        if not isinstance(vector, VectorBase):
            raise Mismatch(f"ContinuousState(): incompatible constructor arguments: {state!r} is no VectorBase.")
        n = vector.size()
        num_z = n - num_q - num_v if num_z is None else num_z
        if num_q + num_v + num_z != n or min(num_q, num_v, num_z) < 0:
            raise IndexError(
                f"ContinuousState(): num_q={num_q}, num_v={num_v}, num_z={num_z} do not fit a vector of size {n}."
            )
        if num_v > num_q:
            raise RuntimeError(f"ContinuousState(): num_v={num_v} may not exceed num_q={num_q}.")
        self._vector: VectorBase = (
            vector.Clone() if isinstance(vector, BasicVector) else BasicVector(vector.CopyToVector())
        )
        self._parts: Sequence[list[tuple[int, int]]] = [[(0, num_q)], [(num_q, num_q + num_v)], [(num_q + num_v, n)]]

    @classmethod
    def _view(cls, vector: VectorBase, parts: Sequence[list[tuple[int, int]]]) -> ContinuousState:
        state = object.__new__(cls)
        state._vector, state._parts = vector, parts
        return state

    def _part(self, k: int) -> VectorBase:
        vector = self._vector
        views = [Subvector._view(vector._v[a:b], vector._on_write) for a, b in self._parts[k]]
        return views[0] if len(views) == 1 else Supervector(views)

    def _count(self, k: int) -> int:
        return sum(b - a for a, b in self._parts[k])

    def num_q(self) -> int:
        """Number of generalized positions."""
        return self._count(0)

    def num_v(self) -> int:
        """Number of generalized velocities."""
        return self._count(1)

    def num_z(self) -> int:
        """Number of other variables."""
        return self._count(2)

    def size(self) -> int:
        """Number of all variables."""
        return self._vector.size()

    def get_vector(self) -> VectorBase:
        """All variables."""
        return self._vector

    def get_generalized_position(self) -> VectorBase:
        """The variables q."""
        return self._part(0)

    def get_generalized_velocity(self) -> VectorBase:
        """The variables v."""
        return self._part(1)

    def get_misc_continuous_state(self) -> VectorBase:
        """The variables z."""
        return self._part(2)

    def _mutable(self, vector: VectorBase) -> VectorBase:
        self._vector._wrote()
        return vector

    def get_mutable_vector(self) -> VectorBase:
        """All variables, to be changed."""
        return self._mutable(self._vector)

    def get_mutable_generalized_position(self) -> VectorBase:
        """The variables q, to be changed."""
        return self._mutable(self._part(0))

    def get_mutable_generalized_velocity(self) -> VectorBase:
        """The variables v, to be changed."""
        return self._mutable(self._part(1))

    def get_mutable_misc_continuous_state(self) -> VectorBase:
        """The variables z, to be changed."""
        return self._mutable(self._part(2))

    def CopyToVector(self) -> np.ndarray:
        """All variables, as the caller's own array."""
        return self._vector.CopyToVector()

    def SetFromVector(self, value: Scalars | VectorBase) -> None:
        """Sets all variables."""
        self._vector.SetFromVector(value)

    def SetFrom(self, other: ContinuousState, /) -> None:
        """Copies all variables of `other`, which must have the same size."""
        self._vector.SetFromVector(other._vector._v)

    def Clone(self) -> ContinuousState:
        """A copy with its own memory."""
        return ContinuousState._view(BasicVector._view(self._vector.CopyToVector()), self._parts)

    def __getitem__(self, index: SupportsIndex | slice) -> Any:
        return self._vector[index]

    def __setitem__(self, index: SupportsIndex | slice, value: Scalar | Scalars) -> None:
        self._vector[index] = value

    def __iter__(self) -> Iterator[Any]:
        return iter(self._vector)


__all__ = [
    "AbstractValues",
    "ContinuousState",
    "DiscreteValues",
    "as_vector",
]
