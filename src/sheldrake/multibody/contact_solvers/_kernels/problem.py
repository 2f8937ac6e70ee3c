"""What one contact solve is made of: momentum, contacts, scalar rows; the arrays and what is in them.

The convex problem (Castro, Permenter, Han 2022, eq. 24; numbers as in IEEE Transactions on Robotics 39) is

    minimise over v:  1/2 (v - v*)^T A (v - v*) + sum_i l_i(J_i v),      gamma_i = -dl_i/dvc_i,  G_i = d2l_i/dvc_i2

with A = M(q0) + dt D (eq. 15) block diagonal by kinematic tree. A solver sees dofs, trees and rows, not bodies or
joints.
"""

from typing import Annotated, NamedTuple

import numpy as np

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common._kernels.vec import (
    SIX,
    add3,
    add_dot_six_backwards,
    add_scaled_six,
    add_three_sixes,
    column3,
    dot3,
    dot_six,
    load_six,
    load_three_sixes,
    mul_packed_six,
    norms2_six,
    scale3,
    store3,
    store_six,
    times_six,
)
from sheldrake.common.kernel import IntMatrix, IntVector, LaneMemory, Matrix, Vector, kernel
from sheldrake.common.record import Each, Items, Record, Stack, array, integer, integers, number, numbers, table, vector

# What a solve can answer. 0 is fine; everything else leaves the state of the step's start untouched.
SOLVED = 0
ITERATION_LIMIT = 101
LINE_SEARCH_FAILED = 102
HESSIAN_NOT_POSITIVE = 103
FACTOR_CAPACITY = 104
CONTACT_CAPACITY = 105
ROW_CAPACITY = 106
TAMSI_FAILED = 107
MASS_NOT_POSITIVE = 108
UNSUPPORTED_PAIR = 109
MOTION_NOT_FINITE = 110

# RowIndex.kind
LIMIT = 0
ACTUATOR = 1
HOLONOMIC = 2
DRY_FRICTION = 3

# ContactState.velocity and RowState.velocity
VC = 0
DVC = 1


class Options(Record):
    """Numbers of the solver."""

    dt = number("time step", "s")
    stiction = number("regularisation speed v_s", "m/s")
    sigma = number("tangential regularisation relative to the Delassus estimate")
    near_rigid = number("beta of kSap's contacts")
    near_rigid_rows = number("beta of scalar rows")
    relative_tolerance = number("residual at which iterations stop, over momentum and impulse")
    absolute_tolerance = number("residual at which they stop in any case", "sqrt(J)")
    moving_tolerance = number("residual at which they stop for one tree with joints that moves, over its momentum")
    resolved_turn = number("angle of a step up to which a body has all of its gyroscopic torque", "rad")


class Settings(Record):
    """Choices of the solver."""

    law = integer("of contacts, see `laws`")
    max_iterations = integer("after which it gives up")
    scalar_rows = integer("1: limits, damping and gains of joints are its rows; 0 (kTamsi): they are forces")
    sides = integer("blocks of its matrix for two trees that touch: 1, or 2 where it is not symmetric")
    ahead = integer("1: what rows of one dof do is in v* and in the factor of A, as far as it is linear at v0")


class Tree(Record):
    """A kinematic tree."""

    first_dof = integer("its first dof")
    num_dofs = integer("how many it has")
    base_dofs = integer("6 if all its dofs but the first six hang on these, else 0")


class Dof(Record):
    """A dof as constraints and the momentum matrix see it."""

    parent = integer("next dof towards the base, or -1")
    depth = integer("number of ancestors")
    row_start = integer("start of its row in the packed momentum matrix")


class DofVectors(Stack):
    """Vectors over the dofs."""

    v0 = vector("v at the start of the step", "m/s, rad/s")
    v_star = vector("v without constraints, but for rows that are ahead")
    v = vector("the iterate; in the end v_next")
    p_star = vector("A v*, without any rows; the plant leaves A (v* - v0) here", "N s")
    p = vector("A v", "N s")
    j_gamma = vector("J^T gamma", "N s")
    gradient = vector("A (v - v*) - J^T gamma", "N s")
    dv = vector("search direction")
    a_dv = vector("A dv", "N s")
    mobility = vector("1 / diag(A)", "1/kg")
    start_momentum = vector("kTamsi: p* of the sub-step; J^T gamma is made at the end", "N s", same_as=j_gamma)


