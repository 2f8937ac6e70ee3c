"""B-spline bases."""

from __future__ import annotations

import operator
from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any
from typing import overload as typing_overload

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._enums import BoundEnum
from sheldrake.common._kinds import LARGEST_COUNT
from sheldrake.common._names import pretty_class_name
from sheldrake.common._overloads import Mismatch, incompatible
from sheldrake.common._scalars import ScalarBase, ScalarTemplate, any_array, as_scalar

if TYPE_CHECKING:
    from sheldrake.common._types import Scalar, Scalars


def _number(x: Scalar) -> float:
    """Value of a float, an AutoDiffXd or an Expression without variables."""
    if isinstance(x, float):
        return x
    return x.value() if hasattr(x, "value") else x.Evaluate()


class KnotVectorType(BoundEnum):
    """Equally spaced knots all along, or with the end knots repeated so that curves reach their end points."""

    kUniform = 0
    kClampedUniform = 1


class BsplineBasis(ScalarBase):
    """The basis functions of B-splines of one order over one knot vector."""

    __slots__ = ("_knots", "_order")

    def __init__(self, *args: Any, **kwargs: Any):
        """
        `BsplineBasis()`, `BsplineBasis(order, knots)`, `BsplineBasis(order, num_basis_functions,
        type=KnotVectorType.kClampedUniform, initial_parameter_value=0, final_parameter_value=1)`,
        `BsplineBasis(other)`.

        Raises:
            ValueError: there are too few knots or basis functions for the order.
        """
        if not args and not kwargs:
            self._order, self._knots = 0, []
        elif (other := self._only_other(args, kwargs)) is not None:
            self._order, self._knots = other._order, other._knots
        elif (len(args) == 2 and not kwargs and np.ndim(args[1]) > 0) or "knots" in kwargs:
            self._checked(self._init_from_knots, args, kwargs)
        else:
            self._checked(self._init_uniform, args, kwargs)

    @classmethod
    def _of(cls, order: int, knots: list) -> BsplineBasis:
        """Of knots that are numbers of the scalar and enough, in a list of their own."""
        new = object.__new__(cls._plain_class())
        new._order, new._knots = order, knots
        return new

    def _only_other(self, args: tuple, kwargs: dict) -> Any:
        values = [*args, *kwargs.values()]
        only = len(values) == 1 and kwargs.keys() <= {"other"} and isinstance(values[0], self._plain_class())
        return values[0] if only else None

    def _checked(self, init: Any, args: tuple, kwargs: dict) -> None:
        try:
            init(*args, **kwargs)
        except (Mismatch, TypeError):
            accepted = [
                "()",
                "(order, knots)",
                "(order, num_basis_functions, type, initial_parameter_value, final_parameter_value)",
                "(other)",
            ]
            name = pretty_class_name(self._plain_class())
            raise incompatible(name, accepted, args, kwargs, constructor=True) from None

    def _init_from_knots(self, order: int, knots: Sequence[Any]) -> None:
        self._order = operator.index(order)
        self._knots = [as_scalar(self._T, knot) for knot in knots]
        if len(self._knots) < 2 * self._order:
            raise ValueError(
                f"The number of knots ({len(self._knots)}) should be greater than or equal to twice the order "
                f"({2 * self._order})."
            )

    def _init_uniform(
        self,
        order: int,
        num_basis_functions: int,
        type: KnotVectorType = KnotVectorType.kClampedUniform,
        initial_parameter_value: Scalar = 0.0,
        final_parameter_value: Scalar = 1.0,
    ) -> None:
        k, n = operator.index(order), operator.index(num_basis_functions)
        if not isinstance(type, KnotVectorType) or n > LARGEST_COUNT:
            raise Mismatch
        first, last = as_scalar(self._T, initial_parameter_value), as_scalar(self._T, final_parameter_value)
        if n < k:
            raise ValueError(f"The number of basis functions ({n}) should be greater than or equal to the order ({k}).")
        step = (last - first) / (n - k + 1.0)
        knots = [first + (i - (k - 1)) * step for i in range(n + k)]
        knots[n] = last
        if type is KnotVectorType.kClampedUniform:
            knots[:k] = [first] * k
            knots[n:] = [last] * k
        self._order, self._knots = k, knots

    def order(self) -> int:
        """Degree plus one."""
        return self._order

    def degree(self) -> int:
        """Degree of the polynomial pieces."""
        return self._order - 1

    def num_basis_functions(self) -> int:
        """How many basis functions, and so control points of a curve, there are."""
        return len(self._knots) - self._order

    def knots(self) -> list:
        """The knots, ascending."""
        return list(self._knots)

    def initial_parameter_value(self) -> float:
        """Where curves begin."""
        return self._knots[self._order - 1]

    def final_parameter_value(self) -> float:
        """Where curves end."""
        return self._knots[self.num_basis_functions()]

    def FindContainingInterval(self, parameter_value: Scalar) -> int:
        """Index i of the knots with knots[i] <= parameter_value < knots[i + 1]; the last interval includes its end."""
        u = _number(as_scalar(self._T, parameter_value))
        find = bisect_right if u < _number(self.final_parameter_value()) else bisect_left
        return find(self._knots if self._T is float else [_number(knot) for knot in self._knots], u) - 1

    @typing_overload
    @checked
    def ComputeActiveBasisFunctionIndices(self, parameter_value: Scalar) -> list[int]: ...
    @typing_overload
    @checked
    def ComputeActiveBasisFunctionIndices(self, parameter_interval: Scalars) -> list[int]: ...
    def ComputeActiveBasisFunctionIndices(self, *args: Any, **kwargs: Any) -> list[int]:
        """Which basis functions are not zero at `parameter_value`, or somewhere in `parameter_interval` [a, b]."""
        values = [*args, *kwargs.values()]
        if len(values) != 1 or not kwargs.keys() <= {"parameter_value", "parameter_interval"}:
            raise self._no_indices(args, kwargs)
        try:
            ends = any_array(self._T, values[0])
        except Mismatch:
            raise self._no_indices(args, kwargs) from None
        if ends.shape not in ((), (2,)):
            raise self._no_indices(args, kwargs)
        first, last = ends.reshape(-1)[[0, -1]].tolist()
        begin = self.FindContainingInterval(first) - self._order + 1
        return list(range(begin, self.FindContainingInterval(last) + 1))

    def _no_indices(self, args: tuple, kwargs: dict) -> TypeError:
        where = f"{pretty_class_name(self._plain_class())}.ComputeActiveBasisFunctionIndices"
        return incompatible(where, ["(parameter_value)", "(parameter_interval: [a, b])"], args, kwargs)

    def _check_parameter(self, call: str, u: Scalar) -> None:
        first, last = _number(self.initial_parameter_value()), _number(self.final_parameter_value())
        if not first <= _number(u) <= last:
            raise RuntimeError(f"BsplineBasis.{call}(): parameter value {u} is not within [{first}, {last}].")

    @checked
    def EvaluateCurve(self, control_points: Sequence[Any], parameter_value: Scalar) -> np.ndarray:
        """The point of a curve, of the shape of a control point.

        Args:
            control_points: As many as there are basis functions.
            parameter_value: Within the initial and final one.

        Raises:
            RuntimeError: the number of points or the parameter is not so.
        """
        u = as_scalar(self._T, parameter_value)
        if len(control_points) != self.num_basis_functions():
            raise RuntimeError(
                f"BsplineBasis.EvaluateCurve(): {len(control_points)} control points for "
                f"{self.num_basis_functions()} basis functions."
            )
        self._check_parameter("EvaluateCurve", u)
        try:
            points = [any_array(self._T, point) for point in control_points]
        except Mismatch:
            raise self._no_curve(control_points, parameter_value) from None
        if any(point.ndim == 0 for point in points):
            raise self._no_curve(control_points, parameter_value)
        return self._de_boor(points, u)

    def _no_curve(self, control_points: Scalars, parameter_value: Scalar) -> TypeError:
        where = f"{pretty_class_name(self._plain_class())}.EvaluateCurve"
        return incompatible(where, ["(control_points: list of vectors, parameter_value)"], (control_points,), {})

    def _de_boor(self, points: list, u: Scalar) -> Any:
        """De Boor's algorithm (C. de Boor, A Practical Guide to Splines, chapter X)."""
        k, t = self._order, self._knots
        ell = self.FindContainingInterval(u)
        p = [points[i] for i in range(ell, ell - k, -1)]
        for j in range(1, k):
            for i in range(k - j):
                top = ell - i
                a = (u - t[top]) / (t[top + k - j] - t[top])
                p[i] = (1.0 - a) * p[i + 1] + a * p[i]
        return p[0]

    def EvaluateBasisFunctionI(self, i: int, parameter_value: Scalar) -> Scalar:
        """Value of basis function `i`."""
        i = operator.index(i)
        u = as_scalar(self._T, parameter_value)
        self._check_parameter("EvaluateBasisFunctionI", u)
        first, values = self._active_values(u)
        return values[i - first] if first <= i < first + len(values) else self._T(0.0)

    def EvaluateLinearInControlPoints(self, parameter_value: Scalar) -> np.ndarray:
        """Values of all basis functions: the weights of the control points, shape (num_basis_functions,)."""
        u = as_scalar(self._T, parameter_value)
        self._check_parameter("EvaluateLinearInControlPoints", u)
        return self._weights(u)

    def _weights(self, u: Scalar) -> np.ndarray:
        n = self.num_basis_functions()
        weights = np.zeros(n) if self._T is float else any_array(self._T, np.zeros(n))
        first, values = self._active_values(u)
        weights[first : first + len(values)] = values
        return weights

    def _active_values(self, u: Scalar) -> tuple[int, list]:
        """The first basis function that is not zero at u, and the values of those that are not (Cox 1972)."""
        ell, t = self.FindContainingInterval(u), self._knots
        values: list[Any] = [self._T(1.0)]
        for degree in range(1, self._order):
            carried: Any = self._T(0.0)
            raised = []
            for r, value in enumerate(values):
                right, left = t[ell + r + 1], t[ell + r + 1 - degree]
                share = value / (right - left)
                raised.append(carried + (right - u) * share)
                carried = (u - left) * share
            values = [*raised, carried]
        return ell - self._order + 1, values

    def __copy__(self) -> BsplineBasis:
        return self._plain_class()(self)

    def __getstate__(self) -> tuple[Any, ...]:
        return (self._order, list(self._knots))

    def __setstate__(self, state: tuple[Any, ...]) -> None:
        self._order, self._knots = state[0], list(state[1])


BsplineBasis_ = ScalarTemplate("BsplineBasis_", BsplineBasis, scope="sheldrake.math")
__all__ = ["BsplineBasis", "BsplineBasis_", "KnotVectorType"]
