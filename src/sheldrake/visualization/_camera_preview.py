"""What a camera would see, as a picture in the page's panel."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from sheldrake.geometry import (
    ClippingRange,
    DepthRange,
    DepthRenderCamera,
    MakeRenderEngineVtk,
    Meshcat,
    RenderCameraCore,
    RenderEngineVtkParams,
)
from sheldrake.math import RigidTransform
from sheldrake.systems.sensors import CameraInfo, RgbdSensor

if TYPE_CHECKING:
    from sheldrake.geometry import SceneGraph
    from sheldrake.systems.framework import DiagramBuilder
    from sheldrake.systems.framework._context.context import Context

_NAME = "camera_preview"
_WIDTH, _HEIGHT = 480, 360
_LENS = ClippingRange(0.01, 100.0), DepthRange(0.01, 99.0)  # [m]


class CameraPreview:
    """An RgbdSensor that stands where the page's camera stands, and its picture in the panel.

    Args:
        meshcat: Whose page.
        builder: Where the sensor is added.
        scene_graph: What it sees: geometry with the perception role.
    """

    def __init__(self, meshcat: Meshcat, builder: DiagramBuilder, scene_graph: SceneGraph):
        self._meshcat = meshcat
        scene_graph.AddRenderer(_NAME, MakeRenderEngineVtk(RenderEngineVtkParams()))
        lens = CameraInfo(width=_WIDTH, height=_HEIGHT, fov_y=meshcat._field_of_view())
        core = RenderCameraCore(_NAME, lens, _LENS[0], RigidTransform())
        camera = DepthRenderCamera(core, _LENS[1])
        self._sensor = RgbdSensor(scene_graph.world_frame_id(), RigidTransform(), camera)
        builder.AddNamedSystem(_NAME, self._sensor)
        builder.Connect(scene_graph.get_query_output_port(), self._sensor.query_object_input_port())
        self._seen: tuple[bytes, int] | None = None
        self._picture: Any = None

    def look(self, root: Context, change: int) -> bool:
        """Takes a new picture if a page's camera stands elsewhere or the scene changed; returns whether it did.

        Args:
            root: The diagram's context.
            change: Another number means another scene.
        """
        X_WC = self._meshcat._newest_camera_pose()
        if X_WC is None or (X_WC.GetAsMatrix34().tobytes(), change) == self._seen:
            return False
        self._seen = X_WC.GetAsMatrix34().tobytes(), change
        context = self._sensor.GetMyMutableContextFromRoot(root)
        self._sensor.SetX_PB(context, X_WC)
        image = self._sensor.color_image_output_port().Eval(context).data[:, :, :3]
        if self._picture is None:
            gui = self._meshcat._hub.server.gui
            self._picture = gui.add_image(image, label="Camera", format="jpeg")
        else:
            self._picture.image = image
        return True

    def delete(self) -> None:
        """Removes the picture from the page."""
        if self._picture is not None:
            self._picture.remove()
            self._picture = None
