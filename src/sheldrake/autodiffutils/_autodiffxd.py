"""AutoDiffXd: a float and the vector of its partial derivatives."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from sheldrake.autodiffutils._kernels import chain_rule
from sheldrake.common._checked import checked
from sheldrake.common._ieee import divide, power, quiet
from sheldrake.common.quick import Slots, short_way

if TYPE_CHECKING:
    from sheldrake.common.kernel import Kernel
    from sheldrake.common.quick import Form

_REAL = (float, int, np.floating, np.integer, np.bool_)
_EMPTY = np.zeros(0)
sin, cos, tan, asin, acos, atan, sinh, cosh, tanh, exp, log, sqrt = map(
    quiet, "sin cos tan asin acos atan sinh cosh tanh exp log sqrt".split()
)


class _Sized(dict):
    """Short ways of one rule, by the number of derivatives."""

    def __init__(self, kernel: Kernel, operands: int, factors: int):
        super().__init__()
        self._kernel, self._operands, self._factors = kernel, operands, factors

    def __missing__(self, size: int):
        dual = Slots(AutoDiffXd, {"_v": float, "_d": (size,)})
        takes: list[Form] = [*[dual] * self._operands, float, *[float] * self._factors]
        self[size] = short_way(self, size, self._kernel, *takes, gives=dual)
        return self[size]


def _chain(x, value: float, slope: float):
    """A function of x whose derivative is `slope`; None stands for empty derivatives; quiet about 0 * inf."""
    d = x._d
    if d is None:
        return _make(value, None)
    if (made := _chained[d.size](x, value, slope)) is not None:
        return made
    with np.errstate(all="ignore"):
        return _make(value, d * slope)


def _combine(a, b, value: float, by_a: float, by_b: float):
    """A function of a and b whose partial derivatives are `by_a` and `by_b`."""
    da, db = a._d, b._d
    if da is None:
        return _chain(b, value, by_b)
    if db is None:
        return _chain(a, value, by_a)
    if da.size != db.size:
        raise sizes_differ(da.size, db.size)
    if (made := _combined[da.size](a, b, value, by_a, by_b)) is not None:
        return made
    with np.errstate(all="ignore"):
        return _make(value, da * by_a + db * by_b)


def sizes_differ(m: int, n: int) -> RuntimeError:
    """The error for operands with different numbers of derivatives."""
    return RuntimeError(
        f"AutoDiffXd: the operands carry {m} and {n} derivatives; they must have the same number, or one of them none."
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
        if value.__class__ is float and derivatives is None is offset and size is None:  # most are constants
            self._v, self._d = value, None
            return
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
            return _combine(self, other, self._v + other._v, 1.0, 1.0)
        if isinstance(other, _REAL):
            return _make(self._v + float(other), self._d)
        return NotImplemented

    __radd__ = __add__

    def __sub__(self, other):
        if other.__class__ is AutoDiffXd:
            return _combine(self, other, self._v - other._v, 1.0, -1.0)
        if isinstance(other, _REAL):
            return _make(self._v - float(other), self._d)
        return NotImplemented

    def __rsub__(self, other):
        return _chain(self, float(other) - self._v, -1.0) if isinstance(other, _REAL) else NotImplemented

    def __mul__(self, other):
        if other.__class__ is AutoDiffXd:
            a, b = self._v, other._v
            return _combine(self, other, a * b, b, a)
        if isinstance(other, _REAL):
            other = float(other)
            return _chain(self, self._v * other, other)
        return NotImplemented

    __rmul__ = __mul__

    def __truediv__(self, other):
        if other.__class__ is AutoDiffXd:
            return self._over(other)
        if isinstance(other, _REAL):
            other = float(other)
            return _chain(self, divide(self._v, other), divide(1.0, other))
        return NotImplemented

    def _over(self, other):
        a, b = self._v, other._v
        if other._d is None:
            return _chain(self, divide(a, b), divide(1.0, b))
        # (a'b - ab') / b^2, in this order so that division by zero gives the signs IEEE arithmetic gives.
        return _chain(_combine(self, other, divide(a, b), b, -a), divide(a, b), divide(1.0, b * b))

    def __rtruediv__(self, other):
        if isinstance(other, _REAL):
            other, b = float(other), self._v
            return _chain(self, divide(other, b), divide(-other, b * b))
        return NotImplemented

    def __neg__(self):
        return _chain(self, -self._v, -1.0)

    def __pos__(self):
        return self

    def __pow__(self, other):
        if isinstance(other, _REAL):
            return self._to_the(float(other))
        if other.__class__ is AutoDiffXd:
            a, b = self._v, other._v
            value = power(a, b)
            by_base = 0.0 if self._d is None else b * power(a, b - 1.0)
            by_exponent = 0.0 if other._d is None else value * log(a)
            return _combine(self, other, value, by_base, by_exponent)
        return NotImplemented

    def __rpow__(self, other):
        if isinstance(other, _REAL):
            value = power(float(other), self._v)
            return _chain(self, value, value * log(float(other)))
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
        x = self._v
        return _chain(self, sin(x), cos(x))

    def cos(self):
        """Returns the cosine."""
        x = self._v
        return _chain(self, cos(x), -sin(x))

    def tan(self):
        """Returns the tangent."""
        y = tan(self._v)
        return _chain(self, y, 1.0 + y * y)

    def asin(self):
        """Returns the arc sine [rad]."""
        x = self._v
        return _chain(self, asin(x), divide(1.0, sqrt(1.0 - x * x)))

    def acos(self):
        """Returns the arc cosine [rad]."""
        x = self._v
        return _chain(self, acos(x), divide(-1.0, sqrt(1.0 - x * x)))

    def atan(self):
        """Returns the arc tangent [rad]."""
        x = self._v
        return _chain(self, atan(x), 1.0 / (1.0 + x * x))

    def sinh(self):
        """Returns the hyperbolic sine."""
        x = self._v
        return _chain(self, sinh(x), cosh(x))

    def cosh(self):
        """Returns the hyperbolic cosine."""
        x = self._v
        return _chain(self, cosh(x), sinh(x))

    def tanh(self):
        """Returns the hyperbolic tangent."""
        y = tanh(self._v)
        return _chain(self, y, 1.0 - y * y)

    def exp(self):
        """Returns the exponential."""
        y = exp(self._v)
        return _chain(self, y, y)

    def log(self):
        """Returns the natural logarithm."""
        x = self._v
        return _chain(self, log(x), divide(1.0, x))

    def sqrt(self):
        """Returns the square root."""
        y = sqrt(self._v)
        return _chain(self, y, divide(0.5, y))

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
        x = self._v
        return _chain(self, power(x, exponent), exponent * power(x, exponent - 1.0))

    def atan2(self, x):
        """Returns the angle [rad] of the point (x, self)."""
        x = _as_autodiff("atan2", x)
        square = self._v * self._v + x._v * x._v
        return _combine(self, x, math.atan2(self._v, x._v), divide(x._v, square), divide(-self._v, square))

    def max(self, other):
        """Returns the larger of the two; of equals this one if it has derivatives; the other if one is nan."""
        other = _as_autodiff("max", other)
        return self if self._v > other._v or (self._v == other._v and self._d is not None) else other

    def min(self, other):
        """Returns the smaller of the two; of equals this one if it has derivatives; the other if one is nan."""
        other = _as_autodiff("min", other)
        return self if self._v < other._v or (self._v == other._v and self._d is not None) else other

    def ceil(self) -> float:
        """Returns the smallest whole number not below, as a float."""
        return float(np.ceil(self._v))

    def floor(self) -> float:
        """Returns the largest whole number not above, as a float."""
        return float(np.floor(self._v))

    arcsin, arccos, arctan, arctan2 = asin, acos, atan, atan2
    __ceil__, __floor__ = ceil, floor

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
_chained, _combined = _Sized(chain_rule.chain, 1, 1), _Sized(chain_rule.combine, 2, 2)


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
