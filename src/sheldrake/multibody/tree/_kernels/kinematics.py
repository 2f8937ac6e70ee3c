"""Poses, motion of the dofs, velocities and bias accelerations, base to tip.

Monogram notation; F is the joint's frame on the inboard body P, M its frame on the body B.
"""

from sheldrake.common._kernels.generic import cos, floor, sin, sines_and_cosines
from sheldrake.common._kernels.vec import (
    add3,
    add6,
    axes,
    compose,
    cross3,
    cross_motion,
    of_axes,
    read3,
    read4,
    read6,
    read9,
    rotate,
    rotate_back,
    rotation_about,
    rotation_by,
    rotation_of_quaternion,
    scale3,
    scale6,
    store6,
    sub3,
    transpose,
)
from sheldrake.common.kernel import Matrix, Vector, kernel
from sheldrake.multibody.tree._kernels.model import (
    BALL,
    CURVILINEAR,
    FREE,
    PLANAR,
    PRISMATIC,
    QUATERNION,
    REVOLUTE,
    RPY,
    SCREW,
    UNIVERSAL,
    WELD,
    TreeModel,
    TreeWork,
)

# ---- poses as (Mat3, Vec3) pairs, and frames fixed to bodies


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


# ---- base to tip


@kernel(top=True, short_loops=True)
def position_kinematics(model: TreeModel, p: Vector, work: TreeWork, q: Vector) -> None:
    """Fills `X_WB` and `S`."""
    turn_joints(model, work, q)
    for b in range(1, len(model.bodies)):
        body = model.bodies[b]
        if body.kind == FREE:
            at = body.first_q
            work[b].X_WB = (rotation_of_quaternion(read4(q, at)), read3(q, at + 4))
        elif body.kind <= SCREW and body.direct == 1:
            position_of_axis_joint(model, p, work, q, b)
        else:
            position_of_any_joint(model, p, work, q, b)


NO_ROTATION = 124
"""The status for a quaternion of zeros."""


@kernel(top=True)
def poses_of_rotations(model: TreeModel, p: Vector, work: TreeWork, q: Vector) -> int:
    """`position_kinematics` in a workspace that may be zeros, unless a quaternion is zero: then a status."""
    for b in range(1, len(model.bodies)):
        body = model.bodies[b]
        if body.kind == FREE or body.kind == QUATERNION:
            w, x, y, z = read4(q, body.first_q)
            if w == 0.0 and x == 0.0 and y == 0.0 and z == 0.0:
                return NO_ROTATION
    begin_work(model, work)
    position_kinematics(model, p, work, q)
    return 0


@kernel
def begin_work(model, work):
    """What stages never change: the pose of the world, cosines where no joint is, and how free bodies move."""
    work[0].R_WB = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
    for k in range(model.turn.shape[0], work.cosine.shape[0]):
        work.cosine[k] = 1.0
    for b in range(1, len(model.bodies)):
        if model.bodies[b].kind == FREE:
            for k in range(6):
                work.S[model.bodies[b].first_dof + k, k] = 1.0


@kernel
def turn_joints(model, work, q):
    """Fills `angle`, `sine` and `cosine`."""
    n = model.turn.shape[0]
    for i in range(n):
        work.angle[i] = q[model.turn[i]]
    sines_and_cosines(work.angle, n, work.sine, work.cosine)


