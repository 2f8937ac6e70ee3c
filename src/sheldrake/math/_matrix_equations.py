"""Riccati and Lyapunov equations."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common import quick
from sheldrake.common._blas import one_thread
from sheldrake.common.calls import Calls
from sheldrake.math._kernels import riccati
from sheldrake.math._matrices import float_matrix

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.common.calls import Query


__all__ = [
    "ContinuousAlgebraicRiccatiEquation",
    "DiscreteAlgebraicRiccatiEquation",
    "RealContinuousLyapunovEquation",
    "RealDiscreteLyapunovEquation",
]

_SYMMETRY = 1e-10  # how far from symmetric Q and R may be
_GROWTH = 1e-9  # of a closed loop, over its largest entry, that is round-off
_SMALL, _FEW = 40, 8  # sizes up to which nothing of SciPy is needed
_DOUBLINGS = 50
_EPSILON = 1e-15  # step of a doubling that changes nothing
_RESIDUAL = 1e-11  # of a solution by doubling
_UNIQUENESS = 1e-10  # how close to zero a sum (or product less one) of two eigenvalues may be


def _check_shape(call: str, name: str, M: np.ndarray, shape: tuple[int, int]) -> None:
    if M.shape != shape:
        raise RuntimeError(f"{call}(): {name} has shape {M.shape}; it must have {shape}.")


def _check_symmetric(call: str, name: str, M: np.ndarray) -> None:
    if np.abs(M - M.T).max(initial=0.0) > _SYMMETRY:
        raise RuntimeError(f"{call}(): {name} must be symmetric.")


def _check_cost(call: str, A: np.ndarray, B: np.ndarray, Q: np.ndarray, R: np.ndarray) -> None:
    n, m = B.shape
    _check_shape(call, "A", A, (n, n))
    _check_shape(call, "Q", Q, (n, n))
    _check_shape(call, "R", R, (m, m))
    _check_symmetric(call, "Q", Q)
    _check_symmetric(call, "R", R)
    if np.linalg.eigvalsh(R).min(initial=np.inf) <= 0.0:
        raise RuntimeError(f"{call}(): R must be positive definite")


def _sizes_fit(A: np.ndarray, B: np.ndarray, Q: np.ndarray, R: np.ndarray) -> bool:
    n, m = B.shape
    return A.shape == Q.shape == (n, n) and R.shape == (m, m)


def require_stable(call: str, closed: np.ndarray, *, discrete: bool) -> None:
    """Refuses what a Riccati solver gives where no feedback stabilizes: a closed loop that grows.

    Raises:
        RuntimeError: it does.
    """
    modes = np.linalg.eigvals(closed)
    growth = np.abs(modes) - 1.0 if discrete else modes.real
    if growth.max(initial=-1.0) > _GROWTH * max(1.0, np.abs(closed).max(initial=0.0)):
        raise RuntimeError(f"{call} fails. The system is not stabilizable.")


def small_regulator(
    A: np.ndarray, B: np.ndarray, Q: np.ndarray, R: np.ndarray, N: np.ndarray | None, *, discrete: bool
) -> tuple[np.ndarray, np.ndarray] | None:
    """S and K of the regulator of a small process, or None where a kernel does not clearly solve its Riccati equation.

    What it gives solves the equation to `_RESIDUAL`, with R positive definite and a closed loop that decays; sizes must
    fit. Everything else, and every error, is for others.
    """
    n, m = B.shape
    if not 0 < n <= _SMALL or not 0 < m <= n:
        return None
    ask = _regulators.get((n, m, discrete))
    if ask is None:
        ask = _new_regulator(n, m, discrete)
    given = (A, B, Q, R, np.zeros((n, m)) if N is None else N)
    found = ask(*[np.ascontiguousarray(matrix) for matrix in given])
    if isinstance(found, int):
        return None
    return found[:n].copy(), found[n:].copy()


_regulators: dict[tuple[int, int, bool], Query] = {}
_MOST_SIZES = 64


def _new_regulator(n: int, m: int, discrete: bool) -> Query:
    """A query for S and K of processes of n states and m inputs; kept once the kernel is there."""
    kernel = riccati.discrete_regulator if discrete else riccati.continuous_regulator
    if not quick.worth_making(kernel):
        return lambda *_: riccati.UNSOLVED
    if len(_regulators) >= _MOST_SIZES:
        _regulators.clear()
    shapes, found = ((n, n), (n, m), (n, n), (m, m), (n, m)), np.zeros((n + m, n))
    arguments: list[Any] = [*(np.zeros(shape) for shape in shapes), riccati.make_room(n, m), found]
    ask = Calls(np.zeros(1, np.int64)).query(kernel, *arguments, given=("A", "B", "Q", "R", "N"), answer=found)
    _regulators[n, m, discrete] = ask
    return ask


def stabilizing_solution(A: np.ndarray, B: np.ndarray, Q: np.ndarray, R: np.ndarray, *, discrete: bool) -> np.ndarray:
    """The solution of a Riccati equation without cross terms, of small matrices mostly by doubling.

    SciPy takes ten times as long as a small regulator, and loading it a thousand times; it does what is left: large
    matrices, those that doubling does not solve to `_RESIDUAL`, and those without a solution.

    Raises:
        LinAlgError: there is none.
        ValueError: a number is not finite.
    """
    if len(A) <= _SMALL:
        S = _by_doubling(A, B @ np.linalg.solve(R, B.T), Q, discrete)
        if S is not None:
            return S
    from scipy.linalg import solve_continuous_are, solve_discrete_are

    with one_thread():
        S = (solve_discrete_are if discrete else solve_continuous_are)(A, B, Q, R)
    return (S + S.T) / 2


def _by_doubling(A: np.ndarray, G: np.ndarray, Q: np.ndarray, discrete: bool) -> np.ndarray | None:
    """The solution with G = B R^-1 B^T by structure-preserving doubling (Chu, Fan and Lin, 2005), if that solves it."""
    one = np.eye(len(A))
    try:
        with np.errstate(all="ignore"):
            E, F, S = (A, G, Q) if discrete else _cayley(A, G, Q)
            for _ in range(_DOUBLINGS):
                V = np.linalg.solve(one + F @ S, np.hstack((E, F)))
                V_E, V_F = V[:, : len(A)], V[:, len(A) :]
                step = E.T @ S @ V_E
                E, F, S = E @ V_E, F + E @ V_F @ E.T, S + step
                if np.abs(step).max() <= _EPSILON * np.abs(S).max():
                    S = (S + S.T) / 2
                    return S if _residual(A, G, Q, S, discrete) < _RESIDUAL else None
    except np.linalg.LinAlgError:
        pass
    return None


def _cayley(A: np.ndarray, G: np.ndarray, Q: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The discrete problem with the same solution, for a shift in the middle of the modes' magnitudes."""
    n = len(A)
    _, logarithm = np.linalg.slogdet(np.block([[A, -G], [-Q, -A.T]]))
    shift = np.exp(max(logarithm, -2.0 * n) / (2 * n))
    inverse = np.linalg.inv(A - shift * np.eye(n))
    W = 2.0 * shift * np.linalg.inv((A - shift * np.eye(n)).T + Q @ inverse @ G)
    return np.eye(n) + W.T, inverse @ G @ W, W @ Q @ inverse


