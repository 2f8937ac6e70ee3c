"""One solve, from the plant's rows to the next velocities: a problem is prepared, then solved island by island.

Islands are trees that constraints connect, directly or through others. In one step nothing passes between islands.
"""

from typing import NamedTuple

from sheldrake.common._kernels.vec import inverse_packed_diagonal_six, store_six
from sheldrake.common.kernel import Kernel, kernel
from sheldrake.multibody.contact_solvers._kernels.laws import (
    LAGGED,
    SAP,
    SIMILAR,
    prepare_hunt_crossley,
    prepare_row,
    prepare_sap_cone,
    rigid_part,
    row_group_delassus,
)
from sheldrake.multibody.contact_solvers._kernels.newton import as_drake, predict_slip, to_rest, to_rest_on_cones
from sheldrake.multibody.contact_solvers._kernels.problem import (
    SOLVED,
    VC,
    Contacts,
    Factor,
    Problem,
    Rows,
    SolverModel,
    diagonal,
    dofs_of_tree,
    is_chain_of_six,
    island_of_constraint,
    island_of_tree,
    put_sixes,
    put_velocity,
    solve_in_lanes,
)
from sheldrake.multibody.contact_solvers._kernels.tamsi import tamsi_island

# ---- who takes part


@kernel
def leave_free(model, problem):
    """Takes every tree out of the solve."""
    for t in range(len(model.trees)):
        problem.trees[t].active = 0


@kernel
def mark_trees(problem, constraints, count):
    """A tree takes part when a constraint touches it."""
    for c in range(count):
        for t in (constraints[c].tree_a, constraints[c].tree_b):
            if t >= 0:
                problem.trees[t].active = 1


@kernel
def mobilities(model, problem):
    """1 / diag(A) of the dofs that take part."""
    for t in range(len(model.trees)):
        if problem.trees[t].active == 1:
            first = model.trees[t].first_dof
            if is_chain_of_six(model, t):
                m = inverse_packed_diagonal_six(problem.A, model.dofs[first].row_start)
                store_six(problem.mobility, first, m)
            else:
                for k in dofs_of_tree(model, t):
                    problem.mobility[k] = 1.0 / problem.A[diagonal(model, k)]


@kernel
def prepare_rows(model, problem, rows):
    """Resistance and push of all scalar rows that are not ahead."""
    w = 0.0
    for r in range(problem.rows_ahead, problem.num_rows):
        row = rows[r]
        if row.group > 0:
            w = row_group_delassus(problem, rows, r, row.group)
        prepare_row(row, model.dt, rigid_part(model) * w, 1.0)


@kernel
def prepare(model, problem, contacts, rows, prepare_contact):
    """Marks the trees that take part and makes every constraint's law from what the plant wrote."""
    leave_free(model, problem)
    mark_trees(problem, contacts, problem.num_contacts)
    mark_trees(problem, rows, problem.num_rows)
    mobilities(model, problem)
    for c in range(problem.num_contacts):
        contact = contacts[c]
        put_sixes(model, contact)
        put_velocity(contact, problem.v0, VC, True)
        prepare_contact(model, problem, contact)
    prepare_rows(model, problem, rows)


# ---- islands

TREES, CONTACTS, ROWS = 0, 1, 2  # of `ends`


@kernel
def find_root(problem, t):
    """First tree of the set of t; shortens the way for the next who asks."""
    while problem.trees[t].root != t:
        problem.trees[t].root = problem.trees[problem.trees[t].root].root
        t = problem.trees[t].root
    return t


@kernel
def connect(problem, constraints, count):
    """Joins the sets of the two trees of each constraint; the lower tree leads.

    Contacts of one pair follow each other: the first of them tells all.
    """
    a = b = -1
    for c in range(count):
        if constraints[c].tree_a == a and constraints[c].tree_b == b:
            continue
        a, b = constraints[c].tree_a, constraints[c].tree_b
        if a >= 0 and b >= 0 and a != b:
            root_a, root_b = find_root(problem, a), find_root(problem, b)
            problem.trees[max(root_a, root_b)].root = min(root_a, root_b)


@kernel
def sort_by_island(problem, items, count, kind, island_of):
    """Places of trees, contacts or rows, island after island, each in their order; where islands end."""
    for k in range(problem.num_islands):
        problem.trees[k].ends[kind] = 0
    for i in range(count):
        k = island_of(problem, items[i])
        if k >= 0:
            problem.trees[k].ends[kind] += 1
    begin = 0
    for k in range(problem.num_islands):
        ends = problem.trees[k].ends
        begin, ends[kind] = begin + ends[kind], begin
    for i in range(count):
        k = island_of(problem, items[i])
        if k >= 0:
            ends = problem.trees[k].ends
            items[ends[kind]].order = i
            ends[kind] += 1


