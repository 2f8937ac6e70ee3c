"""What can be drawn at a path: plain numbers and arrays, ready for any page.

A Shape, a mesh file, a point cloud becomes one of four things: a primitive with its shape, triangles,
line segments, points. Mesh files are read here, in the caller's thread, so that a missing file is the
caller's error.
"""

from __future__ import annotations

import dataclasses
from typing import Literal

import numpy as np

from sheldrake.geometry._meshes.mesh_looks import LoadedMesh, load_mesh
from sheldrake.geometry._rgba import Rgba
from sheldrake.geometry._shape_types import type_of
from sheldrake.geometry._shapes import Box, Cylinder, Ellipsoid, HalfSpace, Mesh, Shape, Sphere

from .texture import Texture, takes_picture, wrap

Side = Literal["front", "back", "double"]
PLATE_SIZE = 20.0  # edge length of the plate that stands for a half space [m]


@dataclasses.dataclass(frozen=True)
class Primitive:
    """A box, sphere, cylinder or half space, which the page knows how to make."""

    shape: Shape
    rgba: Rgba


@dataclasses.dataclass(frozen=True)
class Triangles:
    """A triangle mesh: vertices, shape (n, 3); faces, shape (m, 3); per-vertex colors in [0, 1], shape (n, 3)."""

    vertices: np.ndarray
    faces: np.ndarray
    rgba: Rgba
    wireframe: bool = False
    side: Side = "double"
    colors: np.ndarray | None = None
    smooth: bool = True
    texture: Texture | None = None


@dataclasses.dataclass(frozen=True)
class Asset:
    """A mesh with materials of its own."""

    mesh: LoadedMesh
    rgba: Rgba


@dataclasses.dataclass(frozen=True)
class Lines:
    """Line segments, shape (n, 2, 3), with a width in pixels."""

    segments: np.ndarray
    width: float
    rgba: Rgba


@dataclasses.dataclass(frozen=True)
class Points:
    """Points, shape (n, 3), with colors in 0..255, shape (n, 3) or (3,), and a size [m]."""

    points: np.ndarray
    colors: np.ndarray
    size: float
    rgba: Rgba


Drawable = Primitive | Triangles | Asset | Lines | Points


def drawable_of_shape(shape: Shape, rgba: Rgba, diffuse_map: str = "") -> Drawable:
    """Returns what to draw for a shape, with a picture on it where there is one.

    Raises:
        RuntimeError: when a mesh file is missing or cannot be read.
        NotImplementedError: for a kind of shape which nobody taught this function.
    """
    if diffuse_map and takes_picture(shape):
        surface = type_of(shape).surface
        assert surface is not None, "what takes a picture has a surface"
        vertices, faces, texture = wrap(shape, *surface(shape), diffuse_map)
        return Triangles(vertices, faces, rgba, smooth=type_of(shape).smooth, texture=texture)
    if isinstance(shape, (Box, Sphere, Cylinder, HalfSpace, Ellipsoid)):
        return Primitive(shape, rgba)
    if isinstance(shape, Mesh):
        mesh = load_mesh(shape)
        if mesh.has_materials:
            return Asset(mesh, rgba)
        return Triangles(mesh.vertices, mesh.faces, rgba)
    row = type_of(shape)
    if row.surface is None:
        raise NotImplementedError(f"Meshcat.SetObject(): no way to draw a {shape.type_name()}.")
    return Triangles(*row.surface(shape), rgba, smooth=row.smooth)


def triangles_of(drawable: Drawable) -> Triangles | None:
    """Returns a drawable's surface as triangles, None for lines, points and half spaces."""
    if isinstance(drawable, Triangles):
        return drawable
    if isinstance(drawable, Asset):
        return Triangles(drawable.mesh.vertices, drawable.mesh.faces, drawable.rgba)
    if not isinstance(drawable, Primitive):
        return None
    row = type_of(drawable.shape)
    if row.surface is None:
        return None
    return Triangles(*row.surface(drawable.shape), drawable.rgba, smooth=row.smooth)


def bounds_of(drawable: Drawable) -> np.ndarray | None:
    """Returns corners of the box around a drawable in its own frame, shape (2, 3); None for a half space."""
    if isinstance(drawable, Primitive):
        box = type_of(drawable.shape).box
        if box is None:
            return None
        half = box(drawable.shape)
        return np.array([-half, half])
    if isinstance(drawable, Lines):
        points = drawable.segments.reshape(-1, 3)
    elif isinstance(drawable, Points):
        points = drawable.points
    else:
        points = drawable.mesh.vertices if isinstance(drawable, Asset) else drawable.vertices
    points = points[np.isfinite(points).all(axis=1)]
    return np.array([points.min(axis=0), points.max(axis=0)]) if len(points) else None


def transformed(drawable: Drawable, M: np.ndarray) -> Drawable:
    """Returns a drawable with an affine map, shape (4, 4), built into its points."""

    def apply(points: np.ndarray) -> np.ndarray:
        return points @ M[:3, :3].T + M[:3, 3]

    if isinstance(drawable, Lines):
        return dataclasses.replace(drawable, segments=apply(drawable.segments))
    if isinstance(drawable, Points):
        return dataclasses.replace(drawable, points=apply(drawable.points))
    triangles = triangles_of(drawable)
    if triangles is None:
        return drawable
    faces = triangles.faces[:, ::-1] if np.linalg.det(M[:3, :3]) < 0 else triangles.faces
    return dataclasses.replace(triangles, vertices=apply(triangles.vertices), faces=faces)


def surface_grid(X: np.ndarray, Y: np.ndarray, Z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns vertices and faces of a surface over a grid of points, each argument of shape (rows, columns)."""
    rows, columns = Z.shape
    vertices = np.stack([X.ravel(), Y.ravel(), Z.ravel()], axis=1)
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    first = np.stack([corner, corner + 1, corner + columns], axis=1)
    second = np.stack([corner + 1, corner + columns + 1, corner + columns], axis=1)
    return vertices, np.concatenate([first, second])
