"""Second derivatives of costs and constraints, learned from their gradients."""

from __future__ import annotations

from typing import Any

import numpy as np

from sheldrake.solvers._engines.nonlinear_form import NonlinearForm
from sheldrake.solvers._functions.constraints import LinearConstraint, QuadraticConstraint
from sheldrake.solvers._functions.costs import LinearCost, QuadraticCost

_LARGEST_FULL = 400  # Up to so many variables the whole matrix is made semidefinite, beyond it part by part.


class Element:
    """Hessians of the values of one evaluator by its own few variables, shape (m, k, k)."""

    def __init__(self, evaluator: Any, at: np.ndarray, outputs: int, scale: np.ndarray):
        self.at = at
        self.H = np.zeros((outputs, len(at), len(at)))
        self.is_known = isinstance(evaluator, (LinearCost, LinearConstraint, QuadraticCost, QuadraticConstraint))
        if isinstance(evaluator, (QuadraticCost, QuadraticConstraint)):
            self.H[0] = evaluator._Q * np.outer(scale[at], scale[at])

    def learn(self, s: np.ndarray, change: np.ndarray) -> None:
        """Symmetric rank one updates: afterwards H s is the change of the gradients, where that is safe."""
        if self.is_known:
            return
        r = change - self.H @ s
        rs = r @ s
        safe = np.abs(rs) > 1e-8 * np.linalg.norm(s) * np.linalg.norm(r, axis=1)
        if safe.any():
            r, rs = r[safe], rs[safe]
            self.H[safe] += r[:, :, None] * r[:, None, :] / rs[:, None, None]


class Curvature:
    """The Hessian of the Lagrangian as a sum over costs and constraints, each of few variables.

    Every value of every evaluator has its own approximation (Griewank and Toint, 1982; Conn, Gould and Toint, 1991), so
    that multipliers may change without making it stale, and many small Hessians are learned in few steps.
    """

    def __init__(self, form: NonlinearForm):
        self._form = form
        self._costs = [Element(e, at, 1, form.scale) for e, at in form._costs]
        self._rows = [Element(r.evaluator, r.at, r.rows.stop - r.rows.start, form.scale) for r in form.rows]
        self.remember()

    def remember(self) -> None:
        """Keeps the gradients of the point where the form was evaluated last."""
        self._cost_blocks, self._row_blocks = self._form.cost_blocks, self._form.row_blocks

    def learn(self, s: np.ndarray) -> None:
        """Learns from the gradients after a step, and keeps them."""
        form = self._form
        for element, old, new in zip(self._costs, self._cost_blocks, form.cost_blocks):
            element.learn(s[element.at], new - old)
        for element, old, new in zip(self._rows, self._row_blocks, form.row_blocks):
            element.learn(s[element.at], new - old)
        self.remember()

    def matrix(self, dual: np.ndarray, active: np.ndarray) -> np.ndarray:
        """The Hessian of cost + dual' rows, made positive semidefinite.

        Args:
            dual: Multipliers of the rows.
            active: Gradients of what steps are held by, of length one, as rows. Across them curvature does not matter:
                adding some there saves that along the constraints from being changed.
        """
        n = self._form.num_vars
        B = np.zeros((n, n))
        whole = n <= _LARGEST_FULL
        parts = [(e, e.H[0]) for e in self._costs]
        for element, row in zip(self._rows, self._form.rows):
            if not element.is_known or element.H.any():
                parts.append((element, np.tensordot(dual[row.rows], element.H, axes=1)))
        for element, H in parts:
            H = H if whole else _semidefinite(H)
            np.add.at(B, (element.at[:, None], element.at[None, :]), H)
        B = _convexified(B, active) if whole else B
        B[np.arange(n), np.arange(n)] += 1e-8
        return B


def _convexified(B: np.ndarray, active: np.ndarray) -> np.ndarray:
    if _is_definite(B):
        return B
    if len(active):
        B = B + 3.0 * np.abs(B).sum(axis=0).max() * (active.T @ active)
        if _is_definite(B):
            return B
    return _semidefinite(B)


def _is_definite(B: np.ndarray) -> bool:
    try:
        np.linalg.cholesky(B + 1e-12 * np.abs(B).max(initial=1.0) * np.eye(len(B)))
    except np.linalg.LinAlgError:
        return False
    return True


def _semidefinite(H: np.ndarray) -> np.ndarray:
    """The matrix without its negative eigenvalues."""
    H = 0.5 * (H + H.T)
    values, vectors = np.linalg.eigh(H)
    if values[0] >= 0.0:
        return H
    return (vectors * np.maximum(values, 0.0)) @ vectors.T