@kernel
def position_of_axis_joint(model, p, work, q, b):
    """Revolute, prismatic, screw, weld, between frames that are fixed to the bodies themselves."""
    body = model.bodies[b]
    kind = body.kind
    R_WF, p_WF = work[body.parent].X_WB
    if body.frame_F >= 0:
        R_WF, p_WF = compose_pose((R_WF, p_WF), fixed_pose(model, p, body.frame_F))
    if kind == WELD:
        work[b].X_WB = (R_WF, p_WF) if body.along == 1 else compose_pose((R_WF, p_WF), model.poses[b].X_FM)
        to_body_frame(model, p, work, b)
        return
    joint = model.axes[b]
    angle = q[body.first_q]
    axis_W = rotate(R_WF, joint.axis_F)
    p_WM = p_WF
    if kind != REVOLUTE:
        p_WM = add3(p_WF, scale3(axis_W, joint.lead * angle))
    if kind == PRISMATIC:
        work[b].X_WB = (R_WF, p_WM)
    elif body.along == 0:
        work[b].X_WB = (compose(R_WF, rotation_by(joint.axis_F, work.sine[body.turn], work.cosine[body.turn])), p_WM)
    else:
        store_turned(work[b], R_WF, p_WM, body.along, work.sine[body.turn], work.cosine[body.turn])
    to_body_frame(model, p, work, b)
    store_axis(model, work, b, axis_W, p_WM)


@kernel
def store_turned(body, R, p, along, s, c):
    """A pose whose frame is turned about an axis of its own, x, y or z (1, 2, 3; negative when opposite)."""
    x, y, z = axes(R)
    if along < 0:
        along, s = -along, -s
    if along == 3:
        x, y = turn(x, y, s, c)
        body.X_WB = (of_axes(x, y, z), p)
    elif along == 2:
        z, x = turn(z, x, s, c)
        body.X_WB = (of_axes(x, y, z), p)
    else:
        y, z = turn(y, z, s, c)
        body.X_WB = (of_axes(x, y, z), p)


@kernel
def turn(x, y, s, c):
    """Both turned from x towards y, by an angle of sine s and cosine c."""
    return add3(scale3(x, c), scale3(y, s)), sub3(scale3(y, c), scale3(x, s))


@kernel
def store_axis(model, work, b, axis_W, p_WM):
    """The row of `S` of a revolute, prismatic or screw joint."""
    body = model.bodies[b]
    dof = work.dofs[body.first_dof]
    if body.kind == PRISMATIC:
        dof.S = (scale3(axis_W, 0.0), axis_W)
    else:
        u = cross3(from_root(model, work, b, p_WM), axis_W)
        if body.kind == SCREW:
            u = add3(u, scale3(axis_W, model.axes[b].lead))
        dof.S = (axis_W, u)


@kernel
def to_body_frame(model, p, work, b):
    """From the pose of the joint's outboard frame M in `X_WB` to that of the body; M is fixed to the body itself."""
    frame = model.bodies[b].frame_M
    if frame >= 0:
        work[b].X_WB = remove_pose(work[b].X_WB, fixed_pose(model, p, frame))


