"""Distance of convex shapes from their farthest points alone.

GJK (Gilbert, Johnson, Keerthi 1988; Ericson 2005, sections 5.1 and 9.5) finds the point of the difference of two cores
that is nearest to the origin. It is bounded: at the bound it gives the best answer found. Vertices are `table.vertices`
from SIMPLEX on: w = a - b with a on shape i and b on shape j.
"""

from __future__ import annotations

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common._kernels.vec import add3, cross3, dot3, scale3, sub3
from sheldrake.common.kernel import kernel

from .model import SIMPLEX, WEIGHTS
from .support import farthest_vertex

_GJK_STEPS = 96
_TOUCHING = 1e-10  # relative to the size: cores closer than this are treated as overlapping
_GAP = 1e-14  # GJK stops when the distance is known this well, relative to the size
_FLAT2 = 1e-24  # squared sine of the angle under which a tetrahedron is flat: rounding says where the origin is
_NO_SHIFT = (0.0, 0.0, 0.0)


@kernel(outline=True)
def add_vertex(model, table, i, j, d, row, shift):
    """The vertex of the difference, less `shift`, that is farthest along d, into a row; its w."""
    number_a, a = farthest_vertex(model, table, i, d)
    number_b, b = farthest_vertex(model, table, j, scale3(d, -1.0))
    w = sub3(sub3(a, b), shift)
    table.vertices[row].points = (w, a, b, (float(number_a), float(number_b)))
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


@kernel
def towards_segment(a, b):
    """Square of the origin's distance from segment ab, and the weights of the nearest point."""
    u, v = segment_weights(a, b)
    p = add3(scale3(a, u), scale3(b, v))
    return dot3(p, p), u, v


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
    best, u, v = towards_segment(a, b)
    wa, wb, wc = u, v, 0.0
    distance2, u, v = towards_segment(b, c)
    if distance2 < best:
        best, wa, wb, wc = distance2, 0.0, u, v
    distance2, u, v = towards_segment(c, a)
    if distance2 < best:
        wa, wb, wc = v, 0.0, u
    return wa, wb, wc


@kernel
def combine3(x, y, z, u, v, w):
    return add3(scale3(x, u), add3(scale3(y, v), scale3(z, w)))


@kernel
def beyond(a, b, c, d):
    """True if the origin is on the other side of plane abc than d (or the tetrahedron is flat)."""
    n = cross3(sub3(b, a), sub3(c, a))
    ad = sub3(d, a)
    height = dot3(n, ad)
    return dot3(n, a) * height >= 0.0 or height * height <= _FLAT2 * dot3(n, n) * dot3(ad, ad)


@kernel(outline=True)
def nearest_on_tetrahedron(table, p, q, r, s):
    """Weights of the nearest point, and whether the origin is inside. Tries the faces that look at the origin."""
    best = 1e300
    w = (0.0, 0.0, 0.0, 0.0)
    inside = True
    if beyond(p, q, r, s):
        inside = False
        x, y, z = triangle_weights(p, q, r)
        v = combine3(p, q, r, x, y, z)
        if dot3(v, v) < best:
            w, best = (x, y, z, 0.0), dot3(v, v)
    if beyond(p, r, s, q):
        inside = False
        x, y, z = triangle_weights(p, r, s)
        v = combine3(p, r, s, x, y, z)
        if dot3(v, v) < best:
            w, best = (x, 0.0, y, z), dot3(v, v)
    if beyond(p, s, q, r):
        inside = False
        x, y, z = triangle_weights(p, s, q)
        v = combine3(p, s, q, x, y, z)
        if dot3(v, v) < best:
            w, best = (x, z, 0.0, y), dot3(v, v)
    if beyond(q, s, r, p):
        inside = False
        x, y, z = triangle_weights(q, s, r)
        v = combine3(q, s, r, x, y, z)
        if dot3(v, v) < best:
            w, best = (0.0, x, z, y), dot3(v, v)
    return inside, w


@kernel(outline=True)
def reduce_simplex(table, n):
    """Keeps the vertices that carry the nearest point; (how many are kept, nearest point, whether origin inside).

    The weights go to the rows from WEIGHTS on.
    """
    w0, w1, w2, w3 = 1.0, 0.0, 0.0, 0.0
    p = table.vertices[SIMPLEX].w
    q = table.vertices[SIMPLEX + 1].w
    r = table.vertices[SIMPLEX + 2].w
    s = table.vertices[SIMPLEX + 3].w
    if n == 2:
        w0, w1 = segment_weights(p, q)
    elif n == 3:
        w0, w1, w2 = triangle_weights(p, q, r)
    elif n == 4:
        inside, (w0, w1, w2, w3) = nearest_on_tetrahedron(table, p, q, r, s)
        if inside:
            return 4, _NO_SHIFT, True
    kept = 0
    v = (0.0, 0.0, 0.0)
    for k in range(n):
        weight = (w0, w1, w2, w3)[k]
        if weight > 0.0:
            table.vertices[SIMPLEX + kept].points = table.vertices[SIMPLEX + k].points
            table.vertices[WEIGHTS + kept].weight = weight
            v = add3(v, scale3(table.vertices[SIMPLEX + kept].w, weight))
            kept += 1
    return kept, v, False


@kernel
def witnesses(table, n):
    """The points on both shapes that the weights of the simplex stand for."""
    a = (0.0, 0.0, 0.0)
    b = (0.0, 0.0, 0.0)
    for k in range(n):
        vertex = table.vertices[SIMPLEX + k]
        weight = table.vertices[WEIGHTS + k].weight
        a = add3(a, scale3(vertex.a, weight))
        b = add3(b, scale3(vertex.b, weight))
    return a, b


@kernel(outline=True)
def gjk(model, table, i, j, size, reach, shift):
    """(number of vertices of the simplex, nearest point v of the difference, whether cores overlap, witnesses a, b).

    With a `shift`, shape j is moved by it. Stops early, with an estimate, once the distance is known to exceed `reach`.
    """
    d = add3(sub3(table.poses[j].centre_W, table.poses[i].centre_W), shift)
    if dot3(d, d) < 1e-28 * size * size:
        d = (1.0, 0.0, 0.0)
    v = add_vertex(model, table, i, j, d, SIMPLEX, shift)
    table.vertices[WEIGHTS].weight = 1.0
    n = 1
    a, b = table.vertices[SIMPLEX].a, table.vertices[SIMPLEX].b
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
            return 4, closer, True, a, b
        if dot3(closer, closer) >= dot3(v, v):
            return n, v, False, a, b
        v = closer
        a, b = witnesses(table, n)
    return n, v, False, a, b
