"""Distance and depth of convex shapes from their farthest points alone.

GJK (Gilbert, Johnson, Keerthi 1988; Ericson 2005, sections 5.1 and 9.5) finds the point of the difference of two cores
that is nearest to the origin; EPA (van den Bergen 2001) grows a polytope inside the difference towards its surface
where it is nearest. Both are bounded: at a bound they give the best answer found, and every answer to a penetration is
a direction and the exact distance by which a move along it separates the shapes. Vertices are rows of table.work from
SIMPLEX on: w = a - b, a, b with a on shape i and b on shape j.
"""

from __future__ import annotations

import numpy as np

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common._kernels.vec import add3, cross3, dot3, load3, load3_at, scale3, store3, store3_at, sub3
from sheldrake.common.kernel import kernel

from .model import (
    BOUND,
    CORNER,
    CYLINDER,
    ELLIPSOID,
    FACE,
    HORIZON,
    KIND,
    MAX_FACES,
    MAX_VERTICES,
    ON_I,
    ON_J,
    SIMPLEX,
    STACK,
)
from .support import margin_of, support
from .table import absolute, bounding_centre

_GJK_STEPS = 96
_EPA_STEPS = 120
_TOUCHING = 1e-10  # relative to the size: cores closer than this are treated as overlapping
_GAP = 1e-14  # GJK stops when the distance is known this well, relative to the size
_EPA_GAP = 1e-13  # the same for EPA on polytopes
_EPA_GAP_SMOOTH = 1e-6  # and on curved shapes, whose answer is then refined
_CLEARANCE = 1e-2  # relative to the size: how far a refinement moves the shapes apart
_REFINEMENTS = 12
_NO_SHIFT = (0.0, 0.0, 0.0)
_NONE = np.int64(-1)
_0 = np.int64(0)
_1 = np.int64(1)
_2 = np.int64(2)
_3 = np.int64(3)
_4 = np.int64(4)


@kernel(outline=True)
def add_vertex(model, table, i, j, d, row, shift):
    """The vertex of the difference, less `shift`, that is farthest along d, into a row; its w."""
    a = support(model, table, i, d)
    b = support(model, table, j, scale3(d, -1.0))
    w = sub3(sub3(a, b), shift)
    store3(table.work, row, w)
    store3_at(table.work, row, ON_I, a)
    store3_at(table.work, row, ON_J, b)
    return w


@kernel
def segment_weights(a, b):
    """Barycentric weights of the point of segment ab nearest to the origin."""
    ab = sub3(b, a)
    length2 = dot3(ab, ab)
    t = 0.0
    if length2 > 0.0:
        t = -dot3(a, ab) / length2
    if t < 0.0:
        t = 0.0
    if t > 1.0:
        t = 1.0
    return 1.0 - t, t


@kernel(outline=True)
def inner_weights(r, p, q):
    """Weights of the origin's projection into the plane of triangle rpq, whose shortest edge is pq.

    Written in an orthonormal basis that starts along the long edge, so that needles lose no accuracy. The first weight
    is -1 if the triangle has no area.
    """
    rp = sub3(p, r)
    length = sqrt(dot3(rp, rp))
    if length <= 0.0:
        return -1.0, 0.0, 0.0
    u = scale3(rp, 1.0 / length)
    pq = sub3(q, p)
    along = dot3(pq, u)
    across = sub3(pq, scale3(u, along))
    height = sqrt(dot3(across, across))
    if height * height <= 1e-28 * (length * length + dot3(r, r)):
        return -1.0, 0.0, 0.0
    wq = -dot3(r, across) / (height * height)
    wp = (-dot3(r, u) - wq * (length + along)) / length
    return 1.0 - wp - wq, wp, wq


@kernel(outline=True)
def triangle_weights(a, b, c):
    """Barycentric weights of the point of triangle abc nearest to the origin."""
    ab = sub3(b, a)
    bc = sub3(c, b)
    ca = sub3(a, c)
    ab2 = dot3(ab, ab)
    bc2 = dot3(bc, bc)
    ca2 = dot3(ca, ca)
    wa = 0.0
    wb = 0.0
    wc = 0.0
    if bc2 <= ab2 and bc2 <= ca2:
        wa, wb, wc = inner_weights(a, b, c)
    elif ca2 <= ab2:
        wb, wc, wa = inner_weights(b, c, a)
    else:
        wc, wa, wb = inner_weights(c, a, b)
    if wa >= 0.0 and wb >= 0.0 and wc >= 0.0:
        return wa, wb, wc
    x, y = segment_weights(a, b)
    v = add3(scale3(a, x), scale3(b, y))
    best = dot3(v, v)
    wa = x
    wb = y
    wc = 0.0
    x, y = segment_weights(b, c)
    v = add3(scale3(b, x), scale3(c, y))
    if dot3(v, v) < best:
        best = dot3(v, v)
        wa = 0.0
        wb = x
        wc = y
    x, y = segment_weights(c, a)
    v = add3(scale3(c, x), scale3(a, y))
    if dot3(v, v) < best:
        wc = x
        wa = y
        wb = 0.0
    return wa, wb, wc


