"""Monomials and sets of them."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common import _ieee as ieee
from sheldrake.common._checked import checked
from sheldrake.common._kinds import anything, count, instance_of
from sheldrake.common._overloads import Mismatch, overload, overloaded
from sheldrake.symbolic import _build
from sheldrake.symbolic._arguments import by_variable, variable, variables
from sheldrake.symbolic._expression import Expression
from sheldrake.symbolic._traverse import numbers_by_variable, object_array, variable_list
from sheldrake.symbolic._variable import Variable, Variables

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.common._types import Symbolic, Symbolics
    from sheldrake.symbolic._polynomial import Polynomial

_polynomial: Any = None  # A module that needs the class below; the package binds it when all is loaded.


def _by_age(item: tuple[Variable, int]) -> int:
    return item[0]._id


class Monomial:
    """A product of powers of variables, such as x^2 * y.

    Args:
        powers: Exponents by variable; or a variable and its exponent; or a vector of variables and one of exponents.
            The monomial 1 if absent.
    """

    __slots__ = ("_code", "_powers")
    __array_priority__ = -1.0  # more than NumPy's scalars have, which then leave operators to us, and less than arrays
    _powers: dict[Variable, int]
    _code: int | None  # its hash, once it has been asked for

    @overloaded(
        overload(lambda self: self.__init__((), ())),
        overload(lambda self, var, exponent: self.__init__((var,), (exponent,)), var=variable, exponent=(anything, 1)),
        overload(lambda self, powers: self.__init__(tuple(powers), tuple(powers.values())), powers=by_variable),
        overload(vars=instance_of(Sequence, np.ndarray), exponents=instance_of(Sequence, np.ndarray)),
    )
    def __init__(self, vars: Any, exponents: Any):
        if len(vars) != len(exponents):
            raise RuntimeError(f"Monomial(): {len(vars)} variables but {len(exponents)} exponents.")
        powers: dict[Variable, int] = {}
        for v, exponent in zip(vars, exponents):
            if not isinstance(v, Variable) or int(exponent) != exponent:
                raise Mismatch(
                    f"Monomial(): incompatible constructor arguments; expected variables and whole exponents, got "
                    f"{v!r}: {exponent!r}."
                )
            if exponent < 0:
                raise RuntimeError(f"Monomial(): the exponent of {v} is negative: {exponent}.")
            if exponent:
                powers[v] = powers.get(v, 0) + int(exponent)
        self._set(powers)

    def _set(self, powers: dict[Variable, int]) -> None:
        self._powers = dict(sorted(powers.items(), key=_by_age)) if len(powers) > 1 else powers
        self._code = None

    @classmethod
    def _of(cls, powers: dict[Variable, int]) -> Monomial:
        out = object.__new__(cls)
        out._set(powers)
        return out

    @classmethod
    def _ordered(cls, powers: dict[Variable, int]) -> Monomial:
        """That of powers in the order of their variables."""
        out = object.__new__(cls)
        out._powers, out._code = powers, None
        return out

    @checked
    def degree(self, v: Variable) -> int:
        """Returns the exponent of a variable."""
        return self._powers.get(v, 0)

    def total_degree(self) -> int:
        """Returns the sum of all exponents."""
        return sum(self._powers.values())

    def get_powers(self) -> dict[Variable, int]:
        """Returns the exponents by variable."""
        return dict(self._powers)

    def GetVariables(self) -> Variables:
        """Returns the variables in it."""
        return Variables(self._powers)

    def ToExpression(self) -> Expression:
        """Returns it as an expression."""
        factors = {}
        for v, n in self._powers.items():
            base = v._expression or _build.variable(v)
            factors[base._number] = base, _build.numbered(_build.constant(n))
        return _build.make_product(1.0, factors)

    @checked
    def EqualTo(self, other: Monomial) -> bool:
        """Tells whether both are the same."""
        return self == other

    @overloaded(
        overload(env=by_variable),
        overload(lambda self, *many: self._evaluate_many(*many), vars=anything, vars_values=anything),
    )
    def Evaluate(self, env: Mapping[Variable, float] | None) -> float:
        """Returns the value for given values of its variables.

        Called as `Evaluate(env)`, or as `Evaluate(vars, vars_values)` for many: values as columns, shape
        `(len(vars), n)`; returns shape `(n,)`.

        Raises:
            RuntimeError: a variable has no value.
            ValueError: in the second form.
        """
        return self._value(numbers_by_variable("Evaluate", env))

    def _value(self, env: Mapping[Variable, float]) -> float:
        """The value, the environment already checked."""
        out = 1.0
        try:
            for v, exponent in self._powers.items():
                out *= env[v] if exponent == 1 else ieee.power(env[v], exponent)
        except KeyError:
            raise RuntimeError(
                f"Monomial {self} cannot be evaluated with the given environment which does not provide an entry "
                f"for variable = {v}."
            ) from None
        return out

    def _evaluate_many(self, vars: Symbolics, values: ArrayLike) -> np.ndarray:
        values = np.atleast_2d(np.asarray(values, dtype=float))
        rows, out = dict(zip(variable_list("Evaluate", vars), values)), np.ones(values.shape[1])
        for v, exponent in self._powers.items():
            if v not in rows:
                raise ValueError(f"Monomial::Evaluate(): {v} is not present in vars")
            out *= rows[v] ** exponent
        return out

    @checked
    def EvaluatePartial(self, env: dict[Variable, float]) -> tuple[float, Monomial]:
        """Returns the value of the variables given and the monomial of the rest."""
        return self._partial(numbers_by_variable("EvaluatePartial", env))

    def _partial(self, values: Mapping[Variable, float]) -> tuple[float, Monomial]:
        """`EvaluatePartial` of values already checked."""
        out, rest = 1.0, {}
        for v, exponent in self._powers.items():
            if v in values:
                out *= ieee.power(values[v], exponent)
            else:
                rest[v] = exponent
        return out, Monomial._ordered(rest)

    def _with(self, v: Variable, exponent: int) -> Monomial:
        """The same with another exponent of a variable."""
        powers = {**self._powers, v: exponent}
        if exponent == 0:
            del powers[v]
        return Monomial._ordered(powers) if v in self._powers else Monomial._of(powers)

    @checked
    def pow_in_place(self, p: int) -> Monomial:
        """Raises it to a power and returns it."""
        if p < 0:
            raise RuntimeError(f"Monomial.pow_in_place(): the exponent must not be negative, got {p}.")
        self._set({v: n * p for v, n in self._powers.items()} if p else {})
        return self

    def _key(self) -> tuple:
        """Order: by the exponents of the oldest variable first."""
        return tuple((-v._id, n) for v, n in self._powers.items())

    def __hash__(self) -> int:
        if self._code is None:
            self._code = hash(tuple(self._powers.items()))
        return self._code

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Monomial):
            return NotImplemented
        return self is other or self._powers == other._powers

    @checked
    def __pow__(self, p: int) -> Monomial:
        return Monomial._of(self._powers).pow_in_place(p)

    def _times(self, other: Monomial) -> Monomial:
        if not other._powers or not self._powers:
            return (self if self._powers else other).__copy__()
        powers = dict(self._powers)
        for v, n in other._powers.items():
            powers[v] = powers.get(v, 0) + n
        return Monomial._ordered(powers) if len(powers) == len(self._powers) else Monomial._of(powers)

    def __mul__(self, other: Symbolic | Monomial | Polynomial) -> Any:
        if isinstance(other, Monomial):
            return self._times(other)
        if isinstance(other, _build._REAL):
            return _polynomial.Polynomial({self: _build.constant(other)})
        e = _build.as_expression(other)
        return NotImplemented if e is None else _build.multiply(self.ToExpression(), e)

    __rmul__ = __mul__

    def __add__(self, other: Symbolic | Monomial) -> Expression:
        e = _build.as_expression(other)
        return NotImplemented if e is None else _build.add(self.ToExpression(), e)

    __radd__ = __add__

    def __sub__(self, other: Symbolic | Monomial) -> Expression:
        e = _build.as_expression(other)
        return NotImplemented if e is None else _build.subtract(self.ToExpression(), e)

    def __rsub__(self, other: Symbolic | Monomial) -> Expression:
        e = _build.as_expression(other)
        return NotImplemented if e is None else _build.subtract(e, self.ToExpression())

    def __truediv__(self, other: Symbolic | Monomial) -> Expression:
        e = _build.as_expression(other)
        return NotImplemented if e is None else _build.divide(self.ToExpression(), e)

    def __rtruediv__(self, other: Symbolic | Monomial) -> Expression:
        e = _build.as_expression(other)
        return NotImplemented if e is None else _build.divide(e, self.ToExpression())

    def __copy__(self) -> Monomial:
        out = object.__new__(Monomial)
        out._powers, out._code = self._powers, self._code  # the dict of powers never changes, only which one it is
        return out

    def __deepcopy__(self, memo: dict) -> Monomial:
        return self.__copy__()

    def __reduce__(self) -> tuple:
        return Monomial._of, (self._powers,)

    def __str__(self) -> str:
        return " * ".join(f"{v}^{n}" if n != 1 else f"{v}" for v, n in self._powers.items()) or "1"

    def __repr__(self) -> str:
        return f'<Monomial "{self}">'


def _in_order(monomials: Iterable[Monomial]) -> np.ndarray:
    """Highest total degree first."""
    return object_array(sorted(monomials, key=lambda m: (-m.total_degree(), m._key())))


@functools.lru_cache(maxsize=64)
def _of_degree(variables: tuple[Variable, ...], degree: int) -> tuple[Monomial, ...]:
    """All of a total degree, in order: to be read, or copied."""
    out = []
    for chosen in itertools.combinations_with_replacement(variables, degree):
        powers: dict[Variable, int] = {}
        for v in chosen:
            powers[v] = powers.get(v, 0) + 1
        out.append(Monomial._ordered(powers))
    return tuple(out[::-1])


def _of_degrees(vars: Any, degrees: Sequence[int]) -> np.ndarray:
    variables = tuple(Variables(vars))
    return object_array([m.__copy__() for d in reversed(degrees) for m in _of_degree(variables, d)])


@overloaded(
    overload(lambda vars, degree: _of_degrees(vars, range(degree + 1)), vars=variables, degree=count),
    overload(vars_degree=by_variable),
)
def MonomialBasis(sets: Mapping[Variables, int]) -> np.ndarray:
    """Returns all monomials up to a total degree, the highest first.

    Called as `MonomialBasis(vars, degree)`, or as `MonomialBasis({vars: degree, ...})` for the products of monomials of
    several sets of variables that share none.
    """
    if sum(len(v) for v in sets) != len(Variables([x for v in sets for x in v])):
        raise RuntimeError("MonomialBasis(): the sets of variables must not share any.")
    factors = [[m for d in range(n + 1) for m in _of_degree(tuple(v), d)] for v, n in sets.items()]
    out = []
    for chosen in itertools.product(*factors):
        product = Monomial()
        for m in chosen:
            product = product._times(m)
        out.append(product)
    return _in_order(out)


def EvenDegreeMonomialBasis(vars: Variables, degree: int) -> np.ndarray:
    """Returns all monomials of even total degree up to `degree`, the highest first.

    Raises:
        RuntimeError: the degree is negative.
    """
    _require_degree("EvenDegreeMonomialBasis", degree)
    return _of_degrees(vars, range(0, degree + 1, 2))


def OddDegreeMonomialBasis(vars: Variables, degree: int) -> np.ndarray:
    """Returns all monomials of odd total degree up to `degree`, the highest first.

    Raises:
        RuntimeError: the degree is negative.
    """
    _require_degree("OddDegreeMonomialBasis", degree)
    return _of_degrees(vars, range(1, degree + 1, 2))


def _require_degree(call: str, degree: int) -> None:
    if degree < 0:
        raise RuntimeError(f"{call}(): the degree must not be negative, got {degree}.")


def CalcMonomialBasisOrderUpToOne(x: Variables, sort_monomial: bool = False) -> np.ndarray:
    """Returns all monomials in which no variable has an exponent above one.

    Args:
        x: The variables.
        sort_monomial: The highest total degree first; otherwise in the order of counting in binary.
    """
    variables = list(x)
    n = len(variables)
    out = [Monomial._of({v: 1 for i, v in enumerate(variables) if count >> (n - 1 - i) & 1}) for count in range(2**n)]
    return _in_order(out) if sort_monomial else object_array(out)
