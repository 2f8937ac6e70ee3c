"""In which order trees are eliminated, and which blocks of the factor fill: symbolic Cholesky on the graph of trees.

Minimum degree (George and Liu 1989): next comes a tree with the fewest neighbours, which then all become neighbours of
each other; the neighbours it has at that moment are the rows of its column. Neighbours are bits, so a union is a few
words. All of it depends on the graph alone: the same contacts give the same order, and with it the same bits.
"""

import numpy as np

from sheldrake.common.kernel import kernel
from sheldrake.multibody.contact_solvers._kernels.branches import lay_out_branches
from sheldrake.multibody.contact_solvers._kernels.gradient import is_chain_of_six
from sheldrake.multibody.contact_solvers._kernels.problem import (
    ADDRESS,
    ALONG_BRANCHES,
    APPROXIMATION,
    BELOW_BEGIN,
    BELOW_END,
    BELOW_PLACE,
    BLOCK_TREE,
    CONTACTS_BEGIN,
    CONTACTS_END,
    DIAGONAL,
    FACTOR_SIZE,
    FIRST_DOF,
    FIRST_SLOT,
    NUM_DOFS,
    ORDER,
    PARTICIPATING,
    PLACE,
    ROWS_BEGIN,
    ROWS_END,
    SIZE,
    TAMSI,
    TREE_A,
    TREE_B,
    TREE_ORDER,
    TREES_BEGIN,
    TREES_END,
)

BITS = np.int64(62)  # of a word: 63 would be the sign
ONE = np.int64(1)
NOBODY = np.int64(-1)
DEGREE = BELOW_BEGIN  # while the order is sought: neighbours that are left
DONE = BELOW_END  # 1 when eliminated


