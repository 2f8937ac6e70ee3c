"""The continuous plant: xdot = (N(q) v, vdot), with compliant point contact and Stribeck friction."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common._kernels.vec import add3, dot3, load3_at, neg3, scale3, sub3
from sheldrake.common.kernel import Matrix, Vector, Vectors, kernel
from sheldrake.geometry._kernels import model as geometry
from sheldrake.geometry._kernels.contacts import begin_contacts
from sheldrake.geometry._kernels.hydro_model import HydroTable
from sheldrake.geometry._kernels.model import ContactTable, GeometryModel
from sheldrake.multibody.contact_solvers._kernels.status import (
    CONTACT_CAPACITY,
    MASS_NOT_POSITIVE,
    SOLVED,
)
from sheldrake.multibody.plant._kernels.contact_rows import combined_material
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
from sheldrake.multibody.tree._kernels.forces import ForceModel, add_point_force
from sheldrake.multibody.tree._kernels.integrate import qdot_of_velocity
from sheldrake.multibody.tree._kernels.kinematics import position_kinematics, velocity_at, velocity_kinematics
from sheldrake.multibody.tree._kernels.model import ROOT, TreeModel, TreeWork

BODY_A = geometry.BODY_A
BODY_B = geometry.BODY_B
GEOMETRY_A = geometry.GEOMETRY_A
GEOMETRY_B = geometry.GEOMETRY_B
P_WCA = geometry.P_WCA
P_WCB = geometry.P_WCB
NHAT_BA_W = geometry.NHAT_BA_W
DEPTH = geometry.DEPTH
FRICTION_STATIC = geometry.FRICTION_STATIC
FRICTION_DYNAMIC = geometry.FRICTION_DYNAMIC

# Columns of DerivativeVectors.contact: force on B at C (3), C (3), slip speed, separation speed.
FORCE = np.int64(0)
POINT = np.int64(3)
SLIP = np.int64(6)
SEPARATION = np.int64(7)
NUM_CONTACT_COLUMNS = 8

STILL = np.float64(1e-14)  # slip speed without friction [m/s]


class DerivativeVectors(NamedTuple):
    """What stages of the derivatives hand on, and ports report.

    Attributes:
        contact: force, point and speeds of each contact, shape (capacity, 8).
        F: spatial forces of contacts and struts about `root`, shape (num_bodies, 6).
        v: velocities, shape (nv,).
        force: generalized forces, shape (nv,).
        contact_force: those of contact alone, shape (nv,).
        vdot: shape (nv,).
        net_actuation: shape (num_actuators,).
        qdot: shape (nq,).
        stiction_tolerance: [m/s], shape (1,).
        applied_force: generalized forces that applied spatial forces amount to, shape (nv,).
        face: moment about the centroid and force on B of each face of contact surfaces, shape (capacity, 6).
    """

    contact: Matrix
    F: Matrix
    v: Vector
    force: Vector
    contact_force: Vector
    vdot: Vector
    net_actuation: Vector
    qdot: Vector
    stiction_tolerance: Vector
    applied_force: Vector
    face: Matrix


class DerivativeWork(NamedTuple):
    """Scratch of the derivatives: the work of every stage."""

    tree: TreeWork
    table: ContactTable
    flow: DerivativeVectors
    surfaces: HydroTable


@kernel
def step_to_one(x):
    """From 0 at 0 to 1 at 1 with zero slope and curvature at both ends."""
    return x * x * x * (10.0 + x * (6.0 * x - 15.0))


@kernel
def stribeck(mu_static, mu_dynamic, s):
    """Friction coefficient at slip s, relative to the stiction tolerance."""
    if s >= 3.0:
        return mu_dynamic
    if s >= 1.0:
        return mu_static - (mu_static - mu_dynamic) * step_to_one(0.5 * (s - 1.0))
    return mu_static * step_to_one(s)


@kernel
def harmonic(a, b):
    if a + b > 0.0:
        return 2.0 * a * b / (a + b)
    return 0.0 * a


@kernel
def contact_force_on_B(model, geometry_model, table, flow, tree, c):
    """Compliant normal force with Hunt-Crossley dissipation, and regularised friction; fills row c of `contact`."""
    a = table.pair[c, GEOMETRY_A]
    b = table.pair[c, GEOMETRY_B]
    body_A = table.pair[c, BODY_A]
    body_B = table.pair[c, BODY_B]
    nhat = load3_at(table.point, c, NHAT_BA_W)
    middle = scale3(add3(load3_at(table.point, c, P_WCA), load3_at(table.point, c, P_WCB)), 0.5)
    _, v_A = velocity_at(tree, body_A, model.body[body_A, ROOT], middle)
    _, v_B = velocity_at(tree, body_B, model.body[body_B, ROOT], middle)
    v_AB = sub3(v_B, v_A)
    approach = dot3(v_AB, nhat)
    v_t = sub3(v_AB, scale3(nhat, approach))
    _, k, d, _, _ = combined_material(geometry_model.material, a, b)
    normal = k * table.point[c, DEPTH] * (1.0 + d * approach)
    f_B = scale3(nhat, 0.0)
    slip = 0.0 * normal
    if dot3(v_t, v_t) > STILL * STILL:
        slip = sqrt(dot3(v_t, v_t))
    if normal > 0.0:
        f_B = scale3(nhat, -normal)
        if slip > STILL:
            mu_s = harmonic(geometry_model.material[a, FRICTION_STATIC], geometry_model.material[b, FRICTION_STATIC])
            mu_d = harmonic(geometry_model.material[a, FRICTION_DYNAMIC], geometry_model.material[b, FRICTION_DYNAMIC])
            mu = stribeck(mu_s, mu_d, slip / flow.stiction_tolerance[0])
            f_B = add3(f_B, scale3(v_t, -mu * normal / slip))
    for i in range(3):
        flow.contact[c, FORCE + i] = f_B[i]
        flow.contact[c, POINT + i] = middle[i]
    flow.contact[c, SLIP] = slip
    flow.contact[c, SEPARATION] = -approach
    return f_B, middle


@kernel
def clear(F):
    for body in range(F.shape[0]):
        for c in range(6):
            F[body, c] = 0.0


@kernel
def add_projected(tree_model, flow, tree, tau):
    """Adds the generalized forces of F to tau; uses tree.F and qdot."""
    for body in range(flow.F.shape[0]):
        for c in range(6):
            tree.F[body, c] = flow.F[body, c]
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
    begin_contacts(geometry_model, tree.X_WB, table)


@kernel(top=True, short_loops=True)
def contact_forces(
    tree: TreeWork,
    table: ContactTable,
    flow: DerivativeVectors,
    tree_model: TreeModel,
    geometry_model: GeometryModel,
) -> int:
    """The forces of the contacts found, into `contact_force`; a status of `contact_solvers`."""
    if table.count[1] != 0:
        return CONTACT_CAPACITY
    if table.count[0] > 0:
        clear(flow.F)
        for c in range(table.count[0]):
            f_B, p_WC = contact_force_on_B(tree_model, geometry_model, table, flow, tree, c)
            add_point_force(tree_model, tree, flow.F, table.pair[c, BODY_B], p_WC, f_B)
            add_point_force(tree_model, tree, flow.F, table.pair[c, BODY_A], p_WC, neg3(f_B))
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
