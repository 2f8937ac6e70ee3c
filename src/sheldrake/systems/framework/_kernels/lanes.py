"""Four worlds at once: rows of theirs run in lanes (`common.kernel.LaneKernel`), all else one world after the other.

The rows are the first that an update calls. Before four worlds take a step, what these read of each is brought into a
slab of four worlds, they run there, and what they wrote is taken back: at once what is read in each step, else when the
four worlds part. Each of the worlds finds that the rows have been computed, and goes on behind them. They get the same
bits as alone. Where they would go different ways, nothing is taken back, and each computes the rows itself.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

from sheldrake.common.kernel import IntMatrix, IntVector, Matrix, Vector, kernel
from sheldrake.common.record import Items, Record, integer, integers, table
from sheldrake.common.rows import call_row, into_lanes, out_of_lanes
from sheldrake.systems.framework._kernels.loop import at_rest, num_calls
from sheldrake.systems.framework._kernels.program import (
    CONTINUOUS,
    DISCRETE,
    UNRESTRICTED,
    Program,
    Run,
    Side,
    refresh,
)

LANES = 4
MOST_MISSES = 64
LATER, NEXT, AT_REST = range(3)
"""Of rows that run in lanes: whether a world does them next, or they would change nothing."""


class Piece(Record):
    """Numbers of a slab that lie side by side, or of several rows of a table there."""

    start = integer("where in the slab")
    length = integer("how many")
    stride = integer("from one row of the table to the next")
    rows = integer("where in the slab it says how many rows there are; -1: one")


class Shared(Record):
    """How worlds go together."""

    num_rows = integer("how many rows run in lanes; 0: none")
    reads_begin = integer("of the pieces: what is read in each step; what never changes in a step is before")
    writes_begin = integer("what is written, and read in each step")
    later_begin = integer("what is written, and nobody reads before the four worlds part")
    changes_begin = integer("what the first row wrote and others change")
    end = integer("behind all pieces")
    ends = integers(5, "where pieces of each kind end", same_as=reads_begin)
    copies = integer("in the slab: copies of the latter, behind all else")
    misses = integer("how often in turn worlds did not agree behind the first row, up to `MOST_MISSES`")
    waits = integer("how often that is not tried now")


@table
class Lanes(NamedTuple):
    """What a thread needs to take four worlds at once.

    Attributes:
        slab: a slab of four worlds: in row k, their numbers of place k.
        integer: the same memory.
        piece: what is brought into it, and taken back.
        callee: the addresses of the rows on lanes.
        words: what rows are called with.
        at: where in these those of each row begin.
        stamp: of each row, in the sides: the counter at which it has been computed.
        shared: see there.
    """

    slab: Matrix
    integer: IntMatrix
    piece: Annotated[IntMatrix, Items("pieces", Piece)]
    callee: IntVector
    words: IntVector
    at: IntVector
    stamp: IntVector
    shared: Annotated[IntVector, Shared]


@kernel(top=True, strict=True, short_loops=True)
def is_next(program_model: Program, run: Run, S: Vector, side: Side, rows: IntVector, g: int) -> int:
    """Whether updates of group g are what a world does next; what these read is up to date then.

    Returns:
        LATER, NEXT or AT_REST.
    """
    program = program_model
    if side.status != 0 or side.word[program.triggers + g] == 0:
        return LATER
    if at_rest(program, run, side, UNRESTRICTED) and at_rest(program, run, side, DISCRETE):
        return AT_REST
    for k in range(program.num_groups):
        earlier = program.groups[k].kind < program.groups[g].kind
        if earlier and side.word[program.triggers + k] != 0 and num_calls(program, k) > 0:
            return LATER
    refresh(program, S, side, rows, g)
    return NEXT if side.status == 0 else LATER


@kernel
def copy(worlds, rollout, lanes, j, first, last, into):
    """Brings pieces of worlds `who[j:j + 4]` into lanes, or takes them back."""
    for n in range(first, last):
        piece = lanes.pieces[n]
        begin, length, rows = piece.start, piece.length, 1
        if piece.rows >= 0:
            rows = lanes.integer[piece.rows, 0]
            if piece.stride == length:
                length, rows = length * rows, min(rows, 1)
        for i in range(rows):
            copy_run(worlds, rollout, lanes, j, begin + i * piece.stride, length, into)


@kernel
def copy_run(worlds, rollout, lanes, j, begin, length, into):
    """Numbers that lie side by side."""
    if length >= LANES and into:
        into_lanes(worlds.slab, rollout.who, j, lanes.slab, begin, begin + length)
    elif length >= LANES:
        out_of_lanes(worlds.slab, rollout.who, j, lanes.slab, begin, begin + length)
    else:
        for lane in range(LANES):
            w = rollout.who[j + lane]
            for k in range(begin, begin + length):
                if into:
                    lanes.slab[k, lane] = worlds.slab[w, k]
                else:
                    worlds.slab[w, k] = lanes.slab[k, lane]


@kernel
def bring_constants(worlds, rollout, lanes, j):
    """Brings what never changes of worlds `who[j:j + 4]` into lanes."""
    copy(worlds, rollout, lanes, j, 0, lanes.reads_begin, True)


@kernel
def run_first(worlds, rollout, lanes, j):
    """The first row of worlds `who[j:j + 4]`, in lanes; whether they agreed and nothing was wrong."""
    copy(worlds, rollout, lanes, j, lanes.reads_begin, lanes.writes_begin, True)
    return call_row(lanes.callee, 0, 0.0, lanes.slab, lanes.words, lanes.at[0]) == 0


@kernel
def run_others(lanes):
    """All rows behind the first one likewise; where worlds do not agree, what the first one wrote is left.

    The oftener they did not, the longer that is not tried.
    """
    if lanes.num_rows == 0 or lanes.waits > 0:
        lanes.waits -= min(lanes.waits, 1)
        return False
    copy_changes(lanes, True)
    for k in range(1, lanes.num_rows):
        if call_row(lanes.callee, k, 0.0, lanes.slab, lanes.words, lanes.at[k]) != 0:
            copy_changes(lanes, False)
            lanes.misses = min(lanes.misses + 1, MOST_MISSES)
            lanes.waits = lanes.misses - 1
            return False
    lanes.misses = 0
    return True


@kernel
def copy_changes(lanes, away):
    """Keeps what rows behind the first one change, or puts it back."""
    at = lanes.copies
    for n in range(lanes.changes_begin, lanes.end):
        piece = lanes.pieces[n]
        for k in range(piece.start, piece.start + piece.length):
            source, to = (k, at) if away else (at, k)
            for lane in range(LANES):
                lanes.slab[to, lane] = lanes.slab[source, lane]
            at += 1


@kernel
def leave_lanes(worlds, rollout, lanes, j):
    """Rows are done: worlds `who[j:j + 4]` go on behind them, with what they read there."""
    copy(worlds, rollout, lanes, j, lanes.writes_begin, lanes.later_begin, False)
    for lane in range(LANES):
        w = rollout.who[j + lane]
        for k in range(lanes.num_rows):
            worlds.side[w, lanes.stamp[k]] = worlds.side[w, CONTINUOUS]


@kernel
def take_back(worlds, rollout, lanes, j):
    """What worlds `who[j:j + 4]` have in lanes alone."""
    copy(worlds, rollout, lanes, j, lanes.later_begin, lanes.changes_begin, False)
