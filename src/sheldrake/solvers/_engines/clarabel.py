"""Convex programs by Clarabel, an interior point method (Goulart and Chen, 2024)."""

from __future__ import annotations

import functools
import importlib.util
import os
import sys
from collections.abc import Hashable, Iterable, Sequence
from importlib.machinery import PathFinder
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sheldrake.solvers._engines.columns import Columns
from sheldrake.solvers._engines.conic import Cone, ConicForm
from sheldrake.solvers._engines.interface import Engine, is_installed
from sheldrake.solvers._ids import ProgramAttribute as A
from sheldrake.solvers._ids import SolutionResult, SolverOptions
from sheldrake.solvers._program.parts import parts_of
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


_SILENT = {"verbose": False}  # not to be changed


class ClarabelSolverDetails(NamedTuple):
    """What Clarabel tells of a solve; times in s."""

    solve_time: float
    iterations: int
    status: str


class ClarabelSolver(Engine):
    """Solves convex programs with quadratic costs and linear, Lorentz, semidefinite and exponential cones.

    It stands on the package `clarabel`.
    """

    _name = "Clarabel"
    _attributes = CONIC | {A.kQuadraticCost, A.kL2NormCost}

    @classmethod
    def _is_available(cls) -> bool:
        return is_installed("clarabel")

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

        form = parts_of(prog).form(ConicForm.of, prog)
        found = _Prepared.of(clarabel, form, self._settings(clarabel, options)).solve(form)
        status = str(found.status)
        x, z = np.array(found.x), np.array(found.z)
        outcome = _RESULTS.get(status, SolutionResult.kSolverSpecificError)
        result._details = self._told(found, status, outcome, form.constant)
        result._finish(outcome, form.x(x), found.obj_val + form.constant)
        if outcome is SolutionResult.kSolutionFound:
            result._set_duals_late(functools.partial(form.duals, z))

    def _told(
        self, found: Any, status: str, outcome: SolutionResult, constant: float
    ) -> ClarabelSolverDetails | CsdpSolverDetails:
        return ClarabelSolverDetails(found.solve_time, found.iterations, status)

    def _settings(self, clarabel: Any, options: SolverOptions) -> dict[str, Any]:
        if not options.options:
            return _SILENT
        defaults = clarabel.DefaultSettings()
        given = self._given(options, _names_of_settings(defaults.__class__))
        found = {key: type(getattr(defaults, key))(value) for key, value in given.items()}
        return {"verbose": self._prints(options), **found}


class _Prepared:
    """Clarabel with the matrices of a form, lent by the form while a program is solved, or by one of the same numbers.

    What it makes of matrices and linear costs before it begins does not depend on bounds. These it is told once more,
    as scaling them in both ways rounds them in two: so a solution has the bits of a form that nobody has asked before.
    """

    def __init__(self, clarabel: Any, form: ConicForm, settings: dict[str, Any]) -> None:
        self.settings, self._q, self._b = settings, form.q, None if form.is_linear() else form.b
        given = _silent_settings(clarabel) if settings is _SILENT else _made_settings(clarabel, settings)
        cones = _cones(clarabel, form.cones)
        P, A = form.lists
        self._solver = clarabel.DefaultSolver(P, form.q.tolist(), A, form.b.tolist(), cones, given)

    @classmethod
    def of(cls, clarabel: Any, form: ConicForm, settings: dict[str, Any]) -> _Prepared:
        """One that is idle, if it fits, or a new one."""
        try:
            found = form.idle.pop()  # another thread may be solving the same program
        except IndexError:
            return cls(clarabel, form, settings)
        has_costs = found._q is form.q or found._q.tobytes() == form.q.tobytes()
        fits = found.settings == settings and has_costs and (found._b is form.b or form.is_linear())
        return found if fits else cls(clarabel, form, settings)

    def solve(self, form: ConicForm) -> Any:
        """What Clarabel finds."""
        again = self._solver.is_data_update_allowed()
        if again and self._b is not form.b:
            self._solver.update(b=form.b.tolist())
            self._b = form.b
        found = self._solver.solve()
        if again:
            form.idle.append(self)
        return found


@functools.cache
def _take_lapack(clarabel: Any) -> None:
    """Has Clarabel take the functions it factors semidefinite matrices with from two modules of `scipy.linalg`.

    It keeps them for the life of the process. Left alone it imports the whole package, which takes 20 times as long;
    who imports that later finds nothing of this.
    """
    import scipy

    names = [name for name in ("scipy.linalg.cython_blas", "scipy.linalg.cython_lapack") if name not in sys.modules]
    try:
        for name in names:
            spec = PathFinder.find_spec(name, [os.path.join(scipy.__path__[0], "linalg")])
            if spec is None or spec.loader is None:
                return  # it is elsewhere in this SciPy: Clarabel will find it
            sys.modules[name] = importlib.util.module_from_spec(spec)
            spec.loader.exec_module(sys.modules[name])
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        n = 4  # smaller matrices need less than larger ones do
        unit = np.eye(n)[np.tril_indices(n)]
        P, A = Columns.of(np.zeros((unit.size, unit.size))), Columns.of(-np.eye(unit.size))
        clarabel.DefaultSolver(P, unit, A, unit, [clarabel.PSDTriangleConeT(n)], settings).solve()
    finally:
        for name in names:
            sys.modules.pop(name, None)


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

    def _told(self, found: Any, status: str, outcome: SolutionResult, constant: float) -> CsdpSolverDetails:
        return CsdpSolverDetails(
            _CSDP_CODES.get(outcome, 11), -found.obj_val - constant, -found.obj_val_dual - constant
        )


def minimize_on_cones(q: np.ndarray, A: np.ndarray, b: np.ndarray, cones: list[Cone]) -> np.ndarray | None:
    """The x with the least q' x and b - A x in cones, row after row; None if there is none, or no Clarabel.

    For callers that know their program: to make a `MathematicalProgram` takes several times as long as to solve it.
    """
    if not ClarabelSolver._is_available():
        return None
    import clarabel

    P, kinds, settings = Columns.of(np.zeros((q.size, q.size))), _cones(clarabel, cones), _silent_settings(clarabel)
    found = clarabel.DefaultSolver(P, q, Columns.of(A), b, kinds, settings).solve()
    return np.array(found.x) if str(found.status) in ("Solved", "AlmostSolved") else None


def _made_settings(clarabel: Any, settings: dict[str, Any]) -> Any:
    made = clarabel.DefaultSettings()
    for key, value in settings.items():
        setattr(made, key, value)
    return made


@functools.cache
def _silent_settings(clarabel: Any) -> Any:
    """Settings of which solvers take copies; not to be changed."""
    return _made_settings(clarabel, _SILENT)


_CLASSES = {
    "zero": "ZeroConeT",
    "nonnegative": "NonnegativeConeT",
    "second_order": "SecondOrderConeT",
    "psd": "PSDTriangleConeT",
}


def _cones(clarabel: Any, cones: Sequence[Cone]) -> list[Any]:
    """The cones as Clarabel's."""
    if any([cone.kind == "psd" for cone in cones]):
        _take_lapack(clarabel)
    return [
        clarabel.ExponentialConeT() if kind == "exponential" else getattr(clarabel, _CLASSES[kind])(size)
        for kind, size in cones
    ]
