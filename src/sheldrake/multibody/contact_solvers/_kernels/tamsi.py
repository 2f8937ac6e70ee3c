"""kTamsi: implicit Newton on compliant contact with regularised friction, in sub-steps where needed.

Castro, Qu, Kuppuswamy, Alspach, Sherman 2020, "A transition-aware method for the simulation of compliant contact with
regularized friction". M, the forces and the contact geometry stay frozen over the sub-steps.
"""

from sheldrake.common._kernels.generic import has_slopes, sqrt
from sheldrake.common._kernels.vec import column3, dot3, root, scale3
from sheldrake.common.kernel import kernel
from sheldrake.multibody.contact_solvers._kernels.cost import (
    drop_slopes,
    keep_slopes,
    move,
    put_momentum,
    put_v0,
    resists,
    times_G,
)
from sheldrake.multibody.contact_solvers._kernels.factor import eliminate, places_of, scatter, symbolic_factor
from sheldrake.multibody.contact_solvers._kernels.laws import NO_SLIP, put_tamsi_impulse
from sheldrake.multibody.contact_solvers._kernels.problem import (
    DVC,
    FACTOR_CAPACITY,
    FIRST,
    SOLVED,
    TAMSI_FAILED,
    VC,
    contact_velocities,
    contacts_of_island,
    dofs_of_island,
    mul_A,
)

# ---- step limit
#
# How far a TAMSI iteration may move the slip velocity of one contact (Castro et al. 2020, section V).

COS_MAX = 0.5  # a slip velocity may turn by 60 degrees in one iteration


@kernel
def step_limit(vt, dvt, vs):
    """Largest step in (0, 1] along dvt that does not jump over the stiction region; -1 when there is none."""
    small = NO_SLIP * vs
    v1 = (vt[0] + dvt[0], vt[1] + dvt[1])
    d2 = dvt[0] * dvt[0] + dvt[1] * dvt[1]
    if d2 < small * small:
        return 1.0 + 0.0 * d2
    d = sqrt(d2)
    vv = vt[0] * vt[0] + vt[1] * vt[1]
    vv1 = v1[0] * v1[0] + v1[1] * v1[1]
    slip = root(vv) / vs
    slip1 = root(vv1) / vs
    if slip < NO_SLIP and slip1 > 1.0:
        return 0.5 * vs / d
    if slip > 1.0 and slip1 < NO_SLIP:
        return 1.0 - 0.5 * vs / d
    if slip < 1.0 or slip1 < 1.0:
        return 1.0 + 0.0 * d2
    along = vt[0] * dvt[0] + vt[1] * dvt[1]
    if along < 0.0:
        closest = -along / d2
        if closest < 1.0:
            wx = vt[0] + closest * dvt[0]
            wy = vt[1] + closest * dvt[1]
            least = wx * wx + wy * wy
            if least < small * small:
                return closest - 0.5 * vs / d
            if least < vs * vs:
                return closest
    cosine = (vt[0] * v1[0] + vt[1] * v1[1]) / (slip * slip1 * vs * vs)
    if cosine > COS_MAX:
        return 1.0 + 0.0 * d2
    return turn_limit(slip * slip, along / (vs * vs), d / vs)


@kernel
def turn_limit(x2, x_dx, dx):
    """Smallest positive step at which the slip velocity has turned by the largest allowed angle."""
    c2 = COS_MAX * COS_MAX
    A = x2 * dx * dx * c2 - x_dx * x_dx
    B = 2.0 * x2 * x_dx * (c2 - 1.0)
    C = x2 * x2 * (c2 - 1.0)
    if A < 2.220446049250313e-16 and A > -2.220446049250313e-16:
        return -C / B
    discriminant = B * B - 4.0 * A * C
    if not discriminant > 0.0:
        return -1.0 + 0.0 * A
    s = sqrt(discriminant)
    if B > 0.0:
        numerator = -0.5 * (B + s)
    else:
        numerator = -0.5 * (B - s)
    first = numerator / A
    second = C / numerator
    if first > 0.0 and second > 0.0:
        return first if first < second else second
    return first if first > second else second


# ---- iterations

NEWTON_LIMIT = 20
SUBSTEP_LIMIT = 20


@kernel(outline=True)
def contact_forces(model, problem, contacts, h):
    """Impulses of a sub-step and their slopes, at the present vc."""
    for contact in contacts_of_island(problem, contacts):
        put_tamsi_impulse(model, contact, h)


@kernel
def momentum_residual(model, problem, contacts):
    """gradient = A v - p* - J^T gamma over the participating dofs."""
    for k in dofs_of_island(model, problem):
        problem.gradient[k] = problem.p[k] - problem.start_momentum[k]
    for contact in contacts_of_island(problem, contacts):
        gamma = contact.gamma
        for a in range(contact.width):
            problem.gradient[contact.dofs[a]] -= dot3(column3(contact.J, 0, a), gamma)


@kernel(outline=True)
def assemble(model, problem, contacts, factor):
    """H = A + J^T K J, unsymmetric, in the blocks of `factor`, and -residual in factor.rhs."""
    H = factor.L
    for place in range(problem.columns):
        put_momentum(model, problem, factor, place)
        block = factor.blocks[place]
        n, D = block.size, block.diagonal
        first = model.trees[block.tree].first_dof
        for i in range(n):
            factor.rhs[block.first_slot + i] = -problem.gradient[first + i]
            for j in range(i):
                H[D + n * i + j] = H[D + n * j + i]
    for contact in contacts_of_island(problem, contacts):
        if resists(contact):
            add_contact(factor, contact, places_of(model, factor, contact))


