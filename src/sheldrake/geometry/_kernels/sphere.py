"""Contacts of a sphere with the other round and flat shapes, from the signed distance of its centre."""

from __future__ import annotations

from sheldrake.common._kernels.vec import add3, load3, rotate, rotate_back, scale3, sub3
from sheldrake.common.kernel import kernel

from .distance import point_box, point_capsule, point_cylinder, point_ellipsoid, point_sphere
from .model import BOX, CAPSULE, CYLINDER, ELLIPSOID, HALF_LENGTH, KIND, RADIUS
from .table import elastic_reach, emit, position_of, rotation_of


@kernel
def point_shape(model, g, p_GQ):
    """Signed distance of Q to sphere, box, cylinder, capsule or ellipsoid g."""
    kind = model.geometry[g, KIND]
    if kind == BOX:
        return point_box(p_GQ, load3(model.size, g))
    if kind == CYLINDER:
        return point_cylinder(p_GQ, model.size[g, RADIUS], model.size[g, HALF_LENGTH])
    if kind == CAPSULE:
        return point_capsule(p_GQ, model.size[g, RADIUS], model.size[g, HALF_LENGTH])
    if kind == ELLIPSOID:
        return point_ellipsoid(p_GQ, load3(model.size, g))
    return point_sphere(p_GQ, model.size[g, RADIUS])


@kernel(outline=True)
def sphere_contacts(model, table, i, j):
    """Contact of sphere i with shape j."""
    radius = model.size[i, RADIUS]
    R_WG = rotation_of(table, j)
    p_WG = position_of(table, j)
    p_WS = position_of(table, i)
    phi, gradient, nearest = point_shape(model, j, rotate_back(R_WG, sub3(p_WS, p_WG)))
    depth = radius - phi
    if depth >= -elastic_reach(model, i, j):
        nhat_ji_W = rotate(R_WG, gradient)
        p_WCj = add3(p_WG, rotate(R_WG, nearest))
        emit(model, table, i, j, sub3(p_WS, scale3(nhat_ji_W, radius)), p_WCj, nhat_ji_W, depth)
