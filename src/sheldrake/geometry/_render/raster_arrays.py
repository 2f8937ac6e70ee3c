"""What the renderer's kernels read: geometry, materials and lights as arrays."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from sheldrake.geometry._kernels.raster_scene import (
    DIRECTIONAL,
    POINT,
    SPOT,
    Face,
    ItemParts,
    Light,
    Look,
    Paint,
    Patch,
    PatchKind,
    Surfaces,
    Vertex,
)
from sheldrake.geometry._shapes import Shape

from .label import RenderLabel
from .params import LightParameter
from .raster_shapes import Material, Surface, Texture

_LIGHT_KINDS = {"directional": DIRECTIONAL, "point": POINT, "spot": SPOT}
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
    row = np.zeros(Light.SIZE)
    direction = X_CF[:, :3] @ np.asarray(light.direction, float)
    length = np.linalg.norm(direction)
    row[Light.kind] = _LIGHT_KINDS[light.type]
    row[Light.colour.columns] = light.color.rgba[:3] * light.intensity
    row[Light.p_CL.columns] = X_CF[:, :3] @ np.asarray(light.position) + X_CF[:, 3]
    row[Light.direction.columns] = direction / length if length > 0.0 else direction
    row[Light.attenuation.columns] = light.attenuation_values
    row[Light.cone] = math.cos(math.radians(light.cone_angle))
    return row


def joined(items: list[Item]) -> tuple[Surfaces, Look]:
    """All items in one set of arrays."""
    bounds = np.zeros((len(items) + 1, ItemParts.SIZE), np.int64)
    faces: list[np.ndarray] = []
    kinds: list[np.ndarray] = []
    materials: list[Material] = []
    for k, item in enumerate(items):
        surface = item.surface
        face = np.zeros((len(surface.face), Face.SIZE), np.int64)
        face[:, Face.corners.columns] = surface.face[:, :3] + bounds[k, ItemParts.first_vertex]
        face[:, Face.item] = k
        face[:, Face.material] = surface.face[:, 3] + len(materials)
        kind = np.zeros((len(surface.patch), PatchKind.SIZE), np.int64)
        kind[:, PatchKind.kind] = surface.patch_kind
        kind[:, PatchKind.item], kind[:, PatchKind.material] = k, len(materials)
        bounds[k, ItemParts.label] = int(item.label)
        bounds[k + 1] = bounds[k] + [len(surface.vertex), len(face), len(kind), 0]
        bounds[k + 1, ItemParts.label] = 0
        faces.append(face)
        kinds.append(kind)
        materials += surface.materials
    surfaces = Surfaces(
        item=bounds,
        face=_stacked(faces, Face.SIZE, np.int64),
        vertex=_stacked([item.surface.vertex for item in items], Vertex.SIZE, float),
        patch=_stacked([item.surface.patch for item in items], Patch.SIZE, float),
        patch_kind=_stacked(kinds, PatchKind.SIZE, np.int64),
    )
    return surfaces, _joined_look(materials)


def _joined_look(materials: list[Material]) -> Look:
    texels: list[np.ndarray] = []
    places: dict[int, int] = {}
    rows = np.zeros((len(materials), Paint.SIZE))
    for row, material in zip(rows, materials):
        row[Paint.diffuse.columns], row[Paint.opacity] = material.diffuse[:3], material.diffuse[3]
        row[Paint.first_texel] = -1.0
        row[Paint.smooth], row[Paint.repeat] = material.smooth, material.repeat
        row[Paint.even] = material.is_even()
        texture: Texture | None = material.texture
        if texture is not None:
            if id(texture) not in places:
                places[id(texture)] = sum(a.size for a in texels)
                texels.append(texture.texels.ravel())
            row[Paint.first_texel] = places[id(texture)]
            row[Paint.texture_height], row[Paint.texture_width] = texture.texels.shape
    return Look(rows, np.concatenate([*texels, np.zeros(1, np.int64)]))


def _stacked(arrays: list[np.ndarray], width: int, dtype: type) -> np.ndarray:
    return np.ascontiguousarray(np.concatenate([np.zeros((0, width), dtype), *arrays]).astype(dtype))
