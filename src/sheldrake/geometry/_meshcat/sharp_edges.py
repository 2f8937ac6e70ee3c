"""Meshes made to look sharp where they are: vertices of their own on either side of an edge."""

from __future__ import annotations

import functools

import numpy as np

_KEPT_FACES = 20_000  # Meshes of up to so many are remembered: visualizers draw the same ones for each simulation.
_SAME_PLACE = 1e-8  # Vertices this close are one [m].
_FLAT = 0.01  # Faces that meet at less are of one plane [rad].
_LARGE = 0.1  # A plane with more of the mesh's surface than this is shaded flat.


def split_at_edges(vertices: np.ndarray, faces: np.ndarray, angle: float = 0.5) -> tuple[np.ndarray, np.ndarray]:
    """Returns a mesh whose sharp edges have a vertex of their own on either side, so that they look sharp.

    Args:
        vertices: Shape (n, 3).
        faces: Shape (m, 3).
        angle: Edges bent by more than this are sharp [rad].
    """
    if not len(faces) or len(faces) > 200_000:
        return vertices, faces
    vertices, faces = np.ascontiguousarray(vertices, float), np.ascontiguousarray(faces, np.int64)
    split = _split if len(faces) <= _KEPT_FACES else _split.__wrapped__
    return split(vertices.tobytes(), faces.tobytes(), angle)


@functools.lru_cache(64)
def _split(vertices: bytes, faces: bytes, angle: float) -> tuple[np.ndarray, np.ndarray]:
    places, corners = _merged(np.frombuffer(vertices).reshape(-1, 3), np.frombuffer(faces, np.int64).reshape(-1, 3))
    a, b, c = (places[corners[:, i]] for i in range(3))
    normals = np.cross(b - a, c - a)
    areas = np.linalg.norm(normals, axis=1)
    neighbors, bends = _edges(corners, normals)

    planes = _connected(len(corners), neighbors[bends < _FLAT])
    is_large = np.bincount(planes, areas, len(corners)) > _LARGE * areas.sum()
    beside_large = is_large[planes][neighbors].any(axis=1)
    patches = _connected(len(corners), neighbors[bends < np.where(beside_large, _FLAT, angle)])

    kinds, split = np.unique(patches[:, None] * len(places) + corners, return_inverse=True)
    found = places[kinds % len(places)], split.reshape(-1, 3)
    for array in found:
        array.flags.writeable = False
    return found


def _merged(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A mesh without second vertices at a place."""
    _, first, kinds = np.unique(np.round(vertices / _SAME_PLACE), axis=0, return_index=True, return_inverse=True)
    return vertices[first], kinds.reshape(-1)[faces]


def _edges(faces: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of faces that alone share an edge, shape (edges, 2), and how much each is bent [rad], shape (edges,)."""
    ends = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    _, edge, count = np.unique(ends[:, 0] * (faces.max() + 1) + ends[:, 1], return_inverse=True, return_counts=True)
    of_two = np.flatnonzero(count[edge] == 2)
    pairs = of_two[np.argsort(edge[of_two], kind="stable")].reshape(-1, 2) // 3
    one, other = normals[pairs[:, 0]], normals[pairs[:, 1]]
    sines = np.linalg.norm(np.cross(one, other), axis=1)
    return pairs, np.arctan2(sines, np.einsum("ij,ij->i", one, other))


def _connected(count: int, pairs: np.ndarray) -> np.ndarray:
    """For each of `count` things the least of those that pairs connect it to, shape (count,)."""
    label = np.arange(count)
    while True:
        ends = label[pairs]
        low, high = ends.min(axis=1), ends.max(axis=1)
        if (low == high).all():
            return label
        np.minimum.at(label, high, low)
        while (label[label] != label).any():
            label = label[label]
