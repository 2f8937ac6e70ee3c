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
        RuntimeError: no triangles, or fewer than the file says it has.
        ValueError: a coordinate that is no number.
    """
    count = int.from_bytes(data[_HEADER - 4 : _HEADER], "little")
    end = _HEADER + count * _TRIANGLE.itemsize
    if data.lstrip().startswith(b"solid") and len(data) != end:
        vertices = np.array(_VERTEX.findall(data), dtype=float).reshape(-1, 3)
        if len(vertices) % 3 or len(vertices) // 3 != len(re.findall(rb"\bendfacet\b", data)):
            raise RuntimeError(f"{name}: the last facet of the STL file is not complete.")
    elif len(data) < end or len(data) < _HEADER:
        held = max(0, len(data) - _HEADER) // _TRIANGLE.itemsize
        raise RuntimeError(f"{name}: the STL file says it has {count} triangles, but holds {held}.")
    else:
        vertices = np.frombuffer(data, _TRIANGLE, count, _HEADER)["vertices"].astype(float).reshape(-1, 3)
    if len(vertices) == 0:
        raise RuntimeError(f"{name}: the STL file has no triangles.")
    return vertices, np.arange(len(vertices)).reshape(-1, 3)
