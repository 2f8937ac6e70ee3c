"""Gradients by finite differences."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from sheldrake.common._enums import BoundEnum
from sheldrake.math._matrices import float_vector

__all__ = ["ComputeNumericalGradient", "NumericalGradientMethod", "NumericalGradientOption"]


class NumericalGradientMethod(BoundEnum):
    """Where the function is evaluated: ahead, behind, or on both sides."""

    kForward = 0
    kBackward = 1
    kCentral = 2


_Method = NumericalGradientMethod
_cbrt = getattr(math, "cbrt", np.cbrt)  # the C library's, whose last bit Drake has, from Python 3.11 on


class NumericalGradientOption:
    """How `ComputeNumericalGradient` steps."""

    def __init__(self, method: NumericalGradientMethod, function_accuracy: float = 1e-15):
        """
        Args:
            method: Where the function is evaluated.
            function_accuracy: Relative accuracy of the function, which decides the step.
        """
        self._method = method
        # With error e of the function, a step h costs e/h + h (one-sided) or e/h + h^2 (both sides): balance them.
        accuracy = float(function_accuracy)
        self._perturbation_size = float(_cbrt(accuracy) if method is _Method.kCentral else math.sqrt(accuracy))

    def NumericalGradientMethod(self) -> _Method:
        """Where the function is evaluated."""
        return self._method

    def perturbation_size(self) -> float:
        """The step, relative to the variable where that is larger than one."""
        return self._perturbation_size

    def __repr__(self) -> str:
        return f"<NumericalGradientOption({self._method!r})>"


_FORWARD = NumericalGradientOption(_Method.kForward)


def ComputeNumericalGradient(
    calc_func: Callable[[np.ndarray], Any], x: np.ndarray, option: NumericalGradientOption = _FORWARD
) -> np.ndarray:
    """Partial derivatives of a function of several variables, shape (outputs, variables).

    Args:
        calc_func: Gives an array of shape (outputs,) for one of shape (variables,).
        x: Where, shape (variables,).
        option: How to step.

    Raises:
        RuntimeError: the function gives no vector.
    """
    x = float_vector("ComputeNumericalGradient", x=x)
    method = option.NumericalGradientMethod()

    def at(point: np.ndarray) -> np.ndarray:
        y = np.asarray(calc_func(point.copy()), dtype=float)
        if y.ndim == 0 or y.size != len(y):
            raise RuntimeError(f"ComputeNumericalGradient(): calc_func gives shape {y.shape}; it must give a vector.")
        return y.reshape(-1)

    center = None if method is _Method.kCentral else at(x)
    columns = []
    for i in range(len(x)):
        h = option.perturbation_size() * max(1.0, abs(x[i]))
        ahead, behind = x.copy(), x.copy()
        if method is not _Method.kBackward:
            ahead[i] += h
        if method is not _Method.kForward:
            behind[i] -= h
        y_ahead = center if method is _Method.kBackward else at(ahead)
        y_behind = center if method is _Method.kForward else at(behind)
        columns.append((y_ahead - y_behind) / (ahead[i] - behind[i]))  # type: ignore[operator]
    return np.column_stack(columns)
