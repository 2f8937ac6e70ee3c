"""COLLADA files to look at: their triangles with colors and textures, as a trimesh scene."""

from __future__ import annotations

import io
from collections.abc import Callable
from typing import TYPE_CHECKING, Any
from urllib.parse import unquote

import numpy as np

from sheldrake.common._ctrl_c import imported

from .read_dae import PlacedMesh, group_inputs, group_polygons, open_dae, polygon_groups, source_rows, vertex_positions

if TYPE_CHECKING:
    import trimesh


def dae_scene(data: bytes, name: str, read_file: Callable[[str], bytes]) -> trimesh.Scene:
    """Returns a trimesh.Scene [m] with z up, one geometry for each material of each mesh.

    Args:
        data: The file.
        name: Its name, for messages.
        read_file: Gives the content of a file that is named in it, relative to it.

    Raises:
        RuntimeError: when it cannot be read.
    """
    trimesh = imported("trimesh")

    placed, known = open_dae(data, name)
    scene = trimesh.Scene()
    for part in placed:
        for group in polygon_groups(part.mesh, name):
            mesh = _mesh(part, group, known, read_file)
            if mesh is not None:
                scene.add_geometry(mesh)
    return scene


def _mesh(part: PlacedMesh, group: Any, known: dict, read_file: Callable[[str], bytes]) -> trimesh.Trimesh | None:
    """The triangles of a group; each corner is a vertex of its own, as each has its own normal and texture."""
    trimesh = imported("trimesh")

    fans = [np.stack([p[[0, k, k + 1]] for k in range(1, len(p) - 1)]) for p in group_polygons(group) if len(p) > 2]
    if not fans:
        return None
    corners = np.concatenate(fans).reshape(-1, fans[0].shape[2])
    inputs = group_inputs(group)
    rows = {"VERTEX": vertex_positions(part.mesh, known)}
    rows.update({kind: source_rows(known[inputs[kind][0]]) for kind in ("NORMAL", "TEXCOORD") if kind in inputs})
    values = {kind: row[corners[:, inputs[kind][1]]] for kind, row in rows.items()}
    R, p = part.X_GM[:3, :3], part.X_GM[:3, 3]
    normals = values["NORMAL"] @ np.linalg.inv(R) if "NORMAL" in values else None
    faces = np.arange(len(corners)).reshape(-1, 3)
    if np.linalg.det(R) < 0.0:
        faces = faces[:, ::-1]
    mesh = trimesh.Trimesh(values["VERTEX"] @ R.T + p, faces, vertex_normals=normals, process=False)
    material = _material(known.get(part.materials.get(group.get("material"), "")), known, read_file)
    if material is not None:
        uv = values["TEXCOORD"][:, :2] if "TEXCOORD" in values else np.zeros((len(corners), 2))
        mesh.visual = trimesh.visual.TextureVisuals(uv=uv, material=material)
    return mesh


def _material(material: Any, known: dict, read_file: Callable[[str], bytes]) -> Any:
    """A material's diffuse color or texture, None where it says neither."""
    from trimesh.visual.material import PBRMaterial

    effect = known.get(material.find("instance_effect").get("url")[1:]) if material is not None else None
    diffuse = next(effect.iter("diffuse"), None) if effect is not None else None
    if diffuse is None:
        return None
    look: dict[str, Any] = {"metallicFactor": 0.0, "roughnessFactor": 0.9}
    texture = diffuse.find("texture")
    if texture is not None:
        from PIL import Image

        file = _image_file(texture.get("texture"), effect, known)
        try:
            picture = read_file(file)
        except (OSError, ValueError):  # who reads files has noted it
            return PBRMaterial(**look)
        try:
            look["baseColorTexture"] = Image.open(io.BytesIO(picture))
        except (OSError, ValueError, Image.DecompressionBombError):
            raise RuntimeError(f"the texture '{file}' is no picture that can be read.") from None
    elif diffuse.find("color") is not None:
        color = np.array(diffuse.findtext("color").split(), dtype=float)
        look["baseColorFactor"] = np.round(255 * np.clip(color, 0.0, 1.0)).astype(np.uint8)
    return PBRMaterial(**look)


def _image_file(name: str, effect: Any, known: dict) -> str:
    """The file behind a texture: sampler -> surface -> image, or the image at once."""
    parameters = {parameter.get("sid"): parameter for parameter in effect.iter("newparam")}
    for tag in ("source", "init_from"):
        if name in parameters:
            name = next(parameters[name].iter(tag)).text.strip()
    return unquote(known[name].findtext("init_from").strip())
