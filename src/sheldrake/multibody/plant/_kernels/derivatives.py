"""The continuous plant: xdot = (N(q) v, vdot), with compliant contact and regularised friction."""

from typing import Annotated, NamedTuple

from sheldrake.common._kernels.generic import is_finite, sqrt
from sheldrake.common._kernels.vec import add3, add6, cross3, dot3, load6, neg3, scale3, sub3
from sheldrake.common.kernel import IntVector, Matrix, Vector, Vectors, kernel
from sheldrake.common.record import Items, Record, number, numbers, table
from sheldrake.geometry._kernels.hydro_model import HydroModel, HydroTable
from sheldrake.geometry._kernels.model import ContactTable, GeometryModel
from sheldrake.geometry._kernels.table import place_geometry
from sheldrake.multibody.contact_solvers._kernels.laws import hunt_crossley, stribeck, surface_friction
from sheldrake.multibody.contact_solvers._kernels.problem import (
    CONTACT_CAPACITY,
    MASS_NOT_POSITIVE,
    MOTION_NOT_FINITE,
    SOLVED,
)
from sheldrake.multibody.plant._kernels.contacts import HYDRO_CAPACITY, friction_of_pair, material_of_pair, patch_losses
from sheldrake.multibody.plant._kernels.forces import (
    add_applied_forces,
    add_controlled_actuation,
    add_element_forces,
    any_locked,
    controlled_effort,
    is_locked,
    lock_mass_matrix,
    put_passive_forces,
)
from sheldrake.multibody.plant._kernels.model import PlantModel
from sheldrake.multibody.plant._kernels.surface_velocities import put_turns, surface_drift
from sheldrake.multibody.tree._kernels.dynamics import (
    bias_term,
    body_inertias,
    ltdl,
    ltdl_solve,
    mass_matrix,
    project_forces,
)
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
        surface_speed, surface_turn: as in `StepVectors`, the latter zero where no surface runs.
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
    surface_speed: Vector
    surface_turn: Matrix
    face: Annotated[Matrix, Items("faces", FaceForce)]


class DerivativeWork(NamedTuple):
    """Scratch of the derivatives: the work of every stage."""

    tree: TreeWork
    table: ContactTable
    flow: DerivativeVectors
    surfaces: HydroTable


@kernel
def sliding(model, tree, flow, body_A, body_B, p_WC, nhat):
    """Of B against A at a point: speed of approach along nhat, slip velocity, slip speed (0 for what is STILL)."""
    _, v_A = velocity_at(model, tree, body_A, p_WC)
    _, v_B = velocity_at(model, tree, body_B, p_WC)
    v_AB = sub3(v_B, sub3(v_A, surface_drift(flow.surface_turn, body_A, body_B, nhat)))
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
    approach, v_t, slip = sliding(model, tree, flow, found.body_A, found.body_B, middle, nhat)
    A, B = geometry_model[a], geometry_model[b]
    _, (k, d, _, mu_d) = material_of_pair(model, p, A, B)
    normal, _ = hunt_crossley(k * found.depth, d, -approach)
    f_B = scale3(nhat, 0.0)
    if normal > 0.0:
        f_B = scale3(nhat, -normal)
        if slip > STILL:
            mu_s = friction_of_pair(model, p, A, B, A.friction_static, B.friction_static)
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


# ---- forces on contact surfaces, face by face
#
# The traction at a point is p (1 + d v) along the normal, v the approach speed, and mu (2 / pi) atan(|v_t| / v_s) of
# that against the slip (Elandt et al. 2019; Hunt and Crossley 1975). Triangles are integrated with three points each,
# polygons with one, their centroid.

NEAR = 1.0 / 6.0  # weights of the corners at the three points of a triangle
FAR = 2.0 / 3.0


@kernel
def traction_on_B(tree_model, tree, flow, body_a, body_b, p_WQ, pressure, normal, d, mu):
    """Force on B over area at a point Q, whose normal points out of B into A [Pa]."""
    approach, slip, speed = sliding(tree_model, tree, flow, body_a, body_b, p_WQ, normal)
    strength, _ = hunt_crossley(pressure, d, -approach)
    traction = scale3(normal, 0.0)
    if strength > 0.0:
        traction = scale3(normal, -strength)
        if speed > 0.0:
            friction = surface_friction(-mu * strength, speed / flow.stiction_tolerance[0])
            traction = add3(traction, scale3(slip, friction / speed))
    return traction


