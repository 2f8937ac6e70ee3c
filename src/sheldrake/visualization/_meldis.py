"""Meldis: a page that shows what simulations in other processes publish."""

from __future__ import annotations

import copy
import functools
import logging
import os
import sys
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._ctrl_c import deferred_ctrl_c
from sheldrake.common.eigen_geometry import Quaternion
from sheldrake.geometry import Cylinder, Mesh, Meshcat, MeshcatParams, Rgba, Shape
from sheldrake.geometry._drake_visualizer import DRAW_CHANNEL, LOAD_CHANNEL
from sheldrake.geometry._point_cloud import BaseField, Fields, PointCloud
from sheldrake.geometry._shape_types import SHAPE_TYPES
from sheldrake.lcm import DrakeLcm
from sheldrake.lcm._messages import (
    lcmt_contact_results_for_viz,
    lcmt_hydroelastic_contact_surface_for_viz,
    lcmt_point_cloud,
    lcmt_point_cloud_field,
    lcmt_viewer_draw,
    lcmt_viewer_geometry_data,
    lcmt_viewer_load_robot,
)
from sheldrake.math import RigidTransform, RotationMatrix
from sheldrake.multibody.meshcat import ContactVisualizerParams
from sheldrake.multibody.meshcat._contact_items import fan, name_of_side
from sheldrake.multibody.meshcat._hydroelastic_arrows import (
    _HydroelasticContactVisualizer,
    _HydroelasticContactVisualizerItem,
)
from sheldrake.multibody.meshcat._point_contact_arrows import _PointContactVisualizer, _PointContactVisualizerItem

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

CONTACTS, CLOUDS, FRAMES = "CONTACT_RESULTS", "DRAKE_POINT_CLOUD", "DRAKE_DRAW_FRAMES"
"""Channels; those of point clouds begin so."""

_POINT_SIZE = 0.003  # [m]
_TRIAD_LENGTH = 0.25  # [m]
_AXIS_COLORS = (Rgba(1, 0, 0), Rgba(0, 1, 0), Rgba(0, 0, 1))
_KINDS = {
    lcmt_point_cloud_field.INT8: "i1",
    lcmt_point_cloud_field.UINT8: "u1",
    lcmt_point_cloud_field.INT16: "i2",
    lcmt_point_cloud_field.UINT16: "u2",
    lcmt_point_cloud_field.INT32: "i4",
    lcmt_point_cloud_field.UINT32: "u4",
    lcmt_point_cloud_field.FLOAT32: "f4",
    lcmt_point_cloud_field.FLOAT64: "f8",
}


def pose_of(position: ArrayLike, quaternion: ArrayLike) -> RigidTransform:
    """The pose of a message, whose numbers are rounded: its quaternion is not quite of length one."""
    q = np.array(quaternion, dtype=float)
    return RigidTransform(Quaternion(q / np.linalg.norm(q)), np.array(position, dtype=float))


class ContactDisplay:
    """Draws contacts as a ContactVisualizer does.

    Args:
        meshcat: Where to draw.
    """

    def __init__(self, meshcat: Meshcat):
        self._points = _PointContactVisualizer(meshcat, ContactVisualizerParams(prefix=f"/{CONTACTS}/point"))
        self._surfaces = _HydroelasticContactVisualizer(
            meshcat, ContactVisualizerParams(prefix=f"/{CONTACTS}/hydroelastic")
        )

    def show(self, raw: bytes) -> None:
        """Draws the contacts of a message and no others."""
        message = lcmt_contact_results_for_viz.decode(raw)
        time = message.timestamp / 1e6
        points = [
            _PointContactVisualizerItem(
                p.body1_name, p.body2_name, np.array(p.contact_force), np.array(p.contact_point)
            )
            for p in message.point_pair_contact_info
        ]
        self._points.Update(time, points)
        self._surfaces.Update(time, [_surface_item(surface) for surface in message.hydroelastic_contacts])


