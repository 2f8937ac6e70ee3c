"""What a search for contacts remembers of each pair of convex shapes for the next one.

Of a pair whose boxes were apart, along which axis. Of one that was apart, a direction that separates it, and by how
much: while it does, nothing else is looked at. Of one that nearly touched, what would have met (see `tracking`), or the
direction along which it is nearest: there is only one, so what `polish` finds from there is the answer. Of a pair that
overlapped, what met, and the polytope that EPA grew in the difference, by points of the shapes: placed anew and made
convex again, it mostly says at once where the pair overlaps least. All is checked before it is believed and says no
more than the search without it would find: a polytope only which feature is nearest by far, whose answer `feature`
then gives.
"""

from __future__ import annotations

from sheldrake.common._kernels.generic import whole
from sheldrake.common._kernels.vec import add3, dot3, rotate, rotate_back, scale3, sub3
from sheldrake.common.kernel import kernel

from .epa import epa, make_convex, set_face
from .feature import number_of, what_meets
from .gjk import add_vertex
from .model import ELLIPSOID, FACE, NO_FEATURE, SIMPLEX, SLOT_FACES, SLOT_VERTICES
from .polish import nearby
from .support import is_curved, support, vertex_in_frame
from .tracking import (
    ALIKE,
    PARALLEL,
    centre_from,
    has_vertex,
    moved_by,
    relative_pose,
    still_meets,
    track,
)

_CERTAIN = 1e-9  # relative to the size: shapes that seem so far apart are apart, depths that differ by so much differ
_EPA_GAP = 1e-13  # relative to the size: EPA stops when the depth of polytopes is known this well
_EPA_GAP_SMOOTH = 1e-6  # and that of curved shapes, whose answer is then refined
_NO_SHIFT = (0.0, 0.0, 0.0)
_UNKNOWN = -1e300  # [m] a gap that has not been measured
_FEW_STEPS = 8  # of EPA from what is remembered: one that takes more grows a polytope larger than a new one
SEPARATED = -1
TOUCHING = -2


@kernel
def remembers(table, k):
    """Whether there is room for a memory of pair k."""
    return k >= 0 and k < len(table.memories)


@kernel
def own_slot(table, k):
    """The slot with the polytope of pair k; -1 if it has none."""
    s = table.memories[k].how - 1
    if s >= 0 and s < len(table.slots) and table.slots[s].owner == k + 1:
        return s
    return -1


@kernel
def forget(table, k):
    """Nothing is remembered of pair k from now on."""
    s = own_slot(table, k)
    if s >= 0:
        table.slots[s].owner = 0
    table.memories[k].how = 0


@kernel
def epa_gap(model, i, j, size):
    """How well EPA finds the depth of a pair [m]."""
    return size * (_EPA_GAP_SMOOTH if is_curved(model, i) or is_curved(model, j) else _EPA_GAP)


@kernel
def one_is_deepest(model, g):
    """Whether a shape overlaps others least in one place; a round one may do so above several corners of a hull.

    Then EPA, which knows the depth of curved shapes less well, may take another place than memory.
    """
    return model[g].kind != ELLIPSOID


@kernel
def remember_along(table, i, k, nhat_ji, how):
    forget(table, k)
    table.memories[k].how = how
    table.separators[k].axis_G = rotate_back(table.poses[i].R_WG, nhat_ji)
    table.separators[k].gap = _UNKNOWN


@kernel
def remember_direction(table, i, k, nhat_ji):
    """Pair k is apart along nhat_ji."""
    remember_along(table, i, k, nhat_ji, SEPARATED)


@kernel
def remember_touch(table, i, k, nhat_ji):
    """Pair k nearly touches, and is nearest along nhat_ji."""
    remember_along(table, i, k, nhat_ji, TOUCHING)


