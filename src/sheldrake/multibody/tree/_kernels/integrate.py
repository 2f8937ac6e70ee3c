"""Between velocities and time derivatives of positions, a step of the positions, and how free bodies spin in it."""

from sheldrake.common._kernels.generic import cos, sin, sqrt, tan
from sheldrake.common._kernels.vec import (
    add3,
    cross3,
    dot3,
    mul_inertia,
    mul_symmetric,
    neg3,
    quaternion_rate,
    read3,
    read4,
    scale3,
    sub3,
    write3,
    write4,
)
from sheldrake.common.kernel import Matrix, Vector, kernel
from sheldrake.multibody.tree._kernels.model import BALL, FREE, QUATERNION, RPY, TreeModel

# ---- velocities and positions


@kernel(top=True, short_loops=True)
def qdot_of_velocity(model: TreeModel, q: Vector, v: Vector, qdot: Vector) -> None:
    """qdot = N(q) v, shape (nq,)."""
    for b in range(1, len(model.bodies)):
        body = model.bodies[b]
        kind, at, dof = body.kind, body.first_q, body.first_dof
        end = dof + body.num_dofs
        if kind == FREE or kind == QUATERNION:
            write4(qdot, at, quaternion_rate(read4(q, at), read3(v, dof)))
            at, dof = at + 4, dof + 3
        elif kind == BALL or kind == RPY:
            write3(qdot, at, rpy_rate(read3(q, at), read3(v, dof)))
            at, dof = at + 3, dof + 3
        for k in range(end - dof):
            qdot[at + k] = v[dof + k]


@kernel(top=True, short_loops=True)
def velocity_of_qdot(model: TreeModel, q: Vector, qdot: Vector, v: Vector) -> None:
    """v = N⁺(q) qdot, shape (nv,)."""
    for b in range(1, len(model.bodies)):
        body = model.bodies[b]
        kind, at, dof = body.kind, body.first_q, body.first_dof
        end = dof + body.num_dofs
        if kind == FREE or kind == QUATERNION:
            write3(v, dof, angular_velocity_of_quaternion_rate(read4(q, at), read4(qdot, at)))
            at, dof = at + 4, dof + 3
        elif kind == BALL or kind == RPY:
            write3(v, dof, angular_velocity_of_rpy_rate(read3(q, at), read3(qdot, at)))
            at, dof = at + 3, dof + 3
        for k in range(end - dof):
            v[dof + k] = qdot[at + k]


@kernel(top=True, short_loops=True)
def velocity_of_qdot_map(model: TreeModel, q: Vector, rate: Vector, v: Vector, columns: Matrix) -> None:
    """N⁺(q) transposed, shape (nq, nv): by position, what v its unit rate is.

    Args:
        model: The tree.
        q: Positions.
        rate: Scratch, shape (nq,), zeros.
        v: Scratch, shape (nv,).
        columns: Filled.
    """
    for i in range(rate.shape[0]):
        rate[i] = 1.0
        velocity_of_qdot(model, q, rate, v)
        rate[i] = 0.0
        for k in range(v.shape[0]):
            columns[i, k] = v[k]


@kernel(top=True, short_loops=True)
def qdot_of_velocity_map(model: TreeModel, q: Vector, v: Vector, qdot: Vector, columns: Matrix) -> None:
    """N(q) transposed, shape (nv, nq): by velocity, what qdot its unit is; as `velocity_of_qdot_map`."""
    for k in range(v.shape[0]):
        v[k] = 1.0
        qdot_of_velocity(model, q, v, qdot)
        v[k] = 0.0
        for i in range(qdot.shape[0]):
            columns[k, i] = qdot[i]


@kernel
def rpy_rate(rpy, w):
    """Rates of roll, pitch, yaw for an angular velocity in F [rad/s]; singular at pitch = ±90 degrees."""
    c1, c2, s2 = cos(rpy[1]), cos(rpy[2]), sin(rpy[2])
    ahead = c2 * w[0] + s2 * w[1]
    roll = ahead / c1
    return (roll, c2 * w[1] - s2 * w[0], w[2] + ahead * tan(rpy[1]))


