"""Newton's step of an island whose few contacts press on one tree, with their impulses as the unknowns.

Rows that are ahead, whose impulses are linear, are part of a matrix that stays: A' = A + J_r^T G_r J_r, whose factor L
is there. With it velocities follow from the impulses lambda of the contacts,

    v = v* + A'^-1 J^T lambda,      vc = J v* + W lambda.

Newton's step of v, H dv = -gradient with H = A' + J^T G J, becomes

    (I + G W) dlambda = gamma - lambda,      dvc = W dlambda,

where W = J A'^-1 J^T is the Delassus operator (Moreau and Jean 1996), for the price of a matrix with three rows a
contact. It is made by the sparsity that branches induce (Featherstone 2010, "Exploiting sparsity in operational-space
dynamics").

Each law may be taken as linear about a velocity u of its own instead of vc:

    (I + G W) dlambda = gamma(u) - lambda - G (vc - u).

Before there are impulses that is v0. Friction that holds is known after one step to some digits, but as it hardly gives
way the slip is not, nor what the law makes of it: u is then the slip at which friction is lambda, and the next step
leaves the square of the error of lambda, not that of the slip. What slides has u = vc.
"""

from sheldrake.common._kernels.vec import (
    SIX,
    add3,
    add_six,
    axes,
    column3,
    compose,
    dot3,
    dot_six,
    eliminate_six,
    load_six,
    load_three_sixes,
    of_axes,
    packed_diagonal_six,
    read3,
    read9,
    rotate,
    rotate_back,
    scale3,
    store_six,
    store_six_of,
    sub3,
    substitute_six,
    subtract_scaled_six,
    sum_of_sixes,
    times_six,
    transpose,
    write3,
    write9,
)
from sheldrake.common.kernel import kernel
from sheldrake.multibody.contact_solvers._kernels.cost import times_G
from sheldrake.multibody.contact_solvers._kernels.factor import dofs_of, is_one_path, substitute_branches
from sheldrake.multibody.contact_solvers._kernels.laws import contact_impulse, holding_velocity
from sheldrake.multibody.contact_solvers._kernels.problem import (
    diagonal,
    dofs_above_from,
    is_chain_of_six,
    velocity_at_contact,
    with_drift,
)

AT_HAND = 1e-6  # (gradient over momentum or impulse)^2 up to which an iteration or two will do
CHEAP = 2  # contacts whose operator costs less than even one iteration saves


@kernel
def few_contacts(model, problem, contacts, rows, factor, relative):
    """How many contacts the island has, -1 where their impulses had better not be the unknowns.

    Of a free body only one is so few. `relative` is the square of the gradient at v0 over that of momentum or impulse.
    """
    n = problem.contacts_end - problem.contacts_begin
    if problem.trees_end - problem.trees_begin > 1 or (n > CHEAP and relative < AT_HAND):
        return -1
    t = problem.trees[problem.trees_begin].order
    if is_chain_of_six(model, t) and not touches_once(problem, contacts):
        return -1
    if 9 * n * (n + 1) // 2 > len(factor.small) or 3 * n > model.trees[t].num_dofs:
        return -1
    for place in range(problem.rows_begin, problem.rows_end):
        r = rows[place].order
        if r >= problem.rows_ahead and rows[r].G > 0.0:
            return -1
    return n


@kernel
def contact_at(problem, contacts, c):
    """The island's contact c."""
    return contacts[contacts[problem.contacts_begin + c].order]


@kernel
def touches_once(problem, contacts):
    """Whether an island of one tree is a body, moved by six dofs, with one contact and no rows."""
    alone = problem.contacts_end - problem.contacts_begin == 1 and problem.rows_end == problem.rows_begin
    return alone and contact_at(problem, contacts, 0).sixes == 1


# ---- W


@kernel
def put_column3(A, r, k, u):
    """Column k of the three rows r, r + 1, r + 2."""
    A[r, k], A[r + 1, k], A[r + 2, k] = u


@kernel
def limb(model, contact, begin, end):
    """The first dof, from `begin` on, that the impulse of a contact pushes, and the one after the last."""
    if contact.dofs[contact.width - 1] < begin:
        return begin, begin
    if not is_one_path(model, contact):
        return begin, end
    first = contact.dofs[contact.width - 1]
    last = first
    if model.dofs[contact.dofs[0]].depth == 0:  # the path is all there
        return contact.dofs[model.dofs[begin].depth], last + 1
    while model.dofs[first].parent >= begin:
        first = model.dofs[first].parent
    return first, last + 1


