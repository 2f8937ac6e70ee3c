"""The event loop: one source, run interpreted or compiled, that knows no system.

P: the Program, constant tables of one root system. N: int64 settings and counts of one simulator. Z: the integrator's
numbers. S: the float64 slab of one root context, S[0] is time. I: its int64 side. L: its logs. rows: what is called,
Python callables or addresses. Nothing here allocates or raises.
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
NUM_GROUPS, NUM_CLOCKS, NUM_XC, STAMP0, K0, TRIG0, LOG0, PLUS, XDOT, RK, NUM_ROWS, XC, DERIV = (
    i64(0), i64(1), i64(2), i64(3), i64(4), i64(5), i64(6), i64(7), i64(8), i64(9), i64(10), i64(11), i64(12),
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

# Z
SCHEME, FIXED, H_MAX, ACCURACY, H_INITIAL, H_MIN, H_IDEAL = i64(0), i64(1), i64(2), i64(3), i64(4), i64(5), i64(6)
H_FIRST, H_SMALLEST, H_LARGEST, H_PREVIOUS, AT_MINIMUM, ORDER = i64(7), i64(8), i64(9), i64(10), i64(11), i64(12)
THROW_ON_MIN, T_BREAK = i64(13), i64(14)
H_TRY, H_ERROR = i64(87), i64(88)  # length of a step, which one made in Python may shorten; its error
EULER, RK2, RK3, TABLEAU, PYTHON = i64(1), i64(2), i64(3), i64(4), i64(5)
# A Butcher tableau in Z: number of stages, nodes, rows of coefficients, weights, weights minus those of lower order.
STAGES, NODES, ROWS, WEIGHTS, ERRORS, WIDTH, NUM_Z = i64(16), i64(17), i64(24), i64(73), i64(80), i64(7), i64(89)

MIN_STEP_STATUS = i64(-1001)


class Program(NamedTuple):
    """Constant tables of one root system: rows are what is computed, groups are what happens together."""

    words: IntVector  # arguments of all rows
    at: IntVector  # where each row's arguments begin
    level: IntVector  # how often each output row can change
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
def derivatives(P, N, S, I, L, rows, out):
    """Time derivatives at the slab's t and xc, copied to S[out:]."""
    changed(I, CONTINUOUS)
    N[EVALS] += 1
    refresh(P, S, I, rows, P.size[DERIV])
    fire(P, S, I, L, rows, P.size[DERIV])
    for i in range(P.size[NUM_XC]):
        S[out + i] = S[P.size[XDOT] + i]


@inner
def set_back(P, S, I, t):
    """Back to the state at the beginning of the step."""
    S[0] = t
    for i in range(P.size[NUM_XC]):
        S[P.size[XC] + i] = S[P.size[RK] + i]
    changed(I, CONTINUOUS)


@inner
def combine(P, Z, S, h, first, count, out):
    """x0 + h (coefficients Z[first:first + count] times the stages so far), into S[out:]."""
    n, x0 = P.size[NUM_XC], P.size[RK]
    for i in range(n):
        S[out + i] = 1.0 * S[x0 + i]
    for k in range(count):
        c = h * Z[first + k]
        if c != 0.0:
            for i in range(n):
                S[out + i] = S[out + i] + c * S[x0 + (k + 1) * n + i]


@stage
def tableau_step(
    P: Program, N: IntVector, Z: Vector, S: Vector, I: IntVector, L: Vector, rows: IntVector, h: float
) -> float:
    """One step by the tableau in Z; x0 is in place. Gives the norm of the error estimate."""
    n, x0, xc = P.size[NUM_XC], P.size[RK], P.size[XC]
    t = S[0]
    stages = int(Z[STAGES])
    for s in range(stages):
        if s > 0:
            S[0] = t + h * Z[NODES + s]
            combine(P, Z, S, h, ROWS + s * WIDTH, s, xc)
        derivatives(P, N, S, I, L, rows, x0 + (s + 1) * n)
        if I[STATUS] != 0:
            return 0.0
    combine(P, Z, S, h, WEIGHTS, stages, xc)
    error = 0.0
    for i in range(n):
        e = 0.0
        for s in range(stages):
            e = e + h * Z[ERRORS + s] * S[x0 + (s + 1) * n + i]
        if not abs(e) <= error:
            error = abs(e)
    return error


