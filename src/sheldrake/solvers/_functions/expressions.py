"""Vectors of expressions as functions of their variables, with their symbolic derivatives."""

from __future__ import annotations

from collections.abc import Hashable, Sequence

import numpy as np

from sheldrake.solvers._functions.evaluators import Many
from sheldrake.symbolic import Expression, Jacobian, Variable
from sheldrake.symbolic import _traverse as traverse
from sheldrake.symbolic._compiled import Compiled, Vectorized, smooth_source


class ExpressionFunction:
    """Expressions as an evaluator: values, and derivatives by differentiating symbols once."""

    _expressions: list[Expression]
    _vars: np.ndarray
    _derivatives: tuple[Compiled, np.ndarray, np.ndarray] | None
    _values: Compiled

    def _set_expressions(self, expressions: Sequence[Expression]) -> None:
        self._expressions = list(expressions)
        found = set().union(*(traverse.variables_of(e) for e in self._expressions)) if self._expressions else set()
        self._vars = traverse.object_array(sorted(found, key=Variable.get_id))
        self._derivatives = None
        self._values = Compiled(self._expressions, self._vars)
        self._set_sizes(len(self._expressions), len(self._vars))  # type: ignore[attr-defined]

    def vars(self) -> np.ndarray:
        """Returns the variables of the expressions, shape `(n,)`."""
        return self._vars.copy()

    def _alike(self) -> Hashable | None:
        return smooth_source(self._expressions, self._vars)

    def _many(self) -> Many:
        found = Vectorized.of(self._expressions, self._vars)
        assert found is not None  # it has something to be alike by
        return found

    def _eval(self, x: np.ndarray) -> np.ndarray:
        return np.array(self._values(x.tolist()), dtype=float)

    def _nonzero_derivatives(self) -> tuple[Compiled, np.ndarray, np.ndarray]:
        """Values and the derivatives that are not zero everywhere, and these derivatives' rows and columns."""
        if self._derivatives is None:
            J = Jacobian(self._expressions, self._vars)
            zero = Expression(0.0)
            places = [(i, j) for i, j in np.ndindex(J.shape) if J[i, j] is not zero]
            rows = np.array([p[0] for p in places], dtype=int)
            cols = np.array([p[1] for p in places], dtype=int)
            self._derivatives = Compiled([*self._expressions, *(J[p] for p in places)], self._vars), rows, cols
        return self._derivatives

    def _eval_with_jacobian(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Values and derivatives together, with the parts that they share."""
        both, rows, cols = self._nonzero_derivatives()
        found = both(x.tolist())
        m = len(self._expressions)
        J = np.zeros((m, len(self._vars)))
        J[rows, cols] = found[m:]
        return np.array(found[:m], dtype=float), J

    def _jacobian(self, x: np.ndarray) -> np.ndarray:
        return self._eval_with_jacobian(x)[1]

    def _eval_symbols(self, x: np.ndarray) -> np.ndarray:
        return traverse.object_array(traverse.substitute(self._expressions, dict(zip(self._vars, x))))
