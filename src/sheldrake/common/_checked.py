"""Calls that check their arguments against the annotations of their parameters.

    @checked
    def SourceIsRegistered(self, source_id: SourceId) -> bool: ...

What a parameter does not take is a TypeError that names it, before the body runs: None where the annotation has no
None, and of classes whatever is none of theirs. Numbers are what Python takes for numbers. Of annotations that say
less than a class does (`ArrayLike`, `Callable[...]`, names that exist for type checkers alone) only None is refused;
`Any` takes everything, a type variable what its bound does. For calls with several forms see `_overloads`.
"""

from __future__ import annotations

import ast
import functools
import inspect
from collections.abc import Callable, Iterator
from typing import Any, TypeVar

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
    known: set[tuple[type, ...]] = set()  # types of positional arguments that passed: tests look at nothing else

    @functools.wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        types = tuple(map(type, args))
        if not kwargs and types in known:
            return function(*args)
        if not tests:  # the first call: names in annotations may be defined below the function
            tests.extend(_by_position(function, by_name))
        for test, value in zip(tests, args):
            if test is not None and not test(value):
                raise _refusal(call, args, kwargs)
        for name, value in kwargs.items():
            if name in by_name and not by_name[name](value):
                raise _refusal(call, args, kwargs)
        if len(known) < _MOST_KNOWN:
            known.add(types)
        return function(*args, **kwargs)

    return call  # type: ignore[return-value]


_MOST_KNOWN = 64  # a program that makes classes for ever must not fill memory
_MANY = 20  # arguments of a call that takes any number of them by position; those beyond are not looked at


def _by_position(function: Callable[..., Any], by_name: dict[str, _Test]) -> Iterator[_Test | None]:
    """The tests of arguments in order, None for one that takes everything; those by name are filled in."""
    for name, parameter in inspect.signature(function).parameters.items():
        test = _test_of(parameter.annotation, function)
        if parameter.kind is parameter.VAR_POSITIONAL:
            yield from [test] * _MANY
        elif parameter.kind is not parameter.VAR_KEYWORD:
            if test is not None:
                by_name[name] = test
            if parameter.kind is not parameter.KEYWORD_ONLY:
                yield test


def _test_of(annotation: object, function: Callable[..., Any]) -> _Test | None:
    if annotation is inspect.Parameter.empty:
        return None
    members = list(_members(annotation, getattr(inspect.unwrap(function), "__globals__", {})))
    if Any in members or object in members:
        return None
    takes_none = None in members
    tests = [_takes(member) for member in members if member is not None]
    if _not_none in tests:
        return None if takes_none else _not_none
    if len(tests) == 1 and not takes_none:
        return tests[0]
    return lambda value: takes_none if value is None else any(test(value) for test in tests)


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
        return lambda value: isinstance(value, bool | int) or type(value).__name__ in ("bool_", "bool")
    if member is int or (isinstance(member, type) and hasattr(member, "__index__")):
        return lambda value: hasattr(type(value), "__index__")  # an index of one kind of things is a number, too
    if not isinstance(member, type) or hasattr(member, "_template"):  # a class for each scalar; others convert
        return _not_none
    return lambda value: isinstance(value, member)


def _not_none(value: object) -> bool:
    return value is not None


def _is_number(value: object) -> bool:
    return value is not None and not isinstance(value, str)  # what is no number else, the body's arithmetic finds


def _refusal(call: Callable[..., Any], args: tuple[Any, ...], kwargs: dict[str, Any]) -> Mismatch:
    signature = inspect.signature(call)
    for name, value in signature.bind_partial(*args, **kwargs).arguments.items():
        parameter = signature.parameters[name]
        test = _test_of(parameter.annotation, call)
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
