"""Warnings about retired names, shown once each.

To see every use: `warnings.simplefilter("always", DrakeDeprecationWarning)`; to see none, `"ignore"`.
"""

from __future__ import annotations

import os
import re
import sys
import warnings
from collections.abc import Callable, MutableMapping
from types import ModuleType
from typing import Any

__all__ = [
    "DrakeDeprecationWarning",
    "ModuleShim",
    "deprecated",
    "deprecated_callable",
    "install_numpy_warning_filters",
]

_DATE = re.compile(r"\d\d\d\d-\d\d-\d\d")


class DrakeDeprecationWarning(DeprecationWarning):
    """A name that Drake retired, or is about to retire, was used."""


def _format_deprecation_message(message: str, *, date: str | None = None) -> str:
    assert isinstance(message, str), f"a deprecation message is a str, not {message!r}"
    if date is not None:
        assert isinstance(date, str) and _DATE.fullmatch(date), f"{date!r} is not a date of the form YYYY-MM-DD"
        message = f"{message} The deprecated code will be removed from Drake on or after {date}."
    assert _DATE.search(message), (
        f"A deprecation message names its removal date as YYYY-MM-DD; pass date='YYYY-MM-DD'. Message: {message}"
    )
    return message


def _warn_deprecated(message: str, *, date: str | None = None, stacklevel: int = 2) -> None:
    """Warn that something is deprecated, blaming the caller `stacklevel` frames up."""
    text = _format_deprecation_message(message, date=date)
    warnings.warn(text, category=DrakeDeprecationWarning, stacklevel=stacklevel)


def _warn_of_retired(call: str, today: str) -> None:
    """Warn that Drake removes a call in June of 2026, blaming the nearest caller outside of the library."""
    frame, level = sys._getframe(1), 3  # a call may go through checks and other ways to make it: their number varies
    while frame.f_back is not None and str(frame.f_globals.get("__name__")).startswith("sheldrake."):
        frame, level = frame.f_back, level + 1
    _warn_deprecated(f"{call} is deprecated: use {today}.", date="2026-06-01", stacklevel=level)


class ModuleShim:
    """A module whose missing names are asked from a handler, `handler(name)`, and then kept."""

    def __init__(self, orig_module: ModuleType, handler: Callable[[str], Any]):
        assert isinstance(orig_module, ModuleType), f"{orig_module} must be a module"
        assert hasattr(orig_module, "__all__"), f"module {orig_module.__name__} needs an `__all__`"
        object.__setattr__(self, "_orig_module", orig_module)
        object.__setattr__(self, "_handler", handler)
        object.__setattr__(self, "__doc__", orig_module.__doc__)

    def __getattr__(self, name: str) -> Any:
        module = self._orig_module
        if hasattr(module, name):
            return getattr(module, name)
        try:
            value = self._handler(name)
        except AttributeError as error:
            if str(error):
                raise
            raise AttributeError(f"'module' object has no attribute '{name}'") from None
        setattr(module, name, value)
        return value

    def __setattr__(self, name: str, value: object) -> None:
        setattr(self._orig_module, name, value)

    def __delattr__(self, name: str) -> None:
        delattr(self._orig_module, name)

    def __repr__(self) -> str:
        return repr(self._orig_module)

    def __dir__(self) -> list[str]:
        return self._orig_module.__all__

    @classmethod
    def _install(cls, name: str, handler: Callable[[str], Any], *, auto_all: bool = False) -> None:
        """Put a shim in place of the imported module `name`."""
        module = sys.modules[name]
        if auto_all:
            module.__all__ = [public for public in vars(module) if not public.startswith("_")]  # type: ignore
        sys.modules[name] = cls(module, handler)  # type: ignore


class _DeprecatedDescriptor:
    """A class member that warns whenever it is touched."""

    def __init__(self, original: Any, message: str, *, date: str | None = None):
        assert hasattr(original, "__get__"), f"`original` must be a descriptor: {original}"
        self._original = original
        self._message = message
        self._date = date
        self.__doc__ = original.__doc__

    def _warn(self) -> None:
        _warn_deprecated(self._message, date=self._date, stacklevel=4)

    def __get__(self, obj: object, objtype: type | None = None) -> Any:
        self._warn()
        return self._original.__get__(obj, objtype)

    def __set__(self, obj: object, value: object) -> None:
        self._warn()
        self._original.__set__(obj, value)

    def __delete__(self, obj: object) -> None:
        self._warn()
        self._original.__delete__(obj)


def deprecated(message: str, *, date: str | None = None) -> Callable[[Any], _DeprecatedDescriptor]:
    """Decorator for a class member: warns when the member is accessed (not when it is called).

    Args:
        message: What to use instead.
        date: Removal date, YYYY-MM-DD; needed unless the message has one.
    """

    def decorate(original: Any) -> _DeprecatedDescriptor:
        return _DeprecatedDescriptor(original, message, date=date)

    return decorate


def deprecated_callable(message: str, *, date: str | None = None) -> Callable[[Callable], Callable]:
    """Decorator for a function or class: warns when it is called.

    Args:
        message: What to use instead.
        date: Removal date, YYYY-MM-DD; needed unless the message has one.
    """

    def decorate(original: Any) -> Callable:
        def wrapped(*args: Any, **kwargs: Any) -> Any:
            _warn_deprecated(message, date=date, stacklevel=3)
            return original(*args, **kwargs)

        wrapped.__name__ = original.__name__
        wrapped.__qualname__ = original.__name__
        wrapped.__doc__ = f"Warning:\n\n    {_format_deprecation_message(message, date=date)}"
        return wrapped

    return decorate


def _forward_callables_as_deprecated(var_dict: MutableMapping[str, Any], m_new: ModuleType, date: str) -> None:
    """Offer the public callables of `m_new` under an old module's globals, each warning when called."""
    old_module = var_dict["__name__"]
    public = getattr(m_new, "__all__", [name for name in vars(m_new) if not name.startswith("_")])
    for name in public:
        new = getattr(m_new, name)
        assert callable(new), f"{m_new.__name__}.{name} is not callable"
        message = f"Please use ``{m_new.__name__}.{name}`` instead of ``{old_module}.{name}``."
        old = deprecated_callable(message, date=date)(new)
        old.__module__ = old_module
        var_dict[name] = old


_installed_numpy_warning_filters = False


def install_numpy_warning_filters(force: bool = False) -> None:
    """Make NumPy's swallowed comparison errors of object arrays loud.

    Args:
        force: Install again although done before.
    """
    global _installed_numpy_warning_filters
    if _installed_numpy_warning_filters and not force:
        return
    _installed_numpy_warning_filters = True
    for text in (
        "numpy equal will not",
        "elementwise == comparison failed",
        "elementwise != comparison failed",
        "elementwise comparison failed",
    ):
        warnings.filterwarnings("error", category=DeprecationWarning, message=text)
    warnings.filterwarnings("ignore", category=RuntimeWarning, message="invalid value encountered in")


# The variable that turns warnings into errors is Drake's own, so that one setting serves both.
_action = "error" if os.environ.get("_DRAKE_DEPRECATION_IS_ERROR") == "1" else "once"
warnings.simplefilter(_action, DrakeDeprecationWarning)  # type: ignore[arg-type]
