"""Linear and mixed-integer linear programs by HiGHS, which comes with SciPy (Huangfu and Hall, 2018)."""

from __future__ import annotations

import functools
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sheldrake.solvers._engines.clarabel import ClarabelSolver
from sheldrake.solvers._engines.conic import LinearObjective
from sheldrake.solvers._engines.interface import Engine
from sheldrake.solvers._engines.linear import SMALL, maximize, maximize_small
from sheldrake.solvers._engines.linear_rows import LinearRows, another
from sheldrake.solvers._functions.bindings import BindingBase
from sheldrake.solvers._ids import ProgramAttribute as A
from sheldrake.solvers._ids import SolutionResult, SolverOptions
from sheldrake.solvers._kernels.simplex import INFEASIBLE, OPTIMAL, UNBOUNDED, UNDECIDED
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

    rows, cols, values = found.entries
    return csc_matrix((values, (rows, cols)), shape=(found.num_rows, num_vars))


def variable_bounds(prog: MathematicalProgram) -> tuple[np.ndarray, np.ndarray]:
    """The tightest bounds of each decision variable."""
    return Boxes(prog).bounds


def set_box_duals(
    prog: MathematicalProgram, result: MathematicalProgramResult, low: ArrayLike, high: ArrayLike
) -> None:
    """Duals of bounding boxes from those of the tightest bounds; the first box that is as tight gets them."""
    for b, dual in Boxes(prog).duals(low, high):
        result._set_dual(b, dual)


class Boxes:
    """The bounds of the variables of a program, and which constraints say so.

    Args:
        prog: The program.

    Attributes:
        bounds: The tightest lower and upper bounds of all decision variables.
    """

    def __init__(self, prog: MathematicalProgram) -> None:
        lower, upper = np.full(prog.num_vars(), -np.inf), np.full(prog.num_vars(), np.inf)
        self.bounds, self._boxes = (lower, upper), prog.bounding_box_constraints()
        if self._boxes:
            self._at = parts_of(prog).bindings.places(*self._boxes)
            self._given = [
                np.concatenate([b._evaluator._lower for b in self._boxes]),
                np.concatenate([b._evaluator._upper for b in self._boxes]),
            ]
            np.maximum.at(lower, self._at, self._given[0])
            np.minimum.at(upper, self._at, self._given[1])

    def duals(self, low: ArrayLike, high: ArrayLike) -> Iterator[tuple[BindingBase, np.ndarray]]:
        """Duals of the constraints from those of the tightest bounds; the first that is as tight gets them."""
        if not self._boxes:
            return
        dual = np.zeros(len(self._at))
        for given, tightest, of_bounds in zip(self._given, self.bounds, (low, high)):
            tight = np.flatnonzero(given == tightest[self._at])[::-1]
            first = np.full(len(tightest), -1)
            first[self._at[tight]] = tight  # of those at one place the last is kept, which is the first box
            has_some = first >= 0
            dual[first[has_some]] += np.asarray(of_bounds, dtype=float)[has_some]
        begin = 0
        for b in self._boxes:
            end = begin + len(b._variables)
            yield b, dual[begin:end]
            begin = end


