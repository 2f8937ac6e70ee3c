"""Partial derivatives of expressions.

Of many expressions in one pass: equal parts are shared, so each part is differentiated once.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from sheldrake.common._overloads import Mismatch
from sheldrake.symbolic import _build, _formula
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

if TYPE_CHECKING:
    from collections.abc import Callable


def differentiate(expressions: Sequence[Expression], x: Variable) -> list[Expression]:
    """Partial derivatives by a variable.

    Raises:
        TypeError: x is no variable.
        RuntimeError: a derivative cannot be written down.
    """
    if not isinstance(x, Variable):
        raise Mismatch(f"Differentiate(): incompatible function arguments; expected a Variable, got {x!r}.")
    done: dict[int, Expression] = {}
    depends: set[int] = set()
    for e in _build.nodes(*expressions):
        if _depends(e, x, depends):
            depends.add(e._serial)
            done[e._serial] = _derivative(e, x, done)
        elif e is NOT_A_NUMBER:
            raise RuntimeError("NaN is detected during differentiation.")
        else:
            done[e._serial] = ZERO
    return [done[e._serial] for e in expressions]


def _depends(e: Expression, x: Variable, depends: set[int]) -> bool:
    if e._kind == k.VAR:
        return e._args[0] is x
    if any(child._serial in depends for child in _build.children(e)):
        return True
    return e._kind == k.IF_THEN_ELSE and x in e._args[0]._variables()


def _derivative(e: Expression, x: Variable, done: dict[int, Expression]) -> Expression:
    kind, args = e._kind, e._args
    if kind == k.VAR:
        return ONE
    if kind == k.ADD:
        return _build.sum_of(_build.scale(c, done[t._serial]) for t, c in args[1])
    if kind == k.MUL:
        return _of_product(e, done)
    if kind == k.IF_THEN_ELSE:
        return _of_conditional(e, x, done)
    if kind == k.UNINTERPRETED:
        raise RuntimeError(f"Uninterpreted-function expression {e} is not differentiable with respect to {x}.")
    if len(args) == 2:
        return _BINARY[kind](*args, *(done[a._serial] for a in args))
    return _UNARY[kind](args[0], done[args[0]._serial])


def _of_product(e: Expression, done: dict[int, Expression]) -> Expression:
    c, factors = e._args
    terms = []
    for i, (base, exponent) in enumerate(factors):
        d = _of_power(base, exponent, done[base._serial], done[exponent._serial])
        if d is ZERO:
            continue
        for j, (b, x) in enumerate(factors):
            if j != i:
                d = multiply(d, power(b, x))
        terms.append(_build.scale(c, d))
    return _build.sum_of(terms)


def _of_power(f: Expression, g: Expression, df: Expression, dg: Expression) -> Expression:
    inner = add(multiply(g, df), multiply(multiply(_log(f), f), dg)) if dg is not ZERO else multiply(g, df)
    return ZERO if inner is ZERO else multiply(power(f, subtract(g, ONE)), inner)


def _log(f: Expression) -> Expression:
    return unary(k.LOG, f)


def _of_conditional(e: Expression, x: Variable, done: dict[int, Expression]) -> Expression:
    condition, then, otherwise = e._args
    d_then, d_otherwise = done[then._serial], done[otherwise._serial]
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
