"""Contacts of two boxes by separating axes (Gottschalk 1996), with Drake's order and preference for face axes."""

from __future__ import annotations

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common._kernels.vec import add3, compose, cross3, dot3, rotate_back, scale3, sub3, transpose
from sheldrake.common.kernel import kernel

from .convex import FLAT, emit_candidate, emit_four, emit_middle, face_candidates
from .model import CANDIDATE, POLYGON_A, POLYGON_B
from .support import shown_feature
from .table import absolute, column, least_depth, several_points

_PREFER_FACES = 0.05  # an edge axis must be better by this fraction
_PARALLEL = 1e-10  # squared sine of the angle between edges that define no axis


@kernel
def absolute3(a):
    return (absolute(a[0]), absolute(a[1]), absolute(a[2]))


@kernel
def edge_axis(best, code, number, least, along, extents, norm2):
    """The better one of the best axis so far and an axis l across two edges, |l|^2 = norm2, l t = along."""
    if norm2 > _PARALLEL:
        s = absolute(along) - extents
        if s >= 0.0 or s * s < best * best * norm2:  # else deeper than the best axis: no need for a root
            s = s / sqrt(norm2)
            if s > -least or s - _PREFER_FACES * absolute(s) > best:
                return s, number
    return best, code


@kernel
def edge_axes(best, code, number, least, t, h_A, h_B, c1, c2, d, d1, d2):
    """`edge_axis` of edge i of a with each edge of b.

    t and h_A are components i + 1 and i + 2 of where b is and of the size of a; d is row i of |R_AB|, c1 and c2 are the
    two rows of R_AB that follow it in turn, d1 and d2 their absolute values.
    """
    along = t[1] * c1[0] - t[0] * c2[0]
    extents = h_A[0] * d2[0] + h_A[1] * d1[0] + h_B[1] * d[2] + h_B[2] * d[1]
    best, code = edge_axis(best, code, number, least, along, extents, c1[0] * c1[0] + c2[0] * c2[0])
    along = t[1] * c1[1] - t[0] * c2[1]
    extents = h_A[0] * d2[1] + h_A[1] * d1[1] + h_B[2] * d[0] + h_B[0] * d[2]
    best, code = edge_axis(best, code, number + 1, least, along, extents, c1[1] * c1[1] + c2[1] * c2[1])
    along = t[1] * c1[2] - t[0] * c2[2]
    extents = h_A[0] * d2[2] + h_A[1] * d1[2] + h_B[0] * d[1] + h_B[1] * d[0]
    return edge_axis(best, code, number + 2, least, along, extents, c1[2] * c1[2] + c2[2] * c2[2])


