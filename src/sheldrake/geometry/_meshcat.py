"""Meshcat: a scene in a web page, with pydrake's calls."""

from __future__ import annotations

import dataclasses
import enum
import logging
import os
import socket
import sys
import threading
import weakref
from pathlib import Path
from typing import Any, overload

import numpy as np

from ._meshcat_animation import MeshcatAnimation
from ._meshcat_controls import Controls, Gamepad
from ._meshcat_drawables import Lines, Points, Triangles, drawable_of_shape, surface_grid
from ._meshcat_export import TITLE, static_html, static_zip
from ._meshcat_page import Page
from ._meshcat_params import MeshcatParams
from ._meshcat_player import Player
from ._meshcat_realtime import RealtimeRateCalculator, StatusLine
from ._meshcat_scripts import LIVE_PAGE
from ._meshcat_server import ALL_INTERFACES, Gatekeeper, Site, client_page, open_socket, start_viser, stop_viser
from ._meshcat_tree import SceneTree, as_matrix4, full_path
from ._rgba import Rgba
from ._shapes import Shape

log = logging.getLogger("drake")


class SideOfFaceToRender(enum.IntEnum):
    """Which sides of a mesh's faces are seen."""

    kFrontSide = 0
    kBackSide = 1
    kDoubleSide = 2


_SIDES = {
    SideOfFaceToRender.kFrontSide: "front",
    SideOfFaceToRender.kBackSide: "back",
    SideOfFaceToRender.kDoubleSide: "double",
}


@dataclasses.dataclass(kw_only=True)
class PerspectiveCamera:
    """A perspective camera: vertical field of view [deg], aspect, planes [m], zoom."""

    fov: float = 75.0
    aspect: float = 1.0
    near: float = 0.01
    far: float = 100.0
    zoom: float = 1.0


@dataclasses.dataclass(kw_only=True)
class OrthographicCamera:
    """An orthographic camera: the box it sees, in its own frame [m], and zoom."""

    left: float = -1.0
    right: float = 1.0
    top: float = -1.0
    bottom: float = 1.0
    near: float = -1000.0
    far: float = 1000.0
    zoom: float = 1.0


class _Hub:
    """What lives behind a Meshcat. The server's thread holds this, never the Meshcat itself."""

    def __init__(self, params: MeshcatParams, listener: socket.socket):
        self.tree = SceneTree()
        self.lock = threading.RLock()
        self.animation = MeshcatAnimation()
        self.recording = False
        self.show_while_recording = True
        self.published: MeshcatAnimation | None = None
        self.player: Player | None = None
        public = params.web_url_pattern.format(host="localhost", port=0).partition("//")[2]
        gatekeeper = Gatekeeper(params.host, public.partition("/")[0].partition(":")[0])
        downloads = {
            "/download": ("text/html; charset=utf-8", lambda: self.static_html().encode()),
            "/download.zip": ("application/zip", self.static_zip),
        }
        page = client_page(LIVE_PAGE, TITLE)
        self.server = start_viser(listener, Site(gatekeeper, page, downloads))
        self.page = Page(self.server, self.tree)
        self.status = StatusLine(self.server) if params.show_stats_plot else None
        self.controls = Controls(self.server)
        self.tree.on_change = self.page.wake

    def static_html(self) -> str:
        return static_html(self.page, self.published)

    def static_zip(self) -> bytes:
        return static_zip(self.page, self.published)

    def stop(self) -> None:
        stop_viser(self.server)


def _stop(hub: _Hub) -> None:
    hub.stop()


def _array3(call: str, name: str, value: Any, dtype: Any = float) -> np.ndarray:
    array = np.asarray(value, dtype=dtype)
    if array.ndim != 2 or array.shape[0] != 3:
        raise ValueError(f"Meshcat.{call}(): {name} must have shape (3, n), got {array.shape}.")
    return array


def _check_network_allowed() -> None:
    allowed = os.environ.get("DRAKE_ALLOW_NETWORK")
    if allowed and "meshcat" not in allowed.split(":"):
        raise RuntimeError(f"Meshcat(): not allowed by the environment variable DRAKE_ALLOW_NETWORK={allowed}.")


