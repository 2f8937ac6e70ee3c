"""Arithmetic of floats that never raises: nan and infinities as IEEE 754, and C, have them where Python raises."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

_NUMPY_NAMES = {"asin": "arcsin", "acos": "arccos", "atan": "arctan"}


def quiet(name: str) -> Callable[[float], float]:
    """`math.<name>`, with an answer for every float."""
    of_math, of_numpy = getattr(math, name), getattr(np, _NUMPY_NAMES.get(name, name))

    def function(x: float) -> float:
        try:
            return float(of_math(x))
        except (ValueError, OverflowError):
            with np.errstate(all="ignore"):
                return float(of_numpy(np.float64(x)))

    return function


def divide(a: float, b: float) -> float:
    """a / b."""
    try:
        return a / b
    except ZeroDivisionError:
        with np.errstate(all="ignore"):
            return float(np.float64(a) / np.float64(b))


def power(a: float, b: float) -> float:
    """a to the power b."""
    try:
        return math.pow(a, b)
    except (ValueError, OverflowError):
        with np.errstate(all="ignore"):
            return float(np.power(np.float64(a), np.float64(b)))
