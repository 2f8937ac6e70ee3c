"""Placing geometry in the world and writing contacts."""

from __future__ import annotations

from sheldrake.common._kernels.vec import add3, compose, rotate, scale3
from sheldrake.common.kernel import LaneMemory, kernel

from .model import CAPACITY_EXCEEDED, HALF_SPACE, SPHERE, ContactTable, Found

CORNERS = ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))  # of a square, counter-clockwise
MIN_DEPTH = 2.220446049250313e-16  # [m] polytopes and round shapes must overlap by more; spheres may just touch


@kernel
def several_points(model, i, j):
    """Whether shapes i and j touch in several points."""
    return model[i].multi_point + model[j].multi_point == 2


@kernel
def least_depth(model, i, j):
    """Depth beyond which a point of shapes i and j is a contact [m].

    Where a pair has several points, those that are not yet touching count too, a little before they do: else a stiff
    and light body hops from one corner to the other, as each corner is free while the step that lands it is solved.
    The contact law gives such a point no force unless it is about to touch within the step. Pairs without dissipation
    are seen so early that the law can account for all of their energy.
    """
    if several_points(model, i, j):
        return MIN_DEPTH - model.several_margin - elastic_reach(model, i, j)
    return MIN_DEPTH


@kernel
def elastic_reach(model, i, j):
    """How far ahead a pair is seen because neither of its shapes dissipates [m]; 0 if it is no such pair.

    One shape is a ball or a half space: points of other pairs jump from edge to edge, and can not account for energy.
    """
    if model.elastic_margin > 0.0 and model[i].dissipation == 0.0 and model[j].dissipation == 0.0:
        for kind in (model[i].kind, model[j].kind):
            if kind == SPHERE or kind == HALF_SPACE:
                return model.elastic_margin
    return 0.0 * model.elastic_margin


@kernel
def absolute(x):
    return -x if x < 0.0 else x


@kernel
def reach_along(half, normal):
    """How far a box of half sizes `half` reaches along a direction [m]."""
    return half[0] * absolute(normal[0]) + half[1] * absolute(normal[1]) + half[2] * absolute(normal[2])


@kernel
def longest(v):
    """The number of the component that is largest without its sign, the first of equal ones; and that component."""
    k, most = 0, v[0]
    if absolute(v[1]) > absolute(most):
        k, most = 1, v[1]
    if absolute(v[2]) > absolute(most):
        k, most = 2, v[2]
    return k, most


@kernel
def column(R, k):
    """Axis k of a frame."""
    if k == 0:
        return (R[0], R[3], R[6])
    if k == 1:
        return (R[1], R[4], R[7])
    return (R[2], R[5], R[8])


@kernel
def place_geometry(model, bodies, table):
    """Poses of all geometries for those of the bodies, a table with R_WB and p_WB; no contacts yet."""
    table.num_contacts = 0
    table.status = 0
    for g in range(model.geometry.shape[0]):
        body = bodies[model[g].body]
        R_WG = compose(body.R_WB, model[g].R_BG)
        p_WG = add3(body.p_WB, rotate(body.R_WB, model[g].p_BG))
        pose = table.poses[g]
        pose.R_WG, pose.p_WG = R_WG, p_WG
        pose.centre_W = add3(p_WG, rotate(R_WG, model[g].centre_G))


@kernel
def ordered(model, a, b):
    """The two geometries, the one of the lower kind first."""
    if model[b].kind < model[a].kind:
        return b, a
    return a, b


@kernel(outline=True)
def emit(model, table, i, j, p_WCi, p_WCj, nhat_ji_W, depth):
    """Appends a contact of geometries i and j (in any order); nhat_ji_W points out of j into i."""
    n = table.num_contacts
    if n >= table.pair.shape[0]:
        table.status = CAPACITY_EXCEEDED
        return
    contact = table[n]
    if i < j:
        contact.who = (i, j, model[i].body, model[j].body)
        contact.p_WCa, contact.p_WCb, contact.nhat_BA_W = p_WCi, p_WCj, nhat_ji_W
    else:
        contact.who = (j, i, model[j].body, model[i].body)
        contact.p_WCa, contact.p_WCb, contact.nhat_BA_W = p_WCj, p_WCi, scale3(nhat_ji_W, -1.0)
    contact.depth = depth
    table.num_contacts = n + 1


def contacts_in_lanes(*arguments: object) -> LaneMemory:
    """What a search for contacts that remembers nothing reads and writes, for four worlds at once."""
    (table,) = (argument for argument in arguments if isinstance(argument, ContactTable))
    count = table.count[Found.num_contacts : Found.status]
    tables = (table.pair, count), (table.point, count)
    return LaneMemory(reads=(table.X_WG,), writes=(table.count,), tables=tables, changes=(table.count,))
