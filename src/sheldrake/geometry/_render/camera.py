"""Cameras of pictures: lens, clipping planes, and which renderer draws."""

from __future__ import annotations

import copy
import math
from typing import TYPE_CHECKING, Any
from typing import overload as typing_overload

from sheldrake.common._kinds import instance_of, text
from sheldrake.common._overloads import Mismatch, Overload, kind, overload, overloaded
from sheldrake.common._scalars import scalar
from sheldrake.common._text import number
from sheldrake.geometry._camera_info import CameraInfo
from sheldrake.math import RigidTransform

if TYPE_CHECKING:
    from typing_extensions import Self


_SHOW = instance_of(bool, int, float, type(None))  # what pydrake takes for a bool


class _Value:
    """A constant: copies are equal, and `Class(other)` is one."""

    def _set_other(self, other: Any) -> None:
        self.__dict__.update(other.__dict__)

    def __copy__(self) -> Self:
        new = object.__new__(type(self))
        new.__dict__.update(self.__dict__)
        return new

    def __deepcopy__(self, memo: dict) -> Self:
        return self.__copy__()


def _another(name: str) -> Overload:
    """The form `(other)` of a class of this name, which is not there yet where its forms are stated."""

    @kind(name)
    def convert(value: Any) -> Any:
        if not any(cls.__name__ == name for cls in type(value).__mro__):
            raise Mismatch
        return value

    return overload(_Value._set_other, other=convert)


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

    @typing_overload
    def __init__(self, near: float, far: float) -> None: ...
    @typing_overload
    def __init__(self, other: ClippingRange) -> None: ...
    @overloaded(overload(near=scalar(float), far=scalar(float)), _another("ClippingRange"))
    def __init__(self, near: float, far: float) -> None:
        self._near, self._far = near, far
        _check_range("ClippingRange", "clipping range", ("near", "far", "near", "far"), near, far)

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

    @typing_overload
    def __init__(self, min_in: float, min_out: float) -> None: ...
    @typing_overload
    def __init__(self, other: DepthRange) -> None: ...
    @overloaded(overload(min_in=scalar(float), min_out=scalar(float)), _another("DepthRange"))
    def __init__(self, min_in: float, min_out: float) -> None:
        self._min, self._max = min_in, min_out
        names = ("the minimum depth", "the maximum depth", "min", "max")
        _check_range("DepthRange", "depth range", names, min_in, min_out)

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

    @typing_overload
    def __init__(
        self, renderer_name: str, intrinsics: CameraInfo, clipping: ClippingRange, X_BS: RigidTransform
    ) -> None: ...
    @typing_overload
    def __init__(self, other: RenderCameraCore) -> None: ...
    @overloaded(
        overload(
            renderer_name=text,
            intrinsics=instance_of(CameraInfo),
            clipping=instance_of(ClippingRange),
            X_BS=instance_of(RigidTransform),
        ),
        _another("RenderCameraCore"),
    )
    def __init__(
        self, renderer_name: str, intrinsics: CameraInfo, clipping: ClippingRange, X_BS: RigidTransform
    ) -> None:
        self._renderer_name, self._intrinsics, self._clipping = renderer_name, intrinsics, clipping
        self._X_BS = copy.copy(X_BS)

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

    @typing_overload
    def __init__(self, core: RenderCameraCore, show_window: bool = False) -> None: ...
    @typing_overload
    def __init__(self, other: ColorRenderCamera) -> None: ...
    @overloaded(overload(core=instance_of(RenderCameraCore), show_window=(_SHOW, False)), _another("ColorRenderCamera"))
    def __init__(self, core: RenderCameraCore, show_window: bool = False) -> None:
        self._core, self._show_window = core, bool(show_window)

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

    @typing_overload
    def __init__(self, core: RenderCameraCore, depth_range: DepthRange) -> None: ...
    @typing_overload
    def __init__(self, other: DepthRenderCamera) -> None: ...
    @overloaded(
        overload(core=instance_of(RenderCameraCore), depth_range=instance_of(DepthRange)),
        _another("DepthRenderCamera"),
    )
    def __init__(self, core: RenderCameraCore, depth_range: DepthRange) -> None:
        self._core, self._depth_range = core, depth_range
        near, far = core.clipping().near(), core.clipping().far()
        least, most = depth_range.min_depth(), depth_range.max_depth()
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
