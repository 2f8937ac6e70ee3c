"""What symbolic calls take (kinds of parameters, see `common._overloads`)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sheldrake.common._kinds import instance_of
from sheldrake.common._overloads import Mismatch, kind, overload
from sheldrake.symbolic._variable import Variable, Variables

_build: Any = None  # A module that needs the class Expression, which needs this one; the package binds it.


@kind("Expression")
def expression(value: Any) -> Any:
    """Kind: an expression, a variable or a number; as an expression."""
    e = _build.as_expression(value)
    if e is None:
        raise Mismatch
    return e


@kind("Variables | array of Variable")
def variables(value: Any) -> Variables:
    """Kind: a set of variables."""
    try:
        return Variables(value)
    except TypeError:
        raise Mismatch from None


variable = instance_of(Variable)
by_variable = kind("dict")(instance_of(Mapping))

# A variable and what takes its place, or many.
SUBSTITUTIONS = (overload(s=by_variable), overload(var=variable, e=expression))
