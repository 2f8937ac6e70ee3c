"""Before the first iteration: who takes part, how heavy each constraint is (Delassus estimate), and its law."""

import numpy as np

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common._kernels.vec import add3, column3, dot3, scale3
from sheldrake.common.kernel import kernel
from sheldrake.multibody.contact_solvers._kernels.gradient import is_chain_of_six, put_velocity
from sheldrake.multibody.contact_solvers._kernels.laws import half_a_step_back
from sheldrake.multibody.contact_solvers._kernels.problem import (
    ACTUATOR,
    DRY_FRICTION,
    SAP,
    TAMSI,
    VC,
    diagonal,
    dofs_of_tree,
)
from sheldrake.multibody.contact_solvers._kernels.sap import closing_speed, guess_slip
from sheldrake.multibody.contact_solvers._kernels.six import (
    SIX,
    dot_six,
    inverse_packed_diagonal_six,
    load_six,
    load_three_sixes,
    norms2_six,
    store_six,
    times_six,
)

FIRST = 0  # column
FOUR_PI_SQUARED = 4.0 * np.pi**2
LEAST = 1.0 - 1e-9  # of what must not be taken for smaller than it is


@kernel
def leave_free(model, problem):
    """Takes every tree out of the solve."""
    for t in range(len(model.trees)):
        problem.trees[t].active = 0


@kernel
def mark_trees(problem, constraints, count):
    """A tree takes part when a constraint touches it."""
    for c in range(count):
        for t in (constraints[c].tree_a, constraints[c].tree_b):
            if t >= 0:
                problem.trees[t].active = 1


@kernel
def mobilities(model, problem):
    """1 / diag(A) of the dofs that take part."""
    for t in range(len(model.trees)):
        if problem.trees[t].active == 1:
            first = model.trees[t].first_dof
            if is_chain_of_six(model, t):
                m = inverse_packed_diagonal_six(problem.A, model.dofs[first].row_start)
                store_six(problem.mobility, first, m)
            else:
                for k in dofs_of_tree(model, t):
                    problem.mobility[k] = 1.0 / problem.A[diagonal(model, k)]


@kernel
def trees_of_six(model, contact):
    """Of how many trees the columns of a contact are, if all of these have six dofs that all move it; else 0."""
    n = 0
    for t in (contact.tree_a, contact.tree_b):
        if t >= 0:
            if model.trees[t].num_dofs != SIX:
                return 0
            n += 1
    return n if contact.width == SIX * n else 0


@kernel(outline=True)
def contact_delassus(problem, contact):
    """w = |J diag(1/A) J^T|_F / 3 of one contact [1/kg]."""
    if contact.sixes > 0:
        diagonal, sides = delassus_of_six(problem, contact, FIRST)
        if contact.sixes > 1:
            diagonal_B, sides_B = delassus_of_six(problem, contact, SIX)
            diagonal = add3(diagonal, diagonal_B)
            sides = add3(sides, sides_B)
    else:
        diagonal, sides = delassus_of_any(problem, contact)
    return sqrt(dot3(diagonal, diagonal) + 2.0 * dot3(sides, sides)) / 3.0


@kernel
def largest_delassus(problem, contact):
    """What w of a contact is at most: the trace of J diag(1/A) J^T / 3, which takes a third of the work."""
    total = 0.0
    sixes = contact.sixes
    for side in range(sixes):
        at = SIX * side
        x, y, z = load_three_sixes(contact.J, at)
        total += dot_six(load_six(problem.mobility, contact.dofs[at]), norms2_six(x, y, z))
    if sixes == 0:
        for a in range(contact.width):
            u = column3(contact.J, 0, a)
            total += problem.mobility[contact.dofs[a]] * dot3(u, u)
    return total / 3.0


@kernel
def delassus_of_six(problem, contact, at):
    """The part of six columns of J, from `at` on, in J diag(1/A) J^T: (xx, yy, zz), (xy, xz, yz)."""
    m = load_six(problem.mobility, contact.dofs[at])
    x, y, z = load_three_sixes(contact.J, at)
    mx, my = times_six(m, x), times_six(m, y)
    diagonal = (dot_six(mx, x), dot_six(my, y), dot_six(times_six(m, z), z))
    return diagonal, (dot_six(mx, y), dot_six(mx, z), dot_six(my, z))


@kernel
def delassus_of_any(problem, contact):
    """J diag(1/A) J^T of a contact with any columns: (xx, yy, zz), (xy, xz, yz)."""
    diagonal, sides = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for a in range(contact.width):
        x, y, z = column3(contact.J, 0, a)
        mx, my, mz = scale3((x, y, z), problem.mobility[contact.dofs[a]])
        diagonal = add3(diagonal, (mx * x, my * y, mz * z))
        sides = add3(sides, (mx * y, mx * z, my * z))
    return diagonal, sides


