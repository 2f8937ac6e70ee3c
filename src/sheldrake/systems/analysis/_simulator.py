"""Simulator: advances a system's context through time and events."""

from __future__ import annotations

import time
import weakref
from typing import Any

import numpy as np

from sheldrake.common._overloads import expect, incompatible
from sheldrake.systems.analysis._explicit import RungeKutta3Integrator
from sheldrake.systems.analysis._integrator import IntegratorBase
from sheldrake.systems.analysis._progress import Progress
from sheldrake.systems.analysis._simulator_settings import SimulatorSettings
from sheldrake.systems.analysis._span import Span, note_status
from sheldrake.systems.analysis._status import SimulatorStatus
from sheldrake.systems.analysis._witness import WitnessWatch
from sheldrake.systems.framework import _evaluate
from sheldrake.systems.framework._engine import logs
from sheldrake.systems.framework._event import EventStatus, checked_status
from sheldrake.systems.framework._kernels import integrate as _integrate
from sheldrake.systems.framework._kernels import loop as _loop
from sheldrake.systems.framework._kernels import program as _program
from sheldrake.systems.framework._system import System
from sheldrake.systems.framework._vector import plain

_FRESH = int(_program.FRESH)
_Reason = SimulatorStatus.ReturnReason


class InitializeParams:
    """How `Simulator.Initialize` works.

    Args:
        suppress_initialization_events: Leave out initialization events.
    """

    suppress_initialization_events: bool = False

    def __init__(self, **kwargs: Any):
        for name, value in kwargs.items():
            if name != "suppress_initialization_events":
                raise AttributeError(f"InitializeParams has no field {name!r}; it has suppress_initialization_events.")
            setattr(self, name, bool(value))

    def __repr__(self) -> str:
        return f"InitializeParams(suppress_initialization_events={self.suppress_initialization_events})"

    def __copy__(self) -> InitializeParams:
        return InitializeParams(suppress_initialization_events=self.suppress_initialization_events)

    def __deepcopy__(self, memo: dict) -> InitializeParams:
        return self.__copy__()


