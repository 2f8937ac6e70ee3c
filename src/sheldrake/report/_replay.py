"""The scene and where its bodies are over time, from a logged state or from a recording."""

from __future__ import annotations

import contextlib
import io
import logging
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.multibody.plant import MultibodyPlant
from sheldrake.multibody.plant._parts import parts_of
from sheldrake.systems.framework._diagram import all_systems

if TYPE_CHECKING:
    from sheldrake.geometry import MeshcatVisualizer
    from sheldrake.geometry._meshcat.meshcat import Meshcat
    from sheldrake.systems.framework._context.context import Context
    from sheldrake.systems.framework._diagram import Diagram

RATE = 60.0  # [Hz] of poses, at most
MOST = 3000  # poses in time, at most


@dataclass
class Replay:
    """What the page plays.

    Attributes:
        html: A page that shows the scene and takes poses.
        paths: Names of what moves, in that page.
        times: [s], shape (n,).
        poses: Quaternion w, x, y, z and position [m], shape (n, len(paths), 7).
        camera: Where it looks to and where it stands [m], shape (2, 3), so that it sees where everything goes; or None.
    """

    html: str
    paths: list[str]
    times: np.ndarray
    poses: np.ndarray
    camera: np.ndarray | None = None


class StateLog:
    """A log of the state of a plant, or of one of its model instances."""

    def __init__(self, plant: MultibodyPlant, instance: Any, log: Any):
        self.plant, self.instance = plant, instance
        self.times, self.data = log.sample_times(), log.data()

    def set_state(self, root: Context, t: float) -> None:
        """Puts the plant in a root context where it was at a time [s]."""
        k = max(int(np.searchsorted(self.times, t + 1e-12)) - 1, 0)
        context = self.plant.GetMyMutableContextFromRoot(root)
        arguments = (context,) if self.instance is None else (context, self.instance)
        self.plant.SetPositionsAndVelocities(*arguments, self.data[:, k])


def find_state_logs(context: Context, sinks: dict[str, Any]) -> list[StateLog]:
    """The logs among `sinks` that tell the state of a plant; of each plant the whole state when it was logged."""
    found: list[StateLog] = []
    store = context._store
    for sink in sinks.values():
        kind, m, j = store.layout.sources[store.layout.node_of[sink._system_id], 0]
        plant = store.systems[m] if kind == "out" else None
        if not isinstance(plant, MultibodyPlant):
            continue
        log = sink.FindLog(context)
        what, instance = parts_of(plant).output_ports.shown_by(j)
        if what == "state" and log.num_samples():
            found.append(StateLog(plant, instance, log))
    whole = {id(log.plant) for log in found if log.instance is None}
    return [log for log in found if log.instance is None or id(log.plant) not in whole]


def sample_times(first: float, last: float) -> np.ndarray:
    """Times at which poses are taken [s]."""
    count = int(min(MOST, max(2, np.ceil((last - first) * RATE) + 1))) if last > first else 1
    return np.linspace(first, last, count)


def find_scene_graph(diagram: Any) -> Any:
    """The scene of a diagram, or None."""
    return next((s for s in all_systems(diagram) if type(s).__name__.startswith("SceneGraph")), None)


def query_of(scene_graph: Any, root: Any) -> Any:
    """The QueryObject of a scene in a root context."""
    return scene_graph.get_query_output_port().Eval(scene_graph.GetMyContextFromRoot(root))


def poses_of_states(
    scene_graph: Any, context: Any, logs: list[StateLog], frames: list[Any], times: np.ndarray
) -> np.ndarray:
    """Where frames were at times [s]: quaternion and position [m], shape (len(times), len(frames), 7)."""
    root, memo = context.Clone(), {}  # type: ignore[var-annotated]
    X = np.zeros((len(times), len(frames), 3, 4))
    for k, t in enumerate(times):
        for log in logs:
            log.set_state(root, float(t))
        X[k] = query_of(scene_graph, root)._world_matrices(frames, memo)
    return numbers_of(X)


def replay_of_states(
    diagram: Diagram, context: Context, logs: list[StateLog], meshcat: Meshcat | None
) -> Replay | None:
    """The replay of logged states; None when the diagram has no scene."""
    scene_graph = find_scene_graph(diagram)
    if scene_graph is None or not logs:
        return None
    first, last = (f([log.times[k] for log in logs]) for f, k in ((min, 0), (max, -1)))
    times = sample_times(float(first), float(last))
    with drawn(diagram, meshcat, query_of(scene_graph, context)) as (page, html, frames, paths):
        poses = poses_of_states(scene_graph, context, logs, frames, times)
        return Replay(html, paths, times, poses, camera_of(page, paths, poses))


