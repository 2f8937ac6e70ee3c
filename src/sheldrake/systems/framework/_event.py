"""Events: what happens, when, and how it went.

Systems declare them; the simulator's loop triggers them by kind: unrestricted, then discrete updates, then publishes.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._enums import IndexEnum, NumberEnum
from sheldrake.common._no_constructor import no_constructor
from sheldrake.common._overloads import Mismatch, expect
from sheldrake.common.kernel import Kernel

if TYPE_CHECKING:
    from sheldrake.solvers import MathematicalProgramResult
    from sheldrake.systems.framework._context.context import Context
    from sheldrake.systems.framework._system import System


class TriggerType(IndexEnum):
    """Why an event happens."""

    kUnknown = 0
    kInitialization = 1
    kForced = 2
    kTimed = 3
    kPeriodic = 4
    kPerStep = 5
    kWitness = 6


class WitnessFunctionDirection(IndexEnum):
    """Which changes of sign of a witness function trigger its event."""

    kNone = 0
    kPositiveThenNonPositive = 1
    kNegativeThenNonNegative = 2
    kCrossesZero = 3


@no_constructor("Use EventStatus.Succeeded() and its like.")
class EventStatus:
    """How handling an event went."""

    _severity: EventStatus.Severity
    _system: System | None
    _message: str

    class Severity(NumberEnum):
        """From best to worst."""

        kDidNothing = 0
        kSucceeded = 1
        kReachedTermination = 2
        kFailed = 3

    @classmethod
    def _make(cls, severity: EventStatus.Severity, system: System | None = None, message: str = "") -> EventStatus:
        status = object.__new__(cls)
        status._severity, status._system, status._message = severity, system, message
        return status

    def __repr__(self) -> str:
        said = f": {self._message}" if self._message else ""
        return f"<EventStatus {self._severity.name.removeprefix('k')}{said}>"

    @staticmethod
    def DidNothing() -> EventStatus:
        """The handler had nothing to do."""
        return EventStatus._make(EventStatus.Severity.kDidNothing)

    @staticmethod
    def Succeeded() -> EventStatus:
        """All went well."""
        return EventStatus._make(EventStatus.Severity.kSucceeded)

    @staticmethod
    def ReachedTermination(system: System, message: str) -> EventStatus:
        """All went well and the simulation should end now."""
        return EventStatus._make(EventStatus.Severity.kReachedTermination, system, message)

    @staticmethod
    def Failed(system: System, message: str) -> EventStatus:
        """The handler could not do its work."""
        return EventStatus._make(EventStatus.Severity.kFailed, system, message)

    def severity(self) -> EventStatus.Severity:
        """How bad it is."""
        return self._severity

    def system(self) -> System | None:
        """The system that reported, or None."""
        return self._system

    def message(self) -> str:
        """What the system said."""
        return self._message

    @checked
    def KeepMoreSevere(self, candidate: EventStatus) -> EventStatus:
        """Becomes `candidate` if that is worse; gives itself."""
        if candidate._severity.value > self._severity.value:
            self._severity, self._system, self._message = candidate._severity, candidate._system, candidate._message
        return self

    def __copy__(self) -> EventStatus:
        return EventStatus._make(self._severity, self._system, self._message)

    def __deepcopy__(self, memo: dict) -> EventStatus:
        return self.__copy__()


@no_constructor()
class PeriodicEventData:
    """Period and offset of a periodic event."""

    _period: float
    _offset: float

    @classmethod
    def _make(cls, period: float, offset: float) -> PeriodicEventData:
        data = object.__new__(cls)
        data._period, data._offset = period, offset
        return data

    def period_sec(self) -> float:
        """Period [s]."""
        return self._period

    def offset_sec(self) -> float:
        """Time of the first event [s]."""
        return self._offset

    def __copy__(self) -> PeriodicEventData:
        return PeriodicEventData._make(self._period, self._offset)

    def __deepcopy__(self, memo: dict) -> PeriodicEventData:
        return self.__copy__()


class Event:
    """Something that happens to a system: a publish, a discrete update or an unrestricted update."""

    _kind = ""

    def __init__(self) -> None:
        self._trigger = TriggerType.kUnknown
        self._callback: Callable | None = None
        self._system_callback: Callable | None = None

    def _set(self, args: tuple, kwargs: dict) -> None:
        Event.__init__(self)
        values = dict(kwargs)
        for arg in args:
            values["trigger_type" if isinstance(arg, TriggerType) else "callback"] = arg
        self._trigger = values.pop("trigger_type", TriggerType.kUnknown)
        self._callback = values.pop("callback", None)
        self._system_callback = values.pop("system_callback", None)
        if values or ((args or kwargs) and not callable(self._callback or self._system_callback)):
            raise Mismatch(f"{type(self).__name__}(): incompatible constructor arguments: {args} {kwargs}")

    def get_trigger_type(self) -> TriggerType:
        """Why it happens."""
        return self._trigger

    def _has_callback(self) -> bool:
        """Whether it was declared with what is to be done."""
        return self._callback is not None or self._system_callback is not None

    def _call(self, system: System, context: Context, *args: Any) -> Any:
        if self._system_callback is not None:
            return self._system_callback(system, context, self, *args)
        return None if self._callback is None else self._callback(context, self, *args)

    def _with_trigger(self, trigger: TriggerType) -> Event:
        event = object.__new__(type(self))
        event.__dict__.update(self.__dict__)
        event._trigger = trigger
        return event


class PublishEvent(Event):
    """An event that changes nothing: `callback(context, event)`, or `system_callback(system, context, event)`."""

    _kind = "publish"

    def __init__(self, *args: Any, **kwargs: Any):
        self._set(args, kwargs)


class DiscreteUpdateEvent(Event):
    """An event that changes discrete state: `callback(context, event, discrete_state)`."""

    _kind = "discrete"

    def __init__(self, *args: Any, **kwargs: Any):
        self._set(args, kwargs)


class UnrestrictedUpdateEvent(Event):
    """An event that changes any state: `callback(context, event, state)`."""

    _kind = "unrestricted"

    def __init__(self, *args: Any, **kwargs: Any):
        self._set(args, kwargs)


@no_constructor("Use LeafSystem.MakeWitnessFunction().")
class WitnessFunction:
    """A function of a context whose change of sign triggers an event. Made by `LeafSystem.MakeWitnessFunction`."""

    _system: System
    _description: str
    _direction: WitnessFunctionDirection
    _calc: Callable
    _kernel: Kernel | None
    _event: Event | None

    @classmethod
    def _make(
        cls,
        system: System,
        description: str,
        direction: WitnessFunctionDirection,
        calc: Callable | Kernel,
        event: Event | None,
    ) -> WitnessFunction:
        if isinstance(calc, Kernel) and not set(calc.names[:-1]) <= set(WITNESS_READS):
            raise Mismatch(
                f"MakeWitnessFunction(): incompatible function arguments: {calc!r} has the parameters "
                f"{', '.join(calc.names)}; a witness function reads some of {', '.join(WITNESS_READS)} and "
                "fills the last, a vector of one number."
            )
        witness = object.__new__(cls)
        witness._system, witness._description, witness._direction = system, description, direction
        witness._kernel = calc if isinstance(calc, Kernel) else None
        witness._calc = functools.partial(_value_by, calc) if isinstance(calc, Kernel) else calc
        witness._event = (
            None if event is None else expect("MakeWitnessFunction", event, Event)._with_trigger(TriggerType.kWitness)
        )
        return witness

    def description(self) -> str:
        """What it stands for."""
        return self._description

    def direction_type(self) -> WitnessFunctionDirection:
        """Which changes of sign trigger it."""
        return self._direction


def _value_by(kernel: Kernel, context: Context) -> Any:
    """The value of a witness function that is a kernel, by its Python source."""
    store = context._store
    place = store.layout.places[context._node]
    values = {name: store.S[slice(*getattr(place, name))] for name in WITNESS_READS}
    out = np.zeros(1, store.S.dtype)
    kernel(*(values.get(name, out) for name in kernel.names))
    return out[0]


WITNESS_READS = "xc", "xd", "p"
"""What witness functions that are kernels may read; the last parameter is the vector of one number that they fill."""


def checked_status(result: MathematicalProgramResult) -> EventStatus:
    """What an event's handler returned, if it is an EventStatus.

    Raises:
        RuntimeError: it is not.
    """
    if not isinstance(result, EventStatus):
        raise RuntimeError(f"An event handler must return None or an EventStatus, not {result!r}.")
    return result
