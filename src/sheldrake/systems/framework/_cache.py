"""Values computed on demand and kept until something they depend on changes."""

from __future__ import annotations

import dataclasses
import weakref
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from sheldrake.common._no_constructor import no_constructor
from sheldrake.common._overloads import Mismatch
from sheldrake.common.value import AbstractValue
from sheldrake.systems.framework._engine.freshness import Sources, freshness
from sheldrake.systems.framework._index import CacheIndex, DependencyTicket, Ticket

if TYPE_CHECKING:
    from sheldrake.systems.framework._context.context import Context
    from sheldrake.systems.framework._declarations import CacheDeclaration
    from sheldrake.systems.framework._system_base import SystemBase


class ValueProducer:
    """How to make and compute a value.

    Args:
        allocate: Gives an AbstractValue to compute into.
        calc: Computes it: `calc(context, abstract_value)`.
    """

    def __init__(self, allocate: Callable, calc: Callable[[Any, Any], None]):
        if not callable(allocate) or not callable(calc):
            raise Mismatch("ValueProducer(): incompatible constructor arguments: allocate and calc must be callable.")
        self._allocate, self._calc = allocate, calc

    @staticmethod
    def NoopCalc(context: Context, value: AbstractValue, /) -> None:
        """A `calc` that does nothing."""


@no_constructor()
class CacheEntryValue:
    """The kept value of a cache entry in one context."""

    _entry: CacheEntry
    _context: Context

    @classmethod
    def _make(cls, entry: CacheEntry, context: Context) -> CacheEntryValue:
        value = object.__new__(cls)
        value._entry, value._context = entry, context
        return value

    def GetValueOrThrow(self) -> Any:
        """The kept object.

        Raises:
            RuntimeError: it is out of date.
        """
        if self._entry.is_out_of_date(self._context):
            raise RuntimeError(f"CacheEntryValue.GetValueOrThrow(): {self._entry._name()} is out of date.")
        return self._entry._kept(self._context).get_value()

    def GetMutableValueOrThrow(self) -> Any:
        """The kept object, to be changed; it is taken for up to date after."""
        entry, context = self._entry, self._context
        return entry._kept(context).get_mutable_value()


class _Record:
    """What a root context keeps for a cache entry of one of its systems."""

    __slots__ = ("enabled", "sources", "stamp", "value")

    def __init__(self, enabled: bool, sources: Sources):
        self.value: AbstractValue | None = None
        self.stamp: tuple | None = None  # of the store, when the value was computed
        self.enabled, self.sources = enabled, sources


