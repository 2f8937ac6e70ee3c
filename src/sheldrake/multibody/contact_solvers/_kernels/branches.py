"""The Hessian H = A + J^T G J of an island that is one tree, and its factor L^T D L, row by row along branches.

A limit, or a contact with the ground or with a body further up the same branch, couples dofs on one path to the base,
and so does A: then the factor fills nothing that A has not (Featherstone 2008, section 6.5), and most of it is absent
in a robot with several limbs. A constraint between two branches makes one path of both: each dof's next one is the
last of those before it that it is coupled to (the elimination tree, Liu 1990). Rows are packed as A's, with one entry
for each dof on the path from the base, the dof itself last.
"""

import numpy as np

from sheldrake.common._kernels.generic import is_positive
from sheldrake.common._kernels.vec import column3, load_symmetric_at
from sheldrake.common.kernel import kernel
from sheldrake.multibody.contact_solvers._kernels.problem import (
    ALONG_BRANCHES,
    BRANCH_DEPTH,
    BRANCH_PARENT,
    BRANCH_START,
    CONTACTS_BEGIN,
    CONTACTS_END,
    DEPTH_OF,
    DOFS,
    DV,
    FIRST_DOF,
    G_XX,
    GRADIENT,
    NUM_DOFS,
    ORDER,
    PARENT_DOF,
    ROW_DOFS,
    ROW_G,
    ROW_START,
    ROWS_BEGIN,
    ROWS_END,
    TREE_ORDER,
    TREES_BEGIN,
    WIDTH,
)


@kernel
def dofs_of(model, problem):
    """First dof of the island's only tree, and the one after its last."""
    t = problem.tree[problem.count[TREES_BEGIN], TREE_ORDER]
    first = model.tree[t, FIRST_DOF]
    return first, first + model.tree[t, NUM_DOFS]


@kernel
def join_paths(branch, a, b):
    """Makes one path of those from two dofs to the base; the dof where it begins."""
    begin = a if a > b else b
    while a != b and a >= 0 and b >= 0:
        low = a if a > b else b
        high = b if a > b else a
        a = branch[low, BRANCH_PARENT]
        b = high
        if a < high:
            branch[low, BRANCH_PARENT] = high
    return begin


@kernel
def join_columns(branch, index, c, dofs):
    """Makes one path of all dofs of a constraint."""
    begin = index[c, dofs]
    for i in range(1, index[c, WIDTH]):
        begin = join_paths(branch, begin, index[c, dofs + i])


@kernel
def is_one_path(model, index, c):
    """Whether the columns of a contact, which go down one branch and then down another, go down one only."""
    width = index[c, WIDTH]
    return model.dof[index[c, DOFS + width - 1], DEPTH_OF] - model.dof[index[c, DOFS], DEPTH_OF] + 1 == width


@kernel(outline=True)
def lay_out_branches(model, problem, contacts, rows, factor):
    """The path of each dof and where its row starts; how many numbers all rows have."""
    branch = factor.branch
    index = contacts.index
    first, end = dofs_of(model, problem)
    for k in range(first, end):
        branch[k, BRANCH_PARENT] = model.dof[k, PARENT_DOF]
    for place in range(problem.count[CONTACTS_BEGIN], problem.count[CONTACTS_END]):
        c = index[place, ORDER]
        if not is_one_path(model, index, c):
            join_columns(branch, index, c, DOFS)
    for place in range(problem.count[ROWS_BEGIN], problem.count[ROWS_END]):
        join_columns(branch, rows.index, rows.index[place, ORDER], ROW_DOFS)
    size = np.int64(0)
    for k in range(first, end):
        depth = np.int64(0)
        if branch[k, BRANCH_PARENT] >= 0:
            depth = branch[branch[k, BRANCH_PARENT], BRANCH_DEPTH] + 1
        branch[k, BRANCH_DEPTH] = depth
        branch[k, BRANCH_START] = size
        size += depth + 1
    return size


@kernel
def put_momentum_of_branches(model, problem, factor):
    """H = A."""
    L = factor.L
    branch = factor.branch
    first, end = dofs_of(model, problem)
    for k in range(first, end):
        row = branch[k, BRANCH_START]
        at = model.dof[k, ROW_START]
        depth = model.dof[k, DEPTH_OF]
        if branch[k, BRANCH_DEPTH] == depth:
            for i in range(depth + 1):
                L[row + i] = problem.A[at + i]
        else:
            for i in range(branch[k, BRANCH_DEPTH] + 1):
                L[row + i] = 0.0
            at += depth
            j = k
            while j >= 0:
                L[row + branch[j, BRANCH_DEPTH]] = problem.A[at]
                at -= 1
                j = model.dof[j, PARENT_DOF]


