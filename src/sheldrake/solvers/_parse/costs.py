"""Costs from expressions: the most special class that fits."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sheldrake.solvers._functions.bindings import bind, bind_list
from sheldrake.solvers._functions.costs import ExpressionCost, LinearCost, PolynomialCost, QuadraticCost
from sheldrake.solvers._functions.evaluators import Cost
from sheldrake.solvers._functions.norm_costs import L2NormCost
from sheldrake.solvers._parse.coefficients import Quadratic, coefficients, quadratic
from sheldrake.symbolic import DecomposeL2NormExpression, Expression
from sheldrake.symbolic import _kinds as k

if TYPE_CHECKING:
    from sheldrake.solvers._functions.bindings import BindingBase


def cost(e: Expression) -> BindingBase[Cost]:
    """The cost of an expression: linear, quadratic, a norm, or any expression."""
    small = _small_quadratic(e, None)
    if small is not None:
        return small
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
    small = _small_quadratic(e, is_convex)
    if small is not None:
        return small
    found = quadratic(e, "ParseQuadraticCost")
    return bind(QuadraticCost, QuadraticCost._of(found.hessian(), found.b, found.c, is_convex), found.vars)


def _small_quadratic(e: Expression, is_convex: bool | None) -> BindingBase[QuadraticCost] | None:
    """The cost of few variables that is expanded as it is; None of others."""
    found = Quadratic.of(e)
    if found is None or not found.at or len(found.vars) > _SMALL:
        return None
    if is_convex is None and found.adds_squares:
        is_convex = True
    Q = [0.0] * len(found.vars) ** 2
    for place, value in zip(found.at, found.values):
        Q[place] = value
    return bind_list(QuadraticCost, QuadraticCost._of_numbers(Q, found.b, found.c, is_convex), found.vars)


_SMALL = 8  # variables up to which lists of numbers take less time than arrays


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
