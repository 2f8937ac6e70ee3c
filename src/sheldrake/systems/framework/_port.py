"""Input and output ports.

An output port is a row of the store, computed when it is pulled and out of date; an input port has no memory: it
reads what it is connected to, or a value fixed in the context.
"""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._names import pretty_class_name
from sheldrake.common._no_constructor import no_constructor
from sheldrake.common._overloads import Mismatch
from sheldrake.common._scalars import ScalarTemplate
from sheldrake.common.value import AbstractValue, Value
from sheldrake.systems.framework._engine.store import CONSTANT, SAMPLED, Store, not_connected
from sheldrake.systems.framework._index import DependencyTicket, InputPortIndex, OutputPortIndex, PortDataType
from sheldrake.systems.framework._vector import BasicVector, as_vector, lifted

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np
    from typing_extensions import Self

    from sheldrake.common._types import Scalars
    from sheldrake.systems.framework._cache import CacheEntry
    from sheldrake.systems.framework._context.context import Context
    from sheldrake.systems.framework._declarations import InputDeclaration, OutputDeclaration
    from sheldrake.systems.framework._engine.memory import Slot
    from sheldrake.systems.framework._system_base import SystemBase


FLOAT64 = np.dtype(np.float64)


@no_constructor("Use InputPort.FixValue().")
class FixedInputPortValue:
    """The value an input port was fixed to."""

    _store: Store
    _port: tuple[int, int]

    @classmethod
    def _make(cls, store: Store, node: int, index: int) -> FixedInputPortValue:
        fixed = object.__new__(cls)
        fixed._store, fixed._port = store, (node, index)
        return fixed

    def GetMutableData(self) -> AbstractValue:
        """The value, to be changed."""
        store = self._store
        if (late := store.late_input(*self._port)) is not None:
            return late if isinstance(late, AbstractValue) else _value_on(late, None)
        slot = store.layout.input_slot(*self._port)
        store.touch(CONSTANT, ("fixed", slot.free))
        if not slot.vector:
            return store.fixed[slot.free]
        return _value_on(store.S[slice(*slot.span)], lambda: store.touch(CONSTANT, ("fixed", slot.free)))


def _value_on(memory: np.ndarray, on_write: Callable[[], None] | None) -> AbstractValue:
    """A vector's value that lies in this memory."""
    value = Value[BasicVector](BasicVector(0))
    value._held = BasicVector._view(memory, on_write)
    return value


@no_constructor()
class _Port:
    __slots__ = ("__weakref__", "_index", "_system")
    _kind = ""
    _index: int
    _system: Any

    @property
    def _declaration(self) -> InputDeclaration | OutputDeclaration:
        raise NotImplementedError

    @classmethod
    def _make(cls, system: SystemBase, index: int) -> Self:
        port = object.__new__(cls)
        port._system, port._index = system, index
        return port

    def get_system(self) -> Any:
        """The system it belongs to."""
        return self._system

    def get_name(self) -> str:
        """Its name."""
        return self._declaration.name

    def get_data_type(self) -> PortDataType:
        """Vector or abstract."""
        return self._declaration.data_type

    def size(self) -> int:
        """Number of elements of a vector port; 0 for an abstract one."""
        return self._declaration.size

    def GetFullDescription(self) -> str:
        """Number, name and system, as errors name it."""
        return f"{self._kind}[{self._index}] ({self.get_name()}) of {self._system._describe()}"

    def _as_vector(self, value: Scalars) -> BasicVector:
        if self.get_data_type() is PortDataType.kAbstractValued:
            raise RuntimeError(
                f"{self._kind}::Eval(): wrong value type BasicVector specified; actual type was {type(value).__name__} "
                f"for {self.GetFullDescription()}."
            )
        if value.__class__ is np.ndarray and value.dtype is FLOAT64:
            return BasicVector._view(value)
        return BasicVector(value)

    def _node_in(self, context: Context) -> int:
        try:
            if context._system is self._system:
                return context._node
        except AttributeError:
            pass
        from sheldrake.systems.framework._context.base import ContextBase

        if not isinstance(context, ContextBase):
            raise Mismatch(f"Eval(): incompatible function arguments: expected a Context, got {context!r}")
        if context._node == 0 and context._system is not self._system:
            n = context._store.layout.node_of.get(self._system._system_id)
            where = " (it is the root Context; use GetMyContextFromRoot())" if n is not None else ""
        else:
            where = ""
        raise RuntimeError(
            f"{self._kind}: The Context given as an argument was not created for this "
            f"{self.GetFullDescription()}{where}"
        )


def _settled(context: Context) -> Store:
    """A context's store; what waits for its memory to move is done first, if it may move."""
    store = context._store
    if store.unsettled:
        store.settle()
    return store


