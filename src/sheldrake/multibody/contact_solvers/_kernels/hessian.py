"""The Hessian H = A + J^T G J of an island in blocks, lower triangle, and the Newton direction it gives.

H: Castro, Permenter, Han 2022, section IV-A; its blocks, by trees and the pairs of them that touch: section IV-D.
"""

from sheldrake.common._kernels.generic import is_positive
from sheldrake.common._kernels.vec import column3, dot3
from sheldrake.common.kernel import kernel
from sheldrake.multibody.contact_solvers._kernels.block_cholesky import factorise, substitute
from sheldrake.multibody.contact_solvers._kernels.gradient import is_chain_of_six
from sheldrake.multibody.contact_solvers._kernels.problem import (
    contacts_of_island,
    diagonal,
    dofs_above,
    dofs_of_island,
    rows_of_island,
)
from sheldrake.multibody.contact_solvers._kernels.six import (
    SIX,
    load_six,
    load_three_sixes,
    plus_scaled,
    put_packed_six,
    store_six,
)
from sheldrake.multibody.contact_solvers._kernels.status import HESSIAN_NOT_POSITIVE, SOLVED

# ---- terms of constraints
#
# The terms J^T G J that constraints add to the Hessian, wherever it has its entries.
#
# `address(where, constraint, i, j)` is that of the entry of columns i and j <= i of a constraint.


@kernel
def times_G(G, u):
    """G u; G is (xx, xy, yy, xz, yz, zz)."""
    xx, xy, yy, xz, yz, zz = G
    return (
        xx * u[0] + xy * u[1] + xz * u[2],
        xy * u[0] + yy * u[1] + yz * u[2],
        xz * u[0] + yz * u[1] + zz * u[2],
    )


@kernel
def resists(contact):
    """Whether the impulse of a contact depends on its velocity: whether it has a term."""
    return contact.G[0] > 0.0 or contact.G[5] > 0.0


@kernel(outline=True)
def add_contact(contact, L, where, address):
    """H += J^T G J of a contact of any two bodies."""
    G = contact.G
    for i in range(contact.width):
        Gu = times_G(G, column3(contact.J, 0, i))
        for j in range(i + 1):
            L[address(where, contact, i, j)] += dot3(Gu, column3(contact.J, 0, j))


@kernel
def add_row(row, L, where, address):
    """H += J^T G J of a scalar row."""
    G = row.G
    for i in range(row.width):
        Gu = G * row.J[i]
        for j in range(i + 1):
            L[address(where, row, i, j)] += Gu * row.J[j]


# ---- an island of one tree
#
# The Hessian H = A + J^T G J of an island that is one tree, and its factor L^T D L, row by row along branches.
#
# A limit, or a contact with the ground or with a body further up the same branch, couples dofs on one path to the
# base, and so does A: then the factor fills nothing that A has not (Featherstone 2008, section 6.5), and most of it
# is absent in a robot with several limbs. A constraint between two branches makes one path of both: each dof's next
# one is the last of those before it that it is coupled to (the elimination tree, Liu 1990). Rows are packed as A's,
# with one entry for each dof on the path from the base, the dof itself last.


@kernel
def dofs_of(model, problem):
    """First dof of the island's only tree, and the one after its last."""
    tree = model.trees[problem.trees[problem.trees_begin].order]
    return tree.first_dof, tree.first_dof + tree.num_dofs


@kernel
def join_paths(factor, a, b):
    """Makes one path of those from two dofs to the base; the dof where it begins."""
    begin = a if a > b else b
    while a != b and a >= 0 and b >= 0:
        low = a if a > b else b
        high = b if a > b else a
        a = factor.dofs[low].parent
        b = high
        if a < high:
            factor.dofs[low].parent = high
    return begin


@kernel
def join_columns(factor, constraint):
    """Makes one path of all dofs of a constraint."""
    begin = constraint.dofs[0]
    for i in range(1, constraint.width):
        begin = join_paths(factor, begin, constraint.dofs[i])


@kernel
def is_one_path(model, contact):
    """Whether the columns of a contact, which go down one branch and then down another, go down one only."""
    width = contact.width
    return model.dofs[contact.dofs[width - 1]].depth - model.dofs[contact.dofs[0]].depth + 1 == width


@kernel(outline=True)
def lay_out_branches(model, problem, contacts, rows, factor):
    """The path of each dof and where its row starts; how many numbers all rows have."""
    first, end = dofs_of(model, problem)
    for k in range(first, end):
        factor.dofs[k].parent = model.dofs[k].parent
    for contact in contacts_of_island(problem, contacts):
        if not is_one_path(model, contact):
            join_columns(factor, contact)
    for row in rows_of_island(problem, rows):
        join_columns(factor, row)
    size = 0
    for k in range(first, end):
        dof = factor.dofs[k]
        dof.depth = factor.dofs[dof.parent].depth + 1 if dof.parent >= 0 else 0
        dof.row_start = size
        size += dof.depth + 1
    return size


