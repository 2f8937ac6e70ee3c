"""Point contacts as arrows that point both ways."""

from __future__ import annotations

import dataclasses

import numpy as np

from sheldrake.geometry import Cylinder, Meshcat
from sheldrake.math import RigidTransform

from ._arrow import HEAD, X_TURNED, Shown, along, as_floats, draw_head
from ._contact_visualizer_params import ContactVisualizerParams


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
        self._shown = Shown(meshcat)

    def Delete(self) -> None:
        """Removes everything below the prefix."""
        self._meshcat.Delete(self._params.prefix)
        self._shown.clear()

    def Update(self, time: float, items: list[_PointContactVisualizerItem]) -> None:
        """Shows these contacts and no others, at a simulation time [s]."""
        seen: dict[str, int] = {}
        drawn: set[str] = set()
        for item in items:
            pair = f"{self._params.prefix}/{item.body_A}+{item.body_B}"
            seen[pair] = seen.get(pair, 0) + 1
            path = pair if seen[pair] == 1 else f"{pair}.{seen[pair]}"
            drawn.add(path)
            self._draw(path, as_floats(item.contact_force), as_floats(item.contact_point), time)
        self._shown.hide_others(drawn, time)

    def _draw(self, path: str, force: np.ndarray, point: np.ndarray, time: float) -> None:
        meshcat, radius, color = self._meshcat, self._params.radius, self._params.color
        if self._shown.add(path):
            meshcat.SetObject(f"{path}/cylinder", Cylinder(radius, 2.0), color)
            draw_head(meshcat, f"{path}/head", radius, color)
            draw_head(meshcat, f"{path}/tail", radius, color)
        size = float(np.linalg.norm(force))
        visible = size >= self._params.force_threshold
        self._shown.show(path, visible, time)
        if not visible:
            return
        length = size / self._params.newtons_per_meter
        tip = length + HEAD * radius
        meshcat.SetTransform(path, along(force, point), time)
        meshcat.SetProperty(f"{path}/cylinder", "scale", [1.0, 1.0, length], time)
        meshcat.SetTransform(f"{path}/head", RigidTransform([0.0, 0.0, -tip]), time)
        meshcat.SetTransform(f"{path}/tail", RigidTransform(X_TURNED, [0.0, 0.0, tip]), time)
