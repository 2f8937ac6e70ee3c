"""Poses, motion of the dofs, velocities and bias accelerations, base to tip.

Monogram notation; F is the joint's frame on the inboard body P, M its frame on the body B.
"""

from __future__ import annotations

from sheldrake.common._kernels.generic import cos, floor, sin
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
    store6,
    sub3,
)
from sheldrake.common.kernel import Matrix, Vector, kernel
from sheldrake.multibody.tree._kernels.frames import (
    compose_pose,
    fixed_pose,
    frame_pose,
    load_pose,
    pose_of_frame,
    remove_pose,
    store_pose,
)
from sheldrake.multibody.tree._kernels.model import (
    AXIS,
    BALL,
    CURVILINEAR,
    DIRECT,
    FRAME_F,
    FRAME_M,
    FREE,
    KIND,
    LEAD,
    NV,
    PARENT,
    PATH,
    PATH_END,
    PIECE_COS,
    PIECE_PERIOD,
    PIECE_RATE,
    PIECE_SIN,
    PIECE_START,
    PIECE_X,
    PIECE_Y,
    PLANAR,
    PRISMATIC,
    QUATERNION,
    REVOLUTE,
    ROOT,
    RPY,
    SCREW,
    TREE,
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
        elif kind <= SCREW and model.body[body, DIRECT] == 1:
            position_of_axis_joint(model, p, work, q, body)
        else:
            position_of_any_joint(model, p, work, q, body)


@kernel
def position_of_axis_joint(model, p, work, q, body):
    """Revolute, prismatic, screw, weld, between frames that are fixed to the bodies themselves."""
    kind = model.body[body, KIND]
    angle = 0.0  # before poses are loaded, which would have to wait in memory for the calls of libm
    s = 0.0
    c = 1.0
    if kind != WELD:
        angle = q[model.body[body, Q]]
        if kind != PRISMATIC:
            s = sin(angle)
            c = cos(angle)
    R_WF, p_WF = load_pose(work.X_WB, model.body[body, PARENT])
    if model.body[body, FRAME_F] >= 0:
        R_WF, p_WF = compose_pose((R_WF, p_WF), fixed_pose(model, p, model.body[body, FRAME_F]))
    if kind == WELD:
        R_WM, p_WM = compose_pose((R_WF, p_WF), (load9(model.joint, body), load3_at(model.joint, body, 9)))
        store_pose(work.X_WB, body, R_WM, p_WM)
        to_body_frame(model, p, work, body)
    else:
        axis_F = load3(model.joint, body)
        axis_W = rotate(R_WF, axis_F)
        p_WM = p_WF
        if kind != REVOLUTE:
            p_WM = add3(p_WF, scale3(axis_W, model.joint[body, LEAD] * angle))
        along = model.body[body, AXIS]
        if kind == PRISMATIC:
            store_pose(work.X_WB, body, R_WF, p_WM)
        elif along == 0:
            store_pose(work.X_WB, body, compose(R_WF, rotation_about(axis_F, angle)), p_WM)
        else:
            store_turned(work.X_WB, body, R_WF, p_WM, along, s, c)
        to_body_frame(model, p, work, body)
        store_axis(model, work, body, axis_W, p_WM)


@kernel
def store_turned(X, row, R, p, along, s, c):
    """A pose whose frame is turned about an axis of its own, x, y or z (1, 2, 3; negative when opposite)."""
    x, y, z = (R[0], R[3], R[6]), (R[1], R[4], R[7]), (R[2], R[5], R[8])
    if along < 0:
        along = -along
        s = -s
    if along == 3:
        x, y = turn(x, y, s, c)
        store_pose(X, row, (x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2]), p)
    elif along == 2:
        z, x = turn(z, x, s, c)
        store_pose(X, row, (x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2]), p)
    else:
        y, z = turn(y, z, s, c)
        store_pose(X, row, (x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2]), p)


@kernel
def turn(x, y, s, c):
    """Both turned from x towards y, by an angle of sine s and cosine c."""
    return add3(scale3(x, c), scale3(y, s)), sub3(scale3(y, c), scale3(x, s))


@kernel
def store_axis(model, work, body, axis_W, p_WM):
    """The row of `S` of a revolute, prismatic or screw joint."""
    kind = model.body[body, KIND]
    dof = model.body[body, V]
    if kind == PRISMATIC:
        store6(work.S, dof, (scale3(axis_W, 0.0), axis_W))
    else:
        u = cross3(sub3(p_WM, load3_at(work.X_WB, model.body[body, ROOT], 9)), axis_W)
        if kind == SCREW:
            u = add3(u, scale3(axis_W, model.joint[body, LEAD]))
        store6(work.S, dof, (axis_W, u))


@kernel
def to_body_frame(model, p, work, body):
    """From the pose of the joint's outboard frame M in `X_WB` to that of the body; M is fixed to the body itself."""
    frame = model.body[body, FRAME_M]
    if frame >= 0:
        R_WB, p_WB = remove_pose(load_pose(work.X_WB, body), fixed_pose(model, p, frame))
        store_pose(work.X_WB, body, R_WB, p_WB)


