"""DrakeVisualizer: tells viewers in other processes, by messages, what a SceneGraph holds and where it is."""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._kinds import anything, instance_of
from sheldrake.common._options import Options
from sheldrake.common._overloads import overloaded
from sheldrake.common.value import AbstractValue
from sheldrake.geometry._meshcat.tree import as_float
from sheldrake.geometry._meshes.surfaces import surface_of
from sheldrake.geometry._meshes.volume_mesh import ConvertVolumeToSurfaceMesh, VolumeMesh
from sheldrake.geometry._query.query_object import QueryObject
from sheldrake.geometry._rgba import Rgba
from sheldrake.geometry._roles import Role
from sheldrake.geometry._scene_graph import SceneGraph
from sheldrake.geometry._shape_types import type_of
from sheldrake.geometry._shapes import Convex, HalfSpace, Mesh
from sheldrake.geometry._visualizer_arguments import add_visualizer, of_scene
from sheldrake.lcm import DrakeLcm, DrakeLcmInterface
from sheldrake.lcm._messages import (
    lcmt_viewer_draw,
    lcmt_viewer_geometry_data,
    lcmt_viewer_link_data,
    lcmt_viewer_load_robot,
)
from sheldrake.math import RigidTransform
from sheldrake.systems.framework import DiagramBuilder, EventStatus, LeafSystem
from sheldrake.systems.framework._port_getters import input_port

if TYPE_CHECKING:
    from sheldrake.geometry._ids import FrameId, GeometryId
    from sheldrake.geometry._shapes import Shape
    from sheldrake.geometry._state.inspector import SceneGraphInspector
    from sheldrake.systems.framework import Context
    from sheldrake.systems.framework._port import OutputPort

LOAD_CHANNEL, DRAW_CHANNEL = "DRAKE_VIEWER_LOAD_ROBOT", "DRAKE_VIEWER_DRAW"
_SUFFIXES = {Role.kIllustration: "_ILLUSTRATION", Role.kProximity: "_PROXIMITY", Role.kPerception: "_PERCEPTION"}
_HALF_SPACE = (50.0, 50.0, 1.0)  # of the box that stands for one [m]


class DrakeVisualizerParams(Options):
    """What a DrakeVisualizer tells of, and how often.

    Attributes:
        publish_period: Simulated time between two messages [s].
        role: Which role of the geometries is shown.
        default_color: Color of geometries that name none.
        show_hydroelastic: Whether proximity geometries are shown by their contact meshes.
        use_role_channel_suffix: Whether the channels' names end with the role's, so that viewers see several roles.
    """

    publish_period: float = 1 / 64.0
    role: Role = Role.kIllustration
    default_color: Rgba = Rgba(0.9, 0.9, 0.9, 1.0)
    show_hydroelastic: bool = False
    use_role_channel_suffix: bool = False


