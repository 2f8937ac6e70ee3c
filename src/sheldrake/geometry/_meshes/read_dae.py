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

    The up axis that MeshLab writes is not believed: parts of robots that were saved by it would lie on their sides.

    Raises:
        RuntimeError: not XML.
    """
    try:
        root = ElementTree.fromstring(data)
    except ElementTree.ParseError as error:
        raise RuntimeError(f"{name}: cannot read the COLLADA file: {error}.") from None
    for element in root.iter():
        element.tag = element.tag.split("}", 1)[-1]
    if root.tag != "COLLADA":
        raise RuntimeError(f"{name}: the file begins with <{root.tag}>; expected <COLLADA>.")
    known = _ById({str(element.get("id")): element for element in root.iter() if element.get("id")})
    unit = root.find("asset/unit")
    up = root.findtext("asset/up_axis", "Y_UP").strip()
    if "MeshLab" in root.findtext("asset/contributor/authoring_tool", ""):
        up = "Z_UP"  # it writes Y_UP of whatever it was given, and turns nothing
    if up not in _TO_Z_UP:
        raise ValueError(f"<up_axis> is '{up}'; expected one of {', '.join(_TO_Z_UP)}")
    X_GF = np.eye(4)
    X_GF[:3, :3] = _TO_Z_UP[up] * (1.0 if unit is None else _numbers("<unit meter>", unit.get("meter", "1"), 1)[0, 0])
    return [PlacedMesh(mesh, X_GF @ X, materials) for mesh, X, materials in _placed_meshes(root, known)], known


class _ById(dict):
    """Elements by their ids."""

    def __missing__(self, name: str) -> Any:
        raise ValueError(f"it names '#{name}', but nothing in the file has this id")


def _numbers(where: str, text: str | None, columns: int, kind: type = float) -> np.ndarray:
    """Numbers of a text in rows, shape (n, columns)."""
    words = (text or "").split()
    try:
        values: np.ndarray = np.array(words, dtype=kind)
    except ValueError:
        wrong = next((word for word in words if not _is_number(word, kind)), "?")
        raise ValueError(f"{where} holds '{wrong[:20]}'; expected numbers") from None
    if columns < 1:
        raise ValueError(f"{where} has rows of {columns} numbers")
    if len(values) % columns:
        raise ValueError(f"{where} holds {len(values)} numbers; expected a multiple of {columns}")
    return values.reshape(-1, columns)


def _is_number(word: str, kind: type) -> bool:
    try:
        kind(word)
    except ValueError:
        return False
    return True


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
    size = {"matrix": 16, "rotate": 4}.get(element.tag, 3)
    values = _numbers(f"<{element.tag}>", element.text, size)
    if len(values) != 1:
        raise ValueError(f"<{element.tag}> holds {values.size} numbers; expected {size}")
    values, X = values[0], np.eye(4)
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
    where, accessor = f"<source id='{source.get('id')}'>", source.find("technique_common/accessor")
    if accessor is None or source.find("float_array") is None:
        raise ValueError(f"{where} has no <float_array> with an <accessor>")
    stride = int(_numbers(f"the stride of {where}", accessor.get("stride", "3"), 1, int)[0, 0])
    return _numbers(f"the <float_array> of {where}", source.findtext("float_array"), stride)


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
        corners = _numbers(f"a <p> of <{group.tag}>", p.text, width, np.int64)
        polygons += _split(corners, group)
    return polygons


def _split(corners: np.ndarray, group: Any) -> list[np.ndarray]:
    if group.tag == "polygons":
        return [corners]
    sizes = [int(s) for s in group.findtext("vcount", "").split()] if group.tag == "polylist" else []
    sizes = sizes or [3] * (len(corners) // 3)
    ends = np.cumsum([0, *sizes])
    return [corners[a:b] for a, b in itertools.pairwise(ends)]
