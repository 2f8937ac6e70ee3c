"""AutoDiffXd: a float and the vector of its partial derivatives."""

from __future__ import annotations

import math

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._ieee import divide, power, real

_REAL = (float, int, np.floating, np.integer, np.bool_)
_EMPTY = np.zeros(0)


def _scaled(d, s: float):
    """d * s; None stands for empty derivatives; quiet about 0 * inf."""
    if d is None:
        return None
    if s - s == 0.0:
        return d * s
    with np.errstate(all="ignore"):
        return d * s


def _sum(a, b):
    if a is None:
        return b
    if b is None:
        return a
    if a.size != b.size:
        raise _sizes_differ(a, b)
    return a + b


def _sizes_differ(a, b) -> RuntimeError:
    return RuntimeError(
        f"AutoDiffXd: the operands carry {a.size} and {b.size} derivatives; "
        "they must have the same number, or one of them none."
    )


def _make(value: float, d):
    out = _new(AutoDiffXd)
    out._v = value
    out._d = d
    return out


class AutoDiffXd:
    """A scalar with its partial derivatives with respect to some chosen variables.

    A number with no derivatives at all (an *empty* vector) is a constant and mixes with every other one; otherwise
    operands must have the same number of derivatives. NumPy arrays hold these numbers with `dtype=object`, and
    NumPy's functions (`np.sin`, `np.dot`, `np.linalg.norm` ...) work on such arrays.

    Args:
        value: The number itself.
        derivatives: Its partial derivatives, shape `(n,)`.
        size: Instead of `derivatives`: how many partial derivatives there are ...
        offset: ... and which of them is one; the others are zero.

    Raises:
        TypeError: if the arguments are neither `(value)`, `(value, derivatives)` nor `(value, size, offset)`.
    """

    __slots__ = ("_d", "_v")
    __array_priority__ = -1.0  # more than NumPy's scalars have, which then leave operators to us, and less than arrays
    _d: np.ndarray | None
    _v: float
    __hash__ = None  # type: ignore[assignment]

    def __init__(self, value, derivatives=None, offset=None, *, size=None):
        if not isinstance(value, _REAL):
            if not isinstance(value, np.ndarray) or value.ndim or value.dtype == object:
                raise _bad_constructor(value, derivatives, offset, size)
            value = value.item()
        if size is None and offset is not None:
            size, derivatives = derivatives, None
        d = None
        if size is not None:
            if derivatives is not None or not _is_count(size) or not _is_count(offset):
                raise _bad_constructor(value, derivatives, offset, size)
            d = np.zeros(int(size))
            if 0 <= offset < d.size:
                d[int(offset)] = 1.0
        elif derivatives is not None:
            d = _as_derivatives(derivatives)
            if d is None:
                raise _bad_constructor(value, derivatives, offset, size)
        self._v = float(value)
        self._d = d if d is not None and d.size else None

    def value(self) -> float:
        """Returns the number without its derivatives."""
        return self._v

    def derivatives(self) -> np.ndarray:
        """Returns a copy of the partial derivatives, shape `(n,)`; `(0,)` for a constant."""
        return _EMPTY.copy() if self._d is None else self._d.copy()

    # Arithmetic

    def __add__(self, other):
        if other.__class__ is AutoDiffXd:
            return _make(self._v + other._v, _sum(self._d, other._d))
        if isinstance(other, _REAL):
            return _make(self._v + float(other), self._d)
        return NotImplemented

    def __radd__(self, other):
        if isinstance(other, _REAL):
            return _make(float(other) + self._v, self._d)
        return NotImplemented

    def __sub__(self, other):
        if other.__class__ is AutoDiffXd:
            a, b = self._d, other._d
            if b is not None:
                if a is None:
                    a = -b
                elif a.size == b.size:
                    a = a - b
                else:
                    raise _sizes_differ(a, b)
            return _make(self._v - other._v, a)
        if isinstance(other, _REAL):
            return _make(self._v - float(other), self._d)
        return NotImplemented

    def __rsub__(self, other):
        if isinstance(other, _REAL):
            return _make(float(other) - self._v, None if self._d is None else -self._d)
        return NotImplemented

    def __mul__(self, other):
        if other.__class__ is AutoDiffXd:
            return _make(self._v * other._v, _sum(_scaled(self._d, other._v), _scaled(other._d, self._v)))
        if isinstance(other, _REAL):
            other = float(other)
            return _make(self._v * other, _scaled(self._d, other))
        return NotImplemented

    def __rmul__(self, other):
        if isinstance(other, _REAL):
            other = float(other)
            return _make(other * self._v, _scaled(self._d, other))
        return NotImplemented

    def __truediv__(self, other):
        if other.__class__ is AutoDiffXd:
            b = other._v
            if other._d is None:
                return _make(divide(self._v, b), _scaled(self._d, divide(1.0, b)))
            # (a'b - ab') / b^2, in this order so that division by zero gives the signs IEEE arithmetic gives.
            numerator = _sum(_scaled(self._d, b), _scaled(other._d, -self._v))
            return _make(divide(self._v, b), _scaled(numerator, divide(1.0, b * b)))
        if isinstance(other, _REAL):
            other = float(other)
            return _make(divide(self._v, other), _scaled(self._d, divide(1.0, other)))
        return NotImplemented

    def __rtruediv__(self, other):
        if isinstance(other, _REAL):
            other, b = float(other), self._v
            return _make(divide(other, b), _scaled(self._d, divide(-other, b * b)))
        return NotImplemented

    def __neg__(self):
        return _make(-self._v, None if self._d is None else -self._d)

    def __pos__(self):
        return self

    def __pow__(self, other):
        if isinstance(other, _REAL):
            return self._to_the(float(other))
        if other.__class__ is AutoDiffXd:
            value = power(self._v, other._v)
            d_base = None if self._d is None else _scaled(self._d, other._v * power(self._v, other._v - 1.0))
            d_exponent = None if other._d is None else _scaled(other._d, value * real("log", self._v))
            return _make(value, _sum(d_base, d_exponent))
        return NotImplemented

    def __rpow__(self, other):
        if isinstance(other, _REAL):
            value = power(float(other), self._v)
            return _make(value, None if self._d is None else _scaled(self._d, value * real("log", float(other))))
        return NotImplemented

    def __abs__(self):
        return -self if self._v < 0.0 else self

    # Comparisons look at values only.

    def __eq__(self, other):
        if other.__class__ is AutoDiffXd:
            return self._v == other._v
        return self._v == float(other) if isinstance(other, _REAL) else NotImplemented

    def __ne__(self, other):
        if other.__class__ is AutoDiffXd:
            return self._v != other._v
        return self._v != float(other) if isinstance(other, _REAL) else NotImplemented

    def __lt__(self, other):
        if other.__class__ is AutoDiffXd:
            return self._v < other._v
        return self._v < float(other) if isinstance(other, _REAL) else NotImplemented

    def __le__(self, other):
        if other.__class__ is AutoDiffXd:
            return self._v <= other._v
        return self._v <= float(other) if isinstance(other, _REAL) else NotImplemented

    def __gt__(self, other):
        if other.__class__ is AutoDiffXd:
            return self._v > other._v
        return self._v > float(other) if isinstance(other, _REAL) else NotImplemented

    def __ge__(self, other):
        if other.__class__ is AutoDiffXd:
            return self._v >= other._v
        return self._v >= float(other) if isinstance(other, _REAL) else NotImplemented

    # Functions. NumPy calls these methods for the elements of object arrays.

    def sin(self):
        """Returns the sine."""
        return self._chain(real("sin", self._v), lambda x, y: real("cos", x))

    def cos(self):
        """Returns the cosine."""
        return self._chain(real("cos", self._v), lambda x, y: -real("sin", x))

    def tan(self):
        """Returns the tangent."""
        return self._chain(real("tan", self._v), lambda x, y: 1.0 + y * y)

    def asin(self):
        """Returns the arc sine [rad]."""
        return self._chain(real("asin", self._v), lambda x, y: divide(1.0, real("sqrt", 1.0 - x * x)))

    def acos(self):
        """Returns the arc cosine [rad]."""
        return self._chain(real("acos", self._v), lambda x, y: divide(-1.0, real("sqrt", 1.0 - x * x)))

    def atan(self):
        """Returns the arc tangent [rad]."""
        return self._chain(real("atan", self._v), lambda x, y: 1.0 / (1.0 + x * x))

    def sinh(self):
        """Returns the hyperbolic sine."""
        return self._chain(real("sinh", self._v), lambda x, y: real("cosh", x))

    def cosh(self):
        """Returns the hyperbolic cosine."""
        return self._chain(real("cosh", self._v), lambda x, y: real("sinh", x))

    def tanh(self):
        """Returns the hyperbolic tangent."""
        return self._chain(real("tanh", self._v), lambda x, y: 1.0 - y * y)

    def exp(self):
        """Returns the exponential."""
        return self._chain(real("exp", self._v), lambda x, y: y)

    def log(self):
        """Returns the natural logarithm."""
        return self._chain(real("log", self._v), lambda x, y: divide(1.0, x))

    def sqrt(self):
        """Returns the square root."""
        return self._chain(real("sqrt", self._v), lambda x, y: divide(0.5, y))

    def abs(self):
        """Returns the absolute value; its slope at zero is taken as +1."""
        return abs(self)

    @checked
    def pow(self, exponent: float):
        """Returns this number raised to a float `exponent`."""
        if not isinstance(exponent, _REAL):
            return self.__pow__(exponent)
        return self._to_the(float(exponent))

    def _to_the(self, exponent: float):
        x, d = self._v, self._d
        return _make(power(x, exponent), None if d is None else _scaled(d, exponent * power(x, exponent - 1.0)))

    def atan2(self, x):
        """Returns the angle [rad] of the point (x, self)."""
        x = _as_autodiff("atan2", x)
        value = math.atan2(self._v, x._v)
        square = self._v * self._v + x._v * x._v
        d = _sum(_scaled(self._d, divide(x._v, square)), _scaled(x._d, divide(-self._v, square)))
        return _make(value, d)

    def max(self, other):
        """Returns the larger of the two; of equals this one, unless only the other has derivatives."""
        other = _as_autodiff("max", other)
        if self._v == other._v and self._d is None:
            return other
        return other if self._v < other._v else self

    def min(self, other):
        """Returns the smaller of the two; of equals this one, unless only the other has derivatives."""
        other = _as_autodiff("min", other)
        if self._v == other._v and self._d is None:
            return other
        return other if other._v < self._v else self

    def ceil(self) -> float:
        """Returns the smallest whole number not below, as a float."""
        return float(np.ceil(self._v))

    def floor(self) -> float:
        """Returns the largest whole number not above, as a float."""
        return float(np.floor(self._v))

    arcsin, arccos, arctan, arctan2 = asin, acos, atan, atan2
    __ceil__, __floor__ = ceil, floor

    def _chain(self, value, slope):
        d = self._d
        return _make(value, None if d is None else _scaled(d, slope(self._v, value)))

    # Copies, text

    def __copy__(self):
        return _make(self._v, self._d)

    def __deepcopy__(self, memo):
        return _make(self._v, None if self._d is None else self._d.copy())

    def __reduce__(self):
        return (AutoDiffXd, (self._v, self.derivatives()))

    def __str__(self):
        return f"AD{{{self._v!r}, nderiv={0 if self._d is None else self._d.size}}}"

    def __repr__(self):
        return f"<AutoDiffXd {self._v!r} nderiv={0 if self._d is None else self._d.size}>"


AutoDiffXd.__module__ = "sheldrake.autodiffutils"
_new = object.__new__


def _is_count(n) -> bool:
    return isinstance(n, (int, np.integer)) and not isinstance(n, bool) and bool(n >= 0)


def _as_derivatives(derivatives):
    try:
        d = np.array(derivatives, dtype=float)
    except (TypeError, ValueError):
        return None
    if d.ndim == 2 and d.shape[1] == 1:
        d = d[:, 0]
    return d if d.ndim == 1 else None


def _as_autodiff(call: str, x) -> AutoDiffXd:
    if x.__class__ is AutoDiffXd:
        return x
    if isinstance(x, _REAL):
        return _make(float(x), None)
    raise TypeError(f"AutoDiffXd.{call}(): expected an AutoDiffXd or a number, got {x!r} of type {type(x).__name__}.")


def _bad_constructor(value, derivatives, offset, size) -> TypeError:
    given = ", ".join(
        f"{name}={x!r}"
        for name, x in (("value", value), ("derivatives", derivatives), ("size", size), ("offset", offset))
        if x is not None
    )
    return TypeError(
        "AutoDiffXd(): expected (value), (value, derivatives of shape (n,)) or (value, size, offset) with numbers; "
        f"got {given}."
    )
