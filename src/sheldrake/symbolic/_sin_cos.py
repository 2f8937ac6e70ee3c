"""Sines and cosines of angles replaced by variables of their own, or by rational functions."""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._enums import IndexEnum
from sheldrake.symbolic import _build, _decompose
from sheldrake.symbolic import _kinds as k
from sheldrake.symbolic._build import MINUS_ONE, ONE, TWO, ZERO, add, divide, multiply, negate, power, subtract, unary
from sheldrake.symbolic._expression import Expression
from sheldrake.symbolic._monomial import Monomial
from sheldrake.symbolic._polynomial import Polynomial
from sheldrake.symbolic._rational import RationalFunction
from sheldrake.symbolic._traverse import object_array, variable_list, variables_of
from sheldrake.symbolic._variable import Variable

Pair = tuple[Expression, Expression]


class SinCosSubstitutionType(IndexEnum):
    """Whether variables stand for sine and cosine of an angle, or of half of it.

    With half an angle, its cosine is written `1 - 2 s^2` (kHalfAnglePreferSin) or `2 c^2 - 1` (kHalfAnglePreferCos).
    """

    kAngle = 0
    kHalfAnglePreferSin = 1
    kHalfAnglePreferCos = 2


class SinCos:
    """Two variables for the sine and the cosine of an angle, or of half of it.

    Args:
        s: Stands for the sine.
        c: Stands for the cosine.
        type: Of which angle.
    """

    @checked
    def __init__(self, s: Variable, c: Variable, type: SinCosSubstitutionType = SinCosSubstitutionType.kAngle):
        self.s = s
        self.c = c
        self.type = type


def substitute(target: Any, subs: dict[Variable, SinCos]) -> np.ndarray | Expression:
    """An expression, or a matrix of them, with variables in the place of sines and cosines.

    Raises:
        RuntimeError: an angle is multiplied by something else than a whole number (or a half, where allowed).
    """
    rule = _Rule(subs)
    if not isinstance(target, (np.ndarray, list, tuple)):
        return _build.fold([_build.expect("Substitute", target)], rule)[0]
    matrix = np.asarray(target, dtype=object)
    matrix = matrix.reshape(-1, 1) if matrix.ndim == 1 else matrix
    expressions = [_build.expect("Substitute", e) for e in matrix.ravel().tolist()]
    return object_array(_build.fold(expressions, rule), matrix.shape)


_TRIGONOMETRIC = (k.SIN, k.COS, k.TAN)


class _Rule:
    """What becomes of an expression, to `fold`; sine and cosine of an angle are made together."""

    def __init__(self, subs: dict[Variable, SinCos]) -> None:
        self._subs = subs
        self._pairs: dict[int, Pair] = {}

    def __call__(self, e: Expression, of: Callable[[Expression], Expression]) -> Expression:
        kind = e._kind
        if kind in _build._LEAVES:
            return e
        if kind in _TRIGONOMETRIC and not variables_of(e._made[0]).isdisjoint(self._subs):
            n = e._made[0]._serial
            pair = self._pairs.get(n)
            if pair is None:
                pair = self._pairs[n] = _of_sum(e, self._subs)
            return pair[0] if kind == k.SIN else pair[1] if kind == k.COS else divide(*pair)
        if kind == k.IF_THEN_ELSE and e._made[0]._variables() & self._subs.keys():
            raise RuntimeError("Substitute(): sines and cosines inside formulas are not supported yet.")
        parts = _build.children(e)
        new = [of(part) for part in parts]
        return e if all(map(operator.is_, parts, new)) else _build.rebuild(e, new)


def _unsupported(node: Expression) -> RuntimeError:
    return RuntimeError(
        f"Got {node}, but we only support sin(c*x) where c is an integer (c = +/- 0.5 is also supported if performing "
        "a half-angle substitution), and x is a variable to be substituted."
    )


def _of_sum(node: Expression, subs: dict[Variable, SinCos]) -> Pair:
    """Sine and cosine of an angle c1 x1 + c2 x2 + ... + rest."""
    out: Pair | None = None
    for v, c in _angles(node, subs):
        if v is None:
            pair = unary(k.SIN, c), unary(k.COS, c)
        else:
            pair = _of_multiple(node, c._made[0], subs[v])
        out = pair if out is None else _rotated(out, pair)
    return (ZERO, ONE) if out is None else out


