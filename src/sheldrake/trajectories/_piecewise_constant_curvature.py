"""A plane path of straight lines and circular arcs, along which a frame moves."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._kernels.generic import is_zero
from sheldrake.common._scalar_math import cos, sin
from sheldrake.common._scalars import any_array, is_symbolic
from sheldrake.math import RigidTransform_, RotationMatrix_, wrap_to
from sheldrake.trajectories._piecewise import PiecewiseTrajectory

if TYPE_CHECKING:
    from sheldrake.common._types import Scalar, Scalars
    from sheldrake.math import RigidTransform

_ORTHOGONAL = 128 * np.finfo(float).eps


class PiecewiseConstantCurvatureTrajectory(PiecewiseTrajectory):
    """A path through segments of constant curvature, in a plane that is posed anyhow in a frame A.

    What other trajectories call time is arclength here [m]. A frame M moves along the path: Mx is its tangent, Mz the
    normal of the plane. The value is the position of M's origin in A, shape `(3, 1)`. Outside of its ends the path
    goes on with the curvature of its first or last segment, or begins anew when it is periodic. pydrake's files may
    have such paths; its Python has no name for them, so that the names are those of Drake's C++.

    Args:
        breaks: Arclengths at the ends of the segments [m], the first 0; or another path, to copy to this scalar type.
        turning_rates: Of each segment, about the normal of the plane [1/m]; zero for a straight line.
        initial_curve_tangent: Tangent at the beginning, in A, of any length, shape (3,).
        plane_normal: Normal of the plane, in A, of any length, shape (3,).
        initial_position: Where the path begins, in A [m], shape (3,).
        is_periodic: Whether the path begins anew after its end.

    Raises:
        RuntimeError: the numbers of breaks and rates do not fit, the first break is not 0, breaks do not increase, or
            tangent and normal are zero or not perpendicular.
    """

    def __init__(
        self,
        breaks: Scalars | PiecewiseConstantCurvatureTrajectory = (),
        turning_rates: Scalars = (),
        initial_curve_tangent: Scalars = (1.0, 0.0, 0.0),
        plane_normal: Scalars = (0.0, 0.0, 1.0),
        initial_position: Scalars = (0.0, 0.0, 0.0),
        is_periodic: bool = False,
    ):
        if isinstance(breaks, PiecewiseConstantCurvatureTrajectory):
            of: Any = breaks
            arclengths, turning_rates, is_periodic = of._breaks, of._rates, of._periodic
            initial_curve_tangent, plane_normal, initial_position = of._tangent, of._normal, of._position
        else:
            arclengths = breaks
        PiecewiseTrajectory.__init__(self, arclengths)
        self._rates, self._periodic = self._scalars("", turning_rates), bool(is_periodic)
        self._tangent, self._normal, self._position = (
            any_array(self._T, np.asarray(a)).reshape(3)
            for a in (initial_curve_tangent, plane_normal, initial_position)
        )
        if not self._breaks and not self._rates:
            return
        self._check()
        unit_x, unit_z = (a / np.sqrt((a * a).sum()) for a in (self._tangent, self._normal))
        R = np.column_stack([unit_x, np.cross(unit_z, unit_x), unit_z])
        self._starts = [RigidTransform_[self._T](RotationMatrix_[self._T](R), self._position)]
        for i, rate in enumerate(self._rates):
            self._starts.append(self._starts[-1] @ self._along(rate, self._breaks[i + 1] - self._breaks[i]))

    def _check(self) -> None:
        if len(self._rates) != len(self._breaks) - 1:
            raise RuntimeError(
                f"{self._name('')}: there must be one turning rate for each segment, found {len(self._rates)} rates "
                f"and {len(self._breaks)} breaks."
            )
        if is_symbolic(self._T):
            return
        if self._breaks[0] != 0.0:
            raise RuntimeError(f"{self._name('')}: breaks are arclengths; the first must be 0, not {self._breaks[0]}.")
        for what, a in (("initial tangent", self._tangent), ("plane's normal", self._normal)):
            if not (a * a).sum() > 0.0:
                raise RuntimeError(f"{self._name('')}: the {what} is zero.")
        if abs((self._tangent * self._normal).sum()) > _ORTHOGONAL:
            raise RuntimeError(
                f"{self._name('')}: the initial tangent {self._tangent} must be perpendicular to the plane's normal "
                f"{self._normal}."
            )

    def _along(self, rate: Scalar, distance: Scalar) -> RigidTransform:
        """Where M is in what it was at the beginning of a segment."""
        angle = rate * distance
        if is_zero(rate):
            p = [distance, 0.0 * distance, 0.0 * distance]
        else:
            p = [sin(angle) / rate, (1.0 - cos(angle)) / rate, 0.0 * angle]
        return RigidTransform_[self._T](RotationMatrix_[self._T].MakeZRotation(angle), np.array(p))

    def _wrapped(self, call: str, s: Scalar) -> Scalar:
        s = self._scalar(call, s)
        return wrap_to(s, 0.0, self.length()) if self._periodic else s

    def length(self) -> float:
        """Returns the length of the path [m], of one period when it is periodic."""
        return self.end_time()

    def is_periodic(self) -> bool:
        """Tells whether the path begins anew after its end."""
        return self._periodic

    def CalcPose(self, s: Scalar) -> RigidTransform:
        """Returns X_AM at an arclength [m], a RigidTransform."""
        s = self._wrapped("CalcPose", s)
        i = self.get_segment_index(s)
        return self._starts[i] @ self._along(self._rates[self._segment(i)], s - self._breaks[i])

    def curvature(self, s: Scalar) -> float:
        """Returns the turning rate at an arclength [1/m]; its sign is the direction about the plane's normal."""
        return self._rates[self._segment(self.get_segment_index(self._wrapped("curvature", s)))]

    def EndpointsAreNearlyEqual(self, tolerance: float) -> bool:
        """Tells whether M ends where it began, up to a tolerance on each number of the pose."""
        return self._starts[0].IsNearlyEqualTo(self._starts[-1], tolerance)

    def do_value(self, t: Scalar) -> np.ndarray:
        """The position of M's origin as a column."""
        return np.asarray(self.CalcPose(t).translation()).reshape(3, 1)

    def do_rows(self) -> int:
        """Three."""
        return 3

    def do_cols(self) -> int:
        """One."""
        return 1

    def do_has_derivative(self) -> bool:
        """False, as in Drake: the turning rate jumps at the breaks."""
        return False
