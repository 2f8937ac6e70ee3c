"""Derivatives and updates of a root context that is asked again and again: all rows they need in one native call."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._native.binding import HERE
from sheldrake.systems.framework._declarations import DISCRETE
from sheldrake.systems.framework._kernels.integrate import derivatives_now, updates_now

if TYPE_CHECKING:
    from sheldrake.common.kernel import Kernel
    from sheldrake.systems.framework._context.context import Context
    from sheldrake.systems.framework._engine.store import Store

DERIVATIVES, UPDATE = "derivatives", "update"
"""Under which keys a context keeps its functions (see `Context._reads`)."""

_PATIENCE = 3
"""Times that contexts of a layout were computed row by row before it pays to compile and to bind the kernel."""


def native_call(context: Context, what: str) -> Callable[[], Any] | None:
    """The native function of a root context for DERIVATIVES or UPDATE; None if there is none, or not yet."""
    known = context._reads
    if what in known or context._node:
        return known.get(what)
    store = context._store
    asked = store.layout.asked
    asked[what] = asked.get(what, 0) + 1
    if asked[what] <= _PATIENCE:
        return None
    found = known[what] = native_derivatives(store) if what == DERIVATIVES else native_update(store)
    return found


def native_derivatives(store: Store) -> Callable[[], np.ndarray | None] | None:
    """A function that brings the derivatives of all leaves up to date and gives them, in the slab.

    It gives None where there is more to look at than it knows of: a missing input, a cache that is disabled or frozen.
    There is no such function where Python takes part.
    """
    layout = store.layout
    calls, needed = layout.calls_of_group(-1)
    compute = _native_call(store, derivatives_now, calls, needed)
    if compute is None:
        return None
    stamps = [layout.stamp0 + r for r in calls]
    found = store.S[slice(*layout.derivative_rows(0)[1])]
    i, cold = store.i, store._cold

    def read() -> np.ndarray | None:
        if store.unsettled or store.uncached or cold:
            return None
        now = i[2]
        for at in stamps:
            if i[at] != now:
                break
        else:
            return found
        return found if not store.frozen and compute() else None

    return read


def native_update(store: Store) -> Callable[[], bool] | None:
    """A function that computes x+ of all periodic discrete updates, which have one timing, and says whether it could.

    It cannot, and there is none, where `native_derivatives` is no help either.
    """
    layout = store.layout
    periodic = [g for g, (kind, clock, *_) in enumerate(layout.group_list) if kind == DISCRETE and clock >= 0]
    compute = _native_call(store, updates_now, *layout.calls_of_group(periodic[0])) if len(periodic) == 1 else None
    if compute is None:
        return None
    (a, b), plus = layout.places[0].xd, layout.plus
    now, following, cold = store.S[a:b], store.S[a + plus : b + plus], store._cold

    def update() -> bool:
        if store.unsettled or store.uncached or cold or store.frozen:
            return False
        following[...] = now
        return compute()

    return update


def _native_call(store: Store, kernel: Kernel, calls: list[int], needed: list[int]) -> Callable[[], bool] | None:
    """A function that runs a kernel on the rows `calls`, with those they need; False if an input is missing."""
    layout = store.layout
    rows = [layout.rows[r] for r in (*calls, *needed) if r >= 0]
    if not (store.native and calls and len(rows) == len(calls) + len(needed) and all(row.native for row in rows)):
        return None
    table = np.zeros(len(layout.rows), np.int64)
    for r in (*calls, *needed):
        table[r] = HERE.address(layout.rows[r].calc)
    arrays = {"program_model": layout.program, "S": store.S, "side": store.side, "L": store.L, "rows": table}
    form = kernel.form
    run = form.bind(form.words(arrays, layout.known_words), tuple(arrays.values()))
    free = [layout.fixed0 + k for row in rows for k in row.free]
    i, lock = store.i, store.lock

    def compute() -> bool:
        for at in free:
            if not i[at]:
                return False
        if not lock.acquire(False):  # `Store.enter`, written out
            raise store._taken()
        store.busy += 1
        try:
            status = run()
        finally:
            store.busy -= 1
            lock.release()
        if status:
            raise store.explain(layout.rows[store.side.row], status)
        return True

    return compute
