"""Forces on contact surfaces of the continuous plant: pressure, dissipation and regularised friction, face by face.

The traction at a point is p (1 + d v) along the normal, v the approach speed, and mu (2 / pi) atan(|v_t| / v_s) of that
against the slip (Elandt et al. 2019; Hunt and Crossley 1975). Triangles are integrated with three points each,
polygons with one, their centroid.
"""

from __future__ import annotations

import numpy as np

from sheldrake.common._kernels.generic import atan, sqrt
from sheldrake.common._kernels.vec import add3, cross3, dot3, load3, load3_at, neg3, scale3, sub3
from sheldrake.common.kernel import kernel
from sheldrake.geometry._kernels import hydro_model as hydro
from sheldrake.geometry._kernels import model as geometry
from sheldrake.geometry._kernels.hydro_model import HydroModel, HydroTable
from sheldrake.geometry._kernels.model import GeometryModel
from sheldrake.multibody.contact_solvers._kernels.status import SOLVED
from sheldrake.multibody.plant._kernels.contact_rows import share
from sheldrake.multibody.plant._kernels.derivatives import DerivativeVectors, add_projected, clear, harmonic
from sheldrake.multibody.plant._kernels.hydro_rows import HYDRO_CAPACITY
from sheldrake.multibody.tree._kernels.forces import add_point_force
from sheldrake.multibody.tree._kernels.kinematics import velocity_at
from sheldrake.multibody.tree._kernels.model import ROOT, TreeModel, TreeWork

AREA = hydro.AREA
CENTROID = hydro.CENTROID
CORNER = hydro.CORNER
GEOMETRY_M = hydro.GEOMETRY_M
GEOMETRY_N = hydro.GEOMETRY_N
MODULUS = hydro.MODULUS
NORMAL = hydro.NORMAL
NUM_FACES = hydro.NUM_FACES
PRESSURE = hydro.PRESSURE
STATUS = hydro.STATUS
SURFACE = hydro.SURFACE
TRIANGLES = hydro.TRIANGLES
BODY = geometry.BODY
DISSIPATION = geometry.DISSIPATION
FRICTION_DYNAMIC = geometry.FRICTION_DYNAMIC

TWO_OVER_PI = np.float64(2.0 / np.pi)
STILL = np.float64(1e-14)  # [m/s] slip without friction
NEAR = np.float64(1.0 / 6.0)  # weights of the corners at the three points of a triangle
FAR = np.float64(2.0 / 3.0)


@kernel
def traction_on_B(tree_model, tree, flow, body_a, body_b, p_WQ, pressure, normal, d, mu):
    """Force on B over area at a point Q, whose normal points out of B into A [Pa]."""
    _, v_A = velocity_at(tree, body_a, tree_model.body[body_a, ROOT], p_WQ)
    _, v_B = velocity_at(tree, body_b, tree_model.body[body_b, ROOT], p_WQ)
    v_AB = sub3(v_B, v_A)
    approach = dot3(v_AB, normal)
    factor = 1.0 + d * approach
    traction = scale3(normal, 0.0)
    if pressure > 0.0 and factor > 0.0:
        strength = pressure * factor
        traction = scale3(normal, -strength)
        slip = sub3(v_AB, scale3(normal, approach))
        if dot3(slip, slip) > STILL * STILL:
            speed = sqrt(dot3(slip, slip))
            angle = atan(speed / flow.stiction_tolerance[0])
            traction = add3(traction, scale3(slip, -mu * strength * TWO_OVER_PI * angle / speed))
    return traction


@kernel
def add_force(tree_model, tree, flow, f, body_a, body_b, p_WQ, centroid, force):
    """Adds a force on B at Q, and its opposite on A; notes both force and moment of face f."""
    add_point_force(tree_model, tree, flow.F, body_b, p_WQ, force)
    add_point_force(tree_model, tree, flow.F, body_a, p_WQ, neg3(force))
    moment = cross3(sub3(p_WQ, centroid), force)
    for i in range(3):
        flow.face[f, i] += moment[i]
        flow.face[f, 3 + i] += force[i]


@kernel
def corner_mix(surfaces, a, b, c):
    """Position and pressure at a point of a triangle that is nearest to corner a."""
    p = scale3(load3(surfaces.vertex, a), FAR)
    p = add3(p, scale3(add3(load3(surfaces.vertex, b), load3(surfaces.vertex, c)), NEAR))
    return p, FAR * surfaces.vertex[a, 3] + NEAR * (surfaces.vertex[b, 3] + surfaces.vertex[c, 3])


@kernel
def add_triangle_point(tree_model, tree, surfaces, flow, f, body_a, body_b, corners, d, mu):
    """One third of a triangle's force, at the point near the first of three corners."""
    normal = load3_at(surfaces.value, f, NORMAL)
    p, pressure = corner_mix(surfaces, corners[0], corners[1], corners[2])
    traction = traction_on_B(tree_model, tree, flow, body_a, body_b, p, pressure, normal, d, mu)
    force = scale3(traction, surfaces.value[f, AREA] / 3.0)
    add_force(tree_model, tree, flow, f, body_a, body_b, p, load3_at(surfaces.value, f, CENTROID), force)


@kernel(top=True)
def surface_forces(
    tree: TreeWork,
    surfaces: HydroTable,
    flow: DerivativeVectors,
    tree_model: TreeModel,
    geometry_model: GeometryModel,
    hydro_model: HydroModel,
) -> int:
    """The forces of the contact surfaces found, into `contact_force`; a status of `contact_solvers`."""
    if surfaces.count[STATUS] != 0:
        return HYDRO_CAPACITY
    if surfaces.count[NUM_FACES] == 0:
        return SOLVED
    clear(flow.F)
    material = geometry_model.material
    for f in range(surfaces.count[NUM_FACES]):
        s = surfaces.face[f, SURFACE]
        m = surfaces.surface[s, GEOMETRY_M]
        n = surfaces.surface[s, GEOMETRY_N]
        body_a = geometry_model.geometry[m, BODY]
        body_b = geometry_model.geometry[n, BODY]
        w = share(hydro_model.number[m, MODULUS], hydro_model.number[n, MODULUS])
        d = (1.0 - w) * material[m, DISSIPATION] + w * material[n, DISSIPATION]
        mu = harmonic(material[m, FRICTION_DYNAMIC], material[n, FRICTION_DYNAMIC])
        for i in range(6):
            flow.face[f, i] = 0.0
        if hydro_model.setting[TRIANGLES] == 1:
            a = surfaces.face[f, CORNER]
            b = surfaces.face[f, CORNER + 1]
            c = surfaces.face[f, CORNER + 2]
            for _ in range(3):
                add_triangle_point(tree_model, tree, surfaces, flow, f, body_a, body_b, (a, b, c), d, mu)
                a, b, c = b, c, a
        else:
            p = load3_at(surfaces.value, f, CENTROID)
            normal = load3_at(surfaces.value, f, NORMAL)
            pressure = surfaces.value[f, PRESSURE]
            traction = traction_on_B(tree_model, tree, flow, body_a, body_b, p, pressure, normal, d, mu)
            force = scale3(traction, surfaces.value[f, AREA])
            add_force(tree_model, tree, flow, f, body_a, body_b, p, p, force)
    add_projected(tree_model, flow, tree, flow.contact_force)
    return SOLVED