@kernel
def put_momentum_of_branches(model, problem, factor):
    """H = A."""
    L = factor.L
    first, end = dofs_of(model, problem)
    for k in range(first, end):
        row = factor.dofs[k].row_start
        at = model.dofs[k].row_start
        depth = model.dofs[k].depth
        if factor.dofs[k].depth == depth:
            for i in range(depth + 1):
                L[row + i] = problem.A[at + i]
        else:
            for i in range(factor.dofs[k].depth + 1):
                L[row + i] = 0.0
            L[diagonal(factor, k)] = problem.A[diagonal(model, k)]
            for j, at_j in dofs_above(model, k):
                L[row + factor.dofs[j].depth] = problem.A[at_j]


@kernel
def in_branches(factor, constraint, i, j):
    """Address of the entry of two columns of a constraint, whose dofs are on one path."""
    k, other = constraint.dofs[i], constraint.dofs[j]
    if k >= other:
        return factor.dofs[k].row_start + factor.dofs[other].depth
    return factor.dofs[other].row_start + factor.dofs[k].depth


@kernel
def add_one_path(contact, L, factor, top):
    """`add_contact` of a contact whose columns go down one branch from depth `top` on: a row's entries are in a row."""
    G = contact.G
    for i in range(contact.width):
        row = factor.dofs[contact.dofs[i]].row_start + top
        Gu = times_G(G, column3(contact.J, 0, i))
        for j in range(i + 1):
            L[row + j] += dot3(Gu, column3(contact.J, 0, j))


@kernel(outline=True)
def assemble_branches(model, problem, contacts, rows, factor):
    """H = A + J^T G J."""
    put_momentum_of_branches(model, problem, factor)
    for contact in contacts_of_island(problem, contacts):
        if resists(contact):
            top = factor.dofs[contact.dofs[0]].depth
            length = factor.dofs[contact.dofs[contact.width - 1]].depth - top + 1
            if is_one_path(model, contact) and length == contact.width:  # no dofs of others came between
                add_one_path(contact, factor.L, factor, top)
            else:
                add_contact(contact, factor.L, factor, in_branches)
    for row in rows_of_island(problem, rows):
        if row.G > 0.0:
            add_row(row, factor.L, factor, in_branches)


@kernel(outline=True)
def factorise_branches(model, problem, factor):
    """Replaces H by 1/D on the diagonal and L below it; a status."""
    L = factor.L
    first, end = dofs_of(model, problem)
    for k in range(end - 1, first - 1, -1):
        row = factor.dofs[k].row_start
        D = diagonal(factor, k)
        if not is_positive(L[D]):
            return HESSIAN_NOT_POSITIVE
        r = 1.0 / L[D]
        L[D] = r
        for i, at in dofs_above(factor, k):
            above = factor.dofs[i].row_start
            a = L[at] * r
            for j in range(at - row + 1):
                L[above + j] -= a * L[row + j]
            L[at] = a
    return SOLVED


@kernel(outline=True)
def solve_branches(model, problem, factor):
    """dv = -H^-1 gradient."""
    L, x = factor.L, factor.rhs
    first, end = dofs_of(model, problem)
    for k in range(first, end):
        x[k] = -problem.gradient[k]
    for k in range(end - 1, first - 1, -1):
        for i, at in dofs_above(factor, k):
            x[i] -= L[at] * x[k]
    for k in range(first, end):
        x_k = x[k] * L[diagonal(factor, k)]
        for i, at in dofs_above(factor, k):
            x_k -= L[at] * x[i]
        x[k] = x_k
        problem.dv[k] = x_k


# ---- blocks of trees

FIRST = 0


@kernel
def put_momentum(model, problem, factor):
    """H = A: all blocks zero but those of the trees."""
    L = factor.L
    for at in range(problem.factor_size):
        L[at] = 0.0
    for place in range(problem.trees_end - problem.trees_begin):
        block = factor.blocks[place]
        n = block.size
        first = model.trees[block.tree].first_dof
        if is_chain_of_six(model, block.tree):
            put_packed_six(L, block.diagonal, problem.A, model.dofs[first].row_start)
            continue
        for i in range(n):
            row = block.diagonal + i
            L[row + n * i] = problem.A[diagonal(model, first + i)]
            for j, at in dofs_above(model, first + i):
                L[row + n * (j - first)] = problem.A[at]


@kernel
def find_block(factor, later, earlier):
    """Address of the block at the places of two coupled trees."""
    e = factor.blocks[earlier].below_begin
    while factor.entries[e].place != later:
        e += 1
    return factor.entries[e].address


@kernel
def columns_of(model, constraint, t):
    """How many of the constraint's columns, from the first one on, belong to tree t."""
    begin = model.trees[t].first_dof
    end = begin + model.trees[t].num_dofs
    n = 0
    while n < constraint.width and begin <= constraint.dofs[n] and constraint.dofs[n] < end:
        n += 1
    return n


@kernel
def block_of(model, factor, t):
    """A tree's place, first dof and size, and the address of its diagonal block less its first dof's row and column."""
    tree = model.trees[t]
    place = factor.trees[t].place
    return place, tree.first_dof, tree.num_dofs, factor.blocks[place].diagonal - (tree.num_dofs + 1) * tree.first_dof


