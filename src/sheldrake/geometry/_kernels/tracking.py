"""What met where two shapes overlapped least, or were nearest, followed while nothing else can.

EPA has left a closed surface around the origin, whose corners are points of the difference D of the shapes, seen from
the first. When no corner has moved by more than delta, each of its triangles is at least as far as it was less delta;
where that does not say enough, a triangle is placed anew, and its plane tells how far it is. If no triangle is nearer
than what met is deep, then the ball of that depth is in D: what met still is where the shapes overlap least. Motions
are added up from step to step: a triangle that was placed anew is left alone until they have used up its distance.

Shallow overlaps, which change with every step, need no such surface: what met is a facet of D, and if the pyramid from
it to the farthest point behind holds the ball, D does. Of shapes that are apart the two points tell: they are as far
from each other as the planes through them.
"""

from __future__ import annotations

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common._kernels.vec import (
    add3,
    compose,
    cross3,
    dot3,
    rotate,
    rotate_back,
    scale3,
    sub3,
    transpose,
)
from sheldrake.common.kernel import kernel

from .epa import NO_AREA
from .feature import edge_across_edge, kind_of_feature, more_under_face, vertex_under_face
from .model import (
    BY_DIRECTION,
    FACE,
    FACE_AND_VERTEX,
    FACE_ON_MORE,
    HULL,
    MORE_ON_FACE,
    NO_FEATURE,
    POLYGON_A,
    SIMPLEX,
    SLOT_FACES,
    SLOT_VERTICES,
    TWO_EDGES,
    VERTEX_AND_FACE,
)
from .polish import nearby, unit
from .support import best_face, core_vertex, corner_after, is_face, normal_of_face, shown_face, support, within_polygon

_CERTAIN = 1e-9  # relative to the size: depths that differ by so much differ
_FLAT = 1e299  # [m] faces without area are said to be farther
PARALLEL = 1e-8  # 1 - cosine of the angle between triangles that may be of one face
_TURN = 0.05  # a direction that turns by more has not turned but is another [rad]
ALIKE = 1e-3  # the same of triangles inside of one curved surface
_SAGITTA = 1e-4  # relative to the size: how far they may be inside of it
_CLEAR = 1e-6  # relative to the size: shapes that are apart by less may be so along another direction
_BEYOND = 1e-9  # relative to the size: how far beside a feature a point of it may be
_PLANE = 1e-11  # relative to the size: how far below its plane a corner of a face may be


@kernel
def relative_pose(model, table, i, j):
    """Rotation and origin of j in the frame of i."""
    R_WA = table.poses[i].R_WG
    R = compose(transpose(R_WA), table.poses[j].R_WG)
    return R, rotate_back(R_WA, sub3(table.poses[j].p_WG, table.poses[i].p_WG))


@kernel
def centre_from(model, j, R, p):
    """Centre of the bounding sphere of j."""
    return add3(p, rotate(R, model[j].centre_G))


@kernel
def equal4(a, b):
    return a[0] == b[0] and a[1] == b[1] and a[2] == b[2] and a[3] == b[3]


@kernel
def distance_of(face):
    """Of a face of the polytope; 0 of one without area, which may be wherever its neighbours are."""
    return face.offset if face.offset < _FLAT else 0.0


@kernel
def least_besides(table, faces, out):
    """The least distance of the polytope's faces that do not look along `out`."""
    least = 1e300
    for f in range(faces):
        face = table.polytope[FACE + f]
        if face.exists > 0.0 and dot3(face.normal, out) < 1.0 - PARALLEL:
            least = min(least, distance_of(face))
    return least


@kernel(outline=True)
def is_of_feature(table, s, f, out, lowest):
    """Whether face f of the polytope is a part of what slot s says meets, wherever the shapes are: as deep as that.

    Corners of a face of a shape, less one vertex of the other, are all in its plane; two edges span a parallelogram.
    """
    for k in range(3):
        if dot3(out, table.vertices[SIMPLEX + table.links[f].corner[k]].w) < lowest:
            return False
    slot = table.slots[s]
    what, who = kind_of_feature(table, table.links[f].corners)
    return what != NO_FEATURE and what == slot.feature and equal4(who, slot.who)


@kernel(outline=True)
def measure_faces(table, s, faces, out, lowest):
    """Levels of the faces of the polytope, as it is kept, in slot s; those of what meets are as far as can be.

    Corners that reach as far as `lowest` along `out` are in the plane of what meets.
    """
    number = 0
    for f in range(faces):
        face = table.polytope[FACE + f]
        if face.exists > 0.0 and number < SLOT_FACES:
            found = is_of_feature(table, s, f, out, lowest)
            table.tracks[s].level[number] = _FLAT if found else distance_of(face)
            number += 1


