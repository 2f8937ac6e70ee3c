"""How a simulator goes about it, and what it counts."""

from __future__ import annotations

import math
import operator
import time
from typing import TYPE_CHECKING, Any

from sheldrake.common._checked import checked
from sheldrake.common._overloads import Mismatch
from sheldrake.common.deprecation import _warn_of_retired
from sheldrake.systems.analysis._integrator import IntegratorBase
from sheldrake.systems.framework._kernels.program import EVERY_STEP, MONITOR, RunWords
from sheldrake.systems.framework._vector import plain

if TYPE_CHECKING:
    from collections.abc import Callable

    from sheldrake.systems.framework._context.context import Context
    from sheldrake.systems.framework._event import EventStatus

_COUNTS = slice(operator.index(RunWords.steps), operator.index(RunWords.unrestricteds) + 1)


class SimulatorSettings:
    """The part of a simulator that is asked before and after a run."""

    _context: Any
    _integrator: IntegratorBase
    _run: Any
    _rate: float
    _last_time: float | None
    _monitor: Any
    _show: bool
    _span: Any

    # Settings.

    @checked
    def set_target_realtime_rate(self, realtime_rate: float) -> None:
        """Runs at most this many seconds of simulation in a second; 0 or less: as fast as it goes.

        Raises:
            RuntimeError: the rate is nan.
        """
        rate = float(realtime_rate)
        if math.isnan(rate):
            raise RuntimeError("Simulator.set_target_realtime_rate(): realtime_rate is nan; it must be a number.")
        self._rate = max(rate, 0.0)

    def get_target_realtime_rate(self) -> float:
        """The rate asked for."""
        return self._rate

    def get_actual_realtime_rate(self) -> float:
        """Simulation time over real time since the statistics were reset."""
        if self._last_time is None:
            return math.nan
        real = time.monotonic() - self._real0
        return float(self._context._store.S[0] - self._time0) / real if real > 0 else 0.0

    def set_publish_every_time_step(self, publish: bool) -> None:
        """Whether to force a publish after every step. Retired: a LeafSystem declares per-step events."""
        _warn_of_retired("set_publish_every_time_step()", "DeclarePerStepPublishEvent() of a LeafSystem")
        self._force_publish_every_step(publish)

    def _force_publish_every_step(self, publish: bool) -> None:
        self._publish_every_step = self._run.has_every_step = bool(publish)
        if publish and self._span is not None:
            self._span.enable(EVERY_STEP)

    def get_publish_every_time_step(self) -> bool:
        """Whether to force a publish after every step."""
        return self._publish_every_step

    def set_publish_at_initialization(self, publish: bool) -> None:
        """Whether to force a publish in `Initialize`. Retired: a LeafSystem declares initialization events."""
        _warn_of_retired("set_publish_at_initialization()", "DeclareInitializationPublishEvent() of a LeafSystem")
        self._publish_at_initialization = bool(publish)

    def set_monitor(self, monitor: Callable[[Context], EventStatus | None] | None) -> None:
        """`monitor(context)` is called after `Initialize` and every step; it may return an EventStatus.

        None forgets the monitor.
        """
        if monitor is None:
            self.clear_monitor()
            return
        if not callable(monitor):
            raise Mismatch(f"set_monitor(): incompatible function arguments: {monitor!r} cannot be called")
        self._monitor, self._run.has_monitor = monitor, True
        if self._span is not None:
            self._span.enable(MONITOR)

    def clear_monitor(self) -> None:
        """Forgets the monitor."""
        self._monitor, self._run.has_monitor = None, False

    def get_monitor(self) -> Callable | None:
        """The monitor, or None."""
        return self._monitor

    def set_progress(self, shown: bool) -> None:
        """Whether a long `AdvanceTo` shows a line of progress on a terminal or in a notebook."""
        self._show = bool(shown)

    # Counts.

    def ResetStatistics(self) -> None:
        """Begins counting anew."""
        self._reset_counts()
        self._integrator.ResetStatistics()

    def _reset_counts(self) -> None:
        """Those of the simulator; its integrator has its own."""
        self._run.word[_COUNTS] = 0
        self._seconds = 0.0  # spent in steps, without pauses
        self._real0 = time.monotonic()
        t = 0.0 if self._context is None else self._context._store.S.item(0)
        self._time0 = t if type(t) is float else float(plain(t))

    def get_num_steps_taken(self) -> int:
        """How many steps were taken."""
        return int(self._run.steps)

    def get_num_publishes(self) -> int:
        """How many times anything was published."""
        return int(self._run.publishes)

    def get_num_discrete_updates(self) -> int:
        """How many times discrete state was updated."""
        return int(self._run.discretes)

    def get_num_unrestricted_updates(self) -> int:
        """How many times unrestricted updates were made."""
        return int(self._run.unrestricteds)
