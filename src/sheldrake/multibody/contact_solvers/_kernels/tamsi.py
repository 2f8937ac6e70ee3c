"""kTamsi: implicit Newton on compliant contact with regularised friction, in sub-steps where needed.

Castro, Qu, Kuppuswamy, Alspach, Sherman 2020, "A transition-aware method for the simulation of compliant contact with
regularized friction". M, the forces and the contact geometry stay frozen over the sub-steps.
"""

import numpy as np

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common._kernels.vec import column3, dot3, load3_at, scale3, store3_at
from sheldrake.common.kernel import kernel
from sheldrake.multibody.contact_solvers._kernels.block_lu import eliminate
from sheldrake.multibody.contact_solvers._kernels.elimination import lay_out
from sheldrake.multibody.contact_solvers._kernels.gradient import mul_A, root
from sheldrake.multibody.contact_solvers._kernels.hessian import FIRST, ONE, places_of, put_momentum
from sheldrake.multibody.contact_solvers._kernels.islands import group_islands, select_island
from sheldrake.multibody.contact_solvers._kernels.problem import (
    A_DV,
    BLOCK_TREE,
    CONTACTS_BEGIN,
    CONTACTS_END,
    DEPTH,
    DIAGONAL,
    DISSIPATION,
    DOFS,
    DT,
    DV,
    DVC,
    FE0,
    FIRST_DOF,
    FIRST_SLOT,
    FRICTION,
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
    NUM_DOFS,
    NUM_ISLANDS,
    ORDER,
    P_STAR,
    PLACE,
    POLISH,
    SETTLE,
    SIZE,
    STICTION,
    STIFFNESS,
    SUBSTEPS,
    TREE_A,
    TREE_B,
    TREE_ORDER,
    TREES_BEGIN,
    TREES_END,
    V0,
    VC,
    WIDTH,
    P,
    V,
)
from sheldrake.multibody.contact_solvers._kernels.status import FACTOR_CAPACITY, SOLVED, TAMSI_FAILED
from sheldrake.multibody.contact_solvers._kernels.tamsi_limit import TOLERANCE, step_limit
from sheldrake.multibody.contact_solvers._kernels.velocity import contact_velocities, move

NEWTON_LIMIT = np.int64(20)
SUBSTEP_LIMIT = np.int64(20)
START_MOMENTUM = J_GAMMA  # row of Problem.x that holds p* of the sub-step; its own content is made at the end


@kernel
def regularised_friction(mu, vt, vs):
    """(slip direction, friction coefficient at that slip, its derivative over the slip [s/m], slip [m/s])."""
    small = TOLERANCE * vs
    slip = sqrt(vt[0] * vt[0] + vt[1] * vt[1] + small * small)
    s = slip / vs
    direction = (vt[0] / slip, vt[1] / slip)
    if s >= 1.0:
        return direction, mu + 0.0 * slip, 0.0 * slip, slip
    return direction, mu * s * (2.0 - s), 2.0 * mu * (1.0 - s) / vs, slip


@kernel(outline=True)
def contact_forces(model, problem, contacts, h):
    """Impulses h f, and K = -d(h f)/dvc with rows (xx, xy, xz), (xy, yy, yz), (0, 0, zz), at the present vc."""
    law = contacts.law
    state = contacts.state
    for place in range(problem.count[CONTACTS_BEGIN], problem.count[CONTACTS_END]):
        c = contacts.index[place, ORDER]
        vx, vy, vn = load3_at(state, c, VC)
        k = law[c, STIFFNESS]
        d = law[c, DISSIPATION]
        force = law[c, FE0] - h * k * vn
        damping = 1.0 - d * vn
        slope = 0.0 * vn
        if force >= 0.0 and damping > 0.0:
            slope -= h * k * damping
        if damping >= 0.0 and force > 0.0:
            slope -= d * force
        fn = 0.0 * vn
        if force > 0.0 and damping > 0.0:
            fn = force * damping
        t, mu, dmu, slip = regularised_friction(law[c, FRICTION], (vx, vy), model.option[STICTION])
        store3_at(state, c, GAMMA, (-h * mu * t[0] * fn, -h * mu * t[1] * fn, h * fn))
        across = h * fn * mu / slip
        along = h * fn * dmu
        state[c, G_XX] = across + (along - across) * t[0] * t[0]
        state[c, G_XY] = (along - across) * t[0] * t[1]
        state[c, G_YY] = across + (along - across) * t[1] * t[1]
        state[c, G_XZ] = h * mu * t[0] * slope
        state[c, G_YZ] = h * mu * t[1] * slope
        state[c, G_ZZ] = -h * slope


