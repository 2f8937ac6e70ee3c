"""What Meldis shows besides bodies: contacts, point clouds, and frames."""

from __future__ import annotations

from typing import Any

import numpy as np

from sheldrake.common.eigen_geometry import Quaternion
from sheldrake.geometry import Cylinder, Meshcat, Rgba
from sheldrake.geometry._point_cloud import BaseField, Fields, PointCloud
from sheldrake.lcm._contact_messages import (
    lcmt_contact_results_for_viz,
    lcmt_hydroelastic_contact_surface_for_viz,
)
from sheldrake.lcm._point_cloud_messages import lcmt_point_cloud, lcmt_point_cloud_field
from sheldrake.lcm._viewer_messages import lcmt_viewer_draw
from sheldrake.math import RigidTransform, RotationMatrix
from sheldrake.multibody.meshcat import ContactVisualizerParams
from sheldrake.multibody.meshcat._contact_items import fan, name_of_side
from sheldrake.multibody.meshcat._hydroelastic_arrows import (
    _HydroelasticContactVisualizer,
    _HydroelasticContactVisualizerItem,
)
from sheldrake.multibody.meshcat._point_contact_arrows import _PointContactVisualizer, _PointContactVisualizerItem

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


def pose_of(position: Any, quaternion: Any) -> RigidTransform:
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
