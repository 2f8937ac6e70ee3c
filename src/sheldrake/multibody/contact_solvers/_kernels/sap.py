"""Solutions of the convex problem, island by island (Castro, Permenter, Han 2022).

Convergence is tested before the first iteration, starting at v0: a body at rest costs no factorisation.
Only trees touched by a constraint take part, in the search and in the norms that stop it.
"""

import numpy as np

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common._kernels.vec import dot3, load3_at, store3_at
from sheldrake.common.kernel import kernel
from sheldrake.multibody.contact_solvers._kernels.gradient import evaluate, judge, mul_A, multiply_A
from sheldrake.multibody.contact_solvers._kernels.islands import group_islands, select_island
from sheldrake.multibody.contact_solvers._kernels.newton import iterate, iterate_to_rest, polish
from sheldrake.multibody.contact_solvers._kernels.problem import (
    APPROXIMATION,
    CONTACTS_BEGIN,
    CONTACTS_END,
    EPS,
    FIRST_DOF,
    ITERATIONS,
    NUM_DOFS,
    NUM_ISLANDS,
    ORDER,
    P_STAR,
    POLISH,
    ROW_VC,
    ROWS_BEGIN,
    ROWS_END,
    SAP,
    SETTLE,
    STICTION,
    TREE_ORDER,
    TREES_BEGIN,
    TREES_END,
    V0,
    VC,
    P,
    V,
)
from sheldrake.multibody.contact_solvers._kernels.slip_ahead import take_slip
from sheldrake.multibody.contact_solvers._kernels.status import (
    SOLVED,
)
from sheldrake.multibody.contact_solvers._kernels.velocity import contact_velocities, row_velocities

AT_REST = np.float64(10.0)  # times the stiction tolerance: slower contacts may be at rest
STUCK = np.float64(0.5)  # times the slip speed: the regularisation speed of what sticks
TIGHT = np.float64(0.03)  # times Drake's regularisation speed: the least one, for the sake of the condition of H
SLIPS = np.int64(5)  # times that a problem of kSap is solved for the slip of its solution
SAME_SLIP = np.float64(0.1)  # change of friction times slip, over the stiction tolerance, that is none
NEARLY_STILL = np.float64(1e-8)  # (momentum over impulse of a step)^2 below which rest is tried


@kernel
def put_v0(model, problem):
    """v = v0."""
    for place in range(problem.count[TREES_BEGIN], problem.count[TREES_END]):
        t = problem.tree[place, TREE_ORDER]
        first = model.tree[t, FIRST_DOF]
        for k in range(first, first + model.tree[t, NUM_DOFS]):
            problem.x[V, k] = problem.x[V0, k]


@kernel
def start(model, problem, rows):
    """The first iterate v0 with its momenta and the velocities of the rows; completes p* = A v*.

    The velocities of the contacts `prepare` has made.
    """
    put_v0(model, problem)
    mul_A(model, problem, V, P)
    row_velocities(problem, rows, V, ROW_VC)
    for place in range(problem.count[TREES_BEGIN], problem.count[TREES_END]):
        t = problem.tree[place, TREE_ORDER]
        first = model.tree[t, FIRST_DOF]
        for k in range(first, first + model.tree[t, NUM_DOFS]):
            problem.x[P_STAR, k] += problem.x[P, k]


@kernel(outline=True)
def try_rest(model, problem, contacts, rows):
    """Replaces an accepted v0 by zero where zero is as good, so that what is at rest does not creep at tolerance."""
    x = problem.x
    for place in range(problem.count[TREES_BEGIN], problem.count[TREES_END]):
        t = problem.tree[place, TREE_ORDER]
        first = model.tree[t, FIRST_DOF]
        for k in range(first, first + model.tree[t, NUM_DOFS]):
            x[V, k] = x[V0, k] - x[V0, k]
            x[P, k] = x[V, k]
    zero = (0.0, 0.0, 0.0)
    for place in range(problem.count[CONTACTS_BEGIN], problem.count[CONTACTS_END]):
        c = contacts.index[place, ORDER]
        store3_at(contacts.state, c, VC, zero)
    for place in range(problem.count[ROWS_BEGIN], problem.count[ROWS_END]):
        r = rows.index[place, ORDER]
        rows.state[r, ROW_VC] = 0.0
    excess, _, _ = evaluate(model, problem, contacts, rows)
    if not excess <= 1.0:
        put_v0(model, problem)
        multiply_A(model, problem, V, P)
        row_velocities(problem, rows, V, ROW_VC)
        contact_velocities(problem, contacts, V, VC)
        evaluate(model, problem, contacts, rows)


