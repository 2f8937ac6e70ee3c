"""All contacts of a scene: place geometry, discard far pairs, collide the others."""

from __future__ import annotations

from sheldrake.common._kernels.vec import dot3, sub3
from sheldrake.common.kernel import Matrix, kernel

from .box_box import box_box_contacts
from .convex import convex_contacts
from .half_space import half_space_contacts
from .model import (
    BOUND,
    BOX,
    ELLIPSOID,
    HALF_SPACE,
    KIND,
    SPHERE,
    UNSUPPORTED_PAIR,
    Z_AXIS,
    ContactTable,
    GeometryModel,
)
from .sphere import sphere_contacts
from .table import bounding_centre, column, place_geometry, position_of, rotation_of


@kernel
def spheres_apart(model, table, a, b):
    """True if the bounding spheres of a and b do not meet; a half space meets everything."""
    r = sub3(bounding_centre(table, a), bounding_centre(table, b))
    reach = model.size[a, BOUND] + model.size[b, BOUND]
    return dot3(r, r) > reach * reach


@kernel
def above(model, table, i, j):
    """True if the bounding sphere of i does not reach half space j."""
    nhat = column(rotation_of(table, j), Z_AXIS)
    return dot3(nhat, sub3(bounding_centre(table, i), position_of(table, j))) > model.size[i, BOUND]


@kernel(outline=True)
def collide(model, table, a, b):
    """Contacts of geometries a and b, whose bounding spheres meet, if any."""
    i, j = in_order(model, a, b)
    if model.geometry[j, KIND] == HALF_SPACE:
        if not above(model, table, i, j):
            half_space_contacts(model, table, i, j)
    elif model.geometry[i, KIND] == SPHERE and model.geometry[j, KIND] <= ELLIPSOID:
        sphere_contacts(model, table, i, j)
    elif model.geometry[i, KIND] == BOX and model.geometry[j, KIND] == BOX:
        box_box_contacts(model, table, i, j)
    else:
        convex_contacts(model, table, i, j)


@kernel(outline=True)
def collide_basic(model, table, a, b):
    """The same for pairs with a half space, or of a sphere and another round or flat shape."""
    i, j = in_order(model, a, b)
    if model.geometry[j, KIND] == HALF_SPACE:
        if not above(model, table, i, j):
            half_space_contacts(model, table, i, j)
    elif model.geometry[i, KIND] == SPHERE and model.geometry[j, KIND] <= ELLIPSOID:
        sphere_contacts(model, table, i, j)
    else:
        table.count[1] = UNSUPPORTED_PAIR


@kernel
def in_order(model, a, b):
    """The two geometries in the order in which pair kernels take them."""
    if model.geometry[b, KIND] < model.geometry[a, KIND]:
        return b, a
    return a, b


@kernel
def begin_search(model, X_WB, table):
    place_geometry(model, X_WB, table)
    table.count[0] = 0
    table.count[1] = 0


@kernel
def search_result(table):
    """The number of contacts, or minus the status of the search."""
    if table.count[1] != 0:
        return -table.count[1]
    return table.count[0]


@kernel(outline=True)
def find_contacts(geometry_model, X_WB, table):
    """Fills the table with all contacts, ordered by pair; the number of them, or minus the status of the search."""
    begin_search(geometry_model, X_WB, table)
    for k in range(geometry_model.pair.shape[0]):
        a = geometry_model.pair[k, 0]
        b = geometry_model.pair[k, 1]
        if not spheres_apart(geometry_model, table, a, b):
            collide(geometry_model, table, a, b)
    return search_result(table)


@kernel(outline=True)
def find_basic_contacts(geometry_model, X_WB, table):
    """The same for models whose pairs are all basic (`is_basic`); takes a third of the time to compile."""
    begin_search(geometry_model, X_WB, table)
    for k in range(geometry_model.pair.shape[0]):
        a = geometry_model.pair[k, 0]
        b = geometry_model.pair[k, 1]
        if not spheres_apart(geometry_model, table, a, b):
            collide_basic(geometry_model, table, a, b)
    return search_result(table)


@kernel(top=True)
def find_all_contacts(geometry_model: GeometryModel, X_WB: Matrix, table: ContactTable) -> int:
    """`find_contacts` as an entry: 0, or the status of the search."""
    find_contacts(geometry_model, X_WB, table)
    return table.count[1]
