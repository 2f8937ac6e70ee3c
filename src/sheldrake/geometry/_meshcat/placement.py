"""Where things are in a Meshcat, and their properties.

What is recorded goes to the animation, too; see `recorder`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any
from typing import overload as typing_overload

import numpy as np

from .tree import as_matrix4, full_path

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.math._rigid_transform import RigidTransform

    from .hub import Hub


class Placement:
    """Places, changes and removes paths.

    Args:
        hub: The scene and its recording.
    """

    def __init__(self, hub: Hub):
        self._hub = hub

    @typing_overload
    def SetTransform(self, path: str, X_ParentPath: RigidTransform, time_in_recording: float | None = None) -> None: ...
    @typing_overload
    def SetTransform(self, path: str, matrix: ArrayLike) -> None: ...
    def SetTransform(self, *args: Any, **kwargs: Any) -> None:
        """Places a path, and everything below it, in its parent.

        Overloads:
            SetTransform(path, X_ParentPath, time_in_recording=None)
            SetTransform(path, matrix), a homogeneous matrix, shape (4, 4), that may also stretch

        While recording, a pose with a time_in_recording [s] goes into the recording.

        Raises:
            TypeError: when the arguments fit no overload.
        """
        path, X, time = _transform_arguments(*args, **kwargs)
        path = full_path(path)
        if isinstance(X, np.ndarray):
            self._hub.tree.set_pose(path, X)
            return
        pose = np.array(X.GetAsMatrix34(), dtype=float)
        hub = self._hub
        if hub.recording and time is not None:
            hub.animation._set_pose(hub.animation.frame(time), path, pose)
            if not hub.show_while_recording:
                return
        hub.tree.set_pose(path, pose)

    def _set_poses(self, paths: list[str], poses: np.ndarray, time: float | None = None) -> None:
        """Places many full paths at once; poses of shape (n, 3, 4) or (n, 4, 4) that the caller will not change."""
        hub, each = self._hub, list(poses)
        if hub.recording and time is not None:
            hub.animation._set_poses(hub.animation.frame(time), paths, each)
            if not hub.show_while_recording:
                return
        hub.tree.set_poses(paths, each)

    def _set_properties(self, paths: list[str], name: str, values: list[Any], time: float | None = None) -> bool:
        """Sets a property of many full paths at once; returns whether the page shows it now."""
        hub = self._hub
        if hub.recording and time is not None:
            hub.animation._set_values(hub.animation.frame(time), paths, name, values)
            if not hub.show_while_recording:
                return False
        hub.tree.set_properties(paths, name, values)
        return True

    def _set_scales(self, paths: list[str], scales: np.ndarray, time: float | None = None) -> None:
        """Sets the property "scale" of many full paths that have no other pose; shape (n, 3)."""
        if self._set_properties(paths, "scale", scales.tolist(), time):
            matrices = np.zeros((len(paths), 4, 4))
            matrices[:, [0, 1, 2], [0, 1, 2]] = scales
            matrices[:, 3, 3] = 1.0
            self._hub.tree.set_poses(paths, matrices)

    def SetProperty(self, path: str, property: str, value: object, time_in_recording: float | None = None) -> None:
        """Sets a property of a path.

        The page shows "visible", "color", "opacity", "modulated_opacity", "position", "quaternion"
        and "scale" of anything; "visible" of "/Grid", "/Axes", "/Background" and "/Lights";
        "top_color" and "bottom_color" of "/Background"; "fov", "zoom" and "position" of the camera.
        Other properties are kept, and it is said once that the page cannot show them.

        Args:
            path: Path in the scene.
            property: Name of the property.
            value: A bool, a number or a list of numbers.
            time_in_recording: While recording, the time [s] at which the value goes into it.

        Raises:
            TypeError: when the value is of another type.
        """
        if isinstance(value, (bool, np.bool_)):
            value = bool(value)
        elif isinstance(value, (int, float, np.integer, np.floating)):
            value = float(value)
        elif isinstance(value, (list, tuple, np.ndarray)):
            value = [float(v) for v in value]
        elif not (isinstance(value, str) and property == "environment_map"):
            raise TypeError(
                f"Meshcat.SetProperty(): value of '{property}' must be a bool, a number or a list of numbers, got "
                f"{type(value).__name__}."
            )
        hub, full = self._hub, full_path(path)
        if hub.recording and time_in_recording is not None:
            hub.animation.SetProperty(hub.animation.frame(time_in_recording), full, property, value)
            if not hub.show_while_recording:
                return
        hub.tree.set_property(full, property, value)
        if property in ("position", "quaternion", "scale") and not full.startswith("/Cameras"):
            self._place(full, property, value)

    def _place(self, path: str, property: str, value: object) -> None:
        """Gives a path the position, the quaternion (x, y, z, w) or the scale of a property."""
        element = self._hub.tree.get(path)
        M = np.eye(4) if element is None or element.pose is None else as_matrix4(element.pose).copy()
        values = np.broadcast_to(np.asarray(value, dtype=float), (4 if property == "quaternion" else 3,))
        lengths = np.linalg.norm(M[:3, :3], axis=0)
        if property == "position":
            M[:3, 3] = values
        elif property == "quaternion":
            x, y, z, w = values / np.linalg.norm(values)
            R = np.array(
                [
                    [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                    [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                    [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
                ]
            )
            M[:3, :3] = R * lengths
        else:
            M[:3, :3] = M[:3, :3] / np.where(lengths > 0, lengths, 1.0) * values
        self._hub.tree.set_pose(path, M)

    def HasPath(self, path: str) -> bool:
        """Returns whether something was set at or below a path."""
        return self._hub.tree.has_path(full_path(path))

    def _defer(self, owner: str, draw: Callable[[], None]) -> None:
        """Has a visualizer draw when somebody looks; at once while it is recorded, for then every picture counts.

        Args:
            owner: Its prefix.
            draw: Draws, in whatever thread looks.
        """
        tree = self._hub.tree
        tree.defer(full_path(owner), draw)
        if self._hub.recording:
            tree.settle()

    def _note(self, path: str) -> None:
        """Says that what is drawn below a path tells about the scene: the camera is not placed for it."""
        self._hub.tree.note(full_path(path))

    def _extent(self) -> float | None:
        """The length of the box around what is seen of the scene [m], notes about it left out; None for nothing."""
        points = self._hub.page.outline()
        return None if points is None else float(np.linalg.norm(np.ptp(points, axis=0)))

    def _lowest(self, path: str) -> float | None:
        """The height of the lowest point that is seen at or below a path [m], None where nothing is."""
        return self._hub.page.lowest(full_path(path))

    def Delete(self, path: str = "") -> None:
        """Removes a path and everything below it; without a path, everything below "/drake"."""
        self._hub.tree.delete(full_path(path))


def _transform_arguments(
    path: str,
    X_ParentPath: RigidTransform | None = None,
    time_in_recording: float | None = None,
    *,
    matrix: ArrayLike | None = None,
) -> tuple[str, Any, float | None]:
    """Sorts out the two overloads of SetTransform; a matrix comes back as an array of its own."""
    given = X_ParentPath if matrix is None else matrix
    if hasattr(given, "GetAsMatrix34"):
        return path, given, time_in_recording
    array = np.array(given, dtype=float) if isinstance(given, (np.ndarray, list, tuple)) else None
    if array is None or array.shape != (4, 4) or time_in_recording is not None:
        found = type(given).__name__ if array is None else f"an array of shape {array.shape}"
        raise TypeError(
            f"Meshcat.SetTransform(): expected a RigidTransform (with an optional time_in_recording) or a matrix of "
            f"shape (4, 4), got {found}."
        )
    return path, array, None
