"""Sums of monomials as dicts: what stands for a monomial, and what is added and multiplied by it."""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable, Iterable, Iterator
from typing import Any

import numpy as np

from sheldrake.symbolic import _build
from sheldrake.symbolic import _kinds as k
from sheldrake.symbolic._expression import Expression
from sheldrake.symbolic._monomial import Monomial
from sheldrake.symbolic._variable import Variable, Variables

Coefficients = dict[Monomial, Expression]
Coefficient = float | Expression
"""A number is a float, never the expression of one."""
Part = dict[Any, Any]
"""Coefficients by key; none is zero."""
Move = Callable[[Part], Part]
age = operator.attrgetter("_id")
_ONE = Monomial()
_SMALL = {n: _build.constant(n) for n in range(1, 17)}
_BITS = 40  # of an exponent
_MASK, _MOST_DIGITS = (1 << _BITS) - 1, 32
_MOST_SHOWN = 4096


class Keys:
    """Monomials of some variables as whole numbers, which add up as monomials are multiplied, and are in their order.

    An exponent is a digit; that of the oldest variable comes first. Made by `keys_of`.

    Attributes:
        variables: In the order of their creation.
        of: The key of each.
        one: The key of the monomial 1.
        times: Key of a product.
        narrow: Keys are whole numbers; those of many variables would be too long, and are monomials.
    """

    of: dict[Variable, Any]
    one: Any = 0
    times: Callable[[Any, Any], Any] = staticmethod(operator.add)
    narrow = True

    def __init__(self, variables: tuple[Variable, ...]) -> None:
        self.variables = variables
        self.of = {v: 1 << _BITS * i for i, v in enumerate(reversed(variables))}
        self._shown: dict[int, Monomial] = {}

    @functools.cached_property
    def set(self) -> Variables:
        """The variables, to be read."""
        return Variables._of(self.variables)

    def power(self, v: Variable, n: int) -> Any:
        """The key of a power of a variable."""
        return self.of[v] * n

    def exponent(self, key: Any, v: Variable) -> int:
        """The exponent of a variable."""
        unit = self.of.get(v)
        return 0 if unit is None else (key >> unit.bit_length() - 1) & _MASK

    def degree(self, key: Any) -> int:
        """The sum of all exponents: that of the digits is the rest that a division by the last of them leaves."""
        return key % _MASK

    def without(self, key: Any, v: Variable, n: int) -> Any:
        """The key where the exponent of a variable, which is n at least, is less by n."""
        return key - self.of[v] * n

    def key(self, m: Monomial) -> Any:
        """The key of a monomial in these variables."""
        of = self.of
        return sum([of[v] * n for v, n in m._powers.items()])

    def monomial(self, key: Any) -> Monomial:
        """The monomial of a key, which is kept: to be read, or copied."""
        found = self._shown.get(key)
        if found is None:
            if len(self._shown) >= _MOST_SHOWN:
                self._shown.clear()
            found = self._shown[key] = Monomial._ordered(dict(self.powers(key)))
        return found

    def powers(self, key: Any) -> Iterator[tuple[Variable, int]]:
        """The variables of a key, in order, and their exponents."""
        variables = self.variables
        while key:
            i = (key.bit_length() - 1) // _BITS
            n = key >> _BITS * i
            key ^= n << _BITS * i
            yield variables[~i], n

    def exponents(self, part: Part) -> np.ndarray:
        """The exponents of all variables, one row a key."""
        n, digit = len(self.variables), _BITS // 8
        words = b"".join([key.to_bytes(n * digit, "big") for key in part])
        return np.frombuffer(words, np.uint8).reshape(len(part), n, digit) @ 256.0 ** np.arange(digit)[::-1]

    def present(self, part: Part) -> list[Variable]:
        """The variables that there are."""
        bits = 0
        for key in part:
            bits |= key
        return [v for v, _ in self.powers(bits)]

    def without_absent(self, part: Part) -> tuple[Keys, Part]:
        """Keys of the variables that there are, and coefficients by these."""
        present = self.present(part)
        if len(present) == len(self.variables):
            return self, part
        keys = keys_in(present)
        return keys, {keys.key(self.monomial(key)): c for key, c in part.items()}

    def in_order(self, part: Part) -> list[Any]:
        """The keys in the order of their monomials."""
        return sorted(part)

    def sum_of(self, part: Part) -> Expression:
        """The sum of monomials times coefficients."""
        constant, terms = 0.0, _build.Terms()
        bases = [v._expression or _build.variable(v) for v in reversed(self.variables)]
        for key, c in part.items():
            if not key:
                constant += c if c.__class__ is float else _build.add_into(terms, c)
                continue
            factors: _build.Factors = {}
            while key:
                i = (key.bit_length() - 1) // _BITS
                n = key >> _BITS * i
                key ^= n << _BITS * i
                base = bases[i]
                factors[base._number] = base, _SMALL.get(n) or _build.numbered(_build.constant(n))
            if c.__class__ is float:
                term = _build.make_product(1.0, factors)
                terms[term._number or _build.number_of(term)] = term, c
            elif c._kind == k.DIV:
                constant += _build.add_into(terms, _build.multiply(c, _build.make_product(1.0, factors)))
            else:
                c = _build.multiply_into(factors, c)
                constant += _build.add_scaled_into(terms, c, _build.make_product(1.0, factors))
        return _build.make_sum(constant, terms)

    def plain(self, coefficients: Coefficients) -> Part:
        """Coefficients by key."""
        key = self.key
        return {key(m): number_or(c) for m, c in coefficients.items()}

    def coefficients(self, part: Part) -> Coefficients:
        """Expressions by monomial: these to be read, or copied."""
        return {self.monomial(key): as_expression(c) for key, c in part.items()}

    def move(self, to: Keys) -> Move | None:
        """What gives coefficients by the keys of more variables; None if they are the same."""
        n = len(self.variables)
        i = list(map(id, to.variables)).index(id(self.variables[0])) if n else 0
        if (n and not all(map(operator.is_, self.variables, to.variables[i : i + n]))) or not to.narrow:
            return lambda part: {to.key(self.monomial(key)): c for key, c in part.items()}
        shift = _BITS * (len(to.variables) - i - n) if n else 0
        return (lambda part: {key << shift: c for key, c in part.items()}) if shift else None