@kernel
def prepare_hunt_crossley(model, problem, contact):
    """kLagged and kSimilar: elastic force, normal impulse and regularisation speed, all at the start of the step.

    The regularisation speed hardly ever depends on w: mostly it is the stiction tolerance for the largest w, too.
    """
    vn0 = contact.vc[2]
    fe0 = contact.stiffness * contact.depth
    damping = 1.0 - contact.dissipation * vn0
    n0 = 0.0 * vn0
    if fe0 > 0.0 and damping > 0.0:
        n0 = model.dt * fe0 * damping
    contact.fe0 = fe0
    contact.n0 = n0
    contact.eps = model.stiction + 0.0 * vn0
    slip = contact.friction * model.sigma * n0
    if slip > 0.0 and slip * largest_delassus(problem, contact) >= LEAST * model.stiction:
        slip *= contact_delassus(problem, contact)
        if slip > model.stiction:
            contact.eps = slip
    if contact.back > 0.0:
        contact.back = half_a_step_back(contact.stiffness, contact.depth, model.dt, contact.back, vn0)


@kernel
def prepare_sap_cone(model, contact, w):
    """kSap: regularisation (Castro, Permenter, Han 2022, eqs. 29 and 30), and the velocity that would close the gap."""
    dt, beta = model.dt, model.near_rigid
    rigid = beta * beta / FOUR_PI_SQUARED * w
    Rn = 1.0 / (dt * contact.stiffness * (dt + contact.relaxation))
    contact.delassus = w
    contact.R_t = model.sigma * w
    contact.R_n = rigid if Rn < rigid else Rn
    contact.vhat_n = closing_speed(contact, dt)


@kernel
def row_group_delassus(problem, rows, r, n):
    """w = |J diag(1/A) J^T|_F / n of n rows with the same dofs."""
    row = rows[r]
    total = 0.0
    for i in range(n):
        for j in range(n):
            s = 0.0
            for a in range(row.width):
                s += rows[r + i].J[a] * problem.mobility[row.dofs[a]] * rows[r + j].J[a]
            total += s * s
    return sqrt(total) / n


@kernel
def prepare_spring_row(row, dt, rigid):
    """A spring of stiffness k (may be infinite) and relaxation time tau, no stiffer than the time step resolves."""
    tau = row.relaxation
    row.R = 1.0 / (dt * (dt + tau) * row.stiffness)
    if row.R < rigid:
        row.R = rigid
        tau = dt + 0.0 * tau
    row.vhat = -row.gap / (dt + tau)


@kernel
def prepare_actuator_row(row, dt, rigid):
    """An implicit PD controller: gains too stiff for the time step are scaled down, keeping their ratio."""
    kp, kd = row.stiffness, row.relaxation
    R = 1.0 / (dt * (dt * kp + kd))
    if R < rigid:
        if dt * kp > kd:
            tau = kd / kp
            kp = 1.0 / (dt * (dt + tau) * rigid)
            kd = tau * kp
        else:
            ratio = kp / kd
            kd = 1.0 / (dt * (1.0 + dt * ratio) * rigid)
            kp = ratio * kd
        R = 1.0 / (dt * (dt * kp + kd))
    effort = kd * row.rate - kp * row.gap + row.forward  # at v = 0
    row.R = R
    row.vhat = dt * effort * R


@kernel
def prepare_rows(model, problem, rows):
    """R and vhat of all scalar rows, and their velocities at v0."""
    dt, beta = model.dt, model.near_rigid_rows
    w = 0.0
    for r in range(problem.num_rows):
        row = rows[r]
        if row.group > 0:
            w = row_group_delassus(problem, rows, r, row.group)
        rigid = beta * beta / FOUR_PI_SQUARED * w
        if row.kind == ACTUATOR or row.kind == DRY_FRICTION:
            prepare_actuator_row(row, dt, rigid)
        else:
            prepare_spring_row(row, dt, rigid)
        row.dvc = 0.0 * row.R


@kernel
def prepare(model, problem, contacts, rows):
    """Marks the trees that take part and makes every constraint's law from what the plant wrote."""
    leave_free(model, problem)
    mark_trees(problem, contacts, problem.num_contacts)
    mark_trees(problem, rows, problem.num_rows)
    mobilities(model, problem)
    kind = model.approximation
    for c in range(problem.num_contacts):
        contact = contacts[c]
        contact.sixes = trees_of_six(model, contact)
        put_velocity(contact, problem.v0, VC)
        if kind == SAP:
            prepare_sap_cone(model, contact, contact_delassus(problem, contact))
        elif kind != TAMSI:
            prepare_hunt_crossley(model, problem, contact)
    if kind == SAP and model.settle == 1:
        guess_slip(model, problem, contacts)
    prepare_rows(model, problem, rows)
