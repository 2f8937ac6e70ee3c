"""Adding linear, quadratic and general constraints to a program."""

from __future__ import annotations

from typing import Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._kinds import instance_of, text
from sheldrake.common._overloads import Mismatch, dispatch, overload
from sheldrake.solvers import _kinds as kinds
from sheldrake.solvers._functions import cone_constraints as cones
from sheldrake.solvers._functions.bindings import BindingBase, as_kind, bind
from sheldrake.solvers._functions.constraints import (
    BoundingBoxConstraint,
    LinearComplementarityConstraint,
    LinearConstraint,
    LinearEqualityConstraint,
    QuadraticConstraint,
)
from sheldrake.solvers._functions.evaluators import (
    Constraint,
    EvaluatorBase,
    PyFunctionConstraint,
    VisualizationCallback,
)
from sheldrake.solvers._parse import coefficients, formulas
from sheldrake.solvers._parse import constraints as parse
from sheldrake.symbolic import Variable

# Which list a constraint belongs to; the first class that fits.
LISTS: dict[type, str] = {
    BoundingBoxConstraint: "bounding_box_constraints",
    LinearEqualityConstraint: "linear_equality_constraints",
    LinearConstraint: "linear_constraints",
    QuadraticConstraint: "quadratic_constraints",
    cones.LorentzConeConstraint: "lorentz_cone_constraints",
    cones.RotatedLorentzConeConstraint: "rotated_lorentz_cone_constraints",
    cones.ExponentialConeConstraint: "exponential_cone_constraints",
    cones.PositiveSemidefiniteConstraint: "positive_semidefinite_constraints",
    cones.LinearMatrixInequalityConstraint: "linear_matrix_inequality_constraints",
    LinearComplementarityConstraint: "linear_complementarity_constraints",
}


def _bound(value: Any) -> np.ndarray:
    return kinds.vector(np.ravel(value, order="F")) if np.ndim(value) else _refuse()


def _refuse() -> Any:
    raise Mismatch


