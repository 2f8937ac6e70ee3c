"""Derivatives of a root context that is asked again and again: all rows that they need in one native call."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from sheldrake.common._native.binding import HERE
from sheldrake.systems.framework._kernels.integrate import derivatives_now

if TYPE_CHECKING:
    from sheldrake.systems.framework._context.context import Context
    from sheldrake.systems.framework._engine.store import Store

DERIVATIVES = "derivatives"
"""Under which key a context keeps its function (see `Context._reads`)."""

_PATIENCE = 3
"""Times that they are computed row by row before it pays to bind the kernel."""


def keep_native_derivatives(context: Context) -> None:
    """Gives a root context its `native_derivatives` when they were computed row by row often enough."""
    store = context._store
    store.derivatives_asked += 1
    if store.derivatives_asked >= _PATIENCE and DERIVATIVES not in context._reads:
        context._reads[DERIVATIVES] = native_derivatives(store)


def native_derivatives(store: Store) -> Callable[[], np.ndarray | None] | None:
    """A function that brings the derivatives of all leaves up to date and gives them, in the slab.

    It gives None where there is more to look at than it knows of: a missing input, a cache that is disabled or frozen.
    There is no such function where Python takes part.
    """
    layout = store.layout
    calls, needed = layout.derivative_calls
    rows = [layout.rows[r] for r in (*calls, *needed)]
    if not (store.native and calls and all(row.native for row in rows)):
        return None
    table = np.zeros(len(layout.rows), np.int64)
    for r in (*calls, *needed):
        table[r] = HERE.address(layout.rows[r].calc)
    arrays = {"program_model": layout.program, "S": store.S, "side": store.side, "L": store.L, "rows": table}
    form = derivatives_now.form
    compute = form.bind(form.words(arrays, layout.known_words), tuple(arrays.values()))
    free = [layout.fixed0 + k for row in rows for k in row.free]
    stamps = [layout.stamp0 + r for r in calls]
    found = store.S[slice(*layout.derivative_rows(0)[1])]
    i, cold, lock = store.i, store._cold, store.lock

    def read() -> np.ndarray | None:
        if store.unsettled or store.uncached or cold:
            return None
        now = i[2]
        for at in stamps:
            if i[at] != now:
                break
        else:
            return found
        if store.frozen:
            return None
        for at in free:
            if not i[at]:
                return None
        if not lock.acquire(False):  # `Store.enter`, written out
            raise store._taken()
        store.busy += 1
        try:
            status = compute()
        finally:
            store.busy -= 1
            lock.release()
        if status:
            raise store.explain(layout.rows[store.side.row], status)
        return found

    return read
