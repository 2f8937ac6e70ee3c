"""Cameras of pictures: lens, clipping planes, and which renderer draws."""

from __future__ import annotations

import copy
import math
from typing import TYPE_CHECKING, Any, overload

from sheldrake.common._overloads import incompatible
from sheldrake.geometry._camera_info import CameraInfo
from sheldrake.geometry._text import number

if TYPE_CHECKING:
    from typing_extensions import Self

    from sheldrake.math import RigidTransform


class _Value:
    """A constant: copies are equal, and `Class(other)` is one."""

    _names: tuple[str, ...] = ()

    def _arguments(self, args: tuple, kwargs: dict, **defaults: object) -> list[Any] | None:
        """The constructor's arguments by order; None for a copy, which has all it needs."""
        given = (*args, *kwargs.values())
        if len(given) == 1 and isinstance(given[0], type(self)):
            self.__dict__.update(given[0].__dict__)
            return None
        values = {**defaults, **dict(zip(self._names, args)), **kwargs}
        if len(args) > len(self._names) or set(values) != set(self._names):
            raise incompatible(type(self).__name__, [f"({', '.join(self._names)})", "(other)"], args, kwargs)
        return [values[name] for name in self._names]

    def __copy__(self) -> Self:
        new = object.__new__(type(self))
        new.__dict__.update(self.__dict__)
        return new

    def __deepcopy__(self, memo: dict) -> Self:
        return self.__copy__()


def _check_range(call: str, what: str, names: tuple[str, str, str, str], low: float, high: float) -> None:
    if not (0.0 < low < high and math.isfinite(high)):
        raise RuntimeError(
            f"{call}(): The {what} values must both be positive and finite and {names[1]} must be greater than "
            f"{names[0]}. Instantiated with {names[2]} = {number(low)} and {names[3]} = {number(high)}"
        )


class ClippingRange(_Value):
    """Between which planes surfaces are drawn.

    Args:
        near: Depth of the near plane [m].
        far: Depth of the far plane [m].

    Raises:
        RuntimeError: unless 0 < near < far < inf.
    """

    _names = ("near", "far")

    @overload
    def __init__(self, near: float, far: float) -> None: ...
    @overload
    def __init__(self, other: ClippingRange) -> None: ...
    def __init__(self, *args: Any, **kwargs: Any):
        given = self._arguments(args, kwargs)
        if given is not None:
            self._near, self._far = float(given[0]), float(given[1])
            _check_range("ClippingRange", "clipping range", ("near", "far", "near", "far"), self._near, self._far)

    def near(self) -> float:
        """Depth of the near plane [m]."""
        return self._near

    def far(self) -> float:
        """Depth of the far plane [m]."""
        return self._far


class DepthRange(_Value):
    """Which depths a sensor measures.

    Args:
        min_in: Least depth [m]; nearer pixels are "too close".
        min_out: Largest depth [m]; farther pixels are "too far".

    Raises:
        RuntimeError: unless 0 < min_in < min_out < inf.
    """

    _names = ("min_in", "min_out")

    @overload
    def __init__(self, min_in: float, min_out: float) -> None: ...
    @overload
    def __init__(self, other: DepthRange) -> None: ...
    def __init__(self, *args: Any, **kwargs: Any):
        given = self._arguments(args, kwargs)
        if given is not None:
            self._min, self._max = float(given[0]), float(given[1])
            names = ("the minimum depth", "the maximum depth", "min", "max")
            _check_range("DepthRange", "depth range", names, self._min, self._max)

    def min_depth(self) -> float:
        """Least depth that is measured [m]."""
        return self._min

    def max_depth(self) -> float:
        """Largest depth that is measured [m]."""
        return self._max