@kernel
def set_bit(graph, i, j):
    graph[i, j // BITS] |= ONE << (j % BITS)


@kernel
def clear_bit(graph, i, j):
    graph[i, j // BITS] &= ~(ONE << (j % BITS))


@kernel
def lowest_bit(word):
    """Number of the lowest bit of a word that is not zero, by halves."""
    n = np.int64(0)
    for half in (32, 16, 8, 4, 2, 1):
        if word & ((ONE << half) - ONE) == 0:
            word >>= half
            n += half
    return n


@kernel
def next_neighbour(graph, i, after, words):
    """The first neighbour of i behind `after`, -1 for none."""
    k = after + 1
    w = k // BITS
    if w >= words:
        return NOBODY
    word = graph[i, w] >> (k % BITS)
    if word != 0:
        return k + lowest_bit(word)
    w += 1
    while w < words:
        if graph[i, w] != 0:
            return w * BITS + lowest_bit(graph[i, w])
        w += 1
    return NOBODY


@kernel
def couple(factor, index, begin, end):
    """Marks the two trees of each constraint as neighbours."""
    for place in range(begin, end):
        c = index[place, ORDER]
        a = index[c, TREE_A]
        b = index[c, TREE_B]
        if a >= 0 and b >= 0 and a != b:
            i = factor.block[a, PLACE]
            j = factor.block[b, PLACE]
            set_bit(factor.graph, i, j)
            set_bit(factor.graph, j, i)


@kernel
def count_neighbours(graph, i, words):
    n = np.int64(0)
    for w in range(words):
        word = graph[i, w]
        while word != 0:
            word &= word - ONE
            n += 1
    return n


@kernel
def least_coupled(block, n):
    """Of the n trees, numbered within the island, the first that is left and has the fewest neighbours."""
    best = NOBODY
    degree = n
    for i in range(n):
        if block[i, DONE] == 0 and block[i, DEGREE] < degree:
            degree = block[i, DEGREE]
            best = i
    return best


@kernel
def eliminate_tree(factor, i, words):
    """Makes the neighbours of i each other's neighbours; i leaves."""
    graph = factor.graph
    factor.block[i, DONE] = 1
    u = next_neighbour(graph, i, NOBODY, words)
    while u >= 0:
        for w in range(words):
            graph[u, w] |= graph[i, w]
        clear_bit(graph, u, u)
        clear_bit(graph, u, i)
        factor.block[u, DEGREE] = count_neighbours(graph, u, words)
        u = next_neighbour(graph, i, u, words)


@kernel(outline=True)
def order_trees(problem, contacts, rows, factor):
    """Finds the elimination order: the island's trees, by their numbers within the island, in `factor.slot`."""
    count = problem.count
    n = count[TREES_END] - count[TREES_BEGIN]
    words = (n + BITS - 1) // BITS
    for i in range(n):
        for w in range(words):
            factor.graph[i, w] = 0
    couple(factor, contacts.index, count[CONTACTS_BEGIN], count[CONTACTS_END])
    couple(factor, rows.index, count[ROWS_BEGIN], count[ROWS_END])
    for i in range(n):
        factor.block[i, DEGREE] = count_neighbours(factor.graph, i, words)
        factor.block[i, DONE] = 0
    for place in range(n):
        i = least_coupled(factor.block, n)
        factor.slot[place] = i
        eliminate_tree(factor, i, words)


@kernel
def put_below(factor, begin, end, row):
    """Inserts a row into the column at hand, rows ascending."""
    at = end
    while at > begin and factor.below[at - 1, BELOW_PLACE] > row:
        factor.below[at, BELOW_PLACE] = factor.below[at - 1, BELOW_PLACE]
        at -= 1
    factor.below[at, BELOW_PLACE] = row


@kernel
def lay_out_alone(model, problem, factor):
    """The only block of an island that is one tree."""
    t = problem.tree[problem.count[TREES_BEGIN], TREE_ORDER]
    block = factor.block
    block[t, PLACE] = 0
    block[0, BLOCK_TREE] = t
    block[0, SIZE] = model.tree[t, NUM_DOFS]
    block[0, DIAGONAL] = 0
    block[0, BELOW_BEGIN] = 0
    block[0, BELOW_END] = 0
    return block[0, SIZE] * block[0, SIZE]


@kernel(outline=True)
def lay_out_trees(model, problem, contacts, rows, factor):
    """Order, places and addresses of all blocks of several trees; how many numbers they are, -1 if there is no room.

    kTamsi's matrix is not symmetric: the transpose of the block above the diagonal lies behind the one below it.
    """
    count = problem.count
    sides = np.int64(2 if model.setting[APPROXIMATION] == TAMSI else 1)
    block = factor.block
    begin = count[TREES_BEGIN]
    n = count[TREES_END] - begin
    for i in range(n):
        block[problem.tree[begin + i, TREE_ORDER], PLACE] = i
    order_trees(problem, contacts, rows, factor)
    for place in range(n):
        i = factor.slot[place]
        block[place, BLOCK_TREE] = problem.tree[begin + i, TREE_ORDER]
    # From here on PLACE is the place in the order; FIRST_SLOT holds the number within the island.
    for place in range(n):
        block[place, FIRST_SLOT] = factor.slot[place]
        block[block[place, BLOCK_TREE], PLACE] = place
    words = (n + BITS - 1) // BITS
    size = np.int64(0)
    entries = np.int64(0)
    for place in range(n):
        i = block[place, FIRST_SLOT]
        width = model.tree[block[place, BLOCK_TREE], NUM_DOFS]
        block[place, SIZE] = width
        block[place, DIAGONAL] = size
        size += width * width
        block[place, BELOW_BEGIN] = entries
        u = next_neighbour(factor.graph, i, NOBODY, words)
        while u >= 0:
            if entries >= factor.below.shape[0]:
                return NOBODY
            t = problem.tree[begin + u, TREE_ORDER]
            put_below(factor, block[place, BELOW_BEGIN], entries, block[t, PLACE])
            entries += 1
            u = next_neighbour(factor.graph, i, u, words)
        block[place, BELOW_END] = entries
        for e in range(block[place, BELOW_BEGIN], entries):
            factor.below[e, ADDRESS] = size
            row = factor.below[e, BELOW_PLACE]
            size += sides * width * model.tree[block[row, BLOCK_TREE], NUM_DOFS]
    return size


@kernel
def lay_out(model, problem, contacts, rows, factor):
    """Order, places and addresses of all blocks of an island; 1 when there is no room for them, else 0."""
    n = problem.count[TREES_END] - problem.count[TREES_BEGIN]
    problem.count[ALONG_BRANCHES] = 0
    if n == 1:
        size = lay_out_alone(model, problem, factor)
        t = factor.block[0, BLOCK_TREE]
        if model.setting[APPROXIMATION] != TAMSI and not is_chain_of_six(model, t):
            problem.count[ALONG_BRANCHES] = 1
            size = lay_out_branches(model, problem, contacts, rows, factor)
    else:
        size = lay_out_trees(model, problem, contacts, rows, factor)
    if size < 0 or size > factor.L.shape[0]:
        return 1
    number_dofs(model, problem, factor, n)
    problem.count[FACTOR_SIZE] = size
    return 0


@kernel
def number_dofs(model, problem, factor, n):
    """Slots of the dofs of the island's n blocks, in their order."""
    slot = np.int64(0)
    for place in range(n):
        t = factor.block[place, BLOCK_TREE]
        factor.block[place, FIRST_SLOT] = slot
        for k in range(model.tree[t, NUM_DOFS]):
            factor.slot[model.tree[t, FIRST_DOF] + k] = slot
            slot += 1
    problem.count[PARTICIPATING] = slot
