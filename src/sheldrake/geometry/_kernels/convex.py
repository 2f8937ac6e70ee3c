"""Contacts of two convex shapes of any kind: depth and normal by GJK and EPA, points by clipping the touching faces."""

from __future__ import annotations

from sheldrake.common._kernels.vec import add3, cross3, dot3, load3, scale3, store3, sub3
from sheldrake.common.kernel import kernel

from .half_space import cylinder_on_plane_multi
from .model import (
    BOUND,
    CANDIDATE,
    CYLINDER,
    HALF_LENGTH,
    KIND,
    MAX_POINTS,
    MULTI_POINT,
    POLYGON_A,
    POLYGON_B,
    POLYGON_C,
    RADIUS,
    SEVERAL,
    Z_AXIS,
)
from .separation import separation
from .support import best_face, has_faces, shown_feature, within_face
from .table import MIN_DEPTH, absolute, column, emit, least_depth, position_of, rotation_of

# 1 - cosine of 0.02 rad: a face that looks this well along the normal is what touches. The exact normal of two nearly
# parallel faces is that of two crossing edges as often as not, and a body can not rest on the one point of those.
FLAT = 2e-4
# A face touches if its deepest point is less deep than the shapes by no more than these parts together:
_SHORT = 0.01  # of the depth and of the margin
_LEVEL = 1e-9  # of the size
_FACETED = 4e-4  # of the radius of a cap, which is a polygon of 16 corners tilted by up to 0.02 rad
_ROWS = 63  # of a polygon


@kernel(outline=True)
def convex_contacts(model, table, i, j):
    """Contacts of shapes i and j, neither of them a half space."""
    least = least_depth(model, i, j)
    phi, nhat_ji, p_WCi, p_WCj = separation(model, table, i, j, MIN_DEPTH - least)
    if -phi <= least:
        return
    if model.geometry[i, MULTI_POINT] + model.geometry[j, MULTI_POINT] == 2:
        if touching_features(model, table, i, j, nhat_ji, -phi) > 0:
            return
    emit_middle(model, table, i, j, p_WCi, p_WCj, nhat_ji, -phi)


@kernel
def emit_middle(model, table, i, j, p_WCi, p_WCj, nhat_ji, depth):
    """One contact whose witnesses are half a depth from the middle of the given points, along the normal (as Drake)."""
    middle = scale3(add3(p_WCi, p_WCj), 0.5)
    half = scale3(nhat_ji, 0.5 * depth)
    emit(model, table, i, j, sub3(middle, half), add3(middle, half), nhat_ji, depth)


@kernel(outline=True)
def touching_features(model, table, i, j, nhat_ji, depth):
    """Contacts of a face with what lies on it, or of two edges side by side; how many."""
    along_i = 0.0
    along_j = 0.0
    out_i = nhat_ji
    out_j = nhat_ji
    if has_faces(model, i):
        _face, out_i = best_face(model, table, i, scale3(nhat_ji, -1.0))
        along_i = -dot3(out_i, nhat_ji)
    if has_faces(model, j):
        _face, out_j = best_face(model, table, j, nhat_ji)
        along_j = dot3(out_j, nhat_ji)
    flat_i = along_i >= 1.0 - FLAT
    flat_j = along_j >= 1.0 - FLAT
    if flat_j and stands_within(model, table, j, i, out_j):
        return cap_contacts(model, table, j, i, out_j)
    if flat_i and stands_within(model, table, i, j, out_i):
        return cap_contacts(model, table, i, j, out_i)
    emitted = 0
    if flat_j:
        emitted = face_contacts(model, table, j, i, out_j, nhat_ji, depth)
    if flat_i and emitted == 0:
        emitted = face_contacts(model, table, i, j, out_i, scale3(nhat_ji, -1.0), depth)
    if flat_i or flat_j:
        return emitted
    return edge_contacts(model, table, i, j, nhat_ji, depth)


@kernel
def shortfall(model, i, j, depth):
    """By how much the deepest point of two features may be less deep than the shapes, of round-off and facets [m]."""
    short = _SHORT * (absolute(depth) + model.margin[SEVERAL]) + _LEVEL * (model.size[i, BOUND] + model.size[j, BOUND])
    if model.geometry[i, KIND] == CYLINDER:
        short += _FACETED * model.size[i, RADIUS]
    if model.geometry[j, KIND] == CYLINDER:
        short += _FACETED * model.size[j, RADIUS]
    return short


