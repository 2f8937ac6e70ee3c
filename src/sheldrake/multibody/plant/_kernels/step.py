"""The discrete step: x+ = (q + dt N(q) v+, v+), with v+ from the contact problem (symplectic Euler).

    smooth motion -> contacts -> constraints -> solution -> next state

Each stage is an entry kernel, a row of the event loop: `_step/stages.py` puts together those a plant needs. Everything
but the joint damping and the constraints is explicit, taken at the start of the step. Joint damping is implicit: A = M
+ dt D (explicit under kTamsi, whose joint limits are penalties). Without a contact, a limit near, or a PD actuator, the
solver has nothing to do.
"""

import numpy as np

from sheldrake.common._kernels.generic import is_finite
from sheldrake.common._kernels.vec import SIX
from sheldrake.common.kernel import LaneMemory, Vector, Vectors, kernel
from sheldrake.geometry._kernels.model import ContactTable, GeometryModel
from sheldrake.geometry._kernels.table import place_geometry
from sheldrake.multibody.contact_solvers._kernels.laws import put_rows_ahead
from sheldrake.multibody.contact_solvers._kernels.problem import (
    ACTUATOR,
    CONTACT_CAPACITY,
    MASS_NOT_POSITIVE,
    MOTION_NOT_FINITE,
    SOLVED,
    Contacts,
    Counts,
    Problem,
    RowIndex,
    Rows,
    SolverModel,
    contacts_in_lanes,
    rows_in_lanes,
)
from sheldrake.multibody.plant._kernels.contacts import put_contacts
from sheldrake.multibody.plant._kernels.forces import (
    add_actuation,
    add_applied_forces,
    add_element_forces,
    add_limit_penalties,
    any_locked,
    lock_contacts,
    lock_mass_matrix,
    lock_motion,
    lock_rows,
    put_passive_forces,
)
from sheldrake.multibody.plant._kernels.model import PlantModel, StepVectors
from sheldrake.multibody.plant._kernels.rows import put_actuators, put_constraints, put_dry_friction, put_limits
from sheldrake.multibody.tree._kernels.dynamics import (
    bias_term,
    body_inertias,
    ltdl,
    ltdl_solve,
    mass_matrix_of_carried,
)
from sheldrake.multibody.tree._kernels.forces import ForceModel
from sheldrake.multibody.tree._kernels.integrate import (
    hold_back_gyroscopic_torques,
    integrate_positions,
    keep_momentum,
    shorten_quaternions,
)
from sheldrake.multibody.tree._kernels.kinematics import position_kinematics, velocity_kinematics
from sheldrake.multibody.tree._kernels.model import FREE, Body, TreeModel, TreeWork


@kernel
def copy(source, to):
    """Copies all numbers, four at a time."""
    n = source.shape[0]
    i = 0
    while i + 4 <= n:
        to[i], to[i + 1], to[i + 2], to[i + 3] = source[i], source[i + 1], source[i + 2], source[i + 3]
        i += 4
    while i < n:
        to[i] = source[i]
        i += 1


@kernel
def momentum_matrix(tree_model, solver_model, p, tree, problem, implicit_damping):
    """A of the problem; `composite` is as `bias_term` has left it."""
    mass_matrix_of_carried(tree_model, p, tree, problem.A)
    if implicit_damping:
        for k in range(len(tree_model.dofs)):
            dof = tree_model.dofs[k]
            problem.A[dof.row + dof.depth] += solver_model.dt * p[dof.damping]


@kernel
def rows_of_joints(xd, p, u, tree_model, solver_model, plant_model, problem, rows):
    """What of `joint_constraints` does not depend on v*; each row has one dof."""
    put_limits(tree_model, solver_model, plant_model, problem, rows, xd, False)
    put_dry_friction(tree_model, solver_model, plant_model, problem, rows)
    put_actuators(tree_model, solver_model, plant_model, problem, rows, p, xd, u)


@kernel
def free_motion(tree_model, solver_model, tree, problem, rows, v, force):
    """dt force and v* of the problem, and the factor; a status."""
    dt = solver_model.dt
    copy(problem.A, problem.L)
    for k in range(v.shape[0]):
        problem.p_star[k] = dt * force[k]
        tree.bias[k] = dt * force[k]  # becomes v* - v
    problem.rows_ahead = 0
    if solver_model.ahead == 1:
        put_rows_ahead(solver_model, problem, rows, tree.bias)
    if ltdl(tree_model, problem.L) >= 0:
        return MASS_NOT_POSITIVE
    ltdl_solve(tree_model, problem.L, tree.bias)
    for k in range(v.shape[0]):
        problem.v_star[k] = v[k] + tree.bias[k]
        if not is_finite(problem.v_star[k]):
            return MOTION_NOT_FINITE
    return SOLVED


