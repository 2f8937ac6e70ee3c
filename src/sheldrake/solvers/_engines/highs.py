"""Linear and mixed-integer linear programs by HiGHS, which comes with SciPy (Huangfu and Hall, 2018)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sheldrake.solvers._engines.clarabel import ClarabelSolver
from sheldrake.solvers._engines.equality import quadratic_objective
from sheldrake.solvers._engines.interface import SolverInterface
from sheldrake.solvers._engines.linear import SMALL, maximize_small
from sheldrake.solvers._engines.linear_rows import LinearRows
from sheldrake.solvers._ids import ProgramAttribute as A
from sheldrake.solvers._ids import SolutionResult, SolverId, SolverOptions
from sheldrake.solvers._program.parts import parts_of
from sheldrake.solvers._program.program import MathematicalProgram
from sheldrake.solvers._program_type import LINEAR
from sheldrake.solvers._result import MathematicalProgramResult
from sheldrake.symbolic import Variable

if TYPE_CHECKING:
    import scipy.sparse
    from numpy.typing import ArrayLike

_RESULTS = {
    0: SolutionResult.kSolutionFound,
    1: SolutionResult.kIterationLimit,
    2: SolutionResult.kInfeasibleConstraints,
    3: SolutionResult.kUnbounded,
}


def linear_rows(prog: MathematicalProgram) -> tuple[Any, np.ndarray, np.ndarray, list]:
    """All linear constraints that are no bounds as lower <= A x <= upper, A sparse; and (binding, rows) of each."""
    found = LinearRows(prog, prog.GetLinearConstraints())
    return _sparse(found, prog.num_vars()), found.lower, found.upper, found.places


def _sparse(found: LinearRows, num_vars: int) -> scipy.sparse.csc_matrix:
    from scipy.sparse import csc_matrix

    return csc_matrix((found.values, (found.rows, found.cols)), shape=(found.num_rows, num_vars))


def variable_bounds(prog: MathematicalProgram) -> tuple[np.ndarray, np.ndarray]:
    """The tightest bounds of each decision variable."""
    lower, upper = np.full(prog.num_vars(), -np.inf), np.full(prog.num_vars(), np.inf)
    boxes = prog.bounding_box_constraints()
    if boxes:
        at = parts_of(prog).variables.places(np.concatenate([b._variables for b in boxes]))
        np.maximum.at(lower, at, np.concatenate([b._evaluator._lower for b in boxes]))
        np.minimum.at(upper, at, np.concatenate([b._evaluator._upper for b in boxes]))
    return lower, upper


def set_box_duals(
    prog: MathematicalProgram, result: MathematicalProgramResult, low: ArrayLike, high: ArrayLike
) -> None:
    """Duals of bounding boxes from those of the tightest bounds; the first box that is as tight gets them."""
    lower, upper = variable_bounds(prog)
    left_low, left_high = np.array(low, dtype=float), np.array(high, dtype=float)
    for b in prog.bounding_box_constraints():
        at, c = parts_of(prog).bindings.places(b), b._evaluator
        dual = np.zeros(len(at))
        for i, place in enumerate(at):
            if c._lower[i] == lower[place]:
                dual[i] += left_low[place]
                left_low[place] = 0.0
            if c._upper[i] == upper[place]:
                dual[i] += left_high[place]
                left_high[place] = 0.0
        result._set_dual(b, dual)


class ClpSolverDetails(NamedTuple):
    """What the solver tells of a solve: 0 optimal, 1 infeasible, 2 unbounded, 3 iterations spent."""

    status: int


_CLP_STATUS = {0: 0, 1: 3, 2: 1, 3: 2}
_CLP_CODES = {result: _CLP_STATUS[status] for status, result in _RESULTS.items()} | {SolutionResult.kDualInfeasible: 2}


class ClpSolver(SolverInterface):
    """Solves linear programs, and such with convex quadratic costs.

    In sheldrake the former are solved by HiGHS, by way of SciPy, or if they are small and have a solution by a simplex
    method of its own; the latter by Clarabel. Results say so: "HiGHS", "Simplex" or "Clarabel".
    """

    _name = "Clp"
    _method = "HiGHS"
    _attributes = LINEAR | {A.kQuadraticCost}

    def _restriction(self, prog: MathematicalProgram) -> str:
        return ClarabelSolver().ExplainUnsatisfiedProgramAttributes(prog).replace("ClarabelSolver", "ClpSolver")

    def _do_solve(
        self, prog: MathematicalProgram, guess: np.ndarray, options: SolverOptions, result: MathematicalProgramResult
    ) -> None:
        from scipy.optimize import linprog

        if prog.quadratic_costs():
            ClarabelSolver().Solve(prog, guess, options, result)
            result._details = ClpSolverDetails(_CLP_CODES.get(result.get_solution_result(), 4))
            return
        _, c, constant = quadratic_objective(prog)
        rows = LinearRows(prog, prog.GetLinearConstraints())
        low, high, bounds = rows.lower, rows.upper, variable_bounds(prog)
        if _box_is_empty(*bounds) or np.any(low > high):
            result._details = ClpSolverDetails(1)
            result._finish(SolutionResult.kInfeasibleConstraints, np.zeros(prog.num_vars()), np.inf)
            return
        if not self._prints(options) and _solve_small(prog, rows, bounds, c, constant, result):
            return
        M = _sparse(rows, prog.num_vars())
        equal = low == high
        above, below = ~equal & np.isfinite(high), ~equal & np.isfinite(low)
        from scipy.sparse import vstack

        A_ub = vstack((M[above], -M[below])) if above.any() or below.any() else None
        found = linprog(
            c,
            A_ub=A_ub,
            b_ub=None if A_ub is None else np.concatenate((high[above], -low[below])),
            A_eq=M[equal] if equal.any() else None,
            b_eq=low[equal] if equal.any() else None,
            bounds=np.stack(bounds, axis=1),
            method="highs",
            options={"disp": self._prints(options)},
        )
        outcome = _RESULTS.get(found.status, SolutionResult.kSolverSpecificError)
        result._details = ClpSolverDetails(_CLP_STATUS.get(found.status, 4))
        x = _least_violation(M, low, high, *bounds) if found.x is None else found.x
        result._finish(outcome, x, np.nan if found.fun is None else found.fun + constant)
        if outcome is SolutionResult.kSolutionFound:
            dual = np.zeros(len(low))
            dual[equal] = found.eqlin.marginals if equal.any() else 0.0
            marginals = found.ineqlin.marginals if A_ub is not None else np.zeros(0)
            dual[above] += marginals[: above.sum()]
            dual[below] -= marginals[above.sum() :]
            for b, places in rows.places:
                result._set_dual(b, dual[places])
            set_box_duals(prog, result, found.lower.marginals, found.upper.marginals)


def _solve_small(
    prog: MathematicalProgram,
    rows: LinearRows,
    bounds: tuple[np.ndarray, np.ndarray],
    c: np.ndarray,
    constant: float,
    result: MathematicalProgramResult,
) -> bool:
    """Solves a small program by the simplex method; whether there is a solution, which is then proven."""
    m, n = rows.num_rows, prog.num_vars()
    if 2 * (m + n) * n > SMALL:
        return False
    A = np.bincount(rows.rows * n + rows.cols, rows.values, m * n).reshape(m, n)
    A, lower, upper = np.vstack((A, np.eye(n))), np.append(rows.lower, bounds[0]), np.append(rows.upper, bounds[1])
    above, below = np.isfinite(upper), np.isfinite(lower)
    found = maximize_small(-c, np.vstack((A[above], -A[below])), np.append(upper[above], -lower[below]))
    if found.x is None or found.y is None:
        return False
    result._solver_id = SolverId("Simplex")
    result._details = ClpSolverDetails(_CLP_STATUS[0])
    result._finish(SolutionResult.kSolutionFound, found.x, c @ found.x + constant)
    at_lower, at_upper = np.zeros(m + n), np.zeros(m + n)
    at_upper[above], at_lower[below] = -found.y[: above.sum()], found.y[above.sum() :]
    for b, places in rows.places:
        result._set_dual(b, at_lower[places] + at_upper[places])
    set_box_duals(prog, result, at_lower[m:], at_upper[m:])
    return True


def _least_violation(
    M: scipy.sparse.spmatrix | np.ndarray, low: np.ndarray, high: np.ndarray, x_low: np.ndarray, x_high: np.ndarray
) -> np.ndarray:
    """The point within the bounds of the variables whose violations of the rows have the smallest sum."""
    from scipy.optimize import linprog
    from scipy.sparse import hstack, identity, vstack

    m, n = M.shape
    above, below = np.isfinite(high), np.isfinite(low)
    start = np.clip(np.zeros(n), x_low, x_high)
    if not (above.any() or below.any()):
        return start
    slack = -identity(m, format="csc")
    A_ub = vstack((hstack((M[above], slack[above])), hstack((-M[below], slack[below]))))
    bounds = np.stack((np.append(x_low, np.zeros(m)), np.append(x_high, np.full(m, np.inf))), axis=1)
    c = np.append(np.zeros(n), np.ones(m))
    found = linprog(c, A_ub=A_ub, b_ub=np.concatenate((high[above], -low[below])), bounds=bounds, method="highs")
    return start if found.x is None else found.x[:n]


def _box_is_empty(lower: np.ndarray, upper: np.ndarray) -> bool:
    return bool(np.any(lower > upper) or np.any(lower == np.inf) or np.any(upper == -np.inf))


class HighsSolver(SolverInterface):
    """Solves linear programs some of whose variables are 0 or 1."""

    _name = "HiGHS"
    _attributes = LINEAR | {A.kBinaryVariable}

    def _do_solve(
        self, prog: MathematicalProgram, guess: np.ndarray, options: SolverOptions, result: MathematicalProgramResult
    ) -> None:
        from scipy.optimize import Bounds, LinearConstraint, milp

        _, c, constant = quadratic_objective(prog)
        M, low, high, _ = linear_rows(prog)
        binary = np.array([v.get_type() is Variable.Type.BINARY for v in prog.decision_variables()], dtype=bool)
        lower, upper = variable_bounds(prog)
        lower, upper = np.where(binary, np.maximum(lower, 0.0), lower), np.where(binary, np.minimum(upper, 1.0), upper)
        if _box_is_empty(lower, upper) or np.any(low > high):
            result._finish(SolutionResult.kInfeasibleConstraints, np.full(prog.num_vars(), np.nan), np.inf)
            return
        found = milp(
            c,
            integrality=binary.astype(int),
            bounds=Bounds(lower, upper),
            constraints=LinearConstraint(M, low, high) if len(low) else None,
            options={"disp": self._prints(options), **options._of(self._name)},
        )
        outcome = _RESULTS.get(found.status, SolutionResult.kSolverSpecificError)
        x = np.full(prog.num_vars(), np.nan) if found.x is None else np.where(binary, np.round(found.x), found.x)
        result._finish(outcome, x, np.nan if found.fun is None else found.fun + constant)