def _surface_item(surface: lcmt_hydroelastic_contact_surface_for_viz) -> _HydroelasticContactVisualizerItem:
    """A surface, its polygons cut into triangles.

    Raises:
        ValueError: a polygon has vertices that are not there.
    """
    faces, data, at = [], surface.poly_data, 0
    while at < len(data):
        ring = data[at + 1 : at + 1 + data[at]]
        if len(ring) != data[at] or len(ring) < 3 or min(ring) < 0 or max(ring) >= surface.num_vertices:
            raise ValueError(f"a contact surface of {surface.num_vertices} vertices has the polygon {ring}")
        faces += fan(ring)
        at += 1 + len(ring)
    return _HydroelasticContactVisualizerItem(
        _side(surface, 1),
        _side(surface, 2),
        np.array(surface.centroid_W),
        np.array(surface.force_C_W),
        np.array(surface.moment_C_W),
        np.array([(p.x, p.y, p.z) for p in surface.p_WV]).reshape(-1, 3).T,
        np.array(faces, dtype=np.int64).reshape(-1, 3).T,
        np.array(surface.pressure),
    )


def _side(surface: lcmt_hydroelastic_contact_surface_for_viz, i: int) -> str:
    return name_of_side(
        getattr(surface, f"body{i}_name"),
        None if getattr(surface, f"body{i}_unique") else getattr(surface, f"model{i}_name"),
        getattr(surface, f"geometry{i}_name") if getattr(surface, f"collision_count{i}") > 1 else None,
    )


class CloudDisplay:
    """Draws point clouds, those of channels with a suffix below their own paths.

    Args:
        meshcat: Where to draw.
    """

    def __init__(self, meshcat: Meshcat):
        self._meshcat = meshcat

    def show(self, channel: str, raw: bytes) -> None:
        """Draws a cloud in the place of the channel's last one."""
        suffix = channel.removeprefix(CLOUDS).strip("_")
        path = f"/POINT_CLOUD/{suffix or 'default'}"
        self._meshcat.SetObject(path, cloud_of(lcmt_point_cloud.decode(raw)), _POINT_SIZE)


def cloud_of(message: lcmt_point_cloud) -> PointCloud:
    """The cloud that a message carries, with its colors and normals.

    Raises:
        ValueError: it has no x, y, z, or not as many bytes as it says.
    """
    order = ">" if message.flags & lcmt_point_cloud.IS_BIGENDIAN else "<"
    known = [f for f in message.fields if f.datatype in _KINDS and f.count == 1]
    layout: Any = {
        "names": [f.name for f in known],
        "formats": [order + _KINDS[f.datatype] for f in known],
        "offsets": [f.byte_offset for f in known],
        "itemsize": message.point_step,
    }
    kinds = np.dtype(layout)
    rows, row = message.height, message.width * message.point_step
    if min(rows, row) < 0 or message.row_step < row or len(message.data) < rows * message.row_step:
        raise ValueError(f"a cloud of {rows} x {message.width} points has {len(message.data)} bytes")
    if not {"x", "y", "z"} <= set(kinds.names or ()):
        raise ValueError(f"a cloud has no x, y, z but {', '.join(kinds.names or ()) or 'nothing'}")
    parts = [message.data[k * message.row_step : k * message.row_step + row] for k in range(rows)]
    points = np.frombuffer(b"".join(parts), kinds)
    fields, normals = int(BaseField.kXYZs), [f"normal_{axis}" for axis in "xyz"]
    fields |= BaseField.kRGBs if "rgb" in kinds.fields else 0  # type: ignore[operator]
    fields |= BaseField.kNormals if set(normals) <= set(kinds.names or ()) else 0
    cloud = PointCloud(len(points), Fields(fields))
    cloud.mutable_xyzs()[:] = [points[axis] for axis in "xyz"]
    if cloud.has_rgbs():
        cloud.mutable_rgbs()[:] = [points["rgb"].astype(np.uint32) >> shift & 255 for shift in (0, 8, 16)]
    if cloud.has_normals():
        cloud.mutable_normals()[:] = [points[name] for name in normals]
    return cloud


