"""Volume meshes without elements whose corners are all on the surface: hydroelastic pressure would vanish in them."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np

from sheldrake.common._checked import checked

from .mesh_files import boundary_triangles, read_mesh
from .mesh_source import MeshSource
from .volume_mesh import VolumeMesh

if TYPE_CHECKING:
    from os import PathLike

    from sheldrake.geometry._meshes.mesh_source import InMemoryMesh


@checked
def RefineVolumeMesh(mesh: VolumeMesh) -> VolumeMesh:
    """A mesh in which every edge, triangle and tetrahedron inside has a corner inside.

    Edges inside whose ends are both on the surface get a new vertex in their middle; then triangles, then tetrahedra,
    each in its centroid.

    Returns:
        The refined mesh, or a copy where nothing is to be done.
    """
    vertices, tetrahedra = _refine(mesh._vertices, mesh._elements)
    return VolumeMesh(tetrahedra.tolist(), vertices)


def RefineVolumeMeshIntoVtkFileContents(mesh_source: str | PathLike[str] | MeshSource | InMemoryMesh) -> str:
    """The contents of an ASCII VTK file with the refined mesh of a source (MeshSource, path or InMemoryMesh).

    Raises:
        RuntimeError: the source can not be read, or is not a volume mesh in a VTK file.
    """
    call = "RefineVolumeMeshIntoVtkFileContents()"
    source = mesh_source if isinstance(mesh_source, MeshSource) else MeshSource(mesh_source)
    if source.extension() != ".vtk":
        raise RuntimeError(f"{call}: expected a .vtk file, got {source.description()}.")
    data = read_mesh(source, call)
    if data.tetrahedra is None:
        raise RuntimeError(f"{call}: there are no tetrahedra in {source.description()}.")
    vertices, tetrahedra = _refine(data.vertices, data.tetrahedra)
    points = "\n".join(" ".join(repr(float(x)) for x in p) for p in vertices)
    cells = "\n".join(" ".join(map(str, (4, *t))) for t in tetrahedra.tolist())
    kinds = "\n".join(["10"] * len(tetrahedra))
    return (
        "# vtk DataFile Version 3.0\nrefined volume mesh\nASCII\nDATASET UNSTRUCTURED_GRID\n"
        f"POINTS {len(vertices)} double\n{points}\n"
        f"CELLS {len(tetrahedra)} {5 * len(tetrahedra)}\n{cells}\n"
        f"CELL_TYPES {len(tetrahedra)}\n{kinds}\n"
    )


def _refine(vertices: np.ndarray, tetrahedra: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    points, tets = vertices.tolist(), tetrahedra.tolist()
    triangles = boundary_triangles(tetrahedra)
    on_surface = set(triangles.ravel().tolist())
    of_surface: set[tuple[int, ...]] = {tuple(sorted(t)) for t in triangles.tolist()}
    of_surface |= {edge for t in of_surface for edge in itertools.combinations(t, 2)}
    around: list[set[int]] = [set() for _ in points]  # the tetrahedra at each vertex
    for e, tet in enumerate(tets):
        for v in tet:
            around[v].add(e)
    for size in (2, 3, 4):
        wanted = {part for tet in tets for part in itertools.combinations(sorted(tet), size) if on_surface >= set(part)}
        for part in sorted(wanted - of_surface):
            _split(points, tets, around, part)
    return np.array(points).reshape(-1, 3), np.array(tets, np.int64).reshape(-1, 4)


def _split(points: list, tets: list, around: list[set[int]], part: tuple[int, ...]) -> None:
    """Puts a vertex into the middle of an edge, triangle or tetrahedron, and divides what it belongs to."""
    new = len(points)
    points.append(np.mean([points[v] for v in part], axis=0).tolist())
    around.append(set())
    for e in sorted(set.intersection(*(around[v] for v in part))):
        old = tets[e]
        first, *others = [[new if v == gone else v for v in old] for gone in part]
        around[part[0]].discard(e)
        around[new].add(e)
        tets[e] = first
        for other in others:
            for v in other:
                around[v].add(len(tets))
            tets.append(other)
