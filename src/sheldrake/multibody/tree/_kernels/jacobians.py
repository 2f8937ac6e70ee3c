"""Jacobians of velocities with respect to v, by walking from a body to the base of its tree."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from sheldrake.common._kernels.generic import is_zero
from sheldrake.common._kernels.vec import (
    add3,
    add_inertia,
    column3,
    cross3,
    load6,
    read3,
    rotate,
    rotate_back,
    rotate_symmetric,
    scale3,
    store_column3,
    sub3,
    transpose,
    write3,
    write6,
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


@kernel
def place_of_point(model, p, work, ends, point):
    """p_WQ of a point given in frame B."""
    R_WB, p_WB = pose_of_frame(model, p, work, ends.body_B, ends.frame_B)
    return add3(p_WB, rotate(R_WB, read3(point, 0)))


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
    p_WQ = place_of_point(model, p, work, ends, point)
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


@kernel
def turned(model, p, work, ends, a, b):
    """Two vectors given in W, expressed in E."""
    if ends.body_E > 0 or ends.frame_E >= 0:
        R_WE, _ = pose_of_frame(model, p, work, ends.body_E, ends.frame_E)
        a = rotate_back(R_WE, a)
        b = rotate_back(R_WE, b)
    return a, b


@kernel(top=True, short_loops=True)
def calc_point_velocity(model: TreeModel, p: Vector, work: TreeWork, ends: Frames, point: Vector, V: Vector) -> None:
    """Spatial velocity of a point of frame B measured in frame A, expressed in E; needs `velocity_kinematics`.

    Args:
        model: The tree.
        p: Parameters.
        work: Its workspace.
        ends: B, A and E.
        point: p_BoBp_B [m], shape (3,).
        V: Filled, shape (6,).
    """
    p_WQ = place_of_point(model, p, work, ends, point)
    w, v = velocity_at(model, work, ends.body_B, p_WQ)
    if ends.body_A > 0:
        w_A, v_A = velocity_at(model, work, ends.body_A, p_WQ)
        w, v = sub3(w, w_A), sub3(v, v_A)
    write6(V, 0, turned(model, p, work, ends, w, v))


@kernel
def acceleration_at(work, A_WB, b, p_WQ):
    """Spatial acceleration, in W, of the point fixed to body b that is now at p_WQ, of those of the body origins."""
    body = work[b]
    w, _ = body.V_WB
    alpha, a = load6(A_WB, b)
    r = sub3(p_WQ, body.p_WB)
    return alpha, add3(add3(a, cross3(alpha, r)), cross3(w, cross3(w, r)))


@kernel
def relative_acceleration(V_WQ, A_WQ, V_WP, A_WP):
    """How Q accelerates seen from a body that turns and has at that place the motion of P: all in W."""
    (w, v), (alpha, a), (w_P, v_P), (alpha_P, a_P) = V_WQ, A_WQ, V_WP, A_WP
    alpha = sub3(sub3(alpha, alpha_P), cross3(w_P, sub3(w, w_P)))
    return alpha, sub3(sub3(a, a_P), scale3(cross3(w_P, sub3(v, v_P)), 2.0))


@kernel(top=True, short_loops=True)
def calc_point_acceleration(
    model: TreeModel, p: Vector, work: TreeWork, ends: Frames, A_WB: Matrix, point: Vector, A: Vector
) -> None:
    """Spatial acceleration of the point that `calc_point_velocity` has the velocity of.

    `A_WB` are accelerations of the body origins by row, in W, shape (num_bodies, 6); A is filled, shape (6,).
    """
    p_WQ = place_of_point(model, p, work, ends, point)
    alpha, a = acceleration_at(work, A_WB, ends.body_B, p_WQ)
    if ends.body_A > 0:
        V_WQ = velocity_at(model, work, ends.body_B, p_WQ)
        V_WP = velocity_at(model, work, ends.body_A, p_WQ)
        A_WP = acceleration_at(work, A_WB, ends.body_A, p_WQ)
        alpha, a = relative_acceleration(V_WQ, (alpha, a), V_WP, A_WP)
    write6(A, 0, turned(model, p, work, ends, alpha, a))


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
    p_WQ = place_of_point(model, p, work, ends, point)
    V_WQ, (alpha, a) = motion_at(model, work, ends.body_B, p_WQ)
    if ends.body_A > 0:
        V_WP, A_WP = motion_at(model, work, ends.body_A, p_WQ)
        alpha, a = relative_acceleration(V_WQ, (alpha, a), V_WP, A_WP)
    write6(A, 0, turned(model, p, work, ends, alpha, a))


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
def calc_jacobian_of_centre(model: TreeModel, work: TreeWork, mask: Vector, J: Matrix) -> int:
    """Jacobian of the velocity of the centre of mass of the masked bodies, in W, shape (3, nv); needs `body_inertias`.

    Returns:
        0, or 1 when they have no mass.
    """
    mass = work[0].mass * 0.0
    clear(J)
    for b in range(1, len(model.bodies)):
        if mask[b] != 0.0:
            body = work[b]
            mass = mass + body.mass
            k = model.bodies[b].tip
            while k >= 0:
                w, u = work.dofs[k].S
                add_column3(J, 0, k, add3(scale3(u, body.mass), cross3(w, body.first_moment)))
                k = model.dofs[k].parent
    if is_zero(mass):
        return 1
    for r in range(3):
        for k in range(J.shape[1]):
            J[r, k] = J[r, k] / mass
    return 0


@kernel(top=True, short_loops=True)
def calc_inertia(model: TreeModel, p: Vector, work: TreeWork, mask: Vector, ends: Frames, inertia: Vector) -> int:
    """Mass, centre of mass and unit inertia, by rows, of the masked bodies about the origin of frame A, expressed in A.

    Shape (13,); needs `body_inertias`.

    Returns:
        0, or 1 when they have no mass.
    """
    R_WA, p_WA = pose_of_frame(model, p, work, ends.body_A, ends.frame_A)
    zero = work[0].mass * 0.0
    total = (zero, (zero, zero, zero), (zero, zero, zero, zero, zero, zero))
    for b in range(1, len(model.bodies)):
        if mask[b] != 0.0:
            total = add_inertia(total, seen_from(work[b].inertia, sub3(work[model.bodies[b].root].p_WB, p_WA)))
    mass, moment, second = total
    if is_zero(mass):
        return 1
    inertia[0] = mass
    com = rotate_back(R_WA, moment)
    write3(inertia, 1, (com[0] / mass, com[1] / mass, com[2] / mass))
    xx, yy, zz, xy, xz, yz = rotate_symmetric(transpose(R_WA), second)
    write3(inertia, 4, (xx / mass, xy / mass, xz / mass))
    write3(inertia, 7, (xy / mass, yy / mass, yz / mass))
    write3(inertia, 10, (xz / mass, yz / mass, zz / mass))
    return 0


@kernel
def seen_from(inertia, r):
    """An inertia, its moments about a point, about another point that sees the first at r."""
    mass, (hx, hy, hz), (xx, yy, zz, xy, xz, yz) = inertia
    x, y, z = r
    ax, ay, az = hx + 0.5 * mass * x, hy + 0.5 * mass * y, hz + 0.5 * mass * z
    xax, yay, zaz = 2.0 * x * ax, 2.0 * y * ay, 2.0 * z * az
    second = (
        xx + yay + zaz, yy + xax + zaz, zz + xax + yay,
        xy - x * ay - y * ax, xz - x * az - z * ax, yz - y * az - z * ay,
    )  # fmt: skip
    return (mass, (hx + mass * x, hy + mass * y, hz + mass * z), second)
