"""Orientations and poses that depend on time.

Quaternions between breaks on the shortest great circle, and poses made of one of these and a polynomial.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any
from typing import overload as typing_overload

import numpy as np

from sheldrake.common import _rotations as rotations
from sheldrake.common import quick
from sheldrake.common._checked import checked
from sheldrake.common._quaternion import QUATERNION
from sheldrake.common._scalar_math import acos, atan2, select, sin, sqrt
from sheldrake.common._scalars import as_scalar, is_symbolic
from sheldrake.common.eigen_geometry import AngleAxis_, Quaternion, Quaternion_
from sheldrake.common.kernel import MISFIT
from sheldrake.math import RigidTransform, RigidTransform_, RotationMatrix, RotationMatrix_
from sheldrake.math._rigid_transform import POSE
from sheldrake.polynomial._polynomial import differentiate
from sheldrake.trajectories._base import holds, kept, query
from sheldrake.trajectories._kernels import values
from sheldrake.trajectories._piecewise import EPSILON_TIME, PiecewiseTrajectory
from sheldrake.trajectories._piecewise_polynomial import PiecewisePolynomial

if TYPE_CHECKING:
    from sheldrake.common import eigen_geometry
    from sheldrake.common._types import Scalar, Scalars
    from sheldrake.trajectories._base import Trajectory


def _select(condition: Any, yes: Callable[[], Any], no: Callable[[], Any]) -> Any:
    """As `select`, but of a formula that is decided only the branch it takes is made: the other may divide by zero."""
    if hasattr(condition, "Evaluate") and condition.GetFreeVariables().empty():
        condition = condition.Evaluate()
    return select(condition, yes, no)


def _dot(a: Any, b: Any) -> Any:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]


_ASKED_OF_POSES = (0, 1, "pose", "velocity")
_ROUNDING_OF_DOT = 1e-15  # of two unit quaternions: what is equal must be so with a tolerance of zero


@checked
class PiecewiseQuaternionSlerp(PiecewiseTrajectory):
    """An orientation that turns at constant angular velocity from one sample to the next.

    The value is the quaternion w, x, y, z as a column; derivatives are those of the angular velocity, shape `(3, 1)`.

    Args:
        breaks: Times [s], increasing.
        orientations: An orientation for each: all quaternions, rotation matrices or angle-axes. Their keyword is
            `quaternions`, `rotation_matrices` or `angle_axes`.

    Raises:
        RuntimeError: fewer than two, or another number of times than of orientations.
    """

    def __init__(self, breaks: Any = None, *args: Any, **kwargs: Any):
        given = [*args, *(kwargs.pop(n) for n in ("quaternions", "rotation_matrices", "angle_axes") if n in kwargs)]
        if kwargs:
            raise self._mismatch("", "breaks and quaternions, rotation_matrices or angle_axes", kwargs)
        self._q: list[tuple] = []  # w, x, y, z of each
        if breaks is None and not given:
            PiecewiseTrajectory.__init__(self)
            return
        if len(given) != 1:
            raise self._mismatch("", "breaks and one list of orientations", given)
        self._append_all([self._wxyz("", o) for o in given[0]], self._scalars("", breaks))

    def _append_all(self, samples: list, breaks: list) -> None:
        if len(samples) != len(breaks):
            raise RuntimeError(
                f"{self._name('')}: Quaternions and breaks length mismatch: {len(samples)} and {len(breaks)}."
            )
        if len(samples) < 2:
            raise RuntimeError(f"{self._name('')}: Not enough quaternions for slerp: {len(samples)}, 2 are needed.")
        self._check_increasing(breaks)
        self._breaks = breaks
        for q in samples:
            self._add(q)

    def _add(self, q: tuple) -> None:
        """Adds a sample, of the two quaternions that mean it the one nearer to the last."""
        if self._q:
            farther = _dot(self._q[-1], q) < 0.0
            q = q if farther is False else _select(farther, lambda: tuple([-x for x in q]), lambda: q)
        self._q.append(q)

    def _wxyz(self, call: str, orientation: Any) -> tuple:
        T, kind = self._T, type(orientation)
        if T is float and (kind is Quaternion or kind is RotationMatrix):  # nearly all
            q = orientation if kind is Quaternion else orientation.ToQuaternion()
            return tuple(q._wxyz.tolist())
        if isinstance(orientation, Quaternion_[T]):
            return tuple(orientation.wxyz().tolist())
        if isinstance(orientation, RotationMatrix_[T]):
            return rotations.matrix_to_canonical_quaternion(orientation.matrix())
        if isinstance(orientation, AngleAxis_[T]):
            return self._wxyz(call, orientation.quaternion())
        if not call and np.shape(orientation) == (3, 3):
            return self._wxyz(call, RotationMatrix_[T](orientation))
        raise self._mismatch(call, "quaternions, rotation matrices or angle-axes", orientation)

    @typing_overload
    @checked
    def Append(self, time: Scalar, quaternion: Quaternion) -> None: ...
    @typing_overload
    @checked
    def Append(self, time: Scalar, rotation_matrix: RotationMatrix) -> None: ...
    @typing_overload
    @checked
    def Append(self, time: Scalar, angle_axis: eigen_geometry.AngleAxis) -> None: ...
    def Append(self, time: Scalar, *args: Any, **kwargs: Any) -> None:
        """Adds an orientation (a quaternion, a rotation matrix or an angle-axis) at a later time [s].

        Raises:
            RuntimeError: the time is not later.
        """
        given = [*args, *(kwargs[n] for n in ("quaternion", "rotation_matrix", "angle_axis") if n in kwargs)]
        t = self._scalar("Append", time)
        q = self._wxyz("Append", given[0] if len(given) == 1 else given)
        if self._breaks and not is_symbolic(self._T) and not t - self._breaks[-1] >= EPSILON_TIME:
            raise RuntimeError(f"{self._name('Append')}: time {t} s is not after the last, {self._breaks[-1]} s.")
        self._breaks.append(t)
        self._add(q)
        self._changed()

    def get_quaternion_samples(self) -> list:
        """Returns the samples as quaternions; the sign of each is that nearer to the one before."""
        return [Quaternion_[self._T](q) for q in self._q]

    def _require_segment(self) -> None:
        if len(self._q) < 2:
            self._segment(0)

    def _quaternion(self, t: Scalar) -> np.ndarray:
        """Spherical linear interpolation (Shoemake 1985)."""
        self._require_segment()
        if self._T is float:
            return np.array(self._plain_quaternion(t))
        t = self._clamped(t)
        i = self.get_segment_index(t)
        fraction = (t - self._breaks[i]) / (self._breaks[i + 1] - self._breaks[i])
        a, b = np.array(self._q[i], object), np.array(self._q[i + 1], object)
        cosine = _dot(a, b)

        def straight() -> tuple:
            return 1.0 - fraction, fraction

        def along_the_arc() -> tuple:
            angle = acos(cosine)
            scale = sin(angle)
            return sin((1.0 - fraction) * angle) / scale, sin(fraction * angle) / scale

        weight_a, weight_b = _select(cosine >= 1.0 - 2.220446049250313e-16, straight, along_the_arc)
        return a * weight_a + b * weight_b

    def _plain_quaternion(self, t: Any) -> list[Any]:
        """The same of plain numbers."""
        t = self._clamped(t)
        i = self._index(t)
        fraction = (t - self._breaks[i]) / (self._breaks[i + 1] - self._breaks[i])
        a, b = self._q[i], self._q[i + 1]
        cosine = _dot(a, b)
        if cosine >= 1.0 - 2.220446049250313e-16:
            weight_a, weight_b = 1.0 - fraction, fraction
        else:
            angle = acos(cosine)
            scale = sin(angle)
            weight_a, weight_b = sin((1.0 - fraction) * angle) / scale, sin(fraction * angle) / scale
        return [x * weight_a + y * weight_b for x, y in zip(a, b)]

    def _plain_orientation(self, t: Any) -> list[Any]:
        """The quaternion of plain numbers, of length one."""
        self._require_segment()
        w, x, y, z = self._plain_quaternion(t)
        length = sqrt(w * w + x * x + y * y + z * z)
        return [w / length, x / length, y / length, z / length]

    def orientation(self, time: Scalar) -> Quaternion:
        """Returns the quaternion at a time [s]."""
        if self._T is float:
            ask = self._soon("orientation", self._make_query)
            if ask is not None and (made := ask(time)) is not None:
                return made
            return Quaternion._make(self._plain_orientation(self._scalar("orientation", time)))
        q = self._quaternion(self._scalar("orientation", time))
        return Quaternion_[self._T](q / sqrt((q * q).sum()))

    def angular_velocity(self, time: Scalar) -> np.ndarray:
        """Returns the angular velocity [rad/s] at a time [s], in the frame the orientation is measured in."""
        if self._T is float:
            ask = self._soon(1, self._make_query)
            if ask is not None and type(made := ask(time)) is np.ndarray:
                return made[:, 0]
        self._require_segment()
        return self._velocity_of(self.get_segment_index(self._clamped(self._scalar("angular_velocity", time))))

    def _velocity_of(self, i: int) -> np.ndarray:
        """Angular velocity of a segment: the turn from its start to its end, over its duration."""
        (w0, x0, y0, z0), (w1, x1, y1, z1) = self._q[i], self._q[i + 1]
        w = w1 * w0 + x1 * x0 + y1 * y0 + z1 * z0
        x = -w1 * x0 + x1 * w0 - y1 * z0 + z1 * y0
        y = -w1 * y0 + y1 * w0 - z1 * x0 + x1 * z0
        z = -w1 * z0 + z1 * w0 - x1 * y0 + y1 * x0
        square = x * x + y * y + z * z

        def rate() -> Any:
            length = sqrt(square)
            return 2.0 * atan2(length, w) / length

        duration: Any = self._breaks[i + 1] - self._breaks[i]
        if self._T is float:
            scale = (0.0 if square == 0.0 else rate()) / duration
            return np.array((x * scale, y * scale, z * scale))
        scale = _select(square == 0.0, lambda: as_scalar(self._T, 0.0), rate) / duration
        out = np.empty(3, dtype=object)
        out[:] = x * scale, y * scale, z * scale
        return out

    def angular_acceleration(self, time: Scalar) -> np.ndarray:
        """Returns the angular acceleration [rad/s^2]: zero."""
        self._scalar("angular_acceleration", time)
        return self._zeros(3)

    _MAKES_ARRAYS = _HAS_QUERIES = True

    def _make_query(self, what: Any) -> Any:
        """Values, orientations and angular velocities."""
        if self._T is not float or len(self._q) < 2 or what not in (0, 1, "orientation"):
            return None
        if what == 1:
            rates = np.concatenate([self._velocity_of(i) for i in range(self.get_number_of_segments())])
            return query(values.polynomials, np.array(self._breaks), rates.reshape(-1, 1), 0.0, out=np.zeros((3, 1)))
        kernel, gives = (values.orientation, QUATERNION) if what else (values.slerp, (4, 1))
        arrays = np.array(self._breaks), np.array(self._q)
        return quick.query(kernel, *arrays, takes=(float,), gives=gives, frozen=False)

    def do_value(self, t: Scalar) -> np.ndarray:
        """The quaternion as a column."""
        return self._quaternion(t).reshape(4, 1)

    def do_rows(self) -> int:
        """Four."""
        return 4

    def do_cols(self) -> int:
        """One."""
        return 1

    def do_has_derivative(self) -> bool:
        """True."""
        return True

    def DoEvalDerivative(self, t: Scalar, derivative_order: int) -> np.ndarray:
        """The angular velocity, or zero for higher orders."""
        return self.angular_velocity(t).reshape(3, 1) if derivative_order == 1 else self._zeros(3, 1)

    def DoMakeDerivative(self, derivative_order: int) -> Trajectory:
        """The angular velocity as a trajectory, or zero for higher orders."""
        family = self._sibling(PiecewisePolynomial._template)
        if derivative_order > 1:
            return family(self._zeros(3, 1))
        velocities = [self._velocity_of(i).reshape(3, 1, 1) for i in range(self.get_number_of_segments())]
        return family._of(velocities, self._breaks)


@checked
class PiecewisePose(PiecewiseTrajectory):
    """A pose: a position and an orientation over the same segments.

    The value is the pose as a matrix, shape `(4, 4)`; derivatives are spatial velocity and acceleration, angular part
    first, shape `(6, 1)`.

    Args:
        position_trajectory: Position [m], shape `(3, 1)`.
        orientation_trajectory: Orientation, over the same breaks.

    Raises:
        RuntimeError: the breaks differ, or the position is not a vector of three.
    """

    def __init__(
        self,
        position_trajectory: Any = None,
        orientation_trajectory: Any = None,
    ):
        families = PiecewisePolynomial._template, PiecewiseQuaternionSlerp._template
        p, R = position_trajectory, orientation_trajectory
        if p is None and R is None:
            self._p, self._R = (f[self._T]() for f in families)
            PiecewiseTrajectory.__init__(self)
            return
        for part, family in zip((p, R), families):
            if not isinstance(part, family[self._T]):
                raise self._mismatch("", family[self._T].__name__, part)
        if (p.rows(), p.cols()) != (3, 1):
            raise RuntimeError(f"{self._name('')}: the position must be 3 x 1, it is {p.rows()} x {p.cols()}.")
        a, b = p.get_segment_times(), R.get_segment_times()
        if len(a) != len(b) or (not is_symbolic(self._T) and any(abs(x - y) > EPSILON_TIME for x, y in zip(a, b))):
            raise RuntimeError(f"{self._name('')}: position and orientation have different breaks: {a}, {b} s.")
        self._breaks, self._p, self._R = a, p.Clone(), R.Clone()

    @classmethod
    def _of(cls, p: PiecewisePolynomial, R: PiecewiseQuaternionSlerp) -> PiecewisePose:
        """Of parts that fit and are nobody else's."""
        out = object.__new__(cls._template[cls._T])
        out._breaks, out._p, out._R = p.get_segment_times(), p, R
        return out

    @classmethod
    def _orientation_through(cls, call: str, times: Scalars, poses: Any) -> tuple[list, np.ndarray, Any]:
        breaks, family = cls._scalars(call, times), RigidTransform_[cls._T]
        poses = list(poses)
        for X in poses:
            if not isinstance(X, family):
                raise cls._mismatch(call, f"poses, each a {family.__name__}", X)
        rotations = [X.rotation() for X in poses]
        positions = np.array([X.translation() for X in poses]).reshape(-1, 3, 1)
        return breaks, positions, PiecewiseQuaternionSlerp._template[cls._T](breaks, rotations)

    @classmethod
    def MakeLinear(cls, times: Scalars, poses: Sequence[RigidTransform]) -> PiecewisePose:
        """Returns the motion at constant linear and angular velocity from pose to pose.

        Args:
            times: When [s], increasing.
            poses: A RigidTransform for each.
        """
        breaks, positions, R = cls._orientation_through("MakeLinear", times, poses)
        p = PiecewisePolynomial._template[cls._T].FirstOrderHold(breaks, positions)
        return cls._of(p, R)

    @classmethod
    def MakeCubicLinearWithEndLinearVelocity(
        cls,
        times: Scalars,
        poses: Sequence[RigidTransform],
        start_vel: Scalars = (0.0, 0.0, 0.0),
        end_vel: Scalars = (0.0, 0.0, 0.0),
    ) -> PiecewisePose:
        """Returns the motion along cubics with continuous acceleration, turning at constant rate from pose to pose.

        Args:
            times: When [s], increasing.
            poses: A RigidTransform for each.
            start_vel: Velocity at the start [m/s], shape `(3,)`.
            end_vel: Velocity at the end [m/s], shape `(3,)`.
        """
        call = "MakeCubicLinearWithEndLinearVelocity"
        breaks, positions, R = cls._orientation_through(call, times, poses)
        ends = [cls._matrix(call, v) for v in (start_vel, end_vel)]
        family = PiecewisePolynomial._template[cls._T]
        return cls._of(family.CubicWithContinuousSecondDerivatives(breaks, positions, *ends), R)

    def get_position_trajectory(self) -> PiecewisePolynomial:
        """Returns a copy of the position [m]."""
        return kept(self._p)

    def get_orientation_trajectory(self) -> PiecewiseQuaternionSlerp:
        """Returns a copy of the orientation."""
        return kept(self._R)

    def GetPose(self, time: Scalar) -> RigidTransform:
        """Returns the pose at a time [s]; that at the nearest end outside."""
        ask = self._soon("pose", self._make_query)
        if ask is not None and (made := ask(time)) is not None:
            return made
        t = self._scalar("GetPose", time)
        if self._T is float:
            return RigidTransform._make(
                rotations.numbers_to_matrix(*self._R._plain_orientation(t)), self._p.value(t).reshape(3)
            )
        p = self._p.value(t)[:, 0]
        return RigidTransform_[self._T](self._R.orientation(t), p)

    def GetVelocity(self, time: Scalar) -> np.ndarray:
        """Returns the spatial velocity [rad/s, m/s], shape `(6,)`; zero outside."""
        ask = self._soon("velocity", self._make_query)
        if ask is not None and (made := ask(time)) is not None:
            return made
        return self._motion("GetVelocity", time, 1)

    def GetAcceleration(self, time: Scalar) -> np.ndarray:
        """Returns the spatial acceleration [rad/s^2, m/s^2], shape `(6,)`; zero outside."""
        return self._motion("GetAcceleration", time, 2)

    _MAKES_ARRAYS = _HAS_QUERIES = True

    def _make_query(self, what: Any) -> Any:
        """Poses and velocities, also as matrices."""
        if self._T is not float or not self._p._c or len(self._R._q) < 2 or what not in _ASKED_OF_POSES:
            return None
        if what in (0, 1):
            return self._make_query_of_matrices(what)
        p, breaks = self._p, np.array(self._p._breaks)
        if not np.isfinite(breaks).all():
            return None
        c = differentiate(p.polynomials, what == "velocity")
        arrays = np.array(self._R._breaks), self._angular_table(what), breaks, c.reshape(-1, c.shape[-1])
        if what == "pose":
            return quick.query(values.pose_between, *arrays, takes=(float,), gives=POSE)
        return quick.query(values.twist_between, *arrays, takes=(float,), gives=(6,), frozen=False)

    def _make_query_of_matrices(self, order: int) -> Any:
        """`value` and, inside, the first derivative; the ways of poses and velocities in a matrix."""
        ask = self._make_query("velocity" if order else "pose")
        if ask is None:
            return None
        first, last = self._breaks[0], self._breaks[-1]

        def matrix(t: Any) -> Any:
            if not isinstance(t, float):
                return MISFIT
            if order:
                return ask(t).reshape(6, 1) if first <= t <= last else self.DoEvalDerivative(float(t), 1)
            return ask(t).GetAsMatrix4()

        return matrix

    def _angular_table(self, what: str) -> np.ndarray:
        """Quaternions of the samples, or angular velocities of the segments."""
        R = self._R
        return np.array(R._q if what == "pose" else [R._velocity_of(i) for i in range(R.get_number_of_segments())])

    def _motion(self, call: str, time: Scalar, order: int) -> np.ndarray:
        t = self._scalar(call, time)
        inside = is_symbolic(self._T) or self._breaks[0] <= t <= self._breaks[-1]
        return self.DoEvalDerivative(t, order)[:, 0] if inside else self._zeros(6)

    def IsApprox(self, other: PiecewisePose, tol: float) -> bool:
        """Tells whether positions agree, as by `isApprox(tol)`, and orientations are no more than `tol` [rad] apart."""
        if not self._p.isApprox(other._p, tol) or len(self._R._q) != len(other._R._q):
            return False
        least = math.cos(tol / 2.0) - _ROUNDING_OF_DOT
        return all(holds(abs(_dot(a, b)) >= least) for a, b in zip(self._R._q, other._R._q))

    def do_value(self, t: Scalar) -> np.ndarray:
        """The pose as a matrix."""
        return self.GetPose(t).GetAsMatrix4()

    def do_rows(self) -> int:
        """Four."""
        return 4

    def do_cols(self) -> int:
        """Four."""
        return 4

    def do_has_derivative(self) -> bool:
        """True."""
        return True

    def DoEvalDerivative(self, t: Scalar, derivative_order: int) -> np.ndarray:
        """Spatial velocity, acceleration ..."""
        if self._T is float and derivative_order > 0:
            R, linear = self._R, self._p._at(t, derivative_order)
            angular = R._velocity_of(R._index(t)).reshape(3, 1) if derivative_order == 1 else np.zeros((3, 1))
            return np.concatenate((angular, linear))
        return np.concatenate([f.EvalDerivative(t, derivative_order) for f in (self._R, self._p)])

    def DoMakeDerivative(self, derivative_order: int) -> Trajectory:
        """Spatial velocity, acceleration ... as a trajectory."""
        family = self._sibling(PiecewisePolynomial._template)
        linear = self._p.derivative(derivative_order)
        angular = [self._zeros(3, 1, 1) for _ in linear._c]
        if derivative_order == 1:
            angular = [self._R._velocity_of(i).reshape(3, 1, 1) for i in range(len(linear._c))]
        both = []
        for a, c in zip(angular, linear._c):
            block = self._zeros(6, 1, c.shape[-1])
            block[:3, :, :1], block[3:] = a, c
            both.append(block)
        return family._of(both, self._breaks)
