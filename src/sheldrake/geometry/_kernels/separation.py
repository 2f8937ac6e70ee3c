"""Signed distance of any two convex shapes: GJK while their cores are apart, EPA when they overlap."""

from __future__ import annotations

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common._kernels.vec import add3, cross3, dot3, scale3, sub3
from sheldrake.common.kernel import kernel

from .epa import EPA_STEPS, epa, make_faces, make_tetrahedron, some_normal
from .feature import what_meets
from .gjk import add_vertex, combine3, gjk, triangle_weights
from .memory import (
    epa_gap,
    follow,
    forget,
    one_is_deepest,
    remember_direction,
    remember_touch,
    remember_what_meets,
    remembers,
    still_apart,
)
from .model import NO_FEATURE, SIMPLEX
from .polish import nearby
from .support import is_curved, is_faceted, margin_of
from .tracking import are_nearest, face_that_meets

_CLEARANCE = 1e-2  # relative to the smaller shape (witnesses: the size): how far shapes are moved apart
_WIDER = 10.0  # times the clearance, where GJK still sees an overlap
_NEAR = 1e-3  # relative to the size: nearer than this, the vector between the cores is too short to tell a direction
_FEATURED = 1e-2  # relative to the size: of shapes with flat faces nearer than this it is told what would meet
_CONVERGED = 1e-13  # relative to the size: a distance is known so well, or GJK was stuck
_REFINEMENTS = 24
_ROUNDING = 1e-14  # relative to the size: a direction that gains or loses no more is the same
_WITNESS_GAP = 1e-10  # relative to the size: how well deepest points must agree with depth and direction
_NO_SHIFT = (0.0, 0.0, 0.0)


@kernel
def separation(model, table, i, j, reach):
    """Signed distance phi of shapes i and j, unit normal from j to i, nearest (or deepest) points on i and j, in W.

    Exact for polytopes, spheres and capsules up to rounding. If phi is larger than `reach` the rest is an estimate.
    """
    return separation_of_pair(model, table, i, j, reach, -1)


@kernel(outline=True)
def separation_of_pair(model, table, i, j, reach, k):
    """`separation` of pair number k, of which something may be remembered; -1 for a pair without memory."""
    size = model[i].bound + model[j].bound
    margin_i = margin_of(model, i)
    margin_j = margin_of(model, j)
    far = reach + margin_i + margin_j
    nhat = (1.0, 0.0, 0.0)
    followed, out, depth, p_i, p_j = False, nhat, 0.0, nhat, nhat
    if remembers(table, k):
        if still_apart(model, table, i, j, size, far, k):
            return reach + size, nhat, nhat, nhat
        followed, out, depth, p_i, p_j = follow(model, table, i, j, size, far, k)
    phi = -depth
    if followed:
        nhat = scale3(out, -1.0)
    else:
        phi, nhat, p_i, p_j = search(model, table, i, j, size, far, k)
    p_i = sub3(p_i, scale3(nhat, margin_i))
    p_j = add3(p_j, scale3(nhat, margin_j))
    return phi - margin_i - margin_j, nhat, p_i, p_j


@kernel(outline=True)
def search(model, table, i, j, size, far, k):
    """`separation` of the cores of a pair, from nothing; for pair k it remembers what was found."""
    n, v, overlap, p_i, p_j = gjk(model, table, i, j, size, far, _NO_SHIFT)
    if overlap:
        return overlap_of_cores(model, table, i, j, size, n, p_i, p_j, k)
    phi = sqrt(dot3(v, v))
    nhat = scale3(v, 1.0 / phi)
    at_once = False
    if phi <= far:
        out = scale3(nhat, -1.0)
        depth = dot3(out, add_vertex(model, table, i, j, out, SIMPLEX + 12, _NO_SHIFT))
        poor = phi < _NEAR * size or phi + depth > _CONVERGED * size
        if phi < _FEATURED * size and is_faceted(model, i) and is_faceted(model, j):
            corners = (0, min(1, n - 1), min(2, n - 1))
            what, d, least, a, b = what_meets(model, table, i, j, size, corners, out, depth)
            face = face_that_meets(model, table, i, j, what, d)
            if are_nearest(model, table, i, j, size, what, face, d, least, a, b):
                if remembers(table, k):
                    remember_what_meets(model, table, i, j, k, 0, 0, False, what, corners, d, least)
                return -least, scale3(d, -1.0), a, b
        if poor or phi < _NEAR * size + margin_of(model, i) + margin_of(model, j):
            at_once, d, least, a, b = nearby(model, table, i, j, size, out, depth)
            if poor and not at_once:
                d, least, a, b = refine(model, table, i, j, size, out, depth, p_i, p_j)
            if poor or at_once:
                phi, nhat, p_i, p_j = -least, scale3(d, -1.0), a, b
    if remembers(table, k):
        if phi > far:
            remember_direction(table, i, k, nhat)
        elif at_once and phi > 0.0:
            remember_touch(table, i, k, nhat)
        else:
            forget(table, k)
    return phi, nhat, p_i, p_j