class RenderCameraCore(_Value):
    """What cameras for colours, depths and labels have in common.

    Args:
        renderer_name: Name of the render engine.
        intrinsics: Size of the picture and lens.
        clipping: Between which planes surfaces are drawn.
        X_BS: Pose of the sensor S (x right, y down, z forward) in the camera's body B.
    """

    _names = ("renderer_name", "intrinsics", "clipping", "X_BS")

    @overload
    def __init__(
        self, renderer_name: str, intrinsics: CameraInfo, clipping: ClippingRange, X_BS: RigidTransform
    ) -> None: ...
    @overload
    def __init__(self, other: RenderCameraCore) -> None: ...
    def __init__(self, *args: Any, **kwargs: Any):
        given = self._arguments(args, kwargs)
        if given is not None:
            self._renderer_name, self._intrinsics, self._clipping = str(given[0]), given[1], given[2]
            self._X_BS = copy.copy(given[3])
            if not isinstance(self._intrinsics, CameraInfo) or not isinstance(self._clipping, ClippingRange):
                raise incompatible("RenderCameraCore", [f"({', '.join(self._names)})"], args, kwargs)

    def renderer_name(self) -> str:
        """Name of the render engine."""
        return self._renderer_name

    def intrinsics(self) -> CameraInfo:
        """Size of the picture and lens."""
        return self._intrinsics

    def clipping(self) -> ClippingRange:
        """Between which planes surfaces are drawn."""
        return self._clipping

    def sensor_pose_in_camera_body(self) -> RigidTransform:
        """Pose X_BS of the sensor in the camera's body."""
        return copy.copy(self._X_BS)


class ColorRenderCamera(_Value):
    """A camera for pictures of colours or labels.

    Args:
        core: Lens, clipping planes and renderer.
        show_window: Whether to show pictures in a window; there are no windows here.
    """

    _names = ("core", "show_window")

    @overload
    def __init__(self, core: RenderCameraCore, show_window: bool = False) -> None: ...
    @overload
    def __init__(self, other: ColorRenderCamera) -> None: ...
    def __init__(self, *args: Any, **kwargs: Any):
        given = self._arguments(args, kwargs, show_window=False)
        if given is not None:
            self._core, self._show_window = given[0], bool(given[1])
            if not isinstance(self._core, RenderCameraCore):
                raise incompatible("ColorRenderCamera", ["(core, show_window=False)"], args, kwargs)

    def core(self) -> RenderCameraCore:
        """Lens, clipping planes and renderer."""
        return self._core

    def show_window(self) -> bool:
        """Whether a window was asked for."""
        return self._show_window


class DepthRenderCamera(_Value):
    """A camera for pictures of depth.

    Args:
        core: Lens, clipping planes and renderer.
        depth_range: Which depths are measured.

    Raises:
        RuntimeError: depths that are measured are not drawn.
    """

    _names = ("core", "depth_range")

    @overload
    def __init__(self, core: RenderCameraCore, depth_range: DepthRange) -> None: ...
    @overload
    def __init__(self, other: DepthRenderCamera) -> None: ...
    def __init__(self, *args: Any, **kwargs: Any):
        given = self._arguments(args, kwargs)
        if given is None:
            return
        self._core, self._depth_range = given
        if not isinstance(self._core, RenderCameraCore) or not isinstance(self._depth_range, DepthRange):
            raise incompatible("DepthRenderCamera", ["(core, depth_range)"], args, kwargs)
        near, far = self._core.clipping().near(), self._core.clipping().far()
        least, most = self._depth_range.min_depth(), self._depth_range.max_depth()
        if least < near or most > far:
            raise RuntimeError(
                f"DepthRenderCamera(): Depth camera's depth range extends beyond the clipping planes; near = "
                f"{number(near)}, far = {number(far)}, min. depth = {number(least)}, max. depth = {number(most)}"
            )

    def core(self) -> RenderCameraCore:
        """Lens, clipping planes and renderer."""
        return self._core

    def depth_range(self) -> DepthRange:
        """Which depths are measured."""
        return self._depth_range
