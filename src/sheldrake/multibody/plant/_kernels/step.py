"""The discrete step: x+ = (q + dt N(q) v+, v+), with v+ from the contact problem (symplectic Euler).

    smooth motion -> contacts -> constraints -> solution -> next state

Each stage is an entry kernel, a row of the event loop: `_step/stages.py` puts together those a plant needs. Everything
but the joint damping and the constraints is explicit, taken at the start of the step. Joint damping is implicit: A = M
+ dt D (explicit under kTamsi, whose joint limits are penalties). Without a contact, a limit near, or a PD actuator, the
solver has nothing to do.
"""

import numpy as np

from sheldrake.common._kernels.generic import is_finite
from sheldrake.common.kernel import Vector, Vectors, kernel
from sheldrake.geometry._kernels.contacts import begin_contacts
from sheldrake.geometry._kernels.model import ContactTable, GeometryModel
from sheldrake.multibody.contact_solvers._kernels.problem import (
    ACTUATOR,
    DT,
    NUM_CONTACTS,
    NUM_ROWS,
    P_STAR,
    ROW_GAMMA,
    ROW_KIND,
    ROW_OWNER,
    SETTLE,
    V0,
    V_STAR,
    Contacts,
    Problem,
    Rows,
    SolverModel,
    V,
)
from sheldrake.multibody.contact_solvers._kernels.status import (
    CONTACT_CAPACITY,
    MASS_NOT_POSITIVE,
    MOTION_NOT_FINITE,
    SOLVED,
)
from sheldrake.multibody.plant._kernels.constraint_rows import put_constraints
from sheldrake.multibody.plant._kernels.contact_rows import put_contacts
from sheldrake.multibody.plant._kernels.forces import (
    add_actuation,
    add_applied_forces,
    add_element_forces,
    add_limit_penalties,
    put_passive_forces,
)
from sheldrake.multibody.plant._kernels.joint_rows import put_actuators, put_dry_friction, put_limits
from sheldrake.multibody.plant._kernels.locks import lock_contacts, lock_mass_matrix, lock_motion, lock_rows
from sheldrake.multibody.plant._kernels.model import PlantModel, StepVectors
from sheldrake.multibody.plant._kernels.spin import hold_back_gyroscopic_torques, keep_momentum, shorten_quaternions
from sheldrake.multibody.tree._kernels.dynamics import bias_term, body_inertias, mass_matrix
from sheldrake.multibody.tree._kernels.factor import ltdl, ltdl_solve
from sheldrake.multibody.tree._kernels.forces import ForceModel
from sheldrake.multibody.tree._kernels.integrate import integrate_positions
from sheldrake.multibody.tree._kernels.kinematics import position_kinematics, velocity_kinematics
from sheldrake.multibody.tree._kernels.model import DAMPING, DEPTH, ROW, TreeModel, TreeWork


@kernel
def copy_to_both(source, one, other):
    """Copies all numbers to two arrays, four at a time."""
    n = source.shape[0]
    i = np.int64(0)
    while i + 4 <= n:
        a, b, c, d = source[i], source[i + 1], source[i + 2], source[i + 3]
        one[i], one[i + 1], one[i + 2], one[i + 3] = a, b, c, d
        other[i], other[i + 1], other[i + 2], other[i + 3] = a, b, c, d
        i += 4
    while i < n:
        one[i] = source[i]
        other[i] = source[i]
        i += 1


@kernel
def free_motion(tree_model, solver_model, plant_model, p, tree, problem, v, force, implicit_damping):
    """A, dt force and v* of the problem; a status."""
    dt = solver_model.option[DT]
    x = problem.x
    mass_matrix(tree_model, p, tree)
    if implicit_damping:
        for k in range(tree_model.dof.shape[0]):
            tree.M[tree_model.dof[k, ROW] + tree_model.dof[k, DEPTH]] += dt * p[tree_model.dof[k, DAMPING]]
    lock_mass_matrix(tree_model, plant_model, p, tree.M)
    copy_to_both(tree.M, tree.L, problem.A)
    if ltdl(tree_model, tree.L) >= 0:
        return MASS_NOT_POSITIVE
    for k in range(v.shape[0]):
        x[V0, k] = v[k]
        x[P_STAR, k] = dt * force[k]
        tree.bias[k] = dt * force[k]  # becomes v* - v
    ltdl_solve(tree_model, tree.L, tree.bias)
    for k in range(v.shape[0]):
        x[V_STAR, k] = v[k] + tree.bias[k]
        if not is_finite(x[V_STAR, k]):
            return MOTION_NOT_FINITE
    return SOLVED


