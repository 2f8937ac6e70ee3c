"""Solutions of the convex problem, island by island (Castro, Permenter, Han 2022).

Convergence is tested before the first iteration, starting at v0: a body at rest costs no factorisation.
Only trees touched by a constraint take part, in the search and in the norms that stop it.
"""

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common._kernels.vec import dot3
from sheldrake.common.kernel import kernel
from sheldrake.multibody.contact_solvers._kernels.gradient import (
    contact_velocities,
    evaluate,
    judge,
    magnitude,
    mul_A,
    multiply_A,
    put_v0,
    put_velocity,
    row_velocities,
)
from sheldrake.multibody.contact_solvers._kernels.newton import iterate, iterate_to_rest, with_slopes
from sheldrake.multibody.contact_solvers._kernels.problem import (
    DVC,
    SAP,
    VC,
    contacts_of_island,
    dofs_of_island,
    rows_of_island,
)
from sheldrake.multibody.contact_solvers._kernels.status import SOLVED

# ---- the slip of the end of the step
#
# kSap, where steps are to settle: what slides is expected to slide at the end of the step, too.
#
# The cone of kSap lets what slides at vt glide away from the surface at mu vt, until the gap is (dt + tau) mu vt and
# the contact is lost: a box that slides would hop. So mu times the slip at the end of the step is taken off the
# velocity that closes the penetration (de Saxce and Feng 1998, "The bipotential method"). A guess of the slip makes
# the first problem; each solution makes the next, about mu^2 times as far from its own slip. What hardly slides keeps
# its cone.

SLIDING = 10.0  # slip over the stiction tolerance from which on it is sliding


@kernel
def closing_speed(contact, dt):
    """The velocity that would close the penetration within dt + tau [m/s] (Castro, Permenter, Han 2022, section V-A).

    What does not touch yet (see `least_depth`) may come as fast as it touches at the end of the step.
    """
    if contact.depth < 0.0:
        return contact.depth / dt
    return contact.depth / (dt + contact.relaxation)


@kernel
def glide(model, contact, v0, v1):
    """Speed at which a contact would leave the surface that it slides along, with these velocities [m/s]."""
    slip2 = v0[0] * v0[0] + v0[1] * v0[1]
    if not slip2 > 0.0:
        return 0.0 * slip2
    along = (v0[0] * v1[0] + v0[1] * v1[1]) / sqrt(slip2)
    if not along > 0.0:
        return 0.0 * slip2
    sliding = slip2 / (SLIDING * SLIDING * model.stiction * model.stiction)
    if sliding < 1.0:
        along *= sliding
    return contact.friction * along


@kernel
def count_contacts(problem, contacts):
    """How many contacts each tree has."""
    for t in range(len(problem.trees)):
        problem.trees[t].num_contacts = 0
    for c in range(problem.num_contacts):
        for t in (contacts[c].tree_a, contacts[c].tree_b):
            if t >= 0:
                problem.trees[t].num_contacts += 1


@kernel
def contacts_beside(problem, contact):
    """How many contacts share what stops the trees of a contact."""
    n = 1
    for t in (contact.tree_a, contact.tree_b):
        if t >= 0 and problem.trees[t].num_contacts > n:
            n = problem.trees[t].num_contacts
    return n


@kernel(outline=True)
def guess_slip(model, problem, contacts):
    """Takes the guessed slip off all contacts: that of v*, less friction of impulses that are elastic.

    Or of what stops the contact if that is less; of its part of that if it does not touch.
    """
    count_contacts(problem, contacts)
    for k in range(len(problem.dv)):
        problem.dv[k] = problem.v_star[k]
    for c in range(problem.num_contacts):
        contact = contacts[c]
        vx, vy, _ = contact.vc
        slip2 = vx * vx + vy * vy
        if slip2 > 0.0:
            put_velocity(contact, problem.v_star, DVC)
            n = model.dt * contact.stiffness * contact.depth
            stops = (contact.vhat_n - contact.dvc[2]) / (contact.R_n + contact.delassus)
            if n <= 0.0:
                n = stops / contacts_beside(problem, contact)
            if stops < n:
                n = stops
            if n < 0.0:
                n = 0.0 * n
            f = n * contact.friction / sqrt(slip2)
            for a in range(contact.width):
                k = contact.dofs[a]
                problem.dv[k] -= f * problem.mobility[k] * (contact.J[0, a] * vx + contact.J[1, a] * vy)
    for c in range(problem.num_contacts):
        contact = contacts[c]
        put_velocity(contact, problem.dv, DVC)
        contact.vhat_n -= glide(model, contact, contact.vc, contact.dvc)


