"""Trajectories of time: polynomials between breaks, quaternions on great circles."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from sheldrake.common._kernels.generic import acos, sin
from sheldrake.common.kernel import IntVector, Matrix, Vector, Vectors, kernel
from sheldrake.common.record import Record, integer, table

_ALMOST_1 = 1.0 - 2.220446049250313e-16


class Form(Record):
    """Of the polynomials."""

    powers = integer("how many coefficients each has")
    values = integer("how many elements stay as they are outside the breaks; those behind, derivatives, are zero there")


@table
class Pieces(NamedTuple):
    """Polynomials between breaks: elements of a matrix row by row, or of several vectors.

    breaks: times, one more than there are pieces [s].
    c: coefficients of a piece after the other, its lowest power first, shape (pieces powers, size).
    """

    breaks: Vector
    c: Matrix
    form: Annotated[IntVector, Form]


class Turns(NamedTuple):
    """Orientations at breaks.

    breaks: times [s].
    q: quaternions w, x, y, z, each on the side of the one before, shape (num_breaks, 4).
    """

    breaks: Vector
    q: Matrix


@kernel
def piece_at(breaks, t):
    """Number of the piece at a time; the first or the last one's outside."""
    low, high = 0, breaks.shape[0] - 1
    while high - low > 1:
        middle = (low + high) // 2
        if t < breaks[middle]:
            high = middle
        else:
            low = middle
    return low


@kernel
def nearest_inside(breaks, t):
    """The nearest time between the first break and the last."""
    return max(breaks[0], min(t, breaks[breaks.shape[0] - 1]))


@kernel(top=True, strict=True)
def polynomials_of_time(t: float, path_model: Pieces, y: Vector) -> None:
    """Polynomials at a time, by Horner's rule."""
    inside, i = nearest_inside(path_model.breaks, t), piece_at(path_model.breaks, t)
    x, top = inside - path_model.breaks[i], (i + 1) * path_model.powers - 1
    for j in range(y.shape[0]):
        y[j] = path_model.c[top, j]
    for k in range(1, path_model.powers):
        for j in range(y.shape[0]):
            y[j] = y[j] * x + path_model.c[top - k, j]
    if inside != t:
        for j in range(path_model.values, y.shape[0]):
            y[j] = 0.0


@kernel(top=True, strict=True)
def turn_of_time(t: float, turn_model: Turns, y: Vector) -> None:
    """Spherical linear interpolation (Shoemake 1985)."""
    breaks, q = turn_model.breaks, turn_model.q
    i = piece_at(breaks, t)
    fraction = (nearest_inside(breaks, t) - breaks[i]) / (breaks[i + 1] - breaks[i])
    cosine = 0.0
    for j in range(4):
        cosine += q[i, j] * q[i + 1, j]
    weight, other = 1.0 - fraction, fraction
    if cosine < _ALMOST_1:
        angle = acos(cosine)
        scale = sin(angle)
        weight, other = sin((1.0 - fraction) * angle) / scale, sin(fraction * angle) / scale
    for j in range(4):
        y[j] = q[i, j] * weight + q[i + 1, j] * other


@kernel(strict=True)
def element_at(path, top, x, j):
    """Element j of a piece, x after its break, by Horner's rule; `top` is where its highest power is."""
    value = path.c[top, j]
    for k in range(1, path.powers):
        value = value * x + path.c[top - k, j]
    return value


@kernel(strict=True)
def start_of_piece(path, t):
    """Of the piece at a time: where its highest power is, and the time since its break."""
    i = piece_at(path.breaks, t)
    return ((i + 1) * path.powers - 1, nearest_inside(path.breaks, t) - path.breaks[i])


@kernel(strict=True)
def add_vector(path, t, sign, y):
    """Adds a vector's value, times `sign`, to y."""
    top, x = start_of_piece(path, t)
    for j in range(y.shape[0]):
        y[j] += sign * element_at(path, top, x, j)


@kernel(strict=True)
def add_product(path, t, sign, v, y):
    """Adds the product of a matrix's value with v, times `sign`, to y."""
    top, x = start_of_piece(path, t)
    n = v.shape[0]
    for i in range(y.shape[0]):
        total = 0.0
        for j in range(n):
            total += element_at(path, top, x, i * n + j) * v[j]
        y[i] += sign * total


@kernel(strict=True)
def put_affine(t, x, u, by_state, by_input, offset, y):
    """y = M(t) x + N(t) u + b(t)."""
    for i in range(y.shape[0]):
        y[i] = 0.0
    add_vector(offset, t, 1.0, y)
    if x.shape[0] > 0:
        add_product(by_state, t, 1.0, x, y)
    for k in range(len(u)):
        add_product(by_input, t, 1.0, u[k], y)


@kernel(top=True, strict=True)
def affine_in_continuous_state(
    t: float, xc: Vector, u: Vectors, by_state_model: Pieces, by_input_model: Pieces, offset_model: Pieces, y: Vector
) -> None:
    """y = M(t) xc + N(t) u + b(t); there is one input, or none."""
    put_affine(t, xc, u, by_state_model, by_input_model, offset_model, y)


@kernel(top=True, strict=True)
def affine_in_discrete_state(
    t: float, xd: Vector, u: Vectors, by_state_model: Pieces, by_input_model: Pieces, offset_model: Pieces, y: Vector
) -> None:
    """y = M(t) xd + N(t) u + b(t); there is one input, or none."""
    put_affine(t, xd, u, by_state_model, by_input_model, offset_model, y)
