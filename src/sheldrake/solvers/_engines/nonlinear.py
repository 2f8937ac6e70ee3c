"""Nonlinear programs: what all their solvers have in common."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Hashable
from typing import Any, NamedTuple

import numpy as np

from sheldrake.common._blas import one_thread
from sheldrake.solvers._engines.interface import Engine
from sheldrake.solvers._engines.nonlinear_form import NonlinearForm
from sheldrake.solvers._ids import SolutionResult, SolverOptions
from sheldrake.solvers._program.program import MathematicalProgram
from sheldrake.solvers._program_type import NONLINEAR
from sheldrake.solvers._result import MathematicalProgramResult


class Settings(NamedTuple):
    """Tolerances and limits that all methods share, and options of one of them."""

    optimality: float = 1e-8
    feasibility: float = 1e-6
    iterations: int = 1000
    prints: bool = False
    more: dict[str, Any] | None = None


class Outcome(NamedTuple):
    """Where a method of a name stopped; derivatives of the cost by the bounds of rows there, and its status, if any."""

    by: str
    y: np.ndarray
    converged: bool
    iterations_spent: bool
    dual: np.ndarray | None = None
    status: int | None = None


class Multipliers(NamedTuple):
    """Derivatives of the cost by the bounds of rows, and by the lower and the upper bounds of variables."""

    rows: np.ndarray
    low: np.ndarray
    high: np.ndarray


class NonlinearSolver(Engine):
    """A solver of nonlinear programs. The result names who found it."""

    _attributes = frozenset(NONLINEAR)

    def _do_solve(
        self, prog: MathematicalProgram, guess: np.ndarray, options: SolverOptions, result: MathematicalProgramResult
    ) -> None:
        form = NonlinearForm(prog)
        settings = self._read(options)
        if (form.x_lower > form.x_upper).any() or (form.lower > form.upper).any():
            x = np.where(np.isnan(guess), 0.0, guess)  # so that what else is violated there can be told
            result._finish(SolutionResult.kInfeasibleConstraints, x, np.inf)
            return
        start = form.start(guess)
        began = time.perf_counter()
        with np.errstate(all="ignore"), one_thread():
            outcome = self._run(form, start, settings)
            seconds = time.perf_counter() - began
            y = form.clip(outcome.y) if np.isfinite(outcome.y).all() else start
            self._conclude(form, y, outcome, settings, seconds, result)

    def _conclude(
        self,
        form: NonlinearForm,
        y: np.ndarray,
        outcome: Outcome,
        settings: Settings,
        seconds: float,
        result: MathematicalProgramResult,
    ) -> None:
        result._solver = outcome.by
        # Functions are called now: later they may be others. What is made of their values can wait.
        multipliers = _Late(_multipliers(form, y, outcome.dual))
        F, violation = form.functions.values(y).copy(), form.violation(y)
        cost = F.item(0)
        spent = outcome.iterations_spent
        if violation > settings.feasibility:
            kind = SolutionResult.kIterationLimit if spent else SolutionResult.kInfeasibleConstraints
        elif cost < -1e15 or np.isnan(cost):
            kind = SolutionResult.kUnbounded
        elif outcome.converged:
            kind = SolutionResult.kSolutionFound
        else:
            kind = SolutionResult.kIterationLimit if spent else SolutionResult.kSolverSpecificError
        result._finish(kind, y * form.scale, cost)
        if kind is not SolutionResult.kUnbounded:
            result._cost = cost  # That of the point where it stopped, feasible or not.
        result._set_details_late(lambda: self._details(kind, outcome, seconds, F, multipliers()))
        if kind is SolutionResult.kSolutionFound:
            own, boxes = form.rows, form.boxes
            result._set_duals_late(
                lambda: itertools.chain(
                    ((row.binding, multipliers().rows[row.rows]) for row in own),
                    boxes.duals(multipliers().low, multipliers().high),
                )
            )

    def _read(self, options: SolverOptions) -> Settings:
        raise NotImplementedError

    def _run(self, form: NonlinearForm, start: np.ndarray, settings: Settings) -> Outcome:
        raise NotImplementedError

    def _details(
        self, kind: SolutionResult, outcome: Outcome, seconds: float, F: np.ndarray, multipliers: Multipliers
    ) -> Any:
        """What the solver tells: `F` is the cost and all rows."""
        raise NotImplementedError


class _Late:
    """Multipliers that are computed when somebody asks, once; `functools.cache` would take as long to make."""

    def __init__(self, compute: Callable[[], Multipliers]):
        self._compute = compute
        self._found: Multipliers | None = None

    def __call__(self) -> Multipliers:
        if self._found is None:
            self._found = self._compute()
        return self._found


def _multipliers(form: NonlinearForm, y: np.ndarray, dual: np.ndarray | None) -> Callable[[], Multipliers]:
    """Those of rows and of bounds of variables: what of the cost's gradient those of rows leave."""
    if dual is None:
        at = form.slopes(y)
        return lambda: Multipliers(*form.multipliers(at))
    _, entries = form.constraints(y)
    left: np.ndarray = form.cost(y)[1] - np.bincount(form.J_cols, entries * dual[form.J_rows], form.num_vars)
    near = 1e-5 * np.maximum(1.0, np.abs(y))
    left = left / form.scale
    low = np.where(y - form.x_lower <= near, np.maximum(left, 0.0), 0.0)
    found = Multipliers(dual, low, np.where(form.x_upper - y <= near, np.minimum(left, 0.0), 0.0))
    return lambda: found


def number(values: dict, key: Hashable, default: float) -> float:
    """An option as a float."""
    return float(values.get(key, default))
