"""Costs and constraints of a program in groups that are evaluated together, with sparse derivatives.

Each group has values; `places` says which row of all constraints each is, or which cost. Derivatives are lists of
numbers whose rows and columns never change, so that solvers lay out their matrices once.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from sheldrake.solvers._arrays import Matrix, joined
from sheldrake.solvers._engines.linear_rows import entries
from sheldrake.solvers._functions.evaluators import EvaluatorBase, Many
from sheldrake.solvers._kernels import quasi_newton


def without_nan(J: np.ndarray) -> np.ndarray:
    """Derivatives, those that are nan (of a length at zero, say) taken as zero."""
    flat = J.ravel()
    return np.where(np.isnan(J), 0.0, J) if math.isnan(flat.dot(flat)) else J


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
        """The same for who asks but once, and does not mind that it is no better than differences of gradients."""
        return self.hessian(x, weights)


_NONE = np.zeros(0, dtype=int)


class LinearTerms(Terms):
    """A x + b.

    Args:
        blocks: (A, b, columns of A, rows) of each evaluator.
    """

    def __init__(self, blocks: Sequence[tuple[Matrix, np.ndarray, np.ndarray, np.ndarray]]):
        self.places = np.concatenate([rows for *_, rows in blocks])
        self._b = np.concatenate([b for _, b, _, _ in blocks])
        self._local, columns, self._entries = entries([A for A, *_ in blocks], [len(rows) for *_, rows in blocks])
        self.J_rows, self.J_cols = self.places[self._local], np.concatenate([c for _, _, c, _ in blocks])[columns]

    def where_hessian(self) -> tuple[np.ndarray, np.ndarray]:
        return _NONE, _NONE

    def empty(self) -> np.ndarray:
        """Those of `places` whose rows have no coefficient."""
        return self.places[np.bincount(self._local[self._entries != 0.0], minlength=len(self._b)) == 0]

    def values(self, x: np.ndarray) -> np.ndarray:
        return self._b + np.bincount(self._local, self._entries * x[self.J_cols], len(self._b))

    def slopes(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return self.values(x), self._entries

    def hessian(self, x: np.ndarray, weights: np.ndarray) -> np.ndarray:
        return np.zeros(0)


_DENSE = 64  # Up to so many variables a single form is faster as a full matrix.


class QuadraticTerms(Terms):
    """x' Q x / 2 + b' x + c, one value for each evaluator.

    Args:
        blocks: (Q, b, c, columns, row) of each evaluator.
    """

    def __init__(self, blocks: Sequence[tuple[np.ndarray, np.ndarray, float, np.ndarray, int]]):
        self.places = np.array([row for *_, row in blocks])
        self._c = np.array([c for _, _, c, _, _ in blocks])
        self._only = np.array(blocks[0][0]) if len(blocks) == 1 and len(blocks[0][1]) <= _DENSE else None
        self._b = np.concatenate([b for _, b, _, _, _ in blocks])
        sizes = [len(b) for _, b, _, _, _ in blocks]
        starts = np.concatenate(([0], np.cumsum(sizes)))
        self._owner = np.repeat(np.arange(len(blocks)), sizes)
        self.J_cols = np.concatenate([at for *_, at, _ in blocks])
        self.J_rows = self.places[self._owner]
        rows, cols, entries = [], [], []
        for (Q, *_), start in zip(blocks, starts):
            i, j = np.nonzero(Q)
            rows.append(i + start)
            cols.append(j + start)
            entries.append(Q[i, j])
        self._i, self._j, self._Q = np.concatenate(rows), np.concatenate(cols), np.concatenate(entries)

    def where_hessian(self) -> tuple[np.ndarray, np.ndarray]:
        return self.J_cols[self._i], self.J_cols[self._j]

    def values(self, x: np.ndarray) -> np.ndarray:
        return self.slopes(x)[0]

    def slopes(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        own = x[self.J_cols]
        if self._only is not None:
            Qx = self._only.dot(own)
            slope = Qx + self._b
            return self._c + 0.5 * own.dot(slope + self._b), slope
        Qx = np.bincount(self._i, self._Q * own[self._j], len(own))
        values = self._c + np.bincount(self._owner, own * (0.5 * Qx + self._b), len(self._c))
        return values, Qx + self._b

    def hessian(self, x: np.ndarray, weights: np.ndarray) -> np.ndarray:
        return self._Q * weights[self._owner[self._i]]


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
        # To write down second derivatives of formulas takes longer than many programs take to be solved.
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
        self._are_costs, self._has_begun = are_costs, False
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
        if self._are_costs:
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


class AllTerms(Terms):
    """Several groups as one, whose values are in the order of their places.

    Args:
        parts: The groups.
    """

    def __init__(self, parts: Sequence[Terms]):
        self.parts = parts
        self._order = joined([t.places for t in parts], int)
        self.places = np.arange(len(self._order))
        self._is_in_order = bool((self._order == self.places).all())
        self.J_rows, self.J_cols = joined([t.J_rows for t in parts], int), joined([t.J_cols for t in parts], int)

    def where_hessian(self) -> tuple[np.ndarray, np.ndarray]:
        found = [t.where_hessian() for t in self.parts]
        return joined([rows for rows, _ in found], int), joined([cols for _, cols in found], int)

    def _in_order(self, values: list[np.ndarray]) -> np.ndarray:
        found = values[0] if len(values) == 1 else joined(values, float)
        if self._is_in_order:
            return found
        out = np.empty(len(found))
        out[self._order] = found
        return out

    def values(self, x: np.ndarray) -> np.ndarray:
        return self._in_order([t.values(x) for t in self.parts])

    def slopes(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        found = [t.slopes(x) for t in self.parts]
        values = self._in_order([values for values, _ in found])
        return values, found[0][1] if len(found) == 1 else joined([J for _, J in found], float)

    def hessian(self, x: np.ndarray, weights: np.ndarray) -> np.ndarray:
        return joined([t.hessian(x, weights[t.places]) for t in self.parts], float)

    def rough_hessian(self, x: np.ndarray, weights: np.ndarray) -> np.ndarray:
        return joined([t.rough_hessian(x, weights[t.places]) for t in self.parts], float)


def grouped(found: Sequence[tuple[Any, np.ndarray, np.ndarray]], are_costs: bool = False) -> list[Terms]:
    """Groups of evaluators, given with the columns of their variables and the rows of their values."""
    from sheldrake.solvers._functions.constraints import LinearConstraint, QuadraticConstraint
    from sheldrake.solvers._functions.costs import LinearCost, QuadraticCost

    linear, quadratic = [], []
    points: dict[bytes, list[tuple[Any, np.ndarray, np.ndarray]]] = {}
    alike: dict[Any, list[tuple[Any, np.ndarray, np.ndarray]]] = {}
    for evaluator, columns, rows in found:
        if isinstance(evaluator, (LinearCost, LinearConstraint)):
            if isinstance(evaluator, LinearCost):
                linear.append((evaluator._a.reshape(1, -1), np.array([evaluator._b]), columns, rows))
            else:
                linear.append((evaluator._A, np.zeros(len(rows)), columns, rows))
        elif isinstance(evaluator, (QuadraticCost, QuadraticConstraint)):
            c = evaluator._c if isinstance(evaluator, QuadraticCost) else 0.0
            quadratic.append((evaluator._Q, evaluator._b, c, columns, int(rows[0])))
        else:
            key = evaluator._alike()
            if key is None:
                points.setdefault(columns.tobytes(), []).append((evaluator, columns, rows))
            else:
                alike.setdefault(key, []).append((evaluator, columns, rows))
    out: list[Terms] = []
    if linear:
        out.append(LinearTerms(linear))
    if quadratic:
        out.append(QuadraticTerms(quadratic))
    for members in alike.values():
        columns, rows = np.array([c for _, c, _ in members]), np.array([r for *_, r in members])
        out.append(AlikeTerms(members[0][0]._many(), columns, rows))
    rest: dict[Any, list[list[tuple[Any, np.ndarray, np.ndarray]]]] = {}
    for members in points.values():  # those at one point are evaluated one after the other: what they share is there
        rest.setdefault((len(members[0][1]), sum([len(r) for *_, r in members])), []).append(members)
    for group in rest.values():
        columns = np.array([members[0][1] for members in group])
        rows = np.array([np.concatenate([r for *_, r in members]) for members in group])
        out.append(LearnedTerms([[e for e, *_ in members] for members in group], columns, rows, are_costs))
    return out
