"""Mesh files to look at, read by trimesh, with the colors and textures they come with."""

from __future__ import annotations

import functools
import io
import logging
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sheldrake.common._ctrl_c import imported
from sheldrake.common._files import regular_bytes

from .check_gltf import check_gltf
from .dae_looks import dae_scene
from .mesh_files import SUPPORTED, DiskFiles, MemoryFiles, check_corners, read_mesh, what_is_wrong
from .mesh_source import MeshSource
from .read_obj import first_fault

if TYPE_CHECKING:
    from collections.abc import Callable

    from sheldrake.geometry._shapes import Convex, Mesh

log = logging.getLogger("drake")

# glTF has +y up, Drake's world has +z up: +y of the file becomes +z.
_Y_UP_TO_Z_UP = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])


class MeshPart(NamedTuple):
    """Triangles of one material.

    Attributes:
        vertices: Shape (n, 3) [m].
        faces: Shape (m, 3).
        normals: Of the vertices, as the file says, shape (n, 3), or None.
        uv: Texture coordinates, shape (n, 2), or None.
        colors: Of the vertices, in [0, 1], shape (n, 3), or None.
        diffuse: Color (r, g, b, a) of the material in [0, 1], or None where the file has none.
        image: Texture, a Pillow image, or None.
    """

    vertices: np.ndarray
    faces: np.ndarray
    normals: np.ndarray | None
    uv: np.ndarray | None
    colors: np.ndarray | None
    diffuse: tuple[float, ...] | None
    image: Any


class LoadedMesh:
    """A mesh file in memory.

    Attributes:
        vertices: Shape (n, 3) [m].
        faces: Shape (m, 3).
        has_materials: Whether the file brings colors or textures of its own.
    """

    def __init__(self, scene: Any):
        self._scene = scene
        merged = scene.to_geometry() if hasattr(scene, "to_geometry") else scene.dump(concatenate=True)
        self.vertices = np.asarray(merged.vertices, dtype=float)
        self.faces = np.asarray(merged.faces, dtype=np.int64)
        self.has_materials = any(_has_material(mesh) for mesh in scene.geometry.values())

    @functools.cached_property
    def parts(self) -> list[MeshPart]:
        """The mesh, material by material."""
        placed = (self._scene.graph[node] for node in self._scene.graph.nodes_geometry)
        return [_part(self._scene.geometry[name], np.asarray(transform, float)) for transform, name in placed]

    @functools.lru_cache(maxsize=8)  # noqa: B019  a handful of opacities of a mesh that lives as long as the scene
    def glb(self, opacity: float = 1.0) -> bytes:
        """Returns the mesh as binary glTF, its opacity multiplied by a number in [0, 1]."""
        scene = self._scene
        if opacity < 1.0:
            scene = scene.copy()
            for mesh in scene.geometry.values():
                _fade(mesh, opacity)
        return scene.export(file_type="glb")


def _part(mesh: Any, M: np.ndarray) -> MeshPart:
    """One geometry of a scene, moved to where it belongs by an affine map, shape (4, 4)."""
    faces = np.asarray(mesh.faces, np.int64)
    normals, volume = None, np.linalg.det(M[:3, :3])
    if "vertex_normals" in mesh._cache.cache and volume != 0.0:  # else trimesh would make them up; flattened, none fit
        normals = np.asarray(mesh.vertex_normals, float) @ np.linalg.inv(M[:3, :3])
    if volume < 0.0:
        faces = faces[:, ::-1]
    visual, uv, colors = mesh.visual, None, None
    if visual.kind == "texture" and visual.uv is not None:
        uv = np.asarray(visual.uv, float)[:, :2]
    if visual.kind == "vertex":
        colors = np.asarray(visual.vertex_colors, float)[:, :3] / 255.0
    diffuse, image = _material(mesh) if _has_material(mesh) else (None, None)
    return MeshPart(np.asarray(mesh.vertices) @ M[:3, :3].T + M[:3, 3], faces, normals, uv, colors, diffuse, image)


def _material(mesh: Any) -> tuple[tuple[float, ...], Any]:
    """Color and texture of a mesh that brings them."""
    material = getattr(mesh.visual, "material", None)
    if material is None:
        return (1.0, 1.0, 1.0, 1.0), None
    if hasattr(material, "baseColorFactor"):  # glTF
        image, color = material.baseColorTexture, material.baseColorFactor
        color = np.full(4, 255.0) if color is None else np.asarray(color, float)
        return tuple(color / (255.0 if color.max() > 1.0 else 1.0)), image
    return tuple(np.asarray(material.diffuse, float) / 255.0), material.image


def _has_material(mesh: Any) -> bool:
    visual = mesh.visual
    if visual.kind != "texture":
        return visual.kind in ("vertex", "face") and visual.defined
    material = visual.material
    if hasattr(material, "baseColorFactor"):  # glTF
        return any(value is not None for value in (material.baseColorFactor, material.baseColorTexture, material.name))
    return bool(material.kwargs)  # OBJ: what the MTL file said; empty when that file is missing


