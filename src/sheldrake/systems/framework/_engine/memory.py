"""Where every number of a root context lives: one array, the slab, in which each system has its place."""

from __future__ import annotations

import dataclasses
import weakref
from typing import TYPE_CHECKING, Any

from sheldrake.systems.framework._engine.scratch import size_of
from sheldrake.systems.framework._engine.topology import Source, Topology
from sheldrake.systems.framework._index import PortDataType

if TYPE_CHECKING:
    from sheldrake.systems.framework._engine.topology import Node
    from sheldrake.systems.framework._system import System

Span = tuple[int, int]
"""Begin and end in the slab."""
Parts = tuple[list[Span], list[Span], list[Span]]
"""Of q, v and z."""


@dataclasses.dataclass(slots=True)
class Slot:
    """Where an input or output port's value is: numbers at `span`; its row, or -1; its free number, or -1."""

    span: Span
    row: int = -1
    free: int = -1
    abstract_state: int = -1
    vector: bool = True


@dataclasses.dataclass(slots=True)
class Place:
    """Where one system's values are."""

    xc: Span = (0, 0)
    parts: Parts = ([], [], [])
    """Of a leaf, relative to xc; see `Memory.parts`."""
    xd: Span = (0, 0)
    p: Span = (0, 0)
    groups: Span = (0, 0)
    """Numbers of discrete groups."""
    parameters: Span = (0, 0)
    """Numbers of numeric parameter groups."""
    abstract: Span = (0, 0)
    abstract_parameters: Span = (0, 0)
    work: Span = (0, 0)
    inputs: list[Slot] = dataclasses.field(default_factory=list)
    outputs: list[Slot] = dataclasses.field(default_factory=list)
    derivatives: int = -1
    """Row of the time derivatives."""
    events: list[int] = dataclasses.field(default_factory=list)
    """Row of each event, in the order of declaration; -1 - n for log n, `NO_ROW` without a handler."""


