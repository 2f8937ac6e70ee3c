"""Sets of geometries, named one by one or by frame."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from sheldrake.geometry._ids import FrameId, GeometryId

_KINDS = {"geometry_id": GeometryId, "frame_id": FrameId, "geometry_ids": GeometryId, "frame_ids": FrameId}


class GeometrySet:
    """Geometries named one by one, and all geometries of the frames named.

    Made from a geometry id, a frame id, a list of geometry ids, a list of frame ids, or both lists.
    """

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        self._geometries: set[GeometryId] = set()
        self._frames: set[FrameId] = set()
        if args or kwargs:
            self.Add(*args, **kwargs)

    def Add(self, *args: Any, **kwargs: Any) -> None:
        """Adds what the constructor takes.

        Raises:
            TypeError: something that is neither an id nor a list of ids of one kind.
        """
        for name in kwargs:
            if name not in _KINDS:
                raise TypeError(f"GeometrySet: unknown argument {name!r}; expected one of {', '.join(_KINDS)}.")
        if len(args) + len(kwargs) > 2:
            raise TypeError("GeometrySet: incompatible arguments; at most a list of geometries and a list of frames.")
        for value in args:
            self._add(value, (GeometryId, FrameId))
        for name, value in kwargs.items():
            self._add(value, (_KINDS[name],))

    def _add(self, value: object, kinds: tuple[type, ...]) -> None:
        items = [value] if isinstance(value, (GeometryId, FrameId)) else value
        if isinstance(items, str) or not isinstance(items, Iterable):
            raise TypeError(f"GeometrySet: incompatible arguments; expected ids or lists of ids, got {value!r}.")
        items = list(items)
        found = {type(item) for item in items}
        if len(found) > 1 or not found <= set(kinds):
            raise TypeError(f"GeometrySet: incompatible arguments; a list must hold ids of one kind, got {items!r}.")
        for item in items:
            chosen: set[Any] = self._geometries if isinstance(item, GeometryId) else self._frames
            chosen.add(item)

    def geometries(self) -> frozenset[GeometryId]:
        """The geometries named one by one."""
        return frozenset(self._geometries)

    def frames(self) -> frozenset[FrameId]:
        """The frames whose geometries belong to the set."""
        return frozenset(self._frames)

    def _copy(self) -> GeometrySet:
        new = GeometrySet()
        new._geometries |= self._geometries
        new._frames |= self._frames
        return new