def value_at(store: Store, slot: Slot) -> Any:
    """What a computed port, a state or a fixed input holds: an array of its own, or the held object."""
    if slot.row >= 0:
        store.pull(slot.row)
    if slot.vector:
        return store.S[slot.span[0] : slot.span[1]].copy()
    return abstract_at(store, slot).get_value()


def abstract_at(store: Store, slot: Slot) -> AbstractValue:
    """The abstract value in an abstract slot that is up to date."""
    if slot.row >= 0:
        return store.output_value(slot.row)
    if slot.free >= 0:
        return store.fixed[slot.free]
    return store.abstract[slot.abstract_state]


def _as_abstract(store: Store, slot: Slot) -> AbstractValue:
    if not slot.vector:
        if slot.row >= 0:
            store.pull(slot.row)
        return abstract_at(store, slot)
    return Value[BasicVector]._holding(BasicVector._view(value_at(store, slot)))


class InputPort(_Port):
    """Where a system takes a value from outside."""

    __slots__ = ()
    _kind = "InputPort"

    @property
    def _declaration(self) -> InputDeclaration:
        return self._system._inputs[self._index]

    def get_index(self) -> InputPortIndex:
        """Its number."""
        return InputPortIndex(self._index)

    def ticket(self) -> DependencyTicket:
        """Names it as a prerequisite."""
        return DependencyTicket(self._declaration.ticket)

    def _slot(self, context: Context) -> Slot | None:
        node = self._node_in(context)
        store = _settled(context)
        slot = store.layout.input_slot(node, self._index)
        if slot.free >= 0 and not store.i[store.layout.fixed0 + slot.free]:
            return None
        return slot

    def _required(self, context: Context) -> Slot:
        slot = self._slot(context)
        if slot is None:
            raise not_connected(self._system, self._index)
        return slot

    def _late(self, context: Context) -> AbstractValue | np.ndarray | None:
        """What it will be fixed to when memory may move; None if nothing waits."""
        if not context._store.unsettled:
            return None
        return _settled(context).late_input(self._node_in(context), self._index)

    def HasValue(self, context: Context) -> bool:
        """Whether it is connected or fixed."""
        return self._slot(context) is not None or self._late(context) is not None

    def Eval(self, context: Context) -> Any:
        """Its value: the caller's own array, or the object that an abstract port carries.

        Raises:
            RuntimeError: it is neither connected nor fixed, or `context` is not its system's.
        """
        reads = getattr(context, "_reads", None)
        if reads is not None and context._system is self._system:
            read = reads.get(self._index)
            if read is not None:
                return read()
        return self._first_eval(context)

    def _first_eval(self, context: Context) -> Any:
        self._node_in(context)
        if (late := self._late(context)) is not None:
            return late.get_value() if isinstance(late, AbstractValue) else late.copy()
        slot = self._required(context)
        if (read := context._store.reader(slot)) is not None:
            context._reads[self._index] = read if slot.free < 0 else self._reader_of_fixed(context._store, slot, read)
        return value_at(context._store, slot)

    def _reader_of_fixed(self, store: Store, slot: Slot, read: Callable[[], Any]) -> Callable[[], Any]:
        """A reader that is for as long as the port is fixed."""
        i, fixed, system, index = store.i, store.layout.fixed0 + slot.free, self._system, self._index

        def read_if_fixed() -> Any:
            if not i[fixed]:
                raise not_connected(system, index)
            return read()

        return read_if_fixed

    def EvalAbstract(self, context: Context) -> AbstractValue:
        """Its value as an AbstractValue; a vector port's is a `Value[BasicVector]`."""
        value = self._abstract_if_any(context)
        if value is None:
            raise not_connected(self._system, self._index)
        return value

    def _abstract_if_any(self, context: Context) -> AbstractValue | None:
        slot = self._slot(context)
        if (late := self._late(context)) is not None:
            return late if isinstance(late, AbstractValue) else Value[BasicVector](BasicVector(late))
        return None if slot is None else _as_abstract(context._store, slot)

    def EvalBasicVector(self, context: Context) -> BasicVector:
        """A vector port's value as a BasicVector.

        Raises:
            RuntimeError: it has none, or the port is abstract.
        """
        return self._as_vector(self.Eval(context))

    def Allocate(self) -> AbstractValue:
        """A value of the type it takes."""
        model = self._declaration.model
        if isinstance(model, BasicVector):
            return Value[BasicVector](model._on_scalar(self._system._scalar))
        return self._model().Clone()

    def _model(self) -> AbstractValue:
        """What an abstract port was declared with, on the scalar of its system; not to be changed."""
        return _on_scalar(self._declaration.model, self._system._scalar)

    def FixValue(self, context: Context, value: Any) -> FixedInputPortValue:
        """Gives it this value in this context, over any connection.

        Called while a simulator steps or something is computed in the context, over a connection: who asks a port has
        the new value at once, kernels have it when the step, update or computation that is under way has ended.

        Args:
            value: A vector, or what the abstract port carries, or an AbstractValue of it.

        Raises:
            RuntimeError: a vector of another size, or an AbstractValue of something else.
            TypeError: something of another type.
        """
        node, store = self._node_in(context), _settled(context)
        store.fix(node, self._index, self._numbers(value, store) if self._is_vector() else self._abstract_value(value))
        return FixedInputPortValue._make(store, node, self._index)

    def _is_vector(self) -> bool:
        return self._declaration.data_type is PortDataType.kVectorValued

    def _numbers(self, value: Any, store: Store) -> np.ndarray:
        """A vector as an array for the slab."""
        declaration = self._declaration
        if isinstance(value, (list, np.ndarray)) and store.scalar is float:
            plain = as_vector(value)
            if plain.dtype == float and len(plain) == declaration.size:
                return plain
        if isinstance(value, AbstractValue):
            value = _vector_in(value)
        fresh = value if isinstance(value, BasicVector) else _coerced(value, store)
        if fresh.size() != declaration.size:
            raise RuntimeError(
                f"FixValue(): input port '{declaration.name}' (index {self._index}) of system "
                f"'{self._system.GetSystemPathname()}' takes a vector of size {declaration.size}, not one of size "
                f"{fresh.size()}."
            )
        return lifted(fresh._v.copy(), store.scalar)

    def _abstract_value(self, value: Any) -> AbstractValue:
        model = _on_scalar(self._declaration.model, self._system._scalar)
        if not isinstance(value, AbstractValue):
            return model._like(value)
        if type(value) is not type(model):
            raise RuntimeError(
                f"FixValue(): input port '{self.get_name()}' (index {self._index}) of system "
                f"'{self._system.GetSystemPathname()}' takes a {pretty_class_name(type(model))}, not a "
                f"{pretty_class_name(type(value))}."
            )
        return value.Clone()


