"""Many worlds: the event loop on one root context after the other, with inputs to give and outputs to keep on the way.

What is called on a world, the event loop or one of the kernels below, gets its words, in which its memory is.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

from sheldrake.common.kernel import IntMatrix, IntVector, Matrix, Vector, kernel
from sheldrake.common.record import Items, Record, integer, integers, table
from sheldrake.common.rows import call_row, prefetch
from sheldrake.systems.framework._kernels.lanes import (
    AT_REST,
    LANES,
    NEXT,
    Lanes,
    bring_constants,
    leave_lanes,
    run_first,
    run_others,
    take_back,
)
from sheldrake.systems.framework._kernels.loop import (
    clear_updates,
    publish,
    set_clocks,
    trigger,
    trigger_nothing,
    update,
)
from sheldrake.systems.framework._kernels.program import (
    AT_START,
    BREAK,
    CONSTANT,
    CONTINUOUS,
    DISCRETE,
    DONE,
    ERROR,
    PER_STEP,
    ROOM,
    SAMPLED,
    UNRESTRICTED,
    Program,
    Run,
    Side,
    call,
    same_number,
)

OPEN = -1
"""Code of a world that is on its way; else it is one of those of `advance`."""
ADVANCE, OUTPUTS, BEGIN, IS_NEXT = range(4)
"""What is called on a world: `loop.advance`, `outputs`, `begin_world`, `lanes.is_next`."""
LINE = 8
"""Numbers in a line of the processor's cache."""
ALONE = 8
"""Steps that worlds take one by one when they did not agree on the first row."""
NOTHING, OF_FIRST_ROW, OF_ALL_ROWS = range(3)
"""What worlds that go together have in lanes alone: what these rows wrote that only others than the step read."""
FEW = 4
"""Steps in which worlds do not try to go together behind the first row, when they did not agree there."""
MANY = 256
"""Steps that worlds take one by one when all four are at rest."""
MOST_AT_REST = 1
"""Of four worlds that go together: where more are at rest, each goes by itself."""


class Where(Record):
    """Where things are in the rows of worlds."""

    width = integer("words of a world")
    until_word = integer("in the words: the time at which `advance` stops, as bits")
    starts = integers(4, "in the words: where those of each callee begin")
    budget = integer("in the sides: steps until `advance` returns")
    steps = integer("in the sides: steps that the world has taken")
    fresh = integer("in the sides: 1 when an advance begins")
    resting = integer("in the sides: which updates would change nothing")
    still = integer("in the sides: the counter behind these updates")
    terminate = integer("in the sides: 1 when somebody asks for the end")


class Part(Record):
    """A part of a slab, or of a side, that a world gets back at a new beginning."""

    begin = integer("first number")
    end = integer("behind the last")


class Progress(Record):
    """How far a world is."""

    code = integer("OPEN, or what ended the rollout")
    sample = integer("how many samples are done")
    under_way = integer("1: it advances to the next one")
    last = integer("what `advance` returned last")


@table
class Worlds(NamedTuple):
    """The memory of all worlds, one row each.

    Attributes:
        slab: slabs, and what else is floating point.
        slab_bits: the same memory.
        side: sides, and what else is int64.
        progress: how far they are.
        words: what the callees are called with.
        bits: `words` once more, as floats.
        callee: addresses of what is called.
        where: where things are.
        first_slab, first_bits, first_side: rows of a world at its beginning.
        part, side_part: what of these a world gets back.
        used: how many lines of a slab steps have written, then where these begin.
        source: where in a slab state, parameters and fixed inputs are, which may be written between two rollouts.
        kept: of worlds at rest at the end of a rollout: the counter `still`, then the bits of these.
    """

    slab: Matrix
    slab_bits: IntMatrix
    side: IntMatrix
    progress: Annotated[IntMatrix, Progress]
    words: IntVector
    bits: Vector
    callee: IntVector
    where: Annotated[IntVector, Where]
    first_slab: Vector
    first_bits: IntVector
    first_side: IntVector
    part: Annotated[IntMatrix, Items("parts", Part)]
    side_part: Annotated[IntMatrix, Items("side_parts", Part)]
    used: IntVector
    source: Annotated[IntMatrix, Items("sources", Part)]
    kept: IntMatrix


