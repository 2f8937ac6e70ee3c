"""Inertias, bias forces, inverse dynamics (RNEA) and the mass matrix (CRBA).

Roy Featherstone, Rigid Body Dynamics Algorithms, Springer 2008: tables 5.1 and 6.2, in one world-aligned frame per
tree so that nothing is transformed between bodies.
"""

from __future__ import annotations

from sheldrake.common._kernels.generic import is_zero
from sheldrake.common._kernels.vec import (
    add3,
    add6,
    add_inertia,
    cross3,
    cross_force,
    dot3,
    dot6,
    load6,
    mul_inertia,
    read3,
    read_symmetric,
    rotate,
    rotate_symmetric,
    scale3,
    scale6,
    store6,
    sub3,
    sub6,
    write3,
    write4,
    write6,
)
from sheldrake.common.kernel import Matrix, Vector, kernel
from sheldrake.multibody.tree._kernels.frames import from_root
from sheldrake.multibody.tree._kernels.kinematics import velocity_at
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
def bias_term(model: TreeModel, work: TreeWork, gravity_scale: float) -> None:
    """Fills `bias` = C(q, v) v - gravity_scale * tau_g(q) from `V`, `A` and `inertia`.

    With scale 1 the equation of motion reads M vdot + bias = applied forces; with 0 it is Drake's CalcBiasTerm.
    """
    for b in range(1, len(model.bodies)):
        if model.bodies[b].tree >= 0:
            work[b].F = inertial_force(model, work, b, work[b].A_WB, gravity_scale)
    project_forces(model, work, work.bias)


@kernel
def inertial_force(model, work, b, A_WB, gravity_scale):
    """The force that moves the body with acceleration A, gravity aside: I (A - a_g) + V x* I V (table 5.1)."""
    I = work[b].inertia
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
    for b in range(len(model.bodies) - 1, 0, -1):
        body = model.bodies[b]
        dof = body.first_dof
        F = work[b].F
        if body.kind == FREE:
            write6(tau, dof, F)
        else:
            for k in range(dof, dof + body.num_dofs):
                tau[k] = dot6(work.dofs[k].S, F)
            if model.bodies[body.parent].root > 0:
                parent = work[body.parent]
                parent.F = add6(parent.F, F)


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
def mass_matrix(model: TreeModel, p: Vector, work: TreeWork) -> None:
    """Fills `composite` and the packed `M` from `S` and `inertia`; reflected inertias of actuators included.

    I_parent += I_i, tip to base; then M_ij = S_jᵀ I_i S_i for each dof j on the way from i to the base (table 6.2).
    """
    for b in range(1, len(model.bodies)):
        work[b].composite = work[b].inertia
    outboard = work[0].composite  # of the body after this one, when this is its parent
    parent = -1
    for b in range(len(model.bodies) - 1, 0, -1):
        body = model.bodies[b]
        if body.tree < 0:
            continue
        dof = body.first_dof
        I = work[b].composite
        if parent == b:
            I = add_inertia(I, outboard)
            work[b].composite = I
        if body.kind == FREE:
            store_free_rows(work.M, model.dofs[dof].row, I)
        else:
            for k in range(dof, dof + body.num_dofs):
                store_row(model, work, k, mul_inertia(I, work.dofs[k].S))
        parent = body.parent
        if parent == b - 1:
            outboard = I
        elif model.bodies[parent].root > 0:
            work[parent].composite = add_inertia(work[parent].composite, I)
    for i in range(len(model.actuators)):
        driven = model.dofs[model.actuators[i].dof]
        work.M[driven.row + driven.depth] += reflected_inertia(model, p, i)


@kernel
def store_row(model, work, k, F):
    """The packed row of dof k, which at unit acceleration needs the spatial force F."""
    end = k
    while end >= 0:
        first = model.dofs[end].run
        shift = model.dofs[k].row + model.dofs[first].depth - first
        for j in range(first, end + 1):
            work.M[shift + j] = dot6(work.dofs[j].S, F)
        end = model.dofs[first].parent


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


@kernel
def damped_mass_matrix(model: TreeModel, p: Vector, work: TreeWork, dt: float) -> None:
    """Fills `L` with M + dt D, packed; dt = 0 is a copy of M."""
    for k in range(work.M.shape[0]):
        work.L[k] = work.M[k]
    for k in range(len(model.dofs)):
        dof = model.dofs[k]
        work.L[dof.row + dof.depth] += dt * p[dof.damping]