class _ManyKeys(Keys):
    """Those of many variables are monomials."""

    one, times, narrow = _ONE, staticmethod(Monomial._times), False

    def __init__(self, variables: tuple[Variable, ...]) -> None:
        self.variables = variables
        self.of = {v: Monomial._ordered({v: 1}) for v in variables}

    def power(self, v: Variable, n: int) -> Any:
        return Monomial._ordered({v: n})

    def exponent(self, key: Any, v: Variable) -> int:
        return key._powers.get(v, 0)

    def degree(self, key: Any) -> int:
        return key.total_degree()

    def without(self, key: Any, v: Variable, n: int) -> Any:
        return key._with(v, key._powers[v] - n)

    def key(self, m: Monomial) -> Any:
        return m.__copy__()

    def monomial(self, key: Any) -> Monomial:
        return key

    def powers(self, key: Any) -> Iterator[tuple[Variable, int]]:
        return iter(key._powers.items())

    def exponents(self, part: Part) -> np.ndarray:
        return np.array([[m._powers.get(v, 0.0) for v in self.variables] for m in part])

    def present(self, part: Part) -> list[Variable]:
        return list({v: None for key in part for v in key._powers})

    def in_order(self, part: Part) -> list[Any]:
        return sorted(part, key=Monomial._key)

    def sum_of(self, part: Part) -> Expression:
        return _build.sum_of([_build.multiply(as_expression(c), key.ToExpression()) for key, c in part.items()])

    def move(self, to: Keys) -> Move | None:
        return None


def new_keys(variables: tuple[Variable, ...]) -> Keys:
    """The keys of monomials in variables, which are in the order of their creation."""
    return Keys(variables) if len(variables) <= _MOST_DIGITS else _ManyKeys(variables)


keys_of = functools.lru_cache(maxsize=1024)(new_keys)
"""`new_keys`, but the same for the same variables."""

NONE = keys_of(())


def keys_in(variables: Iterable[Variable]) -> Keys:
    """The keys of monomials in variables in any order, none of them twice."""
    return keys_of(tuple(sorted(variables, key=age)))


def keys_for(monomials: Iterable[Monomial]) -> Keys:
    """The keys of some monomials."""
    return keys_in({v for m in monomials for v in m._powers})


@functools.lru_cache(maxsize=1024)
def _union(a: Keys, b: Keys) -> tuple[Keys, Move | None, Move | None]:
    keys = keys_in({**a.of, **b.of})
    return keys, a.move(keys), b.move(keys)


def in_common(a: Keys, p: Part, b: Keys, q: Part) -> tuple[Keys, Part, Part]:
    """Coefficients p by keys a and q by keys b, both by the same keys."""
    if a is b:
        return a, p, q
    keys, move, its_move = _union(a, b)
    return keys, p if move is None else move(p), q if its_move is None else its_move(q)


