"""Inertias, bias forces, inverse dynamics (RNEA) and the mass matrix (CRBA).

Roy Featherstone, Rigid Body Dynamics Algorithms, Springer 2008: tables 5.1 and 6.2, in one world-aligned frame per
tree so that nothing is transformed between bodies.
"""

from sheldrake.common._kernels.generic import is_positive, is_zero
from sheldrake.common._kernels.vec import (
    SIX,
    add3,
    add6,
    add_inertia,
    cross3,
    cross_force,
    dot3,
    dot6,
    eliminate_six,
    factorise_triangle,
    load6,
    load_six,
    mul_inertia,
    pivots_of_two,
    read3,
    read_symmetric,
    read_triangle,
    rotate,
    rotate_symmetric,
    scale3,
    scale6,
    store6,
    store_six,
    sub3,
    sub6,
    substitute_six,
    subtract_dot_six,
    subtract_scaled,
    subtract_scaled_six,
    subtract_two_scaled,
    take_row,
    write3,
    write4,
    write6,
    write_triangle,
)
from sheldrake.common.kernel import Matrix, Vector, kernel
from sheldrake.multibody.tree._kernels.kinematics import from_root, velocity_at
from sheldrake.multibody.tree._kernels.model import FREE, TreeModel, TreeWork


@kernel(top=True, short_loops=True)
def body_inertias(model: TreeModel, p: Vector, work: TreeWork) -> None:
    """Fills `inertia` and (added) `gravity` from `X_WB` and the parameters; start of every algorithm below."""
    for b in range(1, len(model.bodies)):
        body = work[b]
        added = model.bodies[b].gravity
        if added >= 0:
            body.added_g_W = read3(p, added)
        at = model.bodies[b].inertia
        mass = p[at]
        if is_zero(mass):
            body.inertia = (mass, (mass, mass, mass), (mass, mass, mass, mass, mass, mass))
        else:
            R_WB = body.R_WB
            c_Bo_W = rotate(R_WB, read3(p, at + 1))
            G_BBo_W = rotate_symmetric(R_WB, read_symmetric(p, at + 4))
            if model.bodies[b].root == b:
                body.inertia = (mass, scale3(c_Bo_W, mass), scale_symmetric(G_BBo_W, mass))
            else:
                p_RootB = from_root(model, work, b, body.p_WB)
                G = shift_unit_inertia(G_BBo_W, c_Bo_W, p_RootB)
                h = scale3(add3(c_Bo_W, p_RootB), mass)
                body.inertia = (mass, h, scale_symmetric(G, mass))


@kernel
def gravity_on(model, work, b):
    """What acts on a body, in W [m/s²]."""
    return add3(model.gravities[b].g_W, work[b].added_g_W)


@kernel
def scale_symmetric(I, s):
    return (I[0] * s, I[1] * s, I[2] * s, I[3] * s, I[4] * s, I[5] * s)


@kernel
def shift_unit_inertia(G, c, r):
    """Unit inertia about a point that sees the body origin at r; c is the centre of mass from the body origin."""
    b = add3(r, scale3(c, 2.0))
    trace = dot3(r, b)
    x, y, z = r
    return (
        G[0] + trace - x * b[0],
        G[1] + trace - y * b[1],
        G[2] + trace - z * b[2],
        G[3] - x * y - x * c[1] - y * c[0],
        G[4] - x * z - x * c[2] - z * c[0],
        G[5] - y * z - y * c[2] - z * c[1],
    )


@kernel
def carried_inertias(model, work):
    """Fills `composite` of bodies that are their own carriers: their inertia and that of what they carry."""
    for b in range(1, len(model.bodies)):
        carrier = model.bodies[b].carrier
        if carrier == b:
            work[b].composite = work[b].inertia
        elif not is_zero(work[b].mass):
            work[carrier].composite = add_inertia(work[carrier].composite, work[b].inertia)


@kernel
def bias_term(model: TreeModel, work: TreeWork, gravity_scale: float) -> None:
    """Fills `bias` = C(q, v) v - gravity_scale * tau_g(q) from `V`, `A` and `inertia`.

    With scale 1 the equation of motion reads M vdot + bias = applied forces; with 0 it is Drake's CalcBiasTerm. Leaves
    `composite` as `carried_inertias` does.
    """
    carried_inertias(model, work)
    for b in range(1, len(model.bodies)):
        if model.bodies[b].tree >= 0 and model.bodies[b].carrier == b:
            I = work[b].composite
            mass, _, _ = I
            if is_zero(mass):  # a link that stands for a frame
                work[b].F = ((mass, mass, mass), (mass, mass, mass))
            else:
                work[b].F = inertial_force(model, work, b, I, work[b].A_WB, gravity_scale)
    project(model, work, work.bias, True)


