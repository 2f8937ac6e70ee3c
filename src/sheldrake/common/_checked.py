"""Calls that check their arguments against the annotations of their parameters.

    @checked
    def SourceIsRegistered(self, source_id: SourceId) -> bool: ...

What a parameter does not take is a TypeError that names it, before the body runs: None where the annotation has no
None, and of classes whatever is none of theirs. A `float` arrives as one, be it given as an int, as a number of NumPy's
or as an array without dimensions; duals and symbols pass as they are. A `bool` may be a number or None, as in pydrake.
Of annotations that say less than a class does (`ArrayLike`, `Callable[...]`) only None is refused; `Any` takes
everything, a type variable what its bound does. A public class that a module names for type checkers alone is found by
its name, if it is loaded when the call is first made. Where the body then stumbles, arguments are looked at more
closely (`_taken`): the error is about them, as in pydrake, and not about the body. For calls with several forms see
`_overloads`.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Iterator
from typing import Any, TypeVar

import numpy as np

from sheldrake.common._taken import STUMBLES, Test, early_refusal, is_number, is_number_or_none, refusal, test_of

_Decorated = TypeVar("_Decorated", bound=Callable[..., Any])


def checked(decorated: _Decorated) -> _Decorated:
    """Decorates a function or method so that its arguments are checked; nearest to it where there are more decorators.

    A class is decorated for its constructor and its public methods.

    Raises:
        TypeError: from the call, for an argument that its annotation excludes.
    """
    if not isinstance(decorated, type):
        return _checked(decorated)
    for name, member in list(vars(decorated).items()):
        if name == "__init__" or name[0] != "_":
            if isinstance(member, (staticmethod, classmethod)):
                setattr(decorated, name, type(member)(_unless_it_looks_itself(member.__func__)))
            elif inspect.isfunction(member) and member.__code__.co_argcount + member.__code__.co_kwonlyargcount > 1:
                setattr(decorated, name, _unless_it_looks_itself(member))
    return decorated


def _unless_it_looks_itself(function: Any) -> Any:
    return function if hasattr(function, "_ways") or hasattr(function, "__wrapped__") else _checked(function)


def _checked(function: Any) -> Any:
    tests: list[Test | None] = []
    by_name: dict[str, Test] = {}
    floats: dict[tuple[Any, ...], list[int]] = {}  # types of positional arguments that pass: which become floats
    passing: set[tuple[Any, ...]] = set()  # those of which none does, with `_Left` for what is left out
    by_names: set[tuple[Any, ...]] = set()  # the same where some are given by name: all types, then the names
    places = _places(function)

    def anew(*args: Any, **kwargs: Any) -> Any:
        types: tuple[Any, ...] = (*map(type, args), *map(type, kwargs.values()), *kwargs)
        if kwargs:
            if types in by_names:
                return function(*args, **kwargs)
        elif (to_float := floats.get(types)) is not None:
            return function(*[float(v) if i in to_float else v for i, v in enumerate(args)])
        if not tests:  # the first call: names in annotations may be defined below the function
            tests.extend(_by_position(function, by_name))
        for test, value in zip(tests, args):
            if test is not None and not test(value):
                raise early_refusal(call, args, kwargs)
        for name, value in kwargs.items():
            if name in by_name and not by_name[name](value):
                raise early_refusal(call, args, kwargs)
        to_float = [i for i, (test, v) in enumerate(zip(tests, args)) if test in _NUMBERS and as_float(v) is not v]
        named = {k: as_float(v) if by_name.get(k) in _NUMBERS else v for k, v in kwargs.items()}
        if kwargs:
            if not to_float and all(named[k] is v for k, v in kwargs.items()) and len(by_names) < _MOST_KNOWN:
                by_names.add(types)
        elif not to_float:
            if len(passing) < _MOST_KNOWN and len(types) <= places:
                passing.add(types + (_Left,) * (places - len(types)))
        elif len(floats) < _MOST_KNOWN and not any(isinstance(args[i], np.ndarray) for i in to_float):
            floats[types] = to_float  # (of arrays, only those without dimensions are numbers)
        return function(*[float(v) if i in to_float else v for i, v in enumerate(args)], **named)

    call = functools.wraps(function)(_quick(places)(function, passing, anew))
    return call


class _Left:
    """Stands for an argument that is left out."""


_LEFT_OUT = _Left()


def _places(function: Callable[..., Any]) -> int:
    """How many arguments a function takes by position, at least one; those of `*args` do not count."""
    return max(1, function.__code__.co_argcount)


@functools.cache
def _quick(places: int) -> Callable[..., Callable[..., Any]]:
    """Makes calls of functions of so many arguments: types seen before go straight on, others through `anew`.

    Written out by number, as `tuple(map(type, args))` and `function(*args)` take three times as long as the rest.
    """
    names = [f"a{i}" for i in range(places)]
    ways = [f"if {names[n - 1]} is not left_out: return function({', '.join(names[:n])})" for n in range(places, 0, -1)]
    text = f"""
def make(function, passing, anew):
    def call({", ".join(f"{name}=left_out" for name in names)}, /, *rest, **named):
        try:
            if ({"".join(f"type({name}), " for name in names)}) in passing and not rest and not named:
                {(chr(10) + " " * 16).join(ways)}
            given = [a for a in ({"".join(f"{name}, " for name in names)}) if a is not left_out]
            return anew(*given, *rest, **named)
        except stumbles as error:
            given = [a for a in ({"".join(f"{name}, " for name in names)}) if a is not left_out]
            refused = refusal(function, (*given, *rest), named, error)
            if refused is None:
                raise
            raise refused from error
    return call
"""
    made: dict[str, Any] = {"__name__": __name__, "left_out": _LEFT_OUT, "stumbles": STUMBLES, "refusal": refusal}
    exec(compile(text, "<checked>", "exec"), made)
    make: Callable[..., Callable[..., Any]] = made["make"]
    return make


def as_float(value: Any) -> Any:
    """A number of Python or NumPy as a float; anything else as it is."""
    return float(value) if type(value) is not float and isinstance(value, _PLAIN_NUMBERS) else value


_MOST_KNOWN = 64  # a program that makes classes for ever must not fill memory
_MANY = 20  # arguments of a call that takes any number of them by position; those beyond are not looked at


def _by_position(function: Callable[..., Any], by_name: dict[str, Test]) -> Iterator[Test | None]:
    """The tests of arguments in order, None for one that takes everything; those by name are filled in."""
    for name, parameter in inspect.signature(function).parameters.items():
        test = test_of(parameter.annotation, function)
        if parameter.kind is parameter.VAR_POSITIONAL:
            yield from [test] * _MANY
        elif parameter.kind is not parameter.VAR_KEYWORD:
            if test is not None:
                by_name[name] = test
            if parameter.kind is not parameter.KEYWORD_ONLY:
                yield test


_NUMBERS = (is_number, is_number_or_none)
_PLAIN_NUMBERS = (float, int, np.integer, np.floating, np.bool_, np.ndarray)
