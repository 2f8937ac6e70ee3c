"""Mesh files to vertices and triangles, whatever the format.

Own readers for OBJ, STL, DAE and VTK, trimesh for the rest. Surfaces, hulls, volumes and pictures all begin here.
"""

from __future__ import annotations

import functools
import io
import os
import re
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import unquote

import numpy as np

from sheldrake.common._ctrl_c import imported
from sheldrake.common._files import regular_bytes

from .check_gltf import check_gltf
from .check_picture import check_picture
from .mesh_source import MeshSource
from .polygon_mesh import fans
from .read_dae import read_dae
from .read_obj import read_obj
from .read_stl import read_stl
from .read_vtk import read_vtk

IN_ONE_FILE = (".obj", ".stl", ".dae", ".vtk")
"""Formats in which the vertices are in the file itself, and which are read here."""
SUPPORTED = (*IN_ONE_FILE, ".ply", ".gltf", ".glb")


class MeshData(NamedTuple):
    """What a mesh file holds, unscaled, in the frame of the shape (z up).

    Attributes:
        vertices: [m], shape (n, 3).
        triangles: vertex numbers, counter-clockwise seen from outside, shape (m, 3).
        tetrahedra: vertex numbers of a volume mesh, shape (k, 4), or None.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    tetrahedra: np.ndarray | None


def read_mesh(source: MeshSource, call: str = "reading a mesh") -> MeshData:
    """The vertices and triangles of a mesh file or an in-memory mesh.

    Args:
        source: where the mesh is.
        call: what the caller is doing, for messages.

    Raises:
        RuntimeError: the file is missing, can not be read, or has an unsupported format.
    """
    check_mesh(source, call)
    if source.is_path():
        path = source.path()
        return _read_file(path, path.stat().st_mtime_ns)
    mesh = source.in_memory()
    contents = mesh.mesh_file.contents()
    return parse(contents, source.extension(), source.description(), MemoryFiles(mesh.supporting_files))


def check_mesh(source: MeshSource, call: str) -> None:
    """Refuses a mesh whose file is not there, or that is of no format which is read; without reading it.

    Raises:
        RuntimeError: in these cases.
    """
    extension = source.extension()
    if extension not in SUPPORTED:
        raise RuntimeError(
            f"{call}: unsupported extension '{extension}' for geometry data: {source.description()}; "
            f"supported are {', '.join(SUPPORTED)}."
        )
    if source.is_path():
        try:
            source.path().stat()
        except OSError as error:
            raise RuntimeError(f"{call}: cannot read the file '{source.path()}': {error.strerror}.") from None


@functools.lru_cache(maxsize=64)
def _read_file(path: Path, stamp: int) -> MeshData:
    """Cached while the file's time of change stays the same."""
    return parse(bytes_of(path), path.suffix.lower(), str(path), DiskFiles(path.parent))


def bytes_of(path: Path) -> bytes:
    """What a mesh file holds.

    Raises:
        RuntimeError: it can not be read.
    """
    try:
        return regular_bytes(path)
    except OSError as error:
        raise RuntimeError(f"cannot read the mesh file '{path}': {error.strerror}.") from None


def parse(data: bytes, extension: str, name: str, files: MemoryFiles | DiskFiles | None = None) -> MeshData:
    """The mesh in the bytes of a file; `files` gives others that it names, where it is not `IN_ONE_FILE`.

    Raises:
        RuntimeError: whatever a reader stumbles over; the message names the file.
    """
    try:
        mesh = _read(data, extension, name, files or MemoryFiles({}))
    except Exception as error:
        if type(error) is RuntimeError:  # of our own readers
            raise
        raise RuntimeError(f"{name}: cannot read the {extension} mesh: {what_is_wrong(error).rstrip('.')}.") from error
    if not np.all(np.isfinite(mesh.vertices)):
        raise RuntimeError(f"{name}: a vertex is not finite.")
    for corners in (mesh.triangles, mesh.tetrahedra):
        if corners is not None and corners.size and not 0 <= corners.min() <= corners.max() < len(mesh.vertices):
            raise RuntimeError(f"{name}: a corner names a vertex that is not among the {len(mesh.vertices)}.")
    return mesh


def what_is_wrong(error: Exception) -> str:
    """What readers of others stumbled over, in words."""
    if isinstance(error, OSError) and error.filename:
        return f"the file '{error.filename}' that it names: {error.strerror}"
    return str(error)[:200] or type(error).__name__


def _read(data: bytes, extension: str, name: str, files: MemoryFiles | DiskFiles) -> MeshData:
    tetrahedra = None
    if extension == ".obj":
        vertices, polygons = read_obj(data.decode("utf-8", "replace"), name)
        polygons = _quadrilaterals_divided(vertices, polygons)
    elif extension == ".stl":
        return MeshData(*read_stl(data, name), None)
    elif extension == ".dae":
        vertices, polygons = read_dae(data, name)
    elif extension == ".vtk":
        vertices, polygons, tetrahedra = read_vtk(data, name)
        if tetrahedra is not None:
            polygons = boundary_triangles(tetrahedra).tolist()
    else:
        if extension == ".ply":
            _check_rows_of_ply(data, name)
        else:
            check_gltf(data, extension, name, files.get)
        return MeshData(*_read_with_trimesh(data, extension, files), None)
    return MeshData(vertices, fans(polygons), tetrahedra)


