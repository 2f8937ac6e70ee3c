"""Distances of a plant's geometry and how they change with its velocities."""

from __future__ import annotations

import math

from sheldrake.common._kernels.vec import add3, cross3, dot3
from sheldrake.common.kernel import IntMatrix, IntVector, Matrix, Vector, kernel
from sheldrake.common.record import Record, number
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


class Bound(Record):
    """A smooth bound on the least of the distances of pairs."""

    bound = number("what distances are to be above, or the least of them below", "m")
    influence = number("from which on they do not count", "m")
    scale = number("factor of the penalty, which makes it 1 at the bound")
    alpha = number("how much the largest penalty outweighs others")
    pairs = number("how many pairs there are, near or not")
    is_over = number("whether the value is never below the largest penalty, instead of never above it")


@kernel
def hinge(x):
    """0 for x >= 0, x^2 / 2 for -1 < x < 0, -1/2 - x for x <= -1."""
    if x >= 0.0:
        return 0.0
    if x <= -1.0:
        return -0.5 - x
    return 0.5 * x * x


@kernel
def hinge_slope(x):
    return min(0.0, max(-1.0, x))


@kernel(top=True, short_loops=True)
def smooth_bound(
    table: ContactTable, slopes: Matrix, least: Bound, penalties: Matrix, value: Vector, with_slope: int
) -> None:
    """Penalties of all distances as one number, and how it changes with v.

    Args:
        table: Pairs and their distances.
        slopes: Of the distances, one row a pair, if they are wanted.
        least: What is bounded.
        penalties: Scratch: of each pair, and its weight, shape (pairs, 2).
        value: Filled: the number, then its derivatives, shape (1 + nv,).
        with_slope: Whether derivatives are wanted.
    """
    width = least.influence - least.bound
    near, top = 0, 0.0
    for i in range(table.num_contacts):
        distance = -table[i].depth
        penalties[i, 0] = least.scale * hinge((distance - least.influence) / width)
        penalties[i, 1] = 0.0
        if distance < least.influence:
            near += 1
            penalties[i, 1] = 1.0
            top = max(top, penalties[i, 0])
    for k in range(len(value)):
        value[k] = 0.0
    if near == 0 and least.pairs == 0.0:
        return
    # No penalty is negative: of pairs that are far it is 0, where `top` begins.
    total = max(0.0, least.pairs - near) * math.exp(-least.alpha * top)
    mean = 0.0
    for i in range(table.num_contacts):
        if penalties[i, 1] > 0.0:
            penalties[i, 1] = math.exp(least.alpha * (penalties[i, 0] - top))
            total += penalties[i, 1]
            mean += penalties[i, 1] * penalties[i, 0]
    mean = mean / total
    value[0] = top + math.log(total) / least.alpha if least.is_over > 0.0 else mean
    if with_slope != 0:
        for i in range(table.num_contacts):
            weight = penalties[i, 1] / total
            if least.is_over <= 0.0:
                weight *= 1.0 + least.alpha * (penalties[i, 0] - mean)
            if weight != 0.0:
                weight *= least.scale / width * hinge_slope((-table[i].depth - least.influence) / width)
                for k in range(slopes.shape[1]):
                    value[1 + k] += weight * slopes[i, k]
