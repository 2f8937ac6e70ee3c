"""The lens of a camera."""

from __future__ import annotations

import math
import operator
from typing import Any

import numpy as np

from sheldrake.common._overloads import Mismatch, kind, overload, overloaded
from sheldrake.common._scalars import matrix, scalar


@kind("int")
def _pixels(value: Any) -> int:
    try:
        return operator.index(value)
    except TypeError:
        raise Mismatch from None


_SIZE: dict[str, Any] = {"width": _pixels, "height": _pixels}


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

    @overloaded(
        overload(**_SIZE, fov_y=scalar(float)),
        overload(**_SIZE, intrinsic_matrix=matrix(float, 3, 3)),
        overload(**_SIZE, focal_x=scalar(float), focal_y=scalar(float), center_x=scalar(float), center_y=scalar(float)),
    )
    def __init__(self, width: int, height: int, *lens: Any):
        self._width, self._height = width, height
        self._check(width > 0 and height > 0, "size")
        if len(lens) == 4:
            fx, fy, cx, cy = lens
        elif isinstance(lens[0], float):
            self._check(0.0 < lens[0] < math.inf, f"fov_y = {lens[0]}")
            fx = fy = height * 0.5 / math.tan(0.5 * lens[0])
            cx, cy = width / 2.0 - 0.5, height / 2.0 - 0.5
        else:
            (fx, k01, cx), (k10, fy, cy), last = lens[0].tolist()
            self._check(not (k01 or k10) and last == [0.0, 0.0, 1.0], f"intrinsic_matrix = {lens[0].tolist()}")
        self._focal, self._center = (fx, fy), (cx, cy)
        self._check(0.0 < fx < math.inf and 0.0 < fy < math.inf, f"focal lengths {self._focal}")
        self._check(0.0 < cx < width and 0.0 < cy < height, f"principal point {self._center}")

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
