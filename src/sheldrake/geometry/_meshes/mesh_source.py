"""Where the data of a mesh comes from: a file, or bytes held in memory."""

from __future__ import annotations

import copy
import os
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from sheldrake.common import MemoryFile


class InMemoryMesh:
    """A mesh file and the files it names (materials, images, buffers), all held in memory.

    Attributes:
        mesh_file: MemoryFile with the mesh itself.
        supporting_files: name in the mesh file -> MemoryFile or path.
    """

    __fields__ = (
        SimpleNamespace(name="mesh_file", type=MemoryFile),
        SimpleNamespace(name="supporting_files", type=dict[str, Any]),
    )

    def __init__(self, mesh_file: MemoryFile | None = None, supporting_files: dict[str, Any] | None = None) -> None:
        self.mesh_file = MemoryFile() if mesh_file is None else mesh_file
        files = {} if supporting_files is None else supporting_files
        self.supporting_files = {k: v if isinstance(v, MemoryFile) else Path(v) for k, v in files.items()}

    def __copy__(self) -> InMemoryMesh:
        return InMemoryMesh(self.mesh_file, self.supporting_files)

    def __deepcopy__(self, memo: dict) -> InMemoryMesh:
        return InMemoryMesh(copy.deepcopy(self.mesh_file, memo), copy.deepcopy(self.supporting_files, memo))

    def __repr__(self) -> str:
        supporting = f", supporting_files={self.supporting_files!r}" if self.supporting_files else ""
        return f"InMemoryMesh(mesh_file={self.mesh_file!r}{supporting})"


class MeshSource:
    """A path on disk or an InMemoryMesh."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        (source,) = (*args, *kwargs.values()) if len(args) + len(kwargs) == 1 else (None,)
        unknown = set(kwargs) - {"path", "mesh", "other"}
        if source is None or unknown:
            raise TypeError("MeshSource(): expected one argument: path, mesh (InMemoryMesh) or other (MeshSource).")
        if isinstance(source, MeshSource):
            source = source._source
        if not isinstance(source, (InMemoryMesh, str, os.PathLike)):
            raise TypeError(f"MeshSource(): expected a path or an InMemoryMesh, got {type(source).__name__}.")
        self._source: Path | InMemoryMesh = source if isinstance(source, InMemoryMesh) else Path(source)

    def is_path(self) -> bool:
        """True if the mesh is a file on disk."""
        return isinstance(self._source, Path)

    def is_in_memory(self) -> bool:
        """True if the mesh is held in memory."""
        return not self.is_path()

    def path(self) -> Path:
        """The file.

        Raises:
            RuntimeError: the mesh is held in memory.
        """
        if not isinstance(self._source, Path):
            raise RuntimeError(f"MeshSource.path(): the mesh '{self.description()}' is held in memory.")
        return self._source

    def in_memory(self) -> InMemoryMesh:
        """The mesh in memory.

        Raises:
            RuntimeError: the mesh is a file.
        """
        if isinstance(self._source, Path):
            raise RuntimeError(f"MeshSource.in_memory(): the mesh is the file '{self._source}'.")
        return self._source

    def description(self) -> str:
        """A name for messages: the path, or the hint given with the memory."""
        return str(self._source) if isinstance(self._source, Path) else self._source.mesh_file.filename_hint()

    def extension(self) -> str:
        """The lower-case extension with its dot, e.g. `.obj`."""
        if isinstance(self._source, Path):
            return self._source.suffix.lower()
        return self._source.mesh_file.extension().lower()

    def __copy__(self) -> MeshSource:
        return MeshSource(self)

    def __deepcopy__(self, memo: dict) -> MeshSource:
        return MeshSource(copy.deepcopy(self._source, memo))

    def __repr__(self) -> str:
        return f"MeshSource(path={str(self._source)!r})" if self.is_path() else f"MeshSource(mesh={self._source!r})"
