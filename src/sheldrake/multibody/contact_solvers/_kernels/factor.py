"""The sparse factor of an island's matrix: in which order trees are eliminated, what fills, and the elimination itself.

An island that is one tree has rows along its branches, L^T D L; one of several trees has blocks, a column for each
tree: L L^T, or for the unsymmetric matrix of kTamsi L U. All of the order depends on the graph of trees alone: the same
contacts give the same order, and with it the same bits.
"""

from sheldrake.common._kernels.generic import is_positive, sqrt
from sheldrake.common._kernels.vec import (
    SIX,
    dot_six,
    eliminate_six,
    factorise_triangle,
    load_six,
    magnitude,
    pivots_of_two,
    read_triangle,
    store_six,
    substitute_six,
    subtract_dot_six_backwards,
    subtract_scaled,
    subtract_scaled_six,
    subtract_two_scaled,
    take_row,
    write_triangle,
)
from sheldrake.common.kernel import kernel
from sheldrake.common.rows import prefetch
from sheldrake.multibody.contact_solvers._kernels.problem import (
    FACTOR_CAPACITY,
    HESSIAN_NOT_POSITIVE,
    SOLVED,
    TAMSI_FAILED,
    contacts_of_island,
    diagonal,
    dofs_above_from,
    dofs_of_tree,
    is_tree_with_joints,
    other_dofs_of_island,
    rows_of_island,
    sixes_of_island,
    triangle_in_A,
)

# ---- the graph of trees
#
# Next comes a tree that fills little: its neighbours then all become neighbours of each other; those it has at that
# moment are the rows of its column. Cliques that elimination makes are not spelt out (quotient graph, George and Liu
# 1989): a tree knows the eliminated ones whose neighbour it became, and those of its first neighbours that none of
# them has. As each that is eliminated takes at least one name off the lists it adds its own to, lists never grow.
#
# What it fills are the pairs of its neighbours but those within a clique (approximate minimum fill, Rothberg and
# Eisenstat 1998, who take the largest clique off; here all of them, as if they shared only the tree). To twice that
# the number of neighbours is added, which decides among trees that fill alike. As bodies fall into a bin, 1,000 have
# 1.03 to 0.90 times the products of minimum degree, 5,000 have 0.89 to 0.72, a square net of 2,000 has 0.90; graphs
# drawn at random have between 0.82 and 1.1.

NOBODY = -1
PRESENT, ELIMINATED, ABSORBED = 0, 1, 2  # of a tree; absorbed: all its neighbours are one's that went later


@kernel
def coupled(problem, factor, constraints, of_island):
    """For loops: the two trees of each constraint that has two; contacts of one pair, which follow each other, once."""
    a = b = NOBODY
    for constraint in of_island(problem, constraints):
        if constraint.tree_a != a or constraint.tree_b != b:
            a, b = constraint.tree_a, constraint.tree_b
            if a >= 0 and b >= 0 and a != b:
                yield factor.place[a], factor.place[b]


@kernel
def count_names(problem, factor, constraints, of_island):
    """Adds to the names of each tree how often constraints couple it."""
    for i, j in coupled(problem, factor, constraints, of_island):
        factor.nodes[i].names += 1
        factor.nodes[j].names += 1


@kernel
def fill(neighbours, known):
    """Twice the pairs of so many neighbours, less those that are known to be neighbours of each other, and them."""
    return max(neighbours * (neighbours - 1) - known, 0) + neighbours


@kernel
def add_name(factor, i, j):
    node = factor.nodes[i]
    factor.graph[node.end] = j
    node.end += 1


@kernel
def couple(problem, factor, constraints, of_island):
    """Writes the two trees of each constraint into each other's lists."""
    for i, j in coupled(problem, factor, constraints, of_island):
        add_name(factor, i, j)
        add_name(factor, j, i)


@kernel
def drop_repeated(factor, i):
    """Each name once in the list of i."""
    graph, node = factor.graph, factor.nodes[i]
    kept = node.begin
    for at in range(node.begin, node.end):
        j = graph[at]
        if factor.nodes[j].seen != i + 1:
            factor.nodes[j].seen = i + 1
            graph[kept] = j
            kept += 1
    node.middle = kept
    node.end = kept
    node.fill = fill(kept - node.begin, 0)


@kernel
def put_lists(problem, contacts, rows, factor, n):
    """The lists of n trees: neighbours alone, as none is eliminated."""
    for i in range(n):
        node = factor.nodes[i]
        node.names = 0
        node.state = PRESENT
        node.joined = 0
        node.seen = 0
    count_names(problem, factor, contacts, contacts_of_island)
    count_names(problem, factor, rows, rows_of_island)
    begin = 0
    for i in range(n):
        node = factor.nodes[i]
        node.begin = begin
        node.end = begin
        begin += node.names
    couple(problem, factor, contacts, contacts_of_island)
    couple(problem, factor, rows, rows_of_island)
    for i in range(n):
        drop_repeated(factor, i)


@kernel
def contender(factor, at, n):
    """Who stands at a place of the tournament: behind its n - 1 winners are the trees."""
    return at - n if at >= n else factor.nodes[at].winner


