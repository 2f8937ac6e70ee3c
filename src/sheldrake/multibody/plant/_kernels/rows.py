"""Scalar rows of the problem.

Position limits near enough to matter in this step, dry friction and PD control of joints; couplers of two joints,
tendons, distances, ball joints and welds between bodies.
"""

import numpy as np

from sheldrake.common._kernels.generic import atan2, sqrt
from sheldrake.common._kernels.vec import (
    add3,
    compose,
    cross3,
    dot3,
    magnitude,
    read3,
    read9,
    rotate,
    scale3,
    sub3,
    transpose,
)
from sheldrake.common.kernel import kernel
from sheldrake.multibody.contact_solvers._kernels.problem import ACTUATOR, DRY_FRICTION, HOLONOMIC, LIMIT
from sheldrake.multibody.plant._kernels.contacts import sides
from sheldrake.multibody.plant._kernels.forces import commanded_effort, gains_of, has_desired_state
from sheldrake.multibody.plant._kernels.model import BALL, COUPLER, DISTANCE, TENDON
from sheldrake.multibody.tree._kernels.kinematics import from_root, point_on

INFINITE = np.inf
LIMIT_STIFFNESS = 1e12  # [N/m or N m/rad]
STUCK_DAMPING = 1e12  # [N s/m or N m s/rad]: stiffer than any time step resolves
REACH = 2.0  # a limit counts within so many steps at the present speed
ANY_DISTANCE = 1e300  # but not infinite, which is where no limit is
SIX = 6
SMALL_SINE = 1e-9  # below it an angle is its sine

# ---- what a row says


@kernel
def put_index(row, width, tree_a, tree_b, kind, owner, group):
    """Who moves a row and what it is; see `RowIndex`."""
    row.width = width
    row.tree_a, row.tree_b = tree_a, tree_b
    row.kind, row.owner, row.group = kind, owner, group
    row.order = 0


@kernel
def put_law(row, lower, upper, gap, stiffness, relaxation):
    """Least and largest impulse of a row, and what its regularisation and velocity are made of; see `RowLaw`."""
    put_actuator_law(row, lower, upper, gap, stiffness, relaxation, 0.0, 0.0)


@kernel
def put_actuator_law(row, lower, upper, gap, kp, kd, rate, forward):
    """`put_law` of an actuator."""
    row.lower, row.upper = lower, upper
    row.gap, row.stiffness, row.relaxation = gap, kp, kd
    row.rate, row.forward = rate, forward
    row.vc = 0.0


# ---- joints


@kernel
def put_joint_row(tree_model, problem, rows, dof, kind, owner, sign):
    """Index and Jacobian of a row on one dof; the row."""
    r = problem.num_rows
    row = rows[r]
    problem.num_rows = r + 1
    put_index(row, 1, tree_model.dofs[dof].tree, -1, kind, owner, 1)
    row.dofs[0] = dof
    row.J[0] = sign
    return row


@kernel
def put_limit(tree_model, problem, rows, dof, owner, gap, sign, dt):
    row = put_joint_row(tree_model, problem, rows, dof, LIMIT, owner, sign)
    put_law(row, 0.0, INFINITE, gap, LIMIT_STIFFNESS, dt)


@kernel
def put_limits(tree_model, solver_model, plant_model, problem, rows, q, is_free):
    """Rows of the position limits that the joint may reach within two steps: q0 - q_lower >= 0, q_upper - q0 >= 0.

    With its velocity v0; or, if `is_free`, with v* alone. A limit that is ahead in v* holds the joint there: the other
    one is then seen however far it is, as the motion without either is not known.
    """
    dt = solver_model.dt
    for i in range(len(plant_model.limits)):
        limit, bound = plant_model.limits[i], plant_model.bounds[i]
        dof = limit.dof
        below = q[limit.q] - bound.lower
        above = bound.upper - q[limit.q]
        reach = REACH * dt * magnitude(problem.v0[dof])
        if solver_model.ahead == 1 and (below <= reach or above <= reach):
            reach = ANY_DISTANCE
        seen = -INFINITE
        if is_free:
            seen, reach = reach, REACH * dt * magnitude(problem.v_star[dof])
        if seen < below and below <= reach:
            put_limit(tree_model, problem, rows, dof, i, below, 1.0, dt)
        if seen < above and above <= reach:
            put_limit(tree_model, problem, rows, dof, i, above, -1.0, dt)


@kernel
def put_dry_friction(tree_model, solver_model, plant_model, problem, rows):
    """Rows that hold joints still as far as their dry friction goes: dampers as stiff as the time step resolves."""
    dt = solver_model.dt
    for i in range(plant_model.friction.shape[0]):
        effort = plant_model.friction_effort[i]
        row = put_joint_row(tree_model, problem, rows, plant_model.friction[i], DRY_FRICTION, i, 1.0)
        put_law(row, -dt * effort, dt * effort, 0.0, 0.0, STUCK_DAMPING)


