"""The continuous plant: xdot = (N(q) v, vdot), with compliant point contact and Stribeck friction."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common._kernels.vec import add3, dot3, load3_at, neg3, scale3, sub3
from sheldrake.common.kernel import IntMatrix, IntVector, Matrix, Vector, Vectors, kernel
from sheldrake.geometry._kernels import model as geometry
from sheldrake.geometry._kernels.contacts import find_contacts
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

# Columns of DerivativeWork.contact: force on B at C (3), C (3), slip speed, separation speed.
FORCE = np.int64(0)
POINT = np.int64(3)
SLIP = np.int64(6)
SEPARATION = np.int64(7)
NUM_CONTACT_COLUMNS = 8

STILL = np.float64(1e-14)  # slip speed without friction [m/s]


class DerivativeWork(NamedTuple):
    """Scratch of the derivatives: fields of `TreeWork` and `ContactTable` with a prefix, then what ports report.

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
    """

    tree_X_WB: Matrix
    tree_S: Matrix
    tree_V: Matrix
    tree_A: Matrix
    tree_inertia: Matrix
    tree_composite: Matrix
    tree_F: Matrix
    tree_M: Vector
    tree_L: Vector
    tree_bias: Vector
    table_pair: IntMatrix
    table_point: Matrix
    table_count: IntVector
    table_X_WG: Matrix
    table_work: Matrix
    table_iwork: IntVector
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
def contact_force_on_B(model, geometry_model, work, tree, c):
    """Compliant normal force with Hunt-Crossley dissipation, and regularised friction; fills row c of `contact`."""
    a = work.table_pair[c, GEOMETRY_A]
    b = work.table_pair[c, GEOMETRY_B]
    body_A = work.table_pair[c, BODY_A]
    body_B = work.table_pair[c, BODY_B]
    nhat = load3_at(work.table_point, c, NHAT_BA_W)
    middle = scale3(add3(load3_at(work.table_point, c, P_WCA), load3_at(work.table_point, c, P_WCB)), 0.5)
    _, v_A = velocity_at(tree, body_A, model.body[body_A, ROOT], middle)
    _, v_B = velocity_at(tree, body_B, model.body[body_B, ROOT], middle)
    v_AB = sub3(v_B, v_A)
    approach = dot3(v_AB, nhat)
    v_t = sub3(v_AB, scale3(nhat, approach))
    _, k, d, _, _ = combined_material(geometry_model.material, a, b)
    normal = k * work.table_point[c, DEPTH] * (1.0 + d * approach)
    f_B = scale3(nhat, 0.0)
    slip = 0.0 * normal
    if dot3(v_t, v_t) > STILL * STILL:
        slip = sqrt(dot3(v_t, v_t))
    if normal > 0.0:
        f_B = scale3(nhat, -normal)
        if slip > STILL:
            mu_s = harmonic(geometry_model.material[a, FRICTION_STATIC], geometry_model.material[b, FRICTION_STATIC])
            mu_d = harmonic(geometry_model.material[a, FRICTION_DYNAMIC], geometry_model.material[b, FRICTION_DYNAMIC])
            mu = stribeck(mu_s, mu_d, slip / work.stiction_tolerance[0])
            f_B = add3(f_B, scale3(v_t, -mu * normal / slip))
    for i in range(3):
        work.contact[c, FORCE + i] = f_B[i]
        work.contact[c, POINT + i] = middle[i]
    work.contact[c, SLIP] = slip
    work.contact[c, SEPARATION] = -approach
    return f_B, middle


@kernel(outline=True)
def add_contacts(tree_model: TreeModel, geometry_model: GeometryModel, work: DerivativeWork, tree: TreeWork) -> int:
    """Contact forces into F and `contact_force`; a status."""
    table = ContactTable(
        work.table_pair, work.table_point, work.table_count, work.table_X_WG, work.table_work, work.table_iwork
    )
    count = find_contacts(geometry_model, tree.X_WB, table)
    if count < 0:
        return CONTACT_CAPACITY
    for k in range(work.contact_force.shape[0]):
        work.contact_force[k] = 0.0
    if count > 0:
        clear(work.F)
        for c in range(count):
            f_B, p_WC = contact_force_on_B(tree_model, geometry_model, work, tree, c)
            add_point_force(tree_model, tree, work.F, work.table_pair[c, BODY_B], p_WC, f_B)
            add_point_force(tree_model, tree, work.F, work.table_pair[c, BODY_A], p_WC, neg3(f_B))
        add_projected(tree_model, work, tree, work.contact_force)
    return SOLVED


@kernel
def clear(F):
    for body in range(F.shape[0]):
        for c in range(6):
            F[body, c] = 0.0


@kernel
def add_projected(tree_model, work, tree, tau):
    """Adds the generalized forces of F to tau; uses tree.F and qdot."""
    for body in range(work.F.shape[0]):
        for c in range(6):
            tree.F[body, c] = work.F[body, c]
    project_forces(tree_model, tree, work.qdot)
    for k in range(tau.shape[0]):
        tau[k] += work.qdot[k]


@kernel(top=True)
def plant_derivatives(
    xc: Vector,
    p: Vector,
    u: Vectors,
    work: DerivativeWork,
    tree_model: TreeModel,
    geometry_model: GeometryModel,
    force_model: ForceModel,
    plant_model: PlantModel,
    out: Vector,
) -> int:
    """Time derivatives of positions and velocities; a status of `contact_solvers`, 0 when all is well."""
    tree = TreeWork(
        work.tree_X_WB, work.tree_S, work.tree_V, work.tree_A, work.tree_inertia, work.tree_composite, work.tree_F,
        work.tree_M, work.tree_L, work.tree_bias,
    )  # fmt: skip
    nv = work.v.shape[0]
    nq = xc.shape[0] - nv
    for k in range(nv):
        work.v[k] = xc[nq + k]
    position_kinematics(tree_model, p, tree, xc)
    body_inertias(tree_model, p, tree)
    velocity_kinematics(tree_model, p, tree, xc, work.v)
    bias_term(tree_model, tree, 1.0)
    put_passive_forces(tree_model, p, tree.bias, work.v, work.force)
    add_element_forces(tree_model, force_model, p, tree, xc, work.qdot, work.force)
    add_applied_forces(plant_model, u, work.applied_force, work.force)
    add_actuation(plant_model, u, work.force, work.net_actuation, False)
    status = add_contacts(tree_model, geometry_model, work, tree)
    if status != SOLVED:
        return status
    mass_matrix(tree_model, p, tree)
    for i in range(tree.M.shape[0]):
        tree.L[i] = tree.M[i]
    if ltdl(tree_model, tree.L) >= 0:
        return MASS_NOT_POSITIVE
    for k in range(nv):
        work.vdot[k] = work.force[k] + work.contact_force[k]
    ltdl_solve(tree_model, tree.L, work.vdot)
    qdot_of_velocity(tree_model, xc, work.v, work.qdot)
    for k in range(nq):
        out[k] = work.qdot[k]
    for k in range(nv):
        out[nq + k] = work.vdot[k]
    return SOLVED
