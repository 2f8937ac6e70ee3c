"""Placing geometry in the world and writing contacts."""

from __future__ import annotations

from sheldrake.common._kernels.vec import add3, compose, load3_at, load9, rotate, scale3, store3_at, store9
from sheldrake.common.kernel import kernel

from .model import (
    BODY,
    CAPACITY_EXCEEDED,
    CENTRE,
    CENTRE_W,
    DEPTH,
    DISSIPATION,
    ELASTIC,
    HALF_SPACE,
    KIND,
    MULTI_POINT,
    NHAT_BA_W,
    P_WCA,
    P_WCB,
    POSITION,
    SEVERAL,
    SPHERE,
)

MIN_DEPTH = 2.220446049250313e-16  # [m] polytopes and round shapes must overlap by more; spheres may just touch


@kernel
def least_depth(model, i, j):
    """Depth beyond which a point of shapes i and j is a contact [m].

    Where a pair has several points, those that are not yet touching count too, a little before they do: else a stiff
    and light body hops from one corner to the other, as each corner is free while the step that lands it is solved.
    The contact law gives such a point no force unless it is about to touch within the step. Pairs without dissipation
    are seen so early that the law can account for all of their energy.
    """
    if model.geometry[i, MULTI_POINT] + model.geometry[j, MULTI_POINT] == 2:
        return MIN_DEPTH - model.margin[SEVERAL] - elastic_reach(model, i, j)
    return MIN_DEPTH


@kernel
def elastic_reach(model, i, j):
    """How far ahead a pair is seen because neither of its shapes dissipates [m]; 0 if it is no such pair.

    One shape is a ball or a half space: points of other pairs jump from edge to edge, and can not account for energy.
    """
    if model.margin[ELASTIC] > 0.0:
        if model.material[i, DISSIPATION] == 0.0 and model.material[j, DISSIPATION] == 0.0:
            kind_i = model.geometry[i, KIND]
            kind_j = model.geometry[j, KIND]
            if kind_i == SPHERE or kind_j == SPHERE or kind_i == HALF_SPACE or kind_j == HALF_SPACE:
                return model.margin[ELASTIC]
    return 0.0 * model.margin[ELASTIC]


@kernel
def absolute(x):
    return -x if x < 0.0 else x


@kernel
def column(R, k):
    """Axis k of a frame."""
    if k == 0:
        return (R[0], R[3], R[6])
    if k == 1:
        return (R[1], R[4], R[7])
    return (R[2], R[5], R[8])


@kernel
def place_geometry(model, X_WB, table):
    """X_WG of all geometries."""
    for g in range(model.geometry.shape[0]):
        body = model.geometry[g, BODY]
        R_WB = load9(X_WB, body)
        R_WG = compose(R_WB, load9(model.X_BG, g))
        store9(table.X_WG, g, R_WG)
        p_WG = add3(load3_at(X_WB, body, POSITION), rotate(R_WB, load3_at(model.X_BG, g, POSITION)))
        store3_at(table.X_WG, g, POSITION, p_WG)
        store3_at(table.X_WG, g, CENTRE_W, add3(p_WG, rotate(R_WG, load3_at(model.size, g, CENTRE))))


@kernel
def rotation_of(table, g):
    return load9(table.X_WG, g)


@kernel
def position_of(table, g):
    return load3_at(table.X_WG, g, POSITION)


@kernel
def bounding_centre(table, g):
    """Centre of the bounding sphere in W."""
    return load3_at(table.X_WG, g, CENTRE_W)


@kernel(outline=True)
def emit(model, table, i, j, p_WCi, p_WCj, nhat_ji_W, depth):
    """Appends a contact of geometries i and j (in any order); nhat_ji_W points out of j into i."""
    n = table.count[0]
    if n >= table.pair.shape[0]:
        table.count[1] = CAPACITY_EXCEEDED
        return
    a = i
    b = j
    if i < j:
        store3_at(table.point, n, P_WCA, p_WCi)
        store3_at(table.point, n, P_WCB, p_WCj)
        store3_at(table.point, n, NHAT_BA_W, nhat_ji_W)
    else:
        a = j
        b = i
        store3_at(table.point, n, P_WCA, p_WCj)
        store3_at(table.point, n, P_WCB, p_WCi)
        store3_at(table.point, n, NHAT_BA_W, scale3(nhat_ji_W, -1.0))
    table.point[n, DEPTH] = depth
    table.pair[n, 0] = a
    table.pair[n, 1] = b
    table.pair[n, 2] = model.geometry[a, BODY]
    table.pair[n, 3] = model.geometry[b, BODY]
    table.count[0] = n + 1
