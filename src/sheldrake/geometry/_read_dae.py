"""Reader of COLLADA (.dae): the triangles of all geometry the scene shows, with z up and in metres."""

from __future__ import annotations

import itertools
import xml.etree.ElementTree as ElementTree
from typing import Any

import numpy as np

# Rotations that bring the file's up axis to z.
_TO_Z_UP = {
    "X_UP": np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]]),
    "Y_UP": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
    "Z_UP": np.eye(3),
}


def read_dae(data: bytes, name: str) -> tuple[np.ndarray, list[list[int]]]:
    """Vertices [m], shape (n, 3), and polygons of a COLLADA file.

    Raises:
        RuntimeError: not XML, or a polygon list this reader does not know.
    """
    try:
        root = ElementTree.fromstring(data)
    except ElementTree.ParseError as error:
        raise RuntimeError(f"{name}: cannot read the COLLADA file: {error}.") from None
    for element in root.iter():
        element.tag = element.tag.split("}", 1)[-1]
    known = {element.get("id"): element for element in root.iter() if element.get("id")}
    unit = root.find("asset/unit")
    up = root.findtext("asset/up_axis", "Y_UP").strip()
    to_G = _TO_Z_UP[up] * (1.0 if unit is None else float(unit.get("meter", "1")))
    vertices: list[np.ndarray] = []
    faces: list[list[int]] = []
    for mesh, X in _placed_meshes(root, known):
        points, polygons = _polygons(mesh, known, name)
        offset = sum(len(v) for v in vertices)
        vertices.append((points @ X[:3, :3].T + X[:3, 3]) @ to_G.T)
        faces.extend([v + offset for v in polygon] for polygon in polygons)
    return np.concatenate(vertices) if vertices else np.zeros((0, 3)), faces


def _placed_meshes(root: Any, known: dict) -> list[tuple[Any, np.ndarray]]:
    """Each mesh with the transform of its node; meshes as they are if the file has no scene."""
    scene = root.find("library_visual_scenes/visual_scene")
    if scene is None:
        return [(mesh, np.eye(4)) for mesh in root.iter("mesh")]
    placed: list[tuple[Any, np.ndarray]] = []

    def visit(node: Any, X_parent: np.ndarray, depth: int = 0) -> None:
        X = X_parent
        for child in node:
            if child.tag in ("matrix", "translate", "rotate", "scale"):
                X = X @ _transform(child)
            elif child.tag == "instance_geometry":
                mesh = known[child.get("url")[1:]].find("mesh")
                if mesh is not None:
                    placed.append((mesh, X))
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
    position = next(i for i in mesh.find("vertices") if i.get("semantic") == "POSITION")
    source = known[position.get("source")[1:]]
    stride = int(source.find("technique_common/accessor").get("stride", "3"))
    points = np.array(source.findtext("float_array").split(), dtype=float).reshape(-1, stride)[:, :3]
    polygons: list[list[int]] = []
    for group in mesh:
        if group.tag not in ("triangles", "polylist", "polygons"):
            if group.tag in ("trifans", "tristrips"):
                raise RuntimeError(f"{name}: COLLADA <{group.tag}> is not supported.")
            continue
        inputs = group.findall("input")
        width = 1 + max(int(i.get("offset", "0")) for i in inputs)
        offset = next(int(i.get("offset", "0")) for i in inputs if i.get("semantic") == "VERTEX")
        for p in group.findall("p"):
            numbers = np.array((p.text or "").split(), dtype=np.int64).reshape(-1, width)[:, offset].tolist()
            polygons.extend(_split(numbers, group))
    return points, polygons


def _split(numbers: list[int], group: Any) -> list[list[int]]:
    if group.tag == "polygons":
        return [numbers]
    sizes = [int(s) for s in group.findtext("vcount", "").split()] if group.tag == "polylist" else []
    sizes = sizes or [3] * (len(numbers) // 3)
    ends = np.cumsum([0, *sizes])
    return [numbers[a:b] for a, b in itertools.pairwise(ends)]
