"""Which row of a system four worlds can run at once, and where in their slabs is what it needs."""

from __future__ import annotations

import mmap
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sheldrake.common._native import store as kernel_store
from sheldrake.common._native.binding import HERE
from sheldrake.common.kernel import LaneMemory, jit_enabled
from sheldrake.systems.framework._kernels.lanes import LANES, Lanes, Piece, Shared

if TYPE_CHECKING:
    from sheldrake.systems.framework._engine.store import Store

_NONE = np.zeros(0, np.int64)


class LaneRow(NamedTuple):
    """A row that is the first thing its system does in an update, and whose kernel is for lanes."""

    row: int
    group: int
    address: int
    """Of the kernel on lanes."""


def lane_row_of(store: Store) -> LaneRow | None:
    """The first such row, if there is one and its machine code can be had."""
    layout = store.layout
    if not jit_enabled():
        return None
    for g, (_, _, rows, _) in enumerate(layout.group_list[:-1]):
        for r in rows:
            calc: Any = layout.rows[r].calc if r >= 0 else None
            if r in layout._stages and getattr(calc, "lanes", None) is not None:
                if kernel_store.is_ready(calc.on_lanes) or kernel_store.can_compile():
                    return LaneRow(r, g, HERE.address(calc.on_lanes))
    return None


def no_lanes() -> Lanes:
    """Of worlds that go one by one."""
    slab, pieces = np.zeros((0, LANES)), np.zeros((0, Piece.SIZE), np.int64)
    return Lanes(slab, slab.view(np.int64), pieces, _NONE, _NONE, np.zeros(Shared.SIZE, np.int64))


def make_lanes(store: Store, found: LaneRow) -> Lanes:
    """What a thread needs to take four worlds at once.

    Args:
        store: What all worlds are like at first.
        found: What they run.
    """
    layout, r = store.layout, found.row
    row = layout.rows[r]
    arguments = store.arguments_of(row, store.S, store.scratch(row.node))
    memory: LaneMemory = row.calc.lanes(*arguments)
    at_rows = _piece(store.S, memory.num_rows)[Piece.start]
    parts = [
        _joined(_piece(store.S, a) for a in memory.constant),
        _joined(_piece(store.S, a) for a in memory.reads),
        _joined(_piece(store.S, a) for a in memory.writes) + [_rows(store.S, a, at_rows) for a in memory.tables],
    ]
    slab = np.frombuffer(mmap.mmap(-1, 8 * LANES * store.S.size)).reshape(-1, LANES)
    for start, length, *_ in parts[2]:
        slab[start : start + length] = store.S[start : start + length, None]
    shared = np.zeros(Shared.SIZE, np.int64)
    shared[Shared.is_there], shared[Shared.stamp] = 1, layout.stamp0 + r
    shared[Shared.reads_begin] = len(parts[0])
    shared[Shared.writes_begin] = len(parts[0]) + len(parts[1])
    shared[Shared.end] = sum(map(len, parts))
    program = layout.program
    return Lanes(
        slab,
        slab.view(np.int64),
        np.array([piece for part in parts for piece in part], np.int64).reshape(-1, Piece.SIZE),
        np.array([found.address], np.int64),
        program.words[program.at[r] :],
        shared,
    )


def _piece(S: np.ndarray, array: np.ndarray) -> list[int]:
    """The piece of a slab that an array is."""
    if not array.flags.c_contiguous:
        raise ValueError(f"what worlds share of a lane kernel must be contiguous, not of strides {array.strides}")
    return [(HERE.place(array) - HERE.place(S)) >> 3, array.size, 0, -1]


def _rows(S: np.ndarray, table: np.ndarray, num_rows: int) -> list[int]:
    """The piece that is some columns of the first rows of a table."""
    return [(HERE.place(table) - HERE.place(S)) >> 3, table.shape[1], table.strides[0] >> 3, num_rows]


def _joined(pieces: Iterable[list[int]]) -> list[list[int]]:
    """Pieces, of which those that touch are one."""
    found: list[list[int]] = []
    for start, length, *rest in sorted(p for p in pieces if p[1]):
        if found and found[-1][0] + found[-1][1] == start:
            found[-1][1] += length
        else:
            found.append([start, length, *rest])
    return found
