"""Polygons of contact surfaces: cut out of tetrahedra and triangles, measured, and put into the table."""

from __future__ import annotations

from sheldrake.common._kernels.vec import add3, cross3, dot3, rotate, scale3, sub3
from sheldrake.common.kernel import kernel

from .hydro_model import NO_ROOM

IN_PLANE = 1e-14  # [m] a point nearer to a plane is in it
NEAR_SQUARED = 1e-28  # [m^2] corners nearer to each other are one


@kernel
def pressure_at(field, p):
    """Of a linear field (gradient, value at the origin)."""
    return field[0] * p[0] + field[1] * p[1] + field[2] * p[2] + field[3]


@kernel
def height_over(p, normal, offset):
    """Height of a point over a plane; zero if it is in it but for rounding.

    The edge of a contact surface is in both surfaces: with noise for heights it would be broken in two.
    """
    height = dot3(normal, p) - offset
    if height < IN_PLANE and -height < IN_PLANE:
        return 0.0 * height
    return height


WITHIN, ACROSS, BEYOND = range(3)  # how a polygon lies to a plane that bounds it


@kernel
def relation_to_plane(surfaces, source, n, cut):
    """Whether a polygon of n corners is within a plane, cut by it, or beyond it, as `clip_polygon` would find."""
    inside = 0
    outside = 0
    for i in range(n):
        height = height_over(surfaces.corners[source + i].p, cut.normal, cut.offset)
        if height < 0.0:
            inside += 1
        if height > 0.0:
            outside += 1
    if inside > 0:
        return ACROSS if outside > 0 else WITHIN
    return WITHIN if outside == 0 and cut.side > 0.0 else BEYOND


@kernel
def crossing(inner, outer, d_inner, d_outer):
    """Where an edge crosses a plane, reckoned from its inner end: neighbours that go the other way agree on it."""
    return add3(inner, scale3(sub3(outer, inner), d_inner / (d_inner - d_outer)))


@kernel(outline=True)
def clip_polygon(surfaces, source, n, target, normal, offset, side):
    """Copies the part of a polygon of n corners where normal . x <= offset; its number of corners.

    A polygon in the plane is kept if `side` is positive. It lies between two tetrahedra and must be counted once: the
    cosine of its normal and the plane's has another sign in the other one.
    """
    m = 0
    inside = 0
    before = surfaces.corners[source + n - 1].p
    d_before = height_over(before, normal, offset)
    for i in range(n):
        here = surfaces.corners[source + i].p
        d_here = height_over(here, normal, offset)
        if d_before < 0.0 and d_here > 0.0:
            surfaces.corners[target + m].p = crossing(before, here, d_before, d_here)
            m += 1
        if d_before > 0.0 and d_here < 0.0:
            surfaces.corners[target + m].p = crossing(here, before, d_here, d_before)
            m += 1
        if d_here <= 0.0:
            surfaces.corners[target + m].p = here
            m += 1
        if d_here < 0.0:
            inside += 1
        before = here
        d_before = d_here
    if inside == 0 and side <= 0.0:
        return 0
    return m


@kernel
def over_plane(model, vertex, normal, offset):
    """A vertex and its height over a plane."""
    return vertex, dot3(normal, model.vertices[vertex].p_GV) - offset


@kernel
def put_crossing(model, surfaces, row, a, b):
    """Where the edge between two vertices, with their heights, crosses height zero; the first vertex is the inner."""
    i, h_i = a
    j, h_j = b
    if j < i:
        i, h_i, j, h_j = j, h_j, i, h_i
    surfaces.corners[row].p = crossing(model.vertices[i].p_GV, model.vertices[j].p_GV, h_i, h_j)


@kernel(outline=True)
def slice_tetrahedron(model, surfaces, target, element, normal, offset):
    """The polygon in which the plane normal . x = offset cuts a tetrahedron; its number of corners: 0, 3 or 4."""
    i, j, k, l = model.elements[element].corners
    a = over_plane(model, i, normal, offset)
    b = over_plane(model, j, normal, offset)
    c = over_plane(model, k, normal, offset)
    d = over_plane(model, l, normal, offset)
    above = 0
    for height in (a[1], b[1], c[1], d[1]):
        if height > 0.0:
            above += 1
    if above == 0 or above == 4:
        return 0
    if above == 2:  # bring two of one side to a and b
        if (a[1] > 0.0) == (c[1] > 0.0):
            b, c = c, b
        elif (a[1] > 0.0) == (d[1] > 0.0):
            b, d = d, b
        put_crossing(model, surfaces, target, a, c)
        put_crossing(model, surfaces, target + 1, a, d)
        put_crossing(model, surfaces, target + 2, b, d)
        put_crossing(model, surfaces, target + 3, b, c)
        return 4
    lonely = above == 1  # bring the one that is alone on its side to a
    if (b[1] > 0.0) == lonely:
        a, b = b, a
    elif (c[1] > 0.0) == lonely:
        a, c = c, a
    elif (d[1] > 0.0) == lonely:
        a, d = d, a
    put_crossing(model, surfaces, target, a, b)
    put_crossing(model, surfaces, target + 1, a, c)
    put_crossing(model, surfaces, target + 2, a, d)
    return 3