@kernel
def play(factor, at, n):
    """Decides a place of the tournament: who fills less wins, then the lower number."""
    i, j = contender(factor, 2 * at, n), contender(factor, 2 * at + 1, n)
    of_i, of_j = factor.nodes[i].fill, factor.nodes[j].fill
    factor.nodes[at].winner = i if of_i < of_j or (of_i == of_j and i < j) else j


@kernel
def play_again(factor, i, n):
    """Decides the places on the way of tree i, whose fill has changed."""
    at = (n + i) // 2
    while at > 0:
        play(factor, at, n)
        at //= 2


@kernel
def join(factor, i, j, entries):
    """Makes j a row of the column of i, if it is not one yet, at the end of `entries`; how many these are then.

    -1 if there is no room.
    """
    node = factor.nodes[j]
    if entries < 0 or node.state != PRESENT or node.joined == i + 1:
        return entries
    if entries >= len(factor.entries):
        return NOBODY
    node.joined = i + 1
    factor.entries[entries].node = j
    return entries + 1


@kernel
def gather_rows(factor, i, begin):
    """Puts all neighbours of i behind `begin` entries; where they end, or -1 if there is no room."""
    node = factor.nodes[i]
    node.state = ELIMINATED
    end = begin
    for at in range(node.begin, node.middle):
        end = join(factor, i, factor.graph[at], end)
    for at in range(node.middle, node.end):
        gone = factor.nodes[factor.graph[at]]
        gone.state = ABSORBED
        for e in range(gone.rows_begin, gone.rows_end):
            end = join(factor, i, factor.entries[e].node, end)
    node.rows_begin = begin
    node.rows_end = end
    return end


@kernel
def shorten_list(factor, i, u):
    """Takes off the list of u, a neighbour of i that is eliminated, what i stands for, and adds i."""
    graph, node = factor.graph, factor.nodes[u]
    kept = node.begin
    for at in range(node.begin, node.middle):
        j = graph[at]
        if factor.nodes[j].state == PRESENT and factor.nodes[j].joined != i + 1:
            graph[kept] = j
            kept += 1
    middle = kept
    for at in range(node.middle, node.end):
        if factor.nodes[graph[at]].state != ABSORBED:
            graph[kept] = graph[at]
            kept += 1
    graph[kept] = i
    node.middle = middle
    node.end = kept + 1


@kernel
def fill_after(factor, i, u, mark):
    """What u fills, whose list ends with i.

    Its neighbours are those of i, its own, and those of others that are gone. `mark` is no tree's yet.
    """
    node = factor.nodes[u]
    beside = factor.nodes[i].rows_end - factor.nodes[i].rows_begin - 1
    degree = beside + node.middle - node.begin
    known = beside * (beside - 1)
    for at in range(node.middle, node.end - 1):
        gone = factor.nodes[factor.graph[at]]
        others = gone.rows_end - gone.rows_begin - 1
        known += others * (others - 1)
        for e in range(gone.rows_begin, gone.rows_end):
            other = factor.nodes[factor.entries[e].node]
            if other.joined != i + 1 and other.seen != mark:
                other.seen = mark
                degree += 1
    return fill(degree, known)


@kernel(outline=True)
def order_trees(problem, contacts, rows, factor):
    """The elimination order: the island's trees, by their numbers within the island, in `factor.slot`.

    Returns:
        How many rows all columns have, by the same numbers in `factor.entries`; -1 if there is no room for them.
    """
    n = problem.trees_end - problem.trees_begin
    put_lists(problem, contacts, rows, factor, n)
    for at in range(n - 1, 0, -1):
        play(factor, at, n)
    entries = 0
    mark = n
    for place in range(n):
        i = contender(factor, 1, n)
        factor.slot[place] = i
        entries = gather_rows(factor, i, entries)
        if entries < 0:
            return NOBODY
        node = factor.nodes[i]
        for e in range(node.rows_begin, node.rows_end):
            shorten_list(factor, i, factor.entries[e].node)
        node.fill = n * n  # out of the tournament
        play_again(factor, i, n)
        for e in range(node.rows_begin, node.rows_end):
            u = factor.entries[e].node
            mark += 1
            factor.nodes[u].fill = fill_after(factor, i, u, mark)
            play_again(factor, u, n)
    return entries


@kernel(outline=True)
def put_in_postorder(factor, n):
    """Another order with the same fill, in which what a column takes its products from is next to it.

    What comes first in a tree's column is its parent; all that hangs on a tree comes directly before it.
    """
    for place in range(n):
        node = factor.nodes[factor.slot[place]]
        node.place = place
        node.hanging = 1
    for place in range(n):
        node = factor.nodes[factor.slot[place]]
        node.parent = NOBODY
        for e in range(node.rows_begin, node.rows_end):
            u = factor.entries[e].node
            if node.parent < 0 or factor.nodes[u].place < factor.nodes[node.parent].place:
                node.parent = u
        if node.parent >= 0:
            factor.nodes[node.parent].hanging += node.hanging
    end = n
    for place in range(n - 1, -1, -1):
        node = factor.nodes[factor.slot[place]]
        if node.parent < 0:
            node.place = end - 1
            end -= node.hanging
        else:
            node.place = factor.nodes[node.parent].free - 1
            factor.nodes[node.parent].free -= node.hanging
        node.free = node.place
    for i in range(n):
        factor.slot[factor.nodes[i].place] = i


