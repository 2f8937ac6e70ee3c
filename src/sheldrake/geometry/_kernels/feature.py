"""Where two polytopes overlap least, as a function of what meets there alone: a face and a vertex, or two edges.

The search for it may come by many ways to a triangle of the difference; said by face and vertex, the answer has the
same bits whichever it was.
"""

from __future__ import annotations

from sheldrake.common._kernels.generic import sqrt, whole
from sheldrake.common._kernels.vec import add3, cross3, dot3, rotate_back, scale3, sub3
from sheldrake.common.kernel import kernel

from .model import (
    BOX,
    BY_DIRECTION,
    CAPSULE,
    FACE_AND_VERTEX,
    FACE_ON_MORE,
    HULL,
    MORE_ON_FACE,
    NO_FEATURE,
    SIMPLEX,
    TWO_EDGES,
    VERTEX_AND_FACE,
)
from .polish import nearby
from .support import (
    best_face,
    core_vertex,
    farthest_vertex,
    has_faces,
    height_of_face,
    is_curved,
    within_face,
)
from .table import absolute, several_points

_SAME = 1e-8  # 1 - cosine: a face that looks so well along the direction found is what gave it, if it is as deep
_AS_DEEP = 1e-11  # relative to the size
_LONE = 1e-9  # relative to the bound: a vertex no lower than this meets as well
_CROSSING = 1e-6  # sine of the angle between two edges that give a direction
_BEYOND = 1e-9  # relative to an edge: how far behind its end a point may be


@kernel(outline=True)
def meets_alone(model, table, g, v, other, d_W):
    """Whether no vertex of g next to its vertex v, but `other`, is as far along d_W as v."""
    d = rotate_back(table.poses[g].R_WG, d_W)
    kind = model[g].kind
    least = _LONE * model[g].bound
    if kind == HULL:
        row = model[g].first_vertex + v
        p = model.vertices[row].p_GV
        for k in range(model.topology[row], model.topology[row + 1]):
            near = model.topology[k]
            if near - model[g].first_vertex != other and dot3(d, sub3(p, model.vertices[near].p_GV)) <= least:
                return False
    elif kind == BOX or kind == CAPSULE:
        h = model[g].half_sizes
        for k in range(3):
            inwards = d[k] if v & (1 << k) else -d[k]
            apart = 2.0 * inwards * (h[0], h[1], h[2])[k]
            if (kind == BOX or k == 2) and v ^ (1 << k) != other and apart <= least:
                return False
    return True


@kernel(outline=True)
def vertex_under_face(model, table, g, face, other, v, n):
    """(whether vertex v of `other` alone is lowest under a face of g with outward normal n, depth, points on both)."""
    p = core_vertex(model, table, other, v)
    depth = height_of_face(model, table, g, face, n) - dot3(n, p)
    return meets_alone(model, table, other, v, -1, scale3(n, -1.0)), depth, add3(p, scale3(n, depth)), p


@kernel(outline=True)
def face_and_vertex(model, table, g, other, v, out, depth, size):
    """(whether a face of g, seen along `out`, meets vertex v of `other` alone, its normal, depth, points on both)."""
    if not has_faces(model, g):
        return False, out, depth, out, out
    face, n = best_face(model, table, g, out)
    if dot3(n, out) < 1.0 - _SAME:
        return False, out, depth, out, out
    alone, found, p_g, p = vertex_under_face(model, table, g, face, other, v, n)
    return alone and absolute(found - depth) <= _AS_DEEP * size, n, found, p_g, p


@kernel(outline=True)
def edge_across_edge(model, table, i, j, a, b, out):
    """(whether edges a of i and b of j cross and meet alone, their normal, depth, points on both).

    Edges are pairs of numbers of vertices, the lower one first; the normal is that of both edges on the side of `out`.
    """
    p = core_vertex(model, table, i, a[0])
    q = core_vertex(model, table, j, b[0])
    e = sub3(core_vertex(model, table, i, a[1]), p)
    f = sub3(core_vertex(model, table, j, b[1]), q)
    c = cross3(e, f)
    cc = dot3(c, c)
    if cc <= _CROSSING * _CROSSING * dot3(e, e) * dot3(f, f):
        return False, out, 0.0, p, q
    n = scale3(c, 1.0 / sqrt(cc))
    if dot3(n, out) < 0.0:
        n = scale3(n, -1.0)
    depth = dot3(n, sub3(p, q))
    r = sub3(sub3(p, q), scale3(n, depth))
    s = -dot3(cross3(r, f), c) / cc
    t = -dot3(cross3(r, e), c) / cc
    good = min(s, t) >= -_BEYOND and max(s, t) <= 1.0 + _BEYOND
    good = good and meets_alone(model, table, i, a[0], a[1], n) and meets_alone(model, table, i, a[1], a[0], n)
    back = scale3(n, -1.0)
    good = good and meets_alone(model, table, j, b[0], b[1], back) and meets_alone(model, table, j, b[1], b[0], back)
    return good, n, depth, add3(p, scale3(e, s)), add3(q, scale3(f, t))


