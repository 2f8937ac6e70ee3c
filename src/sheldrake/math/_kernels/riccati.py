"""Small Riccati equations by structure-preserving doubling (Chu, Fan and Lin, 2005), and the regulators they give.

What is not clearly solved gets a status: whoever asks goes another way then, and finds out why.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sheldrake.common._kernels.generic import exp, log, sqrt
from sheldrake.common.kernel import Matrix, kernel

UNSOLVED = 1
_DOUBLINGS = 24
_SYMMETRY = 1e-10  # how far from symmetric Q and R may be
_EPSILON = 1e-15  # step of a doubling that changes nothing
_RESIDUAL = 1e-11
_DECAY = 1e-7  # of the slowest mode, over the largest entry of A, as regulators ask for
_PIVOT = 1e-11  # of R, over its diagonal


class RiccatiRoom(NamedTuple):
    """Scratch for n states and m inputs; the numbers after the first eight are (n, n)."""

    L: Matrix
    """Cholesky's factor of R, (m, m)."""
    U: Matrix
    """R^-1 B^T, (m, n)."""
    W: Matrix
    """R^-1 N^T, (m, n)."""
    H: Matrix
    """The Hamiltonian matrix, (2n, 2n)."""
    alone: Matrix
    """(2n, 0): what goes along when H is eliminated."""
    V: Matrix
    """(n, 2n)."""
    C: Matrix
    """R + B^T S B, (m, m)."""
    D: Matrix
    """B^T S, (m, n)."""
    A: Matrix
    """A less B R^-1 N^T."""
    Q: Matrix
    """Q less N R^-1 N^T."""
    G: Matrix
    """B R^-1 B^T."""
    E: Matrix
    F: Matrix
    S: Matrix
    M: Matrix
    T: Matrix


def make_room(n: int, m: int) -> RiccatiRoom:
    """Scratch for n states and m inputs."""
    first = [
        np.zeros(shape) for shape in ((m, m), (m, n), (m, n), (2 * n, 2 * n), (2 * n, 0), (n, 2 * n), (m, m), (m, n))
    ]
    return RiccatiRoom(*first, *(np.zeros((n, n)) for _ in range(8)))


@kernel(outline=True)
def largest(X: Matrix) -> float:
    """The largest magnitude; infinity where a number is none."""
    found = 0.0
    for i in range(X.shape[0]):
        for j in range(X.shape[1]):
            size = abs(X[i, j])
            if not size <= 1e150:
                size = 1e300
            if size > found:
                found = size
    return found


@kernel
def is_symmetric(X):
    for i in range(X.shape[0]):
        for j in range(i):
            if not abs(X[i, j] - X[j, i]) <= _SYMMETRY:
                return False
    return True


@kernel(outline=True)
def multiply_columns(X: Matrix, Y: Matrix, begin: int, out: Matrix) -> None:
    """out = X times as many columns of Y, from `begin` on."""
    for i in range(X.shape[0]):
        for j in range(out.shape[1]):
            total = 0.0
            for k in range(X.shape[1]):
                total += X[i, k] * Y[k, begin + j]
            out[i, j] = total


@kernel
def multiply(X, Y, out):
    """out = X Y."""
    multiply_columns(X, Y, 0, out)


@kernel(outline=True)
def multiply_transposed(X: Matrix, Y: Matrix, out: Matrix) -> None:
    """out = X^T Y."""
    for i in range(X.shape[1]):
        for j in range(Y.shape[1]):
            total = 0.0
            for k in range(X.shape[0]):
                total += X[k, i] * Y[k, j]
            out[i, j] = total


@kernel(outline=True)
def copy(X: Matrix, out: Matrix) -> None:
    for i in range(X.shape[0]):
        for j in range(X.shape[1]):
            out[i, j] = X[i, j]


@kernel(outline=True)
def eliminate(M: Matrix, X: Matrix) -> int:
    """Makes M triangular by elimination with partial pivoting, and does the same to X; 1 where a pivot is zero."""
    n = M.shape[0]
    for k in range(n):
        pivot = k
        for i in range(k + 1, n):
            if abs(M[i, k]) > abs(M[pivot, k]):
                pivot = i
        if not abs(M[pivot, k]) > 0.0:
            return UNSOLVED
        if pivot != k:
            for j in range(n):
                M[k, j], M[pivot, j] = M[pivot, j], M[k, j]
            for j in range(X.shape[1]):
                X[k, j], X[pivot, j] = X[pivot, j], X[k, j]
        for i in range(k + 1, n):
            factor = M[i, k] / M[k, k]
            for j in range(k + 1, n):
                M[i, j] -= factor * M[k, j]
            for j in range(X.shape[1]):
                X[i, j] -= factor * X[k, j]
    return 0


@kernel(outline=True)
def solve(M: Matrix, X: Matrix) -> int:
    """Puts M^-1 X in the place of X and spoils M; 1 where a pivot is zero."""
    n = M.shape[0]
    if eliminate(M, X) != 0:
        return UNSOLVED
    for back in range(n):
        i = n - 1 - back
        for j in range(X.shape[1]):
            total = X[i, j]
            for k in range(i + 1, n):
                total -= M[i, k] * X[k, j]
            X[i, j] = total / M[i, i]
    return 0


