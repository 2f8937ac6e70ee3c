"""The base of plain data classes that are filled by keyword and read from YAML, in pydrake's manner."""

import builtins
import copy
import sys
import types
import typing


class _Fields:
    """`__fields__` of a class: resolved when first asked for, so that declaring a class imports nothing."""

    def __get__(self, _instance, owner) -> "tuple[types.SimpleNamespace, ...]":
        cached = owner.__dict__.get("_resolved_fields")
        if cached is None:
            module = sys.modules[owner.__module__]
            hints = typing.get_type_hints(owner, localns=_ModuleNames(module))
            cached = tuple(types.SimpleNamespace(name=name, type=kind) for name, kind in hints.items())
            owner._resolved_fields = cached
        return cached


class _ModuleNames(dict):
    """The names of a module, those made on demand by its `__getattr__` included."""

    def __init__(self, module):
        super().__init__(vars(module))
        self._module = module

    def __missing__(self, name):
        if hasattr(builtins, name):
            return getattr(builtins, name)
        return getattr(self._module, name)


class Struct:
    """A class of typed fields, declared as annotations in its body.

    A new object's fields are empty: "" for str, [] and {} for containers, None for optional fields, and a new object
    for other classes.
    """

    __fields__ = _Fields()

    def __init__(self, **kwargs):
        for field in self.__fields__:
            object.__setattr__(self, field.name, _empty(field.type))
        for name, value in kwargs.items():
            setattr(self, name, value)

    def __setattr__(self, name, value):
        kinds = {field.name: field.type for field in self.__fields__}
        if name not in kinds and not name.startswith("_"):
            raise AttributeError(f"{type(self).__name__} has no field '{name}'; its fields are {', '.join(kinds)}.")
        if name in kinds and not _fits(kinds[name], value):
            raise TypeError(f"{type(self).__name__}.{name} must be {kinds[name]}, not {type(value).__name__}.")
        object.__setattr__(self, name, value)

    def __repr__(self):
        values = ", ".join(f"{field.name}={getattr(self, field.name)!r}" for field in self.__fields__)
        return f"{type(self).__name__}({values})"

    def __copy__(self):
        return type(self)(**{field.name: getattr(self, field.name) for field in self.__fields__})

    def __deepcopy__(self, memo):
        values = {field.name: copy.deepcopy(getattr(self, field.name), memo) for field in self.__fields__}
        return type(self)(**values)


def is_optional(kind) -> bool:
    """True for `X | None`."""
    return typing.get_origin(kind) in (typing.Union, types.UnionType)


def plain_type(kind):
    """The class behind a type: list for `list[str]`, X for `X | None`."""
    if is_optional(kind):
        return plain_type(typing.get_args(kind)[0])
    return typing.get_origin(kind) or kind


def _empty(kind):
    return None if is_optional(kind) else plain_type(kind)()


def _fits(kind, value) -> bool:
    return (value is None and is_optional(kind)) or isinstance(value, plain_type(kind))
