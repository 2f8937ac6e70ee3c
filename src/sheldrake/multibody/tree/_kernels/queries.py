"""Entries for queries from Python: stages composed, one call each."""

from __future__ import annotations

from sheldrake.common._kernels.generic import is_zero
from sheldrake.common._kernels.vec import (
    add3,
    cross3,
    dot3,
    dot6,
    load3,
    load3_at,
    load6,
    load_inertia,
    mul_inertia,
    scale3,
    scale6,
    store6,
    sub3,
)
from sheldrake.common.kernel import IntVector, Matrix, Vector, kernel
from sheldrake.multibody.tree._kernels import dynamics, factor, forces, integrate, kinematics
from sheldrake.multibody.tree._kernels.forces import ForceModel
from sheldrake.multibody.tree._kernels.model import ACTUATOR_DOF, DAMPING, ROOT, TreeModel, TreeWork


@kernel(top=True, short_loops=True)
def calc_positions(model: TreeModel, p: Vector, work: TreeWork, q: Vector) -> None:
    """`X_WB` and `S`."""
    kinematics.position_kinematics(model, p, work, q)


@kernel(top=True, short_loops=True)
def calc_inertias(model: TreeModel, p: Vector, work: TreeWork) -> None:
    """`inertia`; needs `calc_positions`."""
    dynamics.body_inertias(model, p, work)


@kernel(top=True, short_loops=True)
def calc_velocities(model: TreeModel, p: Vector, work: TreeWork, q: Vector, v: Vector) -> None:
    """`V` and `A`; needs `calc_positions`."""
    kinematics.velocity_kinematics(model, p, work, q, v)


@kernel(top=True, short_loops=True)
def calc_mass_matrix(model: TreeModel, p: Vector, work: TreeWork, M: Matrix) -> None:
    """`work.M` and the dense mass matrix, shape (nv, nv), zeroed before; needs `calc_inertias`."""
    dynamics.mass_matrix(model, p, work)
    factor.unpack(model, work.M, M)


@kernel(top=True, short_loops=True)
def calc_bias(model: TreeModel, work: TreeWork, bias: Vector) -> None:
    """C(q, v) v, shape (nv,); needs `calc_velocities`."""
    dynamics.bias_term(model, work, 0.0)
    for k in range(bias.shape[0]):
        bias[k] = work.bias[k]


@kernel(top=True, short_loops=True)
def calc_gravity(model: TreeModel, work: TreeWork, tau: Vector) -> None:
    """tau_g(q), shape (nv,); needs `calc_positions`."""
    dynamics.gravity_forces(model, work, work.F)
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
    """M vdot + C v less applied generalized forces and spatial forces at the body origins; needs `calc_velocities`."""
    dynamics.accelerations(model, work, vdot, A_work)
    for body in range(1, model.body.shape[0]):
        A_WB = load6(A_work, body)
        store6(work.F, body, scale6(dynamics.inertial_force(model, work, body, A_WB, 0.0), -1.0))
    forces.add_body_forces(model, work, F_Bo_W, work.F)
    dynamics.project_forces(model, work, tau)
    for k in range(tau.shape[0]):
        tau[k] = -tau[k] - applied[k]
    for i in range(model.actuator.shape[0]):
        k = model.actuator[i, ACTUATOR_DOF]
        tau[k] += dynamics.reflected_inertia(model, p, i) * vdot[k]


@kernel(top=True, short_loops=True)
def calc_forward_dynamics(
    model: TreeModel, p: Vector, work: TreeWork, q: Vector, v: Vector, tau: Vector, dt: float, vdot: Vector
) -> int:
    """vdot for applied forces tau, joint damping implicit over dt (0: explicit); all stages.

    Returns:
        0, or 1 + the dof at which the mass matrix is not positive definite.
    """
    kinematics.position_kinematics(model, p, work, q)
    dynamics.body_inertias(model, p, work)
    kinematics.velocity_kinematics(model, p, work, q, v)
    dynamics.bias_term(model, work, 1.0)
    dynamics.mass_matrix(model, p, work)
    dynamics.damped_mass_matrix(model, p, work, dt)
    bad = factor.ltdl(model, work.L)
    for k in range(vdot.shape[0]):
        vdot[k] = tau[k] - work.bias[k] - p[model.dof[k, DAMPING]] * v[k]
    factor.ltdl_solve(model, work.L, vdot)
    return bad + 1


@kernel(top=True, short_loops=True)
def calc_body_velocities(model: TreeModel, work: TreeWork, V_WB: Matrix) -> None:
    """Spatial velocities of the body origins, shape (num_bodies, 6); needs `calc_velocities`."""
    kinematics.body_velocities(model, work, V_WB)


@kernel(top=True, short_loops=True)
def calc_accelerations(model: TreeModel, work: TreeWork, vdot: Vector, A_WB: Matrix) -> None:
    """Spatial accelerations of the body origins for given vdot, shape (num_bodies, 6); needs `calc_velocities`."""
    dynamics.accelerations(model, work, vdot, A_WB)
    dynamics.body_accelerations(model, work, A_WB)


