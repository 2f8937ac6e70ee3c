"""The tables of the event loop, and how it calls rows.

S is the float64 slab of one root context, S[0] is time; L are its logs; `rows` is what is called, Python callables or
addresses. Nothing here allocates or raises.
"""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from sheldrake.common._kernels.vec import copy_numbers
from sheldrake.common.kernel import IntMatrix, IntVector, Matrix, kernel
from sheldrake.common.record import Items, Record, integer, number, table
from sheldrake.common.rows import call_row

inner = kernel(strict=True)  # no contraction: the bits of the interpreted loop
stage = kernel(outline=True, strict=True)

# Levels of sources. A change counter grows when a source of its level, or of a slower one, changes: parameters and
# fixed inputs; discrete and abstract state; time and continuous state.
CONSTANT, SAMPLED, CONTINUOUS = range(3)
# Kinds of groups.
UNRESTRICTED, DISCRETE, PUBLISH = range(3)
MOST_RESTING = 62
"""Groups with numbers below it have a bit among those that rest."""
# What `advance` returns.
DONE, ERROR, ROOM, BREAK, TERMINATED = range(5)
# Groups that belong to no clock.
PER_STEP, AT_WITNESS, AT_START, AT_REQUEST = -1, -2, -3, -4
# Rows after the program's own.
COMMIT, DISCARD, WITNESS_BEFORE, WITNESS_AFTER, REQUESTS, MONITOR, EVERY_STEP, PYTHON_STEP = range(8)
NUM_SPECIAL = 8


class Segment(Record):
    """State that a group may change."""

    start = integer("where it begins in the slab")
    length = integer("how many numbers")


class Group(Record):
    """What happens together."""

    kind = integer("UNRESTRICTED, DISCRETE, PUBLISH, or that of derivatives")
    clock = integer("that triggers it, or PER_STEP, ...")
    python = integer("1: Python is called for it")
    mixed = integer("1: a kernel or a log comes after Python, which may have written what that reads")
    repeats = integer("1: updates that do the same, and to the scratch, whenever nothing but time has changed")


class Clock(Record):
    """When groups happen."""

    offset = number("first tick", "s")
    period = number("between ticks", "s")


class Turn(Record):
    """A row of a group, in its turn among all rows of the kind: systems in order, and what one system does in order."""

    row = integer("that is called; -1 - n is log n")
    group = integer("that calls it")
    reads_slab = integer("1: a kernel or a log, which finds in the slab what it reads; Python asks for it")


class Log(Record):
    """What a log copies."""

    start = integer("where it begins in the slab")
    length = integer("how many numbers")


class Sizes(Record):
    """How much there is, and where in the slab and in the side."""

    num_groups = integer("but the last, of derivatives")
    num_clocks = integer("that groups have")
    num_xc = integer("continuous state variables")
    stamps = integer("in the side: of each row, the counter of its level when it was computed")
    ticks = integer("in the side: of each clock, how often it has ticked")
    triggers = integer("in the side: of each group, whether it is due")
    samples = integer("in the side: of each log, where it begins in L, its room, its number of samples")
    plus = integer("how far x+ is behind x in the slab")
    xdot = integer("in the slab: time derivatives")
    x0 = integer("in the slab: continuous state at the beginning of a step, then the slopes of its stages")
    num_rows = integer("of the program")
    xc = integer("in the slab: continuous state")
    derivatives = integer("the group of derivatives")
    steady = integer("1 if neither time nor continuous state influences derivatives")


@table
class Program(NamedTuple):
    """Constant tables of one root system: rows are what is computed, groups are what happens together."""

    words: IntVector  # arguments of all rows
    at: IntVector  # where each row's arguments begin
    level: IntVector  # how often each row's values can change
    prerequisites: IntVector  # output rows that a group reads, in topological order
    prerequisites_begin: IntVector  # where those of each group begin
    calls: IntVector  # rows that a group calls; -1 - n is log n
    calls_begin: IntVector  # where those of each group begin
    turn: Annotated[IntMatrix, Items("turns", Turn)]
    turns_begin: IntVector  # where those of each kind begin
    segment: Annotated[IntMatrix, Items("segments", Segment)]
    segments_begin: IntVector  # where those of each group begin
    group: Annotated[IntMatrix, Items("groups", Group)]
    clock: Annotated[Matrix, Items("clocks", Clock)]
    log: Annotated[IntMatrix, Items("logs", Log)]
    size: Annotated[IntVector, Sizes]


