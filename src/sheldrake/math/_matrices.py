"""Symmetric and definite matrices, and quadratic forms."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._overloads import Mismatch, incompatible
from sheldrake.common._scalars import any_array, as_array, scalar_types

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.common._types import Scalars

__all__ = [
    "BalanceQuadraticForms",
    "DecomposePSDmatrixIntoXtransposeTimesX",
    "DecomposePositiveQuadraticForm",
    "ExtractPrincipalSubmatrix",
    "IsPositiveDefinite",
    "IsSymmetric",
    "ToLowerTriangularColumnsFromMatrix",
    "ToSymmetricMatrixFromLowerTriangularColumns",
    "VectorToSkewSymmetric",
]

_EPSILON = float(np.finfo(float).eps)


def float_matrix(call: str, **named: Any) -> np.ndarray:
    """An argument as a matrix of floats; a vector counts as a column.

    Raises:
        TypeError: it is not one.
    """
    ((name, value),) = named.items()
    try:
        array = any_array(float, value)
    except Mismatch:
        raise incompatible(call, [f"({name}: float array of shape (m, n))"], (value,), {}) from None
    if array.ndim not in (1, 2):
        raise incompatible(call, [f"({name}: float array of shape (m, n))"], (value,), {})
    return array[:, None] if array.ndim == 1 else array


def float_vector(call: str, **named: Any) -> np.ndarray:
    """An argument as a vector of floats; a column counts as a vector.

    Raises:
        TypeError: it is not one.
    """
    ((name, value),) = named.items()
    matrix = float_matrix(call, **named)
    if matrix.shape[1] != 1:
        raise incompatible(call, [f"({name}: float array of shape (n,))"], (value,), {})
    return matrix[:, 0]


def VectorToSkewSymmetric(p: Scalars) -> np.ndarray:
    """The matrix S with S v = p x v, shape (3, 3).

    Args:
        p: Vector of any scalar, shape (3,).
    """
    for T in scalar_types():
        try:
            x, y, z = as_array(T, p, (3,)).tolist()
        except Mismatch:
            continue
        return as_array(T, [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]], (3, 3)).copy()
    raise incompatible("VectorToSkewSymmetric", ["(p: array of shape (3,))"], (p,), {})


def IsSymmetric(matrix: Scalars, precision: float = _EPSILON) -> bool:
    """Whether a matrix is square and equal to its transpose, to `precision` in every number."""
    M = float_matrix("IsSymmetric", matrix=matrix)
    return M.shape[0] == M.shape[1] and bool((np.abs(M - M.T) <= precision).all())


@checked
def IsPositiveDefinite(matrix: Scalars, tolerance: float = 0.0, symmetry_tolerance: float = 0.0) -> bool:
    """Whether a matrix is symmetric and no eigenvalue is less than `tolerance`.

    Where the eigenvalue of largest magnitude is more than one, `tolerance` is relative to it.
    """
    M = float_matrix("IsPositiveDefinite", matrix=matrix)
    if not IsSymmetric(M, symmetry_tolerance):
        return False
    values = np.linalg.eigvalsh(M)
    return bool((values >= tolerance * max(1.0, np.abs(values).max(initial=0.0))).all())


def ToSymmetricMatrixFromLowerTriangularColumns(lower_triangular_columns: ArrayLike) -> np.ndarray:
    """The symmetric matrix whose lower triangle is given column by column.

    Args:
        lower_triangular_columns: Stacked columns, shape (n (n + 1) / 2,).

    Raises:
        ValueError: no n has that many numbers.
    """
    numbers = float_vector(
        "ToSymmetricMatrixFromLowerTriangularColumns", lower_triangular_columns=lower_triangular_columns
    )
    n = (math.isqrt(8 * len(numbers) + 1) - 1) // 2
    if n * (n + 1) // 2 != len(numbers):
        raise ValueError(
            f"ToSymmetricMatrixFromLowerTriangularColumns(): {len(numbers)} numbers do not fill a triangle; "
            "1, 3, 6, 10, ... do."
        )
    M = np.zeros((n, n))
    rows, cols = np.triu_indices(n)  # of the transpose: upper rows are lower columns
    M[cols, rows] = M[rows, cols] = numbers
    return M


def ToLowerTriangularColumnsFromMatrix(matrix: Scalars) -> np.ndarray:
    """The lower triangle of a square matrix, column by column, shape (n (n + 1) / 2,).

    Raises:
        ValueError: the matrix is not square.
    """
    M = _square("ToLowerTriangularColumnsFromMatrix", matrix)
    return M.T[np.triu_indices(len(M))]


def _square(call: str, matrix: Scalars) -> np.ndarray:
    M = float_matrix(call, matrix=matrix)
    if M.shape[0] != M.shape[1]:
        raise ValueError(f"{call}(): a matrix of shape {M.shape} is not square.")
    return M


def ExtractPrincipalSubmatrix(matrix: Scalars, indices: Iterable[int]) -> np.ndarray:
    """The rows and columns of a square matrix with the given numbers, in ascending order.

    Raises:
        ValueError: an index is outside of the matrix, or the matrix is not square.
    """
    M = _square("ExtractPrincipalSubmatrix", matrix)
    if not isinstance(indices, (set, frozenset)):
        raise incompatible("ExtractPrincipalSubmatrix", ["(matrix, indices: set of int)"], (matrix, indices), {})
    chosen = sorted(indices)
    if not chosen or chosen[0] < 0 or chosen[-1] >= len(M):
        raise ValueError(f"ExtractPrincipalSubmatrix(): indices {chosen} are not all within 0 ... {len(M) - 1}.")
    return M[np.ix_(chosen, chosen)]


@checked
def DecomposePSDmatrixIntoXtransposeTimesX(
    Y: ArrayLike, zero_tol: float, return_empty_if_not_psd: bool = False
) -> np.ndarray:
    """A matrix X with X^T X = Y: of n rows if Y is positive definite, else of as many as Y has rank.

    Args:
        Y: Symmetric positive semidefinite matrix, shape (n, n); only its lower triangle is read.
        zero_tol: Eigenvalues up to this count as zero where Y is not positive definite.
        return_empty_if_not_psd: Give an array of shape (0, n) instead of an error.

    Raises:
        RuntimeError: Y is not square or not positive semidefinite, or `zero_tol` is negative.
    """
    M = float_matrix("DecomposePSDmatrixIntoXtransposeTimesX", Y=Y)
    if M.shape[0] != M.shape[1]:
        raise RuntimeError("Y is not square.")
    if zero_tol < 0:
        raise RuntimeError("zero_tol should be non-negative.")
    values, vectors = np.linalg.eigh(M)
    smallest = values.min(initial=math.inf)
    if smallest < -zero_tol:
        if return_empty_if_not_psd:
            return np.zeros((0, len(M)))
        raise RuntimeError(
            f"Y is not positive semidefinite. It has an eigenvalue {smallest:g} that is less than the tolerance "
            f"{-zero_tol:g}."
        )
    rounding = len(M) * _EPSILON * values.max(initial=0.0)
    if smallest > rounding:
        return np.linalg.cholesky(M).T
    kept = values > max(zero_tol, rounding)
    return np.sqrt(values[kept])[:, None] * vectors[:, kept].T


@checked
def DecomposePositiveQuadraticForm(
    Q: ArrayLike, b: ArrayLike, c: float, tol: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """R, shape (r, n), and d, shape (r, 1), with x^T Q x + b^T x + c = |R x + d|^2.

    Args:
        Q: Matrix, shape (n, n).
        b: Vector, shape (n,).
        c: Number.
        tol: Eigenvalues of [[Q, b/2], [b^T/2, c]] may be as low as minus this.

    Raises:
        RuntimeError: the form takes negative values, or the sizes differ.
    """
    M = float_matrix("DecomposePositiveQuadraticForm", Q=Q)
    linear = float_vector("DecomposePositiveQuadraticForm", b=b)
    if M.shape[0] != M.shape[1]:
        raise RuntimeError("Q should be a square matrix.")
    if len(linear) != len(M):
        raise RuntimeError(f"b does not have the right size. It has {len(linear)} numbers, Q has {len(M)} rows.")
    half = linear[:, None] / 2
    whole = np.block([[(M + M.T) / 2, half], [half.T, np.array([[float(c)]])]])
    X = DecomposePSDmatrixIntoXtransposeTimesX(whole, tol)
    return X[:, :-1], X[:, -1:]


def BalanceQuadraticForms(S: ArrayLike, P: ArrayLike) -> np.ndarray:
    """A matrix T that makes T^T S T = D and |T^T P T| = D^-1, both diagonal.

    Args:
        S: Symmetric positive definite matrix, shape (n, n).
        P: Symmetric matrix of full rank, shape (n, n).

    Raises:
        RuntimeError: S or P is not so.
    """
    tolerance = 1e-8
    S, P = float_matrix("BalanceQuadraticForms", S=S), float_matrix("BalanceQuadraticForms", P=P)
    if S.shape != P.shape or not IsPositiveDefinite(S, tolerance, tolerance):
        raise RuntimeError(f"BalanceQuadraticForms(): S, of shape {S.shape}, must be symmetric positive definite.")
    if not IsSymmetric(P, tolerance):
        raise RuntimeError("BalanceQuadraticForms(): P must be symmetric.")
    R = np.linalg.inv(np.linalg.cholesky(S))
    U, sigma, _ = np.linalg.svd(R @ P @ R.T)
    if sigma[-1] < tolerance * max(1.0, sigma[0]):
        raise RuntimeError(f"BalanceQuadraticForms(): P must have full rank; singular values are {sigma.tolist()}.")
    return R.T @ U * sigma**-0.25
