"""MeshcatVisualizer: draws what a SceneGraph holds into a Meshcat."""

from __future__ import annotations

import logging
import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, SupportsIndex

import numpy as np

from sheldrake.common._kinds import instance_of
from sheldrake.common._overloads import overloaded
from sheldrake.common.value import AbstractValue
from sheldrake.geometry._ids import FrameId
from sheldrake.geometry._meshes.surfaces import surface_of
from sheldrake.geometry._meshes.volume_mesh import ConvertVolumeToSurfaceMesh, VolumeMesh
from sheldrake.geometry._query.query_object import QueryObject
from sheldrake.geometry._roles import Role
from sheldrake.geometry._visualizer_arguments import add_visualizer, of_scene
from sheldrake.systems.framework import BusValue, DiagramBuilder, EventStatus, LeafSystem
from sheldrake.systems.framework._port_getters import input_port

from .animation import MeshcatAnimation
from .meshcat import Meshcat
from .params import MeshcatVisualizerParams, MeshcatVisualizerSurfaceVelocityData
from .tree import as_float, full_path

if TYPE_CHECKING:
    from sheldrake.geometry._ids import GeometryId
    from sheldrake.geometry._scene_graph import SceneGraph
    from sheldrake.geometry._state.inspector import SceneGraphInspector
    from sheldrake.systems.framework import Context
    from sheldrake.systems.framework._port import InputPort, OutputPort

log = logging.getLogger("drake")
_ALPHA_STEP = 0.02


