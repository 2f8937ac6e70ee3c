"""Pictures on shapes: where on a picture each corner of a shape's triangles is."""

from __future__ import annotations

import dataclasses
import os

import numpy as np

from sheldrake.geometry._shapes import Box, Convex, Cylinder, HalfSpace, Mesh, Shape


@dataclasses.dataclass(frozen=True)
class Texture:
    """A picture file, and where on it vertices are, in [0, 1] from its lower left corner, shape (n, 2)."""

    file: str
    uv: np.ndarray


def takes_picture(shape: Shape) -> bool:
    """Whether a picture is drawn on a shape: meshes may have pictures of their own, hulls and half spaces no place."""
    return not isinstance(shape, (Mesh, Convex, HalfSpace))


def picture_file(path: str | os.PathLike) -> str:
    """Returns the path of a picture.

    Raises:
        RuntimeError: when it is none that can be read.
    """
    from PIL import Image

    file = os.fspath(path)
    try:
        with Image.open(file) as picture:
            picture.verify()
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        raise RuntimeError(f"Meshcat.SetObject(): diffuse_map '{file}' cannot be read: {error}") from None
    return file


def wrap(shape: Shape, vertices: np.ndarray, faces: np.ndarray, file: str) -> tuple[np.ndarray, np.ndarray, Texture]:
    """Lays a picture around a shape.

    Each side of a box has the whole picture, and so has each cap of a cylinder; what is round has it once around, from
    -x over -y, x and y, and from its lowest to its highest point: on spheres and ellipsoids by latitude.

    Args:
        shape: The shape.
        vertices: Of its surface, shape (n, 3).
        faces: Triangles, shape (m, 3).
        file: The picture.

    Returns:
        Vertices, shape (3 m, 3), of which no two triangles share one, the triangles, and where they are on the picture.
    """
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    flat = (corners - low) / np.maximum(high - low, 1e-300)
    if isinstance(shape, Box):
        axis = np.argmax(np.abs(normals), axis=1)
        across = np.array([[1, 2], [0, 2], [0, 1]])[axis]
        uv = np.take_along_axis(flat, across[:, None, :].repeat(3, axis=1), axis=2)
    else:
        centered = (corners - (low + high) / 2) / np.maximum((high - low) / 2, 1e-300)
        u, v = np.arctan2(centered[..., 1], centered[..., 0]) / (2 * np.pi) + 0.5, flat[..., 2]
        if np.ptp(np.linalg.norm(centered, axis=2)) < 1e-6:  # a sphere, or an ellipsoid
            v = np.arcsin(np.clip(centered[..., 2], -1.0, 1.0)) / np.pi + 0.5
        u = u + (np.ptp(u, axis=1, keepdims=True) > 0.5) * (u < 0.5)  # across the seam; pictures repeat
        uv = np.stack([u, v], axis=2)
        if isinstance(shape, Cylinder):
            caps = np.ptp(corners[..., 2], axis=1) == 0.0
            uv[caps] = flat[caps][..., :2]
    return corners.reshape(-1, 3), np.arange(3 * len(faces)).reshape(-1, 3), Texture(file, uv.reshape(-1, 2))