@kernel
def places_of(model, factor, constraint):
    """Where the columns of a constraint go.

    Returns:
        split: how many columns belong to the first tree; the others belong to the second.
        first, second: (address of the tree's diagonal block less its first dof's row and column, its size).
        coupling: (address of the block of second and first tree, step from dof to dof of the second and of the first),
            dofs counted as in the plant.
    """
    t = constraint.tree_a if constraint.tree_a >= 0 else constraint.tree_b
    place_a, first_a, n_a, D_a = block_of(model, factor, t)
    split = columns_of(model, constraint, t)
    if split == constraint.width:
        return split, (D_a, n_a), (D_a, n_a), (0, 0, 0)
    place_b, first_b, n_b, D_b = block_of(model, factor, constraint.tree_b)
    if place_b > place_a:
        coupling = (find_block(factor, place_b, place_a) - n_b * first_a - first_b, 1, n_b)
    else:
        coupling = (find_block(factor, place_a, place_b) - n_a * first_b - first_a, n_a, 1)
    return split, (D_a, n_a), (D_b, n_b), coupling


@kernel
def in_diagonal(side, k, j):
    """Address of the entry of two dofs in the lower triangle of their tree's block."""
    D, n = side
    return D + n * j + k if k >= j else D + n * k + j


@kernel
def in_blocks(places, constraint, i, j):
    """Address of the entry of columns i and j <= i of a constraint."""
    split, first, second, coupling = places
    if i < split:
        return in_diagonal(first, constraint.dofs[i], constraint.dofs[j])
    if j < split:
        address, step_second, step_first = coupling
        return address + step_second * constraint.dofs[i] + step_first * constraint.dofs[j]
    return in_diagonal(second, constraint.dofs[i], constraint.dofs[j])


@kernel
def add_square(L, B, J, rows, columns, G):
    """The block at B, 6 by 6, += J_rows^T G J_columns of a contact, each from its first column on."""
    x, y, z = load_three_sixes(J, rows)
    for j in range(SIX):
        gx, gy, gz = times_G(G, column3(J, 0, columns + j))
        to = load_six(L, B + SIX * j)
        store_six(L, B + SIX * j, plus_scaled(plus_scaled(plus_scaled(to, gx, x), gy, y), gz, z))


@kernel(outline=True)
def add_free_contact(factor, contact):
    """`add_contact` of two free bodies, or of one and something fixed."""
    L, J, G = factor.L, contact.J, contact.G
    if contact.tree_a < 0:
        add_square(L, factor.blocks[factor.trees[contact.tree_b].place].diagonal, J, FIRST, FIRST, G)
        return
    place_A = factor.trees[contact.tree_a].place
    add_square(L, factor.blocks[place_A].diagonal, J, FIRST, FIRST, G)
    if contact.tree_b >= 0:
        place_B = factor.trees[contact.tree_b].place
        add_square(L, factor.blocks[place_B].diagonal, J, SIX, SIX, G)
        if place_B > place_A:
            add_square(L, find_block(factor, place_B, place_A), J, SIX, FIRST, G)
        else:
            add_square(L, find_block(factor, place_A, place_B), J, FIRST, SIX, G)


@kernel(outline=True)
def assemble(model, problem, contacts, rows, factor):
    """H = A + J^T G J in the blocks."""
    put_momentum(model, problem, factor)
    for contact in contacts_of_island(problem, contacts):
        if resists(contact):
            if contact.sixes > 0:
                add_free_contact(factor, contact)
            else:
                add_contact(contact, factor.L, places_of(model, factor, contact), in_blocks)
    for row in rows_of_island(problem, rows):
        if row.G > 0.0:
            add_row(row, factor.L, places_of(model, factor, row), in_blocks)


@kernel
def renew_factor(model, problem, contacts, rows, factor):
    """Factorises the Hessian at the iterate; a status."""
    if problem.along_branches == 1:
        assemble_branches(model, problem, contacts, rows, factor)
        return factorise_branches(model, problem, factor)
    assemble(model, problem, contacts, rows, factor)
    return factorise(factor, problem.trees_end - problem.trees_begin)


@kernel
def newton_direction(model, problem, factor):
    """dv = -H^-1 gradient over the participating dofs."""
    if problem.along_branches == 1:
        solve_branches(model, problem, factor)
    else:
        solve_blocks(model, problem, factor)


@kernel(outline=True)
def solve_blocks(model, problem, factor):
    """`newton_direction` by the factor in blocks."""
    x = factor.rhs
    for dof in dofs_of_island(model, problem):
        x[factor.slot[dof]] = -problem.gradient[dof]
    substitute(factor, problem.trees_end - problem.trees_begin)
    scatter(model, problem, factor)


@kernel
def scatter(model, problem, factor):
    """dv from the solution by slots."""
    for dof in dofs_of_island(model, problem):
        problem.dv[dof] = factor.rhs[factor.slot[dof]]
