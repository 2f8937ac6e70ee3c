"""The questions to a QueryObject that are answered by pictures."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.geometry._ids import FrameId
from sheldrake.geometry._image import ImageDepth32F, ImageLabel16I, ImageRgba8U
from sheldrake.geometry._numbers import values_of
from sheldrake.geometry._query.poses import Poses
from sheldrake.geometry._state.records import WORLD_FRAME_ID

if TYPE_CHECKING:
    from sheldrake.geometry._image import _Image
    from sheldrake.geometry._render.camera import ColorRenderCamera, DepthRenderCamera, RenderCameraCore
    from sheldrake.geometry._render.engine import RenderEngine
    from sheldrake.math import RigidTransform


class Images(Poses):
    """A part of QueryObject: images of what has the perception role, by the state's renderers."""

    def _renderer(self, core: RenderCameraCore, parent_frame: FrameId, X_PC: RigidTransform) -> RenderEngine:
        """The render engine of a camera on a frame, everything at its place."""
        from sheldrake.math import RigidTransform

        engine = self._state.renderers.use(core.renderer_name())
        if parent_frame != WORLD_FRAME_ID:
            self._state.frame(parent_frame)
        moving = self._state.renderers.moving(core.renderer_name(), self._state)
        if moving.ids:
            X_WF = self._world_matrices(moving.frames, moving.memo)[moving.frame_of]
            R_WF, R_FG, p_FG = X_WF[:, :, :3], moving.X_FG[:, :, :3], moving.X_FG[:, :, 3:]
            engine._update_poses(moving.ids, np.concatenate([R_WF @ R_FG, R_WF @ p_FG + X_WF[:, :, 3:]], axis=2))
        X_WP = RigidTransform(values_of(self._world_poses([parent_frame])[parent_frame].GetAsMatrix34()))
        engine.UpdateViewpoint(X_WP @ X_PC @ core.sensor_pose_in_camera_body())
        return engine

    @checked
    def RenderColorImage(self, camera: ColorRenderCamera, parent_frame: FrameId, X_PC: RigidTransform) -> _Image:
        """What a camera sees, in colours.

        Args:
            camera: Lens, and which renderer draws.
            parent_frame: Frame P that the camera moves with.
            X_PC: Pose of the camera (x right, y down, z forward) in P.

        Returns:
            An ImageRgba8U.

        Raises:
            RuntimeError: there is no such frame or renderer.
        """
        image = ImageRgba8U(camera.core().intrinsics().width(), camera.core().intrinsics().height())
        self._renderer(camera.core(), parent_frame, X_PC).RenderColorImage(camera, image)
        return image

    @checked
    def RenderDepthImage(self, camera: DepthRenderCamera, parent_frame: FrameId, X_PC: RigidTransform) -> _Image:
        """Depth [m] of what a camera sees: z in the camera's frame, 0 for too close, infinity for too far or nothing.

        Args:
            camera: Lens, range of depths, and which renderer draws.
            parent_frame: Frame P that the camera moves with.
            X_PC: Pose of the camera (x right, y down, z forward) in P.

        Returns:
            An ImageDepth32F.

        Raises:
            RuntimeError: there is no such frame or renderer.
        """
        image = ImageDepth32F(camera.core().intrinsics().width(), camera.core().intrinsics().height())
        self._renderer(camera.core(), parent_frame, X_PC).RenderDepthImage(camera, image)
        return image

    @checked
    def RenderLabelImage(self, camera: ColorRenderCamera, parent_frame: FrameId, X_PC: RigidTransform) -> _Image:
        """Labels of what a camera sees, RenderLabel.kEmpty for nothing.

        Args:
            camera: Lens, and which renderer draws.
            parent_frame: Frame P that the camera moves with.
            X_PC: Pose of the camera (x right, y down, z forward) in P.

        Returns:
            An ImageLabel16I.

        Raises:
            RuntimeError: there is no such frame or renderer.
        """
        image = ImageLabel16I(camera.core().intrinsics().width(), camera.core().intrinsics().height())
        self._renderer(camera.core(), parent_frame, X_PC).RenderLabelImage(camera, image)
        return image
