"""Before the first iteration: who takes part, how heavy each constraint is (Delassus estimate), and its law."""

import numpy as np

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common._kernels.vec import add3, column3, dot3
from sheldrake.common.kernel import kernel
from sheldrake.multibody.contact_solvers._kernels.elastic import half_a_step_back
from sheldrake.multibody.contact_solvers._kernels.gradient import is_chain_of_six
from sheldrake.multibody.contact_solvers._kernels.problem import (
    ACTIVE,
    ACTUATOR,
    APPROXIMATION,
    BACK,
    DELASSUS,
    DEPTH,
    DEPTH_OF,
    DISSIPATION,
    DOFS,
    DRY_FRICTION,
    DT,
    EPS,
    FE0,
    FIRST_DOF,
    FRICTION,
    MOBILITY,
    N0,
    NEAR_RIGID,
    NEAR_RIGID_ROWS,
    NUM_CONTACTS,
    NUM_DOFS,
    NUM_ROWS,
    R_N,
    R_T,
    RELAXATION,
    ROW_DOFS,
    ROW_DVC,
    ROW_FORWARD,
    ROW_GAP,
    ROW_GROUP,
    ROW_KIND,
    ROW_R,
    ROW_RATE,
    ROW_RELAXATION,
    ROW_START,
    ROW_STIFFNESS,
    ROW_VHAT,
    SAP,
    SETTLE,
    SIGMA,
    SIXES,
    STICTION,
    STIFFNESS,
    TAMSI,
    TREE_A,
    TREE_B,
    V0,
    VC,
    VHAT_N,
    WIDTH,
)
from sheldrake.multibody.contact_solvers._kernels.six import (
    SIX,
    dot_six,
    inverse_packed_diagonal_six,
    load_six_of,
    norms2_six,
    store_six_of,
    times_six,
)
from sheldrake.multibody.contact_solvers._kernels.slip_ahead import closing_speed, guess_slip
from sheldrake.multibody.contact_solvers._kernels.velocity import contact_velocity

FIRST = np.int64(0)  # column
FOUR_PI_SQUARED = np.float64(4.0 * np.pi**2)
LEAST = np.float64(1.0 - 1e-9)  # of what must not be taken for smaller than it is


@kernel
def mark_trees(tree, index, count):
    """A tree takes part when a constraint touches it."""
    for c in range(count):
        if index[c, TREE_A] >= 0:
            tree[index[c, TREE_A], ACTIVE] = 1
        if index[c, TREE_B] >= 0:
            tree[index[c, TREE_B], ACTIVE] = 1


@kernel
def mobilities(model, problem):
    """1 / diag(A) of the dofs that take part."""
    for t in range(model.tree.shape[0]):
        if problem.tree[t, ACTIVE] == 1:
            first = model.tree[t, FIRST_DOF]
            if is_chain_of_six(model, t):
                m = inverse_packed_diagonal_six(problem.A, model.dof[first, ROW_START])
                store_six_of(problem.x, MOBILITY, first, m)
                continue
            for k in range(first, first + model.tree[t, NUM_DOFS]):
                problem.x[MOBILITY, k] = 1.0 / problem.A[model.dof[k, ROW_START] + model.dof[k, DEPTH_OF]]


@kernel
def trees_of_six(model, index, c):
    """Of how many trees the columns of contact c are, if all of these have six dofs that all move it; else 0."""
    n = np.int64(0)
    for side in (TREE_A, TREE_B):
        t = index[c, side]
        if t >= 0:
            if model.tree[t, NUM_DOFS] != SIX:
                return np.int64(0)
            n += 1
    return n if index[c, WIDTH] == SIX * n else np.int64(0)


@kernel(outline=True)
def contact_delassus(problem, contacts, c):
    """w = |J diag(1/A) J^T|_F / 3 of one contact [1/kg]."""
    sixes = contacts.index[c, SIXES]
    if sixes > 0:
        diagonal, sides = delassus_of_six(problem, contacts, c, FIRST)
        if sixes > 1:
            diagonal_B, sides_B = delassus_of_six(problem, contacts, c, SIX)
            diagonal = add3(diagonal, diagonal_B)
            sides = add3(sides, sides_B)
    else:
        diagonal, sides = delassus_of_any(problem, contacts, c)
    return sqrt(dot3(diagonal, diagonal) + 2.0 * dot3(sides, sides)) / 3.0


