"""Constraints that keep z = A x + b, or a matrix, in a convex cone."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._enums import BoundEnum
from sheldrake.solvers import _arrays
from sheldrake.solvers._functions.evaluators import Changes, Constraint, EvaluatorBase
from sheldrake.solvers._functions.norm_costs import sum_of_squares
from sheldrake.solvers._text import latex_matrix, latex_number
from sheldrake.symbolic import Formula, positive_semidefinite
from sheldrake.symbolic import _functions as symbolic

if TYPE_CHECKING:
    import scipy.sparse
    from numpy.typing import ArrayLike

    from sheldrake.solvers._arrays import Matrix


class _ConeConstraint(Constraint):
    """z = A x + b in a cone."""

    _A: np.ndarray
    _b: np.ndarray
    _fewest_rows = 1

    def _rows_alone(self) -> int | None:
        """How many of its first values are rows of z themselves, before the one made of all of z; None: not so."""
        return None

    def gradient_sparsity_pattern(self) -> list[tuple[int, int]] | None:
        """Returns which derivatives may differ from zero, as (output, variable); None if all."""
        alone = self._rows_alone()
        if self._sparsity is not None or alone is None:
            return self._sparsity
        pattern = []
        for column in np.flatnonzero(self._A.any(axis=0)).tolist():
            pattern += [(row, column) for row in range(alone) if self._A[row, column]]
            pattern.append((alone, column))
        return pattern

    def _set_affine(self, A: Any, b: ArrayLike) -> None:
        A = A.toarray() if _arrays.is_sparse(A) else _arrays.float_matrix(A)
        b = _arrays.float_vector(b)
        if A.shape[0] != b.size or A.shape[0] < self._fewest_rows:
            raise RuntimeError(
                f"{type(self).__name__}: A is {A.shape[0]} x {A.shape[1]} and b has {b.size} elements; they need the "
                f"same number of rows, at least {self._fewest_rows}."
            )
        self._A, self._b = A, b
        Changes.note()

    def A(self) -> scipy.sparse.csc_matrix:
        """Returns the matrix of z = A x + b as a SciPy csc_matrix."""
        from scipy.sparse import csc_matrix

        return csc_matrix(self._A)

    def b(self) -> np.ndarray:
        """Returns the constant of z = A x + b, shape `(m,)`."""
        return self._b.copy()

    @checked
    def UpdateCoefficients(self, new_A: Any, new_b: ArrayLike) -> None:
        """Sets A and b.

        Raises:
            ValueError: the number of variables is another.
        """
        A = new_A.toarray() if _arrays.is_sparse(new_A) else _arrays.float_matrix(new_A)
        if A.shape[1] != self._num_vars:
            raise ValueError(
                f"{type(self).__name__}::UpdateCoefficients uses new_A with {A.shape[1]} columns to update a "
                f"constraint with {self._num_vars} variables."
            )
        self._set_affine(A, new_b)

    def _z(self, x: np.ndarray) -> np.ndarray:
        return self._A @ x + self._b

    def _z_symbols(self, x: np.ndarray) -> np.ndarray:
        return _arrays.affine(self._A, x, self._b)


def _objects(*items: object) -> np.ndarray:
    out = np.empty(len(items), dtype=object)
    out[:] = items
    return out


class LorentzConeConstraint(_ConeConstraint):
    """z_0 >= |z_1 ... z_m| with z = A x + b.

    Args:
        A: Shape `(m + 1, n)`.
        b: Shape `(m + 1,)`.
        eval_type: One value z_0 - |z_1 ...|, with the derivatives of a smooth stand-in near zero (`kConvexSmooth`) or
            without (`kConvex`); or two values z_0 and z_0^2 - z_1^2 - ... (`kNonconvex`).
    """

    class EvalType(BoundEnum):
        """How a Lorentz cone constraint is evaluated for solvers that see only functions."""

        kConvex = 0
        kConvexSmooth = 1
        kNonconvex = 2

    def __init__(self, A: ArrayLike, b: ArrayLike, eval_type: EvalType = EvalType.kConvexSmooth):
        self._set_affine(A, b)
        self._eval_type = eval_type
        self._set_sizes(2 if eval_type is self.EvalType.kNonconvex else 1, self._A.shape[1])
        self._set_bounds(np.zeros(self._num_outputs), np.full(self._num_outputs, np.inf))

    def _rows_alone(self) -> int:
        return self._num_outputs - 1

    def eval_type(self) -> EvalType:
        """Returns how it is evaluated."""
        return self._eval_type

    def _eval(self, x: np.ndarray) -> np.ndarray:
        z = self._z(x)
        if self._eval_type is self.EvalType.kNonconvex:
            return np.array([z[0], z[0] ** 2 - z[1:] @ z[1:]])
        return np.array([z[0] - np.linalg.norm(z[1:])])

    def _jacobian(self, x: np.ndarray) -> np.ndarray:
        z = self._z(x)
        if self._eval_type is self.EvalType.kNonconvex:
            return np.vstack((self._A[0], 2.0 * z[0] * self._A[0] - 2.0 * z[1:] @ self._A[1:]))
        square = z[1:] @ z[1:]
        if self._eval_type is self.EvalType.kConvexSmooth:
            square += 1e-12 if square < 1e-12 else 0.0  # The norm has no derivative at zero; that of a hyperboloid has.
        with np.errstate(invalid="ignore", divide="ignore"):
            return (self._A[0] - (z[1:] @ self._A[1:]) / np.sqrt(square)).reshape(1, -1)

    def _eval_symbols(self, x: np.ndarray) -> np.ndarray:
        z = self._z_symbols(x)
        if self._eval_type is self.EvalType.kNonconvex:
            return _objects(z[0], z[0] ** 2 - sum_of_squares(z[1:]))
        return _objects(z[0] - symbolic.sqrt(sum_of_squares(z[1:])))

    def _latex(self, vars: np.ndarray, precision: int) -> str:
        z = self._z_symbols(_arrays.symbols(vars))
        return rf"{_norm(z[1:], precision)} \le {latex_number(z[0], precision)}"


def _norm(z: np.ndarray, precision: int) -> str:
    rows = r" \\ ".join(latex_number(e, precision) for e in z)
    return rf"\left|\begin{{bmatrix}} {rows} \end{{bmatrix}}\right|_2"


class RotatedLorentzConeConstraint(_ConeConstraint):
    """z_0 >= 0, z_1 >= 0, z_0 z_1 >= z_2^2 + ... with z = A x + b.

    Args:
        A: Shape `(m + 2, n)`.
        b: Shape `(m + 2,)`.
    """

    _fewest_rows = 2

    @checked
    def __init__(self, A: ArrayLike, b: ArrayLike):
        self._set_affine(A, b)
        self._set_sizes(3, self._A.shape[1])
        self._set_bounds(np.zeros(3), np.full(3, np.inf))

    def _rows_alone(self) -> int:
        return 2

    def _eval(self, x: np.ndarray) -> np.ndarray:
        z = self._z(x)
        return np.array([z[0], z[1], z[0] * z[1] - z[2:] @ z[2:]])

    def _jacobian(self, x: np.ndarray) -> np.ndarray:
        z, A = self._z(x), self._A
        return np.vstack((A[0], A[1], z[0] * A[1] + z[1] * A[0] - 2.0 * z[2:] @ A[2:]))

    def _eval_symbols(self, x: np.ndarray) -> np.ndarray:
        z = self._z_symbols(x)
        return _objects(z[0], z[1], z[0] * z[1] - sum_of_squares(z[2:]))

    def _latex(self, vars: np.ndarray, precision: int) -> str:
        z = self._z_symbols(_arrays.symbols(vars))
        a, b = (latex_number(e, precision) for e in z[:2])
        product = latex_number(z[0] * z[1], precision)
        return rf"0 \le {a},\\ 0 \le {b},\\ {_norm(z[2:], precision)}^2 \le {product}"


class ExponentialConeConstraint(_ConeConstraint):
    """z_0 >= z_1 exp(z_2 / z_1), z_1 > 0 with z = A x + b.

    Args:
        A: Shape `(3, n)`.
        b: Shape `(3,)`.
    """

    _fewest_rows = 3

    def __init__(self, A: ArrayLike, b: ArrayLike):
        self._set_affine(A, b)
        self._set_sizes(2, self._A.shape[1])
        self._set_bounds(np.zeros(2), np.full(2, np.inf))

    def A(self) -> np.ndarray:
        """Returns the matrix of z = A x + b, shape `(3, n)`."""
        return self._A.copy()

    def _eval(self, x: np.ndarray) -> np.ndarray:
        z = self._z(x)
        return np.array([z[0] - z[1] * np.exp(z[2] / z[1]), z[1]])

    def _jacobian(self, x: np.ndarray) -> np.ndarray:
        z, A = self._z(x), self._A
        e = np.exp(z[2] / z[1])
        return np.vstack((A[0] - e * (1.0 - z[2] / z[1]) * A[1] - e * A[2], A[1]))

    def _eval_symbols(self, x: np.ndarray) -> np.ndarray:
        z = self._z_symbols(x)
        return _objects(z[0] - z[1] * symbolic.exp(z[2] / z[1]), z[1])

    _display = EvaluatorBase._display

    def _latex(self, vars: np.ndarray, precision: int) -> str:
        z = self._z_symbols(_arrays.symbols(vars))
        a, b = (latex_number(e, precision) for e in z[:2])
        return rf"0 \le {b},\\ {a} \le {latex_number(z[1] * symbolic.exp(z[2] / z[1]), precision)}"


class _MatrixConstraint(Constraint):
    """A symmetric matrix whose eigenvalues, the values of this constraint, are not negative."""

    _rows: int

    def _set_rows(self, rows: int, num_vars: int) -> None:
        self._rows = rows
        self._set_sizes(rows, num_vars)
        self._set_bounds(np.zeros(rows), np.full(rows, np.inf))

    def matrix_rows(self) -> int:
        """Returns the number of rows of the matrix."""
        return self._rows

    def _matrix(self, x: np.ndarray) -> np.ndarray:
        raise NotImplementedError

    def _eval(self, x: np.ndarray) -> np.ndarray:
        return np.linalg.eigvalsh(self._matrix(x))

    def _eval_duals(self, x: np.ndarray) -> np.ndarray:
        raise _no_eigenvalues("AutoDiffXd")

    def _eval_symbols(self, x: np.ndarray) -> np.ndarray:
        raise _no_eigenvalues("symbolic::Expression")

    def _formula(self, x: np.ndarray) -> Formula:
        return positive_semidefinite(self._matrix(x))

    _display = EvaluatorBase._display

    def _latex(self, vars: np.ndarray, precision: int) -> str:
        return rf"{latex_matrix(self._matrix(_arrays.symbols(vars)), precision)} \succeq 0"


def _no_eigenvalues(scalar: str) -> RuntimeError:
    return RuntimeError(
        "The Eval function for positive semidefinite constraint is not defined, since the eigen solver does not work "
        f"for {scalar}."
    )


class PositiveSemidefiniteConstraint(_MatrixConstraint):
    """A symmetric matrix of variables (column after column) without negative eigenvalues.

    Args:
        rows: Number of its rows.
    """

    @checked
    def __init__(self, rows: int):
        self._set_rows(int(rows), int(rows) ** 2)

    def _matrix(self, x: np.ndarray) -> np.ndarray:
        return x.reshape(self._rows, self._rows).T


class LinearMatrixInequalityConstraint(_MatrixConstraint):
    """F_0 + x_1 F_1 + ... + x_n F_n without negative eigenvalues.

    Args:
        F: Symmetric matrices, n + 1 of them.
        symmetry_tolerance: Largest difference of two elements that should be equal.
    """

    @checked
    def __init__(self, F: Sequence[Matrix], symmetry_tolerance: float = 1e-10):
        matrices = [_arrays.float_matrix(f) for f in F]
        for f in matrices:
            if f.shape != matrices[0].shape or f.shape[0] != f.shape[1]:
                raise RuntimeError("LinearMatrixInequalityConstraint: the matrices must be square, all of one size.")
            if np.abs(f - f.T).max(initial=0.0) > symmetry_tolerance:
                raise RuntimeError("LinearMatrixInequalityConstraint: a matrix is not symmetric.")
        self._F = matrices
        self._set_rows(matrices[0].shape[0], len(matrices) - 1)

    def F(self) -> list[np.ndarray]:
        """Returns the matrices."""
        return [f.copy() for f in self._F]

    def _matrix(self, x: np.ndarray) -> np.ndarray:
        stack = np.stack([f.ravel() for f in self._F[1:]], axis=1)
        if x.dtype == object:
            return _arrays.affine(stack, x, self._F[0].ravel()).reshape(self._rows, self._rows)
        return (stack @ x + self._F[0].ravel()).reshape(self._rows, self._rows)
