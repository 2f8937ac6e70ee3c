"""The lens of a camera."""

from __future__ import annotations

import math
import operator
from typing import Any

import numpy as np

from sheldrake.common._overloads import Mismatch


class CameraInfo:
    """Size of the image and intrinsics of a pinhole camera.

    Either `(width, height, fov_y)`, with the principal point in the middle, or `(width, height, focal_x, focal_y,
    center_x, center_y)`, or `(width, height, intrinsic_matrix)`.

    Args:
        width: Width of the image [pixels].
        height: Height of the image [pixels].
        fov_y: Vertical field of view [rad].
        focal_x: Focal length in x [pixels].
        focal_y: Focal length in y [pixels].
        center_x: Principal point [pixels].
        center_y: Principal point [pixels].
        intrinsic_matrix: [[focal_x, 0, center_x], [0, focal_y, center_y], [0, 0, 1]].
    """

    def __init__(self, width: int, height: int, *args: Any, **kwargs: Any):
        for name, size in (("width", width), ("height", height)):
            if not hasattr(size, "__index__"):
                raise Mismatch(f"CameraInfo(): incompatible constructor arguments: {name} must be an int, not {size!r}")
        self._width, self._height = operator.index(width), operator.index(height)
        names = ("focal_x", "focal_y", "center_x", "center_y")
        if len(args) == 4:
            kwargs.update(zip(names, args))
        elif len(args) == 1:
            kwargs["fov_y" if np.ndim(args[0]) == 0 else "intrinsic_matrix"] = args[0]
        if set(kwargs) == {"fov_y"}:
            fov_y = float(kwargs["fov_y"])
            self._check(width > 0 and height > 0 and 0.0 < fov_y < math.inf, f"fov_y = {fov_y}")
            focal = height * 0.5 / math.tan(0.5 * fov_y)
            self._focal, self._center = (focal, focal), (width / 2.0 - 0.5, height / 2.0 - 0.5)
        elif set(kwargs) == {"intrinsic_matrix"}:
            K = np.array(kwargs["intrinsic_matrix"], float)
            zeros = K.shape == (3, 3) and not (K[0, 1] or K[1, 0] or K[2, 0] or K[2, 1]) and K[2, 2] == 1.0
            self._check(bool(zeros), f"intrinsic_matrix = {K.tolist()}")
            self._focal, self._center = (float(K[0, 0]), float(K[1, 1])), (float(K[0, 2]), float(K[1, 2]))
        elif set(kwargs) == set(names):
            fx, fy, cx, cy = (float(kwargs[name]) for name in names)
            self._focal, self._center = (fx, fy), (cx, cy)
        else:
            raise Mismatch(f"CameraInfo(): incompatible constructor arguments: {args} {sorted(kwargs)}")
        self._check(width > 0 and height > 0, "size")
        self._check(all(0.0 < f < math.inf for f in self._focal), f"focal lengths {self._focal}")
        inside = 0.0 < self._center[0] < width and 0.0 < self._center[1] < height
        self._check(inside, f"principal point {self._center}")

    def _check(self, good: bool, what: str) -> None:
        if not good:
            raise RuntimeError(
                f"CameraInfo(): invalid camera configuration: {what} with an image of {self._width} x {self._height} "
                "pixels. Sizes, field of view and focal lengths must be positive and finite, and the principal point "
                "inside the image."
            )

    def width(self) -> int:
        """Width of the image [pixels]."""
        return self._width

    def height(self) -> int:
        """Height of the image [pixels]."""
        return self._height

    def focal_x(self) -> float:
        """Focal length in x [pixels]."""
        return self._focal[0]

    def focal_y(self) -> float:
        """Focal length in y [pixels]."""
        return self._focal[1]

    def fov_x(self) -> float:
        """Horizontal field of view [rad]."""
        return 2.0 * math.atan(self._width / (2.0 * self._focal[0]))

    def fov_y(self) -> float:
        """Vertical field of view [rad]."""
        return 2.0 * math.atan(self._height / (2.0 * self._focal[1]))

    def center_x(self) -> float:
        """Principal point [pixels]."""
        return self._center[0]

    def center_y(self) -> float:
        """Principal point [pixels]."""
        return self._center[1]

    def intrinsic_matrix(self) -> np.ndarray:
        """[[focal_x, 0, center_x], [0, focal_y, center_y], [0, 0, 1]]."""
        return np.array([[self._focal[0], 0, self._center[0]], [0, self._focal[1], self._center[1]], [0, 0, 1.0]])

    def __reduce__(self) -> tuple[Any, ...]:
        return CameraInfo, (self._width, self._height, *self._focal, *self._center)


CameraInfo.__module__ = "sheldrake.systems.sensors"
