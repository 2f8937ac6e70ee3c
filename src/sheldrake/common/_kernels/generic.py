"""Maths that takes any scalar: floats, complex numbers, and objects that bring their own (duals, symbols).

Inside compiled kernels these are libm's. Anything else than a number is asked for a method of the same name.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable
from typing import Any

UNARY = ("sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "log", "sqrt")
_METHODS = {"asin": "arcsin", "acos": "arccos", "atan": "arctan"}


def _make(name: str) -> Callable[[Any], Any]:
    real, complex_, method = getattr(math, name), getattr(cmath, name), _METHODS.get(name, name)

    def function(x: Any) -> Any:
        if isinstance(x, (float, int)):
            return real(x)
        if isinstance(x, complex):
            return complex_(x)
        return getattr(x, method)()

    function.__name__ = function.__qualname__ = name
    function.__doc__ = f"{name} of a float, a complex number, or an object with a method `{method}`."
    return function


sin, cos, tan = _make("sin"), _make("cos"), _make("tan")
asin, acos, atan = _make("asin"), _make("acos"), _make("atan")
sinh, cosh, tanh = _make("sinh"), _make("cosh"), _make("tanh")
exp, log, sqrt = _make("exp"), _make("log"), _make("sqrt")


def sines_and_cosines(x: Any, n: int, s: Any, c: Any) -> None:
    """s[k], c[k] = sin(x[k]), cos(x[k]) of the first n numbers.

    Compiled, four are calculated at once where the vectors have room for a multiple of four, x with any numbers there.
    """
    for k in range(n):
        s[k], c[k] = sin(x[k]), cos(x[k])


def atan2(y: Any, x: Any) -> Any:
    """Angle of the point (x, y) [rad]; objects are asked for a method `arctan2`."""
    if isinstance(y, (float, int)) and isinstance(x, (float, int)):
        return math.atan2(y, x)
    return y.arctan2(x) if hasattr(y, "arctan2") else type(x)(y).arctan2(x)


def is_positive(x: Any) -> bool:
    """Whether a number is positive; what cannot be said before variables have values passes."""
    if isinstance(x, (float, int)) or not hasattr(x, "GetVariables"):
        return x > 0.0
    return bool(len(x.GetVariables())) or x.Evaluate() > 0.0


def is_zero(x: Any) -> bool:
    """Whether a number is zero; what cannot be said before variables have values is not."""
    if isinstance(x, (float, int)) or not hasattr(x, "GetVariables"):
        return x == 0.0
    return not len(x.GetVariables()) and x.Evaluate() == 0.0


def is_finite(x: Any) -> bool:
    """Whether a number is neither infinite nor NaN; what cannot be said before variables have values passes."""
    if isinstance(x, (float, int)):
        return math.isfinite(x)
    if isinstance(x, complex):
        return cmath.isfinite(x)
    if hasattr(x, "GetVariables"):
        return bool(len(x.GetVariables())) or math.isfinite(x.Evaluate())
    return math.isfinite(x.value())


def has_slopes(x: Any) -> bool:
    """Whether a number has derivatives: a complex number (see `sweep`) or a dual. Compiled, its kind tells."""
    return not isinstance(x, (float, int)) and (isinstance(x, complex) or hasattr(x, "derivatives"))


def in_any(condition: Any) -> bool:
    """Whether a condition holds; compiled for lanes, whether in one of them (see `common.kernel.LaneKernel`)."""
    return bool(condition)


def value_of(x: Any) -> Any:
    """A number without its derivatives."""
    if isinstance(x, (float, int, complex)):
        return x.real
    return x.value() if hasattr(x, "derivatives") else x


def whole(x: Any) -> int:
    """The largest whole number that is not above x, or above its real part or `value()`."""
    if isinstance(x, (float, int, complex)):
        return math.floor(x.real)
    return math.floor(x.value())


def clip(x: Any, low: float, high: float) -> Any:
    """The number between `low` and `high` that is nearest to x; an expression for expressions."""
    if hasattr(x, "GetVariables"):
        return type(x)(high).min(type(x)(low).max(x))
    return high if x > high else low if x < low else x


def mul_add(a: Any, b: Any, c: Any) -> Any:
    """a b + c; compiled, one instruction where the processor has it, which no other sum is put into a vector with."""
    return a * b + c


def floor(x: Any) -> Any:
    """The largest whole number that is not above x, as a float, or an expression of an expression; it has no slope."""
    if isinstance(x, (float, int, complex)):
        return float(math.floor(x.real))
    return x.floor()
