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
    load3,
    load3_at,
    load6,
    load9,
    load_inertia,
    mul_inertia,
    read3,
    rotate,
    rotate_symmetric,
    scale3,
    scale6,
    store6,
    store_inertia,
    sub3,
    sub6,
)
from sheldrake.common.kernel import Matrix, Vector, kernel
from sheldrake.multibody.tree._kernels.model import (
    ACTUATOR_DOF,
    DAMPING,
    DEPTH,
    DOF_PARENT,
    FREE,
    GEAR,
    INERTIA,
    KIND,
    NV,
    PARENT,
    ROOT,
    ROTOR,
    ROW,
    RUN,
    TREE,
    TreeModel,
    TreeWork,
    V,
)


@kernel
def body_inertias(model: TreeModel, p: Vector, work: TreeWork) -> None:
    """Fills `inertia` from `X_WB` and the parameters; start of every algorithm below."""
    for body in range(1, model.body.shape[0]):
        at = model.body[body, INERTIA]
        mass = p[at]
        if is_zero(mass):
            store_inertia(work.inertia, body, (mass, (mass, mass, mass), (mass, mass, mass, mass, mass, mass)))
        else:
            R_WB = load9(work.X_WB, body)
            c_Bo_W = rotate(R_WB, read3(p, at + 1))
            G_BBo_B = (p[at + 4], p[at + 5], p[at + 6], p[at + 7], p[at + 8], p[at + 9])
            G_BBo_W = rotate_symmetric(R_WB, G_BBo_B)
            root = model.body[body, ROOT]
            if root == body:
                store_inertia(work.inertia, body, (mass, scale3(c_Bo_W, mass), scale_symmetric(G_BBo_W, mass)))
            else:
                p_RootB = sub3(load3_at(work.X_WB, body, 9), load3_at(work.X_WB, root, 9))
                G = shift_unit_inertia(G_BBo_W, c_Bo_W, p_RootB)
                h = scale3(add3(c_Bo_W, p_RootB), mass)
                store_inertia(work.inertia, body, (mass, h, scale_symmetric(G, mass)))


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
    for body in range(1, model.body.shape[0]):
        if model.body[body, TREE] >= 0:
            A_WB = load6(work.A, body)
            store6(work.F, body, inertial_force(model, work, body, A_WB, gravity_scale))
    project_forces(model, work, work.bias)


@kernel
def inertial_force(model, work, body, A_WB, gravity_scale):
    """The force that moves the body with acceleration A, gravity aside."""
    I = load_inertia(work.inertia, body)
    V_WB = load6(work.V, body)
    alpha, a = A_WB
    a = sub3(a, scale3(load3(model.gravity, body), gravity_scale))
    return add6(mul_inertia(I, (alpha, a)), cross_force(V_WB, mul_inertia(I, V_WB)))


@kernel
def gravity_forces(model: TreeModel, work: TreeWork, F: Matrix) -> None:
    """Spatial forces of gravity about `root`, shape (num_bodies, 6)."""
    for body in range(1, model.body.shape[0]):
        g = load3(model.gravity, body)
        store6(F, body, (cross3(load3_at(work.inertia, body, 1), g), scale3(g, work.inertia[body, 0])))


@kernel
def project_forces(model: TreeModel, work: TreeWork, tau: Vector) -> None:
    """tau = Sᵀ times the sum of `F` over all bodies outboard of a joint; turns `F` into those sums, tip to base."""
    for body in range(model.body.shape[0] - 1, 0, -1):
        dof = model.body[body, V]
        F = load6(work.F, body)
        if model.body[body, KIND] == FREE:
            t, f = F
            tau[dof], tau[dof + 1], tau[dof + 2] = t
            tau[dof + 3], tau[dof + 4], tau[dof + 5] = f
        else:
            for k in range(dof, dof + model.body[body, NV]):
                tau[k] = dot6(load6(work.S, k), F)
            parent = model.body[body, PARENT]
            if model.body[parent, ROOT] > 0:
                store6(work.F, parent, add6(load6(work.F, parent), F))


@kernel
def accelerations(model: TreeModel, work: TreeWork, vdot: Vector, A_out: Matrix) -> None:
    """Spatial accelerations about `root` for given vdot, shape (num_bodies, 6); read TreeWork.A for what they are."""
    for body in range(1, model.body.shape[0]):
        parent = model.body[body, PARENT]
        A_vdot = sub6(load6(A_out, parent), load6(work.A, parent))
        dof = model.body[body, V]
        for k in range(dof, dof + model.body[body, NV]):
            A_vdot = add6(A_vdot, scale6(load6(work.S, k), vdot[k]))
        store6(A_out, body, add6(load6(work.A, body), A_vdot))


