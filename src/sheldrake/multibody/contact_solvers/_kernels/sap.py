"""Newton on the convex cost, as Drake's SAP solver does it (Castro, Permenter, Han 2022, algorithm 1).

Convergence is tested before the first iteration, starting at v0: a body at rest costs no factorisation.
Only trees touched by a constraint take part, in the search and in the norms that stop it.
"""

import numpy as np

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common._kernels.vec import add3, column3, dot3, load3_at, scale3, store3_at
from sheldrake.common.kernel import kernel
from sheldrake.multibody.contact_solvers._kernels.block_cholesky import factorise
from sheldrake.multibody.contact_solvers._kernels.contact_law import contact_impulse
from sheldrake.multibody.contact_solvers._kernels.elimination import lay_out
from sheldrake.multibody.contact_solvers._kernels.hessian import assemble, newton_direction
from sheldrake.multibody.contact_solvers._kernels.islands import group_islands, select_island
from sheldrake.multibody.contact_solvers._kernels.line_search import (
    COST_ABSOLUTE,
    COST_RELATIVE,
    constraint_cost,
    full_step_does,
    line_search,
    magnitude,
)
from sheldrake.multibody.contact_solvers._kernels.problem import (
    A_DV,
    ABSOLUTE_TOLERANCE,
    APPROXIMATION,
    CONTACTS_BEGIN,
    CONTACTS_END,
    DEPTH_OF,
    DOFS,
    DV,
    DVC,
    EPS,
    FIRST_DOF,
    G_XX,
    G_XY,
    G_XZ,
    G_YY,
    G_YZ,
    G_ZZ,
    GAMMA,
    GRADIENT,
    ITERATIONS,
    J_GAMMA,
    MAX_ITERATIONS,
    MOBILITY,
    NUM_DOFS,
    NUM_ISLANDS,
    ORDER,
    P_STAR,
    PARENT_DOF,
    POLISH,
    RELATIVE_TOLERANCE,
    ROW_DOFS,
    ROW_DVC,
    ROW_G,
    ROW_GAMMA,
    ROW_LOWER,
    ROW_R,
    ROW_START,
    ROW_UPPER,
    ROW_VC,
    ROW_VHAT,
    ROWS_BEGIN,
    ROWS_END,
    SAP,
    SETTLE,
    STICTION,
    TREE_ORDER,
    TREES_BEGIN,
    TREES_END,
    V0,
    V_STAR,
    VC,
    WIDTH,
    P,
    V,
)
from sheldrake.multibody.contact_solvers._kernels.scalar_row import row_impulse
from sheldrake.multibody.contact_solvers._kernels.status import (
    FACTOR_CAPACITY,
    HESSIAN_NOT_POSITIVE,
    ITERATION_LIMIT,
    LINE_SEARCH_FAILED,
    SOLVED,
)
from sheldrake.multibody.contact_solvers._kernels.velocity import contact_velocities, row_velocities

DECREMENT = np.float64(1e-28)  # (relative error in the norm of H)^2 that is round-off
AT_REST = np.float64(10.0)  # times the stiction tolerance: slower contacts may be at rest
STUCK = np.float64(0.5)  # times the slip speed: the regularisation speed of what sticks
TIGHT = np.float64(0.03)  # times Drake's regularisation speed: the least one, for the sake of the condition of H
NEARLY_STILL = np.float64(1e-8)  # (momentum over impulse of a step)^2 below which rest is tried


@kernel
def mul_A(model, problem, source, target):
    """x[target] = A x[source] over the participating dofs."""
    x = problem.x
    for place in range(problem.count[TREES_BEGIN], problem.count[TREES_END]):
        t = problem.tree[place, TREE_ORDER]
        first = model.tree[t, FIRST_DOF]
        for k in range(first, first + model.tree[t, NUM_DOFS]):
            at = model.dof[k, ROW_START] + model.dof[k, DEPTH_OF]
            x_k = x[source, k]
            y_k = problem.A[at] * x_k
            j = model.dof[k, PARENT_DOF]
            while j >= 0:
                at -= 1
                y_k += problem.A[at] * x[source, j]
                x[target, j] += problem.A[at] * x_k
                j = model.dof[j, PARENT_DOF]
            x[target, k] = y_k


@kernel
def apply_contact_impulses(model, problem, contacts):
    """Impulses and G at the present vc; adds J^T gamma to x[J_GAMMA]."""
    state = contacts.state
    for place in range(problem.count[CONTACTS_BEGIN], problem.count[CONTACTS_END]):
        c = contacts.index[place, ORDER]
        gamma, G = contact_impulse(model, contacts.law, c, load3_at(state, c, VC))
        store3_at(state, c, GAMMA, gamma)
        state[c, G_XX] = G[0]
        state[c, G_XY] = G[1]
        state[c, G_YY] = G[2]
        state[c, G_XZ] = G[3]
        state[c, G_YZ] = G[4]
        state[c, G_ZZ] = G[5]
        for a in range(contacts.index[c, WIDTH]):
            problem.x[J_GAMMA, contacts.index[c, DOFS + a]] += dot3(column3(contacts.J, 3 * c, a), gamma)


