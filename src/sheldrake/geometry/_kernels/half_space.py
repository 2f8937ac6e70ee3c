"""Contacts of every convex shape with a half space.

Names: shape i in frame G, half space j with its plane through Ho and outward unit normal nhat. `height` is that of Go
above the plane [m]. "single" functions give Drake's one point, "multi" functions up to five points of the touching
face or edge, each with a depth of its own: every contact point enters and leaves with depth zero, so that the contact
force is continuous.
"""

from __future__ import annotations

from sheldrake.common._kernels.generic import sqrt
from sheldrake.common._kernels.vec import add3, cross3, dot3, rotate, rotate_back, scale3, sub3
from sheldrake.common.kernel import kernel

from .model import BOX, CAPSULE, CYLINDER, ELLIPSOID, HULL, SPHERE, X_AXIS, Z_AXIS
from .support import lowest_vertex, steepest_face
from .table import (
    CORNERS,
    MIN_DEPTH,
    absolute,
    column,
    elastic_reach,
    emit,
    least_depth,
    longest,
    reach_along,
    several_points,
)

ALIGNED = 1e-7  # Drake's tolerance for an axis that is (not) along the normal


@kernel(outline=True)
def half_space_contacts(model, table, i, j):
    """Contacts of shape i with half space j."""
    nhat = column(table.poses[j].R_WG, Z_AXIS)
    height = dot3(nhat, sub3(table.poses[i].p_WG, table.poses[j].p_WG))
    kind = model[i].kind
    multi = several_points(model, i, j)
    if kind == SPHERE:
        sphere_on_plane(model, table, i, j, nhat, height)
    elif kind == BOX and multi:
        box_on_plane_multi(model, table, i, j, nhat, height)
    elif kind == BOX:
        box_on_plane_single(model, table, i, j, nhat, height)
    elif kind == CYLINDER and multi:
        cylinder_on_plane_multi(model, table, i, j, nhat, height)
    elif kind == CYLINDER:
        cylinder_on_plane_single(model, table, i, j, nhat, height)
    elif kind == CAPSULE:
        capsule_on_plane(model, table, i, j, nhat, height, multi)
    elif kind == ELLIPSOID:
        ellipsoid_on_plane(model, table, i, j, nhat, height)
    elif kind == HULL:
        hull_on_plane(model, table, i, j, nhat, height, multi)


@kernel
def emit_below(model, table, i, j, p_WQ, nhat, depth):
    """A contact at Q of shape i, which is `depth` below the plane of j, if it is below (see `least_depth`)."""
    if depth > least_depth(model, i, j):
        emit(model, table, i, j, p_WQ, add3(p_WQ, scale3(nhat, depth)), nhat, depth)


@kernel
def sphere_on_plane(model, table, i, j, nhat, height):
    radius = model[i].radius
    p_WGo = table.poses[i].p_WG
    if radius - height >= -elastic_reach(model, i, j):
        p_WCi = sub3(p_WGo, scale3(nhat, radius))
        emit(model, table, i, j, p_WCi, sub3(p_WGo, scale3(nhat, height)), nhat, radius - height)


# ---- box


@kernel
def box_on_plane_single(model, table, i, j, nhat, height):
    """The lowest corner; the centre of a level face."""
    R_WG = table.poses[i].R_WG
    c = rotate_back(R_WG, nhat)
    h = model[i].half_sizes
    depth = reach_along(h, c) - height
    level = -1
    for k in range(3):
        if absolute(absolute(c[k]) - 1.0) < ALIGNED:
            level = k
    p_WQ = table.poses[i].p_WG
    for k in range(3):
        if level < 0 or level == k:
            p_WQ = add3(p_WQ, scale3(column(R_WG, k), -h[k] if c[k] > 0.0 else h[k]))
    emit_below(model, table, i, j, p_WQ, nhat, depth)


@kernel
def box_on_plane_multi(model, table, i, j, nhat, height):
    """The corners, below the plane, of the face that looks down most."""
    R_WG = table.poses[i].R_WG
    c = rotate_back(R_WG, nhat)
    h = model[i].half_sizes
    if height > reach_along(h, c) - least_depth(model, i, j):
        return
    down, along = longest(c)
    u, v = (down + 1) % 3, (down + 2) % 3
    s = -1.0 if along > 0.0 else 1.0
    p_WF = add3(table.poses[i].p_WG, scale3(column(R_WG, down), s * h[down]))
    depth_F = -(height + s * c[down] * h[down])
    U = scale3(column(R_WG, u), h[u])
    V = scale3(column(R_WG, v), h[v])
    for su, sv in CORNERS:
        depth = depth_F - su * c[u] * h[u] - sv * c[v] * h[v]
        emit_below(model, table, i, j, add3(p_WF, add3(scale3(U, su), scale3(V, sv))), nhat, depth)