# ---- the paths of one tree
#
# A limit, or a contact with the ground or with a body further up the same branch, couples dofs on one path to the
# base, and so does A: then the factor fills nothing that A has not (Featherstone 2008, section 6.5), and most of it
# is absent in a robot with several limbs. A constraint between two branches makes one path of both: each dof's next
# one is the last of those before it that it is coupled to (the elimination tree, Liu 1990). Rows are packed as A's,
# with one entry for each dof on the path from the base, the dof itself last.


@kernel
def dofs_of(model, problem):
    """Of the island's only tree: the first dof, the one after those that all others hang on, the one after the last."""
    tree = model.trees[problem.trees[problem.trees_begin].order]
    return tree.first_dof, tree.first_dof + tree.base_dofs, tree.first_dof + tree.num_dofs


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


@kernel
def have_same_columns(contact, other):
    """Whether the same dofs move two contacts."""
    if contact.width != other.width:
        return False
    for i in range(contact.width):
        if contact.dofs[i] != other.dofs[i]:
            return False
    return True


@kernel(outline=True)
def lay_out_branches(model, problem, contacts, rows, factor):
    """The path of each dof and where its row starts; how many numbers all rows have."""
    first, _, end = dofs_of(model, problem)
    for k in range(first, end):
        factor.dofs[k].parent = model.dofs[k].parent
    last = 0  # contacts of one pair follow each other: the first joins for all
    for place in range(problem.contacts_begin, problem.contacts_end):
        c = contacts[place].order
        new = place == problem.contacts_begin or not have_same_columns(contacts[c], contacts[last])
        if new and not is_one_path(model, contacts[c]):
            join_columns(factor, contacts[c])
        last = c
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
def in_branches(factor, constraint, i, j):
    """Address of the entry of two columns of a constraint, whose dofs are on one path."""
    k, other = constraint.dofs[i], constraint.dofs[j]
    if k >= other:
        return factor.dofs[k].row_start + factor.dofs[other].depth
    return factor.dofs[other].row_start + factor.dofs[k].depth


# ---- layout: where everything is


@kernel
def put_rows(factor, n):
    """Lists of the entries of each row, columns descending."""
    for r in range(n):
        factor.blocks[r].row = NOBODY
    for k in range(n):
        column = factor.blocks[k]
        for e in range(column.below_begin, column.below_end):
            entry = factor.entries[e]
            row = factor.blocks[entry.place]
            entry.column = k
            entry.next = row.row
            row.row = e


@kernel
def sort_columns(factor, n):
    """Puts columns in order, the rows of each of them, and columns in that of each row: by turning all around."""
    put_rows(factor, n)
    begin = 0
    for k in range(n):
        column = factor.blocks[k]
        end = begin + column.below_end - column.below_begin
        column.below_begin, column.below_end, begin = begin, begin, end
    for r in range(n):
        e = factor.blocks[r].row
        while e >= 0:
            entry = factor.entries[e]
            column = factor.blocks[entry.column]
            factor.entries[column.below_end].place = r
            column.below_end += 1
            e = entry.next
    for r in range(n):
        factor.blocks[r].row = NOBODY
    for k in range(n - 1, -1, -1):
        column = factor.blocks[k]
        for e in range(column.below_begin, column.below_end):
            entry = factor.entries[e]
            row = factor.blocks[entry.place]
            entry.column = k
            entry.next = row.row
            row.row = e


@kernel
def lay_out_alone(model, problem, factor):
    """The only block of an island that is one tree."""
    t = problem.trees[problem.trees_begin].order
    factor.place[t] = 0
    block = factor.blocks[0]
    block.tree = t
    block.size = model.trees[t].num_dofs
    block.diagonal = 0
    block.below_begin = 0
    block.below_end = 0
    block.row = NOBODY
    block.held = 0
    return block.size * block.size


@kernel(outline=True)
def lay_out_trees(model, problem, contacts, rows, factor):
    """Order, places and addresses of all blocks of several trees; how many numbers they are, -1 if there is no room.

    Where the matrix is not symmetric, the transpose of the block above the diagonal lies behind the one below it.
    """
    begin = problem.trees_begin
    n = problem.trees_end - begin
    for i in range(n):
        factor.place[problem.trees[begin + i].order] = i
    entries = order_trees(problem, contacts, rows, factor)
    if entries < 0:
        return NOBODY
    put_in_postorder(factor, n)
    for place in range(n):
        block, node = factor.blocks[place], factor.nodes[factor.slot[place]]
        block.tree = problem.trees[begin + factor.slot[place]].order
        block.size = model.trees[block.tree].num_dofs
        block.below_begin = node.rows_begin
        block.below_end = node.rows_end
        block.held = 0
        factor.place[block.tree] = place
    for e in range(entries):
        entry = factor.entries[e]
        entry.place = factor.place[problem.trees[begin + entry.node].order]
    sort_columns(factor, n)
    size = 0
    for place in range(n):
        block = factor.blocks[place]
        block.diagonal = size
        size += block.size * block.size
        for e in range(block.below_begin, block.below_end):
            entry = factor.entries[e]
            entry.address = size
            size += model.sides * block.size * factor.blocks[entry.place].size
    return size


