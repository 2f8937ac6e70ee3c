"""What a value depends on: how often the event loop can change it, and which writes from Python do."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, NamedTuple

from sheldrake.systems.framework._engine.memory import Memory, Slot, Span
from sheldrake.systems.framework._index import Ticket

if TYPE_CHECKING:
    from sheldrake.systems.framework._engine.layout import Layout

_TIME = (0, 1)  # where time is in a slab


def level_of_needs(layout: Memory, n: int, needs: set, level: list[int]) -> int:
    """Level of a value of node `n` that needs these sources, given the levels of output rows."""
    place = layout.places[n]
    found = 0
    if Ticket.TIME in needs or (Ticket.XC in needs and place.xc[1] > place.xc[0]):
        found = 2
    elif needs & {Ticket.XD, Ticket.XA, "work"}:
        found = 1
    for need in needs:
        if isinstance(need, tuple):
            found = max(found, input_level(layout, place.inputs[need[1]], level))
    return found


def input_level(layout: Memory, slot: Slot, level: list[int]) -> int:
    """Level of an input."""
    if slot.row >= 0:
        return level[slot.row]
    if slot.free >= 0:
        return 0
    return 2 if slot.abstract_state < 0 and slot.span[0] < layout.xc[1] and slot.span[1] > slot.span[0] else 1


class Sources(NamedTuple):
    """What a value is computed from, as far as it is known what that is."""

    level: int
    """The level at which the event loop may change it."""
    keys: tuple
    """Names of the sources that Python may write."""
    places: tuple[Span, ...]
    """Time, discrete state and parameters, which are compared themselves where they are floats: the loop counts its
    updates by level, not by system."""
    other_level: int
    """`level` without what `places` has."""
    other_keys: tuple
    """`keys` without the parameters."""


def freshness(layout: Layout, n: int, needs: Iterable) -> Sources:
    """What tells whether a value of node `n` that needs these sources is up to date."""
    chain, m = [], n
    while m >= 0:
        chain.append(m)
        m = layout.nodes[m].parent
    place, level, other = layout.places[n], 0, 0
    keys: set[Any] = {"all"}
    parameters: set[Any] = set()
    places: set[Span] = set()
    for need in needs:
        if isinstance(need, tuple):
            found = _of_input(layout, place.inputs[need[1]])
            level, other = max(level, found.level), max(other, found.other_level)
            keys.update(found.other_keys)
            parameters.update(found.keys)
            places.update(found.places)
        elif need == Ticket.TIME:
            level = 2
            keys.add("t")
            places.add(_TIME)
        elif need == Ticket.ACCURACY:
            keys.add("accuracy")
        elif need == Ticket.XC:
            level, other = (2, 2) if place.xc[1] > place.xc[0] else (level, other)
            keys.update(("xc", m) for m in chain)
        elif need == Ticket.XA:
            level = max(level, 1)
            keys.update(("xa", m) for m in chain)
        elif need == "work":
            level, other = max(level, 1), max(other, 1)
            keys.update(("xa", m) for m in chain)
        elif need == Ticket.XD:
            level = max(level, 1)
            keys.update(("xd", g) for g in range(*place.groups))
            places.add(place.xd)
        elif need == Ticket.PN:
            parameters.update(("pn", g) for g in range(*place.parameters))
            places.add(place.p)
        elif need == Ticket.PA:
            keys.update(("pa", m) for m in chain)
        if need in (Ticket.XC, Ticket.XD, Ticket.XA, "work"):
            keys.update(("x", m) for m in chain)
        elif need in (Ticket.PN, Ticket.PA):
            keys.update(("p", m) for m in chain)
    spans = tuple(sorted(span for span in places if span[1] > span[0]))
    return Sources(level, tuple(keys | parameters), spans, other, tuple(keys))


def _of_input(layout: Layout, slot: Slot) -> Sources:
    if slot.row >= 0:
        row = layout.rows[slot.row]
        return freshness(layout, row.node, layout.needs[row.node, row.output])
    if slot.free >= 0:
        return Sources(0, (("fixed", slot.free),), (), 0, (("fixed", slot.free),))
    for n in layout.leaves:
        if any(s is slot or s == slot for s in layout.places[n].outputs):
            return freshness(layout, n, {Ticket.XC, Ticket.XD, Ticket.XA})
    return Sources(2, (), (), 2, ())
