"""Searches among the vertices and faces of a hull."""

from __future__ import annotations

import numpy as np

from sheldrake.common._kernels.generic import whole
from sheldrake.common._kernels.vec import dot3, load3
from sheldrake.common.kernel import kernel

from .model import CELLS, FIRST_CELL, FIRST_VERTEX, NUM_VERTICES
from .table import absolute

ALL_TRIED = 8  # of hulls with at most so many vertices each is tried
_0 = np.int64(0)
_LAST = CELLS - 1


@kernel
def cell_along(x):
    """Which of the cells along an edge of a cube; x goes from -1 to 1."""
    k = whole(0.5 * CELLS * (x + 1.0))
    return _0 if k < 0 else (_LAST if k > _LAST else k)


@kernel
def cell_of(n):
    """The cell of a cube around the origin that n goes through; see CELLS."""
    axis = _0
    a = n[0]
    b = n[1]
    c = n[2]
    if absolute(n[1]) > absolute(a):
        axis = np.int64(1)
        a = n[1]
        b = n[2]
        c = n[0]
    if absolute(n[2]) > absolute(a):
        axis = np.int64(2)
        a = n[2]
        b = n[0]
        c = n[1]
    if a == 0.0:
        return _0
    r = 1.0 / absolute(a)
    side = 2 * axis + (1 if a > 0.0 else 0)
    return (side * CELLS + cell_along(b * r)) * CELLS + cell_along(c * r)


@kernel(outline=True)
def lowest_vertex(model, g, n_G):
    """The vertex (row of model.vertex) of a hull with the least height along n_G; the first of equal ones."""
    first = model.geometry[g, FIRST_VERTEX]
    count = model.geometry[g, NUM_VERTICES]
    k = first
    if count <= ALL_TRIED:
        least = dot3(load3(model.vertex, k), n_G)
        for v in range(first + 1, first + count):
            z = dot3(load3(model.vertex, v), n_G)
            if z < least:
                least = z
                k = v
        return k
    at = model.geometry[g, FIRST_CELL] + cell_of(n_G)
    start = model.topology[at]
    k = model.topology[start]
    least = dot3(load3(model.vertex, k), n_G)
    for e in range(start + 1, model.topology[at + 1]):
        v = model.topology[e]
        z = dot3(load3(model.vertex, v), n_G)
        if z < least:
            least = z
            k = v
    return k


@kernel
def steepest_face(model, v, n_G):
    """Of the faces around a vertex (row of model.vertex) of a hull, the one (row of model.face) most along n_G."""
    place = model.vertex.shape[0] + 1 + v
    best = model.topology[model.topology[place]]
    most = dot3(load3(model.face, best), n_G)
    for k in range(model.topology[place] + 1, model.topology[place + 1]):
        f = model.topology[k]
        along = dot3(load3(model.face, f), n_G)
        if along > most:
            most = along
            best = f
    return best
