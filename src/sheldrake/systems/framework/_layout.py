"""Where every number of a root context lives, and the Program of its event loop."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from typing import Any

import numpy as np

from sheldrake.common.kernel import Kernel
from sheldrake.systems.framework import _scratch
from sheldrake.systems.framework._declarations import (
    DERIVATIVES,
    DISCRETE,
    OUTPUT,
    PUBLISH,
    UNRESTRICTED,
    Callback,
    EventDeclaration,
    Stages,
)
from sheldrake.systems.framework._index import PortDataType, Ticket
from sheldrake.systems.framework._kernels import loop as _loop
from sheldrake.systems.framework._topology import Source, Topology

Span = tuple[int, int]
"""Begin and end in the slab."""

LOG = "log"
"""Handler of an event that appends the leaf's only input to its log."""


@dataclasses.dataclass(slots=True)
class Slot:
    """Where an input or output port's value is: numbers at `span`; its row, or -1; its free number, or -1."""

    span: Span
    row: int = -1
    free: int = -1
    abstract_state: int = -1
    vector: bool = True


@dataclasses.dataclass(slots=True)
class Row:
    """One computation of one leaf."""

    node: int
    kind: int
    calc: Any
    out: Span
    output: int = -1
    event: EventDeclaration | None = None
    free: tuple[int, ...] = ()
    """Free inputs that a kernel needs."""
    models: dict = dataclasses.field(default_factory=dict)
    """Constant arrays, by parameter name."""

    @property
    def native(self) -> bool:
        """Whether a kernel computes it."""
        return isinstance(self.calc, Kernel)


@dataclasses.dataclass(slots=True)
class Place:
    """Where one system's values are."""

    xc: Span = (0, 0)
    parts: tuple[list[Span], list[Span], list[Span]] = ([], [], [])
    """q, v and z, relative to xc."""
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


NO_ROW = -(10**9)


