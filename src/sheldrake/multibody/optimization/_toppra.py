"""The fastest way along a path that keeps limits of velocities, accelerations and torques."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._enums import BoundEnum
from sheldrake.common._options import Options
from sheldrake.common._overloads import incompatible
from sheldrake.multibody.optimization._kernels.toppra import controllable_sets, fastest
from sheldrake.multibody.optimization._toppra_passes import (
    LARGEST_X,
    Rows,
    grid_points,
    one_sided,
)
from sheldrake.multibody.tree import JacobianWrtVariable
from sheldrake.solvers import MathematicalProgram
from sheldrake.trajectories import PiecewisePolynomial

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.multibody.plant import MultibodyPlant
    from sheldrake.multibody.tree import Frame
    from sheldrake.solvers._functions.bindings import BindingBase
    from sheldrake.solvers._functions.constraints import BoundingBoxConstraint, LinearConstraint
    from sheldrake.trajectories import Trajectory

_log = logging.getLogger("drake")


class ToppraDiscretization(BoundEnum):
    """Where limits of accelerations hold: at gridpoints, or also at the next one, reached from there."""

    kCollocation = 0
    kInterpolation = 1


class CalcGridPointsOptions(Options):
    """How densely a path is sampled.

    Attributes:
        max_err: How far the path may bend within a segment.
        max_iter: How often segments are halved.
        max_seg_length: The longest segment.
        min_points: The least number of points.
    """

    max_err: float = 1e-3
    max_iter: int = 100
    max_seg_length: float = 0.05
    min_points: int = 100


@checked
class Toppra:
    """Finds the fastest traversal s(t) of a path q(s) under limits (TOPP by reachability analysis, Pham and Pham 2018).

    Args:
        path: q(s).
        plant: The robot, whose velocities are the derivatives of its positions.
        gridpoints: Increasing values of s where limits are kept, from the start to the end of the path.

    Raises:
        RuntimeError: the gridpoints do not increase.
        ValueError: they do not begin and end with the path, or the path has another size than the positions.
    """

    def __init__(self, path: Trajectory, plant: MultibodyPlant, gridpoints: ArrayLike):
        s = np.array(gridpoints, dtype=float).ravel()
        if s.size < 2 or s[0] != path.start_time() or s[-1] != path.end_time():
            raise ValueError(
                f"Toppra(): gridpoints must reach from {path.start_time()} to {path.end_time()}, got {s.size} from "
                f"{s[:1]} to {s[-1:]}."
            )
        if path.rows() != plant.num_positions():
            raise ValueError(f"Toppra(): the path has {path.rows()} rows, the plant {plant.num_positions()} positions.")
        if np.any(np.diff(s) <= 0.0):
            raise RuntimeError("Gridpoints must be monotonically increasing.")
        self._path, self._plant, self._s = path, plant, s
        self._context = plant.CreateDefaultContext()
        self._q = np.column_stack([path.value(z) for z in s]).T
        self._q_s = np.column_stack([path.EvalDerivative(z, 1) for z in s]).T
        self._q_ss = np.column_stack([path.EvalDerivative(z, 2) for z in s]).T
        self._backward, self._forward = MathematicalProgram(), MathematicalProgram()
        self._x = self._backward.NewContinuousVariables(1, "x")
        self._u = self._backward.NewContinuousVariables(1, "u")
        self._forward_u = self._forward.NewContinuousVariables(1, "u")
        self._x_lower, self._x_upper = np.zeros(s.size), np.full(s.size, LARGEST_X)
        self._rows: list[Rows] = []
        self._relaxation = 0.0

    @staticmethod
    def CalcGridPoints(path: Trajectory, options: CalcGridPointsOptions) -> np.ndarray:
        """Returns gridpoints dense enough for a path: segments are halved until the path hardly bends within one.

        Args:
            path: q(s).
            options: How densely.
        """
        o = options
        return grid_points(path, o.max_err, o.max_iter, o.max_seg_length, o.min_points)

    # Limits of the path's speed

    def _sized(self, call: str, limit: Any, size: int) -> np.ndarray:
        out = np.array(limit, dtype=float).ravel()
        if out.size != size:
            raise ValueError(f"{call}(): a limit has {out.size} values, expected {size}.")
        return out

    def _limit_speed(
        self, rates: np.ndarray, lower: np.ndarray, upper: np.ndarray
    ) -> BindingBase[BoundingBoxConstraint]:
        """Keeps lower <= rates sqrt(x) <= upper; shape (gridpoints, rows)."""
        with np.errstate(divide="ignore", invalid="ignore"):
            ends = np.stack((lower / rates, upper / rates))
        least = np.where(rates != 0.0, ends.min(axis=0), -np.inf).max(axis=1)
        most = np.where(rates != 0.0, ends.max(axis=0), np.inf).min(axis=1)
        self._x_lower = np.maximum(self._x_lower, np.maximum(least, 0.0) ** 2)
        self._x_upper = np.minimum(self._x_upper, np.where(most < 0.0, -np.inf, most**2))
        return self._backward.AddBoundingBoxConstraint(0.0, 1.0, self._x)

    def AddJointVelocityLimit(
        self, lower_limit: ArrayLike, upper_limit: ArrayLike
    ) -> BindingBase[BoundingBoxConstraint]:
        """Limits the velocities, shape (nv,), and returns the bounds on x.

        Raises:
            ValueError: the sizes differ from the number of velocities.
        """
        low, high = (self._sized("AddJointVelocityLimit", b, self._q.shape[1]) for b in (lower_limit, upper_limit))
        return self._limit_speed(self._q_s, low, high)

    def AddFrameVelocityLimit(
        self, constraint_frame: Frame, lower_limit: ArrayLike, upper_limit: ArrayLike
    ) -> BindingBase[LinearConstraint]:
        """Limits the spatial velocity of a frame in the world [rad/s, m/s], shape (6,); returns the bounds on x.

        Raises:
            TypeError: the limits have other sizes.
        """
        if np.size(lower_limit) != 6 or np.size(upper_limit) != 6:
            arguments = (constraint_frame, lower_limit, upper_limit)
            shapes = ["(constraint_frame: Frame, lower_limit: numpy.ndarray[6], upper_limit: numpy.ndarray[6])"]
            raise incompatible("AddFrameVelocityLimit", shapes, arguments, {})
        low, high = (np.array(b, dtype=float).ravel() for b in (lower_limit, upper_limit))
        return self._limit_speed(self._frame_rates(constraint_frame), low, high)

    def AddFrameTranslationalSpeedLimit(self, constraint_frame: Any, upper_limit: Any) -> Any:
        """Limits the speed of a frame's origin in the world [m/s], and returns the bounds on x.

        Args:
            constraint_frame: The frame.
            upper_limit: A number, or a trajectory of s that limits only where it is defined.

        Raises:
            RuntimeError: the trajectory is defined nowhere on the path.
        """
        speed = np.linalg.norm(self._frame_rates(constraint_frame)[:, 3:], axis=1)[:, None]
        if hasattr(upper_limit, "value"):
            if upper_limit.rows() != 1 or upper_limit.cols() != 1:
                raise ValueError("AddFrameTranslationalSpeedLimit(): the upper limit must have one value.")
            high = self._sampled("translational speed limit. The upper limit", upper_limit, np.inf)
        else:
            high = np.full((self._s.size, 1), float(upper_limit))
        return self._limit_speed(speed, np.full(high.shape, -np.inf), high)

    def _frame_rates(self, frame: Frame) -> np.ndarray:
        """Spatial velocity of a frame for s' = 1, shape (gridpoints, 6)."""
        out = []
        for q, q_s in zip(self._q, self._q_s):
            self._plant.SetPositions(self._context, q)
            out.append(self._jacobian(frame) @ q_s)
        return np.array(out)

    def _jacobian(self, frame: Frame) -> np.ndarray:
        W = self._plant.world_frame()
        wrt = JacobianWrtVariable.kV
        return self._plant.CalcJacobianSpatialVelocity(self._context, wrt, frame, np.zeros(3), W, W)

    def _sampled(self, what: str, limit: Any, elsewhere: float) -> np.ndarray:
        """A trajectory at the gridpoints, shape (gridpoints, rows); `elsewhere` outside its domain."""
        start, end = limit.start_time(), limit.end_time()
        if end < self._s[0] or start > self._s[-1]:
            raise RuntimeError(
                f"Toppra can't add a trajectory {what} domain [{start:g}, {end:g}] must overlap the path domain "
                f"[{self._s[0]:g}, {self._s[-1]:g}]."
            )
        out = np.full((self._s.size, limit.rows()), elsewhere)
        for i in np.flatnonzero((self._s >= start) & (self._s <= end)):
            out[i] = limit.value(self._s[i]).ravel()
        return out

    # Limits of accelerations and torques

    def _limit(
        self, a: np.ndarray, b: np.ndarray, lower: ArrayLike, upper: ArrayLike, discretization: ToppraDiscretization
    ) -> tuple:
        rows = Rows(a, b, np.broadcast_to(lower, a.shape), np.broadcast_to(upper, a.shape))
        if discretization == ToppraDiscretization.kInterpolation:
            rows = _with_next(rows, np.diff(self._s))
        self._rows.append(rows)
        n = rows.a.shape[1]
        xu = np.concatenate((self._x, self._u))
        return (
            self._backward.AddLinearConstraint(np.zeros((n, 2)), np.full(n, -1.0), np.ones(n), xu),
            self._forward.AddLinearConstraint(np.zeros((n, 1)), np.full(n, -1.0), np.ones(n), self._forward_u),
        )

    def AddJointAccelerationLimit(
        self,
        lower_limit: ArrayLike,
        upper_limit: ArrayLike,
        discretization: ToppraDiscretization = ToppraDiscretization.kInterpolation,
    ) -> tuple[Any, Any]:
        """Limits the accelerations, shape (nv,); returns the constraints of the backward and the forward pass.

        Raises:
            ValueError: the sizes differ from the number of velocities.
        """
        low, high = (self._sized("AddJointAccelerationLimit", b, self._q.shape[1]) for b in (lower_limit, upper_limit))
        return self._limit(self._q_s, self._q_ss, low, high, discretization)

    def AddJointTorqueLimit(
        self,
        lower_limit: ArrayLike,
        upper_limit: ArrayLike,
        discretization: ToppraDiscretization = ToppraDiscretization.kInterpolation,
    ) -> tuple[Any, Any]:
        """Limits the generalized forces that the motion takes [N m or N], shape (nv,), gravity included.

        Raises:
            ValueError: the sizes differ from the number of velocities.
        """
        low, high = (self._sized("AddJointTorqueLimit", b, self._q.shape[1]) for b in (lower_limit, upper_limit))
        a, b, gravity = [], [], []
        for q, q_s, q_ss in zip(self._q, self._q_s, self._q_ss):
            self._plant.SetPositions(self._context, q)
            self._plant.SetVelocities(self._context, q_s)
            M = self._plant.CalcMassMatrix(self._context)
            a.append(M @ q_s)
            b.append(M @ q_ss + self._plant.CalcBiasTerm(self._context))
            gravity.append(self._plant.CalcGravityGeneralizedForces(self._context))
        tau_g = np.array(gravity)
        return self._limit(np.array(a), np.array(b), low + tau_g, high + tau_g, discretization)

    def AddFrameAccelerationLimit(
        self,
        constraint_frame: Frame,
        lower_limit: ArrayLike,
        upper_limit: ArrayLike,
        discretization: ToppraDiscretization = ToppraDiscretization.kInterpolation,
    ) -> tuple[Any, Any]:
        """Limits the spatial acceleration of a frame in the world [rad/s^2, m/s^2].

        Args:
            constraint_frame: The frame.
            lower_limit: Shape (6,), or a trajectory of s that limits only where it is defined.
            upper_limit: The same.
            discretization: Where it holds.

        Raises:
            RuntimeError: a trajectory is defined nowhere on the path.
        """
        what = "frame acceleration limit. The {} limit"

        def bound(word: str, limit: Any, elsewhere: float) -> np.ndarray:
            if not hasattr(limit, "value"):
                return self._sized("AddFrameAccelerationLimit", limit, 6)
            if limit.rows() != 6:
                raise ValueError(f"AddFrameAccelerationLimit(): the {word} limit has {limit.rows()} rows, not 6.")
            return self._sampled(what.format(word), limit, elsewhere)

        lower, upper = bound("lower", lower_limit, -np.inf), bound("upper", upper_limit, np.inf)
        a, b, W, wrt = [], [], self._plant.world_frame(), JacobianWrtVariable.kV
        for q, q_s, q_ss in zip(self._q, self._q_s, self._q_ss):
            self._plant.SetPositions(self._context, q)
            self._plant.SetVelocities(self._context, q_s)
            J = self._jacobian(constraint_frame)
            bias = self._plant.CalcBiasSpatialAcceleration(self._context, wrt, constraint_frame, np.zeros(3), W, W)
            a.append(J @ q_s)
            b.append(J @ q_ss + bias.get_coeffs())
        return self._limit(np.array(a), np.array(b), lower, upper, discretization)

    # The two passes

    def SolvePathParameterization(self, s_dot_start: float = 0, s_dot_end: float = 0) -> PiecewisePolynomial | None:
        """Returns s(t) of the fastest traversal, or None if there is none.

        It starts at the time where the path starts.

        Args:
            s_dot_start: Speed of the path at its start.
            s_dot_end: Speed of the path at its end.

        Raises:
            ValueError: a speed is negative.
        """
        if s_dot_start < 0.0 or s_dot_end < 0.0:
            raise ValueError(f"SolvePathParameterization(): speeds {s_dot_start}, {s_dot_end} must not be negative.")
        sets = self._controllable_sets(s_dot_start**2, s_dot_end**2)
        if sets is None:
            return None
        x = self._fastest(s_dot_start**2, sets)
        if x is None:
            return None
        s_dot = np.sqrt(np.maximum(x, 0.0))
        with np.errstate(divide="ignore"):
            durations = 2.0 * np.diff(self._s) / (s_dot[1:] + s_dot[:-1])
        t = self._s[0] + np.concatenate(([0.0], np.cumsum(durations)))
        return PiecewisePolynomial.CubicHermite(t, self._s[None, :], s_dot[None, :])

    def set_constraint_relaxation(self, relaxation: float) -> None:
        """Widens all limits of accelerations on the way forward, where a path at its limits would fail by rounding.

        Args:
            relaxation: Added to upper limits and taken from lower ones, in their units; 1e-5 is usual, 0 the default.

        Raises:
            RuntimeError: it is negative or not finite.
        """
        if not 0.0 <= relaxation < np.inf:
            raise RuntimeError(f"Toppra.set_constraint_relaxation(): expected a finite number >= 0, got {relaxation}.")
        self._relaxation = float(relaxation)

    def constraint_relaxation(self) -> float:
        """Returns by how much limits are widened on the way forward."""
        return self._relaxation

    def _controllable_sets(self, x_start: float, x_end: float) -> np.ndarray | None:
        last = self._s.size - 1
        sets = np.zeros((self._s.size, 2))
        sets[last] = x_end
        failed = controllable_sets.native(
            one_sided(self._rows, self._s.size, 0.0), self._s, self._x_lower, self._x_upper, sets
        )
        if failed >= 0:
            _log.error("Toppra failed to find lower bound of controllable set at knot %d/%d.", failed, last)
            return None
        if not sets[0, 0] - 1e-9 <= x_start <= sets[0, 1] + 1e-9:
            _log.error("Toppra: the speed at the start is not in the controllable set [%g, %g].", *np.sqrt(sets[0]))
            return None
        return sets

    def _fastest(self, x_start: float, sets: np.ndarray) -> np.ndarray | None:
        x = np.zeros(self._s.size)
        x[0] = x_start
        rows = one_sided(self._rows, self._s.size, self._relaxation)
        failed = fastest.native(rows, self._s, self._x_lower, self._x_upper, sets, x)
        if failed >= 0:
            _log.error("Toppra failed to find a path acceleration at knot %d/%d.", failed, self._s.size - 1)
            return None
        return x


def _with_next(rows: Rows, deltas: np.ndarray) -> Rows:
    """Adds the limits of the next gridpoint, which x + 2 delta u reaches."""
    after = [np.concatenate((m[1:], m[-1:])) for m in rows]
    delta = np.append(deltas, 0.0)[:, None]
    a, b, lower, upper = after
    both = zip(rows, (a + 2.0 * delta * b, b, lower, upper))
    return Rows(*(np.concatenate(pair, axis=1) for pair in both))
