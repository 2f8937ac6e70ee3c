"""Choosing among the signatures of one call by the names and types of its arguments."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from sheldrake.common._names import pretty_class_name


class Mismatch(TypeError):
    """A value that a converter cannot take; the next signature is tried."""

    def __init__(self, text: str = "incompatible function arguments: one is of the wrong type") -> None:
        super().__init__(text)


class Signature(NamedTuple):
    """One way to make a call."""

    function: Callable[..., Any]
    parameters: tuple[tuple[str, Callable[[Any], Any], str], ...]  # name, converter, what it takes in words

    def __str__(self) -> str:
        return f"({', '.join(f'{name}: {words}' for name, _, words in self.parameters)})"


def signature(function: Callable[..., Any], **parameters: tuple[Callable[[Any], Any], str]) -> Signature:
    """A signature that calls `function(target, *converted values)`."""
    return Signature(function, tuple((name, *kind) for name, kind in parameters.items()))


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


def call_first_match(
    call: str,
    signatures: Sequence[Signature],
    target: Any,
    args: Sequence[Any],
    kwargs: Mapping[str, Any],
    *,
    constructor: bool = False,
) -> Any:
    """What the first signature that accepts the arguments gives.

    Args:
        call: Name of the call, for the error.
        signatures: In order of preference.
        target: The object called upon, the first argument of each function.
        args: Positional arguments.
        kwargs: Named arguments.
        constructor: The call makes an object.

    Raises:
        TypeError: no signature accepts them.
    """
    for one in signatures:
        values = in_order([name for name, _, _ in one.parameters], args, kwargs)
        if values is None:
            continue
        try:
            converted = [convert(value) for (_, convert, _), value in zip(one.parameters, values)]
        except Mismatch:
            continue
        return one.function(target, *converted)
    raise incompatible(call, [str(one) for one in signatures], args, kwargs, constructor=constructor)


def describe(value: Any) -> str:
    """Type of a value, and shape of an array, for an error."""
    shape = getattr(value, "shape", None)
    kind = pretty_class_name(type(value))
    return f"{kind} of shape {shape}" if shape not in (None, ()) else kind


def incompatible(
    call: str, accepted: Sequence[str], args: Sequence[Any], kwargs: Mapping[str, Any], *, constructor: bool = False
) -> TypeError:
    """The TypeError for a call with arguments of the wrong names or types.

    The words `incompatible ... arguments` are what `Foo_(...)` looks for when it tries one scalar after the other.
    """
    found = [describe(value) for value in args] + [f"{name}={describe(value)}" for name, value in kwargs.items()]
    kind = "constructor" if constructor else "function"
    return TypeError(
        f"{call}(): incompatible {kind} arguments. Got ({', '.join(found)}); accepted: {', '.join(accepted)}."
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


def instance_of(cls: type) -> tuple[Callable[[Any], Any], str]:
    """Parameter kind: an object of one class."""

    def convert(value: Any) -> Any:
        if not isinstance(value, cls):
            raise Mismatch
        return value

    return convert, pretty_class_name(cls)
