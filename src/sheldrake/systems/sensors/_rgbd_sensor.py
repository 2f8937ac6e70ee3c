"""RgbdSensor: a camera of colours, depths and labels, and one that takes pictures now and then."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, ClassVar

from sheldrake.common._checked import checked
from sheldrake.common._kinds import called, flag, instance_of
from sheldrake.common._overloads import overload, overloaded
from sheldrake.common.value import AbstractValue
from sheldrake.geometry import ColorRenderCamera, DepthRenderCamera, FrameId
from sheldrake.geometry._image import ImageDepth16U, ImageDepth32F, ImageLabel16I, ImageRgba8U
from sheldrake.math import RigidTransform
from sheldrake.systems.framework import Diagram, DiagramBuilder
from sheldrake.systems.primitives import ZeroOrderHold

from ._camera_system import CameraPorts, CameraSystem, Mounting, empty_like

if TYPE_CHECKING:
    from sheldrake.systems.framework import Context


_PLACE: dict[str, Any] = {"parent_id": instance_of(FrameId), "X_PB": called("RigidTransform")}
_DEPTH_CAMERA = instance_of(DepthRenderCamera)


class RgbdSensor(CameraSystem):
    """Cameras on one body B, which is fixed to a frame P of a SceneGraph: pictures whenever somebody asks.

    Frame B is x right, y down, z forward, unless the cameras have poses of their own in it. Ports: input
    "geometry_query"; outputs "color_image", "depth_image_32f" [m], "depth_image_16u" [mm], "label_image",
    "body_pose_in_world" (X_WB), "image_time" [s].

    Either `(parent_id, X_PB, color_camera, depth_camera)`, or `(parent_id, X_PB, depth_camera, show_window=False)` for
    colours with the lens of the camera of depths.

    Args:
        parent_id: Frame P.
        X_PB: Pose of the body in P.
        color_camera: For colours and labels.
        depth_camera: For depths.
        show_window: Whether to show pictures in a window; there are no windows here.
    """

    @overloaded(
        overload(**_PLACE, color_camera=instance_of(ColorRenderCamera), depth_camera=_DEPTH_CAMERA),
        overload(**_PLACE, depth_camera=_DEPTH_CAMERA, show_window=(flag, False)),
    )
    def __init__(self, parent_id: FrameId, X_PB: RigidTransform, *given: Any):
        if isinstance(given[0], ColorRenderCamera):
            color, depth = given
        else:
            depth, show_window = given
            color = ColorRenderCamera(depth.core(), show_window)
        super().__init__(Mounting(parent_id, RigidTransform(X_PB), color, depth))
        tickets = {self.input_port_ticket(0), self.all_parameters_ticket()}

        def declare(name: str, image: type, camera: Callable[[], Any], see: Callable[[Any], Any]) -> None:
            def calc(context: Context, output: Any) -> None:
                output.set_value(see(context))

            self.DeclareAbstractOutputPort(name, lambda: empty_like(image, camera()), calc, tickets)

        declare("color_image", ImageRgba8U, self.default_color_render_camera, self._color)
        declare("depth_image_32f", ImageDepth32F, self.default_depth_render_camera, self._depth)
        declare("depth_image_16u", ImageDepth16U, self.default_depth_render_camera, self._depth_in_millimetres)
        declare("label_image", ImageLabel16I, self.default_color_render_camera, self._label)
        self.DeclareAbstractOutputPort(
            "body_pose_in_world",
            lambda: AbstractValue.Make(RigidTransform()),
            lambda context, output: output.set_value(self._pose(context)),
            tickets,
        )
        self.DeclareVectorOutputPort(
            "image_time",
            1,
            lambda context, output: output.SetAtIndex(0, context.get_time()),
            {self.time_ticket()},
        )

    def _depth_in_millimetres(self, context: Context) -> Any:
        return self._in_millimetres(self.depth_image_32F_output_port().Eval(context))


@checked
class RgbdSensorDiscrete(CameraPorts, Diagram):
    """An RgbdSensor that takes pictures periodically and shows the last ones in between.

    Args:
        sensor: The sensor.
        period: Between two pictures [s].
        render_label_image: Whether there are labels; only then there is an output port for them.
    """

    kDefaultPeriod: ClassVar[float] = 1.0 / 30.0

    def __init__(self, sensor: RgbdSensor, period: float = kDefaultPeriod, render_label_image: bool = True):
        super().__init__()
        self._sensor, self._period = sensor, float(period)
        builder = DiagramBuilder()
        builder.AddSystem(sensor)
        builder.ExportInput(sensor.query_object_input_port(), "geometry_query")
        for k in range(sensor.num_output_ports()):
            port = sensor.get_output_port(k)
            if port.get_name() == "label_image" and not render_label_image:
                continue
            if port.get_name() == "image_time":
                hold = builder.AddSystem(ZeroOrderHold(self._period, port.size()))
            else:
                hold = builder.AddSystem(ZeroOrderHold(self._period, abstract_model_value=port.Allocate()))
            builder.Connect(port, hold.get_input_port())
            builder.ExportOutput(hold.get_output_port(), port.get_name())
        builder.BuildInto(self)

    def sensor(self) -> RgbdSensor:
        """The sensor."""
        return self._sensor

    def period(self) -> float:
        """Between two pictures [s]."""
        return self._period