# ---- cylinder and capsule


@kernel
def cylinder_on_plane_single(model, table, i, j, nhat, height):
    """The lowest rim point; the middle of a level side line; the centre of a level cap."""
    axis = column(table.poses[i].R_WG, Z_AXIS)
    radius = model[i].radius
    c = dot3(axis, nhat)
    p_WQ = table.poses[i].p_WG
    depth = radius - height
    if absolute(c) < ALIGNED:
        p_WQ = sub3(p_WQ, scale3(nhat, radius))
    else:
        half_length = model[i].half_length
        p_WQ = add3(p_WQ, scale3(axis, -half_length if c > 0.0 else half_length))
        if absolute(absolute(c) - 1.0) >= ALIGNED:
            C = sub3(scale3(axis, c), nhat)
            p_WQ = add3(p_WQ, scale3(C, radius / sqrt(dot3(C, C))))
        depth = -(height + dot3(nhat, sub3(p_WQ, table.poses[i].p_WG)))
    emit_below(model, table, i, j, p_WQ, nhat, depth)


@kernel(outline=True)
def cylinder_on_plane_multi(model, table, i, j, nhat, height):
    """The lower rim: its lowest point, and those 90 and 180 degrees from it; its middle; the lowest of the upper rim.

    Four rim points 90 degrees apart feel the same moment wherever the first one is, so that it may follow the tilt.
    The middle takes its share of the load: a disk that spins is braked at 4/5 of its radius, which even pressure does
    at 2/3, the rim alone at 1.
    """
    R_WG = table.poses[i].R_WG
    axis = column(R_WG, Z_AXIS)
    radius = model[i].radius
    half_length = model[i].half_length
    c = dot3(axis, nhat)
    down = sub3(scale3(axis, c), nhat)
    slope = sqrt(dot3(down, down))
    least = least_depth(model, i, j)
    if height > half_length * absolute(c) + radius * slope - least:
        return
    U = column(R_WG, X_AXIS)
    if slope > 1e-12:
        U = scale3(down, 1.0 / slope)
    V = scale3(cross3(axis, U), radius)
    U = scale3(U, radius)
    to_low = scale3(axis, -half_length if c > 0.0 else half_length)
    p_WGo = table.poses[i].p_WG
    p_WL = add3(p_WGo, to_low)
    depth_L = half_length * absolute(c) - height
    drop = -dot3(nhat, U)
    swing = dot3(nhat, V)
    emit_below(model, table, i, j, add3(p_WL, U), nhat, depth_L + drop)
    depth_upper = drop - half_length * absolute(c) - height
    emit_below(model, table, i, j, add3(sub3(p_WGo, to_low), U), nhat, depth_upper)
    emit_below(model, table, i, j, add3(p_WL, V), nhat, depth_L - swing)
    emit_below(model, table, i, j, sub3(p_WL, V), nhat, depth_L + swing)
    emit_below(model, table, i, j, p_WL, nhat, depth_L)
    if depth_upper <= least:
        emit_below(model, table, i, j, sub3(p_WL, U), nhat, depth_L - drop)


@kernel
def capsule_on_plane(model, table, i, j, nhat, height, multi):
    """The lowest points of both end balls, or Drake's one point."""
    axis = column(table.poses[i].R_WG, Z_AXIS)
    radius = model[i].radius
    half_length = model[i].half_length
    c = dot3(axis, nhat)
    p_WS = sub3(table.poses[i].p_WG, scale3(nhat, radius))
    arm = scale3(axis, half_length)
    if multi:
        emit_below(model, table, i, j, sub3(p_WS, arm), nhat, radius - height + half_length * c)
        emit_below(model, table, i, j, add3(p_WS, arm), nhat, radius - height - half_length * c)
    elif absolute(c) < ALIGNED:
        emit_below(model, table, i, j, p_WS, nhat, radius - height)
    else:
        p_WQ = add3(p_WS, scale3(arm, -1.0 if c > 0.0 else 1.0))
        emit_below(model, table, i, j, p_WQ, nhat, radius - height + half_length * absolute(c))


