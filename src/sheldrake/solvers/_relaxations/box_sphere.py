"""Where boxes of a grid meet the unit sphere, and planes that bound these regions."""

from __future__ import annotations

import functools
import itertools
from typing import NamedTuple

import numpy as np

_SAME = 1e-10


class Region(NamedTuple):
    """The part of the unit sphere in a box of the orthant x, y, z >= 0.

    Attributes:
        corners: Where edges of the box meet the sphere, shape (k, 3); none if the box misses it.
        normal: Axis of the smallest cone that holds the region, shape (3,).
        cosine: Cosine of the angle of the cone.
        facets: Unit normals a and offsets b with a x >= b in the region, shape (m, 4).
    """

    corners: np.ndarray
    normal: np.ndarray
    cosine: float
    facets: np.ndarray


@functools.lru_cache
def regions(num_intervals: int) -> dict[tuple[int, int, int], Region]:
    """The regions of a grid that cuts [0, 1] into equal intervals, by the indices of its boxes."""
    phi = np.linspace(0.0, 1.0, num_intervals + 1)
    one = range(num_intervals)
    boxes = itertools.product(one, one, one)
    return {box: _region(np.array([(phi[i], phi[i + 1]) for i in box])) for box in boxes}


def _region(box: np.ndarray) -> Region:
    corners = _edge_points(box)
    if len(corners) == 0:
        return Region(corners, np.zeros(3), 0.0, np.zeros((0, 4)))
    nearest = _nearest_of_hull(corners)
    distance = float(np.linalg.norm(nearest))
    return Region(corners, nearest / distance, min(distance, 1.0), _inner_facets(corners))


def _edge_points(box: np.ndarray) -> np.ndarray:
    """Where the edges of a box, shape (3, 2), meet the unit sphere."""
    found: list[np.ndarray] = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for a, b in itertools.product(box[u], box[v]):
            square = 1.0 - a * a - b * b
            t = np.sqrt(max(square, 0.0))
            if square < -_SAME or not box[axis, 0] - _SAME <= t <= box[axis, 1] + _SAME:
                continue
            p = np.empty(3)
            p[axis], p[u], p[v] = t, a, b
            if all(np.abs(p - q).max() > _SAME for q in found):
                found.append(p)
    return np.array(found).reshape(-1, 3)


def _nearest_of_hull(points: np.ndarray) -> np.ndarray:
    """The point nearest to the origin of the convex hull of points of the sphere: it lies on at most three of them."""
    best, best_norm = points[0], 1.0
    for count in (2, 3):
        for chosen in itertools.combinations(points, min(count, len(points))):
            P = np.array(chosen)
            system = np.block([[P @ P.T, np.ones((len(P), 1))], [np.ones((1, len(P))), np.zeros((1, 1))]])
            weights = np.linalg.lstsq(system, np.append(np.zeros(len(P)), 1.0), rcond=None)[0][:-1]
            p = weights @ P
            if weights.min() < -_SAME or np.linalg.norm(p) >= best_norm:
                continue
            if (points @ p).min() >= p @ p - _SAME:  # Nothing of the hull is nearer.
                return p
            best, best_norm = p, float(np.linalg.norm(p))
    return best


def _inner_facets(points: np.ndarray) -> np.ndarray:
    """Planes through three points that have the others on their outer side.

    With a normal of no negative element, a x is concave along the arcs that bound the region: its least value is at a
    corner, and the plane bounds the whole region.
    """
    rows: list[np.ndarray] = []
    for p, q, r in itertools.combinations(points, 3):
        a = np.cross(q - p, r - p)
        size = np.linalg.norm(a)
        if size < _SAME:
            continue
        a = a / size if a @ p > 0 else -a / size
        b = a @ p
        if a.min() < -_SAME or (points @ a).min() < b - _SAME:
            continue
        row = np.append(a, b)
        if all(np.abs(row - other).max() > _SAME for other in rows):
            rows.append(row)
    return np.array(rows).reshape(-1, 4)
