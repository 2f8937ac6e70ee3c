"""Costs and constraints on Bézier curves r(s), s in [0, 1], that are traversed in a time h."""

from __future__ import annotations

import math

import numpy as np

from sheldrake.solvers import Constraint
from sheldrake.solvers._functions.evaluators import EvaluatorBase


def derivative_matrix(order: int, derivative: int) -> np.ndarray:
    """Control points of a derivative from those of a Bézier curve, shape (order + 1 - derivative, order + 1)."""
    D = np.eye(order + 1)
    for _ in range(derivative):
        D = D[1:] - D[:-1]
    return math.perm(order, derivative) * D


class NonlinearDerivativeConstraint(Constraint):
    """lb h^N <= control points of the N-th derivative of r <= ub h^N, of one coordinate; variables (r, h)."""

    def __init__(self, D: np.ndarray, lb: float, ub: float, derivative: int):
        self._D, self._lb, self._ub, self._power = D, lb, ub, derivative
        count = 2 * len(D)
        self._set_sizes(count, D.shape[1] + 1)
        self._set_bounds(np.zeros(count), np.full(count, np.inf))

    def _values(self, x: np.ndarray) -> np.ndarray:
        d, scale = self._D @ x[:-1], x[-1] ** self._power
        return np.concatenate((d - self._lb * scale, self._ub * scale - d))

    _eval = _eval_duals = _eval_symbols = _values
    _display = EvaluatorBase._display
    _latex = EvaluatorBase._latex


class NonlinearContinuityConstraint(Constraint):
    """The N-th time derivatives of one coordinate agree where one curve ends and the next starts.

    Variables (r_u, h_u, r_v, h_v); the value is r_u^(N)(1) h_v^N - r_v^(N)(0) h_u^N, which is zero.
    """

    def __init__(self, last: np.ndarray, first: np.ndarray, derivative: int):
        self._last, self._first, self._power = last, first, derivative
        self._set_sizes(1, last.size + first.size + 2)
        self._set_bounds(np.zeros(1), np.zeros(1))

    def _values(self, x: np.ndarray) -> np.ndarray:
        n = self._last.size
        u, h_u, v, h_v = x[:n], x[n], x[n + 1 : -1], x[-1]
        return np.array([(self._last @ u) * h_v**self._power - (self._first @ v) * h_u**self._power])

    _eval = _eval_duals = _eval_symbols = _values
    _display = EvaluatorBase._display
    _latex = EvaluatorBase._latex
