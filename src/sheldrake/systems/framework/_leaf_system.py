"""LeafSystem: a system that is not made of others. Users derive from it."""

from __future__ import annotations

import dataclasses
import operator
from collections.abc import Callable, Hashable, Iterable
from typing import TYPE_CHECKING, Any, NamedTuple
from typing import overload as typing_overload

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._overloads import Mismatch
from sheldrake.common.kernel import Kernel
from sheldrake.common.value import AbstractValue, Value
from sheldrake.systems.framework._declarations import (
    CacheDeclaration,
    Callback,
    EventDeclaration,
    InputDeclaration,
    OutputDeclaration,
    Stages,
    vector_model,
)
from sheldrake.systems.framework._engine.scratch import arrays_of
from sheldrake.systems.framework._index import (
    AbstractParameterIndex,
    AbstractStateIndex,
    ContinuousStateIndex,
    DiscreteStateIndex,
    NumericParameterIndex,
    PortDataType,
    Ticket,
    UseDefaultName,
)
from sheldrake.systems.framework._leaf_events import LeafEvents
from sheldrake.systems.framework._port import InputPort, LeafOutputPort
from sheldrake.systems.framework._vector import BasicVector

if TYPE_CHECKING:
    from sheldrake.common import RandomGenerator
    from sheldrake.common._random import RandomDistribution
    from sheldrake.common._types import Scalars
    from sheldrake.systems.framework._context.context import Context
    from sheldrake.systems.framework._engine.memory import RootView
    from sheldrake.systems.framework._index import DependencyTicket
    from sheldrake.systems.framework._scalar_conversion import SystemScalarConverter
    from sheldrake.systems.framework._values import ContinuousState

_VECTOR, _ABSTRACT = PortDataType.kVectorValued, PortDataType.kAbstractValued


_NO_STATE = BasicVector([])


class _Declared(NamedTuple):
    """What one system declared and others with the same key share."""

    inputs: list[InputDeclaration]
    outputs: list[OutputDeclaration]
    cache_entries: list[CacheDeclaration]
    tickets: dict[int, tuple]
    output_models: dict[int, dict]
    result: Any


_DECLARED: dict[tuple, _Declared] = {}
_MOST_DECLARED = 256  # a program that makes other plants for ever must not fill memory


