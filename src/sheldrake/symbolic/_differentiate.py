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
    MINUS_ONE,
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

Slopes = dict[Variable, Expression]
"""Derivatives by variable; those that are zero are left out."""


def differentiate(expressions: Sequence[Expression], x: Variable) -> list[Expression]:
    """Partial derivatives by a variable.

    Raises:
        TypeError: x is no variable.
        RuntimeError: a derivative cannot be written down.
    """
    if not isinstance(x, Variable):
        raise Mismatch(f"Differentiate(): incompatible function arguments; expected a Variable, got {x!r}.")
    return [row[0] for row in jacobian(expressions, [x])]


def jacobian(expressions: Sequence[Expression], variables: Sequence[Variable]) -> list[list[Expression]]:
    """Partial derivatives of each expression by each variable; kept with the expression.

    Raises:
        RuntimeError: a derivative cannot be written down.
    """
    rows: list[Slopes] = [_build.found_of(e).setdefault(_SLOPES, {}) for e in expressions]
    missing = dict.fromkeys([v for row in rows for v in variables if v not in row])
    if missing:
        of_all = _build.fold(expressions, _Gradient(missing))
        for row, slopes in zip(rows, of_all):
            row.update({v: slopes.get(v, ZERO) for v in missing})
    return [[row[v] for v in variables] for row in rows]


_SLOPES = "slopes"
_NONE: Slopes = {}
Gradients = Callable[[Expression], Slopes]


class _Gradient:
    """The rule of `jacobian`: derivatives by all wanted variables at once, as most parts have few of them.

    Args:
        wanted: The variables.
    """

    def __init__(self, wanted: dict[Variable, None]) -> None:
        self._wanted = wanted

    def __call__(self, e: Expression, of: Gradients) -> Slopes:
        kind = e._kind
        if kind == k.ADD:
            return self._of_sum(e, of)
        if kind == k.MUL:
            return self._of_product(e, of)
        if kind == k.CONSTANT:
            return _NONE
        args = e._made
        if kind == k.VAR:
            return {args[0]: ONE} if args[0] in self._wanted else _NONE
        if kind == k.POW and args[1]._kind == k.CONSTANT:
            return {v: _of_power(args[0], args[1], slope, ZERO) for v, slope in of(args[0]).items()}
        if kind == k.NAN:
            raise RuntimeError("NaN is detected during differentiation.")
        if kind == k.IF_THEN_ELSE:
            return self._of_conditional(e, of)
        if kind == k.UNINTERPRETED:
            for x in self._wanted:
                if x in _traverse.variables_of(e):
                    raise RuntimeError(
                        f"Uninterpreted-function expression {e} is not differentiable with respect to {x}."
                    )
            return _NONE
        if len(args) == 1:
            rule = _UNARY[kind]
            return {v: rule(args[0], slope) for v, slope in of(args[0]).items()}
        df, dg = of(args[0]), of(args[1])
        found = {v: _BINARY[kind](*args, df.get(v, ZERO), dg.get(v, ZERO)) for v in {**df, **dg}}
        return {v: slope for v, slope in found.items() if slope is not ZERO}

    def _of_sum(self, e: Expression, of: Gradients) -> Slopes:
        numbers: dict[Variable, float] = {}
        sums: dict[Variable, _build.Terms] = {}
        wanted, rest = self._wanted, []
        for item in e._terms.values():
            if item[0]._kind != k.VAR:
                rest.append(item)
            elif item[0]._made[0] in wanted:
                numbers[item[0]._made[0]] = item[1]
        for t, c in rest:
            for v, slope in of(t).items():
                terms = sums.get(v)
                if terms is None:
                    terms = sums[v] = {}
                    numbers.setdefault(v, 0.0)
                constant = _build.add_product_into(terms, c, slope)
                if constant:
                    numbers[v] += constant
        return {v: s for v, c in numbers.items() if (s := _build.make_sum(c, sums.get(v, {}))) is not ZERO}

    def _of_product(self, e: Expression, of: Gradients) -> Slopes:
        parts: dict[Variable, list[Expression]] = {}
        for n, (base, exponent) in e._terms.items():
            if exponent._kind == k.CONSTANT:
                if base._kind == k.VAR:
                    if base._made[0] in self._wanted:
                        parts.setdefault(base._made[0], []).append(_without_one(e, n, base, exponent, ONE))
                    continue
                for v, slope in of(base).items():
                    parts.setdefault(v, []).append(_without_one(e, n, base, exponent, slope))
                continue
            of_base, of_exponent = of(base), of(exponent)
            for v in {**of_base, **of_exponent}:
                d = _of_power(base, exponent, of_base.get(v, ZERO), of_exponent.get(v, ZERO))
                parts.setdefault(v, []).append(_times_others(e, n, d))
        return {
            v: slope
            for v, terms in parts.items()
            if (slope := _alone(terms[0]) if len(terms) == 1 else _build.sum_of(terms)) is not ZERO
        }

    def _of_conditional(self, e: Expression, of: Gradients) -> Slopes:
        found = {x: _of_conditional(e, x, of) for x in self._wanted if x in _traverse.variables_of(e)}
        return {v: slope for v, slope in found.items() if slope is not ZERO}