@kernel
def momentum_residual(model, problem, contacts):
    """x[GRADIENT] = A v - p* - J^T gamma over the participating dofs."""
    x = problem.x
    for place in range(problem.count[TREES_BEGIN], problem.count[TREES_END]):
        t = problem.tree[place, TREE_ORDER]
        first = model.tree[t, FIRST_DOF]
        for k in range(first, first + model.tree[t, NUM_DOFS]):
            x[GRADIENT, k] = x[P, k] - x[START_MOMENTUM, k]
    for place in range(problem.count[CONTACTS_BEGIN], problem.count[CONTACTS_END]):
        c = contacts.index[place, ORDER]
        gamma = load3_at(contacts.state, c, GAMMA)
        for a in range(contacts.index[c, WIDTH]):
            x[GRADIENT, contacts.index[c, DOFS + a]] -= dot3(column3(contacts.J, 3 * c, a), gamma)


@kernel(outline=True)
def assemble(model, problem, contacts, factor):
    """H = A + J^T K J, unsymmetric, in the blocks of `block_lu`, and -residual in factor.rhs."""
    put_momentum(model, problem, factor)
    H = factor.L
    for place in range(problem.count[TREES_END] - problem.count[TREES_BEGIN]):
        n = factor.block[place, SIZE]
        D = factor.block[place, DIAGONAL]
        first = model.tree[factor.block[place, BLOCK_TREE], FIRST_DOF]
        for i in range(n):
            factor.rhs[factor.block[place, FIRST_SLOT] + i] = -problem.x[GRADIENT, first + i]
            for j in range(i):
                H[D + n * i + j] = H[D + n * j + i]
    state = contacts.state
    for place in range(problem.count[CONTACTS_BEGIN], problem.count[CONTACTS_END]):
        c = contacts.index[place, ORDER]
        if state[c, G_XX] > 0.0 or state[c, G_ZZ] > 0.0:
            add_contact(factor, contacts, c, places_of(model, factor, contacts.index, c, DOFS))


@kernel
def add_column(contacts, c, begin, end, K_u, H, at, step):
    """Adds J^T K u to a column of H, where its dof k is at `at` + `step` k, for a contact's columns begin .. end."""
    for a in range(begin, end):
        H[at + step * contacts.index[c, DOFS + a]] += dot3(column3(contacts.J, 3 * c, a), K_u)


@kernel
def add_contact(factor, contacts, c, places):
    """H += J^T K J of a contact."""
    split, first, second, coupling = places
    address, step_second, step_first = coupling
    index = contacts.index
    width = index[c, WIDTH]
    below = address  # rows of the second tree, columns of the first
    above = address
    if split < width:
        if factor.block[index[c, TREE_B], PLACE] > factor.block[index[c, TREE_A], PLACE]:
            above += first[1] * second[1]
        else:
            below += first[1] * second[1]
    state = contacts.state
    for b in range(width):
        u = column3(contacts.J, 3 * c, b)
        K_u = (
            state[c, G_XX] * u[0] + state[c, G_XY] * u[1] + state[c, G_XZ] * u[2],
            state[c, G_XY] * u[0] + state[c, G_YY] * u[1] + state[c, G_YZ] * u[2],
            state[c, G_ZZ] * u[2],
        )
        j = index[c, DOFS + b]
        if b < split:
            add_column(contacts, c, FIRST, split, K_u, factor.L, first[0] + first[1] * j, ONE)
            add_column(contacts, c, split, width, K_u, factor.L, below + step_first * j, step_second)
        else:
            add_column(contacts, c, FIRST, split, K_u, factor.L, above + step_second * j, step_first)
            add_column(contacts, c, split, width, K_u, factor.L, second[0] + second[1] * j, ONE)


@kernel(outline=True)
def newton(model, problem, contacts, factor, h):
    """Newton iterations of one sub-step from v in x[V]; 1 when they converge, else 0."""
    state = contacts.state
    tolerance = TOLERANCE * model.option[STICTION]
    change = 2.0 * tolerance
    polished = 0
    for _ in range(NEWTON_LIMIT):
        contact_forces(model, problem, contacts, h)
        if change < tolerance:
            if polished == model.setting[POLISH]:
                return 1
            polished += 1
        momentum_residual(model, problem, contacts)
        assemble(model, problem, contacts, factor)
        if eliminate(factor, problem.count[TREES_END] - problem.count[TREES_BEGIN]) != 0:
            return 0
        scatter(model, problem, factor)
        mul_A(model, problem, DV, A_DV)
        contact_velocities(problem, contacts, DV, DVC)
        tangential = 0.0
        normal = 0.0
        alpha = 1.0
        for place in range(problem.count[CONTACTS_BEGIN], problem.count[CONTACTS_END]):
            c = contacts.index[place, ORDER]
            u = load3_at(state, c, DVC)
            tangential += u[0] * u[0] + u[1] * u[1]
            normal += u[2] * u[2]
            limit = step_limit((state[c, VC], state[c, VC + 1]), (u[0], u[1]), model.option[STICTION])
            if limit < 0.0:
                return 0
            if limit < alpha:
                alpha = limit
        change = root(tangential)
        if root(normal) > change:
            change = root(normal)
        move(model, problem, contacts, alpha)
        problem.count[ITERATIONS] += 1
    return 0


