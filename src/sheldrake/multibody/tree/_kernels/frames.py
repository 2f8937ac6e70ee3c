"""Poses as (Mat3, Vec3) pairs, and the frames fixed to bodies."""

from __future__ import annotations

from sheldrake.common._kernels.vec import add3, compose, load3_at, load9, read3, rotate, rotate_back, sub3, transpose
from sheldrake.common.kernel import kernel
from sheldrake.multibody.tree._kernels.model import FRAME_PARENT, FRAME_POSE


@kernel
def read9(p, k):
    return (p[k], p[k + 1], p[k + 2], p[k + 3], p[k + 4], p[k + 5], p[k + 6], p[k + 7], p[k + 8])


@kernel
def load_pose(X, row):
    return (load9(X, row), load3_at(X, row, 9))


@kernel
def store_pose(X, row, R, p):
    X[row, 0] = R[0]
    X[row, 1] = R[1]
    X[row, 2] = R[2]
    X[row, 3] = R[3]
    X[row, 4] = R[4]
    X[row, 5] = R[5]
    X[row, 6] = R[6]
    X[row, 7] = R[7]
    X[row, 8] = R[8]
    X[row, 9] = p[0]
    X[row, 10] = p[1]
    X[row, 11] = p[2]


@kernel
def compose_pose(X_AB, X_BC):
    R_AB, p_AB = X_AB
    R_BC, p_BC = X_BC
    return (compose(R_AB, R_BC), add3(p_AB, rotate(R_AB, p_BC)))


@kernel
def remove_pose(X_AC, X_BC):
    """X_AB, given where a frame C fixed to B is in A and in B."""
    R_AC, p_AC = X_AC
    R_BC, p_BC = X_BC
    R_AB = compose(R_AC, transpose(R_BC))
    return (R_AB, sub3(p_AC, rotate(R_AB, p_BC)))


@kernel
def relative_pose(X_WA, X_WB):
    """X_AB of two poses in W."""
    R_WA, p_WA = X_WA
    R_WB, p_WB = X_WB
    return (compose(transpose(R_WA), R_WB), rotate_back(R_WA, sub3(p_WB, p_WA)))


@kernel
def fixed_pose(model, p, frame):
    """Pose of a row of `TreeModel.frame` on what it is fixed to."""
    at = model.frame[frame, FRAME_POSE]
    return (read9(p, at), read3(p, at + 9))


@kernel
def frame_pose(model, p, frame):
    """X_BF of a row of `TreeModel.frame` on its body."""
    if model.frame[frame, FRAME_PARENT] >= 0:
        return pose_through_frames(model, p, frame)
    return fixed_pose(model, p, frame)


@kernel(outline=True)
def pose_through_frames(model, p, frame):
    """`frame_pose` of a frame that is fixed to other frames."""
    at = model.frame[frame, FRAME_POSE]
    R_XF = read9(p, at)
    p_XF = read3(p, at + 9)
    outer = model.frame[frame, FRAME_PARENT]
    while outer >= 0:
        at = model.frame[outer, FRAME_POSE]
        R_YX = read9(p, at)
        p_XF = add3(read3(p, at + 9), rotate(R_YX, p_XF))
        R_XF = compose(R_YX, R_XF)
        outer = model.frame[outer, FRAME_PARENT]
    return (R_XF, p_XF)


@kernel
def pose_of_frame(model, p, X_WB, body, frame):
    """X_WF of a frame on a body row; frame -1 is the body frame."""
    X_WF = load_pose(X_WB, body)
    if frame >= 0:
        X_WF = compose_pose(X_WF, frame_pose(model, p, frame))
    return X_WF
