"""A function on the points of a grid, linear on simplices between them (Munos and Moore 1998)."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from sheldrake.common.kernel import IntMatrix, IntVector, Matrix, Vector, Vectors, kernel
from sheldrake.common.record import Items, Record, integer, table


class Axis(Record):
    """An input's coordinates on the grid."""

    first = integer("where they begin")
    count = integer("how many")
    stride = integer("how many points the next coordinate is away")


@table
class Mesh(NamedTuple):
    """The grid, and values at its points, a row for each output."""

    axis: Annotated[IntMatrix, Items("axes", Axis)]
    coordinates: Vector
    values: Matrix


class Corners(NamedTuple):
    """Scratch: how far an input is between two coordinates, in ascending order, and its stride."""

    fraction: Vector
    stride: IntVector


@kernel
def first_not_below(coordinates, first, count, x):
    """Number of the first coordinate that is not below x; how many there are if all are."""
    low, high = 0, count
    while low < high:
        middle = (low + high) // 2
        if coordinates[first + middle] < x:
            low = middle + 1
        else:
            high = middle
    return low


@kernel(top=True, strict=True)
def interpolate(mesh_model: Mesh, u: Vectors, fraction: Vector, stride: IntVector, y: Vector) -> None:
    """The function at the only input; outside of the grid at the nearest of its points."""
    top, n = 0, 0
    for k in range(len(mesh_model.axes)):
        axis = mesh_model.axes[k]
        upper = first_not_below(mesh_model.coordinates, axis.first, axis.count, u[0][k])
        top += axis.stride * min(upper, axis.count - 1)
        if upper > 0 and upper < axis.count:
            below = mesh_model.coordinates[axis.first + upper - 1]
            above = mesh_model.coordinates[axis.first + upper]
            part = (u[0][k] - below) / (above - below)
            at = n
            while at > 0 and fraction[at - 1] > part:
                fraction[at], stride[at] = fraction[at - 1], stride[at - 1]
                at -= 1
            fraction[at], stride[at] = part, axis.stride
            n += 1
    for j in range(y.shape[0]):
        point, reached, total = top, 0.0, 0.0
        for k in range(n):
            total += (fraction[k] - reached) * mesh_model.values[j, point]
            reached = fraction[k]
            point -= stride[k]
        y[j] = total + (1.0 - reached) * mesh_model.values[j, point]