def _angles(node: Expression, subs: dict[Variable, SinCos]) -> list[tuple[Variable | None, Expression]]:
    """The angles in a sum and the numbers that they are multiplied by, the oldest first; then, for None, the rest."""
    known = _decompose.linear_terms(node._made[0])
    if known is not None and all([v in subs for v, _ in known[0]]):
        terms, rest = known
        out: list[tuple[Variable | None, Expression]] = [
            (v, _build.constant(c)) for v, c in sorted(terms, key=lambda term: term[0]._id)
        ]
        return [*out, (None, _build.constant(rest))] if rest else out
    try:
        found = _decompose.decompose(node._made[0].Expand(), set(subs))
    except RuntimeError:
        raise _unsupported(node) from None
    if any(m.total_degree() > 1 or (m._powers and c._kind != k.CONSTANT) for m, c in found.items()):
        raise _unsupported(node)
    monomials = sorted(found.items(), key=lambda item: item[0]._key(), reverse=True)
    return [(next(iter(m._powers), None), c) for m, c in monomials]


def _rotated(a: Pair, b: Pair) -> Pair:
    """Sine and cosine of a sum of angles."""
    if a[0]._serial == b[0]._serial and a[1]._serial == b[1]._serial:
        return multiply(TWO, multiply(a[0], a[1])), subtract(power(a[1], TWO), power(a[0], TWO))
    s = add(multiply(a[0], b[1]), multiply(a[1], b[0]))
    c = subtract(multiply(a[1], b[1]), multiply(a[0], b[0]))
    return s, c


def _of_multiple(node: Expression, factor: float, pair: SinCos) -> Pair:
    s, c = _build.variable(pair.s), _build.variable(pair.c)
    if pair.type is not SinCosSubstitutionType.kAngle:
        if abs(factor) == 0.5:
            return (s if factor > 0 else negate(s)), c
        if pair.type is SinCosSubstitutionType.kHalfAnglePreferSin:
            whole = subtract(ONE, multiply(TWO, power(s, TWO)))
        else:
            whole = add(MINUS_ONE, multiply(TWO, power(c, TWO)))
        s, c = multiply(TWO, multiply(s, c)), whole
    if not float(factor).is_integer():
        raise _unsupported(node)
    out = (s, c)
    for _ in range(int(abs(factor)) - 1):
        out = _rotated(out, (s, c))
    return (negate(out[0]), out[1]) if factor < 0 else out


def SubstituteStereographicProjection(e: Polynomial, sin_cos: list[SinCos], t: Variable) -> RationalFunction:
    """Returns a polynomial in sines and cosines as a rational function of t = tan(angle / 2).

    Args:
        e: A polynomial whose indeterminates include the variables of `sin_cos`.
        sin_cos: Variables for the sine and cosine of each angle.
        t: A variable for each angle, shape `(n,)`.

    Raises:
        RuntimeError: another number of variables than of angles.
    """
    ts = variable_list("SubstituteStereographicProjection", t)
    if len(ts) != len(sin_cos):
        raise RuntimeError(f"SubstituteStereographicProjection(): {len(sin_cos)} angles but {len(ts)} variables t.")
    degrees = [max([m.degree(p.s) + m.degree(p.c) for m in e._monomials()], default=0) for p in sin_cos]
    one_plus, one_minus, twice = [], [], []
    for v in ts:
        square = Monomial(v, 2)
        one_plus.append(Polynomial({Monomial(): ONE, square: ONE}))
        one_minus.append(Polynomial({Monomial(): ONE, square: MINUS_ONE}))
        twice.append(Polynomial({Monomial(v): TWO}))
    numerator, denominator = Polynomial(), Polynomial(1.0)
    for m, coefficient in e.monomial_to_coefficient_map().items():
        rest = {v: n for v, n in m._powers.items() if all(v is not p.s and v is not p.c for p in sin_cos)}
        term = Polynomial({Monomial(rest): coefficient})
        for i, p in enumerate(sin_cos):
            ns, nc = m.degree(p.s), m.degree(p.c)
            term = term * twice[i] ** ns * one_minus[i] ** nc * one_plus[i] ** (degrees[i] - ns - nc)
        numerator = numerator + term
    for i, degree in enumerate(degrees):
        denominator = denominator * one_plus[i] ** degree
    return RationalFunction(numerator, denominator)
