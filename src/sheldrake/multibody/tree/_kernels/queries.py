"""Entries for queries from Python: stages composed, one call each."""

from __future__ import annotations

from sheldrake.common._kernels.generic import is_zero
from sheldrake.common._kernels.vec import (
    add3,
    cross3,
    dot3,
    dot6,
    load3,
    load6,
    mul_inertia,
    read3,
    rotate,
    scale3,
    scale6,
    sub3,
    write3,
    write6,
)
from sheldrake.common.kernel import IntVector, Matrix, Vector, kernel
from sheldrake.multibody.tree._kernels import dynamics, forces
from sheldrake.multibody.tree._kernels.forces import ForceModel
from sheldrake.multibody.tree._kernels.model import TreeModel, TreeWork


@kernel(top=True, short_loops=True)
def calc_mass_matrix(model: TreeModel, p: Vector, work: TreeWork, M: Matrix) -> None:
    """`work.M` and the dense mass matrix, shape (nv, nv), zeroed before; needs `body_inertias`."""
    dynamics.mass_matrix(model, p, work, work.M)
    dynamics.unpack(model, work.M, M)


@kernel(top=True, short_loops=True)
def calc_bias(model: TreeModel, work: TreeWork, bias: Vector) -> None:
    """C(q, v) v, shape (nv,); needs `velocity_kinematics`."""
    dynamics.bias_term(model, work, 0.0)
    for k in range(bias.shape[0]):
        bias[k] = work.bias[k]


@kernel(top=True, short_loops=True)
def calc_gravity(model: TreeModel, work: TreeWork, tau: Vector) -> None:
    """tau_g(q), shape (nv,); needs `position_kinematics`."""
    dynamics.gravity_forces(model, work)
    dynamics.project_forces(model, work, tau)


@kernel(top=True, short_loops=True)
def calc_inverse_dynamics(
    model: TreeModel,
    p: Vector,
    work: TreeWork,
    vdot: Vector,
    F_Bo_W: Matrix,
    applied: Vector,
    A_work: Matrix,
    tau: Vector,
) -> None:
    """M vdot + C v less applied generalized forces and forces at the body origins; needs `velocity_kinematics`."""
    dynamics.accelerations(model, work, vdot, A_work)
    for b in range(1, len(model.bodies)):
        inertial = dynamics.inertial_force(model, work, b, work[b].inertia, load6(A_work, b), 0.0)
        work[b].F = scale6(inertial, -1.0)
    forces.add_body_forces(model, work, F_Bo_W, work.F)
    dynamics.project_forces(model, work, tau)
    for k in range(tau.shape[0]):
        tau[k] = -tau[k] - applied[k]
    for i in range(len(model.actuators)):
        k = model.actuators[i].dof
        tau[k] += dynamics.reflected_inertia(model, p, i) * vdot[k]


@kernel(top=True, short_loops=True)
def calc_accelerations(model: TreeModel, work: TreeWork, vdot: Vector, A_WB: Matrix) -> None:
    """Spatial accelerations of the body origins for given vdot, shape (num_bodies, 6); needs `velocity_kinematics`."""
    dynamics.accelerations(model, work, vdot, A_WB)
    dynamics.body_accelerations(model, work, A_WB)


@kernel(top=True, short_loops=True)
def calc_generalized_forces(model: TreeModel, work: TreeWork, F_Bo_W: Matrix, tau: Vector) -> None:
    """Generalized forces of spatial forces at the body origins, shape (num_bodies, 6); needs `position_kinematics`."""
    forces.clear(work.F)
    forces.add_body_forces(model, work, F_Bo_W, work.F)
    dynamics.project_forces(model, work, tau)


@kernel(top=True, short_loops=True)
def calc_applied_forces(
    model: TreeModel,
    work: TreeWork,
    bodies: IntVector,
    points: Matrix,
    forces_Bq_W: Matrix,
    F: Matrix,
    tau: Vector,
) -> None:
    """Generalized forces of spatial forces at points; needs `position_kinematics`.

    `bodies` are the rows of the bodies, its last item the number of forces; points are p_BoBq_B [m], forces F_Bq_W
    [N m, N], each as many rows as there is room for. F is filled with what they are by body about `root`.
    """
    forces.clear(work.F)
    for i in range(bodies[bodies.shape[0] - 1]):
        body = work[bodies[i]]
        torque, force = load6(forces_Bq_W, i)
        p_WBq = add3(body.p_WB, rotate(body.R_WB, load3(points, i)))
        forces.add_point_force(model, work, work.F, bodies[i], p_WBq, force)
        forces.add_force(work.F, bodies[i], (torque, (0.0, 0.0, 0.0)))
    forces.copy_rows6(F, work.F)
    dynamics.project_forces(model, work, tau)


