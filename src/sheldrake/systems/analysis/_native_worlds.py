"""Worlds whose systems are all machine code: the event loop runs on one after the other, without Python."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._thread_team import ThreadTeam
from sheldrake.systems.analysis._rollout import RolloutPlan
from sheldrake.systems.framework._engine.layout import Layout
from sheldrake.systems.framework._engine.worlds import Worlds
from sheldrake.systems.framework._kernels import program as _program
from sheldrake.systems.framework._kernels import worlds as tables
from sheldrake.systems.framework._kernels.lanes import LANES, Lanes
from sheldrake.systems.framework._kernels.worlds import Progress

if TYPE_CHECKING:
    from sheldrake.common.kernel import Kernel
    from sheldrake.systems.framework._engine.store import Store

_PARTS = 8  # that each thread takes at least, where all are alike, so that the last one does not let the others wait
_LONG, _SHORT = 0.02, 0.0001  # [s] that a part should take: Ctrl-C waits for it; taking it costs 20 to 30 microseconds


class NativeWorlds:
    """Advances worlds by kernels.

    Args:
        worlds: Their memory.
        team: Threads.
    """

    def __init__(self, worlds: Worlds, team: ThreadTeam):
        self._worlds, self._team = worlds, team
        self._chain = np.zeros(1 + len(worlds.layout.rows), np.int64)
        self._lanes: dict[int, tuple[Lanes, Lanes]] = {}
        self._budget, self._seconds, self._rollouts = 64, 0.0, 0
        worlds.bind(self._chain)

    def roll_out(self, plan: RolloutPlan, count: int, samples: int) -> None:
        """Takes the first `count` worlds of a plan through its samples; their codes say how it went."""
        worlds, team, who = self._worlds, self._team, plan.rollout.who
        worlds.follow_logs()
        self._choose(plan.rows)
        ends = self._ends_of_parts(count)

        def work(thread: int, part: int) -> None:
            bound = self._bound(tables.roll_out, plan, thread, *self._lanes_of(thread))
            first, last = ends[part], ends[part + 1]
            bound.set("first", first)
            bound.set("last", last)
            bound.set("samples", samples)
            begin = before = time.perf_counter()
            while not team.stopped:
                bound.set("budget", self._budget)
                left = bound()
                now = time.perf_counter()
                if not left:
                    break
                self._make_room(plan, first, last, samples)
                is_short = now - before < _LONG / 2
                self._budget = min(2 * self._budget, 1 << 24) if is_short else max(self._budget // 2, 1)
                before = now
            self._seconds = (now - begin) / (last - first)

        self._run(work, len(ends) - 1)
        self._rollouts += 1
        if count and self._rollouts.bit_count() == 1:  # 1, 2, 4 ...: a robot that walks uses more than one that falls
            worlds.look_at_use(int(who[0]))

    def _run(self, work: Callable[[int, int], None], parts: int) -> None:
        """Work for the threads; while it lasts, contexts of worlds are not for others.

        Raises:
            RuntimeError: something is computed in one.
        """
        claimed: list[Store] = []
        try:
            for store in self._worlds.known():
                store.claim("BatchSimulator")
                claimed.append(store)
            self._team.run(work, parts)
        finally:
            for store in reversed(claimed):
                store.release()

    def call_each(self, plan: RolloutPlan, count: int, callee: int) -> None:
        """Begins the first `count` worlds of a plan, or computes its outputs."""
        self._choose(plan.rows)
        size = -(-count // (_PARTS * self._team.num_threads))

        def work(thread: int, part: int) -> None:
            bound = self._bound(tables.call_each, plan, thread)
            bound.set("first", part * size)
            bound.set("last", min((part + 1) * size, count))
            bound.set("callee", callee)
            bound()

        self._run(work, -(-count // size))

    def _choose(self, rows: list[int]) -> None:
        """Output rows that are computed."""
        self._chain[0], self._chain[1 : 1 + len(rows)] = len(rows), rows

    def _bound(self, kernel: Kernel, plan: RolloutPlan, thread: int, *more: Any) -> Any:
        """The kernel's call of a thread on a plan, and on more tables; made once."""
        key = kernel, thread
        if key not in plan.calls:
            given = self._worlds.tables, plan.rollout, *more
            plan.calls[key] = kernel.bind(*given, *[0] * (len(kernel.parameters) - len(given)))
        return plan.calls[key]

    def _lanes_of(self, thread: int) -> tuple[Lanes, Lanes]:
        """Where a thread has four worlds at once."""
        if thread not in self._lanes:
            self._lanes[thread] = self._worlds.lanes()
        return self._lanes[thread]

    def _ends_of_parts(self, count: int) -> list[int]:
        """Where the parts of worlds end that threads take: long ones at first, then shorter and shorter ones.

        So none waits long for the others (guided self-scheduling: Polychronopoulos and Kuck 1987).
        """
        threads = self._team.num_threads
        if count == 1:
            return [0, 1]
        together = LANES if count >= LANES * threads else 1
        least = max(1, int(_SHORT / self._seconds)) if self._seconds > 0.0 else 1
        most = max(1, int(_LONG / self._seconds)) if self._seconds > 0.0 else -(-count // (_PARTS * threads))
        ends = [0]
        while ends[-1] < count:
            left = count - ends[-1]
            share = left if threads == 1 else -(-left // (2 * threads))
            size = -(-min(max(share, least), most) // together) * together
            ends.append(min(ends[-1] + size, count))
        return ends

    def _make_room(self, plan: RolloutPlan, first: int, last: int, samples: int) -> None:
        """Room in logs for those of worlds `who[first:last]` that wait for it, until their last sample."""
        codes = self._worlds.progress[:, Progress.code]
        who = plan.rollout.who[first:last]
        a, b, c, d = plan.rollout.time[first:last].T
        until = a + b * (c + (samples - 1) * d)
        for j in np.flatnonzero(codes[who] == _program.ROOM).tolist():
            self._worlds.make_room(int(who[j]), float(until[j]))
            codes[who[j]] = tables.OPEN


def slow_rows(layout: Layout) -> list[int]:
    """Rows of the event loop, and what they read, that are Python."""
    program = layout.program
    used = {*program.calls.tolist(), *program.prerequisites.tolist()}
    return sorted(r for r in used if r >= 0 and not layout.rows[r].native)
