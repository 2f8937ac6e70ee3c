"""Polynomials in one variable."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._names import pretty_class_name
from sheldrake.common._overloads import Mismatch
from sheldrake.common._scalars import any_array, as_scalar

if TYPE_CHECKING:
    from sheldrake.common._types import Scalar
    from sheldrake.symbolic._formula import Formula


def evaluate(coefficients: np.ndarray, x: Any, order: int = 0) -> np.ndarray:
    """Values of polynomials, or of their derivatives, by Horner's rule.

    Args:
        coefficients: Lowest power first along the last axis, shape `(..., n)`.
        x: Where.
        order: Order of the derivative.
    """
    n = coefficients.shape[-1]
    if order >= n:
        return coefficients[..., 0] * 0.0
    if n == 1:
        return coefficients[..., 0] * 1.0
    if order == 0:
        value = coefficients[..., n - 1] * x
        value += coefficients[..., n - 2]
        for power in range(n - 3, -1, -1):
            value *= x
            value += coefficients[..., power]
        return value
    value = coefficients[..., n - 1] * _falling(n - 1, order)
    for power in range(n - 2, order - 1, -1):
        value = value * x + coefficients[..., power] * _falling(power, order)
    return value


def _falling(power: int, order: int) -> float:
    """power * (power - 1) * ... , `order` factors: what differentiating a power brings down."""
    out = 1.0
    for i in range(order):
        out *= power - i
    return out


def differentiate(coefficients: np.ndarray, order: int) -> np.ndarray:
    """Coefficients of derivatives, shape `(..., max(n - order, 1))`."""
    n = coefficients.shape[-1]
    if order >= n:
        return coefficients[..., :1] * 0.0
    return coefficients[..., order:] * _all_falling(n, order)


@functools.cache
def _all_falling(n: int, order: int) -> np.ndarray:
    return np.array([_falling(power, order) for power in range(order, n)])


def integrate(coefficients: np.ndarray, constant: Scalar | np.ndarray) -> np.ndarray:
    """Coefficients of integrals that are `constant` at zero, shape `(..., n + 1)`."""
    n = coefficients.shape[-1]
    out = np.empty((*coefficients.shape[:-1], n + 1), dtype=coefficients.dtype)
    out[..., 0] = constant
    for power in range(n):
        out[..., power + 1] = coefficients[..., power] / (power + 1.0)
    return out


class Polynomial:
    """A polynomial in one variable, by its coefficients, lowest power first.

    Args:
        coefficients: Numbers, shape `(n,)`, or one number for a constant; zero if absent.
    """

    __slots__ = ("_c",)
    _c: np.ndarray
    __hash__ = None  # type: ignore[assignment]
    _T: ClassVar[type] = float
    _template: ClassVar[Any]

    def __init__(self, *args: Any, **kwargs: Any):
        given = [*args, *(kwargs[name] for name in ("coefficients",) if name in kwargs)]
        if len(given) > 1 or len(given) != len(args) + len(kwargs):
            raise self._refuse(given)
        c = self._coefficients(given[0]) if given else None
        if given and c is None:
            raise self._refuse(given)
        self._c = any_array(self._T, [0.0]) if c is None or c.size == 0 else c

    @classmethod
    def _coefficients(cls, given: object) -> np.ndarray | None:
        """The coefficients as an array of the scalar type; None for what cannot be coefficients."""
        try:
            c = any_array(cls._T, given)
        except Mismatch:
            return None
        if c.ndim == 0:
            return c.reshape(1)
        if c.ndim == 2 and c.shape[1] == 1:
            return c[:, 0]
        return c if c.ndim == 1 else None

    @classmethod
    def _refuse(cls, given: object) -> TypeError:
        return Mismatch(
            f"{pretty_class_name(cls)}(): incompatible constructor arguments; expected nothing, a number or "
            f"coefficients of shape (n,), got {given!r}."
        )

    @classmethod
    def _of(cls, coefficients: np.ndarray) -> Polynomial:
        out = object.__new__(cls)
        out._c = coefficients
        return out

    def GetCoefficients(self) -> np.ndarray:
        """Returns the coefficients, lowest power first, shape `(n,)`."""
        return self._c.copy()

    def GetDegree(self) -> int:
        """Returns the highest power, whether or not its coefficient is zero."""
        return self._c.size - 1

    def GetNumberOfCoefficients(self) -> int:
        """Returns the degree plus one."""
        return self._c.size

    def IsAffine(self) -> bool:
        """Tells whether the degree is at most one."""
        return self._c.size <= 2

    def EvaluateUnivariate(self, x: Any, derivative_order: int = 0) -> Any:
        """Returns the value, or that of a derivative, at x."""
        order = _order("EvaluateUnivariate", derivative_order)
        value = evaluate(self._c, self._scalar("EvaluateUnivariate", x), order)
        return float(value) if self._T is float else value

    @checked
    def Derivative(self, derivative_order: int = 1) -> Polynomial:
        """Returns the derivative of the given order as a polynomial."""
        return self._of(differentiate(self._c, _order("Derivative", derivative_order)))

    def Integral(self, integration_constant: Scalar = 0.0) -> Polynomial:
        """Returns the integral that has the given value at zero."""
        return self._of(integrate(self._c, self._scalar("Integral", integration_constant)))

    @checked
    def CoefficientsAlmostEqual(self, other: Polynomial, tol: float = 0.0, tol_type: Any = None) -> bool | Formula:
        """Tells whether all coefficients agree.

        Args:
            other: Another polynomial; coefficients it has not must be within `tol` of zero, and with
                `ToleranceType.kRelative` it must have all.
            tol: Largest difference; relative to the smaller coefficient with `ToleranceType.kRelative`.
            tol_type: `ToleranceType.kAbsolute` (the default) or `kRelative`.
        """
        from sheldrake.common._scalar_math import all_of
        from sheldrake.common._scalars import is_symbolic

        relative = tol_type is not None and tol_type.name == "kRelative"
        n = min(self._c.size, other._c.size)
        conditions: list[Any] = [False if relative else abs(c) <= tol for c in (*self._c[n:], *other._c[n:])]
        for a, b in zip(self._c[:n], other._c[:n]):
            difference = abs(a - b)
            if relative:
                a, b = abs(a), abs(b)
                smaller = a.min(b) if is_symbolic(self._T) else min(a, b)
                conditions.append(difference <= smaller * tol)
            else:
                conditions.append(difference <= tol)
        result = all_of(conditions)
        if is_symbolic(self._T) and isinstance(result, (bool, np.bool_)):
            from sheldrake.symbolic import Formula

            return Formula(bool(result))
        return result if is_symbolic(self._T) else bool(result)

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        a, b = _trimmed(self._c), _trimmed(other._c)
        return a.size == b.size and all(_same(x, y) for x, y in zip(a, b))

    def _operand(self, other: object) -> np.ndarray | None:
        if isinstance(other, type(self)._template[self._T]):
            return other._c
        try:
            return any_array(self._T, [as_scalar(self._T, other)])
        except Mismatch:
            return None

    def __add__(self, other: Polynomial | Scalar) -> Polynomial:
        c = self._operand(other)
        if c is None:
            return NotImplemented
        n = max(self._c.size, c.size)
        return self._of(_trimmed(_padded(self._c, n) + _padded(c, n)))

    def __sub__(self, other: Polynomial | Scalar) -> Polynomial:
        c = self._operand(other)
        if c is None:
            return NotImplemented
        n = max(self._c.size, c.size)
        return self._of(_trimmed(_padded(self._c, n) - _padded(c, n)))

    def __mul__(self, other: Polynomial | Scalar) -> Polynomial:
        c = self._operand(other)
        return NotImplemented if c is None else self._of(product(self._c, c))

    def __truediv__(self, other: Scalar) -> Polynomial:
        if isinstance(other, Polynomial):
            return NotImplemented
        c = self._operand(other)
        return NotImplemented if c is None else self._of(self._c / c[0])

    def __rsub__(self, other: Scalar) -> Polynomial:
        return -self + other

    def __neg__(self) -> Polynomial:
        return self._of(-self._c)

    __radd__, __rmul__ = __add__, __mul__

    def __copy__(self) -> Polynomial:
        return self._of(self._c.copy())

    def __deepcopy__(self, memo: dict) -> Polynomial:
        return self._of(self._c.copy())

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self._c,)

    def _scalar(self, call: str, x: Any) -> Any:
        try:
            return as_scalar(self._T, x)
        except Mismatch:
            raise Mismatch(
                f"{pretty_class_name(type(self))}.{call}(): incompatible function arguments; expected a number of type "
                f"{self._T.__name__}, got {x!r}."
            ) from None


def _order(call: str, order: int) -> int:
    if order < 0:
        raise RuntimeError(f"Polynomial.{call}(): the order of the derivative must not be negative, got {order}.")
    return int(order)


def product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Coefficients of the product of two polynomials."""
    out = np.zeros(a.size + b.size - 1, dtype=a.dtype)
    for i, x in enumerate(a):
        out[i : i + b.size] = out[i : i + b.size] + x * b
    return out


def _padded(c: np.ndarray, n: int) -> np.ndarray:
    if c.size == n:
        return c
    return np.concatenate([c, np.zeros(n - c.size, dtype=c.dtype) * c[0]])


def _is_zero(x: object) -> bool:
    return x.EqualTo(0.0) if hasattr(x, "EqualTo") else bool(x == 0.0)


def _same(x: object, y: object) -> bool:
    return x.EqualTo(y) if hasattr(x, "EqualTo") else bool(x == y)


def _trimmed(c: np.ndarray) -> np.ndarray:
    n = c.size
    while n > 1 and _is_zero(c[n - 1]):
        n -= 1
    return c[:n]
