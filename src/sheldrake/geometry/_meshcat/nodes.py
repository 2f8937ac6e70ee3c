"""From drawables to viser's scene nodes.

The only file of Meshcat that knows what viser calls things in a scene.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._ctrl_c import imported
from sheldrake.geometry._shapes import Box, Cylinder, Ellipsoid, HalfSpace, Sphere

from .drawables import PLATE_SIZE, Asset, Lines, Points, Primitive, Triangles, triangles_of
from .sharp_edges import split_at_edges
from .tree import OBJECT

if TYPE_CHECKING:
    import viser

    from sheldrake.geometry._meshcat.drawables import Drawable
    from sheldrake.geometry._shapes import Shape


def rgb255(color: Any) -> tuple[int, int, int]:
    """Returns a color of three or four numbers in [0, 1] as three integers in 0..255."""
    return tuple(round(255 * min(1.0, max(0.0, float(c)))) for c in list(color)[:3])  # type: ignore[return-value]


def send_pose(server: viser.ViserServer, name: str, wxyz: list[float], position: list[float]) -> None:
    """Sends a node's pose in its parent: ten times cheaper than through viser's handles."""
    from viser import _messages

    queue = server._websock_server.queue_message
    w, x, y, z = wxyz
    queue(_messages.SetOrientationMessage(name, (w, x, y, z)))
    px, py, pz = position
    queue(_messages.SetPositionMessage(name, (px, py, pz)))


def property_message(path: str, name: str, value: Any, drawable: Any) -> Any:
    """Returns the message that shows a recorded property of a path, None for one that has no message.

    Args:
        path: Full path.
        name: "visible", "position", "quaternion" (x, y, z, w), "scale", "opacity" or "modulated_opacity".
        value: Its value.
        drawable: What is drawn at the path, None for nothing.
    """
    from viser import _messages

    node = path if path.endswith(OBJECT) else f"{path}/{OBJECT}"
    if name == "visible":
        return _messages.SetSceneNodeVisibilityMessage(path, bool(value))
    if name == "position":
        return _messages.SetPositionMessage(path, tuple(value))
    if name == "quaternion":
        x, y, z, w = np.array(value) / np.linalg.norm(value)
        return _messages.SetOrientationMessage(path, (w, x, y, z))
    if name == "scale" and drawable is not None:
        scale = np.broadcast_to(np.asarray(value, dtype=float), (3,)) * base_scale(drawable)
        return _messages.SceneNodeUpdateMessage(node, {"scale": tuple(scale.tolist())})
    if name in ("opacity", "modulated_opacity"):
        return _messages.SceneNodeUpdateMessage(node, {"opacity": float(value)})
    return None


def add(scene: Any, name: str, drawable: Drawable, color: Any, opacity: float) -> Any:
    """Adds a node to viser's scene, in place of one of the same name, and returns its handle.

    Args:
        scene: viser's SceneApi.
        name: Name of the node.
        drawable: What to draw.
        color: Color in [0, 1] that overrules the drawable's, or None.
        opacity: Opacity in [0, 1].
    """
    rgb = rgb255(color if color is not None else drawable.rgba.rgba)
    if isinstance(drawable, Primitive):
        return _add_primitive(scene, name, drawable.shape, rgb, opacity)
    if isinstance(drawable, Asset) and color is None:
        return scene.add_glb(name, drawable.mesh.glb(round(opacity, 2)))
    if isinstance(drawable, Lines):
        return scene.add_line_segments(name, drawable.segments, rgb, thickness=drawable.width, thickness_units="screen")
    if isinstance(drawable, Points):
        colors = drawable.colors if color is None else np.array(rgb, dtype=np.uint8)
        return scene.add_point_cloud(
            name, drawable.points, colors, point_size=drawable.size, precision="float32", point_shading="flat"
        )
    triangles = triangles_of(drawable)
    assert triangles is not None, "all other drawables are made of triangles"
    return _add_triangles(scene, name, triangles, rgb, opacity)


def _add_primitive(scene: Any, name: str, shape: Shape, rgb: tuple[int, int, int], opacity: float) -> Any:
    look = {"color": rgb, "opacity": None if opacity >= 1.0 else opacity, "side": "double"}
    if isinstance(shape, Box):
        return scene.add_box(name, dimensions=tuple(shape.size().tolist()), **look)
    if isinstance(shape, Sphere):
        return scene.add_icosphere(name, radius=shape.radius(), subdivisions=4, **look)
    if isinstance(shape, Ellipsoid):
        return scene.add_icosphere(name, radius=1.0, subdivisions=4, scale=(shape.a(), shape.b(), shape.c()), **look)
    if isinstance(shape, Cylinder):
        return scene.add_cylinder(name, radius=shape.radius(), height=shape.length(), radial_segments=48, **look)
    assert isinstance(shape, HalfSpace)
    return scene.add_grid(
        name,
        width=PLATE_SIZE,
        height=PLATE_SIZE,
        plane="xy",
        plane_color=rgb,
        plane_opacity=opacity,
        cell_color=_shade(rgb, 0.93),
        section_color=_shade(rgb, 0.82),
        cell_size=0.1,
        section_size=1.0,
        shadow_opacity=0.35,
        fade_distance=PLATE_SIZE,
    )


def _shade(rgb: tuple[int, int, int], factor: float) -> tuple[int, int, int]:
    return tuple(int(c * factor) for c in rgb)  # type: ignore[return-value]


def _add_triangles(scene: Any, name: str, triangles: Triangles, rgb: tuple[int, int, int], opacity: float) -> Any:
    if triangles.colors is not None and not triangles.wireframe:
        trimesh = imported("trimesh")

        mesh = trimesh.Trimesh(triangles.vertices, triangles.faces, process=False)
        colors = np.hstack([triangles.colors, np.full((len(triangles.colors), 1), opacity)])
        visual: Any = mesh.visual
        visual.vertex_colors = np.round(255 * np.clip(colors, 0, 1)).astype(np.uint8)
        return scene.add_mesh_trimesh(name, mesh)
    vertices, faces = triangles.vertices, triangles.faces
    if triangles.texture is not None:
        return scene.add_glb(name, _textured(triangles, rgb, opacity))
    if triangles.smooth:
        vertices, faces = split_at_edges(vertices, faces)
    options = {} if triangles.wireframe else {"flat_shading": not triangles.smooth}
    return scene.add_mesh_simple(
        name,
        vertices,
        faces,
        color=rgb,
        wireframe=triangles.wireframe,
        opacity=None if opacity >= 1.0 else opacity,
        side=triangles.side,
        **options,
    )


def _textured(triangles: Triangles, rgb: tuple[int, int, int], opacity: float) -> bytes:
    """A mesh with a picture as GLB, which the color tints."""
    trimesh = imported("trimesh")
    from PIL import Image

    texture = triangles.texture
    assert texture is not None
    with Image.open(texture.file) as picture:
        material = trimesh.visual.material.PBRMaterial(
            baseColorTexture=picture.convert("RGBA"),
            baseColorFactor=[*rgb, round(255 * opacity)],
            alphaMode="OPAQUE" if opacity >= 1.0 else "BLEND",
            metallicFactor=0.0,
            roughnessFactor=0.8,
            doubleSided=True,
        )
    visual = trimesh.visual.TextureVisuals(uv=texture.uv, material=material)
    # No two triangles share a vertex here; those that would, but for their places on the picture, share a normal.
    places, shared = np.unique(np.round(triangles.vertices, 9), axis=0, return_inverse=True)
    split = trimesh.Trimesh(*split_at_edges(places, shared.reshape(-1)[triangles.faces]), process=False)
    normals = split.vertex_normals[split.faces].reshape(-1, 3)
    mesh = trimesh.Trimesh(
        triangles.vertices,
        triangles.faces,
        vertex_normals=normals if triangles.smooth and len(normals) == len(triangles.vertices) else None,
        visual=visual,
        process=False,
    )
    return bytes(trimesh.exchange.gltf.export_glb(mesh, include_normals=True))


def base_scale(drawable: Drawable) -> np.ndarray:
    """Returns the scale a node is drawn with when nothing stretches it, shape (3,)."""
    if isinstance(drawable, Primitive) and isinstance(drawable.shape, Ellipsoid):
        return np.array([drawable.shape.a(), drawable.shape.b(), drawable.shape.c()])
    return np.ones(3)


def scale_along_axes(drawable: Any, stretch: np.ndarray) -> tuple[float, float, float] | None:
    """Returns the node's scale that stands for a stretch, shape (4, 4); None when its points must be stretched."""
    factors = np.diag(stretch)[:3]
    if isinstance(drawable, Primitive) and isinstance(drawable.shape, HalfSpace):
        return None
    if (factors <= 0).any() or np.abs(stretch - np.diag([*factors, 1.0])).max() > 1e-12 * factors.max():
        return None
    return tuple((factors * base_scale(drawable)).tolist())  # type: ignore[return-value]


def recolor(handle: Any, drawable: Any, color: Any, opacity: float) -> bool:
    """Changes a node's color and opacity in place; returns False when it must be drawn anew."""
    if isinstance(drawable, (Asset, Points, Lines)) or getattr(drawable, "colors", None) is not None:
        return False
    rgb = rgb255(color if color is not None else drawable.rgba.rgba)
    if isinstance(drawable, Primitive) and isinstance(drawable.shape, HalfSpace):
        handle.plane_color, handle.plane_opacity = rgb, opacity
        return True
    handle.color = rgb
    handle.opacity = None if opacity >= 1.0 else opacity
    return True
