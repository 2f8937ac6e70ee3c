"""Calls that check their arguments against the annotations of their parameters.

    @checked
    def SourceIsRegistered(self, source_id: SourceId) -> bool: ...

What a parameter does not take is a TypeError that names it, before the body runs: None where the annotation has no
None, and of classes whatever is none of theirs. A `float` arrives as one, be it given as an int, as a number of NumPy's
or as an array without dimensions; duals and symbols pass as they are. Of annotations that say less than a class does
(`ArrayLike`, `Callable[...]`, names that exist for type checkers alone) only None is refused; `Any` takes everything, a
type variable what its bound does. For calls with several forms see `_overloads`.
"""

from __future__ import annotations

import ast
import functools
import inspect
from collections.abc import Callable, Iterator
from typing import Any, TypeVar

import numpy as np

from sheldrake.common._overloads import Mismatch, describe

_Function = TypeVar("_Function", bound=Callable[..., Any])
_Test = Callable[[Any], bool]


def checked(function: _Function) -> _Function:
    """Decorates a function or method so that its arguments are checked; nearest to it where there are more decorators.

    Raises:
        TypeError: from the call, for an argument that its annotation excludes.
    """
    tests: list[_Test | None] = []
    by_name: dict[str, _Test] = {}
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
                raise _refusal(call, args, kwargs)
        for name, value in kwargs.items():
            if name in by_name and not by_name[name](value):
                raise _refusal(call, args, kwargs)
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
    return call  # type: ignore[return-value]


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
        if ({"".join(f"type({name}), " for name in names)}) in passing and not rest and not named:
            {(chr(10) + " " * 12).join(ways)}
        given = [a for a in ({"".join(f"{name}, " for name in names)}) if a is not left_out]
        return anew(*given, *rest, **named)
    return call
"""
    made: dict[str, Any] = {"__name__": __name__, "left_out": _LEFT_OUT}
    exec(compile(text, "<checked>", "exec"), made)
    make: Callable[..., Callable[..., Any]] = made["make"]
    return make


def as_float(value: Any) -> Any:
    """A number of Python or NumPy as a float; anything else as it is."""
    return float(value) if type(value) is not float and isinstance(value, _PLAIN_NUMBERS) else value


_MOST_KNOWN = 64  # a program that makes classes for ever must not fill memory
_MANY = 20  # arguments of a call that takes any number of them by position; those beyond are not looked at


def _by_position(function: Callable[..., Any], by_name: dict[str, _Test]) -> Iterator[_Test | None]:
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


def test_of(annotation: object, function: Callable[..., Any], more_names: dict[str, Any] | None = None) -> _Test | None:
    """What an annotation of a function asks of an argument, None if nothing; its names are its module's, and more."""
    if annotation is inspect.Parameter.empty:
        return None
    names = getattr(inspect.unwrap(function), "__globals__", {})
    members = list(_members(annotation, {**more_names, **names} if more_names else names))
    if Any in members or object in members:
        return None
    takes_none = None in members
    tests = [_takes(member) for member in members if member is not None]
    if _not_none in tests:
        return None if takes_none else _not_none
    if len(tests) == 1:
        return tests[0] if not takes_none else _is_number_or_none if tests[0] is _is_number else _or_none(tests[0])
    return lambda value: takes_none if value is None else any(test(value) for test in tests)


def _or_none(test: _Test) -> _Test:
    return lambda value: value is None or test(value)


def _members(annotation: Any, names: dict[str, Any]) -> Iterator[Any]:
    """What a union is of; the annotation itself where it is none. `...` stands for what is unknown when code runs."""
    if isinstance(annotation, TypeVar):
        annotation = annotation.__bound__ or Any
    if not isinstance(annotation, str):
        yield from getattr(annotation, "__args__", [annotation]) if _is_union(annotation) else [annotation]
        return
    tree = ast.parse(annotation, mode="eval").body
    if isinstance(tree, ast.BinOp) and isinstance(tree.op, ast.BitOr):
        yield from _members(ast.unparse(tree.left), names)
        yield from _members(ast.unparse(tree.right), names)
        return
    try:
        value = eval(compile(ast.Expression(tree), "<annotation>", "eval"), names)
    except (NameError, AttributeError):
        value = ...
    yield from _members(value, names) if _is_union(value) or isinstance(value, TypeVar) else [value]


def _is_union(value: object) -> bool:
    return type(value).__name__ in ("Union", "UnionType", "_UnionGenericAlias")


def _takes(member: object) -> _Test:
    if member is float:
        return _is_number
    if member is bool:
        return lambda value: isinstance(value, (bool, int, np.bool_, np.integer))
    if member is int:
        return lambda value: hasattr(type(value), "__index__")
    if not isinstance(member, type):
        return _not_none
    if hasattr(member, "__index__"):  # a plain number is one of any kind of things, a number of other things is not
        return lambda value: isinstance(value, (member, int, np.integer))
    template = vars(member).get("_template")
    if template is None:
        return lambda value: isinstance(value, member)
    return lambda value: isinstance(value, member) or _is_of(type(value), template)  # on any scalar


def _is_of(cls: type, template: object) -> bool:
    return any(vars(base).get("_template") is template for base in cls.__mro__)


def _not_none(value: object) -> bool:
    return value is not None


def _is_number(value: object) -> bool:
    if isinstance(value, np.ndarray):
        return value.ndim == 0
    return value is not None and not isinstance(value, _NO_NUMBERS)  # what is no number else, arithmetic finds


def _is_number_or_none(value: object) -> bool:
    return value is None or _is_number(value)


_NUMBERS = (_is_number, _is_number_or_none)
_NO_NUMBERS = (str, bytes, complex, list, tuple, dict, set)
_PLAIN_NUMBERS = (float, int, np.integer, np.floating, np.bool_, np.ndarray)


def _refusal(call: Callable[..., Any], args: tuple[Any, ...], kwargs: dict[str, Any]) -> Mismatch:
    signature = inspect.signature(call)
    for name, value in signature.bind_partial(*args, **kwargs).arguments.items():
        parameter = signature.parameters[name]
        test = test_of(parameter.annotation, call)
        values = value if parameter.kind is parameter.VAR_POSITIONAL else (value,)
        wrong = [v for v in values if test is not None and not test(v)]
        if wrong and parameter.kind is not parameter.VAR_KEYWORD:
            annotation = parameter.annotation
            if isinstance(annotation, str):
                variable = getattr(inspect.unwrap(call), "__globals__", {}).get(annotation)
                annotation = variable.__bound__ if isinstance(variable, TypeVar) else annotation
            expected = annotation if isinstance(annotation, str) else getattr(annotation, "__name__", annotation)
            found = "None" if wrong[0] is None else describe(wrong[0])
            what = f"{name} must be {expected}, not {found}"
            return Mismatch(f"{call.__qualname__}(): incompatible function arguments. {what}.")
    raise AssertionError("an argument was refused that none of its parameters refuses")