@kernel
def combine3(x, y, z, u, v, w):
    return add3(scale3(x, u), add3(scale3(y, v), scale3(z, w)))


@kernel
def beyond(a, b, c, d):
    """True if the origin is on the other side of plane abc than d (or the tetrahedron is flat)."""
    n = cross3(sub3(b, a), sub3(c, a))
    return dot3(n, a) * dot3(n, sub3(d, a)) >= 0.0


@kernel(outline=True)
def nearest_on_tetrahedron(table, p, q, r, s):
    """Weights of the nearest point, and whether the origin is inside. Tries the faces that look at the origin."""
    best = 1e300
    w0 = 0.0
    w1 = 0.0
    w2 = 0.0
    w3 = 0.0
    inside = True
    if beyond(p, q, r, s):
        inside = False
        x, y, z = triangle_weights(p, q, r)
        v = combine3(p, q, r, x, y, z)
        if dot3(v, v) < best:
            best = dot3(v, v)
            w0 = x
            w1 = y
            w2 = z
            w3 = 0.0
    if beyond(p, r, s, q):
        inside = False
        x, y, z = triangle_weights(p, r, s)
        v = combine3(p, r, s, x, y, z)
        if dot3(v, v) < best:
            best = dot3(v, v)
            w0 = x
            w1 = 0.0
            w2 = y
            w3 = z
    if beyond(p, s, q, r):
        inside = False
        x, y, z = triangle_weights(p, s, q)
        v = combine3(p, s, q, x, y, z)
        if dot3(v, v) < best:
            best = dot3(v, v)
            w0 = x
            w1 = z
            w2 = 0.0
            w3 = y
    if beyond(q, s, r, p):
        inside = False
        x, y, z = triangle_weights(q, s, r)
        v = combine3(q, s, r, x, y, z)
        if dot3(v, v) < best:
            best = dot3(v, v)
            w0 = 0.0
            w1 = x
            w2 = z
            w3 = y
    return inside, w0, w1, w2, w3


@kernel
def weight_of(k, w0, w1, w2, w3):
    if k == 0:
        return w0
    if k == 1:
        return w1
    return w2 if k == 2 else w3


@kernel(outline=True)
def reduce_simplex(table, n):
    """Keeps the vertices that carry the nearest point; (how many are kept, nearest point, whether origin inside).

    The weights go to column 0 of the rows SIMPLEX + 8 + k.
    """
    w0 = 1.0
    w1 = 0.0
    w2 = 0.0
    w3 = 0.0
    p = load3(table.work, SIMPLEX)
    q = load3(table.work, SIMPLEX + 1)
    r = load3(table.work, SIMPLEX + 2)
    s = load3(table.work, SIMPLEX + 3)
    if n == 2:
        w0, w1 = segment_weights(p, q)
    elif n == 3:
        w0, w1, w2 = triangle_weights(p, q, r)
    elif n == 4:
        inside, w0, w1, w2, w3 = nearest_on_tetrahedron(table, p, q, r, s)
        if inside:
            return _4, _NO_SHIFT, True
    kept = 0
    v = (0.0, 0.0, 0.0)
    for k in range(n):
        weight = weight_of(k, w0, w1, w2, w3)
        if weight > 0.0:
            for c in range(9):
                table.work[SIMPLEX + kept, c] = table.work[SIMPLEX + k, c]
            table.work[SIMPLEX + 8 + kept, 0] = weight
            v = add3(v, scale3(load3(table.work, SIMPLEX + kept), weight))
            kept += 1
    return kept, v, False


@kernel
def witness(table, n, column):
    """The point on one of the shapes (columns from `column` on) that the weights of the simplex stand for."""
    p = (0.0, 0.0, 0.0)
    for k in range(n):
        p = add3(p, scale3(load3_at(table.work, SIMPLEX + k, column), table.work[SIMPLEX + 8 + k, 0]))
    return p


