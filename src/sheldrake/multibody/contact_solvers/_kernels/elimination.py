"""In which order trees are eliminated, and which blocks of the factor fill: symbolic Cholesky on the graph of trees.

Minimum degree (George and Liu 1989): next comes a tree with the fewest neighbours, which then all become neighbours of
each other; the neighbours it has at that moment are the rows of its column. Neighbours are bits, so a union is a few
words. All of it depends on the graph alone: the same contacts give the same order, and with it the same bits.
"""

from sheldrake.common.kernel import kernel
from sheldrake.multibody.contact_solvers._kernels.gradient import is_chain_of_six
from sheldrake.multibody.contact_solvers._kernels.hessian import lay_out_branches
from sheldrake.multibody.contact_solvers._kernels.problem import TAMSI, contacts_of_island, dofs_of_tree, rows_of_island
from sheldrake.multibody.contact_solvers._kernels.status import FACTOR_CAPACITY, SOLVED

BITS = 62  # of a word: 63 would be the sign
NOBODY = -1


@kernel
def set_bit(graph, i, j):
    graph[i, j // BITS] |= 1 << (j % BITS)


@kernel
def clear_bit(graph, i, j):
    graph[i, j // BITS] &= ~(1 << (j % BITS))


@kernel
def lowest_bit(word):
    """Number of the lowest bit of a word that is not zero, by halves."""
    n = 0
    for half in (32, 16, 8, 4, 2, 1):
        if word & ((1 << half) - 1) == 0:
            word >>= half
            n += half
    return n


@kernel
def neighbours(graph, i, words):
    """For loops: the neighbours of i, ascending."""
    for w in range(words):
        word = graph[i, w]
        while word != 0:
            yield w * BITS + lowest_bit(word)
            word &= word - 1


@kernel
def couple(problem, factor, constraints, of_island):
    """Marks the two trees of each constraint as neighbours."""
    for constraint in of_island(problem, constraints):
        a, b = constraint.tree_a, constraint.tree_b
        if a >= 0 and b >= 0 and a != b:
            i, j = factor.trees[a].place, factor.trees[b].place
            set_bit(factor.graph, i, j)
            set_bit(factor.graph, j, i)


@kernel
def count_neighbours(graph, i, words):
    n = 0
    for _ in neighbours(graph, i, words):
        n += 1
    return n


@kernel
def least_coupled(factor, n):
    """Of the n trees, numbered within the island, the first that is left and has the fewest neighbours."""
    best = NOBODY
    degree = n
    for i in range(n):
        if factor.nodes[i].done == 0 and factor.nodes[i].degree < degree:
            best, degree = i, factor.nodes[i].degree
    return best


@kernel
def eliminate_tree(factor, i, words):
    """Makes the neighbours of i each other's neighbours; i leaves."""
    graph = factor.graph
    factor.nodes[i].done = 1
    for u in neighbours(graph, i, words):
        for w in range(words):
            graph[u, w] |= graph[i, w]
        clear_bit(graph, u, u)
        clear_bit(graph, u, i)
        factor.nodes[u].degree = count_neighbours(graph, u, words)


@kernel(outline=True)
def order_trees(problem, contacts, rows, factor):
    """Finds the elimination order: the island's trees, by their numbers within the island, in `factor.slot`."""
    n = problem.trees_end - problem.trees_begin
    words = (n + BITS - 1) // BITS
    for i in range(n):
        for w in range(words):
            factor.graph[i, w] = 0
    couple(problem, factor, contacts, contacts_of_island)
    couple(problem, factor, rows, rows_of_island)
    for i in range(n):
        factor.nodes[i].degree = count_neighbours(factor.graph, i, words)
        factor.nodes[i].done = 0
    for place in range(n):
        i = least_coupled(factor, n)
        factor.slot[place] = i
        eliminate_tree(factor, i, words)


@kernel
def put_below(factor, begin, end, row):
    """Inserts a row into the column at hand, rows ascending."""
    at = end
    while at > begin and factor.entries[at - 1].place > row:
        factor.entries[at].place = factor.entries[at - 1].place
        at -= 1
    factor.entries[at].place = row


@kernel
def lay_out_alone(model, problem, factor):
    """The only block of an island that is one tree."""
    t = problem.trees[problem.trees_begin].order
    factor.trees[t].place = 0
    block = factor.blocks[0]
    block.tree = t
    block.size = model.trees[t].num_dofs
    block.diagonal = 0
    block.below_begin = 0
    block.below_end = 0
    return block.size * block.size


@kernel(outline=True)
def lay_out_trees(model, problem, contacts, rows, factor):
    """Order, places and addresses of all blocks of several trees; how many numbers they are, -1 if there is no room.

    kTamsi's matrix is not symmetric: the transpose of the block above the diagonal lies behind the one below it.
    """
    sides = 2 if model.approximation == TAMSI else 1
    begin = problem.trees_begin
    n = problem.trees_end - begin
    for i in range(n):
        factor.trees[problem.trees[begin + i].order].place = i
    order_trees(problem, contacts, rows, factor)
    for place in range(n):
        block = factor.blocks[place]
        block.node = factor.slot[place]
        block.tree = problem.trees[begin + block.node].order
        factor.trees[block.tree].place = place
    words = (n + BITS - 1) // BITS
    size = 0
    entries = 0
    for place in range(n):
        block = factor.blocks[place]
        block.size = model.trees[block.tree].num_dofs
        block.diagonal = size
        size += block.size * block.size
        block.below_begin = entries
        for u in neighbours(factor.graph, block.node, words):
            if entries >= len(factor.entries):
                return NOBODY
            put_below(factor, block.below_begin, entries, factor.trees[problem.trees[begin + u].order].place)
            entries += 1
        block.below_end = entries
        for e in range(block.below_begin, entries):
            entry = factor.entries[e]
            entry.address = size
            size += sides * block.size * model.trees[factor.blocks[entry.place].tree].num_dofs
    return size


@kernel
def lay_out(model, problem, contacts, rows, factor):
    """Order, places and addresses of all blocks of an island; FACTOR_CAPACITY when there is no room for them."""
    n = problem.trees_end - problem.trees_begin
    problem.along_branches = 0
    if n == 1:
        size = lay_out_alone(model, problem, factor)
        if model.approximation != TAMSI and not is_chain_of_six(model, factor.blocks[0].tree):
            problem.along_branches = 1
            size = lay_out_branches(model, problem, contacts, rows, factor)
    else:
        size = lay_out_trees(model, problem, contacts, rows, factor)
    if size < 0 or size > factor.L.shape[0]:
        return FACTOR_CAPACITY
    problem.factor_size = size
    slot = 0
    for place in range(n):
        block = factor.blocks[place]
        block.first_slot = slot
        for k in dofs_of_tree(model, block.tree):
            factor.slot[k] = slot
            slot += 1
    problem.participating = slot
    return SOLVED
