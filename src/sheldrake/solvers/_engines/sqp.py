"""Sequential quadratic programming for programs of few variables.

Each step is the solution of a small quadratic program, by a kernel, in which the Lagrangian's Hessian is learned (the
damped update of M. J. D. Powell, 1978). Where linearized constraints contradict each other, or where steps bring no
progress, they may be missed by the same amount, which the program makes as small as it can (R. Fletcher's penalty,
1981). Steps are shortened, or corrected for what constraints curve, until a penalty function falls.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import Any

import numpy as np

from sheldrake.common._nonnegative_least_squares import nonnegative_least_squares
from sheldrake.common.record import view_of
from sheldrake.solvers._engines.nonlinear import Outcome, Settings
from sheldrake.solvers._engines.nonlinear_form import NonlinearForm
from sheldrake.solvers._kernels import sequential
from sheldrake.solvers._kernels.active_set import make_quadratic
from sheldrake.solvers._kernels.sequential import Progress, Sequence

_SHORTEST = 1e-4  # part of a step
_GAIN = 1e-10  # of the cost that is not worth a step, relative to it or 1
_ROUNDING = 1e-6  # the same where no better step is found: at the solution, quadratic programs are all rounding
_LEFT = 1e-9  # what linearized constraints may be missed by
_MOST_VARIABLES, _MOST_ROWS = 40, 120

_Now: Any = view_of(Progress)


def suits(form: NonlinearForm) -> bool:
    """Whether a program is so small that steps are quick."""
    bounds = form.lower, form.upper, form.x_lower, form.x_upper
    return form.num_vars <= _MOST_VARIABLES and sum(np.isfinite(b).sum() for b in bounds) <= _MOST_ROWS


class _Memory:
    """Memory for programs of a size, and the kernel bound to it.

    Args:
        n: How many variables there are.
        m: How many rows.
        sides: How many bounds of rows.
        x_sides: How many bounds of variables.
    """

    def __init__(self, n: int, m: int, sides: int, x_sides: int):
        vectors, rows, numbers = iter(np.zeros((9, n))), iter(np.zeros((4, m))), np.zeros(Progress.SIZE)
        self.work = Sequence(
            y=next(vectors), trial=next(vectors), g=next(vectors), g_trial=next(vectors), rows=next(rows),
            rows_trial=next(rows), J=np.zeros((m, n)), J_trial=np.zeros((m, n)), lower=next(rows), upper=next(rows),
            x_lower=next(vectors), x_upper=next(vectors), sides=np.zeros(sides, dtype=np.int64),
            x_sides=np.zeros(x_sides, dtype=np.int64), B=np.zeros((n, n)), d=next(vectors), weights=np.zeros(sides),
            s=next(vectors), r=next(vectors),
        )  # fmt: skip
        self.now = _Now(numbers)
        plain, missed = make_quadratic(sides + x_sides, n), make_quadratic(sides + x_sides + 1, n + 1)
        self._step = sequential.sequential_step.bind(self.work, plain, missed, numbers, sequential.GO)

    def do(self, what: int) -> int:
        """Runs one of the kernels."""
        self._step.set("what", what)
        return int(self._step())


_idle: dict[tuple[int, ...], list[_Memory]] = {}
_MOST_SIZES = 64


@contextlib.contextmanager
def _memory_for(*sizes: int) -> Iterator[_Memory]:
    """Memory that nobody else has: functions of a program may solve others, and so may threads."""
    try:
        memory = _idle[sizes].pop()
    except (KeyError, IndexError):
        memory = _Memory(*sizes)
    try:
        yield memory
    finally:
        if len(_idle) >= _MOST_SIZES:
            _idle.clear()
        _idle.setdefault(sizes, []).append(memory)


def _sides(lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """Numbers of the upper, then of the lower bounds there are, as `Sequence` has them."""
    return np.concatenate((np.flatnonzero(np.isfinite(upper)) + 1, -np.flatnonzero(np.isfinite(lower)) - 1))


class Sqp:
    """The iterations.

    Args:
        form: The program.
        start: Where to begin.
        settings: Tolerances and limits.
    """

    def __init__(self, form: NonlinearForm, start: np.ndarray, settings: Settings):
        self._form, self._settings, self._start = form, settings, start

    def run(self) -> Outcome:
        """Iterates."""
        form = self._form
        sides, x_sides = _sides(form.lower, form.upper), _sides(form.x_lower, form.x_upper)
        with _memory_for(form.num_vars, form.num_rows, len(sides), len(x_sides)) as memory:
            work = memory.work
            work.sides[:], work.x_sides[:] = sides, x_sides
            work.lower[:], work.upper[:] = form.lower, form.upper
            work.x_lower[:], work.x_upper[:] = form.x_lower, form.x_upper
            return self._iterate(memory)

    def _iterate(self, memory: _Memory) -> Outcome:
        work, now, do = memory.work, memory.now, memory.do
        work.B[:], work.trial[:] = self._first_hessian(), self._start
        self._evaluate(memory)
        do(sequential.GO)
        self._form.show(work.y)
        now.penalty, now.held, gain, stalls = 1.0, 0.0, np.inf, 0
        for _ in range(self._settings.iterations):
            status = do(sequential.STEP)
            if status == sequential.NOT_FINITE:
                return self._outcome(work, False)
            size = max(1.0, abs(now.f))
            is_feasible = now.violation <= 0.5 * self._settings.feasibility
            if status == 0:
                gain = now.gain
                if is_feasible and now.left <= _LEFT and gain <= _GAIN * size:
                    return self._outcome(work, True)
                if self._search(memory):
                    stalls = 0
                    do(sequential.LEARN_AND_GO)
                    self._form.show(work.y)
                    continue
            is_done = is_feasible and (gain <= _ROUNDING * size or (status != 0 and self._is_stationary(work)))
            if stalls or (is_done and status) or (not status and now.left > _LEFT and now.longest <= _LEFT):
                return self._outcome(work, is_done)
            stalls, work.B[:] = 1, self._first_hessian()
        return self._outcome(work, False, True)

    def _is_stationary(self, work: Sequence) -> bool:
        """Whether bounds that hold the point balance the cost's slope: asked where rounding leaves no program to solve.

        So it is where as many bounds meet as there are variables, those of equations counting twice.
        """
        near = self._settings.feasibility
        at, x_at = np.abs(work.sides) - 1, np.abs(work.x_sides) - 1
        signs, x_signs = np.sign(work.sides), np.sign(work.x_sides)
        held = np.abs(work.rows[at] - np.where(signs > 0, work.upper[at], work.lower[at])) <= near
        x_held = np.abs(work.y[x_at] - np.where(x_signs > 0, work.x_upper[x_at], work.x_lower[x_at])) <= near
        rows, bounds = signs[:, None] * work.J[at], x_signs[:, None] * np.eye(len(work.y))[x_at]
        slopes = np.vstack((rows[held], bounds[x_held])).T
        left = work.g + slopes @ nonnegative_least_squares(slopes, -work.g)
        return bool(np.abs(left).max() <= self._settings.optimality * max(1.0, np.abs(work.g).max()))

    @staticmethod
    def _outcome(work: Sequence, converged: bool, spent: bool = False) -> Outcome:
        return Outcome("SQP", work.y.copy(), bool(converged), spent)

    def _evaluate(self, memory: _Memory) -> None:
        """Computes the trial point's values and derivatives."""
        work, form = memory.work, self._form
        memory.now.f_trial, work.g_trial[:] = form.cost(work.trial)
        work.rows_trial[:], work.J_trial[:] = form.dense_constraints(work.trial)

    def _search(self, memory: _Memory) -> bool:
        """Finds a trial point along the step where the penalty function falls; False if there is none."""
        work, now, do = memory.work, memory.now, memory.do
        do(sequential.TRY)
        # Most of the work of derivatives is that of values: where the next step may begin, they are computed at once.
        self._evaluate(memory)
        if do(sequential.JUDGE):
            return True
        alpha = now.alpha
        if alpha == 1.0 and now.left == 0.0 and now.violation_trial < np.inf and not do(sequential.CORRECT):
            self._evaluate(memory)
            if do(sequential.JUDGE):
                return True
        while (alpha := alpha * (0.5 if alpha > 0.1 else 0.2)) >= _SHORTEST:
            now.alpha = alpha
            do(sequential.TRY)
            now.f_trial, work.rows_trial[:] = self._form.values(work.trial)
            if do(sequential.JUDGE):
                self._evaluate(memory)
                return True
        return False

    def _first_hessian(self) -> np.ndarray:
        """That of the cost, no eigenvalue near zero or below: steps would go anywhere."""
        H = self._form.cost_hessian(self._start)
        if not H.any():
            return 0.1 * np.eye(len(H))
        if not np.isfinite(H).all():
            return np.eye(len(H))
        values, vectors = np.linalg.eigh(0.5 * (H + H.T))
        values = np.maximum(np.abs(values), 0.1 * max(1.0, float(np.abs(values).max(initial=0.0))))
        found: np.ndarray = (vectors * values) @ vectors.T
        return found
