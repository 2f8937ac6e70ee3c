"""Settings with defaults, as pydrake's structs of options have them."""

from __future__ import annotations

import copy
import inspect
import operator
import sys
import types
import typing
from collections.abc import Callable, Sequence
from types import SimpleNamespace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, TypeAlias

import numpy as np

from sheldrake.common._names import pretty_class_name
from sheldrake.common._overloads import Mismatch
from sheldrake.common._parallelism import Parallelism
from sheldrake.common._scalars import as_array, float_vector, frozen

if TYPE_CHECKING:
    from typing_extensions import Self


Vector: TypeAlias = Annotated[np.ndarray, None]
"""The type of a setting that is a vector of numbers, of any size."""
Vector3: TypeAlias = Annotated[np.ndarray, 3]
Vector4: TypeAlias = Annotated[np.ndarray, 4]
Vector6: TypeAlias = Annotated[np.ndarray, 6]


class _NamesAndTypes:
    """`__fields__` of a class of settings; types are looked up when asked for, so that making a class costs little."""

    def __get__(self, _: Any, cls: Any) -> tuple[SimpleNamespace, ...]:
        if "_named" not in vars(cls):
            hints = typing.get_type_hints(SimpleNamespace(__annotations__=cls._kinds()))  # without sizes of vectors
            cls._named = tuple(SimpleNamespace(name=name, type=kind) for name, kind in hints.items())
        return cls._named


class Options:
    """Named settings. Derived classes declare them: `name: type = default`, what is annotated, public and has a value.

    Settings are given by name; numbers and lists become what the type says; what is set is copied, and so is everything
    in copies; arrays are read-only. Two objects are equal if they are the same one. `yaml_load_typed` and
    `yaml_dump_typed` know them.

    Raises:
        AttributeError: a setting is given or set that it does not have.
        TypeError: a value is not of the setting's type.
    """

    _defaults: ClassVar[dict[str, Any]] = {}
    _types: ClassVar[dict[str, Any]] = {}
    _names_around: ClassVar[dict[str, Any]]
    __fields__: ClassVar[Any] = _NamesAndTypes()

    def __init_subclass__(cls) -> None:
        names = (name for name in inspect.get_annotations(cls) if name[0] != "_" and name in vars(cls))
        cls._defaults = {**cls._defaults, **{name: vars(cls)[name] for name in names}}
        cls._names_around = vars(sys.modules[cls.__module__])  # now: packages show classes as their own later

    @classmethod
    def _kinds(cls) -> dict[str, Any]:
        if "_types" not in vars(cls):
            base: Any = cls.__base__
            own = {name: kind for name, kind in inspect.get_annotations(cls).items() if name in cls._defaults}
            hints = typing.get_type_hints(
                SimpleNamespace(__annotations__=own), cls._names_around, dict(vars(cls)), True
            )
            cls._types = {**base._kinds(), **hints}
        return cls._types

    def __init__(self, *args: Any, **kwargs: Any):
        if args:
            raise Mismatch(
                f"{type(self).__name__}(): incompatible constructor arguments; settings are given by name "
                f"({', '.join(self._defaults) or 'there are none'}), not {args[0]!r}."
            )
        for name, default in self._defaults.items():
            object.__setattr__(self, name, copied(default))
        for name, value in kwargs.items():
            setattr(self, name, value)

    def __setattr__(self, name: str, value: object) -> None:
        owner = type(self).__name__
        if isinstance(getattr(type(self), name, None), property):
            object.__setattr__(self, name, value)
            return
        if name not in self._defaults:
            raise AttributeError(
                f"{owner!r} object has no attribute {name!r}; it has {', '.join(self._defaults) or 'no settings'}."
            )
        object.__setattr__(self, name, copied(converted(f"{owner}.{name}", self._kinds()[name], value)))

    def __repr__(self) -> str:
        settings = ", ".join(f"{name}={getattr(self, name)!r}" for name in self._defaults)
        return f"{pretty_class_name(type(self))}({settings})"

    def __copy__(self) -> Self:
        return self.__deepcopy__({})

    def __deepcopy__(self, memo: dict) -> Self:
        new = object.__new__(type(self))
        given = self.__dict__
        new.__dict__.update({name: copied(given[name]) for name in self._defaults})
        return new


_NEVER_COPIED = {float, int, bool, str, type(None)}