@kernel
def add_column(contact, begin, end, K_u, H, at, step):
    """Adds J^T K u to a column of H, where its dof k is at `at` + `step` k, for a contact's columns begin .. end."""
    for a in range(begin, end):
        H[at + step * contact.dofs[a]] += dot3(column3(contact.J, 0, a), K_u)


@kernel
def add_contact(factor, contact, places):
    """H += J^T K J of a contact."""
    split, first, second, coupling = places
    address, step_second, step_first = coupling
    width = contact.width
    below = above = address  # rows of the second tree, columns of the first; the other way round
    if split < width:
        if factor.place[contact.tree_b] > factor.place[contact.tree_a]:
            above += first[1] * second[1]
        else:
            below += first[1] * second[1]
    for b in range(width):
        u = column3(contact.J, 0, b)
        x, y, _ = times_G(contact.G, u)
        K_u = (x, y, contact.G[5] * u[2])
        j = contact.dofs[b]
        if b < split:
            add_column(contact, FIRST, split, K_u, factor.L, first[0] + first[1] * j, 1)
            add_column(contact, split, width, K_u, factor.L, below + step_first * j, step_second)
        else:
            add_column(contact, FIRST, split, K_u, factor.L, above + step_second * j, step_first)
            add_column(contact, split, width, K_u, factor.L, second[0] + second[1] * j, 1)


@kernel
def direction(model, problem, contacts, factor):
    """Newton's dv, A dv, and the change of the contacts' velocities along it; a status."""
    assemble(model, problem, contacts, factor)
    if eliminate(factor, problem.trees_end - problem.trees_begin) != SOLVED:
        return TAMSI_FAILED
    scatter(model, problem, factor)
    mul_A(model, problem, problem.dv, problem.a_dv)
    contact_velocities(problem, contacts, problem.dv, DVC)
    return SOLVED


@kernel(outline=True)
def differentiate(model, problem, contacts, factor, h):
    """Gives the solution of a sub-step its derivatives, as that of `newton.differentiate`; a status."""
    drop_slopes(model, problem)
    mul_A(model, problem, problem.v, problem.p)
    contact_velocities(problem, contacts, problem.v, VC)
    contact_forces(model, problem, contacts, h)
    momentum_residual(model, problem, contacts)
    keep_slopes(model, problem)
    if direction(model, problem, contacts, factor) != SOLVED:
        return TAMSI_FAILED
    move(model, problem, contacts, 1.0)
    contact_forces(model, problem, contacts, h)
    return SOLVED


@kernel(outline=True)
def newton(model, problem, contacts, factor, h):
    """Newton iterations of one sub-step from the iterate v; a status."""
    tolerance = NO_SLIP * model.stiction
    change = 2.0 * tolerance
    for _ in range(NEWTON_LIMIT):
        contact_forces(model, problem, contacts, h)
        if change < tolerance:
            if has_slopes(change):
                return differentiate(model, problem, contacts, factor, h)
            return SOLVED
        momentum_residual(model, problem, contacts)
        if direction(model, problem, contacts, factor) != SOLVED:
            return TAMSI_FAILED
        tangential = 0.0
        normal = 0.0
        alpha = 1.0
        for contact in contacts_of_island(problem, contacts):
            ux, uy, un = contact.dvc
            tangential += ux * ux + uy * uy
            normal += un * un
            limit = step_limit((contact.vc[0], contact.vc[1]), (ux, uy), model.stiction)
            if limit < 0.0:
                return TAMSI_FAILED
            alpha = limit if limit < alpha else alpha
        change = root(tangential)
        if root(normal) > change:
            change = root(normal)
        move(model, problem, contacts, alpha)
        problem.iterations += 1
    return TAMSI_FAILED


@kernel(outline=True)
def substeps(model, problem, contacts, factor, n):
    """The whole step in n equal sub-steps from v0; a status."""
    h = model.dt / n
    put_v0(model, problem)
    mul_A(model, problem, problem.v, problem.p)
    contact_velocities(problem, contacts, problem.v, VC)
    for contact in contacts_of_island(problem, contacts):
        contact.fe0 = contact.stiffness * contact.depth
    for _ in range(n):
        for k in dofs_of_island(model, problem):
            problem.start_momentum[k] = problem.p[k] + problem.p_star[k] / n
        if newton(model, problem, contacts, factor, h) != SOLVED:
            return TAMSI_FAILED
        for contact in contacts_of_island(problem, contacts):
            force = contact.fe0 - h * contact.stiffness * contact.vc[2]
            if force < 0.0:
                force = 0.0 * force
            contact.fe0 = force
    return SOLVED


@kernel
def store_impulses(model, problem, contacts, n):
    """Impulses of the last sub-step's forces over the whole step, and J^T of them in `j_gamma`."""
    for k in dofs_of_island(model, problem):
        problem.j_gamma[k] = 0.0
    for contact in contacts_of_island(problem, contacts):
        gamma = scale3(contact.gamma, 1.0 * n)
        contact.gamma = gamma
        for a in range(contact.width):
            problem.j_gamma[contact.dofs[a]] += dot3(column3(contact.J, 0, a), gamma)


@kernel
def tamsi_island(model, problem, contacts, rows, factor):
    """The island at hand, prepared, in as few sub-steps as will do; a status.

    p* holds dt times the generalized forces; here A = M. There are contacts alone, no rows.
    """
    if symbolic_factor(model, problem, contacts, rows, factor) != SOLVED:
        return FACTOR_CAPACITY
    for parts in range(1, SUBSTEP_LIMIT + 1):
        if parts > problem.substeps:
            problem.substeps = parts
        if substeps(model, problem, contacts, factor, parts) == SOLVED:
            store_impulses(model, problem, contacts, parts)
            return SOLVED
    return TAMSI_FAILED
