"""The last digits of a distance between curved shapes, by Newton's method on the direction.

The direction d out of a difference of shapes is right where its farthest point w(d) lies along d itself. With the
support h(d) = d . w(d) that is where h has no slope along the unit sphere, and the slope changes by the radii of
curvature of the shapes less h (Schneider 2014, section 2.5: the Hessian of a support function holds the radii of
curvature). GJK and EPA come near such a direction in few steps, but take a hundred to all digits on a round rim;
Newton's method takes three.

A shape is as far along a whole edge as at its ends where d is square to the edge: there h has a kink, and the best
direction is usually in one. So edges that are nearly square to d are taken to be exactly square to it: with none d is
free, with one it turns about the edge, with two it is given. The points of the answer tell whether that was right.
"""

from __future__ import annotations

from sheldrake.common._kernels.generic import sqrt, whole
from sheldrake.common._kernels.vec import add3, cross3, dot3, rotate, rotate_back, scale3, sub3
from sheldrake.common.kernel import kernel

from .model import (
    BOX,
    CAPSULE,
    CYLINDER,
    ELLIPSOID,
    HULL,
    POLYGON_A,
    SPHERE,
    X_AXIS,
    Y_AXIS,
    Z_AXIS,
)
from .support import best_face, has_faces, height_of_face, lowest_vertex, part_within_face, support, within_face
from .table import absolute, column

SQUARE = 5e-3  # cosine of the angle to d of an edge that is taken to be square to it
NARROW = 3e-4  # the same where many edges are
FINE = 1e-5  # the same where sides of two cylinders are nearly parallel, and only one of them is square to it
_EXACT = 1e-10  # the same where a point of the edge stands for its end
_CAP = 0.1  # of these: sine of the angle between d and a cap's normal where the cap, not its rim, is meant
_STEPS = 8
_LAST_STEPS = 4
_FARTHEST = 0.3  # a Newton step turns d by no more [rad]
_LEVEL = 1e-14  # relative to the size: a slope of h that is none
_CONVERGED = 1e-11  # far from the origin it never is: a step that turns d by no more is the last, too [rad]
_CLOSE = 1e-7  # after a step that turns d by no more, d goes to the nearest point of a grid [rad]
_GRID = 16777216.0  # points of it per unit
_PARALLEL = 1e-6  # sine of the angle between edges that give no direction
_LOOSE = 1e-10  # relative to the size: how far the points of the answer may be from where d and depth say they are
_BEYOND = 1e-9  # relative to an edge: how far behind its end a point may be
_ROUNDING = 1e-12  # relative to the size: a direction that loses no more is as good, where positions are of a metre
_AS_GOOD = 1e-9  # the same of a face, which would be missed where caps are all but flat on one another

# Scratch, in rows that polygons use later
EDGE = POLYGON_A
BEND = POLYGON_A + 4
_MOST = 3  # edges that are written
_TOO_MANY = 9  # edges: of a cap, which has none; its middle stands for its farthest point


@kernel
def add_dyad(table, s, v):
    """Adds s v vᵀ to BEND."""
    table.bends[BEND].radii = add3(table.bends[BEND].radii, (s * v[0] * v[0], s * v[1] * v[1], s * v[2] * v[2]))
    mixed = (s * v[0] * v[1], s * v[0] * v[2], s * v[1] * v[2])
    table.bends[BEND + 1].radii = add3(table.bends[BEND + 1].radii, mixed)


@kernel
def bend(table, v):
    """BEND v: how w changes with the direction."""
    straight = table.bends[BEND].radii
    mixed = table.bends[BEND + 1].radii
    return (
        straight[0] * v[0] + mixed[0] * v[1] + mixed[1] * v[2],
        mixed[0] * v[0] + straight[1] * v[1] + mixed[2] * v[2],
        mixed[1] * v[0] + mixed[2] * v[1] + straight[2] * v[2],
    )


@kernel
def bend_between(table, u, v):
    """uᵀ BEND v."""
    return dot3(u, bend(table, v))


@kernel
def add_edge(table, count, edge, sign):
    """Writes an edge unless there are too many already; how many there are."""
    if count < _MOST:
        table.edges[EDGE + count].edge = scale3(edge, sign)
        table.edges[EDGE + count].sign = sign
    return count + 1


