"""Polynomials in several indeterminates whose coefficients are expressions in other variables."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Set
from typing import TYPE_CHECKING, Any
from typing import overload as typing_overload

import numpy as np

from sheldrake.common import _ieee as ieee
from sheldrake.common._checked import checked
from sheldrake.common._kinds import anything, instance_of
from sheldrake.common._overloads import expect, overload, overloaded
from sheldrake.symbolic import _build, _decompose, _formula, _functions
from sheldrake.symbolic._arguments import by_variable, expression, variable, variables
from sheldrake.symbolic._expression import Expression
from sheldrake.symbolic._keys import (
    NONE,
    Coefficient,
    Keys,
    Part,
    Sums,
    add_to,
    added,
    as_expression,
    in_common,
    is_numeric,
    keys_for,
    keys_in,
    keys_of,
    negated,
    number_or,
    power,
    product,
    scaled,
    without_zeros,
)
from sheldrake.symbolic._monomial import Monomial
from sheldrake.symbolic._substitute_and_expand import SubstituteAndExpandCacheData, substituted
from sheldrake.symbolic._traverse import (
    evaluate_nodes,
    numbers_by_variable,
    object_array,
    substitute,
    variable_list,
    variables_of,
)
from sheldrake.symbolic._variable import Variable, Variables

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.common._types import Symbolic, Symbolics
    from sheldrake.symbolic._formula import Formula


_ONE = Monomial()
_NOBODY: frozenset[Variable] = frozenset()
_LARGEST_EXPONENT = 2**31 - 1  # as in Drake; a power of many terms takes for ever long before


class Polynomial:
    """A sum of monomials in the *indeterminates*, with coefficients in other variables, the *decision variables*.

    Args:
        e: An expression, a variable, a number or a monomial; or a dict of Monomial to coefficient.
        indeterminates: Which variables of an expression are indeterminates; all if absent.

    Raises:
        RuntimeError: the expression is no polynomial in the indeterminates.
    """

    __slots__ = ("_decided", "_is_loose", "_keys", "_known_numeric", "_part")
    __array_priority__ = -1.0  # more than NumPy's scalars have, which then leave operators to us, and less than arrays
    _decided: frozenset[Variable] | None  # the decision variables; None: those of the coefficients
    _is_loose: bool  # variables of the keys that no term has are no indeterminates; else all of them are
    _keys: Keys
    _known_numeric: bool | None
    _part: Part  # its terms, by the keys; never changed, only replaced

    @overloaded(
        overload(lambda self: self._set(NONE, {})),
        overload(lambda self, map: self._set_map(map), map=by_variable),
        overload(lambda self, m: self._set_map({m: 1.0}), m=instance_of(Monomial)),
        overload(e=expression, indeterminates=(variables, None)),
    )
    def __init__(self, e: Expression, indeterminates: Variables | None):
        found = variables_of(e)
        chosen = found if indeterminates is None else frozenset(indeterminates)
        keys, part = _decompose.parted(e, chosen)
        self._set(keys, part if found <= chosen else _decompose.expanded(part), decided=found - chosen)
        self._take_indeterminates(chosen)

    def _set(
        self,
        keys: Keys,
        part: Part,
        numeric: bool | None = None,
        loose: bool = False,
        decided: frozenset[Variable] | None = None,
    ) -> None:
        """numeric: whether all coefficients are numbers, if that is known."""
        self._keys, self._part, self._known_numeric = keys, part, numeric
        self._is_loose, self._decided = loose, decided

    def _set_map(self, map: Mapping[Monomial, Any]) -> None:
        for m in map:
            expect("Polynomial", m, Monomial)
        keys = keys_for(map)
        plain = keys.plain({m: _build.expect("Polynomial", c) for m, c in map.items()})
        self._set(keys, without_zeros(plain))

    @classmethod
    def _of(
        cls,
        keys: Keys,
        part: Part,
        numeric: bool | None = None,
        loose: bool = False,
        decided: frozenset[Variable] | None = None,
    ) -> Polynomial:
        """That of terms by keys; see `_set`."""
        out = object.__new__(cls)
        out._keys, out._part, out._known_numeric = keys, part, numeric
        out._is_loose, out._decided = loose, decided
        return out

    def _take_indeterminates(self, chosen: Set[Variable]) -> None:
        """Adds indeterminates that no term has."""
        if len(chosen) > len(self._keys.variables):
            self._keys, _, self._part = in_common(keys_in(chosen), {}, self._keys, self._part)

    def _by_indeterminates(self) -> tuple[Keys, Part]:
        """Its terms by the keys of its indeterminates alone."""
        if self._is_loose:
            self._keys, self._part = self._keys.without_absent(self._part)
            self._is_loose = False
        return self._keys, self._part

    def _is_numeric(self) -> bool:
        """Whether all coefficients are numbers."""
        found = self._known_numeric
        if found is None:
            self._known_numeric = found = is_numeric(self._part)
        return found

    # Parts

    @property
    def _indeterminates(self) -> Variables:
        return self._by_indeterminates()[0].set

    @property
    def _decisions(self) -> frozenset[Variable]:
        if self._decided is None:
            coefficients = [c for c in self._part.values() if c.__class__ is not float]
            self._decided = frozenset().union(*map(variables_of, coefficients))
        return self._decided

    def indeterminates(self) -> Variables:
        """Returns the variables of the monomials, also those that cancelled in sums and products."""
        return self._indeterminates.__copy__()

    def decision_variables(self) -> Variables:
        """Returns the variables of the coefficients, also those that cancelled in sums and products."""
        return Variables._of(self._decisions)

    @checked
    def SetIndeterminates(self, new_indeterminates: Variables) -> None:
        """Makes other variables the indeterminates.

        Raises:
            RuntimeError: it is no polynomial in those.
        """
        if new_indeterminates.IsSupersetOf(self._indeterminates) and self._decisions.isdisjoint(new_indeterminates):
            self._take_indeterminates(frozenset(new_indeterminates))
            return
        new = Polynomial(self.ToExpression(), new_indeterminates)
        self._set(new._keys, new._part, decided=new._decided)

    def monomial_to_coefficient_map(self) -> dict[Monomial, Expression]:
        """Returns the coefficients by monomial, in the order of monomials."""
        keys, part = self._keys, self._part
        return {keys.monomial(key).__copy__(): as_expression(part[key]) for key in keys.in_order(part)}

    def _monomials(self) -> list[Monomial]:
        """Its monomials, to be read."""
        return list(map(self._keys.monomial, self._part))

    @checked
    def Degree(self, v: Variable) -> int:
        """Returns the highest exponent of an indeterminate."""
        return max([self._keys.exponent(key, v) for key in self._part], default=0)

    def TotalDegree(self) -> int:
        """Returns the highest total degree of its monomials."""
        return max(map(self._keys.degree, self._part), default=0)

    def IsEven(self) -> bool:
        """Tells whether all monomials have an even total degree."""
        return all([n % 2 == 0 for n in map(self._keys.degree, self._part)])

    def IsOdd(self) -> bool:
        """Tells whether all monomials have an odd total degree."""
        return all([n % 2 == 1 for n in map(self._keys.degree, self._part)])

    def ToExpression(self) -> Expression:
        """Returns it as an expression."""
        return self._keys.sum_of(self._part)

    # Values

    @checked
    def Evaluate(self, env: dict[Variable, float]) -> float:
        """Returns the value for given values of all variables.

        Raises:
            RuntimeError: a variable has no value.
        """
        values = numbers_by_variable("Evaluate", env)
        total, keys, part = 0.0, self._keys, self._part
        for key in keys.in_order(part):
            c = part[key]
            value = c if c.__class__ is float else evaluate_nodes([c], values)[0]
            total += value * keys.monomial(key)._value(values)
        return total

    @overloaded(
        overload(env=by_variable),
        overload(
            lambda self, v, c: self._partial(numbers_by_variable("EvaluatePartial", {v: c})), var=variable, c=anything
        ),
    )
    def EvaluatePartial(self, env: Mapping[Variable, float] | None) -> Polynomial:
        """Returns it with values in the place of some variables; called with a dict, or with a variable and a value."""
        return self._partial(numbers_by_variable("EvaluatePartial", env))

    def _partial(self, env: Mapping[Variable, float]) -> Polynomial:
        """`EvaluatePartial` of values already checked."""
        keys, out = self._keys, dict[Any, Any]()
        given = [(v, x) for v, x in env.items() if v in keys.of]
        for key, c in self._part.items():
            value = 1.0
            for v, x in given:
                n = keys.exponent(key, v)
                if n:
                    value *= ieee.power(x, n)
                    key = keys.without(key, v, n)
            add_to(out, key, scaled(value, c if c.__class__ is float else number_or(substitute([c], env)[0])))
        return Polynomial._of(keys, out, self._known_numeric or None, loose=True)

    def EvaluateIndeterminates(self, indeterminates: Symbolics, indeterminates_values: ArrayLike) -> np.ndarray:
        """Returns the values for many values of the indeterminates, shape `(n,)`.

        Args:
            indeterminates: Shape `(k,)`.
            indeterminates_values: Values as columns, shape `(k, n)`.

        Raises:
            RuntimeError: a coefficient is no number.
        """
        for c in self._part.values():
            if c.__class__ is not float:
                raise RuntimeError(f"Polynomial::EvaluateIndeterminates: the coefficient {c} is not a constant")
        return np.array([*self._part.values()]) @ self._weights(indeterminates, indeterminates_values)

    def EvaluateWithAffineCoefficients(
        self, indeterminates: Symbolics, indeterminates_values: ArrayLike
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Returns A, v, b such that the values are `A @ v + b`, v being the decision variables.

        Args:
            indeterminates: Shape `(k,)`.
            indeterminates_values: Values as columns, shape `(k, n)`.

        Raises:
            RuntimeError: a coefficient is not affine.
        """
        decisions = list(self.decision_variables())
        rows, constants = np.zeros((len(self._part), len(decisions))), np.zeros(len(self._part))
        places = {v: i for i, v in enumerate(decisions)}
        for i, c in enumerate(self._part.values()):
            constants[i] = c if c.__class__ is float else _decompose.affine_into(rows[i], c, places)
        weights = self._weights(indeterminates, indeterminates_values)
        return weights.T @ rows, object_array(decisions), constants @ weights

    def _weights(self, indeterminates: Symbolics, indeterminates_values: ArrayLike) -> np.ndarray:
        """Values of the monomials, one row each, for values of the indeterminates as columns."""
        values = np.atleast_2d(np.asarray(indeterminates_values, dtype=float))
        rows = dict(zip(variable_list("Evaluate", indeterminates), values))
        exponents = self._keys.exponents(self._part)
        for v, column in zip(self._keys.variables, exponents.T):
            if v not in rows and column.any():
                raise ValueError(f"Polynomial.Evaluate(): {v} is not present in the indeterminates")
        nothing = np.ones(values.shape[1])
        known = np.array([rows.get(v, nothing) for v in self._keys.variables]).reshape(-1, values.shape[1])
        return np.multiply.reduce(known ** exponents[:, :, None], axis=1)

    def Roots(self) -> np.ndarray:
        """Returns the complex roots of a polynomial in one indeterminate with numbers as coefficients.

        Raises:
            RuntimeError: it is not of that kind.
        """
        if len(self._indeterminates) != 1:
            raise RuntimeError(f"{self} is not a univariate polynomial; it has indeterminates {self._indeterminates}.")
        keys, n = self._keys, self.TotalDegree()
        coefficients = [0.0] * (n + 1)
        for key, c in self._part.items():
            if c.__class__ is not float:
                raise RuntimeError(
                    "Polynomial::Roots() only supports polynomials with constant coefficients. This polynomial has "
                    f"coefficient {c} for the monomial {keys.monomial(key)}."
                )
            coefficients[n - keys.degree(key)] = c
        return np.array(sorted(_roots(coefficients), key=_largest_first), complex)

    # Calculus and substitution

    @checked
    def Differentiate(self, x: Variable) -> Polynomial:
        """Returns the partial derivative by any of its variables."""
        keys, out = self._keys, dict[Any, Any]()
        numeric, unit = self._is_numeric(), keys.of.get(x)
        for key, c in self._part.items():
            n = 0 if unit is None else keys.exponent(key, x)
            if n:
                add_to(out, keys.without(key, x, 1), scaled(n, c))
            elif not numeric and c.__class__ is not float and x in self._decisions:
                add_to(out, key, number_or(c.Differentiate(x)))
        return Polynomial._of(keys, out, numeric or None, loose=True)

    def Jacobian(self, vars: Symbolics) -> np.ndarray:
        """Returns the partial derivatives by each of the variables, shape `(n,)`."""
        return object_array([self.Differentiate(v) for v in variable_list("Jacobian", vars)])

    @checked
    def Integrate(self, x: Variable, a: float | None = None, b: float | None = None) -> Polynomial:
        """Returns the integral over an indeterminate: that which is zero at zero, or that from a to b.

        Raises:
            RuntimeError: x is a decision variable.
        """
        if x in self._decisions:
            raise RuntimeError(
                f"{x} is a decision variable of polynomial {self}. Integration with respect to decision variables is "
                "not supported yet."
            )
        keys, part, _ = in_common(self._keys, self._part, keys_of((x,)), {})
        if a is None or b is None:
            unit = keys.of[x]
            out = {keys.times(key, unit): scaled(1.0 / (keys.exponent(key, x) + 1), c) for key, c in part.items()}
            return Polynomial._of(keys, _decompose.expanded(out), self._known_numeric, loose=True)
        (start, end), out = (numbers_by_variable("Integrate", {x: t})[x] for t in (a, b)), {}
        for key, c in part.items():
            n = keys.exponent(key, x) + 1
            rest, c = keys.without(key, x, n - 1), scaled(1.0 / n, c)
            add_to(out, rest, scaled(ieee.power(end, n), c))
            add_to(out, rest, scaled(-ieee.power(start, n), c))
        return Polynomial._of(keys, _decompose.expanded(out), self._known_numeric, loose=True)

    def Expand(self) -> Polynomial:
        """Returns it with coefficients multiplied out, and those that vanish gone."""
        return Polynomial._of(self._keys, _decompose.expanded(self._part), loose=True)

    def SubstituteAndExpand(
        self,
        indeterminate_substitution: dict[Variable, Polynomial],
        substitutions_cached_data: SubstituteAndExpandCacheData | None = None,
    ) -> Polynomial:
        """Returns it with polynomials in the place of its indeterminates, multiplied out.

        Args:
            indeterminate_substitution: A polynomial for each indeterminate.
            substitutions_cached_data: Keeps what monomials become, for further calls with the same substitution.

        Raises:
            RuntimeError: an indeterminate has no polynomial.
        """
        for v in self._indeterminates:
            if v not in indeterminate_substitution:
                raise RuntimeError(f"Polynomial.SubstituteAndExpand(): the indeterminate {v} has no substitution.")
        coefficients, monomials = self._part.values(), self._monomials()
        if substitutions_cached_data is None:
            places = {v: indeterminate_substitution[v] for v in self._indeterminates}
            keys, parts = _by_common_keys(places.values())
            numeric = all([p._is_numeric() for p in places.values()])
            found = _substituted(zip(monomials, coefficients), dict(zip(places, parts)), keys, numeric)
            return Polynomial._of(keys, _decompose.expanded(found), loose=True)
        cache = substitutions_cached_data._data
        cache.setdefault(_ONE, Polynomial._of(NONE, {0: 1.0}))
        keys, parts = _by_common_keys([substituted(m, indeterminate_substitution, cache) for m in monomials])
        sums = Sums()
        for c, part in zip(coefficients, parts):
            for key, d in part.items():
                sums.add_product(key, c, d)
        return Polynomial._of(keys, _decompose.expanded(sums.whole()), loose=True)

    # Changes

    def AddProduct(self, coeff: Symbolic, m: Monomial) -> Polynomial:
        """Adds a term to this polynomial and returns it."""
        c = number_or(_build.expect("AddProduct", coeff))
        own = keys_for([m])
        keys, part, term = in_common(*self._by_indeterminates(), own, {own.key(m): c})
        decided = self._decisions | variables_of(as_expression(c))
        self._set(keys, added(part, term, 1.0, False), decided=decided)
        return self

    def RemoveTermsWithSmallCoefficients(self, coefficient_tol: float) -> Polynomial:
        """Returns it without the terms whose coefficients are numbers of no more than this magnitude.

        Raises:
            RuntimeError: `coefficient_tol` is not positive.
        """
        if not coefficient_tol > 0.0:
            call = "Polynomial.RemoveTermsWithSmallCoefficients"
            raise RuntimeError(f"{call}(): coefficient_tol must be positive, got {coefficient_tol}.")
        tol = coefficient_tol
        keep = {key: c for key, c in self._part.items() if c.__class__ is not float or not abs(c) <= tol}
        return Polynomial._of(self._keys, keep, loose=True)

    # Comparison

    def EqualTo(self, other: Polynomial) -> bool:
        """Tells whether both have the same monomials with coefficients of the same structure."""
        other = expect("Polynomial.EqualTo", other, Polynomial)
        _, mine, its = in_common(self._keys, self._part, other._keys, other._part)
        if mine.keys() != its.keys():
            return False
        return all([_are_equal(c, its[key]) for key, c in mine.items()])

    def CoefficientsAlmostEqual(self, p: Polynomial, tolerance: float) -> bool:
        """Tells whether coefficients differ by numbers of no more than this magnitude."""
        rest = (self - p).Expand()._part.values()
        return all([c.__class__ is float and abs(c) <= tolerance for c in rest])

    def __eq__(self, other: object) -> Formula:  # type: ignore[override]
        if not isinstance(other, Polynomial):
            return NotImplemented
        rest = (other - self)._part.values()
        conditions = [_formula.compare("==", as_expression(c), _build.ZERO) for c in rest]
        return _functions.logical_and(_formula.truth(True), *conditions)

    def __ne__(self, other: object) -> Formula:  # type: ignore[override]
        return _formula.negation(self == other) if isinstance(other, Polynomial) else NotImplemented

    def __hash__(self) -> int:
        return hash(frozenset([(m, as_expression(c)._serial) for m, c in zip(self._monomials(), self._part.values())]))

    # Arithmetic

    def _operand(self, other: object) -> Polynomial | None:
        """Another polynomial from what may be added; None for an expression, which makes the sum an expression."""
        if isinstance(other, Variable):
            if self._has(other):
                return Polynomial._of(keys_of((other,)), {1: 1.0}, True, False, _NOBODY)
            return Polynomial._of(NONE, {0: _build.expect("Polynomial", other)}, False)
        return Polynomial._from(other)

    @classmethod
    def _from(cls, value: object) -> Polynomial | None:
        """A polynomial, a monomial or a number as a polynomial; None for anything else."""
        if isinstance(value, Polynomial):
            return value
        if isinstance(value, Monomial):
            keys = keys_of(tuple(value._powers))
            return cls._of(keys, {keys.key(value): 1.0}, True, False, _NOBODY)
        if isinstance(value, _build._REAL):
            number = float(value)
            if number == number:
                return cls._of(NONE, {0: number} if number else {}, True, False, _NOBODY)
            return cls._of(NONE, {0: _build.NOT_A_NUMBER}, False, False, _NOBODY)
        return None

    def _has(self, v: Variable) -> bool:
        """Whether a variable is an indeterminate."""
        return v in self._by_indeterminates()[0].of

    def _with(self, other: Polynomial) -> tuple[Keys, Part, Part, bool, frozenset[Variable]]:
        """The terms of both by the same keys, whether all coefficients are numbers, and the decision variables."""
        if self._is_loose or other._is_loose:
            self._by_indeterminates(), other._by_indeterminates()
        keys, mine, its = self._keys, self._part, other._part
        if keys is not other._keys and not (other._keys is NONE and keys.narrow):
            keys, mine, its = in_common(keys, mine, other._keys, its)
        decided, more = self._decided, other._decided
        if decided is None:
            decided = self._decisions
        if more is None:
            more = other._decisions
        if more:
            decided |= more
        return keys, mine, its, self._is_numeric() and other._is_numeric(), decided

    def _combine(self, other: Polynomial, sign: float) -> Polynomial:
        """The sum with another times +1 or -1."""
        keys, mine, its, numeric, decided = self._with(other)
        return Polynomial._of(keys, added(mine, its, sign, numeric), numeric or None, False, decided)

    @typing_overload
    def __add__(self, other: Polynomial | Monomial | Variable | float) -> Polynomial: ...
    @typing_overload
    def __add__(self, other: Expression) -> Expression: ...
    def __add__(self, other: Polynomial | Monomial | Symbolic) -> Polynomial | Expression:
        p = self._operand(other)
        if p is not None:
            return self._combine(p, 1.0)
        return self.ToExpression() + other if isinstance(other, Expression) else NotImplemented

    __radd__ = __add__

    @typing_overload
    def __sub__(self, other: Polynomial | Monomial | Variable | float) -> Polynomial: ...
    @typing_overload
    def __sub__(self, other: Expression) -> Expression: ...
    def __sub__(self, other: Polynomial | Monomial | Symbolic) -> Polynomial | Expression:
        p = self._operand(other)
        if p is not None:
            return self._combine(p, -1.0)
        return self.ToExpression() - other if isinstance(other, Expression) else NotImplemented

    def __rsub__(self, other: Symbolic | Monomial) -> Polynomial | Expression:
        return -(self - other) if not isinstance(other, Expression) else other - self.ToExpression()

    @typing_overload
    def __mul__(self, other: Polynomial | Monomial | Variable | float) -> Polynomial: ...
    @typing_overload
    def __mul__(self, other: Expression) -> Expression: ...
    def __mul__(self, other: Polynomial | Monomial | Symbolic) -> Polynomial | Expression:
        p = self._operand(other)
        if p is not None:
            keys, mine, its, numeric, decided = self._with(p)
            return Polynomial._of(keys, product(mine, its, keys, numeric), numeric or None, False, decided)
        return self.ToExpression() * other if isinstance(other, Expression) else NotImplemented

    __rmul__ = __mul__

    def __truediv__(self, other: Polynomial | Symbolic) -> Polynomial | Expression:
        if isinstance(other, _build._REAL):
            divisor = _build.constant(other)
            quotients = {key: _quotient(c, divisor) for key, c in self._part.items()}
            return Polynomial._of(self._keys, without_zeros(quotients), None, self._is_loose, self._decided)
        e = _build.as_expression(other)
        return NotImplemented if e is None else _build.divide(self.ToExpression(), e)

    def __rtruediv__(self, other: Symbolic) -> Expression:
        e = _build.as_expression(other)
        return NotImplemented if e is None else _build.divide(e, self.ToExpression())

    def __neg__(self) -> Polynomial:
        negatives = {key: negated(c) for key, c in self._part.items()}
        return Polynomial._of(self._keys, negatives, self._known_numeric, self._is_loose, self._decided)

    @checked
    def __pow__(self, n: int) -> Polynomial:
        if n < 0:
            raise RuntimeError(f"Polynomial.__pow__(): the exponent must not be negative, got {n}.")
        if n > _LARGEST_EXPONENT:
            raise TypeError(f"Polynomial.__pow__(): the exponent must be at most {_LARGEST_EXPONENT}, got {n}.")
        if n == 0:
            return Polynomial._of(self._by_indeterminates()[0], {self._keys.one: 1.0}, True)
        numeric = self._is_numeric()
        out = _decompose.expanded(power(self._part, int(n), self._keys, numeric))
        return Polynomial._of(self._keys, out, numeric or None, self._is_loose, self._decided)

    def __copy__(self) -> Polynomial:
        out = object.__new__(Polynomial)
        out._keys, out._part, out._known_numeric = self._keys, self._part, self._known_numeric
        out._is_loose, out._decided = self._is_loose, self._decided
        return out

    def __deepcopy__(self, memo: dict) -> Polynomial:
        return self.__copy__()

    def __str__(self) -> str:
        keys, part = self._keys, self._part
        terms = [f"{as_expression(part[key])}*{keys.monomial(key)}" for key in keys.in_order(part)]
        return " + ".join(terms) or "0"

    def __repr__(self) -> str:
        return f'<Polynomial "{self}">'