@kernel
def body_accelerations(model: TreeModel, work: TreeWork, A: Matrix) -> None:
    """Turns accelerations of velocity fields about `root` into accelerations of the body origins, in place."""
    for body in range(1, model.body.shape[0]):
        alpha, a = load6(A, body)
        w_WB, v_Root = load6(work.V, body)
        p_RootB = sub3(load3_at(work.X_WB, body, 9), load3_at(work.X_WB, model.body[body, ROOT], 9))
        v_WBo = add3(v_Root, cross3(w_WB, p_RootB))
        a_WBo = add3(add3(a, cross3(alpha, p_RootB)), cross3(w_WB, v_WBo))
        store6(A, body, (alpha, a_WBo))


@kernel
def reflected_inertia(model: TreeModel, p: Vector, actuator: int) -> float:
    """gear² times rotor inertia [kg m², or kg for a prismatic joint]."""
    gear = p[model.actuator[actuator, GEAR]]
    return gear * gear * p[model.actuator[actuator, ROTOR]]


@kernel
def mass_matrix(model: TreeModel, p: Vector, work: TreeWork) -> None:
    """Fills `composite` and the packed `M` from `S` and `inertia`; reflected inertias of actuators included."""
    for body in range(1, model.body.shape[0]):
        store_inertia(work.composite, body, load_inertia(work.inertia, body))
    outboard = load_inertia(work.composite, 0)  # of the body after this one, when this is its parent
    parent = -1
    for body in range(model.body.shape[0] - 1, 0, -1):
        if model.body[body, TREE] < 0:
            continue
        dof = model.body[body, V]
        I = load_inertia(work.composite, body)
        if parent == body:
            I = add_inertia(I, outboard)
            store_inertia(work.composite, body, I)
        if model.body[body, KIND] == FREE:
            store_free_rows(work.M, model.dof[dof, ROW], I)
        else:
            for k in range(dof, dof + model.body[body, NV]):
                store_row(model, work, k, mul_inertia(I, load6(work.S, k)))
        parent = model.body[body, PARENT]
        if parent == body - 1:
            outboard = I
        elif model.body[parent, ROOT] > 0:
            store_inertia(work.composite, parent, add_inertia(load_inertia(work.composite, parent), I))
    for i in range(model.actuator.shape[0]):
        k = model.actuator[i, ACTUATOR_DOF]
        work.M[model.dof[k, ROW] + model.dof[k, DEPTH]] += reflected_inertia(model, p, i)


@kernel
def store_row(model, work, k, F):
    """The packed row of dof k, which at unit acceleration needs the spatial force F."""
    end = k
    while end >= 0:
        first = model.dof[end, RUN]
        shift = model.dof[k, ROW] + model.dof[first, DEPTH] - first
        for j in range(first, end + 1):
            work.M[shift + j] = dot6(load6(work.S, j), F)
        end = model.dof[first, DOF_PARENT]


@kernel
def store_free_rows(M, row, I):
    """The six packed rows of a free body: [J, .; h x, mass]."""
    mass, h, J = I
    xx, yy, zz, xy, xz, yz = J
    M[row] = xx
    M[row + 1] = xy
    M[row + 2] = yy
    M[row + 3] = xz
    M[row + 4] = yz
    M[row + 5] = zz
    zero = mass - mass
    store_free_row(M, row + 6, (zero, h[2], -h[1]))
    M[row + 9] = mass
    store_free_row(M, row + 10, (-h[2], zero, h[0]))
    M[row + 13] = zero
    M[row + 14] = mass
    store_free_row(M, row + 15, (h[1], -h[0], zero))
    M[row + 18] = zero
    M[row + 19] = zero
    M[row + 20] = mass


@kernel
def store_free_row(M, at, a):
    M[at] = a[0]
    M[at + 1] = a[1]
    M[at + 2] = a[2]


@kernel
def damped_mass_matrix(model: TreeModel, p: Vector, work: TreeWork, dt: float) -> None:
    """Fills `L` with M + dt D, packed; dt = 0 is a copy of M."""
    for k in range(work.M.shape[0]):
        work.L[k] = work.M[k]
    for k in range(model.dof.shape[0]):
        work.L[model.dof[k, ROW] + model.dof[k, DEPTH]] += dt * p[model.dof[k, DAMPING]]