@kernel
def add_face_force(tree_model, tree, flow, f, body_a, body_b, p_WQ, centroid, force):
    """Adds a force on B at Q, and its opposite on A; notes both force and moment of face f."""
    add_point_force(tree_model, tree, flow.F, body_b, p_WQ, force)
    add_point_force(tree_model, tree, flow.F, body_a, p_WQ, neg3(force))
    moment = cross3(sub3(p_WQ, centroid), force)
    face = flow.faces[f]
    face.F = add6(face.F, (moment, force))


@kernel
def corner_mix(surfaces, a, b, c):
    """Position and pressure at a point of a triangle that is nearest to corner a."""
    u, v, w = surfaces.vertices[a], surfaces.vertices[b], surfaces.vertices[c]
    p = add3(scale3(u.p_WV, FAR), scale3(add3(v.p_WV, w.p_WV), NEAR))
    return p, FAR * u.pressure + NEAR * (v.pressure + w.pressure)


@kernel
def add_triangle_point(tree_model, tree, surfaces, flow, f, body_a, body_b, corners, d, mu):
    """One third of a triangle's force, at the point near the first of three corners."""
    face = surfaces[f]
    p, pressure = corner_mix(surfaces, corners[0], corners[1], corners[2])
    traction = traction_on_B(tree_model, tree, flow, body_a, body_b, p, pressure, face.normal, d, mu)
    force = scale3(traction, face.area / 3.0)
    add_face_force(tree_model, tree, flow, f, body_a, body_b, p, face.p_WC, force)


# ---- stages


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
    nq = flow.qdot.shape[0]
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
    add_controlled_actuation(plant_model, xc, v, p, u, flow.force, flow.net_actuation)
    place_geometry(geometry_model, tree, table)


@kernel(top=True)
def run_surfaces(tree: TreeWork, flow: DerivativeVectors, tree_model: TreeModel, plant_model: PlantModel) -> None:
    """What the surfaces of belts run at."""
    put_turns(plant_model, tree, flow.surface_speed, flow.surface_turn)


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


@kernel(top=True)
def surface_forces(
    p: Vector,
    tree: TreeWork,
    surfaces: HydroTable,
    flow: DerivativeVectors,
    tree_model: TreeModel,
    geometry_model: GeometryModel,
    hydro_model: HydroModel,
) -> int:
    """The forces of the contact surfaces found, into `contact_force`; a status of `contact_solvers`."""
    if surfaces.status != 0:
        return HYDRO_CAPACITY
    if surfaces.num_faces == 0:
        return SOLVED
    clear(flow.F)
    for f in range(surfaces.num_faces):
        face = surfaces[f]
        patch = surfaces.patches[face.surface]
        m, n = patch.geometry_M, patch.geometry_N
        body_a, body_b = geometry_model[m].body, geometry_model[n].body
        d, _, mu = patch_losses(tree_model, geometry_model, p, hydro_model, m, n)
        flow.faces[f].F = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
        if hydro_model.triangles == 1:
            a, b, c = face.corners
            for _ in range(3):
                add_triangle_point(tree_model, tree, surfaces, flow, f, body_a, body_b, (a, b, c), d, mu)
                a, b, c = b, c, a
        else:
            C = face.p_WC
            traction = traction_on_B(tree_model, tree, flow, body_a, body_b, C, face.pressure, face.normal, d, mu)
            force = scale3(traction, face.area)
            add_face_force(tree_model, tree, flow, f, body_a, body_b, C, C, force)
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
    """Time derivatives of positions, velocities and displacements of surfaces; a status of `contact_solvers`."""
    nv = flow.v.shape[0]
    nq = flow.qdot.shape[0]
    for k in range(nq):
        if not is_finite(xc[k]):  # of what is free, velocities and their derivatives do not depend on it
            return MOTION_NOT_FINITE
    mass_matrix(tree_model, p, tree, tree.M)
    if any_locked(plant_model, p):
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
    for k in range(flow.surface_speed.shape[0]):
        out[nq + nv + k] = flow.surface_speed[k]
    return SOLVED


@kernel(top=True)
def net_actuation_now(
    xc: Vector,
    p: Vector,
    u: Vectors,
    plant_model: PlantModel,
    select_model: IntVector,
    flow: DerivativeVectors,
    net_actuation: Vector,
) -> None:
    """Efforts of some actuators at the present state [N m or N]."""
    nq = flow.qdot.shape[0]
    for k in range(net_actuation.shape[0]):
        i = select_model[k]
        actuator = plant_model.actuators[i]
        net_actuation[k] = controlled_effort(plant_model, i, xc[actuator.q], xc[nq + actuator.dof], p, u)
