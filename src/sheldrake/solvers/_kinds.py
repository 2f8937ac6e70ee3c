"""Kinds of parameters of programs: variables, expressions, numbers in arrays (see `common._overloads`)."""

from __future__ import annotations

from typing import Any

import numpy as np

from sheldrake.common._kinds import instance_of
from sheldrake.common._overloads import Mismatch, kind
from sheldrake.solvers import _arrays
from sheldrake.solvers._functions.bindings import BindingBase
from sheldrake.solvers._functions.evaluators import takes_vector_function
from sheldrake.symbolic import Expression, Formula, Polynomial, Variable, Variables


@kind("Callable", refuses=(Expression, Formula))
def function(value: Any) -> Any:
    """Kind: something to call with a vector."""
    if not takes_vector_function(value):
        raise Mismatch
    return value


@kind("Formula", takes=(Formula,))
def formula(value: object) -> Formula:
    """Kind: a formula, or True or False."""
    if isinstance(value, bool) or type(value).__name__ in ("bool_", "bool"):
        return Formula(bool(value))
    return instance_of(Formula)(value)


@kind("array of Formula")
def formulas(value: Any) -> list[Formula]:
    """Kind: an array of formulas, column after column."""
    if np.ndim(value) == 0 or not isinstance(value, (np.ndarray, list, tuple)):
        raise Mismatch
    return [formula(f) for f in np.asarray(value, dtype=object).ravel(order="F")]


@kind("array")
def values(given: Any) -> Any:
    """Kind: values of variables, of any scalar; the body of the call looks at them."""
    if given is None:
        raise Mismatch
    return given


binding = kind("Binding")(instance_of(BindingBase))
variable = instance_of(Variable)
variables = instance_of(Variables)
polynomial = instance_of(Polynomial)
vector, row, matrix, number = _arrays.float_vector, _arrays.float_row, _arrays.float_matrix, _arrays.number
vars, expression, expressions = _arrays.variable_vector, _arrays.expression, _arrays.expression_array