class Meshcat:
    """A 3-D scene shown in any browser, at web_url().

    Paths name places in the scene: "/a/b" lies below "/a" and moves with it; a path that does not
    start with "/" lies below "/drake". The page listens on this machine only, unless
    MeshcatParams.host says otherwise. Calls only note what changed; pages are told from another
    thread, and only while somebody looks.

    Args:
        port: Port to listen on; None takes the first free one from 7000 on, 0 any free one.
        params: More choices, in place of `port`.

    Raises:
        RuntimeError: when the wanted port is in use.
        ValueError: when a parameter is out of range.
    """

    Gamepad = Gamepad
    OrthographicCamera = OrthographicCamera
    PerspectiveCamera = PerspectiveCamera
    SideOfFaceToRender = SideOfFaceToRender

    @overload
    def __init__(self, port: int | None = None) -> None: ...
    @overload
    def __init__(self, params: MeshcatParams) -> None: ...
    def __init__(self, *args: Any, **kwargs: Any) -> None:
        params = self._params(*args, **kwargs)
        _check_network_allowed()
        self._rate_calculator = RealtimeRateCalculator(params.realtime_rate_period)
        self._rate = 0.0
        listener = open_socket(params.host, params.port)
        self._port = listener.getsockname()[1]
        host = "localhost" if params.host in ALL_INTERFACES else params.host
        try:
            self._web_url = params.web_url_pattern.format(host=host, port=self._port).rstrip("/")
        except (KeyError, IndexError, ValueError) as error:
            listener.close()
            raise RuntimeError(
                f"Meshcat(): web_url_pattern '{params.web_url_pattern}' names {error}; it has {{host}} and {{port}}."
            ) from None
        self._hub = _Hub(params, listener)
        self._finalizer = weakref.finalize(self, _stop, self._hub)
        for item in params.initial_properties:
            self.SetProperty(item.path, item.property, item.value)
        self._announce()

    @staticmethod
    def _params(*args: Any, **kwargs: Any) -> MeshcatParams:
        if len(args) + len(kwargs) > 1 or set(kwargs) - {"port", "params"}:
            raise TypeError(f"Meshcat(): expected (port) or (params), got {args} {kwargs}.")
        value = args[0] if args else next(iter(kwargs.values()), None)
        if isinstance(value, MeshcatParams):
            return value
        if value is not None and (isinstance(value, bool) or not isinstance(value, (int, np.integer))):
            raise TypeError(f"Meshcat(): expected a port number or MeshcatParams, got {type(value).__name__}.")
        return MeshcatParams(port=None if value is None else int(value))

    def _announce(self) -> None:
        text = f"Meshcat listening for connections at {self._web_url}"
        if log.isEnabledFor(logging.INFO) and log.hasHandlers():
            log.info(text)
        elif sys.stderr is not None:
            print(text, file=sys.stderr)

    def web_url(self) -> str:
        """Returns the address to open in a browser."""
        return self._web_url

    def port(self) -> int:
        """Returns the port."""
        return self._port

    def ws_url(self) -> str:
        """Returns the address of the websocket."""
        return "ws" + self._web_url.removeprefix("http")

    def GetNumActiveConnections(self) -> int:
        """Returns how many pages are connected."""
        return self._hub.page.num_clients()

    def Flush(self) -> None:
        """Waits until every page has been sent what was set so far, at most 15 s for a page that does not take it."""
        import time

        self._hub.page.sync()
        server = self._hub.server._websock_server
        buffer = server._broadcast_buffer
        last = buffer.message_counter - 1
        deadline = time.monotonic() + 15.0
        server.flush()
        while time.monotonic() < deadline:
            cursors = list(buffer.generator_cursors.values())
            pending = any(c.transport.get_write_buffer_size() for c in list(server._live_connections.values()))
            if not pending and all(cursor >= last for cursor in cursors):
                return
            time.sleep(0.002)

    # ---- objects

    def SetObject(self, *args: Any, **kwargs: Any) -> None:
        """Draws something at a path, in place of what was drawn there.

        Overloads:
            SetObject(path, shape, rgba=Rgba(0.9, 0.9, 0.9))
            SetObject(path, mesh, rgba=Rgba(0.1, 0.1, 0.1), wireframe=False, wireframe_line_width=1.0,
                side=kDoubleSide), for a TriangleSurfaceMesh
            SetObject(path, cloud, point_size=0.001, rgba=Rgba(0.9, 0.9, 0.9)), for a PointCloud

        Raises:
            RuntimeError: when a mesh file is missing or cannot be read.
            TypeError: when the arguments fit no overload.
        """
        names = [n for n in ("shape", "mesh", "cloud") if n in kwargs]
        if len(args) + ("path" in kwargs) + len(names) < 2:
            raise TypeError("Meshcat.SetObject(): expected a path and a shape, a mesh or a cloud.")
        path = kwargs.pop("path") if "path" in kwargs else args[0]
        rest = list(args if "path" not in kwargs and args and args[0] != path else args[1:])
        thing = kwargs.pop(names[0]) if names else rest.pop(0)
        if isinstance(thing, Shape):
            self._set_shape(path, thing, *rest, **kwargs)
        elif hasattr(thing, "xyzs"):
            self._set_cloud(path, thing, *rest, **kwargs)
        elif hasattr(thing, "num_triangles"):
            self._set_surface(path, thing, *rest, **kwargs)
        else:
            raise TypeError(
                f"Meshcat.SetObject(): expected a Shape, a TriangleSurfaceMesh or a PointCloud, got "
                f"{type(thing).__name__}."
            )

    def _set_shape(self, path: str, shape: Shape, rgba: Rgba | None = None) -> None:
        rgba = Rgba(0.9, 0.9, 0.9, 1.0) if rgba is None else rgba.__copy__()
        self._hub.tree.set_object(full_path(path), drawable_of_shape(shape, rgba))

    def _set_cloud(self, path: str, cloud: Any, point_size: float = 0.001, rgba: Rgba | None = None) -> None:
        points = np.array(cloud.xyzs(), dtype=float).T
        rgba = Rgba(0.9, 0.9, 0.9, 1.0) if rgba is None else rgba.__copy__()
        if cloud.has_rgbs():
            colors = np.array(cloud.rgbs(), dtype=np.uint8).T
        else:
            colors = np.round(255 * rgba.rgba[:3]).astype(np.uint8)
        finite = np.isfinite(points).all(axis=1)
        points, colors = points[finite], colors if colors.ndim == 1 else colors[finite]
        self._hub.tree.set_object(full_path(path), Points(points, colors, float(point_size), rgba))

    def _set_surface(self, path: str, mesh: Any, rgba: Rgba | None = None, *args: Any, **kwargs: Any) -> None:
        vertices = np.array([mesh.vertex(v) for v in range(mesh.num_vertices())], dtype=float).T
        faces = [[mesh.element(t).vertex(i) for i in range(3)] for t in range(mesh.num_triangles())]
        self.SetTriangleMesh(path, vertices, np.array(faces).T, rgba, *args, **kwargs)

    def SetTriangleMesh(
        self,
        path: str,
        vertices: Any,
        faces: Any,
        rgba: Rgba | None = None,
        wireframe: bool = False,
        wireframe_line_width: float = 1.0,
        side: SideOfFaceToRender = SideOfFaceToRender.kDoubleSide,
    ) -> None:
        """Draws a triangle mesh.

        Args:
            path: Path in the scene.
            vertices: Positions [m], shape (3, n).
            faces: Vertex numbers, shape (3, m).
            rgba: Color; dark grey when left out.
            wireframe: Whether only the edges are drawn.
            wireframe_line_width: Width of edges in pixels; pages draw 1.
            side: Which side of the faces is seen.

        Raises:
            ValueError: when a shape is wrong, or a face names a vertex that does not exist.
        """
        rgba = Rgba(0.1, 0.1, 0.1, 1.0) if rgba is None else rgba.__copy__()
        self._set_triangles("SetTriangleMesh", path, vertices, faces, rgba, wireframe, side)

    def SetTriangleColorMesh(
        self,
        path: str,
        vertices: Any,
        faces: Any,
        colors: Any,
        wireframe: bool = False,
        wireframe_line_width: float = 1.0,
        side: SideOfFaceToRender = SideOfFaceToRender.kDoubleSide,
    ) -> None:
        """Draws a triangle mesh with a color at each vertex.

        Args:
            path: Path in the scene.
            vertices: Positions [m], shape (3, n).
            faces: Vertex numbers, shape (3, m).
            colors: Red, green, blue in [0, 1] of each vertex, shape (3, n).
            wireframe: Whether only the edges are drawn.
            wireframe_line_width: Width of edges in pixels; pages draw 1.
            side: Which side of the faces is seen.

        Raises:
            ValueError: when a shape is wrong, or a face names a vertex that does not exist.
        """
        colors = _array3("SetTriangleColorMesh", "colors", colors).T.copy()
        if len(colors) != np.shape(vertices)[1]:
            raise ValueError(
                f"Meshcat.SetTriangleColorMesh(): {np.shape(vertices)[1]} vertices but {len(colors)} colors."
            )
        rgba = Rgba(*np.clip(colors.mean(axis=0), 0, 1)) if len(colors) else Rgba()
        self._set_triangles("SetTriangleColorMesh", path, vertices, faces, rgba, wireframe, side, colors)

    def _set_triangles(
        self,
        call: str,
        path: str,
        vertices: Any,
        faces: Any,
        rgba: Rgba,
        wireframe: bool,
        side: SideOfFaceToRender,
        colors: np.ndarray | None = None,
    ) -> None:
        vertices = _array3(call, "vertices", vertices).T.copy()
        faces = _array3(call, "faces", faces, dtype=np.int64).T.copy()
        if faces.size and (faces.min() < 0 or faces.max() >= len(vertices)):
            raise ValueError(
                f"Meshcat.{call}(): faces name vertices {faces.min()} to {faces.max()}, but there are {len(vertices)}."
            )
        drawable = Triangles(vertices, faces, rgba, bool(wireframe), _SIDES[SideOfFaceToRender(side)], colors)
        self._hub.tree.set_object(full_path(path), drawable)

    def PlotSurface(
        self,
        path: str,
        X: Any,
        Y: Any,
        Z: Any,
        rgba: Rgba | None = None,
        wireframe: bool = False,
        wireframe_line_width: float = 1.0,
    ) -> None:
        """Draws a surface over a grid of points, as matplotlib's plot_surface does.

        Args:
            path: Path in the scene.
            X: x of the points [m], shape (rows, columns).
            Y: y of the points [m], shape (rows, columns).
            Z: z of the points [m], shape (rows, columns).
            rgba: Color; blue when left out.
            wireframe: Whether only the edges are drawn.
            wireframe_line_width: Width of edges in pixels; pages draw 1.

        Raises:
            ValueError: when the shapes differ or have fewer than two rows or columns.
        """
        X, Y, Z = (np.asarray(a, dtype=float) for a in (X, Y, Z))
        if not (X.shape == Y.shape == Z.shape and X.ndim == 2 and min(X.shape) >= 2):
            raise ValueError(
                f"Meshcat.PlotSurface(): X, Y, Z must have one shape, at least (2, 2); got {X.shape}, {Y.shape}, "
                f"{Z.shape}."
            )
        rgba = Rgba(0.1, 0.1, 0.9, 1.0) if rgba is None else rgba
        vertices, faces = surface_grid(X, Y, Z)
        self.SetTriangleMesh(path, vertices.T, faces.T, rgba, wireframe, wireframe_line_width)

    def SetLine(self, path: str, vertices: Any, line_width: float = 1.0, rgba: Rgba | None = None) -> None:
        """Draws a line from point to point.

        Args:
            path: Path in the scene.
            vertices: The points [m], shape (3, n).
            line_width: Width in pixels.
            rgba: Color; dark grey when left out.

        Raises:
            ValueError: when the shape is wrong.
        """
        points = _array3("SetLine", "vertices", vertices).T
        segments = np.stack([points[:-1], points[1:]], axis=1)
        self._set_lines(path, segments, line_width, rgba)

    def SetLineSegments(
        self, path: str, start: Any, end: Any, line_width: float = 1.0, rgba: Rgba | None = None
    ) -> None:
        """Draws separate line segments.

        Args:
            path: Path in the scene.
            start: Where each starts [m], shape (3, n).
            end: Where each ends [m], shape (3, n).
            line_width: Width in pixels.
            rgba: Color; dark grey when left out.

        Raises:
            ValueError: when a shape is wrong or the shapes differ.
        """
        start, end = _array3("SetLineSegments", "start", start), _array3("SetLineSegments", "end", end)
        if start.shape != end.shape:
            raise ValueError(
                f"Meshcat.SetLineSegments(): start and end must have one shape, got {start.shape} and {end.shape}."
            )
        self._set_lines(path, np.stack([start.T, end.T], axis=1), line_width, rgba)

    def _set_lines(self, path: str, segments: np.ndarray, width: float, rgba: Rgba | None) -> None:
        rgba = Rgba(0.1, 0.1, 0.1, 1.0) if rgba is None else rgba.__copy__()
        self._hub.tree.set_object(full_path(path), Lines(segments.copy(), float(width), rgba))

    # ---- poses, properties, paths

    def SetTransform(self, *args: Any, **kwargs: Any) -> None:
        """Places a path, and everything below it, in its parent.

        Overloads:
            SetTransform(path, X_ParentPath, time_in_recording=None)
            SetTransform(path, matrix), a homogeneous matrix, shape (4, 4), that may also stretch

        While recording, a pose with a time_in_recording [s] goes into the recording.

        Raises:
            TypeError: when the arguments fit no overload.
        """
        path, X, time = _transform_arguments(*args, **kwargs)
        path = full_path(path)
        if isinstance(X, np.ndarray):
            self._hub.tree.set_pose(path, X)
            return
        pose = np.array(X.GetAsMatrix34(), dtype=float)
        hub = self._hub
        if hub.recording and time is not None:
            hub.animation._set_pose(hub.animation.frame(time), path, pose)
            if not hub.show_while_recording:
                return
        hub.tree.set_pose(path, pose)

    def _set_poses(self, paths: list[str], poses: np.ndarray, time: float | None = None) -> None:
        """Places many full paths at once; poses of shape (n, 3, 4) that the caller will not change."""
        hub = self._hub
        if hub.recording and time is not None:
            frame = hub.animation.frame(time)
            for path, pose in zip(paths, poses):
                hub.animation._set_pose(frame, path, pose)
            if not hub.show_while_recording:
                return
        hub.tree.set_poses(paths, poses)

    def SetProperty(self, path: str, property: str, value: Any, time_in_recording: float | None = None) -> None:
        """Sets a property of a path.

        The page shows "visible", "color", "opacity", "modulated_opacity", "position", "quaternion"
        and "scale" of anything; "visible" of "/Grid", "/Axes", "/Background" and "/Lights";
        "top_color" and "bottom_color" of "/Background"; "fov", "zoom" and "position" of the camera.
        Other properties are kept, and it is said once that the page cannot show them.

        Args:
            path: Path in the scene.
            property: Name of the property.
            value: A bool, a number or a list of numbers.
            time_in_recording: While recording, the time [s] at which the value goes into it.

        Raises:
            TypeError: when the value is of another type.
        """
        if isinstance(value, (bool, np.bool_)):
            value = bool(value)
        elif isinstance(value, (int, float, np.integer, np.floating)):
            value = float(value)
        elif isinstance(value, (list, tuple, np.ndarray)):
            value = [float(v) for v in value]
        elif not (isinstance(value, str) and property == "environment_map"):
            raise TypeError(
                f"Meshcat.SetProperty(): value of '{property}' must be a bool, a number or a list of numbers, got "
                f"{type(value).__name__}."
            )
        hub, full = self._hub, full_path(path)
        if hub.recording and time_in_recording is not None:
            hub.animation.SetProperty(hub.animation.frame(time_in_recording), full, property, value)
            if not hub.show_while_recording:
                return
        hub.tree.set_property(full, property, value)
        if property in ("position", "quaternion", "scale") and not full.startswith("/Cameras"):
            self._place(full, property, value)

    def _place(self, path: str, property: str, value: Any) -> None:
        """Gives a path the position, the quaternion (x, y, z, w) or the scale of a property."""
        element = self._hub.tree.get(path)
        M = np.eye(4) if element is None or element.pose is None else as_matrix4(element.pose).copy()
        values = np.broadcast_to(np.asarray(value, dtype=float), (4 if property == "quaternion" else 3,))
        lengths = np.linalg.norm(M[:3, :3], axis=0)
        if property == "position":
            M[:3, 3] = values
        elif property == "quaternion":
            x, y, z, w = values / np.linalg.norm(values)
            R = np.array(
                [
                    [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                    [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                    [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
                ]
            )
            M[:3, :3] = R * lengths
        else:
            M[:3, :3] = M[:3, :3] / np.where(lengths > 0, lengths, 1.0) * values
        self._hub.tree.set_pose(path, M)

    def HasPath(self, path: str) -> bool:
        """Returns whether something was set at or below a path."""
        return self._hub.tree.has_path(full_path(path))

    def Delete(self, path: str = "") -> None:
        """Removes a path and everything below it; without a path, everything below "/drake"."""
        self._hub.tree.delete(full_path(path))

    # ---- camera, surroundings

    def SetCamera(self, camera: PerspectiveCamera | OrthographicCamera, path: str = "/Cameras/default/rotated") -> None:
        """Sets the camera's lens. An orthographic one is drawn by a far camera with a narrow field of view.

        Raises:
            TypeError: when it is no camera.
        """
        stage = self._hub.page.stage
        if isinstance(camera, PerspectiveCamera):
            stage.set_field_of_view(2 * np.arctan(np.tan(np.radians(camera.fov) / 2) / camera.zoom))
        elif isinstance(camera, OrthographicCamera):
            half = abs(camera.top - camera.bottom) / 2 / camera.zoom
            fov = np.radians(2.0)
            away = stage.position - stage.target
            distance = max(float(np.linalg.norm(away)), 1e-9)
            stage.set_field_of_view(fov)
            stage.set_camera(stage.target + away / distance * half / np.tan(fov / 2), stage.target)
        else:
            raise TypeError(f"Meshcat.SetCamera(): expected a camera, got {type(camera).__name__}.")

    def SetCameraPose(self, camera_in_world: Any, target_in_world: Any) -> None:
        """Places the camera and what it looks at, in the world [m], shape (3,) each."""
        position = np.asarray(camera_in_world, dtype=float).reshape(3)
        self._hub.page.stage.set_camera(position, np.asarray(target_in_world, dtype=float).reshape(3))

    def SetCameraTarget(self, target_in_world: Any) -> None:
        """Turns the camera to a point in the world [m], shape (3,)."""
        self._hub.page.stage.set_camera(None, np.asarray(target_in_world, dtype=float).reshape(3))

    def GetTrackedCameraPose(self) -> Any:
        """Returns the camera's RigidTransform in the world (x right, y down, z forward) in the page opened
        with "?tracked_camera=on", None while there is no such page."""
        from sheldrake.common.eigen_geometry import Quaternion
        from sheldrake.math import RigidTransform, RotationMatrix

        pose = self._hub.controls.tracked_camera_pose()
        if pose is None:
            return None
        if len(pose) == 2:
            wxyz, position = pose
            return RigidTransform(RotationMatrix(Quaternion(wxyz=wxyz / np.linalg.norm(wxyz))), position)
        # Meshcat's own message: a column-major matrix in three.js's axes (+y up; camera x right, y up, -z forward).
        M = np.array(pose, dtype=float).reshape(4, 4).T
        up = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
        R = up @ M[:3, :3] @ np.diag([1.0, -1.0, -1.0])
        return RigidTransform(RotationMatrix.ProjectToRotationMatrix(R), up @ M[:3, 3])

    def Set2dRenderMode(
        self, X_WC: Any = None, xmin: float = -1.0, xmax: float = 1.0, ymin: float = -1.0, ymax: float = 1.0
    ) -> None:
        """Looks along +Cy at a rectangle of the Cx-Cz plane, and hides background, grid and axes.

        Args:
            X_WC: RigidTransform of the camera; at (0, -1, 0) when left out.
            xmin: Left edge of the rectangle [m].
            xmax: Right edge [m].
            ymin: Lower edge, along Cz [m].
            ymax: Upper edge, along Cz [m].
        """
        matrix = np.eye(4)
        if X_WC is None:
            matrix[1, 3] = -1.0
        else:
            matrix[:3] = X_WC.GetAsMatrix34()
        self._hub.page.stage.view_flat(matrix, float(xmin), float(xmax), float(ymin), float(ymax))

    def ResetRenderMode(self) -> None:
        """Shows background, grid and axes again, through the usual camera."""
        self._hub.page.stage.reset()

    def SetEnvironmentMap(self, image_path: str | os.PathLike) -> None:
        """Keeps an image for reflections; this page has presets only, so it says that it cannot show it.

        Raises:
            RuntimeError: when the file cannot be opened.
        """
        text = os.fspath(image_path)
        if text and not Path(text).is_file():
            raise RuntimeError(f"Meshcat.SetEnvironmentMap(): cannot open '{text}'.")
        self.SetProperty("/Background/<object>", "environment_map", text)

    # ---- time

    def SetRealtimeRate(self, rate: float) -> None:
        """Shows how fast simulated time runs; 1 is real time."""
        self._rate = float(rate)
        if self._hub.status is not None:
            self._hub.status.show(None, self._rate)

    def GetRealtimeRate(self) -> float:
        """Returns the rate that was shown last."""
        return self._rate

    def SetSimulationTime(self, sim_time: float) -> None:
        """Says what simulation time [s] is shown, from which the realtime rate is measured."""
        rate = self._rate_calculator.update(float(sim_time))
        if rate is not None:
            self._rate = rate
        if self._hub.status is not None:
            self._hub.status.show(float(sim_time), rate)

    # ---- controls

    def AddButton(self, name: str, keycode: str = "") -> None:
        """Adds a button; one that exists starts counting from zero again.

        Args:
            name: Label.
            keycode: Key that also presses it, by its name in JavaScript ("KeyG", "ArrowLeft").

        Raises:
            RuntimeError: when a slider has the name, or the button has another keycode.
        """
        self._hub.controls.add_button(name, keycode)

    def GetButtonClicks(self, name: str) -> int:
        """Returns how often a button was pressed, in all pages together.

        Raises:
            RuntimeError: when there is no such button.
        """
        return self._hub.controls.button_clicks(name)

    def GetButtonNames(self) -> list[str]:
        """Returns the names of all buttons."""
        return self._hub.controls.button_names()

    def DeleteButton(self, name: str, strict: bool = True) -> bool:
        """Removes a button; returns whether it was there.

        Raises:
            RuntimeError: when it was not, and `strict`.
        """
        return self._hub.controls.delete_button(name, strict)

    def AddSlider(
        self,
        name: str,
        min: float,
        max: float,
        step: float,
        value: float,
        decrement_keycode: str = "",
        increment_keycode: str = "",
    ) -> float:
        """Adds a slider and returns its value, kept in the range and rounded to a multiple of the step.

        Args:
            name: Label.
            min: Lowest value.
            max: Highest value.
            step: Least change.
            value: First value.
            decrement_keycode: Key that lowers it by a step, by its name in JavaScript.
            increment_keycode: Key that raises it by a step.

        Raises:
            RuntimeError: when the name is taken.
            ValueError: when the step is not positive or min is above max.
        """
        return self._hub.controls.add_slider(name, min, max, step, value, decrement_keycode, increment_keycode)

    def GetSliderValue(self, name: str) -> float:
        """Returns where a slider stands.

        Raises:
            RuntimeError: when there is no such slider.
        """
        return self._hub.controls.slider_value(name)

    def SetSliderValue(self, name: str, value: float) -> float:
        """Moves a slider in every page and returns the value it took.

        Raises:
            RuntimeError: when there is no such slider.
        """
        return self._hub.controls.set_slider_value(name, value)

    def GetSliderNames(self) -> list[str]:
        """Returns the names of all sliders."""
        return self._hub.controls.slider_names()

    def DeleteSlider(self, name: str, strict: bool = True) -> bool:
        """Removes a slider; returns whether it was there.

        Raises:
            RuntimeError: when it was not, and `strict`.
        """
        return self._hub.controls.delete_slider(name, strict)

    def DeleteAddedControls(self) -> None:
        """Removes every button and slider."""
        self._hub.controls.delete_all()

    def GetGamepad(self) -> Gamepad:
        """Returns the last state of a gamepad seen by a page; its index is None when there was none."""
        return self._hub.controls.gamepad()

    # ---- recording

    def StartRecording(self, frames_per_second: float = 64.0, set_visualizations_while_recording: bool = True) -> None:
        """Starts recording what is set with a time_in_recording, on top of what was recorded before.

        Args:
            frames_per_second: Rate of the recording [1/s].
            set_visualizations_while_recording: Whether the page shows it meanwhile, too.
        """
        hub = self._hub
        if hub.animation.frames_per_second() != frames_per_second:
            hub.animation = MeshcatAnimation(frames_per_second)
        hub.recording = True
        hub.show_while_recording = bool(set_visualizations_while_recording)

    def StopRecording(self) -> None:
        """Stops recording; what was recorded stays."""
        self._hub.recording = False

    def PublishRecording(self) -> None:
        """Plays what was recorded in the page and puts it into StaticHtml()."""
        self.SetAnimation(self._hub.animation)

    def DeleteRecording(self) -> None:
        """Forgets what was recorded; a page that plays it goes on."""
        self._hub.animation = MeshcatAnimation(self._hub.animation.frames_per_second())

    def get_mutable_recording(self) -> MeshcatAnimation:
        """Returns the recording, valid until DeleteRecording()."""
        return self._hub.animation

    def SetAnimation(self, animation: MeshcatAnimation) -> None:
        """Plays an animation in the page, with a time slider, and puts it into StaticHtml()."""
        hub = self._hub
        hub.page.sync()
        with hub.lock:
            if hub.player is not None:
                hub.player.stop()
                hub.player = None
            hub.published = animation
            if animation._num_frames() > 0:
                hub.player = Player(hub.page, animation)

    def StaticHtml(self) -> str:
        """Returns the scene, with the published animation, as one HTML page that needs no network."""
        return self._hub.static_html()

    def StaticZip(self) -> bytes:
        """Returns the same as a ZIP file with the page and the scene apart, to be put on a web server."""
        return self._hub.static_zip()

    def _InjectWebsocketMessage(self, message: bytes) -> None:
        """Acts as if a page had sent a message in Meshcat's own format; for tests."""
        import msgspec

        try:
            self._hub.controls.receive(msgspec.msgpack.decode(message))
        except (msgspec.MsgspecError, ValueError, TypeError, KeyError) as error:
            log.warning("Meshcat: a page sent something unreadable: %s", error)

    def _repr_html_(self) -> str:
        """Shows the page inside a notebook."""
        return f'<iframe src="{self._web_url}" style="width:100%; height:480px; border:0"></iframe>'


def _transform_arguments(
    path: str, X_ParentPath: Any = None, time_in_recording: float | None = None, *, matrix: Any = None
) -> tuple[str, Any, float | None]:
    """Sorts out the two overloads of SetTransform; a matrix comes back as an array of its own."""
    given = X_ParentPath if matrix is None else matrix
    if hasattr(given, "GetAsMatrix34"):
        return path, given, time_in_recording
    array = np.array(given, dtype=float) if isinstance(given, (np.ndarray, list, tuple)) else None
    if array is None or array.shape != (4, 4) or time_in_recording is not None:
        found = type(given).__name__ if array is None else f"an array of shape {array.shape}"
        raise TypeError(
            f"Meshcat.SetTransform(): expected a RigidTransform (with an optional time_in_recording) or a matrix of "
            f"shape (4, 4), got {found}."
        )
    return path, array, None


def StartMeshcat() -> Meshcat:
    """Returns a Meshcat on the first free port."""
    return Meshcat()
