"""What cameras of colours, depths and labels have in common: where they are and what they see with."""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING, Any, NamedTuple

from sheldrake.common._checked import checked
from sheldrake.common.value import AbstractValue
from sheldrake.geometry import ColorRenderCamera, DepthRenderCamera, FrameId, QueryObject
from sheldrake.geometry._image import ConvertDepth32FTo16U, ImageDepth16U, ImageDepth32F, ImageLabel16I, ImageRgba8U
from sheldrake.math import RigidTransform
from sheldrake.systems.framework import LeafSystem
from sheldrake.systems.framework._port_getters import input_port, output_port

if TYPE_CHECKING:
    from sheldrake.systems.framework import Context

_CAMERA = 0  # abstract parameter


class Mounting(NamedTuple):
    """Where a camera is, and what it sees with."""

    parent_frame_id: FrameId
    X_PB: RigidTransform
    color_camera: Any  # ColorRenderCamera or None
    depth_camera: Any  # DepthRenderCamera or None


class CameraPorts:
    """The ports of a camera by pydrake's names."""

    GetInputPort: Any  # of the system that this is mixed into
    GetOutputPort: Any

    query_object_input_port = input_port("geometry_query", "Takes a SceneGraph's query object.")
    color_image_output_port = output_port("color_image", "Colours, an ImageRgba8U.")
    depth_image_32F_output_port = output_port("depth_image_32f", "Depths in metres, an ImageDepth32F.")
    depth_image_16U_output_port = output_port("depth_image_16u", "Depths in millimetres, an ImageDepth16U.")
    label_image_output_port = output_port("label_image", "Labels, an ImageLabel16I.")
    body_pose_in_world_output_port = output_port(
        "body_pose_in_world", "Pose X_WB of the camera's body, a RigidTransform."
    )
    image_time_output_port = output_port("image_time", "When the images were taken [s], shape (1,).")


@checked
class CameraSystem(CameraPorts, LeafSystem):
    """A camera whose mounting is a parameter; derived classes declare the outputs.

    Args:
        mounting: The default.
    """

    def __init__(self, mounting: Mounting):
        super().__init__()
        self._default = mounting
        self.DeclareAbstractInputPort("geometry_query", AbstractValue.Make(QueryObject()))
        self.DeclareAbstractParameter(AbstractValue.Make(mounting))

    def _set_default_context(self, context: Context) -> None:
        context.get_mutable_parameters().get_mutable_abstract_parameter(_CAMERA).set_value(self._default)

    def _mounting(self, context: Context) -> Mounting:
        return context.get_abstract_parameter(_CAMERA).get_value()

    def _mounting_in(self, context: Context) -> Mounting:
        """The mounting, for a caller who may have taken the wrong context."""
        self.ValidateContext(context)
        return self._mounting(context)

    def _mount(self, context: Context, **changes: Any) -> None:
        mounting = self._mounting_in(context)._replace(**changes)
        context.get_mutable_abstract_parameter(_CAMERA).set_value(mounting)

    # ---- what the camera sees now

    def _query(self, context: Context) -> QueryObject:
        return self.query_object_input_port().Eval(context)

    def _pose(self, context: Context) -> RigidTransform:
        """X_WB."""
        mounting = self._mounting(context)
        return self._query(context).GetPoseInWorld(mounting.parent_frame_id) @ mounting.X_PB

    def _color(self, context: Context) -> ImageRgba8U:  # type: ignore[valid-type]
        mounting = self._mounting(context)
        return self._query(context).RenderColorImage(mounting.color_camera, mounting.parent_frame_id, mounting.X_PB)

    def _depth(self, context: Context) -> ImageDepth32F:  # type: ignore[valid-type]
        mounting = self._mounting(context)
        return self._query(context).RenderDepthImage(mounting.depth_camera, mounting.parent_frame_id, mounting.X_PB)

    def _label(self, context: Context) -> ImageLabel16I:  # type: ignore[valid-type]
        mounting = self._mounting(context)
        return self._query(context).RenderLabelImage(mounting.color_camera, mounting.parent_frame_id, mounting.X_PB)

    @staticmethod
    def _in_millimetres(depth: ImageDepth32F) -> ImageDepth16U:  # type: ignore[valid-type]
        image = ImageDepth16U()
        ConvertDepth32FTo16U(depth, image)
        return image

    # ---- mounting

    def default_parent_frame_id(self) -> FrameId:
        """The frame P that the camera is fixed to in new contexts."""
        return self._default.parent_frame_id

    def set_default_parent_frame_id(self, id: FrameId) -> None:
        """Sets the frame P that the camera is fixed to in new contexts."""
        self._default = self._default._replace(parent_frame_id=id)

    def GetParentFrameId(self, context: Context) -> FrameId:
        """The frame P that the camera is fixed to."""
        return self._mounting_in(context).parent_frame_id

    def SetParentFrameId(self, context: Context, id: FrameId) -> None:
        """Fixes the camera to another frame."""
        self._mount(context, parent_frame_id=id)

    def default_X_PB(self) -> RigidTransform:
        """Pose of the camera's body in its parent frame, in new contexts."""
        return copy.copy(self._default.X_PB)

    def set_default_X_PB(self, sensor_pose: RigidTransform) -> None:
        """Sets the pose of the camera's body in its parent frame for new contexts."""
        self._default = self._default._replace(X_PB=RigidTransform(sensor_pose))

    def GetX_PB(self, context: Context) -> RigidTransform:
        """Pose of the camera's body in its parent frame."""
        return copy.copy(self._mounting_in(context).X_PB)

    def SetX_PB(self, context: Context, sensor_pose: RigidTransform) -> None:
        """Moves the camera in its parent frame."""
        self._mount(context, X_PB=RigidTransform(sensor_pose))

    def default_color_render_camera(self) -> ColorRenderCamera | None:
        """The camera for colours and labels in new contexts."""
        return self._default.color_camera

    def set_default_color_render_camera(self, color_camera: ColorRenderCamera) -> None:
        """Sets the camera for colours and labels of new contexts."""
        self._default = self._default._replace(color_camera=color_camera)

    def GetColorRenderCamera(self, context: Context) -> ColorRenderCamera | None:
        """The camera for colours and labels."""
        return self._mounting_in(context).color_camera

    def SetColorRenderCamera(self, context: Context, color_camera: ColorRenderCamera) -> None:
        """Sets the camera for colours and labels."""
        self._mount(context, color_camera=color_camera)

    def default_depth_render_camera(self) -> DepthRenderCamera | None:
        """The camera for depths in new contexts."""
        return self._default.depth_camera

    def set_default_depth_render_camera(self, depth_camera: DepthRenderCamera) -> None:
        """Sets the camera for depths of new contexts."""
        self._default = self._default._replace(depth_camera=depth_camera)

    def GetDepthRenderCamera(self, context: Context) -> DepthRenderCamera | None:
        """The camera for depths."""
        return self._mounting_in(context).depth_camera

    def SetDepthRenderCamera(self, context: Context, depth_camera: DepthRenderCamera) -> None:
        """Sets the camera for depths."""
        self._mount(context, depth_camera=depth_camera)


def empty_like(image: type, camera: Any) -> AbstractValue:
    """An image of a camera's size, for an output port."""
    lens = camera.core().intrinsics()
    return AbstractValue.Make(image(lens.width(), lens.height()))