class Participation(Record):
    """Who takes part, and in which island: rows are trees, then places, then islands."""

    active = integer("1 for a tree touched by a constraint, else 0")
    root = integer("towards the first tree of its island; then the number of the island")
    order = integer("the tree at a place: islands one after the other")
    ends = array(3, "where an island's trees, contacts and rows end", dtype=int)
    all_ends = integers(3, "the three of them", same_as=ends)
    num_contacts = integer("while kSap's slip is guessed: contacts of the tree", same_as=ends)


class Counts(Record):
    """Numbers of this solve, and the island at hand."""

    num_contacts = integer("of this step")
    num_rows = integer("of this step")
    rows_ahead = integer("how many of them, the first ones, are ahead")
    iterations = integer("of all islands; of worlds in lanes those of the one that has most")
    participating = integer("dofs of the last island that needed a factor")
    substeps = integer("of kTamsi")
    num_islands = integer("that constraints make of the trees")
    trees_begin = integer("the island at hand: places in the orders of trees, contacts and rows")
    contacts_begin = integer("")
    rows_begin = integer("")
    trees_end = integer("")
    contacts_end = integer("")
    rows_end = integer("")
    begins = integers(3, "of trees, contacts and rows", same_as=trees_begin)
    ends = integers(3, "of trees, contacts and rows", same_as=trees_end)
    factor_size = integer("numbers in the island's factor")
    columns = integer("its block columns")
    along_branches = integer("1 if they are rows along the branches of a tree, 0 if blocks")


class ContactIndex(Record):
    """Who a contact is between."""

    width = integer("how many dofs move it")
    tree_a = integer("tree of body A, -1 for none")
    tree_b = integer("tree of body B, -1 for none")
    order = integer("the contact at this place: islands one after the other")
    sixes = integer("how many trees of six dofs all its columns belong to, 0 if there are others; `prepare` finds it")
    in_sixes = integer("how many of its columns, from the first one on, are those of six dofs in a row each; likewise")
    dofs = array(..., "the dofs that move it", dtype=int)


class ContactLaw(Record):
    """The material, then what `prepare` derives for Hunt and Crossley's laws, and in the same memory for kSap."""

    stiffness = number("k", "N/m")
    dissipation = number("d", "s/m")
    relaxation = number("tau", "s")
    friction = number("mu")
    depth = number("-phi0", "m")
    lag = number("how much longer than a step may pass until what does not touch yet touches", "s")
    fe0 = number("elastic force at q0", "N")
    n0 = number("normal impulse at v0", "N s")
    eps = number("regularisation speed", "m/s")
    R_t = number("kSap: regularisation along the surface", "1/kg", same_as=fe0)
    R_n = number("kSap: regularisation along the normal", "1/kg", same_as=n0)
    vhat_n = number("kSap: velocity that would close the penetration", "m/s", same_as=eps)
    delassus = number("kSap: w", "1/kg")
    back = number("elastic contacts: how much larger the force was half a step back; else 0", "N")
    reach = number("the plant leaves here how far ahead an elastic contact is seen, else 0", "m", same_as=back)
    drift = numbers(2, "slip at v = 0, of surfaces that run around their bodies as belts do", "m/s")


class ContactState(Record):
    """What the solver finds."""

    vc = numbers(3, "velocity at the contact", "m/s")
    dvc = numbers(3, "its change along the search direction", "m/s")
    gamma = numbers(3, "impulse", "N s")
    G = numbers(6, "-dgamma/dvc as xx, xy, yy, xz, yz, zz", "kg")
    G_t = numbers(3, "its block along the surface: xx, xy, yy", "kg", same_as=G)
    dual = numbers(2, "dual of friction, see `newton`")
    velocity = array((2, 3), "vc and dvc", "m/s", same_as=vc)