@kernel
def eliminate_base(model, problem, factor, r, first, low, high):
    """The columns of the six dofs that all others hang on, those of the limb being eliminated."""
    Y, L = factor.spread, problem.L
    x, y, z = load_three_sixes(Y, r, first)
    for k in range(high - 1, low - 1, -1):
        row = load_six(L, model.dofs[k].row_start)
        x = subtract_scaled_six(x, Y[r, k], row)
        y = subtract_scaled_six(y, Y[r + 1, k], row)
        z = subtract_scaled_six(z, Y[r + 2, k], row)
    at = model.dofs[first].row_start
    store_six_of(Y, r, first, eliminate_six(L, at, x))
    store_six_of(Y, r + 1, first, eliminate_six(L, at, y))
    store_six_of(Y, r + 2, first, eliminate_six(L, at, z))


@kernel(outline=True)
def eliminate_contact(model, problem, factor, contact, r, first, begin, end):
    """J L^-1 of a contact, into rows r to r + 2: columns of the base, `first` to `begin` - 1, and of its limb."""
    Y, L = factor.spread, problem.L
    low, high = limb(model, contact, begin, end)
    for k in range(first, begin):
        put_column3(Y, r, k, (0.0, 0.0, 0.0))
    for k in range(low, high):
        put_column3(Y, r, k, (0.0, 0.0, 0.0))
    for a in range(contact.width):
        put_column3(Y, r, contact.dofs[a], column3(contact.J, 0, a))
    for k in range(high - 1, low - 1, -1):
        y = column3(Y, r, k)
        for i, at in dofs_above_from(model, k, begin):
            put_column3(Y, r, i, sub3(column3(Y, r, i), scale3(y, L[at])))
    if begin > first:
        eliminate_base(model, problem, factor, r, first, low, high)


@kernel
def add_dyad(W, a, b):
    """W + a b^T of a Mat3."""
    return (
        W[0] + a[0] * b[0],
        W[1] + a[0] * b[1],
        W[2] + a[0] * b[2],
        W[3] + a[1] * b[0],
        W[4] + a[1] * b[1],
        W[5] + a[1] * b[2],
        W[6] + a[2] * b[0],
        W[7] + a[2] * b[1],
        W[8] + a[2] * b[2],
    )


