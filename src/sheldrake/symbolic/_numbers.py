"""The functions of expressions on plain floats, with the checks of their domains."""

from __future__ import annotations

import math
from collections.abc import Callable

from sheldrake.common import _ieee as ieee
from sheldrake.symbolic import _kinds as k


def text_of(x: float) -> str:
    """A float with the 17 digits that tell it from every other."""
    return f"{x:.17g}"


def _out_of_domain(call: str, x: float, domain: str) -> ValueError:
    return ValueError(f"{call} : numerical argument out of domain. {x:g} is not in {domain}")


def _log(x: float) -> float:
    if x < 0.0:
        raise _out_of_domain(f"log({x:g})", x, "[0, +oo)")
    return math.log(x) if x > 0.0 else -math.inf


def _sqrt(x: float) -> float:
    if x < 0.0:
        raise _out_of_domain(f"sqrt({x:g})", x, "[0, +oo)")
    return math.sqrt(x)


def _asin(x: float) -> float:
    if not -1.0 <= x <= 1.0:
        raise _out_of_domain(f"asin({x:g})", x, "[-1.0, +1.0]")
    return math.asin(x)


def _acos(x: float) -> float:
    if not -1.0 <= x <= 1.0:
        raise _out_of_domain(f"acos({x:g})", x, "[-1.0, +1.0]")
    return math.acos(x)


def power(a: float, b: float) -> float:
    """a to the power b.

    Raises:
        ValueError: a negative base has a fractional exponent.
    """
    if a < 0.0 and math.isfinite(a) and math.isfinite(b) and b != math.floor(b):
        raise ValueError(
            f"pow({a:g}, {b:g}) : numerical argument out of domain. {a:g} is finite negative and {b:g} is finite "
            "non-integer."
        )
    return ieee.power(a, b)


def divide(a: float, b: float) -> float:
    """a / b.

    Raises:
        RuntimeError: b is zero.
    """
    if b == 0.0:
        raise RuntimeError(f"Division by zero: {a:g}/{b:g}")
    return a / b


UNARY: dict[int, Callable[[float], float]] = {
    k.LOG: _log,
    k.ABS: abs,
    k.EXP: ieee.quiet("exp"),
    k.SQRT: _sqrt,
    k.SIN: ieee.quiet("sin"),
    k.COS: ieee.quiet("cos"),
    k.TAN: ieee.quiet("tan"),
    k.ASIN: _asin,
    k.ACOS: _acos,
    k.ATAN: math.atan,
    k.SINH: ieee.quiet("sinh"),
    k.COSH: ieee.quiet("cosh"),
    k.TANH: math.tanh,
    k.CEIL: ieee.quiet("ceil"),
    k.FLOOR: ieee.quiet("floor"),
}

BINARY: dict[int, Callable[[float, float], float]] = {
    k.POW: power,
    k.ATAN2: math.atan2,
    k.MIN: lambda a, b: b if b < a else a,
    k.MAX: lambda a, b: b if a < b else a,
}