class RowIndex(Record):
    """What a scalar row is, and who moves it."""

    width = integer("how many dofs move it")
    tree_a = integer("-1 for none")
    tree_b = integer("-1 for none")
    order = integer("the row at this place: islands one after the other")
    kind = integer("LIMIT, ACTUATOR, HOLONOMIC or DRY_FRICTION")
    owner = integer("number of the joint, actuator or constraint")
    group = integer("n in the first of n rows that share their dofs and one Delassus estimate, 0 in the others")
    dofs = array(..., "the dofs that move it", dtype=int)


class RowColumns(Record):
    """Its Jacobian."""

    J = array(..., "a column for each dof that moves it")


class RowLaw(Record):
    """gamma = clamp(push - resistance vc, lower, upper); `prepare` makes these two of what is behind them."""

    resistance = number("1 / R, the inverse of the regularisation", "kg")
    push = number("impulse at no velocity, were there no bounds", "N s")
    lower = number("least impulse", "N s")
    upper = number("largest impulse", "N s")
    gap = number("violation g at q0; of an actuator q0 - q_desired", "m")
    stiffness = number("k, may be infinite; proportional gain", "N/m")
    relaxation = number("tau [s]; derivative gain [N s/m]")
    rate = number("actuators: v_desired", "m/s")
    forward = number("actuators: feed-forward effort", "N")


class RowState(Record):
    """What the solver finds."""

    vc = number("velocity", "m/s")
    dvc = number("its change along the search direction", "m/s")
    gamma = number("impulse", "N s")
    G = number("-dgamma/dvc", "kg")
    velocity = array(2, "vc and dvc", same_as=vc)


class Block(Record):
    """A block column of the factor: the tree at this place of the elimination order.

    What columns before it ask of its row comes first: it is in one line of the cache.
    """

    first_slot = integer("place of its first dof in `rhs`")
    size = integer("dofs of the tree")
    at = integer("while a column is made: address of its block in this row")
    held = integer("not 0: its tree keeps its velocity, and has no part in the matrix, see `settle_parts`")
    diagonal = integer("address of the diagonal block in L")
    below_begin = integer("its blocks below the diagonal: `entries` from here")
    below_end = integer("to here")
    row = integer("first entry of its row, -1 for none; see `Entry.next`")
    tree = integer("which tree")
    triangle = integer("see `triangle_in_A`")
    constraints_begin = integer("in `graph`, once there is an order: numbers of the contacts that touch its tree,")
    ends = array(2, "to here, and behind them those of rows", dtype=int)


class Node(Record):
    """A tree while the elimination order is sought, by its number within the island."""

    names = integer("how often constraints couple it")
    fill = integer("twice the pairs of neighbours that its elimination makes, about, and its neighbours", same_as=names)
    state = integer("PRESENT, ELIMINATED or ABSORBED")
    begin = integer("its list, in `graph`: neighbours that no eliminated tree made")
    middle = integer("from here: eliminated trees that made it a neighbour of theirs")
    end = integer("")
    rows_begin = integer("of an eliminated one: the neighbours it had, `entries` from here")
    rows_end = integer("to here")
    joined = integer("1 + the last tree that made it a neighbour of its own")
    seen = integer("a mark that tells whether it was counted")
    winner = integer("at this place of the tournament, see `order_trees`")
    place = integer("once there is an order: its place", same_as=state)
    parent = integer("the first row of its column", same_as=joined)
    hanging = integer("how many trees hang on it, with it", same_as=seen)
    free = integer("the place behind those for what hangs on it that is not placed yet", same_as=middle)


class Entry(Record):
    """A block below the diagonal: column after column, rows ascending."""

    place = integer("of its row in the elimination order")
    address = integer("where it is in L; for kTamsi the transpose of the one above the diagonal follows it")
    column = integer("place of its column")
    next = integer("the entry of its row in the next column that has one, or -1")
    node = integer("while the order is sought: its row, by number within the island", same_as=place)


