"""Costs that are norms of affine vectors, or made of their squares."""

from __future__ import annotations

from collections.abc import Hashable
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.solvers import _arrays
from sheldrake.solvers._functions.costs import same_count
from sheldrake.solvers._functions.evaluators import Changes, Cost, Many
from sheldrake.solvers._text import latex_matrix
from sheldrake.symbolic import Expression, ToLatex
from sheldrake.symbolic import _functions as symbolic

if TYPE_CHECKING:
    import scipy.sparse
    from numpy.typing import ArrayLike


class _NormCost(Cost):
    """A function of z = A x + b."""

    _A: Any
    _b: np.ndarray

    @checked
    def __init__(self, A: ArrayLike, b: ArrayLike):
        self._A, self._b = _arrays.float_matrix(A), _arrays.float_vector(b)
        self._check()
        self._set_sizes(1, self._A.shape[1])

    def _check(self) -> None:
        if self._A.shape[0] != self._b.size:
            raise RuntimeError(f"{type(self).__name__}: A and b must have the same number of rows.")

    def b(self) -> np.ndarray:
        """Returns the constant of z = A x + b, shape `(m,)`."""
        return self._b.copy()

    def _update(self, new_A: ArrayLike | scipy.sparse.spmatrix, new_b: ArrayLike) -> None:
        A = _arrays.float_matrix(new_A)
        b = np.zeros(A.shape[0]) if new_b is None else _arrays.float_vector(new_b)
        same_count(A.shape[1], self._num_vars)
        if A.shape[0] != b.size:
            raise RuntimeError(f"{type(self).__name__}: new_A and new_b must have the same number of rows.")
        self._A, self._b = A, b
        Changes.note()

    def _z(self, x: np.ndarray) -> np.ndarray:
        return self._A @ x + self._b

    def _z_symbols(self, x: np.ndarray) -> np.ndarray:
        return _arrays.affine(self._A, x, self._b)

    def _value(self, z: np.ndarray) -> float:
        raise NotImplementedError

    def _slope(self, z: np.ndarray) -> np.ndarray:
        """Derivative by z, shape `(m,)`."""
        raise NotImplementedError

    def _eval(self, x: np.ndarray) -> np.ndarray:
        return np.array([self._value(self._z(x))])

    def _jacobian(self, x: np.ndarray) -> np.ndarray:
        return np.asarray(self._A.T @ self._slope(self._z(x))).reshape(1, -1)

    def _symbol(self, z: np.ndarray) -> Expression:
        raise NotImplementedError

    def _eval_symbols(self, x: np.ndarray) -> np.ndarray:
        out = np.empty(1, dtype=object)
        out[0] = self._symbol(self._z_symbols(x))
        return out

    _norm = ""

    def _latex(self, vars: np.ndarray, precision: int) -> str:
        return rf"\left|{latex_matrix(self._z_symbols(_arrays.symbols(vars)), precision)}\right|_{self._norm}"


@checked
class _DenseNormCost(_NormCost):
    def A(self) -> np.ndarray:
        """Returns the matrix of z = A x + b, shape `(m, n)`."""
        return self._A.copy()

    def UpdateCoefficients(self, new_A: Any, new_b: Any = None) -> None:
        """Sets A and b; b is zero if absent.

        Raises:
            RuntimeError: the number of variables is another, or rows differ.
        """
        self._update(new_A, new_b)

    def update_A_entry(self, i: int, j: int, val: float) -> None:
        """Sets A(i, j)."""
        self._A[i, j] = val

    def update_b_entry(self, i: int, val: float) -> None:
        """Sets b(i)."""
        self._b[i] = val


class L1NormCost(_DenseNormCost):
    """The sum of absolute values of A x + b.

    Args:
        A: Shape `(m, n)`.
        b: Shape `(m,)`.
    """

    _norm = "1"

    def _value(self, z: np.ndarray) -> float:
        return np.abs(z).sum()

    def _slope(self, z: np.ndarray) -> np.ndarray:
        return np.where(z < 0.0, -1.0, 1.0)

    def _symbol(self, z: np.ndarray) -> Expression:
        total = symbolic.abs(z[0])
        for zi in z[1:]:
            total = total + symbolic.abs(zi)
        return total