@kernel
def symbolic_factor(model, problem, contacts, rows, factor):
    """Order, places and addresses of all blocks of an island; FACTOR_CAPACITY when there is no room for them."""
    n = problem.trees_end - problem.trees_begin
    problem.along_branches = 0
    if n == 1:
        size = lay_out_alone(model, problem, factor)
        if model.sides == 1 and is_tree_with_joints(model, problem):
            problem.along_branches = 1
            size = lay_out_branches(model, problem, contacts, rows, factor)
    else:
        size = lay_out_trees(model, problem, contacts, rows, factor)
    if size < 0 or size > factor.L.shape[0]:
        return FACTOR_CAPACITY
    problem.factor_size = size
    problem.columns = n
    slot = 0
    for place in range(n):
        block = factor.blocks[place]
        block.first_slot = slot
        block.triangle = triangle_in_A(model, block.tree)
        for k in dofs_of_tree(model, block.tree):
            factor.slot[k] = slot
            slot += 1
    problem.participating = slot
    if problem.along_branches == 0:
        list_constraints(problem, contacts, rows, factor)
    return SOLVED


CONTACTS, ROWS = 0, 1  # of `Block.ends`


@kernel
def trees_touched(constraint):
    """The trees of a constraint, each once."""
    a, b = constraint.tree_a, constraint.tree_b
    for t in (a, -1 if a == b else b):
        if t >= 0:
            yield t


@kernel
def count_touching(constraints, begin, end, factor, kind):
    """Adds to `ends` of each block how many of the constraints at these places touch its tree."""
    for place in range(begin, end):
        for t in trees_touched(constraints[constraints[place].order]):
            factor.blocks[factor.place[t]].ends[kind] += 1


@kernel
def list_touching(constraints, begin, end, factor, kind):
    """Adds the numbers of these constraints to the lists of blocks."""
    for place in range(begin, end):
        c = constraints[place].order
        for t in trees_touched(constraints[c]):
            ends = factor.blocks[factor.place[t]].ends
            factor.graph[ends[kind]] = c
            ends[kind] += 1


@kernel(outline=True)
def list_constraints(problem, contacts, rows, factor):
    """For each block the constraints that touch its tree, contacts first: the terms of its column of the matrix."""
    for k in range(problem.columns):
        ends = factor.blocks[k].ends
        ends[CONTACTS], ends[ROWS] = 0, 0
    count_touching(contacts, problem.contacts_begin, problem.contacts_end, factor, CONTACTS)
    count_touching(rows, problem.rows_begin, problem.rows_end, factor, ROWS)
    begin = 0
    for k in range(problem.columns):
        block = factor.blocks[k]
        block.constraints_begin = begin
        ends = block.ends
        begin_of_rows = begin + ends[CONTACTS]
        ends[CONTACTS], ends[ROWS], begin = begin, begin_of_rows, begin_of_rows + ends[ROWS]
    list_touching(contacts, problem.contacts_begin, problem.contacts_end, factor, CONTACTS)
    list_touching(rows, problem.rows_begin, problem.rows_end, factor, ROWS)


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
    place = factor.place[t]
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


# ---- Cholesky along branches


@kernel
def take_from_rows_above(factor, k, r, begin):
    """Takes row k, r being 1/D of it, from those on the way to the base, down to dof `begin`."""
    L = factor.L
    row = factor.dofs[k].row_start
    for i, at in dofs_above_from(factor, k, begin):
        above = factor.dofs[i].row_start
        a = L[at] * r
        subtract_scaled(L, above, a, row, at - row + 1)
        L[at] = a


@kernel
def take_two_from_rows_above(factor, k, j, begin):
    """`take_from_rows_above` for row k and then for row j, the next one on its way, each number being written once."""
    L = factor.L
    row_k, row_j = factor.dofs[k].row_start, factor.dofs[j].row_start
    r_k, r_j = L[diagonal(factor, k)], L[diagonal(factor, j)]
    for i, at in dofs_above_from(factor, j, begin):
        at_k = row_k + at - row_j
        a, b = L[at_k] * r_k, L[at] * r_j
        subtract_two_scaled(L, factor.dofs[i].row_start, a, row_k, b, row_j, at - row_j + 1)
        L[at_k], L[at] = a, b


@kernel(outline=True)
def factorise_rows(factor, begin, end):
    """Replaces rows of `begin` to `end` - 1 by 1/D and L, but for the columns of dofs before; a status."""
    L = factor.L
    k = end - 1
    while k >= begin:
        above = k - 1
        if above >= begin and factor.dofs[k].parent == above:  # nothing else hangs on it that is not taken yet
            D, both = pivots_of_two(L, factor.dofs[k].row_start, factor.dofs[above].row_start, factor.dofs[above].depth)
            if not (is_positive(D) and is_positive(both)):
                return HESSIAN_NOT_POSITIVE
            take_two_from_rows_above(factor, k, above, begin)
            k -= 2
        else:
            D = L[diagonal(factor, k)]
            if not is_positive(D):
                return HESSIAN_NOT_POSITIVE
            L[diagonal(factor, k)] = 1.0 / D
            take_from_rows_above(factor, k, L[diagonal(factor, k)], begin)
            k -= 1
    return SOLVED