class Path(Record):
    """A dof of an island that is one tree, as in `Dof`, with what constraints add."""

    parent = integer("next dof towards the base, or -1")
    depth = integer("number of dofs on the way to the base")
    row_start = integer("start of its row in L")


class Presses(Stack):
    """Vectors over the directions of few contacts, three each, see `delassus`."""

    impulse = vector("lambda", "N s")
    pushed = vector("W times the residual", "m/s")
    change = vector("dlambda", "N s")
    residual = vector("what Newton's step makes up for, see `delassus`", "N s")


@table
class SolverModel(NamedTuple):
    """Constants of a plant's contact solver: `model.dt`, `model.trees[t].first_dof`, `model.dofs[k].depth`."""

    option: Annotated[Vector, Options]
    setting: Annotated[IntVector, Settings]
    tree: Annotated[IntMatrix, Items("trees", Tree)]
    dof: Annotated[IntMatrix, Items("dofs", Dof)]


@table
class Problem(NamedTuple):
    """The smooth part of one solve: `problem.v_star[k]`, `problem.trees[t].active`, `problem.num_contacts`.

    A is the momentum matrix, packed: entry of dof k and its ancestor j at A[dofs[k].row_start + dofs[j].depth]. L is a
    factor, packed likewise with 1/D on the diagonal: L^T D L = A + J^T G J with the rows that are ahead.
    """

    A: Vector
    L: Vector
    x: Annotated[Matrix, DofVectors]
    tree: Annotated[IntMatrix, Items("trees", Participation)]
    count: Annotated[IntVector, Counts]


@table
class Contacts(NamedTuple):
    """Frictional contacts, three rows each (two tangents, normal) in the contact frame C: `contacts[c].stiffness`.

    `contacts[c].J` has three rows and a column for each of the dofs that move the contact.
    """

    index: Annotated[IntMatrix, ContactIndex]
    J: Annotated[Matrix, Each(3)]
    law: Annotated[Matrix, ContactLaw]
    state: Annotated[Matrix, ContactState]


@table
class Rows(NamedTuple):
    """Scalar rows: joint limits, PD actuators, couplers, distances, each direction of a ball or weld: `rows[r].gap`."""

    index: Annotated[IntMatrix, RowIndex]
    J: Annotated[Matrix, RowColumns]
    law: Annotated[Matrix, RowLaw]
    state: Annotated[Matrix, RowState]


@table
class Factor(NamedTuple):
    """Work of a sparse factor, Cholesky's or (kTamsi) L U, with a block row and column for each tree of an island.

    L has the blocks, each column after column; or, for an island that is one tree, rows along its branches. `slot` is
    the place of each dof in `rhs`, the right-hand side and solution; `place` that of each tree in the elimination
    order. `graph` tells who is coupled to whom, see `Node`, and then which constraints touch the tree of a block, see
    `Block`. The others are for few contacts with one tree, see `delassus`: J L^-1, three rows a contact and a column a
    dof; W by blocks, and the roots of G; and the factor of the matrix of three rows a contact. While blocks are put
    together, `spread` has G J of a contact of free bodies.
    """

    slot: IntVector
    place: IntVector
    block: Annotated[IntMatrix, Items("blocks", Block)]
    node: Annotated[IntMatrix, Items("nodes", Node)]
    below: Annotated[IntMatrix, Items("entries", Entry)]
    graph: IntVector
    L: Vector
    rhs: Vector
    branch: Annotated[IntMatrix, Items("dofs", Path)]
    spread: Matrix
    delassus: Vector
    root: Vector
    small: Vector
    press: Annotated[Matrix, Presses]


def contacts_in_lanes(problem: Problem, contacts: Contacts) -> tuple[tuple[np.ndarray, np.ndarray], ...]:
    """The tables of contacts, for four worlds at once."""
    count = problem.count[Counts.num_contacts : Counts.num_rows]
    columns = contacts.J.reshape(len(contacts.law), 3 * contacts.J.shape[1])
    return (contacts.index, count), (columns, count), (contacts.law, count), (contacts.state, count)


