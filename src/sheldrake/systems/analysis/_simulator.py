"""Simulator: advances a system's context through time and events."""

from __future__ import annotations

import math
import operator
import time
import weakref
from typing import TYPE_CHECKING, Any, Generic, SupportsIndex, TypeVar

import numpy as np

from sheldrake.common._options import Options
from sheldrake.common._overloads import Mismatch, expect, incompatible
from sheldrake.systems.analysis._explicit import RungeKutta3Integrator
from sheldrake.systems.analysis._integrator import H_MAX, T_BREAK, IntegratorBase
from sheldrake.systems.analysis._progress import Progress
from sheldrake.systems.analysis._simulator_settings import SimulatorSettings
from sheldrake.systems.analysis._span import Span, note_status
from sheldrake.systems.analysis._status import SimulatorStatus
from sheldrake.systems.analysis._witness import WitnessWatch
from sheldrake.systems.framework import _evaluate
from sheldrake.systems.framework._engine import logs
from sheldrake.systems.framework._event import EventStatus, checked_status
from sheldrake.systems.framework._kernels import program as _program
from sheldrake.systems.framework._kernels.program import Run, RunWords, SideWords
from sheldrake.systems.framework._system import System
from sheldrake.systems.framework._vector import plain

if TYPE_CHECKING:
    from collections.abc import Callable

    from sheldrake.systems.framework import Context
    from sheldrake.systems.framework._engine.store import Store

Simulated = TypeVar("Simulated", bound=System)
_Reason = SimulatorStatus.ReturnReason
_COMMITS, _WATCHES = operator.index(RunWords.has_commit), operator.index(RunWords.has_witness)
_ASKS, _MONITORS = operator.index(RunWords.has_requests), operator.index(RunWords.has_monitor)
_PUBLISHES = operator.index(RunWords.has_every_step)
_BUDGET, _FRESH = operator.index(RunWords.budget), operator.index(RunWords.fresh)
_TERMINATE, _STATUS = operator.index(SideWords.terminate), operator.index(SideWords.status)


class InitializeParams(Options):
    """How `Simulator.Initialize` works.

    Args:
        suppress_initialization_events: Leave out initialization events.
    """

    suppress_initialization_events: bool = False


_ALL_EVENTS = InitializeParams()


