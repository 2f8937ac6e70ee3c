"""Convex quadratic programs that are so small that dense steps take least time, by a kernel."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sheldrake.common._bound_calls import BoundCalls
from sheldrake.common.kernel import Bound
from sheldrake.solvers._kernels.active_set import solve_dense_program


class _Memory(NamedTuple):
    """A bound call and its arrays."""

    call: Bound
    Q: np.ndarray
    q: np.ndarray
    A: np.ndarray
    b: np.ndarray
    x: np.ndarray
    multipliers: np.ndarray
    active: np.ndarray


def _bound(rows: int, n: int) -> _Memory:
    Q, q, A, b, x = np.zeros((n, n)), np.zeros(n), np.zeros((rows, n)), np.zeros(rows), np.zeros(n)
    scratch = np.zeros((n, n)), np.zeros((n, n)), np.zeros((rows, n)), np.zeros(rows), np.zeros(n), np.zeros(n)
    multipliers, active = np.zeros(n + 1), np.zeros(n + 1, dtype=np.int64)
    more = np.zeros(n), np.zeros(n), multipliers, np.zeros((2 * n, 2 * n + 1)), active
    return _Memory(solve_dense_program.bind(Q, q, A, b, 0, x, *scratch, *more), Q, q, A, b, x, multipliers, active)


_calls = BoundCalls(_bound)


def solve_dense(
    Q: np.ndarray, q: np.ndarray, A: np.ndarray, b: np.ndarray, equal: int = 0
) -> tuple[np.ndarray, np.ndarray] | None:
    """The x with the least 1/2 x' Q x + q' x and A x <= b, the first rows equations; None if none was found.

    Returns:
        x, and multipliers y of the rows, Q x + q + A' y = 0, shape (rows,).
    """
    memory = _calls.of(*A.shape)
    memory.Q[...], memory.q[...], memory.A[...], memory.b[...] = Q, q, A, b
    memory.call.set("equal", equal)
    count = memory.call()
    if count < 0:
        return None
    multipliers = np.zeros(len(b))
    multipliers[memory.active[:count]] = memory.multipliers[:count]
    return memory.x.copy(), multipliers
