"""Witness functions that are kernels: the step in which one changes sign is found and shortened without Python.

What the other arrays are says `program`. `WitnessWatch` does the same for witness functions in Python.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

from sheldrake.common._kernels.vec import copy_numbers
from sheldrake.common.kernel import IntVector, Vector, kernel
from sheldrake.common.record import Record, number, table
from sheldrake.common.rows import call_row
from sheldrake.systems.framework._kernels.integrate import Integrator, integrate_until
from sheldrake.systems.framework._kernels.program import CONTINUOUS, Program, Run, Side, changed, inner

# Directions.
NEVER, FALLS, RISES, CROSSES = range(4)


class WatchNumbers(Record):
    """Where a step began, and how exactly it is shortened."""

    t0 = number("beginning of the step", "s")
    window = number("how exactly a change of sign is located; negative: not at all", "s")


@table
class Watch(NamedTuple):
    """Witness functions, and their values at both ends of a step."""

    words: IntVector  # arguments of all witness functions
    at: IntVector  # where those of each begin, and behind them those of the function that finds the window
    direction: IntVector  # of each: FALLS, RISES, CROSSES or NEVER
    triggered: IntVector  # of each: 1 if it triggered in this step
    before: Vector  # values at the beginning of the step
    now: Vector  # values that were computed last
    x0: Vector  # continuous state at the beginning of the step
    number: Annotated[Vector, WatchNumbers]


@inner
def triggers(direction, before, after):
    """Whether a change from one value to the other is one of this direction."""
    if before > 0.0 and after <= 0.0:
        return direction == FALLS or direction == CROSSES
    if before < 0.0 and after >= 0.0:
        return direction == RISES or direction == CROSSES
    return False


@inner
def compute(S, side, watch, own_table):
    """The values at the slab's t and xc."""
    for k in range(len(watch.direction)):
        status = call_row(own_table, k, S[0], S, watch.words, watch.at[k])
        if status != 0:
            side.status = status
            side.row = -1


@inner
def find_triggered(S, side, watch, own_table):
    """Which functions have changed sign since the beginning of the step; whether any has."""
    compute(S, side, watch, own_table)
    found = False
    for k in range(len(watch.direction)):
        watch.triggered[k] = 0
        if side.status == 0 and triggers(watch.direction[k], watch.before[k], watch.now[k]):
            watch.triggered[k] = 1
            found = True
    return found


@inner
def keep_first(watch):
    """Only the first of what triggered stays."""
    found = False
    for k in range(len(watch.direction)):
        if found:
            watch.triggered[k] = 0
        found = found or watch.triggered[k] != 0


@kernel(top=True, strict=True)
def look_before_step(S: Vector, side: Side, program_model: Program, watch: Watch, own_table: IntVector) -> None:
    """Remembers the beginning of a step."""
    program = program_model
    watch.t0 = S[0]
    copy_numbers(watch.x0, 0, S, program.xc, program.num_xc)
    compute(S, side, watch, own_table)
    copy_numbers(watch.before, 0, watch.now, 0, len(watch.direction))


@kernel(top=True, strict=True)
def look_after_step(
    program_model: Program,
    run: Run,
    integrator: Integrator,
    S: Vector,
    side: Side,
    row_table: IntVector,
    watch: Watch,
    own_table: IntVector,
) -> None:
    """Sees what triggered in the step, and goes back to where the first did; a bad status stays in the side.

    The step is halved until it is short. If nothing triggers up to the middle, that is where time goes on, as in Drake.
    """
    program = program_model
    if not find_triggered(S, side, watch, own_table):
        return
    window_row = len(watch.direction)
    side.status = call_row(own_table, window_row, S[0], S, watch.words, watch.at[window_row])
    if side.status != 0:
        side.row = -1
        return
    if watch.window < 0.0:
        keep_first(watch)
        side.witnessed = 1
        return
    a, b = watch.t0, S[0]
    while True:
        c = (a + b) / 2.0
        S[0] = watch.t0
        copy_numbers(S, program.xc, watch.x0, 0, program.num_xc)
        changed(side, CONTINUOUS)
        integrate_until(program, run, integrator, S, side, S, row_table, c)
        if side.status != 0 or not find_triggered(S, side, watch, own_table):
            return
        b = c
        if not b - a > watch.window:
            side.witnessed = 1
            return
