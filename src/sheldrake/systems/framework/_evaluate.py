"""What a system computes outside the event loop: derivatives, updates and publishes asked for by hand."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.systems.framework._declarations import (
    DISCRETE,
    PUBLISH,
    UNRESTRICTED,
    PythonStage,
)
from sheldrake.systems.framework._engine import logs
from sheldrake.systems.framework._engine.asked import DERIVATIVES, native_call
from sheldrake.systems.framework._engine.layout import NO_ROW
from sheldrake.systems.framework._engine.store import Store
from sheldrake.systems.framework._event import EventStatus, checked_status
from sheldrake.systems.framework._state import State
from sheldrake.systems.framework._values import DiscreteValues

if TYPE_CHECKING:
    from sheldrake.systems.framework._context.context import Context


def leaves_under(store: Store, n: int) -> list[int]:
    """Leaves of node `n`, in order."""
    node = store.layout.nodes[n]
    return store.layout.leaves[node.first_leaf : node.last_leaf]


class computing:
    """What is done here finds memory where it is now."""

    def __init__(self, store: Store):
        self._store = store

    def __enter__(self) -> None:
        if self._store.unsettled:
            self._store.settle()
        self._store.enter()

    def __exit__(self, *_: object) -> None:
        self._store.leave()


def prepare(store: Store, r: int) -> None:
    """Brings up to date what kernel row `r` reads."""
    for k in store.layout.read_by_kernel(r):
        store.pull(k)


def run_stages(store: Store, first: int) -> Any:
    """Computes the rows that `first` begins; what a handler in Python returned."""
    rows = store.layout.stages(first)
    for r in rows:
        prepare(store, r)
    if store.scalar is not float:
        while isinstance(store.layout.rows[rows[0]].calc, PythonStage):
            store.compute(rows[0])
            rows = rows[1:]
        if store.on_complex_numbers(first, rows):
            return None
    for r in rows:
        result = store.compute(r)
    return result


def derivatives(context: Context) -> np.ndarray:
    """The derivatives of all leaves of a context, computed as far as they are out of date; a view of the slab."""
    read = context._reads.get(DERIVATIVES) or native_call(context, DERIVATIVES)
    if read is not None and (found := read()) is not None:
        return found
    store, n = context._store, context._node
    if store.unsettled:
        store.settle()
    i, layout = store.i, store.layout
    rows, span = layout.derivative_rows(n)
    stamp0 = layout.stamp0
    if old := [r for r in rows if i[stamp0 + r] != i[2] or store.uncached]:
        store.enter()
        try:
            for r in old:
                run_stages(store, r)
                i[stamp0 + r] = i[2]
        finally:
            store.leave()
    return store.S[span[0] : span[1]]


def forget_derivatives(context: Context) -> None:
    """Has derivatives in Python computed anew."""
    if DERIVATIVES not in context._reads:  # where all of them are kernels
        for r in context._store.layout.derivative_rows(context._node)[0]:
            context._store.forget(r)


def _run(store: Store, events: list[int], kind: int) -> EventStatus:
    """Runs events, updates until one of them fails; the worst of what they returned."""
    status = EventStatus.DidNothing()
    for r in events:
        if r == NO_ROW:
            continue
        result = None
        if r < 0:
            logs.append(store, -1 - r)
        else:
            result = run_stages(store, r)
        status.KeepMoreSevere(EventStatus.Succeeded() if result is None else checked_status(result))
        if kind != PUBLISH and status.severity() is EventStatus.Severity.kFailed:
            break
    return status


def _copy_to_next(store: Store, n: int, names: tuple[str, ...]) -> None:
    place, plus = store.layout.places[n], store.layout.plus
    for name in names:
        a, b = getattr(place, name)
        store.S[a + plus : b + plus] = store.S[a:b]


def _require_success(status: EventStatus, call: str) -> None:
    if status.severity() is EventStatus.Severity.kFailed:
        system = status.system()
        where = f" in {system.GetSystemType()} system '{system.GetSystemPathname()}'" if system is not None else ""
        raise RuntimeError(f'{call}(): An event handler{where} failed with message: "{status.message()}".')


def discrete_update(store: Store, n: int, trigger: str, call: str) -> tuple[DiscreteValues, bool]:
    """x+ of node `n` after its discrete updates (a view), and whether there were any.

    Raises:
        RuntimeError: one reported failure; it says which `call` this was.
    """
    with computing(store):
        _copy_to_next(store, n, ("xd",))
        found = store.layout.events_under(n, DISCRETE, trigger)
        _require_success(_run(store, found, DISCRETE), call)
    return store.context(n)._discrete_view(store.layout.plus), bool(found)


def unrestricted_update(store: Store, n: int, trigger: str, call: str) -> tuple[State, bool]:
    """The whole next state of node `n` after its unrestricted updates (views), and whether there were any.

    Raises:
        RuntimeError: one reported failure; it says which `call` this was.
    """
    with computing(store):
        _copy_to_next(store, n, ("xc", "xd"))
        store.pending.clear()
        found = store.layout.events_under(n, UNRESTRICTED, trigger)
        try:
            _require_success(_run(store, found, UNRESTRICTED), call)
            abstract = []
            for m in leaves_under(store, n):
                first, last = store.layout.places[m].abstract
                abstract += store.pending.get(m, store.abstract[first:last])
        finally:
            pending, store.pending = store.pending, {}
    state = store.context(n)._state_view(store.layout.plus, abstract)
    state._pending = pending
    return state, bool(found)


def publish(store: Store, n: int, trigger: str) -> EventStatus:
    """Runs the publishes of node `n`, all of them, and gives the worst of what they returned."""
    found = store.layout.events_under(n, PUBLISH, trigger)
    if not found:
        return EventStatus.DidNothing()
    with computing(store):
        return _run(store, found, PUBLISH)


def publish_or_raise(store: Store, n: int, trigger: str, call: str) -> None:
    """Runs the publishes of node `n`.

    Raises:
        RuntimeError: one reported failure; it says which `call` this was.
    """
    _require_success(publish(store, n, trigger), call)


def apply_discrete(store: Store, n: int, trigger: str, call: str) -> None:
    """Runs the discrete updates of node `n` and makes x+ the state; errors as there."""
    if store.layout.events_under(n, DISCRETE, trigger):
        discrete_update(store, n, trigger, call)
        a, b = store.layout.places[n].xd
        plus = store.layout.plus
        store.S[a:b] = store.S[a + plus : b + plus]
        store.touch(1, ("x", n))


def apply_unrestricted(store: Store, n: int, trigger: str, call: str) -> None:
    """Runs the unrestricted updates of node `n` and makes what they give the state; errors as there."""
    if store.layout.events_under(n, UNRESTRICTED, trigger):
        state, _ = unrestricted_update(store, n, trigger, call)
        plus = store.layout.plus
        for a, b in (store.layout.places[n].xd, store.layout.places[n].xc):
            store.S[a:b] = store.S[a + plus : b + plus]
        store.pending = state._pending
        store.commit_abstract()
        store.touch(1, ("x", n))
