"""Bounds on the least or greatest of many values as one smooth constraint."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from sheldrake.autodiffutils import AutoDiffXd
from sheldrake.solvers import _arrays
from sheldrake.solvers._functions.evaluators import Constraint, Opaque, WithSlopes

Penalty: TypeAlias = "Callable[[float, bool], tuple]"  # of a value, with its slope if wanted


def quadratically_smoothed_hinge(x: float, with_slope: bool) -> tuple[float, float]:
    """0 for x >= 0, x^2 / 2 for -1 < x < 0, -1/2 - x for x <= -1, and its derivative."""
    if x >= 0.0:
        return 0.0, 0.0
    return (-0.5 - x, -1.0) if x <= -1.0 else (0.5 * x * x, x)


def smooth_over_max(x: list[float], zeros: int, alpha: float) -> tuple[float, list[float]]:
    """log(sum exp(alpha x)) / alpha of x and so many zeros, never below the largest; and its derivatives by x."""
    top = max([0.0, *x] if zeros else x)
    w = [math.exp(alpha * (v - top)) for v in x]
    total = sum(w) + (zeros * math.exp(-alpha * top) if zeros else 0.0)
    return top + math.log(total) / alpha, [v / total for v in w]


def smooth_under_max(x: list[float], zeros: int, alpha: float) -> tuple[float, list[float]]:
    """Mean of x and so many zeros weighed with exp(alpha x), never above the largest; and its derivatives by x."""
    top = max([0.0, *x] if zeros else x)
    w = [math.exp(alpha * (v - top)) for v in x]
    total = sum(w) + (zeros * math.exp(-alpha * top) if zeros else 0.0)
    mean = sum(a * v for a, v in zip(w, x)) / total
    return mean, [a / total * (1.0 + alpha * (v - mean)) for a, v in zip(w, x)]


class _MinimumValueConstraint(Opaque, WithSlopes, Constraint):
    """Smooth function of penalties of values; the values come from a user."""

    _thread_safe = False
    _lower_kind = True
    _alpha = 100.0
    _penalty: Penalty

    def _set_up(
        self,
        num_vars: int,
        bound: float,
        offset: float,
        max_num_values: int,
        values: Callable,
        floats: Callable | None,
        penalty: Penalty | None = None,
    ) -> None:
        if not math.isfinite(offset) or offset <= 0.0:
            raise RuntimeError(f"{type(self).__name__}: influence_value_offset must be positive and finite: {offset}.")
        self._bound, self._influence, self._max_num_values = float(bound), float(bound) + float(offset), max_num_values
        self._values, self._floats = values, floats
        self._set_sizes(1, int(num_vars))
        self.set_penalty_function(quadratically_smoothed_hinge if penalty is None else penalty)

    def _scale_to_penalty(self) -> None:
        """The value 1 is where exactly one value is at its bound."""
        self._factor = 1.0 / self._penalty_of(self._bound)[0]
        if self._lower_kind:
            self._set_bounds(np.array([-np.inf]), np.array([1.0]))
        else:
            self._set_bounds(np.array([1.0]), np.array([np.inf]))

    def _penalty_of(self, value: float) -> tuple[float, float]:
        width = self._influence - self._bound
        p, slope = self._penalty((value - self._influence) / width, True)
        return float(p), float(slope) / width

    def influence_value(self) -> float:
        """Returns the value above which others do not count."""
        return self._influence

    def set_penalty_function(self, new_penalty_function: Penalty) -> None:
        """Sets the function `(x, compute_grad) -> (penalty, slope)`, decreasing to 0 at x >= 0."""
        self._penalty = new_penalty_function
        self._scale_to_penalty()

    def _combine(self, values: np.ndarray) -> tuple[float, np.ndarray]:
        """Value of the constraint and its derivatives by the values; those that were not given do not count."""
        near = [(i, *self._penalty_of(v)) for i, v in enumerate(values.tolist()) if v < self._influence]
        slopes = np.zeros(len(values))
        if self._max_num_values == 0 and not near:
            return 0.0, slopes
        smooth = smooth_over_max if self._lower_kind else smooth_under_max
        missing = max(0, self._max_num_values - len(near))
        value, weights = smooth([p * self._factor for _, p, _ in near], missing, self._alpha)
        for (i, _, slope), weight in zip(near, weights):
            slopes[i] = slope * self._factor * weight
        return value, slopes

    def _eval(self, x: np.ndarray) -> np.ndarray:
        if self._floats is not None:
            values = np.atleast_1d(np.asarray(self._floats(x, self._influence), dtype=float))
        else:
            values = _arrays.values_and_gradient(np.atleast_1d(self._values(_as_duals(x), self._influence)))[0]
        return np.array([self._combine(values)[0]])

    def _eval_with_jacobian(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        values, J = self._values_with_jacobian(x)
        y, slope = self._combine(values)
        return np.array([y]), (slope @ J).reshape(1, -1) if J.size else np.zeros((1, len(x)))

    def _values_with_jacobian(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return _arrays.values_and_gradient(np.atleast_1d(self._values(_arrays.variables_at(x), self._influence)))


def _as_duals(x: np.ndarray) -> np.ndarray:
    out = np.empty(len(x), dtype=object)
    out[:] = [AutoDiffXd(float(v)) for v in x]
    return out


class MinimumValueLowerBoundConstraint(_MinimumValueConstraint):
    """The least of many values is at least a bound.

    Args:
        num_vars: Number of variables.
        minimum_value_lower: The bound.
        influence_value_offset: Values above the bound plus this do not count.
        max_num_values: Most values that the functions return.
        value_function: `(x, influence_value) -> values` for AutoDiffXd.
        value_function_double: The same for floats.
    """

    def __init__(
        self,
        num_vars: int,
        minimum_value_lower: float,
        influence_value_offset: float,
        max_num_values: int,
        value_function: Callable,
        value_function_double: Callable | None = None,
    ):
        self._set_up(
            num_vars, minimum_value_lower, influence_value_offset, max_num_values, value_function, value_function_double
        )

    def minimum_value_lower(self) -> float:
        """Returns the bound."""
        return self._bound


class MinimumValueUpperBoundConstraint(_MinimumValueConstraint):
    """The least of many values is at most a bound.

    Args:
        num_vars: Number of variables.
        minimum_value_upper: The bound.
        influence_value_offset: Values above the bound plus this do not count.
        max_num_values: Most values that the functions return.
        value_function: `(x, influence_value) -> values` for AutoDiffXd.
        value_function_double: The same for floats.
    """

    _lower_kind = False

    def __init__(
        self,
        num_vars: int,
        minimum_value_upper: float,
        influence_value_offset: float,
        max_num_values: int,
        value_function: Callable,
        value_function_double: Callable | None = None,
    ):
        self._set_up(
            num_vars, minimum_value_upper, influence_value_offset, max_num_values, value_function, value_function_double
        )

    def minimum_value_upper(self) -> float:
        """Returns the bound."""
        return self._bound