@table
class Rollout(NamedTuple):
    """What worlds are to do.

    Attributes:
        who: which worlds.
        time: of each of them a, b, c and d: sample k is at a + b (c + d k) [s].
        state: with which each of them begins anew, continuous and discrete; no rows: they go on from where they are.
        inputs: sample by sample of the first world, then of the next.
        inputs_at: where in the slab they belong.
        outputs: likewise.
        outputs_at: where in the slab they are.
    """

    who: IntVector
    time: Matrix
    state: Matrix
    inputs: Matrix
    inputs_at: IntVector
    outputs: Matrix
    outputs_at: IntVector


@kernel
def rests(worlds, w):
    """Whether updates of a world would change nothing if nobody has written to its arrays."""
    return worlds.side[w, worlds.resting] != 0 and worlds.side[w, worlds.still] == worlds.side[w, SAMPLED]


@kernel
def keep(worlds, w):
    """Keeps what updates read of a world that is at rest, to see later whether somebody has written to it."""
    if rests(worlds, w) and worlds.kept[w, 0] != worlds.side[w, worlds.still]:
        worlds.kept[w, 0] = worlds.side[w, worlds.still]
        at = 1
        for i in range(len(worlds.sources)):
            source = worlds.sources[i]
            for k in range(source.begin, source.end):
                worlds.kept[w, at] = worlds.slab_bits[w, k]
                at += 1


@kernel
def is_as_kept(worlds, w):
    """Whether a world is at rest and has the bits that were kept then."""
    if not rests(worlds, w) or worlds.kept[w, 0] != worlds.side[w, worlds.still]:
        return False
    difference, at = 0, 1
    for i in range(len(worlds.sources)):
        source = worlds.sources[i]
        for k in range(source.begin, source.end):
            difference = difference | (worlds.kept[w, at] ^ worlds.slab_bits[w, k])
            at += 1
    return difference == 0


@kernel
def out_of_date(worlds, w):
    """Whatever is computed in a world: anything may have been written, but where one at rest shows that it was not."""
    first = CONTINUOUS if is_as_kept(worlds, w) else CONSTANT
    for k in range(first, CONTINUOUS + 1):
        worlds.side[w, k] += 1


@kernel
def on_world(worlds, w, callee):
    """Calls one of the callees."""
    at = w * worlds.width + worlds.starts[callee]
    return call_row(worlds.callee, callee, 0.0, worlds.slab, worlds.words, at)


@kernel
def changed_bits(worlds, w, k):
    """Which bits of four numbers of a world are not those of its beginning; 0: all are."""
    x, y = worlds.slab_bits, worlds.first_bits
    return (x[w, k] ^ y[k]) | (x[w, k + 1] ^ y[k + 1]) | (x[w, k + 2] ^ y[k + 2]) | (x[w, k + 3] ^ y[k + 3])


@kernel(outline=True)
def set_back(worlds: Worlds, w: int) -> None:
    """A world as it was at its beginning, but for parameters, fixed inputs and the room of logs, which are empty.

    Most of a slab is room that nobody has used: what has not changed is not written, which would take memory for it.
    """
    for i in range(len(worlds.parts)):
        part = worlds.parts[i]
        k = part.begin
        while k < part.end:
            if k + LINE <= part.end and changed_bits(worlds, w, k) | changed_bits(worlds, w, k + 4) == 0:
                k += LINE
            else:
                worlds.slab[w, k] = worlds.first_slab[k]
                k += 1
    for i in range(len(worlds.side_parts)):
        words = worlds.side_parts[i]
        for k in range(words.begin, words.end):
            worlds.side[w, k] = worlds.first_side[k]
    out_of_date(worlds, w)


