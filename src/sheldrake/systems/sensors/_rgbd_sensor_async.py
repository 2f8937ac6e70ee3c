"""RgbdSensorAsync: a camera whose pictures come out some time after they were taken."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

from sheldrake.common._checked import checked
from sheldrake.common.value import AbstractValue
from sheldrake.geometry import ColorRenderCamera, DepthRenderCamera, FrameId, SceneGraph
from sheldrake.geometry._image import ImageDepth16U, ImageDepth32F, ImageLabel16I, ImageRgba8U
from sheldrake.math import RigidTransform

from ._camera_system import CameraSystem, Mounting

if TYPE_CHECKING:
    from sheldrake.systems.framework import Context


class Exposure(NamedTuple):
    """What was seen at a moment; None where there is no camera for it. Images are never changed."""

    time: float = math.nan
    X_WB: RigidTransform = RigidTransform()
    color: Any = None
    depth: Any = None
    depth_in_millimetres: Any = None
    label: Any = None


class Exposures(NamedTuple):
    """The exposure that is shown, and the one on its way."""

    shown: Exposure = Exposure()
    coming: Exposure = Exposure()


@checked
class RgbdSensorAsync(CameraSystem):
    """A camera that takes pictures at capture_offset + k / fps and shows them output_delay later.

    Before the first, images have no pixels and their time is NaN. Ports: input "geometry_query"; outputs, as far as
    there are cameras for them, "color_image", "depth_image_32f" [m], "depth_image_16u" [mm], "label_image", and
    "body_pose_in_world" (X_WB), "image_time" [s]. Frames are those of RgbdSensor.

    Args:
        scene_graph: What is looked at; the input port gets its query object.
        parent_id: Frame P that the camera's body B is fixed to.
        X_PB: Pose of the body in P.
        fps: Pictures a second of simulated time [1/s].
        capture_offset: When the first picture is taken [s].
        output_delay: From taking to showing a picture [s], less than 1 / fps.
        color_camera: For colours and labels, or None.
        depth_camera: For depths, or None.
        render_label_image: Whether there are labels.

    Raises:
        RuntimeError: there is no camera, none for labels, or a time does not make sense.
    """

    def __init__(
        self,
        scene_graph: SceneGraph,
        parent_id: FrameId,
        X_PB: RigidTransform,
        fps: float,
        capture_offset: float,
        output_delay: float,
        color_camera: ColorRenderCamera | None,
        depth_camera: DepthRenderCamera | None = None,
        render_label_image: bool = False,
    ):
        super().__init__(Mounting(parent_id, RigidTransform(X_PB), color_camera, depth_camera))
        self._fps, self._offset, self._delay = float(fps), float(capture_offset), float(output_delay)
        self._with_labels = bool(render_label_image)
        self._check()
        self.DeclareAbstractState(AbstractValue.Make(Exposures()))
        self.DeclarePeriodicUnrestrictedUpdateEvent(1.0 / self._fps, self._offset, self._capture)
        self.DeclarePeriodicUnrestrictedUpdateEvent(1.0 / self._fps, self._offset + self._delay, self._show)
        if color_camera is not None:
            self._declare("color_image", ImageRgba8U, lambda exposure: exposure.color)
        if depth_camera is not None:
            self._declare("depth_image_32f", ImageDepth32F, lambda exposure: exposure.depth)
            self._declare("depth_image_16u", ImageDepth16U, lambda exposure: exposure.depth_in_millimetres)
        if render_label_image:
            self._declare("label_image", ImageLabel16I, lambda exposure: exposure.label)
        self._declare("body_pose_in_world", RigidTransform, lambda exposure: exposure.X_WB)
        self.DeclareVectorOutputPort(
            "image_time",
            1,
            lambda context, output: output.SetAtIndex(0, self._exposures(context).shown.time),
            {self.abstract_state_ticket(0)},
        )

    def _check(self) -> None:
        fps, delay = self._fps, self._delay
        wrong = [
            what
            for what, fine in (
                (f"fps = {fps} must be positive", math.isfinite(fps) and fps > 0.0),
                (f"capture_offset = {self._offset} must not be negative", 0.0 <= self._offset < math.inf),
                (f"output_delay = {delay} must be positive and less than 1 / fps", 0.0 < delay and delay * fps < 1.0),
                ("there must be a color_camera or a depth_camera", any(self._default[2:])),
                ("labels need a color_camera", self._default.color_camera is not None or not self._with_labels),
            )
            if not fine
        ]
        if wrong:
            raise RuntimeError(f"RgbdSensorAsync(): {'; '.join(wrong)}.")

    def _declare(self, name: str, kind: type, part: Callable[[Exposure], Any]) -> None:
        def calc(context: Context, output: Any) -> None:
            value = part(self._exposures(context).shown)
            output.set_value(kind() if value is None else value)

        self.DeclareAbstractOutputPort(name, lambda: AbstractValue.Make(kind()), calc, {self.abstract_state_ticket(0)})

    @staticmethod
    def _exposures(context: Context) -> Exposures:
        return context.get_abstract_state(0).get_value()

    def _capture(self, context: Context, state: Any) -> None:
        color, depth = self._mounting(context)[2:]
        depths = None if depth is None else self._depth(context)
        exposure = Exposure(
            time=context.get_time(),
            X_WB=self._pose(context),
            color=None if color is None else self._color(context),
            depth=depths,
            depth_in_millimetres=None if depths is None else self._in_millimetres(depths),
            label=self._label(context) if self._with_labels else None,
        )
        state.get_mutable_abstract_state(0).set_value(self._exposures(context)._replace(coming=exposure))

    def _show(self, context: Context, state: Any) -> None:
        coming = self._exposures(context).coming
        state.get_mutable_abstract_state(0).set_value(Exposures(shown=coming, coming=coming))

    def fps(self) -> float:
        """Pictures a second [1/s]."""
        return self._fps

    def capture_offset(self) -> float:
        """When the first picture is taken [s]."""
        return self._offset

    def output_delay(self) -> float:
        """From taking to showing a picture [s]."""
        return self._delay
