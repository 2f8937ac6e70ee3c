"""Meshes of shapes for hydroelastic contact: tetrahedra whose pressure is linear, and zero on the surface.

A compliant shape is divided along its medial axis, so that inside every tetrahedron the nearest part of the surface is
a single face (Elandt et al., A pressure field model for fast, robust approximation of net contact force and moment
between nominally rigid objects, IROS 2019). The division, and how it follows the resolution hint, is Drake's, so that
contact surfaces have the same faces. A rigid shape is the surface of the same mesh.

Each builder gives vertices [m], tetrahedra (the normal of the first three corners points at the fourth) and a number
per vertex that is 1 where the pressure is the hydroelastic modulus and 0 on the shape's surface. With a margin the
mesh is that of a shape larger by the margin all round, and the number is negative on its surface.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from sheldrake.common._nonnegative_least_squares import nonnegative_least_squares
from sheldrake.geometry._kernels.hydro_depth import depths_below

MOST_LEVELS = 8
"""Subdivisions of a sphere's octahedron."""

_SAME = 1e-14  # relative difference of lengths that count as equal


class PressureMesh(NamedTuple):
    """Tetrahedra with a linear field.

    Attributes:
        vertices: [m], shape (n, 3).
        tetrahedra: vertex numbers, shape (m, 4).
        extent: pressure over hydroelastic modulus at each vertex, shape (n,).
    """

    vertices: np.ndarray
    tetrahedra: np.ndarray
    extent: np.ndarray


def sphere_levels(radius: float, hint: float) -> int:
    """Subdivisions after which no edge along the equator is longer than the hint."""
    angle = 2.0 * math.asin(min(hint, 2.0 * radius) / (2.0 * radius))
    return min(MOST_LEVELS, max(0, math.ceil(math.log2(2.0 * math.pi / angle)) - 2))


