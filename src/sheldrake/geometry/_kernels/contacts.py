"""All contacts of a scene: place geometry, then family by family discard far pairs and collide the others."""

from __future__ import annotations

from sheldrake.common._kernels.vec import compose, dot3, rotate_back, sub3, transpose
from sheldrake.common.kernel import IntMatrix, kernel

from .box_box import box_box_contacts
from .convex import convex_contacts
from .half_space import half_space_contacts
from .memory import remembers
from .model import CAPSULE, HALF_SPACE, Z_AXIS, BodyPoses, ContactTable, GeometryModel
from .near import pairs_of, spheres_within, widest_margin
from .sphere import sphere_contacts
from .table import absolute, column, contacts_in_lanes, ordered, place_geometry, reach_along


@kernel
def spheres_apart(model, table, a, b):
    """True if the bounding spheres of a and b do not meet."""
    return not spheres_within(model, table, a, b, widest_margin(model))


@kernel
def half_extents(model, g):
    """Of the box around a shape, in the axes of its frame, about the centre of its bounding sphere [m]."""
    h = model[g].half_sizes
    if model[g].kind == CAPSULE:
        return (h[0], h[0], h[0] + h[2])
    return h


@kernel
def apart_along(model, table, a, b, axis):
    """True if the boxes around a and b are apart along an axis of the first (0 to 2) or of the second (3 to 5)."""
    g, h = half_extents(model, a), half_extents(model, b)
    margin = widest_margin(model)
    g = (g[0] + margin, g[1] + margin, g[2] + margin)
    n = column(table.poses[a if axis < 3 else b].R_WG, axis % 3)
    t = dot3(n, sub3(table.poses[b].centre_W, table.poses[a].centre_W))
    reach_a = reach_along(g, rotate_back(table.poses[a].R_WG, n))
    return absolute(t) > reach_a + reach_along(h, rotate_back(table.poses[b].R_WG, n))


@kernel(outline=True)
def axis_between(model, table, a, b):
    """An axis along which the boxes around a and b are apart, or -1 (Gottschalk et al. 1996)."""
    R_WA = table.poses[a].R_WG
    R = compose(transpose(R_WA), table.poses[b].R_WG)
    t = rotate_back(R_WA, sub3(table.poses[b].centre_W, table.poses[a].centre_W))
    h = half_extents(model, b)
    g = half_extents(model, a)
    margin = widest_margin(model)
    g = (g[0] + margin, g[1] + margin, g[2] + margin)
    for k in range(3):
        row = (R[3 * k], R[3 * k + 1], R[3 * k + 2])
        if absolute(t[k]) > g[k] + reach_along(h, row):
            return k
        axis = column(R, k)
        if absolute(dot3(t, axis)) > reach_along(g, axis) + h[k]:
            return 3 + k
    return -1


@kernel
def above(model, table, i, j):
    """True if the bounding sphere of i does not reach half space j."""
    nhat = column(table.poses[j].R_WG, Z_AXIS)
    reach = model[i].bound + widest_margin(model)
    return dot3(nhat, sub3(table.poses[i].centre_W, table.poses[j].p_WG)) > reach


@kernel
def collide(model, table, first, last, near_first, near_last, contacts):
    """Adds the contacts of those of pairs `first` to `last` - 1 that are not apart; see `pairs_of`."""
    for k in pairs_of(table, first, last, near_first, near_last):
        i, j = ordered(model, model.pairs[k].a, model.pairs[k].b)
        if not spheres_apart(model, table, i, j):
            contacts(model, table, i, j)


@kernel(top=True)
def place_geometries(geometry_model: GeometryModel, bodies: BodyPoses, table: ContactTable) -> None:
    """Poses of all geometries for those of the bodies; empties the table."""
    place_geometry(geometry_model, bodies, table)


@kernel(top=True)
def bounds_that_meet(geometry_model: GeometryModel, table: ContactTable, found: IntMatrix) -> int:
    """Lists the pairs whose bounding spheres meet, or reach a half space; how many."""
    model, count = geometry_model, 0
    for k in range(model.end_of_pairs):
        a, b = model.pairs[k].a, model.pairs[k].b
        i, j = ordered(model, a, b)
        if model[j].kind == HALF_SPACE:
            nhat = column(table.poses[j].R_WG, Z_AXIS)
            near = dot3(nhat, sub3(table.poses[i].centre_W, table.poses[j].p_WG)) <= model[i].bound
        else:
            near = spheres_within(model, table, i, j, 0.0)
        if near:
            found[count, 0], found[count, 1] = a, b
            count += 1
    return count


@kernel(top=True, lanes=contacts_in_lanes)
def half_space_pairs(geometry_model: GeometryModel, table: ContactTable) -> None:
    """Adds the contacts with half spaces."""
    model = geometry_model
    for k in range(model.half_space_pairs, model.sphere_pairs):
        i, j = ordered(model, model.pairs[k].a, model.pairs[k].b)
        if not above(model, table, i, j):
            half_space_contacts(model, table, i, j)


@kernel(top=True, lanes=contacts_in_lanes)
def sphere_pairs(geometry_model: GeometryModel, table: ContactTable) -> None:
    """Adds the contacts of spheres with spheres, boxes, cylinders, capsules and ellipsoids."""
    model = geometry_model
    collide(model, table, model.sphere_pairs, model.box_pairs, 0, table.near_boxes, sphere_contacts)


@kernel(top=True)
def box_pairs(geometry_model: GeometryModel, table: ContactTable) -> None:
    """Adds the contacts of boxes with boxes."""
    model = geometry_model
    near, end = table.near_boxes, table.near_convex
    collide(model, table, model.box_pairs, model.convex_pairs, near, end, box_box_contacts)


@kernel
def convex_contacts_if_near(model, table, i, j):
    """Contacts of shapes whose bounding spheres meet: of those whose boxes meet as well. Nothing is remembered."""
    if axis_between(model, table, i, j) < 0:
        convex_contacts(model, table, i, j, -1)


@kernel
def boxes_apart(model, table, i, j, k):
    """Whether the boxes around the shapes of pair k are apart; of a pair of which more is remembered nobody asks."""
    if not remembers(table, k):
        return axis_between(model, table, i, j) >= 0
    memory = table.memories[k]
    if memory.how != 0:
        return False
    if apart_along(model, table, i, j, memory.axis):
        return True
    axis = axis_between(model, table, i, j)
    if axis >= 0:
        memory.axis = axis
    return axis >= 0


@kernel(top=True)
def convex_pairs(geometry_model: GeometryModel, table: ContactTable) -> None:
    """Adds the contacts of all other convex pairs."""
    model = geometry_model
    first = model.convex_pairs
    for k in pairs_of(table, first, model.end_of_pairs, table.near_convex, table.end_of_near):
        i, j = ordered(model, model.pairs[k].a, model.pairs[k].b)
        if not (spheres_apart(model, table, i, j) or boxes_apart(model, table, i, j, k - first)):
            convex_contacts(model, table, i, j, k - first)
