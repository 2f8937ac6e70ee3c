"""Messages to a viewer: which bodies there are and what they look like, and where they are."""

from __future__ import annotations

from typing import ClassVar

from sheldrake.lcm._messages import Message


class lcmt_viewer_geometry_data(Message):
    """A shape on a link: its kind and sizes, its pose, quaternion w x y z, in the link's frame, and its color.

    A mesh is a file's path and three scales, or without a path its own numbers: number of vertices, number of
    triangles, vertices, indices.
    """

    BOX, SPHERE, CYLINDER, MESH, CAPSULE, ELLIPSOID = 1, 2, 3, 4, 5, 6

    _fields: ClassVar[list[tuple]] = [
        ("type", "int8_t"),
        ("position", "float", 3),
        ("quaternion", "float", 4),
        ("color", "float", 4),
        ("string_data", "string"),
        ("num_float_data", "int32_t"),
        ("float_data", "float", "num_float_data"),
    ]


class lcmt_viewer_link_data(Message):
    """A link with its shapes."""

    _fields: ClassVar[list[tuple]] = [
        ("name", "string"),
        ("robot_num", "int32_t"),
        ("num_geom", "int32_t"),
        ("geom", lcmt_viewer_geometry_data, "num_geom"),
    ]


class lcmt_viewer_load_robot(Message):
    """All links that there are."""

    _fields: ClassVar[list[tuple]] = [("num_links", "int32_t"), ("link", lcmt_viewer_link_data, "num_links")]


class lcmt_viewer_draw(Message):
    """Poses of links in the world at a time [ms]."""

    _fields: ClassVar[list[tuple]] = [
        ("timestamp", "int64_t"),
        ("num_links", "int32_t"),
        ("link_name", "string", "num_links"),
        ("robot_num", "int32_t", "num_links"),
        ("position", "float", "num_links", 3),
        ("quaternion", "float", "num_links", 4),
    ]