@kernel(outline=True)
def position_of_any_joint(model: TreeModel, p: Vector, work: TreeWork, q: Vector, b: int) -> None:
    """Joints along a path or of two to six degrees of freedom, and those whose frames are fixed to other frames."""
    body = model.bodies[b]
    kind = body.kind
    at = body.first_q
    dof = body.first_dof
    X_WF = pose_of_frame(model, p, work, body.parent, body.frame_F)
    R_WF, p_WF = X_WF
    x_W, y_W, z_W = axes(R_WF)
    R_WM, p_WM = X_WF
    rate = 0.0
    if kind == WELD or kind == CURVILINEAR:
        R_WM, p_WM = compose_pose(X_WF, model.poses[b].X_FM)
        if kind == CURVILINEAR:
            R_WM, p_WM, rate = along_path(model, b, R_WM, p_WM, q[at])
    elif kind <= SCREW:
        joint = model.axes[b]
        x_W = rotate(R_WF, joint.axis_F)
        if kind != PRISMATIC:
            R_WM = compose(R_WF, rotation_by(joint.axis_F, work.sine[body.turn], work.cosine[body.turn]))
        if kind != REVOLUTE:
            p_WM = add3(p_WF, scale3(x_W, joint.lead * q[at]))
    elif kind == QUATERNION:
        R_WM, p_WM = compose_pose(X_WF, (rotation_of_quaternion(read4(q, at)), read3(q, at + 4)))
    elif kind == RPY:
        R_WM, p_WM = compose_pose(X_WF, (rotation_of_rpy(read3(q, at)), read3(q, at + 3)))
    elif kind == BALL:
        R_WM = compose(R_WF, rotation_of_rpy(read3(q, at)))
    elif kind == PLANAR:
        R_WM = compose(R_WF, rotation_about((0.0, 0.0, 1.0), q[at + 2]))
        p_WM = add3(p_WF, add3(scale3(x_W, q[at]), scale3(y_W, q[at + 1])))
    else:
        y_W = add3(scale3(y_W, cos(q[at])), scale3(z_W, sin(q[at])))
        about_x = rotation_about((1.0, 0.0, 0.0), q[at])
        R_WM = compose(R_WF, compose(about_x, rotation_about((0.0, 1.0, 0.0), q[at + 1])))
    work[b].X_WB = (R_WM, p_WM)
    if body.frame_M >= 0:
        work[b].X_WB = remove_pose((R_WM, p_WM), frame_pose(model, p, body.frame_M))
    p_RootM = from_root(model, work, b, p_WM)
    still = (0.0, 0.0, 0.0)
    if kind == WELD:
        return
    if kind <= SCREW:
        store_axis(model, work, b, x_W, p_WM)
    elif kind == CURVILINEAR:
        x_WM, _, z_WM = axes(R_WM)
        w = scale3(z_WM, rate)
        work.dofs[dof].S = (w, add3(x_WM, cross3(p_RootM, w)))
    elif kind == PLANAR:
        work.dofs[dof].S = (still, x_W)
        work.dofs[dof + 1].S = (still, y_W)
        work.dofs[dof + 2].S = (z_W, cross3(p_RootM, z_W))
    else:
        axes_W = (x_W, y_W, z_W)
        for i in range(min(3, body.num_dofs)):
            work.dofs[dof + i].S = (axes_W[i], cross3(p_RootM, axes_W[i]))
        for i in range(3, body.num_dofs):
            work.dofs[dof + i].S = (still, axes_W[i - 3])


@kernel(outline=True)
def along_path(model: TreeModel, b: int, R_0, p_0, s):
    """Moves a frame from the beginning of a path by a distance; with the turning rate there [1/m].

    Along each piece the joint is a revolute joint about the centre of the arc, or a prismatic joint.
    """
    at = model.bodies[b].path
    period = model.pieces[at].period
    if period > 0.0:
        s = s - period * floor(s / period)
    for i in range(at + 1, model.bodies[b].path_end):
        if floor(s - model.pieces[i].start) >= 0.0:  # complex numbers, which carry slopes, have no order
            at = i
    piece = model.pieces[at]
    rate = piece.rate
    ahead = s - piece.start
    aside = 0.0 * ahead
    turned, straight = sin(rate * ahead), cos(rate * ahead)
    if rate != 0.0:
        ahead = turned / rate
        aside = (1.0 - straight) / rate
    c_0, s_0 = piece.cos, piece.sin
    x_0, y_0, z = axes(R_0)
    p_x = piece.x + c_0 * ahead - s_0 * aside
    p_y = piece.y + s_0 * ahead + c_0 * aside
    x, y = turn(x_0, y_0, s_0 * straight + c_0 * turned, c_0 * straight - s_0 * turned)
    return of_axes(x, y, z), add3(p_0, add3(scale3(x_0, p_x), scale3(y_0, p_y))), rate


@kernel
def rotation_of_rpy(rpy):
    """Rz(yaw) Ry(pitch) Rx(roll)."""
    r, p, y = rpy
    c0, c1, c2 = cos(r), cos(p), cos(y)
    s0, s1, s2 = sin(r), sin(p), sin(y)
    return (
        c2 * c1, c2 * s1 * s0 - s2 * c0, c2 * s1 * c0 + s2 * s0,
        s2 * c1, s2 * s1 * s0 + c2 * c0, s2 * s1 * c0 - c2 * s0,
        -s1, c1 * s0, c1 * c0,
    )  # fmt: skip


