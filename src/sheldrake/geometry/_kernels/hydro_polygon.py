"""Polygons of contact surfaces: cut out of tetrahedra and triangles, measured, and put into the table."""

from __future__ import annotations

import numpy as np

from sheldrake.common._kernels.vec import add3, cross3, dot3, load3, load3_at, load9, rotate, scale3, store3, sub3
from sheldrake.common.kernel import kernel

from .hydro_model import (
    AREA,
    CENTROID,
    CORNER,
    CORNERS,
    GRADIENT_M,
    GRADIENT_N,
    NO_ROOM,
    NORMAL,
    NUM_FACES,
    NUM_SURFACES,
    NUM_VERTICES,
    PRESSURE,
    STATUS,
    SURFACE,
    TRIANGLES,
)
from .model import POSITION

IN_PLANE = np.float64(1e-14)  # [m] a point nearer to a plane is in it
NEAR_SQUARED = np.float64(1e-28)  # [m^2] corners nearer to each other are one


@kernel
def store3_at_columns(A, i, k, a):
    A[i, k] = a[0]
    A[i, k + 1] = a[1]
    A[i, k + 2] = a[2]


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


@kernel
def crossing(inner, outer, d_inner, d_outer):
    """Where an edge crosses a plane, reckoned from its inner end: neighbours that go the other way agree on it."""
    return add3(inner, scale3(sub3(outer, inner), d_inner / (d_inner - d_outer)))


@kernel(outline=True)
def clip_polygon(work, source, n, target, normal, offset, side):
    """Copies the part of a polygon of n corners where normal . x <= offset; its number of corners.

    A polygon in the plane is kept if `side` is positive. It lies between two tetrahedra and must be counted once: the
    cosine of its normal and the plane's has another sign in the other one.
    """
    m = 0
    inside = 0
    before = load3(work, source + n - 1)
    d_before = height_over(before, normal, offset)
    for i in range(n):
        here = load3(work, source + i)
        d_here = height_over(here, normal, offset)
        if d_before < 0.0 and d_here > 0.0:
            store3(work, target + m, crossing(before, here, d_before, d_here))
            m += 1
        if d_before > 0.0 and d_here < 0.0:
            store3(work, target + m, crossing(here, before, d_here, d_before))
            m += 1
        if d_here <= 0.0:
            store3(work, target + m, here)
            m += 1
        if d_here < 0.0:
            inside += 1
        before = here
        d_before = d_here
    if inside == 0 and side <= 0.0:
        return 0
    return m


@kernel
def put_crossing(model, work, row, i, j, h_i, h_j):
    """Where the edge between two vertices crosses height zero, reckoned from the lower one: neighbours agree on it."""
    if i < j:
        p = load3(model.vertex, i)
        store3(work, row, add3(p, scale3(sub3(load3(model.vertex, j), p), h_i / (h_i - h_j))))
    else:
        p = load3(model.vertex, j)
        store3(work, row, add3(p, scale3(sub3(load3(model.vertex, i), p), h_j / (h_j - h_i))))


@kernel(outline=True)
def slice_tetrahedron(model, work, target, element, normal, offset):
    """The polygon in which the plane normal . x = offset cuts a tetrahedron; its number of corners: 0, 3 or 4."""
    a = model.element[element, 0]
    b = model.element[element, 1]
    c = model.element[element, 2]
    d = model.element[element, 3]
    h_a = dot3(normal, load3(model.vertex, a)) - offset
    h_b = dot3(normal, load3(model.vertex, b)) - offset
    h_c = dot3(normal, load3(model.vertex, c)) - offset
    h_d = dot3(normal, load3(model.vertex, d)) - offset
    above = 0
    if h_a > 0.0:
        above += 1
    if h_b > 0.0:
        above += 1
    if h_c > 0.0:
        above += 1
    if h_d > 0.0:
        above += 1
    if above == 0 or above == 4:
        return 0
    if above == 2:  # bring two of one side to a and b
        if (h_a > 0.0) == (h_c > 0.0):
            b, c = c, b
            h_b, h_c = h_c, h_b
        elif (h_a > 0.0) == (h_d > 0.0):
            b, d = d, b
            h_b, h_d = h_d, h_b
        put_crossing(model, work, target, a, c, h_a, h_c)
        put_crossing(model, work, target + 1, a, d, h_a, h_d)
        put_crossing(model, work, target + 2, b, d, h_b, h_d)
        put_crossing(model, work, target + 3, b, c, h_b, h_c)
        return 4
    lonely = above == 1  # bring the one that is alone on its side to a
    if (h_b > 0.0) == lonely:
        a, b = b, a
        h_a, h_b = h_b, h_a
    elif (h_c > 0.0) == lonely:
        a, c = c, a
        h_a, h_c = h_c, h_a
    elif (h_d > 0.0) == lonely:
        a, d = d, a
        h_a, h_d = h_d, h_a
    put_crossing(model, work, target, a, b, h_a, h_b)
    put_crossing(model, work, target + 1, a, c, h_a, h_c)
    put_crossing(model, work, target + 2, a, d, h_a, h_d)
    return 3


@kernel
def drop_double_corners(work, source, n):
    """Removes corners that coincide with the one before them; the number left."""
    m = 0
    for i in range(n):
        here = load3(work, source + i)
        double = False
        if m > 0:
            r = sub3(here, load3(work, source + m - 1))
            double = dot3(r, r) < NEAR_SQUARED
        if not double:
            store3(work, source + m, here)
            m += 1
    if m > 1:
        r = sub3(load3(work, source), load3(work, source + m - 1))
        if dot3(r, r) < NEAR_SQUARED:
            m -= 1
    return m


