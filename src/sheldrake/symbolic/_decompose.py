"""The coefficients of an expression seen as a polynomial in some of its variables."""

from __future__ import annotations

from sheldrake.symbolic import _build
from sheldrake.symbolic import _kinds as k
from sheldrake.symbolic._expression import Expression
from sheldrake.symbolic._monomial import Monomial
from sheldrake.symbolic._traverse import is_polynomial, variables_of
from sheldrake.symbolic._variable import Variable, Variables

Coefficients = dict[Monomial, Expression]
_ONE = Monomial()


def is_zero(e: Expression) -> bool:
    """Whether an expression is the number zero."""
    return e._kind == k.CONSTANT and e._args[0] == 0.0


def add_to(out: Coefficients, m: Monomial, c: Expression) -> None:
    """Adds a term; one that cancels is taken out."""
    total = _build.add(out[m], c) if m in out else c
    if is_zero(total):
        out.pop(m, None)
    else:
        out[m] = total


def multiply(a: Coefficients, b: Coefficients) -> Coefficients:
    """The product of two polynomials."""
    out: Coefficients = {}
    for m, c in a.items():
        for n, d in b.items():
            add_to(out, m._times(n), _build.multiply(c, d))
    return out


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
        new = e if is_polynomial(e) and e._kind in (k.CONSTANT, k.VAR) else e.Expand()
        if not is_zero(new):
            out[m] = new
    return out
