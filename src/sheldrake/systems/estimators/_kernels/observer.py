"""Observers of linear systems: x' = A x + B u + f0 + L (y - C x - D u - y0), or the same for the next x."""

from __future__ import annotations

from typing import NamedTuple

from sheldrake.common.kernel import Matrix, Vector, Vectors, kernel
from sheldrake.systems.primitives._kernels.blocks import Affine, plus_product


class Gain(NamedTuple):
    """L, shape (n, num_outputs)."""

    L: Matrix


class Error(NamedTuple):
    """Scratch: measured less expected outputs."""

    error: Vector


@kernel
def observe(system, gain, x, u, error, out):
    """The motion of the estimate; the inputs are the measured output and, if the system has one, its input."""
    for j in range(error.shape[0]):
        expected = plus_product(1.0 * system.y0[j], system.C, j, x)
        if len(u) > 1:
            expected = plus_product(expected, system.D, j, u[len(u) - 1])
        error[j] = u[0][j] - expected
    for i in range(out.shape[0]):
        motion = plus_product(1.0 * system.f0[i], system.A, i, x)
        if len(u) > 1:
            motion = plus_product(motion, system.B, i, u[len(u) - 1])
        out[i] = plus_product(motion, gain.L, i, error)


@kernel(top=True)
def next_estimate(
    system_model: Affine, gain_model: Gain, xd: Vector, u: Vectors, error: Vector, x_next: Vector
) -> None:
    """Next estimate."""
    observe(system_model, gain_model, xd, u, error, x_next)


@kernel(top=True)
def rate_of_estimate(
    system_model: Affine, gain_model: Gain, xc: Vector, u: Vectors, error: Vector, xdot: Vector
) -> None:
    """Derivative of the estimate."""
    observe(system_model, gain_model, xc, u, error, xdot)
