"""Point contacts as arrows that point both ways."""

from __future__ import annotations

import dataclasses

import numpy as np

from sheldrake.geometry import Cylinder, Meshcat
from sheldrake.geometry._meshcat.tree import full_path

from ._arrow import HEAD, X_TURNED, Longest, Shown, as_floats, draw_head, frames_along
from ._contact_visualizer_params import ContactVisualizerParams

_UNSEEN = 1e-7  # relative change of a force or a place that nobody can see


@dataclasses.dataclass
class _PointContactVisualizerItem:
    """One point contact: names of A and B, the force on B in W [N], shape (3,), the point in W [m], shape (3,)."""

    body_A: str
    body_B: str
    contact_force: np.ndarray
    contact_point: np.ndarray


class _PointContactVisualizer:
    """Draws point contacts as double-headed arrows below a prefix, "A+B" each.

    Further contacts of one pair, of which a box on a plane has four, are "A+B.2", "A+B.3" and so on.

    Args:
        meshcat: Where to draw.
        params: How.
    """

    def __init__(self, meshcat: Meshcat, params: ContactVisualizerParams):
        self._meshcat, self._params = meshcat, params
        self._root = full_path(params.prefix)
        self._shown, self._longest = Shown(meshcat), Longest(meshcat)
        meshcat._note(params.prefix)
        self._last: tuple[list[str], np.ndarray] = ([], np.zeros((0, 6)))

    def Delete(self) -> None:
        """Removes everything below the prefix."""
        self._meshcat.Delete(self._params.prefix)
        self._shown.clear()
        self._longest.forget()
        self._last = ([], np.zeros((0, 6)))

    def Update(self, time: float, items: list[_PointContactVisualizerItem]) -> None:
        """Shows these contacts and no others, at a simulation time [s]."""
        paths = self._paths(items)
        self._shown.hide_others(set(paths), time)
        if not paths:
            return
        forces = as_floats([item.contact_force for item in items]).reshape(-1, 3)
        points = as_floats([item.contact_point for item in items]).reshape(-1, 3)
        sizes = np.linalg.norm(forces, axis=1)
        visible = sizes >= self._params.force_threshold
        for path, seen in zip(paths, visible.tolist()):
            if self._shown.add(path):
                self._make(path)
            self._shown.show(path, seen, time)
        moved = visible & self._has_changed(paths, np.hstack([forces, points]))
        if moved.any():
            self._draw([path for path, m in zip(paths, moved) if m], forces[moved], points[moved], sizes[moved], time)

    def _paths(self, items: list[_PointContactVisualizerItem]) -> list[str]:
        """Returns where each contact is drawn."""
        seen: dict[str, int] = {}
        paths = []
        for item in items:
            pair = f"{self._root}/{item.body_A}+{item.body_B}"
            count = seen[pair] = seen.get(pair, 0) + 1
            paths.append(pair if count == 1 else f"{pair}.{count}")
        return paths

    def _has_changed(self, paths: list[str], values: np.ndarray) -> np.ndarray:
        """Returns which contacts are elsewhere, or push otherwise, than drawn; all of them while recording."""
        last_paths, last = self._last
        self._last = (paths, values)
        if last_paths != paths or self._meshcat._is_recording():
            return np.ones(len(paths), dtype=bool)
        return (np.abs(values - last) > _UNSEEN * (1.0 + np.abs(last))).any(axis=1)

    def _make(self, path: str) -> None:
        meshcat, radius, color = self._meshcat, self._params.radius, self._params.color
        meshcat.SetObject(f"{path}/cylinder", Cylinder(radius, 2.0), color)
        draw_head(meshcat, f"{path}/head", radius, color)
        draw_head(meshcat, f"{path}/tail", radius, color)

    def _draw(self, paths: list[str], forces: np.ndarray, points: np.ndarray, sizes: np.ndarray, time: float) -> None:
        """Places the arrows of contacts, all at once: this is part of a simulation's time."""
        n = len(paths)
        lengths = self._longest.of(sizes / self._params.newtons_per_meter)
        poses = np.zeros((3 * n, 3, 4))
        poses[:n, :, :3], poses[:n, :, 3] = frames_along(forces), points
        poses[n : 2 * n, :, :3], poses[2 * n :, :, :3] = np.eye(3), X_TURNED.matrix()
        poses[n : 2 * n, 2, 3], poses[2 * n :, 2, 3] = (
            -lengths - HEAD * self._params.radius,
            lengths + HEAD * self._params.radius,
        )
        heads, tails = [f"{path}/head" for path in paths], [f"{path}/tail" for path in paths]
        self._meshcat._set_poses([*paths, *heads, *tails], poses, time)
        scales = np.ones((n, 3))
        scales[:, 2] = lengths
        self._meshcat._set_scales([f"{path}/cylinder" for path in paths], scales, time)
