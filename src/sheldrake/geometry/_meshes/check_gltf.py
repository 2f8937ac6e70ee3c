"""What a glTF file says about its numbers, looked at before anything is read: who reads them takes its word for it."""

from __future__ import annotations

import base64
import json
import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from .check_picture import check_picture

if TYPE_CHECKING:
    from typing import TypeGuard

_BYTES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}  # of a number, by its component type
_NUMBERS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
_MOST_ZEROS = 100_000_000  # [bytes] that a file may have without holding them: whoever reads it makes room for all
_DEEPEST = 10_000  # nodes below each other: trimesh follows each from the root
_LONGEST_STRIDE = 252  # [bytes]
_PACKED = ("KHR_draco_mesh_compression", "EXT_meshopt_compression")  # what hides the numbers themselves


def check_gltf(data: bytes, extension: str, name: str, read_file: Callable[[str], bytes]) -> list[str]:
    """Checks that a glTF file is whole, and that what it names is there.

    Args:
        data: The file.
        extension: ".gltf" or ".glb".
        name: Its name, for messages.
        read_file: Gives the content of a file that is named in it, relative to it.

    Returns:
        Which pictures within the file cannot be read, and why; a mesh is still one without them.

    Raises:
        RuntimeError: with the place in the file, what was found and what was expected.
        OSError: from read_file.
    """
    text, chunk = (data, None) if extension == ".gltf" else _chunks(data, name)
    try:
        document = json.loads(text)
    except json.JSONDecodeError as error:
        place = f"line {error.lineno}, column {error.colno}"
        raise RuntimeError(f"{name}: the glTF file is no JSON at {place}: {error.msg}.") from None
    except (UnicodeDecodeError, RecursionError):
        raise RuntimeError(f"{name}: the glTF file is no JSON text.") from None
    if not isinstance(document, dict):
        raise RuntimeError(f"{name}: the glTF file has {type(document).__name__} at its top; expected an object.")
    check = _GltfCheck(document, name)
    check.run(chunk, read_file)
    return check.problems


def _chunks(data: bytes, name: str) -> tuple[bytes, bytes]:
    """The JSON of a binary glTF file, and its numbers."""
    found, parts, at = {b"JSON": b"", b"BIN\0": b""}, [], 12
    if data[:4] != b"glTF":
        raise RuntimeError(f"{name}: a .glb file begins with 'glTF'; this one does not: is it of another kind?")
    version = int.from_bytes(data[4:8], "little")
    if version != 2:
        raise RuntimeError(f"{name}: the version of the .glb file is {version}; expected 2.")
    while at + 8 <= len(data):
        size, kind = int.from_bytes(data[at : at + 4], "little"), data[at + 4 : at + 8]
        if at + 8 + size > len(data):
            raise RuntimeError(
                f"{name}: the .glb file ends at byte {len(data)}, within a chunk that ends at {at + 8 + size}: was it "
                "copied as a whole?"
            )
        parts.append(kind)
        found[kind] = data[at + 8 : at + 8 + size]
        at += 8 + size
    if parts[:1] != [b"JSON"]:
        raise RuntimeError(f"{name}: the .glb file has no JSON chunk at its beginning.")
    return found[b"JSON"], found[b"BIN\0"]


