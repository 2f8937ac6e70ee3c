"""Reader of 3MF, a zip archive with an XML model: meshes of the objects that are built, placed as they are built.

3D Manufacturing Format, Core Specification 1.3, sections 3 and 4.
"""

from __future__ import annotations

import io
import posixpath
import re
import xml.etree.ElementTree as ElementTree
import zipfile
import zlib

import numpy as np

from ._declared_sizes import MOST_TRIANGLES

_METRES = {
    "micron": 1e-6, "millimeter": 1e-3, "centimeter": 1e-2, "inch": 0.0254, "foot": 0.3048, "meter": 1.0,
}  # fmt: skip
_MOST_BYTES = 1 << 30  # [bytes] of the model, unpacked
_DEPTH = 16  # components inside components


def read_3mf(data: bytes, name: str) -> tuple[list[tuple[str, np.ndarray, np.ndarray]], str, float]:
    """Named vertices, shape (n, 3), and triangles, shape (m, 3), then the unit stated ("" if none) and its metres.

    Raises:
        ValueError: not a 3MF file, or one of absurd size.
    """
    root = _model(data, name)
    unit = root.get("unit", "")
    if unit and unit not in _METRES:
        raise ValueError(f"'{name}' has the unit '{unit}', which 3MF does not know.")
    objects = {element.get("id"): element for element in root.iterfind("resources/object")}
    solids: list[tuple[str, np.ndarray, np.ndarray]] = []
    items = root.findall("build/item")
    for item in items:
        _add(item, objects, np.eye(4), solids, 0, name)
    return solids, unit, _METRES[unit or "millimeter"]


def _model(data: bytes, name: str) -> ElementTree.Element:
    try:
        archive = zipfile.ZipFile(io.BytesIO(data))
        models = [info for info in archive.infolist() if posixpath.splitext(info.filename)[1].lower() == ".model"]
        info = next((m for m in models if m.filename.lower().lstrip("/") == "3d/3dmodel.model"), None) or models[0]
        if info.file_size > _MOST_BYTES:
            raise ValueError(f"'{name}': its model unpacks to {info.file_size} bytes; this is refused.")
        with archive.open(info) as file:
            text = file.read(_MOST_BYTES)
    except (zipfile.BadZipFile, zlib.error, IndexError, NotImplementedError, EOFError, RuntimeError) as error:
        raise ValueError(f"'{name}' is not a 3MF file: {error or 'it holds no model'}.") from None
    if re.search(rb"<!(?:DOCTYPE|ENTITY)", text):
        raise ValueError(f"'{name}' declares a document type or entities; these are refused.")
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise ValueError(f"'{name}': its model is not well-formed XML: {error}.") from None
    for element in root.iter():
        element.tag = element.tag.split("}", 1)[-1]
    return root


def _add(reference, objects, X, solids, depth: int, name: str) -> None:
    """Adds the object that an item or component refers to, at pose X (4 x 4, columns)."""
    if depth > _DEPTH:
        raise ValueError(f"'{name}' nests components deeper than {_DEPTH} levels.")
    thing = objects.get(reference.get("objectid"))
    if thing is None:
        raise ValueError(f"'{name}' builds the object '{reference.get('objectid')}', which it does not have.")
    X = X @ _transform(reference.get("transform"), name)
    mesh = thing.find("mesh")
    if mesh is None:
        for component in thing.iterfind("components/component"):
            _add(component, objects, X, solids, depth + 1, name)
        return
    vertices = [[float(v.get(axis, "nan")) for axis in "xyz"] for v in mesh.iterfind("vertices/vertex")]
    triangles = [
        [int(t.get(corner, "-1")) for corner in ("v1", "v2", "v3")] for t in mesh.iterfind("triangles/triangle")
    ]
    if sum(len(t) for _, _, t in solids) + len(triangles) > MOST_TRIANGLES:
        raise ValueError(f"'{name}' has more than {MOST_TRIANGLES} triangles; this is refused.")
    points = np.array(vertices, dtype=float).reshape(-1, 3) @ X[:3, :3].T + X[:3, 3]
    faces = np.array(triangles, dtype=np.int64).reshape(-1, 3)
    if np.linalg.det(X[:3, :3]) < 0.0:
        faces = faces[:, ::-1]
    solids.append((thing.get("name") or f"object {thing.get('id')}", points, faces))


def _transform(text: str | None, name: str) -> np.ndarray:
    """The 4 x 4 matrix of twelve numbers, which 3MF writes for row vectors."""
    X = np.eye(4)
    if text:
        numbers = np.array(text.split(), dtype=float)
        if numbers.shape != (12,):
            raise ValueError(f"'{name}': a transform has {len(numbers)} numbers instead of 12.")
        X[:3, :] = numbers.reshape(4, 3).T
    return X
