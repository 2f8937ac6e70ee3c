"""Impulses and gradient of the convex cost at the iterate, over an island's trees, contacts and rows."""

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common._kernels.vec import column3, dot3, load3_at, store3_at
from sheldrake.common.kernel import kernel
from sheldrake.multibody.contact_solvers._kernels.contact_law import contact_impulse
from sheldrake.multibody.contact_solvers._kernels.problem import (
    ABSOLUTE_TOLERANCE,
    CONTACTS_BEGIN,
    CONTACTS_END,
    DEPTH_OF,
    DOFS,
    FIRST_DOF,
    G_XX,
    G_XY,
    G_XZ,
    G_YY,
    G_YZ,
    G_ZZ,
    GAMMA,
    GRADIENT,
    J_GAMMA,
    MOBILITY,
    NUM_DOFS,
    ORDER,
    P_STAR,
    PARENT_DOF,
    RELATIVE_TOLERANCE,
    ROW_DOFS,
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
    SIXES,
    TREE_ORDER,
    TREES_BEGIN,
    TREES_END,
    VC,
    WIDTH,
    P,
)
from sheldrake.multibody.contact_solvers._kernels.scalar_row import row_impulse
from sheldrake.multibody.contact_solvers._kernels.six import (
    SIX,
    load_six_of,
    mul_packed_six,
    plus_scaled,
    store_six_of,
)


@kernel
def is_chain_of_six(model, t):
    """Whether a tree has six dofs, each moved by those before it: its part of A is a packed triangle."""
    return model.tree[t, NUM_DOFS] == SIX and model.dof[model.tree[t, FIRST_DOF] + 5, DEPTH_OF] == 5


@kernel
def mul_A(model, problem, source, target):
    """x[target] = A x[source] over the participating dofs."""
    x = problem.x
    for place in range(problem.count[TREES_BEGIN], problem.count[TREES_END]):
        t = problem.tree[place, TREE_ORDER]
        first = model.tree[t, FIRST_DOF]
        if is_chain_of_six(model, t):
            y = mul_packed_six(problem.A, model.dof[first, ROW_START], load_six_of(x, source, first))
            store_six_of(x, target, first, y)
            continue
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


@kernel(outline=True)
def multiply_A(model, problem, source, target):
    """`mul_A`, compiled once for all but the first call of a step."""
    mul_A(model, problem, source, target)


@kernel
def apply_contact_impulses(model, problem, contacts):
    """Impulses and G at the present vc; adds J^T gamma to x[J_GAMMA].

    In two loops: no contact then waits for the roots and quotients of the one before it.
    """
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
    for place in range(problem.count[CONTACTS_BEGIN], problem.count[CONTACTS_END]):
        c = contacts.index[place, ORDER]
        push_trees(problem.x, contacts, c, load3_at(state, c, GAMMA))


@kernel
def push_trees(x, contacts, c, gamma):
    """x[J_GAMMA] += J^T gamma of a contact."""
    sixes = contacts.index[c, SIXES]
    for side in range(sixes):
        at = SIX * side
        k = contacts.index[c, DOFS + at]
        push = load_six_of(x, J_GAMMA, k)
        push = plus_scaled(push, gamma[0], load_six_of(contacts.J, 3 * c, at))
        push = plus_scaled(push, gamma[1], load_six_of(contacts.J, 3 * c + 1, at))
        push = plus_scaled(push, gamma[2], load_six_of(contacts.J, 3 * c + 2, at))
        store_six_of(x, J_GAMMA, k, push)
    if sixes == 0:
        for a in range(contacts.index[c, WIDTH]):
            x[J_GAMMA, contacts.index[c, DOFS + a]] += dot3(column3(contacts.J, 3 * c, a), gamma)


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
        (excess, momentum, impulse): the square of the gradient over that of what is small against momentum and impulse;
        the squares of these two, weighted by the mobilities [J].
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
    return residual / (limit * limit), momentum, impulse


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