@kernel(outline=True)
def face_contacts(model, table, ref, inc, out, nhat, depth):
    """Contacts of what `inc` shows along -nhat with the face of `ref`; how many, 0 if none is as deep as the shapes.

    The deepest point of a slender hull may belong to another face than the one that looks along the normal most.
    """
    count = face_candidates(model, table, ref, inc, out, nhat)
    deepest = -1e300
    for k in range(count):
        if table.work[CANDIDATE + k, 3] > deepest:
            deepest = table.work[CANDIDATE + k, 3]
    if deepest < depth - shortfall(model, ref, inc, depth):
        return 0
    return emit_four(model, table, inc, ref, out, count)


@kernel(outline=True)
def stands_within(model, table, ref, inc, out):
    """Whether `inc` is a cylinder whose whole cap is on the face of `ref`, so that it stands as on a plane."""
    if model.geometry[inc, KIND] != CYLINDER:
        return False
    axis = column(rotation_of(table, inc), Z_AXIS)
    c = dot3(axis, out)
    if absolute(c) < 1.0 - FLAT:
        return False
    radius = model.size[inc, RADIUS]
    half_length = model.size[inc, HALF_LENGTH]
    centre = add3(position_of(table, inc), scale3(axis, -half_length if c > 0.0 else half_length))
    return within_face(model, table, ref, out, centre, radius)


@kernel(outline=True)
def cap_contacts(model, table, ref, inc, out):
    """Contacts of a cap that stands within a face of `ref`, which is in POLYGON_A; how many."""
    before = table.count[0]
    height = dot3(out, sub3(position_of(table, inc), load3(table.work, POLYGON_A)))
    cylinder_on_plane_multi(model, table, inc, ref, out, height)
    return table.count[0] - before


@kernel(outline=True)
def face_candidates(model, table, ref, inc, out, nhat):
    """Points of what `inc` shows along -nhat, within and below the face of `ref` with outward normal out; how many."""
    sides = shown_feature(model, table, ref, out, POLYGON_A)
    corners = shown_feature(model, table, inc, scale3(nhat, -1.0), POLYGON_B)
    source = POLYGON_B
    for k in range(sides):
        target = POLYGON_C if source == POLYGON_B else POLYGON_B
        a = load3(table.work, POLYGON_A + k)
        b = load3(table.work, POLYGON_A + (k + 1) % sides)
        corners = clip(table, source, corners, target, a, cross3(sub3(b, a), out))
        source = target
    base = load3(table.work, POLYGON_A)
    count = 0
    least = least_depth(model, ref, inc)
    for k in range(corners):
        x = load3(table.work, source + k)
        depth = dot3(out, sub3(base, x))
        if depth > least:
            store3(table.work, CANDIDATE + count, x)
            table.work[CANDIDATE + count, 3] = depth
            count += 1
    return count


@kernel(outline=True)
def clip(table, source, corners, target, a, outward):
    """The part of a polygon, segment or point behind the plane through a; the number of its corners."""
    slack = 1e-12 * (absolute(outward[0]) + absolute(outward[1]) + absolute(outward[2]))
    kept = 0
    for k in range(corners):
        p = load3(table.work, source + k)
        height_p = dot3(outward, sub3(p, a))
        if height_p <= slack and kept < _ROWS:
            store3(table.work, target + kept, p)
            kept += 1
        if k + 1 < corners or corners > 2:
            q = load3(table.work, source + (k + 1) % corners)
            height_q = dot3(outward, sub3(q, a))
            if (height_p > slack and height_q < -slack) or (height_p < -slack and height_q > slack):
                t = height_p / (height_p - height_q)
                if kept < _ROWS:
                    store3(table.work, target + kept, add3(p, scale3(sub3(q, p), t)))
                    kept += 1
    return kept