class ProgramConstraints:
    """Constraints by kind."""

    _lists: dict[str, list[BindingBase]]

    def _store_constraint(self, binding: BindingBase) -> Any:
        self._check_decisions(binding._variables)  # type: ignore[attr-defined]
        kind = next((c for c in LISTS if isinstance(binding._evaluator, c)), Constraint)
        out = as_kind(kind, binding)
        self._lists[LISTS.get(kind, "generic_constraints")].append(out)
        return out

    def AddConstraint(self, *args: Any, **kwargs: Any) -> Any:
        """Adds a constraint and returns its binding.

        Called with a function of a vector, `lb`, `ub` and `vars`; with an expression and two bounds; with a formula or
        an array of them; with a `Constraint` and `vars`; or with a binding.

        Raises:
            RuntimeError: a variable is no decision variable, or the constraint never holds.
        """
        store = ProgramConstraints._store_constraint

        def of_expressions(self: Any, v: Any, lb: Any, ub: Any) -> Any:
            return store(self, parse.constraint(v, lb, ub))

        ways = [
            overload(
                ProgramConstraints._add_constraint_function,
                func=kinds.function,
                lb=kinds.vector,
                ub=kinds.vector,
                vars=kinds.vars,
                description=(text, ""),
            ),
            overload(of_expressions, e=kinds.expression, lb=kinds.number, ub=kinds.number),
            overload(lambda self, f: store(self, formulas.formula_constraint(f)), f=kinds.formula),
            overload(lambda self, c, v: store(self, bind(Constraint, c, v)), constraint=_constraint, vars=kinds.vars),
            overload(lambda self, f: store(self, formulas.formulas_constraint(f)), formulas=kinds.formulas),
            overload(store, binding=_constraint_binding),
            overload(of_expressions, v=kinds.expressions, lb=_bound, ub=_bound),
        ]
        return as_kind(Constraint, dispatch("AddConstraint", ways, self, args, kwargs))

    def _add_constraint_function(
        self, func: Any, lb: np.ndarray, ub: np.ndarray, vars: np.ndarray, description: str
    ) -> Any:
        new = PyFunctionConstraint(len(vars), func, lb, ub, description)
        return self._store_constraint(bind(Constraint, new, vars))

    def AddLinearConstraint(self, *args: Any, **kwargs: Any) -> Any:
        """Adds a linear constraint.

        Called as `(A, lb, ub, vars)` with a matrix or a row; `(e, lb, ub)` with one or an array of expressions; or
        with a formula or an array of them.

        Raises:
            RuntimeError: an expression is not linear, or a variable is no decision variable.
        """
        store = ProgramConstraints._store_constraint

        def linear(self: Any, A: Any, lb: Any, ub: Any, vars: np.ndarray) -> Any:
            if A.shape == (len(vars), 1) and np.size(lb) == 1 and len(vars) > 1:
                A = A.T  # A flat list of coefficients is one row.
            return store(self, bind(LinearConstraint, LinearConstraint(A, lb, ub), vars))

        def of_expressions(self: Any, v: Any, lb: Any, ub: Any) -> Any:
            return store(self, parse.linear_constraint(v, lb, ub))

        ways = [
            overload(linear, A=kinds.matrix, lb=kinds.vector, ub=kinds.vector, vars=kinds.vars),
            overload(linear, a=kinds.row, lb=kinds.number, ub=kinds.number, vars=kinds.vars),
            overload(of_expressions, e=kinds.expression, lb=kinds.number, ub=kinds.number),
            overload(of_expressions, v=kinds.expressions, lb=_bound, ub=_bound),
            overload(lambda self, f: store(self, formulas.formula_constraint(f, True)), f=kinds.formula),
            overload(lambda self, f: store(self, formulas.formulas_constraint(f, True)), formulas=kinds.formulas),
        ]
        return as_kind(LinearConstraint, dispatch("AddLinearConstraint", ways, self, args, kwargs))

    def AddLinearEqualityConstraint(self, *args: Any, **kwargs: Any) -> Any:
        """Adds linear equations.

        Called as `(Aeq, beq, vars)` with a matrix or a row; `(e, b)` with one or an array of expressions; or with a
        formula or an array of them.

        Raises:
            RuntimeError: an expression is not linear, a formula no equation, or a variable no decision variable.
        """
        store = ProgramConstraints._store_constraint

        def equations(self: Any, A: Any, b: Any, vars: np.ndarray) -> Any:
            return store(self, bind(LinearEqualityConstraint, LinearEqualityConstraint(A, np.atleast_1d(b)), vars))

        def of_expressions(self: Any, v: Any, b: Any) -> Any:
            return store(self, parse.equality_constraint(v, b))

        ways = [
            overload(equations, Aeq=kinds.matrix, beq=kinds.vector, vars=kinds.vars),
            overload(equations, a=kinds.row, beq=kinds.number, vars=kinds.vars),
            overload(of_expressions, e=kinds.expression, b=kinds.number),
            overload(lambda self, f: store(self, formulas.formulas_equality([f])), f=kinds.formula),
            overload(lambda self, f: store(self, formulas.formulas_equality(f)), formulas=kinds.formulas),
            overload(of_expressions, v=kinds.expressions, b=_bound),
        ]
        return dispatch("AddLinearEqualityConstraint", ways, self, args, kwargs)

    def AddBoundingBoxConstraint(self, *args: Any, **kwargs: Any) -> Any:
        """Adds bounds of variables; called as `(lb, ub, vars)` with numbers or arrays, one variable or an array."""

        def box(self: Any, lb: np.ndarray, ub: np.ndarray, vars: np.ndarray) -> Any:
            return self._store_constraint(bind(BoundingBoxConstraint, BoundingBoxConstraint(lb, ub), vars))

        def one(self: Any, lb: float, ub: float, v: Variable) -> Any:
            return box(self, np.array([lb]), np.array([ub]), np.array([v], dtype=object))

        def same(self: Any, lb: float, ub: float, vars: np.ndarray) -> Any:
            return box(self, np.full(len(vars), lb), np.full(len(vars), ub), vars)

        ways = [
            overload(box, lb=_bound, ub=_bound, vars=kinds.vars),
            overload(one, lb=kinds.number, ub=kinds.number, var=kinds.variable),
            overload(same, lb=kinds.number, ub=kinds.number, vars=kinds.vars),
        ]
        return dispatch("AddBoundingBoxConstraint", ways, self, args, kwargs)

    def AddQuadraticConstraint(self, *args: Any, **kwargs: Any) -> Any:
        """Adds lb <= 1/2 x' Q x + b' x <= ub.

        Called as `(Q, b, lb, ub, vars, hessian_type=None)` or `(e, lb, ub, hessian_type=None)`.

        Raises:
            RuntimeError: the expression is not quadratic.
        """

        def quadratic(self: Any, Q: Any, b: Any, lb: float, ub: float, vars: np.ndarray, hessian: Any) -> Any:
            return self._store_constraint(bind(QuadraticConstraint, QuadraticConstraint(Q, b, lb, ub, hessian), vars))

        def parsed(self: Any, e: Any, lb: float, ub: float, hessian: Any) -> Any:
            c = coefficients.quadratic(e, "ParseQuadraticConstraint")
            return quadratic(self, c.hessian(), c.b, lb - c.c, ub - c.c, c.vars, hessian)

        hessian = (instance_of(QuadraticConstraint.HessianType), None)
        bounds = {"lb": kinds.number, "ub": kinds.number}
        ways = [
            overload(
                quadratic,
                Q=kinds.matrix,
                b=kinds.vector,
                lb=kinds.number,
                ub=kinds.number,
                vars=kinds.vars,
                hessian_type=hessian,
            ),
            overload(parsed, e=kinds.expression, **bounds, hessian_type=hessian),
        ]
        return dispatch("AddQuadraticConstraint", ways, self, args, kwargs)

    def AddLinearComplementarityConstraint(self, M: Any, q: Any, vars: Any) -> Any:
        """Adds x >= 0, M x + q >= 0, x' (M x + q) = 0."""
        new = LinearComplementarityConstraint._make(M, q)
        return self._store_constraint(bind(LinearComplementarityConstraint, new, kinds.vars(vars)))

    def AddVisualizationCallback(self, *args: Any, **kwargs: Any) -> Any:
        """Adds a function that solvers call with their iterates of some variables; called as `(func, vars)`."""

        def add(self: Any, func: Any, vars: np.ndarray) -> Any:
            self._check_decisions(vars)
            made = bind(VisualizationCallback, VisualizationCallback._make(func, len(vars)), vars)
            self._lists["visualization_callbacks"].append(made)
            return made

        ways = [overload(add, func=kinds.function, vars=kinds.vars)]
        return dispatch("AddVisualizationCallback", ways, self, args, kwargs)

    # Taking out

    @checked
    def RemoveCost(self, cost: BindingBase) -> int:
        """Takes out a cost and returns how many times it was there."""
        return self._remove(cost)

    @checked
    def RemoveConstraint(self, constraint: BindingBase) -> int:
        """Takes out a constraint and returns how many times it was there."""
        return self._remove(constraint)

    @checked
    def RemoveVisualizationCallback(self, callback: BindingBase) -> int:
        """Takes out a callback and returns how many times it was there."""
        return self._remove(callback)

    def _remove(self, binding: BindingBase) -> int:
        removed = 0
        for name, bindings in self._lists.items():
            kept = [b for b in bindings if b != binding]
            removed += len(bindings) - len(kept)
            self._lists[name] = kept
        return removed


def _constraint(value: Any) -> Constraint:
    return instance_of(Constraint)(value)


def _constraint_binding(value: Any) -> BindingBase:
    binding = instance_of(BindingBase)(value)
    if not isinstance(binding.evaluator(), (Constraint, EvaluatorBase)):
        raise Mismatch
    return binding
