"""Jacobians of velocities with respect to v, by walking from a body to the base of its tree."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from sheldrake.common._kernels.vec import (
    add3,
    column3,
    cross3,
    read3,
    rotate,
    rotate_back,
    scale3,
    store_column3,
    sub3,
    write3,
)
from sheldrake.common.kernel import IntVector, Matrix, Vector, kernel
from sheldrake.common.record import Record, integer, numbers, table
from sheldrake.multibody.tree._kernels.kinematics import from_root, pose_of_frame, relative_pose, velocity_at
from sheldrake.multibody.tree._kernels.model import TreeModel, TreeWork


class Ends(Record):
    """Rows of bodies, and frames on them; frame -1 is the body frame."""

    body_A = integer("against what B moves, or where it is")
    frame_A = integer("")
    body_B = integer("what moves, or is there")
    frame_B = integer("")
    body_E = integer("in what the motion is expressed")
    frame_E = integer("")


@table
class Frames(NamedTuple):
    """Of whose motion a Jacobian is, and of what a pose."""

    place: Annotated[IntVector, Ends]


class FramePose(Record):
    """Where a frame is."""

    X_AB = numbers((9, 3), "rotation and position of frame B in frame A", "-, m")


@table
class RelativePose(NamedTuple):
    """A pose, in the only row of X."""

    X: Annotated[Matrix, FramePose]


@kernel
def clear(J):
    for r in range(J.shape[0]):
        for k in range(J.shape[1]):
            J[r, k] = 0.0


@kernel
def add_column3(J, r, k, a):
    """Adds to column k of the three rows from r on."""
    store_column3(J, r, k, add3(column3(J, r, k), a))


@kernel
def add_body_jacobian(model: TreeModel, work: TreeWork, b: int, p_WQ, sign: float, J: Matrix) -> None:
    """Adds sign times the spatial velocity Jacobian of the body-fixed point at p_WQ to J, shape (6, nv)."""
    p_RootQ = from_root(model, work, b, p_WQ)
    k = model.bodies[b].tip
    while k >= 0:
        w, u = work.dofs[k].S
        add_column3(J, 0, k, scale3(w, sign))
        add_column3(J, 3, k, scale3(add3(u, cross3(w, p_RootQ)), sign))
        k = model.dofs[k].parent


@kernel(top=True, short_loops=True)
def calc_relative_jacobian(model: TreeModel, work: TreeWork, ends: Frames, point: Vector, J: Matrix) -> None:
    """Spatial velocity Jacobian of a point Q of body B measured in body A, expressed in W; needs `position_kinematics`.

    Args:
        model: The tree.
        work: Its workspace.
        ends: B and A; not their frames.
        point: p_WQ [m], shape (3,).
        J: Filled, shape (6, nv).
    """
    clear(J)
    p_WQ = read3(point, 0)
    add_body_jacobian(model, work, ends.body_B, p_WQ, 1.0, J)
    add_body_jacobian(model, work, ends.body_A, p_WQ, -1.0, J)


@kernel(top=True, short_loops=True)
def calc_frame_jacobian(model: TreeModel, p: Vector, work: TreeWork, ends: Frames, point: Vector, J: Matrix) -> None:
    """Spatial velocity Jacobian of a point of frame B measured in frame A, expressed in E; needs `position_kinematics`.

    Args:
        model: The tree.
        p: Parameters.
        work: Its workspace.
        ends: B, A and E.
        point: p_BoBp_B [m], shape (3,).
        J: Filled, shape (6, nv).
    """
    clear(J)
    R_WB, p_WB = pose_of_frame(model, p, work, ends.body_B, ends.frame_B)
    p_WQ = add3(p_WB, rotate(R_WB, read3(point, 0)))
    add_body_jacobian(model, work, ends.body_B, p_WQ, 1.0, J)
    add_body_jacobian(model, work, ends.body_A, p_WQ, -1.0, J)
    if ends.body_E > 0 or ends.frame_E >= 0:
        R_WE, _ = pose_of_frame(model, p, work, ends.body_E, ends.frame_E)
        for k in range(len(model.dofs)):
            store_column3(J, 0, k, rotate_back(R_WE, column3(J, 0, k)))
            store_column3(J, 3, k, rotate_back(R_WE, column3(J, 3, k)))


@kernel
def motion_at(model, work, b, p_WQ):
    """Velocity and bias acceleration of the point fixed to body b that is now at p_WQ: both spatial, in W."""
    V = velocity_at(model, work, b, p_WQ)
    w, v_Q = V
    alpha, a_Root = work[b].A_WB
    a_Q = add3(add3(a_Root, cross3(alpha, from_root(model, work, b, p_WQ))), cross3(w, v_Q))
    return V, (alpha, a_Q)


@kernel(top=True, short_loops=True)
def calc_bias_acceleration(model: TreeModel, p: Vector, work: TreeWork, ends: Frames, point: Vector, A: Vector) -> None:
    """The part that does not depend on vdot of the acceleration that `calc_frame_jacobian` has the velocity of.

    Args:
        model: The tree.
        p: Parameters.
        work: Its workspace, after `velocity_kinematics`.
        ends: B, A and E.
        point: p_BoBp_B [m], shape (3,).
        A: Filled, shape (6,).
    """
    R_WB, p_WB = pose_of_frame(model, p, work, ends.body_B, ends.frame_B)
    p_WQ = add3(p_WB, rotate(R_WB, read3(point, 0)))
    (w_B, v_B), (alpha, a) = motion_at(model, work, ends.body_B, p_WQ)
    if ends.body_A > 0:
        (w_A, v_A), (alpha_A, a_A) = motion_at(model, work, ends.body_A, p_WQ)
        alpha = sub3(sub3(alpha, alpha_A), cross3(w_A, sub3(w_B, w_A)))
        a = sub3(sub3(a, a_A), scale3(cross3(w_A, sub3(v_B, v_A)), 2.0))
    if ends.body_E > 0 or ends.frame_E >= 0:
        R_WE, _ = pose_of_frame(model, p, work, ends.body_E, ends.frame_E)
        alpha = rotate_back(R_WE, alpha)
        a = rotate_back(R_WE, a)
    for i in range(3):
        A[i] = alpha[i]
        A[3 + i] = a[i]


@kernel(top=True, short_loops=True)
def calc_relative_pose(model: TreeModel, p: Vector, work: TreeWork, ends: Frames, pose: RelativePose) -> None:
    """X_AB of frame B in frame A; needs `position_kinematics`."""
    X_WA = pose_of_frame(model, p, work, ends.body_A, ends.frame_A)
    pose[0].X_AB = relative_pose(X_WA, pose_of_frame(model, p, work, ends.body_B, ends.frame_B))


@kernel(top=True, short_loops=True)
def calc_point_position(
    model: TreeModel, p: Vector, work: TreeWork, ends: Frames, point: Vector, position: Vector
) -> None:
    """Position in frame A [m] of a point of frame B, both of shape (3,); needs `position_kinematics`."""
    X_WA = pose_of_frame(model, p, work, ends.body_A, ends.frame_A)
    R_AB, p_AB = relative_pose(X_WA, pose_of_frame(model, p, work, ends.body_B, ends.frame_B))
    write3(position, 0, add3(p_AB, rotate(R_AB, read3(point, 0))))


@kernel(top=True, short_loops=True)
def calc_momentum_jacobian(model: TreeModel, work: TreeWork, mask: IntVector, J: Matrix) -> None:
    """Jacobian of the linear momentum of the masked bodies, in W [kg, kg m], shape (3, nv); needs `body_inertias`."""
    clear(J)
    for b in range(1, len(model.bodies)):
        if mask[b] != 0:
            body = work[b]
            k = model.bodies[b].tip
            while k >= 0:
                w, u = work.dofs[k].S
                add_column3(J, 0, k, add3(scale3(u, body.mass), cross3(w, body.first_moment)))
                k = model.dofs[k].parent
