"""Reader of STL, binary and ASCII: three vertices a triangle, shared by none."""

from __future__ import annotations

import re

import numpy as np

_HEADER = 84  # bytes: a comment of 80, then the number of triangles
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("vertices", "<f4", (3, 3)), ("attribute", "<u2")])
_VERTEX = re.compile(rb"\bvertex\s+(\S+)\s+(\S+)\s+(\S+)")


def read_stl(data: bytes, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Vertices, shape (3 n, 3), and triangles, shape (n, 3), of an STL file.

    Raises:
        RuntimeError: no triangles, fewer than the file says it has, or a coordinate that is no number.
    """
    count = int.from_bytes(data[_HEADER - 4 : _HEADER], "little")
    end = _HEADER + count * _TRIANGLE.itemsize
    if data.lstrip().startswith(b"solid") and len(data) != end:
        try:
            vertices = np.array(_VERTEX.findall(data), dtype=float).reshape(-1, 3)
        except ValueError:
            raise RuntimeError(f"{name}:{_bad_line(data)}: a vertex of the STL file is not three numbers.") from None
        if len(vertices) % 3 or len(vertices) // 3 != len(re.findall(rb"\bendfacet\b", data)):
            raise RuntimeError(f"{name}: the last facet of the STL file is not complete.")
    elif len(data) < _HEADER:
        raise RuntimeError(f"{name}: no STL file: it has {len(data)} bytes, and a header alone has {_HEADER}.")
    elif len(data) < end:
        held = (len(data) - _HEADER) // _TRIANGLE.itemsize
        raise RuntimeError(f"{name}: the STL file says it has {count} triangles, but holds {held}.")
    else:
        vertices = np.frombuffer(data, _TRIANGLE, count, _HEADER)["vertices"].astype(float).reshape(-1, 3)
    if len(vertices) == 0:
        raise RuntimeError(f"{name}: the STL file has no triangles.")
    return vertices, np.arange(len(vertices)).reshape(-1, 3)


def _bad_line(data: bytes) -> int:
    """The first line with a vertex that is not three numbers."""
    for number, line in enumerate(data.splitlines(), 1):
        word, *numbers = line.split() or [b""]
        if word == b"vertex":
            try:
                if len([*map(float, numbers)]) != 3:
                    return number
            except ValueError:
                return number
    return 1
