"""A joint along a plane path of straight lines and circular arcs; see `_joint` for what a joint is."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sheldrake.common._overloads import Mismatch
from sheldrake.math import RigidTransform
from sheldrake.multibody.tree._element import distributions, scalar_of
from sheldrake.multibody.tree._frame import Frame, pose_numbers
from sheldrake.multibody.tree._joints_axis import OneVelocityJoint
from sheldrake.trajectories import PiecewiseConstantCurvatureTrajectory, PiecewiseConstantCurvatureTrajectory_

if TYPE_CHECKING:
    from sheldrake.common._types import Scalar, Scalars
    from sheldrake.multibody.tree._multibody_forces import MultibodyForces
    from sheldrake.systems.framework import Context


class CurvilinearJoint(OneVelocityJoint):
    """Moves M along a path in F; Mx is the tangent of the path, Mz the normal of its plane.

    The position is the distance along the path [m], the velocity the speed along it [m/s]. pydrake reads such joints
    from files, but has no class of this name; it is that of Drake's C++.
    """

    kTypeName = "curvilinear"

    def __init__(
        self,
        name: str,
        frame_on_parent: Frame,
        frame_on_child: Frame,
        curvilinear_path: PiecewiseConstantCurvatureTrajectory,
        *args: float,
        pos_lower_limit: float | None = None,
        pos_upper_limit: float | None = None,
        damping: float | None = None,
    ):
        """
        Args:
            name: Its name.
            frame_on_parent: F.
            frame_on_child: M.
            curvilinear_path: X_FM over the distance.
            args: `damping`, or `pos_lower_limit, pos_upper_limit[, damping]`.
            pos_lower_limit: Lower limit of the distance [m]; 0 when left out, none when the path is periodic.
            pos_upper_limit: Upper limit of the distance [m]; the path's length when left out, likewise.
            damping: Viscous damping along the path [N s/m].
        """
        if not isinstance(curvilinear_path, PiecewiseConstantCurvatureTrajectory) or len(args) > 3:
            raise Mismatch(
                "CurvilinearJoint(): incompatible constructor arguments. Takes (name, frame_on_parent, frame_on_child, "
                "curvilinear_path: PiecewiseConstantCurvatureTrajectory, damping: float = 0) or (..., curvilinear_path,"
                f" pos_lower_limit: float, pos_upper_limit: float, damping: float = 0), found {curvilinear_path!r}."
            )
        names = ("damping",) if len(args) == 1 else ("lower", "upper", "damping")
        given = dict(lower=pos_lower_limit, upper=pos_upper_limit, damping=damping) | dict(zip(names, args))
        super().__init__(name, frame_on_parent, frame_on_child, [given["damping"] or 0.0])
        periodic = curvilinear_path.is_periodic()
        lower, upper = (-np.inf, np.inf) if periodic else (0.0, curvilinear_path.length())
        lower = lower if given["lower"] is None else given["lower"]
        upper = upper if given["upper"] is None else given["upper"]
        self._path = PiecewiseConstantCurvatureTrajectory(curvilinear_path)
        self._set_limits("position", [lower], [upper])

    def get_trajectory(self) -> PiecewiseConstantCurvatureTrajectory:
        """The path."""
        return self._path

    def _constants(self) -> tuple[float, ...]:
        return tuple(pose_numbers(self._path._starts[0]))

    def _path_pieces(self) -> list[tuple[float, ...]]:
        path = self._path
        period = path.length() if path.is_periodic() else 0.0
        pieces: list[tuple[float, ...]] = []
        x = y = angle = 0.0
        for i, rate in enumerate(path._rates):
            c, s, length = np.cos(angle), np.sin(angle), path.duration(i)
            pieces.append((path.start_time(i), rate, x, y, c, s, period))
            ahead, aside = path._along(rate, length).translation()[:2]
            x, y, angle = x + c * ahead - s * aside, y + s * ahead + c * aside, angle + rate * length
        return pieces

    def _pose_at(self, q: np.ndarray) -> RigidTransform:
        return PiecewiseConstantCurvatureTrajectory_[scalar_of(q)](self._path).CalcPose(q[0])

    def get_distance(self, context: Context) -> float:
        """The distance along the path [m]."""
        return self._q(context, "get_distance").item(0)

    def set_distance(self, context: Context, distance: float) -> CurvilinearJoint:
        """Sets the distance along the path [m]."""
        return self._write_one_q(context, "set_distance", distance)

    def get_tangential_velocity(self, context: Context) -> float:
        """The speed along the path [m/s]."""
        return self._velocities(context, "get_tangential_velocity").item(0)

    def set_tangential_velocity(self, context: Context, tangential_velocity: float) -> CurvilinearJoint:
        """Sets the speed along the path [m/s]."""
        return self._write_one_v(context, "set_tangential_velocity", tangential_velocity)

    def get_default_distance(self) -> float:
        """The distance in a default context [m]."""
        return float(self._default_q[0])

    def set_default_distance(self, distance: float) -> None:
        """Sets the distance in a default context [m]."""
        self.set_default_positions([distance])

    def set_random_distance_distribution(self, distance: Scalar | Scalars) -> None:
        """Sets the expression from which SetRandomState() draws the distance."""
        self._random_q = distributions(
            "set_random_distance_distribution", "distance", np.atleast_1d(np.asarray(distance)), 1
        )

    def AddInForce(self, context: Context, force: float, forces: MultibodyForces) -> None:
        """Adds a force along the path's tangent [N] to `forces`."""
        self.AddInOneForce(context, 0, force, forces)