@kernel
def block_at(factor, c, e):
    """Address of the block of W of contacts c and e <= c."""
    return 9 * (c * (c + 1) // 2 + e)


@kernel
def delassus_of_base(factor, e, first, x, y, z):
    """The part of the six dofs that all others hang on in W of two contacts, x, y, z being the rows of one, over D."""
    u, v, w = load_three_sixes(factor.spread, 3 * e, first)
    return (
        dot_six(x, u), dot_six(x, v), dot_six(x, w),
        dot_six(y, u), dot_six(y, v), dot_six(y, w),
        dot_six(z, u), dot_six(z, v), dot_six(z, w),
    )  # fmt: skip


@kernel(outline=True)
def delassus_row(model, problem, contacts, factor, c, first, begin, end):
    """W of contact c and all up to it: what both push is the base, and a limb if they are on the same one."""
    Y, L = factor.spread, problem.L
    low, high = limb(model, contact_at(problem, contacts, c), begin, end)
    x = y = z = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    if begin > first:
        m = packed_diagonal_six(L, model.dofs[first].row_start)
        x, y, z = load_three_sixes(Y, 3 * c, first)
        x, y, z = times_six(m, x), times_six(m, y), times_six(m, z)
    for e in range(c + 1):
        W = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        if begin > first:
            W = delassus_of_base(factor, e, first, x, y, z)
        low_e, high_e = limb(model, contact_at(problem, contacts, e), begin, end)
        for k in range(max(low, low_e), min(high, high_e)):
            W = add_dyad(W, scale3(column3(Y, 3 * c, k), L[diagonal(model, k)]), column3(Y, 3 * e, k))
        write9(factor.delassus, block_at(factor, c, e), W)


@kernel
def times_W(factor, n, c, x):
    """The three rows of contact c in W x."""
    u = (0.0, 0.0, 0.0)
    for e in range(c + 1):
        u = add3(u, rotate(read9(factor.delassus, block_at(factor, c, e)), read3(x, 3 * e)))
    for e in range(c + 1, n):
        u = add3(u, rotate_back(read9(factor.delassus, block_at(factor, e, c)), read3(x, 3 * e)))
    return u


# ---- a step
#
# G = L D L^T makes the matrix symmetric: (D^-1 + L^T W L) s = L^T W r gives dlambda = r - L s. Where D is zero, s is.

SINGULAR = 1e-14  # of an entry of G: what elimination leaves of it is round-off
RIGID = 1e60  # 1/D where D is zero


@kernel
def inverse(x, of):
    """1/x of what elimination left of `of`, 0 where that is round-off."""
    return 1.0 / x if x > SINGULAR * of else 0.0 * x


@kernel
def put_root(factor, c, G):
    """(L_10, L_20, L_21) and 1/D of a contact's G."""
    xx, xy, yy, xz, yz, zz = G
    a = inverse(xx, xx)
    yx, zx = xy * a, xz * a
    b = inverse(yy - yx * xy, yy)
    zy = (yz - zx * xy) * b
    d = inverse(zz - zx * xz - zy * (yz - zx * xy), zz)
    store_six(factor.root, SIX * c, (yx, zx, zy, a, b, d))


@kernel
def times_root(L, s):
    return (s[0], L[0] * s[0] + s[1], L[1] * s[0] + L[2] * s[1] + s[2])


@kernel
def root_times(L, u):
    """L^T u."""
    return (u[0] + L[0] * u[1] + L[1] * u[2], u[1] + L[2] * u[2], u[2])


@kernel
def projected(factor, c, e):
    """L^T W L of contacts c and e <= c."""
    L_c, L_e = load_six(factor.root, SIX * c), load_six(factor.root, SIX * e)
    x, y, z = axes(read9(factor.delassus, block_at(factor, c, e)))
    x = add3(x, add3(scale3(y, L_e[0]), scale3(z, L_e[1])))
    y = add3(y, scale3(z, L_e[2]))
    return of_axes(root_times(L_c, x), root_times(L_c, y), root_times(L_c, z))


@kernel
def or_rigid(a):
    return a if a > 0.0 else RIGID + 0.0 * a


@kernel
def put_blocks(factor, n):
    """The lower blocks of D^-1 + L^T W L."""
    for c in range(n):
        for e in range(c):
            write9(factor.small, block_at(factor, c, e), projected(factor, c, e))
        xx, xy, xz, yx, yy, yz, zx, zy, zz = projected(factor, c, c)
        _, _, _, a, b, d = load_six(factor.root, SIX * c)
        block = (xx + or_rigid(a), xy, xz, yx, yy + or_rigid(b), yz, zx, zy, zz + or_rigid(d))
        write9(factor.small, block_at(factor, c, c), block)


@kernel
def inverse_block(A):
    """A^-1 of a symmetric Mat3, by cofactors."""
    a, _, _, b, c, _, d, e, f = A
    xx, xy, xz = c * f - e * e, d * e - b * f, b * e - c * d
    s = 1.0 / (a * xx + b * xy + d * xz)
    xx, xy, xz, yy, yz, zz = s * xx, s * xy, s * xz, s * (a * f - d * d), s * (b * d - a * e), s * (a * c - b * b)
    return (xx, xy, xz, xy, yy, yz, xz, yz, zz)


@kernel
def sub9(A, B):
    return (
        A[0] - B[0],
        A[1] - B[1],
        A[2] - B[2],
        A[3] - B[3],
        A[4] - B[4],
        A[5] - B[5],
        A[6] - B[6],
        A[7] - B[7],
        A[8] - B[8],
    )


@kernel(outline=True)
def factorise_impulses(problem, contacts, factor, n):
    """The roots of all G, and the factor of D^-1 + L^T W L: inverses of its pivots, and what goes below them."""
    for c in range(n):
        put_root(factor, c, contact_at(problem, contacts, c).G)
    put_blocks(factor, n)
    S = factor.small
    for j in range(n):
        D = inverse_block(read9(S, block_at(factor, j, j)))
        write9(S, block_at(factor, j, j), D)
        for i in range(n - 1, j, -1):
            F = compose(read9(S, block_at(factor, i, j)), D)
            for k in range(j + 1, i + 1):
                at = block_at(factor, i, k)
                write9(S, at, sub9(read9(S, at), compose(F, transpose(read9(S, block_at(factor, k, j))))))
            write9(S, block_at(factor, i, j), F)


@kernel
def substitute_impulses(factor, t, n):
    """t <- S^-1 t of the matrix that `factorise_impulses` has factorised."""
    S = factor.small
    for i in range(1, n):
        x = read3(t, 3 * i)
        for j in range(i):
            x = sub3(x, rotate(read9(S, block_at(factor, i, j)), read3(t, 3 * j)))
        write3(t, 3 * i, x)
    for j in range(n - 1, -1, -1):
        x = rotate(read9(S, block_at(factor, j, j)), read3(t, 3 * j))
        for i in range(j + 1, n):
            x = sub3(x, rotate_back(read9(S, block_at(factor, i, j)), read3(t, 3 * i)))
        write3(t, 3 * j, x)


@kernel(outline=True)
def step_of_impulses(problem, contacts, factor, n, goes_on):
    """Takes Newton's step with the last factor, impulses lambda and contacts' velocities; what it gains at most [J].

    Unless `goes_on` is zero: in lanes, that of a world that has come to its end and waits for others.
    """
    t = factor.rhs
    for c in range(n):
        write3(t, 3 * c, root_times(load_six(factor.root, SIX * c), read3(factor.pushed, 3 * c)))
    substitute_impulses(factor, t, n)
    for c in range(n):
        push = times_root(load_six(factor.root, SIX * c), read3(t, 3 * c))
        change = sub3(read3(factor.residual, 3 * c), push)
        write3(factor.change, 3 * c, change)
        impulse = read3(factor.impulse, 3 * c)
        write3(factor.impulse, 3 * c, add3(impulse, change) if goes_on > 0.0 else impulse)
    gain = 0.0
    for c in range(n):
        contact = contact_at(problem, contacts, c)
        dvc = times_W(factor, n, c, factor.change)
        contact.vc = add3(contact.vc, dvc) if goes_on > 0.0 else contact.vc
        gain += dot3(read3(factor.residual, 3 * c), dvc)
    return gain


@kernel(outline=True)
def evaluate_impulses(model, problem, contacts, factor, n):
    """The laws' impulses and G where they are taken as linear, and the residual; gradient^T A'^-1 gradient [J]."""
    for c in range(n):
        contact = contact_at(problem, contacts, c)
        impulse = read3(factor.impulse, 3 * c)
        W = read9(factor.delassus, block_at(factor, c, c))
        u = holding_velocity(model, contact, impulse, 0.5 * (W[0] + W[4]))
        contact.gamma, contact.G = contact_impulse(model, contact, u)
        left = times_G(contact.G, sub3(contact.vc, u))
        write3(factor.residual, 3 * c, sub3(sub3(contact.gamma, impulse), left))
    return push_residual(factor, n)


@kernel
def push_residual(factor, n):
    """W times the residual; that times the residual [J]."""
    total = 0.0
    for c in range(n):
        u = times_W(factor, n, c, factor.residual)
        write3(factor.pushed, 3 * c, u)
        total += dot3(u, read3(factor.residual, 3 * c))
    return total


@kernel(outline=True)
def start_impulses(model, problem, contacts, factor, n):
    """W, no impulse as yet, and the residual with laws linear about v0; gradient^T diag(1/A) gradient there [J]."""
    first, begin, end = dofs_of(model, problem)
    total = 0.0
    for k in range(first, end):
        total += problem.gradient[k] * problem.gradient[k] * problem.mobility[k]
    for c in range(n):
        contact = contact_at(problem, contacts, c)
        eliminate_contact(model, problem, factor, contact, 3 * c, first, begin, end)
        v0 = contact.vc
        contact.vc = with_drift(contact, velocity_at_contact(contact, problem.v_star), True)
        write3(factor.impulse, 3 * c, (0.0, 0.0, 0.0))
        write3(factor.residual, 3 * c, sub3(contact.gamma, times_G(contact.G, sub3(contact.vc, v0))))
        delassus_row(model, problem, contacts, factor, c, first, begin, end)
    push_residual(factor, n)
    return total


@kernel(outline=True)
def put_velocities(model, problem, contacts, factor, n):
    """v of lambda."""
    first, begin, end = dofs_of(model, problem)
    for k in range(first, end):
        problem.v[k] = problem.v_star[k]
    if n == 0:
        return
    for k in range(first, end):
        factor.rhs[k] = 0.0
    for c in range(n):
        push = read3(factor.impulse, 3 * c)
        low, high = limb(model, contact_at(problem, contacts, c), begin, end)
        for k in range(first, begin):
            factor.rhs[k] += dot3(column3(factor.spread, 3 * c, k), push)
        for k in range(low, high):
            factor.rhs[k] += dot3(column3(factor.spread, 3 * c, k), push)
    substitute_branches(model, problem.L, factor.rhs, problem.dv, first, begin, end)
    for k in range(first, end):
        problem.v[k] += problem.dv[k]


# ---- one contact of a free body
#
# W of a point of a free body has an inverse: with velocities of the contact as the unknowns, what takes part in a step
# are three numbers, (W^-1 + G) dvc = gamma - lambda. The functions are those above for n = 1.


@kernel(outline=True)
def start_impulse(model, problem, contacts, factor, n):
    """`start_impulses`, and W^-1."""
    contact = contact_at(problem, contacts, 0)
    first, L = contact.dofs[0], problem.L
    at = model.dofs[first].row_start
    x, y, z = load_three_sixes(contact.J, 0, 0)
    x, y, z = eliminate_six(L, at, x), eliminate_six(L, at, y), eliminate_six(L, at, z)
    m = packed_diagonal_six(L, at)
    mx, my = times_six(m, x), times_six(m, y)
    xy, xz, yz = dot_six(mx, y), dot_six(mx, z), dot_six(my, z)
    W = (dot_six(mx, x), xy, xz, xy, dot_six(my, y), yz, xz, yz, dot_six(times_six(m, z), z))
    write9(factor.delassus, 0, W)
    write9(factor.small, 0, inverse_block(W))
    v0 = contact.vc
    contact.vc = with_drift(contact, velocity_at_contact(contact, problem.v_star), True)
    write3(factor.impulse, 0, (0.0, 0.0, 0.0))
    write3(factor.residual, 0, sub3(contact.gamma, times_G(contact.G, sub3(contact.vc, v0))))
    g = load_six(problem.gradient, first)
    return dot_six(times_six(g, g), load_six(problem.mobility, first))


@kernel
def no_factor(problem, contacts, factor, n):
    """In the place of `factorise_impulses`: three rows are solved in each step."""


@kernel(outline=True)
def step_of_impulse(problem, contacts, factor, n, goes_on):
    """`step_of_impulses`."""
    contact = contact_at(problem, contacts, 0)
    W_inverse, residual, impulse = read9(factor.small, 0), read3(factor.residual, 0), read3(factor.impulse, 0)
    xx, xy, yy, xz, yz, zz = contact.G
    a, b, d, _, c, e, _, _, f = W_inverse
    b, d, e = b + xy, d + xz, e + yz
    dvc = rotate(inverse_block((a + xx, b, d, b, c + yy, e, d, e, f + zz)), residual)
    contact.vc = add3(contact.vc, dvc) if goes_on > 0.0 else contact.vc
    write3(factor.impulse, 0, add3(impulse, rotate(W_inverse, dvc)) if goes_on > 0.0 else impulse)
    return dot3(residual, dvc)


@kernel(outline=True)
def evaluate_impulse(model, problem, contacts, factor, n):
    """`evaluate_impulses`."""
    contact = contact_at(problem, contacts, 0)
    W, impulse = read9(factor.delassus, 0), read3(factor.impulse, 0)
    u = holding_velocity(model, contact, impulse, 0.5 * (W[0] + W[4]))
    contact.gamma, contact.G = contact_impulse(model, contact, u)
    residual = sub3(sub3(contact.gamma, impulse), times_G(contact.G, sub3(contact.vc, u)))
    write3(factor.residual, 0, residual)
    return dot3(rotate(W, residual), residual)


@kernel(outline=True)
def go_to_impulse(model, problem, contacts, rows, factor, n):
    """The iterate whose velocity is that of the impulse; the contact's is known."""
    contact = contact_at(problem, contacts, 0)
    first, L = contact.dofs[0], problem.L
    at = model.dofs[first].row_start
    x, y, z = load_three_sixes(contact.J, 0, 0)
    push = sum_of_sixes(read3(factor.impulse, 0), x, y, z)
    store_six(problem.p, first, add_six(push, load_six(problem.p_star, first)))
    dv = substitute_six(L, at, eliminate_six(L, at, push))
    store_six(problem.v, first, add_six(dv, load_six(problem.v_star, first)))
