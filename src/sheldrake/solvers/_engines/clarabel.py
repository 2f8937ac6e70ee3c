"""Convex programs by Clarabel, an interior point method (Goulart and Chen, 2024)."""

from __future__ import annotations

import functools
import importlib.util
from collections.abc import Hashable, Iterable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sheldrake.solvers._engines.conic import ConicForm
from sheldrake.solvers._engines.interface import SolverInterface
from sheldrake.solvers._ids import ProgramAttribute as A
from sheldrake.solvers._ids import SolutionResult, SolverOptions
from sheldrake.solvers._program.program import MathematicalProgram
from sheldrake.solvers._program_type import CONIC, LINEAR, quadratic_costs_are_convex
from sheldrake.solvers._result import MathematicalProgramResult

if TYPE_CHECKING:
    from scipy.sparse import csc_matrix

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

        form = ConicForm(prog)
        settings = self._settings(clarabel, options)
        cones = [_cone(clarabel, cone) for cone in form.cones]
        solver = clarabel.DefaultSolver(form.upper_P(), form.q, form.A(), form.b, cones, settings)
        found = solver.solve()
        status = str(found.status)
        x, z = np.array(found.x), np.array(found.z)
        outcome = _RESULTS.get(status, SolutionResult.kSolverSpecificError)
        result._details = self._told(found, outcome, form.constant)
        result._finish(outcome, form.x(x), form.cost(x))
        if outcome is SolutionResult.kSolutionFound:
            for binding, dual in form.duals(z):
                result._set_dual(binding, dual)

    def _told(self, found: Any, outcome: SolutionResult, constant: float) -> ClarabelSolverDetails | CsdpSolverDetails:
        return ClarabelSolverDetails(found.solve_time, found.iterations, str(found.status))

    def _settings(self, clarabel: Any, options: SolverOptions) -> Any:
        settings = clarabel.DefaultSettings()
        settings.verbose = self._prints(options)
        for key, value in self._given(options, _names_of_settings(settings.__class__)).items():
            kind = type(getattr(settings, key))
            setattr(settings, key, kind(value))
        return settings


@functools.cache
def _names_of_settings(kind: Hashable) -> list[str]:
    return [name for name in dir(kind) if not name.startswith("_")]


class CsdpSolverDetails(NamedTuple):
    """What is told of a solve; objectives are of a maximum, that of the negative cost.

    `return_code` is 0 for solved, 1 and 2 for primal and dual infeasible, 4 for iterations spent, else 11. `y_val` and
    `Z_val`, variables of CSDP's own form of a program, are None where another solver ran.
    """

    return_code: int
    primal_objective: float
    dual_objective: float
    y_val: np.ndarray | None = None
    Z_val: csc_matrix | None = None


_CSDP_CODES = {
    SolutionResult.kSolutionFound: 0,
    SolutionResult.kInfeasibleConstraints: 1,
    SolutionResult.kDualInfeasible: 2,
    SolutionResult.kIterationLimit: 4,
}


class CsdpSolver(ClarabelSolver):
    """Solves semidefinite programs for those who ask for CSDP. In sheldrake Clarabel does it, and results say so.

    Options of CSDP are accepted without effect.
    """

    _name = "CSDP"
    _method = "Clarabel"
    _attributes = LINEAR | {
        A.kLorentzConeConstraint,
        A.kRotatedLorentzConeConstraint,
        A.kPositiveSemidefiniteConstraint,
    }

    def _given(self, options: SolverOptions, known: Iterable[str]) -> dict[str, Any]:
        return {}

    def _told(self, found: Any, outcome: SolutionResult, constant: float) -> CsdpSolverDetails:
        return CsdpSolverDetails(
            _CSDP_CODES.get(outcome, 11), -found.obj_val - constant, -found.obj_val_dual - constant
        )


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
