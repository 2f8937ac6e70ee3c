"""Costs of known shape: linear, quadratic, norms, expressions.

What a program's costs are made of; `_program_costs` makes them of expressions and matrices.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._bound_calls import LARGEST, BoundCalls, room
from sheldrake.common._checked import checked
from sheldrake.solvers import _arrays
from sheldrake.solvers._functions.evaluators import Changes, Cost, EvaluatorBase
from sheldrake.solvers._functions.expressions import ExpressionFunction
from sheldrake.solvers._kernels.definite import have_factors
from sheldrake.symbolic import Expression, ToLatex

if TYPE_CHECKING:
    from numpy.typing import ArrayLike
    from typing_extensions import Self

    from sheldrake.common.kernel import Bound


_EXACT = 200  # rows up to which a kernel factors matrices
_NEARLY_EXACT = 4000  # rows up to which rounding of a factor is less than what `is_semidefinite` takes for rounding


def symmetric(Q: ArrayLike) -> np.ndarray:
    """The symmetric part of a square matrix.

    Raises:
        RuntimeError: it is not square.
    """
    return symmetric_part(_arrays.float_matrix(Q))


def symmetric_part(Q: _arrays.Matrix) -> np.ndarray:
    """The same of a matrix of floats."""
    if Q.shape[0] != Q.shape[1]:
        raise RuntimeError(f"The matrix of a quadratic form must be square, it is {Q.shape[0]} x {Q.shape[1]}.")
    # Bytes are compared faster than numbers are; a zero of the other sign is no other number, and stays one.
    return Q if isinstance(Q, np.ndarray) and Q.tobytes() == Q.T.tobytes() else (Q + Q.T) / 2.0


def range_of_eigenvalues(Q: np.ndarray) -> tuple[float, float, float]:
    """The least and the greatest eigenvalue, 0 of an empty matrix, and what of them may be rounding."""
    if Q.size == 0:
        return 0.0, 0.0, 0.0
    values = np.linalg.eigvalsh(Q)
    least, greatest = values.item(0), values.item(-1)
    return least, greatest, 1e-12 * max(1.0, -least, greatest)


def is_semidefinite(Q: np.ndarray) -> bool:
    """Whether Q has no negative eigenvalue, up to rounding."""
    if _EXACT < len(Q) <= _NEARLY_EXACT:
        try:
            np.linalg.cholesky(Q)
        except np.linalg.LinAlgError:
            pass  # it may be zero in some directions
        else:
            return True
    least, _, rounding = range_of_eigenvalues(Q)
    return least >= -rounding


def _have_factors(matrices: Sequence[np.ndarray | list[float]], rows: list[int]) -> list[int]:
    """Which matrices have no negative eigenvalue, found by elimination (see the kernel)."""
    count, numbers = len(rows), _arrays.joined_numbers(matrices)
    call, sizes, all_numbers, found = _calls.of(room(count), room(len(numbers)))
    sizes[:count], all_numbers[: len(numbers)] = rows, numbers
    call.set("count", count)
    call()
    return found[:count].tolist()


def _bound(count: int, numbers: int) -> tuple[Bound, np.ndarray, np.ndarray, np.ndarray]:
    """A bound call of `have_factors`; its sizes, numbers and answers."""
    (sizes, found), entries = np.zeros((2, count), dtype=np.int64), np.zeros(numbers)
    return have_factors.bind(0, sizes, entries, found), sizes, entries, found


_calls = BoundCalls(_bound, largest=LARGEST)


class LinearCost(Cost):
    """a' x + b.

    Args:
        a: Coefficients, shape `(n,)`.
        b: Constant.
    """

    def __init__(self, a: ArrayLike, b: float = 0.0):
        self._a, self._b = _arrays.float_vector(a), float(b)
        self._set_sizes(1, self._a.size)

    @classmethod
    def _of(cls, a: np.ndarray, b: float) -> Self:
        """The cost of an array that nobody else has."""
        self = cls.__new__(cls)
        self._a, self._b = a, b
        self._set_sizes(1, a.size)
        return self

    def a(self) -> np.ndarray:
        """Returns the coefficients, shape `(n,)`."""
        return self._a.copy()

    def b(self) -> float:
        """Returns the constant."""
        return self._b

    def UpdateCoefficients(self, new_a: ArrayLike, new_b: float = 0.0) -> None:
        """Sets coefficients and constant.

        Raises:
            RuntimeError: the number of coefficients is another.
        """
        new_a = _arrays.float_vector(new_a)
        same_count(new_a.size, self._num_vars)
        self._a, self._b = new_a, float(new_b)
        Changes.note()

    @checked
    def update_coefficient_entry(self, i: int, val: float) -> None:
        """Sets one coefficient."""
        self._a = self._a.copy()  # arrays never change in place: a kept form of the program knows them by identity
        self._a[i] = val
        Changes.note()

    def update_constant_term(self, new_b: float) -> None:
        """Sets the constant."""
        self._b = float(new_b)
        Changes.note()

    def _eval(self, x: np.ndarray) -> np.ndarray:
        return np.array([self._a.dot(x) + self._b])

    def _jacobian(self, x: np.ndarray) -> np.ndarray:
        return self._a.reshape(1, -1)

    def _eval_symbols(self, x: np.ndarray) -> np.ndarray:
        return _arrays.affine(self._a.reshape(1, -1), x, [self._b])

    def _latex(self, vars: np.ndarray, precision: int) -> str:
        return ToLatex(self._eval_symbols(_arrays.symbols(vars))[0], precision)


def same_count(found: int, expected: int) -> None:
    """Refuses new coefficients of another number of variables.

    Raises:
        RuntimeError: the numbers differ.
    """
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

    def __init__(self, Q: ArrayLike, b: ArrayLike, c: float = 0.0, is_convex: bool | None = None):
        self._set(symmetric(Q), _arrays.float_vector(b), float(c), is_convex)

    def _set(self, Q: np.ndarray, b: np.ndarray, c: float, is_convex: bool | None) -> None:
        self._Q, self._b, self._c = Q, b, c
        if self._Q.shape[0] != self._b.size:
            raise RuntimeError(f"QuadraticCost(): Q has {self._Q.shape[0]} rows but b has {self._b.size} elements.")
        self._is_convex = None if is_convex is None else bool(is_convex)
        self._set_sizes(1, self._b.size)

    @classmethod
    def _of(cls, Q: np.ndarray, b: np.ndarray, c: float, is_convex: bool | None) -> Self:
        """The cost of arrays that nobody else has, Q being symmetric."""
        self = cls.__new__(cls)
        self._set(Q, b, c, is_convex)
        return self

    _numbers: tuple[list[float], list[float]] | None = None
    """Q, row by row, and b of a small cost that was parsed, until one of them changes; arrays are made for who asks."""

    @classmethod
    def _of_numbers(cls, Q: list[float], b: list[float], c: float, is_convex: bool | None) -> Self:
        """The cost of numbers that nobody else has, Q, row by row, being symmetric."""
        self: Self = object.__new__(cls)
        self._numbers, self._c, self._is_convex = (Q, b), c, is_convex
        self._num_outputs, self._num_vars = 1, len(b)
        return self

    def __getattr__(self, name: str) -> Any:
        if self._numbers is None or name not in ("_Q", "_b"):
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        Q, b = self._numbers
        self._Q, self._b = np.array(Q).reshape(len(b), len(b)), np.array(b)
        return self.__dict__[name]

    def _leave_numbers(self) -> None:
        """Has the arrays be what counts from now on, before one of them changes."""
        if self._numbers is not None:
            self._Q, self._b = self._Q, self._b
            self._numbers = None

    @staticmethod
    def matrices(costs: Sequence[QuadraticCost]) -> tuple[list[np.ndarray | list[float]], list[int]]:
        """Their Q, as arrays or as numbers row by row, and how many rows these have."""
        found = [cost._Q if cost._numbers is None else cost._numbers[0] for cost in costs]
        return found, [cost._num_vars for cost in costs]

    @staticmethod
    def slopes(costs: Sequence[QuadraticCost]) -> list[np.ndarray | list[float]]:
        """Their b."""
        return [cost._b if cost._numbers is None else cost._numbers[1] for cost in costs]

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
        if self._is_convex is None:
            self._is_convex = is_semidefinite(self._Q)
        return self._is_convex

    @staticmethod
    def are_convex(costs: Sequence[QuadraticCost]) -> bool:
        """Tells whether all are; for many, as the eigenvalues of those of a size are found at once."""
        if all([cost._is_convex for cost in costs]):
            return True
        unknown = [cost for cost in costs if cost._is_convex is None and cost._num_vars <= _EXACT]
        for cost, found in zip(unknown, _have_factors(*QuadraticCost.matrices(unknown))):
            cost._is_convex = True if found else None  # eigenvalues tell of the others
        return all([cost.is_convex() for cost in costs])

    def UpdateCoefficients(
        self, new_Q: ArrayLike, new_b: ArrayLike, new_c: float = 0.0, is_convex: bool | None = None
    ) -> None:
        """Sets all coefficients.

        Raises:
            RuntimeError: sizes are others.
        """
        Q, b = _arrays.float_matrix(new_Q), _arrays.float_vector(new_b)
        same_count(b.size, self._num_vars)
        self._leave_numbers()
        is_same = is_convex is None and Q.shape == self._Q.shape and (Q == self._Q).all()
        if not is_same:  # else what was made of the matrix still fits
            same_count(Q.shape[0], self._num_vars)
            self._Q, self._is_convex = symmetric_part(Q), None if is_convex is None else bool(is_convex)
        self._b, self._c = b, float(new_c)
        Changes.note()

    @checked
    def UpdateHessianEntry(self, i: int, j: int, val: float, is_hessian_psd: bool | None = None) -> None:
        """Sets Q(i, j) and Q(j, i)."""
        self._leave_numbers()
        self._Q = self._Q.copy()
        self._Q[i, j] = self._Q[j, i] = val
        self._is_convex = None if is_hessian_psd is None else bool(is_hessian_psd)
        Changes.note()

    @checked
    def update_linear_coefficient_entry(self, i: int, val: float) -> None:
        """Sets b(i)."""
        self._leave_numbers()
        self._b = self._b.copy()
        self._b[i] = val
        Changes.note()

    def update_constant_term(self, new_c: float) -> None:
        """Sets the constant."""
        self._c = float(new_c)
        Changes.note()

    def _eval(self, x: np.ndarray) -> np.ndarray:
        return np.array([0.5 * x.dot(self._Q.dot(x)) + self._b.dot(x) + self._c])

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


class PolynomialCost(ExpressionFunction, Cost):
    """A cost that is a polynomial of degree three or more."""

    def __init__(self, e: Expression):
        self._set_expressions([_arrays.expression(e)])

    _display = EvaluatorBase._display
    _latex = EvaluatorBase._latex


class ExpressionCost(ExpressionFunction, Cost):
    """A cost that is an expression.

    Args:
        e: The expression; the cost is a function of its variables in the order of their creation.
    """

    def __init__(self, e: Expression):
        self._set_expressions([_arrays.expression(e)])

    def expression(self) -> Expression:
        """Returns the expression."""
        return self._own_expressions()[0]

    def _latex(self, vars: np.ndarray, precision: int) -> str:
        return ToLatex(self._eval_symbols(_arrays.symbols(vars))[0], precision)