@kernel(outline=True)
def box_box_contacts(model, table, a, b):
    """Contacts of boxes a and b: one of two edges, up to four corners of what (nearly) parallel faces share."""
    R_WA = table.poses[a].R_WG
    R_WB = table.poses[b].R_WG
    h_A = model[a].half_sizes
    h_B = model[b].half_sizes
    t = sub3(table.poses[b].p_WG, table.poses[a].p_WG)
    R_AB = compose(transpose(R_WA), R_WB)
    x = (R_AB[0], R_AB[1], R_AB[2])
    y = (R_AB[3], R_AB[4], R_AB[5])
    z = (R_AB[6], R_AB[7], R_AB[8])
    dx, dy, dz = absolute3(x), absolute3(y), absolute3(z)
    t_A = rotate_back(R_WA, t)
    t_B = rotate_back(R_WB, t)
    least = least_depth(model, a, b)
    separations = (
        absolute(t_A[0]) - h_A[0] - dot3(h_B, dx),
        absolute(t_A[1]) - h_A[1] - dot3(h_B, dy),
        absolute(t_A[2]) - h_A[2] - dot3(h_B, dz),
        absolute(t_B[0]) - h_B[0] - dot3(h_A, (dx[0], dy[0], dz[0])),
        absolute(t_B[1]) - h_B[1] - dot3(h_A, (dx[1], dy[1], dz[1])),
        absolute(t_B[2]) - h_B[2] - dot3(h_A, (dx[2], dy[2], dz[2])),
    )
    best, code = separations[0], 0
    for k in range(1, 6):  # axes across faces
        if separations[k] > best:
            best, code = separations[k], k
    if best > -least:
        return
    face = code
    best, code = edge_axes(best, code, 6, least, (t_A[1], t_A[2]), (h_A[1], h_A[2]), h_B, y, z, dx, dy, dz)
    best, code = edge_axes(best, code, 9, least, (t_A[2], t_A[0]), (h_A[2], h_A[0]), h_B, z, x, dy, dz, dx)
    best, code = edge_axes(best, code, 12, least, (t_A[0], t_A[1]), (h_A[0], h_A[1]), h_B, x, y, dz, dx, dy)
    if -best <= least:
        return
    if code >= 6 and several_points(model, a, b):
        out = column(R_WA, face) if face < 3 else column(R_WB, face - 3)
        l = cross3(column(R_WA, (code - 6) // 3), column(R_WB, (code - 6) % 3))
        if absolute(dot3(l, out)) >= (1.0 - FLAT) * sqrt(dot3(l, l)):
            code = face
    if code >= 6:
        edge_edge(model, table, a, b, t, (code - 6) // 3, (code - 6) % 3, -best)
    elif code < 3:
        face_of_box(model, table, a, b, column(R_WA, code), t)
    else:
        face_of_box(model, table, b, a, column(R_WB, code - 3), scale3(t, -1.0))


@kernel
def sign_of(x):
    return 1.0 if x >= 0.0 else -1.0


@kernel(outline=True)
def edge_edge(model, table, a, b, t, i, j, depth):
    """The nearest points of the two edges, along axes i of a and j of b, that point at each other."""
    R_WA, p_a = table.poses[a].R_WG, table.poses[a].p_WG
    R_WB, p_b = table.poses[b].R_WG, table.poses[b].p_WG
    u = column(R_WA, i)
    v = column(R_WB, j)
    l = cross3(u, v)
    n = scale3(l, sign_of(dot3(l, t)) / sqrt(dot3(l, l)))
    for k in range(3):
        if k != i:
            x = column(R_WA, k)
            p_a = add3(p_a, scale3(x, model[a].half_along[k] * sign_of(dot3(n, x))))
        if k != j:
            x = column(R_WB, k)
            p_b = sub3(p_b, scale3(x, model[b].half_along[k] * sign_of(dot3(n, x))))
    w = sub3(p_b, p_a)
    uv = dot3(u, v)
    det = 1.0 - uv * uv
    q_a = add3(p_a, scale3(u, (dot3(w, u) - uv * dot3(w, v)) / det))
    q_b = add3(p_b, scale3(v, (uv * dot3(w, u) - dot3(w, v)) / det))
    emit_middle(model, table, a, b, q_a, q_b, scale3(n, -1.0), depth)


@kernel(outline=True)
def face_of_box(model, table, ref, inc, axis, t):
    """Contacts on the face of `ref` across `axis` that looks at `inc`, which is t away."""
    out = scale3(axis, sign_of(dot3(axis, t)))
    sides = shown_feature(model, table, ref, out, POLYGON_A)
    corners = shown_feature(model, table, inc, scale3(out, -1.0), POLYGON_B)
    count = face_candidates(model, table, ref, inc, sides, corners, out)
    if several_points(model, ref, inc):
        emit_four(model, table, inc, ref, out, count)
    elif count > 0:
        deepest = count - 1
        for k in range(count):
            if table.candidates[CANDIDATE + k].depth > table.candidates[CANDIDATE + deepest].depth:
                deepest = k
        emit_candidate(model, table, inc, ref, out, deepest)
