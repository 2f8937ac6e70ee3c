"""Signed distance of a point to a triangle mesh that need not be convex."""

from __future__ import annotations

import numpy as np


def point_to_triangles(p_GQ: np.ndarray, vertices: np.ndarray, triangles: np.ndarray) -> tuple:
    """(distance [m], nearest point, gradient) of a point to a closed surface; negative inside.

    The sign comes from the angle-weighted normal of the nearest face, edge or vertex (Baerentzen and Aanaes 2005).
    """
    corner = vertices[triangles]
    weights = _nearest_weights(p_GQ, corner)
    nearest = np.einsum("tk,tkc->tc", weights, corner)
    squared = ((nearest - p_GQ) ** 2).sum(axis=1)
    best = int(squared.argmin())
    p_GN = nearest[best]
    size = max(1e-300, float(np.ptp(vertices, axis=0).max()))
    touching = ((nearest - p_GN) ** 2).sum(axis=1) <= (1e-10 * size) ** 2
    normal = _weighted_normal(p_GN, corner[touching], size)
    offset = p_GQ - p_GN
    distance = float(np.linalg.norm(offset))
    sign = -1.0 if offset @ normal < 0.0 else 1.0
    gradient = sign * offset / distance if distance > 1e-14 * size else normal
    return sign * distance, p_GN, gradient


def _weighted_normal(p: np.ndarray, corner: np.ndarray, size: float) -> np.ndarray:
    """Normal of a surface at a point: the normals of its triangles, weighted by their angle there."""
    cross = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normals = cross / np.maximum(np.linalg.norm(cross, axis=1), 1e-300)[:, None]
    total = np.zeros(3)
    for triangle, normal in zip(corner, normals):
        arms = triangle - p
        at = np.linalg.norm(arms, axis=1) <= 1e-10 * size
        if at.any():
            k = int(at.argmax())
            u, v = triangle[(k + 1) % 3] - triangle[k], triangle[(k + 2) % 3] - triangle[k]
            cosine = u @ v / max(1e-300, np.linalg.norm(u) * np.linalg.norm(v))
            total += np.arccos(np.clip(cosine, -1.0, 1.0)) * normal
        else:
            total += normal  # inside the face or on an edge: the same angle for all
    length = float(np.linalg.norm(total))
    return total / length if length > 0.0 else np.array([1.0, 0.0, 0.0])


def _nearest_weights(p: np.ndarray, corner: np.ndarray) -> np.ndarray:
    """Barycentric weights of the point of each triangle nearest to p, shape (t, 3)."""
    a, b, c = corner[:, 0], corner[:, 1], corner[:, 2]
    ab, ac, ap = b - a, c - a, p - a
    d00, d01, d11 = (ab * ab).sum(1), (ab * ac).sum(1), (ac * ac).sum(1)
    d20, d21 = (ap * ab).sum(1), (ap * ac).sum(1)
    area = np.maximum(d00 * d11 - d01 * d01, 1e-300)
    v, w = (d11 * d20 - d01 * d21) / area, (d00 * d21 - d01 * d20) / area
    best = np.stack([1.0 - v - w, v, w], axis=1)
    outside = (best < 0.0).any(axis=1)
    squared = np.where(outside, np.inf, ((np.einsum("tk,tkc->tc", best, corner) - p) ** 2).sum(axis=1))
    for i, j in ((0, 1), (1, 2), (2, 0)):
        edge = corner[:, j] - corner[:, i]
        length2 = np.maximum((edge * edge).sum(1), 1e-300)
        t = np.clip(((p - corner[:, i]) * edge).sum(1) / length2, 0.0, 1.0)
        candidate = np.zeros_like(best)
        candidate[:, i], candidate[:, j] = 1.0 - t, t
        distance = ((np.einsum("tk,tkc->tc", candidate, corner) - p) ** 2).sum(axis=1)
        better = distance < squared
        best[better], squared[better] = candidate[better], distance[better]
    return best
