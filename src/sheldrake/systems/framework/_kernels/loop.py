"""The event loop: one source, run interpreted or compiled, that knows no system; its tables are those of `program`."""

from __future__ import annotations

import math

import numpy as np

from sheldrake.common._kernels.vec import copy_numbers
from sheldrake.common.kernel import IntVector, Vector, kernel
from sheldrake.systems.framework._kernels.integrate import Integrator, derivatives, integrate, integrate_until
from sheldrake.systems.framework._kernels.program import (
    AT_REQUEST,
    AT_START,
    AT_WITNESS,
    BREAK,
    COMMIT,
    CONTINUOUS,
    DISCARD,
    DISCRETE,
    DONE,
    ERROR,
    EVERY_STEP,
    MONITOR,
    PER_STEP,
    PUBLISH,
    REQUESTS,
    ROOM,
    SAMPLED,
    TERMINATED,
    UNRESTRICTED,
    WITNESS_AFTER,
    WITNESS_BEFORE,
    Program,
    Run,
    Side,
    act,
    changed,
    fire,
    inner,
    refresh,
    same,
    special,
    stage,
)


@inner
def copy_state(program, S, g, source, target):
    """Copies the state that group `g` may change; `source` and `target` are shifts: 0 for x, `plus` for x+."""
    for j in range(program.segments_begin[g], program.segments_begin[g + 1]):
        segment = program.segments[j]
        copy_numbers(S, target + segment.start, S, source + segment.start, segment.length)


@inner
def changes_nothing(program, S, g):
    """Whether x+ of what group `g` may change is x-."""
    for j in range(program.segments_begin[g], program.segments_begin[g + 1]):
        segment = program.segments[j]
        if not same(S, program.plus + segment.start, segment.start, segment.length):
            return False
    return True


@inner
def num_calls(program, g):
    """How many rows group `g` calls."""
    return program.calls_begin[g + 1] - program.calls_begin[g]


@inner
def due(program, side, g, kind):
    """Whether group `g` is of this kind and triggered."""
    return program.groups[g].kind == kind and side.word[program.triggers + g] != 0


@inner
def any_due(program, side, kind):
    """Whether a group of this kind is triggered."""
    for g in range(program.num_groups):
        if due(program, side, g, kind):
            return True
    return False


@inner
def refresh_due(program, S, side, rows, kind):
    """Brings up to date what the triggered groups of a kind read.

    Returns:
        (how many rows they call; the group, if it is the only one and not mixed, else -1).
    """
    n, only = 0, -1
    for g in range(program.num_groups):
        if due(program, side, g, kind) and side.status == 0:
            refresh(program, S, side, rows, g)
            only = g if n == 0 and program.groups[g].mixed == 0 else -1
            n += num_calls(program, g)
    return n, only


@inner
def fire_due(program, S, side, L, rows, kind):
    """Calls what the triggered groups of a kind do, in Drake's order: system by system, whatever has triggered it.

    In a system: what happens at initialization, in every step, by clocks, by witness functions; each as declared.
    """
    known = side.word[CONTINUOUS]
    for j in range(program.turns_begin[kind], program.turns_begin[kind + 1]):
        turn = program.turns[j]
        if side.word[program.triggers + turn.group] != 0:
            if turn.reads_slab != 0 and side.word[CONTINUOUS] != known:  # Python has written something meanwhile
                refresh_due(program, S, side, rows, kind)
                known = side.word[CONTINUOUS]
            if side.status == 0:
                act(program, S, side, L, rows, turn.row)
            if side.status != 0:
                return


@inner
def count_update(run, kind):
    """Counts an update of a kind."""
    if kind == DISCRETE:
        run.discretes += 1
    else:
        run.unrestricteds += 1


@inner
def at_rest(program, run, side, kind):
    """Whether all triggered updates of a kind would change nothing, as they did not when they were made last."""
    if run.still != side.word[SAMPLED]:
        return False
    for g in range(program.num_groups):
        if due(program, side, g, kind) and (run.resting >> g) & 1 == 0:
            return False
    return True


@inner
def one_repeats(program, side, kind):
    """Whether one of the triggered updates of a kind repeats."""
    for g in range(program.num_groups):
        if due(program, side, g, kind) and program.groups[g].repeats != 0:
            return True
    return False