@kernel
def hull_edges(model, table, g, d_G, square, sign, count):
    """Farthest vertex of a hull along d, and its edges square to d."""
    R_WG = table.poses[g].R_WG
    v = lowest_vertex(model, g, scale3(d_G, -1.0))
    p = model.vertices[v].p_GV
    for k in range(model.topology[v], model.topology[v + 1]):
        edge = sub3(model.vertices[model.topology[k]].p_GV, p)
        if -dot3(edge, d_G) < square * sqrt(dot3(edge, edge)):
            count = add_edge(table, count, rotate(R_WG, edge), sign)
    return rotate(R_WG, p), count


@kernel
def cylinder_rim(model, table, g, d, square, sign, count):
    """Farthest point of a cylinder from its centre along d, and its side if that is square to d."""
    axis = column(table.poses[g].R_WG, Z_AXIS)
    along = dot3(axis, d)
    half = scale3(axis, model[g].half_length * (1.0 if along >= 0.0 else -1.0))
    out = sub3(d, scale3(axis, along))
    slope = sqrt(dot3(out, out))
    if slope < _CAP * square:
        return half, _TOO_MANY
    radius = model[g].radius
    if absolute(along) < square * slope:
        count = add_edge(table, count, scale3(half, -2.0), sign)
    tangent = scale3(cross3(axis, out), 1.0 / slope)
    add_dyad(table, radius / slope, tangent)
    return add3(half, scale3(out, radius / slope)), count


@kernel
def ellipsoid_point(model, table, g, d_G):
    """Farthest point of an ellipsoid from its centre along d."""
    R_WG = table.poses[g].R_WG
    h = model[g].half_sizes
    e = (h[0] * d_G[0], h[1] * d_G[1], h[2] * d_G[2])
    support = sqrt(dot3(e, e))
    p = rotate(R_WG, (h[0] * e[0] / support, h[1] * e[1] / support, h[2] * e[2] / support))
    add_dyad(table, h[0] * h[0] / support, column(R_WG, X_AXIS))
    add_dyad(table, h[1] * h[1] / support, column(R_WG, Y_AXIS))
    add_dyad(table, h[2] * h[2] / support, column(R_WG, Z_AXIS))
    add_dyad(table, -1.0 / support, p)
    return p


@kernel(outline=True)
def show(model, table, g, d, square, sign, count):
    """Farthest point of the core of a shape along d; its edges square to d and its curvature go to EDGE and BEND.

    Edges have the sign that they have in the difference.
    """
    R_WG = table.poses[g].R_WG
    d_G = rotate_back(R_WG, d)
    kind = model[g].kind
    p = (0.0, 0.0, 0.0)
    if kind == BOX:
        for k in range(3):
            along = dot3(column(R_WG, k), d)
            half = scale3(column(R_WG, k), model[g].half_along[k] * (1.0 if along >= 0.0 else -1.0))
            p = add3(p, half)
            if absolute(along) < square:
                count = add_edge(table, count, scale3(half, -2.0), sign)
    elif kind == HULL:
        p, count = hull_edges(model, table, g, d_G, square, sign, count)
    elif kind == CAPSULE:
        axis = column(R_WG, Z_AXIS)
        p = scale3(axis, model[g].half_length * (1.0 if d_G[2] >= 0.0 else -1.0))
        if absolute(d_G[2]) < square:
            count = add_edge(table, count, scale3(p, -2.0), sign)
    elif kind == CYLINDER:
        p, count = cylinder_rim(model, table, g, d, square, sign, count)
    elif kind == ELLIPSOID:
        p = ellipsoid_point(model, table, g, d_G)
    elif kind != SPHERE:  # nobody said how it bends
        return support(model, table, g, d), _TOO_MANY
    return add3(table.poses[g].p_WG, p), count


@kernel
def may_show_face(model, table, g, d):
    """Whether a face of g may look along d; of cylinders it is told at once that none does."""
    if model[g].kind == CYLINDER:
        return absolute(dot3(column(table.poses[g].R_WG, Z_AXIS), d)) >= 1.0 - 0.5 * SQUARE * SQUARE
    return has_faces(model, g)