class FrameDisplay:
    """Draws frames as three axes.

    Args:
        meshcat: Where to draw.
    """

    def __init__(self, meshcat: Meshcat):
        self._meshcat = meshcat
        self._drawn: set[str] = set()

    def show(self, raw: bytes) -> None:
        """Draws the frames of a message, and no others."""
        message = lcmt_viewer_draw.decode(raw)
        seen = set()
        for name, number, p, q in zip(message.link_name, message.robot_num, message.position, message.quaternion):
            path = f"/{FRAMES}/{number}/{name.replace('::', '/')}"
            seen.add(path)
            if path not in self._drawn:
                self._draw(path)
            self._meshcat.SetTransform(path, pose_of(p, q))
        for path in self._drawn - seen:
            self._meshcat.Delete(path)
        self._drawn = seen

    def _draw(self, path: str) -> None:
        for name, axis, color in zip("xyz", np.eye(3), _AXIS_COLORS):
            shaft = f"{path}/{name}-axis"
            self._meshcat.SetObject(shaft, Cylinder(_TRIAD_LENGTH / 50, _TRIAD_LENGTH), color)
            X = RigidTransform(RotationMatrix.MakeFromOneVector(axis, 2), _TRIAD_LENGTH / 2 * axis)
            self._meshcat.SetTransform(shaft, X)


log = logging.getLogger("drake")

_PERIOD = 1 / 40.0  # least time between two pictures [s]
_SHAPES: dict[int, Callable[..., Shape]] = {
    getattr(lcmt_viewer_geometry_data, row.viewer): row.shape for row in SHAPE_TYPES.values() if row.viewer
}


class _Viewer:
    """Draws the links of one channel below a path.

    Args:
        meshcat: Where to draw.
        path: Below what.
        visible: Whether it is seen at first.
        alpha: How opaque at first.
    """

    def __init__(self, meshcat: Meshcat, path: str, visible: bool = True, alpha: float = 1.0):
        self._meshcat, self._path, self._visible = meshcat, path, visible
        self._slider = f"{path.strip('/')} α"
        self._first_alpha, self._alpha = alpha, 1.0
        self._loaded = b""

    def load(self, raw: bytes) -> None:
        """Draws all links anew; links that are drawn already stay."""
        if raw == self._loaded:
            return
        message = lcmt_viewer_load_robot.decode(raw)
        self._meshcat.Delete(self._path)
        if not self._loaded:
            self._meshcat.AddSlider(self._slider, 0.0, 1.0, 0.02, self._first_alpha)
        self._loaded = raw
        for link in message.link:
            for k, geometry in enumerate(link.geom):
                path = f"{self._link_path(link.robot_num, link.name)}/{k}"
                try:
                    self._draw(path, geometry)
                except (RuntimeError, ValueError) as error:
                    log.warning("Meldis: a shape of '%s' cannot be drawn: %s", link.name, error)
        self._meshcat.SetProperty(self._path, "visible", self._visible)
        self._alpha = 1.0
        self.poll()

    def move(self, raw: bytes) -> None:
        """Moves the links."""
        message = lcmt_viewer_draw.decode(raw)
        self._meshcat.SetSimulationTime(message.timestamp / 1000.0)
        for name, number, p, q in zip(message.link_name, message.robot_num, message.position, message.quaternion):
            self._meshcat.SetTransform(self._link_path(number, name), pose_of(p, q))

    def poll(self) -> None:
        """Follows the slider."""
        alpha = self._meshcat.GetSliderValue(self._slider) if self._loaded else self._alpha
        if alpha != self._alpha:
            self._alpha = alpha
            self._meshcat.SetProperty(self._path, "modulated_opacity", alpha)

    def _link_path(self, number: int, name: str) -> str:
        return f"{self._path}/{number}/{name.replace('::', '/')}"

    def _draw(self, path: str, geometry: Any) -> None:
        color, numbers = Rgba(*np.clip(geometry.color, 0.0, 1.0)), geometry.float_data
        if geometry.type in _SHAPES:
            self._meshcat.SetObject(path, _SHAPES[geometry.type](*numbers), color)
        elif geometry.type != geometry.MESH:
            raise ValueError(f"there is no kind {geometry.type}")
        elif geometry.string_data:
            scale = np.array(numbers) if len(numbers) == 3 else np.full(3, numbers[0] if numbers else 1.0)
            self._meshcat.SetObject(path, Mesh(geometry.string_data, scale3=scale), color)
        else:
            count = int(numbers[0])
            vertices = np.reshape(numbers[2 : 2 + 3 * count], (count, 3))
            faces = np.reshape(numbers[2 + 3 * count :], (-1, 3)).astype(int)
            self._meshcat.SetTriangleMesh(path, vertices.T, faces.T, color)
        self._meshcat.SetTransform(path, pose_of(geometry.position, geometry.quaternion))


