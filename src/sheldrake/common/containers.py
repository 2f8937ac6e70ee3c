"""Named views of arrays, and dictionaries whose keys compare by `EqualTo`."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import DTypeLike
    from typing_extensions import Self

__all__ = ["EqualToDict", "NamedViewBase", "namedview"]


class _EqualToKey:
    """A key that is equal to another of its type where `EqualTo` says so."""

    __slots__ = ("value",)

    def __init__(self, value: Any):
        self.value = value

    def __hash__(self) -> int:
        return hash(self.value)

    def __eq__(self, other: object) -> bool:
        assert isinstance(other, _EqualToKey)
        return isinstance(other.value, type(self.value)) and bool(self.value.EqualTo(other.value))


class EqualToDict(dict):
    """A dictionary whose keys are compared by type and `a.EqualTo(b)`, for keys whose `==` gives a formula."""

    def __init__(self, *args: Any, **kwargs: Any):
        super().__init__()
        for key, value in dict(*args, **kwargs).items():
            self[key] = value

    def __setitem__(self, key: object, value: Any) -> None:
        super().__setitem__(_EqualToKey(key), value)

    def __getitem__(self, key: object) -> Any:
        return super().__getitem__(_EqualToKey(key))

    def __delitem__(self, key: object) -> None:
        super().__delitem__(_EqualToKey(key))

    def __contains__(self, key: object) -> bool:
        return super().__contains__(_EqualToKey(key))

    def get(self, key: object, default: Any = None) -> Any:
        """The value for `key`, or `default`."""
        return super().get(_EqualToKey(key), default)

    def keys(self) -> Iterator:  # type: ignore[override]
        """The keys as they were given."""
        return (key.value for key in super().keys())

    def items(self) -> Iterator:  # type: ignore[override]
        """Pairs of key and value."""
        return zip(self.keys(), self.values())

    def raw(self) -> dict:
        """A plain dictionary with the same keys and values."""
        return dict(self.items())


class NamedViewBase:
    """Base of the classes that `namedview` makes."""

    _fields: ClassVar[tuple[str, ...] | None] = None
    _value: Any

    def __init__(self, value: Any):
        """
        Args:
            value: The array or list to look at; it is not copied.
        """
        assert self._fields is not None, "make a class with `namedview` first"
        assert len(self._fields) == len(value), f"{len(self._fields)} fields for {len(value)} values"
        object.__setattr__(self, "_value", value)

    @classmethod
    def get_fields(cls) -> tuple[str, ...]:
        """Names of all fields, in order."""
        return cls._fields  # type: ignore[return-value]

    def __getitem__(self, i: Any) -> Any:
        return self._value[i]

    def __setitem__(self, i: Any, value_i: Any) -> None:
        self._value[i] = value_i

    def __setattr__(self, name: str, value: Any) -> None:
        if not hasattr(self, name):
            raise AttributeError(f"{type(self).__name__} has no field '{name}'; its fields are {self.get_fields()}.")
        object.__setattr__(self, name, value)

    def __len__(self) -> int:
        return len(self._value)

    def __iter__(self) -> Iterator:
        return iter(self._value)

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> np.ndarray:
        array = np.asarray(self._value) if dtype is None else np.asarray(self._value, dtype=dtype)
        return array.copy() if copy else array

    def _text(self, show: Callable[[Any], str]) -> str:
        pairs = ", ".join(f"{name}={show(self[i])}" for i, name in enumerate(self.get_fields()))
        return f"{type(self).__name__}({pairs})"

    def __str__(self) -> str:
        return self._text(str)

    def __repr__(self) -> str:
        return f"<{self._text(repr)}>"

    @staticmethod
    def _item_property(i: int) -> property:
        return property(lambda self: self[i], lambda self, value: self.__setitem__(i, value))

    @classmethod
    def Zero(cls) -> Self:
        """A view of as many zeros as there are fields."""
        return cls([0] * len(cls.get_fields()))


def _sanitize_field_name(name: str) -> str:
    """`name` with `_` for what an identifier cannot hold, and before a leading digit."""
    letters = [letter if f"_{letter}".isidentifier() else "_" for letter in name]
    if not name[:1].isidentifier():
        letters.insert(0, "_")
        letters[1] = name[0] if f"_{name[0]}".isidentifier() else ""
    clean = re.sub("__+", "_", "".join(letters))
    assert clean.isidentifier(), f"no identifier can be made of {name!r}"
    return clean


def namedview(name: str, fields: Iterable[str], *, sanitize_field_names: bool = True) -> type[NamedViewBase]:
    """A class whose objects give names to the items of an array, and write through to it.

    Args:
        name: Name of the class.
        fields: Names of the items, in order.
        sanitize_field_names: Replace what an identifier cannot hold by `_`.

    Example:
        ::

            State = namedview("State", ["x", "y"])
            state = State(np.array([1.0, 2.0]))
            state.x = 10.0      # the array is now [10, 2]
            state[:] = 3.0      # [3, 3]
    """
    names: Sequence[str] = [_sanitize_field_name(field) if sanitize_field_names else field for field in fields]
    assert len(set(names)) == len(names), "Field names must be unique"
    members: dict[str, Any] = {"_fields": tuple(names)}
    members.update((field, NamedViewBase._item_property(i)) for i, field in enumerate(names))
    return type(name, (NamedViewBase,), members)
