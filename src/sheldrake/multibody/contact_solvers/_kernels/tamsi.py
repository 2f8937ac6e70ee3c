"""kTamsi: implicit Newton on compliant contact with regularised friction, in sub-steps where needed.

Castro, Qu, Kuppuswamy, Alspach, Sherman 2020, "A transition-aware method for the simulation of compliant contact with
regularized friction". M, the forces and the contact geometry stay frozen over the sub-steps.
"""

import numpy as np

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common._kernels.vec import column3, dot3, load3_at, scale3, store3_at
from sheldrake.common.kernel import kernel
from sheldrake.multibody.contact_solvers._kernels.elimination import number_in_order
from sheldrake.multibody.contact_solvers._kernels.gradient import mul_A, root
from sheldrake.multibody.contact_solvers._kernels.islands import group_islands, select_island
from sheldrake.multibody.contact_solvers._kernels.line_search import magnitude
from sheldrake.multibody.contact_solvers._kernels.problem import (
    A_DV,
    CONTACTS_BEGIN,
    CONTACTS_END,
    DEPTH,
    DEPTH_OF,
    DISSIPATION,
    DOFS,
    DT,
    DV,
    DVC,
    FE0,
    FIRST_DOF,
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
    ORDER,
    P_STAR,
    PARENT_DOF,
    PARTICIPATING,
    POLISH,
    ROW_START,
    STICTION,
    STIFFNESS,
    SUBSTEPS,
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


@kernel
def assemble_dense(model, problem, contacts, factor):
    """H = A + J^T K J, unsymmetric, n by n in factor.L, and -residual in factor.rhs."""
    H = factor.L
    n = problem.count[PARTICIPATING]
    for i in range(n * n):
        H[i] = 0.0
    for place in range(problem.count[TREES_BEGIN], problem.count[TREES_END]):
        t = problem.tree[place, TREE_ORDER]
        first = model.tree[t, FIRST_DOF]
        for dof in range(first, first + model.tree[t, NUM_DOFS]):
            i = factor.slot[dof]
            at = model.dof[dof, ROW_START] + model.dof[dof, DEPTH_OF]
            H[i * n + i] = problem.A[at]
            other = model.dof[dof, PARENT_DOF]
            while other >= 0:
                at -= 1
                j = factor.slot[other]
                H[i * n + j] = problem.A[at]
                H[j * n + i] = problem.A[at]
                other = model.dof[other, PARENT_DOF]
            factor.rhs[i] = -problem.x[GRADIENT, dof]
    state = contacts.state
    for place in range(problem.count[CONTACTS_BEGIN], problem.count[CONTACTS_END]):
        c = contacts.index[place, ORDER]
        for b in range(contacts.index[c, WIDTH]):
            u = column3(contacts.J, 3 * c, b)
            K_u = (
                state[c, G_XX] * u[0] + state[c, G_XY] * u[1] + state[c, G_XZ] * u[2],
                state[c, G_XY] * u[0] + state[c, G_YY] * u[1] + state[c, G_YZ] * u[2],
                state[c, G_ZZ] * u[2],
            )
            j = factor.slot[contacts.index[c, DOFS + b]]
            for a in range(contacts.index[c, WIDTH]):
                i = factor.slot[contacts.index[c, DOFS + a]]
                H[i * n + j] += dot3(column3(contacts.J, 3 * c, a), K_u)


@kernel(outline=True)
def eliminate(H, x, n):
    """Solves H y = x in place, n by n, by Gaussian elimination with partial pivoting; 1 when singular, else 0."""
    for k in range(n):
        pivot = k
        largest = magnitude(H[k * n + k])
        for i in range(k + 1, n):
            if magnitude(H[i * n + k]) > largest:
                largest = magnitude(H[i * n + k])
                pivot = i
        if not largest > 0.0:
            return 1
        if pivot != k:
            for j in range(k, n):
                swap = H[k * n + j]
                H[k * n + j] = H[pivot * n + j]
                H[pivot * n + j] = swap
            swap = x[k]
            x[k] = x[pivot]
            x[pivot] = swap
        for i in range(k + 1, n):
            f = H[i * n + k] / H[k * n + k]
            for j in range(k + 1, n):
                H[i * n + j] -= f * H[k * n + j]
            x[i] -= f * x[k]
    for k in range(n - 1, -1, -1):
        s = x[k]
        for j in range(k + 1, n):
            s -= H[k * n + j] * x[j]
        x[k] = s / H[k * n + k]
    return 0


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
        assemble_dense(model, problem, contacts, factor)
        if eliminate(factor.L, factor.rhs, problem.count[PARTICIPATING]) != 0:
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
def tamsi_solve(model, problem, contacts, rows, factor):
    """Fills x[V] over the participating dofs, the impulses and x[J_GAMMA]; after `prepare`. Returns a status.

    x[P_STAR] holds dt times the generalized forces; here A = M.
    """
    group_islands(model, problem, contacts, rows, 0)
    select_island(problem, 0)
    number_in_order(model, problem, factor)
    n = problem.count[PARTICIPATING]
    if n * n > factor.L.shape[0]:
        return FACTOR_CAPACITY
    problem.count[ITERATIONS] = 0
    for parts in range(1, SUBSTEP_LIMIT + 1):
        problem.count[SUBSTEPS] = parts
        if substeps(model, problem, contacts, factor, parts) == 1:
            store_impulses(model, problem, contacts, parts)
            return SOLVED
    return TAMSI_FAILED