@kernel
def side_with_face(what):
    """Which shape has the face that meets, the first (0) or the second; -1 if none has."""
    if what == FACE_AND_VERTEX or what == FACE_ON_MORE:
        return 0
    return 1 if what == VERTEX_AND_FACE or what == MORE_ON_FACE else -1


@kernel
def face_that_meets(model, table, i, j, what, out):
    """Its number; -1 if no face does."""
    side, face = side_with_face(what), -1
    if side == 0:
        face, _normal = best_face(model, table, i, out)
    elif side == 1:
        face, _normal = best_face(model, table, j, scale3(out, -1.0))
    return face


@kernel(outline=True)
def track(model, table, i, j, s, faces, what, corners, out, depth):
    """Remembers in slot s what meets: the nearest triangle is known, and what meets there has direction and depth."""
    slot, tracked = table.slots[s], table.tracks[s]
    _what, who = kind_of_feature(table, corners)
    known = slot.feature == BY_DIRECTION and what == BY_DIRECTION
    slot.feature, slot.who = what, who
    slot.face = face_that_meets(model, table, i, j, what, out)
    R, p = relative_pose(model, table, i, j)
    tracked.R_AB, tracked.p_AB = R, centre_from(model, j, R, p)
    out_A = rotate_back(table.poses[i].R_WG, out)
    turn = sub3(out_A, tracked.out_A)
    tracked.turn_A = turn if known and dot3(turn, turn) < _TURN * _TURN else (0.0, 0.0, 0.0)
    tracked.out_A = out_A
    tracked.least, tracked.path = depth, 0.0
    if slot.num_vertices > 0:
        measure_faces(table, s, faces, out, depth - _PLANE * (model[i].bound + model[j].bound))
    else:
        tracked.beyond = least_besides(table, faces, out)


@kernel
def has_vertex(model, g, number):
    """Whether shape g has a vertex of this number."""
    return number >= 0 and number < (model[g].num_vertices if model[g].kind == HULL else 8)


@kernel
def moved_by(model, then, R, p, j):
    """How far a point of the second shape has moved in the frame of the first, at most [m].

    The difference of two rotations has two singular values that are equal, and none else.
    """
    turn2 = 0.0
    for k in range(9):
        turn = R[k] - then.R_AB[k]
        turn2 += turn * turn
    step = sub3(centre_from(model, j, R, p), then.p_AB)
    return sqrt(0.5 * turn2) * model[j].bound + sqrt(dot3(step, step))


@kernel
def is_there(v):
    """Whether there may be a vertex v of a polytope in a slot."""
    return v >= 0 and v < SLOT_VERTICES


@kernel
def kept_corner(table, s, v, R, p):
    """Vertex v of the polytope in slot s, where the shapes are now, in the frame of the first."""
    points = table.kept_points[s * SLOT_VERTICES + v]
    return sub3(points.p_AP, add3(p, rotate(R, points.p_BP)))


@kernel
def stays_alike(u, v, b_u, b_v, area, cosine, alike, bound):
    """How far a point of the second shape may go before a face is no longer alike [m].

    The face has the edges u and v, of which b_u and b_v are the second shape's, and with `out` the angle of this
    cosine. A rotation by c, of the second shape or of `out`, takes the edges along by c times their parts.
    """
    length_u, length_v = sqrt(dot3(u, u)), sqrt(dot3(v, v))
    part_u, part_v = sqrt(dot3(b_u, b_u)), sqrt(dot3(b_v, b_v))
    parts = part_u * length_v + length_u * part_v + part_u * part_v
    left = sqrt(2.0 * alike) - sqrt(2.0 * max(1.0 - cosine, 0.0))
    return bound * left / (1.0 + 2.0 * parts / area)


@kernel(outline=True)
def distance_now(table, s, f, R, p, out_A, least, alike, bound):
    """(distance of face f of the polytope in slot s, where the shapes are now, for how far it is alike [m]).

    The distance is -1.0 if there is no such face. One that may be of what meets, as it looks along `out` (1 - cosine is
    no more than `alike`) and is no nearer than `least`, is as far as can be, as is one without area. The bounding
    sphere of the second shape has the radius `bound`.
    """
    x, y, z = table.kept_links[s * SLOT_FACES + f].corners
    if not (is_there(x) and is_there(y) and is_there(z)):
        return -1.0, 0.0
    corner = kept_corner(table, s, x, R, p)
    u = sub3(kept_corner(table, s, y, R, p), corner)
    v = sub3(kept_corner(table, s, z, R, p), corner)
    n = cross3(u, v)
    area = sqrt(dot3(n, n))
    if area <= NO_AREA * (dot3(u, u) + dot3(v, v)):
        return _FLAT, 0.0
    height, along = dot3(n, corner), dot3(n, out_A)
    if height >= least * area and along >= (1.0 - alike) * area:
        b = table.kept_points[s * SLOT_VERTICES + x].p_BP
        b_u = sub3(table.kept_points[s * SLOT_VERTICES + y].p_BP, b)
        b_v = sub3(table.kept_points[s * SLOT_VERTICES + z].p_BP, b)
        return _FLAT, stays_alike(u, v, b_u, b_v, area, along / area, alike, bound)
    return height / area, 0.0


