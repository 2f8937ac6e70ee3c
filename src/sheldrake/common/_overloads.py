"""Calls that may be made in several ways: how they are stated, who chooses among them, and the error that lists them.

A way to make a call is an `overload`: names of its parameters, and what each takes. What a parameter takes is a *kind*:
a function that converts a value, or raises `Mismatch`; its attribute `description` names it in errors (kinds in common
use are in `_kinds`). State the ways beside the body that they all lead to,

    @overloaded(overload(e=expression), overload(binding=instance_of(Binding), tol=(number, 1e-6)))
    def AddCost(self, what, tol=1e-6): ...

or, where each leads elsewhere, in a list for `dispatch`.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple, TypeVar

from sheldrake.common._names import pretty_class_name

_Result = TypeVar("_Result")
Kind = Callable[[Any], Any]
_Kind = TypeVar("_Kind", bound=Kind)


class Mismatch(TypeError):
    """Arguments that a call does not take, or a value that a kind does not.

    The next way to make the call is tried, and by `Foo_(...)` the class of the next scalar.
    """

    def __init__(self, text: str = "incompatible function arguments: one is of the wrong type") -> None:
        super().__init__(text)


# Tracebacks say what people catch.
Mismatch.__name__ = Mismatch.__qualname__ = "TypeError"
Mismatch.__module__ = "builtins"


def kind(description: str, refuses: tuple[type, ...] = (), takes: tuple[type, ...] = ()) -> Callable[[_Kind], _Kind]:
    """Decorates a converter with a description of what it takes.

    Args:
        description: For errors.
        refuses: Types of which it takes nothing.
        takes: Types of which it hands on everything as it is.
    """

    def name(convert: _Kind) -> _Kind:
        setattr(convert, "description", description)  # noqa: B010 (functions and partials have no such attribute for mypy)
        setattr(convert, "refuses", refuses)  # noqa: B010
        setattr(convert, "takes", takes)  # noqa: B010
        return convert

    return name


class Overload(NamedTuple):
    """One way to make a call: `function(target, *converted values)`."""

    function: Callable[..., Any] | None
    names: tuple[str, ...]
    kinds: tuple[Kind, ...]
    defaults: Mapping[str, Any]

    def __str__(self) -> str:
        shown = []
        for name, convert in zip(self.names, self.kinds):
            description = getattr(convert, "description", None)
            shown.append(name if description is None else f"{name}: {description}")
            if name in self.defaults:
                default = self.defaults[name]
                shown[-1] += f" = {default!r}" if isinstance(default, (int, float, str, type(None))) else " = ..."
        return f"({', '.join(shown)})"

    def converted(self, args: Sequence[Any], kwargs: Mapping[str, Any]) -> list[Any] | None:
        """The values of the parameters, or None where the arguments do not fit; defaults are not converted."""
        values = in_order(self.names, args, kwargs, self.defaults)
        if values is None:
            return None
        try:
            return [
                value if name in self.defaults and value is self.defaults[name] else convert(value)
                for name, convert, value in zip(self.names, self.kinds, values)
            ]
        except Mismatch:
            return None


def overload(function: Callable[..., Any] | None = None, /, **parameters: Any) -> Overload:
    """A way to make a call.

    Args:
        function: Called with the target and the converted values; for `overloaded`, None is what it decorates.
        parameters: The kind of each, or a pair of kind and default.
    """
    pairs = {name: given if isinstance(given, tuple) else (given,) for name, given in parameters.items()}
    defaults = {name: pair[1] for name, pair in pairs.items() if len(pair) > 1}
    return Overload(function, tuple(pairs), tuple(pair[0] for pair in pairs.values()), defaults)


def dispatch(
    call: str,
    ways: Sequence[Overload],
    target: object,
    args: Sequence[Any],
    kwargs: Mapping[str, Any],
    *,
    constructor: bool = False,
) -> Any:
    """What the first way gives that takes the arguments.

    Args:
        call: Name of the call, for the error.
        ways: In order of preference.
        target: The object called upon, the first argument of each function.
        args: Positional arguments.
        kwargs: Named arguments.
        constructor: The call makes an object.

    Raises:
        TypeError: none takes them.
    """
    found = ways.first(args, kwargs) if isinstance(ways, Ways) else _first(ways, args, kwargs)
    if found is None:
        raise incompatible(call, [str(way) for way in ways], args, kwargs, constructor=constructor)
    function, values = found
    return function(target, *values)


def _first(ways: Sequence[Overload], args: Sequence[Any], kwargs: Mapping[str, Any]) -> _Found | None:
    """The function of the first way that takes the arguments, and its values; None if none does."""
    for way in ways:
        values = way.converted(args, kwargs)
        if values is not None:
            assert way.function is not None  # only `overloaded` takes ways without one
            return way.function, values
    return None


_Found = tuple[Callable[..., Any], list[Any]]


class _Plan(NamedTuple):
    """How one way takes positional arguments of certain types.

    Attributes:
        function: What the way leads to.
        steps: For each argument its kind, None if nothing is left to look at.
        tail: Defaults of the other parameters.
    """

    function: Callable[..., Any]
    steps: list[Kind | None]
    tail: list[Any]


class Ways(list[Overload]):
    """The ways to make a call, with a memory: which of them can take arguments of certain types at all."""

    def __init__(self, ways: Sequence[Overload]) -> None:
        super().__init__(ways)
        self._plans: dict[tuple[type, ...], list[_Plan]] = {}
        self.as_given: dict[tuple[type, ...], tuple[Callable[..., Any], list[Any]]] = {}
        """By types of arguments that the first way takes as they are: its function, and what it gets beside them."""

    def first(self, args: Sequence[Any], kwargs: Mapping[str, Any]) -> _Found | None:
        """The function of the first way that takes the arguments, and its values; None if none does."""
        return _first(self, args, kwargs) if kwargs else self._planned(args, tuple(map(type, args)))

    def _planned(self, args: Sequence[Any], types: tuple[type, ...]) -> _Found | None:
        """The same for positional arguments of these types."""
        plans = self._plans.get(types)
        if plans is None:
            if len(self._plans) >= _MOST_PLANS:
                self._plans.clear()
                self.as_given.clear()
            plans = self._plans[types] = [plan for way in self if (plan := _plan(way, types)) is not None]
            if plans and not any(plans[0].steps):
                self.as_given[types] = plans[0].function, plans[0].tail
        for function, steps, tail in plans:
            try:
                return function, [v if convert is None else convert(v) for v, convert in zip(args, steps)] + tail
            except Mismatch:
                continue
        return None

    def choose(self, call: str, args: Sequence[Any], kwargs: Mapping[str, Any]) -> Any:
        """What the first way gives that takes the arguments, called with these alone (see `dispatch`)."""
        if kwargs:
            found = _first(self, args, kwargs)
        else:
            types = tuple(map(type, args))
            direct = self.as_given.get(types)
            if direct is not None:
                return direct[0](*args, *direct[1])
            found = self._planned(args, types)
        if found is None:
            raise incompatible(call, [str(way) for way in self], args, kwargs)
        function, values = found
        return function(*values)


_MOST_PLANS = 64  # a call is made with few types; a program that makes classes for ever must not fill memory


def _plan(way: Overload, types: tuple[type, ...]) -> _Plan | None:
    """How a way takes positional arguments of these types; None if it cannot."""
    count, rest = len(types), way.names[len(types) :]
    if count > len(way.names) or not set(rest) <= set(way.defaults):
        return None
    steps: list[Kind | None] = []
    for name, convert, T in zip(way.names, way.kinds, types):
        if name in way.defaults:
            steps.append(_unless_default(convert, way.defaults[name]))
            continue
        fits = _fits(convert, T)
        if fits is False:
            return None
        steps.append(None if fits else convert)
    assert way.function is not None
    return _Plan(way.function, steps, [way.defaults[name] for name in rest])


def _unless_default(convert: Kind, default: Any) -> Kind:
    return lambda value: value if value is default else convert(value)


def _fits(convert: Kind, T: type) -> bool | None:
    """Whether a kind takes values of a type, which it hands on as they are; None if only the value can tell."""
    if T in getattr(convert, "refuses", ()):
        return False
    if T in getattr(convert, "takes", ()):
        return True
    classes: tuple[type, ...] = getattr(convert, "classes", ())
    if not classes or any("__class__" in vars(base) for base in T.__mro__[:-1]):
        return None
    return issubclass(T, classes)


def overloaded(*ways: Overload) -> Callable[[Callable[..., _Result]], Callable[..., _Result]]:
    """Decorates a function or method with the ways to call it; its body gets the converted values, in order."""

    def decorate(body: Callable[..., _Result]) -> Callable[..., _Result]:
        all_ways = Ways([way if way.function is not None else way._replace(function=body) for way in ways])
        constructor = body.__name__ == "__init__"
        as_given = all_ways.as_given

        def method(self: Any, /, *args: Any, **kwargs: Any) -> Any:
            if not kwargs and (direct := as_given.get(tuple(map(type, args)))) is not None:
                return direct[0](self, *args, *direct[1])
            found = all_ways.first(args, kwargs)
            if found is None:
                name = pretty_class_name(type(self)) if constructor else name_of_call(call, self)
                raise incompatible(name, [str(way) for way in all_ways], args, kwargs, constructor=constructor)
            function, values = found
            return function(self, *values)

        def free(*args: Any, **kwargs: Any) -> Any:
            return all_ways.choose(body.__name__, args, kwargs)

        call = functools.wraps(body)(method if body.__code__.co_varnames[:1] in (("self",), ("cls",)) else free)
        del call.__wrapped__  # its parameters are not those of the call
        call._ways = all_ways  # type: ignore[attr-defined]  # for those who compare signatures
        return call

    return decorate


def in_order(
    names: Sequence[str], args: Sequence[Any], kwargs: Mapping[str, Any], defaults: Mapping[str, Any] | None = None
) -> list[Any] | None:
    """The arguments of a call in the order of the names of its parameters, or None where they do not fit.

    Args:
        names: Names of all parameters.
        args: Positional arguments.
        kwargs: Named arguments.
        defaults: What parameters are that need not be given.
    """
    rest = names[len(args) :]
    given = {**(defaults or {}), **kwargs}
    if len(args) > len(names) or not set(kwargs) <= set(rest) or not set(rest) <= set(given):
        return None
    return [*args, *(given[name] for name in rest)]


def name_of_call(function: Callable[..., Any], subject: object = None) -> str:
    """What errors call a function: where it is a method of a class of its subject, by the class of that."""
    owner, _, name = function.__qualname__.rpartition(".")
    bases = [base.__qualname__ for base in type(subject).__mro__]
    return f"{pretty_class_name(type(subject))}.{name}" if owner in bases else function.__qualname__


def describe(value: object) -> str:
    """Type of a value, and shape of an array, for an error."""
    shape = getattr(value, "shape", None)
    name = pretty_class_name(type(value))
    return f"{name} of shape {shape}" if shape not in (None, ()) else name


def incompatible(
    call: str, accepted: Sequence[str], args: Sequence[Any], kwargs: Mapping[str, Any], *, constructor: bool = False
) -> Mismatch:
    """The error for a call with arguments of the wrong names or types."""
    found = [describe(value) for value in args] + [f"{name}={describe(value)}" for name, value in kwargs.items()]
    what = "constructor" if constructor else "function"
    return Mismatch(
        f"{call}(): incompatible {what} arguments. Got ({', '.join(found)}); accepted: {', '.join(accepted)}."
    )


def expect(call: str, value: Any, cls: type | tuple[type, ...]) -> Any:
    """Returns the value of an argument that must be of a class, or of one of some classes.

    Raises:
        TypeError: it is not.
    """
    if not isinstance(value, cls):
        raise incompatible(
            call, [f"({pretty_class_name(c)})" for c in (cls if isinstance(cls, tuple) else (cls,))], (value,), {}
        )
    return value
