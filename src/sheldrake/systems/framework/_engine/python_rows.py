"""Rows of a store that are Python functions, called on contexts and on views of the slab."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from sheldrake.systems.framework._declarations import (
    DERIVATIVES,
    DISCRETE,
    OUTPUT,
    PUBLISH,
    UNRESTRICTED,
    Callback,
    PythonStage,
)
from sheldrake.systems.framework._engine.layout import Row
from sheldrake.systems.framework._kernels.program import CONTINUOUS
from sheldrake.systems.framework._state import State
from sheldrake.systems.framework._values import AbstractValues
from sheldrake.systems.framework._vector import BasicVector

if TYPE_CHECKING:
    from sheldrake.common.value import AbstractValue
    from sheldrake.systems.framework._context.context import Context
    from sheldrake.systems.framework._engine.freshness import Sources
    from sheldrake.systems.framework._engine.store import Store
    from sheldrake.systems.framework._values import ContinuousState, DiscreteValues


def call(store: Store, r: int, row: Row) -> Any:
    """Calls the Python function of a row; what an event's handler returned."""
    system, context = store.systems[row.node], store.context(row.node)
    if isinstance(row.calc, PythonStage):
        return row.calc.function(system, context)
    if row.event is None:
        target: Any = store.values.get(r)  # of an abstract output that was asked before
        sources = store.layout.sources_named_by(r)
        if target is None:
            target = _target(store, r, row, context)
        if sources is None:
            return row.calc(system, context, target)
        return _if_changed(store, r, sources, functools.partial(row.calc, system, context, target))
    if row.kind == PUBLISH:
        return row.event.call(system, context)
    argument = _target(store, r, row, context) if row.kind == DISCRETE else event_argument(store, row.kind, context)
    return row.event.call(system, context, argument)


def bound(store: Store, r: int) -> Callable[[], Any]:
    """`call` without arguments; what it calls with is made once, but for abstract values, which may be exchanged."""
    row = store.layout.rows[r]
    system, context = store.systems[row.node], store.context(row.node)
    if isinstance(row.calc, PythonStage):
        return functools.partial(row.calc.function, system, context)
    calc = row.calc if row.event is None else row.event.handler
    if not isinstance(calc, Callback):
        return lambda: call(store, r, row)
    given = (system, context) if calc.owned else (context,)
    if row.kind == UNRESTRICTED:
        return lambda: calc.function(*given, event_argument(store, UNRESTRICTED, context))
    compute: Callable[[], Any]
    if row.kind == OUTPUT and not store.layout.places[row.node].outputs[row.output].vector:
        value_of = store.output_value
        compute = lambda: calc.function(*given, value_of(r))  # noqa: E731
    else:
        target = () if row.kind == PUBLISH else (_target(store, r, row, context),)
        compute = functools.partial(calc.function, *given, *target)
    sources = store.layout.sources_named_by(r) if row.kind == OUTPUT else None
    return compute if sources is None else functools.partial(_if_changed, store, r, sources, compute)


def _if_changed(store: Store, r: int, sources: Sources, compute: Callable[[], Any]) -> None:
    """Computes output row `r` unless what it names is as it was, however much else the loop has written since."""
    if sources.other_level == CONTINUOUS and store.running is not None:
        compute()  # the loop moves continuous state before every look: finding out whether it did is work for nothing
        store.computed_from.pop(r, None)
        return
    stamp = store.stamp(sources)
    if store.computed_from.get(r) != stamp or store.uncached or r in store._cold:
        compute()
        store.computed_from[r] = stamp


def _target(
    store: Store, r: int, row: Row, context: Context
) -> ContinuousState | BasicVector | DiscreteValues | State | AbstractValue:
    """What an output, derivatives or a discrete update fills; the same object until memory moves."""
    target = store.targets.get(r)
    if target is not None:
        return target
    if row.kind == DISCRETE:
        target = context._discrete_view(store.layout.plus)
    elif row.kind == DERIVATIVES:
        target = context._continuous_view(row.out[0])
    elif not store.layout.places[row.node].outputs[row.output].vector:
        return store.output_value(r)
    else:
        model = store.systems[row.node]._outputs[row.output].model
        view = store.S[slice(*row.out)]
        target = model._on_memory(view) if isinstance(model, BasicVector) else BasicVector._view(view)
    store.targets[r] = target
    return target


def event_argument(store: Store, kind: int, context: Context) -> State | DiscreteValues | None:
    """What an update of this kind writes: x+ in the slab, abstract values aside until they are committed."""
    if kind == DISCRETE:
        return context._discrete_view(store.layout.plus)
    n, (first, last) = context._node, context._place.abstract
    state: Any = store.targets.get(("x+", n))
    if state is None:
        plus = store.layout.plus
        continuous, discrete = context._continuous_view(context._place.xc[0] + plus), context._discrete_view(plus)
        state = store.targets["x+", n] = State._view(continuous, discrete, AbstractValues())
    if last > first:
        values = store.pending.get(n)
        if values is None:
            values = store.pending[n] = [v.Clone() for v in store.abstract[first:last]]
        state._abstract._data = values
    return state
