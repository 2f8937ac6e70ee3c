"""Message types as lists of fields, with LCM's encoding: big-endian numbers after a number that names the type."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, Any, ClassVar

if TYPE_CHECKING:
    from typing_extensions import Self

_CODES = {"int8_t": "b", "int16_t": "h", "int32_t": "i", "int64_t": "q", "float": "f", "double": "d", "boolean": "?"}
_WORD = (1 << 64) - 1


def _signed(v: int) -> int:
    v &= _WORD
    return v - (1 << 64) if v >> 63 else v


def _mix(v: int, c: int) -> int:
    return _signed(((v << 8) ^ (v >> 55)) + c)


def _mix_text(v: int, text: str) -> int:
    v = _mix(v, len(text))
    for c in text.encode():
        v = _mix(v, c)
    return v


def fingerprint(fields: list[tuple]) -> int:
    """The number that names a type of these fields."""
    v = 0x12345678
    for name, kind, *dimensions in fields:
        v = _mix_text(v, name)
        if isinstance(kind, str):
            v = _mix_text(v, kind)
        v = _mix(v, len(dimensions))
        for dimension in dimensions:
            v = _mix(v, 0 if isinstance(dimension, int) else 1)
            v = _mix_text(v, str(dimension))
    v += sum(fingerprint(kind._fields) for _, kind, *_ in fields if not isinstance(kind, str))
    v &= _WORD
    return ((v << 1) & _WORD) | v >> 63


class Message:
    """A message; derived classes list `_fields`: (name, kind) or (name, kind, length).

    A kind is the name of one of LCM's types or a message class, a length a number or a field's name. Arrays of "byte"
    are bytes. Numbers may have a second length, a number: they are a list of lists.
    """

    _fields: ClassVar[list[tuple]] = []

    if TYPE_CHECKING:  # what `_fields` names

        def __getattr__(self, name: str) -> Any: ...

    def __init__(self, **values: object):
        for name, kind, *dimensions in self._fields:
            setattr(self, name, values.pop(name) if name in values else _zero(kind, *dimensions))
        if values:
            names = ", ".join(f[0] for f in self._fields)
            raise TypeError(f"{type(self).__name__}() has no field {', '.join(values)}; it has {names}.")

    def encode(self) -> bytes:
        """The message's bytes."""
        return struct.pack(">Q", fingerprint(self._fields)) + self._encoded()

    def _encoded(self) -> bytes:
        """The bytes after those that name the type."""
        parts = []
        for name, kind, *dimensions in self._fields:
            value = getattr(self, name)
            if not dimensions:
                parts.append(_encode_one(kind, value))
                continue
            n = _length(self, dimensions[0])
            if len(dimensions) > 1:
                value = [number for row in value for number in row]
                n *= dimensions[1]
            if len(value) != n:
                raise ValueError(f"{type(self).__name__}.encode(): {name} has {len(value)} elements, not {n}.")
            if kind == "byte":
                parts.append(bytes(value))
            elif kind in _CODES:
                parts.append(struct.pack(f">{n}{_CODES[kind]}", *value))
            else:
                parts += [_encode_one(kind, one) for one in value]
        return b"".join(parts)

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """The message that these bytes are.

        Raises:
            ValueError: they are another type's, or not complete.
        """
        if len(data) < 8 or struct.unpack_from(">Q", data)[0] != fingerprint(cls._fields):
            raise ValueError(f"{cls.__name__}.decode(): these {len(data)} bytes are no {cls.__name__}.")
        try:
            return cls._decoded(data, 8)[0]
        except struct.error as e:
            raise ValueError(f"{cls.__name__}.decode(): the message ends early: {e}.") from None

    @classmethod
    def _decoded(cls, data: bytes, at: int) -> tuple[Any, int]:
        """The message whose first field begins at `at`, and where it ends."""
        message = cls()
        for name, kind, *dimensions in cls._fields:
            if not dimensions:
                value, at = _decode_one(kind, data, at)
            elif kind == "byte" or kind in _CODES:
                n = _length(message, dimensions[0])
                n *= dimensions[1] if len(dimensions) > 1 else 1
                form = struct.Struct(f">{n}s" if kind == "byte" else f">{n}{_CODES[kind]}")
                found = form.unpack_from(data, at)
                value, at = found[0] if kind == "byte" else list(found), at + form.size
                if len(dimensions) > 1:
                    value = [value[k : k + dimensions[1]] for k in range(0, n, dimensions[1])]
            else:
                value = []
                for _ in range(_length(message, dimensions[0])):
                    one, at = _decode_one(kind, data, at)
                    value.append(one)
            setattr(message, name, value)
        return message, at

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{f[0]}={getattr(self, f[0])!r}' for f in self._fields)})"


def _length(message: Message, dimension: Any) -> int:
    return dimension if isinstance(dimension, int) else getattr(message, dimension)