@stage
def explicit_step(
    P: Program, N: IntVector, Z: Vector, S: Vector, I: IntVector, L: Vector, rows: IntVector, h: float
) -> float:
    """One step of length h [s]: explicit Euler, Runge-Kutta 2 (Heun), 3, or by a tableau.

    Gives the norm of the error estimate. Memory at S[RK:]: x0, then the stages. On a bad status the state is what it
    was.
    """
    n, x0, xc = P.size[NUM_XC], P.size[RK], P.size[XC]
    k1, k2, k3 = x0 + n, x0 + 2 * n, x0 + 3 * n
    t, error = S[0], 0.0
    Z[H_TRY] = h
    for i in range(n):
        S[x0 + i] = S[xc + i]
    if Z[SCHEME] == TABLEAU:
        error = tableau_step(P, N, Z, S, I, L, rows, h)
    elif Z[SCHEME] == PYTHON:
        special(P, S, I, rows, PYTHON_STEP)
        h, error = Z[H_TRY], Z[H_ERROR]
    else:
        derivatives(P, N, S, I, L, rows, k1)
    if I[STATUS] == 0 and Z[SCHEME] < TABLEAU:
        if Z[SCHEME] == EULER:
            for i in range(n):
                S[xc + i] = S[x0 + i] + h * S[k1 + i]
        elif Z[SCHEME] == RK2:
            for i in range(n):
                S[xc + i] = S[x0 + i] + h * S[k1 + i]
            S[0] = t + h
            derivatives(P, N, S, I, L, rows, k2)
            for i in range(n):
                S[xc + i] = S[xc + i] + h * 0.5 * S[k2 + i] - h * 0.5 * S[k1 + i]
        else:
            for i in range(n):
                S[xc + i] = S[x0 + i] + h * 0.5 * S[k1 + i]
            S[0] = t + h * 0.5
            derivatives(P, N, S, I, L, rows, k2)
            if I[STATUS] == 0:
                for i in range(n):
                    S[xc + i] = S[x0 + i] - h * S[k1 + i] + 2.0 * h * S[k2 + i]
                S[0] = t + h
                derivatives(P, N, S, I, L, rows, k3)
                for i in range(n):
                    S[xc + i] = (
                        S[x0 + i]
                        + h * (1.0 / 6.0) * S[k1 + i]
                        + h * (2.0 / 3.0) * S[k2 + i]
                        + h * (1.0 / 6.0) * S[k3 + i]
                    )
                    e = abs(S[xc + i] - S[x0 + i] - h * S[k2 + i])
                    if not e <= error:
                        error = e
    if I[STATUS] != 0:
        set_back(P, S, I, t)
    else:
        S[0] = t + h
        changed(I, CONTINUOUS)
    return error


@inner
def next_step_size(Z, h, error):
    """The step to try next: larger than h if the error allows, smaller if it must be repeated."""
    if not error < np.inf:  # also not a number
        h_new = 0.1 * h
    elif error == 0.0:
        h_new = 5.0 * h
    else:
        h_new = 0.9 * h * (Z[ACCURACY] / error) ** (1.0 / Z[ORDER])
    if h_new > h:
        if h_new < 1.2 * h:
            h_new = h
    elif h_new < h:
        h_new = h if error <= Z[ACCURACY] else min(h_new, 0.9 * h)
    return min(max(min(h_new, 5.0 * h), 0.1 * h), Z[H_MAX])


@stage
def controlled_step(
    P: Program, N: IntVector, Z: Vector, S: Vector, I: IntVector, L: Vector, rows: IntVector, h_most: float
) -> None:
    """One step of at most h_most [s], repeated smaller until it is accurate; Z[H_TRY] is its length."""
    t = S[0]
    h = Z[H_IDEAL] if Z[H_IDEAL] > 0.0 else Z[H_INITIAL]
    while True:
        limited = 0
        if h_most < 0.95 * h:
            limited = 1
            h = h_most
        elif h_most < 1.001 * h:
            h = h_most
        h = min(h, Z[H_MAX])
        error = explicit_step(P, N, Z, S, I, L, rows, h)
        if I[STATUS] != 0:
            return
        h = Z[H_TRY]
        h_new = next_step_size(Z, h, error)
        h_min = max(Z[H_MIN], 1e-14 * max(1.0, abs(t)))
        accepted = h_new >= h
        if h_new < h_min:
            if Z[THROW_ON_MIN] != 0.0 and not accepted:
                set_back(P, S, I, t)
                I[STATUS] = MIN_STEP_STATUS
                I[ROW] = -1
                return
            accepted = accepted or h <= h_min
            h_new = h_min
        if accepted:
            if limited == 0:
                Z[H_IDEAL] = h_new
            if not Z[H_FIRST] > 0.0:
                Z[H_FIRST] = h
            if not Z[H_SMALLEST] > 0.0 or (h < Z[H_SMALLEST] and h < h_most):
                Z[H_SMALLEST] = h
            return
        N[SHRINKS_ERROR] += 1
        set_back(P, S, I, t)
        h = h_new


@stage
def integrate(
    P: Program, N: IntVector, Z: Vector, S: Vector, I: IntVector, L: Vector, rows: IntVector, t_event: float, T: float
) -> None:
    """One step of the continuous state, to the next event or the boundary T at most; moves time."""
    t_target = min(t_event, T)
    if P.size[NUM_XC] == 0:
        S[0] = t_target
        changed(I, CONTINUOUS)
        return
    t = S[0]
    boundary = T < t_event
    if (boundary and t + Z[H_MAX] < t_target) or (not boundary and t + Z[H_MAX] * 1.01 < t_target):
        t_target = t + Z[H_MAX]
    if Z[FIXED] != 0.0:
        explicit_step(P, N, Z, S, I, L, rows, t_target - t)
    else:
        controlled_step(P, N, Z, S, I, L, rows, t_target - t)
    full = Z[H_TRY] == t_target - t
    if I[STATUS] != 0:
        return
    N[XC_STEPS] += 1
    h = S[0] - t
    if not Z[H_LARGEST] >= h:
        Z[H_LARGEST] = h
    Z[H_PREVIOUS] = h
    if full or S[0] >= t_target:
        S[0] = t_target
        changed(I, CONTINUOUS)


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


@kernel(top=True, strict=True)
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
