"""Signed distances of pairs of geometries, touching or not."""

from __future__ import annotations

from sheldrake.common._kernels.vec import dot3, neg3, rotate_back, scale3, sub3
from sheldrake.common.kernel import kernel

from .model import ELLIPSOID, HALF_SPACE, SPHERE, X_AXIS, Z_AXIS, BodyPoses, ContactTable, GeometryModel
from .separation import separation
from .sphere import sphere_distance
from .support import margin_of, support
from .table import column, emit, ordered, place_geometry


@kernel(outline=True)
def signed_distance(model, table, i, j, reach):
    """(phi, nhat_ji_W, p_WCi, p_WCj) of shapes i and j, the kind of i not after that of j."""
    if model[j].kind == HALF_SPACE:
        nhat = column(table.poses[j].R_WG, Z_AXIS)
        p_WCi = sub3(support(model, table, i, scale3(nhat, -1.0)), scale3(nhat, margin_of(model, i)))
        phi = dot3(nhat, sub3(p_WCi, table.poses[j].p_WG))
        return phi, nhat, p_WCi, sub3(p_WCi, scale3(nhat, phi))
    if model[i].kind == SPHERE and model[j].kind <= ELLIPSOID:
        return sphere_distance(model, table, i, j)
    return separation(model, table, i, j, reach)


@kernel(top=True)
def find_distances(geometry_model: GeometryModel, bodies: BodyPoses, reach: float, table: ContactTable) -> int:
    """Fills the table with one row for every pair whose signed distance is at most `reach`; its depth is -distance."""
    model = geometry_model
    place_geometry(model, bodies, table)
    for k in range(len(model.pairs)):
        i, j = ordered(model, model.pairs[k].a, model.pairs[k].b)
        phi, nhat_ji, p_WCi, p_WCj = signed_distance(model, table, i, j, reach)
        if phi <= reach:
            emit(model, table, i, j, p_WCi, p_WCj, nhat_ji, -phi)
    return table.status


@kernel(top=True)
def see_from_geometries(geometry_model: GeometryModel, table: ContactTable) -> None:
    """Points found are those in the frames of their geometries from now on, p_ACa for p_WCa, p_BCb for p_WCb."""
    for c in range(table.num_contacts):
        contact = table[c]
        A, B = table.poses[contact.geometry_A], table.poses[contact.geometry_B]
        contact.p_WCa = rotate_back(A.R_WG, sub3(contact.p_WCa, A.p_WG))
        contact.p_WCb = rotate_back(B.R_WG, sub3(contact.p_WCb, B.p_WG))


@kernel(top=True)
def see_from_point(geometry_model: GeometryModel, table: ContactTable) -> None:
    """The same where B is always a point, of which nobody wants to know where it is, and the normal turned to it.

    In the centre of a sphere, from where all of it is as near, that is along the sphere's x axis, as in Drake.
    """
    model = geometry_model
    for c in range(table.num_contacts):
        contact = table[c]
        A = table.poses[contact.geometry_A]
        contact.p_WCa = rotate_back(A.R_WG, sub3(contact.p_WCa, A.p_WG))
        contact.nhat_BA_W = neg3(contact.nhat_BA_W)
        radius = model[contact.geometry_A].radius
        if model[contact.geometry_A].kind == SPHERE and contact.depth > radius - 1e-14:
            p_GQ = rotate_back(A.R_WG, sub3(table.poses[contact.geometry_B].p_WG, A.p_WG))
            contact.depth = radius - p_GQ[0]
            contact.p_WCa = (radius, 0.0, 0.0)
            contact.nhat_BA_W = column(A.R_WG, X_AXIS)
