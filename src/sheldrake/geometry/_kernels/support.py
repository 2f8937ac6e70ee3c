"""Farthest points of convex shapes, and the face, edge or point they show to a direction."""

from __future__ import annotations

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common._kernels.vec import add3, cross3, dot3, load3, rotate, rotate_back, scale3, store3, sub3
from sheldrake.common.kernel import kernel

from .hull import lowest_vertex, steepest_face
from .model import (
    BOX,
    CAPSULE,
    CYLINDER,
    ELLIPSOID,
    FIRST_CORNER,
    HALF_LENGTH,
    HULL,
    KIND,
    MAX_CORNERS,
    NUM_CORNERS,
    POLYGON_A,
    RADIUS,
    SPHERE,
    X_AXIS,
    Z_AXIS,
)
from .table import absolute, column, position_of, rotation_of

# cos and sin of multiples of 22.5 degrees: a cap is shown as a polygon of 16 corners
_CAP_CORNERS = 16
_NEARLY_FLAT = 0.02  # sine of the angle between a cap's normal and the direction it is shown to
_COS = 0.9238795325112867
_SIN = 0.3826834323650898


@kernel
def margin_of(model, g):
    """How much a shape is larger than its core: spheres are points, capsules segments with a margin [m]."""
    kind = model.geometry[g, KIND]
    if kind == SPHERE or kind == CAPSULE:
        return model.size[g, RADIUS]
    return 0.0 * model.size[g, RADIUS]


@kernel(outline=True)
def support(model, table, g, d_W):
    """The point of the core of shape g farthest along d_W, in W."""
    R_WG = rotation_of(table, g)
    d = rotate_back(R_WG, d_W)
    kind = model.geometry[g, KIND]
    h = load3(model.size, g)
    p = (0.0, 0.0, 0.0)
    if kind == BOX:
        p = (h[0] if d[0] >= 0.0 else -h[0], h[1] if d[1] >= 0.0 else -h[1], h[2] if d[2] >= 0.0 else -h[2])
    elif kind == HULL:
        p = load3(model.vertex, lowest_vertex(model, g, scale3(d, -1.0)))
    elif kind == CAPSULE:
        p = (0.0, 0.0, h[2] if d[2] >= 0.0 else -h[2])
    elif kind == CYLINDER:
        rho = sqrt(d[0] * d[0] + d[1] * d[1])
        x = 0.0
        y = 0.0
        if rho > 1e-14 * absolute(d[2]):
            x = h[0] * d[0] / rho
            y = h[0] * d[1] / rho
        p = (x, y, h[2] if d[2] >= 0.0 else -h[2])
    elif kind == ELLIPSOID:
        e = (h[0] * d[0], h[1] * d[1], h[2] * d[2])
        size = sqrt(dot3(e, e))
        if size > 0.0:
            p = (h[0] * e[0] / size, h[1] * e[1] / size, h[2] * e[2] / size)
    return add3(position_of(table, g), rotate(R_WG, p))


@kernel
def has_faces(model, g):
    kind = model.geometry[g, KIND]
    return kind == BOX or kind == HULL or kind == CYLINDER


@kernel(outline=True)
def best_face(model, table, g, n_W):
    """Of a shape with flat faces: the number of the face that looks along n_W most, and its outward normal in W.

    Box: 2 axis + (1 if on the positive side). Cylinder: 0 or 1, the caps. Hull: row of model.face, of those around
    the vertex farthest along n_W.
    """
    R_WG = rotation_of(table, g)
    n = rotate_back(R_WG, n_W)
    kind = model.geometry[g, KIND]
    if kind == CYLINDER:
        axis = column(R_WG, Z_AXIS)
        if n[2] >= 0.0:
            return 1, axis
        return 0, scale3(axis, -1.0)
    if kind == BOX:
        k = 0
        along = n[0]
        if absolute(n[1]) > absolute(along):
            k = 1
            along = n[1]
        if absolute(n[2]) > absolute(along):
            k = 2
            along = n[2]
        axis = column(R_WG, k)
        if along >= 0.0:
            return 2 * k + 1, axis
        return 2 * k, scale3(axis, -1.0)
    best = steepest_face(model, lowest_vertex(model, g, scale3(n, -1.0)), n)
    return best, rotate(R_WG, load3(model.face, best))


@kernel(outline=True)
def box_face(model, table, g, face, row):
    """Corners of a face of a box into table.work, counter-clockwise seen from outside; their number."""
    R_WG = rotation_of(table, g)
    k = face // 2
    u = (k + 1) % 3
    v = (k + 2) % 3
    s = 1.0 if face - 2 * k == 1 else -1.0
    centre = add3(position_of(table, g), scale3(column(R_WG, k), s * model.size[g, k]))
    U = scale3(column(R_WG, u), model.size[g, u])
    V = scale3(column(R_WG, v), s * model.size[g, v])
    for corner in range(4):
        su = -1.0 if corner == 0 or corner == 3 else 1.0
        sv = -1.0 if corner < 2 else 1.0
        store3(table.work, row + corner, add3(centre, add3(scale3(U, su), scale3(V, sv))))
    return 4