@kernel
def scatter(model, problem, factor):
    """x[DV] from the solution by slots."""
    for place in range(problem.count[TREES_BEGIN], problem.count[TREES_END]):
        t = problem.tree[place, TREE_ORDER]
        first = model.tree[t, FIRST_DOF]
        for dof in range(first, first + model.tree[t, NUM_DOFS]):
            problem.x[DV, dof] = factor.rhs[factor.slot[dof]]


@kernel(outline=True)
def substeps(model, problem, contacts, factor, n):
    """The whole step in n equal sub-steps from v0; 1 when all converge, else 0."""
    x = problem.x
    law = contacts.law
    h = model.option[DT] / n
    for place in range(problem.count[TREES_BEGIN], problem.count[TREES_END]):
        t = problem.tree[place, TREE_ORDER]
        first = model.tree[t, FIRST_DOF]
        for k in range(first, first + model.tree[t, NUM_DOFS]):
            x[V, k] = x[V0, k]
    mul_A(model, problem, V, P)
    contact_velocities(problem, contacts, V, VC)
    for place in range(problem.count[CONTACTS_BEGIN], problem.count[CONTACTS_END]):
        c = contacts.index[place, ORDER]
        law[c, FE0] = law[c, STIFFNESS] * law[c, DEPTH]
    for _ in range(n):
        for place in range(problem.count[TREES_BEGIN], problem.count[TREES_END]):
            t = problem.tree[place, TREE_ORDER]
            first = model.tree[t, FIRST_DOF]
            for k in range(first, first + model.tree[t, NUM_DOFS]):
                x[START_MOMENTUM, k] = x[P, k] + x[P_STAR, k] / n
        if newton(model, problem, contacts, factor, h) == 0:
            return 0
        for place in range(problem.count[CONTACTS_BEGIN], problem.count[CONTACTS_END]):
            c = contacts.index[place, ORDER]
            force = law[c, FE0] - h * law[c, STIFFNESS] * contacts.state[c, VC + 2]
            if force < 0.0:
                force = 0.0 * force
            law[c, FE0] = force
    return 1


@kernel
def store_impulses(model, problem, contacts, n):
    """Impulses of the last sub-step's forces over the whole step, and J^T of them in x[J_GAMMA]."""
    x = problem.x
    for place in range(problem.count[TREES_BEGIN], problem.count[TREES_END]):
        t = problem.tree[place, TREE_ORDER]
        first = model.tree[t, FIRST_DOF]
        for k in range(first, first + model.tree[t, NUM_DOFS]):
            x[J_GAMMA, k] = 0.0
    for place in range(problem.count[CONTACTS_BEGIN], problem.count[CONTACTS_END]):
        c = contacts.index[place, ORDER]
        gamma = scale3(load3_at(contacts.state, c, GAMMA), 1.0 * n)
        store3_at(contacts.state, c, GAMMA, gamma)
        for a in range(contacts.index[c, WIDTH]):
            x[J_GAMMA, contacts.index[c, DOFS + a]] += dot3(column3(contacts.J, 3 * c, a), gamma)


@kernel
def solve_island(model, problem, contacts, rows, factor):
    """The island at hand in as few sub-steps as will do; a status."""
    if lay_out(model, problem, contacts, rows, factor) != 0:
        return FACTOR_CAPACITY
    for parts in range(1, SUBSTEP_LIMIT + 1):
        if parts > problem.count[SUBSTEPS]:
            problem.count[SUBSTEPS] = parts
        if substeps(model, problem, contacts, factor, parts) == 1:
            store_impulses(model, problem, contacts, parts)
            return SOLVED
    return TAMSI_FAILED


@kernel
def tamsi_solve(model, problem, contacts, rows, factor):
    """Fills x[V] over the participating dofs, the impulses and x[J_GAMMA]; after `prepare`. Returns a status.

    x[P_STAR] holds dt times the generalized forces; here A = M. Drake's sub-steps are those of all bodies at once; when
    settling, each island of trees that contacts connect has its own.
    """
    problem.count[ITERATIONS] = 0
    problem.count[SUBSTEPS] = 0
    group_islands(model, problem, contacts, rows, model.setting[SETTLE])
    for island in range(problem.count[NUM_ISLANDS]):
        select_island(problem, island)
        status = solve_island(model, problem, contacts, rows, factor)
        if status != SOLVED:
            return status
    return SOLVED