class Simulator(SimulatorSettings):
    """Advances a system in time.

    Args:
        system: The system; usually a Diagram.
        context: Its root context; a default one if not given. It is not copied.
    """

    def __init__(self, system: System, context: Any = None):
        if not isinstance(system, System):
            raise TypeError(f"Simulator(): incompatible constructor arguments: {system!r} is no System")
        self._system = system
        self._N = np.zeros(16, np.int64)
        self._rate, self._show, self._native = 0.0, True, True
        self._monitor: Any = None
        self._between: list[Any] = []
        self._publish_at_initialization = self._publish_every_step = False
        self._span: Any = None
        self._ready = False
        self._last_time: Any = None
        if context is None:
            context = system.CreateDefaultContext()
        self._check_context(context)
        self._context = context
        self._adopt(RungeKutta3Integrator(system, context))
        self._integrator.set_maximum_step_size(0.1)
        self._integrator.request_initial_step_size_target(1e-4)
        self._integrator.set_target_accuracy(1e-4)

    # What it works on.

    def get_system(self) -> System:
        """The system."""
        return self._system

    def has_context(self) -> bool:
        """Whether it has a context."""
        return self._context is not None

    def get_context(self) -> Any:
        """The context."""
        return self._context

    get_mutable_context = get_context

    def reset_context(self, context: Any) -> None:
        """Takes another context, or none; `Initialize` follows."""
        if context is not None:
            self._check_context(context)
        self._context, self._span, self._ready = context, None, False
        self._integrator.reset_context(context)

    def release_context(self) -> Any:
        """Gives its context away and has none."""
        context = self._context
        self.reset_context(None)
        return context

    def _check_context(self, context: Any) -> None:
        self._system.ValidateContext(context)
        if context._node != 0:
            raise RuntimeError("Simulator: the context must be a root context.")

    def get_integrator(self) -> IntegratorBase:
        """The integrator of continuous state."""
        return self._integrator

    get_mutable_integrator = get_integrator

    def reset_integrator(self, integrator: IntegratorBase) -> IntegratorBase:
        """Takes another integrator; `Initialize` follows."""
        self._adopt(expect("reset_integrator", integrator, IntegratorBase))
        return integrator

    def _adopt(self, integrator: IntegratorBase) -> None:
        integrator._N = self._N
        integrator._context = self._context
        self._integrator, self._span, self._ready = integrator, None, False
        integrator.ResetStatistics()

    # Running.

    def Initialize(self, params: InitializeParams | None = None) -> SimulatorStatus:
        """Runs initialization events, sets the clocks, and publishes what is due at the beginning."""
        if self._context is None:
            raise RuntimeError("Initialize() called without a Context; give one with reset_context().")
        params = params or InitializeParams()
        store, status = self._context._store, EventStatus.Succeeded()
        if store.unsettled:
            store.settle()
        self._integrator.Initialize()
        self.ResetStatistics()
        self._make_span()
        store.I[_program.TERMINATE] = 0
        if store.scalar is not float:
            store.S[0] = float(plain(store.S[0]))  # derivatives with respect to time stop here
        t = store.S[0]
        if not params.suppress_initialization_events:
            for kind, apply in (
                (_program.UNRESTRICTEDS, _evaluate.apply_unrestricted),
                (_program.DISCRETES, _evaluate.apply_discrete),
            ):
                result, any_ = apply(store, 0, _evaluate.initialization)
                self._N[kind] += any_
                status.KeepMoreSevere(result)
        self._set_clocks(float(t))
        self._publish_first(params)
        self._ready, self._last_time = True, store.S[0]
        if status.severity() is EventStatus.Severity.kReachedTermination:
            note_status(status, self._span.outcome, store)
        return self._status(float(t), int(_program.TERMINATED) if store.I[_program.TERMINATE] else int(_program.DONE))

    def _make_span(self) -> None:
        store = self._context._store
        me = weakref.ref(self)  # the span must not own its simulator
        special = [store.commit_abstract, *(_method(me, name) for name in _SPECIAL)]
        self._span = Span(store, self._N, self._integrator._Z, special, self._native)
        self._watch: Any = None
        if store.layout.witness_nodes:
            self._watch = WitnessWatch(self._system, self._span, self._integrator)
        self._integrator._join(self._span)

    def _witness_before(self) -> None:
        self._watch.before()

    def _witness_after(self) -> None:
        self._watch.after()

    def _call_monitor(self) -> Any:
        return self._monitor(self._context)

    def _python_step(self) -> None:
        self._integrator._make_step(self._span)

    def _every_step(self) -> None:
        self._system.ForcedPublish(self._context)
        self._N[_program.PUBLISHES] += 1

    def _set_clocks(self, t: float) -> None:
        """Every clock to its first tick at or after t [s]; what ticks at t is triggered."""
        store = self._context._store
        layout = store.layout
        store.I[layout.trig0 : layout.log0] = 0
        for c, (offset, period) in enumerate(layout.clocks):
            k = max(0, int(np.ceil((t - offset) / period)))
            while k > 0 and offset + (k - 1) * period >= t:
                k -= 1
            while offset + k * period < t:
                k += 1
            store.I[layout.k0 + c] = k
        _loop.tick(layout.program, store.I, t)

    def _publish_first(self, params: InitializeParams) -> None:
        store, span = self._context._store, self._span
        program = store.layout.program
        if not params.suppress_initialization_events:
            _loop.trigger(program, store.I, _program.AT_START)
            self._clear_start_updates(store)
        _loop.trigger(program, store.I, _program.PER_STEP)
        span.interpreted(_loop.publish)
        self._finish_step(self._publish_at_initialization)

    def _finish_step(self, publish: bool) -> None:
        """What follows the publishes outside the event loop: a forced one, if wanted, and the monitor.

        Raises:
            RuntimeError: something failed.
        """
        store = self._context._store
        if publish and not store.I[_program.STATUS]:
            self._every_step()
        if self._monitor is not None and not store.I[_program.STATUS]:
            result = self._monitor(self._context)
            if result is not None and note_status(checked_status(result), self._span.outcome, store):
                store.I[_program.STATUS] = -1
        if store.I[_program.STATUS]:
            self._raise()

    def _clear_start_updates(self, store: Any) -> None:
        """Initialization updates are done already."""
        for g, (kind, clock, _, _) in enumerate(store.layout.group_list):
            if clock == int(_program.AT_START) and kind != int(_program.PUBLISH):
                store.I[store.layout.trig0 + g] = 0

    def AdvanceTo(self, boundary_time: float, interruptible: bool = True) -> SimulatorStatus:
        """Advances to `boundary_time` [s]; updates due just then stay pending.

        Args:
            boundary_time: Where to stop.
            interruptible: Let Ctrl-C stop it at the end of a step; the context is then as after any step.

        Raises:
            TypeError: the time is no number.
            RuntimeError: the time lies in the past, or an event handler reported failure.
        """
        if isinstance(boundary_time, str):
            ways = ["(boundary_time: float, interruptible: bool = True)"]
            raise incompatible("Simulator.AdvanceTo", ways, (boundary_time,), {})
        T = float(plain(boundary_time))
        self._get_ready()
        store = self._context._store
        if not store.S[0] <= T:
            raise RuntimeError(
                f"Simulator.AdvanceTo(): boundary_time {T} lies before the current time {store.S[0]} of the context."
            )
        switches = [store.layout.num_abstract > 0, self._watch is not None, self._monitor is not None]
        self._N[:4] = [*switches, self._publish_every_step]
        self._N[_FRESH] = 1
        progress = Progress(float(store.S[0]), T, self._show)
        try:
            code = self._run(T, progress)
        finally:
            self._look_in(True)
            self._last_time = store.S[0]
            store.stopped = (float(store.S[0]), type(self._integrator).__name__, self._integrator._memory())
            progress.close()
        return self._status(T, code)

    def _get_ready(self) -> None:
        store = self._context._store
        if not self._ready:
            if store.goes_on is not None and store.goes_on[0] == store.S[0]:
                self._go_on(store)
            else:
                self.Initialize()
        if store.unsettled:
            store.settle()
        if self._span.layout is not store.layout or self._span.Z is not self._integrator._Z:
            self._make_span()
        if not store.S[0] == self._last_time:
            raise RuntimeError(
                "Simulation time has changed since last Initialize() or AdvanceTo(). Resetting simulation time "
                "requires a call to Initialize()."
            )

    def _go_on(self, store: Any) -> None:
        """Takes up a run that another process saved."""
        _, integrator, memory = store.goes_on
        self._integrator.Initialize()
        if integrator == type(self._integrator).__name__:
            self._integrator._remember(memory)
        self.ResetStatistics()
        self._make_span()
        self._ready, self._last_time, store.goes_on = True, store.S[0], None

    def _run(self, T: float, progress: Progress) -> int:
        """Advances in native spans, between which Python looks at Ctrl-C, the clock and the terminal."""
        store, span, N, Z = self._context._store, self._span, self._N, self._integrator._Z
        store.I[_program.TERMINATE] = 0
        N[_program.BUDGET] = 1 if self._between else 1000
        while True:
            Z[_integrate.T_BREAK] = np.inf
            if self._rate > 0:
                self._pause(float(store.S[0]))
                Z[_integrate.T_BREAK] = float(store.S[0]) + 0.004 * self._rate
            dense, t0 = self._integrator._dense is not None, float(store.S[0])
            if dense:
                N[_program.BUDGET] = 1
            begin = time.monotonic()
            code = span.advance(T)
            if store.unsettled:
                store.settle()
                self._make_span()
                span = self._span
                N[_program.BUDGET] = 1 if self._between else 1000
            if dense:
                self._integrator._keep_step(t0)
            elapsed = time.monotonic() - begin
            self._seconds += elapsed
            self._look_in(False)
            if code == _program.ERROR:
                self._raise()
            elif code == _program.ROOM:
                logs.grow(store)
            elif code != _program.BREAK:
                return code
            if elapsed < 0.02:
                N[_program.BUDGET] = min(2 * int(N[_program.BUDGET]), 1 << 24)
            elif elapsed > 0.08:
                N[_program.BUDGET] = max(int(N[_program.BUDGET]) // 2, 1)
            progress.update(float(store.S[0]))

    def _look_in(self, is_end: bool) -> None:
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
        failed = span.outcome.status
        if span.outcome.error is None and failed is not None and failed.severity() is EventStatus.Severity.kFailed:
            span.store.I[_program.STATUS] = 0
            status = self._status(0.0, None)
            raise RuntimeError(status.FormatMessage())
        span.raise_error()

    def _status(self, boundary: float, code: int | None) -> SimulatorStatus:
        store, span = self._context._store, self._span
        t, outcome = float(store.S[0]), span.outcome.status
        span.outcome.status = None
        store.I[_program.TERMINATE] = 0
        if code is None:
            return SimulatorStatus._make(boundary, t, _Reason.kEventHandlerFailed, outcome.system(), outcome.message())
        if code == _program.TERMINATED and outcome is not None:
            reason = _Reason.kReachedTerminationCondition
            return SimulatorStatus._make(boundary, t, reason, outcome.system(), outcome.message())
        return SimulatorStatus._make(boundary, t, _Reason.kReachedBoundaryTime)

    def AdvancePendingEvents(self) -> SimulatorStatus:
        """Handles the updates that are pending at the current time, then publishes; time stands still."""
        self._get_ready()
        store, span = self._context._store, self._span
        program, I = store.layout.program, store.I
        I[_program.TERMINATE] = 0
        self._N[_program.HAS_COMMIT] = store.layout.num_abstract > 0
        logs.grow(store)
        _loop.trigger(program, I, _program.PER_STEP)
        for kind in (_program.UNRESTRICTED, _program.DISCRETE):
            span.interpreted(_loop.update, kind)
            if I[_program.STATUS]:
                self._raise()
        if not I[_program.TERMINATE]:
            _loop.clear_updates(program, I)
            self._N[_program.STEPS] += 1
            span.interpreted(_loop.publish)
            self._finish_step(self._publish_every_step)
        code = _program.TERMINATED if I[_program.TERMINATE] else _program.DONE
        return self._status(float(store.S[0]), int(code))


_SPECIAL = ("_witness_before", "_witness_after", "_call_monitor", "_every_step", "_python_step")


def _method(reference: Any, name: str) -> Any:
    return lambda: getattr(reference(), name)()
