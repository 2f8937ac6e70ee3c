"""Elementary functions of a float, an AutoDiffXd or an Expression. Floats follow IEEE 754: nan and inf, no exceptions.

The functions have the names of C's library, so this module imports no builtin under those names.
"""

from __future__ import annotations

import builtins
import importlib
import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common import _ieee as ieee
from sheldrake.common._kernels import generic
from sheldrake.common._overloads import incompatible
from sheldrake.common._scalars import autodiff_class

if TYPE_CHECKING:
    from sheldrake.common._types import Scalar

__all__ = [
    "abs",
    "acos",
    "arccos",
    "arcsin",
    "arctan",
    "arctan2",
    "asin",
    "atan",
    "atan2",
    "ceil",
    "cos",
    "cosh",
    "exp",
    "floor",
    "isnan",
    "log",
    "max",
    "min",
    "pow",
    "sin",
    "sinh",
    "sqrt",
    "tan",
    "tanh",
    "wrap_to",
]

_REAL = (float, int, np.floating, np.integer, np.bool_)
_FLOAT, _DUAL, _SYMBOL = "float", "AutoDiffXd", "Expression"


def _kind(x: Scalar) -> str | None:
    if isinstance(x, _REAL):
        return _FLOAT
    if isinstance(x, autodiff_class()):
        return _DUAL
    return _SYMBOL if type(x).__module__.startswith("sheldrake.symbolic") else None


def _plain(x: Any) -> Any:
    """An array without dimensions as its number, all else as it is."""
    return x.item() if isinstance(x, np.ndarray) and x.ndim == 0 else x


def _symbolic(name: str, *args: Any) -> Any:
    return getattr(importlib.import_module("sheldrake.symbolic"), name)(*args)


def _refuse(name: str, *args: object) -> TypeError:
    return incompatible(name, ["(float)", "(AutoDiffXd)", "(Expression)"], args, {})


def _unary(name: str, what: str) -> Callable[[Any], Any]:
    exact, quiet = getattr(math, name), ieee.quiet(name)

    def function(x: Any, /) -> Any:
        if type(x) is float:
            try:
                return exact(x)
            except (ValueError, OverflowError):
                return quiet(x)
        x = _plain(x)
        kind = _kind(x)
        if kind is _FLOAT:
            return quiet(float(x))
        if kind is _DUAL:
            return getattr(x, name)()
        if kind is _SYMBOL:
            return _symbolic(name, x)
        raise _refuse(name, x)

    function.__name__ = function.__qualname__ = name
    function.__doc__ = f"{what} of a float, an AutoDiffXd or an Expression."
    return function


sin = _unary("sin", "Sine")
cos = _unary("cos", "Cosine")
tan = _unary("tan", "Tangent")
asin = arcsin = _unary("asin", "Arc sine")
acos = arccos = _unary("acos", "Arc cosine")
atan = arctan = _unary("atan", "Arc tangent")
sinh = _unary("sinh", "Hyperbolic sine")
cosh = _unary("cosh", "Hyperbolic cosine")
tanh = _unary("tanh", "Hyperbolic tangent")
exp = _unary("exp", "Exponential")
log = _unary("log", "Natural logarithm")
sqrt = _unary("sqrt", "Square root")


def abs(x: Any, /) -> Any:
    """Absolute value."""
    x = _plain(x)
    kind = _kind(x)
    if kind is _FLOAT:
        return math.fabs(x)
    if kind is None:
        raise _refuse("abs", x)
    return builtins.abs(x) if kind is _DUAL else _symbolic("abs", x)


def _rounded(name: str, x: Any) -> Any:
    x = _plain(x)
    kind = _kind(x)
    if kind is _FLOAT:
        return float(getattr(np, name)(np.float64(x)))
    if kind is _DUAL:
        return getattr(x, name)()
    if kind is _SYMBOL:
        return _symbolic(name, x)
    raise _refuse(name, x)