def camera_of(page: Any, paths: list[str], poses: np.ndarray) -> np.ndarray | None:
    """Target and position of a camera that sees everything at all times [m], shape (2, 3)."""
    some = np.unique(np.linspace(0, len(poses) - 1, 20).astype(int))
    outlines = [page.outline({path: matrix_of(pose) for path, pose in zip(paths, poses[k])}) for k in some]
    seen = [points for points in outlines if points is not None]
    return np.array(page.stage.camera_for(np.concatenate(seen))) if seen else None


def matrix_of(pose: np.ndarray) -> np.ndarray:
    """Pose, shape (3, 4), of a unit quaternion and a position."""
    from sheldrake.common.eigen_geometry import Quaternion
    from sheldrake.math import RotationMatrix

    q = Quaternion(pose[:4] / np.linalg.norm(pose[:4]))
    return np.column_stack([RotationMatrix(q).matrix(), pose[4:]])


def numbers_of(X: np.ndarray) -> np.ndarray:
    """Quaternion w, x, y, z and position, shape (..., 7), of poses, shape (..., 3, 4)."""
    from sheldrake.geometry._meshcat.tree import quaternions

    q = quaternions(X[..., :3].reshape(-1, 3, 3)).reshape(*X.shape[:-2], 4)
    return np.concatenate([q, X[..., 3]], axis=-1)


@contextlib.contextmanager
def drawn(diagram: Diagram, meshcat: Any, query: Any) -> Any:
    """A page with the scene of a QueryObject, its frames and their paths: the user's Meshcat's, or one of our own."""
    from sheldrake.geometry import Meshcat, MeshcatVisualizer
    from sheldrake.geometry._meshcat.export import static_html

    own = meshcat is None
    if own:
        meshcat = _quiet(Meshcat)
    try:
        drawers = drawers_into(meshcat, diagram) or [MeshcatVisualizer(meshcat)]
        for drawer in drawers:
            if drawer._drawn_version is None:
                drawer._publish(query, 0.0)
        page = meshcat._hub.page
        frames = [frame for drawer in drawers for frame in drawer._frames]
        paths = [path for drawer in drawers for path in drawer._frame_paths]
        yield page, static_html(page, None), frames, paths
    finally:
        if own:
            meshcat._finalizer()


def _quiet(make: Any) -> Any:
    """Makes a Meshcat that tells nobody its address."""
    logger = logging.getLogger("drake")
    level = logger.level
    logger.setLevel(logging.ERROR)
    try:
        with contextlib.redirect_stderr(io.StringIO()):
            return make()
    finally:
        logger.setLevel(level)


def replay_of_recording(meshcat: Any) -> Replay | None:
    """The replay of what a Meshcat recorded; None when it recorded nothing."""
    from sheldrake.geometry._meshcat.export import static_html
    from sheldrake.geometry._meshcat.player import Frames

    frames = Frames(meshcat.get_mutable_recording())
    if frames.num_frames < 2:
        return None
    paths = [path for path, _ in frames.poses_at(0)]
    if not paths:
        return None
    step = max(1, int(np.ceil(frames.num_frames / MOST)))
    numbers = range(0, frames.num_frames, step)
    poses = numbers_of(np.array([[pose for _, pose in frames.poses_at(n)] for n in numbers]))
    times = np.array(numbers) / frames.frames_per_second
    page = meshcat._hub.page
    return Replay(static_html(page, None), paths, times, poses, camera_of(page, paths, poses))


def find_meshcat(diagram: Diagram) -> Any:
    """The Meshcat that a diagram draws into, or None."""
    from sheldrake.geometry import MeshcatVisualizer

    return next((s._meshcat for s in all_systems(diagram) if isinstance(s, MeshcatVisualizer)), None)


def drawers_into(meshcat: Meshcat, diagram: Diagram) -> list[MeshcatVisualizer]:
    """The systems of a diagram that draw geometry into a Meshcat."""
    from sheldrake.geometry import MeshcatVisualizer

    return [s for s in all_systems(diagram) if isinstance(s, MeshcatVisualizer) and s._meshcat is meshcat]
