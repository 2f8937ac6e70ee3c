"""Operator splitting methods: OSQP and SCS.

First-order solvers of convex programs (extra `solvers`), for those who ask for them: Clarabel is more accurate.
"""

from __future__ import annotations

import functools
from typing import Any, NamedTuple

import numpy as np

from sheldrake.solvers import _arrays
from sheldrake.solvers._engines.columns import Columns
from sheldrake.solvers._engines.conic import ConicForm, LinearObjective
from sheldrake.solvers._engines.equality import quadratic_form
from sheldrake.solvers._engines.interface import Engine, is_installed
from sheldrake.solvers._engines.linear_rows import LinearRows, another
from sheldrake.solvers._ids import ProgramAttribute as A
from sheldrake.solvers._ids import SolutionResult, SolverOptions
from sheldrake.solvers._program.parts import parts_of
from sheldrake.solvers._program.program import MathematicalProgram
from sheldrake.solvers._program_type import CONIC, LINEAR, quadratic_costs_are_convex
from sheldrake.solvers._result import MathematicalProgramResult

_OSQP_OPTIONS = (
    "adaptive_rho", "adaptive_rho_fraction", "adaptive_rho_interval", "adaptive_rho_tolerance", "alpha",
    "check_dualgap", "check_termination", "delta", "eps_abs", "eps_dual_inf", "eps_prim_inf", "eps_rel",
    "linsys_solver", "max_iter", "polish", "polish_refine_iter", "polishing", "rho", "rho_is_vec",
    "scaled_termination", "scaling", "sigma", "time_limit", "verbose", "warm_starting",
)  # fmt: skip
_SCS_OPTIONS = (
    "acceleration_interval", "acceleration_lookback", "adaptive_scale", "alpha", "eps_abs", "eps_infeas", "eps_rel",
    "log_csv_filename", "max_iters", "normalize", "rho_x", "scale", "time_limit_secs", "verbose", "write_data_filename",
)  # fmt: skip


@functools.cache
def _osqp_algebra() -> str:
    """The one that OSQP takes by itself; it looks for packages that are not there each time, 200 us."""
    import osqp

    return osqp.OSQP().algebra


class OsqpSolverDetails(NamedTuple):
    """What OSQP tells of a solve; times in s."""

    iter: int
    status_val: int
    primal_res: float
    dual_res: float
    setup_time: float
    solve_time: float
    polish_time: float
    run_time: float
    y: np.ndarray


def _osqp_details(info: Any, y: np.ndarray) -> OsqpSolverDetails:
    return OsqpSolverDetails(
        iter=info.iter,
        status_val=info.status_val,
        primal_res=info.prim_res,
        dual_res=info.dual_res,
        setup_time=info.setup_time,
        solve_time=info.solve_time,
        polish_time=info.polish_time,
        run_time=info.run_time,
        y=np.asarray(y),
    )


_OSQP_RESULTS = {
    "solved": SolutionResult.kSolutionFound,
    "solved inaccurate": SolutionResult.kSolutionFound,
    "primal infeasible": SolutionResult.kInfeasibleConstraints,
    "primal infeasible inaccurate": SolutionResult.kInfeasibleConstraints,
    "dual infeasible": SolutionResult.kDualInfeasible,
    "dual infeasible inaccurate": SolutionResult.kDualInfeasible,
    "maximum iterations reached": SolutionResult.kIterationLimit,
}


class _OsqpForm:
    """The least 1/2 x' P x + q' x + constant with lower <= A x <= upper, bounds of variables being the last rows.

    Args:
        prog: The program.
    """

    def __init__(self, prog: MathematicalProgram) -> None:
        n, Q = prog.num_vars(), quadratic_form(prog)
        self.table = LinearRows(prog, [*prog.GetLinearConstraints(), *prog.bounding_box_constraints()])
        shape, (i, j) = (self.table.num_rows, n), Q.nonzero()
        i, j = i[i <= j], j[i <= j]
        self.P = Columns.of_triplets(i, j, Q[i, j], (n, n)).in_32_bits()
        self.A = Columns.of_triplets(*self.table.entries, shape).in_32_bits()
        self.matrices: tuple[Any, Any] | None = None  # P and A as OSQP has them, once it was asked
        self._objective = LinearObjective(prog)
        self.q, self.constant = self._objective.now()

    def moved(self, prog: MathematicalProgram) -> _OsqpForm:
        """The form of the program with other bounds, linear costs and constants."""
        out = another(self)
        out.table, (out.q, out.constant) = self.table.again(), self._objective.now()
        return out


