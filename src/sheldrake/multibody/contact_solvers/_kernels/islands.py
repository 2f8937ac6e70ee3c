"""Islands: trees that constraints connect, directly or through others. In one step nothing passes between islands."""

import numpy as np

from sheldrake.common.kernel import kernel
from sheldrake.multibody.contact_solvers._kernels.problem import (
    ACTIVE,
    CONTACTS_BEGIN,
    CONTACTS_END,
    ISLAND_CONTACTS,
    ISLAND_ROWS,
    ISLAND_TREES,
    NUM_CONTACTS,
    NUM_ISLANDS,
    NUM_ROWS,
    ORDER,
    ROOT_TREE,
    ROWS_BEGIN,
    ROWS_END,
    TREE_A,
    TREE_B,
    TREE_ORDER,
    TREES_BEGIN,
    TREES_END,
)

ONE_ISLAND = np.int64(1)


@kernel
def find_root(tree, t):
    """First tree of the set of t; shortens the way for the next who asks."""
    while tree[t, ROOT_TREE] != t:
        tree[t, ROOT_TREE] = tree[tree[t, ROOT_TREE], ROOT_TREE]
        t = tree[t, ROOT_TREE]
    return t


@kernel
def connect(tree, index, count):
    """Joins the sets of the two trees of each constraint; the lower tree leads.

    Contacts of one pair follow each other: the first of them tells all.
    """
    a = np.int64(-1)
    b = np.int64(-1)
    for c in range(count):
        if index[c, TREE_A] == a and index[c, TREE_B] == b:
            continue
        a = index[c, TREE_A]
        b = index[c, TREE_B]
        if a >= 0 and b >= 0 and a != b:
            root_a = find_root(tree, a)
            root_b = find_root(tree, b)
            if root_a < root_b:
                tree[root_b, ROOT_TREE] = root_a
            else:
                tree[root_a, ROOT_TREE] = root_b


@kernel
def island_of(tree, index, c):
    t = index[c, TREE_A]
    if t < 0:
        t = index[c, TREE_B]
    if t < 0:
        return np.int64(0)
    return tree[t, ROOT_TREE]


@kernel
def sort_by_island(tree, index, count, islands, column):
    """Places of constraints, island after island, each in their order; where islands end in `column`."""
    for k in range(islands):
        tree[k, column] = 0
    for c in range(count):
        tree[island_of(tree, index, c), column] += 1
    begin = np.int64(0)
    for k in range(islands):
        size = tree[k, column]
        tree[k, column] = begin
        begin += size
    for c in range(count):
        k = island_of(tree, index, c)
        index[tree[k, column], ORDER] = c
        tree[k, column] += 1


@kernel(outline=True)
def sort_islands(model, problem, contacts, rows):
    """Finds islands, numbered by their first trees, and orders trees, contacts and rows by them."""
    tree = problem.tree
    num_trees = tree.shape[0]
    for t in range(num_trees):
        tree[t, ROOT_TREE] = t
    connect(tree, contacts.index, problem.count[NUM_CONTACTS])
    connect(tree, rows.index, problem.count[NUM_ROWS])
    for t in range(num_trees):
        if tree[t, ACTIVE] == 1:
            tree[t, ROOT_TREE] = find_root(tree, t)
    islands = np.int64(0)
    for t in range(num_trees):  # a root comes before the others of its set: it has its number when they ask
        if tree[t, ACTIVE] == 1:
            if tree[t, ROOT_TREE] == t:
                tree[t, ROOT_TREE] = islands
                tree[islands, ISLAND_TREES] = 0
                islands += 1
            else:
                tree[t, ROOT_TREE] = tree[tree[t, ROOT_TREE], ROOT_TREE]
            tree[tree[t, ROOT_TREE], ISLAND_TREES] += 1
    begin = np.int64(0)
    for k in range(islands):
        size = tree[k, ISLAND_TREES]
        tree[k, ISLAND_TREES] = begin
        begin += size
    for t in range(num_trees):
        if tree[t, ACTIVE] == 1:
            k = tree[t, ROOT_TREE]
            tree[tree[k, ISLAND_TREES], TREE_ORDER] = t
            tree[k, ISLAND_TREES] += 1
    problem.count[NUM_ISLANDS] = islands
    sort_by_island(tree, contacts.index, problem.count[NUM_CONTACTS], islands, ISLAND_CONTACTS)
    sort_by_island(tree, rows.index, problem.count[NUM_ROWS], islands, ISLAND_ROWS)


@kernel
def group_islands(model, problem, contacts, rows, separate):
    """Orders everything by island; all is one island unless `separate` is 1 and there are several trees."""
    tree = problem.tree
    places = np.int64(0)
    for t in range(tree.shape[0]):
        if tree[t, ACTIVE] == 1:
            tree[places, TREE_ORDER] = t
            places += 1
    if separate == 1 and places > 1:
        sort_islands(model, problem, contacts, rows)
    else:
        problem.count[NUM_ISLANDS] = ONE_ISLAND
        tree[0, ISLAND_TREES] = places
        tree[0, ISLAND_CONTACTS] = problem.count[NUM_CONTACTS]
        tree[0, ISLAND_ROWS] = problem.count[NUM_ROWS]
        for c in range(problem.count[NUM_CONTACTS]):
            contacts.index[c, ORDER] = c
        for r in range(problem.count[NUM_ROWS]):
            rows.index[r, ORDER] = r


@kernel
def select_island(problem, island):
    """Makes an island the one at hand."""
    count = problem.count
    count[TREES_BEGIN] = 0
    count[CONTACTS_BEGIN] = 0
    count[ROWS_BEGIN] = 0
    if island > 0:
        count[TREES_BEGIN] = problem.tree[island - 1, ISLAND_TREES]
        count[CONTACTS_BEGIN] = problem.tree[island - 1, ISLAND_CONTACTS]
        count[ROWS_BEGIN] = problem.tree[island - 1, ISLAND_ROWS]
    count[TREES_END] = problem.tree[island, ISLAND_TREES]
    count[CONTACTS_END] = problem.tree[island, ISLAND_CONTACTS]
    count[ROWS_END] = problem.tree[island, ISLAND_ROWS]
