"""A scene for a render server: one glTF file (version 2.0) with geometry, materials and a camera."""

from __future__ import annotations

import base64
import io
import json
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from sheldrake.geometry._kernels.raster_scene import Vertex
from sheldrake.geometry._meshcat.drawables import drawable_of_shape, triangles_of
from sheldrake.geometry._rgba import Rgba

from .camera import RenderCameraCore
from .raster_arrays import Item
from .raster_shapes import Material, Texture

_FLOATS, _INDICES = 5126, 5125
_TO_GLTF_CAMERA = np.diag([1.0, -1.0, -1.0])  # it looks along -z, y is up


class _File:
    """The parts of a glTF file in the making."""

    def __init__(self) -> None:
        self.parts: dict[str, list[Any]] = {}

    def add(self, kind: str, **part: object) -> int:
        """Adds a part; returns its number."""
        parts = self.parts.setdefault(kind, [])
        parts.append(part)
        return len(parts) - 1

    def add_bytes(self, data: bytes) -> int:
        """Adds bytes; returns the number of their view."""
        uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
        buffer = self.add("buffers", byteLength=len(data), uri=uri)
        return self.add("bufferViews", buffer=buffer, byteOffset=0, byteLength=len(data))

    def add_array(self, array: np.ndarray) -> int:
        """Adds vectors, shape (n, 2) or (n, 3), or indices, shape (n,); returns the number of their accessor."""
        indices = array.ndim == 1
        data = np.ascontiguousarray(array, np.uint32 if indices else np.float32)
        limits = {} if indices else {"min": data.min(axis=0).tolist(), "max": data.max(axis=0).tolist()}
        return self.add(
            "accessors",
            bufferView=self.add_bytes(data.tobytes()),
            componentType=_INDICES if indices else _FLOATS,
            count=len(data),
            type="SCALAR" if indices else f"VEC{data.shape[1]}",
            **limits,
        )

    def add_texture(self, texture: Texture) -> int:
        """Adds a texture; returns its number."""
        import PIL.Image

        t = texture.texels
        stream = io.BytesIO()
        PIL.Image.fromarray(np.stack([t & 255, t >> 8 & 255, t >> 16 & 255], axis=-1).astype(np.uint8)).save(
            stream, format="PNG"
        )
        image = self.add("images", bufferView=self.add_bytes(stream.getvalue()), mimeType="image/png")
        return self.add("textures", source=image)

    def encode(self, root: int) -> bytes:
        """The file; `root` is the node that has all others."""
        head = {"asset": {"version": "2.0", "generator": "sheldrake"}, "scene": 0, "scenes": [{"nodes": [root]}]}
        return json.dumps({**head, **self.parts}).encode()


def gltf_of(
    items: Sequence[Item],
    X_WG: np.ndarray,
    core: RenderCameraCore,
    X_WC: np.ndarray,
    look: Callable[[Item, Material], Any],
) -> bytes:
    """A glTF file of a scene, z up as in the world.

    Args:
        items: The geometries.
        X_WG: Their poses, shape (n, 3, 4).
        core: Lens and clipping planes.
        X_WC: Pose of the camera, shape (3, 4).
        look: What a material of an item is drawn as: a colour (r, g, b, a), and a Texture or None.
    """
    file = _File()
    nodes = []
    for k, (item, pose) in enumerate(zip(items, X_WG)):
        mesh = file.add("meshes", name=f"geometry{k}", primitives=list(_primitives(file, item, look)))
        nodes.append(file.add("nodes", name=f"geometry{k}", mesh=mesh, matrix=_matrix(pose)))
    lens, clipping = core.intrinsics(), core.clipping()
    perspective = {
        "aspectRatio": lens.width() / lens.height(),
        "yfov": lens.fov_y(),
        "znear": clipping.near(),
        "zfar": clipping.far(),
    }
    camera = file.add("cameras", type="perspective", perspective=perspective)
    pose = np.column_stack([X_WC[:, :3] @ _TO_GLTF_CAMERA, X_WC[:, 3]])
    nodes.append(file.add("nodes", name="Camera Node", camera=camera, matrix=_matrix(pose)))
    return file.encode(file.add("nodes", name="Renderer Node", children=nodes))


def _matrix(pose: np.ndarray) -> list[float]:
    """A pose, shape (3, 4), as glTF wants it: column by column."""
    return np.vstack([pose, [0.0, 0.0, 0.0, 1.0]]).T.ravel().tolist()


def _primitives(file: _File, item: Item, look: Callable[[Item, Material], Any]) -> Any:
    """The triangles of an item, material by material."""
    vertex, face = item.surface.vertex, item.surface.face
    if len(face) == 0:  # a round shape
        triangles = triangles_of(drawable_of_shape(item.shape, Rgba()))
        assert triangles is not None
        vertex = np.zeros((len(triangles.vertices), Vertex.SIZE))
        vertex[:, :3] = triangles.vertices
        face = np.column_stack([triangles.faces, np.zeros(len(triangles.faces), np.int64)])
    position, normal = file.add_array(vertex[:, Vertex.p_GV.columns]), vertex[:, Vertex.normal.columns]
    uv = vertex[:, Vertex.texture.columns] * [1.0, -1.0] + [0.0, 1.0]  # v downwards
    attributes = {"POSITION": position, "TEXCOORD_0": file.add_array(uv)}
    if any(material.smooth for material in item.surface.materials):
        attributes["NORMAL"] = file.add_array(normal)
    for k, material in enumerate(item.surface.materials):
        color, texture = look(item, material)
        pbr = {"baseColorFactor": [float(c) for c in color], "metallicFactor": 0.0, "roughnessFactor": 1.0}
        if texture is not None:
            pbr["baseColorTexture"] = {"index": file.add_texture(texture)}
        part = {"pbrMetallicRoughness": pbr, **({"alphaMode": "BLEND"} if color[3] < 1.0 else {})}
        indices = file.add_array(face[face[:, 3] == k, :3].ravel())
        yield {
            "attributes": attributes,
            "indices": indices,
            "material": file.add("materials", doubleSided=True, **part),
            "mode": 4,
        }
