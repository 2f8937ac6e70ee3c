"""A diagram flattened: its systems, where each input comes from, and output ports in the order they can be computed."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

from sheldrake.common.kernel import Kernel, Parameter
from sheldrake.systems.framework._declarations import OutputDeclaration
from sheldrake.systems.framework._index import Ticket

if TYPE_CHECKING:
    from collections.abc import Iterable

    from sheldrake.systems.framework._engine.memory import Slot
    from sheldrake.systems.framework._index import DependencyTicket
    from sheldrake.systems.framework._system import System

Source = tuple[str, int, int]
"""("out", node, output) of a leaf, or ("free", node, input): the topmost port, whose value may be fixed."""


@dataclasses.dataclass(slots=True)
class Node:
    """One system of the tree: its number is its place in depth-first order."""

    number: int
    parent: int
    place: int
    """Number among its siblings."""
    children: list[int]
    leaf: bool
    first_leaf: int = 0
    last_leaf: int = 0


def tree_of(root: System) -> list[Any]:
    """The systems under `root`, depth first, `root` included."""
    below = root._tree_below
    if below is None:
        below, stack = [], list(reversed(root._subsystems() or ()))
        while stack:
            system = stack.pop()
            below.append(system)
            stack.extend(reversed(system._subsystems() or ()))
        root._tree_below = below
    return [root, *below]


class Topology:
    """What is connected to what under one root system.

    Args:
        root: The system.
        overrides: Input ports (node, index) that are fixed although something is connected to them.
    """

    def __init__(self, root: System, overrides: frozenset[tuple[int, int]] = frozenset()):
        self.overrides = overrides
        self.systems = tree_of(root)
        self.nodes: list[Node] = []
        self._shown: dict[tuple[int, int], tuple[int, int]] = {}  # what was found once: nesting may be deep
        self._resolved: dict[tuple[int, int], Source] = {}
        self._walk(root)
        self.leaves = [n.number for n in self.nodes if n.leaf]
        self.sources: dict[tuple[int, int], Source] = {
            (n, i): self.resolve(n, i) for n in self.leaves for i in range(len(self.systems[n]._inputs))
        }
        self._sort()

    def _walk(self, root: Any) -> None:
        stack = [(root, -1, 0)]
        while stack:
            system, parent, place = stack.pop()
            number = len(self.nodes)
            children = system._subsystems()
            self.nodes.append(Node(number, parent, place, [], children is None))
            if parent >= 0:
                self.nodes[parent].children.append(number)
            for k in range(len(children or ()) - 1, -1, -1):
                stack.append((children[k], number, k))
        leaves = 0
        for node in self.nodes:
            node.first_leaf = leaves
            leaves += node.leaf
        for node in reversed(self.nodes):
            node.last_leaf = (
                node.first_leaf + 1
                if node.leaf
                else (self.nodes[node.children[-1]].last_leaf if node.children else node.first_leaf)
            )

    def output_source(self, n: int, j: int) -> tuple[int, int]:
        """The leaf and its output port that output port `j` of node `n` shows."""
        way: list[tuple[int, int]] = []
        while not self.nodes[n].leaf and (n, j) not in self._shown:
            way.append((n, j))
            child, j = self.systems[n]._exported_outputs[j]
            n = self.nodes[n].children[child]
        found = self._shown.get((n, j), (n, j))
        self._shown.update(dict.fromkeys(way, found))
        return found

    def resolve(self, n: int, i: int) -> Source:
        """Where input port `i` of node `n` takes its value from."""
        way: list[tuple[int, int]] = []
        found: Source | None = None
        while found is None:
            way.append((n, i))
            found = self._resolved.get((n, i))
            if found is None:
                n, i, found = self._next(n, i)
        self._resolved.update(dict.fromkeys(way, found))
        return found

    def _next(self, n: int, i: int) -> tuple[int, int, Source | None]:
        """The input port of a diagram that feeds input port `i` of node `n`; or the source, if that is known now."""
        if (n, i) in self.overrides or n == 0:
            return n, i, ("free", n, i)
        node = self.nodes[n]
        diagram, key = self.systems[node.parent], (node.place, i)
        if key in diagram._wires:
            child, j = diagram._wires[key]
            return n, i, ("out", *self.output_source(self.nodes[node.parent].children[child], j))
        if key not in diagram._exported_inputs:
            return n, i, ("free", n, i)
        return node.parent, diagram._exported_inputs[key], None

    def port_name(self, n: int, j: int) -> str:
        """Path and name of an output port."""
        system = self.systems[n]
        return f"{system.GetSystemPathname()}:{system._outputs[j].name}"

    def _sort(self) -> None:
        """Orders computed output ports by direct feedthrough: `ports`, and `reads`, what each one reads."""
        ports = [(n, j) for n in self.leaves for j, o in enumerate(self.systems[n]._outputs) if o.state is None]
        number = {port: k for k, port in enumerate(ports)}
        self.needs, reads = {}, []
        known: dict[tuple, tuple[set, list[int]]] = {}  # many ports of a system need the same
        for n, j in ports:
            output = self.systems[n]._outputs[j]
            key = n, id(output.calc) if isinstance(output.calc, Kernel) else output.tickets
            if key not in known:
                needs = needs_of(self.systems[n], output)
                found = [self.sources[n, i] for i in sorted(x[1] for x in needs if isinstance(x, tuple))]
                known[key] = needs, [number[s[1], s[2]] for s in found if s[0] == "out" and (s[1], s[2]) in number]
            self.needs[n, j] = known[key][0]
            reads.append(list(known[key][1]))
        waits = [len(r) for r in reads]
        readers: list[list[int]] = [[] for _ in ports]
        for k, r in enumerate(reads):
            for m in r:
                readers[m].append(k)
        order = [k for k in range(len(ports)) if not waits[k]]
        for k in order:  # grows while it is walked
            for m in readers[k]:
                waits[m] -= 1
                if not waits[m]:
                    order.append(m)
        if len(order) < len(ports):
            raise RuntimeError(self._loop_text(ports, reads, waits))
        new = {k: r for r, k in enumerate(order)}
        self.ports = [ports[k] for k in order]
        self.reads = [[new[m] for m in reads[k]] for k in order]

    def _loop_text(self, ports: list, reads: list, waits: list) -> str:
        k, trail = next(k for k in range(len(ports)) if waits[k]), []
        while k not in trail:
            trail.append(k)
            k = next(m for m in reads[k] if waits[m])
        loop = trail[trail.index(k) :][::-1]
        names = []
        for place, m in enumerate(loop):
            n, j = ports[m]
            before = ports[loop[place - 1]]
            port = next(i for i in range(len(self.systems[n]._inputs)) if self.sources[n, i] == ("out", *before))
            system = self.systems[n]
            names.append(
                f"  InputPort[{port}] ({system._inputs[port].name}) of {system._describe()} is direct-feedthrough to\n"
                f"  OutputPort[{j}] ({system._outputs[j].name}) of {system._describe()}"
            )
        return (
            "Reported algebraic loop detected in DiagramBuilder:\n"
            + " is connected to\n".join(names)
            + " is connected to the first of these.\n"
            "A System may have conservatively reported that one of its output ports depends on an input port, making "
            "one of the 'is direct-feedthrough to' lines above spurious. If that is the case, give "
            "prerequisites_of_calc to the Declare...OutputPort() call."
        )


def needs_of(system: System, output: OutputDeclaration) -> set:
    """What an output depends on: built-in tickets, ("in", i) for inputs, and "work".

    A kernel tells by the names of its parameters, a Python function by its tickets.
    """
    if isinstance(output.calc, Kernel):
        return kernel_needs(system, output.calc)
    return expand_tickets(system, output.tickets)


def kernel_needs(system: System, calc: Kernel) -> set:
    """What a kernel reads, from the names of all its parameters but the last."""
    names = set(calc.names[:-1])
    found: set = {ticket for name, ticket in _OF_NAME.items() if name in names}
    if "work" in names:
        found.add("work")
    if "u" in names:
        vector = [i for i, port in enumerate(system._inputs) if int(port.data_type) == 0]
        found.update(("in", i) for i in vector)
    return found


def inputs_as(parameter: Parameter, kernel: Kernel, slots: list[Slot], inputs: list) -> Any:
    """What a kernel's parameter `u` is given: all inputs, or, if it is a record, the only one that is a vector.

    Raises:
        TypeError: if it is a record and there is not one such input.
    """
    if parameter.kind != "record":
        return inputs
    vectors = [i for i, slot in enumerate(slots) if slot.vector]
    if len(vectors) != 1:
        raise TypeError(
            f"{kernel!r}: `u` is a {parameter.cls.RECORD.__name__} in a kernel, which takes one vector input "
            f"port; there are {len(vectors)}. Annotate it Vectors, which has u[0], u[1], ..."
        )
    return inputs[vectors[0]]


_OF_NAME = {"t": Ticket.TIME, "xc": Ticket.XC, "xd": Ticket.XD, "p": Ticket.PN}
_STATE = {Ticket.XC, Ticket.XD, Ticket.XA}
_PARAMETERS = {Ticket.PN, Ticket.PA}
_EXPAND = {
    Ticket.Q: {Ticket.XC},
    Ticket.V: {Ticket.XC},
    Ticket.Z: {Ticket.XC},
    Ticket.ALL_STATE: _STATE,
    Ticket.ALL_PARAMETERS: _PARAMETERS,
    Ticket.ALL_SOURCES_EXCEPT_INPUTS: {Ticket.TIME, Ticket.ACCURACY} | _STATE | _PARAMETERS,
    Ticket.CONFIGURATION: {Ticket.ACCURACY} | _STATE | _PARAMETERS,
    Ticket.KINEMATICS: {Ticket.ACCURACY} | _STATE | _PARAMETERS,
    Ticket.PE: {Ticket.TIME, Ticket.ACCURACY} | _STATE | _PARAMETERS,
    Ticket.KE: {Ticket.ACCURACY} | _STATE | _PARAMETERS,
    Ticket.PC: {Ticket.TIME, Ticket.ACCURACY} | _STATE | _PARAMETERS,
}
_WITH_INPUTS = {Ticket.ALL_SOURCES, Ticket.XCDOT, Ticket.PNC}


def expand_tickets(system: System, tickets: Iterable[DependencyTicket | int]) -> set:
    """Tickets in terms of sources; those of cache entries are followed."""
    found: set = set()
    todo, seen = [int(t) for t in tickets], set()
    while todo:
        ticket = todo.pop()
        if ticket in seen:
            continue
        seen.add(ticket)
        if ticket in _WITH_INPUTS:
            todo += [Ticket.ALL_SOURCES_EXCEPT_INPUTS, Ticket.ALL_INPUTS]
        elif ticket == Ticket.ALL_INPUTS:
            found.update(("in", i) for i in range(len(system._inputs)))
        elif ticket in _EXPAND:
            found |= _EXPAND[ticket]
        elif ticket >= Ticket.FIRST_INDEXED:
            kind, index = system._tickets[ticket]
            if kind == "in":
                found.add(("in", index))
            elif kind == "cache":
                todo += system._cache_entries[index].tickets
            elif kind == "work":
                found.add("work")
            else:
                found.add(kind)
        elif ticket != Ticket.NOTHING:
            found.add(ticket)
    return found