@kernel(outline=True)
def factorise_branches(model, problem, factor):
    """Replaces H by 1/D on the diagonal and L below it; a status."""
    L = factor.L
    first, begin, end = dofs_of(model, problem)
    status = factorise_rows(factor, begin, end)
    if status == SOLVED and begin > first:
        row = factor.dofs[first].row_start
        S = read_triangle(L, row)
        for k in range(end - 1, begin - 1, -1):
            S = take_row(L, factor.dofs[k].row_start, L[diagonal(factor, k)], S)
        write_triangle(L, row, S)
        if factorise_triangle(L, row) >= 0:
            return HESSIAN_NOT_POSITIVE
    return status


@kernel(outline=True)
def eliminate_branches(model, problem, factor):
    """rhs = -L^-T gradient."""
    L, x = factor.L, factor.rhs
    first, begin, end = dofs_of(model, problem)
    for k in range(first, end):
        x[k] = -problem.gradient[k]
    for k in range(end - 1, begin - 1, -1):
        for i, at in dofs_above_from(factor, k, begin):
            x[i] -= L[at] * x[k]
    if begin > first:
        base = load_six(x, first)
        for k in range(end - 1, begin - 1, -1):
            base = subtract_scaled_six(base, x[k], load_six(L, factor.dofs[k].row_start))
        store_six(x, first, eliminate_six(L, factor.dofs[first].row_start, base))


@kernel(outline=True)
def substitute_branches(packed, L, x, dv, first, begin, end):
    """dv = L^-1 D^-1 x, x becoming the same; dofs `first` to `begin` - 1 are those that all others hang on."""
    base = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    if begin > first:
        base = substitute_six(L, packed.dofs[first].row_start, load_six(x, first))
        store_six(x, first, base)
        store_six(dv, first, base)
    for k in range(begin, end):
        x_k = x[k] * L[diagonal(packed, k)]
        if begin > first:
            x_k = subtract_dot_six_backwards(x_k, load_six(L, packed.dofs[k].row_start), base)
        parent = packed.dofs[k].parent
        if parent >= begin:
            beside = packed.dofs[k].row_start - packed.dofs[parent].row_start
            for i, at in dofs_above_from(packed, parent, begin):
                x_k -= L[beside + at] * x[i]
            x_k -= L[diagonal(packed, k) - 1] * x[parent]  # last, as it is known last
        x[k] = x_k
        dv[k] = x_k


@kernel
def solve_branches(model, problem, factor):
    """dv = -H^-1 gradient."""
    eliminate_branches(model, problem, factor)
    first, begin, end = dofs_of(model, problem)
    substitute_branches(factor, factor.L, factor.rhs, problem.dv, first, begin, end)


# ---- Cholesky by blocks
#
# Column after column, each takes what it needs from those before it (left-looking): then no row is looked for, as the
# addresses of one column at a time are known by row. Blocks are stored column after column. Those of two free bodies,
# 6 by 6, are unrolled so that a column is a vector of the processor; the others are loops. The diagonal of a diagonal
# block holds 1 / L_ii.


@kernel(outline=True)
def subtract_product_of_six(L, C, A, B):
    """C -= A B^T of blocks 6 by 6."""
    a0 = load_six(L, A)
    a1 = load_six(L, A + 6)
    a2 = load_six(L, A + 12)
    a3 = load_six(L, A + 18)
    a4 = load_six(L, A + 24)
    a5 = load_six(L, A + 30)
    for b in range(SIX):
        x = load_six(L, C + SIX * b)
        x = subtract_scaled_six(x, L[B + b], a0)
        x = subtract_scaled_six(x, L[B + b + 6], a1)
        x = subtract_scaled_six(x, L[B + b + 12], a2)
        x = subtract_scaled_six(x, L[B + b + 18], a3)
        x = subtract_scaled_six(x, L[B + b + 24], a4)
        x = subtract_scaled_six(x, L[B + b + 30], a5)
        store_six(L, C + SIX * b, x)


@kernel
def subtract_product(L, C, A, B, rows, columns, inner):
    """C -= A B^T of blocks at these addresses: A is rows by inner, B columns by inner."""
    if rows == SIX and columns == SIX and inner == SIX:
        subtract_product_of_six(L, C, A, B)
    else:
        for b in range(columns):
            for c in range(inner):
                s = L[B + columns * c + b]
                for a in range(rows):
                    L[C + rows * b + a] -= L[A + rows * c + a] * s


