"""Contacts of two convex shapes of any kind: depth and normal by GJK and EPA, points by clipping the touching faces."""

from __future__ import annotations

from sheldrake.common._kernels.vec import add3, cross3, dot3, scale3, sub3
from sheldrake.common.kernel import kernel

from .half_space import cylinder_on_plane_multi
from .memory import own_slot, remembers
from .model import (
    CANDIDATE,
    CYLINDER,
    FACE_AND_VERTEX,
    FACE_ON_MORE,
    HULL,
    MAX_POINTS,
    MORE_ON_FACE,
    POLYGON_A,
    POLYGON_B,
    POLYGON_C,
    TWO_EDGES,
    VERTEX_AND_FACE,
    Z_AXIS,
)
from .separation import separation_of_pair
from .support import (
    best_face,
    corner_after,
    face_around,
    has_faces,
    height_of_face,
    is_faceted,
    normal_of_face,
    shown_face,
    shown_feature,
    side_of_face,
    within_face,
)
from .table import MIN_DEPTH, absolute, column, emit, least_depth, several_points

# 1 - cosine of 0.02 rad: a face that looks this well along the normal is what touches. The exact normal of two nearly
# parallel faces is that of two crossing edges as often as not, and a body can not rest on the one point of those.
FLAT = 2e-4
# A face touches if its deepest point is less deep than the shapes by no more than these parts together:
_SHORT = 0.01  # of the depth and of the margin
_LEVEL = 1e-9  # of the size
_FACETED = 4e-4  # of the radius of a cap, which is a polygon of 16 corners tilted by up to 0.02 rad
_ROWS = 63  # of a polygon


@kernel(outline=True)
def convex_contacts(model, table, i, j, k):
    """Contacts of shapes i and j, neither of them a half space; pair number k, -1 for a pair without memory."""
    least = least_depth(model, i, j)
    phi, nhat_ji, p_WCi, p_WCj = separation_of_pair(model, table, i, j, MIN_DEPTH - least, k)
    if -phi <= least:
        return
    if several_points(model, i, j) and touching_features(model, table, i, j, nhat_ji, -phi, slot_at(table, k)) > 0:
        return
    emit_middle(model, table, i, j, p_WCi, p_WCj, nhat_ji, -phi)


@kernel
def emit_middle(model, table, i, j, p_WCi, p_WCj, nhat_ji, depth):
    """One contact whose witnesses are half a depth from the middle of the given points, along the normal (as Drake)."""
    middle = scale3(add3(p_WCi, p_WCj), 0.5)
    half = scale3(nhat_ji, 0.5 * depth)
    emit(model, table, i, j, sub3(middle, half), add3(middle, half), nhat_ji, depth)


@kernel
def slot_at(table, k):
    """The slot that tells what meets of pair k, just sought; -1 if there is none."""
    return own_slot(table, k) if remembers(table, k) else -1


@kernel(outline=True)
def face_along(model, table, g, side, n_W, s):
    """`best_face` of the first (side 0) or second shape of a pair: what meets, in slot s, tells where to look."""
    if s >= 0 and model[g].kind == HULL:
        slot = table.slots[s]
        what, who = slot.feature, slot.who
        of_first = what == FACE_AND_VERTEX or what == FACE_ON_MORE
        if of_first or what == VERTEX_AND_FACE or what == MORE_ON_FACE:
            if of_first == (side == 0):
                return slot.face, normal_of_face(model, table, g, slot.face)
            if what == FACE_AND_VERTEX or what == VERTEX_AND_FACE:
                return face_around(model, table, g, who[0], n_W)
        if what == TWO_EDGES:
            return face_around(model, table, g, who[0] if side == 0 else who[2], n_W)
    return best_face(model, table, g, n_W)


@kernel(outline=True)
def touching_features(model, table, i, j, nhat_ji, depth, s):
    """Contacts of a face with what lies on it, or of two edges side by side; how many. Slot s tells what meets."""
    face_i, out_i, along_i = -1, nhat_ji, 0.0
    face_j, out_j, along_j = -1, nhat_ji, 0.0
    if has_faces(model, i):
        face_i, out_i = face_along(model, table, i, 0, scale3(nhat_ji, -1.0), s)
        along_i = -dot3(out_i, nhat_ji)
    if has_faces(model, j):
        face_j, out_j = face_along(model, table, j, 1, nhat_ji, s)
        along_j = dot3(out_j, nhat_ji)
    flat_i = along_i >= 1.0 - FLAT
    flat_j = along_j >= 1.0 - FLAT
    if flat_j and stands_within(model, table, j, i, face_j, out_j):
        return cap_contacts(model, table, j, i, face_j, out_j)
    if flat_i and stands_within(model, table, i, j, face_i, out_i):
        return cap_contacts(model, table, i, j, face_i, out_i)
    emitted = 0
    if flat_j:
        sides = shown_face(model, table, j, face_j, out_j, POLYGON_A)
        corners = shown_face(model, table, i, face_i, scale3(nhat_ji, -1.0), POLYGON_B)
        emitted = face_contacts(model, table, j, i, sides, corners, out_j, depth)
    if flat_i and emitted == 0:
        sides = shown_face(model, table, i, face_i, out_i, POLYGON_A)
        corners = shown_face(model, table, j, face_j, nhat_ji, POLYGON_B)
        emitted = face_contacts(model, table, i, j, sides, corners, out_i, depth)
    if flat_i or flat_j:
        return emitted
    return edge_contacts(model, table, i, j, nhat_ji, depth)


