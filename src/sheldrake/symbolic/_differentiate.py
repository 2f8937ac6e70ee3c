"""Partial derivatives of expressions.

Of many expressions in one pass: equal parts are shared, so each part is differentiated once.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from sheldrake.common._overloads import Mismatch
from sheldrake.symbolic import _build, _formula, _traverse
from sheldrake.symbolic import _kinds as k
from sheldrake.symbolic._build import (
    NOT_A_NUMBER,
    ONE,
    TWO,
    ZERO,
    add,
    divide,
    multiply,
    negate,
    power,
    subtract,
    unary,
)
from sheldrake.symbolic._expression import Expression
from sheldrake.symbolic._variable import Variable


def differentiate(expressions: Sequence[Expression], x: Variable) -> list[Expression]:
    """Partial derivatives by a variable.

    Raises:
        TypeError: x is no variable.
        RuntimeError: a derivative cannot be written down.
    """
    if not isinstance(x, Variable):
        raise Mismatch(f"Differentiate(): incompatible function arguments; expected a Variable, got {x!r}.")
    return _build.fold(expressions, lambda e, of: _derivative(e, x, of))


Derivatives = Callable[[Expression], Expression]


def _derivative(e: Expression, x: Variable, of: Derivatives) -> Expression:
    kind = e._kind
    if kind == k.VAR:
        return ONE if e._made[0] is x else ZERO
    if kind == k.ADD:
        constant, rest = 0.0, []
        for t, c in e._terms.values():
            if t._kind != k.VAR:
                rest.append((c, of(t)))
            elif t._made[0] is x:
                constant += c
        return _build.combination(constant, rest)
    if kind == k.MUL:
        return _of_product(e, x, of)
    args = e._made
    if kind == k.POW:
        of_exponent = ZERO if args[1]._kind == k.CONSTANT else of(args[1])
        return _of_power(args[0], args[1], of(args[0]), of_exponent)
    if kind == k.CONSTANT:
        return ZERO
    if kind == k.NAN:
        raise RuntimeError("NaN is detected during differentiation.")
    if kind == k.IF_THEN_ELSE:
        return _of_conditional(e, x, of)
    if kind == k.UNINTERPRETED:
        if x not in _traverse.variables_of(e):
            return ZERO
        raise RuntimeError(f"Uninterpreted-function expression {e} is not differentiable with respect to {x}.")
    slopes = [of(a) for a in args]
    if all([slope is ZERO for slope in slopes]):
        return ZERO
    return _BINARY[kind](*args, *slopes) if len(args) == 2 else _UNARY[kind](args[0], slopes[0])


def _of_product(e: Expression, x: Variable, of: Derivatives) -> Expression:
    terms = []
    for n, (base, exponent) in e._terms.items():
        slope, slope_of_exponent = of(base), ZERO if exponent._kind == k.CONSTANT else of(exponent)
        if slope is ONE and exponent._kind == k.CONSTANT:
            less = exponent._made[0] - 1.0
            rest = {**e._terms, n: (base, _build.numbered(_build.constant(less)))}
            if less == 0.0:
                del rest[n]
            terms.append(_build.make_product(e._constant * (less + 1.0), rest))
        elif slope is not ZERO or slope_of_exponent is not ZERO:
            d = _of_power(base, exponent, slope, slope_of_exponent)
            for other, (b, p) in e._terms.items():
                if other != n:
                    d = multiply(d, power(b, p))
            terms.append(_build.scale(e._constant, d))
    return terms[0] if len(terms) == 1 else _build.sum_of(terms)


def _of_power(f: Expression, g: Expression, df: Expression, dg: Expression) -> Expression:
    if g._kind == k.CONSTANT:
        n = g._made[0]
        return ZERO if df is ZERO else multiply(power(f, _build.constant(n - 1.0)), _build.scale(n, df))
    inner = add(multiply(g, df), multiply(multiply(_log(f), f), dg)) if dg is not ZERO else multiply(g, df)
    return ZERO if inner is ZERO else multiply(power(f, subtract(g, ONE)), inner)


def _log(f: Expression) -> Expression:
    return unary(k.LOG, f)


def _of_conditional(e: Expression, x: Variable, of: Derivatives) -> Expression:
    if x not in _traverse.variables_of(e):
        return ZERO
    condition, then, otherwise = e._made
    d_then, d_otherwise = of(then), of(otherwise)
    if x not in condition._variables() and condition.get_kind().value > 8:
        return _build.conditional(condition, d_then, d_otherwise)
    if not 3 <= condition.get_kind().value <= 8:
        raise RuntimeError(f"{e} is not differentiable with respect to {x}.")
    edge = _formula.compare("==", *condition._args)
    return _build.conditional(edge, NOT_A_NUMBER, _build.conditional(condition, d_then, d_otherwise))


def _of_absolute(f: Expression, df: Expression) -> Expression:
    at_zero = _build.conditional(_formula.compare("==", f, ZERO), NOT_A_NUMBER, df)
    return _build.conditional(_formula.compare("<", f, ZERO), negate(df), at_zero)


def _of_extreme(sign: str) -> Callable[..., Expression]:
    def rule(f: Expression, g: Expression, df: Expression, dg: Expression) -> Expression:
        tied = _build.conditional(_formula.compare("==", f, g), NOT_A_NUMBER, dg)
        return _build.conditional(_formula.compare(sign, f, g), df, tied)

    return rule


def _of_rounding(f: Expression, df: Expression) -> Expression:
    whole = _formula.compare("==", unary(k.CEIL, f), unary(k.FLOOR, f))
    return _build.conditional(whole, NOT_A_NUMBER, ZERO)


def _of_quotient(f: Expression, g: Expression, df: Expression, dg: Expression) -> Expression:
    return divide(subtract(multiply(df, g), multiply(f, dg)), power(g, TWO))


def _of_atan2(f: Expression, g: Expression, df: Expression, dg: Expression) -> Expression:
    return divide(subtract(multiply(df, g), multiply(f, dg)), add(power(f, TWO), power(g, TWO)))


def _one_minus_square(f: Expression) -> Expression:
    return unary(k.SQRT, subtract(ONE, power(f, TWO)))


_BINARY: dict[int, Any] = {
    k.DIV: _of_quotient,
    k.POW: _of_power,
    k.ATAN2: _of_atan2,
    k.MIN: _of_extreme("<"),
    k.MAX: _of_extreme(">"),
}

_UNARY: dict[int, Any] = {
    k.LOG: lambda f, df: divide(df, f),
    k.ABS: _of_absolute,
    k.EXP: lambda f, df: multiply(unary(k.EXP, f), df),
    k.SQRT: lambda f, df: divide(df, multiply(TWO, unary(k.SQRT, f))),
    k.SIN: lambda f, df: multiply(unary(k.COS, f), df),
    k.COS: lambda f, df: multiply(negate(unary(k.SIN, f)), df),
    k.TAN: lambda f, df: divide(df, power(unary(k.COS, f), TWO)),
    k.ASIN: lambda f, df: divide(df, _one_minus_square(f)),
    k.ACOS: lambda f, df: divide(negate(df), _one_minus_square(f)),
    k.ATAN: lambda f, df: divide(df, add(ONE, power(f, TWO))),
    k.SINH: lambda f, df: multiply(unary(k.COSH, f), df),
    k.COSH: lambda f, df: multiply(unary(k.SINH, f), df),
    k.TANH: lambda f, df: divide(df, power(unary(k.COSH, f), TWO)),
    k.CEIL: _of_rounding,
    k.FLOOR: _of_rounding,
}
