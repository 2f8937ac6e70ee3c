"""How fast simulated time runs against the clock on the wall, and the line of the panel that says so."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import viser


class RealtimeRateCalculator:
    """Turns simulation times into realtime rates, one per period of wall time.

    Args:
        period: Wall time between two rates [s].
        clock: Returns wall time [s].
    """

    def __init__(self, period: float, clock: Callable[[], float] = time.monotonic):
        if not period > 0:
            raise RuntimeError(f"MeshcatParams: realtime_rate_period must be positive, got {period}.")
        self._period = period
        self._clock = clock
        self.reset()

    def reset(self) -> None:
        """Forgets everything; the next update only starts the measurement."""
        self._start: tuple[float, float] | None = None
        self._previous = 0.0

    def update(self, sim_time: float) -> float | None:
        """Returns a new rate when a period has passed, 0 when simulated time went back, else None."""
        if self._start is None or sim_time < self._previous:
            restarted = self._start is not None
            self._start = (sim_time, self._clock())
            self._previous = sim_time
            return 0.0 if restarted else None
        if sim_time == self._previous:
            return None
        self._previous = sim_time
        now = self._clock()
        elapsed = now - self._start[1]
        if elapsed < self._period:
            return None
        rate = (sim_time - self._start[0]) / elapsed
        self._start = (sim_time, now)
        return rate


class StatusLine:
    """Shows time and rate in the panel, at most a few times a second.

    Args:
        server: A viser.ViserServer.
    """

    def __init__(self, server: viser.ViserServer):
        self._server = server
        self._line = server.gui.add_html("", order=-1e6)
        self._text = ""
        self._due = False
        self._time: float | None = None
        self._rate: float | None = None
        server._websock_server.on_client_connect(self._on_connect)

    async def _on_connect(self, _connection: object) -> None:
        self._send()

    def show(self, sim_time: float | None, rate: float | None) -> None:
        """Shows a simulation time [s] and a rate; None keeps what was shown."""
        self._time = sim_time if sim_time is not None else self._time
        self._rate = rate if rate is not None else self._rate
        if not self._due and self._server._websock_server._client_state_from_id:
            self._due = True
            try:
                loop = self._server.get_event_loop()
                loop.call_soon_threadsafe(loop.call_later, 0.1, self._send)
            except RuntimeError:  # the server has stopped
                pass

    def _send(self) -> None:
        self._due = False
        parts = []
        if self._time is not None:
            parts.append(f"t = {self._time:.2f} s")
        if self._rate is not None:
            parts.append(f"{100 * self._rate:.0f} % of real time")
        text = " &nbsp;·&nbsp; ".join(parts)
        if text != self._text:
            self._text = text
            style = "padding:.35em .8em; font-size:.85em; opacity:.75; font-variant-numeric:tabular-nums"
            self._line.content = f'<div id="sheldrake-status" style="{style}">{text}</div>'


class Realtime:
    """The time and the realtime rate that a Meshcat shows.

    Args:
        status: Where they are shown, None without.
        period: Wall time between two rates [s].
    """

    def __init__(self, status: StatusLine | None, period: float):
        self._status, self.calculator, self._rate = status, RealtimeRateCalculator(period), 0.0

    def SetRealtimeRate(self, rate: float) -> None:
        """Shows how fast simulated time runs; 1 is real time."""
        self._rate = float(rate)
        if self._status is not None:
            self._status.show(None, self._rate)

    def GetRealtimeRate(self) -> float:
        """Returns the rate that was shown last."""
        return self._rate

    def SetSimulationTime(self, sim_time: float) -> None:
        """Says what simulation time [s] is shown, from which the realtime rate is measured."""
        rate = self.calculator.update(float(sim_time))
        if rate is not None:
            self._rate = rate
        if self._status is not None:
            self._status.show(float(sim_time), rate)
