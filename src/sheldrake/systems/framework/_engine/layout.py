"""What is computed under a root system, its rows, and the Program of its event loop."""

from __future__ import annotations

import dataclasses
import itertools
import weakref
from collections.abc import Iterable, Iterator, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sheldrake.common._native.binding import HERE, Call, Words, check_record, join_in_slab
from sheldrake.common.kernel import Kernel, Parameter
from sheldrake.systems.framework._declarations import (
    DERIVATIVES,
    DISCRETE,
    OUTPUT,
    PUBLISH,
    UNRESTRICTED,
    Callback,
    EventDeclaration,
    FedStage,
    PythonStage,
    Stages,
)
from sheldrake.systems.framework._engine.alike import Family, Templates, family_of
from sheldrake.systems.framework._engine.freshness import Sources, freshness, level_of_needs
from sheldrake.systems.framework._engine.memory import Memory, Place, RootView, Slot, Span
from sheldrake.systems.framework._engine.scratch import places_of
from sheldrake.systems.framework._engine.topology import inputs_as, kernel_needs, tree_of
from sheldrake.systems.framework._index import Ticket
from sheldrake.systems.framework._kernels import program as _program

if TYPE_CHECKING:
    from sheldrake.systems.framework._system import System

NO_ROW = -(10**9)
"""Number of the row of an event without a handler."""

_FIRST_ROOM = 256
"""Samples for which an empty log has room."""

LOG = "log"
"""Handler of an event that appends the leaf's only input to its log."""

_CLOCK_OF = {"per_step": _program.PER_STEP, "initialization": _program.AT_START, "request": _program.AT_REQUEST}
_RANK_OF = {_program.AT_START: 0, _program.PER_STEP: 1}
"""In a system, what these trigger comes before what clocks do."""


_NOTHING: dict[str, Any] = {}
"""Of all rows that read nothing: a dict of its own for each is many objects that live long."""


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
    models: dict = dataclasses.field(default_factory=lambda: _NOTHING)
    """Constant arrays, by parameter name."""
    reads: dict[str, Slot] = dataclasses.field(default_factory=lambda: _NOTHING)
    """Inputs of another system that a kernel reads, by parameter name."""

    native: bool = dataclasses.field(init=False)
    """Whether a kernel computes it."""

    def __post_init__(self) -> None:
        self.native = isinstance(self.calc, Kernel)


class Act(NamedTuple):
    """What a leaf does: derivatives, or at an event."""

    node: int
    event: EventDeclaration | None
    stages: Sequence[Any]
    """What computes it, one after the other; nothing where an event is without a handler, or a log."""
    repeats: bool
    """Whether it does the same again while nothing changes."""


_OWN = frozenset({"systems", "structures", "stores", "prototypes", "_chosen", "rows", "_models", "_calls", "queried"})
"""Attributes of a layout that belong to its systems."""