class Memory(Topology):
    """A topology whose values have places in a slab of `size` numbers; time is the first."""

    structures: dict
    """What contexts of this layout know otherwise than new ones do, by node; see `LeafSystem._structure_in`."""
    stores: weakref.WeakSet[Any]
    prototypes: dict[int, Any]
    """Of the scratch of leaves, by node."""

    def __init__(self, root: System, overrides: frozenset[tuple[int, int]]):
        super().__init__(root, overrides)
        self.size = 1
        self.places = [Place() for _ in self.nodes]
        self.groups: list[Span] = []
        self.parameter_groups: list[Span] = []
        self.num_abstract = self.num_abstract_parameters = 0
        self._parts: dict[int, Parts] = {}  # of diagrams that were asked for them: nesting may be deep
        self._inputs: dict[tuple[int, int], Slot] = {}  # of diagrams
        self._outputs: dict[tuple[int, int], tuple[int, int]] = {}
        self._take_state()
        self._take_ports()

    def _take(self, n: int) -> Span:
        self.size += n
        return self.size - n, self.size

    def _take_state(self) -> None:
        leaves = [(self.systems[n], self.places[n]) for n in self.leaves]
        for s, place in leaves:
            nq, nv, nz = s._xc_counts
            place.xc = self._take(nq + nv + nz)
            place.parts = ([(0, nq)], [(nq, nq + nv)], [(nq + nv, nq + nv + nz)])
        self.xc = (1, self.size)
        for s, place in leaves:
            place.groups = self._take_groups(s._xd_models, self.groups)
            place.xd = self._span(self.groups, place.groups)
        self.xd = (self.xc[1], self.size)
        for s, place in leaves:
            place.parameters = self._take_groups(s._pn_models, self.parameter_groups)
            place.p = self._span(self.parameter_groups, place.parameters)
            place.abstract = self.num_abstract, self.num_abstract + len(s._xa_models)
            self.num_abstract = place.abstract[1]
            first = self.num_abstract_parameters
            self.num_abstract_parameters = first + len(s._pa_models)
            place.abstract_parameters = first, self.num_abstract_parameters
        self.p = (self.xd[1], self.size)
        for node in reversed(self.nodes):  # children come after their diagrams
            if not node.leaf:
                self._gather(node)

    def _take_groups(self, models: list, groups: list[Span]) -> Span:
        first = len(groups)
        groups.extend(self._take(model.size()) for model in models)
        return first, len(groups)

    def _span(self, groups: list[Span], numbers: Span) -> Span:
        first, last = numbers
        return (groups[first][0], groups[last - 1][1]) if last > first else (self.size, self.size)

    def _gather(self, node: Node) -> None:
        """A diagram's values are those of its children, which lie side by side."""
        place, inside = self.places[node.number], [self.places[n] for n in node.children]
        for name in ("xc", "xd", "p", "groups", "parameters", "abstract", "abstract_parameters"):
            full = [s for s in (getattr(q, name) for q in inside) if s[1] > s[0]]
            setattr(place, name, (full[0][0], full[-1][1]) if full else (0, 0))
        if place.groups == (0, 0):
            place.xd = (0, 0)

    def parts(self, n: int) -> Parts:
        """Where q, v and z of node `n` are, relative to its continuous state: of a diagram, those of all its leaves."""
        node, place = self.nodes[n], self.places[n]
        if node.leaf:
            return place.parts
        if n not in self._parts:
            inside = [self.places[m] for m in self.leaves[node.first_leaf : node.last_leaf]]
            base = place.xc[0]
            q, v, z = (
                [(a + of.xc[0] - base, b + of.xc[0] - base) for of in inside for a, b in of.parts[k] if b > a]
                or [(0, 0)]
                for k in range(3)
            )
            self._parts[n] = q, v, z
        return self._parts[n]

    def _take_ports(self) -> None:
        self.row_of: dict[tuple[int, int], int] = {port: r for r, port in enumerate(self.ports)}
        for n in self.leaves:
            self.places[n].outputs = [Slot((0, 0))] * len(self.systems[n]._outputs)
        for r, (n, j) in enumerate(self.ports):
            o = self.systems[n]._outputs[j]
            vector = o.data_type is PortDataType.kVectorValued
            span = self._take(o.size) if vector else (0, 0)
            self.places[n].outputs[j] = Slot(span, row=r, vector=vector)
        for n in self.leaves:
            place = self.places[n]
            for j, o in enumerate(self.systems[n]._outputs):
                if o.state is not None:
                    place.outputs[j] = self._state_slot(place, *o.state)
        self.free: dict[tuple[int, int], int] = {}
        self.free_slots: list[Slot] = []
        self.optional_free: set[int] = set()
        for n in self.leaves:
            slots = [self._input_slot(self.sources[n, i]) for i in range(len(self.systems[n]._inputs))]
            self.places[n].inputs = slots
            self.optional_free.update(s.free for d, s in zip(self.systems[n]._inputs, slots) if d.optional)
        for node in self.nodes:
            if not node.leaf:  # also what is exported to nobody may be fixed
                for i in range(len(self.systems[node.number]._inputs)):
                    self._inputs[node.number, i] = self._input_slot(self.resolve(node.number, i))
                for j in range(len(self.systems[node.number]._outputs)):
                    self._outputs[node.number, j] = self.output_source(node.number, j)

    def _state_slot(self, place: Place, kind: str, index: int) -> Slot:
        if kind == "xc":
            return Slot(place.xc)
        if kind == "xd":
            return Slot(self.groups[place.groups[0] + index])
        return Slot((0, 0), abstract_state=place.abstract[0] + index, vector=False)

    def _input_slot(self, source: Source) -> Slot:
        kind, n, k = source
        if kind == "out":
            return self.places[n].outputs[k]
        if (n, k) not in self.free:
            declaration = self.systems[n]._inputs[k]
            vector = declaration.data_type is PortDataType.kVectorValued
            span = self._take(declaration.size) if vector else (0, 0)
            self.free[n, k] = len(self.free_slots)
            self.free_slots.append(Slot(span, free=len(self.free_slots), vector=vector))
        return self.free_slots[self.free[n, k]]

    def _take_work(self) -> None:
        for n in self.leaves:
            self.places[n].work = self._take(size_of(self.prototypes[n]))
        self.plus = self._take(self.xd[1] - self.xc[0])[0] - self.xc[0]
        self.xdot = self._take(self.xc[1] - self.xc[0])
        self.rk = self._take(8 * (self.xc[1] - self.xc[0]))  # x0 and up to seven stages

    def resolve_fixed(self, n: int, i: int) -> int | None:
        """The free number of an input port that nothing is connected to; None if it takes its value elsewhere."""
        return self.free.get((n, i))

    def input_slot(self, n: int, i: int) -> Slot:
        """Where input port `i` of node `n`, leaf or diagram, takes its value."""
        if self.nodes[n].leaf:
            return self.places[n].inputs[i]
        return self._inputs[n, i]

    def output_slot(self, n: int, j: int) -> tuple[int, int, Slot]:
        """Leaf, its port and place of output port `j` of node `n`."""
        if not self.nodes[n].leaf:
            n, j = self._outputs[n, j]
        return n, j, self.places[n].outputs[j]


class RootView:
    """What a leaf may ask about the root it is compiled into (see `System._kernel_models`)."""

    def __init__(self, layout: Memory, node: int):
        self._layout, self._node = layout, node

    def source(self, i: int) -> tuple[Any, int] | None:
        """The leaf system and the number of its output port that feed input port `i`; None if nothing does."""
        kind, n, j = self._layout.sources[self._node, i]
        return (self._layout.systems[n], j) if kind == "out" else None

    def structure_behind(self, i: int) -> Any:
        """What the leaf that feeds input port `i` has in these contexts otherwise than in new ones, or None."""
        kind, n, _ = self._layout.sources[self._node, i]
        return self._layout.structures.get(n) if kind == "out" else None

    def feeding(self, i: int) -> RootView | None:
        """What the leaf that feeds input port `i` may ask; None if nothing does."""
        kind, n, _ = self._layout.sources[self._node, i]
        return RootView(self._layout, n) if kind == "out" else None

    def slot(self, i: int) -> Slot:
        """Where the value of input port `i` is."""
        return self._layout.places[self._node].inputs[i]

    def is_exported(self, i: int) -> bool:
        """Whether input port `i` takes its value, if it has one, from an input port of a diagram around it."""
        kind, n, _ = self._layout.sources[self._node, i]
        return kind == "free" and n != self._node

    def stores(self) -> weakref.WeakSet[Any]:
        """Stores of contexts with this layout, now and later; `Store.restructure` has one follow a changed system."""
        return self._layout.stores

    @property
    def root(self) -> System:
        """The root system."""
        return self._layout.systems[0]
