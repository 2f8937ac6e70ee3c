"""What the small systems compute.

One entry kernel each; parameter names say what a row reads, the last parameter is filled.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np

from sheldrake.common._kernels.generic import clip, sin
from sheldrake.common.kernel import IntMatrix, Matrix, Vector, Vectors, kernel
from sheldrake.common.record import Record, integer, number, table


@kernel(top=True)
def copy_input(u: Vectors, out: Vector) -> None:
    """The only input."""
    for i in range(out.shape[0]):
        out[i] = u[0][i]


@kernel(top=True)
def copy_parameter(p: Vector, y: Vector) -> None:
    """The parameters."""
    for i in range(y.shape[0]):
        y[i] = p[i]


@kernel(top=True)
def add(u: Vectors, y: Vector) -> None:
    """Sum of all inputs."""
    for i in range(y.shape[0]):
        y[i] = 0.0
    for k in range(len(u)):
        for i in range(y.shape[0]):
            y[i] += u[k][i]


@kernel(top=True)
def scale(model: Vector, u: Vectors, y: Vector) -> None:
    """Element-wise product of a constant and the input."""
    for i in range(y.shape[0]):
        y[i] = model[i] * u[0][i]


class Limits(NamedTuple):
    """Lower and upper bound of each element."""

    low: Vector
    high: Vector


@kernel(top=True)
def saturate(model: Limits, u: Vectors, y: Vector) -> None:
    """The input, limited element-wise."""
    for i in range(y.shape[0]):
        y[i] = clip(u[0][i], model.low[i], model.high[i])


@kernel(top=True)
def concatenate(u: Vectors, y: Vector) -> None:
    """All inputs, one after the other."""
    at = 0
    for k in range(len(u)):
        n = u[k].shape[0]
        for i in range(n):
            y[at + i] = u[k][i]
        at += n


class Piece(Record):
    """Where a piece of the input is."""

    start = integer("its first element")


@kernel(top=True)
def piece(model: Piece, u: Vectors, y: Vector) -> None:
    """Consecutive elements of the only input."""
    for i in range(y.shape[0]):
        y[i] = u[0][model.start + i]


class Pick(Record):
    """What an element of the output is."""

    port = integer("the input")
    element = integer("of it")


@table
class Picks(NamedTuple):
    """Elements of the inputs."""

    number: Annotated[IntMatrix, Pick]


@kernel(top=True)
def pick(model: Picks, u: Vectors, y: Vector) -> None:
    """Elements of the inputs."""
    for i in range(y.shape[0]):
        y[i] = u[model[i].port][model[i].element]


class WaveOrder(Record):
    """Which derivative."""

    order = number("0: the sines themselves, 1 or 2: their derivatives")


@table
class Waves(NamedTuple):
    """Of each element: amplitude, frequency [rad/s], phase [rad]."""

    amplitude: Vector
    frequency: Vector
    phase: Vector
    number: Annotated[Vector, WaveOrder]


@kernel
def wave(model: Waves, i: int, angle: float) -> float:
    """amplitude sin(angle + phase) or its first or second derivative."""
    a, w = model.amplitude[i], model.frequency[i]
    if model.order == 0.0:
        return a * sin(angle + model.phase[i])
    if model.order == 1.0:
        return a * w * sin(angle + model.phase[i] + 0.5 * np.pi)
    return -a * w * w * sin(angle + model.phase[i])


@kernel(top=True)
def sine_of_time(t: float, wave_model: Waves, y: Vector) -> None:
    """Sines of time."""
    for i in range(y.shape[0]):
        y[i] = wave(wave_model, i, wave_model.frequency[i] * t)


@kernel(top=True)
def sine_of_input(wave_model: Waves, u: Vectors, y: Vector) -> None:
    """Sines of the input."""
    for i in range(y.shape[0]):
        y[i] = wave(wave_model, i, wave_model.frequency[i] * u[0][i])


@kernel(top=True)
def low_pass(model: Vector, xc: Vector, u: Vectors, xdot: Vector) -> None:
    """(u - x) / time constant."""
    for i in range(xdot.shape[0]):
        xdot[i] = (u[0][i] - xc[i]) / model[i]


@kernel(top=True)
def delay(xd: Vector, u: Vectors, x_next: Vector) -> None:
    """Oldest first: everything moves up, the input comes last."""
    n, m = x_next.shape[0], u[0].shape[0]
    for i in range(n - m):
        x_next[i] = xd[i + m]
    for i in range(m):
        x_next[n - m + i] = u[0][i]


@kernel(top=True)
def first_elements(xd: Vector, y: Vector) -> None:
    """The first elements of the discrete state."""
    for i in range(y.shape[0]):
        y[i] = xd[i]


class Affine(NamedTuple):
    """x' = A x + B u + f0, y = C x + D u + y0."""

    A: Matrix
    B: Matrix
    f0: Vector
    C: Matrix
    D: Matrix
    y0: Vector


