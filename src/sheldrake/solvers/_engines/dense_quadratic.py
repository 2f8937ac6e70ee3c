"""Convex quadratic programs that are so small that dense steps take least time, by a kernel."""

from __future__ import annotations

import numpy as np

from sheldrake.common._bound_calls import BoundCalls
from sheldrake.common.kernel import Bound
from sheldrake.solvers._kernels.active_set import Quadratic, make_quadratic, solve_dense_program


def _bound(rows: int, n: int) -> tuple[Bound, Quadratic]:
    program = make_quadratic(rows, n)
    return solve_dense_program.bind(program, 0), program


_calls = BoundCalls(_bound)


def solve_dense(Q: np.ndarray, q: np.ndarray, A: np.ndarray, b: np.ndarray, equal: int = 0) -> np.ndarray | None:
    """The x with the least 1/2 x' Q x + q' x and A x <= b, the first rows equations; None if none was found."""
    call, program = _calls.of(*A.shape)
    program.Q[...], program.q[...], program.A[...], program.b[...] = Q, q, A, b
    call.set("equal", equal)
    return None if call() < 0 else program.x.copy()
