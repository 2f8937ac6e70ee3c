"""Farthest points of convex shapes, and the face, edge or point they show to a direction."""

from __future__ import annotations

from sheldrake.common._kernels.generic import sqrt, whole
from sheldrake.common._kernels.vec import add3, cross3, dot3, rotate, rotate_back, scale3, sub3
from sheldrake.common.kernel import kernel

from .model import BOX, CAPSULE, CELLS, CYLINDER, ELLIPSOID, HULL, MAX_CORNERS, POLYGON_A, SPHERE, X_AXIS, Z_AXIS
from .table import CORNERS, absolute, column, longest

_COS, _SIN, _DIAGONAL = 0.9238795325112867, 0.3826834323650898, 0.7071067811865476  # of 22.5 degrees, of 45
_QUARTER = ((1.0, 0.0), (_COS, _SIN), (_DIAGONAL, _DIAGONAL), (_SIN, _COS))
# cos and sin of multiples of 22.5 degrees: a cap is shown as a polygon of 16 corners
_CAP = (
    *_QUARTER,
    *((-s, c) for c, s in _QUARTER),
    *((-c, -s) for c, s in _QUARTER),
    *((s, -c) for c, s in _QUARTER),
)
_APOTHEM = 0.9807852804032304  # of that polygon, over its radius: the cosine of 11.25 degrees
_SURELY = 1.0 + 1e-9  # a square that is larger by this factor is larger in spite of rounding
_NEARLY_FLAT = 0.02  # sine of the angle between a cap's normal and the direction it is shown to


@kernel
def margin_of(model, g):
    """How much a shape is larger than its core: spheres are points, capsules segments with a margin [m]."""
    kind = model[g].kind
    if kind == SPHERE or kind == CAPSULE:
        return model[g].radius
    return 0.0 * model[g].radius


@kernel(outline=True)
def farthest_vertex(model, table, g, d_W):
    """(Its number among the vertices of the shape, the point) of the core of shape g farthest along d_W, in W.

    Corners of a box and ends of a capsule have one bit an axis, 1 on the positive side. Curved shapes have no numbers.
    """
    R_WG = table.poses[g].R_WG
    d = rotate_back(R_WG, d_W)
    kind = model[g].kind
    h = model[g].half_sizes
    number = 0
    p = (0.0, 0.0, 0.0)
    if kind == BOX:
        p = (h[0] if d[0] >= 0.0 else -h[0], h[1] if d[1] >= 0.0 else -h[1], h[2] if d[2] >= 0.0 else -h[2])
        number = (1 if d[0] >= 0.0 else 0) + (2 if d[1] >= 0.0 else 0) + (4 if d[2] >= 0.0 else 0)
    elif kind == HULL:
        v = lowest_vertex(model, g, scale3(d, -1.0))
        p = model.vertices[v].p_GV
        number = v - model[g].first_vertex
    elif kind == CAPSULE:
        p = (0.0, 0.0, h[2] if d[2] >= 0.0 else -h[2])
        number = 4 if d[2] >= 0.0 else 0
    elif kind == CYLINDER:
        rho = sqrt(d[0] * d[0] + d[1] * d[1])
        x, y = 0.0, 0.0
        if rho > 1e-14 * absolute(d[2]):
            x, y = h[0] * d[0] / rho, h[0] * d[1] / rho
        p = (x, y, h[2] if d[2] >= 0.0 else -h[2])
    elif kind == ELLIPSOID:
        e = (h[0] * d[0], h[1] * d[1], h[2] * d[2])
        size = sqrt(dot3(e, e))
        if size > 0.0:
            p = (h[0] * e[0] / size, h[1] * e[1] / size, h[2] * e[2] / size)
    return number, add3(table.poses[g].p_WG, rotate(R_WG, p))


@kernel
def support(model, table, g, d_W):
    """The point of the core of shape g farthest along d_W, in W."""
    _number, p_W = farthest_vertex(model, table, g, d_W)
    return p_W