class _GltfCheck:
    """The checks of one document."""

    def __init__(self, document: dict[str, Any], name: str):
        self._document, self._name = document, name
        self._held: list[bytes] = []  # what the buffers hold
        self.problems: list[str] = []

    def run(self, chunk: bytes | None, read_file: Callable[[str], bytes]) -> None:
        asset = self._object("asset", self._document.get("asset", {}))
        version = asset.get("version", "2.0")
        if not str(version).startswith("2"):
            self._fail("asset.version", version, "2.0")
        for extension in self._list("", self._document, "extensionsRequired"):
            if extension in _PACKED:
                self._fail("extensionsRequired", extension, "a file saved without compression of its meshes")
        self._buffers(chunk, read_file)
        self._views()
        self._accessors()
        self._looks()
        self._meshes()
        self._nodes()

    def _buffers(self, chunk: bytes | None, read_file: Callable[[str], bytes]) -> None:
        for where, buffer in self._rows("buffers"):
            size, uri = self._whole(where, buffer, "byteLength", 0), buffer.get("uri")
            if uri is None:
                held = chunk or b""
            elif not isinstance(uri, str):
                self._fail(f"{where}.uri", uri, "text")
            elif uri.startswith("data:"):
                held = self._of_base64(where, uri)
            else:
                held = read_file(uri)
            if len(held) < size:
                self._fail(f"{where}.byteLength", size, f"at most the {len(held)} bytes that are there")
            self._held.append(held)

    def _of_base64(self, where: str, uri: str) -> bytes:
        try:
            return base64.b64decode(uri.partition(",")[2], validate=True)
        except ValueError:  # of which binascii.Error is one
            return self._say(f"{where}.uri", "data that is no base64", "data:...;base64, and the numbers in base64")

    def _views(self) -> None:
        for where, view in self._rows("bufferViews"):
            buffer = self._index(where, view, "buffer", "buffers")
            offset, size = self._whole(where, view, "byteOffset", 0, 0), self._whole(where, view, "byteLength", 1)
            most = buffer["byteLength"]
            if offset + size > most:
                self._say(where, f"bytes {offset} to {offset + size}", f"at most {most}, the length of its buffer")

    def _accessors(self) -> None:
        zeros = 0
        for where, accessor in self._rows("accessors"):
            count = self._whole(where, accessor, "count", 1)
            size = self._choice(where, accessor, "componentType", _BYTES)
            size *= self._choice(where, accessor, "type", _NUMBERS)
            offset = self._whole(where, accessor, "byteOffset", 0, 0)
            if "bufferView" not in accessor:
                if "bufferViews" not in self._document:
                    self._fail("bufferViews", None, "a list: without it accessors have no numbers")
                zeros += count * size
                if zeros > _MOST_ZEROS:
                    most = f"at most {_MOST_ZEROS} bytes of all accessors without a bufferView, which are zeros"
                    self._fail(f"{where}.count", count, most)
                continue
            view = self._index(where, accessor, "bufferView", "bufferViews")
            stride, place = view.get("byteStride", size), f"bufferViews[{accessor['bufferView']}].byteStride"
            if not _is_whole(stride) or not size <= stride <= max(size, _LONGEST_STRIDE):
                self._fail(place, stride, f"a whole number from {size}, the size of an element, to {_LONGEST_STRIDE}")
            end = offset + stride * (count - 1) + size
            if end > view["byteLength"]:
                most = f"at most {view['byteLength']}, the length of its bufferView"
                self._fail(f"the end of {where} ({count} elements of {size} bytes, {stride} apart)", end, most)

    def _looks(self) -> None:
        for where, image in self._rows("images"):
            view = self._index(where, image, "bufferView", "bufferViews") if "bufferView" in image else None
            try:
                self._picture(where, image.get("uri"), view)
            except (OSError, ValueError) as error:  # the latter from base64
                self.problems.append(f"{where}: {str(error).rstrip('.')}.")
        for where, texture in self._rows("textures"):
            if "source" in texture:
                self._index(where, texture, "source", "images")
        for where, material in self._rows("materials"):
            place = f"{where}.pbrMetallicRoughness"
            looks = self._object(place, material.get("pbrMetallicRoughness", {}))
            self._numbers(place, looks, "baseColorFactor", 4)
            if "baseColorTexture" in looks:
                place = f"{place}.baseColorTexture"
                self._index(place, self._object(place, looks["baseColorTexture"]), "index", "textures")

    def _picture(self, where: str, uri: Any, view: dict[str, Any] | None) -> None:
        """Checks a picture within the file; those in other files are looked at when they are read."""
        if view is not None:
            begin = view.get("byteOffset", 0)
            check_picture(self._held[view["buffer"]][begin : begin + view["byteLength"]])
        elif isinstance(uri, str) and uri.startswith("data:"):
            check_picture(base64.b64decode(uri.partition(",")[2], validate=True))

    def _meshes(self) -> None:
        for where, mesh in self._rows("meshes"):
            for n, primitive in enumerate(self._list(where, mesh, "primitives")):
                self._primitive(f"{where}.primitives[{n}]", self._object(f"{where}.primitives[{n}]", primitive))

    def _primitive(self, where: str, primitive: dict[str, Any]) -> None:
        attributes = self._object(f"{where}.attributes", primitive.get("attributes"))
        if "POSITION" not in attributes:
            self._fail(f"{where}.attributes", sorted(attributes), "POSITION among them")
        for kind in attributes:
            self._index(f"{where}.attributes", attributes, kind, "accessors")
        position = self._document["accessors"][attributes["POSITION"]]
        if position["type"] != "VEC3":
            self._fail(f"the type of {where}.attributes.POSITION", position["type"], "VEC3")
        if "indices" in primitive:
            kind = self._index(where, primitive, "indices", "accessors")["type"]
            if kind != "SCALAR":
                self._fail(f"the type of {where}.indices", kind, "SCALAR")
        if "material" in primitive:
            self._index(where, primitive, "material", "materials")
        mode = primitive.get("mode", 4)
        if not _is_whole(mode) or not 0 <= mode <= 6:
            self._fail(f"{where}.mode", mode, "a number from 0 to 6; 4 stands for triangles")

    def _nodes(self) -> None:
        children: list[list[int]] = []
        for where, node in self._rows("nodes"):
            if "mesh" in node:
                self._index(where, node, "mesh", "meshes")
            for key, size in (("matrix", 16), ("translation", 3), ("rotation", 4), ("scale", 3)):
                self._numbers(where, node, key, size)
            children.append(self._indices(where, node, "children"))
        self._is_a_tree(children)
        for where, scene in self._rows("scenes"):
            self._indices(where, scene, "nodes")
        if "scene" in self._document:
            self._index("", self._document, "scene", "scenes")

    def _indices(self, where: str, row: dict[str, Any], key: str) -> list[int]:
        """Numbers of nodes."""
        found = self._list(where, row, key)
        for n, number in enumerate(found):
            self._index(f"{where}.{key}[{n}]", {"": number}, "", "nodes")
        return found

    def _is_a_tree(self, children: list[list[int]]) -> None:
        """No node may be below itself: those without parents are taken away until none is left."""
        parents = [0] * len(children)
        for below in children:
            for child in below:
                parents[child] += 1
        free, depths = [n for n, count in enumerate(parents) if not count], [1] * len(children)
        for n in free:
            if depths[n] > _DEEPEST:
                self._say(f"nodes[{n}]", f"below {_DEEPEST} others", "a flatter tree")
            for child in children[n]:
                parents[child] -= 1
                depths[child] = max(depths[child], depths[n] + 1)
                if not parents[child]:
                    free.append(child)
        if len(free) < len(children):
            circle = sorted(set(range(len(children))) - set(free))
            self._say(f"nodes[{circle[0]}]", "below itself", "a tree")

    # ---- what is looked up

    def _fail(self, where: str, found: Any, expected: str) -> Any:
        return self._say(where, json.dumps(found)[:60], expected)

    def _say(self, where: str, found: str, expected: str) -> Any:
        raise RuntimeError(f"{self._name}: {where.lstrip('.')} is {found}; expected {expected}.")

    def _rows(self, key: str) -> list[tuple[str, dict[str, Any]]]:
        """The objects of a list of the document, with their places."""
        rows = enumerate(self._list("", self._document, key))
        return [(f"{key}[{n}]", self._object(f"{key}[{n}]", row)) for n, row in rows]

    def _list(self, where: str, row: dict[str, Any], key: str) -> list[Any]:
        found = row.get(key, [])
        return found if isinstance(found, list) else self._fail(f"{where}.{key}", found, "a list")

    def _object(self, where: str, found: Any) -> dict[str, Any]:
        return found if isinstance(found, dict) else self._fail(where, found, "an object")

    def _whole(self, where: str, row: dict[str, Any], key: str, least: int, default: int | None = None) -> int:
        found = row.get(key, default)
        if _is_whole(found) and found >= least:
            return found
        return self._fail(f"{where}.{key}", found, f"a whole number from {least}")

    def _numbers(self, where: str, row: dict[str, Any], key: str, size: int) -> None:
        found = row.get(key)
        if found is not None and not (isinstance(found, list) and [*map(_is_number, found)] == [True] * size):
            self._fail(f"{where}.{key}", found, f"{size} numbers")

    def _choice(self, where: str, row: dict[str, Any], key: str, choices: dict[Any, int]) -> int:
        found = row.get(key)
        if not isinstance(found, (int, str)) or isinstance(found, bool) or found not in choices:
            self._fail(f"{where}.{key}", found, f"one of {', '.join(map(str, choices))}")
        return choices[found]

    def _index(self, where: str, row: dict[str, Any], key: str, of: str) -> dict[str, Any]:
        """The object of a list that is meant by its number."""
        rows, found = self._list("", self._document, of), row.get(key)
        if _is_whole(found) and 0 <= found < len(rows):
            return rows[found]
        expected = f"the number of one of the {len(rows)} {of}, the first being 0"
        return self._fail(f"{where}.{key}".rstrip("."), found, expected)


def _is_whole(value: Any) -> TypeGuard[int]:
    return isinstance(value, int) and not isinstance(value, bool)


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
