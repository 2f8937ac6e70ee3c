"""The coefficients of an expression seen as a polynomial in some of its variables."""

from __future__ import annotations

import operator
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence, Set
from typing import Any, NamedTuple

import numpy as np

from sheldrake.symbolic import _build
from sheldrake.symbolic import _kinds as k
from sheldrake.symbolic._expression import Expression
from sheldrake.symbolic._monomial import Monomial
from sheldrake.symbolic._traverse import expand as multiplied_out
from sheldrake.symbolic._traverse import is_polynomial, variables_of
from sheldrake.symbolic._variable import Variable, Variables

Coefficients = dict[Monomial, Expression]
_ONE = Monomial()
_SMALL = {n: _build.constant(n) for n in range(1, 17)}
age = operator.attrgetter("_id")


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


def degree_of_product(e: Expression) -> int:
    """The degree of a product of powers of variables and of sums `flat_terms` knows: nothing cancels; 0 of others."""
    if e._kind != k.MUL or e._constant == 0.0:
        return 0
    total = 0
    for base, exponent in e._terms.values():
        terms = flat_terms(base) if exponent._kind == k.CONSTANT else None
        n = exponent._args[0]
        if not terms or not 1.0 <= n <= 1e9 or n != int(n):
            return 0
        total += int(n) * max(sum(degree for _, degree in powers) for _, powers in terms)
    return total


def add_to(out: Coefficients, m: Monomial, c: Expression) -> None:
    """Adds a term; one that cancels is taken out."""
    known = out.get(m)
    total = c if known is None else _build.add(known, c)
    if is_zero(total):
        out.pop(m, None)
    else:
        out[m] = total


class _Keys:
    """Monomials of some variables as whole numbers, which add up as monomials are multiplied; of many, themselves.

    Args:
        variables: In the order of their creation.
        numeric: Whether all coefficients are floats, as where each variable is an indeterminate.
    """

    def __init__(self, variables: Sequence[Variable], numeric: bool = False) -> None:
        self._variables, self.numeric = variables, numeric and len(variables) <= _MOST_DIGITS
        self.of: dict[Variable, Any]
        self.one: Any = _ONE
        self.times: Callable[[Any, Any], Any] = Monomial._times
        if len(variables) > _MOST_DIGITS:
            self.of = {v: Monomial._of({v: 1}) for v in variables}
        else:
            self.of = {v: 1 << _BITS * i for i, v in enumerate(variables)}
            self.one, self.times = 0, operator.add

    def power(self, v: Variable, n: int) -> Any:
        """The key of a power of a variable."""
        return self.of[v] * n if self.one == 0 else Monomial._of({v: n})

    def of_monomial(self, m: Monomial) -> Any:
        """The key of a monomial in these variables."""
        return sum([self.of[v] * n for v, n in m._powers.items()]) if self.one == 0 else m

    def monomial(self, key: Any) -> Monomial:
        """The monomial of a key."""
        if key.__class__ is Monomial:
            return key
        variables, powers = self._variables, {}
        while key:  # as `powers`, which takes longer to be asked one by one
            i = ((key & -key).bit_length() - 1) // _BITS
            n = (key >> _BITS * i) & _MASK
            key ^= n << _BITS * i
            powers[variables[i]] = n
        return Monomial._ordered(powers)

    def powers(self, key: int) -> Iterator[tuple[Variable, int]]:
        """The variables that a number stands for, in order, and their exponents."""
        while key:
            i = ((key & -key).bit_length() - 1) // _BITS
            n = (key >> _BITS * i) & _MASK
            key ^= n << _BITS * i
            yield self._variables[i], n

    def sum_of(self, part: _Part) -> Expression:
        """The sum of monomials times numbers."""
        constant, terms = 0.0, {}
        bases = [v._expression or _build.variable(v) for v in self._variables] if self.one == 0 else []
        for key, c in part.items():
            if self.one != 0:
                term = key.ToExpression()
            else:
                factors: _build.Factors = {}
                while key:
                    i = ((key & -key).bit_length() - 1) // _BITS
                    n = (key >> _BITS * i) & _MASK
                    key ^= n << _BITS * i
                    base = bases[i]
                    factors[base._number] = base, _SMALL.get(n) or _build.numbered(_build.constant(n))
                term = _build.make_product(1.0, factors)
            if term is _build.ONE:
                constant = c
            else:
                terms[term._number or _build.number_of(term)] = term, c
        return _build.make_sum(constant, terms)

    def plain(self, coefficients: Coefficients) -> _Part:
        """Coefficients by key; numbers as floats."""
        return {self.of_monomial(m): c._made[0] if c._kind == k.CONSTANT else c for m, c in coefficients.items()}

    def coefficients(self, part: _Part) -> Coefficients:
        """Expressions by monomial."""
        return {self.monomial(m): _build.constant(c) if c.__class__ is float else c for m, c in part.items()}