def ceil(x: Scalar, /) -> Any:
    """Smallest integer that is not less; a float for an AutoDiffXd."""
    return _rounded("ceil", x)


def floor(x: Scalar, /) -> Any:
    """Largest integer that is not more; a float for an AutoDiffXd."""
    return _rounded("floor", x)


def isnan(x: Any) -> Any:
    """Whether the value is not a number; a Formula for an Expression."""
    x = _plain(x)
    kind = _kind(x)
    if kind is _FLOAT:
        return math.isnan(x)
    if kind is _DUAL:
        return math.isnan(x.value())
    if kind is _SYMBOL:
        return _symbolic("isnan", x)
    raise _refuse("isnan", x)


def _pair(a: Any, b: Any) -> str | None:
    """The kind both can become."""
    kinds = {_kind(a), _kind(b)}
    if None in kinds or kinds == {_DUAL, _SYMBOL}:
        return None
    return next((kind for kind in (_DUAL, _SYMBOL) if kind in kinds), _FLOAT)


def _dual(x: Any) -> Any:
    return x if _kind(x) is _DUAL else autodiff_class()(float(x))


def max(a: Any, b: Any, /) -> Any:
    """The larger of two numbers."""
    a, b = _plain(a), _plain(b)
    kind = _pair(a, b)
    if kind is _FLOAT:
        a, b = float(a), float(b)
        return b if a < b else a
    if kind is _DUAL:
        return _dual(a).max(_dual(b))
    if kind is _SYMBOL:
        return _symbolic("max", a, b)
    raise _refuse("max", a, b)


def min(a: Any, b: Any, /) -> Any:
    """The smaller of two numbers."""
    a, b = _plain(a), _plain(b)
    kind = _pair(a, b)
    if kind is _FLOAT:
        a, b = float(a), float(b)
        return b if b < a else a
    if kind is _DUAL:
        return _dual(a).min(_dual(b))
    if kind is _SYMBOL:
        return _symbolic("min", a, b)
    raise _refuse("min", a, b)


def pow(base: Any, exponent: Any, /) -> Any:
    """`base` to the power of `exponent`; the exponent of an AutoDiffXd is a float."""
    base, exponent = _plain(base), _plain(exponent)
    kind = _pair(base, exponent)
    if kind is _FLOAT:
        return ieee.power(float(base), float(exponent))
    if kind is _DUAL and _kind(exponent) is _FLOAT:
        return base ** float(exponent)
    if kind is _SYMBOL:
        return _symbolic("pow", base, exponent)
    raise _refuse("pow", base, exponent)


def atan2(y: Any, x: Any) -> Any:
    """Angle of the point (x, y) [rad]."""
    y, x = _plain(y), _plain(x)
    kind = _pair(y, x)
    if kind is _FLOAT:
        return math.atan2(y, x)
    if kind is _DUAL:
        return _dual(y).atan2(_dual(x))
    if kind is _SYMBOL:
        return _symbolic("atan2", y, x)
    raise _refuse("atan2", y, x)


arctan2 = atan2


def wrap_to(value: Any, low: Scalar, high: Scalar) -> Any:
    """`value` plus a multiple of `high - low`, within [low, high).

    Args:
        value: Any number.
        low: Lower end, included.
        high: Upper end, not included; nothing is within an interval without length, nan.
    """
    span = high - low
    if isinstance(value, _REAL) and isinstance(span, _REAL):
        value, span = float(value), float(span)
        if span == 0.0:
            return math.nan
    return value - span * floor((value - low) / span)


def _stand_in_kernels(home: Any, functions: tuple[Any, ...]) -> None:
    for function in functions:
        function.in_kernels = getattr(home, function.__name__)


_stand_in_kernels(generic, (sin, cos, tan, asin, acos, atan, sinh, cosh, tanh, exp, log, sqrt, atan2))
_stand_in_kernels(builtins, (abs, max, min))
