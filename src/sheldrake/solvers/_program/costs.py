"""Adding costs to a program.

One of the parts that `MathematicalProgram` is put together from: expressions are sorted by kind, and bound to
variables.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from sheldrake.common._kinds import flag, instance_of, text
from sheldrake.common._overloads import dispatch, overload
from sheldrake.solvers import _kinds as kinds
from sheldrake.solvers._functions.bindings import BindingBase, as_kind, bind
from sheldrake.solvers._functions.costs import LinearCost, QuadraticCost
from sheldrake.solvers._functions.evaluators import Cost, PyFunctionCost
from sheldrake.solvers._functions.norm_costs import L2NormCost
from sheldrake.solvers._parse import costs as parse
from sheldrake.symbolic import Expression, Variable
from sheldrake.symbolic import _build as build

_LISTS = {QuadraticCost: "quadratic_costs", LinearCost: "linear_costs", L2NormCost: "l2norm_costs"}


def _maybe_flag(value: Any) -> bool | None:
    return None if value is None else flag(value)


class ProgramCosts:
    """Costs by kind."""

    _lists: dict[str, list[BindingBase]]

    def _store_cost(self, binding: BindingBase) -> Any:
        self._check_decisions(binding._variables)  # type: ignore[attr-defined]
        kind = next((c for c in _LISTS if isinstance(binding._evaluator, c)), Cost)
        out = as_kind(kind, binding)
        self._lists[_LISTS.get(kind, "generic_costs")].append(out)
        return out

    def AddCost(self, *args: Any, **kwargs: Any) -> Any:
        """Adds a cost and returns its binding.

        Called with an expression; with a function of a vector and `vars`; with a `Cost` and `vars`; or with a binding.
        An expression becomes a linear, quadratic or length cost if it is one.

        Raises:
            RuntimeError: a variable is no decision variable.
        """
        ways = [
            overload(ProgramCosts._add_cost_function, func=kinds.function, vars=kinds.vars, description=(text, "")),
            overload(ProgramCosts._store_cost, binding=_cost_binding),
            overload(lambda self, e: self._store_cost(parse.cost(e)), e=kinds.expression),
            overload(ProgramCosts._add_evaluator, obj=instance_of(Cost), vars=kinds.vars),
        ]
        return as_kind(Cost, dispatch("AddCost", ways, self, args, kwargs))

    def _add_cost_function(self, func: Any, vars: np.ndarray, description: str) -> Any:
        return self._store_cost(bind(Cost, PyFunctionCost(len(vars), func, description), vars))

    def _add_evaluator(self, cost: Cost, vars: np.ndarray) -> Any:
        return self._store_cost(bind(Cost, cost, vars))

    def AddLinearCost(self, *args: Any, **kwargs: Any) -> Any:
        """Adds a linear cost; called as `(e)`, `(a, b, vars)` or `(a, vars)`.

        Raises:
            RuntimeError: the expression is not linear, or a variable is no decision variable.
        """

        def linear(self: ProgramCosts, a: np.ndarray, b: float, vars: np.ndarray) -> Any:
            return self._store_cost(bind(LinearCost, LinearCost(a, b), vars))

        ways = [
            overload(lambda self, e: self._store_cost(parse.linear_cost(e)), e=kinds.expression),
            overload(linear, a=kinds.vector, b=kinds.number, vars=kinds.vars),
            overload(lambda self, a, vars: linear(self, a, 0.0, vars), a=kinds.vector, vars=kinds.vars),
        ]
        return dispatch("AddLinearCost", ways, self, args, kwargs)

    def AddQuadraticCost(self, *args: Any, **kwargs: Any) -> Any:
        """Adds a cost 1/2 x' Q x + b' x + c.

        Called as `(e, is_convex=None)`, `(Q, b, vars, is_convex=None)` or `(Q, b, c, vars, is_convex=None)`.

        Raises:
            RuntimeError: the expression is not quadratic, or a variable is no decision variable.
        """

        def quadratic(self: ProgramCosts, Q: Any, b: Any, c: float, vars: Any, is_convex: Any) -> Any:
            return self._store_cost(bind(QuadraticCost, QuadraticCost(Q, b, c, is_convex), vars))

        convex = (_maybe_flag, None)
        ways = [
            overload(
                lambda self, e, convex: self._store_cost(parse.quadratic_cost(e, convex)),
                e=kinds.expression,
                is_convex=convex,
            ),
            overload(
                lambda self, Q, b, vars, convex: quadratic(self, Q, b, 0.0, vars, convex),
                Q=kinds.matrix,
                b=kinds.vector,
                vars=kinds.vars,
                is_convex=convex,
            ),
            overload(quadratic, Q=kinds.matrix, b=kinds.vector, c=kinds.number, vars=kinds.vars, is_convex=convex),
        ]
        return dispatch("AddQuadraticCost", ways, self, args, kwargs)

    def AddQuadraticErrorCost(self, *args: Any, **kwargs: Any) -> Any:
        """Adds the cost (x - x_desired)' Q (x - x_desired); called as `(Q or w, x_desired, vars)`."""

        def error(self: ProgramCosts, Q: np.ndarray, x_desired: np.ndarray, vars: np.ndarray) -> Any:
            new = QuadraticCost(2.0 * Q, -2.0 * (Q @ x_desired), float(x_desired @ Q @ x_desired))
            return self._store_cost(bind(QuadraticCost, new, vars))

        def weighted(self: ProgramCosts, w: float, x_desired: np.ndarray, vars: np.ndarray) -> Any:
            return error(self, w * np.eye(x_desired.size), x_desired, vars)

        ways = [
            overload(weighted, w=kinds.number, x_desired=kinds.vector, vars=kinds.vars),
            overload(error, Q=kinds.matrix, x_desired=kinds.vector, vars=kinds.vars),
        ]
        return dispatch("AddQuadraticErrorCost", ways, self, args, kwargs)

    def Add2NormSquaredCost(self, *args: Any, **kwargs: Any) -> Any:
        """Adds the cost |A x - b|^2; called as `(A, b, vars)`."""

        def squared(self: ProgramCosts, A: np.ndarray, b: np.ndarray, vars: np.ndarray) -> Any:
            new = QuadraticCost(2.0 * A.T @ A, -2.0 * A.T @ b, float(b @ b), is_convex=True)
            return self._store_cost(bind(QuadraticCost, new, vars))

        ways = [overload(squared, A=kinds.matrix, b=kinds.vector, vars=kinds.vars)]
        return dispatch("Add2NormSquaredCost", ways, self, args, kwargs)

    def AddL2NormCost(self, *args: Any, **kwargs: Any) -> Any:
        """Adds the cost |A x + b|; called as `(A, b, vars)` or `(e, psd_tol=1e-8, coefficient_tol=1e-8)`.

        Raises:
            RuntimeError: the expression is no length.
        """

        def norm(self: ProgramCosts, A: Any, b: np.ndarray, vars: np.ndarray) -> Any:
            return self._store_cost(bind(L2NormCost, L2NormCost(A, b), vars))

        def parsed(self: ProgramCosts, e: Expression, psd_tol: float, coefficient_tol: float) -> Any:
            return self._store_cost(parse.l2norm_cost(e, psd_tol, coefficient_tol))

        tolerance = (kinds.number, 1e-8)
        ways = [
            overload(norm, A=kinds.matrix, b=kinds.vector, vars=kinds.vars),
            overload(parsed, e=kinds.expression, psd_tol=tolerance, coefficient_tol=tolerance),
        ]
        return dispatch("AddL2NormCost", ways, self, args, kwargs)

    def AddL2NormCostUsingConicConstraint(self, A: Any, b: Any, vars: Any) -> tuple[Variable, Any, Any]:
        """Adds the cost |A x + b| as a slack variable above it.

        Returns:
            The slack variable, its cost, and the Lorentz cone constraint.
        """
        A, b, vars = kinds.matrix(A), kinds.vector(b), kinds.vars(vars)
        slack = self.NewContinuousVariables(1, "slack")  # type: ignore[attr-defined]
        cost = self.AddLinearCost(np.ones(1), 0.0, slack)
        M = np.zeros((A.shape[0] + 1, A.shape[1] + 1))
        M[0, 0], M[1:, 1:] = 1.0, A
        cone = self.AddLorentzConeConstraint(  # type: ignore[attr-defined]
            M, np.concatenate(([0.0], b)), np.concatenate((slack, vars))
        )
        return slack[0], cost, cone

    def AddL1NormCostInEpigraphForm(self, A: Any, b: Any, vars: Any) -> tuple[np.ndarray, Any, Any]:
        """Adds the cost |A x + b|_1 as the sum of slack variables s >= A x + b and s >= -(A x + b).

        Returns:
            The slack variables, their cost, and the linear constraint.
        """
        A, b, vars = kinds.matrix(A), kinds.vector(b), kinds.vars(vars)
        m = b.size
        s = self.NewContinuousVariables(m, "l1_norm_cost_epigraph")  # type: ignore[attr-defined]
        cost = self.AddLinearCost(np.ones(m), 0.0, s)
        M = np.block([[-np.eye(m), A], [-np.eye(m), -A]])
        linear = self.AddLinearConstraint(  # type: ignore[attr-defined]
            M, np.full(2 * m, -np.inf), np.concatenate((-b, b)), np.concatenate((s, vars))
        )
        return s, cost, linear

    def _log_determinant(self, X: Any) -> tuple[np.ndarray, np.ndarray]:
        """t and lower triangular Z with log det X >= sum of t, for the positive semidefinite X.

        With [X, Z'; Z, diag(Z)] positive semidefinite, det X is at least the product of the diagonal of Z; and
        exp(t_i) <= Z_ii (Boyd and Vandenberghe, Convex Optimization, 2004; MOSEK modeling cookbook 6.2.3).
        """
        X = kinds.expressions(X)
        n = X.shape[0]
        Z = np.full((n, n), Expression(0.0), dtype=object)
        entries = self.NewContinuousVariables(n * (n + 1) // 2)  # type: ignore[attr-defined]
        for v, place in zip(entries, [(row, col) for col in range(n) for row in range(col, n)]):
            Z[place] = Expression(v)
        diagonal = np.full((n, n), Expression(0.0), dtype=object)
        for i in range(n):
            diagonal[i, i] = Z[i, i]
        self.AddLinearMatrixInequalityConstraint(  # type: ignore[attr-defined]
            np.block([[X, Z], [Z.T, diagonal]])
        )
        t = self.NewContinuousVariables(n)  # type: ignore[attr-defined]
        for i in range(n):
            row = np.array([Z[i, i], Expression(1.0), Expression(t[i])], dtype=object)
            self.AddExponentialConeConstraint(row)  # type: ignore[attr-defined]
        return t, Z

    def AddMaximizeLogDeterminantCost(self, X: Any, weight: float = 1.0) -> tuple[Any, np.ndarray, np.ndarray]:
        """Adds the cost -weight log det X, with a weight of 0 or more.

        Returns:
            The cost -weight sum(t), the slack variables t, and the lower triangular matrix Z.
        """
        if not weight >= 0.0:
            raise RuntimeError(f"AddMaximizeLogDeterminantCost(): weight must not be negative, not {weight}.")
        t, Z = self._log_determinant(X)
        return self.AddLinearCost(np.full(len(t), -float(weight)), 0.0, t), t, Z

    def AddLogDeterminantLowerBoundConstraint(self, X: Any, lower: float) -> tuple[Any, np.ndarray, np.ndarray]:
        """Adds the constraint log det X >= lower.

        Returns:
            The constraint sum(t) >= lower, the slack variables t, and the lower triangular matrix Z.
        """
        t, Z = self._log_determinant(X)
        row = np.ones((1, len(t)))
        linear = self.AddLinearConstraint(row, [lower], [np.inf], t)  # type: ignore[attr-defined]
        return linear, t, Z

    def AddMaximizeGeometricMeanCost(self, *args: Any, **kwargs: Any) -> Any:
        """Adds the cost -(z_1 ... z_n)^(1/n); called as `(A, b, x)` with z = A x + b, or `(x, c)` with a factor c."""

        def of_affine(self: ProgramCosts, A: np.ndarray, b: np.ndarray, x: np.ndarray) -> Any:
            n = A.shape[0]
            z = [build.sum_of([kinds.expression(a * v) for a, v in zip(r, x)]) + bi for r, bi in zip(A, b)]
            return self._geometric_mean(z, n, 1.0)

        ways = [
            overload(of_affine, A=kinds.matrix, b=kinds.vector, x=kinds.vars),
            overload(
                lambda self, x, c: self._geometric_mean([kinds.expression(v) for v in x], len(x), c),
                x=kinds.vars,
                c=(kinds.number, 1.0),
            ),
        ]
        return dispatch("AddMaximizeGeometricMeanCost", ways, self, args, kwargs)

    def _geometric_mean(self, z: list, n: int, c: float) -> Any:
        """A binary tree of w^2 <= u v, with ones in the place of leaves beyond n (Lobo et al., 1998, section 2.4)."""
        if n < 2 or c <= 0.0:
            raise RuntimeError("AddMaximizeGeometricMeanCost(): needs at least two rows, and a positive factor.")
        layer = z + [Expression(1.0)] * (2 ** int(np.ceil(np.log2(n))) - n)
        while len(layer) > 1:
            above = self.NewContinuousVariables(len(layer) // 2)  # type: ignore[attr-defined]
            for u, v, w in zip(layer[::2], layer[1::2], above):
                row = np.array([u, v, Expression(w)], dtype=object)
                self.AddRotatedLorentzConeConstraint(row)  # type: ignore[attr-defined]
            layer = [Expression(w) for w in above]
        return self.AddLinearCost(-c * np.ones(1), 0.0, above)


def _cost_binding(value: Any) -> BindingBase:
    binding = instance_of(BindingBase)(value)
    instance_of(Cost)(binding.evaluator())
    return binding