@kernel
def put_actuators(tree_model, solver_model, plant_model, problem, rows, p, q, u):
    """Rows of the actuators under PD control that have a desired state.

    gamma = dt clamp(-Kp (q0 + dt v - q_desired) - Kd (v - v_desired) + u0, -effort, effort).
    """
    dt = solver_model.dt
    for i in range(len(plant_model.actuators)):
        actuator = plant_model.actuators[i]
        if has_desired_state(plant_model, u, i):
            most = dt * plant_model.gains[i].effort_limit
            kp, kd = gains_of(plant_model, p, i)
            desired = u[actuator.desired_port]
            gap, rate = q[actuator.q] - desired[actuator.desired_q], desired[actuator.desired_v]
            forward = commanded_effort(plant_model, u, i)
            row = put_joint_row(tree_model, problem, rows, actuator.dof, ACTUATOR, i, 1.0)
            put_actuator_law(row, -most, most, gap, kp, kd, rate, forward)


# ---- constraints between joints and bodies
#
# A constraint is g(q) = 0 with gdot = J v, as stiff as the time step resolves (Castro, Permenter, Han 2022, section V).


@kernel
def rotation_vector(R):
    """Angle times axis of a rotation by less than 180 degrees [rad]."""
    sine = (0.5 * (R[7] - R[5]), 0.5 * (R[2] - R[6]), 0.5 * (R[3] - R[1]))
    cosine = 0.5 * (R[0] + R[4] + R[8] - 1.0)
    s2 = dot3(sine, sine)
    if s2 <= SMALL_SINE * SMALL_SINE:
        return sine
    s = sqrt(s2)
    return scale3(sine, atan2(s, cosine) / s)


@kernel
def put_heads(rows, r, n, owner, width, tree_a, tree_b):
    """Index of n rows that share their dofs, which row r lists."""
    for i in range(r, r + n):
        put_index(rows[i], width, tree_a, tree_b, HOLONOMIC, owner, 0)
        for a in range(width):
            rows[i].dofs[a] = rows[r].dofs[a]
    rows[r].group = n


@kernel
def put_equations(rows, r, gap):
    """Laws of three rows without spring or limit: gap = 0."""
    for i in range(3):
        put_law(rows[r + i], -INFINITE, INFINITE, gap[i], INFINITE, 0.0)


@kernel
def put_motion(rows, r, n, column, first, w, v, along):
    """Writes (`first`) or adds the motion of a dof to a column of n rows: 1 along, 3 of v, or 6 of (w, v)."""
    if n == 1:
        put_number(rows[r], column, first, dot3(along, v))
    elif n == 3:
        put_three(rows, r, column, first, v)
    else:
        put_three(rows, r, column, first, w)
        put_three(rows, r + 3, column, first, v)


@kernel
def put_three(rows, r, column, first, a):
    put_number(rows[r], column, first, a[0])
    put_number(rows[r + 1], column, first, a[1])
    put_number(rows[r + 2], column, first, a[2])


@kernel
def put_number(row, column, first, value):
    if first:
        row.J[column] = value
    else:
        row.J[column] += value


@kernel(outline=True)
def put_body_rows(tree_model, tree, rows, r, n, owner, body_a, body_b, p_WP, p_WQ, along):
    """Jacobian of the motion of Q on B against P on A, in n rows from row r on (see `put_motion`)."""
    tip_a, tip_b = tree_model.bodies[body_a].tip, tree_model.bodies[body_b].tip
    tree_a, tree_b, stop = sides(tree_model, body_a, body_b)
    width = 0
    if tip_a >= 0:
        width += tree_model.dofs[tip_a].depth + 1
        p_RootP = from_root(tree_model, tree, body_a, p_WP)
        k = tip_a
        while k >= 0:
            w, v = tree.dofs[k].S
            column = tree_model.dofs[k].depth
            rows[r].dofs[column] = k
            v = scale3(add3(v, cross3(w, p_RootP)), -1.0)
            put_motion(rows, r, n, column, True, scale3(w, -1.0), v, along)
            k = tree_model.dofs[k].parent
    if tip_b >= 0:
        shared = 0 if stop < 0 else tree_model.dofs[stop].depth + 1
        own = width - shared
        width = own + tree_model.dofs[tip_b].depth + 1
        p_RootQ = from_root(tree_model, tree, body_b, p_WQ)
        k = tip_b
        while k >= 0:
            w, v = tree.dofs[k].S
            depth = tree_model.dofs[k].depth
            new = depth >= shared
            column = own + depth if new else depth
            rows[r].dofs[column] = k
            put_motion(rows, r, n, column, new, w, add3(v, cross3(w, p_RootQ)), along)
            k = tree_model.dofs[k].parent
    put_heads(rows, r, n, owner, width, tree_a, tree_b)


@kernel
def put_coupler(tree_model, rows, r, owner, constraint, p, q):
    """q_a - ratio q_b - offset = 0."""
    row = rows[r]
    a, b, at = constraint.A, constraint.B, constraint.p
    row.dofs[0], row.dofs[1] = a, b
    row.J[0], row.J[1] = 1.0, -p[at]
    put_heads(rows, r, 1, owner, 2, tree_model.dofs[a].tree, tree_model.dofs[b].tree)
    gap = q[constraint.q_A] - p[at] * q[constraint.q_B] - p[at + 1]
    put_law(row, -INFINITE, INFINITE, gap, INFINITE, 0.0)


