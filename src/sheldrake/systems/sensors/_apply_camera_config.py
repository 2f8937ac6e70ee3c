"""ApplyCameraConfig: a camera of a CameraConfig into a diagram."""

from __future__ import annotations

from typing import Any

from ._camera_config import CameraConfig, ensure_renderer, place
from ._rgbd_sensor import RgbdSensor
from ._rgbd_sensor_async import RgbdSensorAsync


def ApplyCameraConfig(
    config: CameraConfig,
    builder: Any,
    lcm_buses: Any = None,
    plant: Any = None,
    scene_graph: Any = None,
    lcm: Any = None,
) -> None:
    """Adds a sensor named "rgbd_sensor_" and the camera's name to a diagram, and its render engine where that is new.

    Nothing is added for a camera without images.

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
    plant = builder.GetSubsystemByName("plant") if plant is None else plant
    scene_graph = builder.GetSubsystemByName("scene_graph") if scene_graph is None else scene_graph
    frame, X_PB = place(config, plant, scene_graph)
    ensure_renderer(config, scene_graph)
    color, depth = config.MakeCameras()
    if config.output_delay > 0.0:
        sensor: Any = RgbdSensorAsync(
            scene_graph,
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
    builder.Connect(scene_graph.get_query_output_port(), sensor.query_object_input_port())
