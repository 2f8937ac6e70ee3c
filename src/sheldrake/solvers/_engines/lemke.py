"""Linear complementarity problems by Lemke's method."""

from __future__ import annotations

from typing import Any

import numpy as np

from sheldrake.common._bound_calls import BoundCalls
from sheldrake.solvers import _arrays
from sheldrake.solvers._engines.interface import Engine
from sheldrake.solvers._functions.constraints import LinearComplementarityConstraint
from sheldrake.solvers._ids import ProgramAttribute as A
from sheldrake.solvers._ids import SolutionResult, SolverOptions
from sheldrake.solvers._kernels.lemke import FOUND, lemke
from sheldrake.solvers._program.parts import parts_of
from sheldrake.solvers._program.program import MathematicalProgram
from sheldrake.solvers._result import MathematicalProgramResult


def _bound(n: int) -> tuple[Any, ...]:
    """A bound call of Lemke's method for n variables; M and q, and z, which it fills."""
    M, q, z = np.zeros((n, n)), np.zeros(n), np.zeros(n)
    bound = lemke.bind(n, M, q, _ZERO, np.zeros((n, 2 * n + 2)), np.zeros(n, dtype=np.int64), z)
    return bound, M, q, z


_ZERO = 1e-12
_calls = BoundCalls(_bound, largest=256)


def solve_lcp(M: np.ndarray, q: np.ndarray) -> np.ndarray | None:
    """Returns z >= 0 with w = M z + q >= 0 and z' w = 0; None if Lemke's method ends on a ray."""
    n = q.size
    if n == 0 or q.min() >= -_ZERO:
        return np.zeros(n)
    call, own_M, own_q, z = _calls.of(n)
    own_M[:], own_q[:] = M, q
    return z.copy() if call() == FOUND else None


class _LcpSolver(Engine):
    _attributes = frozenset({A.kLinearComplementarityConstraint})

    def _unsatisfied(self, prog: MathematicalProgram) -> str:
        bindings = parts_of(prog).bindings
        has = bindings.attributes()
        if has == self._attributes:
            covered = set(bindings.places(*bindings.of(LinearComplementarityConstraint)).tolist())
            if len(covered) == prog.num_vars():
                return ""
        names = ", ".join(a.name[1:] for a in sorted(has))
        return f"{type(self).__name__} is unable to solve a MathematicalProgram with {{ProgramAttributes: {names}}}."

    def _do_solve(
        self, prog: MathematicalProgram, guess: np.ndarray, options: SolverOptions, result: MathematicalProgramResult
    ) -> None:
        x = np.zeros(prog.num_vars())
        for b in prog.linear_complementarity_constraints():
            M: Any = b._evaluator._M
            q = b._evaluator._q
            z = solve_lcp(M.toarray() if _arrays.is_sparse(M) else M, q)
            if z is None or not b._evaluator._is_satisfied(z, 1e-6 * max(1.0, np.abs(q).max())):
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