@kernel(outline=True)
def position_of_any_joint(model: TreeModel, p: Vector, work: TreeWork, q: Vector, body: int) -> None:
    """Joints along a path or of two to six degrees of freedom, and those whose frames are fixed to other frames."""
    kind = model.body[body, KIND]
    at = model.body[body, Q]
    dof = model.body[body, V]
    X_WF = pose_of_frame(model, p, work.X_WB, model.body[body, PARENT], model.body[body, FRAME_F])
    R_WF, p_WF = X_WF
    x_W = (R_WF[0], R_WF[3], R_WF[6])
    y_W = (R_WF[1], R_WF[4], R_WF[7])
    z_W = (R_WF[2], R_WF[5], R_WF[8])
    R_WM, p_WM = X_WF
    rate = 0.0
    if kind == WELD or kind == CURVILINEAR:
        R_WM, p_WM = compose_pose(X_WF, (load9(model.joint, body), load3_at(model.joint, body, 9)))
        if kind == CURVILINEAR:
            R_WM, p_WM, rate = along_path(model, body, R_WM, p_WM, q[at])
    elif kind <= SCREW:
        axis_F = load3(model.joint, body)
        x_W = rotate(R_WF, axis_F)
        if kind != PRISMATIC:
            R_WM = compose(R_WF, rotation_about(axis_F, q[at]))
        if kind != REVOLUTE:
            p_WM = add3(p_WF, scale3(x_W, model.joint[body, LEAD] * q[at]))
    elif kind == QUATERNION:
        R_WM = compose(R_WF, rotation_of_quaternion(read4(q, at)))
        p_WM = add3(p_WF, rotate(R_WF, read3(q, at + 4)))
    elif kind == RPY:
        R_WM = compose(R_WF, rotation_of_rpy(read3(q, at)))
        p_WM = add3(p_WF, rotate(R_WF, read3(q, at + 3)))
    elif kind == BALL:
        R_WM = compose(R_WF, rotation_of_rpy(read3(q, at)))
    elif kind == PLANAR:
        R_WM = compose(R_WF, rotation_about((0.0, 0.0, 1.0), q[at + 2]))
        p_WM = add3(p_WF, add3(scale3(x_W, q[at]), scale3(y_W, q[at + 1])))
    else:
        y_W = add3(scale3(y_W, cos(q[at])), scale3(z_W, sin(q[at])))
        about_x = rotation_about((1.0, 0.0, 0.0), q[at])
        R_WM = compose(R_WF, compose(about_x, rotation_about((0.0, 1.0, 0.0), q[at + 1])))
    R_WB, p_WB = R_WM, p_WM
    if model.body[body, FRAME_M] >= 0:
        R_WB, p_WB = remove_pose((R_WM, p_WM), frame_pose(model, p, model.body[body, FRAME_M]))
    store_pose(work.X_WB, body, R_WB, p_WB)
    p_RootM = sub3(p_WM, load3_at(work.X_WB, model.body[body, ROOT], 9))
    still = (0.0, 0.0, 0.0)
    if kind == WELD:
        return
    if kind <= SCREW:
        store_axis(model, work, body, x_W, p_WM)
    elif kind == CURVILINEAR:
        w = scale3((R_WM[2], R_WM[5], R_WM[8]), rate)
        store6(work.S, dof, (w, add3((R_WM[0], R_WM[3], R_WM[6]), cross3(p_RootM, w))))
    elif kind == PLANAR:
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


@kernel(outline=True)
def along_path(model: TreeModel, body: int, R_0, p_0, s):
    """Moves a frame from the beginning of a path by a distance; with the turning rate there [1/m].

    Along each piece the joint is a revolute joint about the centre of the arc, or a prismatic joint.
    """
    at = model.body[body, PATH]
    period = model.joint[at, PIECE_PERIOD]
    if period > 0.0:
        s = s - period * floor(s / period)
    for row in range(at + 1, model.body[body, PATH_END]):
        if floor(s - model.joint[row, PIECE_START]) >= 0.0:  # complex numbers, which carry slopes, have no order
            at = row
    rate = model.joint[at, PIECE_RATE]
    ahead = s - model.joint[at, PIECE_START]
    angle = rate * ahead
    aside = 0.0 * ahead
    turned = sin(angle)
    straight = cos(angle)
    if rate != 0.0:
        ahead = turned / rate
        aside = (1.0 - straight) / rate
    c_0 = model.joint[at, PIECE_COS]
    s_0 = model.joint[at, PIECE_SIN]
    x_0, y_0 = (R_0[0], R_0[3], R_0[6]), (R_0[1], R_0[4], R_0[7])
    p_x = model.joint[at, PIECE_X] + c_0 * ahead - s_0 * aside
    p_y = model.joint[at, PIECE_Y] + s_0 * ahead + c_0 * aside
    x, y = turn(x_0, y_0, s_0 * straight + c_0 * turned, c_0 * straight - s_0 * turned)
    R = (x[0], y[0], R_0[2], x[1], y[1], R_0[5], x[2], y[2], R_0[8])
    return R, add3(p_0, add3(scale3(x_0, p_x), scale3(y_0, p_y))), rate


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
    """Fills `V` and `A` from `X_WB` and `S`; those of bodies welded to the world stay zero."""
    for body in range(1, model.body.shape[0]):
        if model.body[body, TREE] < 0:
            continue
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
            elif kind <= CURVILINEAR:
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
