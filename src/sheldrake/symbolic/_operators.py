"""The operators that variables and expressions share."""

from __future__ import annotations

from typing import Any

from sheldrake.symbolic import _kinds as _k

_build: Any = None  # Both are modules that need the class below; the package binds them when all is loaded.
_formula: Any = None


class Operators:
    """Arithmetic gives expressions, comparison gives formulas. NumPy calls the methods for elements of arrays."""

    __slots__ = ()

    def __add__(self, other: Any) -> Any:
        e = _build.as_expression(other)
        return NotImplemented if e is None else _build.add(_build.as_expression(self), e)

    def __radd__(self, other: Any) -> Any:
        e = _build.as_expression(other)
        return NotImplemented if e is None else _build.add(e, _build.as_expression(self))

    def __sub__(self, other: Any) -> Any:
        e = _build.as_expression(other)
        return NotImplemented if e is None else _build.subtract(_build.as_expression(self), e)

    def __rsub__(self, other: Any) -> Any:
        e = _build.as_expression(other)
        return NotImplemented if e is None else _build.subtract(e, _build.as_expression(self))

    def __mul__(self, other: Any) -> Any:
        e = _build.as_expression(other)
        return NotImplemented if e is None else _build.multiply(_build.as_expression(self), e)

    def __rmul__(self, other: Any) -> Any:
        e = _build.as_expression(other)
        return NotImplemented if e is None else _build.multiply(e, _build.as_expression(self))

    def __truediv__(self, other: Any) -> Any:
        e = _build.as_expression(other)
        return NotImplemented if e is None else _build.divide(_build.as_expression(self), e)

    def __rtruediv__(self, other: Any) -> Any:
        e = _build.as_expression(other)
        return NotImplemented if e is None else _build.divide(e, _build.as_expression(self))

    def __pow__(self, other: Any) -> Any:
        e = _build.as_expression(other)
        return NotImplemented if e is None else _build.power(_build.as_expression(self), e)

    def __neg__(self) -> Any:
        return _build.negate(_build.as_expression(self))

    def __pos__(self) -> Any:
        return _build.as_expression(self)

    def __abs__(self) -> Any:
        return _build.unary(_k.ABS, _build.as_expression(self))

    def __eq__(self, other: Any) -> Any:
        return _compare("==", self, other)

    def __ne__(self, other: Any) -> Any:
        return _compare("!=", self, other)

    def __lt__(self, other: Any) -> Any:
        return _compare("<", self, other)

    def __le__(self, other: Any) -> Any:
        return _compare("<=", self, other)

    def __gt__(self, other: Any) -> Any:
        return _compare(">", self, other)

    def __ge__(self, other: Any) -> Any:
        return _compare(">=", self, other)

    def pow(self, exponent: Any) -> Any:
        """Returns this to the power `exponent`."""
        return _build.power(_build.as_expression(self), _build.expect("pow", exponent))

    def atan2(self, x: Any) -> Any:
        """Returns the angle [rad] of the point (x, self)."""
        return _build.binary(_k.ATAN2, _build.as_expression(self), _build.expect("atan2", x))

    def min(self, other: Any) -> Any:
        """Returns the smaller of the two."""
        return _build.binary(_k.MIN, _build.as_expression(self), _build.expect("min", other))

    def max(self, other: Any) -> Any:
        """Returns the larger of the two."""
        return _build.binary(_k.MAX, _build.as_expression(self), _build.expect("max", other))


def _compare(operator: str, a: Any, b: Any) -> Any:
    e = _build.as_expression(b)
    return NotImplemented if e is None else _formula.compare(operator, _build.as_expression(a), e)


def _unary(kind: int, name: str) -> Any:
    def method(self: Any) -> Any:
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
