"""Reader of Wavefront OBJ: vertices and faces; materials and texture coordinates are for viewers."""

from __future__ import annotations

import re
import warnings
from typing import Any

import numpy as np

_PLACE, _FACE = (re.compile(rf"^[ \t]*{word}[ \t](.*)", re.MULTILINE) for word in "vf")
_TEXTURE_AND_NORMAL = re.compile(r"/\S*")

_OTHERS = frozenset(
    "vp l p g o s mg usemtl mtllib usemap maplib cstype deg bmat step curv curv2 surf parm trim hole scrv sp "
    "end con bevel c_interp d_interp lod shadow_obj trace_obj ctech stech".split()
)
"""What lines begin with that no reader needs."""


def read_obj(text: str, name: str) -> tuple[np.ndarray, Any]:
    """Vertices, shape (n, 3), and faces of an OBJ file, vertex numbers from 0.

    The faces are an array, shape (m, 3), where all are triangles, else lists of vertex numbers.

    Raises:
        RuntimeError: a line that can not be read; the message has file and line.
    """
    plain = _read_plain(text)
    return _read_line_by_line(text, name) if plain is None else plain


def _read_plain(text: str) -> tuple[np.ndarray, Any] | None:
    """The same for most files at the speed of NumPy; None if there is anything unusual or wrong in the file."""
    if "\\" in text:
        return None
    places, corners = _PLACE.findall(text), _FACE.findall(text)
    # What no vertex and no corner can be, NaN and zero, shows where the lines end.
    values = _numbers(" nan ".join([*places, ""]), float)
    flat = _numbers(_TEXTURE_AND_NORMAL.sub("", " 0 ".join([*corners, ""])), np.int64)
    if values is None or flat is None or flat.min(initial=0) < 0 or flat.max(initial=0) > len(places):
        return None
    places_end, faces_end = np.flatnonzero(np.isnan(values)), np.flatnonzero(flat == 0)
    if len(places_end) != len(places) or len(faces_end) != len(corners) or not places:
        return None
    columns = int(places_end[0])
    if columns < 3 or np.any(np.diff(places_end) != columns + 1):
        return None
    vertices = np.ascontiguousarray(values.reshape(len(places), columns + 1)[:, :3])
    if np.all(faces_end == 3 + 4 * np.arange(len(corners))):
        return vertices, np.ascontiguousarray(flat.reshape(-1, 4)[:, :3]) - 1
    numbers = (flat - 1).tolist()
    return vertices, [numbers[a:b] for a, b in zip([0, *(faces_end + 1).tolist()], faces_end.tolist())]


def _numbers(text: str, dtype: type) -> np.ndarray | None:
    """Numbers with spaces between them, None if anything else is there."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            return np.fromstring(text, dtype, sep=" ") if text else np.zeros(0, dtype)
        except (DeprecationWarning, ValueError):
            return None


def _read_line_by_line(text: str, name: str) -> tuple[np.ndarray, list[list[int]]]:
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
        for v in face:
            if not 0 <= v < len(vertices):
                found = v + 1 if v >= 0 else f"{-v} before the first"
                raise RuntimeError(f"{name}: a face names vertex {found}, but the file has {len(vertices)}.")
    return np.array(vertices, dtype=float).reshape(-1, 3), faces


def first_fault(text: str) -> str:
    """The number of the first line that no reader of everything in an OBJ file understands, and why; "" without one.

    What the line says is not repeated: the file may be another than it seems, and not for those who read messages.
    """
    for number, line in _logical_lines(text):
        word, *rest = line.split()
        try:
            if word in ("v", "vt", "vn"):
                [float(x) for x in rest]
            elif word == "f":
                [int(n) for n in " ".join(rest).replace("/", " ").split()]
            elif word not in _OTHERS:
                return f"line {number} begins with no word of OBJ"
        except ValueError:
            return f"line {number} wants {'whole numbers' if word == 'f' else 'numbers'} after '{word}'"
    return ""


def _logical_lines(text: str):
    """Line number and text of each line, comments removed and continued lines joined."""
    held: list[str] = []
    start = 0
    for number, raw in enumerate(text.splitlines(), 1):
        start = start if held else number
        line = raw.split("#", 1)[0].replace("\t", " ").strip()
        if line.endswith("\\"):
            held.append(line[:-1])
            continue
        line = " ".join([*held, line]).strip()
        held.clear()
        if line:
            yield start, line


def _vertex_number(corner: str, count: int) -> int:
    index = int(corner.split("/", 1)[0])
    if index == 0:
        raise ValueError("vertex numbers start at 1")
    return index - 1 if index > 0 else count + index
