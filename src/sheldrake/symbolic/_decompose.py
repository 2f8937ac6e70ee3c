"""The coefficients of an expression seen as a polynomial in some of its variables."""

from __future__ import annotations

import numpy as np

from sheldrake.symbolic import _build
from sheldrake.symbolic import _kinds as k
from sheldrake.symbolic._expression import Expression
from sheldrake.symbolic._monomial import Monomial
from sheldrake.symbolic._traverse import variables_of
from sheldrake.symbolic._variable import Variable, Variables

Coefficients = dict[Monomial, Expression]
_ONE = Monomial()


def is_zero(e: Expression) -> bool:
    """Whether an expression is the number zero."""
    return e._kind == k.CONSTANT and e._args[0] == 0.0


def is_linear(e: Expression) -> bool:
    """Whether an expression is a number, a variable, or a sum of these with coefficients: it is expanded as it is."""
    if e._kind == k.ADD:
        return all(t._kind == k.VAR for t, _ in e._args[1])
    if e._kind == k.MUL:
        factors = e._args[1]
        return len(factors) == 1 and factors[0][0]._kind == k.VAR and factors[0][1] is _build.ONE
    return e._kind in (k.CONSTANT, k.VAR)


def linear_terms(e: Expression) -> tuple[list[tuple[Variable, float]], float]:
    """Variables with their coefficients, and the constant, of an expression that `is_linear`."""
    if e._kind == k.ADD:
        return [(t._args[0], c) for t, c in e._args[1]], e._args[0]
    if e._kind == k.MUL:
        return [(e._args[1][0][0]._args[0], e._args[0])], 0.0
    return ([], e._args[0]) if e._kind == k.CONSTANT else ([(e._args[0], 1.0)], 0.0)


def flat_terms(e: Expression) -> list[tuple[float, list[tuple[Variable, int]]]] | None:
    """The terms of a polynomial that is expanded as it is: numbers and powers of variables; None for others."""
    if e._kind == k.ADD:
        parts: list[tuple[Expression, float]] = [*e._args[1]]
        if e._args[0] != 0.0:
            parts.append((_build.ONE, e._args[0]))
    else:
        parts = [(e, 1.0)]
    out = []
    for term, c in parts:
        kind, args = term._kind, term._args
        factors: tuple = ()
        if kind == k.VAR:
            factors = ((term, _build.ONE),)
        elif kind == k.MUL:
            c, factors = c * args[0], args[1]
        elif kind == k.POW:
            factors = (args,)
        elif kind == k.CONSTANT:
            c = c * args[0]
        else:
            return None
        powers = []
        for base, exponent in factors:
            n = exponent._args[0] if exponent._kind == k.CONSTANT else 0.5
            if base._kind != k.VAR or not 1.0 <= n <= 1e9 or n != int(n):
                return None
            powers.append((base._args[0], int(n)))
        out.append((c, powers))
    return out


def degree_of_product(e: Expression) -> int:
    """The degree of a product of powers of variables and of sums `flat_terms` knows: nothing cancels; 0 of others."""
    if e._kind != k.MUL or e._args[0] == 0.0:
        return 0
    total = 0
    for base, exponent in e._args[1]:
        terms = flat_terms(base) if exponent._kind == k.CONSTANT else None
        n = exponent._args[0]
        if not terms or not 1.0 <= n <= 1e9 or n != int(n):
            return 0
        total += int(n) * max(sum(degree for _, degree in powers) for _, powers in terms)
    return total


def add_to(out: Coefficients, m: Monomial, c: Expression) -> None:
    """Adds a term; one that cancels is taken out."""
    total = _build.add(out[m], c) if m in out else c
    if is_zero(total):
        out.pop(m, None)
    else:
        out[m] = total


class Sums:
    """Coefficients that are being added up: no expression is made of a sum before it is whole."""

    def __init__(self) -> None:
        self._parts: dict[Monomial, list] = {}

    def add_product(self, m: Monomial, c: Expression, d: Expression) -> None:
        """Adds c d m."""
        part = self._parts.get(m)
        if part is None:
            part = self._parts[m] = [0.0, {}]
        if c._kind == k.CONSTANT and d._kind == k.CONSTANT:
            part[0] += c._args[0] * d._args[0]
        else:
            part[0] += _build.add_into(part[1], _build.multiply(c, d))

    def coefficients(self) -> Coefficients:
        """The sums, but those that are the number zero."""
        out = {}
        for m, (number, terms) in self._parts.items():
            if terms or number != 0.0:
                out[m] = _build.make_sum(number, terms)
        return out


