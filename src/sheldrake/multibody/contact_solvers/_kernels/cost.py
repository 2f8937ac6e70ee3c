"""The convex cost of an island: its value, its gradient, its slope along a line, and its Hessian.

The gradient is A (v - v*) - J^T gamma (Castro, Permenter, Han 2022, section IV-A), what is left of eq. 18; the Hessian
is A + J^T G J, whose blocks are those of trees and of the pairs of them that touch (section IV-D).
"""

from sheldrake.common._kernels.generic import in_any, value_of
from sheldrake.common._kernels.vec import (
    SIX,
    add3,
    add_scaled_six,
    add_three_sixes,
    column3,
    copy_numbers,
    dot3,
    dot_six,
    load_six,
    load_three_sixes,
    mul_symmetric,
    put_packed_six,
    read_triangle,
    root,
    scale3,
    store_six,
    store_six_of,
    sub_six,
    subtract_dyad,
    sum_of_sixes,
    times_six,
    write_triangle,
)
from sheldrake.common.kernel import kernel
from sheldrake.common.rows import prefetch
from sheldrake.multibody.contact_solvers._kernels.factor import (
    CONTACTS,
    LINE,
    ROWS,
    columns_not_held,
    columns_of,
    dofs_of,
    eliminate_column,
    eliminate_columns,
    factorise_branches,
    factorise_column,
    in_blocks,
    in_branches,
    places_of,
    put_right_hand_side,
    scatter,
    solve_branches,
    substitute,
)
from sheldrake.multibody.contact_solvers._kernels.laws import (
    contact_cost,
    contact_impulse,
    contact_slope,
    row_cost,
    row_impulse,
)
from sheldrake.multibody.contact_solvers._kernels.problem import (
    DVC,
    FIRST,
    HESSIAN_NOT_POSITIVE,
    SOLVED,
    VC,
    add_generalized_impulse,
    chunks_of_contacts,
    contact_velocities,
    contacts_between,
    contacts_of_island,
    diagonal,
    dofs_above,
    dofs_of_island,
    multiply_A,
    other_dofs_of_island,
    put_velocity,
    row_velocities,
    rows_of_island,
    sixes_of_island,
)

# ---- value, and slope along a line
#
# Section IV-C of Castro, Permenter, Han 2022.


@kernel(outline=True)
def constraint_cost(model, problem, contacts, rows, alpha):
    """Sum of all l_i at vc + alpha dvc [J]."""
    total = 0.0
    for contact in contacts_of_island(problem, contacts):
        vc = add3(contact.vc, scale3(contact.dvc, alpha))
        total += contact_cost(model, contact, vc)
    for row in rows_of_island(problem, rows):
        vc_r = row.vc + alpha * row.dvc
        total += row_cost(row, vc_r)
    return total


@kernel(outline=True)
def constraint_slope(model, problem, contacts, rows, alpha):
    """First and second derivative of `constraint_cost` with respect to alpha [J]."""
    slope = 0.0
    curvature = 0.0
    for contact in contacts_of_island(problem, contacts):
        dvc = contact.dvc
        first, second = contact_slope(model, contact, add3(contact.vc, scale3(dvc, alpha)), dvc)
        slope += first
        curvature += second
    for row in rows_of_island(problem, rows):
        gamma, G = row_impulse(row, row.vc + alpha * row.dvc)
        slope -= row.dvc * gamma
        curvature += row.dvc * G * row.dvc
    return slope, curvature


@kernel
def whole_cost(model, problem, contacts, rows):
    """(cost of momentum 1/2 (v - v*)^T A (v - v*), that and the cost of constraints) at the iterate [J].

    Where rows are ahead in v* it is about that: all that is asked for then is what is round-off.
    """
    s = 0.0
    for k in dofs_of_island(model, problem):
        dp = problem.p[k] - problem.p_star[k]
        s += dp * (problem.mobility[k] * dp if problem.rows_ahead > 0 else problem.v[k] - problem.v_star[k])
    momentum = 0.5 * s
    return momentum, momentum + constraint_cost(model, problem, contacts, rows, 0.0)