@kernel(outline=True)
def two_edges(model, table, i, j, a, b, out, depth, size):
    """(whether edge a of i meets edge b of j alone, their common normal, depth, points on both)."""
    good, n, found, p_i, p_j = edge_across_edge(model, table, i, j, a, b, out)
    good = good and dot3(n, out) >= 1.0 - _SAME and absolute(found - depth) <= _AS_DEEP * size
    return good, n, found, p_i, p_j


@kernel
def number_of(table, corner, k):
    """Number of a vertex of the difference among those of the first (k = 0) or second shape."""
    return whole(table.vertices[SIMPLEX + corner].whose[k])


@kernel
def lower_and_other(a, b, c):
    """Of three numbers that are two different ones, these two, the lower one first."""
    other = b if b != a else c
    return (a, other) if a < other else (other, a)


@kernel
def are_two(a, b, c):
    return (a == b or b == c or c == a) and not (a == b and b == c)


@kernel
def kind_of_feature(table, corners):
    """(what meets in the nearest triangle of the difference, its numbers): see `Slot`."""
    a0, a1, a2 = number_of(table, corners[0], 0), number_of(table, corners[1], 0), number_of(table, corners[2], 0)
    b0, b1, b2 = number_of(table, corners[0], 1), number_of(table, corners[1], 1), number_of(table, corners[2], 1)
    if b0 == b1 and b1 == b2:
        return FACE_AND_VERTEX, (b0, 0, 0, 0)
    if a0 == a1 and a1 == a2:
        return VERTEX_AND_FACE, (a0, 0, 0, 0)
    if are_two(a0, a1, a2) and are_two(b0, b1, b2):
        a, b = lower_and_other(a0, a1, a2), lower_and_other(b0, b1, b2)
        return TWO_EDGES, (a[0], a[1], b[0], b[1])
    return NO_FEATURE, (0, 0, 0, 0)


@kernel(outline=True)
def more_under_face(model, table, g, face, other, n, size):
    """(whether the lowest vertex of `other` is over a face of g with outward normal n, depth, points on both).

    Of several lowest ones any does, as all are as deep.
    """
    _number, p = farthest_vertex(model, table, other, scale3(n, -1.0))
    depth = height_of_face(model, table, g, face, n) - dot3(n, p)
    p_g = add3(p, scale3(n, depth))
    return within_face(model, table, g, face, n, p_g, -_BEYOND * size), depth, p_g, p


@kernel(outline=True)
def face_and_more(model, table, g, other, out, depth, size):
    """`face_and_vertex` where more than a vertex meets the face."""
    if not has_faces(model, g):
        return False, out, depth, out, out
    face, n = best_face(model, table, g, out)
    if dot3(n, out) < 1.0 - _SAME:
        return False, out, depth, out, out
    over, found, p_g, p = more_under_face(model, table, g, face, other, n, size)
    return over and absolute(found - depth) <= _AS_DEEP * size, n, found, p_g, p


@kernel(outline=True)
def what_meets(model, table, i, j, size, corners, out, depth):
    """From the nearest triangle of the difference: (what meets there, direction out of i - j, depth, points).

    NO_FEATURE if it is not to be told. The points are on i and on j. Where shapes are curved, what meets near the
    direction may be anything.
    """
    if is_curved(model, i) or is_curved(model, j):
        known, n, found, p, q = nearby(model, table, i, j, size, out, depth)
        return BY_DIRECTION if known else NO_FEATURE, n, found, p, q
    what, who = kind_of_feature(table, corners)
    known, n, found, p, q = False, out, depth, out, out
    if what == FACE_AND_VERTEX:
        known, n, found, p, q = face_and_vertex(model, table, i, j, who[0], out, depth, size)
    elif what == VERTEX_AND_FACE:
        known, n, found, q, p = face_and_vertex(model, table, j, i, who[0], scale3(out, -1.0), depth, size)
        n = scale3(n, -1.0)
    elif what == TWO_EDGES:
        known, n, found, p, q = two_edges(model, table, i, j, (who[0], who[1]), (who[2], who[3]), out, depth, size)
    if known:
        return what, n, found, p, q
    if several_points(model, i, j):
        known, n, found, p, q = face_and_more(model, table, i, j, out, depth, size)
        if known:
            return FACE_ON_MORE, n, found, p, q
        known, n, found, q, p = face_and_more(model, table, j, i, scale3(out, -1.0), depth, size)
        if known:
            return MORE_ON_FACE, scale3(n, -1.0), found, p, q
    return NO_FEATURE, out, depth, out, out