@kernel(outline=True)
def sort_islands(problem, contacts, rows):
    """Finds islands, numbered by their first trees, and orders trees, contacts and rows by them."""
    num_trees = len(problem.trees)
    for t in range(num_trees):
        problem.trees[t].root = t
    connect(problem, contacts, problem.num_contacts)
    connect(problem, rows, problem.num_rows)
    for t in range(num_trees):
        problem.trees[t].root = find_root(problem, t)
    islands = 0
    for t in range(num_trees):  # a root comes before the others of its set: it has its number when they ask
        tree = problem.trees[t]
        if tree.active == 1:
            if tree.root == t:
                tree.root = islands
                islands += 1
            else:
                tree.root = problem.trees[tree.root].root
    problem.num_islands = islands
    sort_by_island(problem, problem.trees, num_trees, TREES, island_of_tree)
    sort_by_island(problem, contacts, problem.num_contacts, CONTACTS, island_of_constraint)
    sort_by_island(problem, rows, problem.num_rows, ROWS, island_of_constraint)


@kernel
def make_one_island(problem, contacts, rows):
    """Orders everything as one island."""
    places = 0
    for t in range(len(problem.trees)):
        if problem.trees[t].active == 1:
            problem.trees[places].order = t
            places += 1
    problem.num_islands = 1
    problem.trees[0].all_ends = (places, problem.num_contacts, problem.num_rows)
    for c in range(problem.num_contacts):
        contacts[c].order = c
    for r in range(problem.num_rows):
        rows[r].order = r
    return places


@kernel
def make_islands(problem, contacts, rows):
    """Orders everything by island."""
    if make_one_island(problem, contacts, rows) > 1:
        sort_islands(problem, contacts, rows)


@kernel
def solve_islands(model, problem, contacts, rows, factor, group, solve_island):
    """Fills v over the participating dofs, the impulses and `j_gamma`, by a kernel for the island at hand; a status.

    Drake solves all at once (`make_one_island`), and stops when the sum of all residuals is small. Until it rests, each
    island of trees that constraints connect is solved on its own (`make_islands`): one that moves does not make those
    at rest iterate.
    """
    group(problem, contacts, rows)
    for island in range(problem.num_islands):
        problem.begins = problem.trees[island - 1].all_ends if island > 0 else (0, 0, 0)
        problem.ends = problem.trees[island].all_ends
        status = solve_island(model, problem, contacts, rows, factor)
        if status != SOLVED:
            return status
    return SOLVED


# ---- entries


@kernel
def move_free_trees(model, problem):
    """v = v* for the trees that no constraint touches."""
    for t in range(len(model.trees)):
        if problem.trees[t].active == 0:
            for k in dofs_of_tree(model, t):
                problem.v[k] = problem.v_star[k]


@kernel
def nothing(model, problem, contact):
    """What the law of kTamsi needs beforehand."""


@kernel
def prepare_if_any(model, problem, contacts, rows, prepare_contact):
    """`prepare`, if there is any constraint."""
    if problem.num_contacts + problem.num_rows == 0:
        leave_free(model, problem)
    else:
        prepare(model, problem, contacts, rows, prepare_contact)


@kernel
def solve_if_any(model, problem, contacts, rows, factor, group, solve_island):
    """v of all dofs; a status."""
    status = SOLVED
    problem.iterations = 0
    problem.substeps = 0
    if problem.num_contacts + problem.num_rows != 0:
        status = solve_islands(model, problem, contacts, rows, factor, group, solve_island)
    move_free_trees(model, problem)
    return status


@kernel(top=True, short_loops=True, lanes=solve_in_lanes)
def prepare_hunt_crossley_contacts(solver_model: SolverModel, problem: Problem, contacts: Contacts, rows: Rows) -> None:
    """What the laws of kLagged and kSimilar need of contacts and rows, and which trees take part."""
    prepare_if_any(solver_model, problem, contacts, rows, prepare_hunt_crossley)


@kernel(top=True, short_loops=True)
def prepare_sap(solver_model: SolverModel, problem: Problem, contacts: Contacts, rows: Rows) -> None:
    """What the laws of kSap need of contacts and rows, and which trees take part."""
    prepare_if_any(solver_model, problem, contacts, rows, prepare_sap_cone)


@kernel(top=True, short_loops=True)
def prepare_sap_to_rest(solver_model: SolverModel, problem: Problem, contacts: Contacts, rows: Rows) -> None:
    """`prepare_sap`, with a guess of the slip that the cones are made for."""
    prepare_if_any(solver_model, problem, contacts, rows, prepare_sap_cone)
    predict_slip(solver_model, problem, contacts)


@kernel(top=True, short_loops=True)
def prepare_tamsi(solver_model: SolverModel, problem: Problem, contacts: Contacts, rows: Rows) -> None:
    """Which trees take part, and their velocities."""
    prepare_if_any(solver_model, problem, contacts, rows, nothing)


