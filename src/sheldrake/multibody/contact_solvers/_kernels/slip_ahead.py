"""kSap, where steps are to settle: what slides is expected to slide at the end of the step, too.

The cone of kSap lets what slides at vt glide away from the surface at mu vt, until the gap is (dt + tau) mu vt and the
contact is lost: a box that slides would hop. So mu times the slip at the end of the step is taken off the velocity that
closes the penetration (de Saxce and Feng 1998, "The bipotential method"). A guess of the slip makes the first problem;
each solution makes the next, about mu^2 times as far from its own slip. What hardly slides keeps its cone.
"""

import numpy as np

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common._kernels.vec import load3_at
from sheldrake.common.kernel import kernel
from sheldrake.multibody.contact_solvers._kernels.line_search import magnitude
from sheldrake.multibody.contact_solvers._kernels.problem import (
    CONTACTS_BEGIN,
    CONTACTS_END,
    DELASSUS,
    DEPTH,
    DOFS,
    DT,
    DV,
    DVC,
    FIRST_DOF,
    FRICTION,
    ISLAND_CONTACTS,
    MOBILITY,
    NUM_CONTACTS,
    NUM_DOFS,
    ORDER,
    R_N,
    RELAXATION,
    STICTION,
    STIFFNESS,
    TREE_A,
    TREE_B,
    V0,
    V_STAR,
    VC,
    VHAT_N,
    WIDTH,
)
from sheldrake.multibody.contact_solvers._kernels.velocity import contact_velocity

SLIDING = np.float64(10.0)  # slip over the stiction tolerance from which on it is sliding


@kernel
def closing_speed(law, c, dt):
    """The velocity that would close the penetration within dt + tau [m/s].

    What does not touch yet (see `least_depth`) may come as fast as it touches at the end of the step.
    """
    if law[c, DEPTH] < 0.0:
        return law[c, DEPTH] / dt
    return law[c, DEPTH] / (dt + law[c, RELAXATION])


@kernel
def glide(model, law, c, v0, v1):
    """Speed at which contact c would leave the surface that it slides along, with these velocities [m/s]."""
    slip2 = v0[0] * v0[0] + v0[1] * v0[1]
    if not slip2 > 0.0:
        return 0.0 * slip2
    along = (v0[0] * v1[0] + v0[1] * v1[1]) / sqrt(slip2)
    if not along > 0.0:
        return 0.0 * slip2
    sliding = slip2 / (SLIDING * SLIDING * model.option[STICTION] * model.option[STICTION])
    if sliding < 1.0:
        along *= sliding
    return law[c, FRICTION] * along


@kernel
def count_contacts(model, problem, contacts, nc):
    """How many contacts each tree has, into the column that islands need later."""
    for t in range(model.tree.shape[0]):
        problem.tree[t, ISLAND_CONTACTS] = 0
    for c in range(nc):
        for side in (TREE_A, TREE_B):
            if contacts.index[c, side] >= 0:
                problem.tree[contacts.index[c, side], ISLAND_CONTACTS] += 1


@kernel
def contacts_beside(problem, contacts, c):
    """How many contacts share what stops the trees of contact c."""
    n = np.int64(1)
    for side in (TREE_A, TREE_B):
        t = contacts.index[c, side]
        if t >= 0 and problem.tree[t, ISLAND_CONTACTS] > n:
            n = problem.tree[t, ISLAND_CONTACTS]
    return n


@kernel(outline=True)
def guess_slip(model, problem, contacts):
    """Takes the guessed slip off all contacts: that of v*, less friction of impulses that are elastic.

    Or of what stops the contact if that is less; of its part of that if it does not touch.
    """
    x = problem.x
    law = contacts.law
    nc = problem.count[NUM_CONTACTS]
    count_contacts(model, problem, contacts, nc)
    for t in range(model.tree.shape[0]):
        first = model.tree[t, FIRST_DOF]
        for k in range(first, first + model.tree[t, NUM_DOFS]):
            x[DV, k] = x[V_STAR, k]
    for c in range(nc):
        vx, vy, _ = load3_at(contacts.state, c, VC)
        slip2 = vx * vx + vy * vy
        if slip2 > 0.0:
            contact_velocity(contacts, c, x, V_STAR, DVC)
            n = model.option[DT] * law[c, STIFFNESS] * law[c, DEPTH]
            stops = (law[c, VHAT_N] - contacts.state[c, DVC + 2]) / (law[c, R_N] + law[c, DELASSUS])
            if n <= 0.0:
                n = stops / contacts_beside(problem, contacts, c)
            if stops < n:
                n = stops
            if n < 0.0:
                n = 0.0 * n
            f = n * law[c, FRICTION] / sqrt(slip2)
            for a in range(contacts.index[c, WIDTH]):
                k = contacts.index[c, DOFS + a]
                x[DV, k] -= f * x[MOBILITY, k] * (contacts.J[3 * c, a] * vx + contacts.J[3 * c + 1, a] * vy)
    for c in range(nc):
        contact_velocity(contacts, c, x, DV, DVC)
        law[c, VHAT_N] -= glide(model, law, c, load3_at(contacts.state, c, VC), load3_at(contacts.state, c, DVC))


@kernel(outline=True)
def take_slip(model, problem, contacts):
    """Takes the slip of the iterate off the island's contacts instead; by how much one changes at most [m/s]."""
    law = contacts.law
    most = 0.0
    for place in range(problem.count[CONTACTS_BEGIN], problem.count[CONTACTS_END]):
        c = contacts.index[place, ORDER]
        contact_velocity(contacts, c, problem.x, V0, DVC)
        v0, v1 = load3_at(contacts.state, c, DVC), load3_at(contacts.state, c, VC)
        vhat = closing_speed(law, c, model.option[DT]) - glide(model, law, c, v0, v1)
        change = magnitude(vhat - law[c, VHAT_N])
        if change > most:
            most = change
        law[c, VHAT_N] = vhat
    return most