def _fade(mesh: Any, opacity: float) -> None:
    from trimesh.visual.color import ColorVisuals

    if mesh.visual.kind == "texture":
        material = mesh.visual.material
        material = material.to_pbr() if hasattr(material, "to_pbr") else material.copy()
        color = np.asarray(material.baseColorFactor if material.baseColorFactor is not None else [255] * 4, dtype=float)
        if color.max() <= 1.0:
            color = color * 255
        material.baseColorFactor = np.append(color[:3], color[3] * opacity if len(color) == 4 else 255 * opacity)
        material.alphaMode = "BLEND"
        mesh.visual.material = material
    else:
        colors = np.array(mesh.visual.vertex_colors, dtype=float)
        colors[:, 3] *= opacity
        mesh.visual = ColorVisuals(mesh, vertex_colors=colors.astype(np.uint8))


def load_mesh(shape: Mesh | Convex, call: str = "Meshcat.SetObject()") -> LoadedMesh:
    """Returns the mesh of a Mesh shape, scaled; the last ones read are remembered.

    Args:
        shape: The shape.
        call: Who wants it, for messages.

    Raises:
        RuntimeError: when the file is missing or cannot be read.
    """
    source: MeshSource = shape.source()
    x, y, z = (float(s) for s in shape.scale3())
    scale = (x, y, z)
    if not source.is_path():
        mesh = source.in_memory()
        files = MemoryFiles(mesh.supporting_files)
        return _said(_load(lambda: bytes(mesh.mesh_file.contents()), source, files, scale, call), source, files)
    path = Path(source.path())
    if not path.exists():
        raise RuntimeError(f"{call}: mesh file '{path}' does not exist.")
    stat = path.stat()
    return _load_path(path, stat.st_mtime_ns, stat.st_size, scale, call)


@functools.lru_cache(maxsize=64)
def _load_path(path: Path, _time: int, _size: int, scale: tuple[float, float, float], call: str) -> LoadedMesh:
    source, files = MeshSource(path), DiskFiles(path.parent)
    return _said(_load(lambda: regular_bytes(path), source, files, scale, call), source, files)


def _said(mesh: LoadedMesh, source: MeshSource, files: DiskFiles | MemoryFiles) -> LoadedMesh:
    """The mesh, after it is said which of the files that it names could not be given."""
    for problem in dict.fromkeys(files.problems):
        log.warning("%s: %s It is drawn without.", source.description(), problem)
    return mesh


def _load(
    read: Callable[[], bytes],
    source: MeshSource,
    files: DiskFiles | MemoryFiles,
    scale: tuple[float, float, float],
    call: str,
) -> LoadedMesh:
    """The triangles of a mesh with the files that it names, scaled.

    Where it cannot be drawn, what the readers of its triangles say is said: they know the place in the file.
    """
    trimesh = imported("trimesh")

    kind, name, data = source.extension(), source.description(), b""
    try:
        data = read()
        if kind == ".dae":  # trimesh needs another library for it
            scene = dae_scene(data, Path(name).name, files.get)
        else:
            if kind in (".gltf", ".glb"):
                for problem in check_gltf(data, kind, Path(name).name, files.get):
                    log.warning("%s: %s It is drawn without.", name, problem)
            given: Any = files  # all that trimesh asks of a resolver
            scene = trimesh.load_scene(io.BytesIO(data), file_type=kind[1:], resolver=given)
        mesh = LoadedMesh(_scaled(scene, source, scale))
        if mesh.vertices.shape[1:] != (3,) or not np.isfinite(mesh.vertices).all():
            raise ValueError("a vertex is not three finite numbers")
        return mesh
    except Exception as error:
        if kind in SUPPORTED and not isinstance(error, OSError):
            try:
                read_mesh(source, call)
            except RuntimeError as better:
                raise RuntimeError(f"{call}: {better}") from None
        fault = (
            first_fault(data.decode("utf-8", "replace")) if kind == ".obj" and not isinstance(error, OSError) else ""
        )
        raise RuntimeError(f"{call}: cannot read mesh '{name}': {fault or what_is_wrong(error)}") from None


def _check_numbers(part: Any) -> None:
    """Checks that triangles are made of vertices that are there, and that each vertex has what vertices have.

    Raises:
        ValueError: with what was found and what was expected. Kernels that draw look at no index.
    """
    check_corners(part)
    count = len(part.vertices)
    uv = getattr(part.visual, "uv", None)
    if uv is not None and (np.shape(uv)[:1] != (count,) or np.ndim(uv) != 2 or np.shape(uv)[1] < 2):
        found = f"its texture coordinates have shape {np.shape(uv)}"
        raise ValueError(f"{found}; expected two for each of {count} vertices")


def _scaled(scene: Any, source: MeshSource, scale: tuple[float, float, float]) -> Any:
    scene.delete_geometry(
        [name for name, part in scene.geometry.items() if not hasattr(part, "faces")]
    )  # lines, points
    if not scene.geometry:
        raise RuntimeError("it has no triangles.")
    for part in scene.geometry.values():
        _check_numbers(part)
    if source.extension() in (".gltf", ".glb"):
        scene.apply_transform(_Y_UP_TO_Z_UP)
    if scale != (1.0, 1.0, 1.0):
        scene.apply_transform(np.diag([*scale, 1.0]))
    return scene
