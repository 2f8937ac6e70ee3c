"""Programs with linear equations alone: linear algebra solves them."""

from __future__ import annotations

import functools
import math

import numpy as np

from sheldrake.solvers._engines.conic import LinearObjective
from sheldrake.solvers._engines.interface import Engine
from sheldrake.solvers._engines.linear_rows import LinearRows, another, entries
from sheldrake.solvers._engines.small_quadratic import solve_small
from sheldrake.solvers._functions.costs import QuadraticCost
from sheldrake.solvers._ids import ProgramAttribute as A
from sheldrake.solvers._ids import SolutionResult, SolverOptions
from sheldrake.solvers._program.parts import parts_of
from sheldrake.solvers._program.program import MathematicalProgram
from sheldrake.solvers._program_type import quadratic_costs_are_convex
from sheldrake.solvers._result import MathematicalProgramResult

_WELL_CONDITIONED = 1e6  # condition number up to which no rows are taken for dependent
_MOST = 100  # rows up to which a pseudoinverse is kept for the next solve


class EquationsForm:
    """Linear equations M x = rhs over all decision variables, with a cost 1/2 x' Q x + c' x + constant.

    Args:
        prog: The program.
    """

    def __init__(self, prog: MathematicalProgram) -> None:
        self._table = LinearRows(prog, prog.linear_equality_constraints())
        self.rhs, self.places = self._table.lower, self._table.places
        m, n = self._table.num_rows, prog.num_vars()
        rows, cols, values = self._table.entries
        self.M = np.bincount(rows * n + cols, values, m * n).reshape(m, n)
        self.Q, self._objective = quadratic_form(prog), LinearObjective(prog)
        self.c, self.constant = self._objective.now()

    def moved(self, prog: MathematicalProgram) -> EquationsForm:
        """The form of the program with other right hand sides and linear costs."""
        out = another(self)
        out.rhs = self._table.again().lower
        out.c, out.constant = self._objective.now()
        return out

    @functools.cached_property
    def equations(self) -> LeastSquares:
        """Solves M x = rhs."""
        return LeastSquares(self.M)

    @functools.cached_property
    def optimum(self) -> LeastSquares:
        """Solves the conditions of Karush, Kuhn and Tucker for x and the duals."""
        m = len(self.rhs)
        n = len(self.Q)
        matrix = np.zeros((n + m, n + m))
        matrix[:n, :n], matrix[:n, n:], matrix[n:, :n] = self.Q, -self.M.T, self.M
        return LeastSquares(matrix)


class LeastSquares:
    """The x for which A x is nearest to b; of many the shortest.

    Args:
        A: The matrix.
    """

    def __init__(self, A: np.ndarray) -> None:
        self._A = A
        self._inverse = None
        if max(A.shape) <= _MOST:
            self._inverse = _inverse(A)

    def solve(self, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """x for this b, and b - A x."""
        if self._inverse is None:
            x = np.linalg.lstsq(self._A, b, rcond=None)[0]
        else:
            x = self._inverse.dot(b)
            x += self._inverse.dot(b - self._A.dot(x))  # what rounding left
        return x, b - self._A.dot(x)


def _inverse(A: np.ndarray) -> np.ndarray:
    """The pseudoinverse; of a matrix whose rows are well apart its inverse, which takes a fifth of the time."""
    if A.shape[0] == A.shape[1]:
        try:
            found = np.linalg.inv(A)
        except np.linalg.LinAlgError:
            pass
        else:
            if np.abs(A).sum(axis=1).max(initial=0.0) * np.abs(found).sum(axis=1).max(initial=0.0) < _WELL_CONDITIONED:
                return found
    return np.linalg.pinv(A, rcond=np.finfo(float).eps * max(A.shape))


def _length(v: np.ndarray) -> float:
    return math.sqrt(v.dot(v))


def _required(solver: str, attribute: str) -> str:
    return f"{solver} is unable to solve because a {attribute} is required but has not been declared."


class LinearSystemSolver(Engine):
    """Solves linear equations without a cost, in the least squares sense where there is no exact solution."""

    _name = "Linear system"
    _attributes = frozenset({A.kLinearEqualityConstraint})

    def _restriction(self, prog: MathematicalProgram) -> str:
        if prog.linear_equality_constraints():
            return ""
        return _required("LinearSystemSolver", "LinearEqualityConstraint")

    def _do_solve(
        self, prog: MathematicalProgram, guess: np.ndarray, options: SolverOptions, result: MathematicalProgramResult
    ) -> None:
        form = parts_of(prog).form(EquationsForm, prog)
        x, off = form.equations.solve(form.rhs)
        fits = _length(off) <= 1e-9 * max(1.0, _length(form.rhs))
        result._finish(SolutionResult.kSolutionFound if fits else SolutionResult.kInfeasibleConstraints, x, 0.0)


class EqualityConstrainedQPSolver(Engine):
    """Solves convex quadratic costs under linear equations."""

    _name = "EqConstrainedQP"
    _attributes = frozenset({A.kLinearEqualityConstraint, A.kQuadraticCost, A.kLinearCost})

    def _restriction(self, prog: MathematicalProgram) -> str:
        if prog.num_vars() and not prog.quadratic_costs():
            if not prog.required_capabilities():
                return ""
            return _required("EqualityConstrainedQPSolver", "QuadraticCost")
        return (
            ""
            if quadratic_costs_are_convex(prog)
            else "EqualityConstrainedQPSolver is unable to solve because (at least) one quadratic cost is non-convex."
        )

    def _do_solve(
        self, prog: MathematicalProgram, guess: np.ndarray, options: SolverOptions, result: MathematicalProgramResult
    ) -> None:
        solved = None if options.options else solve_small(prog)
        if solved is not None:
            result._finish(SolutionResult.kSolutionFound, solved.x, solved.cost)
            result._set_duals_late(solved.duals)
            return
        n = prog.num_vars()
        tolerance = self._options(options, {"FeasibilityTol": 1e-12})["FeasibilityTol"]
        form = parts_of(prog).form(EquationsForm, prog)
        c, rhs = form.c, form.rhs
        found, off = form.optimum.solve(np.concatenate((-c, rhs)))
        x, dual = found[:n], found[n:]
        if _length(off[n:]) > max(tolerance, 1e-9) * max(1.0, _length(rhs)):
            result._finish(SolutionResult.kInfeasibleConstraints, x, np.inf)
            return
        if _length(off[:n]) > 1e-8 * max(1.0, _length(c)):
            result._finish(SolutionResult.kUnbounded, None, -np.inf)
            return
        result._finish(SolutionResult.kSolutionFound, x, x.dot(0.5 * form.Q.dot(x) + c) + form.constant)
        result._set_duals_late(lambda: [(b, dual[rows]) for b, rows in form.places])


def quadratic_form(prog: MathematicalProgram) -> np.ndarray:
    """Q with quadratic costs adding up to 1/2 x' Q x and linear terms."""
    n, quadratic = prog.num_vars(), prog.quadratic_costs()
    rows, cols, values = entries(*QuadraticCost.matrices([b._evaluator for b in quadratic]))
    at = parts_of(prog).bindings.places(*quadratic)
    return np.bincount(at[rows] * n + at[cols], values, n * n).reshape(n, n)
