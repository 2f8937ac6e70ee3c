"""One simulator's binding of the event loop to one context: native or interpreted."""

from __future__ import annotations

import ctypes
import operator
import sys
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._native.binding import HERE
from sheldrake.common._native.parallel import prepare
from sheldrake.common.kernel import Kernel
from sheldrake.systems.analysis._first_calls import FirstCalls
from sheldrake.systems.framework._declarations import DISCRETE, KIND_NAMES, PUBLISH, UNRESTRICTED
from sheldrake.systems.framework._engine import logs, python_rows
from sheldrake.systems.framework._engine.store import FAILED, Store
from sheldrake.systems.framework._event import EventStatus, checked_status
from sheldrake.systems.framework._kernels import integrate as _integrate
from sheldrake.systems.framework._kernels import loop as _loop
from sheldrake.systems.framework._kernels import program as _program
from sheldrake.systems.framework._kernels.integrate import Integrator
from sheldrake.systems.framework._kernels.program import Run

if TYPE_CHECKING:
    from collections.abc import Callable

    from sheldrake.systems.framework._engine.layout import Row

_MOVE = 2
"""In place of 1 in `SideWords.terminate`: an update asked for what moves memory; the step goes on when that is done."""
_TERMINATE = operator.index(_program.SideWords.terminate)
_ROW = ctypes.CFUNCTYPE(ctypes.c_int64)  # the caller hands over t, slab and words in registers: nobody looks


class Outcome:
    """What stops a span, as Python rows leave it: an exception, or an EventStatus."""

    def __init__(self) -> None:
        self.error: BaseException | None = None
        self.system: Any = None
        self.kind = ""
        self.status: EventStatus | None = None

    def failed(self) -> bool:
        """Whether an event reported failure."""
        return self.status is not None and self.status.severity() is EventStatus.Severity.kFailed


