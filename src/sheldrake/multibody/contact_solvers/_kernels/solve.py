"""One solve, from the plant's rows to the next velocities, in two stages. kTamsi has a kernel of its own."""

from sheldrake.common.kernel import kernel
from sheldrake.multibody.contact_solvers._kernels.prepare import prepare
from sheldrake.multibody.contact_solvers._kernels.problem import (
    ACTIVE,
    FIRST_DOF,
    NUM_CONTACTS,
    NUM_DOFS,
    NUM_ROWS,
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
def leave_free(model, problem):
    """Takes every tree out of the solve."""
    for t in range(model.tree.shape[0]):
        problem.tree[t, ACTIVE] = 0


@kernel
def move_free_trees(model, problem):
    """x[V] = v* for the trees that no constraint touches."""
    for t in range(model.tree.shape[0]):
        if problem.tree[t, ACTIVE] == 0:
            first = model.tree[t, FIRST_DOF]
            for k in range(first, first + model.tree[t, NUM_DOFS]):
                problem.x[V, k] = problem.x[V_STAR, k]


@kernel(top=True, short_loops=True)
def prepare_problem(solver_model: SolverModel, problem: Problem, contacts: Contacts, rows: Rows) -> None:
    """What the laws need of contacts and rows, and which trees take part."""
    if problem.count[NUM_CONTACTS] + problem.count[NUM_ROWS] == 0:
        leave_free(solver_model, problem)
    else:
        prepare(solver_model, problem, contacts, rows)


@kernel(top=True, short_loops=True)
def solve(solver_model: SolverModel, problem: Problem, contacts: Contacts, rows: Rows, factor: Factor) -> int:
    """x[V] of all dofs of a prepared problem under kLagged, kSimilar or kSap. Returns a status."""
    status = SOLVED
    if problem.count[NUM_CONTACTS] + problem.count[NUM_ROWS] != 0:
        status = sap_solve(solver_model, problem, contacts, rows, factor)
    move_free_trees(solver_model, problem)
    return status


@kernel(top=True, short_loops=True)
def solve_tamsi(solver_model: SolverModel, problem: Problem, contacts: Contacts, rows: Rows, factor: Factor) -> int:
    """x[V] of all dofs of a prepared problem under kTamsi, which knows contacts alone. Returns a status."""
    status = SOLVED
    if problem.count[NUM_CONTACTS] != 0:
        status = tamsi_solve(solver_model, problem, contacts, rows, factor)
    move_free_trees(solver_model, problem)
    return status