@kernel
def inertial_force(model, work, b, I, A_WB, gravity_scale):
    """The force that moves what has inertia I, and moves with a body, with acceleration A.

    Gravity aside: I (A - a_g) + V x* I V (table 5.1).
    """
    V_WB = work[b].V_WB
    alpha, a = A_WB
    A = (alpha, sub3(a, scale3(gravity_on(model, work, b), gravity_scale)))
    return add6(mul_inertia(I, A), cross_force(V_WB, mul_inertia(I, V_WB)))


@kernel
def gravity_forces(model: TreeModel, work: TreeWork) -> None:
    """Fills `F` with the forces of gravity."""
    for b in range(1, len(model.bodies)):
        body = work[b]
        g_W = gravity_on(model, work, b)
        body.F = (cross3(body.first_moment, g_W), scale3(g_W, body.mass))


@kernel
def project_forces(model: TreeModel, work: TreeWork, tau: Vector) -> None:
    """tau = Sᵀ times the sum of `F` over all bodies outboard of a joint; turns `F` into those sums, tip to base.

    The second loop of table 5.1.
    """
    project(model, work, tau, False)


@kernel
def carrier_of(model, b, carried):
    """The body that carries b, if what is carried acts on it; else b itself."""
    return model.bodies[b].carrier if carried else b


@kernel
def project(model, work, tau, carried):
    """`project_forces`; if what is carried acts on its carrier, of forces on carriers alone."""
    outboard = work[0].F  # of the body before this one, and on which it acts
    to = -1
    for b in range(len(model.bodies) - 1, 0, -1):
        if carrier_of(model, b, carried) != b:
            continue
        body = model.bodies[b]
        dof = body.first_dof
        F = work[b].F
        if to == b:
            F = add6(F, outboard)
            work[b].F = F
        elif to >= 0:
            work[to].F = add6(work[to].F, outboard)
        to = -1
        if body.kind == FREE:
            write6(tau, dof, F)
        else:
            for k in range(dof, dof + body.num_dofs):
                tau[k] = dot6(work.dofs[k].S, F)
            if model.bodies[body.parent].root > 0:
                outboard, to = F, carrier_of(model, body.parent, carried)


@kernel
def accelerations(model: TreeModel, work: TreeWork, vdot: Vector, A_out: Matrix) -> None:
    """Spatial accelerations about `root` for given vdot, shape (num_bodies, 6); see `BodyAcceleration`."""
    for b in range(1, len(model.bodies)):
        body = model.bodies[b]
        A_vdot = sub6(load6(A_out, body.parent), work[body.parent].A_WB)
        for k in range(body.first_dof, body.first_dof + body.num_dofs):
            A_vdot = add6(A_vdot, scale6(work.dofs[k].S, vdot[k]))
        store6(A_out, b, add6(work[b].A_WB, A_vdot))


@kernel
def body_accelerations(model: TreeModel, work: TreeWork, A: Matrix) -> None:
    """Turns accelerations of velocity fields about `root` into accelerations of the body origins, in place."""
    for b in range(1, len(model.bodies)):
        body = work[b]
        alpha, a = load6(A, b)
        w_WB, v_WBo = velocity_at(model, work, b, body.p_WB)
        p_RootB = from_root(model, work, b, body.p_WB)
        a_WBo = add3(add3(a, cross3(alpha, p_RootB)), cross3(w_WB, v_WBo))
        store6(A, b, (alpha, a_WBo))


@kernel
def reflected_inertia(model: TreeModel, p: Vector, i: int) -> float:
    """gear² times rotor inertia of an actuator [kg m², or kg for a prismatic joint]."""
    actuator = model.actuators[i]
    gear = p[actuator.gear]
    return gear * gear * p[actuator.rotor]


@kernel
def mass_matrix(model: TreeModel, p: Vector, work: TreeWork, M: Vector) -> None:
    """Fills `composite` of carriers, and the packed M with reflected inertias of actuators, from `S` and `inertia`."""
    carried_inertias(model, work)
    mass_matrix_of_carried(model, p, work, M)