@inner
def change_nothing(program, S, side, kind):
    """Whether triggered updates of a kind, one of which repeats, have made x+ that is x-; Python may have made more.

    What repeats calls Python at most for what it reads, which writes nothing.
    """
    if not one_repeats(program, side, kind):
        return False
    for g in range(program.num_groups):
        if due(program, side, g, kind):
            group = program.groups[g]
            if (group.python != 0 and group.repeats == 0) or not changes_nothing(program, S, g):
                return False
    return True


@inner
def come_to_rest(program, run, side, kind, known):
    """Triggered updates of a kind have changed nothing; `known`: the counter before. Who rests goes on to."""
    if run.has_witness + run.has_requests + run.has_monitor + run.has_every_step != 0:
        return
    resting = int(run.resting) if run.still == known else 0
    for g in range(program.num_groups):
        if due(program, side, g, kind) and program.groups[g].repeats != 0:
            resting = resting | (1 << g)
    run.resting, run.still = resting, side.word[SAMPLED]


@stage
def make_updates(program: Program, run: Run, S: Vector, side: Side, L: Vector, rows: IntVector, kind: int) -> None:
    """All triggered updates of one kind: everybody reads x-, everybody writes x+, one commit."""
    known = int(side.word[SAMPLED])
    n, only = refresh_due(program, S, side, rows, kind)
    if n == 0 or side.status != 0:
        return
    for g in range(program.num_groups):
        if due(program, side, g, kind):
            copy_state(program, S, g, 0, program.plus)
    side.idle = 0
    if only >= 0:
        fire(program, S, side, L, rows, only)
    else:
        fire_due(program, S, side, L, rows, kind)
    if side.status != 0 or side.idle == n:  # one failed, or nobody had anything to do, which Python says: x- stays
        run.resting = 0
        if kind == UNRESTRICTED and run.has_commit != 0:
            special(program, S, side, rows, DISCARD)
        return
    rests = side.word[SAMPLED] == known and change_nothing(program, S, side, kind)
    for g in range(program.num_groups):
        if due(program, side, g, kind):
            copy_state(program, S, g, program.plus, 0)
    changed(side, SAMPLED)
    count_update(run, kind)
    if kind == UNRESTRICTED and run.has_commit != 0:
        special(program, S, side, rows, COMMIT)
    elif rests:
        come_to_rest(program, run, side, kind, known)


@inner
def update(program, run, S, side, L, rows, kind):
    """All triggered updates of one kind, which are only counted where they would change nothing."""
    if program.turns_begin[kind] < program.turns_begin[kind + 1]:
        if not at_rest(program, run, side, kind):
            make_updates(program, run, S, side, L, rows, kind)
        elif any_due(program, side, kind):
            count_update(run, kind)


@stage
def publish(program: Program, run: Run, S: Vector, side: Side, L: Vector, rows: IntVector) -> bool:
    """All triggered publishes; whether Python was called, which may have written anything."""
    n, only = refresh_due(program, S, side, rows, PUBLISH)
    side.idle = 0
    if only >= 0 and side.status == 0:
        fire(program, S, side, L, rows, only)
    elif n > 0 and side.status == 0:
        fire_due(program, S, side, L, rows, PUBLISH)
    if side.status != 0:
        return True
    python = False
    for g in range(program.num_groups):
        if program.groups[g].kind == PUBLISH:
            python = python or (program.groups[g].python != 0 and side.word[program.triggers + g] != 0)
            side.word[program.triggers + g] = 0
    if n > side.idle:
        run.publishes += 1
    return python


@inner
def next_event_time(program, side):
    """Time of the next tick of any clock [s]."""
    t = np.inf
    for c in range(program.num_clocks):
        clock = program.clocks[c]
        t = min(t, clock.offset + side.word[program.ticks + c] * clock.period)
    return t


@inner
def trigger(program, side, clock):
    """Triggers the groups of a clock; `PER_STEP`, `AT_WITNESS`, ... count as clocks."""
    for g in range(program.num_groups):
        if program.groups[g].clock == clock:
            side.word[program.triggers + g] = 1


