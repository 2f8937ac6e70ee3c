"""Witness functions: finds the step in which one changes sign, and shortens it to that moment."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING

import numpy as np

from sheldrake.systems.analysis._integrator import IntegratorBase
from sheldrake.systems.analysis._kernel_steps import Arguments, callees, prepare, set_special
from sheldrake.systems.analysis._span import Span
from sheldrake.systems.framework._declarations import PUBLISH
from sheldrake.systems.framework._engine import python_rows
from sheldrake.systems.framework._event import (
    WITNESS_READS,
    EventStatus,
    WitnessFunction,
    WitnessFunctionDirection,
    checked_status,
)
from sheldrake.systems.framework._kernels import loop as _loop
from sheldrake.systems.framework._kernels import program as _program
from sheldrake.systems.framework._kernels import witness as _kernels
from sheldrake.systems.framework._kernels.witness import Watch, WatchNumbers
from sheldrake.systems.framework._vector import plain

if TYPE_CHECKING:
    from sheldrake.common.kernel import Kernel
    from sheldrake.systems.framework import Context, System


def _value(witness: WitnessFunction, context: Context) -> float:
    value = witness._calc(context)
    try:
        return float(plain(value))
    except (TypeError, ValueError):
        raise RuntimeError(
            f"The witness function {witness.description()!r} of {witness._system._describe()} must return a number; "
            f"it returned {value!r}."
        ) from None


class WitnessWatch:
    """Looks at the active witness functions before and after every step of the continuous state.

    Where all are kernels, a kernel does that, and shortens the steps.

    Args:
        system: The simulated system.
        span: The event loop.
        integrator: What steps; its accuracy says how exactly a change of sign is located.
    """

    def __init__(self, system: System, span: Span, integrator: IntegratorBase):
        self._system, self._span, self._integrator = system, span, integrator
        self._store = span.store
        self._active: list[tuple[WitnessFunction, Context]] = []  # with the context of its system
        self._seen_updates = -1
        self._seen: tuple[int, ...] | None = None  # when the last values were computed, and these
        self._w1: list[float] = []
        self.triggered: list[WitnessFunction] = []
        self._watch: Watch | None = None  # of kernels
        rows = self._store.layout.witness_rows
        span.set_rows({row: functools.partial(self._fire, n, kind) for (n, kind), row in rows.items()})

    def forget(self) -> None:
        """A simulation begins anew: which functions are active is asked again."""
        self._seen_updates, self._seen, self.triggered = -1, None, []

    def join(self) -> None:
        """Has kernels watch, if all witness functions are kernels; when the integrator has joined the span."""
        store, span = self._store, self._span
        if store.S.dtype != float or any(store.systems[n]._chooses_witnesses() for n in store.layout.witness_nodes):
            return
        found = self._system.GetWitnessFunctions(store.context(0))
        self._active = [(witness, self._context(witness)) for witness in found]
        watch = Watch(
            words=np.zeros(1, np.int64),
            at=np.zeros(1, np.int64),
            direction=np.array([_DIRECTIONS[witness.direction_type()] for witness in found]),
            triggered=np.zeros(len(found), np.int64),
            before=np.zeros(len(found)),
            now=np.zeros(len(found)),
            x0=np.zeros(store.layout.program.num_xc),
            number=np.zeros(WatchNumbers.SIZE),
        )

        def find_window() -> None:
            window = self._window()
            watch.window = -1.0 if window is None else window

        calls = [self._call(watch, k) for k in range(len(found))]
        table, words, at = callees(span, calls, [find_window])
        watch = self._watch = watch._replace(words=words, at=at)
        self._kept = calls, table  # whose addresses kernels know
        values = {"run": span.run, "watch": watch, "own_table": table}
        prepare([_kernels.look_before_step, _kernels.look_after_step])
        set_special(span, _program.WITNESS_BEFORE, _kernels.look_before_step, Arguments(span, values, {}))
        set_special(span, _program.WITNESS_AFTER, _kernels.look_after_step, Arguments(span, values, {}))

    def _call(self, watch: Watch, k: int) -> tuple[Kernel, Arguments]:
        """What computes the value of active witness function `k`."""
        witness, context = self._active[k]
        kernel, place = witness._kernel, self._store.layout.places[context._node]
        assert kernel is not None
        slab = {name: getattr(place, name) for name in WITNESS_READS}
        return kernel, Arguments(self._span, {kernel.names[-1]: watch.now[k : k + 1]}, slab)

    def _context(self, witness: WitnessFunction) -> Context:
        return self._store.context(self._store.layout.node_of[witness._system._system_id])

    def _values(self) -> list[float]:
        return [_value(witness, context) for witness, context in self._active]

    def before(self) -> None:
        """Remembers the beginning of a step."""
        store, updates = self._store, int(self._span.run.unrestricteds)
        if updates != self._seen_updates:
            self._seen_updates = updates
            found = self._system.GetWitnessFunctions(store.context(0))
            self._active = [(witness, self._context(witness)) for witness in found]
            self._seen = None
        self._t0, self._x0 = store.S[0], store.S[slice(*store.layout.xc)].copy()
        self._w0 = self._w1 if self._seen == self._counters() else self._values()

    def _counters(self) -> tuple[int, ...]:
        """What grows when anything in the context changes."""
        i = self._store.i
        return i[0], i[1], i[2]

    def _which(self) -> list[WitnessFunction]:
        values = self._w1 = self._values()
        self._seen = self._counters()
        return [
            witness
            for (witness, _), before, after in zip(self._active, self._w0, values)
            if _kernels.triggers(_DIRECTIONS[witness.direction_type()], before, after)
        ]

    def after(self) -> None:
        """Sees what triggered in the step, and goes back to where the first did."""
        self.triggered = self._which()
        if not self.triggered:
            return
        window = self._window()
        if window is None:
            del self.triggered[1:]  # as in Drake: the others are not looked at
        elif not self._isolate(window):
            return
        self._store.side.witnessed = 1

    def _window(self) -> float | None:
        """How exactly to locate a change of sign [s]; None: not at all."""
        integrator = self._integrator
        if not integrator.get_fixed_step_mode():
            wanted = self._store.accuracy or integrator.get_accuracy_in_use()
            return max(integrator.get_working_minimum_step_size(), 0.01 * wanted)
        accuracy = self._store.accuracy
        if accuracy is None:
            return None
        h = integrator.get_maximum_step_size()
        return max(integrator.get_working_minimum_step_size(), 0.01 * accuracy * h)

    def _isolate(self, window: float) -> bool:
        """Halves the step until it is short; False, with the state at its middle, if nothing triggers there."""
        a, b = self._t0, self._store.S[0]
        while True:
            c = (a + b) / 2
            self._integrate_to(c)
            self.triggered = self._which()
            if not self.triggered:
                return False
            b = c
            if not b - a > window:
                return True

    def _integrate_to(self, t: float) -> None:
        store = self._store
        store.S[0] = self._t0
        store.S[slice(*store.layout.xc)] = self._x0
        _program.changed(store.side, _program.CONTINUOUS)
        self._span.inside(_loop.integrate_to, t)

    def _fire(self, n: int, kind: int) -> EventStatus:
        """Runs the events of one kind of what triggered in a system."""
        store, status, context = self._store, EventStatus.DidNothing(), self._store.context(n)
        if self._watch is not None:
            self.triggered = [w for (w, _), hit in zip(self._active, self._watch.triggered.tolist()) if hit]
        for witness in self.triggered:
            event = witness._event
            if event is None or event._kind != _KINDS[kind] or self._context(witness) is not context:
                continue
            target = () if kind == PUBLISH else (python_rows.event_argument(store, kind, context),)
            result = event._call(witness._system, context, *target)
            status.KeepMoreSevere(EventStatus.Succeeded() if result is None else checked_status(result))
            if kind != PUBLISH and status.severity() is EventStatus.Severity.kFailed:
                break
        return status


_DIRECTIONS = {
    WitnessFunctionDirection.kNone: _kernels.NEVER,
    WitnessFunctionDirection.kPositiveThenNonPositive: _kernels.FALLS,
    WitnessFunctionDirection.kNegativeThenNonNegative: _kernels.RISES,
    WitnessFunctionDirection.kCrossesZero: _kernels.CROSSES,
}
_KINDS = ("unrestricted", "discrete", "publish")
