"""Calls whose arguments are checked once the call has failed.

    @checked_late
    def DiscreteTimeApproximation(system: LinearSystem, time_step: float) -> LinearSystem: ...

Where a body stumbles over an argument of the wrong kind, the error is about the body: None has no attribute `A`. With
this decorator the arguments are then compared with the annotations, and what a parameter does not take is a TypeError
that names it, as pydrake raises. Errors about arguments of the right kinds stay as they are. A call that succeeds pays
for one more frame and no test, so this is for calls that take microseconds; see `_checked` for those that must refuse
before they begin.
"""

from __future__ import annotations

import functools
import inspect
import re
import sys
from collections.abc import Callable, Iterator
from typing import Any, TypeVar

from sheldrake.common._checked import test_of
from sheldrake.common._overloads import Mismatch, describe

_Decorated = TypeVar("_Decorated", bound=Callable[..., Any])
STUMBLES = (
    AttributeError,
    IndexError,
    KeyError,
    NotImplementedError,
    RuntimeError,
    StopIteration,
    ValueError,
    ZeroDivisionError,
)
_NEVER = (str, bytes, dict, set, type(None))


def checked_late(decorated: _Decorated) -> _Decorated:
    """Decorates a function, or a class for its constructor and its public methods.

    Raises:
        TypeError: from a call that failed, for an argument that its annotation excludes.
    """
    if not isinstance(decorated, type):
        return _late(decorated)
    for name, member in list(vars(decorated).items()):
        if name == "__init__" or name[0] != "_":
            if isinstance(member, (staticmethod, classmethod)):
                setattr(decorated, name, type(member)(_late(member.__func__)))
            elif inspect.isfunction(member) and member.__code__.co_argcount + member.__code__.co_kwonlyargcount > 1:
                setattr(decorated, name, _late(member))
    return decorated


def _late(function: Any) -> Any:
    if hasattr(function, "_ways") or hasattr(function, "__wrapped__"):  # these look at their arguments themselves
        return function

    @functools.wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        try:
            return function(*args, **kwargs)
        except STUMBLES as error:
            refused = refusal(function, args, kwargs, error)
            if refused is None:
                raise
            raise refused from error

    return call


def refusal(
    function: Callable[..., Any], args: tuple[Any, ...], kwargs: dict[str, Any], error: BaseException
) -> Mismatch | None:
    """The error for arguments of a failed call that are not what its parameters take; None if they are."""
    stumbled_over = _without_attribute(error)
    for parameter, value in _given(function, args, kwargs):
        if value is parameter.default or (value is None and _may_be_stated(error)):
            continue
        test = _test_of(parameter.annotation, function)
        if test is not None and not test(value):
            annotation = parameter.annotation
            expected = annotation if isinstance(annotation, str) else getattr(annotation, "__name__", annotation)
            wanted = f"must be {expected}, not"
        elif any(value is thing for thing in stumbled_over) and (test is None or test(_UNKNOWN)):
            wanted = "cannot be"
        else:
            continue
        found = "None" if value is None else describe(value)
        call = function.__qualname__
        return Mismatch(f"{call}(): incompatible function arguments. {parameter.name} {wanted} {found}.")
    return None


def _may_be_stated(error: BaseException) -> bool:
    """Whether an error may be what the library says of None, which pydrake takes for a pointer to nothing."""
    return isinstance(error, RuntimeError) or " is None" in str(error)


def _without_attribute(error: BaseException) -> list[Any]:
    """What code of the library, not of its caller, looked at for an attribute that it has not."""
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    ours = trace is not None and trace.tb_frame.f_globals.get("__name__", "").startswith("sheldrake.")
    return [error.obj] if ours and isinstance(error, AttributeError) and error.name is not None else []


_UNKNOWN = object()  # what passes with this has been tested for little


def _given(
    function: Callable[..., Any], args: tuple[Any, ...], kwargs: dict[str, Any]
) -> Iterator[tuple[inspect.Parameter, Any]]:
    signature = inspect.signature(function)
    for name, value in signature.bind(*args, **kwargs).arguments.items():
        parameter = signature.parameters[name]
        if parameter.kind is parameter.VAR_POSITIONAL:
            yield from ((parameter, v) for v in value)
        elif parameter.kind is not parameter.VAR_KEYWORD:
            yield parameter, value


def _test_of(annotation: object, function: Callable[..., Any]) -> Callable[[Any], bool] | None:
    text = str(annotation)
    if text in ("ArrayLike", "np.ndarray", "Expression", "Formula", "Polynomial"):  # what other things become
        return lambda value: not isinstance(value, _NEVER)
    return test_of(annotation, function, _classes_named_in(text))


def _classes_named_in(annotation: str) -> dict[str, Any]:
    """Classes of the library by the names in an annotation, which its module may know for type checkers alone."""
    found: dict[str, set[type]] = {name: set() for name in re.findall(r"\w+", annotation)}
    for module in [module for name, module in sys.modules.items() if name.startswith("sheldrake.")]:
        for name, classes in found.items():
            if isinstance(member := vars(module).get(name), type):
                classes.add(member)
    return {name: classes.pop() for name, classes in found.items() if len(classes) == 1}