@kernel(outline=True)
def take_slip(model, problem, contacts):
    """Takes the slip of the iterate off the island's contacts instead; by how much one changes at most [m/s]."""
    most = 0.0
    for contact in contacts_of_island(problem, contacts):
        put_velocity(contact, problem.v0, DVC)
        v0, v1 = contact.dvc, contact.vc
        vhat = closing_speed(contact, model.dt) - glide(model, contact, v0, v1)
        change = magnitude(vhat - contact.vhat_n)
        if change > most:
            most = change
        contact.vhat_n = vhat
    return most


# ---- an island

AT_REST = 10.0  # times the stiction tolerance: slower contacts may be at rest
STUCK = 0.5  # times the slip speed: the regularisation speed of what sticks
TIGHT = 0.03  # times Drake's regularisation speed: the least one, for the sake of the condition of H
SLIPS = 5  # times that a problem of kSap is solved for the slip of its solution
SAME_SLIP = 0.1  # change of friction times slip, over the stiction tolerance, that is none
NEARLY_STILL = 1e-8  # (momentum over impulse of a step)^2 below which rest is tried


@kernel
def start(model, problem, rows):
    """The first iterate v0 with its momenta and the velocities of the rows; completes p* = A v*.

    The velocities of the contacts `prepare` has made.
    """
    put_v0(model, problem)
    mul_A(model, problem, problem.v, problem.p)
    row_velocities(problem, rows, problem.v, VC)
    for k in dofs_of_island(model, problem):
        problem.p_star[k] += problem.p[k]


@kernel(outline=True)
def try_rest(model, problem, contacts, rows):
    """Replaces an accepted v0 by zero where zero is as good, so that what is at rest does not creep at tolerance."""
    for k in dofs_of_island(model, problem):
        problem.v[k] = problem.v0[k] - problem.v0[k]
        problem.p[k] = problem.v[k]
    zero = (0.0, 0.0, 0.0)
    for contact in contacts_of_island(problem, contacts):
        contact.vc = zero
    for row in rows_of_island(problem, rows):
        row.vc = 0.0
    excess, _, _ = evaluate(model, problem, contacts, rows)
    if not excess <= 1.0:
        put_v0(model, problem)
        multiply_A(model, problem, problem.v, problem.p)
        row_velocities(problem, rows, problem.v, VC)
        contact_velocities(problem, contacts, problem.v, VC)
        evaluate(model, problem, contacts, rows)


@kernel
def tighten(model, problem, contacts):
    """Regularises friction less in an island whose contacts are nearly still.

    With Drake's regularisation, what friction holds creeps for ever, at a speed that grows with the load. Here what
    slips slowly gets less of it, step by step: while friction bears less than 89 % of what it can, each step's slip
    is smaller than that of the step before. What moves has Drake's: a sharper law takes more iterations.
    """
    fast = AT_REST * model.stiction
    for contact in contacts_of_island(problem, contacts):
        vc0 = contact.vc
        if dot3(vc0, vc0) > fast * fast:
            return
    for contact in contacts_of_island(problem, contacts):
        x, y, _ = contact.vc
        eps = contact.eps
        stuck2 = STUCK * STUCK * (x * x + y * y)
        if stuck2 < TIGHT * TIGHT * eps * eps:
            contact.eps = TIGHT * eps
        elif stuck2 < eps * eps:
            contact.eps = sqrt(stuck2)


@kernel
def agree_on_slip(model, problem, contacts, rows, factor):
    """Solves kSap's problem anew with the slip of its solution, until that is the slip it had; a status."""
    for _ in range(SLIPS):
        if take_slip(model, problem, contacts) <= SAME_SLIP * model.stiction:
            return SOLVED
        excess, _, _ = evaluate(model, problem, contacts, rows)
        if not excess <= 1.0:
            status = iterate_to_rest(model, problem, contacts, rows, factor, excess)
            if status != SOLVED:
                return status
        status = with_slopes(model, problem, contacts, rows, factor, excess)
        if status != SOLVED:
            return status
    return SOLVED


@kernel
def sap_island(model, problem, contacts, rows, factor):
    """The island at hand, prepared, from its first iterate v0 on; a status."""
    start(model, problem, rows)
    status = SOLVED
    settle = model.settle == 1
    if settle and model.approximation != SAP:
        tighten(model, problem, contacts)
    excess, momentum, impulse = judge(model, problem, contacts, rows)
    moved = not excess <= 1.0  # so is NaN
    if moved:
        if settle:
            status = iterate_to_rest(model, problem, contacts, rows, factor, excess)
        else:
            status = iterate(model, problem, contacts, rows, factor)
    elif settle and momentum > 0.0 and momentum <= NEARLY_STILL * impulse:
        try_rest(model, problem, contacts, rows)
    if status == SOLVED:
        status = with_slopes(model, problem, contacts, rows, factor, excess)
    if status == SOLVED and moved and settle and model.approximation == SAP:
        status = agree_on_slip(model, problem, contacts, rows, factor)
    return status