@kernel(outline=True)
def factorise_six(L, D):
    """`factorise_diagonal` of a block 6 by 6; the roots, as 1 / sqrt(D) of L D L^T, come all at once at the end."""
    a, b, c, d, e, f = load_six(L, D)
    if not a > 0.0:
        return HESSIAN_NOT_POSITIVE
    p = 1.0 / a
    s, t, u, v, w = b * p, c * p, d * p, e * p, f * p
    bb, cb, db, eb, fb = L[D + 7] - s * b, L[D + 8] - s * c, L[D + 9] - s * d, L[D + 10] - s * e, L[D + 11] - s * f
    cc, dc, ec, fc = L[D + 14] - t * c, L[D + 15] - t * d, L[D + 16] - t * e, L[D + 17] - t * f
    dd, ed, fd = L[D + 21] - u * d, L[D + 22] - u * e, L[D + 23] - u * f
    ee, fe = L[D + 28] - v * e, L[D + 29] - v * f
    ff = L[D + 35] - w * f
    if not bb > 0.0:
        return HESSIAN_NOT_POSITIVE
    q = 1.0 / bb
    t, u, v, w = cb * q, db * q, eb * q, fb * q
    cc, dc, ec, fc = cc - t * cb, dc - t * db, ec - t * eb, fc - t * fb
    dd, ed, fd = dd - u * db, ed - u * eb, fd - u * fb
    ee, fe = ee - v * eb, fe - v * fb
    ff = ff - w * fb
    if not cc > 0.0:
        return HESSIAN_NOT_POSITIVE
    r = 1.0 / cc
    u, v, w = dc * r, ec * r, fc * r
    dd, ed, fd = dd - u * dc, ed - u * ec, fd - u * fc
    ee, fe = ee - v * ec, fe - v * fc
    ff = ff - w * fc
    if not dd > 0.0:
        return HESSIAN_NOT_POSITIVE
    x = 1.0 / dd
    v, w = ed * x, fd * x
    ee, fe = ee - v * ed, fe - v * fd
    ff = ff - w * fd
    if not ee > 0.0:
        return HESSIAN_NOT_POSITIVE
    y = 1.0 / ee
    ff = ff - fe * y * fe
    if not ff > 0.0:
        return HESSIAN_NOT_POSITIVE
    z = 1.0 / ff
    p, q, r, x, y, z = sqrt(p), sqrt(q), sqrt(r), sqrt(x), sqrt(y), sqrt(z)
    store_six(L, D, (p, b * p, c * p, d * p, e * p, f * p))
    L[D + 7], L[D + 8], L[D + 9], L[D + 10], L[D + 11] = q, cb * q, db * q, eb * q, fb * q
    L[D + 14], L[D + 15], L[D + 16], L[D + 17] = r, dc * r, ec * r, fc * r
    L[D + 21], L[D + 22], L[D + 23] = x, ed * x, fd * x
    L[D + 28], L[D + 29] = y, fe * y
    L[D + 35] = z
    return SOLVED


@kernel
def factorise_diagonal(L, D, n):
    """Cholesky of the lower triangle of the block at D in place; a status."""
    if n == SIX:
        return factorise_six(L, D)
    for c in range(n):
        column = D + n * c
        for e in range(c):
            subtract_scaled(L, column + c, L[D + n * e + c], D + n * e + c, n - c)
        if not L[column + c] > 0.0:
            return HESSIAN_NOT_POSITIVE
        s = 1.0 / sqrt(L[column + c])
        L[column + c] = s
        for a in range(c + 1, n):
            L[column + a] *= s
    return SOLVED


@kernel(outline=True)
def divide_six(L, B, D, across, along, ones):
    """`divide` of a block 6 by 6."""
    for c in range(SIX):
        x = load_six(L, B + SIX * c)
        for e in range(c):
            x = subtract_scaled_six(x, L[D + across * e + along * c], load_six(L, B + SIX * e))
        if ones == 0:
            s = L[D + SIX * c + c]
            x = (s * x[0], s * x[1], s * x[2], s * x[3], s * x[4], s * x[5])
        store_six(L, B + SIX * c, x)


@kernel
def divide(L, B, rows, D, n, across, along, ones):
    """B <- B T^-1, T upper triangular with T_ec at D + across e + along c and 1 / T_cc on the diagonal, or ones."""
    if rows == SIX and n == SIX:
        divide_six(L, B, D, across, along, ones)
    else:
        for c in range(n):
            for e in range(c):
                s = L[D + across * e + along * c]
                for a in range(rows):
                    L[B + rows * c + a] -= L[B + rows * e + a] * s
            if ones == 0:
                s = L[D + n * c + c]
                for a in range(rows):
                    L[B + rows * c + a] *= s


LINE = 8  # numbers of a cache line


@kernel
def ask_for_block(L, B):
    """Asks for the memory of a block of two free bodies that is read next: factors of heaps do not fit into the cache.

    Those behind it in its column the processor asks for by itself.
    """
    for i in range(0, SIX * SIX, LINE):
        prefetch(L, B + i)


@kernel
def take_from_columns_before(factor, k):
    """Takes the products of earlier columns off column k; no products of what is held."""
    L, column = factor.L, factor.blocks[k]
    e = column.row
    while e >= 0:
        entry = factor.entries[e]
        if entry.next >= 0:
            ask_for_block(L, factor.entries[entry.next].address)
        before = factor.blocks[entry.column]
        inner, B = before.size, entry.address
        if before.held == 0:
            subtract_product(L, column.diagonal, B, B, column.size, column.size, inner)
            for f in range(e + 1, before.below_end):
                below = factor.entries[f]
                row = factor.blocks[below.place]
                if row.held == 0:
                    subtract_product(L, row.at, below.address, B, row.size, column.size, inner)
        e = entry.next


@kernel
def subtract_block_times(L, B, rows, n, x, at, to):
    """x[to..] -= B x[at..] of the block at B, rows by n."""
    if rows == SIX and n == SIX:
        y = load_six(x, to)
        for c in range(SIX):
            y = subtract_scaled_six(y, x[at + c], load_six(L, B + SIX * c))
        store_six(x, to, y)
    else:
        for c in range(n):
            for a in range(rows):
                x[to + a] -= L[B + rows * c + a] * x[at + c]


