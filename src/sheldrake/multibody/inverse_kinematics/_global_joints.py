"""Linear and conic constraints on poses of neighbouring bodies, and joint positions from such poses."""

from __future__ import annotations

import itertools
import math
from typing import Any, NamedTuple

import numpy as np


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


def turned(v_B: Any) -> np.ndarray:
    """T with R v_B = T x for x the columns of R, one after another; shape (3, 9)."""
    return np.kron(np.asarray(v_B, dtype=float), np.eye(3))


def placed(p_BQ: Any) -> np.ndarray:
    """T with p_WQ = T x for x the variables of B's pose; shape (3, 12)."""
    return np.hstack((np.eye(3), turned(p_BQ)))


def split(A: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """B, c, y with A x = B y + c, where y are the variables among x; its other elements are numbers: the world's."""
    is_variable = np.array([not isinstance(v, float) for v in x])
    return A[:, is_variable], A[:, ~is_variable] @ x[~is_variable].astype(float), x[is_variable]


def parts(joint: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """R_PF, p_PF, R_BM, p_BM: where the joint's frames are on its parent and on its child."""
    X_PF = joint.frame_on_parent().GetFixedPoseInBodyFrame()
    X_BM = joint.frame_on_child().GetFixedPoseInBodyFrame()
    return X_PF.rotation().matrix(), X_PF.translation(), X_BM.rotation().matrix(), X_BM.translation()


def require_supported(joint: Any) -> None:
    """Raises RuntimeError for a joint that is neither a weld, nor a revolute joint, nor that of a free body."""
    kind = joint.type_name()
    if kind not in ("quaternion_floating", "revolute", "weld"):
        raise RuntimeError(f"GlobalInverseKinematics(): joint {joint.name()!r} is of unsupported type {kind!r}.")


def add_joint(prog: Any, joint: Any, P: BodyPose, B: BodyPose) -> None:
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


def cosine_row(joint: Any, lower: float, upper: float, R_WP: np.ndarray) -> np.ndarray:
    """A with A x = 2 cos + 1, for x the columns of the child's rotation matrix and the angle from the middle one."""
    R_PF, _, R_BM, _ = parts(joint)
    R_middle = R_WP @ R_PF @ middle_rotation(joint, lower, upper) @ R_BM.T
    return R_middle.T.reshape(1, 9)


def bound_length(prog: Any, A: np.ndarray, limit: float, x: np.ndarray, linear: bool) -> None:
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
