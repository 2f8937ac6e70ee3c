"""CameraConfig: a camera as YAML describes it, and how it is added to a diagram."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._options import Options
from sheldrake.common.schema import Transform
from sheldrake.geometry import (
    ClippingRange,
    ColorRenderCamera,
    DepthRange,
    DepthRenderCamera,
    MakeRenderEngineGl,
    MakeRenderEngineGltfClient,
    MakeRenderEngineVtk,
    RenderCameraCore,
    RenderEngineGlParams,
    RenderEngineGltfClientParams,
    RenderEngineVtkParams,
    Rgba,
)
from sheldrake.geometry._camera_info import CameraInfo
from sheldrake.math import RigidTransform

if TYPE_CHECKING:
    from sheldrake.geometry import SceneGraph
    from sheldrake.multibody.plant import MultibodyPlant

_PARAMS = {
    "RenderEngineVtk": RenderEngineVtkParams,
    "RenderEngineGl": RenderEngineGlParams,
    "RenderEngineGltfClient": RenderEngineGltfClientParams,
}
_MAKERS: dict[type, Any] = {
    RenderEngineVtkParams: MakeRenderEngineVtk,
    RenderEngineGlParams: MakeRenderEngineGl,
    RenderEngineGltfClientParams: MakeRenderEngineGltfClient,
}


def _either(x: float | None, y: float | None, kind: str) -> tuple[float, float]:
    if x is None and y is None:
        raise RuntimeError(f"Invalid camera configuration; you must define at least x or y for {kind}.")
    return (y if x is None else x), (x if y is None else y)  # type: ignore[return-value]


class FocalLength(Options):
    """A lens by its focal lengths; one that is missing is as the other.

    Attributes:
        x: Focal length in x [pixels].
        y: Focal length in y [pixels].
    """

    x: float | None = None
    y: float | None = None

    def focal_x(self) -> float:
        """Focal length in x [pixels]."""
        return _either(self.x, self.y, "FocalLength")[0]

    def focal_y(self) -> float:
        """Focal length in y [pixels]."""
        return _either(self.x, self.y, "FocalLength")[1]


class FovDegrees(Options):
    """A lens by its fields of view; for one that is missing, pixels are square.

    Attributes:
        x: Horizontal field of view [degrees].
        y: Vertical field of view [degrees].
    """

    x: float | None = None
    y: float | None = None

    def _focal(self, width: int, height: int) -> tuple[float, float]:
        def focal(size: int, degrees: float | None) -> float | None:
            return None if degrees is None else 0.5 * size / math.tan(math.radians(degrees) / 2.0)

        return _either(focal(width, self.x), focal(height, self.y), "FovDegrees")

    def focal_x(self, width: int, height: int) -> float:
        """Focal length in x [pixels] for an image of this size [pixels]."""
        return self._focal(width, height)[0]

    def focal_y(self, width: int, height: int) -> float:
        """Focal length in y [pixels] for an image of this size [pixels]."""
        return self._focal(width, height)[1]


class CameraConfig(Options):
    """A camera: its lens, where it is, who draws, which images there are and when.

    Attributes:
        width: Width of the images [pixels].
        height: Height of the images [pixels].
        focal: `FovDegrees` or `FocalLength`.
        center_x: Principal point [pixels]; the middle when None.
        center_y: Principal point [pixels]; the middle when None.
        clipping_near: Depth of the near clipping plane [m].
        clipping_far: Depth of the far clipping plane [m].
        z_near: Least depth that is measured [m].
        z_far: Largest depth that is measured [m].
        X_PB: Pose of the camera's body B in its base frame P, the world's without one.
        X_BC: Pose of the camera of colours (x right, y down, z forward) in B.
        X_BD: Pose of the camera of depths in B.
        renderer_name: Name of the render engine; one that does not exist yet is made.
        renderer_class: "", "RenderEngineVtk", "RenderEngineGl", "RenderEngineGltfClient", or the engine's options.
        background: Colour where there is nothing, of an engine that is made without options.
        name: Of the camera.
        fps: Images a second of simulated time [1/s].
        capture_offset: When the first image is taken [s].
        output_delay: From taking to showing an image [s]; if positive, the sensor is an RgbdSensorAsync.
        rgb: Whether there are images of colours.
        depth: Whether there are images of depths.
        label: Whether there are images of labels.
        show_rgb: Whether to show a window; there are no windows here.
        do_compress: Whether image messages are compressed.
        lcm_bus: Name of the message bus that images go to.
    """

    width: int = 640
    height: int = 480
    focal: FocalLength | FovDegrees = FovDegrees(y=45.0)
    center_x: float | None = None
    center_y: float | None = None
    clipping_near: float = 0.01
    clipping_far: float = 500.0
    z_near: float = 0.1
    z_far: float = 5.0
    X_PB: Transform = Transform()
    X_BC: Transform = Transform()
    X_BD: Transform = Transform()
    renderer_name: str = "default"
    renderer_class: str | RenderEngineVtkParams | RenderEngineGlParams | RenderEngineGltfClientParams = ""
    background: Rgba = Rgba(204 / 255, 229 / 255, 1.0)
    name: str = "preview_camera"
    fps: float = 10.0
    capture_offset: float = 0.0
    output_delay: float = 0.0
    rgb: bool = True
    depth: bool = False
    label: bool = False
    show_rgb: bool = False
    do_compress: bool = True
    lcm_bus: str = "default"

    FocalLength = FocalLength
    FovDegrees = FovDegrees

    def focal_x(self) -> float:
        """Focal length in x [pixels]."""
        sized = () if isinstance(self.focal, FocalLength) else (self.width, self.height)
        return self.focal.focal_x(*sized)

    def focal_y(self) -> float:
        """Focal length in y [pixels]."""
        sized = () if isinstance(self.focal, FocalLength) else (self.width, self.height)
        return self.focal.focal_y(*sized)

    def principal_point(self) -> np.ndarray:
        """(center_x, center_y) [pixels], shape (2,)."""
        x = 0.5 * self.width - 0.5 if self.center_x is None else self.center_x
        y = 0.5 * self.height - 0.5 if self.center_y is None else self.center_y
        return np.array([x, y])

    def MakeCameras(self) -> tuple[ColorRenderCamera, DepthRenderCamera]:
        """The cameras for colours (and labels) and for depths.

        Raises:
            RuntimeError: sizes, lens or ranges do not make sense.
        """
        lens = CameraInfo(self.width, self.height, self.focal_x(), self.focal_y(), *self.principal_point())
        clipping = ClippingRange(self.clipping_near, self.clipping_far)

        def core(X_BS: Transform) -> RenderCameraCore:
            return RenderCameraCore(self.renderer_name, lens, clipping, X_BS.GetDeterministicValue())

        color = ColorRenderCamera(core(self.X_BC), self.show_rgb)
        return color, DepthRenderCamera(core(self.X_BD), DepthRange(self.z_near, self.z_far))

    def ValidateOrThrow(self) -> None:
        """Raises RuntimeError if a value does not make sense; a camera without images is fine."""
        if not (self.rgb or self.depth or self.label):
            return
        for name in ("name", "renderer_name"):
            if not getattr(self, name):
                raise RuntimeError(f"Invalid camera configuration; {name} cannot be empty.")
        if isinstance(self.renderer_class, str) and self.renderer_class not in ("", *_PARAMS):
            raise RuntimeError(
                f"Invalid camera configuration; the given renderer_class value '{self.renderer_class}' must be empty "
                f"(to use the default) or be one of {', '.join(repr(name) for name in _PARAMS)}."
            )
        if not 0.0 < self.fps < math.inf:
            raise RuntimeError(f"Invalid camera configuration; FPS ({self.fps:g}) must be a finite, positive value.")
        for name in ("capture_offset", "output_delay"):
            if not 0.0 <= getattr(self, name) < math.inf:
                raise RuntimeError(f"Invalid camera configuration; {name} must be a finite value that is not negative.")
        self.MakeCameras()


def engine_params(config: CameraConfig) -> Any:
    """Options of the render engine that a configuration asks for."""
    if not isinstance(config.renderer_class, str):
        return config.renderer_class
    kind = _PARAMS[config.renderer_class or "RenderEngineVtk"]
    if kind is RenderEngineGltfClientParams:
        return kind()
    background = config.background.rgba[:3] if kind is RenderEngineVtkParams else config.background
    return kind(default_clear_color=background)


def ensure_renderer(config: CameraConfig, scene_graph: SceneGraph) -> None:
    """Adds the render engine that a configuration names, unless it is there.

    Raises:
        RuntimeError: it is there but another one than asked for.
    """
    name, params = config.renderer_name, engine_params(config)
    if not scene_graph.HasRenderer(name):
        scene_graph.AddRenderer(name, _MAKERS[type(params)](params))
    elif not isinstance(config.renderer_class, str):
        if _MAKERS[type(params)](params).GetParameterYaml() != scene_graph.GetRendererParameterYaml(name):
            raise RuntimeError(
                f"Invalid camera configuration; requested renderer_name = '{name}' with renderer parameters, but the "
                "named renderer already exists and doesn't match the given parameters"
            )
    elif config.renderer_class and scene_graph.GetRendererTypeName(name).rsplit("::")[-1] != config.renderer_class:
        raise RuntimeError(
            f"Invalid camera configuration; requested renderer_name = '{name}' and renderer_class = "
            f"'{config.renderer_class}'. The name is already used with a different type: "
            f"{scene_graph.GetRendererTypeName(name)}"
        )


def place(config: CameraConfig, plant: MultibodyPlant, scene_graph: SceneGraph) -> tuple[Any, RigidTransform]:
    """The geometry frame that a camera is fixed to, and the pose of the camera's body in it."""
    X_FB = config.X_PB.GetDeterministicValue()
    if not config.X_PB.base_frame:
        return scene_graph.world_frame_id(), X_FB
    model, _, name = config.X_PB.base_frame.rpartition("::")
    instance = (plant.GetModelInstanceByName(model),) if model else ()
    frame = plant.GetFrameByName(name, *instance)
    return plant.GetBodyFrameIdOrThrow(frame.body().index()), frame.GetFixedPoseInBodyFrame() @ X_FB
