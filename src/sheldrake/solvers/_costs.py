"""Costs of known shape: linear, quadratic, norms, expressions.

What a program's costs are made of; `_program_costs` makes them of expressions and matrices.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from sheldrake.solvers import _arrays
from sheldrake.solvers._evaluators import Cost, EvaluatorBase
from sheldrake.solvers._expressions import ExpressionFunction
from sheldrake.solvers._text import latex_matrix
from sheldrake.symbolic import Expression, ToLatex
from sheldrake.symbolic import _functions as symbolic


def symmetric(Q: Any) -> np.ndarray:
    """The symmetric part of a square matrix.

    Raises:
        RuntimeError: it is not square.
    """
    Q = _arrays.float_matrix(Q)
    if Q.shape[0] != Q.shape[1]:
        raise RuntimeError(f"The matrix of a quadratic form must be square, it is {Q.shape[0]} x {Q.shape[1]}.")
    return Q if np.array_equal(Q, Q.T) else (Q + Q.T) / 2.0


def is_semidefinite(Q: np.ndarray, sign: float = 1.0) -> bool:
    """Whether sign * Q has no negative eigenvalue, up to rounding."""
    if Q.size == 0:
        return True
    values = np.linalg.eigvalsh(Q) * sign
    return bool(values.min() >= -1e-12 * max(1.0, float(np.abs(values).max())))


class LinearCost(Cost):
    """a' x + b.

    Args:
        a: Coefficients, shape `(n,)`.
        b: Constant.
    """

    def __init__(self, a: Any, b: float = 0.0):
        self._a, self._b = _arrays.float_vector(a), float(b)
        self._set_sizes(1, self._a.size)

    def a(self) -> np.ndarray:
        """Returns the coefficients, shape `(n,)`."""
        return self._a.copy()

    def b(self) -> float:
        """Returns the constant."""
        return self._b

    def UpdateCoefficients(self, new_a: Any, new_b: float = 0.0) -> None:
        """Sets coefficients and constant.

        Raises:
            RuntimeError: the number of coefficients is another.
        """
        new_a = _arrays.float_vector(new_a)
        _same_count(new_a.size, self._num_vars)
        self._a, self._b = new_a, float(new_b)

    def update_coefficient_entry(self, i: int, val: float) -> None:
        """Sets one coefficient."""
        self._a[i] = val

    def update_constant_term(self, new_b: float) -> None:
        """Sets the constant."""
        self._b = float(new_b)

    def _eval(self, x: np.ndarray) -> np.ndarray:
        return np.array([self._a @ x + self._b])

    def _jacobian(self, x: np.ndarray) -> np.ndarray:
        return self._a.reshape(1, -1)

    def _eval_symbols(self, x: np.ndarray) -> np.ndarray:
        return _arrays.affine(self._a.reshape(1, -1), x, [self._b])

    def _latex(self, vars: np.ndarray, precision: int) -> str:
        return ToLatex(self._eval_symbols(_arrays.symbols(vars))[0], precision)


def _same_count(found: int, expected: int) -> None:
    if found != expected:
        raise RuntimeError("Can't change the number of decision variables")


class QuadraticCost(Cost):
    """1/2 x' Q x + b' x + c.

    Args:
        Q: Shape `(n, n)`; its symmetric part is kept.
        b: Shape `(n,)`.
        c: Constant.
        is_convex: Whether Q is positive semidefinite; found out if absent.
    """

    def __init__(self, Q: Any, b: Any, c: float = 0.0, is_convex: bool | None = None):
        self._Q, self._b, self._c = symmetric(Q), _arrays.float_vector(b), float(c)
        if self._Q.shape[0] != self._b.size:
            raise RuntimeError(f"QuadraticCost(): Q has {self._Q.shape[0]} rows but b has {self._b.size} elements.")
        self._is_convex = is_semidefinite(self._Q) if is_convex is None else bool(is_convex)
        self._set_sizes(1, self._b.size)

    def Q(self) -> np.ndarray:
        """Returns the Hessian, shape `(n, n)`."""
        return self._Q.copy()

    def b(self) -> np.ndarray:
        """Returns the linear coefficients, shape `(n,)`."""
        return self._b.copy()

    def c(self) -> float:
        """Returns the constant."""
        return self._c

    def is_convex(self) -> bool:
        """Tells whether Q is positive semidefinite."""
        return self._is_convex

    def UpdateCoefficients(self, new_Q: Any, new_b: Any, new_c: float = 0.0, is_convex: bool | None = None) -> None:
        """Sets all coefficients.

        Raises:
            RuntimeError: sizes are others.
        """
        Q, b = symmetric(new_Q), _arrays.float_vector(new_b)
        _same_count(Q.shape[0], self._num_vars)
        _same_count(b.size, self._num_vars)
        self._Q, self._b, self._c = Q, b, float(new_c)
        self._is_convex = is_semidefinite(Q) if is_convex is None else bool(is_convex)

    def UpdateHessianEntry(self, i: int, j: int, val: float, is_hessian_psd: bool | None = None) -> None:
        """Sets Q(i, j) and Q(j, i)."""
        self._Q = self._Q.copy()
        self._Q[i, j] = self._Q[j, i] = val
        self._is_convex = is_semidefinite(self._Q) if is_hessian_psd is None else bool(is_hessian_psd)

    def update_linear_coefficient_entry(self, i: int, val: float) -> None:
        """Sets b(i)."""
        self._b[i] = val

    def update_constant_term(self, new_c: float) -> None:
        """Sets the constant."""
        self._c = float(new_c)

    def _eval(self, x: np.ndarray) -> np.ndarray:
        return np.array([0.5 * (x @ (self._Q @ x)) + self._b @ x + self._c])

    def _jacobian(self, x: np.ndarray) -> np.ndarray:
        return (self._Q @ x + self._b).reshape(1, -1)

    def _eval_symbols(self, x: np.ndarray) -> np.ndarray:
        return quadratic_symbols(self._Q, self._b, self._c, x)

    def _latex(self, vars: np.ndarray, precision: int) -> str:
        return ToLatex(self._eval_symbols(_arrays.symbols(vars))[0], precision)


def quadratic_symbols(Q: np.ndarray, b: np.ndarray, c: float, x: np.ndarray) -> np.ndarray:
    """1/2 x' Q x + b' x + c as one expression, shape `(1,)`."""
    total = _arrays.affine(b.reshape(1, -1), x, [c])[0]
    half = _arrays.affine(0.5 * Q, x, np.zeros(len(x)))
    for xi, hi in zip(x, half):
        total = total + xi * hi
    out = np.empty(1, dtype=object)
    out[0] = total
    return out


class _NormCost(Cost):
    """A function of z = A x + b."""

    _A: Any
    _b: np.ndarray

    def __init__(self, A: Any, b: Any):
        self._A, self._b = _arrays.float_matrix(A), _arrays.float_vector(b)
        self._check()
        self._set_sizes(1, self._A.shape[1])

    def _check(self) -> None:
        if self._A.shape[0] != self._b.size:
            raise RuntimeError(f"{type(self).__name__}: A and b must have the same number of rows.")

    def b(self) -> np.ndarray:
        """Returns the constant of z = A x + b, shape `(m,)`."""
        return self._b.copy()

    def _update(self, new_A: Any, new_b: Any) -> None:
        A = _arrays.float_matrix(new_A)
        b = np.zeros(A.shape[0]) if new_b is None or np.size(new_b) == 0 else _arrays.float_vector(new_b)
        _same_count(A.shape[1], self._num_vars)
        if A.shape[0] != b.size:
            raise RuntimeError(f"{type(self).__name__}: new_A and new_b must have the same number of rows.")
        self._A, self._b = A, b

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

    def get_sparse_A(self) -> Any:
        """Returns the matrix of z = A x + b as a SciPy csc_matrix."""
        from scipy.sparse import csc_matrix

        return csc_matrix(self._A)

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


class PolynomialCost(ExpressionFunction, Cost):
    """A cost that is a polynomial of degree three or more."""

    def __init__(self, e: Any):
        self._set_expressions([_arrays.expression(e)])

    _display = EvaluatorBase._display
    _latex = EvaluatorBase._latex


class ExpressionCost(ExpressionFunction, Cost):
    """A cost that is an expression.

    Args:
        e: The expression; the cost is a function of its variables in the order of their creation.
    """

    def __init__(self, e: Any):
        self._set_expressions([_arrays.expression(e)])

    def expression(self) -> Expression:
        """Returns the expression."""
        return self._expressions[0]

    def _latex(self, vars: np.ndarray, precision: int) -> str:
        return ToLatex(self._eval_symbols(_arrays.symbols(vars))[0], precision)
