"""Point contacts as arrows that point both ways."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable

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
        self._forget()

    def _forget(self) -> None:
        self._last: tuple[list[str], np.ndarray] = ([], np.zeros((0, 6)))
        self._visible: tuple[list[str], np.ndarray] = ([], np.zeros(0, bool))
        self._parts: tuple[list[str], list[str], list[str]] = ([], [], [])

    def Delete(self) -> None:
        """Removes everything below the prefix."""
        self._meshcat.Delete(self._params.prefix)
        self._shown.clear()
        self._longest.forget()
        self._forget()

    def Update(self, time: float, items: list[_PointContactVisualizerItem]) -> None:
        """Shows these contacts and no others, at a simulation time [s]."""
        paths = self.paths([(item.body_A, item.body_B) for item in items])
        forces, points = ([item.contact_force for item in items], [item.contact_point for item in items])
        self.show(time, paths, as_floats(forces).reshape(-1, 3), as_floats(points).reshape(-1, 3))

    def show(self, time: float, paths: list[str], forces: np.ndarray, points: np.ndarray) -> None:
        """Shows contacts and no others.

        Args:
            time: Simulation time [s].
            paths: Where, from paths(); the same list as long as the same contacts are meant saves time.
            forces: On the second body of each [N], shape (n, 3).
            points: Where they are [m], shape (n, 3).
        """
        sizes = np.linalg.norm(forces, axis=1)
        visible = sizes >= self._params.force_threshold
        last_paths, last_visible = self._visible
        if paths is not last_paths or not np.array_equal(visible, last_visible):
            self._visible = paths, visible
            self._shown.hide_others(set(paths), time)
            for path in paths:
                if self._shown.add(path):
                    self._make(path)
            self._shown.show_all(paths, visible.tolist(), time)
        if not paths:
            return
        moved = visible & self._has_changed(paths, np.hstack([forces, points]))
        if moved.any():
            drawn = paths if moved.all() else [path for path, m in zip(paths, moved) if m]
            self._draw(drawn, forces[moved], points[moved], sizes[moved], time)

    def paths(self, names: Iterable[tuple[str, str]]) -> list[str]:
        """Returns where each contact is drawn, by the names of both sides."""
        seen: dict[str, int] = {}
        paths = []
        for A, B in names:
            pair = f"{self._root}/{A}+{B}"
            count = seen[pair] = seen.get(pair, 0) + 1
            paths.append(pair if count == 1 else f"{pair}.{count}")
        return paths

    def _has_changed(self, paths: list[str], values: np.ndarray) -> np.ndarray:
        """Returns which contacts are elsewhere, or push otherwise, than drawn; all of them while recording."""
        last_paths, last = self._last
        self._last = (paths, values)
        if (last_paths is not paths and last_paths != paths) or self._meshcat._is_recording():
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
        placed, cylinders = self._parts_of(paths)
        self._meshcat._set_poses(placed, poses, time)
        scales = np.ones((n, 3))
        scales[:, 2] = lengths
        self._meshcat._set_scales(cylinders, scales, time)

    def _parts_of(self, paths: list[str]) -> tuple[list[str], list[str]]:
        """What is placed of arrows, themselves, heads and tails, and what is scaled; kept for the same list."""
        if self._parts[0] is not paths:
            heads, tails = [f"{path}/head" for path in paths], [f"{path}/tail" for path in paths]
            self._parts = paths, [*paths, *heads, *tails], [f"{path}/cylinder" for path in paths]
        return self._parts[1:]
