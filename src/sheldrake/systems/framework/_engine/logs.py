"""Logs of a root context: the event loop appends to them, Python makes room and reads them.

All samples lie in one array, `Store.L`, log after log; where each begins, its room and its samples are counted in a
table in the store's int64 side.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from sheldrake.systems.framework._engine.store import Store


def _table(store: Store) -> np.ndarray:
    """Start, room in samples and number of samples of each log, shape (n, 3); a view."""
    return store.I[store.layout.log0 : store.layout.fixed0].reshape(-1, 3)


def grow(store: Store, least: int = 256) -> None:
    """Gives every log that is nearly full twice the room."""
    if not store.layout.logs:
        return
    table = _table(store)
    full = table[:, 2] + 8 > table[:, 1]
    room = np.where(full, np.maximum(least, 2 * table[:, 1]), table[:, 1])
    _lay_out(store, room)


def reserve(store: Store, s: int, room: int) -> None:
    """Room for `room` samples in log `s`."""
    table = _table(store)
    wanted = table[:, 1].copy()
    wanted[s] = max(wanted[s], room)
    _lay_out(store, wanted)


def _lay_out(store: Store, room: np.ndarray) -> None:
    """Moves all samples to a new array with this room for each log."""
    table = _table(store)
    width = store.layout.program.log[:, 1] + 1
    starts = np.cumsum(np.r_[0, room * width])
    old, store.L = store.L, np.empty(starts[-1], store.S.dtype)
    for row, start, capacity, w in zip(table, starts, room, width):
        store.L[start : start + row[2] * w] = old[row[0] : row[0] + row[2] * w]
        row[:2] = start, capacity


def record(store: Store, s: int) -> np.ndarray:
    """Samples of log `s`: rows of time [s] and values; a view."""
    first, _, count = _table(store)[s].tolist()
    width = int(store.layout.program.log[s, 1]) + 1
    return store.L[first : first + count * width].reshape(count, width)


def append(store: Store, s: int) -> None:
    """Adds a sample of the current time and value to log `s`."""
    n, (a, b) = store.layout.logs[s]
    row = store.layout.places[n].inputs[0].row
    if row >= 0:
        store.pull(row)
    add(store, s, store.S[0], store.S[a:b])


def add(store: Store, s: int, t: Any, sample: Any) -> None:
    """Adds a sample to log `s`."""
    at = store.layout.log0 + 3 * s
    if store.i[at + 2] + 1 > store.i[at + 1]:
        grow(store)
    o = store.i[at] + store.i[at + 2] * (len(sample) + 1)
    store.L[o] = t
    store.L[o + 1 : o + 1 + len(sample)] = sample
    store.i[at + 2] += 1


def clear(store: Store, s: int) -> None:
    """Forgets the samples of log `s`."""
    store.i[store.layout.log0 + 3 * s + 2] = 0