@kernel
def tighten(model, problem, contacts):
    """Regularises friction less in an island whose contacts are nearly still; whether they are, 1 or 0.

    With Drake's regularisation, what friction holds creeps for ever, at a speed that grows with the load. Here what
    slips slowly gets less of it, step by step: while friction bears less than 89 % of what it can, each step's slip
    is smaller than that of the step before. What moves has Drake's: a sharper law takes more iterations.
    """
    law = contacts.law
    fast = AT_REST * model.option[STICTION]
    for place in range(problem.count[CONTACTS_BEGIN], problem.count[CONTACTS_END]):
        c = contacts.index[place, ORDER]
        vc0 = load3_at(contacts.state, c, VC)
        if dot3(vc0, vc0) > fast * fast:
            return 0
    for place in range(problem.count[CONTACTS_BEGIN], problem.count[CONTACTS_END]):
        c = contacts.index[place, ORDER]
        x, y, _ = load3_at(contacts.state, c, VC)
        eps = law[c, EPS]
        stuck2 = STUCK * STUCK * (x * x + y * y)
        if stuck2 < TIGHT * TIGHT * eps * eps:
            law[c, EPS] = TIGHT * eps
        elif stuck2 < eps * eps:
            law[c, EPS] = sqrt(stuck2)
    return 1


@kernel
def agree_on_slip(model, problem, contacts, rows, factor):
    """Solves kSap's problem anew with the slip of its solution, until that is the slip it had; a status."""
    for _ in range(SLIPS):
        if take_slip(model, problem, contacts) <= SAME_SLIP * model.option[STICTION]:
            return SOLVED
        excess, _, _ = evaluate(model, problem, contacts, rows)
        if not excess <= 1.0:
            status = iterate_to_rest(model, problem, contacts, rows, factor, excess)
            if status != SOLVED:
                return status
    return SOLVED


@kernel
def solve_island(model, problem, contacts, rows, factor):
    """The island at hand, from its first iterate v0 on; a status."""
    start(model, problem, rows)
    status = np.int64(SOLVED)
    if model.setting[SETTLE] == 1 and model.setting[APPROXIMATION] != SAP:
        tighten(model, problem, contacts)
    excess, momentum, impulse = judge(model, problem, contacts, rows)
    settle = model.setting[SETTLE] == 1
    if not excess <= 1.0:  # nor is NaN
        if settle:
            status = iterate_to_rest(model, problem, contacts, rows, factor, excess)
            if status == SOLVED and model.setting[APPROXIMATION] == SAP:
                status = agree_on_slip(model, problem, contacts, rows, factor)
        else:
            status = iterate(model, problem, contacts, rows, factor)
    elif settle and momentum > 0.0 and momentum <= NEARLY_STILL * impulse:
        try_rest(model, problem, contacts, rows)
    if status == SOLVED and model.setting[POLISH] > 0:
        status = polish(model, problem, contacts, rows, factor)
    return status


@kernel
def sap_solve(model, problem, contacts, rows, factor):
    """Fills x[V] over the participating dofs, the impulses and x[J_GAMMA]; after `prepare`. Returns a status.

    Drake solves all at once, and stops when the sum of all residuals is small. When settling, each island of trees that
    constraints connect is solved on its own: one that moves does not make those at rest iterate.
    """
    problem.count[ITERATIONS] = 0
    group_islands(model, problem, contacts, rows, model.setting[SETTLE])
    for island in range(problem.count[NUM_ISLANDS]):
        select_island(problem, island)
        status = solve_island(model, problem, contacts, rows, factor)
        if status != SOLVED:
            return status
    return SOLVED