# Coefficients


def number_or(e: Expression) -> Coefficient:
    """An expression as a coefficient."""
    return e._made[0] if e._kind == k.CONSTANT else e


def as_expression(c: Coefficient) -> Expression:
    """A coefficient as an expression."""
    return _build.constant(c) if c.__class__ is float else c  # type: ignore[arg-type, return-value]


def scaled(factor: float, c: Any) -> Coefficient:
    """A number times a coefficient."""
    return factor * c if c.__class__ is float else number_or(_build.scale(factor, c))


def negated(c: Any) -> Coefficient:
    """Minus a coefficient."""
    return -c if c.__class__ is float else _build.negate(c)


def is_numeric(part: Part) -> bool:
    """Whether all coefficients are numbers."""
    return all([c.__class__ is float for c in part.values()])


def add_to(part: Part, key: Any, c: Any) -> None:
    """Adds a term; one that cancels is taken out."""
    known = part.get(key)
    if known is not None:
        if c.__class__ is float and known.__class__ is float:
            c = known + c
        else:
            c = number_or(_build.add(as_expression(known), as_expression(c)))
    if c.__class__ is float and c == 0.0:
        part.pop(key, None)
    else:
        part[key] = c


def added(a: Part, b: Part, sign: float, numeric: bool) -> Part:
    """The sum with another times +1 or -1; numeric: all coefficients are numbers."""
    out = a.copy()
    if numeric:
        for key, c in b.items():
            out[key] = out.get(key, 0.0) + sign * c
        return without_zeros(out) if 0.0 in out.values() else out
    for key, c in b.items():
        add_to(out, key, c if sign > 0.0 else negated(c))
    return out


class Sums:
    """Coefficients that are being added up: no expression is made of a sum before it is whole."""

    def __init__(self) -> None:
        self._numbers: dict[Any, float] = {}
        self._terms: dict[Any, _build.Terms] = {}

    def add(self, m: Any, c: Any, factor: float = 1.0, into: Any = _build.add_scaled_into) -> None:
        """Adds factor c m."""
        numbers = self._numbers
        if c.__class__ is float:
            numbers[m] = numbers.get(m, 0.0) + factor * c
            return
        terms = self._terms.get(m)
        if terms is None:
            terms = self._terms[m] = {}
            numbers.setdefault(m, 0.0)
        rest = into(terms, factor, c)
        if rest:
            numbers[m] += rest

    def add_product(self, m: Any, c: Any, d: Any) -> None:
        """Adds c d m, where minus a sum is a sum."""
        if c.__class__ is float:
            self.add(m, d, c, _build.add_product_into)
        elif d.__class__ is float:
            self.add(m, c, d, _build.add_product_into)
        else:
            self.add(m, _build.multiply(c, d))

    def whole(self) -> Part:
        """The sums, but those that are the number zero."""
        out: Part = {}
        for m, number in self._numbers.items():
            terms = self._terms.get(m)
            c = number_or(_build.make_sum(number, terms)) if terms else number
            if c.__class__ is not float or c != 0.0:
                out[m] = c
        return out


def without_zeros(part: Part) -> Part:
    """Coefficients but those that are the number zero."""
    return {m: c for m, c in part.items() if c.__class__ is not float or c}


def product(a: Part, b: Part, keys: Keys, numeric: bool) -> Part:
    """The product of two sums; numeric: all coefficients are numbers."""
    if len(a) == 1:
        a, b = b, a
    if len(b) == 1:
        ((n, d),) = b.items()
        if d.__class__ is float and d == 1.0:
            return {keys.times(m, n): c for m, c in a.items()}
    if numeric and keys.narrow:
        out: Part = {}
        for m, c in a.items():
            for n, d in b.items():
                key = m + n
                out[key] = out.get(key, 0.0) + c * d
        return without_zeros(out) if 0.0 in out.values() else out
    sums, times = Sums(), keys.times
    for m, c in a.items():
        for n, d in b.items():
            sums.add_product(times(m, n), c, d)
    return sums.whole()


def power(a: Part, n: int, keys: Keys, numeric: bool) -> Part:
    """A sum to the power n >= 0."""
    out: Part | None = None
    while n:
        if n & 1:
            out = a if out is None else product(out, a, keys, numeric)
        n >>= 1
        if n:
            a = product(a, a, keys, numeric)
    return {keys.one: 1.0} if out is None else out
