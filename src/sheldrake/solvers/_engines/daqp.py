"""Convex quadratic programs by DAQP, a dual active-set method on dense matrices.

D. Arnström, A. Bemporad and D. Axehill, A dual active-set solver for embedded quadratic programming, 2022.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sheldrake.solvers._engines.conic import LinearObjective
from sheldrake.solvers._engines.equality import quadratic_form
from sheldrake.solvers._engines.highs import linear_rows, set_box_duals, variable_bounds
from sheldrake.solvers._engines.interface import Engine, is_installed
from sheldrake.solvers._ids import ProgramAttribute as A
from sheldrake.solvers._ids import SolutionResult, SolverOptions
from sheldrake.solvers._program.program import MathematicalProgram
from sheldrake.solvers._program_type import LINEAR, quadratic_costs_are_convex
from sheldrake.solvers._result import MathematicalProgramResult

_OPTIONS = (
    "cycle_tol", "dual_tol", "eps_prox", "eq_reduction", "eta_prox", "fval_bound", "iter_limit", "pivot_tol",
    "primal_tol", "progress_tol", "refactor_tol", "sing_tol", "time_limit", "zero_tol",
)  # fmt: skip
_ABSENT = 1e30  # what DAQP takes for no bound
_EQUATION = 5  # its mark of a row that holds with equality
_RESULTS = {
    1: SolutionResult.kSolutionFound,
    -1: SolutionResult.kInfeasibleConstraints,
    -3: SolutionResult.kUnbounded,
    -4: SolutionResult.kIterationLimit,
    -7: SolutionResult.kIterationLimit,  # the time limit
}


class DaqpSolverDetails(NamedTuple):
    """What DAQP tells of a solve; times in s.

    `exitflag` is 1 for a solution. `multipliers` are positive at upper bounds: of variables, of linear inequalities, of
    linear equalities.
    """

    exitflag: int
    iterations: int
    setup_time: float
    solve_time: float
    multipliers: np.ndarray


class DaqpSolver(Engine):
    """Solves convex quadratic programs of up to some hundred variables. It stands on the package `daqp`.

    Options are DAQP's settings by name, such as "iter_limit" and "primal_tol". The guess is not used.
    """

    _name = "DAQP"
    _attributes = LINEAR | {A.kQuadraticCost}

    @classmethod
    def _is_available(cls) -> bool:
        return is_installed("daqp")

    def _why_not_available(self) -> str:
        return "stands on the package daqp, which is not installed (pip install sheldrake[solvers])."

    def _restriction(self, prog: MathematicalProgram) -> str:
        if not prog.quadratic_costs():
            return "DaqpSolver is unable to solve because a QuadraticCost is required but has not been declared."
        if quadratic_costs_are_convex(prog):
            return ""
        return "DaqpSolver is unable to solve because (at least) one quadratic cost is non-convex."

    def _do_solve(
        self, prog: MathematicalProgram, guess: np.ndarray, options: SolverOptions, result: MathematicalProgramResult
    ) -> None:
        import daqp

        n = prog.num_vars()
        Q, (c, constant) = quadratic_form(prog), LinearObjective(prog).now()
        M, low, high, places = linear_rows(prog)
        x_low, x_high = variable_bounds(prog)
        lower, upper = np.concatenate((x_low, low)), np.concatenate((x_high, high))
        sense = np.where(np.isfinite(lower) & (lower == upper), _EQUATION, 0).astype(np.int32)
        x, _, flag, info = daqp.solve(
            Q,
            c,
            np.ascontiguousarray(M.toarray()),
            np.clip(upper, -_ABSENT, _ABSENT),
            np.clip(lower, -_ABSENT, _ABSENT),
            sense,
            **self._given(options, _OPTIONS),
        )
        multipliers = np.asarray(info["lam"], dtype=float)
        result._details = DaqpSolverDetails(
            int(flag), int(info["iterations"]), float(info["setup_time"]), float(info["solve_time"]), multipliers
        )
        outcome = _RESULTS.get(int(flag), SolutionResult.kSolverSpecificError)
        result._finish(outcome, x, 0.5 * x @ Q @ x + c @ x + constant)
        if outcome is SolutionResult.kSolutionFound:
            for binding, rows in places:
                result._set_dual(binding, -multipliers[n:][rows])
            set_box_duals(prog, result, np.maximum(-multipliers[:n], 0.0), np.minimum(-multipliers[:n], 0.0))
