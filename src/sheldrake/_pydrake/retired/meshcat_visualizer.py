"""The viewer of 2021 and before: ConnectMeshcatVisualizer(builder, scene_graph, zmq_url=...) and load().

`pydrake.systems.meshcat_visualizer` is this module under the alias. A script of that time expects a
`meshcat-server` program at a ZeroMQ address. Where the `meshcat` package is installed and a server answers
there within a second, the scene is published to it; otherwise it is shown in our own page, and that is
said once. Nothing here waits longer.
"""

from __future__ import annotations

import logging
import warnings
import weakref
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common.deprecation import DrakeDeprecationWarning
from sheldrake.common.value import AbstractValue
from sheldrake.geometry import Meshcat, MeshcatVisualizerParams, QueryObject, Rgba, Role
from sheldrake.geometry import MeshcatVisualizer as _NewMeshcatVisualizer
from sheldrake.geometry._meshcat.drawables import drawable_of_shape, triangles_of
from sheldrake.systems.framework import EventStatus, LeafSystem

from .meshcat_parts import AddTriad, MeshcatContactVisualizer, MeshcatPointCloudVisualizer

if TYPE_CHECKING:
    from collections.abc import Iterable

    from sheldrake.geometry._ids import FrameId
    from sheldrake.geometry._scene_graph import SceneGraph
    from sheldrake.geometry._shapes import Shape
    from sheldrake.geometry._state.inspector import SceneGraphInspector
    from sheldrake.systems.framework._context.context import Context
    from sheldrake.systems.framework._diagram_builder import DiagramBuilder
    from sheldrake.systems.framework._port import OutputPort

__all__ = [
    "AddTriad",
    "ConnectMeshcatVisualizer",
    "MeshcatContactVisualizer",
    "MeshcatPointCloudVisualizer",
    "MeshcatVisualizer",
]

log = logging.getLogger("drake")
DEFAULT_ZMQ_URL = "tcp://127.0.0.1:6000"
_PATIENCE = 1000  # how long a server may take to answer [ms]
_PERIOD = 1 / 30.0  # what the viewer of that time did [s]


class _Server:
    """A running meshcat-server, spoken to as the `meshcat` package does, but without ever waiting for it."""

    def __init__(self, zmq_url: str):
        import meshcat.commands
        import meshcat.geometry
        import umsgpack
        import zmq

        self._meshcat = meshcat
        self._pack = umsgpack.packb
        self._zmq = zmq
        self._url = zmq_url
        self._gone = False
        context = zmq.Context()
        self._socket = context.socket(zmq.REQ)
        self._close = weakref.finalize(self, _close, self._socket, context)
        try:
            # A request without an answer must not block the next one.
            self._socket.setsockopt(zmq.REQ_RELAXED, 1)
            self._socket.setsockopt(zmq.REQ_CORRELATE, 1)
            self._socket.setsockopt(zmq.LINGER, 0)
            self._socket.setsockopt(zmq.SNDTIMEO, _PATIENCE)
            self._socket.setsockopt(zmq.RCVTIMEO, _PATIENCE)
            self._socket.connect(zmq_url)
            self._socket.send(b"url")
            self.web_url = self._socket.recv().decode("utf-8")
        except BaseException:
            self._close()
            raise

    @classmethod
    def find(cls, zmq_url: str) -> _Server | None:
        """Returns the server at an address, None when none answers or the package is missing."""
        try:
            import zmq
        except ImportError:
            return None
        try:
            return cls(zmq_url)
        except (ImportError, zmq.ZMQError, UnicodeDecodeError):
            return None

    def _send(self, command: Any) -> None:
        if self._gone:
            return
        parts = command.lower()
        try:
            self._socket.send_multipart([parts["type"].encode(), parts["path"].encode(), self._pack(parts)])
            self._socket.recv()
        except self._zmq.ZMQError as error:
            self._gone = True
            log.warning("The meshcat-server at %s no longer answers (%s); the simulation goes on.", self._url, error)

    def _path(self, path: str) -> Any:
        from meshcat.path import Path

        return Path(tuple(part for part in path.split("/") if part))

    def set_object(self, path: str, shape: Shape, rgba: Rgba) -> None:
        """Draws a shape."""
        triangles = triangles_of(drawable_of_shape(shape, rgba))
        if triangles is None:  # a half space, as a plate
            vertices = np.array([[-5, -5, 0], [5, -5, 0], [5, 5, 0], [-5, 5, 0]], dtype=float)
            faces = np.array([[0, 1, 2], [0, 2, 3]])
        else:
            vertices, faces = triangles.vertices, triangles.faces
        r, g, b = (round(255 * c) for c in rgba.rgba[:3])
        material = self._meshcat.geometry.MeshPhongMaterial(
            color=(r << 16) + (g << 8) + b, opacity=rgba.a(), transparent=rgba.a() < 1
        )
        geometry = self._meshcat.geometry.TriangularMeshGeometry(vertices.astype(np.float32), faces.astype(np.uint32))
        mesh = self._meshcat.geometry.Mesh(geometry, material)
        self._send(self._meshcat.commands.SetObject(mesh, path=self._path(path)))

    def set_transform(self, path: str, pose: np.ndarray) -> None:
        """Places a path, pose of shape (3, 4)."""
        matrix = np.vstack([pose, (0.0, 0.0, 0.0, 1.0)])
        self._send(self._meshcat.commands.SetTransform(matrix, self._path(path)))

    def delete(self, path: str) -> None:
        """Removes a path."""
        self._send(self._meshcat.commands.Delete(self._path(path)))


