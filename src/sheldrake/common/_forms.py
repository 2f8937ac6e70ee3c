"""What short ways (`quick`) take and give: numbers in objects' slots."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import Any

FEW = 200
"""Calls that a short way does not take part in: to load it takes 0.7 ms, as long as some hundreds in Python."""


@dataclasses.dataclass(frozen=True)
class Slots:
    """An object of a class of slots, and what is in them: for each name a `Form`."""

    cls: type
    parts: dict[str, Any]


Form = Slots | type | tuple[int, ...]
"""What a short way takes or gives: the shape of a float64 array, `float`, for answers also `bool`, or `Slots`.

It may take vectors of `ANY` length, which are the kernel's to write, too.
"""
ANY = (-1,)


def leaves(form: Form, path: tuple[tuple[type, str], ...] = ()) -> Iterator[tuple[tuple[tuple[type, str], ...], Form]]:
    """The numbers and arrays of a form, each with the slots that lead to it."""
    if isinstance(form, Slots):
        for name, part in form.parts.items():
            yield from leaves(part, (*path, (form.cls, name)))
    else:
        yield path, form
