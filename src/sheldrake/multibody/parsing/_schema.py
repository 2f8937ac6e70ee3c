"""The base of plain data classes that are filled by keyword and read from YAML, in pydrake's manner."""

import copy
import types
import typing


class Struct:
    """A class of named, typed fields: `fields` maps a name to (type, function that makes the default)."""

    _fields: "dict[str, tuple[typing.Any, typing.Callable[[], typing.Any]]]" = {}
    __fields__: tuple = ()

    def __init_subclass__(cls, **kwargs):
        super().__init_subclass__(**kwargs)
        cls.__fields__ = tuple(types.SimpleNamespace(name=name, type=kind) for name, (kind, _) in cls._fields.items())

    def __init__(self, **kwargs):
        for name, (_, make) in self._fields.items():
            setattr(self, name, make())
        for name, value in kwargs.items():
            if name not in self._fields:
                raise AttributeError(
                    f"{type(self).__name__} has no field '{name}'; its fields are {', '.join(self._fields)}."
                )
            setattr(self, name, value)

    def __setattr__(self, name, value):
        if name in self._fields:
            value = _checked(type(self).__name__, name, self._fields[name][0], value)
        object.__setattr__(self, name, value)

    def __repr__(self):
        values = ", ".join(f"{name}={getattr(self, name)!r}" for name in self._fields)
        return f"{type(self).__name__}({values})"

    def __copy__(self):
        return type(self)(**{name: getattr(self, name) for name in self._fields})

    def __deepcopy__(self, memo):
        return type(self)(**{name: copy.deepcopy(getattr(self, name), memo) for name in self._fields})


def _checked(owner: str, name: str, kind, value):
    """The value, when it fits the declared type.

    Raises:
        TypeError: When it does not.
    """
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if origin in (typing.Union, types.UnionType):
        fits = value is None or isinstance(value, _plain(arguments[0]))
    elif origin in (list, dict):
        fits = isinstance(value, origin)
    else:
        fits = isinstance(value, _plain(kind))
    if not fits:
        raise TypeError(f"{owner}.{name} must be {kind}, not {type(value).__name__}.")
    return value


def _plain(kind):
    return typing.get_origin(kind) or kind