@kernel
def angular_velocity_of_rpy_rate(rpy, rate):
    c1, c2, s2 = cos(rpy[1]), cos(rpy[2]), sin(rpy[2])
    return (
        c2 * c1 * rate[0] - s2 * rate[1],
        s2 * c1 * rate[0] + c2 * rate[1],
        rate[2] - sin(rpy[1]) * rate[0],
    )


@kernel
def angular_velocity_of_quaternion_rate(quat, rate):
    """w = 2 Qᵀ rate / |q|²: the left inverse of `quaternion_rate`."""
    w, x, y, z = quat
    s = 2.0 / (w * w + x * x + y * y + z * z)
    return (
        s * (-x * rate[0] + w * rate[1] - z * rate[2] + y * rate[3]),
        s * (-y * rate[0] + z * rate[1] + w * rate[2] - x * rate[3]),
        s * (-z * rate[0] - y * rate[1] + x * rate[2] + w * rate[3]),
    )


@kernel
def integrate_positions(model: TreeModel, q: Vector, v: Vector, dt: float, q_next: Vector) -> None:
    """q_next = q + dt N(q) v; quaternions are not normalised, as Drake's discrete update does not. May be in place."""
    for b in range(1, len(model.bodies)):
        body = model.bodies[b]
        kind = body.kind
        at = body.first_q
        dof = body.first_dof
        if kind == FREE or kind == QUATERNION:
            w, x, y, z = quaternion_rate(read4(q, at), read3(v, dof))
            q_next[at] = q[at] + dt * w
            q_next[at + 1] = q[at + 1] + dt * x
            q_next[at + 2] = q[at + 2] + dt * y
            q_next[at + 3] = q[at + 3] + dt * z
            q_next[at + 4] = q[at + 4] + dt * v[dof + 3]
            q_next[at + 5] = q[at + 5] + dt * v[dof + 4]
            q_next[at + 6] = q[at + 6] + dt * v[dof + 5]
        elif kind == BALL or kind == RPY:
            r, p, y = rpy_rate(read3(q, at), read3(v, dof))
            q_next[at] = q[at] + dt * r
            q_next[at + 1] = q[at + 1] + dt * p
            q_next[at + 2] = q[at + 2] + dt * y
            if kind == RPY:
                q_next[at + 3] = q[at + 3] + dt * v[dof + 3]
                q_next[at + 4] = q[at + 4] + dt * v[dof + 4]
                q_next[at + 5] = q[at + 5] + dt * v[dof + 5]
        else:
            for k in range(body.num_dofs):
                q_next[at + k] = q[at + k] + dt * v[dof + k]


# ---- free bodies that spin
#
# Where steps go on to rest. Those that iterate as Drake does have its numbers, to infinity.
#
# The gyroscopic torque w x (I w) is taken at the start of the step, as Drake takes it, and the orientation changes
# after it. That adds (dt |w|)^2 of the energy of a tumbling body in each step, and as much to its angular momentum;
# an impact adds dt times the change of the torque. Here momentum is kept to the last digit: a body that has turned by
# the step gets the velocity at which it has, about its centre of mass, the momentum of the step's end, and its centre
# of mass moves along that momentum. What stays at rest, or spins about a principal axis, is left as it is.
#
# A body that turns by more than some tenths of a radian a step has no right motion anyway: contact would see
# velocities without bound. With less of the torque the faster it turns, it stays a motion.
#
# Quaternions are not normalized, either: explicit Euler makes them longer by half the square of half the angle, and
# those of what spins so fast would overflow.

LONG = 1e6  # square of the length of a quaternion that needs shortening
FREE_DOFS = 6
TURNS = 1e-16  # angle of a step that the digits of a momentum see [rad]


@kernel
def torque_held_back(tree, b, dt, resolved):
    """The part of a body's gyroscopic torque about its centre of mass that is too much for a time step [N m].

    A turn by the angle `resolved` is not [rad].
    """
    w, _ = tree[b].V_WB
    angle2 = dt * dt * dot3(w, w)
    if not angle2 > resolved * resolved:
        return (0.0 * w[0], 0.0 * w[1], 0.0 * w[2])
    _, I_cm = central_inertia(tree[b].inertia)
    return scale3(cross3(w, mul_symmetric(I_cm, w)), 1.0 - resolved * resolved / angle2)


