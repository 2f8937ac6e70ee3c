"""Small linear programs, given as arrays."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sheldrake.common._bound_calls import BoundCalls, room
from sheldrake.common.kernel import Bound
from sheldrake.solvers._kernels.simplex import INFEASIBLE, OPTIMAL, UNBOUNDED, UNDECIDED, solve_linear_program

SMALL = 8192  # entries of a tableau up to which dense steps take less time than SciPy's call of HiGHS
_STATUS = {0: OPTIMAL, 2: INFEASIBLE, 3: UNBOUNDED}  # SciPy's


class LinearAnswer(NamedTuple):
    """How a linear program ended: with the best x, INFEASIBLE, UNBOUNDED or UNDECIDED."""

    status: int
    x: np.ndarray | None = None
    y: np.ndarray | None = None  # what a solution gains for each row whose bound grows by one, not from HiGHS

    def __str__(self) -> str:
        return ("it is solved", "there is no point", "it has no limit", "the solver failed")[self.status]


def maximize(c: np.ndarray, A: np.ndarray, b: np.ndarray) -> LinearAnswer:
    """Finds x with the greatest c'x and A x <= b: small programs to rounding, others by HiGHS.

    Small programs too go to HiGHS where there is no proof of an answer: points that satisfy the rows only up to its
    tolerance are points, as for other programs. Rows with an infinite b say nothing, or that there is no x.
    """
    says_something = b != np.inf
    if not says_something.all():
        A, b = A[says_something], b[says_something]
    if np.any(b == -np.inf):
        return LinearAnswer(INFEASIBLE)
    answer = maximize_small(c, A, b)
    return _by_highs(c, A, b) if answer.status == UNDECIDED else answer


def maximize_small(c: np.ndarray, A: np.ndarray, b: np.ndarray) -> LinearAnswer:
    """The same, UNDECIDED where it is not small or there is no proof."""
    m, n = A.shape
    if m == 0:
        return LinearAnswer(UNBOUNDED) if c.any() else LinearAnswer(OPTIMAL, np.zeros(n), np.zeros(0))
    if n and m * n <= SMALL and np.isfinite(b).all():
        return _at_once(c, A, b)
    return LinearAnswer(UNDECIDED)


def _at_once(c: np.ndarray, A: np.ndarray, b: np.ndarray) -> LinearAnswer:
    m, n = A.shape
    call, all_c, all_A, all_b, x, y = _calls.of(room(m), room(n))
    all_c[:n], all_A[:m, :n], all_b[:m] = c, A, b
    call.set("rows", m)
    call.set("n", n)
    status = call()
    return LinearAnswer(status, x[:n].copy(), y[:m].copy()) if status == OPTIMAL else LinearAnswer(status)


def _bound(rows: int, n: int) -> tuple[Bound, np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """A bound call, and its c, A, b, x and y."""
    c, A, b, x, y = np.zeros(n), np.zeros((rows, n)), np.zeros(rows), np.zeros(n), np.zeros(rows)
    scratch = np.zeros((rows + 2, n + 2)), np.zeros((n, n + 1)), np.zeros(n)
    places = np.zeros(rows + 2, dtype=np.int64), np.zeros(n + 1, dtype=np.int64)
    return solve_linear_program.bind(0, 0, c, A, b, x, y, *scratch, *places), c, A, b, x, y


_calls = BoundCalls(_bound)


def _by_highs(c: np.ndarray, A: np.ndarray, b: np.ndarray) -> LinearAnswer:
    from scipy.optimize import linprog

    found = linprog(-c, A_ub=A, b_ub=b, bounds=(None, None), method="highs")
    status = _STATUS.get(found.status, UNDECIDED)
    return LinearAnswer(status, np.array(found.x) if status == OPTIMAL else None)