def _quadrilaterals_divided(vertices: np.ndarray, polygons: Any) -> Any:
    """Polygons with those of four corners divided along their shorter diagonal, as Drake does; of equals the second."""
    if isinstance(polygons, np.ndarray):
        return polygons
    fours = np.array([p for p in polygons if len(p) == 4], np.int64).reshape(-1, 4)
    if len(fours) == 0 or fours.max() >= len(vertices):
        return polygons
    corner = vertices[fours]
    first, second = (((corner[:, k + 2] - corner[:, k]) ** 2).sum(axis=1) for k in (0, 1))
    along_first = iter((first < second).tolist())
    divided: list[list[int]] = []
    for p in polygons:
        if len(p) != 4:
            divided.append(p)
        elif next(along_first):
            divided += [[p[0], p[1], p[2]], [p[0], p[2], p[3]]]
        else:
            divided += [[p[0], p[1], p[3]], [p[1], p[2], p[3]]]
    return divided


def boundary_triangles(tetrahedra: np.ndarray) -> np.ndarray:
    """Faces that belong to one tetrahedron only, normals pointing out, shape (m, 3).

    The first three vertices of a tetrahedron have their normal pointing in, towards the fourth.
    """
    faces = tetrahedra[:, [[2, 1, 0], [1, 3, 0], [3, 2, 0], [1, 2, 3]]].reshape(-1, 3)
    _, first, counts = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    return faces[np.sort(first[counts == 1])]


def _check_rows_of_ply(data: bytes, name: str) -> None:
    """Refuses a PLY file that has fewer rows than its header says; trimesh takes what there is."""
    header, _, body = data.partition(b"end_header")
    rows = sum(int(count) for count in re.findall(rb"^\s*element\s+\S+\s+(\d+)", header, re.MULTILINE))
    held = len(body.split(b"\n")) if b"format ascii" in header else len(body)  # a row has a byte at least
    if rows > held:
        raise RuntimeError(f"{name}: the PLY file says it has {rows} rows, but holds {held} at most.")


def _read_with_trimesh(data: bytes, extension: str, files: Any) -> tuple[np.ndarray, np.ndarray]:
    trimesh = imported("trimesh")

    loaded = trimesh.load(io.BytesIO(data), file_type=extension[1:], resolver=files, process=False, skip_materials=True)
    for part in loaded.geometry.values() if isinstance(loaded, trimesh.Scene) else ():
        check_corners(part)
    mesh = loaded.to_geometry() if isinstance(loaded, trimesh.Scene) else loaded
    vertices = np.array(getattr(mesh, "vertices", ()), dtype=float).reshape(-1, 3)
    triangles = np.array(getattr(mesh, "faces", ()), dtype=np.int64).reshape(-1, 3)
    if extension in (".gltf", ".glb"):  # y up to z up
        vertices = vertices[:, [0, 2, 1]] * [1.0, -1.0, 1.0]
    return vertices, triangles


def check_corners(part: Any) -> None:
    """Checks that the triangles of a part, if it has any, are made of its own vertices.

    Raises:
        ValueError: they are not. Where parts are put together, such a corner would be one of another part.
    """
    faces, count = np.asarray(getattr(part, "faces", ())), len(part.vertices)
    if len(faces) and not 0 <= faces.min() <= faces.max() < count:
        raise ValueError(f"a corner names a vertex that is not among the {count}")


_PICTURES = frozenset({".png", ".jpg", ".jpeg", ".bmp", ".gif", ".tga", ".tif", ".tiff", ".webp"})


class DiskFiles:
    """Gives the files that a mesh names, relative to the folder of the mesh and within its package.

    The package is the closest folder above that holds a package.xml; where there is none, the folder that holds the
    folder of the mesh (but not the user's home), so that `meshes/a.gltf` may name `../textures/a.png`.

    Attributes:
        problems: What was wrong with files that could not be given; trimesh goes on without a texture.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = Path(os.path.abspath(folder))  # not resolved: links within a package are its own
        above = (f for f in (self._folder, *self._folder.parents) if (f / "package.xml").is_file())
        home = self._folder.parent
        self._package = next(above, self._folder if home in (Path(home.anchor), Path.home()) else home)
        self.problems: list[str] = []

    def get(self, name: str) -> bytes:
        path = Path(os.path.abspath(self._folder / name.strip()))
        if not path.exists():  # glTF writes a space as %20
            path = Path(os.path.abspath(self._folder / unquote(name.strip())))
        if not path.is_relative_to(self._package):
            self.problems.append(
                f"the mesh names the file {name!r}, which is not in its package '{self._package}': copy that file "
                "beside the mesh and name it there."
            )
            raise ValueError(self.problems[-1])
        try:
            data = regular_bytes(path)
            if path.suffix.lower() in _PICTURES:
                check_picture(data)
        except OSError as error:
            self.problems.append(f"the mesh names the file {name!r}: {(error.strerror or str(error)).rstrip('.')}.")
            raise
        return data

    __getitem__ = get  # trimesh asks in either way


class MemoryFiles:
    """The same from the supporting files of an InMemoryMesh, in memory or on disk."""

    def __init__(self, files: dict[str, Any]) -> None:
        self._files = files
        self.problems: list[str] = []

    def get(self, name: str) -> bytes:
        found = self._files.get(name, self._files.get(name.strip()))
        if found is None:
            self.problems.append(
                f"the mesh names {name!r}, which is not among its supporting files: {list(self._files)}."
            )
            raise KeyError(self.problems[-1])
        try:
            data = bytes(found.contents()) if hasattr(found, "contents") else regular_bytes(found)
            if Path(name.strip()).suffix.lower() in _PICTURES:
                check_picture(data)
        except OSError as error:
            self.problems.append(f"the mesh names the file {name!r}: {(error.strerror or str(error)).rstrip('.')}.")
            raise
        return data

    __getitem__ = get
