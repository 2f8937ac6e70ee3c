"""VideoWriter: images of a simulation into a film."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common.value import AbstractValue
from sheldrake.geometry import (
    ClippingRange,
    DepthRange,
    DepthRenderCamera,
    MakeRenderEngineVtk,
    RenderCameraCore,
    RenderEngineVtkParams,
)
from sheldrake.math import RigidTransform
from sheldrake.systems.framework import LeafSystem
from sheldrake.systems.sensors import CameraInfo, ImageRgba8U, RgbdSensor

from ._image_systems import ColorizeDepthImage, ColorizeLabelImage, ConcatenateImages

if TYPE_CHECKING:
    from sheldrake.systems.framework import Context, DiagramBuilder
    from sheldrake.systems.framework._port import OutputPort

_BACKENDS = ("PIL", "cv2")
_RENDERER = "video_writer"
_KINDS = {"color": "color_image", "label": "label_image", "depth": "depth_image_32f"}


class VideoWriter(LeafSystem):
    """Writes the images at its input into a film; call Save() when all have been published.

    Port: input "color_image".

    Args:
        filename: The film: "x.gif", "x.webp", "x.png" with Pillow, "x.mp4" with OpenCV.
        fps: Pictures a second, of simulated time and of the film [1/s].
        backend: "PIL" (Pillow) or "cv2" (OpenCV).
        fourcc: OpenCV's encoder; "mp4v" when left out.

    Raises:
        ModuleNotFoundError: when the backend is not installed.
        RuntimeError: when there is no such backend.
        ValueError: when fps is not positive.
    """

    def __init__(
        self, *, filename: str | os.PathLike, fps: float = 16.0, backend: str = "PIL", fourcc: str | None = None
    ):
        super().__init__()
        if backend not in _BACKENDS:
            raise RuntimeError(f"VideoWriter(): Invalid backend={backend!r}; expected {' or '.join(_BACKENDS)}.")
        if not fps > 0:
            raise ValueError(f"VideoWriter(): fps must be positive, got {fps}.")
        if backend == "PIL":
            import PIL.Image  # noqa: F401  (missing libraries are noticed before the simulation)
        else:
            import cv2  # noqa: F401
        self._filename, self._fps, self._backend = os.fspath(filename), float(fps), backend
        self._fourcc = fourcc or "mp4v"
        self._images: list[Any] = []
        self._film: Any = None
        self.DeclareAbstractInputPort("color_image", AbstractValue.Make(ImageRgba8U()))
        self.DeclarePeriodicPublishEvent(period_sec=1.0 / self._fps, offset_sec=0.0, publish=self._publish)

    @staticmethod
    def AddToBuilder(
        *,
        filename: str | os.PathLike,
        builder: DiagramBuilder,
        sensor_pose: RigidTransform,
        fps: float = 16.0,
        width: int = 320,
        height: int = 240,
        fov_y: float = np.pi / 6,
        near: float = 0.01,
        far: float = 10.0,
        kinds: Sequence[str] | None = None,
        backend: str = "PIL",
        fourcc: str | None = None,
    ) -> VideoWriter:
        """Adds a camera fixed in the world, and a VideoWriter for it, to a diagram with a SceneGraph "scene_graph".

        Args:
            filename: The film; see VideoWriter.
            builder: The diagram in the making.
            sensor_pose: Pose of the camera (x right, y down, z forward) in the world.
            fps: Pictures a second, of simulated time and of the film [1/s].
            width: Width of the pictures [pixels].
            height: Height of the pictures [pixels].
            fov_y: Vertical field of view [rad].
            near: Depth of the near clipping plane [m].
            far: Depth of the far clipping plane [m].
            kinds: Of "color", "label" and "depth"; the first only when left out.
            backend: "PIL" or "cv2".
            fourcc: OpenCV's encoder; "mp4v" when left out.

        Returns:
            The VideoWriter; call its Save() in the end.
        """
        writer = VideoWriter(filename=filename, fps=fps, backend=backend, fourcc=fourcc)
        scene_graph = builder.GetSubsystemByName("scene_graph")
        if not scene_graph.HasRenderer(_RENDERER):
            scene_graph.AddRenderer(_RENDERER, MakeRenderEngineVtk(RenderEngineVtkParams()))
        lens, clipping = CameraInfo(width, height, fov_y), ClippingRange(near, far)
        core = RenderCameraCore(_RENDERER, lens, clipping, RigidTransform())
        camera = DepthRenderCamera(core, DepthRange(near, far))
        sensor = builder.AddSystem(RgbdSensor(scene_graph.world_frame_id(), sensor_pose, camera))
        builder.Connect(scene_graph.get_query_output_port(), sensor.query_object_input_port())
        builder.AddSystem(writer)
        writer.ConnectRgbdSensor(builder=builder, sensor=sensor, kinds=kinds)
        return writer

    def ConnectRgbdSensor(
        self, *, builder: DiagramBuilder, sensor: RgbdSensor, kinds: Sequence[str] | None = None
    ) -> None:
        """Connects the images of a sensor, side by side when there are several kinds.

        Args:
            builder: The diagram in the making, which holds this system and the sensor.
            sensor: A system with output ports "color_image", "label_image" and "depth_image_32f", as far as needed.
            kinds: Of "color", "label" and "depth"; the first only when left out.

        Raises:
            ValueError: when there is no such kind.
        """
        kinds = ["color"] if kinds is None else list(kinds)
        wrong = [kind for kind in kinds if kind not in _KINDS]
        if wrong or not kinds:
            raise ValueError(f"VideoWriter.ConnectRgbdSensor(): kinds must be of {list(_KINDS)}, got {kinds}.")
        ports = [_in_color(builder, sensor.GetOutputPort(_KINDS[kind]), kind) for kind in kinds]
        whole = ports[0]
        if len(ports) > 1:
            row = builder.AddSystem(ConcatenateImages(rows=1, cols=len(ports)))
            for col, port in enumerate(ports):
                builder.Connect(port, row.get_input_port(row=0, col=col))
            whole = row.get_output_port()
        builder.Connect(whole, self.get_input_port())

    def Save(self) -> None:
        """Writes the film and closes it; images published later begin a new one in its place."""
        if self._images:
            first, *others = self._images
            duration = 1000.0 / self._fps
            first.save(self._filename, save_all=True, append_images=others, duration=duration, optimize=True)
            self._images = []
        if self._film is not None:
            self._film.release()
            self._film = None

    def _publish(self, context: Context) -> None:
        pixels = self.get_input_port().Eval(context).data
        if self._backend == "PIL":
            import PIL.Image

            self._images.append(PIL.Image.fromarray(np.ascontiguousarray(pixels)))
            return
        import cv2

        if self._film is None:
            code = cv2.VideoWriter_fourcc(*self._fourcc)
            self._film = cv2.VideoWriter(self._filename, code, self._fps, (pixels.shape[1], pixels.shape[0]))
        self._film.write(np.ascontiguousarray(pixels[..., 2::-1]))


def _in_color(builder: DiagramBuilder, port: OutputPort, kind: str) -> OutputPort:
    """Returns a port with a color image of a sensor's image of a kind."""
    if kind == "color":
        return port
    system = builder.AddSystem(ColorizeLabelImage() if kind == "label" else ColorizeDepthImage())
    builder.Connect(port, system.get_input_port(0))
    return system.get_output_port()
