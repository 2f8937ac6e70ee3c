"""Broad phase for many geometries: those that are close lie in the same or in neighbouring cells of a grid.

A cell is as wide as the largest of the ordinary geometries, so that each only has to look around itself; the few that
are much larger than the others are held against everything. Cells are hashed (Teschner et al. 2003), so space
has no bounds, and filled by counting, so a search costs as many operations as there are geometries and close pairs.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sheldrake.common._kernels.generic import whole
from sheldrake.common.kernel import IntMatrix, IntVector, kernel

from .box_box import box_box_contacts
from .contacts import boxes_apart, ordered, spheres_apart, widest_margin
from .convex import convex_contacts
from .model import (
    BODY,
    BOUND,
    BOX,
    BOXES,
    CAPACITY_EXCEEDED,
    CENTRE_W,
    CONVEX,
    ELLIPSOID,
    HALF_SPACE,
    KIND,
    SPHERE,
    SPHERES,
    ContactTable,
    GeometryModel,
)
from .sphere import sphere_contacts

# Columns of Cells.cell
BUCKET = np.int64(3)  # behind the three numbers of the cell; -1 for what is in no cell

# Columns of Cells.candidate
FIRST = np.int64(0)
SECOND = np.int64(1)
FAMILY = np.int64(2)

PRIMES = (np.int64(73856093), np.int64(19349663), np.int64(83492791))
ORDINARY = 2.5
"""How many times wider than the median a geometry may be and still share the grid."""


class Cells(NamedTuple):
    """Scratch of the broad phase.

    Attributes:
        cell: cell of each geometry and its bucket, shape (num_geometries, 4).
        start: where each bucket begins in `member`, shape (num_buckets + 1,); a power of two buckets.
        member: geometries, bucket after bucket, shape (num_geometries,).
        candidate: close pairs A < B and the family that collides them, shape (capacity, 3).
        count: number of candidates, shape (1,).
    """

    cell: IntMatrix
    start: IntVector
    member: IntVector
    candidate: IntMatrix
    count: IntVector  # type: ignore[assignment]


def make_cells(model: GeometryModel) -> Cells:
    """Scratch for a model; of no size for one whose pairs are all listed."""
    n = len(model.geometry) if len(model.cell) else 0
    buckets = 1 << (2 * n).bit_length() if n else 0
    return Cells(
        np.zeros((n, 4), np.int64),
        np.zeros(buckets + 1, np.int64),
        np.zeros(n, np.int64),
        np.zeros((min(n * (n - 1) // 2, 64 * n), 3), np.int64),
        np.zeros(1, np.int64),
    )


def cell_width(bounds: np.ndarray) -> float:
    """Width of a cell for bounding spheres of these radii [m]: that of the largest one which is not unusually large."""
    finite = bounds[np.isfinite(bounds)]
    return 2.0 * float(finite[finite <= ORDINARY * np.median(finite)].max()) if len(finite) else 1.0


@kernel
def bucket_of(cells, x, y, z):
    return (x * PRIMES[0] ^ y * PRIMES[1] ^ z * PRIMES[2]) & (cells.start.shape[0] - 2)


@kernel
def put_cell(model, table, cells, g):
    """Cell and bucket of a geometry."""
    width = model.cell[0] + widest_margin(model)
    for axis in range(3):
        cells.cell[g, axis] = whole(table.X_WG[g, CENTRE_W + axis] / width)
    if model.geometry[g, KIND] == HALF_SPACE or 2.0 * model.size[g, BOUND] > model.cell[0]:
        cells.cell[g, BUCKET] = -1
    else:
        cells.cell[g, BUCKET] = bucket_of(cells, cells.cell[g, 0], cells.cell[g, 1], cells.cell[g, 2])


@kernel
def fill_buckets(model, table, cells):
    """Counting sort of the geometries by bucket."""
    start = cells.start
    n = model.geometry.shape[0]
    for b in range(start.shape[0]):
        start[b] = 0
    for g in range(n):
        put_cell(model, table, cells, g)
        if cells.cell[g, BUCKET] >= 0:
            start[cells.cell[g, BUCKET]] += 1
    total = np.int64(0)
    for b in range(start.shape[0]):
        total += start[b]
        start[b] = total
    for k in range(n):
        g = n - 1 - k  # backwards, so that a bucket's members are in the order of their numbers
        b = cells.cell[g, BUCKET]
        if b >= 0:
            start[b] -= 1
            cells.member[start[b]] = g


@kernel
def may_touch(model, a, b):
    """Whether geometries a < b are neither of one body nor excluded by a filter."""
    if model.geometry[a, BODY] == model.geometry[b, BODY]:
        return False
    for k in range(model.partner[a], model.partner[a + 1]):
        if model.partner[k] == b:
            return False
    return True


@kernel
def family_of(model, a, b):
    """The family of kernels that collides two geometries that are no half spaces."""
    low = model.geometry[a, KIND]
    high = model.geometry[b, KIND]
    if high < low:
        low, high = high, low
    if low == BOX and high == BOX:
        return BOXES
    if low == SPHERE and high <= ELLIPSOID:
        return SPHERES
    return CONVEX


@kernel
def consider(model, table, cells, g, h):
    """Adds a pair if its bounding spheres meet and it may touch."""
    a = g if g < h else h
    b = h if g < h else g
    if not spheres_apart(model, table, a, b) and may_touch(model, a, b):
        n = cells.count[0]
        if n < cells.candidate.shape[0]:
            cells.candidate[n, FIRST] = a
            cells.candidate[n, SECOND] = b
            cells.candidate[n, FAMILY] = family_of(model, a, b)
            cells.count[0] = n + 1
        else:
            table.count[1] = CAPACITY_EXCEEDED


@kernel
def in_cell(cells, h, x, y, z):
    return cells.cell[h, 0] == x and cells.cell[h, 1] == y and cells.cell[h, 2] == z


@kernel
def look_around(model, table, cells, g):
    """Pairs of g with later members of its cell, and with all of the 13 cells on one side of it."""
    x = cells.cell[g, 0]
    y = cells.cell[g, 1]
    z = cells.cell[g, 2]
    for direction in range(14):  # 0 is the cell itself; 13 + direction counts dx, dy, dz in threes
        code = 13 + direction
        i = x + code // 9 - 1
        j = y + code // 3 % 3 - 1
        k = z + code % 3 - 1
        b = bucket_of(cells, i, j, k)
        for m in range(cells.start[b], cells.start[b + 1]):
            h = cells.member[m]
            if (direction > 0 or h > g) and in_cell(cells, h, i, j, k):
                consider(model, table, cells, g, h)


@kernel(top=True)
def close_pairs(geometry_model: GeometryModel, table: ContactTable, cells: Cells) -> None:
    """Finds the pairs of geometries whose bounding spheres meet; too many are told as too many contacts are."""
    model = geometry_model
    n = model.geometry.shape[0]
    cells.count[0] = 0
    fill_buckets(model, table, cells)
    for g in range(n):
        if cells.cell[g, BUCKET] >= 0:
            look_around(model, table, cells, g)
        elif model.geometry[g, KIND] != HALF_SPACE:
            for h in range(n):
                if model.geometry[h, KIND] != HALF_SPACE and (h > g or cells.cell[h, BUCKET] >= 0):
                    consider(model, table, cells, g, h)


@kernel(top=True)
def close_sphere_pairs(geometry_model: GeometryModel, table: ContactTable, cells: Cells) -> None:
    """`sphere_pairs` of the close pairs."""
    for k in range(cells.count[0]):
        if cells.candidate[k, FAMILY] == SPHERES:
            i, j = ordered(geometry_model, cells.candidate[k, FIRST], cells.candidate[k, SECOND])
            sphere_contacts(geometry_model, table, i, j)


@kernel(top=True)
def close_box_pairs(geometry_model: GeometryModel, table: ContactTable, cells: Cells) -> None:
    """`box_pairs` of the close pairs."""
    for k in range(cells.count[0]):
        if cells.candidate[k, FAMILY] == BOXES:
            i, j = ordered(geometry_model, cells.candidate[k, FIRST], cells.candidate[k, SECOND])
            box_box_contacts(geometry_model, table, i, j)


@kernel(top=True)
def close_convex_pairs(geometry_model: GeometryModel, table: ContactTable, cells: Cells) -> None:
    """`convex_pairs` of the close pairs."""
    for k in range(cells.count[0]):
        if cells.candidate[k, FAMILY] == CONVEX:
            i, j = ordered(geometry_model, cells.candidate[k, FIRST], cells.candidate[k, SECOND])
            if not boxes_apart(geometry_model, table, i, j):
                convex_contacts(geometry_model, table, i, j)
