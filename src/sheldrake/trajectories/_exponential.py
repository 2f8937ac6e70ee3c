"""Matrix exponentials plus polynomials: what a linear system follows under piecewise polynomial inputs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.trajectories._base import no_derivatives
from sheldrake.trajectories._piecewise import PiecewiseTrajectory
from sheldrake.trajectories._piecewise_polynomial import PiecewisePolynomial

if TYPE_CHECKING:
    from sheldrake.common._types import Scalar, Scalars
    from sheldrake.trajectories._base import Trajectory


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
        n = self._A.shape[0]
        expected = ((p.rows(), n), (n, n), (n, p.get_number_of_segments()))
        found = (self._K.shape, self._A.shape, self._alpha.shape)
        if found != expected or p.cols() != 1:
            raise RuntimeError(f"{self._name('')}: K, A, alpha have shapes {found}; expected {expected}.")

    def shiftRight(self, offset: float) -> None:
        """Moves all breaks later by an offset [s]."""
        self._breaks = [b + offset for b in self._breaks]
        self._p.shiftRight(offset)

    def do_value(self, t: Scalar) -> np.ndarray:
        """The vector at time t."""
        from scipy.linalg import expm

        j = self._index(self._clamped(t))  # Beyond its ends the exponential goes on; only the polynomial stops.
        return self._K @ expm(self._A * (t - self._breaks[j])) @ self._alpha[:, j : j + 1] + self._p.value(t)

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