def motions_of_free_bodies_and_others(
    tree_model: TreeModel, tree: TreeWork
) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Rows of `tree.S`, in runs: those that no step changes, and those that each one writes."""
    still = np.zeros(len(tree.S), bool)
    for dof in tree_model.body[tree_model.body[:, Body.kind] == FREE, Body.first_dof]:
        still[dof : dof + SIX] = True
    begins = np.flatnonzero(np.diff(still, prepend=~still[:1]))
    runs = np.split(tree.S, begins[1:])
    return [s for s, k in zip(runs, begins) if still[k]], [s for s, k in zip(runs, begins) if not still[k]]


def memory_in_lanes(
    xd: Vector,
    p: Vector,
    u: Vectors,
    tree: TreeWork,
    table: ContactTable,
    problem: Problem,
    rows: Rows,
    step: StepVectors,
    tree_model: TreeModel,
    *models: object,
) -> LaneMemory:
    """What `smooth_motion` reads and writes, for four worlds that call it at once."""
    count = problem.count[Counts.num_contacts : Counts.iterations]
    index, J, law, state = rows
    num_rows = problem.count[Counts.num_rows : Counts.rows_ahead]
    still, moving = motions_of_free_bodies_and_others(tree_model, tree)
    return LaneMemory(
        constant=(p, *still),
        reads=(xd, *u, step.applied_force, step.v_next),
        writes=(
            *(part for name, part in zip(tree._fields, tree) if name not in ("M", "L", "S")), *moving,
            table.X_WG, table.count, problem.A, problem.L, problem.v0, problem.v_star, problem.p_star, count,
            step.v, step.v_next, step.force, step.net_actuation,
        ),
        tables=(
            (index[:, : RowIndex.dofs.columns.start + 1], num_rows), (J[:, :1], num_rows), (law, num_rows),
            (state, num_rows),
        ),
    )  # fmt: skip


@kernel(top=True, short_loops=True, lanes=memory_in_lanes)
def smooth_motion(
    xd: Vector,
    p: Vector,
    u: Vectors,
    tree: TreeWork,
    table: ContactTable,
    problem: Problem,
    rows: Rows,
    step: StepVectors,
    tree_model: TreeModel,
    geometry_model: GeometryModel,
    solver_model: SolverModel,
    force_model: ForceModel,
    plant_model: PlantModel,
) -> int:
    """The motion without constraints, rows of joints, and where all geometry is; a status of `contact_solvers`."""
    implicit = solver_model.scalar_rows == 1
    v = step.v
    nq = xd.shape[0] - v.shape[0]
    for k in range(nq):
        if not is_finite(xd[k]):  # of what is free, velocities and their changes do not depend on it
            return MOTION_NOT_FINITE
    for k in range(v.shape[0]):
        v[k] = xd[nq + k]
    position_kinematics(tree_model, p, tree, xd)
    body_inertias(tree_model, p, tree)
    velocity_kinematics(tree_model, p, tree, xd, v)
    bias_term(tree_model, tree, 1.0)
    hold_back_gyroscopic_torques(tree_model, tree, solver_model.dt, solver_model.resolved_turn)
    put_passive_forces(tree_model, p, tree.bias, v, step.force)
    add_element_forces(tree_model, force_model, p, tree, xd, v, step.v_next, step.force)
    add_applied_forces(plant_model, u, step.applied_force, step.force)
    if not add_actuation(plant_model, u, step.force, step.net_actuation, implicit):
        return MOTION_NOT_FINITE  # also where a joint is locked, or an actuator without a desired state does nothing
    if not implicit:
        add_limit_penalties(plant_model, xd, v, step.force)
    locked = any_locked(plant_model, p)
    if locked:
        lock_motion(plant_model, p, v, step.force)
    place_geometry(geometry_model, tree, table)
    problem.num_contacts = 0
    problem.num_rows = 0
    for k in range(v.shape[0]):
        problem.v0[k] = v[k]
    momentum_matrix(tree_model, solver_model, p, tree, problem, implicit)
    if implicit:
        rows_of_joints(xd, p, u, tree_model, solver_model, plant_model, problem, rows)
    if locked:
        lock_mass_matrix(tree_model, plant_model, p, problem.A)
        lock_rows(plant_model, p, problem, rows)
    return free_motion(tree_model, solver_model, tree, problem, rows, v, step.force)


def reference_points(tree_model: TreeModel, tree: TreeWork) -> tuple[np.ndarray, ...]:
    """Where in `tree` the points are that motions are taken about."""
    return tuple(tree.X_WB[root] for root in np.unique(tree_model.body[:, Body.root]))


def contact_constraints_in_lanes(
    p: Vector,
    tree: TreeWork,
    table: ContactTable,
    problem: Problem,
    contacts: Contacts,
    tree_model: TreeModel,
    *models: object,
) -> LaneMemory:
    """What `contact_constraints` reads and writes, for four worlds that call it at once."""
    tables, count = contacts_in_lanes(problem, contacts), (problem.count,)
    reads = *reference_points(tree_model, tree), tree.S
    return LaneMemory(constant=(p,), reads=reads, writes=count, tables=tables, changes=count)


@kernel(top=True, short_loops=True, lanes=contact_constraints_in_lanes)
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
    count = table.num_contacts
    if table.status != 0 or count > contacts.law.shape[0]:
        return CONTACT_CAPACITY
    problem.num_contacts = count
    put_contacts(tree_model, geometry_model, p, tree, table, contacts, count)
    if any_locked(plant_model, p):
        lock_contacts(plant_model, p, problem, contacts)
    return SOLVED


def joint_constraints_in_lanes(
    xd: Vector,
    p: Vector,
    tree: TreeWork,
    problem: Problem,
    rows: Rows,
    tree_model: TreeModel,
    solver_model: SolverModel,
    plant_model: PlantModel,
) -> LaneMemory:
    """What `joint_constraints` reads and writes, for four worlds that call it at once."""
    tables, count = rows_in_lanes(problem, rows), (problem.count,)
    bodies = (tree.X_WB, tree.S) if len(plant_model.constraint) else ()
    return LaneMemory(constant=(p,), reads=(xd, *bodies), writes=count, tables=tables, changes=count)


@kernel(top=True, short_loops=True, lanes=joint_constraints_in_lanes)
def joint_constraints(
    xd: Vector,
    p: Vector,
    tree: TreeWork,
    problem: Problem,
    rows: Rows,
    tree_model: TreeModel,
    solver_model: SolverModel,
    plant_model: PlantModel,
) -> None:
    """Constraints between bodies, and limits that are reached with v* alone, as further rows of the problem."""
    before = problem.num_rows
    put_limits(tree_model, solver_model, plant_model, problem, rows, xd, True)
    put_constraints(tree_model, plant_model, problem, rows, tree, p, xd)
    if problem.num_rows > before and any_locked(plant_model, p):
        lock_rows(plant_model, p, problem, rows)


@kernel
def take_step(tree_model, solver_model, xd, tree, problem, rows, step, out):
    """x+ from the velocities of the solution; what PD actuators did."""
    dt = solver_model.dt
    nv = step.v.shape[0]
    nq = xd.shape[0] - nv
    for r in range(problem.num_rows):
        row = rows[r]
        if row.kind == ACTUATOR:
            step.net_actuation[row.owner] = row.gamma / dt
    for k in range(nv):
        step.v_next[k] = problem.v[k]
        out[nq + k] = problem.v[k]
    integrate_positions(tree_model, xd, step.v_next, dt, out)


def next_state_in_lanes(
    xd: Vector,
    tree: TreeWork,
    problem: Problem,
    rows: Rows,
    step: StepVectors,
    tree_model: TreeModel,
    *others: object,
) -> LaneMemory:
    """What the next state is made of, where all else is done by four worlds at once."""
    count = problem.count[Counts.num_contacts : Counts.iterations]
    num_rows = problem.count[Counts.num_rows : Counts.rows_ahead]
    spins = [
        part[base.first_body]
        for base in (tree_model.trees[t] for t in range(len(tree_model.tree)))
        if base.num_dofs == SIX and tree_model.bodies[base.first_body].kind == FREE
        for part in (tree.V, tree.inertia, tree.composite)
    ]
    return LaneMemory(
        reads=(count, problem.v, step.v, *spins),
        writes=(step.v_next, step.net_actuation),
        tables=((rows.index[:, RowIndex.kind : RowIndex.group], num_rows), (rows.state, num_rows)),
    )


@kernel(top=True, short_loops=True, lanes=next_state_in_lanes)
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
    """x+ from the velocities of the solution, as in Drake; what PD actuators did."""
    take_step(tree_model, solver_model, xd, tree, problem, rows, step, out)


@kernel(top=True, short_loops=True, lanes=next_state_in_lanes)
def next_state_with_momentum(
    xd: Vector,
    tree: TreeWork,
    problem: Problem,
    rows: Rows,
    step: StepVectors,
    tree_model: TreeModel,
    solver_model: SolverModel,
    out: Vector,
) -> None:
    """`next_state`, in which what spins freely keeps its angular momentum."""
    take_step(tree_model, solver_model, xd, tree, problem, rows, step, out)
    nq = xd.shape[0] - step.v.shape[0]
    dt, resolved = solver_model.dt, solver_model.resolved_turn
    keep_momentum(tree_model, tree, step.v, step.v_next, dt, resolved, xd, out, nq)
    shorten_quaternions(tree_model, out)
