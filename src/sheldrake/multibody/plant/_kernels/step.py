"""The discrete step: x+ = (q + dt N(q) v+, v+), with v+ from the contact problem (symplectic Euler).

    kinematics, inertias, bias -> free-motion velocity v* -> contacts -> rows -> v+ -> q+

Everything but the joint damping and the constraints is explicit, taken at the start of the step. Joint damping is
implicit: A = M + dt D (explicit under kTamsi, whose joint limits are penalties). Without a contact, a limit near, or a
PD actuator, no solver runs.
"""

from sheldrake.common.kernel import Vector, Vectors, kernel
from sheldrake.geometry._kernels.contacts import find_contacts
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
    V0,
    V_STAR,
    Contacts,
    Factor,
    Problem,
    Rows,
    SolverModel,
    V,
)
from sheldrake.multibody.contact_solvers._kernels.solve import solve_rows, solve_rows_tamsi
from sheldrake.multibody.contact_solvers._kernels.status import (
    CONTACT_CAPACITY,
    MASS_NOT_POSITIVE,
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
from sheldrake.multibody.plant._kernels.joint_rows import put_actuators, put_limits
from sheldrake.multibody.plant._kernels.locks import lock_contacts, lock_mass_matrix, lock_motion, lock_rows
from sheldrake.multibody.plant._kernels.model import PlantModel, StepWork
from sheldrake.multibody.tree._kernels.dynamics import bias_term, body_inertias, mass_matrix
from sheldrake.multibody.tree._kernels.factor import ltdl, ltdl_solve
from sheldrake.multibody.tree._kernels.forces import ForceModel
from sheldrake.multibody.tree._kernels.integrate import integrate_positions
from sheldrake.multibody.tree._kernels.kinematics import position_kinematics, velocity_kinematics
from sheldrake.multibody.tree._kernels.model import DAMPING, DEPTH, ROW, TreeModel, TreeWork


@kernel
def tree_work(work):
    return TreeWork(
        work.tree_X_WB,
        work.tree_S,
        work.tree_V,
        work.tree_A,
        work.tree_inertia,
        work.tree_composite,
        work.tree_F,
        work.tree_M,
        work.tree_L,
        work.tree_bias,
    )


@kernel
def contact_table(work):
    return ContactTable(
        work.table_pair,
        work.table_point,
        work.table_count,
        work.table_X_WG,
        work.table_work,
        work.table_iwork,
    )


@kernel
def free_motion(tree_model, solver_model, plant_model, p, tree, x, v, force, implicit_damping):
    """A in tree.M, dt force and v* in the problem's vectors; 1 when A is not positive definite, else 0."""
    dt = solver_model.option[DT]
    mass_matrix(tree_model, p, tree)
    if implicit_damping:
        for k in range(tree_model.dof.shape[0]):
            tree.M[tree_model.dof[k, ROW] + tree_model.dof[k, DEPTH]] += dt * p[tree_model.dof[k, DAMPING]]
    lock_mass_matrix(tree_model, plant_model, p, tree.M)
    for i in range(tree.M.shape[0]):
        tree.L[i] = tree.M[i]
    if ltdl(tree_model, tree.L) >= 0:
        return 1
    for k in range(v.shape[0]):
        x[V0, k] = v[k]
        x[P_STAR, k] = dt * force[k]
        tree.bias[k] = dt * force[k]  # becomes v* - v
    ltdl_solve(tree_model, tree.L, tree.bias)
    for k in range(v.shape[0]):
        x[V_STAR, k] = v[k] + tree.bias[k]
    return 0


@kernel
def smooth_part(xd, p, u, work, tree, tree_model, solver_model, force_model, plant_model, tamsi):
    """Kinematics, forces and free motion; 1 when the mass matrix is not positive definite, else 0."""
    nv = work.v.shape[0]
    nq = xd.shape[0] - nv
    for k in range(nv):
        work.v[k] = xd[nq + k]
    position_kinematics(tree_model, p, tree, xd)
    body_inertias(tree_model, p, tree)
    velocity_kinematics(tree_model, p, tree, xd, work.v)
    bias_term(tree_model, tree, 1.0)
    put_passive_forces(tree_model, p, tree.bias, work.v, work.force)
    add_element_forces(tree_model, force_model, p, tree, xd, work.v_next, work.force)
    add_applied_forces(plant_model, u, work.applied_force, work.force)
    add_actuation(plant_model, u, work.force, work.net_actuation, not tamsi)
    if tamsi:
        add_limit_penalties(plant_model, xd, work.v, work.force)
    lock_motion(plant_model, p, work.v, work.force)
    return free_motion(tree_model, solver_model, plant_model, p, tree, work.problem_x, work.v, work.force, not tamsi)


@kernel
def contact_part(work, tree, contacts, tree_model, geometry_model):
    """Contacts and their rows; a status."""
    table = contact_table(work)
    count = find_contacts(geometry_model, tree.X_WB, table)
    work.problem_count[NUM_CONTACTS] = 0
    work.problem_count[NUM_ROWS] = 0
    if count < 0 or count > contacts.law.shape[0]:
        return CONTACT_CAPACITY
    work.problem_count[NUM_CONTACTS] = count
    put_contacts(tree_model, geometry_model, tree, table, contacts, count)
    return SOLVED


@kernel
def take_step(xd, work, tree_model, dt, out):
    """x+ from the velocities of the solve."""
    nv = work.v.shape[0]
    nq = xd.shape[0] - nv
    for k in range(nv):
        work.v_next[k] = work.problem_x[V, k]
        out[nq + k] = work.problem_x[V, k]
    integrate_positions(tree_model, xd, work.v_next, dt, out)


@kernel(top=True)
def plant_step(
    xd: Vector,
    p: Vector,
    u: Vectors,
    work: StepWork,
    tree_model: TreeModel,
    geometry_model: GeometryModel,
    solver_model: SolverModel,
    force_model: ForceModel,
    plant_model: PlantModel,
    out: Vector,
) -> int:
    """x+ of a discrete plant under kLagged, kSimilar or kSap; a status of `contact_solvers`, 0 when all is well."""
    tree = tree_work(work)
    problem = Problem(work.tree_M, work.problem_x, work.problem_tree, work.problem_count)
    contacts = Contacts(work.contacts_index, work.contacts_J, work.contacts_law, work.contacts_state)
    rows = Rows(work.rows_index, work.rows_J, work.rows_law, work.rows_state)
    factor = Factor(work.factor_slot, work.factor_row, work.factor_first, work.factor_L, work.factor_rhs)
    dt = solver_model.option[DT]
    if smooth_part(xd, p, u, work, tree, tree_model, solver_model, force_model, plant_model, False) != 0:
        return MASS_NOT_POSITIVE
    status = contact_part(work, tree, contacts, tree_model, geometry_model)
    if status != SOLVED:
        return status
    lock_contacts(plant_model, p, contacts, problem.count)
    put_limits(tree_model, solver_model, plant_model, problem, rows, xd)
    put_constraints(tree_model, plant_model, problem, rows, tree, p, xd)
    put_actuators(tree_model, solver_model, plant_model, problem, rows, xd, u)
    lock_rows(plant_model, p, rows, problem.count)
    status = solve_rows(solver_model, problem, contacts, rows, factor)
    if status != SOLVED:
        return status
    for r in range(problem.count[NUM_ROWS]):
        if rows.index[r, ROW_KIND] == ACTUATOR:
            work.net_actuation[rows.index[r, ROW_OWNER]] = rows.state[r, ROW_GAMMA] / dt
    take_step(xd, work, tree_model, dt, out)
    return SOLVED


@kernel(top=True)
def plant_step_tamsi(
    xd: Vector,
    p: Vector,
    u: Vectors,
    work: StepWork,
    tree_model: TreeModel,
    geometry_model: GeometryModel,
    solver_model: SolverModel,
    force_model: ForceModel,
    plant_model: PlantModel,
    out: Vector,
) -> int:
    """x+ of a discrete plant under kTamsi; a status of `contact_solvers`, 0 when all is well."""
    tree = tree_work(work)
    problem = Problem(work.tree_M, work.problem_x, work.problem_tree, work.problem_count)
    contacts = Contacts(work.contacts_index, work.contacts_J, work.contacts_law, work.contacts_state)
    rows = Rows(work.rows_index, work.rows_J, work.rows_law, work.rows_state)
    factor = Factor(work.factor_slot, work.factor_row, work.factor_first, work.factor_L, work.factor_rhs)
    if smooth_part(xd, p, u, work, tree, tree_model, solver_model, force_model, plant_model, True) != 0:
        return MASS_NOT_POSITIVE
    status = contact_part(work, tree, contacts, tree_model, geometry_model)
    if status != SOLVED:
        return status
    lock_contacts(plant_model, p, contacts, problem.count)
    status = solve_rows_tamsi(solver_model, problem, contacts, rows, factor)
    if status != SOLVED:
        return status
    take_step(xd, work, tree_model, solver_model.option[DT], out)
    return SOLVED
