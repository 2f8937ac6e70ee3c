"""All that changes under one root context: numbers in a slab, abstract values beside it, and which are up to date."""

from __future__ import annotations

import ctypes
import threading
import weakref
from collections import defaultdict
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sheldrake.common._native.binding import HERE
from sheldrake.common._scalars import autodiff_class
from sheldrake.common.kernel import Parameter, jit_enabled
from sheldrake.common.value import AbstractValue
from sheldrake.systems.framework._engine import python_rows
from sheldrake.systems.framework._engine.layout import Layout, Row
from sheldrake.systems.framework._engine.scratch import LARGE, are_same, copy_of, views_of, write_prototype
from sheldrake.systems.framework._engine.topology import inputs_as
from sheldrake.systems.framework._engine.waiting import Waiting
from sheldrake.systems.framework._event import EventStatus
from sheldrake.systems.framework._kernels.program import Side
from sheldrake.systems.framework._vector import BasicVector, lifted

if TYPE_CHECKING:
    from sheldrake.systems.framework._context.context import Context
    from sheldrake.systems.framework._engine.freshness import Sources
    from sheldrake.systems.framework._engine.memory import Place, Slot
    from sheldrake.systems.framework._system import System

CONSTANT, SAMPLED, CONTINUOUS = 0, 1, 2
_BESIDES_CONTINUOUS = ((0, 1), (1,), ())
"""Counters that grow, beside that of what is continuous, when a source of a level is written."""
FAILED = -1000
"""Status of a Python row that raised, or reported failure."""
_NEW = 3
"""In a room: writes of the leaf's state by kernels that Python called, since somebody looked; before them, all of their
changes of each level. What follows is the leaf's own."""
_KEPT = ("uncached", "frozen", "stopped", "goes_on")
"""What a context is told stays so when its memory moves."""