def rows_in_lanes(problem: Problem, rows: Rows) -> tuple[tuple[np.ndarray, np.ndarray], ...]:
    """The tables of scalar rows, for four worlds at once."""
    count = problem.count[Counts.num_rows : Counts.rows_ahead]
    return (rows.index, count), (rows.J, count), (rows.law, count), (rows.state, count)


def solve_in_lanes(
    solver_model: SolverModel, problem: Problem, contacts: Contacts, rows: Rows, *factor: Factor
) -> LaneMemory:
    """What a solve reads and writes, for four worlds at once; of the factor nothing is left to be read."""
    tables = contacts_in_lanes(problem, contacts) + rows_in_lanes(problem, rows)
    return LaneMemory(writes=tuple(problem), tables=tables, changes=(problem.p_star, rows.state))


# ---- what loops go over: `for contact in contacts_of_island(problem, contacts):`


@kernel
def trees_of_island(problem):
    """The trees of the island at hand."""
    for place in range(problem.trees_begin, problem.trees_end):
        yield problem.trees[place].order


@kernel
def island_of_tree(problem, tree):
    """The island of a tree, -1 if no constraint touches it."""
    return tree.root if tree.active == 1 else -1


@kernel
def island_of_constraint(problem, constraint):
    """The island of a contact or row; the first one's if it touches no tree."""
    t = constraint.tree_a if constraint.tree_a >= 0 else constraint.tree_b
    return problem.trees[t].root if t >= 0 else 0


@kernel
def dofs_of_tree(model, t):
    """The dofs of a tree."""
    tree = model.trees[t]
    yield from range(tree.first_dof, tree.first_dof + tree.num_dofs)


@kernel
def dofs_of_island(model, problem):
    """The dofs of the island at hand, tree after tree."""
    for t in trees_of_island(problem):
        yield from dofs_of_tree(model, t)


@kernel
def sixes_of_island(model, problem):
    """The first dofs of the island's trees of six dofs: what is done to each dof is done to six at once."""
    for t in trees_of_island(problem):
        if model.trees[t].num_dofs == SIX:
            yield model.trees[t].first_dof


@kernel
def other_dofs_of_island(model, problem):
    """The dofs of the island's other trees."""
    for t in trees_of_island(problem):
        if model.trees[t].num_dofs != SIX:
            yield from dofs_of_tree(model, t)


@kernel
def contacts_between(contacts, begin, end):
    """The contacts at these places of their order."""
    for place in range(begin, end):
        yield contacts[contacts[place].order]


@kernel
def contacts_of_island(problem, contacts):
    """The contacts of the island at hand."""
    yield from contacts_between(contacts, problem.contacts_begin, problem.contacts_end)


CHUNK = 64  # contacts that fit into a first or second cache with all that is known of them


@kernel
def chunks_of_contacts(problem):
    """Begins and ends of the island's contacts, few at a time, for loops of several stages."""
    begin = problem.contacts_begin
    while begin < problem.contacts_end:
        end = min(begin + CHUNK, problem.contacts_end)
        yield begin, end
        begin = end


@kernel
def rows_of_island(problem, rows):
    """The scalar rows of the island at hand."""
    for place in range(problem.rows_begin, problem.rows_end):
        yield rows[rows[place].order]


@kernel
def diagonal(packed, k):
    """Address of the entry of dof k itself, the last one of its row of a packed matrix."""
    return packed.dofs[k].row_start + packed.dofs[k].depth


@kernel
def dofs_above(packed, k):
    """The dofs on the way from dof k to the base, each with the address of its entry in the row of k."""
    at = diagonal(packed, k)
    i = packed.dofs[k].parent
    while i >= 0:
        at -= 1
        yield i, at
        i = packed.dofs[i].parent


@kernel
def dofs_above_from(packed, k, begin):
    """`dofs_above` before it comes to a dof less than `begin`."""
    at = diagonal(packed, k)
    i = packed.dofs[k].parent
    while i >= begin:
        at -= 1
        yield i, at
        i = packed.dofs[i].parent


# ---- A x, the momentum


@kernel
def is_chain_of_six(model, t):
    """Whether a tree has six dofs, each moved by those before it: its part of A is a packed triangle."""
    tree = model.trees[t]
    return tree.num_dofs == SIX and model.dofs[tree.first_dof + 5].depth == 5


