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
from collections.abc import Callable
from typing import Any, TypeVar

from sheldrake.common._taken import STUMBLES, refusal

_Decorated = TypeVar("_Decorated", bound=Callable[..., Any])


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
