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
from sheldrake.common.chain import bound_to_all_memory
from sheldrake.common.record import view_of
from sheldrake.solvers._engines.nonlinear import Outcome, Settings
from sheldrake.solvers._engines.nonlinear_form import NonlinearForm
from sheldrake.solvers._kernels import functions, sequential
from sheldrake.solvers._kernels.active_set import make_quadratic
from sheldrake.solvers._kernels.sequential import Progress, Sequence

_ROUNDING = 1e-6  # of the cost, where no better step is found: at the solution, quadratic programs are all rounding
_MOST_VARIABLES, _MOST_ROWS = 40, 120

_Now: Any = view_of(Progress)
_WORDS = 1 + sum(1 + field.ndim for p in functions.slopes.parameters for field in p.fields)


def suits(form: NonlinearForm) -> bool:
    """Whether a program is so small that steps are quick."""
    return form.num_vars <= _MOST_VARIABLES and sum(map(len, form.sides)) <= _MOST_ROWS


class _Memory:
    """Memory for programs of a size, and the kernel bound to it.

    Args:
        n: How many variables there are.
        m: How many rows.
        sides: How many bounds of rows.
        x_sides: How many bounds of variables.
    """

    def __init__(self, n: int, m: int, sides: int, x_sides: int):
        vectors, rows, numbers = iter(np.zeros((8, n))), iter(np.zeros((3, m))), np.zeros(Progress.SIZE)
        self.rows, self.J = np.zeros(1 + m), np.zeros((1 + m, n))  # of the trial point, the cost first
        self._weights = np.eye(1, 1 + m)[0]  # that of the cost is one
        squares = np.zeros((3, n, n))
        self.work = Sequence(
            y=next(vectors), trial=next(vectors), f_trial=self.rows[:1], g=next(vectors), g_trial=self.J[0],
            rows=next(rows), rows_trial=self.rows[1:], J=np.zeros((m, n)), J_trial=self.J[1:], lower=next(rows),
            upper=next(rows), x_lower=next(vectors), x_upper=next(vectors), sides=np.zeros(sides, dtype=np.int64),
            x_sides=np.zeros(x_sides, dtype=np.int64), first=squares[0], B=squares[1], V=squares[2], d=next(vectors),
            weights=np.zeros(sides), s=next(vectors), r=next(vectors),
        )  # fmt: skip
        self.now = _Now(numbers)
        self._functions, self._words = np.zeros(3, dtype=np.int64), np.zeros(_WORDS, dtype=np.int64)
        plain, missed = make_quadratic(sides + x_sides, n), make_quadratic(sides + x_sides + 1, n + 1)
        calls = self._functions, self._words
        self.advance = bound_to_all_memory(sequential.sequential, self.work, plain, missed, numbers, *calls)

    def evaluate_by(self, form: NonlinearForm) -> None:
        """Lets a program's functions be called by the kernel, where they are kernels."""
        self._functions[:] = 0
        if form.functions.is_native:
            self._functions[:] = functions.values.address, functions.slopes.address, functions.cost_hessian.address
            memory = self.work.trial, self.rows, self.J, self._weights, self.work.first.ravel()
            self._words[:] = form.functions.words(*memory)


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
        sides, x_sides = form.sides
        with _memory_for(form.num_vars, form.num_rows, len(sides), len(x_sides)) as memory:
            work = memory.work
            work.sides[:], work.x_sides[:] = sides, x_sides
            work.lower[:], work.upper[:] = form.lower, form.upper
            work.x_lower[:], work.x_upper[:] = form.x_lower, form.x_upper
            memory.evaluate_by(form)
            return self._iterate(memory)

    def _iterate(self, memory: _Memory) -> Outcome:
        work, now, form = memory.work, memory.now, self._form
        work.trial[:] = self._start
        now.penalty, now.held, now.gain, now.steps, now.stalls = 1.0, 0.0, np.inf, 0.0, 0.0
        now.stage, now.most = sequential.START, self._settings.iterations
        now.feasibility, now.shows = self._settings.feasibility, form.has_callbacks
        while True:
            found = memory.advance()
            if found == sequential.SLOPES:
                memory.rows[:], memory.J[:] = form.dense(work.trial)
            elif found == sequential.VALUES:
                work.f_trial[:], work.rows_trial[:] = form.values(work.trial)
            elif found == sequential.HESSIAN:
                work.first[:] = form.cost_hessian(work.trial)
            elif found == sequential.SHOW:
                form.show(work.y)
            elif found in (sequential.NO_STEP, sequential.NO_PROGRAM):
                is_done = self._is_done(work, now, found == sequential.NO_PROGRAM)
                if is_done is not None:
                    return self._outcome(work, is_done)
                now.stage, now.stalls = sequential.AGAIN, 1.0
            else:
                return self._outcome(work, found == sequential.SOLVED, found == sequential.SPENT)

    def _is_done(self, work: Sequence, now: Any, lacks_program: bool) -> bool | None:
        """Where no step leads further: whether the point is a solution; None: the first Hessian may be worth a try."""
        is_feasible = now.violation <= 0.5 * self._settings.feasibility
        brings_little = now.gain <= _ROUNDING * max(1.0, abs(now.f))
        is_done = is_feasible and (brings_little or (lacks_program and self._is_stationary(work)))
        is_far = not lacks_program and now.left > sequential.LEFT and now.longest <= sequential.LEFT
        return bool(is_done) if now.stalls or (is_done and lacks_program) or is_far else None

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
        return Outcome("SQP", work.y.copy(), converged, spent)
