"""Constraint velocities: J times a vector over the dofs, columns only for the dofs that move the constraint."""

from sheldrake.common._kernels.vec import store3_at
from sheldrake.common.kernel import kernel
from sheldrake.multibody.contact_solvers._kernels.problem import DOFS, ROW_DOFS, WIDTH


@kernel
def contact_velocities(contacts, count, x, row, column):
    """Columns column .. column + 2 of every contact's state = J x[row] [m/s]."""
    for c in range(count):
        r = 3 * c
        ux = 0.0
        uy = 0.0
        uz = 0.0
        for a in range(contacts.index[c, WIDTH]):
            s = x[row, contacts.index[c, DOFS + a]]
            ux += contacts.J[r, a] * s
            uy += contacts.J[r + 1, a] * s
            uz += contacts.J[r + 2, a] * s
        store3_at(contacts.state, c, column, (ux, uy, uz))


@kernel
def row_velocities(rows, count, x, row, column):
    """Column `column` of every row's state = J x[row]."""
    for r in range(count):
        u = 0.0
        for a in range(rows.index[r, WIDTH]):
            u += rows.J[r, a] * x[row, rows.index[r, ROW_DOFS + a]]
        rows.state[r, column] = u
