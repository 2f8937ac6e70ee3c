"""The Hessian H = A + J^T G J of an island in blocks, lower triangle, and the Newton direction it gives."""

import numpy as np

from sheldrake.common._kernels.vec import column3, dot3, load_symmetric_at
from sheldrake.common.kernel import kernel
from sheldrake.multibody.contact_solvers._kernels.block_cholesky import factorise, substitute
from sheldrake.multibody.contact_solvers._kernels.branches import (
    assemble_branches,
    factorise_branches,
    goes_along_branches,
    solve_branches,
)
from sheldrake.multibody.contact_solvers._kernels.gradient import is_chain_of_six
from sheldrake.multibody.contact_solvers._kernels.problem import (
    ADDRESS,
    BELOW_BEGIN,
    BELOW_PLACE,
    BLOCK_TREE,
    CONTACTS_BEGIN,
    CONTACTS_END,
    DEPTH_OF,
    DIAGONAL,
    DOFS,
    DV,
    FACTOR_SIZE,
    FIRST_DOF,
    G_XX,
    GRADIENT,
    NUM_DOFS,
    ORDER,
    PARENT_DOF,
    PLACE,
    ROW_DOFS,
    ROW_G,
    ROW_START,
    ROWS_BEGIN,
    ROWS_END,
    SIXES,
    SIZE,
    TREE_A,
    TREE_B,
    TREE_ORDER,
    TREES_BEGIN,
    TREES_END,
    WIDTH,
)
from sheldrake.multibody.contact_solvers._kernels.six import (
    SIX,
    load_six,
    load_six_of,
    plus_scaled,
    put_packed_six,
    store_six,
)

FIRST = np.int64(0)
ONE = np.int64(1)


@kernel
def put_momentum(model, problem, factor):
    """H = A: all blocks zero but those of the trees."""
    L = factor.L
    for at in range(problem.count[FACTOR_SIZE]):
        L[at] = 0.0
    for place in range(problem.count[TREES_END] - problem.count[TREES_BEGIN]):
        t = factor.block[place, BLOCK_TREE]
        n = factor.block[place, SIZE]
        first = model.tree[t, FIRST_DOF]
        if is_chain_of_six(model, t):
            put_packed_six(L, factor.block[place, DIAGONAL], problem.A, model.dof[first, ROW_START])
            continue
        for i in range(n):
            k = first + i
            at = model.dof[k, ROW_START] + model.dof[k, DEPTH_OF]
            row = factor.block[place, DIAGONAL] + i
            L[row + n * i] = problem.A[at]
            j = model.dof[k, PARENT_DOF]
            while j >= 0:
                at -= 1
                L[row + n * (j - first)] = problem.A[at]
                j = model.dof[j, PARENT_DOF]


@kernel
def find_block(factor, later, earlier):
    """Address of the block at the places of two coupled trees."""
    e = factor.block[earlier, BELOW_BEGIN]
    while factor.below[e, BELOW_PLACE] != later:
        e += 1
    return factor.below[e, ADDRESS]


@kernel
def columns_of(model, index, c, dofs, t):
    """How many of the constraint's columns, from the first one on, belong to tree t."""
    width = index[c, WIDTH]
    begin = model.tree[t, FIRST_DOF]
    end = begin + model.tree[t, NUM_DOFS]
    n = 0
    while n < width and begin <= index[c, dofs + n] and index[c, dofs + n] < end:
        n += 1
    return n


@kernel
def places_of(model, factor, index, c, dofs):
    """Where the columns of a constraint go.

    Returns:
        split: how many columns belong to the first tree; the others belong to the second.
        first, second: (address of the tree's diagonal block less its first dof's row and column, its size).
        coupling: (address of the block of second and first tree, step from dof to dof of the second and of the first),
            dofs counted as in the plant.
    """
    a = index[c, TREE_A]
    b = index[c, TREE_B]
    if a < 0:
        a = b
    split = columns_of(model, index, c, dofs, a)
    n_a = model.tree[a, NUM_DOFS]
    first_a = model.tree[a, FIRST_DOF]
    place_a = factor.block[a, PLACE]
    first = (factor.block[place_a, DIAGONAL] - (n_a + 1) * first_a, n_a)
    if split == index[c, WIDTH]:
        return split, first, first, (first_a, n_a, n_a)
    n_b = model.tree[b, NUM_DOFS]
    first_b = model.tree[b, FIRST_DOF]
    place_b = factor.block[b, PLACE]
    second = (factor.block[place_b, DIAGONAL] - (n_b + 1) * first_b, n_b)
    if place_b > place_a:
        address = find_block(factor, place_b, place_a)
        return split, first, second, (address - n_b * first_a - first_b, ONE, n_b)
    address = find_block(factor, place_a, place_b)
    return split, first, second, (address - n_a * first_b - first_a, n_a, ONE)


@kernel
def in_diagonal(side, k, j):
    """Address of the entry of two dofs in the lower triangle of their tree's block."""
    D, n = side
    return D + n * j + k if k >= j else D + n * k + j


@kernel
def in_coupling(coupling, k, j):
    """Address of the entry of dof k of the second tree and dof j of the first."""
    address, step_second, step_first = coupling
    return address + step_second * k + step_first * j


@kernel
def times_G(G, u):
    xx, xy, yy, xz, yz, zz = G
    return (
        xx * u[0] + xy * u[1] + xz * u[2],
        xy * u[0] + yy * u[1] + yz * u[2],
        xz * u[0] + yz * u[1] + zz * u[2],
    )