@kernel(outline=True)
def face_against(model, table, g, other, d):
    """From a direction d out of g, which has faces: (whether one touches, its normal, depth, points on g and other)."""
    face, n = best_face(model, table, g, d)
    if dot3(n, d) < 1.0 - 0.5 * SQUARE * SQUARE:
        return False, d, 0.0, d, d
    p, count = show(model, table, other, scale3(n, -1.0), _EXACT, 1.0, 0)
    if count < _TOO_MANY:
        written = count if count < _MOST else _MOST
        for k in range(written):  # to the middle of what the other shape shows, so that ends may stick out
            p = add3(p, scale3(table.edges[EDGE + k].edge, 0.5 / written))
    depth = height_of_face(model, table, g, face, n) - dot3(n, p)
    if count == 1:
        edge = table.edges[EDGE].edge
        start = sub3(p, scale3(edge, 0.5))
        low, high = part_within_face(model, table, g, face, n, start, edge)
        p = add3(start, scale3(edge, 0.5 * (low + high)))
        return low <= high, n, depth, add3(p, scale3(n, depth)), p
    p_g = add3(p, scale3(n, depth))
    return within_face(model, table, g, face, n, p_g, 0.0), n, depth, p_g, p


@kernel
def show_both(model, table, i, j, d, square):
    """Farthest points of i along d and of j along -d, and how many edges they have square to d."""
    table.bends[BEND].radii = (0.0, 0.0, 0.0)
    table.bends[BEND + 1].radii = (0.0, 0.0, 0.0)
    p_i, count = show(model, table, i, d, square, 1.0, 0)
    p_j, count = show(model, table, j, scale3(d, -1.0), square, -1.0, count)
    return p_i, p_j, count


@kernel
def unit(v):
    return scale3(v, 1.0 / sqrt(dot3(v, v)))


@kernel(outline=True)
def square_to_edges(table, count, d):
    """(whether there is one, the direction nearest to d square to all edges)."""
    if count == 0:
        return True, d
    e = unit(table.edges[EDGE].edge)
    if count == 1:
        return True, unit(sub3(d, scale3(e, dot3(e, d))))
    across = cross3(e, unit(table.edges[EDGE + 1].edge))
    if dot3(across, across) < _PARALLEL * _PARALLEL:
        return False, d
    across = unit(across)
    return True, across if dot3(across, d) > 0.0 else scale3(across, -1.0)


@kernel
def newton_turn(table, count, d, w):
    """(whether h is convex here, the small vector to add to d): along the circle square to an edge, or free."""
    depth = dot3(d, w)
    if count == 1:
        t = cross3(unit(table.edges[EDGE].edge), d)
        slope = bend_between(table, t, t) - depth
        if slope <= 0.0:
            return False, t
        return True, scale3(t, -dot3(t, w) / slope)
    t = cross3(d, (1.0, 0.0, 0.0) if absolute(d[0]) < 0.6 else (0.0, 1.0, 0.0))
    t = unit(t)
    u = cross3(d, t)
    a = bend_between(table, t, t) - depth
    b = bend_between(table, t, u)
    c = bend_between(table, u, u) - depth
    determinant = a * c - b * b
    if a <= 0.0 or determinant <= 0.0:
        return False, t
    x = dot3(t, w)
    y = dot3(u, w)
    return True, add3(scale3(t, (b * y - c * x) / determinant), scale3(u, (b * x - a * y) / determinant))


@kernel
def span_a_face(model, table, i, j, count):
    """Whether there are two edges of a face of a hull: what they span is not that face, as it is of a box."""
    if count != 2 or table.edges[EDGE].sign != table.edges[EDGE + 1].sign:
        return False
    return model[i if table.edges[EDGE].sign > 0.0 else j].kind == HULL


@kernel
def are_parallel(table, count):
    """Whether there are two edges, which give one direction."""
    if count != 2:
        return False
    across = cross3(unit(table.edges[EDGE].edge), unit(table.edges[EDGE + 1].edge))
    return dot3(across, across) < _PARALLEL * _PARALLEL


@kernel
def meet_side_by_side(table, r):
    """`meet` of two edges that are parallel: in the middle of where they lie side by side; s is -1 if they do not."""
    e, f = table.edges[EDGE].edge, table.edges[EDGE + 1].edge
    ee = dot3(e, e)
    start, length = -dot3(r, e) / ee, dot3(e, f) / ee  # s = start - t length
    at_end = (start - 1.0) / length
    low, high = (at_end, start / length) if length > 0.0 else (start / length, at_end)
    low, high = max(low, 0.0), min(high, 1.0)
    t = 0.5 * (low + high)
    return (start - t * length if low <= high else -1.0), t


