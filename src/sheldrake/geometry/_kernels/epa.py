"""Depth of convex shapes that overlap.

EPA (van den Bergen 2001) grows a polytope inside the difference of two cores towards the surface of the difference
where that is nearest to the origin. It is bounded, and every answer is a direction and the exact distance by which a
move along it separates the shapes.
"""

from __future__ import annotations

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common._kernels.vec import cross3, dot3, scale3, sub3
from sheldrake.common.kernel import kernel

from .gjk import add_vertex
from .model import FACE, MAX_EDGES, MAX_FACES, MAX_VERTICES, SIMPLEX
from .table import absolute

EPA_STEPS = 120
_LEVEL = 1e-15  # relative to the size: a vertex so little in front of a face is in its plane
NO_AREA = 1e-14  # relative to the squares of its edges: a face with less has none
_ROUNDS = 8  # in which edges are taken out of a surface
_FLAT = 1e-8  # relative to the size: least extent of the tetrahedron to begin with
_NO_SHIFT = (0.0, 0.0, 0.0)


@kernel(outline=True)
def set_face(table, f, corners):
    """Writes a face with its unit normal and distance; one without area is infinitely far, so that it is not chosen."""
    table.links[f].corners = corners
    i, j, k = corners
    a = table.vertices[SIMPLEX + i].w
    ab = sub3(table.vertices[SIMPLEX + j].w, a)
    ac = sub3(table.vertices[SIMPLEX + k].w, a)
    n = cross3(ab, ac)
    area = sqrt(dot3(n, n))
    face = table.polytope[FACE + f]
    if area <= NO_AREA * (dot3(ab, ab) + dot3(ac, ac)):
        face.normal, face.offset = _NO_SHIFT, 1e300
    else:
        n = scale3(n, 1.0 / area)
        face.normal, face.offset = n, dot3(n, a)
    face.exists = 1.0


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
    p = table.vertices[SIMPLEX].w
    u = sub3(table.vertices[SIMPLEX + 1].w, p)
    if n < 2 or dot3(u, u) <= least * least:
        return 1
    out = cross3(u, sub3(table.vertices[SIMPLEX + 2].w, p))
    if n < 3 or dot3(out, out) <= least * least * dot3(u, u):
        return 2
    height = dot3(out, sub3(table.vertices[SIMPLEX + 3].w, p))
    if n < 4 or height * height <= least * least * dot3(out, out):
        return 3
    return 4


@kernel(outline=True)
def make_tetrahedron(model, table, i, j, n, size):
    """Adds vertices until the simplex has volume; how many vertices it has then (4 unless the difference is flat)."""
    least = _FLAT * size
    n = thick_part(table, n, least)
    if n == 1:
        for k in range(6):
            s = 1.0 if k < 3 else -1.0
            d = (s if k % 3 == 0 else 0.0, s if k % 3 == 1 else 0.0, s if k % 3 == 2 else 0.0)
            w = sub3(add_vertex(model, table, i, j, d, SIMPLEX + 1, _NO_SHIFT), table.vertices[SIMPLEX].w)
            if dot3(w, w) > least * least:
                n = 2
                break
    if n == 2:
        u = sub3(table.vertices[SIMPLEX + 1].w, table.vertices[SIMPLEX].w)
        d = some_normal(u)
        e = cross3(u, d)
        e = scale3(e, 1.0 / sqrt(dot3(e, e) + 1e-300))
        for k in range(4):
            across = scale3(d if k < 2 else e, 1.0 if k % 2 == 0 else -1.0)
            w = sub3(add_vertex(model, table, i, j, across, SIMPLEX + 2, _NO_SHIFT), table.vertices[SIMPLEX].w)
            out = cross3(u, w)
            if dot3(out, out) > least * least * dot3(u, u):
                n = 3
                break
    if n == 3:
        p = table.vertices[SIMPLEX].w
        d = cross3(sub3(table.vertices[SIMPLEX + 1].w, p), sub3(table.vertices[SIMPLEX + 2].w, p))
        d = scale3(d, 1.0 / sqrt(dot3(d, d) + 1e-300))
        for k in range(2):
            s = 1.0 if k == 0 else -1.0
            w = sub3(add_vertex(model, table, i, j, scale3(d, s), SIMPLEX + 3, _NO_SHIFT), p)
            if absolute(dot3(w, d)) > least:
                n = 4
                break
    return n


