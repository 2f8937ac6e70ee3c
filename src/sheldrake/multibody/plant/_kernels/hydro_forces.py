"""Forces on contact surfaces of the continuous plant: pressure, dissipation and regularised friction, face by face.

The traction at a point is p (1 + d v) along the normal, v the approach speed, and mu (2 / pi) atan(|v_t| / v_s) of that
against the slip (Elandt et al. 2019; Hunt and Crossley 1975). Triangles are integrated with three points each,
polygons with one, their centroid.
"""

from __future__ import annotations

from sheldrake.common._kernels.vec import add3, add6, cross3, neg3, scale3, sub3
from sheldrake.common.kernel import Vector, kernel
from sheldrake.geometry._kernels.hydro_model import HydroModel, HydroTable
from sheldrake.geometry._kernels.model import GeometryModel
from sheldrake.multibody.contact_solvers._kernels.laws import surface_friction
from sheldrake.multibody.contact_solvers._kernels.status import SOLVED
from sheldrake.multibody.plant._kernels.derivatives import DerivativeVectors, add_projected, sliding
from sheldrake.multibody.plant._kernels.hydro_rows import HYDRO_CAPACITY, patch_losses
from sheldrake.multibody.tree._kernels.forces import add_point_force, clear
from sheldrake.multibody.tree._kernels.model import TreeModel, TreeWork

NEAR = 1.0 / 6.0  # weights of the corners at the three points of a triangle
FAR = 2.0 / 3.0


@kernel
def traction_on_B(tree_model, tree, flow, body_a, body_b, p_WQ, pressure, normal, d, mu):
    """Force on B over area at a point Q, whose normal points out of B into A [Pa]."""
    approach, slip, speed = sliding(tree_model, tree, body_a, body_b, p_WQ, normal)
    factor = 1.0 + d * approach
    traction = scale3(normal, 0.0)
    if pressure > 0.0 and factor > 0.0:
        strength = pressure * factor
        traction = scale3(normal, -strength)
        if speed > 0.0:
            friction = surface_friction(-mu * strength, speed / flow.stiction_tolerance[0])
            traction = add3(traction, scale3(slip, friction / speed))
    return traction


@kernel
def add_force(tree_model, tree, flow, f, body_a, body_b, p_WQ, centroid, force):
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
    add_force(tree_model, tree, flow, f, body_a, body_b, p, face.p_WC, force)


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
            add_force(tree_model, tree, flow, f, body_a, body_b, C, C, force)
    add_projected(tree_model, flow, tree, flow.contact_force)
    return SOLVED
