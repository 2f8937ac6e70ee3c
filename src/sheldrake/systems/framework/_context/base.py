"""What contexts of all systems have in common."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from sheldrake.common._no_constructor import no_constructor
from sheldrake.systems.framework._engine.store import Store
from sheldrake.systems.framework._values import ContinuousState, DiscreteValues

if TYPE_CHECKING:
    from typing_extensions import Self

    from sheldrake.systems.framework._system import System
    from sheldrake.systems.framework._vector import BasicVector


@no_constructor("Use System.CreateDefaultContext().")
class ContextBase:
    """What all contexts have in common: ports and the cache."""

    _store: Store
    _node: int
    _system: System
    _place: Any
    _kept: Any = None
    """What the system keeps for this context, made of its memory; forgotten when the memory moves."""
    _reads: dict[Any, Any]
    """Functions that read vector ports, by number; output ports count down from -1. Forgotten when the memory moves."""
    _discrete: DiscreteValues | None = None
    """The discrete state, once it was asked for; forgotten when the memory moves."""
    _continuous: ContinuousState | None = None
    """The continuous state, likewise."""

    _state: Any = None
    """The state as one object, likewise."""
    _numeric: dict[int, BasicVector] | None = None
    """Groups of numeric parameters, likewise."""
    _parameters: Any = None
    """The parameters as one object, likewise."""

    @classmethod
    def _make(cls, store: Store, node: int, system: System) -> Self:
        context = object.__new__(cls)
        context._store, context._node, context._system = store, node, system
        context._place, context._reads = store.layout.places[node], {}
        return context

    def num_input_ports(self) -> int:
        """How many input ports the system has."""
        return self._system.num_input_ports()

    def num_output_ports(self) -> int:
        """How many output ports the system has."""
        return self._system.num_output_ports()

    def GetSystemName(self) -> str:
        """Name of the system this context was made for."""
        return self._system.get_name()

    def GetSystemPathname(self) -> str:
        """Path of the system this context was made for."""
        return self._system.GetSystemPathname()

    def DisableCaching(self) -> None:
        """Computes everything anew whenever it is asked for."""
        self._store.uncached = True
        self._store.forget_readers()

    def EnableCaching(self) -> None:
        """Undoes `DisableCaching`."""
        self._store.uncached = False

    def SetAllCacheEntriesOutOfDate(self) -> None:
        """Computes everything anew once."""
        self._store.out_of_date()

    def FreezeCache(self) -> None:
        """Keeps all computed values as they are; what is out of date then raises."""
        self._store.frozen = True

    def UnfreezeCache(self) -> None:
        """Undoes `FreezeCache`."""
        self._store.frozen = False

    def is_cache_frozen(self) -> bool:
        """Whether `FreezeCache` is in force."""
        return self._store.frozen