@kernel(top=True, short_loops=True)
def solve(solver_model: SolverModel, problem: Problem, contacts: Contacts, rows: Rows, factor: Factor) -> int:
    """v of all dofs of a prepared problem as Drake iterates; a status."""
    return solve_if_any(solver_model, problem, contacts, rows, factor, make_one_island, as_drake)


@kernel(top=True, short_loops=True, lanes=solve_in_lanes)
def solve_to_rest(solver_model: SolverModel, problem: Problem, contacts: Contacts, rows: Rows, factor: Factor) -> int:
    """v of all dofs of a prepared problem under kLagged or kSimilar, until what can rest does; a status."""
    return solve_if_any(solver_model, problem, contacts, rows, factor, make_islands, to_rest)


@kernel(top=True, short_loops=True)
def solve_to_rest_on_cones(
    solver_model: SolverModel, problem: Problem, contacts: Contacts, rows: Rows, factor: Factor
) -> int:
    """v of all dofs of a prepared problem under kSap, until what can rest does; a status."""
    return solve_if_any(solver_model, problem, contacts, rows, factor, make_islands, to_rest_on_cones)


@kernel(top=True, short_loops=True)
def solve_tamsi(solver_model: SolverModel, problem: Problem, contacts: Contacts, rows: Rows, factor: Factor) -> int:
    """v of all dofs of a prepared problem under kTamsi, with Drake's sub-steps; a status."""
    return solve_if_any(solver_model, problem, contacts, rows, factor, make_one_island, tamsi_island)


@kernel(top=True, short_loops=True)
def solve_tamsi_by_islands(
    solver_model: SolverModel, problem: Problem, contacts: Contacts, rows: Rows, factor: Factor
) -> int:
    """`solve_tamsi`, each island with sub-steps of its own."""
    return solve_if_any(solver_model, problem, contacts, rows, factor, make_islands, tamsi_island)


# ---- approximations


class Solver(NamedTuple):
    """The stages of a solve: one after the contacts are known, one that finds velocities."""

    prepare: Kernel
    solve: Kernel


class Approximation(NamedTuple):
    """How a discrete plant models contact and friction; the only place that knows which there are is `APPROXIMATIONS`.

    Attributes:
        name: In configurations; pydrake's enumerator is called k and this.
        law: Number of the law of its contacts, where that is one of the convex problem.
        as_drake: Solves as Drake iterates.
        to_rest: Solves until what can rest does, where pairs touch at several points.
        margin: `(dt)`: how far ahead contacts of such pairs are seen [m].
        bounces: Whether contacts without dissipation give back all their energy.
        scalar_rows: Whether limits, damping and gains of joints, and constraints, are part of the problem.
        symmetric: Whether its matrix is.
    """

    name: str
    law: int
    as_drake: Solver
    to_rest: Solver
    margin: Kernel
    bounces: bool = False
    scalar_rows: bool = True
    symmetric: bool = True


CONTACT_MARGIN = 1e-4
"""Distance at which points of multi-point pairs are seen before they touch [m]."""
GLIDE = 2.0
"""Speed of sliding times friction up to which kSimilar glides on its gap instead of hopping [m/s]."""
FALL = 10.0
"""Gravity, of which kSap sees what falls within a step [m/s²]."""


@kernel
def fixed_margin(dt):
    """As far whatever the time step is."""
    return CONTACT_MARGIN


@kernel
def falling_margin(dt):
    """What slides must not fall freely for a step when it loses the ground."""
    return min(CONTACT_MARGIN, FALL * dt**2)


@kernel
def gliding_margin(dt):
    """What slides floats dt mu v above the ground (Castro, Han, Masterjohn 2023): it is seen there."""
    return CONTACT_MARGIN + GLIDE * dt


APPROXIMATIONS = {
    approximation.name: approximation
    for approximation in (
        Approximation(
            "tamsi",
            -1,
            Solver(prepare_tamsi, solve_tamsi),
            Solver(prepare_tamsi, solve_tamsi_by_islands),
            fixed_margin,
            scalar_rows=False,
            symmetric=False,
        ),
        Approximation(
            "sap",
            SAP,
            Solver(prepare_sap, solve),
            Solver(prepare_sap_to_rest, solve_to_rest_on_cones),
            falling_margin,
        ),
        Approximation(
            "similar",
            SIMILAR,
            Solver(prepare_hunt_crossley_contacts, solve),
            Solver(prepare_hunt_crossley_contacts, solve_to_rest),
            gliding_margin,
            bounces=True,
        ),
        Approximation(
            "lagged",
            LAGGED,
            Solver(prepare_hunt_crossley_contacts, solve),
            Solver(prepare_hunt_crossley_contacts, solve_to_rest),
            fixed_margin,
            bounces=True,
        ),
    )
}
"""What there is, by name."""
