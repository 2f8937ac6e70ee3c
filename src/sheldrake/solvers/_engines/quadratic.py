"""Small convex quadratic programs, given as arrays."""

from __future__ import annotations

import numpy as np

from sheldrake.solvers._engines.choose import Solve
from sheldrake.solvers._engines.clarabel import SOLVED, ClarabelSolver
from sheldrake.solvers._engines.conic import columns_of
from sheldrake.solvers._program.program import MathematicalProgram


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
    found = clarabel.DefaultSolver(columns_of(np.triu(Q)), q, columns_of(rows), b, cones, settings).solve()
    return np.array(found.x) if str(found.status) in SOLVED else None


def _by_program(Q: np.ndarray, q: np.ndarray, A: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> np.ndarray | None:
    """The same by whatever solver is there."""
    prog = MathematicalProgram()
    x = prog.NewContinuousVariables(q.size, "x")
    prog.AddQuadraticCost(Q, q, x, is_convex=True)
    prog.AddLinearConstraint(A, lower, upper, x)
    result = Solve(prog)
    return result.GetSolution(x) if result.is_success() else None