@kernel
def mass_matrix_of_carried(model, p, work, M):
    """`mass_matrix` where `composite` is as `carried_inertias` leaves it.

    I_parent += I_i, tip to base; then M_ij = S_jᵀ I_i S_i for each dof j on the way from i to the base (table 6.2).
    """
    outboard = work[0].composite  # of the body before this one, and by which it is moved
    to = -1
    for b in range(len(model.bodies) - 1, 0, -1):
        body = model.bodies[b]
        if body.tree < 0 or body.carrier != b:
            continue
        dof = body.first_dof
        I = work[b].composite
        if to == b:
            I = add_inertia(I, outboard)
            work[b].composite = I
        elif to >= 0:
            work[to].composite = add_inertia(work[to].composite, outboard)
        to = -1
        if body.kind == FREE:
            store_free_rows(M, model.dofs[dof].row, I)
        else:
            first, begin, _end = dofs_beyond_base(model, body.tree)
            for k in range(dof, dof + body.num_dofs):
                store_row(model, work, M, k, mul_inertia(I, work.dofs[k].S), first, begin)
        if model.bodies[body.parent].root > 0:
            outboard, to = I, model.bodies[body.parent].carrier
    for i in range(len(model.actuators)):
        driven = model.dofs[model.actuators[i].dof]
        M[driven.row + driven.depth] += reflected_inertia(model, p, i)


@kernel
def store_row(model, work, M, k, F, first, begin):
    """The packed row of dof k, which at unit acceleration needs the spatial force F.

    Dofs `first` to `begin` - 1 of its tree are of a free body, whose S are unit vectors.
    """
    if begin > first:
        write6(M, model.dofs[k].row, F)
    end = k
    while end >= begin:
        run = max(model.dofs[end].run, begin)
        shift = model.dofs[k].row + model.dofs[run].depth - run
        for j in range(run, end + 1):
            M[shift + j] = dot6(work.dofs[j].S, F)
        end = model.dofs[run].parent


@kernel
def store_free_rows(M, row, I):
    """The six packed rows of a free body: [J, .; h x, mass]."""
    mass, (x, y, z), (xx, yy, zz, xy, xz, yz) = I
    zero = mass - mass
    write3(M, row, (xx, xy, yy))
    write3(M, row + 3, (xz, yz, zz))
    write4(M, row + 6, (zero, z, -y, mass))
    write3(M, row + 10, (-z, zero, x))
    M[row + 13], M[row + 14] = zero, mass
    write6(M, row + 15, ((y, -x, zero), (zero, zero, mass)))


# ---- the mass matrix's factor L^T D L
#
# Featherstone 2008, section 6.5; layout in `model`.


@kernel
def dofs_beyond_base(model, t):
    """Dofs of a tree: the first, the first after those of a free body that all hang on, and the one after the last."""
    tree = model.trees[t]
    first = tree.first_dof
    free = tree.num_dofs >= SIX and model.bodies[model.dofs[first].body].kind == FREE
    return first, first + SIX if free else first, first + tree.num_dofs


@kernel
def ltdl(model: TreeModel, L: Vector) -> int:
    """Replaces a packed symmetric matrix by its factor: 1/D on the diagonal, the unit lower triangle below it.

    Returns:
        -1, or the dof whose pivot is not positive (the factor is then of no use).
    """
    bad = -1
    for t in range(len(model.trees) - 1, -1, -1):
        first, begin, end = dofs_beyond_base(model, t)
        k = end - 1
        while k >= begin:
            above = k - 1
            if above >= begin and model.dofs[k].parent == above:  # nothing else hangs on it that is not taken yet
                bad = invert_two_pivots(model, L, k, above, bad)
                take_two_from_rows_above(model, L, k, above, begin)
                k -= 2
            else:
                bad = invert_pivot(model, L, k, bad)
                take_from_rows_above(model, L, k, begin)
                k -= 1
        if begin > first:
            row = model.dofs[first].row
            S = read_triangle(L, row)
            for k in range(end - 1, begin - 1, -1):
                S = take_row(L, model.dofs[k].row, L[model.dofs[k].row + model.dofs[k].depth], S)
            write_triangle(L, row, S)
            pivot_of_6 = factorise_triangle(L, row)
            if pivot_of_6 >= 0:
                bad = first + pivot_of_6
    return bad


@kernel
def invert_pivot(model, L, k, bad):
    """Puts 1/D on the diagonal of row k; k if D is not positive, else `bad`."""
    pivot = model.dofs[k].row + model.dofs[k].depth
    if not is_positive(L[pivot]):
        bad = k
    L[pivot] = 1.0 / L[pivot]
    return bad


