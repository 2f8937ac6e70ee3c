"""PointCloudToLcm: point clouds as messages for other processes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common.value import AbstractValue
from sheldrake.geometry._point_cloud import PointCloud
from sheldrake.lcm._messages import lcmt_point_cloud, lcmt_point_cloud_field
from sheldrake.systems.framework import LeafSystem

if TYPE_CHECKING:
    from sheldrake.systems.framework import Context

_ALIGNMENT = 16  # of the points in an encoded message [bytes]


@checked
class PointCloudToLcm(LeafSystem):
    """Turns point clouds into messages that viewers know; points that are not finite are left out.

    Ports: the input "point_cloud"; the output "lcmt_point_cloud", for an LcmPublisherSystem.

    Args:
        frame_name: Name of the frame that the points are in.
    """

    def __init__(self, frame_name: str = ""):
        super().__init__()
        self._frame_name = frame_name
        self.DeclareAbstractInputPort("point_cloud", AbstractValue.Make(PointCloud()))
        self.DeclareAbstractOutputPort("lcmt_point_cloud", lambda: AbstractValue.Make(lcmt_point_cloud()), self._calc)

    def _calc(self, context: Context, output: AbstractValue) -> None:
        message = _message(self.get_input_port(0).Eval(context), self._frame_name)
        message.utime = int(context.get_time() * 1e6)
        output.set_value(message)


def _message(cloud: PointCloud, frame_name: str) -> Any:
    if not cloud.has_xyzs():
        raise RuntimeError("PointCloudToLcm: the cloud has no xyzs.")
    columns = [(name, "<f4", row) for name, row in zip("xyz", cloud.xyzs())]
    if cloud.has_rgbs():
        r, g, b = cloud.rgbs().astype("<u4")
        columns.append(("rgb", "<u4", r | g << 8 | b << 16))
    if cloud.has_normals():
        columns += [(f"normal_{name}", "<f4", row) for name, row in zip("xyz", cloud.normals())]
    (finite,) = np.nonzero(np.isfinite(cloud.xyzs()).all(axis=0))
    points = np.empty(len(finite), [(name, kind) for name, kind, _ in columns])
    for name, _, row in columns:
        points[name] = row[finite]
    step, data = points.itemsize, points.tobytes()
    message: Any = lcmt_point_cloud(
        frame_name=frame_name,
        width=len(points),
        height=1,
        num_fields=len(columns),
        fields=[_field(name, points.dtype) for name, *_ in columns],
        flags=lcmt_point_cloud.IS_STRICTLY_FINITE,
        point_step=step,
        row_step=step * len(points),
    )
    message.filler_size = -len(message.encode()) % _ALIGNMENT
    message.filler = bytes(message.filler_size)
    message.data_size, message.data = len(data), data
    return message


def _field(name: str, kinds: np.dtype) -> lcmt_point_cloud_field:
    kind, offset = kinds.fields[name][:2]  # type: ignore[index]
    number = lcmt_point_cloud_field.FLOAT32 if kind.kind == "f" else lcmt_point_cloud_field.UINT32
    return lcmt_point_cloud_field(name=name, byte_offset=offset, datatype=number, count=1)
