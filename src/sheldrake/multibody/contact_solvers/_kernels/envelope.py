"""Envelope (skyline) Cholesky of the Hessian over the participating dofs, tree after tree.

Row i of the factor starts at the first dof of the first tree that any constraint couples its tree to; fill stays inside
(George and Liu 1981, chapter 4). Uncoupled trees cost their own blocks only.
"""

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common._kernels.vec import column3, dot3, load_symmetric_at
from sheldrake.common.kernel import kernel
from sheldrake.multibody.contact_solvers._kernels.problem import (
    CONTACTS_BEGIN,
    CONTACTS_END,
    DEPTH_OF,
    DOFS,
    DV,
    ENVELOPE,
    FIRST_DOF,
    G_XX,
    GRADIENT,
    NUM_DOFS,
    ORDER,
    PARENT_DOF,
    PARTICIPATING,
    ROW_DOFS,
    ROW_G,
    ROW_START,
    ROWS_BEGIN,
    ROWS_END,
    START,
    TREE_A,
    TREE_B,
    TREE_ORDER,
    TREES_BEGIN,
    TREES_END,
    WIDTH,
)


@kernel
def couple_trees(model, slot, first, index, begin, end):
    """Lets the rows of the later of two coupled trees start at the earlier one."""
    for place in range(begin, end):
        c = index[place, ORDER]
        a = index[c, TREE_A]
        b = index[c, TREE_B]
        if a >= 0 and b >= 0 and a != b:
            slot_a = slot[model.tree[a, FIRST_DOF]]
            slot_b = slot[model.tree[b, FIRST_DOF]]
            if slot_a < slot_b:
                if slot_a < first[b]:
                    first[b] = slot_a
            elif slot_b < first[a]:
                first[a] = slot_b


@kernel(outline=True)
def lay_out(model, problem, contacts, rows, factor):
    """Slots, first columns and addresses of the factor; returns the number of entries it needs."""
    n = 0
    for place in range(problem.count[TREES_BEGIN], problem.count[TREES_END]):
        t = problem.tree[place, TREE_ORDER]
        factor.first[t] = n
        for k in range(model.tree[t, NUM_DOFS]):
            factor.slot[model.tree[t, FIRST_DOF] + k] = n
            n += 1
    problem.count[PARTICIPATING] = n
    count = problem.count
    couple_trees(model, factor.slot, factor.first, contacts.index, count[CONTACTS_BEGIN], count[CONTACTS_END])
    couple_trees(model, factor.slot, factor.first, rows.index, count[ROWS_BEGIN], count[ROWS_END])
    size = 0
    i = 0
    for place in range(problem.count[TREES_BEGIN], problem.count[TREES_END]):
        t = problem.tree[place, TREE_ORDER]
        for _ in range(model.tree[t, NUM_DOFS]):
            factor.row[i, ENVELOPE] = factor.first[t]
            factor.row[i, START] = size - factor.first[t]
            size += i - factor.first[t] + 1
            i += 1
    return size


@kernel
def entry(factor, i, j):
    """Address of the entry of two slots in the lower triangle."""
    if i >= j:
        return factor.row[i, START] + j
    return factor.row[j, START] + i