_Part = dict[Any, Any]  # Coefficients, numbers and expressions, by key.
_BITS = 40  # of an exponent
_MASK, _MOST_DIGITS = (1 << _BITS) - 1, 32


class _Sums:
    """Coefficients that are being added up: no expression is made of a sum before it is whole."""

    def __init__(self) -> None:
        self._numbers: dict[Any, float] = {}
        self._terms: dict[Any, _build.Terms] = {}

    def add(self, m: Any, c: Any, factor: float = 1.0) -> None:
        """Adds factor c m."""
        numbers = self._numbers
        if c.__class__ is float:
            numbers[m] = numbers.get(m, 0.0) + factor * c
            return
        terms = self._terms.get(m)
        if terms is None:
            terms = self._terms[m] = {}
            numbers.setdefault(m, 0.0)
        rest = _build.add_scaled_into(terms, factor, c)
        if rest:
            numbers[m] += rest

    def whole(self) -> _Part:
        """The sums, but those that are the number zero."""
        out: _Part = {}
        for m, number in self._numbers.items():
            terms = self._terms.get(m)
            if terms:
                out[m] = _build.make_sum(number, terms)
            elif number != 0.0:
                out[m] = number
        return out


def _without_zeros(part: _Part) -> _Part:
    return {m: c for m, c in part.items() if c} if 0.0 in part.values() else part


def _product(a: _Part, b: _Part, keys: _Keys) -> _Part:
    if keys.numeric:
        out: _Part = {}
        for m, c in a.items():
            for n, d in b.items():
                key = m + n
                out[key] = out.get(key, 0.0) + c * d
        return _without_zeros(out)
    sums, times = _Sums(), keys.times
    for m, c in a.items():
        for n, d in b.items():
            if c.__class__ is float:
                sums.add(times(m, n), d, c)
            elif d.__class__ is float:
                sums.add(times(m, n), c, d)
            else:
                sums.add(times(m, n), _build.multiply(c, d))
    return sums.whole()


def _keys_of(coefficients: Collection[Coefficients]) -> _Keys:
    found = {v for part in coefficients for m in part for v in m._powers}
    numeric = all([c._kind == k.CONSTANT for part in coefficients for c in part.values()])
    return _Keys(sorted(found, key=age), numeric)


def multiply(a: Coefficients, b: Coefficients) -> Coefficients:
    """The product of two polynomials."""
    keys = _keys_of((a, b))
    return keys.coefficients(_product(keys.plain(a), keys.plain(b), keys))


def substitute(coefficients: Coefficients, places: Mapping[Variable, Coefficients]) -> Coefficients:
    """A polynomial with polynomials in the place of its indeterminates."""
    keys = _keys_of(places.values())
    known: dict[tuple[Variable, int], _Part] = {}

    def power_of(v: Variable, n: int) -> _Part:
        found = known.get((v, n))
        if found is None:
            plain = keys.plain(places[v])
            found = known[v, n] = plain if n == 1 else _product(plain, power_of(v, n - 1), keys)
        return found

    sums = _Sums()
    for m, c in coefficients.items():
        number = c._made[0] if c._kind == k.CONSTANT else 1.0
        part: _Part = {keys.one: number}
        for v, n in m._powers.items():
            part = _product(part, power_of(v, n), keys)
        for key, d in part.items():
            if c._kind == k.CONSTANT:
                sums.add(key, d)
            elif d.__class__ is float:
                sums.add(key, c, d)
            else:
                sums.add(key, _build.multiply(c, d))
    return keys.coefficients(sums.whole())


