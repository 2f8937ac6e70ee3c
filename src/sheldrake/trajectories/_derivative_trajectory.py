"""Trajectories made of one other trajectory: its derivative, and itself passed through."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._names import pretty_class_name
from sheldrake.trajectories._base import Trajectory, _order, kept

if TYPE_CHECKING:
    from sheldrake.common._types import Scalar


def _expect_trajectories(owner: Any, given: Any) -> list:
    """The trajectories given.

    Raises:
        TypeError: one is none, or of another scalar type.
    """
    out = list(given)
    base = _template_of(owner)
    for t in out:
        if not isinstance(t, base):
            raise owner._mismatch("", pretty_class_name(base), t)
    return out


def _template_of(owner: Any) -> Any:
    return Trajectory._template[owner._T]


class _OneOther:
    """What has the shape and the times of one other trajectory, `_nominal`."""

    _nominal: Trajectory

    def do_rows(self) -> int:
        """The other's rows."""
        return self._nominal.rows()

    def do_cols(self) -> int:
        """The other's columns."""
        return self._nominal.cols()

    def do_start_time(self) -> float:
        """The other's first time."""
        return self._nominal.start_time()

    def do_end_time(self) -> float:
        """The other's last time."""
        return self._nominal.end_time()


class DerivativeTrajectory(_OneOther, Trajectory):
    """The derivative of another trajectory, computed by that one when asked.

    Args:
        nominal: The trajectory to differentiate.
        derivative_order: How often.

    Raises:
        RuntimeError: the trajectory has no derivatives, or the order is negative.
    """

    def __init__(self, nominal: Trajectory, derivative_order: int = 1):
        (nominal,) = _expect_trajectories(self, [nominal])
        self._order = _order("DerivativeTrajectory", derivative_order)
        if not nominal.has_derivative():
            raise RuntimeError(f"{self._name('')}: {type(nominal).__name__} has no derivatives.")
        self._nominal = kept(nominal)
        self._shape = nominal.EvalDerivative(nominal.start_time(), self._order).shape  # a pose's is 4 x 4, then 6 x 1

    def do_rows(self) -> int:
        """Rows of the derivative."""
        return self._shape[0]

    def do_cols(self) -> int:
        """Columns of the derivative."""
        return self._shape[1]

    def do_value(self, t: Scalar) -> np.ndarray:
        """The derivative at time t."""
        return self._nominal.EvalDerivative(t, self._order)

    def do_has_derivative(self) -> bool:
        """True."""
        return True

    def DoEvalDerivative(self, t: Scalar, derivative_order: int) -> np.ndarray:
        return self._nominal.EvalDerivative(t, self._order + derivative_order)

    def DoMakeDerivative(self, derivative_order: int) -> Trajectory:
        return type(self)(self._nominal, self._order + derivative_order)


class _WrappedTrajectory(_OneOther, Trajectory):
    """Another trajectory, passed through."""

    def __init__(self, trajectory: Trajectory):
        (self._nominal,) = _expect_trajectories(self, [trajectory])

    def unwrap(self) -> Trajectory:
        """Returns the other trajectory."""
        return self._nominal

    def do_value(self, t: Scalar) -> np.ndarray:
        """The other's value."""
        return self._nominal.value(t)

    def do_has_derivative(self) -> bool:
        """Whether the other has derivatives."""
        return self._nominal.has_derivative()

    def DoEvalDerivative(self, t: Scalar, derivative_order: int) -> np.ndarray:
        """The other's derivative."""
        return self._nominal.EvalDerivative(t, derivative_order)

    def DoMakeDerivative(self, derivative_order: int) -> Trajectory:
        """The other's derivative."""
        return self._nominal.MakeDerivative(derivative_order)

    def __repr__(self) -> str:
        return f"{pretty_class_name(type(self))}({self._nominal!r})"
