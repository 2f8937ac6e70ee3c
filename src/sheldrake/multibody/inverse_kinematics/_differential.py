"""Differential inverse kinematics: velocities of joints for a velocity of an end effector."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sheldrake.common._bound_calls import BoundCalls
from sheldrake.common._checked import checked
from sheldrake.common._enums import BoundEnum
from sheldrake.common._kinds import anything, called, instance_of
from sheldrake.common._overloads import Mismatch, kind, overload, overloaded
from sheldrake.common._rotations import matrix_to_canonical_quaternion, quaternion_to_angle_axis
from sheldrake.common.kernel import Bound
from sheldrake.math import RigidTransform
from sheldrake.multibody.inverse_kinematics._kinematic import FRAME, PLANT
from sheldrake.multibody.tree import JacobianWrtVariable
from sheldrake.solvers import MathematicalProgram, Solve, SolverOptions
from sheldrake.solvers._engines.quadratic import solve_rows
from sheldrake.solvers._kernels.nullspace import nullspace
from sheldrake.solvers._kinds import matrix, vector

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.multibody.math._spatial_vectors import SpatialVelocity
    from sheldrake.multibody.plant import MultibodyPlant
    from sheldrake.multibody.tree import Frame
    from sheldrake.systems.framework import Context


class DifferentialInverseKinematicsStatus(BoundEnum):
    """How it ended: with velocities, without, or with velocities that hardly move the end effector."""

    kSolutionFound = 0
    kNoSolutionFound = 1
    kStuck = 2


@checked
class DifferentialInverseKinematicsResult:
    """Velocities of the joints, shape (nv,), or None; and how it ended."""

    __slots__ = ("joint_velocities", "status")

    def __init__(
        self,
        joint_velocities: np.ndarray | None = None,
        status: DifferentialInverseKinematicsStatus = DifferentialInverseKinematicsStatus.kNoSolutionFound,
    ):
        self.joint_velocities, self.status = joint_velocities, status


class _Bounds(NamedTuple):
    lower: np.ndarray
    upper: np.ndarray


@checked
class DifferentialInverseKinematicsParameters:
    """Limits, gains and the time step of differential inverse kinematics.

    Args:
        num_positions: Number of positions.
        num_velocities: Number of velocities; that of positions if absent.
    """

    def __init__(self, num_positions: int, num_velocities: int | None = None):
        self._nq = int(num_positions)
        self._nv = self._nq if num_velocities is None else int(num_velocities)
        self._nominal = np.zeros(self._nq)
        self._gain = np.zeros((self._nq, self._nq))
        self._flag = np.ones(6, dtype=bool)
        self._dt, self._stuck = 1.0, 0.01
        self._limits: dict[str, _Bounds | None] = {"position": None, "velocity": None, "acceleration": None}
        self._angular_limit = np.inf
        self._translational: tuple[np.ndarray, np.ndarray] | None = None
        self._options = SolverOptions()

    def get_num_positions(self) -> int:
        """Returns the number of positions."""
        return self._nq

    def get_num_velocities(self) -> int:
        """Returns the number of velocities."""
        return self._nv

    def get_time_step(self) -> float:
        """Returns the time step [s]."""
        return self._dt

    def set_time_step(self, dt: float) -> None:
        """Sets the time step [s].

        Raises:
            RuntimeError: it is not positive.
        """
        if not dt > 0.0:
            raise RuntimeError(f"set_time_step(): the time step must be positive, got {dt}.")
        self._dt = float(dt)

    def get_nominal_joint_position(self) -> np.ndarray:
        """Returns the positions that joints are drawn to where they are free, shape (nq,)."""
        return self._nominal.copy()

    def set_nominal_joint_position(self, arg0: ArrayLike) -> None:
        """Sets the positions that joints are drawn to where they are free, shape (nq,).

        Raises:
            RuntimeError: the size is another.
        """
        self._nominal = self._sized("set_nominal_joint_position", arg0, self._nq)

    def _sized(self, call: str, value: ArrayLike, size: int) -> np.ndarray:
        v = np.atleast_1d(np.array(value, dtype=float)).ravel()
        if v.size != size:
            raise RuntimeError(f"{call}(): expected {size} values, got {v.size}.")
        return v

    def get_joint_centering_gain(self) -> np.ndarray:
        """Returns the gain K of the pull to the nominal positions, shape (nq, nq)."""
        return self._gain.copy()

    def set_joint_centering_gain(self, K: ArrayLike) -> None:
        """Sets the gain K of the pull to the nominal positions, shape (nq, nq) [1/s].

        Raises:
            RuntimeError: the shape is another.
        """
        K = np.array(K, dtype=float)
        if K.shape != (self._nq, self._nq):
            raise RuntimeError(f"set_joint_centering_gain(): expected shape {(self._nq, self._nq)}, got {K.shape}.")
        self._gain = K

    def get_end_effector_velocity_flag(self) -> np.ndarray:
        """Returns which elements of the velocity, in frame E, are to be followed, shape (6,)."""
        return self._flag.copy()

    def set_end_effector_velocity_flag(self, flag_E: ArrayLike) -> None:
        """Sets which elements of the velocity, in frame E, are to be followed, shape (6,)."""
        self._flag = np.array(flag_E, dtype=bool).reshape(6)

    def get_end_effector_angular_speed_limit(self) -> float:
        """Returns the largest angular speed to be commanded for a pose [rad/s]."""
        return self._angular_limit

    def set_end_effector_angular_speed_limit(self, speed: float) -> None:
        """Sets the largest angular speed to be commanded for a pose [rad/s]."""
        self._angular_limit = float(speed)

    def get_end_effector_translational_velocity_limits(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Returns the bounds of the translational velocity to be commanded for a pose [m/s], or None."""
        return self._translational

    def set_end_effector_translational_velocity_limits(self, lower: ArrayLike, upper: ArrayLike) -> None:
        """Sets the bounds of the translational velocity to be commanded for a pose [m/s], shape (3,) each."""
        low, high = self._sized("lower", lower, 3), self._sized("upper", upper, 3)
        if np.any(high < low):
            raise RuntimeError("set_end_effector_translational_velocity_limits(): upper is below lower.")
        self._translational = (low, high)

    def _set_limits(self, kind: str, bounds: Any, size: int) -> None:
        call = f"set_joint_{kind}_limits"
        low, high = (self._sized(call, b, size) for b in bounds)
        if np.any(high < low):
            raise RuntimeError(f"{call}(): an upper bound is below its lower bound.")
        self._limits[kind] = _Bounds(low, high)

    def _get_limits(self, kind: str) -> tuple[np.ndarray, np.ndarray] | None:
        found = self._limits[kind]
        return None if found is None else (found.lower.copy(), found.upper.copy())

    def get_joint_position_limits(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Returns the bounds of positions, or None."""
        return self._get_limits("position")

    def set_joint_position_limits(self, arg0: ArrayLike) -> None:
        """Sets the bounds (lower, upper) of positions, shape (nq,) each."""
        self._set_limits("position", arg0, self._nq)

    def get_joint_velocity_limits(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Returns the bounds of velocities, or None."""
        return self._get_limits("velocity")

    def set_joint_velocity_limits(self, arg0: ArrayLike) -> None:
        """Sets the bounds (lower, upper) of velocities, shape (nv,) each."""
        self._set_limits("velocity", arg0, self._nv)

    def get_joint_acceleration_limits(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Returns the bounds of accelerations, or None."""
        return self._get_limits("acceleration")

    def set_joint_acceleration_limits(self, arg0: ArrayLike) -> None:
        """Sets the bounds (lower, upper) of accelerations, shape (nv,) each."""
        self._set_limits("acceleration", arg0, self._nv)

    def get_maximum_scaling_to_report_stuck(self) -> float:
        """Returns the part of the wanted velocity below which the result is `kStuck`."""
        return self._stuck

    def set_maximum_scaling_to_report_stuck(self, scaling: float) -> None:
        """Sets the part of the wanted velocity below which the result is `kStuck`."""
        self._stuck = float(scaling)

    def get_mutable_solver_options(self) -> SolverOptions:
        """Returns the options of the solver, to be changed."""
        return self._options


def _from_jacobian(
    q: np.ndarray,
    v: np.ndarray,
    V: np.ndarray,
    J: np.ndarray,
    parameters: DifferentialInverseKinematicsParameters,
    N: ArrayLike | None = None,
    Nplus: ArrayLike | None = None,
) -> DifferentialInverseKinematicsResult:
    """min -100 alpha + |P (v_next - N+ K (q_nominal - q))|^2 with J v_next = alpha V, under the limits.

    The rows of P span the nullspace of J.
    """
    nq, nv = parameters.get_num_positions(), parameters.get_num_velocities()
    sizes = {"q_current": (q.size, nq), "v_current": (v.size, nv), "J": (J.shape, (V.size, nv))}
    for name, (found, expected) in sizes.items():
        if found != expected:
            raise RuntimeError(f"DoDifferentialInverseKinematics(): {name} has size {found}, expected {expected}.")
    P = nullspace_rows(J)
    if len(P) and Nplus is None and nq != nv:
        raise RuntimeError("DoDifferentialInverseKinematics(): Nplus is needed where positions are no velocities.")
    pull = parameters._gain @ (parameters._nominal - q)
    wanted = P @ (pull if Nplus is None else np.asarray(Nplus, dtype=float) @ pull) if len(P) else np.zeros(0)
    limits = _limits(q, v, parameters, N)
    solve = _solve_program if parameters._options.options else _solve_at_once
    possible = all((low <= high).all() for _, low, high in limits)
    x = solve(J, V, P, wanted, limits, parameters._options) if possible else None
    Status = DifferentialInverseKinematicsStatus
    if x is None:
        return DifferentialInverseKinematicsResult(None, Status.kNoSolutionFound)
    stuck = V.size > 0 and x[-1] <= parameters._stuck
    return DifferentialInverseKinematicsResult(x[:-1], Status.kStuck if stuck else Status.kSolutionFound)


Rows = list[tuple[np.ndarray, np.ndarray, np.ndarray]]
"""Matrices of v_next, each with lower and upper bounds."""


def _solve_at_once(
    J: np.ndarray, V: np.ndarray, P: np.ndarray, wanted: np.ndarray, limits: Rows, options: SolverOptions
) -> np.ndarray | None:
    """Values of v_next and alpha, or None: a controller asks for them a thousand times a second."""
    (m, nv), k = J.shape, sum(len(low) for _, low, _ in limits)
    Q, A, b = np.zeros((nv + 1, nv + 1)), np.zeros((m + 2 + 2 * k, nv + 1)), np.zeros(m + 2 + 2 * k)
    Q[:nv, :nv] = 2.0 * P.T @ P
    A[:m, :nv], A[:m, nv], A[m, nv], A[m + 1, nv], b[m] = J, -V, 1.0, -1.0, 1.0
    at = m + 2
    for rows, low, high in limits:
        above, below, at = slice(at, at + len(low)), slice(at + len(low), at + 2 * len(low)), at + 2 * len(low)
        A[above, :nv], A[below, :nv], b[above], b[below] = rows, -rows, high, -low
    q = np.empty(nv + 1)
    q[:nv], q[nv] = -2.0 * P.T @ wanted, -100.0
    return solve_rows(Q, q, A, b, m)


def _solve_program(
    J: np.ndarray, V: np.ndarray, P: np.ndarray, wanted: np.ndarray, limits: Rows, options: SolverOptions
) -> np.ndarray | None:
    """The same by the solver that suits it best."""
    prog = MathematicalProgram()
    v_next = prog.NewContinuousVariables(J.shape[1], "v_next")
    alpha = prog.NewContinuousVariables(1, "alpha")
    prog.AddLinearCost(np.array([-100.0]), 0.0, alpha)
    prog.AddBoundingBoxConstraint(0.0, 1.0, alpha)
    both = np.concatenate((v_next, alpha))
    prog.AddLinearEqualityConstraint(np.hstack((J, -V.reshape(-1, 1))), np.zeros(V.size), both)
    if len(P):
        prog.Add2NormSquaredCost(P, wanted, v_next)
    for rows, low, high in limits:
        prog.AddLinearConstraint(rows, low, high, v_next)
    result = Solve(prog, None, options)
    return result.GetSolution(both) if result.is_success() else None


def nullspace_rows(J: np.ndarray) -> np.ndarray:
    """Rows that span the nullspace of J: in each, one of the velocities that elimination leaves free is one.

    Gauss elimination with complete pivoting, as in Drake; this fixes how much the pull to the nominal positions weighs.
    """
    n = J.shape[1]
    call, U, P = _nullspaces.of(*J.shape)
    U[:] = J
    return P[: n - call()].copy()


def _bound_nullspace(m: int, n: int) -> tuple[Bound, np.ndarray, np.ndarray]:
    U, P = np.zeros((m, n)), np.zeros((n, n))
    return nullspace.bind(U, np.zeros(n, dtype=np.int64), P), U, P


_nullspaces = BoundCalls(_bound_nullspace)


def _limits(
    q: np.ndarray, v: np.ndarray, parameters: DifferentialInverseKinematicsParameters, N: ArrayLike | None
) -> Rows:
    dt = parameters.get_time_step()
    positions, velocities, accelerations = (parameters._limits[k] for k in ("position", "velocity", "acceleration"))
    limits, boxes = [], []
    if positions is not None:
        if N is None and q.size != v.size:
            raise RuntimeError("DoDifferentialInverseKinematics(): N is needed where positions are no velocities.")
        low, high = (positions.lower - q) / dt, (positions.upper - q) / dt
        if N is None:
            boxes.append((low, high))
        else:
            limits.append((np.asarray(N, dtype=float), low, high))
    if velocities is not None:
        boxes.append(velocities)
    if accelerations is not None:
        boxes.append((v + dt * accelerations.lower, v + dt * accelerations.upper))
    if boxes:
        low, high = boxes[0]
        for lower, upper in boxes[1:]:
            low, high = np.maximum(low, lower), np.minimum(high, upper)
        limits.append((np.eye(v.size), low, high))
    return limits


def _from_velocity(
    robot: MultibodyPlant,
    context: Context,
    V_AE: np.ndarray,
    frame_A: Frame,
    frame_E: Frame,
    parameters: DifferentialInverseKinematicsParameters,
) -> DifferentialInverseKinematicsResult:
    """For a velocity of E in A, given in A."""
    wrt = JacobianWrtVariable.kV
    J = robot.CalcJacobianSpatialVelocity(context, wrt, frame_E, np.zeros(3), frame_A, frame_E)
    R_EA = robot.CalcRelativeTransform(context, frame_E, frame_A).rotation().matrix()
    V_E = np.concatenate((R_EA @ V_AE[:3], R_EA @ V_AE[3:]))
    keep = parameters._flag
    N = Nplus = None
    if not robot.IsVelocityEqualToQDot():
        N, Nplus = (M.toarray() for M in (robot.MakeVelocityToQDotMap(context), robot.MakeQDotToVelocityMap(context)))
    q, v = robot.GetPositions(context), robot.GetVelocities(context)
    return _from_jacobian(np.array(q), np.array(v), V_E[keep], J[keep], parameters, N, Nplus)


def pose_difference(X: RigidTransform, X_desired: RigidTransform) -> np.ndarray:
    """Rotation vector and translation from one pose to another, in the frame of both, shape (6,)."""
    turn = X_desired.rotation().matrix() @ X.rotation().matrix().T
    angle, *axis = quaternion_to_angle_axis(matrix_to_canonical_quaternion(turn))
    return np.concatenate(([angle * x for x in axis], X_desired.translation() - X.translation()))


def _from_pose(
    robot: MultibodyPlant,
    context: Context,
    X_AE_desired: RigidTransform,
    frame_A: Frame,
    frame_E: Frame,
    parameters: DifferentialInverseKinematicsParameters,
) -> DifferentialInverseKinematicsResult:
    X_AE = robot.CalcRelativeTransform(context, frame_A, frame_E)
    V = pose_difference(X_AE, X_AE_desired) / parameters.get_time_step()
    speed = np.linalg.norm(V[:3])
    if speed > parameters._angular_limit:
        V[:3] *= parameters._angular_limit / speed
    if parameters._translational is not None:
        V[3:] = np.clip(V[3:], *parameters._translational)
    return _from_velocity(robot, context, V, frame_A, frame_E, parameters)


def _in_world(function: Callable[..., Any]) -> Callable[..., Any]:
    """The function with the world in the place of frame A."""
    return lambda robot, context, desired, *rest: function(robot, context, desired, robot.world_frame(), *rest)


@kind("SpatialVelocity | float array of shape (6,)")
def _spatial_velocity(value: SpatialVelocity | ArrayLike) -> np.ndarray:
    try:
        return np.asarray(value.get_coeffs() if hasattr(value, "get_coeffs") else value, dtype=float).reshape(6)
    except (TypeError, ValueError):
        raise Mismatch from None


_ROBOT = {"robot": PLANT, "context": anything}
_POSE = instance_of(RigidTransform)
_PARAMETERS = {"parameters": called("DifferentialInverseKinematicsParameters")}


@overloaded(
    overload(
        q_current=vector,
        v_current=vector,
        V=vector,
        J=matrix,
        **_PARAMETERS,
        N=(anything, None),
        Nplus=(anything, None),
    ),
    overload(_in_world(_from_pose), **_ROBOT, X_WE_desired=_POSE, frame_E=FRAME, **_PARAMETERS),
    overload(_in_world(_from_velocity), **_ROBOT, V_WE_desired=_spatial_velocity, frame_E=FRAME, **_PARAMETERS),
    overload(_from_pose, **_ROBOT, X_AE_desired=_POSE, frame_A=FRAME, frame_E=FRAME, **_PARAMETERS),
    overload(_from_velocity, **_ROBOT, V_AE_desired=_spatial_velocity, frame_A=FRAME, frame_E=FRAME, **_PARAMETERS),
)
def DoDifferentialInverseKinematics(
    q: np.ndarray,
    v: np.ndarray,
    V: np.ndarray,
    J: np.ndarray,
    parameters: DifferentialInverseKinematicsParameters,
    N: ArrayLike | None,
    Nplus: ArrayLike | None,
) -> DifferentialInverseKinematicsResult:
    """Returns velocities of joints that move an end effector E in a wanted direction, as fast as limits allow.

    Called as

    - `(q_current, v_current, V, J, parameters, N=None, Nplus=None)`: J v = alpha V with the largest alpha <= 1;
    - `(robot, context, V_WE_desired, frame_E, parameters)` or `(robot, context, V_AE_desired, frame_A, frame_E,
      parameters)`: for a spatial velocity, shape (6,) or SpatialVelocity;
    - the same with `X_WE_desired` or `X_AE_desired`: for a pose to be reached in one time step.

    Raises:
        TypeError: the arguments are none of these.
        RuntimeError: sizes differ.
    """
    return _from_jacobian(q, v, V, J.reshape(V.size, -1), parameters, N, Nplus)
