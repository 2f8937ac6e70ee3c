"""Constraint velocities: J times a vector over the dofs, columns only for the dofs that move the constraint."""

import numpy as np

from sheldrake.common._kernels.vec import add3, load3_at, scale3, store3_at
from sheldrake.common.kernel import kernel
from sheldrake.multibody.contact_solvers._kernels.problem import (
    A_DV,
    CONTACTS_BEGIN,
    CONTACTS_END,
    DOFS,
    DV,
    DVC,
    FIRST_DOF,
    NUM_DOFS,
    ORDER,
    ROW_DOFS,
    ROWS_BEGIN,
    ROWS_END,
    SIXES,
    TREE_ORDER,
    TREES_BEGIN,
    TREES_END,
    VC,
    WIDTH,
    P,
    V,
)
from sheldrake.multibody.contact_solvers._kernels.six import SIX, dot_six, load_six_of

FIRST = np.int64(0)  # column


@kernel
def contact_velocity(contacts, c, x, row, column):
    """Columns column .. column + 2 of a contact's state = J x[row] [m/s]."""
    sixes = contacts.index[c, SIXES]
    if sixes > 0:
        u = velocity_of_six(contacts, c, FIRST, x, row)
        if sixes > 1:
            u = add3(u, velocity_of_six(contacts, c, SIX, x, row))
        store3_at(contacts.state, c, column, u)
    else:
        store3_at(contacts.state, c, column, velocity_of_any(contacts, c, x, row))


@kernel
def velocity_of_six(contacts, c, at, x, row):
    """The part of six columns of J, from `at` on, in J x[row]."""
    J = contacts.J
    r = 3 * c
    s = load_six_of(x, row, contacts.index[c, DOFS + at])
    return (
        dot_six(load_six_of(J, r, at), s),
        dot_six(load_six_of(J, r + 1, at), s),
        dot_six(load_six_of(J, r + 2, at), s),
    )


@kernel
def velocity_of_any(contacts, c, x, row):
    """J x[row] of a contact with any columns."""
    r = 3 * c
    ux = 0.0
    uy = 0.0
    uz = 0.0
    for a in range(contacts.index[c, WIDTH]):
        s = x[row, contacts.index[c, DOFS + a]]
        ux += contacts.J[r, a] * s
        uy += contacts.J[r + 1, a] * s
        uz += contacts.J[r + 2, a] * s
    return (ux, uy, uz)


@kernel(outline=True)
def contact_velocities(problem, contacts, row, column):
    """`contact_velocity` of the island's contacts."""
    for place in range(problem.count[CONTACTS_BEGIN], problem.count[CONTACTS_END]):
        contact_velocity(contacts, contacts.index[place, ORDER], problem.x, row, column)


@kernel
def row_velocities(problem, rows, row, column):
    """Column `column` of the state of the island's rows = J x[row]."""
    for place in range(problem.count[ROWS_BEGIN], problem.count[ROWS_END]):
        r = rows.index[place, ORDER]
        u = 0.0
        for a in range(rows.index[r, WIDTH]):
            u += rows.J[r, a] * problem.x[row, rows.index[r, ROW_DOFS + a]]
        rows.state[r, column] = u


@kernel
def move(model, problem, contacts, alpha):
    """v += alpha dv, and with it momenta and contact velocities."""
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