@kernel
def shortfall(model, i, j, depth):
    """By how much the deepest point of two features may be less deep than the shapes, of round-off and facets [m]."""
    short = _SHORT * (absolute(depth) + model.several_margin) + _LEVEL * (model[i].bound + model[j].bound)
    if model[i].kind == CYLINDER:
        short += _FACETED * model[i].radius
    if model[j].kind == CYLINDER:
        short += _FACETED * model[j].radius
    return short


@kernel
def deepest(table, count):
    """The deepest of the candidates, the first of equal ones."""
    best = 0
    for k in range(count):
        if table.candidates[CANDIDATE + k].depth > table.candidates[CANDIDATE + best].depth:
            best = k
    return best


@kernel
def farthest(table, count, first):
    """The candidate farthest from the first one."""
    second, far = 0, -1.0
    for k in range(count):
        r = sub3(table.candidates[CANDIDATE + k].p_W, table.candidates[CANDIDATE + first].p_W)
        if dot3(r, r) > far * (1.0 + 1e-9):
            second, far = k, dot3(r, r)
    return second


@kernel(outline=True)
def face_contacts(model, table, ref, inc, sides, corners, out, depth):
    """Contacts of what `inc` shows with the face of `ref`; how many, 0 if none is as deep as the shapes.

    Polygons are where `face_candidates` has them.
    The deepest point of a slender hull may belong to another face than the one that looks along the normal most.
    """
    count = face_candidates(model, table, ref, inc, sides, corners, out)
    if count == 0 or table.candidates[CANDIDATE + deepest(table, count)].depth < depth - shortfall(
        model, ref, inc, depth
    ):
        return 0
    return emit_four(model, table, inc, ref, out, count)


@kernel(outline=True)
def stands_within(model, table, ref, inc, face, out):
    """Whether `inc` is a cylinder whose whole cap is on a face of `ref`, so that it stands as on a plane."""
    if model[inc].kind != CYLINDER:
        return False
    axis = column(table.poses[inc].R_WG, Z_AXIS)
    c = dot3(axis, out)
    if absolute(c) < 1.0 - FLAT:
        return False
    half_length = model[inc].half_length
    centre = add3(table.poses[inc].p_WG, scale3(axis, -half_length if c > 0.0 else half_length))
    return within_face(model, table, ref, face, out, centre, model[inc].radius)


@kernel(outline=True)
def cap_contacts(model, table, ref, inc, face, out):
    """Contacts of a cap that stands within a face of `ref`; how many."""
    before = table.num_contacts
    height = dot3(out, table.poses[inc].p_WG) - height_of_face(model, table, ref, face, out)
    cylinder_on_plane_multi(model, table, inc, ref, out, height)
    return table.num_contacts - before


@kernel
def circle_around(table, corners):
    """Middle of the corners in POLYGON_B, and the square of a radius about it that holds all of them."""
    middle = (0.0, 0.0, 0.0)
    for k in range(corners):
        middle = add3(middle, table.corners[POLYGON_B + k].p_W)
    middle = scale3(middle, 1.0 / corners)
    most = 0.0
    for k in range(corners):
        r = sub3(table.corners[POLYGON_B + k].p_W, middle)
        most = max(most, dot3(r, r))
    return middle, most * (1.0 + _LEVEL)


@kernel
def is_behind(table, row, a, outward):
    """Whether a corner is not in front of the plane through a."""
    return dot3(outward, sub3(table.corners[row].p_W, a)) <= 0.0


@kernel(outline=True)
def face_candidates(model, table, ref, inc, sides, corners, out):
    """Points of what `inc` shows, within and below the face of `ref` with outward normal out; how many.

    So many corners of the face of `ref` are in POLYGON_A, and of what `inc` shows in POLYGON_B.
    """
    middle, reach2 = circle_around(table, corners)
    source = POLYGON_B
    for k in range(sides):
        a, outward = side_of_face(table, k, sides, out)
        if corners == 2:
            if is_behind(table, source, a, outward) and is_behind(table, source + 1, a, outward):
                continue
        else:
            height = dot3(outward, sub3(middle, a))
            if height < 0.0 and height * height >= reach2 * dot3(outward, outward):
                continue  # all corners are behind the side
        target = POLYGON_C if source == POLYGON_B else POLYGON_B
        corners = clip(table, source, corners, target, a, outward)
        source = target
    base = table.corners[POLYGON_A].p_W
    count = 0
    least = least_depth(model, ref, inc)
    for k in range(corners):
        x = table.corners[source + k].p_W
        depth = dot3(out, sub3(base, x))
        if depth > least:
            table.candidates[CANDIDATE + count].both = (x, depth)
            count += 1
    return count