@kernel(outline=True)
def emit_four(model, table, i, j, nhat_ji, count):
    """At most four of the candidates (points of i below a face of j), six if one is a cap.

    A flat contact: the two farthest apart and the farthest on either side of their line, whatever the depths, so that
    a small tilt changes nothing. A steep one: the deepest instead of the first of them.
    """
    caps = model.geometry[i, KIND] == CYLINDER or model.geometry[j, KIND] == CYLINDER
    if count <= (MAX_POINTS if caps else 4):
        for k in range(count):
            emit_candidate(model, table, i, j, nhat_ji, k)
        return count
    deepest = 0
    for k in range(count):
        if table.work[CANDIDATE + k, 3] > table.work[CANDIDATE + deepest, 3]:
            deepest = k
    first = 0
    second = 0
    far = -1.0
    least = 1e300
    for k in range(count):
        p = load3(table.work, CANDIDATE + k)
        if table.work[CANDIDATE + k, 3] < least:
            least = table.work[CANDIDATE + k, 3]
        for e in range(k):
            r = sub3(p, load3(table.work, CANDIDATE + e))
            if dot3(r, r) > far * (1.0 + 1e-9):
                far = dot3(r, r)
                first = e
                second = k
    if least < 0.5 * table.work[CANDIDATE + deepest, 3] - model.margin[SEVERAL]:
        first = deepest
        far = -1.0
        for k in range(count):
            r = sub3(load3(table.work, CANDIDATE + k), load3(table.work, CANDIDATE + first))
            if dot3(r, r) > far * (1.0 + 1e-9):
                far = dot3(r, r)
                second = k
    p = load3(table.work, CANDIDATE + first)
    across = cross3(nhat_ji, sub3(load3(table.work, CANDIDATE + second), p))
    left = first
    right = first
    most = 0.0
    fewest = 0.0
    for k in range(count):
        side = dot3(across, sub3(load3(table.work, CANDIDATE + k), p))
        if side > most * (1.0 + 1e-9):
            most = side
            left = k
        if side < fewest * (1.0 + 1e-9):
            fewest = side
            right = k
    emitted = 0
    for k in range(count):
        if k == first or k == second or k == left or k == right:
            emit_candidate(model, table, i, j, nhat_ji, k)
            emitted += 1
    return emitted


@kernel
def emit_candidate(model, table, i, j, nhat_ji, k):
    x = load3(table.work, CANDIDATE + k)
    depth = table.work[CANDIDATE + k, 3]
    emit(model, table, i, j, x, add3(x, scale3(nhat_ji, depth)), nhat_ji, depth)


@kernel(outline=True)
def edge_contacts(model, table, i, j, nhat_ji, depth):
    """Two points of two edges (cylinder sides, capsules) that overlap side by side, as deep as the shapes; else 0.

    Capsules that touch end to end, or an end on a side, show lines that lie apart.
    """
    if shown_feature(model, table, i, scale3(nhat_ji, -1.0), POLYGON_A) != 2:
        return 0
    if shown_feature(model, table, j, nhat_ji, POLYGON_B) != 2:
        return 0
    a = load3(table.work, POLYGON_A)
    b = load3(table.work, POLYGON_B)
    u = sub3(load3(table.work, POLYGON_A + 1), a)
    v = sub3(load3(table.work, POLYGON_B + 1), b)
    uu = dot3(u, u)
    uv = dot3(u, v)
    if uv * uv < 0.9998 * uu * dot3(v, v):
        return 0
    start = dot3(sub3(b, a), u) / uu
    end = start + uv / uu
    low = start if start < end else end
    high = end if start < end else start
    if low < 0.0:
        low = 0.0
    if high > 1.0:
        high = 1.0
    if high <= low:
        return 0
    count = 0
    least = least_depth(model, i, j)
    deepest = -1e300
    for k in range(2):
        t = low if k == 0 else high
        p_i = add3(a, scale3(u, t))
        p_j = add3(b, scale3(v, (t - start) * uu / uv))
        depth_k = dot3(nhat_ji, sub3(p_j, p_i))
        if depth_k > deepest:
            deepest = depth_k
        if depth_k > least:
            count += 1
            store3(table.work, CANDIDATE + k, p_i)
            table.work[CANDIDATE + k, 3] = depth_k
    if count == 2 and deepest >= depth - shortfall(model, i, j, depth):
        for k in range(2):
            emit_candidate(model, table, i, j, nhat_ji, k)
        return 2
    return 0
