"""The render engine of this library: a rasterizer in one kernel."""

from __future__ import annotations

import dataclasses
import logging
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.geometry._ids import GeometryId
from sheldrake.geometry._kernels.raster_image import draw
from sheldrake.geometry._kernels.raster_scene import (
    COLOURS,
    DEPTHS,
    LABELS,
    Look,
    PlacedVertex,
    PoseInCamera,
    Scene,
    Screen,
    Surfaces,
)
from sheldrake.geometry._numbers import values_of
from sheldrake.geometry._properties import PerceptionProperties
from sheldrake.geometry._rgba import Rgba
from sheldrake.geometry._shapes import Shape

from .camera import ColorRenderCamera, DepthRenderCamera, RenderCameraCore
from .engine import RenderEngine
from .label import RenderLabel
from .params import LightParameter
from .raster_arrays import Item, check_light, joined, light_row
from .raster_shapes import surface_of

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.geometry._image import _Image
    from sheldrake.math import RigidTransform

log = logging.getLogger("drake")
_ALL_DEPTHS = (0.0, math.inf)


@dataclasses.dataclass(frozen=True)
class EngineOptions:
    """What an engine was made with; `name` is that of Drake's class for it."""

    name: str
    params: Any
    default_diffuse: tuple[float, ...]
    background: Rgba
    lights: tuple[LightParameter, ...]


