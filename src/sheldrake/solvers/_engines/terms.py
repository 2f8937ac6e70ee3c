"""Costs and constraints that Python evaluates, in groups that are evaluated together, with sparse derivatives.

Each group has values; `places` says which row each is of, 0 for costs. Derivatives are lists of numbers whose rows and
columns never change, so that solvers lay out their matrices once.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from sheldrake.solvers._functions.evaluators import EvaluatorBase, Many
from sheldrake.solvers._kernels import quasi_newton


def without_nan(J: np.ndarray) -> np.ndarray:
    """Derivatives, those that are nan (of a length at zero, say) taken as zero."""
    flat = J.ravel()
    return np.where(np.isnan(J), 0.0, J) if math.isnan(flat.dot(flat)) else J


class Placed(NamedTuple):
    """An evaluator, the columns of its variables, and the rows of its values."""

    evaluator: Any
    columns: np.ndarray
    rows: np.ndarray


class Terms:
    """A group. Its Jacobian has entries at `(J_rows, J_cols)`."""

    J_rows: np.ndarray
    J_cols: np.ndarray
    places: np.ndarray

    def where_hessian(self) -> tuple[np.ndarray, np.ndarray]:
        """Rows and columns of the entries of the Hessian, both halves of it."""
        raise NotImplementedError

    def values(self, x: np.ndarray) -> np.ndarray:
        """Values at x, one for each of `places`."""
        raise NotImplementedError

    def slopes(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Values, and the entries of the Jacobian, of which some may be nan; nobody changes these arrays."""
        raise NotImplementedError

    def hessian(self, x: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """Entries of the Hessian of weights' values; where it is learned, from the points where this is asked.

        Some may be nan.
        """
        raise NotImplementedError

    def rough_hessian(self, x: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """The same by differences of gradients, which lengths near zero do not make as steep as they are there."""
        return self.hessian(x, weights)

    def add(self, rows: np.ndarray, values: np.ndarray) -> None:
        """Adds values to their rows, which for costs are all the same."""
        if not self.places.any():
            rows[0] += np.add.reduce(values)
        else:
            rows[self.places] += values


class FullTerms(Terms):
    """Points with as many variables and values each; each value depends on all variables of its point.

    Args:
        columns: Of the variables of each, shape (points, n).
        rows: Of the values of each, shape (points, m).
    """

    def __init__(self, columns: np.ndarray, rows: np.ndarray):
        m, n = rows.shape[1], columns.shape[1]
        self.places, self._columns = rows.ravel(), columns
        self.J_rows, self.J_cols = self.places.repeat(n), columns.repeat(m, axis=0).ravel()

    def where_hessian(self) -> tuple[np.ndarray, np.ndarray]:
        n = self._columns.shape[1]
        return self._columns.repeat(n), self._columns.repeat(n, axis=0).ravel()


_LOOK = 1e-6  # How far away a second gradient is taken, relative to variables above one.


class AlikeTerms(FullTerms):
    """Evaluators that differ by their variables alone.

    Args:
        many: Evaluates them.
        columns: Of the variables of each, shape (evaluators, n).
        rows: Of the values of each, shape (evaluators, m).
    """

    def __init__(self, many: Many, columns: np.ndarray, rows: np.ndarray):
        super().__init__(columns, rows)
        self._many, self._shape = many, rows.shape

    def values(self, x: np.ndarray) -> np.ndarray:
        return self._many.values(x[self._columns]).ravel()

    def slopes(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        values, J = self._many.slopes(x[self._columns])
        return values.ravel(), J.ravel()

    def hessian(self, x: np.ndarray, weights: np.ndarray) -> np.ndarray:
        return self._many.hessian(x[self._columns], weights.reshape(self._shape)).ravel()

    def rough_hessian(self, x: np.ndarray, weights: np.ndarray) -> np.ndarray:
        points, by_row = x[self._columns], weights.reshape(len(self._columns), 1, -1)
        slope = by_row @ self._many.slopes(points)[1]
        steps = _LOOK * np.maximum(1.0, np.abs(points))
        H = np.empty((len(points), points.shape[1], points.shape[1]))
        for j in range(points.shape[1]):
            moved = points.copy()
            moved[:, j] += steps[:, j]
            H[:, j] = (by_row @ self._many.slopes(moved)[1] - slope)[:, 0] / steps[:, j, None]
        return H.ravel()


class LearnedTerms(FullTerms):
    """Evaluators of which no more than first derivatives are known: points, and as many values at each.

    The Hessian of each value is learned from how gradients change from one point where it is asked for to the next (not
    those that were only tried), by symmetric rank one updates (Griewank and Toint, 1982; Conn, Gould and Toint, 1991):
    multipliers may change without making it stale, and many small Hessians are learned in few steps. Those of costs
    begin as a multiple of the identity: with none, nothing would say how far to go where no constraint does.

    Args:
        evaluators: The evaluators at each point, one after the other.
        columns: Of the variables of each point, shape (points, n).
        rows: Of the values of each, shape (points, m).
        are_costs: Whether they are costs, which have one value each.
    """

    def __init__(
        self,
        evaluators: Sequence[Sequence[EvaluatorBase]],
        columns: np.ndarray,
        rows: np.ndarray,
        are_costs: bool = False,
    ):
        super().__init__(columns, rows)
        (count, m), n = rows.shape, columns.shape[1]
        self._points, self._values, self._J = np.zeros((count, n)), np.zeros((count, m)), np.zeros((count, m, n))
        self.are_costs, self._has_begun = are_costs, False
        self._evaluators = [
            (
                k,
                evaluator,
                self._values[k, end - evaluator._num_outputs : end],
                self._J[k, end - evaluator._num_outputs : end],
            )
            for k, found in enumerate(evaluators)
            for evaluator, end in zip(found, itertools.accumulate([e._num_outputs for e in found]))
        ]  # with where their values and derivatives go

    def values(self, x: np.ndarray) -> np.ndarray:
        points = x[self._columns]
        for k, evaluator, values, _ in self._evaluators:
            values[:] = evaluator._eval(points[k])
        return self._values.flatten()

    def slopes(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        points = x[self._columns]
        self._points[:] = points
        for k, evaluator, values, J in self._evaluators:
            values[:], J[:] = evaluator._eval_with_jacobian(points[k])
        return self._values.flatten(), self._J.flatten()

    def hessian(self, x: np.ndarray, weights: np.ndarray) -> np.ndarray:
        if not np.array_equal(self._points, x[self._columns]):
            self.slopes(x)
        self._J[:] = without_nan(self._J)
        if not self._has_begun:
            self._begin()
        self._update_hessians()
        self._weights[:] = weights
        self._sum_hessians()
        return self._total.flatten()

    def _begin(self) -> None:
        """Begins to learn."""
        self._has_begun = True
        (count, n), size = self._points.shape, self._values.size
        J, before, self._H = self._J.reshape(size, n), self._points.copy(), np.zeros((size, n * n))
        self._weights, self._total = np.zeros(size), np.zeros((count, n * n))
        self._update_hessians = quasi_newton.symmetric_rank_one.bind(
            before, self._points, J.copy(), J, self._H, np.zeros(n)
        )
        self._sum_hessians = quasi_newton.weighted_sums.bind(self._H, self._weights, self._total)
        if self.are_costs:
            self._look_around()

    def _look_around(self) -> None:
        """Begins with the curvature of each cost downhill, in all directions."""
        n = self._points.shape[1]
        slopes = self._J.reshape(-1, n).copy()
        for H, (k, evaluator, _, _), slope in zip(self._H, self._evaluators, slopes):
            own = self._points[k]
            steepness = float(np.linalg.norm(slope))
            if steepness > 0.0:
                step = -_LOOK * max(1.0, float(np.abs(own).max())) * slope / steepness
                change = without_nan(evaluator._eval_with_jacobian(own + step)[1])[0] - slope
                H[:: n + 1] = max(0.0, float(step @ change / (step @ step)))


def grouped(found: Sequence[Placed], are_costs: bool = False) -> list[Terms]:
    """Groups of evaluators."""
    points: dict[bytes, list[Placed]] = {}
    alike: dict[Any, list[Placed]] = {}
    for placed in found:
        key = placed.evaluator._alike()
        if key is None:
            points.setdefault(placed.columns.tobytes(), []).append(placed)
        else:
            alike.setdefault(key, []).append(placed)
    out: list[Terms] = []
    for members in alike.values():
        columns, rows = np.array([p.columns for p in members]), np.array([p.rows for p in members])
        out.append(AlikeTerms(members[0].evaluator._many(), columns, rows))
    rest: dict[Any, list[list[Placed]]] = {}
    for members in points.values():  # those at one point are evaluated one after the other: what they share is there
        rest.setdefault((len(members[0].columns), sum([len(p.rows) for p in members])), []).append(members)
    for group in rest.values():
        columns = np.array([members[0].columns for members in group])
        rows = np.array([np.concatenate([p.rows for p in members]) for members in group])
        out.append(LearnedTerms([[p.evaluator for p in members] for members in group], columns, rows, are_costs))
    return out