@kernel(top=True, short_loops=True)
def calc_element_forces(
    model: TreeModel,
    force_model: ForceModel,
    p: Vector,
    work: TreeWork,
    q: Vector,
    v: Vector,
    F_Bo_W: Matrix,
    tau: Vector,
) -> None:
    """Forces of gravity, springs, struts and bushings: spatial ones at the body origins, and tau; all stages."""
    for k in range(tau.shape[0]):
        tau[k] = 0.0
    forces.clear(work.F)
    forces.clear(F_Bo_W)
    dynamics.gravity_forces(model, work)
    forces.add_dof_springs(force_model, p, q, tau)
    forces.add_hinges(force_model, p, q, v, tau)
    forces.add_struts(model, force_model, p, work, work.F)
    forces.add_bushings(model, force_model, p, work, work.F)
    forces.add_at_body_origins(model, work, F_Bo_W)


@kernel(top=True, strict=True, short_loops=True)
def calc_contribution(
    model: TreeModel,
    force_model: ForceModel,
    p: Vector,
    work: TreeWork,
    q: Vector,
    v: Vector,
    damping_at: IntVector,
    rows: IntVector,
    F_rows: Matrix,
    F_Bo_W: Matrix,
    tau: Vector,
) -> None:
    """The same by number of the body, of which `rows` has the rows, with the damping of joints: `p` has the factors."""
    calc_element_forces(model, force_model, p, work, q, v, F_rows, tau)
    for k in range(tau.shape[0]):
        tau[k] = tau[k] - p[damping_at[k]] * v[k]
    for body in range(rows.shape[0]):
        for i in range(6):
            F_Bo_W[body, i] = F_rows[rows[body], i]


@kernel
def mass_of(model, work, mask):
    """Mass of the masked bodies [kg]."""
    mass = work[0].mass * 0.0
    for b in range(1, len(model.bodies)):
        if mask[b] != 0.0:
            mass = mass + work[b].mass
    return mass


@kernel(top=True, short_loops=True)
def calc_mass(model: TreeModel, p: Vector, mask: Vector, mass: Vector) -> None:
    """Mass of the masked bodies [kg], shape (1,)."""
    mass[0] = 0.0
    for b in range(1, len(model.bodies)):
        if mask[b] != 0.0:
            mass[0] += p[model.bodies[b].inertia]


@kernel(top=True, short_loops=True)
def calc_centre_of_mass(model: TreeModel, work: TreeWork, mask: Vector, centre: Vector) -> int:
    """Centre of mass [m] of the masked bodies, in W, shape (3,); needs `body_inertias`.

    Returns:
        0, or 1 when they have no mass.
    """
    mass = mass_of(model, work, mask)
    if is_zero(mass):
        return 1
    write3(centre, 0, (0.0, 0.0, 0.0))
    for b in range(1, len(model.bodies)):
        if mask[b] != 0.0:
            write3(centre, 0, add3(read3(centre, 0), first_moment(model, work, b)))
    divide3(centre, mass)
    return 0


@kernel
def divide3(x, divisor):
    """Divides three numbers."""
    for i in range(3):
        x[i] = x[i] / divisor


@kernel(top=True, short_loops=True)
def calc_velocity_of_centre(model: TreeModel, work: TreeWork, mask: Vector, v: Vector) -> int:
    """Velocity of the centre of mass of the masked bodies [m/s], in W, shape (3,).

    Needs `body_inertias` and `velocity_kinematics`.

    Returns:
        0, or 1 when they have no mass.
    """
    mass = mass_of(model, work, mask)
    if is_zero(mass):
        return 1
    write3(v, 0, (0.0, 0.0, 0.0))
    for b in range(1, len(model.bodies)):
        if mask[b] != 0.0:
            _, l = mul_inertia(work[b].inertia, work[b].V_WB)
            write3(v, 0, add3(read3(v, 0), l))
    divide3(v, mass)
    return 0


