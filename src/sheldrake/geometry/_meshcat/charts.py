"""Plots over time in the panel of a page, which follow a simulation."""

from __future__ import annotations

import weakref
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

PERIOD = 0.1  # least wall time between two pictures [s]
_COLOURS = ["#1f6fc4", "#c8501e", "#2e8540", "#9a3fb5", "#b07d00", "#007d8a", "#c2185b", "#6d6d6d"]


class Panel(NamedTuple):
    """One plot.

    Attributes:
        title: What it shows, with its unit.
        labels: Names of the lines.
        times: Shape (n,) [s].
        rows: Values of the lines, shape (len(labels), n).
    """

    title: str
    labels: list[str]
    times: np.ndarray
    rows: np.ndarray


class Charts:
    """Shows panels in the page, at most ten times a second and only while somebody looks.

    Args:
        server: A viser.ViserServer.
        panels: Makes what is to be seen; called in the server's thread, and forgotten with its object.
    """

    def __init__(self, server: Any, panels: Callable[[], list[Panel]]):
        self._server = server
        self._panels = weakref.WeakMethod(panels)
        self._due = False
        self._shown: dict[str, Any] = {}
        server._websock_server.on_client_connect(self._on_connect)

    async def _on_connect(self, _connection: object) -> None:
        self._send()

    def wake(self) -> None:
        """Says that there is something new. Costs next to nothing; called from the simulation's thread."""
        if self._due or not self._server._websock_server._client_state_from_id:
            return
        self._due = True
        try:
            loop = self._server.get_event_loop()
            loop.call_soon_threadsafe(loop.call_later, PERIOD, self._send)
        except RuntimeError:  # the server has stopped
            pass

    def delete(self) -> None:
        """Removes all plots from the page."""
        for chart in self._shown.values():
            chart.remove()
        self._shown.clear()

    def _send(self) -> None:
        self._due = False
        make = self._panels()
        for panel in make() if make is not None else ():
            if len(panel.times):
                self._show(panel)

    def _show(self, panel: Panel) -> None:
        data = (panel.times, *panel.rows)
        chart = self._shown.get(panel.title)
        if chart is not None:
            chart.data = data
            return
        look = {"width": 1.5, "points": {"show": False}}
        lines = [{"label": label, "stroke": _COLOURS[k % 8], **look} for k, label in enumerate(panel.labels)]
        self._shown[panel.title] = self._server.gui.add_uplot(
            data,
            series=({"label": "t [s]"}, *lines),
            title=panel.title,
            scales={"x": {"time": False, "auto": True}},
            height=170,
        )
