"""The event loop: one source, run interpreted or compiled, that knows no system.

What the letters stand for says `program`; Z is the integrator's (see `integrate`).
"""

from __future__ import annotations

import numpy as np

from sheldrake.common.kernel import IntVector, Vector, kernel
from sheldrake.systems.framework._kernels.integrate import T_BREAK, integrate
from sheldrake.systems.framework._kernels.program import (
    AT_WITNESS,
    BREAK,
    BUDGET,
    COMMIT,
    DISCRETE,
    DISCRETES,
    DONE,
    ERROR,
    EVERY_STEP,
    FRESH,
    HAS_COMMIT,
    HAS_EVERY_STEP,
    HAS_MONITOR,
    HAS_WITNESS,
    IDLE,
    K0,
    LOG0,
    MONITOR,
    NUM_CLOCKS,
    NUM_GROUPS,
    PER_STEP,
    PLUS,
    PUBLISH,
    PUBLISHES,
    ROOM,
    SAMPLED,
    STATUS,
    STEPS,
    TERMINATE,
    TERMINATED,
    TRIG0,
    UNRESTRICTED,
    UNRESTRICTEDS,
    WITNESS_AFTER,
    WITNESS_BEFORE,
    WITNESSED,
    Program,
    changed,
    fire,
    i64,
    inner,
    refresh,
    special,
    stage,
)


@inner
def copy_state(P, S, g, source, target):
    """Copies the state that group `g` may change; `source` and `target` are shifts: 0 for x, PLUS for x+."""
    for j in range(P.seg_ptr[g], P.seg_ptr[g + 1]):
        for i in range(P.seg[j, 0], P.seg[j, 0] + P.seg[j, 1]):
            S[target + i] = S[source + i]


@inner
def num_calls(P, g):
    """How many rows group `g` calls."""
    return P.act_ptr[g + 1] - P.act_ptr[g]


@inner
def due(P, I, g, kind):
    """Whether group `g` is of this kind and triggered."""
    return P.group[g, 0] == kind and I[P.size[TRIG0] + g] != 0


@stage
def update(P: Program, N: IntVector, S: Vector, I: IntVector, L: Vector, rows: IntVector, kind: int) -> None:
    """All triggered updates of one kind: everybody reads x-, everybody writes x+, one commit."""
    n = 0
    for g in range(P.size[NUM_GROUPS]):
        if due(P, I, g, kind):
            refresh(P, S, I, rows, g)
            copy_state(P, S, g, i64(0), P.size[PLUS])
            n += num_calls(P, g)
    if n == 0 or I[STATUS] != 0:
        return
    I[IDLE] = 0
    for g in range(P.size[NUM_GROUPS]):
        if due(P, I, g, kind):
            fire(P, S, I, L, rows, g)
            if I[STATUS] != 0:
                return  # nothing committed: the context keeps the last good state
    if I[IDLE] == n:
        return  # nobody had anything to do
    for g in range(P.size[NUM_GROUPS]):
        if due(P, I, g, kind):
            copy_state(P, S, g, P.size[PLUS], i64(0))
    changed(I, SAMPLED)
    N[DISCRETES if kind == DISCRETE else UNRESTRICTEDS] += 1
    if kind == UNRESTRICTED and N[HAS_COMMIT] != 0:
        special(P, S, I, rows, COMMIT)


@stage
def publish(P: Program, N: IntVector, S: Vector, I: IntVector, L: Vector, rows: IntVector) -> None:
    """All triggered publishes."""
    n = 0
    I[IDLE] = 0
    for g in range(P.size[NUM_GROUPS]):
        if due(P, I, g, PUBLISH):
            refresh(P, S, I, rows, g)
            fire(P, S, I, L, rows, g)
            if I[STATUS] != 0:
                return
            I[P.size[TRIG0] + g] = 0
            n += num_calls(P, g)
    if n > I[IDLE]:
        N[PUBLISHES] += 1


@inner
def next_event_time(P, I):
    """Time of the next tick of any clock [s]."""
    t = np.inf
    for c in range(P.size[NUM_CLOCKS]):
        t = min(t, P.clock[2 * c] + I[P.size[K0] + c] * P.clock[2 * c + 1])
    return t


@inner
def trigger(P, I, clock):
    """Triggers the groups of a clock; `PER_STEP`, `AT_WITNESS`, `AT_START` count as clocks."""
    for g in range(P.size[NUM_GROUPS]):
        if P.group[g, 1] == clock:
            I[P.size[TRIG0] + g] = 1


@inner
def tick(P, I, t):
    """Triggers the groups of all clocks that tick at time t, and sets those clocks to their next tick."""
    for c in range(P.size[NUM_CLOCKS]):
        if P.clock[2 * c] + I[P.size[K0] + c] * P.clock[2 * c + 1] == t:
            trigger(P, I, i64(c))
            I[P.size[K0] + c] += 1


@inner
def clear_updates(P, I):
    """The triggered updates are done."""
    for g in range(P.size[NUM_GROUPS]):
        if P.group[g, 0] != PUBLISH:
            I[P.size[TRIG0] + g] = 0


@inner
def logs_full(P, I):
    """Whether a log might not hold what the next step can add."""
    for s in range(P.log.shape[0]):
        b = P.size[LOG0] + 3 * s
        if I[b + 2] + 4 > I[b + 1]:
            return True
    return False


@kernel(top=True, strict=True, short_loops=True)
def advance(
    program_model: Program,
    N: IntVector,
    Z: Vector,
    S: Vector,
    I: IntVector,
    L: Vector,
    rows: IntVector,
    T: float,
) -> int:
    """Steps until time T [s], an error, a termination, a full log, or the end of the budget."""
    P = program_model
    if N[FRESH] != 0:
        trigger(P, I, PER_STEP)
        N[FRESH] = 0
    steps = 0
    while True:
        if logs_full(P, I):
            return ROOM
        update(P, N, S, I, L, rows, UNRESTRICTED)
        if I[STATUS] != 0:
            return ERROR
        update(P, N, S, I, L, rows, DISCRETE)
        if I[STATUS] != 0:
            return ERROR
        if I[TERMINATE] != 0:
            return TERMINATED
        clear_updates(P, I)
        t_event = next_event_time(P, I)
        if N[HAS_WITNESS] != 0:
            special(P, S, I, rows, WITNESS_BEFORE)
        if I[STATUS] == 0:
            integrate(P, N, Z, S, I, L, rows, t_event, T)
        if I[STATUS] == 0 and N[HAS_WITNESS] != 0:
            special(P, S, I, rows, WITNESS_AFTER)
        if I[STATUS] != 0:
            return ERROR
        N[STEPS] += 1
        trigger(P, I, PER_STEP)
        if S[0] == t_event:
            tick(P, I, t_event)
        if I[WITNESSED] != 0:
            trigger(P, I, AT_WITNESS)
            I[WITNESSED] = 0
        publish(P, N, S, I, L, rows)
        if I[STATUS] == 0 and N[HAS_EVERY_STEP] != 0:
            special(P, S, I, rows, EVERY_STEP)
        if I[STATUS] == 0 and N[HAS_MONITOR] != 0:
            special(P, S, I, rows, MONITOR)
        if I[STATUS] != 0:
            return ERROR
        if I[TERMINATE] != 0:
            return TERMINATED
        if S[0] >= T:
            return DONE
        steps += 1
        if steps >= N[BUDGET] or S[0] >= Z[T_BREAK]:
            return BREAK