def _osqp_solver(osqp: Any, form: _OsqpForm, settings: dict[str, Any]) -> Any:
    """OSQP's own solver of a form; `osqp.OSQP.setup` looks at matrices that are in order for as long as it solves."""
    made = osqp.OSQP(algebra=_osqp_algebra())
    ext = made.ext
    if form.matrices is None:
        form.matrices = ext.CSC(form.P), ext.CSC(form.A)
    made.settings = ext.OSQPSettings()
    ext.osqp_set_default_settings(made.settings)
    made.update_settings(**settings)
    most, (P, A) = made.constant("OSQP_INFTY"), form.matrices
    lower, upper = np.maximum(form.table.lower, -most), np.minimum(form.table.upper, most)
    return ext.OSQPSolver(P, form.q, A, lower, upper, *form.A.shape, made.settings)


class OsqpSolver(Engine):
    """Solves convex quadratic programs (Stellato et al., 2020). It stands on the package `osqp`."""

    _name = "OSQP"
    _attributes = LINEAR | {A.kQuadraticCost}

    @classmethod
    def _is_available(cls) -> bool:
        return is_installed("osqp")

    def _why_not_available(self) -> str:
        return "stands on the package osqp, which is not installed (pip install osqp)."

    def _restriction(self, prog: MathematicalProgram) -> str:
        if not prog.quadratic_costs():
            return "OsqpSolver is unable to solve because a QuadraticCost is required but has not been declared."
        if quadratic_costs_are_convex(prog):
            return ""
        return "OsqpSolver is unable to solve because (at least) one quadratic cost is non-convex."

    def _do_solve(
        self, prog: MathematicalProgram, guess: np.ndarray, options: SolverOptions, result: MathematicalProgramResult
    ) -> None:
        import osqp

        form = parts_of(prog).form(_OsqpForm, prog)
        settings = {"eps_abs": 1e-8, "eps_rel": 1e-8, "max_iter": 100000, "polishing": True}
        settings["verbose"] = self._prints(options)
        settings.update(self._given(options, _OSQP_OPTIONS))
        if "polish" in settings:
            settings["polishing"] = bool(settings.pop("polish"))
        try:
            solver = _osqp_solver(osqp, form, settings)
        except ValueError:  # of an option; OSQP has printed which, as in Drake
            result._finish(SolutionResult.kInvalidInput, None, np.nan)
            return
        solver.solve()
        info, found = solver.info, solver.solution
        result._details = _osqp_details(info, found.y)
        outcome = _OSQP_RESULTS.get(info.status, SolutionResult.kSolverSpecificError)
        result._finish(outcome, found.x, info.obj_val + form.constant)
        if outcome is SolutionResult.kSolutionFound:
            dual = -np.asarray(found.y)
            result._set_duals_late(lambda: [(b, dual[rows]) for b, rows in form.table.places])


class ScsSolverDetails(NamedTuple):
    """What SCS tells of a solve; times in ms."""

    scs_status: int
    iter: int
    primal_objective: float
    dual_objective: float
    primal_residue: float
    residue_infeasibility: float
    residue_unbounded_a: float
    residue_unbounded_p: float
    duality_gap: float
    scs_setup_time: float
    scs_solve_time: float
    y: np.ndarray
    s: np.ndarray


_SCS_INFO = {
    "scs_status": "status_val",
    "iter": "iter",
    "primal_objective": "pobj",
    "dual_objective": "dobj",
    "primal_residue": "res_pri",
    "residue_infeasibility": "res_infeas",
    "residue_unbounded_a": "res_unbdd_a",
    "residue_unbounded_p": "res_unbdd_p",
    "duality_gap": "gap",
    "scs_setup_time": "setup_time",
    "scs_solve_time": "solve_time",
}


_SCS_RESULTS = {
    1: SolutionResult.kSolutionFound,
    2: SolutionResult.kSolutionFound,
    -2: SolutionResult.kInfeasibleConstraints,
    -7: SolutionResult.kInfeasibleConstraints,
    -1: SolutionResult.kUnbounded,
    -6: SolutionResult.kUnbounded,
}


