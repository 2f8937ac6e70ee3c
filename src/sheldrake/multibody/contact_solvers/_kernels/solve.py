"""One solve, from the plant's rows to the next velocities."""

from sheldrake.common.kernel import kernel
from sheldrake.multibody.contact_solvers._kernels.prepare import prepare
from sheldrake.multibody.contact_solvers._kernels.problem import (
    APPROXIMATION,
    FIRST_DOF,
    NUM_CONTACTS,
    NUM_DOFS,
    NUM_ROWS,
    TAMSI,
    V_STAR,
    Contacts,
    Factor,
    Problem,
    Rows,
    SolverModel,
    V,
)
from sheldrake.multibody.contact_solvers._kernels.sap import sap_solve
from sheldrake.multibody.contact_solvers._kernels.status import SOLVED
from sheldrake.multibody.contact_solvers._kernels.tamsi import tamsi_solve


@kernel
def solve_rows(model, problem, contacts, rows, factor):
    """x[V] of all dofs: the solver's where a constraint touches the tree, v* elsewhere. Returns a status."""
    status = SOLVED
    if problem.count[NUM_CONTACTS] + problem.count[NUM_ROWS] == 0:
        for t in range(model.tree.shape[0]):
            problem.active[t] = 0
    else:
        prepare(model, problem, contacts, rows)
        if model.setting[APPROXIMATION] == TAMSI:
            status = tamsi_solve(model, problem, contacts, rows, factor)
        else:
            status = sap_solve(model, problem, contacts, rows, factor)
    for t in range(model.tree.shape[0]):
        if problem.active[t] == 0:
            first = model.tree[t, FIRST_DOF]
            for k in range(first, first + model.tree[t, NUM_DOFS]):
                problem.x[V, k] = problem.x[V_STAR, k]
    return status


@kernel(top=True)
def solve(model: SolverModel, problem: Problem, contacts: Contacts, rows: Rows, factor: Factor) -> int:
    """Solves a problem that Python has written; a plant's step inlines `solve_rows` instead."""
    return solve_rows(model, problem, contacts, rows, factor)