@kernel
def is_due(tracked, f, path, depth):
    """Whether face f may have come so near, or may have ceased to be alike, since it was placed."""
    level = tracked.level[f]
    return level - path <= depth if level >= 0.0 else level + path >= 0.0


@kernel(outline=True)
def others_are_beyond(table, s, path, R, p, out_A, depth, slack, alike, sagitta, bound):
    """Whether all faces of the polytope are farther than `depth` by more than `slack`, or of what meets.

    Each is placed anew if the path since that was done last may have brought it so near. A face inside of a curved
    surface that was alike, and as near as what meets, is so while it looks there, as nothing of the surface is nearer:
    its level is the path that ends this, negative. Faces of polytopes may be alike by chance: `bound` is 0 then.
    """
    tracked = table.tracks[s]
    for f in range(min(table.slots[s].num_faces, SLOT_FACES)):
        if is_due(tracked, f, path, depth + slack):
            distance, lasts = distance_now(table, s, f, R, p, out_A, depth - sagitta, alike, bound)
            if distance <= depth + slack:
                return False
            if distance < _FLAT:
                tracked.level[f] = path + distance
            elif lasts > 0.0:
                tracked.level[f] = -(path + lasts)
    return True


# ---- shapes that overlap little, or not quite


@kernel
def ball_is_within(table, sides, centre, radius, apex):
    """Whether a ball under the polygon in POLYGON_A is in the pyramid from there to `apex`, but for the polygon."""
    for k in range(sides):
        c = table.corners[POLYGON_A + k].p_W
        inward = cross3(sub3(table.corners[POLYGON_A + corner_after(k, sides)].p_W, c), sub3(apex, c))
        height = dot3(inward, sub3(centre, c))
        if height <= 0.0 or height * height <= radius * radius * dot3(inward, inward):
            return False
    return sides > 2


@kernel(outline=True)
def face_holds_ball(model, table, g, other, face, n, p, depth, size):
    """Whether face and lowest vertex p of `other`, so deep below, are where the shapes overlap least."""
    sides = shown_face(model, table, g, face, n, POLYGON_A)
    for k in range(sides):
        if dot3(n, sub3(table.corners[POLYGON_A + k].p_W, p)) < depth - _PLANE * size:
            return False
    apex = add3(p, sub3(support(model, table, g, scale3(n, -1.0)), support(model, table, other, n)))
    return ball_is_within(table, sides, p, depth + _CERTAIN * size, apex)


@kernel(outline=True)
def edges_hold_ball(model, table, i, j, a, b, out, depth, size):
    """The same of two edges, which give a parallelogram of the difference."""
    p, q = core_vertex(model, table, i, a[0]), core_vertex(model, table, j, b[0])
    e, f = sub3(core_vertex(model, table, i, a[1]), p), sub3(q, core_vertex(model, table, j, b[1]))
    if dot3(cross3(e, f), out) < 0.0:
        e, f = f, e
    c = sub3(p, q)
    table.corners[POLYGON_A].p_W = c
    table.corners[POLYGON_A + 1].p_W = add3(c, e)
    table.corners[POLYGON_A + 2].p_W = add3(c, add3(e, f))
    table.corners[POLYGON_A + 3].p_W = add3(c, f)
    apex = sub3(support(model, table, i, scale3(out, -1.0)), support(model, table, j, out))
    return ball_is_within(table, 4, (0.0, 0.0, 0.0), depth + _CERTAIN * size, apex)


@kernel
def facet_holds_ball(model, table, i, j, size, s, out, depth, p_i, p_j):
    """Whether the facet of the difference that slot s tells of shows by itself that nothing overlaps less."""
    slot = table.slots[s]
    who = slot.who
    side = side_with_face(slot.feature)
    if side == 0:
        return face_holds_ball(model, table, i, j, slot.face, out, p_j, depth, size)
    if side == 1:
        return face_holds_ball(model, table, j, i, slot.face, scale3(out, -1.0), p_i, depth, size)
    if slot.feature == TWO_EDGES:
        return edges_hold_ball(model, table, i, j, (who[0], who[1]), (who[2], who[3]), out, depth, size)
    return False


@kernel(outline=True)
def is_over_face(model, table, g, face, n, x, margin):
    """Whether x is over a face of a number, with normal n, or no farther beside it than `margin` [m]."""
    return within_polygon(table, shown_face(model, table, g, face, n, POLYGON_A), n, x, -margin)