class LinearForm:
    """A linear program: the least c' x + constant with rows and bounds of variables.

    Args:
        prog: The program.
    """

    def __init__(self, prog: MathematicalProgram) -> None:
        self.rows, self._objective = LinearRows(prog, prog.GetLinearConstraints()), LinearObjective(prog)
        self._take_numbers(prog)

    def _take_numbers(self, prog: MathematicalProgram) -> None:
        self.c, self.constant = self._objective.now()
        self.boxes = Boxes(prog)

    def moved(self, prog: MathematicalProgram) -> LinearForm:
        """The form of the program with other bounds and costs."""
        out = another(self)
        out.rows = self.rows.again()
        out.__dict__.pop("inequalities", None)
        out._take_numbers(prog)
        return out

    def is_empty(self) -> bool:
        """Whether a row or the bounds of a variable alone leave nothing."""
        return _box_is_empty(*self.boxes.bounds) or bool((self.rows.lower > self.rows.upper).any())

    @functools.cached_property
    def _dense(self) -> np.ndarray:
        """Rows and bounds as one matrix."""
        m, n, (rows, cols, values) = self.rows.num_rows, len(self.c), self.rows.entries
        A = np.bincount(rows * n + cols, values, m * n).reshape(m, n)
        return np.vstack((A, np.eye(n)))

    @functools.cached_property
    def inequalities(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """A and b of A x <= b, and which rows and bounds have an upper and which a lower limit."""
        lower, upper = self.boxes.bounds
        lower, upper = np.concatenate((self.rows.lower, lower)), np.concatenate((self.rows.upper, upper))
        above, below = np.isfinite(upper), np.isfinite(lower)
        A = np.concatenate((self._dense[above], -self._dense[below]))
        return A, np.concatenate((upper[above], -lower[below])), above, below


class ClpSolverDetails(NamedTuple):
    """What the solver tells of a solve: 0 optimal, 1 infeasible, 2 unbounded, 3 iterations spent."""

    status: int


_OUTCOMES = {
    OPTIMAL: SolutionResult.kSolutionFound,
    INFEASIBLE: SolutionResult.kInfeasibleConstraints,
    UNBOUNDED: SolutionResult.kUnbounded,
}
_CLP_STATUS = {0: 0, 1: 3, 2: 1, 3: 2}
_CLP_CODES = {result: _CLP_STATUS[status] for status, result in _RESULTS.items()} | {SolutionResult.kDualInfeasible: 2}


class ClpSolver(Engine):
    """Solves linear programs, and such with convex quadratic costs.

    In sheldrake the former are solved by HiGHS, by way of SciPy, or if they are small by a simplex method of its own;
    the latter by Clarabel. Results say so: "HiGHS", "Simplex" or "Clarabel".
    """

    _name = "Clp"
    _method = "HiGHS"
    _attributes = LINEAR | {A.kQuadraticCost}

    def _restriction(self, prog: MathematicalProgram) -> str:
        return ClarabelSolver().ExplainUnsatisfiedProgramAttributes(prog).replace("ClarabelSolver", "ClpSolver")

    def _do_solve(
        self, prog: MathematicalProgram, guess: np.ndarray, options: SolverOptions, result: MathematicalProgramResult
    ) -> None:
        if prog.quadratic_costs():
            ClarabelSolver().Solve(prog, guess, options, result)
            result._details = ClpSolverDetails(_CLP_CODES.get(result.get_solution_result(), 4))
            return
        form = parts_of(prog).form(LinearForm, prog)
        if form.is_empty():
            result._details = ClpSolverDetails(1)
            result._finish(SolutionResult.kInfeasibleConstraints, np.zeros(prog.num_vars()), np.inf)
            return
        if not self._prints(options) and _solve_small(form, result):
            return
        rows, bounds, c, constant = form.rows, form.boxes.bounds, form.c, form.constant
        low, high = rows.lower, rows.upper
        from scipy.optimize import linprog

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


def _solve_small(form: LinearForm, result: MathematicalProgramResult) -> bool:
    """Solves a small program by the simplex method; whether it has an answer, which is then proven."""
    m, n = form.rows.num_rows, len(form.c)
    if 2 * (m + n) * n > SMALL:
        return False
    A, b, above, below = form.inequalities
    found = maximize_small(-form.c, A, b)
    if found.status == UNDECIDED:
        return False
    outcome = _OUTCOMES[found.status]
    result._solver, result._details = "Simplex", ClpSolverDetails(_CLP_CODES[outcome])
    if found.x is None or found.y is None:
        is_row = np.concatenate((np.flatnonzero(above), np.flatnonzero(below))) < m
        result._finish(outcome, _closest(A, b, is_row), np.nan)
        return True
    result._finish(outcome, found.x, form.c @ found.x + form.constant)
    gains = found.y

    def duals() -> Iterator[tuple[BindingBase, np.ndarray]]:
        at_lower, at_upper = np.zeros(m + n), np.zeros(m + n)
        count = np.count_nonzero(above)
        at_upper[above], at_lower[below] = -gains[:count], gains[count:]
        for binding, places in form.rows.places:
            yield binding, at_lower[places] + at_upper[places]
        yield from form.boxes.duals(at_lower[m:], at_upper[m:])

    result._set_duals_late(duals)
    return True


def _closest(A: np.ndarray, b: np.ndarray, may_miss: np.ndarray) -> np.ndarray:
    """The point with A x <= b but for rows that may be missed, with the least sum of what these are missed by."""
    n, (missed,) = A.shape[1], np.nonzero(may_miss)
    k = len(missed)
    slack = np.zeros((len(b), k))
    slack[missed, np.arange(k)] = -1.0
    rows = np.vstack((np.hstack((A, slack)), np.hstack((np.zeros((k, n)), -np.eye(k)))))
    found = maximize(np.append(np.zeros(n), -np.ones(k)), rows, np.append(b, np.zeros(k)))
    return np.zeros(n) if found.x is None else found.x[:n]


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
    return bool((lower > upper).any() or (lower == np.inf).any() or (upper == -np.inf).any())


class HighsSolver(Engine):
    """Solves linear programs some of whose variables are 0 or 1."""

    _name = "HiGHS"
    _attributes = LINEAR | {A.kBinaryVariable}

    def _do_solve(
        self, prog: MathematicalProgram, guess: np.ndarray, options: SolverOptions, result: MathematicalProgramResult
    ) -> None:
        from scipy.optimize import Bounds, LinearConstraint, milp

        c, constant = LinearObjective(prog).now()
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
