"""Convex quadratic programs that are so small that dense steps take least time, by a kernel."""

from __future__ import annotations

import numpy as np

from sheldrake.common._bound_calls import BoundCalls
from sheldrake.common.kernel import Bound
from sheldrake.solvers._kernels.active_set import solve_dense_program


def _bound(rows: int, n: int) -> tuple[Bound, np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """A bound call, and its Q, q, A, b and x."""
    Q, q, A, b, x = np.zeros((n, n)), np.zeros(n), np.zeros((rows, n)), np.zeros(rows), np.zeros(n)
    scratch = np.zeros((n, n)), np.zeros((n, n)), np.zeros((rows, n)), np.zeros(rows), np.zeros(n), np.zeros(n)
    more = np.zeros(n), np.zeros(n), np.zeros(n + 1), np.zeros((2 * n, 2 * n + 1)), np.zeros(n + 1, dtype=np.int64)
    return solve_dense_program.bind(Q, q, A, b, 0, x, *scratch, *more), Q, q, A, b, x


_calls = BoundCalls(_bound)


def solve_dense(Q: np.ndarray, q: np.ndarray, A: np.ndarray, b: np.ndarray, equal: int = 0) -> np.ndarray | None:
    """The x with the least 1/2 x' Q x + q' x and A x <= b, the first rows equations; None if none was found."""
    call, *given, x = _calls.of(*A.shape)
    for place, value in zip(given, (Q, q, A, b)):
        place[...] = value
    call.set("equal", equal)
    return None if call() else x.copy()
