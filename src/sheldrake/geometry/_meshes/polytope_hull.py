"""Convex hulls with few faces by gift wrapping: polygons at once, coplanar corners and all, and no heavy import.

A plane is turned about an edge of a face that is known until it meets the next points; all points in it make the
neighbour (Chand and Kapur, An Algorithm for Convex Polytopes, J. ACM 17, 1970). The cost is faces times points, so it
is for the polytopes that come out of CAD; Qhull takes the rest.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterable

MOST_FACES = 128
MOST_POINTS = 20_000
_PROBES = 600  # directions in which corners are counted beforehand


def wrap(points: np.ndarray, tolerance: float) -> list[list[int]] | None:
    """Faces of the hull as loops of corners, counter-clockwise seen from outside.

    Args:
        points: different points [m] that span space, shape (n, 3).
        tolerance: points nearer to a plane or line [m] are in it.

    Returns:
        The faces, or None when there are too many of them or of the points, or when rounding leaves an edge without
        its partner.
    """
    if len(points) > MOST_POINTS or _has_many_corners(points):
        return None
    wrapping = _Wrapping(points, tolerance)
    loops: list[list[int]] = []
    edges: dict[tuple[int, int], np.ndarray] = {}  # each directed edge with the outward normal of its face
    first = wrapping.first_face()
    if first is None:
        return None
    found = [first]
    while found:
        loop, normal = found.pop()
        for edge in zip(loop, loop[1:] + loop[:1]):
            if edge in edges:
                return None
            edges[edge] = normal
        loops.append(loop)
        open_edge = next(((a, b) for a, b in zip(loop, loop[1:] + loop[:1]) if (b, a) not in edges), None)
        if open_edge is None:
            open_edge = next(((a, b) for a, b in edges if (b, a) not in edges), None)
        if open_edge is None:
            break
        a, b = open_edge
        face = wrapping.beyond(a, points[b] - points[a], edges[open_edge])
        if face is None or len(loops) == MOST_FACES:
            return None
        found.append(face)
    corners = {v for loop in loops for v in loop}
    return loops if len(corners) - len(edges) // 2 + len(loops) == 2 else None


def _has_many_corners(points: np.ndarray) -> bool:
    """Whether the points that are farthest in some directions are already more than the corners of MOST_FACES faces.

    By Euler's formula f faces have at most 2 f - 4 corners.
    """
    most = 2 * MOST_FACES - 4
    if len(points) <= most:
        return False
    k = np.arange(_PROBES) + 0.5  # a spiral of golden angles covers the sphere evenly
    z, turn = 1.0 - 2.0 * k / _PROBES, k * (np.pi * (3.0 - np.sqrt(5.0)))
    r = np.sqrt(1.0 - z * z)
    directions = np.stack([r * np.cos(turn), r * np.sin(turn), z], axis=1)
    return len(set((directions @ points.T).argmax(axis=1).tolist())) > most


class _Wrapping:
    """The points, and the step from a face over one of its edges to the next."""

    def __init__(self, points: np.ndarray, tolerance: float):
        self.points, self.tolerance = points, tolerance

    def first_face(self) -> tuple[list[int], np.ndarray] | None:
        """A face that holds the first of the points in the order x, y, z, which is a corner."""
        corner = int(np.lexsort(self.points.T[::-1])[0])
        normal = self.turned(corner, np.array([0.0, 0.0, 1.0]), np.array([-1.0, 0.0, 0.0]))
        if normal is None:
            return None
        face = self.face(corner, normal)  # already a face, unless the plane holds one edge only
        if face is not None:
            return face
        inside = np.flatnonzero(np.abs((self.points - self.points[corner]) @ normal) <= self.tolerance)
        away = self.points[inside] - self.points[corner]
        return self.beyond(corner, away[np.argmax((away**2).sum(axis=1))], normal)

    def beyond(self, a: int, along: np.ndarray, normal: np.ndarray) -> tuple[list[int], np.ndarray] | None:
        """The other face at the edge through point `a`."""
        turned = self.turned(a, along, normal)
        return None if turned is None else self.face(a, turned)

    def turned(self, a: int, along: np.ndarray, normal: np.ndarray) -> np.ndarray | None:
        """Outward normal of the plane after turning it about the line through `a`, away from `normal`."""
        d = along / np.linalg.norm(along)
        away = self.points - self.points[a]
        inward = _cross(normal, d)  # into the face, when the edge runs counter-clockwise
        across, down = away @ inward, -(away @ normal)
        beside = np.hypot(across, down) > self.tolerance
        if not beside.any():
            return None
        candidate = int(np.argmax(np.where(beside, np.arctan2(down, across), -np.inf)))
        for _ in range(8):  # the angle of a point near the edge is rough: go on while a point lies outside
            outward = _cross(away[candidate], d)
            outward /= np.linalg.norm(outward)
            height = away @ outward
            highest = int(np.argmax(height))
            if height[highest] <= self.tolerance:
                return outward
            candidate = highest
        return None

    def face(self, a: int, normal: np.ndarray) -> tuple[list[int], np.ndarray] | None:
        """The polygon of the points in the plane through `a`, or None if they are on one line."""
        away = self.points - self.points[a]
        inside = np.flatnonzero(np.abs(away @ normal) <= self.tolerance)
        if len(inside) < 3:
            return None
        first = _cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
        first /= np.linalg.norm(first)
        flat = np.stack([away[inside] @ first, away[inside] @ _cross(normal, first)], axis=1)
        loop = _polygon(flat, self.tolerance)
        return None if loop is None else ([int(inside[k]) for k in loop], normal)


def _polygon(flat: np.ndarray, tolerance: float) -> list[int] | None:
    """Corners of the hull of points in a plane, counter-clockwise (Andrew's chains); None if they are on one line."""
    order = np.lexsort((flat[:, 1], flat[:, 0])).tolist()
    xy = flat.tolist()

    def chain(indices: Iterable[int]) -> list[int]:
        corners: list[int] = []
        for k in indices:
            while len(corners) > 1 and not _turns_left(xy[corners[-2]], xy[corners[-1]], xy[k], tolerance):
                corners.pop()
            corners.append(k)
        return corners[:-1]

    loop = chain(order) + chain(reversed(order))
    return loop if len(loop) > 2 else None


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """a x b of two vectors; `numpy.cross`, made for many, takes fifty times longer."""
    (ax, ay, az), (bx, by, bz) = a.tolist(), b.tolist()
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def _turns_left(a: list[float], b: list[float], c: list[float], tolerance: float) -> bool:
    """Whether b lies outside the line from a to c by more than the tolerance."""
    cross = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    length = ((c[0] - a[0]) ** 2 + (c[1] - a[1]) ** 2) ** 0.5
    return cross > tolerance * length
