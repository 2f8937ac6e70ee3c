"""Classes put together from parts: an object has its parts, and shows calls of theirs as its own.

_elements = part(Elements, "_parts.elements")

class MultibodyPlant:
    AddJoint = Call(_elements.AddJoint)
"""

from __future__ import annotations

import functools
import inspect
import operator
from collections.abc import Callable
from types import FunctionType
from typing import Any, Generic, NamedTuple, TypeVar, cast, overload

Kind = TypeVar("Kind")
Method = TypeVar("Method", bound=Callable[..., Any])


class _Asked(NamedTuple):
    """A method of a part."""

    method: Callable[..., Any]
    kind: type
    path: str


class _Part:
    """Gives the methods of a class as `_Asked`."""

    def __init__(self, kind: type, path: str) -> None:
        self._kind, self._path = kind, path

    def __getattr__(self, name: str) -> _Asked:
        return _Asked(getattr(self._kind, name), self._kind, self._path)


def part(kind: type[Kind], path: str) -> Kind:
    """A part whose methods `Call` takes; for a type checker, and for nothing else, it is an object of its class.

    Args:
        kind: The part's class.
        path: Where an object has it: names of attributes, with dots between them.
    """
    return cast(Kind, _Part(kind, path))


class Call(Generic[Method]):
    """A call of a part that its whole shows, with the name and the signatures that it has there.

    When an object is first asked for it, it keeps the part's own bound method: from then on the call takes no longer
    than if it were the object's. A class that overrides the call has its own, also after `super()` asked for this one.
    """

    def __init__(self, method: Method) -> None:
        asked = cast(_Asked, method)
        self.__doc__ = asked.method.__doc__
        self.kind = asked.kind
        self._method = asked.method
        self._find: Callable[[Any], Method] = operator.attrgetter(f"{asked.path}.{asked.method.__name__}")

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name
        function, find = self._method, self._find

        @functools.wraps(function)
        def call(whole: object, *args: Any, **kwargs: Any) -> Any:
            return find(whole)(*args, **kwargs)

        call.__name__, call.__qualname__ = name, f"{owner.__qualname__}.{name}"
        if isinstance(function, FunctionType) and function.__name__ == name:
            for called in (function, inspect.unwrap(function)):  # what Python's own errors, and ours, call it
                called.__qualname__ = call.__qualname__
        self._function = call

    @overload
    def __get__(self, whole: None, owner: type) -> Callable[..., Any]: ...

    @overload
    def __get__(self, whole: object, owner: type) -> Method: ...

    def __get__(self, whole: object | None, owner: type) -> Callable[..., Any]:
        if whole is None:
            return self._function
        bound = self._find(whole)
        cls = type(whole)
        if cls.__dict__.get(self._name) is self or _attribute(cls, self._name) is self:  # not asked by way of super()
            whole.__dict__[self._name] = bound
        return bound


def home_of(cls: type, name: str) -> type:
    """The class that has a method: that of the part, where `cls` shows a call of one."""
    found = _attribute(cls, name)
    return found.kind if isinstance(found, Call) else cls


def forget_calls(whole: object) -> None:
    """Has an object look for the calls of its parts anew: it has other parts now."""
    cls: Any = type(whole)
    for name in _calls_of(cls).intersection(whole.__dict__):
        del whole.__dict__[name]


@functools.lru_cache(64)
def _calls_of(cls: type) -> frozenset[str]:
    """Names of the calls of parts that a class shows."""
    return frozenset(name for name in dir(cls) if isinstance(_attribute(cls, name), Call))


def _attribute(cls: type, name: str) -> Any:
    """What a class has under a name, as it is declared."""
    return next((vars(c)[name] for c in cls.__mro__ if name in vars(c)), None)