@kernel
def meet(table, count, r):
    """(s, t) so that r + s EDGE[0] + t EDGE[1] is as short as can be."""
    if count == 0:
        return 0.0, 0.0
    e = table.edges[EDGE].edge
    ee = dot3(e, e)
    if count == 1:
        return -dot3(r, e) / ee, 0.0
    # The second edge's part across the first keeps its digits where the edges are nearly parallel.
    f = table.edges[EDGE + 1].edge
    along = dot3(e, f) / ee
    across = sub3(f, scale3(e, along))
    t = -dot3(r, across) / dot3(across, across)
    return -dot3(r, e) / ee - t * along, t


@kernel
def within(t):
    return t > -_BEYOND and t < 1.0 + _BEYOND


@kernel(outline=True)
def turn(table, count, d, w):
    """(whether h is convex here, square of the angle to Newton's next direction, it).

    Compiled once, whichever round of a loop it is for: a copy of it may round otherwise.
    """
    convex, step = newton_turn(table, count, d, w)
    return convex, dot3(step, step), unit(add3(d, step))


@kernel
def is_level(table, count, size, d, w):
    """Whether h has no slope along the circle square to an edge, or any, but for rounding: Newton's method is done."""
    slope = sub3(w, scale3(d, dot3(d, w)))
    length2 = 1.0
    if count == 1:
        t = cross3(table.edges[EDGE].edge, d)
        slope, length2 = (dot3(t, w), 0.0, 0.0), dot3(t, t)
    return dot3(slope, slope) <= _LEVEL * _LEVEL * size * size * length2


@kernel
def on_grid(x):
    """The nearest multiple of 1 / _GRID."""
    return float(whole(x * _GRID + 0.5)) / _GRID


@kernel(outline=True)
def direction_on_grid(d):
    return unit((on_grid(d[0]), on_grid(d[1]), on_grid(d[2])))


@kernel(outline=True)
def polish(model, table, i, j, size, d, square):
    """From a direction d out of i - j near the best one: (whether it was found, it, depth along it, points on i and j).

    Depth is negative for shapes that are apart. Needs shapes of which one at least is curved where they meet, or an
    edge against an edge; the rest (faces) is found by GJK and EPA as quickly. Wherever Newton's method began, its last
    steps begin at the same point of a grid, and so the answer has the same bits.
    """
    p_i, p_j, count = show_both(model, table, i, j, d, square)
    if count > 2 or span_a_face(model, table, i, j, count):
        return False, d, 0.0, p_i, p_j
    shown = count
    parallel = are_parallel(table, count)
    edges = 1 if parallel else count
    known, square_d = square_to_edges(table, edges, d)
    if not known:
        return False, d, 0.0, p_i, p_j
    w = add3(sub3(p_i, p_j), bend(table, sub3(square_d, d)))
    d = square_d
    settled = edges == 2
    if settled:
        p_i, p_j, count = show_both(model, table, i, j, d, square)
        # Once more, with the ends that are shown now: signs of zeros do not depend on where it began.
        known, d = square_to_edges(table, edges, d)
        turned = sub3(d, square_d)
        known = known and dot3(turned, turned) <= _LOOSE * _LOOSE  # or other edges, whose ends may not be farthest
    again = False
    left = _STEPS
    while not settled:
        convex, angle2, d = turn(table, edges, d, w)
        left -= 1
        if left == 0 or not convex or angle2 > _FARTHEST * _FARTHEST:
            return False, d, 0.0, p_i, p_j
        begins = not again and angle2 <= _CLOSE * _CLOSE
        if begins:
            again, left = True, _LAST_STEPS
            known, d = square_to_edges(table, edges, direction_on_grid(d))
        p_i, p_j, count = show_both(model, table, i, j, d, square)
        if count != shown:
            return False, d, 0.0, p_i, p_j
        w = sub3(p_i, p_j)
        still = angle2 <= _CONVERGED * _CONVERGED
        settled = again and not begins and (still or is_level(table, edges, size, d, w))
    if not known or count != shown:
        return False, d, 0.0, p_i, p_j
    w = sub3(p_i, p_j)
    depth = dot3(d, w)
    r = sub3(w, scale3(d, depth))
    s, t = meet_side_by_side(table, r) if parallel else meet(table, edges, r)
    if not (within(s) and within(t)):
        return False, d, depth, p_i, p_j
    for k in range(shown):
        part = scale3(table.edges[EDGE + k].edge, s if k == 0 else t)
        r = add3(r, part)
        if table.edges[EDGE + k].sign > 0.0:
            p_i = add3(p_i, part)
        else:
            p_j = sub3(p_j, part)
    return dot3(r, r) <= _LOOSE * _LOOSE * size * size, d, depth, p_i, p_j