@kernel
def subtract_transpose_times(L, B, rows, n, x, at, of):
    """x[at..] -= B^T x[of..] of the block at B, rows by n."""
    if rows == SIX and n == SIX:
        y = load_six(x, of)
        for c in range(SIX):
            x[at + c] -= dot_six(load_six(L, B + SIX * c), y)
    else:
        for c in range(n):
            s = x[at + c]
            for a in range(rows):
                s -= L[B + rows * c + a] * x[of + a]
            x[at + c] = s


@kernel
def forwards(L, D, n, x, at):
    """x[at..] <- L_D^-1 x[at..], L_D being the diagonal block at D."""
    if n == SIX:
        a, b, c, d, e, f = load_six(x, at)
        a *= L[D]
        b = (b - L[D + 1] * a) * L[D + 7]
        c = (c - L[D + 2] * a - L[D + 8] * b) * L[D + 14]
        d = (d - L[D + 3] * a - L[D + 9] * b - L[D + 15] * c) * L[D + 21]
        e = (e - L[D + 4] * a - L[D + 10] * b - L[D + 16] * c - L[D + 22] * d) * L[D + 28]
        f = (f - L[D + 5] * a - L[D + 11] * b - L[D + 17] * c - L[D + 23] * d - L[D + 29] * e) * L[D + 35]
        store_six(x, at, (a, b, c, d, e, f))
    else:
        for k in range(n):
            s = x[at + k] * L[D + n * k + k]
            x[at + k] = s
            for i in range(k + 1, n):
                x[at + i] -= L[D + n * k + i] * s


@kernel
def backwards(L, D, n, x, at):
    """x[at..] <- L_D^-T x[at..]."""
    if n == SIX:
        a, b, c, d, e, f = load_six(x, at)
        f *= L[D + 35]
        e = (e - L[D + 29] * f) * L[D + 28]
        d = (d - L[D + 23] * f - L[D + 22] * e) * L[D + 21]
        c = (c - L[D + 17] * f - L[D + 16] * e - L[D + 15] * d) * L[D + 14]
        b = (b - L[D + 11] * f - L[D + 10] * e - L[D + 9] * d - L[D + 8] * c) * L[D + 7]
        a = (a - L[D + 5] * f - L[D + 4] * e - L[D + 3] * d - L[D + 2] * c - L[D + 1] * b) * L[D]
        store_six(x, at, (a, b, c, d, e, f))
    else:
        for k in range(n - 1, -1, -1):
            s = x[at + k] * L[D + n * k + k]
            x[at + k] = s
            for i in range(k):
                x[at + i] -= L[D + n * i + k] * s


@kernel
def columns_not_held(factor, n):
    """Those of the first n block columns whose trees may move, in order."""
    for k in range(n):
        if factor.blocks[k].held == 0:
            yield k


@kernel
def rows_not_held(factor, column):
    """The blocks below the diagonal of a column in rows whose trees may move: (entry, block of the row)."""
    for e in range(column.below_begin, column.below_end):
        entry = factor.entries[e]
        row = factor.blocks[entry.place]
        if row.held == 0:
            yield entry, row


@kernel
def eliminate_column(factor, k):
    """Takes column k of the factor off the right-hand side: the step of x <- L^-1 x that follows those before it."""
    L, x, column = factor.L, factor.rhs, factor.blocks[k]
    size, at = column.size, column.first_slot
    forwards(L, column.diagonal, size, x, at)
    for entry, row in rows_not_held(factor, column):
        subtract_block_times(L, entry.address, row.size, size, x, at, row.first_slot)


@kernel
def factorise_column(factor, k):
    """Factorises column k in place, those before it being done; a status. `Block.at` tells where its blocks are."""
    L, column = factor.L, factor.blocks[k]
    take_from_columns_before(factor, k)
    if factorise_diagonal(L, column.diagonal, column.size) != SOLVED:
        return HESSIAN_NOT_POSITIVE
    for entry, row in rows_not_held(factor, column):
        divide(L, entry.address, row.size, column.diagonal, column.size, column.size, 1, 0)  # by L^T
    return SOLVED


@kernel(outline=True)
def eliminate_columns(factor, n):
    """rhs <- L^-1 rhs, by a factor that was made before."""
    for k in range(n):
        eliminate_column(factor, k)


@kernel(outline=True)
def substitute(factor, n):
    """rhs <- L^-T rhs, backwards through the n block columns."""
    L, x = factor.L, factor.rhs
    for k in range(n - 1, -1, -1):
        column = factor.blocks[k]
        if column.held != 0:
            continue
        size, at = column.size, column.first_slot
        for entry, row in rows_not_held(factor, column):
            subtract_transpose_times(L, entry.address, row.size, size, x, at, row.first_slot)
        backwards(L, column.diagonal, size, x, at)


@kernel
def scatter(model, problem, factor):
    """dv from the solution by slots."""
    for k in sixes_of_island(model, problem):
        store_six(problem.dv, k, load_six(factor.rhs, factor.slot[k]))
    for k in other_dofs_of_island(model, problem):
        problem.dv[k] = factor.rhs[factor.slot[k]]