@no_constructor("Use System.DeclareCacheEntry().")
class CacheEntry:
    """A value that a system computes from its context."""

    _system: Any
    _number: int
    _values: weakref.WeakValueDictionary[int, CacheEntryValue]  # by id of their context, which they hold

    @classmethod
    def _make(cls, system: SystemBase, index: int) -> CacheEntry:
        entry = object.__new__(cls)
        entry._system, entry._number, entry._values = system, index, weakref.WeakValueDictionary()
        return entry

    @property
    def _declaration(self) -> CacheDeclaration:
        return self._system._cache_entries[self._number]

    def _name(self) -> str:
        return f"cache entry '{self.description()}' of {self._system._describe()}"

    def description(self) -> str:
        """What it is."""
        return self._declaration.description

    def cache_index(self) -> CacheIndex:
        """Its number."""
        return CacheIndex(self._number)

    def ticket(self) -> DependencyTicket:
        """Names it as a prerequisite."""
        return DependencyTicket(self._declaration.ticket)

    def prerequisites(self) -> set[DependencyTicket]:
        """What it depends on."""
        return {DependencyTicket(t) for t in self._declaration.tickets}

    def has_default_prerequisites(self) -> bool:
        """Whether it depends on everything, as it does unless told otherwise."""
        return self._declaration.tickets == frozenset({Ticket.ALL_SOURCES})

    # The value in one context.

    def _record(self, context: Context) -> _Record:
        self._system.ValidateContext(context)
        store, key = context._store, (context._node, self._number)
        record = store.cache.get(key)
        if record is None:
            from sheldrake.systems.framework._engine.topology import expand_tickets

            needs = expand_tickets(self._system, self._declaration.tickets)
            sources = freshness(store.layout, context._node, needs)
            record = store.cache[key] = _Record(self._declaration.enabled, sources)
        return record

    def _row(self, context: Context) -> int:
        """Row of the output port it belongs to, or -1."""
        j = self._declaration.output
        if j < 0:
            return -1
        self._system.ValidateContext(context)
        return context._store.layout.places[context._node].outputs[j].row

    def _kept(self, context: Context) -> AbstractValue:
        if self._declaration.output >= 0:
            return self._system.get_output_port(self._declaration.output).EvalAbstract(context)
        record = self._record(context)
        if record.value is None:
            record.value = _as_value(self._declaration.allocate(self._system), self._name())
        return record.value

    def is_out_of_date(self, context: Context) -> bool:
        """Whether it must be computed anew."""
        store, r = context._store, self._row(context)
        if r >= 0:
            return store.i[store.layout.stamp0 + r] != store.i[store.layout._stamps[r]]
        record = self._record(context)
        return record.stamp != store.stamp(record.sources)

    def EvalAbstract(self, context: Context) -> AbstractValue:
        """The value as an AbstractValue, computed if needed."""
        if self._declaration.output >= 0:
            return self._system.get_output_port(self._declaration.output).EvalAbstract(context)
        store, record = context._store, self._record(context)
        stamp = store.stamp(record.sources)
        if (
            record.stamp == stamp
            and record.value is not None
            and ((record.enabled and not store.uncached) or store.frozen)
        ):
            return record.value
        if store.frozen:
            raise RuntimeError(f"CacheEntry.Eval(): the cache is frozen, but {self._name()} is out of date.")
        value = self._kept(context)
        self._declaration.calc(self._system, context, value)
        record.stamp = stamp
        return value

    def Eval(self, context: Context) -> Any:
        """The object it holds, computed if needed."""
        return self.EvalAbstract(context).get_value()

    def get_cache_entry_value(self, context: Context) -> CacheEntryValue:
        """The kept value, to look at; the same object as long as somebody holds it."""
        value = self._values.get(id(context))
        if value is None:
            value = self._values[id(context)] = CacheEntryValue._make(self, context)
        return value

    def get_mutable_cache_entry_value(self, context: Context) -> CacheEntryValue:
        """The kept value, to change."""
        return self.get_cache_entry_value(context)

    def disable_caching(self, context: Context) -> None:
        """Computes it anew whenever it is asked for in this context."""
        if (r := self._row(context)) >= 0:
            context._store._cold.add(r)
            context._store.forget_readers()
        else:
            self._record(context).enabled = False

    def enable_caching(self, context: Context) -> None:
        """Undoes `disable_caching`."""
        if (r := self._row(context)) >= 0:
            context._store._cold.discard(r)
        else:
            self._record(context).enabled = True

    def is_cache_entry_disabled(self, context: Context) -> bool:
        """Whether it is computed whenever it is asked for in this context."""
        r = self._row(context)
        return r in context._store._cold if r >= 0 else not self._record(context).enabled

    def disable_caching_by_default(self) -> None:
        """Computes it whenever it is asked for, in contexts made from now on."""
        system, declaration = self._system, self._declaration  # which other systems may share
        system._cache_entries[self._number] = dataclasses.replace(declaration, enabled=False)
        if (j := declaration.output) >= 0:
            system._outputs[j] = dataclasses.replace(system._outputs[j], cached=False)

    def is_disabled_by_default(self) -> bool:
        """Whether new contexts compute it whenever it is asked for."""
        return not self._declaration.enabled


def _as_value(value: object, name: str) -> AbstractValue:
    if not isinstance(value, AbstractValue):
        raise TypeError(f"The allocate function of {name} must give an AbstractValue, not {value!r}.")
    return value
