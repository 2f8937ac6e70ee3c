"""Small convex quadratic programs, given as arrays."""

from __future__ import annotations

import numpy as np

from sheldrake.solvers._engines.choose import Solve
from sheldrake.solvers._engines.clarabel import ClarabelSolver
from sheldrake.solvers._engines.columns import Columns
from sheldrake.solvers._engines.dense_quadratic import solve_dense
from sheldrake.solvers._program.program import MathematicalProgram

_SMALL = 120  # rows and variables up to which dense steps take less time


def solve_rows(Q: np.ndarray, q: np.ndarray, A: np.ndarray, b: np.ndarray, equal: int) -> np.ndarray | None:
    """Finds x with the least 1/2 x' Q x + q' x and A x <= b, for callers that need thousands of such x.

    To make a `MathematicalProgram` and its result takes several times as long as Clarabel for a few variables.

    Args:
        Q: Positive semidefinite, shape (n, n).
        q: Shape (n,).
        A: Shape (m, n).
        b: Shape (m,); infinite where there is no bound.
        equal: How many of the first rows are equations.

    Returns:
        x, of small programs to rounding; None if there is none, or none was found.
    """
    x = solve_dense(Q, q, A, b, equal) if max(A.shape) <= _SMALL else None
    return _by_clarabel(Q, q, A, b, equal) if x is None else x


def _by_clarabel(Q: np.ndarray, q: np.ndarray, A: np.ndarray, b: np.ndarray, equal: int) -> np.ndarray | None:
    """The same, to Clarabel's tolerances; by another solver where there is no Clarabel."""
    if not ClarabelSolver._is_available():
        return _by_program(Q, q, A, b, equal)
    import clarabel

    finite = b < np.inf
    A, b = A[finite], b[finite]
    cones = [clarabel.ZeroConeT(equal), clarabel.NonnegativeConeT(len(b) - equal)]
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    found = clarabel.DefaultSolver(Columns.of(np.triu(Q)), q, Columns.of(A), b, cones, settings).solve()
    return np.array(found.x) if str(found.status) in ("Solved", "AlmostSolved") else None


def _by_program(Q: np.ndarray, q: np.ndarray, A: np.ndarray, b: np.ndarray, equal: int) -> np.ndarray | None:
    """The same by whatever solver is there."""
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(q.size, "x")
    prog.AddQuadraticCost(Q, q, x, is_convex=True)
    prog.AddLinearConstraint(A, np.where(np.arange(b.size) < equal, b, -np.inf), b, x)
    result = Solve(prog)
    return result.GetSolution(x) if result.is_success() else None
