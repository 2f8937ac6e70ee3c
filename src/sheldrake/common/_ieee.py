"""Arithmetic of floats that never raises: nan and infinities as IEEE 754, and C, have them where Python raises."""

import math

import numpy as np

_NUMPY_NAMES = {"asin": "arcsin", "acos": "arccos", "atan": "arctan"}


def real(name: str, x: float) -> float:
    """`math.<name>(x)`."""
    try:
        return float(getattr(math, name)(x))
    except (ValueError, OverflowError):
        with np.errstate(all="ignore"):
            return float(getattr(np, _NUMPY_NAMES.get(name, name))(np.float64(x)))


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
