"""Matrix exponentials plus polynomials: what a linear system follows under piecewise polynomial inputs."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.trajectories._base import no_derivatives
from sheldrake.trajectories._piecewise import PiecewiseTrajectory
from sheldrake.trajectories._piecewise_polynomial import PiecewisePolynomial

if TYPE_CHECKING:
    from sheldrake.common._types import Scalar, Scalars
    from sheldrake.trajectories._base import Trajectory


_MOST_DEPENDENT = 1e4
"""Condition of eigenvectors up to which exponentials are sums over them: four of sixteen digits are lost at most."""


class MatrixExponential:
    """exp(A t) for many times t: sums over eigenvectors of A where these are far from dependent.

    Args:
        A: Shape `(n, n)` [1/s].
    """

    def __init__(self, A: np.ndarray):
        self._A = A

    @functools.cached_property
    def modes(self) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
        """Eigenvalues [1/s], eigenvectors as columns, and their inverse; None where these would amplify rounding."""
        A = self._A
        if A.dtype != float or A.size == 0 or A.shape[0] != A.shape[1] or not np.isfinite(A).all():
            return None
        values, vectors = np.linalg.eig(A)
        return (values, vectors, np.linalg.inv(vectors)) if np.linalg.cond(vectors) < _MOST_DEPENDENT else None

    def applied(self, t: Scalar, v: np.ndarray) -> np.ndarray:
        """exp(A t) v; t [s]."""
        if self.modes is None:
            from scipy.linalg import expm

            return expm(self._A * t) @ v
        values, vectors, inverse = self.modes
        parts = inverse @ v
        return (vectors @ (np.exp(values * t).reshape(-1, *[1] * (parts.ndim - 1)) * parts)).real


class ExponentialPlusPiecewisePolynomial(PiecewiseTrajectory):
    """y(t) = K exp(A (t - t_j)) alpha_j + p(t), on the segment j that begins at t_j.

    Args:
        K: Shape `(rows, n)`.
        A: Shape `(n, n)` [1/s].
        alpha: One column for each segment, shape `(n, segments)`.
        piecewise_polynomial_part: p, a column.

    Raises:
        RuntimeError: the shapes do not fit.
    """

    def __init__(self, K: Scalars, A: Scalars, alpha: Scalars, piecewise_polynomial_part: PiecewisePolynomial):
        p = piecewise_polynomial_part
        PiecewiseTrajectory.__init__(self, p.get_segment_times())
        self._K, self._A, self._alpha = (self._matrix("", m) for m in (K, A, alpha))
        self._p: Any = p.Clone()
        self._exp: Any = MatrixExponential(self._A)
        n = self._A.shape[0]
        expected = ((p.rows(), n), (n, n), (n, p.get_number_of_segments()))
        found = (self._K.shape, self._A.shape, self._alpha.shape)
        if found != expected or p.cols() != 1:
            raise RuntimeError(f"{self._name('')}: K, A, alpha have shapes {found}; expected {expected}.")

    @functools.cached_property
    def _weights(self) -> np.ndarray | None:
        """W with K exp(A t) alpha_j = W_j exp(e t), e the eigenvalues of A; shape (segments, rows, n)."""
        modes = self._exp.modes
        return None if modes is None else (self._K @ modes[1]) * (modes[2] @ self._alpha).T[:, None, :]

    def _exponential(self, j: int, t: Scalar) -> np.ndarray:
        """K exp(A t) alpha_j, a column; t [s] since the segment's begin."""
        if self._weights is None:
            return self._K @ self._exp.applied(t, self._alpha[:, j : j + 1])
        return (self._weights[j] @ np.exp(self._exp.modes[0] * t)).real[:, None]

    def shiftRight(self, offset: float) -> None:
        """Moves all breaks later by an offset [s]."""
        self._breaks = [b + offset for b in self._breaks]
        self._p.shiftRight(offset)

    def do_value(self, t: Scalar) -> np.ndarray:
        """The vector at time t."""
        j = self._index(self._clamped(t))  # Beyond its ends the exponential goes on; only the polynomial stops.
        return self._exponential(j, t - self._breaks[j]) + self._p.value(t)

    def do_rows(self) -> int:
        return self._p.rows()

    def do_cols(self) -> int:
        """One."""
        return self._p.cols()

    def do_has_derivative(self) -> bool:
        """False."""
        return False

    def DoEvalDerivative(self, t: Scalar, derivative_order: int) -> np.ndarray:
        """There is none."""
        raise no_derivatives()

    def DoMakeDerivative(self, derivative_order: int) -> Trajectory:
        """There is none."""
        raise no_derivatives()
