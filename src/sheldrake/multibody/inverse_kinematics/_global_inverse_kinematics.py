"""Inverse kinematics that finds a posture wherever it is, by mixed-integer convex programs."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._options import Options as _Options
from sheldrake.common.eigen_geometry import Quaternion
from sheldrake.math import RigidTransform, RotationMatrix
from sheldrake.multibody.tree import BodyIndex
from sheldrake.solvers import (
    IntervalBinning,
    MathematicalProgram,
    MathematicalProgramResult,
    MixedIntegerRotationConstraintGenerator,
    Solve,
)

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.multibody.plant import MultibodyPlant
    from sheldrake.multibody.tree import Joint
    from sheldrake.solvers import Binding
    from sheldrake.solvers._functions.bindings import BindingBase
    from sheldrake.solvers._functions.constraints import LinearConstraint


class BodyPose(NamedTuple):
    """Variables of a body's pose in the world.

    Attributes:
        R: Rotation matrix, shape (3, 3).
        p: Position of its origin, shape (3,).
    """

    R: np.ndarray
    p: np.ndarray

    def variables(self) -> np.ndarray:
        """The position, then the columns of the rotation matrix, shape (12,)."""
        return np.concatenate((self.p, self.R.T.ravel()))


def turned(v_B: ArrayLike) -> np.ndarray:
    """T with R v_B = T x for x the columns of R, one after another; shape (3, 9)."""
    return np.kron(np.asarray(v_B, dtype=float), np.eye(3))


def placed(p_BQ: ArrayLike) -> np.ndarray:
    """T with p_WQ = T x for x the variables of B's pose; shape (3, 12)."""
    return np.hstack((np.eye(3), turned(p_BQ)))


