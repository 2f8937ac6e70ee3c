"""Hulls of points in the plane, without Qhull: most of what is plotted is flat, and loading SciPy takes a while."""

from __future__ import annotations

import numpy as np

_STRAIGHT = 1e-15  # Of the square of the extent: a corner whose triangle is smaller is none.


def corners(points: np.ndarray) -> np.ndarray:
    """Numbers of the corners of the hull of points, shape (n, 2), counter-clockwise (A. M. Andrew 1979).

    Points that repeat a corner, or lie on an edge, are left out; fewer than three are left of points on a line.
    """
    order = np.lexsort((points[:, 1], points[:, 0])).tolist()
    least = _STRAIGHT * float(np.ptp(points, axis=0).max(initial=0.0)) ** 2
    places = points.tolist()
    lower, upper = _chain(order, places, least), _chain(order[::-1], places, least)
    return np.array(lower[:-1] + upper[:-1], int)


def _chain(order: list[int], places: list[list[float]], least: float) -> list[int]:
    """Half of the hull: from the first to the last point, always turning left."""
    chain: list[int] = []
    for k in order:
        x, y = places[k]
        while len(chain) > 1:
            (ax, ay), (bx, by) = places[chain[-2]], places[chain[-1]]
            if (bx - ax) * (y - ay) - (by - ay) * (x - ax) > least:
                break
            chain.pop()
        chain.append(k)
    return chain


def edges(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A and b, with unit rows, of the edges of the hull of points that are not all on a line."""
    at = points[corners(points)]
    along = np.roll(at, -1, axis=0) - at
    A = np.column_stack((along[:, 1], -along[:, 0])) / np.linalg.norm(along, axis=1)[:, None]
    return A, np.einsum("ij,ij->i", A, at)


def area(points: np.ndarray) -> float:
    """Area of the hull of points."""
    x, y = (points[corners(points)] - points[0]).T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def meetings(A: np.ndarray, b: np.ndarray, inside: np.ndarray) -> np.ndarray:
    """The corners of A x <= b, shape (n, 2), counter-clockwise around a point in its interior.

    Half planes are points of the dual, at a / (b - a'inside); those that bound are the corners of its hull.
    """
    left = b - A @ inside
    bounds = corners(A / left[:, None])
    one, other = bounds, np.roll(bounds, -1)
    pairs = np.stack((A[one], A[other]), axis=1)
    return inside + np.linalg.solve(pairs, np.stack((left[one], left[other]), axis=1)[:, :, None])[:, :, 0]
