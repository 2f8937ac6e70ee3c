"""LivePlot: an output port plotted in the page while the simulation runs."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

import numpy as np

from sheldrake.geometry import Meshcat
from sheldrake.geometry._meshcat.charts import Charts, Panel
from sheldrake.systems.framework import LeafSystem
from sheldrake.systems.primitives._vector_log import quantity, short_labels

from ._roll_pitch_yaw import with_roll_pitch_yaw

if TYPE_CHECKING:
    from sheldrake.systems.framework import Context, DiagramBuilder
    from sheldrake.systems.framework._port import OutputPort

_MOST_LINES = 8  # of one plot
_NOISE = 1e-9  # numbers below it are shown as zero: rounding errors fill no plot


class LivePlot(LeafSystem):
    """Plots its input in the panel of a Meshcat, one plot for each kind of quantity; orientations as angles [deg].

    The page shows the last `window` seconds. A simulation that starts anew starts the plots anew.

    Ports: the input "in".

    Args:
        meshcat: Whose page.
        names: Names of the elements of the input; `speed [m/s]` says its unit.
        title: What the plots are called; left out where the names say enough.
        publish_period: Simulated time between two points [s].
        window: How much is seen [s].

    Raises:
        ValueError: when there are no names, the period is not positive, or the window is shorter than the period.
    """

    def __init__(
        self,
        meshcat: Meshcat,
        names: list[str],
        title: str = "",
        publish_period: float = 1 / 32.0,
        window: float = 10.0,
    ):
        super().__init__()
        if not names:
            raise ValueError("LivePlot(): names is empty; give a name for each element of the input.")
        if not 0.0 < publish_period <= window:
            raise ValueError(
                f"LivePlot(): expected 0 < publish_period <= window, got {publish_period} s and {window} s."
            )
        self._meshcat, self._names, self._title = meshcat, list(names), title
        self._lock = threading.Lock()
        self._points = np.zeros((round(window / publish_period) + 1, 1 + len(names)))
        self._count = 0
        self._charts = Charts(meshcat._hub.server, self._panels)
        self.DeclareVectorInputPort("in", len(names))
        self.DeclarePeriodicPublishEvent(period_sec=publish_period, offset_sec=0.0, publish=self._take)
        self.DeclareForcedPublishEvent(publish=self._take)

    def Delete(self) -> None:
        """Forgets the points and removes the plots from the page."""
        with self._lock:
            self._count = 0
        self._charts.delete()

    def _take(self, context: Context) -> None:
        t, values = context.get_time(), self.get_input_port().Eval(context)
        points = self._points
        with self._lock:
            if self._count and t <= points[(self._count - 1) % len(points), 0]:
                self._count = 0
            row = points[self._count % len(points)]
            row[0], row[1:] = t, values
            self._count += 1
        self._charts.wake()

    def _panels(self) -> list[Panel]:
        with self._lock:
            n = len(self._points)
            first = max(0, self._count - n)
            points = self._points[np.arange(first, self._count) % n].copy()
        times = points[:, 0]
        found: dict[tuple[str, str], list[tuple[str, np.ndarray]]] = {}
        for name, row in zip(*with_roll_pitch_yaw(self._names, points[:, 1:].T)):
            kind, unit, label = quantity(name)
            if unit == "rad" and "roll" in kind:
                kind, unit, row = "orientation", "deg", np.degrees(row)
            found.setdefault((kind, unit), []).append((label, row))
        return [self._panel(kind, unit, lines, times) for (kind, unit), lines in found.items()]

    def _panel(self, kind: str, unit: str, lines: list[tuple[str, np.ndarray]], times: np.ndarray) -> Panel:
        about = ": ".join(word for word in (self._title, kind if kind != "value" else "") if word) or "value"
        labels = short_labels([label for label, _ in lines])[1][:_MOST_LINES]
        hidden = len(lines) - len(labels)
        title = f"{about} [{unit}]" if unit else about
        title += f" (first {_MOST_LINES} of {len(lines)})" if hidden else ""
        rows = np.array([row for _, row in lines[:_MOST_LINES]])
        return Panel(title, labels, times, np.where(np.abs(rows) < _NOISE, 0.0, rows))


def AddLivePlot(
    builder: DiagramBuilder,
    port: OutputPort,
    meshcat: Meshcat,
    title: str | None = None,
    publish_period: float = 1 / 32.0,
    window: float = 10.0,
) -> LivePlot:
    """Plots a vector output port in a page while the simulation runs.

    Args:
        builder: The diagram in the making.
        port: The output port.
        meshcat: Whose page.
        title: What the plots are called; the names of system and port when left out.
        publish_period: Simulated time between two points [s].
        window: How much is seen [s].

    Returns:
        The system that does it, connected to the port.

    Raises:
        ValueError: when the port is not of vectors or empty, or the times are no good.
    """
    system = port.get_system()
    where = f"{system.get_name()}/{port.get_name()}"
    if port.size() == 0:
        raise ValueError(f"AddLivePlot(): the port {where} has no numbers to plot.")
    named = getattr(system, "_output_names", None)
    names = named(port.get_index()) if named is not None else None
    if names is None or len(names) != port.size():
        names = [port.get_name()] if port.size() == 1 else [f"y{i}" for i in range(port.size())]
    plot = LivePlot(meshcat, names, where if title is None else title, publish_period, window)
    builder.AddNamedSystem(f"live plot of {where}", plot)
    builder.Connect(port, plot.get_input_port())
    return plot
