"""Convex programs by Clarabel, an interior point method (Goulart and Chen, 2024)."""

from __future__ import annotations

import importlib.util
from typing import Any, NamedTuple

import numpy as np

from sheldrake.solvers._engines.conic import ConicForm
from sheldrake.solvers._engines.interface import SolverInterface
from sheldrake.solvers._ids import ProgramAttribute as A
from sheldrake.solvers._ids import SolutionResult, SolverOptions
from sheldrake.solvers._program.program import MathematicalProgram
from sheldrake.solvers._program_type import CONIC, quadratic_costs_are_convex
from sheldrake.solvers._result import MathematicalProgramResult

_RESULTS = {
    "Solved": SolutionResult.kSolutionFound,
    "AlmostSolved": SolutionResult.kSolutionFound,
    "PrimalInfeasible": SolutionResult.kInfeasibleConstraints,
    "AlmostPrimalInfeasible": SolutionResult.kInfeasibleConstraints,
    "DualInfeasible": SolutionResult.kDualInfeasible,
    "AlmostDualInfeasible": SolutionResult.kDualInfeasible,
    "MaxIterations": SolutionResult.kIterationLimit,
}


class ClarabelSolverDetails(NamedTuple):
    """What Clarabel tells of a solve; times in s."""

    solve_time: float
    iterations: int
    status: str


class ClarabelSolver(SolverInterface):
    """Solves convex programs with quadratic costs and linear, Lorentz, semidefinite and exponential cones.

    It stands on the package `clarabel`.
    """

    _name = "Clarabel"
    _attributes = CONIC | {A.kQuadraticCost, A.kL2NormCost}

    @classmethod
    def _is_available(cls) -> bool:
        return importlib.util.find_spec("clarabel") is not None

    def _why_not_available(self) -> str:
        return "stands on the package clarabel, which is not installed (pip install sheldrake[solvers])."

    def _restriction(self, prog: MathematicalProgram) -> str:
        if quadratic_costs_are_convex(prog):
            return ""
        return f"{type(self).__name__} is unable to solve because (at least) one quadratic cost is non-convex."

    def _do_solve(
        self, prog: MathematicalProgram, guess: np.ndarray, options: SolverOptions, result: MathematicalProgramResult
    ) -> None:
        import clarabel
        from scipy.sparse import triu

        form = ConicForm(prog)
        settings = self._settings(clarabel, options)
        cones = [_cone(clarabel, cone) for cone in form.cones]
        solver = clarabel.DefaultSolver(triu(form.P(), format="csc"), form.q, form.A(), form.b, cones, settings)
        found = solver.solve()
        status = str(found.status)
        x, z = np.array(found.x), np.array(found.z)
        result._details = ClarabelSolverDetails(found.solve_time, found.iterations, status)
        outcome = _RESULTS.get(status, SolutionResult.kSolverSpecificError)
        result._finish(outcome, form.x(x), form.cost(x))
        if outcome is SolutionResult.kSolutionFound:
            for binding, dual in form.duals(z):
                result._set_dual(binding, dual)

    def _settings(self, clarabel: Any, options: SolverOptions) -> Any:
        settings = clarabel.DefaultSettings()
        settings.verbose = self._prints(options)
        known = [name for name in dir(settings) if not name.startswith("_")]
        for key, value in self._given(options, known).items():
            kind = type(getattr(settings, key))
            setattr(settings, key, kind(value))
        return settings


def _cone(clarabel: Any, cone: Any) -> Any:
    if cone.kind == "exponential":
        return clarabel.ExponentialConeT()
    names = {
        "zero": clarabel.ZeroConeT,
        "nonnegative": clarabel.NonnegativeConeT,
        "second_order": clarabel.SecondOrderConeT,
        "psd": clarabel.PSDTriangleConeT,
    }
    return names[cone.kind](cone.size)
