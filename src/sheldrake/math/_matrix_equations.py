"""Riccati and Lyapunov equations."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from sheldrake.math._matrices import float_matrix

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


__all__ = [
    "ContinuousAlgebraicRiccatiEquation",
    "DiscreteAlgebraicRiccatiEquation",
    "RealContinuousLyapunovEquation",
    "RealDiscreteLyapunovEquation",
]

_SYMMETRY = 1e-10  # how far from symmetric Q and R may be
_GROWTH = 1e-9  # of a closed loop, over its largest entry, that is round-off
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


def require_stable(call: str, closed: np.ndarray, *, discrete: bool) -> None:
    """Refuses what a Riccati solver gives where no feedback stabilizes: a closed loop that grows.

    Raises:
        RuntimeError: it does.
    """
    modes = np.linalg.eigvals(closed)
    growth = np.abs(modes) - 1.0 if discrete else modes.real
    if growth.max(initial=-1.0) > _GROWTH * max(1.0, np.abs(closed).max(initial=0.0)):
        raise RuntimeError(f"{call} fails. The system is not stabilizable.")


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
    from scipy.linalg import solve_continuous_are

    call = "ContinuousAlgebraicRiccatiEquation"
    A, B, Q, R = (float_matrix(call, **{name: M}) for name, M in (("A", A), ("B", B), ("Q", Q), ("R", R)))
    _check_cost(call, A, B, Q, R)
    S = _solve(call, lambda: solve_continuous_are(A, B, Q, R))
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
    from scipy.linalg import solve_discrete_are

    call = "DiscreteAlgebraicRiccatiEquation"
    A, B, Q, R = (float_matrix(call, **{name: M}) for name, M in (("A", A), ("B", B), ("Q", Q), ("R", R)))
    _check_cost(call, A, B, Q, R)
    N = np.zeros(B.shape) if N is None else float_matrix(call, N=N)
    _check_shape(call, "N", N, B.shape)
    reduced = Q - N @ np.linalg.solve(R, N.T)
    smallest = np.linalg.eigvalsh((reduced + reduced.T) / 2).min(initial=np.inf)
    if smallest < -1e-10:
        raise RuntimeError(
            f"{call}(): Q (less N R^-1 N^T) must be positive semidefinite; it has eigenvalue {smallest}."
        )
    S = _solve(call, lambda: solve_discrete_are(A, B, Q, R, s=N))
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


def RealContinuousLyapunovEquation(A: ArrayLike, Q: ArrayLike) -> np.ndarray:
    """The solution X of A^T X + X A + Q = 0, shape (n, n).

    Args:
        A: Shape (n, n); no two eigenvalues may sum to zero.
        Q: Symmetric, shape (n, n).

    Raises:
        RuntimeError: the solution is not unique, or the shapes differ.
    """
    from scipy.linalg import solve_continuous_lyapunov

    call = "RealContinuousLyapunovEquation"
    A, Q = _lyapunov(call, A, Q)
    values = np.linalg.eigvals(A)
    if (np.abs(values[:, None] + values[None, :]) < _UNIQUENESS).any():
        raise RuntimeError(f"{call}(): Solution is not unique!")
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
    from scipy.linalg import solve_discrete_lyapunov

    call = "RealDiscreteLyapunovEquation"
    A, Q = _lyapunov(call, A, Q)
    values = np.linalg.eigvals(A)
    if (np.abs(values[:, None] * values[None, :] - 1.0) < _UNIQUENESS).any():
        raise RuntimeError(f"{call}(): Solution is not unique!")
    X = solve_discrete_lyapunov(A.T, Q)
    return (X + X.T) / 2
