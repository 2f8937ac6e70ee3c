"""Distance of convex shapes from their farthest points alone.

GJK (Gilbert, Johnson, Keerthi 1988; Ericson 2005, sections 5.1 and 9.5) finds the point of the difference of two cores
that is nearest to the origin. It is bounded: at the bound it gives the best answer found. Vertices are rows of
table.work from SIMPLEX on: w = a - b, a, b with a on shape i and b on shape j.
"""

from __future__ import annotations

import numpy as np

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common._kernels.vec import add3, cross3, dot3, load3, load3_at, scale3, store3, store3_at, sub3
from sheldrake.common.kernel import kernel

from .model import ON_I, ON_J, SIMPLEX
from .support import support
from .table import bounding_centre

_GJK_STEPS = 96
_TOUCHING = 1e-10  # relative to the size: cores closer than this are treated as overlapping
_GAP = 1e-14  # GJK stops when the distance is known this well, relative to the size
_FLAT2 = 1e-24  # squared sine of the angle under which a tetrahedron is flat: rounding says where the origin is
_NO_SHIFT = (0.0, 0.0, 0.0)
_1 = np.int64(1)
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
    ad = sub3(d, a)
    height = dot3(n, ad)
    return dot3(n, a) * height >= 0.0 or height * height <= _FLAT2 * dot3(n, n) * dot3(ad, ad)


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
