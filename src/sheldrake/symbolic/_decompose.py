"""The coefficients of an expression seen as a polynomial in some of its variables."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable, Mapping, Set
from typing import Any

import numpy as np

from sheldrake.symbolic import _build
from sheldrake.symbolic import _kinds as k
from sheldrake.symbolic._expression import Expression
from sheldrake.symbolic._keys import (
    Coefficient,
    Coefficients,
    Keys,
    Part,
    Sums,
    age,
    as_expression,
    keys_in,
    new_keys,
    number_or,
    power,
    product,
    without_zeros,
)
from sheldrake.symbolic._traverse import expand as multiplied_out
from sheldrake.symbolic._traverse import variables_of
from sheldrake.symbolic._variable import Variable, Variables


def is_zero(e: Expression) -> bool:
    """Whether an expression is the number zero."""
    return e._kind == k.CONSTANT and e._args[0] == 0.0


def is_linear(e: Expression) -> bool:
    """Whether an expression is a number, a variable, or a sum of these with coefficients: it is expanded as it is."""
    if e._kind == k.ADD:
        return all([t._kind == k.VAR for t, _ in e._terms.values()])
    if e._kind == k.MUL:
        if len(e._terms) != 1:
            return False
        ((base, exponent),) = e._terms.values()
        return base._kind == k.VAR and exponent is _build.ONE
    return e._kind in (k.CONSTANT, k.VAR)


LinearTerms = tuple[list[tuple[Variable, float]], float]


def linear_terms(e: Expression) -> LinearTerms | None:
    """Variables with their coefficients, and the constant, of an expression that `is_linear`, or of a number times one.

    None for others.
    """
    kind = e._kind
    if kind == k.ADD:
        terms = [(t._made[0], c) for t, c in e._terms.values() if t._kind == k.VAR]
        return (terms, e._constant) if len(terms) == len(e._terms) else None
    if kind == k.VAR:
        return [(e._made[0], 1.0)], 0.0
    if kind == k.CONSTANT:
        return [], e._made[0]
    if kind != k.MUL or len(e._terms) != 1:
        return None
    ((base, exponent),) = e._terms.values()
    if exponent is not _build.ONE:
        return None
    if base._kind == k.VAR:
        return [(base._made[0], e._constant)], 0.0
    found, scale = linear_terms(base), e._constant
    if found is None:
        return None
    terms = [(v, scale * c) for v, c in found[0]]
    return (terms, scale * found[1]) if all([c for _, c in terms]) else None


def affine_sum(parts: Iterable[tuple[float, Coefficient]]) -> tuple[dict[Variable, float], float]:
    """Variables with their coefficients, none of them zero, and the constant of a sum of numbers times coefficients.

    Raises:
        RuntimeError: the sum is not affine.
    """
    total: dict[Variable, float] = {}
    constant = 0.0
    parts = list(parts)
    for factor, c in parts:
        if c.__class__ is float:
            constant += factor * c  # type: ignore[operator]
            continue
        rest = _add_affine(total, factor, c)  # type: ignore[arg-type]
        if rest is None:
            return _expanded_affine_sum(parts)
        constant += rest
    return {v: c for v, c in total.items() if c} if 0.0 in total.values() else total, constant


def _add_affine(total: dict[Variable, float], factor: float, e: Expression) -> float | None:
    """Adds a number times a sum, and sums in it, of variables; returns the constant; None if there is more in it."""
    kind = e._kind
    if kind == k.ADD:
        constant: float = factor * e._constant
        for t, c in e._terms.values():
            if t._kind == k.VAR:
                v = t._made[0]
                total[v] = total.get(v, 0.0) + factor * c
                continue
            rest = _add_affine(total, factor * c, t)
            if rest is None:
                return None
            constant += rest
        return constant
    if kind == k.VAR:
        v = e._made[0]
        total[v] = total.get(v, 0.0) + factor
        return 0.0
    if kind == k.MUL and len(e._terms) == 1:
        ((base, exponent),) = e._terms.values()
        return _add_affine(total, factor * e._constant, base) if exponent is _build.ONE else None
    return factor * e._made[0] if kind == k.CONSTANT else None


def _expanded_affine_sum(parts: list[tuple[float, Coefficient]]) -> tuple[dict[Variable, float], float]:
    """`affine_sum` of what has to be multiplied out as a whole, as parts may cancel."""
    e = expand(_build.combination(0.0, [(factor, as_expression(c)) for factor, c in parts]))
    found = linear_terms(e)
    if found is None:
        raise RuntimeError(f"Expression {e} is non-linear.")
    return dict(found[0]), found[1]


def flat_terms(e: Expression) -> list[tuple[float, list[tuple[Variable, int]]]] | None:
    """The terms of a polynomial that is expanded as it is: numbers and powers of variables; None for others."""
    if e._kind == k.ADD:
        parts: list[tuple[Expression, float]] = [*e._terms.values()]
        if e._constant != 0.0:
            parts.append((_build.ONE, e._constant))
    else:
        parts = [(e, 1.0)]
    out = []
    for term, c in parts:
        kind = term._kind
        if kind == k.VAR:
            out.append((c, [(term._made[0], 1)]))
            continue
        factors: Iterable = ()
        if kind == k.MUL:
            c, factors = c * term._constant, term._terms.values()
        elif kind == k.POW:
            factors = (term._made,)
        elif kind == k.CONSTANT:
            c = c * term._made[0]
        else:
            return None
        powers = []
        for base, exponent in factors:
            n = exponent._made[0] if exponent._kind == k.CONSTANT else 0.5
            if base._kind != k.VAR or not 1.0 <= n <= 1e9 or n != int(n):
                return None
            powers.append((base._made[0], int(n)))
        out.append((c, powers))
    return out


QuadraticTerms = tuple[dict[Variable, float], list[tuple[Variable, Variable, float]], float]


def quadratic_terms(e: Expression) -> QuadraticTerms | None:
    """Coefficients of variables and of products of two, and the constant, of a polynomial expanded as it is.

    Of degree two at most, or a number times such a one; None for others.
    """
    linear: dict[Variable, float] = {}
    products: list[tuple[Variable, Variable, float]] = []
    scale = 1.0
    if e._kind == k.MUL and len(e._terms) == 1:
        ((base, exponent),) = e._terms.values()
        if base._kind == k.ADD and exponent is _build.ONE:
            e, scale = base, e._constant
    is_sum = e._kind == k.ADD
    for term, c in e._terms.values() if is_sum else ((e, 1.0),):
        c *= scale
        kind = term._kind
        if kind == k.VAR:
            linear[term._made[0]] = c
        elif kind == k.POW:
            base, exponent = term._made
            if base._kind != k.VAR or exponent is not _build.TWO:
                return None
            v = base._made[0]
            products.append((v, v, c))
        elif kind == k.MUL and len(term._terms) <= 2:
            factors = []
            for base, exponent in term._terms.values():
                if base._kind != k.VAR or not (exponent is _build.ONE or exponent is _build.TWO):
                    return None
                factors += [base._made[0]] * (1 if exponent is _build.ONE else 2)
            if len(factors) != 2:
                return None
            products.append((factors[0], factors[1], c * term._constant))
        else:
            return None
    return linear, products, scale * e._constant if is_sum else 0.0


NO_POLYNOMIAL, UNCERTAIN = -1, 0


def degree_of(e: Expression) -> int:
    """The degree of a polynomial where nothing of that degree can cancel; `UNCERTAIN`, or `NO_POLYNOMIAL`."""
    return _build.fold([e], _degree_of)[0]


def _degree_of(e: Expression, of: Callable[[Expression], int]) -> int:
    kind = e._kind
    if kind == k.VAR:
        return 1
    if kind == k.CONSTANT:
        return UNCERTAIN
    if kind == k.ADD:
        degrees = [of(term) for term, _ in e._terms.values()]
        most = max(degrees)
        if min(degrees) <= UNCERTAIN:
            return min(degrees)
        return most if degrees.count(most) == 1 or flat_terms(e) is not None else UNCERTAIN
    if kind == k.DIV:
        return of(e._made[0]) if e._made[1]._kind == k.CONSTANT else NO_POLYNOMIAL
    factors: Iterable = e._terms.values() if kind == k.MUL else (e._made,) if kind == k.POW else ()
    degrees = []
    for base, exponent in factors:
        n = exponent._made[0] if exponent._kind == k.CONSTANT else -1.0
        degree = of(base) if n >= 0.0 and n == int(n) else NO_POLYNOMIAL
        if degree == NO_POLYNOMIAL:
            return NO_POLYNOMIAL
        degrees.append(int(n) * degree)
    return NO_POLYNOMIAL if not degrees else sum(degrees) if all(degrees) else UNCERTAIN


def decompose(e: Expression, indeterminates: Set[Variable]) -> Coefficients:
    """Monomials in the indeterminates and their coefficients, which hold none of them.

    Raises:
        RuntimeError: the expression is no polynomial in the indeterminates.
    """
    keys, part = parted(e, indeterminates)
    return keys.coefficients(part)


def parted(e: Expression, indeterminates: Set[Variable]) -> tuple[Keys, Part]:
    """`decompose` with keys for monomials; coefficients are floats where they are numbers.

    Raises:
        RuntimeError: the expression is no polynomial in the indeterminates.
    """
    keys = keys_in(variables_of(e) & indeterminates)
    return keys, _part(e, keys, indeterminates)


def _part(e: Expression, keys: Keys, indeterminates: Set[Variable]) -> Part:
    if keys.narrow and variables_of(e) <= indeterminates:
        with contextlib.suppress(_NotNumeric):
            return _build.fold([e], _Decomposition(keys, indeterminates, True))[0]
    return _build.fold([e], _Decomposition(keys, indeterminates, False))[0]


def expand(e: Expression) -> Expression:
    """Products of sums, and whole powers of them, multiplied out; kept with the expression."""
    if is_linear(e):
        return e
    found = _build.found_of(e)
    expanded: Expression | None = found.get(_EXPANDED)
    if expanded is None and _EXPANDED not in found:
        expanded = _expanded(e)
        found[_EXPANDED] = None if expanded is e else expanded
        _build.found_of(expanded).setdefault(_EXPANDED, None)
    return e if expanded is None else expanded


_EXPANDED = "expanded"  # None: as it is, as an expression that keeps itself would live until cycles are collected


def _expanded(e: Expression) -> Expression:
    if flat_terms(e) is not None:
        return e
    if e._kind == k.ADD and all([is_linear(t) for t, _ in e._terms.values()]):
        return _sum_of_linear(e)
    variables = variables_of(e)
    keys = new_keys(tuple(sorted(variables, key=age)))
    try:
        part = _build.fold([e], _Decomposition(keys, variables, True))[0]
    except (_NotNumeric, RuntimeError):  # it is no polynomial
        return multiplied_out(e)
    return keys.sum_of(part)


def _sum_of_linear(e: Expression) -> Expression:
    """A sum of variables and of sums that are linear, without these."""
    terms: _build.Terms = {}
    constant = e._constant
    for t, c in e._terms.values():
        if t._kind == k.ADD:
            constant += c * t._constant
            for u, d in t._terms.values():
                constant += _build.add_scaled_into(terms, c * d, u)
        else:
            constant += _build.add_scaled_into(terms, c, t)
    return _build.make_sum(constant, terms)


class _NotNumeric(Exception):
    """A coefficient is no number although each variable is an indeterminate: nan."""


class _Decomposition:
    """The rule of `parted`; numeric: each variable is an indeterminate."""

    def __init__(self, keys: Keys, indeterminates: Set[Variable], numeric: bool) -> None:
        self._keys, self._indeterminates, self._numeric = keys, indeterminates, numeric

    def __call__(self, e: Expression, of: Callable[[Expression], Part]) -> Part:
        kind, keys = e._kind, self._keys
        if kind == k.VAR:
            key = keys.of.get(e._made[0])
            return {keys.one: e} if key is None else {key: 1.0}
        if kind == k.ADD:
            return self._of_sum(e, of)
        if kind == k.MUL:
            return self._of_product(e, of)
        if kind == k.CONSTANT:
            return {keys.one: e._made[0]} if e._made[0] != 0.0 else {}
        if not self._holds(e):
            if self._numeric:
                raise _NotNumeric
            return {keys.one: e}
        args = e._made
        if kind == k.POW:
            return self._of_power(args[0], args[1], of)
        if kind == k.DIV:
            if self._holds(args[1]):
                raise RuntimeError(
                    f"In {args[0]} / {args[1]}, the denominator {args[1]} should be free of the indeterminates, "
                    f"{self._names()}."
                )
            return {m: self._quotient(c, args[1]) for m, c in of(args[0]).items()}
        raise RuntimeError(f"The non-polynomial term {e} should be free of the indeterminates {self._names()}.")

    def _holds(self, e: Expression) -> bool:
        return not variables_of(e).isdisjoint(self._indeterminates)

    def _names(self) -> str:
        return str(Variables(self._indeterminates))

    def _quotient(self, c: Coefficient, divisor: Expression) -> Coefficient:
        return number_or(_build.divide(as_expression(c), divisor))

    def _of_sum(self, e: Expression, of: Callable[[Expression], Part]) -> Part:
        places, sums = self._keys.of, Sums()
        if e._constant != 0.0:
            sums.add(self._keys.one, e._constant)
        for t, c in e._terms.values():
            kind = t._kind
            if kind == k.VAR and t._made[0] in places:
                sums.add(places[t._made[0]], c)
                continue
            if kind == k.MUL:
                key, d, powers = self._split(t)
                if not powers:
                    sums.add(key, d, c)
                    continue
            for m, d in of(t).items():
                sums.add(m, d, c)
        return sums.whole()

    def _split(self, e: Expression) -> tuple[Any, Coefficient, list[tuple[Expression, Expression]]]:
        """A product as the key of powers of indeterminates, a coefficient, and powers of all else that holds some."""
        keys, key, others = self._keys, self._keys.one, {}
        powers: list[tuple[Expression, Expression]] = []
        for n, (base, exponent) in e._terms.items():
            is_constant = exponent._kind == k.CONSTANT
            if base._kind == k.VAR and is_constant:
                unit, p = keys.of.get(base._made[0]), exponent._made[0]
                if unit is None:
                    others[n] = (base, exponent)
                elif p > 0.0 and p == int(p):
                    key = keys.times(key, unit if p == 1.0 else keys.power(base._made[0], int(p)))
                else:
                    powers.append((base, exponent))
            elif self._numeric or self._holds(base) or self._holds(exponent):
                powers.append((base, exponent))
            else:
                others[n] = (base, exponent)
        return key, _build.make_product(e._constant, others) if others else e._constant, powers

    def _of_product(self, e: Expression, of: Callable[[Expression], Part]) -> Part:
        key, c, powers = self._split(e)
        out: Part = {key: c}
        for base, exponent in powers:
            out = product(out, self._of_power(base, exponent, of), self._keys, self._numeric)
        return out

    def _of_power(self, base: Expression, exponent: Expression, of: Callable[[Expression], Part]) -> Part:
        if self._holds(exponent):
            raise RuntimeError(f"Exponent {exponent} includes indeterminates {self._names()}.")
        n = exponent._made[0] if exponent._kind == k.CONSTANT else -1.0
        if n <= 0.0 or not float(n).is_integer():
            raise RuntimeError(
                f"Given the base {base}, the Exponent {exponent} should be a positive integer but it is not the case."
            )
        if base._kind == k.VAR:
            return {self._keys.power(base._made[0], int(n)): 1.0}
        return power(of(base), int(n), self._keys, self._numeric)


def expanded(part: Part) -> Part:
    """The same with coefficients multiplied out."""
    out = {key: c if c.__class__ is float or is_linear(c) else number_or(c.Expand()) for key, c in part.items()}
    return without_zeros(out)


def affine_into(row: np.ndarray, e: Expression, places: Mapping[Variable, int]) -> float:
    """Writes the coefficients of an affine expression into a row of zeros, and returns its constant.

    Raises:
        RuntimeError: it is not affine, or has other variables.
    """
    terms, constant = linear_terms(e) or _affine_terms(e)
    for v, c in terms:
        if v not in places:
            raise RuntimeError(f"Expression {e} has the variable {v}, which has no place in the map of indices.")
        row[places[v]] = c
    return constant


def _affine_terms(e: Expression) -> LinearTerms:
    terms, constant = [], 0.0
    try:
        found = decompose(e, variables_of(e))
    except RuntimeError:
        raise RuntimeError(f"Expression {e} is non-linear.") from None
    for m, c in found.items():
        degree = m.total_degree()
        if degree > 1:
            raise RuntimeError(f"Expression {e} is non-linear.")
        if degree == 0:
            constant = c.Evaluate()
            continue
        (v,) = m._powers
        terms.append((v, c.Evaluate()))
    return terms, constant