@inner
def tick(program, side, t):
    """Triggers the groups of all clocks that tick at time t, and sets those clocks to their next tick."""
    for c in range(program.num_clocks):
        clock = program.clocks[c]
        if clock.offset + side.word[program.ticks + c] * clock.period == t:
            trigger(program, side, c)
            side.word[program.ticks + c] += 1


@inner
def clear_updates(program, side):
    """The triggered updates are done."""
    for g in range(program.num_groups):
        if program.groups[g].kind != PUBLISH:
            side.word[program.triggers + g] = 0


@inner
def logs_full(program, side):
    """Whether a log might not hold what the next step can add."""
    for s in range(len(program.logs)):
        b = program.samples + 3 * s
        if side.word[b + 2] + 4 > side.word[b + 1]:
            return True
    return False


@inner
def requested(program, side):
    """Whether a system has asked for its events at this very time."""
    for g in range(program.num_groups):
        if program.groups[g].clock == AT_REQUEST and side.word[program.triggers + g] != 0:
            return True
    return False


@inner
def integrate_step(program, run, integrator, S, side, L, rows, t_event, T):
    """A step of the continuous state, under the eyes of witness functions."""
    if run.has_witness != 0:
        special(program, S, side, rows, WITNESS_BEFORE)
    if side.status == 0:
        integrate(program, run, integrator, S, side, L, rows, t_event, T)
    if side.status == 0 and run.has_witness != 0:
        special(program, S, side, rows, WITNESS_AFTER)


FARTHEST = 2.0**52  # ticks


@inner
def first_tick(clock, t):
    """Number of the first tick of a clock at or after time t [s]."""
    k = max(0, -math.floor((clock.offset - t) / clock.period))
    while k > 0 and clock.offset + (k - 1) * clock.period >= t:
        k -= 1
    while clock.offset + k * clock.period < t:
        k += 1
    return k


@inner
def set_clocks(program, side, t):
    """Sets every clock to its first tick at or after time t [s], and triggers what ticks at t."""
    for c in range(program.num_clocks):
        side.word[program.ticks + c] = first_tick(program.clocks[c], t)
    tick(program, side, t)


@inner
def leap(program, side, t):
    """A callback has set the time to t [s]: every clock goes on with its first tick after it, as in Drake.

    What is no time, or too far for the next tick to be another number, is refused in Python, to which the loop returns.
    """
    for c in range(program.num_clocks):
        clock = program.clocks[c]
        ticks = (t - clock.offset) / clock.period
        if -FARTHEST < ticks and ticks < FARTHEST:
            k = first_tick(clock, t)
            side.word[program.ticks + c] = k + 1 if clock.offset + k * clock.period == t else k


@inner
def trigger_nothing(program, side):
    """Nothing is triggered."""
    for g in range(program.num_groups):
        side.word[program.triggers + g] = 0


@kernel(top=True, strict=True, short_loops=True)
def update_at_start(
    program_model: Program,
    run: Run,
    integrator: Integrator,
    S: Vector,
    side: Side,
    L: Vector,
    rows: IntVector,
) -> None:
    """The updates of initialization. If they end the run, and it goes on nevertheless, clocks tick after its time."""
    program = program_model
    trigger_nothing(program, side)
    trigger(program, side, AT_START)
    update(program, run, S, side, L, rows, UNRESTRICTED)
    if side.status == 0:
        update(program, run, S, side, L, rows, DISCRETE)
    set_clocks(program, side, S[0])
    trigger_nothing(program, side)


@kernel(top=True, strict=True, short_loops=True)
def begin(
    program_model: Program,
    run: Run,
    integrator: Integrator,
    S: Vector,
    side: Side,
    L: Vector,
    rows: IntVector,
    initializes: int,
) -> None:
    """Sets the clocks and publishes what is due at the beginning, what happens at initialization too if wanted."""
    program = program_model
    trigger_nothing(program, side)
    set_clocks(program, side, S[0])
    trigger(program, side, PER_STEP)
    if initializes != 0:
        for g in range(program.num_groups):
            if program.groups[g].clock == AT_START and program.groups[g].kind == PUBLISH:  # updates are done already
                side.word[program.triggers + g] = 1
    publish(program, run, S, side, L, rows)


