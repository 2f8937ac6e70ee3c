"""Searches among the vertices and faces of a hull."""

from __future__ import annotations

import numpy as np

from sheldrake.common._kernels.generic import whole
from sheldrake.common._kernels.vec import dot3, load3, scale3
from sheldrake.common.kernel import kernel

from .model import FIRST_START, FIRST_VERTEX, NUM_VERTICES, START_CELLS
from .table import absolute

LINEAR_SEARCH = 24  # hulls with at most so many vertices are searched one by one
_0 = np.int64(0)
_LAST = START_CELLS - 1


@kernel
def cell_along(x):
    """Which of the cells along an edge of a cube x is in, from -1 to 1."""
    k = whole(0.5 * START_CELLS * (x + 1.0))
    return _0 if k < 0 else (_LAST if k > _LAST else k)


@kernel
def start_cell(d):
    """The cell of a cube around the origin that d goes through; see START_CELLS."""
    axis = _0
    a = d[0]
    b = d[1]
    c = d[2]
    if absolute(d[1]) > absolute(a):
        axis = np.int64(1)
        a = d[1]
        b = d[2]
        c = d[0]
    if absolute(d[2]) > absolute(a):
        axis = np.int64(2)
        a = d[2]
        b = d[0]
        c = d[1]
    if a == 0.0:
        return _0
    side = 2 * axis + (1 if a > 0.0 else 0)
    return (side * START_CELLS + cell_along(b / absolute(a))) * START_CELLS + cell_along(c / absolute(a))


@kernel(outline=True)
def lowest_vertex(model, g, n_G):
    """The vertex (row of model.vertex) of a hull with the least height along n_G.

    Small hulls: the first of equal ones. Large hulls: steepest descent along edges from a vertex that is lowest in
    nearly this direction (exact, because convex).
    """
    first = model.geometry[g, FIRST_VERTEX]
    count = model.geometry[g, NUM_VERTICES]
    k = first
    if count <= LINEAR_SEARCH:
        least = dot3(load3(model.vertex, k), n_G)
        for v in range(first + 1, first + count):
            z = dot3(load3(model.vertex, v), n_G)
            if z < least:
                least = z
                k = v
        return k
    k = model.topology[model.geometry[g, FIRST_START] + start_cell(scale3(n_G, -1.0))]
    least = dot3(load3(model.vertex, k), n_G)
    for _ in range(count):
        best = k
        for e in range(model.topology[k], model.topology[k + 1]):
            v = model.topology[e]
            z = dot3(load3(model.vertex, v), n_G)
            if z < least:
                least = z
                best = v
        if best == k:
            break
        k = best
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
