"""What the renderer's kernels read: geometry, materials and lights as arrays."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np

from sheldrake.geometry._kernels import raster_scene as columns
from sheldrake.geometry._kernels.raster_scene import Look, Surfaces
from sheldrake.geometry._shapes import Shape

from .label import RenderLabel
from .params import LightParameter
from .raster_shapes import Material, Surface, Texture

_LIGHT_KINDS = {"directional": columns.DIRECTIONAL, "point": columns.POINT, "spot": columns.SPOT}
_FRAMES = ("camera", "world")


@dataclasses.dataclass(frozen=True)
class Item:
    """A registered geometry."""

    shape: Shape
    surface: Surface
    label: RenderLabel


def check_light(light: LightParameter, engine: str) -> None:
    short = engine.rsplit("::", 1)[-1]
    if light.type not in _LIGHT_KINDS:
        raise RuntimeError(
            f"{short} given an invalid light type. Expected one of 'point', 'spot', or 'directional'. "
            f"Given '{light.type}'."
        )
    if light.frame not in _FRAMES:
        raise RuntimeError(
            f"{short} given an invalid frame for a light. Expected one of 'world' or 'camera'. Given '{light.frame}'."
        )


def light_row(light: LightParameter, X_CF: np.ndarray) -> np.ndarray:
    """A row of lights, in the camera's frame."""
    row = np.zeros(columns.LIGHT_COLUMNS)
    direction = X_CF[:, :3] @ np.asarray(light.direction, float)
    length = np.linalg.norm(direction)
    row[columns.LIGHT_KIND] = _LIGHT_KINDS[light.type]
    row[columns.LIGHT_COLOUR : columns.LIGHT_POSITION] = light.color.rgba[:3] * light.intensity
    row[columns.LIGHT_POSITION : columns.LIGHT_DIRECTION] = X_CF[:, :3] @ np.asarray(light.position) + X_CF[:, 3]
    row[columns.LIGHT_DIRECTION : columns.ATTENUATION] = direction / length if length > 0.0 else direction
    row[columns.ATTENUATION : columns.CONE] = light.attenuation_values
    row[columns.CONE] = math.cos(math.radians(light.cone_angle))
    return row


def joined(items: list[Item]) -> tuple[Surfaces, Look]:
    """All items in one set of arrays."""
    bounds = np.zeros((len(items) + 1, columns.ITEM_COLUMNS), np.int64)
    faces: list[np.ndarray] = []
    kinds: list[np.ndarray] = []
    materials: list[Material] = []
    for k, item in enumerate(items):
        surface = item.surface
        face = np.zeros((len(surface.face), columns.FACE_COLUMNS), np.int64)
        face[:, :3] = surface.face[:, :3] + bounds[k, columns.FIRST_VERTEX]
        face[:, columns.FACE_ITEM] = k
        face[:, columns.FACE_MATERIAL] = surface.face[:, 3] + len(materials)
        kind = np.zeros((len(surface.patch), columns.PATCH_KIND_COLUMNS), np.int64)
        kind[:, columns.KIND] = surface.patch_kind
        kind[:, columns.PATCH_ITEM], kind[:, columns.PATCH_MATERIAL] = k, len(materials)
        bounds[k, columns.LABEL] = int(item.label)
        bounds[k + 1] = bounds[k] + [len(surface.vertex), len(face), len(kind), 0]
        bounds[k + 1, columns.LABEL] = 0
        faces.append(face)
        kinds.append(kind)
        materials += surface.materials
    surfaces = Surfaces(
        item=bounds,
        face=_stacked(faces, columns.FACE_COLUMNS, np.int64),
        vertex=_stacked([item.surface.vertex for item in items], columns.VERTEX_COLUMNS, float),
        patch=_stacked([item.surface.patch for item in items], columns.PATCH_COLUMNS, float),
        patch_kind=_stacked(kinds, columns.PATCH_KIND_COLUMNS, np.int64),
    )
    return surfaces, _joined_look(materials)


def _joined_look(materials: list[Material]) -> Look:
    texels: list[np.ndarray] = []
    places: dict[int, int] = {}
    rows = np.zeros((len(materials), columns.MATERIAL_COLUMNS))
    for row, material in zip(rows, materials):
        row[columns.DIFFUSE : columns.FIRST_TEXEL] = material.diffuse
        row[columns.FIRST_TEXEL] = -1.0
        row[columns.SMOOTH], row[columns.REPEAT] = material.smooth, material.repeat
        row[columns.EVEN] = material.is_even()
        texture: Texture | None = material.texture
        if texture is not None:
            if id(texture) not in places:
                places[id(texture)] = sum(a.size for a in texels)
                texels.append(texture.texels.ravel())
            row[columns.FIRST_TEXEL] = places[id(texture)]
            row[columns.TEXTURE_HEIGHT], row[columns.TEXTURE_WIDTH] = texture.texels.shape
    return Look(rows, np.concatenate([*texels, np.zeros(1, np.int64)]))


def _stacked(arrays: list[np.ndarray], width: int, dtype: Any) -> np.ndarray:
    return np.ascontiguousarray(np.concatenate([np.zeros((0, width), dtype), *arrays]).astype(dtype))
