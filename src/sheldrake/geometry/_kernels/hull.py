"""Searches among the vertices and faces of a hull."""

from __future__ import annotations

from sheldrake.common._kernels.generic import whole
from sheldrake.common._kernels.vec import dot3
from sheldrake.common.kernel import kernel

from .model import CELLS
from .table import absolute, longest

ALL_TRIED = 8  # of hulls with at most so many vertices each is tried
_LAST = CELLS - 1


@kernel
def cell_along(x):
    """Which of the cells along an edge of a cube; x goes from -1 to 1."""
    k = whole(0.5 * CELLS * (x + 1.0))
    return 0 if k < 0 else (_LAST if k > _LAST else k)


@kernel
def cell_of(n):
    """The cell of a cube around the origin that n goes through; see CELLS."""
    axis, a = longest(n)
    if a == 0.0:
        return 0
    b, c = n[(axis + 1) % 3], n[(axis + 2) % 3]
    r = 1.0 / absolute(a)
    side = 2 * axis + (1 if a > 0.0 else 0)
    return (side * CELLS + cell_along(b * r)) * CELLS + cell_along(c * r)


@kernel(outline=True)
def lowest_vertex(model, g, n_G):
    """The vertex (row of model.vertex) of a hull with the least height along n_G; the first of equal ones."""
    first = model[g].first_vertex
    count = model[g].num_vertices
    k = first
    if count <= ALL_TRIED:
        least = dot3(model.vertices[k].p_GV, n_G)
        for v in range(first + 1, first + count):
            z = dot3(model.vertices[v].p_GV, n_G)
            if z < least:
                least, k = z, v
        return k
    at = model[g].first_cell + cell_of(n_G)
    start = model.topology[at]
    k = model.topology[start]
    least = dot3(model.vertices[k].p_GV, n_G)
    for e in range(start + 1, model.topology[at + 1]):
        v = model.topology[e]
        z = dot3(model.vertices[v].p_GV, n_G)
        if z < least:
            least, k = z, v
    return k


@kernel
def steepest_face(model, v, n_G):
    """Of the faces around a vertex (row of model.vertex) of a hull, the one (row of model.face) most along n_G."""
    place = model.vertex.shape[0] + 1 + v
    best = model.topology[model.topology[place]]
    most = dot3(model.faces[best].normal, n_G)
    for k in range(model.topology[place] + 1, model.topology[place + 1]):
        f = model.topology[k]
        along = dot3(model.faces[f].normal, n_G)
        if along > most:
            most, best = along, f
    return best
