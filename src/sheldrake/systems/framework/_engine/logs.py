"""Logs of a root context: the event loop appends to them, Python makes room and reads them.

All samples lie in one array, `Store.L`, log after log; where each begins, its room and its samples are counted in a
table in the store's int64 side. The array stays where it is while something is computed: until then what finds no room
waits beside it (`Store.waiting`), and readers see both. Another thread may read while one adds: a sample is counted
when it is complete, and samples that are there do not change.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.systems.framework._engine.store import Store
from sheldrake.systems.framework._kernels.program import Log

if TYPE_CHECKING:
    from sheldrake.common._types import Scalar

_SPARE = 8
"""Samples that a step may add to a log, and more: so much room is left for the event loop."""
_AHEAD = 1 << 21
"""Numbers for which a log gets room at once at most, beyond twice what it had: 16 MB, which cost nothing until used."""


def _table(store: Store) -> np.ndarray:
    """Start, room in samples and number of samples of each log, shape (n, 3); a view."""
    return store.I[store.layout.log0 : store.layout.fixed0].reshape(-1, 3)


def begin(store: Store) -> None:
    """Logs without samples, with the room that new ones have."""
    size, new = store.layout.first_logs
    with store.moving:
        store.L, _table(store)[...] = np.empty(size, store.S.dtype), new


def grow(store: Store, until: float = -math.inf) -> None:
    """Gives every log that is nearly full twice the room, or what it needs until a time [s] if it goes on as it does.

    New memory costs as much as writing it some ten times over: a log that doubles until it is long enough pays twice.
    """
    i, first = store.i, store.layout.log0
    if all(i[at + 2] + _SPARE <= i[at + 1] for at in range(first, store.layout.fixed0, 3)):
        return
    if not store.L.size:
        begin(store)
        return
    table = _table(store)
    room = table[:, 1].copy()
    for s in np.flatnonzero(table[:, 2] + _SPARE > room).tolist():
        room[s] = max(2 * room[s], _expected(store, s, until))
    _lay_out(store, room)


def _expected(store: Store, s: int, until: float) -> int:
    """Samples that log `s` will have at a time [s], and some to spare, if they come as often as they did."""
    there = _there(store, s)
    if there.dtype != float or len(there) < 2 or not there[0, 0] < there[-1, 0] < until:
        return 0
    n, (first, last) = len(there), there[[0, -1], 0].tolist()
    more = 1.01 * n * (until - last) / (last - first) + 2 * _SPARE
    return n + int(min(more, n + _AHEAD // there.shape[1]))


def reserve(store: Store, s: int, room: int) -> None:
    """Room for `room` samples in log `s`."""
    store.check_thread()
    store.waiting.room[s] = max(store.waiting.room.get(s, 0), room)
    store.wait()
    store.settle()


def catch_up(store: Store, samples: list[tuple[int, int, Any, Any]], least: dict[int, int]) -> None:
    """Makes room and puts samples that waited where they belong."""
    table = _table(store)
    more = np.bincount([s for s, *_ in samples], minlength=len(table))
    full = (more > 0) & (table[:, 2] + more + _SPARE > table[:, 1])
    room = np.where(full, 2 * (table[:, 2] + more) + _SPARE, table[:, 1])
    for s, n in least.items():
        room[s] = max(room[s], n)
    _lay_out(store, room, samples)


def _lay_out(store: Store, room: np.ndarray, samples: list[tuple[int, int, Any, Any]] | tuple = ()) -> None:
    """Moves all samples, and these that waited, to a new array with this room for each log."""
    assert not store.busy, "memory must not move while something is computed in it"
    table, width = _table(store), store.layout.program.log[:, Log.length] + 1
    starts = [0, *np.cumsum(room * width).tolist()]
    L = np.empty(starts[-1], store.S.dtype)
    counts = []
    for s, start in enumerate(starts[:-1]):
        there = _merged(_there(store, s), [x for x in samples if x[0] == s])
        L[start : start + there.size] = there.reshape(-1)
        counts.append(len(there))
    with store.moving:
        store.L = L
        table[:, 0], table[:, 1], table[:, 2] = starts[:-1], room, counts


def place_of_count(store: Store, s: int) -> int:
    """Where in the side the number of samples of log `s` is."""
    return store.layout.log0 + 3 * s + 2


def room(store: Store, s: int) -> np.ndarray:
    """Samples of log `s` and the room behind them: a view of the array."""
    at, i, (_, (a, b)) = store.layout.log0 + 3 * s, store.i, store.layout.logs[s]
    first, most, width = i[at], i[at + 1], b - a + 1
    return store.L[first : first + most * width].reshape(most, width)


def _there(store: Store, s: int) -> np.ndarray:
    """Samples of log `s` in the array: a view."""
    return room(store, s)[: store.i[place_of_count(store, s)]]


def _merged(there: np.ndarray, late: list[tuple[int, int, Any, Any]]) -> np.ndarray:
    """Samples with those that waited, each behind as many as there were when it came."""
    if not late:
        return there
    rows = np.empty((len(late), there.shape[1]), there.dtype)
    for row, (_, _, t, sample) in zip(rows, late):
        row[0], row[1:] = t, sample
    return np.insert(there, [at for _, at, _, _ in late], rows, axis=0)


def record(store: Store, s: int) -> np.ndarray:
    """Samples of log `s`: rows of time [s] and values, not to be written."""
    with store.moving:
        waiting = store.waiting.samples
        return _merged(_there(store, s), [x for x in waiting if x[0] == s]) if waiting else _there(store, s)


def append(store: Store, s: int) -> None:
    """Adds a sample of the current time and value to log `s`."""
    n, (a, b) = store.layout.logs[s]
    row = store.layout.places[n].inputs[0].row
    if row >= 0:
        store.pull(row)
    add(store, s, store.S[0], store.S[a:b])


def add(store: Store, s: int, t: Scalar, sample: Any) -> None:
    """Adds a sample to log `s`."""
    store.check_thread()
    at = store.layout.log0 + 3 * s
    count = store.i[at + 2]
    if count + (_SPARE if store.busy else 1) > store.i[at + 1]:  # in a step the event loop may need the rest
        if store.busy:
            store.waiting.samples.append((s, count, t, np.array(sample)))
            store.wait()
            return
        grow(store)
    o = store.i[at] + count * (len(sample) + 1)
    store.L[o] = t
    store.L[o + 1 : o + 1 + len(sample)] = sample
    store.i[at + 2] = count + 1


def clear(store: Store, s: int) -> None:
    """Forgets the samples of log `s`."""
    store.check_thread()
    store.waiting.samples = [x for x in store.waiting.samples if x[0] != s]
    store.i[store.layout.log0 + 3 * s + 2] = 0