@kernel(outline=True)
def gjk(model, table, i, j, size, reach, shift):
    """(number of vertices of the simplex, nearest point v of the difference, whether cores overlap, witnesses a, b).

    With a `shift`, shape j is moved by it. Stops early, with an estimate, once the distance is known to exceed `reach`.
    """
    d = add3(sub3(bounding_centre(table, j), bounding_centre(table, i)), shift)
    if dot3(d, d) < 1e-28 * size * size:
        d = (1.0, 0.0, 0.0)
    v = add_vertex(model, table, i, j, d, SIMPLEX, shift)
    table.work[SIMPLEX + 8, 0] = 1.0
    n = _1
    a = load3_at(table.work, SIMPLEX, ON_I)
    b = load3_at(table.work, SIMPLEX, ON_J)
    for _ in range(_GJK_STEPS):
        distance = sqrt(dot3(v, v))
        if distance <= _TOUCHING * size:
            return n, v, True, a, b
        w = add_vertex(model, table, i, j, scale3(v, -1.0), SIMPLEX + n, shift)
        bound = dot3(v, w) / distance
        if bound > reach or distance - bound <= _GAP * size:
            return n, v, False, a, b
        n, closer, inside = reduce_simplex(table, n + 1)
        if inside:
            return _4, closer, True, a, b
        if dot3(closer, closer) >= dot3(v, v):
            return n, v, False, a, b
        v = closer
        a = witness(table, n, ON_I)
        b = witness(table, n, ON_J)
    return n, v, False, a, b


# ---- EPA


@kernel
def face_plane(table, f):
    """Writes the unit normal and distance of a face; one without area is infinitely far, so that it is not chosen."""
    a = load3(table.work, SIMPLEX + table.iwork[CORNER + 3 * f])
    b = load3(table.work, SIMPLEX + table.iwork[CORNER + 3 * f + 1])
    c = load3(table.work, SIMPLEX + table.iwork[CORNER + 3 * f + 2])
    ab = sub3(b, a)
    ac = sub3(c, a)
    n = cross3(ab, ac)
    area = sqrt(dot3(n, n))
    if area <= 1e-14 * (dot3(ab, ab) + dot3(ac, ac)):
        store3(table.work, FACE + f, _NO_SHIFT)
        table.work[FACE + f, 3] = 1e300
    else:
        n = scale3(n, 1.0 / area)
        store3(table.work, FACE + f, n)
        table.work[FACE + f, 3] = dot3(n, a)
    table.work[FACE + f, 4] = 1.0


@kernel(outline=True)
def set_face(table, f, a, b, c):
    table.iwork[CORNER + 3 * f] = a
    table.iwork[CORNER + 3 * f + 1] = b
    table.iwork[CORNER + 3 * f + 2] = c
    face_plane(table, f)


@kernel
def some_normal(u):
    """A unit vector square to u."""
    e = (1.0, 0.0, 0.0)
    if absolute(u[0]) > absolute(u[1]):
        e = (0.0, 1.0, 0.0)
    n = cross3(u, e)
    length = sqrt(dot3(n, n))
    if length <= 0.0:
        return (1.0, 0.0, 0.0)
    return scale3(n, 1.0 / length)


@kernel(outline=True)
def make_tetrahedron(model, table, i, j, n, size):
    """Adds vertices until the simplex has volume; how many vertices it has then (4 unless the difference is flat)."""
    least = 1e-8 * size
    if n == 1:
        for k in range(6):
            s = 1.0 if k < 3 else -1.0
            d = (s if k % 3 == 0 else 0.0, s if k % 3 == 1 else 0.0, s if k % 3 == 2 else 0.0)
            w = sub3(add_vertex(model, table, i, j, d, SIMPLEX + 1, _NO_SHIFT), load3(table.work, SIMPLEX))
            if dot3(w, w) > least * least:
                n = 2
                break
    if n == 2:
        u = sub3(load3(table.work, SIMPLEX + 1), load3(table.work, SIMPLEX))
        d = some_normal(u)
        e = cross3(u, d)
        e = scale3(e, 1.0 / sqrt(dot3(e, e) + 1e-300))
        for k in range(4):
            across = scale3(d if k < 2 else e, 1.0 if k % 2 == 0 else -1.0)
            w = sub3(add_vertex(model, table, i, j, across, SIMPLEX + 2, _NO_SHIFT), load3(table.work, SIMPLEX))
            out = cross3(u, w)
            if dot3(out, out) > least * least * dot3(u, u):
                n = 3
                break
    if n == 3:
        p = load3(table.work, SIMPLEX)
        d = cross3(sub3(load3(table.work, SIMPLEX + 1), p), sub3(load3(table.work, SIMPLEX + 2), p))
        d = scale3(d, 1.0 / sqrt(dot3(d, d) + 1e-300))
        for k in range(2):
            s = 1.0 if k == 0 else -1.0
            w = sub3(add_vertex(model, table, i, j, scale3(d, s), SIMPLEX + 3, _NO_SHIFT), p)
            if absolute(dot3(w, d)) > least:
                n = 4
                break
    return n