@kernel
def along_direction(model, problem):
    """Slope of the cost at the iterate along dv [J]."""
    slope = 0.0
    for k in sixes_of_island(model, problem):
        slope += dot_six(load_six(problem.dv, k), load_six(problem.gradient, k))
    for k in other_dofs_of_island(model, problem):
        slope += problem.dv[k] * problem.gradient[k]
    return slope


@kernel
def momentum_along_direction(model, problem):
    """(slope of the momentum cost, dv^T A dv) at the iterate along dv [J]."""
    slope = 0.0
    curvature = 0.0
    for k in dofs_of_island(model, problem):
        slope += problem.dv[k] * (problem.p[k] - problem.p_star[k])
        curvature += problem.dv[k] * problem.a_dv[k]
    return slope, curvature


# ---- impulses and gradient


@kernel
def put_v0(model, problem):
    """v = v0."""
    for k in sixes_of_island(model, problem):
        store_six(problem.v, k, load_six(problem.v0, k))
    for k in other_dofs_of_island(model, problem):
        problem.v[k] = problem.v0[k]


@kernel
def move_dofs(model, problem, alpha):
    """v += alpha dv, and with it momenta."""
    for k in sixes_of_island(model, problem):
        store_six(problem.v, k, add_scaled_six(load_six(problem.v, k), alpha, load_six(problem.dv, k)))
        store_six(problem.p, k, add_scaled_six(load_six(problem.p, k), alpha, load_six(problem.a_dv, k)))
    for k in other_dofs_of_island(model, problem):
        problem.v[k] += alpha * problem.dv[k]
        problem.p[k] += alpha * problem.a_dv[k]


@kernel
def move(model, problem, contacts, alpha):
    """v += alpha dv, and with it momenta and contact velocities."""
    move_dofs(model, problem, alpha)
    for contact in contacts_of_island(problem, contacts):
        contact.vc = add3(contact.vc, scale3(contact.dvc, alpha))


@kernel
def move_rows(problem, rows, alpha):
    """Velocities of rows += alpha times their changes along dv."""
    for row in rows_of_island(problem, rows):
        row.vc += alpha * row.dvc


@kernel
def advance(model, problem, contacts, rows, alpha):
    """v += alpha dv, and with it momenta and constraint velocities."""
    move(model, problem, contacts, alpha)
    move_rows(problem, rows, alpha)


@kernel
def resists(contact):
    """Whether the impulse of a contact depends on its velocity: whether it has one, and a term."""
    return in_any(contact.G[0] > 0.0) or in_any(contact.G[5] > 0.0)


@kernel
def apply_contact_impulses(model, problem, contacts, steps):
    """Impulses and G at the present vc, after a step of 1 along dv if `steps`; adds J^T gamma to `problem.j_gamma`.

    In loops of their own: no contact then waits for the roots and quotients of the one before it. By chunks: thousands
    of contacts do not fit into the cache, and would come from memory for each loop.
    """
    for begin, end in chunks_of_contacts(problem):
        if steps:
            for contact in contacts_between(contacts, begin, end):
                put_velocity(contact, problem.dv, DVC, False)
                contact.vc = add3(contact.vc, contact.dvc)
        for contact in contacts_between(contacts, begin, end):
            contact.gamma, contact.G = contact_impulse(model, contact, contact.vc)
        for contact in contacts_between(contacts, begin, end):
            if resists(contact):
                add_generalized_impulse(problem.j_gamma, contact, contact.gamma)


@kernel
def apply_row_impulses(problem, rows):
    """Impulses and G of the scalar rows at the present velocity; adds J^T gamma to `problem.j_gamma`."""
    for row in rows_of_island(problem, rows):
        row.gamma, row.G = row_impulse(row, row.vc)
        for a in range(row.width):
            problem.j_gamma[row.dofs[a]] += row.J[a] * row.gamma


