"""Nonlinear programs without anything to install: an interior point method, also for those who ask for SNOPT."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sheldrake.solvers._engines.interior_point import Ending, interior_point
from sheldrake.solvers._engines.nonlinear import Multipliers, NonlinearSolver, Outcome, Settings, number
from sheldrake.solvers._engines.nonlinear_form import NonlinearForm
from sheldrake.solvers._engines.restoration import ALIKE, Restored, aside, restore
from sheldrake.solvers._engines.slsqp import by_slsqp
from sheldrake.solvers._engines.snopt_options import unknown, words_of
from sheldrake.solvers._engines.sqp import Sqp, suits
from sheldrake.solvers._ids import SolutionResult, SolverOptions

_LARGEST_DENSE = 200  # Variables up to which SLSQP, whose matrices are dense, is worth a try.
_ASIDE = 0.1, 0.3, 0.5, 1.0  # where else least violations are looked for, relative to the start
_ENOUGH = 3  # sides that must agree with where steps ended, itself among them, where none ends lower
_MOST_STEPS = 60  # of sequential quadratic programming: where they do not do, another method is a better bet


class SnoptSolverDetails(NamedTuple):
    """What is told of a solve: `info` is 1 for success, 13 for infeasible, 32 for too many iterations, else 41.

    `solve_time` is in seconds; `F` the cost and the values of all constraints but bounds of variables; `xmul` and
    `Fmul` the derivatives of the cost by the active bounds of variables and of `F`.
    """

    info: int
    solve_time: float
    xmul: np.ndarray
    F: np.ndarray
    Fmul: np.ndarray


_INFO = {
    SolutionResult.kSolutionFound: 1,
    SolutionResult.kInfeasibleConstraints: 13,
    SolutionResult.kUnbounded: 21,
    SolutionResult.kIterationLimit: 32,
}


class InteriorPointSolver(NonlinearSolver):
    """Solves nonlinear programs by the interior point method of this library.

    Programs of few variables are tried by sequential quadratic programming first ("SQP"), and by SciPy's SLSQP where
    that gets stuck. SLSQP is also tried where the interior point method gets stuck, or stops where constraints cannot
    be violated less. It heeds the options of SNOPT that `SnoptSolver` names.
    """

    _name = "InteriorPoint"

    def _read(self, options: SolverOptions) -> Settings:
        named = options._of("SNOPT")
        if not named:
            return Settings(prints=self._prints(options))
        if wrong := unknown(named):
            raise RuntimeError(
                f"SNOPT: the following solver option names were not recognized: {', '.join(wrong)}. Heeded are Major "
                "iterations limit, Major optimality tolerance, Major feasibility tolerance."
            )
        given = {words_of(name): value for name, value in named.items()}
        return Settings(
            optimality=min(1e-8, 1e-2 * number(given, ("major", "optimality"), 1e-6)),
            feasibility=number(given, ("major", "feasibility"), 1e-6),
            iterations=int(number(given, ("major", "iterations"), 1000)),
            prints=self._prints(options),
        )

    def _run(self, form: NonlinearForm, start: np.ndarray, settings: Settings) -> Outcome:
        is_stuck = False
        if suits(form):
            found = Sqp(form, start, settings._replace(iterations=min(settings.iterations, _MOST_STEPS))).run()
            if found.converged or (found.iterations_spent and settings.iterations <= _MOST_STEPS):
                return found
            # Others know their second derivatives, with which an interior point method gets on where steps do not.
            violates = form.learns and form.violation(found.y) > settings.feasibility
            if violates and (other := self._by_least_violation(form, found.y, start, settings)):
                return other
            # Where steps end that violate constraints, an interior point method mostly ends as well.
            is_stuck = violates and not found.iterations_spent
            if is_stuck and (other := self._by_slsqp(form, start, settings)):
                return other
        y, dual, ending = interior_point(form, start, settings.optimality, settings.feasibility, settings.iterations)
        found = Outcome(InteriorPointSolver._name, y, ending is Ending.CONVERGED, ending is Ending.ITERATIONS, dual)
        if is_stuck or ending not in (Ending.STUCK, Ending.INFEASIBLE) or form.num_vars > _LARGEST_DENSE:
            return found
        return self._by_slsqp(form, start, settings) or found

    @staticmethod
    def _by_least_violation(
        form: NonlinearForm, stuck: np.ndarray, start: np.ndarray, settings: Settings
    ) -> Outcome | None:
        """What is found from a point without violation; that there is none, where sides agree; or None."""
        limits = settings._replace(iterations=min(settings.iterations, _MOST_STEPS))
        leasts: list[Restored] = []
        for part in (0.0, *_ASIDE):
            least = restore(form, aside(form, start, part) if part else form.clip(stuck), settings.feasibility)
            if least.is_zero and (found := Sqp(form, least.y, limits).run()).converged:
                return found
            leasts.append(least)
            is_lowest = leasts[0].squares <= min(other.squares for other in leasts) * (1.0 + ALIKE)
            if is_lowest and sum(other.confirms(leasts[0]) for other in leasts) >= _ENOUGH:
                return Outcome("SQP", leasts[0].y, False, False)
        return None

    @staticmethod
    def _by_slsqp(form: NonlinearForm, start: np.ndarray, settings: Settings) -> Outcome | None:
        """What SLSQP finds; None if it violates constraints."""
        found = by_slsqp(form, start, settings)
        return found if form.violation(form.clip(found.y)) <= settings.feasibility else None

    def _details(
        self, kind: SolutionResult, outcome: Outcome, seconds: float, F: np.ndarray, multipliers: Multipliers
    ) -> SnoptSolverDetails:
        xmul = multipliers.low + multipliers.high
        return SnoptSolverDetails(_INFO.get(kind, 41), seconds, xmul, F, np.append(0.0, multipliers.rows))


class SnoptSolver(InteriorPointSolver):
    """Solves nonlinear programs for those who ask for SNOPT, which has no package that could be installed.

    What runs is `InteriorPointSolver`, and results say so: their solver id is "InteriorPoint", or "SQP" of programs of
    few variables. `available()` is true, as programs that ask for SNOPT run.

    Options that are heeded, in small letters or capitals: "Major iterations limit", "Major optimality tolerance",
    "Major feasibility tolerance"; other options of SNOPT are accepted without effect, what is none is refused.
    """

    _name = "SNOPT"
