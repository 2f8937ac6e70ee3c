"""Derivatives and updates in memory of AutoDiffXd: the kernels' machine code on complex numbers.

It is taken when it is ready, or when it has been asked for so often that compiling it pays; until then the kernels run
as Python on the duals themselves. Both give the same numbers to round-off.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.autodiffutils import _complex_step
from sheldrake.autodiffutils._matrices import filled
from sheldrake.common._native import store as kernel_store
from sheldrake.common.kernel import jit_enabled
from sheldrake.systems.framework._declarations import DERIVATIVES
from sheldrake.systems.framework._engine.scratch import size_of

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.systems.framework._engine.store import Store

_calls: dict[tuple, int] = {}
"""How often chains of kernels ran as Python; -1: they cannot be compiled on complex numbers."""


def chain_of(store: Store, rows: list[int]) -> ComplexChain | None:
    """The machine code of rows that run after each other; None if it is not ready."""
    return on_complex(store, [store.layout.rows[r] for r in rows], lambda: ComplexChain(store, rows))


def on_complex(store: Store, rows: list[Any], make: Callable[[], Any]) -> Any:
    """What `make` makes of the machine code of these kernel rows on complex numbers; None if it is not ready."""
    if not rows or not jit_enabled():
        return None
    if not all(row.native and store.systems[row.node]._complex_rows for row in rows):
        return None
    key = tuple(row.calc for row in rows)
    calls = _calls.get(key, 0)
    if calls < 0:
        return None
    if calls == 0 and all(kernel_store.is_ready(k.on_complex) for k in key):
        calls = _complex_step.PATIENCE
    _calls[key] = calls + 1
    if calls < _complex_step.PATIENCE:
        return None
    try:
        return make()
    except (TypeError, ModuleNotFoundError):  # the kernel is not for complex numbers (a KernelError), or no compiler
        _calls[key] = -1
        return None


class ComplexChain:
    """Rows of one leaf that run after each other, on complex memory that has the slab's layout."""

    def __init__(self, store: Store, rows: list[int]):
        layout = store.layout
        found = [layout.rows[r] for r in rows]
        self.node = found[0].node
        place, prototype = layout.places[self.node], layout.prototypes[self.node]
        self._store, self._rows, self._T = store, rows, np.zeros(layout.size, complex)
        scratch, initial_scratch = complex_scratch(self._T, place.work[0], prototype)
        spans = {place.xc, place.xd, place.p, *(tuple(slot.span) for slot in place.inputs if slot.vector)}
        filled_before = {layout.span_of_fill(r) for r in layout.stages_before(rows[0])}
        spans |= filled_before | {tuple(slot.span) for row in found for slot in row.reads.values()}
        self._spans = [(0, 1), *sorted(span for span in spans if span[1] > span[0])]
        self._inputs = [_complex_step.Source(store.S[a:b], None, self._T[a:b]) for a, b in self._spans]
        self._out = a, b = found[-1].out
        resets = [
            (view, as_complex(initial, view))
            for view, initial in initial_scratch
            if not any(np.shares_memory(view, self._T[a:b]) for a, b in filled_before)
        ]
        # An update finds x in x+ and need not fill all of it.
        plus, copies, self._before = store.layout.plus, [], None
        if found[-1].kind != DERIVATIVES:
            self._before = store.S[a - plus : b - plus]
            copies.append((self._T[a:b], self._T[a - plus : b - plus]))
        made = [
            (row.calc, tuple(0.0 if a is None else a for a in store.arguments_of(row, self._T, scratch)))
            for row in found
        ]
        self._sweep = _complex_step.Sweep(made, _complex_step.imaginary_parts(self._T[a:b]), resets, copies)

    def run(self) -> bool:
        """Fills the last row's place in the slab; False, and nothing done, where only Python can say what is wrong."""
        S, (a, b) = self._store.S, self._out
        if self._before is not None and not all(map(operator.is_, S[a:b].tolist(), self._before.tolist())):
            return False
        if self._inputs[0].read():
            return False
        slopes = _complex_step.sweep_sources(self._sweep, self._inputs, float(self._T[0].real))
        if slopes is None or isinstance(slopes, int):
            return False
        S[a:b] = filled(self._T[a:b].real, slopes)
        self._last = [S[first:last].copy() for first, last in self._spans]
        return True

    def leave_scratch(self) -> None:
        """Fills the scratch in the slab with what the last run left, by running it again as Python."""
        S, spans = self._store.S, [*self._spans, self._out]
        now = [S[a:b].copy() for a, b in spans]
        for (a, b), values in zip(self._spans, self._last):
            S[a:b] = values
        for r in self._rows:
            self._store.compute(r)
        for (a, b), values in zip(spans, now):
            S[a:b] = values


def as_complex(initial: ArrayLike, view: np.ndarray) -> np.ndarray:
    """What is in an array at first, as an array like `view`."""
    found = np.empty(view.shape, view.dtype)
    found[...] = initial
    return found


def complex_scratch(T: np.ndarray, at: int, prototype: Any) -> tuple[Any, list[tuple[np.ndarray, Any]]]:
    """Scratch in complex memory, its integers elsewhere; and what is in its arrays at first."""
    if isinstance(prototype, int):
        view = T[at : at + prototype]
        return view, [(view, 0.0)]
    views: list[Any] = []
    initial: list[tuple[np.ndarray, Any]] = []
    for field in prototype:
        if isinstance(field, tuple):
            view, below = complex_scratch(T, at, field)
            initial += below
            at += size_of(field)
        else:
            view = field.copy() if field.dtype == np.int64 else T[at : at + field.size].reshape(field.shape)
            initial.append((view, field))
            at += field.size
        views.append(view)
    return type(prototype)(*views), initial
