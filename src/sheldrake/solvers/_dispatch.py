"""Calls with several signatures, chosen by names, count and kinds of the arguments."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from sheldrake.common._overloads import Mismatch, in_order, incompatible  # Mismatch is what converters raise
from sheldrake.solvers import _arrays
from sheldrake.solvers._evaluators import takes_vector_function
from sheldrake.symbolic import Formula, Polynomial, Variable, Variables

_REQUIRED = object()


class Parameter(NamedTuple):
    """Name, converter and default of an argument."""

    name: str
    convert: Callable[[Any], Any]
    default: Any = _REQUIRED


class Overload(NamedTuple):
    """One way to make a call: `function(target, *converted)`."""

    function: Callable[..., Any]
    parameters: tuple[Parameter, ...]

    def __str__(self) -> str:
        return "(" + ", ".join(p.name for p in self.parameters) + ")"


def overload(function: Callable[..., Any], **parameters: Any) -> Overload:
    """A way to make a call; each parameter is a converter, or a pair of converter and default."""
    made = (Parameter(n, *(p if isinstance(p, tuple) else (p,))) for n, p in parameters.items())
    return Overload(function, tuple(made))


def dispatch(call: str, overloads: Sequence[Overload], target: Any, args: Sequence[Any], kwargs: Mapping) -> Any:
    """What the first overload gives that takes the arguments.

    Raises:
        TypeError: none takes them.
    """
    for one in overloads:
        defaults = {p.name: p.default for p in one.parameters if p.default is not _REQUIRED}
        values = in_order([p.name for p in one.parameters], args, kwargs, defaults)
        if values is None:
            continue
        try:
            converted = [
                v if p.default is not _REQUIRED and v is p.default else p.convert(v)
                for p, v in zip(one.parameters, values)
            ]
        except Mismatch:
            continue
        return one.function(target, *converted)
    raise incompatible(call, [str(one) for one in overloads], args, kwargs)


def instance(*classes: type) -> Callable[[Any], Any]:
    """Converter: an object of one of the classes."""

    def convert(value: Any) -> Any:
        if not isinstance(value, classes):
            raise Mismatch
        return value

    return convert


def function(value: Any) -> Any:
    """Converter: something to call with a vector."""
    if not takes_vector_function(value):
        raise Mismatch
    return value


def text(value: Any) -> str:
    """Converter: a str."""
    return instance(str)(value)


def count(value: Any) -> int:
    """Converter: a whole number, not negative."""
    if isinstance(value, bool) or not hasattr(value, "__index__") or value.__index__() < 0:
        raise Mismatch
    return value.__index__()


def flag(value: Any) -> bool:
    """Converter: a bool."""
    return bool(instance(bool, int)(value))


def formula(value: Any) -> Formula:
    """Converter: a formula, or True or False."""
    if isinstance(value, bool) or type(value).__name__ in ("bool_", "bool"):
        return Formula(bool(value))
    return instance(Formula)(value)


def formulas(value: Any) -> list[Formula]:
    """Converter: an array of formulas, column after column."""
    import numpy as np

    if np.ndim(value) == 0 or not isinstance(value, (np.ndarray, list, tuple)):
        raise Mismatch
    return [formula(f) for f in np.asarray(value, dtype=object).ravel(order="F")]


def row(value: Any) -> Any:
    """Converter: the coefficients of one row, shape `(1, n)`."""
    A = _arrays.float_matrix(value)
    if A.shape[0] != 1 and A.shape[1] != 1:
        raise Mismatch
    return A.reshape(1, -1)


variable = instance(Variable)
variables = instance(Variables)
polynomial = instance(Polynomial)
vector, matrix, number, vars = _arrays.float_vector, _arrays.float_matrix, _arrays.number, _arrays.variable_vector
expression, expressions = _arrays.expression, _arrays.expression_array