@kernel
def coincide(p, q):
    r = sub3(p, q)
    return dot3(r, r) < NEAR_SQUARED


@kernel
def drop_double_corners(surfaces, source, n):
    """Removes corners that coincide with the one before them; the number left."""
    m = 0
    for i in range(n):
        here = surfaces.corners[source + i].p
        if m == 0 or not coincide(here, surfaces.corners[source + m - 1].p):
            surfaces.corners[source + m].p = here
            m += 1
    if m > 1 and coincide(surfaces.corners[source].p, surfaces.corners[source + m - 1].p):
        m -= 1
    return m


@kernel
def put_vertices(table, surfaces, frame, source, n, normal, field):
    """The corners in W, counter-clockwise about the normal, with their pressure; the first one's row."""
    first = surfaces.num_vertices
    R_WG = table.poses[frame].R_WG
    p_WG = table.poses[frame].p_WG
    origin = rotate(R_WG, surfaces.corners[source].p)
    turn = 0.0 * field[3]
    before = origin
    for i in range(n):
        p = rotate(R_WG, surfaces.corners[source + i].p)
        turn += dot3(normal, cross3(sub3(before, origin), sub3(p, origin)))
        before = p
    for i in range(n):
        p = surfaces.corners[source + i].p
        vertex = surfaces.vertices[first + (n - 1 - i if turn < 0.0 else i)]
        vertex.p_WV, vertex.pressure = add3(p_WG, rotate(R_WG, p)), pressure_at(field, p)
    surfaces.num_vertices = first + n
    return first


@kernel
def put_face(surfaces, num_corners, corners, normal, area, centroid, pressure, gradients):
    """One face."""
    f = surfaces.num_faces
    surfaces.num_faces = f + 1
    face = surfaces[f]
    face.surface, face.num_corners, face.corners = surfaces.num_surfaces, num_corners, corners
    face.normal, face.area = normal, area
    face.p_WC, face.pressure = centroid, pressure
    face.gradient_M, face.gradient_N = gradients
    surfaces.contact[f] = -1


@kernel
def triangle(surfaces, i, j, k, normal):
    """Area of a triangle of three vertices, seen along the normal [m^2], its centroid, and the pressure there."""
    a = surfaces.vertices[i]
    b = surfaces.vertices[j]
    c = surfaces.vertices[k]
    p = a.p_WV
    area = 0.5 * dot3(normal, cross3(sub3(b.p_WV, p), sub3(c.p_WV, p)))
    return area, scale3(add3(p, add3(b.p_WV, c.p_WV)), 1.0 / 3.0), (a.pressure + b.pressure + c.pressure) / 3.0


@kernel(outline=True)
def put_polygon(model, table, surfaces, frame, source, n, normal, field, gradients):
    """Adds a polygon of `corners` to the surface at hand, as it is or as triangles about its centroid.

    Args:
        model: HydroModel.
        table: ContactTable.
        surfaces: HydroTable.
        frame: geometry in whose frame the corners and the field are.
        source: first of its corners.
        n: number of corners.
        normal: unit normal out of N into M, in W.
        field: gradient and value at the origin of the pressure.
        gradients: those of M and N, in W.
    """
    n = drop_double_corners(surfaces, source, n)
    if n < 3:
        return
    triangles = model.triangles == 1
    most = surfaces.num_faces + (n if triangles else 1)
    if most > surfaces.face.shape[0] or surfaces.num_vertices + n + 1 > len(surfaces.vertices):
        surfaces.status = NO_ROOM
        return
    first = put_vertices(table, surfaces, frame, source, n, normal, field)
    area = 0.0 * field[3]
    centroid = scale3(normal, 0.0)
    pressure = 0.0 * field[3]
    for i in range(1, n - 1):
        part, middle, mean = triangle(surfaces, first, first + i, first + i + 1, normal)
        area += part
        centroid = add3(centroid, scale3(middle, part))
        pressure += part * mean
    if area > 0.0:
        centroid = scale3(centroid, 1.0 / area)
        pressure /= area
    else:
        centroid, pressure = surfaces.vertices[first].p_WV, surfaces.vertices[first].pressure
    if not triangles:
        put_face(surfaces, n, (first, first + 1, first + 2), normal, area, centroid, pressure, gradients)
        return
    last = surfaces.num_vertices
    surfaces.vertices[last].p_WV, surfaces.vertices[last].pressure = centroid, pressure
    surfaces.num_vertices = last + 1
    for i in range(n):
        a = first + i
        b = first + (i + 1 if i < n - 1 else 0)
        area, centroid, pressure = triangle(surfaces, a, b, last, normal)
        put_face(surfaces, 3, (a, b, last), normal, area, centroid, pressure, gradients)