@kernel(top=True, short_loops=True)
def calc_generalized_forces(model: TreeModel, work: TreeWork, F_Bo_W: Matrix, tau: Vector) -> None:
    """Generalized forces of spatial forces at the body origins, shape (num_bodies, 6); needs `calc_positions`."""
    for body in range(model.body.shape[0]):
        for c in range(6):
            work.F[body, c] = 0.0
    forces.add_body_forces(model, work, F_Bo_W, work.F)
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
    for body in range(model.body.shape[0]):
        for c in range(6):
            work.F[body, c] = 0.0
            F_Bo_W[body, c] = 0.0
    dynamics.gravity_forces(model, work, work.F)
    forces.add_dof_springs(force_model, p, q, tau)
    forces.add_hinges(force_model, p, q, v, tau)
    if forces.has_body_forces(force_model):
        forces.add_struts(model, force_model, p, work, work.F)
        forces.add_bushings(model, force_model, p, work, work.F)
    forces.add_at_body_origins(model, work, work.F, F_Bo_W)


@kernel(top=True, short_loops=True)
def calc_qdot(model: TreeModel, q: Vector, v: Vector, qdot: Vector) -> None:
    """qdot = N(q) v."""
    integrate.qdot_of_velocity(model, q, v, qdot)


@kernel(top=True, short_loops=True)
def calc_velocity(model: TreeModel, q: Vector, qdot: Vector, v: Vector) -> None:
    """v = N⁺(q) qdot."""
    integrate.velocity_of_qdot(model, q, qdot, v)


@kernel(top=True, short_loops=True)
def calc_centre_of_mass(model: TreeModel, work: TreeWork, centre: Vector) -> int:
    """Centre of mass [m] of all bodies, in W, shape (3,); needs `calc_inertias`.

    Returns:
        0, or 1 when there is no body but the world, or no mass.
    """
    if model.body.shape[0] < 2:
        return 1
    mass = work.inertia[1, 0]
    moment = first_moment(model, work, 1)
    for body in range(2, model.body.shape[0]):
        mass += work.inertia[body, 0]
        moment = add3(moment, first_moment(model, work, body))
    if is_zero(mass):
        return 1
    centre[0] = moment[0] / mass
    centre[1] = moment[1] / mass
    centre[2] = moment[2] / mass
    return 0


@kernel
def first_moment(model, work, body):
    """Mass times position of the centre of mass of a body in W [kg m]."""
    root = load3_at(work.X_WB, model.body[body, ROOT], 9)
    return add3(scale3(root, work.inertia[body, 0]), load3_at(work.inertia, body, 1))


@kernel(top=True, short_loops=True)
def calc_momentum(model: TreeModel, work: TreeWork, mask: IntVector, point: Vector, L: Vector) -> None:
    """Spatial momentum of the masked bodies about a point of W [kg m²/s, kg m/s], in W, shape (6,).

    Needs `calc_inertias` and `calc_velocities`.
    """
    p_WP = (point[0], point[1], point[2])
    for c in range(6):
        L[c] = 0.0
    for body in range(1, model.body.shape[0]):
        if mask[body] != 0:
            p_PRoot = sub3(load3_at(work.X_WB, model.body[body, ROOT], 9), p_WP)
            h, l = mul_inertia(load_inertia(work.inertia, body), load6(work.V, body))
            h = add3(h, cross3(p_PRoot, l))
            L[0] += h[0]
            L[1] += h[1]
            L[2] += h[2]
            L[3] += l[0]
            L[4] += l[1]
            L[5] += l[2]


@kernel(top=True, short_loops=True)
def calc_kinetic_energy(model: TreeModel, p: Vector, work: TreeWork, v: Vector, energy: Vector) -> None:
    """Energy of motion [J], that of rotors too, shape (1,); needs `calc_inertias` and `calc_velocities`."""
    energy[0] = 0.0
    for body in range(1, model.body.shape[0]):
        V_WB = load6(work.V, body)
        energy[0] += 0.5 * dot6(V_WB, mul_inertia(load_inertia(work.inertia, body), V_WB))
    for i in range(model.actuator.shape[0]):
        rate = v[model.actuator[i, ACTUATOR_DOF]]
        energy[0] += 0.5 * dynamics.reflected_inertia(model, p, i) * rate * rate


@kernel(top=True, short_loops=True)
def calc_gravity_energy(model: TreeModel, work: TreeWork, energy: Vector) -> None:
    """Potential energy of gravity [J], zero at the world's origin, shape (1,); needs `calc_inertias`."""
    energy[0] = 0.0
    for body in range(1, model.body.shape[0]):
        energy[0] -= dot3(first_moment(model, work, body), load3(model.gravity, body))