@kernel
def face_across(table, faces, a, b):
    """The existing face with the directed edge ab, or -1."""
    for f in range(faces):
        if table.work[FACE + f, 4] > 0.0:
            c0 = table.iwork[CORNER + 3 * f]
            c1 = table.iwork[CORNER + 3 * f + 1]
            c2 = table.iwork[CORNER + 3 * f + 2]
            if (c0 == a and c1 == b) or (c1 == a and c2 == b) or (c2 == a and c0 == b):
                return f
    return -1


@kernel(outline=True)
def remove_seen_faces(table, faces, start, w):
    """Removes the connected faces that w is in front of; the number of edges of the hole, which go to HORIZON.

    0 if the hole is not a disc: rounding has broken the polytope.
    """
    table.iwork[STACK] = start
    waiting = 1
    removed = 1
    edges = 0
    table.work[FACE + start, 4] = 0.0
    while waiting > 0:
        waiting -= 1
        f = table.iwork[STACK + waiting]
        for k in range(3):
            a = table.iwork[CORNER + 3 * f + k]
            b = table.iwork[CORNER + 3 * f + (k + 1) % 3]
            g = face_across(table, faces, b, a)
            if g < 0:
                continue
            if dot3(load3(table.work, FACE + g), w) > table.work[FACE + g, 3]:
                table.work[FACE + g, 4] = 0.0
                table.iwork[STACK + waiting] = g
                waiting += 1
                removed += 1
            elif edges < 127:
                table.iwork[HORIZON + 2 * edges] = a
                table.iwork[HORIZON + 2 * edges + 1] = b
                edges += 1
    if edges != removed + 2:
        return 0
    return edges


@kernel(outline=True)
def epa(model, table, i, j, size, gap):
    """From a tetrahedron that holds the origin: corners, normal and support of the nearest face of the difference.

    Of all directions tried it gives the one with the least support, which is the depth along it, until depth and
    distance of the nearest face differ by less than `gap`.
    """
    p = load3(table.work, SIMPLEX)
    q = load3(table.work, SIMPLEX + 1)
    r = load3(table.work, SIMPLEX + 2)
    s = load3(table.work, SIMPLEX + 3)
    if dot3(cross3(sub3(q, p), sub3(r, p)), sub3(s, p)) > 0.0:
        set_face(table, _0, _0, _2, _1)
        set_face(table, _1, _0, _1, _3)
        set_face(table, _2, _1, _2, _3)
        set_face(table, _3, _2, _0, _3)
    else:
        set_face(table, _0, _0, _1, _2)
        set_face(table, _1, _0, _3, _1)
        set_face(table, _2, _1, _3, _2)
        set_face(table, _3, _2, _3, _0)
    faces = _4
    vertices = _4
    c0 = _0
    c1 = _1
    c2 = _2
    n = (1.0, 0.0, 0.0)
    depth = 1e300
    for _ in range(_EPA_STEPS):
        best = _NONE
        for f in range(faces):
            if table.work[FACE + f, 4] > 0.0:
                if best < 0 or table.work[FACE + f, 3] < table.work[FACE + best, 3]:
                    best = f
        if best < 0 or table.work[FACE + best, 3] > 1e299:
            break
        d = load3(table.work, FACE + best)
        offset = table.work[FACE + best, 3]
        w = add_vertex(model, table, i, j, d, SIMPLEX + vertices, _NO_SHIFT)
        if dot3(d, w) < depth:
            depth = dot3(d, w)
            n = d
            c0 = table.iwork[CORNER + 3 * best]
            c1 = table.iwork[CORNER + 3 * best + 1]
            c2 = table.iwork[CORNER + 3 * best + 2]
        if dot3(d, w) - offset <= gap or depth - offset <= gap or vertices + 1 >= MAX_VERTICES:
            break
        edges = remove_seen_faces(table, faces, best, w)
        if edges == 0:
            break
        free = 0
        for e in range(edges):
            while free < faces and table.work[FACE + free, 4] > 0.0:
                free += 1
            if free < MAX_FACES:
                set_face(table, free, table.iwork[HORIZON + 2 * e], table.iwork[HORIZON + 2 * e + 1], vertices)
                if free == faces:
                    faces += 1
        vertices += 1
    return c0, c1, c2, n, depth