def _zero(kind: Any, dimension: Any = None, *_: Any) -> Any:
    """What a field is until it is set."""
    if kind == "byte" and dimension is not None:
        return b""
    zero: Any = "" if kind == "string" else 0.0 if kind in ("float", "double") else 0
    if dimension is not None:
        return [zero] * (dimension if isinstance(dimension, int) else 0)
    return zero if isinstance(kind, str) else kind()


def _encode_one(kind: Any, value: Any) -> bytes:
    if kind == "string":
        text = value.encode() + b"\0"
        return struct.pack(">i", len(text)) + text
    return struct.pack(f">{_CODES[kind]}", value) if isinstance(kind, str) else value._encoded()


def _decode_one(kind: Any, data: bytes, at: int) -> tuple[Any, int]:
    if kind == "string":
        (n,) = struct.unpack_from(">i", data, at)
        return data[at + 4 : at + 3 + n].decode(), at + 4 + n
    if not isinstance(kind, str):
        return kind._decoded(data, at)
    form = struct.Struct(f">{_CODES[kind]}")
    return form.unpack_from(data, at)[0], at + form.size


class lcmt_scope(Message):
    """A vector at a time [us]."""

    _fields: ClassVar[list[tuple]] = [("utime", "int64_t"), ("size", "int32_t"), ("value", "double", "size")]


class lcmt_schunk_wsg_command(Message):
    """Where a WSG gripper's fingers should be [mm] apart, and the most force [N]."""

    _fields: ClassVar[list[tuple]] = [("utime", "int64_t"), ("target_position_mm", "double"), ("force", "double")]


class lcmt_schunk_wsg_status(Message):
    """How far apart a WSG gripper's fingers are [mm], how fast they part [mm/s], and their force [N]."""

    _fields: ClassVar[list[tuple]] = [
        ("utime", "int64_t"),
        ("actual_position_mm", "double"),
        ("actual_force", "double"),
        ("actual_speed_mm_per_s", "double"),
    ]


class lcmt_iiwa_command(Message):
    """Positions [rad] and torques [N m] for an iiwa."""

    _fields: ClassVar[list[tuple]] = [
        ("utime", "int64_t"),
        ("num_joints", "int32_t"),
        ("joint_position", "double", "num_joints"),
        ("num_torques", "int32_t"),
        ("joint_torque", "double", "num_torques"),
    ]


class lcmt_iiwa_status(Message):
    """What an iiwa measures and was commanded: positions [rad], velocities [rad/s], torques [N m]."""

    _fields: ClassVar[list[tuple]] = [
        ("utime", "int64_t"),
        ("num_joints", "int32_t"),
        ("joint_position_measured", "double", "num_joints"),
        ("joint_velocity_estimated", "double", "num_joints"),
        ("joint_position_commanded", "double", "num_joints"),
        ("joint_position_ipo", "double", "num_joints"),
        ("joint_torque_measured", "double", "num_joints"),
        ("joint_torque_commanded", "double", "num_joints"),
        ("joint_torque_external", "double", "num_joints"),
    ]


class lcmt_header(Message):
    """Number, time [us] and name of a message."""

    _fields: ClassVar[list[tuple]] = [("seq", "int32_t"), ("utime", "int64_t"), ("frame_name", "string")]


class lcmt_image(Message):
    """An image: rows of pixels, compressed or not."""

    PIXEL_FORMAT_GRAY, PIXEL_FORMAT_RGB, PIXEL_FORMAT_BGR, PIXEL_FORMAT_RGBA, PIXEL_FORMAT_BGRA = 0, 1, 2, 3, 4
    PIXEL_FORMAT_DEPTH, PIXEL_FORMAT_LABEL, PIXEL_FORMAT_MASK, PIXEL_FORMAT_DISPARITY = 5, 6, 7, 8
    PIXEL_FORMAT_BAYER_BGGR, PIXEL_FORMAT_BAYER_RGGB, PIXEL_FORMAT_BAYER_GBRG, PIXEL_FORMAT_BAYER_GRBG = 9, 10, 11, 12
    CHANNEL_TYPE_INT8, CHANNEL_TYPE_UINT8, CHANNEL_TYPE_INT16, CHANNEL_TYPE_UINT16 = 0, 1, 2, 3
    CHANNEL_TYPE_INT32, CHANNEL_TYPE_UINT32, CHANNEL_TYPE_FLOAT32, CHANNEL_TYPE_FLOAT64 = 4, 5, 6, 7
    COMPRESSION_METHOD_NOT_COMPRESSED, COMPRESSION_METHOD_ZLIB = 0, 1
    COMPRESSION_METHOD_JPEG, COMPRESSION_METHOD_PNG = 2, 3
    PIXEL_FORMAT_INVALID = CHANNEL_TYPE_INVALID = COMPRESSION_METHOD_INVALID = -1

    _fields: ClassVar[list[tuple]] = [
        ("header", lcmt_header),
        ("width", "int32_t"),
        ("height", "int32_t"),
        ("row_stride", "int32_t"),
        ("size", "int32_t"),
        ("data", "byte", "size"),
        ("bigendian", "boolean"),
        ("pixel_format", "int8_t"),
        ("channel_type", "int8_t"),
        ("compression_method", "int8_t"),
    ]