@kernel
def are_nearest(model, table, i, j, size, what, face, out, depth, p_i, p_j):
    """Whether p_i and p_j, where something meets that has a face of this number or none, are nearest to each other.

    Where edges cross within their ends they are. Points beside the feature by s are too far apart by s^2 / 2 phi.
    """
    if not -depth > _CLEAR * size:
        return False
    side, margin = side_with_face(what), _BEYOND * size
    if side == 0:
        return is_over_face(model, table, i, face, out, p_i, margin)
    if side == 1:
        return is_over_face(model, table, j, face, scale3(out, -1.0), p_j, margin)
    return what == TWO_EDGES


# ---- from one search to the next


@kernel(outline=True)
def surface_is_beyond(model, table, i, j, size, s, out, depth):
    """Whether no other face of the polytope in slot s can be as near as what meets is deep."""
    tracked = table.tracks[s]
    slack = _CERTAIN * size
    R, p = relative_pose(model, table, i, j)
    moved = moved_by(model, tracked, R, p, j) + slack
    if moved >= tracked.least:
        return False
    if table.slots[s].num_vertices == 0:
        return tracked.beyond - moved > depth
    curved = table.slots[s].feature == BY_DIRECTION
    out_A = rotate_back(table.poses[i].R_WG, out)
    turn = sub3(out_A, tracked.out_A)
    alike, sagitta, bound = (ALIKE, _SAGITTA * size, model[j].bound) if curved else (PARALLEL, slack, 0.0)
    path = tracked.path + moved + bound * sqrt(dot3(turn, turn))
    beyond = others_are_beyond(table, s, path, R, p, out_A, depth, slack, alike, sagitta, bound)
    tracked.R_AB, tracked.p_AB, tracked.path = R, centre_from(model, j, R, p), path
    tracked.least = depth - sagitta if beyond else tracked.least - moved
    return beyond


@kernel(outline=True)
def still_meets(model, table, i, j, size, s):
    """(whether what met still does, and nothing else can overlap less or be nearer, direction out of i - j, ...).

    The rest is the depth along it, negative for shapes that are apart, and the points on i and j.
    """
    slot, tracked = table.slots[s], table.tracks[s]
    what, who = slot.feature, slot.who
    R_WA = table.poses[i].R_WG
    out = rotate(R_WA, tracked.out_A)
    alone, depth, p_i, p_j = False, 0.0, out, out
    if what == FACE_AND_VERTEX and has_vertex(model, j, who[0]):
        out = normal_of_face(model, table, i, slot.face)
        alone, depth, p_i, p_j = vertex_under_face(model, table, i, slot.face, j, who[0], out)
    elif what == VERTEX_AND_FACE and has_vertex(model, i, who[0]):
        n = normal_of_face(model, table, j, slot.face)
        alone, depth, p_j, p_i = vertex_under_face(model, table, j, slot.face, i, who[0], n)
        out = scale3(n, -1.0)
    elif what == TWO_EDGES and has_vertex(model, i, max(who[0], who[1])) and has_vertex(model, j, max(who[2], who[3])):
        a, b = (who[0], who[1]), (who[2], who[3])
        alone, out, depth, p_i, p_j = edge_across_edge(model, table, i, j, a, b, out)
    elif what == FACE_ON_MORE and is_face(model, i, slot.face):
        out = normal_of_face(model, table, i, slot.face)
        alone, depth, p_i, p_j = more_under_face(model, table, i, slot.face, j, out, size)
    elif what == MORE_ON_FACE and is_face(model, j, slot.face):
        n = normal_of_face(model, table, j, slot.face)
        alone, depth, p_j, p_i = more_under_face(model, table, j, slot.face, i, n, size)
        out = scale3(n, -1.0)
    elif what == BY_DIRECTION:
        out = rotate(R_WA, unit(add3(tracked.out_A, tracked.turn_A)))
        before = dot3(out, sub3(support(model, table, i, out), support(model, table, j, scale3(out, -1.0))))
        alone, out, depth, p_i, p_j = nearby(model, table, i, j, size, out, before)
    if not alone:
        return False, out, depth, p_i, p_j
    if depth <= _CERTAIN * size:
        return are_nearest(model, table, i, j, size, what, slot.face, out, depth, p_i, p_j), out, depth, p_i, p_j
    if not surface_is_beyond(model, table, i, j, size, s, out, depth):
        return facet_holds_ball(model, table, i, j, size, s, out, depth, p_i, p_j), out, depth, p_i, p_j
    if what == BY_DIRECTION:
        out_A = rotate_back(R_WA, out)
        tracked.turn_A = sub3(out_A, tracked.out_A)
        tracked.out_A = out_A
    return True, out, depth, p_i, p_j
