"""Reader of legacy VTK files: ASCII unstructured grids of tetrahedra, and triangulated polydata."""

from __future__ import annotations

import numpy as np

_TETRAHEDRON = 10


def read_vtk(data: bytes, name: str) -> tuple[np.ndarray, list[list[int]], np.ndarray | None]:
    """Vertices, shape (n, 3), surface polygons, and tetrahedra, shape (m, 4), or None.

    Raises:
        RuntimeError: not an ASCII legacy file, cells other than tetrahedra or polygons, or fewer numbers than it says.
    """
    lines = data.decode("latin-1").split("\n", 3)
    if not lines[0].startswith("# vtk DataFile") or len(lines) < 4:
        raise RuntimeError(f"{name}: not a legacy VTK file.")
    if lines[2].strip().upper() != "ASCII":
        raise RuntimeError(f"{name}: only ASCII VTK files can be read, this one is {lines[2].strip()!r}.")
    words = lines[3].split()
    found = {word.upper(): i for i, word in reversed(list(enumerate(words)))}
    if "POINTS" not in found:
        raise RuntimeError(f"{name}: the VTK file has no POINTS.")
    count = int(words[found["POINTS"] + 1])
    first = found["POINTS"] + 3
    if count < 0 or first + 3 * count > len(words):
        raise RuntimeError(f"{name}: the VTK file says it has {count} points, but ends before.")
    vertices = np.array(words[first : first + 3 * count], dtype=float).reshape(-1, 3)
    if "CELLS" in found:
        cells = _rows(words, found["CELLS"], name)
        kinds = [int(w) for w in words[found["CELL_TYPES"] + 2 :][: len(cells)]]
        if set(kinds) - {_TETRAHEDRON}:
            raise RuntimeError(f"{name}: VTK cell types {sorted(set(kinds))}; only tetrahedra ({_TETRAHEDRON}).")
        return vertices, [], np.array(cells, dtype=np.int64).reshape(-1, 4)
    if "POLYGONS" in found:
        return vertices, _rows(words, found["POLYGONS"], name), None
    raise RuntimeError(f"{name}: the VTK file has neither CELLS nor POLYGONS.")


def _rows(words: list[str], at: int, name: str) -> list[list[int]]:
    """The `n a b c ...` records of a CELLS or POLYGONS section."""
    rows: list[list[int]] = []
    i = at + 3
    count = int(words[at + 1])
    for _ in range(count):
        size = int(words[i]) if i < len(words) else 0
        if size < 1 or i + size >= len(words):
            raise RuntimeError(
                f"{name}: the VTK file says it has {count} {words[at]}, but row {len(rows)} is not there."
            )
        rows.append([int(w) for w in words[i + 1 : i + 1 + size]])
        i += 1 + size
    return rows
