"""Contacts of a sphere with the other round and flat shapes, from the signed distance of its centre."""

from __future__ import annotations

from sheldrake.common._kernels.vec import add3, rotate, rotate_back, scale3, sub3
from sheldrake.common.kernel import kernel

from .distance import point_box, point_capsule, point_cylinder, point_ellipsoid, point_sphere
from .model import BOX, CAPSULE, CYLINDER, ELLIPSOID
from .table import elastic_reach, emit


@kernel
def point_shape(model, g, p_GQ):
    """Signed distance of Q to sphere, box, cylinder, capsule or ellipsoid g."""
    shape = model[g]
    if shape.kind == BOX:
        return point_box(p_GQ, shape.half_sizes)
    if shape.kind == CYLINDER:
        return point_cylinder(p_GQ, shape.radius, shape.half_length)
    if shape.kind == CAPSULE:
        return point_capsule(p_GQ, shape.radius, shape.half_length)
    if shape.kind == ELLIPSOID:
        return point_ellipsoid(p_GQ, shape.half_sizes)
    return point_sphere(p_GQ, shape.radius)


@kernel
def sphere_distance(model, table, i, j):
    """(phi, nhat_ji_W, p_WCi, p_WCj) of sphere i and shape j: signed distance, normal out of j, nearest points."""
    radius = model[i].radius
    shape = table.poses[j]
    p_WS = table.poses[i].p_WG
    phi, gradient, nearest = point_shape(model, j, rotate_back(shape.R_WG, sub3(p_WS, shape.p_WG)))
    nhat = rotate(shape.R_WG, gradient)
    return phi - radius, nhat, sub3(p_WS, scale3(nhat, radius)), add3(shape.p_WG, rotate(shape.R_WG, nearest))


@kernel(outline=True)
def sphere_contacts(model, table, i, j):
    """Contact of sphere i with shape j."""
    phi, nhat_ji, p_WCi, p_WCj = sphere_distance(model, table, i, j)
    if -phi >= -elastic_reach(model, i, j):
        emit(model, table, i, j, p_WCi, p_WCj, nhat_ji, -phi)