def unit_sphere(levels: int) -> tuple[np.ndarray, np.ndarray]:
    """An octahedron with every triangle divided into four, `levels` times, on the unit sphere.

    Returns:
        Vertices, the centre first, shape (n, 3), and tetrahedra whose last corner is the centre, shape (m, 4).
    """
    x, y, z = np.eye(3)
    vertices = np.array([0.0 * x, x, y, -x, -y, z, -z])
    ring = [(1, 2), (2, 3), (3, 4), (4, 1)]
    faces = np.array([(a, 5, b) for a, b in ring] + [(b, 6, a) for a, b in ring], np.int64)
    for _ in range(levels):
        edges = np.sort(faces[:, [[0, 1], [2, 0], [1, 2]]].reshape(-1, 2), axis=1)
        edges, first, which = np.unique(edges, axis=0, return_index=True, return_inverse=True)
        order = np.argsort(first)  # new vertices are numbered as they are met
        number = np.empty(len(order), np.int64)
        number[order] = len(vertices) + np.arange(len(order))
        middle = vertices[edges[order, 0]] + vertices[edges[order, 1]]
        middle /= np.linalg.norm(middle, axis=1)[:, None]
        ab, ca, bc = number[which.reshape(-1, 3)].T
        a, b, c = faces.T
        quarters = [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
        faces = np.stack([np.stack(q, axis=1) for q in quarters], axis=1).reshape(-1, 3)
        vertices = np.vstack([vertices, middle])
    return vertices, np.column_stack([faces, np.zeros(len(faces), np.int64)])


def sphere_mesh(radius: float, hint: float, margin: float = 0.0) -> PressureMesh:
    """A sphere about its centre."""
    return ellipsoid_mesh((radius,) * 3, hint, margin)


def ellipsoid_mesh(semi_axes: tuple[float, ...], hint: float, margin: float = 0.0) -> PressureMesh:
    """A scaled sphere: its pressure falls linearly along every ray from the centre."""
    axes = np.array(semi_axes)
    unit, tetrahedra = unit_sphere(sphere_levels(axes.max() + margin, hint))
    vertices = unit * (axes + margin)
    extent = 1.0 - np.linalg.norm(vertices / axes, axis=1)
    if margin == 0.0:
        extent[1:] = 0.0
    return PressureMesh(vertices, tetrahedra, extent)


# Corner k of a box has the signs of the bits of k: x is bit 2, y is bit 1, z is bit 0.
_SIGNS = np.array([[2.0 * (k >> 2 & 1) - 1.0, 2.0 * (k >> 1 & 1) - 1.0, 2.0 * (k & 1) - 1.0] for k in range(8)])
_Pieces = tuple[tuple[Any, ...], ...]
# What a medial axis of four points (x is the shortest side; they are at y, z = -+, ++, --, +-) or of two points and
# their middle (z is the longest side) does to the pieces between it and the faces: the triangles that, with the centre
# of the face, make the tetrahedra.
_FOUR_POINTS: _Pieces = (
    ("-x", 12, (0, 11, 2), (3, 2, 9), (2, 11, 9), (9, 8, 1), (8, 9, 11), (8, 0, 1), (9, 1, 3), (8, 11, 10), (0, 8, 10),
     (11, 0, 10)),
    ("+x", 13, (5, 4, 8), (7, 9, 6), (9, 5, 8), (5, 9, 7), (11, 4, 6), (9, 11, 6), (9, 8, 11), (8, 4, 10), (11, 8, 10),
     (4, 11, 10)),
    ("-y", 14, (8, 5, 1), (4, 5, 8), (4, 8, 10), (0, 4, 10), (0, 8, 1), (8, 0, 10)),
    ("+y", 15, (3, 7, 9), (9, 7, 6), (11, 6, 2), (11, 9, 6), (2, 3, 9), (11, 2, 9)),
    ("-z", 16, (4, 11, 6), (6, 11, 2), (4, 0, 10), (11, 4, 10), (11, 0, 2), (0, 11, 10)),
    ("+z", 17, (5, 9, 8), (5, 8, 1), (1, 9, 3), (8, 9, 1), (7, 3, 9), (9, 5, 7)),
)  # fmt: skip
_TWO_POINTS: _Pieces = (
    ("-x", 11, (2, 10, 3), (10, 0, 1), (1, 8, 10), (1, 3, 8), (8, 3, 10), (2, 9, 10), (0, 9, 2), (10, 9, 0)),
    ("+x", 12, (6, 9, 4), (6, 7, 10), (10, 5, 4), (8, 7, 5), (10, 8, 5), (7, 8, 10), (9, 10, 4), (6, 10, 9)),
    ("-y", 13, (5, 10, 4), (10, 9, 4), (4, 9, 0), (8, 10, 5), (1, 8, 5), (0, 10, 1), (9, 10, 0), (8, 1, 10)),
    ("+y", 14, (7, 6, 10), (8, 3, 7), (8, 7, 10), (9, 6, 2), (10, 6, 9), (10, 2, 3), (3, 8, 10), (9, 2, 10)),
    ("-z", 15, (6, 9, 2), (9, 0, 2), (9, 4, 0), (9, 6, 4)),
    ("+z", 16, (3, 1, 8), (7, 8, 5), (8, 1, 5), (3, 8, 7)),
)  # fmt: skip
_ONE_POINT: _Pieces = tuple(
    (name, 9 + f, *((8, loop[k], loop[(k + 1) % 4]) for k in range(4)))
    for f, (name, loop) in enumerate(
        [
            ("-x", (0, 1, 3, 2)),
            ("+x", (4, 6, 7, 5)),
            ("-y", (0, 4, 5, 1)),
            ("+y", (2, 3, 7, 6)),
            ("-z", (0, 2, 6, 4)),
            ("+z", (1, 5, 7, 3)),
        ]
    )
)
# Turns the templates so that the box's shortest, or longest, side is where they want it.
_SHORTEST_TO_X = (
    np.eye(3),
    np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
    np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]),
)
_LONGEST_TO_Z = (_SHORTEST_TO_X[2], np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]), np.eye(3))


def box_mesh(half: np.ndarray, margin: float = 0.0) -> PressureMesh:
    """A box of half sizes `half`; a division of its own needs no resolution."""
    half = np.array(half, dtype=float)
    least, tolerance = half.min(), _SAME * half.max()
    shortest = np.flatnonzero(half - least <= tolerance)
    R = np.eye(3)
    if len(shortest) == 3:
        pieces, medial = _ONE_POINT, np.zeros((1, 3))
    elif len(shortest) == 2:
        longest = int(half.argmax())
        R = _LONGEST_TO_Z[longest]
        reach = half[longest] - least
        pieces, medial = _TWO_POINTS, np.array([[0.0, 0.0, reach], [0.0, 0.0, -reach], [0.0, 0.0, 0.0]])
    else:
        R = _SHORTEST_TO_X[int(half.argmin())]
        _, y, z = np.abs(R.T @ half) - least
        pieces, medial = _FOUR_POINTS, np.array([[0.0, -y, z], [0.0, y, z], [0.0, -y, -z], [0.0, y, -z]])
    size = np.abs(R.T @ (half + margin))
    axes = {"x": 0, "y": 1, "z": 2}
    middle = np.zeros((6, 3))
    for f, (name, *_) in enumerate(pieces):
        k = axes[name[1]]
        middle[f, k] = -size[k] if name[0] == "-" else size[k]
    vertices = np.vstack([_SIGNS * size, medial, middle]) @ R.T
    tetrahedra = np.array([(*triangle, centre) for _, centre, *triangles in pieces for triangle in triangles], np.int64)
    extent = np.full(len(vertices), -margin / least)
    extent[8 : 8 + len(medial)] = 1.0
    return PressureMesh(vertices, _oriented(vertices, tetrahedra), extent)