@kernel(outline=True)
def add_contact(model, contacts, c, G, places, L):
    """H += J^T G J of a contact of any two bodies."""
    split, first, second, coupling = places
    J = contacts.J
    index = contacts.index
    for i in range(index[c, WIDTH]):
        k = index[c, DOFS + i]
        Gu = times_G(G, column3(J, 3 * c, i))
        if i < split:
            for j in range(i + 1):
                L[in_diagonal(first, k, index[c, DOFS + j])] += dot3(Gu, column3(J, 3 * c, j))
        else:
            for j in range(split):
                L[in_coupling(coupling, k, index[c, DOFS + j])] += dot3(Gu, column3(J, 3 * c, j))
            for j in range(split, i + 1):
                L[in_diagonal(second, k, index[c, DOFS + j])] += dot3(Gu, column3(J, 3 * c, j))


@kernel
def add_square(L, B, J, c, rows, columns, G):
    """The block at B, 6 by 6, += J_rows^T G J_columns of contact c, each from its first column on."""
    x = load_six_of(J, 3 * c, rows)
    y = load_six_of(J, 3 * c + 1, rows)
    z = load_six_of(J, 3 * c + 2, rows)
    for j in range(SIX):
        g = times_G(G, column3(J, 3 * c, columns + j))
        to = load_six(L, B + SIX * j)
        to = plus_scaled(to, g[0], x)
        to = plus_scaled(to, g[1], y)
        to = plus_scaled(to, g[2], z)
        store_six(L, B + SIX * j, to)


@kernel(outline=True)
def add_free_contact(factor, contacts, c, G, t_A, t_B):
    """`add_contact` of two free bodies, or of one and something fixed."""
    L = factor.L
    J = contacts.J
    if t_A < 0:
        add_square(L, factor.block[factor.block[t_B, PLACE], DIAGONAL], J, c, FIRST, FIRST, G)
    else:
        place_A = factor.block[t_A, PLACE]
        add_square(L, factor.block[place_A, DIAGONAL], J, c, FIRST, FIRST, G)
        if t_B >= 0:
            place_B = factor.block[t_B, PLACE]
            add_square(L, factor.block[place_B, DIAGONAL], J, c, SIX, SIX, G)
            if place_B > place_A:
                add_square(L, find_block(factor, place_B, place_A), J, c, SIX, FIRST, G)
            else:
                add_square(L, find_block(factor, place_A, place_B), J, c, FIRST, SIX, G)


@kernel
def add_contacts(model, problem, contacts, factor):
    """H += J^T G J of the contacts."""
    index = contacts.index
    for place in range(problem.count[CONTACTS_BEGIN], problem.count[CONTACTS_END]):
        c = index[place, ORDER]
        G = load_symmetric_at(contacts.state, c, G_XX)
        if G[0] > 0.0 or G[5] > 0.0:
            t_A = index[c, TREE_A]
            t_B = index[c, TREE_B]
            if index[c, SIXES] > 0:
                add_free_contact(factor, contacts, c, G, t_A, t_B)
            else:
                add_contact(model, contacts, c, G, places_of(model, factor, index, c, DOFS), factor.L)


@kernel
def add_rows(model, problem, rows, factor):
    """H += J^T G J of the scalar rows."""
    L = factor.L
    J = rows.J
    index = rows.index
    for place in range(problem.count[ROWS_BEGIN], problem.count[ROWS_END]):
        r = index[place, ORDER]
        G = rows.state[r, ROW_G]
        if G > 0.0:
            split, first, second, coupling = places_of(model, factor, index, r, ROW_DOFS)
            for i in range(index[r, WIDTH]):
                k = index[r, ROW_DOFS + i]
                Gu = G * J[r, i]
                if i < split:
                    for j in range(i + 1):
                        L[in_diagonal(first, k, index[r, ROW_DOFS + j])] += Gu * J[r, j]
                else:
                    for j in range(split):
                        L[in_coupling(coupling, k, index[r, ROW_DOFS + j])] += Gu * J[r, j]
                    for j in range(split, i + 1):
                        L[in_diagonal(second, k, index[r, ROW_DOFS + j])] += Gu * J[r, j]


@kernel(outline=True)
def assemble(model, problem, contacts, rows, factor):
    """H = A + J^T G J in the blocks."""
    put_momentum(model, problem, factor)
    add_contacts(model, problem, contacts, factor)
    add_rows(model, problem, rows, factor)


@kernel
def renew_factor(model, problem, contacts, rows, factor):
    """Factorises the Hessian at the iterate. Returns 1 when a pivot is not positive, else 0."""
    if goes_along_branches(problem):
        assemble_branches(model, problem, contacts, rows, factor)
        return factorise_branches(model, problem, factor)
    assemble(model, problem, contacts, rows, factor)
    return factorise(factor, problem.count[TREES_END] - problem.count[TREES_BEGIN])


@kernel
def newton_direction(model, problem, factor):
    """dv = -H^-1 gradient over the participating dofs."""
    if goes_along_branches(problem):
        solve_branches(model, problem, factor)
    else:
        solve_blocks(model, problem, factor)


@kernel(outline=True)
def solve_blocks(model, problem, factor):
    """`newton_direction` by the factor in blocks."""
    x = factor.rhs
    begin = problem.count[TREES_BEGIN]
    end = problem.count[TREES_END]
    for place in range(begin, end):
        t = problem.tree[place, TREE_ORDER]
        for dof in range(model.tree[t, FIRST_DOF], model.tree[t, FIRST_DOF] + model.tree[t, NUM_DOFS]):
            x[factor.slot[dof]] = -problem.x[GRADIENT, dof]
    substitute(factor, end - begin)
    for place in range(begin, end):
        t = problem.tree[place, TREE_ORDER]
        for dof in range(model.tree[t, FIRST_DOF], model.tree[t, FIRST_DOF] + model.tree[t, NUM_DOFS]):
            problem.x[DV, dof] = x[factor.slot[dof]]
