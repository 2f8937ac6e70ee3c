"""How free bodies spin, where steps go on to rest. Steps as Drake's have its numbers, to infinity.

The gyroscopic torque w x (I w) is taken at the start of the step, as Drake takes it, and the orientation changes after
it. That adds (dt |w|)^2 of the energy of a tumbling body in each step, and as much to its angular momentum; an impact
adds dt times the change of the torque. Here momentum is kept to the last digit: a body that has turned by the step gets
the velocity at which it has, about its centre of mass, the momentum of the step's end, and its centre of mass moves
along that momentum. What stays at rest, or spins about a principal axis, is left as it is.

A body that turns by more than some tenths of a radian a step has no right motion anyway: contact would see velocities
without bound. With less of the torque the faster it turns, it stays a motion.

Quaternions are not normalized, either: explicit Euler makes them longer by half the square of half the angle, and those
of what spins so fast would overflow.
"""

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common._kernels.vec import (
    add3,
    cross3,
    dot3,
    mul_inertia,
    mul_symmetric,
    neg3,
    read3,
    read4,
    scale3,
    sub3,
    write3,
)
from sheldrake.common.kernel import kernel
from sheldrake.multibody.tree._kernels.model import FREE, QUATERNION

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
def keep_momentum(tree_model, solver_model, tree, v0, v1, q0, q, at_v):
    """Velocities and origins, in the next state q, of free bodies to which nothing is jointed.

    Their velocities are v0 at the start of the step, v1 in its solution, in the state from `at_v` on.
    """
    dt, resolved = solver_model.dt, solver_model.resolved_turn
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