@kernel(top=True, short_loops=True)
def velocity_kinematics(model: TreeModel, p: Vector, work: TreeWork, q: Vector, v: Vector) -> None:
    """Fills `V` and `A` from `X_WB` and `S`; those of bodies welded to the world stay zero.

    V_i = V_parent + S_i v_i, and at zero vdot A_i = A_parent + V_parent x S_i v_i, with the joint's own bias where its
    axes move in F (Featherstone 2008, table 5.1, its first loop).
    """
    for b in range(1, len(model.bodies)):
        body = model.bodies[b]
        if body.tree < 0:
            continue
        kind = body.kind
        dof = body.first_dof
        if kind == FREE:
            V_WB = read6(v, dof)
            w_WB, v_WBo = V_WB
            work[b].V_WB = V_WB
            # The velocity field at a fixed point as the body carries its origin past it.
            work[b].A_WB = ((0.0, 0.0, 0.0), cross3(v_WBo, w_WB))
        else:
            V_WP = work[body.parent].V_WB
            A_WP = work[body.parent].A_WB
            if kind == WELD:
                work[b].V_WB = V_WP
                work[b].A_WB = A_WP
            elif kind <= CURVILINEAR:
                V_PB = scale6(work.dofs[dof].S, v[dof])
                work[b].V_WB = add6(V_WP, V_PB)
                work[b].A_WB = add6(A_WP, cross_motion(V_WP, V_PB))
            else:
                velocity_of_wide_joint(model, p, work, v, b)


@kernel(outline=True)
def velocity_of_wide_joint(model: TreeModel, p: Vector, work: TreeWork, v: Vector, b: int) -> None:
    body = model.bodies[b]
    kind = body.kind
    dof = body.first_dof
    V_WP = work[body.parent].V_WB
    V_PB = scale6(work.dofs[dof].S, v[dof])
    for k in range(dof + 1, dof + body.num_dofs):
        V_PB = add6(V_PB, scale6(work.dofs[k].S, v[k]))
    A_WB = add6(work[body.parent].A_WB, cross_motion(V_WP, V_PB))
    if kind != BALL:
        X_WM = pose_of_frame(model, p, work, b, body.frame_M)
        p_RootM = from_root(model, work, b, X_WM[1])
        if kind == UNIVERSAL:
            # The second axis turns with the first.
            w_1, _ = scale6(work.dofs[dof].S, v[dof])
            w_2, _ = scale6(work.dofs[dof + 1].S, v[dof + 1])
            alpha = cross3(w_1, w_2)
            A_WB = add6(A_WB, (alpha, cross3(p_RootM, alpha)))
        else:
            # M's origin moves in F, and takes the rotation axes with it.
            w_FM, u_FM = V_PB
            v_FM = sub3(u_FM, cross3(p_RootM, w_FM))
            A_WB = add6(A_WB, ((0.0, 0.0, 0.0), cross3(v_FM, w_FM)))
    work[b].V_WB = add6(V_WP, V_PB)
    work[b].A_WB = A_WB


@kernel
def velocity_at(model: TreeModel, work: TreeWork, b: int, p_WQ):
    """Spatial velocity of the point fixed to body b that is now at p_WQ."""
    w_WB, v_Root = work[b].V_WB
    return (w_WB, add3(v_Root, cross3(w_WB, from_root(model, work, b, p_WQ))))


@kernel(top=True, short_loops=True)
def body_velocities(model: TreeModel, work: TreeWork, V_WB: Matrix) -> None:
    """Spatial velocities of the body origins [rad/s, m/s], shape (num_bodies, 6)."""
    for b in range(len(model.bodies)):
        store6(V_WB, b, velocity_at(model, work, b, work[b].p_WB))