def cylinder_mesh(radius: float, length: float, hint: float, margin: float = 0.0) -> PressureMesh:
    """A cylinder about z: its medial axis is a segment, a point, or a disk."""
    radius, half = radius + margin, length / 2.0 + margin
    n = max(3, math.ceil(2.0 * math.pi * radius / hint))
    angle = 2.0 * math.pi * np.arange(n) / n
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    rim = np.empty((2 * n, 3))
    rim[0::2] = np.column_stack([circle * radius, np.full(n, -half)])
    rim[1::2] = np.column_stack([circle * radius, np.full(n, half)])
    now = np.arange(n)
    before = (now - 1) % n
    bp, tp, bc, tc = 2 + 2 * before, 3 + 2 * before, 2 + 2 * now, 3 + 2 * now  # bottom and top, previous and current
    b, t, c = (np.full(n, k) for k in (0, 1, 2 + 2 * n))
    tolerance = _SAME * max(radius, half)
    if half - radius > tolerance:
        reach = half - radius
        medial = np.array([[0.0, 0.0, -reach], [0.0, 0.0, reach]])
        m = c + 1
        tets = [(b, bp, bc, c), (t, tc, tp, m), (m, tp, c, tc), (tp, bp, c, tc), (bp, bc, c, tc)]
    elif radius - half > tolerance:
        medial = np.vstack([np.zeros((1, 3)), np.column_stack([circle * (radius - half), np.zeros(n)])])
        mp, mc = 3 + 2 * n + before, 3 + 2 * n + now
        tets = [
            *[(c, mp, b, mc), (mp, bp, b, mc), (bp, bc, b, mc)],
            *[(t, tp, c, tc), (tp, mp, c, tc), (mp, mc, c, tc)],
            *[(bc, mc, bp, tc), (mc, mp, bp, tc), (mp, tp, bp, tc)],
        ]
    else:
        medial = np.zeros((1, 3))
        tets = [(b, bp, bc, c), (t, tc, tp, c), (bp, c, tp, bc), (c, tc, tp, bc)]
    vertices = np.vstack([[[0.0, 0.0, -half], [0.0, 0.0, half]], rim, medial])
    extent = np.full(len(vertices), -margin / (min(radius, half) - margin))
    extent[2 + 2 * n :] = 1.0
    return PressureMesh(vertices, _oriented(vertices, _by_sector(tets)), extent)


def capsule_mesh(radius: float, length: float, hint: float, margin: float = 0.0) -> PressureMesh:
    """A capsule about z: its medial axis is the segment between the centres of its caps."""
    half, radius = length / 2.0, radius + margin
    n = max(3, math.floor(2.0 * math.pi * radius / hint))
    rings = max(1, n // 2)
    angle, latitude = 2.0 * math.pi * np.arange(n) / n, 0.5 * math.pi * np.arange(rings) / rings
    vertices = [[0.0, 0.0, half], [0.0, 0.0, -half], [0.0, 0.0, half + radius], [0.0, 0.0, -half - radius]]
    for theta in latitude:
        r, z = radius * math.cos(theta), half + radius * math.sin(theta)
        for phi in angle:
            x, y = r * math.cos(phi), r * math.sin(phi)
            vertices += [[x, y, z], [x, y, -z]]
    now = np.arange(n)
    after = (now + 1) % n
    centre, below, pole, south = (np.full(n, k) for k in range(4))

    def ring(k: int) -> tuple[np.ndarray, ...]:
        first = 4 + 2 * n * k
        return first + 2 * now, first + 2 * after, first + 1 + 2 * now, first + 1 + 2 * after

    tets = []
    for k in range(rings - 1):
        (i, j, i_, j_), (up, uq, down, dq) = ring(k), ring(k + 1)
        tets += [(i, centre, up, j), (centre, uq, up, j), (down, below, i_, dq), (below, j_, i_, dq)]
    i, j, i_, j_ = ring(rings - 1)
    tets += [(pole, j, i, centre), (south, i_, j_, below)]
    i, j, i_, j_ = ring(0)
    tets += [(centre, i, below, j), (i, i_, below, j), (i_, j_, below, j)]
    points = np.array(vertices)
    extent = np.full(len(points), -margin / (radius - margin))
    extent[:2] = 1.0
    return PressureMesh(points, _oriented(points, _by_sector(tets)), extent)


def star_mesh(vertices: np.ndarray, triangles: np.ndarray, faces: np.ndarray, margin: float = 0.0) -> PressureMesh:
    """A convex polytope as tetrahedra between its centroid and its triangles.

    Args:
        vertices: [m], shape (n, 3).
        triangles: of its surface, normals pointing out, shape (m, 3).
        faces: outward unit normal and offset [m] of its faces, shape (k, 4).
        margin: by which it was made larger [m].
    """
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c))
    centroid = volume @ (a + b + c) / (4.0 * volume.sum())
    vertices = np.vstack([vertices, centroid])
    tetrahedra = np.column_stack([np.full(len(triangles), len(vertices) - 1), triangles])
    inner = (faces[:, 3] - faces[:, :3] @ centroid).min()
    extent = np.full(len(vertices), -margin / inner)
    extent[-1] = 1.0
    return PressureMesh(vertices, _oriented(vertices, tetrahedra), extent)