@kernel
def largest_delassus(problem, contacts, c):
    """What w of a contact is at most: the trace of J diag(1/A) J^T / 3, which takes a third of the work."""
    total = 0.0
    sixes = contacts.index[c, SIXES]
    J = contacts.J
    for side in range(sixes):
        at = SIX * side
        x = load_six_of(J, 3 * c, at)
        y = load_six_of(J, 3 * c + 1, at)
        z = load_six_of(J, 3 * c + 2, at)
        total += dot_six(load_six_of(problem.x, MOBILITY, contacts.index[c, DOFS + at]), norms2_six(x, y, z))
    if sixes == 0:
        for a in range(contacts.index[c, WIDTH]):
            u = column3(J, 3 * c, a)
            total += problem.x[MOBILITY, contacts.index[c, DOFS + a]] * dot3(u, u)
    return total / 3.0


@kernel
def delassus_of_six(problem, contacts, c, at):
    """The part of six columns of J, from `at` on, in J diag(1/A) J^T: (xx, yy, zz), (xy, xz, yz)."""
    J = contacts.J
    m = load_six_of(problem.x, MOBILITY, contacts.index[c, DOFS + at])
    x = load_six_of(J, 3 * c, at)
    y = load_six_of(J, 3 * c + 1, at)
    z = load_six_of(J, 3 * c + 2, at)
    mx = times_six(m, x)
    my = times_six(m, y)
    return (dot_six(mx, x), dot_six(my, y), dot_six(times_six(m, z), z)), (
        dot_six(mx, y),
        dot_six(mx, z),
        dot_six(my, z),
    )


@kernel
def delassus_of_any(problem, contacts, c):
    """J diag(1/A) J^T of a contact with any columns: (xx, yy, zz), (xy, xz, yz)."""
    J = contacts.J
    r = 3 * c
    xx = 0.0
    yy = 0.0
    zz = 0.0
    xy = 0.0
    xz = 0.0
    yz = 0.0
    for a in range(contacts.index[c, WIDTH]):
        m = problem.x[MOBILITY, contacts.index[c, DOFS + a]]
        jx = J[r, a]
        jy = J[r + 1, a]
        jz = J[r + 2, a]
        xx += m * jx * jx
        yy += m * jy * jy
        zz += m * jz * jz
        xy += m * jx * jy
        xz += m * jx * jz
        yz += m * jy * jz
    return (xx, yy, zz), (xy, xz, yz)


@kernel
def prepare_hunt_crossley(model, problem, contacts, c):
    """kLagged and kSimilar: elastic force, normal impulse and regularisation speed, all at the start of the step.

    The regularisation speed hardly ever depends on w: mostly it is the stiction tolerance for the largest w, too.
    """
    law = contacts.law
    vn0 = contacts.state[c, VC + 2]
    fe0 = law[c, STIFFNESS] * law[c, DEPTH]
    damping = 1.0 - law[c, DISSIPATION] * vn0
    n0 = 0.0 * vn0
    if fe0 > 0.0 and damping > 0.0:
        n0 = model.option[DT] * fe0 * damping
    law[c, FE0] = fe0
    law[c, N0] = n0
    law[c, EPS] = model.option[STICTION] + 0.0 * vn0
    slip = law[c, FRICTION] * model.option[SIGMA] * n0
    if slip > 0.0 and slip * largest_delassus(problem, contacts, c) >= LEAST * model.option[STICTION]:
        slip *= contact_delassus(problem, contacts, c)
        if slip > model.option[STICTION]:
            law[c, EPS] = slip
    if law[c, BACK] > 0.0:
        law[c, BACK] = half_a_step_back(law[c, STIFFNESS], law[c, DEPTH], model.option[DT], law[c, BACK], vn0)


