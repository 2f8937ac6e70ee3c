"""Polynomials in several indeterminates whose coefficients are expressions in other variables."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any
from typing import overload as typing_overload

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._kinds import anything, instance_of
from sheldrake.common._overloads import expect, overload, overloaded
from sheldrake.symbolic import _build, _decompose, _formula, _functions
from sheldrake.symbolic import _kinds as k
from sheldrake.symbolic._arguments import by_variable, expression, variable, variables
from sheldrake.symbolic._decompose import Numbers, add_to, is_zero
from sheldrake.symbolic._expression import Expression
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


def _expressions_of(map: Mapping[Monomial, Any]) -> dict[Monomial, Expression]:
    return {m: _build.expect("Polynomial", c) for m, c in map.items()}


_LARGEST_EXPONENT = 2**31 - 1  # as in Drake; a power of many terms takes for ever long before


class Polynomial:
    """A sum of monomials in the *indeterminates*, with coefficients in other variables, the *decision variables*.

    Args:
        e: An expression, a variable, a number or a monomial; or a dict of Monomial to coefficient.
        indeterminates: Which variables of an expression are indeterminates; all if absent.

    Raises:
        RuntimeError: the expression is no polynomial in the indeterminates.
    """

    __slots__ = ("_known_decisions", "_known_indeterminates", "_made", "_numbers")
    __array_priority__ = -1.0  # more than NumPy's scalars have, which then leave operators to us, and less than arrays
    _known_decisions: Variables | frozenset[Variable] | None
    _known_indeterminates: Variables | frozenset[Variable] | None
    _made: dict[Monomial, Expression] | None  # once it has been asked for
    _numbers: Numbers | None  # the same, if it is known that all coefficients are numbers

    @overloaded(
        overload(lambda self: self._set_map({})),
        overload(lambda self, map: self._set_map(_expressions_of(map)), map=by_variable),
        overload(lambda self, m: self._set_map({m: _build.ONE}), m=instance_of(Monomial)),
        overload(e=expression, indeterminates=(variables, None)),
    )
    def __init__(self, e: Expression, indeterminates: Variables | None):
        chosen = variables_of(e) if indeterminates is None else frozenset(indeterminates)
        self._made, self._numbers = None, Numbers.of_expression(e, chosen)
        if self._numbers is None:
            found = _decompose.decompose(e, chosen)
            self._set_map(_decompose.expanded(found))
        self._known_indeterminates, self._known_decisions = chosen, variables_of(e) - chosen

    def _set_map(self, coefficients: dict[Monomial, Expression]) -> None:
        has_zeros = any(map(is_zero, coefficients.values()))  # a copy asks no monomial for its hash
        kept = {m: c for m, c in coefficients.items() if not is_zero(c)} if has_zeros else dict(coefficients)
        self._made, self._numbers = kept, None
        self._known_indeterminates = self._known_decisions = None

    @property
    def _map(self) -> dict[Monomial, Expression]:
        """Coefficients by monomial."""
        if self._made is None:
            assert self._numbers is not None
            self._made = self._numbers.coefficients()
        return self._made

    @classmethod
    def _of(cls, coefficients: dict[Monomial, Expression]) -> Polynomial:
        out = object.__new__(cls)
        out._set_map(coefficients)
        return out

    @classmethod
    def _of_numbers(cls, numbers: Numbers) -> Polynomial:
        out = object.__new__(cls)
        out._made, out._numbers, out._known_indeterminates, out._known_decisions = None, numbers, None, None
        return out

    def _as_numbers(self) -> Numbers | None:
        """The same, if all coefficients are numbers."""
        if self._numbers is None:
            self._numbers = Numbers.of(self._map)
        return self._numbers

    # Parts

    @property
    def _indeterminates(self) -> Variables:
        found: Any = self._known_indeterminates
        if found is None:
            found = {v for m in self._map for v in m._powers} if self._numbers is None else self._numbers.variables()
        if found.__class__ is not Variables:
            self._known_indeterminates = found = Variables._of(found)
        return found

    @property
    def _decisions(self) -> Variables:
        found: Any = self._known_decisions
        if found is None:
            found = frozenset().union(*map(variables_of, self._map.values() if self._numbers is None else ()))
        if found.__class__ is not Variables:
            self._known_decisions = found = Variables._of(found)
        return found

    def indeterminates(self) -> Variables:
        """Returns the variables of the monomials."""
        return self._indeterminates.__copy__()

    def decision_variables(self) -> Variables:
        """Returns the variables of the coefficients."""
        return self._decisions.__copy__()

    @checked
    def SetIndeterminates(self, new_indeterminates: Variables) -> None:
        """Makes other variables the indeterminates.

        Raises:
            RuntimeError: it is no polynomial in those.
        """
        new = Polynomial(self.ToExpression(), new_indeterminates)
        self._made, self._numbers = new._made, new._numbers
        self._known_indeterminates, self._known_decisions = new._indeterminates, new._decisions

    def monomial_to_coefficient_map(self) -> dict[Monomial, Expression]:
        """Returns the coefficients by monomial, in the order of monomials."""
        return dict(sorted(self._map.items(), key=lambda item: item[0]._key()))

    @checked
    def Degree(self, v: Variable) -> int:
        """Returns the highest exponent of an indeterminate."""
        return max((m.degree(v) for m in self._map), default=0)

    def TotalDegree(self) -> int:
        """Returns the highest total degree of its monomials."""
        return max((m.total_degree() for m in self._map), default=0)

    def IsEven(self) -> bool:
        """Tells whether all monomials have an even total degree."""
        return all(m.total_degree() % 2 == 0 for m in self._map)

    def IsOdd(self) -> bool:
        """Tells whether all monomials have an odd total degree."""
        return all(m.total_degree() % 2 == 1 for m in self._map)

    def ToExpression(self) -> Expression:
        """Returns it as an expression."""
        numbers = self._as_numbers()
        if numbers is not None:
            return numbers.expression()
        return _build.sum_of(
            _build.multiply(c, m.ToExpression()) for m, c in self.monomial_to_coefficient_map().items()
        )

    # Values

    @checked
    def Evaluate(self, env: dict[Variable, float]) -> float:
        """Returns the value for given values of all variables.

        Raises:
            RuntimeError: a variable has no value.
        """
        values = numbers_by_variable("Evaluate", env)
        total = 0.0
        for m, c in self._map.items():
            coefficient = c._made[0] if c._kind == k.CONSTANT else evaluate_nodes([c], values)[0]
            total += coefficient * m._value(values)
        return total

    @overloaded(
        overload(env=by_variable),
        overload(lambda self, var, c: self.EvaluatePartial({var: c}), var=variable, c=anything),
    )
    def EvaluatePartial(self, env: Mapping[Variable, float] | None) -> Polynomial:
        """Returns it with values in the place of some variables; called with a dict, or with a variable and a value."""
        env = numbers_by_variable("EvaluatePartial", env)
        out: dict[Monomial, Expression] = {}
        for m, c in self._map.items():
            value, rest = m._partial(env)
            add_to(out, rest, _build.scale(value, c if c._kind == k.CONSTANT else substitute([c], env)[0]))
        return Polynomial._of(out)

    def EvaluateIndeterminates(self, indeterminates: Symbolics, indeterminates_values: ArrayLike) -> np.ndarray:
        """Returns the values for many values of the indeterminates, shape `(n,)`.

        Args:
            indeterminates: Shape `(k,)`.
            indeterminates_values: Values as columns, shape `(k, n)`.

        Raises:
            RuntimeError: a coefficient is no number.
        """
        values = np.atleast_2d(np.asarray(indeterminates_values, dtype=float))
        out = np.zeros(values.shape[1])
        for m, c in self._map.items():
            if c._kind != k.CONSTANT:
                raise RuntimeError(f"Polynomial::EvaluateIndeterminates: the coefficient {c} is not a constant")
            out = out + c._args[0] * m.Evaluate(indeterminates, values)
        return out

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
        values = np.atleast_2d(np.asarray(indeterminates_values, dtype=float))
        decisions = list(self._decisions)
        rows, constants = np.zeros((len(self._map), len(decisions))), np.zeros(len(self._map))
        places = {v: i for i, v in enumerate(decisions)}
        weights = np.ones((len(self._map), values.shape[1]))
        known = dict(zip(variable_list("Evaluate", indeterminates), values))
        for i, (m, c) in enumerate(self._map.items()):
            constants[i] = _decompose.affine_into(rows[i], c, places)
            weights[i] = m._values(known, values.shape[1])
        return weights.T @ rows, object_array(decisions), constants @ weights

    def Roots(self) -> np.ndarray:
        """Returns the complex roots of a polynomial in one indeterminate with numbers as coefficients.

        Raises:
            RuntimeError: it is not of that kind.
        """
        if len(self._indeterminates) != 1:
            raise RuntimeError(f"{self} is not a univariate polynomial; it has indeterminates {self._indeterminates}.")
        coefficients = np.zeros(self.TotalDegree() + 1)
        for m, c in self._map.items():
            if c._kind != k.CONSTANT:
                raise RuntimeError(
                    "Polynomial::Roots() only supports polynomials with constant coefficients. This polynomial has "
                    f"coefficient {c} for the monomial {m}."
                )
            coefficients[m.total_degree()] = c._args[0]
        found = np.roots(coefficients[::-1]).astype(complex)
        return found[np.lexsort((-found.imag, -found.real, -np.round(np.abs(found), 12)))]

    # Calculus and substitution

    @checked
    def Differentiate(self, x: Variable) -> Polynomial:
        """Returns the partial derivative by any of its variables."""
        numbers = self._as_numbers()
        if numbers is not None:
            return Polynomial._of_numbers(numbers.slope(x))
        out: dict[Monomial, Expression] = {}
        for m, c in self._map.items():
            n = m._powers.get(x, 0)
            if n:
                add_to(out, m._with(x, n - 1), _build.scale(float(n), c))
            elif x in self._decisions:
                add_to(out, m, c.Differentiate(x))
        return Polynomial._of(out)

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
        out: dict[Monomial, Expression] = {}
        for m, c in self._map.items():
            n = m._powers.get(x, 0) + 1
            add_to(out, m._with(x, n), _build.scale(1.0 / n, c))
        whole = Polynomial._of(out)
        return whole if a is None or b is None else whole.EvaluatePartial({x: b}) - whole.EvaluatePartial({x: a})

    def Expand(self) -> Polynomial:
        """Returns it with coefficients multiplied out, and those that vanish gone."""
        return Polynomial._of(_decompose.expanded(self._map))

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
        if substitutions_cached_data is None:
            places = {v: indeterminate_substitution[v]._map for v in self._indeterminates}
            return Polynomial._of(_decompose.expanded(_decompose.substitute(self._map, places)))
        cache = substitutions_cached_data._data
        cache.setdefault(Monomial(), Polynomial._of({Monomial(): _build.ONE}))
        out: dict[Monomial, Expression] = {}
        for m, c in self._map.items():
            for n, d in substituted(m, indeterminate_substitution, cache)._map.items():
                add_to(out, n, _build.multiply(c, d))
        return Polynomial._of(_decompose.expanded(out))

    # Changes

    def AddProduct(self, coeff: Symbolic, m: Monomial) -> Polynomial:
        """Adds a term to this polynomial and returns it."""
        changed = dict(self._map)
        add_to(changed, m, _build.expect("AddProduct", coeff))
        self._set_map(changed)
        return self

    def RemoveTermsWithSmallCoefficients(self, coefficient_tol: float) -> Polynomial:
        """Returns it without the terms whose coefficients are numbers of no more than this magnitude.

        Raises:
            RuntimeError: `coefficient_tol` is not positive.
        """
        if not coefficient_tol > 0.0:
            call = "Polynomial.RemoveTermsWithSmallCoefficients"
            raise RuntimeError(f"{call}(): coefficient_tol must be positive, got {coefficient_tol}.")
        keep = {m: c for m, c in self._map.items() if c._kind != k.CONSTANT or abs(c._args[0]) > coefficient_tol}
        return Polynomial._of(keep)

    # Comparison

    def EqualTo(self, other: Polynomial) -> bool:
        """Tells whether both have the same monomials with coefficients of the same structure."""
        its = expect("Polynomial.EqualTo", other, Polynomial)._map
        return self._map.keys() == its.keys() and all(c._serial == its[m]._serial for m, c in self._map.items())

    def CoefficientsAlmostEqual(self, p: Polynomial, tolerance: float) -> bool:
        """Tells whether coefficients differ by numbers of no more than this magnitude."""
        return all(c._kind == k.CONSTANT and abs(c._args[0]) <= tolerance for c in (self - p).Expand()._map.values())

    def __eq__(self, other: object) -> Formula:  # type: ignore[override]
        if not isinstance(other, Polynomial):
            return NotImplemented
        conditions = [_formula.compare("==", c, _build.ZERO) for c in (other - self).Expand()._map.values()]
        return _functions.logical_and(_formula.truth(True), *conditions)

    def __ne__(self, other: object) -> Formula:  # type: ignore[override]
        return _formula.negation(self == other) if isinstance(other, Polynomial) else NotImplemented

    def __hash__(self) -> int:
        return hash(frozenset((m, c._serial) for m, c in self._map.items()))

    # Arithmetic

    def _operand(self, other: object) -> Polynomial | None:
        """Another polynomial from what may be added; None for an expression, which makes the sum an expression."""
        if isinstance(other, Polynomial):
            return other
        if isinstance(other, Monomial):
            return Polynomial._of({other: _build.ONE})
        if isinstance(other, Variable) and other in self._indeterminates:
            return Polynomial._of({Monomial(other): _build.ONE})
        if isinstance(other, (Variable, *_build._REAL)):
            return Polynomial._of({Monomial(): _build.expect("Polynomial", other)})
        return None

    def _combine(self, other: Polynomial, sign: float) -> Polynomial:
        """The sum with another times +1 or -1."""
        mine, its = self._as_numbers(), other._as_numbers()
        numbers = None if mine is None or its is None else mine.plus(its, sign)
        if numbers is not None:
            return Polynomial._of_numbers(numbers)
        out = dict(self._map)
        for m, c in other._map.items():
            add_to(out, m, c if sign > 0.0 else _build.negate(c))
        return Polynomial._of(out)

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
            mine, its = self._as_numbers(), p._as_numbers()
            numbers = None if mine is None or its is None else mine.times(its)
            if numbers is not None:
                return Polynomial._of_numbers(numbers)
            return Polynomial._of(_decompose.multiply(self._map, p._map))
        return self.ToExpression() * other if isinstance(other, Expression) else NotImplemented

    __rmul__ = __mul__

    def __truediv__(self, other: Polynomial | Symbolic) -> Polynomial | Expression:
        if isinstance(other, _build._REAL):
            divisor = _build.constant(other)
            return Polynomial._of({m: _build.divide(c, divisor) for m, c in self._map.items()})
        e = _build.as_expression(other)
        return NotImplemented if e is None else _build.divide(self.ToExpression(), e)

    def __rtruediv__(self, other: Symbolic) -> Expression:
        e = _build.as_expression(other)
        return NotImplemented if e is None else _build.divide(e, self.ToExpression())

    def __neg__(self) -> Polynomial:
        return Polynomial._of({m: _build.negate(c) for m, c in self._map.items()})

    def __pow__(self, n: int) -> Polynomial:
        if n < 0:
            raise RuntimeError(f"Polynomial.__pow__(): the exponent must not be negative, got {n}.")
        if n > _LARGEST_EXPONENT:
            raise TypeError(f"Polynomial.__pow__(): the exponent must be at most {_LARGEST_EXPONENT}, got {n}.")
        return Polynomial._of(_decompose.power(self._map, int(n)))

    def __copy__(self) -> Polynomial:
        out = object.__new__(Polynomial)
        out._made, out._numbers = self._made, self._numbers  # neither ever changes, only which one it is
        out._known_indeterminates, out._known_decisions = self._known_indeterminates, self._known_decisions
        return out

    def __deepcopy__(self, memo: dict) -> Polynomial:
        return self.__copy__()

    def __str__(self) -> str:
        return " + ".join(f"{c}*{m}" for m, c in self.monomial_to_coefficient_map().items()) or "0"

    def __repr__(self) -> str:
        return f'<Polynomial "{self}">'
