"""Loading YAML.

Text to plain data, then plain data into the fields of a schema; `_yaml_schema` knows what a field may be.
"""

from __future__ import annotations

import collections.abc
import copy
import typing
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import yaml

from sheldrake.common._files import regular_bytes
from sheldrake.common._options import Options
from sheldrake.common._yaml_schema import (
    MAPPINGS,
    SCALARS,
    fields_of,
    get_field,
    is_union,
    optional_of,
    set_field,
    tag_of,
)

if TYPE_CHECKING:
    from collections.abc import Mapping
    from os import PathLike

_TAG = "_tag"
_MOST_MERGED = 1_000_000
_MOST_SEXAGESIMAL = 1_000  # digits of base 60, as in 1:30:00; a number of n of them takes n squared steps to make
_NUMBERS = ("tag:yaml.org,2002:int", "tag:yaml.org,2002:float")


class _Loader(yaml.SafeLoader):
    """A safe loader that keeps the tag of a tagged mapping as an item `_tag`."""

    _merged = 0

    def flatten_mapping(self, node: Any) -> None:
        """Puts merged mappings (`<<`) in their place; refuses small documents that stand for large ones."""
        before = len(node.value)
        super().flatten_mapping(node)
        self._merged += max(0, len(node.value) - before)
        if self._merged > _MOST_MERGED:
            problem = f"more than {_MOST_MERGED} items are merged into others by '<<'"
            raise yaml.constructor.ConstructorError(None, None, problem, node.start_mark)

    def construct_scalar(self, node: Any) -> Any:
        if node.tag in _NUMBERS and node.value.count(":") > _MOST_SEXAGESIMAL:
            problem = f"a number of more than {_MOST_SEXAGESIMAL} parts between colons"
            raise yaml.constructor.ConstructorError(None, None, problem, node.start_mark)
        return super().construct_scalar(node)


def _tagged_mapping(loader: Any, tag: str, node: Any) -> dict:
    return {**loader.construct_mapping(node, deep=True), _TAG: tag}


_Loader.add_multi_constructor("", _tagged_mapping)


def yaml_load_data(data: str | None, *, private: bool = False) -> Any:
    """The YAML document in `data`, a str or an open file, as plain dicts, lists and scalars.

    A tagged mapping, such as `!Gaussian {mean: 1}`, gets an extra item `_tag`.

    Args:
        data: The document.
        private: Keep items of the root whose key begins with an underscore (anchors and templates).

    Raises:
        yaml.YAMLError: it is no YAML, nested too deeply, merges (`<<`) more than a million items, or has a number
            of more than a thousand parts between colons.
    """
    try:
        document = yaml.load(data, Loader=_Loader)
    except RecursionError:
        raise yaml.YAMLError("The document is nested too deeply.") from None
    if isinstance(document, dict) and not private:
        for key in [key for key in document if key.startswith("_")]:
            del document[key]
    return document


def yaml_load_file(filename: str | PathLike[str], *, private: bool = False) -> Any:
    """The YAML document in a file; see `yaml_load_data`."""
    return yaml_load_data(regular_bytes(filename).decode("utf-8"), private=private)


def yaml_load(*, data: str | None = None, filename: str | PathLike[str] | None = None, private: bool = False) -> Any:
    """The YAML document in either `data` or the file `filename`; see `yaml_load_data`.

    Raises:
        RuntimeError: both or neither are given.
    """
    if (data is None) == (filename is None):
        found = "None" if data is None else "non-None"
        raise RuntimeError(f"Exactly one of `data=...` or `filename=...` must be provided, but both were {found}")
    if filename is None:
        return yaml_load_data(data, private=private)
    return yaml_load_file(filename, private=private)


class _Options(NamedTuple):
    allow_yaml_with_no_schema: bool
    allow_schema_with_no_yaml: bool
    retain_map_defaults: bool


def yaml_load_typed(
    *,
    schema: Any = None,
    data: str | None = None,
    filename: str | PathLike[str] | None = None,
    child_name: str | None = None,
    defaults: Any = None,
    allow_yaml_with_no_schema: bool = False,
    allow_schema_with_no_yaml: bool = True,
    retain_map_defaults: bool = True,
) -> Any:
    """An object made of the YAML document in either `data` or the file `filename`.

    Args:
        schema: Its class: a dataclass, a class with `__fields__`, or a mapping from str to one of those. By default
            the class of `defaults`.
        data: The document.
        filename: Name of the file with the document.
        child_name: Load this item of the root instead of the root.
        defaults: Values of what the document does not give; by default those of `schema()`.
        allow_yaml_with_no_schema: Overlook items of the document that the schema does not know.
        allow_schema_with_no_yaml: Let the document leave out fields.
        retain_map_defaults: Keep items of a mapping's default that the document does not give.

    Raises:
        RuntimeError: the document does not fit the schema.
        ValueError: neither `schema` nor `defaults` is given.
    """
    if schema is None:
        if defaults is None:
            raise ValueError("At least one of schema= and defaults= must be provided")
        schema = type(defaults)
    options = _Options(allow_yaml_with_no_schema, allow_schema_with_no_yaml, retain_map_defaults)
    document = yaml_load(data=data, filename=filename)
    root = document if child_name is None else document[child_name]
    if not isinstance(root, collections.abc.Mapping):
        raise RuntimeError(f"YAML root was a {type(root)} but should have been a dict")
    if typing.get_origin(schema) in MAPPINGS:
        start = {} if defaults is None else defaults
        return _load(root, schema, start, options, "root")
    result = copy.deepcopy(defaults) if defaults is not None else schema()
    _load_fields(root, schema, result, options)
    return result