@kernel(outline=True)
def assemble(model, problem, contacts, rows, factor):
    """H = A + J^T G J."""
    L = factor.L
    for place in range(problem.count[TREES_BEGIN], problem.count[TREES_END]):
        t = problem.tree[place, TREE_ORDER]
        first = model.tree[t, FIRST_DOF]
        base = factor.slot[first]
        for k in range(first, first + model.tree[t, NUM_DOFS]):
            i = base + k - first
            start = factor.row[i, START]
            for j in range(factor.row[i, ENVELOPE], i):
                L[start + j] = 0.0
            at = model.dof[k, ROW_START] + model.dof[k, DEPTH_OF]
            L[start + i] = problem.A[at]
            j = model.dof[k, PARENT_DOF]
            while j >= 0:
                at -= 1
                L[start + base + j - first] = problem.A[at]
                j = model.dof[j, PARENT_DOF]
    J = contacts.J
    for place in range(problem.count[CONTACTS_BEGIN], problem.count[CONTACTS_END]):
        c = contacts.index[place, ORDER]
        xx, xy, yy, xz, yz, zz = load_symmetric_at(contacts.state, c, G_XX)
        if xx > 0.0 or zz > 0.0:
            for a in range(contacts.index[c, WIDTH]):
                u = column3(J, 3 * c, a)
                Gu = (
                    xx * u[0] + xy * u[1] + xz * u[2],
                    xy * u[0] + yy * u[1] + yz * u[2],
                    xz * u[0] + yz * u[1] + zz * u[2],
                )
                i = factor.slot[contacts.index[c, DOFS + a]]
                for b in range(a + 1):
                    j = factor.slot[contacts.index[c, DOFS + b]]
                    L[entry(factor, i, j)] += dot3(Gu, column3(J, 3 * c, b))
    for place in range(problem.count[ROWS_BEGIN], problem.count[ROWS_END]):
        r = rows.index[place, ORDER]
        G = rows.state[r, ROW_G]
        if G > 0.0:
            for a in range(rows.index[r, WIDTH]):
                Gu = G * rows.J[r, a]
                i = factor.slot[rows.index[r, ROW_DOFS + a]]
                for b in range(a + 1):
                    j = factor.slot[rows.index[r, ROW_DOFS + b]]
                    L[entry(factor, i, j)] += Gu * rows.J[r, b]


@kernel
def row_product(L, start_i, start_j, begin, end):
    """Sum of L_ik L_jk for k in [begin, end), in four chains that the processor runs side by side."""
    k = begin
    s = 0.0
    if end - begin >= 4:
        a = 0.0
        b = 0.0
        c = 0.0
        while k + 4 <= end:
            s += L[start_i + k] * L[start_j + k]
            a += L[start_i + k + 1] * L[start_j + k + 1]
            b += L[start_i + k + 2] * L[start_j + k + 2]
            c += L[start_i + k + 3] * L[start_j + k + 3]
            k += 4
        s = (s + a) + (b + c)
    while k < end:
        s += L[start_i + k] * L[start_j + k]
        k += 1
    return s


@kernel(outline=True)
def factorise(factor, n):
    """L L^T = H in place, row by row; the diagonal holds 1 / L_ii. Returns 1 when a pivot is not positive, else 0."""
    L = factor.L
    for i in range(n):
        start_i = factor.row[i, START]
        first_i = factor.row[i, ENVELOPE]
        diagonal = L[start_i + i]
        for j in range(first_i, i):
            start_j = factor.row[j, START]
            k0 = factor.row[j, ENVELOPE]
            if k0 < first_i:
                k0 = first_i
            s = (L[start_i + j] - row_product(L, start_i, start_j, k0, j)) * L[start_j + j]
            L[start_i + j] = s
            diagonal -= s * s
        if not diagonal > 0.0:
            return 1
        L[start_i + i] = 1.0 / sqrt(diagonal)
    return 0


@kernel(outline=True)
def newton_direction(model, problem, factor):
    """dv = -H^-1 gradient over the participating dofs."""
    L = factor.L
    x = factor.rhs
    n = problem.count[PARTICIPATING]
    for place in range(problem.count[TREES_BEGIN], problem.count[TREES_END]):
        t = problem.tree[place, TREE_ORDER]
        for dof in range(model.tree[t, FIRST_DOF], model.tree[t, FIRST_DOF] + model.tree[t, NUM_DOFS]):
            x[factor.slot[dof]] = -problem.x[GRADIENT, dof]
    for i in range(n):
        start = factor.row[i, START]
        s = x[i]
        for k in range(factor.row[i, ENVELOPE], i):
            s -= L[start + k] * x[k]
        x[i] = s * L[start + i]
    for i in range(n - 1, -1, -1):
        start = factor.row[i, START]
        s = x[i] * L[start + i]
        x[i] = s
        for k in range(factor.row[i, ENVELOPE], i):
            x[k] -= L[start + k] * s
    for place in range(problem.count[TREES_BEGIN], problem.count[TREES_END]):
        t = problem.tree[place, TREE_ORDER]
        for dof in range(model.tree[t, FIRST_DOF], model.tree[t, FIRST_DOF] + model.tree[t, NUM_DOFS]):
            problem.x[DV, dof] = x[factor.slot[dof]]
