"""Scratch of a system in the slab: one NamedTuple of arrays, or a NamedTuple of such.

Integer arrays take the slab's 8-byte words as int64. In a slab of objects they hold objects like all else.
"""

from __future__ import annotations

import operator
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np


def arrays_of(prototype: tuple[Any, ...]) -> Iterator[np.ndarray]:
    """All arrays of a prototype, in order."""
    for field in prototype:
        if isinstance(field, tuple):
            yield from field
        else:
            yield field


def size_of(prototype: int | tuple[Any, ...]) -> int:
    """Words a prototype takes; a prototype may also be just that number."""
    return prototype if isinstance(prototype, int) else sum(a.size for a in arrays_of(prototype))


LARGE = 1 << 16
"""Words up to which scratch is kept for contexts of others."""


def are_same(one: int | tuple[Any, ...], other: int | tuple[Any, ...]) -> bool:
    """Whether two prototypes are the same number, or hold the same arrays."""
    if isinstance(one, int) or isinstance(other, int):
        return one == other
    return type(one) is type(other) and all(map(operator.is_, one, other))


def places_of(at: int, prototype: int | NamedTuple) -> dict[str, Any]:
    """Where kernels find a scratch that begins at `at`, by the names its parts have in their parameters.

    Returns:
        (offset, shape...) of each array and a list of these for each NamedTuple, by name of the field; the whole, if it
        holds arrays only, is "work".
    """
    if isinstance(prototype, int):
        return {"work": (at, prototype)}
    places: dict[str, Any] = {}
    for name, field in zip(prototype._fields, prototype):
        found = []
        for array in field if isinstance(field, tuple) else (field,):
            found.append((at, *array.shape))
            at += array.size
        places[name] = found if isinstance(field, tuple) else found[0]
    if not any(isinstance(field, tuple) for field in prototype):
        places["work"] = list(places.values())
    return places


def copy_of(memory: np.ndarray) -> np.ndarray:
    """A copy, in which zeros are not written if there are many: the operating system has no memory for them then."""
    if memory.dtype == object or memory.size < _MANY:
        return memory.copy()
    new = np.zeros(memory.size)
    for at in range(0, memory.size, _PAGE):
        part = memory[at : at + _PAGE]
        if part.view(np.int64).any():  # of -0.0, too
            new[at : at + _PAGE] = part
    return new


_MANY, _PAGE = 1 << 20, 1 << 17  # numbers


def write_prototype(prototype: int | NamedTuple, part: np.ndarray) -> None:
    """Sets new scratch to what its prototype is.

    Args:
        prototype: Arrays; a number means any memory of that size.
        part: The scratch in the slab, zeros.
    """
    if isinstance(prototype, int):
        return
    if part.dtype == float and part.size >= _MANY:
        at = 0
        for a in arrays_of(prototype):
            if a.view(np.int64).any():
                part[at : at + a.size] = a.reshape(-1).view(float)
            at += a.size
        return
    if part.dtype == float:
        flat = [a.reshape(-1) for a in arrays_of(prototype)]
        if flat:
            np.concatenate([a if a.dtype == float else a.view(float) for a in flat], out=part)
        return
    at = 0
    for a in arrays_of(prototype):
        part[at : at + a.size] = a.reshape(-1)
        at += a.size


def views_of(S: np.ndarray, at: int, prototype: int | tuple[Any, ...]) -> Any:
    """The scratch itself: views of the slab, of the prototype's class."""
    if isinstance(prototype, int):
        return S[at : at + prototype]
    views = []
    for field in prototype:
        if isinstance(field, tuple):
            views.append(views_of(S, at, field))
            at += size_of(field)
            continue
        view = S[at : at + field.size]
        if S.dtype != object and field.dtype == np.int64:
            view = view.view(np.int64)
        views.append(view.reshape(field.shape))
        at += field.size
    return type(prototype)(*views)
