"""Which kernels find the contacts of a scene."""

from __future__ import annotations

import numpy as np

from sheldrake.common.chain import Chain
from sheldrake.common.kernel import Kernel
from sheldrake.geometry._kernels.contacts import (
    box_pairs,
    convex_pairs,
    half_space_pairs,
    place_geometries,
    sphere_pairs,
)
from sheldrake.geometry._kernels.model import (
    BOX,
    ELLIPSOID,
    HALF_SPACE,
    SPHERE,
    BodyPoses,
    ContactTable,
    Found,
    Geometry,
    GeometryModel,
    is_watched,
)
from sheldrake.geometry._kernels.near import list_near_pairs
from sheldrake.geometry._kernels.order import sort_contacts
from sheldrake.geometry._kernels.spatial_hash import (
    close_box_pairs,
    close_convex_pairs,
    close_pairs,
    close_sphere_pairs,
    make_cells,
)

_FAMILIES = (half_space_pairs, sphere_pairs, box_pairs, convex_pairs)


def has_pairs(model: GeometryModel) -> bool:
    """Whether anything can touch."""
    return len(model.pair) + len(model.cell) > 0


def family_kernels(model: GeometryModel) -> list[Kernel]:
    """The kernels of the families that have pairs; one that lists near ones, one that sorts if there are several."""
    present = [k for k, n in zip(_FAMILIES, np.diff(model.family)) if n > 0]
    if len(model.cell):
        return [*present, close_pairs, *_close_kernels(model), sort_contacts]
    if is_watched(model):
        present = [list_near_pairs, *present]
    return [*present, sort_contacts] if np.count_nonzero(np.diff(model.family)) > 1 else present


def _close_kernels(model: GeometryModel) -> list[Kernel]:
    """The kernels of the families that the shapes of a model with cells can form."""
    kinds = {int(kind) for kind in model.geometry[:, Geometry.kind] if kind != HALF_SPACE}
    boxes, spheres = BOX in kinds, SPHERE in kinds
    others = kinds - {BOX, SPHERE}
    convex = bool(others) and (bool(kinds - {SPHERE}) or any(kind > ELLIPSOID for kind in others))
    families = ((close_sphere_pairs, spheres), (close_box_pairs, boxes), (close_convex_pairs, convex))
    return [kernel for kernel, needed in families if needed]


def find_contacts(model: GeometryModel, X_WB: np.ndarray, table: ContactTable, native: bool = True) -> int:
    """Fills the table with all contacts, ordered by pair.

    Args:
        model: the geometry.
        X_WB: poses of the bodies, R row-major then p [m], shape (num_bodies, 12).
        table: where contacts go.
        native: False runs the kernels' Python sources.

    Returns:
        0, or the status of the search.
    """
    search = Chain([place_geometries, *family_kernels(model)])
    (search.native if native else search)(
        geometry_model=model, bodies=BodyPoses(X_WB), table=table, cells=make_cells(model)
    )
    return int(table.count[Found.status])
