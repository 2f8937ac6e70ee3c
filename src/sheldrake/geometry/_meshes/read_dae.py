"""Reader of COLLADA (.dae): the triangles of all geometry the scene shows, with z up and in metres."""

from __future__ import annotations

import itertools
import xml.etree.ElementTree as ElementTree
from typing import Any, NamedTuple

import numpy as np

# Rotations that bring the file's up axis to z.
_TO_Z_UP = {
    "X_UP": np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]]),
    "Y_UP": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
    "Z_UP": np.eye(3),
}
_MAX_NODES = 100_000  # nodes that name nodes that name nodes: a small file can ask for any number


class PlacedMesh(NamedTuple):
    """A mesh of the scene.

    Attributes:
        mesh: The element.
        X_GM: Its transform in the file's coordinates with z up, and its unit made 1 m, shape (4, 4).
        materials: Name of a material in the mesh -> id of the material.
    """

    mesh: Any
    X_GM: np.ndarray
    materials: dict[str, str]


def open_dae(data: bytes, name: str) -> tuple[list[PlacedMesh], dict[str, Any]]:
    """All meshes which the scene of a COLLADA file shows, and its elements by id.

    Raises:
        RuntimeError: not XML.
    """
    try:
        root = ElementTree.fromstring(data)
    except ElementTree.ParseError as error:
        raise RuntimeError(f"{name}: cannot read the COLLADA file: {error}.") from None
    for element in root.iter():
        element.tag = element.tag.split("}", 1)[-1]
    known = {str(element.get("id")): element for element in root.iter() if element.get("id")}
    unit = root.find("asset/unit")
    up = root.findtext("asset/up_axis", "Y_UP").strip()
    X_GF = np.eye(4)
    X_GF[:3, :3] = _TO_Z_UP[up] * (1.0 if unit is None else float(unit.get("meter", "1")))
    return [PlacedMesh(mesh, X_GF @ X, materials) for mesh, X, materials in _placed_meshes(root, known)], known


def read_dae(data: bytes, name: str) -> tuple[np.ndarray, list[list[int]]]:
    """Vertices [m], shape (n, 3), and polygons of a COLLADA file.

    Raises:
        RuntimeError: not XML, or a polygon list this reader does not know.
    """
    placed, known = open_dae(data, name)
    vertices: list[np.ndarray] = []
    faces: list[list[int]] = []
    for mesh, X, _ in placed:
        points, polygons = _polygons(mesh, known, name)
        offset = sum(len(v) for v in vertices)
        vertices.append(points @ X[:3, :3].T + X[:3, 3])
        faces.extend([v + offset for v in polygon] for polygon in polygons)
    return np.concatenate(vertices) if vertices else np.zeros((0, 3)), faces


def _placed_meshes(root: Any, known: dict) -> list[tuple[Any, np.ndarray, dict[str, str]]]:
    """Each mesh with the transform of its node and its materials; meshes as they are if the file has no scene."""
    scene = root.find("library_visual_scenes/visual_scene")
    if scene is None:
        return [(mesh, np.eye(4), {}) for mesh in root.iter("mesh")]
    placed: list[tuple[Any, np.ndarray, dict[str, str]]] = []
    visits = 0

    def visit(node: Any, X_parent: np.ndarray, depth: int = 0) -> None:
        nonlocal visits
        visits += 1
        if visits > _MAX_NODES:
            raise ValueError(f"the scene has more than {_MAX_NODES} nodes")
        X = X_parent
        for child in node:
            if child.tag in ("matrix", "translate", "rotate", "scale"):
                X = X @ _transform(child)
            elif child.tag == "instance_geometry":
                mesh = known[child.get("url")[1:]].find("mesh")
                if mesh is not None:
                    bound = {str(m.get("symbol")): m.get("target")[1:] for m in child.iter("instance_material")}
                    placed.append((mesh, X, bound))
            elif child.tag == "node":
                visit(child, X, depth + 1)
            elif child.tag == "instance_node" and depth < 64:
                visit(known[child.get("url")[1:]], X, depth + 1)

    visit(scene, np.eye(4))
    return placed


def _transform(element: Any) -> np.ndarray:
    values = np.array(element.text.split(), dtype=float)
    X = np.eye(4)
    if element.tag == "matrix":
        return values.reshape(4, 4)
    if element.tag == "translate":
        X[:3, 3] = values
    elif element.tag == "scale":
        X[:3, :3] = np.diag(values)
    else:
        axis, angle = values[:3] / np.linalg.norm(values[:3]), np.radians(values[3])
        K = np.cross(np.eye(3), -axis)
        X[:3, :3] += np.sin(angle) * K + (1.0 - np.cos(angle)) * (K @ K)
    return X


def _polygons(mesh: Any, known: dict, name: str) -> tuple[np.ndarray, list[list[int]]]:
    points = vertex_positions(mesh, known)
    polygons = []
    for group in polygon_groups(mesh, name):
        _, offset = group_inputs(group)["VERTEX"]
        polygons += [corners[:, offset].tolist() for corners in group_polygons(group)]
    return points, polygons


def vertex_positions(mesh: Any, known: dict) -> np.ndarray:
    """Vertices of a mesh, shape (n, 3), in its own coordinates."""
    position = next(i for i in mesh.find("vertices") if i.get("semantic") == "POSITION")
    return source_rows(known[position.get("source")[1:]])[:, :3]


def source_rows(source: Any) -> np.ndarray:
    """Rows of a <source> of numbers."""
    stride = int(source.find("technique_common/accessor").get("stride", "3"))
    return np.array(source.findtext("float_array").split(), dtype=float).reshape(-1, stride)


def polygon_groups(mesh: Any, name: str) -> list[Any]:
    """The elements of a mesh that list polygons.

    Raises:
        RuntimeError: for a kind of list this reader does not know.
    """
    for group in mesh:
        if group.tag in ("trifans", "tristrips"):
            raise RuntimeError(f"{name}: COLLADA <{group.tag}> is not supported.")
    return [group for group in mesh if group.tag in ("triangles", "polylist", "polygons")]


def group_inputs(group: Any) -> dict[str, tuple[str, int]]:
    """Id of the source, and column among a corner's numbers, of each input of a group; the first of each kind."""
    inputs: dict[str, tuple[str, int]] = {}
    for i in group.findall("input"):
        inputs.setdefault(i.get("semantic"), (i.get("source")[1:], int(i.get("offset", "0"))))
    return inputs


def group_polygons(group: Any) -> list[np.ndarray]:
    """The polygons of a group; each has the numbers of one corner in a row."""
    width = 1 + max(int(i.get("offset", "0")) for i in group.findall("input"))
    polygons = []
    for p in group.findall("p"):
        corners = np.array((p.text or "").split(), dtype=np.int64).reshape(-1, width)
        polygons += _split(corners, group)
    return polygons


def _split(corners: np.ndarray, group: Any) -> list[np.ndarray]:
    if group.tag == "polygons":
        return [corners]
    sizes = [int(s) for s in group.findtext("vcount", "").split()] if group.tag == "polylist" else []
    sizes = sizes or [3] * (len(corners) // 3)
    ends = np.cumsum([0, *sizes])
    return [corners[a:b] for a, b in itertools.pairwise(ends)]