@kernel
def optimality(model, problem, contacts, rows, steps):
    """Impulses and gradient at the iterate, and whether it will do (Castro, Permenter, Han 2022, eqs. 25 and 26).

    With `steps` the contacts first make the step of 1 that all else has made, see `full_step`.

    Returns:
        (excess, momentum, impulse): the square of the gradient over that of what is small against momentum and impulse;
        the squares of these two, weighted by the mobilities [J].
    """
    for k in sixes_of_island(model, problem):
        store_six(problem.j_gamma, k, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    for k in other_dofs_of_island(model, problem):
        problem.j_gamma[k] = 0.0
    apply_contact_impulses(model, problem, contacts, steps)
    apply_row_impulses(problem, rows)
    _, excess, momentum, impulse = weigh_gradient(model, problem)
    return excess, momentum, impulse


@kernel
def weigh_gradient(model, problem):
    """The gradient of momenta and impulses along dofs that are there; its square [J], and `optimality`."""
    residual = 0.0
    momentum = 0.0
    impulse = 0.0
    for k in sixes_of_island(model, problem):
        m, p, j = load_six(problem.mobility, k), load_six(problem.p, k), load_six(problem.j_gamma, k)
        g = sub_six(sub_six(p, load_six(problem.p_star, k)), j)
        store_six(problem.gradient, k, g)
        residual += dot_six(times_six(g, m), g)
        momentum += dot_six(times_six(p, m), p)
        impulse += dot_six(times_six(j, m), j)
    for k in other_dofs_of_island(model, problem):
        g_k = problem.p[k] - problem.p_star[k] - problem.j_gamma[k]
        problem.gradient[k] = g_k
        residual += g_k * g_k * problem.mobility[k]
        momentum += problem.p[k] * problem.p[k] * problem.mobility[k]
        impulse += problem.j_gamma[k] * problem.j_gamma[k] * problem.mobility[k]
    scale = impulse if impulse > momentum else momentum
    limit = model.relative_tolerance * root(scale) + model.absolute_tolerance
    return residual, residual / (limit * limit), momentum, impulse


@kernel(outline=True)
def evaluate(model, problem, contacts, rows):
    """`optimality`, compiled once for all but the first call of a step."""
    return optimality(model, problem, contacts, rows, False)


@kernel(outline=True)
def full_step(model, problem, contacts, rows):
    """`advance` by 1 and `optimality` there; the changes of the constraint velocities along dv are made on the way."""
    move_dofs(model, problem, 1.0)
    row_velocities(problem, rows, problem.dv, DVC)
    move_rows(problem, rows, 1.0)
    return optimality(model, problem, contacts, rows, True)


@kernel
def put_iterate(model, problem, contacts, rows):
    """Momenta and velocities of constraints where v is new."""
    multiply_A(model, problem, problem.v, problem.p)
    row_velocities(problem, rows, problem.v, VC)
    contact_velocities(problem, contacts, problem.v, VC)


@kernel
def evaluate_v(model, problem, contacts, rows):
    """`evaluate` where v is new."""
    put_iterate(model, problem, contacts, rows)
    return evaluate(model, problem, contacts, rows)


@kernel
def drop_slopes(model, problem):
    """v loses its derivatives; what the gradient then has of them, `keep_slopes` leaves."""
    for k in dofs_of_island(model, problem):
        problem.v[k] = value_of(problem.v[k])


@kernel
def keep_slopes(model, problem):
    """The gradient keeps its derivatives alone: a Newton step then gives v its own (implicit function theorem)."""
    for k in dofs_of_island(model, problem):
        problem.gradient[k] -= value_of(problem.gradient[k])


# ---- terms of constraints in the Hessian
#
# `address(where, constraint, i, j)` is that of the entry of columns i and j <= i of a constraint.


@kernel
def times_G(G, u):
    """G u; G is (xx, xy, yy, xz, yz, zz)."""
    return mul_symmetric((G[0], G[2], G[5], G[1], G[3], G[4]), u)


@kernel(outline=True)
def add_contact(contact, L, columns, where, address):
    """H += J^T G J of a contact of any two bodies, see `add_row`."""
    G = contact.G
    begin, end, first, last = columns
    for i in range(begin, end):
        Gu = times_G(G, column3(contact.J, 0, i))
        for j in range(first, min(i + 1, last)):
            L[address(where, contact, i, j)] += dot3(Gu, column3(contact.J, 0, j))


@kernel
def add_row(row, L, columns, where, address):
    """H += J^T G J of a scalar row; `columns` are where those of i begin and end, and those of j."""
    G = row.G
    begin, end, first, last = columns
    for i in range(begin, end):
        Gu = G * row.J[i]
        for j in range(first, min(i + 1, last)):
            L[address(where, row, i, j)] += Gu * row.J[j]


# ---- the Hessian of one tree


@kernel
def put_momentum_of_branches(model, problem, factor):
    """H = A."""
    L = factor.L
    first, _, end = dofs_of(model, problem)
    start = model.dofs[first].row_start
    if diagonal(model, end - 1) + 1 - start == problem.factor_size:  # constraints couple nothing that joints do not
        copy_numbers(L, 0, problem.A, start, problem.factor_size)
        return
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
def end_of_run(factor, contact, begin):
    """The column after the run that begins at one: entries of its columns follow each other in every row."""
    end = begin + 1
    while end < contact.width and factor.dofs[contact.dofs[end]].depth == factor.dofs[contact.dofs[end - 1]].depth + 1:
        end += 1
    return end


@kernel
def add_run(L, to, G_u, J, column, n):
    """L[to ..] += u^T G J of n columns from `column` on, the last ones four at a time."""
    x, y, z = G_u
    a = 0
    while (n - a) % 4 != 0:
        c = column + a
        L[to + a] += x * J[0, c] + y * J[1, c] + z * J[2, c]
        a += 1
    while a < n:
        c = column + a
        t = to + a
        p = x * J[0, c], x * J[0, c + 1], x * J[0, c + 2], x * J[0, c + 3]
        q = y * J[1, c], y * J[1, c + 1], y * J[1, c + 2], y * J[1, c + 3]
        r = z * J[2, c], z * J[2, c + 1], z * J[2, c + 2], z * J[2, c + 3]
        L[t], L[t + 1], L[t + 2], L[t + 3] = (
            L[t] + (p[0] + q[0] + r[0]),
            L[t + 1] + (p[1] + q[1] + r[1]),
            L[t + 2] + (p[2] + q[2] + r[2]),
            L[t + 3] + (p[3] + q[3] + r[3]),
        )
        a += 4


@kernel(outline=True)
def add_runs(contact, L, factor):
    """`add_contact` of a contact whose dofs are on one path, each run of its columns with those no farther down."""
    G, J, dofs = contact.G, contact.J, contact.dofs
    begin = 0
    while begin < contact.width:
        end = end_of_run(factor, contact, begin)
        above = 0
        while above < contact.width:
            end_above = end_of_run(factor, contact, above)
            if dofs[above] <= dofs[begin]:
                depth = factor.dofs[dofs[above]].depth
                for i in range(begin, end):
                    n = i + 1 if above == begin else end_above
                    to = factor.dofs[dofs[i]].row_start + depth
                    add_run(L, to, times_G(G, column3(J, 0, i)), J, above, n - above)
            above = end_above
        begin = end


@kernel
def add_two_columns(contact, L, factor):
    """`add_contact` of a contact that two dofs move, as that of limbs next but one to each other mostly is."""
    p, q = column3(contact.J, 0, 0), column3(contact.J, 0, 1)
    Gq = times_G(contact.G, q)
    L[diagonal(factor, contact.dofs[0])] += dot3(times_G(contact.G, p), p)
    L[in_branches(factor, contact, 1, 0)] += dot3(Gq, p)
    L[diagonal(factor, contact.dofs[1])] += dot3(Gq, q)


@kernel
def add_base(contact, L, base):
    """What a contact's first six columns, those of the first six dofs of a tree, do to each other; their triangle is at
    L[base].
    """
    G = contact.G
    x, y, z = load_three_sixes(contact.J, 0, FIRST)
    none = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    S = read_triangle(L, base)
    S = subtract_dyad(S, add_three_sixes(none, (-G[0], -G[1], -G[3]), x, y, z), x)
    S = subtract_dyad(S, add_three_sixes(none, (-G[1], -G[2], -G[4]), x, y, z), y)
    write_triangle(L, base, subtract_dyad(S, add_three_sixes(none, (-G[3], -G[4], -G[5]), x, y, z), z))


@kernel
def add_limb(contact, L, factor):
    """What the other columns of such a contact do to these and to each other."""
    G, J, dofs = contact.G, contact.J, contact.dofs
    x, y, z = load_three_sixes(J, 0, FIRST)
    for i in range(SIX, contact.width):
        row = factor.dofs[dofs[i]].row_start
        Gu = times_G(G, column3(J, 0, i))
        store_six(L, row, add_three_sixes(load_six(L, row), Gu, x, y, z))
        for j in range(SIX, i + 1):
            L[row + factor.dofs[dofs[j]].depth] += dot3(Gu, column3(J, 0, j))


@kernel(outline=True)
def assemble_branches(model, problem, contacts, rows, factor):
    """H = A + J^T G J."""
    L = factor.L
    put_momentum_of_branches(model, problem, factor)
    first, begin, _ = dofs_of(model, problem)
    for contact in contacts_of_island(problem, contacts):
        if resists(contact):
            if begin > first and contact.width >= SIX and contact.dofs[0] == first:
                add_base(contact, L, factor.dofs[first].row_start)
                add_limb(contact, L, factor)
            elif contact.width == 2:
                add_two_columns(contact, L, factor)
            else:
                add_runs(contact, L, factor)
    for row in rows_of_island(problem, rows):
        if row.G > 0.0:
            add_row(row, L, (0, row.width, 0, row.width), factor, in_branches)


# ---- the Hessian of several trees
#
# Column after column, each where it is factorised next: blocks of thousands of bodies do not fit into the cache.


@kernel
def put_momentum(model, problem, factor, k):
    """Column k of H = A: zero but for the diagonal block."""
    L, block = factor.L, factor.blocks[k]
    n = block.size
    end = problem.factor_size if k + 1 == problem.columns else factor.blocks[k + 1].diagonal
    for at in range(block.diagonal, end):
        L[at] = 0.0
    if block.triangle >= 0:
        put_packed_six(L, block.diagonal, problem.A, block.triangle)
        return
    first = model.trees[block.tree].first_dof
    for i in range(n):
        row = block.diagonal + i
        L[row + n * i] = problem.A[diagonal(model, first + i)]
        for j, at in dofs_above(model, first + i):
            L[row + n * (j - first)] = problem.A[at]


@kernel
def put_products(GJ, J, G, columns):
    """G times six columns of a contact's J, into memory: there any of them can be had as a factor of vectors."""
    x, y, z = load_three_sixes(J, 0, columns)
    store_six_of(GJ, 0, 0, sum_of_sixes((G[0], G[1], G[3]), x, y, z))
    store_six_of(GJ, 1, 0, sum_of_sixes((G[1], G[2], G[4]), x, y, z))
    store_six_of(GJ, 2, 0, sum_of_sixes((G[3], G[4], G[5]), x, y, z))


@kernel
def add_square(L, B, J, rows, GJ):
    """The block at B, 6 by 6, += J_rows^T GJ, of a contact's columns from `rows` on."""
    x, y, z = load_three_sixes(J, 0, rows)
    for j in range(SIX):
        to = load_six(L, B + SIX * j)
        store_six(L, B + SIX * j, add_three_sixes(to, (GJ[0, j], GJ[1, j], GJ[2, j]), x, y, z))


@kernel(outline=True)
def add_free_contact(factor, contact, k):
    """Column k of H += J^T G J of two free bodies, or of one and something fixed."""
    L, J, GJ, column = factor.L, contact.J, factor.spread, factor.blocks[k]
    of_B = contact.sixes > 1 and contact.tree_b == column.tree
    own, others = (SIX, FIRST) if of_B else (FIRST, SIX)
    put_products(GJ, J, contact.G, own)
    add_square(L, column.diagonal, J, own, GJ)
    if contact.sixes > 1:
        other = factor.place[contact.tree_a if of_B else contact.tree_b]
        if other > k:
            add_square(L, factor.blocks[other].at, J, others, GJ)


@kernel
def columns_in(model, factor, constraint, k):
    """Which columns i and j <= i of a constraint meet in column k of the matrix: (begin, end of i, begin, end of j)."""
    a, b = constraint.tree_a, constraint.tree_b
    if a < 0 or b < 0 or a == b:
        return 0, constraint.width, 0, constraint.width
    split = columns_of(model, constraint, a)
    own = factor.blocks[k].tree == a
    comes_first = factor.place[b if own else a] > k
    if own:
        return 0, constraint.width if comes_first else split, 0, split
    return split, constraint.width, 0 if comes_first else split, constraint.width


@kernel
def column_after(problem, factor, k):
    """The next column that is not held, or how many columns there are."""
    k += 1
    while k < problem.columns and factor.blocks[k].held != 0:
        k += 1
    return k


@kernel
def ask_for_terms(problem, contacts, factor, column):
    """Asks for the memory of what a column of free bodies is made of: thousands of them do not fit into the cache."""
    for i in range(0, 21, LINE):
        prefetch(problem.A, column.triangle + i)
    for i in range(column.constraints_begin, column.ends[CONTACTS]):
        c = factor.graph[i]
        prefetch(contacts.index, c, 0)
        prefetch(contacts.index, c, 5)
        prefetch(contacts.J, 3 * c, 0)
        prefetch(contacts.J, 3 * c, 8)
        prefetch(contacts.J, 3 * c + 1, 4)
        prefetch(contacts.J, 3 * c + 2, 0)
        prefetch(contacts.J, 3 * c + 2, 8)
        prefetch(contacts.state, c, 9)
        prefetch(contacts.state, c, 14)


@kernel(outline=True)
def put_column(model, problem, contacts, rows, factor, k):
    """Column k of H = A + J^T G J in its blocks, whose addresses then stand in `Block.at` of their rows."""
    L, column = factor.L, factor.blocks[k]
    for e in range(column.below_begin, column.below_end):
        factor.blocks[factor.entries[e].place].at = factor.entries[e].address
    put_momentum(model, problem, factor, k)
    after = column_after(problem, factor, k)
    if after < problem.columns and factor.blocks[after].triangle >= 0:
        ask_for_terms(problem, contacts, factor, factor.blocks[after])
    for i in range(column.constraints_begin, column.ends[CONTACTS]):
        contact = contacts[factor.graph[i]]
        if resists(contact):
            if contact.sixes > 0:
                add_free_contact(factor, contact, k)
            else:
                columns = columns_in(model, factor, contact, k)
                add_contact(contact, L, columns, places_of(model, factor, contact), in_blocks)
    for i in range(column.ends[CONTACTS], column.ends[ROWS]):
        row = rows[factor.graph[i]]
        if row.G > 0.0:
            add_row(row, L, columns_in(model, factor, row, k), places_of(model, factor, row), in_blocks)


@kernel(outline=True)
def factorise_blocks(model, problem, contacts, rows, factor):
    """The factor of H, each column being taken off the right-hand side while it is at hand; a status."""
    for k in columns_not_held(factor, problem.columns):
        put_column(model, problem, contacts, rows, factor, k)
        if factorise_column(factor, k) != SOLVED:
            return HESSIAN_NOT_POSITIVE
        eliminate_column(factor, k)
    return SOLVED


# ---- Newton's direction


@kernel
def newton_direction(model, problem, contacts, rows, factor, fresh):
    """dv = -H^-1 gradient over the participating dofs; a status.

    With the Hessian at the iterate if `fresh` is 1, else with the last factor.
    """
    if problem.along_branches == 0:
        put_right_hand_side(model, problem, factor)
        if fresh == 0:
            eliminate_columns(factor, problem.columns)
        elif factorise_blocks(model, problem, contacts, rows, factor) != SOLVED:
            return HESSIAN_NOT_POSITIVE
        substitute(factor, problem.columns)
        scatter(model, problem, factor)
        return SOLVED
    if fresh == 1:
        assemble_branches(model, problem, contacts, rows, factor)
        if factorise_branches(model, problem, factor) != SOLVED:
            return HESSIAN_NOT_POSITIVE
    solve_branches(model, problem, factor)
    return SOLVED
