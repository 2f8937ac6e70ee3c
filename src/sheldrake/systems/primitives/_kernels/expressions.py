"""Expressions of time, state, parameters and input."""

from __future__ import annotations

from sheldrake.common.kernel import Vector, Vectors, kernel
from sheldrake.symbolic._kernels.tape import Tape, evaluate


@kernel
def put(values, numbers, n):
    """Puts values behind the n numbers that are there; how many these are then."""
    for k in range(values.shape[0]):
        numbers[n + k] = values[k]
    return n + values.shape[0]


@kernel
def put_state(t, xc, xd, p, numbers):
    """All variables but those of the input; how many."""
    numbers[0] = t
    n = put(xc, numbers, 1)
    n = put(xd, numbers, n)
    return put(p, numbers, n)


@kernel(top=True, strict=True)
def of_state(t: float, xc: Vector, xd: Vector, p: Vector, tape_model: Tape, work: Vector, out: Vector) -> int:
    """Expressions that do not depend on the input; a status of `evaluate`."""
    put_state(t, xc, xd, p, work)
    return evaluate(tape_model, work, out)


@kernel(top=True, strict=True)
def of_state_and_input(
    t: float, xc: Vector, xd: Vector, p: Vector, u: Vectors, tape_model: Tape, work: Vector, out: Vector
) -> int:
    """Expressions that may depend on the input, of which there is one; a status of `evaluate`."""
    n = put_state(t, xc, xd, p, work)
    put(u[0], work, n)
    return evaluate(tape_model, work, out)