@kernel
def set_face_among(table, inward, f, corners, across):
    """Writes a face and which are across its edges; its corners the other way round if `inward`."""
    a, b, c = corners
    over_ab, over_bc, over_ca = across
    set_face(table, f, (a, c, b) if inward else corners)
    table.links[f].neighbours = (over_ca, over_bc, over_ab) if inward else across


@kernel
def make_faces(table):
    """The four faces of the tetrahedron of the first four vertices, seen from outside."""
    p = table.vertices[SIMPLEX].w
    q = table.vertices[SIMPLEX + 1].w
    r = table.vertices[SIMPLEX + 2].w
    s = table.vertices[SIMPLEX + 3].w
    inward = dot3(cross3(sub3(q, p), sub3(r, p)), sub3(s, p)) > 0.0
    set_face_among(table, inward, 0, (0, 1, 2), (1, 2, 3))
    set_face_among(table, inward, 1, (0, 3, 1), (3, 2, 0))
    set_face_among(table, inward, 2, (1, 3, 2), (1, 3, 0))
    set_face_among(table, inward, 3, (2, 3, 0), (2, 1, 0))


@kernel
def edge_from(table, start, edges):
    """The edge of the hole that starts at a vertex, or -1."""
    for e in range(edges):
        if table.hole_edges[e].start == start:
            return e
    return -1


@kernel
def is_loop(table, edges):
    """Whether the edges of the hole are one closed loop."""
    at = table.hole_edges[0].start
    for passed in range(edges):
        e = edge_from(table, at, edges)
        if e >= 0:
            at = table.hole_edges[e].end
        if at == table.hole_edges[0].start:
            return passed + 1 == edges
    return False


@kernel(outline=True)
def remove_seen_faces(table, start, w, slack):
    """Removes the connected faces that w is more than `slack` in front of; the number of edges of the hole.

    They go to `table.hole_edges`. 0 if the hole is not a disc: rounding has broken the polytope.
    """
    table.stack[0] = start
    waiting = 1
    edges = 0
    table.polytope[FACE + start].exists = 0.0
    while waiting > 0:
        waiting -= 1
        link = table.links[table.stack[waiting]]
        for k in range(3):
            g = link.across[k]
            face = table.polytope[FACE + g]
            if face.exists <= 0.0:
                continue
            if dot3(face.normal, w) > face.offset + slack:
                face.exists = 0.0
                table.stack[waiting] = g
                waiting += 1
            elif edges < MAX_EDGES:
                edge = table.hole_edges[edges]
                edge.start, edge.end, edge.outside = link.corner[k], link.corner[(k + 1) % 3], g
                edges += 1
    return edges if is_loop(table, edges) else 0


@kernel(outline=True)
def fill_hole(table, faces, edges, vertex):
    """Joins a vertex to the edges of the hole by new faces, in free places; how many places are in use then."""
    free = 0
    for e in range(edges):
        while free < faces and table.polytope[FACE + free].exists > 0.0:
            free += 1
        edge = table.hole_edges[e]
        set_face(table, free, (edge.start, edge.end, vertex))
        edge.inside = free
        if free == faces:
            faces += 1
    for e in range(edges):
        edge = table.hole_edges[e]
        after = table.hole_edges[edge_from(table, edge.end, edges)].inside
        table.links[edge.inside].across[0] = edge.outside
        table.links[edge.inside].across[1] = after
        table.links[after].across[2] = edge.inside
        for k in range(3):
            if table.links[edge.outside].corner[k] == edge.end:
                table.links[edge.outside].across[k] = edge.inside
    return faces


@kernel
def edge_that_begins_at(table, f, vertex):
    """Which edge of face f begins at one of its vertices."""
    corner = table.links[f].corner
    return 0 if corner[0] == vertex else (1 if corner[1] == vertex else 2)


@kernel
def looks_out(table, a, b, c):
    """Whether the triangle of three vertices has the origin behind it."""
    u, v, w = table.vertices[SIMPLEX + a].w, table.vertices[SIMPLEX + b].w, table.vertices[SIMPLEX + c].w
    return dot3(cross3(u, v), w) > 0.0


@kernel
def join_across(table, f, start, g):
    """Face g is across the edge of f that begins at a vertex from now on."""
    table.links[f].across[edge_that_begins_at(table, f, start)] = g


