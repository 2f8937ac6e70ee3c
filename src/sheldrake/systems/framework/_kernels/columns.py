"""Derivatives and updates at many states: the rows of one group, called on one slab state after state."""

from __future__ import annotations

from sheldrake.common.kernel import IntVector, Matrix, Vector, kernel
from sheldrake.systems.framework._kernels.integrate import derivatives
from sheldrake.systems.framework._kernels.loop import copy_state
from sheldrake.systems.framework._kernels.program import (
    CONSTANT,
    CONTINUOUS,
    Program,
    Run,
    Side,
    changed,
    fire,
    inner,
    refresh,
)


@inner
def take(S, side, inputs, inputs_at, j):
    """Inputs of row j."""
    for i in range(len(inputs_at)):
        S[inputs_at[i]] = inputs[j, i]
    changed(side, CONSTANT)


@kernel(top=True, strict=True, short_loops=True)
def derivatives_at(
    program_model: Program,
    run: Run,
    S: Vector,
    side: Side,
    L: Vector,
    rows: IntVector,
    times: Vector,
    states: Matrix,
    inputs: Matrix,
    inputs_at: IntVector,
    found: Matrix,
    first: int,
    last: int,
) -> int:
    """Time derivatives at rows `first` to `last` of times, continuous states and inputs; a bad status ends it."""
    program = program_model
    for j in range(first, last):
        S[0] = times[j]
        for i in range(program.num_xc):
            S[program.xc + i] = states[j, i]
        take(S, side, inputs, inputs_at, j)
        derivatives(program, run, S, side, L, rows, program.xdot)
        if side.status != 0:
            return 1
        for i in range(program.num_xc):
            found[j, i] = S[program.xdot + i]
    return 0


@kernel(top=True, strict=True, short_loops=True)
def updates_at(
    program_model: Program,
    S: Vector,
    side: Side,
    L: Vector,
    rows: IntVector,
    times: Vector,
    states: Matrix,
    inputs: Matrix,
    inputs_at: IntVector,
    found: Matrix,
    xd: int,
    group: int,
    num_steps: int,
    period: float,
    first: int,
    last: int,
) -> int:
    """Discrete states, at S[xd:], after some updates by a group, `period` [s] apart; else as `derivatives_at`."""
    program = program_model
    for j in range(first, last):
        for i in range(states.shape[1]):
            S[xd + i] = states[j, i]
        take(S, side, inputs, inputs_at, j)
        for step in range(num_steps):
            S[0] = times[j] + step * period
            changed(side, CONTINUOUS)
            refresh(program, S, side, rows, group)
            copy_state(program, S, group, 0, program.plus)
            if side.status == 0:
                fire(program, S, side, L, rows, group)
            if side.status != 0:
                return 1
            copy_state(program, S, group, program.plus, 0)
            changed(side, CONSTANT)
        for i in range(states.shape[1]):
            found[j, i] = S[xd + i]
    return 0
