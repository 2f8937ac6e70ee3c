"""A run as other viewers take it: what is seen, where it was over time, and what was logged."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from sheldrake.geometry import HalfSpace, MeshcatVisualizerParams, Rgba, Role, Shape
from sheldrake.geometry._meshcat.drawables import PLATE_SIZE, Asset, Drawable, drawable_of_shape, triangles_of
from sheldrake.geometry._meshes.mesh_looks import MeshPart
from sheldrake.geometry._meshes.surfaces import unit_cube

from ._replay import (
    drawers_into,
    find_meshcat,
    find_scene_graph,
    find_state_logs,
    matrix_of,
    numbers_of,
    poses_of_states,
    query_of,
)

RATE = 60.0  # [Hz] of poses, at most
_PLATE = 0.01  # thickness of the plate that stands for a half space [m]


class Look(NamedTuple):
    """A geometry that is seen.

    Attributes:
        name: Of the geometry, without its body.
        frame: Number of the frame that it moves with; -1 where that is the world.
        pose: In that frame: quaternion w, x, y, z and position [m], shape (7,).
        shape: What it is.
        rgba: Its colour, where its file has none.
        parts: Its surface, material by material.
    """

    name: str
    frame: int
    pose: np.ndarray
    shape: Shape
    rgba: tuple[float, ...]
    parts: list[MeshPart]


@dataclass
class Run:
    """What is written of a run.

    Attributes:
        title: Of the whole.
        frames: Names of what moves, such as "robot/link".
        looks: What is seen.
        times: Of the poses [s], shape (n,).
        poses: Of the frames in the world: quaternion w, x, y, z and position [m], shape (n, len(frames), 7).
        logs: Everything that was logged.
    """

    title: str
    frames: list[str]
    looks: list[Look]
    times: np.ndarray
    poses: np.ndarray
    logs: Any


def run_of(simulator: Any, title: str, meshcat: Any) -> Run:
    """The run of a simulator: poses from logged states, else from what a Meshcat recorded, else as they are now."""
    from sheldrake.systems.primitives import LogSet
    from sheldrake.systems.primitives._log_files import find_sinks

    diagram, context = simulator.get_system(), simulator.get_context()
    sinks = find_sinks(diagram, context)
    logs = LogSet({name: sink.FindLog(context) for name, sink in sinks.items()})
    run = Run(title or diagram.get_name() or "Simulation", [], [], np.zeros(0), np.zeros((0, 0, 7)), logs)
    scene_graph = find_scene_graph(diagram)
    if scene_graph is None:
        return run
    query = query_of(scene_graph, context)
    inspector = query.inspector()
    frames, run.frames, run.looks = _seen(inspector)
    states = find_state_logs(context, sinks)
    meshcat = meshcat if meshcat is not None else find_meshcat(diagram)
    if states:
        run.times = _sample_times(states)
        run.poses = poses_of_states(scene_graph, context, states, frames, run.times)
        return run
    now = numbers_of(query._world_matrices(frames, {}))
    recorded = None if meshcat is None else _recorded(diagram, meshcat, frames, now)
    run.times, run.poses = (np.array([context.get_time()]), now[None]) if recorded is None else recorded
    return run


def _sample_times(states: list[Any]) -> np.ndarray:
    """Times at which states were logged [s], as many as RATE asks for."""
    times = np.unique(np.concatenate([log.times for log in states]))
    wanted = np.arange(times[0], times[-1], 1.0 / RATE)
    return times[np.unique(np.append(np.searchsorted(times, wanted - 1e-9), len(times) - 1))]


def _recorded(diagram: Any, meshcat: Any, frames: list[Any], now: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Times and poses that a Meshcat recorded; what it did not draw stays where it is now."""
    from sheldrake.geometry._meshcat.player import Frames

    recording = Frames(meshcat.get_mutable_recording())
    paths = {path: frame for s in drawers_into(meshcat, diagram) for frame, path in zip(s._frames, s._frame_paths)}
    if recording.num_frames < 2 or not paths:
        return None
    number = {frame: k for k, frame in enumerate(frames)}
    poses = np.tile(now, (recording.num_frames, 1, 1))
    for n in range(recording.num_frames):
        moved = [(number[paths[p]], X) for p, X in recording.poses_at(n) if paths.get(p) in number]
        if moved:
            poses[n, [k for k, _ in moved]] = numbers_of(np.array([X for _, X in moved]))
    return np.arange(recording.num_frames) / recording.frames_per_second, poses


