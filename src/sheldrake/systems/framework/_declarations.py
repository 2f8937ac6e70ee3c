"""What a system declares, as plain records: no record refers to the system that owns it, so that nothing cycles."""

from __future__ import annotations

import dataclasses
import types
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from sheldrake.common._overloads import Mismatch
from sheldrake.common.kernel import Kernel
from sheldrake.systems.framework._event import Event
from sheldrake.systems.framework._index import PortDataType
from sheldrake.systems.framework._vector import BasicVector, as_size

if TYPE_CHECKING:
    from sheldrake.common._random import RandomDistribution
    from sheldrake.common._types import Scalars
    from sheldrake.systems.framework._context.context import Context
    from sheldrake.systems.framework._system import System
    from sheldrake.systems.framework._system_base import SystemBase

UNRESTRICTED, DISCRETE, PUBLISH, DERIVATIVES, OUTPUT = 0, 1, 2, 3, 4
"""Kinds of row; the first three are kinds of event, in the order in which a step handles them."""

KIND_NAMES = ("unrestricted update", "discrete update", "publish", "time derivatives", "output")


@dataclasses.dataclass(slots=True)
class Callback:
    """A user's function. One that is a method of the system itself is kept unbound: the record must not own it."""

    function: Callable
    owned: bool = False

    @staticmethod
    def of(system: SystemBase, function: object, what: str) -> Callback | Kernel | Stages:
        """A callback; a kernel or stages as they were given.

        Raises:
            TypeError: it cannot be called.
        """
        if isinstance(function, (Kernel, Stages)):
            return function
        if not callable(function):
            raise Mismatch(f"{what}: incompatible function arguments: {function!r} cannot be called.")
        if isinstance(function, types.MethodType) and function.__self__ is system:
            return Callback(function.__func__, True)
        return Callback(function)

    def __call__(self, system: System, *args: Any) -> Any:
        return self.function(system, *args) if self.owned else self.function(*args)


@dataclasses.dataclass(slots=True)
class PythonStage:
    """A stage that needs what kernels do not see, such as abstract inputs: it fills scratch that later stages read."""

    function: Callable[[Any, Any], None]
    """Called with the system and its context."""
    fills: tuple[str, str] | None
    """Field of the scratch and its part; None for a stage that only looks whether others may run."""
    needs: frozenset[int] | None = None
    """Tickets of all that it reads: it is called before the others when that has changed; None: each time."""


@dataclasses.dataclass(slots=True)
class FedStage:
    """A kernel among stages that reads inputs of another system, which feeds its own: what both would do in Python.

    The slots of the inputs, by parameter name, come from `RootView.slot`.
    """

    kernel: Kernel
    reads: dict[str, Any]
    models: dict[str, Any]
    """Constant arrays of the other system, by parameter name."""


@dataclasses.dataclass(slots=True)
class Stages:
    """What follows each other as one handler of an event: kernels, and Python stages before them.

    The last kernel completes what the event writes.
    """

    choose: Callable[[Any, Any], Sequence[Kernel | PythonStage | FedStage | Callback]]
    """Tells which, when a root is compiled: of the system and its view of the root. A callback comes alone."""
    repeat: Callable[[Sequence[Any]], bool] = lambda stages: False
    """Whether these of an update do the same with the same state, parameters and inputs, also to the scratch: neither
    time nor what earlier calls left there has any influence. They are not called again while nothing changes."""
    only_doubles: bool = False
    """Whether their kernels are for doubles, although the system has other scalars too."""


def on_doubles(kernel: Kernel, function: Callable[..., Any]) -> Stages:
    """A kernel on doubles, and on other scalars a method of the system's class that computes the same."""
    stages: dict[bool, list[Any]] = {True: [kernel], False: [Callback(function, True)]}
    return Stages(lambda system, root: stages[system._scalar is float], only_doubles=True)


@dataclasses.dataclass(slots=True)
class InputDeclaration:
    """An input port; an optional one that nobody feeds has the value of its model."""

    name: str
    data_type: PortDataType
    size: int
    model: Any
    random_type: RandomDistribution | None = None
    ticket: int = 0
    optional: bool = False


@dataclasses.dataclass(slots=True)
class OutputDeclaration:
    """An output port: computed by `calc`, or a window on a state: ("xc", 0), ("xd", group) or ("xa", index)."""

    name: str
    data_type: PortDataType
    size: int
    model: Any
    calc: Any
    tickets: frozenset[int]
    state: tuple[str, int] | None = None
    cache_index: int = 0
    cached: bool = True


@dataclasses.dataclass(slots=True)
class EventDeclaration:
    """An event: kind, trigger ("periodic", "per_step", "initialization", "request", "forced"), times [s], handler."""

    kind: int
    trigger: str
    handler: Any
    event: Event | None
    offset: float = 0.0
    period: float = 0.0

    def call(self, system: System, context: Context, *target: Any) -> Any:
        """Calls a handler that is a Python function or an `Event`; what it returned."""
        if isinstance(self.handler, Event):
            return self.handler._call(system, context, *target)
        return self.handler(system, context, *target)


@dataclasses.dataclass(slots=True)
class CacheDeclaration:
    """A cache entry; `output` is the number of the output port it belongs to, or -1."""

    description: str
    allocate: Any
    calc: Any
    tickets: frozenset[int]
    ticket: int
    output: int = -1
    enabled: bool = True


def vector_model(value: BasicVector | int | Scalars, what: str) -> BasicVector:
    """A BasicVector of `value`: a size (zeros), a vector, or an array."""
    import numpy as np

    if isinstance(value, BasicVector):
        return value.Clone()
    if isinstance(value, (int, float, np.number)) and not isinstance(value, bool):
        return BasicVector._view(np.zeros(as_size(value, what)), None)
    return BasicVector(value)
