"""Poses, motion of the dofs, velocities and bias accelerations, base to tip.

Monogram notation; F is the joint's frame on the inboard body P, M its frame on the body B.
"""

from __future__ import annotations

from sheldrake.common._kernels.generic import cos, sin
from sheldrake.common._kernels.vec import (
    add3,
    add6,
    compose,
    cross3,
    cross_motion,
    load3,
    load3_at,
    load6,
    load9,
    read3,
    read4,
    read6,
    rotate,
    rotation_about,
    rotation_of_quaternion,
    scale3,
    scale6,
    store3_at,
    store6,
    store9,
    sub3,
)
from sheldrake.common.kernel import Matrix, Vector, kernel
from sheldrake.multibody.tree._kernels.frames import (
    compose_pose,
    frame_pose,
    load_pose,
    pose_of_frame,
    remove_pose,
    store_pose,
)
from sheldrake.multibody.tree._kernels.model import (
    AXIS,
    BALL,
    FRAME_F,
    FRAME_M,
    FREE,
    KIND,
    LEAD,
    NV,
    PARENT,
    PLANAR,
    PRISMATIC,
    QUATERNION,
    REVOLUTE,
    ROOT,
    RPY,
    SCREW,
    UNIVERSAL,
    WELD,
    Q,
    TreeModel,
    TreeWork,
    V,
)


@kernel
def position_kinematics(model: TreeModel, p: Vector, work: TreeWork, q: Vector) -> None:
    """Fills `X_WB` and `S`."""
    for body in range(1, model.body.shape[0]):
        kind = model.body[body, KIND]
        at = model.body[body, Q]
        if kind == FREE:
            store_pose(work.X_WB, body, rotation_of_quaternion(read4(q, at)), read3(q, at + 4))
        elif kind <= SCREW:
            position_of_axis_joint(model, p, work, q, body)
        else:
            position_of_wide_joint(model, p, work, q, body)


@kernel
def position_of_axis_joint(model, p, work, q, body):
    """Revolute, prismatic, screw, weld."""
    kind = model.body[body, KIND]
    dof = model.body[body, V]
    X_WF = pose_of_frame(model, p, work.X_WB, model.body[body, PARENT], model.body[body, FRAME_F])
    R_WF, p_WF = X_WF
    axis_F = load3(model.joint, body)
    axis_W = rotate(R_WF, axis_F)
    if kind == WELD:
        R_WM, p_WM = compose_pose(X_WF, (load9(model.joint, body), load3_at(model.joint, body, 9)))
        store_pose(work.X_WB, body, R_WM, p_WM)
    else:
        position = q[model.body[body, Q]]
        store_pose(work.X_WB, body, R_WF, p_WF)
        if kind != PRISMATIC:
            turn_frame(work.X_WB, body, axis_F, model.body[body, AXIS], position)
        if kind != REVOLUTE:
            store3_at(work.X_WB, body, 9, add3(p_WF, scale3(axis_W, model.joint[body, LEAD] * position)))
    p_WM = load3_at(work.X_WB, body, 9)
    to_body_frame(model, p, work, body)
    if kind == PRISMATIC:
        store6(work.S, dof, (scale3(axis_W, 0.0), axis_W))
    elif kind != WELD:
        p_RootM = sub3(p_WM, load3_at(work.X_WB, model.body[body, ROOT], 9))
        along = scale3(axis_W, model.joint[body, LEAD])
        store6(work.S, dof, (axis_W, add3(cross3(p_RootM, axis_W), along)))


@kernel
def turn_frame(X, row, axis, along, angle):
    """Turns the frame in a row about an axis of its own; quick when it is x, y or z (1, 2, 3), as it mostly is."""
    if along == 0:
        store9(X, row, compose(load9(X, row), rotation_about(axis, angle)))
    else:
        s = sin(angle)
        c = cos(angle)
        i = along % 3  # the two axes that move
        j = (along + 1) % 3
        for k in range(3):
            a = X[row, 3 * k + i]
            b = X[row, 3 * k + j]
            X[row, 3 * k + i] = a * c + b * s
            X[row, 3 * k + j] = b * c - a * s