@kernel
def first_moment(model, work, b):
    """Mass times position of the centre of mass of a body in W [kg m]."""
    p_WRoot = work[model.bodies[b].root].p_WB
    return add3(scale3(p_WRoot, work[b].mass), work[b].first_moment)


@kernel(top=True, short_loops=True)
def calc_momentum(model: TreeModel, work: TreeWork, mask: Vector, point: Vector, L: Vector) -> None:
    """Spatial momentum of the masked bodies about a point of W [kg m²/s, kg m/s], in W, shape (6,).

    Needs `body_inertias` and `velocity_kinematics`.
    """
    p_WP = read3(point, 0)
    write6(L, 0, ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
    for b in range(1, len(model.bodies)):
        if mask[b] != 0.0:
            p_PRoot = sub3(work[model.bodies[b].root].p_WB, p_WP)
            h, l = mul_inertia(work[b].inertia, work[b].V_WB)
            h = add3(h, cross3(p_PRoot, l))
            L[0] += h[0]
            L[1] += h[1]
            L[2] += h[2]
            L[3] += l[0]
            L[4] += l[1]
            L[5] += l[2]


@kernel(top=True, short_loops=True)
def calc_acceleration_of_centre(model: TreeModel, work: TreeWork, mask: Vector, A_WB: Matrix, a: Vector) -> int:
    """Acceleration of the centre of mass of the masked bodies [m/s²], in W, shape (3,); `A_WB` are of their origins.

    Needs `body_inertias` and `velocity_kinematics`.

    Returns:
        0, or 1 when they have no mass.
    """
    mass = mass_of(model, work, mask)
    if is_zero(mass):
        return 1
    write3(a, 0, (0.0, 0.0, 0.0))
    for b in range(1, len(model.bodies)):
        if mask[b] != 0.0:
            body = work[b]
            w, _ = body.V_WB
            alpha, a_Bo = load6(A_WB, b)
            moment = add3(body.first_moment, scale3(sub3(work[model.bodies[b].root].p_WB, body.p_WB), body.mass))
            f = add3(scale3(a_Bo, body.mass), add3(cross3(alpha, moment), cross3(w, cross3(w, moment))))
            write3(a, 0, add3(read3(a, 0), f))
    divide3(a, mass)
    return 0


@kernel(top=True, short_loops=True)
def calc_kinetic_energy(model: TreeModel, p: Vector, work: TreeWork, v: Vector, energy: Vector) -> None:
    """Energy of motion [J], that of rotors too, shape (1,); needs `body_inertias` and `velocity_kinematics`."""
    energy[0] = 0.0
    for b in range(1, len(model.bodies)):
        V_WB = work[b].V_WB
        energy[0] += 0.5 * dot6(V_WB, mul_inertia(work[b].inertia, V_WB))
    for i in range(len(model.actuators)):
        rate = v[model.actuators[i].dof]
        energy[0] += 0.5 * dynamics.reflected_inertia(model, p, i) * rate * rate


@kernel(top=True, short_loops=True)
def calc_potential_energy(
    model: TreeModel, force_model: ForceModel, p: Vector, work: TreeWork, q: Vector, energy: Vector
) -> None:
    """Energy of gravity, zero at the world's origin, and of force elements [J], shape (1,); needs `body_inertias`."""
    energy[0] = 0.0
    for b in range(1, len(model.bodies)):
        energy[0] -= dot3(first_moment(model, work, b), dynamics.gravity_on(model, work, b))
    forces.add_potential_energy(force_model, p, work, q, energy)


@kernel(top=True, short_loops=True)
def calc_powers(
    model: TreeModel, force_model: ForceModel, p: Vector, work: TreeWork, q: Vector, v: Vector, power: Vector
) -> None:
    """Powers of gravity and elastic forces, and of dissipative forces of force elements [W], shape (2,); all stages."""
    power[0] = 0.0
    power[1] = 0.0
    for b in range(1, len(model.bodies)):
        body = work[b]
        g_W = dynamics.gravity_on(model, work, b)
        power[0] += dot6((cross3(body.first_moment, g_W), scale3(g_W, body.mass)), body.V_WB)
    forces.add_powers(model, force_model, p, work, q, v, power)