def _load_fields(values: Mapping[str, Any], schema: Any, target: object, options: _Options) -> None:
    """Set the fields of `target` from a mapping."""
    if not isinstance(values, collections.abc.Mapping):
        raise RuntimeError(f"Expected a mapping for {schema} but instead got yaml data of type {type(values)}")
    fields = fields_of(schema)
    former = [name for name in values if name not in fields and _is_former_name(schema, name)]
    unknown = [name for name in values if name not in fields and name not in former]
    missing = [name for name, kind in fields.items() if name not in values and optional_of(kind) is None]
    if unknown and not options.allow_yaml_with_no_schema:
        raise RuntimeError(f"The fields {unknown} were unknown to the schema {schema}; it has {list(fields)}")
    if missing and not options.allow_schema_with_no_yaml:
        raise RuntimeError(f"The fields {missing} were missing in the yaml data for {schema}")
    for name in former:
        setattr(target, name, values[name])
    for name, kind in fields.items():
        if name in values:
            set_field(target, name, _load(values[name], kind, get_field(target, name), options, name))
        elif optional_of(kind) is not None and not options.allow_schema_with_no_yaml:
            set_field(target, name, None)  # a document that must give everything says None by leaving it out


def _is_former_name(schema: Any, name: str) -> bool:
    """Whether settings have a field by a name that it had before: a property that sets it."""
    return (
        isinstance(schema, type) and issubclass(schema, Options) and isinstance(getattr(schema, name, None), property)
    )


def _load(value: Any, schema: Any, default: object, options: _Options, name: str) -> Any:
    """`value` as the schema wants it; `default` fills in what it leaves out."""
    if schema in SCALARS:
        return _load_scalar(value, schema, name)
    inner = optional_of(schema)
    if inner is not None:
        if value is None:
            return None
        return _load(value, inner, _fresh(inner) if default is None else default, options, name)
    if schema is Path:
        if not isinstance(value, str):
            raise RuntimeError(f"Expected a !!str value for '{name}: Path' but instead got {type(value)}")
        return Path(value)
    if schema is np.ndarray:
        return np.array(value, dtype=float)
    origin = typing.get_origin(schema)
    if origin is list:
        (item,) = typing.get_args(schema)
        return [_load(entry, item, _fresh(item), options, name) for entry in value]
    if origin in MAPPINGS:
        return _load_mapping(value, schema, default, options)
    if is_union(schema):
        return _load_union(value, typing.get_args(schema), default, options, name)
    if origin is not None:
        raise NotImplementedError(f"The generic type {origin} of {schema} is not yet supported")
    target = _fresh(schema) if default is None else copy.deepcopy(default)
    _load_fields(value, schema, target, options)
    return target


def _fresh(schema: Any) -> Any:
    """What a field of this type holds before it is loaded."""
    if is_union(schema) or schema is np.ndarray:
        return None
    origin = typing.get_origin(schema)
    return {} if origin in MAPPINGS else (origin or schema)()


def _load_scalar(value: Any, schema: type, name: str) -> Any:
    if isinstance(value, (list, dict)):
        raise RuntimeError(
            f"Expected a {schema} value for '{name}' but instead got non-scalar yaml data of type {type(value)}"
        )
    converted = _convert(value, schema)
    if converted is None:
        raise RuntimeError(
            f"Expected a {schema} value for '{name}' but instead got yaml data of type {type(value)} ({value!r})"
        )
    return converted


def _convert(value: Any, schema: type) -> Any:
    """A scalar as another scalar type if nothing is lost and nothing guessed, else None."""
    found = type(value)
    if found is schema:
        return value
    if found is int and schema is float:
        return float(value)
    if found is float and schema is int and value.is_integer():
        return int(value)
    if found is str and schema in (float, int):
        return schema(value)
    if found is str and schema is bool:
        return {"true": True, "false": False}.get(value)
    return None


def _load_mapping(value: Any, schema: Any, default: Any, options: _Options) -> dict:
    key_type, item = typing.get_args(schema)
    assert key_type is str, f"keys of {schema} must be str"
    result = copy.deepcopy(default) if options.retain_map_defaults and default is not None else {}
    for key, entry in value.items():
        result[key] = _load(entry, item, result[key] if key in result else _fresh(item), options, key)
    return result


def _load_union(value: Any, members: tuple, default: object, options: _Options, name: str) -> Any:
    if value is None or type(value) in SCALARS:
        return _load_scalar_of_union(value, members, name)
    if isinstance(value, dict) and _TAG in value:
        value = dict(value)
        tag = value.pop(_TAG)[1:]
        chosen = next((member for member in members if tag_of(member) == tag), None)
        if chosen is None:
            raise RuntimeError(
                f"The yaml type tag value '{tag}' did not match any of the allowed type options for '{name}' "
                f"({members})"
            )
    else:
        chosen = members[0]  # untagged data is of the first type
    keep = isinstance(default, typing.get_origin(chosen) or chosen)
    return _load(value, chosen, default if keep else _fresh(chosen), options, name)


def _load_scalar_of_union(value: Any, members: tuple, name: str) -> Any:
    if type(value) in members:
        return value
    first = members[0]
    converted = None
    if first in SCALARS:
        converted = _convert(value, first)
    else:
        try:
            converted = first(value)
        except Exception:  # any refusal of the constructor means that the value is not of this type
            converted = None
    if converted is None:
        raise RuntimeError(
            f"The schema sum type for '{name}' cannot accept a yaml value '{value}' of type {type(value)}; only one of "
            f"{members} are acceptable"
        )
    return converted