class Layout(Memory):
    """The `rows` and the `program` of a root system, whose first rows are the output ports in order."""

    rows: list[Row]

    def __init__(
        self, root: System, overrides: frozenset[tuple[int, int]] = frozenset(), structures: dict | None = None
    ):
        self.systems = tree_of(root)
        self.structures = structures or {}
        self.stores = weakref.WeakSet()
        self.queried: dict[int, Any] = {}
        """By leaf, what it asks all contexts of this layout with."""
        family = Family() if structures else family_of(self.systems, overrides)
        if not (family.members and self._is_like(family)):
            self._build(root, overrides)
            family.keep(family.chosen_by(self._chosen, self.prototypes), self._in_common())
        self.node_of = {s._system_id: n for n, s in enumerate(self.systems)}
        self.version = sum(s._version for s in self.systems)
        self.blank: np.ndarray | None = None  # the slab of a new store, and what defaults are (see `Store`)
        self.defaults: tuple[int, np.ndarray] | None = None
        self.asked: dict[str, int] = {}  # how often roots were asked for what module `asked` can compute natively
        self.known_words: dict[str, list[int]] = {}  # of the program, as kernels of event loops are told where it is
        del self._chosen, self._models
        del self.systems  # a layout is owned by the root system: it must not own it in turn

    def _is_like(self, family: Family) -> bool:
        """Takes what it has in common with a layout of its family, if there is one for what its systems choose."""
        vars(self).update(next(iter(family.members.values())))  # where inputs are, all agree
        self._ask_systems()
        known = family.members.get(family.chosen_by(self._chosen, self.prototypes))
        if known is not None:
            vars(self).update(known)
            self.rows = [*self._output_rows(), *(row for act in self._chosen for row in self._rows_of(act))]
            self.rows += self._rows_of_witnesses()
            for row, free in zip(self.rows, self._free):
                if row.native:
                    row.free, row.models = free, self._needed_models(row)
        return known is not None

    def _in_common(self) -> dict[str, Any]:
        """Attributes that layouts of what is declared alike share."""
        return {name: value for name, value in vars(self).items() if name not in _OWN}

    def _ask_systems(self) -> None:
        """What leaves want in contexts of this root: their scratch, and what computes derivatives and events."""
        self._models: dict[int, dict] = {}
        self.prototypes = {n: self.systems[n]._scratch_in(RootView(self, n)) for n in self.leaves}
        self._chosen = [act for n in self.leaves for act in self._acts_of_leaf(n)]

    def _acts_of_leaf(self, n: int) -> Iterator[Act]:
        system, root = self.systems[n], RootView(self, n)
        if sum(system._xc_counts):
            calc = system._derivatives_calc()
            yield Act(n, None, calc.choose(system, root) if isinstance(calc, Stages) else [calc], False)
        chosen: dict[int, Act] = {}  # of the update that a clock asks for and the one that people do
        for event in system._all_events():
            handler = event.handler
            if not isinstance(handler, Stages):
                rows = [] if handler is None or handler == LOG else [handler]
                yield Act(n, event, rows, bool(rows) and system._scalar is float and _is_of_the_present(handler))
            elif id(handler) in chosen:
                yield chosen[id(handler)]._replace(event=event)
            else:
                stages = handler.choose(system, root)
                repeats = system._scalar is float and handler.repeat(stages)  # others have no bits to compare
                act = chosen[id(handler)] = Act(n, event, stages, repeats)
                yield act

    def _build(self, root: System, overrides: frozenset[tuple[int, int]]) -> None:
        """Finds places for everything, and what is computed when."""
        super().__init__(root, overrides)
        self._ask_systems()
        self._take_work()
        self.structured = [n for n in self.leaves if self.systems[n]._structured]
        self.rows = []
        self.logs: list[tuple[int, Span]] = []
        self.log_of: dict[int, int] = {}
        self._stages: dict[int, list[int]] = {}
        self._repeating: set[int] = set()  # rows of updates that do the same while nothing changes
        self._declared: dict[int, list[EventDeclaration]] = {}  # of each leaf that has events
        self._events: dict[tuple[int, str], list[tuple[int, int]]] = {}  # by kind and trigger: leaf and row of each
        self._events_under: dict[tuple[int, int, str], list[int]] = {}
        self._scratch: dict[int, dict[str, Any]] = {}  # of each node: where kernels find its parts
        self._add_rows()
        self._make_groups()  # adds the rows of witness functions
        self._free = [row.free for row in self.rows]
        self._calls = self._make_calls()
        self._stamps = self._levels()
        self._take_side()
        leaves = [(n, self.systems[n]) for n in self.leaves]
        self.with_abstract = [n for n, s in leaves if s._xa_models or s._pa_models]
        self.with_own_defaults = [n for n, s in leaves if s._sets_own_defaults()]
        self.made: dict[str, Any] = {}
        """What is made of all this when something asks for it first, by name."""
        self._templates = Templates()
        self._pulls: dict[int, list[int]] = {}
        self._derivatives: dict[int, tuple[list[int], Span]] = {}
        self._read_by_kernel: dict[int, list[int]] = {}
        self._sources: dict[int, Sources | None] = {}
        self._takes_all = [
            self.systems[n]._ports_are_lookups or Ticket.ALL_SOURCES in self.systems[n]._outputs[j].tickets
            for n, j in self.ports
        ]
        del self._declared

    def _shift(self, span: Span, by: int) -> Span:
        return span[0] + by, span[1] + by

    def _output_rows(self) -> list[Row]:
        return [
            Row(n, OUTPUT, self.systems[n]._outputs[j].calc, self.places[n].outputs[j].span, output=j)
            for n, j in self.ports
        ]

    def _rows_of(self, act: Act) -> list[Row]:
        """The rows that compute derivatives, or do what an event asks for."""
        n, event, stages, _ = act
        place = self.places[n]
        if event is None:
            kind, out = DERIVATIVES, self._shift(place.xc, self.xdot[0] - self.xc[0])
        else:
            kind = event.kind
            out = self._shift(place.xd, self.plus) if kind != PUBLISH else (0, 0)
        return [_stage_row(stage, n, kind, out, event) for stage in stages]

    def _rows_of_witnesses(self) -> list[Row]:
        return [Row(-1, kind, None, (0, 0)) for _, kind in self.witness_rows]

    def _add_rows(self) -> None:
        self.rows += self._output_rows()
        for act in self._chosen:
            n, event, _, repeats = act
            place, first, rows = self.places[n], len(self.rows), self._rows_of(act)
            self.rows += rows
            if event is None or isinstance(event.handler, Stages):
                self._stages[first] = [*range(first, len(self.rows))]
            if repeats:
                self._repeating.update(self.stages(first))
            if event is None:
                place.derivatives = first
            else:
                place.events.append(first if rows else self._log(n, place) if event.handler == LOG else NO_ROW)
                self._declared.setdefault(n, []).append(event)
                self._events.setdefault((event.kind, event.trigger), []).append((n, place.events[-1]))
        for row in self.rows:
            if row.native:
                row.free = self._required(row)
                row.models = self._needed_models(row)

    def _log(self, n: int, place: Place) -> int:
        if n not in self.log_of:
            self.log_of[n] = len(self.logs)
            self.logs.append((n, place.inputs[0].span))
        return -1 - self.log_of[n]

    def stages(self, row: int) -> list[int]:
        """The rows that make up an event's handler, of which `row` is the first."""
        return self._stages.get(row, [row])

    def acts(self, row: int) -> list[int]:
        """Those stages of a handler that are called each time, see `is_refreshed`."""
        return [r for r in self.stages(row) if not self.is_refreshed(r)]

    def is_refreshed(self, row: int) -> bool:
        """Whether a row is a Python stage that is called only when what it names has changed."""
        stage = self.rows[row].calc if row >= 0 else None  # that of a log
        return isinstance(stage, PythonStage) and stage.needs is not None

    def events_under(self, n: int, kind: int, trigger: str) -> list[int]:
        """Rows of all events of node `n` of a kind and trigger, in order; NO_ROW for those without a handler."""
        found = self._events_under.get((n, kind, trigger))
        if found is None:
            leaves = set(self.leaves[self.nodes[n].first_leaf : self.nodes[n].last_leaf])
            found = [row for leaf, row in self._events.get((kind, trigger), ()) if leaf in leaves]
            self._events_under[n, kind, trigger] = found
        return found

    def stages_before(self, row: int) -> list[int]:
        """The Python stages before a kernel row of the same handler."""
        found = []
        while row > 0 and isinstance(self.rows[row - 1].calc, PythonStage):
            row -= 1
            found.append(row)
        return found

    def span_of_fill(self, row: int) -> Span:
        """What a Python stage fills, in the slab."""
        stage, n = self.rows[row], self.rows[row].node
        if stage.calc.fills is None:
            return 0, 0
        field, part = stage.calc.fills
        prototype = self.prototypes[n]
        table = prototype._fields.index(field)
        place = places_of(self.places[n].work[0], prototype)[field][prototype[table]._fields.index(part)]
        return place[0], place[0] + int(np.prod(place[1:]))

    def _required(self, row: Row) -> tuple[int, ...]:
        others = tuple(s.free for s in row.reads.values() if s.free >= 0 and s.free not in self.optional_free)
        if "u" not in row.calc.names:
            return others
        inputs = zip(self.systems[row.node]._inputs, self.places[row.node].inputs)
        return (*others, *(s.free for d, s in inputs if s.free >= 0 and s.vector and not d.optional))

    def _needed_models(self, row: Row) -> dict:
        names = row.calc.model_names
        if not names:
            return {}
        models = self._models_of(row) | row.models if row.models else self._models_of(row)
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
        own = system._output_models.get(row.output)
        return self._models[n] if own is None else self._models[n] | own

    # The program.

    @cached_property
    def _calls(self) -> list[Call | None]:
        return self._make_calls()

    @cached_property
    def arguments(self) -> Words:
        """The words of all rows, for another process."""
        return join_in_slab(self._calls)[0]

    @cached_property
    def program(self) -> _program.Program:
        """What the event loop works on; contexts that are only asked for what plants compute need none."""
        words, begins = self._templates.placed(self.rows, lambda: join_in_slab(self._calls))
        at = _ints(begins + begins[-1:] * (len(self.rows) - len(begins) + _program.NUM_SPECIAL + 1))
        return _program.Program(words=words, at=at, **self._tables)

    @property
    def called(self) -> set[int]:
        """Rows that the event loop calls; what else there is is computed when somebody asks."""
        if "called" not in self.made:
            self.made["called"] = {*self._tables["calls"].tolist(), *self._tables["prerequisites"].tolist()}
        return self.made["called"]

    def calls_of_group(self, g: int) -> tuple[list[int], list[int]]:
        """The rows that group `g` calls, -1 being that of derivatives, and those that they need."""
        tables: Any = self._tables
        g %= len(self.group_list)
        begins = {name: tables[f"{name}_begin"] for name in ("calls", "prerequisites")}
        calls, needed = ([*tables[name][begin[g] : begin[g + 1]].tolist()] for name, begin in begins.items())
        return calls, needed

    @cached_property
    def first_logs(self) -> tuple[int, np.ndarray]:
        """Of logs that are empty: the size of their array, and start, room and number of samples of each."""
        widths = self._tables["log"][:, _program.Log.length] + 1
        ends = np.cumsum(_FIRST_ROOM * widths)
        table = np.stack((ends - _FIRST_ROOM * widths, np.full_like(ends, _FIRST_ROOM), np.zeros_like(ends)), axis=1)
        return int(_FIRST_ROOM * widths.sum()), table

    @cached_property
    def rows_that_need_inputs(self) -> tuple[list[Row], list[Row]]:
        """Rows that the event loop calls, and those of them that its publishes call, that need free inputs."""
        tables: Any = self._tables
        found: tuple[list[Row], list[Row]] = [], []
        if not any(self._free):
            return found
        for g, (kind, *_) in enumerate(self.group_list):
            for name in ("calls", "prerequisites"):
                begin = tables[f"{name}_begin"]
                rows = [self.rows[r] for r in tables[name][begin[g] : begin[g + 1]].tolist() if r >= 0]
                needing = [row for row in rows if row.free]
                found[0].extend(needing)
                found[1].extend(needing if kind == PUBLISH else ())
        return found

    @cached_property
    def words_of(self) -> list[int]:
        """Where the words of each row are, for direct calls."""
        address = HERE.place(self.program.words)
        return [address + 8 * at for at in self.program.at.tolist()]

    def _take_side(self) -> None:
        """Where the side has what the event loop keeps."""
        self.stamp0 = _program.SideWords.SIZE
        self.k0 = self.stamp0 + len(self.rows)
        self.trig0 = self.k0 + len(self.clocks)
        self.log0 = self.trig0 + len(self.group_list)
        self.fixed0 = self.log0 + 3 * len(self.logs)
        self.side_size = self.fixed0 + len(self.free_slots)

    @property
    def _tables(self) -> dict[str, np.ndarray]:
        """The program's tables; contexts in which nothing advances need none."""
        if "tables" not in self.made:
            self.made["tables"] = self._make_tables()
        return self.made["tables"]

    def _make_tables(self) -> dict[str, np.ndarray]:
        levels, calls = self._stamps, [rows for _, _, rows, _ in self.group_list]
        prerequisites = [self.prerequisites(rows) for rows in calls]
        segments = [self._segments(nodes, kind) for kind, _, _, nodes in self.group_list]
        S = _program.Sizes
        size = np.zeros(S.SIZE, np.int64)
        size[S.num_rows], size[S.num_groups], size[S.num_clocks] = len(self.rows), len(calls) - 1, len(self.clocks)
        size[S.stamps], size[S.ticks], size[S.triggers], size[S.samples] = self.stamp0, self.k0, self.trig0, self.log0
        size[S.xc], size[S.num_xc] = self.xc[0], self.xc[1] - self.xc[0]
        size[S.plus], size[S.xdot], size[S.x0] = self.plus, self.xdot[0], self.rk[0]
        size[S.derivatives], size[S.steady] = len(calls) - 1, all(levels[r] < 2 for r in calls[-1])
        return dict(
            level=_ints(levels),
            prerequisites=_ints(_flat(prerequisites)),
            prerequisites_begin=_pointers(prerequisites),
            calls=_ints(_flat(calls)),
            calls_begin=_pointers(calls),
            turn=_ints(_flat(self.turns)).reshape(-1, 3),
            turns_begin=_pointers(self.turns),
            segment=_ints(_flat(segments)).reshape(-1, 2),
            segments_begin=_pointers(segments),
            group=_ints([self._group(g, before, levels) for g, before in enumerate(prerequisites)]),
            clock=np.array(self.clocks, float).reshape(-1, 2),
            log=_ints([(a, b - a) for _, (a, b) in self.logs]).reshape(-1, 2),
            size=size,
        )

    def _make_groups(self) -> None:
        """What happens together: one group per kind and clock, in the order of the leaves; derivatives come last.

        `turns` has the rows of each kind in the order in which they are called when several groups are due.
        """
        clocks: dict[tuple[float, float], int] = {}
        groups: dict[tuple[int, int], tuple[list[int], set[int]]] = {}
        turns: list[list[tuple[int, tuple[int, int]]]] = [[], [], []]
        for clock in (_program.AT_START, _program.PER_STEP):
            for kind in (UNRESTRICTED, DISCRETE, PUBLISH):
                groups[kind, clock] = ([], set())
        self.witness_rows: dict[tuple[int, int], int] = {}  # behind all others
        for n in self.leaves:
            for kind, clock, rows in self._acts_of(n, clocks):
                own, nodes = groups.setdefault((kind, clock), ([], set()))
                own.extend(rows)
                nodes.add(n)
                turns[kind] += [(r, (kind, clock)) for r in rows]
        self.rows += self._rows_of_witnesses()
        self.witness_nodes = sorted({n for n, _ in self.witness_rows})
        self.clocks = list(clocks)
        self.shortest_period = min((period for _, period in clocks), default=np.inf)  # [s]
        self.group_list = [(kind, clock, rows, nodes) for (kind, clock), (rows, nodes) in groups.items() if nodes]
        self.requests = [g for g, (_, clock, *_) in enumerate(self.group_list) if clock == _program.AT_REQUEST]
        updates = {n for *_, clock, _, nodes in self.group_list if clock == _program.AT_REQUEST for n in nodes}
        asked = [n for n in self.leaves if self.systems[n]._may_ask()]
        self.may_ask = sorted(asked, key=updates.__contains__)  # what wakes others comes first
        self.updates_at_start = any(k != PUBLISH and c == _program.AT_START for k, c, *_ in self.group_list)
        number = {(kind, clock): g for g, (kind, clock, *_) in enumerate(self.group_list)}
        self.turns = [[(r, number[group], self._reads_slab(r)) for r, group in rows] for rows in turns]
        derivatives = [r for p in self.places if p.derivatives >= 0 for r in self.acts(p.derivatives)]
        self.group_list.append((DERIVATIVES, -9, derivatives, set()))

    def _acts_of(self, n: int, clocks: dict[tuple[float, float], int]) -> list[tuple[int, int, list[int]]]:
        """Kind, clock and rows of all events of a leaf but the forced ones, in the order in which they happen.

        Args:
            n: Its node.
            clocks: Numbers of clocks by offset and period, to which new ones are added.
        """
        found = []
        for event, row in zip(self._declared.get(n, ()), self.places[n].events):
            clock = _CLOCK_OF.get(event.trigger, 0)
            if event.trigger == "periodic":
                clock = clocks.setdefault((event.offset, event.period), len(clocks))
            if event.trigger != "forced":
                found.append((event.kind, clock, self.acts(row) if row != NO_ROW else []))
        if len(found) > 1:
            found.sort(key=lambda act: _RANK_OF.get(act[1], len(_RANK_OF)))
        if self.systems[n]._has_witnesses():
            for kind in (UNRESTRICTED, DISCRETE, PUBLISH):
                row = self.witness_rows[n, kind] = len(self.rows) + len(self.witness_rows)
                found.append((kind, _program.AT_WITNESS, [row]))
        return found

    def _reads_slab(self, r: int) -> bool:
        return r < 0 or self.rows[r].native

    def _group(self, g: int, before: list[int], levels: list[int]) -> tuple[int, ...]:
        """The row of group `g`, which calls its rows, and `before` them others if they are not up to date."""
        kind, clock, rows, _ = self.group_list[g]
        python = [k for k, r in enumerate(rows) if not self._reads_slab(r)]
        mixed = bool(python) and any(map(self._reads_slab, rows[python[0] :]))
        calls_python = bool(python) or not all(map(self._reads_slab, before))
        return kind, clock, calls_python, mixed, self._repeats(g, before, levels)

    def _repeats(self, g: int, before: list[int], levels: list[int]) -> bool:
        """Whether group `g` is updates whose state, parameters and sampled inputs alone say what they do."""
        kind, _, rows, _ = self.group_list[g]
        if kind not in (UNRESTRICTED, DISCRETE) or not rows or self.xc[1] > self.xc[0] or g >= _program.MOST_RESTING:
            return False
        return all(r in self._repeating for r in rows) and all(levels[r] < _program.CONTINUOUS for r in before)

    def _segments(self, nodes: set[int], kind: int) -> list[tuple[int, int]]:
        if kind not in (DISCRETE, UNRESTRICTED):
            return []
        spans = [self.places[n].xd for n in nodes]
        if kind == UNRESTRICTED:
            spans += [self.places[n].xc for n in nodes]
        return sorted((a, b - a) for a, b in spans if b > a)

    def _make_calls(self) -> list[Call | None]:
        """Kernel and arguments of each native row, one object for rows that do the same at different events."""
        calls: list[Call | None] = []
        made: dict[tuple, Call] = {}
        for row in self.rows:
            if not row.native:
                calls.append(None)
                continue
            reads = tuple((name, slot.span) for name, slot in row.reads.items()) if row.reads else ()
            key = row.node, row.calc, row.out, reads, *row.models, *map(id, row.models.values())
            call = made.get(key)
            if call is None:
                call = made[key] = row.calc, self._arguments_of(row)
            calls.append(call)
        return calls

    def _arguments_of(self, row: Row) -> dict[str, Any]:
        """Arguments of a kernel row: offsets into the slab, models elsewhere."""
        place, found = self.places[row.node], {}
        scratch = self._scratch.get(row.node)
        if scratch is None:
            scratch = self._scratch[row.node] = places_of(place.work[0], self.prototypes[row.node])
        last = row.calc.parameters[-1].name
        for parameter in row.calc.parameters:
            name = parameter.name
            if name in scratch and (name != "work" or parameter.kind == "tuple"):
                found[name] = scratch[name]
            elif name in row.models:
                _require_model_name(row.calc, parameter)
                found[name] = row.models[name]
            elif name in row.reads:
                found[name] = _place(parameter, row.reads[name].span)
            elif name == last:
                found[name] = _place(parameter, row.out)
            elif name == "u":
                inputs = [(slot.span[0], slot.span[1] - slot.span[0]) for slot in place.inputs]
                found[name] = inputs_as(parameter, row.calc, place.inputs, inputs)
            elif name in ("xc", "xd", "p", "work"):
                found[name] = _place(parameter, getattr(place, name))
            elif parameter.kind != "t":
                raise TypeError(
                    f"{row.calc!r}: parameter {name!r} is none of t, xc, xd, p, u, work, model, *_model, not a part of "
                    f"the scratch ({', '.join(scratch)}), and not the last, which is filled."
                )
            if parameter.kind == "record" and name not in row.models:
                check_record(row.calc, parameter, found[name])
        return found

    def prerequisites(self, rows: list[int]) -> list[int]:
        """Rows to bring up to date before a group acts, in topological order: outputs, then Python stages.

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
                needed.update(self.upstream([slot.row for slot in row.reads.values()]))
                needed.update(q for q in self.stages_before(r) if self.is_refreshed(q))
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

    def read_by_kernel(self, r: int) -> list[int]:
        """The output rows that row `r` reads, if a kernel computes it."""
        if r not in self._read_by_kernel:
            row = self.rows[r]
            slots = list(row.reads.values())
            if row.native and "u" in row.calc.names:
                slots += [slot for slot in self.places[row.node].inputs if slot.vector]
            self._read_by_kernel[r] = [slot.row for slot in slots if slot.row >= 0]
        return self._read_by_kernel[r]

    def derivative_rows(self, n: int) -> tuple[list[int], Span]:
        """The rows of the derivatives of all leaves under node `n`, in order, and where these are."""
        if n not in self._derivatives:
            leaves = self.leaves[self.nodes[n].first_leaf : self.nodes[n].last_leaf]
            rows = [r for m in leaves if (r := self.places[m].derivatives) >= 0]
            self._derivatives[n] = rows, self._shift(self.places[n].xc, self.xdot[0] - self.xc[0])
        return self._derivatives[n]

    def sources_named_by(self, r: int) -> Sources | None:
        """What output row `r` is computed from, if it is a function that names that; None if it takes everything."""
        if r not in self._sources:
            found = None
            if r < len(self.ports):
                (n, j), row = self.ports[r], self.rows[r]
                if isinstance(row.calc, Callback) and not self._takes_all[r]:
                    found = freshness(self, n, self.needs[n, j])
            self._sources[r] = found
        return self._sources[r]

    def _levels(self) -> list[int]:
        """How often the values of each row can change at most; what updates and publishes do has no such level."""
        level: list[int] = []
        known: dict[tuple[int, int], int] = {}
        for n, j in self.ports:
            key = n, id(self.needs[n, j])  # of ports that need the same, one set
            if key not in known:
                known[key] = level_of_needs(self, n, self.needs[n, j], level)
            level.append(known[key])
        outputs = level.copy()
        for row in self.rows[len(outputs) :]:
            if isinstance(row.calc, PythonStage) and row.calc.needs is not None:
                level.append(level_of_needs(self, row.node, set(row.calc.needs), outputs))
            elif row.kind == DERIVATIVES and row.native:
                level.append(level_of_needs(self, row.node, kernel_needs(self.systems[row.node], row.calc), outputs))
            else:
                level.append(2)
        return level


def _stage_row(
    stage: Callback | Kernel | PythonStage | FedStage,
    n: int,
    kind: int,
    out: Span,
    event: EventDeclaration | None = None,
) -> Row:
    """The row of a stage: a kernel, a PythonStage, a FedStage, or the callback that stands for all stages."""
    if isinstance(stage, FedStage):
        return Row(n, kind, stage.kernel, out, event=event, models=stage.models, reads=stage.reads)
    if isinstance(stage, Callback) and event is not None and event.handler is not stage:
        event = dataclasses.replace(event, handler=stage)
    return Row(n, kind, stage, out, event=event)


def _is_of_the_present(handler: Any) -> bool:
    """Whether it is a kernel that knows neither time nor continuous state nor a scratch."""
    if not isinstance(handler, Kernel):
        return False
    *given, _ = handler.names
    return all(name in ("xd", "p", "u", "model") or name.endswith("_model") for name in given)


def _require_model_name(kernel: Kernel, parameter: Parameter) -> None:
    """A kernel is compiled to look for other arrays in the slab: it would read whatever is at this address from there.

    Raises:
        TypeError: constant arrays for a parameter that is no model by its name.
    """
    if parameter.fields and not parameter.fields[0].absolute:
        name = parameter.name
        raise TypeError(
            f"{kernel!r}: parameter {name!r} is given constant arrays. Kernels find these only under the names model "
            f"and *_model: rename it to '{name}_model', there and where its arrays are given."
        )


def _place(parameter: Parameter, span: Span) -> list[Any] | tuple[int, int]:
    """Where an array or a table of one array is."""
    place = span[0], span[1] - span[0]
    return [place] if parameter.kind == "tuple" else place


def _ints(values: Sequence[int] | Sequence[tuple[int, ...]]) -> np.ndarray:
    return np.array(values, np.int64)


def _flat(lists: Iterable) -> list:
    return [x for v in lists for x in v]


def _pointers(lists: Iterable) -> np.ndarray:
    return _ints([*itertools.accumulate(map(len, lists), initial=0)])