@kernel
def apply_row_impulses(problem, rows):
    """Impulses and G of the scalar rows at the present velocity; adds J^T gamma to x[J_GAMMA]."""
    law = rows.law
    for place in range(problem.count[ROWS_BEGIN], problem.count[ROWS_END]):
        r = rows.index[place, ORDER]
        vc = rows.state[r, ROW_VC]
        gamma, G = row_impulse(law[r, ROW_R], law[r, ROW_VHAT], law[r, ROW_LOWER], law[r, ROW_UPPER], vc)
        rows.state[r, ROW_GAMMA] = gamma
        rows.state[r, ROW_G] = G
        for a in range(rows.index[r, WIDTH]):
            problem.x[J_GAMMA, rows.index[r, ROW_DOFS + a]] += rows.J[r, a] * gamma


@kernel
def judge(model, problem, contacts, rows):
    """Impulses and gradient at the iterate.

    Returns:
        (small, momentum, impulse): whether the gradient is small against momentum and impulse, 1 or 0; the squares of
        these two, weighted by the mobilities [J].
    """
    x = problem.x
    for place in range(problem.count[TREES_BEGIN], problem.count[TREES_END]):
        t = problem.tree[place, TREE_ORDER]
        first = model.tree[t, FIRST_DOF]
        for k in range(first, first + model.tree[t, NUM_DOFS]):
            x[J_GAMMA, k] = 0.0
    apply_contact_impulses(model, problem, contacts)
    apply_row_impulses(problem, rows)
    residual = 0.0
    momentum = 0.0
    impulse = 0.0
    for place in range(problem.count[TREES_BEGIN], problem.count[TREES_END]):
        t = problem.tree[place, TREE_ORDER]
        first = model.tree[t, FIRST_DOF]
        for k in range(first, first + model.tree[t, NUM_DOFS]):
            g = x[P, k] - x[P_STAR, k] - x[J_GAMMA, k]
            x[GRADIENT, k] = g
            residual += g * g * x[MOBILITY, k]
            momentum += x[P, k] * x[P, k] * x[MOBILITY, k]
            impulse += x[J_GAMMA, k] * x[J_GAMMA, k] * x[MOBILITY, k]
    scale = momentum
    if impulse > scale:
        scale = impulse
    limit = model.option[RELATIVE_TOLERANCE] * root(scale) + model.option[ABSOLUTE_TOLERANCE]
    small = 1 if residual <= limit * limit else 0
    return small, momentum, impulse


@kernel(outline=True)
def evaluate(model, problem, contacts, rows):
    """`judge`, compiled once for all but the first call of a step."""
    return judge(model, problem, contacts, rows)


@kernel
def root(x):
    """sqrt with a defined (zero) derivative at zero."""
    if x > 0.0:
        return sqrt(x)
    return 0.0 * x


@kernel
def go_to_v0(model, problem, rows):
    """v = v0, its momenta and the velocities of the scalar rows; those of the contacts `prepare` has made."""
    for place in range(problem.count[TREES_BEGIN], problem.count[TREES_END]):
        t = problem.tree[place, TREE_ORDER]
        first = model.tree[t, FIRST_DOF]
        for k in range(first, first + model.tree[t, NUM_DOFS]):
            problem.x[V, k] = problem.x[V0, k]
    mul_A(model, problem, V, P)
    row_velocities(problem, rows, V, ROW_VC)


@kernel
def start(model, problem, rows):
    """The first iterate v0; completes p* = A v*."""
    go_to_v0(model, problem, rows)
    for place in range(problem.count[TREES_BEGIN], problem.count[TREES_END]):
        t = problem.tree[place, TREE_ORDER]
        first = model.tree[t, FIRST_DOF]
        for k in range(first, first + model.tree[t, NUM_DOFS]):
            problem.x[P_STAR, k] += problem.x[P, k]


@kernel
def momentum_cost(model, problem):
    """1/2 (v - v*)^T A (v - v*) [J]."""
    x = problem.x
    s = 0.0
    for place in range(problem.count[TREES_BEGIN], problem.count[TREES_END]):
        t = problem.tree[place, TREE_ORDER]
        first = model.tree[t, FIRST_DOF]
        for k in range(first, first + model.tree[t, NUM_DOFS]):
            s += (x[V, k] - x[V_STAR, k]) * (x[P, k] - x[P_STAR, k])
    return 0.5 * s


@kernel
def along_direction(model, problem):
    """(slope of the cost, slope of the momentum cost, dv^T A dv) at the iterate along dv [J]."""
    x = problem.x
    slope = 0.0
    slope_A = 0.0
    curvature_A = 0.0
    for place in range(problem.count[TREES_BEGIN], problem.count[TREES_END]):
        t = problem.tree[place, TREE_ORDER]
        first = model.tree[t, FIRST_DOF]
        for k in range(first, first + model.tree[t, NUM_DOFS]):
            slope += x[DV, k] * x[GRADIENT, k]
            slope_A += x[DV, k] * (x[P, k] - x[P_STAR, k])
            curvature_A += x[DV, k] * x[A_DV, k]
    return slope, slope_A, curvature_A


