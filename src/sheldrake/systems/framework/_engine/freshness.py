"""What a value depends on: how often the event loop can change it, and which writes from Python do."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from sheldrake.systems.framework._engine.memory import Memory, Slot
from sheldrake.systems.framework._index import Ticket

if TYPE_CHECKING:
    from sheldrake.systems.framework._engine.layout import Layout


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


def freshness(layout: Layout, n: int, needs: Iterable) -> tuple[int, tuple]:
    """What tells whether a value of node `n` that needs these sources is up to date.

    Returns:
        The level at which the event loop may change it, and the names of the sources Python may write.
    """
    chain, m = [], n
    while m >= 0:
        chain.append(m)
        m = layout.nodes[m].parent
    place, level = layout.places[n], 0
    keys: set[Any] = {"all"}
    for need in needs:
        if isinstance(need, tuple):
            slot = place.inputs[need[1]]
            if slot.row >= 0:
                row = layout.rows[slot.row]
                found = freshness(layout, row.node, layout.needs[row.node, row.output])
            elif slot.free >= 0:
                found = 0, (("fixed", slot.free),)
            else:
                found = _state_freshness(layout, slot)
            level = max(level, found[0])
            keys.update(found[1])
        elif need == Ticket.TIME:
            level = 2
            keys.add("t")
        elif need == Ticket.ACCURACY:
            keys.add("accuracy")
        elif need == Ticket.XC:
            level = 2 if place.xc[1] > place.xc[0] else level
            keys.update(("xc", m) for m in chain)
        elif need in (Ticket.XA, "work"):
            level = max(level, 1)
            keys.update(("xa", m) for m in chain)
        elif need == Ticket.XD:
            level = max(level, 1)
            keys.update(("xd", g) for g in range(*place.groups))
        elif need == Ticket.PN:
            keys.update(("pn", g) for g in range(*place.parameters))
        elif need == Ticket.PA:
            keys.update(("pa", m) for m in chain)
        if need in (Ticket.XC, Ticket.XD, Ticket.XA, "work"):
            keys.update(("x", m) for m in chain)
        elif need in (Ticket.PN, Ticket.PA):
            keys.update(("p", m) for m in chain)
    return level, tuple(keys)


def _state_freshness(layout: Layout, slot: Slot) -> tuple[int, tuple]:
    for n in layout.leaves:
        if any(s is slot or s == slot for s in layout.places[n].outputs):
            return freshness(layout, n, {Ticket.XC, Ticket.XD, Ticket.XA})
    return 2, ()