class Span:
    """The event loop on one store.

    Args:
        store: The context's memory.
        run: Settings and counts of the simulator.
        numbers: The integrator's.
        special: The simulator's own rows, by number after the program's: Python functions; None: never called.
            Those of `MONITOR` and behind are called when they have been enabled.
        native: Run the loop itself as machine code, where possible.
    """

    def __init__(self, store: Store, run: Run, numbers: Integrator, special: list[Any], native: bool = True):
        self.store, self.run, self.numbers = store, run, numbers
        self.layout, self.program = store.layout, store.layout.program
        self._slab = store.S
        self.outcome = Outcome()
        self._inputs_there = self._publish_inputs_there = False
        logs.grow(store)
        self._ctrl_c: KeyboardInterrupt | None = None
        self._at_hand: dict[int, Any] = {}  # see `Store.at_hand`
        self._held: dict[int, Any] = {}  # of each node, what its Python rows ask for again and again
        called = self.layout.called
        guard = [self._guard_row(r) if r in called else None for r in range(len(self.layout.rows))]
        guard += [f and self._guard_special(f) for f in special[: _program.MONITOR]]
        self.native = native and store.native
        self.python = [f if f is None or self._is_native(r) else FirstCalls(f, self, r) for r, f in enumerate(guard)]
        self.first_calls = {r: f for r, f in enumerate(self.python) if type(f) is FirstCalls}
        """Of Python rows, by number; those of the simulator come after the program's."""
        self._special = special
        self.python += [None] * (len(special) - _program.MONITOR)  # see `enable`
        self._logs: np.ndarray | None = None
        self._loops: dict[Kernel, Any] = {}
        self._words: tuple[np.ndarray, tuple] | None = None  # of all of them: they take the same arrays
        if self.native:
            self._bind()

    def check_inputs(self, of_publishes: bool = False) -> None:
        """Kernels see all inputs: those that the loop will call, or only its publishes, must have them all.

        Raises:
            RuntimeError: one has no value, naming it.
        """
        for row in self.layout.rows_that_need_inputs[of_publishes]:
            self.store.check_inputs(row)

    def _guard_row(self, r: int) -> Any:
        store, row = self.store, self.layout.rows[r]
        if row.node < 0:
            return None  # a witness row: filled in by the simulator
        if row.native:
            return self._checked_kernel(r, row) if row.free else partial(store._call_kernel, r, row)
        system = store.systems[row.node]
        if row.node not in self._held:
            ports = [system._input_port(i) for i in range(system.num_input_ports())]
            self._held[row.node] = store.context(row.node), ports
        call, goes_on = python_rows.bound(store, r), row.kind == PUBLISH
        return self._waiting(row, _guard(call, self.outcome, store, system, KIND_NAMES[row.kind], goes_on))

    def _waiting(self, row: Row, run: Any) -> Any:
        """An update after which memory may move before time goes on."""
        if row.kind not in (DISCRETE, UNRESTRICTED):
            return run
        store = self.store

        def update() -> int:
            status = run()
            if store.unsettled and not store.side.terminate:
                store.side.terminate = _MOVE
            return status

        return update

    def _checked_kernel(self, r: int, row: Row) -> Callable[[], int]:
        """A kernel called from Python, by `Initialize` or without a compiler: it must have its inputs."""
        store, outcome = self.store, self.outcome

        def run() -> int:
            try:
                store.check_inputs(row)
            except RuntimeError as e:
                outcome.error, outcome.system = e, None
                return FAILED
            return store._call_kernel(r, row)

        return run

    def _is_native(self, r: int) -> bool:
        return self.native and r < len(self.layout.rows) and self.layout.rows[r].native

    def call_directly(self, r: int) -> None:
        """Row r was timed often enough."""
        self.python[r] = self.first_calls[r].run
        if self.native:
            self.table[r] = self.address_of(self.python[r])

    def set_rows(self, functions: dict[int, Any]) -> None:
        """Gives rows that belong to no leaf their Python functions; before the first advance."""
        for r, function in functions.items():
            row = self.layout.rows[r]
            guarded = _guard(function, self.outcome, self.store, None, "", row.kind == PUBLISH)
            self.python[r] = self._waiting(row, guarded)
        if self.native:
            self._bind()

    def set_special(self, k: int, function: Callable[..., Any] | None, native: tuple[int, np.ndarray] | None) -> None:
        """Has a kernel do what is special row `k`.

        Args:
            k: Its number behind the program's rows.
            function: Calls it from Python.
            native: Its address and its words.
        """
        r = len(self.layout.rows) + k
        self.python[r] = function
        if native is not None:
            self.table[r], words = native
            at = self.program.at.copy()
            at[r] = len(self.program.words)
            self.program = self.program._replace(at=at, words=np.concatenate([self.program.words, words]))
            self._logs = None  # to be bound anew

    def enable(self, k: int) -> None:
        """Special row `k`, of those from `MONITOR` on, may be called from now on."""
        r = len(self.layout.rows) + k
        if self.python[r] is not None:
            return
        self.python[r] = self.first_calls[r] = FirstCalls(self._guard_special(self._special[k]), self, r)
        if self.native:
            self.table[r] = self.address_of(self.python[r])

    def _guard_special(self, function: Callable[..., Any]) -> Callable[..., Any]:
        return _guard(function, self.outcome, self.store, None, "", True)

    def guard(self, function: Callable[..., Any]) -> Callable[..., Any]:
        """A call that stops the span with the error of the function."""
        return _guard(function, self.outcome, self.store, None, "")

    def _bind(self) -> None:
        if "kernels" not in self.layout.made:
            prepare([*(row.calc for row in self.layout.rows if row.native), _loop.advance, _loop.begin])
            self.layout.made["kernels"] = True
        table: Any = np.zeros(len(self.python), np.int64)
        self._callbacks: list[Any] = []
        for r, function in enumerate(self.python):
            if self._is_native(r):
                table[r] = HERE.address(self.layout.rows[r].calc)
            elif function is not None:
                table[r] = self.address_of(function)
        self.table = table
        self._logs = None

    def address_of(self, function: Any) -> int | None:
        """Address of a function without arguments that gives a status."""
        callback = _ROW(function)
        self._callbacks.append(callback)
        return ctypes.c_void_p.from_buffer(callback).value  # `ctypes.cast` would make a cycle

    def advance(self, T: float) -> int:
        """Steps until T, an error, a termination, a full log, or the end of the budget; says which."""
        store = self.store
        store.enter()
        store.running, store.at_hand = self.run, self._at_hand
        try:
            code = self._advance(T)
        finally:
            store.running = store.at_hand = None
            store.leave()
        if code == _program.TERMINATED and store.i[_TERMINATE] == _MOVE:
            store.i[_TERMINATE] = 0
            _loop.clear_updates(self.program, store.side)
            return _program.BREAK
        return code

    def is_current(self) -> bool:
        """Whether its context's memory is still where it was."""
        return self._slab is self.store.S and self.layout is self.store.layout

    def _advance(self, T: float) -> int:
        if not self._inputs_there:
            self.check_inputs()
            self._inputs_there = True
        if not self.native:
            return int(_loop.advance(*self._tables(), self.python, T))
        bound = self._on_memory(_loop.advance)
        bound.set("T", T)
        return self._run(bound)

    def update_at_start(self) -> None:
        """Makes the updates of initialization; an error stays in the status."""
        if not self.native or not self._has_inputs():
            self.interpreted(_loop.update_at_start)
        else:
            self._run_alone(self._on_memory(_loop.update_at_start))
        if self.store.i[_TERMINATE] == _MOVE:
            self.store.i[_TERMINATE] = 0

    def begin(self, initializes: bool) -> None:
        """Sets the clocks and publishes what is due at the beginning; `initializes`: at initialization too."""
        if not self._publish_inputs_there:
            self.check_inputs(of_publishes=True)
            self._publish_inputs_there = True
        if not self.native:
            self.interpreted(_loop.begin, initializes)
            return
        bound = self._on_memory(_loop.begin)
        bound.set("initializes", initializes)
        self._run_alone(bound)

    def handle_pending(self) -> None:
        """Handles what is triggered, updates and publishes, while time stands still; an error stays in the status."""
        if not self.native or not self._has_inputs():
            self.interpreted(_loop.handle_pending)
            return
        self._run_alone(self._on_memory(_loop.handle_pending))

    def _run_alone(self, bound: Any) -> None:
        """Runs machine code that makes no steps; an error stays in the status."""
        self.store.enter()
        try:
            self._run(bound)
        finally:
            self.store.leave()
        if self.outcome.error is not None:
            self.store.side.status = self.store.side.status or FAILED

    def _has_inputs(self) -> bool:
        """Whether all inputs are there that kernels might see; else each call looks for its own."""
        if not self._inputs_there:
            i, first = self.store.i, self.layout.fixed0
            rows, _ = self.layout.rows_that_need_inputs
            self._inputs_there = all(i[first + free] for row in rows for free in row.free)
        return self._inputs_there

    def _on_memory(self, kernel: Kernel) -> Any:
        """A kernel of the event loop, bound to what it works on as long as that is where it is."""
        if self._logs is not self.store.L:
            self._logs, self._loops, self._words = self.store.L, {}, None
        bound = self._loops.get(kernel)
        if bound is None:
            bound = self._loops[kernel] = self._bound(kernel)
        return bound

    def _bound(self, kernel: Kernel) -> Any:
        if self._words is None:
            program, *others = self._tables()
            arrays = dict(zip(_loop.advance.names, (program, *others, self.table)))
            known = self.layout.known_words if program is self.layout.program else {}
            self._words = _loop.advance.form.words(arrays, known), tuple(arrays.values())
        words, keep = self._words
        return kernel.form.bind(words.copy(), keep)

    def inside(self, kernel: Any, T: float) -> None:
        """Calls a kernel with arguments as those of `advance` from within a step; an error stays in the status."""
        if not self.native:
            kernel(*self._tables(), self.python, T)
            return
        bound = self._on_memory(kernel)
        bound.set("T", T)
        bound()

    def _run(self, bound: Any) -> int:
        """Runs machine code that calls Python rows; its status."""
        others, sys.unraisablehook = sys.unraisablehook, self._keep_ctrl_c
        self._others = others
        try:
            code = bound()
        finally:
            sys.unraisablehook = others
        if self._ctrl_c is not None:
            self.outcome.error, self._ctrl_c, code = self._ctrl_c, None, _program.ERROR
        return code

    def _tables(self) -> tuple:
        """What the event loop works on."""
        store = self.store
        return self.program, self.run, self.numbers, store.S, store.side, store.L

    def _keep_ctrl_c(self, unraisable: Any) -> None:
        """Keeps a KeyboardInterrupt that came before a Python row could catch it: ctypes would drop it."""
        if issubclass(unraisable.exc_type, KeyboardInterrupt):
            self._ctrl_c = KeyboardInterrupt()
        else:
            self._others(unraisable)

    def interpreted(self, function: Callable[..., Any], *args: object) -> Any:
        """Runs another function of the loop, interpreted."""
        self.store.enter()
        try:
            return function(*self._tables(), self.python, *args)
        finally:
            self.store.leave()

    def raise_error(self) -> None:
        """Raises what stopped the span, with the system and the time, and clears it."""
        store, outcome = self.store, self.outcome
        status, r = int(store.side.status), int(store.side.row)
        store.side.status = 0
        error, system, kind = outcome.error, outcome.system, outcome.kind
        outcome.error = outcome.status = None
        if error is None:
            error, system, kind = failure(store, self.numbers, status, r)
        if system is not None:
            _add_note(error, f"in the {kind} of {system._describe()} at t = {_plain(store.S[0])} s")
        raise error