@kernel
def to_body_frame(model, p, work, body):
    """From the pose of the joint's outboard frame M in `X_WB` to that of the body."""
    frame = model.body[body, FRAME_M]
    if frame >= 0:
        R_WB, p_WB = remove_pose(load_pose(work.X_WB, body), frame_pose(model, p, frame))
        store_pose(work.X_WB, body, R_WB, p_WB)


@kernel(outline=True)
def position_of_wide_joint(model: TreeModel, p: Vector, work: TreeWork, q: Vector, body: int) -> None:
    """Joints of two to six degrees of freedom."""
    kind = model.body[body, KIND]
    at = model.body[body, Q]
    dof = model.body[body, V]
    X_WF = pose_of_frame(model, p, work.X_WB, model.body[body, PARENT], model.body[body, FRAME_F])
    R_WF, p_WF = X_WF
    x_W = (R_WF[0], R_WF[3], R_WF[6])
    y_W = (R_WF[1], R_WF[4], R_WF[7])
    z_W = (R_WF[2], R_WF[5], R_WF[8])
    store3_at(work.X_WB, body, 9, p_WF)
    if kind == QUATERNION:
        store9(work.X_WB, body, compose(R_WF, rotation_of_quaternion(read4(q, at))))
        store3_at(work.X_WB, body, 9, add3(p_WF, rotate(R_WF, read3(q, at + 4))))
    elif kind == RPY:
        store9(work.X_WB, body, compose(R_WF, rotation_of_rpy(read3(q, at))))
        store3_at(work.X_WB, body, 9, add3(p_WF, rotate(R_WF, read3(q, at + 3))))
    elif kind == BALL:
        store9(work.X_WB, body, compose(R_WF, rotation_of_rpy(read3(q, at))))
    elif kind == PLANAR:
        store9(work.X_WB, body, compose(R_WF, rotation_about((0.0, 0.0, 1.0), q[at + 2])))
        store3_at(work.X_WB, body, 9, add3(p_WF, add3(scale3(x_W, q[at]), scale3(y_W, q[at + 1]))))
    else:
        y_W = add3(scale3(y_W, cos(q[at])), scale3(z_W, sin(q[at])))
        about_x = rotation_about((1.0, 0.0, 0.0), q[at])
        store9(work.X_WB, body, compose(R_WF, compose(about_x, rotation_about((0.0, 1.0, 0.0), q[at + 1]))))
    p_WM = load3_at(work.X_WB, body, 9)
    to_body_frame(model, p, work, body)
    p_RootM = sub3(p_WM, load3_at(work.X_WB, model.body[body, ROOT], 9))
    still = (0.0, 0.0, 0.0)
    if kind == PLANAR:
        store6(work.S, dof, (still, x_W))
        store6(work.S, dof + 1, (still, y_W))
        store6(work.S, dof + 2, (z_W, cross3(p_RootM, z_W)))
    else:
        store6(work.S, dof, (x_W, cross3(p_RootM, x_W)))
        store6(work.S, dof + 1, (y_W, cross3(p_RootM, y_W)))
        if kind != UNIVERSAL:
            store6(work.S, dof + 2, (z_W, cross3(p_RootM, z_W)))
        if kind == QUATERNION or kind == RPY:
            store6(work.S, dof + 3, (still, x_W))
            store6(work.S, dof + 4, (still, y_W))
            store6(work.S, dof + 5, (still, z_W))


@kernel
def rotation_of_rpy(rpy):
    """Rz(yaw) Ry(pitch) Rx(roll)."""
    r, p, y = rpy
    c0 = cos(r)
    c1 = cos(p)
    c2 = cos(y)
    s0 = sin(r)
    s1 = sin(p)
    s2 = sin(y)
    return (
        c2 * c1, c2 * s1 * s0 - s2 * c0, c2 * s1 * c0 + s2 * s0,
        s2 * c1, s2 * s1 * s0 + c2 * c0, s2 * s1 * c0 - c2 * s0,
        -s1, c1 * s0, c1 * c0,
    )  # fmt: skip