@kernel(outline=True)
def still_apart(model, table, i, j, size, reach, k):
    """Whether the cores of pair k are more than `reach` apart along the direction that is remembered.

    They are not measured while they can not have come so near: no point of the second has moved by as much.
    """
    if table.memories[k].how != SEPARATED:
        return False
    kept = table.separators[k]
    R, p = relative_pose(model, table, i, j)
    least = reach + _CERTAIN * size
    if kept.gap - moved_by(model, kept, R, p, j) > least:
        return True
    nhat_ji = rotate(table.poses[i].R_WG, kept.axis_G)
    kept.gap = dot3(nhat_ji, add_vertex(model, table, i, j, scale3(nhat_ji, -1.0), SIMPLEX, _NO_SHIFT))
    kept.R_AB, kept.p_AB = R, centre_from(model, j, R, p)
    return kept.gap > least


@kernel
def slot_of(table, k):
    """The slot of pair k: its own, or one that is free; -1 if there is none."""
    own = own_slot(table, k)
    if own >= 0:
        return own
    for s in range(len(table.slots)):
        if table.slots[s].owner == 0:
            return s
    return -1


@kernel(outline=True)
def remember_what_meets(model, table, i, j, k, faces, vertices, grown, what, corners, out, depth):
    """Keeps what meets of pair k, or would, and the polytope of EPA if it has `grown`; if there is a slot."""
    s = slot_of(table, k)
    if s < 0:
        forget(table, k)
        return
    slot = table.slots[s]
    if slot.owner != k + 1:
        slot.owner, slot.num_vertices, slot.num_faces, slot.feature = k + 1, 0, 0, NO_FEATURE
    table.memories[k].how = s + 1
    if grown:
        keep_polytope(model, table, i, j, s, faces, vertices)
    track(model, table, i, j, s, faces, what, corners, out, depth)


@kernel
def in_frame(model, table, g, number, p_W):
    """A point of the core of shape g in its frame; a vertex by its number, so that it stays where it is to the bit."""
    if is_curved(model, g):
        return rotate_back(table.poses[g].R_WG, sub3(p_W, table.poses[g].p_WG))
    return vertex_in_frame(model, g, number)


@kernel
def in_world(table, g, p_G):
    return add3(table.poses[g].p_WG, rotate(table.poses[g].R_WG, p_G))


@kernel
def number_faces(table, faces):
    """Numbers the faces of the polytope of EPA that exist, from 1 on, in `exists`; how many they are."""
    count = 0
    for f in range(faces):
        face = table.polytope[FACE + f]
        if face.exists > 0.0:
            count += 1
            face.exists = float(count)
    return count


@kernel
def number_vertices(table, faces, vertices):
    """Numbers the vertices of the polytope of EPA that faces have, from 1 on, in `stack`; how many they are."""
    for v in range(vertices):
        table.stack[v] = 0
    for f in range(faces):
        if table.polytope[FACE + f].exists > 0.0:
            for k in range(3):
                table.stack[table.links[f].corner[k]] = 1
    count = 0
    for v in range(vertices):
        if table.stack[v] > 0:
            count += 1
            table.stack[v] = count
    return count


@kernel(outline=True)
def keep_polytope(model, table, i, j, s, faces, vertices):
    """Keeps the polytope of EPA in slot s if it is small, else none."""
    slot = table.slots[s]
    slot.num_vertices, slot.num_faces = 0, 0
    num_faces, num_vertices = number_faces(table, faces), number_vertices(table, faces, vertices)
    if num_vertices > SLOT_VERTICES or num_faces > SLOT_FACES or num_faces != 2 * num_vertices - 4:
        return
    slot.num_vertices, slot.num_faces = num_vertices, num_faces
    for v in range(vertices):
        at = s * SLOT_VERTICES + table.stack[v] - 1
        if table.stack[v] > 0:
            kept = table.kept_vertices[at]
            kept.a, kept.b = number_of(table, v, 0), number_of(table, v, 1)
            points = table.kept_points[at]
            points.p_AP = in_frame(model, table, i, kept.a, table.vertices[SIMPLEX + v].a)
            points.p_BP = in_frame(model, table, j, kept.b, table.vertices[SIMPLEX + v].b)
    for f in range(faces):
        face = table.polytope[FACE + f]
        if face.exists > 0.0:
            link, kept_link = table.links[f], table.kept_links[s * SLOT_FACES + whole(face.exists) - 1]
            for k in range(3):
                kept_link.corner[k] = table.stack[link.corner[k]] - 1
                kept_link.across[k] = whole(table.polytope[FACE + link.across[k]].exists) - 1


