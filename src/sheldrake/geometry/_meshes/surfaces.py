"""Surfaces of shapes as triangles, to be looked at: vertices of shape (n, 3) [m] and faces of shape (m, 3)."""

from __future__ import annotations

import numpy as np

from sheldrake.geometry._meshes.polygon_mesh import PolygonSurfaceMesh, fans

Surface = tuple[np.ndarray, np.ndarray]


def unit_cube() -> Surface:
    """A cube with edges of 1 m around the origin."""
    vertices = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [face for a, b, c, d in quads for face in ((a, b, c), (a, c, d))]
    return vertices, np.array(faces)


def lathe(profile: np.ndarray, sides: int = 48) -> Surface:
    """A profile, shape (k, 2) of radius and height from bottom to top, turned about z."""
    angle = 2 * np.pi * np.arange(sides) / sides
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    k = len(profile)
    vertices = np.concatenate(
        [profile[:, None, :1] * ring, np.broadcast_to(profile[:, None, 1:], (k, sides, 1))], axis=2
    ).reshape(-1, 3)
    row, column = np.meshgrid(np.arange(k - 1), np.arange(sides), indexing="ij")
    a = row * sides + column
    b = row * sides + (column + 1) % sides
    c, d = b + sides, a + sides
    faces = np.concatenate([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)]).reshape(-1, 3)
    corners = vertices[faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    return vertices, faces[area > 1e-14 * max(1e-9, np.abs(vertices).max()) ** 2]


def capsule(radius: float, length: float, sides: int = 32, rings: int = 9) -> Surface:
    """A capsule along z around the origin; a sphere when the length is zero."""
    angle = np.linspace(-np.pi / 2, 0.0, rings)
    lower = np.stack([np.cos(angle), np.sin(angle)], axis=1) * radius
    upper = (lower * (1.0, -1.0))[::-1]
    if length == 0.0:
        upper = upper[1:]
    half = np.array([0.0, length / 2])
    return lathe(np.concatenate([lower - half, upper + half]), sides)


def surface_of(hull: PolygonSurfaceMesh) -> Surface:
    """A polygon mesh with its faces cut into fans of triangles."""
    return np.array(hull._vertices), fans(hull._faces)
