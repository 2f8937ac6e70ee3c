"""The tables and columns of the event loop, and how it calls rows.

P: the Program, constant tables of one root system. N: int64 settings and counts of one simulator. S: the float64 slab
of one root context, S[0] is time. I: its int64 side. L: its logs. rows: what is called, Python callables or addresses.
Nothing here allocates or raises.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sheldrake.common.kernel import IntMatrix, IntVector, Vector, kernel
from sheldrake.common.rows import call_row

i64 = np.int64
inner = kernel(strict=True)  # no contraction: the bits of the interpreted loop
stage = kernel(outline=True, strict=True)

# I: change counters of the three levels. A counter grows when a source of its level, or of a slower one, changes:
# parameters and fixed inputs; discrete and abstract state; time and continuous state.
CONSTANT, SAMPLED, CONTINUOUS = i64(0), i64(1), i64(2)
STATUS, ROW, TERMINATE, WITNESSED, IDLE, NUM_SIDE = i64(3), i64(4), i64(5), i64(6), i64(7), i64(8)

UNRESTRICTED, DISCRETE, PUBLISH = i64(0), i64(1), i64(2)

# What `advance` returns.
DONE, ERROR, ROOM, BREAK, TERMINATED = i64(0), i64(1), i64(2), i64(3), i64(4)

# P.size
NUM_GROUPS, NUM_CLOCKS, NUM_XC, STAMP0, K0, TRIG0, LOG0, PLUS, XDOT, RK, NUM_ROWS, XC, DERIV, STEADY = (
    i64(0), i64(1), i64(2), i64(3), i64(4), i64(5), i64(6), i64(7), i64(8), i64(9), i64(10), i64(11), i64(12), i64(13),
)  # fmt: skip
# Groups that belong to no clock.
PER_STEP, AT_WITNESS, AT_START = i64(-1), i64(-2), i64(-3)
# Rows after the program's own.
COMMIT, WITNESS_BEFORE, WITNESS_AFTER, MONITOR, EVERY_STEP, PYTHON_STEP = (
    i64(0), i64(1), i64(2), i64(3), i64(4), i64(5),
)  # fmt: skip
NUM_SPECIAL = i64(6)

# N: switches, then counts.
HAS_COMMIT, HAS_WITNESS, HAS_MONITOR, HAS_EVERY_STEP, BUDGET = i64(0), i64(1), i64(2), i64(3), i64(4)
STEPS, PUBLISHES, DISCRETES, UNRESTRICTEDS, MID_STEP = i64(5), i64(6), i64(7), i64(8), i64(9)
FRESH = i64(15)  # an advance begins: what happens in every step is triggered
EVALS, SHRINKS_ERROR, SHRINKS_FAILURE, FAILURES, XC_STEPS = i64(10), i64(11), i64(12), i64(13), i64(14)


class Program(NamedTuple):
    """Constant tables of one root system: rows are what is computed, groups are what happens together."""

    words: IntVector  # arguments of all rows
    at: IntVector  # where each row's arguments begin
    level: IntVector  # how often each row's values can change
    pre: IntVector  # output rows that a group reads, in topological order
    pre_ptr: IntVector
    act: IntVector  # rows that a group calls; -1 - n is log n
    act_ptr: IntVector
    seg: IntMatrix  # state that a group may change: start, length
    seg_ptr: IntVector
    group: IntMatrix  # kind, clock
    clock: Vector  # offset, period of each clock [s]
    log: IntMatrix  # what each log copies: start, length
    size: IntVector


@inner
def changed(I, level):
    """Tells all values that depend on a source of `level` that it changed."""
    for k in range(level, CONTINUOUS + 1):
        I[k] += 1


@inner
def call(P, S, I, rows, r):
    """Calls row r; its status, and its number, stay in I if it failed."""
    status = call_row(rows, r, S[0], S, P.words, P.at[r])
    if status != 0:
        I[STATUS] = status
        I[ROW] = r


@inner
def special(P, S, I, rows, r):
    """Calls one of the simulator's own rows."""
    call(P, S, I, rows, P.size[NUM_ROWS] + r)


@inner
def refresh(P, S, I, rows, g):
    """Brings the output ports that group `g` reads up to date."""
    for j in range(P.pre_ptr[g], P.pre_ptr[g + 1]):
        r = P.pre[j]
        if I[P.size[STAMP0] + r] != I[P.level[r]]:
            call(P, S, I, rows, r)
            if I[STATUS] != 0:
                return
            I[P.size[STAMP0] + r] = I[P.level[r]]


@inner
def fire(P, S, I, L, rows, g):
    """Calls what group `g` does: updates into x+, derivatives, publishes, logs."""
    if I[STATUS] != 0:
        return
    for j in range(P.act_ptr[g], P.act_ptr[g + 1]):
        r = P.act[j]
        if r >= 0:
            call(P, S, I, rows, r)
            if I[STATUS] != 0:
                return
        else:  # a log: append time and value to its record
            s = -1 - r
            b = P.size[LOG0] + 3 * s  # I[b:b+3] = start, capacity, count
            width = P.log[s, 1]
            o = I[b] + I[b + 2] * (width + 1)
            L[o] = S[0]
            for i in range(width):
                L[o + 1 + i] = S[P.log[s, 0] + i]
            I[b + 2] += 1