@kernel(outline=True)
def factor_definite(R: Matrix, L: Matrix) -> int:
    """Cholesky's factor of a matrix that is clearly positive definite; 1 for another."""
    for i in range(R.shape[0]):
        for j in range(i + 1):
            total = R[i, j]
            for k in range(j):
                total -= L[i, k] * L[j, k]
            if i > j:
                L[i, j] = total / L[j, j]
            elif total > _PIVOT * R[i, i] and total < 1e300:
                L[i, i] = sqrt(total)
            else:
                return UNSOLVED
    return 0


@kernel(outline=True)
def solve_definite(L: Matrix, X: Matrix) -> None:
    """Puts R^-1 X in the place of X, with Cholesky's factor of R."""
    n = L.shape[0]
    for j in range(X.shape[1]):
        for i in range(n):
            total = X[i, j]
            for k in range(i):
                total -= L[i, k] * X[k, j]
            X[i, j] = total / L[i, i]
        for back in range(n):
            i = n - 1 - back
            total = X[i, j]
            for k in range(i + 1, n):
                total -= L[k, i] * X[k, j]
            X[i, j] = total / L[i, i]


@kernel(outline=True)
def prepare(A: Matrix, B: Matrix, Q: Matrix, R: Matrix, N: Matrix, room: RiccatiRoom) -> int:
    """The equation without cross terms: completing the square in u takes N away (Bertsekas 2017, section 3.1)."""
    n, m = B.shape[0], B.shape[1]
    if not is_symmetric(Q) or not is_symmetric(R):
        return UNSOLVED
    if factor_definite(R, room.L) != 0:
        return UNSOLVED
    for i in range(n):
        for j in range(m):
            room.U[j, i] = B[i, j]
            room.W[j, i] = N[i, j]
    solve_definite(room.L, room.U)
    solve_definite(room.L, room.W)
    multiply(B, room.U, room.G)
    multiply(B, room.W, room.M)
    multiply(N, room.W, room.T)
    for i in range(n):
        for j in range(n):
            room.A[i, j] = A[i, j] - room.M[i, j]
            room.Q[i, j] = Q[i, j] - room.T[i, j]
    if max(largest(room.A), largest(room.Q), largest(room.G)) > 1e150:
        return UNSOLVED
    return 0


@kernel
def shift_of_modes(room):
    """The geometric mean of the magnitudes of the Hamiltonian matrix's modes; 0 where there is none."""
    n = room.A.shape[0]
    for i in range(n):
        for j in range(n):
            room.H[i, j] = room.A[i, j]
            room.H[i, n + j] = -room.G[i, j]
            room.H[n + i, j] = -room.Q[i, j]
            room.H[n + i, n + j] = -room.A[j, i]
    logarithm = -2.0 * n
    if eliminate(room.H, room.alone) == 0:
        logarithm = 0.0
        for i in range(2 * n):
            logarithm += log(abs(room.H[i, i]))
    return exp(max(logarithm, -2.0 * n) / (2.0 * n))


@kernel(outline=True)
def transform(room: RiccatiRoom, shift: float) -> int:
    """E, F and S of the discrete problem with the same solution (Cayley's transform)."""
    n = room.A.shape[0]
    for i in range(n):  # F becomes (A - shift)^-1, T then Q F
        for j in range(n):
            one = 1.0 if i == j else 0.0
            room.M[i, j] = room.A[i, j] - shift * one
            room.F[i, j] = one
    if solve(room.M, room.F) != 0:
        return UNSOLVED
    multiply(room.Q, room.F, room.T)
    multiply(room.T, room.G, room.M)
    for i in range(n):  # E becomes W = 2 shift ((A - shift)^T + Q (A - shift)^-1 G)^-1
        for j in range(n):
            one = 1.0 if i == j else 0.0
            room.M[i, j] += room.A[j, i] - shift * one
            room.E[i, j] = 2.0 * shift * one
    if solve(room.M, room.E) != 0:
        return UNSOLVED
    multiply(room.E, room.T, room.S)
    multiply(room.G, room.E, room.M)
    multiply(room.F, room.M, room.T)
    copy(room.T, room.F)
    for i in range(n):
        for j in range(n):
            room.M[i, j] = room.E[j, i] + (1.0 if i == j else 0.0)
    copy(room.M, room.E)
    return 0


@kernel(outline=True)
def double(room: RiccatiRoom) -> float:
    """One doubling: the largest change of S, and E, F and S anew; -1 where it fails."""
    n = room.E.shape[0]
    multiply(room.F, room.S, room.M)
    for i in range(n):
        room.M[i, i] += 1.0
        for j in range(n):
            room.V[i, j] = room.E[i, j]
            room.V[i, n + j] = room.F[i, j]
    if solve(room.M, room.V) != 0:
        return -1.0
    multiply_transposed(room.E, room.S, room.T)  # E^T S, of the S that was
    multiply(room.T, room.V, room.M)
    step = 0.0
    for i in range(n):
        for j in range(n):
            room.S[i, j] += room.M[i, j]
            step = max(step, abs(room.M[i, j]))
    multiply_columns(room.E, room.V, n, room.M)  # then F += M E^T
    for i in range(n):
        for j in range(n):
            total = 0.0
            for k in range(n):
                total += room.M[i, k] * room.E[j, k]
            room.F[i, j] += total
    multiply(room.E, room.V, room.M)
    copy(room.M, room.E)
    return step