class LInfNormCost(_DenseNormCost):
    """The largest absolute value of A x + b.

    Args:
        A: Shape `(m, n)`.
        b: Shape `(m,)`.
    """

    _norm = r"\infty"

    def _value(self, z: np.ndarray) -> float:
        return np.abs(z).max()

    def _slope(self, z: np.ndarray) -> np.ndarray:
        i = int(np.abs(z).argmax())
        return np.where(np.arange(z.size) == i, -1.0 if z[i] < 0.0 else 1.0, 0.0)

    def _symbol(self, z: np.ndarray) -> Expression:
        largest = symbolic.abs(z[0])
        for zi in z[1:]:
            largest = symbolic.max(largest, symbolic.abs(zi))
        return largest


class L2NormCost(_NormCost):
    """The Euclidean length of A x + b.

    Args:
        A: Shape `(m, n)`, dense or sparse.
        b: Shape `(m,)`.
    """

    _norm = "2"

    def GetDenseA(self) -> np.ndarray:
        """Returns the matrix of z = A x + b, shape `(m, n)`."""
        return self._A.toarray() if _arrays.is_sparse(self._A) else self._A.copy()

    def get_sparse_A(self) -> scipy.sparse.csc_matrix:
        """Returns the matrix of z = A x + b as a SciPy csc_matrix."""
        from scipy.sparse import csc_matrix

        return csc_matrix(self._A)

    @checked
    def UpdateCoefficients(self, new_A: Any, new_b: Any = None) -> None:
        """Sets A and b; b is zero if absent.

        Raises:
            RuntimeError: the number of variables is another, or rows differ.
        """
        self._update(new_A, new_b)

    def _value(self, z: np.ndarray) -> float:
        return float(np.linalg.norm(z))

    def _slope(self, z: np.ndarray) -> np.ndarray:
        with np.errstate(invalid="ignore", divide="ignore"):
            return z / np.linalg.norm(z)

    def _symbol(self, z: np.ndarray) -> Expression:
        return symbolic.sqrt(sum_of_squares(z))

    def _alike(self) -> Hashable | None:
        A = self.GetDenseA()
        return ("L2NormCost", A.shape, A.tobytes(), self._b.tobytes())

    def _many(self) -> Many:
        return _Lengths(self.GetDenseA(), self._b)


_ROUNDING = 1e-8  # Lengths below this count as smooth: those that constraints keep at zero have no direction.


class _Lengths:
    """Lengths |z| of z = A x + b at many points, as sqrt(z' z + r^2) - r, which has derivatives where z is zero."""

    def __init__(self, A: np.ndarray, b: np.ndarray):
        self._A, self._b = A, b

    def _z(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        z = points @ self._A.T + self._b
        return z, np.sqrt((z * z).sum(axis=1) + _ROUNDING**2)

    def values(self, points: np.ndarray) -> np.ndarray:
        """Lengths, shape (points, 1)."""
        return self._z(points)[1][:, None] - _ROUNDING

    def slopes(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Lengths and their derivatives, shape (points, 1, n)."""
        z, lengths = self._z(points)
        return lengths[:, None] - _ROUNDING, ((z / lengths[:, None]) @ self._A)[:, None, :]

    def hessian(self, points: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """Second derivatives times weights of shape (points, 1), shape (points, n, n)."""
        z, lengths = self._z(points)
        along = (z / lengths[:, None]) @ self._A
        H = (self._A.T @ self._A)[None] - along[:, :, None] * along[:, None, :]
        return H * (weights[:, 0] / lengths)[:, None, None]


def sum_of_squares(z: np.ndarray) -> Expression:
    """z' z as an expression."""
    total = z[0] * z[0] if len(z) else Expression(0.0)
    for zi in z[1:]:
        total = total + zi * zi
    return total


class PerspectiveQuadraticCost(_DenseNormCost):
    """(z_1^2 + ... + z_m^2) / z_0 with z = A x + b.

    Args:
        A: Shape `(m + 1, n)`.
        b: Shape `(m + 1,)`.
    """

    def _check(self) -> None:
        super()._check()
        if self._A.shape[0] < 2:
            raise RuntimeError("PerspectiveQuadraticCost: A must have at least two rows.")

    def _value(self, z: np.ndarray) -> float:
        return (z[1:] @ z[1:]) / z[0]

    def _slope(self, z: np.ndarray) -> np.ndarray:
        return np.concatenate(([-(z[1:] @ z[1:]) / z[0] ** 2], 2.0 * z[1:] / z[0]))

    def _symbol(self, z: np.ndarray) -> Expression:
        return sum_of_squares(z[1:]) / z[0]

    def _latex(self, vars: np.ndarray, precision: int) -> str:
        return ToLatex(self._eval_symbols(_arrays.symbols(vars))[0], precision)
