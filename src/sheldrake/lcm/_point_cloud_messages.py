"""Messages that carry point clouds; each tells what it says of its points, as PCL and ROS do."""

from __future__ import annotations

from typing import ClassVar

from sheldrake.lcm._messages import Message


class lcmt_point_cloud_field(Message):
    """One channel of a cloud: where it is in the bytes of a point, and of what type."""

    INT8, UINT8, INT16, UINT16, INT32, UINT32, FLOAT32, FLOAT64 = 1, 2, 3, 4, 5, 6, 7, 8

    _fields: ClassVar[list[tuple]] = [
        ("name", "string"),
        ("byte_offset", "int32_t"),
        ("datatype", "int8_t"),
        ("count", "int32_t"),
    ]


class lcmt_point_cloud(Message):
    """A cloud at a time [us], in a frame; the bytes of its points are in `data`."""

    IS_BIGENDIAN, IS_STRICTLY_FINITE = 1, 2

    _fields: ClassVar[list[tuple]] = [
        ("utime", "int64_t"),
        ("frame_name", "string"),
        ("width", "int64_t"),
        ("height", "int64_t"),
        ("num_fields", "int32_t"),
        ("fields", lcmt_point_cloud_field, "num_fields"),
        ("flags", "int64_t"),
        ("point_step", "int32_t"),
        ("row_step", "int64_t"),
        ("filler_size", "int16_t"),
        ("filler", "byte", "filler_size"),
        ("data_size", "int64_t"),
        ("data", "byte", "data_size"),
    ]
