"""MeshcatPointCloudVisualizer: draws a point cloud into a Meshcat."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sheldrake.common.value import AbstractValue
from sheldrake.geometry._numbers import values_of
from sheldrake.geometry._point_cloud import PointCloud
from sheldrake.geometry._rgba import Rgba
from sheldrake.math import RigidTransform
from sheldrake.systems.framework import EventStatus, LeafSystem
from sheldrake.systems.framework._port_getters import input_port

from .meshcat import Meshcat
from .tree import as_float

if TYPE_CHECKING:
    from sheldrake.systems.framework import Context


class MeshcatPointCloudVisualizer(LeafSystem):
    """Draws a point cloud into a Meshcat, every `publish_period` of simulated time.

    Ports: inputs "cloud" and "X_ParentCloud", the pose of the cloud's frame, the identity when not connected.

    Args:
        meshcat: Where to draw.
        path: Path in the scene.
        publish_period: Simulated time between two publishes [s]; zero publishes at every step.

    Raises:
        RuntimeError: when the period is negative.
    """

    _generic, _symbolic = True, False

    def __init__(self, meshcat: Meshcat, path: str, publish_period: float = 1 / 32.0):
        super().__init__()
        if not publish_period >= 0:
            raise RuntimeError(
                f"MeshcatPointCloudVisualizer(): publish_period must not be negative, got {publish_period} s."
            )
        self._meshcat, self._path = meshcat, path
        self._point_size, self._default_rgba = 0.001, Rgba(0.9, 0.9, 0.9, 1.0)
        self.DeclareAbstractInputPort("cloud", AbstractValue.Make(PointCloud()))
        self.DeclareAbstractInputPort("X_ParentCloud", AbstractValue.Make(RigidTransform()))
        if publish_period > 0:
            self.DeclarePeriodicPublishEvent(period_sec=publish_period, offset_sec=0.0, publish=self._update)
        else:
            self.DeclarePerStepPublishEvent(publish=self._update)
        self.DeclareForcedPublishEvent(publish=self._update)

    def set_point_size(self, size: float) -> None:
        """Sets the size of the points [m]."""
        self._point_size = float(size)

    def set_default_rgba(self, rgba: Rgba) -> None:
        """Sets the color of points in clouds without colors."""
        self._default_rgba = rgba.__copy__()

    def Delete(self) -> None:
        """Removes what was drawn."""
        self._meshcat.Delete(self._path)

    cloud_input_port = input_port(0, "Returns the input port for the point cloud.")
    pose_input_port = input_port(1, "Returns the input port for the pose of the cloud's frame.")

    def _update(self, context: Context) -> EventStatus:
        cloud = self.cloud_input_port().Eval(context)
        self._meshcat.SetObject(self._path, cloud, self._point_size, self._default_rgba)
        pose = self.pose_input_port()
        X = RigidTransform()
        if pose.HasValue(context):
            X = RigidTransform(values_of(pose.Eval(context).GetAsMatrix34()))
        self._meshcat.SetTransform(self._path, X, as_float(context.get_time()))
        return EventStatus.Succeeded()