@kernel
def plus_product(s, M, i, x):
    """s + element i of M x."""
    for j in range(x.shape[0]):
        s += M[i, j] * x[j]
    return s


@kernel
def affine_map(offset, M, x, N, u, out):
    """offset + M x + N u."""
    for i in range(out.shape[0]):
        out[i] = plus_product(plus_product(1.0 * offset[i], M, i, x), N, i, u)


@kernel
def autonomous_map(offset, M, x, out):
    """offset + M x."""
    for i in range(out.shape[0]):
        out[i] = plus_product(1.0 * offset[i], M, i, x)


@kernel(top=True)
def affine_next(model: Affine, xd: Vector, u: Vectors, x_next: Vector) -> None:
    """Next discrete state."""
    affine_map(model.f0, model.A, xd, model.B, u[0], x_next)


@kernel(top=True)
def affine_derivatives(model: Affine, xc: Vector, u: Vectors, xdot: Vector) -> None:
    """Derivatives of continuous state."""
    affine_map(model.f0, model.A, xc, model.B, u[0], xdot)


@kernel(top=True)
def autonomous_next(model: Affine, xd: Vector, x_next: Vector) -> None:
    """Next discrete state, without input."""
    autonomous_map(model.f0, model.A, xd, x_next)


@kernel(top=True)
def autonomous_derivatives(model: Affine, xc: Vector, xdot: Vector) -> None:
    """Derivatives without input."""
    autonomous_map(model.f0, model.A, xc, xdot)


@kernel(top=True)
def affine_output(model: Affine, xc: Vector, xd: Vector, u: Vectors, y: Vector) -> None:
    """Output with feedthrough."""
    if xc.shape[0] > 0:
        affine_map(model.y0, model.C, xc, model.D, u[0], y)
    else:
        affine_map(model.y0, model.C, xd, model.D, u[0], y)


@kernel(top=True)
def affine_output_of_state(model: Affine, xc: Vector, xd: Vector, y: Vector) -> None:
    """Output without feedthrough; a system has one of the two states."""
    if xc.shape[0] > 0:
        autonomous_map(model.y0, model.C, xc, y)
    else:
        autonomous_map(model.y0, model.C, xd, y)


class Step(Record):
    """Of an update."""

    dt = number("time step", "s")


@kernel(top=True)
def euler(step_model: Step, xd: Vector, u: Vectors, x_next: Vector) -> None:
    """x + dt u."""
    for i in range(x_next.shape[0]):
        x_next[i] = xd[i] + step_model.dt * u[0][i]


@kernel(top=True)
def difference_next(xd: Vector, u: Vectors, x_next: Vector) -> None:
    """State: newest input, the one before, and, where it is kept, how many there were."""
    n = u[0].shape[0]
    for i in range(n):
        x_next[i] = u[0][i]
        x_next[n + i] = xd[i]
    if x_next.shape[0] > 2 * n:
        x_next[2 * n] = xd[2 * n] + 1.0


class Difference(Record):
    """Of a discrete derivative."""

    dt = number("time step", "s")
    begins_with_zero = number("1: the first outputs are zero")


@kernel(top=True)
def difference_output(difference_model: Difference, xd: Vector, y: Vector) -> None:
    """(newest - the one before) / dt."""
    n = y.shape[0]
    for i in range(n):
        y[i] = (xd[i] - xd[n + i]) / difference_model.dt
        if difference_model.begins_with_zero != 0.0 and xd[2 * n] < 2.0:
            y[i] = 0.0 * xd[i]


class Interval(Record):
    """Into which an element is wrapped, if low < high."""

    low = number("its beginning")
    high = number("its end")


@table
class Intervals(NamedTuple):
    """Of each element."""

    end: Annotated[Matrix, Interval]


@kernel(top=True)
def wrap(model: Intervals, u: Vectors, y: Vector) -> None:
    """Elements with an interval are wrapped into it."""
    for i in range(y.shape[0]):
        y[i] = u[0][i]
        low, high = model[i].low, model[i].high
        if low < high:
            width = high - low
            y[i] = y[i] - width * np.floor((y[i] - low) / width)
