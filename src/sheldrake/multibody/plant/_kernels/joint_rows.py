"""Scalar rows of joints: position limits near enough to matter in this step, dry friction, and PD control."""

import numpy as np

from sheldrake.common.kernel import kernel
from sheldrake.multibody.contact_solvers._kernels.newton import magnitude
from sheldrake.multibody.contact_solvers._kernels.problem import ACTUATOR, DRY_FRICTION, LIMIT
from sheldrake.multibody.plant._kernels.forces import commanded_effort

LIMIT_STIFFNESS = 1e12  # [N/m or N m/rad]
STUCK_DAMPING = 1e12  # [N s/m or N m s/rad]: stiffer than any time step resolves
REACH = 2.0  # a limit counts within so many steps at the present speed
INFINITE = np.inf


@kernel
def put_index(row, width, tree_a, tree_b, kind, owner, group):
    """Who moves a row and what it is; see `RowIndex`."""
    row.width = width
    row.tree_a, row.tree_b = tree_a, tree_b
    row.kind, row.owner, row.group = kind, owner, group


@kernel
def put_law(row, lower, upper, gap, stiffness, relaxation):
    """Least and largest impulse of a row, and what its regularisation and velocity are made of; see `RowLaw`."""
    row.lower, row.upper = lower, upper
    row.gap, row.stiffness, row.relaxation = gap, stiffness, relaxation


@kernel
def put_joint_row(tree_model, problem, rows, dof, kind, owner, sign):
    """Index and Jacobian of a row on one dof; the row."""
    row = rows[problem.num_rows]
    problem.num_rows += 1
    put_index(row, 1, tree_model.dofs[dof].tree, -1, kind, owner, 1)
    row.dofs[0] = dof
    row.J[0] = sign
    return row


@kernel
def put_limit(tree_model, problem, rows, dof, owner, gap, sign, dt):
    row = put_joint_row(tree_model, problem, rows, dof, LIMIT, owner, sign)
    put_law(row, 0.0, INFINITE, gap, LIMIT_STIFFNESS, dt)


@kernel
def has_desired_state(plant_model, u, i):
    """Whether actuator i is under PD control and told where to go; an input port without a value holds NaN."""
    actuator = plant_model.actuators[i]
    port = actuator.desired_port
    if port >= 0:
        if u[port].shape[0] > 0:
            desired = u[port][actuator.desired_q]
            return desired == desired
    return False


@kernel
def put_limits(tree_model, solver_model, plant_model, problem, rows, q):
    """Rows of the position limits that the joint may reach within two steps: q0 - q_lower >= 0, q_upper - q0 >= 0."""
    dt = solver_model.dt
    for i in range(len(plant_model.limits)):
        limit, bound = plant_model.limits[i], plant_model.bounds[i]
        dof = limit.dof
        speed = magnitude(problem.v0[dof])
        free_speed = magnitude(problem.v_star[dof])
        if free_speed > speed:
            speed = free_speed
        reach = REACH * dt * speed
        below = q[limit.q] - bound.lower
        above = bound.upper - q[limit.q]
        if below <= reach:
            put_limit(tree_model, problem, rows, dof, i, below, 1.0, dt)
        if above <= reach:
            put_limit(tree_model, problem, rows, dof, i, above, -1.0, dt)


@kernel
def put_dry_friction(tree_model, solver_model, plant_model, problem, rows):
    """Rows that hold joints still as far as their dry friction goes: dampers as stiff as the time step resolves."""
    dt = solver_model.dt
    for i in range(plant_model.friction.shape[0]):
        effort = plant_model.friction_effort[i]
        row = put_joint_row(tree_model, problem, rows, plant_model.friction[i], DRY_FRICTION, i, 1.0)
        put_law(row, -dt * effort, dt * effort, 0.0, 0.0, STUCK_DAMPING)
        row.rate, row.forward = 0.0, 0.0


@kernel
def put_actuators(tree_model, solver_model, plant_model, problem, rows, p, q, u):
    """Rows of the actuators under PD control that have a desired state.

    gamma = dt clamp(-Kp (q0 + dt v - q_desired) - Kd (v - v_desired) + u0, -effort, effort).
    """
    dt = solver_model.dt
    for i in range(len(plant_model.actuators)):
        actuator = plant_model.actuators[i]
        if has_desired_state(plant_model, u, i):
            gain = plant_model.gains[i]
            effort = gain.effort_limit
            kp, kd = gain.p, gain.d
            if actuator.gains >= 0:
                kp, kd = kp * p[actuator.gains], kd * p[actuator.gains + 1]
            desired = u[actuator.desired_port]
            row = put_joint_row(tree_model, problem, rows, actuator.dof, ACTUATOR, i, 1.0)
            put_law(row, -dt * effort, dt * effort, q[actuator.q] - desired[actuator.desired_q], kp, kd)
            row.rate = desired[actuator.desired_v]
            row.forward = commanded_effort(plant_model, u, i)