@kernel
def is_tree_with_joints(model, problem):
    """Whether the island at hand is one tree, and not a free body or the like."""
    alone = problem.trees_end - problem.trees_begin == 1
    return alone and not is_chain_of_six(model, problem.trees[problem.trees_begin].order)


@kernel
def triangle_in_A(model, t):
    """Address of the part of A of such a tree, -1 of another one."""
    return model.dofs[model.trees[t].first_dof].row_start if is_chain_of_six(model, t) else -1


@kernel
def mul_A(model, problem, x, y):
    """y = A x over the participating dofs, of two vectors of the problem."""
    for t in trees_of_island(problem):
        first = model.trees[t].first_dof
        if is_chain_of_six(model, t):
            store_six(y, first, mul_packed_six(problem.A, model.dofs[first].row_start, load_six(x, first)))
            continue
        end = first + model.trees[t].num_dofs
        begin = first + model.trees[t].base_dofs
        mul_rows(model, problem.A, first, first, begin, x, y)
        if begin > first:
            base = load_six(y, first)
            for k in range(begin, end):
                base = add_scaled_six(base, x[k], load_six(problem.A, model.dofs[k].row_start))
            store_six(y, first, base)
        mul_rows(model, problem.A, first, begin, end, x, y)


@kernel
def mul_rows(model, A, first, begin, end, x, y):
    """Rows `begin` to `end` - 1 in y = A x, and what their columns add to rows before; y of a base has that already."""
    for k in range(begin, end):
        x_k = x[k]
        y_k = A[diagonal(model, k)] * x_k
        for j, at in dofs_above_from(model, k, begin):
            y_k += A[at] * x[j]
            y[j] += A[at] * x_k
        if begin > first:
            y_k = add_dot_six_backwards(y_k, load_six(A, model.dofs[k].row_start), load_six(x, first))
        y[k] = y_k


@kernel(outline=True)
def multiply_A(model, problem, x, y):
    """`mul_A`, compiled once for all but the first call of a step."""
    mul_A(model, problem, x, y)


# ---- six columns of J at once


@kernel
def put_sixes(model, contact):
    """Fills `sixes` and `in_sixes` of a contact."""
    contact.sixes = trees_of_six(model, contact)
    contact.in_sixes = SIX * contact.sixes if contact.sixes > 0 else SIX if is_of_base(model, contact) else 0


@kernel
def trees_of_six(model, contact):
    """Of how many trees the columns of a contact are, if all of these have six dofs that all move it; else 0."""
    n = 0
    for t in (contact.tree_a, contact.tree_b):
        if t >= 0:
            if model.trees[t].num_dofs != SIX:
                return 0
            n += 1
    return n if contact.width == SIX * n else 0


@kernel
def is_of_base(model, contact):
    """Whether the first columns of a contact are those of the first six dofs of a tree, on which all others hang."""
    t = contact.tree_a if contact.tree_a >= 0 else contact.tree_b
    if t < 0 or contact.width < SIX or model.trees[t].base_dofs < SIX:
        return False
    first = model.trees[t].first_dof
    return contact.dofs[0] == first and contact.dofs[5] == first + 5


# ---- J v, the velocities of constraints
#
# J has columns only for the dofs that move the constraint.

FIRST = 0  # column


@kernel
def put_velocity(contact, v, which, drifts):
    """J v of a contact [m/s], with its drift or without, becomes its velocity or, by DVC, the change of it."""
    store3(contact.velocity, which, with_drift(contact, velocity_at_contact(contact, v), drifts))


@kernel
def velocity_at_contact(contact, v):
    """J v of a contact [m/s]."""
    rest = contact.in_sixes
    u = (0.0, 0.0, 0.0)
    if rest > 0:
        u = velocity_of_six(contact, FIRST, v)
        if rest > SIX:
            u = add3(u, velocity_of_six(contact, SIX, v))
    for a in range(rest, contact.width):
        u = add3(u, scale3(column3(contact.J, 0, a), v[contact.dofs[a]]))
    return u