@kernel
def put_right_hand_side(model, problem, factor):
    """-gradient by slots."""
    for k in sixes_of_island(model, problem):
        a, b, c, d, e, f = load_six(problem.gradient, k)
        store_six(factor.rhs, factor.slot[k], (-a, -b, -c, -d, -e, -f))
    for k in other_dofs_of_island(model, problem):
        factor.rhs[factor.slot[k]] = -problem.gradient[k]


# ---- elimination of an unsymmetric matrix
#
# Two blocks for each pair of trees that elimination couples: the one below the diagonal, rows of the later tree, and
# behind it the transpose of the one above: both have the same shape, and a product of two is always A B^T, as for
# Cholesky. Rows are exchanged within a block row: what one tree's dofs do to each other is the stiffest.


@kernel
def blocks_of(factor, e, columns):
    """(address of the block below the diagonal, of the transpose of the one above, rows of both) of entry e."""
    entry = factor.entries[e]
    rows = factor.blocks[entry.place].size
    return entry.address, entry.address + rows * columns, rows


@kernel
def swap(x, i, j):
    x[i], x[j] = x[j], x[i]


@kernel
def swap_rows(factor, k, a, b):
    """Exchanges two rows of block row k, from its diagonal block to the right, and of the right-hand side."""
    block = factor.blocks[k]
    n = block.size
    for c in range(n):
        swap(factor.L, block.diagonal + n * c + a, block.diagonal + n * c + b)
    for e in range(block.below_begin, block.below_end):
        _, above, rows = blocks_of(factor, e, n)
        for i in range(rows):
            swap(factor.L, above + rows * a + i, above + rows * b + i)
    swap(factor.rhs, block.first_slot + a, block.first_slot + b)


@kernel
def split_diagonal(factor, k):
    """Diagonal block k becomes L U: L below a diagonal of ones, 1 / U_ii on it; a status."""
    L = factor.L
    n, D = factor.blocks[k].size, factor.blocks[k].diagonal
    for c in range(n):
        column = D + n * c
        pivot = c
        largest = magnitude(L[column + c])
        for a in range(c + 1, n):
            if magnitude(L[column + a]) > largest:
                largest = magnitude(L[column + a])
                pivot = a
        if not largest > 0.0:
            return TAMSI_FAILED
        if pivot != c:
            swap_rows(factor, k, c, pivot)
        s = 1.0 / L[column + c]
        L[column + c] = s
        for a in range(c + 1, n):
            L[column + a] *= s
        for b in range(c + 1, n):
            u = L[D + n * b + c]
            for a in range(c + 1, n):
                L[D + n * b + a] -= L[column + a] * u
    return SOLVED


@kernel
def split_column(factor, k):
    """Block column k, block row k and their part of the right-hand side, its diagonal block being split."""
    L, x = factor.L, factor.rhs
    block = factor.blocks[k]
    n, D, at = block.size, block.diagonal, block.first_slot
    for c in range(n):
        for a in range(c + 1, n):
            x[at + a] -= L[D + n * c + a] * x[at + c]
    for e in range(block.below_begin, block.below_end):
        below, above, rows = blocks_of(factor, e, n)
        divide(L, below, rows, D, n, 1, n, 0)  # by U
        divide(L, above, rows, D, n, n, 1, 1)  # by the transpose of L
        subtract_block_times(L, below, rows, n, x, at, factor.blocks[factor.entries[e].place].first_slot)


@kernel
def update_behind(factor, k):
    """Takes the product of block column k and block row k off what is behind them."""
    L = factor.L
    n = factor.blocks[k].size
    end = factor.blocks[k].below_end
    for e in range(factor.blocks[k].below_begin, end):
        behind = factor.blocks[factor.entries[e].place]
        below_j, above_j, columns = blocks_of(factor, e, n)
        subtract_product(L, behind.diagonal, below_j, above_j, columns, columns, n)
        g = behind.below_begin
        for f in range(e + 1, end):
            while factor.entries[g].place != factor.entries[f].place:
                g += 1
            below_i, above_i, rows = blocks_of(factor, f, n)
            below, above, _ = blocks_of(factor, g, columns)
            subtract_product(L, below, below_i, above_j, rows, columns, n)
            subtract_product(L, above, above_i, below_j, rows, columns, n)


@kernel
def substitute_back(factor, k):
    """The unknowns of block row k, those behind being known."""
    L, x = factor.L, factor.rhs
    block = factor.blocks[k]
    n, D, at = block.size, block.diagonal, block.first_slot
    for e in range(block.below_begin, block.below_end):
        _, above, rows = blocks_of(factor, e, n)
        subtract_transpose_times(L, above, rows, n, x, at, factor.blocks[factor.entries[e].place].first_slot)
    for c in range(n - 1, -1, -1):
        s = x[at + c]
        for a in range(c + 1, n):
            s -= L[D + n * a + c] * x[at + a]
        x[at + c] = s * L[D + n * c + c]


@kernel(outline=True)
def eliminate(factor, n):
    """rhs <- H^-1 rhs for the n block columns of H, which is lost; TAMSI_FAILED when a diagonal block is singular."""
    for k in range(n):
        if split_diagonal(factor, k) != SOLVED:
            return TAMSI_FAILED
        split_column(factor, k)
        update_behind(factor, k)
    for k in range(n - 1, -1, -1):
        substitute_back(factor, k)
    return SOLVED
