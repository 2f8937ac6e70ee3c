"""Linear complementarity problems by Lemke's method."""

from __future__ import annotations

import numpy as np

from sheldrake.solvers._engines.interface import SolverInterface
from sheldrake.solvers._ids import ProgramAttribute as A
from sheldrake.solvers._ids import SolutionResult, SolverOptions
from sheldrake.solvers._program.parts import parts_of
from sheldrake.solvers._program.program import MathematicalProgram
from sheldrake.solvers._result import MathematicalProgramResult


def solve_lcp(M: np.ndarray, q: np.ndarray, tolerance: float = 1e-12) -> np.ndarray | None:
    """Returns z >= 0 with w = M z + q >= 0 and z' w = 0; None if the method ends on a ray.

    Lemke's complementary pivots with a covering vector of ones; ties are broken lexicographically, so that it does not
    cycle (Cottle, Pang and Stone, The Linear Complementarity Problem, 1992, algorithms 4.4.5 and 4.9.3).
    """
    n = q.size
    if n == 0 or q.min() >= -tolerance:
        return np.zeros(n)
    # Columns: w (n), z (n), the artificial variable; then the right hand side.
    T = np.hstack((np.eye(n), -M, -np.ones((n, 1)), q.reshape(-1, 1)))
    basis = np.arange(n)
    row = min(range(n), key=lambda i: tuple(np.concatenate(([q[i]], -np.eye(n)[i]))))
    entering = 2 * n
    for _ in range(50 * n + 100):
        leaving = basis[row]
        T[row] /= T[row, entering]
        others = np.arange(n) != row
        T[others] -= np.outer(T[others, entering], T[row])
        basis[row] = entering
        if leaving == 2 * n:
            z = np.zeros(2 * n + 1)
            z[basis] = T[:, -1]
            return np.maximum(z[n : 2 * n], 0.0)
        entering = leaving + n if leaving < n else leaving - n
        column = T[:, entering]
        candidates = np.flatnonzero(column > tolerance * max(1.0, np.abs(column).max()))
        if candidates.size == 0:
            return None
        row = _least_ratio(T, column, candidates, basis, n)
    return None


def _least_ratio(T: np.ndarray, column: np.ndarray, candidates: np.ndarray, basis: np.ndarray, n: int) -> int:
    """The row that leaves: the artificial variable among ties, else the lexicographic least."""
    ratios = T[candidates, -1] / column[candidates]
    least = ratios.min()
    tied = candidates[ratios <= least + 1e-12 * max(1.0, abs(least))]
    for i in tied:
        if basis[i] == 2 * n:
            return int(i)
    return int(min(tied, key=lambda i: tuple(T[i, :n] / column[i])))


class _LcpSolver(SolverInterface):
    _attributes = frozenset({A.kLinearComplementarityConstraint})

    def _unsatisfied(self, prog: MathematicalProgram) -> str:
        has = sorted(prog.required_capabilities())
        covered = {v for b in prog.linear_complementarity_constraints() for v in parts_of(prog).bindings.places(b)}
        if has == [A.kLinearComplementarityConstraint] and len(covered) == prog.num_vars():
            return ""
        names = ", ".join(a.name[1:] for a in has)
        return f"{type(self).__name__} is unable to solve a MathematicalProgram with {{ProgramAttributes: {names}}}."

    def _do_solve(
        self, prog: MathematicalProgram, guess: np.ndarray, options: SolverOptions, result: MathematicalProgramResult
    ) -> None:
        x = np.zeros(prog.num_vars())
        for b in prog.linear_complementarity_constraints():
            z = solve_lcp(b._evaluator._M, b._evaluator._q)
            if z is None or not b._evaluator.CheckSatisfied(z, 1e-6 * max(1.0, np.abs(b._evaluator._q).max())):
                result._finish(SolutionResult.kInfeasibleConstraints, x, np.inf)
                return
            x[parts_of(prog).bindings.places(b)] = z
        result._finish(SolutionResult.kSolutionFound, x, 0.0)


class MobyLcpSolver(_LcpSolver):
    """Solves linear complementarity problems, by Lemke's method as UnrevisedLemkeSolver; results say so."""

    _name = "Moby LCP"
    _method = "Unrevised Lemke"


class UnrevisedLemkeSolver(_LcpSolver):
    """Solves linear complementarity problems by Lemke's method."""

    _name = "Unrevised Lemke"