def _alone(e: Expression) -> Expression:
    """A derivative that has one part: the negative of a sum becomes a sum."""
    if e._kind != k.MUL or e._constant != -1.0 or len(e._terms) > 1:
        return e
    ((base, exponent),) = e._terms.values()
    return negate(power(base, exponent))


def _without_one(e: Expression, n: int, base: Expression, exponent: Expression, slope: Expression) -> Expression:
    """The part of the derivative of a product that comes from one factor, whose exponent is a number."""
    if slope is not ONE:
        return _times_others(e, n, _of_power(base, exponent, slope, ZERO))
    less = exponent._made[0] - 1.0
    rest = e._terms.copy()
    if less == 0.0:
        del rest[n]
    else:
        rest[n] = (base, _build.numbered(_build.constant(less)))
    return _build.make_product(e._constant * (less + 1.0), rest)


def _times_others(e: Expression, n: int, d: Expression) -> Expression:
    """A product in which d is in the place of one factor; a quotient stays a factor, as in Drake."""
    factors = e._terms.copy()
    del factors[n]
    if not factors:
        return _build.scale(e._constant, d)
    c = e._constant * _build.multiply_into(factors, d)
    return ZERO if c == 0.0 else _build.make_product(c, factors)


def _of_power(f: Expression, g: Expression, df: Expression, dg: Expression) -> Expression:
    if g._kind == k.CONSTANT:
        n = g._made[0]
        return ZERO if df is ZERO else multiply(power(f, _build.constant(n - 1.0)), _build.scale(n, df))
    inner = add(multiply(g, df), multiply(multiply(_log(f), f), dg)) if dg is not ZERO else multiply(g, df)
    return ZERO if inner is ZERO else multiply(power(f, subtract(g, ONE)), inner)


def _log(f: Expression) -> Expression:
    return unary(k.LOG, f)


def _of_conditional(e: Expression, x: Variable, of: Gradients) -> Expression:
    condition, then, otherwise = e._made
    d_then, d_otherwise = of(then).get(x, ZERO), of(otherwise).get(x, ZERO)
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
    k.SQRT: lambda f, df: multiply(divide(ONE, multiply(TWO, unary(k.SQRT, f))), df),
    k.SIN: lambda f, df: multiply(unary(k.COS, f), df),
    k.COS: lambda f, df: multiply(negate(unary(k.SIN, f)), df),
    k.TAN: lambda f, df: multiply(divide(ONE, power(unary(k.COS, f), TWO)), df),
    k.ASIN: lambda f, df: multiply(divide(ONE, _one_minus_square(f)), df),
    k.ACOS: lambda f, df: multiply(divide(MINUS_ONE, _one_minus_square(f)), df),
    k.ATAN: lambda f, df: multiply(divide(ONE, add(ONE, power(f, TWO))), df),
    k.SINH: lambda f, df: multiply(unary(k.COSH, f), df),
    k.COSH: lambda f, df: multiply(unary(k.SINH, f), df),
    k.TANH: lambda f, df: multiply(divide(ONE, power(unary(k.COSH, f), TWO)), df),
    k.CEIL: _of_rounding,
    k.FLOOR: _of_rounding,
}