def volume_mesh(vertices: np.ndarray, tetrahedra: np.ndarray, surface: np.ndarray, margin: float = 0.0) -> PressureMesh:
    """Given tetrahedra; the pressure grows with the distance from their surface.

    Args:
        vertices: [m], shape (n, 3).
        tetrahedra: shape (m, 4).
        surface: the triangles of their surface, normals pointing out, shape (k, 3).
        margin: by which their surface is moved out [m].

    Raises:
        RuntimeError: all vertices are on the surface.
    """
    distance = _depths(vertices, tetrahedra, surface)
    most = distance.max()
    if not most > 0.0:
        raise RuntimeError(
            "MakeVolumeMeshPressureField(): the computed max distance to boundary among all mesh vertices is "
            "non-positive. Perhaps the mesh lacks interior vertices."
        )
    extent = distance / most
    if margin > 0.0:
        vertices = _moved_out(vertices, surface, margin)
        extent[np.unique(surface)] = -margin / most
    return PressureMesh(vertices, _oriented(vertices, tetrahedra), extent)


def _depths(vertices: np.ndarray, tetrahedra: np.ndarray, surface: np.ndarray) -> np.ndarray:
    """Distance of each vertex from the surface [m], shape (n,); zero on it."""
    inside = np.setdiff1d(np.unique(tetrahedra), np.unique(surface)).astype(np.int64)
    distance, depth = np.zeros(len(vertices)), np.zeros(len(inside))
    triangles = np.ascontiguousarray(surface, np.int64)
    depths_below.native(np.ascontiguousarray(vertices, float), inside, triangles, depth)
    distance[inside] = depth
    return distance


def _moved_out(vertices: np.ndarray, surface: np.ndarray, margin: float) -> np.ndarray:
    """Vertices with those of the surface moved, as little as possible, a margin beyond all triangles about them.

    Each is a problem of least distance (Lawson and Hanson, Solving Least Squares Problems, 1974, chapter 23).
    """
    moved = vertices.copy()
    corner = vertices[surface]
    cross = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normals = cross / np.linalg.norm(cross, axis=1)[:, None]
    around: dict[int, list[int]] = {}
    for t, triangle in enumerate(surface.tolist()):
        for v in triangle:
            around.setdefault(v, []).append(t)
    for v, triangles in around.items():
        N = normals[triangles]
        weights = nonnegative_least_squares(np.vstack([N.T, np.ones(len(N))]), np.array([0.0, 0.0, 0.0, 1.0]))
        residual = np.append(N.T @ weights, weights.sum() - 1.0)
        if not residual[3] < -1e-12:
            raise RuntimeError(f"A vertex of a volume mesh, at {vertices[v].tolist()}, can not be moved out.")
        moved[v] += margin * -residual[:3] / residual[3]
    return moved


def _by_sector(tets: list) -> np.ndarray:
    """Tetrahedra of all sectors, sector after sector, shape (m, 4)."""
    return np.stack([np.stack(tet, axis=1) for tet in tets], axis=1).reshape(-1, 4).astype(np.int64)


def _oriented(vertices: np.ndarray, tetrahedra: np.ndarray) -> np.ndarray:
    """The same tetrahedra with positive volume."""
    a, b, c, d = (vertices[tetrahedra[:, k]] for k in range(4))
    flipped = np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) < 0.0
    tetrahedra = tetrahedra.copy()
    tetrahedra[flipped] = tetrahedra[flipped][:, [1, 0, 2, 3]]
    return tetrahedra
