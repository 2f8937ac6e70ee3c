"""DepthImageToPointCloud: where a camera's pixels are in space."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common.value import AbstractValue
from sheldrake.geometry._point_cloud import BaseField, Fields, PointCloud
from sheldrake.math import RigidTransform
from sheldrake.systems.framework import LeafSystem
from sheldrake.systems.framework._port_getters import input_port, output_port
from sheldrake.systems.sensors import CameraInfo, ImageDepth16U, ImageDepth32F, ImageRgba8U, PixelType

if TYPE_CHECKING:
    from sheldrake.systems.framework import Context

_IMAGES = {PixelType.kDepth16U: ImageDepth16U, PixelType.kDepth32F: ImageDepth32F}
_TOO_CLOSE = 0
_TOO_FAR = {PixelType.kDepth16U: 65535, PixelType.kDepth32F: np.inf}


class DepthImageToPointCloud(LeafSystem):
    """Turns a depth image into a point for each pixel, row by row.

    Ports: inputs "depth_image", "color_image" (need not be connected), "camera_pose" (X_PC; need not be connected),
    output "point_cloud", in the frame P of that pose or in the camera's own (x right, y down, z forward). A pixel
    too close or too far is at infinity, a NaN stays one.

    Args:
        camera_info: The camera's lens.
        pixel_type: kDepth32F or kDepth16U.
        scale: What a pixel's value is multiplied by to get metres.
        fields: BaseFields of the cloud.

    Raises:
        RuntimeError: when the pixels are no depths, or there are no fields.
    """

    @checked
    def __init__(
        self,
        camera_info: CameraInfo,
        pixel_type: PixelType = PixelType.kDepth32F,
        scale: float = 1.0,
        fields: int = BaseField.kXYZs,
    ):
        super().__init__()
        if pixel_type not in _IMAGES:
            raise RuntimeError(f"DepthImageToPointCloud(): expected kDepth16U or kDepth32F, got {pixel_type}.")
        self._camera, self._pixel_type, self._scale = camera_info, pixel_type, np.float32(scale)
        self._fields, self._rays = Fields(fields), np.zeros((3, 0, 0))
        model = PointCloud(0, self._fields)
        self.DeclareAbstractInputPort("depth_image", AbstractValue.Make(_IMAGES[pixel_type]()))
        self.DeclareAbstractInputPort("color_image", AbstractValue.Make(ImageRgba8U()))
        self.DeclareAbstractInputPort("camera_pose", AbstractValue.Make(RigidTransform()))
        self.DeclareAbstractOutputPort("point_cloud", lambda: AbstractValue.Make(PointCloud(model)), self._calc)

    depth_image_input_port = input_port(0, "Returns the input port for the depth image.")
    color_image_input_port = input_port(1, "Returns the input port for the color image, taken from the same place.")
    camera_pose_input_port = input_port(2, "Returns the input port for the camera's pose X_PC.")
    point_cloud_output_port = output_port(0, "Returns the output port with the cloud.")

    def _calc(self, context: Context, output: AbstractValue) -> None:
        depth = self.depth_image_input_port().Eval(context).data[..., 0]
        cloud = PointCloud(depth.size, self._fields)
        if cloud.has_xyzs():
            pose = self.camera_pose_input_port()
            X_PC = pose.Eval(context) if pose.HasValue(context) else None
            cloud.mutable_xyzs()[...] = self._points(depth, X_PC)
        color = self.color_image_input_port()
        if cloud.has_rgbs() and color.HasValue(context):
            pixels = color.Eval(context).data
            if pixels.shape[:2] != depth.shape:
                raise RuntimeError(
                    f"DepthImageToPointCloud '{self.GetSystemPathname()}': the color image has {pixels.shape[1]} x "
                    f"{pixels.shape[0]} pixels, the depth image {depth.shape[1]} x {depth.shape[0]}."
                )
            cloud.mutable_rgbs()[...] = pixels[..., :3].reshape(-1, 3).T
        output.set_value(cloud)

    def _points(self, depth: np.ndarray, X_PC: Any) -> np.ndarray:
        """Returns the positions of all pixels, shape (3, n) [m]."""
        z = depth.astype(np.float32).ravel() * self._scale
        rays = self._rays_of(*depth.shape)
        with np.errstate(invalid="ignore"):
            if X_PC is None:
                points = rays * z
            else:
                points = X_PC.rotation().matrix() @ rays
                points *= z
                points += X_PC.translation()[:, None]
        nothing = ((depth == _TOO_CLOSE) | (depth == _TOO_FAR[self._pixel_type])).ravel()
        if nothing.any():
            points[:, nothing] = np.inf
        return points

    def _rays_of(self, height: int, width: int) -> np.ndarray:
        """What each pixel of an image looks at, at a depth of 1, shape (3, height * width)."""
        if self._rays.shape[1:] != (height, width):
            camera, rays = self._camera, np.ones((3, height, width))
            rays[0] = (np.arange(width) - camera.center_x()) / camera.focal_x()
            rays[1] = ((np.arange(height) - camera.center_y()) / camera.focal_y())[:, None]
            self._rays = rays
        return self._rays.reshape(3, -1)
