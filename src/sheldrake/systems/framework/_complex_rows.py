"""Derivatives and updates in memory of AutoDiffXd: the kernels' machine code on complex numbers.

It is taken when it is ready, or when it has been asked for so often that compiling it pays; until then the kernels run
as Python on the duals themselves. Both give the same numbers to round-off.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from sheldrake.autodiffutils import _complex_step
from sheldrake.common._native import store as kernel_store
from sheldrake.common.kernel import jit_enabled
from sheldrake.systems.framework import _scratch
from sheldrake.systems.framework._declarations import DERIVATIVES

_calls: dict[tuple, int] = {}
"""How often chains of kernels ran as Python; -1: they cannot be compiled on complex numbers."""


def chain_of(store: Any, rows: list[int]) -> ComplexChain | None:
    """The machine code of rows that run after each other; None if it is not ready."""
    return on_complex(store, [store.layout.rows[r] for r in rows], lambda: ComplexChain(store, rows))


def on_complex(store: Any, rows: list[Any], make: Callable[[], Any]) -> Any:
    """What `make` makes of the machine code of these kernel rows on complex numbers; None if it is not ready."""
    if not all(row.native and store.systems[row.node]._complex_rows for row in rows) or not jit_enabled():
        return None
    key = tuple(row.calc for row in rows)
    calls = _calls.get(key, 0)
    if calls < 0 or not kernel_store.can_compile():
        return None
    if calls == 0 and all(kernel_store.is_ready(k.on_complex) for k in key):
        calls = _complex_step.PATIENCE
    _calls[key] = calls + 1
    if calls < _complex_step.PATIENCE:
        return None
    try:
        return make()
    except Exception:  # whatever numba says of a kernel that is not for complex numbers
        _calls[key] = -1
        return None


class ComplexChain:
    """Rows of one leaf that run after each other, on complex memory that has the slab's layout."""

    def __init__(self, store: Any, rows: list[int]):
        layout = store.layout
        found = [layout.rows[r] for r in rows]
        self.node = found[0].node
        place, prototype = layout.places[self.node], layout.prototypes[self.node]
        self._store, self._rows, self._T = store, rows, np.zeros(layout.size, complex)
        scratch, self._initial = complex_scratch(self._T, place.work[0], prototype)
        spans = {place.xc, place.xd, place.p, *(tuple(slot.span) for slot in place.inputs if slot.vector)}
        self._spans = [(0, 1), *sorted(span for span in spans if span[1] > span[0])]
        self._inputs = [_complex_step.Directions(store.S[a:b], None, self._T[a:b]) for a, b in self._spans]
        self._out = a, b = found[-1].out
        # An update finds x in x+ and need not fill all of it.
        self._plus = None if found[-1].kind == DERIVATIVES else _complex_step.Directions(store.S[a:b])
        self._calls = []
        for row in found:
            arguments = store.arguments_of(row, self._T, scratch)
            self._calls.append(row.calc.on_complex.bind(*(0.0 if a is None else a for a in arguments)))

    def run(self) -> bool:
        """Fills the last row's place in the slab; False, and nothing done, where only Python can say what is wrong."""
        S, T, (a, b) = self._store.S, self._T, self._out
        plus = self._plus
        sources = self._inputs if plus is None else [*self._inputs, plus]
        n = max(i.gather() for i in sources)
        if any(i.n not in (0, n) for i in sources) or self._inputs[0].n:
            return False
        t, slopes = float(T[0].real), np.empty((b - a, n))
        for k in range(max(n, 1)):
            for i in sources:
                i.set(k)
            if plus is not None:
                T[a:b] = plus.numbers
            for view, initial in self._initial:
                view[...] = initial
            if any(call.func(t, *call.args[1:]) for call in self._calls):
                return False
            if n:
                slopes[:, k] = T[a:b].imag
        S[a:b] = _complex_step.duals_of(T[a:b].real, slopes)
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
            at += _scratch.size_of(field)
        else:
            view = field.copy() if field.dtype == np.int64 else T[at : at + field.size].reshape(field.shape)
            initial.append((view, field))
            at += field.size
        views.append(view)
    return type(prototype)(*views), initial
