"""The continuous plant: xdot = (N(q) v, vdot), with compliant point contact and Stribeck friction."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from sheldrake.common._kernels.generic import is_finite, sqrt
from sheldrake.common._kernels.vec import add3, dot3, load6, neg3, scale3, sub3
from sheldrake.common.kernel import Matrix, Vector, Vectors, kernel
from sheldrake.common.record import Items, Record, number, numbers, table
from sheldrake.geometry._kernels.hydro_model import HydroTable
from sheldrake.geometry._kernels.model import ContactTable, GeometryModel
from sheldrake.geometry._kernels.table import place_geometry
from sheldrake.multibody.contact_solvers._kernels.laws import stribeck
from sheldrake.multibody.contact_solvers._kernels.status import (
    CONTACT_CAPACITY,
    MASS_NOT_POSITIVE,
    MOTION_NOT_FINITE,
    SOLVED,
)
from sheldrake.multibody.plant._kernels.contact_rows import combined_material, friction_scale, harmonic_mean
from sheldrake.multibody.plant._kernels.forces import (
    add_actuation,
    add_applied_forces,
    add_element_forces,
    put_passive_forces,
)
from sheldrake.multibody.plant._kernels.locks import is_locked, lock_mass_matrix
from sheldrake.multibody.plant._kernels.model import PlantModel
from sheldrake.multibody.tree._kernels.dynamics import bias_term, body_inertias, mass_matrix, project_forces
from sheldrake.multibody.tree._kernels.factor import ltdl, ltdl_solve
from sheldrake.multibody.tree._kernels.forces import ForceModel, add_point_force, clear
from sheldrake.multibody.tree._kernels.integrate import qdot_of_velocity
from sheldrake.multibody.tree._kernels.kinematics import position_kinematics, velocity_at, velocity_kinematics
from sheldrake.multibody.tree._kernels.model import TreeModel, TreeWork

STILL = 1e-14  # slip speed without friction [m/s]


class ContactForce(Record):
    """At a point of contact."""

    f_BC_W = numbers(3, "force on B", "N")
    p_WC = numbers(3, "where", "m")
    slip = number("slip speed", "m/s")
    separation = number("separation speed", "m/s")


class FaceForce(Record):
    """On B, of a face of a contact surface."""

    F = numbers((3, 3), "moment about the centroid, and force", "N m, N")


@table
class DerivativeVectors(NamedTuple):
    """What stages of the derivatives hand on, and ports report.

    Attributes:
        F: spatial forces of contacts and struts about `root`, shape (num_bodies, 6).
        v: velocities, shape (nv,).
        force: generalized forces, shape (nv,).
        contact_force: those of contact alone, shape (nv,).
        vdot: shape (nv,).
        net_actuation: shape (num_actuators,).
        qdot: shape (nq,).
        stiction_tolerance: [m/s], shape (1,).
        applied_force: generalized forces that applied spatial forces amount to, shape (nv,).
    """

    contact: Annotated[Matrix, Items("contacts", ContactForce)]
    F: Matrix
    v: Vector
    force: Vector
    contact_force: Vector
    vdot: Vector
    net_actuation: Vector
    qdot: Vector
    stiction_tolerance: Vector
    applied_force: Vector
    face: Annotated[Matrix, Items("faces", FaceForce)]


class DerivativeWork(NamedTuple):
    """Scratch of the derivatives: the work of every stage."""

    tree: TreeWork
    table: ContactTable
    flow: DerivativeVectors
    surfaces: HydroTable


@kernel
def sliding(model, tree, body_A, body_B, p_WC, nhat):
    """Of B against A at a point: speed of approach along nhat, slip velocity, slip speed (0 for what is STILL)."""
    _, v_A = velocity_at(model, tree, body_A, p_WC)
    _, v_B = velocity_at(model, tree, body_B, p_WC)
    v_AB = sub3(v_B, v_A)
    approach = dot3(v_AB, nhat)
    v_t = sub3(v_AB, scale3(nhat, approach))
    slip = 0.0 * approach
    if dot3(v_t, v_t) > STILL * STILL:
        slip = sqrt(dot3(v_t, v_t))
    return approach, v_t, slip


@kernel
def contact_force_on_B(model, geometry_model, p, table, flow, tree, c):
    """k x (1 + d v) along the normal (Hunt and Crossley 1975), and regularised friction; fills `contact`."""
    found = table[c]
    a, b = found.geometry_A, found.geometry_B
    nhat = found.nhat_BA_W
    middle = scale3(add3(found.p_WCa, found.p_WCb), 0.5)
    approach, v_t, slip = sliding(model, tree, found.body_A, found.body_B, middle, nhat)
    _, (k, d, _, mu_d) = combined_material(model, geometry_model, p, a, b)
    normal = k * found.depth * (1.0 + d * approach)
    f_B = scale3(nhat, 0.0)
    if normal > 0.0:
        f_B = scale3(nhat, -normal)
        if slip > STILL:
            A, B = geometry_model[a], geometry_model[b]
            mu_A = A.friction_static * friction_scale(model, p, A)
            mu_s = harmonic_mean(mu_A, B.friction_static * friction_scale(model, p, B))
            mu = stribeck(mu_s, mu_d, slip / flow.stiction_tolerance[0])
            f_B = add3(f_B, scale3(v_t, -mu * normal / slip))
    contact = flow.contacts[c]
    contact.f_BC_W = f_B
    contact.p_WC = middle
    contact.slip, contact.separation = slip, -approach
    return f_B, middle


@kernel
def add_projected(tree_model, flow, tree, tau):
    """Adds the generalized forces of F to tau; uses tree.F and qdot."""
    for b in range(flow.F.shape[0]):
        tree[b].F = load6(flow.F, b)
    project_forces(tree_model, tree, flow.qdot)
    for k in range(tau.shape[0]):
        tau[k] += flow.qdot[k]


@kernel(top=True, short_loops=True)
def smooth_forces(
    xc: Vector,
    p: Vector,
    u: Vectors,
    tree: TreeWork,
    table: ContactTable,
    flow: DerivativeVectors,
    tree_model: TreeModel,
    geometry_model: GeometryModel,
    force_model: ForceModel,
    plant_model: PlantModel,
) -> None:
    """Kinematics and all forces but contact; places the geometry."""
    v = flow.v
    nq = xc.shape[0] - v.shape[0]
    for k in range(v.shape[0]):
        v[k] = xc[nq + k]
        flow.contact_force[k] = 0.0
    position_kinematics(tree_model, p, tree, xc)
    body_inertias(tree_model, p, tree)
    velocity_kinematics(tree_model, p, tree, xc, v)
    bias_term(tree_model, tree, 1.0)
    put_passive_forces(tree_model, p, tree.bias, v, flow.force)
    add_element_forces(tree_model, force_model, p, tree, xc, v, flow.qdot, flow.force)
    add_applied_forces(plant_model, u, flow.applied_force, flow.force)
    add_actuation(plant_model, u, flow.force, flow.net_actuation, False)
    place_geometry(geometry_model, tree, table)


@kernel(top=True, short_loops=True)
def contact_forces(
    p: Vector,
    tree: TreeWork,
    table: ContactTable,
    flow: DerivativeVectors,
    tree_model: TreeModel,
    geometry_model: GeometryModel,
) -> int:
    """The forces of the contacts found, into `contact_force`; a status of `contact_solvers`."""
    if table.status != 0:
        return CONTACT_CAPACITY
    if table.num_contacts > 0:
        clear(flow.F)
        for c in range(table.num_contacts):
            f_B, p_WC = contact_force_on_B(tree_model, geometry_model, p, table, flow, tree, c)
            add_point_force(tree_model, tree, flow.F, table[c].body_B, p_WC, f_B)
            add_point_force(tree_model, tree, flow.F, table[c].body_A, p_WC, neg3(f_B))
        add_projected(tree_model, flow, tree, flow.contact_force)
    return SOLVED


@kernel(top=True, short_loops=True)
def plant_derivatives(
    xc: Vector,
    p: Vector,
    tree: TreeWork,
    flow: DerivativeVectors,
    tree_model: TreeModel,
    plant_model: PlantModel,
    out: Vector,
) -> int:
    """Time derivatives of positions and velocities; a status of `contact_solvers`, 0 when all is well."""
    nv = flow.v.shape[0]
    nq = xc.shape[0] - nv
    for k in range(nq):
        if not is_finite(xc[k]):  # of what is free, velocities and their derivatives do not depend on it
            return MOTION_NOT_FINITE
    mass_matrix(tree_model, p, tree)
    lock_mass_matrix(tree_model, plant_model, p, tree.M)
    for i in range(tree.M.shape[0]):
        tree.L[i] = tree.M[i]
    if ltdl(tree_model, tree.L) >= 0:
        return MASS_NOT_POSITIVE
    for k in range(nv):
        flow.vdot[k] = 0.0 if is_locked(plant_model, p, k) else flow.force[k] + flow.contact_force[k]
    ltdl_solve(tree_model, tree.L, flow.vdot)
    qdot_of_velocity(tree_model, xc, flow.v, flow.qdot)
    for k in range(nq):
        out[k] = flow.qdot[k]
    for k in range(nv):
        out[nq + k] = flow.vdot[k]
    return SOLVED
