"""What can be drawn at a path: plain numbers and arrays, ready for any page.

A Shape, a mesh file, a point cloud becomes one of four things: a primitive with its shape, triangles,
line segments, points. Mesh files are read here, in the caller's thread, so that a missing file is the
caller's error.
"""

from __future__ import annotations

import dataclasses
from typing import Any, Literal

import numpy as np

from sheldrake.geometry._meshes.mesh_looks import LoadedMesh, load_mesh
from sheldrake.geometry._rgba import Rgba
from sheldrake.geometry._shapes import (
    Box,
    Capsule,
    Convex,
    Cylinder,
    Ellipsoid,
    HalfSpace,
    Mesh,
    MeshcatCone,
    Shape,
    Sphere,
)

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


def drawable_of_shape(shape: Shape, rgba: Rgba) -> Drawable:
    """Returns what to draw for a shape.

    Raises:
        RuntimeError: when a mesh file is missing or cannot be read.
        NotImplementedError: for a kind of shape which nobody taught this function.
    """
    if isinstance(shape, (Box, Sphere, Cylinder, HalfSpace, Ellipsoid)):
        return Primitive(shape, rgba)
    if isinstance(shape, Capsule):
        return Triangles(*capsule(shape.radius(), shape.length()), rgba)
    if isinstance(shape, MeshcatCone):
        return Triangles(*cone(shape.height(), shape.a(), shape.b()), rgba, smooth=False)
    if isinstance(shape, Convex):
        hull = shape.GetConvexHull()
        return Triangles(*_triangulated(hull), rgba, smooth=False)
    if isinstance(shape, Mesh):
        mesh = load_mesh(shape)
        if mesh.has_materials:
            return Asset(mesh, rgba)
        return Triangles(mesh.vertices, mesh.faces, rgba)
    raise NotImplementedError(f"Meshcat.SetObject(): no way to draw a {type(shape).__name__}.")


def triangles_of(drawable: Drawable) -> Triangles | None:
    """Returns a drawable's surface as triangles, None for lines, points and half spaces."""
    if isinstance(drawable, Triangles):
        return drawable
    if isinstance(drawable, Asset):
        return Triangles(drawable.mesh.vertices, drawable.mesh.faces, drawable.rgba)
    if not isinstance(drawable, Primitive):
        return None
    shape, rgba = drawable.shape, drawable.rgba
    if isinstance(shape, Box):
        vertices, faces = box()
        return Triangles(vertices * shape.size(), faces, rgba, smooth=False)
    if isinstance(shape, Sphere):
        return Triangles(*capsule(shape.radius(), 0.0), rgba)
    if isinstance(shape, Ellipsoid):
        vertices, faces = capsule(1.0, 0.0)
        return Triangles(vertices * (shape.a(), shape.b(), shape.c()), faces, rgba)
    if isinstance(shape, Cylinder):
        return Triangles(*revolve([(0.0, -0.5), (1.0, -0.5), (1.0, 0.5), (0.0, 0.5)], shape), rgba, smooth=False)
    return None


def bounds_of(drawable: Drawable) -> np.ndarray | None:
    """Returns corners of the box around a drawable in its own frame, shape (2, 3); None for a half space."""
    if isinstance(drawable, Primitive):
        shape: Any = drawable.shape
        if isinstance(shape, HalfSpace):
            return None
        if isinstance(shape, Box):
            half = shape.size() / 2
        elif isinstance(shape, Sphere):
            half = np.full(3, shape.radius())
        elif isinstance(shape, Ellipsoid):
            half = np.array([shape.a(), shape.b(), shape.c()])
        else:
            half = np.array([shape.radius(), shape.radius(), shape.length() / 2])
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


def box() -> tuple[np.ndarray, np.ndarray]:
    """Returns vertices, shape (8, 3), and faces, shape (12, 3), of a unit cube around the origin."""
    vertices = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [face for a, b, c, d in quads for face in ((a, b, c), (a, c, d))]
    return vertices, np.array(faces)


def revolve(profile: list[tuple[float, float]], shape: Cylinder, sides: int = 48) -> tuple[np.ndarray, np.ndarray]:
    """Returns the surface of a profile of (radius, height) pairs turned about z, in units of a cylinder."""
    scaled = [(shape.radius() * r, shape.length() * z) for r, z in profile]
    return _lathe(np.array(scaled), sides)


def _lathe(profile: np.ndarray, sides: int) -> tuple[np.ndarray, np.ndarray]:
    """Returns the surface of a profile, shape (k, 2) of radius and height from bottom to top, turned about z."""
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


def capsule(radius: float, length: float, sides: int = 32, rings: int = 9) -> tuple[np.ndarray, np.ndarray]:
    """Returns vertices and faces of a capsule along z around the origin; a sphere when the length is zero."""
    angle = np.linspace(-np.pi / 2, 0.0, rings)
    lower = np.stack([np.cos(angle), np.sin(angle)], axis=1) * radius
    upper = (lower * (1.0, -1.0))[::-1]
    if length == 0.0:
        upper = upper[1:]
    half = np.array([0.0, length / 2])
    return _lathe(np.concatenate([lower - half, upper + half]), sides)


def cone(height: float, a: float, b: float) -> tuple[np.ndarray, np.ndarray]:
    """Returns vertices and faces of a cone with its apex at the origin and its base at z = height."""
    vertices, faces = _lathe(np.array([(0.0, 0.0), (1.0, height), (0.0, height)]), 48)
    return vertices * (a, b, 1.0), faces


def surface_grid(X: np.ndarray, Y: np.ndarray, Z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns vertices and faces of a surface over a grid of points, each argument of shape (rows, columns)."""
    rows, columns = Z.shape
    vertices = np.stack([X.ravel(), Y.ravel(), Z.ravel()], axis=1)
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    first = np.stack([corner, corner + 1, corner + columns], axis=1)
    second = np.stack([corner + 1, corner + columns + 1, corner + columns], axis=1)
    return vertices, np.concatenate([first, second])


def _triangulated(polygons: Any) -> tuple[np.ndarray, np.ndarray]:
    """Returns a polygon mesh's vertices and its faces cut into fans of triangles."""
    vertices = np.array([polygons.vertex(v) for v in range(polygons.num_vertices())])
    faces = []
    for f in range(polygons.num_faces()):
        polygon = polygons.element(f)
        ring = [polygon.vertex(i) for i in range(polygon.num_vertices())]
        faces += [(ring[0], ring[i], ring[i + 1]) for i in range(1, len(ring) - 1)]
    return vertices, np.array(faces)
