"""Which rows of a system four worlds can run at once, and where in their slabs is what these need."""

from __future__ import annotations

import mmap
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sheldrake.common._native import store as kernel_store
from sheldrake.common._native.binding import HERE
from sheldrake.common.kernel import LaneMemory, jit_enabled
from sheldrake.systems.framework._kernels.lanes import LANES, Lanes, Piece, Shared

if TYPE_CHECKING:
    from sheldrake.systems.framework._engine.store import Store

_NONE = np.zeros(0, np.int64)
_KINDS = 5
"""Of pieces, see `Shared`."""
_PIECE = 64
"""Numbers that are copied together, or not at all if they are zeros."""


class LaneRows(NamedTuple):
    """The stages that are the first thing a system does in an update; the kernel of the first is for lanes."""

    group: int
    rows: list[int]
    """All stages."""
    all_but_last: bool
    """Whether all but the last are for lanes: it writes the next state, which is of the event loop."""


def lane_rows_of(store: Store) -> LaneRows | None:
    """The first such stages, if there are some and their machine code can be had."""
    layout = store.layout
    if not jit_enabled():
        return None
    for g, (_, _, rows, _) in enumerate(layout.group_list[:-1]):
        for r in rows:
            if r in layout._stages and _is_for_lanes(layout.rows[r].calc):
                stages = layout._stages[r]
                know_memory = all(getattr(layout.rows[s].calc, "lanes", None) is not None for s in stages)
                ready = know_memory and all(_is_for_lanes(layout.rows[s].calc) for s in stages[:-1])
                return LaneRows(g, stages, ready and len(stages) > 2)
    return None


def _is_for_lanes(calc: Any) -> bool:
    if getattr(calc, "lanes", None) is None:
        return False
    return kernel_store.is_ready(calc.on_lanes) or kernel_store.can_compile()


def no_lanes() -> Lanes:
    """Of worlds that go one by one."""
    slab, pieces = np.zeros((0, LANES)), np.zeros((0, Piece.SIZE), np.int64)
    return Lanes(slab, slab.view(np.int64), pieces, _NONE, _NONE, _NONE, _NONE, np.zeros(Shared.SIZE, np.int64))


def make_lanes(store: Store, found: LaneRows) -> tuple[Lanes, Lanes]:
    """What a thread needs to take four worlds at once through the first stage, and through all but the last.

    Args:
        store: What all worlds are like at first.
        found: What they run.
    """
    memories = [_memory(store, r) for r in (found.rows if found.all_but_last else found.rows[:1])]
    last = memories.pop() if found.all_but_last else LaneMemory()
    reads, writes = _reads_and_writes(store, memories)
    constants = _joined(_piece(store.S, a) for memory in memories for a in memory.constant)
    changes = _joined(_piece(store.S, a) for memory in memories for a in memory.changes)
    size = store.S.size + sum(piece[Piece.length] for piece in changes)
    slab = blank(size, LANES)
    for a, b in pieces_used(store.S):
        slab[a:b] = store.S[a:b, None]
    _, of_first = _reads_and_writes(store, memories[:1])
    if not found.all_but_last:
        return _lanes(store, slab, found.rows[:1], constants, reads, of_first), no_lanes()
    later: list[list[int]] = []
    later_of_first: list[list[int]] = []
    if not _is_read_by_others(store, found):
        of_first, later_of_first = _parted(store, of_first, [*memories[1:], last])
        own = _joined(_piece(store.S, a) for a in last.writes)  # what comes later must not be put over these
        of_last = _joined(_piece(store.S, a) for a in last.reads) + _tables(store, last)
        writes, later = own + [piece for piece in of_last if _is_part(piece, writes)], _without(writes, own)
    first = _lanes(store, slab, found.rows[:1], constants, reads, of_first, later_of_first)
    return first, _lanes(store, slab, found.rows[:-1], [], [], writes, later, changes)


def _memory(store: Store, r: int) -> LaneMemory:
    row = store.layout.rows[r]
    calc: Any = row.calc
    return calc.lanes(*store.arguments_of(row, store.S, store.scratch(row.node)))


def _reads_and_writes(store: Store, memories: list[LaneMemory]) -> tuple[list[list[int]], list[list[int]]]:
    """Pieces that kernels read of what changes and none before them writes, and that they write."""
    known = [_piece(store.S, a) for memory in memories for a in memory.constant]
    reads: list[list[int]] = []
    for memory in memories:
        reads += _without(_joined(_piece(store.S, a) for a in memory.reads), known)
        known += [_piece(store.S, a) for a in memory.writes]
    reads = _joined(reads)
    tables: list[list[int]] = []
    for piece in (piece for memory in reversed(memories) for piece in _tables(store, memory)):
        if not _is_part(piece, tables):
            tables.append(piece)
    return reads, _joined(_piece(store.S, a) for memory in memories for a in memory.writes) + tables


def _tables(store: Store, memory: LaneMemory) -> list[list[int]]:
    return [_rows(store.S, table, _piece(store.S, count)[Piece.start]) for table, count in memory.tables]


