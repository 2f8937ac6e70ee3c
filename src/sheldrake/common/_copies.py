"""Copies: by `Clone()`; and of many small objects, as a plant has, in a third of the time of `copy.deepcopy`."""

from __future__ import annotations

import copy
import copyreg
import functools
import types
import weakref
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from typing_extensions import Self

_SAME: set[type] = {type(None), bool, int, float, complex, str, bytes, type, range, type(...), type(NotImplemented)}
_SAME |= {property, types.FunctionType, types.BuiltinFunctionType, weakref.ref}
"""Types whose objects are their own copies; `is_never_changed` adds to them."""
_BUILT_IN = (list, dict, tuple, set, frozenset, int, float, complex, str, bytes, bytearray, np.ndarray, BaseException)
_IN_THEIR_OWN_WAY = ("__getstate__", "__setstate__", "__reduce__", "__reduce_ex__", "__getnewargs__")


class Cloned:
    """What has `Clone()`, whose copies are its clones."""

    __slots__ = ()

    if TYPE_CHECKING:

        def Clone(self) -> Any: ...

    def __copy__(self) -> Self:
        return self.Clone()  # type: ignore[no-any-return]

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        return self.Clone()  # type: ignore[no-any-return]


def is_never_changed(cls: type) -> None:
    """Says that objects of a class are their own copies, as numbers are."""
    _SAME.add(cls)


def deep_copy(value: Any, memo: dict[int, Any]) -> Any:
    """What `copy.deepcopy(value, memo)` gives; but arrays that are read-only, and no views, are shared.

    Args:
        value: Anything. What it is made of stays as it is, and alive, meanwhile.
        memo: Copies by the `id` of what they are copies of; those made are added.
    """
    cls: Any = type(value)
    if cls in _SAME or (cls is tuple and _SAME.issuperset(map(type, value))):
        return value
    known = memo.get(id(value))
    if known is not None:
        return known
    if cls is dict:
        table: dict = {}
        memo[id(value)] = table
        _copy_items(value, table, memo)
        return table
    if cls is list:
        memo[id(value)] = found = []
        found += [v if type(v) in _SAME else deep_copy(v, memo) for v in value]
        return found
    if cls is tuple or _is_named_tuple(cls):
        return _of_tuple(value, memo)
    if cls is np.ndarray and value.dtype != object:
        if not value.flags.writeable and value.base is None:
            return value
        memo[id(value)] = array = value.copy("K")
        return array
    if cls is set or cls is frozenset:
        memo[id(value)] = members = cls([v if type(v) in _SAME else deep_copy(v, memo) for v in value])
        return members
    slots = _slots(cls)
    if slots is None:
        own = getattr(cls, "__deepcopy__", None)
        if own is None:
            return copy.deepcopy(value, memo)
        memo[id(value)] = new = own(value, memo)
        return new
    memo[id(value)] = new = cls.__new__(cls)
    if cls.__dictoffset__:
        _copy_items(value.__dict__, new.__dict__, memo)
    for name in slots:
        if hasattr(value, name):
            setattr(new, name, deep_copy(getattr(value, name), memo))
    return new


def _copy_items(given: dict, new: dict, memo: dict[int, Any]) -> None:
    for key, v in given.items():
        own = key if type(key) in _SAME else deep_copy(key, memo)
        if type(v) not in _SAME:
            known = memo.get(id(v))  # as most have: elements know each other
            v = deep_copy(v, memo) if known is None else known
        new[own] = v


def _of_tuple(value: tuple, memo: dict[int, Any]) -> tuple:
    """A tuple of copies; the same one if nothing in it is copied."""
    copies = tuple([v if type(v) in _SAME else deep_copy(v, memo) for v in value])
    if id(value) in memo:  # it holds itself
        found: tuple = memo[id(value)]
        return found
    if all([a is b for a, b in zip(value, copies)]):
        return value
    new: tuple = copies if type(value) is tuple else tuple.__new__(type(value), copies)
    memo[id(value)] = new
    return new


@functools.lru_cache(256)
def _is_named_tuple(cls: type) -> bool:
    return cls.__bases__ == (tuple,) and hasattr(cls, "_fields") and not hasattr(cls, "__deepcopy__")


@functools.lru_cache(256)
def _slots(cls: type) -> list[str] | None:
    """Slots of objects of a class that are nothing but their attributes, and are copied as all are; else None."""
    if issubclass(cls, _BUILT_IN) or hasattr(cls, "__deepcopy__") or hasattr(cls, "__getnewargs_ex__"):
        return None
    if any(getattr(cls, name, None) is not getattr(object, name, None) for name in _IN_THEIR_OWN_WAY):
        return None
    slots: list[str] = copyreg._slotnames(cls)  # type: ignore[attr-defined]
    return slots if cls.__new__ is object.__new__ else None
