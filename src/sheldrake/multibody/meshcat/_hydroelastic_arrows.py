"""Contact surfaces, colored by pressure, with an arrow for the force and one for the moment."""

from __future__ import annotations

import dataclasses

import numpy as np

from sheldrake.geometry import Cylinder, Meshcat, Rgba
from sheldrake.geometry._meshcat.tree import full_path
from sheldrake.math import RigidTransform

from ._arrow import HEAD, X_TURNED, Longest, Shown, along, as_floats, draw_head
from ._contact_visualizer_params import ContactVisualizerParams

_FLAME = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 1.0, 1.0]])


@dataclasses.dataclass
class _HydroelasticContactVisualizerItem:
    """One contact surface.

    Attributes:
        body_A: Name of A.
        body_B: Name of B.
        centroid_W: C, the surface's centroid, in W [m], shape (3,).
        force_C_W: Force on A at C, in W [N], shape (3,).
        moment_C_W: Moment on A about C, in W [N m], shape (3,).
        p_WV: Vertices in W [m], shape (3, n).
        faces: Vertex numbers of the triangles, shape (3, m).
        pressure: At the vertices [Pa], shape (n,).
    """

    body_A: str
    body_B: str
    centroid_W: np.ndarray
    force_C_W: np.ndarray
    moment_C_W: np.ndarray
    p_WV: np.ndarray
    faces: np.ndarray
    pressure: np.ndarray


def pressure_colors(pressure: np.ndarray) -> np.ndarray:
    """Returns red, green, blue in [0, 1], shape (3, n), for pressures [Pa], shape (n,), as of a flame.

    From black for none over blue, red and yellow to white for the highest.
    """
    pressure = np.asarray(pressure, dtype=float)
    highest = pressure.max(initial=0.0)
    share = np.clip(pressure / highest, 0.0, 1.0) if highest > 0 else np.zeros_like(pressure)
    return np.array([np.interp(4.0 * share, np.arange(5), channel) for channel in _FLAME.T])


class _HydroelasticContactVisualizer:
    """Draws contact surfaces below a prefix, "A+B" each.

    Args:
        meshcat: Where to draw.
        params: How.
    """

    def __init__(self, meshcat: Meshcat, params: ContactVisualizerParams):
        self._meshcat, self._params = meshcat, params
        self._root = full_path(params.prefix)
        self._shown, self._longest = Shown(meshcat), Longest(meshcat)
        meshcat._note(params.prefix)

    def Delete(self) -> None:
        """Removes everything below the prefix."""
        self._meshcat.Delete(self._params.prefix)
        self._shown.clear()
        self._longest.forget()

    def Update(self, time: float, items: list[_HydroelasticContactVisualizerItem]) -> None:
        """Shows these surfaces and no others, at a simulation time [s]."""
        params = self._params
        drawn = {f"{self._root}/{item.body_A}+{item.body_B}": item for item in items}
        arrows = set()
        for path, item in drawn.items():
            force, moment = as_floats(item.force_C_W), as_floats(item.moment_C_W)
            visible = (
                np.linalg.norm(force) >= params.force_threshold or np.linalg.norm(moment) >= params.moment_threshold
            )
            self._shown.add(path)
            self._shown.show(path, bool(visible), time)
            arrows |= {f"{path}/force_C_W", f"{path}/moment_C_W"}
            if not visible:
                continue
            self._draw_surface(path, item, time)
            self._draw_arrow(
                f"{path}/force_C_W",
                force,
                params.force_threshold,
                params.newtons_per_meter,
                params.hydro_force_color,
                time,
            )
            self._draw_arrow(
                f"{path}/moment_C_W",
                moment,
                params.moment_threshold,
                params.newton_meters_per_meter,
                params.hydro_moment_color,
                time,
            )
        # The arrows of a surface that has gone are hidden with it.
        self._shown.hide_others({*drawn, *arrows}, time)

    def _draw_surface(self, path: str, item: _HydroelasticContactVisualizerItem, time: float) -> None:
        centroid = as_floats(item.centroid_W)
        self._meshcat.SetTransform(path, RigidTransform(centroid), time)
        surface = f"{path}/contact_surface"
        colors = pressure_colors(as_floats(item.pressure))
        self._meshcat.SetTriangleColorMesh(surface, as_floats(item.p_WV), np.asarray(item.faces), colors)
        self._meshcat.SetTransform(surface, RigidTransform(-centroid), time)

    def _draw_arrow(
        self, path: str, vector: np.ndarray, threshold: float, unit_per_meter: float, color: Rgba, time: float
    ) -> None:
        meshcat, radius = self._meshcat, self._params.radius
        if self._shown.add(path):
            meshcat.SetObject(f"{path}/cylinder", Cylinder(radius, 1.0), color)
            draw_head(meshcat, f"{path}/head", radius, color)
        size = float(np.linalg.norm(vector))
        is_shown = size >= threshold and size > 0.0
        self._shown.show(path, is_shown, time)
        if not is_shown:
            return
        length = float(self._longest.of(size / unit_per_meter))
        meshcat.SetTransform(path, along(vector, np.zeros(3)), time)
        meshcat.SetProperty(f"{path}/cylinder", "position", [0.0, 0.0, length / 2], time)
        meshcat.SetProperty(f"{path}/cylinder", "scale", [1.0, 1.0, length], time)
        meshcat.SetTransform(f"{path}/head", RigidTransform(X_TURNED, [0.0, 0.0, length + HEAD * radius]), time)
