"""Costs and constraints that are said with new variables and cones.

One of the parts that `MathematicalProgram` is put together from.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any
from typing import overload as typing_overload

import numpy as np

from sheldrake.common._overloads import Ways, overload
from sheldrake.solvers import _kinds as kinds
from sheldrake.solvers._arrays import Matrix
from sheldrake.solvers._functions.bindings import Binding
from sheldrake.solvers._functions.cone_constraints import LorentzConeConstraint
from sheldrake.solvers._functions.constraints import LinearConstraint
from sheldrake.solvers._functions.costs import LinearCost
from sheldrake.solvers._program.cones import ProgramCones
from sheldrake.solvers._program.constraints import ProgramConstraints
from sheldrake.solvers._program.costs import ProgramCosts
from sheldrake.solvers._program.variables import ProgramVariables
from sheldrake.symbolic import Expression, Variable
from sheldrake.symbolic import _build as build

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.solvers._arrays import VariablesLike


class ProgramEpigraphs:
    """Adds costs as slack variables above them, and what is kept small or large by cones.

    Args:
        variables: Where slack variables are made.
        costs: Adds linear costs.
        constraints: Adds linear constraints.
        cones: Adds cones.
    """

    def __init__(
        self, variables: ProgramVariables, costs: ProgramCosts, constraints: ProgramConstraints, cones: ProgramCones
    ) -> None:
        self._variables, self._costs, self._constraints, self._cones = variables, costs, constraints, cones

    def AddL2NormCostUsingConicConstraint(
        self, A: ArrayLike, b: ArrayLike, vars: VariablesLike
    ) -> tuple[Variable, Binding[LinearCost], Binding[LorentzConeConstraint]]:
        """Adds the cost |A x + b| as a slack variable above it.

        Returns:
            The slack variable, its cost, and the Lorentz cone constraint.
        """
        A, b, vars = kinds.matrix(A), kinds.vector(b), kinds.vars(vars)
        slack = self._variables.NewContinuousVariables(1, "slack")
        cost = self._costs.AddLinearCost(np.ones(1), 0.0, slack)
        M = np.zeros((A.shape[0] + 1, A.shape[1] + 1))
        M[0, 0], M[1:, 1:] = 1.0, A
        cone = self._cones.AddLorentzConeConstraint(M, np.concatenate(([0.0], b)), np.concatenate((slack, vars)))
        return slack[0], cost, cone

    def AddL1NormCostInEpigraphForm(
        self, A: ArrayLike, b: ArrayLike, vars: VariablesLike
    ) -> tuple[np.ndarray, Binding[LinearCost], Binding[LinearConstraint]]:
        """Adds the cost |A x + b|_1 as the sum of slack variables s >= A x + b and s >= -(A x + b).

        Returns:
            The slack variables, their cost, and the linear constraint.
        """
        A, b, vars = kinds.matrix(A), kinds.vector(b), kinds.vars(vars)
        m = b.size
        s = self._variables.NewContinuousVariables(m, "l1_norm_cost_epigraph")
        cost = self._costs.AddLinearCost(np.ones(m), 0.0, s)
        M = np.block([[-np.eye(m), A], [-np.eye(m), -A]])
        linear = self._constraints.AddLinearConstraint(
            M, np.full(2 * m, -np.inf), np.concatenate((-b, b)), np.concatenate((s, vars))
        )
        return s, cost, linear

    def _log_determinant(self, X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """t and lower triangular Z with log det X >= sum of t, for the positive semidefinite X.

        With [X, Z'; Z, diag(Z)] positive semidefinite, det X is at least the product of the diagonal of Z; and
        exp(t_i) <= Z_ii (Boyd and Vandenberghe, Convex Optimization, 2004; MOSEK modeling cookbook 6.2.3).
        """
        X = kinds.expressions(X)
        n = X.shape[0]
        Z = np.full((n, n), Expression(0.0), dtype=object)
        entries = self._variables.NewContinuousVariables(n * (n + 1) // 2)
        for v, place in zip(entries, [(row, col) for col in range(n) for row in range(col, n)]):
            Z[place] = Expression(v)
        both = np.full((2 * n, 2 * n), Expression(0.0), dtype=object)
        both[:n, :n], both[:n, n:], both[n:, :n] = X, Z, Z.T
        for i in range(n):
            both[n + i, n + i] = Z[i, i]
        self._cones.AddLinearMatrixInequalityConstraint(both)
        t = self._variables.NewContinuousVariables(n)
        for i in range(n):
            vars = np.array([Z[i, i]._args[0], t[i]], dtype=object)
            self._cones.AddExponentialConeConstraint(_EXPONENTIAL_A, _EXPONENTIAL_B, vars)
        return t, Z

    def AddMaximizeLogDeterminantCost(
        self, X: np.ndarray, weight: float = 1.0
    ) -> tuple[Binding[LinearCost], np.ndarray, np.ndarray]:
        """Adds the cost -weight log det X, with a weight of 0 or more.

        Returns:
            The cost -weight sum(t), the slack variables t, and the lower triangular matrix Z.
        """
        if not weight >= 0.0:
            raise RuntimeError(f"AddMaximizeLogDeterminantCost(): weight must not be negative, not {weight}.")
        t, Z = self._log_determinant(X)
        return self._costs.AddLinearCost(np.full(len(t), -float(weight)), 0.0, t), t, Z

    def AddLogDeterminantLowerBoundConstraint(
        self, X: np.ndarray, lower: float
    ) -> tuple[Binding[LinearConstraint], np.ndarray, np.ndarray]:
        """Adds the constraint log det X >= lower.

        Returns:
            The constraint sum(t) >= lower, the slack variables t, and the lower triangular matrix Z.
        """
        t, Z = self._log_determinant(X)
        row = np.ones((1, len(t)))
        linear = self._constraints.AddLinearConstraint(row, [lower], [np.inf], t)
        return linear, t, Z

    @typing_overload
    def AddMaximizeGeometricMeanCost(
        self, A: ArrayLike | Matrix, b: ArrayLike, x: VariablesLike
    ) -> Binding[LinearCost]: ...
    @typing_overload
    def AddMaximizeGeometricMeanCost(self, x: VariablesLike, c: float = 1.0) -> Binding[LinearCost]: ...
    def AddMaximizeGeometricMeanCost(self, *args: Any, **kwargs: Any) -> Binding[LinearCost]:
        """Adds the cost -(z_1 ... z_n)^(1/n); called as `(A, b, x)` with z = A x + b, or `(x, c)` with a factor c.

        Raises:
            ValueError: A, b and x do not fit each other, there is one row, or the factor is not positive.
        """
        return self._geometric_mean(*_MEAN.choose("AddMaximizeGeometricMeanCost", args, kwargs))

    def _geometric_mean(self, z: list[Expression], n: int, c: float) -> Binding[LinearCost]:
        """A binary tree of w^2 <= u v, with ones in the place of leaves beyond n (Lobo et al., 1998, section 2.4)."""
        if n < 2 or c <= 0.0:
            raise ValueError("AddMaximizeGeometricMeanCost(): needs at least two rows, and a positive factor.")
        layer = z + [Expression(1.0)] * (2 ** int(np.ceil(np.log2(n))) - n)
        while len(layer) > 1:
            above = self._variables.NewContinuousVariables(len(layer) // 2)
            for u, v, w in zip(layer[::2], layer[1::2], above):
                row = np.array([u, v, Expression(w)], dtype=object)
                self._cones.AddRotatedLorentzConeConstraint(row)
            layer = [Expression(w) for w in above]
        return self._costs.AddLinearCost(-c * np.ones(1), 0.0, above)


_EXPONENTIAL_A, _EXPONENTIAL_B = np.array([[1.0, 0.0], [0.0, 0.0], [0.0, 1.0]]), np.array([0.0, 1.0, 0.0])


def _rows_of(A: Matrix, b: np.ndarray, x: np.ndarray) -> tuple[list[Expression], int, float]:
    """Affine expressions, their number, and the factor of the mean.

    Raises:
        ValueError: sizes do not fit.
    """
    if A.shape != (len(b), len(x)):
        raise ValueError(
            f"AddMaximizeGeometricMeanCost(): A has the shape {A.shape}, b {len(b)} elements and x {len(x)}; "
            "the argument A, b and x don't have consistent size."
        )
    z = [build.sum_of([kinds.expression(a * v) for a, v in zip(r, x)]) + bi for r, bi in zip(A, b)]
    return z, A.shape[0], 1.0


def _of_variables(x: np.ndarray, c: float) -> tuple[list[Expression], int, float]:
    return [kinds.expression(v) for v in x], len(x), c


_MEAN = Ways(
    [
        overload(_rows_of, A=kinds.matrix, b=kinds.vector, x=kinds.vars),
        overload(_of_variables, x=kinds.vars, c=(kinds.number, 1.0)),
    ]
)