@kernel
def ellipsoid_on_plane(model, table, i, j, nhat, height):
    """Drake's point: on the line from the centre to the lowest point, midway between surface and plane."""
    R_WG = table.poses[i].R_WG
    n = rotate_back(R_WG, nhat)
    a = model[i].half_sizes
    an = (a[0] * n[0], a[1] * n[1], a[2] * n[2])
    reach = sqrt(dot3(an, an))
    depth = reach - height
    if depth > MIN_DEPTH - elastic_reach(model, i, j):
        s = rotate(R_WG, (a[0] * an[0] / reach, a[1] * an[1] / reach, a[2] * an[2] / reach))
        p_WM = add3(table.poses[i].p_WG, scale3(s, 0.5 * depth / reach - 1.0))
        half = scale3(nhat, 0.5 * depth)
        emit(model, table, i, j, sub3(p_WM, half), add3(p_WM, half), nhat, depth)


# ---- hull


@kernel
def depth_of(model, v, n_G, height):
    """How far a vertex is below the plane [m]."""
    return -(dot3(model.vertices[v].p_GV, n_G) + height)


@kernel
def emit_vertex(model, table, i, j, v, n_G, nhat, height):
    """A contact at a vertex, if it is below the plane."""
    p_WQ = add3(table.poses[i].p_WG, rotate(table.poses[i].R_WG, model.vertices[v].p_GV))
    emit_below(model, table, i, j, p_WQ, nhat, depth_of(model, v, n_G, height))


@kernel
def hull_on_plane(model, table, i, j, nhat, height, multi):
    """The lowest vertex, or all vertices below the plane if there are at most four, else four of them."""
    n_G = rotate_back(table.poses[i].R_WG, nhat)
    low = lowest_vertex(model, i, n_G)
    least = least_depth(model, i, j)
    if depth_of(model, low, n_G, height) <= least:
        return
    if not multi:
        emit_vertex(model, table, i, j, low, n_G, nhat, height)
        return
    if stands_on_feet(model, table, i, j, low, n_G, nhat, height):
        return
    below = list_below(model, table, i, n_G, height, least)
    if below > 4:
        four_vertices_below(model, table, i, j, low, n_G, nhat, height, below)
        return
    for n in range(below):
        emit_vertex(model, table, i, j, table.stack[n], n_G, nhat, height)


@kernel(outline=True)
def list_below(model, table, i, n_G, height, least):
    """How many vertices of a hull are below the plane by more than `least`; they go to `stack` if it has room."""
    first = model[i].first_vertex
    below = 0
    for v in range(first, first + model[i].num_vertices):
        if depth_of(model, v, n_G, height) > least:
            if below < len(table.stack):
                table.stack[below] = v
            below += 1
    return below


@kernel
def below_plane(model, table, i, n_G, height, least, below):
    """The vertices of a hull below the plane, ascending; so many are in `stack`, unless it has no room."""
    listed = below <= len(table.stack)
    for n in range(below if listed else model[i].num_vertices):
        v = table.stack[n] if listed else model[i].first_vertex + n
        if listed or depth_of(model, v, n_G, height) > least:
            yield v


@kernel(outline=True)
def stands_on_feet(model, table, i, j, low, n_G, nhat, height):
    """Contacts of a hull that lies on a face, at four corners of it chosen once and for all; whether there are any.

    A choice that depended on the state would change with every small tilt.
    """
    foot = model.loops[steepest_face(model, low, scale3(n_G, -1.0))].first_foot
    if foot < 0:
        return False
    least = least_depth(model, i, j)
    for k in range(foot, foot + 4):
        if depth_of(model, model.topology[k], n_G, height) <= least:
            return False
    for k in range(foot, foot + 4):
        emit_vertex(model, table, i, j, model.topology[k], n_G, nhat, height)
    return True


@kernel(outline=True)
def four_vertices_below(model, table, i, j, low, n_G, nhat, height, below):
    """Four of many vertices below the plane: the lowest, the one farthest from it, and the farthest on either side."""
    least = least_depth(model, i, j)
    p_low = model.vertices[low].p_GV
    far = low
    farthest = 0.0
    for v in below_plane(model, table, i, n_G, height, least, below):
        r = sub3(model.vertices[v].p_GV, p_low)
        if dot3(r, r) > farthest:
            far, farthest = v, dot3(r, r)
    line = cross3(n_G, sub3(model.vertices[far].p_GV, p_low))
    left, most_left = low, 0.0
    right, most_right = low, 0.0
    for v in below_plane(model, table, i, n_G, height, least, below):
        side = dot3(line, sub3(model.vertices[v].p_GV, p_low))
        if side > most_left:
            left, most_left = v, side
        if side < most_right:
            right, most_right = v, side
    for v in below_plane(model, table, i, n_G, height, least, below):
        if v == low or v == far or v == left or v == right:
            emit_vertex(model, table, i, j, v, n_G, nhat, height)
