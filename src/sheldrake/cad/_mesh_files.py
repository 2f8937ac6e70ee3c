"""The mesh files that a written description names."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sheldrake.geometry import MeshSource

_DRAKES = (".obj", ".vtk", ".gltf", ".glb")  # formats that Drake takes for contact


def check_folder(call: str, path: Path) -> None:
    """Raises FileNotFoundError where there is no folder for the file that a call is to write."""
    if not path.parent.is_dir():
        raise FileNotFoundError(f"{call}: there is no folder '{path.parent}' to write '{path.name}' to.")


class MeshFiles:
    """Names meshes for a file in a folder, and writes those that need it.

    Args:
        folder: Where the description will be.
        as_obj: Write an OBJ file for every mesh of a format that is not taken.
        taken: Formats that the reader of the description takes; by default Drake's.

    Attributes:
        written: The files written.
        foreign: Names of mesh files of a format that is not taken.
    """

    def __init__(self, folder: Path, as_obj: bool, taken: tuple[str, ...] = _DRAKES):
        self._folder, self._as_obj, self._taken = folder, as_obj, taken
        self._known: dict[Any, str] = {}
        self.written: list[Path] = []
        self.foreign: list[str] = []

    def name(self, shape: Any) -> str:
        """What the description calls the mesh of a shape."""
        source = shape.source()
        key = str(source.path().resolve()) if source.is_path() else id(source.in_memory())
        if key not in self._known:
            self._known[key] = self._name(source)
        return self._known[key]

    def _name(self, source: MeshSource) -> str:
        is_foreign = source.extension() not in self._taken or not _is_taken_stl(source)
        stem = Path(source.description() or "mesh").stem or "mesh"
        if is_foreign and self._as_obj:
            return self._write(stem, ".obj", _as_obj(source))
        if is_foreign:
            self.foreign.append(f"{stem}{source.extension()}")
        if source.is_path():
            return Path(os.path.relpath(source.path().resolve(), self._folder.resolve())).as_posix()
        contents = source.in_memory().mesh_file.contents()
        return self._write(stem, source.extension(), contents if isinstance(contents, bytes) else bytes(contents))

    def _write(self, stem: str, extension: str, contents: bytes) -> str:
        path, number = self._folder / f"{stem}{extension}", 1
        while path.exists() and path.read_bytes() != contents:
            number += 1
            path = self._folder / f"{stem}_{number}{extension}"
        path.write_bytes(contents)
        self.written.append(path)
        return path.name


def _is_taken_stl(source: MeshSource) -> bool:
    """Whether a mesh, if it is STL, is one that MuJoCo takes: binary, with at most 200,000 faces."""
    if source.extension() != ".stl":
        return True
    data = source.path().read_bytes() if source.is_path() else source.in_memory().mesh_file.contents()
    num_faces = int.from_bytes(bytes(data[80:84]), "little")
    return 1 <= num_faces <= 200_000 and len(data) == 84 + 50 * num_faces


def _as_obj(source: MeshSource) -> bytes:
    """The triangles of a mesh as an OBJ file, in the shape's frame and metres."""
    from sheldrake.geometry._meshes.mesh_files import read_mesh

    mesh = read_mesh(source, "WriteModel()")
    lines = [f"# made from {Path(source.description()).name}"]
    lines += ["v {!r} {!r} {!r}".format(*vertex) for vertex in mesh.vertices.tolist()]
    lines += ["f {} {} {}".format(*triangle) for triangle in (mesh.triangles + 1).tolist()]
    return ("\n".join(lines) + "\n").encode()