class Layout(Topology):
    """A topology with memory: `places`, `rows`, `program`, and what a new context begins with (`S0`, `I0`)."""

    def __init__(self, root: Any, overrides: frozenset[tuple[int, int]] = frozenset(), given: dict | None = None):
        super().__init__(root, overrides)
        self.given = given or {}
        """What contexts of this layout know otherwise than new ones do, by node; see `LeafSystem._structure_in`."""
        self.structured = [n for n in self.leaves if self.systems[n]._structured]
        self.size = 1
        self.places = [Place() for _ in self.nodes]
        self.groups: list[Span] = []
        self.parameter_groups: list[Span] = []
        self.num_abstract = self.num_abstract_parameters = 0
        self._inputs: dict[tuple[int, int], Slot] = {}  # of diagrams
        self._outputs: dict[tuple[int, int], tuple[int, int]] = {}
        self.rows: list[Row] = []
        self.logs: list[tuple[int, Span]] = []
        self.log_of: dict[int, int] = {}
        self._take_state()
        self._take_ports()
        self._take_work()
        self._models: dict[int, dict] = {}
        self._stages: dict[int, list[int]] = {}
        self._add_rows()
        self.program = self._program()
        self.version = sum(s._version for s in self.systems)
        leaves = [(n, self.systems[n]) for n in self.leaves]
        self.with_abstract = [n for n, s in leaves if s._xa_models or s._pa_models]
        self.with_own_defaults = [n for n, s in leaves if s._sets_own_defaults()]
        self.blank: np.ndarray | None = None  # the slab of a new store, and what defaults are (see `Store`)
        self.defaults: tuple[int, np.ndarray] | None = None
        self._stamps = self.program.level.tolist()
        address = self.program.words.__array_interface__["data"][0]
        self.words_of = [address + 8 * at for at in self.program.at.tolist()]
        """Where the words of each row are, for direct calls."""
        self._pulls: dict[int, list[int]] = {}
        del self.systems  # a layout is owned by the root system: it must not own it in turn

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
        for node, place in zip(self.nodes, self.places):
            if not node.leaf:
                self._gather(node, place)

    def _take_groups(self, models: list, groups: list[Span]) -> Span:
        first = len(groups)
        groups.extend(self._take(model.size()) for model in models)
        return first, len(groups)

    def _span(self, groups: list[Span], numbers: Span) -> Span:
        first, last = numbers
        return (groups[first][0], groups[last - 1][1]) if last > first else (self.size, self.size)

    def _gather(self, node: Any, place: Place) -> None:
        """A diagram's values are those of its leaves, which lie side by side."""
        inside = [self.places[n] for n in self.leaves[node.first_leaf : node.last_leaf]]
        if not inside:
            return
        for name in ("xc", "xd", "p", "groups", "parameters", "abstract", "abstract_parameters"):
            full = [s for s in (getattr(q, name) for q in inside) if s[1] > s[0]]
            setattr(place, name, (full[0][0], full[-1][1]) if full else (0, 0))
        if place.groups == (0, 0):
            place.xd = (0, 0)
        base = place.xc[0]
        place.parts = tuple(  # type: ignore[assignment]
            [(a + q.xc[0] - base, b + q.xc[0] - base) for q in inside for a, b in q.parts[k] if b > a] or [(0, 0)]
            for k in range(3)
        )

    def _take_ports(self) -> None:
        self.row_of: dict[tuple[int, int], int] = {port: r for r, port in enumerate(self.ports)}
        for n in self.leaves:
            self.places[n].outputs = [Slot((0, 0))] * len(self.systems[n]._outputs)
        for r, (n, j) in enumerate(self.ports):
            o = self.systems[n]._outputs[j]
            vector = o.data_type is PortDataType.kVectorValued
            span = self._take(o.size) if vector else (0, 0)
            self.places[n].outputs[j] = Slot(span, row=r, vector=vector)
            self.rows.append(Row(n, OUTPUT, o.calc, span, output=j))
        for n in self.leaves:
            place = self.places[n]
            for j, o in enumerate(self.systems[n]._outputs):
                if o.state is not None:
                    place.outputs[j] = self._state_slot(place, *o.state)
        self.free: dict[tuple[int, int], int] = {}
        self.free_slots: list[Slot] = []
        for n in self.leaves:
            slots = [self._input_slot(self.sources[n, i]) for i in range(len(self.systems[n]._inputs))]
            self.places[n].inputs = slots
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
        self.prototypes: dict[int, Any] = {}
        for n in self.leaves:
            self.prototypes[n] = self.systems[n]._scratch_in(RootView(self, n))
            self.places[n].work = self._take(_scratch.size_of(self.prototypes[n]))
        self.plus = self._take(self.xd[1] - self.xc[0])[0] - self.xc[0]
        self.xdot = self._take(self.xc[1] - self.xc[0])
        self.rk = self._take(8 * (self.xc[1] - self.xc[0]))  # x0 and up to seven stages

    def _shift(self, span: Span, by: int) -> Span:
        return span[0] + by, span[1] + by

    def _add(self, row: Row) -> int:
        self.rows.append(row)
        return len(self.rows) - 1

    def _add_rows(self) -> None:
        for n in self.leaves:
            system, place = self.systems[n], self.places[n]
            if place.xc[1] > place.xc[0]:
                calc = system._derivatives_calc()
                out = self._shift(place.xc, self.xdot[0] - self.xc[0])
                kernels = calc.choose(system, RootView(self, n)) if isinstance(calc, Stages) else [calc]
                place.derivatives = self._add_stages([Row(n, DERIVATIVES, k, out) for k in kernels])
            for event in system._all_events():
                place.events.append(self._event_row(n, place, event))
        for row in self.rows:
            if row.native:
                row.free = self._required(row)
                row.models = self._needed_models(row)

    def _event_row(self, n: int, place: Place, event: EventDeclaration) -> int:
        if event.handler is None:
            return NO_ROW
        if event.handler == LOG:
            if n not in self.log_of:
                self.log_of[n] = len(self.logs)
                self.logs.append((n, place.inputs[0].span))
            return -1 - self.log_of[n]
        out = self._shift(place.xd, self.plus) if event.kind != PUBLISH else (0, 0)
        if isinstance(event.handler, Stages):
            kernels = event.handler.choose(self.systems[n], RootView(self, n))
            return self._add_stages([Row(n, event.kind, k, out, event=event) for k in kernels])
        return self._add(Row(n, event.kind, event.handler, out, event=event))

    def _add_stages(self, rows: list[Row]) -> int:
        numbers = [self._add(row) for row in rows]
        self._stages[numbers[0]] = numbers
        return numbers[0]

    def stages(self, row: int) -> list[int]:
        """The rows that make up an event's handler, of which `row` is the first."""
        return self._stages.get(row, [row])

    def _required(self, row: Row) -> tuple[int, ...]:
        if "u" not in row.calc.names:
            return ()
        inputs = zip(self.systems[row.node]._inputs, self.places[row.node].inputs)
        return tuple(s.free for d, s in inputs if s.free >= 0 and s.vector and not d.optional)

    def _needed_models(self, row: Row) -> dict:
        names = [x for x in row.calc.names if x == "model" or x.endswith("_model")]
        if not names:
            return {}
        models = self._models_of(row)
        for name in names:
            if name not in models:
                raise ValueError(
                    f"{type(self.systems[row.node]).__name__}._kernel_models() gives {sorted(models)}; {row.calc!r} "
                    f"needs {name!r}."
                )
        return models

    def _models_of(self, row: Row) -> dict:
        """Constant arrays for a kernel row, by parameter name; a leaf is asked once."""
        n, system = row.node, self.systems[row.node]
        if n not in self._models:
            self._models[n] = dict(system._kernel_models(RootView(self, n)))
        return self._models[n] | system._output_models.get(row.output, {})

    # The program.

    def _program(self) -> _loop.Program:
        words: list[int] = []
        at: list[int] = []
        for row in self.rows:
            at.append(len(words))
            if row.native:
                words.extend(self._words(row))
        num_special = int(_loop.NUM_SPECIAL)
        at += [len(words)] * (num_special + 1)
        self._make_groups()
        pre = [self._prerequisites(rows) for _, _, rows, _ in self.group_list]
        seg = [self._segments(nodes, kind) for kind, _, _, nodes in self.group_list]
        n_rows, n_groups, n_clocks = len(self.rows), len(self.group_list), len(self.clocks)
        side = int(_loop.NUM_SIDE)
        stamp0, k0 = side, side + n_rows
        trig0 = k0 + n_clocks
        self.log0 = trig0 + n_groups
        self.fixed0 = self.log0 + 3 * len(self.logs)
        self.stamp0, self.k0, self.trig0 = stamp0, k0, trig0
        self.side_size = self.fixed0 + len(self.free_slots)
        nxc = self.xc[1] - self.xc[0]
        size = [n_groups - 1, n_clocks, nxc, stamp0, k0, trig0, self.log0, self.plus, self.xdot[0], self.rk[0]]
        size += [n_rows, self.xc[0], n_groups - 1]
        return _loop.Program(
            words=_ints(words or [0]),
            at=_ints(at),
            level=_ints(self._levels() + [2] * (len(self.rows) - len(self.ports))),
            pre=_ints(_flat(pre)),
            pre_ptr=_pointers(pre),
            act=_ints(_flat(rows for _, _, rows, _ in self.group_list)),
            act_ptr=_pointers([rows for _, _, rows, _ in self.group_list]),
            seg=_ints(_flat(seg)).reshape(-1, 2),
            seg_ptr=_pointers(seg),
            group=_ints([(kind, clock) for kind, clock, _, _ in self.group_list]).reshape(-1, 2),
            clock=np.array([x for c in self.clocks for x in c], float),
            log=_ints([(a, b - a) for _, (a, b) in self.logs]).reshape(-1, 2),
            size=_ints(size),
        )

    def _make_groups(self) -> None:
        """What happens together: one group per kind and clock, in the order of the leaves; derivatives come last."""
        clocks: dict[tuple[float, float], int] = {}
        groups: dict[tuple[int, int], tuple[list[int], set[int]]] = {}
        special = {"per_step": int(_loop.PER_STEP), "initialization": int(_loop.AT_START)}
        for clock in (int(_loop.AT_START), int(_loop.PER_STEP)):
            for kind in (UNRESTRICTED, DISCRETE, PUBLISH):
                groups[kind, clock] = ([], set())
        for n in self.leaves:
            for event, row in zip(self.systems[n]._all_events(), self.places[n].events):
                if event.trigger == "forced":
                    continue
                if event.trigger == "periodic":
                    clock = clocks.setdefault((event.offset, event.period), len(clocks))
                else:
                    clock = special[event.trigger]
                rows, nodes = groups.setdefault((event.kind, clock), ([], set()))
                if row != NO_ROW:
                    rows.extend(self.stages(row))
                nodes.add(n)
        self.witness_nodes = [n for n in self.leaves if self.systems[n]._has_witnesses()]
        self.witness_rows: dict[int, int] = {}
        self.clocks = list(clocks)
        self.group_list = [(kind, clock, rows, nodes) for (kind, clock), (rows, nodes) in groups.items() if nodes]
        if self.witness_nodes:
            for kind in (UNRESTRICTED, DISCRETE, PUBLISH):
                row = self._add(Row(-1, kind, None, (0, 0)))
                self.witness_rows[kind] = row
                self.group_list.append((kind, int(_loop.AT_WITNESS), [row], set(self.witness_nodes)))
        derivatives = [r for p in self.places if p.derivatives >= 0 for r in self.stages(p.derivatives)]
        self.group_list.append((DERIVATIVES, -9, derivatives, set()))

    def _segments(self, nodes: set[int], kind: int) -> list[tuple[int, int]]:
        if kind not in (DISCRETE, UNRESTRICTED):
            return []
        spans = [self.places[n].xd for n in nodes]
        if kind == UNRESTRICTED:
            spans += [self.places[n].xc for n in nodes]
        return sorted((a, b - a) for a, b in spans if b > a)

    def _words(self, row: Row) -> list[int]:
        """Arguments of a kernel row: offsets into the slab, addresses of models."""
        from sheldrake.common._native.words import pack_row

        place, found = self.places[row.node], {}
        scratch = _scratch.places_of(place.work[0], self.prototypes[row.node])
        last = row.calc.parameters[-1].name
        for parameter in row.calc.parameters:
            name = parameter.name
            if name in scratch and (name != "work" or parameter.kind == "tuple"):
                found[name] = scratch[name]
            elif name in row.models:
                found[name] = row.models[name]
            elif name == last:
                a, b = row.out
                found[name] = (a, b - a)
            elif name == "u":
                found[name] = [(slot.span[0], slot.span[1] - slot.span[0]) for slot in place.inputs]
            elif name in ("xc", "xd", "p", "work"):
                a, b = getattr(place, name)
                found[name] = (a, b - a)
            elif parameter.kind != "t":
                raise TypeError(
                    f"{row.calc!r}: parameter {name!r} is none of t, xc, xd, p, u, work, model, *_model, not a part of "
                    f"the scratch ({', '.join(scratch)}), and not the last, which is filled."
                )
        return pack_row(row.calc, found).tolist()

    def _prerequisites(self, rows: list[int]) -> list[int]:
        """Output rows to bring up to date before a group acts, in topological order.

        All that its kernels read. Python functions ask for what they want; what kernels alone can compute for them is
        made ready too, natively, as far as nothing that it needs is missing.
        """
        needed: set[int] = set()
        for r in rows:
            if r < 0:
                n, _ = self.logs[-1 - r]
                needed.update(self.upstream([self.places[n].inputs[0].row]))
                continue
            row = self.rows[r]
            if row.node < 0:
                continue
            inputs = [s.row for s in self.places[row.node].inputs if s.row >= 0]
            if row.native:
                if "u" in row.calc.names:
                    needed.update(self.upstream([s.row for s in self.places[row.node].inputs if s.vector]))
            else:
                needed.update(q for r2 in inputs if (found := self._all_native(r2)) is not None for q in found)
        return sorted(needed)

    def _all_native(self, r: int) -> list[int] | None:
        found = self.upstream([r])
        return found if all(self.rows[q].native and not self.rows[q].free for q in found) else None

    def upstream(self, rows: Iterable[int]) -> list[int]:
        """Output rows that these kernels' values need, ascending; Python rows in between ask for their own."""
        seen: set[int] = set()
        todo = [r for r in rows if r >= 0]
        while todo:
            r = todo.pop()
            if r not in seen:
                seen.add(r)
                if self.rows[r].native:
                    todo.extend(self.reads[r])
        return sorted(seen)

    def pull_list(self, r: int) -> list[int]:
        """Rows to compute for output row `r`, in order; the last is `r`."""
        if r not in self._pulls:
            self._pulls[r] = self.upstream([r])
        return self._pulls[r]

    def _levels(self) -> list[int]:
        """How often each output row can change at most."""
        level: list[int] = []
        for n, j in self.ports:
            level.append(self.level_of_needs(n, self.needs[n, j], level))
        return level

    def level_of_needs(self, n: int, needs: set, level: list[int]) -> int:
        """Level of a value of node `n` that needs these sources, given the levels of output rows."""
        place = self.places[n]
        found = 0
        if Ticket.TIME in needs or (Ticket.XC in needs and place.xc[1] > place.xc[0]):
            found = 2
        elif needs & {Ticket.XD, Ticket.XA, "work"}:
            found = 1
        for need in needs:
            if isinstance(need, tuple):
                found = max(found, self.input_level(place.inputs[need[1]], level))
        return found

    def input_level(self, slot: Slot, level: list[int]) -> int:
        """Level of an input."""
        if slot.row >= 0:
            return level[slot.row]
        if slot.free >= 0:
            return 0
        return 2 if slot.abstract_state < 0 and slot.span[0] < self.xc[1] and slot.span[1] > slot.span[0] else 1

    def freshness(self, n: int, needs: Iterable) -> tuple[int, tuple]:
        """What tells whether a value of node `n` that needs these sources is up to date.

        Returns:
            The level at which the event loop may change it, and the names of the sources Python may write.
        """
        chain, m = [], n
        while m >= 0:
            chain.append(m)
            m = self.nodes[m].parent
        place, level = self.places[n], 0
        keys: set[Any] = {"all"}
        for need in needs:
            if isinstance(need, tuple):
                slot = place.inputs[need[1]]
                if slot.row >= 0:
                    row = self.rows[slot.row]
                    found = self.freshness(row.node, self.needs[row.node, row.output])
                elif slot.free >= 0:
                    found = 0, (("fixed", slot.free),)
                else:
                    found = self._state_freshness(slot)
                level = max(level, found[0])
                keys.update(found[1])
            elif need == Ticket.TIME:
                level = 2
                keys.add("t")
            elif need == Ticket.ACCURACY:
                keys.add("accuracy")
            elif need == Ticket.XC:
                level = 2 if place.xc[1] > place.xc[0] else level
                keys.update(("xc", m) for m in chain)
            elif need in (Ticket.XA, "work"):
                level = max(level, 1)
                keys.update(("xa", m) for m in chain)
            elif need == Ticket.XD:
                level = max(level, 1)
                keys.update(("xd", g) for g in range(*place.groups))
            elif need == Ticket.PN:
                keys.update(("pn", g) for g in range(*place.parameters))
            elif need == Ticket.PA:
                keys.update(("pa", m) for m in chain)
            if need in (Ticket.XC, Ticket.XD, Ticket.XA, "work"):
                keys.update(("x", m) for m in chain)
            elif need in (Ticket.PN, Ticket.PA):
                keys.update(("p", m) for m in chain)
        return level, tuple(keys)

    def _state_freshness(self, slot: Slot) -> tuple[int, tuple]:
        for n in self.leaves:
            if any(s is slot or s == slot for s in self.places[n].outputs):
                return self.freshness(n, {Ticket.XC, Ticket.XD, Ticket.XA})
        return 2, ()

    # What contexts ask.

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

    def __init__(self, layout: Layout, node: int):
        self._layout, self._node = layout, node

    def source(self, i: int) -> tuple[Any, int] | None:
        """The leaf system and the number of its output port that feed input port `i`; None if nothing does."""
        kind, n, j = self._layout.sources[self._node, i]
        return (self._layout.systems[n], j) if kind == "out" else None

    def given(self, i: int) -> Any:
        """What the leaf that feeds input port `i` has in these contexts otherwise than in new ones, or None."""
        kind, n, _ = self._layout.sources[self._node, i]
        return self._layout.given.get(n) if kind == "out" else None

    @property
    def root(self) -> Any:
        """The root system."""
        return self._layout.systems[0]


def _ints(values: Any) -> np.ndarray:
    return np.array(values, np.int64)


def _flat(lists: Iterable) -> list:
    return [x for v in lists for x in v]


def _pointers(lists: Iterable) -> np.ndarray:
    return np.cumsum([0] + [len(v) for v in lists], dtype=np.int64)


__all__ = ["LOG", "NO_ROW", "Callback", "Layout", "Place", "RootView", "Row", "Slot", "Span"]
