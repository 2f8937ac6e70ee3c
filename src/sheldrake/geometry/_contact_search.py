"""Which kernels find the contacts of a scene."""

from __future__ import annotations

import numpy as np

from sheldrake.common.chain import Chain
from sheldrake.common.kernel import Kernel

from ._kernels.contacts import (
    box_pairs,
    convex_pairs,
    half_space_pairs,
    place_geometries,
    sphere_pairs,
)
from ._kernels.model import ContactTable, GeometryModel
from ._kernels.order import sort_contacts

_FAMILIES = (half_space_pairs, sphere_pairs, box_pairs, convex_pairs)


def family_kernels(model: GeometryModel) -> list[Kernel]:
    """The kernels of the families that have pairs, and one that sorts when there are several."""
    present = [k for k, n in zip(_FAMILIES, np.diff(model.family)) if n > 0]
    return [*present, sort_contacts] if len(present) > 1 else present


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
    (search.native if native else search)(geometry_model=model, X_WB=X_WB, table=table)
    return int(table.count[1])
