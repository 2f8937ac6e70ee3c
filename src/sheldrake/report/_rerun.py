"""A run as a recording for the Rerun viewer (rerun.io)."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from sheldrake.common._files import whole_file
from sheldrake.geometry._meshcat.stage import viewpoint
from sheldrake.geometry._meshes.mesh_looks import MeshPart
from sheldrake.systems.primitives._vector_log import _need

from ._plots import Panel, panels_of
from ._run import Look, Run, outline

_TIMELINE = "simulation_time"
_MOST_PLOTS = 4  # that are seen at once


def write_rerun(run: Run, path: str | os.PathLike) -> None:
    """Entities `world/...` with geometry and poses, `plots/...` with what was logged, and a layout of both."""
    rerun = _need("rerun", "SaveRun()", "pip install 'sheldrake[rerun]'")
    panels = list(panels_of(run.logs))
    with whole_file(path) as file:
        recording = rerun.RecordingStream(run.title)
        recording.save(file.name, default_blueprint=_layout(rerun, run, panels))
        recording.log("world", rerun.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        for number, look in enumerate(run.looks):
            _log_look(rerun, recording, run, number, look)
        _log_poses(rerun, recording, run)
        for panel in panels:
            _log_panel(rerun, recording, panel)
        recording.disconnect()


def _frame(run: Run, number: int) -> list[str]:
    """Where a frame is among the entities."""
    return ["world"] if number < 0 else ["world", *run.frames[number].split("/")]


def _log_look(rerun: Any, recording: Any, run: Run, number: int, look: Look) -> None:
    """A geometry, each material as a mesh of its own; names of geometries need not differ, so they are numbered."""
    entity = [*_frame(run, look.frame), f"{look.name} ({number})"]
    w, x, y, z = look.pose[:4].tolist()
    pose = rerun.Transform3D(translation=look.pose[4:], quaternion=[x, y, z, w])
    recording.log(entity, pose, static=True)
    for k, part in enumerate(look.parts):
        recording.log([*entity, f"mesh {k}"], _mesh(rerun, part, look.rgba), static=True)


def _mesh(rerun: Any, part: MeshPart, rgba: tuple[float, ...]) -> Any:
    color = rgba if part.diffuse is None else part.diffuse
    vertices, faces, normals, uv, colors, *_ = part
    if normals is None:  # corners of their own, else Rerun would shade across edges
        corners = faces.ravel()
        vertices = vertices[corners]
        uv, colors = None if uv is None else uv[corners], None if colors is None else colors[corners]
        faces = np.arange(len(vertices)).reshape(-1, 3)
        sides = np.cross(vertices[1::3] - vertices[::3], vertices[2::3] - vertices[::3])
        normals = np.repeat(sides / np.maximum(np.linalg.norm(sides, axis=1, keepdims=True), 1e-300), 3, axis=0)
    picture = None if uv is None or part.image is None else np.asarray(part.image.convert("RGB"))
    return rerun.Mesh3D(
        vertex_positions=vertices,
        triangle_indices=faces,
        vertex_normals=normals,
        vertex_colors=None if colors is None else (255.0 * colors).round().astype(np.uint8),
        vertex_texcoords=None if uv is None else uv * [1.0, -1.0] + [0.0, 1.0],  # v downwards
        albedo_texture=picture,
        albedo_factor=np.clip(255.0 * np.array(color), 0.0, 255.0).round().astype(np.uint8),
    )


def _log_poses(rerun: Any, recording: Any, run: Run) -> None:
    for number in range(len(run.frames)):
        poses = run.poses[:, number]
        columns = rerun.Transform3D.columns(translation=poses[:, 4:], quaternion=poses[:, [1, 2, 3, 0]])
        recording.send_columns(_path(rerun, _frame(run, number)), [_times(rerun, run.times)], columns)


def _log_panel(rerun: Any, recording: Any, panel: Panel) -> None:
    entity = _path(rerun, _plot(panel))
    recording.log(entity, rerun.SeriesLines(names=panel.labels), static=True)
    columns = rerun.Scalars.columns(scalars=np.column_stack(panel.lines).ravel())
    lengths = np.full(len(panel.times), len(panel.lines))
    recording.send_columns(entity, [_times(rerun, panel.times)], columns.partition(lengths))


def _plot(panel: Panel) -> list[str]:
    """Where a panel is among the entities."""
    return ["plots", *panel.title.replace(": ", "/").split("/"), panel.unit or "values"]


def _path(rerun: Any, parts: list[str]) -> str:
    return str(rerun.new_entity_path(parts))


def _times(rerun: Any, times: np.ndarray) -> Any:
    return rerun.TimeColumn(_TIMELINE, duration=times)


def _layout(rerun: Any, run: Run, panels: list[Panel]) -> Any:
    """The scene beside the plots."""
    blueprint = rerun.blueprint
    plots = [
        blueprint.TimeSeriesView(origin=_path(rerun, _plot(panel)), name=f"{panel.title} [{panel.unit or '1'}]")
        for panel in panels
    ]
    views = []
    if run.looks:
        points = outline(run)
        target, position, *_ = (None, None) if points is None else viewpoint(points)
        eye = blueprint.EyeControls3D(position=position, look_target=target, eye_up=[0.0, 0.0, 1.0])
        views.append(blueprint.Spatial3DView(origin="world", name=run.title, eye_controls=eye))
    if plots:
        stack = blueprint.Vertical if len(plots) <= _MOST_PLOTS else blueprint.Tabs
        views.append(stack(*plots))
    return blueprint.Blueprint(blueprint.Horizontal(*views), collapse_panels=True) if views else None