@kernel(outline=True)
def doubled(room: RiccatiRoom) -> int:
    """Doubles until S stays as it is and E, a power of the closed loop, vanishes.

    Returns:
        How often, or -1 where that does not happen.
    """
    n = room.E.shape[0]
    for count in range(1, _DOUBLINGS + 1):
        step = double(room)
        if not (step >= 0.0 and step < 1e150):
            return -1
        if step <= _EPSILON * largest(room.S) and n * largest(room.E) <= 0.5:
            for i in range(n):
                for j in range(i):
                    mean = 0.5 * (room.S[i, j] + room.S[j, i])
                    room.S[i, j] = mean
                    room.S[j, i] = mean
            return count
    return -1


@kernel(outline=True)
def solves_continuous(room: RiccatiRoom) -> bool:
    """Whether S solves S A + A^T S - S G S + Q = 0, as exactly as what is added there says."""
    n = room.A.shape[0]
    multiply(room.S, room.A, room.T)
    multiply(room.G, room.S, room.M)
    multiply(room.S, room.M, room.E)
    worst, size = 0.0, 1e-300
    for i in range(n):
        for j in range(n):
            linear = room.T[i, j] + room.T[j, i]
            worst = max(worst, abs(linear - room.E[i, j] + room.Q[i, j]))
            size = max(size, max(abs(linear), max(abs(room.E[i, j]), abs(room.Q[i, j]))))
    return worst < _RESIDUAL * size


@kernel(outline=True)
def solves_discrete(room: RiccatiRoom) -> bool:
    """The same of A^T S (1 + G S)^-1 A - S + Q = 0."""
    n = room.A.shape[0]
    multiply(room.G, room.S, room.M)
    for i in range(n):
        room.M[i, i] += 1.0
    copy(room.A, room.T)
    if solve(room.M, room.T) != 0:
        return False
    multiply(room.S, room.T, room.M)
    multiply_transposed(room.A, room.M, room.E)
    worst, size = 0.0, 1e-300
    for i in range(n):
        for j in range(n):
            worst = max(worst, abs(room.E[i, j] - room.S[i, j] + room.Q[i, j]))
            size = max(size, max(abs(room.E[i, j]), max(abs(room.S[i, j]), abs(room.Q[i, j]))))
    return worst < _RESIDUAL * size


@kernel(top=True)
def continuous_regulator(
    A: Matrix, B: Matrix, Q: Matrix, R: Matrix, N: Matrix, room: RiccatiRoom, S_and_K: Matrix
) -> int:
    """S with the cost x'Sx of the best u = -K x for x' = A x + B u, below it K; shape (n + m, n).

    Returns:
        0, or UNSOLVED where this is not clearly so.
    """
    n, m = B.shape[0], B.shape[1]
    if prepare(A, B, Q, R, N, room) != 0:
        return UNSOLVED
    shift = shift_of_modes(room)
    if not (shift > 0.0 and shift < 1e150) or transform(room, shift) != 0:
        return UNSOLVED
    count = doubled(room)
    if count < 0 or not solves_continuous(room):
        return UNSOLVED
    if 0.5 * shift * 0.69 / 2.0**count <= _DECAY * largest(A):  # modes may be slower than those that are trusted
        return UNSOLVED
    multiply(room.U, room.S, room.D)
    copy(room.S, S_and_K)
    for i in range(m):
        for j in range(n):
            S_and_K[n + i, j] = room.D[i, j] + room.W[i, j]
    return 0


@kernel(top=True)
def discrete_regulator(
    A: Matrix, B: Matrix, Q: Matrix, R: Matrix, N: Matrix, room: RiccatiRoom, S_and_K: Matrix
) -> int:
    """The same for x[k+1] = A x[k] + B u[k]."""
    n, m = B.shape[0], B.shape[1]
    if prepare(A, B, Q, R, N, room) != 0:
        return UNSOLVED
    copy(room.A, room.E)
    copy(room.G, room.F)
    copy(room.Q, room.S)
    count = doubled(room)
    if count < 0 or not solves_discrete(room) or 0.69 / 2.0**count <= _DECAY * largest(A):
        return UNSOLVED
    multiply_transposed(B, room.S, room.D)
    multiply(room.D, B, room.C)
    multiply(room.D, A, room.W)
    for i in range(m):
        for j in range(m):
            room.C[i, j] += R[i, j]
        for j in range(n):
            room.W[i, j] += N[j, i]
    if solve(room.C, room.W) != 0:
        return UNSOLVED
    copy(room.S, S_and_K)
    for i in range(m):
        for j in range(n):
            S_and_K[n + i, j] = room.W[i, j]
    return 0