@kernel(outline=True)
def place_polytope(model, table, i, j, size, s):
    """Puts the polytope of slot s where the shapes are now; whether it holds the origin."""
    slot = table.slots[s]
    for v in range(slot.num_vertices):
        kept = table.kept_vertices[s * SLOT_VERTICES + v]
        if not (has_vertex(model, i, kept.a) and has_vertex(model, j, kept.b)):
            return False
        a = in_world(table, i, table.kept_points[s * SLOT_VERTICES + v].p_AP)
        b = in_world(table, j, table.kept_points[s * SLOT_VERTICES + v].p_BP)
        table.vertices[SIMPLEX + v].points = (sub3(a, b), a, b, (float(kept.a), float(kept.b)))
    for f in range(slot.num_faces):
        kept_link = table.kept_links[s * SLOT_FACES + f]
        table.links[f].neighbours = kept_link.neighbours
        set_face(table, f, kept_link.corners)
        # A closed surface whose every face has the origin behind it goes around it, whether it is convex or not.
        if not table.polytope[FACE + f].offset > _CERTAIN * size:
            return False
    return True


@kernel
def is_nearest_by_far(table, faces, out, beyond, alike):
    """Whether all faces nearer than `beyond` look along `out`: 1 - cosine is no more than `alike`."""
    for f in range(faces):
        face = table.polytope[FACE + f]
        if face.exists > 0.0 and face.offset <= beyond and dot3(face.normal, out) < 1.0 - alike:
            return False
    return True


@kernel
def follow_touch(model, table, i, j, size, far, k):
    """`follow` of a pair that nearly touched."""
    out = scale3(rotate(table.poses[i].R_WG, table.separators[k].axis_G), -1.0)
    before = dot3(out, sub3(support(model, table, i, out), support(model, table, j, scale3(out, -1.0))))
    found, out, depth, p_i, p_j = nearby(model, table, i, j, size, out, before)
    slack = _CERTAIN * size
    known = found and depth < -slack and depth > slack - far  # else rounding says who is near enough
    if known:
        table.separators[k].axis_G = rotate_back(table.poses[i].R_WG, scale3(out, -1.0))
    return known, out, depth, p_i, p_j


@kernel(outline=True)
def follow(model, table, i, j, size, far, k):
    """(whether memory tells where pair k overlaps least or is nearest, direction out of i - j, depth, both points)."""
    out = (1.0, 0.0, 0.0)
    if table.memories[k].how == TOUCHING:
        return follow_touch(model, table, i, j, size, far, k)
    s = own_slot(table, k)
    if s < 0:
        return False, out, 0.0, out, out
    if table.slots[s].feature != NO_FEATURE:
        known, out, depth, p_i, p_j = still_meets(model, table, i, j, size, s)
        if known and depth > _CERTAIN * size - far:  # else rounding says who is near enough
            return known, out, depth, p_i, p_j
    if table.slots[s].num_vertices == 0 or not place_polytope(model, table, i, j, size, s):
        return False, out, 0.0, out, out
    if not make_convex(table, table.slots[s].num_faces, _EPA_GAP * size):  # else EPA adds vertices that there are
        return False, out, 0.0, out, out
    gap = epa_gap(model, i, j, size)
    begin = table.slots[s].num_faces, table.slots[s].num_vertices
    corners, out, depth, proven, faces, vertices = epa(model, table, i, j, size, gap, begin, _FEW_STEPS)
    curved = is_curved(model, i) or is_curved(model, j)
    alike = ALIKE if curved else PARALLEL
    if not proven or not is_nearest_by_far(table, faces, out, depth + gap + _CERTAIN * size, alike):
        return False, out, depth, out, out
    what, out, depth, p_i, p_j = what_meets(model, table, i, j, size, corners, out, depth)
    known = what != NO_FEATURE
    if known:
        remember_what_meets(model, table, i, j, k, faces, vertices, True, what, corners, out, depth)
    return known, out, depth, p_i, p_j
