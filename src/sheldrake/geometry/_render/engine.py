"""RenderEngine: what draws pictures of geometry.

The base for engines of users as well as our own (`raster_engine`). A SceneGraph tells it shapes, poses and cameras.
"""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING, cast

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.geometry._camera_info import CameraInfo
from sheldrake.geometry._ids import GeometryId
from sheldrake.geometry._properties import PerceptionProperties
from sheldrake.geometry._shapes import Shape

from .camera import ColorRenderCamera, DepthRenderCamera, RenderCameraCore
from .label import RenderLabel

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.geometry._image import _Image
    from sheldrake.math import RigidTransform


@checked
class RenderEngine:
    """Draws pictures of the geometry with the perception role that is registered with it.

    An engine of your own defines `UpdateViewpoint(X_WR)`, `DoRegisterVisual(id, shape, properties, X_WG)`, which
    returns whether it will draw the geometry, `DoUpdateVisualPose(id, X_WG)`, `DoRemoveGeometry(id)`, as many of
    `DoRenderColorImage(camera, image)`, `DoRenderDepthImage(camera, image)` and `DoRenderLabelImage(camera, image)` as
    it can draw, and `DoClone()` where `copy.deepcopy()` would not do: every context has an engine of its own.
    """

    _default_label = RenderLabel.kUnspecified

    def __init__(self) -> None:
        self._registered: dict[GeometryId, bool] = {}  # -> whether its pose changes

    # ---- what engines define

    def UpdateViewpoint(self, X_WR: RigidTransform) -> None:
        """Sets the pose of the camera (x right, y down, z forward) in the world."""
        raise self._undefined("UpdateViewpoint")

    def DoRegisterVisual(
        self, id: GeometryId, shape: Shape, properties: PerceptionProperties, X_WG: RigidTransform
    ) -> bool:
        """Takes a geometry over; returns whether it will be drawn."""
        raise self._undefined("DoRegisterVisual")

    def DoUpdateVisualPose(self, id: GeometryId, X_WG: RigidTransform) -> None:
        """Moves a geometry."""
        raise self._undefined("DoUpdateVisualPose")

    def DoRemoveGeometry(self, id: GeometryId) -> bool:
        """Forgets a geometry; returns whether it was there."""
        raise self._undefined("DoRemoveGeometry")

    def DoRenderColorImage(self, camera: ColorRenderCamera, color_image_out: _Image) -> None:
        """Draws colours into an ImageRgba8U."""
        raise self._undefined("DoRenderColorImage")

    def DoRenderDepthImage(self, camera: DepthRenderCamera, depth_image_out: _Image) -> None:
        """Draws depths [m] into an ImageDepth32F."""
        raise self._undefined("DoRenderDepthImage")

    def DoRenderLabelImage(self, camera: ColorRenderCamera, label_image_out: _Image) -> None:
        """Draws labels into an ImageLabel16I."""
        raise self._undefined("DoRenderLabelImage")

    def DoClone(self) -> RenderEngine:
        """Returns an independent engine with the same geometry."""
        return copy.deepcopy(self)

    def DoGetParameterYaml(self) -> str:
        """Returns the engine's options as YAML."""
        return "UnknownRenderEngine: {}"

    def SetDefaultLightPosition(self, X_DL: ArrayLike) -> None:
        """Moves the light of an engine that has one of its own; does nothing here."""

    def _undefined(self, method: str) -> Exception:
        return RuntimeError(f'{type(self).__name__}: Tried to call pure virtual function "RenderEngine::{method}"')

    # ---- what everyone calls

    def Clone(self) -> RenderEngine:
        """Returns an independent engine with the same geometry."""
        new = self.DoClone()
        new._registered = dict(self._registered)
        return new

    def GetParameterYaml(self) -> str:
        """Returns the engine's options as YAML."""
        return self.DoGetParameterYaml()

    def RegisterVisual(
        self,
        id: GeometryId,
        shape: Shape,
        properties: PerceptionProperties,
        X_WG: RigidTransform,
        needs_updates: bool = True,
        name: str = "",
    ) -> bool:
        """Asks the engine to draw a geometry.

        Args:
            id: The geometry, which the engine does not know yet.
            shape: Its shape.
            properties: How it looks.
            X_WG: Its pose in the world.
            needs_updates: Whether its pose will change.
            name: What the geometry is called; engines here do not need it.

        Returns:
            Whether the engine will draw it.

        Raises:
            RuntimeError: its label is kUnspecified or kEmpty, or a file cannot be read.
        """
        accepted = bool(self.DoRegisterVisual(id, shape, properties, X_WG))
        if accepted:
            self._registered[id] = needs_updates
        return accepted

    def RemoveGeometry(self, id: GeometryId) -> bool:
        """Removes a geometry; returns whether it was there."""
        if id not in self._registered:
            return False
        del self._registered[id]
        self.DoRemoveGeometry(id)
        return True

    def has_geometry(self, id: GeometryId) -> bool:
        """Whether the engine draws the geometry."""
        return id in self._registered

    def _moving(self) -> list[GeometryId]:
        """The geometries whose poses change."""
        return [geometry_id for geometry_id, moves in self._registered.items() if moves]

    def _update_poses(self, ids: list[GeometryId], X_WG: np.ndarray) -> None:
        """Moves geometries to poses, shape (n, 3, 4)."""
        from sheldrake.math import RigidTransform

        for geometry_id, pose in zip(ids, X_WG):
            self.DoUpdateVisualPose(geometry_id, RigidTransform(pose))

    def RenderColorImage(self, camera: ColorRenderCamera, color_image_out: _Image | None) -> None:
        """Draws colours into an image of the camera's size.

        Raises:
            RuntimeError: the image has another size, or the engine draws no colours.
        """
        self.DoRenderColorImage(camera, self._given(camera.core(), color_image_out, "color"))

    def RenderDepthImage(self, camera: DepthRenderCamera, depth_image_out: _Image | None) -> None:
        """Draws depths [m] into an image of the camera's size; 0 is too close, infinity too far or nothing.

        Raises:
            RuntimeError: the image has another size, or the engine draws no depths.
        """
        self.DoRenderDepthImage(camera, self._given(camera.core(), depth_image_out, "depth"))

    def RenderLabelImage(self, camera: ColorRenderCamera, label_image_out: _Image | None) -> None:
        """Draws labels into an image of the camera's size; kEmpty is nothing.

        Raises:
            RuntimeError: the image has another size, or the engine draws no labels.
        """
        self.DoRenderLabelImage(camera, self._given(camera.core(), label_image_out, "label"))

    def _given(self, core: RenderCameraCore, image: _Image | None, kind: str) -> _Image:
        self.ThrowIfInvalid(core.intrinsics(), image, kind)
        return cast("_Image", image)

    @staticmethod
    def ThrowIfInvalid(intrinsics: CameraInfo, image: _Image | None, image_type: str) -> None:
        """Raises RuntimeError unless the image has the camera's size."""
        if image is None:
            raise RuntimeError(f"Can't render a {image_type} image. The given output image is nullptr")
        found, expected = (image.width(), image.height()), (intrinsics.width(), intrinsics.height())
        if found != expected:
            raise RuntimeError(
                f"The {image_type} image to write has a size different from that specified in the camera intrinsics. "
                f"Image: {found}, intrinsics: {expected}"
            )

    def default_render_label(self) -> RenderLabel:
        """The label of geometry that names none."""
        return self._default_label

    def GetRenderLabelOrThrow(self, properties: PerceptionProperties) -> RenderLabel:
        """The label of geometry with these properties.

        Raises:
            RuntimeError: it is kUnspecified or kEmpty.
        """
        label = properties.GetPropertyOrDefault("label", "id", self.default_render_label())
        if not isinstance(label, RenderLabel):
            raise RuntimeError(
                "GetProperty(): The property ('label', 'id') exists, but is of a different type. Requested "
                f"'RenderLabel', but found '{type(label).__name__}'"
            )
        if label in (RenderLabel.kUnspecified, RenderLabel.kEmpty):
            raise RuntimeError(
                "Cannot register a geometry with the 'unspecified' or 'empty' render labels. Give it a label in "
                "PerceptionProperties ('label', 'id'); this engine's label for geometry without is "
                f"{self.default_render_label()}."
            )
        return label

    def _type_name(self) -> str:
        return f"{type(self).__module__}.{type(self).__qualname__}"