class LeafSystem(LeafEvents):
    """Base of systems with their own behaviour.

    In `__init__`, after `super().__init__()`, a derived class declares ports, state, parameters and events. Wherever a
    callback is taken, a compiled kernel may be given instead: its parameters' names tell what it sees (`t, xc, xd, p,
    u, work, model`), and the last is what it fills. An array may be a `Record` of `common.record`, or a `table` of one
    array, which names what is in it. A system of nothing but kernels converts to other scalars.

    Args:
        converter: A SystemScalarConverter, if the system can be converted to other scalars.
    """

    _complex_rows = False
    """Whether its kernels may be compiled on complex numbers (see `_engine/complex_rows.py`): none asks for an absolute
    value, a minimum, a maximum or an integer of what has derivatives."""

    _ports_are_lookups = False
    """Whether its functions of ports only show what it keeps anyway: calling one is quicker than finding out whether
    what it names has changed."""

    def __init__(self, converter: SystemScalarConverter | None = None):
        super().__init__()
        self._scalar_converter = converter
        self._xc_model, self._xc_counts = _NO_STATE, (0, 0, 0)
        self._xd_models: list[BasicVector] = []
        self._xa_models: list[AbstractValue] = []
        self._pn_models: list[BasicVector] = []
        self._pa_models: list[AbstractValue] = []
        self._events: list[EventDeclaration] = []
        self._witness_kernels = []
        self._declared_derivatives: Callback | Kernel | Stages | None = None
        self._scratch_prototype: Any = 0
        self._output_models: dict[int, dict] = {}
        """Constant arrays for the kernel of one output port, over those of `_kernel_models`."""
        self._float_kernels: dict[int, tuple[Kernel, Callback]] = {}
        """Of output ports that a kernel computes on doubles alone: it, and the callback for other scalars."""

    # Input ports.

    def DeclareVectorInputPort(
        self,
        name: str | UseDefaultName,
        model_vector: Any = None,
        random_type: RandomDistribution | None = None,
        *,
        size: int | None = None,
    ) -> InputPort:
        """Declares an input port for a vector of the size of `model_vector` (a BasicVector or an int)."""
        model = vector_model(model_vector if size is None else size, "DeclareVectorInputPort()")
        return self._declare_input(name, _VECTOR, model.size(), model, random_type)

    def DeclareAbstractInputPort(self, name: str | UseDefaultName, model_value: AbstractValue) -> InputPort:
        """Declares an input port for values of the type of `model_value`."""
        _need_abstract(model_value, "DeclareAbstractInputPort()")
        return self._declare_input(name, _ABSTRACT, 0, model_value.Clone())

    # Output ports.

    def DeclareVectorOutputPort(
        self,
        name: str | UseDefaultName,
        model_value: Any = None,
        calc: Callable[..., Any] | Kernel | Stages | None = None,
        prerequisites_of_calc: Iterable[DependencyTicket | int] | None = None,
        *,
        size: int | None = None,
    ) -> LeafOutputPort:
        """Declares an output port for a vector of the size of `model_value` (a BasicVector or an int).

        Args:
            name: Its name, or `kUseDefaultName`.
            model_value: A BasicVector, or the size.
            calc: `calc(context, basic_vector)`, or a kernel.
            prerequisites_of_calc: Tickets of what it depends on; everything if not given.
            size: The size, instead of `model_value`.
        """
        given = model_value if size is None else size
        model = BasicVector(int(given)) if isinstance(given, (int, np.integer)) else vector_model(given, "model_value")
        return self._declare_output(name, _VECTOR, model.size(), model, calc, prerequisites_of_calc)

    def DeclareAbstractOutputPort(
        self,
        name: str | UseDefaultName,
        alloc: Callable,
        calc: Callable[..., Any],
        prerequisites_of_calc: Iterable[DependencyTicket | int] | None = None,
    ) -> LeafOutputPort:
        """Declares an output port for an abstract value.

        Args:
            name: Its name, or `kUseDefaultName`.
            alloc: Gives an AbstractValue to compute into.
            calc: `calc(context, abstract_value)`.
            prerequisites_of_calc: Tickets of what it depends on; everything if not given.
        """
        model = Callback.of(self, alloc, "DeclareAbstractOutputPort()")
        return self._declare_output(name, _ABSTRACT, 0, model, calc, prerequisites_of_calc)

    def _declare_output(
        self,
        name: str | UseDefaultName,
        data_type: PortDataType,
        size: int,
        model: Any,
        calc: Any,
        prerequisites: Iterable[DependencyTicket | int] | None,
        state: tuple[str, int] | None = None,
    ) -> LeafOutputPort:
        j = len(self._outputs)
        name = f"y{j}" if isinstance(name, UseDefaultName) else name
        self._check_name(name, self._outputs, "output")
        if state is None:
            calc = Callback.of(self, calc, f"output port '{name}'")
        tickets = frozenset({Ticket.ALL_SOURCES} if prerequisites is None else {int(t) for t in prerequisites})
        if not tickets:
            raise RuntimeError(
                f"Declare...OutputPort('{name}'): prerequisites may not be empty; for an output that depends on "
                "nothing, give {System.nothing_ticket()}."
            )
        index = len(self._cache_entries)
        self._cache_entries.append(
            CacheDeclaration(f"output port {j}({name})", None, None, tickets, self._new_ticket("cache", index), j)
        )
        self._outputs.append(OutputDeclaration(name, data_type, size, model, calc, tickets, state, index))
        self._changed()
        return self._output_port(j)  # type: ignore[return-value]

    def DeclareStateOutputPort(
        self, name: str | UseDefaultName, state_index: ContinuousStateIndex | DiscreteStateIndex | AbstractStateIndex
    ) -> LeafOutputPort:
        """Declares an output port that shows a state; `state_index` is what a Declare...State() call gave."""
        if isinstance(state_index, ContinuousStateIndex):
            model: Any = self._xc_model.Clone()
            return self._declare_output(name, _VECTOR, model.size(), model, None, {Ticket.XC}, ("xc", 0))
        k = operator.index(state_index)
        if isinstance(state_index, DiscreteStateIndex):
            model = self._xd_models[k].Clone()
            return self._declare_output(name, _VECTOR, model.size(), model, None, {Ticket.XD}, ("xd", k))
        if isinstance(state_index, AbstractStateIndex):
            value = self._xa_models[k]
            return self._declare_output(name, _ABSTRACT, 0, Callback(value.Clone), None, {Ticket.XA}, ("xa", k))
        raise Mismatch(
            f"DeclareStateOutputPort(): incompatible function arguments: {state_index!r} is no index of a state"
        )

    def _allocate_output(self, j: int) -> AbstractValue:
        output = self._outputs[j]
        if output.data_type is _VECTOR:
            model = output.model
            return Value[BasicVector]._holding(
                model.Clone() if self._scalar is float else model._on_scalar(self._scalar)
            )
        value = output.model(self)
        if not isinstance(value, AbstractValue):
            raise RuntimeError(
                f"The alloc function of output port '{output.name}' of {self._describe()} must give an AbstractValue, "
                f"not {value!r}."
            )
        return value

    def _declare_alike(self, key: tuple[Hashable, ...], declare: Callable[[], Any]) -> Any:
        """Declares ports as another system did that had the same key, or else by a call.

        Args:
            key: All that ports and what computes them depend on.
            declare: Declares ports and tickets, nothing else, with functions that are bound to this system or to none;
                what it gives, others are given too.
        """
        first = len(self._inputs), len(self._outputs), len(self._cache_entries), self._next_ticket
        key = *key, *first, *self._tickets.values()
        known = _DECLARED.get(key)
        if known is None:
            result = declare()
            ports = self._inputs[first[0] :], self._outputs[first[1] :], self._cache_entries[first[2] :]
            tickets = {ticket: what for ticket, what in self._tickets.items() if ticket >= first[3]}
            models = {j: model for j, model in self._output_models.items() if j >= first[1]}
            if len(_DECLARED) >= _MOST_DECLARED:
                _DECLARED.clear()
            _DECLARED[key] = _Declared(*ports, tickets, models, result)
            return result
        self._inputs += known.inputs
        self._outputs += known.outputs
        self._cache_entries += known.cache_entries
        self._tickets.update(known.tickets)
        self._next_ticket += len(known.tickets)
        self._output_models.update(known.output_models)
        self._changed()
        return known.result

    # State and parameters.

    @typing_overload
    @checked
    def DeclareContinuousState(self, num_state_variables: int) -> ContinuousStateIndex: ...
    @typing_overload
    @checked
    def DeclareContinuousState(self, num_q: int, num_v: int, num_z: int) -> ContinuousStateIndex: ...
    @typing_overload
    @checked
    def DeclareContinuousState(self, model_vector: BasicVector | Scalars) -> ContinuousStateIndex: ...
    @typing_overload
    @checked
    def DeclareContinuousState(
        self, model_vector: BasicVector | Scalars, num_q: int, num_v: int, num_z: int
    ) -> ContinuousStateIndex: ...
    def DeclareContinuousState(self, *args: Any, **kwargs: Any) -> ContinuousStateIndex:
        """Declares the continuous state: `(num_state_variables)`, `(num_q, num_v, num_z)`, `(model_vector)` or
        `(model_vector, num_q, num_v, num_z)`. A later call replaces it.
        """
        if "model_vector" in kwargs:
            args = (kwargs.pop("model_vector"), *args)
        elif "num_state_variables" in kwargs:
            args = (kwargs.pop("num_state_variables"),)
        args += tuple(kwargs.pop(name) for name in ("num_q", "num_v", "num_z") if name in kwargs)
        if kwargs or len(args) not in (1, 3, 4):
            raise Mismatch("DeclareContinuousState(): incompatible function arguments")
        if len(args) == 3:
            counts = tuple(int(n) for n in args)
            model = BasicVector(np.zeros(sum(counts)))
        else:
            model = vector_model(args[0], "DeclareContinuousState()")
            counts = tuple(int(n) for n in args[1:]) or (0, 0, model.size())
        if min(counts) < 0 or counts[1] > counts[0] or sum(counts) != model.size():
            raise RuntimeError(
                f"DeclareContinuousState(): num_q={counts[0]}, num_v={counts[1]}, num_z={counts[2]} do not fit a state "
                f"of size {model.size()} (num_v may not exceed num_q)."
            )
        self._xc_model, self._xc_counts = model, counts  # type: ignore[assignment]
        self._changed()
        return ContinuousStateIndex(0)

    def DeclareDiscreteState(
        self, model_vector: BasicVector | int | Scalars | None = None, **kwargs: Any
    ) -> DiscreteStateIndex:
        """Declares a group of discrete state: a BasicVector, an array, or a size (then zeros)."""
        for name in ("vector", "num_state_variables"):
            model_vector = kwargs.pop(name, model_vector)
        if kwargs or model_vector is None:
            raise Mismatch("DeclareDiscreteState(): incompatible function arguments")
        self._xd_models.append(vector_model(model_vector, "DeclareDiscreteState()"))
        self._changed()
        return DiscreteStateIndex(len(self._xd_models) - 1)

    def DeclareAbstractState(self, model_value: AbstractValue) -> AbstractStateIndex:
        """Declares an abstract state of the type of `model_value`, which is its default."""
        _need_abstract(model_value, "DeclareAbstractState()")
        self._xa_models.append(model_value.Clone())
        self._changed()
        return AbstractStateIndex(len(self._xa_models) - 1)

    def DeclareNumericParameter(self, model_vector: BasicVector | Scalars) -> int:
        """Declares a group of numeric parameters; `model_vector` is its default."""
        self._pn_models.append(vector_model(model_vector, "DeclareNumericParameter()"))
        self._changed()
        return int(NumericParameterIndex(len(self._pn_models) - 1))

    def _declare_numeric_parameters(self, defaults: Iterable[np.ndarray]) -> None:
        """Declares many groups of numeric parameters, whose defaults are copied."""
        self._pn_models += [BasicVector._view(values.copy()) for values in defaults]
        self._changed()

    def DeclareAbstractParameter(self, model_value: AbstractValue) -> int:
        """Declares an abstract parameter; `model_value` is its default."""
        _need_abstract(model_value, "DeclareAbstractParameter()")
        self._pa_models.append(model_value.Clone())
        self._changed()
        return int(AbstractParameterIndex(len(self._pa_models) - 1))

    # Derivatives.

    def DoCalcTimeDerivatives(self, context: Context, derivatives: ContinuousState) -> None:
        """Computes the derivatives of the continuous state; to be overridden by a system that has some."""
        raise NotImplementedError(
            f"{self._describe()} has continuous state, so it must override DoCalcTimeDerivatives(context, derivatives)."
        )

    def DeclareTimeDerivatives(self, calc: Callable[..., Any] | Kernel | Stages) -> None:
        """Declares what computes the derivatives of the continuous state, instead of `DoCalcTimeDerivatives`.

        Args:
            calc: A kernel, or `calc(context, derivatives)`.
        """
        self._declared_derivatives = Callback.of(self, calc, "DeclareTimeDerivatives()")
        self._changed()

    def _derivatives_calc(self) -> Callback | Kernel | Stages:
        if self._declared_derivatives is not None:
            return self._declared_derivatives
        return Callback(type(self).DoCalcTimeDerivatives, True)

    # For compiled systems.

    def _is_generic(self) -> bool:
        return self._generic or self._is_of_kernels()

    def _is_of_kernels(self) -> bool:
        """Whether nothing but kernels computes anything, and they something: their source takes every scalar."""
        calcs = [output.calc for output in self._outputs if output.state is None]
        calcs += [event.handler for event in self._all_events()]
        calcs += [self._derivatives_calc()] if self._xc_model.size() else []
        only = all(isinstance(c, Kernel) for c in calcs) and not self._float_kernels
        return bool(calcs) and only and not self._has_witnesses()

    def _compute_natively(self, j: int, kernel: Kernel | None) -> None:
        """On doubles a kernel computes output port `j` from now on, on other scalars the declared callback; or not."""
        _, callback = self._float_kernels.get(j, (None, self._outputs[j].calc))
        self._float_kernels.pop(j, None)
        if kernel is not None:
            self._float_kernels[j] = kernel, callback
        calc = callback if kernel is None or self._scalar is not float else kernel
        self._outputs[j] = dataclasses.replace(self._outputs[j], calc=calc)
        self._changed()

    def _converted(self, scalar: Any) -> Any:
        new = super()._converted(scalar)
        if new is not None:
            for j, (kernel, _) in list(new._float_kernels.items()):
                new._compute_natively(j, kernel)
        return new

    def _declare_scratch(self, prototype: int | NamedTuple) -> None:
        """Memory in the context for kernels: a size, or a NamedTuple of arrays to copy, or of NamedTuples of arrays.

        Kernels see it as `work`; the fields of a NamedTuple are also parameters of their own.
        """
        self._scratch_prototype = prototype
        self._changed()

    def _scratch(self, context: Context) -> Any:
        """Read-only views of this system's scratch: what its last kernels left there."""
        self.ValidateContext(context)
        views = context._store.scratch(context._node)
        for view in [views] if isinstance(views, np.ndarray) else arrays_of(views):
            view.flags.writeable = False
        return views

    def _scratch_ticket(self) -> int:
        """Names the scratch as a prerequisite."""
        for ticket, what in self._tickets.items():
            if what == ("work", 0):
                return ticket
        return self._new_ticket("work", 0)

    def _scratch_in(self, root: RootView) -> int | NamedTuple:
        """Prototype of the scratch in contexts of a root, as in `_kernel_models`."""
        return self._scratch_prototype

    def _carry_scratch(self, old: np.ndarray | NamedTuple, new: np.ndarray | NamedTuple) -> None:
        """Fills scratch of another prototype with what is still true, when the memory of a context moves."""

    _integers_kept: frozenset[str] = frozenset()
    """Integers of the scratch, FIELD.PART, that still mean something when a step is over; others are not loaded."""

    def _scratch_fault(self, scratch: np.ndarray | NamedTuple) -> str:
        """What is wrong with scratch that a file brings, or "": it may hold anything where `_integers_kept` says."""
        return ""

    _structured = False
    """Whether `_structure_in` may say something."""

    def _structure_in(self, context: Context) -> object:
        """What kernels must be made anew for where a context has it otherwise than new ones; None: nothing.

        It is compared, and whatever feeds from this system finds it in `RootView.structure_behind`. After a change of
        it the system calls `Store.restructure`.
        """
        return None

    def _kernel_models(self, root: RootView) -> dict[str, Any]:
        """Constant arrays for kernels, by parameter name; asked once per root.

        Args:
            root: `root.source(i)` tells what feeds input port `i`.
        """
        return {}

    def _explain_status(self, status: int, context: Context) -> Exception:
        """The error that a kernel's status stands for."""
        return RuntimeError(f"{self._describe()}: a computation failed with status {status}.")

    def _set_default_context(self, context: Context) -> None:
        """Sets defaults that are not declared; called after the declared ones are in place."""

    def _sets_own_defaults(self) -> bool:
        return type(self)._set_default_context is not LeafSystem._set_default_context

    def _set_random_context(self, context: Context, generator: RandomGenerator) -> None:
        """Sets random state and parameters."""


def _need_abstract(value: object, call: str) -> None:
    if not isinstance(value, AbstractValue):
        raise Mismatch(f"{call}: incompatible function arguments: expected an AbstractValue, got {value!r}")