@kernel(outline=True)
def edge_over_cap(model, table, g, other, size, d):
    """`face_against` where an edge that is nearly in the plane of a cap of g, but not quite, goes over its rim.

    With e the edge, s its sine to the plane, and t square to both e and the cap's normal, the direction is square to e
    and turned by phi about it. It is so near the normal that the rim's farthest point is where (-s, phi) points to in
    the plane: r phi / sqrt(s^2 + phi^2) is how far the edge passes from the middle of the cap, q. `slope` is phi / s.
    """
    nothing = (False, d, 0.0, d, d)
    _face, n = best_face(model, table, g, d)
    p, count = show(model, table, other, scale3(n, -1.0), NARROW, 1.0, 0)
    if count != 1:
        return nothing
    e = unit(table.edges[EDGE].edge)
    s = dot3(e, n)
    radius = model[g].radius
    centre = add3(table.poses[g].p_WG, scale3(n, model[g].half_length))
    flat = sub3(e, scale3(n, s))
    upright = unit(sub3(n, scale3(e, s)))
    t = cross3(e, upright)
    out, slope = upright, 0.0
    for _ in range(2):  # the direction hardly changes where the edge passes, as seen along it
        q = dot3(cross3(e, out), sub3(p, centre))
        if not (s > 0.0 and absolute(q) < radius):
            return nothing
        slope = q / sqrt(radius * radius - q * q)
        out = unit(add3(upright, scale3(t, s * slope)))
        p, count = show(model, table, other, scale3(out, -1.0), NARROW, 1.0, 0)
        if count != 1:
            return nothing
    p_g = add3(centre, scale3(unit(sub3(scale3(t, slope), flat)), radius))
    edge = table.edges[EDGE].edge
    along = dot3(sub3(p_g, p), edge) / dot3(edge, edge)
    p = add3(p, scale3(edge, along))
    depth = dot3(out, sub3(p_g, p))
    r = sub3(sub3(p_g, p), scale3(out, depth))
    return within(along) and dot3(r, r) <= _LOOSE * _LOOSE * size * size, out, depth, p_g, p


@kernel(outline=True)
def nearby(model, table, i, j, size, out, depth):
    """From a direction near the best one, and the depth along it: (whether it was found, it, depth, points on i and j).

    Of what meets there: a face, an edge over a rim, or what `polish` finds.
    """
    shows_i, shows_j = may_show_face(model, table, i, out), may_show_face(model, table, j, out)
    limit = depth + _AS_GOOD * size
    if shows_i:
        found, d, least, a, b = face_against(model, table, i, j, out)
        if found and least <= limit:
            return True, d, least, a, b
    if shows_j:
        found, d, least, b, a = face_against(model, table, j, i, scale3(out, -1.0))
        if found and least <= limit:
            return True, scale3(d, -1.0), least, a, b
    limit = depth + _ROUNDING * size
    if shows_i and model[i].kind == CYLINDER:
        found, d, least, a, b = edge_over_cap(model, table, i, j, size, out)
        if found and least <= limit:
            return True, d, least, a, b
    if shows_j and model[j].kind == CYLINDER:
        found, d, least, b, a = edge_over_cap(model, table, j, i, size, scale3(out, -1.0))
        if found and least <= limit:
            return True, scale3(d, -1.0), least, a, b
    for square in (SQUARE, NARROW, FINE):
        if square > FINE or (model[i].kind == CYLINDER and model[j].kind == CYLINDER):
            found, d, least, a, b = polish(model, table, i, j, size, out, square)
            if found and least <= limit:
                return True, d, least, a, b
    return False, out, depth, out, out
