"""Reader of Wavefront OBJ: vertices and faces; materials and texture coordinates are for viewers."""

from __future__ import annotations

import numpy as np


def read_obj(text: str, name: str) -> tuple[np.ndarray, list[list[int]]]:
    """Vertices, shape (n, 3), and faces as lists of vertex numbers (from 0) of an OBJ file.

    Raises:
        RuntimeError: a line that can not be read; the message has file and line.
    """
    vertices: list[list[float]] = []
    faces: list[list[int]] = []
    for number, line in _logical_lines(text):
        word, _, rest = line.partition(" ")
        try:
            if word == "v":
                x, y, z = rest.split()[:3]
                vertices.append([float(x), float(y), float(z)])
            elif word == "f":
                faces.append([_vertex_number(corner, len(vertices)) for corner in rest.split()])
        except ValueError:
            raise RuntimeError(f"{name}:{number}: cannot read the OBJ line {line!r}.") from None
    for face in faces:
        if any(not 0 <= v < len(vertices) for v in face):
            raise RuntimeError(f"{name}: a face names vertex {max(face) + 1}, but the file has {len(vertices)}.")
    return np.array(vertices, dtype=float).reshape(-1, 3), faces


def _logical_lines(text: str):
    """Line number and text of each line, comments removed and continued lines joined."""
    held, start = "", 0
    for number, raw in enumerate(text.splitlines(), 1):
        start = start if held else number
        line = held + raw.split("#", 1)[0].replace("\t", " ").strip()
        if line.endswith("\\"):
            held = line[:-1] + " "
            continue
        held = ""
        if line:
            yield start, line


def _vertex_number(corner: str, count: int) -> int:
    index = int(corner.split("/", 1)[0])
    if index == 0:
        raise ValueError("vertex numbers start at 1")
    return index - 1 if index > 0 else count + index