class Meldis:
    """A page that shows what other processes publish: bodies and where they are, contacts, point clouds, frames.

        Meldis(meshcat_port=7000).serve_forever()

    They publish with a DrakeVisualizer, with `ConnectContactResultsToDrakeVisualizer`, with a `PointCloudToLcm` on a
    channel that begins with DRAKE_POINT_CLOUD.

    Args:
        meshcat_host: What the page's server listens on.
        meshcat_port: Its port.
        meshcat_params: Its other settings.
        environment_map: An image for reflections.

    Attributes:
        meshcat: The page.
    """

    def __init__(
        self,
        *,
        meshcat_host: str | None = None,
        meshcat_port: int | None = None,
        meshcat_params: MeshcatParams | None = None,
        environment_map: str | os.PathLike | None = None,
    ):
        params = MeshcatParams() if meshcat_params is None else copy.deepcopy(meshcat_params)
        params.host = params.host if meshcat_host is None else meshcat_host
        params.port = params.port if meshcat_port is None else meshcat_port
        self.meshcat = Meshcat(params)
        if environment_map is not None:
            self.meshcat.SetEnvironmentMap(os.fspath(environment_map))
        self._lcm = DrakeLcm()
        self._waiting: dict[str, tuple[Callable[[bytes], None], bytes]] = {}  # the last message of each channel
        self._viewers: list[_Viewer] = []
        self._show("/DRAKE_VIEWER", "")
        self._show("/Visual Geometry", "_ILLUSTRATION")
        self._show("/Collision Geometry", "_PROXIMITY", visible=False, alpha=0.5)
        self._subscribe(CONTACTS, ContactDisplay(self.meshcat).show)
        self._subscribe(FRAMES, FrameDisplay(self.meshcat).show)
        clouds = CloudDisplay(self.meshcat)
        self._lcm.SubscribeMultichannel(
            f"{CLOUDS}.*", lambda channel, raw: self._note(channel, functools.partial(clouds.show, channel), raw)
        )

    def _show(self, path: str, suffix: str, **look: Any) -> None:
        viewer = _Viewer(self.meshcat, path, **look)
        self._viewers.append(viewer)
        for channel, handle in ((LOAD_CHANNEL + suffix, viewer.load), (DRAW_CHANNEL + suffix, viewer.move)):
            self._subscribe(channel, handle)

    def _subscribe(self, channel: str, handle: Callable[[bytes], None]) -> None:
        self._lcm.Subscribe(channel, lambda raw: self._note(channel, handle, raw))

    def _note(self, channel: str, handle: Callable[[bytes], None], raw: bytes) -> None:
        self._waiting[channel] = (handle, bytes(raw))

    def _invoke_subscriptions(self) -> None:
        """Shows what came last on each channel; loads come before draws."""
        waiting, self._waiting = self._waiting, {}
        for _, (handle, raw) in sorted(waiting.items(), key=lambda item: LOAD_CHANNEL not in item[0]):
            try:
                handle(raw)
            except ValueError as error:
                log.warning("Meldis: a message is not understood: %s", error)
        for viewer in self._viewers:
            viewer.poll()

    def serve_forever(self, *, idle_timeout: float | None = None) -> None:
        """Shows what is published, until Ctrl-C.

        Args:
            idle_timeout: The process exits after so long without a page [s]; None and zero stay for ever.

        Raises:
            KeyboardInterrupt: on Ctrl-C.
            SystemExit: when nobody has looked for so long.
        """
        seen = time.monotonic()
        with deferred_ctrl_c() as check:
            while True:
                check()
                end = time.monotonic() + _PERIOD
                while (left := end - time.monotonic()) > 0:
                    self._lcm.HandleSubscriptions(max(1, int(1000 * left)))
                self._invoke_subscriptions()
                if self.meshcat.GetNumActiveConnections():
                    seen = time.monotonic()
                elif idle_timeout and time.monotonic() - seen > idle_timeout:
                    log.info("Meldis: nobody has looked for %g s; it ends.", idle_timeout)
                    sys.exit(0)
