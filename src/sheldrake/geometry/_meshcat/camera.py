"""How one looks at a Meshcat, and what surrounds the scene."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._options import Options

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.math._rigid_transform import RigidTransform

    from .hub import Hub
    from .placement import Placement


class PerspectiveCamera(Options):
    """A perspective camera: vertical field of view [deg], aspect, planes [m], zoom."""

    fov: float = 75.0
    aspect: float = 1.0
    near: float = 0.01
    far: float = 100.0
    zoom: float = 1.0


class OrthographicCamera(Options):
    """An orthographic camera: the box it sees, in its own frame [m], and zoom."""

    left: float = -1.0
    right: float = 1.0
    top: float = -1.0
    bottom: float = 1.0
    near: float = -1000.0
    far: float = 1000.0
    zoom: float = 1.0


@checked
class Cameras:
    """Places the camera.

    Args:
        hub: What the page shows, and what it says of its camera.
        placement: Sets properties.
    """

    def __init__(self, hub: Hub, placement: Placement):
        self._hub, self._placement = hub, placement

    def SetCamera(self, camera: PerspectiveCamera | OrthographicCamera, path: str = "/Cameras/default/rotated") -> None:
        """Sets the camera's lens. An orthographic one is drawn by a far camera with a narrow field of view.

        Raises:
            TypeError: when it is no camera.
        """
        stage = self._hub.page.stage
        if isinstance(camera, PerspectiveCamera):
            stage.set_field_of_view(2 * np.arctan(np.tan(np.radians(camera.fov) / 2) / camera.zoom))
        elif isinstance(camera, OrthographicCamera):
            half = abs(camera.top - camera.bottom) / 2 / camera.zoom
            fov = np.radians(2.0)
            away = stage.position - stage.target
            distance = max(float(np.linalg.norm(away)), 1e-9)
            stage.set_field_of_view(fov)
            stage.set_camera(stage.target + away / distance * half / np.tan(fov / 2), stage.target)
        else:
            raise TypeError(f"Meshcat.SetCamera(): expected a camera, got {type(camera).__name__}.")

    def SetCameraPose(self, camera_in_world: ArrayLike, target_in_world: ArrayLike) -> None:
        """Places the camera and what it looks at, in the world [m], shape (3,) each."""
        position = np.asarray(camera_in_world, dtype=float).reshape(3)
        self._hub.page.stage.set_camera(position, np.asarray(target_in_world, dtype=float).reshape(3))

    def SetCameraTarget(self, target_in_world: ArrayLike) -> None:
        """Turns the camera to a point in the world [m], shape (3,)."""
        self._hub.page.stage.set_camera(None, np.asarray(target_in_world, dtype=float).reshape(3))

    def GetTrackedCameraPose(self) -> RigidTransform | None:
        """Returns the camera's RigidTransform in the world (x right, y down, z forward) in the page opened
        with "?tracked_camera=on", None while there is no such page."""
        from sheldrake.math import RigidTransform, RotationMatrix

        pose = self._hub.controls.tracked_camera_pose()
        if pose is None:
            return None
        if len(pose) == 2:
            return _pose(*pose)
        # Meshcat's own message: a column-major matrix in three.js's axes (+y up; camera x right, y up, -z forward).
        M = np.array(pose, dtype=float).reshape(4, 4).T
        up = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
        R = up @ M[:3, :3] @ np.diag([1.0, -1.0, -1.0])
        return RigidTransform(RotationMatrix.ProjectToRotationMatrix(R), up @ M[:3, 3])

    def _newest_camera_pose(self) -> RigidTransform | None:
        """The camera's RigidTransform in the page whose camera moved last, None while there is no page."""
        pose = self._hub.controls.newest_camera_pose()
        return None if pose is None else _pose(*pose)

    def _field_of_view(self) -> float:
        """The camera's, from the lower to the upper edge of the page [rad]."""
        return self._hub.page.stage.field_of_view

    def Set2dRenderMode(
        self,
        X_WC: RigidTransform | None = None,
        xmin: float = -1.0,
        xmax: float = 1.0,
        ymin: float = -1.0,
        ymax: float = 1.0,
    ) -> None:
        """Looks along +Cy at a rectangle of the Cx-Cz plane, and hides background, grid and axes.

        Args:
            X_WC: RigidTransform of the camera; at (0, -1, 0) when left out.
            xmin: Left edge of the rectangle [m].
            xmax: Right edge [m].
            ymin: Lower edge, along Cz [m].
            ymax: Upper edge, along Cz [m].
        """
        matrix = np.eye(4)
        if X_WC is None:
            matrix[1, 3] = -1.0
        else:
            matrix[:3] = X_WC.GetAsMatrix34()
        self._hub.page.stage.view_flat(matrix, float(xmin), float(xmax), float(ymin), float(ymax))

    def ResetRenderMode(self) -> None:
        """Shows background, grid and axes again, through the usual camera."""
        self._hub.page.stage.reset()

    def SetEnvironmentMap(self, image_path: str | os.PathLike) -> None:
        """Lights the scene by a picture and shows the picture all around.

        Args:
            image_path: A panorama (equirectangular: all around by from top to bottom), such as PNG or JPEG. Of another
                file, such as HDR, the page keeps the light it has and says so. "" goes back to the usual light.

        Raises:
            RuntimeError: when the file cannot be opened.
        """
        text = os.fspath(image_path)
        if text and not Path(text).is_file():
            raise RuntimeError(f"Meshcat.SetEnvironmentMap(): cannot open '{text}'.")
        self._placement.SetProperty("/Background/<object>", "environment_map", text)


def _pose(wxyz: np.ndarray, position: np.ndarray) -> Any:
    from sheldrake.common.eigen_geometry import Quaternion
    from sheldrake.math import RigidTransform, RotationMatrix

    return RigidTransform(RotationMatrix(Quaternion(wxyz=wxyz / np.linalg.norm(wxyz))), position)