@kernel
def move_freely(
    xd, p, u, tree, table, problem, step, tree_model, geometry_model, solver_model, force_model, plant_model, tamsi
):
    """Kinematics, forces and free motion; places the geometry. A status."""
    v = step.v
    nq = xd.shape[0] - v.shape[0]
    for k in range(v.shape[0]):
        v[k] = xd[nq + k]
    position_kinematics(tree_model, p, tree, xd)
    body_inertias(tree_model, p, tree)
    velocity_kinematics(tree_model, p, tree, xd, v)
    bias_term(tree_model, tree, 1.0)
    if solver_model.setting[SETTLE] == 1:
        hold_back_gyroscopic_torques(tree_model, tree, solver_model.option[DT])
    put_passive_forces(tree_model, p, tree.bias, v, step.force)
    add_element_forces(tree_model, force_model, p, tree, xd, v, step.v_next, step.force)
    add_applied_forces(plant_model, u, step.applied_force, step.force)
    add_actuation(plant_model, u, step.force, step.net_actuation, not tamsi)
    if tamsi:
        add_limit_penalties(plant_model, xd, v, step.force)
    lock_motion(plant_model, p, v, step.force)
    begin_contacts(geometry_model, tree.X_WB, table)
    problem.count[NUM_CONTACTS] = 0
    problem.count[NUM_ROWS] = 0
    return free_motion(tree_model, solver_model, plant_model, p, tree, problem, v, step.force, not tamsi)


@kernel(top=True, short_loops=True)
def smooth_motion(
    xd: Vector,
    p: Vector,
    u: Vectors,
    tree: TreeWork,
    table: ContactTable,
    problem: Problem,
    step: StepVectors,
    tree_model: TreeModel,
    geometry_model: GeometryModel,
    solver_model: SolverModel,
    force_model: ForceModel,
    plant_model: PlantModel,
) -> int:
    """The motion without constraints, and where all geometry is; a status of `contact_solvers`."""
    return move_freely(
        xd, p, u, tree, table, problem, step, tree_model, geometry_model, solver_model, force_model, plant_model, False
    )


@kernel(top=True, short_loops=True)
def smooth_motion_tamsi(
    xd: Vector,
    p: Vector,
    u: Vectors,
    tree: TreeWork,
    table: ContactTable,
    problem: Problem,
    step: StepVectors,
    tree_model: TreeModel,
    geometry_model: GeometryModel,
    solver_model: SolverModel,
    force_model: ForceModel,
    plant_model: PlantModel,
) -> int:
    """`smooth_motion` under kTamsi."""
    return move_freely(
        xd, p, u, tree, table, problem, step, tree_model, geometry_model, solver_model, force_model, plant_model, True
    )


@kernel(top=True, short_loops=True)
def contact_constraints(
    p: Vector,
    tree: TreeWork,
    table: ContactTable,
    problem: Problem,
    contacts: Contacts,
    tree_model: TreeModel,
    geometry_model: GeometryModel,
    plant_model: PlantModel,
) -> int:
    """The contacts found as rows of the problem; a status of `contact_solvers`."""
    count = table.count[0]
    if table.count[1] != 0 or count > contacts.law.shape[0]:
        return CONTACT_CAPACITY
    problem.count[NUM_CONTACTS] = count
    put_contacts(tree_model, geometry_model, tree, table, contacts, count)
    lock_contacts(plant_model, p, contacts, problem.count)
    return SOLVED


@kernel(top=True, short_loops=True)
def joint_constraints(
    xd: Vector,
    p: Vector,
    u: Vectors,
    tree: TreeWork,
    problem: Problem,
    rows: Rows,
    tree_model: TreeModel,
    solver_model: SolverModel,
    plant_model: PlantModel,
) -> None:
    """Limits, constraints between bodies, dry friction, and PD actuators as rows of the problem."""
    put_limits(tree_model, solver_model, plant_model, problem, rows, xd)
    put_constraints(tree_model, plant_model, problem, rows, tree, p, xd)
    put_dry_friction(tree_model, solver_model, plant_model, problem, rows)
    put_actuators(tree_model, solver_model, plant_model, problem, rows, xd, u)
    lock_rows(plant_model, p, rows, problem.count)


@kernel(top=True, short_loops=True)
def next_state(
    xd: Vector,
    tree: TreeWork,
    problem: Problem,
    rows: Rows,
    step: StepVectors,
    tree_model: TreeModel,
    solver_model: SolverModel,
    out: Vector,
) -> None:
    """x+ from the velocities of the solution; what PD actuators did."""
    dt = solver_model.option[DT]
    nv = step.v.shape[0]
    nq = xd.shape[0] - nv
    for r in range(problem.count[NUM_ROWS]):
        if rows.index[r, ROW_KIND] == ACTUATOR:
            step.net_actuation[rows.index[r, ROW_OWNER]] = rows.state[r, ROW_GAMMA] / dt
    for k in range(nv):
        step.v_next[k] = problem.x[V, k]
        out[nq + k] = problem.x[V, k]
    integrate_positions(tree_model, xd, step.v_next, dt, out)
    if solver_model.setting[SETTLE] == 1:
        keep_momentum(tree_model, tree, step.v, step.v_next, dt, xd, out, nq)
        shorten_quaternions(tree_model, out)