def _roots(coefficients: list[float]) -> list[complex]:
    """Eigenvalues of the companion matrix of coefficients, the first of which is not zero; zero where these end in
    zeros.
    """
    powers = len(coefficients)
    while powers and coefficients[powers - 1] == 0.0:
        powers -= 1
    roots = [0j] * (len(coefficients) - powers if powers else 0)
    if powers > 1:
        companion = np.eye(powers - 1, k=-1)
        companion[0] = [-c / coefficients[0] for c in coefficients[1:powers]]
        roots += np.linalg.eigvals(companion).astype(complex).tolist()
    return roots


def _largest_first(root: complex) -> tuple[float, float, float]:
    """What roots are sorted by: their magnitude, but for rounding; then the real part, and the imaginary."""
    return -round(abs(root), 12), -root.real, -root.imag


def _are_equal(c: Any, d: Any) -> bool:
    if c.__class__ is float or d.__class__ is float:
        return c.__class__ is d.__class__ and c == d
    return c._serial == d._serial


def _quotient(c: Any, divisor: Expression) -> Coefficient:
    return number_or(_build.divide(as_expression(c), divisor))


def _by_common_keys(polynomials: Collection[Polynomial]) -> tuple[Keys, list[Part]]:
    """The terms of polynomials by the same keys."""
    keys = keys_in({v: None for p in polynomials for v in p._by_indeterminates()[0].of})
    return keys, [in_common(keys, {}, p._keys, p._part)[2] for p in polynomials]


def _substituted(
    terms: Iterable[tuple[Monomial, Coefficient]], places: Mapping[Variable, Part], keys: Keys, numeric: bool
) -> Part:
    """Terms with others in the place of variables; numeric: the coefficients of these others are numbers."""
    known: dict[tuple[Variable, int], Part] = {}

    def power_of(v: Variable, n: int) -> Part:
        found = known.get((v, n))
        if found is None:
            found = places[v] if n == 1 else product(places[v], power_of(v, n - 1), keys, numeric)
            known[v, n] = found
        return found

    sums = Sums()
    for m, c in terms:
        part: Part | None = None
        for v, n in m._powers.items():
            part = power_of(v, n) if part is None else product(part, power_of(v, n), keys, numeric)
        for key, d in ({keys.one: 1.0} if part is None else part).items():
            sums.add_product(key, c, d)
    return sums.whole()
