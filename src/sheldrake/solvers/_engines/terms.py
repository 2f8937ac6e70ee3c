"""Costs and constraints of a program in groups that are evaluated together, with sparse derivatives.

Each group has values; `places` says which row of all constraints each is, or which cost. Derivatives are lists of
numbers whose rows and columns never change, so that solvers lay out their matrices once.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from sheldrake.solvers._functions.evaluators import EvaluatorBase, Many

_MOST_LEARNED = 1e8  # Larger changes of a gradient over a step are those of a kink.


def without_nan(J: np.ndarray) -> np.ndarray:
    """Derivatives, those that are nan (of a length at zero, say) taken as zero."""
    return np.where(np.isnan(J), 0.0, J) if np.isnan(J.sum()) else J


class Terms:
    """A group. Its Jacobian has entries at `(J_rows, J_cols)`, its Hessian at `(H_rows, H_cols)`, both halves of it."""

    J_rows: np.ndarray
    J_cols: np.ndarray
    H_rows: np.ndarray
    H_cols: np.ndarray
    places: np.ndarray

    def values(self, x: np.ndarray) -> np.ndarray:
        """Values at x, one for each of `places`."""
        raise NotImplementedError

    def slopes(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Values, and the entries of the Jacobian."""
        raise NotImplementedError

    def hessian(self, x: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """Entries of the Hessian of weights' values; of what is learned, as it was at the last slopes."""
        raise NotImplementedError


_NONE = np.zeros(0, dtype=int)


class LinearTerms(Terms):
    """A x + b.

    Args:
        blocks: (A, b, columns of A, rows) of each evaluator.
    """

    def __init__(self, blocks: Sequence[tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]]):
        self.places = np.concatenate([rows for *_, rows in blocks])
        self._b = np.concatenate([b for _, b, _, _ in blocks])
        local, rows, cols, entries, at = [], [], [], [], 0
        for A, _, columns, places in blocks:
            i, j = np.nonzero(A)
            local.append(i + at)
            rows.append(places[i])
            cols.append(columns[j])
            entries.append(A[i, j])
            at += len(A)
        self._local, self.J_rows, self.J_cols = np.concatenate(local), np.concatenate(rows), np.concatenate(cols)
        self._entries = np.concatenate(entries)
        self.H_rows = self.H_cols = _NONE

    def values(self, x: np.ndarray) -> np.ndarray:
        return self._b + np.bincount(self._local, self._entries * x[self.J_cols], len(self._b))

    def slopes(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return self.values(x), self._entries

    def hessian(self, x: np.ndarray, weights: np.ndarray) -> np.ndarray:
        return np.zeros(0)


class QuadraticTerms(Terms):
    """x' Q x / 2 + b' x + c, one value for each evaluator.

    Args:
        blocks: (Q, b, c, columns, row) of each evaluator.
    """

    def __init__(self, blocks: Sequence[tuple[np.ndarray, np.ndarray, float, np.ndarray, int]]):
        self.places = np.array([row for *_, row in blocks])
        self._c = np.array([c for _, _, c, _, _ in blocks])
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
        self.H_rows, self.H_cols = self.J_cols[self._i], self.J_cols[self._j]

    def values(self, x: np.ndarray) -> np.ndarray:
        return self.slopes(x)[0]

    def slopes(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        own = x[self.J_cols]
        Qx = np.bincount(self._i, self._Q * own[self._j], len(own))
        values = self._c + np.bincount(self._owner, own * (0.5 * Qx + self._b), len(self._c))
        return values, Qx + self._b

    def hessian(self, x: np.ndarray, weights: np.ndarray) -> np.ndarray:
        return self._Q * weights[self._owner[self._i]]


class AlikeTerms(Terms):
    """Evaluators that differ by their variables alone.

    Args:
        many: Evaluates them.
        columns: Of the variables of each, shape (evaluators, n).
        rows: Of the values of each, shape (evaluators, m).
    """

    def __init__(self, many: Many, columns: np.ndarray, rows: np.ndarray):
        self._many, self._columns, self._shape = many, columns, rows.shape
        (count, n), m = columns.shape, rows.shape[1]
        self.places = rows.ravel()
        self.J_rows = np.broadcast_to(rows[:, :, None], (count, m, n)).ravel()
        self.J_cols = np.broadcast_to(columns[:, None, :], (count, m, n)).ravel()
        self.H_rows = np.broadcast_to(columns[:, :, None], (count, n, n)).ravel()
        self.H_cols = np.broadcast_to(columns[:, None, :], (count, n, n)).ravel()

    def values(self, x: np.ndarray) -> np.ndarray:
        return self._many.values(x[self._columns]).ravel()

    def slopes(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        values, J = self._many.slopes(x[self._columns])
        return values.ravel(), without_nan(J).ravel()

    def hessian(self, x: np.ndarray, weights: np.ndarray) -> np.ndarray:
        return without_nan(self._many.hessian(x[self._columns], weights.reshape(self._shape))).ravel()


class LearnedTerms(Terms):
    """One evaluator of which no more than first derivatives are known.

    The Hessian of each of its values is learned from how gradients change from one evaluation of slopes to the next, by
    symmetric rank one updates (Griewank and Toint, 1982; Conn, Gould and Toint, 1991): multipliers may change without
    making it stale, and many small Hessians are learned in few steps.

    Args:
        evaluator: The evaluator.
        columns: Of its variables, shape (n,).
        rows: Of its values, shape (m,).
    """

    def __init__(self, evaluator: EvaluatorBase, columns: np.ndarray, rows: np.ndarray):
        self._evaluator, self._columns, self.places = evaluator, columns, rows
        m, n = len(rows), len(columns)
        self.J_rows, self.J_cols = np.repeat(rows, n), np.tile(columns, m)
        self.H_rows, self.H_cols = np.repeat(columns, n), np.tile(columns, n)
        self._H = np.zeros((m, n, n))
        self._last: tuple[np.ndarray, np.ndarray] | None = None

    def values(self, x: np.ndarray) -> np.ndarray:
        return self._evaluator._eval(x[self._columns])

    def slopes(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        own = x[self._columns]
        values, J = self._evaluator._eval_with_jacobian(own)
        J = without_nan(J)
        if self._last is not None:
            self._learn(own - self._last[0], J - self._last[1])
        self._last = own, J
        return values, J.ravel()

    def _learn(self, s: np.ndarray, change: np.ndarray) -> None:
        r = change - self._H @ s
        rs = r @ s
        size = np.linalg.norm(s)
        safe = np.abs(rs) > 1e-8 * size * np.linalg.norm(r, axis=1)
        safe &= np.abs(rs) > 1e-14 * size
        if safe.any():
            r, rs = r[safe], rs[safe]
            updated = self._H[safe] + r[:, :, None] * r[:, None, :] / rs[:, None, None]
            sane = np.abs(updated).max(axis=(1, 2)) < _MOST_LEARNED
            self._H[np.flatnonzero(safe)[sane]] = updated[sane]

    def hessian(self, x: np.ndarray, weights: np.ndarray) -> np.ndarray:
        return np.tensordot(weights, self._H, axes=1).ravel()


def grouped(found: Sequence[tuple[Any, np.ndarray, np.ndarray]]) -> list[Terms]:
    """Groups of evaluators, given with the columns of their variables and the rows of their values."""
    from sheldrake.solvers._functions.constraints import LinearConstraint, QuadraticConstraint
    from sheldrake.solvers._functions.costs import LinearCost, QuadraticCost

    linear, quadratic, rest = [], [], []
    alike: dict[Any, list[tuple[Any, np.ndarray, np.ndarray]]] = {}
    for evaluator, columns, rows in found:
        if isinstance(evaluator, (LinearCost, LinearConstraint)):
            zero = np.zeros(len(columns))
            linear.append((evaluator._jacobian(zero), evaluator._eval(zero), columns, rows))
        elif isinstance(evaluator, (QuadraticCost, QuadraticConstraint)):
            c = float(evaluator._eval(np.zeros(len(columns)))[0])
            quadratic.append((evaluator._Q, evaluator._b, c, columns, int(rows[0])))
        else:
            key = evaluator._alike()
            if key is None:
                rest.append((evaluator, columns, rows))
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
    return out + [LearnedTerms(*one) for one in rest]
