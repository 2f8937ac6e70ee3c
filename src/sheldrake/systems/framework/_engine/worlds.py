"""Memory of many root contexts of one system: all slabs are rows of one array, and so are all sides.

Kernels are called on a world with its words, which say where its memory is; what they need is the same in all worlds
but for addresses. Contexts are made when somebody asks for them: they are views of the rows.
"""

from __future__ import annotations

import operator
from typing import Any

import numpy as np

from sheldrake.common._native.binding import HERE, arguments, join
from sheldrake.common.kernel import jit_enabled
from sheldrake.systems.framework._engine import logs
from sheldrake.systems.framework._engine.lanes import LaneRows, blank, lane_rows_of, make_lanes, no_lanes, pieces_used
from sheldrake.systems.framework._engine.store import Store
from sheldrake.systems.framework._kernels import lanes, loop
from sheldrake.systems.framework._kernels import worlds as tables
from sheldrake.systems.framework._kernels.integrate import Integrator
from sheldrake.systems.framework._kernels.program import CONTINUOUS, Run, RunWords, Side, SideWords
from sheldrake.systems.framework._kernels.worlds import Progress, Where

_CALLEES = loop.advance, tables.outputs, tables.begin_world, lanes.is_next
"""What is called on a world, see `tables`."""


class Worlds:
    """Many root contexts in one memory.

    Args:
        store: What all worlds are like at first. It is kept and must not be changed any more.
        count: How many.
        numbers: The integrator's; each world has its own.

    Attributes:
        S: slabs, shape (count, size of the layout); a view of `slab`, whose rows are longer.
        I: sides likewise, a view of `side`.
        progress: see `_kernels.worlds.Progress`, shape (count, 3).
        tables: all of it, for kernels.
    """

    def __init__(self, store: Store, count: int, numbers: Integrator):
        logs.begin(store)
        self.model, self.layout, self.count = store, store.layout, count
        (self._numbers,) = numbers
        size = store.S.size + self._numbers.size
        # Rows begin at lines of the cache, an odd number of them apart: else all worlds would want the same few.
        self.slab = blank(count, (-(-size // tables.LINE) | 1) * tables.LINE)
        self.side = np.empty((count, store.I.size + RunWords.SIZE), np.int64)
        self.L = np.empty((count, store.L.size))
        self.S, self.I = self.slab[:, : store.S.size], self.side[:, : store.I.size]
        self.progress = np.zeros((count, Progress.SIZE), np.int64)
        self._stores: dict[int, Store] = {}
        self._with_logs: dict[int, Store] = {}  # stores that nobody has asked for, of worlds whose logs have moved
        self._log_words: list[int] = []
        self._logs: dict[int, np.ndarray] = {}  # where the words of worlds say that logs are
        self._lane_rows: LaneRows | None = None
        for a, b in pieces_used(store.S):
            self.S[:, a:b] = store.S[a:b]
        self.side[:] = np.concatenate([store.I, _run()])
        self._numbers_in(slice(None))[:] = self._numbers
        self.tables = self._tables()

    def _numbers_in(self, who: Any) -> np.ndarray:
        """Numbers of the integrators of worlds."""
        return self.slab[who, self.model.S.size : self.model.S.size + self._numbers.size]

    def begin_integrating(self, who: np.ndarray) -> None:
        """What integrators remember of the last steps of worlds is forgotten."""
        first = self.model.S.size
        self.slab[who, first : first + self._numbers.size] = self._numbers

    def store(self, w: int) -> Store:
        """The store of world `w`, made when first asked for."""
        store = self._stores.get(w)
        if store is None:
            store = self._with_logs.pop(w) if w in self._with_logs else self._make_store(w)
            self._stores[w] = store
        return store

    def _make_store(self, w: int) -> Store:
        store = self.model.on(self.S[w], self.I[w], self.L[w])
        store.world = w
        return store

    def known(self) -> list[Store]:
        """Stores whose contexts somebody has asked for."""
        return [store for store in self._stores.values() if store.contexts]

    # Kernels.

    def _tables(self) -> tables.Worlds:
        """What kernels of the worlds work on, still without words."""
        layout, model = self.layout, self.model
        where = np.zeros(Where.SIZE, np.int64)
        for name in ("budget", "steps", "fresh", "resting", "still"):
            where[getattr(Where, name)] = model.I.size + operator.index(getattr(RunWords, name))
        where[Where.terminate] = operator.index(SideWords.terminate)
        first_slab = np.concatenate([model.S, self._numbers])
        first_side = np.concatenate([model.I, _run()])
        kept = [layout.p, *(slot.span for slot in layout.free_slots)]
        part = np.array(_without(kept, len(first_slab)), np.int64)
        room = [(at, at + 2) for at in range(layout.log0, layout.fixed0, 3)]  # where each log begins, and its room
        kept = [(0, CONTINUOUS + 1), *room, (layout.fixed0, layout.fixed0 + len(layout.free_slots))]
        side_part = np.array(_without(kept, len(first_side)), np.int64)
        none = np.zeros(0, np.int64)
        words = none, none.view(float), np.zeros(len(_CALLEES), np.int64)
        used = np.zeros(1 + self.slab.shape[1] // tables.LINE, np.int64)
        first = first_slab, first_slab.view(np.int64), first_side, part, side_part
        slab = self.slab, self.slab.view(np.int64)
        spans = [(layout.xc[0], layout.p[1]), *(slot.span for slot in layout.free_slots)]
        source = np.array([span for span in spans if span[1] > span[0]], np.int64).reshape(-1, 2)
        of_rest = np.zeros((self.count, 1 + np.diff(source).sum()), np.int64)
        return tables.Worlds(*slab, self.side, self.progress, *words, where, *first, used, source, of_rest)

    def bind(self, chain: np.ndarray) -> None:
        """Makes the words with which `advance`, `outputs` and `begin_world` are called on each world.

        Args:
            chain: For `outputs`: how many rows it computes, then these; the array is kept, and read at each call.
        """
        layout, program = self.layout, self.layout.program
        rows = np.array([HERE.address(row.calc) if row.native else 0 for row in layout.rows], np.int64)
        run, numbers, side = Run(self.side[0, self.I.shape[1] :]), Integrator(self._numbers_in(0)), Side(self.I[0])
        memory = self.S[0], side, self.L[0]
        advance, places = arguments(loop.advance, (program, run, numbers, *memory, rows, 0.0))
        chained, _ = arguments(tables.outputs, (program, self.S[0], side, rows, chain))
        begin, _ = arguments(tables.begin_world, (program, run, *memory, rows))
        self._lane_rows = lane_rows_of(self.model) if self.count >= lanes.LANES else None
        group = self._lane_rows.group if self._lane_rows else -1
        is_next, _ = arguments(lanes.is_next, (program, run, self.S[0], side, rows, group))
        words, at = join([advance, chained, begin, is_next])
        self._keep = words
        first = words.placed(HERE, HERE.place(self.slab))
        further = np.zeros_like(first)
        for place, array, _ in words.relocations:
            further[place] = self._distance(array)
        self.words = first + np.arange(self.count)[:, None] * further
        self._logs.clear()
        if self.L.size:
            self._log_words = [r.at for r in words.relocations if HERE.place(r.array) == HERE.place(self.L)]
        where = self.tables.where
        where[Where.width], where[Where.until_word] = len(first), places["T"][0]
        where[Where.starts.columns] = at[: len(_CALLEES)]
        callee = np.array([HERE.address(kernel) for kernel in _CALLEES], np.int64)
        flat = self.words.reshape(-1)
        self.tables = self.tables._replace(words=flat, bits=flat.view(float), callee=callee)

    def lanes(self) -> tuple[lanes.Lanes, lanes.Lanes]:
        """What a thread needs to take four worlds at once, see `make_lanes`."""
        return make_lanes(self.model, self._lane_rows) if self._lane_rows else (no_lanes(), no_lanes())

    def look_at_use(self, w: int) -> None:
        """Finds out which lines of its slab a world writes, so that threads can ask for those of the next one."""
        lines = np.flatnonzero(self.slab[w].view(np.int64).reshape(-1, tables.LINE).any(axis=1))
        self.tables.used[0], self.tables.used[1 : 1 + len(lines)] = len(lines), lines * tables.LINE

    def _distance(self, array: np.ndarray) -> int:
        """How far the same array of the next world is behind this one of the first [numbers]; 0: they share it."""
        for memory in (self.slab, self.side, self.L):
            begin = HERE.place(memory)
            if begin <= HERE.place(array) < begin + memory.nbytes:
                return memory.shape[1]
        return 0

    def set_back(self, who: np.ndarray) -> None:
        """Worlds are as they were at first, but for parameters, fixed inputs and the room of logs, which are empty."""
        reset = tables.reset.native if jit_enabled() else tables.reset
        reset(self.tables, who)
        self.forget_past(who)

    def forget_past(self, who: np.ndarray) -> None:
        """Worlds are set back: so is what their stores have beside the slab."""
        for w in who.tolist() if self._stores else ():
            if (store := self._stores.get(w)) is not None:
                store.abstract[:] = [v.Clone() for v in self.model.abstract]
                store.stopped = store.goes_on = None
                store.out_of_date()

    def make_room(self, w: int, until: float) -> None:
        """Gives the logs of a world that are nearly full room, see `logs.grow`."""
        store = self._stores.get(w) or self._with_logs.get(w)
        if store is None:
            store = self._with_logs[w] = self._make_store(w)
        logs.grow(store, until)
        self._find_logs(w, store)

    def follow_logs(self) -> None:
        """Finds logs that others have moved, who have asked for their stores."""
        for w, store in self._stores.items():
            self._find_logs(w, store)

    def _find_logs(self, w: int, store: Store) -> None:
        if self._logs.get(w) is store.L:
            return
        self._logs[w] = store.L
        for at in self._log_words:
            self.words[w, at] = (HERE.place(store.L) - HERE.place(self.slab)) >> 3
            self.words[w, at + 1] = store.L.size


def _run() -> np.ndarray:
    """Settings and counts of a world at its beginning."""
    run = Run(np.zeros(RunWords.SIZE, np.int64))
    run.counted = 1  # `out_of_date` counts what is written between two rollouts
    return run.word


def _without(spans: list[tuple[int, int]], size: int) -> list[tuple[int, int]]:
    """What is left of the numbers below `size`."""
    left, at = [], 0
    for a, b in sorted(span for span in spans if span[1] > span[0]):
        if a > at:
            left.append((at, a))
        at = max(at, b)
    return [*left, (at, size)] if at < size else left
