"""Classes put together from parts: an object has its parts, and shows calls of theirs as its own."""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable
from types import FunctionType
from typing import Any, Concatenate, Generic, ParamSpec, TypeVar, overload

Part = TypeVar("Part")
Given = ParamSpec("Given")
Result = TypeVar("Result")


class Calls(Generic[Part]):
    """Shows calls of a part: `AddJoint = elements(Elements.AddJoint)` in the body of a class.

    Args:
        kind: The part's class.
        path: Where an object has it: names of attributes, with dots between them.
    """

    def __init__(self, kind: type[Part], path: str) -> None:
        self._kind, self._path = kind, path

    def __call__(self, method: Callable[Concatenate[Part, Given], Result]) -> Call[Given, Result]:
        """The call, of the same name and signature."""
        return Call(method, self._kind, self._path)


class Call(Generic[Given, Result]):
    """A call of a part that its whole shows.

    When an object is first asked for it, it keeps the part's own bound method: from then on the call takes no longer
    than if it were the object's. A class that overrides the call has its own, also after `super()` asked for this one.
    """

    def __init__(self, method: Callable[..., Result], kind: type, path: str) -> None:
        self.__doc__ = method.__doc__
        self.kind = kind
        self._method = method
        self._find: Callable[[Any], Callable[Given, Result]] = operator.attrgetter(f"{path}.{method.__name__}")

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name
        function, find = self._method, self._find

        @functools.wraps(function)
        def call(whole: object, *args: Any, **kwargs: Any) -> Result:
            return find(whole)(*args, **kwargs)

        call.__name__, call.__qualname__ = name, f"{owner.__qualname__}.{name}"
        if isinstance(function, FunctionType) and function.__name__ == name:
            function.__qualname__ = call.__qualname__  # what Python's own errors call it
        self._function = call

    @overload
    def __get__(self, whole: None, owner: type) -> Callable[..., Result]: ...

    @overload
    def __get__(self, whole: object, owner: type) -> Callable[Given, Result]: ...

    def __get__(self, whole: object | None, owner: type) -> Callable[..., Result]:
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
    for name in list(whole.__dict__):
        if isinstance(_attribute(type(whole), name), Call):
            del whole.__dict__[name]


def _attribute(cls: type, name: str) -> Any:
    """What a class has under a name, as it is declared."""
    return next((vars(c)[name] for c in cls.__mro__ if name in vars(c)), None)