def failure(store: Store, numbers: Integrator, status: int, r: int) -> tuple[BaseException, Any, str]:
    """What the status of a kernel row, or of the integrator, stands for: error, system or None, what it computed."""
    if status == _integrate.MIN_STEP_STATUS:
        error = RuntimeError(
            f"Error control asks for a step below the minimum step size ({numbers.h_min:g} s requested) at time "
            f"{float(store.S[0])!r}; the derivatives may be discontinuous."
        )
        return error, None, ""
    row = store.layout.rows[r]
    system = store.systems[row.node]
    return store.explain(row, status), system, KIND_NAMES[row.kind]


def _plain(t: Any) -> float:
    return float(t) if isinstance(t, np.floating) else t


def _guard(
    function: Any, outcome: Outcome, store: Store, system: Any, kind: str, goes_on: bool = False
) -> Callable[..., Any]:
    """A call that never raises: an error stops the span and waits to be raised by the simulator.

    Where it `goes_on`, as publishes do, a status of failure ends the step when all else of its end is done.
    """

    def run() -> int:
        try:
            result = function()
            if result is None:
                return 0
            failed = note_status(checked_status(result), outcome, store)
            return 0 if goes_on else failed
        except BaseException as e:
            outcome.error, outcome.system, outcome.kind = e, system, kind
            return FAILED

    return run


def note_status(status: EventStatus, outcome: Outcome, store: Store) -> int:
    """Keeps the worst status of the events of a span, and ends it; gives the row's status."""
    severity = status.severity()
    if severity is EventStatus.Severity.kDidNothing:
        store.side.idle += 1
        return 0
    if severity is EventStatus.Severity.kSucceeded:
        return 0
    store.side.terminate = 1
    if outcome.status is None:
        outcome.status = EventStatus.Succeeded()
    outcome.status.KeepMoreSevere(status)
    if severity is EventStatus.Severity.kFailed:
        outcome.error, outcome.system = None, None
        return FAILED
    return 0


def _add_note(error: BaseException, note: str) -> None:
    add = getattr(error, "add_note", None)
    if add is not None:
        add(note)
    else:  # before Python 3.11
        error.__notes__ = [*getattr(error, "__notes__", []), note]  # type: ignore[attr-defined]


__all__ = ["PUBLISH", "Outcome", "Span", "failure", "note_status"]