def _on_scalar(model: AbstractValue, scalar: type) -> AbstractValue:
    """The model that a system on `scalar` has for a port: poses, say, are those of its scalar; so are lists of them."""
    if scalar is float:
        return model
    value = model.get_value()
    is_list = isinstance(value, list) and len(value) > 0
    template = getattr(type(value[0] if is_list else value), "_template", None)
    if not isinstance(template, ScalarTemplate):
        return model
    one = template[scalar]()
    return AbstractValue.Make([one] if is_list else one)


def _vector_in(value: AbstractValue) -> np.ndarray:
    try:
        return as_vector(value.get_value())
    except TypeError:
        raise RuntimeError(
            f"FixValue(): the given AbstractValue containing type {type(value.get_value()).__name__} is not suitable "
            "for storage as a vector."
        ) from None


def _coerced(value: Scalars, store: Store) -> BasicVector:
    if store.S.dtype == object:
        return BasicVector._view(as_vector(value, object))
    return BasicVector(as_vector(value))


class OutputPort(_Port):
    """Where a system shows a value."""

    __slots__ = ()
    _kind = "OutputPort"

    @property
    def _declaration(self) -> OutputDeclaration:
        return self._system._outputs[self._index]

    def get_index(self) -> OutputPortIndex:
        """Its number."""
        return OutputPortIndex(self._index)

    def _slot(self, context: Context) -> Slot:
        node = self._node_in(context)
        return _settled(context).layout.output_slot(node, self._index)[2]

    def Eval(self, context: Context) -> Any:
        """Its value, computed if needed: the caller's own array, or the object that an abstract port carries."""
        reads = getattr(context, "_reads", None)
        if reads is not None and context._system is self._system:
            read = reads.get(-1 - self._index)
            if read is not None:
                return read()
        slot = self._slot(context)
        if (read := context._store.reader(slot)) is not None:
            context._reads[-1 - self._index] = read
        return value_at(context._store, slot)

    def EvalAbstract(self, context: Context) -> AbstractValue:
        """Its value as an AbstractValue; a vector port's is a `Value[BasicVector]`."""
        slot = self._slot(context)
        return _as_abstract(context._store, slot)

    def EvalBasicVector(self, context: Context) -> BasicVector:
        """A vector port's value as a BasicVector.

        Raises:
            RuntimeError: the port is abstract.
        """
        return self._as_vector(self.Eval(context))

    def Allocate(self) -> AbstractValue:
        """A value of the type it shows."""
        return self._system._allocate_output(self._index)


class LeafOutputPort(OutputPort):
    """Output port of a leaf system."""

    __slots__ = ()

    def cache_entry(self) -> CacheEntry:
        """The cache entry its value is kept in."""
        return self._system.get_cache_entry(self._declaration.cache_index)

    def disable_caching_by_default(self) -> None:
        """Computes its value anew whenever it is asked for, in contexts made from now on."""
        self._system._outputs[self._index] = dataclasses.replace(self._declaration, cached=False)


__all__ = ["SAMPLED", "FixedInputPortValue", "InputPort", "LeafOutputPort", "OutputPort", "abstract_at", "value_at"]