class SideWords(Record):
    """The int64 side of a root context; stamps, ticks, triggers, samples and what is fixed follow, see `Sizes`."""

    constant = integer("change counter of this level")
    sampled = integer("change counter of this level")
    continuous = integer("change counter of this level")
    status = integer("of the row that failed, 0 if none did")
    row = integer("that failed")
    terminate = integer("1: somebody asks for the end")
    witnessed = integer("1: a witness function changed sign in this step")
    idle = integer("rows of an update or publish that had nothing to do")


@table
class Side(NamedTuple):
    """What of a root context is int64."""

    word: Annotated[IntVector, SideWords]


class RunWords(Record):
    """Switches, then counts."""

    has_commit = integer("1: there is abstract state")
    has_witness = integer("1: there are witness functions")
    has_requests = integer("1: a system may ask for its events between two ticks")
    has_monitor = integer("1: a monitor is called after each step")
    has_every_step = integer("1: all is published after each step")
    budget = integer("steps until Python looks in")
    steps = integer("of the loop")
    publishes = integer("how often anything was published")
    discretes = integer("discrete updates")
    unrestricteds = integer("unrestricted updates")
    evals = integer("evaluations of derivatives")
    shrinks_error = integer("steps repeated shorter for their error")
    shrinks_failure = integer("steps repeated shorter because they failed")
    failures = integer("steps that failed")
    xc_steps = integer("steps of continuous state")
    fresh = integer("1: an advance begins: what happens in every step is triggered")
    counted = integer("1: between two advances nothing is written without being counted; 0: anything may have been")
    resting = integer("bits of groups: updates that changed nothing when they were made last")
    still = integer("the counter of what is sampled behind these: while it is this, they would change nothing again")


@table
class Run(NamedTuple):
    """Settings and counts of one simulator."""

    word: Annotated[IntVector, RunWords]


@inner
def changed(side, level):
    """Tells all values that depend on a source of `level` that it changed."""
    for k in range(level, CONTINUOUS + 1):
        side.word[k] += 1


@inner
def call(program, S, side, rows, r):
    """Calls row r; its status, and its number, stay in the side if it failed."""
    status = call_row(rows, r, S[0], S, program.words, program.at[r])
    if status != 0:
        side.status = status
        side.row = r


@inner
def special(program, S, side, rows, r):
    """Calls one of the simulator's own rows."""
    call(program, S, side, rows, program.num_rows + r)


@inner
def refresh(program, S, side, rows, g):
    """Brings the output ports that group `g` reads up to date."""
    for j in range(program.prerequisites_begin[g], program.prerequisites_begin[g + 1]):
        r = program.prerequisites[j]
        if side.word[program.stamps + r] != side.word[program.level[r]]:
            call(program, S, side, rows, r)
            if side.status != 0:
                return
            side.word[program.stamps + r] = side.word[program.level[r]]


@inner
def same_number(a, b):
    """Whether two numbers have the same bits; those that are none have not."""
    return a == b and math.copysign(1.0, a) == math.copysign(1.0, b)


@inner
def same(S, at, begin, n):
    """Whether n numbers, from `at` on and from `begin` on, have the same bits."""
    for i in range(n):
        if not same_number(S[at + i], S[begin + i]):
            return False
    return True


@inner
def act(program, S, side, L, rows, r):
    """Calls row r, or appends time and value to a log."""
    if r >= 0:
        if side.word[program.stamps + r] != side.word[CONTINUOUS]:  # else see `lanes`
            call(program, S, side, rows, r)
    else:
        s = -1 - r
        log = program.logs[s]
        b = program.samples + 3 * s  # start, capacity, count
        o = side.word[b] + side.word[b + 2] * (log.length + 1)
        L[o] = S[0]
        copy_numbers(L, o + 1, S, log.start, log.length)
        side.word[b + 2] += 1


@inner
def fire(program, S, side, L, rows, g):
    """Calls what group `g` does: derivatives, or what no other group has a turn in."""
    if side.status != 0:
        return
    for j in range(program.calls_begin[g], program.calls_begin[g + 1]):
        act(program, S, side, L, rows, program.calls[j])
        if side.status != 0:
            return