def power(a: Coefficients, n: int) -> Coefficients:
    """A polynomial to the power n >= 0."""
    keys = _keys_of((a,))
    return keys.coefficients(_power(keys.plain(a), n, keys))


def _power(a: _Part, n: int, keys: _Keys) -> _Part:
    out: _Part | None = None
    while n:
        if n & 1:
            out = a if out is None else _product(out, a, keys)
        n >>= 1
        if n:
            a = _product(a, a, keys)
    return {keys.one: 1.0} if out is None else out


def decompose(e: Expression, indeterminates: Set[Variable]) -> Coefficients:
    """Monomials in the indeterminates and their coefficients, which hold none of them.

    Raises:
        RuntimeError: the expression is no polynomial in the indeterminates.
    """
    keys = _Keys(sorted(variables_of(e) & indeterminates, key=age))
    return keys.coefficients(_build.fold([e], _Decomposition(keys, indeterminates))[0])


class Numbers(NamedTuple):
    """A polynomial whose coefficients are numbers, by whole numbers for its monomials; none is zero."""

    keys: _Keys
    part: _Part

    @classmethod
    def of_expression(cls, e: Expression, indeterminates: Set[Variable]) -> Numbers | None:
        """That of an expression; None where it has other variables, too many, or nan.

        Raises:
            RuntimeError: the expression is no polynomial.
        """
        variables = variables_of(e)
        if not variables <= indeterminates:
            return None
        keys = _Keys(sorted(variables, key=age), True)
        try:
            return cls(keys, _build.fold([e], _Decomposition(keys, indeterminates))[0]) if keys.numeric else None
        except _NotNumeric:
            return None

    @classmethod
    def of(cls, coefficients: Coefficients) -> Numbers | None:
        """That of monomials and their coefficients; None where these are no numbers."""
        if not all([c._kind == k.CONSTANT for c in coefficients.values()]):
            return None
        keys = _keys_of((coefficients,))
        return cls(keys, keys.plain(coefficients)) if keys.numeric else None

    def variables(self) -> list[Variable]:
        """The variables of the monomials."""
        present = 0
        for key in self.part:
            present |= key
        return [v for v, place in self.keys.of.items() if present & (place * _MASK)]

    def _in_common(self, other: Numbers) -> tuple[_Keys, _Part, _Part] | None:
        """Both with the same keys; None where there are too many variables."""
        mine, its = self.keys.of, other.keys.of
        if mine == its:
            return self.keys, self.part, other.part
        keys = _Keys(sorted({**mine, **its}, key=age), True)
        return (keys, self._by(keys), other._by(keys)) if keys.numeric else None

    def _by(self, keys: _Keys) -> _Part:
        return {sum([keys.of[v] * n for v, n in self.keys.powers(key)]): c for key, c in self.part.items()}

    def times(self, other: Numbers) -> Numbers | None:
        """The product; None where there are too many variables."""
        found = self._in_common(other)
        return None if found is None else Numbers(found[0], _product(found[1], found[2], found[0]))

    def plus(self, other: Numbers, sign: float) -> Numbers | None:
        """The sum with the other times +1 or -1; None where there are too many variables."""
        found = self._in_common(other)
        if found is None:
            return None
        out = found[1].copy()
        for key, c in found[2].items():
            out[key] = out.get(key, 0.0) + sign * c
        return Numbers(found[0], _without_zeros(out))

    def slope(self, x: Variable) -> Numbers:
        """The partial derivative."""
        one = self.keys.of.get(x, 0)
        shift = one.bit_length() - 1
        powers = [(key, (key >> shift) & _MASK, c) for key, c in self.part.items()] if one else []
        return Numbers(self.keys, {key - one: n * c for key, n, c in powers if n})

    def coefficients(self) -> Coefficients:
        """Expressions by monomial."""
        return self.keys.coefficients(self.part)

    def expression(self) -> Expression:
        """The sum of all terms."""
        return self.keys.sum_of(self.part)


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
    if not is_polynomial(e):
        return multiplied_out(e)
    variables = variables_of(e)
    keys = _Keys(sorted(variables, key=age), True)
    return keys.sum_of(_build.fold([e], _Decomposition(keys, variables))[0])