def multiply(a: Coefficients, b: Coefficients) -> Coefficients:
    """The product of two polynomials."""
    sums = Sums()
    for m, c in a.items():
        for n, d in b.items():
            sums.add_product(m._times(n), c, d)
    return sums.coefficients()


def decompose(e: Expression, indeterminates: set[Variable]) -> Coefficients:
    """Monomials in the indeterminates and their coefficients, which hold none of them.

    Raises:
        RuntimeError: the expression is no polynomial in the indeterminates.
    """
    done: dict[int, Coefficients] = {}
    for node in _build.nodes(e):
        done[node._serial] = _decomposed(node, indeterminates, done)
    return done[e._serial]


def _names(variables: set[Variable]) -> str:
    return str(Variables(sorted(variables, key=Variable.get_id)))


def _decomposed(e: Expression, indeterminates: set[Variable], done: dict[int, Coefficients]) -> Coefficients:
    if not variables_of(e) & indeterminates:
        return {} if is_zero(e) else {_ONE: e}
    kind, args = e._kind, e._args
    if kind == k.VAR:
        return {Monomial(args[0]): _build.ONE}
    out: Coefficients = {}
    if kind == k.ADD:
        if args[0] != 0.0:
            out[_ONE] = _build.constant(args[0])
        for term, c in args[1]:
            for m, d in done[term._serial].items():
                add_to(out, m, _build.scale(c, d))
        return out
    if kind == k.MUL:
        out = {_ONE: _build.constant(args[0])}
        for base, exponent in args[1]:
            out = multiply(out, _power(base, exponent, indeterminates, done))
        return out
    if kind == k.POW:
        return _power(args[0], args[1], indeterminates, done)
    if kind == k.DIV:
        if variables_of(args[1]) & indeterminates:
            raise RuntimeError(
                f"In {args[0]} / {args[1]}, the denominator {args[1]} should be free of the indeterminates, "
                f"{_names(indeterminates)}."
            )
        return {m: _build.divide(c, args[1]) for m, c in done[args[0]._serial].items()}
    raise RuntimeError(f"The non-polynomial term {e} should be free of the indeterminates {_names(indeterminates)}.")


def _power(
    base: Expression, exponent: Expression, indeterminates: set[Variable], done: dict[int, Coefficients]
) -> Coefficients:
    if not (variables_of(base) | variables_of(exponent)) & indeterminates:
        return {_ONE: _build.power(base, exponent)}
    if variables_of(exponent) & indeterminates:
        raise RuntimeError(f"Exponent {exponent} includes indeterminates {_names(indeterminates)}.")
    n = exponent._args[0] if exponent._kind == k.CONSTANT else -1.0
    if n <= 0.0 or not float(n).is_integer():
        raise RuntimeError(
            f"Given the base {base}, the Exponent {exponent} should be a positive integer but it is not the case."
        )
    return power(done[base._serial], int(n))


def power(a: Coefficients, n: int) -> Coefficients:
    """A polynomial to the power n >= 0."""
    out: Coefficients = {_ONE: _build.ONE}
    while n:
        if n & 1:
            out = multiply(out, a)
        n >>= 1
        if n:
            a = multiply(a, a)
    return out


def expanded(c: Coefficients) -> Coefficients:
    """The same with coefficients multiplied out."""
    out: Coefficients = {}
    for m, e in c.items():
        new = e if is_linear(e) else e.Expand()
        if not is_zero(new):
            out[m] = new
    return out


def affine_row(e: Expression, places: dict[Variable, int]) -> tuple[np.ndarray, float]:
    """Coefficients and constant of an affine expression.

    Raises:
        RuntimeError: it is not affine, or has other variables.
    """
    try:
        found = decompose(e, set(variables_of(e)))
    except RuntimeError:
        found = {Monomial({v: 2 for v in places}): e}
    row, constant = np.zeros(len(places)), 0.0
    for m, c in found.items():
        if m.total_degree() > 1:
            raise RuntimeError(f"Expression {e} is non-linear.")
        if m.total_degree() == 0:
            constant = c.Evaluate()
            continue
        (v,) = m._powers
        if v not in places:
            raise RuntimeError(f"Expression {e} has the variable {v}, which has no place in the map of indices.")
        row[places[v]] = c.Evaluate()
    return row, constant