class Simulator(SimulatorSettings, Generic[Simulated]):
    """Advances a system in time.

    Args:
        system: The system; usually a Diagram.
        context: Its root context; a default one if not given. It is not copied.
    """

    def __init__(self, system: Simulated, context: Context | None = None):
        if not isinstance(system, System):
            hint = "; give the diagram that its Build() makes" if hasattr(system, "Build") else ""
            raise Mismatch(f"Simulator(): incompatible constructor arguments: {system!r} is no System{hint}")
        self._system = system
        self._run: Any = Run(np.zeros(RunWords.SIZE, np.int64))
        self._count: Any = self._run.word.data  # which is faster than the array
        self._rate, self._show, self._native = 0.0, True, True
        self._monitor: Any = None
        self._between: list[Any] = []
        self._interrupt: Any = None  # called between native spans, may raise
        self._publish_at_initialization = self._publish_every_step = False
        self._span: Any = None
        self._ready = self._steps = False
        self._last_time: Any = None
        self._asked_at = math.nan
        if context is None:
            context = system.CreateDefaultContext()
        self._check_context(context)
        self._context = context
        self._adopt(RungeKutta3Integrator(system, context))
        self._integrator.set_maximum_step_size(0.1)
        self._integrator.request_initial_step_size_target(1e-4)
        self._integrator.set_target_accuracy(1e-4)

    def __reduce_ex__(self, protocol: SupportsIndex) -> str | tuple:
        raise TypeError(
            "Simulator: it can be neither copied nor pickled; make another, Simulator(system, context.Clone())."
        )

    # What it works on.

    def get_system(self) -> Simulated:
        """The system, of whatever class it is."""
        return self._system

    def has_context(self) -> bool:
        """Whether it has a context."""
        return self._context is not None

    def __repr__(self) -> str:
        where = "without a context" if self._context is None else f"at t = {self._context.get_time()} s"
        name = self._system.get_name() or type(self._system).__name__
        return f"<Simulator of '{name}' {where}, {self.get_num_steps_taken()} steps taken>"

    def get_context(self) -> Context:
        """The context."""
        return self._context

    get_mutable_context = get_context

    def reset_context(self, context: Any) -> None:
        """Takes another context, or none; `Initialize` follows.

        Raises:
            RuntimeError: the simulator is taking steps: this is a call from one of its callbacks.
        """
        self._must_rest("reset_context")
        if context is not None:
            self._check_context(context)
        self._context, self._span, self._ready = context, None, False
        self._integrator.reset_context(context)

    def release_context(self) -> Context:
        """Gives its context away and has none.

        Raises:
            RuntimeError: the simulator is taking steps: this is a call from one of its callbacks.
        """
        self._must_rest("release_context")
        context = self._context
        self.reset_context(None)
        return context

    def _must_rest(self, call: str) -> None:
        if self._steps:
            raise RuntimeError(
                f"Simulator.{call}(): the simulator is taking steps, and this call comes from one of its callbacks; "
                "make it when AdvanceTo() has returned."
            )

    def _check_context(self, context: Any) -> None:
        self._system.ValidateContext(context)
        if context._node != 0:
            raise RuntimeError("Simulator: the context must be a root context.")

    def get_integrator(self) -> IntegratorBase:
        """The integrator of continuous state."""
        return self._integrator

    get_mutable_integrator = get_integrator

    def reset_integrator(self, integrator: IntegratorBase) -> IntegratorBase:
        """Takes another integrator; `Initialize` follows.

        Raises:
            RuntimeError: the simulator is taking steps: this is a call from one of its callbacks.
        """
        self._must_rest("reset_integrator")
        self._adopt(expect("reset_integrator", integrator, IntegratorBase))
        return integrator

    def _adopt(self, integrator: IntegratorBase) -> None:
        integrator._run = self._run
        integrator._context = self._context
        self._integrator, self._span, self._ready = integrator, None, False
        integrator.ResetStatistics()

    # Running.

    def Initialize(self, params: InitializeParams | None = None) -> SimulatorStatus:
        """Runs initialization events, sets the clocks, and publishes what is due at the beginning.

        Raises:
            RuntimeError: there is no context; another thread or simulator works on it; an event handler failed.
        """
        return self._alone("Initialize", self._initialize, params or _ALL_EVENTS)

    def _initialize_anew(self) -> None:
        """`Initialize`, without what the integrator knows of earlier runs: what comes does not depend on them."""
        self.get_mutable_integrator()._forget_step_size()
        self.Initialize()

    def _alone(self, call: str, work: Any, *args: Any) -> Any:
        """Does the work of a call while the context is this simulator's, in this thread."""
        if self._context is None:
            raise RuntimeError(f"{call}() called without a Context; give one with reset_context().")
        store = self._context._store
        store.claim(f"Simulator.{call}()")
        self._steps = True
        try:
            return work(*args)
        finally:
            self._steps = False
            store.release()

    def _initialize(self, params: InitializeParams) -> SimulatorStatus:
        store = self._context._store
        if store.unsettled:
            store.settle()
        self._integrator.Initialize()
        self._reset_counts()
        if self._span_serves():
            logs.grow(store)
            if self._watch is not None:
                self._watch.forget()
        else:
            self._make_span()
        store.i[_TERMINATE] = 0
        t = store.S[0] = self._time0  # derivatives with respect to time stop here
        self._horizon = self._last_instant(store)
        if not abs(t) < self._horizon:
            self._check_time(t, "Initialize")
        initializes = not params.suppress_initialization_events
        if initializes and store.layout.updates_at_start:
            self._update_at_start(store)
        if not store.i[_TERMINATE]:
            self._span.begin(initializes)
            self._finish_step(self._publish_at_initialization)
        self._ready, self._last_time = True, store.S.item(0)
        return self._status(t, _program.TERMINATED if store.i[_TERMINATE] else _program.DONE)

    def _update_at_start(self, store: Store) -> None:
        """Makes the updates of initialization.

        Raises:
            RuntimeError: one failed.
        """
        self._span.update_at_start()
        if store.i[_STATUS]:
            self._raise()
        if store.unsettled:
            store.settle()
            if not self._span.is_current():
                self._make_span()

    def _last_instant(self, store: Store) -> float:
        """Time [s] from which numbers lie so far apart that steps or periods are lost between them."""
        layout, longest = store.layout, self._integrator._number[H_MAX]
        continuous = layout.xc[1] > layout.xc[0] and longest < layout.shortest_period
        return (longest if continuous else layout.shortest_period) * 2.0**51

    def _check_time(self, t: float, call: str) -> None:
        """Whether time can go on from t [s]."""
        if abs(t) < self._horizon:
            return
        if not np.isfinite(t):
            raise RuntimeError(f"Simulator.{call}(): the time of the context is {t} s; it must be finite.")
        else:
            raise RuntimeError(
                f"Simulator.{call}(): at the time {t:g} s, numbers are {np.spacing(abs(t)):g} s apart, and the system "
                f"has periods or steps of {self._horizon / 2.0**51:g} s: time would stand still."
            )

    def _span_serves(self) -> bool:
        """Whether the event loop of the last `Initialize` is right for the next."""
        span, integrator = self._span, self._integrator
        if span is None or span.store is not self._context._store or not span.is_current():
            return False
        joins = type(integrator)._join is not IntegratorBase._join
        return span.numbers is integrator._numbers and not joins

    def _make_span(self) -> None:
        store = self._context._store
        me = weakref.ref(self)  # the span must not own its simulator
        commits, watches = store.layout.num_abstract > 0, bool(store.layout.witness_nodes)
        asks = bool(store.layout.may_ask)
        special: list[Any] = [store.commit_abstract, store.discard_abstract] if commits else [None, None]
        special += [_method(me, name) if watches else None for name in _OF_WITNESSES]
        special += [_method(me, "_requests") if asks else None]
        special += [_method(me, name) for name in _SPECIAL]
        self._span = Span(store, self._run, self._integrator._numbers, special, self._native)
        self._watch: Any = WitnessWatch(self._system, self._span, self._integrator) if watches else None
        count = self._count
        count[_COMMITS], count[_WATCHES], count[_ASKS] = commits, watches, asks
        if count[_MONITORS]:
            self._span.enable(_program.MONITOR)
        if count[_PUBLISHES]:
            self._span.enable(_program.EVERY_STEP)
        if type(self._integrator)._make_step is not IntegratorBase._make_step:
            self._span.enable(_program.PYTHON_STEP)
        self._integrator._join(self._span)
        if self._watch is not None:
            self._watch.join()

    def _witness_before(self) -> None:
        self._watch.before()

    def _witness_after(self) -> None:
        self._watch.after()

    def _requests(self) -> None:
        """Triggers what systems ask for, once at a time: else two that wake each other would make time stand still."""
        store, layout = self._context._store, self._context._store.layout
        if store.S[0] == self._asked_at:
            return
        wanted = [store.systems[n]._asks(store.context(n)) for n in layout.may_ask]  # all: asking has effects
        if any(wanted):
            self._asked_at = float(store.S[0])
            for g in layout.requests:
                store.side.word[layout.program.triggers + g] = 1

    def _call_monitor(self) -> Any:
        return None if self._monitor is None else self._monitor(self._context)

    def _python_step(self) -> None:
        self._check_time(float(self._context._store.S[0]), "AdvanceTo")  # a callback may have set it
        self._integrator._make_step(self._span)

    def _every_step(self) -> EventStatus:
        status = _evaluate.publish(self._context._store, 0, "forced")
        if status.severity() is not EventStatus.Severity.kDidNothing:
            self._run.publishes += 1
        return status

    def _finish_step(self, publish: bool) -> None:
        """What follows the publishes outside the event loop: a forced one, if wanted, and the monitor.

        Raises:
            RuntimeError: something failed.
        """
        store = self._context._store
        if publish or self._monitor is not None:
            store.enter()
            try:
                if publish and not store.i[_STATUS]:
                    note_status(self._every_step(), self._span.outcome, store)
                if self._monitor is not None and not store.i[_STATUS]:
                    result = self._monitor(self._context)
                    if result is not None:
                        note_status(checked_status(result), self._span.outcome, store)
            finally:
                store.leave()
        if store.i[_STATUS] or self._span.outcome.failed():
            self._raise()

    def AdvanceTo(self, boundary_time: float, interruptible: bool = True) -> SimulatorStatus:
        """Advances to `boundary_time` [s]; updates due just then stay pending.

        Args:
            boundary_time: Where to stop.
            interruptible: Let Ctrl-C stop it at the end of a step; the context is then as after any step.

        Raises:
            TypeError: the time is no number.
            RuntimeError: the time lies in the past, or an event handler reported failure.
        """
        if type(boundary_time) is not float:
            if isinstance(boundary_time, str):
                ways = ["(boundary_time: float, interruptible: bool = True)"]
                raise incompatible("Simulator.AdvanceTo", ways, (boundary_time,), {})
            boundary_time = float(plain(boundary_time))
        return self._alone("AdvanceTo", self._advance_to, boundary_time)

    def _advance_to(self, T: float) -> SimulatorStatus:
        ended = self._get_ready()
        if ended is not None:
            return ended
        store = self._context._store
        t = store.S.item(0)
        if not t <= T:
            raise RuntimeError(
                f"Simulator.AdvanceTo(): boundary_time {T} lies before the current time {t} of the context."
            )
        if not abs(t) < self._horizon:
            self._check_time(float(t), "AdvanceTo")
        self._count[_FRESH], self._asked_at = 1, math.nan
        try:
            code = self._advance(T)
        finally:
            if self._between:
                self._call_visitors(True)
            t = self._last_time = store.S.item(0)
            store.stopped = (float(t), type(self._integrator).__name__, self._integrator._memory())
        return self._status(T, code)

    def _get_ready(self) -> SimulatorStatus | None:
        """Initializes, if that has not been done: a status where what happens first ends the run."""
        store, begun = self._context._store, None
        if not self._ready:
            if store.goes_on is not None and store.goes_on[0] == store.S[0]:
                self._go_on(store)
            else:
                begun = self._initialize(_ALL_EVENTS)
        if store.unsettled:
            store.settle()
        if not self._span.is_current() or self._span.numbers is not self._integrator._numbers:
            self._make_span()
        if not store.S.item(0) == self._last_time:
            raise RuntimeError(
                "Simulation time has changed since last Initialize() or AdvanceTo(). Resetting simulation time "
                "requires a call to Initialize()."
            )
        return None if begun is None or begun.succeeded() else begun

    def _ready_span(self, call: str) -> Span:
        """The event loop at the simulator's context, as the next `AdvanceTo` would find it.

        Raises:
            RuntimeError: an input port that kernels read has no value; or `Initialize` failed, which comes first.
        """
        self._alone(call, self._get_ready)
        self._span.check_inputs()
        return self._span

    def _go_on(self, store: Any) -> None:
        """Takes up a run that another process saved."""
        _, integrator, memory = store.goes_on
        self._integrator.Initialize()
        if integrator == type(self._integrator).__name__:
            try:
                self._integrator._remember(memory)
            except (LookupError, ValueError, TypeError, AttributeError) as error:
                raise RuntimeError(f"The file of the context says no such thing of a {integrator}: {error}.") from error
        self.ResetStatistics()
        self._make_span()
        self._horizon = self._last_instant(store)
        self._ready, self._last_time, store.goes_on = True, store.S[0], None

    def _advance(self, T: float) -> int:
        """Advances in native spans, between which Python looks at Ctrl-C, the clock and the terminal."""
        store, span, count, number = self._context._store, self._span, self._count, self._integrator._number
        store.i[_TERMINATE] = 0
        count[_BUDGET] = 1 if self._between else 1000
        progress: Any = None
        try:
            while True:
                number[T_BREAK] = math.inf
                if self._rate > 0:
                    self._pause(float(store.S[0]))
                    number[T_BREAK] = float(store.S[0]) + 0.004 * self._rate
                begin = time.monotonic()
                code = self._advance_span(span, T)
                elapsed = time.monotonic() - begin
                self._seconds += elapsed
                if self._between:
                    self._call_visitors(False)
                if self._interrupt is not None:
                    self._interrupt()
                if code == _program.ERROR or (code == _program.TERMINATED and span.outcome.failed()):
                    self._raise()
                elif code == _program.ROOM:
                    logs.grow(store, T)
                elif code != _program.BREAK:
                    return code
                if not abs(store.S[0]) < self._horizon:
                    self._check_time(float(store.S[0]), "AdvanceTo")  # a callback has set it
                if store.S[0] > T:
                    raise RuntimeError(
                        f"Simulator.AdvanceTo(): an update has set the time to {float(store.S[0])} s, which lies "
                        f"behind boundary_time {T}; a publish or a monitor may do that."
                    )
                if not span.is_current():
                    self._make_span()
                    span = self._span
                if elapsed < 0.02:
                    count[_BUDGET] = min(2 * count[_BUDGET], 1 << 24)
                elif elapsed > 0.08:
                    count[_BUDGET] = max(count[_BUDGET] // 2, 1)
                progress = progress or Progress(float(self._last_time), T, self._show)
                progress.update(float(store.S[0]))
        finally:
            if progress is not None:
                progress.close()

    def _advance_span(self, span: Span, T: float) -> int:
        """One native span; what waits for memory to rest is done after it."""
        store, dense = self._context._store, self._integrator._dense is not None
        if dense:
            self._count[_BUDGET], t0 = 1, float(store.S[0])
        code = span.advance(T)
        if dense:
            self._integrator._keep_step(t0)
        if store.unsettled:
            store.settle()
            self._count[_BUDGET] = 1 if self._between else 1000
        return code

    def _call_visitors(self, is_end: bool) -> None:
        """Lets those in who want to see the context from time to time: streams of logs."""
        for visitor in self._between:
            visitor(is_end)

    def _pause(self, t: float) -> None:
        """Sleeps as long as simulation time is ahead of real time."""
        ahead = self._real0 + (t - self._time0) / self._rate - time.monotonic()
        if ahead > 0:
            time.sleep(ahead)

    def _raise(self) -> None:
        span = self._span
        if span.outcome.error is None and span.outcome.failed():
            span.store.side.status = 0
            status = self._status(0.0, None)
            raise RuntimeError(status.FormatMessage())
        span.raise_error()

    def _status(self, boundary: float, code: int | None) -> SimulatorStatus:
        store, span = self._context._store, self._span
        t, outcome = float(store.S.item(0)), span.outcome.status
        span.outcome.status = None
        store.i[_TERMINATE] = 0
        if code is None:
            return SimulatorStatus._make(boundary, t, _Reason.kEventHandlerFailed, outcome.system(), outcome.message())
        if code == _program.TERMINATED and outcome is not None:
            reason = _Reason.kReachedTerminationCondition
            return SimulatorStatus._make(boundary, t, reason, outcome.system(), outcome.message())
        return SimulatorStatus._make(boundary, t, _Reason.kReachedBoundaryTime)

    def AdvancePendingEvents(self) -> SimulatorStatus:
        """Handles the updates that are pending at the current time, then publishes; time stands still."""
        return self._alone("AdvancePendingEvents", self._advance_pending_events)

    def _advance_pending_events(self) -> SimulatorStatus:
        ended = self._get_ready()
        if ended is not None:
            return ended
        store, span = self._context._store, self._span
        store.i[_TERMINATE] = 0
        logs.grow(store)
        steps = int(self._run.steps)
        span.handle_pending()
        if store.i[_STATUS]:
            self._raise()
        if self._run.steps > steps:  # else an update has ended it
            self._finish_step(self._publish_every_step)
        return self._status(store.S.item(0), _program.TERMINATED if store.i[_TERMINATE] else _program.DONE)


def first_tick(offset: float, period: float, t: float) -> int:
    """Number of a clock's first tick at or after t [s]."""
    k = max(0, int(np.ceil((t - offset) / period)))
    while k > 0 and offset + (k - 1) * period >= t:
        k -= 1
    while offset + k * period < t:
        k += 1
    return k


_OF_WITNESSES = ("_witness_before", "_witness_after")
_SPECIAL = ("_call_monitor", "_every_step", "_python_step")


def _method(reference: Any, name: str) -> Callable[[], Any]:
    return lambda: getattr(reference(), name)()
