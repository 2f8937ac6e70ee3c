"""What every system has: a name, ports, tickets and cache entries."""

from __future__ import annotations

import itertools
import operator
import weakref
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any, SupportsIndex

from sheldrake.common._checked import checked
from sheldrake.common._overloads import Mismatch, expect
from sheldrake.common._taken import STUMBLES, refusal
from sheldrake.systems.framework._cache import CacheEntry, ValueProducer
from sheldrake.systems.framework._declarations import CacheDeclaration, Callback, InputDeclaration, OutputDeclaration
from sheldrake.systems.framework._graphviz import Graphviz
from sheldrake.systems.framework._index import CacheIndex, DependencyTicket, Ticket
from sheldrake.systems.framework._port import InputPort, LeafOutputPort, OutputPort

if TYPE_CHECKING:
    from sheldrake.common.value import AbstractValue
    from sheldrake.systems.framework._context.context import Context

_ids = itertools.count(1)


def _static(ticket: int, what: str) -> staticmethod[[], DependencyTicket]:
    def name() -> DependencyTicket:
        return DependencyTicket(ticket)

    name.__doc__ = f"Dependency on {what}."
    return staticmethod(name)


class SystemType(type):
    """Makes systems and sees that `__init__` was called, as pydrake's classes do.

    It is here and not in a `__getattr__` of systems, for with one of those every look at an attribute takes longer.
    """

    if not TYPE_CHECKING:  # for checkers a call of the class is that of its own `__init__`

        def __call__(cls, *args: Any, **kwargs: Any) -> Any:
            """A new system.

            Raises:
                TypeError: an overriding `__init__` did not call that of its base class, or not before it was needed.
            """
            try:
                new = super().__call__(*args, **kwargs)
            except STUMBLES as error:
                if is_blank(getattr(error, "obj", None)):
                    raise cls._not_called() from error
                if (refused := refusal(cls.__init__, (cls, *args), kwargs, error)) is not None:
                    raise refused from error
                raise
            if is_blank(new):
                raise cls._not_called()
            return new

    def _not_called(cls) -> TypeError:
        return TypeError(
            f"{cls.__name__}.__init__() must be called when overriding __init__: call super().__init__() before "
            "anything else."
        )


def is_blank(system: object) -> bool:
    """Whether this is a system whose `__init__` has not run."""
    return isinstance(system, SystemBase) and "_system_id" not in system.__dict__


