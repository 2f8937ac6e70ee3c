"""Schemas of YAML data: dataclasses, classes with `__fields__`, and the generic types they are made of."""

from __future__ import annotations

import collections.abc
import dataclasses
import types
import typing
from typing import Any

from sheldrake.common._names import pretty_class_name

JSON_SCALARS = (bool, int, float, str)
SCALARS = (*JSON_SCALARS, bytes)
MAPPINGS = (dict, collections.abc.Mapping)
_NONE = type(None)


def fields_of(schema: type) -> dict[str, Any]:
    """Names and types of a schema's fields, in order.

    Raises:
        NotImplementedError: the class is no schema.
    """
    if dataclasses.is_dataclass(schema):
        hints = _resolved_hints(schema)
        return {field.name: hints.get(field.name, field.type) for field in dataclasses.fields(schema)}
    fields = getattr(schema, "__fields__", None)
    if fields is not None:
        return {field.name: field.type for field in fields}
    raise NotImplementedError(
        f"Schema objects of type {schema} are not yet supported: a schema is a dataclass or has `__fields__`."
    )


def _resolved_hints(schema: type) -> dict[str, Any]:
    """Field types with `from __future__ import annotations` undone, where the names can be found."""
    if not any(isinstance(field.type, str) for field in dataclasses.fields(schema)):  # type: ignore[arg-type]
        return {}
    try:
        return typing.get_type_hints(schema)
    except NameError:
        return {}


def is_union(schema: object) -> bool:
    """Whether a type is a union, spelled either way."""
    return typing.get_origin(schema) in (typing.Union, types.UnionType)


def optional_of(schema: Any) -> Any:
    """T if the type is Optional[T], else None."""
    if is_union(schema):
        args = typing.get_args(schema)
        if len(args) == 2 and args[1] is _NONE:
            return args[0]
    return None


def tag_of(schema: type) -> str:
    """The YAML tag of a member of a union: the name of its class, without template parameters."""
    return pretty_class_name(schema).split("[", 1)[0]


def get_field(obj: object, name: str) -> Any:
    """A field of an object; one whose attribute has another meaning offers `_yaml_get`."""
    getter = getattr(obj, "_yaml_get", None)
    return getattr(obj, name) if getter is None else getter(name)


def set_field(obj: object, name: str, value: object) -> None:
    """Set a field of an object; see `get_field`."""
    setter = getattr(obj, "_yaml_set", None)
    if setter is None:
        setattr(obj, name, value)
    else:
        setter(name, value)
