"""ApplyCameraConfig: a camera of a CameraConfig into a diagram."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from sheldrake.common._checked import checked
from sheldrake.geometry._image import PixelType
from sheldrake.lcm._messages import lcmt_image_array
from sheldrake.systems.lcm import LcmBuses, LcmPublisherSystem

from ._camera_config import CameraConfig, ensure_renderer, place
from ._lcm_images import ImageToLcmImageArrayT
from ._rgbd_sensor import RgbdSensor
from ._rgbd_sensor_async import RgbdSensorAsync

if TYPE_CHECKING:
    from sheldrake.geometry import SceneGraph
    from sheldrake.multibody.plant import MultibodyPlant
    from sheldrake.systems.framework import DiagramBuilder


@checked
def ApplyCameraConfig(
    config: CameraConfig,
    builder: DiagramBuilder,
    lcm_buses: Any = None,
    plant: MultibodyPlant | None = None,
    scene_graph: SceneGraph | None = None,
    lcm: Any = None,
) -> None:
    """Adds a sensor named "rgbd_sensor_" and the camera's name to a diagram, and its render engine where that is new.

    Nothing is added for a camera without images. Its images are sent over LCM, on the channel
    "DRAKE_RGBD_CAMERA_IMAGES_" and its name, where `lcm` or `lcm_buses` is given.

    Args:
        config: The camera.
        builder: The diagram in the making.
        lcm_buses: Message buses by name.
        plant: The plant whose frames `config.X_PB` names; the system "plant" when left out.
        scene_graph: What is looked at; the system "scene_graph" when left out.
        lcm: A message bus to use instead of `config.lcm_bus`.

    Raises:
        RuntimeError: the configuration does not make sense or does not fit what is there.
    """
    config.ValidateOrThrow()
    if not (config.rgb or config.depth or config.label):
        return
    bus = _find_bus(config, lcm_buses, lcm)
    mover: Any = builder.GetSubsystemByName("plant") if plant is None else plant
    scene: Any = builder.GetSubsystemByName("scene_graph") if scene_graph is None else scene_graph
    frame, X_PB = place(config, mover, scene)
    ensure_renderer(config, scene)
    color, depth = config.MakeCameras()
    if config.output_delay > 0.0:
        sensor: Any = RgbdSensorAsync(
            scene,
            frame,
            X_PB,
            config.fps,
            config.capture_offset,
            config.output_delay,
            color if config.rgb or config.label else None,
            depth if config.depth else None,
            config.label,
        )
    else:
        sensor = RgbdSensor(frame, X_PB, color, depth)
    builder.AddNamedSystem(f"rgbd_sensor_{config.name}", sensor)
    builder.Connect(scene.get_query_output_port(), sensor.query_object_input_port())
    if bus is not None:
        _publish(config, builder, sensor, bus)


def _find_bus(config: CameraConfig, lcm_buses: Any, lcm: Any) -> Any:
    """The bus that images go to, or None."""
    if lcm is None and lcm_buses is not None:
        lcm = lcm_buses.Find(f"Camera '{config.name}'", config.lcm_bus)
    elif lcm is None and config.lcm_bus != "default":
        raise RuntimeError(
            f"ApplyCameraConfig requested a non-default LCM bus '{config.lcm_bus}' but did not provide an LcmBuses "
            "object to locate it"
        )
    return None if lcm is None or lcm.get_lcm_url() == LcmBuses.kLcmUrlMemqNull else lcm


def _publish(config: CameraConfig, builder: DiagramBuilder, sensor: Any, bus: Any) -> None:
    """Sends a sensor's images, as messages of lcmt_image_array."""
    packer = builder.AddNamedSystem(f"image_to_lcm_{config.name}", ImageToLcmImageArrayT(config.do_compress))
    for wanted, name, kind, port in (
        (config.depth, "depth", PixelType.kDepth16U, "depth_image_16u"),
        (config.rgb, "rgb", PixelType.kRgba8U, "color_image"),
        (config.label, "label", PixelType.kLabel16I, "label_image"),
    ):
        if wanted:
            builder.Connect(sensor.GetOutputPort(port), packer.DeclareImageInputPort[kind](name))
    channel = f"DRAKE_RGBD_CAMERA_IMAGES_{config.name}"
    offset = config.capture_offset + 1.001 * config.output_delay  # images that come out then are seen after that
    sender = LcmPublisherSystem.Make(channel, lcmt_image_array, bus, 1.0 / config.fps, publish_offset=offset)
    builder.AddSystem(sender)
    builder.Connect(packer.image_array_t_msg_output_port(), sender.get_input_port())
