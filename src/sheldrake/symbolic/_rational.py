"""Quotients of polynomials."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sheldrake.common import _ieee as ieee
from sheldrake.common._checked import checked
from sheldrake.common._overloads import Mismatch, kind, overload, overloaded
from sheldrake.symbolic import _build
from sheldrake.symbolic._expression import Expression
from sheldrake.symbolic._keys import NONE
from sheldrake.symbolic._monomial import Monomial
from sheldrake.symbolic._polynomial import Polynomial
from sheldrake.symbolic._variable import Variable, Variables

if TYPE_CHECKING:
    from sheldrake.symbolic._formula import Formula


_ONE = Polynomial._of(NONE, {0: 1.0}, True)


@kind("Polynomial")
def _polynomial(value: object) -> Polynomial:
    p = Polynomial._from(value)
    if p is None:
        raise Mismatch
    return p


class RationalFunction:
    """A quotient of two polynomials, not reduced.

    Args:
        numerator: A polynomial, a monomial or a number; zero if absent.
        denominator: A polynomial; one if absent.

    Raises:
        RuntimeError: the denominator is zero.
    """

    __slots__ = ("_denominator", "_numerator")
    __array_priority__ = -1.0  # more than NumPy's scalars have, which then leave operators to us, and less than arrays
    __hash__ = None  # type: ignore[assignment]

    @overloaded(
        overload(lambda self: self.__init__(Polynomial())),
        *(overload(**{name: _polynomial}) for name in ("p", "m", "c")),
        overload(numerator=_polynomial, denominator=_polynomial),
    )
    def __init__(self, numerator: Polynomial, denominator: Polynomial | None = None):
        self._numerator: Polynomial = numerator.__copy__()
        self._denominator: Polynomial = (_ONE if denominator is None else denominator).__copy__()
        if not self._denominator._part:
            raise RuntimeError("RationalFunction(): the denominator must not be zero.")

    @classmethod
    def _of(cls, numerator: Polynomial, denominator: Polynomial) -> RationalFunction:
        """That of polynomials of its own, the one below not zero."""
        out = object.__new__(cls)
        out._numerator, out._denominator = numerator, denominator
        return out

    def numerator(self) -> Polynomial:
        """Returns the polynomial above."""
        return self._numerator

    def denominator(self) -> Polynomial:
        """Returns the polynomial below."""
        return self._denominator

    @checked
    def SetIndeterminates(self, new_indeterminates: Variables) -> None:
        """Makes other variables the indeterminates of both polynomials."""
        self._numerator.SetIndeterminates(new_indeterminates)
        self._denominator.SetIndeterminates(new_indeterminates)

    def Evaluate(self, env: dict[Variable, float]) -> float:
        """Returns the value; infinite or nan where the denominator is zero."""
        return ieee.divide(self._numerator.Evaluate(env), self._denominator.Evaluate(env))

    def ToExpression(self) -> Expression:
        """Returns it as an expression."""
        return _build.divide(self._numerator.ToExpression(), self._denominator.ToExpression())

    @checked
    def EqualTo(self, f: RationalFunction) -> bool:
        """Tells whether both have equal numerators and equal denominators."""
        return self._numerator.EqualTo(f._numerator) and self._denominator.EqualTo(f._denominator)

    def __eq__(self, other: object) -> Formula:  # type: ignore[override]
        r = _as_rational(other)
        if r is None:
            return NotImplemented
        return self._denominator * r._numerator == self._numerator * r._denominator

    def __ne__(self, other: object) -> Formula:  # type: ignore[override]
        r = _as_rational(other)
        if r is None:
            return NotImplemented
        return self._denominator * r._numerator != self._numerator * r._denominator

    def __add__(self, other: RationalFunction | Polynomial | Monomial | Variable | float) -> RationalFunction:
        r = _as_rational(other)
        if r is None:
            return NotImplemented
        if self._denominator.EqualTo(r._denominator):
            return RationalFunction._of(self._numerator + r._numerator, self._denominator.__copy__())
        numerator = self._numerator * r._denominator + r._numerator * self._denominator
        return RationalFunction._of(numerator, self._denominator * r._denominator)

    __radd__ = __add__

    def __sub__(self, other: RationalFunction | Polynomial | Monomial | Variable | float) -> RationalFunction:
        r = _as_rational(other)
        return NotImplemented if r is None else self + (-r)

    def __rsub__(self, other: RationalFunction | Polynomial | Monomial | Variable | float) -> RationalFunction:
        return -self + other

    def __mul__(self, other: RationalFunction | Polynomial | Monomial | Variable | float) -> RationalFunction:
        r = _as_rational(other)
        if r is None:
            return NotImplemented
        return RationalFunction._of(self._numerator * r._numerator, self._denominator * r._denominator)

    __rmul__ = __mul__

    def __truediv__(self, other: RationalFunction | Polynomial | Monomial | Variable | float) -> RationalFunction:
        r = _as_rational(other)
        if r is None:
            return NotImplemented
        if not r._numerator._part:
            raise RuntimeError("RationalFunction: operator/=: The divider is 0.")
        return RationalFunction._of(self._numerator * r._denominator, self._denominator * r._numerator)

    def __rtruediv__(self, other: RationalFunction | Polynomial | Monomial | Variable | float) -> RationalFunction:
        r = _as_rational(other)
        return NotImplemented if r is None else r / self

    def __neg__(self) -> RationalFunction:
        return RationalFunction._of(-self._numerator, self._denominator.__copy__())

    def __copy__(self) -> RationalFunction:
        return RationalFunction._of(self._numerator.__copy__(), self._denominator.__copy__())

    def __deepcopy__(self, memo: dict) -> RationalFunction:
        return self.__copy__()

    def __str__(self) -> str:
        return f"({self._numerator}) / ({self._denominator})"

    def __repr__(self) -> str:
        return f'<RationalFunction "{self}">'


def _as_rational(r: object) -> RationalFunction | None:
    if isinstance(r, RationalFunction):
        return r
    p = Polynomial._from(r)
    return None if p is None else RationalFunction._of(p, _ONE)
