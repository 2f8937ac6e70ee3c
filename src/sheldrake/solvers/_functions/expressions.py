"""Vectors of expressions as functions of their variables, with their symbolic derivatives."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from sheldrake.solvers._functions.evaluators import EvaluatorBase, WithSlopes
from sheldrake.symbolic import Expression, Jacobian, Variable
from sheldrake.symbolic import _traverse as traverse
from sheldrake.symbolic._compiled import Compiled
from sheldrake.symbolic._tape import Written, write

if TYPE_CHECKING:
    from typing_extensions import Self


class Formulas:
    """Expressions as functions of numbers, which evaluators that differ by their variables alone have in common.

    Args:
        expressions: The expressions.

    Attributes:
        vars: Their variables in the order of their creation: what the numbers stand for.
        values: Their values.
    """

    def __init__(self, expressions: Sequence[Expression]):
        self.expressions = list(expressions)
        found = set().union(*(traverse.variables_of(e) for e in self.expressions)) if self.expressions else set()
        self.vars = traverse.object_array(sorted(found, key=Variable.get_id))
        self.values = Compiled(self.expressions, self.vars)

    @functools.cached_property
    def written(self) -> Written | None:
        """The expressions as operations for kernels; None if they are not smooth."""
        return write(self.expressions, self.vars.tolist(), smooth=True)

    @functools.cached_property
    def derivatives(self) -> tuple[Compiled, np.ndarray, np.ndarray]:
        """Values and the derivatives that are not zero everywhere, and these derivatives' rows and columns."""
        J = Jacobian(self.expressions, self.vars)
        zero = Expression(0.0)
        places = [(i, j) for i, j in np.ndindex(J.shape) if J[i, j] is not zero]
        rows = np.array([p[0] for p in places], dtype=int)
        cols = np.array([p[1] for p in places], dtype=int)
        return Compiled([*self.expressions, *(J[p] for p in places)], self.vars), rows, cols


class ExpressionFunction(WithSlopes, EvaluatorBase):
    """Expressions as an evaluator: values, and derivatives by differentiating symbols once."""

    _formulas: Formulas
    _vars: np.ndarray

    def _set_expressions(self, expressions: Sequence[Expression]) -> None:
        self._formulas = Formulas(expressions)
        self._vars = self._formulas.vars
        self._set_sizes(len(self._formulas.expressions), len(self._vars))

    def _of_others(self, vars: np.ndarray) -> Self:
        out = super()._of_others(vars)
        out._vars = vars
        return out

    def vars(self) -> np.ndarray:
        """Returns the variables of the expressions, shape `(n,)`."""
        return self._vars.copy()

    def _written(self) -> Written | None:
        return self._formulas.written

    def _eval(self, x: np.ndarray) -> np.ndarray:
        return np.array(self._formulas.values(x.tolist()), dtype=float)

    def _eval_with_jacobian(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Values and derivatives together, with the parts that they share."""
        both, rows, cols = self._formulas.derivatives
        found = both(x.tolist())
        m = self._num_outputs
        J = np.zeros((m, len(self._vars)))
        J[rows, cols] = found[m:]
        return np.array(found[:m], dtype=float), J

    def _eval_symbols(self, x: np.ndarray) -> np.ndarray:
        formulas = self._formulas
        return traverse.object_array(traverse.substitute(formulas.expressions, dict(zip(formulas.vars, x))))

    def _own_expressions(self) -> list[Expression]:
        """The expressions, of the variables that this evaluator has."""
        formulas = self._formulas
        return formulas.expressions if self._vars is formulas.vars else list(self._eval_symbols(self._vars))
