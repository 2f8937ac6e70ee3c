"""Mesh files as they come out of CAD: their solids, what they say about themselves, and nothing absurd."""

from __future__ import annotations

import io
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._ctrl_c import imported

from ._declared_sizes import check_declared_sizes

if TYPE_CHECKING:
    from os import PathLike

FORMATS = (".stl", ".obj", ".ply", ".dae", ".gltf", ".glb", ".3mf")
_OF_CAD = (".step", ".stp", ".iges", ".igs", ".sldprt", ".ipt", ".fcstd", ".f3d")  # without triangles

# glTF has y up, descriptions of robots have z up.
_Y_UP_TO_Z_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])


@dataclass
class Solid:
    """A surface in the numbers of its file.

    Attributes:
        name: What the file calls it.
        vertices: shape (n, 3).
        triangles: Vertex numbers, shape (m, 3).
    """

    name: str
    vertices: np.ndarray
    triangles: np.ndarray


@dataclass
class MeshFile:
    """What a mesh file holds and says.

    Attributes:
        path: The file.
        solids: Its surfaces, in file order.
        declared: The unit the file states, as metres per unit, or None.
        declared_by: Where it states that: text for people.
        is_default: The unit is what the format prescribes; the file itself is silent.
        header: Its comments and header, where exporters sign.
        is_plain: Numbers in the file are the solids' numbers: not rotated, not scaled.
    """

    path: Path
    solids: list[Solid]
    declared: float | None = None
    declared_by: str = ""
    is_default: bool = False
    header: str = ""
    is_plain: bool = True
    notes: list[str] = field(default_factory=list)


def read_mesh_file(path: str | PathLike[str]) -> MeshFile:
    """The solids of a mesh file and what it says about units.

    Raises:
        FileNotFoundError: There is no such file.
        ValueError: The file is empty, is no mesh of its format, holds numbers that are not finite, or declares sizes
            that it can not have.
    """
    path = Path(path)
    extension = path.suffix.lower()
    if not path.is_file():
        raise FileNotFoundError(f"There is no mesh file '{path}'.")
    if extension not in FORMATS:
        hint = " Export the part as STL from your CAD program." if extension in _OF_CAD else ""
        raise ValueError(f"'{path}': the format '{extension}' is not known; known are {', '.join(FORMATS)}.{hint}")
    data = path.read_bytes()
    if not data.strip():
        raise ValueError(f"'{path}' is empty.")
    check_declared_sizes(data, extension, str(path))
    reader = {".obj": _read_obj, ".dae": _read_dae, ".3mf": _read_3mf}.get(extension, _read_with_trimesh)
    try:
        mesh = reader(path, data)
    except (RuntimeError, ValueError, KeyError, IndexError, StopIteration, TypeError, AttributeError) as error:
        if isinstance(error, ValueError) and str(path) in str(error):
            raise
        raise ValueError(f"'{path}' can not be read as {extension}: {error}") from error
    mesh.solids = [solid for solid in mesh.solids if len(solid.triangles)]
    if not mesh.solids:
        raise ValueError(f"'{path}' has no triangles: it is damaged, or not a {extension} file.")
    _check_numbers(mesh)
    return mesh


def _check_numbers(mesh: MeshFile) -> None:
    for solid in mesh.solids:
        if solid.triangles.min() < 0 or solid.triangles.max() >= len(solid.vertices):
            raise ValueError(
                f"'{mesh.path}': a triangle of '{solid.name}' names vertex {solid.triangles.max()}, "
                f"but there are {len(solid.vertices)}."
            )
        used = solid.vertices[np.unique(solid.triangles)]
        wrong = ~np.isfinite(used).all(axis=1)
        if wrong.any():
            raise ValueError(
                f"'{mesh.path}': {int(wrong.sum())} of the {len(used)} vertices of '{solid.name}' are not finite "
                f"numbers (the first: {used[wrong][0].tolist()})."
            )


def _read_obj(path: Path, data: bytes) -> MeshFile:
    from sheldrake.geometry._meshes.polygon_mesh import fans
    from sheldrake.geometry._meshes.read_obj import read_obj

    text = data.decode("utf-8", "replace")
    vertices, polygons = read_obj(text, str(path))
    header = "\n".join(line for line in text.splitlines()[:200] if line.lstrip().startswith("#"))
    mesh = MeshFile(path, [Solid(path.stem, vertices, fans(polygons))], header=header)
    return _with_unit_comment(mesh)