@kernel
def put_inputs(worlds, rollout, w, row):
    """Gives a world inputs; whether they have other bits than those it had."""
    others = False
    for i in range(len(rollout.inputs_at)):
        old, new = worlds.slab[w, rollout.inputs_at[i]], rollout.inputs[row, i]
        others = others or not same_number(old, new)
        worlds.slab[w, rollout.inputs_at[i]] = new
    return others


@kernel
def begin_sample(worlds, rollout, w, j, row, sample):
    """Gives a world the inputs of a sample, and the time until which it advances."""
    if put_inputs(worlds, rollout, w, row) or sample == 0:
        out_of_date(worlds, w)
    until = rollout.time[j, 0] + rollout.time[j, 1] * (rollout.time[j, 2] + sample * rollout.time[j, 3])
    worlds.bits[w * worlds.width + worlds.until_word] = until
    worlds.side[w, worlds.fresh] = 1
    worlds.side[w, worlds.terminate] = 0


@kernel(outline=True)
def begin_again(worlds: Worlds, rollout: Rollout, w: int, j: int, row: int) -> int:
    """A new beginning with the state, and the first inputs, of the rollout; DONE or ERROR."""
    set_back(worlds, w)
    for i in range(rollout.state.shape[1]):
        worlds.slab[w, 1 + i] = rollout.state[j, i]
    put_inputs(worlds, rollout, w, row)
    return on_world(worlds, w, BEGIN)


@kernel
def ask_for(worlds, w):
    """Asks for the memory of a world that comes soon: waiting for it then would take as long as half a step."""
    num_lines = 1 if rests(worlds, w) else worlds.used[0]
    for k in range(1, 1 + num_lines):
        prefetch(worlds.slab, w, worlds.used[k])


@kernel
def begin_rollout(worlds, rollout, j, samples):
    """A new beginning for world `who[j]`, if the rollout gives it one and it has not begun."""
    w = rollout.who[j]
    world = worlds[w]
    if world.code == OPEN and world.sample == 0 and world.under_way == 0 and rollout.state.shape[0] > 0:
        code = begin_again(worlds, rollout, w, j, j * samples)
        if code != DONE:
            world.code = code


@kernel
def begin_due_sample(worlds, rollout, j, samples):
    """Gives world `who[j]` the inputs of its next sample, unless it is on the way to it."""
    w = rollout.who[j]
    world = worlds[w]
    if world.under_way == 0:
        begin_sample(worlds, rollout, w, j, j * samples + world.sample, world.sample)
        world.under_way = 1


@kernel(outline=True)
def advance_world(worlds: Worlds, w: int, budget: int) -> int:
    """Advances a world to its next sample, as far as it gets in so many steps; how many it took."""
    before = worlds.side[w, worlds.steps]
    worlds.side[w, worlds.budget] = budget
    world = worlds[w]
    world.last = on_world(worlds, w, ADVANCE)
    return worlds.side[w, worlds.steps] - before


@kernel(outline=True)
def end_advance(worlds: Worlds, rollout: Rollout, j: int, samples: int) -> None:
    """What follows when world `who[j]` has advanced: its outputs, where a sample is done, or its end."""
    w = rollout.who[j]
    world = worlds[w]
    code = world.last
    if code == DONE and len(rollout.outputs_at) > 0:
        code = on_world(worlds, w, OUTPUTS)
        row = j * samples + world.sample
        for i in range(len(rollout.outputs_at)):
            rollout.outputs[row, i] = worlds.slab[w, rollout.outputs_at[i]]
    if code == DONE:
        world.under_way = 0
        world.sample += 1
        if world.sample == samples:
            world.code = DONE
            keep(worlds, w)
    elif code != BREAK:
        world.code = code