@kernel(top=True, strict=True, short_loops=True)
def handle_pending(
    program_model: Program,
    run: Run,
    integrator: Integrator,
    S: Vector,
    side: Side,
    L: Vector,
    rows: IntVector,
) -> None:
    """Updates that are triggered, then publishes; time stands still."""
    program = program_model
    trigger(program, side, PER_STEP)
    update(program, run, S, side, L, rows, UNRESTRICTED)
    if side.status == 0:
        update(program, run, S, side, L, rows, DISCRETE)
    if side.status != 0:
        return
    if side.terminate > 1:  # an update asked for what moves memory, which is done behind the publishes
        side.terminate = 0
    if side.terminate == 0:
        clear_updates(program, side)
        run.steps += 1
        publish(program, run, S, side, L, rows)


@kernel(top=True, strict=True, short_loops=True)
def integrate_to(
    program_model: Program,
    run: Run,
    integrator: Integrator,
    S: Vector,
    side: Side,
    L: Vector,
    rows: IntVector,
    T: float,
) -> int:
    """Steps of the continuous state alone until time T [s], whatever happens meanwhile; a status."""
    integrate_until(program_model, run, integrator, S, side, L, rows, T)
    return int(side.status)


@kernel(top=True, strict=True, short_loops=True)
def derivatives_in_step(
    program_model: Program,
    run: Run,
    integrator: Integrator,
    S: Vector,
    side: Side,
    L: Vector,
    rows: IntVector,
    T: float,
) -> int:
    """Time derivatives at time T [s] and the slab's xc; a status."""
    S[0] = T
    derivatives(program_model, run, S, side, L, rows, program_model.xdot)
    return int(side.status)


@kernel(top=True, strict=True, short_loops=True)
def advance(
    program_model: Program,
    run: Run,
    integrator: Integrator,
    S: Vector,
    side: Side,
    L: Vector,
    rows: IntVector,
    T: float,
) -> int:
    """Steps until time T [s], an error, a termination, a full log, or the end of the budget."""
    program = program_model
    if run.fresh != 0:
        trigger(program, side, PER_STEP)
        run.fresh = 0
    if run.counted == 0:
        run.resting = 0
    steps = 0
    t = S[0]
    while True:
        if logs_full(program, side):
            return ROOM
        update(program, run, S, side, L, rows, UNRESTRICTED)
        if side.status != 0:
            return ERROR
        update(program, run, S, side, L, rows, DISCRETE)
        if side.status != 0:
            return ERROR
        if side.terminate != 0:
            return TERMINATED
        clear_updates(program, side)
        t_event = next_event_time(program, side)
        if S[0] != t or t_event < S[0]:  # that may have been before, when events began
            leap(program, side, S[0])
            t_event = next_event_time(program, side)
            if S[0] != t and t == t:  # an update has set it: Python looks whether time can go on from there
                return BREAK
        if run.has_requests != 0:
            special(program, S, side, rows, REQUESTS)
        if side.status == 0 and (run.has_requests == 0 or not requested(program, side)):  # else time stands still
            integrate_step(program, run, integrator, S, side, L, rows, t_event, T)
        if side.status != 0:
            return ERROR
        run.steps += 1
        t = S[0]
        trigger(program, side, PER_STEP)
        if S[0] == t_event:
            tick(program, side, t_event)
        if side.witnessed != 0:
            trigger(program, side, AT_WITNESS)
            side.witnessed = 0
        if publish(program, run, S, side, L, rows):
            run.resting = 0
        if side.status == 0 and run.has_every_step != 0:
            special(program, S, side, rows, EVERY_STEP)
        if side.status == 0 and run.has_monitor != 0:
            special(program, S, side, rows, MONITOR)
        if side.status != 0:
            return ERROR
        is_elsewhere = S[0] != t
        if is_elsewhere:
            leap(program, side, S[0])
            t = S[0]
        if side.terminate != 0:
            return TERMINATED
        if S[0] >= T:
            return DONE
        steps += 1
        if steps >= run.budget or S[0] >= integrator.t_break or is_elsewhere:
            return BREAK
