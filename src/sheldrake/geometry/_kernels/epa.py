"""Depth of convex shapes that overlap.

EPA (van den Bergen 2001) grows a polytope inside the difference of two cores towards the surface of the difference
where that is nearest to the origin. It is bounded, and every answer is a direction and the exact distance by which a
move along it separates the shapes.
"""

from __future__ import annotations

import numpy as np

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common._kernels.vec import cross3, dot3, load3, scale3, store3, sub3
from sheldrake.common.kernel import kernel

from .gjk import add_vertex
from .model import ACROSS, CORNER, FACE, HORIZON, MAX_EDGES, MAX_FACES, MAX_VERTICES, SIMPLEX, STACK
from .table import absolute

_EPA_STEPS = 120
_LEVEL = 1e-15  # relative to the size: a vertex so little in front of a face is in its plane
_FLAT = 1e-8  # relative to the size: least extent of the tetrahedron to begin with
_NO_SHIFT = (0.0, 0.0, 0.0)
_NONE = np.int64(-1)
_0 = np.int64(0)
_1 = np.int64(1)
_2 = np.int64(2)
_3 = np.int64(3)
_4 = np.int64(4)


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
def thick_part(table, n, least):
    """How many vertices of the simplex to keep: those before the first that is not `least` away from what they span."""
    p = load3(table.work, SIMPLEX)
    u = sub3(load3(table.work, SIMPLEX + 1), p)
    if n < 2 or dot3(u, u) <= least * least:
        return _1
    out = cross3(u, sub3(load3(table.work, SIMPLEX + 2), p))
    if n < 3 or dot3(out, out) <= least * least * dot3(u, u):
        return _2
    height = dot3(out, sub3(load3(table.work, SIMPLEX + 3), p))
    if n < 4 or height * height <= least * least * dot3(out, out):
        return _3
    return _4


@kernel(outline=True)
def make_tetrahedron(model, table, i, j, n, size):
    """Adds vertices until the simplex has volume; how many vertices it has then (4 unless the difference is flat)."""
    least = _FLAT * size
    n = thick_part(table, n, least)
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
def set_face_among(table, inward, f, a, b, c, over_ab, over_bc, over_ca):
    """Writes a face, and which are across its edges; its corners the other way round if `inward`."""
    at = ACROSS + 3 * f
    table.iwork[at + 1] = over_bc
    if inward:
        set_face(table, f, a, c, b)
        table.iwork[at] = over_ca
        table.iwork[at + 2] = over_ab
    else:
        set_face(table, f, a, b, c)
        table.iwork[at] = over_ab
        table.iwork[at + 2] = over_ca


@kernel
def make_faces(table):
    """The four faces of the tetrahedron of the first four vertices, seen from outside."""
    p = load3(table.work, SIMPLEX)
    q = load3(table.work, SIMPLEX + 1)
    r = load3(table.work, SIMPLEX + 2)
    s = load3(table.work, SIMPLEX + 3)
    inward = dot3(cross3(sub3(q, p), sub3(r, p)), sub3(s, p)) > 0.0
    set_face_among(table, inward, _0, _0, _1, _2, _1, _2, _3)
    set_face_among(table, inward, _1, _0, _3, _1, _3, _2, _0)
    set_face_among(table, inward, _2, _1, _3, _2, _1, _3, _0)
    set_face_among(table, inward, _3, _2, _3, _0, _2, _1, _0)


@kernel
def edge_from(table, start, edges):
    """The edge of HORIZON that starts at a vertex, or -1."""
    for e in range(edges):
        if table.iwork[HORIZON + 4 * e] == start:
            return e
    return -1


@kernel
def is_loop(table, edges):
    """Whether the edges of HORIZON are one closed loop."""
    at = table.iwork[HORIZON]
    for passed in range(edges):
        e = edge_from(table, at, edges)
        if e >= 0:
            at = table.iwork[HORIZON + 4 * e + 1]
        if at == table.iwork[HORIZON]:
            return passed + 1 == edges
    return False


@kernel(outline=True)
def remove_seen_faces(table, start, w, slack):
    """Removes the connected faces that w is more than `slack` in front of; the number of edges of the hole.

    They go to HORIZON. 0 if the hole is not a disc: rounding has broken the polytope.
    """
    table.iwork[STACK] = start
    waiting = 1
    edges = _0
    table.work[FACE + start, 4] = 0.0
    while waiting > 0:
        waiting -= 1
        f = table.iwork[STACK + waiting]
        for k in range(3):
            g = table.iwork[ACROSS + 3 * f + k]
            if table.work[FACE + g, 4] <= 0.0:
                continue
            if dot3(load3(table.work, FACE + g), w) > table.work[FACE + g, 3] + slack:
                table.work[FACE + g, 4] = 0.0
                table.iwork[STACK + waiting] = g
                waiting += 1
            elif edges < MAX_EDGES:
                table.iwork[HORIZON + 4 * edges] = table.iwork[CORNER + 3 * f + k]
                table.iwork[HORIZON + 4 * edges + 1] = table.iwork[CORNER + 3 * f + (k + 1) % 3]
                table.iwork[HORIZON + 4 * edges + 2] = g
                edges += 1
    return edges if is_loop(table, edges) else _0


@kernel(outline=True)
def fill_hole(table, faces, edges, vertex):
    """Joins a vertex to the edges of HORIZON by new faces, in free places; how many places are in use then."""
    free = 0
    for e in range(edges):
        while free < faces and table.work[FACE + free, 4] > 0.0:
            free += 1
        at = HORIZON + 4 * e
        set_face(table, free, table.iwork[at], table.iwork[at + 1], vertex)
        table.iwork[at + 3] = free
        if free == faces:
            faces += 1
    for e in range(edges):
        at = HORIZON + 4 * e
        f = table.iwork[at + 3]
        g = table.iwork[at + 2]
        after = table.iwork[HORIZON + 4 * edge_from(table, table.iwork[at + 1], edges) + 3]
        table.iwork[ACROSS + 3 * f] = g
        table.iwork[ACROSS + 3 * f + 1] = after
        table.iwork[ACROSS + 3 * after + 2] = f
        for k in range(3):
            if table.iwork[CORNER + 3 * g + k] == table.iwork[at + 1]:
                table.iwork[ACROSS + 3 * g + k] = f
    return faces


@kernel(outline=True)
def epa(model, table, i, j, size, gap):
    """From a tetrahedron that holds the origin: corners, normal and support of the nearest face of the difference.

    Of all directions tried it gives the one with the least support, which is the depth along it, until depth and
    distance of the nearest face differ by less than `gap`.
    """
    make_faces(table)
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
        edges = remove_seen_faces(table, best, w, _LEVEL * size)
        if edges == 0 or faces + edges > MAX_FACES:
            break
        faces = fill_hole(table, faces, edges, vertices)
        vertices += 1
    return c0, c1, c2, n, depth