@kernel(outline=True)
def go_on(worlds: Worlds, rollout: Rollout, j: int, samples: int, budget: int) -> None:
    """Takes world `who[j]` through its samples, as far as it gets in so many steps."""
    w = rollout.who[j]
    taken = 0
    while worlds[w].code == OPEN and taken < budget:
        begin_due_sample(worlds, rollout, j, samples)
        taken += advance_world(worlds, w, budget - taken)
        end_advance(worlds, rollout, j, samples)


@kernel
def are_open(worlds, rollout, j):
    """Whether all of worlds `who[j:j + 4]` are on their way."""
    for i in range(j, j + LANES):
        if worlds[rollout.who[i]].code != OPEN:
            return False
    return True


@kernel
def ask_what_is_next(worlds, rollout, j):
    """How many of worlds `who[j:j + 4]` do the rows that run in lanes next, and how many are at rest."""
    num_next, num_at_rest = 0, 0
    for i in range(j, j + LANES):
        answer = on_world(worlds, rollout.who[i], IS_NEXT)
        num_next += 1 if answer == NEXT else 0
        num_at_rest += 1 if answer == AT_REST else 0
    return num_next, num_at_rest


@kernel
def wake(worlds, rollout, j):
    """Updates of worlds `who[j:j + 4]` are made, also where they would change nothing."""
    for i in range(j, j + LANES):
        worlds.side[rollout.who[i], worlds.resting] = 0


@kernel
def give_outputs(worlds, rollout, j):
    """Whether one of worlds `who[j:j + 4]` has come to a sample whose outputs are wanted."""
    for i in range(j, j + LANES):
        if worlds[rollout.who[i]].last == DONE and len(rollout.outputs_at) > 0:
            return True
    return False


@kernel
def run_rows(worlds, rollout, first_row, all_rows, j, tries_all):
    """Rows of worlds `who[j:j + 4]` in lanes, all of them if that is tried and they agree; what is left there then."""
    if not run_first(worlds, rollout, first_row, j):
        return NOTHING
    if tries_all and run_others(all_rows):
        leave_lanes(worlds, rollout, all_rows, j)
        return OF_ALL_ROWS
    leave_lanes(worlds, rollout, first_row, j)
    return OF_FIRST_ROW


@kernel(outline=True)
def take_what_is_left(worlds: Worlds, rollout: Rollout, first_row: Lanes, all_rows: Lanes, j: int, left: int) -> None:
    """Takes back what the last step of worlds `who[j:j + 4]` left in lanes alone."""
    if left == OF_FIRST_ROW:
        take_back(worlds, rollout, first_row, j)
    elif left == OF_ALL_ROWS:
        take_back(worlds, rollout, all_rows, j)


@kernel
def go_together(worlds, rollout, first_row, all_rows, j, samples, budget):
    """Takes worlds `who[j:j + 4]` through their samples side by side, until one ends; how many steps.

    All rows are tried in lanes; where worlds do not agree, the first one is done, and for some steps others not tried.
    """
    taken, again = 0, 0
    left = NOTHING
    bring_constants(worlds, rollout, first_row, j)
    while taken < budget and are_open(worlds, rollout, j):
        for i in range(j, j + LANES):
            begin_due_sample(worlds, rollout, i, samples)
        steps = 1
        was_left, left = left, NOTHING
        num_next, num_at_rest = ask_what_is_next(worlds, rollout, j)
        if num_next + num_at_rest == LANES and num_at_rest <= MOST_AT_REST:
            if num_at_rest > 0:
                wake(worlds, rollout, j)  # in lanes there is no way around
            left = run_rows(worlds, rollout, first_row, all_rows, j, taken >= again)
            if left == NOTHING:
                steps = ALONE
            elif left == OF_FIRST_ROW and taken >= again:
                again = taken + FEW
        elif num_at_rest > MOST_AT_REST:
            steps = MANY if num_at_rest == LANES else ALONE
        if left == NOTHING:
            take_what_is_left(worlds, rollout, first_row, all_rows, j, was_left)
        steps = min(steps, budget - taken)
        if steps > 1:
            for i in range(j, j + LANES):
                go_on(worlds, rollout, i, samples, steps)
        else:
            for i in range(j, j + LANES):
                advance_world(worlds, rollout.who[i], 1)
            if left != NOTHING and give_outputs(worlds, rollout, j):
                take_what_is_left(worlds, rollout, first_row, all_rows, j, left)
                left = NOTHING
            for i in range(j, j + LANES):
                end_advance(worlds, rollout, i, samples)
        taken += steps
    take_what_is_left(worlds, rollout, first_row, all_rows, j, left)
    return taken