@kernel
def vertex_in_frame(model, g, number):
    """The vertex with a number, as `farthest_vertex` gives it, in the frame of the shape; not of curved shapes."""
    kind = model[g].kind
    p = (0.0, 0.0, 0.0)
    if kind == HULL:
        p = model.vertices[model[g].first_vertex + number].p_GV
    elif kind == BOX or kind == CAPSULE:
        h = model[g].half_sizes
        p = (h[0] if number & 1 else -h[0], h[1] if number & 2 else -h[1], h[2] if number & 4 else -h[2])
        if kind == CAPSULE:
            p = (0.0, 0.0, p[2])
    return p


@kernel(outline=True)
def core_vertex(model, table, g, number):
    """The same in W."""
    return add3(table.poses[g].p_WG, rotate(table.poses[g].R_WG, vertex_in_frame(model, g, number)))


@kernel
def has_faces(model, g):
    kind = model[g].kind
    return kind == BOX or kind == HULL or kind == CYLINDER


@kernel
def is_faceted(model, g):
    """Whether a shape has flat faces alone."""
    kind = model[g].kind
    return kind == BOX or kind == HULL


@kernel
def is_curved(model, g):
    """Whether the core of a shape is no polytope."""
    kind = model[g].kind
    return kind == CYLINDER or kind == ELLIPSOID


@kernel
def is_face(model, g, face):
    """Whether a box or hull has a face of this number."""
    if model[g].kind == BOX:
        return face >= 0 and face < 6
    first = model[g].first_face
    return model[g].kind == HULL and face >= first and face < first + model[g].num_faces