@kernel
def invert_two_pivots(model, L, k, j, bad):
    """`invert_pivot` of row k, and of row j, its parent's, from which row k is taken."""
    D, both = pivots_of_two(L, model.dofs[k].row, model.dofs[j].row, model.dofs[j].depth)
    if not is_positive(both):
        bad = j
    return bad if is_positive(D) else k


@kernel
def take_from_row(model, L, k, i):
    """Takes row k, with 1/D on its diagonal, from row i on the way to the base."""
    row_k, depth = model.dofs[k].row, model.dofs[i].depth
    a = L[row_k + depth] * L[row_k + model.dofs[k].depth]
    subtract_scaled(L, model.dofs[i].row, a, row_k, depth + 1)
    L[row_k + depth] = a


@kernel
def take_from_rows_above(model, L, k, begin):
    """`take_from_row` for all rows on the way to the base, down to dof `begin`."""
    i = model.dofs[k].parent
    while i >= begin:
        run = max(model.dofs[i].run, begin)
        for above in range(i, run - 1, -1):
            take_from_row(model, L, k, above)
        i = model.dofs[run].parent


@kernel
def take_two_from_rows_above(model, L, k, j, begin):
    """`take_from_rows_above` for row k and then for row j, its parent's, each number being written once."""
    row_k, row_j = model.dofs[k].row, model.dofs[j].row
    r_k, r_j = L[row_k + model.dofs[k].depth], L[row_j + model.dofs[j].depth]
    i = model.dofs[j].parent
    while i >= begin:
        dof_i = model.dofs[i]
        row_i, depth, run = dof_i.row, dof_i.depth, max(dof_i.run, begin)
        for _ in range(run, i + 1):  # from the end of the run to its beginning
            a, b = L[row_k + depth] * r_k, L[row_j + depth] * r_j
            subtract_two_scaled(L, row_i, a, row_k, b, row_j, depth + 1)
            L[row_k + depth], L[row_j + depth] = a, b
            row_i -= depth
            depth -= 1
        i = model.dofs[run].parent


@kernel
def ltdl_solve(model: TreeModel, L: Vector, x: Vector) -> None:
    """Replaces x, shape (nv,), by the solution of the factored matrix times itself = x."""
    for t in range(len(model.trees)):
        first, begin, end = dofs_beyond_base(model, t)
        for k in range(end - 1, begin - 1, -1):
            row = model.dofs[k].row
            x_k = x[k]
            i = model.dofs[k].parent
            while i >= begin:
                run = max(model.dofs[i].run, begin)
                column = row + model.dofs[run].depth - run
                for j in range(run, i + 1):
                    x[j] -= L[column + j] * x_k
                i = model.dofs[run].parent
        if begin > first:
            base = load_six(x, first)
            for k in range(end - 1, begin - 1, -1):
                base = subtract_scaled_six(base, x[k], load_six(L, model.dofs[k].row))
            row = model.dofs[first].row
            store_six(x, first, substitute_six(L, row, eliminate_six(L, row, base)))
        for k in range(begin, end):
            x[k] = substitute_back(model, L, x, k, first, begin)


@kernel
def substitute_back(model, L, x, k, first, begin):
    """x of dof k from those of the dofs that it hangs on; the first ones, up to `begin`, are of a free body.

    That of its parent, the last one that is known, comes last.
    """
    row = model.dofs[k].row
    parent = model.dofs[k].parent
    x_k = x[k] * L[row + model.dofs[k].depth]
    if begin > first:
        x_k = subtract_dot_six(x_k, load_six(L, row), load_six(x, first))
    i = parent
    while i >= begin:
        run = max(model.dofs[i].run, begin)
        column = row + model.dofs[run].depth - run
        for j in range(run, min(i + 1, parent)):
            x_k -= L[column + j] * x[j]
        i = model.dofs[run].parent
    if parent >= begin:
        x_k -= L[row + model.dofs[parent].depth] * x[parent]
    return x_k


@kernel
def unpack(model: TreeModel, M: Vector, dense: Matrix) -> None:
    """Writes a packed symmetric matrix into a zeroed one, shape (nv, nv)."""
    for k in range(len(model.dofs)):
        row = model.dofs[k].row
        i = k
        while i >= 0:
            m = M[row + model.dofs[i].depth]
            dense[k, i] = m
            dense[i, k] = m
            i = model.dofs[i].parent