@kernel
def put_tendon(tree_model, plant_model, problem, rows, owner, constraint, p, q):
    """lower <= sum of a q + offset <= upper: as in Drake, a spring and damper beyond a limit, nothing before it."""
    at = constraint.p
    length, lower, upper = p[at], p[at + 1], p[at + 2]
    for i in range(constraint.A, constraint.B):
        joint = plant_model.tendon_joints[i]
        length += p[at + 5 + joint.coefficient] * q[joint.q]
    if length < lower:
        put_tendon_limit(tree_model, plant_model, problem, rows, owner, constraint, p, 1.0, length - lower)
    if length > upper:
        put_tendon_limit(tree_model, plant_model, problem, rows, owner, constraint, p, -1.0, upper - length)


@kernel
def put_tendon_limit(tree_model, plant_model, problem, rows, owner, constraint, p, sign, gap):
    """A row that pushes where the gap closes, in the direction of `sign` times the tendon's coefficients."""
    r = problem.num_rows
    problem.num_rows = r + 1
    begin, end, at = constraint.A, constraint.B, constraint.p
    for i in range(begin, end):
        joint = plant_model.tendon_joints[i]
        rows[r].dofs[i - begin] = joint.dof
        rows[r].J[i - begin] = sign * p[at + 5 + joint.coefficient]
    tree_a = tree_model.dofs[plant_model.tendon_joints[begin].dof].tree
    tree_b = tree_model.dofs[plant_model.tendon_joints[end - 1].dof].tree
    put_heads(rows, r, 1, owner, end - begin, tree_a, tree_b)
    put_law(rows[r], 0.0, INFINITE, gap, p[at + 3], p[at + 4] / p[at + 3])


@kernel
def put_distance(tree_model, tree, rows, r, owner, constraint, p):
    """|PQ| - length = 0, with a spring and damper if the stiffness is finite."""
    A, B, at = constraint.A, constraint.B, constraint.p
    p_WP = point_on(tree, A, read3(p, at))
    p_WQ = point_on(tree, B, read3(p, at + 3))
    p_PQ = sub3(p_WQ, p_WP)
    length = sqrt(dot3(p_PQ, p_PQ))
    put_body_rows(tree_model, tree, rows, r, 1, owner, A, B, p_WP, p_WQ, scale3(p_PQ, 1.0 / length))
    put_law(rows[r], -INFINITE, INFINITE, length - p[at + 6], p[at + 7], p[at + 8] / p[at + 7])


@kernel
def put_ball(tree_model, tree, rows, r, owner, constraint, p):
    """p_WQ - p_WP = 0."""
    A, B, at = constraint.A, constraint.B, constraint.p
    p_WP = point_on(tree, A, read3(p, at))
    p_WQ = point_on(tree, B, read3(p, at + 3))
    gap = sub3(p_WQ, p_WP)
    put_body_rows(tree_model, tree, rows, r, 3, owner, A, B, p_WP, p_WQ, gap)
    put_equations(rows, r, gap)


@kernel
def put_weld(tree_model, tree, rows, r, owner, constraint, p):
    """(rotation vector of R_PQ in W, p_WQ - p_WP) = 0, moved at the point midway between P and Q."""
    A, B, at = constraint.A, constraint.B, constraint.p
    R_WP = compose(tree[A].R_WB, read9(p, at))
    R_WQ = compose(tree[B].R_WB, read9(p, at + 12))
    p_WP = point_on(tree, A, read3(p, at + 9))
    p_WQ = point_on(tree, B, read3(p, at + 21))
    turn = rotate(R_WP, rotation_vector(compose(transpose(R_WP), R_WQ)))
    gap = sub3(p_WQ, p_WP)
    middle = scale3(add3(p_WP, p_WQ), 0.5)
    put_body_rows(tree_model, tree, rows, r, SIX, owner, A, B, middle, middle, gap)
    put_equations(rows, r, turn)
    put_equations(rows, r + 3, gap)


@kernel
def put_constraints(tree_model, plant_model, problem, rows, tree, p, q):
    """Rows of all active constraints."""
    for i in range(len(plant_model.constraints)):
        constraint = plant_model.constraints[i]
        if p[constraint.active] > 0.0:
            kind = constraint.kind
            r = problem.num_rows
            if kind == COUPLER:
                put_coupler(tree_model, rows, r, i, constraint, p, q)
                problem.num_rows = r + 1
            elif kind == DISTANCE:
                put_distance(tree_model, tree, rows, r, i, constraint, p)
                problem.num_rows = r + 1
            elif kind == TENDON:
                put_tendon(tree_model, plant_model, problem, rows, i, constraint, p, q)
            elif kind == BALL:
                put_ball(tree_model, tree, rows, r, i, constraint, p)
                problem.num_rows = r + 3
            else:
                put_weld(tree_model, tree, rows, r, i, constraint, p)
                problem.num_rows = r + 6