@kernel
def velocity_kinematics(model: TreeModel, p: Vector, work: TreeWork, q: Vector, v: Vector) -> None:
    """Fills `V` and `A` from `X_WB` and `S`."""
    for body in range(1, model.body.shape[0]):
        kind = model.body[body, KIND]
        dof = model.body[body, V]
        if kind == FREE:
            V_WB = read6(v, dof)
            w_WB, v_WBo = V_WB
            store6(work.V, body, V_WB)
            # The velocity field at a fixed point as the body carries its origin past it.
            store6(work.A, body, ((0.0, 0.0, 0.0), cross3(v_WBo, w_WB)))
        else:
            parent = model.body[body, PARENT]
            V_WP = load6(work.V, parent)
            A_WP = load6(work.A, parent)
            if kind == WELD:
                store6(work.V, body, V_WP)
                store6(work.A, body, A_WP)
            elif kind <= SCREW:
                V_PB = scale6(load6(work.S, dof), v[dof])
                store6(work.V, body, add6(V_WP, V_PB))
                store6(work.A, body, add6(A_WP, cross_motion(V_WP, V_PB)))
            else:
                velocity_of_wide_joint(model, p, work, v, body)


@kernel(outline=True)
def velocity_of_wide_joint(model: TreeModel, p: Vector, work: TreeWork, v: Vector, body: int) -> None:
    kind = model.body[body, KIND]
    parent = model.body[body, PARENT]
    dof = model.body[body, V]
    V_WP = load6(work.V, parent)
    V_PB = scale6(load6(work.S, dof), v[dof])
    for k in range(dof + 1, dof + model.body[body, NV]):
        V_PB = add6(V_PB, scale6(load6(work.S, k), v[k]))
    A_WB = add6(load6(work.A, parent), cross_motion(V_WP, V_PB))
    if kind != BALL:
        X_WM = pose_of_frame(model, p, work.X_WB, body, model.body[body, FRAME_M])
        p_RootM = sub3(X_WM[1], load3_at(work.X_WB, model.body[body, ROOT], 9))
        if kind == UNIVERSAL:
            # The second axis turns with the first.
            w_1, _ = scale6(load6(work.S, dof), v[dof])
            w_2, _ = scale6(load6(work.S, dof + 1), v[dof + 1])
            alpha = cross3(w_1, w_2)
            A_WB = add6(A_WB, (alpha, cross3(p_RootM, alpha)))
        else:
            # M's origin moves in F, and takes the rotation axes with it.
            w_FM, u_FM = V_PB
            v_FM = sub3(u_FM, cross3(p_RootM, w_FM))
            A_WB = add6(A_WB, ((0.0, 0.0, 0.0), cross3(v_FM, w_FM)))
    store6(work.V, body, add6(V_WP, V_PB))
    store6(work.A, body, A_WB)


@kernel
def velocity_at(work: TreeWork, body: int, root: int, p_WQ):
    """Spatial velocity of the body-fixed point now at p_WQ; `root` is model.body[body, ROOT]."""
    w_WB, v_Root = load6(work.V, body)
    p_RootQ = sub3(p_WQ, load3_at(work.X_WB, root, 9))
    return (w_WB, add3(v_Root, cross3(w_WB, p_RootQ)))


@kernel
def body_velocities(model: TreeModel, work: TreeWork, V_WB: Matrix) -> None:
    """Spatial velocities of the body origins [rad/s, m/s], shape (num_bodies, 6)."""
    for body in range(model.body.shape[0]):
        _, p_WB = load_pose(work.X_WB, body)
        store6(V_WB, body, velocity_at(work, body, model.body[body, ROOT], p_WB))
