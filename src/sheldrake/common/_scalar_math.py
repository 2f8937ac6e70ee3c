"""Mathematics on numbers of any scalar type: functions, choices and comparisons."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._scalars import home_of, is_symbolic

if TYPE_CHECKING:
    from sheldrake.common._types import Scalar


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
    """`yes()` or `no()`; on a formula that is neither true nor false both, joined by `if_then_else`, tuple by tuple.

    Where the condition is known, the other choice may not exist: it may divide by zero.
    """
    if isinstance(condition, (bool, np.bool_)):
        return yes() if condition else no()
    symbolic = home_of("Expression")
    if condition.get_kind() in (symbolic.FormulaKind.True_, symbolic.FormulaKind.False_):
        return yes() if condition.get_kind() is symbolic.FormulaKind.True_ else no()
    if_then_else = symbolic.if_then_else
    a, b = yes(), no()
    if isinstance(a, tuple):
        return tuple(if_then_else(condition, x, y) for x, y in zip(a, b))
    return if_then_else(condition, a, b)


def all_of(conditions: Iterable[Any]) -> Any:
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
    return as_condition(result, T)


def any_nan(array: np.ndarray, T: type) -> Any:
    """Whether a number of an array is NaN; a Formula for expressions."""
    if not is_symbolic(T):
        return any(bool(x != x) for x in array.flat)
    symbolic = home_of("Expression")
    return symbolic.logical_or(*(symbolic.isnan(x) for x in array.flat))


def as_condition(value: Any, T: type) -> Any:
    """What a test gives for a scalar type: a bool, for expressions a Formula."""
    if not is_symbolic(T):
        return bool(value)
    if isinstance(value, (bool, np.bool_)):
        Formula = home_of("Expression").Formula
        return Formula.True_() if value else Formula.False_()
    return value


def at_most(value: Scalar, bound: Any, T: type) -> Any:
    """`value <= bound`, as a bool or a Formula."""
    return as_condition(value <= bound, T)


def smaller(a: Scalar, b: Scalar, T: type) -> Scalar:
    """The smaller of two numbers."""
    return home_of("Expression").min(a, b) if is_symbolic(T) else min(a, b)


def largest_magnitude(array: np.ndarray, T: type) -> Any:
    """The largest absolute value in an array; nan if it has one."""
    if T is float:
        return float(np.abs(array).max())
    numbers = [abs(x) for x in array.ravel().tolist()]
    if is_symbolic(T):
        return functools.reduce(home_of("Expression").max, numbers)
    return functools.reduce(lambda a, b: b if b > a else a, numbers)