class lcmt_image_array(Message):
    """Images taken together."""

    _fields: ClassVar[list[tuple]] = [
        ("header", lcmt_header),
        ("num_images", "int32_t"),
        ("images", lcmt_image, "num_images"),
    ]


class lcmt_panda_command(Message):
    """Positions [rad], velocities [rad/s] and torques [N m] for a Panda, and which of them it should follow."""

    _fields: ClassVar[list[tuple]] = [
        ("utime", "int64_t"),
        ("num_joint_position", "int32_t"),
        ("joint_position", "double", "num_joint_position"),
        ("num_joint_velocity", "int32_t"),
        ("joint_velocity", "double", "num_joint_velocity"),
        ("num_joint_torque", "int32_t"),
        ("joint_torque", "double", "num_joint_torque"),
        ("control_mode_expected", "int8_t"),
    ]
    CONTROL_MODE_POSITION, CONTROL_MODE_VELOCITY, CONTROL_MODE_TORQUE = 1, 2, 4


class lcmt_panda_status(Message):
    """What a Panda measures and was commanded: positions [rad], velocities [rad/s], torques [N m]."""

    _fields: ClassVar[list[tuple]] = [
        ("utime", "int64_t"),
        ("num_joints", "int32_t"),
        ("joint_position", "double", "num_joints"),
        ("joint_position_desired", "double", "num_joints"),
        ("joint_velocity", "double", "num_joints"),
        ("joint_velocity_desired", "double", "num_joints"),
        ("joint_acceleration_desired", "double", "num_joints"),
        ("joint_torque", "double", "num_joints"),
        ("joint_torque_desired", "double", "num_joints"),
        ("joint_torque_external", "double", "num_joints"),
        ("control_command_success_rate", "double"),
        ("robot_mode", "int8_t"),
        ("robot_utime", "int64_t"),
        ("control_mode", "int8_t"),
    ]
    CONTROL_MODE_POSITION, CONTROL_MODE_VELOCITY, CONTROL_MODE_TORQUE = 1, 2, 4


class lcmt_point(Message):
    """A point [m]."""

    _fields: ClassVar[list[tuple]] = [("x", "double"), ("y", "double"), ("z", "double")]


class lcmt_point_pair_contact_info_for_viz(Message):
    """A contact point, the force on body 2 there, and the normal from body 2 to body 1."""

    _fields: ClassVar[list[tuple]] = [
        ("timestamp", "int64_t"),
        ("body1_name", "string"),
        ("body2_name", "string"),
        ("contact_point", "double", 3),
        ("contact_force", "double", 3),
        ("normal", "double", 3),
    ]


class lcmt_hydroelastic_quadrature_per_point_data_for_viz(Message):
    """Slip and traction at a point of a contact surface."""

    _fields: ClassVar[list[tuple]] = [("p_WQ", "double", 3), ("vt_BqAq_W", "double", 3), ("traction_Aq_W", "double", 3)]


class lcmt_hydroelastic_contact_surface_for_viz(Message):
    """A contact surface: whose it is, its resultant force, its polygons with their pressure."""

    _fields: ClassVar[list[tuple]] = [
        *(
            field
            for i in "12"
            for field in (
                (f"geometry{i}_name", "string"),
                (f"body{i}_name", "string"),
                (f"model{i}_name", "string"),
                (f"body{i}_unique", "boolean"),
                (f"collision_count{i}", "int32_t"),
            )
        ),
        ("centroid_W", "double", 3),
        ("force_C_W", "double", 3),
        ("moment_C_W", "double", 3),
        ("num_quadrature_points", "int32_t"),
        ("quadrature_point_data", lcmt_hydroelastic_quadrature_per_point_data_for_viz, "num_quadrature_points"),
        ("num_vertices", "int32_t"),
        ("p_WV", lcmt_point, "num_vertices"),
        ("pressure", "double", "num_vertices"),
        ("poly_data_int_count", "int32_t"),
        ("poly_data", "int32_t", "poly_data_int_count"),
    ]


class lcmt_contact_results_for_viz(Message):
    """All contacts at one time [us]."""

    _fields: ClassVar[list[tuple]] = [
        ("timestamp", "int64_t"),
        ("num_point_pair_contacts", "int32_t"),
        ("point_pair_contact_info", lcmt_point_pair_contact_info_for_viz, "num_point_pair_contacts"),
        ("num_hydroelastic_contacts", "int32_t"),
        ("hydroelastic_contacts", lcmt_hydroelastic_contact_surface_for_viz, "num_hydroelastic_contacts"),
    ]


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
