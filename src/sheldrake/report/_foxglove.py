"""A run as an MCAP file with the messages that Foxglove's 3D panel shows (foxglove.dev/docs/sdk/schemas)."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from sheldrake.geometry import Box, Cylinder, Ellipsoid, Sphere
from sheldrake.geometry._meshes.mesh_looks import MeshPart
from sheldrake.systems.primitives._vector_log import Channel, log_channel, write_mcap

from ._run import Look, Run

_WORLD = "world"


def write_foxglove(run: Run, path: str | os.PathLike) -> None:
    """Topics `/scene`, `/tf`, and one for each log."""
    channels = []
    if run.looks:
        first = float(run.times[0])
        channels.append(Channel("/scene", "foxglove.SceneUpdate", _SCENE, [first], lambda _: _scene(run, first)))
    if run.frames:
        times = run.times.tolist()
        channels.append(Channel("/tf", "foxglove.FrameTransforms", _TRANSFORMS, times, lambda k: _transforms(run, k)))
    channels += [log_channel(title, log) for title, log in run.logs.items()]
    write_mcap(path, channels, "SaveRun()")


def _transforms(run: Run, k: int) -> dict[str, Any]:
    stamp = _time(float(run.times[k]))
    return {
        "transforms": [
            {
                "timestamp": stamp,
                "parent_frame_id": _WORLD,
                "child_frame_id": name,
                "translation": _vector(pose[4:]),
                "rotation": _rotation(pose),
            }
            for name, pose in zip(run.frames, run.poses[k])
        ]
    }


def _scene(run: Run, first: float) -> dict[str, Any]:
    """Everything that is seen, each on its frame, for as long as the run is."""
    lists = ("arrows", "cubes", "spheres", "cylinders", "lines", "triangles", "texts", "models")
    entities = []
    for number, look in enumerate(run.looks):
        frame = _WORLD if look.frame < 0 else run.frames[look.frame]
        kind, primitives = _primitives(look)
        entities.append(
            {
                "timestamp": _time(first),
                "frame_id": frame,
                "id": f"{number} {frame}/{look.name}",
                "lifetime": _time(0.0),
                "frame_locked": True,
                "metadata": [],
                **{name: primitives if name == kind else [] for name in lists},
            }
        )
    return {"deletions": [], "entities": entities}


def _primitives(look: Look) -> tuple[str, list[dict[str, Any]]]:
    """A geometry as primitives of one kind; what Foxglove has no primitive for, as triangles."""
    shape, common = look.shape, {"pose": _pose(look.pose), "color": _color(look.rgba)}
    if isinstance(shape, Box):
        return "cubes", [{**common, "size": _vector(shape.size())}]
    if isinstance(shape, Sphere):
        return "spheres", [{**common, "size": _vector(np.full(3, 2.0 * shape.radius()))}]
    if isinstance(shape, Ellipsoid):
        return "spheres", [{**common, "size": _vector(2.0 * np.array([shape.a(), shape.b(), shape.c()]))}]
    if isinstance(shape, Cylinder):
        size = _vector(np.array([2.0 * shape.radius(), 2.0 * shape.radius(), shape.length()]))
        return "cylinders", [{**common, "size": size, "bottom_scale": 1.0, "top_scale": 1.0}]
    return "triangles", [_triangles(look, part) for part in look.parts]


def _triangles(look: Look, part: MeshPart) -> dict[str, Any]:
    rgba = look.rgba if part.diffuse is None else part.diffuse
    colors = vertex_colors(part, rgba)
    return {
        "pose": _pose(look.pose),
        "points": [_vector(p) for p in part.vertices],
        "color": _color(rgba),
        "colors": [] if colors is None else [_color(c) for c in colors.tolist()],
        "indices": part.faces.ravel().tolist(),
    }


def vertex_colors(part: MeshPart, rgba: tuple[float, ...]) -> np.ndarray | None:
    """Colors of vertices, shape (n, 4): their own, or those of the texture where they lie; None where there is none."""
    if part.colors is not None:
        return np.column_stack([part.colors, np.full(len(part.colors), rgba[3])])
    if part.image is None or part.uv is None:
        return None
    texels = np.asarray(part.image.convert("RGB"), float) / 255.0
    height, width, _ = texels.shape
    u, v = np.mod(part.uv, 1.0).T
    seen = texels[((1.0 - v) * (height - 1)).round().astype(int), (u * (width - 1)).round().astype(int)]
    return np.column_stack([seen * rgba[:3], np.full(len(seen), rgba[3])])


def _time(seconds: float) -> dict[str, int]:
    sec, nsec = divmod(round(seconds * 1e9), 10**9)
    return {"sec": sec, "nsec": nsec}


def _vector(p: np.ndarray) -> dict[str, float]:
    x, y, z = p.tolist()
    return {"x": x, "y": y, "z": z}


def _rotation(pose: np.ndarray) -> dict[str, float]:
    w, x, y, z = pose[:4].tolist()
    return {"x": x, "y": y, "z": z, "w": w}


def _pose(pose: np.ndarray) -> dict[str, Any]:
    return {"position": _vector(pose[4:]), "orientation": _rotation(pose)}


def _color(rgba: Any) -> dict[str, float]:
    r, g, b, a = rgba
    return {"r": r, "g": g, "b": b, "a": a}


# ---- the schemas, as far as they are used


def _object(**properties: Any) -> dict[str, Any]:
    return {"type": "object", "properties": properties}


def _array(items: dict[str, Any]) -> dict[str, Any]:
    return {"type": "array", "items": items}


_TEXT, _NUMBER, _FLAG = {"type": "string"}, {"type": "number"}, {"type": "boolean"}
_STAMP = _object(sec={"type": "integer"}, nsec={"type": "integer"})
_XYZ = _object(x=_NUMBER, y=_NUMBER, z=_NUMBER)
_XYZW = _object(x=_NUMBER, y=_NUMBER, z=_NUMBER, w=_NUMBER)
_COLOR = _object(r=_NUMBER, g=_NUMBER, b=_NUMBER, a=_NUMBER)
_POSE = _object(position=_XYZ, orientation=_XYZW)
_SOLID = {"pose": _POSE, "size": _XYZ, "color": _COLOR}
_NONE = _array({"type": "object"})
_SCENE = _object(
    deletions=_NONE,
    entities=_array(
        _object(
            timestamp=_STAMP,
            frame_id=_TEXT,
            id=_TEXT,
            lifetime=_STAMP,
            frame_locked=_FLAG,
            metadata=_NONE,
            arrows=_NONE,
            cubes=_array(_object(**_SOLID)),
            spheres=_array(_object(**_SOLID)),
            cylinders=_array(_object(**_SOLID, bottom_scale=_NUMBER, top_scale=_NUMBER)),
            lines=_NONE,
            triangles=_array(
                _object(
                    pose=_POSE,
                    points=_array(_XYZ),
                    color=_COLOR,
                    colors=_array(_COLOR),
                    indices=_array({"type": "integer"}),
                )
            ),
            texts=_NONE,
            models=_NONE,
        )
    ),
)
_TRANSFORMS = _object(
    transforms=_array(
        _object(timestamp=_STAMP, parent_frame_id=_TEXT, child_frame_id=_TEXT, translation=_XYZ, rotation=_XYZW)
    )
)
