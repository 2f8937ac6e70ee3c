"""Names that Drake retired since 2021, each with the one that took its place.

They work, with one warning (`DrakeDeprecationWarning`) that names today's way. `sheldrake.all` and the pydrake alias
add them to the modules and classes they were found in; nothing here is imported by the library itself.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from types import ModuleType
from typing import Any

from sheldrake.common._parts import home_of
from sheldrake.common._scalars import ScalarTemplate

from .calls import CALLS, FUNCTION_CALLS, KEYWORDS, takes_retired_keywords
from .functions import FUNCTIONS
from .hints import hint
from .methods import METHODS, Now
from .modules import GONE, GONE_NAMES, MODULES, Module

__all__ = ["FUNCTIONS", "GONE", "GONE_NAMES", "METHODS", "MODULES", "Module", "install"]


def install(module: ModuleType) -> dict[str, Any]:
    """Adds to one of sheldrake's modules the retired names it had.

    Returns:
        The functions and classes added to the module itself, by name; a roll-up module wants them too.
    """
    for class_name, methods in METHODS.get(module.__name__, {}).items():
        cls = getattr(module, class_name, None)
        for name, new in methods.items():
            if cls is not None and not hasattr(cls, name):
                setattr(cls, name, _member(cls, new, f"{class_name}.{name}"))
    for class_name, tables in KEYWORDS.get(module.__name__, {}).items():
        for name, today in tables.items():
            wrap = takes_retired_keywords(f"{class_name}.{name}", today)
            _extend(getattr(module, class_name), name, "keywords", wrap)
    for class_name, calls in CALLS.get(module.__name__, {}).items():
        for name, wrap in calls.items():
            _extend(getattr(module, class_name), name, "calls", wrap)
    functions = FUNCTION_CALLS.get(module.__name__, {})
    for name, wrap in functions.items():
        _extend(module, name, "calls", wrap)
    made = FUNCTIONS.get(module.__name__, dict)()
    added = {name: vars(module).setdefault(name, value) for name, value in made.items()}
    return added | {name: getattr(module, name) for name in functions}


def _member(cls: type, new: str | Now | Any, retired: str) -> Any:
    """A member of a class that warns of its name and is what took its place; see `METHODS`."""
    if isinstance(new, str):
        if not callable(getattr(cls, new)):
            return _renamed_field(new, retired)
        now = Now(f"{new}()", lambda self, *args, **kwargs: getattr(self, new)(*args, **kwargs))
    elif isinstance(new, Now):
        now = new
    else:
        return new

    def method(self: Any, *args: Any, **kwargs: Any) -> Any:
        hint(f"{retired}() is retired: use {now.way}.")
        return now.call(self, *args, **kwargs)

    method.__doc__ = f"Retired: use `{now.way}`."
    on_class = isinstance(new, str) and isinstance(inspect.getattr_static(cls, new), classmethod | staticmethod)
    return classmethod(method) if on_class else method


def _renamed_field(new: str, retired: str) -> property:
    def get(self: Any) -> Any:
        hint(f"{retired} is retired: use {new}.")
        return getattr(self, new)

    def set_(self: Any, value: Any) -> None:
        hint(f"{retired} is retired: use {new}.")
        setattr(self, new, value)

    return property(get, set_, doc=f"Retired: use `{new}`.")


def _extend(owner: Any, name: str, by: str, wrap: Callable) -> None:
    """Puts in the place of a function one that also takes retired ways to call it; once for each kind of ways.

    Class methods and static ones stay what they are, and of a class that exists for several scalars all get it.
    """
    owner = home_of(owner, name) if isinstance(owner, type) else owner
    found = inspect.getattr_static(owner, name)
    function = found.__func__ if isinstance(found, classmethod) else getattr(owner, name)
    done = getattr(function, "_takes_retired", ())
    if by in done:
        return
    extended = functools.wraps(function)(wrap(function))
    extended._takes_retired = (*done, by)  # type: ignore[attr-defined]
    family = vars(owner).get("_template")
    owners = [family[T] for T in family.param_list] if isinstance(family, ScalarTemplate) else [owner]
    kind = type(found) if isinstance(found, classmethod | staticmethod) else lambda function: function
    for each in owners:
        setattr(each, name, kind(extended))