class Store:
    """The memory of a root context.

    It belongs to one thread at a time, and stays where it is while something is computed in it (`enter`, `leave`):
    what would move it waits (`waiting`) until `settle` is called when nothing is.

    Attributes:
        S: the slab; `S[0]` is time [s].
        I: counters, stamps, clocks, log tables (see `_kernels.program`).
        L: logs (see `logs`).
        abstract, parameters: abstract states and parameters of all leaves.
        fixed: fixed abstract inputs, by free number.
        values: abstract output values, by row.
        stopped: where the last `AdvanceTo` stopped: time [s], integrator, what that remembers.
        goes_on: the same, read from a file: a simulator goes on from there and does not initialize.
        waiting: what moves memory once nothing is computed in it; `unsettled` says that there is something.
    """

    unsettled = False
    running: Any = None
    """Settings of the simulator that takes steps in this memory now."""
    at_hand: dict[int, tuple[bool, Callable[[], Any]]] | None = None
    """Of output rows that Python asks for while a simulator takes steps: whether a kernel computes it, and a call of it
    without arguments. The event loop has them, so that contexts are not kept by their memory."""
    busy = 0
    """How many computations are under way, one inside the other."""
    claimed = False
    """Whether a simulator works on it: other threads must not write."""
    world = -1
    """Number among many worlds in one memory (see `worlds`), which stays where it is for good; -1: it is alone."""

    def __init__(self, layout: Layout, systems: list[Any], scalar: Any = float):
        self.layout, self.systems, self.scalar = layout, systems, scalar
        dtype = float if scalar is float else object
        self.S = self._first_slab() if layout.blank is None else copy_of(layout.blank)
        self.I = np.zeros(layout.side_size, np.int64)
        self.I[: CONTINUOUS + 1] = 1
        self.L = np.empty(0, dtype)
        self.accuracy: float | None = None
        self.abstract: list[AbstractValue] = []
        self.parameters: list[AbstractValue] = []
        for n in layout.with_abstract:
            self.abstract += [v.Clone() for v in systems[n]._xa_models]
            self.parameters += [v.Clone() for v in systems[n]._pa_models]
        self.fixed: dict[int, Any] = {}
        self.values: dict[int, AbstractValue] = {}
        self._use_locks()
        self._begin()
        self._cold.update(r for r, (n, j) in enumerate(layout.ports) if not systems[n]._outputs[j].cached)

    def _first_slab(self) -> np.ndarray:
        """Outputs and optional inputs as they were declared, and scratch; a layout keeps them for its next stores."""
        S, places = self._slab_of_scratch(), self.layout.places
        for n, j in self.layout.ports:
            model, (a, b) = self.systems[n]._outputs[j].model, places[n].outputs[j].span
            if b > a and isinstance(model, BasicVector) and (model._v.dtype != float or model._v.view(np.int64).any()):
                S[a:b] = lifted(model._v, self.scalar)
        for n in self.layout.leaves:
            for declared, slot in zip(self.systems[n]._inputs, places[n].inputs):
                if declared.optional and slot.free >= 0 and slot.vector:
                    S[slice(*slot.span)] = lifted(declared.model._v, self.scalar)
        self.layout.blank = copy_of(S)  # of objects too: numbers are never changed in place
        return S

    def _slab_of_scratch(self) -> np.ndarray:
        """Scratch as its prototypes are, zeros elsewhere; layouts that are alike keep it for each other."""
        layout, made = self.layout, self.layout.made
        prototypes = list(layout.prototypes.values())
        known = made.get("scratch")
        if known is not None and all(map(are_same, known[0], prototypes)):
            return known[1].copy()
        S = lifted(np.zeros(layout.size), self.scalar)
        for n, prototype in layout.prototypes.items():
            write_prototype(prototype, S[slice(*layout.places[n].work)])
        if layout.size < LARGE:
            made["scratch"] = prototypes, S.copy()
        return S

    def _use_locks(self) -> None:
        self.waiting = Waiting()
        self.lock = threading.RLock()  # held by the thread that computes
        self.moving = threading.Lock()  # held while what readers of logs look at is exchanged

    def _begin(self) -> None:
        """What is rebuilt for every store, clones too."""
        self.layout.stores.add(self)
        self.side: Any = Side(self.I)
        self.i: Any = memoryview(self.I)  # type: ignore[arg-type]
        self.native = self.S.dtype == float and jit_enabled()  # whether kernels run as machine code on this slab
        self._slab_address = HERE.place(self.S)
        self.uncached = self.frozen = False
        self.cache: dict[tuple[int | str, int], Any] = {}
        self.serials: defaultdict[Any, int] = defaultdict(int)
        self.computed_from: dict[int, tuple] = {}  # stamps of output rows that name their sources
        self.mine = [0, 0, 0]  # how many of the changes in I are from Python; those of its kernels say `rooms`
        self.rooms: dict[int, np.ndarray] = {}  # by leaf, what queries from Python leave for each other
        self.contexts: dict[int, weakref.ref[Any]] = {}
        self.targets: dict[Any, Any] = {}  # what rows that are Python functions fill
        self.python_arguments: dict[int, tuple] = {}
        self.chains: dict[Any, Any] = {}  # of kernels on complex numbers, by their first row
        self.left: dict[int, Any] = {}  # the chain that knows a leaf's scratch, by leaf
        self.pending: dict[int, list[AbstractValue]] = {}
        self.views: dict[int, Any] = {}  # what leaves keep of their contexts, by node
        self._scratch: dict[int, tuple[np.ndarray, Any, Any]] = {}  # of leaves: views, and of what they are
        self.outcome: EventStatus | None = None
        self._cold: set[int] = set()
        self.stopped: tuple[float, str, list] | None = None
        self.goes_on: tuple[float, str, list] | None = None

    # Who computes.

    def enter(self) -> None:
        """Something is computed from now on: memory stays where it is until `leave`.

        Raises:
            RuntimeError: another thread computes something in this context.
        """
        if not self.lock.acquire(blocking=False):
            raise self._taken()
        self.busy += 1

    def leave(self) -> None:
        """Ends what `enter` began."""
        self.busy -= 1
        self.lock.release()

    def claim(self, call: str) -> None:
        """A simulator works on this memory from now on until `release`.

        Raises:
            RuntimeError: one does already, or another thread computes something in this context.
        """
        if not self.lock.acquire(blocking=False):
            raise self._taken(f"{call}: ")
        if self.claimed or self.busy:
            self.lock.release()
            raise RuntimeError(
                f"{call}: this context is being advanced or computed already, and this call comes from one of its "
                "callbacks; make it when that has returned, or work on a copy of the context (Clone())."
            )
        self.claimed = True

    def release(self) -> None:
        """Ends what `claim` began."""
        self.claimed = False
        self.lock.release()

    def check_thread(self) -> None:
        """Whether this thread may write now.

        Raises:
            RuntimeError: another thread advances this context.
        """
        if self.claimed and not self.lock._is_owned():  # type: ignore[attr-defined]
            raise self._taken()

    def _taken(self, call: str = "") -> RuntimeError:
        return RuntimeError(
            f"{call}another thread is using this Context of {self.systems[0]._describe()}. A context is for one thread "
            "at a time: wait for the other, or give each thread a copy (Context.Clone())."
        )

    # Changes.

    def touch(self, level: int, source: object) -> None:
        """A source of this level was written from Python."""
        if self.claimed:
            self.check_thread()
        i, mine = self.i, self.mine
        for k in _BESIDES_CONTINUOUS[level]:
            i[k] += 1
            mine[k] += 1
        i[CONTINUOUS] += 1
        mine[CONTINUOUS] += 1
        self.serials[source] += 1

    def out_of_date(self) -> None:
        """All computed values become out of date."""
        self.touch(CONSTANT, "all")

    def stamp(self, sources: Sources) -> tuple:
        """Changes whenever one of the sources does."""
        rooms = self.rooms
        for n, room in rooms.items():
            if room[_NEW]:
                self.serials[state_source(self.layout.places[n], n)] += int(room[_NEW])
                room[_NEW] = 0
        if self.scalar is float:
            numbers = [self.S[a:b].tobytes() for a, b in sources.places]
            level, keys = sources.other_level, sources.other_keys
        else:
            numbers, level, keys = [], sources.level, sources.keys
        get = self.serials.get
        by_loop = self.i[level] - self.mine[level] - sum([int(room[level]) for room in rooms.values()]) if level else 0
        return (by_loop, *numbers, *[get(key, 0) for key in keys])

    def fix(self, n: int, i: int, value: np.ndarray | AbstractValue, anew: bool = False) -> None:
        """Fixes an input port; a connected one gets memory of its own, as soon as memory may move.

        Args:
            n: Its node.
            i: Its number.
            value: An array, or an AbstractValue, that fits; it is not copied.
            anew: The layout changes for other reasons too.
        """
        if self.claimed:
            self.check_thread()
        if anew or self.layout.resolve_fixed(n, i) is None:
            self.waiting.inputs[n, i] = value
            self.wait()
            self.forget_readers()
            self.settle()
            return
        slot = self.layout.free_slots[self.layout.free[n, i]]
        if slot.vector:
            self.S[slice(*slot.span)] = value
        else:
            self.fixed[slot.free] = value
        self.i[self.layout.fixed0 + slot.free] = 1
        self.touch(CONSTANT, ("fixed", slot.free))

    def late_input(self, n: int, i: int) -> np.ndarray | AbstractValue | None:
        """What input port `i` of node `n` will be fixed to when memory may move, or None."""
        if not self.waiting.inputs:
            return None
        layout = self.systems[0]._layout_with(self.layout.overrides | set(self.waiting.inputs), self.layout.structures)
        slot = layout.input_slot(n, i)
        return next((self.waiting.inputs.get(p) for p, number in layout.free.items() if number == slot.free), None)

    def restructure(self) -> None:
        """A system changed what its `_structure_in` says, or itself. The layout follows before anything is computed."""
        self.waiting.structure = True
        self.wait()

    def wait(self) -> None:
        """There is something in `waiting`: it is carried out before the next computation, or step, begins."""
        if not self.unsettled:
            self.unsettled = True
            self.forget_readers()
        if self.running is not None:
            self.running.budget = 1  # the simulator takes one step at most before it looks

    def settle(self) -> None:
        """Carries out what waits, the one place where memory moves; not while something is computed in it."""
        if self.busy:
            return
        if not self.lock.acquire(blocking=False):
            raise self._taken()
        try:
            waiting, self.waiting, self.unsettled = self.waiting, Waiting(), False
            if waiting.inputs:
                self._move_to(
                    self.systems[0]._layout_with(self.layout.overrides | set(waiting.inputs), self._structures())
                )
                for (n, i), value in waiting.inputs.items():
                    self.fix(n, i, value)
                self.out_of_date()
            elif waiting.structure and ((structures := self._structures()) != self.layout.structures or self._is_old()):
                self._move_to(self.systems[0]._layout_with(self.layout.overrides, structures))
                self.out_of_date()
            waiting.move_logs(self)
        finally:
            self.lock.release()

    def _structures(self) -> dict[int, Any]:
        """What systems say of this context that the layout must know."""
        found = {n: self.systems[n]._structure_in(self.context(n)) for n in self.layout.structured}
        return {n: structure for n, structure in found.items() if structure is not None}

    def _is_old(self) -> bool:
        """Whether a system has changed since the layout was made."""
        return self.layout.version != sum(s._version for s in self.systems)

    def _move_to(self, new: Layout) -> None:
        """Other memory with the same values.

        Raises:
            RuntimeError: this is one of many worlds, which share a layout.
        """
        assert not self.busy, "memory must not move while something is computed in it"
        if self.world >= 0:
            raise RuntimeError(
                f"World {self.world} of a batch cannot have geometry, or a fixed value for a connected input port, "
                "that the others have not: all worlds have one layout. Change the context that BatchSimulator is given."
            )
        for n in list(self.left):
            self.leave_scratch(n)
        old = self.layout
        store = Store(new, self.systems, self.scalar)
        state = slice(0, old.p[1])
        store.S[state] = self.S[state]
        for m in old.leaves:
            if new.prototypes[m] is old.prototypes[m] or isinstance(new.prototypes[m], int):
                store.S[slice(*new.places[m].work)] = self.S[slice(*old.places[m].work)]
            else:
                self.systems[m]._carry_scratch(self.scratch(m), store.scratch(m))
        for port, k in old.free.items():
            if port in new.free:
                j = new.free[port]
                store.I[new.fixed0 + j] = self.I[old.fixed0 + k]
                store.S[slice(*new.free_slots[j].span)] = self.S[slice(*old.free_slots[k].span)]
                if k in self.fixed:
                    store.fixed[j] = self.fixed[k]
        store.I[: new.stamp0] = self.I[: old.stamp0]
        store.I[new.k0 : new.fixed0] = self.I[old.k0 : old.fixed0]
        cold = {new.row_of[old.ports[r]] for r in self._cold}
        contexts, kept = self.contexts, {name: getattr(self, name) for name in _KEPT}
        with self.moving:
            self.layout, self.S, self.I, self.fixed, self.values = new, store.S, store.I, store.fixed, {}
            self._begin()
        self.__dict__.update(kept)
        self._cold = cold
        self.contexts = contexts
        for context in self._living_contexts():
            context._place, context._kept = new.places[context._node], None
            context._discrete = context._continuous = context._state = context._numeric = context._parameters = None
        self.forget_readers()

    # Computing.

    def pull(self, r: int) -> None:
        """Brings output row `r` up to date; who asks has settled before looking it up."""
        i, layout = self.i, self.layout
        stamp0, level = layout.stamp0, layout._stamps
        if i[stamp0 + r] != i[level[r]] or ((self.uncached or r in self._cold) and not self.frozen):
            self._update(r)

    def forget(self, r: int) -> None:
        """Has row `r` computed anew if it is in Python, which may read what no context knows of."""
        if r >= 0 and not self.layout.rows[r].native and not self.frozen:
            self.i[self.layout.stamp0 + r] = -1
            self.computed_from.pop(r, None)

    def _update(self, r: int) -> None:
        """Computes what output row `r` needs and is out of date, and `r`, which is."""
        i, layout = self.i, self.layout
        stamp0, level = layout.stamp0, layout._stamps
        if self.frozen:
            raise RuntimeError(
                f"Cache is frozen: the value of {self._row_name(r)} is out of date and may not be computed."
            )
        if not self.lock.acquire(False):  # `enter`, written out: this is called often
            raise self._taken()
        self.busy += 1
        try:
            at_hand = self.at_hand
            for k in layout._pulls.get(r) or layout.pull_list(r):
                if i[stamp0 + k] != i[level[k]] or self.uncached or k in self._cold:
                    if at_hand is None:
                        self.compute(k)
                    else:
                        native, call = at_hand.get(k) or self._take_in_hand(k)
                        status = call()
                        if native and status:
                            raise self.explain(layout.rows[k], status)
                    i[stamp0 + k] = i[level[k]]
        finally:
            self.busy -= 1
            self.lock.release()

    def _take_in_hand(self, r: int) -> tuple[bool, Callable[[], Any]]:
        """Makes a call of output row `r` for `at_hand`."""
        row = self.layout.rows[r]
        call: Callable[[], Any]
        if not row.native:
            call = python_rows.bound(self, r)
        elif row.free:
            call = partial(self.compute, r)
        elif self.native and row.calc.parameters[0].kind != "t":
            where = self._slab_address, self.layout.words_of[r]
            call = partial(row.calc.function, ctypes.c_double(0.0), *map(ctypes.c_void_p, where))
        else:
            call = partial(self._call_kernel, r, row)
        known: Any = self.at_hand
        known[r] = found = row.native and not row.free, call
        return found

    def reader(self, slot: Slot) -> Callable[[], Any] | None:
        """A function that brings a port up to date and gives its value; None where `pull` has more to look at.

        Of a vector it gives a copy, of another value the object that the port carries.
        """
        r, layout = slot.row, self.layout
        if self.uncached or self.unsettled or r in self._cold or (r < 0 and not slot.vector):
            return None
        copy: Any = self.S[slot.span[0] : slot.span[1]].copy if slot.vector else self.output_value(r).get_value
        if r < 0:
            return copy
        i, update, stamp, level = self.i, self._update, layout.stamp0 + r, layout._stamps[r]

        def read() -> np.ndarray:
            if i[stamp] != i[level]:
                update(r)
            return copy()

        return read

    def forget_readers(self) -> None:
        """Contexts look up their ports anew."""
        for context in self._living_contexts():
            context._reads.clear()

    def _living_contexts(self) -> list[Context]:
        return [context for known in self.contexts.values() if (context := known()) is not None]

    def _row_name(self, r: int) -> str:
        row = self.layout.rows[r]
        system = self.systems[row.node]
        name = f" ({system._outputs[row.output].name})" if row.output >= 0 else ""
        return f"OutputPort[{row.output}]{name} of {system._describe()}"

    def compute(self, r: int) -> Any:
        """Computes row `r` now, whatever its stamp says; what it needs must be up to date."""
        row = self.layout.rows[r]
        if not row.native:
            return python_rows.call(self, r, row)
        if row.free:
            self.check_inputs(row)
        if status := self._call_kernel(r, row):
            raise self.explain(row, status)
        return None

    def check_inputs(self, row: Row) -> None:
        """A kernel sees all inputs: each must have a value.

        Raises:
            RuntimeError: one has none, naming it.
        """
        for free in row.free:
            if not self.i[self.layout.fixed0 + free]:
                n, k = next(key for key, number in self.layout.free.items() if number == free)
                i = next((i for i, s in enumerate(self.layout.places[row.node].inputs) if s.free == free), None)
                if i is None:  # of another system, whose place the kernel takes
                    raise not_connected(self.systems[n], k)
                raise not_connected(self.systems[row.node], i, None if n == row.node else (self.systems[n], k))

    def explain(self, row: Row, status: int) -> BaseException:
        """The error that a kernel's status stands for."""
        system = self.systems[row.node]
        return system._explain_status(status, self.context(row.node))

    def _call_kernel(self, r: int, row: Row) -> int:
        if self.native:
            return row.calc.function(self.S[0], self._slab_address, self.layout.words_of[r])
        if self.left:
            self.leave_scratch(row.node)
        arguments = self.python_arguments.get(r)
        if arguments is None:
            arguments = self.python_arguments[r] = self.arguments_of(row, self.S, self.scratch(row.node))
        status = row.calc(*(self.S[0] if a is None else a for a in arguments)) or 0
        if self.scalar is not float:
            written = self.S[slice(*row.out)]
            for k, number in enumerate(written):
                if type(number) is not self.scalar:  # what the kernel took from its model as it was
                    written[k] = self.scalar(number)
        return status

    def arguments_of(self, row: Row, S: np.ndarray, scratch: np.ndarray | NamedTuple) -> tuple:
        """What a kernel row is called with, in memory like the slab; None stands for time."""
        place, models = self.layout.places[row.node], row.models
        found: list[Any] = []
        for parameter in row.calc.parameters:
            name = parameter.name
            if parameter.kind == "t":
                found.append(None)
            elif name in models:
                found.append(models[name])
            elif name in row.reads:
                found.append(_argument(parameter, S[slice(*row.reads[name].span)]))
            elif name == "u":
                inputs = [S[slice(*s.span)] for s in place.inputs]
                found.append(inputs_as(parameter, row.calc, place.inputs, inputs))
            elif name == "work" and parameter.kind == "tuple":
                found.append(scratch)
            elif name in getattr(scratch, "_fields", ()):
                found.append(getattr(scratch, name))
            elif name == row.calc.parameters[-1].name:
                found.append(_argument(parameter, S[slice(*row.out)]))
            else:
                found.append(_argument(parameter, S[slice(*getattr(place, name))]))
        return tuple(found)

    def scratch(self, n: int) -> Any:
        """Views of a leaf's scratch, of the class of its prototype."""
        self.leave_scratch(n)
        known = self._scratch.get(n)
        if known is None or known[0] is not self.S or known[1] is not self.layout:
            views = views_of(self.S, self.layout.places[n].work[0], self.layout.prototypes[n])
            known = self._scratch[n] = self.S, self.layout, views
        return known[2]

    def leave_scratch(self, n: int) -> None:
        """Brings a leaf's scratch up to date after runs on complex numbers."""
        chain = self.left.pop(n, None)
        if chain is not None:
            chain.leave_scratch()

    def on_complex_numbers(self, first: int, rows: list[int]) -> bool:
        """Runs kernel rows of a leaf after each other, if the scalar is AutoDiffXd and machine code is at hand."""
        if self.scalar is not autodiff_class():
            return False
        from sheldrake.systems.framework._engine.complex_rows import chain_of

        chain = self.chains.get(first)
        if chain is None:
            chain = self.chains[first] = chain_of(self, rows)
        if chain is None:
            return False
        for r in rows:
            self.check_inputs(self.layout.rows[r])
        if not chain.run():
            return False
        self.left[chain.node] = chain
        return True

    def commit_abstract(self) -> None:
        """What unrestricted updates wrote to abstract states becomes the state."""
        for n, values in self.pending.items():
            first, last = self.layout.places[n].abstract
            self.abstract[first:last] = values
            self.serials["xa", n] += 1
        self.pending.clear()

    def discard_abstract(self) -> None:
        """Forgets what unrestricted updates wrote to abstract states."""
        self.pending.clear()

    def output_value(self, r: int) -> AbstractValue:
        """The value that abstract output row `r` fills."""
        value = self.values.get(r)
        if value is None:
            row = self.layout.rows[r]
            system = self.systems[row.node]
            value = self.values[r] = system._allocate_output(row.output)
        return value

    def context(self, n: int) -> Context:
        """The context of node `n`; the same object while somebody holds it."""
        known = self.contexts.get(n)
        context = None if known is None else known()
        if context is None:
            from sheldrake.systems.framework._context.context import DiagramContext, LeafContext

            kind = LeafContext if self.layout.nodes[n].leaf else DiagramContext
            context = kind._make(self, n, self.systems[n])
            self.contexts[n] = weakref.ref(context)
        return context

    # Copies.

    def clone(self) -> Store:
        """An independent copy; stepping both gives the same bits."""
        self.check_thread()
        for n in list(self.left):
            self.leave_scratch(n)
        new = self.on(copy_of(self.S), self.I.copy(), self.L.copy())
        for r in self.values:
            new.I[self.layout.stamp0 + r] = 0
        new.unsettled, new.waiting = self.unsettled, self.waiting.copy()
        new.rooms = {n: room.copy() for n, room in self.rooms.items()}
        return new

    def on(self, S: np.ndarray, I: np.ndarray, L: np.ndarray) -> Store:
        """A store on given memory, with copies of what this one has beside its memory."""
        new = object.__new__(Store)
        new.layout, new.systems, new.scalar, new.accuracy = self.layout, self.systems, self.scalar, self.accuracy
        new.S, new.I, new.L = S, I, L
        new.abstract = [v.Clone() for v in self.abstract]
        new.parameters = [v.Clone() for v in self.parameters]
        new.fixed = {k: (v.Clone() if isinstance(v, AbstractValue) else v) for k, v in self.fixed.items()}
        new.values = {}
        new._use_locks()
        new._begin()
        new.uncached, new._cold = self.uncached, set(self._cold)
        return new


def _argument(parameter: Parameter, array: np.ndarray) -> Any:
    """An array, or the table of it that a kernel takes."""
    return parameter.cls(array) if parameter.kind == "tuple" else array


def state_source(place: Place, n: int) -> tuple[str, int]:
    """What the only state of a leaf, discrete or continuous, is called among sources that are written."""
    return ("xd", place.groups[0]) if place.groups[1] > place.groups[0] else ("xc", n)


def not_connected(system: System, i: int, exported: tuple[Any, int] | None = None) -> RuntimeError:
    """The error for an input port without a value."""
    also = ""
    if exported is not None:
        also = f" (it is exported as input port '{exported[0]._inputs[exported[1]].name}' of {exported[0]._describe()})"
    return RuntimeError(
        f"InputPort::Eval(): required InputPort[{i}] ({system._inputs[i].name}) of {system._describe()} is not "
        f"connected{also}"
    )


__all__ = ["CONSTANT", "CONTINUOUS", "FAILED", "SAMPLED", "Store", "not_connected", "state_source"]
