"""Between velocities and time derivatives of positions, and a step of the positions."""

from __future__ import annotations

from sheldrake.common._kernels.generic import cos, sin, tan
from sheldrake.common._kernels.vec import quaternion_rate, read3, read4, write3, write4
from sheldrake.common.kernel import Matrix, Vector, kernel
from sheldrake.multibody.tree._kernels.model import BALL, FREE, QUATERNION, RPY, TreeModel


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