@kernel(top=True, strict=True, short_loops=True)
def roll_out(
    worlds: Worlds,
    rollout: Rollout,
    first_row: Lanes,
    all_rows: Lanes,
    first: int,
    last: int,
    samples: int,
    budget: int,
) -> int:
    """Takes worlds `who[first:last]` through all samples of the rollout, one world after the other, or four together.

    For each sample a world gets its inputs, advances, and gives its outputs.

    Args:
        first_row: For worlds that take the first row of an update together.
        all_rows: For those that take all of its rows but the last one.
        budget: A world that has taken so many steps is left where it is, still OPEN.

    Returns:
        How many worlds are still OPEN, or have no ROOM in a log.
    """
    left, j = 0, first
    while j < last:
        n = LANES if first_row.num_rows > 0 and j + LANES <= last else 1
        for i in range(j, j + n):
            begin_rollout(worlds, rollout, i, samples)
        for i in range(j + n, min(j + n + n, last)):
            ask_for(worlds, rollout.who[i])
        taken = 0
        if n == LANES:
            taken = go_together(worlds, rollout, first_row, all_rows, j, samples, budget)
        for i in range(j, j + n):
            go_on(worlds, rollout, i, samples, budget - taken)
            code = worlds[rollout.who[i]].code
            if code == OPEN or code == ROOM:
                left += 1
        j += n
    return left


@kernel(top=True, strict=True, short_loops=True)
def call_each(worlds: Worlds, rollout: Rollout, first: int, last: int, callee: int) -> None:
    """Calls OUTPUTS or BEGIN on worlds `who[first:last]`; their codes say how it went: DONE or ERROR."""
    for j in range(first, last):
        w = rollout.who[j]
        out_of_date(worlds, w)
        world = worlds[w]
        world.code = on_world(worlds, w, callee)


@kernel(top=True, strict=True, short_loops=True)
def reset(worlds: Worlds, who: IntVector) -> None:
    """Sets worlds back."""
    for j in range(len(who)):
        set_back(worlds, who[j])


@kernel(top=True, strict=True)
def outputs(program_model: Program, S: Vector, side: Side, rows: IntVector, chain_model: IntVector) -> int:
    """Brings output rows up to date, in this order; DONE or ERROR."""
    program = program_model
    for j in range(1, 1 + chain_model[0]):
        r = chain_model[j]
        if side.word[program.stamps + r] != side.word[program.level[r]]:
            call(program, S, side, rows, r)
            if side.status != 0:
                return ERROR
            side.word[program.stamps + r] = side.word[program.level[r]]
    return DONE


@kernel(top=True, strict=True, short_loops=True)
def begin_world(program_model: Program, run: Run, S: Vector, side: Side, L: Vector, rows: IntVector) -> int:
    """Initialization events, clocks, and what is published at the beginning; DONE or ERROR."""
    program = program_model
    t = S[0]
    trigger_nothing(program, side)
    side.terminate = 0
    side.witnessed = 0
    trigger(program, side, AT_START)
    update(program, run, S, side, L, rows, UNRESTRICTED)
    if side.status == 0:
        update(program, run, S, side, L, rows, DISCRETE)
    if side.status != 0:
        return ERROR
    clear_updates(program, side)
    set_clocks(program, side, t)
    trigger(program, side, PER_STEP)
    publish(program, run, S, side, L, rows)
    if side.status != 0:
        return ERROR
    return DONE