@kernel
def advance(model, problem, contacts, rows, alpha):
    """v += alpha dv, and with it momenta and constraint velocities."""
    x = problem.x
    for place in range(problem.count[TREES_BEGIN], problem.count[TREES_END]):
        t = problem.tree[place, TREE_ORDER]
        first = model.tree[t, FIRST_DOF]
        for k in range(first, first + model.tree[t, NUM_DOFS]):
            x[V, k] += alpha * x[DV, k]
            x[P, k] += alpha * x[A_DV, k]
    state = contacts.state
    for place in range(problem.count[CONTACTS_BEGIN], problem.count[CONTACTS_END]):
        c = contacts.index[place, ORDER]
        store3_at(state, c, VC, add3(load3_at(state, c, VC), scale3(load3_at(state, c, DVC), alpha)))
    for place in range(problem.count[ROWS_BEGIN], problem.count[ROWS_END]):
        r = rows.index[place, ORDER]
        rows.state[r, ROW_VC] += alpha * rows.state[r, ROW_DVC]


@kernel(outline=True)
def direction(model, problem, contacts, rows, factor):
    """Newton direction in x[DV], A dv, and the change of the constraint velocities along it; a status."""
    assemble(model, problem, contacts, rows, factor)
    if factorise(factor, problem.count[TREES_END] - problem.count[TREES_BEGIN]) != 0:
        return HESSIAN_NOT_POSITIVE
    newton_direction(model, problem, factor)
    mul_A(model, problem, DV, A_DV)
    contact_velocities(problem, contacts, DV, DVC)
    row_velocities(problem, rows, DV, ROW_DVC)
    return SOLVED


@kernel
def whole_cost(model, problem, contacts, rows):
    """(momentum cost, cost of momentum and constraints) at the iterate [J]."""
    momentum = momentum_cost(model, problem)
    return momentum, momentum + constraint_cost(model, problem, contacts, rows, 0.0)


@kernel(outline=True)
def iterate(model, problem, contacts, rows, factor):
    """Newton iterations from an iterate that `judge` has judged; a status.

    Drake searches the line in every iteration, and stops also when the cost stalls. When settling, the full step is
    taken where it does, and what a step can still gain being round-off is the other reason to stop: gradient^T H^-1
    gradient against momentum and impulse.
    """
    if lay_out(model, problem, contacts, rows, factor) != 0:
        return FACTOR_CAPACITY
    settle = model.setting[SETTLE]
    for _ in range(model.setting[MAX_ITERATIONS]):
        status = direction(model, problem, contacts, rows, factor)
        if status != SOLVED:
            return status
        slope, slope_A, curvature_A = along_direction(model, problem)
        alpha = 1.0 + 0.0 * slope
        before = 0.0 * slope
        if settle == 0 or full_step_does(model, problem, contacts, rows, slope, slope_A, curvature_A) == 0:
            momentum, before = whole_cost(model, problem, contacts, rows)
            alpha, found = line_search(model, problem, contacts, rows, slope, slope_A, curvature_A, momentum, before)
            if found == 0:
                return LINE_SEARCH_FAILED
        advance(model, problem, contacts, rows, alpha)
        problem.count[ITERATIONS] += 1
        small, momentum, impulse = evaluate(model, problem, contacts, rows)
        if small == 1:
            return SOLVED
        if settle == 1:
            if -slope <= DECREMENT * (momentum + impulse):
                return SOLVED
        else:
            _, cost = whole_cost(model, problem, contacts, rows)
            size = 0.5 * (magnitude(before) + magnitude(cost))
            if magnitude(before - cost) < COST_ABSOLUTE + COST_RELATIVE * size and alpha > 0.5:
                return SOLVED
    return ITERATION_LIMIT


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
    small, _, _ = evaluate(model, problem, contacts, rows)
    if small == 0:
        go_to_v0(model, problem, rows)
        contact_velocities(problem, contacts, V, VC)
        evaluate(model, problem, contacts, rows)


@kernel(outline=True)
def polish(model, problem, contacts, rows, factor):
    """Full Newton steps at the solution: they carry the derivatives of duals; values move within tolerance."""
    if lay_out(model, problem, contacts, rows, factor) != 0:
        return FACTOR_CAPACITY
    for _ in range(model.setting[POLISH]):
        status = direction(model, problem, contacts, rows, factor)
        if status != SOLVED:
            return status
        advance(model, problem, contacts, rows, 1.0)
        evaluate(model, problem, contacts, rows)
    return SOLVED


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
def solve_island(model, problem, contacts, rows, factor):
    """The island at hand, from its first iterate v0 on; a status."""
    start(model, problem, rows)
    status = np.int64(SOLVED)
    if model.setting[SETTLE] == 1 and model.setting[APPROXIMATION] != SAP:
        tighten(model, problem, contacts)
    small, momentum, impulse = judge(model, problem, contacts, rows)
    if small == 0:
        status = iterate(model, problem, contacts, rows, factor)
    elif model.setting[SETTLE] == 1 and momentum > 0.0 and momentum <= NEARLY_STILL * impulse:
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