def _residual(A: np.ndarray, G: np.ndarray, Q: np.ndarray, S: np.ndarray, discrete: bool) -> float:
    """How far S is from solving the equation, over what is added in it."""
    if discrete:
        terms = A.T @ S @ np.linalg.solve(np.eye(len(A)) + G @ S, A), -S, Q
    else:
        terms = S @ A + A.T @ S, -S @ G @ S, Q
    return float(np.abs(sum(terms)).max() / max(1e-300, *(np.abs(term).max() for term in terms)))


def _solve(call: str, solver: Callable[[], np.ndarray]) -> np.ndarray:
    """What `solver` gives, made symmetric."""
    try:
        S = solver()
    except (np.linalg.LinAlgError, ValueError) as error:
        raise RuntimeError(
            f"{call} fails. Either your (A, B) is not stabilizable, or (Q, A) is not detectable. ({error})"
        ) from None
    return (S + S.T) / 2


def ContinuousAlgebraicRiccatiEquation(A: ArrayLike, B: ArrayLike, Q: ArrayLike, R: ArrayLike) -> np.ndarray:
    """The stabilizing solution S of S A + A^T S - S B R^-1 B^T S + Q = 0, shape (n, n).

    Args:
        A: Shape (n, n).
        B: Shape (n, m).
        Q: Symmetric positive semidefinite, shape (n, n).
        R: Symmetric positive definite, shape (m, m).

    Raises:
        RuntimeError: a matrix is not so, or there is no such solution.
    """
    call = "ContinuousAlgebraicRiccatiEquation"
    A, B, Q, R = (float_matrix(call, **{name: M}) for name, M in (("A", A), ("B", B), ("Q", Q), ("R", R)))
    if _sizes_fit(A, B, Q, R) and (made := small_regulator(A, B, Q, R, None, discrete=False)) is not None:
        return made[0]
    _check_cost(call, A, B, Q, R)
    S = _solve(call, lambda: stabilizing_solution(A, B, Q, R, discrete=False))
    require_stable(call, A - B @ np.linalg.solve(R, B.T @ S), discrete=False)
    return S


