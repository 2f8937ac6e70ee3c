"""Identifiers of geometries, frames, sources and collision filter declarations."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any, TypeVar

from sheldrake.common._copies import is_never_changed
from sheldrake.common._overloads import expect

if TYPE_CHECKING:
    from typing_extensions import Self

_Id = TypeVar("_Id", bound="_Identifier")
_next_value = itertools.count(1).__next__


class _Identifier:
    """A number that is unique within the process and carries its kind in its type; it sorts in order of creation."""

    __slots__ = ("_value",)
    _value: int

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        is_never_changed(cls)

    def __new__(cls, *args: object, **kwargs: object) -> Self:
        raise TypeError(f"{cls.__name__}: No constructor defined! Use {cls.__name__}.get_new_id().")

    @classmethod
    def get_new_id(cls: type[_Id]) -> _Id:
        """A new identifier, larger than every earlier one."""
        new = object.__new__(cls)
        object.__setattr__(new, "_value", _next_value())
        return new

    @classmethod
    def _none(cls: type[_Id]) -> _Id:
        """The identifier of nothing, which fields have before they are set; it is not valid."""
        new = object.__new__(cls)
        object.__setattr__(new, "_value", 0)
        return new

    def get_value(self) -> int:
        """The number behind the identifier."""
        return self._value

    def is_valid(self) -> bool:
        """False for the identifier of nothing, as in a query's result that nobody has filled in."""
        return self._value > 0

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"{type(self).__name__} is immutable.")

    def __eq__(self, other: object) -> bool:
        return type(other) is type(self) and self._value == other._value  # type: ignore[attr-defined]

    def __lt__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return self._value < other._value

    def __hash__(self) -> int:
        return self._value

    def __copy__(self: _Id) -> _Id:
        return self

    def __deepcopy__(self: _Id, memo: dict) -> _Id:
        return self

    def __repr__(self) -> str:
        return f"<{type(self).__name__} value={self._value}>"


class GeometryId(_Identifier):
    """Names one geometry of a SceneGraph."""

    __slots__ = ()


class FrameId(_Identifier):
    """Names one frame of a SceneGraph; geometries are fixed to frames."""

    __slots__ = ()


class SourceId(_Identifier):
    """Names one source: whoever registers frames and geometries and publishes their poses."""

    __slots__ = ()


class FilterId(_Identifier):
    """Names one transient collision filter declaration."""

    __slots__ = ()


def number_of(identifier: object, kind: type[_Identifier]) -> int:
    """The number behind an identifier that a user gave, for an error about it.

    Raises:
        TypeError: it is not of that kind.
    """
    return expect(f"look-up by {kind.__name__}", identifier, kind).get_value()
