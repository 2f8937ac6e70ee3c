"""The operators that variables and expressions share."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from sheldrake.symbolic import _kinds as _k

if TYPE_CHECKING:
    from collections.abc import Callable

    from sheldrake.common._types import Symbolic
    from sheldrake.symbolic._expression import Expression
    from sheldrake.symbolic._formula import Formula

_build: Any = None  # Both are modules that need the class below; the package binds them when all is loaded.
_formula: Any = None
_Expression: Any = None


class Operators:
    """Arithmetic gives expressions, comparison gives formulas. NumPy calls the methods for elements of arrays."""

    __slots__ = ()
    __array_priority__ = -1.0  # more than NumPy's scalars have, which then leave operators to us, and less than arrays

    if TYPE_CHECKING:  # bound below, but for the node that a variable has
        _expression: Any
        log: Callable[[], Expression]
        abs: Callable[[], Expression]
        exp: Callable[[], Expression]
        sqrt: Callable[[], Expression]
        sin: Callable[[], Expression]
        cos: Callable[[], Expression]
        tan: Callable[[], Expression]
        asin: Callable[[], Expression]
        acos: Callable[[], Expression]
        atan: Callable[[], Expression]
        arcsin: Callable[[], Expression]
        arccos: Callable[[], Expression]
        arctan: Callable[[], Expression]
        sinh: Callable[[], Expression]
        cosh: Callable[[], Expression]
        tanh: Callable[[], Expression]
        ceil: Callable[[], Expression]
        floor: Callable[[], Expression]

    def __add__(self, other: Symbolic) -> Expression:
        e = other if other.__class__ is _Expression else _build.as_expression(other)
        own = self if self.__class__ is _Expression else self._expression or _build.variable(self)
        return NotImplemented if e is None else _build.add(own, e)

    def __radd__(self, other: Symbolic) -> Expression:
        e = other if other.__class__ is _Expression else _build.as_expression(other)
        own = self if self.__class__ is _Expression else self._expression or _build.variable(self)
        return NotImplemented if e is None else _build.add(e, own)

    def __sub__(self, other: Symbolic) -> Expression:
        e = other if other.__class__ is _Expression else _build.as_expression(other)
        own = self if self.__class__ is _Expression else self._expression or _build.variable(self)
        return NotImplemented if e is None else _build.subtract(own, e)

    def __rsub__(self, other: Symbolic) -> Expression:
        e = other if other.__class__ is _Expression else _build.as_expression(other)
        own = self if self.__class__ is _Expression else self._expression or _build.variable(self)
        return NotImplemented if e is None else _build.subtract(e, own)

    def __mul__(self, other: Symbolic) -> Expression:
        if other.__class__ is float and other - other == 0.0 and other != -1.0:  # most frequent: no node is made
            return _build.scale(
                other, self if self.__class__ is _Expression else self._expression or _build.variable(self)
            )
        e = other if other.__class__ is _Expression else _build.as_expression(other)
        own = self if self.__class__ is _Expression else self._expression or _build.variable(self)
        return NotImplemented if e is None else _build.multiply(own, e)

    def __rmul__(self, other: Symbolic) -> Expression:
        if other.__class__ is float and other - other == 0.0 and other != -1.0:
            return _build.scale(
                other, self if self.__class__ is _Expression else self._expression or _build.variable(self)
            )
        e = other if other.__class__ is _Expression else _build.as_expression(other)
        own = self if self.__class__ is _Expression else self._expression or _build.variable(self)
        return NotImplemented if e is None else _build.multiply(e, own)

    def __truediv__(self, other: Symbolic) -> Expression:
        e = other if other.__class__ is _Expression else _build.as_expression(other)
        own = self if self.__class__ is _Expression else self._expression or _build.variable(self)
        return NotImplemented if e is None else _build.divide(own, e)

    def __rtruediv__(self, other: Symbolic) -> Expression:
        e = other if other.__class__ is _Expression else _build.as_expression(other)
        own = self if self.__class__ is _Expression else self._expression or _build.variable(self)
        return NotImplemented if e is None else _build.divide(e, own)

    def __pow__(self, other: Symbolic) -> Expression:
        e = other if other.__class__ is _Expression else _build.as_expression(other)
        own = self if self.__class__ is _Expression else self._expression or _build.variable(self)
        return NotImplemented if e is None else _build.power(own, e)

    def __neg__(self) -> Expression:
        return _build.negate(_build.as_expression(self))

    def __pos__(self) -> Expression:
        return _build.as_expression(self)

    def __abs__(self) -> Expression:
        return _build.unary(_k.ABS, _build.as_expression(self))

    def __eq__(self, other: object) -> Formula:  # type: ignore[override]
        return _compare("==", self, other)

    def __ne__(self, other: object) -> Formula:  # type: ignore[override]
        return _compare("!=", self, other)

    def __lt__(self, other: Symbolic) -> Formula:
        return _compare("<", self, other)

    def __le__(self, other: Symbolic) -> Formula:
        return _compare("<=", self, other)

    def __gt__(self, other: Symbolic) -> Formula:
        return _compare(">", self, other)

    def __ge__(self, other: Symbolic) -> Formula:
        return _compare(">=", self, other)

    def pow(self, exponent: Symbolic) -> Expression:
        """Returns this to the power `exponent`."""
        return _build.power(_build.as_expression(self), _build.expect("pow", exponent))

    def atan2(self, x: Symbolic) -> Expression:
        """Returns the angle [rad] of the point (x, self)."""
        return _build.binary(_k.ATAN2, _build.as_expression(self), _build.expect("atan2", x))

    def min(self, other: Symbolic) -> Expression:
        """Returns the smaller of the two."""
        return _build.binary(_k.MIN, _build.as_expression(self), _build.expect("min", other))

    def max(self, other: Symbolic) -> Expression:
        """Returns the larger of the two."""
        return _build.binary(_k.MAX, _build.as_expression(self), _build.expect("max", other))


def _compare(operator: str, a: Operators, b: object) -> Formula:
    e = _build.as_expression(b)
    return NotImplemented if e is None else _formula.compare(operator, _build.as_expression(a), e)


def _unary(kind: int, name: str) -> Callable[[Operators], Expression]:
    def method(self: Operators) -> Expression:
        return _build.unary(kind, _build.as_expression(self))

    method.__name__ = name
    method.__qualname__ = f"Operators.{name}"
    method.__doc__ = f"Returns {name} of this."
    return method


for _kind, _name in _k.UNARY_NAMES.items():
    setattr(Operators, _name, _unary(_kind, _name))
for _alias, _name in (("arcsin", "asin"), ("arccos", "acos"), ("arctan", "atan"), ("arctan2", "atan2")):
    setattr(Operators, _alias, getattr(Operators, _name))
Operators.__ceil__ = Operators.ceil  # type: ignore[attr-defined]
Operators.__floor__ = Operators.floor  # type: ignore[attr-defined]
