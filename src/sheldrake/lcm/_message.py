"""What messages of LCM are: typed fields, encoded as big-endian numbers after a number that names the type."""

from __future__ import annotations

import re
import struct
from typing import TYPE_CHECKING, Any, ClassVar

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
    """A message; a derived class has its `layout` in LCM's notation: "int32_t size; double value[size]; string name".

    Types are LCM's or other messages; arrays of "byte" are bytes. Numbers may have a second length, a number: they are
    a list of lists.
    """

    layout = ""
    _fields: ClassVar[list[tuple]] = []
    _types: ClassVar[dict[str, Any]] = {}

    def __init_subclass__(cls) -> None:
        """Takes the layout apart: a tuple for each field, of its name, its type and its lengths."""
        declarations = (text.split(maxsplit=1) for text in cls.layout.split(";"))
        found = [(kind, re.findall(r"\w+", name)) for kind, names in declarations for name in names.split(",")]
        cls._fields = [
            (name, cls._types.get(kind, kind), *(int(d) if d.isdigit() else d for d in lengths))
            for kind, (name, *lengths) in found
        ]
        cls._types[cls.__name__] = cls

    if TYPE_CHECKING:  # the fields

        def __getattr__(self, name: str) -> Any: ...

    def __init__(self, **values: Any):
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
    def decode(cls, data: bytes) -> Any:
        """The message that these bytes are.

        Raises:
            ValueError: they are another type's, not complete, or say lengths that cannot be.
        """
        if len(data) < 8 or struct.unpack_from(">Q", data)[0] != fingerprint(cls._fields):
            raise ValueError(f"{cls.__name__}.decode(): these {len(data)} bytes are no {cls.__name__}.")
        try:
            return cls._decoded(data, 8)[0]
        except struct.error as e:
            raise ValueError(f"{cls.__name__}.decode(): the message ends early: {e}.") from None
        except UnicodeDecodeError as e:
            raise ValueError(f"{cls.__name__}.decode(): a text is no UTF-8: {e}.") from None

    @classmethod
    def _decoded(cls, data: bytes, at: int) -> tuple[Any, int]:
        """The message whose first field begins at `at`, and where it ends."""
        message = cls()
        for name, kind, *dimensions in cls._fields:
            if not dimensions:
                value, at = _decode_one(kind, data, at)
            elif kind == "byte" or kind in _CODES:
                n = _length_found(message, name, dimensions[0], data, at)
                n *= dimensions[1] if len(dimensions) > 1 else 1
                form = struct.Struct(f">{n}s" if kind == "byte" else f">{n}{_CODES[kind]}")
                found = form.unpack_from(data, at)
                value, at = found[0] if kind == "byte" else list(found), at + form.size
                if len(dimensions) > 1:
                    value = [value[k : k + dimensions[1]] for k in range(0, n, dimensions[1])]
            else:
                value = []
                for _ in range(_length_found(message, name, dimensions[0], data, at)):
                    one, at = _decode_one(kind, data, at)
                    value.append(one)
            setattr(message, name, value)
        return message, at

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{f[0]}={getattr(self, f[0])!r}' for f in self._fields)})"


def _length(message: Message, dimension: Any) -> int:
    return dimension if isinstance(dimension, int) else getattr(message, dimension)


def _length_found(message: Message, name: str, dimension: Any, data: bytes, at: int) -> int:
    """`_length` of a message that is being read, of whose elements each takes a byte at least."""
    n = _length(message, dimension)
    return _checked_length(f"{type(message).__name__}.{name}", n, 0, len(data) - at)


def _checked_length(what: str, n: int, least: int, left: int) -> int:
    if n < least:
        raise ValueError(f"{what}: a message says that its length is {n}; expected at least {least}.")
    if n > left:
        raise struct.error(f"{what} has a length of {n}, and {left} bytes are left")
    return n


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
        n = _checked_length("a text", struct.unpack_from(">i", data, at)[0], 1, len(data) - at - 4)
        return data[at + 4 : at + 3 + n].decode(), at + 4 + n
    if not isinstance(kind, str):
        return kind._decoded(data, at)
    form = struct.Struct(f">{_CODES[kind]}")
    return form.unpack_from(data, at)[0], at + form.size
