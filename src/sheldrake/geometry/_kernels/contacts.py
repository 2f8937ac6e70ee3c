"""All contacts of a scene: place geometry, discard far pairs, collide the others."""

from __future__ import annotations

from sheldrake.common._kernels.vec import dot3, sub3
from sheldrake.common.kernel import Matrix, kernel

from .box_box import box_box_contacts
from .convex import convex_contacts
from .half_space import half_space_contacts
from .model import BOUND, BOX, ELLIPSOID, HALF_SPACE, KIND, SPHERE, Z_AXIS, ContactTable, GeometryModel
from .sphere import sphere_contacts
from .table import bounding_centre, column, place_geometry, position_of, rotation_of


@kernel
def far_apart(model, table, i, j):
    """True if the bounding spheres of i and j (or of i and half space j) do not meet."""
    p_WI = bounding_centre(model, table, i)
    if model.geometry[j, KIND] == HALF_SPACE:
        nhat = column(rotation_of(table, j), Z_AXIS)
        return dot3(nhat, sub3(p_WI, position_of(table, j))) > model.size[i, BOUND]
    r = sub3(bounding_centre(model, table, j), p_WI)
    reach = model.size[i, BOUND] + model.size[j, BOUND]
    return dot3(r, r) > reach * reach


@kernel(outline=True)
def collide(model, table, a, b):
    """Contacts of geometries a and b, if any."""
    i = a
    j = b
    if model.geometry[b, KIND] < model.geometry[a, KIND]:
        i = b
        j = a
    if far_apart(model, table, i, j):
        return
    if model.geometry[j, KIND] == HALF_SPACE:
        half_space_contacts(model, table, i, j)
    elif model.geometry[i, KIND] == SPHERE and model.geometry[j, KIND] <= ELLIPSOID:
        sphere_contacts(model, table, i, j)
    elif model.geometry[i, KIND] == BOX and model.geometry[j, KIND] == BOX:
        box_box_contacts(model, table, i, j)
    else:
        convex_contacts(model, table, i, j)


@kernel(outline=True)
def find_contacts(geometry_model, X_WB, table):
    """Fills the table with all contacts, ordered by pair; the number of them, or minus the status of the search."""
    place_geometry(geometry_model, X_WB, table)
    table.count[0] = 0
    table.count[1] = 0
    for k in range(geometry_model.pair.shape[0]):
        collide(geometry_model, table, geometry_model.pair[k, 0], geometry_model.pair[k, 1])
    if table.count[1] != 0:
        return -table.count[1]
    return table.count[0]


@kernel(top=True)
def find_all_contacts(geometry_model: GeometryModel, X_WB: Matrix, table: ContactTable) -> int:
    """`find_contacts` as an entry: 0, or the status of the search."""
    find_contacts(geometry_model, X_WB, table)
    return table.count[1]