# ---- both


@kernel
def blend(table, column, r0, r1, r2, w0, w1, w2):
    """A witness: the weighted sum of three vertices' points on one of the shapes (columns from `column` on)."""
    return combine3(
        load3_at(table.work, SIMPLEX + r0, column),
        load3_at(table.work, SIMPLEX + r1, column),
        load3_at(table.work, SIMPLEX + r2, column),
        w0,
        w1,
        w2,
    )


@kernel(outline=True)
def separation(model, table, i, j, reach):
    """Signed distance phi of shapes i and j, unit normal from j to i, nearest (or deepest) points on i and j, in W.

    Exact for polytopes, spheres and capsules up to rounding. If phi is larger than `reach` the rest is an estimate.
    """
    size = model.size[i, BOUND] + model.size[j, BOUND]
    margin_i = margin_of(model, i)
    margin_j = margin_of(model, j)
    n, v, overlap, p_i, p_j = gjk(model, table, i, j, size, reach + margin_i + margin_j, _NO_SHIFT)
    nhat = (1.0, 0.0, 0.0)
    phi = 0.0
    if overlap:
        n = make_tetrahedron(model, table, i, j, n, size)
    if overlap and n == 4:
        curved = is_curved(model, i) or is_curved(model, j)
        c0, c1, c2, out, depth = epa(model, table, i, j, size, size * (_EPA_GAP_SMOOTH if curved else _EPA_GAP))
        a = load3(table.work, SIMPLEX + c0)
        b = load3(table.work, SIMPLEX + c1)
        c = load3(table.work, SIMPLEX + c2)
        w0, w1, w2 = triangle_weights(a, b, c)
        p_i = blend(table, ON_I, c0, c1, c2, w0, w1, w2)
        p_j = blend(table, ON_J, c0, c1, c2, w0, w1, w2)
        if curved:
            out, depth, p_i, p_j = refine(model, table, i, j, size, out, depth, p_i, p_j)
        nhat = scale3(out, -1.0)
        phi = -depth
    elif overlap:
        nhat = flat_normal(table, n)
    else:
        phi = sqrt(dot3(v, v))
        nhat = scale3(v, 1.0 / phi)
    p_i = sub3(p_i, scale3(nhat, margin_i))
    p_j = add3(p_j, scale3(nhat, margin_j))
    return phi - margin_i - margin_j, nhat, p_i, p_j


@kernel
def is_curved(model, g):
    kind = model.geometry[g, KIND]
    return kind == CYLINDER or kind == ELLIPSOID


@kernel(outline=True)
def refine(model, table, i, j, size, out, depth, p_i, p_j):
    """A better direction out of curved shapes: the shapes are moved apart along `out` and GJK tells the nearest way.

    The error of the direction shrinks by depth / radius of curvature each time; a direction that is no better ends it.
    """
    for _ in range(_REFINEMENTS):
        shift = scale3(out, depth + _CLEARANCE * size)
        _n, v, overlap, a, b = gjk(model, table, i, j, size, 1e300, shift)
        if overlap:
            break
        d = scale3(v, -1.0 / sqrt(dot3(v, v)))
        w = add_vertex(model, table, i, j, d, SIMPLEX + 12, _NO_SHIFT)
        better = dot3(d, w)
        if better > depth:
            break
        gain = depth - better
        out = d
        depth = better
        p_i = a
        p_j = b
        if gain <= 1e-14 * size:
            break
    return out, depth, p_i, p_j


@kernel
def flat_normal(table, n):
    """A direction out of a difference that has no volume."""
    p = load3(table.work, SIMPLEX)
    u = sub3(load3(table.work, SIMPLEX + 1), p)
    if n == 1:
        return (1.0, 0.0, 0.0)
    if n == 2:
        return some_normal(u)
    out = cross3(u, sub3(load3(table.work, SIMPLEX + 2), p))
    length = sqrt(dot3(out, out))
    if length > 0.0:
        return scale3(out, 1.0 / length)
    return some_normal(u)