class _ScsForm:
    """The conic form of a program with rows in the order of SCS.

    Args:
        prog: The program.
    """

    def __init__(self, prog: MathematicalProgram) -> None:
        form = self.conic = ConicForm(prog)
        if form.num_rows == 0:  # of which SCS takes none
            form.add_empty_row()
        self.order = _rows_for_scs(form)
        self.cones = _cones_of_scs(form)
        at = np.empty_like(self.order)
        at[self.order] = np.arange(len(at))
        self.P = form.upper_P.for_scipy()
        self.A = Columns.of_triplets(at[form.A.indices], form.A.cols(), form.A.data, form.A.shape).for_scipy()

    def moved(self, prog: MathematicalProgram) -> _ScsForm | None:
        """The form of the program with other bounds, linear costs and constants; None where it has other rows then."""
        conic = self.conic.moved(prog)
        if conic is None:
            return None
        out = another(self)
        out.conic = conic
        return out

    def data(self) -> dict[str, Any]:
        """The arrays as SCS asks for them."""
        return {"P": self.P, "A": self.A, "b": self.conic.b[self.order], "c": self.conic.q}


def _cones_of_scs(form: ConicForm) -> dict[str, Any]:
    cones: dict[str, Any] = {"z": 0, "l": 0, "q": [], "s": [], "ep": 0}
    for cone in form.cones:
        if cone.kind in ("zero", "nonnegative"):
            cones["z" if cone.kind == "zero" else "l"] += cone.size
        elif cone.kind == "exponential":
            cones["ep"] += 1
        else:
            cones["q" if cone.kind == "second_order" else "s"].append(cone.size)
    return cones


_SCS_ORDER = {"zero": 0, "nonnegative": 1, "second_order": 2, "psd": 3, "exponential": 4}


class ScsSolver(Engine):
    """Solves convex programs with cones (O'Donoghue et al., 2016). It stands on the package `scs`."""

    _name = "SCS"
    _attributes = CONIC | {A.kQuadraticCost, A.kL2NormCost}

    @classmethod
    def _is_available(cls) -> bool:
        return is_installed("scs")

    def _why_not_available(self) -> str:
        return "stands on the package scs, which is not installed (pip install scs)."

    def _restriction(self, prog: MathematicalProgram) -> str:
        if quadratic_costs_are_convex(prog):
            return ""
        return "ScsSolver is unable to solve because (at least) one quadratic cost is non-convex."

    def _do_solve(
        self, prog: MathematicalProgram, guess: np.ndarray, options: SolverOptions, result: MathematicalProgramResult
    ) -> None:
        import scs

        given = parts_of(prog).form(_ScsForm, prog)
        form, order = given.conic, given.order
        settings = {"eps_abs": 1e-8, "eps_rel": 1e-8, "verbose": self._prints(options)}
        settings.update(self._given(options, _SCS_OPTIONS))
        found = scs.SCS(given.data(), given.cones, **settings).solve()
        z = np.empty(len(order))
        z[order] = found["y"]
        info = found["info"]
        result._details = ScsSolverDetails(
            **{name: info[k] for name, k in _SCS_INFO.items()}, y=found["y"], s=found["s"]
        )
        outcome = _SCS_RESULTS.get(info["status_val"], SolutionResult.kSolverSpecificError)
        x = np.asarray(found["x"])
        result._finish(outcome, form.x(x), form.cost(x))
        if outcome is SolutionResult.kSolutionFound:
            result._set_duals_late(functools.partial(form.duals, z))


def _rows_for_scs(form: ConicForm) -> np.ndarray:
    """Rows in the order of SCS: kinds of cones in turn, and of matrices the lower triangle by columns."""
    found: list[tuple[int, np.ndarray]] = []
    at = 0
    for cone in form.cones:
        size = cone.size * (cone.size + 1) // 2 if cone.kind == "psd" else cone.size
        rows = np.arange(at, at + size)
        if cone.kind == "psd":
            j, i = np.tril_indices(cone.size)
            rows = rows[np.lexsort((j, i))]
        found.append((_SCS_ORDER[cone.kind], rows))
        at += size
    return _arrays.joined([rows for _, rows in sorted(found, key=lambda item: item[0])], int)
