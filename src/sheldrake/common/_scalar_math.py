"""Mathematics on numbers of any scalar type: functions, choices and comparisons."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from sheldrake.common._scalars import home_of, is_symbolic


def sqrt(x: Any) -> Any:
    """Square root; nan for a negative float."""
    if isinstance(x, float):
        return math.sqrt(x) if x >= 0 else math.nan
    return x.sqrt()


def sin(x: Any) -> Any:
    """Sine."""
    return _trigonometric(math.sin, x) if isinstance(x, float) else x.sin()


def cos(x: Any) -> Any:
    """Cosine."""
    return _trigonometric(math.cos, x) if isinstance(x, float) else x.cos()


def _trigonometric(function: Callable[[float], float], x: float) -> float:
    return function(x) if math.isfinite(x) else math.nan


def acos(x: Any) -> Any:
    """Arc cosine."""
    if isinstance(x, float):
        return math.acos(x) if -1.0 <= x <= 1.0 else math.nan
    return x.acos() if hasattr(x, "acos") else x.arccos()


def atan2(y: Any, x: Any) -> Any:
    """Angle of the point (x, y) [rad]."""
    if isinstance(y, float) and isinstance(x, float):
        return math.atan2(y, x)
    y = y if not isinstance(y, float) else type(x)(y)
    return y.atan2(x) if hasattr(y, "atan2") else y.arctan2(x)


def select(condition: Any, yes: Callable[[], Any], no: Callable[[], Any]) -> Any:
    """`yes()` or `no()`; on a formula both, joined by `if_then_else`, tuple by tuple."""
    if isinstance(condition, (bool, np.bool_)):
        return yes() if condition else no()
    if_then_else = home_of("Expression").if_then_else
    a, b = yes(), no()
    if isinstance(a, tuple):
        return tuple(if_then_else(condition, x, y) for x, y in zip(a, b))
    return if_then_else(condition, a, b)


def all_of(conditions: Any) -> Any:
    """Conjunction of comparisons; a formula where they are formulas."""
    result: Any = True
    for condition in conditions:
        if isinstance(condition, (bool, np.bool_)):
            if not condition:
                return False
        elif result is True:
            result = condition
        else:
            result = home_of("Expression").logical_and(result, condition)
    return result


def all_equal(a: np.ndarray, b: np.ndarray, T: type) -> Any:
    """Whether two arrays are equal number by number; a Formula for expressions."""
    if T is float:
        return bool((a == b).all())
    result = all_of(x == y for x, y in zip(a.ravel().tolist(), b.ravel().tolist()))
    return _formula(result) if is_symbolic(T) else bool(result)


def _formula(condition: Any) -> Any:
    if isinstance(condition, (bool, np.bool_)):
        Formula = home_of("Expression").Formula
        return Formula.True_() if condition else Formula.False_()
    return condition


def at_most(value: Any, bound: float, T: type) -> Any:
    """`value <= bound`, as a bool or a Formula."""
    result = value <= bound
    return _formula(result) if is_symbolic(T) else bool(result)


def largest_magnitude(array: np.ndarray, T: type) -> Any:
    """The largest absolute value in an array; nan if it has one."""
    if T is float:
        return float(np.abs(array).max())
    numbers = [abs(x) for x in array.ravel().tolist()]
    if is_symbolic(T):
        return functools.reduce(home_of("Expression").max, numbers)
    return functools.reduce(lambda a, b: b if b > a else a, numbers)