@checked
class DrakeVisualizer(LeafSystem):
    """Publishes the geometries of one role, and their poses every `publish_period` of simulated time.

    Port: the input "query_object".

    Args:
        lcm: Where to publish; the default network when left out.
        params: What to tell.

    Raises:
        RuntimeError: when the publish period is not positive or the role is kUnassigned.
    """

    _generic = True
    _symbolic = False

    def __init__(self, lcm: DrakeLcmInterface | None = None, params: DrakeVisualizerParams | None = None):
        super().__init__()
        params = DrakeVisualizerParams() if params is None else copy.deepcopy(params)
        if not params.publish_period > 0:
            raise RuntimeError(
                f"DrakeVisualizer requires a positive publish period; {params.publish_period:g} was given"
            )
        if params.role == Role.kUnassigned:
            raise RuntimeError(
                "DrakeVisualizer cannot be used for geometries with the Role::kUnassigned value. Please choose "
                "proximity, perception, or illustration"
            )
        self._lcm = DrakeLcm() if lcm is None else lcm
        self._params = params
        self._told_version: Any = None
        self._frames: list[tuple[FrameId, str, int]] = []
        self.DeclareAbstractInputPort("query_object", AbstractValue.Make(QueryObject()))
        self.DeclarePeriodicPublishEvent(period_sec=params.publish_period, offset_sec=0.0, publish=self._publish)
        self.DeclareForcedPublishEvent(publish=self._publish)

    @classmethod
    @overloaded(*of_scene(lcm=(anything, None), params=(instance_of(DrakeVisualizerParams), None)))
    def AddToBuilder(
        cls,
        builder: DiagramBuilder,
        source: SceneGraph | OutputPort,
        lcm: DrakeLcmInterface | None,
        params: DrakeVisualizerParams,
    ) -> DrakeVisualizer:
        """Adds a visualizer to a diagram, connects it and returns it.

        Args:
            builder: The diagram in the making.
            source: A SceneGraph; or its query port, called `query_object_port`.
            lcm: Where to publish.
            params: Options.

        Raises:
            TypeError: when an argument is missing or of another type.
        """
        visualizer = cls(lcm, params)
        name = f"drake_visualizer({_SUFFIXES[visualizer._params.role][1:].lower()})"
        return add_visualizer(builder, source, visualizer, name)

    @staticmethod
    def DispatchLoadMessage(
        scene_graph: SceneGraph, lcm: DrakeLcmInterface | None, params: DrakeVisualizerParams | None = None
    ) -> None:
        """Publishes the geometries of a SceneGraph's model once.

        Args:
            scene_graph: Its model, not a context's, is told of.
            lcm: Where to publish.
            params: What to tell.

        Raises:
            RuntimeError: when a shape has no message, or `lcm` is None.
        """
        if lcm is None:
            raise RuntimeError("DrakeVisualizer.DispatchLoadMessage(): lcm is None.")
        visualizer = DrakeVisualizer(lcm, params)
        visualizer._tell_geometries(scene_graph.model_inspector())

    query_object_input_port = input_port(0, "Returns the input port for a SceneGraph's query port.")

    def _publish(self, context: Context) -> EventStatus:
        port = self.query_object_input_port()
        if not port.HasValue(context):
            raise RuntimeError(
                f"DrakeVisualizer '{self.GetSystemPathname()}': input port 'query_object' is not connected; connect it "
                "to SceneGraph.get_query_output_port(), or use DrakeVisualizer.AddToBuilder()."
            )
        query = port.Eval(context)
        version = query.inspector().geometry_version()
        if self._told_version is None or not self._told_version.IsSameAs(version, self._params.role):
            self._tell_geometries(query.inspector())
            self._told_version = type(version)(version)
        self._tell_poses(query, as_float(context.get_time()))
        return EventStatus.Succeeded()

    def _send(self, channel: str, message: Any, time: float | None = None) -> None:
        suffix = _SUFFIXES[self._params.role] if self._params.use_role_channel_suffix else ""
        self._lcm.Publish(channel + suffix, message.encode(), time)

    def _tell_geometries(self, inspector: SceneGraphInspector) -> None:
        """Publishes all frames that have geometries of our role, the world first; notes those that move."""
        world, self._frames, links = inspector.world_frame_id(), [], []
        for frame in inspector.GetAllFrameIds():
            geometries = inspector.GetGeometries(frame, self._params.role)
            if not geometries:
                continue
            name, number = ("world", 0) if frame == world else _name_of(inspector, frame)
            if frame != world:
                self._frames.append((frame, name, number))
            looks = [self._geometry(inspector, geometry) for geometry in geometries]
            links.append(lcmt_viewer_link_data(name=name, robot_num=number, num_geom=len(looks), geom=looks))
        self._send(LOAD_CHANNEL, lcmt_viewer_load_robot(num_links=len(links), link=links))

    def _tell_poses(self, query: QueryObject, time: float) -> None:
        poses = [_floats(query.GetPoseInWorld(frame)) for frame, _, _ in self._frames]
        message = lcmt_viewer_draw(
            timestamp=int(time * 1000.0),
            num_links=len(poses),
            link_name=[name for _, name, _ in self._frames],
            robot_num=[number for _, _, number in self._frames],
            position=[position for position, _ in poses],
            quaternion=[quaternion for _, quaternion in poses],
        )
        self._send(DRAW_CHANNEL, message, time)

    def _geometry(self, inspector: SceneGraphInspector, geometry: GeometryId) -> lcmt_viewer_geometry_data:
        shape, X_FG = inspector.GetShape(geometry), inspector.GetPoseInFrame(geometry)
        if isinstance(shape, HalfSpace):
            X_FG = X_FG @ RigidTransform([0.0, 0.0, -0.5 * _HALF_SPACE[2]])
        kind, numbers, file = self._look(inspector, geometry, shape)
        position, quaternion = _floats(X_FG)
        return lcmt_viewer_geometry_data(
            type=kind,
            position=position,
            quaternion=quaternion,
            color=list(self._color(inspector, geometry).rgba),
            string_data=file,
            num_float_data=len(numbers),
            float_data=numbers,
        )

    def _color(self, inspector: SceneGraphInspector, geometry: GeometryId) -> Rgba:
        """The color of our role's properties, else of what the geometry looks like, else the default."""
        for properties in (
            inspector.GetProperties(geometry, self._params.role),
            inspector.GetIllustrationProperties(geometry),
        ):
            if properties is not None and properties.HasProperty("phong", "diffuse"):
                return properties.GetProperty("phong", "diffuse")
        return self._params.default_color

    def _look(self, inspector: SceneGraphInspector, geometry: GeometryId, shape: Shape) -> tuple[int, list[float], str]:
        """Kind, numbers and file of a geometry's message."""
        collides = self._params.role == Role.kProximity
        if collides and self._params.show_hydroelastic:
            mesh = inspector.maybe_get_hydroelastic_mesh(geometry)
            if mesh is not None:
                mesh = ConvertVolumeToSurfaceMesh(mesh) if isinstance(mesh, VolumeMesh) else mesh
                return _facets(mesh._vertices, mesh._triangles)
        if isinstance(shape, Convex) or (isinstance(shape, Mesh) and collides):
            return _facets(*surface_of(shape.GetConvexHull()))
        if isinstance(shape, Mesh):
            if shape.source().is_path():
                return lcmt_viewer_geometry_data.MESH, list(shape.scale3()), str(shape.source().path())
            from sheldrake.geometry._meshes.mesh_looks import load_mesh

            loaded = load_mesh(shape, "DrakeVisualizer")
            return _facets(loaded.vertices, loaded.faces)
        if isinstance(shape, HalfSpace):
            return lcmt_viewer_geometry_data.BOX, list(_HALF_SPACE), ""
        row = type_of(shape)
        if row.viewer:
            return getattr(lcmt_viewer_geometry_data, row.viewer), list(shape._values()), ""
        if row.kind is None or row.surface is None:
            raise RuntimeError(f"DrakeVisualizer does not support {type(shape).__name__}.")
        return _facets(*row.surface(shape))


def _name_of(inspector: SceneGraphInspector, frame: FrameId) -> tuple[str, int]:
    return f"{inspector.GetOwningSourceName(frame)}::{inspector.GetName(frame)}", inspector.GetFrameGroup(frame)


def _facets(vertices: np.ndarray, triangles: np.ndarray) -> tuple[int, list[float], str]:
    """A mesh in numbers; every triangle has corners of its own, so that edges look sharp."""
    corners = np.asarray(vertices, float)[np.asarray(triangles, int)].reshape(-1, 3)
    counts = [len(corners), len(triangles)]
    numbers = np.concatenate([counts, corners.ravel(), np.arange(len(corners))])
    return lcmt_viewer_geometry_data.MESH, numbers.tolist(), ""


def _floats(X: RigidTransform) -> tuple[list[float], list[float]]:
    """Position and quaternion w x y z of a pose; derivatives are left out."""
    q = X.rotation().ToQuaternion()
    return [as_float(x) for x in X.translation()], [as_float(v) for v in (q.w(), q.x(), q.y(), q.z())]