def _read_dae(path: Path, data: bytes) -> MeshFile:
    from sheldrake.geometry._meshes.polygon_mesh import fans
    from sheldrake.geometry._meshes.read_dae import read_dae

    vertices, polygons = read_dae(data, str(path))
    stated = re.search(rb"<unit\b[^>]*?\bmeter\s*=\s*[\"']\s*([-+0-9.eE]+)", data)
    factor = float(stated[1]) if stated else 1.0
    if not factor > 0.0:
        raise ValueError(f"'{path}' says a unit has {factor:g} metres.")
    mesh = MeshFile(path, [Solid(path.stem, vertices / factor, fans(polygons))], factor, is_plain=False)
    mesh.declared_by = f'<unit meter="{factor:g}">' if stated else "COLLADA's default, metres"
    mesh.is_default = stated is None
    tool = re.search(rb"<authoring_tool>([^<]*)<", data)
    mesh.header = tool[1].decode("utf-8", "replace") if tool else ""
    return mesh


def _read_3mf(path: Path, data: bytes) -> MeshFile:
    from ._read_3mf import read_3mf

    solids, unit, factor = read_3mf(data, str(path))
    mesh = MeshFile(path, [Solid(*solid) for solid in solids], factor, is_plain=False)
    mesh.declared_by = f'unit="{unit}"' if unit else "3MF's default, millimetres"
    mesh.is_default = not unit
    return mesh


def _read_with_trimesh(path: Path, data: bytes) -> MeshFile:
    trimesh = imported("trimesh")

    from sheldrake.geometry._meshes.check_gltf import check_gltf
    from sheldrake.geometry._meshes.mesh_files import DiskFiles

    extension, files = path.suffix.lower(), DiskFiles(path.parent)
    try:
        if extension in (".gltf", ".glb"):
            check_gltf(data, extension, path.name, files.get)
        loaded = trimesh.load(
            io.BytesIO(data),
            file_type=extension[1:],
            resolver=files,  # type: ignore[arg-type]
            process=False,
            skip_materials=True,
        )
    except Exception as error:
        raise ValueError(f"'{path}' can not be read as {extension}: {error}") from error
    solids = []
    for name, geometry in _parts(loaded, path.stem):
        vertices = np.array(getattr(geometry, "vertices", ()), dtype=float).reshape(-1, 3)
        triangles = np.array(getattr(geometry, "faces", ()), dtype=np.int64).reshape(-1, 3)
        if extension in (".gltf", ".glb"):
            vertices = vertices @ _Y_UP_TO_Z_UP
        solids.append(Solid(name, vertices, triangles))
    mesh = MeshFile(path, solids, header=_header(data, extension))
    if extension in (".gltf", ".glb"):
        mesh.declared, mesh.declared_by, mesh.is_default = 1.0, "glTF's rule, metres", True
        mesh.is_plain = False
        return mesh
    return _with_unit_comment(mesh)


def _parts(loaded: Any, stem: str) -> list[tuple[str, Any]]:
    """Each geometry of a trimesh scene, where the scene puts it."""
    if not hasattr(loaded, "geometry"):
        return [(stem, loaded)]
    if not hasattr(loaded.graph, "nodes_geometry"):
        return list(loaded.geometry.items())
    parts = []
    for node in loaded.graph.nodes_geometry:
        transform, name = loaded.graph[node]
        part = loaded.geometry[name].copy()
        part.apply_transform(transform)
        parts.append((str(name), part))
    return parts


def _header(data: bytes, extension: str) -> str:
    """The part of an STL, PLY or glTF file in which exporters sign."""
    if extension == ".stl":
        return data[: 256 if data[:5].lower() == b"solid" else 80].decode("latin-1")
    if extension == ".ply":
        return data[: max(data.find(b"end_header"), 0)].decode("latin-1")
    found = re.search(rb'"generator"\s*:\s*"([^"]*)"', data[:100_000])
    return found[1].decode("utf-8", "replace") if found else ""


_METRES = {
    "mm": 1e-3, "millimeter": 1e-3, "millimetre": 1e-3, "cm": 1e-2, "centimeter": 1e-2, "centimetre": 1e-2,
    "m": 1.0, "meter": 1.0, "metre": 1.0, "in": 0.0254, "inch": 0.0254, "inche": 0.0254,
}  # fmt: skip
_COMMENT = re.compile(r"\bunits?\b\s*[:=]?\s*(?:is|are|in)?\s*[\"'(]?(\w+)", re.IGNORECASE)


def _with_unit_comment(mesh: MeshFile) -> MeshFile:
    """Takes a comment such as `File units = millimeters` for a statement."""
    for found in _COMMENT.finditer(mesh.header):
        word = found[1].lower()
        factor = _METRES.get(word, _METRES.get(word.removesuffix("s")))
        if factor is not None:
            mesh.declared, mesh.declared_by = factor, f"the comment '{found[0].strip()}'"
            break
    return mesh