@checked
class RasterEngine(RenderEngine):
    """Draws with a z-buffer on the processor; spheres, cylinders, capsules and ellipsoids are exact.

    Pixel (u, v) looks along ((u + 1/2 - center_x) / focal_x, (v + 1/2 - center_y) / focal_y, 1), as in Drake's engines.
    """

    _default_label = RenderLabel.kDontCare

    def __init__(self, options: EngineOptions) -> None:
        super().__init__()
        for light in options.lights:
            check_light(light, options.name)
        self._options = options
        self._items: dict[GeometryId, Item] = {}
        self._X_WG: dict[GeometryId, np.ndarray] = {}
        self._X_WC = np.eye(3, 4)
        self._headlight = np.array([0.0, 0.0, 0.0])
        self._arrays: tuple[Surfaces, Look] | None = None
        self._screens: dict[tuple[int, int], tuple[Screen, Screen]] = {}

    def DoClone(self) -> RenderEngine:
        """An engine that shares what does not change."""
        return self._copy_to(RasterEngine(self._options))

    def _copy_to(self, new: RasterEngine) -> RasterEngine:
        new._items, new._X_WG, new._arrays = dict(self._items), dict(self._X_WG), self._arrays
        new._X_WC, new._headlight = self._X_WC, self._headlight
        return new

    def DoGetParameterYaml(self) -> str:
        """The options."""
        from sheldrake.common.yaml import yaml_dump_typed  # PyYAML is not there where wheels are built

        params = self._options.params
        return yaml_dump_typed(params, child_name=type(params).__name__) or ""

    def _type_name(self) -> str:
        return self._options.name

    # ---- geometry

    def DoRegisterVisual(
        self, id: GeometryId, shape: Shape, properties: PerceptionProperties, X_WG: RigidTransform
    ) -> bool:
        """Takes every geometry that it can draw."""
        label = self.GetRenderLabelOrThrow(properties)
        surface = surface_of(shape, properties, self._options.default_diffuse, self._options.name)
        self._items[id] = Item(shape, surface, label)
        self._X_WG[id] = _matrix(X_WG)
        self._arrays = None
        return True

    def DoUpdateVisualPose(self, id: GeometryId, X_WG: RigidTransform) -> None:
        self._X_WG[id] = _matrix(X_WG)

    def _update_poses(self, ids: list[GeometryId], X_WG: np.ndarray) -> None:
        self._X_WG.update(zip(ids, X_WG))

    def DoRemoveGeometry(self, id: GeometryId) -> bool:
        self._arrays = None
        del self._items[id], self._X_WG[id]
        return True

    def UpdateViewpoint(self, X_WR: RigidTransform) -> None:
        """Sets the camera's pose in the world."""
        self._X_WC = _matrix(X_WR)

    def SetDefaultLightPosition(self, X_DL: ArrayLike) -> None:
        """Moves the light of an engine without `lights`, in the camera's frame [m]; it shines at that origin."""
        self._headlight = np.array(X_DL, float).reshape(3)

    # ---- pictures

    def DoRenderColorImage(self, camera: ColorRenderCamera, color_image_out: _Image) -> None:
        r, g, b, _ = np.floor(self._options.background.rgba * 255.0 + 0.5).astype(int)
        opacity = [item.surface.opacity() for item in self._items.values()]
        opaque = [k for k, a in enumerate(opacity) if a >= 1.0]
        translucent = [k for k, a in enumerate(opacity) if 0.0 < a < 1.0]
        empty = int(r + (g << 8) + (b << 16) + (255 << 24))
        seen = self._draw(COLOURS, camera.core(), opaque, translucent, empty).seen
        color_image_out.mutable_data.view(np.uint32)[..., 0] = seen

    def DoRenderDepthImage(self, camera: DepthRenderCamera, depth_image_out: _Image) -> None:
        depths = camera.depth_range().min_depth(), camera.depth_range().max_depth()
        screen = self._draw(DEPTHS, camera.core(), range(len(self._items)), depths=depths)
        depth_image_out.mutable_data[..., 0] = screen.nearness

    def DoRenderLabelImage(self, camera: ColorRenderCamera, label_image_out: _Image) -> None:
        drawn = [k for k, item in enumerate(self._items.values()) if item.label != RenderLabel.kDoNotRender]
        screen = self._draw(LABELS, camera.core(), drawn, empty=int(RenderLabel.kEmpty))
        label_image_out.mutable_data[..., 0] = screen.seen

    def _draw(
        self,
        kind: Any,
        core: RenderCameraCore,
        opaque: Any,
        translucent: Any = (),
        empty: int = 0,
        depths: tuple[float, float] = _ALL_DEPTHS,
    ) -> Screen:
        """A picture, in arrays that the next picture overwrites."""
        surfaces, look = self._compiled()
        X_CG = self._poses_in_camera()
        distance = np.linalg.norm(X_CG[:, PoseInCamera.p_CG.columns], axis=1)
        scene = Scene(
            camera=_camera(core, depths),
            X_CG=X_CG,
            light=self._lights(),
            opaque=np.array(opaque, np.int64),
            translucent=np.array(sorted(translucent, key=lambda k: -distance[k]), np.int64),
            empty=np.array([empty], np.int64),
            corner=np.empty((len(surfaces.vertex), PlacedVertex.SIZE)),
        )
        screen, layer = self._screens_for(core.intrinsics().height(), core.intrinsics().width(), len(translucent) > 0)
        draw.native(int(kind), surfaces, look, scene, screen, layer)
        return screen

    def _compiled(self) -> tuple[Surfaces, Look]:
        """All geometry as arrays, made anew when geometry came or went."""
        if self._arrays is None:
            self._arrays = joined(list(self._items.values()))
        return self._arrays

    def _screens_for(self, height: int, width: int, layered: bool) -> tuple[Screen, Screen]:
        key = (height, width)
        if key not in self._screens:
            self._screens = {key: (_screen(*key), _screen(0, 0))}
        screen, layer = self._screens[key]
        if layered and layer.seen.size == 0:
            layer = _screen(*key)
            self._screens[key] = screen, layer
        return screen, layer

    def _poses_in_camera(self) -> np.ndarray:
        """X_CG of all items, shape (items, 12)."""
        X_WG = np.array([self._X_WG[i] for i in self._items]).reshape(-1, 3, 4)
        R_CW = self._X_WC[:, :3].T
        p_CG = (X_WG[:, :, 3] - self._X_WC[:, 3]) @ R_CW.T
        return np.concatenate([(R_CW @ X_WG[:, :, :3]).reshape(-1, 9), p_CG], axis=1)

    def _lights(self) -> np.ndarray:
        """The lights in the camera's frame."""
        if not self._options.lights:
            away = -self._headlight if self._headlight.any() else np.array([0.0, 0.0, 1.0])
            return np.array([light_row(LightParameter(direction=away), np.eye(3, 4))])
        R_CW = self._X_WC[:, :3].T
        X_C = {"camera": np.eye(3, 4), "world": np.column_stack([R_CW, -R_CW @ self._X_WC[:, 3]])}
        return np.array([light_row(light, X_C[light.frame]) for light in self._options.lights])


def _matrix(X: RigidTransform) -> np.ndarray:
    return values_of(X.GetAsMatrix34())


def _camera(core: RenderCameraCore, depths: tuple[float, float]) -> np.ndarray:
    lens, clipping = core.intrinsics(), core.clipping()
    focal_and_centre = [lens.focal_x(), lens.focal_y(), lens.center_x(), lens.center_y()]
    return np.array([*focal_and_centre, clipping.near(), clipping.far(), *depths])


def _screen(height: int, width: int) -> Screen:
    return Screen(np.empty((height, width)), np.empty((height, width), np.int64))


# ---- what users call
