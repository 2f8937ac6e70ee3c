"""Costs from expressions: the most special class that fits."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sheldrake.solvers._functions.bindings import bind
from sheldrake.solvers._functions.costs import ExpressionCost, LinearCost, PolynomialCost, QuadraticCost
from sheldrake.solvers._functions.evaluators import Cost
from sheldrake.solvers._functions.norm_costs import L2NormCost
from sheldrake.solvers._parse.coefficients import coefficients, quadratic
from sheldrake.symbolic import DecomposeL2NormExpression, Expression
from sheldrake.symbolic import _kinds as k

if TYPE_CHECKING:
    from sheldrake.solvers._functions.bindings import BindingBase


def cost(e: Expression) -> BindingBase[Cost]:
    """The cost of an expression: linear, quadratic, a norm, or any expression."""
    found = coefficients(e)
    if found is None:
        if e._kind == k.SQRT:
            is_norm, A, b, x = DecomposeL2NormExpression(e)
            if is_norm:
                return bind(L2NormCost, L2NormCost(A, b), x)
    elif found.degree <= 1:
        return bind(LinearCost, LinearCost._of(found.b, found.c), found.vars)
    elif found.degree == 2:
        return bind(QuadraticCost, QuadraticCost._of(found.hessian(), found.b, found.c, None), found.vars)
    new = ExpressionCost(e) if found is None else PolynomialCost(e)
    return bind(Cost, new, new.vars())


def linear_cost(e: Expression) -> BindingBase[LinearCost]:
    """The linear cost of an expression.

    Raises:
        RuntimeError: it is not linear.
    """
    found = coefficients(e)
    if found is None or found.degree > 1:
        raise RuntimeError(f"Expression {e} is non-linear.")
    return bind(LinearCost, LinearCost._of(found.b, found.c), found.vars)


def quadratic_cost(e: Expression, is_convex: bool | None) -> BindingBase[QuadraticCost]:
    """The quadratic cost of an expression.

    Raises:
        RuntimeError: it is not quadratic.
    """
    found = quadratic(e, "ParseQuadraticCost")
    return bind(QuadraticCost, QuadraticCost._of(found.hessian(), found.b, found.c, is_convex), found.vars)


def l2norm_cost(e: Expression, psd_tol: float, coefficient_tol: float) -> BindingBase[L2NormCost]:
    """The cost of an expression that is a length.

    Raises:
        RuntimeError: it is none.
    """
    is_norm, A, b, x = DecomposeL2NormExpression(e, psd_tol, coefficient_tol)
    if not is_norm:
        raise RuntimeError(
            f"Expression {e} is not an L2 norm. ParseL2NormCost only supports expressions that are the square root of "
            "a quadratic."
        )
    return bind(L2NormCost, L2NormCost(A, b), x)
