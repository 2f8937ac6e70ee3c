"""Which pairs are near: a list that holds until something has moved too far (Verlet 1967, section II).

A pair whose bounding spheres are more than a skin apart can not touch before its two shapes have moved by the skin
relative to each other. So most pairs of a robot are looked at once in many steps. What all move by, as a robot that
falls, brings no two of them nearer: only the spread of the displacements counts. A thin skin makes many lists, a thick
one long ones: it is doubled or halved until both take about as long.
"""

from __future__ import annotations

from sheldrake.common._kernels.vec import dot3, sub3
from sheldrake.common.kernel import kernel

from .model import HALF_SPACE, ContactTable, GeometryModel

_SPENT = 0.999  # of the skin: the rest is for rounding
_MOST_DOUBLINGS = 8


@kernel
def widest_margin(model):
    """How far ahead of touching the contact points of any pair are seen [m]."""
    return model.several_margin + model.elastic_margin


@kernel
def spheres_within(model, table, a, b, reach):
    """Whether the bounding spheres of a and b are no farther apart than `reach` [m]."""
    r = sub3(table.poses[a].centre_W, table.poses[b].centre_W)
    reach += model[a].bound + model[b].bound
    return not dot3(r, r) > reach * reach


@kernel
def skin_of(model, table):
    """How far apart the bounding spheres of near pairs may be [m]."""
    return model.skin * (1 << table.near_doublings)


@kernel
def have_moved(model, table):
    """Whether two geometries may be nearer by more than the skin than when near pairs were listed."""
    low, high = (1e300, 1e300, 1e300), (-1e300, -1e300, -1e300)
    for g in range(len(table.sights)):
        if model[g].kind != HALF_SPACE:
            d = sub3(table.poses[g].centre_W, table.sights[g].centre_W)
            low = (min(low[0], d[0]), min(low[1], d[1]), min(low[2], d[2]))
            high = (max(high[0], d[0]), max(high[1], d[1]), max(high[2], d[2]))
    spread = sub3(high, low)
    spent = _SPENT * skin_of(model, table)
    return not dot3(spread, spread) <= spent * spent


@kernel
def list_family(model, table, first, last, count):
    """Lists the near ones of pairs `first` to `last` - 1 from place `count` on; the place after them."""
    reach = widest_margin(model) + skin_of(model, table)
    for k in range(first, last):
        if spheres_within(model, table, model.pairs[k].a, model.pairs[k].b, reach):
            table.near[count] = k
            count += 1
    return count


@kernel
def work_to_list(model):
    """How many pairs are looked at to make the list."""
    return model.end_of_pairs - model.sphere_pairs


@kernel
def work_to_read(table):
    """How many pairs of the list have been looked at since it was made."""
    return table.near_held * table.end_of_near


@kernel
def is_too_long(model, table):
    """Whether a list of a thick skin has taken longer to read than two would have taken to make."""
    return table.near_doublings > 0 and work_to_read(table) > 2 * work_to_list(model)


@kernel(top=True)
def list_near_pairs(geometry_model: GeometryModel, table: ContactTable) -> None:
    """Brings the list of near pairs up to date."""
    model = geometry_model
    if table.near_known == 1:
        too_long = is_too_long(model, table)
        if not (too_long or have_moved(model, table)):
            table.near_held += 1
            return
        if too_long:
            table.near_doublings -= 1
        elif work_to_list(model) > 2 * work_to_read(table) and table.near_doublings < _MOST_DOUBLINGS:
            table.near_doublings += 1
    table.near_held = 1
    for g in range(len(table.sights)):
        table.sights[g].centre_W = table.poses[g].centre_W
    table.near_boxes = list_family(model, table, model.sphere_pairs, model.box_pairs, 0)
    table.near_convex = list_family(model, table, model.box_pairs, model.convex_pairs, table.near_boxes)
    table.end_of_near = list_family(model, table, model.convex_pairs, model.end_of_pairs, table.near_convex)
    table.near_known = 1


@kernel
def pairs_of(table, first, last, near_first, near_last):
    """Of pairs `first` to `last` - 1 those that may touch: these places of the list, or all if there is none."""
    listed = len(table.near) > 0
    for n in range(near_first if listed else first, near_last if listed else last):
        yield table.near[n] if listed else n
