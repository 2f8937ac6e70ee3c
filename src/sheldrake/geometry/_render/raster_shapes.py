"""Shapes as the renderer draws them: triangles, curved patches, materials."""

from __future__ import annotations

import dataclasses
import functools
import logging
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from sheldrake.geometry._kernels.raster_scene import DISC, QUADRIC, Patch, Vertex
from sheldrake.geometry._meshes.mesh_looks import load_mesh
from sheldrake.geometry._properties import PerceptionProperties
from sheldrake.geometry._shape_types import type_of
from sheldrake.geometry._shapes import Box, Capsule, Cylinder, Ellipsoid, HalfSpace, Mesh, Shape, Sphere

log = logging.getLogger("drake")
HALF_SPACE_SIZE = 100.0  # edge of the square that stands for a half space [m], as in Drake
_EVERYWHERE = (-np.inf, np.inf)


class Texture(NamedTuple):
    """Texels as r + 256 g + 65536 b, shape (height, width)."""

    texels: np.ndarray


@dataclasses.dataclass(frozen=True)
class Material:
    """How a surface looks.

    Attributes:
        diffuse: Colour (r, g, b, a), each in [0, 1].
        texture: Multiplies the colour, or None.
        smooth: Whether light goes by the normals of the vertices rather than the triangles.
        repeat: Whether the texture repeats beyond its edges; else its edges go on.
        coloured: Whether vertices have colours of their own.
    """

    diffuse: tuple[float, ...]
    texture: Texture | None = None
    smooth: bool = False
    repeat: bool = False
    coloured: bool = False

    def is_even(self) -> bool:
        """Whether a triangle of it has one colour and one normal."""
        return self.texture is None and not self.smooth and not self.coloured


@dataclasses.dataclass(frozen=True)
class Surface:
    """A geometry to draw; see `_kernels.raster_scene`.

    Attributes:
        vertex: Shape (n, Vertex.SIZE).
        face: Three vertices and a material, shape (m, 4).
        patch: Shape (k, Patch.SIZE); all of the first material.
        patch_kind: QUADRIC or DISC, shape (k,).
        materials: What the last column of `face` counts.
    """

    vertex: np.ndarray
    face: np.ndarray
    patch: np.ndarray
    patch_kind: np.ndarray
    materials: tuple[Material, ...]

    def opacity(self) -> float:
        """The least opacity of a material."""
        return min(material.diffuse[3] for material in self.materials)


def surface_of(shape: Shape, properties: PerceptionProperties, default: tuple[float, ...], engine: str) -> Surface:
    """A shape with the look that its properties, or its mesh file, say.

    Args:
        shape: The shape.
        properties: ("phong", "diffuse") and ("phong", "diffuse_map") are read.
        default: Colour (r, g, b, a) where nobody names one.
        engine: Name of the render engine, for messages.

    Raises:
        RuntimeError: for a kind of shape that cannot be drawn, or a file that cannot be read.
    """
    if isinstance(shape, Mesh):
        return _mesh_surface(shape, properties, default)
    material = _phong(properties) or Material(default)
    if isinstance(shape, Box):
        return _triangles(*_box(shape.size()), material=material)
    if isinstance(shape, HalfSpace):
        return _triangles(*_square(HALF_SPACE_SIZE), material=material)
    patches = _patches(shape)
    if patches is None:
        row = type_of(shape)
        if row.kind is None or row.surface is None:
            raise RuntimeError(f"This class ({engine}) does not support {type(shape).__name__}.")
        return _triangles(*row.surface(shape), material=material)
    kinds, rows = zip(*patches)
    none = np.zeros((0, Vertex.SIZE)), np.zeros((0, 4), np.int64)
    return Surface(*none, np.array(rows, float), np.array(kinds, np.int64), (material,))


# ---- materials


def _phong(properties: PerceptionProperties) -> Material | None:
    """The material that properties describe, if they do."""
    diffuse = properties.GetPropertyOrDefault("phong", "diffuse", None)
    path = properties.GetPropertyOrDefault("phong", "diffuse_map", "")
    texture = _texture_file(Path(path)) if path else None
    if diffuse is None and texture is None:
        return None
    rgba = (1.0, 1.0, 1.0, 1.0) if diffuse is None else tuple(getattr(diffuse, "rgba", diffuse))
    return Material(tuple(float(x) for x in rgba), texture)


def _texture_file(path: Path) -> Texture | None:
    if not path.is_file():
        log.warning("Render engine: the texture ('phong', 'diffuse_map') '%s' does not exist; it is left out.", path)
        return None
    return _read_texture(path, path.stat().st_mtime_ns)


@functools.lru_cache(maxsize=64)
def _read_texture(path: Path, _time: int) -> Texture:
    import PIL.Image

    try:
        with PIL.Image.open(path) as image:
            return _texture(image)
    except (OSError, SyntaxError, ValueError, PIL.Image.DecompressionBombError) as error:
        raise RuntimeError(
            f"Render engine: the texture ('phong', 'diffuse_map') '{path}' is no picture that can be read: {error}"
        ) from None


def _texture(image: Any) -> Texture:
    rgb = np.asarray(image.convert("RGB"))
    texel = rgb[..., 2].astype(np.int64)
    for channel in (1, 0):  # in place: a large picture has room once
        texel <<= 8
        texel += rgb[..., channel]
    return Texture(texel)


# ---- triangles


def _triangles(vertices: np.ndarray, faces: np.ndarray, uv: np.ndarray | None = None, *, material: Material) -> Surface:
    vertex = np.zeros((len(vertices), Vertex.SIZE))
    vertex[:, Vertex.p_GV.columns] = vertices
    vertex[:, Vertex.colour.columns] = 1.0
    if uv is not None:
        vertex[:, Vertex.texture.columns] = uv
    face = np.zeros((len(faces), 4), np.int64)
    face[:, :3] = faces
    return Surface(vertex, face, np.zeros((0, Patch.SIZE)), np.zeros(0, np.int64), (material,))


