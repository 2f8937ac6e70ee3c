"""Contexts: one system's view of a root context's store.

A context owns nothing but its place in the tree: values live in the root's `Store`. Every write goes through a method
here that counts the change, so that rows (outputs, derivatives) that depend on it are computed anew when they are
asked for.
"""

from __future__ import annotations

import operator
from functools import partial
from typing import TYPE_CHECKING, Any, SupportsIndex, overload

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._copies import Cloned
from sheldrake.common._overloads import Mismatch, expect
from sheldrake.common.value import AbstractValue
from sheldrake.systems.framework._context import text
from sheldrake.systems.framework._context.base import ContextBase
from sheldrake.systems.framework._engine.store import CONSTANT, CONTINUOUS, SAMPLED, Store
from sheldrake.systems.framework._state import Parameters, State
from sheldrake.systems.framework._values import AbstractValues, ContinuousState, DiscreteValues, _index
from sheldrake.systems.framework._vector import BasicVector, converted

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike
    from typing_extensions import Self

    from sheldrake.common._types import Scalars


class Context(ContextBase, Cloned):
    """Time, state, parameters and input of one system."""

    # Time and accuracy.

    def get_time(self) -> float:
        """Time [s]."""
        t = self._store.S[0]
        if type(t) is np.float64:
            return float(t)
        return t if isinstance(t, self._store.scalar) else self._store.scalar(t)

    def SetTime(self, time_sec: Any) -> None:
        """Sets the time [s] of the whole tree.

        Raises:
            RuntimeError: this is not a root context.
        """
        if self._node:
            self._must_be_root("SetTime")
        store = self._store
        time = time_sec if type(time_sec) is store.scalar else _scalar(store, time_sec, "SetTime")
        store.touch(CONTINUOUS, "t")  # first: it refuses other threads
        store.S[0] = time

    def _must_be_root(self, call: str) -> None:
        if self._node != 0:
            raise RuntimeError(
                f"{call}(): Time change allowed only in the root Context; this one belongs to "
                f"{self._system._describe()}."
                if "Time" in call
                else f"Context::{call}(): Cannot act on a non-root Context; this Context was created by "
                f"'{self._system.GetSystemPathname()}'."
            )

    def get_accuracy(self) -> float | None:
        """The accuracy asked for, if any."""
        return self._store.accuracy

    def SetAccuracy(self, accuracy: float | None) -> None:
        """Asks for an accuracy; what it means is up to the systems."""
        self._must_be_root("SetAccuracy")
        self._store.accuracy = None if accuracy is None else float(accuracy)
        self._store.touch(CONSTANT, "accuracy")

    # How much there is.

    def num_continuous_states(self) -> int:
        """Number of continuous variables."""
        a, b = self._place.xc
        return b - a

    def num_discrete_state_groups(self) -> int:
        """Number of groups of discrete variables."""
        a, b = self._place.groups
        return b - a

    def num_abstract_states(self) -> int:
        """Number of abstract states."""
        a, b = self._place.abstract
        return b - a

    def num_numeric_parameter_groups(self) -> int:
        """Number of groups of numeric parameters."""
        a, b = self._place.parameters
        return b - a

    def num_abstract_parameters(self) -> int:
        """Number of abstract parameters."""
        a, b = self._place.abstract_parameters
        return b - a

    def __repr__(self) -> str:
        discrete = sum(group.size() for group in map(self.get_discrete_state, range(self.num_discrete_state_groups())))
        kinds = ("continuous", self.num_continuous_states()), ("discrete", discrete)
        states = [f"{n} {kind}" for kind, n in (*kinds, ("abstract", self.num_abstract_states())) if n]
        has = f", {' and '.join(states)} states" if states else ", no state"
        path = self.GetSystemPathname()
        whose = "" if path == "::_" else f" of '{path}'"
        return f"<{type(self).__name__}{whose} at t = {self.get_time()} s{has}>"

    def num_total_states(self) -> int:
        """Number of continuous and discrete variables.

        Raises:
            RuntimeError: there is abstract state, which cannot be counted.
        """
        if self.num_abstract_states():
            raise RuntimeError("Context.num_total_states(): there are abstract states, which have no number.")
        a, b = self._place.xd
        return self.num_continuous_states() + b - a

    def is_stateless(self) -> bool:
        """Whether there is no state at all."""
        return not (self.num_continuous_states() or self.num_discrete_state_groups() or self.num_abstract_states())

    def has_only_continuous_state(self) -> bool:
        """Whether there is continuous state and no other."""
        return bool(self.num_continuous_states()) and not (
            self.num_discrete_state_groups() or self.num_abstract_states()
        )

    def has_only_discrete_state(self) -> bool:
        """Whether there is discrete state and no other."""
        return bool(self.num_discrete_state_groups()) and not (
            self.num_continuous_states() or self.num_abstract_states()
        )

    # Views. `shift` moves from the state to x+ or to the derivatives.

    def _vector(self, a: int, b: int, on_write: Callable[[], None] | None, models: str, k: int = 0) -> BasicVector:
        """The numbers from a to b as a vector of the class that this leaf system declared."""
        memory = self._store.S[a:b]
        model = getattr(self._system, models, None)  # a diagram has none
        model = model[k] if isinstance(model, list) else model
        if model is None or type(model) is BasicVector:
            return BasicVector._view(memory, on_write)
        if memory.dtype == object:
            return model._on_objects(memory, on_write, self._system._scalar)
        return model._on_memory(memory, on_write)

    def _continuous_view(self, at: int | None = None, on_write: Callable[[], None] | None = None) -> ContinuousState:
        a, b = self._place.xc
        start = a if at is None else at
        vector = self._vector(start, start + b - a, on_write, "_xc_model")
        return ContinuousState._view(vector, self._store.layout.parts(self._node))

    def _discrete_view(self, shift: int = 0, touch: bool = False) -> DiscreteValues:
        store = self._store
        first, last = self._place.groups
        groups = []
        for k, (a, b) in enumerate(store.layout.groups[first:last]):
            on_write = partial(store.touch, SAMPLED, ("xd", first + k)) if touch else None
            groups.append(self._vector(a + shift, b + shift, on_write, "_xd_models", k))
        return DiscreteValues._view(groups)

    def _state_view(self, shift: int, abstract: list[AbstractValue]) -> State:
        return State._view(
            self._continuous_view(self._place.xc[0] + shift),
            self._discrete_view(shift),
            AbstractValues._view(abstract, None),
        )

    def _touch(self, level: int, *source: object) -> None:
        self._store.touch(level, source)

    # Continuous state.

    def get_continuous_state(self) -> ContinuousState:
        """The continuous state; the same object until its memory moves."""
        if self._continuous is None:
            self._continuous = self._continuous_view(None, partial(self._store.touch, CONTINUOUS, ("xc", self._node)))
        return self._continuous

    def get_mutable_continuous_state(self) -> ContinuousState:
        """The continuous state, to be changed."""
        state = self.get_continuous_state()
        state._vector._wrote()
        return state

    def get_continuous_state_vector(self) -> BasicVector:
        """The continuous state as one vector."""
        return (self._continuous or self.get_continuous_state())._vector  # type: ignore[return-value]

    def get_mutable_continuous_state_vector(self) -> BasicVector:
        """The continuous state as one vector, to be changed."""
        vector = self.get_continuous_state_vector()
        vector._wrote()
        return vector

    def SetContinuousState(self, xc: Scalars) -> None:
        """Sets the continuous state."""
        (self._continuous or self.get_continuous_state())._vector.SetFromVector(xc)

    @checked
    def SetTimeAndContinuousState(self, time_sec: float, xc: Any) -> None:
        """Sets time [s] and the continuous state."""
        self.SetTime(time_sec)
        self.SetContinuousState(xc)

    # Discrete state.

    def _discrete_values(self) -> DiscreteValues:
        """The discrete state, made once."""
        if self._discrete is None:
            self._discrete = self._discrete_view(0, True)
        return self._discrete

    @overload
    def get_discrete_state(self, index: None = None) -> DiscreteValues: ...
    @overload
    def get_discrete_state(self, index: int) -> BasicVector: ...
    def get_discrete_state(self, index: int | None = None) -> DiscreteValues | BasicVector:
        """The discrete state, the same object until its memory moves; or its group `index`."""
        values = self._discrete or self._discrete_values()
        return values if index is None else values.get_vector(index)

    @overload
    def get_mutable_discrete_state(self, index: None = None) -> DiscreteValues: ...
    @overload
    def get_mutable_discrete_state(self, index: int) -> BasicVector: ...
    def get_mutable_discrete_state(self, index: int | None = None) -> DiscreteValues | BasicVector:
        """The discrete state, or its group `index`, to be changed."""
        values = self._discrete or self._discrete_values()
        if index is not None:
            return values.get_mutable_vector(index)
        for group in values._groups:
            group._wrote()
        return values

    def get_discrete_state_vector(self) -> BasicVector:
        """The only group of discrete state.

        Raises:
            RuntimeError: there are more, or none.
        """
        groups = (self._discrete or self._discrete_values())._groups
        if len(groups) != 1:
            raise RuntimeError(
                f"Context.get_discrete_state_vector(): {self._system._describe()} has {len(groups)} groups of "
                "discrete state, not one; use get_discrete_state(index)."
            )
        return groups[0]

    def get_mutable_discrete_state_vector(self) -> BasicVector:
        """The only group of discrete state, to be changed."""
        vector = self.get_discrete_state_vector()
        vector._wrote()
        return vector

    def SetDiscreteState(self, *args: ArrayLike, **kwargs: Any) -> None:
        """Sets discrete state: `(xd)` the only group or all from DiscreteValues, `(group_index, xd)` one group."""
        if kwargs:
            args = (*([kwargs.pop("group_index")] if "group_index" in kwargs else []), *args)
            args = (*args, *([kwargs.pop("xd")] if "xd" in kwargs else []))
        if kwargs or not 1 <= len(args) <= 2 or args[-1] is None:
            raise Mismatch("SetDiscreteState(): incompatible function arguments: give (xd) or (group_index, xd).")
        if len(args) == 2:
            self.get_discrete_state(args[0]).SetFromVector(args[1])  # type: ignore[call-overload]
        elif isinstance(args[0], DiscreteValues):
            self.get_discrete_state().SetFrom(args[0])
        else:
            self.get_discrete_state_vector().SetFromVector(args[0])

    # Abstract state.

    @overload
    def get_abstract_state(self, index: None = None) -> AbstractValues: ...
    @overload
    def get_abstract_state(self, index: int) -> AbstractValue: ...
    def get_abstract_state(self, index: int | None = None) -> AbstractValues | AbstractValue:
        """The abstract states, or number `index`."""
        (first, last), values = self._place.abstract, self._store.abstract
        if index is not None:
            return values[first + _index("Context.get_abstract_state()", index, last - first)]
        return AbstractValues._view(values[first:last], partial(self._store.touch, SAMPLED, ("xa", self._node)))

    @overload
    def get_mutable_abstract_state(self, index: None = None) -> AbstractValues: ...
    @overload
    def get_mutable_abstract_state(self, index: int) -> AbstractValue: ...
    def get_mutable_abstract_state(self, index: int | None = None) -> AbstractValues | AbstractValue:
        """The abstract states, or number `index`, to be changed."""
        self._touch(SAMPLED, "xa", self._node)
        return self.get_abstract_state() if index is None else self.get_abstract_state(index)

    @checked
    def SetAbstractState(self, index: int, value: object) -> None:
        """Sets abstract state `index`."""
        self.get_mutable_abstract_state(index).set_value(value)

    # All of the state.

    def get_state(self) -> State:
        """The state; the same object until its memory moves."""
        abstract, state = self.get_abstract_state(), self._state
        if state is None or not _same_objects(state._abstract._data, abstract._data):
            state = self._state = State._view(self.get_continuous_state(), self.get_discrete_state(), abstract)
        return state

    def get_mutable_state(self) -> State:
        """The state, to be changed."""
        self._touch(SAMPLED, "x", self._node)
        return self.get_state()

    # Parameters.

    def get_parameters(self) -> Parameters:
        """The parameters; the same object until its memory moves."""
        store, known = self._store, self._parameters
        first, last = self._place.abstract_parameters
        abstract = store.parameters[first:last]
        if known is None or not _same_objects(known._abstract._data, abstract):
            touch = partial(store.touch, CONSTANT, ("pa", self._node))
            first, last = self._place.parameters
            numeric = DiscreteValues._view([self._numeric_parameter(k) for k in range(last - first)])
            known = self._parameters = Parameters._view(numeric, AbstractValues._view(abstract, touch))
        return known

    def _numeric_parameter(self, k: int) -> BasicVector:
        known = self._numeric
        if known is None:
            known = self._numeric = {}
        found = known.get(k)
        if found is None:
            group = self._place.parameters[0] + k
            a, b = self._store.layout.parameter_groups[group]
            touch = partial(self._store.touch, CONSTANT, ("pn", group))
            found = known[k] = self._vector(a, b, touch, "_pn_models", k)
        return found

    def get_mutable_parameters(self) -> Parameters:
        """The parameters, to be changed."""
        self._touch(CONSTANT, "p", self._node)
        return self.get_parameters()

    def get_numeric_parameter(self, index: int) -> BasicVector:
        """Group `index` of the numeric parameters."""
        first, last = self._place.parameters
        if type(index) is int and 0 <= index < last - first:  # without making all the others
            return self._numeric_parameter(index)
        return self.get_parameters().get_numeric_parameter(index)

    def get_mutable_numeric_parameter(self, index: int) -> BasicVector:
        """Group `index` of the numeric parameters, to be changed."""
        first, last = self._place.parameters
        if type(index) is int and 0 <= index < last - first:
            self._touch(CONSTANT, "pn", first + index)
            return self._numeric_parameter(index)
        return self.get_parameters().get_mutable_numeric_parameter(index)

    def get_abstract_parameter(self, index: int) -> AbstractValue:
        """Abstract parameter `index`."""
        return self.get_parameters().get_abstract_parameter(index)

    def get_mutable_abstract_parameter(self, index: int) -> AbstractValue:
        """Abstract parameter `index`, to be changed."""
        return self.get_parameters().get_mutable_abstract_parameter(index)

    # Copies.

    def Clone(self) -> Self:
        """An independent copy of the whole tree.

        Raises:
            RuntimeError: this is not a root context.
        """
        self._must_be_root("Clone")
        return self._store.clone().context(0)  # type: ignore[return-value]  # of the same class

    def __reduce_ex__(self, protocol: SupportsIndex) -> str | tuple:
        raise TypeError(f"cannot pickle {type(self).__name__!r} object: SaveContext() writes its content")

    def SetStateAndParametersFrom(self, source: Context) -> None:
        """Copies state and parameters, and no accuracy, of a context of the same system, or of one built alike."""
        mine, its = self._place, expect("SetStateAndParametersFrom", source, Context)._place
        if mine is not its and any(
            getattr(mine, x)[1] - getattr(mine, x)[0] != getattr(its, x)[1] - getattr(its, x)[0]
            for x in ("xc", "xd", "p", "groups", "parameters", "abstract", "abstract_parameters")
        ):
            raise RuntimeError(
                f"Context.SetStateAndParametersFrom(): a context of {source._system._describe()} does not fit one of "
                f"{self._system._describe()}."
            )
        store, other = self._store, source._store
        store.check_thread()
        S, scalar = store.S, store.scalar
        for (a, b), (first, last) in ((mine.xc, its.xc), (mine.xd, its.xd), (mine.p, its.p)):
            if b > a:
                S[a:b] = converted(other.S[first:last], scalar)
        self._take_abstract_from(source)

    def _take_abstract_from(self, source: Context) -> None:
        """Copies what has no place in the slab, where all else is copied."""
        mine, its, store, other = self._place, source._place, self._store, source._store
        if store.abstract or store.parameters:
            for (a, b), (first, _), values, others in (
                (mine.abstract, its.abstract, store.abstract, other.abstract),
                (mine.abstract_parameters, its.abstract_parameters, store.parameters, other.parameters),
            ):
                for k in range(b - a):
                    values[a + k].SetFrom(others[first + k])
        store.touch(CONSTANT, "all")
        if store.layout.structured:
            store.restructure()

    def SetTimeStateAndParametersFrom(self, source: Context) -> None:
        """Copies time, accuracy, state and parameters of a context of the same system, or of one built alike."""
        its, store = expect("SetTimeStateAndParametersFrom", source, Context)._store, self._store
        if self._node:
            self._must_be_root("SetTimeStateAndParametersFrom")
        store.check_thread()
        store.accuracy = its.accuracy
        if its.layout is store.layout and its.scalar is store.scalar is float and not source._node:
            end = store.layout.p[1]
            store.S[:end] = its.S[:end]
            self._take_abstract_from(source)
            return
        store.S[:1] = converted(its.S[:1], store.scalar)
        self.SetStateAndParametersFrom(source)

    def __str__(self) -> str:
        return text.of_one(self)


class LeafContext(Context):
    """Context of a leaf system."""


class DiagramContext(Context):
    """Context of a diagram; those of its subsystems are views of the same store."""

    def __str__(self) -> str:
        return text.of_tree(self)


def _same_objects(some: list, others: list) -> bool:
    return len(some) == len(others) and all(map(operator.is_, some, others))


def _scalar(store: Store, value: Any, call: str) -> Any:
    if store.S.dtype == object:
        return value if isinstance(value, store.scalar) else store.scalar(value)
    try:
        return float(value)
    except (TypeError, ValueError):
        raise Mismatch(f"{call}(): incompatible function arguments: expected a number, got {value!r}") from None
