"""The base of plain data classes that are filled by keyword and read from YAML, in pydrake's manner."""

import copy
import types
import typing


class Struct:
    """A class of typed fields, declared as annotations in its body.

    A new object's fields are empty: "" for str, [] and {} for containers, None for optional fields, and a new object
    for other classes.
    """

    __fields__: "typing.ClassVar[tuple]" = ()

    def __init_subclass__(cls, **kwargs):
        super().__init_subclass__(**kwargs)
        hints = typing.get_type_hints(cls)
        cls.__fields__ = tuple(
            types.SimpleNamespace(name=name, type=hints[name])
            for name in cls.__annotations__
            if not name.startswith("_")
        )

    def __init__(self, **kwargs):
        for field in self.__fields__:
            setattr(self, field.name, _empty(field.type))
        names = [field.name for field in self.__fields__]
        for name, value in kwargs.items():
            if name not in names:
                raise AttributeError(f"{type(self).__name__} has no field '{name}'; its fields are {', '.join(names)}.")
            setattr(self, name, value)

    def __setattr__(self, name, value):
        for field in self.__fields__:
            if field.name == name and not _fits(field.type, value):
                raise TypeError(f"{type(self).__name__}.{name} must be {field.type}, not {type(value).__name__}.")
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
