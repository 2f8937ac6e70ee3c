"""What a run cost, row by row: kernels called again on memory of the run, Python rows as they were timed in it."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sheldrake.common._native.binding import HERE
from sheldrake.systems.framework._declarations import KIND_NAMES, PUBLISH
from sheldrake.systems.framework._kernels import program as _program
from sheldrake.systems.framework._kernels.replay import replay

if TYPE_CHECKING:
    from sheldrake.systems.analysis import Simulator
    from sheldrake.systems.analysis._span import Span
    from sheldrake.systems.framework._context.context import Context
    from sheldrake.systems.framework._engine.layout import Layout
    from sheldrake.systems.framework._engine.store import Store

_PATIENCE = 0.3  # [s] in which each chain of rows is called again, about
_LARGEST = 3e7  # numbers in kept slabs, at most
_SPECIAL = (
    "abstract state",
    "abstract state that is discarded",
    "witnesses before a step",
    "witnesses after a step",
    "monitor",
    "publish of every step",
)
"""Rows of the simulator, in their order; see `loop`."""


class Cost(NamedTuple):
    """What one row cost in a run.

    Attributes:
        system: Path of the system that it belongs to; empty for the simulator's own.
        name: What it does.
        calls: How often it was called.
        each: Time of a call [s].
        kernel: Whether it is machine code.
    """

    system: str
    name: str
    calls: int
    each: float
    kernel: bool


def seconds_in_steps(simulator: Simulator) -> float:
    """Time spent in steps since Initialize(), without the pauses of a real-time rate [s]."""
    return simulator._seconds


def costs_of_run(simulator: Simulator, set_state: Callable[[Any, float], None], times: Sequence[float]) -> list[Cost]:
    """The costs of all that happened in steps since Initialize(), as far as they can be measured.

    The simulator's context is left as it is, and no Python function is called.

    Args:
        simulator: After AdvanceTo().
        set_state: Gives a clone of the simulator's context the state that it had at a time [s].
        times: When kernels are measured [s]: typical of the run. Few are used when steps take long.
    """
    span = simulator._span
    if span is None:
        return []
    calls = _calls(simulator)
    costs = _python_costs(span, calls)
    if span.native:
        root = simulator.get_context().Clone()
        for chain, period in _chains(span.layout, calls):
            slabs = _slabs(root, chain, period, set_state, times)
            costs += _kernel_costs(root._store, chain, calls, np.ascontiguousarray(slabs))
    return costs


# How often.


def _calls(simulator: Simulator) -> dict[int, int]:
    """How often each row was called: as often as the fastest group that calls it."""
    layout, run = simulator._span.layout, simulator._run
    first, last = simulator._time0, float(simulator.get_context()._store.S[0])
    found: dict[int, int] = {}
    for g, (kind, clock, rows, _) in enumerate(layout.group_list):
        if clock >= 0:
            ticks = _ticks(layout.clocks[clock], first, last, kind == PUBLISH)
        elif clock == _program.PER_STEP:
            ticks = int(run.steps) + (kind == PUBLISH)
        else:
            ticks = int(run.evals) if g == len(layout.group_list) - 1 else 0
        for r in (*_prerequisites(layout, g), *rows):
            found[r] = max(found.get(r, 0), ticks)
    return found


def _ticks(clock: tuple[float, float], first: float, last: float, closed: bool) -> int:
    """Ticks of a clock from `first` to `last`; updates that are due at the end are still pending."""
    offset, period = clock
    slack = 1e-9 * period
    end = last + slack if closed else last - slack
    return max(0, math.floor((end - offset) / period) - math.ceil(max(0.0, (first - slack - offset) / period)) + 1)


def _prerequisites(layout: Layout, g: int) -> list[int]:
    P = layout.program
    return [
        r
        for r in P.prerequisites[P.prerequisites_begin[g] : P.prerequisites_begin[g + 1]].tolist()
        if P.level[r] != _program.CONSTANT
    ]


# Python rows.


def _python_costs(span: Span, calls: dict[int, int]) -> list[Cost]:
    costs = []
    num_rows, steps = len(span.layout.rows), int(span.run.steps)
    for r, first in span.first_calls.items():
        seen = len(first.seconds)
        if not seen or r - num_rows == _program.PYTHON_STEP:  # an integrator's steps are made of rows
            continue
        each = float(np.median(first.seconds))
        if r < num_rows:
            if not calls.get(r, 0):
                continue  # of initialization, which is no step
            system, name = _names(span.store, r)
            costs.append(Cost(system, f"{name} in Python", max(calls[r], seen), each, False))
        else:
            costs.append(Cost("", _SPECIAL[r - num_rows], max(seen, steps), each, False))
    return costs


def _names(store: Store, r: int) -> tuple[str, str]:
    """Path of the system and name of row r, or of log -1 - r."""
    layout, systems = store.layout, store.systems
    if r < 0:
        return systems[layout.logs[-1 - r][0]].GetSystemPathname(), "log"
    row = layout.rows[r]
    system = systems[row.node]
    if row.output >= 0:
        name = f"output {system._outputs[row.output].name}"
    elif row.native:
        name = row.calc.__name__.strip("_").replace("_", " ")
    else:
        name = KIND_NAMES[row.kind]
    return system.GetSystemPathname(), name


# Kernels.


def _chains(layout: Layout, calls: dict[int, int]) -> list[tuple[list[int], float]]:
    """Kernels and logs that are called after each other, and the period of their clock or 0 [s].

    What several groups call is in the chain of the one that calls it most.
    """
    chains, seen = [], set()
    groups = list(enumerate(layout.group_list))
    for g, (_, clock, own, _) in sorted(groups, key=lambda one: -max((calls[r] for r in one[1][2]), default=0)):
        rows = (*_prerequisites(layout, g), *own)
        chain = [r for r in rows if r not in seen and calls[r] > 0 and (r < 0 or layout.rows[r].native)]
        seen.update(chain)
        if chain:
            chains.append((chain, layout.clocks[clock][1] if clock >= 0 else 0.0))
    return chains


def _slabs(root: Context, chain: list[int], period: float, set_state: Any, times: Sequence[float]) -> list[np.ndarray]:
    """The slab at these times, each with the memory that the chain left one period before."""
    store = root._store
    kernels = [(r, store.layout.rows[r]) for r in chain if r >= 0]
    found: list[np.ndarray] = []
    seconds = 0.0
    for t in np.random.default_rng(0).permutation(times).tolist():
        set_state(root, t - period)
        begin = time.perf_counter()
        for r, row in kernels:
            store._call_kernel(r, row)
        seconds += time.perf_counter() - begin
        set_state(root, t)
        found.append(store.S.copy())
        if len(found) > 1 and (seconds > _PATIENCE / 3 or len(found) * len(store.S) > _LARGEST):
            break
    return found


def _kernel_costs(store: Store, chain: list[int], calls: dict[int, int], slabs: np.ndarray) -> list[Cost]:
    """Costs of the kernels of a chain: what k + 1 of them take, less what k of them take."""
    P = store.layout.program
    table = np.array([HERE.address(row.calc) if row.native else 0 for row in store.layout.rows], np.int64)
    room = np.zeros(1 + int(max((P.logs[-1 - r].length for r in chain if r < 0), default=0)))
    links, changed = np.array(chain, np.int64), np.zeros(len(store.S), bool)
    everywhere = np.arange(len(store.S))
    for slab in slabs:
        replay.bind(P, store.S, store.side, room, table, everywhere, slab[None], links, len(chain))()
        changed |= (store.S != slab) | (slab != slabs[0])
    changed[0] = True
    (places,) = np.nonzero(changed)  # the less is put back between the runs, the less it is in the way
    kept = np.ascontiguousarray(slabs[:, places])
    bound = replay.bind(P, store.S, store.side, room, table, places, kept, links, 0)
    each = np.maximum(np.diff(_least_times(bound, len(chain))), 0.0) / len(slabs)
    return [Cost(*_names(store, r), calls[r], float(e), True) for r, e in zip(chain, each)]


def _least_times(bound: Any, most: int) -> np.ndarray:
    """The least times that calling 0, 1, ... `most` rows on all slabs takes [s], shape (most + 1,)."""
    least = np.full(most + 1, np.inf)
    rounds, end = 0, time.perf_counter() + _PATIENCE
    while rounds < 3 or (time.perf_counter() < end and rounds < 200):
        for k in range(most + 1):
            bound.set("count", k)
            begin = time.perf_counter()
            bound()
            least[k] = min(least[k], time.perf_counter() - begin)
        rounds += 1
    return np.maximum.accumulate(least)