@kernel
def put_vertices(surfaces, X_WG, frame, source, n, normal, field):
    """The corners in W, counter-clockwise about the normal, with their pressure; the first one's row."""
    work = surfaces.work
    first = surfaces.count[NUM_VERTICES]
    R_WG = load9(X_WG, frame)
    p_WG = load3_at(X_WG, frame, POSITION)
    origin = rotate(R_WG, load3(work, source))
    turn = 0.0 * field[3]
    before = origin
    for i in range(n):
        p = rotate(R_WG, load3(work, source + i))
        turn += dot3(normal, cross3(sub3(before, origin), sub3(p, origin)))
        before = p
    for i in range(n):
        row = first + i
        if turn < 0.0:
            row = first + n - 1 - i
        p = load3(work, source + i)
        store3(surfaces.vertex, row, add3(p_WG, rotate(R_WG, p)))
        surfaces.vertex[row, 3] = pressure_at(field, p)
    surfaces.count[NUM_VERTICES] = first + n
    return first


@kernel
def put_face(surfaces, corners, a, b, c, normal, area, centroid, pressure, gradients):
    """One face."""
    f = surfaces.count[NUM_FACES]
    surfaces.count[NUM_FACES] = f + 1
    surfaces.face[f, SURFACE] = surfaces.count[NUM_SURFACES]
    surfaces.face[f, CORNERS] = corners
    surfaces.face[f, CORNER] = a
    surfaces.face[f, CORNER + 1] = b
    surfaces.face[f, CORNER + 2] = c
    surfaces.contact[f] = -1
    surfaces.value[f, AREA] = area
    surfaces.value[f, PRESSURE] = pressure
    store3_at_columns(surfaces.value, f, NORMAL, normal)
    store3_at_columns(surfaces.value, f, CENTROID, centroid)
    store3_at_columns(surfaces.value, f, GRADIENT_M, gradients[0])
    store3_at_columns(surfaces.value, f, GRADIENT_N, gradients[1])


@kernel
def corner_area(surfaces, a, b, c, normal):
    """Area of a triangle of three rows, seen along the normal [m^2]."""
    p = load3(surfaces.vertex, a)
    return 0.5 * dot3(normal, cross3(sub3(load3(surfaces.vertex, b), p), sub3(load3(surfaces.vertex, c), p)))


@kernel
def mean_position(surfaces, a, b, c):
    s = add3(load3(surfaces.vertex, a), add3(load3(surfaces.vertex, b), load3(surfaces.vertex, c)))
    return scale3(s, 1.0 / 3.0)


@kernel
def mean_pressure(surfaces, a, b, c):
    return (surfaces.vertex[a, 3] + surfaces.vertex[b, 3] + surfaces.vertex[c, 3]) / 3.0


@kernel(outline=True)
def put_polygon(model, surfaces, X_WG, frame, source, n, normal, field, gradients):
    """Adds the polygon in `work` to the surface at hand, as it is or as triangles about its centroid.

    Args:
        model: HydroModel.
        surfaces: HydroTable.
        X_WG: poses of all geometries.
        frame: geometry in whose frame the corners and the field are.
        source: first row of `work`.
        n: number of corners.
        normal: unit normal out of N into M, in W.
        field: gradient and value at the origin of the pressure.
        gradients: those of M and N, in W.
    """
    n = drop_double_corners(surfaces.work, source, n)
    if n < 3:
        return
    triangles = model.setting[TRIANGLES] == 1
    most = surfaces.count[NUM_FACES] + (n if triangles else 1)
    if most > surfaces.face.shape[0] or surfaces.count[NUM_VERTICES] + n + 1 > surfaces.vertex.shape[0]:
        surfaces.count[STATUS] = NO_ROOM
        return
    first = put_vertices(surfaces, X_WG, frame, source, n, normal, field)
    area = 0.0 * field[3]
    centroid = scale3(normal, 0.0)
    pressure = 0.0 * field[3]
    for i in range(1, n - 1):
        part = corner_area(surfaces, first, first + i, first + i + 1, normal)
        area += part
        centroid = add3(centroid, scale3(mean_position(surfaces, first, first + i, first + i + 1), part))
        pressure += part * mean_pressure(surfaces, first, first + i, first + i + 1)
    if area > 0.0:
        centroid = scale3(centroid, 1.0 / area)
        pressure /= area
    else:
        centroid = load3(surfaces.vertex, first)
        pressure = surfaces.vertex[first, 3]
    if not triangles:
        put_face(surfaces, n, first, first + 1, first + 2, normal, area, centroid, pressure, gradients)
        return
    last = surfaces.count[NUM_VERTICES]
    store3(surfaces.vertex, last, centroid)
    surfaces.vertex[last, 3] = pressure
    surfaces.count[NUM_VERTICES] = last + 1
    for i in range(n):
        b = first + i + 1
        if i == n - 1:
            b = first
        area = corner_area(surfaces, first + i, b, last, normal)
        centroid = mean_position(surfaces, first + i, b, last)
        pressure = mean_pressure(surfaces, first + i, b, last)
        put_face(surfaces, 3, first + i, b, last, normal, area, centroid, pressure, gradients)