@kernel(outline=True)
def turn_edge(table, f, k):
    """Takes edge k of face f, from p to q, out of a closed surface around the origin; whether it can.

    With r and w the other corners of the two faces there, the edge from r to w takes its place. If these are joined
    behind q, three faces meet there, and become one without it. No new face may turn its back on the origin.
    """
    link = table.links[f]
    after, before = (k + 1) % 3, (k + 2) % 3
    g, p, q, r = link.across[k], link.corner[k], link.corner[after], link.corner[before]
    over_qr, over_rp = link.across[after], link.across[before]
    m = edge_that_begins_at(table, g, q)
    after, before = (m + 1) % 3, (m + 2) % 3
    w, over_pw, over_wq = table.links[g].corner[before], table.links[g].across[after], table.links[g].across[before]
    alone = over_qr == over_wq
    if over_rp == over_pw or not looks_out(table, r, p, w) or not (alone or looks_out(table, w, q, r)):
        return False
    set_face(table, f, (r, p, w))
    join_across(table, over_pw, w, f)
    if alone:
        over_wr = table.links[over_qr].across[edge_that_begins_at(table, over_qr, w)]
        table.links[f].neighbours = (over_rp, over_pw, over_wr)
        join_across(table, over_wr, r, f)
        table.polytope[FACE + g].exists = 0.0
        table.polytope[FACE + over_qr].exists = 0.0
    else:
        set_face(table, g, (w, q, r))
        table.links[f].neighbours = (over_rp, over_pw, g)
        table.links[g].neighbours = (over_wq, over_qr, f)
        join_across(table, over_qr, r, g)
    return True


@kernel
def rise_across(table, f, k):
    """How far the face across edge k of f rises in front of the plane of f [m]."""
    face, link = table.polytope[FACE + f], table.links[f]
    g = link.across[k]
    m = edge_that_begins_at(table, g, link.corner[(k + 1) % 3])
    return dot3(face.normal, table.vertices[SIMPLEX + table.links[g].corner[(m + 2) % 3]].w) - face.offset


@kernel(outline=True)
def make_convex(table, faces, slack):
    """Takes edges out of a closed surface around the origin from which faces rise by more than `slack`.

    So are some of a polytope whose vertices have moved a little. Returns whether there are none left.
    """
    for _ in range(_ROUNDS):
        taken, left = 0, 0
        for f in range(faces):
            if table.polytope[FACE + f].exists > 0.0:
                a, b, c = rise_across(table, f, 0), rise_across(table, f, 1), rise_across(table, f, 2)
                if max(a, b, c) > slack:
                    if turn_edge(table, f, 0 if a >= max(b, c) else (1 if b >= c else 2)):
                        taken += 1
                    else:
                        left += 1
        if taken == 0:
            return left == 0
    return False


@kernel
def nearest_face(table, faces):
    """The face of the polytope nearest to the origin, -1 if all are infinitely far."""
    best = -1
    for f in range(faces):
        if table.polytope[FACE + f].exists > 0.0:
            if best < 0 or table.polytope[FACE + f].offset < table.polytope[FACE + best].offset:
                best = f
    return -1 if best < 0 or table.polytope[FACE + best].offset > 1e299 else best


@kernel(outline=True)
def epa(model, table, i, j, size, gap, polytope, steps):
    """From a polytope that holds the origin: corners, normal and support of the nearest face of the difference.

    `polytope` is how many faces and vertices it has.

    Of all directions tried it gives the one with the least support, which is the depth along it, until depth and
    distance of the nearest face differ by less than `gap`.

    Returns:
        (corners, normal, support, whether the gap was reached, faces, vertices), the last two of the polytope then.
    """
    faces, vertices = polytope
    corners = (0, 1, 2)
    n = (1.0, 0.0, 0.0)
    depth = 1e300
    for _ in range(steps):
        best = nearest_face(table, faces)
        if best < 0:
            break
        d, offset = table.polytope[FACE + best].normal, table.polytope[FACE + best].offset
        w = add_vertex(model, table, i, j, d, SIMPLEX + vertices, _NO_SHIFT)
        if dot3(d, w) < depth:
            n, depth, corners = d, dot3(d, w), table.links[best].corners
        if dot3(d, w) - offset <= gap or depth - offset <= gap:
            return corners, n, depth, True, faces, vertices
        if vertices + 1 >= MAX_VERTICES:
            break
        edges = remove_seen_faces(table, best, w, _LEVEL * size)
        if edges == 0 or faces + edges > MAX_FACES:
            break
        faces = fill_hole(table, faces, edges, vertices)
        vertices += 1
    return corners, n, depth, False, faces, vertices
