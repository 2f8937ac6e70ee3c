"""Constraints of known shape: linear, quadratic, complementarity, expressions."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common import quick
from sheldrake.common._checked import checked
from sheldrake.common._enums import BoundEnum
from sheldrake.common._overloads import overload, overloaded
from sheldrake.common._text import number
from sheldrake.solvers import _arrays
from sheldrake.solvers._functions import evaluators
from sheldrake.solvers._functions.costs import quadratic_symbols, range_of_eigenvalues, symmetric
from sheldrake.solvers._functions.evaluators import Changes, Constraint
from sheldrake.solvers._functions.expressions import ExpressionFunction
from sheldrake.solvers._kernels import inside as kernels
from sheldrake.solvers._text import latex_bounds, latex_matrix
from sheldrake.symbolic import Expression, Formula, logical_and

if TYPE_CHECKING:
    import scipy.sparse
    from numpy.typing import ArrayLike
    from typing_extensions import Self

    from sheldrake.solvers._arrays import Matrix


def _bounds(lb: ArrayLike, ub: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    return _bound(lb), _bound(ub)


def _bound(b: ArrayLike) -> np.ndarray:
    return _arrays.float_vector(b if type(b) is np.ndarray and b.ndim else np.atleast_1d(b))


def _not_finite(cls: type) -> RuntimeError:
    return RuntimeError(f"{cls.__name__}: A has entries that are not finite.")


@checked
class LinearConstraint(Constraint):
    """lb <= A x <= ub.

    Args:
        A: Shape `(m, n)`, dense or sparse.
        lb: Shape `(m,)`.
        ub: Shape `(m,)`.
    """

    _A: Any
    _dense: np.ndarray | None
    _row: tuple[list[float], float, float] | None = None
    """Entries and bounds of a row that was parsed, until one of them changes; its arrays are made for who asks."""

    def __init__(self, A: ArrayLike | Matrix, lb: ArrayLike, ub: ArrayLike):
        self._set_linear(_arrays.float_matrix(A), *_bounds(lb, ub))

    @classmethod
    def _of(cls, A: Matrix, lb: np.ndarray, ub: np.ndarray) -> Self:
        """The constraint of arrays that nobody else has."""
        self = cls.__new__(cls)
        self._set_linear(A, lb, ub)
        return self

    @classmethod
    def _of_row(cls, a: list[float], low: float, high: float) -> Self:
        """The constraint of one row that nobody else has.

        Raises:
            RuntimeError: an entry is not finite.
        """
        if not all(map(math.isfinite, a)):
            raise _not_finite(cls)
        self = object.__new__(cls)
        self._row = a, low, high
        self._num_outputs, self._num_vars = 1, len(a)
        return self

    def __getattr__(self, name: str) -> Any:
        if self._row is None or name not in _ARRAYS_OF_ROWS:
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        self._make_arrays(*self._row)
        return self.__dict__[name]

    def _make_arrays(self, a: list[float], low: float, high: float) -> None:
        self._A = self._dense = np.array([a])
        self._lower, self._upper = np.array([low]), np.array([high])

    def _leave_row(self) -> None:
        """Has the arrays be what counts from now on, before one of them changes."""
        if self._row is not None:
            self._make_arrays(*self._row)
            self._row = None

    def _set_linear(self, A: Matrix, lb: np.ndarray, ub: np.ndarray) -> None:
        if A.shape[0] != lb.size or A.shape[0] != ub.size:
            raise ValueError(
                f"{type(self).__name__}: A has {A.shape[0]} rows, but the bounds have {lb.size} and {ub.size}."
            )
        self._row = None
        self._A, self._dense = A, A if isinstance(A, np.ndarray) else None
        values: Any = A.data if self._dense is None else A
        # The sum of squares is one pass over them; where it is not finite, it may have overflowed.
        if not math.isfinite(np.vdot(values, values)) and not np.isfinite(values).all():
            raise _not_finite(type(self))
        self._set_sizes(A.shape[0], A.shape[1], self._description)
        self._own_bounds(lb, ub)

    def GetDenseA(self) -> np.ndarray:
        """Returns the matrix, shape `(m, n)`."""
        if self._dense is None:
            self._dense = self._A.toarray()
        return self._dense.copy()

    def get_sparse_A(self) -> scipy.sparse.csc_matrix:
        """Returns the matrix as a SciPy csc_matrix."""
        from scipy.sparse import csc_matrix

        return csc_matrix(self._A)

    def is_dense_A_constructed(self) -> bool:
        """Tells whether the matrix is there as a dense one."""
        return self._dense is not None

    def UpdateCoefficients(
        self, new_A: ArrayLike | scipy.sparse.spmatrix, new_lb: ArrayLike, new_ub: ArrayLike
    ) -> None:
        """Sets matrix and bounds; the number of rows may change.

        Raises:
            RuntimeError: the number of variables is another, or rows differ.
        """
        self._update(_arrays.float_matrix(new_A), *_bounds(new_lb, new_ub))

    def _update(self, A: Matrix, lb: np.ndarray, ub: np.ndarray) -> None:
        """`UpdateCoefficients` with arrays that nobody else has."""
        if A.shape[1] != self._num_vars:
            raise RuntimeError("Can't change the number of decision variables")
        if lb.size != A.shape[0] or ub.size != A.shape[0]:
            raise RuntimeError("New constraints have invalid dimensions")
        B = self._A
        if B.__class__ is A.__class__ is np.ndarray and A.shape == B.shape and A.tobytes() == B.tobytes():
            A = B  # what was made of the matrix still fits
        self._set_linear(A, lb, ub)

    def RemoveTinyCoefficient(self, tol: float) -> None:
        """Sets coefficients of at most this size to zero.

        Raises:
            ValueError: the tolerance is negative.
        """
        if tol < 0.0:
            raise ValueError("RemoveTinyCoefficient: tol should be non-negative")
        self._leave_row()
        A = self._A.toarray() if _arrays.is_sparse(self._A) else self._A.copy()
        A[np.abs(A) <= tol] = 0.0
        self._A = self._dense = A
        Changes.note()

    def set_bounds(self, new_lb: ArrayLike, new_ub: ArrayLike) -> None:
        """Sets both bounds."""
        lower, upper = _bounds(new_lb, new_ub)
        self._leave_row()
        self._own_bounds(lower, upper)

    def UpdateLowerBound(self, new_lb: ArrayLike) -> None:
        """Sets the lower bound."""
        lower = _bound(new_lb)
        self._leave_row()
        self._own_bounds(lower, self._upper)

    def UpdateUpperBound(self, new_ub: ArrayLike) -> None:
        """Sets the upper bound."""
        upper = _bound(new_ub)
        self._leave_row()
        self._own_bounds(self._lower, upper)

    def CheckSatisfied(self, x: ArrayLike, tol: float = 1e-6) -> bool | Formula:
        """Tells whether the values at x are within the bounds, up to `tol`; a Formula where x is symbolic."""
        if (dense := self._dense) is not None:
            if (inside := _inside_rows(dense.ravel(), self._lower, self._upper, x, tol)) is not None:
                return inside
        return super().CheckSatisfied(x, tol)

    def _eval(self, x: np.ndarray) -> np.ndarray:
        return np.asarray(self._A.dot(x))

    def _jacobian(self, x: np.ndarray) -> np.ndarray:
        return self._A.toarray() if self._dense is None else self._dense

    def _eval_symbols(self, x: np.ndarray) -> np.ndarray:
        return _arrays.affine(self._A, x, np.zeros(self._num_outputs))

    def _latex(self, vars: np.ndarray, precision: int) -> str:
        return latex_bounds(self._latex_product(vars, precision), self._lower, self._upper, precision)

    def _latex_product(self, vars: np.ndarray, precision: int) -> str:
        if self._num_outputs == 1:
            return latex_matrix(self._eval_symbols(_arrays.symbols(vars)), precision)
        return f"{latex_matrix(self._jacobian(vars), precision)} {latex_matrix(vars, precision)}"


_ARRAYS_OF_ROWS = {"_A", "_dense", "_lower", "_upper"}
_ONE = [1.0]
_VECTOR = quick.ANY
_inside_rows = quick.short_way(
    globals(), "_inside_rows", kernels.inside_rows, _VECTOR, _VECTOR, _VECTOR, _VECTOR, float, gives=bool
)


@checked
class LinearEqualityConstraint(LinearConstraint):
    """Aeq x = beq.

    Args:
        Aeq: Shape `(m, n)`, dense or sparse; or one row, shape `(n,)`, with a number for `beq`.
        beq: Shape `(m,)`.
    """

    @overloaded(
        overload(Aeq=_arrays.float_matrix, beq=_arrays.float_vector),
        overload(lambda self, a, beq: self.__init__(a, [beq]), a=_arrays.float_row, beq=_arrays.number),
    )
    def __init__(self, Aeq: ArrayLike | scipy.sparse.spmatrix, beq: np.ndarray):
        self._set_linear(Aeq, beq, beq)

    def UpdateCoefficients(self, Aeq: ArrayLike | scipy.sparse.spmatrix, beq: ArrayLike) -> None:  # type: ignore[override]
        """Sets matrix and right hand side."""
        b = _bound(beq)
        self._update(_arrays.float_matrix(Aeq), b, b)

    def _display(self, vars: np.ndarray) -> str:
        named = f" described as '{self._description}'" if self._description else ""
        y = self._eval_symbols(_arrays.symbols(vars))
        rows = [f"{type(self).__name__}{named}", *(f"{e} == {number(b)}" for e, b in zip(y, self._lower))]
        return "\n".join(rows) + "\n"


@checked
class BoundingBoxConstraint(LinearConstraint):
    """lb <= x <= ub.

    Args:
        lb: Shape `(n,)`.
        ub: Shape `(n,)`.
    """

    def __init__(self, lb: ArrayLike, ub: ArrayLike):
        self._set_box(*_bounds(lb, ub))

    @classmethod
    def _of(cls, lb: np.ndarray, ub: np.ndarray) -> Self:  # type: ignore[override]
        self = cls.__new__(cls)
        self._set_box(lb, ub)
        return self

    def _set_box(self, lower: np.ndarray, upper: np.ndarray) -> None:
        self._dense = None
        self._set_sizes(lower.size, lower.size)
        self._own_bounds(lower, upper)

    @classmethod
    def _of_variable(cls, low: float, high: float) -> Self:
        """The bounds of one variable."""
        self = object.__new__(cls)
        self._row = _ONE, low, high
        self._num_outputs = self._num_vars = 1
        return self

    def _make_arrays(self, a: list[float], low: float, high: float) -> None:
        self._dense = None
        self._lower, self._upper = np.array([low]), np.array([high])

    @property
    def _A(self) -> np.ndarray:  # type: ignore[override]
        return np.eye(self._num_vars)

    def GetDenseA(self) -> np.ndarray:
        """Returns the identity, shape `(n, n)`."""
        self._dense = np.eye(self._num_vars)
        return self._dense.copy()

    def UpdateCoefficients(
        self, new_A: ArrayLike | scipy.sparse.spmatrix, new_lb: ArrayLike, new_ub: ArrayLike
    ) -> None:
        """Sets the bounds; the matrix is the identity and stays so.

        Raises:
            RuntimeError: the matrix is another.
        """
        A: Any = _arrays.float_matrix(new_A)
        A = A.toarray() if _arrays.is_sparse(A) else A
        if not np.array_equal(A, np.eye(self._num_vars)):
            raise RuntimeError(
                f"BoundingBoxConstraint.UpdateCoefficients(): the matrix of bounds of {self._num_vars} variables is "
                "the identity; use a LinearConstraint for another."
            )
        self.set_bounds(new_lb, new_ub)

    def RemoveTinyCoefficient(self, tol: float) -> None:
        """Does nothing: the coefficients are ones.

        Raises:
            RuntimeError: the tolerance is negative, or not less than one.
        """
        if not 0.0 <= tol < 1.0:
            raise RuntimeError(f"BoundingBoxConstraint.RemoveTinyCoefficient(): tol is {tol}, not from 0 to below 1.")

    def CheckSatisfied(self, x: ArrayLike, tol: float = 1e-6) -> bool | Formula:
        """Tells whether x is within the bounds, up to `tol`; a Formula where x is symbolic."""
        if (inside := evaluators.inside_box(self._lower, self._upper, x, tol)) is not None:
            return inside
        return Constraint.CheckSatisfied(self, x, tol)

    def _eval(self, x: np.ndarray) -> np.ndarray:
        return x.copy()

    def _jacobian(self, x: np.ndarray) -> np.ndarray:
        return np.eye(len(x))

    def _eval_symbols(self, x: np.ndarray) -> np.ndarray:
        return x.copy()

    def _latex_product(self, vars: np.ndarray, precision: int) -> str:
        return latex_matrix(vars, precision)


@checked
class QuadraticConstraint(Constraint):
    """lb <= 1/2 x' Q x + b' x <= ub.

    Args:
        Q0: Shape `(n, n)`; its symmetric part is kept.
        b: Shape `(n,)`.
        lb: Least value.
        ub: Greatest value.
        hessian_type: Signs of the eigenvalues of Q; found out if absent.
    """

    class HessianType(BoundEnum):
        """Signs of the eigenvalues of the matrix of a quadratic constraint."""

        kPositiveSemidefinite = 0
        kNegativeSemidefinite = 1
        kIndefinite = 2
        kZero = 3

    def __init__(self, Q0: ArrayLike, b: ArrayLike, lb: float, ub: float, hessian_type: HessianType | None = None):
        self._set_coefficients(symmetric(Q0), _arrays.float_vector(b), hessian_type)
        self._set_sizes(1, self._b.size)
        self._set_bounds(*_bounds(lb, ub))

    @classmethod
    def _of(cls, Q: np.ndarray, b: np.ndarray, lb: float, ub: float) -> Self:
        """The constraint of arrays that nobody else has, Q being symmetric; its bounds are numbers."""
        self = cls.__new__(cls)
        self._set_coefficients(Q, b, None)
        self._set_sizes(1, b.size)
        self._lower, self._upper = np.array([lb]), np.array([ub])
        return self

    def _set_coefficients(self, Q: np.ndarray, b: np.ndarray, hessian_type: HessianType | None) -> None:
        if Q.shape[0] != b.size:
            raise RuntimeError(f"QuadraticConstraint: Q has {Q.shape[0]} rows but b has {b.size} elements.")
        self._Q, self._b, self._given_type = Q, b, hessian_type

    def Q(self) -> np.ndarray:
        """Returns the Hessian, shape `(n, n)`."""
        return self._Q.copy()

    def b(self) -> np.ndarray:
        """Returns the linear coefficients, shape `(n,)`."""
        return self._b.copy()

    def hessian_type(self) -> HessianType:
        """Returns the signs of the eigenvalues of Q."""
        if self._given_type is None:
            self._given_type = _hessian_type(self._Q)
        return self._given_type

    def is_convex(self) -> bool:
        """Tells whether the points that satisfy it are a convex set."""
        kind = self.hessian_type()
        if kind is self.HessianType.kZero:
            return True
        if kind is self.HessianType.kPositiveSemidefinite:
            return bool(np.isneginf(self._lower[0]))
        return kind is self.HessianType.kNegativeSemidefinite and bool(np.isposinf(self._upper[0]))

    def UpdateCoefficients(self, new_Q: ArrayLike, new_b: ArrayLike, hessian_type: HessianType | None = None) -> None:
        """Sets the coefficients.

        Raises:
            RuntimeError: the number of variables is another.
        """
        Q, b = symmetric(new_Q), _arrays.float_vector(new_b)
        if Q.shape[0] != self._num_vars or b.size != self._num_vars:
            raise RuntimeError("Can't change the number of decision variables")
        self._set_coefficients(Q, b, hessian_type)

    def _eval(self, x: np.ndarray) -> np.ndarray:
        return np.array([0.5 * x.dot(self._Q.dot(x)) + self._b.dot(x)])

    def _jacobian(self, x: np.ndarray) -> np.ndarray:
        return (self._Q @ x + self._b).reshape(1, -1)

    def _eval_symbols(self, x: np.ndarray) -> np.ndarray:
        return quadratic_symbols(self._Q, self._b, 0.0, x)

    def _latex(self, vars: np.ndarray, precision: int) -> str:
        column = latex_matrix(vars, precision)
        text = f"{column}^T {latex_matrix(0.5 * self._Q, precision)} {column}"
        if self._b.any():
            linear = _arrays.affine(self._b.reshape(1, -1), _arrays.symbols(vars), [0.0])
            text += f" + {latex_matrix(linear, precision)}"
        return latex_bounds(text, self._lower, self._upper, precision)


def _hessian_type(Q: np.ndarray) -> QuadraticConstraint.HessianType:
    types = QuadraticConstraint.HessianType
    if not Q.any():
        return types.kZero
    least, greatest, rounding = range_of_eigenvalues(Q)
    if least >= -rounding:
        return types.kPositiveSemidefinite
    return types.kNegativeSemidefinite if greatest <= rounding else types.kIndefinite


class LinearComplementarityConstraint(Constraint):
    """x >= 0, M x + q >= 0, x' (M x + q) = 0. Its values are M x + q."""

    _M: Matrix
    _q: np.ndarray

    @classmethod
    def _make(cls, M: ArrayLike, q: ArrayLike) -> LinearComplementarityConstraint:
        self = cls.__new__(cls)
        self._M, self._q = _arrays.float_matrix(M), _arrays.float_vector(q)
        n = self._q.size
        if self._M.shape != (n, n):
            raise RuntimeError(f"LinearComplementarityConstraint: M is {self._M.shape}, but q has {n} elements.")
        self._set_sizes(n, n)
        self._set_bounds(np.full(n, -np.inf), np.full(n, np.inf))
        return self

    def M(self) -> np.ndarray:
        """Returns the matrix, shape `(n, n)`."""
        return self._M.copy()

    def q(self) -> np.ndarray:
        """Returns the constant, shape `(n,)`."""
        return self._q.copy()

    def _eval(self, x: np.ndarray) -> np.ndarray:
        return self._M @ x + self._q

    def _jacobian(self, x: np.ndarray) -> np.ndarray:
        return self._M

    def _eval_symbols(self, x: np.ndarray) -> np.ndarray:
        return _arrays.affine(self._M, x, self._q)

    def _is_satisfied(self, x: np.ndarray, tol: float) -> bool:
        y = self._eval(x)
        return bool(np.all(x >= -tol) and np.all(y >= -tol) and abs(x @ y) < tol)

    def _formula(self, x: np.ndarray) -> Formula:
        y = self._eval_symbols(x)
        product = x[0] * y[0]
        for a, b in zip(x[1:], y[1:]):
            product = product + a * b
        return logical_and(*(e >= 0 for e in x), *(e >= 0 for e in y), product == 0)

    def _display(self, vars: np.ndarray) -> str:
        return _without_rows(self, vars)

    def _latex(self, vars: np.ndarray, precision: int) -> str:
        z, y = latex_matrix(vars, precision), latex_matrix(self._eval_symbols(_arrays.symbols(vars)), precision)
        return rf"0 \le {z} \perp {y} \ge 0"


def _without_rows(self: Constraint, vars: np.ndarray) -> str:
    from sheldrake.solvers._functions.evaluators import EvaluatorBase

    return EvaluatorBase._display(self, vars)


class ExpressionConstraint(ExpressionFunction, Constraint):
    """lb <= v <= ub for expressions v.

    Args:
        v: Expressions, shape `(m,)`.
        lb: Shape `(m,)`.
        ub: Shape `(m,)`.
    """

    @checked
    def __init__(self, v: Any, lb: ArrayLike, ub: ArrayLike):
        self._set_expressions(list(_arrays.expression_array(v).ravel(order="F")))
        self._set_bounds(*_bounds(lb, ub))

    @classmethod
    def _of(cls, expressions: list[Expression], lower: np.ndarray, upper: np.ndarray) -> Self:
        out = cls.__new__(cls)
        out._set_expressions(expressions)
        out._set_bounds(lower, upper)
        return out

    def expressions(self) -> np.ndarray:
        """Returns the expressions, shape `(m,)`."""
        return _arrays.symbols(np.array(self._own_expressions(), dtype=object))
