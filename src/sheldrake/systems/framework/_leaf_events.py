"""Events and witness functions of leaf systems: declaring them, and the methods that may handle them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._overloads import Mismatch
from sheldrake.systems.framework._declarations import DISCRETE, PUBLISH, UNRESTRICTED, Callback, EventDeclaration
from sheldrake.systems.framework._event import (
    DiscreteUpdateEvent,
    Event,
    PublishEvent,
    TriggerType,
    UnrestrictedUpdateEvent,
    WitnessFunction,
    WitnessFunctionDirection,
)
from sheldrake.systems.framework._system import System

if TYPE_CHECKING:
    from sheldrake.common.kernel import Kernel
    from sheldrake.systems.framework._context.context import Context
    from sheldrake.systems.framework._declarations import Stages
    from sheldrake.systems.framework._state import State
    from sheldrake.systems.framework._values import DiscreteValues

_KIND_OF = {PublishEvent: PUBLISH, DiscreteUpdateEvent: DISCRETE, UnrestrictedUpdateEvent: UNRESTRICTED}
_CLASS_OF = {kind: cls for cls, kind in _KIND_OF.items()}
_TRIGGERS = {
    "periodic": TriggerType.kPeriodic,
    "per_step": TriggerType.kPerStep,
    "initialization": TriggerType.kInitialization,
    "forced": TriggerType.kForced,
    "request": TriggerType.kTimed,
}
_DISPATCH = {PUBLISH: "DoPublish", DISCRETE: "DoCalcDiscreteVariableUpdates", UNRESTRICTED: "DoCalcUnrestrictedUpdate"}


class LeafEvents(System):
    """The part of LeafSystem that is about events."""

    _events: list[EventDeclaration]
    _witness_kernels: list[WitnessFunction]
    """Witness functions that are kernels and always active."""

    def _declare_event(
        self,
        kind: int,
        trigger: str,
        handler: Callable[..., Any] | Event | Stages | str | None,
        period: float = 0.0,
        offset: float = 0.0,
    ) -> None:
        if trigger == "periodic":
            period, offset = float(period), float(offset)
            if not period > 0 or not offset >= 0 or not np.isfinite(period) or not np.isfinite(offset):
                raise RuntimeError(
                    f"DeclarePeriodic...Event() of {self._describe()}: the period must be positive and the offset not "
                    f"negative; found period_sec={period}, offset_sec={offset}."
                )
        if isinstance(handler, Event):
            event = handler = handler._with_trigger(_TRIGGERS[trigger])
            if handler._callback is None and handler._system_callback is None:
                handler = None
        else:
            if handler is not None and handler != "log":
                handler = Callback.of(self, handler, "Declare...Event()")
            event = _event_of(kind, trigger, handler)
        self._events.append(EventDeclaration(kind, trigger, handler, event, offset, period))
        self._changed()

    @checked
    def DeclarePeriodicPublishEvent(
        self, period_sec: float, offset_sec: float, publish: Callable[..., Any] | Stages
    ) -> None:
        """`publish(context)` at offset + k period [s]."""
        self._declare_event(PUBLISH, "periodic", publish, period_sec, offset_sec)

    @checked
    def DeclarePeriodicDiscreteUpdateEvent(
        self, period_sec: float, offset_sec: float, update: Callable[..., Any] | Stages
    ) -> None:
        """`update(context, discrete_state)` at offset + k period [s]."""
        self._declare_event(DISCRETE, "periodic", update, period_sec, offset_sec)

    @checked
    def DeclarePeriodicUnrestrictedUpdateEvent(
        self, period_sec: float, offset_sec: float, update: Callable[..., Any] | Stages
    ) -> None:
        """`update(context, state)` at offset + k period [s]."""
        self._declare_event(UNRESTRICTED, "periodic", update, period_sec, offset_sec)

    @checked
    def DeclarePeriodicEvent(self, period_sec: float, offset_sec: float, event: Event) -> None:
        """`event` at offset + k period [s]."""
        self._declare_event(_kind_of(event), "periodic", event, period_sec, offset_sec)

    @checked
    def DeclarePerStepPublishEvent(self, publish: Callable[..., Any]) -> None:
        """`publish(context)` at the end of every step."""
        self._declare_event(PUBLISH, "per_step", publish)

    @checked
    def DeclarePerStepDiscreteUpdateEvent(self, update: Callable[..., Any]) -> None:
        """`update(context, discrete_state)` at the beginning of every step."""
        self._declare_event(DISCRETE, "per_step", update)

    @checked
    def DeclarePerStepUnrestrictedUpdateEvent(self, update: Callable[..., Any]) -> None:
        """`update(context, state)` at the beginning of every step."""
        self._declare_event(UNRESTRICTED, "per_step", update)

    def DeclarePerStepEvent(self, event: Event) -> None:
        """`event` in every step."""
        self._declare_event(_kind_of(event), "per_step", event)

    @checked
    def DeclareInitializationPublishEvent(self, publish: Callable[..., Any]) -> None:
        """`publish(context)` when a simulation is initialized."""
        self._declare_event(PUBLISH, "initialization", publish)

    @checked
    def DeclareInitializationDiscreteUpdateEvent(self, update: Callable[..., Any]) -> None:
        """`update(context, discrete_state)` when a simulation is initialized."""
        self._declare_event(DISCRETE, "initialization", update)

    @checked
    def DeclareInitializationUnrestrictedUpdateEvent(self, update: Callable[..., Any]) -> None:
        """`update(context, state)` when a simulation is initialized."""
        self._declare_event(UNRESTRICTED, "initialization", update)

    def DeclareInitializationEvent(self, event: Event) -> None:
        """`event` when a simulation is initialized."""
        self._declare_event(_kind_of(event), "initialization", event)

    @checked
    def DeclareForcedPublishEvent(self, publish: Callable[..., Any]) -> None:
        """`publish(context)` in `ForcedPublish`."""
        self._declare_event(PUBLISH, "forced", publish)

    @checked
    def DeclareForcedDiscreteUpdateEvent(self, update: Callable[..., Any]) -> None:
        """`update(context, discrete_state)` in `CalcForcedDiscreteVariableUpdate`."""
        self._declare_event(DISCRETE, "forced", update)

    @checked
    def DeclareForcedUnrestrictedUpdateEvent(self, update: Callable[..., Any]) -> None:
        """`update(context, state)` in `CalcForcedUnrestrictedUpdate`."""
        self._declare_event(UNRESTRICTED, "forced", update)

    def _all_events(self) -> list[EventDeclaration]:
        """The events, those of a kind whose dispatcher a derived class overrides as one call of it."""
        cls, found = type(self), list(self._events)
        for kind, name in _DISPATCH.items():
            if getattr(cls, name) is getattr(LeafEvents, name):
                continue
            together: dict[tuple, list] = {("forced", 0.0, 0.0): []}
            for e in found:
                if e.kind == kind:
                    together.setdefault((e.trigger, e.offset, e.period), []).append(e.event)
            found = [e for e in found if e.kind != kind]
            for (trigger, offset, period), events in together.items():
                events = events or [_event_of(kind, trigger, None)]
                found.append(EventDeclaration(kind, trigger, _Dispatch(name, events), None, offset, period))
        return found

    def DoPublish(self, context: Context, events: list) -> None:
        """Handles publish events that happen together; may be overridden."""
        for event in events:
            event._call(self, context)

    def DoCalcDiscreteVariableUpdates(self, context: Context, events: list, discrete_state: DiscreteValues) -> None:
        """Handles discrete updates that happen together; may be overridden."""
        for event in events:
            event._call(self, context, discrete_state)

    def DoCalcUnrestrictedUpdate(self, context: Context, events: list, state: State) -> None:
        """Handles unrestricted updates that happen together; may be overridden."""
        for event in events:
            event._call(self, context, state)

    # Witness functions.

    @checked
    def MakeWitnessFunction(
        self, description: str, direction_type: WitnessFunctionDirection, calc: Callable, e: Event | None = None
    ) -> WitnessFunction:
        """A function `calc(context)` whose change of sign triggers `e`, to be returned by `DoGetWitnessFunctions`."""
        return WitnessFunction._make(self, description, direction_type, calc, e)

    def DoGetWitnessFunctions(self, context: Context) -> list[WitnessFunction]:
        """Witness functions that are active now; to be overridden."""
        return list(self._witness_kernels)

    def _declare_witness(
        self, description: str, direction: WitnessFunctionDirection, calc: Kernel, event: Event
    ) -> None:
        """A witness function that is always active: a kernel of `WITNESS_READS` that fills a vector of one number.

        As long as nobody overrides `DoGetWitnessFunctions`, simulators look at it without Python.
        """
        self._witness_kernels.append(self.MakeWitnessFunction(description, direction, calc, event))

    def _declare_request(self, update: Callable[..., Any]) -> None:
        """`update(context, state)` in a step of no length, where the system has asked for it; see `_asks`."""
        self._declare_event(UNRESTRICTED, "request", update)

    def _asks(self, context: Context) -> bool:
        """Whether the system wants its events of the trigger "request" now; to be overridden.

        The simulator asks after the updates of a step. If somebody wants them, time stands still in this step: who
        updates at this time has not seen what comes, as in Drake, where such a system names this time as its next.
        """
        return False

    def _may_ask(self) -> bool:
        return type(self)._asks is not LeafEvents._asks

    def _has_witnesses(self) -> bool:
        return self._chooses_witnesses() or bool(self._witness_kernels)

    def _chooses_witnesses(self) -> bool:
        """Whether Python says which witness functions are active."""
        return type(self).DoGetWitnessFunctions is not LeafEvents.DoGetWitnessFunctions


class _Dispatch(Event):
    """Hands events that happen together to an overridden dispatcher."""

    def __init__(self, name: str, events: list[Event]):
        super().__init__()
        self._name, self._events = name, events

    def _call(self, system: System, context: Context, *target: object) -> Any:
        return getattr(system, self._name)(context, self._events, *target)


def _kind_of(event: Event) -> int:
    for cls, kind in _KIND_OF.items():
        if isinstance(event, cls):
            return kind
    raise Mismatch(f"Declare...Event(): incompatible function arguments: {event!r} is no event with a kind")


def _event_of(kind: int, trigger: str, handler: Callback | Kernel | Stages | str | None) -> Event:
    event = object.__new__(_CLASS_OF[kind])
    Event.__init__(event)
    event._trigger = _TRIGGERS[trigger]
    if isinstance(handler, Callback):
        event._system_callback = lambda system, context, event, *target: handler(system, context, *target)
    return event
