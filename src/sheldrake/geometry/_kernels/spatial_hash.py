"""Broad phase for many geometries: those that are close lie in the same or in neighbouring cells of a grid.

A cell is as wide as the largest of the ordinary geometries, so that each only has to look around itself; the few that
are much larger than the others are held against everything. Cells are hashed (Teschner et al. 2003), so space
has no bounds, and filled by counting, so a search costs as many operations as there are geometries and close pairs.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np

from sheldrake.common._kernels.generic import whole
from sheldrake.common.kernel import IntMatrix, IntVector, kernel
from sheldrake.common.record import Items, Record, integer, integers, table

from .box_box import box_box_contacts
from .contacts import convex_contacts_if_near, spheres_apart
from .model import (
    BOX,
    BOXES,
    CAPACITY_EXCEEDED,
    CONVEX,
    ELLIPSOID,
    HALF_SPACE,
    SPHERE,
    SPHERES,
    ContactTable,
    GeometryModel,
)
from .near import widest_margin
from .sphere import sphere_contacts
from .table import ordered

PRIMES = (73856093, 19349663, 83492791)
ORDINARY = 2.5
"""How many times wider than the median a geometry may be and still share the grid."""


class Place(Record):
    """Where a geometry is in the grid."""

    xyz = integers(3, "numbers of its cell")
    bucket = integer("of the cell; -1 for what is in no cell")


class ClosePair(Record):
    """Two geometries whose bounding spheres meet, a < b."""

    a = integer("the first")
    b = integer("the second")
    family = integer("that collides them")


class FoundPairs(Record):
    """How the search went."""

    num_pairs = integer("how many were found")


@table
class Cells(NamedTuple):
    """Scratch of the broad phase. `cells[g]` is where geometry g is.

    Attributes:
        start: where each bucket begins in `member`, shape (num_buckets + 1,); a power of two buckets.
        member: geometries, bucket after bucket, shape (num_geometries,).
    """

    cell: Annotated[IntMatrix, Place]
    start: IntVector
    member: IntVector
    candidate: Annotated[IntMatrix, Items("pairs", ClosePair)]
    count: Annotated[IntVector, FoundPairs]  # type: ignore[assignment]


def make_cells(model: GeometryModel) -> Cells:
    """Scratch for a model; of no size for one whose pairs are all listed."""
    n = len(model.geometry) if len(model.cell) else 0
    buckets = 1 << (2 * n).bit_length() if n else 0
    return Cells(
        np.zeros((n, Place.SIZE), np.int64),
        np.zeros(buckets + 1, np.int64),
        np.zeros(n, np.int64),
        np.zeros((min(n * (n - 1) // 2, 64 * n), ClosePair.SIZE), np.int64),
        np.zeros(FoundPairs.SIZE, np.int64),
    )


def median(numbers: np.ndarray) -> float:
    """Median of at least one number: NumPy's own loads masked arrays, which takes longer than a first step."""
    ordered = np.sort(numbers)
    return float(ordered[(len(ordered) - 1) // 2] + ordered[len(ordered) // 2]) / 2.0


def width_of_cells(bounds: np.ndarray) -> float:
    """Width of a cell for bounding spheres of these radii [m]: that of the largest one which is not unusually large."""
    finite = bounds[np.isfinite(bounds)]
    return 2.0 * float(finite[finite <= ORDINARY * median(finite)].max()) if len(finite) else 1.0


@kernel
def bucket_of(cells, x, y, z):
    return (x * PRIMES[0] ^ y * PRIMES[1] ^ z * PRIMES[2]) & (cells.start.shape[0] - 2)


@kernel
def put_cell(model, table, cells, g):
    """Cell and bucket of a geometry."""
    width = model.cell_width + widest_margin(model)
    p = table.poses[g].centre_W
    x, y, z = whole(p[0] / width), whole(p[1] / width), whole(p[2] / width)
    cells[g].xyz = (x, y, z)
    if model[g].kind == HALF_SPACE or 2.0 * model[g].bound > model.cell_width:
        cells[g].bucket = -1
    else:
        cells[g].bucket = bucket_of(cells, x, y, z)


@kernel
def fill_buckets(model, table, cells):
    """Counting sort of the geometries by bucket."""
    start = cells.start
    n = model.geometry.shape[0]
    for b in range(start.shape[0]):
        start[b] = 0
    for g in range(n):
        put_cell(model, table, cells, g)
        if cells[g].bucket >= 0:
            start[cells[g].bucket] += 1
    total = 0
    for b in range(start.shape[0]):
        total += start[b]
        start[b] = total
    for k in range(n):
        g = n - 1 - k  # backwards, so that a bucket's members are in the order of their numbers
        b = cells[g].bucket
        if b >= 0:
            start[b] -= 1
            cells.member[start[b]] = g


@kernel
def may_touch(model, a, b):
    """Whether geometries a < b are neither of one body nor excluded by a filter."""
    if model[a].body == model[b].body:
        return False
    for k in range(model.partner[a], model.partner[a + 1]):
        if model.partner[k] == b:
            return False
    return True


@kernel
def family_of(model, a, b):
    """The family of kernels that collides two geometries that are no half spaces."""
    a, b = ordered(model, a, b)
    low, high = model[a].kind, model[b].kind
    if low == BOX and high == BOX:
        return BOXES
    if low == SPHERE and high <= ELLIPSOID:
        return SPHERES
    return CONVEX


@kernel
def consider(model, table, cells, g, h):
    """Adds a pair if its bounding spheres meet and it may touch."""
    a, b = (g, h) if g < h else (h, g)
    if not spheres_apart(model, table, a, b) and may_touch(model, a, b):
        n = cells.num_pairs
        if n < len(cells.pairs):
            pair = cells.pairs[n]
            pair.a, pair.b, pair.family = a, b, family_of(model, a, b)
            cells.num_pairs = n + 1
        else:
            table.status = CAPACITY_EXCEEDED


@kernel
def look_around(model, table, cells, g):
    """Pairs of g with later members of its cell, and with all of the 13 cells on one side of it."""
    x, y, z = cells[g].xyz
    for code in range(13, 27):  # counts dx, dy, dz in threes; 13 is the cell itself
        i, j, k = x + code // 9 - 1, y + code // 3 % 3 - 1, z + code % 3 - 1
        b = bucket_of(cells, i, j, k)
        for m in range(cells.start[b], cells.start[b + 1]):
            h = cells.member[m]
            u, v, w = cells[h].xyz
            if (code > 13 or h > g) and u == i and v == j and w == k:
                consider(model, table, cells, g, h)


@kernel(top=True)
def close_pairs(geometry_model: GeometryModel, table: ContactTable, cells: Cells) -> None:
    """Finds the pairs of geometries whose bounding spheres meet; too many are told as too many contacts are."""
    model = geometry_model
    n = model.geometry.shape[0]
    cells.num_pairs = 0
    fill_buckets(model, table, cells)
    for g in range(n):
        if cells[g].bucket >= 0:
            look_around(model, table, cells, g)
        elif model[g].kind != HALF_SPACE:
            for h in range(n):
                if model[h].kind != HALF_SPACE and (h > g or cells[h].bucket >= 0):
                    consider(model, table, cells, g, h)


@kernel
def collide_close(model, table, cells, family, contacts):
    """Adds the contacts of the close pairs of a family."""
    for k in range(cells.num_pairs):
        pair = cells.pairs[k]
        if pair.family == family:
            i, j = ordered(model, pair.a, pair.b)
            contacts(model, table, i, j)


@kernel(top=True)
def close_sphere_pairs(geometry_model: GeometryModel, table: ContactTable, cells: Cells) -> None:
    """`sphere_pairs` of the close pairs."""
    collide_close(geometry_model, table, cells, SPHERES, sphere_contacts)


@kernel(top=True)
def close_box_pairs(geometry_model: GeometryModel, table: ContactTable, cells: Cells) -> None:
    """`box_pairs` of the close pairs."""
    collide_close(geometry_model, table, cells, BOXES, box_box_contacts)


@kernel(top=True)
def close_convex_pairs(geometry_model: GeometryModel, table: ContactTable, cells: Cells) -> None:
    """`convex_pairs` of the close pairs."""
    collide_close(geometry_model, table, cells, CONVEX, convex_contacts_if_near)
