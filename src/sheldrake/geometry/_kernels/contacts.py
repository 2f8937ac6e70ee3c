"""All contacts of a scene: place geometry, then family by family discard far pairs and collide the others."""

from __future__ import annotations

from sheldrake.common._kernels.vec import compose, dot3, load3, rotate_back, sub3, transpose
from sheldrake.common.kernel import Matrix, kernel

from .box_box import box_box_contacts
from .convex import convex_contacts
from .half_space import half_space_contacts
from .model import (
    BOUND,
    BOXES,
    CAPSULE,
    CONVEX,
    ELASTIC,
    HALF_SPACES,
    KIND,
    SEVERAL,
    SPHERES,
    Z_AXIS,
    ContactTable,
    GeometryModel,
)
from .sphere import sphere_contacts
from .table import absolute, bounding_centre, column, place_geometry, position_of, rotation_of


@kernel
def widest_margin(model):
    return model.margin[SEVERAL] + model.margin[ELASTIC]


@kernel
def spheres_apart(model, table, a, b):
    """True if the bounding spheres of a and b do not meet."""
    r = sub3(bounding_centre(table, a), bounding_centre(table, b))
    reach = model.size[a, BOUND] + model.size[b, BOUND] + widest_margin(model)
    return dot3(r, r) > reach * reach


@kernel
def half_extents(model, g):
    """Of the box around a shape, in the axes of its frame, about the centre of its bounding sphere [m]."""
    h = load3(model.size, g)
    if model.geometry[g, KIND] == CAPSULE:
        return (h[0], h[0], h[0] + h[2])
    return h


@kernel(outline=True)
def boxes_apart(model, table, a, b):
    """True if a plane parallel to two axes of the boxes around a and b is between them (Gottschalk et al. 1996)."""
    R_WA = rotation_of(table, a)
    R = compose(transpose(R_WA), rotation_of(table, b))
    t = rotate_back(R_WA, sub3(bounding_centre(table, b), bounding_centre(table, a)))
    h = half_extents(model, b)
    g = half_extents(model, a)
    margin = widest_margin(model)
    g = (g[0] + margin, g[1] + margin, g[2] + margin)
    for k in range(3):
        row = (R[3 * k], R[3 * k + 1], R[3 * k + 2])
        if absolute(t[k]) > g[k] + absolute(row[0]) * h[0] + absolute(row[1]) * h[1] + absolute(row[2]) * h[2]:
            return True
        axis = column(R, k)
        reach = absolute(axis[0]) * g[0] + absolute(axis[1]) * g[1] + absolute(axis[2]) * g[2]
        if absolute(dot3(t, axis)) > reach + h[k]:
            return True
    return False


@kernel
def above(model, table, i, j):
    """True if the bounding sphere of i does not reach half space j."""
    nhat = column(rotation_of(table, j), Z_AXIS)
    reach = model.size[i, BOUND] + widest_margin(model)
    return dot3(nhat, sub3(bounding_centre(table, i), position_of(table, j))) > reach


@kernel
def begin_contacts(model, X_WB, table):
    """Places the geometry; no contacts yet."""
    place_geometry(model, X_WB, table)
    table.count[0] = 0
    table.count[1] = 0


@kernel
def ordered(model, a, b):
    """The two geometries, the one of the lower kind first."""
    if model.geometry[b, KIND] < model.geometry[a, KIND]:
        return b, a
    return a, b


@kernel(top=True)
def place_geometries(geometry_model: GeometryModel, X_WB: Matrix, table: ContactTable) -> None:
    """Poses of all geometries for those of the bodies; empties the table."""
    begin_contacts(geometry_model, X_WB, table)


@kernel(top=True)
def half_space_pairs(geometry_model: GeometryModel, table: ContactTable) -> None:
    """Adds the contacts with half spaces."""
    model = geometry_model
    for k in range(model.family[HALF_SPACES], model.family[HALF_SPACES + 1]):
        i, j = ordered(model, model.pair[k, 0], model.pair[k, 1])
        if not above(model, table, i, j):
            half_space_contacts(model, table, i, j)


@kernel(top=True)
def sphere_pairs(geometry_model: GeometryModel, table: ContactTable) -> None:
    """Adds the contacts of spheres with spheres, boxes, cylinders, capsules and ellipsoids."""
    model = geometry_model
    for k in range(model.family[SPHERES], model.family[SPHERES + 1]):
        a = model.pair[k, 0]
        b = model.pair[k, 1]
        if not spheres_apart(model, table, a, b):
            i, j = ordered(model, a, b)
            sphere_contacts(model, table, i, j)


@kernel(top=True)
def box_pairs(geometry_model: GeometryModel, table: ContactTable) -> None:
    """Adds the contacts of boxes with boxes."""
    model = geometry_model
    for k in range(model.family[BOXES], model.family[BOXES + 1]):
        a = model.pair[k, 0]
        b = model.pair[k, 1]
        if not spheres_apart(model, table, a, b):
            i, j = ordered(model, a, b)
            box_box_contacts(model, table, i, j)


@kernel(top=True)
def convex_pairs(geometry_model: GeometryModel, table: ContactTable) -> None:
    """Adds the contacts of all other convex pairs."""
    model = geometry_model
    for k in range(model.family[CONVEX], model.family[CONVEX + 1]):
        a = model.pair[k, 0]
        b = model.pair[k, 1]
        if not spheres_apart(model, table, a, b) and not boxes_apart(model, table, a, b):
            i, j = ordered(model, a, b)
            convex_contacts(model, table, i, j)
