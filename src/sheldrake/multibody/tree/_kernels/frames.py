"""Poses as (Mat3, Vec3) pairs, and the frames fixed to bodies."""

from __future__ import annotations

from sheldrake.common._kernels.vec import add3, compose, read3, read9, rotate, rotate_back, sub3, transpose
from sheldrake.common.kernel import kernel


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
def point_on(work, b, p_BP):
    """p_WP of a point fixed to a body [m]."""
    return add3(work[b].p_WB, rotate(work[b].R_WB, p_BP))


@kernel
def from_root(model, work, b, p_WP):
    """p_RootP: a point as seen from the reference point of a body, see `model`."""
    return sub3(p_WP, work[model.bodies[b].root].p_WB)


@kernel
def fixed_pose(model, p, f):
    """Pose of a frame of the model on what it is fixed to."""
    at = model.frames[f].pose
    return (read9(p, at), read3(p, at + 9))


@kernel
def frame_pose(model, p, f):
    """X_BF of a frame of the model on its body."""
    if model.frames[f].parent >= 0:
        return pose_through_frames(model, p, f)
    return fixed_pose(model, p, f)


@kernel(outline=True)
def pose_through_frames(model, p, f):
    """`frame_pose` of a frame that is fixed to other frames."""
    X_XF = fixed_pose(model, p, f)
    outer = model.frames[f].parent
    while outer >= 0:
        X_XF = compose_pose(fixed_pose(model, p, outer), X_XF)
        outer = model.frames[outer].parent
    return X_XF


@kernel
def pose_of_frame(model, p, work, b, f):
    """X_WF of a frame on body b; frame -1 is the body frame."""
    X_WF = work[b].X_WB
    if f >= 0:
        X_WF = compose_pose(X_WF, frame_pose(model, p, f))
    return X_WF
