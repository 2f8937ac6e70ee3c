"""Saving YAML.

The way back of `_yaml_load`, in the form and order in which Drake writes it.
"""

from __future__ import annotations

import collections.abc
import typing
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import yaml
import yaml.representer

from sheldrake.common._files import whole_file
from sheldrake.common._yaml_schema import (
    JSON_SCALARS,
    MAPPINGS,
    SCALARS,
    fields_of,
    get_field,
    is_union,
    optional_of,
    tag_of,
)

if TYPE_CHECKING:
    from os import PathLike

_TAG = "_tag"
_EXPLICIT = "tag:sheldrake,explicit:"


class _ExplicitScalar(NamedTuple):
    """A scalar to be written with its tag, `!!int 10`."""

    value: Any
    schema: type


class _Dumper(yaml.SafeDumper):
    """A safe dumper that writes an item `_tag` of a mapping as the mapping's tag."""

    DEFAULT_TAG_PREFIXES = {**yaml.SafeDumper.DEFAULT_TAG_PREFIXES, _EXPLICIT: "!!"}


def _represent_dict(dumper: yaml.Dumper, data: dict) -> yaml.Node:
    if _TAG not in data:
        return dumper.represent_dict(data)
    return dumper.represent_mapping(data[_TAG], {key: value for key, value in data.items() if key != _TAG})


def _represent_explicit(dumper: yaml.Dumper, data: _ExplicitScalar) -> yaml.Node:
    node = dumper.represent_data(data.value)
    node.tag = f"{_EXPLICIT}{data.schema.__name__}"
    return node


def _represent_unknown(dumper: yaml.Dumper, data: object) -> yaml.Node:
    if type(data).__module__.startswith("sheldrake"):
        raise yaml.representer.RepresenterError(
            f"yaml_dump writes plain data only, not a {type(data).__name__}; use yaml_dump_typed", data
        )
    return dumper.represent_undefined(data)


_Dumper.add_representer(dict, _represent_dict)
_Dumper.add_representer(_ExplicitScalar, _represent_explicit)
_Dumper.add_representer(None, _represent_unknown)


class _BlockDumper(_Dumper):
    """Drake's layout: mappings over several lines, lists of scalars on one."""

    def serialize_node(self, node: Any, parent: Any, index: Any) -> None:
        if isinstance(node, yaml.MappingNode):
            node.flow_style = not node.value
        super().serialize_node(node, parent, index)


def _write(document: object, filename: str | PathLike[str] | None, dumper: type, **options: Any) -> str | None:
    text = yaml.dump(document, Dumper=dumper, default_flow_style=None, **options)
    if filename is None:
        return text
    with whole_file(filename, encoding="utf-8") as file:
        file.write(text)
    return None


def yaml_dump(data: object, *, filename: str | PathLike[str] | None = None) -> str | None:
    """Plain data as YAML, the reverse of `yaml_load(..., private=True)`.

    Args:
        data: Dicts, lists and scalars; an item `_tag` of a dict becomes its tag.
        filename: Write to this file instead of giving a str.
    """
    return _write(data, filename, _Dumper)


def yaml_dump_typed(
    data: object,
    *,
    filename: str | PathLike[str] | None = None,
    schema: type | None = None,
    child_name: str | None = None,
    defaults: object = None,
) -> str | None:
    """An object as YAML, the reverse of `yaml_load_typed`.

    Args:
        data: The object.
        filename: Write to this file instead of giving a str.
        schema: Its type; by default its class.
        child_name: Put it under this key of the root.
        defaults: Leave out what is equal to this object.

    Raises:
        RuntimeError: the object does not fit the schema.
    """
    assert data is not None
    if child_name is not None and type(child_name) not in JSON_SCALARS:
        raise RuntimeError(f"The child_name must be a primitive type, not a {type(child_name)}")
    schema = type(data) if schema is None else schema
    root = _plain(data, schema)
    if defaults is not None:
        _remove_equal(root, _plain(defaults, schema))
    if child_name is not None:
        root = {child_name: root}
    if not isinstance(root, collections.abc.Mapping):
        raise RuntimeError(f"YAML root was a {type(root)} but should have been a dict")
    return _write(root, filename, _BlockDumper, sort_keys=False)


def _plain(obj: Any, schema: Any) -> Any:
    """`obj` as dicts, lists and scalars."""
    if schema in SCALARS:
        return schema(obj)
    origin = typing.get_origin(schema)
    if origin is list:
        (item,) = typing.get_args(schema)
        return [_plain(entry, item) for entry in obj]
    if origin in MAPPINGS:
        key_type, item = typing.get_args(schema)
        if key_type is not str:
            raise RuntimeError(f"Dict keys must be strings, not {key_type}")
        return {key: _plain(obj[key], item) for key in sorted(obj)}
    inner = optional_of(schema)
    if inner is not None:
        return None if obj is None else _plain(obj, inner)
    if is_union(schema):
        return _plain_union(obj, schema)
    if schema is Path:
        return str(obj)
    if schema is np.ndarray:
        assert obj.dtype == np.float64, f"only arrays of floats can be written, not of {obj.dtype}"
        return obj.tolist()
    fields = {name: (_plain(get_field(obj, name), kind), kind) for name, kind in fields_of(schema).items()}
    return {name: value for name, (value, kind) in fields.items() if value is not None or optional_of(kind) is None}


def _plain_union(obj: Any, schema: Any) -> Any:
    members = typing.get_args(schema)
    if obj is None:
        if type(None) in members:
            return None
        raise RuntimeError(f"The {schema} does not allow None as a value")
    member = next((one for one in members if isinstance(obj, typing.get_origin(one) or one)), None)
    if member is None:
        raise RuntimeError(f"A value of type {type(obj)} did not match any {schema}")
    result = _plain(obj, member)
    if member is members[0] or member is bytes:
        return result  # the first type is what an untagged value loads as
    if member in JSON_SCALARS:
        return _ExplicitScalar(result, member)
    result[_TAG] = f"!{tag_of(member)}"
    return result


def _remove_equal(node: dict, defaults: dict) -> None:
    """Take out of `node`, at every depth, what `defaults` has as well."""
    for key in [key for key in node if key in defaults]:
        value, default = node[key], defaults[key]
        if value is default or value == default:  # `is`, because NaN is not equal to itself
            del node[key]
        elif isinstance(value, dict) and isinstance(default, dict) and value.get(_TAG) == default.get(_TAG):
            _remove_equal(value, default)