def _close(socket: Any, context: Any) -> None:
    """Closes a socket, then its context: a context that ends while a socket is open waits for ever."""
    socket.close(linger=0)
    context.term()


class MeshcatVisualizer(LeafSystem):
    """Retired: use sheldrake.geometry.MeshcatVisualizer and Meshcat.

    Draws a scene graph's illustration geometry into a running meshcat-server, or into our own page.

    Args:
        scene_graph: The scene graph; left out by scripts that connect the port themselves.
        zmq_url: Address of the server, "default", "new", or None.
        open_browser: Not used: the address is printed.
        frames_to_draw: Not used.
        prefix: Path in the scene.
        draw_period: Simulated time between two publishes [s].
        role: Which role of the geometries is drawn.
    """

    def __init__(
        self,
        scene_graph: SceneGraph | None = None,
        zmq_url: str | None = "default",
        open_browser: bool | None = None,
        frames_to_draw: Iterable[FrameId] = (),
        prefix: str = "drake",
        draw_period: float = _PERIOD,
        role: Role = Role.kIllustration,
        **_ignored: object,
    ):
        super().__init__()
        self.set_name("meshcat_visualizer")
        path = f"/drake/{prefix}".rstrip("/")
        self._params = MeshcatVisualizerParams(publish_period=draw_period, role=role, prefix=path)
        self._scene_graph = scene_graph
        self._server: Any = None
        self.meshcat: Meshcat | None = None
        self._connect(zmq_url)
        self.DeclareAbstractInputPort("geometry_query", AbstractValue.Make(QueryObject()))
        self.DeclareInitializationPublishEvent(publish=self._load)
        self.DeclarePeriodicPublishEvent(period_sec=draw_period, offset_sec=0.0, publish=self._draw)
        self.DeclareForcedPublishEvent(publish=self._draw)

    def _connect(self, zmq_url: str | None) -> None:
        named = zmq_url not in (None, "default", "new")
        if zmq_url != "new" and zmq_url is not None:
            self._server = _Server.find(DEFAULT_ZMQ_URL if zmq_url == "default" else zmq_url)
        if self._server is not None:
            print(f"You can open the visualizer by visiting the following URL:\n{self._server.web_url}")
            return
        self.meshcat = Meshcat()
        if named:
            print(f"No meshcat-server answers at {zmq_url}: the scene is shown at {self.meshcat.web_url()} instead.")
        self._page = _NewMeshcatVisualizer(self.meshcat, self._params)

    @property
    def vis(self) -> Any:
        """What is drawn into: our Meshcat, or the connection to the meshcat-server."""
        return self.meshcat if self.meshcat is not None else self._server

    def load(self, context: Any = None) -> None:
        """Draws the geometries anew; without a context, what the scene graph holds by default."""
        if self.meshcat is not None:
            self._page.Delete()
            if context is None and self._scene_graph is not None:
                self._page._set_objects(self._scene_graph.model_inspector())
                return
        inspector = self._inspector(context)
        if inspector is not None and self._server is not None:
            self._send_objects(inspector)

    def _inspector(self, context: Context) -> SceneGraphInspector:
        if context is not None:
            return self.get_input_port(0).Eval(context).inspector()
        return self._scene_graph.model_inspector() if self._scene_graph is not None else None

    def _send_objects(self, inspector: Any) -> None:
        self._server.delete(self._params.prefix)
        self._frames = {}
        world = inspector.world_frame_id()
        for frame in inspector.GetAllFrameIds():
            path = f"{self._params.prefix}/{inspector.GetName(frame)}".replace("::", "/")
            for geometry in inspector.GetGeometries(frame, self._params.role):
                properties = inspector.GetProperties(geometry, self._params.role)
                rgba = properties.GetPropertyOrDefault("phong", "diffuse", self._params.default_color)
                own = f"{path}/{geometry.get_value()}"
                self._server.set_object(own, inspector.GetShape(geometry), rgba)
                self._server.set_transform(own, inspector.GetPoseInFrame(geometry).GetAsMatrix34())
                if frame != world:
                    self._frames[frame] = path

    def _load(self, context: Context) -> EventStatus:
        if self._server is not None:
            self._send_objects(self._inspector(context))
        else:
            self._page.Delete()
        return self._draw(context)

    def _draw(self, context: Context) -> EventStatus:
        query = self.get_input_port(0).Eval(context)
        if self._server is None:
            return self._page._publish(query, float(context.get_time()))
        if not hasattr(self, "_frames"):
            self._send_objects(query.inspector())
        for frame, path in self._frames.items():
            self._server.set_transform(path, query.GetPoseInWorld(frame).GetAsMatrix34())
        return EventStatus.Succeeded()

    def start_recording(self) -> None:
        """Starts a recording."""
        if self.meshcat is not None:
            self.meshcat.StartRecording(1.0 / self._params.publish_period)

    def stop_recording(self) -> None:
        """Stops the recording."""
        if self.meshcat is not None:
            self.meshcat.StopRecording()

    def publish_recording(self, play: bool = True, repetitions: int = 1) -> None:
        """Plays the recording in the page."""
        if self.meshcat is not None:
            recording = self.meshcat.get_mutable_recording()
            recording.set_autoplay(play)
            recording.set_repetitions(repetitions)
            self.meshcat.PublishRecording()

    def reset_recording(self) -> None:
        """Forgets the recording."""
        if self.meshcat is not None:
            self.meshcat.DeleteRecording()

    def delete_prefix(self) -> None:
        """Removes what was drawn."""
        if self.meshcat is not None:
            self._page.Delete()
        else:
            self._server.delete(self._params.prefix)


def ConnectMeshcatVisualizer(
    builder: DiagramBuilder, scene_graph: SceneGraph | None = None, output_port: OutputPort | None = None, **kwargs: Any
) -> Any:
    """Retired: use sheldrake.geometry.MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat).

    Adds the viewer of 2021 to a diagram and returns it.

    Args:
        builder: The diagram in the making.
        scene_graph: The scene graph.
        output_port: Its query port; taken from the scene graph when left out.
        **kwargs: Passed to MeshcatVisualizer: zmq_url, prefix, role, ...

    Raises:
        RuntimeError: when neither a scene graph nor a port is given.
    """
    warnings.warn(
        "ConnectMeshcatVisualizer() is retired: use MeshcatVisualizer.AddToBuilder(builder, scene_graph, Meshcat()).",
        DrakeDeprecationWarning,
        stacklevel=2,
    )
    if output_port is None:
        if scene_graph is None:
            raise RuntimeError("ConnectMeshcatVisualizer(): give scene_graph or output_port.")
        output_port = scene_graph.get_query_output_port()
    visualizer = builder.AddSystem(MeshcatVisualizer(scene_graph, **kwargs))
    builder.Connect(output_port, visualizer.get_input_port(0))
    return visualizer
