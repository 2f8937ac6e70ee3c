"""A diagram as data: what the event loop works on, with the source of all kernels that it calls."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._native.binding import Words, arguments
from sheldrake.common._native.compiler.module import text_of
from sheldrake.common._native.store import symbol_of
from sheldrake.common._text import untaken
from sheldrake.common.kernel import Kernel
from sheldrake.export._frozen import VERSION, FrozenDiagram
from sheldrake.export._image import Image
from sheldrake.export._kernels.outputs import refresh_outputs
from sheldrake.systems.framework import OutputPort
from sheldrake.systems.framework._declarations import KIND_NAMES, PUBLISH
from sheldrake.systems.framework._kernels import integrate as _integrate
from sheldrake.systems.framework._kernels import loop as _loop
from sheldrake.systems.framework._kernels.integrate import IntegratorNumbers
from sheldrake.systems.framework._kernels.program import NUM_SPECIAL, Log, RunWords, SideWords, Turn
from sheldrake.systems.primitives._log_files import log_title

if TYPE_CHECKING:
    from sheldrake.systems.analysis._simulator import Simulator
    from sheldrake.systems.framework._engine.layout import Row
    from sheldrake.systems.framework._system import System

_LOG_ROOM = 256
"""Samples that a log holds before who runs the diagram must take them out."""


def Freeze(simulator: Simulator, outputs: Iterable[OutputPort] = ()) -> FrozenDiagram:
    """The diagram of a simulator and its context, as they are now, in a form that leaves Python.

    What systems of the library and a user's kernels do can leave: plants, controllers, blocks, vector logs.
    What only publishes, such as a visualizer, is left out: it changes nothing. The simulator is initialized if it was
    not; it goes on as before.

    Args:
        simulator: Where it stands is where the frozen diagram begins.
        outputs: Vector output ports that can be asked for later; those that the diagram exports can be in any case.

    Raises:
        ValueError: something in the diagram is Python and cannot leave: each such system is named, with the way out.
        RuntimeError: the simulator has no context, or an input port has no value.
    """
    return Freezer(simulator, outputs).frozen()


class Freezer:
    """Collects what a frozen diagram is made of.

    Attributes:
        store: Memory of the simulator's context.
        image: The memory of the frozen diagram.
    """

    def __init__(self, simulator: Simulator, outputs: Iterable[OutputPort] = ()):
        if not simulator.has_context():
            raise RuntimeError("Freeze(): the simulator has no context; give it one with reset_context().")
        self.span = simulator._ready_span("Freeze")
        self.simulator, self.store, self.layout = simulator, self.span.store, self.span.layout
        self.root = simulator.get_system()
        self.left_out: list[str] = []
        self._output_elements: dict[str, list[str]] = {}
        self.outputs = self._wanted(outputs)
        self._refuse()
        self.image = Image()
        self.functions: list[dict[str, Any]] = []
        self._numbers: dict[int, int] = {}
        self._symbols: set[str] = set()
        self._kernels: list[Kernel] = []
        self.calls: dict[str, dict[str, Any]] = {}
        self._take_memory()
        self._take_calls()

    # What can leave.

    def path(self, system: System) -> str:
        """Names of the diagrams below the root that a system is in, and its own."""
        return self._paths.get(system._system_id) or plain_name(system.get_name())

    @cached_property
    def _paths(self) -> dict[int, str]:
        """Paths by id; what has no name of its own is called as its class, a second one of them "Adder 2"."""
        found = {self.root._system_id: ""}
        for diagram in self.store.systems:
            inside = found[diagram._system_id] + "/" if found[diagram._system_id] else ""
            taken: set[str] = set()
            for system in diagram._subsystems() or ():
                found[system._system_id] = inside + untaken(plain_name(system.get_name()), taken, "{} {}")
        return found

    def _refuse(self) -> None:
        """Says all that cannot leave.

        Raises:
            ValueError: something cannot.
        """
        faults = list(dict.fromkeys(self._faults()))
        if faults:
            raise ValueError("Freeze(): this diagram cannot leave Python.\n" + "\n".join(f"  - {f}" for f in faults))

    def _faults(self) -> Iterable[str]:
        layout, store = self.layout, self.store
        if store.scalar is not float:
            yield f"its context has numbers of type {store.scalar.__name__}; freeze one with floats."
        for n in layout.witness_nodes:
            yield f"{self._describe(n)} has witness functions, which are Python."
        numbers, num_xc = self.span.numbers, layout.xc[1] - layout.xc[0]
        if num_xc and numbers.scheme == _integrate.PYTHON:
            name = type(self.simulator.get_integrator()).__name__
            yield f"{name} is made in Python; take an explicit integrator, such as RungeKutta3Integrator."
        if self.simulator.get_monitor() is not None:
            yield "the simulator has a monitor, a Python function; clear_monitor() takes it away."
        for r in self._called():
            row = layout.rows[r]
            if row.node >= 0 and not row.native and not self._only_draws(r):
                yield (
                    f"{self._describe(row.node)}: its {self._what(row)} is Python; declare it with a @kernel "
                    "(the documentation's page 'Your own law' shows how), or leave the system out of this diagram."
                )

    def _describe(self, n: int) -> str:
        system = self.store.systems[n]
        return f"'{self.path(system)}' ({type(system).__module__}.{type(system).__qualname__})"

    def _what(self, row: Row) -> str:
        if row.output >= 0:
            return f"output port '{self.store.systems[row.node]._outputs[row.output].name}'"
        return KIND_NAMES[row.kind]

    def _only_draws(self, r: int) -> bool:
        """Whether a row is a publish of the library, such as a visualizer's: nobody sees it where the diagram goes."""
        row = self.layout.rows[r]
        return row.kind == PUBLISH and type(self.store.systems[row.node]).__module__.startswith("sheldrake.")

    def _called(self) -> list[int]:
        """Rows that the event loop calls, and those of the outputs that are wanted."""
        program = self.layout.program
        rows = {r for r in (*program.calls.tolist(), *program.prerequisites.tolist()) if r >= 0}
        for *_, row in self.outputs:
            rows.update(self.layout.pull_list(row) if row >= 0 else ())
        return sorted(rows)

    def _wanted(self, ports: Iterable[OutputPort]) -> list[tuple[str, int, int, int]]:
        """Output ports that can be asked for: name, begin in the slab, size, row."""
        found = {}
        exported = [self.root.get_output_port(j) for j in range(self.root.num_output_ports())]
        for port in (*exported, *ports):
            system = port.get_system()
            n = self.layout.node_of.get(system._system_id)
            if n is None:
                raise ValueError(f"Freeze(): the output port '{port.get_name()}' belongs to another diagram.")
            leaf, j, slot = self.layout.output_slot(n, int(port.get_index()))
            if slot.vector:
                name = port.get_name() if system is self.root else f"{self.path(system)}/{port.get_name()}"
                found[name] = name, slot.span[0], slot.span[1] - slot.span[0], slot.row
                self._output_elements[name] = self._output_names(leaf, j, slot.span[1] - slot.span[0])
            elif system is not self.root:
                raise ValueError(
                    f"Freeze(): the output port '{port.get_name()}' of {system._describe()} has abstract values; only "
                    "vectors can leave."
                )
        return list(found.values())

    # The memory.

    def _take_memory(self) -> None:
        store, image = self.store, self.image
        side, L = store.I.copy(), self._logs()
        side[self.layout.log0 : self.layout.fixed0] = self._log_table.reshape(-1)
        run = self.span.run.word.copy()
        run[: RunWords.budget.at] = 0  # the switches
        self._L = np.empty(len(L)) if store.L.size != L.size else store.L
        numbers = self.span.numbers.number
        self.places = {
            "slab": image.add(store.S),
            "side": image.add(store.I, side),
            "run": image.add(self.span.run.word, run),
            "integrator": image.add(numbers),
            "log": image.add(self._L, L),
        }
        self.program = self._program()
        self._table = np.zeros(len(self.layout.rows) + NUM_SPECIAL, np.int64)
        self.places["table"] = image.add(self._table)

    def _logs(self) -> np.ndarray:
        """Samples so far of all logs, with room behind each; notes where they are."""
        layout = self.layout
        old = self.store.I[layout.log0 : layout.fixed0].reshape(-1, 3)
        self._log_table = table = old.copy()
        parts, start = [], 0
        for s, (first, _, count) in enumerate(old.tolist()):
            width = int(layout.program.log[s, Log.length]) + 1
            room = count + _LOG_ROOM
            part = np.zeros(room * width)
            part[: count * width] = self.store.L[first : first + count * width]
            parts.append(part)
            table[s] = start, room, count
            start += part.size
        return np.concatenate([*parts, np.zeros(1)])

    def _program(self) -> Any:
        """The program without what draws, and with the words of the rows that are called alone."""
        program, layout = self.layout.program, self.layout
        drawn = {r for r in self._called() if not layout.rows[r].native and layout.rows[r].node >= 0}
        self.left_out = sorted({self.path(self.store.systems[layout.rows[r].node]) for r in drawn})
        acts = [
            [r for r in program.calls[a:b].tolist() if r not in drawn]
            for a, b in zip(program.calls_begin[:-1], program.calls_begin[1:])
        ]
        pres = [layout.prerequisites([r for r in rows if r < 0 or layout.rows[r].node >= 0]) for rows in acts]
        self.native = sorted(
            {r for rows in (*acts, *pres) for r in rows if r >= 0 and layout.rows[r].native}
            | {q for *_, r in self.outputs if r >= 0 for q in layout.pull_list(r)}
        )
        words, at = self._row_words()
        turns = [[turn for turn in of_kind if turn[0] not in drawn] for of_kind in layout.turns]
        ends = [np.cumsum([0, *map(len, lists)]).astype(np.int64) for lists in (acts, pres)]
        flat = [np.array([r for rows in lists for r in rows], np.int64) for lists in (acts, pres)]
        changed = program._replace(
            words=words.words,
            at=at,
            calls=flat[0],
            calls_begin=ends[0],
            prerequisites=flat[1],
            prerequisites_begin=ends[1],
            turn=np.array([turn for of_kind in turns for turn in of_kind], np.int64).reshape(-1, Turn.SIZE),
            turns_begin=np.cumsum([0, *map(len, turns)]).astype(np.int64),
        )
        self.image.add_words(words, known_as=words.words)
        return changed

    def _row_words(self) -> tuple[Words, np.ndarray]:
        """Arguments of the rows that are called, and where each row's begin."""
        given, at = self.layout.arguments, self.layout.program.at
        borders = np.unique(at)  # rows that do the same have the same words
        found, relocations, begin = [np.zeros(0, np.int64)], [], 0
        new = np.zeros_like(at)
        for r in self.native:
            first = int(at[r])
            last = int(borders[np.searchsorted(borders, first, side="right")])
            found.append(given.words[first:last])
            relocations += [x._replace(at=x.at - first + begin) for x in given.relocations if first <= x.at < last]
            new[r] = begin
            begin += last - first
        return Words(np.concatenate([*found, np.zeros(1, np.int64)]), tuple(relocations)), new

    # Kernels.

    def function(self, kernel: Kernel) -> int:
        """The number of a kernel among the functions of the frozen diagram."""
        if id(kernel) not in self._numbers:
            symbol, count = symbol_of(kernel), 1
            while symbol in self._symbols:  # the user has kernels of names that are the library's too
                count += 1
                symbol = f"{symbol_of(kernel)}_{count}"
            self._symbols.add(symbol)
            self._kernels.append(kernel)  # keeps its id
            self._numbers[id(kernel)] = len(self.functions)
            self.functions.append(
                {
                    "name": f"{kernel.__module__}.{kernel.__qualname__}",
                    "symbol": symbol,
                    "short_loops": kernel.short_loops,
                    "text": text_of(kernel, symbol),
                }
            )
        return self._numbers[id(kernel)]

    def add_call(self, name: str, kernel: Kernel, args: Sequence[Any]) -> None:
        """Has the frozen diagram call a kernel on arrays; those of this diagram are meant by themselves, or views."""
        words, scalars = arguments(kernel, tuple(args))
        self.calls[name] = {
            "function": self.function(kernel),
            "words": self.image.add_words(words) // 8,
            "numbers": {parameter: at for parameter, (at, _) in scalars.items()},
        }

    def _take_calls(self) -> None:
        self.rows = [-1] * len(self._table)
        for r in self.native:
            self.rows[r] = self.function(self.layout.rows[r].calc)
        span, store = self.span, self.store
        tables = (self.program, span.run, span.numbers, store.S, store.side, self._L, self._table, 0.0)
        self.add_call("advance", _loop.advance, tables)
        rows = sorted({q for *_, r in self.outputs if r >= 0 for q in self.layout.pull_list(r)})
        wanted = np.array(rows, np.int64)
        self.add_call("refresh_outputs", refresh_outputs, (self.program, store.S, store.side, self._table, wanted))

    # The description.

    def frozen(self) -> FrozenDiagram:
        """What has been collected."""
        word = {name: place // 8 for name, place in self.places.items()}
        layout = self.layout
        description = {
            "version": VERSION,
            "name": plain_name(self.root.get_name()),
            "functions": self.functions,
            "rows": self.rows,
            "row_names": [self._row_name(r) for r in range(len(layout.rows))],
            "calls": self.calls,
            "memory": {**word, "size": self.image.size // 8, "num_slab": layout.size},
            "words": {
                **{f: word["side"] + getattr(SideWords, f).at for f in ("constant", "status", "row", "terminate")},
                **{f: word["run"] + getattr(RunWords, f).at for f in ("budget", "steps", "fresh")},
                "t_break": word["integrator"] + IntegratorNumbers.t_break.at,
            },
            "states": self._states(),
            "parameters": self._parameters(),
            "inputs": self._inputs(),
            "outputs": [_vector(name, at, self._output_elements[name]) for name, at, _, _ in self.outputs],
            "logs": self._log_descriptions(),
            "left_out": self.left_out,
            "clocks": self._clocks(),
            "fixups": [[f.at, f.to, int(f.absolute)] for f in sorted(self.image.fixups)],
        }
        return FrozenDiagram(description, self.image.data())

    def _clocks(self) -> list[list[float]]:
        """First tick and period [s] of what happens periodically."""
        clocks = (self.program.clocks[c] for c in range(int(self.program.num_clocks)))
        return [[float(clock.offset), float(clock.period)] for clock in clocks]

    def _row_name(self, r: int) -> str:
        row = self.layout.rows[r]
        if r not in self.native:
            return ""
        return f"{self.path(self.store.systems[row.node])}: {self._what(row)} ({row.calc.__name__})"

    def _states(self) -> list[dict[str, Any]]:
        found = []
        for n in self.layout.leaves:
            system, place = self.store.systems[n], self.layout.places[n]
            for kind, (a, b) in (("continuous", place.xc), ("discrete", place.xd)):
                if b > a:
                    found.append(_vector(self.path(system), a, self._state_names(system, b - a), kind=kind))
        return found

    def _output_names(self, n: int, j: int, size: int) -> list[str]:
        """Names of the elements of a leaf's output port, as a log of it has them."""
        names = getattr(self.store.systems[n], "_output_names", None)
        found = list((names(j) if names is not None else None) or ())
        return found if len(found) == size else [f"y{i}" for i in range(size)]

    @staticmethod
    def _state_names(system: System, size: int) -> list[str]:
        names = list(system.GetStateNames()) if hasattr(system, "GetStateNames") else []
        return names if len(names) == size else [f"x{i}" for i in range(size)]

    def _parameters(self) -> list[dict[str, Any]]:
        found = []
        for n in self.layout.leaves:
            system = self.store.systems[n]
            known = system._parameter_names() if hasattr(system, "_parameter_names") else {}
            first, last = self.layout.places[n].parameters
            for i, (a, b) in enumerate(self.layout.parameter_groups[first:last]):
                title, numbers = known.get(i, (f"parameters {i}", []))
                name = f"{self.path(system)}/{title}"
                if b > a and len(numbers) == b - a:
                    elements = [number.partition(" [")[0] for number in numbers]
                    about = _vector(name, a, elements)
                    about["units"] = [number.partition(" [")[2].rstrip("]") for number in numbers]
                    found.append(about)
                elif b > a:
                    found.append(_vector(name, a, [f"p{k}" for k in range(b - a)]))
        return found

    def _inputs(self) -> list[dict[str, Any]]:
        """Input ports that nothing is connected to: fixed ones, and optional ones."""
        found = []
        for (n, i), k in self.layout.free.items():
            slot, system = self.layout.free_slots[k], self.store.systems[n]
            declared = system._inputs[i]
            if slot.span[1] > slot.span[0] and (declared.optional or self.store.I[self.layout.fixed0 + k]):
                name = declared.name if system is self.root else f"{self.path(system)}/{declared.name}"
                size = slot.span[1] - slot.span[0]
                found.append(_vector(name, slot.span[0], [f"u{k}" for k in range(size)]))
        return found

    def _log_descriptions(self) -> list[dict[str, Any]]:
        found, taken = [], set[str]()
        for s, (n, (a, b)) in enumerate(self.layout.logs):
            sink = self.store.systems[n]
            title = untaken(plain_name(log_title(sink, self.store.context(0))), taken, "{} ({})")
            names = sink.FindLog(self.store.context(0)).names()
            about = _vector(title, a, names if len(names) == b - a else [f"y{i}" for i in range(b - a)])
            about["table"] = self.places["side"] // 8 + self.layout.log0 + 3 * s
            found.append(about)
        return found


def plain_name(name: str) -> str:
    """A name; instead of one that a builder made up, `package.Adder@000000000000003b`, that of the class."""
    return re.sub(r"^(?:[\w.]+\.)?(\w+)(?:\[\w+\])?@[0-9a-f]{16}", r"\1", name)


def _vector(name: str, at: int, elements: list[str], **more: object) -> dict[str, Any]:
    """A vector in the slab, by its name and its elements'."""
    from sheldrake.systems.primitives._vector_log import quantity

    units = [quantity(element).unit for element in elements]
    return {"name": name, "at": at, "elements": elements, "units": units, **more}
