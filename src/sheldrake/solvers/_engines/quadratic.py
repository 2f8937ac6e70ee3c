"""Small convex quadratic programs, given as arrays."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sheldrake.solvers._engines.choose import Solve
from sheldrake.solvers._engines.clarabel import ClarabelSolver
from sheldrake.solvers._program.program import MathematicalProgram


class Columns(NamedTuple):
    """A sparse matrix by columns with the attributes of SciPy's, which take as long to make as the program to solve."""

    data: np.ndarray
    indices: np.ndarray
    indptr: np.ndarray
    shape: tuple[int, int]
    has_canonical_format: bool = True

    @classmethod
    def of(cls, matrix: np.ndarray) -> Columns:
        """The numbers of a dense matrix that are not zero."""
        column, row = np.nonzero(matrix.T)
        starts = np.searchsorted(column, np.arange(matrix.shape[1] + 1))
        return cls(matrix[row, column], row, starts, (matrix.shape[0], matrix.shape[1]))


def solve_quadratic_program(
    Q: np.ndarray, q: np.ndarray, A: np.ndarray, lower: np.ndarray, upper: np.ndarray
) -> np.ndarray | None:
    """Finds x with the least 1/2 x' Q x + q' x and lower <= A x <= upper, for callers that need thousands of such x.

    To make a `MathematicalProgram` and its result takes several times as long as Clarabel for a few variables.

    Returns:
        x, or None if there is none, or none was found.
    """
    if not ClarabelSolver._is_available():
        return _by_program(Q, q, A, lower, upper)
    import clarabel

    equal = lower == upper
    below, above = ~equal & np.isfinite(upper), ~equal & np.isfinite(lower)
    rows = np.vstack((A[equal], A[below], -A[above]))
    b = np.concatenate((upper[equal], upper[below], -lower[above]))
    first = int(np.count_nonzero(equal))
    cones = [clarabel.ZeroConeT(first), clarabel.NonnegativeConeT(len(b) - first)]
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    found = clarabel.DefaultSolver(Columns.of(np.triu(Q)), q, Columns.of(rows), b, cones, settings).solve()
    return np.array(found.x) if str(found.status) in ("Solved", "AlmostSolved") else None


def _by_program(Q: np.ndarray, q: np.ndarray, A: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> np.ndarray | None:
    """The same by whatever solver is there."""
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(q.size, "x")
    prog.AddQuadraticCost(Q, q, x, is_convex=True)
    prog.AddLinearConstraint(A, lower, upper, x)
    result = Solve(prog)
    return result.GetSolution(x) if result.is_success() else None
