"""Contacts of two boxes by separating axes (Gottschalk 1996), with Drake's order and preference for face axes."""

from __future__ import annotations

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common._kernels.vec import add3, cross3, dot3, load3, scale3, sub3
from sheldrake.common.kernel import kernel

from .convex import FLAT, emit_candidate, emit_four, emit_middle, face_candidates
from .model import CANDIDATE, MULTI_POINT, X_AXIS, Y_AXIS, Z_AXIS
from .table import absolute, column, least_depth, position_of, rotation_of

_PREFER_FACES = 0.05  # an edge axis must be better by this fraction
_PARALLEL = 1e-10  # squared sine of the angle between edges that define no axis


@kernel
def extent(R, h, l):
    """Half the extent of a box along l."""
    return (
        h[0] * absolute(dot3(l, column(R, X_AXIS)))
        + h[1] * absolute(dot3(l, column(R, Y_AXIS)))
        + h[2] * absolute(dot3(l, column(R, Z_AXIS)))
    )


@kernel(outline=True)
def box_box_contacts(model, table, a, b):
    """Contacts of boxes a and b: one of two edges, up to four corners of what (nearly) parallel faces share."""
    R_WA = rotation_of(table, a)
    R_WB = rotation_of(table, b)
    h_A = load3(model.size, a)
    h_B = load3(model.size, b)
    t = sub3(position_of(table, b), position_of(table, a))
    best = -1e300
    code = 0
    least = least_depth(model, a, b)
    for k in range(3):
        l = column(R_WA, k)
        s = absolute(dot3(l, t)) - model.size[a, k] - extent(R_WB, h_B, l)
        if s > -least:
            return
        if s > best:
            best = s
            code = k
    for k in range(3):
        l = column(R_WB, k)
        s = absolute(dot3(l, t)) - model.size[b, k] - extent(R_WA, h_A, l)
        if s > -least:
            return
        if s > best:
            best = s
            code = 3 + k
    face = code
    for i in range(3):
        for j in range(3):
            l = cross3(column(R_WA, i), column(R_WB, j))
            norm2 = dot3(l, l)
            if norm2 > _PARALLEL:
                s = absolute(dot3(l, t)) - extent(R_WA, h_A, l) - extent(R_WB, h_B, l)
                if s < 0.0 and s * s > best * best * norm2:
                    continue  # deeper than the best axis, by far if the boxes rest on each other: no need to divide
                s = s / sqrt(norm2)
                if s > -least:
                    return
                if s - _PREFER_FACES * absolute(s) > best:
                    best = s
                    code = 6 + 3 * i + j
    if -best <= least:
        return
    if code >= 6 and model.geometry[a, MULTI_POINT] + model.geometry[b, MULTI_POINT] == 2:
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
    R_WA = rotation_of(table, a)
    R_WB = rotation_of(table, b)
    u = column(R_WA, i)
    v = column(R_WB, j)
    l = cross3(u, v)
    n = scale3(l, sign_of(dot3(l, t)) / sqrt(dot3(l, l)))
    p_a = position_of(table, a)
    p_b = position_of(table, b)
    for k in range(3):
        if k != i:
            x = column(R_WA, k)
            p_a = add3(p_a, scale3(x, model.size[a, k] * sign_of(dot3(n, x))))
        if k != j:
            x = column(R_WB, k)
            p_b = sub3(p_b, scale3(x, model.size[b, k] * sign_of(dot3(n, x))))
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
    count = face_candidates(model, table, ref, inc, out, out)
    if model.geometry[ref, MULTI_POINT] + model.geometry[inc, MULTI_POINT] == 2:
        emit_four(model, table, inc, ref, out, count)
    elif count > 0:
        deepest = count - 1
        for k in range(count):
            if table.work[CANDIDATE + k, 3] > table.work[CANDIDATE + deepest, 3]:
                deepest = k
        emit_candidate(model, table, inc, ref, out, deepest)