class SystemBase(Graphviz, metaclass=SystemType):
    """Name, ports, dependency tickets, cache entries and picture of a system."""

    _inputs: list[InputDeclaration]
    _outputs: list[OutputDeclaration]
    _scalar: type
    get_input_port: Callable[..., Any]

    def __init__(self) -> None:
        self._system_id = next(_ids)
        self._name = ""
        self._parent_ref: Any = None
        self._inputs, self._outputs = [], []
        self._port_names: dict[str, dict[str, None]] = {"input": {}, "output": {}}
        self._cache_entries: list[CacheDeclaration] = []
        self._entries_in_use: weakref.WeakValueDictionary[int, CacheEntry] = weakref.WeakValueDictionary()
        self._tickets: dict[int, tuple] = {}
        self._state_tickets: dict[tuple, int] = {}
        self._next_ticket = Ticket.FIRST_INDEXED
        self._ports: dict[tuple[str, int], weakref.ref[Any]] = {}  # those that somebody holds, and some that died
        self._version = self._defaults_version = 0
        self._layouts: dict = {}
        self._state_of: tuple | None = None  # see `System._structure`
        self._tree_below: list[Any] | None = None  # all systems below this one, once asked for

    def _subsystems(self) -> list[Any] | None:
        return None

    def _changed(self) -> None:
        """The structure changed: contexts made before do not fit any more."""
        self._version += 1
        self._tree_below = None

    def _defaults_changed(self) -> None:
        """Contexts made from now on begin with other values."""
        self._defaults_version += 1

    # Names.

    @checked
    def set_name(self, name: str) -> None:
        """Sets the name; unique among siblings by the time the diagram is built."""
        self._name = expect("set_name", name, str)

    def get_name(self) -> str:
        """Name among siblings; "" until given."""
        return self._name

    def GetSystemName(self) -> str:
        """The name, or "_" if it has none."""
        return self._name or "_"

    def GetSystemType(self) -> str:
        """Full name of its class, and in angle brackets its scalar, where that is not float."""
        cls, scalar = type(self), self._scalar
        module = ".".join(part for part in cls.__module__.split(".") if not part.startswith("_") or part == "__main__")
        name = cls.__qualname__.partition("_𝓣")[0]
        return f"{module}.{name}" if scalar is float else f"{module}.{name}<{scalar.__name__}>"

    def _parent(self) -> Any:
        return None if self._parent_ref is None else self._parent_ref()

    def GetSystemPathname(self) -> str:
        """Names of the diagrams it is in and its own, separated by "::"."""
        parent = self._parent()
        return f"{parent.GetSystemPathname() if parent is not None else ''}::{self.GetSystemName()}"

    def _describe(self) -> str:
        return f"System {self.GetSystemPathname()} ({self.GetSystemType()})"

    # Ports.

    def num_input_ports(self) -> int:
        """How many input ports there are."""
        return len(self._inputs)

    def num_output_ports(self) -> int:
        """How many output ports there are."""
        return len(self._outputs)

    def _input_port(self, i: int) -> InputPort:
        return self._port(("in", i), InputPort)

    def _output_port(self, j: int) -> OutputPort:
        return self._port(("out", j), LeafOutputPort if self._subsystems() is None else OutputPort)

    def _port(self, key: tuple[str, int], kind: type[InputPort | OutputPort]) -> Any:
        """A port; the same object as long as somebody holds it."""
        known = self._ports.get(key)
        port = None if known is None else known()
        if port is None:
            port = kind._make(self, key[1])
            self._ports[key] = weakref.ref(port)
        return port

    def _allocate_output(self, j: int) -> AbstractValue:
        raise NotImplementedError

    # Tickets.

    nothing_ticket = _static(Ticket.NOTHING, "nothing")
    time_ticket = _static(Ticket.TIME, "time")
    accuracy_ticket = _static(Ticket.ACCURACY, "the accuracy")
    q_ticket = _static(Ticket.Q, "continuous q")
    v_ticket = _static(Ticket.V, "continuous v")
    z_ticket = _static(Ticket.Z, "continuous z")
    xc_ticket = _static(Ticket.XC, "all continuous state")
    xd_ticket = _static(Ticket.XD, "all discrete state")
    xa_ticket = _static(Ticket.XA, "all abstract state")
    all_state_ticket = _static(Ticket.ALL_STATE, "all state")
    pn_ticket = _static(Ticket.PN, "all numeric parameters")
    pa_ticket = _static(Ticket.PA, "all abstract parameters")
    all_parameters_ticket = _static(Ticket.ALL_PARAMETERS, "all parameters")
    all_sources_except_input_ports_ticket = _static(Ticket.ALL_SOURCES_EXCEPT_INPUTS, "everything but input")
    all_input_ports_ticket = _static(Ticket.ALL_INPUTS, "all input")
    all_sources_ticket = _static(Ticket.ALL_SOURCES, "everything")
    configuration_ticket = _static(Ticket.CONFIGURATION, "what positions depend on")
    kinematics_ticket = _static(Ticket.KINEMATICS, "what positions and velocities depend on")
    xcdot_ticket = _static(Ticket.XCDOT, "time derivatives")
    pe_ticket = _static(Ticket.PE, "potential energy")
    ke_ticket = _static(Ticket.KE, "kinetic energy")
    pc_ticket = _static(Ticket.PC, "conservative power")
    pnc_ticket = _static(Ticket.PNC, "non-conservative power")

    def _new_ticket(self, *what: object) -> int:
        ticket = self._next_ticket
        self._next_ticket += 1
        self._tickets[ticket] = what
        return ticket

    def _indexed_ticket(self, kind: int, index: SupportsIndex, count: int, call: str) -> DependencyTicket:
        i = operator.index(index)
        if not 0 <= i < count:
            raise IndexError(f"{call}(): there is no number {i}; there are {count}.")
        key = kind, i
        if key not in self._state_tickets:
            self._state_tickets[key] = self._new_ticket(kind, i)
        return DependencyTicket(self._state_tickets[key])

    def discrete_state_ticket(self, index: SupportsIndex) -> DependencyTicket:
        """Dependency on a group of discrete state."""
        return self._indexed_ticket(Ticket.XD, index, self.num_discrete_state_groups(), "discrete_state_ticket")

    def abstract_state_ticket(self, index: SupportsIndex) -> DependencyTicket:
        """Dependency on an abstract state."""
        return self._indexed_ticket(Ticket.XA, index, self.num_abstract_states(), "abstract_state_ticket")

    def numeric_parameter_ticket(self, index: SupportsIndex) -> DependencyTicket:
        """Dependency on a group of numeric parameters."""
        count = self.num_numeric_parameter_groups()
        return self._indexed_ticket(Ticket.PN, index, count, "numeric_parameter_ticket")

    def abstract_parameter_ticket(self, index: SupportsIndex) -> DependencyTicket:
        """Dependency on an abstract parameter."""
        return self._indexed_ticket(Ticket.PA, index, self.num_abstract_parameters(), "abstract_parameter_ticket")

    @checked
    def input_port_ticket(self, index: int) -> DependencyTicket:
        """Dependency on an input port."""
        return self.get_input_port(index).ticket()

    def cache_entry_ticket(self, index: int | CacheIndex) -> DependencyTicket:
        """Dependency on a cache entry."""
        return self.get_cache_entry(index).ticket()

    # Cache entries.

    def DeclareCacheEntry(
        self,
        description: str,
        value_producer: ValueProducer,
        prerequisites_of_calc: Iterable[DependencyTicket | int] | None = None,
    ) -> CacheEntry:
        """Declares a value to be computed on demand and kept until one of its prerequisites changes."""
        if not isinstance(value_producer, ValueProducer):
            raise Mismatch(
                f"DeclareCacheEntry(): incompatible function arguments: {value_producer!r} is no ValueProducer."
            )
        tickets = frozenset(
            {Ticket.ALL_SOURCES} if prerequisites_of_calc is None else {int(t) for t in prerequisites_of_calc}
        )
        if not tickets:
            raise RuntimeError(
                f"DeclareCacheEntry('{description}'): prerequisites may not be empty; for a value that depends on "
                "nothing, give {System.nothing_ticket()}."
            )
        index = len(self._cache_entries)
        declaration = CacheDeclaration(
            description,
            Callback.of(self, value_producer._allocate, "ValueProducer"),
            Callback.of(self, value_producer._calc, "ValueProducer"),
            tickets,
            self._new_ticket("cache", index),
        )
        self._cache_entries.append(declaration)
        return self.get_cache_entry(index)

    def get_cache_entry(self, index: CacheIndex | int) -> CacheEntry:
        """Cache entry `index`; the same object as long as somebody holds it."""
        i = operator.index(index)
        if not 0 <= i < len(self._cache_entries):
            raise IndexError(f"get_cache_entry(): there is no entry {i}; there are {len(self._cache_entries)}.")
        entry = self._entries_in_use.get(i)
        if entry is None:
            entry = self._entries_in_use[i] = CacheEntry._make(self, i)
        return entry

    # Counts.

    def _sum(self, count: Any) -> int:
        children = self._subsystems()
        return count(self) if children is None else sum(child._sum(count) for child in children)

    def num_continuous_states(self) -> int:
        """Number of continuous variables."""
        return self._sum(lambda s: sum(s._xc_counts))

    def num_discrete_state_groups(self) -> int:
        """Number of groups of discrete state."""
        return self._sum(lambda s: len(s._xd_models))

    def num_abstract_states(self) -> int:
        """Number of abstract states."""
        return self._sum(lambda s: len(s._xa_models))

    def num_numeric_parameter_groups(self) -> int:
        """Number of groups of numeric parameters."""
        return self._sum(lambda s: len(s._pn_models))

    def num_abstract_parameters(self) -> int:
        """Number of abstract parameters."""
        return self._sum(lambda s: len(s._pa_models))

    def implicit_time_derivatives_residual_size(self) -> int:
        """Number of residuals of the implicit form of the derivatives."""
        return self.num_continuous_states()

    def ValidateContext(self, context: Context) -> None:
        """Checks that a context was made for this system.

        Raises:
            RuntimeError: it was made for another.
        """
        system = getattr(context, "_system", None)
        if system is self:
            return
        if system is None or not hasattr(context, "_store"):
            raise Mismatch(f"ValidateContext(): incompatible function arguments: expected a Context, got {context!r}")
        raise RuntimeError(
            f"A function call on a {self.GetSystemType()} system named '{self.GetSystemPathname()}' was passed the "
            + (
                "root Diagram's Context instead of the appropriate subsystem Context."
                if context._node == 0 and context._store.layout.node_of.get(self._system_id) is not None
                else f"Context of a system named '{system.GetSystemPathname()}' instead of the appropriate subsystem "
                "Context."
            )
            + " Use GetMyContextFromRoot()."
        )
