"""What a misspelt word of a script was probably meant to be, for the errors in which Python's own text does not say."""

from __future__ import annotations

import difflib
import importlib
import inspect
import re
import sys
from collections.abc import Callable, Iterable
from typing import Any

_ARGUMENT = re.compile(r"([\w.]+)\(\) got an unexpected keyword argument '(\w+)'")
_IMPORT = re.compile(r"cannot import name '(\w+)' from '([\w.]+)'")


def did_you_mean(error: BaseException) -> str | None:
    """A sentence with the name that is there and is spelt most alike; None without one, and for other errors."""
    if isinstance(error, TypeError) and (found := _ARGUMENT.search(str(error))):
        return _of_arguments(*found.groups())
    if isinstance(error, ImportError) and (found := _IMPORT.search(str(error))):
        return _of_names(found[1], _names_of(sys.modules.get(found[2])))
    if isinstance(error, AttributeError) and error.name:
        return _of_names(error.name, _names_of(error.obj))
    if isinstance(error, NameError) and error.name:
        return _of_names(error.name, _names_where(error))
    return None


def _of_names(name: str, known: Iterable[str]) -> str | None:
    nearest = _nearest(name, known)
    return None if nearest is None else f"did you mean {nearest!r}?"


def _of_arguments(call: str, name: str) -> str | None:
    function = _function(call)
    if function is None:
        return None
    kinds = inspect.Parameter
    parameters = inspect.signature(function).parameters.values()
    known = [p.name for p in parameters if p.kind in (kinds.POSITIONAL_OR_KEYWORD, kinds.KEYWORD_ONLY)]
    said = call.removesuffix(".__init__")
    return _of_names(name, known) or f"{said}() takes {', '.join(n for n in known if n != 'self') or 'no names'}."


def _function(call: str) -> Callable[..., Any] | None:
    """The function of a public name, such as `Simulator.AdvanceTo`, if it is plain enough to say what it takes."""
    from sheldrake._pydrake import names

    first, *rest = call.split(".")
    for module in names.modules_with(first):
        found: Any = getattr(importlib.import_module(f"sheldrake{module.removeprefix('pydrake')}"), first, None)
        for name in rest:
            found = getattr(found, name, None)
        if inspect.isroutine(found):
            return found
    return None


def _nearest(name: str, known: Iterable[str]) -> str | None:
    """The known name that is the same but for capitals and underscores, or else spelt most alike."""
    shortest_last = sorted((other for other in known if not other.startswith("_")), key=len, reverse=True)
    by_letters = {_letters(other): other for other in shortest_last}  # MultibodyPlant, not MultibodyPlant_
    close = difflib.get_close_matches(_letters(name), by_letters, n=1, cutoff=0.75)
    return by_letters[close[0]] if close else None


def _letters(name: str) -> str:
    return name.replace("_", "").lower()


def _names_of(value: Any) -> list[str]:
    public = getattr(value, "__all__", None)
    return list(public) if inspect.ismodule(value) and public else dir(value)


def _names_where(error: BaseException) -> list[str]:
    """What a script could have named where an error came up."""
    trace = error.__traceback__
    if trace is None:
        return []
    while trace.tb_next is not None:
        trace = trace.tb_next
    return [*trace.tb_frame.f_locals, *trace.tb_frame.f_globals]
