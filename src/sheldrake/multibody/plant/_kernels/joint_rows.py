"""Scalar rows of joints: position limits near enough to matter in this step, dry friction, and PD control."""

import numpy as np

from sheldrake.common.kernel import kernel
from sheldrake.multibody.contact_solvers._kernels.line_search import magnitude
from sheldrake.multibody.contact_solvers._kernels.problem import (
    ACTUATOR,
    DRY_FRICTION,
    DT,
    LIMIT,
    NUM_ROWS,
    ROW_DOFS,
    ROW_FORWARD,
    ROW_GAP,
    ROW_GROUP,
    ROW_KIND,
    ROW_LOWER,
    ROW_OWNER,
    ROW_RATE,
    ROW_RELAXATION,
    ROW_STIFFNESS,
    ROW_UPPER,
    TREE_A,
    TREE_B,
    V0,
    V_STAR,
    WIDTH,
)
from sheldrake.multibody.plant._kernels.forces import commanded_effort
from sheldrake.multibody.plant._kernels.model import (
    ACTUATOR_DOF,
    ACTUATOR_Q,
    DESIRED_PORT,
    DESIRED_Q,
    DESIRED_V,
    EFFORT_LIMIT,
    GAIN_D,
    GAIN_P,
    LIMIT_DOF,
    LIMIT_Q,
    LOWER,
    UPPER,
)
from sheldrake.multibody.tree._kernels.model import DOF_TREE

LIMIT_STIFFNESS = np.float64(1e12)  # [N/m or N m/rad]
STUCK_DAMPING = np.float64(1e12)  # [N s/m or N m s/rad]: stiffer than any time step resolves
REACH = np.float64(2.0)  # a limit counts within so many steps at the present speed
INFINITE = np.float64(np.inf)


@kernel
def put_joint_row(tree_model, problem, rows, dof, kind, owner, sign):
    """Index and Jacobian of a row on one dof; its number."""
    r = problem.count[NUM_ROWS]
    problem.count[NUM_ROWS] = r + 1
    rows.index[r, WIDTH] = 1
    rows.index[r, TREE_A] = tree_model.dof[dof, DOF_TREE]
    rows.index[r, TREE_B] = -1
    rows.index[r, ROW_KIND] = kind
    rows.index[r, ROW_OWNER] = owner
    rows.index[r, ROW_GROUP] = 1
    rows.index[r, ROW_DOFS] = dof
    rows.J[r, 0] = sign
    return r


@kernel
def put_limit(tree_model, problem, rows, dof, owner, gap, sign, dt):
    r = put_joint_row(tree_model, problem, rows, dof, LIMIT, owner, sign)
    rows.law[r, ROW_LOWER] = 0.0
    rows.law[r, ROW_UPPER] = INFINITE
    rows.law[r, ROW_GAP] = gap
    rows.law[r, ROW_STIFFNESS] = LIMIT_STIFFNESS
    rows.law[r, ROW_RELAXATION] = dt


@kernel
def has_desired_state(plant_model, u, i):
    """Whether actuator i is under PD control and told where to go; an input port without a value holds NaN."""
    port = plant_model.actuator[i, DESIRED_PORT]
    if port >= 0:
        if u[port].shape[0] > 0:
            desired = u[port][plant_model.actuator[i, DESIRED_Q]]
            return desired == desired
    return False


@kernel
def put_limits(tree_model, solver_model, plant_model, problem, rows, q):
    """Rows of the position limits that the joint may reach within two steps."""
    dt = solver_model.option[DT]
    for i in range(plant_model.limit.shape[0]):
        dof = plant_model.limit[i, LIMIT_DOF]
        speed = magnitude(problem.x[V0, dof])
        free_speed = magnitude(problem.x[V_STAR, dof])
        if free_speed > speed:
            speed = free_speed
        reach = REACH * dt * speed
        position = q[plant_model.limit[i, LIMIT_Q]]
        below = position - plant_model.bound[i, LOWER]
        above = plant_model.bound[i, UPPER] - position
        if below <= reach:
            put_limit(tree_model, problem, rows, dof, i, below, 1.0, dt)
        if above <= reach:
            put_limit(tree_model, problem, rows, dof, i, above, -1.0, dt)


@kernel
def put_dry_friction(tree_model, solver_model, plant_model, problem, rows):
    """Rows that hold joints still as far as their dry friction goes: dampers as stiff as the time step resolves."""
    dt = solver_model.option[DT]
    for i in range(plant_model.friction.shape[0]):
        effort = plant_model.friction_effort[i]
        r = put_joint_row(tree_model, problem, rows, plant_model.friction[i], DRY_FRICTION, i, 1.0)
        rows.law[r, ROW_LOWER] = -dt * effort
        rows.law[r, ROW_UPPER] = dt * effort
        rows.law[r, ROW_GAP] = 0.0
        rows.law[r, ROW_STIFFNESS] = 0.0
        rows.law[r, ROW_RELAXATION] = STUCK_DAMPING
        rows.law[r, ROW_RATE] = 0.0
        rows.law[r, ROW_FORWARD] = 0.0


@kernel
def put_actuators(tree_model, solver_model, plant_model, problem, rows, q, u):
    """Rows of the actuators under PD control that have a desired state."""
    dt = solver_model.option[DT]
    for i in range(plant_model.actuator.shape[0]):
        dof = plant_model.actuator[i, ACTUATOR_DOF]
        if has_desired_state(plant_model, u, i):
            port = plant_model.actuator[i, DESIRED_PORT]
            effort = plant_model.gain[i, EFFORT_LIMIT]
            r = put_joint_row(tree_model, problem, rows, dof, ACTUATOR, i, 1.0)
            rows.law[r, ROW_LOWER] = -dt * effort
            rows.law[r, ROW_UPPER] = dt * effort
            desired = u[port][plant_model.actuator[i, DESIRED_Q]]
            rows.law[r, ROW_GAP] = q[plant_model.actuator[i, ACTUATOR_Q]] - desired
            rows.law[r, ROW_STIFFNESS] = plant_model.gain[i, GAIN_P]
            rows.law[r, ROW_RELAXATION] = plant_model.gain[i, GAIN_D]
            rows.law[r, ROW_RATE] = u[port][plant_model.actuator[i, DESIRED_V]]
            rows.law[r, ROW_FORWARD] = commanded_effort(plant_model, u, i)