class MeshcatVisualizer(LeafSystem):
    """Draws the geometries of one role into a Meshcat, every `publish_period` of simulated time.

    A body's frame "model::body" is drawn at "prefix/model/body", its geometries below, by name.

    Args:
        meshcat: Where to draw.
        params: What, where and how often.
        surface_data: Bodies whose surfaces run, by their frames. Their pictures stand still on this page.

    Raises:
        RuntimeError: when the publish period is not positive or the role is kUnassigned.
    """

    _generic, _symbolic = True, False

    def __init__(
        self,
        meshcat: Meshcat,
        params: MeshcatVisualizerParams | None = None,
        surface_data: Mapping[FrameId, MeshcatVisualizerSurfaceVelocityData] | None = None,
    ):
        super().__init__()
        params = MeshcatVisualizerParams() if params is None else params
        if not params.publish_period >= 0.0:
            raise RuntimeError(f"MeshcatVisualizer(): publish_period is negative, {params.publish_period} s.")
        if params.role == Role.kUnassigned:
            raise RuntimeError("MeshcatVisualizer(): role must not be kUnassigned.")
        self._meshcat = meshcat
        self._params = params
        self._drawn_version: Any = None
        self._frames: list[Any] = []
        self._memo: dict[Any, Any] = {}
        self._frame_paths: list[str] = []
        self._geometry_paths: dict[Any, str] = {}
        self._alpha = 1.0
        self._alpha_slider = f"{params.prefix} α"
        self.DeclareAbstractInputPort("query_object", AbstractValue.Make(QueryObject()))
        self.DeclareAbstractInputPort("surface_displacement", AbstractValue.Make(BusValue()))
        self.DeclareInitializationPublishEvent(publish=self._initialize)
        if params.publish_period > 0.0:
            self.DeclarePeriodicPublishEvent(period_sec=params.publish_period, offset_sec=0.0, publish=self._update)
        self.DeclareForcedPublishEvent(publish=self._update)
        if params.enable_alpha_slider:
            meshcat.AddSlider(self._alpha_slider, _ALPHA_STEP, 1.0, _ALPHA_STEP, params.initial_alpha_slider_value)

    @classmethod
    @overloaded(
        *of_scene(
            meshcat=instance_of(Meshcat),
            params=(instance_of(MeshcatVisualizerParams), None),
            surface_data=(instance_of(Mapping), None),
        )
    )
    def AddToBuilder(
        cls,
        builder: DiagramBuilder,
        source: SceneGraph | OutputPort,
        meshcat: Meshcat,
        params: MeshcatVisualizerParams | None,
        surface_data: Mapping[FrameId, MeshcatVisualizerSurfaceVelocityData] | None,
    ) -> MeshcatVisualizer:
        """Adds a visualizer to a diagram, connects it and returns it.

        Args:
            builder: The diagram in the making.
            source: A SceneGraph; or its query port, called `query_object_port`.
            meshcat: Where to draw.
            params: Options.
            surface_data: Bodies whose surfaces run.

        Raises:
            TypeError: when an argument is missing or of another type.
        """
        visualizer = cls(meshcat, params, surface_data)
        return add_visualizer(builder, source, visualizer, f"meshcat_visualizer({visualizer._params.prefix})")

    def get_input_port(self, port_index: SupportsIndex | None = None, warn_deprecated: bool = True) -> InputPort:
        """Input port `port_index`, by default that of the scene: the only one before surfaces could run."""
        return super().get_input_port(0 if port_index is None else port_index, warn_deprecated)

    query_object_input_port = input_port(0, "Returns the input port for a SceneGraph's query port.")
    surface_displacements_input_port = input_port(
        1, "Returns the input port for how far surfaces have come, a BusValue; it need not be connected."
    )

    def Delete(self) -> None:
        """Removes everything below the prefix; the next publish draws it anew."""
        self._meshcat.Delete(self._params.prefix)
        self._drawn_version = None

    def StartRecording(self, set_transforms_while_recording: bool = True) -> MeshcatAnimation:
        """Starts a recording at the rate of the publishes and returns it.

        Args:
            set_transforms_while_recording: Whether the page moves meanwhile, too.

        Raises:
            RuntimeError: publishes have no period.
        """
        if self._params.publish_period == 0.0:
            raise RuntimeError("MeshcatVisualizer.StartRecording(): the publish_period is zero.")
        self._meshcat.StartRecording(1.0 / self._params.publish_period, set_transforms_while_recording)
        return self._meshcat.get_mutable_recording()

    def StopRecording(self) -> None:
        """Stops the recording; what was recorded stays."""
        self._meshcat.StopRecording()

    def PublishRecording(self) -> None:
        """Plays the recording in the page."""
        self._meshcat.PublishRecording()

    def DeleteRecording(self) -> None:
        """Forgets the recording."""
        self._meshcat.DeleteRecording()

    def get_mutable_recording(self) -> MeshcatAnimation:
        """Returns the recording."""
        return self._meshcat.get_mutable_recording()

    def ResetRealtimeRateCalculator(self) -> None:
        """Starts the measurement of the realtime rate anew."""
        self._meshcat._realtime.calculator.reset()

    def _initialize(self, context: Context) -> EventStatus:
        if self._params.delete_on_initialization_event:
            self.Delete()
        return self._update(context)

    def _update(self, context: Context) -> EventStatus:
        """Draws what changed: the geometries, where they are, and how opaque."""
        port = self.query_object_input_port()
        if not port.HasValue(context):
            raise RuntimeError(
                f"MeshcatVisualizer '{self.GetSystemPathname()}': input port 'query_object' is not connected; "
                "connect it to SceneGraph.get_query_output_port(), or use MeshcatVisualizer.AddToBuilder()."
            )
        return self._publish(port.Eval(context), as_float(context.get_time()))

    def _publish(self, query: QueryObject, time: float) -> EventStatus:
        """Draws what a QueryObject tells, at a simulation time [s]."""
        version = query.inspector().geometry_version()
        if self._drawn_version is None:
            self._meshcat.SetProperty(self._params.prefix, "visible", self._params.visible_by_default)
        if self._drawn_version is None or not self._drawn_version.IsSameAs(version, self._params.role):
            self._set_objects(query.inspector())
            self._drawn_version = type(version)(version)
        self._set_transforms(query, time)
        if self._params.enable_alpha_slider:
            self._set_alpha()
        self._meshcat.SetSimulationTime(time)
        return EventStatus.Succeeded()

    def _set_objects(self, inspector: SceneGraphInspector) -> None:
        """Draws the geometries of our role and removes those that have gone."""
        gone, self._geometry_paths = self._geometry_paths, {}
        self._frames, self._frame_paths, self._memo = [], [], {}
        world = inspector.world_frame_id()
        for frame in inspector.GetAllFrameIds():
            path = self._params.prefix
            if frame != world:
                path = f"{path}/{inspector.GetName(frame)}".replace("::", "/")
            geometries = inspector.GetGeometries(frame, self._params.role)
            drawn = [self._draw(inspector, geometry, path) for geometry in geometries]
            if any(drawn) and frame != world:
                self._frames.append(frame)
                self._frame_paths.append(full_path(path))
        for geometry, path in gone.items():
            if geometry not in self._geometry_paths:
                self._meshcat.Delete(path)
        self._alpha = 1.0

    def _draw(self, inspector: SceneGraphInspector, geometry: GeometryId, frame_path: str) -> bool:
        properties: Any = inspector.GetProperties(geometry, self._params.role)  # there are some: it has the role
        if properties.HasProperty("meshcat", "accepting"):
            if properties.GetProperty("meshcat", "accepting") != self._params.prefix:
                return False
        elif not self._params.include_unspecified_accepting:
            return False
        path = f"{frame_path}/{inspector.GetName(geometry)}".replace("::", "/")
        rgba = properties.GetPropertyOrDefault("phong", "diffuse", self._params.default_color)
        surface = self._collision_surface(inspector, geometry)
        if surface is not None:
            vertices, faces = surface
            self._meshcat.SetTriangleMesh(path, vertices.T, faces.T, rgba)
        else:
            picture = properties.GetPropertyOrDefault("phong", "diffuse_map", "")
            if picture and not os.path.isfile(picture):
                log.warning("MeshcatVisualizer: the texture ('phong', 'diffuse_map') '%s' does not exist.", picture)
                picture = ""
            self._meshcat.SetObject(path, inspector.GetShape(geometry), rgba, picture)
        self._meshcat.SetTransform(path, inspector.GetPoseInFrame(geometry))
        self._geometry_paths[geometry] = path
        return True

    def _collision_surface(
        self, inspector: SceneGraphInspector, geometry: GeometryId
    ) -> tuple[np.ndarray, np.ndarray] | None:
        """Vertices and triangles of what collides, where that is not the shape itself.

        The surface of the hydroelastic mesh, if that is wanted and there is one; else the hull of a mesh.
        """
        if self._params.role != Role.kProximity:
            return None
        if self._params.show_hydroelastic:
            mesh = inspector.maybe_get_hydroelastic_mesh(geometry)
            if isinstance(mesh, VolumeMesh):
                mesh = ConvertVolumeToSurfaceMesh(mesh)
            if mesh is not None:
                return mesh._vertices, mesh._triangles
        hull = inspector.GetConvexHull(geometry)
        return None if hull is None else surface_of(hull)

    def _set_transforms(self, query: QueryObject, time: float) -> None:
        if self._frames:
            poses = query._world_matrices(self._frames, self._memo)
            self._meshcat._set_poses(self._frame_paths, poses, time)

    def _set_alpha(self) -> None:
        alpha = self._meshcat.GetSliderValue(self._alpha_slider)
        if alpha != self._alpha:
            self._alpha = alpha
            self._meshcat.SetProperty(self._params.prefix, "modulated_opacity", alpha)
