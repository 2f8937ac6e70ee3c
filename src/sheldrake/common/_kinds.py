"""Kinds of parameters in common use: what `overload` asks for (see `_overloads`)."""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from sheldrake.common._names import pretty_class_name
from sheldrake.common._overloads import Kind, Mismatch, kind


def _instance_of(*classes: type) -> Kind:
    """Kind: an object of one of some classes."""

    @kind(" | ".join(pretty_class_name(cls) for cls in classes))
    def convert(value: Any) -> Any:
        if not isinstance(value, classes):
            raise Mismatch
        return value

    setattr(convert, "classes", classes)  # noqa: B010 (see `kind`); of the type of a value alone, more can be told
    return convert


instance_of: Callable[..., Kind] = functools.lru_cache(maxsize=512)(_instance_of)
"""`instance_of(*classes)`: the kind of objects of one of some classes, made once."""


def anything(value: Any) -> Any:
    """Kind: whatever is given; the body of the call looks at it."""
    return value


text = instance_of(str)
LARGEST_COUNT = 2**31 - 1
"""What Drake counts with ends here; a list of so many is not made."""


@kind("int")
def count(value: Any) -> int:
    """Kind: a whole number, not negative."""
    if isinstance(value, bool):
        raise Mismatch
    try:
        number = operator.index(value)
    except TypeError:  # an array has __index__, and refuses unless it is one whole number
        raise Mismatch from None
    if not 0 <= number <= LARGEST_COUNT:
        raise Mismatch
    return number


@kind("list of int")
def integers(value: Any) -> list[int]:
    """Kind: whole numbers, one after the other."""
    if not isinstance(value, (Sequence, np.ndarray)):
        raise Mismatch
    try:
        return [operator.index(item) for item in value]
    except TypeError:
        raise Mismatch from None


def list_of(cls: type) -> Kind:
    """Kind: a list of objects of a class."""

    @kind(f"list of {pretty_class_name(cls)}")
    def convert(value: Any) -> list:
        if not isinstance(value, (Sequence, np.ndarray)) or not all(isinstance(item, cls) for item in value):
            raise Mismatch
        return list(value)

    return convert


@kind("bool")
def flag(value: object) -> bool:
    """Kind: a bool; None is False."""
    return bool(instance_of(bool, int, np.bool_, type(None))(value))


def called(description: str) -> Kind:
    """Kind: whatever is given, called so in errors; the body of the call looks at it."""
    return kind(description)(lambda value: value)