def _seen(inspector: Any) -> tuple[list[Any], list[str], list[Look]]:
    """Frames with something to see, their names, and all that is seen: looks, or what collides where there are none."""
    role = Role.kIllustration
    if not inspector.NumGeometriesWithRole(role):
        role = Role.kProximity
    default = MeshcatVisualizerParams().default_color
    frames: list[Any] = []
    names: list[str] = []
    looks: list[Look] = []
    for frame in inspector.GetAllFrameIds():
        geometries = [g for g in inspector.GetGeometries(frame, role) if not _is_note(inspector, g, role)]
        number = -1
        if geometries and frame != inspector.world_frame_id():
            number = len(frames)
            frames.append(frame)
            names.append(inspector.GetName(frame).replace("::", "/"))
        looks += [_look(inspector, geometry, role, number, default) for geometry in geometries]
    return frames, names, looks


def _is_note(inspector: Any, geometry: Any, role: Role) -> bool:
    """Whether a geometry is for one viewer alone, as an ellipsoid that shows an inertia."""
    return inspector.GetProperties(geometry, role).HasProperty("meshcat", "accepting")


def _look(inspector: Any, geometry: Any, role: Role, frame: int, default: Rgba) -> Look:
    shape, properties = inspector.GetShape(geometry), inspector.GetProperties(geometry, role)
    rgba = properties.GetPropertyOrDefault("phong", "diffuse", default)
    pose = numbers_of(inspector.GetPoseInFrame(geometry).GetAsMatrix34()[None])[0]
    name = inspector.GetName(geometry).rpartition("::")[2]
    drawable = drawable_of_shape(shape, rgba)
    return Look(name, frame, pose, shape, tuple(rgba.rgba.tolist()), _parts(shape, drawable))


def _parts(shape: Shape, drawable: Drawable) -> list[MeshPart]:
    if isinstance(drawable, Asset):
        return drawable.mesh.parts
    if isinstance(shape, HalfSpace):
        vertices, faces = unit_cube()
        vertices = (vertices - [0.0, 0.0, 0.5]) * [PLATE_SIZE, PLATE_SIZE, _PLATE]
    else:
        triangles = triangles_of(drawable)
        assert triangles is not None, "what is registered has a surface"
        vertices, faces = triangles.vertices, triangles.faces
    return [MeshPart(vertices, faces, None, None, None, None, None)]


def outline(run: Run) -> np.ndarray | None:
    """Corners of boxes around everything that is seen, at some of the times, in the world [m], shape (n, 3).

    Half spaces have no end; None where there is nothing else.
    """
    corners = []
    some = np.unique(np.linspace(0, len(run.times) - 1, 20).astype(int))
    for look in run.looks:
        if isinstance(look.shape, HalfSpace):
            continue
        ends = np.array([(p.vertices.min(axis=0), p.vertices.max(axis=0)) for p in look.parts if len(p.vertices)])
        low, high = ends[:, 0].min(axis=0), ends[:, 1].max(axis=0)
        X_FG = matrix_of(look.pose)
        box = (unit_cube()[0] * (high - low) + (low + high) / 2.0) @ X_FG[:, :3].T + X_FG[:, 3]
        moved = [matrix_of(pose) for pose in run.poses[some, look.frame]] if look.frame >= 0 else [np.eye(3, 4)]
        corners += [box @ X[:, :3].T + X[:, 3] for X in moved]
    return np.concatenate(corners) if corners else None
