"""What met where two polytopes overlapped least, followed while nothing else can overlap less.

EPA has left a closed surface around the origin, whose corners are points of the difference D of the shapes, seen from
the first. When no corner has moved by more than delta, each of its triangles is at least as far as it was less delta;
the few that were nearest are placed anew, and their planes tell how far they are. If no triangle is nearer than what
met is deep, then the ball of that depth is in D: what met still is where the shapes overlap least.
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
    BOX,
    FACE,
    FACE_AND_VERTEX,
    FACE_ON_MORE,
    HULL,
    MORE_ON_FACE,
    NEAR_FACES,
    SLOT_FACES,
    SLOT_VERTICES,
    TWO_EDGES,
    VERTEX_AND_FACE,
)
from .support import best_face, vertex_in_frame
from .table import column

_CERTAIN = 1e-9  # relative to the size: depths that differ by so much differ
_FLAT = 1e299  # [m] faces without area are said to be farther
PARALLEL = 1e-8  # 1 - cosine of the angle between triangles that may be of one face


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
def sort_out_near(table, s, faces):
    """The nearest faces of the polytope into slot s, in order; the least distance of the others [m]."""
    slot, tracked = table.slots[s], table.tracks[s]
    beyond = 1e300
    count = 0
    for f in range(faces):
        face = table.polytope[FACE + f]
        if face.exists > 0.0:
            offset = distance_of(face)
            at = count
            if count < NEAR_FACES:
                count += 1
            else:
                at = NEAR_FACES - 1
                beyond = min(beyond, max(offset, tracked.near_offset[at]))
                if offset >= tracked.near_offset[at]:
                    continue
            while at > 0 and tracked.near_offset[at - 1] > offset:
                tracked.near_offset[at] = tracked.near_offset[at - 1]
                slot.near[at] = slot.near[at - 1]
                at -= 1
            tracked.near_offset[at] = offset
            slot.near[at] = f
    slot.num_near = count
    return beyond


@kernel(outline=True)
def track(model, table, i, j, s, faces, what, corners, out, depth):
    """Remembers in slot s what meets: the nearest triangle is known, and what meets there has direction and depth."""
    slot, tracked = table.slots[s], table.tracks[s]
    _what, who = kind_of_feature(table, corners)
    slot.feature, slot.who = what, who
    if what == FACE_AND_VERTEX or what == FACE_ON_MORE:
        slot.face, _normal = best_face(model, table, i, out)
    elif what == VERTEX_AND_FACE or what == MORE_ON_FACE:
        slot.face, _normal = best_face(model, table, j, scale3(out, -1.0))
    R, p = relative_pose(model, table, i, j)
    tracked.R_AB, tracked.p_AB = R, centre_from(model, j, R, p)
    tracked.out_A = rotate_back(table.poses[i].R_WG, out)
    tracked.depth = depth
    if slot.num_vertices > 0:
        tracked.beyond = sort_out_near(table, s, faces)
    else:
        slot.num_near = 0
        tracked.beyond = least_besides(table, faces, out)


@kernel
def normal_of_face(model, table, g, face):
    """Outward normal of a face, as `best_face` gives it; no face's number gives a vector of zeros."""
    R_WG = table.poses[g].R_WG
    if model[g].kind == BOX and face >= 0 and face < 6:
        axis = column(R_WG, face // 2)
        return axis if face % 2 == 1 else scale3(axis, -1.0)
    first = model[g].first_face
    if model[g].kind == HULL and face >= first and face < first + model[g].num_faces:
        return rotate(R_WG, model.faces[face].normal)
    return (0.0, 0.0, 0.0)


@kernel
def has_vertex(model, g, number):
    """Whether shape g has a vertex of this number."""
    return number >= 0 and number < (model[g].num_vertices if model[g].kind == HULL else 8)


@kernel
def moved_by(model, tracked, R, p, j):
    """How far a point of the second shape has moved in the frame of the first, at most [m]."""
    turn2 = 0.0
    for k in range(9):
        turn = R[k] - tracked.R_AB[k]
        turn2 += turn * turn
    step = sub3(centre_from(model, j, R, p), tracked.p_AB)
    return sqrt(turn2) * model[j].bound + sqrt(dot3(step, step))


@kernel
def is_there(model, table, i, j, s, v):
    """Whether slot s has a vertex v of the polytope, and the shapes those that it is made of: all may be rubbish."""
    if v < 0 or v >= SLOT_VERTICES:
        return False
    kept = table.kept_vertices[s * SLOT_VERTICES + v]
    return has_vertex(model, i, kept.a) and has_vertex(model, j, kept.b)


@kernel
def kept_corner(model, table, i, j, s, v, R, p):
    """Vertex v of the polytope in slot s, where the shapes are now, in the frame of the first."""
    kept = table.kept_vertices[s * SLOT_VERTICES + v]
    a = vertex_in_frame(model, i, kept.a)
    return sub3(a, add3(p, rotate(R, vertex_in_frame(model, j, kept.b))))


@kernel(outline=True)
def face_is_beyond(model, table, i, j, s, f, R, p, out_A, depth, slack):
    """Whether face f of the polytope in slot s is farther than `depth` by more than `slack`, or looks along `out`."""
    if f < 0 or f >= SLOT_FACES:
        return False
    x, y, z = table.kept_links[s * SLOT_FACES + f].corners
    if not (
        is_there(model, table, i, j, s, x) and is_there(model, table, i, j, s, y) and is_there(model, table, i, j, s, z)
    ):
        return False
    u = kept_corner(model, table, i, j, s, x, R, p)
    v = sub3(kept_corner(model, table, i, j, s, y, R, p), u)
    w = sub3(kept_corner(model, table, i, j, s, z, R, p), u)
    n = cross3(v, w)
    area = sqrt(dot3(n, n))
    if area <= NO_AREA * (dot3(v, v) + dot3(w, w)):
        return True
    return dot3(n, u) > (depth + slack) * area or dot3(n, out_A) >= (1.0 - PARALLEL) * area


@kernel(outline=True)
def still_meets(model, table, i, j, size, s):
    """(whether what met still does, and nothing else can overlap less, direction out of i - j, depth, points)."""
    slot, tracked = table.slots[s], table.tracks[s]
    what, who = slot.feature, slot.who
    R_WA = table.poses[i].R_WG
    out = rotate(R_WA, tracked.out_A)
    alone, depth, p_i, p_j = False, 0.0, out, out
    if what == FACE_AND_VERTEX and has_vertex(model, j, who[0]):
        out = normal_of_face(model, table, i, slot.face)
        alone, depth, p_i, p_j = vertex_under_face(model, table, i, j, who[0], out)
    elif what == VERTEX_AND_FACE and has_vertex(model, i, who[0]):
        n = normal_of_face(model, table, j, slot.face)
        alone, depth, p_j, p_i = vertex_under_face(model, table, j, i, who[0], n)
        out = scale3(n, -1.0)
    elif what == TWO_EDGES and has_vertex(model, i, max(who[0], who[1])) and has_vertex(model, j, max(who[2], who[3])):
        a, b = (who[0], who[1]), (who[2], who[3])
        alone, out, depth, p_i, p_j = edge_across_edge(model, table, i, j, a, b, out)
    elif what == FACE_ON_MORE:
        out = normal_of_face(model, table, i, slot.face)
        alone, depth, p_i, p_j = more_under_face(model, table, i, j, out, size)
    elif what == MORE_ON_FACE:
        n = normal_of_face(model, table, j, slot.face)
        alone, depth, p_j, p_i = more_under_face(model, table, j, i, n, size)
        out = scale3(n, -1.0)
    slack = _CERTAIN * size
    if not alone or not depth > slack:
        return False, out, depth, p_i, p_j
    R, p = relative_pose(model, table, i, j)
    moved = moved_by(model, tracked, R, p, j) + slack
    if not (tracked.beyond - moved > depth and moved < tracked.depth):
        return False, out, depth, p_i, p_j
    out_A = rotate_back(R_WA, out)
    for m in range(min(slot.num_near, NEAR_FACES)):
        if tracked.near_offset[m] - moved > depth:
            break
        if not face_is_beyond(model, table, i, j, s, slot.near[m], R, p, out_A, depth, slack):
            return False, out, depth, p_i, p_j
    return True, out, depth, p_i, p_j