@kernel(outline=True)
def clip(table, source, corners, target, a, outward):
    """The part of a polygon, segment or point behind the plane through a; the number of its corners."""
    slack = 1e-12 * (absolute(outward[0]) + absolute(outward[1]) + absolute(outward[2]))
    kept = 0
    p = table.corners[source].p_W
    height_p = dot3(outward, sub3(p, a))
    for k in range(corners):
        if height_p <= slack and kept < _ROWS:
            table.corners[target + kept].p_W = p
            kept += 1
        q = table.corners[source + corner_after(k, corners)].p_W
        height_q = dot3(outward, sub3(q, a))
        if k + 1 < corners or corners > 2:
            if (height_p > slack and height_q < -slack) or (height_p < -slack and height_q > slack):
                t = height_p / (height_p - height_q)
                if kept < _ROWS:
                    table.corners[target + kept].p_W = add3(p, scale3(sub3(q, p), t))
                    kept += 1
        p, height_p = q, height_q
    return kept


@kernel(outline=True)
def emit_four(model, table, i, j, nhat_ji, count):
    """At most four of the candidates (points of i below a face of j), six if one is a cap.

    A flat contact: the two farthest apart and the farthest on either side of their line, whatever the depths, so that
    a small tilt changes nothing. A steep one: the deepest instead of the first of them.
    """
    caps = model[i].kind == CYLINDER or model[j].kind == CYLINDER
    if count <= (MAX_POINTS if caps else 4):
        for k in range(count):
            emit_candidate(model, table, i, j, nhat_ji, k)
        return count
    first, second, far = 0, 0, -1.0
    least = 1e300
    for k in range(count):
        p, depth = table.candidates[CANDIDATE + k].both
        least = min(least, depth)
        for e in range(k):
            r = sub3(p, table.candidates[CANDIDATE + e].p_W)
            if dot3(r, r) > far * (1.0 + 1e-9):
                first, second, far = e, k, dot3(r, r)
    steep = deepest(table, count)
    if least < 0.5 * table.candidates[CANDIDATE + steep].depth - model.several_margin:
        first, second = steep, farthest(table, count, steep)
    p = table.candidates[CANDIDATE + first].p_W
    across = cross3(nhat_ji, sub3(table.candidates[CANDIDATE + second].p_W, p))
    left, most = first, 0.0
    right, fewest = first, 0.0
    for k in range(count):
        side = dot3(across, sub3(table.candidates[CANDIDATE + k].p_W, p))
        if side > most * (1.0 + 1e-9):
            left, most = k, side
        if side < fewest * (1.0 + 1e-9):
            right, fewest = k, side
    emitted = 0
    for k in range(count):
        if k == first or k == second or k == left or k == right:
            emit_candidate(model, table, i, j, nhat_ji, k)
            emitted += 1
    return emitted


@kernel
def emit_candidate(model, table, i, j, nhat_ji, k):
    x, depth = table.candidates[CANDIDATE + k].both
    emit(model, table, i, j, x, add3(x, scale3(nhat_ji, depth)), nhat_ji, depth)


@kernel(outline=True)
def edge_contacts(model, table, i, j, nhat_ji, depth):
    """Two points of two edges (cylinder sides, capsules) that overlap side by side, as deep as the shapes; else 0.

    Capsules that touch end to end, or an end on a side, show lines that lie apart; boxes and hulls show faces.
    """
    if is_faceted(model, i) or is_faceted(model, j):
        return 0
    if shown_feature(model, table, i, scale3(nhat_ji, -1.0), POLYGON_A) != 2:
        return 0
    if shown_feature(model, table, j, nhat_ji, POLYGON_B) != 2:
        return 0
    a = table.corners[POLYGON_A].p_W
    b = table.corners[POLYGON_B].p_W
    u = sub3(table.corners[POLYGON_A + 1].p_W, a)
    v = sub3(table.corners[POLYGON_B + 1].p_W, b)
    uu = dot3(u, u)
    uv = dot3(u, v)
    if uv * uv < 0.9998 * uu * dot3(v, v):
        return 0
    start = dot3(sub3(b, a), u) / uu
    end = start + uv / uu
    low, high = (start, end) if start < end else (end, start)
    low, high = max(low, 0.0), min(high, 1.0)
    if high <= low:
        return 0
    count = 0
    least = least_depth(model, i, j)
    most = -1e300
    for k in range(2):
        t = low if k == 0 else high
        p_i = add3(a, scale3(u, t))
        p_j = add3(b, scale3(v, (t - start) * uu / uv))
        depth_k = dot3(nhat_ji, sub3(p_j, p_i))
        most = max(most, depth_k)
        if depth_k > least:
            count += 1
            table.candidates[CANDIDATE + k].both = (p_i, depth_k)
    if count == 2 and most >= depth - shortfall(model, i, j, depth):
        for k in range(2):
            emit_candidate(model, table, i, j, nhat_ji, k)
        return 2
    return 0