def _parted(store: Store, pieces: list[list[int]], others: list[LaneMemory]) -> tuple[list[list[int]], list[list[int]]]:
    """Of pieces those that other kernels read or write, all tables among them, and those that they do not."""
    touched = [piece for memory in others for piece in _touched(store, memory)]
    left = [piece for piece in _without(pieces, touched) if piece[Piece.rows] < 0]
    return _without(pieces, left), left


def _touched(store: Store, memory: LaneMemory) -> list[list[int]]:
    """Pieces that a kernel reads or writes; of tables, from their first number to their last."""
    pieces = [_piece(store.S, a) for arrays in (memory.reads, memory.writes, memory.changes) for a in arrays]
    for (start, width, stride, _), (table, _) in zip(_tables(store, memory), memory.tables):
        pieces.append([start, (len(table) - 1) * stride + width, 0, -1])
    return pieces


def _is_part(piece: list[int], pieces: list[list[int]]) -> bool:
    """Whether a piece is part of one of others."""
    start, length, *table = piece
    return any(s <= start and start + length <= s + n and table == t for s, n, *t in pieces)


def _is_read_by_others(store: Store, found: LaneRows) -> bool:
    """Whether rows that the event loop calls read the scratch of these stages, which may stay in lanes else."""
    rows = store.layout.rows
    scratch = [_piece(store.S, a) for a in _arrays(store.scratch(rows[found.rows[0]].node))]
    begin, end = min(p[Piece.start] for p in scratch), max(p[Piece.start] + p[Piece.length] for p in scratch)
    for r in store.layout.called - set(found.rows):
        if r >= 0 and rows[r].native:
            for array in _arrays(store.arguments_of(rows[r], store.S, store.scratch(rows[r].node))):
                if begin <= (HERE.place(array) - HERE.place(store.S)) >> 3 < end:
                    return True
    return False


def _arrays(parts: Any) -> Iterator[np.ndarray]:
    """All arrays of a tuple, and of tuples in it, that are not empty."""
    if isinstance(parts, np.ndarray):
        if parts.size:
            yield parts
    elif isinstance(parts, (tuple, list)):
        for part in parts:
            yield from _arrays(part)


def _lanes(store: Store, slab: np.ndarray, rows: list[int], *parts: list[list[int]]) -> Lanes:
    """Tables for kernels: rows, and pieces that are constant, read, written at once, written later, and changed."""
    layout, program = store.layout, store.layout.program
    ends = np.cumsum([len(part) for part in parts] + [0] * (_KINDS - len(parts)))
    shared = np.zeros(Shared.SIZE, np.int64)
    shared[Shared.num_rows], shared[Shared.copies] = len(rows), store.S.size
    shared[Shared.ends.columns] = ends
    calcs: list[Any] = [layout.rows[r].calc for r in rows]
    return Lanes(
        slab,
        slab.view(np.int64),
        np.array([piece for part in parts for piece in part], np.int64).reshape(-1, Piece.SIZE),
        np.array([HERE.address(calc.on_lanes) for calc in calcs], np.int64),
        program.words,
        np.array([program.at[r] for r in rows], np.int64),
        np.array([layout.stamp0 + r for r in rows], np.int64),
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
    """Pieces, of which those that touch or overlap are one."""
    found: list[list[int]] = []
    for start, length, *rest in sorted(p for p in pieces if p[1]):
        if found and found[-1][0] + found[-1][1] >= start:
            found[-1][1] = max(found[-1][1], start + length - found[-1][0])
        else:
            found.append([start, length, *rest])
    return found


def _without(pieces: list[list[int]], holes: list[list[int]]) -> list[list[int]]:
    """What is left of pieces."""
    for hole, size, *_ in holes:
        left = []
        for start, length, *rest in pieces:
            end, begin = start + length, start
            if rest[1] < 0 and start < hole + size and hole < end:
                left += [[a, b - a, *rest] for a, b in ((begin, hole), (hole + size, end)) if a < b]
            else:
                left.append([start, length, *rest])
        pieces = left
    return pieces


def blank(rows: int, columns: int) -> np.ndarray:
    """Zeros in small pages: each takes memory when it is first written, and most of a slab is room for contacts.

    A process that forks has pages of its own.
    """
    own = {"flags": mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS} if hasattr(mmap, "MAP_PRIVATE") else {}
    memory = mmap.mmap(-1, 8 * rows * columns, **own)
    if hasattr(mmap, "MADV_NOHUGEPAGE"):
        memory.madvise(mmap.MADV_NOHUGEPAGE)
    return np.frombuffer(memory).reshape(rows, columns)


def pieces_used(numbers: np.ndarray) -> list[tuple[int, int]]:
    """Where in an array something is not zero: what has never been written takes no memory."""
    padded = np.zeros((-(-numbers.size // _PIECE), _PIECE))
    padded.reshape(-1)[: numbers.size] = numbers
    used = [int(k) for k in np.flatnonzero(padded.view(np.int64).any(axis=1))]
    return [(k * _PIECE, min((k + 1) * _PIECE, numbers.size)) for k in used]