def copied(value: Any) -> Any:
    """A value of a setting for another owner: data are copied, objects that others share are shared."""
    if type(value) in _NEVER_COPIED:
        return value
    if isinstance(value, Options):  # not by its `__fields__`, which look up types
        return value.__deepcopy__({})
    if isinstance(value, (list, tuple)) and not hasattr(value, "_fields"):
        return type(value)(copied(v) for v in value)
    if isinstance(value, dict):
        return {key: copied(v) for key, v in value.items()}
    if isinstance(value, np.ndarray):
        return frozen(value.copy())
    return copy.copy(value) if hasattr(value, "__fields__") else value


def converted(where: str, kind: Any, value: object) -> Any:
    """The value as a setting of this type holds it.

    Args:
        where: The setting, for messages.
        kind: A type, a union or Optional of types, a list, dict or array type, or Any.

    Raises:
        TypeError: it is not of this type, and nothing that converts to it.
    """
    found = _as_kind(kind, value)
    if found is _MISFIT:
        raise Mismatch(f"{where}: incompatible function arguments; expected {_said(kind)}, got {value!r}.")
    return found


def _said(kind: Any) -> str:
    """A type in words, for messages."""
    origin, parts = typing.get_origin(kind), typing.get_args(kind)
    if origin is Annotated:
        size = kind.__metadata__[0]
        return "vector" if size is None else f"vector of {size} numbers"
    if origin in (typing.Union, types.UnionType):
        return " | ".join(map(_said, parts))
    name = getattr(kind, "__name__", str(kind))
    return f"{name}[{', '.join(map(_said, parts))}]" if parts else name


_MISFIT = object()


def _as_kind(kind: Any, value: object) -> Any:
    if kind is Any:
        return value
    origin = typing.get_origin(kind)
    if origin in (typing.Union, types.UnionType):
        return _as_one_of(typing.get_args(kind), value)
    if origin is typing.Literal:
        return value if value in typing.get_args(kind) else _MISFIT
    if origin is Annotated:
        return _as_vector(kind.__metadata__[0], value)
    if origin is list:
        return _as_list_of(typing.get_args(kind)[0], value)
    if origin is dict:
        return _as_dict_of(typing.get_args(kind), value)
    kind = origin or kind
    if kind in (None, type(None)):
        return None if value is None else _MISFIT
    convert = _CONVERSIONS.get(kind)
    if convert is not None:
        return convert(value)
    return value if not isinstance(kind, type) or isinstance(value, kind) else _MISFIT


def _as_one_of(kinds: tuple, value: object) -> Any:
    for kind in kinds:  # exactly one of them, before something is converted
        if isinstance(kind, type) and type(value) is kind:
            return _as_kind(kind, value)
    for kind in kinds:
        found = _as_kind(kind, value)
        if found is not _MISFIT:
            return found
    return _MISFIT


def _as_bool(value: Any) -> Any:
    return bool(value) if value is None or isinstance(value, (bool, np.bool_, int, float)) else _MISFIT


def _as_int(value: Any) -> Any:
    try:
        return operator.index(value)
    except TypeError:
        return _MISFIT


def _as_float(value: Any) -> Any:
    return float(value) if hasattr(value, "__float__") and getattr(value, "ndim", 0) == 0 else _MISFIT


def _as_list(value: Any) -> Any:
    return list(value) if isinstance(value, (list, tuple)) else _MISFIT


def _as_list_of(kind: Any, value: Any) -> Any:
    if not isinstance(value, (Sequence, np.ndarray)) or isinstance(value, (str, bytes)):
        return _MISFIT
    found = [_as_kind(kind, item) for item in value]
    return _MISFIT if any(item is _MISFIT for item in found) else found


def _as_dict_of(kinds: tuple, value: Any) -> Any:
    if not isinstance(value, dict):
        return _MISFIT
    found = {_as_kind(kinds[0], key): _as_kind(kinds[1], item) for key, item in value.items()}
    return _MISFIT if _MISFIT in found or any(item is _MISFIT for item in found.values()) else found


def _as_vector(size: int | None, value: Any) -> Any:
    try:
        return float_vector(value) if size is None else as_array(float, value, (size,))
    except Mismatch:
        return _MISFIT


def _as_array(value: Any) -> Any:
    if not isinstance(value, (list, tuple, np.ndarray)):
        return _MISFIT
    try:
        return frozen(np.array(value, dtype=float))
    except (TypeError, ValueError):
        return _MISFIT


def _as_parallelism(value: Any) -> Any:
    if isinstance(value, bool | np.bool_):
        return Parallelism(value)
    return value if isinstance(value, Parallelism) else _MISFIT


_CONVERSIONS: dict[Any, Callable[[Any], Any]] = {
    bool: _as_bool,
    int: _as_int,
    float: _as_float,
    list: _as_list,
    np.ndarray: _as_array,
    Parallelism: _as_parallelism,
}