_UNIT_SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
_TWO_TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]])


def _square(edge: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices, faces and texture coordinates of a square in the plane z = 0."""
    vertices = np.zeros((4, 3))
    vertices[:, :2] = edge * (_UNIT_SQUARE - 0.5)
    return vertices, _TWO_TRIANGLES, _UNIT_SQUARE


def _box(size: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The same of a box; every side has the whole texture."""
    right_and_up = [  # of the texture on each side, seen from outside
        ((0, 1, 0), (0, 0, 1)),
        ((0, -1, 0), (0, 0, 1)),
        ((-1, 0, 0), (0, 0, 1)),
        ((1, 0, 0), (0, 0, 1)),
        ((1, 0, 0), (0, 1, 0)),
        ((1, 0, 0), (0, -1, 0)),
    ]
    sides = [np.array([right, up, np.cross(right, up)], float) for right, up in right_and_up]
    corners = np.column_stack([_UNIT_SQUARE - 0.5, np.full(4, 0.5)])
    vertices = np.concatenate([corners @ side for side in sides]) * size
    faces = np.concatenate([_TWO_TRIANGLES + 4 * k for k in range(6)])
    return vertices, faces, np.tile(_UNIT_SQUARE, (6, 1))


def _mesh_surface(shape: Mesh, properties: PerceptionProperties, default: tuple[float, ...]) -> Surface:
    """A mesh file.

    Its materials go before the properties, those before colours of its vertices, and these before a picture `name.png`
    beside `name.obj`.
    """
    given = _phong(properties)
    fallback = given or _texture_beside(shape) or Material(default)
    mesh = load_mesh(shape, "Render engine")
    if given is not None and any(part.diffuse is not None and part.colors is None for part in mesh.parts):
        log.warning(
            "Render engine: the mesh %s has materials of its own; its properties ('phong', ...) are ignored.",
            shape.source().description(),
        )
    vertex: list[np.ndarray] = []
    face: list[np.ndarray] = []
    materials: list[Material] = []
    count = 0
    for part in mesh.parts:
        whole = _triangles(part.vertices, part.faces, part.uv, material=fallback)
        coloured = part.colors is not None and given is None
        if coloured:
            whole.vertex[:, Vertex.colour.columns] = part.colors
        if part.normals is not None:
            whole.vertex[:, Vertex.normal.columns] = part.normals
        own = fallback
        if part.diffuse is not None and (coloured or part.colors is None):
            own = Material(part.diffuse, None if part.image is None else _texture(part.image))
        beyond = part.uv is not None and (part.uv.min(initial=0.0) < 0.0 or part.uv.max(initial=1.0) > 1.0)
        looks: dict[str, Any] = {"smooth": part.normals is not None, "repeat": beyond, "coloured": coloured}
        materials.append(dataclasses.replace(own, **looks))
        vertex.append(whole.vertex)
        face.append(whole.face + np.array([count, count, count, len(face)]))
        count += len(whole.vertex)
    return Surface(
        np.concatenate(vertex),
        np.concatenate(face),
        np.zeros((0, Patch.SIZE)),
        np.zeros(0, np.int64),
        tuple(materials),
    )


def _texture_beside(shape: Mesh) -> Material | None:
    source = shape.source()
    path = source.path().with_suffix(".png") if source.is_path() else None
    if path is None or not path.is_file():
        return None
    return Material((1.0, 1.0, 1.0, 1.0), _texture_file(path))


# ---- curved patches


def _quadric(
    radii: tuple[float, float, float], z0: float, band: tuple[float, float], extent: float, wrap: float
) -> tuple:
    """A band of an ellipsoid, or of a cylinder where the third radius is infinite.

    Args:
        radii: Along x, y, z [m].
        z0: Height of the centre [m].
        band: Least and largest z [m].
        extent: How far it reaches from z0 along the axis [m].
        wrap: Half of the height that a texture wrapped about the axis covers [m]; 0 for longitude and latitude.
    """
    a, b, c = radii
    box = (a, b, max(z0 - extent, band[0]), min(z0 + extent, band[1]))
    return QUADRIC, (1 / a**2, 1 / b**2, 1 / c**2, z0, *band, *box, -wrap, wrap)


def _disc(radius: float, z: float) -> tuple:
    return DISC, (0.0, 0.0, 0.0, z, 0.0, radius, radius, radius, z, z, 0.0, 0.0)


def _patches(shape: Shape) -> list[tuple] | None:
    """Kinds and numbers of the patches of a round shape."""
    if isinstance(shape, Sphere):
        r = shape.radius()
        return [_quadric((r, r, r), 0.0, _EVERYWHERE, r, 0.0)]
    if isinstance(shape, Ellipsoid):
        return [_quadric((shape.a(), shape.b(), shape.c()), 0.0, _EVERYWHERE, shape.c(), 0.0)]
    if not isinstance(shape, (Cylinder, Capsule)):
        return None
    r, half = shape.radius(), shape.length() / 2.0
    wrap = half + r if isinstance(shape, Capsule) else half
    tube = _quadric((r, r, np.inf), 0.0, (-half, half), half, wrap)
    if isinstance(shape, Cylinder):
        return [tube, _disc(r, half), _disc(r, -half)]
    top = _quadric((r, r, r), half, (half, np.inf), r, wrap)
    return [tube, top, _quadric((r, r, r), -half, (-np.inf, -half), r, wrap)]
