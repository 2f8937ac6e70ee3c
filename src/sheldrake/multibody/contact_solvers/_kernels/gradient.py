"""Velocities of constraints, impulses, and the gradient of the convex cost, over an island's trees, contacts and rows.

The gradient is A (v - v*) - J^T gamma (Castro, Permenter, Han 2022, section IV-A), what is left of eq. 18.
"""

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common._kernels.vec import add3, column3, dot3, scale3, store3
from sheldrake.common.kernel import kernel
from sheldrake.multibody.contact_solvers._kernels.laws import contact_impulse, row_impulse
from sheldrake.multibody.contact_solvers._kernels.problem import (
    contacts_of_island,
    diagonal,
    dofs_above,
    dofs_of_island,
    rows_of_island,
    trees_of_island,
)
from sheldrake.multibody.contact_solvers._kernels.six import (
    SIX,
    dot_six,
    load_six,
    load_three_sixes,
    mul_packed_six,
    plus_scaled,
    store_six,
)

# ---- constraint velocities
#
# Constraint velocities: J times a vector over the dofs, columns only for the dofs that move the constraint.

FIRST = 0  # column


@kernel
def put_velocity(contact, v, which):
    """J v of a contact [m/s] becomes its velocity or, `which` being DVC, the change of it."""
    if contact.sixes > 0:
        u = velocity_of_six(contact, FIRST, v)
        if contact.sixes > 1:
            u = add3(u, velocity_of_six(contact, SIX, v))
        store3(contact.velocity, which, u)
    else:
        store3(contact.velocity, which, velocity_of_any(contact, v))


@kernel
def velocity_of_six(contact, at, v):
    """The part of six columns of J, from `at` on, in J v."""
    x, y, z = load_three_sixes(contact.J, at)
    s = load_six(v, contact.dofs[at])
    return (dot_six(x, s), dot_six(y, s), dot_six(z, s))


@kernel
def velocity_of_any(contact, v):
    """J v of a contact with any columns."""
    u = (0.0, 0.0, 0.0)
    for a in range(contact.width):
        u = add3(u, scale3(column3(contact.J, 0, a), v[contact.dofs[a]]))
    return u


@kernel(outline=True)
def contact_velocities(problem, contacts, v, which):
    """`put_velocity` of the island's contacts."""
    for contact in contacts_of_island(problem, contacts):
        put_velocity(contact, v, which)


@kernel
def row_velocities(problem, rows, v, which):
    """J v of the island's rows, as `put_velocity`."""
    for row in rows_of_island(problem, rows):
        u = 0.0
        for a in range(row.width):
            u += row.J[a] * v[row.dofs[a]]
        row.velocity[which] = u


@kernel
def put_v0(model, problem):
    """v = v0."""
    for k in dofs_of_island(model, problem):
        problem.v[k] = problem.v0[k]


@kernel
def move(model, problem, contacts, alpha):
    """v += alpha dv, and with it momenta and contact velocities."""
    for k in dofs_of_island(model, problem):
        problem.v[k] += alpha * problem.dv[k]
        problem.p[k] += alpha * problem.a_dv[k]
    for contact in contacts_of_island(problem, contacts):
        contact.vc = add3(contact.vc, scale3(contact.dvc, alpha))


# ---- impulses and gradient


@kernel
def is_chain_of_six(model, t):
    """Whether a tree has six dofs, each moved by those before it: its part of A is a packed triangle."""
    tree = model.trees[t]
    return tree.num_dofs == SIX and model.dofs[tree.first_dof + 5].depth == 5


@kernel
def mul_A(model, problem, x, y):
    """y = A x over the participating dofs, of two vectors of the problem."""
    for t in trees_of_island(problem):
        first = model.trees[t].first_dof
        if is_chain_of_six(model, t):
            store_six(y, first, mul_packed_six(problem.A, model.dofs[first].row_start, load_six(x, first)))
            continue
        for k in range(first, first + model.trees[t].num_dofs):
            x_k = x[k]
            y_k = problem.A[diagonal(model, k)] * x_k
            for j, at in dofs_above(model, k):
                y_k += problem.A[at] * x[j]
                y[j] += problem.A[at] * x_k
            y[k] = y_k


@kernel(outline=True)
def multiply_A(model, problem, x, y):
    """`mul_A`, compiled once for all but the first call of a step."""
    mul_A(model, problem, x, y)


@kernel
def apply_contact_impulses(model, problem, contacts):
    """Impulses and G at the present vc; adds J^T gamma to `problem.j_gamma`.

    In two loops: no contact then waits for the roots and quotients of the one before it.
    """
    for contact in contacts_of_island(problem, contacts):
        contact.gamma, contact.G = contact_impulse(model, contact, contact.vc)
    for contact in contacts_of_island(problem, contacts):
        push_trees(problem.j_gamma, contact, contact.gamma)


@kernel
def push_trees(j_gamma, contact, gamma):
    """j_gamma += J^T gamma of a contact."""
    sixes = contact.sixes
    for side in range(sixes):
        at = SIX * side
        k = contact.dofs[at]
        x, y, z = load_three_sixes(contact.J, at)
        push = plus_scaled(load_six(j_gamma, k), gamma[0], x)
        store_six(j_gamma, k, plus_scaled(plus_scaled(push, gamma[1], y), gamma[2], z))
    if sixes == 0:
        for a in range(contact.width):
            j_gamma[contact.dofs[a]] += dot3(column3(contact.J, 0, a), gamma)


@kernel
def apply_row_impulses(problem, rows):
    """Impulses and G of the scalar rows at the present velocity; adds J^T gamma to `problem.j_gamma`."""
    for row in rows_of_island(problem, rows):
        row.gamma, row.G = row_impulse(row, row.vc)
        for a in range(row.width):
            problem.j_gamma[row.dofs[a]] += row.J[a] * row.gamma


@kernel
def judge(model, problem, contacts, rows):
    """Impulses and gradient at the iterate, and whether it will do (Castro, Permenter, Han 2022, eqs. 25 and 26).

    Returns:
        (excess, momentum, impulse): the square of the gradient over that of what is small against momentum and impulse;
        the squares of these two, weighted by the mobilities [J].
    """
    for k in dofs_of_island(model, problem):
        problem.j_gamma[k] = 0.0
    apply_contact_impulses(model, problem, contacts)
    apply_row_impulses(problem, rows)
    residual = 0.0
    momentum = 0.0
    impulse = 0.0
    for k in dofs_of_island(model, problem):
        g = problem.p[k] - problem.p_star[k] - problem.j_gamma[k]
        problem.gradient[k] = g
        residual += g * g * problem.mobility[k]
        momentum += problem.p[k] * problem.p[k] * problem.mobility[k]
        impulse += problem.j_gamma[k] * problem.j_gamma[k] * problem.mobility[k]
    scale = momentum
    if impulse > scale:
        scale = impulse
    limit = model.relative_tolerance * root(scale) + model.absolute_tolerance
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


@kernel
def magnitude(x):
    """|x| of a number or a dual."""
    if x < 0.0:
        return -x
    return x