@kernel(outline=True)
def normal_of_face(model, table, g, face):
    """Outward normal of a face of a box or hull in W; no face's number gives a vector of zeros."""
    R_WG = table.poses[g].R_WG
    if not is_face(model, g, face):
        return (0.0, 0.0, 0.0)
    if model[g].kind == BOX:
        axis = column(R_WG, face // 2)
        return axis if face % 2 == 1 else scale3(axis, -1.0)
    return rotate(R_WG, model.faces[face].normal)


@kernel
def height_of_face(model, table, g, face, n_W):
    """How far a face as `best_face` numbers it, with this normal in W, is from the origin of W along it [m]."""
    height = 0.0
    if model[g].kind == CYLINDER:
        height = model[g].half_length
    elif is_face(model, g, face):
        height = model.faces[face].offset if model[g].kind == HULL else model[g].half_along[face // 2]
    return dot3(n_W, table.poses[g].p_WG) + height


@kernel(outline=True)
def best_face(model, table, g, n_W):
    """Of a shape with flat faces: the number of the face that looks along n_W most, and its outward normal in W.

    Box: 2 axis + (1 if on the positive side). Cylinder: 0 or 1, the caps. Hull: row of model.face, of those around
    the vertex farthest along n_W.
    """
    R_WG = table.poses[g].R_WG
    n = rotate_back(R_WG, n_W)
    kind = model[g].kind
    if kind == CYLINDER:
        axis = column(R_WG, Z_AXIS)
        if n[2] >= 0.0:
            return 1, axis
        return 0, scale3(axis, -1.0)
    if kind == BOX:
        k, along = longest(n)
        best = 2 * k + 1 if along >= 0.0 else 2 * k
    else:
        best = steepest_face(model, lowest_vertex(model, g, scale3(n, -1.0)), n)
    return best, normal_of_face(model, table, g, best)


@kernel
def face_around(model, table, g, vertex, n_W):
    """`best_face` of a hull of which a vertex is known that is farthest along n_W."""
    face = steepest_face(model, model[g].first_vertex + vertex, rotate_back(table.poses[g].R_WG, n_W))
    return face, normal_of_face(model, table, g, face)


@kernel(outline=True)
def box_face(model, table, g, face, row):
    """Corners of a face of a box into `table.corners`, counter-clockwise seen from outside; their number."""
    R_WG = table.poses[g].R_WG
    k = face // 2
    u, v = (k + 1) % 3, (k + 2) % 3
    s = 1.0 if face - 2 * k == 1 else -1.0
    centre = add3(table.poses[g].p_WG, scale3(column(R_WG, k), s * model[g].half_along[k]))
    U = scale3(column(R_WG, u), model[g].half_along[u])
    V = scale3(column(R_WG, v), s * model[g].half_along[v])
    for su, sv in CORNERS:
        table.corners[row].p_W = add3(centre, add3(scale3(U, su), scale3(V, sv)))
        row += 1
    return 4


@kernel(outline=True)
def cap(model, table, g, n_W, row):
    """A cap of a cylinder as a polygon.

    Tilted, its first corner is the rim point farthest along n_W; nearly flat, the corners stay where they are on the
    body, so that it can rest on them.
    """
    R_WG = table.poses[g].R_WG
    axis = column(R_WG, Z_AXIS)
    c = dot3(axis, n_W)
    s = 1.0 if c >= 0.0 else -1.0
    radius = model[g].radius
    centre = add3(table.poses[g].p_WG, scale3(axis, s * model[g].half_length))
    U = add3(n_W, scale3(axis, -c))
    slope = sqrt(dot3(U, U))
    if slope > _NEARLY_FLAT:
        U = scale3(U, radius / slope)
    else:
        U = scale3(column(R_WG, X_AXIS), radius)
    V = scale3(cross3(axis, U), s)
    for along, across in _CAP:
        table.corners[row].p_W = add3(centre, add3(scale3(U, along), scale3(V, across)))
        row += 1
    return len(_CAP)


@kernel(outline=True)
def hull_face(model, table, g, face, row):
    """Corners of a face of a hull into `table.corners`; of a very rich face evenly chosen ones."""
    R_WG = table.poses[g].R_WG
    p_WG = table.poses[g].p_WG
    count = model.loops[face].num_corners
    used = count if count < MAX_CORNERS else MAX_CORNERS
    for k in range(used):
        v = model.topology[model.loops[face].first_corner + (k * count) // used]
        table.corners[row + k].p_W = add3(p_WG, rotate(R_WG, model.vertices[v].p_GV))
    return used


@kernel
def shown_feature(model, table, g, n_W, row):
    """What shape g shows to direction n_W: corners of a face (3 or more), an edge (2) or a point (1); their number."""
    face = -1
    if has_faces(model, g):
        face, _normal = best_face(model, table, g, n_W)
    return shown_face(model, table, g, face, n_W, row)


@kernel(outline=True)
def shown_face(model, table, g, face, n_W, row):
    """`shown_feature` of a shape whose `best_face` along n_W is known; any number where it has none."""
    kind = model[g].kind
    if kind == BOX or kind == HULL:
        return box_face(model, table, g, face, row) if kind == BOX else hull_face(model, table, g, face, row)
    axis = column(table.poses[g].R_WG, Z_AXIS)
    c = dot3(axis, n_W)
    if kind == CYLINDER and absolute(c) > 0.7071067811865476:
        return cap(model, table, g, n_W, row)
    if kind == CYLINDER or kind == CAPSULE:
        side = n_W
        if kind == CYLINDER:
            side = add3(n_W, scale3(axis, -c))
            side = scale3(side, 1.0 / sqrt(dot3(side, side)))
        middle = add3(table.poses[g].p_WG, scale3(side, model[g].radius))
        arm = scale3(axis, model[g].half_length)
        table.corners[row].p_W = add3(middle, scale3(arm, -1.0))
        table.corners[row + 1].p_W = add3(middle, arm)
        return 2
    table.corners[row].p_W = add3(support(model, table, g, n_W), scale3(n_W, margin_of(model, g)))
    return 1


@kernel
def corner_after(k, corners):
    """The next corner of a polygon, without the remainder that takes longer than all else of a side."""
    return k + 1 if k + 1 < corners else 0


@kernel
def side_of_face(table, k, sides, n_W):
    """Of a face in POLYGON_A with normal n_W: a corner, and a vector out of the side that begins there."""
    a = table.corners[POLYGON_A + k].p_W
    return a, cross3(sub3(table.corners[POLYGON_A + corner_after(k, sides)].p_W, a), n_W)


@kernel(outline=True)
def within_face(model, table, g, face, n_W, x, margin):
    """Whether x is within a face (of a cap: its polygon) of g with normal n_W, a margin away from its edges [m]."""
    if model[g].kind == CYLINDER:
        r = sub3(x, table.poses[g].p_WG)
        along = dot3(r, n_W)
        rho2 = dot3(r, r) - along * along
        most, least = model[g].radius - margin, _APOTHEM * model[g].radius - margin
        if most < 0.0 or rho2 > _SURELY * most * most:
            return False
        if least > 0.0 and _SURELY * rho2 < least * least:
            return True
    return within_polygon(table, shown_face(model, table, g, face, n_W, POLYGON_A), n_W, x, margin)


@kernel
def within_polygon(table, sides, n_W, x, margin):
    """`within_face` of the polygon in POLYGON_A."""
    for k in range(sides):
        a, outward = side_of_face(table, k, sides, n_W)
        if dot3(outward, sub3(x, a)) > -margin * sqrt(dot3(outward, outward)):
            return False
    return True


@kernel(outline=True)
def part_within_face(model, table, g, face, n_W, x, edge):
    """(t, u) so that the points from x + t edge to x + u edge lie over a face of g with normal n_W; t > u if none do.

    The corners of the face stay in POLYGON_A.
    """
    low = 0.0
    high = 1.0
    sides = shown_face(model, table, g, face, n_W, POLYGON_A)
    for k in range(sides):
        a, outward = side_of_face(table, k, sides, n_W)
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


# ---- hulls: searches among their vertices and faces

ALL_TRIED = 8  # of hulls with at most so many vertices each is tried
_LAST = CELLS * CELLS - 1


@kernel
def part_along(x):
    """Which of the parts of cells along an edge of a cube, all of them counted; x goes from -1 to 1."""
    k = whole(0.5 * CELLS * CELLS * (x + 1.0))
    return 0 if k < 0 else (_LAST if k > _LAST else k)


@kernel
def cell_of(n):
    """The cell of a cube around the origin that n goes through, and the part of the cell; see CELLS."""
    axis, a = longest(n)
    if a == 0.0:
        return 0, 0
    b, c = n[(axis + 1) % 3], n[(axis + 2) % 3]
    r = 1.0 / absolute(a)
    side = 2 * axis + (1 if a > 0.0 else 0)
    row, place = part_along(b * r), part_along(c * r)
    cell = (side * CELLS + row // CELLS) * CELLS + place // CELLS
    return cell, (row % CELLS) * CELLS + place % CELLS


@kernel(outline=True)
def lowest_vertex(model, g, n_G):
    """The vertex (row of model.vertex) of a hull with the least height along n_G; the first of equal ones."""
    first = model[g].first_vertex
    count = model[g].num_vertices
    k = first
    if count <= ALL_TRIED:
        least = dot3(model.vertices[k].p_GV, n_G)
        for v in range(first + 1, first + count):
            z = dot3(model.vertices[v].p_GV, n_G)
            if z < least:
                least, k = z, v
        return k
    cell, part = cell_of(n_G)
    at = model[g].first_cell + cell
    start = model.topology[at]
    k = model.topology[start]
    if k < 0:
        at = part - k
        start = model.topology[at]
        k = model.topology[start]
    least = dot3(model.vertices[k].p_GV, n_G)
    for e in range(start + 1, model.topology[at + 1]):
        v = model.topology[e]
        z = dot3(model.vertices[v].p_GV, n_G)
        if z < least:
            least, k = z, v
    return k


@kernel
def steepest_face(model, v, n_G):
    """Of the faces around a vertex (row of model.vertex) of a hull, the one (row of model.face) most along n_G."""
    place = model.vertex.shape[0] + 1 + v
    best = model.topology[model.topology[place]]
    most = dot3(model.faces[best].normal, n_G)
    for k in range(model.topology[place] + 1, model.topology[place + 1]):
        f = model.topology[k]
        along = dot3(model.faces[f].normal, n_G)
        if along > most:
            most, best = along, f
    return best
