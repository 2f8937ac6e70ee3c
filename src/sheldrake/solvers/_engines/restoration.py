"""Points where constraints are violated least: where other methods may go on, or which tell that there is no solution.

The least squares of violations are found by steps of Gauss and Newton, shortened as K. Levenberg (1944) does. Where
these are slow, as they are about a least that is not zero, the rows' second derivatives are learned as well (J. E.
Dennis, D. M. Gay and R. E. Welsch, 1981).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sheldrake.solvers._engines.nonlinear_form import NonlinearForm
from sheldrake.solvers._kernels.active_set import least_of_free

_MOST = 60  # steps: most of those that end well need 5 to 40
_DAMPING, _LEAST_DAMPING, _MOST_DAMPING = 1e-3, 1e-10, 1e6
_LEFT = 0.1  # part of the squares that nothing within reach may take away at a least
_FAR = 100.0  # what is within reach of a variable that has no bounds, relative to it or 1
_CLEARLY = 100.0  # what a violation is that tolerances do not explain, relative to them
ALIKE = 0.1  # how much the squares of two leasts differ that are one, relative


class Restored(NamedTuple):
    """Where it ended, the squares of violations there, and whether they are zero, or least and clearly not zero."""

    y: np.ndarray
    squares: float
    is_zero: bool
    is_least: bool

    def confirms(self, other: Restored) -> bool:
        """Whether both are leasts of the same violation."""
        alike = abs(self.squares - other.squares) <= ALIKE * max(self.squares, other.squares)
        return self.is_least and other.is_least and alike


def aside(form: NonlinearForm, start: np.ndarray, part: float) -> np.ndarray:
    """A point some part of its size, or of 1, off `start` that shares no symmetry with it, inside of the bounds."""
    return form.clip(start + part * (1.0 + np.abs(start)) * np.sin(10.0 * part + np.arange(len(start))))


def restore(form: NonlinearForm, start: np.ndarray, feasibility: float) -> Restored:
    """A point near `start` with the least squares of violations, inside of the bounds of the variables."""
    y, (r, J), damping, is_slow, n = start, form.excess(start), _DAMPING, False, len(start)
    curvature, damped, (g, reach, scratch, d) = np.zeros((n, n)), np.zeros((n, n)), np.zeros((4, n))
    step = least_of_free.bind(damped, g, reach, np.zeros((n, n)), scratch, d)
    for _ in range(_MOST):
        squares, g[:] = float(r @ r), J.T @ r
        most = np.abs(r).max(initial=0.0)
        room = np.where(g > 0.0, y - form.x_lower, form.x_upper - y)
        reach[:] = np.minimum(room, _FAR * (1.0 + np.abs(y)))
        is_least = np.abs(g) @ reach <= _LEFT * squares
        is_zero = most <= 0.5 * feasibility
        if is_zero or is_least or not np.isfinite(squares):
            return Restored(y, squares, bool(is_zero), bool(is_least and most > _CLEARLY * feasibility))
        H = J.T @ J
        unit = H.trace() / n
        if is_slow:
            H = H + curvature
        while True:
            damped[:] = H
            damped.ravel()[:: n + 1] += damping * unit
            step()
            trial = form.clip(y + d)
            r_trial, J_trial = form.excess(trial)
            left = float(r_trial @ r_trial)
            if left < squares:
                break
            damping *= 8.0
            if damping > _MOST_DAMPING:
                return Restored(y, squares, False, False)
        s = trial - y
        got = (squares - left) / max(-2.0 * (g @ s) - s @ H @ s, 1e-300)
        damping = max(_LEAST_DAMPING, damping * (0.1 if got > 0.5 else 0.7 if got > 0.1 else 3.0))
        _learn(curvature, s, (J_trial - J).T @ r_trial, J_trial.T @ r_trial - g)
        y, r, J, is_slow = trial, r_trial, J_trial, left > 0.5 * squares
    return Restored(y, float(r @ r), False, False)


def _learn(curvature: np.ndarray, s: np.ndarray, wanted: np.ndarray, change: np.ndarray) -> None:
    """Lets `curvature` times a step be what is wanted, given how the gradient changed along it."""
    along = change @ s
    if not along > 1e-12 * np.linalg.norm(change) * np.linalg.norm(s):
        return
    known = curvature @ s
    part = min(1.0, abs(s @ wanted) / max(abs(s @ known), 1e-300))
    missing = wanted - part * known
    curvature *= part
    curvature += (np.outer(missing, change) + np.outer(change, missing)) / along
    curvature -= np.outer(change, change) * (missing @ s) / along**2
