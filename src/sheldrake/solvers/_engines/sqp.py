"""Sequential quadratic programming for programs of few variables.

Each step is the solution of a small quadratic program, by a kernel, in which the Lagrangian's Hessian is learned (the
damped update of M. J. D. Powell, 1978). Where linearized constraints contradict each other, or where steps bring no
progress, they may be missed by the same amount, which the program makes as small as it can (R. Fletcher's penalty,
1981). Steps are shortened, or corrected for what constraints curve, until a penalty function falls.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from sheldrake.solvers._engines.dense_quadratic import solve_dense
from sheldrake.solvers._engines.nonlinear import Outcome, Settings
from sheldrake.solvers._engines.nonlinear_form import NonlinearForm

_SHORTEST = 1e-4  # part of a step
_REACH = 0.5  # of one step, relative to the point and 1
_LONGEST = 1e3  # of what is still a step
_GAIN = 1e-10  # of the cost that is not worth a step, relative to it or 1
_ROUNDING = 1e-6  # the same where no better step is found: at the solution, quadratic programs are all rounding
_LEFT = 1e-9  # what linearized constraints may be missed by
_PENALTIES = 10.0 ** np.arange(1, 9)  # for linearized constraints that are missed, relative to the cost's gradient
_MOST_VARIABLES, _MOST_ROWS = 40, 120


def suits(form: NonlinearForm) -> bool:
    """Whether a program has constraints whose second derivatives are learned, and is so small that steps are quick."""
    bounds = form.lower, form.upper, form.x_lower, form.x_upper
    return form.learns and form.num_vars <= _MOST_VARIABLES and sum(np.isfinite(b).sum() for b in bounds) <= _MOST_ROWS


class Here(NamedTuple):
    """A point: cost and gradient; how far rows are beyond their bounds, and at most; the gradients of that, and the box's
    below.
    """

    y: np.ndarray
    f: float
    g: np.ndarray
    beyond: np.ndarray
    violation: float
    A: np.ndarray
    A_and_box: np.ndarray

    def is_finite(self) -> bool:
        """Whether all values are."""
        return math.isfinite(self.f) and _are_finite(self.g) and _are_finite(self.beyond)


def _are_finite(numbers: np.ndarray) -> bool:
    return math.isfinite(np.add.reduce(numbers))


def _largest(numbers: np.ndarray) -> float:
    """The largest size of some numbers, 0 if there are none; nan if one is."""
    return float(np.maximum.reduce(np.abs(numbers), initial=0.0))


class Sqp:
    """The iterations.

    Args:
        form: The program.
        start: Where to begin.
        settings: Tolerances and limits.
    """

    def __init__(self, form: NonlinearForm, start: np.ndarray, settings: Settings):
        self._form, self._settings, self._start = form, settings, start
        self._high, self._low = np.flatnonzero(np.isfinite(form.upper)), np.flatnonzero(np.isfinite(form.lower))
        self._x_high = np.flatnonzero(np.isfinite(form.x_upper))
        self._x_low = np.flatnonzero(np.isfinite(form.x_lower))
        self._upper, self._lower = form.upper[self._high], form.lower[self._low]
        self._x_upper, self._x_lower = form.x_upper[self._x_high], form.x_lower[self._x_low]
        one = np.eye(form.num_vars)
        self._box = np.vstack((one[self._x_high], -one[self._x_low]))
        self._penalty, self._B = 1.0, self._first_hessian()

    def run(self) -> Outcome:
        """Iterates."""
        here, gain, stalls = self._at(self._start), np.inf, 0
        for _ in range(self._settings.iterations):
            if not here.is_finite():
                break
            is_feasible, size = here.violation <= 0.5 * self._settings.feasibility, max(1.0, abs(here.f))
            step = self._step(here)
            if step is None:
                if stalls or (is_feasible and gain <= _ROUNDING * size):
                    return self._outcome(here, is_feasible and gain <= _ROUNDING * size)
                stalls, self._B = 1, self._first_hessian()
                continue
            d, left, multipliers = step
            wanted = 1.5 * float(multipliers.sum())
            self._penalty = max(wanted, 0.5 * (self._penalty + wanted))
            gain = abs(float(here.g @ d)) + self._penalty * here.violation
            if is_feasible and left <= _LEFT and gain <= _GAIN * size:
                return self._outcome(here, True)
            there = self._search(here, d, left)
            if there is not None:
                stalls = 0
                self._learn(there.y - here.y, there.g - here.g + multipliers @ (there.A - here.A))
                here = there
                continue
            stalls += 1
            if stalls > 1 or (left > _LEFT and _largest(d) <= _LEFT):
                return self._outcome(here, is_feasible and gain <= _ROUNDING * size)
            self._B = self._first_hessian()
        else:
            return self._outcome(here, False, True)
        return self._outcome(here, False)

    @staticmethod
    def _outcome(here: Here, converged: bool, spent: bool = False) -> Outcome:
        return Outcome("SQP", here.y, bool(converged), spent)

    def _at(self, y: np.ndarray) -> Here:
        (f, g), (rows, J) = self._form.cost(y), self._form.dense_constraints(y)
        A_and_box = np.concatenate((J[self._high], -J[self._low], self._box))
        return Here(y, f, g, *self._beyond(rows), A_and_box[: len(A_and_box) - len(self._box)], A_and_box)

    def _beyond(self, rows: np.ndarray) -> tuple[np.ndarray, float]:
        """How far rows are beyond their upper, then their lower bounds, negative inside; and at most."""
        beyond = np.concatenate((rows[self._high] - self._upper, self._lower - rows[self._low]))
        return beyond, float(np.maximum.reduce(beyond, initial=0.0))

    def _room(self, here: Here, beyond: np.ndarray) -> np.ndarray:
        """How far steps may go along the rows of A, then along those of the box."""
        y = here.y
        return np.concatenate((-beyond, self._x_upper - y[self._x_high], y[self._x_low] - self._x_lower))

    # Steps

    def _step(self, here: Here) -> tuple[np.ndarray, float, np.ndarray] | None:
        """The step, by how much linearized constraints are still missed, and multipliers of the rows of A, which are not
        negative; None if no program was solved.
        """
        rows, room = here.A_and_box, self._room(here, here.beyond)
        solved = solve_dense(self._B, here.g, rows, room)
        if solved is not None and _largest(solved[0]) < _LONGEST:
            return solved[0], 0.0, np.maximum(solved[1][: len(here.A)], 0.0)
        n = len(here.g)
        Q, q, missed = np.zeros((n + 1, n + 1)), np.append(here.g, 0.0), np.zeros((len(rows) + 1, n + 1))
        Q[:n, :n], Q[n, n] = self._B, 1e-6
        missed[:-1, :n], missed[: len(here.A), n], missed[-1, n] = rows, -1.0, -1.0
        for penalty in _PENALTIES * max(1.0, _largest(here.g)):
            q[n] = penalty
            solved = solve_dense(Q, q, missed, np.append(room, 0.0))
            if solved is None:
                return None
            step, left = solved[0][:n], max(0.0, float(solved[0][n]))
            if left <= 0.9 * here.violation:
                break
        self._penalty = max(self._penalty, penalty)
        return step, left, np.maximum(solved[1][: len(here.A)], 0.0)

    def _search(self, here: Here, d: np.ndarray, left: float) -> Here | None:
        """Where the penalty function falls along a step; None if nowhere."""
        slope = float(here.g @ d) - self._penalty * (here.violation - left)
        slope, merit = min(slope, -0.5 * float(d @ self._B @ d)), self._merit(here)
        alpha = min(1.0, _REACH * (1.0 + _largest(here.y)) / max(_largest(d), 1e-300))
        # Most of the work of derivatives is that of values: where the next step may begin, they are computed at once.
        there = self._at(self._form.clip(here.y + alpha * d))
        if self._merit(there) <= merit + _enough(merit, alpha * slope):
            return there
        if alpha == 1.0 and left == 0.0 and _are_finite(there.beyond):
            corrected = self._corrected(here, d, there.beyond)
            if corrected is not None and self._merit(corrected) <= merit + _enough(merit, slope):
                return corrected
        while (alpha := alpha * (0.5 if alpha > 0.1 else 0.2)) >= _SHORTEST:
            y = self._form.clip(here.y + alpha * d)
            f, rows = self._form.values(y)
            if f + self._penalty * self._beyond(rows)[1] <= merit + _enough(merit, alpha * slope):
                return self._at(y)
        return None

    def _merit(self, there: Here) -> float:
        """The penalty function."""
        return there.f + self._penalty * there.violation

    def _corrected(self, here: Here, d: np.ndarray, beyond: np.ndarray) -> Here | None:
        """Where a full step leads that heeds how rows curve: by what they were found beyond their bounds behind it."""
        solved = solve_dense(self._B, here.g, here.A_and_box, self._room(here, beyond - here.A @ d))
        return None if solved is None else self._at(self._form.clip(here.y + solved[0]))

    # The Hessian

    def _first_hessian(self) -> np.ndarray:
        """That of the cost, no eigenvalue near zero or below: steps would go anywhere."""
        form, n = self._form, self._form.num_vars
        H = np.zeros((n, n))
        np.add.at(H, (form.H_rows, form.H_cols), form.hessian(self._start, 1.0, np.zeros(form.num_rows)))
        if not np.isfinite(H).all():
            return np.eye(n)
        values, vectors = np.linalg.eigh(0.5 * (H + H.T))
        values = np.maximum(np.abs(values), 0.1 * max(1.0, float(np.abs(values).max(initial=0.0))))
        found: np.ndarray = (vectors * values) @ vectors.T
        return found

    def _learn(self, s: np.ndarray, r: np.ndarray) -> None:
        """From how the Lagrangian's gradient changed by r along s."""
        Bs = self._B @ s
        sBs, sr = float(s @ Bs), float(s @ r)
        if not sBs > 1e-30 or not math.isfinite(sr):
            return
        if sr < 0.2 * sBs:
            part = 0.8 * sBs / (sBs - sr)
            r = part * r + (1.0 - part) * Bs
            sr = 0.2 * sBs
        self._B = self._B - Bs[:, None] * (Bs / sBs) + r[:, None] * (r / sr)


def _enough(merit: float, fall: float) -> float:
    """How much the penalty function, where it is to fall, must do so; rounding may let it rise."""
    return 1e-4 * fall + 1e-14 * abs(merit)
