"""Message types as lists of fields, with LCM's encoding: big-endian numbers after a number that names the type.

That number is a hash of the type's fields, turned by one bit; see LCM's type specification.
"""

from __future__ import annotations

import struct
from typing import Any, ClassVar

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
        v = _mix_text(v, kind)
        v = _mix(v, len(dimensions))
        for dimension in dimensions:
            v = _mix(v, 0 if isinstance(dimension, int) else 1)
            v = _mix_text(v, str(dimension))
    v &= _WORD
    return ((v << 1) & _WORD) | v >> 63


class Message:
    """A message; derived classes list `_fields`: (name, kind) or (name, kind, length), a number or a field's name."""

    _fields: ClassVar[list[tuple]] = []

    def __init__(self, **values: Any):
        for name, kind, *dimensions in self._fields:
            zero: Any = "" if kind == "string" else 0.0 if kind in ("float", "double") else 0
            if dimensions:
                zero = [zero] * (dimensions[0] if isinstance(dimensions[0], int) else 0)
            setattr(self, name, values.pop(name, zero))
        if values:
            names = ", ".join(f[0] for f in self._fields)
            raise TypeError(f"{type(self).__name__}() has no field {', '.join(values)}; it has {names}.")

    def encode(self) -> bytes:
        """The message's bytes."""
        parts = [struct.pack(">Q", fingerprint(self._fields))]
        for name, kind, *dimensions in self._fields:
            value = getattr(self, name)
            if kind == "string":
                text = value.encode() + b"\0"
                parts.append(struct.pack(">i", len(text)) + text)
            elif dimensions:
                n = dimensions[0] if isinstance(dimensions[0], int) else getattr(self, dimensions[0])
                if len(value) != n:
                    raise ValueError(f"{type(self).__name__}.encode(): {name} has {len(value)} elements, not {n}.")
                parts.append(struct.pack(f">{n}{_CODES[kind]}", *value))
            else:
                parts.append(struct.pack(f">{_CODES[kind]}", value))
        return b"".join(parts)

    @classmethod
    def decode(cls, data: bytes) -> Any:
        """The message that these bytes are.

        Raises:
            ValueError: they are another type's, or not complete.
        """
        if len(data) < 8 or struct.unpack_from(">Q", data)[0] != fingerprint(cls._fields):
            raise ValueError(f"{cls.__name__}.decode(): these {len(data)} bytes are no {cls.__name__}.")
        message, at = cls(), 8
        try:
            for name, kind, *dimensions in cls._fields:
                if kind == "string":
                    (n,) = struct.unpack_from(">i", data, at)
                    setattr(message, name, data[at + 4 : at + 3 + n].decode())
                    at += 4 + n
                    continue
                n = 1
                if dimensions:
                    n = dimensions[0] if isinstance(dimensions[0], int) else getattr(message, dimensions[0])
                form = struct.Struct(f">{n}{_CODES[kind]}")
                found = form.unpack_from(data, at)
                at += form.size
                setattr(message, name, list(found) if dimensions else found[0])
        except struct.error as e:
            raise ValueError(f"{cls.__name__}.decode(): the message ends early: {e}.") from None
        return message

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{f[0]}={getattr(self, f[0])!r}' for f in self._fields)})"


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
