"""What arrows of all kinds share: their heads, their frames, and paths that come and go."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.geometry import Meshcat, MeshcatCone, Rgba
from sheldrake.math import RigidTransform, RotationMatrix

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

HEAD = 2.0  # height and radius of an arrow's head, in radii of its shaft
X_TURNED = RotationMatrix.MakeXRotation(np.pi)


def draw_head(meshcat: Meshcat, path: str, radius: float, color: Rgba) -> None:
    """Draws an arrow's head for a shaft of a radius [m]: a cone with its tip at the path's origin, opening to +z."""
    meshcat.SetObject(path, MeshcatCone(HEAD * radius, HEAD * radius, HEAD * radius), color)


def along(vector: np.ndarray, origin: np.ndarray) -> RigidTransform:
    """Returns a frame at a point, shape (3,), whose z axis runs along a vector, shape (3,), not zero."""
    return RigidTransform(RotationMatrix.MakeFromOneVector(vector, 2), origin)


def frames_along(vectors: np.ndarray) -> np.ndarray:
    """Returns rotation matrices, shape (n, 3, 3), whose z axes run along vectors, shape (n, 3), none of them zero.

    The same as RotationMatrix.MakeFromOneVector(), for many at once.
    """
    n = np.arange(len(vectors))
    u = vectors / np.linalg.norm(vectors, axis=1)[:, None]
    i = np.argmin(np.abs(u), axis=1)
    j, k = (i + 1) % 3, (i + 2) % 3
    length = np.sqrt(1.0 - u[n, i] ** 2)
    R = np.zeros((len(u), 3, 3))
    R[:, :, 2] = u
    R[n, j, 0], R[n, k, 0] = -u[n, k] / length, u[n, j] / length
    R[n, i, 1], R[n, j, 1], R[n, k, 1] = length, -u[n, i] * u[n, j] / length, -u[n, i] * u[n, k] / length
    return R


class Longest:
    """How long an arrow is drawn at most: as long as the scene, whatever the force.

    Forces of bodies that overlap at rest are a million times their weight; arrows of kilometres would hide the scene.

    Args:
        meshcat: Where to draw.
    """

    def __init__(self, meshcat: Meshcat):
        self._meshcat = meshcat
        self._extent: float | None = None
        self._asked, self._ask_next = 0, 1

    def of(self, lengths: Any) -> Any:
        """Returns lengths [m], those longer than the scene as long as the scene when its first arrow was drawn."""
        if self._extent is None:
            self._measure()
        return lengths if self._extent is None else np.minimum(lengths, self._extent)

    def _measure(self) -> None:
        """Measures the scene; where nothing but arrows is drawn, ever more seldom, for that walks over all of them."""
        self._asked += 1
        if self._asked == self._ask_next:
            self._ask_next *= 2
            self._extent = self._meshcat._extent()

    def forget(self) -> None:
        """Has the scene measured anew."""
        self._extent = None
        self._asked, self._ask_next = 0, 1


class Shown:
    """Which full paths are drawn and which of them are visible now.

    Args:
        meshcat: Where to draw.
    """

    def __init__(self, meshcat: Meshcat):
        self._meshcat = meshcat
        self._visible: dict[str, bool] = {}

    def add(self, path: str) -> bool:
        """Notes a path, hidden from the first frame of a recording on; returns whether it is new."""
        if path in self._visible:
            return False
        self._visible[path] = False
        start = self._meshcat.get_mutable_recording().start_time()
        self._meshcat.SetProperty(path, "visible", False, start)
        return True

    def show(self, path: str, visible: bool, time: float) -> None:
        """Shows or hides a noted path from a time of a recording [s] on."""
        self.show_all([path], [visible], time)

    def show_all(self, paths: list[str], visible: list[bool], time: float) -> None:
        """The same for many paths."""
        known = self._visible
        changed = [path for path, seen in zip(paths, visible) if known[path] != seen]
        if changed:
            known.update(zip(paths, visible))
            values = [known[path] for path in changed]
            self._meshcat._set_properties(changed, "visible", values, time)

    def hide_others(self, paths: set[str], time: float) -> None:
        """Hides everything noted except some paths, from a time of a recording [s] on."""
        others = [path for path, visible in self._visible.items() if visible and path not in paths]
        self.show_all(others, [False] * len(others), time)

    def clear(self) -> None:
        """Forgets all paths."""
        self._visible.clear()


def as_floats(array: ArrayLike) -> np.ndarray:
    """Returns an array's numbers without their derivatives."""
    array = np.asarray(array)
    if array.dtype != object:
        return array.astype(float)
    return np.array([float(x.value() if hasattr(x, "value") else x) for x in array.ravel()]).reshape(array.shape)