@kernel
def hold_back_gyroscopic_torques(tree_model, tree, dt, resolved):
    """Takes away some of the gyroscopic torque about the centre of mass, in `bias`, of bodies that spin so fast."""
    for b in range(1, len(tree_model.bodies)):
        body = tree_model.bodies[b]
        if body.kind == FREE:
            dof = body.first_dof
            write3(tree.bias, dof, sub3(read3(tree.bias, dof), torque_held_back(tree, b, dt, resolved)))


@kernel
def turned(a, x):
    """x, turned by the quaternion (1, a), of any length."""
    y = cross3(a, x)
    return add3(x, scale3(add3(y, cross3(a, y)), 2.0 / (1.0 + dot3(a, a))))


@kernel
def divide_symmetric(L, I):
    """I^-1 L."""
    xx, yy, zz, xy, xz, yz = I
    x = (yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy)
    y = (x[1], xx * zz - xz * xz, xy * xz - xx * yz)
    z = (x[2], y[2], xx * yy - xy * xy)
    s = 1.0 / (xx * x[0] + xy * x[1] + xz * x[2])
    return (s * dot3(x, L), s * dot3(y, L), s * dot3(z, L))


@kernel
def central_inertia(I):
    """(centre of mass, moments about it) of an Inertia about its origin."""
    mass, first_moment, second = I
    x, y, z = first_moment
    c = scale3(first_moment, 1.0 / mass)
    return c, (
        second[0] - (y * c[1] + z * c[2]),
        second[1] - (x * c[0] + z * c[2]),
        second[2] - (x * c[0] + y * c[1]),
        second[3] + x * c[1],
        second[4] + x * c[2],
        second[5] + y * c[2],
    )


@kernel
def momentum_after(tree, b, v0, v1, dof, dt, resolved):
    """Momentum at the end of a step about the origin at its start: that of v1, less the torques of spinning."""
    I = tree[b].composite
    still = (0.0, 0.0, 0.0)
    w0 = read3(v0, dof)
    spin, flow = mul_inertia(I, (w0, still))
    angular, linear = mul_inertia(I, (read3(v1, dof), read3(v1, dof + 3)))
    angular = add3(angular, scale3(sub3(cross3(w0, spin), torque_held_back(tree, b, dt, resolved)), dt))
    return angular, add3(linear, scale3(cross3(w0, flow), dt))


@kernel
def keep_momentum(tree_model, tree, v0, v1, dt, resolved, q0, q, at_v):
    """Velocities and origins, in the next state q, of free bodies to which nothing is jointed.

    Their velocities are v0 at the start of the step, v1 in its solution, in the state from `at_v` on.
    """
    for t in range(len(tree_model.trees)):
        b = tree_model.trees[t].first_body
        body = tree_model.bodies[b]
        if body.kind == FREE and tree_model.trees[t].num_dofs == FREE_DOFS:
            dof = body.first_dof
            w1 = read3(v1, dof)
            if dt * dt * (dot3(read3(v0, dof), read3(v0, dof)) + dot3(w1, w1)) > TURNS * TURNS:
                mass, _, _ = tree[b].composite
                c, I = central_inertia(tree[b].composite)
                angular, linear = momentum_after(tree, b, v0, v1, dof, dt, resolved)
                v_cm = scale3(linear, 1.0 / mass)
                L = sub3(angular, cross3(c, linear))
                a = scale3(w1, 0.5 * dt)
                w = turned(a, divide_symmetric(turned(neg3(a), L), I))
                c1 = turned(a, c)
                write3(q, at_v + dof, w)
                write3(q, at_v + dof + 3, sub3(v_cm, cross3(w, c1)))
                at = body.first_q + 4
                write3(q, at, add3(read3(q0, at), sub3(add3(c, scale3(v_cm, dt)), c1)))


@kernel
def shorten_quaternions(tree_model, q):
    """Makes quaternions that have grown very long unit quaternions; the rotation they stand for stays."""
    for b in range(1, len(tree_model.bodies)):
        body = tree_model.bodies[b]
        if body.kind == FREE or body.kind == QUATERNION:
            at = body.first_q
            w, x, y, z = read4(q, at)
            length2 = w * w + x * x + y * y + z * z
            if length2 > LONG:
                scale = 1.0 / sqrt(length2)
                for k in range(at, at + 4):
                    q[k] *= scale