@kernel
def prepare_sap_cone(model, contacts, c, w):
    """kSap: regularisation, and the velocity that would close the penetration."""
    law = contacts.law
    dt = model.option[DT]
    beta = model.option[NEAR_RIGID]
    rigid = beta * beta / FOUR_PI_SQUARED * w
    Rn = 1.0 / (dt * law[c, STIFFNESS] * (dt + law[c, RELAXATION]))
    if Rn < rigid:
        Rn = rigid
    law[c, DELASSUS] = w
    law[c, R_T] = model.option[SIGMA] * w
    law[c, R_N] = Rn
    law[c, VHAT_N] = closing_speed(law, c, dt)


@kernel
def row_group_delassus(problem, rows, r, n):
    """w = |J diag(1/A) J^T|_F / n of n rows with the same dofs."""
    J = rows.J
    total = 0.0
    for i in range(n):
        for j in range(n):
            s = 0.0
            for a in range(rows.index[r, WIDTH]):
                s += J[r + i, a] * problem.x[MOBILITY, rows.index[r, ROW_DOFS + a]] * J[r + j, a]
            total += s * s
    return sqrt(total) / n


@kernel
def prepare_spring_row(law, r, dt, rigid):
    """A spring of stiffness k (may be infinite) and relaxation time tau, no stiffer than the time step resolves."""
    tau = law[r, ROW_RELAXATION]
    R = 1.0 / (dt * (dt + tau) * law[r, ROW_STIFFNESS])
    if R < rigid:
        R = rigid
        tau = dt + 0.0 * tau
    law[r, ROW_R] = R
    law[r, ROW_VHAT] = -law[r, ROW_GAP] / (dt + tau)


@kernel
def prepare_actuator_row(law, r, dt, rigid):
    """An implicit PD controller: gains too stiff for the time step are scaled down, keeping their ratio."""
    kp = law[r, ROW_STIFFNESS]
    kd = law[r, ROW_RELAXATION]
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
    effort = kd * law[r, ROW_RATE] - kp * law[r, ROW_GAP] + law[r, ROW_FORWARD]  # at v = 0
    law[r, ROW_R] = R
    law[r, ROW_VHAT] = dt * effort * R


@kernel
def prepare_rows(model, problem, rows):
    """R and vhat of all scalar rows, and their velocities at v0."""
    dt = model.option[DT]
    beta = model.option[NEAR_RIGID_ROWS]
    w = 0.0
    for r in range(problem.count[NUM_ROWS]):
        group = rows.index[r, ROW_GROUP]
        if group > 0:
            w = row_group_delassus(problem, rows, r, group)
        rigid = beta * beta / FOUR_PI_SQUARED * w
        kind = rows.index[r, ROW_KIND]
        if kind == ACTUATOR or kind == DRY_FRICTION:
            prepare_actuator_row(rows.law, r, dt, rigid)
        else:
            prepare_spring_row(rows.law, r, dt, rigid)
        rows.state[r, ROW_DVC] = 0.0 * rows.law[r, ROW_R]


@kernel
def prepare(model, problem, contacts, rows):
    """Marks the trees that take part and makes every constraint's law from what the plant wrote."""
    for t in range(model.tree.shape[0]):
        problem.tree[t, ACTIVE] = 0
    nc = problem.count[NUM_CONTACTS]
    mark_trees(problem.tree, contacts.index, nc)
    mark_trees(problem.tree, rows.index, problem.count[NUM_ROWS])
    mobilities(model, problem)
    kind = model.setting[APPROXIMATION]
    for c in range(nc):
        contacts.index[c, SIXES] = trees_of_six(model, contacts.index, c)
        contact_velocity(contacts, c, problem.x, V0, VC)
        if kind == SAP:
            prepare_sap_cone(model, contacts, c, contact_delassus(problem, contacts, c))
        elif kind != TAMSI:
            prepare_hunt_crossley(model, problem, contacts, c)
    if kind == SAP and model.setting[SETTLE] == 1:
        guess_slip(model, problem, contacts)
    prepare_rows(model, problem, rows)
