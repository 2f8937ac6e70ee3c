"""Distances of a plant's geometry and how they change with its velocities."""

from __future__ import annotations

from sheldrake.common._kernels.vec import add3, cross3, dot3
from sheldrake.common.kernel import IntMatrix, IntVector, Matrix, kernel
from sheldrake.geometry._kernels.model import ContactTable
from sheldrake.multibody.tree._kernels.kinematics import from_root
from sheldrake.multibody.tree._kernels.model import TreeModel, TreeWork


@kernel(top=True, short_loops=True)
def place_bodies(poses: Matrix, places: IntMatrix, placed: Matrix) -> None:
    """Puts frames with geometry where the plant has them.

    Args:
        poses: X_WB by body of the plant.
        places: Of each frame: its row in `placed` and its row in `poses`.
        placed: X_WB by frame.
    """
    for i in range(places.shape[0]):
        for k in range(placed.shape[1]):
            placed[places[i, 0], k] = poses[places[i, 1], k]


@kernel(top=True, short_loops=True)
def distance_slopes(model: TreeModel, work: TreeWork, table: ContactTable, body: IntVector, slopes: Matrix) -> None:
    """By each v, how the distance of each pair in the table changes; needs `position_kinematics`.

    Args:
        model: The tree.
        work: Its workspace.
        table: Pairs, and where they are nearest.
        body: Of the plant, by geometry.
        slopes: Filled, one row a pair, shape (pairs, nv).
    """
    for i in range(table.num_contacts):
        for k in range(slopes.shape[1]):
            slopes[i, k] = 0.0
        contact = table[i]
        add_slope(model, work, body[table.pair[i, 0]], contact.p_WCa, contact.nhat_BA_W, 1.0, slopes, i)
        add_slope(model, work, body[table.pair[i, 1]], contact.p_WCb, contact.nhat_BA_W, -1.0, slopes, i)


@kernel
def add_slope(model, work, b, p_WC, nhat_W, sign, slopes, i):
    """Adds sign times the velocity along nhat of the point of body b that is at p_WC."""
    p_RootC = from_root(model, work, b, p_WC)
    k = model.bodies[b].tip
    while k >= 0:
        w, u = work.dofs[k].S
        slopes[i, k] += sign * dot3(nhat_W, add3(u, cross3(w, p_RootC)))
        k = model.dofs[k].parent
