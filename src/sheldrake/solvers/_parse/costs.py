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
from sheldrake.symbolic._decompose import quadratic_terms

if TYPE_CHECKING:
    from sheldrake.solvers._functions.bindings import BindingBase
    from sheldrake.symbolic import Variable


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
    terms = quadratic_terms(e)
    if terms is None or not terms[1]:
        return None
    squares = None if terms[0] else _squares(terms[1], terms[2], is_convex)
    if squares is not None:
        return squares
    found = Quadratic.of_terms(*terms)
    if len(found.vars) > _SMALL:
        return None
    if is_convex is None and found.adds_squares:
        is_convex = True
    Q = [0.0] * len(found.vars) ** 2
    for place, value in zip(found.at, found.values):
        Q[place] = value
    return bind_list(QuadraticCost, QuadraticCost._of_numbers(Q, found.b, found.c, is_convex), found.vars)


def _squares(
    products: list[tuple[Variable, Variable, float]], c: float, is_convex: bool | None
) -> BindingBase[QuadraticCost] | None:
    """The cost of squares of few variables times numbers; None of other products, and of many."""
    n = len(products)
    if n > _SMALL or not all([v is w for v, w, _ in products]):
        return None
    products.sort(key=_age_of_square)
    Q = [0.0] * (n * n)
    Q[:: n + 1] = diagonal = [2.0 * value for *_, value in products]
    if is_convex is None and all([value >= 0.0 for value in diagonal]):
        is_convex = True
    vars = [v for v, *_ in products]
    return bind_list(QuadraticCost, QuadraticCost._of_numbers(Q, [0.0] * n, c, is_convex), vars)


def _age_of_square(product: tuple[Variable, Variable, float]) -> int:
    return product[0]._id


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