def DiscreteAlgebraicRiccatiEquation(
    A: ArrayLike, B: ArrayLike, Q: ArrayLike, R: ArrayLike, N: ArrayLike | None = None
) -> np.ndarray:
    """The stabilizing solution X of A^T X A - X - (A^T X B + N)(B^T X B + R)^-1 (B^T X A + N^T) + Q = 0.

    Args:
        A: Shape (n, n).
        B: Shape (n, m).
        Q: Symmetric positive semidefinite (with N: Q - N R^-1 N^T is), shape (n, n).
        R: Symmetric positive definite, shape (m, m).
        N: Cross term, shape (n, m); zero if absent.

    Raises:
        RuntimeError: a matrix is not so, or there is no such solution.
    """
    call = "DiscreteAlgebraicRiccatiEquation"
    A, B, Q, R = (float_matrix(call, **{name: M}) for name, M in (("A", A), ("B", B), ("Q", Q), ("R", R)))
    if N is None and _sizes_fit(A, B, Q, R) and np.linalg.eigvalsh(Q).min(initial=np.inf) >= 0.0:
        if (made := small_regulator(A, B, Q, R, None, discrete=True)) is not None:
            return made[0]
    _check_cost(call, A, B, Q, R)
    N = np.zeros(B.shape) if N is None else float_matrix(call, N=N)
    _check_shape(call, "N", N, B.shape)
    reduced = Q - N @ np.linalg.solve(R, N.T)
    smallest = np.linalg.eigvalsh((reduced + reduced.T) / 2).min(initial=np.inf)
    if smallest < -1e-10:
        raise RuntimeError(
            f"{call}(): Q (less N R^-1 N^T) must be positive semidefinite; it has eigenvalue {smallest}."
        )
    # Completing the square in u takes N away (Bertsekas 2017, section 3.1).
    without_N = A - B @ np.linalg.solve(R, N.T)
    S = _solve(call, lambda: stabilizing_solution(without_N, B, reduced, R, discrete=True))
    require_stable(call, A - B @ np.linalg.solve(R + B.T @ S @ B, B.T @ S @ A + N.T), discrete=True)
    return S


def _lyapunov(call: str, A: ArrayLike, Q: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    A, Q = float_matrix(call, A=A), float_matrix(call, Q=Q)
    if A.shape != Q.shape or A.shape[0] != A.shape[1]:
        raise RuntimeError(
            f"{call}(): A and Q must be square and of equal size! Their shapes are {A.shape}, {Q.shape}."
        )
    _check_symmetric(call, "Q", Q)
    return A, Q


def _symmetric_solution(M: np.ndarray, Q: np.ndarray) -> np.ndarray:
    """X of M vec(X) + vec(Q) = 0, made symmetric."""
    X = np.linalg.solve(M, -Q.ravel()).reshape(Q.shape)
    return (X + X.T) / 2


def RealContinuousLyapunovEquation(A: ArrayLike, Q: ArrayLike) -> np.ndarray:
    """The solution X of A^T X + X A + Q = 0, shape (n, n).

    Args:
        A: Shape (n, n); no two eigenvalues may sum to zero.
        Q: Symmetric, shape (n, n).

    Raises:
        RuntimeError: the solution is not unique, or the shapes differ.
    """
    call = "RealContinuousLyapunovEquation"
    A, Q = _lyapunov(call, A, Q)
    values = np.linalg.eigvals(A)
    if (np.abs(values[:, None] + values[None, :]) < _UNIQUENESS).any():
        raise RuntimeError(f"{call}(): Solution is not unique!")
    if len(A) <= _FEW:
        one = np.eye(len(A))
        return _symmetric_solution(np.kron(A.T, one) + np.kron(one, A.T), Q)
    from scipy.linalg import solve_continuous_lyapunov

    X = solve_continuous_lyapunov(A.T, -Q)
    return (X + X.T) / 2


def RealDiscreteLyapunovEquation(A: ArrayLike, Q: ArrayLike) -> np.ndarray:
    """The solution X of A^T X A - X + Q = 0, shape (n, n).

    Args:
        A: Shape (n, n); no two eigenvalues may have product one.
        Q: Symmetric, shape (n, n).

    Raises:
        RuntimeError: the solution is not unique, or the shapes differ.
    """
    call = "RealDiscreteLyapunovEquation"
    A, Q = _lyapunov(call, A, Q)
    values = np.linalg.eigvals(A)
    if (np.abs(values[:, None] * values[None, :] - 1.0) < _UNIQUENESS).any():
        raise RuntimeError(f"{call}(): Solution is not unique!")
    if len(A) <= _FEW:
        return _symmetric_solution(np.kron(A.T, A.T) - np.eye(len(A) ** 2), Q)
    from scipy.linalg import solve_discrete_lyapunov

    X = solve_discrete_lyapunov(A.T, Q)
    return (X + X.T) / 2