@kernel(outline=True)
def cap(model, table, g, n_W, row):
    """A cap of a cylinder as a polygon.

    Tilted, its first corner is the rim point farthest along n_W; nearly flat, the corners stay where they are on the
    body, so that it can rest on them.
    """
    R_WG = rotation_of(table, g)
    axis = column(R_WG, Z_AXIS)
    c = dot3(axis, n_W)
    s = 1.0 if c >= 0.0 else -1.0
    radius = model.size[g, RADIUS]
    centre = add3(position_of(table, g), scale3(axis, s * model.size[g, HALF_LENGTH]))
    U = add3(n_W, scale3(axis, -c))
    slope = sqrt(dot3(U, U))
    if slope > _NEARLY_FLAT:
        U = scale3(U, radius / slope)
    else:
        U = scale3(column(R_WG, X_AXIS), radius)
    V = scale3(cross3(axis, U), s)
    for corner in range(_CAP_CORNERS):
        store3(table.work, row + corner, add3(centre, U))
        turned = add3(scale3(U, _COS), scale3(V, _SIN))
        V = add3(scale3(V, _COS), scale3(U, -_SIN))
        U = turned
    return _CAP_CORNERS


@kernel(outline=True)
def hull_face(model, table, g, face, row):
    """Corners of a face of a hull into table.work; of a very rich face evenly chosen ones."""
    R_WG = rotation_of(table, g)
    p_WG = position_of(table, g)
    count = model.loop[face, NUM_CORNERS]
    used = count if count < MAX_CORNERS else MAX_CORNERS
    for k in range(used):
        v = model.topology[model.loop[face, FIRST_CORNER] + (k * count) // used]
        store3(table.work, row + k, add3(p_WG, rotate(R_WG, load3(model.vertex, v))))
    return used


@kernel(outline=True)
def shown_feature(model, table, g, n_W, row):
    """What shape g shows to direction n_W: corners of a face (3 or more), an edge (2) or a point (1); their number."""
    kind = model.geometry[g, KIND]
    if kind == BOX:
        face, _normal = best_face(model, table, g, n_W)
        return box_face(model, table, g, face, row)
    if kind == HULL:
        face, _normal = best_face(model, table, g, n_W)
        return hull_face(model, table, g, face, row)
    axis = column(rotation_of(table, g), Z_AXIS)
    c = dot3(axis, n_W)
    if kind == CYLINDER and absolute(c) > 0.7071067811865476:
        return cap(model, table, g, n_W, row)
    if kind == CYLINDER or kind == CAPSULE:
        side = n_W
        if kind == CYLINDER:
            side = add3(n_W, scale3(axis, -c))
            side = scale3(side, 1.0 / sqrt(dot3(side, side)))
        middle = add3(position_of(table, g), scale3(side, model.size[g, RADIUS]))
        arm = scale3(axis, model.size[g, HALF_LENGTH])
        store3(table.work, row, add3(middle, scale3(arm, -1.0)))
        store3(table.work, row + 1, add3(middle, arm))
        return 2
    store3(table.work, row, add3(support(model, table, g, n_W), scale3(n_W, margin_of(model, g))))
    return 1


@kernel(outline=True)
def within_face(model, table, g, n_W, x, margin):
    """Whether x is within the face (of a cap: its polygon) of g with normal n_W, a margin away from its edges [m].

    The corners of the face stay in POLYGON_A.
    """
    sides = shown_feature(model, table, g, n_W, POLYGON_A)
    for k in range(sides):
        a = load3(table.work, POLYGON_A + k)
        outward = cross3(sub3(load3(table.work, POLYGON_A + (k + 1) % sides), a), n_W)
        if dot3(outward, sub3(x, a)) > -margin * sqrt(dot3(outward, outward)):
            return False
    return True


@kernel(outline=True)
def part_within_face(model, table, g, n_W, x, edge):
    """(t, u) so that the points from x + t edge to x + u edge lie over the face of g with normal n_W; t > u if none do.

    The corners of the face stay in POLYGON_A.
    """
    low = 0.0
    high = 1.0
    sides = shown_feature(model, table, g, n_W, POLYGON_A)
    for k in range(sides):
        a = load3(table.work, POLYGON_A + k)
        outward = cross3(sub3(load3(table.work, POLYGON_A + (k + 1) % sides), a), n_W)
        height = dot3(outward, sub3(x, a))
        rise = dot3(outward, edge)
        if rise > 0.0:
            if high * rise > -height:
                high = -height / rise
        elif rise < 0.0:
            if low * rise > -height:
                low = -height / rise
        elif height > 0.0:
            return 1.0, 0.0
    return low, high