def split(A: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """B, c, y with A x = B y + c, where y are the variables among x; its other elements are numbers: the world's."""
    is_variable = np.array([not isinstance(v, float) for v in x])
    return A[:, is_variable], A[:, ~is_variable] @ x[~is_variable].astype(float), x[is_variable]


def parts(joint: Joint) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """R_PF, p_PF, R_BM, p_BM: where the joint's frames are on its parent and on its child."""
    X_PF = joint.frame_on_parent().GetFixedPoseInBodyFrame()
    X_BM = joint.frame_on_child().GetFixedPoseInBodyFrame()
    return X_PF.rotation().matrix(), X_PF.translation(), X_BM.rotation().matrix(), X_BM.translation()


def require_supported(joint: Joint) -> None:
    """Raises RuntimeError for a joint that is neither a weld, nor a revolute joint, nor that of a free body."""
    kind = joint.type_name()
    if kind not in ("quaternion_floating", "revolute", "weld"):
        raise RuntimeError(f"GlobalInverseKinematics(): joint {joint.name()!r} is of unsupported type {kind!r}.")


def add_joint(prog: MathematicalProgram, joint: Any, P: BodyPose, B: BodyPose) -> None:
    """Adds that a body is where its joint lets it be."""
    kind = joint.type_name()
    if kind == "quaternion_floating":
        return
    R_PF, p_PF, R_BM, p_BM = parts(joint)
    p_FM, R_FM, axes = np.zeros(3), np.eye(3), [joint.revolute_axis()] if kind == "revolute" else list(np.eye(3))
    if kind == "weld":
        p_FM, R_FM = joint.X_FM().translation(), joint.X_FM().rotation().matrix()
    rotations = np.concatenate((P.R.T.ravel(), B.R.T.ravel()))
    for a_M in axes:  # They are fixed in both bodies.
        A, c, x = split(np.hstack((turned(R_PF @ R_FM @ a_M), -turned(R_BM @ a_M))), rotations)
        prog.AddLinearEqualityConstraint(A, -c, x)
    both = np.concatenate((P.variables(), B.variables()))
    A, c, x = split(np.hstack((placed(p_PF + R_PF @ p_FM), -placed(p_BM))), both)
    prog.AddLinearEqualityConstraint(A, -c, x)


def _across(axis: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two unit vectors that make a right-handed frame with an axis."""
    u = np.cross(np.eye(3)[0], axis)
    if np.linalg.norm(u) < math.sqrt(2.0) / 3.0:
        u = np.cross(np.eye(3)[1], axis)
    u /= np.linalg.norm(u)
    return u, np.cross(axis, u)


def middle_rotation(joint: Any, lower: float, upper: float) -> np.ndarray:
    """R_FM of a revolute joint in the middle of an interval of angles [rad]."""
    axis, angle = np.asarray(joint.revolute_axis(), dtype=float), 0.5 * (lower + upper)
    u, v = _across(axis)
    R, c, s = np.column_stack((u, v, axis)), math.cos(angle), math.sin(angle)
    return R @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ R.T


def limit_rows(joint: Any, lower: float, upper: float) -> tuple[list[np.ndarray], float] | None:
    """Vectors A x, of the columns of both rotation matrices, and how long they may be; None: all angles are allowed.

    A vector across the axis, turned by the middle angle with the parent, is at most a chord away from the child's.
    """
    half = 0.5 * (upper - lower)
    if half >= math.pi:
        return None
    R_PF, _, R_BM, _ = parts(joint)
    u, v = _across(np.asarray(joint.revolute_axis(), dtype=float))
    R_middle = middle_rotation(joint, lower, upper)
    diagonal = math.sqrt(0.5)
    directions = (u, v, diagonal * (u + v), diagonal * (u - v))
    rows = [np.hstack((turned(R_PF @ R_middle @ w), -turned(R_BM @ w))) for w in directions]
    return rows, 2.0 * math.sin(0.5 * half)


def cosine_row(joint: Joint, lower: float, upper: float, R_WP: np.ndarray) -> np.ndarray:
    """A with A x = 2 cos + 1, for x the columns of the child's rotation matrix and the angle from the middle one."""
    R_PF, _, R_BM, _ = parts(joint)
    R_middle = R_WP @ R_PF @ middle_rotation(joint, lower, upper) @ R_BM.T
    return R_middle.T.reshape(1, 9)


def bound_length(prog: MathematicalProgram, A: np.ndarray, limit: float, x: np.ndarray, linear: bool) -> None:
    """Adds |A x| <= limit, or bounds of sums of one, two or three elements of A x, which follow from it."""
    A, c, x = split(A, x)
    if not linear:
        prog.AddLorentzConeConstraint(np.vstack((np.zeros(A.shape[1]), A)), np.append(limit, c), x)
        return
    signs = [s for s in itertools.product((1, 0, -1), repeat=3) if next((k for k in s if k), 0) > 0]
    M = np.array(signs, dtype=float)
    reach = limit * np.sqrt(np.abs(M).sum(axis=1))
    prog.AddLinearConstraint(M @ A, -reach - M @ c, reach - M @ c, x)


def nearest_rotation(R: np.ndarray) -> np.ndarray:
    """The rotation matrix nearest to any matrix."""
    U, _, Vt = np.linalg.svd(R)
    return U @ np.diag([1.0, 1.0, np.linalg.det(U @ Vt)]) @ Vt


def joint_angle(joint: Any, R_WP: np.ndarray, R_WB: np.ndarray) -> float:
    """The angle of a revolute joint, within its limits, that fits the rotations of parent and child best [rad]."""
    R_PF, _, R_BM, _ = parts(joint)
    a = np.asarray(joint.revolute_axis(), dtype=float)
    R_FM = R_PF.T @ R_WP.T @ R_WB @ R_BM
    skew = np.array([R_FM[2, 1] - R_FM[1, 2], R_FM[0, 2] - R_FM[2, 0], R_FM[1, 0] - R_FM[0, 1]])
    angle = math.atan2(a @ skew, np.trace(R_FM) - a @ R_FM @ a)
    low, high = float(joint.position_lower_limits()[0]), float(joint.position_upper_limits()[0])
    candidates = [angle + 2.0 * math.pi * k for k in (0, -1, 1) if low <= angle + 2.0 * math.pi * k <= high]
    return candidates[0] if candidates else min((low, high), key=lambda end: 1.0 - math.cos(end - angle))


def _about(axis: np.ndarray, angle: float) -> Quaternion:
    return Quaternion(np.append(math.cos(0.5 * angle), math.sin(0.5 * angle) * np.asarray(axis, dtype=float)))


_Approach = MixedIntegerRotationConstraintGenerator.Approach


@checked
class GlobalInverseKinematics:
    """A program for the poses of all bodies of a plant, whose rotations are relaxed.

    Where it has no solution there is no posture; a solution is near one (Dai, Izatt and Tedrake, Global inverse
    kinematics via mixed-integer convex optimization, 2019). Joints are welds, revolute, or those of free bodies.
    A solver for mixed-integer linear programs is here: with `linear_constraint_only` it suffices.

    Args:
        plant: The plant.
        options: How rotations are relaxed.

    Raises:
        RuntimeError: the plant is not finalized, or has a joint of another kind.
    """

    class Options(_Options):
        """How rotations are relaxed.

        Attributes:
            num_intervals_per_half_axis: Into how many intervals [0, 1] is cut.
            approach: What is relaxed; see `MixedIntegerRotationConstraintGenerator`.
            interval_binning: How binary variables say which interval is meant.
            linear_constraint_only: Whether there are no conic constraints: looser, and faster to solve.
        """

        num_intervals_per_half_axis: int = 2
        approach: _Approach = _Approach.kBilinearMcCormick
        interval_binning: IntervalBinning = IntervalBinning.kLogarithmic
        linear_constraint_only: bool = False

        def __repr__(self) -> str:
            fields = ", ".join(f"{name}={getattr(self, name)}" for name in self._defaults)
            return f"GlobalInverseKinematics.Options({fields})"

    class Polytope3D:
        """The points x with A x <= b.

        Args:
            A: Shape (n, 3).
            b: Shape (n,).
        """

        def __init__(self, A: ArrayLike, b: ArrayLike):
            self.A, self.b = np.array(A, dtype=float).reshape(-1, 3), np.array(b, dtype=float).ravel()

        def __repr__(self) -> str:
            return f"GlobalInverseKinematics.Polytope3D(A={self.A}, b={self.b})"

    def __init__(self, plant: MultibodyPlant, options: Options | None = None):
        if not plant.is_finalized():
            raise RuntimeError("GlobalInverseKinematics(): the plant is not finalized.")
        self._plant, self._options = plant, options if options is not None else self.Options()
        self._prog = MathematicalProgram()
        self._lengths: list[tuple[np.ndarray, np.ndarray, Any, np.ndarray]] = []
        everything = [plant.get_joint(i) for i in plant.GetJointIndices()]
        for joint in everything:
            require_supported(joint)
        self._inboard = {int(joint.child_body().index()): joint for joint in everything}
        self._poses = [BodyPose(np.eye(3), np.zeros(3))]
        self._fixed = {0: np.eye(3)}
        for i in range(1, plant.num_bodies()):
            name = plant.get_body(BodyIndex(i)).name()
            R = self._prog.NewContinuousVariables(3, 3, f"{name}_R")
            p = self._prog.NewContinuousVariables(3, f"{name}_pos")
            self._poses.append(BodyPose(R, p))
        generator = MixedIntegerRotationConstraintGenerator(
            self._options.approach, self._options.num_intervals_per_half_axis, self._options.interval_binning
        )
        for i in range(1, plant.num_bodies()):
            self._add_body(i, generator)

    def _add_body(self, i: int, generator: MixedIntegerRotationConstraintGenerator) -> None:
        joint, pose, prog = self._inboard[i], self._poses[i], self._prog
        parent = int(joint.parent_body().index())
        if parent == 0 and joint.type_name() == "weld":
            X_PF = joint.frame_on_parent().GetFixedPoseInBodyFrame()
            X_WB = X_PF @ joint.X_FM() @ joint.frame_on_child().GetFixedPoseInBodyFrame().inverse()
            self._fix(prog, pose, X_WB)
            self._fixed[i] = X_WB.rotation().matrix()
            return
        R = pose.R
        prog.AddBoundingBoxConstraint(-1.0, 1.0, R.ravel())
        prog.AddLinearConstraint(np.ones((1, 3)), [-1.0], [3.0], np.diag(R))
        if joint.type_name() != "weld":  # Its rotation is its parent's.
            if not self._options.linear_constraint_only:
                self._add_cones_of_rotation(R)
            generator.AddToProgram(R, prog)
        add_joint(prog, joint, self._poses[parent], pose)
        if joint.type_name() == "revolute":
            lower, upper = joint.position_lower_limits()[0], joint.position_upper_limits()[0]
            self.AddJointLimitConstraint(BodyIndex(i), lower, upper, self._options.linear_constraint_only)

    @staticmethod
    def _fix(prog: MathematicalProgram, pose: BodyPose, X_WB: RigidTransform) -> None:
        value = np.concatenate((X_WB.translation(), X_WB.rotation().matrix().T.ravel()))
        prog.AddBoundingBoxConstraint(value, value, pose.variables())

    def _add_cones_of_rotation(self, R: np.ndarray) -> None:
        """Columns, and rows, have at most length one, sums and differences of two at most the root of two."""
        for lines in (R.T, R):
            for a in lines:
                self._prog.AddRotatedLorentzConeConstraint(
                    np.vstack((np.zeros((2, 3)), np.eye(3))), [1.0, 1.0, 0.0, 0.0, 0.0], a
                )
            for (a, b), sign in itertools.product(itertools.combinations(lines, 2), (1.0, -1.0)):
                A = np.hstack((np.eye(3), sign * np.eye(3)))
                bound_length(self._prog, A, math.sqrt(2.0), np.concatenate((a, b)), linear=False)

    def prog(self) -> MathematicalProgram:
        """Returns the program."""
        return self._prog

    def get_mutable_prog(self) -> MathematicalProgram:
        """Returns the program, to be changed."""
        return self._prog

    def _pose(self, body_index: BodyIndex) -> BodyPose:
        if not 1 <= int(body_index) < self._plant.num_bodies():
            raise RuntimeError(
                f"GlobalInverseKinematics: body index {int(body_index)} is out of range; it must be at least 1 and "
                f"below {self._plant.num_bodies()}."
            )
        return self._poses[int(body_index)]

    def body_rotation_matrix(self, body_index: BodyIndex) -> np.ndarray:
        """Returns the variables of R_WB, shape (3, 3).

        Raises:
            RuntimeError: there is no such body, or it is the world.
        """
        return self._pose(body_index).R

    def body_position(self, body_index: BodyIndex) -> np.ndarray:
        """Returns the variables of p_WBo, shape (3,).

        Raises:
            RuntimeError: there is no such body, or it is the world.
        """
        return self._pose(body_index).p

    # Constraints

    def AddWorldPositionConstraint(
        self,
        body_index: BodyIndex,
        p_BQ: ArrayLike,
        box_lb_F: ArrayLike,
        box_ub_F: ArrayLike,
        X_WF: RigidTransform | None = None,
    ) -> Binding[LinearConstraint]:
        """Adds that a point of a body is in a box.

        Args:
            body_index: The body B.
            p_BQ: The point [m], shape (3,).
            box_lb_F: Lower corner [m].
            box_ub_F: Upper corner [m].
            X_WF: Where the box's frame is; the world's if absent.

        Returns:
            The binding of the linear constraint.
        """
        X_WF = X_WF if X_WF is not None else RigidTransform()
        R_FW, p_WF = X_WF.rotation().matrix().T, X_WF.translation()
        lower, upper = (np.asarray(b, dtype=float) + R_FW @ p_WF for b in (box_lb_F, box_ub_F))
        return self._prog.AddLinearConstraint(R_FW @ placed(p_BQ), lower, upper, self._pose(body_index).variables())

    def AddWorldRelativePositionConstraint(
        self,
        body_index_B: BodyIndex,
        p_BQ: ArrayLike,
        body_index_A: BodyIndex,
        p_AP: ArrayLike,
        box_lb_F: ArrayLike,
        box_ub_F: ArrayLike,
        X_WF: RigidTransform | None = None,
    ) -> Binding[LinearConstraint]:
        """Adds that the way from a point of a body to a point of another one is in a box.

        Args:
            body_index_B: The body B.
            p_BQ: Its point Q [m], shape (3,).
            body_index_A: The body A.
            p_AP: Its point P [m], shape (3,).
            box_lb_F: Lower corner [m].
            box_ub_F: Upper corner [m].
            X_WF: Where the box's frame is; the world's if absent.

        Returns:
            The binding of the linear constraint.
        """
        R_FW = X_WF.rotation().matrix().T if X_WF is not None else np.eye(3)
        A = R_FW @ np.hstack((placed(p_BQ), -placed(p_AP)))
        x = np.concatenate((self._pose(body_index_B).variables(), self._pose(body_index_A).variables()))
        return self._prog.AddLinearConstraint(A, np.asarray(box_lb_F, float), np.asarray(box_ub_F, float), x)

    def AddWorldOrientationConstraint(
        self, body_index: BodyIndex, desired_orientation: Quaternion, angle_tol: float
    ) -> BindingBase[LinearConstraint]:
        """Adds that a body's orientation is at most an angle away from a desired one.

        Args:
            body_index: The body.
            desired_orientation: The desired R_WB.
            angle_tol: The angle [rad].

        Returns:
            The binding of the linear constraint.
        """
        desired = RotationMatrix(desired_orientation).matrix()
        lower = 2.0 * math.cos(angle_tol) + 1.0 if angle_tol < math.pi else -1.0
        x = self._pose(body_index).R.T.ravel()
        return self._prog.AddLinearConstraint(desired.T.reshape(1, 9), [lower], [3.0], x)

    def AddJointLimitConstraint(
        self,
        body_index: BodyIndex,
        joint_lower_bound: float,
        joint_upper_bound: float,
        linear_constraint_approximation: bool = False,
    ) -> None:
        """Adds limits of the revolute joint between a body and its parent; the constructor did for the joint's own.

        Args:
            body_index: The body.
            joint_lower_bound: Lower limit [rad].
            joint_upper_bound: Upper limit [rad].
            linear_constraint_approximation: Whether the constraints are linear, and looser, instead of conic.

        Raises:
            RuntimeError: the lower limit is above the upper one, or the joint is not revolute.
        """
        pose, joint = self._pose(body_index), self._inboard[int(body_index)]
        if joint_lower_bound > joint_upper_bound:
            raise RuntimeError(
                f"AddJointLimitConstraint(): the lower bound {joint_lower_bound} is above the upper one "
                f"{joint_upper_bound}."
            )
        if joint.type_name() != "revolute":
            raise RuntimeError(f"AddJointLimitConstraint(): joint {joint.name()!r} is not revolute.")
        found = limit_rows(joint, float(joint_lower_bound), float(joint_upper_bound))
        if found is None:
            return
        rows, chord = found
        parent = int(joint.parent_body().index())
        x = np.concatenate((self._poses[parent].R.T.ravel(), pose.R.T.ravel()))
        for A in rows:
            bound_length(self._prog, A, chord, x, linear_constraint_approximation)
        if parent in self._fixed:  # Where the parent's rotation is known, the angle's cosine is linear in the child's.
            A = cosine_row(joint, joint_lower_bound, joint_upper_bound, self._fixed[parent])
            self._prog.AddLinearConstraint(A, [3.0 - chord**2], [np.inf], x[9:])

    def AddPostureCost(
        self, q_desired: ArrayLike, body_position_cost: ArrayLike, body_orientation_cost: ArrayLike
    ) -> None:
        """Adds the distances to the poses of a desired posture: of origins, and 1 - cos of angles.

        Args:
            q_desired: The posture, shape (nq,).
            body_position_cost: Weight for each body [1/m], shape (num_bodies,).
            body_orientation_cost: Weight for each body, shape (num_bodies,).

        Raises:
            RuntimeError: sizes differ, or a weight is negative.
        """
        count, weights = self._plant.num_bodies(), []
        for name, value in (
            ("body_position_cost", body_position_cost),
            ("body_orientation_cost", body_orientation_cost),
        ):
            array = np.array(value, dtype=float).ravel()
            if array.size != count:
                raise RuntimeError(f"{name} should have {count} rows.")
            if array.min() < 0.0:
                raise RuntimeError(f"{name}({int(array.argmin())}) is negative.")
            weights.append(array)
        errors = self._prog.NewContinuousVariables(count - 1, "p_WBo_error")
        self._prog.AddLinearCost(np.ones(count - 1), 0.0, errors)
        for i, X_WB in enumerate(self._kinematics(q_desired), start=1):
            pose, w = self._poses[i], weights[0][i]
            A = np.zeros((4, 4))
            A[0, 0], A[1:, 1:] = 1.0, w * np.eye(3)
            b = np.append(0.0, -w * X_WB.translation())
            self._prog.AddLorentzConeConstraint(A, b, np.append(errors[i - 1], pose.p))
            self._lengths.append((A[1:, 1:], b[1:], errors[i - 1], pose.p))
            turn = weights[1][i]  # cos of the angle is (trace(R_desired' R) - 1) / 2.
            self._prog.AddLinearCost(-0.5 * turn * X_WB.rotation().matrix().T.ravel(), 1.5 * turn, pose.R.T.ravel())

    def BodyPointInOneOfRegions(self, body_index: BodyIndex, p_BQ: ArrayLike, region_vertices: list) -> np.ndarray:
        """Adds that a point of a body is in one of some convex polytopes.

        Args:
            body_index: The body B.
            p_BQ: The point [m], shape (3,).
            region_vertices: The vertices of each polytope [m], shape (3, n).

        Returns:
            A binary variable for each polytope: one for that where the point is.

        Raises:
            RuntimeError: a polytope has less than three vertices.
        """
        pose, name = self._pose(body_index), self._plant.get_body(BodyIndex(int(body_index))).name()
        regions = [np.asarray(V, dtype=float).reshape(3, -1) for V in region_vertices]
        if any(V.shape[1] < 3 for V in regions):
            raise RuntimeError("Each region should have at least 3 vertices.")
        z = self._prog.NewBinaryVariables(len(regions), f"z_{name}")
        self._prog.AddLinearEqualityConstraint(np.ones((1, len(z))), [1.0], z)
        all_weights = []
        for i, V in enumerate(regions):
            w = self._prog.NewContinuousVariables(V.shape[1], f"w_{name}_region_{i}")
            self._prog.AddBoundingBoxConstraint(0.0, 1.0, w)
            self._prog.AddLinearEqualityConstraint(np.append(np.ones(len(w)), -1.0)[None], [0.0], np.append(w, z[i]))
            all_weights.append(w)
        A = np.hstack((placed(p_BQ), -np.hstack(regions)))
        self._prog.AddLinearEqualityConstraint(A, np.zeros(3), np.concatenate((pose.variables(), *all_weights)))
        return z

    def BodySphereInOneOfPolytopes(
        self, body_index: BodyIndex, p_BQ: ArrayLike, radius: float, polytopes: list[Polytope3D]
    ) -> np.ndarray:
        """Adds that a sphere fixed to a body is within one of some bounded polytopes.

        Args:
            body_index: The body B.
            p_BQ: The centre of the sphere [m], shape (3,).
            radius: Its radius [m].
            polytopes: The polytopes.

        Returns:
            A binary variable for each polytope: one for that where the sphere is.

        Raises:
            RuntimeError: the radius is negative.
        """
        if not radius >= 0.0:
            raise RuntimeError(f"BodySphereInOneOfPolytopes(): the radius must not be negative, got {radius}.")
        pose, count = self._pose(body_index), len(polytopes)
        z = self._prog.NewBinaryVariables(count, "z")
        self._prog.AddLinearEqualityConstraint(np.ones((1, count)), [1.0], z)
        y = self._prog.NewContinuousVariables(3, count, "y")
        A = np.hstack((placed(p_BQ), -np.tile(np.eye(3), count)))
        self._prog.AddLinearEqualityConstraint(A, np.zeros(3), np.concatenate((pose.variables(), y.T.ravel())))
        for i, polytope in enumerate(polytopes):
            offset = polytope.b - radius * np.linalg.norm(polytope.A, axis=1)
            rows = np.hstack((polytope.A, -offset[:, None]))
            none = np.full(len(offset), -np.inf)
            self._prog.AddLinearConstraint(rows, none, np.zeros(len(offset)), np.append(y[:, i], z[i]))
        return z

    # ---- the posture

    def _kinematics(self, q: ArrayLike) -> list[RigidTransform]:
        """Poses of all bodies but the world."""
        plant, context = self._plant, self._plant.CreateDefaultContext()
        plant.SetPositions(context, np.asarray(q, dtype=float))
        return [plant.EvalBodyPoseInWorld(context, plant.get_body(BodyIndex(i))) for i in range(1, plant.num_bodies())]

    def SetInitialGuess(self, q: ArrayLike) -> None:
        """Sets the guess of all variables, the binary ones too, to that of a posture.

        Args:
            q: The posture, shape (nq,).

        Raises:
            RuntimeError: the posture violates a constraint.
        """
        linear = MathematicalProgram()
        linear.AddDecisionVariables(self._prog.decision_variables())
        for binding in (
            *self._prog.linear_constraints(),
            *self._prog.linear_equality_constraints(),
            *self._prog.bounding_box_constraints(),
        ):
            linear.AddConstraint(binding.evaluator(), binding.variables())
        for pose, X_WB in zip(self._poses[1:], self._kinematics(q)):
            self._fix(linear, pose, X_WB)
        result = Solve(linear)
        if not result.is_success():
            raise RuntimeError("GlobalInverseKinematics.SetInitialGuess(): the posture violates a constraint.")
        guess = np.array(result.get_x_val())
        place = self._prog.FindDecisionVariableIndex
        for A, b, error, p in self._lengths:
            guess[place(error)] = np.linalg.norm(A @ result.GetSolution(p) + b)
        for cone in (*self._prog.lorentz_cone_constraints(), *self._prog.rotated_lorentz_cone_constraints()):
            x = guess[[place(v) for v in cone.variables()]]
            if not cone.evaluator().CheckSatisfied(x, 1e-6):
                raise RuntimeError("GlobalInverseKinematics.SetInitialGuess(): the posture violates a constraint.")
        self._prog.SetInitialGuessForAllVariables(guess)

    def ReconstructGeneralizedPositionSolution(self, result: MathematicalProgramResult) -> np.ndarray:
        """Returns the posture whose poses fit those of a solution, shape (nq,).

        Angles are within their limits; rotations of a solution are only nearly rotations, so the fit is not exact.

        Args:
            result: A result of solving the program.
        """
        q, done = np.zeros(self._plant.num_positions()), {0: np.eye(3)}
        for i in range(1, self._plant.num_bodies()):
            self._reconstruct(i, result, q, done)
        return q

    def _reconstruct(
        self, i: int, result: MathematicalProgramResult, q: np.ndarray, done: dict[int, np.ndarray]
    ) -> np.ndarray:
        """The rotation of body i, which its joints' positions, put into q, give."""
        if i in done:
            return done[i]
        joint, pose = self._inboard[i], self._poses[i]
        R_WP = self._reconstruct(int(joint.parent_body().index()), result, q, done)
        R_PF, _, R_BM, _ = parts(joint)
        start, R_WB = joint.position_start(), np.array(result.GetSolution(pose.R))
        if joint.type_name() == "weld":
            done[i] = R_WP @ R_PF @ joint.X_FM().rotation().matrix() @ R_BM.T
        elif joint.type_name() == "revolute":
            q[start] = joint_angle(joint, R_WP, R_WB)
            turn = RotationMatrix(_about(joint.revolute_axis(), q[start])).matrix()
            done[i] = R_WP @ R_PF @ turn @ R_BM.T
        else:
            done[i] = nearest_rotation(R_WB)
            q[start : start + 4] = RotationMatrix(R_PF.T @ R_WP.T @ done[i] @ R_BM).ToQuaternion().wxyz()
            q[start + 4 : start + 7] = result.GetSolution(pose.p)
        return done[i]
