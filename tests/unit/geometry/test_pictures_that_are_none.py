"""Pictures that are none, or stand for far more than memory holds: who shows them says which file it is."""

import struct
import zlib

import pytest

from sheldrake.geometry import PerceptionProperties
from sheldrake.geometry._meshcat.texture import picture_file
from sheldrake.geometry._render.raster_shapes import _phong
from sheldrake.systems.sensors import ImageIo


def _chunk(name: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))


def _png(width: int, height: int) -> bytes:
    header = struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + _chunk(b"IHDR", header) + _chunk(b"IDAT", b"abc") + _chunk(b"IEND", b"")


@pytest.mark.parametrize("data", [_png(2**31 - 1, 2**31 - 1), b"\0" * 100, b""], ids=["bomb", "zeros", "empty"])
def test_the_file_is_named(tmp_path, data):
    path = tmp_path / "none.png"
    path.write_bytes(data)
    properties = PerceptionProperties()
    properties.AddProperty("phong", "diffuse_map", str(path))
    with pytest.raises(RuntimeError, match=r"none\.png' is no picture that can be read"):
        _phong(properties)
    with pytest.raises(RuntimeError, match=r"none\.png' cannot be read"):
        picture_file(path)
    with pytest.raises(RuntimeError, match=r"none\.png"):
        ImageIo().Load(path)