@kernel
def with_drift(contact, u, drifts):
    """The velocity at a contact [m/s] of bodies that move so that it is u where surfaces do not run."""
    x, y = contact.drift
    return (u[0] + x, u[1] + y, u[2]) if drifts else u


@kernel
def velocity_of_six(contact, at, v):
    """The part of six columns of J, from `at` on, in J v."""
    x, y, z = load_three_sixes(contact.J, 0, at)
    s = load_six(v, contact.dofs[at])
    return (dot_six(x, s), dot_six(y, s), dot_six(z, s))


@kernel(outline=True)
def contact_velocities(problem, contacts, v, which):
    """`put_velocity` of the island's contacts: changes are those of J v alone."""
    for contact in contacts_of_island(problem, contacts):
        put_velocity(contact, v, which, which == VC)


@kernel
def row_velocities(problem, rows, v, which):
    """J v of the island's rows, as `put_velocity`."""
    for row in rows_of_island(problem, rows):
        u = 0.0
        for a in range(row.width):
            u += row.J[a] * v[row.dofs[a]]
        row.velocity[which] = u


# ---- J^T gamma


@kernel
def add_generalized_impulse(j_gamma, contact, gamma):
    """j_gamma += J^T gamma of a contact."""
    at = 0
    while at < contact.in_sixes:
        k = contact.dofs[at]
        x, y, z = load_three_sixes(contact.J, 0, at)
        store_six(j_gamma, k, add_three_sixes(load_six(j_gamma, k), gamma, x, y, z))
        at += SIX
    for a in range(at, contact.width):
        j_gamma[contact.dofs[a]] += dot3(column3(contact.J, 0, a), gamma)


# ---- J diag(1/A) J^T, the Delassus estimate


@kernel(outline=True)
def contact_delassus(problem, contact):
    """w = |J diag(1/A) J^T|_F / 3 of one contact [1/kg]."""
    diagonal, sides = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    rest = contact.in_sixes
    if rest > 0:
        diagonal, sides = delassus_of_six(problem, contact, FIRST)
        if rest > SIX:
            diagonal_B, sides_B = delassus_of_six(problem, contact, SIX)
            diagonal = add3(diagonal, diagonal_B)
            sides = add3(sides, sides_B)
    for a in range(rest, contact.width):
        x, y, z = column3(contact.J, 0, a)
        mx, my, mz = scale3((x, y, z), problem.mobility[contact.dofs[a]])
        diagonal = add3(diagonal, (mx * x, my * y, mz * z))
        sides = add3(sides, (mx * y, mx * z, my * z))
    return sqrt(dot3(diagonal, diagonal) + 2.0 * dot3(sides, sides)) / 3.0


@kernel
def largest_delassus(problem, contact):
    """What w of a contact is at most: the trace of J diag(1/A) J^T / 3, which takes a third of the work.

    More than any w where no six dofs move it: w of few columns takes hardly longer.
    """
    if contact.in_sixes == 0:
        return 1e300 + 0.0 * contact.n0
    total = 0.0
    at = 0
    while at < contact.in_sixes:
        x, y, z = load_three_sixes(contact.J, 0, at)
        total += dot_six(load_six(problem.mobility, contact.dofs[at]), norms2_six(x, y, z))
        at += SIX
    for a in range(at, contact.width):
        u = column3(contact.J, 0, a)
        total += problem.mobility[contact.dofs[a]] * dot3(u, u)
    return total / 3.0


@kernel
def delassus_of_six(problem, contact, at):
    """The part of six columns of J, from `at` on, in J diag(1/A) J^T: (xx, yy, zz), (xy, xz, yz)."""
    m = load_six(problem.mobility, contact.dofs[at])
    x, y, z = load_three_sixes(contact.J, 0, at)
    mx, my = times_six(m, x), times_six(m, y)
    diagonal = (dot_six(mx, x), dot_six(my, y), dot_six(times_six(m, z), z))
    return diagonal, (dot_six(mx, y), dot_six(mx, z), dot_six(my, z))