@kernel
def entry(branch, k, j):
    """Address of the entry of two dofs on one path."""
    if k >= j:
        return branch[k, BRANCH_START] + branch[j, BRANCH_DEPTH]
    return branch[j, BRANCH_START] + branch[k, BRANCH_DEPTH]


@kernel
def add_contact_to_branches(model, contacts, c, G, factor):
    """H += J^T G J of a contact; down one branch the entries of a row follow each other, unless others came between."""
    L = factor.L
    J = contacts.J
    branch = factor.branch
    width = contacts.index[c, WIDTH]
    top = branch[contacts.index[c, DOFS], BRANCH_DEPTH]
    xx, xy, yy, xz, yz, zz = G
    together = False
    if is_one_path(model, contacts.index, c):
        together = branch[contacts.index[c, DOFS + width - 1], BRANCH_DEPTH] - top + 1 == width
    for i in range(width):
        k = contacts.index[c, DOFS + i]
        u = column3(J, 3 * c, i)
        x = xx * u[0] + xy * u[1] + xz * u[2]
        y = xy * u[0] + yy * u[1] + yz * u[2]
        z = xz * u[0] + yz * u[1] + zz * u[2]
        if together:
            row = branch[k, BRANCH_START] + top
            for j in range(i + 1):
                L[row + j] += x * J[3 * c, j] + y * J[3 * c + 1, j] + z * J[3 * c + 2, j]
        else:
            for j in range(i + 1):
                at = entry(branch, k, contacts.index[c, DOFS + j])
                L[at] += x * J[3 * c, j] + y * J[3 * c + 1, j] + z * J[3 * c + 2, j]


@kernel(outline=True)
def assemble_branches(model, problem, contacts, rows, factor):
    """H = A + J^T G J."""
    put_momentum_of_branches(model, problem, factor)
    for place in range(problem.count[CONTACTS_BEGIN], problem.count[CONTACTS_END]):
        c = contacts.index[place, ORDER]
        G = load_symmetric_at(contacts.state, c, G_XX)
        if G[0] > 0.0 or G[5] > 0.0:
            add_contact_to_branches(model, contacts, c, G, factor)
    index = rows.index
    for place in range(problem.count[ROWS_BEGIN], problem.count[ROWS_END]):
        r = index[place, ORDER]
        if rows.state[r, ROW_G] > 0.0:
            for i in range(index[r, WIDTH]):
                g = rows.state[r, ROW_G] * rows.J[r, i]
                for j in range(i + 1):
                    factor.L[entry(factor.branch, index[r, ROW_DOFS + i], index[r, ROW_DOFS + j])] += g * rows.J[r, j]


@kernel(outline=True)
def factorise_branches(model, problem, factor):
    """Replaces H by 1/D on the diagonal and L below it. Returns 1 when a pivot is not positive, else 0."""
    L = factor.L
    branch = factor.branch
    first, end = dofs_of(model, problem)
    for k in range(end - 1, first - 1, -1):
        row = branch[k, BRANCH_START]
        depth = branch[k, BRANCH_DEPTH]
        if not is_positive(L[row + depth]):
            return 1
        r = 1.0 / L[row + depth]
        L[row + depth] = r
        i = branch[k, BRANCH_PARENT]
        while i >= 0:
            depth -= 1
            above = branch[i, BRANCH_START]
            a = L[row + depth] * r
            for j in range(depth + 1):
                L[above + j] -= a * L[row + j]
            L[row + depth] = a
            i = branch[i, BRANCH_PARENT]
    return 0


@kernel(outline=True)
def solve_branches(model, problem, factor):
    """x[DV] = -H^-1 gradient."""
    L = factor.L
    x = factor.rhs
    branch = factor.branch
    first, end = dofs_of(model, problem)
    for k in range(first, end):
        x[k] = -problem.x[GRADIENT, k]
    for k in range(end - 1, first - 1, -1):
        at = branch[k, BRANCH_START] + branch[k, BRANCH_DEPTH]
        i = branch[k, BRANCH_PARENT]
        while i >= 0:
            at -= 1
            x[i] -= L[at] * x[k]
            i = branch[i, BRANCH_PARENT]
    for k in range(first, end):
        at = branch[k, BRANCH_START] + branch[k, BRANCH_DEPTH]
        x_k = x[k] * L[at]
        i = branch[k, BRANCH_PARENT]
        while i >= 0:
            at -= 1
            x_k -= L[at] * x[i]
            i = branch[i, BRANCH_PARENT]
        x[k] = x_k
        problem.x[DV, k] = x_k


@kernel
def goes_along_branches(problem):
    """Whether the factor of the island at hand is the one of this file."""
    return problem.count[ALONG_BRANCHES] == 1