class _NotNumeric(Exception):
    """A coefficient is no number although each variable is an indeterminate: nan."""


class _Decomposition:
    """The rule of `decompose`."""

    def __init__(self, keys: _Keys, indeterminates: Set[Variable]) -> None:
        self._keys, self._indeterminates = keys, indeterminates

    def __call__(self, e: Expression, of: Callable[[Expression], _Part]) -> _Part:
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
            if keys.numeric:
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

    def _quotient(self, c: float | Expression, divisor: Expression) -> float | Expression:
        q = _build.divide(_build.expect("divide", c), divisor)
        return q._made[0] if q._kind == k.CONSTANT else q

    def _of_sum(self, e: Expression, of: Callable[[Expression], _Part]) -> _Part:
        places = self._keys.of
        if self._keys.numeric:
            out: _Part = {0: e._constant}
            for t, c in e._terms.values():
                if t._kind == k.VAR:
                    key = places[t._made[0]]
                    out[key] = out.get(key, 0.0) + c
                else:
                    for key, d in of(t).items():
                        out[key] = out.get(key, 0.0) + c * d
            return _without_zeros(out)
        sums = _Sums()
        if e._constant != 0.0:
            sums.add(self._keys.one, e._constant)
        for t, c in e._terms.values():
            if t._kind == k.VAR and t._made[0] in places:
                sums.add(places[t._made[0]], c)
                continue
            for m, d in of(t).items():
                sums.add(m, d, c)
        return sums.whole()

    def _of_product(self, e: Expression, of: Callable[[Expression], _Part]) -> _Part:
        keys = self._keys
        key, others, sums = keys.one, {}, []
        for n, (base, exponent) in e._terms.items():
            p = exponent._made[0] if exponent._kind == k.CONSTANT else -1.0
            if base._kind == k.VAR and base._made[0] in keys.of and p > 0.0 and p == int(p):
                key = keys.times(key, keys.power(base._made[0], int(p)))
            elif keys.numeric or self._holds(base) or self._holds(exponent):
                sums.append(self._of_power(base, exponent, of))
            else:
                others[n] = (base, exponent)
        out = {key: _build.make_product(e._constant, others) if others else e._constant}
        for part in sums:
            out = _product(out, part, keys)
        return out

    def _of_power(self, base: Expression, exponent: Expression, of: Callable[[Expression], _Part]) -> _Part:
        if self._holds(exponent):
            raise RuntimeError(f"Exponent {exponent} includes indeterminates {self._names()}.")
        n = exponent._made[0] if exponent._kind == k.CONSTANT else -1.0
        if n <= 0.0 or not float(n).is_integer():
            raise RuntimeError(
                f"Given the base {base}, the Exponent {exponent} should be a positive integer but it is not the case."
            )
        if base._kind == k.VAR:
            return {self._keys.power(base._made[0], int(n)): 1.0}
        return _power(of(base), int(n), self._keys)


def expanded(c: Coefficients) -> Coefficients:
    """The same with coefficients multiplied out."""
    if all(map(is_linear, c.values())) and not any(map(is_zero, c.values())):
        return dict(c)  # asks no monomial for its hash
    out: Coefficients = {}
    for m, e in c.items():
        new = e if is_linear(e) else e.Expand()
        if not is_zero(new):
            out[m] = new
    return out


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
