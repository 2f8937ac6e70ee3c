"""Refuses files that declare more than they hold, before a reader makes room for it."""

from __future__ import annotations

import json
import re
import struct

MOST_TRIANGLES = 20_000_000


def check_declared_sizes(data: bytes, extension: str, name: str) -> None:
    """Compares the counts in the header of a mesh file with its size.

    Raises:
        ValueError: The file can not hold what it declares, or holds more than this library reads.
    """
    check = {".stl": _check_stl, ".ply": _check_ply, ".gltf": _check_gltf, ".glb": _check_gltf, ".dae": _check_xml}
    if extension in check:
        check[extension](data, name)


def _check_stl(data: bytes, name: str) -> None:
    if _is_ascii_stl(data):
        return
    if len(data) < 84:
        raise ValueError(f"'{name}' has {len(data)} bytes, too few for a binary STL file, and is not an ASCII one.")
    (count,) = struct.unpack_from("<I", data, 80)
    room = (len(data) - 84) // 50
    if count > room:
        raise ValueError(f"'{name}' declares {count} triangles, but has room for {room}: it is damaged or cut short.")
    _check_count(count, name)


def _is_ascii_stl(data: bytes) -> bool:
    return data.lstrip()[:5].lower() == b"solid" and re.search(rb"\b(?:facet|endsolid)\b", data[:4096]) is not None


def _check_ply(data: bytes, name: str) -> None:
    end = data.find(b"end_header")
    if not data.startswith(b"ply") or end < 0:
        raise ValueError(f"'{name}' is not a PLY file: it has no PLY header.")
    for element, digits in re.findall(rb"^element\s+(\w+)\s+(\d+)", data[:end], re.MULTILINE):
        count = int(digits)
        # The least an element takes: three digits and blanks in a text, more in binary.
        if count * 3 > len(data):
            raise ValueError(
                f"'{name}' declares {count} of '{element.decode()}', more than its {len(data)} bytes can hold."
            )
        _check_count(count, name)


def _check_gltf(data: bytes, name: str) -> None:
    text = data
    if data[:4] == b"glTF":
        if len(data) < 20:
            raise ValueError(f"'{name}' is cut short.")
        (length,) = struct.unpack_from("<I", data, 12)
        text = data[20 : 20 + length]
    try:
        document = json.loads(text)
        accessors = document.get("accessors", [])
        counts = [int(accessor.get("count", 0)) for accessor in accessors]
    except (ValueError, AttributeError, RecursionError) as error:
        raise ValueError(f"'{name}' is not a glTF file: {error}.") from None
    for count in counts:
        _check_count(count, name)


def _check_xml(data: bytes, name: str) -> None:
    if re.search(rb"<!(?:DOCTYPE|ENTITY)", data):
        raise ValueError(f"'{name}' declares a document type or entities; these are refused.")


def _check_count(count: int, name: str) -> None:
    if count > MOST_TRIANGLES:
        raise ValueError(f"'{name}' declares {count} triangles or vertices; more than {MOST_TRIANGLES} are refused.")