@kernel(outline=True)
def overlap_of_cores(model, table, i, j, size, n, p_i, p_j, k):
    """`search` where the origin is in the simplex of n vertices that GJK has left."""
    n = make_tetrahedron(model, table, i, j, n, size)
    if n < 4:
        if remembers(table, k):
            forget(table, k)
        return 0.0, flat_normal(table, n), p_i, p_j
    make_faces(table)
    gap = epa_gap(model, i, j, size)
    corners, out, depth, proven, faces, vertices = epa(model, table, i, j, size, gap, (4, 4), EPA_STEPS)
    what, d, found, a, b = what_meets(model, table, i, j, size, corners, out, depth)
    known = what != NO_FEATURE
    if remembers(table, k):
        if known and proven and one_is_deepest(model, i) and one_is_deepest(model, j):
            remember_what_meets(model, table, i, j, k, faces, vertices, True, what, corners, d, found)
        else:
            forget(table, k)
    if known:
        return -found, scale3(d, -1.0), a, b
    first, second, third = corners
    x, y, z = table.vertices[SIMPLEX + first], table.vertices[SIMPLEX + second], table.vertices[SIMPLEX + third]
    w0, w1, w2 = triangle_weights(x.w, y.w, z.w)
    p_i = combine3(x.a, y.a, z.a, w0, w1, w2)
    p_j = combine3(x.b, y.b, z.b, w0, w1, w2)
    if is_curved(model, i) or is_curved(model, j):
        out, depth, p_i, p_j = refine(model, table, i, j, size, out, depth, p_i, p_j)
    out, depth, p_i, p_j = settle_witnesses(model, table, i, j, size, out, depth, p_i, p_j)
    return -depth, scale3(out, -1.0), p_i, p_j


@kernel(outline=True)
def refine(model, table, i, j, size, out, depth, p_i, p_j):
    """A better direction out: GJK tells the nearest way once the shapes are moved apart along `out`, by some clearance.

    Each time (depth + clearance) / (radius of curvature + clearance) of the direction's error is left, so the clearance
    suits the smaller shape; a direction that is no better ends it.
    """
    clearance = _CLEARANCE * min(model[i].bound, model[j].bound)
    for _ in range(_REFINEMENTS):
        shift = scale3(out, depth + clearance)
        _n, v, overlap, a, b = gjk(model, table, i, j, size, 1e300, shift)
        if overlap:  # by rounding, as it is relative to the size
            clearance *= _WIDER
            if clearance > size:
                break
            continue
        d = scale3(v, -1.0 / sqrt(dot3(v, v)))
        w = add_vertex(model, table, i, j, d, SIMPLEX + 12, _NO_SHIFT)
        better = dot3(d, w)
        gain = depth - better
        if gain < -_ROUNDING * size:
            break
        out, depth, p_i, p_j = d, better, a, b
        if gain <= _ROUNDING * size:
            break
    return out, depth, p_i, p_j


@kernel(outline=True)
def settle_witnesses(model, table, i, j, size, out, depth, p_i, p_j):
    """Deepest points that are a depth apart along a direction, these two, and the points.

    Where they are not, what GJK took for an overlap may be none but for rounding: then a direction near `out` is right.
    Or the triangle that gave it is only a part of a face, and the origin in front of another part: then the shapes are
    moved apart along `out`, where GJK finds the points.
    """
    r = sub3(sub3(p_i, p_j), scale3(out, depth))
    if dot3(r, r) > _WITNESS_GAP * _WITNESS_GAP * size * size:
        found, d, least, a, b = nearby(model, table, i, j, size, out, depth)
        if found:
            return d, least, a, b
        shift = scale3(out, depth + _CLEARANCE * size)
        _n, _v, overlap, a, b = gjk(model, table, i, j, size, 1e300, shift)
        if not overlap:
            return out, depth, a, b
    return out, depth, p_i, p_j


@kernel
def flat_normal(table, n):
    """A direction out of a difference that has no volume."""
    p = table.vertices[SIMPLEX].w
    u = sub3(table.vertices[SIMPLEX + 1].w, p)
    if n == 1:
        return (1.0, 0.0, 0.0)
    if n == 2:
        return some_normal(u)
    out = cross3(u, sub3(table.vertices[SIMPLEX + 2].w, p))
    length = sqrt(dot3(out, out))
    if length > 0.0:
        return scale3(out, 1.0 / length)
    return some_normal(u)
